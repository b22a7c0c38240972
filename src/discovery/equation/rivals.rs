//! What each effect is worth beside the others, and what could stand in its place.

use rayon::prelude::*;

use super::candidates::{Candidate, candidates};
use super::edit::{apply, model_in};
use super::hypothesis::{
    Chosen, Gain, Hypothesis, IMPERFECTION, LEAST_EVIDENCE, Question, with_values,
};
use super::search::Tried;
use crate::discovery::finding::TIE;

/// A rival of a chosen effect.
#[derive(Debug, Clone)]
pub struct Rival {
    /// The effect.
    pub candidate: Candidate,
    /// With its fitted values.
    pub hypothesis: Hypothesis,
    /// How much worse its criterion is; negative when better.
    pub delta_bic: f64,
    /// How much larger its held-out root mean square is, as a part.
    pub held_worse: f64,
    /// How much less the held-out data speak for it: twice the log likelihood ratio.
    pub delta_held: f64,
    /// How many more parameters it needs than the one chosen, below 0 for fewer; a state's first value is
    /// none.
    pub more: isize,
    /// Whether it differs from the one chosen only at standstill, where neither law says what really happens.
    pub differs_at_rest: bool,
    /// The share of draws of the data in which it explains most in that place.
    pub stability: f64,
}

/// What an effect is worth beside the others.
#[derive(Debug, Clone)]
pub struct Judged {
    /// What leaving it out costs.
    pub gain: Gain,
    /// What could stand in its place, nearest first.
    pub rivals: Vec<Rival>,
    /// The share of draws of the data in which it is named ([`crate::discovery::resample`]).
    pub stability: f64,
}

/// A root mean square on held-out data that is larger by this part is worse.
pub(super) const WORSE: f64 = 0.03;
/// One that is larger by no more than this is the same.
const SAME: f64 = 0.01;
/// A constant force of an input, and one against the motion.
const OFFSET: &str = "input_offset";
const DRY: &str = "dry_friction";
/// The same where what rubs is a measured velocity and the force an output.
const OUTPUT_OFFSET: &str = "output_offset";
const COULOMB: &str = "coulomb_friction";
/// What differs at standstill alone must be worth this part of the evidence.
const NEARLY: f64 = 0.5;
/// Most rivals of one effect that are fitted beside the others.
const MOST_RIVALS: usize = 6;

impl Rival {
    /// Whether it is a more general form of the one chosen, `of`, or needs more parameters to say no more.
    pub(super) fn only_adds(&self, of: &Candidate) -> bool {
        let is_general = of.at == self.candidate.at && of.within.contains(&self.candidate.kind);
        is_general || self.more > 0 && self.delta_bic > 0.0
    }

    /// Whether the data cannot tell it from the one chosen, `of`.
    pub fn ties(&self, of: &Candidate) -> bool {
        // A general form that comes out as its special case is no other explanation, nor is that case.
        let is_special = of.at == self.candidate.at && self.candidate.within.contains(&of.kind);
        // Of few independent rows a larger gap says little.
        let held_is_near = self.held_worse < WORSE || self.delta_held < TIE;
        let is_near = self.delta_bic < TIE && held_is_near;
        !is_special && !self.only_adds(of) && (is_near || self.differs_at_rest)
    }

    /// Whether it belongs in the place of the one chosen: it explains more, or as much with fewer parameters.
    pub fn is_better(&self) -> bool {
        let held = if self.more < 0 { SAME } else { -IMPERFECTION };
        self.delta_bic < -LEAST_EVIDENCE && self.held_worse < held
    }
}

