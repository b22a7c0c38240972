//! The smallest distance to anything along a whole motion, not only at samples.
//!
//! What is clear at the middle of an interval by more than anything moves on the way to its ends holds nothing nearer; the rest is
//! halved, all intervals of a size together, so that what is not known for certain shrinks evenly.
//!
//! Source: conservative advancement; Schwarzer, Saha and Latombe, "Adaptive dynamic collision checking", T-RO 2005.

use super::collision::CollisionWorld;
use super::nearest::Look;

/// The smallest distance is found to so much, m.
const FOUND_TO: f64 = 1e-4;
/// Where one distance stays the smallest all the way it would take ever more looks: after so many it is off by what moves
/// between two of them, some tenths of a millimetre.
const PATIENCE: usize = 10_000;

impl CollisionWorld<'_> {
    /// Returns the smallest signed distance to anything between the first and the last of `instants` (increasing), to 0.1 mm, m;
    /// infinite when there is nothing to touch.
    ///
    /// `at` tells the joint positions at an instant, rad. The second derivative of no joint goes beyond that of `bend`
    /// (rad per square of the unit of `instants`; 0 for straight motions) between two neighbours of them.
    pub fn closest_approach(
        &self,
        instants: &[f64],
        bend: &[f64],
        at: &dyn Fn(f64) -> Vec<f64>,
    ) -> f64 {
        let below = |q: &[f64], limit: f64| {
            let found = self.nearest_at(q, limit, Look::All).map(|(distance, ..)| distance);
            found.filter(|distance| *distance < limit)
        };
        let mut least = f64::INFINITY;
        for &instant in instants {
            least = below(&at(instant), least).unwrap_or(least);
        }
        let straight = vec![0.0; bend.len()];
        let mut open: Vec<[f64; 2]> = instants.windows(2).map(|pair| [pair[0], pair[1]]).collect();
        let mut looked = 0;
        while !open.is_empty() && looked < PATIENCE {
            looked += open.len();
            let mut halves = Vec::new();
            for [from, to] in open {
                let middle = 0.5 * (from + to);
                let q = at(middle);
                // A curve is off its chord by an eighth of its second derivative times the square of its length.
                let half = to - middle;
                let bow: Vec<f64> = bend.iter().map(|bend| bend * half * half / 8.0).collect();
                let chord = self.displacement(&q, &at(from)).max(self.displacement(&q, &at(to)));
                let moved = chord + self.displacement(&straight, &bow);
                if let Some(distance) = below(&q, least - FOUND_TO + moved) {
                    least = least.min(distance);
                    halves.extend([[from, middle], [middle, to]]);
                }
            }
            open = halves;
        }
        least
    }
}

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::super::batch::tests::{of_spheres, scene};
    use super::*;
    use crate::motion::Robot;
    use crate::motion::descent::random_configuration;
    use crate::motion::polyline::mix;
    use crate::motion::trajectory::{Limits, Trajectory};

    /// A plan told 4.65 mm by samples 10 ms apart, and came to 3.03 mm.
    #[test]
    fn the_smallest_distance_is_that_of_the_whole_motion() {
        let mut random = StdRng::seed_from_u64(8);
        let mut missed = 0;
        for robot in [Robot::gen3(), of_spheres()] {
            let limits = Limits::of(&robot);
            let mut tried = 0;
            while tried < 10 {
                let world = scene(&robot, &mut random);
                let a = random_configuration(&robot, &mut random);
                let b = random_configuration(&robot, &mut random);
                let b = mix(&a, &b, random.random_range(0.1..0.5));
                if !world.certify(&a, &b) {
                    continue;
                }
                tried += 1;
                let timed =
                    Trajectory::through_corners(&[a.clone(), b.clone()], &limits, 0.2, &|_, _| {
                        true
                    })
                    .unwrap();
                let step = 0.001 * timed.duration();
                let least_of = |rows: &[Vec<f64>]| {
                    rows.iter().map(|q| world.distance(q)).fold(f64::INFINITY, f64::min)
                };
                let dense = least_of(&timed.sampled(step).1);
                let (coarse, rows) = timed.sampled(0.25 * timed.duration());
                let bend = &limits.acceleration;
                let in_time = world.closest_approach(&coarse, bend, &|t| timed.sample(t).q);
                let none = vec![0.0; bend.len()];
                let along = world.closest_approach(&[0.0, 1.0], &none, &|s| mix(&a, &b, s));
                for least in [in_time, along] {
                    let between = 0.002 * world.displacement(&a, &b);
                    assert!(least < dense + 1.5e-4, "{least} {dense}");
                    assert!(least > dense - between - 5e-5, "{least} {dense}");
                }
                missed += usize::from(least_of(&rows) > in_time + 5e-4);
            }
        }
        assert!(missed > 0, "five samples tell as much");
    }

    #[test]
    fn a_motion_that_rests_and_a_robot_with_nothing_to_touch_have_an_answer() {
        let robot = Robot::gen3();
        let home = robot.pose("home").unwrap().to_vec();
        let world = scene(&robot, &mut StdRng::seed_from_u64(2));
        let rests = |_: f64| home.clone();
        let none = vec![0.0; home.len()];
        let (found, there) = (world.closest_approach(&[0.0], &none, &rests), world.distance(&home));
        assert!((found - there).abs() < 1e-12);
        assert!((world.closest_approach(&[0.0, 0.0], &none, &rests) - there).abs() < 1e-12);
        let mut alone = CollisionWorld::new(&robot);
        alone.ignore_itself();
        assert!(alone.closest_approach(&[0.0, 1.0], &none, &rests).is_infinite());
    }
}
