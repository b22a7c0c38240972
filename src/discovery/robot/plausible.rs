//! Whether a recording can be of this arm at all: columns in another unit, in another order, of another sign.
//!
//! Such a mistake is no effect of the arm; searched for effects it yields a list of absurd ones. Each check asks
//! for strong evidence, so that a bad arm is never taken for a bad file.

use super::channels::{Data, Quantity, unwrapped};
use super::error::{Misfit, Pair, TimeUnit};
use super::explain::ArmGap;
use super::plant::Arm;
use super::simulate::Model;
use crate::discovery::recording::{Error, Recording};
use crate::discovery::selection::Set;
use crate::motion::robot::JointLimits;
use crate::units::Dimension;

/// Two columns that say the same agree in size to within this factor.
const FACTOR: f64 = 2.0;

/// Columns that follow each other have a cosine above this.
const ALIKE: f64 = 0.95;

/// A column is another's if it follows that one better than the second and its own worse than the first: motions of
/// different joints may look alike, but not so much.
const ANOTHERS: [f64; 2] = [0.9, 0.99];

/// Rows further apart than this show no motion of an arm, s.
pub(super) const COARSE: f64 = 0.5;

/// An arm moves if a joint turns by this, rad.
pub(super) const MOVES: f64 = 0.05;

/// A torque stands out of its noise by this factor.
pub(super) const SURE: f64 = 5.0;

/// Multiples that differ by less than this part are the same.
const SAME: f64 = 0.2;

/// So many joints do not show the same multiple by chance.
pub(super) const ENOUGH: usize = 3;

/// A file may be wrong by this factor in what several joints need, and the unit be right.
const FAR: f64 = 3.0;

/// A joint may be beyond its limits by this part of its range and this angle: files differ.
const BEYOND: (f64, f64) = (0.1, 0.1);

/// Checks positions, speeds, times and the tip against each other and the arm.
///
/// # Errors
///
/// An [`Error`] for columns that cannot be what they are called.
pub(super) fn check(
    arm: &Arm,
    limits: &[JointLimits],
    data: &Data,
    name: &str,
) -> Result<(), Error> {
    let measured: Vec<&[f64]> =
        (0..data.n).filter_map(|j| data.measured(Quantity::Position, j)).collect();
    if measured.len() == data.n {
        if data.commands.len() == data.n {
            let commands: Vec<Vec<f64>> = data.commands.iter().map(|c| centred(c)).collect();
            let followed: Vec<Vec<f64>> = measured.iter().map(|q| centred(q)).collect();
            agree(&commands, &followed, Pair::Positions, name)?;
        }
        let speeds: Vec<&[f64]> =
            (0..data.n).filter_map(|j| data.measured(Quantity::Speed, j)).collect();
        if speeds.len() == data.n {
            let changes: Vec<Vec<f64>> = measured.iter().map(|q| changes(&data.time, q)).collect();
            let inner = |dq: &&[f64]| dq[1..dq.len() - 1].to_vec();
            let speeds: Vec<Vec<f64>> = speeds.iter().map(inner).collect();
            agree(&changes, &speeds, Pair::Speeds, name)?;
        }
    }
    let moves = |values: &[f64]| values.iter().any(|v| (v - values[0]).abs() > MOVES);
    if data.commands.iter().map(Vec::as_slice).chain(measured).any(moves) {
        fine_enough(data, name)?;
    }
    within_limits(arm, limits, data, name)?;
    within_reach(arm, data, name)
}

/// Checks the time of a whole recording, before any of it is left out for being too long: by speeds and the change of angles.
/// Where columns cannot be read, or hold no motion, that is told elsewhere.
///
/// # Errors
///
/// An [`Error`] for a time in milliseconds or microseconds that is called seconds, and for rows too far apart to follow a motion.
pub(in super::super) fn check_clock(recording: &Recording, n: usize) -> Result<(), Error> {
    let place = || format!("{}, column `t`", recording.name);
    let group = |stem, dimension| recording.group(stem, n, dimension).ok().flatten();
    let Some(angles) = group("q", Dimension::ANGLE) else { return Ok(()) };
    let time = &recording.time;
    let angles: Vec<Vec<f64>> = angles.into_iter().map(unwrapped).collect();
    let moves = |q: &Vec<f64>| q.iter().any(|v| (v - q[0]).abs() > MOVES);
    let moving: Vec<usize> = (0..n).filter(|joint| moves(&angles[*joint])).collect();
    let speeds = group("dq", Dimension::ANGULAR_SPEED).unwrap_or_default();
    let follows = |joint: &usize| {
        let own = speeds.get(*joint)?;
        let own = own.get(1..own.len().saturating_sub(1))?;
        let changes = changes(time, &angles[*joint]);
        (cosine(&changes, own) > ALIKE).then(|| (*joint, norm(own) / norm(&changes).max(1e-300)))
    };
    let ratios: Vec<(usize, f64)> = moving.iter().filter_map(follows).collect();
    for unit in [TimeUnit::Milliseconds, TimeUnit::Microseconds] {
        let is_so = |(_, ratio): &(usize, f64)| {
            (1.0 / FACTOR..FACTOR).contains(&(ratio / unit.per_second()))
        };
        if let Some(&(joint, ratio)) = ratios.first()
            && ratios.iter().all(is_so)
            && 2 * ratios.len() > moving.len()
        {
            return Err(Misfit::Clock { unit, joint, ratio }.at(place()));
        }
    }
    let step = recording.step();
    if step > COARSE && !moving.is_empty() {
        return Err(Misfit::Coarse { step }.at(place()));
    }
    Ok(())
}

