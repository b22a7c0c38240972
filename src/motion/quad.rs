//! Four numbers in double precision at once, in whatever registers the machine at hand has.
//!
//! As [`super::lanes`], which has eight in single precision and finds out what there is: no product is fused with a sum and
//! every lane is worked out as one number would be, so all machines find the same bits.
//!
//! Arrays of these are gone through by loops: what `map` and `from_fn` call is not always inlined, and then misses the registers.

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Sub};

use nalgebra::Vector3;
use pulp::{f64x4, m64x4};

use super::lanes::Wide;

/// Four numbers and the means to reckon with them.
#[derive(Clone, Copy)]
pub(super) struct Quad<S: Wide> {
    simd: S,
    lanes: f64x4,
}

/// What holds of each of four numbers, or does not.
#[derive(Clone, Copy)]
pub(super) struct Marks<S: Wide> {
    simd: S,
    lanes: m64x4,
}

/// A bit for each of four.
const ALL: u8 = 0b1111;

impl<S: Wide> Quad<S> {
    /// Returns four numbers.
    #[inline(always)]
    pub(super) fn of(simd: S, [a, b, c, d]: [f64; 4]) -> Self {
        Self { simd, lanes: f64x4(a, b, c, d) }
    }

    /// Returns one number four times.
    #[inline(always)]
    pub(super) fn all(simd: S, x: f64) -> Self {
        Self { simd, lanes: simd.splat_f64s(x) }
    }

    /// Returns the means to reckon with them.
    #[inline(always)]
    pub(super) fn simd(self) -> S {
        self.simd
    }

    /// Returns the four.
    #[inline(always)]
    pub(super) fn lanes(self) -> [f64; 4] {
        let f64x4(a, b, c, d) = self.lanes;
        [a, b, c, d]
    }

    /// Returns the first three as a vector.
    #[inline(always)]
    pub(super) fn short(self) -> Vector3<f64> {
        let [x, y, z, _] = self.lanes();
        Vector3::new(x, y, z)
    }

    /// Returns the cross product of two vectors of three, each with a nought behind.
    #[inline(always)]
    pub(super) fn cross(self, other: Self) -> Self {
        let next = |v: Self| Self { lanes: self.simd.next_of_three(v.lanes), ..self };
        next(self * next(other) - next(self) * other)
    }

    #[inline(always)]
    pub(super) fn abs(self) -> Self {
        Self { lanes: self.simd.sizes(self.lanes), ..self }
    }

    #[inline(always)]
    pub(super) fn sqrt(self) -> Self {
        Self { lanes: self.simd.sqrt_f64s(self.lanes), ..self }
    }

    /// Returns the larger of two; the other where this is not a number.
    #[inline(always)]
    pub(super) fn max(self, other: Self) -> Self {
        Self { lanes: self.simd.max_f64s(self.lanes, other.lanes), ..self }
    }

    #[inline(always)]
    pub(super) fn min(self, other: Self) -> Self {
        Self { lanes: self.simd.min_f64s(self.lanes, other.lanes), ..self }
    }

    /// Returns the largest number of each of four.
    #[inline(always)]
    pub(super) fn largest([a, b, c, d]: [Self; 4]) -> Self {
        Self { lanes: a.simd.largest_of_each([a.lanes, b.lanes, c.lanes, d.lanes]), ..a }
    }

    /// Returns where this is below another.
    #[inline(always)]
    pub(super) fn below(self, other: Self) -> Marks<S> {
        Marks { simd: self.simd, lanes: self.simd.less_than_f64s(self.lanes, other.lanes) }
    }

    /// Returns where this is no less than another.
    #[inline(always)]
    pub(super) fn reaches(self, other: Self) -> Marks<S> {
        Marks {
            simd: self.simd,
            lanes: self.simd.greater_than_or_equal_f64s(self.lanes, other.lanes),
        }
    }

    /// Returns the angle of a direction that is a sine and a cosine, rad; with squares that add up to one, to a thousandth.
    ///
    /// Source: Moshier's `atan.c` (Cephes), by the quotient that is the smaller, or an eighth of a turn beside it.
    #[inline(always)]
    pub(super) fn angle(self, cos: Self) -> Self {
        let k = |x: f64| Self::all(self.simd, x);
        let (x, y) = (cos.abs(), self.abs());
        let is_steep = x.below(y);
        let (long, short) = (is_steep.pick(y, x), is_steep.pick(x, y));
        let is_far = short.reaches(k(0.66) * long);
        let over = is_far.pick(short - long, short);
        let z = over / is_far.pick(short + long, long);
        let zz = z * z;
        let p = ((((k(ATAN_P[4]) * zz + k(ATAN_P[3])) * zz + k(ATAN_P[2])) * zz + k(ATAN_P[1]))
            * zz)
            + k(ATAN_P[0]);
        let q = ((((zz + k(ATAN_Q[4])) * zz + k(ATAN_Q[3])) * zz + k(ATAN_Q[2])) * zz
            + k(ATAN_Q[1]))
            * zz
            + k(ATAN_Q[0]);
        let bent = z + (z * zz) * (p / q);
        let angle = is_far.pick(bent + k(FRAC_PI_4 + 0.5 * MORE_BITS), bent);
        let angle = is_steep.pick(k(FRAC_PI_2) - angle, angle);
        let angle = cos.below(k(0.0)).pick(k(PI) - angle, angle);
        self.below(k(0.0)).pick(-angle, angle)
    }
}

