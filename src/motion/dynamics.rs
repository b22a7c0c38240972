//! Rigid-body dynamics: gravity torques, inverse dynamics and the mass matrix.
//!
//! What is rigid is joined into one body per joint first; what goes through the bodies is a `Linkage`. Rotor inertia and friction are
//! not here: no value for the Gen3 is published, and finding them is what the twin's effects are for.
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008: RNEA §5.3, CRBA §6.2.

use nalgebra::{DMatrix, DVector, Vector3};

use super::cholesky;
pub(crate) use super::cholesky::{factor, solve_with};
use super::error::Error;
use super::fault::UrdfFault;
use super::frames::Frames;
use super::inertial::Inertial;
pub(crate) use super::linkage::Linkage;
use super::moments::Moments;
use super::robot::Robot;
use super::scratch::{FEW, scratch};

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
