//! One channel of a picture, and what is asked of it without a colour: values between pixels, blurs, halves. What is made of three
//! of them is [`super::picture`]'s.

#![expect(clippy::cast_possible_wrap, reason = "a picture has far fewer than 2^63 pixels")]

use image::RgbImage;
use rayon::prelude::*;

use super::picture::GREY;

/// One channel of a picture, row by row.
#[derive(Debug, Clone)]
pub struct Plane {
    /// Width, px.
    pub width: usize,
    /// Height, px.
    pub height: usize,
    /// `width × height` values.
    pub data: Vec<f32>,
}

impl Plane {
    /// Returns a plane of zeros.
    pub fn zeros(width: usize, height: usize) -> Self {
        Self { width, height, data: vec![0.0; width * height] }
    }

    /// Returns the grey of a picture, 0 to 255.
    pub fn grey(image: &RgbImage) -> Self {
        let data = image
            .pixels()
            .map(|p| (0..3).map(|c| GREY[c] as f32 * f32::from(p.0[c])).sum())
            .collect();
        Self { width: image.width() as usize, height: image.height() as usize, data }
    }

    /// Returns the value of a pixel; coordinates outside are moved to the border.
    #[inline]
    pub fn at(&self, x: i64, y: i64) -> f32 {
        let x = x.clamp(0, self.width as i64 - 1) as usize;
        let y = y.clamp(0, self.height as i64 - 1) as usize;
        self.data[y * self.width + x]
    }

    /// Returns the bilinear value at a place in px; outside, the border's.
    #[inline]
    pub fn sample(&self, u: f64, v: f64) -> f32 {
        Between::pixels(self, u, v).of(self)
    }

    /// Returns the plane blurred by a Gaussian of `sigma` px.
    #[must_use]
    pub fn blurred(&self, sigma: f32) -> Self {
        let size = (self.width, self.height);
        let row = |y: usize, row: &mut [f32]| row.copy_from_slice(self.row(y));
        let data = blurred_rows(size, sigma, row, |[row], out| out.copy_from_slice(row));
        Self { width: self.width, height: self.height, data }
    }

    /// Returns the plane at half size, each pixel the mean of four.
    #[must_use]
    pub fn halved(&self) -> Self {
        let mut half = Self::zeros((self.width / 2).max(1), (self.height / 2).max(1));
        let w = half.width;
        for (y, out) in half.data.chunks_exact_mut(w).enumerate() {
            let [upper, lower] =
                [2 * y, 2 * y + 1].map(|y| self.row(y.min(self.height.saturating_sub(1))));
            if self.width < 2 {
                out[0] = 0.25 * (upper[0] + upper[0] + lower[0] + lower[0]);
                continue;
            }
            let pairs = upper.chunks_exact(2).zip(lower.chunks_exact(2));
            for (out, (above, below)) in out.iter_mut().zip(pairs) {
                *out = 0.25 * (above[0] + above[1] + below[0] + below[1]);
            }
        }
        half
    }

    pub(super) fn row(&self, y: usize) -> &[f32] {
        &self.data[y * self.width..(y + 1) * self.width]
    }
}

/// Rows that are blurred together: enough that those around them, which are made once more, are a tenth.
const BAND: usize = 40;

/// Blurs `N` planes of one size by a Gaussian of `sigma` px, and returns what is made of their rows. `make` writes a row of
/// all planes one after another, `put` turns one that is blurred into a row of the result.
///
/// Only the rows that a kernel spans are kept: planes in between would be some ten megabytes each.
pub(super) fn blurred_rows<T: Copy + Default + Send, const N: usize>(
    (w, h): (usize, usize),
    sigma: f32,
    make: impl Fn(usize, &mut [f32]) + Sync,
    put: impl Fn([&[f32]; N], &mut [T]) + Sync,
) -> Vec<T> {
    let kernel = gaussian(sigma);
    let (span, r) = (kernel.len(), kernel.len() / 2);
    let mut blurred = vec![T::default(); w * h];
    let bands = blurred.par_chunks_mut((BAND * w).max(1)).enumerate();
    bands.for_each(|(band, out)| {
        let mut across = vec![0.0_f32; span * N * w];
        let (mut made, mut padded) = (vec![0.0_f32; N * w], vec![0.0_f32; w + 2 * r]);
        let mut sum = vec![0.0_f32; N * w];
        let first = band * BAND;
        let mut next = first.saturating_sub(r);
        for (y, out) in (first..).zip(out.chunks_exact_mut(w)) {
            while next <= (y + r).min(h - 1) {
                make(next, &mut made);
                let at = next % span * N * w;
                let rows = across[at..at + N * w].chunks_exact_mut(w);
                for (row, made) in rows.zip(made.chunks_exact(w)) {
                    padded[..r].fill(made[0]);
                    padded[r..r + w].copy_from_slice(made);
                    padded[r + w..].fill(made[w - 1]);
                    weighted(row, &kernel, |k| &padded[k..k + w]);
                }
                next += 1;
            }
            weighted(&mut sum, &kernel, |k| {
                let at = (y + k).saturating_sub(r).min(h - 1) % span * N * w;
                &across[at..at + N * w]
            });
            put(std::array::from_fn(|n| &sum[n * w..(n + 1) * w]), out);
        }
    });
    blurred
}

