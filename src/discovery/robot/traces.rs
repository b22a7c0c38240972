//! What is left of every channel over time, with the numbers of the file and with what was found: for pictures.

use super::against::{TIME, against, states};
use super::channels::Channel;
use super::explain::{ArmGap, WithKnown};
use super::simulate::Model;
use super::term::{Feature, Law, Term};
use super::wording::load_at;
use crate::discovery::Trace;
use crate::discovery::selection::{Hypothesis, Outcome};
use crate::discovery::why::{Left, Seen, Shows, State};

/// Returns measured minus model for every channel of every recording: before, with the numbers of the file, and after.
pub(super) fn traces(
    filed: &ArmGap,
    gap: &ArmGap,
    outcome: &Outcome<Term>,
    names: &[&str],
) -> Vec<Trace> {
    let mut found = Vec::new();
    let with = |gap: &ArmGap, h: &Hypothesis<Term>| gap.with_known(&h.terms, &h.parameters);
    let (nothing, best) = (with(filed, &outcome.nothing), with(gap, &outcome.best));
    let befores = filed.train.iter().chain(&filed.heldout);
    let models = gap.train.iter().map(|m| (m, false)).chain(gap.heldout.iter().map(|m| (m, true)));
    for ((before, (model, held_out)), name) in befores.zip(models).zip(names) {
        let data = &model.course.data;
        let left = (by_channel(&nothing, before), by_channel(&best, model));
        let (Some(before), Some(after)) = left else { continue };
        for ((_, before), (channel, after)) in before.into_iter().zip(after) {
            found.push(Trace {
                against: against(model, channel, &after),
                recording: (*name).to_owned(),
                channel: channel.name.clone(),
                unit: model.unit(channel).to_owned(),
                noise: channel.noise,
                sigma: vec![channel.noise; after.len()],
                held_out: vec![held_out; after.len()],
                unseen: model.course.unseen.iter().map(|unseen| held_out && *unseen).collect(),
                along: "s",
                time: data.time.clone(),
                before,
                after,
            });
        }
    }
    found
}

/// Returns what effects leave of a recording, channel by channel, SI; `None` when the model runs away.
fn by_channel<'m>(with: &WithKnown, model: &'m Model) -> Option<Vec<(&'m Channel, Vec<f64>)>> {
    let residuals = with.residuals(model)?;
    let data = &model.course.data;
    let predicted = data.channels.iter().filter(|c| model.is_predicted(c.quantity));
    let rows = residuals.chunks(data.n_rows().max(1));
    let in_units = |(channel, rows): (&'m Channel, &[f64])| {
        (channel, rows.iter().map(|left| left * channel.noise).collect())
    };
    Some(predicted.zip(rows).map(in_units).collect())
}

/// The state by which a law is seen, as `q`, `load` and so on at its joint; `None` where the data say.
fn acts_by(law: Law) -> Option<&'static str> {
    Some(match law {
        Law::Coulomb
        | Law::SmoothCoulomb
        | Law::Asymmetric
        | Law::Stribeck
        | Law::Viscous
        | Law::Quadratic
        | Law::FadingDry
        | Law::FadingFluid => "dq",
        Law::Armature => "ddq",
        Law::TorqueOffset
        | Law::Ripple
        | Law::LoadRipple
        | Law::Hysteresis
        | Law::Stiffness
        | Law::CubicStiffness
        | Law::Above
        | Law::Below => "q",
        Law::TorqueGain
        | Law::ActuatorGain
        | Law::Saturation
        | Law::Compliance
        | Law::ServoSag
        | Law::Backlash => "load",
        Law::TorqueDrift | Law::Periodic => TIME,
        Law::Feature(feature) => match feature {
            Feature::Square | Feature::Sine(_) | Feature::Cosine(_) | Feature::One => "q",
            Feature::Decay(_) | Feature::Time => TIME,
            _ => "dq",
        },
        _ => return None,
    })
}

impl ArmGap {
    /// The recordings fitted, then those held out.
    fn all_models(&self) -> impl Iterator<Item = (&Model, bool)> {
        let fitted = self.train.iter().map(|model| (model, false));
        fitted.chain(self.heldout.iter().map(|model| (model, true)))
    }
}

impl Shows for ArmGap {
    fn left(&self, terms: &[Term], parameters: &[f64]) -> Vec<Left> {
        let with = self.with_known(terms, parameters);
        let of = |(model, held_out): (&Model, bool)| {
            let channels = by_channel(&with, model).unwrap_or_default();
            let left = move |(channel, values): (&Channel, Vec<f64>)| Left {
                channel: channel.name.clone(),
                unit: model.unit(channel).to_owned(),
                noise: channel.noise,
                held_out: vec![held_out; values.len()],
                values,
            };
            channels.into_iter().map(left).collect::<Vec<_>>()
        };
        self.all_models().flat_map(of).collect()
    }

    fn states(&self, at: usize) -> Vec<State> {
        let all = self.all_models().flat_map(|(model, _)| {
            let channels = model.course.data.channels.iter();
            channels.filter(|c| model.is_predicted(c.quantity)).map(move |c| (model, c))
        });
        let Some((model, channel)) = all.into_iter().nth(at) else { return Vec::new() };
        let states = states(model, channel).into_iter();
        states.map(|(name, unit, values)| State { name, unit: unit.into(), values }).collect()
    }

    fn told(&self, term: &Term) -> Option<(String, String)> {
        Some((term.law.name().to_owned(), term.site(&self.things)))
    }

    fn seen(&self, term: &Term) -> Seen {
        let joint = term.joint + 1;
        let state = acts_by(term.law).map(|state| match state {
            TIME => TIME.to_owned(),
            "load" => load_at(term.joint),
            state => format!("{state}_{joint}"),
        });
        Seen { channel: term.law.is_local().then(|| format!("tau_{joint}")), state }
    }
}
