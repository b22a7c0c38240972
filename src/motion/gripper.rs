//! What planning a grasp needs to know of the gripper: which links are jaws, and where the palm is.

use nalgebra::{Isometry3, Vector3};

use super::Robot;
use super::robot::{Drive, Joint, Motion};
use super::solid::Solid;

/// The flat of the hand between the jaws, seen from the tool centre point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Palm {
    /// The index of the link that has it.
    pub link: usize,
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

    /// Returns the indices of the links that slide with the gripper's opening, and of what is fixed to them.
    fn fingers(&self) -> impl Iterator<Item = usize> {
        let jaws: Vec<usize> = self.jaws().collect();
        (0..self.links.len()).filter(move |&link| jaws.contains(&self.carrier(link)))
    }

    /// Returns the names of the links that slide with the gripper's opening, and of what is fixed to them.
    pub fn jaw_links(&self) -> impl Iterator<Item = &str> {
        self.fingers().map(|link| self.links[link].name.as_str())
    }

    /// Returns the palm: the foremost face of what carries the jaws; `None` without jaws, a tool, or a face. That is the link they
    /// slide on, and of all that is rigidly joined to it what lies between the jaws: a camera beside them is no palm.
    pub fn palm(&self) -> Option<Palm> {
        let tool = self.tool?;
        let hand = self.hand()?;
        let poses = self.link_poses(&vec![0.0; self.n_joints()], 0.0).ok()?;
        let tool_from_base = poses[tool].inverse();
        let body = self.carrier(hand);
        let joined = (0..self.links.len()).filter(|&link| self.carrier(link) == body);
        let faces = joined.flat_map(|link| {
            let tool_from_link = tool_from_base * poses[link];
            self.links[link].collision.iter().filter_map(move |placed| {
                let (centre, half) = extents(&(tool_from_link * placed.pose), &placed.solid);
                let is_between = centre.x.abs() <= half.x && centre.y.abs() <= half.y;
                let (z, half_height) = (centre.z + half.z, centre.y.abs() + half.y);
                (link == hand || is_between).then_some(Palm { link, z, half_height })
            })
        });
        faces.max_by(|a, b| a.z.total_cmp(&b.z))
    }

    /// Returns the index of the link that the jaws slide on, if there are jaws.
    pub fn hand(&self) -> Option<usize> {
        self.jaws().next().and_then(|jaw| self.links[jaw].parent)
    }

    /// Returns the boxes that hold the fingers' solids, their centres and half extents along the axes of the tool's frame, m, with so
    /// many m between the pads; none without jaws or a tool.
    fn finger_boxes(&self, opening: f64) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let Some(tool) = self.tool else { return Vec::new() };
        let Ok(poses) = self.link_poses(&vec![0.0; self.n_joints()], opening) else {
            return Vec::new();
        };
        let tool_from_base = poses[tool].inverse();
        let mut boxes = Vec::new();
        for link in self.fingers() {
            let tool_from_link = tool_from_base * poses[link];
            let solids = self.links[link].collision.iter();
            boxes.extend(solids.map(|part| extents(&(tool_from_link * part.pose), &part.solid)));
        }
        boxes
    }

    /// Returns the corners of boxes that hold the fingers, m in the frame of the tool, with so many m between the pads; none
    /// without jaws or a tool.
    pub fn finger_corners(&self, opening: f64) -> Vec<Vector3<f64>> {
        let signs = [-1.0, 1.0];
        self.finger_boxes(opening)
            .into_iter()
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

    /// Returns how far the fingertips reach past the tool centre point along the tool's z, m; `None` without a tool or
    /// fingers that have a shape.
    pub fn fingers_ahead(&self) -> Option<f64> {
        let boxes = self.finger_boxes(self.max_opening).into_iter();
        boxes.map(|(centre, half)| centre.z + half.z).max_by(f64::total_cmp)
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
