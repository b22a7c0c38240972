//! Rigid-body dynamics: gravity torques, inverse dynamics and the mass matrix.
//!
//! What is rigid is joined into one body per joint first. Each body is reckoned in its own frame, whose z is its joint's
//! axis: what crosses a joint is turned in two planes, and what the joint feels is one number of it. Rotor inertia and friction are not here: no value for the Gen3 is
//! published, and finding them is what the twin's effects are for.
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008: RNEA §5.3, CRBA §6.2.

#![expect(clippy::inline_always, reason = "what is not inlined into `widest` misses the registers")]

use nalgebra::{DMatrix, DVector, Vector3};

use super::cholesky;
use super::error::Error;
use super::fault::UrdfFault;
use super::frames::{Frames, Node};
use super::inertial::Inertial;
use super::moments::{Field, Moments};
use super::robot::Robot;
use super::scratch::{FEW, scratch};
use super::steps::Step;
use super::widest::widest;

/// Standard use in this program and in the reference values, m/s².
pub const GRAVITY: f64 = 9.81;

/// Which bodies count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bodies {
    /// The links up to the tip and what hangs beside the arm, but nothing *beyond* the tip: for the
    /// stdlib Gen3 the bare arm without its gripper.
    #[default]
    UpToTip,
    /// Every link of the file, gripper included.
    All,
}

/// The dynamics of a robot, with or without gripper and payload.
#[derive(Debug, Clone)]
pub struct Dynamics<'a> {
    robot: &'a Robot,
    /// Links that have mass and count.
    massive: Vec<(usize, Inertial)>,
    gravity: Vector3<f64>,
    opening: f64,
    frames: Frames,
    /// What moves with each frame, in that frame.
    joined: Vec<Inertial>,
    /// The same by its moments.
    bodies: Vec<Moments>,
}

impl<'a> Dynamics<'a> {
    /// Returns the dynamics of the bodies that count, with gravity [`GRAVITY`] along -z of the base.
    pub fn new(robot: &'a Robot, bodies: Bodies) -> Self {
        Self::at_opening(robot, bodies, 0.0)
    }

    /// Returns the same with a gap of `opening` m between the jaws: what [`Self::with_opening`] gives, joined once.
    pub fn at_opening(robot: &'a Robot, bodies: Bodies, opening: f64) -> Self {
        let mut beyond = vec![false; robot.links.len()];
        let mut massive = Vec::new();
        for (at, link) in robot.links.iter().enumerate() {
            beyond[at] = link.parent.is_some_and(|p| p == robot.tip || beyond[p]);
            if let Some(inertial) = link.inertial
                && (bodies == Bodies::All || !beyond[at])
            {
                massive.push((at, inertial));
            }
        }
        let gravity = Vector3::new(0.0, 0.0, -GRAVITY);
        let (frames, joined, bodies) = (Frames::default(), Vec::new(), Vec::new());
        Self { robot, massive, gravity, opening, frames, joined, bodies }.joined()
    }

    /// Joins what is rigid.
    fn joined(mut self) -> Self {
        self.frames = Frames::of(&self.robot.links, self.opening, |_| true);
        self.joined = vec![Inertial::zero(); self.frames.nodes.len()];
        for (link, inertial) in &self.massive {
            self.frames.join(*link, inertial, &mut self.joined);
        }
        self.bodies = self.joined.iter().map(Moments::of).collect();
        self
    }

    /// Adds a body that is fixed to the tip; `payload` is given in the tip's frame.
    #[must_use]
    pub fn with_payload(mut self, payload: Inertial) -> Self {
        self.massive.push((self.robot.tip, payload));
        self.frames.join(self.robot.tip, &payload, &mut self.joined);
        self.bodies = self.joined.iter().map(Moments::of).collect();
        self
    }

    /// Sets gravity, m/s², in base axes: for a base on a wall, or another planet.
    #[must_use]
    pub fn with_gravity(mut self, gravity: Vector3<f64>) -> Self {
        self.gravity = gravity;
        self
    }

    /// Sets the gap between the jaws, m: it moves their mass.
    #[must_use]
    pub fn with_opening(mut self, opening: f64) -> Self {
        self.opening = opening;
        self.joined()
    }

    /// Returns the mass of the bodies that count, kg.
    pub fn mass(&self) -> f64 {
        self.massive.iter().map(|(_, inertial)| inertial.mass).sum()
    }

