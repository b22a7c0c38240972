//! Which effects a model lacks: added one by one while it pays, fitted together, pruned, made as simple as
//! they can be (`conclude`), and set against their rivals.
//!
//! Every candidate at every start is fitted by a step or two, which says nearly what a full fit would;
//! only the best are fitted in full. See [`super::hypothesis`] for what an effect must pay.

use rayon::prelude::*;

use super::candidates::{Candidate, candidates};
use super::edit::{Patch, apply, model_in};
use super::estimate::Estimate;
use super::fitting::Fitted;
use super::hypothesis::{Chosen, Gain, Hypothesis, MOST, Question, with_values};
use super::meaning::says_nothing;
use super::rivals::Judged;
use super::wording;
use crate::discovery::finding::MATTERS;

/// The result of a search.
#[derive(Debug, Clone)]
pub struct Search {
    /// The model as given.
    pub nominal: Hypothesis,
    /// With the effects that pay.
    pub best: Hypothesis,
    /// What each effect of `best` is worth.
    pub judged: Vec<Judged>,
    /// How many candidates were tried at once.
    pub n_tried: usize,
}

impl Search {
    /// Takes back every effect.
    fn forget(&mut self) {
        self.best = self.nominal.clone();
        self.judged.clear();
    }
}

/// A candidate that was fitted in full, with what it gains.
pub(super) type Tried = (Hypothesis, Gain);

/// Most effects in one model.
const MOST_EFFECTS: usize = 5;
/// Turns of adding and leaving out: what is refused may be found again, but not for ever.
const MOST_TURNS: usize = 50;
/// From how many shapes of a grid the fit goes on with the shape free.
const BOTTOMS: usize = 2;
/// How many of the candidates are fitted in full.
const SHORTLIST: usize = 8;

