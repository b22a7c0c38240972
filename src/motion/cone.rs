//! A constraint on a motion: a direction of the tip stays within a cone, as of a vessel carried upright.
//!
//! Source: projection onto a constraint: Berenson, Srinivasa, Ferguson and Kuffner, "Manipulation planning on
//! constraint manifolds", ICRA 2009.

use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};

use super::ik::Solver;
use super::polyline::l2;
use super::reserve::Reserve;
use super::robot::Robot;
use crate::world::frame::Pose;

/// A direction of the tip that must stay within a cone: a vessel carried upright.
#[derive(Debug, Clone, Copy)]
pub struct Cone {
    /// The direction that is watched, in the flange frame.
    pub axis_in_flange: Unit<Vector3<f64>>,
    /// The cone's axis in base coordinates, usually up.
    pub up_in_base: Unit<Vector3<f64>>,
    /// Half the cone's opening, rad.
    pub max_angle: f64,
}

impl Cone {
    /// Returns the angle between the two directions at `q`, rad.
    pub fn angle(&self, robot: &Robot, q: &[f64]) -> f64 {
        let axis = robot.forward_unchecked(q).rotation * self.axis_in_flange.into_inner();
        axis.dot(&self.up_in_base).clamp(-1.0, 1.0).acos()
    }

    /// Returns whether `q` keeps inside the cone.
    pub fn holds(&self, robot: &Robot, q: &[f64]) -> bool {
        let axis = robot.forward_unchecked(q).rotation * self.axis_in_flange.into_inner();
        axis.dot(&self.up_in_base) >= self.max_angle.cos() - 1e-12
    }

    /// Turns the tip about its own origin until the axis is well inside the cone, joints staying as near
    /// as they can; `None` if no joint positions do that.
    pub(super) fn project(&self, solver: &Solver<'_>, q: &[f64]) -> Option<Vec<f64>> {
        let robot = solver.robot();
        let tip = robot.forward_unchecked(q);
        let axis = tip.rotation * self.axis_in_flange.into_inner();
        let angle = axis.dot(&self.up_in_base).clamp(-1.0, 1.0).acos();
        if angle <= self.max_angle {
            return Some(q.to_vec());
        }
        let turn = axis.cross(&self.up_in_base);
        let turn = Unit::try_new(turn, 1e-9).unwrap_or_else(|| {
            // Upside down: any level axis will do.
            Unit::new_normalize(self.up_in_base.cross(&Vector3::new(0.6, 0.64, 0.48)))
        });
        let turn = UnitQuaternion::from_axis_angle(&turn, angle - 0.5 * self.max_angle);
        let target = Pose::new(Isometry3::from_parts(tip.translation, turn * tip.rotation));
        let candidates = if solver.closed_form().is_some() {
            solver.at_joint_3(&target, q[2], q)
        } else {
            solver.descend_from(&target, q, Reserve::NONE).into_iter().collect()
        };
        candidates.into_iter().min_by(|a, b| l2(a, q).total_cmp(&l2(b, q)))
    }
}
