//! A search → the finding: verdict, effects, the change of the text, what to do next.

use std::collections::BTreeMap;

use crate::language::ast::ModelUnit;
use crate::units::{Dimension, significant};

use super::super::finding::{
    Alternative, Channel, Effect, Evidence, Finding, Gap, ModelChange, NextExperiment, Parameter,
    Split, Value, Verdict,
};
use super::super::resample::is_unseen;
use super::super::{Trace, Why, by_channel};
use super::clock::Clock;
use super::edit::{apply, diff};
use super::hypothesis::{Chosen, Gain, Hypothesis, Question, with_values};
use super::investigate::Outcome;
use super::place::concentrated;
use super::rivals::{Judged, Rival};
use super::search::Search;
use super::unknown::{Formula, LEAST_PREDICTED, UNKNOWN};
use super::wording::{self, FittedParam, Seen, WhyNot};

/// Most rivals of an effect that are listed as no worse.
const MOST_TIES: usize = 4;

/// Everything the answer is made from.
pub(super) struct Report<'a> {
    pub(super) path: &'a str,
    pub(super) text: &'a str,
    pub(super) question: &'a Question<'a>,
    pub(super) search: &'a Search,
    /// Whether what the best hypothesis leaves is noise.
    pub(super) is_noise: bool,
    /// What explains the gap without a name, or fails to.
    pub(super) formula: Option<Formula>,
    /// Parameters of the model as given that fit as well far from where they ended.
    pub(super) undetermined: Vec<String>,
    /// Another clock that says as much as what was found; asked for while the answer is put together.
    pub(super) clock: Option<Clock>,
    pub(super) notes: Vec<String>,
}

