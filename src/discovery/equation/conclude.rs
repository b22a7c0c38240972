//! What a search found, made as simple as it can be: effects that others made needless are dropped, general ones that say
//! no more than a special case give way to it, and everything free is fitted once more.

use super::candidates::candidates;
use super::edit::model_in;
use super::hypothesis::{Chosen, Hypothesis, IMPERFECTION, Question};
use crate::discovery::finding::{MATTERS, TIE};

impl Question<'_> {
    /// Drops effects that others have made needless.
    pub(super) fn pruned(&self, nominal: &Hypothesis, mut hypothesis: Hypothesis) -> Hypothesis {
        let mut i = 0;
        while hypothesis.effects.len() > 1 && i + 1 < hypothesis.effects.len() {
            let mut fewer = hypothesis.effects.clone();
            fewer.remove(i);
            if let Some(poor) = self.rebuilt(nominal, &fewer, &hypothesis, 30) {
                let gain = self.gain(&poor, &hypothesis, 1);
                let is_little = gain.part < IMPERFECTION || gain.taken < 0.5 * MATTERS;
                if gain.evidence() < TIE || gain.bic < 0.0 || is_little {
                    hypothesis = poor;
                    continue;
                }
            }
            i += 1;
        }
        hypothesis
    }

    /// What a search ends with: as simple as it can be, everything free fitted once more, and nothing in it
    /// that means nothing or only stands in for free parameters.
    pub(super) fn concluded(&self, nominal: &Hypothesis, best: Hypothesis) -> Hypothesis {
        let best = self.upheld(nominal, self.simplified(nominal, best));
        let mut best = self.sound(nominal, self.refitted(best));
        while let Some((plain, _)) = self.without_stand_in(nominal, &best) {
            best = plain;
        }
        best
    }

    /// Everything free fitted once more: what joined one by one was fitted beside what was there then, with the
    /// ramps of that motion. Kept when it fits better, and no worse on the data held out.
    fn refitted(&self, best: Hypothesis) -> Hypothesis {
        if best.effects.is_empty() {
            return best;
        }
        let again = self
            .bench
            .fit(&best.fitted.text, self.name, &best.fitted, 80)
            .and_then(|fitted| self.judged(best.effects.clone(), fitted, Some(&best)));
        let better = again.filter(|again| {
            self.cost(&again.fitted) < self.cost(&best.fitted)
                && self.size(&again.held) <= (1.0 + 1e-3) * self.size(&best.held)
        });
        better.unwrap_or(best)
    }

    /// Drops what pays no longer on the terms that were settled last, the only effect included.
    fn upheld(&self, nominal: &Hypothesis, mut best: Hypothesis) -> Hypothesis {
        let mut i = 0;
        while i < best.effects.len() {
            let mut fewer = best.effects.clone();
            fewer.remove(i);
            let poor = if fewer.is_empty() {
                Some(nominal.clone())
            } else {
                self.rebuilt(nominal, &fewer, &best, 30)
            };
            match poor {
                Some(poor) if !self.is_richer(&poor, &best) => {
                    best = poor;
                    i = 0;
                }
                _ => i += 1,
            }
        }
        best
    }

    /// Puts the special case in the place of a general effect that says no more than it.
    fn simplified(&self, nominal: &Hypothesis, mut best: Hypothesis) -> Hypothesis {
        let Some(model) = model_in(&nominal.fitted.text, self.name) else { return best };
        let all = candidates(&self.ground(&nominal.fitted, &model));
        for i in 0..best.effects.len() {
            let own = best.effects[i].candidate.clone();
            let special = all.iter().filter(|c| c.is_special(&own));
            for candidate in special {
                let mut effects = best.effects.clone();
                let Some(patch) = candidate.patches.first().cloned() else { continue };
                effects[i] = Chosen { candidate: candidate.clone(), patch };
                if let Some(poor) = self.rebuilt(nominal, &effects, &best, 40)
                    && !self.is_richer(&poor, &best)
                    && self.is_sound(&poor)
                {
                    best = poor;
                    break;
                }
            }
        }
        best
    }
}
