//! Eight configurations looked at together: the robot as spheres, the obstacles as they are.
//!
//! Every number stands eight times, once for each configuration ([`super::lanes`]). Frames are placed first; then each part
//! of the robot, from the hand backwards, is looked at as one ball, and where that is near something as its spheres. The
//! spheres contain the robot ([`super::spheres`]) and distances to boxes, capsules and cylinders are closed forms, so what is
//! called free is free; what is flagged may be free all the same where spheres are larger than the solids they stand for.
//!
//! Numbers are `f32`: all radii are larger by [`SLACK`], far more than rounding.
//!
//! Source: Thomason, Kingston and Kavraki, "Motions in microseconds via vectorized sampling-based planning", ICRA 2024.

#![expect(clippy::inline_always, reason = "what is not inlined into the look misses the registers")]

use std::cell::Cell;
use std::ops::Range;

use nalgebra::Vector3;
use pulp::f32x8;

use super::beyond::{SLACK, Thing};
use super::distance::Body;
use super::frames::{Frame, Frames};
use super::frames8::{Joint, Placed8, carried, joints, place};
use super::lanes::{Eight, Job, LANES, Three, Vectors, Wide, packed, run, short};
use super::spheres::{Sphere, cover};

#[derive(Debug, Clone, Copy)]
struct Ball {
    centre: [f32; 3],
    radius: f32,
}

#[derive(Debug, Clone)]
struct Part {
    /// The frame it is fixed to; `None` for the base.
    node: Option<usize>,
    /// Around all its spheres.
    ball: Ball,
    /// How far the spheres' centres are from the ball's, m.
    spread: f32,
    /// How far they are from the frame's axis and from its origin at most, m.
    arm: [f64; 2],
    spheres: Range<usize>,
    /// Obstacles it must not touch, by place, the nearest first; and what is left to each at full stretch, m.
    watched: Vec<(u32, f32)>,
}

/// A robot and what is around it, ready for eight configurations at once.
#[derive(Debug, Clone)]
pub(super) struct Batch {
    joints: Vec<Joint>,
    parts: Vec<Part>,
    spheres: Vec<Ball>,
    pairs: Vec<(usize, usize)>,
    things: Vec<Thing>,
    /// Whether the spheres are all of the robot: then what is flagged does touch.
    is_exact: bool,
    slack: f32,
}

/// What is asked of eight configurations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Question<'a> {
    /// Ends of a straight joint motion, rad.
    pub(super) from: &'a [f64],
    pub(super) to: &'a [f64],
    /// Shares of the way at which it is looked.
    pub(super) at: [f64; LANES],
    /// Distance that must be left, m.
    pub(super) room: f64,
    /// Half of the stretches of the way about these places that are looked at whole, shares of it, and how each part's way
    /// bends ([`Batch::bends`]). Without bends only the places themselves are looked at.
    pub(super) half: [f64; LANES],
    pub(super) bends: &'a [f64],
    /// Whether all eight must be told; otherwise the first that are flagged end it.
    pub(super) all: bool,
}

/// Memory of the last look, used again.
#[derive(Debug, Default)]
struct Work {
    placed: Placed8,
    /// Of each part, the last first: the middle of its ball, and how much larger its spheres are.
    balls: Vec<(Vectors, f32x8)>,
    near: Vec<u32>,
}

thread_local! {
    static LAST: Cell<Work> = Cell::default();
}

