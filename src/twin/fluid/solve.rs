//! One step of the water that moves: predict, make the density right, let neighbours drag each other.
//!
//! Every pass is a map over particles from the values of the last one (Jacobi), so the order in which
//! threads work does not show.
//!
//! Source: Macklin and Müller, "Position based fluids", 2013, algorithm 1 and equations 1, 8–12, with
//! walls as half-spaces of fluid at rest in place of boundary particles; Schechter and Bridson, "Ghost
//! SPH for animating water", 2012 (XSPH viscosity).

use nalgebra::Vector3;
use rayon::prelude::*;

use super::grid::Grid;
use super::{Fluid, Kernel, Phase};

/// Support radius of the kernel in particle spacings: about 27 neighbours at rest.
pub(super) const SUPPORT: f32 = 1.85;
/// How far particles stay from surfaces, in spacings. With less they crowd onto the walls.
const MARGIN: f32 = 0.4;
/// What a sum over neighbours lacks of the density of settled water. Measured: with it the level at rest
/// in a jar is right within 1.5 % from 300 to 1200 particles; without it 2 % low.
const PACKING: f32 = 1.02;
/// No particle is faster, m/s: one thrown out by a jump of its vessel must not leave the room.
const TOP_SPEED: f32 = 5.0;
/// From how many particles on a pass is shared between threads: for fewer the handing over takes longer.
const SHARE_FROM: usize = 1000;

/// Returns `f` of each particle.
pub(super) fn map<T: Send>(n: usize, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    if n < SHARE_FROM {
        (0..n).map(f).collect()
    } else {
        (0..n).into_par_iter().with_min_len(128).map(f).collect()
    }
}

impl Fluid {
    /// One step of the moving particles.
    pub(super) fn solve(&mut self) {
        let live: Vec<usize> =
            (0..self.phase.len()).filter(|&i| self.phase[i] == Phase::Live).collect();
        if live.is_empty() {
            return;
        }
        let dt = self.dt;
        let start: Vec<Vector3<f32>> = live.iter().map(|&i| self.position[i]).collect();
        let sides: Vec<u32> = live.iter().map(|&i| self.inside[i]).collect();
        let mut x: Vec<Vector3<f32>> = map(live.len(), |a| {
            let v = self.velocity[live[a]] + self.gravity * dt;
            let v = v * (TOP_SPEED / v.norm().max(TOP_SPEED));
            self.confine(&start[a], sides[a], &(start[a] + v * dt)).0
        });
        let mut grid = std::mem::take(&mut self.grid);
        grid.build(&x, self.kernel.h);
        for _ in 0..self.settings.iterations {
            let push: Vec<(f32, Vector3<f32>)> = map(x.len(), |a| self.pressure(a, &x, &grid));
            x = map(x.len(), |a| {
                let target = x[a] + self.correction(a, &x, &push, &grid);
                self.confine(&start[a], sides[a], &target).0
            });
        }
        let v: Vec<Vector3<f32>> = x.iter().zip(&start).map(|(x, s)| (x - s) / dt).collect();
        let smooth: Vec<Vector3<f32>> = map(x.len(), |a| self.smoothed(a, &x, &v, sides[a], &grid));
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
}

/// Returns the term that keeps a lone particle's multiplier finite, 1/m²: a tenth of what the gradients
/// add up to in water at rest.
pub(super) fn relaxation(kernel: &Kernel, spacing: f32) -> f32 {
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
