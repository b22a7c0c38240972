//! What planning a grasp needs to know of the gripper: which links are jaws, and where the palm is.

use nalgebra::{Isometry3, Vector3};

use super::Robot;
use super::robot::{Drive, Joint, Motion};
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
    /// Returns the indices of the links that slide with the gripper's opening.
    pub fn jaws(&self) -> impl Iterator<Item = usize> {
        let slides = |joint: &Joint| {
            joint.motion == Motion::Slide && matches!(joint.drive, Drive::Jaw { .. })
        };
        (0..self.links.len()).filter(move |&link| slides(&self.links[link].joint))
    }

    /// Returns the names of the links that slide with the gripper's opening, and of what is fixed to them.
    pub fn jaw_links(&self) -> impl Iterator<Item = &str> {
        let jaws: Vec<usize> = self.jaws().collect();
        let is_jaw = move |link: usize| {
            let mut at = link;
            while let (Motion::Fixed, Some(parent)) =
                (self.links[at].joint.motion, self.links[at].parent)
            {
                at = parent;
            }
            jaws.contains(&at)
        };
        (0..self.links.len())
            .filter(move |&link| is_jaw(link))
            .map(|link| self.links[link].name.as_str())
    }

    /// Returns the palm: the foremost face of what carries the jaws; `None` without jaws or a tool.
    pub fn palm(&self) -> Option<Palm> {
        let tool = self.tool?;
        let hand = self.links[self.jaws().next()?].parent?;
        let poses = self.link_poses(&vec![0.0; self.n_joints()], 0.0).ok()?;
        let tool_from_hand = poses[tool].inverse() * poses[hand];
        let faces = self.links[hand].collision.iter().map(|placed| {
            let (centre, along) = extents(&(tool_from_hand * placed.pose), &placed.solid);
            Palm { z: centre.z + along.z, half_height: centre.y.abs() + along.y }
        });
        faces.max_by(|a, b| a.z.total_cmp(&b.z))
    }

    /// Returns the corners of boxes that hold the fingers, m in the frame of the tool, with so many m between the pads; none
    /// without jaws or a tool.
    pub fn finger_corners(&self, opening: f64) -> Vec<Vector3<f64>> {
        let Some(tool) = self.tool else { return Vec::new() };
        let Ok(poses) = self.link_poses(&vec![0.0; self.n_joints()], opening) else {
            return Vec::new();
        };
        let tool_from_base = poses[tool].inverse();
        let fingers: Vec<&str> = self.jaw_links().collect();
        let links = (0..self.links.len()).filter(|at| fingers.contains(&&*self.links[*at].name));
        let boxes = links.flat_map(|link| {
            let tool_from_link = tool_from_base * poses[link];
            let solids = self.links[link].collision.iter();
            solids.map(move |placed| extents(&(tool_from_link * placed.pose), &placed.solid))
        });
        let signs = [-1.0, 1.0];
        boxes
            .flat_map(|(centre, half)| {
                signs.into_iter().flat_map(move |x| {
                    signs.into_iter().flat_map(move |y| {
                        let corner = move |z| half.component_mul(&Vector3::new(x, y, z));
                        signs.into_iter().map(move |z| centre + corner(z))
                    })
                })
            })
            .collect()
    }

    /// Returns how far the fingertips reach past the tool centre point along the tool's z, m; `None` without jaws
    /// or a tool.
    pub fn fingers_ahead(&self) -> Option<f64> {
        let tool = self.tool?;
        let poses = self.link_poses(&vec![0.0; self.n_joints()], self.max_opening).ok()?;
        let tool_from_base = poses[tool].inverse();
        let tips = self.jaws().flat_map(|jaw| {
            let tool_from_jaw = tool_from_base * poses[jaw];
            self.links[jaw].collision.iter().map(move |placed| {
                let (centre, along) = extents(&(tool_from_jaw * placed.pose), &placed.solid);
                centre.z + along.z
            })
        });
        tips.max_by(f64::total_cmp)
    }
}

/// Returns the centre of a solid and half extents along the frame's axes of the box that holds it, m.
fn extents(pose: &Isometry3<f64>, solid: &Solid) -> (Vector3<f64>, Vector3<f64>) {
    let reach = match *solid {
        Solid::Sphere { radius } => Vector3::repeat(radius),
        Solid::Capsule { radius, half } => Vector3::new(radius, radius, half + radius),
        Solid::Cylinder { radius, half } => Vector3::new(radius, radius, half),
        Solid::Cuboid { half } => half,
    };
    let turn = pose.rotation.to_rotation_matrix();
    (pose.translation.vector, turn.matrix().abs() * reach)
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
        // Boxes of the jaws: 0.1336 - 0.0136 + 0.0647/2 = 0.15235 m ahead of the flange.
        assert!((robot.fingers_ahead().unwrap() - 0.03235).abs() < 1e-9);
    }
}
