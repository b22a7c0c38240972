//! The world, stepped forward: everything that is planned is first tried here.
//!
//! A [`Twin`] is built from an arm, a scene and a state; commands go in, steps are taken, states come
//! out. [`physics`] moves the rigid bodies, [`fluid`] the water, [`effect`] puts in what reality was found
//! to add. The same engine with other numbers serves as the lab. Time advances by [`Twin::step`] alone and
//! all chance comes from the seed, so the same calls give the same bits.
//!
//! ```
//! use nalgebra::Vector3;
//! use trueup::motion::Robot;
//! use trueup::twin::{Settings, Twin};
//! use trueup::world::{Camera, Intrinsics, Material, Object, ObjectState, Pose, Scene, Shape, Table, WorldState};
//!
//! let robot = Robot::gen3();
//! let block = Object {
//!     name: "block".into(),
//!     kind: "Block".into(),
//!     shape: Shape::Cuboid { size: Vector3::new(0.05, 0.05, 0.05) },
//!     cavity: None,
//!     looks: String::new(),
//!     material: Material::Opaque,
//!     colour: [128; 3],
//!     mass: 0.3,
//! };
//! let eye = Vector3::new(1.25, 0.0, 0.85);
//! let scene = Scene {
//!     name: "drop".into(),
//!     table: Table { size: Vector3::new(1.2, 0.8, 0.02), centre: [0.5, 0.0], colour: [0; 3] },
//!     marks: Vec::new(),
//!     objects: vec![block],
//!     drawers: Vec::new(),
//!     camera_name: "overhead".into(),
//!     camera: Camera::looking(Intrinsics::centred(900.0, 1280, 720), eye, Vector3::zeros()),
//!     person: None,
//!     calibration: None,
//!     robot: "gen3_2f85".into(),
//!     world_from_base: Pose::identity(),
//! };
//! let start = WorldState {
//!     time: 0.0,
//!     q: robot.pose("home").unwrap().to_vec(),
//!     opening: 0.085,
//!     world_from_tool: Pose::identity(),
//!     held: None,
//!     objects: vec![ObjectState {
//!         name: "block".into(),
//!         world_from_object: Some(Pose::new(nalgebra::Isometry3::translation(0.3, 0.3, 0.2))),
//!         std: 0.0,
//!         water: None,
//!     }],
//!     spilt: None,
//!     unknown: Vec::new(),
//! };
//! let mut twin = Twin::new(&robot, &scene, &start, Settings::for_arm(&robot)).unwrap();
//! twin.run(1.0).unwrap();
//! // It fell 20 cm, and lies on the table.
//! let height = twin.state().objects[0].world_from_object.unwrap().origin().z;
//! assert!(height.abs() < 1e-3 && twin.contacts("block", "table"));
//! ```

pub mod convert;
pub mod physics;
pub mod fluid;
pub mod effect;
mod error;
pub mod basin;
mod grip;
pub mod hold;
mod person;
pub mod render;
mod sensing;
mod settings;

use std::sync::{Arc, OnceLock};

use nalgebra::{Isometry3, Vector3};

pub use effect::Effect;
pub use error::{Error, Hindrance, Unfit};
pub use fluid::{Dribble, Fluid, FluidSettings, Rim};
pub use person::Person;
pub use settings::{ArmSettings, FrictionSettings, GripperSettings, Settings};

use crate::motion::Robot;
use crate::world::{ObjectState, Pose, Scene, Unknown, WorldState};
use fluid::{Filling, Vessel};
use grip::Grip;
use physics::{Part, Physics};
use sensing::Load;

/// The twin: arm, gripper, table, objects and water, at one instant and on.
#[derive(Debug, Clone)]
pub struct Twin {
    robot: Arc<Robot>,
    scene: Arc<Scene>,
    settings: Settings,
    physics: Physics,
    fluid: Fluid,
    /// Object of each vessel of the water, in the scene's order.
    vessels: Vec<usize>,
    /// Rigid steps per step of the water.
    stride: u64,
    steps: u64,
    began: f64,
    /// What else was seen on the table; nothing of it is simulated.
    unknown: Vec<Unknown>,
    command: (Vec<f64>, Vec<f64>),
    grip: Grip,
    /// Speeds (rad/s) and accelerations (rad/s²) of the arm's joints in the last step.
    motion: (Vec<f64>, Vec<f64>),
    /// Speeds after the steps before it, the latest first, rad/s.
    earlier: [Vec<f64>; 4],
    /// What the joints carry now, once somebody has asked.
    load: OnceLock<Load>,
    /// Who may take what is held out, and what somebody pulls with now, N at a place in the world, m.
    person: Option<Person>,
    pulled: Option<(Vector3<f64>, Vector3<f64>)>,
}

