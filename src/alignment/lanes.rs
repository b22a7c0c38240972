//! Four numbers in double precision at once, in whatever registers the machine at hand has.
//!
//! [`run`] finds out what the processor can do and runs a [`Job`] with it: on AVX2 four numbers are one register; anywhere
//! else they are four numbers which the compiler joins as it can. No product is fused with a sum, so all machines find the
//! same bits. The counterpart in single precision, eight at once, is `motion`'s own.

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use std::ops::{Add, Div, Mul, Sub};

use pulp::{Scalar256b, Simd, f64x4};

/// How many numbers are done at once.
pub(super) const LANES: usize = 4;

/// As many numbers, as memory holds them.
pub(super) type Lanes = [f64; LANES];

/// What a machine has for four numbers.
pub(super) trait Wide: Simd<f64s = f64x4> {}

#[cfg(target_arch = "x86_64")]
impl Wide for pulp::x86::V3 {}

impl Wide for Scalar256b {}

/// Something worked out four numbers at a time.
pub(super) trait Job {
    /// What comes out.
    type Found;

    /// Works it out with what a machine has. It and all it calls must be inlined to be quick.
    fn with<S: Wide>(self, simd: S) -> Self::Found;
}

/// Works out a job with the widest registers the processor has.
#[inline]
pub(super) fn run<J: Job>(job: J) -> J::Found {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return simd.vectorize(
            #[inline(always)]
            || job.with(simd),
        );
    }
    job.with(Scalar256b)
}

/// Four numbers and the means to reckon with them.
#[derive(Clone, Copy)]
pub(super) struct Four<S: Wide> {
    simd: S,
    lanes: f64x4,
}

impl<S: Wide> Four<S> {
    /// Returns numbers that memory holds.
    #[inline(always)]
    pub(super) fn of(simd: S, lanes: &Lanes) -> Self {
        Self { simd, lanes: pulp::cast(*lanes) }
    }

    /// Returns one number four times.
    #[inline(always)]
    pub(super) fn all(simd: S, x: f64) -> Self {
        Self { simd, lanes: simd.splat_f64s(x) }
    }

    /// Returns them as memory holds them.
    #[inline(always)]
    pub(super) fn lanes(self) -> Lanes {
        pulp::cast(self.lanes)
    }

    /// Returns their sum.
    #[inline(always)]
    pub(super) fn sum(self) -> f64 {
        let [a, b, c, d] = self.lanes();
        (a + b) + (c + d)
    }

    /// Returns, lane by lane, `yes` where these are larger than `limit` and `no` elsewhere, also where they are no numbers.
    #[inline(always)]
    pub(super) fn above(self, limit: Self, yes: Self, no: Self) -> Self {
        let mask = self.simd.greater_than_f64s(self.lanes, limit.lanes);
        Self { lanes: self.simd.select_f64s(mask, yes.lanes, no.lanes), ..self }
    }
}

impl<S: Wide> Add for Four<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { lanes: self.simd.add_f64s(self.lanes, other.lanes), ..self }
    }
}

impl<S: Wide> Sub for Four<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { lanes: self.simd.sub_f64s(self.lanes, other.lanes), ..self }
    }
}

impl<S: Wide> Mul for Four<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { lanes: self.simd.mul_f64s(self.lanes, other.lanes), ..self }
    }
}

impl<S: Wide> Div for Four<S> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self { lanes: self.simd.div_f64s(self.lanes, other.lanes), ..self }
    }
}