impl Report<'_> {
    pub(super) fn outcome(mut self) -> Outcome {
        let formula = self.formula.take();
        let shown = match &formula {
            Some(Formula::Predicts(hypothesis)) => hypothesis,
            _ => &self.search.best,
        };
        let (noise_floor, before, after) = self.numbers(shown);
        let gap = Gap::of(before, after, noise_floor);
        self.clock = self.question.clock(&self.search.nominal, shown);
        let verdict = self.verdict(shown);
        let effects = match verdict {
            Verdict::Unknown => self.unnamed(shown),
            _ => self.named(),
        };
        let (text, model) = self.change(verdict, shown);
        let (next_experiment, experiment) = self.next(verdict, &effects);
        let reason = self.reason(verdict, &gap, &effects, formula.as_ref());
        if verdict == Verdict::Unknown && !effects.is_empty() {
            self.notes.push(wording::validity(&seen(self.question, shown)));
        }
        if let Some(Clock { factor, predicts }) = self.clock {
            self.notes.push(wording::another_clock(factor, predicts));
        }
        let (open, fitted): (Vec<FittedParam>, Vec<FittedParam>) = self
            .fitted(shown)
            .into_iter()
            .partition(|param| self.undetermined.iter().any(|name| name == param.name));
        if !open.is_empty() {
            self.notes.push(wording::unexercised(&open, verdict == Verdict::NothingMissing));
        }
        if !fitted.is_empty() {
            self.notes.push(wording::fitted(&fitted));
        }
        if verdict == Verdict::Ambiguous {
            self.notes.push(wording::unwritten(&effects));
        }
        let smallest_visible = if verdict == Verdict::NothingMissing {
            let (visible, blind) = self.question.smallest_visible(shown, self.search.n_tried);
            self.notes.extend(blind);
            visible
        } else {
            Vec::new()
        };
        let mut finding = Finding {
            identified: Vec::new(),
            verdict,
            places: self.places(),
            effects,
            gap,
            path: if verdict == Verdict::Unknown {
                Vec::new()
            } else {
                self.question.gap_after_each(self.search)
            },
            model,
            next_experiment,
            reason,
            smallest_visible,
            notes: std::mem::take(&mut self.notes),
        };
        let traces = self.traces(shown);
        by_channel(&mut finding, &traces);
        let whys = self.whys(verdict, shown);
        Outcome { finding, text, traces, whys, experiment }
    }

    /// Why each effect is named, those included that the data cannot tell from another.
    fn whys(&self, verdict: Verdict, shown: &Hypothesis) -> Vec<Why> {
        let (question, nominal) = (self.question, &self.search.nominal);
        let all = 0..shown.effects.len();
        if verdict == Verdict::Unknown {
            // The words of a formula are one effect.
            return question.why(nominal, shown, all).into_iter().collect();
        }
        let mut found = Vec::new();
        for i in all {
            found.extend(question.why(nominal, shown, i..i + 1));
            for rival in self.ties(i) {
                let last = rival.hypothesis.effects.len();
                found.extend(question.why(
                    nominal,
                    &rival.hypothesis,
                    last.saturating_sub(1)..last,
                ));
            }
        }
        found
    }

    /// The verdict's reason, with what a formula would have explained.
    fn reason(
        &self,
        verdict: Verdict,
        gap: &Gap,
        effects: &[Effect],
        formula: Option<&Formula>,
    ) -> String {
        let nominal = &self.search.nominal;
        if verdict == Verdict::Unknown && effects.is_empty() && self.question.is_unshown(nominal) {
            return wording::not_shown(gap);
        }
        let mut reason = wording::reason(verdict, gap, effects, self.clock_in_doubt());
        if let Some(Formula::Refused { train, heldout }) = formula {
            reason.push_str(&wording::refused(*train, *heldout, LEAST_PREDICTED));
        }
        reason
    }

    fn verdict(&self, shown: &Hypothesis) -> Verdict {
        if shown.effects.iter().any(|e| e.candidate.kind == UNKNOWN) {
            return Verdict::Unknown;
        }
        match shown.effects.len() {
            0 if self.is_noise => Verdict::NothingMissing,
            0 => Verdict::Unknown,
            _ if !self.doubtful().is_empty() => Verdict::Ambiguous,
            1 => Verdict::Named,
            _ => Verdict::Several,
        }
    }

    /// Which effects of the best hypothesis the data cannot tell from others, or from another clock.
    fn doubtful(&self) -> Vec<usize> {
        let is_clocks = self.clock_in_doubt().is_some();
        let all = 0..self.search.best.effects.len();
        all.filter(|i| is_clocks || !self.ties(*i).is_empty()).collect()
    }

    /// How many times as long as written times would be, if such a clock says all that the effect found does.
    fn clock_in_doubt(&self) -> Option<f64> {
        self.clock.filter(|clock| clock.predicts).map(|clock| clock.factor)
    }

    /// Rivals that the data cannot tell from an effect of the best hypothesis.
    fn ties(&self, i: usize) -> Vec<&Rival> {
        let chosen = &self.search.best.effects[i].candidate;
        let ties = self.search.judged[i].rivals.iter().filter(|rival| rival.ties(chosen));
        ties.take(MOST_TIES).collect()
    }

    /// The effects with their rivals; those that the data cannot tell apart follow each other.
    fn named(&self) -> Vec<Effect> {
        let search = self.search;
        let mut effects = Vec::new();
        for (i, chosen) in search.best.effects.iter().enumerate() {
            let Judged { gain, rivals, stability } = &search.judged[i];
            let ties = self.ties(i);
            let mut own = effect(&search.best, chosen, *gain, *stability);
            own.alternatives = rivals.iter().map(|rival| alternative(rival, chosen)).collect();
            own.indistinguishable = self.clock_in_doubt().is_some() || !ties.is_empty();
            effects.push(own);
            for rival in ties {
                let Some(last) = rival.hypothesis.effects.last() else { continue };
                let gain = Gain { bic: gain.bic - rival.delta_bic, ..*gain };
                let mut other = effect(&rival.hypothesis, last, gain, rival.stability);
                other.indistinguishable = true;
                effects.push(other);
            }
        }
        effects
    }

    /// The words of a formula as one effect.
    fn unnamed(&self, shown: &Hypothesis) -> Vec<Effect> {
        let Some(first) = shown.effects.first() else { return Vec::new() };
        let (question, nominal) = (self.question, &self.search.nominal);
        let gain = question.gain(nominal, shown, 1);
        let stability = question.steadied(nominal, (shown, &first.candidate), &mut []);
        let mut words = shown.effects.iter().map(|chosen| effect(shown, chosen, gain, stability));
        let Some(mut whole) = words.next() else { return Vec::new() };
        for (i, word) in words.enumerate() {
            if let Some((_, term)) = word.equation.split_once(" += ") {
                whole.equation = format!("{} + {term}", whole.equation);
            }
            for (name, parameter) in word.parameters {
                whole.parameters.insert(format!("{name}_{}", i + 2), parameter);
            }
        }
        whole.alternatives = self
            .search
            .best
            .effects
            .iter()
            .map(|named| Alternative {
                name: named.candidate.kind.into(),
                at: named.candidate.at.clone(),
                delta_bic: self.question.gain(&self.search.best, shown, 1).bic,
                why_not: wording::explains_less(),
            })
            .collect();
        vec![whole]
    }

    /// The text with the effects written in that are in no doubt, and how it differs.
    fn change(&self, verdict: Verdict, shown: &Hypothesis) -> (String, ModelChange) {
        let mut text = self.text.to_string();
        let doubtful = if verdict == Verdict::Ambiguous { self.doubtful() } else { Vec::new() };
        let sure = shown.effects.iter().enumerate().filter(|(i, _)| !doubtful.contains(i));
        for (_, chosen) in sure {
            let patch = with_values(&chosen.patch, &shown.fitted, true);
            if let Some(next) = apply(&text, self.question.name, &patch) {
                text = next;
            }
        }
        let change = diff(self.path, self.text, &text);
        let added = change.lines().skip(2).filter(|line| line.starts_with('+'));
        let added = added.map(|line| line[1..].trim().to_string()).collect();
        let model =
            ModelChange { path: Some(self.path.into()), added, diff: change, applied: false };
        (text, model)
    }

    /// What would settle a doubt, and the inputs for it.
    fn next(
        &self,
        verdict: Verdict,
        effects: &[Effect],
    ) -> (Option<NextExperiment>, Option<String>) {
        if verdict != Verdict::Ambiguous {
            return (None, None);
        }
        let best = &self.search.best;
        let ties = self.doubtful().into_iter().flat_map(|i| self.ties(i));
        let rivals: Vec<&Hypothesis> = ties.map(|rival| &rival.hypothesis).collect();
        let found = self.question.separating(best, &rivals);
        let why = match &found {
            Some(found) => {
                let settled = (found.settled, rivals.len());
                wording::settled_by(effects, found.input, settled, found.sigma)
            }
            None if rivals.is_empty() => wording::clock_settles(effects),
            None => wording::nothing_settles(effects),
        };
        (Some(NextExperiment { why, commands: None }), found.map(|found| found.csv))
    }

    /// Noise floor, before and after, as parts of each output's spread.
    fn numbers(&self, shown: &Hypothesis) -> (f64, Split, Split) {
        let question = self.question;
        let (before, after) = (question.told(&self.search.nominal), question.told(shown));
        // Noise cannot be larger than what is left when everything is explained.
        (question.noise_floor().min(after.heldout), before, after)
    }

    fn places(&self) -> Vec<Channel> {
        let question = self.question;
        let nominal = &self.search.nominal;
        let rms = nominal.held.rms();
        let outputs = &nominal.fitted.compiled.outputs;
        let noise = &question.bench.train[0].noise;
        let beyond: Vec<f64> = (0..outputs.len())
            .map(|o| {
                (rms[o].powi(2) - noise[o].powi(2)).max(0.0) / question.bench.scales[o].powi(2)
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
                unit: unit(output.dimension),
                share: if total > 0.0 { beyond[o] / total } else { 0.0 },
                concentrated_in: concentrated(question, nominal, o),
                heldout: None,
            })
            .collect();
        places.sort_by(|a, b| b.share.total_cmp(&a.share));
        places
    }

    fn traces(&self, shown: &Hypothesis) -> Vec<Trace> {
        let bench = &self.question.bench;
        let nominal = &self.search.nominal;
        let task = bench.task_on(&shown.fitted.compiled, &bench.held);
        let time: Vec<f64> = task
            .windows
            .iter()
            .flat_map(|w| w.rows.clone().map(|row| bench.held[w.data].time[row]))
            .collect();
        let unseen: Vec<bool> = (0..time.len()).map(|row| is_unseen(row, time.len())).collect();
        let outputs = &nominal.fitted.compiled.outputs;
        outputs
            .iter()
            .enumerate()
            .map(|(o, output)| Trace {
                recording: bench.held[0].name.clone(),
                channel: output.name.clone(),
                unit: unit(output.dimension),
                noise: bench.held[0].noise[o],
                sigma: vec![bench.held[0].noise[o]; time.len()],
                held_out: vec![true; time.len()],
                along: "s",
                time: time.clone(),
                before: nominal.held.residuals[o].clone(),
                after: shown.held.residuals[o].clone(),
                unseen: unseen.clone(),
                against: None,
            })
            .collect()
    }
}

