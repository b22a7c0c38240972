//! Recordings of an arm → the arm laid out along each of them, with the effects that its model has already.
//!
//! What is assumed on the way is noted. Nothing is fitted here but what an ampere is worth.

use super::channels::{self, Data};
use super::currents;
use super::error::Misfit;
use super::explain::ArmGap;
use super::gravity;
use super::known::known;
use super::load::{Load, Thing};
use super::pace;
use super::plant::{Arm, Course};
use super::plausible;
use super::simulate::Model;
use super::term::{Law, Term};
use super::wording;
use crate::discovery::recording::sidecar::TorqueSensor;
use crate::discovery::recording::{Error, Recording};
use crate::discovery::selection::{Residuals as _, Set};
use crate::language::ast::EffectItem;
use crate::motion::Robot;

/// Returns the gap between an arm and its recordings, and what was assumed.
///
/// # Errors
///
/// An [`Error`] for recordings that hold nothing of this arm, or cannot be what they say they are.
pub(super) fn gap(
    robot: &Robot,
    already: &[EffectItem],
    train: &[Recording],
    heldout: &[Recording],
) -> Result<(ArmGap, Vec<String>), Error> {
    let mut notes: Vec<String> = Vec::new();
    let things = things(train.iter().chain(heldout));
    let mut models = models(robot, &things, train, heldout, &mut notes)?;
    notes.dedup();
    let place = train.first().map_or("", |recording| &recording.name);
    let drives = currents::turned(&mut models, train.len(), place)?;
    notes.extend(drives.note());
    for (model, recording) in models.iter().zip(train.iter().chain(heldout)) {
        plausible::check_torques(model, gravity::other(model), &recording.name)?;
    }
    let held = models.split_off(train.len());
    let present = present(already, &things, &robot.sliding(), &mut notes)?;
    let gap = ArmGap {
        train: models,
        heldout: held,
        known: present,
        things,
        unexplained: Default::default(),
        settled: Vec::new(),
        drives,
    };
    if gap.count(Set::Train) == 0 || gap.count(Set::Heldout) == 0 {
        let mut all = train.iter().chain(heldout);
        let leans = all.any(|recording| !recording.sidecar.contacts.is_empty());
        let why = if leans { Misfit::OnlyContacts } else { Misfit::NothingPredicted };
        return Err(why.at(place));
    }
    plausible::check_motion(&gap, place)?;
    Ok((gap, notes))
}

/// Reads every recording and lays the arm out along it.
fn models(
    robot: &Robot,
    things: &[Thing],
    train: &[Recording],
    heldout: &[Recording],
    notes: &mut Vec<String>,
) -> Result<Vec<Model>, Error> {
    let mut read = Vec::new();
    for recording in train.iter().chain(heldout) {
        let arm = Arm::of(robot, recording)?;
        recording.check_joints(&robot.sliding())?;
        let mut data = Data::new(recording, arm.chain.n(), robot.joints())?;
        plausible::check(&arm, robot.joints(), &data, &recording.name)?;
        let paced = pace::check(&data, &recording.name)?;
        data.notes.extend(paced);
        read.push((arm, data));
    }
    channels::settle_noise(read.iter_mut().map(|(_, data)| data));
    let mut models = Vec::new();
    for (recording, (arm, mut data)) in train.iter().chain(heldout).zip(read) {
        // Of a motion that is simulated friction at rest is a part.
        if arm.torque_sensor == TorqueSensor::Motor && arm.controller.is_none() {
            data.leave_out_standing(&recording.name);
        }
        notes.extend(recording.notes.iter().cloned());
        notes.extend(data.notes.iter().map(ToString::to_string));
        let course = Course::new(&arm, data);
        if !course.closed_loop {
            notes.push(wording::no_controller(&recording.name));
        }
        let carried = recording.sidecar.carried.iter().map(|carried| {
            let at = things.iter().position(|thing| thing.name == carried.object).unwrap_or(0);
            Load::new(&arm, &course.plant, carried, at, things[at].mass)
        });
        let loads = carried.collect();
        models.push(Model::new(arm, course, loads));
    }
    Ok(models)
}

/// Returns the effects that the model has already, and notes those of something else.
fn present(
    already: &[EffectItem],
    things: &[Thing],
    slides: &[bool],
    notes: &mut Vec<String>,
) -> Result<(Vec<Term>, Vec<f64>), Error> {
    let mut present = (Vec::new(), Vec::new());
    for effect in already {
        let thing = things.iter().position(|thing| thing.name == effect.at.text);
        let heavier = effect.parameters.iter().find(|parameter| parameter.name.text == "mass");
        if let ("object_mass", Some(joint), Some(mass)) =
            (effect.name.text.as_str(), thing, heavier)
        {
            present.0.push(Term { law: Law::ObjectMass, joint });
            present.1.push(mass.value.quantity.value - things[joint].mass);
            continue;
        }
        let (name, at) = (&effect.name.text, &effect.at.text);
        let read = known(effect, slides).map_err(|misfit| misfit.at(wording::effect(name, at)))?;
        match read {
            Some((term, values)) => {
                present.0.push(term);
                present.1.extend(values);
            }
            None => notes.push(wording::not_of_the_arm(name, at)),
        }
    }
    Ok(present)
}

/// Returns what was carried in any of the recordings, each thing once.
fn things<'a>(recordings: impl Iterator<Item = &'a Recording>) -> Vec<Thing> {
    let mut found: Vec<Thing> = Vec::new();
    for carried in recordings.flat_map(|recording| &recording.sidecar.carried) {
        if found.iter().all(|thing| thing.name != carried.object) {
            found.push(Thing { name: carried.object.clone(), mass: carried.mass_kg });
        }
    }
    found
}
