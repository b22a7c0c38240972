//! Which parts of a robot are checked against each other.
//!
//! Parts that are rigidly joined, neighbours across one joint, and the two jaws are not; nor what the robot's
//! side file leaves out, or what overlaps nearly everywhere where there is no side file.

use rand::SeedableRng;
use rand::rngs::StdRng;

use super::body::Body;
use super::descent::random_configuration;
use super::distance::distance_or_overlap;
use super::posture::{Solids, are_apart};
use super::robot::Robot;

/// Numbers the sets of links that are rigidly joined, link by link.
pub(super) fn rigid_sets(robot: &Robot) -> Vec<usize> {
    (0..robot.links.len()).map(|link| robot.carrier(link)).collect()
}

/// Returns the pairs that are checked of parts that move with these links.
pub(super) fn checked_pairs(
    robot: &Robot,
    part_links: &[usize],
    solids: &Solids,
) -> Vec<(usize, usize)> {
    let links = &robot.links;
    let set = rigid_sets(robot);
    let above = |link: usize| links[set[link]].parent.map(|parent| set[parent]);
    let jaw = |link: usize| links[set[link]].joint.drive.is_of_gripper();
    let mut pairs = Vec::new();
    for (first, &a) in part_links.iter().enumerate() {
        for (second, &b) in part_links.iter().enumerate().skip(first + 1) {
            let joined = set[a] == set[b]
                || above(a) == Some(set[b])
                || above(b) == Some(set[a])
                || (jaw(a) && jaw(b));
            if !joined && !robot.unchecked.contains(&(a.min(b), a.max(b))) {
                pairs.push((first, second));
            }
        }
    }
    if !robot.has_side_file {
        let mut touches = always_touching(robot, solids, &pairs).into_iter();
        pairs.retain(|_| !touches.next().unwrap_or(false));
    }
    pairs
}

/// Whether two parts overlap nearly everywhere, as neighbours of coarse solids do: then the overlap
/// is the model's, not the motion's. Decided on 100 seeded configurations, as `MoveIt`'s assistant does.
fn always_touching(robot: &Robot, solids: &Solids, pairs: &[(usize, usize)]) -> Vec<bool> {
    const SAMPLES: usize = 100;
    let mut random = StdRng::seed_from_u64(0);
    let mut touching = vec![0; pairs.len()];
    for _ in 0..SAMPLES {
        let q = random_configuration(robot, &mut random);
        solids.at(&q, |posture| {
            for (count, &(first, second)) in touching.iter_mut().zip(pairs) {
                if are_apart(&posture.wholes[first], &posture.wholes[second], 0.0) {
                    continue;
                }
                let overlaps = |a: &Body| {
                    posture.bodies[solids.of_part(second)]
                        .iter()
                        .any(|b| distance_or_overlap(a, b).is_none_or(|distance| distance <= 0.0))
                };
                *count += usize::from(posture.bodies[solids.of_part(first)].iter().any(overlaps));
            }
        });
    }
    touching.into_iter().map(|count| count * 100 >= SAMPLES * 95).collect()
}
