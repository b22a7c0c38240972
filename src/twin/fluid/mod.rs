//! Water as particles: what pours, splashes, and is never lost.
//!
//! A position-based fluid: particles are moved by gravity, then pushed apart until their density is
//! that of water, and their velocity is what they moved. Vessels are analytic (`vessel.rs`) and moved
//! from outside; the water answers by its mass and centre of mass. Each particle carries the same
//! volume, so what is in a vessel is counted, and nothing is created or lost.
//!
//! Water that has settled in a vessel that is carried gently rides along frozen and costs nothing; it
//! wakes when the vessel tilts, is accelerated, or something falls in. The arm and objects that are not
//! vessels do not touch the water. All of it runs in the caller's thread, so the result has the same bits
//! for any number of threads.
//!
//! Source: Macklin and Müller, "Position based fluids", 2013; Schechter and Bridson, "Ghost SPH for
//! animating water", 2012 (XSPH viscosity).

mod film;
mod grid;
mod kernel;
mod placed;
mod rim;
mod sleep;
mod solve;
mod vessel;

use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng, rngs::StdRng};

pub use film::Dribble;
pub use kernel::Kernel;
pub use rim::Rim;
pub use vessel::Vessel;

use crate::motion::Inertial;
use crate::world::{Table, WATER_DENSITY};
use film::Film;
use placed::Placed;
use rim::Lip;
use solve::Scratch;

/// Time constant with which a vessel feels its water move, s: the grasp would feel every particle's
/// knock otherwise.
const FEEDBACK_TIME: f64 = 0.03;

/// How the water is resolved and when it sleeps.
#[derive(Debug, Clone, PartialEq)]
pub struct FluidSettings {
    /// Number of particles all the water in the scene is divided into.
    pub particles: usize,
    /// Time step, s; rounded to a whole number of the rigid bodies' steps.
    pub dt: f64,
    /// Density iterations per step.
    pub iterations: usize,
    /// Share of the difference to its neighbours' velocity that a particle gives up per step.
    pub viscosity: f32,
    /// Share of the velocity along a wall that a particle at it gives up per step.
    pub wall_drag: f32,
    /// Whether settled water in a quiet vessel rides along frozen.
    pub freeze: bool,
    /// Tilt since it froze that wakes water, rad.
    pub wake_tilt: f64,
    /// Acceleration of the vessel that wakes water, m/s².
    pub wake_acceleration: f64,
}

impl Default for FluidSettings {
    fn default() -> Self {
        Self {
            particles: 600,
            dt: 1.0 / 240.0,
            iterations: 4,
            viscosity: 0.05,
            wall_drag: 0.02,
            freeze: true,
            wake_tilt: 0.04,
            wake_acceleration: 1.0,
        }
    }
}

/// What a particle is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// It moves.
    Live,
    /// It rides in a vessel, frozen.
    Riding(usize),
    /// It clings to the lip of a vessel.
    Clinging(usize),
    /// It came to rest on the table.
    Spilt,
    /// It fell off the table.
    Gone,
}

/// A vessel and how it moves.
#[derive(Debug, Clone)]
struct Moving {
    vessel: Vessel,
    /// Square of the distance from the vessel's origin beyond which it does not touch a particle, m².
    reach2: f32,
    now: Isometry3<f32>,
    /// From the world into the vessel, as it stood before the step and as it stands now.
    into_before: Placed,
    into: Placed,
    /// From the vessel into the world as it stands now.
    out: Placed,
    velocity: Vector3<f32>,
    spin: Vector3<f32>,
    /// Smoothed acceleration of the middle, m/s².
    acceleration: Vector3<f32>,
    frozen: bool,
    /// Direction of up in the vessel's frame when its water froze.
    up_when_frozen: Vector3<f32>,
    /// For how long the water has been calm, s.
    calm: f32,
    /// Mass, kg, and centre of mass, m, in the vessel's frame, as the vessel feels them.
    felt: (f64, Vector3<f64>),
}

impl Moving {
    fn velocity_at(&self, p: &Vector3<f32>) -> Vector3<f32> {
        self.velocity + self.spin.cross(&(p - self.now.translation.vector))
    }

    fn local(&self, p: &Vector3<f32>) -> Vector3<f32> {
        self.into.point(p)
    }

    fn local_before(&self, p: &Vector3<f32>) -> Vector3<f32> {
        self.into_before.point(p)
    }

    fn world(&self, p: &Vector3<f32>) -> Vector3<f32> {
        self.out.point(p)
    }

    fn turned(&self, v: &Vector3<f32>) -> Vector3<f32> {
        self.out.vector(v)
    }
}

