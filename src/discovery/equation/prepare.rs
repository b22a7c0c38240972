//! Recordings → what is fitted and what is held out, thinned and scaled.

use std::sync::Arc;

use super::super::recording::Recording;
use super::baseline::baseline;
use super::columns::{Data, std};
use super::compile::Compiled;
use super::error::Error;
use super::fitting::{Bench, Fitted};
use super::investigate::Options;
use super::simulate::{Hold, Scheme};
use super::wording;

/// What was assumed of the inputs, in words: what is usual is told where an input acts late beside it, or where `is_open` says that
/// held inputs and straight lines between rows fit as well.
pub(super) fn about_inputs(bench: &Bench, model: &Compiled, is_open: bool) -> Option<String> {
    if model.inputs.is_empty() || model.states.is_empty() {
        return None;
    }
    let Scheme { hold, shift, .. } = bench.scheme;
    let later = (shift.abs() >= 0.02 * bench.row).then_some(shift);
    let is_told = hold != Hold::Zero || later.is_some() || is_open || !model.delays.is_empty();
    is_told.then(|| wording::inputs_between(hold, later, is_open.then_some(0.5 * bench.row)))
}

/// That the search was ended before it was over, in words.
pub(super) fn about_work(bench: &Bench) -> Option<String> {
    bench.is_spent().then(wording::stopped)
}

/// How long the stretches are in which a model is run, in words.
pub(super) fn about_stretches(bench: &Bench) -> Option<String> {
    let long = bench.rows? as f64 * bench.train.first()?.step;
    Some(wording::in_segments(long))
}

/// Which parameters the recordings do not tell, in words.
pub(super) fn about_trade(fitted: &Fitted) -> impl Iterator<Item = String> {
    fitted.train.undetermined.iter().map(|names| wording::undetermined(names))
}

/// The noise that a sidecar gives for a column such as `q_2` or `tcp_x`.
fn known_noise(recording: &Recording, name: &str) -> Option<f64> {
    let levels = &recording.sidecar.noise;
    let (stem, number) = name.rsplit_once('_').unwrap_or((name, "1"));
    let of = match stem {
        "q" => &levels.q_rad,
        "dq" => &levels.dq_rad_s,
        "tau" => &levels.tau_nm,
        "tcp" => &levels.tcp_m,
        _ => return None,
    };
    of.as_ref()?.of(number.parse::<usize>().ok().and_then(|n| n.checked_sub(1)).unwrap_or(0))
}

/// Splits, thins and scales the recordings.
pub(super) fn prepare(
    model: &Compiled,
    recordings: &[Recording],
    options: &Options,
    notes: &mut Vec<String>,
) -> Result<Bench, Error> {
    let mut all = Vec::new();
    for recording in recordings {
        let (mut data, said) = Data::from_recording(recording, model)?;
        for (noise, output) in data.noise.iter_mut().zip(&model.outputs) {
            if let Some(told) = known_noise(recording, &output.name) {
                *noise = told;
            }
        }
        notes.extend(said);
        all.push(data);
    }
    let total: usize = all.iter().map(Data::n_rows).sum();
    if total < 20 || all.is_empty() {
        return Err(Error::TooShort { rows: total });
    }
    let (train, held) = if all.len() > 1 {
        let held = all.pop().into_iter().collect();
        (all, held)
    } else {
        let n = all[0].n_rows();
        let cut = ((n as f64) * (1.0 - options.holdout.clamp(0.05, 0.9))).round() as usize;
        (vec![all[0].slice(0..cut)], vec![all[0].slice(cut..n)])
    };
    let row = train[0].step;
    let rows: usize = train.iter().map(Data::n_rows).sum();
    let wanted = rows.div_ceil(options.most_rows);
    let by = train.iter().chain(&held).map(|d| d.thinning(wanted)).min().unwrap_or(1);
    let thin = |data: Vec<Data>| -> Vec<Data> { data.iter().map(|d| d.thinned(by)).collect() };
    let (train, held) = (thin(train), thin(held));
    if by > 1 {
        notes.push(wording::averaged(by));
    }
    let most_rows = 2 * options.most_rows;
    let rows: usize = train.iter().map(Data::n_rows).sum();
    if rows > most_rows {
        notes.push(wording::not_all_rows(most_rows, rows));
    }
    let n_out = model.outputs.len();
    let scales = (0..n_out)
        .map(|o| {
            let all: Vec<f64> = train.iter().flat_map(|d| d.outputs[o].iter().copied()).collect();
            std(&all).max(1e-12)
        })
        .collect();
    let hold = if by > 1 { Hold::Line } else { Hold::Zero };
    Ok(Bench {
        train,
        held,
        rows: None,
        most_rows,
        scheme: Scheme { hold, substeps: 1, shift: 0.0 },
        all_starts_free: false,
        scales,
        row,
        anchored: Vec::new(),
        work: Arc::default(),
    })
}

/// Estimates first values that the model gives when the data speak strongly against them.
pub(super) fn free_starts(
    bench: &mut Bench,
    nominal: &mut Fitted,
    name: &str,
    seed: u64,
    notes: &mut Vec<String>,
) {
    if nominal.compiled.states.iter().all(|s| s.fixed.is_none()) {
        return;
    }
    let mut free = Bench { all_starts_free: true, ..bench.clone() };
    let text = nominal.text.clone();
    let Ok(other) = baseline(&mut free, &text, name, seed) else { return };
    let size = |f: &Fitted| -> f64 {
        f.train.rms().iter().zip(&bench.scales).map(|(r, s)| (r / s).powi(2)).sum::<f64>().sqrt()
    };
    if size(&other) < 0.85 * size(nominal) {
        notes.push(wording::first_values_estimated());
        *bench = free;
        *nominal = other;
    }
}
