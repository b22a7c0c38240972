//! How probable it is that a thing stands where it seems to: what speaks for it, weighed by how often it was right.
//!
//! A logistic regression on what a picture says for and against a placement. Its weights are those of the pictures with
//! known truth of `examples/sight_battery` (the photographs and the developed half) and of 72 photographs of the
//! laboratory, 469 placements of which 247 were right, fitted with a quadratic penalty and no negative weight; the half
//! of the battery that is held back had no part in them. Left out one background at a time, all 206 of those said to be
//! 0.9 sure or more were right. How well it does on what it was not fitted to: `docs/results.md`.
//!
//! Source: Cox, "The regression analysis of binary sequences", 1958; Platt, "Probabilistic outputs for support vector
//! machines", 1999 (a score as a probability).

/// What speaks for a placement; each grows with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Says {
    /// The whole score.
    Score,
    /// Support of the weakest part of the outline.
    Weakest,
    /// Overlap of the picture's own cut with the silhouette.
    Cut,
    /// How far it is ahead of what looks like it elsewhere.
    Elsewhere,
    /// How far it is ahead of other solids at its place.
    Shape,
    /// How far it is ahead of the second place.
    Gap,
    /// Whole edges of the silhouette that are there.
    Whole,
}

/// What is said, in this order.
const SAYS: [Says; 7] =
    [Says::Score, Says::Weakest, Says::Cut, Says::Elsewhere, Says::Shape, Says::Gap, Says::Whole];
/// Offset and weights in the same order, of opaque and of clear things, as fitted.
const OFFSET: [f64; 2] = [-7.06, -3.71];
const WEIGHTS: [[f64; 7]; 2] =
    [[2.11, 4.41, 2.43, 1.27, 1.08, 1.76, 0.42], [0.0, 0.79, 1.23, 1.55, 3.64, 4.16, 0.35]];
/// What right placements have at their median, in the same order, of both.
const USUAL: [[f64; 7]; 2] =
    [[0.8, 0.99, 0.95, 1.0, 0.3, 1.0, 0.0], [0.92, 0.99, 0.95, 1.0, 0.07, 1.0, 0.0]];
/// Where what is said ends to count: beyond it more is not surer. A cut that overlaps by less than half is none, and
/// none counts as such; half a score ahead of all else is clear, so is a tenth ahead of another solid.
const CUT: [f64; 2] = [0.5, 1.0];
const ELSEWHERE: [f64; 2] = [0.0, 0.5];
const SHAPE: [f64; 2] = [-0.15, 0.1];
const GAP: [f64; 2] = [0.0, 0.3];

/// The numbers that are weighed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evidence {
    pub(super) score: f64,
    pub(super) weakest: f64,
    pub(super) cut: Option<f64>,
    pub(super) elsewhere: f64,
    pub(super) shape: f64,
    pub(super) gap: f64,
    pub(super) missing: f64,
}

/// Returns the probability of a placement, 0 to 1, and what speaks most against it.
pub(super) fn of(evidence: &Evidence, is_clear: bool) -> (f64, Says) {
    let within = |value: f64, [low, high]: [f64; 2]| value.clamp(low, high);
    let said = [
        evidence.score,
        evidence.weakest,
        2.0 * within(evidence.cut.unwrap_or(CUT[0]), CUT) - 1.0,
        2.0 * within(evidence.elsewhere, ELSEWHERE),
        4.0 * within(evidence.shape, SHAPE),
        within(evidence.gap, GAP) / GAP[1],
        -4.0 * evidence.missing,
    ];
    let kind = usize::from(is_clear);
    let mut sum = OFFSET[kind];
    let mut against = (f64::NEG_INFINITY, Says::Score);
    for (k, what) in SAYS.into_iter().enumerate() {
        sum += WEIGHTS[kind][k] * said[k];
        let lacks = WEIGHTS[kind][k] * (USUAL[kind][k] - said[k]);
        if lacks > against.0 {
            against = (lacks, what);
        }
    }
    (1.0 / (1.0 + (-sum).exp()), against.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLEAN: Evidence = Evidence {
        score: 0.85,
        weakest: 1.0,
        cut: Some(0.97),
        elsewhere: 0.6,
        shape: 0.08,
        gap: 0.5,
        missing: 0.0,
    };

    #[test]
    fn what_is_as_it_should_be_is_sure_and_each_lack_takes_of_it() {
        let (sure, _) = of(&CLEAN, false);
        assert!(sure > 0.95, "{sure}");
        let lacks = [
            (Evidence { weakest: 0.3, ..CLEAN }, Says::Weakest),
            (Evidence { cut: None, ..CLEAN }, Says::Cut),
            (Evidence { elsewhere: 0.0, ..CLEAN }, Says::Elsewhere),
        ];
        for (evidence, what) in lacks {
            let (less, why) = of(&evidence, false);
            assert!(less < sure && why == what, "{less} {why:?}");
        }
    }
}