impl Question<'_> {
    /// Searches from a fitted nominal model. `progress` is told what is being done and which part is done.
    pub fn search(
        &mut self,
        nominal: Fitted,
        progress: &mut dyn FnMut(&str, f64),
    ) -> Option<Search> {
        let mut nominal = self.judged(Vec::new(), nominal, None)?;
        self.measure(&nominal);
        let mut best = nominal.clone();
        let mut rounds: Vec<Vec<Tried>> = Vec::new();
        let mut n_tried = 0;
        while best.effects.len() < MOST_EFFECTS
            && rounds.len() < MOST_TURNS
            && !self.bench.is_spent()
        {
            if !self.is_sound(&best) {
                best = self.refuse(&nominal, best);
            }
            let done = best.effects.len() as f64 / (MOST_EFFECTS as f64 + 1.0);
            progress(wording::FITTING, done);
            let (round, tried) = self.round(&best, SHORTLIST);
            n_tried = n_tried.max(tried);
            let mut all: Vec<Hypothesis> = round.into_iter().map(|(rich, _)| rich).collect();
            all.extend(self.widened(&nominal, &best));
            let round = self.weighed(&best, all, tried);
            let accepted = self.simplest(&round).cloned().or_else(|| self.pair(&best, &round));
            let Some((mut next, _)) = accepted else {
                if self.lengthen(&mut nominal, &mut best) {
                    continue;
                }
                break;
            };
            if let Some((plain, at)) = self.without_stand_in(&nominal, &next) {
                let stand_in = &next.effects[at].candidate;
                self.refused.push((stand_in.kind, stand_in.at.clone()));
                best = plain;
                if best.effects.is_empty() {
                    nominal = best.clone();
                    self.measure(&nominal);
                }
                self.settle(&mut nominal, &mut best)?;
                continue;
            }
            rounds.push(round);
            self.settle(&mut nominal, &mut next)?;
            next = self.pruned(&nominal, next);
            let (is, was) = (self.size(&next.held), self.size(&best.held));
            let is_end = next.effects.len() < best.effects.len() && is >= was || same(&next, &best);
            // What means nothing is refused at the next turn, and others have theirs.
            if is_end && self.is_sound(&next) {
                break;
            }
            best = next;
        }
        progress("comparing rivals", 0.9);
        best = self.concluded(&nominal, best);
        let mut judged = self.judge_all(&nominal, &best, &rounds);
        // What was added early, alone, may have a better rival now that the others are there.
        let better = judged
            .iter()
            .flat_map(|judged| judged.rivals.iter().filter(|rival| rival.is_better()))
            .min_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
        if let Some(rival) = better {
            best = self.concluded(&nominal, rival.hypothesis.clone());
            judged = self.judge_all(&nominal, &best, &rounds);
        }
        Some(Search { nominal, best, judged, n_tried })
    }

    /// Whether the effects take most of the gap beyond the noise, or leave nothing but noise: what explains less is
    /// no list of what is missing. Where far more than noise is left they must take most of it on the data fitted as well:
    /// what hardly helps there and a lot elsewhere stands in for something else.
    fn explains_most(&self, search: &Search) -> bool {
        let (nominal, best) = (&search.nominal, &search.best);
        let takes_most = |set: fn(&Hypothesis) -> &Estimate| {
            self.beyond(set(best)) < MOST * self.beyond(set(nominal))
        };
        let is_enough = takes_most(|h| &h.held)
            && (!self.is_far_above(&best.held) || takes_most(|h| &h.fitted.train));
        best.effects.is_empty() || is_enough || self.is_noise(best)
    }

    /// Whether the gap on the data that decided nothing is smaller with the effects than without.
    fn gap_falls(&self, search: &Search) -> bool {
        let [before, after] = [&search.nominal, &search.best].map(|h| self.told(h).heldout);
        search.best.effects.is_empty() || after < before || before <= 0.0
    }

    /// Takes back every effect where they leave too much of the gap to be what is missing, or it does not fall where nothing was
    /// decided; returns which they were, in words.
    pub(super) fn take_back(&self, search: &mut Search) -> Option<String> {
        let tried = search.best.effects.iter().map(|e| (e.candidate.kind, e.candidate.at.as_str()));
        let note = match (self.explains_most(search), self.gap_falls(search)) {
            (true, true) => return None,
            (false, _) => wording::leaves_most(tried),
            (true, false) => wording::predicts_nothing(tried),
        };
        search.forget();
        Some(note)
    }

    /// Keeps the size of the gap that is to be explained.
    fn measure(&mut self, nominal: &Hypothesis) {
        self.whole = [&nominal.fitted.train, &nominal.held].map(|e| self.size(e).powi(2));
    }

    /// Chooses again how inputs are joined and how long steps are, now that less is in the way, and fits
    /// everything on those terms. Returns whether anything changed.
    pub(super) fn settle(
        &mut self,
        nominal: &mut Hypothesis,
        next: &mut Hypothesis,
    ) -> Option<bool> {
        let before = self.bench.scheme;
        self.bench.settle(&mut next.fitted);
        if self.bench.scheme == before {
            return Some(false);
        }
        *next = self.judged(next.effects.clone(), next.fitted.clone(), Some(next))?;
        let fitted = self.bench.fit(&nominal.fitted.text, self.name, &nominal.fitted, 20)?;
        *nominal = self.judged(Vec::new(), fitted, Some(nominal))?;
        self.measure(nominal);
        Some(true)
    }

    /// Runs everything over longer stretches; returns whether the best hypothesis follows them.
    fn lengthen(&mut self, nominal: &mut Hypothesis, best: &mut Hypothesis) -> bool {
        let before = self.bench.clone();
        let mut fitted = best.fitted.clone();
        // What goes astray on held-out data already would judge nothing over longer ones.
        let followed = self.over_outputs(&self.bench.followed());
        if self.size(&best.held) > followed || !self.bench.lengthen(&mut fitted) {
            return false;
        }
        let longer = |this: &Self| -> Option<(Hypothesis, Hypothesis)> {
            let best = this.judged(best.effects.clone(), fitted.clone(), None)?;
            let mut old = nominal.fitted.clone();
            old.train.point = this.bench.rewindowed(&old.compiled, &old.train.point, &before);
            let refitted = this.bench.fit(&old.text, this.name, &old, 40)?;
            let nominal = this.judged(Vec::new(), refitted, None)?;
            Some((best, nominal))
        };
        if let Some((found, plain)) = longer(self) {
            (*best, *nominal) = (found, plain);
            self.measure(nominal);
            true
        } else {
            self.bench = before;
            false
        }
    }

    /// Fits a candidate on top of a hypothesis by a few steps from each of its starts.
    fn screen(&self, base: &Hypothesis, candidate: &Candidate) -> Option<(Fitted, Patch)> {
        let begun = candidate.patches.iter().filter_map(|patch| {
            let text = apply(&base.fitted.text, self.name, patch)?;
            let (amounts, shapes) = patch.amounts_and_shapes();
            let remembered = self.begun(&text, patch, &base.fitted);
            let parent = remembered.as_ref().unwrap_or(&base.fitted);
            // From no effect at all one step of Gauss and Newton is nearly the whole way, a few are where something
            // runs on by itself for long; a shape alone is found on the way. Beside an amount a shape stays where it
            // is, or it runs off before there is anything to have a shape.
            let is_grid = amounts > 0 && shapes > 0 && remembered.is_none();
            let (steps, held) = match (shapes, is_grid) {
                (0, _) => (6, Vec::new()),
                (_, true) => (3, patch.shapes().map(|p| p.name.clone()).collect()),
                _ => (4, Vec::new()),
            };
            let fitted = self.bench.fit_beside(&text, self.name, parent, steps, &held)?;
            Some((self.cost(&fitted), is_grid, fitted, patch))
        });
        let mut begun: Vec<(f64, bool, Fitted, &Patch)> =
            begun.filter(|(cost, ..)| cost.is_finite()).collect();
        begun.sort_by(|a, b| a.0.total_cmp(&b.0));
        let grids = begun.iter().filter(|(_, is_grid, ..)| *is_grid).count();
        let found = begun.into_iter().take(if grids > 1 { BOTTOMS } else { usize::MAX });
        let found = found.filter_map(|(cost, is_grid, fitted, patch)| {
            if !is_grid {
                return Some((cost, fitted, patch.clone()));
            }
            let freed = self.bench.fit(&fitted.text.clone(), self.name, &fitted, 4)?;
            Some((self.cost(&freed), freed, patch.clone()))
        });
        // What has run to the end of its range is another effect, or none; the next bottom may be this one.
        let runs_off = |patch: &Patch, fitted: &Fitted| {
            says_nothing(candidate.kind, &with_values(patch, fitted, false))
        };
        let best = found.min_by(|a, b| {
            let off = runs_off(&a.2, &a.1).cmp(&runs_off(&b.2, &b.1));
            off.then(a.0.total_cmp(&b.0))
        })?;
        best.0.is_finite().then_some((best.1, best.2))
    }

    /// Twice the negative log likelihood with noise of unknown size, and the price of what is free.
    pub(super) fn cost(&self, fitted: &Fitted) -> f64 {
        let misfit: f64 = fitted
            .train
            .sums
            .iter()
            .zip(&self.floors)
            .map(|((sum, n), floor)| {
                let n = (*n).max(1) as f64;
                n * (sum / n + floor).max(1e-300).ln()
            })
            .sum();
        let starts = fitted.train.point.starts.iter().flatten().flatten().count();
        misfit + 2.0 * (fitted.compiled.params.len() + starts) as f64
    }

    /// Tries every candidate on top of a hypothesis; best first, with how many there were.
    pub(super) fn round(&self, base: &Hypothesis, shortlist: usize) -> (Vec<Tried>, usize) {
        let Some(model) = model_in(&base.fitted.text, self.name) else {
            return (Vec::new(), 0);
        };
        let ground = self.ground(&base.fitted, &model);
        let mut all = candidates(&ground);
        // A richer form of the same name waits until the plain one is there; along whole recordings, where its
        // beginning is a good one, it need not.
        let plain = all.clone();
        // What an effect brought along has no effects of its own.
        let brought = |at: &String| {
            base.effects.iter().flat_map(|e| &e.patch.states).any(|(state, _)| state == at)
        };
        all.retain(|c| {
            let is_richer = self.bench.rows.is_some()
                && plain.iter().any(|p| p.kind == c.kind && p.is_special(c));
            !is_richer
                && !brought(&c.at)
                && !self.is_refused(c)
                && base.effects.iter().all(|e| !e.candidate.excludes(c))
        });
        let n_tried = all.len();
        let screened: Vec<Option<(Fitted, Patch, Candidate)>> = all
            .into_par_iter()
            .map(|c| self.screen(base, &c).map(|(fitted, patch)| (fitted, patch, c)))
            .collect();
        let mut screened: Vec<(Fitted, Patch, Candidate)> =
            screened.into_iter().flatten().collect();
        screened.sort_by(|a, b| self.cost(&a.0).total_cmp(&self.cost(&b.0)));
        screened.truncate(shortlist);
        let full: Vec<Option<Hypothesis>> = screened
            .into_par_iter()
            .map(|(fitted, patch, candidate)| {
                self.in_full(base, fitted, Chosen { candidate, patch })
            })
            .collect();
        (self.weighed(base, full.into_iter().flatten().collect(), n_tried), n_tried)
    }

    /// What hypotheses gain over a base, best first: their residuals are as independent as those of the one that
    /// fits best, so that none counts more rows than another.
    fn weighed(&self, base: &Hypothesis, all: Vec<Hypothesis>, n_tried: usize) -> Vec<Tried> {
        let nearest = |a: &&Hypothesis, b: &&Hypothesis| {
            self.cost(&a.fitted).total_cmp(&self.cost(&b.fitted))
        };
        let Some(whites) = all.iter().min_by(nearest).map(|h| h.whites.clone()) else {
            return Vec::new();
        };
        let gain = |rich: &Hypothesis| self.gain_among(base, rich, n_tried, &whites);
        let mut tried: Vec<Tried> = all
            .into_iter()
            .map(|rich| {
                let gain = gain(&rich);
                (rich, gain)
            })
            .collect();
        tried.sort_by(|a, b| b.1.evidence().total_cmp(&a.1.evidence()));
        tried
    }

    /// A general effect in the place of one already chosen that is its special case.
    fn widened(&self, nominal: &Hypothesis, base: &Hypothesis) -> Vec<Hypothesis> {
        let mut found = Vec::new();
        for (i, effect) in base.effects.iter().enumerate() {
            let own = &effect.candidate;
            if own.within.is_empty() {
                continue;
            }
            let mut fewer = base.effects.clone();
            fewer.remove(i);
            let Some(mut poor) = self.rebuilt(nominal, &fewer, base, 10) else { continue };
            let Some(model) = model_in(&poor.fitted.text, self.name) else { continue };
            let values = with_values(&effect.patch, &base.fitted, false);
            let size = values.params.first().map_or(0.0, |p| p.value);
            let general: Vec<Candidate> = candidates(&self.ground(&poor.fitted, &model))
                .into_iter()
                .filter(|c| own.is_special(c) && !self.is_refused(c))
                .filter(|c| fewer.iter().all(|e| !e.candidate.excludes(c)))
                .map(|c| c.from_special(size))
                .collect();
            // Everything else begins as it stands beside the special case, not as it is without either.
            let (child, parent) = (&poor.fitted.compiled, &base.fitted);
            let task = self.bench.task(child);
            let at = self.bench.inherit(child, &parent.compiled, &parent.train.point, &task);
            poor.fitted.train.point = at;
            let tried: Vec<Option<Hypothesis>> = general
                .into_par_iter()
                .map(|candidate| {
                    let (fitted, patch) = self.screen(&poor, &candidate)?;
                    self.in_full(&poor, fitted, Chosen { candidate, patch })
                })
                .collect();
            found.extend(tried.into_iter().flatten());
        }
        found
    }

    /// Fits what was screened in full and judges it; `None` when it is no effect after all.
    fn in_full(&self, base: &Hypothesis, screened: Fitted, chosen: Chosen) -> Option<Hypothesis> {
        let text = screened.text.clone();
        let fitted = self.bench.fit(&text, self.name, &screened, 40).unwrap_or(screened);
        let mut effects = base.effects.clone();
        effects.push(chosen);
        let rich = self.judged(effects, fitted, Some(base))?;
        let last = rich.effects.last()?;
        if rich.is_degenerate(last) || self.is_idle(&rich, last) {
            return None;
        }
        Some(rich)
    }

    /// Of the candidates that pay, the best, or one with fewer values that is nearly as good.
    fn simplest<'t>(&self, round: &'t [Tried]) -> Option<&'t Tried> {
        let mut chosen = round.iter().find(|(_, gain)| gain.pays())?;
        for other in round.iter().filter(|(_, gain)| gain.pays()) {
            if other.0.n_free() < chosen.0.n_free() && !self.is_richer(&other.0, &chosen.0) {
                chosen = other;
            }
        }
        Some(self.rubs(chosen, round).unwrap_or(chosen))
    }

    /// Whether a hypothesis with more values says more than one with fewer.
    pub(super) fn is_richer(&self, poor: &Hypothesis, rich: &Hypothesis) -> bool {
        self.gain(poor, rich, 1).pays()
    }

    /// Two effects that pay only together, each hiding the other: the nearest misses, each with a round
    /// of its own.
    fn pair(&self, base: &Hypothesis, round: &[Tried]) -> Option<Tried> {
        let coloured = base.whites[0].iter().any(|white| *white < 0.3);
        if !coloured || base.effects.len() + 2 > MOST_EFFECTS || self.bench.is_spent() {
            return None;
        }
        let firsts = round.iter().filter(|(_, g)| g.held > 0.0 && g.held_rms > 0.0).take(3);
        let (mut taken, mut all) = (Vec::new(), Vec::new());
        for (first, gain) in firsts {
            for (second, _) in self.round(first, SHORTLIST / 2).0 {
                taken.push((effects_of(&second), gain.taken));
                all.push(second);
            }
        }
        let tried = self.weighed(base, all, round.len() * round.len());
        // The second must be worth more than the first alone, or it is the first with company.
        let is_more = |(both, together): &Tried| {
            let names = effects_of(both);
            let first = taken.iter().find(|(of, _)| *of == names);
            together.pays() && first.is_some_and(|(_, taken)| together.taken > taken + MATTERS)
        };
        tried.into_iter().find(is_more)
    }
}