impl Question<'_> {
    /// What each effect of a hypothesis is worth, with its rivals.
    pub(super) fn judge_all(
        &self,
        nominal: &Hypothesis,
        best: &Hypothesis,
        rounds: &[Vec<Tried>],
    ) -> Vec<Judged> {
        (0..best.effects.len()).map(|i| self.judge_effect(nominal, best, i, rounds)).collect()
    }

    fn judge_effect(
        &self,
        nominal: &Hypothesis,
        best: &Hypothesis,
        i: usize,
        rounds: &[Vec<Tried>],
    ) -> Judged {
        let mut fewer = best.effects.clone();
        let own = fewer.remove(i);
        let rest = self.standing(nominal, &fewer);
        let rebuilt = if rest.is_empty() { None } else { self.rebuilt(nominal, &rest, best, 30) };
        let stands = rest.len() == fewer.len() && rebuilt.is_some() != fewer.is_empty();
        // Where the model does not run without it, what is left is the model as given.
        let without = rebuilt.unwrap_or_else(|| nominal.clone());
        let gain = self.gain(&without, best, 1);
        if !stands {
            // What is not there without it has no rival beside the others.
            let stability = self.steadied(&without, (best, &own.candidate), &mut []);
            return Judged { gain, rivals: Vec::new(), stability };
        }
        let at_rest = self.at_rest(best, &own);
        let others = others(&own, &fewer, rounds);
        let is_at_rest = |other: &Chosen| at_rest.iter().any(|rest| same(rest, &other.candidate));
        let beside = others.iter().filter(|other| !is_at_rest(other));
        let all: Vec<(bool, &Chosen)> =
            at_rest.iter().map(|c| (true, c)).chain(beside.map(|c| (false, c))).collect();
        let rivals: Vec<Option<Rival>> = all
            .into_par_iter()
            .map(|(is_at_rest, other)| {
                let mut effects = fewer.clone();
                effects.push(other.clone());
                // What is nearly the same begins beside the others as they are.
                let from = if is_at_rest { best } else { &without };
                let hypothesis = self.rebuilt(nominal, &effects, from, 40)?;
                if hypothesis.is_degenerate(other) {
                    return None;
                }
                let known = self.past_known(&without, (best, &own), (&hypothesis, other));
                let compared = known
                    .as_ref()
                    .map_or([&without, best, &hypothesis], <[Hypothesis; 3]>::each_ref);
                let [poor, mine, theirs] = compared;
                let [gain, its] = [mine, theirs].map(|h| self.gain_among(poor, h, 1, &best.whites));
                let (delta_bic, delta_held) = (gain.bic - its.bic, gain.held - its.held);
                let size = |h: &Hypothesis| self.size(&h.held);
                let held_worse = size(theirs) / size(mine).max(1e-300) - 1.0;
                let n_params = |h: &Hypothesis| h.fitted.compiled.params.len();
                let more = n_params(&hypothesis).cast_signed() - n_params(best).cast_signed();
                let candidate = other.candidate.clone();
                let differs_at_rest = is_at_rest && delta_bic < NEARLY * gain.bic;
                Some(Rival {
                    candidate,
                    hypothesis,
                    delta_bic,
                    held_worse,
                    delta_held,
                    more,
                    differs_at_rest,
                    stability: 0.0,
                })
            })
            .collect();
        let mut rivals: Vec<Rival> = rivals.into_iter().flatten().collect();
        rivals.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
        let stability = self.steadied(&without, (best, &own.candidate), &mut rivals);
        Judged { gain, rivals, stability }
    }
}

impl Question<'_> {
    /// Those of some effects that are there without any other: what acts on an input that nothing but an effect reads is gone
    /// with that one.
    fn standing(&self, nominal: &Hypothesis, effects: &[Chosen]) -> Vec<Chosen> {
        let mut text = nominal.fitted.text.clone();
        let mut found = Vec::new();
        for effect in effects {
            if let Some(next) = apply(&text, self.name, &effect.patch) {
                text = next;
                found.push(effect.clone());
            }
        }
        found
    }

    /// What is the same as a chosen effect as long as everything moves one way: an offset of an input and dry
    /// friction. At standstill they part, but there rubbing is no constant, and says nothing of which it is.
    fn at_rest(&self, best: &Hypothesis, own: &Chosen) -> Vec<Chosen> {
        let others: &[&str] = match own.candidate.kind {
            OFFSET => &[DRY, COULOMB],
            OUTPUT_OFFSET => &[COULOMB],
            DRY => &[OFFSET],
            COULOMB => &[OFFSET, OUTPUT_OFFSET],
            _ => return Vec::new(),
        };
        let is_dry = |kind: &str| kind == DRY || kind == COULOMB;
        let Some(model) = model_in(&best.fitted.text, self.name) else { return Vec::new() };
        let ground = self.ground(&best.fitted, &model);
        let is_free = |c: &Candidate| best.effects.iter().all(|e| !e.candidate.excludes(c));
        candidates(&ground)
            .into_iter()
            .filter(|c| others.contains(&c.kind) && is_free(c))
            .filter(|c| ground.is_one_way(if is_dry(c.kind) { &c.at } else { &own.candidate.at }))
            .filter_map(|c| Some(Chosen { patch: c.patches.first()?.clone(), candidate: c }))
            .collect()
    }
}

