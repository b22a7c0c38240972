//! The questions asked of a [`CollisionWorld`]: whether a configuration is free, how near what is to what, and how far a
//! motion moves any point.
//!
//! The world answers for one configuration, and is not changed by it. What stands in it, and which pairs are checked, is
//! [`super`]'s; motions between two configurations are `certify`'s and `motions`'.

use std::collections::BTreeMap;

use super::super::body::Body;
use super::super::broad::GROUP;
use super::super::distance::signed_distance;
use super::super::error::Error;
use super::super::nearest::{Found, Look, Nearest, Other};
use super::super::posture::{Posture, are_apart};
use super::CollisionWorld;

/// The smallest distance found, and between what.
#[derive(Debug, Clone, PartialEq)]
pub struct Clearance {
    /// Signed distance, m; infinite when there is nothing to touch.
    pub distance: f64,
    /// A link or the held object.
    pub first: String,
    /// A link or an obstacle.
    pub second: String,
}

impl CollisionWorld<'_> {
    /// Returns whether `q` keeps its margin everywhere. `q` must have one entry per joint.
    pub fn free(&self, q: &[f64]) -> bool {
        self.is_clear(q, self.margin)
    }

    /// Returns whether everything is farther than `room` m at `q`.
    pub(in super::super) fn is_clear(&self, q: &[f64], room: f64) -> bool {
        self.nearest_at(q, room, Look::TillNear).is_none_or(|(distance, ..)| distance > room)
    }

    /// Returns the smallest distance at `q` and between what.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] or [`Error::NotFinite`].
    pub fn clearance(&self, q: &[f64]) -> Result<Clearance, Error> {
        self.looked(q, Look::All)
    }

    /// Returns the smallest distance at `q`, or the first overlap that is met: its distance is minus
    /// infinity, since nobody has to know how deep it is.
    ///
    /// # Errors
    ///
    /// As [`Self::clearance`].
    pub fn clearance_or_overlap(&self, q: &[f64]) -> Result<Clearance, Error> {
        self.looked(q, Look::TillOverlap)
    }

    /// Returns the smallest distance at `q`, as far as is looked, and between what.
    fn looked(&self, q: &[f64], until: Look) -> Result<Clearance, Error> {
        self.robot.check(q)?;
        let Some((distance, first, second)) = self.nearest_at(q, f64::INFINITY, until) else {
            let (first, second) = (String::new(), String::new());
            return Ok(Clearance { distance: f64::INFINITY, first, second });
        };
        let second = match second {
            Other::Part(part) => self.parts[part].name.clone(),
            Other::Obstacle(obstacle) => self.obstacles[obstacle].0.clone(),
        };
        Ok(Clearance { distance, first: self.parts[first].name.clone(), second })
    }

    /// As [`Self::clearance`] without the names: for loops.
    pub fn distance(&self, q: &[f64]) -> f64 {
        self.nearest_at(q, f64::INFINITY, Look::All)
            .map_or(f64::INFINITY, |(distance, ..)| distance)
    }

    /// Returns every pair that is nearer than the margin and `room` m more, with its signed distance, m.
    pub(in super::super) fn touching(&self, q: &[f64], room: f64) -> BTreeMap<Pair, f64> {
        let limit = self.margin + room;
        let mut found = BTreeMap::new();
        let mut look = |pair: Pair, a: &Body, b: &Body| {
            let (centre, radius) = a.bounds();
            if b.distance_to_ball(&centre, radius) > limit {
                return;
            }
            let distance = signed_distance(a, b);
            if distance <= limit {
                let least = found.entry(pair).or_insert(distance);
                *least = distance.min(*least);
            }
        };
        self.solids.at(q, |posture| {
            for &(part, obstacle) in &self.watched {
                for a in &posture.bodies[self.solids.of_part(part)] {
                    look(Pair::Obstacle(part, obstacle), a, &self.obstacles[obstacle].1);
                }
            }
            for &(first, second) in &self.pairs {
                for a in &posture.bodies[self.solids.of_part(first)] {
                    for b in &posture.bodies[self.solids.of_part(second)] {
                        look(Pair::Parts(first, second), a, b);
                    }
                }
            }
        });
        found
    }

    /// Returns the obstacles that are nearer than the margin and `room` m more at `q`, each with its smallest signed
    /// distance, m. `q` must have one entry per joint.
    pub fn nearby(&self, q: &[f64], room: f64) -> BTreeMap<&str, f64> {
        let mut found = BTreeMap::new();
        for (pair, distance) in self.touching(q, room) {
            if let Pair::Obstacle(_, obstacle) = pair {
                let least = found.entry(&*self.obstacles[obstacle].0).or_insert(distance);
                *least = distance.min(*least);
            }
        }
        found
    }

    /// Returns how far, m, any point of the robot may move between two configurations at most.
    pub fn displacement(&self, from: &[f64], to: &[f64]) -> f64 {
        from.iter().zip(to).zip(&self.reach).map(|((a, b), reach)| (a - b).abs() * reach).sum()
    }

    /// Returns the smallest distance below `limit` at `q`.
    pub(in super::super) fn nearest_at(&self, q: &[f64], limit: f64, until: Look) -> Option<Found> {
        self.solids.at(q, |posture| self.nearest(posture, limit, until))
    }

    /// Returns the smallest distance below `limit`.
    fn nearest(&self, posture: &Posture, limit: f64, until: Look) -> Option<Found> {
        let mut search = Nearest::below(limit, until);
        let Posture { bodies, balls, wholes, .. } = posture;
        // From the hand backwards: what is far out collides first.
        let groups = self.crowd.len();
        for part in (0..self.parts.len()).rev() {
            for group in (0..groups).rev() {
                let mut watched = self.masks[part * groups + group];
                let solids = self.solids.of_part(part);
                if watched != 0 && solids.len() > 1 {
                    let (centre, radius) = &wholes[part];
                    watched &= self.crowd.near(group, centre, radius + search.bound);
                }
                if watched == 0 {
                    continue;
                }
                for at in solids {
                    let (centre, radius) = &balls[at];
                    let reach = radius + search.bound;
                    let mut near = watched & self.crowd.near(group, centre, reach);
                    while near != 0 {
                        let lane = near.ilog2();
                        near ^= 1 << lane;
                        let obstacle = group * GROUP + lane as usize;
                        let other = Other::Obstacle(obstacle);
                        if search.look(part, &bodies[at], &self.obstacles[obstacle].1, other) {
                            return search.best;
                        }
                    }
                }
            }
        }
        for &(first, second) in self.pairs.iter().rev() {
            if are_apart(&wholes[first], &wholes[second], search.bound) {
                continue;
            }
            for a in self.solids.of_part(first) {
                if are_apart(&balls[a], &wholes[second], search.bound) {
                    continue;
                }
                for b in self.solids.of_part(second) {
                    if are_apart(&balls[a], &balls[b], search.bound) {
                        continue;
                    }
                    if search.look(first, &bodies[a], &bodies[b], Other::Part(second)) {
                        return search.best;
                    }
                }
            }
        }
        search.best
    }
}

