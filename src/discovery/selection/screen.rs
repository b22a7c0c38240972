//! What a linear fit would leave when a candidate joins: cheap enough for hundreds of them.

use nalgebra::{DMatrix, DVector};

use super::refit::{all_specs, columns, movable, near_parameters};
use super::{Hypothesis, ParameterSpec, Residuals, Set};

/// The model linearised about a hypothesis.
pub(super) struct Local {
    pub(super) residuals: Vec<f64>,
    /// One for each parameter there is already that was asked for.
    columns: Vec<(usize, Vec<f64>)>,
    specs: Vec<ParameterSpec>,
}

/// What is added to the diagonal of scaled normal equations: far below what the data determine.
const RIDGE: f64 = 1e-9;

impl Local {
    /// Linearises; of the effects there are, only those related to `near`, if that is given.
    pub(super) fn at<G: Residuals>(
        gap: &G,
        best: &Hypothesis<G::Term>,
        near: Option<&G::Term>,
    ) -> Option<Self> {
        let residuals = gap.residuals(Set::Train, &best.terms, &best.parameters)?;
        let specs = all_specs(gap, &best.terms);
        let moves = near.map_or_else(
            || movable(gap, &specs),
            |near| near_parameters(gap, &best.terms, std::slice::from_ref(near)),
        );
        let columns = columns(gap, &best.terms, &best.parameters, &specs, &moves, &residuals)?;
        let moving = (0..specs.len()).filter(|i| moves[*i]);
        let columns = moving.zip(columns).collect();
        Some(Self { residuals, columns, specs })
    }

    /// Returns the sum of squares that a linear fit leaves when `joining` join, and where that fit
    /// ends; `specs` and `start` are of all that join, and shape parameters stay as they start.
    pub(super) fn screen<G: Residuals>(
        &self,
        gap: &G,
        best: &Hypothesis<G::Term>,
        joining: &[G::Term],
        specs: &[ParameterSpec],
        start: &[f64],
    ) -> Option<(f64, Vec<f64>)> {
        let mut terms = best.terms.clone();
        terms.extend_from_slice(joining);
        let mut parameters = best.parameters.clone();
        let from = parameters.len();
        parameters.extend_from_slice(start);
        let absent = specs.iter().zip(start).any(|(spec, value)| {
            spec.neutral.is_some_and(|neutral| (neutral - value).abs() < 1e-15)
        }) && specs.iter().zip(start).all(|(spec, value)| {
            spec.neutral.is_none_or(|neutral| (neutral - value).abs() < 1e-15)
        });
        let here;
        let residuals = if absent {
            &self.residuals
        } else {
            here = gap.residuals(Set::Train, &terms, &parameters)?;
            &here
        };
        let mut solved: Vec<(usize, Vec<f64>)> = Vec::new();
        for (i, spec) in specs.iter().enumerate() {
            if spec.neutral.is_none() {
                continue;
            }
            let mut moved = parameters.clone();
            moved[from + i] += spec.scale;
            let at = gap.residuals(Set::Train, &terms, &moved)?;
            let column = at.iter().zip(residuals).map(|(a, r)| (a - r) / spec.scale).collect();
            solved.push((i, column));
        }
        let near = near_parameters(gap, &best.terms, joining);
        let old: Vec<&(usize, Vec<f64>)> = self.columns.iter().filter(|(i, _)| near[*i]).collect();
        let all: Vec<&[f64]> =
            old.iter().copied().chain(&solved).map(|(_, column)| column.as_slice()).collect();
        let (step, left) = least_squares(&all, residuals)?;
        for ((i, _), change) in old.iter().zip(&step) {
            let spec = &self.specs[*i];
            parameters[*i] = (parameters[*i] + change).clamp(spec.range.0, spec.range.1);
        }
        let mut outside = false;
        for ((i, _), change) in solved.iter().zip(step.iter().skip(old.len())) {
            let spec = &specs[*i];
            let value = parameters[from + i] + change;
            outside |= value < spec.range.0 || value > spec.range.1;
            parameters[from + i] = value.clamp(spec.range.0, spec.range.1);
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
    // A column of zeros is a parameter that the data do not show; it stays where it is.
    let norm = |column: &&[f64]| sum_of_squares(column).sqrt();
    let scale: Vec<f64> =
        columns.iter().map(norm).map(|norm| if norm > 1e-150 { norm } else { 1.0 }).collect();
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
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    for k in 0..n / 4 {
        for i in 0..4 {
            sums[i] += a[4 * k + i] * b[4 * k + i];
        }
    }
    let mut rest = 0.0;
    for k in n / 4 * 4..n {
        rest += a[k] * b[k];
    }
    sums[0] + sums[1] + sums[2] + sums[3] + rest
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