/// Returns where states and inputs went in the data fitted.
fn seen<'a>(question: &'a Question, shown: &'a Hypothesis) -> Vec<Seen<'a>> {
    let compiled = &shown.fitted.compiled;
    let columns = question.along(&shown.fitted);
    let of = |name: &'a str, values: &mut dyn Iterator<Item = f64>| {
        let range =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        Seen { name, range, unit: unit(compiled.units.of(name)) }
    };
    let mut seen: Vec<Seen> = compiled
        .states
        .iter()
        .zip(&columns)
        .map(|(state, column)| of(&state.name, &mut column.iter().copied()))
        .collect();
    for (i, (name, _)) in compiled.inputs.iter().enumerate() {
        let mut all = question.bench.train.iter().flat_map(|d| d.inputs[i].iter().copied());
        seen.push(of(name, &mut all));
    }
    seen
}

impl Report<'_> {
    /// Returns what the model's own free parameters came out as.
    fn fitted<'s>(&self, shown: &'s Hypothesis) -> Vec<FittedParam<'s>> {
        let (compiled, train) = (&shown.fitted.compiled, &shown.fitted.train);
        let nominal = &self.search.nominal.fitted.compiled;
        let own = |name: &str| nominal.params.iter().any(|p| p.name == name);
        let unit_of =
            |name: &str| self.declared(name).unwrap_or_else(|| unit(compiled.units.of(name)));
        compiled
            .params
            .iter()
            .zip(train.point.params.iter().zip(&train.std))
            .filter(|(param, _)| own(&param.name))
            .map(|(param, (value, std))| FittedParam {
                name: &param.name,
                value: *value,
                std: (std.is_finite() && *std > 0.0).then_some(*std),
                unit: unit_of(&param.name),
            })
            .collect()
    }

    /// The unit of a parameter as the model's text writes it, where one of it is one of SI.
    fn declared(&self, name: &str) -> Option<String> {
        let params = &self.question.given.params;
        let ModelUnit { unit, span } = params.iter().find(|p| p.name.text == name)?.unit?;
        let is_si = (unit.factor - 1.0).abs() < 1e-12;
        let written = self.text.get(span.from..span.to).filter(|_| is_si)?;
        Some(written.trim().to_owned())
    }
}

