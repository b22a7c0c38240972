//! Effects that only stand in for free parameters of the model: a gain of the input beside a mass that is free.
//!
//! None of their numbers is determined, since each trades against free parameters, and the model follows the
//! recordings as well without them. Where one seems to pay all the same, the fit without it had come to rest too
//! early: the way along which nothing changes, from the effect to none of it, ends where that fit belongs. What
//! is undetermined but cannot be led to none, such as a brim whose level has no scale, is an effect.

use super::fitting::Fitted;
use super::hypothesis::{Chosen, Hypothesis, Question, with_values};
use super::search::Search;
use super::wording;

/// Parts of the way to none of an effect; the rest is fitted anew at the end of each.
const PARTS: u32 = 16;
/// A first step of this part of the way shows how the rest goes with the effect; steps double up to a whole part. What
/// swings over its top for long goes elsewhere with a thousandth more of a torque.
const FIRST: f64 = 1e-3;
/// Most iterations of each of these fits.
const ITERATIONS: usize = 10;

impl Question<'_> {
    /// The hypothesis without the first of its effects that only stands in for free parameters, with these where the
    /// effect puts them, and which one that was; `None` when there is no such effect.
    pub(super) fn without_stand_in(
        &self,
        nominal: &Hypothesis,
        hypothesis: &Hypothesis,
    ) -> Option<(Hypothesis, usize)> {
        (0..hypothesis.effects.len())
            .find_map(|at| Some((self.replaced(nominal, hypothesis, at)?, at)))
    }

    /// Takes what only stands in for free parameters out of what a search found.
    pub(super) fn replace_stand_ins(&self, search: &mut Search) {
        while let Some((plain, at)) = self.without_stand_in(&search.nominal, &search.best) {
            search.best = plain;
            search.judged.remove(at);
        }
        if search.best.effects.is_empty() {
            search.nominal = search.best.clone();
        }
    }

    /// The hypothesis with the last amount of an effect at none, where each of its numbers trades against what is free in the
    /// model, and the others are told then: of a damping by direction beside a free one that is the difference. It fits as well.
    pub(super) fn determined(&self, mut best: Hypothesis, notes: &mut Vec<String>) -> Hypothesis {
        for at in 0..best.effects.len() {
            let effect = &best.effects[at];
            let amounts: Vec<_> =
                effect.patch.params.iter().filter(|p| p.neutral.is_some()).collect();
            let [_, .., last] = amounts[..] else { continue };
            let mut ahead = best.fitted.clone();
            let place = ahead.compiled.params.iter().position(|p| p.name == last.name);
            let (Some(place), Some(none)) = (place, last.neutral) else { continue };
            if !is_undetermined(effect, &best.fitted) {
                continue;
            }
            let candidate = &effect.candidate;
            let note = wording::only_beside(candidate.kind, &candidate.at, last.role, none);
            ahead.train.point.params[place] = none;
            let held = [last.name.clone()];
            let found = self
                .bench
                .fit_beside(&ahead.text, self.name, &ahead, 40, &held)
                .and_then(|fitted| self.judged(best.effects.clone(), fitted, Some(&best)))
                .filter(|found| !is_undetermined(&found.effects[at], &found.fitted))
                .filter(|found| !self.is_richer(found, &best));
            if let Some(found) = found {
                best = found;
                notes.push(note);
            }
        }
        best
    }

    /// The hypothesis without an effect that only stands in for free parameters.
    fn replaced(
        &self,
        nominal: &Hypothesis,
        hypothesis: &Hypothesis,
        at: usize,
    ) -> Option<Hypothesis> {
        let effect = &hypothesis.effects[at];
        if !is_undetermined(effect, &hypothesis.fitted) {
            return None;
        }
        let fitted = self.led_to_none(&hypothesis.fitted, effect)?;
        let mut fewer = hypothesis.effects.clone();
        fewer.remove(at);
        let led = Hypothesis { fitted, ..hypothesis.clone() };
        let plain = self.rebuilt(nominal, &fewer, &led, 40)?;
        (!self.is_richer(&plain, hypothesis)).then_some(plain)
    }

    /// Leads an effect to none of it, part by part, and everything else that is free with it; `None` for one that has
    /// no amount, or where the model no longer runs.
    fn led_to_none(&self, from: &Fitted, effect: &Chosen) -> Option<Fitted> {
        let own = &effect.patch.params;
        let names: Vec<String> = own.iter().map(|p| p.name.clone()).collect();
        let params = &from.compiled.params;
        let none: Vec<Option<f64>> = params
            .iter()
            .map(|p| own.iter().find(|o| o.name == p.name).and_then(|o| o.neutral))
            .collect();
        if none.iter().all(Option::is_none) {
            return None;
        }
        let begin = &from.train.point.params;
        let (mut here, mut part) = (from.clone(), 0.0_f64);
        let mut slopes: Vec<f64> = vec![0.0; begin.len()];
        let whole = (1..=PARTS).map(|k| f64::from(k) / f64::from(PARTS));
        let small = std::iter::successors(Some(FIRST), |part| Some(2.0 * part));
        let small = small.take_while(|part| *part < 1.0 / f64::from(PARTS));
        for next in small.chain(whole) {
            let mut ahead = here.clone();
            for (i, value) in ahead.train.point.params.iter_mut().enumerate() {
                let led = *value + slopes[i] * (next - part);
                *value = match (none[i], params[i].range) {
                    (Some(none), _) => between(begin[i], none, next),
                    (None, Some([low, high])) => led.clamp(low, high),
                    (None, None) => led,
                };
            }
            let found = self.bench.fit_beside(&here.text, self.name, &ahead, ITERATIONS, &names)?;
            let (new, old) = (&found.train.point.params, &here.train.point.params);
            slopes = new.iter().zip(old).map(|(new, old)| (new - old) / (next - part)).collect();
            (here, part) = (found, next);
        }
        Some(here)
    }
}

