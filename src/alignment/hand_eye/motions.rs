//! What a robot's motions can tell: how far it turned about which axes, and what further pictures should add.
//!
//! Between two pictures the wrist turns by some angle about some axis. Where the camera sits follows from such turns: a turn by
//! `θ` moves it by `2 sin(θ/2)` times its distance from the axis, so nothing is learnt along the axis, and little from
//! small turns. Axes and angles are those of all pairs, in the frame that the camera is fixed to.
//!
//! Source: Tsai and Lenz, "A New Technique for Fully Autonomous and Efficient 3D Robotics Hand/Eye Calibration", 1989, §III.

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::error::Error;
use super::types::Mount;

/// How the robot moved between pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motions {
    /// Root mean square turn of a pair of pictures about each of three axes, most first, rad.
    pub turns: [f64; 3],
    /// The axes, in the frame that the camera is fixed to.
    pub axes: [Vector3<f64>; 3],
    /// Root mean square distance of the flange from its mean place, m.
    pub travel: f64,
}

/// Turns below this are none, rad (2°). Derived: 1 mm of disagreement is then 1 mm / 0.035 = 29 mm of the camera's place.
const NO_TURN: f64 = 0.035;
/// Turns below this are small, rad (10°): 1 mm of disagreement is 6 mm of the camera's place.
const SMALL: f64 = 0.175;

impl Motions {
    /// Returns how these flange poses (`base_from_flange`) move a camera on such a mount.
    pub(super) fn of(mount: Mount, robot: &[Isometry3<f64>]) -> Self {
        let mut scatter = Matrix3::zeros();
        let mut pairs = 0;
        for (i, a) in robot.iter().enumerate() {
            for b in &robot[..i] {
                let turn = match mount {
                    Mount::Wrist => b.rotation.inverse() * a.rotation,
                    Mount::Fixed => b.rotation * a.rotation.inverse(),
                };
                let v = turn.scaled_axis();
                scatter += v * v.transpose();
                pairs += 1;
            }
        }
        let eigen = (scatter / f64::from(pairs.max(1))).symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let n = robot.len().max(1) as f64;
        let middle = robot.iter().map(|a| a.translation.vector).sum::<Vector3<f64>>() / n;
        let far = robot.iter().map(|a| (a.translation.vector - middle).norm_squared()).sum::<f64>();
        Self {
            turns: order.map(|k| eigen.eigenvalues[k].max(0.0).sqrt()),
            axes: order.map(|k| signed(eigen.eigenvectors.column(k).into())),
            travel: (far / n).sqrt(),
        }
    }

    /// Refuses motions from which nobody can tell where the camera is.
    pub(super) fn checked(self, mount: Mount) -> Result<Self, Error> {
        let [about, across, _] = self.turns;
        if about < NO_TURN {
            return Err(Error::NotTurned { largest: about });
        }
        if across < NO_TURN {
            return Err(Error::OneAxis { mount, axis: self.axes[0], about, across });
        }
        Ok(self)
    }

    /// Returns the axis about which the wrist should turn more, if one is wanting: it lies across the one that has most.
    pub fn wanting(&self) -> Option<(Vector3<f64>, f64)> {
        (self.turns[1] < SMALL).then_some((self.axes[1], self.turns[1]))
    }
}

/// The axis of the two that points along its largest part.
fn signed(axis: Vector3<f64>) -> Vector3<f64> {
    if axis[axis.iamax()] < 0.0 { -axis } else { axis }
}
