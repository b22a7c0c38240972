//! A model's text and recordings → what is missing: the order of things.

use crate::language::{Diagnostic, parse};

use super::super::finding::Finding;
use super::super::recording::Recording;
use super::super::{Trace, Why};
use super::anchor::run_off;
use super::baseline::{NoFit, baseline};
use super::compile::compile;
use super::edit::model_in;
use super::error::Error;
use super::hypothesis::Question;
use super::model_finding::Report;
use super::prepare::{
    about_inputs, about_stretches, about_trade, about_work, free_starts, prepare,
};
use super::wording;

/// How to investigate.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The part of a single recording that is held out.
    pub holdout: f64,
    /// Seed of random starts.
    pub seed: u64,
    /// Most rows that are fitted; longer recordings are thinned where nothing is lost; of what is longer all
    /// the same, parts that lie evenly over it are run.
    pub most_rows: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { holdout: 0.3, seed: 1, most_rows: 2500 }
    }
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
    /// Why each effect is named.
    pub whys: Vec<Why>,
    /// The inputs that would settle a doubt, as the text of a recording.
    pub experiment: Option<String>,
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
    // What no sensor shows lets any model run away.
    let no_reading = || {
        let inputs = || compiled.inputs.iter().map(|(name, _)| name);
        let outputs = || compiled.outputs.iter().map(|output| &output.name);
        recordings.iter().find_map(|recording| recording.no_reading(inputs().chain(outputs())))
    };
    let blow = |NoFit { blow_up }: NoFit| match (no_reading(), blow_up) {
        (Some(flaw), _) => Error::Recording(flaw),
        (None, Some(b)) => Error::BlowUp { what: b.what, t: b.t },
        (None, None) => Error::TooShort { rows: recordings.iter().map(Recording::n_rows).sum() },
    };
    let mut nominal = baseline(&mut bench, text, &name, options.seed).map_err(blow)?;
    free_starts(&mut bench, &mut nominal, &name, options.seed, &mut notes);
    let floors = bench.train[0].noise.iter().map(|n| 0.01 * n * n + 1e-24).collect();
    let mut question =
        Question { bench, name: &name, given: model, floors, refused: Vec::new(), whole: [0.0; 2] };
    let off = run_off(&nominal);
    let anchored = if off.is_empty() {
        None
    } else {
        question.anchored(&nominal, &off, options.seed, progress)
    };
    let mut search = match anchored {
        Some((search, note)) => {
            notes.push(note);
            search
        }
        None => question.search(nominal, progress).ok_or_else(|| Error::TooShort {
            rows: recordings.iter().map(Recording::n_rows).sum(),
        })?,
    };
    notes.extend(about_work(&question.bench));
    notes.extend(about_stretches(&question.bench));
    notes.extend(about_trade(&search.nominal.fitted));
    let of_inputs = notes.len();
    progress(wording::LOOKING, 0.95);
    notes.extend(question.take_back(&mut search));
    search.best = question.determined(search.best.clone(), &mut notes);
    let is_noise = question.is_noise(&search.best);
    let formula = if is_noise { None } else { question.unnamed(&mut search) };
    // Where more than noise is left, what a number is worth is another matter.
    let undetermined = if is_noise {
        question.undetermined(&search.nominal.fitted.compiled, &search.best)
    } else {
        Vec::new()
    };
    let is_told = is_noise || !search.best.effects.is_empty();
    let is_open = is_told && question.doubt_between(&mut search.best);
    let about = about_inputs(&question.bench, &search.best.fitted.compiled, is_open);
    if let Some(note) = about {
        notes.insert(of_inputs, note);
    }
    let report = Report {
        path,
        text,
        question: &question,
        search: &search,
        is_noise,
        formula,
        undetermined,
        clock: None,
        notes,
    };
    Ok(report.outcome())
}