/// A twin at one instant, to return to.
#[derive(Debug, Clone)]
pub struct Snapshot(Box<Twin>);

impl Snapshot {
    /// Returns a twin of its own at that instant, to try something from there beside the first.
    pub fn into_twin(self) -> Twin {
        *self.0
    }
}

impl Twin {
    /// Builds the twin in the given state.
    ///
    /// Objects without a pose are not there. Water the state does not know is what the scene says was
    /// filled in. An object named as held is gripped with the settings' force from the first step on.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] or [`Error::NotFinite`] when the state or settings do not fit the arm,
    /// [`Error::Overfull`] and [`Error::Massless`] when the scene cannot be.
    pub fn new(
        robot: &Robot,
        scene: &Scene,
        state: &WorldState,
        settings: Settings,
    ) -> Result<Self, Error> {
        let finite = |what: &str, ok: bool| {
            let what = what.to_owned();
            if ok { Ok(()) } else { Err(Error::NotFinite { what, time: state.time }) }
        };
        finite("q", state.q.iter().all(|q| q.is_finite()))?;
        finite("opening", state.opening.is_finite())?;
        finite("dt", settings.dt.is_finite() && settings.dt > 0.0)?;
        let stride = (settings.fluid.dt / settings.dt).round().max(1.0);
        let mut vessels = Vec::new();
        let mut fillings = Vec::new();
        for (i, object) in scene.objects.iter().enumerate() {
            let known = state.object(&object.name);
            let Some(pose) = known.and_then(|known| known.world_from_object) else { continue };
            finite(&object.name, is_finite(pose.isometry()))?;
            let (Some(cavity), Some(vessel)) = (object.cavity, Vessel::new(object)) else {
                continue;
            };
            let water = known.and_then(|known| known.water).unwrap_or(cavity.filled);
            finite(&object.name, water.is_finite() && water >= 0.0)?;
            vessels.push(i);
            let rim = settings.rims.get(&object.name).copied().unwrap_or_default();
            fillings.push(Filling { vessel, pose: *pose.isometry(), water, rim });
        }
        let physics = Physics::new(robot, scene, state, &settings)?;
        let fluid_dt = stride * settings.dt;
        let fluid = Fluid::new(
            &settings.fluid,
            &fillings,
            scene.table,
            settings.gravity,
            fluid_dt,
            settings.seed,
        )
        .map_err(|k| Error::Overfull {
            vessel: scene.objects[vessels[k]].name.clone(),
            water_ml: fillings[k].water * 1e6,
        })?;
        let n = state.q.len();
        let goal = if state.held.is_some() { 0.0 } else { state.opening / 2.0 };
        let mut twin = Self {
            robot: Arc::new(robot.clone()),
            scene: Arc::new(scene.clone()),
            physics,
            fluid,
            vessels,
            stride: stride as u64,
            steps: 0,
            began: state.time,
            unknown: state.unknown.clone(),
            command: (state.q.clone(), vec![0.0; n]),
            grip: Grip { aim: goal, goal, speed: 0.0, force: settings.gripper.force },
            motion: (vec![0.0; n], vec![0.0; n]),
            earlier: std::array::from_fn(|_| vec![0.0; n]),
            load: OnceLock::new(),
            person: None,
            pulled: None,
            settings,
        };
        twin.feel_water();
        Ok(twin)
    }

    /// Sets the joint angles (rad) and speeds (rad/s) the arm's servos aim at, base first.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] or [`Error::NotFinite`]; the command before stays in force then.
    pub fn command(&mut self, q: &[f64], dq: &[f64]) -> Result<(), Error> {
        let expected = self.robot.n_joints();
        for (what, list) in [("q", q), ("dq", dq)] {
            if list.len() != expected {
                return Err(Error::WrongLength { what, expected, found: list.len() });
            }
            if list.iter().any(|value| !value.is_finite()) {
                return Err(Error::NotFinite { what: what.into(), time: self.time() });
            }
        }
        self.command = (q.to_vec(), dq.to_vec());
        Ok(())
    }

