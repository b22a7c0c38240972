//! Add the effect that explains most, exchange, leave out, until nothing pays; then compare the rivals.

use rayon::prelude::*;

use super::screen::Local;
use super::{Candidate, Gap, Hypothesis, Options, Outcome, Rival, refit};

/// Searches for the effects that are missing.
///
/// `progress` is told what is being done and which part of the whole is done.
///
/// # Errors
///
/// A sentence if the model without effects cannot be evaluated or fitted.
pub fn search<G: Gap>(
    gap: &G,
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Outcome<G::Term>, String> {
    let start: Vec<f64> = gap.nuisance().iter().map(|(_, value)| *value).collect();
    let nothing = refit(gap, Vec::new(), start, Vec::new())
        .ok_or("the model without effects runs away on the data; check its parameters and units")?;
    let mut best = nothing.clone();
    let mut rivals: Vec<Rival<G::Term>> = Vec::new();
    let mut unnamed = !gap.names_first();
    while best.terms.len() < options.most {
        let done = best.terms.len() as f64 / (options.most as f64 + 1.0);
        progress("looking for what explains the gap", done);
        let fitted = extended(gap, &best, options, unnamed);
        let worth = |h: &&Hypothesis<G::Term>| pays(&nothing, h, &best, options) && matters(gap, h);
        let Some(chosen) = fitted.iter().find(worth).cloned() else {
            if unnamed {
                break;
            }
            unnamed = true;
            continue;
        };
        let added = chosen.terms.len() - 1;
        rivals.retain(|rival| rival.instead_of != added);
        rivals.extend(
            fitted.into_iter().filter(|h| h.terms != chosen.terms).map(|hypothesis| Rival {
                instead_of: added,
                behind: 0.0,
                hypothesis,
            }),
        );
        best = chosen;
        if best.terms.len() > 1 {
            progress("trying to exchange and to leave out", done + 0.1);
            let before = best.terms.clone();
            let new = best.terms[best.terms.len() - 1].clone();
            best = exchanged(gap, best, options, &mut rivals, Some(&new), unnamed);
            best = pruned(gap, &nothing, best, options, Some(&new));
            // What was set aside beside another set of effects says nothing about this one.
            if best.terms != before {
                rivals.clear();
            }
        }
    }
    let all_related =
        best.terms.iter().all(|a| best.terms.iter().all(|b| a == b || gap.related(a, b)));
    if !all_related {
        progress("trying to exchange and to leave out, all of them", 0.9);
        best = exchanged(gap, best, options, &mut rivals, None, unnamed);
        best = pruned(gap, &nothing, best, options, None);
    }
    progress("comparing rivals", 0.95);
    let without: Vec<Hypothesis<G::Term>> = (0..best.terms.len())
        .map(|at| {
            let (terms, parameters, surcharges) = left_out(gap, &best, at);
            refit(gap, terms, parameters, surcharges).unwrap_or_else(|| nothing.clone())
        })
        .collect();
    let mut rivals = compared(gap, &best, &without, rivals, options);
    rivals.sort_by(|a, b| a.behind.total_cmp(&b.behind));
    Ok(Outcome { nothing, best, without, rivals })
}

/// Returns whether what `with` has more than `without` pays.
fn pays<T>(
    nothing: &Hypothesis<T>,
    with: &Hypothesis<T>,
    without: &Hypothesis<T>,
    options: &Options,
) -> bool {
    let gain = without.criterion() - with.criterion();
    let heldout = without.heldout - with.heldout;
    let explained = (nothing.criterion() - without.criterion()).max(0.0);
    let imperfection = (options.imperfection * explained).min(options.overwhelming);
    gain > options.least_gain + imperfection
        && (heldout > options.least_heldout
            || (gain > options.overwhelming && heldout > -options.least_heldout))
}

/// Returns whether the last effect is larger than what the model itself can resolve.
fn matters<G: Gap>(gap: &G, with: &Hypothesis<G::Term>) -> bool {
    let Some(term) = with.terms.last() else { return false };
    let slots = gap.slots(term);
    let from = with.parameters.len() - slots.len();
    if !gap.is_sensible(term, &with.parameters[from..]) {
        return false;
    }
    slots.iter().zip(&with.parameters[from..]).any(|(slot, value)| {
        slot.neutral.is_some_and(|neutral| (value - neutral).abs() > slot.least)
    }) || slots.iter().all(|slot| slot.neutral.is_none())
}

/// Returns `best` with one more effect, with or without those that have no name, best first: screened by linear algebra, the best few fitted.
fn extended<G: Gap>(
    gap: &G,
    best: &Hypothesis<G::Term>,
    options: &Options,
    unnamed: bool,
) -> Vec<Hypothesis<G::Term>> {
    let Some(local) = Local::at(gap, best) else { return Vec::new() };
    let candidates: Vec<Candidate<G::Term>> = gap
        .candidates(&best.terms, &local.residuals)
        .into_iter()
        .filter(|c| unnamed || c.surcharge <= 0.0)
        .filter(|c| best.terms.iter().all(|term| gap.compatible(term, &c.term)))
        .collect();
    let ln_count = (best.count as f64).ln();
    // One entry per candidate: its best start.
    let mut screened: Vec<(f64, usize, Vec<f64>)> = candidates
        .par_iter()
        .enumerate()
        .filter_map(|(at, candidate)| {
            let slots = gap.slots(&candidate.term);
            let (left, parameters) = candidate
                .starts
                .iter()
                .filter_map(|start| local.screen(gap, best, &candidate.term, &slots, start))
                .min_by(|a, b| a.0.total_cmp(&b.0))?;
            let score = left + slots.len() as f64 * ln_count + candidate.surcharge;
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
            terms.push(candidate.term.clone());
            let mut surcharges = best.surcharges.clone();
            surcharges.push(candidate.surcharge);
            refit(gap, terms, parameters, surcharges)
        })
        .collect();
    fitted.sort_by(|a, b| a.evidence().total_cmp(&b.evidence()));
    fitted
}

/// Tries every effect (of those related to `new`, if one is given) against all others in its place.
fn exchanged<G: Gap>(
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
        let (terms, parameters, surcharges) = left_out(gap, &best, at);
        let Some(rest) = refit(gap, terms, parameters, surcharges) else { continue };
        let tried = extended(gap, &rest, options, unnamed);
        if let Some(better) = tried.iter().find(|h| matters(gap, h))
            && better.evidence() + 1e-6 < best.evidence()
        {
            best = better.clone();
            rivals.clear();
        } else {
            rivals.retain(|rival| rival.instead_of != at);
            rivals.extend(tried.into_iter().filter_map(|hypothesis| {
                let same = hypothesis.terms.last() == Some(&best.terms[at]);
                (!same).then_some(Rival { instead_of: at, hypothesis, behind: 0.0 })
            }));
        }
    }
    best
}