/// Whether the data determine none of the numbers of an effect.
fn is_undetermined(effect: &Chosen, fitted: &Fitted) -> bool {
    let own = with_values(&effect.patch, fitted, true).params;
    !own.is_empty() && own.iter().all(|param| param.std.is_some_and(f64::is_infinite))
}

/// A part of the way from a value to another: by ratio where both have one sign, else along a line.
fn between(from: f64, to: f64, part: f64) -> f64 {
    if from * to > 0.0 { from * (to / from).powf(part) } else { from + part * (to - from) }
}

#[cfg(test)]
mod tests {
    use super::super::candidates::Candidate;
    use super::super::edit::{NewParam, Patch, apply, model_in};
    use super::super::estimate::Point;
    use super::super::made::bench;
    use super::*;

    /// The mass of what follows `x' = u/mass - x`.
    const MASS: f64 = 0.31;

    fn model(mass: &str) -> String {
        format!(
            "model m {{\n input u\n param mass = {mass}\n state x = 0\n x' = u/mass - x\n output x = x\n}}\n"
        )
    }

    #[test]
    fn a_gain_beside_a_mass_that_is_free_only_stands_in_for_it() {
        let bench = bench(&model(&format!("{MASS}")));
        let text = model("free ~ 0.25 in 0.001 to 100");
        let gain = NewParam {
            role: "gain",
            name: "u_gain".into(),
            dimension: None,
            range: None,
            neutral: Some(1.0),
            value: 0.7,
            std: None,
        };
        let input = Some(("u".into(), "u_gain*({})".into()));
        let patch = Patch { params: vec![gain], input, ..Patch::default() };
        let rich = apply(&text, "m", &patch).unwrap();
        let candidate = Candidate {
            kind: "input_gain",
            at: "u".into(),
            patches: Vec::new(),
            equation: String::new(),
            within: &[],
        };
        let effect = Chosen { candidate, patch };
        // As a fit that came to rest far from the mass.
        let compiled = bench.prepare(&text, "m").unwrap();
        let point = Point { params: vec![0.25], starts: vec![vec![None]] };
        let train = bench.task(&compiled).judge(&point).unwrap();
        let stuck = Fitted { text: text.clone(), compiled, train };
        let fitted = bench.fit(&rich, "m", &stuck, 40).unwrap();
        let given = model_in(&text, "m").unwrap();
        let (floors, refused, whole) = (vec![0.0], Vec::new(), [1.0; 2]);
        let question = Question { bench, name: "m", given, floors, refused, whole };
        let nominal = question.judged(Vec::new(), stuck, None).unwrap();
        let rich = question.judged(vec![effect.clone()], fitted, None).unwrap();
        assert!(is_undetermined(&effect, &rich.fitted), "{:?}", rich.fitted.train.std);
        let (plain, at) = question.without_stand_in(&nominal, &rich).unwrap();
        let mass = plain.fitted.train.point.params[0];
        assert!(at == 0 && plain.effects.is_empty());
        assert!((mass / MASS - 1.0).abs() < 0.01, "{mass}");
    }

    #[test]
    fn the_way_to_none_is_even_in_ratio_or_in_difference() {
        assert!((between(0.01, 1.0, 0.5) - 0.1).abs() < 1e-12);
        assert!((between(3.0, 0.0, 1.0 / 3.0) - 2.0).abs() < 1e-12);
        assert!((between(-2.0, 1.0, 1.0) - 1.0).abs() < 1e-12);
    }
}
