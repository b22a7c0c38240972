//! Whether an effect means anything: an effect whose numbers say nothing is refused wherever one is chosen.
//!
//! A fit always ends somewhere. Where the data ask for nothing it ends at the end of a range, at a size
//! that its own uncertainty exceeds, or at one that nobody sees in the outputs; names come from numbers that
//! say something.

use super::candidates::Candidate;
use super::edit::Patch;
use super::estimate::Point;
use super::hypothesis::{Chosen, Hypothesis, LEAST_EVIDENCE, Question, with_values};

/// A gain beyond this either way says that what it scales does not act, or that nothing else does.
const LARGEST_GAIN: f64 = 1e4;
/// A gain this near to 1 is one: no bench calibrates a scale better, or knows its input better between rows.
const NEAR_ONE: f64 = 1e-3;
/// A gain within so many standard deviations of 0 says that what it scales does not act.
const NO_GAIN: f64 = 5.0;
/// The part of a shape's range that counts as its end.
const END: f64 = 0.005;

impl Hypothesis {
    /// Whether the numbers of one of its effects say nothing, or that the effect is another one.
    pub fn is_degenerate(&self, effect: &Chosen) -> bool {
        says_nothing(effect.candidate.kind, &with_values(&effect.patch, &self.fitted, true))
    }
}

impl Question<'_> {
    /// Whether every effect of a hypothesis means something: by its numbers, and by what it changes.
    pub(super) fn is_sound(&self, hypothesis: &Hypothesis) -> bool {
        let empty = |e: &Chosen| hypothesis.is_degenerate(e) || self.is_idle(hypothesis, e);
        !hypothesis.effects.iter().any(empty)
    }

    /// Whether an effect came out as nothing before.
    pub(super) fn is_refused(&self, candidate: &Candidate) -> bool {
        self.refused.iter().any(|(kind, at)| *kind == candidate.kind && *at == candidate.at)
    }

    /// The hypothesis without those of its effects that mean nothing, which are not tried again.
    pub(super) fn refuse(&mut self, nominal: &Hypothesis, best: Hypothesis) -> Hypothesis {
        let before = best.effects.clone();
        let kept = self.sound(nominal, best);
        let gone = before.iter().map(|e| &e.candidate);
        let gone = gone.filter(|c| kept.effects.iter().all(|e| e.candidate != **c));
        self.refused.extend(gone.map(|c| (c.kind, c.at.clone())));
        kept
    }

    /// The hypothesis without those of its effects that mean nothing.
    pub(super) fn sound(&self, nominal: &Hypothesis, mut best: Hypothesis) -> Hypothesis {
        while let Some(i) =
            best.effects.iter().position(|e| best.is_degenerate(e) || self.is_idle(&best, e))
        {
            let mut fewer = best.effects.clone();
            fewer.remove(i);
            best = match self.rebuilt(nominal, &fewer, &best, 40) {
                Some(poor) if !fewer.is_empty() => poor,
                _ => nominal.clone(),
            };
        }
        best
    }

    /// Whether the outputs on the data fitted are the same with none of an effect, to within the noise.
    pub(super) fn is_idle(&self, hypothesis: &Hypothesis, effect: &Chosen) -> bool {
        let fitted = &hypothesis.fitted;
        let mut none: Point = fitted.train.point.clone();
        let mut has_amount = false;
        for param in &effect.patch.params {
            let at = fitted.compiled.params.iter().position(|p| p.name == param.name);
            if let (Some(at), Some(neutral)) = (at, param.neutral) {
                none.params[at] = neutral;
                has_amount = true;
            }
        }
        let task = self.bench.task(&fitted.compiled);
        // What has no amount is none at the end of its range, and what runs away without it is not idle.
        let (true, Ok(with), Ok(without)) =
            (has_amount, task.run(&fitted.train.point), task.run(&none))
        else {
            return false;
        };
        let n_out = self.bench.scales.len();
        let noise: Vec<f64> = (0..n_out)
            .map(|o| self.bench.train[0].noise[o].max(1e-9 * self.bench.scales[o]))
            .collect();
        let changed: f64 = with
            .iter()
            .zip(&without)
            .enumerate()
            .map(|(i, (a, b))| ((a - b) / noise[i % n_out]).powi(2))
            .sum();
        changed < LEAST_EVIDENCE
    }
}

/// Whether the fitted numbers of an effect say that it is none, another one, or anything at all.
pub(super) fn says_nothing(kind: &str, patch: &Patch) -> bool {
    let params = &patch.params;
    let role = |name: &str| params.iter().find(|p| p.role == name).map(|p| p.value);
    let absurd = params.iter().any(|p| {
        let gain = (p.neutral == Some(1.0)).then_some(p.value.abs());
        !p.value.is_finite()
            || gain.is_some_and(|g| !(1.0 / LARGEST_GAIN..LARGEST_GAIN).contains(&g))
            || p.neutral == Some(1.0) && (p.value - 1.0).abs() < NEAR_ONE
            || gain.zip(p.std).is_some_and(|(g, std)| std.is_finite() && g < NO_GAIN * std)
    });
    // A shape at the end of its range is that of no effect, or of another one.
    let at_end = patch.shapes().any(|p| {
        let Some([low, high]) = p.range else { return false };
        let room = END * (high - low);
        let at_low = if low > 0.0 { p.value < 1.05 * low } else { p.value - low < room };
        at_low || high - p.value < room
    });
    // What the data leave to something else free (an infinite deviation) is judged by what it changes, and by whether
    // what is free does as well alone (`stand_in`).
    let mut known = params
        .iter()
        .filter_map(|p| Some(((p.value - p.neutral.unwrap_or(0.0)).abs(), p.std?)))
        .filter(|(_, std)| std.is_finite())
        .peekable();
    let unsure = known.peek().is_some() && known.all(|(size, std)| size <= std && std > 0.0);
    // A friction that is lower at breakaway than in motion has no peak there.
    let inverted = kind == "stribeck_friction" && role("stiction") <= role("torque");
    absurd || at_end || unsure || inverted
}

