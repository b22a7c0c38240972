//! A model's text and recordings → what is missing.

use std::collections::BTreeMap;

use crate::language::{Diagnostic, parse};
use crate::units::{Dimension, significant};

use super::super::Trace;
use super::super::finding::{
    Alternative, Channel, Effect, Evidence, Finding, Gap, ModelChange, NextExperiment, Parameter,
    Split, Value, Verdict,
};
use super::super::recording::{self, Recording};
use super::compile::{Compiled, compile};
use super::data::{Data, noise_of, std};
use super::edit::{apply, diff, model_in};
use super::fitting::{Bench, Fitted, NoFit, baseline};
use super::hypothesis::{Chosen, Gain, Hypothesis, Question, with_values};
use super::place::concentrated;
use super::search::Search;
use super::simulate::{Hold, Scheme};

/// How to investigate.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The part of a single recording that is held out.
    pub holdout: f64,
    /// Seed of random starts.
    pub seed: u64,
    /// Most rows that are fitted; longer recordings are thinned where nothing is lost, else shortened.
    pub most_rows: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { holdout: 0.3, seed: 1, most_rows: 2500 }
    }
}

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The model's text has mistakes.
    #[error("the model has mistakes")]
    Model {
        /// All of them.
        diagnostics: Vec<Diagnostic>,
    },
    /// There is no such model in the text.
    #[error("there is no `model` block{}", if .name.is_empty() { String::new() } else { format!(" `{}`", .name) })]
    NoModel {
        /// The one asked for; empty for any.
        name: String,
    },
    /// A recording does not fit the model.
    #[error(transparent)]
    Recording(#[from] recording::Error),
    /// The model's states grow without bound, or are not numbers.
    #[error("the model blows up: `{what}` is no longer a finite number at t = {t} s")]
    BlowUp {
        /// Which state or output.
        what: String,
        /// When, s.
        t: f64,
    },
    /// Too few rows.
    #[error("{rows} rows are too few to fit a model and to judge it")]
    TooShort {
        /// How many there are.
        rows: usize,
    },
}

/// A finding with the text that follows from it.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// What was found.
    pub finding: Finding,
    /// The text of the file with the effects written in; as it was when nothing is missing.
    pub text: String,
    /// Measured minus model on the data held out, before and after, one per output.
    pub traces: Vec<Trace>,
}

