//! How far a unit of each joint can move any point of a robot.

use super::body::Body;
use super::robot::{Drive, Motion, Robot};

/// Returns per joint, m/rad or m/m, how far any point beyond it can move for a unit of the joint: link offsets and
/// solids added up. Of each part the link it moves with is given, and its solids in the link's frame.
pub(super) fn reaches<'p>(
    robot: &Robot,
    opening: f64,
    parts: impl Iterator<Item = (usize, &'p [Body])>,
) -> Vec<f64> {
    let links = &robot.links;
    let mut extent = vec![0.0_f64; links.len()];
    for (link, solids) in parts {
        for solid in solids {
            let (centre, radius) = solid.bounds();
            extent[link] = extent[link].max(centre.norm() + radius);
        }
    }
    for at in (1..links.len()).rev() {
        let joint = &links[at].joint;
        let slide = match (joint.motion, joint.drive) {
            (Motion::Slide, Drive::Joint { .. }) => joint.range.0.abs().max(joint.range.1.abs()),
            (Motion::Slide, _) => opening,
            _ => 0.0,
        };
        let beyond = joint.parent_from_link.translation.vector.norm() + slide + extent[at];
        let parent = links[at].parent.expect("only the root has no parent");
        extent[parent] = extent[parent].max(beyond);
    }
    let mut reach = vec![0.0; robot.n_joints()];
    for (at, link) in links.iter().enumerate() {
        if let Drive::Joint { index, multiplier, .. } = link.joint.drive {
            let arm = if link.joint.motion == Motion::Turn { extent[at] } else { 1.0 };
            reach[index] += multiplier.abs() * arm;
        }
    }
    reach
}
