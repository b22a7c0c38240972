//! Eight configurations looked at together: the robot as spheres, the obstacles as they are.
//!
//! Every number stands eight times, once for each configuration ([`super::lanes`]). Frames are placed first; then each part
//! of the robot, from the hand backwards, is looked at as one ball, and where that is near something as its spheres. The
//! spheres contain the robot ([`super::spheres`]) and distances to boxes, capsules and cylinders are closed forms, so what is
//! called free is free; what is flagged may be free all the same where spheres are larger than the solids they stand for.
//!
//! Where a stretch of the way is looked at whole, spheres follow their tangents as far as they lead towards an obstacle
//! ([`Thing::beyond_swept`]), and two parts move against each other only by the joints between them.
//!
//! Numbers are `f32`: all radii are larger by [`SLACK`], far more than rounding.
//!
//! Source: Thomason, Kingston and Kavraki, "Motions in microseconds via vectorized sampling-based planning", ICRA 2024.

use std::cell::RefCell;
use std::ops::Range;

use nalgebra::Vector3;
use pulp::f32x8;

use super::beyond::{SLACK, Thing};
use super::body::Body;
use super::frames::{Frame, Frames};
use super::frames8::{Joint, joints};
use super::lanes::{LANES, run, short};
use super::looking::{Looking, Work};
use super::spheres::{Sphere, cover};

#[derive(Debug, Clone, Copy)]
pub(super) struct Ball {
    pub(super) centre: [f32; 3],
    pub(super) radius: f32,
}

#[derive(Debug, Clone)]
pub(super) struct Part {
    /// The frame it is fixed to; `None` for the base.
    pub(super) node: Option<usize>,
    /// Around all its spheres.
    pub(super) ball: Ball,
    /// How far the spheres' centres are from the ball's, m.
    pub(super) spread: f32,
    /// How far they are from the frame's axis and from its origin at most, m.
    arm: [f64; 2],
    pub(super) spheres: Range<usize>,
    /// Obstacles that it must not touch: a bit for each of eight ([`Batch::boxes`]).
    pub(super) masks: Vec<u8>,
}

/// Two parts that must not touch each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub(super) first: usize,
    pub(super) second: usize,
    /// The last frame that moves both; `None` for the base.
    pub(super) shared: Option<usize>,
}

