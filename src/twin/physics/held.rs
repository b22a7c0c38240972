//! What the jaws hold in the air: moved with the arm by the arm's own equations, in place of the engine's.
//!
//! Of a step of an arm that holds something the engine spends most on contacts, each of which it solves for against a mass
//! matrix of any size. Here the same contacts are found by the engine's own geometry and gone through in the same way: normals
//! and then friction of each pair of surfaces, warm from the step before, with what is sunk in made up for and without. What
//! the last step of the engine found is where the first step here begins; what is handed back is found there again.
//!
//! It is for one thing that both jaws press on while all else is out of reach of it; see `alone.rs`.
//!
//! Source: Catto, "Iterative dynamics with temporal coherence", GDC 2005, which is what the engine does.

use nalgebra::{Isometry3, Matrix3, Quaternion, UnitQuaternion, Vector3};
use rapier3d_f64::dynamics::RigidBodyHandle;
use rapier3d_f64::geometry::{ColliderHandle, ContactManifold};
use rapier3d_f64::math::Pose;
use rapier3d_f64::parry::query::{
    ContactManifoldsWorkspace, DefaultQueryDispatcher, PersistentQueryDispatcher,
};
use rapier3d_f64::utils::OrthonormalBasis;

use super::alone::between;
use super::equations::{MOST, Twist};
use super::stick::Pulls;
use super::{PRESSES, Physics, TOUCH};
use crate::motion::dynamics::solve_with;
use crate::twin::convert::{from_engine, pose_from_engine, pose_to_engine, to_engine};

/// What is farther than this from what is held does not reach it in a step, m: it would have to come at half a metre a second.
const AHEAD: f64 = 1e-3;

/// A thing that is held.
#[derive(Clone)]
pub(super) struct Held {
    pub(super) object: usize,
    pub(super) thing: RigidBodyHandle,
    pairs: Vec<Pair>,
    /// Whether both jaws pressed on it in the last step.
    pub(super) is_pressed: bool,
}

/// A surface of the arm and one of the thing, and where they meet.
#[derive(Clone)]
struct Pair {
    /// The body of the arm.
    body: usize,
    own: ColliderHandle,
    others: ColliderHandle,
    /// Whether the arm's surface is the first of the two.
    is_first: bool,
    friction: f64,
    manifolds: Vec<ContactManifold>,
    workspace: Option<ContactManifoldsWorkspace>,
    /// What the engine found last, until a step is taken here.
    before: Vec<ContactManifold>,
}

/// Speeds of the joints and of the thing, about its centre of mass.
pub(super) struct Speeds {
    pub(super) joints: [f64; MOST],
    pub(super) thing: Twist,
}

/// A thing as it moves.
pub(super) struct Thing {
    centre: Vector3<f64>,
    turn: UnitQuaternion<f64>,
    within: Vector3<f64>,
    lightness: f64,
    /// Inertia about the centre of mass, and what turns it back, in the axes of the world.
    inertia: Matrix3<f64>,
    inverse: Matrix3<f64>,
}

/// A way along which a contact pushes: what speed it feels and what speeds it gives.
struct Way {
    along: [f64; MOST],
    gives: [f64; MOST],
    thing: Twist,
    thing_gives: Twist,
    mass: f64,
}

/// A place where two surfaces meet: one way apart and two aside.
struct Contact {
    /// Where it is in [`Held`].
    at: [usize; 3],
    friction: f64,
    ways: [Way; 3],
    /// What is missing to the speed apart, with and without what is sunk in, and aside.
    apart: [f64; 2],
    aside: [f64; 2],
    impulse: [f64; 3],
    /// Ways aside, in the world.
    axes: [Vector3<f64>; 2],
}

/// All that touches what is held.
pub(super) struct Contacts {
    each: Vec<Contact>,
    /// What is left of an impulse while what is sunk in is made up for.
    soft: f64,
}

