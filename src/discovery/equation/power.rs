//! The power of the test: the smallest effect of each kind that would have been seen.

use rayon::prelude::*;

use super::super::finding::Visible;
use super::candidates::{Candidate, candidates};
use super::edit::{apply, model_in};
use super::estimate::{Point, Task};
use super::hypothesis::{Hypothesis, LEAST_EVIDENCE, Question};
use super::linear::{Regression, dot};
use super::simulate::{Hold, Scheme};
use super::wording;
use crate::units::Dimension;

/// By which part of a row inputs are tried later.
const LATER: f64 = 0.1;

impl Question<'_> {
    /// For every effect that grows from nothing with one number: the least of it that would have been
    /// named, and a sentence on those of which no amount would have.
    ///
    /// An effect of `a` raises the likelihood by `(a/σ)²`, σ its standard deviation beside everything else
    /// that is free; to be named that must exceed the least evidence and the price of a parameter and
    /// of the choice among many.
    pub(super) fn smallest_visible(
        &self,
        at: &Hypothesis,
        n_tried: usize,
    ) -> (Vec<Visible>, Option<String>) {
        let Some(model) = model_in(&at.fitted.text, self.name) else {
            return (Vec::new(), None);
        };
        let grows = |c: &Candidate| {
            c.patches.first().is_some_and(|p| p.params.len() == 1 && p.params[0].neutral.is_some())
        };
        let all: Vec<Candidate> =
            candidates(&self.ground(&at.fitted, &model)).into_iter().filter(grows).collect();
        let n: f64 = at.fitted.train.sums.iter().map(|(_, n)| *n as f64).sum();
        let needed = LEAST_EVIDENCE + n.ln() + 2.0 * (n_tried.max(1) as f64).ln();
        let sizes: Vec<Option<f64>> =
            all.par_iter().map(|candidate| self.deviation(at, candidate)).collect();
        let (mut visible, mut blind) = (Vec::new(), Vec::new());
        for (candidate, size) in all.iter().zip(sizes) {
            let Some(param) = candidate.patches.first().and_then(|p| p.params.first()) else {
                continue;
            };
            let Some(size) = size else {
                blind.push(format!("{}({})", candidate.kind, candidate.at));
                continue;
            };
            visible.push(Visible {
                name: candidate.kind.into(),
                at: candidate.at.clone(),
                parameter: param.role.into(),
                least: size * needed.sqrt(),
                unit: param.dimension.map(Dimension::si).unwrap_or_default(),
            });
        }
        let note = (!blind.is_empty()).then(|| wording::blind(&blind));
        (visible, note)
    }

    /// What would change in the outputs, in units of their scales, if inputs acted later or went otherwise from row to row.
    fn taken_otherwise(&self, task: &Task, point: &Point) -> Option<Vec<Vec<f64>>> {
        if task.model.inputs.is_empty() {
            return Some(Vec::new());
        }
        let run = |scheme| Task { scheme, ..task.clone() }.run(point).ok();
        let here = run(task.scheme)?;
        let later = Scheme { shift: task.scheme.shift + LATER * self.bench.row, ..task.scheme };
        let holds = [Hold::Zero, Hold::Line, Hold::Curve].into_iter();
        let holds = holds.filter(|hold| *hold != task.scheme.hold);
        let schemes = holds.map(|hold| Scheme { hold, ..task.scheme }).chain([later]);
        let scales = &self.bench.scales;
        let column = |scheme| {
            let there = run(scheme)?;
            let change = there.iter().zip(&here).enumerate();
            Some(change.map(|(i, (a, b))| (a - b) / scales[i % scales.len()]).collect())
        };
        schemes.map(column).collect()
    }

    /// Standard deviation of an effect's one number about none, everything free beside it; `None` when
    /// the rest can make up for it.
    fn deviation(&self, at: &Hypothesis, candidate: &Candidate) -> Option<f64> {
        let patch = candidate.patches.first()?;
        let name = &patch.params.first()?.name;
        let text = apply(&at.fitted.text, self.name, patch)?;
        let mut compiled = self.bench.prepare(&text, self.name)?;
        let task = self.bench.task(&compiled);
        let parent = &at.fitted;
        let point = self.bench.inherit(&compiled, &parent.compiled, &parent.train.point, &task);
        self.bench.set_ramps(&mut compiled, &point);
        let task = self.bench.task(&compiled);
        let (_, mut columns) = task.linearised(&point)?;
        // How the recording was taken is chosen as well.
        columns.extend(self.taken_otherwise(&task, &point)?);
        let own = compiled.params.iter().position(|p| p.name == *name)?;
        // From units of the outputs' scales to units of what is left, its colour included.
        let n_out = self.bench.scales.len();
        let weight: Vec<f64> = (0..n_out)
            .map(|o| {
                let rms = at.fitted.train.rms()[o].max(self.bench.train[0].noise[o]).max(1e-300);
                self.bench.scales[o] / rms * at.whites[0][o].sqrt()
            })
            .collect();
        for column in &mut columns {
            for (i, value) in column.iter_mut().enumerate() {
                *value *= weight[i % n_out];
            }
        }
        let column = columns.remove(own);
        let known: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let beyond = Regression::new(&known, &column)?.beyond(&column);
        let (left, whole) = (dot(&beyond, &beyond), dot(&column, &column));
        // A thousandth of the column is what rounding and the steps leave of one that is made up.
        (left > 1e-6 * whole && whole > 0.0).then(|| 1.0 / left.sqrt())
    }
}
