//! The laboratory: an embedded reality that serves when no arm is plugged in.
//!
//! It is another world than the twin, run by the same engine with other numbers: its camera stands
//! elsewhere and has a lens, its joints have wrong zeros, friction and give, commands act late, sensors
//! are noisy, objects stand where nobody was told. All of that is drawn from a seed within the sizes that
//! [`LabSettings`] says, and none of it can be read: a [`Lab`] has no public field, no accessor for it, a
//! [`std::fmt::Debug`] that tells nothing, and no `Clone`, for a copy of reality could be run ahead.
//!
//! What can be had is what a person with an arm, a camera and kitchen scales has: [`Lab::photo`],
//! [`Lab::feedback`], commands, and after the run [`Lab::scales`].

mod bounds;
mod error;
mod fixed;
mod hidden;
mod negative;
mod passer;
mod readings;
mod sensor;
mod settings;
mod truth;

use std::collections::VecDeque;

use image::RgbImage;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::motion::Robot;
use crate::twin::render::{ArmLook, View};
use crate::twin::{self, Twin};
use crate::world::{ObjectState, Pose, Scene, WorldState};
pub use hidden::{HiddenEffect, draw, seal, unseal};
pub use negative::Negative;
pub use readings::{Feedback, Weighing};
pub use settings::{
    CameraError, Clutter, JointError, LabSettings, Latency, LensError, LightError, Mounting,
    Passer, People, Placement, Range, Readings, Scale, Sensor, Spot, Start, Switches, Things,
    Watch,
};

pub use error::{Error, Unsound};
use truth::Truth;

/// What a person sends to the arm.
#[derive(Debug, Clone, PartialEq)]
enum Order {
    Move { q: Vec<f64>, dq: Vec<f64> },
    Grip { opening: f64, speed: f64, force: f64 },
}

/// The embedded reality. What it hides is said in the [module's words](self).
pub struct Lab {
    world: Twin,
    truth: Truth,
    settings: LabSettings,
    look: ArmLook,
    seed: u64,
    photos: u64,
    steps: u64,
    /// Time advanced but not yet stepped, s.
    owed: f64,
    orders: VecDeque<(u64, Order)>,
    jaws: Jaws,
}

/// What the gripper's own electronics remember.
#[derive(Debug, Clone, Copy)]
struct Jaws {
    /// Opening aimed at, m.
    goal: f64,
    /// Whether the goal was narrower than the opening when it was set.
    closing: bool,
    /// Opening a little earlier, m, and the step it was read at.
    before: (f64, u64),
    moving: bool,
}

impl std::fmt::Debug for Lab {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Lab").field("seed", &self.seed).finish_non_exhaustive()
    }
}

