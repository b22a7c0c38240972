//! What is hidden: drawn once from a seed, kept inside this layer, printed nowhere.
//!
//! Each topic has its own stream of chance, so that a switch turned off, or a magnitude changed, leaves
//! the other topics' draws as they were.

use nalgebra::{UnitQuaternion, Vector3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::settings::{LabSettings, Range, Sensor, Switches};
use super::{Error, Unsound};
use crate::twin::render::Light;
use crate::world::{Camera, Pose, Scene, Shape, drawer, object::Object};

/// Everything the laboratory is that nobody outside knows.
pub(super) struct Truth {
    pub(super) camera: Camera,
    pub(super) light: Light,
    pub(super) exposure: Exposure,
    /// Turn of each joint's zero, rad: the joint stands at its reading plus this.
    pub(super) zeros: Vec<f64>,
    /// Shift of the gripper in the flange's frame, m.
    pub(super) tool: Vector3<f64>,
    /// Shift (m) and turn (rad) of the base on the table.
    pub(super) base: (Vector3<f64>, f64),
    pub(super) coulomb: Vec<f64>,
    pub(super) viscous: Vec<f64>,
    pub(super) compliance: Vec<f64>,
    pub(super) uncompensated: f64,
    /// From command to servo, s.
    pub(super) latency: f64,
    pub(super) tau_bias: Vec<f64>,
    pub(super) pad_friction: Option<f64>,
    pub(super) table_friction: Option<f64>,
    /// What resists drawers, N.
    pub(super) drawer: Option<f64>,
    /// Who takes what is held out: after how many s, with how many N, and whether anybody comes.
    pub(super) person: (f64, f64, bool),
    /// Factor on each object's mass and on each vessel's water.
    pub(super) mass: Vec<f64>,
    pub(super) fill: Vec<f64>,
    /// Place of each object: x, y in m, yaw in rad.
    pub(super) places: Vec<[f64; 3]>,
}

/// What the sensor of this very camera does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Exposure {
    /// Factor on red, green and blue.
    pub(super) gain: [f64; 3],
    /// Part of the light missing in the corners.
    pub(super) vignetting: f64,
    /// Standard deviation of the optical blur, px.
    pub(super) blur: f64,
    /// Electrons of white, infinite for a sensor without shot noise.
    pub(super) full_well: f64,
    /// Read noise as a part of white.
    pub(super) read_noise: f64,
}

impl Exposure {
    /// As it shows in a picture of `scale` times the width: blurred by fewer pixels, without noise.
    pub(super) fn of_film(&self, scale: f64) -> Self {
        Self { blur: self.blur * scale, full_well: f64::INFINITY, read_noise: 0.0, ..*self }
    }
}

/// The topics that draw separately.
#[derive(Clone, Copy)]
enum Topic {
    Camera = 1,
    Lens,
    Sensor,
    Light,
    Zeros,
    Mounting,
    Joints,
    Latency,
    Readings,
    Things,
    Places,
    People,
}

/// Chance for one topic.
struct Chance(StdRng);

impl Chance {
    fn new(seed: u64, topic: Topic) -> Self {
        // The golden-ratio step of splitmix64 keeps the streams of neighbouring seeds apart.
        Self(StdRng::seed_from_u64(seed ^ (topic as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)))
    }

