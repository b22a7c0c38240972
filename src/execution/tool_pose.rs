//! A pose of the tool as scripts hold it: a place, where the tool points as seen from above, and how far down.

use nalgebra::{UnitQuaternion, UnitVector3, Vector3};

use crate::world::Pose;
use crate::world::frame::{Tool, World};

use super::plan::side_pose;

/// A tool nearer to the vertical than this points nowhere as seen from above: the side its fingers open to tells.
const UPRIGHT: f64 = 1e-3;

/// A pose of the tool in a script's hands.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ToolPose(pub(super) Pose<World, Tool>);

impl ToolPose {
    /// The tool at `at` m, pointing along `heading` rad as seen from above and `pitch` rad down, its jaws opening level.
    pub(super) fn new(at: [f64; 3], heading: f64, pitch: f64) -> Self {
        Self(side_pose(at.into(), heading, pitch))
    }

    pub(super) fn at(&self) -> [f64; 3] {
        self.0.origin().into()
    }

    pub(super) fn heading(&self) -> f64 {
        let ahead = self.0.axis(2);
        if ahead.xy().norm() > UPRIGHT {
            return ahead.y.atan2(ahead.x);
        }
        // The jaws open to the side of where the tool pointed before it was pitched down.
        let aside = self.0.axis(0).cross(&Vector3::z());
        aside.y.atan2(aside.x)
    }

    pub(super) fn pitch(&self) -> f64 {
        (-self.0.axis(2).z).clamp(-1.0, 1.0).asin()
    }

    /// Moved by so many m in the world.
    pub(super) fn moved(&self, by: [f64; 3]) -> Self {
        Self(Pose::from_parts(self.0.origin() + Vector3::from(by), self.0.rotation()))
    }

    /// Turned in its place about an axis of the world by `angle` rad.
    pub(super) fn turned(&self, axis: UnitVector3<f64>, angle: f64) -> Self {
        let turn = UnitQuaternion::from_axis_angle(&axis, angle);
        Self(Pose::from_parts(self.0.origin(), turn * self.0.rotation()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_pose_is_made_of_is_read_from_it() {
        for (heading, pitch) in [(0.3, 0.0), (-2.0, 0.9), (1.1, std::f64::consts::FRAC_PI_2)] {
            let pose = ToolPose::new([0.5, 0.1, 0.2], heading, pitch);
            assert!((pose.heading() - heading).abs() < 1e-9, "{heading}: {}", pose.heading());
            assert!((pose.pitch() - pitch).abs() < 1e-7, "{pitch}: {}", pose.pitch());
        }
        let turned = ToolPose::new([0.5, 0.1, 0.2], 0.3, 0.0).turned(Vector3::z_axis(), 0.4);
        assert!((turned.heading() - 0.7).abs() < 1e-9);
        let moved = turned.moved([0.0, 0.0, 0.1]).at();
        assert!((moved[2] - 0.3).abs() < 1e-12 && (moved[0] - 0.5).abs() < 1e-12);
    }
}
