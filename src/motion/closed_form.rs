//! The closed form of the Gen3's inverse kinematics, with joint 3 as the redundancy.
//!
//! The arm is not an SRS arm: neighbouring axes meet at right angles, but no three meet in a point. With
//! joint 3 fixed the wrist centre, where axes 5 and 6 meet, still has a closed form; the wrist's small
//! offset along axis 6 is iterated out and the rest polished by Newton's method.
//!
//! With the arm at zero let axis i be `a_i`, and let axes i and i+1 meet at `P_i`. Write `E_i` for the
//! turn by `q_i` about `a_i`. Seen from `P_1`, the wrist centre is `E1 E2 v` with
//! `v = d2 + l1 + E3 (d4 + E4 l2)`, where `d2 ∥ a2`, `l1 ∥ a3`, `d4 ∥ a4`, `l2 ∥ a5` lead from one meeting
//! point to the next. Its length gives `q4`, its height `q2`, its bearing `q1`; the rotation that is left
//! gives `q5`, `q6`, `q7`. Two roots each for `q4`, `q2` and `q6` make eight branches.
//!
//! Source: derived here from the joint origins; the sub-problems are those of Paden and Kahan (Murray,
//! Li and Sastry, *A Mathematical Introduction to Robotic Manipulation*, 1994, §3.2).

use nalgebra::{Isometry3, Matrix6xX, SMatrix, UnitQuaternion, Vector3};

use super::kinematics::pose_error;
use super::robot::{Drive, Motion, Robot};

/// How far, m, neighbouring axes may miss each other and still count as meeting: link files print six
/// digits or more, and the polish takes up the rest.
const MEET: f64 = 2e-5;
/// How far, as a cosine, neighbouring axes may be from a right angle.
const SQUARE: f64 = 1e-4;
/// A solution is exact when position (m) and rotation (rad) are off by less.
const EXACT: f64 = 1e-11;

/// The geometry the closed form needs, with all joints at zero, in base coordinates.
#[derive(Debug, Clone)]
pub struct ClosedForm {
    axes: [Vector3<f64>; 7],
    /// Where axes 1 and 2 meet.
    shoulder: Vector3<f64>,
    d2_l1: Vector3<f64>,
    d4: Vector3<f64>,
    l2: Vector3<f64>,
    d6: Vector3<f64>,
    /// From where axes 6 and 7 meet to the tip.
    hand: Vector3<f64>,
    tip_rotation: UnitQuaternion<f64>,
}

impl ClosedForm {
    /// Returns the closed form if the robot has the right geometry: seven turning joints whose
    /// neighbouring axes meet at right angles.
    pub fn of(robot: &Robot) -> Option<Self> {
        if robot.n_joints() != 7 {
            return None;
        }
        let mut axes = [Vector3::zeros(); 7];
        let mut points = [Vector3::zeros(); 7];
        let mut pose = Isometry3::identity();
        for &link in &robot.path {
            let joint = &robot.links[link].joint;
            pose *= joint.parent_from_link(joint.value(&[0.0; 7], 0.0));
            match joint.drive {
                Drive::None => {}
                Drive::Joint { index, multiplier, offset }
                    if joint.motion == Motion::Turn
                        && (multiplier - 1.0).abs() < f64::EPSILON
                        && offset.abs() < f64::EPSILON =>
                {
                    axes[index] = pose.rotation * joint.axis.into_inner();
                    points[index] = pose.translation.vector;
                }
                _ => return None,
            }
        }
        let mut meet = [Vector3::zeros(); 6];
        for i in 0..6 {
            if axes[i].dot(&axes[i + 1]).abs() > SQUARE {
                return None;
            }
            let normal = axes[i].cross(&axes[i + 1]);
            let between = points[i + 1] - points[i];
            if between.dot(&normal).abs() > MEET {
                return None;
            }
            meet[i] = points[i] + axes[i] * between.dot(&axes[i]);
        }
        let (l1, l2) = (meet[2] - meet[1], meet[4] - meet[3]);
        // Without an upper arm and a forearm there is no triangle to solve; the wrist offset must be
        // small for its iteration to converge.
        let d6 = meet[5] - meet[4];
        if l2.norm() < 0.01 || l1.norm() < 0.01 || d6.norm() > 0.05 * l2.norm() {
            return None;
        }
        Some(Self {
            axes,
            shoulder: meet[0],
            d2_l1: meet[2] - meet[0],
            d4: meet[3] - meet[2],
            l2,
            d6,
            hand: pose.translation.vector - meet[5],
            tip_rotation: pose.rotation,
        })
    }

    /// Appends every solution for the tip at `target` with joint 3 at `q3`, up to eight; joint limits
    /// are not looked at. Where a joint is free (a singular pose) it takes its value from `near`.
    pub fn solve(
        &self,
        robot: &Robot,
        target: &Isometry3<f64>,
        q3: f64,
        near: &[f64],
        found: &mut Vec<[f64; 7]>,
    ) {
        let turn = target.rotation * self.tip_rotation.inverse();
        let wrist_end = target.translation.vector - turn * self.hand;
        let mut jacobian = Matrix6xX::zeros(7);
        for branch in 0..8_u8 {
            // The first pass leaves the wrist offset out, the later ones know joint 7 from the one before.
            let mut wrist = wrist_end;
            let mut q = None;
            for _ in 0..3 {
                q = self.pass(&(wrist - self.shoulder), &turn, q3, branch, near);
                let Some(q) = q else { break };
                wrist = wrist_end - turn * (about(&self.axes[6], -q[6]) * self.d6);
            }
            let Some(mut q) = q else { continue };
            if polish(robot, target, &mut q, &mut jacobian)
                && !found.iter().any(|other| same(other, &q))
            {
                found.push(q);
            }
        }
    }

