//! A pour taken out of a run folder: what `gap` compares with its model of pouring.
//!
//! From the recorded joints and where the source was when the fingers took it follow its tilt, and where
//! what leaves its lip falls; the reading of the scale under the target stands beside them. Nothing else of the run is used.

use nalgebra::{Point3, Vector3};

use crate::discovery::recording::sidecar::Vessels;
use crate::discovery::recording::{Column, Error, Recording};
use crate::motion::Robot;
use crate::motion::dynamics::GRAVITY;
use crate::trace::{Deed, StepRecord};
use crate::units::{Dimension, Unit};
use crate::world::{Object, Pose, Scene, WATER_DENSITY};

use super::{Run, Water, devices, weighed, wording};

/// Kept before the vessel begins to turn, s.
const BEFORE: f64 = 2.0;

/// What a scale reads is taken over so long, s.
const READ: f64 = 0.5;

/// Half the time over which the lip's velocity is taken, s.
const STRETCH: f64 = 0.05;

/// Takes the pour out of a run and its recording; `Ok(None)` if the run has none, or no scale was read.
///
/// # Errors
///
/// An [`Error`] for a run whose recording does not hold the joints of this robot, or objects that the
/// scene does not have, or for a pour that went into another vessel than the one on the scale: how it ran nobody recorded.
pub fn pour(
    run: &Run,
    arm: &Recording,
    robot: &Robot,
    scene: &Scene,
) -> Result<Option<Recording>, Error> {
    let Some((turns, source, target)) = turned(run) else { return Ok(None) };
    let took = |step: &StepRecord| {
        step.deeds().any(|deed| matches!(deed, Deed::Took { object } if object == source))
    };
    let takes = run.steps[..turns].iter().rposition(took);
    let (Some(takes), true) = (takes, arm.has("mass")) else { return Ok(None) };
    let under = scale_under(run);
    if under != target {
        let what = wording::scale_elsewhere(source, target, &under);
        return Err(Error::new(what, &arm.name, wording::put_on_the_scale(target)));
    }
    let (turn, grasp) = (&run.steps[turns], &run.steps[takes]);
    let missing = |name: &str| {
        let what = wording::not_in_scene(name, &scene.name);
        Error::new(what, &arm.name, wording::give_the_scene())
    };
    let object = scene.object(source).ok_or_else(|| missing(source))?;
    let vessel = scene.object(target).ok_or_else(|| missing(target))?;
    let known = |name: &str| grasp.measured.object(name).and_then(|o| o.world_from_object);
    let (Some(taken), Some(stands)) = (known(source), known(target)) else { return Ok(None) };

    let columns = arm.group("q", robot.n_joints(), Dimension::ANGLE)?.ok_or_else(|| {
        Error::new(wording::no_joints_recorded(), &arm.name, wording::check_the_robot())
    })?;
    let hand = |row: usize| {
        let q: Vec<f64> = columns.iter().map(|column| column[row]).collect();
        robot.forward_tool(&q).map(|tool| scene.world_from_base * tool)
    };
    let no_hand = |error: crate::motion::Error| {
        Error::new(error.to_string(), &arm.name, wording::check_the_robot())
    };
    let row_at = |time: f64| arm.time.partition_point(|t| *t < time).min(arm.n_rows() - 1);
    let tool_from_object = hand(row_at(grasp.interval_s[1])).map_err(no_hand)?.inverse() * taken;
    let sets_down =
        |step: &&StepRecord| step.deeds().any(|deed| matches!(deed, Deed::SetDown { .. }));
    let down = run.steps[turns..].iter().find(sets_down);
    let end = down.map_or(turn.interval_s[1], |step| step.interval_s[0]);
    let rows = row_at(turn.interval_s[0] - BEFORE)..row_at(end);
    let poses: Vec<Pose<_, _>> = rows
        .clone()
        .map(|row| hand(row).map(|tool| tool * tool_from_object))
        .collect::<Result<_, _>>()
        .map_err(no_hand)?;
    let tilt: Vec<f64> = poses.iter().map(Pose::tilt).collect();
    let furthest = (0..tilt.len()).max_by(|a, b| tilt[*a].total_cmp(&tilt[*b]));
    let Some(furthest) = furthest else { return Ok(None) };
    let down = poses[furthest].isometry().inverse_transform_vector(&-Vector3::z());
    let lip = lip(object, &down);
    let time = &arm.time[rows.clone()];
    let lips: Vec<Point3<f64>> =
        poses.iter().map(|pose| stands.isometry().inverse() * (pose.isometry() * lip)).collect();
    let inside = (0..lips.len()).map(|row| inside(vessel, &falls(vessel, time, &lips, row)));
    let mass = arm.column("mass", Dimension::MASS)?;
    let column = |name: &str, unit: &str, values: Vec<f64>| Column {
        name: name.into(),
        unit: Unit::parse(unit).ok(),
        values,
        bad: Vec::new(),
        n_bad: 0,
        is_one_of_several: false,
    };
    let columns = vec![
        column("inside", "m", inside.collect()),
        column("mass", "kg", mass[rows.clone()].to_vec()),
        column("tilt", "rad", tilt),
    ];
    let mut sidecar = arm.sidecar.clone();
    // What came into the target until the run ended, by the scale under it, whatever that read before.
    let came =
        |from: f64| (mean_at(arm, mass, f64::INFINITY) - mean_at(arm, mass, from)) / WATER_DENSITY;
    let begins = turn.interval_s[0];
    let believed = |name: &str| run.steps[turns - 1].measured.object(name).and_then(|o| o.water);
    // While it pours some is in the air, and nobody weighs that.
    let weighed = run.water.as_ref().filter(|_| is_over(&run.steps[turns..]));
    let there = weighed
        .map(|water| (1e-6 * in_vessel(water, target, water.in_target_ml) - came(begins)).max(0.0))
        .or_else(|| believed(target));
    let there = there.ok_or_else(|| unknown(target, &arm.name))?;
    // What the scales say at the end is of this pour if nothing was poured after it.
    let is_last =
        !run.steps[turns..].iter().any(|step| step.interval_s[0] >= end && turns_one(step));
    let weighed = weighed.filter(|_| is_last);
    let held = weighed.map(|water| {
        1e-6 * (in_vessel(water, source, water.in_source_ml) + water.spilt_ml) + came(begins)
    });
    let first = believed(source);
    if held.is_none() && first.is_none() {
        return Err(unknown(source, &arm.name));
    }
    sidecar.pour = Some(Vessels {
        source: source.into(),
        target: target.into(),
        held_m3: held,
        first_m3: first,
        there_m3: Some(there),
        spilt_m3: weighed.map(|water| 1e-6 * water.spilt_ml),
        borne_kg: weighed::borne(arm, robot, grasp.interval_s, turn.interval_s[0]),
    });
    let time = arm.time[rows].to_vec();
    let (name, notes) = (arm.name.clone(), arm.notes.clone());
    Ok(Some(Recording { name, time, lines: Vec::new(), columns, sidecar, notes }))
}

