//! Smooth noise: what wood and linoleum look like at a place, from a hash of it. Nothing here is random.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use wide::f32x4;

/// Smooth value noise on the unit grid, 0 to 1 (Perlin's interpolation of hashed corners).
#[inline]
pub(super) fn noise(x: f64, y: f64) -> f64 {
    // A cast is quicker than `floor`, which is a call on processors of which no more than the least is asked.
    let down = |x: f64| {
        let cut = x as i64;
        cut - i64::from(cut as f64 > x)
    };
    let (i, j) = (down(x), down(y));
    let (fx, fy) = (x - i as f64, y - j as f64);
    let corner = |di: i64, dj: i64| f64::from(hashed(i + di, j + dj));
    let (sx, sy) = (fx * fx * (3.0 - 2.0 * fx), fy * fy * (3.0 - 2.0 * fy));
    (corner(0, 0) * (1.0 - sx) + corner(1, 0) * sx) * (1.0 - sy)
        + (corner(0, 1) * (1.0 - sx) + corner(1, 1) * sx) * sy
}

/// As [`noise`] at four places, in single precision.
#[inline(always)]
pub(super) fn noise_four(x: f32x4, y: f32x4) -> f32x4 {
    let down = |x: f32x4| {
        let cut = f32x4::from_i32x4(x.fast_trunc_int());
        cut - (cut.simd_gt(x) & f32x4::splat(1.0))
    };
    let (i, j) = (down(x), down(y));
    let smooth = |t: f32x4| t * t * (f32x4::splat(3.0) - t - t);
    let (sx, sy) = (smooth(x - i), smooth(y - j));
    let (i, j) = (i.to_array(), j.to_array());
    let corners = |k: usize| {
        let (i, j) = (i[k] as i64, j[k] as i64);
        [hashed(i, j), hashed(i + 1, j), hashed(i, j + 1), hashed(i + 1, j + 1)]
    };
    // Beside each other places are nearly always between the same corners.
    let first = corners(0);
    let mut between = [first; 4];
    for k in 1..4 {
        if i[k].to_bits() != i[0].to_bits() || j[k].to_bits() != j[0].to_bits() {
            between[k] = corners(k);
        }
    }
    let [a, b, c, d] = f32x4::transpose(between.map(f32x4::from));
    let (near, far) = (a + (b - a) * sx, c + (d - c) * sx);
    near + (far - near) * sy
}

/// Returns the number of a corner of the grid, 0 to 1: 24 digits, which single precision holds.
#[inline]
fn hashed(i: i64, j: i64) -> f32 {
    let mut h = (i.wrapping_mul(0x9E37_79B1) ^ j.wrapping_mul(0x85EB_CA77)) as u64;
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D_7F4A_7C15);
    h = (h ^ (h >> 31)).wrapping_mul(0x9FB2_1C65_1E98_DF25);
    (h >> 40) as f32 / (1_u32 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_places_have_the_noise_of_each() {
        for k in 0..2000 {
            let a = f64::from(k) * 0.618;
            let places: [[f64; 2]; 4] = std::array::from_fn(|lane| {
                let apart = if k % 2 == 0 { 0.05 } else { 3.0 } * lane as f64;
                [30.0 * a.sin() + apart, 25.0 * (1.7 * a).cos() - 0.5 * apart]
            });
            let at = |axis: usize| f32x4::from(places.map(|place| place[axis] as f32));
            let four = noise_four(at(0), at(1)).to_array();
            for (four, place) in four.into_iter().zip(places) {
                let one = noise(place[0], place[1]);
                assert!((f64::from(four) - one).abs() < 2e-5, "{place:?}: {four} {one}");
                assert!((0.0..=1.0).contains(&one));
            }
        }
    }
}