    fn even(&mut self, [low, high]: Range) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// A normal draw, drawn again beyond two standard deviations.
    fn normal(&mut self, sigma: f64) -> f64 {
        loop {
            // Box and Muller.
            let (u, v): (f64, f64) = (self.0.random(), self.0.random());
            let z = (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos();
            if z.abs() <= 2.0 {
                return sigma * z;
            }
        }
    }

    fn normal3(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::new(self.normal(sigma), self.normal(sigma), self.normal(sigma))
    }
}

impl Truth {
    /// Draws the truth of a laboratory. `efforts` are the arm's largest joint torques, N·m.
    pub(super) fn draw(
        scene: &Scene,
        efforts: &[f64],
        settings: &LabSettings,
        seed: u64,
    ) -> Result<Self, Error> {
        let on = settings.switches;
        let n = efforts.len();
        // Small joints have a third of a large one's friction and stiffness.
        let part = |i: usize| if efforts[i] > 20.0 { 1.0 } else { 1.0 / 3.0 };

        let mut chance = Chance::new(seed, Topic::Zeros);
        let zeros = (0..n).map(|_| chance.normal(settings.joints.zero_sigma_rad)).collect();
        let mut chance = Chance::new(seed, Topic::Mounting);
        let tool = chance.normal3(settings.mounting.tool_sigma_m);
        let shift = chance.normal3(settings.mounting.base_sigma_m);
        let base = (
            Vector3::new(shift.x, shift.y, 0.0),
            chance.normal(settings.mounting.base_turn_sigma_rad),
        );
        let mut chance = Chance::new(seed, Topic::Joints);
        let coulomb = (0..n).map(|i| part(i) * chance.even(settings.joints.coulomb_nm)).collect();
        let viscous =
            (0..n).map(|i| part(i) * chance.even(settings.joints.viscous_nm_s_per_rad)).collect();
        let compliance =
            (0..n).map(|i| chance.even(settings.joints.compliance_rad_per_nm) / part(i)).collect();
        let uncompensated = chance.even(settings.joints.uncompensated);
        let latency = Chance::new(seed, Topic::Latency).even(settings.latency.command_s);
        let mut chance = Chance::new(seed, Topic::Readings);
        let tau_bias =
            (0..n).map(|i| part(i) * chance.even(settings.readings.tau_bias_nm)).collect();
        let mut chance = Chance::new(seed, Topic::Things);
        let pad = chance.even(settings.things.pad_friction);
        let table = chance.even(settings.things.table_friction);
        let mass = scene.objects.iter().map(|_| 1.0 + chance.even(settings.things.mass)).collect();
        let fill = scene.objects.iter().map(|_| 1.0 + chance.even(settings.things.fill)).collect();
        let drawer = chance.even(settings.things.drawer_n);

        let mut chance = Chance::new(seed, Topic::People);
        let people = &settings.people;
        let (delay, pull) = (chance.even(people.delay_s), chance.even(people.pull_n));
        let comes = chance.even([0.0, 1.0]) < people.comes;

        let keep = |on: bool, values: Vec<f64>, nominal: f64| {
            if on { values } else { vec![nominal; values.len()] }
        };
        Ok(Self {
            camera: camera(scene, settings, seed),
            light: light(settings, seed),
            exposure: exposure(&settings.sensor, on, seed),
            zeros: keep(on.zero_offsets, zeros, 0.0),
            tool: if on.tool_offset { tool } else { Vector3::zeros() },
            base: if on.tool_offset { base } else { (Vector3::zeros(), 0.0) },
            coulomb: keep(on.joint_friction, coulomb, 0.0),
            viscous: keep(on.joint_friction, viscous, 0.0),
            compliance: keep(on.compliance, compliance, 0.0),
            uncompensated: if on.compliance { uncompensated } else { 0.0 },
            latency: if on.latency { latency } else { 0.0 },
            tau_bias: keep(on.readings, tau_bias, 0.0),
            pad_friction: on.surfaces.then_some(pad),
            table_friction: on.surfaces.then_some(table),
            drawer: on.surfaces.then_some(drawer),
            person: (delay, pull, comes),
            mass: keep(on.surfaces, mass, 1.0),
            fill: keep(on.fill, fill, 1.0),
            places: places(scene, settings, seed)?,
        })
    }
}

/// The camera as it is: what a calibration says of its inside is so, everything else is off.
fn camera(scene: &Scene, settings: &LabSettings, seed: u64) -> Camera {
    let assumed = scene.camera;
    let mut camera = assumed;
    if settings.switches.camera_pose {
        let mut chance = Chance::new(seed, Topic::Camera);
        let shift = chance.normal3(settings.camera.position_sigma_m);
        let turn = UnitQuaternion::from_scaled_axis(chance.normal3(settings.camera.turn_sigma_rad));
        let pose = assumed.world_from_camera;
        camera.world_from_camera = Pose::from_parts(pose.origin() + shift, pose.rotation() * turn);
    }
    if settings.switches.lens && scene.calibration.is_none() {
        let mut chance = Chance::new(seed, Topic::Lens);
        let lens = &settings.lens;
        let i = &mut camera.intrinsics;
        i.fx *= 1.0 + chance.even(lens.focal);
        i.fy = i.fx
            * (assumed.intrinsics.fy / assumed.intrinsics.fx)
            * (1.0 + chance.even(lens.aspect));
        i.cx += chance.even(lens.principal_px);
        i.cy += chance.even(lens.principal_px);
        i.k1 = chance.even(lens.k1);
        i.k2 = chance.even(lens.k2);
    }
    camera
}

fn light(settings: &LabSettings, seed: u64) -> Light {
    let mut light = Light::default();
    if settings.switches.light {
        let mut chance = Chance::new(seed, Topic::Light);
        let turn = UnitQuaternion::from_scaled_axis(chance.normal3(settings.light.turn_sigma_rad));
        light.towards = turn * light.towards;
        // A lamp lower than this would shine under the arm's base rather than on the table.
        light.towards.z = light.towards.z.max(0.5 * light.towards.norm());
        light.intensity *= 1.0 + chance.even(settings.light.lamp);
        light.ambient *= 1.0 + chance.even(settings.light.room);
    }
    light
}

fn exposure(sensor: &Sensor, on: Switches, seed: u64) -> Exposure {
    if !on.sensor {
        return Exposure {
            gain: [1.0; 3],
            vignetting: 0.0,
            blur: 0.0,
            full_well: f64::INFINITY,
            read_noise: 0.0,
        };
    }
    let mut chance = Chance::new(seed, Topic::Sensor);
    let all = 1.0 + chance.even(sensor.exposure);
    let red = 1.0 + chance.even(sensor.white_balance);
    let blue = 1.0 + chance.even(sensor.white_balance);
    Exposure {
        gain: [all * red, all, all * blue],
        vignetting: chance.even(sensor.vignetting),
        blur: sensor.blur_px,
        full_well: sensor.full_well,
        read_noise: sensor.read_noise,
    }
}

/// Puts the objects on the table one after another, all again when the last find no place. A crowd that does not go
/// where the settings would have it is put closer together and farther round.
pub(super) fn places(
    scene: &Scene,
    settings: &LabSettings,
    seed: u64,
) -> Result<Vec<[f64; 3]>, Error> {
    // With one wish. Chosen: a try is a few draws, so that even all of them are soon over.
    const TRIES: usize = 20_000;
    /// How often the wish is loosened: after four times things stand within 41 % of their distance.
    const LOOSER: usize = 4;
    let wish = &settings.placement;
    if let Some(name) = wish.fixed.keys().find(|name| scene.object(name).is_none()) {
        return Err(Unsound::NoObject(name.clone()).into());
    }
    let mut chance = Chance::new(seed, Topic::Places);
    let base = scene.world_from_base;
    let mut wish = wish.clone();
    'again: for attempt in 0..TRIES * (LOOSER + 1) {
        if attempt > 0 && attempt % TRIES == 0 {
            wish.apart_m = [0.8 * wish.apart_m[0], 1.25 * wish.apart_m[1]];
            wish.radius_m = [0.95 * wish.radius_m[0], 1.03 * wish.radius_m[1]];
        }
        let mut places: Vec<[f64; 3]> = Vec::new();
        for (k, object) in scene.objects.iter().enumerate() {
            // Drawn even where it is not used, so that fixing one object leaves the others alone.
            let radius = chance.even(wish.radius_m);
            let angle = chance.even([-wish.side_rad, wish.side_rad]) + base.yaw();
            let yaw = chance.even([-std::f64::consts::PI, std::f64::consts::PI]);
            if let Some(spot) = wish.fixed.get(&object.name) {
                places.push([spot.x_m, spot.y_m, spot.yaw_rad]);
                continue;
            }
            if scene.drawer(&object.name).is_some() {
                // It goes where its case goes.
                places.push([f64::NAN; 3]);
                continue;
            }
            // The ring is for what a hand takes: of a case the handle, half drawn.
            let case = scene.drawers.iter().find(|drawer| drawer.case == object.name);
            let behind = case.map_or(0.0, |drawer| match object.shape {
                Shape::Cuboid { size } => 0.5 * (size.x + drawer.travel),
                _ => 0.0,
            });
            let radius = radius + behind;
            let (x, y) =
                (base.origin().x + radius * angle.cos(), base.origin().y + radius * angle.sin());
            // A drawer is put where somebody who stands at the base would open it.
            let yaw = if scene.is_fixed(&object.name) {
                angle + std::f64::consts::PI + FACING * yaw
            } else {
                yaw
            };
            let touching =
                |other: &Object| object.shape.outer_radius() + other.shape.outer_radius() + 0.01;
            let clear = scene.objects[..k].iter().zip(&places).all(|(other, &[ox, oy, _])| {
                let apart = (x - ox).hypot(y - oy);
                ox.is_nan()
                    || (apart >= wish.apart_m[0].max(touching(other)) && apart <= wish.apart_m[1])
            });
            let clear_of_fixed = scene.objects[k..].iter().all(|other| {
                let spot = wish.fixed.get(&other.name);
                spot.is_none_or(|spot| (x - spot.x_m).hypot(y - spot.y_m) >= touching(other))
            });
            if !clear || !clear_of_fixed || !stands(scene, object, x, y, wish.edge_m, wish.mark_m) {
                continue 'again;
            }
            places.push([x, y, yaw]);
        }
        if !rooms(scene, &places) {
            continue 'again;
        }
        trays(scene, &mut places);
        return Ok(places);
    }
    Err(Error::NoPlace { tries: TRIES * (LOOSER + 1) })
}