impl Batch {
    /// Returns a robot whose parts move with these links and consist of these solids, with the obstacles that each must not
    /// touch, and pairs of parts that must not touch each other.
    pub(super) fn of<'p>(
        frames: &Frames,
        parts: impl Iterator<Item = (usize, &'p [Body], Vec<u32>)>,
        pairs: &[(usize, usize)],
        obstacles: impl Iterator<Item = &'p Body>,
    ) -> Self {
        let mut batch = Self {
            joints: joints(frames),
            parts: Vec::new(),
            spheres: Vec::new(),
            pairs: pairs.to_vec(),
            things: Vec::new(),
            is_exact: true,
            slack: 0.0,
        };
        let obstacles: Vec<&Body> = obstacles.collect();
        // How far coordinates reach: every shift between joints and the parts on them.
        let mut reach: f64 = frames.nodes.iter().map(|node| node.shift.norm()).sum();
        let mut largest = 0.0_f64;
        for (link, bodies, watched) in parts {
            let (node, node_from_link) = frames.links[link];
            let frame = Frame::of(&node_from_link);
            let from = batch.spheres.len();
            let mut spheres: Vec<Sphere> = Vec::new();
            for body in bodies {
                let (cover, is_all) = cover(&body.moved(&frame));
                spheres.extend(cover);
                batch.is_exact &= is_all;
            }
            let middle = spheres.iter().map(|s| s.0).sum::<Vector3<f64>>();
            let middle = middle / spheres.len().max(1) as f64;
            let far = |to: &Vector3<f64>| {
                spheres.iter().map(|s| (s.0 - to).norm() + s.1).fold(0.0, f64::max)
            };
            batch.spheres.extend(spheres.iter().map(|&(centre, radius)| ball(&centre, radius)));
            let most = |size: &dyn Fn(&Vector3<f64>) -> f64| {
                spheres.iter().map(|s| size(&s.0)).fold(0.0, f64::max)
            };
            let (shoulder, stretch) = batch.stretch(node);
            let size = far(&Vector3::zeros());
            largest = largest.max(size);
            let left = |place: u32| {
                obstacles[place as usize].distance_to_ball(&shoulder, stretch + size) as f32
            };
            let mut watched: Vec<(u32, f32)> =
                watched.into_iter().map(|place| (place, left(place))).collect();
            watched.sort_by(|a, b| a.1.total_cmp(&b.1));
            batch.parts.push(Part {
                node,
                ball: ball(&middle, far(&middle)),
                spread: most(&|centre| (centre - middle).norm()) as f32,
                arm: [most(&|centre| centre.xy().norm()), most(&Vector3::norm)],
                spheres: from..batch.spheres.len(),
                watched,
            });
        }
        reach += largest;
        batch.slack = (SLACK * (1.0 + reach)) as f32;
        batch.things = obstacles.into_iter().map(Thing::of).collect();
        batch
    }

    /// Returns the point that the first joint before a frame turns about, in base coordinates, and how far the frame's origin
    /// can be from it, m; infinitely far where a joint slides.
    fn stretch(&self, node: Option<usize>) -> (Vector3<f64>, f64) {
        let (mut shoulder, mut stretch, mut last) = (Vector3::zeros(), 0.0, 0.0);
        let mut at = node;
        while let Some(node) = at {
            let joint = &self.joints[node];
            stretch += last;
            last = if joint.slides { f64::INFINITY } else { joint.length };
            shoulder = Vector3::from(joint.shift.map(f64::from));
            at = joint.parent;
        }
        (shoulder, if last.is_finite() { stretch } else { f64::INFINITY })
    }

    /// Returns a bit for each of eight configurations in which something is nearer than asked for, or may be.
    pub(super) fn flagged(&self, question: &Question<'_>) -> u8 {
        let mut work = LAST.take();
        let found = run(Looking { batch: self, question, work: &mut work });
        LAST.set(work);
        found
    }

    /// Returns, for each part, how much the way of any of its spheres bends at most on a straight joint motion: the size of
    /// the second derivative by the share of the way, m.
    ///
    /// With joint `k` no nearer to the hand than joint `j`, the second derivative of a point by both is no longer than the
    /// point's distance from the axis of `j`.
    pub(super) fn bends(&self, from: &[f64], to: &[f64]) -> Vec<f64> {
        let bend = |part: &Part| {
            let ([mut arm, mut beyond], mut at) = (part.arm, part.node);
            let (mut bend, mut outer) = (0.0, 0.0);
            while let Some(node) = at {
                let joint = &self.joints[node];
                let rate = (joint.multiplier * (to[joint.index] - from[joint.index])).abs();
                if joint.slides {
                    let value =
                        |q: &[f64]| (joint.multiplier * q[joint.index] + joint.offset).abs();
                    beyond += value(from).max(value(to));
                    arm = 1.0;
                }
                bend += rate * (rate * arm + 2.0 * outer);
                outer += rate * arm;
                beyond += joint.length;
                arm = beyond;
                at = joint.parent;
            }
            bend
        };
        self.parts.iter().map(bend).collect()
    }

    /// Returns what a look costs, in units of [`super::Budget`]: some ten spheres are one pair of solids.
    pub(super) fn cost(&self) -> u64 {
        let watched: usize = self.parts.iter().map(|part| part.watched.len()).sum();
        1 + (self.joints.len() + self.spheres.len() + watched + self.pairs.len()) as u64 / 10
    }

    /// Returns whether what is flagged does touch.
    pub(super) fn is_exact(&self) -> bool {
        self.is_exact
    }
}

fn ball(centre: &Vector3<f64>, radius: f64) -> Ball {
    Ball { centre: short(centre), radius: radius as f32 }
}

struct Looking<'a> {
    batch: &'a Batch,
    question: &'a Question<'a>,
    work: &'a mut Work,
}