/// All the water.
#[derive(Debug, Clone)]
pub struct Fluid {
    settings: FluidSettings,
    dt: f32,
    gravity: Vector3<f32>,
    kernel: Kernel,
    /// Volume of one particle, m³.
    volume: f64,
    spacing: f32,
    relaxation: f32,
    table: Table,
    vessels: Vec<Moving>,
    /// The water on each vessel's lip.
    films: Vec<Film>,
    /// What else holds for each vessel's rim.
    lips: Vec<Lip>,
    position: Vec<Vector3<f32>>,
    velocity: Vec<Vector3<f32>>,
    /// Bit k: inside vessel k.
    inside: Vec<u32>,
    phase: Vec<Phase>,
    touched_table: Vec<bool>,
    rest_time: Vec<f32>,
    /// Places of frozen and clinging particles in their vessel's frame.
    ride: Vec<Vector3<f32>>,
    scratch: Scratch,
}

/// A vessel to fill: what it is, where, and with how much water, m³.
#[derive(Debug, Clone)]
pub struct Filling {
    /// The vessel.
    pub vessel: Vessel,
    /// Its pose in the world.
    pub pose: Isometry3<f64>,
    /// Water in it, m³.
    pub water: f64,
    /// How its rim lets go of water.
    pub rim: Rim,
}

impl Fluid {
    /// Fills the vessels and lets the water come to rest; at most 32 vessels.
    ///
    /// `dt` is the time between calls of [`Self::step`], s; gravity in the world, m/s².
    ///
    /// # Errors
    ///
    /// The index of the first filling that does not fit its vessel.
    pub fn new(
        settings: &FluidSettings,
        fillings: &[Filling],
        table: Table,
        gravity: Vector3<f64>,
        dt: f64,
        seed: u64,
    ) -> Result<Self, usize> {
        let total: f64 = fillings.iter().map(|filling| filling.water).sum();
        let volume = if total > 0.0 { total / settings.particles.max(1) as f64 } else { 1e-7 };
        let spacing = volume.cbrt() as f32;
        let kernel = Kernel::new(solve::SUPPORT * spacing);
        let mut fluid = Self {
            settings: settings.clone(),
            dt: dt as f32,
            gravity: gravity.cast(),
            kernel,
            volume,
            spacing,
            relaxation: solve::relaxation(&kernel, spacing),
            table,
            vessels: Vec::new(),
            films: Vec::new(),
            lips: Vec::new(),
            position: Vec::new(),
            velocity: Vec::new(),
            inside: Vec::new(),
            phase: Vec::new(),
            touched_table: Vec::new(),
            rest_time: Vec::new(),
            ride: Vec::new(),
            scratch: Scratch::default(),
        };
        let mut rng = StdRng::seed_from_u64(seed);
        for (k, filling) in fillings.iter().enumerate() {
            let n = (filling.water / volume).round() as usize;
            let places = filling.vessel.fill(n, spacing).ok_or(k)?;
            let pose = vessel::single(&filling.pose);
            for place in places {
                let jitter = Vector3::from_fn(|_, _| rng.random_range(-0.02..0.02) * spacing);
                let place = pose * nalgebra::Point3::from(place + jitter);
                fluid.position.push(place.coords);
                fluid.velocity.push(Vector3::zeros());
                fluid.inside.push(1 << k);
                fluid.phase.push(Phase::Live);
                fluid.touched_table.push(false);
                fluid.rest_time.push(0.0);
                fluid.ride.push(Vector3::zeros());
            }
            let vessel = &filling.vessel;
            fluid.films.push(Film::new(filling.rim.dribble, volume));
            let to_rim = f64::from(vessel.volume());
            fluid.lips.push(Lip::new(filling.rim, to_rim, volume));
            fluid.vessels.push(Moving {
                vessel: filling.vessel.clone(),
                reach2: (filling.vessel.bound() + 0.03).powi(2),
                now: pose,
                into_before: Placed::new(&pose.inverse()),
                into: Placed::new(&pose.inverse()),
                out: Placed::new(&pose),
                velocity: Vector3::zeros(),
                spin: Vector3::zeros(),
                acceleration: Vector3::zeros(),
                frozen: false,
                up_when_frozen: Vector3::z(),
                calm: 0.0,
                felt: (0.0, Vector3::zeros()),
            });
        }
        fluid.settle();
        Ok(fluid)
    }

    /// Lets the lattice of the filling become water at rest, with strong damping.
    fn settle(&mut self) {
        let steps = (0.5 / self.dt).ceil() as usize;
        for step in 0..steps {
            self.solve();
            // Damped to rest at first, then let go so that the last of it is the water's own.
            let keep = if step * 2 < steps { 0.9 } else { 0.97 };
            for v in &mut self.velocity {
                *v *= keep;
            }
        }
        for v in &mut self.velocity {
            *v = Vector3::zeros();
        }
        for k in 0..self.vessels.len() {
            self.vessels[k].felt = self.measure(k);
            if self.settings.freeze {
                self.freeze(k);
            }
        }
    }