/// Leaves out what no longer pays, of what is related to `new` if that is given.
fn pruned<G: Gap>(
    gap: &G,
    nothing: &Hypothesis<G::Term>,
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
        let (terms, parameters, surcharges) = left_out(gap, &best, at);
        match refit(gap, terms, parameters, surcharges) {
            Some(rest) if !pays(nothing, &best, &rest, options) => {
                best = rest;
                at = 0;
            }
            _ => at += 1,
        }
    }
    best
}

/// Says how far behind each rival is; those far behind are kept as runners-up, the best few only.
fn compared<G: Gap>(
    gap: &G,
    best: &Hypothesis<G::Term>,
    without: &[Hypothesis<G::Term>],
    rivals: Vec<Rival<G::Term>>,
    options: &Options,
) -> Vec<Rival<G::Term>> {
    let mut kept: Vec<Rival<G::Term>> = Vec::new();
    for mut rival in rivals {
        if rival.instead_of >= best.terms.len() {
            continue;
        }
        let chosen = &best.terms[rival.instead_of];
        let Some(term) = rival.hypothesis.terms.last() else { continue };
        let others: Vec<&G::Term> = best
            .terms
            .iter()
            .enumerate()
            .filter(|(at, _)| *at != rival.instead_of)
            .map(|(_, term)| term)
            .collect();
        let fits = rival.hypothesis.terms.len() == best.terms.len()
            && others.iter().all(|term| rival.hypothesis.terms.contains(term));
        if !fits || term == chosen {
            continue;
        }
        rival.behind = rival.hypothesis.evidence() - best.evidence();
        // A more general law that explains the same is no rival, it is the same with more parameters;
        // and what does not explain anything is none either.
        let explains = without[rival.instead_of].evidence() - rival.hypothesis.evidence();
        if explains < options.least_gain {
            continue;
        }
        if gap.contains(term, chosen) && rival.behind < options.tie {
            rival.behind = rival.behind.max(options.tie);
        }
        kept.push(rival);
    }
    kept
}

/// Returns the effects without one of them, with the parameters of the rest.
fn left_out<G: Gap>(
    gap: &G,
    best: &Hypothesis<G::Term>,
    at: usize,
) -> (Vec<G::Term>, Vec<f64>, Vec<f64>) {
    let mut terms = best.terms.clone();
    let mut surcharges = best.surcharges.clone();
    surcharges.remove(at);
    let mut from = gap.nuisance().len();
    for term in &terms[..at] {
        from += gap.slots(term).len();
    }
    let count = gap.slots(&terms[at]).len();
    terms.remove(at);
    let mut parameters = best.parameters.clone();
    parameters.drain(from..from + count);
    (terms, parameters, surcharges)
}
