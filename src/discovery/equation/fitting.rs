//! Fits of whole model texts: how recordings are cut and run, and how well it went.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::columns::{Data, rms, std};
use super::compile::{Compiled, compile};
use super::edit::model_in;
use super::estimate::{Estimate, Point, Task};
use super::score::whiteness;
use super::simulate::{Hold, Scheme, site_sizes};
use super::windows::{Window, windows};
use crate::discovery::finding::TIE;

/// Recordings and how models are run on them.
#[derive(Debug, Clone)]
pub struct Bench {
    /// The data fitted.
    pub train: Vec<Data>,
    /// The data held out.
    pub held: Vec<Data>,
    /// Rows of a window, `None` to run through.
    pub rows: Option<usize>,
    /// Most rows that are run, of the data fitted and of those held out.
    pub most_rows: usize,
    /// Hold and steps.
    pub scheme: Scheme,
    /// Whether given first values are estimated all the same.
    pub all_starts_free: bool,
    /// Scale of each output's residual in a fit.
    pub scales: Vec<f64>,
    /// Usual step of the recordings as they were taken, s.
    pub row: f64,
    /// Free parameters that stay where the model's text has them.
    pub anchored: Vec<String>,
    /// Counts the steps that are run, of all that was cloned from this.
    pub work: Arc<AtomicU64>,
}

/// A model text fitted to the recordings.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// The text.
    pub text: String,
    /// The model.
    pub compiled: Compiled,
    /// The fit.
    pub train: Estimate,
}

/// `sign` is a ramp of this part of its argument's usual size: narrow enough that what creeps within it at
/// standstill is not seen.
const RAMP: f64 = 0.003;
/// The same before any size is known.
const ROUGH_RAMP: f64 = 1e-3;
/// Windows, evenly over all of them, from which usual sizes are taken.
const SIZED: usize = 16;
/// Most steps of all fits together, each counted as often as it has derivatives: a few minutes on two cores.
const MOST_WORK: u64 = 600_000_000;

impl Bench {
    /// The task of fitting a model to the training data.
    pub fn task<'a>(&'a self, model: &'a Compiled) -> Task<'a> {
        self.task_on(model, &self.train)
    }