impl Job for Looking<'_> {
    type Found = u8;

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) -> u8 {
        let Self { batch, question, work } = self;
        let sweeps = !question.bends.is_empty();
        let ends = (question.from, question.to);
        place(simd, &batch.joints, ends, &question.at, sweeps, &mut work.placed);
        let Placed8 { frames, speeds } = &work.placed;
        let most = question.room as f32 + batch.slack;
        let room = Eight::all(simd, most);
        let half = Eight::of(simd, packed(&question.half));
        let mut found = 0;
        work.balls.clear();
        // From the hand backwards: what is far out collides first.
        for at in (0..batch.parts.len()).rev() {
            let part = &batch.parts[at];
            let ball = carried(simd, frames, part.node, part.ball.centre);
            let mut grown = Eight::all(simd, 0.0);
            if let (true, Some(node)) = (sweeps, part.node) {
                let [speed, turning] = speeds[node];
                let (speed, turning) = (Three::of(simd, speed), Three::of(simd, turning));
                let origin = Three::of(simd, frames[node][3]);
                let speed = (speed + turning.cross(ball - origin)).norm()
                    + turning.norm() * Eight::all(simd, part.spread);
                let bend = Eight::all(simd, 0.5 * question.bends[at] as f32);
                grown = half * (speed + half * bend);
            }
            work.balls.push((ball.lanes(), grown.lanes));
            if part.watched.is_empty() {
                continue;
            }
            let more = room + grown;
            let reach = more + Eight::all(simd, part.ball.radius);
            work.near.clear();
            for &(thing, left) in &part.watched {
                if left > most {
                    break;
                }
                if batch.things[thing as usize].beyond(simd, ball, reach).below_zero() != 0 {
                    work.near.push(thing);
                }
            }
            if work.near.is_empty() {
                continue;
            }
            for sphere in &batch.spheres[part.spheres.clone()] {
                let centre = carried(simd, frames, part.node, sphere.centre);
                let reach = more + Eight::all(simd, sphere.radius);
                let mut gap = Eight::all(simd, f32::INFINITY);
                for &thing in &work.near {
                    gap = gap.min(batch.things[thing as usize].beyond(simd, centre, reach));
                }
                found |= gap.below_zero();
                if found != 0 && !question.all {
                    return found;
                }
            }
        }
        let last = batch.parts.len().wrapping_sub(1);
        for &(first, second) in &batch.pairs {
            let (a, b) = (&batch.parts[first], &batch.parts[second]);
            let ((middle, grown), (other, more)) =
                (work.balls[last - first], work.balls[last - second]);
            let more = room + Eight::of(simd, grown) + Eight::of(simd, more);
            let (middle, other) = (Three::of(simd, middle), Three::of(simd, other));
            let reach = more + Eight::all(simd, a.ball.radius + b.ball.radius);
            if apart(middle, other, reach).below_zero() == 0 {
                continue;
            }
            for sphere in &batch.spheres[a.spheres.clone()] {
                let centre = carried(simd, frames, a.node, sphere.centre);
                let reach = more + Eight::all(simd, sphere.radius);
                let whole = reach + Eight::all(simd, b.ball.radius);
                if apart(centre, other, whole).below_zero() == 0 {
                    continue;
                }
                for sphere in &batch.spheres[b.spheres.clone()] {
                    let end = carried(simd, frames, b.node, sphere.centre);
                    let reach = reach + Eight::all(simd, sphere.radius);
                    found |= apart(centre, end, reach).below_zero();
                    if found != 0 && !question.all {
                        return found;
                    }
                }
            }
        }
        found
    }
}

/// Returns by how much the squared distance of two points exceeds that of `reach`.
#[inline(always)]
fn apart<S: Wide>(a: Three<S>, b: Three<S>, reach: Eight<S>) -> Eight<S> {
    let between = a - b;
    between.dot(between) - reach * reach
}

#[cfg(test)]
pub(super) mod tests {
    use nalgebra::{Isometry3, UnitQuaternion};
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::motion::Robot;
    use crate::motion::collision::{CollisionWorld, Obstacle};
    use crate::motion::ik::random_configuration;
    use crate::motion::polyline::mix;
    use crate::motion::solid::Solid;

