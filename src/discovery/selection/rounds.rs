//! The search where residuals are linear in all but the shapes of the laws: written out once, searched from several
//! beginnings, fitted as they are, and written out again about what was found.

use rayon::prelude::*;

use super::linear::Linear;
use super::refit::same_terms;
use super::search::{Grown, left_out, plain, sensible};
use super::steady::{least_steady, steadied};
use super::sure::least_sure;
use super::weighing::{behind, is_sensible, pays, sensible_at, weighed};
use super::wording::WRITING_OUT;
use super::{Diverged, Hypothesis, Options, Outcome, Residuals, Rival, refit};

/// Times the gap is written out; what was found rarely changes after the second.
const ROUNDS: usize = 3;
/// And at most, where effects have to be left out again.
const MOST_ROUNDS: usize = 5;
/// Names whose size is not sure, or that few draws of the data name, are left out one by one, at most so many.
const MOST_UNSTEADY: usize = 4;

/// Candidates fitted of those screened: the same law in several shapes counts as several.
const SHORTLIST: usize = 12;

/// Rivals this many ties behind are not worth a fit of their shapes, and win in no draw of the data.
pub(super) const FAR: f64 = 5.0;

/// What explains this part of what the effect in its place does may explain all of it once the shapes beside it are its own.
const CONTENDS: f64 = 0.5;

/// Returns everything usual at once, fitted, or nothing where nothing is usual; and how much more than its noise is left of
/// every sensor by all candidates at once about it, at least 1: real machines are never described to the noise of their
/// sensors, and what no law describes must not be taken for evidence of one.
pub fn floors<G: Residuals>(gap: &G) -> Option<(Hypothesis<G::Term>, Vec<f64>)> {
    let nothing = refit(gap, Vec::new(), Vec::new(), Vec::new())?;
    let about = usual(gap, &nothing).unwrap_or(nothing);
    let floors = Linear::about(gap, &about, &|_| true)?.floors;
    Some((about, floors))
}