    /// As [`Self::task`], on other data.
    pub fn task_on<'a>(&'a self, model: &'a Compiled, data: &'a [Data]) -> Task<'a> {
        Task {
            model,
            data,
            windows: windows(data, self.rows, self.most_rows),
            scheme: self.scheme,
            scales: self.scales.clone(),
            all_starts_free: self.all_starts_free,
            params_fixed: false,
            held: places(model, &self.anchored),
            work: &self.work,
        }
    }

    /// Whether so much has been run that nothing more is searched for.
    pub fn is_spent(&self) -> bool {
        self.work.load(Ordering::Relaxed) > MOST_WORK
    }

    /// Reads a text's model and sets its ramps by what stands in them at `point`.
    pub fn prepare(&self, text: &str, name: &str) -> Option<Compiled> {
        compile(&model_in(text, name)?).ok()
    }

    /// The point of a child model that is nearest to its parent's: shared names keep their values.
    pub fn inherit(&self, child: &Compiled, parent: &Compiled, at: &Point, task: &Task) -> Point {
        let params = child
            .params
            .iter()
            .map(|p| {
                let old = parent.params.iter().position(|q| q.name == p.name);
                old.map_or_else(|| p.guess.unwrap_or(1.0), |i| at.params[i])
            })
            .collect();
        let mut starts = task.starts(&[]);
        for (window, old) in starts.iter_mut().zip(&at.starts) {
            for (s, state) in child.states.iter().enumerate() {
                let was = parent.states.iter().position(|q| q.name == state.name);
                if let (Some(value), Some(old)) = (&mut window[s], was.and_then(|i| old[i])) {
                    *value = old;
                }
            }
        }
        Point { params, starts }
    }

    /// Sets the ramps of `sign` and `step` by the size of what stands in them.
    pub fn set_ramps(&self, model: &mut Compiled, point: &Point) {
        if model.sites.is_empty() {
            return;
        }
        // A first pass with coarse ramps: exact ones would shake a coarse integration.
        let rough = model.sites.len();
        model.widths = vec![ROUGH_RAMP; rough];
        let task = self.task(model);
        let mut sizes = vec![0.0; rough];
        let mut n = 0.0;
        // A slow run and a fast one have a say.
        let each = task.windows.len().div_ceil(SIZED).max(1);
        for (w, start) in task.windows.iter().zip(&point.starts).step_by(each) {
            let found = site_sizes(
                model,
                &self.train[w.data],
                w.rows.clone(),
                self.scheme,
                &point.params,
                start,
            );
            if let Some(found) = found {
                for (to, v) in sizes.iter_mut().zip(&found) {
                    *to += v * v;
                }
                n += 1.0;
            }
        }
        model.widths = sizes
            .iter()
            .map(|s| {
                let size = f64::sqrt(s / f64::max(n, 1.0));
                if size > 0.0 && size.is_finite() { RAMP * size } else { ROUGH_RAMP }
            })
            .collect();
    }

    /// Fits a text from a parent's point; `None` when it does not compile or blows up.
    pub fn fit(
        &self,
        text: &str,
        name: &str,
        parent: &Fitted,
        iterations: usize,
    ) -> Option<Fitted> {
        self.fit_beside(text, name, parent, iterations, &[])
    }

    /// As [`Self::fit`], with some parameters held where they begin.
    pub fn fit_beside(
        &self,
        text: &str,
        name: &str,
        parent: &Fitted,
        iterations: usize,
        held: &[String],
    ) -> Option<Fitted> {
        let mut compiled = self.prepare(text, name)?;
        let point = {
            let task = self.task(&compiled);
            self.inherit(&compiled, &parent.compiled, &parent.train.point, &task)
        };
        self.set_ramps(&mut compiled, &point);
        let mut task = self.task(&compiled);
        task.held.extend(places(&compiled, held));
        let train = task.fit(&point, iterations).ok()?;
        if train.residuals.iter().any(Vec::is_empty) {
            return None;
        }
        Some(Fitted { text: text.into(), compiled, train })
    }

    /// Judges a fitted model on the held-out data: only first values are estimated there. `near` is another
    /// model with its first values there, to begin from.
    pub fn held_out(
        &self,
        fitted: &Fitted,
        near: Option<(&Compiled, &Estimate)>,
    ) -> Option<Estimate> {
        let model = &fitted.compiled;
        let task = Task { params_fixed: true, held: Vec::new(), ..self.task_on(model, &self.held) };
        let params = fitted.train.point.params.clone();
        let judge = |point: &Point| {
            let free = point.starts.iter().flatten().flatten().count();
            let found = if free == 0 { task.judge(point).ok() } else { task.fit(point, 25).ok() };
            found.filter(|e| e.residuals.iter().all(|r| !r.is_empty()))
        };
        let at = |starts| Point { params: params.clone(), starts };
        if let Some((parent, held)) = near
            && held.point.starts.len() == task.windows.len()
        {
            let inherited = self.inherit(model, parent, &held.point, &task);
            if let Some(found) = judge(&at(inherited.starts)) {
                return Some(found);
            }
        }
        // Unmeasured states start where they stood in the training data, on average or at first.
        let n = model.states.len();
        let trained = &fitted.train.point.starts;
        let average: Vec<f64> = (0..n)
            .map(|s| super::columns::mean(&trained.iter().filter_map(|w| w[s]).collect::<Vec<_>>()))
            .collect();
        let first: Vec<f64> =
            (0..n).map(|s| trained.first().and_then(|w| w[s]).unwrap_or(0.0)).collect();
        let found = [average, first, vec![0.0; n]];
        let found = found.iter().filter_map(|other| judge(&at(task.starts(other))));
        let size = |e: &Estimate| -> f64 {
            e.rms().iter().zip(&self.scales).map(|(r, s)| (r / s).powi(2)).sum()
        };
        found.min_by(|a, b| size(a).total_cmp(&size(b)))
    }

    /// Chooses what inputs do between rows, when in a row they act, and how long steps are, by what fits.
    pub fn settle(&mut self, fitted: &mut Fitted) {
        self.settle_inputs(fitted);
        settle_steps(self, fitted);
    }

    /// Doubles the windows if the model follows the recordings closely over them: the longer it runs, the
    /// smaller an effect it shows; a model that lacks much would lose its way. Returns whether it did.
    pub fn lengthen(&mut self, fitted: &mut Fitted) -> bool {
        let Some(rows) = self.rows else { return false };
        let longest = self.train.iter().map(Data::n_rows).max().unwrap_or(0);
        // Where not all is run, fewer windows would see less of what the recordings show.
        let all: usize = self.train.iter().map(Data::n_rows).sum();
        if all > self.most_rows && 2 * rows * FEWEST * self.train.len() > self.most_rows {
            return false;
        }
        let rows = if 2 * rows < longest { Some(2 * rows) } else { None };
        let longer = Self { rows, ..self.clone() };
        let point = longer.rewindowed(&fitted.compiled, &fitted.train.point, self);
        let found = longer.task(&fitted.compiled).fit(&point, 20).ok();
        let Some(found) = found.filter(|e| e.residuals.iter().all(|r| !r.is_empty())) else {
            return false;
        };
        if found.rms().iter().zip(self.followed()).any(|(rms, limit)| *rms > limit) {
            return false;
        }
        self.rows = rows;
        fitted.train = found;
        true
    }

    /// How near, in each output's unit, a model must follow for its stretches to grow: by a part of the signal's spread, or where
    /// noise is larger than that, not clearly above the noise, which no model follows. With nothing from outside all that it carries
    /// on is its own, and what it lacks is seen the better the longer it runs: it must only not lose its way.
    pub fn followed(&self) -> Vec<f64> {
        let is_free = self.train.iter().all(|d| d.inputs.is_empty());
        let limit = |(o, scale): (usize, &f64)| {
            let noise = self.train.iter().map(|d| d.noise[o]).fold(0.0, f64::max);
            let close = CLOSE * scale;
            let most = ASTRAY * scale;
            if is_free { most } else { close.max(CLEARLY * noise - close).min(most) }
        };
        self.scales.iter().enumerate().map(limit).collect()
    }

    /// A point for these windows from one for the windows of `before`: each begins where the nearest began.
    pub fn rewindowed(&self, model: &Compiled, point: &Point, before: &Self) -> Point {
        let old = before.task(model).windows;
        let nearest = |w: &Window| {
            (0..old.len())
                .min_by_key(|i| (old[*i].data != w.data, old[*i].rows.start.abs_diff(w.rows.start)))
        };
        let windows = self.task(model).windows;
        let starts = windows.iter().filter_map(nearest).map(|i| point.starts[i].clone()).collect();
        Point { params: point.params.clone(), starts }
    }

    /// Whether several rows of the recordings as they were taken are one.
    pub(super) fn is_averaged(&self) -> bool {
        self.train.first().is_some_and(|d| d.step > 1.5 * self.row)
    }

    /// What inputs do between rows, and by which part of a row they are late: how the recording was taken is
    /// no property of the machine, so it is settled before anything is named.
    fn settle_inputs(&mut self, fitted: &mut Fitted) {
        if fitted.compiled.inputs.is_empty() || fitted.compiled.states.is_empty() {
            return;
        }
        let (compiled, point) = (fitted.compiled.clone(), fitted.train.point.clone());
        let attempt = |scheme: Scheme| -> Option<(f64, Scheme, Estimate)> {
            let task = Task { scheme, ..self.task(&compiled) };
            let found =
                task.fit(&point, 6).ok().filter(|e| e.residuals.iter().all(|r| !r.is_empty()))?;
            let cost = found.rms().iter().zip(&self.scales).map(|(r, s)| (r / s).powi(2)).sum();
            Some((cost, scheme, found))
        };
        // Rows that are averages have no steps left to hold.
        let averaged = self.is_averaged();
        let kinds = [Hold::Zero, Hold::Line, Hold::Curve];
        let held = kinds.into_iter().filter(|hold| !averaged || *hold != Hold::Zero);
        let effective = |e: &Estimate| -> f64 {
            e.residuals.iter().map(|r| whiteness(r) * r.len() as f64).sum()
        };
        let row = self.row;
        let kinds = held.filter_map(|hold| {
            let at = |part: f64| attempt(Scheme { hold, shift: part * row, ..self.scheme });
            let plain = at(0.0)?;
            let (Some(early), Some(late)) = (at(-0.5), at(0.5)) else { return Some(plain) };
            // The bottom of the parabola through the three.
            let bend = early.0 - 2.0 * plain.0 + late.0;
            let bottom = if bend > 0.0 { 0.25 * (early.0 - late.0) / bend } else { 0.0 };
            let shifted = at(bottom.clamp(-0.5, 0.5))?;
            let evidence = effective(&shifted.2) * (plain.0 / shifted.0.max(1e-300)).ln();
            Some(if evidence > SHIFT_EVIDENCE { shifted } else { plain })
        });
        // In the order of how common they are: another must fit visibly better.
        let visibly = |a: (f64, Scheme, Estimate), b: (f64, Scheme, Estimate)| {
            let rows = b.2.sums.iter().map(|(_, n)| *n as f64).sum();
            if is_visible((a.0, a.1), (b.0, b.1), rows) { b } else { a }
        };
        let Some(best) = kinds.reduce(visibly) else { return };
        self.scheme = best.1;
        fitted.train = best.2;
    }
}

