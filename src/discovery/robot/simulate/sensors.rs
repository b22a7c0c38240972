//! What the encoders, torque sensors and the tracker of the tip read of a motion.

use std::borrow::Cow;

use nalgebra::Vector3;

use super::super::chain::MOST_JOINTS;
use super::super::channels::Quantity;
use super::super::plant::Course;
use super::super::spline::Spline;
use super::active::ActiveEffects;
use super::model::{JointMotion, Model, Motion};
use super::needed::lengthen;
use crate::discovery::recording::sidecar::TorqueSensor;

/// Turns a motion into what the sensors read.
pub(super) fn read(model: &Model, active: &ActiveEffects, motion: &Motion) -> Vec<f64> {
    let Course { data, .. } = &model.course;
    let mut out = Vec::with_capacity(data.channels.len() * data.n_rows());
    let mut places: Vec<Vector3<f64>> = Vec::new();
    for channel in &data.channels {
        if !model.is_predicted(channel.quantity) {
            continue;
        }
        let from = out.len();
        let j = channel.index;
        match channel.quantity {
            Quantity::Position => out.extend_from_slice(&motion.joints[j].q),
            Quantity::Speed => out.extend_from_slice(&motion.joints[j].dq),
            Quantity::Torque => {
                let read = match model.arm.torque_sensor {
                    TorqueSensor::Motor => Cow::Borrowed(&motion.joints[j].tau[..]),
                    TorqueSensor::Link => beyond_gear(active, &motion.joints[j], j, &data.time),
                };
                let (gain, offset) = (active.torque_gain[j], active.torque_offset[j]);
                let drift = active.torque_drift[j];
                let felt = read.iter().zip(&data.time);
                out.extend(felt.map(|(tau, t)| gain * tau + offset + drift * (t - data.time[0])));
            }
            Quantity::Tip => {
                if places.is_empty() {
                    places = tips(model, active, motion);
                }
                out.extend(places.iter().map(|tip| tip[j]));
            }
        }
        if let Some(delay) = active.late.get(&channel.quantity) {
            let shifted = delayed(&data.time, &out[from..], *delay);
            out[from..].copy_from_slice(&shifted);
        }
    }
    out
}

/// Returns what goes through the gear of a joint, N·m row by row: what its link needs, less what springs between the links pull.
fn beyond_gear<'a>(
    active: &ActiveEffects,
    joint: &'a JointMotion,
    j: usize,
    time: &[f64],
) -> Cow<'a, [f64]> {
    let springs = active.smooth.iter().filter(|(at, law)| *at == j && law.is_between_links());
    let mut felt = Cow::Borrowed(&joint.load[..]);
    for (_, spring) in springs {
        for (row, felt) in felt.to_mut().iter_mut().enumerate() {
            let since = time[row] - time[0];
            *felt -= spring.torque(joint.q[row], joint.dq[row], since, joint.load[row]);
        }
    }
    felt
}

/// Returns where the tracker sees the tip at every row.
fn tips(model: &Model, active: &ActiveEffects, motion: &Motion) -> Vec<Vector3<f64>> {
    let n = model.course.plant.n;
    let mut chain = None;
    if active.has_lengths {
        let mut longer = model.arm.chain.clone();
        for (j, length) in active.lengths.iter().take(n).enumerate() {
            for axis in 0..3 {
                lengthen(&mut longer, j, axis, length[axis]);
            }
        }
        chain = Some(longer);
    }
    let chain = chain.as_ref().unwrap_or(&model.arm.chain);
    let moved = active.tool.norm() > 0.0;
    let mut chain_with_tool;
    let chain = if moved {
        chain_with_tool = chain.clone();
        chain_with_tool.body_from_tip *= nalgebra::Translation3::from(active.tool);
        &chain_with_tool
    } else {
        chain
    };
    let mut q = [0.0; MOST_JOINTS];
    (0..model.course.data.n_rows())
        .map(|row| {
            for (j, joint) in motion.joints.iter().enumerate() {
                q[j] = joint.q[row] + joint.gap[row] + active.zero[j]
                    - active.compliance[j] * joint.load[row];
            }
            active.turn * chain.tip(&q[..n]) + active.shift
        })
        .collect()
}

/// Returns what a channel reads that is `delay` s late (early, if negative): cubic between rows.
fn delayed(time: &[f64], values: &[f64], delay: f64) -> Vec<f64> {
    let spline = Spline::through(time, values);
    let mut hint = 0;
    let (first, last) = (time[0], time[time.len() - 1]);
    time.iter().map(|t| spline.at((t - delay).clamp(first, last), &mut hint).0).collect()
}
