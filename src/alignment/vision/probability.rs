//! How probable it is that a thing stands where it seems to: what speaks for it, weighed by how often it was right.
//!
//! A logistic regression on what a picture says for and against a placement. Its weights are fitted by
//! `scripts/sight_weights.py` to 453 placements, of which 320 were right, on the pictures with known truth of
//! `examples/sight_battery` that were looked at while sight was made (real, developed) and on 108 photographs of the laboratory
//! (`examples/camera_see`), with a quadratic penalty and no negative weight; `held` and `fresh` have no part in them. Each
//! photograph or background judged by weights that were fitted without it, all 282 placements said to be 0.9 sure or more were
//! right, and 31 of 36 between 0.5 and 0.9; `docs/seeing.md` has the rest.
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
    /// How near the key points of its contour put it to where its outline fits.
    Agree,
}

/// What is said, in this order.
const SAYS: [Says; 8] = [
    Says::Score,
    Says::Weakest,
    Says::Cut,
    Says::Elsewhere,
    Says::Shape,
    Says::Gap,
    Says::Whole,
    Says::Agree,
];
/// Offset and weights in the same order, of opaque and of clear things, as fitted.
const OFFSET: [f64; 2] = [-6.74, -5.16];
const WEIGHTS: [[f64; 8]; 2] = [
    [1.71, 4.11, 1.56, 0.93, 1.16, 1.90, 0.37, 1.14],
    [0.62, 1.30, 1.27, 1.19, 1.18, 3.15, 0.04, 1.42],
];
/// What right placements have at their median, in the same order, of both.
const USUAL: [[f64; 8]; 2] =
    [[0.83, 0.99, 0.94, 1.0, 0.4, 1.0, 0.0, 0.99], [0.92, 1.0, 0.94, 1.0, 0.06, 1.0, 0.0, 0.98]];
/// Where what is said ends to count: beyond it more is not surer. A cut that overlaps by less than half is none, and
/// none counts as such; half a score ahead of all else is clear, so is a tenth ahead of another solid.
const CUT: [f64; 2] = [0.5, 1.0];
const ELSEWHERE: [f64; 2] = [0.0, 0.5];
const SHAPE: [f64; 2] = [-0.15, 0.1];
const GAP: [f64; 2] = [0.0, 0.3];
/// How far apart the two ways may put a thing for their agreement to fall to a third, m: what is called right here. A
/// contour that gives no key points agrees with nothing.
const AGREE: f64 = 0.02;

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
    pub(super) apart: Option<f64>,
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
        evidence.apart.map_or(0.0, |apart| (-apart / AGREE).exp()),
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
        apart: Some(0.0),
    };

    #[test]
    fn what_is_as_it_should_be_is_sure_and_each_lack_takes_of_it() {
        let (sure, _) = of(&CLEAN, false);
        assert!(sure > 0.95, "{sure}");
        let lacks = [
            (Evidence { weakest: 0.3, ..CLEAN }, Says::Weakest),
            (Evidence { cut: None, ..CLEAN }, Says::Cut),
            (Evidence { apart: None, ..CLEAN }, Says::Agree),
            (Evidence { elsewhere: 0.0, ..CLEAN }, Says::Elsewhere),
        ];
        for (evidence, what) in lacks {
            let (less, why) = of(&evidence, false);
            assert!(less < sure && why == what, "{less} {why:?}");
        }
    }
}