/// Where the parameters of these names are.
fn places(model: &Compiled, names: &[String]) -> Vec<usize> {
    let is_named = |i: &usize| names.contains(&model.params[*i].name);
    (0..model.params.len()).filter(is_named).collect()
}

/// Fewest windows of each recording where not all of it is run.
pub(super) const FEWEST: usize = 5;

/// A model that misses less than this part of the signal's spread follows it closely.
pub const CLOSE: f64 = 0.01;
/// Where noise is larger than what counts as close, a model that misses twice the noise, less what is close, misses clearly more
/// than noise; where the two are equal this is what is close. Chosen.
const CLEARLY: f64 = 2.0;
/// One that misses more than this part has lost its way: in a swing it is a quarter of a turn off.
const ASTRAY: f64 = 0.5;

/// Another way from row to row leaves less by this part of its squares, at least, and by more than a tie.
const VISIBLY: f64 = 2e-3;
/// Least evidence for a shift of the inputs within a row.
const SHIFT_EVIDENCE: f64 = 12.0;

/// Whether inputs that go from row to row as `there` says leave visibly less, in squares over so many rows, than as `here` says: by
/// more than chance may make of them, the evidence that a shift asks for counted with it.
fn is_visible(here: (f64, Scheme), there: (f64, Scheme), rows: f64) -> bool {
    let price = |scheme: Scheme| if scheme.shift.abs() > 0.0 { SHIFT_EVIDENCE } else { 0.0 };
    let evidence = rows * (here.0 / there.0.max(1e-300)).ln() + price(here.1) - price(there.1);
    evidence > TIE.max(VISIBLY * rows)
}

