//! A gap written out once, for gaps whose residuals are linear in everything but the shapes of the laws: each effect
//! in each shape that is tried is a few columns, and the columns of one sensor are pressed by `QR` into as many rows as there
//! are columns. Sums of squares stay what they were, and a fit costs microseconds however long the recording is.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::idle::holds_still;
use super::screen::sum_of_squares;
use super::{Block, Candidate, Hypothesis, ParameterSpec, Residuals, Set};

/// A gap pressed into few rows, linear about a hypothesis.
pub(super) struct Linear<'a, G: Residuals> {
    gap: &'a G,
    entries: Vec<Entry<G::Term>>,
    /// Which entries an effect has: one for each shape.
    shapes: Vec<(G::Term, Vec<usize>)>,
    list: Vec<Candidate<G::Term>>,
    train: Pressed,
    heldout: Pressed,
    /// How much more than its noise the richest explanation leaves of each sensor.
    pub(super) floors: Vec<f64>,
}

/// An effect in one shape.
struct Entry<T> {
    term: T,
    specs: Vec<ParameterSpec>,
    /// Where it is linear about; its shape.
    at: Vec<f64>,
}

/// The residuals of one set, pressed.
struct Pressed {
    /// Residuals without any effect.
    nothing: Vec<f64>,
    /// For each entry what it leaves where its parameters are neutral, then one column per parameter; a column of a
    /// parameter of its shape is empty. Each is a list of stretches: where it begins, and its values.
    columns: Vec<Vec<Sparse>>,
}

/// The stretches in which a column is not zero.
type Sparse = Vec<(usize, Vec<f64>)>;

/// Residuals of two rows that are related less than this are independent.
const WHITE: f64 = 0.1;

/// Residuals are taken to be related over at most this many rows.
const LONGEST: usize = 100;

/// What is added to the diagonal of scaled normal equations: columns may say the same.
const RIDGE: f64 = 1e-8;

impl<'a, G: Residuals> Linear<'a, G> {
    /// Writes the gap out about a hypothesis, with effects that are `wanted`; `None` if the model runs away there.
    pub(super) fn about(
        gap: &'a G,
        best: &Hypothesis<G::Term>,
        wanted: &dyn Fn(&G::Term) -> bool,
    ) -> Option<Self> {
        let residuals = gap.residuals(Set::Train, &best.terms, &best.parameters)?;
        let mut list = gap.candidates(&[], &residuals, None);
        list.retain(|candidate| candidate.joining().all(wanted));
        let mut entries: Vec<Entry<G::Term>> = Vec::new();
        let mut at = 0;
        for (term, surcharge) in best.terms.iter().zip(&best.surcharges) {
            let specs = gap.specs(term);
            let own = best.parameters[at..at + specs.len()].to_vec();
            at += specs.len();
            let start = specs.iter().zip(&own).map(|(spec, own)| spec.neutral.unwrap_or(*own));
            let alone = |c: &&mut Candidate<G::Term>| c.term == *term && c.with.is_empty();
            match list.iter_mut().find(alone) {
                Some(known) => known.starts.insert(0, start.collect()),
                None => list.push(Candidate {
                    term: term.clone(),
                    with: Vec::new(),
                    starts: vec![start.collect()],
                    surcharge: *surcharge,
                }),
            }
            entries.push(Entry { term: term.clone(), specs, at: own });
        }
        let own = entries.len();
        for candidate in &list {
            for start in &candidate.starts {
                let known = |e: &Entry<G::Term>| e.is(&candidate.term, start);
                if !entries.iter().any(known) {
                    let specs = gap.specs(&candidate.term);
                    entries.push(Entry { term: candidate.term.clone(), specs, at: start.clone() });
                }
            }
        }
        let mut shapes: Vec<(G::Term, Vec<usize>)> = Vec::new();
        for (i, entry) in entries.iter().enumerate() {
            match shapes.iter_mut().find(|(term, _)| *term == entry.term) {
                Some((_, all)) => all.push(i),
                None => shapes.push((entry.term.clone(), vec![i])),
            }
        }
        let mut floors = Vec::new();
        let [train, heldout] = [Set::Train, Set::Heldout]
            .map(|set| Pressed::of(gap, best, &entries, own, set, &mut floors));
        Some(Self { gap, entries, shapes, list, train: train?, heldout: heldout?, floors })
    }

