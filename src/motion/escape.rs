//! Out of a place where something is touched, on a way that brings nothing closer.
//!
//! [`super::rrt`] begins where everything keeps its margin. An arm may have to begin elsewhere: its fingers round
//! a thing they have just let go, a hand on the table, less room than a doubtful arm is asked for. From there it
//! may go where each pair that touches only comes further apart, and no other pair comes to touch, until the
//! margin is kept everywhere; from there on it is planned as ever.
//!
//! Steps are taken greedily along the direction that parts what touches most: those in which a hand is drawn back
//! by people, the slope of the distances, and single joints. There is no chance in it, and no end of tries.

use std::collections::BTreeMap;

use nalgebra::{DVector, Matrix6, Vector3, Vector6};

use super::budget::Budget;
use super::collision::{CollisionWorld, Pair};
use super::cone::Cone;
use super::ik::Solver;
use super::polyline::mix;

/// The most any point of the robot moves in one step, m.
const STEP: f64 = 0.004;
/// Steps after which an arm counts as caught: 1.6 m at the very most.
const STEPS: usize = 400;
/// How much more than the margin is left where there is room, m: a search that begins at the margin itself
/// finds no way to turn.
const ROOM: f64 = 0.004;
/// Distances are worked out to about this, m; a pair that is nearer by less is not nearer.
const NOISE: f64 = 2e-5;
/// A step that parts what touches by less than this share of its length leads nowhere.
const GAIN: f64 = 0.02;

/// Returns the corners of a way from `start` to where everything keeps its margin, `start` first: `start` alone
/// when it does so there. `None` when the arm is caught, or the budget ends the search. With a `cone` the hand stays
/// in it.
pub fn leave(
    solver: &Solver<'_>,
    world: &CollisionWorld<'_>,
    start: &[f64],
    cone: Option<&Cone>,
    budget: &Budget<'_>,
) -> Option<Vec<Vec<f64>>> {
    solver.robot().check(start).ok()?;
    if world.free(start) {
        return Some(vec![start.to_vec()]);
    }
    let out = Leaving { solver, world, cone, budget };
    let mut at = Place { q: start.to_vec(), touches: out.near(start)? };
    let mut way = vec![start.to_vec()];
    let mut along: Option<Vec<f64>> = None;
    for _ in 0..STEPS {
        if at.touches.is_empty() {
            break;
        }
        // What parted them a moment ago most likely still does.
        let kept = along.take().and_then(|direction| {
            let next = out.step(&at, &direction)?;
            (next.1 > 0.3 * STEP).then_some((next.0, direction))
        });
        let next = kept.or_else(|| {
            let steps = out.directions(&at.q).into_iter().filter_map(|direction| {
                let (place, gain) = out.step(&at, &direction)?;
                Some((gain, place, direction))
            });
            let best = steps.max_by(|a, b| a.0.total_cmp(&b.0))?;
            Some((best.1, best.2))
        });
        let Some((place, direction)) = next else { break };
        way.push(place.q.clone());
        (at, along) = (place, Some(direction));
    }
    world.free(&at.q).then(|| out.shortened(&way)).flatten()
}

struct Leaving<'s> {
    solver: &'s Solver<'s>,
    world: &'s CollisionWorld<'s>,
    cone: Option<&'s Cone>,
    budget: &'s Budget<'s>,
}

/// Where the arm is, and what is near it there: the farthest each pair has come so far.
#[derive(Clone)]
struct Place {
    q: Vec<f64>,
    touches: BTreeMap<Pair, f64>,
}

