//! Add the effect that explains most, exchange, leave out, until nothing pays; then compare the rivals.

use rayon::prelude::*;

use super::alone::least_borne;
use super::refit::{begins, near_parameters, refit_some, same_terms, together};
use super::screen::Local;
use super::steady::{judge_all, least_steady, steadied};
use super::sure::least_sure;
use super::weighing::{compared, is_sensible, matters, pays, sensible_at, simplest, weighed};
use super::{
    Candidate, Diverged, Hypothesis, Options, Outcome, ParameterSpec, Residuals, Rival, refit,
    wording,
};

/// Searches for the effects that are missing.
///
/// `progress` is told what is being done and which part of the whole is done.
///
/// # Errors
///
/// [`Diverged`] if the model without effects cannot be evaluated or fitted.
pub fn search<G: Residuals>(
    gap: &G,
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Outcome<G::Term>, Diverged> {
    let start: Vec<f64> = gap.nuisance().iter().map(|(_, value)| *value).collect();
    let nothing = refit(gap, Vec::new(), start, Vec::new()).ok_or(Diverged::Bare)?;
    let mut grown = Grown::from(gap, nothing.clone());
    grown.grow(gap, options, &|_| false, progress);
    let mut others = grown.best.terms.iter().filter(|term| gap.is_broad(term));
    if let (Some(broad), true) = (others.next().cloned(), grown.best.terms.len() >= CROWD) {
        grown.without(gap, options, &broad, progress);
    }
    loop {
        let unnamed = grown.unnamed;
        let mut outcome = grown.outcome(gap, options, nothing.clone(), progress);
        outcome.best = together(gap, plain(gap, outcome.best.clone(), &mut outcome));
        outcome.rivals.retain(|rival| is_sensible(gap, &rival.hypothesis));
        steadied(gap, &mut outcome, options);
        // One less each time.
        let weakest = least_sure(gap, &outcome).or_else(|| least_steady(&outcome));
        let weakest = weakest.or_else(|| least_borne(gap, &outcome, options));
        let rest = weakest.and_then(|at| left_out(gap, &outcome.best, at));
        let Some(best) = rest else {
            judge_all(gap, &mut outcome, options);
            return Ok(outcome);
        };
        grown = Grown { best, rivals: Vec::new(), unnamed };
    }
}

/// So many effects are enough for one of them to stand for two others.
const CROWD: usize = 3;

/// Beside more named effects than this none without a name is looked for.
const MANY: usize = 4;

/// How many effects may come in the place of a broad one.
const DETOUR: usize = 3;
/// Turns of adding and leaving out, for each effect that may join. Chosen: what goes round so often gets nowhere.
const MOST_TURNS: usize = 10;

/// What has been found so far.
#[derive(Clone)]
pub(super) struct Grown<T> {
    pub(super) best: Hypothesis<T>,
    rivals: Vec<Rival<T>>,
    /// Whether effects without a name are tried yet.
    unnamed: bool,
}

impl<T: Clone + PartialEq + Send + Sync> Grown<T> {
    /// Begins with some effects.
    pub(super) fn from<G: Residuals<Term = T>>(gap: &G, best: Hypothesis<T>) -> Self {
        Self { best, rivals: Vec::new(), unnamed: !gap.names_first() }
    }

    /// Tries all effects against others once more and compares the rivals.
    pub(super) fn outcome<G: Residuals<Term = T>>(
        self,
        gap: &G,
        options: &Options,
        nothing: Hypothesis<T>,
        progress: &mut dyn FnMut(&str, f64),
    ) -> Outcome<T> {
        let Self { mut best, mut rivals, unnamed } = self;
        let all_related =
            best.terms.iter().all(|a| best.terms.iter().all(|b| a == b || gap.related(a, b)));
        // One that is left of several was tried against nothing yet.
        let is_untried = best.terms.len() == 1 && rivals.is_empty();
        if !all_related || is_untried {
            progress(wording::EXCHANGING_ALL, 0.9);
            best = exchanged(gap, best, options, &mut rivals, None, unnamed);
            best = pruned(gap, best, options, None);
        }
        best = sensible(gap, best).0;
        progress(wording::COMPARING, 0.95);
        let without: Vec<Hypothesis<T>> = (0..best.terms.len())
            .map(|at| left_out(gap, &best, at).unwrap_or_else(|| nothing.clone()))
            .collect();
        let mut rivals = compared(gap, &best, &without, rivals, options);
        rivals.sort_by(|a, b| a.behind.total_cmp(&b.behind));
        let stability = vec![0.0; best.terms.len()];
        Outcome { nothing, best, without, rivals, stability }
    }

    /// Adds effects while they pay, none of them `barred`; after each, those there are may be exchanged or left out.
    pub(super) fn grow<G: Residuals<Term = T>>(
        &mut self,
        gap: &G,
        options: &Options,
        barred: &dyn Fn(&T) -> bool,
        progress: &mut dyn FnMut(&str, f64),
    ) {
        // What joins can lead to something else being left out that joins again.
        let mut seen: Vec<Vec<T>> = Vec::new();
        while self.best.terms.len() < options.most && seen.len() < MOST_TURNS * options.most {
            let again = |terms: &Vec<T>| same_terms(terms, &self.best.terms);
            if seen.iter().any(again) {
                break;
            }
            let best = &self.best;
            let done = best.terms.len() as f64 / (options.most as f64 + 1.0);
            progress(wording::LOOKING, done);
            let mut fitted = extended(gap, best, options, self.unnamed, None);
            fitted.retain(|h| h.terms.last().is_none_or(|term| !barred(term)));
            let worth = |h: &&Hypothesis<T>| {
                pays(gap, h, h.terms.len() - 1, best, options) && matters(gap, h)
            };
            let Some(chosen) = fitted.iter().find(worth) else {
                // A formula among many effects is what several of them leave, each a little off.
                let is_crowd = gap.names_first() && best.terms.len() > MANY;
                if self.unnamed || is_crowd {
                    break;
                }
                self.unnamed = true;
                continue;
            };
            let chosen = simplest(gap, chosen, fitted.iter().filter(worth), options).clone();
            seen.push(self.best.terms.clone());
            let added = chosen.terms.len() - 1;
            self.rivals.retain(|rival| rival.instead_of != added);
            self.rivals.extend(fitted.into_iter().filter(|h| h.terms != chosen.terms).map(
                |hypothesis| Rival { instead_of: added, behind: 0.0, stability: 0.0, hypothesis },
            ));
            self.best = chosen;
            if self.best.terms.len() > 1 {
                progress(wording::EXCHANGING, done + 0.1);
                let before = self.best.terms.clone();
                let new = before[before.len() - 1].clone();
                let best = self.best.clone();
                let best =
                    exchanged(gap, best, options, &mut self.rivals, Some(&new), self.unnamed);
                self.best = pruned(gap, best, options, Some(&new));
                // What was set aside beside another set of effects says nothing about this one.
                if self.best.terms != before {
                    self.rivals.clear();
                }
            }
        }
    }

    /// Searches once more from what is there without `broad`, and keeps what explains more.
    fn without<G: Residuals<Term = T>>(
        &mut self,
        gap: &G,
        options: &Options,
        broad: &T,
        progress: &mut dyn FnMut(&str, f64),
    ) {
        let Some(at) = self.best.terms.iter().position(|term| term == broad) else { return };
        let Some(rest) = left_out(gap, &self.best, at) else { return };
        let most = options.most.min(rest.terms.len() + DETOUR);
        let mut other = Self { best: rest, rivals: Vec::new(), unnamed: self.unnamed };
        other.grow(gap, &Options { most, ..*options }, &|term| term == broad, progress);
        other.best = pruned(gap, other.best, options, None);
        if other.best.evidence() < self.best.evidence() {
            *self = other;
        }
    }
}

/// Returns `best` with one more effect, with or without those that have no name, best first: screened by
/// linear algebra, the best few fitted. After an effect was left out, only what may take its place is tried.
fn extended<G: Residuals>(
    gap: &G,
    best: &Hypothesis<G::Term>,
    options: &Options,
    unnamed: bool,
    instead_of: Option<&G::Term>,
) -> Vec<Hypothesis<G::Term>> {
    let Some(local) = Local::at(gap, best, instead_of) else { return Vec::new() };
    let candidates: Vec<Candidate<G::Term>> = gap
        .candidates(&best.terms, &local.residuals, instead_of)
        .into_iter()
        .filter(|c| unnamed || c.surcharge <= 0.0)
        .filter(|c| c.joining().all(|new| best.terms.iter().all(|term| gap.compatible(term, new))))
        .collect();
    let ln_count = (best.count as f64).ln();
    // One entry per candidate: its best start.
    let mut screened: Vec<(f64, usize, Vec<f64>)> = candidates
        .par_iter()
        .enumerate()
        .filter_map(|(at, candidate)| {
            let joining: Vec<G::Term> = candidate.joining().cloned().collect();
            let specs: Vec<ParameterSpec> =
                joining.iter().flat_map(|term| gap.specs(term)).collect();
            let absent = &specs[..specs.len() - gap.specs(&candidate.term).len()];
            let absent: Vec<f64> = absent.iter().map(|s| s.neutral.unwrap_or(s.scale)).collect();
            let (left, parameters) = candidate
                .starts
                .iter()
                .map(|start| [&absent[..], start].concat())
                .filter_map(|start| local.screen(gap, best, &joining, &specs, &start))
                .min_by(|a, b| a.0.total_cmp(&b.0))?;
            let score = left + specs.len() as f64 * ln_count + candidate.surcharge;
            Some((score, at, parameters))
        })
        .collect();
    screened.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let promising = screened
        .into_iter()
        .enumerate()
        // Screening underrates what is far from linear, so one that loses a little is fitted too.
        .take_while(|(rank, (score, ..))| *rank < 2 || *score < best.train + 2.0 * ln_count)
        .map(|(_, entry)| entry)
        .take(options.shortlist);
    let shortlist: Vec<(f64, usize, Vec<f64>)> = promising.collect();
    let mut fitted: Vec<Hypothesis<G::Term>> = shortlist
        .into_par_iter()
        .filter_map(|(_, at, parameters)| {
            let candidate = &candidates[at];
            let mut terms = best.terms.clone();
            terms.extend(candidate.joining().cloned());
            let mut surcharges = best.surcharges.clone();
            surcharges.extend(candidate.with.iter().map(|_| 0.0));
            surcharges.push(candidate.surcharge);
            let joined = &terms[best.terms.len()..];
            let moves = near_parameters(gap, &terms, joined);
            let mut fitted = refit_some(gap, terms, parameters, surcharges, &moves)?;
            let gain = best.criterion() - fitted.criterion();
            fitted.gains[..best.gains.len()].copy_from_slice(&best.gains);
            *fitted.gains.last_mut()? = gain;
            Some(fitted)
        })
        .collect();
    fitted.sort_by(|a, b| weighed(gap, a, options).total_cmp(&weighed(gap, b, options)));
    fitted
}

/// Tries every effect (of those related to `new`, if one is given) against all others in its place.
pub(super) fn exchanged<G: Residuals>(
    gap: &G,
    mut best: Hypothesis<G::Term>,
    options: &Options,
    rivals: &mut Vec<Rival<G::Term>>,
    new: Option<&G::Term>,
    unnamed: bool,
) -> Hypothesis<G::Term> {
    // A new one is the last, and was chosen given the others a moment ago.
    let count = best.terms.len().saturating_sub(usize::from(new.is_some()));
    for at in (0..count).rev() {
        if new.is_some_and(|new| !gap.related(&best.terms[at], new)) {
            continue;
        }
        let Some(rest) = left_out(gap, &best, at) else { continue };
        let tried = extended(gap, &rest, options, unnamed, Some(&best.terms[at]));
        let matter = || tried.iter().filter(|h| matters(gap, h));
        let better = matter()
            .next()
            .filter(|first| {
                let same = first.terms.last() == Some(&best.terms[at]);
                same || weighed(gap, first, options) + 1e-6 < weighed(gap, &best, options)
            })
            .map(|first| simplest(gap, first, matter(), options))
            .filter(|better| {
                let same = better.terms.last() == Some(&best.terms[at]);
                let is_formula = |h: &Hypothesis<G::Term>, at: usize| h.surcharges[at] > 0.0;
                let loses_name =
                    is_formula(better, better.terms.len() - 1) && !is_formula(&best, at);
                let gain = weighed(gap, &best, options) - weighed(gap, better, options);
                (!same || gain > 1e-6) && (!loses_name || gain >= options.unnamed * best.gains[at])
            });
        if let Some(better) = better {
            best = better.clone();
            rivals.clear();
        } else {
            rivals.retain(|rival| rival.instead_of != at);
            rivals.extend(tried.into_iter().filter_map(|hypothesis| {
                let same = hypothesis.terms.last() == Some(&best.terms[at]);
                (!same).then_some(Rival { instead_of: at, hypothesis, behind: 0.0, stability: 0.0 })
            }));
        }
    }
    best
}

/// Leaves out what no longer pays, of what is related to `new` if that is given.
pub(super) fn pruned<G: Residuals>(
    gap: &G,
    mut best: Hypothesis<G::Term>,
    options: &Options,
    new: Option<&G::Term>,
) -> Hypothesis<G::Term> {
    let mut at = 0;
    while at < best.terms.len() {
        if new.is_some_and(|new| !gap.related(&best.terms[at], new)) {
            at += 1;
            continue;
        }
        match left_out(gap, &best, at) {
            Some(rest) if !pays(gap, &best, at, &rest, options) => {
                best = rest;
                at = 0;
            }
            _ => at += 1,
        }
    }
    best
}

/// Leaves out what was sensible when it joined and is not any more, beside all that joined after it: of several first the one
/// whose place the others take best. Returns what is left out as well, in that order.
pub(super) fn sensible<G: Residuals>(
    gap: &G,
    mut best: Hypothesis<G::Term>,
) -> (Hypothesis<G::Term>, Vec<G::Term>) {
    let mut out = Vec::new();
    loop {
        let absurd = (0..best.terms.len()).filter(|at| !sensible_at(gap, &best, *at));
        let rests = absurd.filter_map(|at| Some((at, left_out(gap, &best, at)?)));
        let next = rests.min_by(|a, b| a.1.evidence().total_cmp(&b.1.evidence()));
        let Some((at, rest)) = next else { return (best, out) };
        out.push(best.terms[at].clone());
        best = rest;
    }
}

/// Puts special cases in the place of general laws of which nothing else is left, in a hypothesis that has the effects of an
/// outcome, and names them so there.
pub(super) fn plain<G: Residuals>(
    gap: &G,
    mut h: Hypothesis<G::Term>,
    outcome: &mut Outcome<G::Term>,
) -> Hypothesis<G::Term> {
    while let Some((at, special, own)) = gap.collapsed(&h) {
        let (mut terms, mut parameters) = (h.terms.clone(), h.parameters.clone());
        let (from, general) = (begins(gap, &h, at), terms[at].clone());
        parameters.splice(from..from + gap.specs(&general).len(), own);
        terms[at] = special.clone();
        let Some(fitted) = refit(gap, terms, parameters, h.surcharges.clone()) else { break };
        h = Hypothesis { gains: h.gains, ..fitted };
        if let Some(place) = outcome.best.terms.iter().position(|term| *term == general) {
            outcome.best.terms[place] = special.clone();
            let same = |rival: &Rival<_>| rival.hypothesis.terms.last() == Some(&special);
            outcome.rivals.retain(|rival| rival.instead_of != place || !same(rival));
        }
    }
    h
}

/// Returns a hypothesis without one of its effects, the rest fitted again.
pub(super) fn left_out<G: Residuals>(
    gap: &G,
    best: &Hypothesis<G::Term>,
    at: usize,
) -> Option<Hypothesis<G::Term>> {
    let mut terms = best.terms.clone();
    let mut surcharges = best.surcharges.clone();
    let mut gains = best.gains.clone();
    surcharges.remove(at);
    gains.remove(at);
    let from = begins(gap, best, at);
    let count = gap.specs(&terms[at]).len();
    terms.remove(at);
    let mut parameters = best.parameters.clone();
    parameters.drain(from..from + count);
    let moves = near_parameters(gap, &terms, std::slice::from_ref(&best.terms[at]));
    let rest = refit_some(gap, terms, parameters, surcharges, &moves)?;
    Some(Hypothesis { gains, ..rest })
}
