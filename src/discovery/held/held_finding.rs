//! Things held → a finding.

use super::gap::{HeldGap, Term};
use super::held_record::Held;
use super::wording;
use crate::discovery::finding::{Channel, Finding, ParameterEstimate};
use crate::discovery::recording::{Error, Recording};
use crate::discovery::selection::{self, Hypothesis, Options, Residuals as _, Set};
use crate::discovery::vocabulary::OBJECT_TRACKER;
use crate::discovery::why::whys;
use crate::discovery::wording::{Worded, answer, sets};
use crate::discovery::{Investigation, Trace};
use crate::language::ast::EffectItem;
use crate::motion::Robot;
use crate::world::Scene;

/// Finds what a twin lacks of a thing held: of several recordings the last is held out, of one every second
/// second.
///
/// # Errors
///
/// An [`Error`] for recordings in which nothing is held, or of a thing that the scene does not have.
pub fn investigate(
    robot: &Robot,
    scene: &Scene,
    known: &[EffectItem],
    recordings: &[Recording],
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Investigation, Error> {
    let held: Vec<Held> = recordings
        .iter()
        .map(|recording| Held::of(recording, robot, scene))
        .collect::<Result<_, _>>()?;
    let mut notes: Vec<String> = recordings.iter().flat_map(|r| r.notes.clone()).collect();
    notes.extend(held.iter().flat_map(|held| held.notes.clone()));
    let sets = sets(held.len());
    if held.len() == 1 {
        notes.push(wording::one_recording());
    }
    let mut gap = HeldGap { held, sets, known: (Vec::new(), Vec::new()) };
    notes.extend(take_known(&mut gap, known));
    let outcome = selection::search(&gap, options, progress)
        .map_err(|what| wording::diverged(what, &recordings[0].name))?;
    progress("writing the answer", 0.98);
    let traces = traces(&gap, &outcome.nothing, &outcome.best);
    let whys = whys(&gap, &outcome, options.tie);
    if outcome.best.terms.contains(&Term::Height) {
        notes.push(wording::stood_on_table());
    }
    let finding: Finding = answer(&gap, &outcome, options, notes);
    Ok(Investigation { finding, traces, whys, experiment: None, revision: None })
}

/// Gives the gap the effects that the model has already; returns a sentence for each that is not of a thing held.
fn take_known(gap: &mut HeldGap, known: &[EffectItem]) -> Vec<String> {
    let mut aside = Vec::new();
    for item in known {
        let mut found = false;
        for term in [
            Term::Rate,
            Term::Friction,
            Term::Width(0),
            Term::Width(1),
            Term::Height,
            Term::Late,
            Term::Shift,
        ] {
            let specs = gap.specs(&term);
            let number = |name: &str| {
                let parameter = item.parameters.iter().find(|p| p.name.text == name);
                parameter.map(|parameter| parameter.value.quantity.value)
            };
            let mine: Vec<f64> =
                specs.iter().map(|spec| number(spec.name).unwrap_or(0.0)).collect();
            let is_it = gap.name(&term) == item.name.text
                && gap.seat(&term) == item.at.text
                && specs.iter().any(|spec| number(spec.name).is_some());
            if is_it {
                gap.known.0.push(term);
                gap.known.1.extend(mine);
                found = true;
            }
        }
        if !found {
            aside.push(wording::not_of_holding(item));
        }
    }
    aside
}

pub(super) const AXES: [&str; 3] = ["object_x", "object_y", "object_z"];

/// Returns how far the thing moved in the hand before and after, m, axis by axis of the hand.
fn traces(gap: &HeldGap, nothing: &Hypothesis<Term>, best: &Hypothesis<Term>) -> Vec<Trace> {
    let mut found = Vec::new();
    for (at, held) in gap.held.iter().enumerate() {
        let left = |h: &Hypothesis<Term>| gap.left(at, None, &h.terms, &h.parameters);
        let (Some(before), Some(after)) = (left(nothing), left(best)) else { continue };
        for (axis, channel) in AXES.into_iter().enumerate() {
            found.push(Trace {
                recording: held.name.clone(),
                channel: channel.into(),
                unit: "m".into(),
                noise: held.noise,
                sigma: vec![held.noise; before.len()],
                held_out: before.iter().map(|(row, _)| !gap.is_in(at, *row, Set::Train)).collect(),
                along: "s",
                time: before.iter().map(|(row, _)| held.time[*row]).collect(),
                before: before.iter().map(|(_, value)| value[axis]).collect(),
                after: after.iter().map(|(_, value)| value[axis]).collect(),
                unseen: before.iter().map(|(row, _)| gap.is_in(at, *row, Set::Unseen)).collect(),
                against: None,
            });
        }
    }
    found
}

impl Worded for HeldGap {
    fn name(&self, term: &Term) -> &'static str {
        match term {
            Term::Rate | Term::Friction => "grip_slip",
            Term::Width(_) | Term::Height => "object_size",
            Term::Late => "image_delay",
            Term::Shift => "camera_shift",
        }
    }

    fn site(&self, term: &Term) -> String {
        match term {
            Term::Rate | Term::Friction => "gripper".into(),
            Term::Width(_) | Term::Height => self.held[0].object.clone(),
            Term::Late | Term::Shift => "camera".into(),
        }
    }

    fn seat(&self, term: &Term) -> String {
        match term {
            Term::Shift => OBJECT_TRACKER.into(),
            _ => self.site(term),
        }
    }

    fn equation(&self, term: &Term, estimates: &[ParameterEstimate]) -> String {
        wording::equation(&self.held[0].object, term, estimates)
    }

    fn places(&self, nothing: &Hypothesis<Term>) -> Vec<Channel> {
        let mut sums = [0.0; 3];
        let mut rows = 0_usize;
        let (mut first, mut last) = (0.0, 0.0);
        for at in 0..self.held.len() {
            let left = self.left(at, None, &nothing.terms, &nothing.parameters).unwrap_or_default();
            let half = left.len() / 2;
            for (i, (_, value)) in left.iter().enumerate() {
                rows += 1;
                for (sum, value) in sums.iter_mut().zip(value.iter()) {
                    *sum += value * value;
                }
                *(if i < half { &mut first } else { &mut last }) += value.norm_squared();
            }
        }
        let total = sums.iter().sum::<f64>().max(1e-18);
        let when = wording::when(first, last);
        let channel = |(axis, sum): (usize, f64)| Channel {
            channel: AXES[axis].into(),
            rms: (sum / rows.max(1) as f64).sqrt(),
            noise: self.held[0].noise,
            unit: "m".into(),
            share: sum / total,
            concentrated_in: wording::along_hand(when, ["x", "y", "z"][axis]),
            heldout: None,
        };
        let mut found: Vec<Channel> = sums.into_iter().enumerate().map(channel).collect();
        let widths: Vec<f64> = self
            .held
            .iter()
            .flat_map(|held| held.opening.iter().map(|(wider, _)| *wider))
            .collect();
        if !widths.is_empty() {
            let square: f64 = widths.iter().map(|wider| wider * wider).sum();
            let rms = (square / widths.len() as f64).sqrt();
            let beyond = (rms / Held::PADS).powi(2) - 1.0;
            found.push(Channel {
                channel: "gripper".into(),
                rms,
                noise: Held::PADS,
                unit: "m".into(),
                share: if beyond > 0.0 { 1.0 } else { 0.0 },
                concentrated_in: wording::at_the_stop().into(),
                heldout: None,
            });
        }
        let shares: f64 = found.iter().map(|channel| channel.share).sum();
        for channel in &mut found {
            channel.share /= shares.max(1e-9);
        }
        found.sort_by(|a, b| b.share.total_cmp(&a.share));
        found
    }

    fn apart(&self, term: &Term) -> Option<&'static str> {
        matches!(term, Term::Width(_) | Term::Height).then(|| wording::read_once(term))
    }

    fn nothing(&self) -> &'static str {
        wording::nothing_missing()
    }

    fn doubt(&self) -> &'static str {
        wording::hold_otherwise()
    }
}