/// What π/2 is more than its nearest number.
const MORE_BITS: f64 = 6.123_233_995_736_766e-17;
const ATAN_P: [f64; 5] = [
    -6.485_021_904_942_025e1,
    -1.228_866_684_490_136_2e2,
    -7.500_855_792_314_705e1,
    -1.615_753_718_733_365e1,
    -8.750_608_600_031_904e-1,
];
const ATAN_Q: [f64; 5] = [
    1.945_506_571_482_614e2,
    4.853_903_996_359_137e2,
    4.328_810_604_912_903e2,
    1.650_270_098_316_988_5e2,
    2.485_846_490_142_306_4e1,
];

impl<S: Wide> Marks<S> {
    /// Returns one number where it holds, and another where it does not.
    #[inline(always)]
    pub(super) fn pick(self, holds: Quad<S>, not: Quad<S>) -> Quad<S> {
        let lanes = self.simd.pick(self.lanes, holds.lanes, not.lanes);
        Quad { simd: self.simd, lanes }
    }

    /// Returns a bit for each lane in which it holds.
    #[inline(always)]
    pub(super) fn bits(self) -> u8 {
        self.simd.marks(self.lanes)
    }

    #[inline(always)]
    pub(super) fn is_everywhere(self) -> bool {
        self.bits() == ALL
    }

    #[inline(always)]
    pub(super) fn is_nowhere(self) -> bool {
        self.bits() == 0
    }

    /// Returns where it does not hold.
    #[inline(always)]
    pub(super) fn not(self) -> Self {
        Self { lanes: self.simd.unmarked(self.lanes), ..self }
    }
}

impl<S: Wide> BitAnd for Marks<S> {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self { lanes: self.simd.and_m64s(self.lanes, other.lanes), ..self }
    }
}

impl<S: Wide> BitOr for Marks<S> {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self { lanes: self.simd.or_m64s(self.lanes, other.lanes), ..self }
    }
}

impl<S: Wide> Add for Quad<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { lanes: self.simd.add_f64s(self.lanes, other.lanes), ..self }
    }
}

impl<S: Wide> Sub for Quad<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { lanes: self.simd.sub_f64s(self.lanes, other.lanes), ..self }
    }
}

impl<S: Wide> Mul for Quad<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { lanes: self.simd.mul_f64s(self.lanes, other.lanes), ..self }
    }
}

impl<S: Wide> Div for Quad<S> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self { lanes: self.simd.div_f64s(self.lanes, other.lanes), ..self }
    }
}

impl<S: Wide> Neg for Quad<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self * Self::all(self.simd, -1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::lanes::{Job, run};
    use super::*;

    /// The angles of four directions.
    struct Angles([f64; 4]);

    impl Job for Angles {
        type Found = [f64; 4];

        #[inline(always)]
        fn with<S: Wide>(self, simd: S) -> [f64; 4] {
            Quad::of(simd, self.0.map(f64::sin)).angle(Quad::of(simd, self.0.map(f64::cos))).lanes()
        }
    }

    #[test]
    fn an_angle_comes_back_from_its_sine_and_cosine_on_every_machine() {
        let mut worst = 0.0_f64;
        for k in 0..10_000 {
            let angles = [0, 1, 2, 3].map(|lane| {
                let share = f64::from(4 * k + lane) / 40_000.0;
                (2.0 * share - 1.0) * PI
            });
            let found = run(Angles(angles));
            for (found, angle) in found.iter().zip(angles) {
                worst = worst.max((found - angle.sin().atan2(angle.cos())).abs());
            }
            assert_eq!(
                found.map(f64::to_bits),
                Angles(angles).with(pulp::Scalar256b).map(f64::to_bits)
            );
        }
        // A unit of the last place of π.
        assert!(worst < 4.5e-16, "{worst}");
        let ends = run(Angles([0.0, PI, -FRAC_PI_2, FRAC_PI_2]));
        assert_eq!(ends[0].to_bits(), 0.0_f64.to_bits());
        assert!(run(Angles([f64::NAN; 4])).iter().all(|x| x.is_nan()));
    }
}
