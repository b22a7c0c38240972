//! Numbers that carry their derivatives: forward-mode differentiation.
//!
//! The same program runs over plain `f64` and over [`Dual`], which carries the derivatives with respect to
//! `N` parameters along. Source: Griewank and Walther, *Evaluating Derivatives*, 2nd ed., 2008, §3.1.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// What a program of equations computes with.
pub trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// A number that depends on nothing.
    fn constant(value: f64) -> Self;

    /// Returns its value without derivatives.
    fn value(self) -> f64;

    /// A function of it with the value `f` and the derivative `df` there.
    #[must_use]
    fn chain(self, f: f64, df: f64) -> Self;

    /// Returns it times a plain number.
    #[must_use]
    fn scaled(self, by: f64) -> Self;
}

impl Number for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn value(self) -> f64 {
        self
    }
    fn chain(self, f: f64, _: f64) -> Self {
        f
    }
    fn scaled(self, by: f64) -> Self {
        self * by
    }
}

/// A value with `N` derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub v: f64,
    /// Its derivatives.
    pub d: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A variable: its own derivative, the `i`th, is `seed`.
    pub fn variable(v: f64, i: usize, seed: f64) -> Self {
        let mut d = [0.0; N];
        if i < N {
            d[i] = seed;
        }
        Self { v, d }
    }

    fn map2(self, rhs: Self, v: f64, f: impl Fn(f64, f64) -> f64) -> Self {
        Self { v, d: std::array::from_fn(|i| f(self.d[i], rhs.d[i])) }
    }
}

impl<const N: usize> Number for Dual<N> {
    fn constant(v: f64) -> Self {
        Self { v, d: [0.0; N] }
    }
    fn value(self) -> f64 {
        self.v
    }
    fn chain(self, f: f64, df: f64) -> Self {
        Self { v: f, d: self.d.map(|d| d * df) }
    }
    fn scaled(self, by: f64) -> Self {
        Self { v: self.v * by, d: self.d.map(|d| d * by) }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    fn add(self, rhs: Self) -> Self {
        self.map2(rhs, self.v + rhs.v, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    fn sub(self, rhs: Self) -> Self {
        self.map2(rhs, self.v - rhs.v, |a, b| a - b)
    }
}

#[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule is a sum")]
impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    fn mul(self, rhs: Self) -> Self {
        let (x, y) = (self.v, rhs.v);
        self.map2(rhs, x * y, |a, b| a * y + x * b)
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    fn div(self, rhs: Self) -> Self {
        let v = self.v / rhs.v;
        let by = 1.0 / rhs.v;
        self.map2(rhs, v, |a, b| (a - v * b) * by)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    fn neg(self) -> Self {
        Self { v: -self.v, d: self.d.map(|d| -d) }
    }
}