/// Whether two hypotheses name the same effects.
fn same(a: &Hypothesis, b: &Hypothesis) -> bool {
    let names = |h: &Hypothesis| -> Vec<(String, &'static str)> {
        effects_of(h).into_iter().map(|(at, kind, _)| (at, kind)).collect()
    };
    names(a) == names(b)
}

/// Places and names of a hypothesis' effects, in their order, with their numbers of parameters.
fn effects_of(h: &Hypothesis) -> Vec<(String, &'static str, usize)> {
    let of = |e: &Chosen| (e.candidate.at.clone(), e.candidate.kind, e.patch.params.len());
    h.effects.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::super::edit::NewParam;
    use super::super::estimate::Point;
    use super::super::made::bench;
    use super::*;

    fn model(more: &str) -> String {
        format!("model m {{\n input u\n state x = 0\n x' = u - x{more}\n output x = x\n}}\n")
    }

    /// A force in proportion to the state, as a name for it.
    fn damping() -> Chosen {
        let amount = NewParam {
            role: "coefficient",
            name: "c".into(),
            dimension: None,
            range: None,
            neutral: Some(0.0),
            value: 0.1,
            std: None,
        };
        let rates = vec![("x".into(), "- c*x".into())];
        let patch = Patch { params: vec![amount], rates, ..Patch::default() };
        let (kind, at, equation) = ("linear_damping", "x".into(), String::new());
        Chosen {
            candidate: Candidate { kind, at, patches: Vec::new(), equation, within: &[] },
            patch,
        }
    }

    /// "The gap falls from 0.624 % to 0.632 %" was said of a lag that 51 of 100 draws of the data named.
    #[test]
    fn names_with_which_the_gap_does_not_fall_are_taken_back() {
        let (bench, text) = (bench(&model(" - 0.5*x")), model(""));
        let compiled = bench.prepare(&text, "m").unwrap();
        let point = Point { params: Vec::new(), starts: vec![vec![None]] };
        let train = bench.task(&compiled).judge(&point).unwrap();
        let plain = Fitted { text: text.clone(), compiled, train };
        let given = model_in(&text, "m").unwrap();
        let (floors, refused, whole) = (vec![0.0], Vec::new(), [1.0; 2]);
        let question = Question { bench, name: "m", given, floors, refused, whole };
        let nominal = question.judged(Vec::new(), plain, None).unwrap();
        let best = question.rebuilt(&nominal, &[damping()], &nominal, 40).unwrap();
        let mut search = Search { nominal, best, judged: Vec::new(), n_tried: 1 };
        assert_eq!(question.take_back(&mut search), None);
        assert_eq!(search.best.effects.len(), 1);
        // The rows that decide nothing are described no better with it.
        search.best.held.unseen.clone_from(&search.nominal.held.unseen);
        let note = question.take_back(&mut search).unwrap();
        assert!(search.best.effects.is_empty() && note.contains("linear_damping(x)"), "{note}");
    }
}
