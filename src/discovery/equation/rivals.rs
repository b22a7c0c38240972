//! What each effect is worth beside the others, and what could stand in its place.

use rayon::prelude::*;

use super::candidates::Candidate;
use super::hypothesis::{
    Chosen, Gain, Hypothesis, IMPERFECTION, LEAST_EVIDENCE, Question, TIE, with_values,
};
use super::search::Tried;

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
    /// How many more parameters it needs than the one chosen, below 0 for fewer; a state's first value is
    /// none.
    pub more: isize,
}

/// A root mean square on held-out data that is larger by this part is worse.
const WORSE: f64 = 0.03;
/// One that is larger by no more than this is the same.
const SAME: f64 = 0.01;
/// Most rivals of one effect that are fitted beside the others.
const MOST_RIVALS: usize = 6;

impl Rival {
    /// Whether the data cannot tell it from the one chosen, `of`.
    pub fn ties(&self, of: &Candidate) -> bool {
        // A general form that comes out as its special case is no other explanation.
        let nested = of.at == self.candidate.at
            && (of.within.contains(&self.candidate.kind)
                || self.candidate.within.contains(&of.kind));
        // What needs more parameters to say no more is none either.
        let idle = self.more > 0 && self.delta_bic > 0.0;
        !nested && !idle && self.delta_bic < TIE && self.held_worse < WORSE
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
    ) -> Vec<(Gain, Vec<Rival>)> {
        (0..best.effects.len()).map(|i| self.judge_effect(nominal, best, i, rounds)).collect()
    }

    fn judge_effect(
        &self,
        nominal: &Hypothesis,
        best: &Hypothesis,
        i: usize,
        rounds: &[Vec<Tried>],
    ) -> (Gain, Vec<Rival>) {
        let mut fewer = best.effects.clone();
        let own = fewer.remove(i);
        let without = if fewer.is_empty() {
            Some(nominal.clone())
        } else {
            self.rebuilt(nominal, &fewer, best, 30)
        };
        let Some(without) = without else { return (Gain::NONE, Vec::new()) };
        let gain = self.gain(&without, best, 1);
        let others = others(&own, &fewer, rounds);
        let rivals: Vec<Option<Rival>> = others
            .into_par_iter()
            .map(|other| {
                let mut effects = fewer.clone();
                effects.push(other.clone());
                let hypothesis = self.rebuilt(nominal, &effects, &without, 40)?;
                if hypothesis.is_degenerate(&other) {
                    return None;
                }
                let delta_bic = gain.bic - self.gain(&without, &hypothesis, 1).bic;
                let size = |h: &Hypothesis| self.size(&h.held);
                let held_worse = size(&hypothesis) / size(best).max(1e-300) - 1.0;
                let n_params = |h: &Hypothesis| h.fitted.compiled.params.len();
                let more = n_params(&hypothesis).cast_signed() - n_params(best).cast_signed();
                let candidate = other.candidate;
                Some(Rival { candidate, hypothesis, delta_bic, held_worse, more })
            })
            .collect();
        let mut rivals: Vec<Rival> = rivals.into_iter().flatten().collect();
        rivals.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
        (gain, rivals)
    }
}

/// What was tried and could stand in an effect's place beside the others, best first.
fn others(own: &Chosen, beside: &[Chosen], rounds: &[Vec<Tried>]) -> Vec<Chosen> {
    let same = |e: &Chosen, c: &Candidate| e.candidate.kind == c.kind && e.candidate.at == c.at;
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