/// Finds what a model leaves out.
///
/// `text` is a whole `.task` file; `name` chooses one of its models, empty for the first. Several
/// recordings: the last is held out; one: its last part is. `progress` is told what is being done and which
/// part is done.
///
/// # Errors
///
/// [`Error`] when the model or a recording cannot be used, with what is wrong.
pub fn investigate(
    path: &str,
    text: &str,
    name: &str,
    recordings: &[Recording],
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Outcome, Error> {
    let (_, diagnostics) = parse(text);
    let Some(model) = model_in(text, name) else {
        if diagnostics.iter().any(Diagnostic::is_error) {
            return Err(Error::Model { diagnostics });
        }
        return Err(Error::NoModel { name: name.into() });
    };
    let inside: Vec<Diagnostic> = diagnostics
        .into_iter()
        .filter(|d| d.is_error() && model.span.from <= d.span.from && d.span.to <= model.span.to)
        .collect();
    if !inside.is_empty() {
        return Err(Error::Model { diagnostics: inside });
    }
    let compiled = compile(&model).map_err(|diagnostics| Error::Model { diagnostics })?;
    let name = compiled.name.clone();
    let mut notes: Vec<String> = recordings.iter().flat_map(|r| r.notes.clone()).collect();
    let mut bench = prepare(&compiled, recordings, options, &mut notes)?;
    let blow = |NoFit { blow_up }: NoFit| match blow_up {
        Some(b) => Error::BlowUp { what: b.what, t: b.t },
        None => Error::TooShort { rows: recordings.iter().map(Recording::n_rows).sum() },
    };
    let mut nominal = baseline(&mut bench, text, &name, options.seed).map_err(blow)?;
    free_starts(&mut bench, &mut nominal, &name, options.seed, &mut notes);
    if let Some(rows) = bench.rows {
        let step = bench.train[0].step();
        notes.push(format!(
            "the model's memory does not fade, so it is run in stretches of {} s, each from first values that fit it",
            significant(rows as f64 * step, 3)
        ));
    }
    for names in &nominal.train.undetermined {
        notes.push(format!(
            "the data do not determine {names}: they trade against each other, or against the first values"
        ));
    }
    let floors = bench.train[0].noise.iter().map(|n| 0.01 * n * n + 1e-24).collect();
    let mut question = Question { bench, name: &name, floors, whole: [0.0; 2] };
    let search = question
        .search(nominal, progress)
        .ok_or_else(|| Error::TooShort { rows: recordings.iter().map(Recording::n_rows).sum() })?;
    notes.extend(about_inputs(&question.bench, &compiled));
    Ok(Report { path, text, question: &question, search: &search, notes }.outcome())
}

/// What was assumed of the inputs, in words.
fn about_inputs(bench: &Bench, model: &Compiled) -> Option<String> {
    if model.inputs.is_empty() || model.states.is_empty() {
        return None;
    }
    let Scheme { hold, shift, .. } = bench.scheme;
    let joined = match hold {
        Hold::Zero => return None,
        Hold::Line => "inputs follow straight lines between rows, which fits best",
        Hold::Curve => "inputs follow smooth curves between rows, which fits best",
    };
    if shift.abs() < 0.02 * bench.row {
        return Some(joined.into());
    }
    let way = if shift > 0.0 { "later" } else { "earlier" };
    Some(format!(
        "{joined}, and act {} s {way} than written; less than a row is a matter of how the recording was taken, and no effect",
        significant(shift.abs(), 2)
    ))
}

/// The noise that a sidecar gives for a column such as `q_2` or `tcp_x`.
fn told_noise(recording: &Recording, name: &str) -> Option<f64> {
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
fn prepare(
    model: &Compiled,
    recordings: &[Recording],
    options: &Options,
    notes: &mut Vec<String>,
) -> Result<Bench, Error> {
    let mut all = Vec::new();
    for recording in recordings {
        let (mut data, said) = Data::from_recording(recording, model)?;
        for (noise, output) in data.noise.iter_mut().zip(&model.outputs) {
            if let Some(told) = told_noise(recording, &output.name) {
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
    let row = train[0].step();
    let rows: usize = train.iter().map(Data::n_rows).sum();
    let wanted = rows.div_ceil(options.most_rows);
    let by = train.iter().chain(&held).map(|d| d.thinning(wanted)).min().unwrap_or(1);
    let thin = |data: Vec<Data>| -> Vec<Data> { data.iter().map(|d| d.thinned(by)).collect() };
    let (train, held) = (thin(train), thin(held));
    if by > 1 {
        notes.push(format!("rows are averaged by {by}: nothing faster is in these recordings"));
    }
    let shorten = |data: Vec<Data>| -> Vec<Data> {
        let rows: usize = data.iter().map(Data::n_rows).sum();
        let part = (2.0 * options.most_rows as f64 / rows as f64).min(1.0);
        data.iter().map(|d| d.slice(0..((d.n_rows() as f64 * part) as usize).max(3))).collect()
    };
    let before: usize = train.iter().map(Data::n_rows).sum();
    let (train, held) = (shorten(train), shorten(held));
    if train.iter().map(Data::n_rows).sum::<usize>() < before {
        notes.push(
            "only the first part of each recording is used; all of it would take long".into(),
        );
    }
    let n_out = model.outputs.len();
    let scales = (0..n_out)
        .map(|o| {
            let all: Vec<f64> = train.iter().flat_map(|d| d.outputs[o].iter().copied()).collect();
            std(&all).max(noise_of(&all)).max(1e-12)
        })
        .collect();
    let hold = if by > 1 { Hold::Line } else { Hold::Zero };
    Ok(Bench {
        train,
        held,
        rows: None,
        scheme: Scheme { hold, substeps: 1, shift: 0.0 },
        all_starts_free: false,
        scales,
        row,
    })
}

/// Estimates first values that the model gives when the data speak strongly against them.
fn free_starts(
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
        notes.push(
            "the recordings do not begin at the first values that the model gives; they are estimated".into(),
        );
        *bench = free;
        *nominal = other;
    }
}

/// Everything the answer is made from.
struct Report<'a> {
    path: &'a str,
    text: &'a str,
    question: &'a Question<'a>,
    search: &'a Search,
    notes: Vec<String>,
}

impl Report<'_> {
    fn outcome(mut self) -> Outcome {
        let search = self.search;
        let tied: Vec<usize> = (0..search.best.effects.len())
            .filter(|&i| {
                search.judged[i].1.iter().any(|r| r.ties(&search.best.effects[i].candidate))
            })
            .collect();
        let n = search.best.effects.len();
        let (noise_floor, before, after) = self.numbers();
        let gap = Gap::of(before, after, noise_floor);
        let verdict = match n {
            0 if self.is_noise() => Verdict::NothingMissing,
            0 => Verdict::Unknown,
            1 if tied.len() == 1 => Verdict::Ambiguous,
            1 => Verdict::Named,
            _ => Verdict::Several,
        };
        let mut effects = Vec::new();
        for (i, chosen) in search.best.effects.iter().enumerate() {
            let (gain, rivals) = &search.judged[i];
            let mut effect = Self::effect(&search.best, chosen, *gain);
            for rival in rivals.iter().take(6) {
                let ties = rival.ties(&chosen.candidate);
                effect.alternatives.push(Alternative {
                    name: rival.candidate.kind.into(),
                    at: rival.candidate.at.clone(),
                    delta_bic: rival.delta_bic,
                    why_not: if ties {
                        "the data cannot tell it from this one".into()
                    } else if rival.delta_bic >= 6.0 {
                        format!(
                            "fits worse: its criterion is {} higher",
                            significant(rival.delta_bic, 3)
                        )
                    } else if rival.held_worse >= 0.03 {
                        format!(
                            "predicts the held-out data worse by {} %",
                            significant(100.0 * rival.held_worse, 2)
                        )
                    } else {
                        "says the same with more parameters".into()
                    },
                });
            }
            effect.indistinguishable = verdict == Verdict::Ambiguous;
            effects.push(effect);
        }
        if verdict == Verdict::Ambiguous {
            let (gain, rivals) = &search.judged[0];
            for rival in rivals.iter().filter(|r| r.ties(&search.best.effects[0].candidate)).take(4)
            {
                if let Some(last) = rival.hypothesis.effects.last() {
                    let gain = Gain { bic: gain.bic - rival.delta_bic, ..*gain };
                    let mut effect = Self::effect(&rival.hypothesis, last, gain);
                    effect.indistinguishable = true;
                    effects.push(effect);
                }
            }
        }
        let mut text = self.text.to_string();
        let mut added = Vec::new();
        for chosen in &search.best.effects {
            let patch = with_values(&chosen.patch, &search.best.fitted, true);
            if let Some(next) = apply(&text, self.question.name, &patch) {
                text = next;
            }
        }
        let change = diff(self.path, self.text, &text);
        for line in change.lines().skip(2).filter(|l| l.starts_with('+')) {
            added.push(line[1..].trim().to_string());
        }
        let next_experiment = (verdict == Verdict::Ambiguous).then(|| self.next(&effects));
        let reason = Self::reason(verdict, &gap, &effects);
        let finding = Finding {
            verdict,
            places: self.places(),
            effects,
            gap,
            model: ModelChange {
                path: Some(self.path.into()),
                added,
                diff: change,
                applied: false,
            },
            next_experiment,
            reason,
            smallest_visible: Vec::new(),
            notes: std::mem::take(&mut self.notes),
        };
        Outcome { finding, text, traces: self.traces() }
    }

    /// Noise floor, before and after, as parts of each output's spread.
    fn numbers(&self) -> (f64, Split, Split) {
        let question = self.question;
        let part = |h: &Hypothesis| Split {
            train: question.size(&h.fitted.train),
            heldout: question.size(&h.held),
        };
        let held = &question.bench.held[0];
        let floor: f64 =
            held.noise.iter().zip(&question.bench.scales).map(|(n, s)| (n / s).powi(2)).sum();
        let n_out = question.bench.scales.len().max(1) as f64;
        let (before, after) = (part(&self.search.nominal), part(&self.search.best));
        // Noise cannot be larger than what is left when everything is explained.
        let floor = (floor / n_out).sqrt().min(after.heldout);
        (floor, before, after)
    }

    /// Whether what is left looks like noise: white, or as small as the noise is known to be.
    fn is_noise(&self) -> bool {
        let best = &self.search.best;
        let noise = &self.question.bench.train[0].noise;
        let rms = best.fitted.train.rms();
        (0..rms.len()).all(|o| {
            let white = best.whites[0][o];
            let held = best.whites[1][o];
            let small = rms[o] <= 1.2 * noise[o];
            // What is mostly noise may still follow itself a little.
            small
                || (white > 0.3 && held > 0.3 && rms[o] <= 3.0 * noise[o])
                || (white > 0.6 && held > 0.6)
        })
    }

    fn places(&self) -> Vec<Channel> {
        let question = self.question;
        let nominal = &self.search.nominal;
        let rms = nominal.held.rms();
        let outputs = &nominal.fitted.compiled.outputs;
        let noise = &question.bench.train[0].noise;
        let beyond: Vec<f64> = (0..outputs.len())
            .map(|o| {
                ((rms[o].powi(2) - noise[o].powi(2)).max(0.0)) / question.bench.scales[o].powi(2)
            })
            .collect();
        let total: f64 = beyond.iter().sum();
        let mut places: Vec<Channel> = outputs
            .iter()
            .enumerate()
            .map(|(o, output)| Channel {
                channel: output.name.clone(),
                rms: rms[o],
                noise: noise[o],
                unit: output.dimension.map(Dimension::si).unwrap_or_default(),
                share: if total > 0.0 { beyond[o] / total } else { 0.0 },
                concentrated_in: concentrated(question, nominal, o),
            })
            .collect();
        places.sort_by(|a, b| b.share.total_cmp(&a.share));
        places
    }

    fn effect(at: &Hypothesis, chosen: &Chosen, gain: Gain) -> Effect {
        let patch = with_values(&chosen.patch, &at.fitted, true);
        let mut parameters = BTreeMap::new();
        let mut equation = chosen.candidate.equation.clone();
        for param in &patch.params {
            let unit = param.dimension.map(Dimension::si).unwrap_or_default();
            let number = significant(param.value, 4);
            let text = if unit.is_empty() { number } else { format!("{number} {unit}") };
            equation = replace_word(&equation, &param.name, &text);
            parameters.insert(
                param.role.to_string(),
                Parameter {
                    value: Value::Number(param.value),
                    std: Value::Number(param.std.unwrap_or(0.0)),
                    unit,
                },
            );
        }
        let heldout_gain = gain.held_rms.clamp(0.0, 1.0);
        Effect {
            name: chosen.candidate.kind.into(),
            at: chosen.candidate.at.clone(),
            parameters,
            evidence: Evidence { delta_bic: gain.bic, heldout_gain },
            equation,
            alternatives: Vec::new(),
            indistinguishable: false,
        }
    }

    fn next(&self, effects: &[Effect]) -> NextExperiment {
        let has = |name: &str| effects.iter().any(|e| e.name == name);
        let inputs: Vec<&str> =
            self.search.best.fitted.compiled.inputs.iter().map(|(n, _)| n.as_str()).collect();
        let input = inputs.first().copied().unwrap_or("the input");
        let why = if has("input_gain") && has("output_gain") {
            "a gain before or after a linear model is the same; measure the input at the machine, or the output with a second sensor".to_string()
        } else if has("input_offset") || has("output_offset") {
            format!(
                "a constant at the input and one at the output look alike near one working point; record with {input} at several levels, standstill included"
            )
        } else if has("input_delay") || has("lag") || has("sensor_delay") {
            format!(
                "a delay and a lag differ only in fast motion; record steps of {input} and sample faster"
            )
        } else {
            format!(
                "record with {input} over its whole range, slow and fast, with reversals; the rivals differ where the present recordings do not go"
            )
        };
        NextExperiment { why, commands: None }
    }

    fn reason(verdict: Verdict, gap: &Gap, effects: &[Effect]) -> String {
        let percent = |v: f64| format!("{} %", significant(100.0 * v, 3));
        let from_to = format!(
            "the gap on held-out data falls from {} to {} of the signal",
            percent(gap.before.heldout),
            percent(gap.after.heldout)
        );
        match verdict {
            Verdict::NothingMissing => format!(
                "what is left on held-out data, {} of the signal, is noise, and no effect pays for itself",
                percent(gap.before.heldout)
            ),
            Verdict::Unknown => format!(
                "the model misses {} of the signal on held-out data, and nothing that has a name explains it",
                percent(gap.before.heldout)
            ),
            Verdict::Named => {
                format!("with {} of {} {from_to}", effects[0].name, effects[0].at)
            }
            Verdict::Several => {
                let names: Vec<String> =
                    effects.iter().map(|e| format!("{}({})", e.name, e.at)).collect();
                format!("with {} {from_to}", names.join(" and "))
            }
            Verdict::Ambiguous => {
                let names: Vec<String> =
                    effects.iter().map(|e| format!("{}({})", e.name, e.at)).collect();
                format!("{} explain the data equally well; {from_to}", names.join(", "))
            }
        }
    }

    fn traces(&self) -> Vec<Trace> {
        let search = self.search;
        let bench = &self.question.bench;
        let task = bench.task_on(&search.best.fitted.compiled, &bench.held);
        let time: Vec<f64> = task
            .windows
            .iter()
            .flat_map(|w| w.rows.clone().map(|row| bench.held[w.data].time[row]))
            .collect();
        let outputs = &search.nominal.fitted.compiled.outputs;
        outputs
            .iter()
            .enumerate()
            .map(|(o, output)| Trace {
                recording: bench.held[0].name.clone(),
                channel: output.name.clone(),
                unit: output.dimension.map(Dimension::si).unwrap_or_default(),
                noise: bench.held[0].noise[o],
                held_out: true,
                time: time.clone(),
                before: search.nominal.held.residuals[o].clone(),
                after: search.best.held.residuals[o].clone(),
            })
            .collect()
    }
}

/// Replaces a whole word.
fn replace_word(text: &str, word: &str, with: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    while let Some(at) = rest.find(word) {
        let (before, after) = rest.split_at(at);
        let after = &after[word.len()..];
        let whole = !before.ends_with(is_word) && !after.starts_with(is_word);
        out.push_str(before);
        out.push_str(if whole { with } else { word });
        rest = after;
    }
    out.push_str(rest);
    out
}
