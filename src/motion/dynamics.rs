//! Rigid-body dynamics: gravity torques, inverse dynamics and the mass matrix.
//!
//! Twists and wrenches are written about the base origin in base axes, angular part first, so that
//! bodies add up without being moved. Rotor inertia and friction are not here: no value for the Gen3 is
//! published, and finding them is what the twin's effects are for.
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008: RNEA §5.3, CRBA §6.2.

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Matrix6, Vector3, Vector6};

use super::error::Error;
use super::fault::UrdfFault;
use super::inertial::Inertial;
use super::kinematics::link_poses_into;
use super::robot::{Drive, Motion, Robot};

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
}

impl<'a> Dynamics<'a> {
    /// Returns the dynamics of the bodies that count, with gravity [`GRAVITY`] along -z of the base.
    pub fn new(robot: &'a Robot, bodies: Bodies) -> Self {
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
        Self { robot, massive, gravity: Vector3::new(0.0, 0.0, -GRAVITY), opening: 0.0 }
    }

    /// Adds a body that is fixed to the tip; `payload` is given in the tip's frame.
    #[must_use]
    pub fn with_payload(mut self, payload: Inertial) -> Self {
        self.massive.push((self.robot.tip, payload));
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
        self
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
    /// Source: recursive Newton-Euler, Featherstone §5.3, table 5.1, all in base coordinates.
    pub fn inverse(&self, q: &[f64], dq: &[f64], ddq: &[f64]) -> Result<DVector<f64>, Error> {
        for values in [q, dq, ddq] {
            self.robot.check(values)?;
        }
        let (poses, axes) = self.place(q);
        let n = self.robot.links.len();
        let mut twist = vec![Vector6::zeros(); n];
        // The base accelerates upwards in place of gravity pulling every body down.
        let mut acc = vec![Vector6::zeros(); n];
        acc[0].fixed_rows_mut::<3>(3).copy_from(&-self.gravity);
        for (at, link) in self.robot.links.iter().enumerate().skip(1) {
            let parent = link.parent.expect("only the root has no parent");
            (twist[at], acc[at]) = (twist[parent], acc[parent]);
            if let Drive::Joint { index, multiplier, .. } = link.joint.drive {
                let s = axes[at] * multiplier;
                twist[at] += s * dq[index];
                acc[at] += s * ddq[index] + cross_motion(&twist[at], &(s * dq[index]));
            }
        }
        let mut wrench = vec![Vector6::zeros(); n];
        for (at, inertial) in &self.massive {
            let inertia = spatial_inertia(inertial, &poses[*at]);
            wrench[*at] += inertia * acc[*at] + cross_force(&twist[*at], &(inertia * twist[*at]));
        }
        let mut tau = DVector::zeros(self.robot.n_joints());
        for (at, link) in self.robot.links.iter().enumerate().skip(1).rev() {
            if let Drive::Joint { index, multiplier, .. } = link.joint.drive {
                tau[index] += multiplier * axes[at].dot(&wrench[at]);
            }
            let parent = link.parent.expect("only the root has no parent");
            let outer = wrench[at];
            wrench[parent] += outer;
        }
        Ok(tau)
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
        let (poses, axes) = self.place(q);
        let links = &self.robot.links;
        let mut composite = vec![Matrix6::zeros(); links.len()];
        for (at, inertial) in &self.massive {
            composite[*at] += spatial_inertia(inertial, &poses[*at]);
        }
        for at in (1..links.len()).rev() {
            let parent = links[at].parent.expect("only the root has no parent");
            let outer = composite[at];
            composite[parent] += outer;
        }
        let n = self.robot.n_joints();
        let mut mass = DMatrix::zeros(n, n);
        for at in 1..links.len() {
            let Drive::Joint { index, multiplier, .. } = links[at].joint.drive else { continue };
            let force = composite[at] * axes[at] * multiplier;
            mass[(index, index)] += multiplier * axes[at].dot(&force);
            let mut above = links[at].parent;
            while let Some(link) = above {
                if let Drive::Joint { index: other, multiplier, .. } = links[link].joint.drive {
                    let coupling = multiplier * axes[link].dot(&force);
                    mass[(index, other)] += coupling;
                    mass[(other, index)] += coupling;
                }
                above = links[link].parent;
            }
        }
        Ok(mass)
    }

    /// Returns the accelerations, rad/s², that torques `tau` (N·m) give.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`], [`Error::NotFinite`], or [`Error::Urdf`] when some joint carries no mass.
    pub fn forward(&self, q: &[f64], dq: &[f64], tau: &[f64]) -> Result<DVector<f64>, Error> {
        self.robot.check(tau)?;
        let rest = DVector::from_column_slice(tau) - self.bias(q, dq)?;
        let massless = Error::Urdf { what: UrdfFault::Massless };
        let factor = self.mass_matrix(q)?.cholesky().ok_or(massless)?;
        Ok(factor.solve(&rest))
    }

    /// Returns every link's pose, and every joint's axis as a unit twist about the base origin.
    fn place(&self, q: &[f64]) -> (Vec<Isometry3<f64>>, Vec<Vector6<f64>>) {
        let mut poses = Vec::with_capacity(self.robot.links.len());
        link_poses_into(self.robot, q, self.opening, &mut poses);
        let axes = self
            .robot
            .links
            .iter()
            .zip(&poses)
            .map(|(link, pose)| {
                let axis = pose.rotation * link.joint.axis.into_inner();
                match link.joint.motion {
                    Motion::Fixed => Vector6::zeros(),
                    Motion::Turn => stack(axis, pose.translation.vector.cross(&axis)),
                    Motion::Slide => stack(Vector3::zeros(), axis),
                }
            })
            .collect();
        (poses, axes)
    }
}

fn stack(angular: Vector3<f64>, linear: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
}

fn split(v: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::new(v[0], v[1], v[2]), Vector3::new(v[3], v[4], v[5]))
}

/// `v × m` for a motion, Featherstone (2.31).
fn cross_motion(v: &Vector6<f64>, m: &Vector6<f64>) -> Vector6<f64> {
    let ((omega, linear), (m_omega, m_linear)) = (split(v), split(m));
    stack(omega.cross(&m_omega), omega.cross(&m_linear) + linear.cross(&m_omega))
}

/// `v ×* f` for a force, Featherstone (2.32).
fn cross_force(v: &Vector6<f64>, f: &Vector6<f64>) -> Vector6<f64> {
    let ((omega, linear), (moment, force)) = (split(v), split(f));
    stack(omega.cross(&moment) + linear.cross(&force), omega.cross(&force))
}

/// Returns a body's inertia about the base origin, Featherstone (2.63).
fn spatial_inertia(inertial: &Inertial, base_from_link: &Isometry3<f64>) -> Matrix6<f64> {
    let turn = base_from_link.rotation.to_rotation_matrix();
    let about_com = turn.matrix() * inertial.inertia * turn.matrix().transpose();
    let c = (base_from_link * nalgebra::Point3::from(inertial.com)).coords;
    let cx = c.cross_matrix();
    let m = inertial.mass;
    let mut spatial = Matrix6::zeros();
    spatial.fixed_view_mut::<3, 3>(0, 0).copy_from(&(about_com - m * cx * cx));
    spatial.fixed_view_mut::<3, 3>(0, 3).copy_from(&(m * cx));
    spatial.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-m * cx));
    spatial.fixed_view_mut::<3, 3>(3, 3).copy_from(&(m * Matrix3::identity()));
    spatial
}
