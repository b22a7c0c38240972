//! Rigid bodies, joints and contacts: the engine, set up as measurement advises.
//!
//! The arm is one multibody in reduced coordinates, its joints driven by torque-limited position
//! servos (`servo.rs`); the jaws are two sliding joints coupled to move alike. Objects are free bodies, vessels made
//! of thin walls. Water is not known here; it comes in as an inertia added to a vessel. Where nothing else can touch them, the
//! arm (`alone.rs`) and what it holds (`held.rs`) are moved without the engine.
//!
//! The engine's defaults are tuned for games at the scale of metres and let a held jar creep by
//! millimetres; the settings below, and what remembers where it sticks (`stick.rs`), hold it within 0.01 mm.

mod alone;
mod build;
mod equations;
mod held;
mod servo;
mod shapes;
mod stick;
mod touch;
mod tree;

use nalgebra::{Isometry3, Vector3};
use rapier3d_f64::dynamics::{
    CCDSolver, ImpulseJointSet, IntegrationParameters, IslandManager, JointAxis,
    MultibodyJointHandle, MultibodyJointSet, RigidBodyHandle, RigidBodySet, RigidBodyType,
    SoftBodySet, SpringCoefficients,
};
use rapier3d_f64::geometry::{BroadPhaseBvh, ColliderSet, NarrowPhase};
use rapier3d_f64::pipeline::PhysicsPipeline;

use alone::Alone;
use stick::Stuck;
pub use tree::{Body, Tree};

use super::convert::{from_engine, inertia_to_engine, pose_from_engine, to_engine};
use super::{Error, Settings};
use crate::motion::{Inertial, Robot};
use crate::world::{Scene, WorldState};

/// Two surfaces closer than this touch, m: the compression of a contact at rest is below 0.1 mm.
const TOUCH: f64 = 5e-4;

/// A jaw presses on what it touches at less than 60 deg from the way it closes, as a cosine: on a pad it is none, on the
/// side of a finger 90.
const PRESSES: f64 = 0.5;

/// Water whose mass changes by less than this share, and whose centre by less than so many metres, is the same.
const SAME: f64 = 1e-6;

/// A joint is told of its limits when one is nearer than this share of its range: 0.2 rad of the Gen3's, a hundred times what
/// it turns in a step.
const NEAR_LIMIT: f64 = 0.05;

/// A moving joint in the engine.
#[derive(Debug, Clone, Copy)]
struct Joint {
    handle: MultibodyJointHandle,
    axis: JointAxis,
    /// The body it moves, in [`Tree::bodies`].
    body: usize,
    /// Where it ends, rad or m, if it does.
    range: Option<[f64; 2]>,
    /// The most its servo gives, N·m or N.
    effort: f64,
}

/// The rigid world: arm, gripper, table and objects.
pub struct Physics {
    /// The arm's bodies and their inertia.
    pub tree: Tree,
    gravity: Vector3<f64>,
    /// What sticks to the jaws.
    stuck: Vec<Stuck>,
    /// The arm while nothing can touch it.
    alone: Alone,
    parameters: IntegrationParameters,
    pipeline: PhysicsPipeline,
    islands: IslandManager,
    broad_phase: BroadPhaseBvh,
    narrow_phase: NarrowPhase,
    bodies: RigidBodySet,
    colliders: ColliderSet,
    impulse_joints: ImpulseJointSet,
    multibody_joints: MultibodyJointSet,
    soft_bodies: SoftBodySet,
    ccd: CCDSolver,
    links: Vec<RigidBodyHandle>,
    arm: Vec<Joint>,
    jaws: Vec<Joint>,
    objects: Vec<Option<RigidBodyHandle>>,
    /// What was added to each object's inertia.
    added: Vec<Option<Inertial>>,
    table: RigidBodyHandle,
}

impl Clone for Physics {
    fn clone(&self) -> Self {
        Self {
            tree: self.tree.clone(),
            gravity: self.gravity,
            stuck: self.stuck.clone(),
            alone: self.alone.clone(),
            parameters: self.parameters,
            // The pipeline is scratch memory only; all that lasts from step to step is in the sets.
            pipeline: PhysicsPipeline::new(),
            islands: self.islands.clone(),
            broad_phase: self.broad_phase.clone(),
            narrow_phase: self.narrow_phase.clone(),
            bodies: self.bodies.clone(),
            colliders: self.colliders.clone(),
            impulse_joints: self.impulse_joints.clone(),
            multibody_joints: self.multibody_joints.clone(),
            soft_bodies: self.soft_bodies.clone(),
            ccd: self.ccd.clone(),
            links: self.links.clone(),
            arm: self.arm.clone(),
            jaws: self.jaws.clone(),
            objects: self.objects.clone(),
            added: self.added.clone(),
            table: self.table,
        }
    }
}

