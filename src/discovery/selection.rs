//! The search for what is missing: which effects, how large, and whether the data can tell.
//!
//! A [`Gap`] says what the residuals are for any list of effects; [`search`] adds the effect that explains
//! most, fits all of them together again, tries to exchange and to leave out each one, and stops when
//! nothing more pays. Paying means two things at once: the Bayesian information criterion falls on the
//! data fitted, and the misfit falls on data that were not. What explains the data as well as the
//! effect chosen is kept as a [`Rival`], so that the caller can say "cannot tell".
//!
//! Residuals are in units of their noise, so that the sum of their squares is `-2 ln` of the likelihood.
//! The search draws no random numbers; parallel parts are collected in order.
//!
//! Source: Schwarz, "Estimating the Dimension of a Model", 1978; Kass and Raftery, "Bayes Factors", 1995,
//! for the scale of evidence.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::fit;

/// How a parameter enters, and on what scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slot {
    /// Its name.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// A change that is small, yet visible: for derivatives.
    pub scale: f64,
    /// Least and greatest value.
    pub range: (f64, f64),
    /// The value at which the effect is not there, whatever the others are; `None` for parameters of
    /// its shape.
    pub neutral: Option<f64>,
    /// Nearer to its neutral value than this it means nothing, whatever the data say: the model itself
    /// is not that exact.
    pub least: f64,
}

/// Which data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Set {
    /// The data fitted.
    Train,
    /// The data held out.
    Heldout,
}

/// An effect that might be missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate<T> {
    /// The effect.
    pub term: T,
    /// Parameters to begin from, each with the shape fixed; parameters with a neutral value are solved
    /// for when it is screened.
    pub starts: Vec<Vec<f64>>,
    /// What it costs beside its parameters, in the units of the criterion: an effect without a name
    /// must explain more than one with.
    pub surcharge: f64,
}

/// What is to be explained.
pub trait Gap: Sync {
    /// An effect at its place.
    type Term: Clone + PartialEq + Send + Sync;

    /// Returns the parameters of the model itself that are estimated along with any effects, with
    /// their values to begin from.
    fn nuisance(&self) -> Vec<(Slot, f64)> {
        Vec::new()
    }

    /// Returns the parameters of an effect.
    fn slots(&self, term: &Self::Term) -> Vec<Slot>;

    /// Returns the residuals in units of noise for the model's own parameters followed by those of the
    /// effects in order; `None` when the model runs away.
    fn residuals(&self, set: Set, terms: &[Self::Term], parameters: &[f64]) -> Option<Vec<f64>>;

    /// Returns how many independent residuals a set has.
    fn count(&self, set: Set) -> usize;

    /// Returns what could be missing beyond `terms`, given the residuals that are left on the data
    /// fitted.
    fn candidates(&self, terms: &[Self::Term], left: &[f64]) -> Vec<Candidate<Self::Term>>;

    /// Returns whether the two can act together. An effect of the same kind at the same place cannot.
    fn compatible(&self, a: &Self::Term, b: &Self::Term) -> bool {
        a != b
    }

    /// Returns whether the residuals change unevenly with the effect's parameters, as where contact is
    /// lost and made again: then the fit begins with a loss that a few wild rows cannot steer.
    fn is_rough(&self, term: &Self::Term) -> bool {
        let _ = term;
        false
    }

    /// Returns whether an effect with these parameters is more than an accident of a few rows.
    fn is_sensible(&self, term: &Self::Term, parameters: &[f64]) -> bool {
        let _ = (term, parameters);
        true
    }

    /// Returns whether `general` can do all that `special` can: then the simpler one is named when both
    /// explain the data, and no doubt is raised.
    fn contains(&self, general: &Self::Term, special: &Self::Term) -> bool {
        let _ = (general, special);
        false
    }
}

/// Some effects with their parameters fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis<T> {
    /// The effects.
    pub terms: Vec<T>,
    /// Parameters of the model, then of the effects, as fitted.
    pub parameters: Vec<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Sum of squares on the data fitted.
    pub train: f64,
    /// Sum of squares on the data held out, same parameters; infinite if the model runs away on them.
    pub heldout: f64,
    /// Surcharges of the effects, one each.
    pub surcharges: Vec<f64>,
    /// Number of residuals in the data fitted.
    pub count: usize,
}

impl<T> Hypothesis<T> {
    /// Returns the criterion on the data fitted; smaller is better.
    pub fn criterion(&self) -> f64 {
        self.train + self.cost()
    }