    /// Advances the water by one step while the vessels move to `poses` (in the order of the fillings).
    pub fn step(&mut self, poses: &[Isometry3<f64>]) {
        self.move_vessels(poses);
        self.wake();
        self.ride();
        self.solve();
        self.let_go();
        self.drain();
        self.rest();
        for k in 0..self.vessels.len() {
            let (mass, com) = self.measure(k);
            let share = (f64::from(self.dt) / FEEDBACK_TIME).min(1.0);
            let felt = &mut self.vessels[k].felt;
            // Water that comes in brings its own place; the rest moves there gradually.
            felt.1 = if felt.0 > 0.0 { felt.1 + (com - felt.1) * share } else { com };
            felt.0 += (mass - felt.0) * share;
        }
    }

    fn move_vessels(&mut self, poses: &[Isometry3<f64>]) {
        let dt = self.dt;
        for (moving, pose) in self.vessels.iter_mut().zip(poses) {
            let before = moving.now;
            moving.now = vessel::single(pose);
            moving.into_before = moving.into;
            moving.into = Placed::new(&moving.now.inverse());
            moving.out = Placed::new(&moving.now);
            let shift = moving.now.translation.vector - before.translation.vector;
            let turn = moving.now.rotation * before.rotation.inverse();
            let velocity = shift / dt;
            let share = (dt / 0.05).min(1.0);
            let acceleration = (velocity - moving.velocity) / dt;
            moving.acceleration += (acceleration - moving.acceleration) * share;
            moving.velocity = velocity;
            moving.spin = turn.scaled_axis() / dt;
        }
    }

    /// Returns mass (kg) and centre of mass (m, in the vessel's frame) of the water in vessel `k`.
    fn measure(&self, k: usize) -> (f64, Vector3<f64>) {
        let (mut n, mut sum) = (0_u32, Vector3::zeros());
        for i in 0..self.phase.len() {
            if self.vessel_of(i) == Some(k) {
                sum += self.vessels[k].local(&self.position[i]).cast::<f64>();
                n += 1;
            }
        }
        let com = if n > 0 { sum / f64::from(n) } else { Vector3::zeros() };
        (f64::from(n) * self.volume * WATER_DENSITY, com)
    }

    /// Returns the vessel a particle is in; of vessels in each other, the smaller.
    fn vessel_of(&self, i: usize) -> Option<usize> {
        let inside = self.inside[i];
        (0..self.vessels.len()).filter(|k| inside & (1 << k) != 0).min_by(|&a, &b| {
            let volume = |k: usize| self.vessels[k].vessel.volume();
            volume(a).total_cmp(&volume(b))
        })
    }

    /// Returns the inertia of the water in vessel `k` as the vessel feels it, in its frame.
    ///
    /// The water turns with its vessel only in part; it is taken as a ball of the same volume.
    pub fn felt(&self, k: usize) -> Inertial {
        let (mass, com) = self.vessels[k].felt;
        let radius = (3.0 * mass / WATER_DENSITY / (4.0 * std::f64::consts::PI)).cbrt();
        let inertia = nalgebra::Matrix3::identity() * (0.4 * mass * radius * radius);
        Inertial { mass, com, inertia }
    }

    /// Returns the volume of water in vessel `k`, m³.
    pub fn volume_in(&self, k: usize) -> f64 {
        let n = (0..self.phase.len()).filter(|&i| self.vessel_of(i) == Some(k)).count();
        n as f64 * self.volume
    }

    /// Returns the centre of mass of the water in vessel `k`, m, in its frame, if there is any.
    pub fn centre_in(&self, k: usize) -> Option<Vector3<f64>> {
        let (mass, com) = self.measure(k);
        (mass > 0.0).then_some(com)
    }

    /// Returns the volume that has touched the table or fallen past it, m³.
    pub fn spilt(&self) -> f64 {
        let lost = |i: &usize| {
            self.inside[*i] == 0 && (self.touched_table[*i] || self.phase[*i] == Phase::Gone)
        };
        (0..self.phase.len()).filter(lost).count() as f64 * self.volume
    }

    /// Returns the volume of all water, m³.
    pub fn total(&self) -> f64 {
        self.phase.len() as f64 * self.volume
    }

    /// Returns whether no particle is being simulated.
    pub fn is_frozen(&self) -> bool {
        self.phase.iter().all(|phase| *phase != Phase::Live)
    }

    /// Returns the particles' centres in the world, m.
    pub fn positions(&self) -> &[Vector3<f32>] {
        &self.position
    }

    /// Returns the radius of the ball whose volume one particle carries, m.
    pub fn radius(&self) -> f64 {
        (3.0 * self.volume / (4.0 * std::f64::consts::PI)).cbrt()
    }
}