impl std::fmt::Debug for Physics {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Physics").field("q", &self.q()).finish_non_exhaustive()
    }
}

/// Returns the engine's parameters: stiff contacts, fresh every step, friction solved in both passes.
fn parameters(settings: &Settings) -> IntegrationParameters {
    IntegrationParameters {
        dt: settings.dt,
        num_solver_iterations: settings.solver_iterations,
        num_internal_pgs_iterations: settings.sweeps,
        contact_recycling: false,
        // Of the corners of a foot other four would be kept in every step, and a cup at rest would rock on them.
        contact_clustering: false,
        friction_in_bias_pass: true,
        // Damped critically: when the jaws press with another force, it has spread over the pads sooner than with more.
        contact_softness: SpringCoefficients::new(200.0, 1.0),
        static_contact_softness: SpringCoefficients::new(400.0, 5.0),
        // Nothing on a table moves further than this within a few steps; contacts foreseen further
        // ahead cost time and change nothing.
        normalized_prediction_distance: 0.005,
        ..IntegrationParameters::default()
    }
}

impl Physics {
    /// Builds the rigid world in the given state; objects without a pose are left out.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] when the state does not fit arm or scene, [`Error::Robot`] when the arm is
    /// one the physics cannot move.
    pub fn new(
        robot: &Robot,
        scene: &Scene,
        state: &WorldState,
        settings: &Settings,
    ) -> Result<Self, Error> {
        let mut world = Self {
            tree: Tree::new(robot)?,
            gravity: settings.gravity,
            stuck: Vec::new(),
            alone: Alone::default(),
            parameters: parameters(settings),
            pipeline: PhysicsPipeline::new(),
            islands: IslandManager::new(),
            broad_phase: BroadPhaseBvh::new(),
            narrow_phase: NarrowPhase::new(),
            bodies: RigidBodySet::new(),
            colliders: ColliderSet::new(),
            impulse_joints: ImpulseJointSet::new(),
            multibody_joints: MultibodyJointSet::new(),
            soft_bodies: SoftBodySet::new(),
            ccd: CCDSolver::new(),
            links: Vec::new(),
            arm: Vec::new(),
            jaws: Vec::new(),
            objects: Vec::new(),
            added: vec![None; scene.objects.len()],
            table: RigidBodyHandle::invalid(),
        };
        world.table = world.add_table(scene, settings);
        world.add_arm(robot, scene, state, settings)?;
        world.add_objects(scene, state, settings)?;
        world.alone = Alone::new(&world.tree, world.widest());
        Ok(world)
    }

    /// Advances the rigid world by one time step, in which what hangs in the jaws creeps along the pads at `creep`
    /// m/s.
    pub fn step(&mut self, creep: f64) {
        if self.step_alone(creep) {
            return;
        }
        self.hand_over();
        let pulls = self.pulls(creep);
        self.mind_limits();
        self.pipeline.step(
            to_engine(&self.gravity),
            &self.parameters,
            &mut self.islands,
            &mut self.broad_phase,
            &mut self.narrow_phase,
            &mut self.bodies,
            &mut self.colliders,
            &mut self.impulse_joints,
            &mut self.multibody_joints,
            &mut self.soft_bodies,
            &mut self.ccd,
            &pulls,
            &(),
        );
    }

    /// Tells the engine of the limits of joints that are near one: of all others they ask for nothing, and the engine
    /// works out a constraint for each of them in every part of a step.
    fn mind_limits(&mut self) {
        for joint in self.arm.iter().chain(&self.jaws) {
            let Some([low, high]) = joint.range else { continue };
            let margin = NEAR_LIMIT * (high - low);
            let inside = low + margin..high - margin;
            let is_far = inside.contains(&self.coordinate(joint));
            let (multibody, link) =
                self.multibody_joints.get_mut(joint.handle).expect("never removed");
            if let Some(link) = multibody.link_mut(link) {
                link.joint.data.limit_axes.set(joint.axis.into(), !is_far);
            }
        }
    }

    /// Returns the arm's joint angles, base first, rad, on the links' side.
    pub fn q(&self) -> Vec<f64> {
        self.arm.iter().map(|joint| self.coordinate(joint)).collect()
    }