    /// Returns the parameters from which an effect is tried.
    pub(super) fn starts(&self, term: &G::Term) -> &[Vec<f64>] {
        let found = self.list.iter().find(|c| c.term == *term && c.with.is_empty());
        found.map_or(&[], |candidate| &candidate.starts)
    }

    fn entry(&self, term: &G::Term, parameters: &[f64]) -> Option<usize> {
        let (_, all) = self.shapes.iter().find(|(known, _)| known == term)?;
        all.iter().copied().find(|i| self.entries[*i].has(parameters))
    }
}

impl<T: PartialEq> Entry<T> {
    /// Returns whether this is the effect in the shape that the parameters have.
    fn is(&self, term: &T, parameters: &[f64]) -> bool {
        self.term == *term && self.has(parameters)
    }

    /// Returns whether its shape is the one that the parameters have.
    fn has(&self, parameters: &[f64]) -> bool {
        let same = |((spec, a), b): ((&ParameterSpec, &f64), &f64)| {
            spec.neutral.is_some() || a.to_bits() == b.to_bits()
        };
        self.specs.iter().zip(&self.at).zip(parameters).all(same)
    }
}

/// Returns how much more than `base` effects leave.
fn changed<G: Residuals>(
    gap: &G,
    set: Set,
    terms: &[G::Term],
    parameters: &[f64],
    base: &[f64],
) -> Option<Vec<f64>> {
    let there = gap.residuals(set, terms, parameters)?;
    Some(there.iter().zip(base).map(|(a, b)| a - b).collect())
}

/// Columns with zeros taken out: block by block.
type Blocked = Vec<(usize, Vec<f64>)>;

impl Pressed {
    /// `own` entries are of the hypothesis.
    fn of<G: Residuals>(
        gap: &G,
        best: &Hypothesis<G::Term>,
        entries: &[Entry<G::Term>],
        own: usize,
        set: Set,
        floors: &mut Vec<f64>,
    ) -> Option<Self> {
        let here = gap.residuals(set, &best.terms, &best.parameters)?;
        let blocks = gap.blocks(set);
        let blocked = |values: &[f64]| -> Blocked {
            let parts = blocks.iter().map(|block| values[block.rows.clone()].to_vec()).enumerate();
            parts.filter(|(_, part)| part.iter().any(|value| value.abs() > 1e-12)).collect()
        };
        let mut from = vec![0; own];
        for i in 1..own {
            from[i] = from[i - 1] + entries[i - 1].specs.len();
        }
        // One list per entry: what it does by itself, then one column per parameter.
        let columns: Vec<Vec<Blocked>> = entries
            .par_iter()
            .enumerate()
            .map(|(i, entry)| {
                let mut terms = best.terms.clone();
                let mut parameters = best.parameters.clone();
                let at = if i < own {
                    from[i]
                } else {
                    terms.push(entry.term.clone());
                    parameters.extend_from_slice(&entry.at);
                    parameters.len() - entry.at.len()
                };
                let start;
                let is_new = i >= own && entry.specs.iter().all(|spec| spec.neutral.is_none());
                let base = if is_new {
                    start = gap.residuals(set, &terms, &parameters)?;
                    &start
                } else {
                    &here
                };
                let itself: Vec<f64> = base.iter().zip(&here).map(|(a, b)| a - b).collect();
                let mut found = vec![blocked(&itself)];
                for (k, spec) in entry.specs.iter().enumerate() {
                    if spec.neutral.is_none() {
                        found.push(Vec::new());
                        continue;
                    }
                    let mut moved = parameters.clone();
                    let up = moved[at + k] + spec.scale <= spec.range.1;
                    let step = if up { spec.scale } else { -spec.scale };
                    moved[at + k] += step;
                    let change = changed(gap, set, &terms, &moved, base)?;
                    moved[at + k] -= 2.0 * step;
                    let is_back = moved[at + k] >= spec.range.0 && moved[at + k] <= spec.range.1;
                    let back =
                        || if is_back { changed(gap, set, &terms, &moved, base) } else { None };
                    // A fit would take it as far as its range goes.
                    let still = holds_still(&change, back);
                    let column = change.iter().map(|by| if still { 0.0 } else { by / step });
                    found.push(blocked(&column.collect::<Vec<f64>>()));
                }
                Some(found)
            })
            .collect::<Option<_>>()?;
        // Back to where nothing acts.
        let mut nothing = here;
        for (entry, columns) in entries.iter().zip(&columns).take(own) {
            for ((spec, at), column) in entry.specs.iter().zip(&entry.at).zip(&columns[1..]) {
                let back = spec.neutral.map_or(0.0, |neutral| neutral - at);
                for (block, values) in column {
                    let rows = &mut nothing[blocks[*block].rows.clone()];
                    rows.iter_mut().zip(values).for_each(|(to, value)| *to += back * value);
                }
            }
        }
        let pressed: Vec<PressedBlock> = blocks
            .par_iter()
            .enumerate()
            .map(|(b, block)| press(&nothing[block.rows.clone()], b, &columns))
            .collect();
        if set == Set::Train {
            let most = blocks.iter().map(|block| block.sensor + 1).max().unwrap_or(0);
            *floors = vec![1.0; most];
            for (block, pressed) in blocks.iter().zip(&pressed) {
                floors[block.sensor] = floors[block.sensor].max(pressed.floor);
            }
        }
        let mut found = Self { nothing: Vec::new(), columns: Vec::new() };
        found.columns = columns.iter().map(|entry| vec![Vec::new(); entry.len()]).collect();
        for block in pressed {
            let from = found.nothing.len();
            found.nothing.extend(block.nothing);
            for ((entry, k), values) in block.places.into_iter().zip(block.columns) {
                found.columns[entry][k].push((from, values));
            }
        }
        Some(found)
    }