    /// Solves for one branch with the wrist centre at `w` as seen from the shoulder.
    fn pass(
        &self,
        w: &Vector3<f64>,
        turn: &UnitQuaternion<f64>,
        q3: f64,
        branch: u8,
        near: &[f64],
    ) -> Option<[f64; 7]> {
        let [a1, a2, a3, a4, a5, a6, a7] = &self.axes;
        let sign = |bit: u8| if branch & (1 << bit) == 0 { 1.0 } else { -1.0 };
        let e3 = about(a3, q3);
        // |w|² = |v|² in q4: A cos q4 + B sin q4 = C.
        let back = e3.inverse() * self.d2_l1;
        let fixed = self.d2_l1.norm_squared()
            + self.d4.norm_squared()
            + self.l2.norm_squared()
            + 2.0 * back.dot(&self.d4);
        let q4 = root(
            2.0 * back.dot(&self.l2),
            2.0 * back.dot(&a4.cross(&self.l2)),
            w.norm_squared() - fixed,
            sign(0),
            near[3],
        )?;
        let e4 = about(a4, q4);
        let v = self.d2_l1 + e3 * (self.d4 + e4 * self.l2);
        // Height over the shoulder: a1 · E2 v = a1 · w; axis 1 is square to axis 2.
        let q2 = root(a1.dot(&v), a1.dot(&a2.cross(&v)), a1.dot(w), sign(1), near[1])?;
        let e2 = about(a2, q2);
        let q1 = bearing(a1, &(e2 * v), w).unwrap_or(near[0]);
        // What rotation is left for the wrist: E5 E6 E7 = Q.
        let left = (about(a1, q1) * e2 * e3 * e4).inverse() * turn;
        let q6 = root(a5.dot(a7), a5.dot(&a6.cross(a7)), a5.dot(&(left * a7)), sign(2), near[5])?;
        let e6 = about(a6, q6);
        let q5 = bearing(a5, &(e6 * a7), &(left * a7)).unwrap_or(near[4]);
        let last = (about(a5, q5) * e6).inverse() * left;
        let q7 = bearing(a7, a6, &(last * a6)).unwrap_or(near[6]);
        Some([q1, q2, q3, q4, q5, q6, q7])
    }
}

/// The turn by `angle` about a unit `axis`.
fn about(axis: &Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    let (sin, cos) = (0.5 * angle).sin_cos();
    let a = axis * sin;
    UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(cos, a.x, a.y, a.z))
}

/// Returns the root of `a cos x + b sin x = c` that `sign` picks, `free` when any `x` will do, `None`
/// when none does.
fn root(a: f64, b: f64, c: f64, sign: f64, free: f64) -> Option<f64> {
    // A stretched arm: rounding, or the wrist offset that the first pass leaves out, may put the target
    // this much (relative) out of reach; the polish then decides.
    const SLACK: f64 = 1e-3;
    let size = a.hypot(b);
    if size < 1e-12 {
        return (c.abs() < 1e-9).then_some(free);
    }
    let ratio = c / size;
    if ratio.abs() > 1.0 + SLACK {
        return None;
    }
    Some(b.atan2(a) + sign * ratio.clamp(-1.0, 1.0).acos())
}

/// Returns the angle about unit `axis` that turns `from` towards `to`, `None` if either lies along it.
fn bearing(axis: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> Option<f64> {
    let flat = |v: &Vector3<f64>| v - axis * axis.dot(v);
    let (from, to) = (flat(from), flat(to));
    if from.norm() < 1e-9 || to.norm() < 1e-9 {
        return None;
    }
    Some(axis.dot(&from.cross(&to)).atan2(from.dot(&to)))
}

/// Newton's method with joint 3 held; returns whether the result is exact.
fn polish(
    robot: &Robot,
    target: &Isometry3<f64>,
    q: &mut [f64; 7],
    jacobian: &mut Matrix6xX<f64>,
) -> bool {
    const OTHERS: [usize; 6] = [0, 1, 3, 4, 5, 6];
    for _ in 0..8 {
        let tip = robot.jacobian_into(q, jacobian);
        let error = pose_error(&tip, target);
        if error.amax() < EXACT {
            return true;
        }
        let square = SMatrix::<f64, 6, 6>::from_fn(|i, j| jacobian[(i, OTHERS[j])]);
        // Beside a singular pose the plain step may be wild; the damping is far below any other effect.
        let normal = square.transpose() * square;
        let damping = 1e-3 * error.norm_squared() + 1e-18;
        let step = square.lu().solve(&error).filter(|step| step.amax() < 0.2).or_else(|| {
            let damped = normal + SMatrix::<f64, 6, 6>::identity() * damping;
            damped.cholesky().map(|factor| factor.solve(&(square.transpose() * error)))
        });
        let Some(step) = step else { return false };
        for (k, &i) in OTHERS.iter().enumerate() {
            q[i] += step[k];
        }
    }
    pose_error(&robot.forward_unchecked(q), target).amax() < 1e-9
}

/// Whether two solutions are the same up to whole turns.
fn same(a: &[f64; 7], b: &[f64; 7]) -> bool {
    let turn = std::f64::consts::TAU;
    a.iter().zip(b).all(|(a, b)| ((a - b) - ((a - b) / turn).round() * turn).abs() < 1e-7)
}
