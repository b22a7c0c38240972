//! From each moving frame of a robot to the next: how far and which way turned, at given joint positions.
//!
//! What is reckoned body by body needs no frame in the base: a vector is carried over a joint with two plane turns, a third
//! of the products that placing the frame and carrying it into the base would take. Frames in the base are
//! [`super::frames`].
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, §4.4: the transforms between neighbouring bodies.

#![expect(clippy::inline_always, reason = "what is not inlined into `widest` misses the registers")]

use nalgebra::Vector3;

use super::frames::{Frames, Node};
use super::sin_cos::{LANES, sin_cos};

/// What lies between a frame and the one it hangs on. The turns are about z, x and z, each a sine and a cosine.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Step {
    pub(super) before: Option<(f64, f64)>,
    pub(super) tilt: (f64, f64),
    pub(super) turn: (f64, f64),
    /// From the parent's origin, in the parent's frame, m.
    pub(super) reach: Vector3<f64>,
}

impl Step {
    /// Carries a direction of the frame into its parent's.
    #[inline(always)]
    pub(super) fn outward(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let (x, y) = turned((v.x, v.y), self.turn);
        let (y, z) = turned((y, v.z), self.tilt);
        let (x, y) = self.before.map_or((x, y), |before| turned((x, y), before));
        Vector3::new(x, y, z)
    }

    /// Carries a direction of the parent's frame into this one.
    #[inline(always)]
    pub(super) fn inward(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let (x, y) = self.before.map_or((v.x, v.y), |before| back((v.x, v.y), before));
        let (y, z) = back((y, v.z), self.tilt);
        let (x, y) = back((x, y), self.turn);
        Vector3::new(x, y, z)
    }

    /// Carries a force, and a moment about the frame's origin, to the parent's origin and frame.
    #[inline(always)]
    pub(super) fn wrench(
        &self,
        (force, moment): (Vector3<f64>, Vector3<f64>),
    ) -> (Vector3<f64>, Vector3<f64>) {
        // Both at once: pairs of numbers are a register.
        let [x, y, z] = [0, 1, 2].map(|i| [force[i], moment[i]]);
        let (x, y) = both_turned(x, y, self.turn);
        let (y, z) = both_turned(y, z, self.tilt);
        let (x, y) = self.before.map_or((x, y), |before| both_turned(x, y, before));
        let force = Vector3::new(x[0], y[0], z[0]);
        (force, Vector3::new(x[1], y[1], z[1]) + self.reach.cross(&force))
    }
}

#[inline(always)]
fn both_turned(a: [f64; 2], b: [f64; 2], (sin, cos): (f64, f64)) -> ([f64; 2], [f64; 2]) {
    (
        [a[0] * cos - b[0] * sin, a[1] * cos - b[1] * sin],
        [b[0] * cos + a[0] * sin, b[1] * cos + a[1] * sin],
    )
}

#[inline(always)]
fn turned((a, b): (f64, f64), (sin, cos): (f64, f64)) -> (f64, f64) {
    (a * cos - b * sin, b * cos + a * sin)
}

#[inline(always)]
fn back((a, b): (f64, f64), (sin, cos): (f64, f64)) -> (f64, f64) {
    (a * cos + b * sin, b * cos - a * sin)
}

impl Frames {
    /// Writes the step to every frame for joint positions `q` (rad, m for sliding joints); one entry a frame.
    #[inline(always)]
    pub(super) fn steps(&self, q: &[f64], steps: &mut [Step]) {
        for (nodes, steps) in self.nodes.chunks(LANES).zip(steps.chunks_mut(LANES)) {
            let mut angles = [0.0; LANES];
            for (angle, node) in angles.iter_mut().zip(nodes) {
                *angle = node.after + if node.slides { 0.0 } else { node.value(q) };
            }
            let (sines, cosines) = sin_cos(&angles);
            for (k, (node, step)) in nodes.iter().zip(steps).enumerate() {
                let reach = if node.slides { slid(node, node.value(q)) } else { node.shift };
                let turn = (sines[k], cosines[k]);
                *step = Step { before: node.before, tilt: node.tilt, turn, reach };
            }
        }
    }
}

/// Returns where a sliding joint puts its frame, in the parent's, m.
fn slid(node: &Node, by: f64) -> Vector3<f64> {
    let still = Step { before: node.before, tilt: node.tilt, turn: (0.0, 1.0), ..Step::default() };
    node.shift + still.outward(&Vector3::z()) * by
}