    /// Returns the arm's joint speeds, base first, rad/s.
    pub fn dq(&self) -> Vec<f64> {
        self.arm.iter().map(|joint| self.speed(joint)).collect()
    }

    /// Returns how far each jaw is from the middle, m.
    pub fn jaws(&self) -> Vec<f64> {
        self.jaws.iter().map(|joint| self.coordinate(joint)).collect()
    }

    fn coordinate(&self, joint: &Joint) -> f64 {
        let (multibody, link) = self.multibody_joints.get(joint.handle).expect("never removed");
        multibody.link(link).map_or(f64::NAN, |link| link.joint().coords()[joint.axis as usize])
    }

    fn speed(&self, joint: &Joint) -> f64 {
        let (multibody, link) = self.multibody_joints.get(joint.handle).expect("never removed");
        multibody.link(link).map_or(f64::NAN, |link| multibody.joint_velocity(link)[0])
    }

    /// Returns the pose in the world of a body of the arm.
    fn body_pose(&self, body: usize) -> Isometry3<f64> {
        let engines = || pose_from_engine(self.bodies[self.links[body]].position());
        self.alone.pose(body).unwrap_or_else(engines)
    }

    /// Returns the pose in the world of a link.
    pub fn link_pose(&self, link: usize) -> Isometry3<f64> {
        let (body, body_from_link) = self.tree.links[link];
        self.body_pose(body) * body_from_link
    }

    /// Returns the pose in the world of an object, if it is there.
    pub fn object_pose(&self, object: usize) -> Option<Isometry3<f64>> {
        let handle = self.objects[object]?;
        Some(pose_from_engine(self.bodies[handle].position()))
    }

    /// Returns linear (m/s, of the centre of mass) and angular (rad/s) velocity of an object.
    pub fn object_velocity(&self, object: usize) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let body = &self.bodies[self.objects[object]?];
        Some((from_engine(body.linvel()), from_engine(body.angvel())))
    }

    /// Returns the inertia of an object with what was added to it, in the object's frame.
    pub fn object_inertia(&self, object: usize) -> Option<Inertial> {
        let properties = self.bodies[self.objects[object]?].mass_properties();
        let local = &properties.local_mprops;
        let (axes, principal) = (local.principal_inertia_local_frame, local.principal_inertia());
        let axes = nalgebra::UnitQuaternion::<f64>::from(axes).to_rotation_matrix();
        let diagonal = nalgebra::Matrix3::from_diagonal(&from_engine(principal));
        Some(Inertial {
            mass: local.mass(),
            com: from_engine(local.local_com),
            inertia: axes.matrix() * diagonal * axes.matrix().transpose(),
        })
    }

    /// Adds an inertia (in the object's frame) to an object's own, in place of the last one added, if it is another.
    pub fn add_inertia(&mut self, object: usize, inertial: &Inertial) {
        let Some(handle) = self.objects[object] else { return };
        let last = &mut self.added[object];
        let is_new = last.as_ref().is_none_or(|last| {
            (last.mass - inertial.mass).abs() > SAME * inertial.mass
                || (last.com - inertial.com).norm() > SAME
        });
        if is_new {
            *last = Some(*inertial);
            self.bodies[handle].set_additional_mass_properties(inertia_to_engine(inertial), true);
            if self.alone.held.as_ref().is_some_and(|held| held.object == object) {
                self.bodies[handle].recompute_mass_properties_from_colliders(&self.colliders);
            }
        }
    }

    /// Pushes an object at its centre of mass with a force, N, for `dt` s; returns where that is, m in the world.
    pub fn push(&mut self, object: usize, force: Vector3<f64>, dt: f64) -> Option<Vector3<f64>> {
        let body = &mut self.bodies[self.objects[object]?];
        body.apply_impulse(to_engine(&(force * dt)), true);
        Some(from_engine(body.center_of_mass()))
    }

    /// Takes an object away, to a place in the world, m, where it stays.
    pub fn take(&mut self, object: usize, to: Vector3<f64>) {
        let Some(handle) = self.objects[object] else { return };
        let body = &mut self.bodies[handle];
        body.set_body_type(RigidBodyType::Fixed, true);
        body.set_translation(to_engine(&to), true);
    }
}