/// Two things that may touch, by their places in a [`CollisionWorld`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(in super::super) enum Pair {
    /// Two parts of the robot, or one and what it holds.
    Parts(usize, usize),
    /// A part and an obstacle.
    Obstacle(usize, usize),
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::motion::collision::Obstacle;
    use crate::motion::descent::random_configuration;
    use crate::motion::robot::Robot;
    use crate::motion::solid::Solid;
    use crate::world::Shape;
    use crate::world::frame::Pose;

    /// Whatever the broad phase, the planes and the capsules leave out, the exact distances of all pairs confirm.
    #[test]
    fn what_is_called_free_is_free_by_the_exact_distances_of_all_pairs() {
        let robot = Robot::gen3();
        let mut random = StdRng::seed_from_u64(31);
        let (mut free, mut touching) = (0, 0);
        for scene in 0..40 {
            let mut world = CollisionWorld::new(&robot);
            for k in 0..9 {
                let mut x = |reach: f64| random.random_range(-reach..reach);
                let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::new(
                    x(3.0),
                    x(3.0),
                    x(3.0),
                ));
                let at = Vector3::new(x(0.9), x(0.9), 0.4 + x(0.7));
                let size =
                    Vector3::new(0.02, 0.02, 0.02) + Vector3::new(x(0.2), x(0.2), x(0.2)).abs();
                let (radius, half) = (0.5 * size.x, size.z);
                let solid = match k % 4 {
                    0 => Solid::Cuboid { half: size },
                    1 => Solid::Cylinder { radius, half },
                    2 => Solid::Capsule { radius, half },
                    _ => Solid::Sphere { radius },
                };
                let pose = Isometry3::from_parts(at.into(), turn);
                world.add(&Obstacle::new(&format!("o{k}"), solid, pose));
            }
            world.set_margin([0.0, 0.003, 0.05][scene % 3]);
            if scene % 2 == 0 {
                let shape = Shape::Cylinder { radius: 0.03, height: 0.12 };
                world.attach("jar", &shape, Pose::identity());
                world.set_opening(0.04);
            }
            for _ in 0..250 {
                let q = random_configuration(&robot, &mut random);
                let all = world.touching(&q, f64::INFINITY);
                let least = all.values().copied().fold(f64::INFINITY, f64::min);
                if world.free(&q) {
                    assert!(least > world.margin() - 1e-9, "{q:?}: {least}");
                    free += 1;
                } else {
                    // GJK may stop some ten micrometres short.
                    assert!(least < world.margin() + 1e-4, "{q:?}: {least}");
                    touching += 1;
                }
                // Which of several overlaps is the deepest is not searched for to the end.
                let distance = world.distance(&q);
                let same =
                    if least > 0.0 { (distance - least).abs() < 1e-9 } else { distance <= 0.0 };
                assert!(same, "{q:?}: {distance} {least}");
            }
        }
        assert!(free > 3000 && touching > 3000, "{free} {touching}");
    }
}