    /// Advances the twin by one time step.
    ///
    /// # Errors
    ///
    /// [`Error::NotFinite`] when the physics diverged; the twin is of no use then, restore a snapshot.
    pub fn step(&mut self) -> Result<(), Error> {
        let dt = self.settings.dt;
        let (mut aim, speed) = self.command.clone();
        if self.settings.arm.compliance.iter().any(|&c| c > 0.0) {
            // The servo brings the motor to the command; the link hangs from it by the gear's spring.
            let load = &self.load().now;
            for (i, aim) in aim.iter_mut().enumerate() {
                *aim -= self.settings.arm.compliance[i] * load[i];
            }
        }
        self.physics.aim_arm(&aim, &speed, &self.settings);

        let jaw_speed = self.grip.step(dt);
        self.physics.aim_jaws(self.grip.aim, jaw_speed, self.grip.force, &self.settings);

        self.meet_person();
        self.physics.step(self.settings.friction.pad_creep);
        self.steps += 1;
        let speeds = self.physics.dq();
        let acceleration = speeds.iter().zip(&self.motion.0).map(|(now, then)| (now - then) / dt);
        let now = (speeds.clone(), acceleration.collect());
        self.earlier.rotate_right(1);
        self.earlier[0] = std::mem::replace(&mut self.motion, now).0;

        if self.steps.is_multiple_of(self.stride) && !self.vessels.is_empty() {
            let poses: Vec<Isometry3<f64>> =
                self.vessels.iter().filter_map(|&i| self.physics.object_pose(i)).collect();
            if poses.iter().all(is_finite) {
                self.fluid.step(&poses);
                self.feel_water();
            }
        }
        self.load = OnceLock::new();
        self.check()
    }

    /// Advances the twin by `seconds`, to the nearest step.
    ///
    /// # Errors
    ///
    /// As [`Self::step`].
    pub fn run(&mut self, seconds: f64) -> Result<(), Error> {
        let steps = (seconds / self.settings.dt).round().max(0.0) as u64;
        (0..steps).try_for_each(|_| self.step())
    }

    /// Has somebody stand before the arm who may take what is offered.
    pub fn meets(&mut self, person: Person) {
        self.person = Some(person);
    }

    /// Tells whoever stands before the arm that what is held out may be taken, or not any more.
    pub fn offer(&mut self, on: bool) {
        if let Some(person) = &mut self.person {
            person.hears(on);
        }
    }

    /// Lets whoever stands before the arm pull at what is offered, or go away with it.
    fn meet_person(&mut self) {
        self.pulled = None;
        let Some(mut person) = self.person.take_if(|person| person.is_asked()) else { return };
        let tool = self.robot.tool().unwrap_or(self.robot.tip());
        let tool = self.physics.link_pose(tool).translation.vector;
        let speed = self.motion.0.iter().fold(0.0_f64, |most, dq| most.max(dq.abs()));
        match person.step(self.time(), tool, speed, self.held_index()) {
            person::Does::Waits => {}
            person::Does::Pulls(object, force) => {
                let at = self.physics.push(object, force, self.settings.dt);
                // What pulls at the held thing pulls at the hand.
                self.pulled =
                    at.filter(|_| self.held_index() == Some(object)).map(|at| (at, force));
            }
            person::Does::Takes(object, to) => self.physics.take(object, to),
        }
        self.person = Some(person);
    }

    /// NaN is caught where a step ends.
    fn check(&self) -> Result<(), Error> {
        let fail = |what: &str| Error::NotFinite { what: what.to_owned(), time: self.time() };
        if !self.physics.q().iter().all(|q| q.is_finite()) {
            return Err(fail("q"));
        }
        for (i, object) in self.scene.objects.iter().enumerate() {
            if self.physics.object_pose(i).is_some_and(|pose| !is_finite(&pose)) {
                return Err(fail(&object.name));
            }
        }
        Ok(())
    }

