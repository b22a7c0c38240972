//! How fast a curve can be run through: the profile of speeds along it that the limits of joints allow.
//!
//! Speeds and accelerations are kept here at every knot, of the jerk only what the bends of the curve ask for: the rest
//! is [`super::timing`]'s.
//!
//! Source: reachability analysis: Pham and Pham, "A new approach to time-optimal path parameterization
//! based on reachability analysis", T-RO 2018, its two-variable programs solved in closed form.

use super::curve::{At, Curve};
use super::robot::Robot;

/// An acceleration goes from none to its limit in this time, s, where no jerk limit is known. Chosen: no jerk limit of the
/// Gen3 is published; at its accelerations this means 99 to 172 rad/s³. With twice as much a hand turns back too late to end a
/// pour: 35 mL for 30.
const TIME_TO_FULL_ACCELERATION: f64 = 0.05;

/// Limits of a motion, one entry per joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Highest speeds, rad/s.
    pub velocity: Vec<f64>,
    /// Highest accelerations, rad/s².
    pub acceleration: Vec<f64>,
    /// Highest jerks, rad/s³.
    pub jerk: Vec<f64>,
}

impl Limits {
    /// Returns limits of speed (rad/s) and acceleration (rad/s²), the acceleration reached from none in 0.05 s.
    pub fn new(velocity: Vec<f64>, acceleration: Vec<f64>) -> Self {
        let jerk = acceleration.iter().map(|a| a / TIME_TO_FULL_ACCELERATION).collect();
        Self { velocity, acceleration, jerk }
    }

    /// Returns the robot's own limits.
    pub fn of(robot: &Robot) -> Self {
        let joints = robot.joints();
        let mut limits = Self::new(
            joints.iter().map(|joint| joint.velocity).collect(),
            joints.iter().map(|joint| joint.acceleration).collect(),
        );
        for (limit, joint) in limits.jerk.iter_mut().zip(joints) {
            *limit = joint.jerk.unwrap_or(*limit);
        }
        limits
    }

    /// Returns the limits with speeds times `speed`, accelerations and jerks times `acceleration`.
    #[must_use]
    pub fn scaled(&self, speed: f64, acceleration: f64) -> Self {
        let times = |list: &[f64], factor: f64| list.iter().map(|x| x * factor).collect();
        Self {
            velocity: times(&self.velocity, speed),
            acceleration: times(&self.acceleration, acceleration),
            jerk: times(&self.jerk, acceleration),
        }
    }
}

/// `s(t)` with constant acceleration between knots.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Profile {
    /// When each knot is passed, s.
    t: Vec<f64>,
    s: Vec<f64>,
    v: Vec<f64>,
    /// The rate of `v` from each knot on; none after the last.
    a: Vec<f64>,
    /// The integral of `s` up to each knot.
    sum: Vec<f64>,
}

impl Profile {
    /// Returns the integral of `s`, `s`, its rate and the rate of that at `t`; before and after it rests at the ends.
    pub(super) fn at(&self, t: f64) -> [f64; 4] {
        self.after(self.t.partition_point(|knot| *knot <= t), t)
    }

    /// As [`Self::at`], where `passed` knots are passed by then.
    pub(super) fn after(&self, passed: usize, t: f64) -> [f64; 4] {
        let Some(k) = passed.checked_sub(1) else { return [0.0; 4] };
        let tau = t - self.t[k];
        let (s, v, a) = (self.s[k], self.v[k], self.a[k]);
        [
            self.sum[k] + tau * (s + tau * (v / 2.0 + tau * a / 6.0)),
            s + tau * (v + tau * a / 2.0),
            v + tau * a,
            a,
        ]
    }

    pub(super) fn duration(&self) -> f64 {
        *self.t.last().expect("a profile has knots")
    }

    /// Returns when each knot is passed, s.
    pub(super) fn times(&self) -> &[f64] {
        &self.t
    }
}

