//! How near the tip can come to a pose that it cannot take.
//!
//! The orientation is kept and the position given way, inside the joint limits: a damped least-squares descent from
//! a few starts. Where the arm has a closed form, these are its solutions for the pose moved to where its links
//! reach, brought into the limits: they lie in the right valley already. Where no start ends in the orientation, the arm
//! cannot turn so: from where each ended the position is kept then, and the orientation gives way.
//!
//! Source: Levenberg-Marquardt; Nocedal and Wright, *Numerical Optimization*, 2006, §10.3.

use rand::SeedableRng;
use rand::rngs::StdRng;

use super::cholesky;
use super::closed_form::ClosedForm;
use super::descent::random_configuration;
use super::frames::Frame;
use super::ik::wrap;
use super::kinematics::frame_error;
use super::normal;
use super::robot::Robot;

/// The orientation weighs so much more that it gives way by less than a thousandth of a radian.
const TURN_WEIGHT: f64 = 30.0;
/// That thousandth, rad: where the position is had, and pulls at nothing, what is off by more lacks the orientation.
const KEPT: f64 = 1e-3;
/// The orientation weighs so much less that a turn by half a circle takes the position along by a hundredth of a millimetre.
const LOOSE_WEIGHT: f64 = 1e-3;
/// What is off by more lacks the orientation wherever it is, rad: a position that is metres off pulls at it.
const TURNED: f64 = 0.02;
/// What is off by less has the position, m: half of the millimetre that distances are rounded to.
const THERE: f64 = 5e-4;
/// Starts when nothing is known of the arm.
const BLIND: usize = 24;
/// Starts from a closed form, besides the position at hand.
const GUIDED: usize = 3;
/// Values of joint 3 these are chosen from.
const SWEEP: u32 = 12;

/// The nearest that the tip comes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearest {
    /// How far from the wanted position, m; 0 where it has that and lacks the orientation alone.
    pub(super) distance: f64,
    /// Whether it has the wanted orientation then.
    pub(super) is_turned: bool,
}

/// Returns how near the tip comes with the wanted orientation, or where it cannot be had without: the least over several
/// starts.
pub(super) fn nearest(
    robot: &Robot,
    form: Option<&ClosedForm>,
    target: &Frame,
    near: &[f64],
    seed: u64,
) -> Nearest {
    let mut starts = vec![near.to_vec()];
    if let Some(form) = form {
        starts.extend(guided(robot, form, target, near));
    }
    if starts.len() == 1 {
        let mut random = StdRng::seed_from_u64(seed);
        starts.extend((1..BLIND).map(|_| random_configuration(robot, &mut random)));
    }
    let mut least = f64::INFINITY;
    for q in &mut starts {
        let (distance, turn) = approach(robot, target, q, TURN_WEIGHT);
        if turn > TURNED {
            continue;
        }
        if distance < THERE && turn > KEPT {
            return Nearest { distance: 0.0, is_turned: false };
        }
        least = least.min(distance);
    }
    if least.is_finite() {
        return Nearest { distance: least, is_turned: true };
    }
    for q in &mut starts {
        let (distance, _) = approach(robot, target, q, LOOSE_WEIGHT);
        if distance < THERE {
            return Nearest { distance: 0.0, is_turned: false };
        }
        least = least.min(distance);
    }
    Nearest { distance: least, is_turned: false }
}

/// Positions of the joints inside the limits from which the tip is near the target, by the closed form.
fn guided(robot: &Robot, form: &ClosedForm, target: &Frame, near: &[f64]) -> Vec<Vec<f64>> {
    let reachable = form.wanted(&form.within_reach(target), near);
    // Those least outside, in order.
    let mut found = [(f64::INFINITY, [0.0; 7]); GUIDED];
    for k in 0..SWEEP {
        let q3 = near[2] + std::f64::consts::TAU * f64::from(k) / f64::from(SWEEP);
        for mut q in form.branches(robot, &reachable, q3, None).branches.into_iter().flatten() {
            let mut outside = 0.0;
            for (x, joint) in q.iter_mut().zip(robot.joints()) {
                let free = if joint.continuous { *x } else { wrap(*x) };
                *x = free.clamp(joint.lower, joint.upper);
                outside += (free - *x).abs();
            }
            if let Some(at) = found.iter().position(|other| outside < other.0) {
                found[at..].rotate_right(1);
                found[at] = (outside, q);
            }
        }
    }
    found.iter().filter(|(outside, _)| outside.is_finite()).map(|(_, q)| q.to_vec()).collect()
}

/// Goes as near to the target as the limits allow, a radian of its orientation as far off as `weight` m of its position; returns
/// how far the position is off, m, and the orientation, rad.
fn approach(robot: &Robot, target: &Frame, q: &mut [f64], weight: f64) -> (f64, f64) {
    let n = q.len();
    let (mut jacobian, mut beside) = (vec![0.0; 6 * n], vec![0.0; 6 * n]);
    let (mut normal, mut step, mut tried) = (vec![0.0; n * n], vec![0.0; n], vec![0.0; n]);
    let (mut plain, mut pull) = (normal.clone(), step.clone());
    let mut damping = 1e-2;
    let look = |q: &[f64], jacobian: &mut [f64]| {
        let mut error = frame_error(&robot.jacobian_into(q, jacobian), target);
        for six in jacobian.chunks_exact_mut(6).chain([error.as_mut_slice()]) {
            for x in &mut six[3..] {
                *x *= weight;
            }
        }
        error
    };
    let mut error = look(q, &mut jacobian);
    let mut squared = error.norm_squared();
    normal::equations(&jacobian, error.as_slice(), &mut plain, &mut pull);
    for _ in 0..200 {
        normal.copy_from_slice(&plain);
        step.copy_from_slice(&pull);
        // A joint at a limit that the step would push further is held.
        for i in 0..n {
            let limits = &robot.joints()[i];
            let held =
                (q[i] <= limits.lower && step[i] < 0.0) || (q[i] >= limits.upper && step[i] > 0.0);
            if held {
                for j in 0..n {
                    normal[i.min(j) * n + i.max(j)] = 0.0;
                }
                normal[i * n + i] = 1e12;
            }
            normal[i * n + i] += damping;
        }
        if !cholesky::solve(&mut normal, &mut step) {
            break;
        }
        for (i, joint) in robot.joints().iter().enumerate() {
            tried[i] = (q[i] + step[i]).clamp(joint.lower, joint.upper);
        }
        let next = look(&tried, &mut beside);
        let less = next.norm_squared();
        if less < squared {
            let before = std::mem::replace(&mut squared, less);
            q.copy_from_slice(&tried);
            std::mem::swap(&mut jacobian, &mut beside);
            error = next;
            damping = (damping * 0.3).max(1e-9);
            // What is left to gain is far below a millimetre.
            if before - less < 1e-14 + 1e-5 * before {
                break;
            }
            normal::equations(&jacobian, error.as_slice(), &mut plain, &mut pull);
        } else {
            damping *= 5.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    let e = frame_error(&robot.tip_frame(q), target);
    (e.fixed_rows::<3>(0).norm(), e.fixed_rows::<3>(3).norm())
}
