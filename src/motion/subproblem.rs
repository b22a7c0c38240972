//! The two subproblems that inverse kinematics of many arms comes down to: the turn that carries one vector onto another,
//! and the turns that bring a vector to a height.
//!
//! How far a vector ends from a point, and two turns in a row, are heights as well: `|a + R b|² - |a|² - |b|² = 2 a·R b`,
//! and what two turns share is what neither axis sees.
//!
//! Source: Elias and Wen, "IK-Geo: Unified robot inverse kinematics using subproblem decomposition", Mechanism and
//! Machine Theory 209 (2025), subproblems 1 and 4; Paden, *Kinematics and Control of Robot Manipulators*, 1986.

use nalgebra::Vector3;

/// A turn that changes less than this, in the vectors' own units, is free.
const FREE: f64 = 1e-9;
/// A height that is out of reach by this share is tried as if it were just reached: where axes meet or are parallel only
/// nearly, the solution itself may lie a little inside. What comes of it is polished, or dropped.
const SLACK: f64 = 0.01;

/// A turn about an axis, rad.
#[derive(Debug, Clone, Copy)]
pub(super) struct About {
    axis: Vector3<f64>,
    pub(super) angle: f64,
    sin: f64,
    cos: f64,
}

impl About {
    /// Returns the turn by an angle, rad, about a unit direction.
    pub(super) fn new(axis: Vector3<f64>, angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        Self { axis, angle, sin, cos }
    }

    /// Turns a vector.
    pub(super) fn turn(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.by(self.sin, v)
    }

    /// Turns a vector back.
    pub(super) fn back(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.by(-self.sin, v)
    }

    fn by(&self, sin: f64, v: &Vector3<f64>) -> Vector3<f64> {
        let along = self.axis * self.axis.dot(v);
        along + (v - along) * self.cos + self.axis.cross(v) * sin
    }
}

/// Returns the turn about `axis` that brings `from` as near as can be to `to`; by `near`, rad, where any does.
pub(super) fn onto(axis: Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>, near: f64) -> About {
    let (sin, cos) = (axis.cross(from).dot(to), from.dot(to) - axis.dot(from) * axis.dot(to));
    let free = FREE * from.norm() * to.norm();
    let is_free = sin.abs() <= free && cos.abs() <= free;
    About::new(axis, if is_free { near } else { sin.atan2(cos) })
}

/// Returns the turns about `axis` after which `v` is at `height` along `up`, two at most; by `near`, rad, where any does.
pub(super) fn to_height(
    axis: Vector3<f64>,
    v: &Vector3<f64>,
    up: &Vector3<f64>,
    height: f64,
    near: f64,
) -> impl Iterator<Item = About> + use<> {
    let along = axis.dot(v) * axis.dot(up);
    let (sin, cos, rest) = (axis.cross(v).dot(up), v.dot(up) - along, height - along);
    let swing = sin.hypot(cos);
    let free = FREE * v.norm() * up.norm();
    let angles = if swing <= free {
        (rest.abs() <= free).then_some([Some(near), None])
    } else {
        let share = rest / swing;
        let (middle, half) = (sin.atan2(cos), share.clamp(-1.0, 1.0).acos());
        let other = (half > 0.0).then_some(middle - half);
        (share.abs() <= 1.0 + SLACK).then_some([Some(middle + half), other])
    };
    angles.into_iter().flatten().flatten().map(move |angle| About::new(axis, angle))
}

/// Returns the turns about `axis` after which the square of `from + v` is `squared`, two at most; by `near`, rad, where any does.
pub(super) fn to_distance(
    axis: Vector3<f64>,
    v: &Vector3<f64>,
    from: &Vector3<f64>,
    squared: f64,
    near: f64,
) -> impl Iterator<Item = About> + use<> {
    let height = 0.5 * (squared - v.norm_squared() - from.norm_squared());
    to_height(axis, v, from, height, near)
}