impl Leaving<'_> {
    /// Returns what is near at `q`, unless the budget ends the search.
    fn near(&self, q: &[f64]) -> Option<BTreeMap<Pair, f64>> {
        self.budget.spend(self.world.cost()).ok()?;
        Some(self.world.touching(q, ROOM))
    }

    /// Goes to `q` if that brings nothing closer that touches and lets nothing else touch.
    fn go(&self, from: &Place, q: Vec<f64>) -> Option<Place> {
        let robot = self.solver.robot();
        let kept = robot.joints().iter().zip(&q).zip(&from.q).all(|((joint, to), from)| {
            // A joint past the end of its range may come back, and goes no further.
            *to >= joint.lower.min(*from) && *to <= joint.upper.max(*from)
        });
        if !kept || self.cone.is_some_and(|cone| !cone.holds(robot, &q)) {
            return None;
        }
        let margin = self.world.margin();
        let mut touches = self.near(&q)?;
        for (pair, distance) in &mut touches {
            let before = from.touches.get(pair).copied().unwrap_or(f64::INFINITY);
            // What keeps its margin need only go on doing so.
            if *distance <= margin && *distance < before - NOISE {
                return None;
            }
            if before <= margin {
                *distance = distance.max(before);
            }
        }
        Some(Place { q, touches })
    }

    /// Takes one step in a direction of the joints; also returns by how much it parts what touches, m.
    fn step(&self, from: &Place, direction: &[f64]) -> Option<(Place, f64)> {
        let ahead: Vec<f64> = from.q.iter().zip(direction).map(|(q, d)| q + d).collect();
        let moved = self.world.displacement(&from.q, &ahead);
        if !moved.is_finite() || moved < 1e-9 {
            return None;
        }
        let next = self.go(from, mix(&from.q, &ahead, STEP / moved))?;
        // What is no longer near has come at least as far as the room asked for.
        let enough = self.world.margin() + ROOM;
        let gain: f64 = from
            .touches
            .iter()
            .map(|(pair, before)| {
                next.touches.get(pair).map_or(enough, |now| now.min(enough)) - before
            })
            .sum();
        (gain > GAIN * STEP).then_some((next, gain))
    }

    /// Directions of the joints that are worth a try at `q`.
    fn directions(&self, q: &[f64]) -> Vec<Vec<f64>> {
        let robot = self.solver.robot();
        let n = robot.n_joints();
        let mut found = Vec::new();
        if let (Ok(tip), Ok(jacobian)) = (robot.forward(q), robot.jacobian(q)) {
            let hand = tip.rotation() * robot.flange_from_tool().rotation();
            let normal = &jacobian * jacobian.transpose() + Matrix6::identity() * 1e-4;
            let inverse = normal.try_inverse().unwrap_or_else(Matrix6::identity);
            // Back out of the grasp, up, and to the hand's other sides.
            let ways = [
                -(hand * Vector3::z()),
                Vector3::z(),
                hand * Vector3::x(),
                -(hand * Vector3::x()),
                hand * Vector3::y(),
                -(hand * Vector3::y()),
                hand * Vector3::z(),
            ];
            for way in ways {
                let twist = Vector6::new(way.x, way.y, way.z, 0.0, 0.0, 0.0);
                let turn: DVector<f64> = jacobian.transpose() * (inverse * twist);
                found.push(turn.as_slice().to_vec());
            }
        }
        found.extend(self.slope(q));
        for joint in 0..n {
            for sign in [1.0, -1.0] {
                let mut turn = vec![0.0; n];
                turn[joint] = sign;
                found.push(turn);
            }
        }
        found
    }

    /// The direction in which what touches parts soonest, by differences; `None` where it is level.
    fn slope(&self, q: &[f64]) -> Option<Vec<f64>> {
        // Rad: at the reach of a Gen3 (0.9 m) 3.6 mm.
        const TURN: f64 = 0.004;
        let limit = self.world.margin() + ROOM;
        let short = |joint: usize, by: f64| -> Option<f64> {
            let mut q = q.to_vec();
            q[joint] += by;
            Some(self.near(&q)?.values().map(|distance| limit - distance).sum())
        };
        let slope: Option<Vec<f64>> =
            (0..q.len()).map(|joint| Some(short(joint, -TURN)? - short(joint, TURN)?)).collect();
        let slope = slope?;
        slope.iter().any(|x| x.abs() > 1e-9).then_some(slope)
    }

    /// Leaves out corners where the straight motion between their neighbours leaves as well.
    fn shortened(&self, way: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
        let mut place = Place { q: way[0].clone(), touches: self.near(&way[0])? };
        let mut corners = vec![way[0].clone()];
        let mut at = 0;
        while at + 1 < way.len() {
            let mut far = way.len() - 1;
            let reached = loop {
                if let Some(reached) = self.straight(&place, &way[far]) {
                    break reached;
                }
                if far == at + 1 {
                    // The step itself was taken, if only to within the noise.
                    let touches = self.near(&way[far])?;
                    break Place { q: way[far].clone(), touches };
                }
                far = at + (far - at) / 2;
            };
            corners.push(way[far].clone());
            (place, at) = (reached, far);
        }
        Some(corners)
    }

    /// Goes straight to `to`, if all of the way leaves.
    fn straight(&self, from: &Place, to: &[f64]) -> Option<Place> {
        let steps = (self.world.displacement(&from.q, to) / STEP).ceil().max(1.0) as usize;
        let mut place = from.clone();
        for k in 1..=steps {
            place = self.go(&place, mix(&from.q, to, k as f64 / steps as f64))?;
        }
        Some(place)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::super::collision::Obstacle;
    use super::super::error::Error;
    use super::super::robot::Robot;
    use super::super::rrt;
    use super::super::solid::Solid;
    use super::*;

    /// The arm at home with something of that shape round the middle between its finger tips, moved by `by` m in
    /// the tool's frame.
    fn beside_the_hand<'a>(
        robot: &'a Robot,
        q: &[f64],
        solid: Solid,
        by: Vector3<f64>,
    ) -> CollisionWorld<'a> {
        let tool = robot.forward_tool(q).unwrap();
        let at = *tool.isometry() * Isometry3::translation(by.x, by.y, by.z);
        CollisionWorld::new(robot).with(&[Obstacle::new("cup", solid, at)])
    }

    fn distances_only_grow(world: &CollisionWorld<'_>, way: &[Vec<f64>]) {
        let mut before = world.touching(&way[0], 0.0);
        for edge in way.windows(2) {
            for k in 1..=40 {
                let now = world.touching(&mix(&edge[0], &edge[1], f64::from(k) / 40.0), 0.0);
                for (pair, distance) in &now {
                    let had = before.get(pair).copied().unwrap_or(f64::INFINITY);
                    assert!(*distance >= had - 2.0 * NOISE, "{pair:?}: {had} to {distance}");
                }
                before = now;
            }
        }
    }

    #[test]
    fn a_hand_that_touches_a_cup_is_led_away_from_it_and_then_home() {
        let robot = Robot::gen3();
        let solver = Solver::new(&robot);
        let home = robot.pose("home").unwrap().to_vec();
        let goal = robot.pose("retract").unwrap().to_vec();
        let cup = Solid::Cylinder { radius: 0.04, half: 0.05 };
        for (x, y, z) in [(0.075, 0.0, 0.01), (0.06, 0.03, 0.02), (-0.07, -0.02, 0.0)] {
            let world = beside_the_hand(&robot, &home, cup, Vector3::new(x, y, z));
            let settings = rrt::Settings::default();
            let budget = Budget::new(|| false);
            let from = |q: &[f64]| {
                rrt::plan(&solver, &world, q, std::slice::from_ref(&goal), None, &settings, &budget)
            };
            let touching = from(&home);
            assert!(
                matches!(touching, Err(Error::Collision { .. })),
                "the cup at {x} {y} {z} m touches: {touching:?}, {} m",
                world.distance(&home)
            );
            let way = leave(&solver, &world, &home, None, &budget).expect("there is a way out");
            assert_eq!(way[0], home);
            distances_only_grow(&world, &way);
            let end = way.last().unwrap();
            assert!(world.free(end) && way.len() < 12, "{} corners", way.len());
            assert!(from(end).is_ok());
        }
    }

    #[test]
    fn a_hand_that_touches_nothing_stays_and_one_that_is_walled_in_is_caught() {
        let robot = Robot::gen3();
        let solver = Solver::new(&robot);
        let home = robot.pose("home").unwrap().to_vec();
        let budget = Budget::new(|| false);
        let alone = CollisionWorld::new(&robot);
        assert_eq!(
            leave(&solver, &alone, &home, None, &budget).unwrap(),
            std::slice::from_ref(&home)
        );
        // The whole arm in a block larger than itself.
        let block = Solid::Cuboid { half: Vector3::repeat(1.5) };
        let inside = CollisionWorld::new(&robot).with(&[Obstacle::new(
            "block",
            block,
            Isometry3::identity(),
        )]);
        assert!(leave(&solver, &inside, &home, None, &budget).is_none());
        assert!(leave(&solver, &alone, &[0.0; 3], None, &budget).is_none(), "another length");
        let stopped = Budget::new(|| true);
        assert!(leave(&solver, &inside, &home, None, &stopped).is_none());
    }
}
