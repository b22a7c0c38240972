//! How fast a curve can be run through: the profile of speeds along it that the limits of joints allow.
//!
//! Source: reachability analysis: Pham and Pham, "A new approach to time-optimal path parameterization
//! based on reachability analysis", T-RO 2018, its two-variable programs solved in closed form.

use super::curve::{At, Curve};
use super::robot::Robot;

/// Limits of a motion, one entry per joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Highest speeds, rad/s.
    pub velocity: Vec<f64>,
    /// Highest accelerations, rad/s².
    pub acceleration: Vec<f64>,
}

impl Limits {
    /// Returns the robot's own limits.
    pub fn of(robot: &Robot) -> Self {
        Self {
            velocity: robot.joints().iter().map(|joint| joint.velocity).collect(),
            acceleration: robot.joints().iter().map(|joint| joint.acceleration).collect(),
        }
    }

    /// Returns the limits with speeds times `speed` and accelerations times `acceleration`.
    #[must_use]
    pub fn scaled(&self, speed: f64, acceleration: f64) -> Self {
        Self {
            velocity: self.velocity.iter().map(|v| v * speed).collect(),
            acceleration: self.acceleration.iter().map(|a| a * acceleration).collect(),
        }
    }
}

/// `s(t)` with constant acceleration between knots.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Profile {
    t: Vec<f64>,
    s: Vec<f64>,
    v: Vec<f64>,
    /// The integral of `s` up to each knot.
    sum: Vec<f64>,
}

impl Profile {
    /// Returns the integral of `s`, `s` and its rate at `t`; before and after it rests at the ends.
    pub(super) fn at(&self, t: f64) -> [f64; 3] {
        let last = self.t.len() - 1;
        if t <= 0.0 {
            return [0.0, 0.0, 0.0];
        }
        if t >= self.t[last] {
            return [self.sum[last] + self.s[last] * (t - self.t[last]), self.s[last], 0.0];
        }
        let k = self.t.partition_point(|knot| *knot <= t) - 1;
        let (h, tau) = (self.t[k + 1] - self.t[k], t - self.t[k]);
        let a = (self.v[k + 1] - self.v[k]) / h;
        let (s, v) = (self.s[k], self.v[k]);
        [
            self.sum[k] + tau * (s + tau * (v / 2.0 + tau * a / 6.0)),
            s + tau * (v + tau * a / 2.0),
            v + tau * a,
        ]
    }

    pub(super) fn duration(&self) -> f64 {
        *self.t.last().expect("a profile has knots")
    }
}

/// The fastest profile of speeds along a curve, from rest to rest.
///
/// With `x = ṡ²` and `u = s̈`, joint accelerations are `q'u + q''x`: linear. Backwards, the largest `x` at
/// each knot from which the next can be entered; then forwards, as fast as that allows.
pub(super) fn fastest(curve: &Curve, limits: &Limits) -> Profile {
    let grid = grid(curve);
    let n = grid.len();
    let points: Vec<At> = grid.iter().map(|&s| curve.at(s)).collect();
    let mut top = vec![0.0; n];
    for i in (0..n - 1).rev() {
        let step = grid[i + 1] - grid[i];
        top[i] = highest(&points[i], limits, Some((top[i + 1], step)));
    }
    top[0] = 0.0;
    let mut x = vec![0.0; n];
    for i in 0..n - 1 {
        let step = grid[i + 1] - grid[i];
        let push = hardest_push(&points[i], limits, x[i]);
        x[i + 1] = (x[i] + 2.0 * step * push).clamp(0.0, top[i + 1]);
    }
    let mut profile = Profile { t: vec![0.0], s: grid.clone(), v: Vec::new(), sum: vec![0.0] };
    profile.v = x.iter().map(|x| x.sqrt()).collect();
    for i in 0..n - 1 {
        let step = grid[i + 1] - grid[i];
        let pace = (profile.v[i] + profile.v[i + 1]).max(1e-9);
        let h = 2.0 * step / pace;
        let a = (profile.v[i + 1] - profile.v[i]) / h;
        profile.t.push(profile.t[i] + h);
        let grown = h * (grid[i] + h * (profile.v[i] / 2.0 + h * a / 6.0));
        profile.sum.push(profile.sum[i] + grown);
    }
    profile
}

/// Knots along the curve: fine enough that its shape hardly changes between two, finer towards the ends,
/// where the arm is slow and each knot takes long.
fn grid(curve: &Curve) -> Vec<f64> {
    let length = curve.length();
    let mut grid = Vec::new();
    for piece in curve.knots().windows(2) {
        let size = piece[1] - piece[0];
        let parts = (size / 0.02).ceil().clamp(2.0, 200.0) as usize;
        let parts = if curve.knots().len() > 60 { 2 } else { parts.max(16) };
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

/// The largest `x` for which some `u` keeps the limits and, if given, leads to at most `next.0` after
/// `next.1`.
fn highest(at: &At, limits: &Limits, next: Option<(f64, f64)>) -> f64 {
    let mut top = f64::INFINITY;
    // Bounds on u, each `c + d x`.
    let mut lower: Vec<(f64, f64)> = Vec::with_capacity(at.q.len() + 1);
    let mut upper: Vec<(f64, f64)> = Vec::with_capacity(at.q.len() + 1);
    for i in 0..at.q.len() {
        let (d, dd, a) = (at.dq[i], at.ddq[i], limits.acceleration[i]);
        if d.abs() > 1e-12 {
            let v = limits.velocity[i] / d.abs();
            top = top.min(v * v);
            lower.push((-a / d.abs(), -dd / d));
            upper.push((a / d.abs(), -dd / d));
        } else if dd.abs() > 1e-12 {
            top = top.min(a / dd.abs());
        }
    }
    if let Some((x_next, step)) = next {
        upper.push((x_next / (2.0 * step), -1.0 / (2.0 * step)));
    }
    for (c, d) in &lower {
        for (e, f) in &upper {
            // c + d x <= e + f x.
            if d - f > 1e-15 {
                top = top.min((e - c) / (d - f));
            }
        }
    }
    top.max(0.0)
}

/// The largest `u` that keeps the acceleration limits at `x`.
fn hardest_push(at: &At, limits: &Limits, x: f64) -> f64 {
    (0..at.q.len())
        .filter(|&i| at.dq[i].abs() > 1e-12)
        .map(|i| limits.acceleration[i] / at.dq[i].abs() - at.ddq[i] / at.dq[i] * x)
        .fold(f64::INFINITY, f64::min)
}