/// Checks that the arm moves in what is fitted and in what is held out, where torques are judged along the measured motion: nothing
/// that depends on speed is confirmed by an arm that stands.
///
/// # Errors
///
/// An [`Error`] for an arm that stands.
pub(super) fn check_motion(gap: &ArmGap, name: &str) -> Result<(), Error> {
    let has_torque = |model: &Model| model.course.data.has(Quantity::Torque);
    if !gap.is_along() || !gap.train.iter().chain(&gap.heldout).all(has_torque) {
        return Ok(());
    }
    for (models, set) in [(&gap.train, Set::Train), (&gap.heldout, Set::Heldout)] {
        let joints = 0..models.first().map_or(0, |model| model.course.data.n);
        let most = joints.map(|joint| travel(models, joint)).fold(0.0, f64::max);
        if most <= MOVES {
            return Err(Misfit::HardlyMoves { most, set }.at(name));
        }
    }
    Ok(())
}

/// Returns by how much a joint turns over several recordings, from its lowest angle to its highest, rad.
fn travel(models: &[Model], joint: usize) -> f64 {
    let measured = models.iter().filter_map(|m| m.course.data.measured(Quantity::Position, joint));
    let (low, high) =
        measured.flatten().fold((f64::MAX, f64::MIN), |(l, h), q| (l.min(*q), h.max(*q)));
    (high - low).max(0.0)
}

/// Checks poses at rest against the arm.
///
/// # Errors
///
/// An [`Error`] for columns that cannot be what they are called.
pub(super) fn check_at_rest(
    arm: &Arm,
    limits: &[JointLimits],
    data: &Data,
    name: &str,
) -> Result<(), Error> {
    within_limits(arm, limits, data, name)?;
    within_reach(arm, data, name)
}

/// Rows far apart say little of a motion; mostly their time is in another unit.
fn fine_enough(data: &Data, name: &str) -> Result<(), Error> {
    let mut steps: Vec<f64> = data.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let step = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    if step > COARSE {
        return Err(Misfit::Coarse { step }.at(format!("{name}, column `t`")));
    }
    Ok(())
}

/// Compares columns joint by joint; both are centred or zero at rest.
fn agree(first: &[Vec<f64>], second: &[Vec<f64>], pair: Pair, place: &str) -> Result<(), Error> {
    for (joint, own) in second.iter().enumerate() {
        let cosine = cosine(&first[joint], own);
        let ratio = norm(own) / norm(&first[joint]).max(1e-300);
        let at = || format!("{place}, column `{}`", pair.told(joint));
        if cosine > ALIKE && !(1.0 / FACTOR..FACTOR).contains(&ratio) {
            return Err(Misfit::Scaled { pair, joint, ratio }.at(at()));
        }
        if cosine < -ALIKE {
            return Err(Misfit::Against { pair, joint }.at(at()));
        }
        let other =
            (0..first.len()).find(|&k| k != joint && self::cosine(&first[k], own) > ANOTHERS[1]);
        if let (true, Some(other)) = (cosine < ANOTHERS[0], other) {
            return Err(Misfit::OfAnother { pair, joint, other }.at(at()));
        }
    }
    Ok(())
}

