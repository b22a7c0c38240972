//! Rigid-body dynamics: gravity torques, inverse dynamics and the mass matrix.
//!
//! What is rigid is joined into one body per joint first. Forces and moments are written about the base origin in base
//! axes, so that bodies add up without being moved. Rotor inertia and friction are not here: no value for the Gen3 is
//! published, and finding them is what the twin's effects are for.
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008: RNEA §5.3, CRBA §6.2.

use nalgebra::{DMatrix, DVector, Vector3};

use super::cholesky;
use super::error::Error;
use super::fault::UrdfFault;
use super::frames::{Frame, Frames, Node};
use super::inertial::Inertial;
use super::robot::Robot;
use crate::world::frame::times;

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
    bodies: Vec<Inertial>,
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
        let (frames, bodies) = (Frames::default(), Vec::new());
        Self { robot, massive, gravity, opening, frames, bodies }.joined()
    }

    /// Joins what is rigid.
    fn joined(mut self) -> Self {
        self.frames = Frames::of(&self.robot.links, self.opening, |_| true);
        self.bodies = vec![Inertial::zero(); self.frames.nodes.len()];
        for (link, inertial) in &self.massive {
            self.frames.join(*link, inertial, &mut self.bodies);
        }
        self
    }

    /// Adds a body that is fixed to the tip; `payload` is given in the tip's frame.
    #[must_use]
    pub fn with_payload(mut self, payload: Inertial) -> Self {
        self.massive.push((self.robot.tip, payload));
        self.frames.join(self.robot.tip, &payload, &mut self.bodies);
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
    /// Source: recursive Newton-Euler, Featherstone §5.3, with vectors of three, all in base axes.
    pub fn inverse(&self, q: &[f64], dq: &[f64], ddq: &[f64]) -> Result<DVector<f64>, Error> {
        for values in [q, dq, ddq] {
            self.robot.check(values)?;
        }
        let mut placed = Vec::with_capacity(self.bodies.len());
        self.frames.place(q, &mut placed);
        let mut tau = DVector::zeros(self.robot.n_joints());
        self.torques(&placed, dq, Some(ddq), tau.as_mut_slice());
        Ok(tau)
    }

    /// Adds the torques of a motion to `tau`; without `ddq`, those of no acceleration.
    fn torques(&self, placed: &[Frame], dq: &[f64], ddq: Option<&[f64]>, tau: &mut [f64]) {
        let nodes = &self.frames.nodes;
        // The base accelerates upwards in place of gravity pulling every body down.
        let still = State { acc: -self.gravity, ..State::default() };
        let mut states: Vec<State> = Vec::with_capacity(nodes.len());
        for ((node, frame), body) in nodes.iter().zip(placed).zip(&self.bodies) {
            let (before, from) = match node.parent {
                Some(parent) => (states[parent], placed[parent].origin),
                None => (still, Vector3::zeros()),
            };
            let rate = ddq.map_or(0.0, |ddq| ddq[node.index]);
            states.push(
                before
                    .moved(node, frame, frame.origin - from, dq[node.index], rate)
                    .with(body, frame),
            );
        }
        for at in (0..nodes.len()).rev() {
            let (node, frame) = (&nodes[at], &placed[at]);
            let State { force, moment, .. } = states[at];
            let about = if node.slides { force } else { moment - frame.origin.cross(&force) };
            tau[node.index] += node.multiplier * frame.z.dot(&about);
            if let Some(parent) = node.parent {
                states[parent].force += force;
                states[parent].moment += moment;
            }
        }
    }

    /// Returns the mass matrix, n × n, kg·m².
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] or [`Error::NotFinite`].
    ///
    /// Source: composite rigid bodies, Featherstone §6.2, all in base coordinates.
    pub fn mass_matrix(&self, q: &[f64]) -> Result<DMatrix<f64>, Error> {
        self.robot.check(q)?;
        let mut placed = Vec::with_capacity(self.bodies.len());
        self.frames.place(q, &mut placed);
        let n = self.robot.n_joints();
        let mut mass = DMatrix::zeros(n, n);
        self.masses(&placed, mass.as_mut_slice());
        Ok(mass)
    }

    /// Adds the mass matrix to `mass`, n × n.
    fn masses(&self, placed: &[Frame], mass: &mut [f64]) {
        let n = self.robot.n_joints();
        let nodes = &self.frames.nodes;
        let mut composite: Vec<Composite> = self
            .bodies
            .iter()
            .zip(placed)
            .map(|(body, frame)| Composite::of(body, frame))
            .collect();
        let mut axes: Vec<Vector3<f64>> = Vec::with_capacity(nodes.len());
        axes.extend(placed.iter().map(|frame| frame.origin.cross(&frame.z)));
        for at in (0..nodes.len()).rev() {
            let (node, whole) = (&nodes[at], composite[at]);
            let z = placed[at].z;
            let (force, moment) =
                if node.slides { whole.pushed(&z) } else { whole.turned(&z, &axes[at]) };
            let mut other = Some(at);
            while let Some(above) = other {
                let upper = &nodes[above];
                let felt = if upper.slides {
                    placed[above].z.dot(&force)
                } else {
                    placed[above].z.dot(&moment) + axes[above].dot(&force)
                };
                let coupling = node.multiplier * upper.multiplier * felt;
                mass[node.index * n + upper.index] += coupling;
                if above != at {
                    mass[upper.index * n + node.index] += coupling;
                }
                other = upper.parent;
            }
            if let Some(parent) = node.parent {
                composite[parent].add(&whole);
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
        let mut placed = Vec::with_capacity(self.bodies.len());
        self.frames.place(q, &mut placed);
        let n = tau.len();
        let mut bias = vec![0.0; n];
        self.torques(&placed, dq, None, &mut bias);
        let mut rest = DVector::from_fn(n, |i, _| tau[i] - bias[i]);
        let mut mass = vec![0.0; n * n];
        self.masses(&placed, &mut mass);
        if cholesky::solve(&mut mass, rest.as_mut_slice()) {
            Ok(rest)
        } else {
            Err(Error::Urdf { what: UrdfFault::Massless })
        }
    }
}

/// How a frame moves, and what acts on it and on all that hangs on it; base axes.
#[derive(Debug, Clone, Copy, Default)]
struct State {
    /// rad/s.
    omega: Vector3<f64>,
    /// rad/s².
    alpha: Vector3<f64>,
    /// Of the frame's origin, m/s².
    acc: Vector3<f64>,
    /// N.
    force: Vector3<f64>,
    /// About the base origin, N·m.
    moment: Vector3<f64>,
}

impl State {
    /// Returns the motion of the next frame, whose origin is `arm` away, with its joint at speed `dq` and
    /// acceleration `ddq`.
    #[inline]
    fn moved(&self, node: &Node, frame: &Frame, arm: Vector3<f64>, dq: f64, ddq: f64) -> Self {
        let (omega, alpha) = (self.omega, self.alpha);
        let acc = self.acc + alpha.cross(&arm) + omega.cross(&omega.cross(&arm));
        let (fast, faster) = (frame.z * (node.multiplier * dq), frame.z * (node.multiplier * ddq));
        let still = Self { omega, alpha, acc, ..Self::default() };
        if node.slides {
            return Self { acc: acc + faster + 2.0 * omega.cross(&fast), ..still };
        }
        Self { omega: omega + fast, alpha: alpha + faster + omega.cross(&fast), ..still }
    }

    /// Adds what it takes to move a body so.
    #[inline]
    fn with(mut self, body: &Inertial, frame: &Frame) -> Self {
        let com = frame.direction(&body.com);
        let (omega, alpha) = (self.omega, self.alpha);
        self.force = body.mass * (self.acc + alpha.cross(&com) + omega.cross(&omega.cross(&com)));
        let (inside, push) = (frame.local(&omega), frame.local(&alpha));
        let spin = times(&body.inertia, &push) + inside.cross(&times(&body.inertia, &inside));
        self.moment = frame.direction(&spin) + (frame.origin + com).cross(&self.force);
        self
    }
}

/// Bodies welded together, about the base origin in base axes.
#[derive(Debug, Clone, Copy)]
struct Composite {
    /// kg.
    mass: f64,
    /// Mass times centre of mass, kg·m.
    first: Vector3<f64>,
    /// Inertia, kg·m²: xx, yy, zz, then xy, xz, yz.
    second: [f64; 6],
}

impl Composite {
    #[inline]
    fn of(body: &Inertial, frame: &Frame) -> Self {
        let axes = [frame.x, frame.y, frame.z];
        // R I R': each axis times what the inertia makes of it.
        let mut second = [0.0; 6];
        for (a, axis) in axes.iter().enumerate() {
            let i = &body.inertia;
            let b = frame.x * i[(a, 0)] + frame.y * i[(a, 1)] + frame.z * i[(a, 2)];
            second[0] += axis.x * b.x;
            second[1] += axis.y * b.y;
            second[2] += axis.z * b.z;
            second[3] += axis.x * b.y;
            second[4] += axis.x * b.z;
            second[5] += axis.y * b.z;
        }
        let c = frame.point(&body.com);
        let first = c * body.mass;
        second[0] += first.y * c.y + first.z * c.z;
        second[1] += first.x * c.x + first.z * c.z;
        second[2] += first.x * c.x + first.y * c.y;
        second[3] -= first.x * c.y;
        second[4] -= first.x * c.z;
        second[5] -= first.y * c.z;
        Self { mass: body.mass, first, second }
    }

    fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.first += other.first;
        for (a, b) in self.second.iter_mut().zip(&other.second) {
            *a += b;
        }
    }

    /// Returns force and moment that turn it about an axis `z` with `arm`, the axis' point crossed with it.
    fn turned(&self, z: &Vector3<f64>, arm: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let [xx, yy, zz, xy, xz, yz] = self.second;
        let spun = Vector3::new(
            xx * z.x + xy * z.y + xz * z.z,
            xy * z.x + yy * z.y + yz * z.z,
            xz * z.x + yz * z.y + zz * z.z,
        );
        (arm * self.mass + z.cross(&self.first), spun + self.first.cross(arm))
    }

    /// Returns force and moment that push it along an axis.
    fn pushed(&self, z: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        (z * self.mass, self.first.cross(z))
    }
}