/// Halves the step until it no longer matters.
pub fn settle_steps(bench: &mut Bench, fitted: &mut Fitted) {
    if fitted.compiled.states.is_empty() {
        return;
    }
    // Steps are short already where a sign turns over.
    let doublings = if fitted.compiled.sites.is_empty() { 4 } else { 2 };
    for _ in 0..doublings {
        let coarse = bench.task(&fitted.compiled).run(&fitted.train.point);
        let finer = Bench {
            scheme: Scheme { substeps: bench.scheme.substeps * 2, ..bench.scheme },
            ..bench.clone()
        };
        let fine = finer.task(&fitted.compiled).run(&fitted.train.point);
        let (Ok(coarse), Ok(fine)) = (coarse, fine) else { return };
        let n_out = bench.scales.len();
        let matters = (0..n_out).any(|o| {
            let difference: Vec<f64> =
                coarse.iter().zip(&fine).skip(o).step_by(n_out).map(|(a, b)| a - b).collect();
            let floor = 0.03 * fitted.train.rms()[o];
            let size: Vec<f64> = fine.iter().skip(o).step_by(n_out).copied().collect();
            rms(&difference) > floor.max(1e-7 * std(&size))
        });
        if !matters {
            return;
        }
        bench.scheme.substeps *= 2;
        if let Ok(train) = bench.task(&fitted.compiled).fit(&fitted.train.point, 20) {
            fitted.train = train;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of inputs that were held "straight lines, which fits best" was said where both left as much.
    #[test]
    fn lines_between_rows_must_fit_better_than_chance_may() {
        let held = Scheme { hold: Hold::Zero, substeps: 1, shift: 0.0 };
        let lines = Scheme { hold: Hold::Line, ..held };
        assert!(!is_visible((766.0, held), (763.0, lines), 800.0));
        assert!(is_visible((888.0, held), (860.0, lines), 800.0));
        // Held ones that act half a row early are as good as lines, and less usual.
        let early = Scheme { shift: -0.05, ..held };
        assert!(is_visible((763.0, early), (763.0, lines), 800.0));
        assert!(!is_visible((1e-3, held), (0.9985e-3, lines), 1e6));
    }
}
