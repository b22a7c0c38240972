//! What pulls and pushes a reactive motion: Riemannian motion policies, each an acceleration and how much it matters.
//!
//! Every one speaks of one coordinate or point alone: where a target is, how near an obstacle or the end of a range is,
//! how fast a joint turns. [`super::rmpflow`] carries them to the joints and finds the one acceleration that suits all.
//! Gains are those that NVIDIA ships for the Franka arm, the ones the paper's motions had.
//!
//! Source: Ratliff, Issac, Kappler, Birchfield and Fox, "Riemannian motion policies", 2018; Cheng et al., "RMPflow: a
//! geometric framework for generation of multitask motion policies", 2018; the forms and gains of Isaac Sim's Lula.

use nalgebra::{Matrix3, Vector3};

/// A policy of one coordinate: it asks for the acceleration `push - damping * rate`, `metric` times as much as others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pull {
    pub(super) metric: f64,
    pub(super) push: f64,
    /// 1/s.
    pub(super) damping: f64,
}

/// As [`Pull`], of a point or a direction in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pull3 {
    pub(super) metric: Matrix3<f64>,
    pub(super) push: Vector3<f64>,
    /// 1/s.
    pub(super) damping: f64,
}

/// Beyond this distance, m, an obstacle is not felt.
pub(super) const FELT: f64 = 0.5;
/// Mass of every joint against all that pulls, and against damping: 1 of the posture, 100 of the damping.
pub(super) const INERTIA: f64 = 101.0;

/// Towards a posture, for each joint: `r` is the difference, no longer than [`POSTURE_REACH`] together.
pub(super) const POSTURE: Pull = Pull { metric: 50.0, push: 100.0, damping: 50.0 };
/// Farther differences of posture pull no more than this, rad.
pub(super) const POSTURE_REACH: f64 = 0.5;

/// Damping of all joints at speed `norm` rad/s together.
pub(super) fn damping(norm: f64) -> Pull {
    Pull { metric: 50.0 * norm, push: 0.0, damping: 30.0 * norm }
}

/// The tool's point towards a target that is `to` away, m. Far off only the direction counts, near it all three do, and
/// more than all else.
pub(super) fn target(to: &Vector3<f64>) -> Pull3 {
    const PUSH: f64 = 30.0;
    const DAMPING: f64 = 85.0;
    const SOFT: f64 = 0.075;
    let distance = to.norm();
    let near = |width: f64| (-0.5 * (distance / width).powi(2)).exp();
    let all = (1.0 - 0.01) * near(0.05) + 0.01;
    let direction = if distance > 0.0 { to / distance } else { *to };
    let metric = Matrix3::identity() * (all * 10_000.0)
        + direction * direction.transpose() * ((1.0 - all) * 2500.0);
    let boost = near(0.02) * (20.0 - 1.0) + 1.0;
    Pull3 { metric: metric * boost, push: to * (PUSH / (distance + SOFT)), damping: DAMPING }
}

/// A direction of the tool towards one that is `to` away (a difference of unit vectors), with the tool's point `distance`
/// m from its own target.
pub(super) fn axis(to: &Vector3<f64>, distance: f64) -> Pull3 {
    let near = (-0.5 * (distance / 0.08_f64).powi(2)).exp();
    let metric = 10.0 * (near * (3000.0 - 1.0) + 1.0);
    Pull3 { metric: Matrix3::identity() * metric, push: to * 210.0, damping: 60.0 }
}

/// Away from the end of a range: `x` is the way left to it as a share of the range.
pub(super) fn limit(x: f64, rate: f64) -> Pull {
    let x = x.max(0.0);
    let metric = away(rate, 0.01) * 1000.0 / (x / 0.01 + 1e-3);
    Pull { metric, push: 1.0 / ((x / 0.1).powi(2) + 1e-2), damping: 200.0 }
}

/// Against a joint's speed near its limit, both rad/s; nothing below. It pulls towards where it begins.
pub(super) fn cap(speed: f64, highest: f64) -> Option<Pull> {
    /// The share of the limit over which it grows: 0.3 of the Gen3's 1.4 rad/s.
    const OVER: f64 = 0.2;
    /// Its weight at and beyond the limit, in place of one without end.
    const MOST: f64 = 1e6;
    let range = OVER * highest;
    let over = speed.abs() - (highest - range);
    if over <= 0.0 {
        return None;
    }
    let left = 1.0 - (over / range).powi(2);
    let metric = if left > 100.0 / MOST { 100.0 / left } else { MOST };
    // Damping acts on the whole speed; the push gives back what is allowed.
    let allowed = (speed.abs() - over).copysign(speed);
    Some(Pull { metric, push: 1000.0 * allowed, damping: 1000.0 })
}

/// Away from an obstacle at a distance of `x` m that changes at `rate` m/s.
pub(super) fn obstacle(x: f64, rate: f64) -> Pull {
    let x = x.max(0.0);
    let approaching = away(rate, 0.01);
    let felt = if x < FELT { (1.0 - x / FELT).powi(2) } else { 0.0 };
    Pull {
        metric: approaching * felt * 10_000.0 / (x / 0.02 + 1e-3),
        push: 800.0 * (-x / 0.01).exp(),
        damping: 50.0 * approaching / (x / 0.04 + 0.01),
    }
}

/// One where a distance shrinks, none where it grows, over `width`.
fn away(rate: f64, width: f64) -> f64 {
    1.0 / (1.0 + (rate / width).exp())
}
