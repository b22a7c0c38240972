//! The arm where nothing can touch it: moved by its own equations of motion, in place of the engine's.
//!
//! The engine works out mass matrix and constraints of any tree of bodies, in matrices of any size; that is most of a step.
//! Here the same is done for a tree of few joints: the mass matrix by composite bodies, what speed and weight ask for by Newton
//! and Euler (`equations.rs`), and then what motors, the ends of joints, dry friction and what couples the jaws do, row by row as the
//! engine goes through them. Joints are the engine's and are left as it would leave them, so that either may take the next step.
//!
//! It is for the arm alone, and for one thing that both jaws press on (`held.rs`): while any other moves, or is near them, the
//! engine takes the step.
//!
//! Source: Mirtich, *Impulse-based Dynamic Simulation*, 1996, on what two things cannot have gone towards each other since
//! they were last looked at.

use nalgebra::{Isometry3, Vector3};
use rapier3d_f64::dynamics::{RigidBodyHandle, SpringCoefficients};
use rapier3d_f64::geometry::Aabb;

use super::equations::{Equations, MOST, Twist, axes};
use super::held::{Held, Speeds};
use super::stick::Pulls;
use super::{Physics, Tree};
use crate::motion::dynamics::{factor, solve_with};
use crate::motion::robot::Motion;
use crate::twin::convert::{pose_from_engine, pose_to_engine, to_engine};

/// What is nearer to the arm than this is the engine's, m: twice as far as it foresees contacts.
const NEAR: f64 = 0.01;

/// The arm as it is moved here.
#[derive(Clone, Default)]
pub(super) struct Alone {
    /// Where the arm's bodies are in the world, once a step was taken here; else the engine knows.
    poses: Option<Vec<Isometry3<f64>>>,
    /// What the jaws hold, if that is moved here too.
    pub(super) held: Option<Held>,
    /// How far all else is from the arm at least, m.
    clear: f64,
    /// No place on the arm is farther from the axis of a joint than this, m.
    reach: f64,
}

/// A joint in a step.
#[derive(Debug, Clone, Copy, Default)]
struct Turn {
    /// Its degree of freedom in the engine.
    dof: usize,
    /// Where it is, rad or m.
    at: f64,
    /// Its spring in N·m/rad or N/m, and where that is at rest.
    spring: (f64, f64),
    damping: f64,
    friction: f64,
    armature: f64,
}

/// One row of what is solved for after the other: an impulse within bounds that brings a speed to what it should be.
#[derive(Debug, Clone, Copy)]
struct Row {
    /// The joint whose speed it is, and one whose speed is taken from it.
    joint: usize,
    less: Option<usize>,
    /// The speeds an impulse of 1 gives.
    gives: [f64; MOST],
    /// What it works against, beside the masses.
    gain: f64,
    inverse: f64,
    /// What is missing to the speed, with and without what is to be made up for.
    missing: [f64; 2],
    bounds: [f64; 2],
    impulse: f64,
}

impl Alone {
    /// Makes the arm ready, once its bodies and joints are in the engine.
    pub(super) fn new(tree: &Tree, reach_beyond: f64) -> Self {
        let joints = tree.bodies.iter().filter_map(|body| body.joint.as_ref());
        let between = joints.map(|joint| {
            let slides = if joint.motion == Motion::Slide { joint.range.1.abs() } else { 0.0 };
            joint.parent_from_link.translation.vector.norm() + slides
        });
        // A metre at least: what slides goes as far as it says.
        Self { reach: (between.sum::<f64>() + reach_beyond).max(1.0), ..Self::default() }
    }

    /// Returns whether the last step was taken here.
    pub(super) fn is_here(&self) -> bool {
        self.poses.is_some()
    }

    /// Returns the pose in the world of a body of the arm, if the last step was taken here.
    pub(super) fn pose(&self, body: usize) -> Option<Isometry3<f64>> {
        self.poses.as_ref().map(|poses| poses[body])
    }
}

impl Physics {
    /// Takes a step of the arm, and of what it holds, if nothing else can touch them; returns whether it did. What sticks to
    /// the jaws creeps along them at `creep` m/s.
    pub(super) fn step_alone(&mut self, creep: f64) -> bool {
        if !self.is_alone() {
            self.alone.clear = 0.0;
            self.alone.held = None;
            return false;
        }
        let pulls = self.pulls(creep);
        let base = self.body_pose(0);
        let mut poses = self.alone.poses.take().unwrap_or_else(|| self.places(base));
        let moved = self.move_alone(&poses, &pulls);
        self.place(&mut poses);
        self.alone.poses = Some(poses);
        self.alone.clear -= moved;
        true
    }

