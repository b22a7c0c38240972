//! A path pulled taut: corners slide over what the path lies on.
//!
//! A straight motion from one place of a path to another (`simplify`) leaves corners where they are once their edges touch something; a
//! string that is pulled goes on sliding there. So each corner is tried, in turn and a few times, where both its edges pull it to and chance
//! turns that, and stays there if the way past it is shorter and free. All chance comes from the seed.
//!
//! Source: Şucan, Moll and Kavraki, "The Open Motion Planning Library", IEEE Robotics & Automation Magazine 2012 (its
//! `PathSimplifier::perturbPath` perturbs places of a path by chance; the pull is added here).

use rand::RngExt;
use rand::rngs::StdRng;

use super::error::Error;
use super::motions::Motions;
use super::polyline::{l2, mix};

/// How often each corner is tried. Chosen: on the Panda's problems paths are 2.8 % shorter for a tenth more looks; with 16 times 4 % for a fifth.
const TRIES: usize = 8;
/// The step of the first try, and the longest, as a share of how far the corner lies from the way past it; by how much it grows
/// and shrinks.
const FIRST: f64 = 0.5;
const LONGEST: f64 = 1.0;
const GROWS: f64 = 1.5;
const SHRINKS: f64 = 0.7;
/// A corner whose edges are no more than this longer than the straight way past it, rad, stays.
const TAUT: f64 = 0.01;
/// What a try must gain at least, rad.
const GAIN: f64 = 1e-3;

/// Slides the corners of a path to where it is shorter.
///
/// # Errors
///
/// [`Error::Spent`] and [`Error::Cancelled`].
pub(super) fn tautened(
    motions: &mut Motions<'_>,
    corners: &mut [Vec<f64>],
    random: &mut StdRng,
) -> Result<(), Error> {
    let mut shares = vec![FIRST; corners.len()];
    for _ in 0..TRIES {
        for at in 1..corners.len().saturating_sub(1) {
            let [before, corner, after] = [&corners[at - 1], &corners[at], &corners[at + 1]];
            let way = l2(before, corner) + l2(corner, after);
            if way - l2(before, after) < TAUT {
                continue;
            }
            let moved = pulled([before, corner, after], shares[at], random);
            let is_better = l2(before, &moved) + l2(&moved, after) < way - GAIN
                && motions.robot.outside_limits(&moved, 0.0).is_none()
                && motions.are_free(before, &moved)?
                && motions.are_free(&moved, after)?;
            if is_better {
                corners[at] = moved;
            }
            let share = &mut shares[at];
            *share = (*share * if is_better { GROWS } else { SHRINKS }).min(LONGEST);
        }
    }
    Ok(())
}

/// Returns where a corner comes to that is moved by a share of its distance to the way past it: as much by the pull of both edges
/// as by chance.
fn pulled([before, corner, after]: [&Vec<f64>; 3], share: f64, random: &mut StdRng) -> Vec<f64> {
    let (to, on) = (l2(corner, before), l2(corner, after));
    let ends = before.iter().zip(after).zip(corner);
    let pull = unit(ends.map(|((a, b), q)| (a - q) / to + (b - q) / on).collect());
    let chance = unit(corner.iter().map(|_| random.random_range(-1.0..1.0)).collect());
    let size = share * sag([before, corner, after]);
    let moved = corner.iter().zip(pull.iter().zip(chance));
    moved.map(|(q, (pull, chance))| q + size * (pull + chance)).collect()
}

/// Returns how far a corner lies from the straight way past it, rad.
fn sag([before, corner, after]: [&Vec<f64>; 3]) -> f64 {
    let straight = l2(before, after).max(f64::MIN_POSITIVE);
    let ends = before.iter().zip(after).zip(corner);
    let along = ends.map(|((a, b), q)| (q - a) * (b - a)).sum::<f64>() / (straight * straight);
    l2(corner, &mix(before, after, along.clamp(0.0, 1.0)))
}

/// Returns a vector of length one in the same direction.
fn unit(mut vector: Vec<f64>) -> Vec<f64> {
    let norm = vector.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
    for x in &mut vector {
        *x /= norm;
    }
    vector
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;
    use rand::SeedableRng;

    use super::super::budget::Budget;
    use super::super::collision::{CollisionWorld, Obstacle};
    use super::super::polyline::length;
    use super::super::robot::Robot;
    use super::super::solid::Solid;
    use super::*;

    /// Two edges around a ball on the straight way, the corner between them too far from it and off to one side.
    #[test]
    fn a_corner_slides_over_what_it_lies_on() {
        let robot = Robot::gen3();
        let start = robot.pose("home").unwrap().to_vec();
        let mut goal = start.clone();
        goal[0] += 1.2;
        let middle = mix(&start, &goal, 0.5);
        let tip = robot.forward(&middle).unwrap();
        let mut world = CollisionWorld::new(&robot);
        let at = Isometry3::translation(tip.origin().x, tip.origin().y, tip.origin().z);
        world.add(&Obstacle::new("ball", Solid::Capsule { radius: 0.05, half: 0.001 }, at));
        let mut corner = middle;
        for (joint, by) in [(0, 0.15), (1, -0.7), (4, 0.3)] {
            corner[joint] += by;
        }
        let mut corners = vec![start, corner, goal];
        let budget = Budget::new(|| false);
        let mut motions = Motions::new(&robot, &world, None, (0.0, 0.02), &budget);
        assert!(!motions.are_free(&corners[0], &corners[2]).unwrap());
        assert!(motions.are_free(&corners[0], &corners[1]).unwrap());
        assert!(motions.are_free(&corners[1], &corners[2]).unwrap());
        let (before, straight) = (length(&corners), l2(&corners[0], &corners[2]));
        tautened(&mut motions, &mut corners, &mut StdRng::seed_from_u64(1)).unwrap();
        let detour = (length(&corners) - straight) / (before - straight);
        assert!(detour < 0.8, "{detour}");
        assert!(motions.are_free(&corners[0], &corners[1]).unwrap());
        assert!(motions.are_free(&corners[1], &corners[2]).unwrap());
    }

    #[test]
    fn what_is_taut_stays() {
        let robot = Robot::gen3();
        let world = CollisionWorld::new(&robot);
        let start = robot.pose("home").unwrap().to_vec();
        let mut goal = start.clone();
        goal[3] += 0.5;
        let straight = vec![start.clone(), mix(&start, &goal, 0.4), goal];
        let budget = Budget::new(|| false);
        let mut motions = Motions::new(&robot, &world, None, (0.0, 0.02), &budget);
        let mut corners = straight.clone();
        tautened(&mut motions, &mut corners, &mut StdRng::seed_from_u64(1)).unwrap();
        assert_eq!(corners, straight);
    }
}