    /// Returns spheres on joints that turn and slide about axes of all directions.
    pub(in crate::motion) fn of_spheres() -> Robot {
        let joints = [("revolute", "0 0 1"), ("prismatic", "1 0 1"), ("revolute", "0 1 0.3")];
        let links = joints.into_iter().cycle().take(6).enumerate().map(|(k, (kind, axis))| {
            format!(
                "<joint name='j{k}' type='{kind}'><parent link='l{k}'/><child link='l{n}'/>\
                 <origin xyz='0.05 0.02 0.15' rpy='0.3 -0.8 {k}'/><axis xyz='{axis}'/>\
                 <limit lower='-0.2' upper='1.4' effort='1' velocity='1'/></joint><link name='l{n}'>\
                 <collision><origin xyz='0 0.03 0.05'/><geometry><sphere radius='0.05'/></geometry></collision>\
                 <collision><origin xyz='0.1 0 0'/><geometry><sphere radius='0.03'/></geometry></collision></link>",
                n = k + 1,
            )
        });
        let links: String = links.collect();
        Robot::from_urdf(&format!("<robot name='spheres'><link name='l0'/>{links}</robot>"), None)
            .unwrap()
    }

    /// Returns a robot among boxes, cylinders and capsules at random.
    pub(in crate::motion) fn scene<'a>(
        robot: &'a Robot,
        random: &mut StdRng,
    ) -> CollisionWorld<'a> {
        let mut world = CollisionWorld::new(robot);
        for k in 0..8 {
            let mut x = |reach: f64| random.random_range(-reach..reach);
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(x(3.0), x(3.0), x(3.0)));
            let upright = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), x(3.0));
            let at = Vector3::new(x(0.9), x(0.9), 0.4 + x(0.7));
            let size = Vector3::new(x(0.2), x(0.2), x(0.2)).abs().add_scalar(0.01);
            let (radius, half) = (0.5 * size.x, size.z);
            let solid = match k % 4 {
                0 => Solid::Cylinder { radius, half },
                1 => Solid::Capsule { radius, half },
                _ => Solid::Cuboid { half: size },
            };
            let turn = if k % 4 == 3 { upright } else { turn };
            world.add(&Obstacle::new(
                &format!("o{k}"),
                solid,
                Isometry3::from_parts(at.into(), turn),
            ));
        }
        world.set_margin(0.004);
        world
    }

    /// Of 10,000 configurations those called free are so by the exact solids; a robot of spheres is never flagged for nothing.
    #[test]
    fn what_is_called_free_is_free_by_the_exact_distances() {
        let mut random = StdRng::seed_from_u64(5);
        for robot in [Robot::gen3(), of_spheres()] {
            let (mut free, mut touching, mut unsure) = (0, 0, 0);
            for _ in 0..10 {
                let world = scene(&robot, &mut random);
                let room = world.margin();
                for _ in 0..63 {
                    let from = random_configuration(&robot, &mut random);
                    let to = random_configuration(&robot, &mut random);
                    let at = std::array::from_fn(|_| random.random_range(0.0..1.0));
                    let half = [0.0; LANES];
                    let (from, to) = (&from[..], &to[..]);
                    let flagged = world.batch().flagged(&Question {
                        from,
                        to,
                        at,
                        room,
                        half,
                        bends: &[],
                        all: true,
                    });
                    for (lane, t) in at.into_iter().enumerate() {
                        let q = mix(from, to, t);
                        if flagged & (1 << lane) == 0 {
                            assert!(world.is_clear(&q, room), "{q:?}");
                            free += 1;
                        } else if world.is_clear(&q, room + 1e-4) {
                            unsure += 1;
                        } else {
                            touching += 1;
                        }
                    }
                }
            }
            assert!(free > 500 && touching > 500, "{free} {touching}");
            // Where spheres stand for capsules, some of the free are told by the solids.
            assert!(
                if CollisionWorld::new(&robot).batch().is_exact() {
                    unsure == 0
                } else {
                    unsure < free / 5
                },
                "{unsure} {free}"
            );
        }
    }

    /// A machine without wide registers flags the same configurations: plans do not depend on where they are made.
    #[test]
    fn every_machine_flags_the_same() {
        let mut random = StdRng::seed_from_u64(7);
        let robot = Robot::gen3();
        let world = scene(&robot, &mut random);
        let mut flags = 0;
        for _ in 0..200 {
            let from = random_configuration(&robot, &mut random);
            let to = random_configuration(&robot, &mut random);
            let (at, half) = ([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8], [0.01; LANES]);
            let bends = world.batch().bends(&from, &to);
            let (from, to, bends) = (&from[..], &to[..], &bends[..]);
            let question = Question { from, to, at, room: 0.004, half, bends, all: true };
            let mut work = Work::default();
            let looking = Looking { batch: world.batch(), question: &question, work: &mut work };
            let flagged = looking.with(pulp::Scalar256b);
            assert_eq!(flagged, world.batch().flagged(&question));
            flags += flagged.count_ones();
        }
        assert!((100..1500).contains(&flags), "{flags}");
    }
}