#[cfg(test)]
mod tests {
    use super::super::edit::NewParam;
    use super::super::fitting::Fitted;
    use super::super::made::unseen;
    use super::*;

    fn number(neutral: Option<f64>, value: f64, std: f64) -> NewParam {
        NewParam {
            role: "coefficient",
            name: "c".into(),
            dimension: None,
            range: neutral.is_none().then_some([0.0, 10.0]),
            neutral,
            value,
            std: Some(std),
        }
    }

    fn refused(kind: &str, params: &[NewParam]) -> bool {
        says_nothing(kind, &Patch { params: params.to_vec(), ..Patch::default() })
    }

    #[test]
    fn numbers_that_say_nothing_are_refused() {
        let amount = |value, std| number(Some(0.0), value, std);
        assert!(!refused("dry_friction", &[amount(0.3, 0.1)]));
        assert!(refused("dry_friction", &[amount(0.3, 0.4)]), "less sure than large");
        assert!(refused("dry_friction", &[amount(f64::NAN, 0.1)]));
        assert!(refused("dry_friction", &[amount(f64::INFINITY, 0.1)]));
        // One number of two may be nothing: dry friction one way only.
        assert!(!refused("asymmetric_friction", &[amount(0.3, 0.1), amount(0.0, 0.1)]));
        assert!(refused("asymmetric_friction", &[amount(0.1, 0.2), amount(0.0, 0.1)]));
        let gain = |value, std| number(Some(1.0), value, std);
        assert!(!refused("input_gain", &[gain(0.001, 1e-5)]), "metres for millimetres");
        assert!(refused("input_gain", &[gain(1e114, f64::INFINITY)]));
        assert!(refused("input_gain", &[gain(1e-9, 1e-12)]), "nothing acts any more");
        assert!(refused("input_gain", &[gain(-0.0018, 6e-4)]), "it may as well be 0");
        assert!(refused("input_gain", &[gain(1.01, 0.02)]));
        assert!(refused("input_gain", &[gain(0.9999, 1e-5)]), "nobody knows a scale so well");
        let shape = |value, std| number(None, value, std);
        assert!(!refused("input_delay", &[shape(5.0, 0.1)]));
        assert!(
            refused("input_delay", &[shape(0.001, 1e-4)]) && refused("lag", &[shape(10.0, 0.1)])
        );
        // A level that trades against a scale is not known, and is one all the same.
        assert!(!refused("overflow", &[shape(5.0, f64::INFINITY)]));
    }

    #[test]
    fn friction_that_is_least_at_breakaway_is_not_stribeck() {
        let law = |kinetic, stiction| {
            let kinetic = NewParam { role: "torque", ..number(Some(0.0), kinetic, 0.01) };
            let stiction = NewParam { role: "stiction", ..number(Some(0.0), stiction, 0.01) };
            [kinetic, stiction, number(None, 1.0, 0.1)]
        };
        assert!(!refused("stribeck_friction", &law(0.3, 0.7)));
        assert!(refused("stribeck_friction", &law(0.7, 0.3)));
    }

    /// A first-order lag with a force of amount `c` and the form `force`, fitted to none of it.
    fn with_force(force: &str) -> bool {
        let text = format!(
            "model m {{\n input u\n param c = free ~ 0.5\n state x = 0\n x' = u - x + c*{force}\n output x = x\n}}\n"
        );
        let bench = unseen(50, 0.01, f64::sin);
        let compiled = bench.prepare(&text, "m").unwrap();
        let point = Point { params: vec![0.5], starts: vec![vec![None]] };
        let train = bench.task(&compiled).judge(&point).unwrap();
        let params = vec![NewParam { name: "c".into(), ..number(Some(0.0), 0.5, 0.1) }];
        let candidate = Candidate {
            kind: "unknown",
            at: "x".into(),
            patches: Vec::new(),
            equation: String::new(),
            within: &[],
        };
        let effect = Chosen { candidate, patch: Patch { params, ..Patch::default() } };
        let held = train.clone();
        let fitted = Fitted { text, compiled, train };
        let hypothesis = Hypothesis::of(vec![effect.clone()], fitted, held);
        let (floors, refused, whole) = (vec![0.0], Vec::new(), [0.0; 2]);
        let given = super::super::edit::model_in(&hypothesis.fitted.text, "m").unwrap();
        let question = Question { bench, name: "m", given, floors, refused, whole };
        question.is_idle(&hypothesis, &effect)
    }

    #[test]
    fn an_effect_without_which_the_outputs_stay_the_same_is_idle() {
        assert!(with_force("max(u - 2, 0)"), "the input never exceeds 1");
        assert!(!with_force("max(u - 0.5, 0)"));
    }
}
