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
    #[inline]
    fn constant(value: f64) -> Self {
        value
    }
    #[inline]
    fn value(self) -> f64 {
        self
    }
    #[inline]
    fn chain(self, f: f64, _: f64) -> Self {
        f
    }
    #[inline]
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

    /// The value `v` with `f` of each derivative.
    ///
    /// Plain loops over indices: they are computed several lanes at once in every profile, which `array::map` and
    /// `zip` are only where the whole crate is optimised in one piece.
    #[inline]
    fn map(mut self, v: f64, f: impl Fn(f64) -> f64) -> Self {
        self.v = v;
        for i in 0..N {
            self.d[i] = f(self.d[i]);
        }
        self
    }

    #[inline]
    fn map2(mut self, rhs: Self, v: f64, f: impl Fn(f64, f64) -> f64) -> Self {
        self.v = v;
        for i in 0..N {
            self.d[i] = f(self.d[i], rhs.d[i]);
        }
        self
    }
}

impl<const N: usize> Number for Dual<N> {
    #[inline]
    fn constant(v: f64) -> Self {
        Self { v, d: [0.0; N] }
    }
    #[inline]
    fn value(self) -> f64 {
        self.v
    }
    #[inline]
    fn chain(self, f: f64, df: f64) -> Self {
        self.map(f, |d| d * df)
    }
    #[inline]
    fn scaled(self, by: f64) -> Self {
        self.map(self.v * by, |d| d * by)
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline]
    fn add(self, rhs: Self) -> Self {
        self.map2(rhs, self.v + rhs.v, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline]
    fn sub(self, rhs: Self) -> Self {
        self.map2(rhs, self.v - rhs.v, |a, b| a - b)
    }
}

#[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule is a sum")]
impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline]
    fn mul(self, rhs: Self) -> Self {
        let (x, y) = (self.v, rhs.v);
        self.map2(rhs, x * y, |a, b| a * y + x * b)
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline]
    fn div(self, rhs: Self) -> Self {
        let v = self.v / rhs.v;
        let by = 1.0 / rhs.v;
        self.map2(rhs, v, |a, b| (a - v * b) * by)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.map(-self.v, |d| -d)
    }
}
