//! Water: at rest in vessels, as particles on its way, and never lost.
//!
//! In a vessel it stands as a level surface ([`super::basin`]) that leans and swings as the first mode of sloshing does
//! (`slosh.rs`), and leaves over the rim as over a weir (`rim.rs`). What has left is particles that fall (`fall.rs`). One
//! that falls through a mouth (`vessel.rs`) joins what stands there. Each particle carries the same volume, also where
//! it stands, so what is in a vessel is counted, and nothing is created or lost.
//!
//! Vessels are moved from outside; water answers by its mass and centre of mass. The arm and objects that are not
//! vessels do not touch the water. All of it runs in the caller's thread, so the result has the same bits for any
//! number of threads.

mod fall;
mod film;
mod placed;
mod rim;
mod slosh;
mod vessel;

use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng, rngs::StdRng};

pub use film::Dribble;
pub use rim::Rim;
pub use vessel::Vessel;

use super::basin::{Basin, Stand};
use crate::motion::Inertial;
use crate::world::{Table, WATER_DENSITY};
use film::Film;
use placed::Placed;
use rim::Lip;
use slosh::{Mode, Slosh};

/// Time constant with which a vessel feels its water move, s: the grasp would feel every particle's
/// knock otherwise.
const FEEDBACK_TIME: f64 = 0.03;

/// A surface that turned by less than this since it was last measured lies as it lay, rad: a tenth of a millimetre in
/// a vessel of 10 cm.
const STILL: f64 = 1e-3;
/// After how long on the table a drop stays where it is, s.
const DROP_TIME: f32 = 0.4;

/// How the water is resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct FluidSettings {
    /// Number of particles all the water in the scene is divided into.
    pub particles: usize,
    /// Time step, s; rounded to a whole number of the rigid bodies' steps.
    pub dt: f64,
}

impl Default for FluidSettings {
    fn default() -> Self {
        Self { particles: 600, dt: 1.0 / 240.0 }
    }
}