    /// Returns the criterion over all data, fitted and held out.
    pub fn evidence(&self) -> f64 {
        self.train + self.heldout + self.cost()
    }

    fn cost(&self) -> f64 {
        let surcharge: f64 = self.surcharges.iter().sum();
        self.parameters.len() as f64 * (self.count as f64).ln() + surcharge
    }
}

/// Another effect in the place of the one chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Rival<T> {
    /// Which of the effects chosen it would replace.
    pub instead_of: usize,
    /// The hypothesis with it.
    pub hypothesis: Hypothesis<T>,
    /// How much worse its evidence is.
    pub behind: f64,
}

/// How to search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Most effects at once.
    pub most: usize,
    /// How many of the screened candidates are fitted.
    pub shortlist: usize,
    /// How much the criterion must fall, beyond the cost of the parameters, for an effect to count.
    pub least_gain: f64,
    /// How much the misfit on the data held out must fall.
    pub least_heldout: f64,
    /// With a gain on the data fitted above this, held-out data that do not exercise the effect (no
    /// change there) do not speak against it.
    pub overwhelming: f64,
    /// An effect must explain more than this part of what all others explain already, up to
    /// `overwhelming`: how the others act is known that well and no better.
    pub imperfection: f64,
    /// Rivals whose evidence is behind by less than this cannot be told apart.
    pub tie: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            most: 5,
            shortlist: 6,
            // About 2 ln(number of candidates): the best of hundreds of useless ones gains that much.
            least_gain: 8.0,
            least_heldout: 4.0,
            overwhelming: 60.0,
            // A law that is right to three parts in a hundred leaves the square of it.
            imperfection: 1e-3,
            // "Strong" on the scale of Kass and Raftery begins at 6.
            tie: 6.0,
        }
    }
}

/// What the search found.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome<T> {
    /// Without any effect.
    pub nothing: Hypothesis<T>,
    /// With the effects that pay.
    pub best: Hypothesis<T>,
    /// The hypothesis without each effect, the others fitted again.
    pub without: Vec<Hypothesis<T>>,
    /// Other explanations, best first.
    pub rivals: Vec<Rival<T>>,
}

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
    while best.terms.len() < options.most {
        let done = best.terms.len() as f64 / (options.most as f64 + 1.0);
        progress("looking for what explains the gap", done);
        let fitted = extended(gap, &best, options);
        let worth = |h: &&Hypothesis<G::Term>| pays(&nothing, h, &best, options) && matters(gap, h);
        let Some(chosen) = fitted.iter().find(worth).cloned() else { break };
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
            best = exchanged(gap, best, options, &mut rivals);
            best = pruned(gap, &nothing, best, options);
            // What was set aside beside another set of effects says nothing about this one.
            if best.terms != before {
                rivals.clear();
            }
        }
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