    fn residuals<G: Residuals>(
        &self,
        linear: &Linear<'_, G>,
        terms: &[G::Term],
        parameters: &[f64],
    ) -> Option<Vec<f64>> {
        let mut all = self.nothing.clone();
        let mut add = |column: &Sparse, by: f64| {
            for (from, values) in column {
                let to = &mut all[*from..*from + values.len()];
                to.iter_mut().zip(values).for_each(|(to, value)| *to += by * value);
            }
        };
        let mut at = 0;
        for term in terms {
            let entry = linear.entry(term, &parameters[at..])?;
            let (columns, specs) = (&self.columns[entry], &linear.entries[entry].specs);
            add(&columns[0], 1.0);
            for (k, spec) in specs.iter().enumerate() {
                let by = spec.neutral.map_or(0.0, |neutral| parameters[at + k] - neutral);
                if by.abs() > 0.0 {
                    add(&columns[k + 1], by);
                }
            }
            at += specs.len();
        }
        Some(all)
    }
}

/// What one sensor read, pressed.
struct PressedBlock {
    nothing: Vec<f64>,
    columns: Vec<Vec<f64>>,
    /// Of which entry each column is, and which of its columns.
    places: Vec<(usize, usize)>,
    /// How much more than noise all columns together leave.
    floor: f64,
}

/// Presses one block into as many rows as there are columns and one.
fn press(nothing: &[f64], block: usize, columns: &[Vec<Blocked>]) -> PressedBlock {
    let mut places = Vec::new();
    let mut found: Vec<&[f64]> = Vec::new();
    for (i, entry) in columns.iter().enumerate() {
        for (k, column) in entry.iter().enumerate() {
            if let Some((_, values)) = column.iter().find(|(at, _)| *at == block) {
                places.push((i, k));
                found.push(values);
            }
        }
    }
    let p = found.len();
    // Rows that are not judged are zero everywhere.
    let judged: Vec<usize> = (0..nothing.len())
        .filter(|row| nothing[*row].abs() > 0.0 || found.iter().any(|c| c[*row].abs() > 0.0))
        .collect();
    let matrix = faer::Mat::from_fn(judged.len(), p + 1, |row, k| {
        if k < p { found[k][judged[row]] } else { nothing[judged[row]] }
    });
    let qr = matrix.qr();
    let r = qr.thin_R();
    let rows = r.nrows();
    let column = |k: usize| -> Vec<f64> {
        (0..rows).map(|i| if i <= k { r[(i, k)] } else { 0.0 }).collect()
    };
    let columns: Vec<Vec<f64>> = (0..p).map(|k| column(k)[..rows.min(k + 1)].to_vec()).collect();
    let pressed = column(p);
    let floor = floor(&columns, &pressed, &found, nothing, &judged);
    PressedBlock { nothing: pressed, columns, places, floor }
}