/// A joint with limits cannot be far beyond them, whatever whole turn its angle is written in.
fn within_limits(arm: &Arm, limits: &[JointLimits], data: &Data, name: &str) -> Result<(), Error> {
    use std::f64::consts::TAU;
    let names = ["q_cmd", "q"];
    for (j, joint) in limits.iter().enumerate().take(data.n) {
        let range = joint.upper - joint.lower;
        if joint.continuous || !range.is_finite() || range <= 0.0 {
            continue;
        }
        let commands = data.commands.get(j).map(Vec::as_slice);
        for (stem, values) in names.iter().zip([commands, data.measured(Quantity::Position, j)]) {
            let Some(values) = values else { continue };
            let (low, high) =
                values.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
            let slides = arm.chain.slides(j);
            // A way has no whole turns.
            let turn = if slides {
                0.0
            } else {
                ((low + high - joint.lower - joint.upper) / (2.0 * TAU)).round() * TAU
            };
            let spare = BEYOND.0 * range + BEYOND.1;
            let furthest = (high - turn - joint.upper).max(joint.lower - low + turn);
            if furthest > spare {
                let worst = if high - turn - joint.upper > spare { high } else { low };
                let column = format!("{stem}_{}", j + 1);
                let place = format!("{name}, column `{column}`");
                let (limits, joint) = ([joint.lower, joint.upper], joint.name.clone());
                let unit = Quantity::Position.unit(slides);
                let beyond = Misfit::BeyondLimits { column, joint, to: worst, limits, unit };
                return Err(beyond.at(place));
            }
        }
    }
    Ok(())
}

/// The tip cannot travel further than across all that the arm reaches.
fn within_reach(arm: &Arm, data: &Data, name: &str) -> Result<(), Error> {
    let reach = arm.chain.reach();
    let slides = arm.chain.bodies.iter().any(|body| body.slides);
    for channel in data.channels.iter().filter(|c| c.quantity == Quantity::Tip && !slides) {
        let (low, high) =
            channel.values.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
        if high - low > 2.0 * FACTOR * reach {
            let column = channel.name.clone();
            let place = format!("{name}, column `{column}`");
            return Err(Misfit::BeyondReach { column, travels: high - low, reach }.at(place));
        }
    }
    Ok(())
}

/// Torques that are the same multiple of what the model needs in several joints at once are in another unit, or
/// counted the other way round: no arm has the same fault in all its joints. Where they show another gravity than was
/// said, `otherwise` is that; torques turned round are the weaker explanation then.
///
/// # Errors
///
/// An [`Error`] that says which multiple, or which gravity.
pub(super) fn check_torques(
    model: &Model,
    otherwise: Option<Misfit>,
    name: &str,
) -> Result<(), Error> {
    let scaled = torques_scaled(model);
    let is_turned = matches!(scaled, Some(Misfit::TorquesScaled { ratio, .. }) if ratio < 0.0);
    let wrong = if is_turned { otherwise.or(scaled) } else { scaled.or(otherwise) };
    let columns = if model.course.data.of_currents { "currents" } else { "columns `tau_n`" };
    wrong.map_or(Ok(()), |misfit| Err(misfit.at(format!("{name}, {columns}"))))
}

/// Returns which multiple of what the model needs the torques of several joints are, if they are.
fn torques_scaled(model: &Model) -> Option<Misfit> {
    let course = &model.course;
    let predicted = model.predict(&[], &[], &[])?;
    let channels = course.data.channels.iter().filter(|c| model.is_predicted(c.quantity));
    let torques = channels
        .zip(predicted.chunks(course.data.n_rows()))
        .filter(|(channel, _)| channel.quantity == Quantity::Torque);
    let multiples = torques.filter_map(|(channel, needed)| {
        let speed = course.at_rows(&course.plant.dq, channel.index);
        multiple(needed, &channel.values, &speed, channel.noise)
    });
    let (same, ratio) = scaled(multiples.collect(), course.data.n)?;
    Some(Misfit::TorquesScaled { same, ratio, of_currents: course.data.of_currents })
}

/// Returns which multiple of what a joint needs its torque sensor shows, if it follows that and stands out of its noise: beside
/// dry and fluid friction, of which the model has none, or as it is.
fn multiple(needed: &[f64], shown: &[f64], speed: &[f64], noise: f64) -> Option<f64> {
    let dry: Vec<f64> = speed.iter().map(|speed| speed.signum()).collect();
    let fluid = beyond(speed, &dry);
    let beside = |values: &[f64]| beyond(&beyond(values, &dry), &fluid);
    let followed = |needed: &[f64], shown: &[f64]| {
        // What is in another unit may well be needed less than its own noise, or be noisier than what it shows.
        let is_sure = norm(needed).max(norm(shown)) > SURE * noise * (shown.len() as f64).sqrt();
        let along: f64 = needed.iter().zip(shown).map(|(a, b)| a * b).sum();
        is_sure.then(|| (cosine(needed, shown), along / norm(needed).powi(2)))
    };
    let free = followed(&beside(needed), &beside(shown)).filter(|(cosine, _)| *cosine > ALIKE);
    let as_is = || followed(needed, shown).filter(|(cosine, _)| cosine.abs() > ALIKE);
    free.or_else(as_is).map(|(_, ratio)| ratio)
}

