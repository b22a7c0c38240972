//! Eight numbers at once, in whatever registers the machine at hand has.
//!
//! [`run`] finds out what the processor can do and runs a [`Job`] with it: on AVX2 eight numbers are one register; anywhere
//! else they are eight numbers which the compiler joins as it can. No product is fused with a sum and every lane is worked
//! out as one number would be, so all machines find the same bits. Single precision: about seven digits.

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use std::ops::{Add, Mul, Sub};

use nalgebra::Vector3;
use pulp::{Scalar256b, Simd, f32x8, f64x4, m64x4};

/// How many numbers are done at once.
pub(super) const LANES: usize = 8;

/// What a machine has for eight numbers, or for four in double precision ([`super::quad`]).
pub(super) trait Wide: Simd<f32s = f32x8, f64s = f64x4, m64s = m64x4> {
    /// Returns a bit for each number whose sign is set.
    fn signs(self, x: f32x8) -> u8;

    /// Returns a bit for each of four marks that is set.
    fn marks(self, marks: m64x4) -> u8;

    /// Returns y, z, x and what stands behind them.
    fn next_of_three(self, v: f64x4) -> f64x4;

    /// Returns `holds` where a mark is set, else `not`. Pulp's own is a call where little is inlined, as those of the next two.
    fn pick(self, marks: m64x4, holds: f64x4, not: f64x4) -> f64x4;

    /// Returns the marks turned round.
    fn unmarked(self, marks: m64x4) -> m64x4;

    /// Returns four numbers without their signs.
    fn sizes(self, x: f64x4) -> f64x4;

    /// Returns the largest number of each of four.
    fn largest_of_each(self, fours: [f64x4; 4]) -> f64x4;
}

#[cfg(target_arch = "x86_64")]
impl Wide for pulp::x86::V3 {
    #[inline(always)]
    fn signs(self, x: f32x8) -> u8 {
        self.avx._mm256_movemask_ps(pulp::cast(x)) as u8
    }

    #[inline(always)]
    fn marks(self, marks: m64x4) -> u8 {
        self.avx._mm256_movemask_pd(pulp::cast(marks)) as u8
    }

    #[inline(always)]
    fn next_of_three(self, v: f64x4) -> f64x4 {
        pulp::cast(self.avx2._mm256_permute4x64_pd::<0b11_00_10_01>(pulp::cast(v)))
    }

    #[inline(always)]
    fn pick(self, marks: m64x4, holds: f64x4, not: f64x4) -> f64x4 {
        let (not, holds) = (pulp::cast(not), pulp::cast(holds));
        pulp::cast(self.avx._mm256_blendv_pd(not, holds, pulp::cast(marks)))
    }

    #[inline(always)]
    fn unmarked(self, marks: m64x4) -> m64x4 {
        let all = pulp::cast([u64::MAX; 4]);
        pulp::cast(self.avx._mm256_xor_pd(pulp::cast(marks), all))
    }

    #[inline(always)]
    fn sizes(self, x: f64x4) -> f64x4 {
        let sign = pulp::cast(f64x4(-0.0, -0.0, -0.0, -0.0));
        pulp::cast(self.avx._mm256_andnot_pd(sign, pulp::cast(x)))
    }

    #[inline(always)]
    fn largest_of_each(self, [a, b, c, d]: [f64x4; 4]) -> f64x4 {
        let [a, b, c, d] = [pulp::cast(a), pulp::cast(b), pulp::cast(c), pulp::cast(d)];
        // Of two the larger of lanes 0 and 1, in turn, then of lanes 2 and 3.
        let (even, odd) = (self.avx._mm256_unpacklo_pd(a, b), self.avx._mm256_unpackhi_pd(a, b));
        let ab = self.avx._mm256_max_pd(even, odd);
        let (even, odd) = (self.avx._mm256_unpacklo_pd(c, d), self.avx._mm256_unpackhi_pd(c, d));
        let cd = self.avx._mm256_max_pd(even, odd);
        let low = self.avx._mm256_permute2f128_pd::<0x20>(ab, cd);
        let high = self.avx._mm256_permute2f128_pd::<0x31>(ab, cd);
        pulp::cast(self.avx._mm256_max_pd(low, high))
    }
}

impl Wide for Scalar256b {
    #[inline(always)]
    fn signs(self, x: f32x8) -> u8 {
        let f32x8(a, b, c, d, e, f, g, h) = x;
        let lanes = [a, b, c, d, e, f, g, h].into_iter().enumerate();
        lanes.fold(0, |bits, (lane, x)| bits | u8::from(x.is_sign_negative()) << lane)
    }

    #[inline(always)]
    fn marks(self, m64x4(a, b, c, d): m64x4) -> u8 {
        u8::from(a.is_set())
            | u8::from(b.is_set()) << 1
            | u8::from(c.is_set()) << 2
            | u8::from(d.is_set()) << 3
    }

    #[inline(always)]
    fn next_of_three(self, f64x4(x, y, z, w): f64x4) -> f64x4 {
        f64x4(y, z, x, w)
    }

    #[inline(always)]
    fn pick(self, marks: m64x4, holds: f64x4, not: f64x4) -> f64x4 {
        self.select_f64s(marks, holds, not)
    }

    #[inline(always)]
    fn unmarked(self, marks: m64x4) -> m64x4 {
        self.not_m64s(marks)
    }