/// Returns how many times its noise a sensor leaves with everything that could act at once, counted in rows that are
/// independent: what no law here says is no evidence for any.
fn floor(
    pressed: &[Vec<f64>],
    nothing: &[f64],
    columns: &[&[f64]],
    residuals: &[f64],
    judged: &[usize],
) -> f64 {
    let p = pressed.len();
    if judged.len() < 4 * (p + 1) {
        return 1.0;
    }
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let scale: Vec<f64> = pressed.iter().map(|c| sum_of_squares(c).sqrt().max(1e-150)).collect();
    let a = DMatrix::from_fn(p, p, |i, j| {
        let same = if i == j { RIDGE } else { 0.0 };
        dot(&pressed[i], &pressed[j]) / (scale[i] * scale[j]) + same
    });
    let g = DVector::from_fn(p, |i, _| -dot(&pressed[i], nothing) / scale[i]);
    let Some(steps) = a.cholesky().map(|a| a.solve(&g)) else { return 1.0 };
    let mut left: Vec<f64> = judged.iter().map(|row| residuals[*row]).collect();
    for ((column, step), scale) in columns.iter().zip(steps.iter()).zip(&scale) {
        let step = step / scale;
        left.iter_mut().zip(judged).for_each(|(left, row)| *left += step * column[*row]);
    }
    let level = sum_of_squares(&left) / (judged.len() - p) as f64;
    (level * related(&left)).sqrt().max(1.0)
}

/// Returns how many rows say as much as one that is independent of all others, by how long what is left of them lasts.
pub fn related(left: &[f64]) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let square = sum_of_squares(left).max(1e-300);
    let mut related = 1.0;
    for lag in 1..LONGEST.min(left.len() / 4) {
        let with_later = dot(&left[lag..], &left[..left.len() - lag]) / square;
        if with_later < WHITE {
            break;
        }
        related += 2.0 * with_later;
    }
    related
}

impl<G: Residuals> Residuals for Linear<'_, G> {
    type Term = G::Term;

    fn specs(&self, term: &G::Term) -> Vec<ParameterSpec> {
        // The slots of a gap may ask its recordings; here they are asked once.
        let known = self.entries.iter().find(|entry| entry.term == *term);
        known.map_or_else(|| self.gap.specs(term), |entry| entry.specs.clone())
    }

    fn residuals(&self, set: Set, terms: &[G::Term], parameters: &[f64]) -> Option<Vec<f64>> {
        match set {
            Set::Train => self.train.residuals(self, terms, parameters),
            Set::Heldout => self.heldout.residuals(self, terms, parameters),
            // Nothing is told of what is written out.
            Set::Unseen => None,
        }
    }

    fn count(&self, set: Set) -> usize {
        self.gap.count(set)
    }

    fn candidates(
        &self,
        terms: &[G::Term],
        _left: &[f64],
        instead_of: Option<&G::Term>,
    ) -> Vec<Candidate<G::Term>> {
        let wanted = |c: &&Candidate<G::Term>| {
            !terms.contains(&c.term)
                && instead_of.is_none_or(|out| *out == c.term || self.gap.related(out, &c.term))
        };
        self.list.iter().filter(wanted).cloned().collect()
    }

    fn compatible(&self, a: &G::Term, b: &G::Term) -> bool {
        self.gap.compatible(a, b)
    }

    fn names_first(&self) -> bool {
        self.gap.names_first()
    }

    fn related(&self, a: &G::Term, b: &G::Term) -> bool {
        self.gap.related(a, b)
    }

    fn is_broad(&self, term: &G::Term) -> bool {
        self.gap.is_broad(term)
    }

    fn common(&self) -> Vec<G::Term> {
        self.gap.common()
    }

    fn is_exact(&self, term: &G::Term) -> bool {
        self.gap.is_exact(term)
    }

    fn is_common(&self, term: &G::Term) -> bool {
        self.gap.is_common(term)
    }

    fn unexplained(&self, set: Set, term: &G::Term) -> f64 {
        self.gap.unexplained(set, term)
    }

    fn is_sensible(&self, term: &G::Term, parameters: &[f64]) -> bool {
        self.gap.is_sensible(term, parameters)
    }

    fn is_likelier(&self, other: &G::Term, chosen: &G::Term) -> bool {
        self.gap.is_likelier(other, chosen)
    }

    fn contains(&self, general: &G::Term, special: &G::Term) -> bool {
        self.gap.contains(general, special)
    }

    fn shapes_stay(&self) -> bool {
        true
    }

    fn blocks(&self, set: Set) -> Vec<Block> {
        self.gap.blocks(set)
    }
}