    /// Tells the engine where the arm is, after steps that were taken here.
    pub(super) fn hand_over(&mut self) {
        let Some(poses) = self.alone.poses.take() else { return };
        for (link, pose) in self.links.iter().zip(&poses).skip(1) {
            self.bodies[*link].set_position(pose_to_engine(pose), false);
        }
    }

    /// Returns whether nothing can touch the arm in this step, nor the one thing that it may hold.
    fn is_alone(&mut self) -> bool {
        let few =
            self.tree.bodies.len() <= MOST && self.arm.len() + 2 == self.tree.bodies.len() - 1;
        if !few || self.parameters.num_solver_iterations != 1 {
            return false;
        }
        let moves = |handle: RigidBodyHandle| {
            let body = &self.bodies[handle];
            !(body.is_fixed() || body.is_sleeping())
        };
        let objects = self.objects.iter().enumerate();
        let mut moving = objects.filter(|(_, handle)| handle.is_some_and(moves)).map(|(at, _)| at);
        let (thing, more) = (moving.next(), moving.next());
        if more.is_some() || thing.is_some_and(|thing| !self.holds(thing)) {
            return false;
        }
        if thing != self.alone.held.as_ref().map(|held| held.object) {
            self.alone.clear = 0.0;
            self.alone.held = thing.and_then(|thing| self.take_over(thing));
        }
        if thing.is_some() != self.alone.held.is_some() {
            return false;
        }
        if self.alone.clear <= NEAR {
            self.alone.clear = self.clearance();
        }
        self.alone.clear > NEAR
    }

    /// Returns how far the arm and what it holds are from all else at least, m: between boxes along the axes of the world.
    fn clearance(&self) -> f64 {
        let held = self.alone.held.as_ref().map(|held| held.thing);
        let links = self.links.iter().enumerate().skip(1);
        let bodies = links.map(|(body, link)| (*link, self.body_pose(body)));
        let thing = held.map(|thing| (thing, pose_from_engine(self.bodies[thing].position())));
        let mut own: Vec<Aabb> = Vec::new();
        for (body, place) in bodies.chain(thing) {
            for handle in self.bodies[body].colliders() {
                let collider = &self.colliders[*handle];
                let within = collider.position_wrt_parent();
                let within = within.map_or_else(Isometry3::identity, pose_from_engine);
                own.push(collider.shape().compute_aabb(&pose_to_engine(&(place * within))));
            }
        }
        let others = self.objects.iter().flatten().chain([&self.table]);
        let others = others.filter(|body| held != Some(**body));
        let others = others.flat_map(|body| self.bodies[*body].colliders());
        others.fold(f64::INFINITY, |least, other| {
            let other = self.colliders[*other].compute_aabb();
            own.iter().fold(least, |least, own| least.min(between(own, &other)))
        })
    }

    /// Returns how far any surface of the arm is from the origin of its body, m.
    pub(super) fn widest(&self) -> f64 {
        let own = self.links.iter().flat_map(|link| self.bodies[*link].colliders());
        own.fold(0.0, |most, handle| {
            let collider = &self.colliders[*handle];
            let ball = collider.shape().compute_local_bounding_sphere();
            let at = collider.position_wrt_parent().map_or(0.0, |pose| pose.translation.length());
            most.max(at + ball.center.length() + ball.radius)
        })
    }

    /// Returns where the arm's bodies are.
    fn places(&self, base: Isometry3<f64>) -> Vec<Isometry3<f64>> {
        let mut poses = vec![base; self.tree.bodies.len()];
        self.place(&mut poses);
        poses
    }

    /// Puts the bodies of the arm where its joints have them; the first one stays.
    fn place(&self, poses: &mut [Isometry3<f64>]) {
        for joint in self.arm.iter().chain(&self.jaws) {
            let body = &self.tree.bodies[joint.body];
            let (Some(parent), Some(moved)) = (body.parent, &body.joint) else { continue };
            poses[joint.body] = poses[parent] * moved.parent_from_link(self.coordinate(joint));
        }
    }