/// Returns `best` with one more effect, best first: screened by linear algebra, the best few fitted.
fn extended<G: Gap>(
    gap: &G,
    best: &Hypothesis<G::Term>,
    options: &Options,
) -> Vec<Hypothesis<G::Term>> {
    let Some(local) = Local::at(gap, best) else { return Vec::new() };
    let candidates: Vec<Candidate<G::Term>> = gap
        .candidates(&best.terms, &local.residuals)
        .into_iter()
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

/// Tries every effect in turn against all others in its place.
fn exchanged<G: Gap>(
    gap: &G,
    mut best: Hypothesis<G::Term>,
    options: &Options,
    rivals: &mut Vec<Rival<G::Term>>,
) -> Hypothesis<G::Term> {
    // The last one was chosen given the others a moment ago.
    for at in (0..best.terms.len() - 1).rev() {
        let (terms, parameters, surcharges) = left_out(gap, &best, at);
        let Some(rest) = refit(gap, terms, parameters, surcharges) else { continue };
        let tried = extended(gap, &rest, options);
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

/// Leaves out what no longer pays.
fn pruned<G: Gap>(
    gap: &G,
    nothing: &Hypothesis<G::Term>,
    mut best: Hypothesis<G::Term>,
    options: &Options,
) -> Hypothesis<G::Term> {
    let mut at = 0;
    while at < best.terms.len() {
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

/// The model linearised about a hypothesis.
struct Local {
    residuals: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

/// What is added to the diagonal of scaled normal equations: far below what the data determine.
const RIDGE: f64 = 1e-9;

impl Local {
    fn at<G: Gap>(gap: &G, best: &Hypothesis<G::Term>) -> Option<Self> {
        let residuals = gap.residuals(Set::Train, &best.terms, &best.parameters)?;
        let slots = all_slots(gap, &best.terms);
        let columns = columns(gap, &best.terms, &best.parameters, &slots, &residuals)?;
        Some(Self { residuals, columns })
    }

    /// Returns the sum of squares that a linear fit leaves when the candidate joins, and where that
    /// fit ends; shape parameters stay as they start.
    fn screen<G: Gap>(
        &self,
        gap: &G,
        best: &Hypothesis<G::Term>,
        term: &G::Term,
        slots: &[Slot],
        start: &[f64],
    ) -> Option<(f64, Vec<f64>)> {
        let mut terms = best.terms.clone();
        terms.push(term.clone());
        let mut parameters = best.parameters.clone();
        let from = parameters.len();
        parameters.extend_from_slice(start);
        let absent = slots.iter().zip(start).any(|(slot, value)| {
            slot.neutral.is_some_and(|neutral| (neutral - value).abs() < 1e-15)
        }) && slots.iter().zip(start).all(|(slot, value)| {
            slot.neutral.is_none_or(|neutral| (neutral - value).abs() < 1e-15)
        });
        let here;
        let residuals = if absent {
            &self.residuals
        } else {
            here = gap.residuals(Set::Train, &terms, &parameters)?;
            &here
        };
        let mut solved: Vec<(usize, Vec<f64>)> = Vec::new();
        for (i, slot) in slots.iter().enumerate() {
            if slot.neutral.is_none() {
                continue;
            }
            let mut moved = parameters.clone();
            moved[from + i] += slot.scale;
            let at = gap.residuals(Set::Train, &terms, &moved)?;
            let column = at.iter().zip(residuals).map(|(a, r)| (a - r) / slot.scale).collect();
            solved.push((i, column));
        }
        let old = self.columns.len();
        let all: Vec<&[f64]> = self
            .columns
            .iter()
            .map(Vec::as_slice)
            .chain(solved.iter().map(|(_, column)| column.as_slice()))
            .collect();
        let (step, left) = least_squares(&all, residuals)?;
        for (i, change) in step.iter().take(old).enumerate() {
            parameters[i] += change;
        }
        let mut outside = false;
        for ((i, _), change) in solved.iter().zip(step.iter().skip(old)) {
            let slot = &slots[*i];
            let value = parameters[from + i] + change;
            outside |= value < slot.range.0 || value > slot.range.1;
            parameters[from + i] = value.clamp(slot.range.0, slot.range.1);
        }
        if outside {
            // A negative friction explains nothing: judge where the range ends.
            let clamped = gap.residuals(Set::Train, &terms, &parameters)?;
            return Some((sum_of_squares(&clamped), parameters));
        }
        Some((left, parameters))
    }
}

/// Returns the step that minimises `|r + J step|²` and what is left of it.
fn least_squares(columns: &[&[f64]], residuals: &[f64]) -> Option<(Vec<f64>, f64)> {
    let n = columns.len();
    let total = sum_of_squares(residuals);
    if n == 0 {
        return Some((Vec::new(), total));
    }
    let scale: Vec<f64> =
        columns.iter().map(|column| sum_of_squares(column).sqrt().max(1e-300)).collect();
    let mut a = DMatrix::zeros(n, n);
    let mut g = DVector::zeros(n);
    for i in 0..n {
        g[i] = -dot(columns[i], residuals) / scale[i];
        for j in 0..=i {
            a[(i, j)] = dot(columns[i], columns[j]) / (scale[i] * scale[j]);
            a[(j, i)] = a[(i, j)];
        }
        a[(i, i)] += RIDGE;
    }
    let solution = a.cholesky()?.solve(&g);
    let left = total - solution.dot(&g);
    let step = solution.iter().zip(&scale).map(|(s, scale)| s / scale).collect();
    Some((step, left.max(0.0)))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums keep the processor's adders busy.
    let mut sums = [0.0; 4];
    let (chunks_a, chunks_b) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = chunks_a.remainder().iter().zip(chunks_b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in chunks_a.zip(chunks_b) {
        for i in 0..4 {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Returns the sum of squares that is left of `residuals` when multiples of the columns may be taken
/// away; `None` if the columns determine no multiples.
pub fn left_after(columns: &[&[f64]], residuals: &[f64]) -> Option<f64> {
    least_squares(columns, residuals).map(|(_, left)| left)
}

/// Returns `Σ v²`.
pub fn sum_of_squares(values: &[f64]) -> f64 {
    dot(values, values)
}

fn all_slots<G: Gap>(gap: &G, terms: &[G::Term]) -> Vec<Slot> {
    let mut slots: Vec<Slot> = gap.nuisance().into_iter().map(|(slot, _)| slot).collect();
    for term in terms {
        slots.extend(gap.slots(term));
    }
    slots
}

/// Derivatives of the residuals, one column per parameter; one-sided, towards the inside of its range.
fn columns<G: Gap>(
    gap: &G,
    terms: &[G::Term],
    parameters: &[f64],
    slots: &[Slot],
    residuals: &[f64],
) -> Option<Vec<Vec<f64>>> {
    (0..parameters.len())
        .into_par_iter()
        .map(|i| {
            let mut moved = parameters.to_vec();
            let mut step = 0.1 * slots[i].scale;
            if moved[i] + step > slots[i].range.1 {
                step = -step;
            }
            moved[i] += step;
            let at = gap.residuals(Set::Train, terms, &moved)?;
            Some(at.iter().zip(residuals).map(|(a, r)| (a - r) / step).collect())
        })
        .collect()
}

/// The residuals on the data fitted as a least-squares problem.
struct Problem<'a, G: Gap> {
    gap: &'a G,
    terms: &'a [G::Term],
    slots: &'a [Slot],
    n: usize,
}

impl<G: Gap> fit::Problem for Problem<'_, G> {
    fn n_residuals(&self) -> usize {
        self.n
    }

    fn residuals(&self, x: &[f64], r: &mut [f64]) {
        match self.gap.residuals(Set::Train, self.terms, x) {
            Some(values) => r.copy_from_slice(&values),
            None => r.fill(f64::NAN),
        }
    }

    fn jacobian(&self, x: &[f64], j: &mut fit::Jacobian) -> bool {
        let Some(here) = self.gap.residuals(Set::Train, self.terms, x) else { return false };
        let Some(columns) = columns(self.gap, self.terms, x, self.slots, &here) else {
            return false;
        };
        for row in 0..self.n {
            for (to, column) in j.row_mut(row).iter_mut().zip(&columns) {
                *to = column[row];
            }
        }
        true
    }
}

/// Residuals beyond this many standard deviations steer less while a rough effect is located.
const ROUGH: f64 = 2.0;

/// Fits the parameters of some effects on the data fitted and evaluates them on the data held out.
pub fn refit<G: Gap>(
    gap: &G,
    terms: Vec<G::Term>,
    start: Vec<f64>,
    surcharges: Vec<f64>,
) -> Option<Hypothesis<G::Term>> {
    let slots = all_slots(gap, &terms);
    let first = gap.residuals(Set::Train, &terms, &start)?;
    let count = gap.count(Set::Train);
    let (parameters, covariance, train) = if slots.is_empty() {
        let train = sum_of_squares(&first);
        (start, DMatrix::zeros(0, 0), train)
    } else {
        let problem = Problem { gap, terms: &terms, slots: &slots, n: first.len() };
        let bounds = slots
            .iter()
            .enumerate()
            .filter(|(_, slot)| slot.range.0.is_finite() || slot.range.1.is_finite());
        let options = fit::Options {
            noise: fit::Noise::Known,
            max_iterations: 30,
            // A thousandth of a standard deviation is nothing; a misfit of 0.01 is nothing.
            step_tolerance: 1e-6,
            cost_tolerance: 5e-7,
            bounds: bounds
                .map(|(parameter, slot)| fit::Bound {
                    parameter,
                    lower: slot.range.0,
                    upper: slot.range.1,
                })
                .collect(),
            ..fit::Options::default()
        };
        let mut start = start;
        if terms.last().is_some_and(|term| gap.is_rough(term)) {
            let robust = fit::Options { loss: fit::Loss::Huber(ROUGH), ..options.clone() };
            start = fit::solve(&problem, &start, &robust).ok()?.x;
        }
        let fit = fit::solve(&problem, &start, &options).ok()?;
        let train = sum_of_squares(&fit.residuals);
        (fit.x, fit.covariance, train)
    };
    let heldout = gap
        .residuals(Set::Heldout, &terms, &parameters)
        .map_or(f64::INFINITY, |residuals| sum_of_squares(&residuals));
    Some(Hypothesis { terms, parameters, covariance, train, heldout, surcharges, count })
}
