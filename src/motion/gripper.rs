//! What planning a grasp needs to know of the gripper: which links are jaws, and where the palm is.

use super::Robot;
use super::robot::Drive;
use super::solid::Solid;

/// The flat of the hand between the jaws, seen from the tool centre point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Palm {
    /// Where it is along the tool's z, m; negative, since it lies behind.
    pub z: f64,
    /// Half its extent along the tool's y, m.
    pub half_height: f64,
}

impl Robot {
    /// Returns the names of the links that the gripper's opening moves.
    pub fn jaw_links(&self) -> impl Iterator<Item = &str> {
        let moved = |drive| matches!(drive, Drive::Jaw { multiplier, .. } if multiplier != 0.0);
        self.links.iter().filter(move |link| moved(link.joint.drive)).map(|link| link.name.as_str())
    }

    /// Returns the palm: the foremost face of what carries the jaws; `None` without jaws or a tool.
    pub fn palm(&self) -> Option<Palm> {
        let tool = self.tool?;
        let jaw = self.links.iter().find(|link| matches!(link.joint.drive, Drive::Jaw { .. }))?;
        let hand = jaw.parent?;
        let poses = self.link_poses(&vec![0.0; self.n_joints()], 0.0).ok()?;
        let tool_from_hand = poses[tool].inverse() * poses[hand];
        let faces = self.links[hand].collision.iter().map(|placed| {
            let pose = tool_from_hand * placed.pose;
            let reach = match placed.solid {
                Solid::Sphere { radius } => [radius; 3],
                Solid::Capsule { radius, half } => [radius, radius, half + radius],
                Solid::Cylinder { radius, half } => [radius, radius, half],
                Solid::Cuboid { half } => [half.x, half.y, half.z],
            };
            // Half extents along the tool's axes of a box of this reach, however it is turned.
            let turn = pose.rotation.to_rotation_matrix();
            let along =
                |axis: usize| -> f64 { (0..3).map(|k| turn[(axis, k)].abs() * reach[k]).sum() };
            let centre = pose.translation.vector;
            Palm { z: centre.z + along(2), half_height: centre.y.abs() + along(1) }
        });
        faces.max_by(|a, b| a.z.total_cmp(&b.z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gen3_has_two_jaws_and_a_palm_30_mm_behind_its_tool_point() {
        let robot = Robot::gen3();
        let jaws: Vec<_> = robot.jaw_links().collect();
        assert_eq!(jaws, ["left_jaw_link", "right_jaw_link"]);
        // Box of the gripper's base: 0.0437 + 0.0926/2 = 0.09 m ahead of the flange, the tool at 0.12 m.
        let palm = robot.palm().unwrap();
        assert!((palm.z + 0.03).abs() < 1e-9 && (palm.half_height - 0.0375).abs() < 1e-9);
    }
}
