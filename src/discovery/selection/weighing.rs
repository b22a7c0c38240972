//! What an effect is worth in a hypothesis: whether it pays, is larger than what the model resolves, is one that could be, and how far
//! behind its rivals are.
//!
//! Nothing is tried, exchanged or left out here; that is `search`'s.

use super::idle::idle;
use super::refit::begins;
use super::sure::DETERMINED;
use super::{Hypothesis, Options, ParameterSpec, Residuals, Rival, Set};

/// Returns the evidence against a hypothesis, with what is asked of effects that are not usual: to be more than a part of what
/// is left in any case, wherever they stand in the place of others.
pub(super) fn weighed<G: Residuals>(gap: &G, h: &Hypothesis<G::Term>, options: &Options) -> f64 {
    let rare = h.terms.iter().filter(|term| !gap.is_common(term));
    let left =
        rare.map(|term| gap.unexplained(Set::Train, term) + gap.unexplained(Set::Heldout, term));
    h.evidence() + options.matter * left.sum::<f64>()
}

/// Returns whether the effect at `at`, which `with` has and `without` has not, pays.
pub(super) fn pays<G: Residuals>(
    gap: &G,
    with: &Hypothesis<G::Term>,
    at: usize,
    without: &Hypothesis<G::Term>,
    options: &Options,
) -> bool {
    let gain = without.criterion() - with.criterion();
    let heldout = without.heldout - with.heldout;
    let others = without.terms.iter().zip(&without.gains);
    let explained: f64 = others
        .filter(|(other, _)| !gap.is_exact(other) && gap.related(other, &with.terms[at]))
        .map(|(_, gain)| gain.max(0.0))
        .sum();
    let part = if gap.is_broad(&with.terms[at]) { options.broad } else { 1.0 };
    let imperfection = part * (options.imperfection * explained).min(options.forgiven);
    let more = |set, taken: f64| taken > options.matter * gap.unexplained(set, &with.terms[at]);
    gain > options.least_gain + imperfection
        && more(Set::Train, without.train - with.train)
        && more(Set::Heldout, heldout)
        && (heldout > options.least_heldout
            || (gain > options.overwhelming && heldout > -options.least_heldout))
}

/// Returns whether the last effect is larger than what the model itself can resolve.
pub(super) fn matters<G: Residuals>(gap: &G, with: &Hypothesis<G::Term>) -> bool {
    let Some(term) = with.terms.last() else { return false };
    let specs = gap.specs(term);
    let from = with.parameters.len() - specs.len();
    let values = &with.parameters[from..];
    if !gap.is_sensible(term, values) {
        return false;
    }
    let is_there = |(i, (spec, value)): (usize, (&ParameterSpec, &f64))| {
        let std = with.covariance[(from + i, from + i)].max(0.0).sqrt();
        spec.neutral
            .is_some_and(|neutral| (value - neutral).abs() > spec.least.max(DETERMINED * std))
    };
    specs.iter().zip(values).enumerate().any(is_there)
        || specs.iter().all(|spec| spec.neutral.is_none())
}

/// Returns whether every effect of a hypothesis is one that could be.
pub fn is_sensible<G: Residuals>(gap: &G, h: &Hypothesis<G::Term>) -> bool {
    (0..h.terms.len()).all(|at| sensible_at(gap, h, at))
}

/// Returns whether an effect of a hypothesis is one that could be.
pub(super) fn sensible_at<G: Residuals>(gap: &G, h: &Hypothesis<G::Term>, at: usize) -> bool {
    let from = begins(gap, h, at);
    let count = gap.specs(&h.terms[at]).len();
    gap.is_sensible(&h.terms[at], &h.parameters[from..from + count])
}

/// Returns the special case of the last effect of `chosen` that explains nearly as much, or `chosen`.
pub(super) fn simplest<'a, G: Residuals>(
    gap: &G,
    chosen: &'a Hypothesis<G::Term>,
    mut others: impl Iterator<Item = &'a Hypothesis<G::Term>>,
    options: &Options,
) -> &'a Hypothesis<G::Term> {
    let (Some(general), Some(gain)) = (chosen.terms.last(), chosen.gains.last()) else {
        return chosen;
    };
    let stands_for = |other: &&Hypothesis<G::Term>| {
        let behind = other.evidence() - chosen.evidence();
        other.terms.last().is_some_and(|special| gap.contains(general, special))
            && behind < (options.generality * gain).min(options.forgiven)
    };
    others.find(stands_for).unwrap_or(chosen)
}

/// Returns how far behind `best` another explanation is, the last effect of which is in the place of the one at `at`.
pub(super) fn behind<G: Residuals>(
    gap: &G,
    other: &Hypothesis<G::Term>,
    (best, at): (&Hypothesis<G::Term>, usize),
    options: &Options,
) -> f64 {
    let behind = weighed(gap, other, options) - weighed(gap, best, options);
    // A more general law that explains the same is no rival, it is the same with more parameters.
    match other.terms.last() {
        Some(term) if gap.contains(term, &best.terms[at]) => behind.max(options.tie),
        _ => behind - forgiven(gap, other, (best, at), options),
    }
}

/// Returns how much of the price of its further numbers does not speak against another explanation that leaves as little: all of it
/// where the effect is likelier in itself, else that of those which do nothing.
pub(super) fn forgiven<G: Residuals>(
    gap: &G,
    other: &Hypothesis<G::Term>,
    (best, at): (&Hypothesis<G::Term>, usize),
    options: &Options,
) -> f64 {
    let chosen = &best.terms[at];
    let Some(term) = other.terms.last() else { return 0.0 };
    let price = other.cost() - best.cost();
    let more = weighed(gap, other, options) - weighed(gap, best, options) - price;
    if price <= 0.0 || more >= options.tie || gap.contains(term, chosen) {
        return 0.0;
    }
    if gap.is_likelier(term, chosen) {
        return price;
    }
    let in_vain = idle(gap, other, other.terms.len() - 1).saturating_sub(idle(gap, best, at));
    price.min(in_vain as f64 * best.price())
}

/// Says how far behind each rival is; those far behind are kept as runners-up, the best few only.
pub(super) fn compared<G: Residuals>(
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
        rival.behind = behind(gap, &rival.hypothesis, (best, rival.instead_of), options);
        // What does not explain anything is no rival either.
        let explains = without[rival.instead_of].evidence() - rival.hypothesis.evidence();
        if explains < options.least_gain {
            continue;
        }
        kept.push(rival);
    }
    kept
}