/// What a particle is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// It moves.
    Live,
    /// It stands in a vessel.
    Standing(usize),
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
    /// The inside of the vessel, and how its liquid swings.
    basin: Arc<Basin>,
    mode: Mode,
    slosh: Slosh,
    /// How its liquid stands, with the direction of up in the vessel's frame and the number of particles then.
    stand: (Stand, Vector3<f64>, usize),
    /// How much of it stands above what is held at that tilt, m³.
    above: f64,
    /// How many particles stand in it now.
    standing: usize,
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
    dt: f32,
    gravity: Vector3<f32>,
    /// Volume of one particle, m³.
    volume: f64,
    /// How wide a particle is, m: the edge of the cube of its volume.
    spacing: f32,
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
    /// Places of clinging particles in their vessel's frame.
    ride: Vec<Vector3<f32>>,
    /// Which particles do not stand in a vessel, in order: of those that do, all that is to know is how many.
    loose: Vec<usize>,
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
    /// Fills the vessels; at most 32 of them.
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
        let mut fluid = Self {
            dt: dt as f32,
            gravity: gravity.cast(),
            volume,
            spacing,
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
            loose: Vec::new(),
        };
        // Where along a lip the first particle leaves is chance.
        let mut rng = StdRng::seed_from_u64(seed);
        for (k, filling) in fillings.iter().enumerate() {
            fluid.fill(k, filling, rng.random_range(0.0..1.0))?;
        }
        Ok(fluid)
    }

    /// Adds a vessel with what is in it; the first to leave does so at `start` of its lip, 0 to 1.
    fn fill(&mut self, k: usize, filling: &Filling, start: f64) -> Result<(), usize> {
        let (vessel, rim) = (&filling.vessel, filling.rim);
        let to_rim = f64::from(vessel.volume());
        let n = (filling.water / self.volume).round() as usize;
        // Half a particle is what rounding may add.
        if n as f64 * self.volume > to_rim + 0.5 * self.volume {
            return Err(k);
        }
        let pose = vessel::single(&filling.pose);
        self.films.push(Film::new(rim.dribble, self.volume));
        self.lips.push(Lip::new(rim, to_rim, self.volume, start));
        let basin = vessel.basin();
        let up = pose.rotation.inverse() * Vector3::z();
        let stand = basin.stand(&up.cast(), n as f64 * self.volume);
        self.vessels.push(Moving {
            vessel: vessel.clone(),
            reach2: (vessel.bound() + 0.03).powi(2),
            now: pose,
            into_before: Placed::new(&pose.inverse()),
            into: Placed::new(&pose.inverse()),
            out: Placed::new(&pose),
            velocity: Vector3::zeros(),
            spin: Vector3::zeros(),
            basin,
            mode: Mode::of(vessel.inside(), rim.viscosity.unwrap_or(0.0)),
            slosh: Slosh::calm(),
            above: above(vessel, &up.cast(), n as f64 * self.volume),
            stand: (stand, up.cast(), n),
            standing: n,
            felt: (n as f64 * self.volume * WATER_DENSITY, stand.centre),
        });
        let place = self.vessels[k].world(&stand.centre.cast());
        self.position.extend(vec![place; n]);
        self.velocity.extend(vec![Vector3::zeros(); n]);
        self.inside.extend(vec![1 << k; n]);
        self.phase.extend(vec![Phase::Standing(k); n]);
        self.touched_table.extend(vec![false; n]);
        self.rest_time.extend(vec![0.0; n]);
        self.ride.extend(vec![Vector3::zeros(); n]);
        Ok(())
    }

    /// Advances the water by one step while the vessels move to `poses` (in the order of the fillings).
    pub fn step(&mut self, poses: &[Isometry3<f64>]) {
        self.move_vessels(poses);
        self.ride();
        self.fall();
        self.join();
        self.let_go();
        self.drain();
        self.rest();
        self.stand();
        let share = (f64::from(self.dt) / FEEDBACK_TIME).min(1.0);
        for k in 0..self.vessels.len() {
            let (mass, com) = self.measure(k, self.count_in(k));
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
            let acceleration = (velocity - moving.velocity) / dt;
            moving.velocity = velocity;
            moving.spin = turn.scaled_axis() / dt;
            let depth = moving.stand.2 as f64 * self.volume / f64::from(moving.vessel.area());
            let falls = (self.gravity - acceleration).cast();
            moving.slosh.swing(&moving.mode, depth, &falls, f64::from(dt));
        }
    }

    /// Moves what clings to vessels with them.
    fn ride(&mut self) {
        for &i in &self.loose {
            let Phase::Clinging(k) = self.phase[i] else { continue };
            let moving = &self.vessels[k];
            self.position[i] = moving.world(&self.ride[i]);
            self.velocity[i] = moving.velocity_at(&self.position[i]);
        }
    }

    /// Lets what has fallen into a vessel join what stands there.
    fn join(&mut self) {
        for &i in &self.loose {
            if self.phase[i] != Phase::Live || self.inside[i] == 0 {
                continue;
            }
            let Some(k) = self.vessel_of(i) else { continue };
            let moving = &self.vessels[k];
            let place: Vector3<f64> = moving.local(&self.position[i]).cast();
            let (stand, up, _) = &moving.stand;
            if up.dot(&place) < stand.height + 0.5 * f64::from(self.spacing) {
                self.phase[i] = Phase::Standing(k);
                self.vessels[k].standing += 1;
            }
        }
        self.loose.retain(|&i| !matches!(self.phase[i], Phase::Standing(_)));
    }

    /// Finds how the liquid of each vessel stands, where something has changed.
    fn stand(&mut self) {
        for moving in &mut self.vessels {
            let n = moving.standing;
            let up = moving.now.rotation.cast::<f64>().inverse() * moving.slosh.up;
            let (before, then, had) = &moving.stand;
            if n != *had || (up - then).norm() > STILL {
                let stand = moving.basin.stand_near(&up, n as f64 * self.volume, before.height);
                moving.stand = (stand, up, n);
                moving.above = above(&moving.vessel, &up, n as f64 * self.volume);
            }
        }
    }

    /// Lets drops that came to rest on the table stay there, and forgets what fell past it.
    fn rest(&mut self) {
        for &i in &self.loose {
            if self.phase[i] != Phase::Live {
                continue;
            }
            if self.position[i].z < -0.5 {
                self.phase[i] = Phase::Gone;
            } else if self.touched_table[i] && self.inside[i] == 0 {
                self.rest_time[i] += self.dt;
                if self.rest_time[i] > DROP_TIME {
                    self.phase[i] = Phase::Spilt;
                    self.velocity[i] = Vector3::zeros();
                }
            }
        }
    }

    /// Returns mass (kg) and centre of mass (m, in the vessel's frame) of the water in vessel `k`, which is `n` particles.
    fn measure(&self, k: usize, n: usize) -> (f64, Vector3<f64>) {
        (n as f64 * self.volume * WATER_DENSITY, self.vessels[k].stand.0.centre)
    }

    /// Returns the vessel a particle is in; of vessels in each other, the smaller.
    fn vessel_of(&self, i: usize) -> Option<usize> {
        let inside = self.inside[i];
        if inside.count_ones() < 2 {
            return (inside != 0).then(|| inside.trailing_zeros() as usize);
        }
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
        self.count_in(k) as f64 * self.volume
    }

    /// Returns how many particles are in vessel `k`.
    fn count_in(&self, k: usize) -> usize {
        let loose = self.loose.iter().filter(|&&i| self.vessel_of(i) == Some(k));
        self.vessels[k].standing + loose.count()
    }

    /// Returns the centre of mass of the water in vessel `k`, m, in its frame, if there is any.
    pub fn centre_in(&self, k: usize) -> Option<Vector3<f64>> {
        let (mass, com) = self.measure(k, self.count_in(k));
        (mass > 0.0).then_some(com)
    }

    /// Returns the volume that has touched the table or fallen past it, m³.
    pub fn spilt(&self) -> f64 {
        let lost = |i: &usize| {
            self.inside[*i] == 0 && (self.touched_table[*i] || self.phase[*i] == Phase::Gone)
        };
        self.loose.iter().filter(|i| lost(i)).count() as f64 * self.volume
    }

    /// Returns the volume of all water, m³.
    pub fn total(&self) -> f64 {
        self.phase.len() as f64 * self.volume
    }

    /// Returns the particles' centres in the world, m; where one stands in a vessel, the middle of all that does.
    pub fn positions(&self) -> Vec<Vector3<f32>> {
        let middle = |moving: &Moving| moving.world(&moving.stand.0.centre.cast());
        let middles: Vec<_> = self.vessels.iter().map(middle).collect();
        let places = self.position.iter().zip(&self.phase);
        places
            .map(|(place, phase)| match phase {
                Phase::Standing(k) => middles[*k],
                _ => *place,
            })
            .collect()
    }

    /// Returns the centres of the particles that stand in no vessel, m.
    pub fn free(&self) -> Vec<Vector3<f32>> {
        self.loose.iter().map(|&i| self.position[i]).collect()
    }

    /// Returns the radius of the ball whose volume one particle carries, m.
    pub fn radius(&self) -> f64 {
        (3.0 * self.volume / (4.0 * std::f64::consts::PI)).cbrt()
    }
}

/// Returns how much of a volume (m³) in a vessel stands above what it holds at a tilt, whose up is in its frame, m³.
fn above(vessel: &Vessel, up: &Vector3<f64>, volume: f64) -> f64 {
    volume - vessel.hold().at(up.angle(&Vector3::z()))
}