/// As [`super::search`], for gaps whose residuals are linear in all but the shapes of the laws, or nearly so; begins from
/// `about`, which is everything usual.
///
/// # Errors
///
/// [`Diverged`] if the model cannot be evaluated or fitted.
pub fn search_linear<G: Residuals>(
    gap: &G,
    about: Hypothesis<G::Term>,
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Outcome<G::Term>, Diverged> {
    let nothing = refit(gap, Vec::new(), Vec::new(), Vec::new()).ok_or(Diverged::WithEffects)?;
    let options = &Options { shortlist: options.shortlist.max(SHORTLIST), ..*options };
    let mut best = about;
    let (mut round, mut unsteady) = (0, 0);
    // What made no sense once it was fitted as it is: it would be found again, and stand behind all that is said of the others.
    let mut refused: Vec<G::Term> = Vec::new();
    loop {
        progress(WRITING_OUT, round as f64 / ROUNDS as f64);
        let wanted = |term: &G::Term| !refused.contains(term);
        let linear = Linear::about(gap, &best, &wanted).ok_or(Diverged::WithEffects)?;
        let grown = if round == 0 {
            begun(&linear, &best, options, progress).ok_or(Diverged::WithEffects)?
        } else {
            let Hypothesis { terms, parameters, surcharges, gains, .. } = best.clone();
            let here =
                refit(&linear, terms, parameters, surcharges).ok_or(Diverged::WithEffects)?;
            let mut grown = Grown::from(&linear, Hypothesis { gains, ..here });
            grown.grow(&linear, options, &|_| false, progress);
            grown
        };
        let mut outcome = grown.outcome(&linear, options, nothing.clone(), progress);
        let Hypothesis { mut terms, mut parameters, mut surcharges, mut gains, .. } =
            outcome.best.clone();
        let last = round + 1 >= ROUNDS;
        let simplified = gap.simplified(&terms, &parameters).filter(|_| !last);
        let is_plain = simplified.is_none();
        if let Some(simplified) = simplified {
            (terms, parameters) = simplified;
            surcharges.resize(terms.len(), 0.0);
            gains.resize(terms.len(), 0.0);
        }
        let fitted = refit(gap, terms, parameters, surcharges).ok_or(Diverged::WithEffects)?;
        let fitted = plain(gap, Hypothesis { gains, ..fitted }, &mut outcome);
        let settled = same_terms(&fitted.terms, &best.terms);
        // What stood for something that is left out by now may make no sense once it is fitted as it is; what makes none
        // only beside it, or without it, may come again.
        let (kept, out) = sensible(gap, fitted);
        let is_whole = out.is_empty();
        best = kept;
        refused.extend(out.into_iter().next());
        round += 1;
        if (is_plain && is_whole && (settled || last)) || round >= MOST_ROUNDS + unsteady {
            outcome.keep(&best.terms);
            let mut outcome = with_shapes(gap, outcome, best, options);
            // Shapes that were fitted beside what is not common stood for it when what is common was tried in its place.
            let is_better = |rival: &&Rival<G::Term>| {
                rival.behind < 0.0 && is_usual_instead(gap, &outcome.best, rival)
            };
            let better = outcome.rivals.iter().find(is_better);
            if let Some(better) = better.filter(|_| unsteady < MOST_UNSTEADY) {
                (best, unsteady) = (better.hypothesis.clone(), unsteady + 1);
                continue;
            }
            steadied(gap, &mut outcome, options);
            let weakest = least_sure(gap, &outcome).or_else(|| least_steady(&outcome));
            let weakest = weakest.filter(|_| unsteady < MOST_UNSTEADY);
            let Some(at) = weakest else { return Ok(outcome) };
            let Some(rest) = left_out(gap, &outcome.best, at) else { return Ok(outcome) };
            refused.push(outcome.best.terms[at].clone());
            (best, unsteady) = (rest, unsteady + 1);
        }
    }
}

/// Searches from nothing, from nothing with what is broad only after all else, and from everything usual at once; returns
/// what explains most. The gap is written out about everything usual.
fn begun<G: Residuals>(
    gap: &Linear<'_, G>,
    about: &Hypothesis<G::Term>,
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Option<Grown<G::Term>> {
    let nothing = refit(gap, Vec::new(), Vec::new(), Vec::new())?;
    let mut found = Vec::new();
    let mut first = Grown::from(gap, nothing.clone());
    first.grow(gap, options, &|_| false, progress);
    let has_broad = first.best.terms.iter().any(|term| gap.is_broad(term));
    let is_crowd = first.best.terms.len() > 1;
    found.push(first);
    if has_broad && is_crowd {
        let mut narrow = Grown::from(gap, nothing.clone());
        narrow.grow(gap, options, &|term| gap.is_broad(term), progress);
        narrow.grow(gap, options, &|_| false, progress);
        found.push(narrow);
    }
    if is_crowd && !about.terms.is_empty() {
        let Hypothesis { terms, parameters, surcharges, .. } = about.clone();
        let usual = refit(gap, terms, parameters, surcharges)?;
        let mut grown = Grown::from(gap, thinned(gap, usual, options));
        grown.grow(gap, options, &|_| false, progress);
        found.push(grown);
    }
    let left = |grown: &Grown<G::Term>| weighed(gap, &grown.best, options);
    found.into_iter().min_by(|a, b| left(a).total_cmp(&left(b)))
}

/// Fits everything usual at once, each effect in the best of its shapes.
fn usual<G: Residuals>(gap: &G, nothing: &Hypothesis<G::Term>) -> Option<Hypothesis<G::Term>> {
    let terms = gap.common();
    if terms.is_empty() {
        return None;
    }
    let linear = Linear::about(gap, nothing, &|term| terms.contains(term))?;
    let starts: Vec<&[Vec<f64>]> = terms.iter().map(|term| linear.starts(term)).collect();
    let mut chosen: Vec<usize> = vec![0; terms.len()];
    let surcharges = vec![0.0; terms.len()];
    let with = |chosen: &[usize]| {
        let parts = starts.iter().zip(chosen).map(|(starts, at)| starts.get(*at).cloned());
        let parameters = parts.collect::<Option<Vec<_>>>()?.concat();
        refit(&linear, terms.clone(), parameters, surcharges.clone())
    };
    let mut best = with(&chosen)?;
    for at in 0..terms.len() {
        for shape in 1..starts[at].len() {
            let mut other = chosen.clone();
            other[at] = shape;
            if let Some(tried) = with(&other).filter(|tried| tried.train < best.train) {
                (best, chosen) = (tried, other);
            }
        }
    }
    refit(gap, best.terms, best.parameters, best.surcharges)
}

/// Leaves out of a hypothesis what does not pay, the weakest first.
fn thinned<G: Residuals>(
    gap: &Linear<'_, G>,
    mut best: Hypothesis<G::Term>,
    options: &Options,
) -> Hypothesis<G::Term> {
    loop {
        let rests: Vec<Option<Hypothesis<G::Term>>> =
            (0..best.terms.len()).into_par_iter().map(|at| left_out(gap, &best, at)).collect();
        let here = best.criterion();
        let gain =
            |rest: &Option<Hypothesis<_>>| rest.as_ref().map_or(0.0, |r| r.criterion() - here);
        best.gains = rests.iter().map(gain).collect();
        let absurd = |at: &usize| !sensible_at(gap, &best, *at);
        let weak = |(at, rest): &(usize, Hypothesis<G::Term>)| {
            absurd(at) || !pays(gap, &best, *at, rest, options)
        };
        let weakest = rests
            .into_iter()
            .enumerate()
            .filter_map(|(at, rest)| Some((at, rest?)))
            .filter(weak)
            .min_by(|a, b| {
                let absurd = absurd(&b.0).cmp(&absurd(&a.0));
                absurd.then(a.1.evidence().total_cmp(&b.1.evidence()))
            });
        match weakest {
            Some((_, rest)) => best = rest,
            None => return best,
        }
    }
}

/// Returns whether a rival puts what is common in the place of what is not.
fn is_usual_instead<G: Residuals>(
    gap: &G,
    best: &Hypothesis<G::Term>,
    rival: &Rival<G::Term>,
) -> bool {
    let is_common = rival.hypothesis.terms.last().is_some_and(|term| gap.is_common(term));
    is_common && !gap.is_common(&best.terms[rival.instead_of])
}

/// Puts the explanation fitted with its shapes in the place of the one of the search, and fits the shapes of those rivals that
/// come near it, or are common where what is in their place is not, and explain half of what that does.
fn with_shapes<G: Residuals>(
    gap: &G,
    mut outcome: Outcome<G::Term>,
    best: Hypothesis<G::Term>,
    options: &Options,
) -> Outcome<G::Term> {
    let explained = |at: usize| outcome.without[at].evidence() - outcome.best.evidence();
    let is_worth_a_fit = |rival: &Rival<G::Term>| {
        let contends = || rival.behind < (1.0 - CONTENDS) * explained(rival.instead_of);
        rival.behind < FAR * options.tie || is_usual_instead(gap, &best, rival) && contends()
    };
    outcome.rivals.par_iter_mut().filter(|rival| is_worth_a_fit(rival)).for_each(|rival| {
        let Hypothesis { terms, parameters, surcharges, gains, .. } = rival.hypothesis.clone();
        if let Some(fitted) = refit(gap, terms, parameters, surcharges) {
            rival.behind = behind(gap, &fitted, (&best, rival.instead_of), options);
            rival.hypothesis = Hypothesis { gains, ..fitted };
        }
    });
    outcome.rivals.retain(|rival| is_sensible(gap, &rival.hypothesis));
    outcome.rivals.sort_by(|a, b| a.behind.total_cmp(&b.behind));
    outcome.best = best;
    outcome
}