fn unit(dimension: Option<Dimension>) -> String {
    dimension.map(Dimension::si).unwrap_or_default()
}

fn effect(at: &Hypothesis, chosen: &Chosen, gain: Gain, stability: f64) -> Effect {
    let patch = with_values(&chosen.patch, &at.fitted, true);
    let mut parameters = BTreeMap::new();
    let mut equation = chosen.candidate.equation.clone();
    for param in &patch.params {
        let unit = unit(param.dimension);
        let number = significant(param.value, 4);
        let text = if unit.is_empty() { number } else { format!("{number} {unit}") };
        equation = wording::replace_word(&equation, &param.name, &text);
        let std = Value::Number(param.std.unwrap_or(0.0));
        let parameter = Parameter { value: Value::Number(param.value), std, unit };
        parameters.insert(param.role.to_string(), parameter);
    }
    let evidence = Evidence { delta_bic: gain.bic, heldout_gain: gain.told.clamp(0.0, 1.0) };
    let site = (chosen.candidate.kind, chosen.candidate.at.clone());
    Effect::new(site, parameters, (evidence, stability), equation)
}

/// A rival of an effect, with why it was not chosen.
fn alternative(rival: &Rival, chosen: &Chosen) -> Alternative {
    let why_not = if rival.ties(&chosen.candidate) {
        if rival.differs_at_rest { WhyNot::SameOneWay } else { WhyNot::Tied }
    } else if rival.delta_bic >= 6.0 {
        WhyNot::FitsWorse(rival.delta_bic)
    } else if rival.held_worse >= 0.03 {
        WhyNot::PredictsWorse(rival.held_worse)
    } else {
        WhyNot::Longer
    };
    Alternative {
        name: rival.candidate.kind.into(),
        at: rival.candidate.at.clone(),
        delta_bic: rival.delta_bic,
        why_not: why_not.to_string(),
    }
}
