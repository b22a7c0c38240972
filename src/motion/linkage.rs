//! The recursions of rigid-body dynamics, over a tree of moving frames: torques from the base outwards and back, the mass matrix inwards.
//!
//! Each body is reckoned in its own frame, whose z is its joint's axis: what crosses a joint is turned in two planes, and what
//! the joint feels is one number of it. Both recursions are here once, over a [`Linkage`]: a robot's ([`super::dynamics`]), where
//! what `q` does not drive is rigid, and the twin's, whose jaws are joints as well.
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008: RNEA §5.3, CRBA §6.2.

#![expect(clippy::inline_always, reason = "what is not inlined into `widest` misses the registers")]

use nalgebra::Vector3;

use super::frames::{Frames, Node};
use super::inertial::Inertial;
use super::lanes::{Job, Wide, run};
use super::moments::{Field, Moments};
use super::quad::{Marks, Quad};
use super::robot::Link;
use super::scratch::{FEW, scratch};
use super::steps::Step;
use super::widest::widest;

/// The moving frames of a tree of links and what moves with each: what the recursions go through.
#[derive(Debug, Clone, Default)]
pub(crate) struct Linkage {
    pub(super) frames: Frames,
    /// What moves with each frame, in that frame.
    pub(super) bodies: Vec<Moments>,
    pub(super) n_joints: usize,
}

impl Linkage {
    /// Returns the linkage of all links, of which [`super::robot::Drive::Joint`] moves those that move, by `n_joints` values; all
    /// others stand as they do at an opening, m.
    pub(crate) fn of(links: &[Link], opening: f64, n_joints: usize) -> Self {
        let frames = Frames::of(links, opening, |_| true);
        let mut joined = vec![Inertial::zero(); frames.nodes.len()];
        for (at, link) in links.iter().enumerate() {
            if let Some(inertial) = &link.inertial {
                frames.join(at, inertial, &mut joined);
            }
        }
        Self { frames, bodies: joined.iter().map(Moments::of).collect(), n_joints }
    }

    /// Adds the parts of the equations of motion, `mass · q̈ + bias = τ`, to a matrix n × n, kg·m², and a vector, N·m. Gravity
    /// is in the axes of the base, m/s²; memory for more than `N` frames is the heap's.
    #[inline(always)]
    pub(crate) fn equations<const N: usize>(
        &self,
        gravity: &Vector3<f64>,
        q: &[f64],
        dq: &[f64],
        mass: &mut [f64],
        bias: &mut [f64],
    ) {
        self.with_steps::<N, _>(
            q,
            #[inline(always)]
            |steps| {
                self.torques::<N>(steps, gravity, dq, None, bias);
                self.masses::<N>(steps, mass);
            },
        );
    }

    /// Works out the steps between frames and hands them on. Those of most arms need no memory of the heap.
    #[inline(always)]
    pub(super) fn with_steps<const N: usize, T>(
        &self,
        q: &[f64],
        work: impl FnOnce(&[Step]) -> T,
    ) -> T {
        let n = self.bodies.len();
        let mut few = [Step::default(); N];
        let mut many = Vec::new();
        let steps = scratch(n, &mut few, &mut many);
        widest(
            #[inline(always)]
            || {
                self.frames.steps(q, steps);
                work(steps)
            },
        )
    }

    /// Adds the torques of a motion to `tau`; without `ddq`, those of no acceleration.
    #[inline(always)]
    pub(super) fn torques<const N: usize>(
        &self,
        steps: &[Step],
        gravity: &Vector3<f64>,
        dq: &[f64],
        ddq: Option<&[f64]>,
        tau: &mut [f64],
    ) {
        let nodes = &self.frames.nodes;
        // The base accelerates upwards in place of gravity pulling every body down.
        let still = State { acc: -gravity, ..State::default() };
        let mut few = [State::default(); N];
        let mut many = Vec::new();
        let states = scratch(nodes.len(), &mut few, &mut many);
        for (at, ((node, step), body)) in nodes.iter().zip(steps).zip(&self.bodies).enumerate() {
            let before = node.parent.map_or(&still, |parent| &states[parent]);
            let rate = ddq.map_or(0.0, |ddq| ddq[node.index]);
            states[at] = before.moved(node, step, dq[node.index], rate).with(body);
        }
        for at in (0..nodes.len()).rev() {
            let (node, felt) = (&nodes[at], states[at].felt);
            tau[node.index] += node.multiplier * node.along(&felt);
            if let Some(parent) = node.parent {
                let (force, moment) = steps[at].wrench(felt);
                let whole = &mut states[parent].felt;
                *whole = (whole.0 + force, whole.1 + moment);
            }
        }
    }

