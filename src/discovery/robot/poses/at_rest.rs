//! What was read of an arm at rest, pose by pose; whether a recording is of that kind.

use nalgebra::Vector3;

use super::super::channels::{Data, Quantity};
use super::super::plausible::COARSE;
use super::super::zeros;
use crate::discovery::recording::Recording;
use crate::units::Dimension;

/// What was read at one pose.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Pose {
    /// Joint positions as the encoders read them, rad.
    pub(super) q: Vec<f64>,
    /// The tip as a tracker sees it, m.
    pub(super) tip: Option<Vector3<f64>>,
    /// Joint torques, N·m; empty where none were read.
    pub(super) tau: Vec<f64>,
}

/// Returns how far the zero of an encoder may be off where this was read, rad.
pub(super) fn largest_zero(poses: &[Pose]) -> f64 {
    zeros::largest(poses.iter().any(|pose| pose.tip.is_some()))
}

/// Steps of the joints change by this part of themselves, or more, from one row to the next where rows are poses: a motion
/// goes on as it went.
const JUMPS: f64 = 0.5;

/// Returns whether each row is a pose at rest rather than an instant of a motion: rows are far apart and do not follow
/// each other, or speeds were measured and are none.
pub(in super::super::super) fn are_poses(recording: &Recording, n: usize) -> bool {
    if recording.step() <= COARSE {
        return false;
    }
    let Ok(Some(columns)) = recording.group("q", n, Dimension::ANGLE) else { return false };
    let (mut steps, mut bends) = (0.0, 0.0);
    for q in &columns {
        steps += q.windows(2).map(|q| (q[1] - q[0]).abs()).sum::<f64>();
        bends += q.windows(3).map(|q| (q[2] - 2.0 * q[1] + q[0]).abs()).sum::<f64>();
    }
    let is_still = match recording.group("dq", n, Dimension::ANGULAR_SPEED) {
        Ok(Some(speeds)) => {
            let most = speeds.iter().flat_map(|dq| dq.iter()).fold(0.0_f64, |a, b| a.max(b.abs()));
            most * recording.duration() < JUMPS * steps
        }
        _ => false,
    };
    steps > 0.0 && (bends > JUMPS * steps || is_still)
}

/// Returns the poses of a recording.
pub(super) fn poses(data: &Data) -> Vec<Pose> {
    let at = |quantity, index, row: usize| data.measured(quantity, index).map(|v| v[row]);
    let all = |quantity, count: usize, row| -> Option<Vec<f64>> {
        (0..count).map(|index| at(quantity, index, row)).collect()
    };
    let pose = |row| {
        let tip = all(Quantity::Tip, 3, row).map(|tip| Vector3::from_column_slice(&tip));
        let q = all(Quantity::Position, data.n, row)?;
        Some(Pose { q, tip, tau: all(Quantity::Torque, data.n, row).unwrap_or_default() })
    };
    (0..data.n_rows()).filter_map(pose).collect()
}