    #[inline(always)]
    fn sizes(self, x: f64x4) -> f64x4 {
        self.abs_f64s(x)
    }

    #[inline(always)]
    fn largest_of_each(self, fours: [f64x4; 4]) -> f64x4 {
        let [a, b, c, d] = fours.map(|f64x4(x, y, z, w)| x.max(y).max(z.max(w)));
        f64x4(a, b, c, d)
    }
}

/// Something worked out eight numbers at a time.
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

/// Returns eight numbers as memory holds them.
#[inline(always)]
pub(super) fn packed(numbers: &[f64; LANES]) -> f32x8 {
    let [a, b, c, d, e, f, g, h] = *numbers;
    f32x8(a as f32, b as f32, c as f32, d as f32, e as f32, f as f32, g as f32, h as f32)
}

/// Returns a vector in single precision.
pub(super) fn short(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

/// Eight points or directions as memory holds them, by axis.
pub(super) type Vectors = [f32x8; 3];

/// Eight numbers and the means to reckon with them.
#[derive(Clone, Copy)]
pub(super) struct Eight<S: Wide> {
    simd: S,
    pub(super) lanes: f32x8,
}

impl<S: Wide> Eight<S> {
    /// Returns numbers that memory holds.
    #[inline(always)]
    pub(super) fn of(simd: S, lanes: f32x8) -> Self {
        Self { simd, lanes }
    }

    /// Returns the means to reckon with them.
    #[inline(always)]
    pub(super) fn simd(self) -> S {
        self.simd
    }

    /// Returns one number eight times.
    #[inline(always)]
    pub(super) fn all(simd: S, x: f32) -> Self {
        Self { simd, lanes: simd.splat_f32s(x) }
    }

    #[inline(always)]
    pub(super) fn abs(self) -> Self {
        Self { lanes: self.simd.abs_f32s(self.lanes), ..self }
    }

    /// Returns the nearest whole numbers; of numbers up to 2^22.
    #[inline(always)]
    pub(super) fn rounded(self) -> Self {
        // Adding it leaves no bits for what is behind the point: 3 · 2^22.
        let shift = Self::all(self.simd, 12_582_912.0);
        (self + shift) - shift
    }

    #[inline(always)]
    pub(super) fn sqrt(self) -> Self {
        Self { lanes: self.simd.sqrt_f32s(self.lanes), ..self }
    }

    #[inline(always)]
    pub(super) fn reciprocal(self) -> Self {
        Self { lanes: self.simd.div_f32s(self.simd.splat_f32s(1.0), self.lanes), ..self }
    }

    #[inline(always)]
    pub(super) fn min(self, other: Self) -> Self {
        Self { lanes: self.simd.min_f32s(self.lanes, other.lanes), ..self }
    }

    #[inline(always)]
    pub(super) fn max(self, other: Self) -> Self {
        Self { lanes: self.simd.max_f32s(self.lanes, other.lanes), ..self }
    }

    /// Returns the least of the eight.
    #[inline(always)]
    pub(super) fn least(self) -> f32 {
        self.simd.reduce_min_f32s(self.lanes)
    }

    /// Returns the largest of the eight.
    #[inline(always)]
    pub(super) fn most(self) -> f32 {
        self.simd.reduce_max_f32s(self.lanes)
    }

    /// Returns a bit for each that is below zero.
    #[inline(always)]
    pub(super) fn below_zero(self) -> u8 {
        self.simd.signs(self.lanes)
    }
}

/// Eight points or directions and the means to reckon with them.
#[derive(Clone, Copy)]
pub(super) struct Three<S: Wide> {
    pub(super) x: Eight<S>,
    pub(super) y: Eight<S>,
    pub(super) z: Eight<S>,
}

impl<S: Wide> Three<S> {
    /// Returns vectors that memory holds.
    #[inline(always)]
    pub(super) fn of(simd: S, [x, y, z]: Vectors) -> Self {
        Self { x: Eight::of(simd, x), y: Eight::of(simd, y), z: Eight::of(simd, z) }
    }

    /// Returns one vector eight times.
    #[inline(always)]
    pub(super) fn all(simd: S, [x, y, z]: [f32; 3]) -> Self {
        Self { x: Eight::all(simd, x), y: Eight::all(simd, y), z: Eight::all(simd, z) }
    }

    /// Returns them as memory holds them.
    #[inline(always)]
    pub(super) fn lanes(self) -> Vectors {
        [self.x.lanes, self.y.lanes, self.z.lanes]
    }

    #[inline(always)]
    pub(super) fn scaled(self, by: Eight<S>) -> Self {
        Self { x: self.x * by, y: self.y * by, z: self.z * by }
    }

    #[inline(always)]
    pub(super) fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    #[inline(always)]
    pub(super) fn norm(self) -> Eight<S> {
        self.dot(self).sqrt()
    }

    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> Eight<S> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }
}

impl<S: Wide> Add for Three<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl<S: Wide> Sub for Three<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl<S: Wide> Add for Eight<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { lanes: self.simd.add_f32s(self.lanes, other.lanes), ..self }
    }
}

impl<S: Wide> Sub for Eight<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { lanes: self.simd.sub_f32s(self.lanes, other.lanes), ..self }
    }
}

impl<S: Wide> Mul for Eight<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { lanes: self.simd.mul_f32s(self.lanes, other.lanes), ..self }
    }
}