/// A case looks at the base but for this share of a turn drawn anyhow: 18 deg either way.
const FACING: f64 = 0.1;
/// Room before an open drawer for the hand that draws it, m. Chosen: a palm is 0.1 m behind the pads.
const BEFORE: f64 = 0.1;

/// Whether nothing stands where a drawer is to open, and nothing of it beyond the table.
fn rooms(scene: &Scene, places: &[[f64; 3]]) -> bool {
    let at = |name: &str| scene.objects.iter().position(|object| object.name == name);
    scene.drawers.iter().all(|drawer| {
        let Some(k) = at(&drawer.case) else { return true };
        let Shape::Cuboid { size } = scene.objects[k].shape else { return true };
        let [x, y, yaw] = places[k];
        let ahead = 0.5 * size.x + drawer.travel + drawer::REACH + BEFORE;
        scene.objects.iter().zip(places).enumerate().all(|(other, (object, &[ox, oy, _]))| {
            let (dx, dy) = (ox - x, oy - y);
            let (along, aside) = (dx * yaw.cos() + dy * yaw.sin(), dy * yaw.cos() - dx * yaw.sin());
            let radius = object.shape.outer_radius() + 0.01;
            let free =
                along < -radius || along > ahead + radius || aside.abs() > 0.5 * size.y + radius;
            other == k || ox.is_nan() || free
        })
    })
}

/// Puts closed trays into their cases.
fn trays(scene: &Scene, places: &mut [[f64; 3]]) {
    let at = |name: &str| scene.objects.iter().position(|object| object.name == name);
    for drawer in &scene.drawers {
        let (Some(case), Some(tray)) = (at(&drawer.case), at(&drawer.tray)) else { continue };
        let [x, y, yaw] = places[case];
        if let Some(pose) = drawer.tray_at(scene, &Pose::upright(x, y, 0.0, yaw), 0.0) {
            places[tray] = [pose.origin().x, pose.origin().y, yaw];
        }
    }
}

/// Returns how high above the table the base of a thing is, m: of what slides in a case not 0.
pub(super) fn base_of(scene: &Scene, object: &Object) -> f64 {
    let closed = scene.drawer(&object.name).and_then(|drawer| drawer.case_from_tray(scene, 0.0));
    closed.map_or(0.0, |closed| closed.translation.z)
}

fn stands(scene: &Scene, object: &Object, x: f64, y: f64, edge: f64, mark: f64) -> bool {
    let reach = object.shape.outer_radius();
    scene.table.holds(x, y, reach + edge)
        && scene.marks.iter().all(|m| (x - m.x).hypot(y - m.y) >= reach + m.radius + mark)
}