    /// Adds the mass matrix to `mass`, n × n.
    #[inline(always)]
    pub(super) fn masses<const N: usize>(&self, steps: &[Step], mass: &mut [f64]) {
        if self.frames.is_chain && self.frames.nodes.len() <= FEW {
            return run(Chain { linkage: self, steps, mass });
        }
        let n = self.n_joints;
        let nodes = &self.frames.nodes;
        let mut few = [Moments::default(); N];
        let mut many = Vec::new();
        let composite = scratch(nodes.len(), &mut few, &mut many);
        composite.copy_from_slice(&self.bodies);
        for at in (0..nodes.len()).rev() {
            let (node, whole) = (&nodes[at], composite[at]);
            let mut felt =
                if node.slides { whole.pushed_along_z() } else { whole.turned_about_z() };
            mass[node.index * n + node.index] +=
                node.multiplier * node.multiplier * node.along(&felt);
            let mut below = at;
            while let Some(above) = nodes[below].parent {
                let upper = &nodes[above];
                felt = steps[below].wrench(felt);
                let coupling = node.multiplier * upper.multiplier * upper.along(&felt);
                mass[node.index * n + upper.index] += coupling;
                mass[upper.index * n + node.index] += coupling;
                below = above;
            }
            if let Some(parent) = node.parent {
                composite[parent].add(&whole, &steps[at]);
            }
        }
    }
}

/// The mass matrix of a chain: what all joints below feel of a push crosses the next joint at once.
struct Chain<'m> {
    linkage: &'m Linkage,
    steps: &'m [Step],
    mass: &'m mut [f64],
}

impl Job for Chain<'_> {
    type Found = ();

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) {
        let Self { linkage, steps, mass } = self;
        let (nodes, bodies) = (&*linkage.frames.nodes, &*linkage.bodies);
        let n = linkage.n_joints;
        let (steps, bodies) = (&steps[..nodes.len()], &bodies[..nodes.len()]);
        let lanes = [Quad::of(simd, [0.0, 1.0, 2.0, 3.0]), Quad::of(simd, [4.0, 5.0, 6.0, 7.0])];
        let mut pushes = [Pushes::none(simd); 2];
        let mut whole = Moments::default();
        let mut indices = [0; FEW];
        // The last node is in lane 0, so that the first joints crossed take one register.
        for (lane, at) in (0..nodes.len()).rev().enumerate() {
            let (node, quads) = (&nodes[at], 1 + lane / 4);
            let mut left = lane + 1;
            let mut sum = bodies[at];
            if lane > 0 {
                let step = &steps[at + 1];
                sum.add(&whole, step);
                for pushes in &mut pushes[..=(lane - 1) / 4] {
                    pushes.cross(step);
                }
            }
            whole = sum;
            let own = if node.slides { whole.pushed_along_z() } else { whole.turned_about_z() };
            // What lies beyond is written when its turn comes.
            pushes[quads - 1].begin(
                lanes[quads - 1].reaches(Quad::all(simd, lane as f64)),
                node,
                &own,
            );
            indices[lane] = node.index;
            let (first, multiplier) = (n * node.index, Quad::all(simd, node.multiplier));
            for (pushes, indices) in pushes[..quads].iter().zip(indices.chunks(4)) {
                let felt = if node.slides { pushes.force[2] } else { pushes.moment[2] };
                let felt = (felt * multiplier).lanes();
                for i in 0..4.min(left) {
                    mass[first + indices[i]] += felt[i];
                    // The last is the joint itself.
                    if left > 1 {
                        mass[n * indices[i] + node.index] += felt[i];
                    }
                    left -= 1;
                }
            }
        }
    }
}

/// Forces and moments that give four joints an acceleration of one, seen from one frame.
#[derive(Clone, Copy)]
struct Pushes<S: Wide> {
    force: [Quad<S>; 3],
    moment: [Quad<S>; 3],
}