/// Something that can be touched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// A body of the arm, in [`Tree::bodies`].
    Body(usize),
    /// An object, in the scene's order.
    Object(usize),
    /// The table.
    Table,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{ObjectState, Pose, Shape, object, scene};

    /// An arm at rest with open jaws, and things around it.
    fn around(robot: &Robot, objects: Vec<ObjectState>) -> WorldState {
        WorldState {
            time: 0.0,
            q: vec![0.0; robot.n_joints()],
            opening: 0.08,
            world_from_tool: Pose::identity(),
            held: None,
            objects,
            spilt: None,
            unknown: Vec::new(),
        }
    }

    /// Returns the tilt (rad) of a round thing that stood tilted and was given a spin (rad/s), every half second.
    fn rocking(hollow: bool, tilt: f64, spin: f64) -> Vec<f64> {
        let robot = Robot::gen3();
        let mut thing = object::vessel(Shape::Cylinder { radius: 0.032, height: 0.12 }, 2e-4);
        thing.mass = 0.12;
        thing.cavity = thing.cavity.filter(|_| hollow);
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), tilt);
        let low = Vector3::new(0.55, 0.2, 0.032 * tilt.sin() + 1e-4);
        let world_from_object = Some(Pose::from_parts(low, turn));
        let (name, water) = (thing.name.clone(), Some(0.0));
        let objects = vec![ObjectState { name, world_from_object, std: 0.0, water }];
        let state = around(&robot, objects);
        let settings = Settings::for_arm(&robot);
        let mut world = Physics::new(&robot, &scene::bare(vec![thing]), &state, &settings).unwrap();
        let handle = world.objects[0].unwrap();
        world.bodies[handle].set_angvel(to_engine(&Vector3::new(0.0, spin, 0.5 * spin)), true);
        let half_second = (0.5 / settings.dt) as usize;
        let tilt = |world: &Physics| {
            let up = world.object_pose(0).unwrap().rotation * Vector3::z();
            up.angle(&Vector3::z())
        };
        (0..4)
            .map(|_| {
                (0..half_second).for_each(|_| world.step(0.0));
                tilt(&world)
            })
            .collect()
    }

    /// Returns how far a drawer that resists with `friction` N slides in a quarter of a second, m, when so many N pull at it.
    fn slides(friction: f64, pull: f64) -> f64 {
        let robot = Robot::gen3();
        let named = |name: &str, x, z, mass| {
            let shape = Shape::Cuboid { size: Vector3::new(x, 0.2, z) };
            let thing = object::vessel(shape, 1e-3);
            object::Object { name: name.into(), mass, cavity: None, ..thing }
        };
        let (case, tray) = (named("case", 0.16, 0.11, 3.0), named("tray", 0.15, 0.08, 0.5));
        let mut scene = scene::bare(vec![case, tray]);
        let (tray, case) = ("tray".to_owned(), "case".to_owned());
        scene.drawers.push(crate::world::Drawer { tray, case, travel: 0.11, bar: 0.05 });
        let stands = Pose::upright(0.6, 0.3, 0.0, 0.0);
        let closed = scene.drawers[0].tray_at(&scene, &stands, 0.0).unwrap();
        let at = |name: &str, pose| ObjectState {
            name: name.into(),
            world_from_object: Some(pose),
            std: 0.0,
            water: None,
        };
        let state = around(&robot, vec![at("case", stands), at("tray", closed)]);
        let mut settings = Settings::for_arm(&robot);
        settings.friction.drawer = friction;
        let mut world = Physics::new(&robot, &scene, &state, &settings).unwrap();
        world.gravity.x = pull / 0.5;
        (0..(0.25 / settings.dt) as usize).for_each(|_| world.step(0.0));
        world.object_pose(1).unwrap().translation.x - closed.origin().x
    }

    #[test]
    fn a_drawer_resists_with_as_much_as_is_said() {
        for friction in [1.0, 4.0, 8.0] {
            let (less, more) =
                (slides(friction, 0.95 * friction), slides(friction, friction + 1.0));
            // By half of 2 m/s² over the square of a quarter of a second.
            assert!(less < 1e-4, "{friction} N: {less} m");
            assert!((more - 0.0625).abs() < 2e-3, "{friction} N: {more} m");
        }
    }

    #[test]
    fn a_round_thing_that_rocks_comes_to_rest() {
        for hollow in [true, false] {
            for (tilt, spin) in [(2e-3, 0.0), (0.05, 1.0), (0.09, 1.0), (0.17, 3.0)] {
                let tilts = rocking(hollow, tilt, spin);
                assert!(tilts.iter().all(|now| *now < tilt), "{tilts:?} rad");
                assert!(tilts[3] < 1e-5, "{tilts:?} rad");
            }
        }
    }
}