/// Sets reality's chance apart: the twin is given the same seed, and must not know the laboratory's water drop by
/// drop.
///
/// Source: the finaliser of splitmix64, Steele, Lea and Flood, 2014.
fn own(seed: u64) -> u64 {
    // "laborato" in ASCII.
    const LABORATORY: u64 = 0x6C61_626F_7261_746F;
    let mut z = seed ^ LABORATORY;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// How far a stopped finger is from where it was sent, m, and how long it must stand still, s.
/// Chosen: thinner than what is held, and a few looks of the electronics.
const STOPPED_SHORT: f64 = 0.0015;
const STILL: f64 = 0.06;

impl Lab {
    /// Opens a laboratory with a robot, which differs from its file, and the things of a scene.
    ///
    /// # Errors
    ///
    /// [`Error::Settings`] for settings that make no sense, [`Error::NoPlace`] when the objects do not
    /// fit, [`Error::Twin`] when the robot or the scene cannot be simulated.
    pub fn new(
        robot: &Robot,
        scene: &Scene,
        settings: LabSettings,
        seed: u64,
    ) -> Result<Self, Error> {
        settings.check()?;
        let mut scene = scene.clone();
        let clutter = settings.clutter.iter().enumerate();
        scene.objects.extend(clutter.map(|(k, thing)| thing.object(k + 1)));
        let efforts: Vec<f64> = robot.joints().iter().map(|joint| joint.effort).collect();
        let truth = Truth::draw(&scene, &efforts, &settings, seed)?;
        let arm = robot.clone().with_zero_offsets(&truth.zeros).with_tool_shift(truth.tool);
        let laws = settings.laws()?;
        if let Some(why) = laws.iter().find_map(|law| law.hindrance(&scene, efforts.len())) {
            return Err(Unsound::from(why).into());
        }
        let (shift, turn) = truth.base;
        let beside = Isometry3::from_parts(
            Translation3::from(shift),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn),
        );
        scene.world_from_base = Pose::new(beside * scene.world_from_base.isometry());
        for (object, factor) in scene.objects.iter_mut().zip(&truth.mass) {
            object.mass *= factor;
        }
        for law in &laws {
            law.change_scene(&mut scene);
        }

        let q = match settings.start.q_rad.as_slice() {
            [] => robot.pose("home").map_or_else(|_| vec![0.0; efforts.len()], <[f64]>::to_vec),
            q => q.to_vec(),
        };
        let objects = scene.objects.iter().zip(&truth.places).zip(&truth.fill).map(
            |((object, &[x, y, yaw]), fill)| ObjectState {
                name: object.name.clone(),
                world_from_object: Some(Pose::upright(x, y, truth::base_of(&scene, object), yaw)),
                std: 0.0,
                water: object.cavity.map(|cavity| (cavity.filled * fill).min(cavity.capacity)),
            },
        );
        let state = WorldState {
            time: 0.0,
            q,
            opening: settings.start.opening_m.unwrap_or_else(|| robot.max_opening()),
            world_from_tool: Pose::identity(),
            held: None,
            objects: objects.collect(),
            spilt: Some(0.0),
            unknown: Vec::new(),
        };
        let mut physics = twin::Settings::for_arm(&arm);
        physics.arm.coulomb.clone_from(&truth.coulomb);
        physics.arm.viscous.clone_from(&truth.viscous);
        physics.arm.compliance.clone_from(&truth.compliance);
        physics.arm.uncompensated = truth.uncompensated;
        physics.friction.pad_object = truth.pad_friction.unwrap_or(physics.friction.pad_object);
        physics.friction.table_object =
            truth.table_friction.unwrap_or(physics.friction.table_object);
        physics.friction.drawer = truth.drawer.unwrap_or(physics.friction.drawer);
        physics.seed = own(seed);
        for law in &laws {
            law.change_settings(&mut physics);
        }
        let look = ArmLook::new(&arm);
        let mut world = Twin::new(&arm, &scene, &state, physics)?;
        let (delay, pull, comes) = truth.person;
        let base = scene.world_from_base.origin();
        world.meets(twin::Person::new(scene.handing(), base, delay, pull, comes));
        let opening = world.opening();
        let jaws = Jaws { goal: opening, closing: false, before: (opening, 0), moving: false };
        Ok(Self {
            world,
            truth,
            settings,
            look,
            seed,
            photos: 0,
            steps: 0,
            owed: 0.0,
            orders: VecDeque::new(),
            jaws,
        })
    }

    /// Takes a photo of the table as it is now.
    pub fn photo(&mut self) -> RgbImage {
        self.shutter().develop(None)
    }

    /// Takes a photo of the table as it is now, to be drawn by whoever wants it, while the arm goes on.
    pub fn shutter(&mut self) -> Negative {
        self.photos += 1;
        let key = self.key(1, self.photos);
        Negative::new(self.view(), self.truth.camera, self.truth.exposure, key)
    }

    /// Takes a picture, `width` px wide, without the noise that its size averages away; the laboratory takes no notice.
    pub fn film(&self, width: u32) -> Negative {
        let (camera, scale) = self.truth.camera.resized(width);
        Negative::of_film(self.view(), camera, self.truth.exposure.of_film(scale))
    }

    /// What there is to see now.
    fn view(&self) -> View {
        let mut view =
            View::of(self.world.scene(), &self.world.state(), &self.look, &self.world.link_poses())
                .with_water(&self.world.water(), self.world.fluid().radius());
        let time = self.time();
        view.bodies.extend(self.settings.moving.iter().filter_map(|passer| passer.body(time)));
        view.light = self.truth.light;
        view
    }

    /// Sends joint angles (rad) and speeds (rad/s) to the arm's servos, base first; they act after the
    /// arm's latency.
    ///
    /// # Errors
    ///
    /// [`Error::Twin`] for a list of the wrong length or a number that is not finite; nothing is sent then.
    pub fn command(&mut self, q: &[f64], dq: &[f64]) -> Result<(), Error> {
        let expected = self.truth.zeros.len();
        for (what, list) in [("q", q), ("dq", dq)] {
            if list.len() != expected {
                return Err(twin::Error::WrongLength { what, expected, found: list.len() }.into());
            }
            self.finite(what, list)?;
        }
        self.send(Order::Move { q: q.to_vec(), dq: dq.to_vec() });
        Ok(())
    }

    /// Sends the fingers to an opening (m between the pads) at a speed (m/s) with at most `force` N each.
    ///
    /// # Errors
    ///
    /// [`Error::Twin`] for a number that is not finite; nothing is sent then.
    pub fn grip(&mut self, opening: f64, speed: f64, force: f64) -> Result<(), Error> {
        self.finite("grip", &[opening, speed, force])?;
        self.send(Order::Grip { opening, speed, force });
        Ok(())
    }

    /// Tells the person before the arm that what it holds may be taken, or not any more. Whether anybody comes is hidden.
    pub fn offer(&mut self, on: bool) {
        self.world.offer(on);
    }

    /// Holds the arm where it is and forgets every order on its way. The arm's own controller does this,
    /// so it is not late. The fingers keep their grip: a stop must not drop what is held.
    ///
    /// # Errors
    ///
    /// [`Error::Twin`] when the physics has no finite joint angles left to hold.
    pub fn stop(&mut self) -> Result<(), Error> {
        self.orders.clear();
        let q = self.world.encoders();
        self.world.command(&q, &vec![0.0; q.len()])?;
        Ok(())
    }

    /// Lets `dt` seconds pass. Parts of a time step are kept for the next call.
    ///
    /// # Errors
    ///
    /// [`Error::Twin`] when the physics diverged; the laboratory must be opened anew then.
    pub fn advance(&mut self, dt: f64) -> Result<(), Error> {
        // A day at once is no tick of an arm's clock, and a number that a step does not change would be owed for
        // ever.
        const LONGEST: f64 = 86_400.0;
        let dt = if dt <= LONGEST { dt } else { f64::INFINITY };
        self.finite("dt", &[dt])?;
        let step = self.world.dt();
        self.owed += dt.max(0.0);
        // Half a rounding error short of a whole step is a whole step.
        while self.owed > step * (1.0 - 1e-6) {
            self.owed -= step;
            while self.orders.front().is_some_and(|&(due, _)| due <= self.steps) {
                if let Some((_, order)) = self.orders.pop_front() {
                    self.obey(order)?;
                }
            }
            self.world.step()?;
            self.steps += 1;
            self.feel_jaws();
        }
        Ok(())
    }

    /// Returns the time since the laboratory was opened, s.
    pub fn time(&self) -> f64 {
        self.world.time()
    }

    fn send(&mut self, order: Order) {
        let late = (self.truth.latency / self.world.dt()).round() as u64;
        self.orders.push_back((self.steps + late, order));
    }

    fn obey(&mut self, order: Order) -> Result<(), Error> {
        match order {
            Order::Move { q, dq } => self.world.command(&q, &dq)?,
            Order::Grip { opening, speed, force } => {
                let here = self.world.opening();
                self.jaws = Jaws {
                    goal: opening.max(0.0),
                    closing: opening < here,
                    before: (here, self.steps),
                    moving: (opening - here).abs() > STOPPED_SHORT,
                };
                self.world.grip(opening, speed, force)?;
            }
        }
        Ok(())
    }

    /// The gripper's electronics look every few hundredths of a second whether the fingers still move.
    fn feel_jaws(&mut self) {
        let (before, at) = self.jaws.before;
        if (self.steps - at) as f64 * self.world.dt() < STILL {
            return;
        }
        let here = self.world.opening();
        self.jaws.moving = (here - before).abs() > 2e-4;
        self.jaws.before = (here, self.steps);
    }

    fn finite(&self, what: &str, list: &[f64]) -> Result<(), Error> {
        if list.iter().all(|value| value.is_finite()) {
            return Ok(());
        }
        Err(twin::Error::NotFinite { what: what.to_owned(), time: self.time() }.into())
    }

    /// A key for the noise of one channel at one instant.
    fn key(&self, channel: u64, instant: u64) -> u64 {
        (self.seed ^ channel.wrapping_mul(0xD1B5_4A32_D192_ED03))
            .wrapping_add(instant.wrapping_mul(0x8CB9_2BA7_2F3D_8DD7))
            .rotate_left(17)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{Camera, Cavity, Intrinsics, Material, Object, Shape, Table};

    fn scene() -> Scene {
        Scene {
            name: "bench".into(),
            table: Table {
                size: Vector3::new(1.2, 0.8, 0.02),
                centre: [0.5, 0.0],
                colour: [200; 3],
            },
            marks: Vec::new(),
            objects: vec![Object {
                name: "jar".into(),
                kind: "Container".into(),
                shape: Shape::Cuboid { size: Vector3::new(0.065, 0.065, 0.14) },
                cavity: Some(Cavity { wall: 0.003, capacity: 250e-6, filled: 150e-6 }),
                looks: "transparent jar".into(),
                material: Material::Transparent,
                colour: [220; 3],
                mass: 0.16,
            }],
            drawers: Vec::new(),
            camera_name: "overhead".into(),
            camera: Camera::looking(
                Intrinsics::centred(900.0, 1280, 720),
                Vector3::new(1.25, 0.0, 0.85),
                Vector3::new(0.6, 0.0, 0.05),
            ),
            person: None,
            calibration: None,
            robot: "gen3_2f85".into(),
            world_from_base: Pose::identity(),
        }
    }

    /// With one stream for both, a rehearsal would know where each drop of the laboratory leaves.
    #[test]
    fn the_twin_given_the_same_seed_does_not_know_the_laboratorys_water() {
        let (robot, scene) = (Robot::gen3(), scene());
        let mut settings = LabSettings::perfect();
        let spot = Spot { x_m: 0.6, y_m: 0.1, yaw_rad: 0.0 };
        settings.placement.fixed.insert("jar".into(), spot);
        for seed in [0, 1, 7, u64::MAX] {
            let lab = Lab::new(&robot, &scene, settings.clone(), seed).unwrap();
            let mut state = lab.world.state();
            state.objects[0].water = Some(150e-6);
            let twin_of = |seed: u64| {
                let physics = twin::Settings { seed, ..twin::Settings::for_arm(&robot) };
                Twin::new(&robot, &scene, &state, physics).unwrap()
            };
            let twin = twin_of(seed);
            let water = |twin: &Twin| format!("{:?}", twin.fluid());
            assert_ne!(water(&lab.world), water(&twin));
            // It is the seed that makes the difference.
            assert_eq!(water(&lab.world), water(&twin_of(own(seed))));
        }
    }

    #[test]
    fn no_two_of_ten_thousand_seeds_share_a_stream_with_each_other_or_with_a_twin() {
        let mut streams: Vec<u64> = (0..10_000).flat_map(|seed| [seed, own(seed)]).collect();
        streams.sort_unstable();
        streams.dedup();
        assert_eq!(streams.len(), 20_000);
    }

    /// What is put down comes after what is drawn in the scene; the jar was drawn as if nothing were there.
    #[test]
    fn what_is_drawn_stays_clear_of_what_is_put() {
        let mut scene = scene();
        let can = Object { name: "can".into(), ..scene.objects[0].clone() };
        scene.objects.push(can);
        let mut settings = LabSettings::default();
        let can = Spot { x_m: 0.6, y_m: -0.1, yaw_rad: 0.0 };
        settings.placement.fixed.insert("can".into(), can);
        let apart = 2.0 * scene.objects[0].shape.outer_radius();
        for seed in 0..100 {
            let [x, y, _] = truth::places(&scene, &settings, seed).unwrap()[0];
            assert!((x - can.x_m).hypot(y - can.y_m) > apart, "seed {seed}");
        }
    }
}