impl<S: Wide> Pushes<S> {
    #[inline(always)]
    fn none(simd: S) -> Self {
        let none = [Quad::all(simd, 0.0); 3];
        Self { force: none, moment: none }
    }

    /// Puts the push of a joint into some lanes.
    #[inline(always)]
    fn begin(
        &mut self,
        lanes: Marks<S>,
        node: &Node,
        (force, moment): &(Vector3<f64>, Vector3<f64>),
    ) {
        let simd = self.force[0].simd();
        let k = |x: f64| Quad::all(simd, node.multiplier * x);
        for i in 0..3 {
            self.force[i] = lanes.pick(k(force[i]), self.force[i]);
            self.moment[i] = lanes.pick(k(moment[i]), self.moment[i]);
        }
    }

    /// Carries them to the parent's origin and frame.
    #[inline(always)]
    fn cross(&mut self, step: &Step) {
        let simd = self.force[0].simd();
        let k = |x: f64| Quad::all(simd, x);
        let ([x, y, z], [a, b, c]) = (outward(self.force, step), outward(self.moment, step));
        let r = &step.reach;
        let (rx, ry, rz) = (k(r.x), k(r.y), k(r.z));
        self.force = [x, y, z];
        self.moment = [a + (ry * z - rz * y), b + (rz * x - rx * z), c + (rx * y - ry * x)];
    }
}

impl Node {
    /// Returns what its joint feels of a force and a moment, N or N·m.
    #[inline]
    fn along(&self, (force, moment): &(Vector3<f64>, Vector3<f64>)) -> f64 {
        if self.slides { force.z } else { moment.z }
    }
}

/// Carries four directions of a step's frame into its parent's.
#[inline(always)]
fn outward<S: Wide>([x, y, z]: [Quad<S>; 3], step: &Step) -> [Quad<S>; 3] {
    let (x, y) = turned(x, y, step.turn);
    let (y, z) = turned(y, z, step.tilt);
    let (x, y) = match step.before {
        Some(before) => turned(x, y, before),
        None => (x, y),
    };
    [x, y, z]
}

#[inline(always)]
fn turned<S: Wide>(a: Quad<S>, b: Quad<S>, (sin, cos): (f64, f64)) -> (Quad<S>, Quad<S>) {
    let (sin, cos) = (Quad::all(a.simd(), sin), Quad::all(a.simd(), cos));
    (a * cos - b * sin, b * cos + a * sin)
}

/// How a frame moves, and what acts on it and on all that hangs on it; in its own axes.
#[derive(Debug, Clone, Copy, Default)]
struct State {
    /// rad/s.
    omega: Vector3<f64>,
    /// rad/s².
    alpha: Vector3<f64>,
    /// Of the frame's origin, m/s².
    acc: Vector3<f64>,
    /// What other places are accelerated by besides.
    field: Field,
    /// Force, N, and moment about the frame's origin, N·m.
    felt: (Vector3<f64>, Vector3<f64>),
}

impl State {
    /// Returns the motion of the next frame, a step away, with its joint at speed `dq` and acceleration `ddq`.
    #[inline(always)]
    fn moved(&self, node: &Node, step: &Step, dq: f64, ddq: f64) -> Self {
        let (fast, faster) = (node.multiplier * dq, node.multiplier * ddq);
        let mut acc = step.inward(&(self.acc + self.field.times(&step.reach)));
        let (mut omega, mut alpha) = (step.inward(&self.omega), step.inward(&self.alpha));
        // What z crosses with the speed: Coriolis' part, twice for what slides.
        let aside = Vector3::new(omega.y * fast, -omega.x * fast, 0.0);
        if node.slides {
            acc += 2.0 * aside;
            acc.z += faster;
        } else {
            omega.z += fast;
            alpha += aside;
            alpha.z += faster;
        }
        Self { omega, alpha, acc, field: Field::of(&omega, &alpha), ..Self::default() }
    }

    /// Adds what it takes to move a body so.
    #[inline(always)]
    fn with(mut self, body: &Moments) -> Self {
        self.felt = body.moved(&self.acc, &self.field);
        self
    }
}
