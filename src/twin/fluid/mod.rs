//! Water as particles: what pours, splashes, and is never lost.
//!
//! A position-based fluid: particles are moved by gravity, then pushed apart until their density is
//! that of water, and their velocity is what they moved. Vessels are analytic ([`vessel`]) and moved
//! from outside; the water answers by its mass and centre of mass. Each particle carries the same
//! volume, so what is in a vessel is counted, and nothing is created or lost.
//!
//! Water that has settled in a vessel that is carried gently rides along frozen and costs nothing; it
//! wakes when the vessel tilts, is accelerated, or something falls in. The arm and objects that are not
//! vessels do not touch the water. Every update is a map over particles from the values of the last
//! pass, so the result has the same bits for any number of threads.
//!
//! Source: Macklin and Müller, "Position based fluids", 2013; Schechter and Bridson, "Ghost SPH for
//! animating water", 2012 (XSPH viscosity).

mod grid;
mod kernel;
mod vessel;

use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use rayon::prelude::*;

pub use kernel::Kernel;
pub use vessel::Vessel;

use super::physics::Inertia;
use crate::world::Table;
use grid::Grid;

/// Density of water, kg/m³.
const WATER_DENSITY: f64 = 1000.0;
/// Support radius of the kernel in particle spacings: about 27 neighbours at rest.
const SUPPORT: f32 = 1.85;
/// How far particles stay from surfaces, in spacings. With less they crowd onto the walls.
const MARGIN: f32 = 0.4;
/// What a sum over neighbours lacks of the density of settled water. Measured: with it the level at rest
/// in a jar is right within 1.5 % from 300 to 1200 particles; without it 2 % low.
const PACKING: f32 = 1.02;
/// No particle is faster, m/s: one thrown out by a jump of its vessel must not leave the room.
const TOP_SPEED: f32 = 5.0;
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
    /// It came to rest on the table.
    Spilt,
    /// It fell off the table.
    Gone,
}