impl Question<'_> {
    /// Of what is tried, the friction that is the same as a chosen offset as long as everything moves one way. It is the
    /// nearer reading: what moves rubs, and at standstill, where alone they part, neither law says what happens.
    pub(super) fn rubs<'t>(&self, chosen: &'t Tried, round: &'t [Tried]) -> Option<&'t Tried> {
        let offset = chosen.0.effects.last()?.candidate.kind;
        let model = model_in(&chosen.0.fitted.text, self.name)?;
        let ground = self.ground(&chosen.0.fitted, &model);
        let is_offset = offset == OFFSET || offset == OUTPUT_OFFSET;
        round.iter().find(|(other, gain)| {
            let is_dry = other.effects.last().is_some_and(|e| {
                let kind = e.candidate.kind;
                (kind == DRY || kind == COULOMB) && ground.is_one_way(&e.candidate.at)
            });
            let is_same = gain.evidence() > NEARLY * chosen.1.evidence();
            is_offset && is_dry && is_same && gain.pays()
        })
    }
}

fn same(chosen: &Chosen, candidate: &Candidate) -> bool {
    chosen.candidate.kind == candidate.kind && chosen.candidate.at == candidate.at
}

/// What was tried and could stand in an effect's place beside the others, best first.
fn others(own: &Chosen, beside: &[Chosen], rounds: &[Vec<Tried>]) -> Vec<Chosen> {
    let mut tried: Vec<&Tried> = rounds.iter().flatten().collect();
    tried.sort_by(|a, b| b.1.evidence().total_cmp(&a.1.evidence()));
    let mut found: Vec<Chosen> = Vec::new();
    for (hypothesis, _) in tried {
        let Some(last) = hypothesis.effects.last() else { continue };
        let free = !same(own, &last.candidate)
            && beside.iter().all(|e| !e.candidate.excludes(&last.candidate))
            && found.iter().all(|e| !same(e, &last.candidate));
        if free {
            let patch = with_values(&last.patch, &hypothesis.fitted, false);
            found.push(Chosen { candidate: last.candidate.clone(), patch });
        }
    }
    found.truncate(MOST_RIVALS);
    found
}

#[cfg(test)]
mod tests {
    use super::super::edit::{NewParam, Patch};
    use super::super::estimate::Point;
    use super::super::fitting::Fitted;
    use super::super::made::bench;
    use super::*;

    const GIVEN: &str = "model m {\n input u\n state x = 0\n x' = -x\n output x = x\n}\n";
    const TRUTH: &str =
        "model m {\n input u\n state x = 0\n x' = 0.7*(u + 2) - x\n output x = x\n}\n";

    fn effect(kind: &'static str, name: &str, patch: Patch) -> Chosen {
        let param = NewParam {
            role: "value",
            name: name.into(),
            dimension: None,
            range: None,
            neutral: Some(0.0),
            value: 0.5,
            std: None,
        };
        let patch = Patch { title: kind.into(), params: vec![param], ..patch };
        let (at, equation) = ("u".into(), String::new());
        let patches = vec![patch.clone()];
        Chosen { candidate: Candidate { kind, at, patches, equation, within: &[] }, patch }
    }

    /// Friction of a speed that nothing else reads, without which an offset of that speed is none, was told to make the criterion
    /// fall by 0 and to explain 0 % of the gap, in 100 of 100 draws.
    #[test]
    fn what_another_effect_acts_through_is_worth_both() {
        let bench = bench(TRUTH);
        let compiled = bench.prepare(GIVEN, "m").unwrap();
        let point = Point { params: Vec::new(), starts: vec![vec![None]] };
        let train = bench.task(&compiled).judge(&point).unwrap();
        let fitted = Fitted { text: GIVEN.into(), compiled, train };
        let given = model_in(GIVEN, "m").unwrap();
        let (floors, refused, whole) = (vec![0.0], Vec::new(), [1.0; 2]);
        let question = Question { bench, name: "m", given, floors, refused, whole };
        let nominal = question.judged(Vec::new(), fitted, None).unwrap();
        let rates = vec![("x".into(), "+ slope*u".into())];
        let reads = effect("input_gain", "slope", Patch { rates, ..Patch::default() });
        let input = Some(("u".into(), "{} + shift".into()));
        let acts = effect("input_offset", "shift", Patch { input, ..Patch::default() });
        let best = question.rebuilt(&nominal, &[reads, acts], &nominal, 30).unwrap();
        let judged = question.judge_effect(&nominal, &best, 0, &[]);
        assert!(judged.gain.bic > 100.0 && judged.gain.told > 0.9, "{:?}", judged.gain);
        assert!(judged.rivals.is_empty() && judged.stability > 0.9, "{}", judged.stability);
    }
}