/// Returns the vessel on the scale whose reading a run recorded: of records that do not say, the usual one.
pub(super) fn scale_under(run: &Run) -> String {
    run.scale_under.clone().unwrap_or_else(devices::usually_on_the_scale)
}

/// Returns what a vessel held when a run ended, mL, by the scales under it; records of older programs name none but the
/// call's two.
fn in_vessel(water: &Water, name: &str, else_ml: f64) -> f64 {
    let found = water.vessels_ml.iter().find(|(vessel, _)| vessel == name);
    found.map_or(else_ml, |(_, volume)| *volume)
}

/// Returns what the scale read on the mean of [`READ`] before a time, or at the end, kg.
fn mean_at(arm: &Recording, mass: &[f64], time: f64) -> f64 {
    let end = arm.time.partition_point(|t| *t <= time).max(1);
    let begin = arm.time.partition_point(|t| *t < arm.time[end - 1] - READ).min(end - 1);
    let rows = &mass[begin..end];
    rows.iter().sum::<f64>() / rows.len() as f64
}

/// Whether a step turns a vessel to pour.
fn turns_one(step: &StepRecord) -> bool {
    step.deeds().any(|deed| matches!(deed, Deed::Turned { .. }))
}

/// Whether what was turned to pour was turned back or set down in the end.
fn is_over(steps: &[StepRecord]) -> bool {
    let turns = steps.iter().flat_map(StepRecord::deeds).filter_map(|deed| match deed {
        Deed::Turned { .. } => Some(false),
        Deed::TurnedBack | Deed::SetDown { .. } => Some(true),
        _ => None,
    });
    turns.last().unwrap_or(false)
}

/// Nobody knows what was in a vessel before a pour.
fn unknown(vessel: &str, recording: &str) -> Error {
    Error::new(wording::content_unrecorded(vessel), recording, wording::weigh_it())
}

/// Returns the step that turns a vessel to pour, the vessel, and what it is poured into.
fn turned(run: &Run) -> Option<(usize, &str, &str)> {
    run.steps.iter().enumerate().find_map(|(at, step)| {
        step.deeds().find_map(|deed| match deed {
            Deed::Turned { source, target } => Some((at, source.as_str(), target.as_str())),
            _ => None,
        })
    })
}

/// Returns where what leaves the lip at a row passes the height of the vessel's mouth, m in the vessel's frame: it
/// keeps the lip's velocity while it falls.
fn falls(vessel: &Object, time: &[f64], lips: &[Point3<f64>], row: usize) -> Point3<f64> {
    let from = time.partition_point(|t| *t < time[row] - STRETCH);
    let to = time.partition_point(|t| *t <= time[row] + STRETCH) - 1;
    let span = time[to] - time[from];
    let speed = if span > 0.0 { (lips[to] - lips[from]) / span } else { Vector3::zeros() };
    let drop = (lips[row].z - vessel.shape.height()).max(0.0);
    let falling = (speed.z + (speed.z * speed.z + 2.0 * GRAVITY * drop).sqrt()) / GRAVITY;
    let place = lips[row] + speed * falling;
    Point3::new(place.x, place.y, vessel.shape.height())
}

/// Returns the point of the rim that is lowest when `down` is down, m in the object's frame.
fn lip(object: &Object, down: &Vector3<f64>) -> Point3<f64> {
    let z = object.shape.height();
    match object.shape.faces() {
        Some([x, _]) if down.x.abs() > down.y.abs() => {
            Point3::new(0.5 * x * down.x.signum(), 0.0, z)
        }
        Some([_, y]) => Point3::new(0.0, 0.5 * y * down.y.signum(), z),
        None => {
            let radius = object.shape.rim_radius();
            let across = down.x.hypot(down.y).max(1e-9);
            Point3::new(radius * down.x / across, radius * down.y / across, z)
        }
    }
}

/// Returns how far inside a vessel's mouth a point is, seen from above, m; negative outside.
fn inside(vessel: &Object, place: &Point3<f64>) -> f64 {
    let mouth = vessel.inside().unwrap_or_else(|| vessel.shape.clone());
    mouth.inset(place.x, place.y)
}