/// A curve at knots along it, as its timing sees it. Lists by joint hold one knot after the other.
pub(super) struct Shape {
    s: Vec<f64>,
    joints: usize,
    dq: Vec<f64>,
    ddq: Vec<f64>,
    /// The largest square of the speed along the curve that speeds and jerks of joints allow at each knot.
    most: Vec<f64>,
}

impl Shape {
    pub(super) fn of(curve: &Curve, limits: &Limits) -> Self {
        let s = grid(curve);
        let joints = limits.velocity.len();
        let mut shape = Self {
            dq: Vec::with_capacity(s.len() * joints),
            ddq: Vec::with_capacity(s.len() * joints),
            most: Vec::with_capacity(s.len()),
            joints,
            s: Vec::new(),
        };
        let mut at = At::new(joints);
        for &s in &s {
            let piece = curve.piece_at(s);
            let mut most = f64::INFINITY;
            if piece > 0 && curve.knots()[piece] >= s {
                curve.slopes(piece - 1, s, &mut at);
                most = bend_allows(&at, limits);
            }
            curve.slopes(piece, s, &mut at);
            most = most.min(bend_allows(&at, limits));
            shape.dq.extend_from_slice(&at.dq);
            shape.ddq.extend_from_slice(&at.ddq);
            shape.most.push(most);
        }
        shape.s = s;
        shape
    }

    /// Returns how many knots there are.
    pub(super) fn len(&self) -> usize {
        self.s.len()
    }

    /// Returns the first and second derivatives at a knot, joint by joint.
    fn at(&self, knot: usize) -> impl Iterator<Item = (f64, f64)> + '_ {
        let here = knot * self.joints..(knot + 1) * self.joints;
        self.dq[here.clone()].iter().copied().zip(self.ddq[here].iter().copied())
    }
}

/// Returns the largest square of the speed along a curve at which the speed of each joint, and the jerk that the bend of
/// the curve alone asks for, keep their limits.
fn bend_allows(at: &At, limits: &Limits) -> f64 {
    let (mut most, mut jerks) = (f64::INFINITY, 0.0_f64);
    for i in 0..at.dq.len() {
        let (d, dd, ddd) = (at.dq[i].abs(), at.ddq[i].abs(), at.dddq[i].abs());
        if d > LEAST {
            most = most.min((limits.velocity[i] / d).powi(2));
        } else if dd > LEAST {
            most = most.min(limits.acceleration[i] / dd);
        }
        jerks = jerks.max(ddd / limits.jerk[i]);
    }
    if jerks > 0.0 { most.min(jerks.cbrt().powi(-2)) } else { most }
}

/// Derivatives by the length of a curve below this are none: no limit comes near through them.
const LEAST: f64 = 1e-12;

/// The fastest profile of speeds along a curve, from rest to rest, `pace` times as fast at each knot as the limits allow.
///
/// With `x = ṡ²` and `u = s̈`, joint accelerations are `q'u + q''x`: linear. Backwards, the largest `x` at
/// each knot from which the next can be entered; then forwards, as fast as that allows.
pub(super) fn fastest(shape: &Shape, limits: &Limits, pace: &[f64]) -> Profile {
    let n = shape.len();
    let step = |i: usize| shape.s[i + 1] - shape.s[i];
    let mut top = vec![0.0; n];
    for i in (0..n - 1).rev() {
        top[i] = highest(shape, i, limits, pace[i] * pace[i], (top[i + 1], step(i)));
    }
    top[0] = 0.0;
    let none = || vec![0.0; n];
    let mut profile = Profile { t: none(), s: shape.s.clone(), v: none(), a: none(), sum: none() };
    let mut x = 0.0;
    for i in 0..n - 1 {
        let push = hardest_push(shape, i, limits, pace[i] * pace[i], x);
        x = (x + 2.0 * step(i) * push).clamp(0.0, top[i + 1]);
        let (v, next) = (profile.v[i], f64::sqrt(x));
        let h = 2.0 * step(i) / (v + next).max(1e-9);
        let a = (next - v) / h;
        profile.a[i] = a;
        profile.v[i + 1] = next;
        profile.t[i + 1] = profile.t[i] + h;
        profile.sum[i + 1] = profile.sum[i] + h * (shape.s[i] + h * (v / 2.0 + h * a / 6.0));
    }
    profile
}

