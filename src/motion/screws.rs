//! A chain of turning joints as lines: where each axis lies while all joints read zero. Nothing is solved here.
//!
//! Source: Murray, Li and Sastry, *A Mathematical Introduction to Robotic Manipulation*, 1994, §3.2 (product of
//! exponentials).

use nalgebra::{Isometry3, Vector3};

use super::frames::Frame;
use super::robot::{Drive, Motion, Robot};

/// The axes of a robot's joints, in base coordinates.
#[derive(Debug, Clone)]
pub(super) struct Screws {
    /// Unit directions, in the order of the joints.
    pub(super) axes: Vec<Vector3<f64>>,
    /// A point on each, m.
    pub(super) points: Vec<Vector3<f64>>,
    pub(super) tip: Frame,
}

impl Screws {
    /// Returns the axes of a robot whose joints all turn, each by its own angle and in the order of the chain.
    pub(super) fn of(robot: &Robot) -> Option<Self> {
        let (mut axes, mut points) = (Vec::new(), Vec::new());
        let zeros = vec![0.0; robot.n_joints()];
        let mut pose = Isometry3::identity();
        for &link in &robot.path {
            let joint = &robot.links[link].joint;
            pose *= joint.parent_from_link(joint.value(&zeros, 0.0));
            match joint.drive {
                Drive::None => {}
                Drive::Joint { index, multiplier, .. }
                    if joint.motion == Motion::Turn
                        && index == axes.len()
                        && (multiplier.abs() - 1.0).abs() < f64::EPSILON =>
                {
                    axes.push(pose.rotation * joint.axis.into_inner() * multiplier);
                    points.push(pose.translation.vector);
                }
                _ => return None,
            }
        }
        (axes.len() == zeros.len()).then_some(Self { axes, points, tip: Frame::of(&pose) })
    }
}