    /// Returns the joint torques that hold the arm still at `q`, N·m.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] or [`Error::NotFinite`].
    pub fn gravity_torques(&self, q: &[f64]) -> Result<DVector<f64>, Error> {
        let zero = vec![0.0; self.robot.n_joints()];
        self.inverse(q, &zero, &zero)
    }

    /// Returns the torques of velocity and gravity, N·m: what [`Self::inverse`] gives at no acceleration.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] or [`Error::NotFinite`].
    pub fn bias(&self, q: &[f64], dq: &[f64]) -> Result<DVector<f64>, Error> {
        self.inverse(q, dq, &vec![0.0; self.robot.n_joints()])
    }

    /// Returns the joint torques, N·m, that give acceleration `ddq` (rad/s²) at `q` (rad), `dq` (rad/s).
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] or [`Error::NotFinite`].
    ///
    /// Source: recursive Newton-Euler, Featherstone §5.3, with vectors of three, each in its body's frame.
    pub fn inverse(&self, q: &[f64], dq: &[f64], ddq: &[f64]) -> Result<DVector<f64>, Error> {
        for values in [q, dq, ddq] {
            self.robot.check(values)?;
        }
        let mut tau = DVector::zeros(self.robot.n_joints());
        self.with_steps(
            q,
            #[inline(always)]
            |steps| self.torques(steps, dq, Some(ddq), tau.as_mut_slice()),
        );
        Ok(tau)
    }

    /// Works out the steps between frames and hands them on. Those of most arms need no memory of the heap.
    #[inline(always)]
    fn with_steps<T>(&self, q: &[f64], work: impl FnOnce(&[Step]) -> T) -> T {
        let n = self.bodies.len();
        let mut few = [Step::default(); FEW];
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
    fn torques(&self, steps: &[Step], dq: &[f64], ddq: Option<&[f64]>, tau: &mut [f64]) {
        let nodes = &self.frames.nodes;
        // The base accelerates upwards in place of gravity pulling every body down.
        let still = State { acc: -self.gravity, ..State::default() };
        let mut few = [State::default(); FEW];
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

    /// Returns the mass matrix, n × n, kg·m².
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] or [`Error::NotFinite`].
    ///
    /// Source: composite rigid bodies, Featherstone §6.2, each in its own frame.
    pub fn mass_matrix(&self, q: &[f64]) -> Result<DMatrix<f64>, Error> {
        self.robot.check(q)?;
        let n = self.robot.n_joints();
        let mut mass = DMatrix::zeros(n, n);
        self.with_steps(
            q,
            #[inline(always)]
            |steps| self.masses(steps, mass.as_mut_slice()),
        );
        Ok(mass)
    }

    /// Adds the mass matrix to `mass`, n × n.
    #[inline(always)]
    fn masses(&self, steps: &[Step], mass: &mut [f64]) {
        let n = self.robot.n_joints();
        let nodes = &self.frames.nodes;
        let mut few = [Moments::default(); FEW];
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

    /// Returns the accelerations, rad/s², that torques `tau` (N·m) give.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`], [`Error::NotFinite`], or [`Error::Urdf`] when some joint carries no mass.
    pub fn forward(&self, q: &[f64], dq: &[f64], tau: &[f64]) -> Result<DVector<f64>, Error> {
        self.robot.check(tau)?;
        self.robot.check(q)?;
        self.robot.check(dq)?;
        let n = tau.len();
        let mut rest = DVector::zeros(n);
        let mut few = [0.0; FEW * FEW];
        let mut many = Vec::new();
        let mass = scratch(n * n, &mut few, &mut many);
        self.with_steps(
            q,
            #[inline(always)]
            |steps| {
                self.torques(steps, dq, None, rest.as_mut_slice());
                self.masses(steps, mass);
            },
        );
        for (rest, tau) in rest.iter_mut().zip(tau) {
            *rest = tau - *rest;
        }
        if cholesky::solve(mass, rest.as_mut_slice()) {
            Ok(rest)
        } else {
            Err(Error::Urdf { what: UrdfFault::Massless })
        }
    }
}

impl Node {
    /// Returns what its joint feels of a force and a moment, N or N·m.
    #[inline]
    fn along(&self, (force, moment): &(Vector3<f64>, Vector3<f64>)) -> f64 {
        if self.slides { force.z } else { moment.z }
    }
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
