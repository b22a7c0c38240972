//! Forward kinematics and the geometric Jacobian.
//!
//! `Base` stands for the robot's root link, `Flange` for its tip link, whatever they are called; for
//! the stdlib Gen3 these are `base_link` and `end_effector_link`.
//!
//! Source: Siciliano et al., *Robotics*, 2009, §2.8 and §3.1.3.

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use nalgebra::{Isometry3, Matrix6xX, Translation3, UnitQuaternion, Vector3, Vector6};

use super::error::Error;
use super::frames::Frame;
use super::knuckle;
use super::lanes::{Job, Wide, run};
use super::quad::Quad;
use super::robot::{Drive, Joint, Motion, Robot};
use crate::world::frame::{Base, Flange, Pose, Tool};

impl Joint {
    /// Returns the joint's value, rad or m, for one entry of `q` per joint of the robot and a gripper
    /// opening in m.
    pub fn value(&self, q: &[f64], opening: f64) -> f64 {
        match self.drive {
            Drive::None => 0.0,
            Drive::Joint { index, multiplier, offset } => multiplier * q[index] + offset,
            Drive::Jaw { multiplier, offset } => {
                (multiplier * opening + offset).clamp(self.range.0, self.range.1)
            }
            Drive::Knuckle { angle, multiplier, offset } => {
                let value = multiplier * knuckle::value(&angle, opening) + offset;
                value.clamp(self.range.0, self.range.1)
            }
        }
    }

    /// Carries points of the link into its parent when the joint is at `value`, rad or m.
    pub fn parent_from_link(&self, value: f64) -> Isometry3<f64> {
        match self.motion {
            Motion::Fixed => self.parent_from_link,
            Motion::Turn => {
                let (sin, cos) = (0.5 * value).sin_cos();
                let a = self.axis.into_inner() * sin;
                // A unit quaternion by construction; normalising would cost a root per joint.
                let turn =
                    UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(cos, a.x, a.y, a.z));
                Isometry3::from_parts(
                    self.parent_from_link.translation,
                    self.parent_from_link.rotation * turn,
                )
            }
            Motion::Slide => {
                self.parent_from_link * Translation3::from(self.axis.into_inner() * value)
            }
        }
    }
}

/// Writes the pose of every link into `base_from_link`, in the order of [`Robot::links`].
///
/// `q` in rad (m for sliding joints), `opening` the gap between the jaws in m. The lengths are the
/// caller's to keep: this is the inner loop of planning.
pub(super) fn link_poses_into(
    robot: &Robot,
    q: &[f64],
    opening: f64,
    base_from_link: &mut Vec<Isometry3<f64>>,
) {
    base_from_link.clear();
    for link in &robot.links {
        let Some(parent) = link.parent else {
            base_from_link.push(Isometry3::identity());
            continue;
        };
        let step = link.joint.parent_from_link(link.joint.value(q, opening));
        base_from_link.push(base_from_link[parent] * step);
    }
}

impl Robot {
    /// Returns `base_from_link` for every link, in the order of [`Robot::links`], jaws included.
    ///
    /// `q` in rad, `opening` the gap between the jaws in m.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] or [`Error::NotFinite`].
    pub fn link_poses(&self, q: &[f64], opening: f64) -> Result<Vec<Isometry3<f64>>, Error> {
        self.check(q)?;
        let mut poses = Vec::with_capacity(self.links.len());
        link_poses_into(self, q, opening, &mut poses);
        Ok(poses)
    }

    /// Returns the pose of the tip.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] or [`Error::NotFinite`].
    pub fn forward(&self, q: &[f64]) -> Result<Pose<Base, Flange>, Error> {
        self.check(q)?;
        Ok(Pose::new(self.forward_unchecked(q)))
    }

    /// As [`Self::forward`], for a `q` that is known to fit.
    pub(crate) fn forward_unchecked(&self, q: &[f64]) -> Isometry3<f64> {
        self.tip_frame(q).pose()
    }

    /// Returns where the tip is, for a `q` that is known to fit: the inner loop of planning.
    pub(super) fn tip_frame(&self, q: &[f64]) -> Frame {
        run(Reach { robot: self, q })
    }

    /// Carries points of the tool into the flange; constant, since the tool is rigid. Identity when the
    /// robot names no tool.
    pub fn flange_from_tool(&self) -> Pose<Flange, Tool> {
        self.flange_from_tool
    }

    /// Returns the pose of the tool centre point.
    ///
    /// # Errors
    ///
    /// As [`Self::forward`].
    pub fn forward_tool(&self, q: &[f64]) -> Result<Pose<Base, Tool>, Error> {
        Ok(self.forward(q)? * self.flange_from_tool)
    }