/// Length between two knots on a straight and on a bent stretch, rad. Chosen on random paths of three to nine corners: with
/// half of it on bends motions are 0.5 to 2 % shorter and take up to half again as long to time; on straight stretches
/// half of it gains 0.2 %.
const BETWEEN: [f64; 2] = [0.1, 0.02];

/// Knots along the curve: fine enough that its shape hardly changes between two, finer towards the ends,
/// where the arm is slow and each knot takes long.
fn grid(curve: &Curve) -> Vec<f64> {
    let length = curve.length();
    let mut grid = Vec::new();
    // A curve of one stretch has as many knots as one of many has at least, in all.
    let least = (64.0 / (curve.knots().len() - 1) as f64).clamp(2.0, 16.0);
    for (k, piece) in curve.knots().windows(2).enumerate() {
        let size = piece[1] - piece[0];
        let between = BETWEEN[usize::from(!curve.is_straight(k))];
        let parts = (size / between).ceil().clamp(least.ceil(), 200.0) as usize;
        grid.extend((0..parts).map(|k| piece[0] + size * k as f64 / parts as f64));
    }
    grid.push(length);
    let near = [1e-5, 1e-4, 4e-4, 1e-3, 2e-3, 4e-3, 7e-3];
    grid.extend(near.iter().map(|share| share * length));
    grid.extend(near.iter().map(|share| length - share * length));
    grid.sort_unstable_by(f64::total_cmp);
    grid.dedup_by(|b, a| *b - *a < 1e-7 * length);
    if let Some(last) = grid.last_mut() {
        *last = length;
    }
    grid
}

/// The largest `x` at a knot for which some `u` keeps the limits times `pace` and leads to at most `next.0` after `next.1`.
///
/// Each limit of an acceleration bounds `u` from below and from above by a line over `x`: the room between the highest
/// of the lower ones and the lowest of the upper ones shrinks the faster the larger `x`, so that Newton's steps from the
/// largest `x` meet the last one with room from above.
fn highest(shape: &Shape, knot: usize, limits: &Limits, pace: f64, next: (f64, f64)) -> f64 {
    let mut x = shape.most[knot] * pace;
    // As many steps as there are pairs of lines that could bind.
    for _ in 0..2 * limits.acceleration.len() + 2 {
        let mut lower = (f64::NEG_INFINITY, 0.0, 0.0);
        let last = (next.0 / (2.0 * next.1), -1.0 / (2.0 * next.1));
        let mut upper = (last.0 + last.1 * x, last.0, last.1);
        for ((d, dd), a) in shape.at(knot).zip(&limits.acceleration) {
            if d.abs() <= LEAST {
                continue;
            }
            let (reach, slope) = (pace * a / d.abs(), -dd / d);
            if slope * x - reach > lower.0 {
                lower = (slope * x - reach, -reach, slope);
            }
            if slope * x + reach < upper.0 {
                upper = (slope * x + reach, reach, slope);
            }
        }
        if upper.0 >= lower.0 {
            break;
        }
        let steeper = lower.2 - upper.2;
        if steeper <= 1e-15 {
            return 0.0;
        }
        x = ((upper.1 - lower.1) / steeper).clamp(0.0, x * (1.0 - f64::EPSILON));
    }
    x
}

/// The largest `u` at a knot that keeps the acceleration limits times `pace` at `x`.
fn hardest_push(shape: &Shape, knot: usize, limits: &Limits, pace: f64, x: f64) -> f64 {
    shape
        .at(knot)
        .zip(&limits.acceleration)
        .filter(|((d, _), _)| d.abs() > LEAST)
        .map(|((d, dd), a)| pace * a / d.abs() - dd / d * x)
        .fold(f64::INFINITY, f64::min)
}