/// A robot and what is around it, ready for eight configurations at once.
#[derive(Debug, Clone)]
pub(super) struct Batch {
    pub(super) joints: Vec<Joint>,
    pub(super) parts: Vec<Part>,
    pub(super) spheres: Vec<Ball>,
    pub(super) pairs: Vec<Pair>,
    pub(super) things: Vec<Thing>,
    /// Boxes along the axes around eight obstacles each: their lower ends, then their upper ones, by axis.
    pub(super) boxes: Vec<[f32x8; 6]>,
    /// Whether the spheres are all of the robot: then what is flagged does touch.
    is_exact: bool,
    pub(super) slack: f32,
    cost: u64,
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

thread_local! {
    static LAST: RefCell<Work> = RefCell::default();
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
            pairs: Vec::new(),
            things: Vec::new(),
            boxes: Vec::new(),
            is_exact: true,
            slack: 0.0,
            cost: 0,
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
            let size = far(&Vector3::zeros());
            largest = largest.max(size);
            let mut masks = vec![0_u8; obstacles.len().div_ceil(LANES)];
            for place in watched {
                masks[place as usize / LANES] |= 1 << (place as usize % LANES);
            }
            batch.parts.push(Part {
                node,
                ball: ball(&middle, far(&middle)),
                spread: most(&|centre| (centre - middle).norm()) as f32,
                arm: [most(&|centre| centre.xy().norm()), most(&Vector3::norm)],
                spheres: from..batch.spheres.len(),
                masks,
            });
        }
        let pair = |&(first, second): &(usize, usize)| {
            let nodes = [batch.parts[first].node, batch.parts[second].node];
            Pair { first, second, shared: batch.shared(nodes) }
        };
        batch.pairs = pairs.iter().map(pair).collect();
        reach += largest;
        batch.slack = (SLACK * (1.0 + reach)) as f32;
        batch.boxes = obstacles.chunks(LANES).map(|eight| around(eight, batch.slack)).collect();
        batch.things = obstacles.into_iter().map(Thing::of).collect();
        let masks = batch.parts.iter().flat_map(|part| &part.masks);
        let watched: usize = masks.map(|mask| mask.count_ones() as usize).sum();
        let things = batch.joints.len() + batch.spheres.len() + watched + batch.pairs.len();
        batch.cost = 1 + things as u64 / 10;
        batch
    }

    /// Returns a bit for each of eight configurations in which something is nearer than asked for, or may be.
    pub(super) fn flagged(&self, question: &Question<'_>) -> u8 {
        LAST.with_borrow_mut(|work| run(Looking { batch: self, question, work }))
    }

    /// Returns, for each part, how much the way of any of its spheres bends at most on a straight joint motion: the size of
    /// the second derivative by the share of the way, m. Then the same for each pair, as one part sees the other.
    ///
    /// With joint `k` no nearer to the hand than joint `j`, the second derivative of a point by both is no longer than the
    /// point's distance from the axis of `j`.
    pub(super) fn bends(&self, from: &[f64], to: &[f64]) -> Vec<f64> {
        let bend = |part: &Part, until: Option<usize>| {
            let ([mut arm, mut beyond], mut at) = (part.arm, part.node);
            let (mut bend, mut outer) = (0.0, 0.0);
            while at != until
                && let Some(node) = at
            {
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
        let alone = self.parts.iter().map(|part| bend(part, None));
        let paired = self.pairs.iter().map(|pair| {
            let both = [pair.first, pair.second].map(|part| bend(&self.parts[part], pair.shared));
            both[0] + both[1]
        });
        alone.chain(paired).collect()
    }

    /// Returns the last frame that moves both of two.
    fn shared(&self, [first, second]: [Option<usize>; 2]) -> Option<usize> {
        let above = |node: &usize| self.joints[*node].parent;
        let chain: Vec<usize> = std::iter::successors(first, above).collect();
        std::iter::successors(second, above).find(|node| chain.contains(node))
    }

    /// Returns what a look costs, in units of [`super::Budget`]: some ten spheres are one pair of solids.
    pub(super) fn cost(&self) -> u64 {
        self.cost
    }

    /// Returns whether what is flagged does touch.
    pub(super) fn is_exact(&self) -> bool {
        self.is_exact
    }
}

/// Returns boxes along the axes around up to eight bodies, `slack` m larger; what is missing is nowhere.
fn around(bodies: &[&Body], slack: f32) -> [f32x8; 6] {
    let (none, end) = (f32::INFINITY, f32::NEG_INFINITY);
    let mut ends =
        [[none; LANES], [none; LANES], [none; LANES], [end; LANES], [end; LANES], [end; LANES]];
    for (lane, body) in bodies.iter().enumerate() {
        let [low, high] = body.corners();
        for axis in 0..3 {
            ends[axis][lane] = low[axis] as f32 - slack;
            ends[3 + axis][lane] = high[axis] as f32 + slack;
        }
    }
    ends.map(|[a, b, c, d, e, f, g, h]| f32x8(a, b, c, d, e, f, g, h))
}

fn ball(centre: &Vector3<f64>, radius: f64) -> Ball {
    Ball { centre: short(centre), radius: radius as f32 }
}

#[cfg(test)]
pub(super) mod tests {
    use nalgebra::{Isometry3, UnitQuaternion};
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::motion::Robot;
    use crate::motion::collision::{CollisionWorld, Obstacle};
    use crate::motion::descent::random_configuration;
    use crate::motion::lanes::Job;
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
