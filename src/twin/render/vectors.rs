//! Four places or directions at once, in single precision.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use std::ops::{Add, Mul, Sub};

use nalgebra::{Matrix3, Vector3};
use wide::f32x4;

/// Four places or directions.
#[derive(Clone, Copy)]
pub(super) struct Four3 {
    pub(super) x: f32x4,
    pub(super) y: f32x4,
    pub(super) z: f32x4,
}

impl Four3 {
    /// Returns the same four times.
    #[inline(always)]
    pub(super) fn of(v: Vector3<f32>) -> Self {
        Self { x: f32x4::splat(v.x), y: f32x4::splat(v.y), z: f32x4::splat(v.z) }
    }

    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> f32x4 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub(super) fn norm(self) -> f32x4 {
        self.dot(self).sqrt()
    }

    /// Returns them turned.
    #[inline(always)]
    pub(super) fn turned(self, m: &Matrix3<f32>) -> Self {
        let row = |a: f32, b: f32, c: f32| {
            self.x * f32x4::splat(a) + self.y * f32x4::splat(b) + self.z * f32x4::splat(c)
        };
        Self {
            x: row(m.m11, m.m12, m.m13),
            y: row(m.m21, m.m22, m.m23),
            z: row(m.m31, m.m32, m.m33),
        }
    }

    /// Returns them turned back.
    #[inline(always)]
    pub(super) fn turned_back(self, m: &Matrix3<f32>) -> Self {
        self.turned(&m.transpose())
    }

    /// Returns each of the four.
    #[inline(always)]
    pub(super) fn each(self) -> [Vector3<f32>; 4] {
        let (x, y, z) = (self.x.to_array(), self.y.to_array(), self.z.to_array());
        [0, 1, 2, 3].map(|k| Vector3::new(x[k], y[k], z[k]))
    }

    /// Returns one of the four.
    #[inline]
    pub(super) fn lane(self, k: usize) -> Vector3<f64> {
        let at = |four: f32x4| f64::from(four.to_array()[k]);
        Vector3::new(at(self.x), at(self.y), at(self.z))
    }
}

impl Add for Four3 {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl Sub for Four3 {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl Mul<f32x4> for Four3 {
    type Output = Self;

    #[inline]
    fn mul(self, by: f32x4) -> Self {
        Self { x: self.x * by, y: self.y * by, z: self.z * by }
    }
}