/// Returns the weights of a Gaussian of `sigma` px, out to two and a half of them.
fn gaussian(sigma: f32) -> Vec<f32> {
    let radius = (2.5 * sigma).ceil() as i64;
    let mut kernel: Vec<f32> =
        (-radius..=radius).map(|i| (-0.5 * (i as f32 / sigma).powi(2)).exp()).collect();
    let sum: f32 = kernel.iter().sum();
    for k in &mut kernel {
        *k /= sum;
    }
    kernel
}

/// Writes the sum of rows times weights, the `k`-th of which is that of `row(k)`: plain indices are several at once in every
/// profile.
fn weighted<'r>(sum: &mut [f32], weights: &[f32], row: impl Fn(usize) -> &'r [f32]) {
    let n = sum.len();
    if let [a, b, c, d, e] = *weights {
        // What nearly every blur here has: all at once, in the same order.
        let [ra, rb, rc, rd, re] = [0, 1, 2, 3, 4].map(|k| &row(k)[..n]);
        for x in 0..n {
            sum[x] = 0.0 + a * ra[x] + b * rb[x] + c * rc[x] + d * rd[x] + e * re[x];
        }
        return;
    }
    sum.fill(0.0);
    for (k, weight) in weights.iter().enumerate() {
        let row = &row(k)[..n];
        for x in 0..n {
            sum[x] += weight * row[x];
        }
    }
}

/// Returns the pixel that a coordinate is nearest to, as `round` does from zero on; below, where there is none, some number
/// below 0, and 0 down to half a pixel before the first. The function itself is a call where a processor of 2008 is not taken
/// for granted.
#[inline]
pub(super) fn nearest(at: f64) -> i64 {
    let whole = at as i64;
    if at <= -0.5 { whole.saturating_sub(1) } else { whole + i64::from(at - whole as f64 >= 0.5) }
}

/// Returns the last pixel before a coordinate, as `floor` does.
#[inline]
fn below(at: f64) -> i64 {
    let whole = at as i64;
    whole.saturating_sub(i64::from(at < whole as f64))
}

/// A place between four pixels of planes of one size.
#[derive(Debug, Clone, Copy)]
pub(super) struct Between {
    /// Top left, top right, bottom left, bottom right.
    at: [usize; 4],
    /// How far it is to the right and down, 0 to 1.
    far: [f32; 2],
}

impl Between {
    #[inline]
    pub(super) fn pixels(of: &Plane, u: f64, v: f64) -> Self {
        let (x, y) = (below(u), below(v));
        let clamped = |at: i64, n: usize| at.clamp(0, n as i64 - 1) as usize;
        let (left, right) = (clamped(x, of.width), clamped(x + 1, of.width));
        let (top, bottom) = (clamped(y, of.height), clamped(y + 1, of.height));
        let row = |y: usize| y * of.width;
        Self {
            at: [row(top) + left, row(top) + right, row(bottom) + left, row(bottom) + right],
            far: [(u - x as f64) as f32, (v - y as f64) as f32],
        }
    }

    #[inline]
    pub(super) fn of(&self, plane: &Plane) -> f32 {
        let ([a, b, c, d], [right, down]) = (self.at, self.far);
        let top = plane.data[a] * (1.0 - right) + plane.data[b] * right;
        let bottom = plane.data[c] * (1.0 - right) + plane.data[d] * right;
        top * (1.0 - down) + bottom * down
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_pixel_is_that_of_rounding() {
        for at in [0.0, 0.3, 0.5, 0.499_999_999_999_999_94, 1.5, 2.5, 700.5, 1279.49, 1e9] {
            assert_eq!(nearest(at), f64::round(at) as i64, "{at}");
        }
        // Less than half below nothing is the first pixel still.
        assert_eq!(nearest(-0.499), 0);
        assert!(nearest(-0.5) < 0 && nearest(-1.2) < 0);
        for at in [-2.5, -2.0, -0.1, 0.0, 0.9, 3.0, 3.7] {
            assert_eq!(below(at), f64::floor(at) as i64, "{at}");
        }
    }

    #[test]
    fn blurring_keeps_the_mean_and_a_ramp() {
        let mut plane = Plane::zeros(40, 30);
        for y in 0..30 {
            for x in 0..40 {
                plane.data[y * 40 + x] = x as f32 + 2.0 * y as f32;
            }
        }
        let blurred = plane.blurred(1.5);
        assert!((blurred.at(20, 15) - 50.0).abs() < 1e-3);
        assert!((plane.sample(3.25, 4.5) - 12.25).abs() < 1e-4);
    }
}