/// Returns the sum of products, four at a time: they need not wait for each other.
fn dot(a: &[f64; MOST], b: &[f64; MOST]) -> f64 {
    let (mut sums, mut k) = ([0.0; 4], 0);
    while k < MOST {
        sums[0] += a[k] * b[k];
        sums[1] += a[k + 1] * b[k + 1];
        sums[2] += a[k + 2] * b[k + 2];
        sums[3] += a[k + 3] * b[k + 3];
        k += 4;
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

impl Way {
    fn speed(&self, speeds: &Speeds) -> f64 {
        self.thing.dot(&speeds.thing) + dot(&self.along, &speeds.joints)
    }

    fn push(&self, speeds: &mut Speeds, impulse: f64) {
        for k in 0..MOST {
            speeds.joints[k] += impulse * self.gives[k];
        }
        speeds.thing = speeds.thing.plus(&self.thing_gives.times(impulse));
    }
}

impl Contacts {
    /// Pushes with what the step before pushed with.
    pub(super) fn warm(&self, speeds: &mut Speeds) {
        for contact in &self.each {
            contact
                .ways
                .iter()
                .zip(contact.impulse)
                .for_each(|(way, impulse)| way.push(speeds, impulse));
        }
    }

    /// Goes through all contacts once; `which` is what is missing then.
    pub(super) fn solve(&mut self, speeds: &mut Speeds, which: usize) {
        let soft = if which == 0 { self.soft } else { 1.0 };
        for contacts in self.each.chunk_by_mut(|a, b| a.at[..2] == b.at[..2]) {
            for contact in contacts.iter_mut() {
                let way = &contact.ways[0];
                let missing = way.speed(speeds) + contact.apart[which];
                let whole = soft * (contact.impulse[0] - way.mass * missing).max(0.0);
                way.push(speeds, whole - contact.impulse[0]);
                contact.impulse[0] = whole;
            }
            for contact in contacts {
                let most = contact.friction * contact.impulse[0];
                let whole: [f64; 2] = std::array::from_fn(|k| {
                    let way = &contact.ways[k + 1];
                    contact.impulse[k + 1] - way.mass * (way.speed(speeds) + contact.aside[k])
                });
                let size = whole[0].hypot(whole[1]);
                let share = if size > most { most / size } else { 1.0 };
                for k in 0..2 {
                    let whole = whole[k] * share;
                    contact.ways[k + 1].push(speeds, whole - contact.impulse[k + 1]);
                    contact.impulse[k + 1] = whole;
                }
            }
        }
    }
}

impl Thing {
    /// Returns how fast it goes once its weight, and its turning about no axis of its own, had a time `dt`.
    pub(super) fn falls(&self, speed: &Twist, gravity: &Vector3<f64>, dt: f64) -> Twist {
        let momentum = self.inertia * speed.turns;
        let next = momentum - speed.turns.cross(&momentum) * dt;
        // As much momentum as it had: turned on, not added to.
        let kept = if next.norm_squared() > 0.0 { momentum.norm() / next.norm() } else { 0.0 };
        Twist { turns: self.inverse * next * kept, moves: speed.moves + gravity * dt }
    }

    /// Returns where it is after a time `dt` at a speed.
    pub(super) fn moved(&self, speed: &Twist, dt: f64) -> Isometry3<f64> {
        let half = Quaternion::from_imag(speed.turns * (0.5 * dt));
        let turn = (Quaternion::identity() + half) * self.turn.into_inner();
        let turn = UnitQuaternion::from_quaternion(turn);
        let centre = self.centre + speed.moves * dt;
        Isometry3::from_parts((centre - turn * self.within).into(), turn)
    }
}

/// Returns where a point of a contact is, m in the world: in the middle between both surfaces.
fn middle([first, second]: &[Pose; 2], manifold: &ContactManifold, point: usize) -> Vector3<f64> {
    let point = &manifold.points[point];
    let within = |part: Option<&Pose>, at| part.map_or(at, |part| *part * at);
    let a = *first * within(manifold.subshape_pos1(), point.local_p1);
    let b = *second * within(manifold.subshape_pos2(), point.local_p2);
    from_engine((a + b) * 0.5)
}

/// Returns the points of a contact that can be reached in a step, in the order the engine goes through them: another one
/// would wind the points of a pad up against each other.
fn in_order(manifold: &ContactManifold) -> Vec<usize> {
    let [a, b] = manifold.local_n1.orthonormal_basis();
    let place = |k: &usize| {
        let at = manifold.points[*k].local_p1;
        (at.dot(a), at.dot(b))
    };
    let points = 0..manifold.points.len();
    let mut points: Vec<usize> = points.filter(|&k| manifold.points[k].dist < AHEAD).collect();
    points.sort_by(|i, j| {
        let ((a, b), (c, d)) = (place(i), place(j));
        a.total_cmp(&c).then(b.total_cmp(&d))
    });
    points
}

impl Physics {
    /// Takes a thing over from the engine, with what it found where the arm touches it.
    pub(super) fn take_over(&self, object: usize) -> Option<Held> {
        let thing = self.objects[object]?;
        if self.multibody_joints.rigid_body_link(thing).is_some() {
            return None;
        }
        let mut pairs = Vec::new();
        for (body, link) in self.links.iter().enumerate().skip(1) {
            for &own in self.bodies[*link].colliders() {
                for &others in self.bodies[thing].colliders() {
                    let pair = self.narrow_phase.contact_pair(own, others);
                    let friction =
                        self.colliders[own].friction() * self.colliders[others].friction();
                    pairs.push(Pair {
                        body,
                        own,
                        others,
                        is_first: pair.is_none_or(|pair| pair.collider1 == own),
                        friction,
                        manifolds: Vec::new(),
                        workspace: None,
                        before: pair.map_or_else(Vec::new, |pair| pair.solver_manifolds().to_vec()),
                    });
                }
            }
        }
        Some(Held { object, thing, pairs, is_pressed: true })
    }

    /// Returns a thing as it moves, and how fast it does.
    pub(super) fn thing(&self, held: &Held) -> (Thing, Twist) {
        let body = &self.bodies[held.thing];
        let local = &body.mass_properties().local_mprops;
        let pose = pose_from_engine(body.position());
        let within = from_engine(local.local_com);
        let axes = UnitQuaternion::<f64>::from(local.principal_inertia_local_frame);
        let axes = (pose.rotation * axes).to_rotation_matrix();
        let about = |diagonal: Vector3<f64>| {
            axes.matrix() * Matrix3::from_diagonal(&diagonal) * axes.matrix().transpose()
        };
        let thing = Thing {
            centre: pose.rotation * within + pose.translation.vector,
            turn: pose.rotation,
            within,
            lightness: 1.0 / local.mass(),
            inertia: about(from_engine(local.principal_inertia())),
            inverse: about(from_engine(local.inv_principal_inertia)),
        };
        let speed = Twist { turns: from_engine(body.angvel()), moves: from_engine(body.linvel()) };
        (thing, speed)
    }

    /// Finds where the arm, its bodies at `poses`, touches what is held.
    pub(super) fn find(&self, held: &mut Held, poses: &[Isometry3<f64>]) {
        for at in 0..held.pairs.len() {
            let pair = &held.pairs[at];
            let [a, b] = self.both(held, pair, &poses[pair.body]);
            let shape = |collider: ColliderHandle| self.colliders[collider].shape();
            let (own, others) = (shape(pair.own), shape(pair.others));
            let (first, second) = if pair.is_first { (own, others) } else { (others, own) };
            let pair = &mut held.pairs[at];
            if between(&first.compute_aabb(&a), &second.compute_aabb(&b)) > AHEAD {
                (pair.manifolds, pair.workspace, pair.before) = (Vec::new(), None, Vec::new());
                continue;
            }
            let between = a.inverse() * b;
            let (manifolds, workspace) = (&mut pair.manifolds, &mut pair.workspace);
            // Surfaces it has no answer for touch nowhere, as in the engine.
            let _ = DefaultQueryDispatcher
                .contact_manifolds(&between, first, second, AHEAD, manifolds, workspace);
            for manifold in manifolds {
                let part = manifold.subshape_pos1().map_or(a, |part| a * *part);
                manifold.data.normal = part.rotation * manifold.local_n1;
                let same = |old: &&ContactManifold| {
                    old.subshape1 == manifold.subshape1 && old.subshape2 == manifold.subshape2
                };
                let Some(old) = pair.before.iter().find(same) else { continue };
                for point in &mut manifold.points {
                    let mut olds = old.points.iter();
                    let old = olds.find(|old| old.fid1 == point.fid1 && old.fid2 == point.fid2);
                    if let Some(old) = old {
                        point.data = old.data;
                    }
                }
            }
            pair.before = Vec::new();
        }
        held.is_pressed = self.tree.jaws.iter().all(|&jaw| {
            let Some(joint) = &self.tree.bodies[jaw].joint else { return false };
            let closes = poses[jaw] * joint.axis.into_inner();
            held.pairs.iter().filter(|pair| pair.body == jaw).any(|pair| {
                pair.manifolds.iter().any(|manifold| {
                    from_engine(manifold.data.normal).dot(&closes).abs() > PRESSES
                        && manifold.points.iter().any(|point| point.dist < TOUCH)
                })
            })
        });
    }

    /// Returns the contacts of what is held as they are solved for.
    pub(super) fn contacts(
        &self,
        held: &Held,
        thing: &Thing,
        poses: &[Isometry3<f64>],
        axes: &[Twist; MOST],
        mass: &[f64],
        pulls: &Pulls,
    ) -> Contacts {
        let dt = self.parameters.dt;
        let softness = self.parameters.contact_softness;
        let fastest = self.parameters.max_corrective_velocity();
        let base = poses[0].translation.vector;
        let mut each = Vec::new();
        for (p, pair) in held.pairs.iter().enumerate() {
            if pair.manifolds.is_empty() {
                continue;
            }
            let sign = if pair.is_first { 1.0 } else { -1.0 };
            let places = self.both(held, pair, &poses[pair.body]);
            let way = |at: &Vector3<f64>, along: &Vector3<f64>| {
                let from_base = at - base;
                let mut ways = [0.0; MOST];
                let mut body = pair.body;
                while body > 0 {
                    let axis = &axes[body];
                    ways[body - 1] = sign * along.dot(&(axis.moves + axis.turns.cross(&from_base)));
                    body = self.tree.bodies[body].parent.unwrap_or(0);
                }
                let mut gives = ways;
                solve_with(mass, &mut gives[..self.tree.bodies.len() - 1]);
                let moves = along * -sign;
                let turns = (at - thing.centre).cross(&moves);
                let felt = Twist { turns, moves };
                let thing_gives =
                    Twist { turns: thing.inverse * turns, moves: moves * thing.lightness };
                let mass = 1.0 / (dot(&ways, &gives) + felt.dot(&thing_gives));
                Way { along: ways, gives, thing: felt, thing_gives, mass }
            };
            for (m, manifold) in pair.manifolds.iter().enumerate() {
                let out = -manifold.data.normal;
                let aside = out.orthonormal_vector();
                let axes = [aside, out.cross(aside)].map(from_engine);
                let out = from_engine(out);
                for k in in_order(manifold) {
                    let point = &manifold.points[k];
                    let at = middle(&places, manifold, k);
                    let velocity = pulls.at(self.links[pair.body], held.thing, &at, &-out) * sign;
                    let warm = from_engine(point.data.warmstart_tangent_world);
                    let gap = point.dist.max(0.0) / dt;
                    let sunk = (softness.erp_inv_dt(dt) * point.dist).clamp(-fastest, 0.0);
                    each.push(Contact {
                        at: [p, m, k],
                        friction: pair.friction,
                        ways: [way(&at, &out), way(&at, &axes[0]), way(&at, &axes[1])],
                        apart: [gap + sunk, gap],
                        aside: axes.map(|axis| velocity.dot(&axis)),
                        impulse: [
                            point.data.warmstart_impulse,
                            warm.dot(&axes[0]),
                            warm.dot(&axes[1]),
                        ],
                        axes,
                    });
                }
            }
        }
        Contacts { each, soft: softness.cfm_factor(dt) }
    }

    /// Returns where the first and the second surface of a pair are in the world, the arm's bodies at `body`.
    fn both(&self, held: &Held, pair: &Pair, body: &Isometry3<f64>) -> [Pose; 2] {
        let within = |collider: ColliderHandle| {
            self.colliders[collider].position_wrt_parent().copied().unwrap_or_default()
        };
        let own = pose_to_engine(body) * within(pair.own);
        let others = *self.bodies[held.thing].position() * within(pair.others);
        if pair.is_first { [own, others] } else { [others, own] }
    }

    /// Puts down what the contacts did, to be warm with in the next step.
    pub(super) fn keep(held: &mut Held, contacts: &Contacts) {
        for pair in &mut held.pairs {
            for point in pair.manifolds.iter_mut().flat_map(|manifold| &mut manifold.points) {
                point.data = rapier3d_f64::geometry::ContactData::default();
            }
        }
        for contact in &contacts.each {
            let [pair, manifold, point] = contact.at;
            let data = &mut held.pairs[pair].manifolds[manifold].points[point].data;
            let [normal, a, b] = contact.impulse;
            (data.impulse, data.warmstart_impulse) = (normal, normal);
            (data.tangent_impulse.x, data.tangent_impulse.y) = (a, b);
            data.warmstart_tangent_world = to_engine(&(contact.axes[0] * a + contact.axes[1] * b));
        }
    }

    /// Returns how much friction could bear between a body of the arm and what is held, how much it does, N·s in the last
    /// step, and how far any place would go if it were moved by `way`, m.
    pub(super) fn bears(
        &self,
        held: &Held,
        body: usize,
        way: impl Fn(&Vector3<f64>, &Vector3<f64>) -> f64,
    ) -> (f64, f64, f64) {
        let (mut bears, mut borne, mut far) = (0.0, 0.0, 0.0_f64);
        let place = self.body_pose(body);
        for pair in held.pairs.iter().filter(|pair| pair.body == body) {
            let places = self.both(held, pair, &place);
            for manifold in &pair.manifolds {
                let normal = from_engine(manifold.data.normal);
                let points = manifold.points.iter().enumerate();
                for (k, point) in points.filter(|(_, point)| point.dist < AHEAD) {
                    bears += pair.friction * point.data.impulse;
                    borne += point.data.tangent_impulse.norm();
                    far = far.max(way(&middle(&places, manifold, k), &normal));
                }
            }
        }
        (bears, borne, far)
    }

    /// Returns whether a body of the arm touches what is held.
    pub(super) fn is_touched(held: &Held, body: usize) -> bool {
        let pairs = held.pairs.iter().filter(|pair| pair.body == body);
        pairs.flat_map(|pair| &pair.manifolds).flat_map(|m| &m.points).any(|p| p.dist < TOUCH)
    }
}