    /// Lets each vessel feel the weight of its water.
    fn feel_water(&mut self) {
        for (k, &object) in self.vessels.iter().enumerate() {
            self.physics.add_inertia(object, &self.fluid.felt(k));
        }
    }

    /// Returns the time, s, on from that of the state the twin was built from.
    pub fn time(&self) -> f64 {
        self.began + self.steps as f64 * self.settings.dt
    }

    /// Returns the time step, s.
    pub fn dt(&self) -> f64 {
        self.settings.dt
    }

    /// Returns the true joint angles, on the links' side, base first, rad.
    pub fn q(&self) -> Vec<f64> {
        self.physics.q()
    }

    /// Returns the joint speeds, base first, rad/s.
    pub fn dq(&self) -> Vec<f64> {
        self.physics.dq()
    }

    /// Returns the opening between the pads, m.
    pub fn opening(&self) -> f64 {
        self.physics.jaws().iter().sum()
    }

    /// Returns whether two things touch: links, objects or `table`, by name. What is not there touches
    /// nothing.
    pub fn contacts(&self, a: &str, b: &str) -> bool {
        let part = |name: &str| {
            if name == "table" {
                return Some(Part::Table);
            }
            let object = self.scene.objects.iter().position(|object| object.name == name);
            let link = || self.robot.links().iter().position(|link| link.name == name);
            object
                .map(Part::Object)
                .or_else(|| link().map(|link| Part::Body(self.physics.tree.links[link].0)))
        };
        matches!((part(a), part(b)), (Some(a), Some(b)) if self.physics.touch(a, b))
    }

    /// Returns the object both pads touch, if any.
    fn held_index(&self) -> Option<usize> {
        (0..self.scene.objects.len()).find(|&object| self.physics.holds(object))
    }

    /// Returns the poses of all links in the world, by name.
    pub fn link_poses(&self) -> Vec<(&str, Isometry3<f64>)> {
        let links = self.robot.links().iter().enumerate();
        links.map(|(i, link)| (link.name.as_str(), self.physics.link_pose(i))).collect()
    }

    /// Returns the velocity of an object's centre of mass (m/s) and its spin (rad/s).
    pub fn object_velocity(&self, name: &str) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let object = self.scene.objects.iter().position(|object| object.name == name)?;
        self.physics.object_velocity(object)
    }

    /// Returns the centres of the water's particles that stand in no vessel, in the world, m.
    pub fn water(&self) -> Vec<Vector3<f32>> {
        self.fluid.free()
    }

    /// Returns the water that clings to the lip of a vessel and will still run from it, m³.
    pub fn clinging(&self, name: &str) -> f64 {
        let vessel =
            self.vessels.iter().position(|&object| self.scene.objects[object].name == name);
        vessel.map_or(0.0, |k| self.fluid.clinging(k))
    }

    /// Returns the water itself.
    pub fn fluid(&self) -> &Fluid {
        &self.fluid
    }

    /// Returns the arm.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Returns the scene the twin was built from.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Returns the settings the twin was built with.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns everything that changes, as it is now.
    pub fn state(&self) -> WorldState {
        let objects = self.scene.objects.iter().enumerate().map(|(i, object)| ObjectState {
            name: object.name.clone(),
            world_from_object: self.physics.object_pose(i).map(Pose::new),
            std: 0.0,
            water: self
                .vessels
                .iter()
                .position(|&vessel| vessel == i)
                .map(|k| self.fluid.volume_in(k)),
        });
        let tool = self.robot.tool().unwrap_or(self.robot.tip());
        WorldState {
            time: self.time(),
            q: self.q(),
            opening: self.opening(),
            world_from_tool: Pose::new(self.physics.link_pose(tool)),
            held: self.held_index().map(|i| self.scene.objects[i].name.clone()),
            objects: objects.collect(),
            spilt: Some(self.fluid.spilt()),
            unknown: self.unknown.clone(),
        }
    }

    /// Returns the twin as it is now, to come back to.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot(Box::new(self.clone()))
    }

    /// Returns to a snapshot; stepping on gives the same bits as it did from there.
    pub fn restore(&mut self, snapshot: &Snapshot) {
        *self = (*snapshot.0).clone();
    }
}

fn is_finite(pose: &Isometry3<f64>) -> bool {
    pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|value| value.is_finite())
}
