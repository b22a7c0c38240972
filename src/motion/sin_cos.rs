//! Sines and cosines of eight angles at once, for the joints of a chain.
//!
//! One after the other they would be a third of the time that forward kinematics takes. Without branches the compiler
//! does two or four at a time. They are right to within a unit of the last place, as those of the standard library.
//!
//! Source: fdlibm's `k_sin.c`, `k_cos.c` and `e_rem_pio2.c` (Sun Microsystems, 1993): polynomials on ±π/4, and π/2 in
//! three pieces (Cody and Waite).

use std::f64::consts::FRAC_2_PI;

/// How many are done at once.
pub(super) const LANES: usize = 8;

/// π/2 in pieces of 33 bits, and the rest: a multiple of the first two is exact up to 2^20.
const PIECES: [f64; 3] =
    [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];
/// Angles to this, rad, lose nothing in the pieces: 2^20 quarter turns and more.
const FARTHEST: f64 = 1e6;
/// Adding it rounds to a whole number, which then stands in the last bits: 3 · 2^51.
const ROUNDS: f64 = 6_755_399_441_055_744.0;

const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_4e-8,
    1.589_690_995_211_55e-10,
];
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_4e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Returns the sines and the cosines of angles, rad.
#[expect(clippy::inline_always, reason = "it is built again for each kind of processor")]
#[inline(always)]
pub(super) fn sin_cos(angles: &[f64; LANES]) -> ([f64; LANES], [f64; LANES]) {
    let (mut sines, mut cosines) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        (sines[i], cosines[i]) = one(angles[i]);
    }
    if angles.iter().any(|angle| angle.abs() > FARTHEST) {
        for i in 0..LANES {
            (sines[i], cosines[i]) = angles[i].sin_cos();
        }
    }
    (sines, cosines)
}

#[expect(
    clippy::inline_always,
    reason = "the loop over the lanes becomes vectors only with it inside"
)]
#[inline(always)]
fn one(angle: f64) -> (f64, f64) {
    let shifted = angle * FRAC_2_PI + ROUNDS;
    let quarter = shifted.to_bits();
    let turns = shifted - ROUNDS;
    let x = ((angle - turns * PIECES[0]) - turns * PIECES[1]) - turns * PIECES[2];
    let z = x * x;
    let [s1, s2, s3, s4, s5, s6] = SINE;
    let [c1, c2, c3, c4, c5, c6] = COSINE;
    let sin = x + z * x * (s1 + z * (s2 + z * (s3 + z * (s4 + z * (s5 + z * s6)))));
    let bend = z * (c1 + z * (c2 + z * (c3 + z * (c4 + z * (c5 + z * c6)))));
    let half = 0.5 * z;
    let near = 1.0 - half;
    let cos = near + (((1.0 - near) - half) + z * bend);
    // In odd quarters they change places; the sine is negative in the last two, the cosine in the middle two.
    let swap = 0_u64.wrapping_sub(quarter & 1);
    let (a, b) = (sin.to_bits(), cos.to_bits());
    let (s, c) = ((a & !swap) | (b & swap), (b & !swap) | (a & swap));
    let (s, c) = (s ^ ((quarter & 2) << 62), c ^ ((quarter.wrapping_add(1) & 2) << 62));
    (f64::from_bits(s), f64::from_bits(c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_agree_with_the_standard_library_to_the_last_place() {
        let mut angle = -1.1e5;
        let mut worst = 0.0_f64;
        while angle < 1.1e5 {
            let angles = std::array::from_fn(|lane| angle / f64::from(1_u32 << (2 * lane)));
            let (sines, cosines) = sin_cos(&angles);
            for i in 0..LANES {
                let (sin, cos) = angles[i].sin_cos();
                worst = worst.max((sines[i] - sin).abs()).max((cosines[i] - cos).abs());
            }
            angle += 2.7;
        }
        // Half a unit of the last place of 1 each.
        assert!(worst < 2.3e-16, "{worst}");
        assert_eq!(sin_cos(&[0.0; LANES]), ([0.0; LANES], [1.0; LANES]));
        let far = 1e9_f64;
        assert_eq!(sin_cos(&[far; LANES]), ([far.sin(); LANES], [far.cos(); LANES]));
        assert!(sin_cos(&[f64::NAN; LANES]).0[0].is_nan());
    }
}