    /// Returns the geometric Jacobian of the tip: `[v; ω] = J(q) q̇`.
    ///
    /// `q` is one value per joint, base first. `J` is 6 × n: rows 0–2 in m/rad, rows 3–5 in rad/rad,
    /// about the tip's origin, in base axes.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] or [`Error::NotFinite`].
    ///
    /// Source: Siciliano et al., *Robotics*, 2009, §3.1.3.
    pub fn jacobian(&self, q: &[f64]) -> Result<Matrix6xX<f64>, Error> {
        self.check(q)?;
        let mut jacobian = Matrix6xX::zeros(self.n_joints());
        self.jacobian_into(q, jacobian.as_mut_slice());
        Ok(jacobian)
    }

    /// Writes the Jacobian into `columns`, six numbers a joint, and returns the tip's frame: one pass.
    pub(super) fn jacobian_into(&self, q: &[f64], columns: &mut [f64]) -> Frame {
        run(Differential { robot: self, q, columns })
    }

    /// Returns the tip's acceleration that comes from `dq` alone, `J̇ q̇`: linear m/s² over angular rad/s².
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] or [`Error::NotFinite`].
    ///
    /// Source: the outward recursion of Siciliano et al., §7.5, with zero joint accelerations.
    pub fn jacobian_rate(&self, q: &[f64], dq: &[f64]) -> Result<Vector6<f64>, Error> {
        self.check(q)?;
        self.check(dq)?;
        let mut pose = Isometry3::<f64>::identity();
        let (mut omega, mut alpha, mut acc) =
            (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
        for &link in &self.path {
            let joint = &self.links[link].joint;
            let before = pose.translation.vector;
            pose *= joint.parent_from_link(joint.value(q, 0.0));
            let arm = pose.translation.vector - before;
            acc += alpha.cross(&arm) + omega.cross(&omega.cross(&arm));
            let Drive::Joint { index, multiplier, .. } = joint.drive else { continue };
            let axis = pose.rotation * joint.axis.into_inner() * (multiplier * dq[index]);
            if joint.motion == Motion::Turn {
                alpha += omega.cross(&axis);
                omega += axis;
            } else {
                acc += 2.0 * omega.cross(&axis);
            }
        }
        Ok(Vector6::new(acc.x, acc.y, acc.z, alpha.x, alpha.y, alpha.z))
    }
}

/// Where the tip is.
struct Reach<'r> {
    robot: &'r Robot,
    q: &'r [f64],
}

impl Job for Reach<'_> {
    type Found = Frame;

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) -> Frame {
        let Self { robot, q } = self;
        robot.way.run(
            simd,
            q,
            &robot.way_end,
            #[inline(always)]
            |_, _, _| {},
        )
    }
}

/// The same and the columns of the Jacobian, six numbers a joint.
struct Differential<'r> {
    robot: &'r Robot,
    q: &'r [f64],
    columns: &'r mut [f64],
}

impl Job for Differential<'_> {
    type Found = Frame;

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) -> Frame {
        let Self { robot, q, columns } = self;
        let (columns, _) = columns.as_chunks_mut::<6>();
        // A joint and its mimics share a column.
        let is_shared = robot.way.nodes.len() > columns.len();
        if is_shared {
            columns.fill([0.0; 6]);
        }
        let tip = robot.way.run(
            simd,
            q,
            &robot.way_end,
            #[inline(always)]
            |node, z, origin| {
                // About the base's origin first: where the tip will be is not known yet.
                let axis = z * Quad::all(simd, node.multiplier);
                let column = &mut columns[node.index];
                let [x, y, z, _] = axis.lanes();
                let new = if node.slides {
                    [x, y, z, 0.0, 0.0, 0.0]
                } else {
                    let [a, b, c, _] = origin.cross(axis).lanes();
                    [a, b, c, x, y, z]
                };
                if is_shared {
                    for (sum, new) in column.iter_mut().zip(new) {
                        *sum += new;
                    }
                } else {
                    *column = new;
                }
            },
        );
        let to = &tip.origin;
        for [a, b, c, x, y, z] in columns {
            *a += *y * to.z - *z * to.y;
            *b += *z * to.x - *x * to.z;
            *c += *x * to.y - *y * to.x;
        }
        tip
    }
}

/// Returns what carries `from` to `to` as position difference (m) over rotation vector (rad), base axes.
pub fn pose_error(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let shift = to.translation.vector - from.translation.vector;
    let turn = (to.rotation * from.rotation.inverse()).scaled_axis();
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// As [`pose_error`], for frames.
pub(super) fn frame_error(from: &Frame, to: &Frame) -> Vector6<f64> {
    let shift = to.origin - from.origin;
    // The columns crossed add up to the axis times twice the sine, their products to 1 + 2 cos.
    let axis = (from.x.cross(&to.x) + from.y.cross(&to.y) + from.z.cross(&to.z)) * 0.5;
    let cos = 0.5 * (from.x.dot(&to.x) + from.y.dot(&to.y) + from.z.dot(&to.z) - 1.0);
    let sin = axis.norm();
    let turn = if cos > 0.0 && sin < 1e-6 {
        axis
    } else if cos > -0.9 {
        axis * (sin.atan2(cos) / sin)
    } else {
        // Near half a turn the axis is lost in this form.
        return pose_error(&from.pose(), &to.pose());
    };
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}
