//! The arm's equations of motion, for a tree of few joints about one point.
//!
//! All is in the axes of the world about the base's origin, so that what hangs on a body is added up without carrying it
//! from frame to frame, and a momentum is felt by each joint below in the same numbers.
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008: RNEA §5.3, CRBA §6.2.

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::tree::Tree;
use crate::motion::robot::Motion;

/// Joints an arm may have to be moved here, its jaws' among them.
pub(super) const MOST: usize = 16;

/// A vector that turns and one that moves, about the base.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Twist {
    pub(super) turns: Vector3<f64>,
    pub(super) moves: Vector3<f64>,
}

/// What has mass, about the base: so many kg.
#[derive(Debug, Clone, Copy, Default)]
struct Mass {
    amount: f64,
    /// Mass times place, kg·m.
    first: Vector3<f64>,
    /// kg·m².
    second: Matrix3<f64>,
}

/// The equations of motion: `mass · q̈ + bias = τ`.
pub(super) struct Equations {
    pub(super) mass: [[f64; MOST]; MOST],
    pub(super) bias: [f64; MOST],
    /// How each body goes when its joint does, by bodies.
    pub(super) axes: [Twist; MOST],
}

impl Twist {
    pub(super) fn dot(&self, other: &Self) -> f64 {
        self.turns.dot(&other.turns) + self.moves.dot(&other.moves)
    }

    pub(super) fn plus(&self, other: &Self) -> Self {
        Self { turns: self.turns + other.turns, moves: self.moves + other.moves }
    }

    pub(super) fn times(&self, by: f64) -> Self {
        Self { turns: self.turns * by, moves: self.moves * by }
    }

    /// Returns how a motion changes while it is carried by this one.
    fn cross(&self, motion: &Self) -> Self {
        Self {
            turns: self.turns.cross(&motion.turns),
            moves: self.turns.cross(&motion.moves) + self.moves.cross(&motion.turns),
        }
    }

    /// Returns how a momentum changes while it is carried by this motion.
    fn carries(&self, momentum: &Self) -> Self {
        Self {
            turns: self.turns.cross(&momentum.turns) + self.moves.cross(&momentum.moves),
            moves: self.turns.cross(&momentum.moves),
        }
    }
}

impl Mass {
    /// Returns the momentum of a motion.
    fn times(&self, motion: &Twist) -> Twist {
        Twist {
            turns: self.second * motion.turns + self.first.cross(&motion.moves),
            moves: motion.moves * self.amount + motion.turns.cross(&self.first),
        }
    }

    fn add(&mut self, other: &Self) {
        self.amount += other.amount;
        self.first += other.first;
        self.second += other.second;
    }
}

impl Equations {
    /// Works out the equations of motion of a tree whose bodies are at `poses` and fall at `gravity`, m/s², its joints at `speeds`.
    pub(super) fn new(
        tree: &Tree,
        gravity: &Vector3<f64>,
        poses: &[Isometry3<f64>],
        speeds: &[f64; MOST],
    ) -> Self {
        let bodies = &tree.bodies;
        // The base accelerates upwards in place of weight pulling all down.
        let still = Twist { turns: Vector3::zeros(), moves: -gravity };
        let base = poses[0].translation.vector;
        let mut axes = [Twist::default(); MOST];
        let (mut motions, mut changes) = ([Twist::default(); MOST], [still; MOST]);
        let (mut masses, mut forces) = ([Mass::default(); MOST], [Twist::default(); MOST]);
        for (at, (body, pose)) in bodies.iter().zip(poses).enumerate().skip(1) {
            let (Some(parent), Some(joint)) = (body.parent, &body.joint) else { continue };
            let along = pose.rotation * joint.axis.into_inner();
            let origin = pose.translation.vector - base;
            axes[at] = if joint.motion == Motion::Slide {
                Twist { turns: Vector3::zeros(), moves: along }
            } else {
                Twist { turns: along, moves: origin.cross(&along) }
            };
            let inertial = &body.inertial;
            let centre = origin + pose.rotation * inertial.com;
            let turn = pose.rotation.to_rotation_matrix();
            let about = turn.matrix() * inertial.inertia * turn.matrix().transpose();
            let spread = Matrix3::identity() * centre.norm_squared() - centre * centre.transpose();
            masses[at] = Mass {
                amount: inertial.mass,
                first: centre * inertial.mass,
                second: about + spread * inertial.mass,
            };
            let own = axes[at].times(speeds[at - 1]);
            motions[at] = motions[parent].plus(&own);
            changes[at] = changes[parent].plus(&motions[at].cross(&own));
            let momentum = masses[at].times(&motions[at]);
            forces[at] = masses[at].times(&changes[at]).plus(&motions[at].carries(&momentum));
        }
        let (mass, bias) = ([[0.0; MOST]; MOST], [0.0; MOST]);
        let mut equations = Self { mass, bias, axes };
        for (at, body) in bodies.iter().enumerate().skip(1).rev() {
            let Some(parent) = body.parent else { continue };
            equations.bias[at - 1] = axes[at].dot(&forces[at]);
            let felt = masses[at].times(&axes[at]);
            let mut above = at;
            while above > 0 {
                equations.mass[at - 1][above - 1] = axes[above].dot(&felt);
                equations.mass[above - 1][at - 1] = axes[above].dot(&felt);
                above = bodies[above].parent.unwrap_or(0);
            }
            let (force, mass) = (forces[at], masses[at]);
            forces[parent] = forces[parent].plus(&force);
            masses[parent].add(&mass);
        }
        equations
    }
}

/// Writes the factors of a mass matrix, `L D Lᵀ`, over its lower half.
pub(super) fn factor(mass: &mut [[f64; MOST]; MOST], n: usize) {
    for i in 0..n {
        for j in 0..=i {
            let left =
                (0..j).fold(mass[i][j], |left, k| left - mass[i][k] * mass[j][k] * mass[k][k]);
            mass[i][j] = if i == j { left } else { left / mass[j][j] };
        }
    }
}

/// Solves for a vector with the factors of a mass matrix.
pub(super) fn solve(factors: &[[f64; MOST]; MOST], n: usize, vector: &mut [f64; MOST]) {
    for i in 0..n {
        for k in 0..i {
            vector[i] -= factors[i][k] * vector[k];
        }
    }
    for i in 0..n {
        vector[i] /= factors[i][i];
    }
    for i in (0..n).rev() {
        for k in i + 1..n {
            vector[i] -= factors[k][i] * vector[k];
        }
    }
}