    /// Moves the joints, and what is held, by a step; returns how far any place on them can have gone, m.
    fn move_alone(&mut self, poses: &[Isometry3<f64>], pulls: &Pulls) -> f64 {
        let dt = self.parameters.dt;
        let n = self.tree.bodies.len() - 1;
        let (turns, joints) = self.turns();
        let weight = self.links.get(1).map_or(0.0, |link| self.bodies[*link].gravity_scale());
        let falls = poses[0].rotation.inverse() * (self.gravity * weight);
        let places = turns.map(|turn| turn.at);
        let Equations { mut mass, bias } = Equations::new(&self.tree, &falls, &places, &joints);
        let mass = &mut mass[..n * n];
        let mut change = [0.0; MOST];
        for k in 0..n {
            let Turn { at, spring: (stiff, rest), damping, armature, .. } = turns[k];
            mass[k * n + k] += armature + dt * (damping + dt * stiff);
            let force = stiff * (rest - at - dt * joints[k]) - damping * joints[k];
            change[k] = dt * (force - bias[k]);
        }
        // What has masses and rotors is always positive definite; what has not moves by NaN, and the step says so.
        factor(mass, n);
        solve_with(mass, &mut change[..n]);
        let mut speeds = Speeds { joints, thing: Twist::default() };
        for (speed, change) in speeds.joints.iter_mut().zip(change) {
            *speed += change;
        }
        let mut rows = self.rows(&turns, mass);
        let mut held = self.alone.held.take();
        let mut contacts = held.as_mut().map(|held| {
            self.find(held, poses);
            let (thing, speed) = self.thing(held);
            speeds.thing = thing.falls(&speed, &self.gravity, dt);
            let axes = axes(&self.tree, poses);
            let contacts = self.contacts(held, &thing, poses, &axes, mass, pulls);
            contacts.warm(&mut speeds);
            (thing, contacts)
        });
        let mut sweep = |speeds: &mut Speeds, which: usize| {
            for row in &mut rows {
                row.solve(&mut speeds.joints, which);
            }
            if let Some((_, contacts)) = &mut contacts {
                contacts.solve(speeds, which);
            }
        };
        for _ in 0..self.parameters.num_internal_pgs_iterations {
            sweep(&mut speeds, 0);
        }
        let gone = Speeds { ..speeds };
        for _ in 0..self.parameters.num_internal_stabilization_iterations {
            sweep(&mut speeds, 1);
        }
        let mut ways = vec![0.0; n];
        (0..n).for_each(|k| ways[turns[k].dof] = dt * gone.joints[k]);
        let first = self.jaws[0].handle;
        let (multibody, _) = self.multibody_joints.get_mut(first).expect("never removed");
        multibody.apply_displacements(&ways);
        let mut generalized = multibody.generalized_velocity_mut();
        (0..n).for_each(|k| generalized[turns[k].dof] = speeds.joints[k]);
        let mut moved = self.alone.reach * ways.iter().map(|way| way.abs()).sum::<f64>();
        if let (Some(held), Some((thing, contacts))) = (&mut held, &contacts) {
            Self::keep(held, contacts);
            let body = &mut self.bodies[held.thing];
            body.set_position(pose_to_engine(&thing.moved(&gone.thing, dt)), false);
            body.set_linvel(to_engine(&speeds.thing.moves), false);
            body.set_angvel(to_engine(&speeds.thing.turns), false);
            // No place on a thing is farther from its centre than it is long, and none is longer than an arm.
            moved += dt * (gone.thing.moves.norm() + gone.thing.turns.norm() * self.alone.reach);
        }
        self.alone.held = held;
        moved
    }

    /// Returns the joints, by the bodies they move, and their speeds, rad/s or m/s.
    fn turns(&self) -> ([Turn; MOST], [f64; MOST]) {
        let (mut turns, mut speeds) = ([Turn::default(); MOST], [0.0; MOST]);
        for joint in self.arm.iter().chain(&self.jaws) {
            let (multibody, link) = self.multibody_joints.get(joint.handle).expect("never removed");
            let Some(link) = multibody.link(link) else { continue };
            let (dof, axis) = (link.assembly_id(), joint.axis as usize);
            turns[joint.body - 1] = Turn {
                dof,
                at: link.joint().coords()[axis],
                spring: link.joint().spring(axis),
                damping: multibody.damping()[dof],
                friction: multibody.frictions()[dof],
                armature: multibody.armature()[dof],
            };
            speeds[joint.body - 1] = multibody.generalized_velocity()[dof];
        }
        (turns, speeds)
    }

