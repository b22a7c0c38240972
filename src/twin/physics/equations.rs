//! The arm's equations of motion, as they are solved for here, and how its bodies go when its joints do.
//!
//! Mass matrix and bias are [`crate::motion::dynamics`]'s, over a linkage in which the jaws are joints as well ([`Tree`]); its
//! factors, too, are that layer's. What is reckoned here is what contacts ask: velocities about the base in the axes of the world.
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, §2.3: spatial velocities about one point.

use nalgebra::{Isometry3, Vector3};

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

/// The equations of motion: `mass · q̈ + bias = τ`, joints by the bodies they move.
pub(super) struct Equations {
    /// n × n, of which the rest is not used.
    pub(super) mass: [f64; MOST * MOST],
    pub(super) bias: [f64; MOST],
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
}

impl Equations {
    /// Works out the equations of motion of a tree whose joints are at `q` (rad or m) with `speeds`, and whose bodies fall at
    /// `gravity` in the axes of the base, m/s².
    pub(super) fn new(
        tree: &Tree,
        gravity: &Vector3<f64>,
        q: &[f64; MOST],
        speeds: &[f64; MOST],
    ) -> Self {
        let n = tree.bodies.len() - 1;
        let (mut mass, mut bias) = ([0.0; MOST * MOST], [0.0; MOST]);
        let within = (&mut mass[..n * n], &mut bias[..n]);
        tree.linkage.equations::<MOST>(gravity, &q[..n], &speeds[..n], within.0, within.1);
        Self { mass, bias }
    }
}

/// Returns how each body, at `poses`, goes when its joint does.
pub(super) fn axes(tree: &Tree, poses: &[Isometry3<f64>]) -> [Twist; MOST] {
    let base = poses[0].translation.vector;
    let mut axes = [Twist::default(); MOST];
    for ((axis, body), pose) in axes.iter_mut().zip(&tree.bodies).zip(poses) {
        let Some(joint) = &body.joint else { continue };
        let along = pose.rotation * joint.axis.into_inner();
        *axis = if joint.motion == Motion::Slide {
            Twist { turns: Vector3::zeros(), moves: along }
        } else {
            Twist { turns: along, moves: (pose.translation.vector - base).cross(&along) }
        };
    }
    axes
}
