//! Rigid-body dynamics: gravity torques, inverse dynamics and the mass matrix.
//!
//! What is rigid is joined into one body per joint first. Each body is reckoned in its own frame, whose z is its joint's
//! axis: what crosses a joint is turned in two planes, and what the joint feels is one number of it. Rotor inertia and friction are not here: no value for the Gen3 is
//! published, and finding them is what the twin's effects are for.
//!
//! Both recursions are here once, over a `Linkage`: a robot's, where what `q` does not drive is rigid, and the twin's,
//! whose jaws are joints as well.
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008: RNEA §5.3, CRBA §6.2.

#![expect(clippy::inline_always, reason = "what is not inlined into `widest` misses the registers")]

use nalgebra::{DMatrix, DVector, Vector3};

use super::cholesky;
pub(crate) use super::cholesky::{factor, solve_with};
use super::error::Error;
use super::fault::UrdfFault;
use super::frames::{Frames, Node};
use super::inertial::Inertial;
use super::lanes::{Job, Wide, run};
use super::moments::{Field, Moments};
use super::quad::{Marks, Quad};
use super::robot::{Link, Robot};
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
    /// What moves with each frame, in that frame.
    joined: Vec<Inertial>,
    /// The same by its moments.
    linkage: Linkage,
}

/// The moving frames of a tree of links and what moves with each: what the recursions go through.
#[derive(Debug, Clone, Default)]
pub(crate) struct Linkage {
    frames: Frames,
    /// What moves with each frame, in that frame.
    bodies: Vec<Moments>,
    n_joints: usize,
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
        let (joined, linkage) = (Vec::new(), Linkage::default());
        Self { robot, massive, gravity, opening, joined, linkage }.joined()
    }

    /// Joins what is rigid.
    fn joined(mut self) -> Self {
        let frames = Frames::of(&self.robot.links, self.opening, |_| true);
        self.joined = vec![Inertial::zero(); frames.nodes.len()];
        for (link, inertial) in &self.massive {
            frames.join(*link, inertial, &mut self.joined);
        }
        let bodies = self.joined.iter().map(Moments::of).collect();
        self.linkage = Linkage { frames, bodies, n_joints: self.robot.n_joints() };
        self
    }

    /// Adds a body that is fixed to the tip; `payload` is given in the tip's frame.
    #[must_use]
    pub fn with_payload(mut self, payload: Inertial) -> Self {
        self.massive.push((self.robot.tip, payload));
        self.linkage.frames.join(self.robot.tip, &payload, &mut self.joined);
        self.linkage.bodies = self.joined.iter().map(Moments::of).collect();
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
        let (linkage, gravity) = (&self.linkage, &self.gravity);
        linkage.with_steps::<FEW, _>(
            q,
            #[inline(always)]
            |steps| linkage.torques::<FEW>(steps, gravity, dq, Some(ddq), tau.as_mut_slice()),
        );
        Ok(tau)
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
        self.linkage.with_steps::<FEW, _>(
            q,
            #[inline(always)]
            |steps| self.linkage.masses::<FEW>(steps, mass.as_mut_slice()),
        );
        Ok(mass)
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
        self.linkage.equations::<FEW>(&self.gravity, q, dq, mass, rest.as_mut_slice());
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
    fn with_steps<const N: usize, T>(&self, q: &[f64], work: impl FnOnce(&[Step]) -> T) -> T {
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
    fn torques<const N: usize>(
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
    fn masses<const N: usize>(&self, steps: &[Step], mass: &mut [f64]) {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain whose joints turn, slide and follow each other.
    const CHAIN: &str = r#"<robot name="chain"><link name="base"/>
        <link name="a"><inertial><origin xyz="0.1 0.02 -0.03" rpy="0.1 0.2 0.3"/><mass value="2"/>
            <inertia ixx="0.02" iyy="0.03" izz="0.025" ixy="0.001" ixz="-0.002" iyz="0.0015"/></inertial></link>
        <link name="b"><inertial><origin xyz="0 0.1 0.05"/><mass value="1.5"/>
            <inertia ixx="0.01" iyy="0.02" izz="0.015" ixy="0.001" ixz="0.002" iyz="0"/></inertial></link>
        <link name="c"><inertial><origin xyz="0.05 0.1 0.05"/><mass value="1.1"/>
            <inertia ixx="0.01" iyy="0.02" izz="0.015" ixy="0" ixz="0.002" iyz="0"/></inertial></link>
        <link name="d"><inertial><origin xyz="0.05 -0.1 0.05"/><mass value="0.7"/>
            <inertia ixx="0.01" iyy="0.02" izz="0.015" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <link name="e"><inertial><origin xyz="0.02 -0.1 0.05"/><mass value="0.6"/>
            <inertia ixx="0.01" iyy="0.02" izz="0.015" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <link name="f"><inertial><origin xyz="0.02 -0.1 0.05"/><mass value="0.4"/>
            <inertia ixx="0.01" iyy="0.02" izz="0.015" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="1" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0.1 0 0.2" rpy="0.3 0.1 -0.2"/>
            <axis xyz="0.3 0.5 0.8"/><limit lower="-2" upper="2" velocity="1" effort="9"/></joint>
        <joint name="2" type="prismatic"><parent link="a"/><child link="b"/><origin xyz="0.1 0.2 0.2" rpy="0.3 0.7 -0.2"/>
            <axis xyz="1 0 0"/><limit lower="-0.5" upper="0.5" velocity="1" effort="9"/></joint>
        <joint name="3" type="continuous"><parent link="b"/><child link="c"/><origin xyz="0.1 -0.2 0.2" rpy="0.3 0.7 1.2"/>
            <axis xyz="0 1 0"/><limit velocity="1" effort="9"/></joint>
        <joint name="4" type="revolute"><parent link="c"/><child link="d"/><origin xyz="0 -0.1 0.2"/>
            <axis xyz="0 0 -1"/><limit lower="-2" upper="2" velocity="1" effort="9"/></joint>
        <joint name="5" type="revolute"><parent link="d"/><child link="e"/><origin xyz="0 -0.1 0.2" rpy="1 0 0"/>
            <axis xyz="0 1 1"/><limit lower="-2" upper="2" velocity="1" effort="9"/><mimic joint="3" multiplier="-0.7"/></joint>
        <joint name="6" type="prismatic"><parent link="e"/><child link="f"/><origin xyz="0 0.1 0.1" rpy="0 1 0"/>
            <axis xyz="0 0 1"/><limit lower="-0.5" upper="0.5" velocity="1" effort="9"/></joint>
        </robot>"#;

    #[test]
    fn a_chains_mass_matrix_is_what_inverse_dynamics_gives_for_each_joint() {
        let robot = Robot::from_urdf(CHAIN, Some("f")).unwrap();
        let n = robot.n_joints();
        assert_eq!(n, 5, "one of the six follows another");
        let dynamics = Dynamics::new(&robot, Bodies::All).with_gravity(Vector3::zeros());
        let q = [0.4, -0.2, 1.1, -0.9, 0.3];
        let mass = dynamics.mass_matrix(&q).unwrap();
        for joint in 0..n {
            let mut ddq = [0.0; 5];
            ddq[joint] = 1.0;
            let tau = dynamics.inverse(&q, &[0.0; 5], &ddq).unwrap();
            assert!((tau - mass.column(joint)).amax() < 1e-13, "joint {joint}: {mass}");
        }
    }
}