    /// Returns what is gone through row by row: motors, ends and dry friction of all joints, and what couples the jaws.
    fn rows(&self, turns: &[Turn; MOST], mass: &[f64]) -> Vec<Row> {
        let (dt, n) = (self.parameters.dt, self.tree.bodies.len() - 1);
        let softness = SpringCoefficients::<f64>::joint_defaults();
        let (make_up, soft) = (softness.erp_inv_dt(dt), softness.cfm_coeff(dt));
        let row = |joint: usize, less: Option<usize>, soft: f64, gain: f64| {
            let mut gives = [0.0; MOST];
            gives[joint] = 1.0;
            if let Some(less) = less {
                gives[less] = -1.0;
            }
            solve_with(mass, &mut gives[..n]);
            let own = gives[joint] - less.map_or(0.0, |less| gives[less]);
            let gain = own * soft + gain;
            let (missing, bounds) = ([0.0; 2], [-f64::MAX, f64::MAX]);
            Row {
                joint,
                less,
                gives,
                gain,
                inverse: 1.0 / (own + gain),
                missing,
                bounds,
                impulse: 0.0,
            }
        };
        let mut rows = Vec::with_capacity(2 * MOST);
        for joint in self.arm.iter().chain(&self.jaws) {
            let k = joint.body - 1;
            let Turn { at, friction, .. } = turns[k];
            let (multibody, link) = self.multibody_joints.get(joint.handle).expect("never removed");
            let Some(link) = multibody.link(link) else { continue };
            let range = joint.range.unwrap_or([-f64::MAX, f64::MAX]);
            if let Some(motor) = link.joint().data.motor(joint.axis) {
                let spring = dt * motor.stiffness + motor.damping;
                let [low, high] = range.map(|end| (end - at) / dt);
                let behind = (at - motor.target_pos) * motor.stiffness * inverse(spring);
                let missing = behind - motor.target_vel.max(low).min(high);
                let most = motor.max_force * dt;
                let (missing, bounds) = ([missing; 2], [-most, most]);
                rows.push(Row { missing, bounds, ..row(k, None, 0.0, inverse(dt * spring)) });
            }
            let beyond = (at - range[1]).max(0.0) - (range[0] - at).max(0.0);
            if beyond != 0.0 {
                let bounds = if beyond > 0.0 { [0.0, f64::MAX] } else { [-f64::MAX, 0.0] };
                let missing = [beyond * make_up, 0.0];
                rows.push(Row { missing, bounds, ..row(k, None, soft, 0.0) });
            }
            if friction > 0.0 {
                let most = friction * dt;
                rows.push(Row { bounds: [-most, most], ..row(k, None, soft, 0.0) });
            }
        }
        // As the engine has them coupled: the first follows the last.
        let [first, last] = [0, 1].map(|jaw| self.jaws[jaw].body - 1);
        let apart = (turns[first].at - turns[last].at) * make_up;
        rows.push(Row { missing: [apart, 0.0], ..row(first, Some(last), 0.0, 0.0) });
        rows
    }
}

impl Row {
    /// Brings its speed to what it should be, as far as its bounds let it; `which` is what is missing then.
    fn solve(&mut self, speeds: &mut [f64; MOST], which: usize) {
        let speed = speeds[self.joint] - self.less.map_or(0.0, |less| speeds[less]);
        let missing = self.missing[which] + speed;
        let whole = self.impulse + self.inverse * (missing - self.gain * self.impulse);
        let whole = whole.max(self.bounds[0]).min(self.bounds[1]);
        let more = whole - self.impulse;
        self.impulse = whole;
        for (speed, gives) in speeds.iter_mut().zip(&self.gives) {
            *speed -= more * gives;
        }
    }
}

/// Returns the inverse, and none of nothing: a servo that is neither spring nor damper.
fn inverse(of: f64) -> f64 {
    if of > 0.0 { 1.0 / of } else { 0.0 }
}

/// Returns how far two boxes are from each other, m; 0 when they meet.
pub(super) fn between(a: &Aabb, b: &Aabb) -> f64 {
    let apart = |low: f64, high: f64| (low - high).max(0.0);
    let gap = [
        apart(a.mins.x, b.maxs.x) + apart(b.mins.x, a.maxs.x),
        apart(a.mins.y, b.maxs.y) + apart(b.mins.y, a.maxs.y),
        apart(a.mins.z, b.maxs.z) + apart(b.mins.z, a.maxs.z),
    ];
    Vector3::from(gap).norm()
}