/// Returns how many joints of an arm of `n` show the same multiple of what they need, and which, if that is far from one: three
/// of them, or all of an arm of two.
fn scaled(mut multiples: Vec<f64>, n: usize) -> Option<(usize, f64)> {
    multiples.sort_by(f64::total_cmp);
    let middle = *multiples.get(multiples.len() / 2)?;
    let same = multiples.iter().filter(|ratio| (*ratio / middle - 1.0).abs() < SAME).count();
    let is_scaled = same >= ENOUGH.min(n.max(2)) && !(1.0 / FAR..FAR).contains(&middle);
    is_scaled.then_some((same, middle))
}

/// Returns what of some values is not a multiple of others.
pub(super) fn beyond(values: &[f64], others: &[f64]) -> Vec<f64> {
    let along: f64 = values.iter().zip(others).map(|(a, b)| a * b).sum();
    let part = along / norm(others).powi(2).max(1e-300);
    values.iter().zip(others).map(|(value, other)| value - part * other).collect()
}

/// Returns the values less their mean.
fn centred(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    values.iter().map(|value| value - mean).collect()
}

/// Returns the speed of every row but the first and the last by central differences.
fn changes(time: &[f64], values: &[f64]) -> Vec<f64> {
    let spans = time.windows(3).map(|t| t[2] - t[0]);
    values.windows(3).zip(spans).map(|(q, span)| (q[2] - q[0]) / span.max(1e-12)).collect()
}

/// Returns the root of the sum of squares.
pub(super) fn norm(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}

fn cosine(a: &[f64], b: &[f64]) -> f64 {
    let along: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    along / (norm(a) * norm(b)).max(1e-300)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number between -1 and 1 that looks like chance.
    fn scatter(i: u32) -> f64 {
        let x = (f64::from(i) * 12.9898).sin() * 43758.547;
        2.0 * (x - x.floor()) - 1.0
    }

    /// A joint that needs up to `weight` N·m, with 1 N·m of friction and a hundredth of noise, in a unit `unit` times smaller.
    fn joint(weight: f64, unit: f64) -> Option<f64> {
        let time = |row: u32| 0.01 * f64::from(row);
        let angle = |row: u32| (1.3 * time(row)).sin() + 0.4 * (3.1 * time(row)).sin();
        let speed: Vec<f64> = (0..600)
            .map(|row| 1.3 * (1.3 * time(row)).cos() + 1.24 * (3.1 * time(row)).cos())
            .collect();
        let needed: Vec<f64> = (0..600).map(|row| weight * angle(row).cos()).collect();
        let noise = 0.01 * weight * unit;
        let rows = (0..).zip(needed.iter().zip(&speed));
        let shown: Vec<f64> = rows
            .map(|(row, (needed, dq))| unit * (needed + dq.signum()) + noise * scatter(row))
            .collect();
        multiple(&needed, &shown, &speed, noise)
    }

    #[test]
    fn torques_of_another_unit_are_seen_through_their_noise_and_friction() {
        for unit in [1e-3, 1.0, 20.0, 1e3, 1e6] {
            for weight in [0.8, 30.0] {
                let found = joint(weight, unit).expect("it follows what is needed");
                assert!((found / unit - 1.0).abs() < 0.05, "{weight} N m, {unit}: {found}");
            }
        }
        assert_eq!(multiple(&[0.0; 50], &[1.0; 50], &[0.5; 50], 0.1), None);
    }

    #[test]
    fn several_joints_agree_or_all_of_a_small_arm() {
        assert_eq!(scaled(vec![1000.0, 990.0, 3.0, 1005.0], 7), Some((3, 1000.0)));
        assert_eq!(scaled(vec![50.0, 51.0], 7), None);
        assert_eq!(scaled(vec![50.0, 51.0], 2), Some((2, 51.0)));
        assert_eq!(scaled(vec![50.0, 51.0], 3), None);
        assert_eq!(scaled(vec![50.0], 1), None);
        assert_eq!(scaled(vec![1.1, 1.0, 0.9], 6), None);
        assert_eq!(scaled(vec![-1.0, -1.02, -0.97], 6), Some((3, -1.0)));
    }
}