/// A vessel and how it moves.
#[derive(Debug, Clone)]
struct Moving {
    vessel: Vessel,
    now: Isometry3<f32>,
    /// From the world into the vessel, as it stood before the step and as it stands now.
    into_before: Isometry3<f32>,
    into: Isometry3<f32>,
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
        (self.into * nalgebra::Point3::from(*p)).coords
    }

    fn local_before(&self, p: &Vector3<f32>) -> Vector3<f32> {
        (self.into_before * nalgebra::Point3::from(*p)).coords
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
    position: Vec<Vector3<f32>>,
    velocity: Vec<Vector3<f32>>,
    /// Bit k: inside vessel k.
    inside: Vec<u32>,
    phase: Vec<Phase>,
    touched_table: Vec<bool>,
    rest_time: Vec<f32>,
    /// Places of frozen particles in their vessel's frame.
    ride: Vec<Vector3<f32>>,
    grid: Grid,
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
        let kernel = Kernel::new(SUPPORT * spacing);
        let mut fluid = Self {
            settings: settings.clone(),
            dt: dt as f32,
            gravity: gravity.cast(),
            kernel,
            volume,
            spacing,
            relaxation: relaxation(&kernel, spacing),
            table,
            vessels: Vec::new(),
            position: Vec::new(),
            velocity: Vec::new(),
            inside: Vec::new(),
            phase: Vec::new(),
            touched_table: Vec::new(),
            rest_time: Vec::new(),
            ride: Vec::new(),
            grid: Grid::default(),
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
            fluid.vessels.push(Moving {
                vessel: filling.vessel.clone(),
                now: pose,
                into_before: pose.inverse(),
                into: pose.inverse(),
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
            moving.into = moving.now.inverse();
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

    /// Wakes the water of vessels that tilt, are accelerated, or into which something falls.
    fn wake(&mut self) {
        for k in 0..self.vessels.len() {
            let moving = &self.vessels[k];
            if !moving.frozen {
                continue;
            }
            let up = moving.now.rotation.inverse() * Vector3::z();
            let tilted = f64::from(up.angle(&moving.up_when_frozen)) > self.settings.wake_tilt;
            let pushed = f64::from(moving.acceleration.norm()) > self.settings.wake_acceleration;
            if tilted || pushed || self.visited(k) {
                self.vessels[k].frozen = false;
                self.vessels[k].calm = 0.0;
                for i in 0..self.phase.len() {
                    if self.phase[i] == Phase::Riding(k) {
                        self.phase[i] = Phase::Live;
                        let p = self.position[i];
                        self.velocity[i] = self.vessels[k].velocity_at(&p);
                    }
                }
            }
        }
    }

    /// Returns whether a moving particle is about vessel `k` without being inside.
    fn visited(&self, k: usize) -> bool {
        let (moving, reach) = (&self.vessels[k], 3.0 * self.spacing);
        let near = |i: usize| moving.vessel.near(&moving.local(&self.position[i]), reach);
        (0..self.phase.len())
            .any(|i| self.phase[i] == Phase::Live && self.inside[i] & (1 << k) == 0 && near(i))
    }

    /// Moves frozen particles with their vessels.
    fn ride(&mut self) {
        for i in 0..self.phase.len() {
            if let Phase::Riding(k) = self.phase[i] {
                let moving = &self.vessels[k];
                self.position[i] = (moving.now * nalgebra::Point3::from(self.ride[i])).coords;
                self.velocity[i] = moving.velocity_at(&self.position[i]);
            }
        }
    }

    fn freeze(&mut self, k: usize) {
        for i in 0..self.phase.len() {
            if self.phase[i] == Phase::Live && self.inside[i] & (1 << k) != 0 {
                self.phase[i] = Phase::Riding(k);
                self.ride[i] = self.vessels[k].local(&self.position[i]);
            }
        }
        let moving = &mut self.vessels[k];
        moving.frozen = true;
        moving.up_when_frozen = moving.now.rotation.inverse() * Vector3::z();
    }

    /// Lets calm water freeze and drops that came to rest on the table stay there.
    fn rest(&mut self) {
        for i in 0..self.phase.len() {
            if self.phase[i] != Phase::Live {
                continue;
            }
            if self.position[i].z < -0.5 {
                self.phase[i] = Phase::Gone;
            } else if self.touched_table[i] && self.inside[i] == 0 {
                self.rest_time[i] += self.dt;
                if self.rest_time[i] > 0.4 {
                    self.phase[i] = Phase::Spilt;
                    self.velocity[i] = Vector3::zeros();
                }
            }
        }
        if !self.settings.freeze {
            return;
        }
        for k in 0..self.vessels.len() {
            if self.vessels[k].frozen {
                continue;
            }
            let moving = &self.vessels[k];
            let (mut n, mut square) = (0, 0.0);
            for i in 0..self.phase.len() {
                if self.phase[i] == Phase::Live && self.inside[i] & (1 << k) != 0 {
                    let v = self.velocity[i] - moving.velocity_at(&self.position[i]);
                    square += v.norm_squared();
                    n += 1;
                }
            }
            let calm = (n == 0 || square / (n as f32) < 0.02 * 0.02)
                && f64::from(moving.acceleration.norm()) < 0.5 * self.settings.wake_acceleration
                && moving.spin.norm() < 0.05
                && !self.visited(k);
            let moving = &mut self.vessels[k];
            moving.calm = if calm { moving.calm + self.dt } else { 0.0 };
            if moving.calm > 0.2 {
                self.freeze(k);
            }
        }
    }

    /// One step of the moving particles.
    fn solve(&mut self) {
        let live: Vec<usize> =
            (0..self.phase.len()).filter(|&i| self.phase[i] == Phase::Live).collect();
        if live.is_empty() {
            return;
        }
        let dt = self.dt;
        let start: Vec<Vector3<f32>> = live.iter().map(|&i| self.position[i]).collect();
        let sides: Vec<u32> = live.iter().map(|&i| self.inside[i]).collect();
        let mut x: Vec<Vector3<f32>> = live
            .par_iter()
            .with_min_len(128)
            .enumerate()
            .map(|(a, &i)| {
                let v = self.velocity[i] + self.gravity * dt;
                let v = v * (TOP_SPEED / v.norm().max(TOP_SPEED));
                self.confine(&start[a], sides[a], &(start[a] + v * dt)).0
            })
            .collect();
        let mut grid = std::mem::take(&mut self.grid);
        grid.build(&x, self.kernel.h);
        for _ in 0..self.settings.iterations {
            let push: Vec<(f32, Vector3<f32>)> = (0..x.len())
                .into_par_iter()
                .with_min_len(128)
                .map(|a| self.pressure(a, &x, &grid))
                .collect();
            x = (0..x.len())
                .into_par_iter()
                .with_min_len(128)
                .map(|a| {
                    let target = x[a] + self.correction(a, &x, &push, &grid);
                    self.confine(&start[a], sides[a], &target).0
                })
                .collect();
        }
        let v: Vec<Vector3<f32>> = x.iter().zip(&start).map(|(x, s)| (x - s) / dt).collect();
        let smooth: Vec<Vector3<f32>> = (0..x.len())
            .into_par_iter()
            .with_min_len(128)
            .map(|a| self.smoothed(a, &x, &v, sides[a], &grid))
            .collect();
        for (a, &i) in live.iter().enumerate() {
            let (place, side) = self.confine(&start[a], sides[a], &x[a]);
            self.position[i] = place;
            self.velocity[i] = smooth[a];
            self.inside[i] = side;
            let low = place.z < 0.6 * self.spacing && side == 0;
            if low && self.table.holds(f64::from(place.x), f64::from(place.y), 0.0) {
                self.touched_table[i] = true;
                // A film on a table is slowed by it far more than by the next wall of water.
                self.velocity[i].x *= 0.9;
                self.velocity[i].y *= 0.9;
            }
        }
        self.grid = grid;
    }

    /// Returns a particle's multiplier `λ` (m²) of the density constraint and the gradient of the walls'
    /// share of its density.
    fn pressure(&self, a: usize, x: &[Vector3<f32>], grid: &Grid) -> (f32, Vector3<f32>) {
        let (kernel, volume) = (&self.kernel, self.volume as f32);
        let mut density = kernel.weight(0.0) * volume;
        let (mut own, mut squares) = (Vector3::zeros(), 0.0);
        for &b in grid.of(a) {
            let d = x[a] - x[b as usize];
            let r2 = d.norm_squared();
            density += kernel.weight(r2) * volume;
            let r = r2.sqrt();
            if r > 1e-9 {
                let g = d * (kernel.slope(r) * volume / r);
                own -= g;
                squares += g.norm_squared();
            }
        }
        let (wall, wall_gradient) = self.walls(&x[a]);
        density += wall;
        own += wall_gradient;
        // Only too dense is wrong: drops and jets may be thin.
        let excess = (density * PACKING - 1.0).max(0.0);
        (-excess / (squares + own.norm_squared() + self.relaxation), wall_gradient)
    }

    /// Returns the density that vessels and table lend to a particle at `p`, and its gradient, 1/m.
    fn walls(&self, p: &Vector3<f32>) -> (f32, Vector3<f32>) {
        let h = self.kernel.h;
        for moving in &self.vessels {
            let local = moving.local(p);
            if moving.vessel.above_floor(&local) && local.z < moving.vessel.rim() + h {
                let (density, gradient) = moving.vessel.wall_density(&local, &self.kernel);
                return (density, moving.now.rotation * gradient);
            }
        }
        if p.z < h && p.z > -h && self.table.holds(f64::from(p.x), f64::from(p.y), 0.0) {
            let slope = self.kernel.beyond_slope(p.z);
            return (self.kernel.beyond(p.z), Vector3::new(0.0, 0.0, -slope));
        }
        (0.0, Vector3::zeros())
    }

    /// Returns how a particle moves to mend its density and its neighbours', m.
    fn correction(
        &self,
        a: usize,
        x: &[Vector3<f32>],
        push: &[(f32, Vector3<f32>)],
        grid: &Grid,
    ) -> Vector3<f32> {
        let volume = self.volume as f32;
        let (own, wall_gradient) = push[a];
        // The wall's share counts once: it has no multiplier of its own. Twice, as for a mirrored
        // neighbour, and the water boils.
        let mut move_by = wall_gradient * own;
        for &b in grid.of(a) {
            let d = x[a] - x[b as usize];
            let r = d.norm();
            if r > 1e-9 {
                let both = own + push[b as usize].0;
                move_by -= d * (both * self.kernel.slope(r) * volume / r);
            }
        }
        // A step of more than half a spacing would jump over neighbours.
        let limit = 0.5 * self.spacing;
        move_by * (limit / move_by.norm().max(limit))
    }

    /// Returns a particle's velocity after the drag of neighbours and walls.
    fn smoothed(
        &self,
        a: usize,
        x: &[Vector3<f32>],
        v: &[Vector3<f32>],
        side: u32,
        grid: &Grid,
    ) -> Vector3<f32> {
        let volume = self.volume as f32;
        let mut drag = Vector3::zeros();
        for &b in grid.of(a) {
            let b = b as usize;
            let weight = self.kernel.weight((x[a] - x[b]).norm_squared()) * volume;
            drag += (v[b] - v[a]) * weight;
        }
        let mut smooth = v[a] + drag * self.settings.viscosity;
        for (k, moving) in self.vessels.iter().enumerate() {
            if side & (1 << k) != 0
                && moving.vessel.wall_distance(&moving.local(&x[a])) < self.spacing
            {
                let wall = moving.velocity_at(&x[a]);
                smooth += (wall - smooth) * self.settings.wall_drag;
            }
        }
        smooth
    }

    /// Returns where a particle may go from `start` (with the sides it was on) when it wants to `target`,
    /// and the sides it is on then.
    fn confine(
        &self,
        start: &Vector3<f32>,
        sides: u32,
        target: &Vector3<f32>,
    ) -> (Vector3<f32>, u32) {
        let margin = MARGIN * self.spacing;
        let mut p = *target;
        let mut now = sides;
        // One vessel may push a particle into another: a few passes agree, or the particle stays put.
        for pass in 0..4 {
            let before = p;
            if p.z < margin
                && start.z > -margin
                && self.table.holds(f64::from(p.x), f64::from(p.y), 0.0)
            {
                p.z = margin;
            }
            for (k, moving) in self.vessels.iter().enumerate() {
                let bit = 1 << k;
                let inside = sides & bit != 0;
                let reach = moving.vessel.bound() + 0.03;
                let apart = (p - moving.now.translation.vector).norm_squared();
                if !inside && apart > reach * reach {
                    now &= !bit;
                    continue;
                }
                let from = moving.local_before(start);
                let to = moving.local(&p);
                let (held, is_in) = moving.vessel.confine(&from, inside, &to, margin);
                if held != to {
                    p = (moving.now * nalgebra::Point3::from(held)).coords;
                }
                if is_in {
                    now |= bit;
                } else {
                    now &= !bit;
                }
            }
            if (p - before).norm_squared() < 1e-14 {
                return (p, now);
            }
            if pass == 3 {
                break;
            }
        }
        // Squeezed between two vessels: it moves with the one it is in, or stays.
        for (k, moving) in self.vessels.iter().enumerate() {
            if sides & (1 << k) != 0 {
                let local = moving.local_before(start);
                return ((moving.now * nalgebra::Point3::from(local)).coords, sides);
            }
        }
        (*start, sides)
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
    pub fn felt(&self, k: usize) -> Inertia {
        let (mass, com) = self.vessels[k].felt;
        let radius = (3.0 * mass / WATER_DENSITY / (4.0 * std::f64::consts::PI)).cbrt();
        let about_com = nalgebra::Matrix3::identity() * (0.4 * mass * radius * radius);
        Inertia { mass, com, about_com }
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

/// Returns the term that keeps a lone particle's multiplier finite, 1/m²: a tenth of what the gradients
/// add up to in water at rest.
fn relaxation(kernel: &Kernel, spacing: f32) -> f32 {
    let (volume, reach) = (spacing.powi(3), SUPPORT.ceil() as i32);
    let mut squares = 0.0;
    for i in -reach..=reach {
        for j in -reach..=reach {
            for k in -reach..=reach {
                let r = ((i * i + j * j + k * k) as f32).sqrt() * spacing;
                if r > 0.0 {
                    squares += (kernel.slope(r) * volume).powi(2);
                }
            }
        }
    }
    0.1 * squares
}
