//! What a camera's sensor makes of light: blur, vignetting, colour gains, shot and read noise, eight bits.
//!
//! The noise of a pixel is a hash of the photo's number and the pixel's place, so a photo is the same on any
//! number of threads and two photos of the same scene differ as two photos do.
//!
//! Source: EMVA 1288 for the noise (variance = read² + signal / full well).

use std::borrow::Cow;
use std::ops::Range;

use image::RgbImage;
use rayon::prelude::*;

use super::truth::Exposure;
use crate::motion::widest;
use crate::twin::render::develop;
use crate::world::Window;

/// How far blur reaches, px.
pub(super) fn reach(exposure: &Exposure) -> u32 {
    (3.0 * exposure.blur).ceil() as u32
}

/// How many rows are exposed at once: what is blurred of them stays at hand, and a fifth of it is blurred twice.
const ROWS: usize = 32;

/// Returns the photo that a sensor takes of `light`, row by row, which falls on a part of the whole; `key` chooses the noise.
pub(super) fn expose(
    light: &[[f32; 3]],
    exposure: &Exposure,
    key: u64,
    (part, whole): (&Window, &Window),
) -> RgbImage {
    let (width, height) = (part.width as usize, part.height as usize);
    let blur = Blur::new(exposure.blur);
    let sensor = Sensor::new(exposure, key, (part, whole));
    let mut bytes = vec![0; width * height * 3];
    bytes.par_chunks_mut((width * 3 * ROWS).max(1)).enumerate().for_each(|(band, bytes)| {
        let first = band * ROWS;
        let rows = first..first + bytes.len() / (width * 3);
        let mut signals = vec![0.0; width * 3];
        widest(
            #[inline(always)]
            || {
                let soft = blur.rows(light, (width, height), rows.clone());
                for ((v, light), bytes) in
                    rows.zip(soft.chunks_exact(width)).zip(bytes.chunks_exact_mut(width * 3))
                {
                    sensor.read(v + part.v as usize, light.as_flattened(), &mut signals);
                    develop(&signals, bytes);
                }
            },
        );
    });
    RgbImage::from_raw(part.width, part.height, bytes)
        .expect("three bytes were made for each of width × height pixels")
}

/// So many numbers are worked out together: each step of it is a loop of its own, which the processor does several at a time.
const BLOCK: usize = 64;

/// A sensor that is about to be read, with what of it is the same in every row: three numbers a pixel.
struct Sensor {
    /// How far right of the middle of the picture each is, squared, px², and the number of each in a row of the whole.
    off2: Vec<f64>,
    first: usize,
    gains: Vec<f64>,
    /// Numbers in a row of the whole, and the row in its middle, px.
    stride: usize,
    middle: f64,
    /// What is missing of the light a pixel off the middle, squared.
    dark: f64,
    read_variance: f64,
    full_well: f64,
    key: u64,
}

impl Sensor {
    fn new(exposure: &Exposure, key: u64, (part, whole): (&Window, &Window)) -> Self {
        let (cu, cv) = (f64::from(whole.width) / 2.0, f64::from(whole.height) / 2.0);
        let columns = (part.u..part.u + part.width).flat_map(|u| [f64::from(u) - cu; 3]);
        Self {
            off2: columns.map(|du| du * du).collect(),
            first: part.u as usize * 3,
            gains: exposure.gain.repeat(part.width as usize),
            stride: whole.width as usize * 3,
            middle: cv,
            dark: exposure.vignetting / (cu * cu + cv * cv).max(1.0),
            read_variance: exposure.read_noise * exposure.read_noise,
            full_well: exposure.full_well,
            key,
        }
    }

    /// Reads row `v` of the whole, on which `light` falls: as light that would make such signals without noise.
    #[expect(clippy::inline_always, reason = "it is built for each kind of processor")]
    #[inline(always)]
    fn read(&self, v: usize, light: &[f32], read: &mut [f32]) {
        let first = (v * self.stride + self.first) as u64;
        let down = v as f64 - self.middle;
        // A film has none, and is drawn often.
        let is_noisy = self.read_variance > 0.0 || self.full_well < f64::INFINITY;
        let (mut signals, mut noises) = ([0.0; BLOCK], [0.0; BLOCK]);
        let columns = self.off2.chunks(BLOCK).zip(self.gains.chunks(BLOCK));
        let blocks = columns.zip(light.chunks(BLOCK)).zip(read.chunks_mut(BLOCK));
        for (block, (((off2, gains), light), read)) in blocks.enumerate() {
            for (k, signal) in signals.iter_mut().enumerate().take(light.len()) {
                let fall = 1.0 - self.dark * (off2[k] + down * down);
                *signal = f64::from(light[k]) * fall * gains[k];
            }
            if is_noisy {
                let first = first + (block * BLOCK) as u64;
                for (k, noise) in noises.iter_mut().enumerate() {
                    *noise = self::noise(self.key, first + k as u64);
                }
                for (signal, noise) in signals.iter_mut().zip(&noises) {
                    let variance = self.read_variance + signal.max(0.0) / self.full_well;
                    *signal += variance.sqrt() * noise;
                }
            }
            for (read, signal) in read.iter_mut().zip(&signals) {
                *read = *signal as f32;
            }
        }
    }
}

/// A Gaussian that light is blurred with; at the border it repeats.
struct Blur {
    /// What each pixel counts from `reach` before on; nothing where nothing is blurred.
    weights: Vec<f32>,
    reach: usize,
}

impl Blur {
    /// Returns the Gaussian of `sigma` px.
    fn new(sigma: f64) -> Self {
        if sigma < 1e-3 {
            return Self { weights: Vec::new(), reach: 0 };
        }
        let reach = (3.0 * sigma).ceil() as usize;
        let weights: Vec<f32> = (0..=2 * reach)
            .map(|k| (-0.5 * ((k as f64 - reach as f64) / sigma).powi(2)).exp() as f32)
            .collect();
        let total: f32 = weights.iter().sum();
        Self { weights: weights.iter().map(|weight| weight / total).collect(), reach }
    }

    /// Returns some rows of a picture blurred, along rows and then columns.
    #[expect(clippy::inline_always, reason = "it is built for each kind of processor")]
    #[inline(always)]
    fn rows<'l>(
        &self,
        light: &'l [[f32; 3]],
        (width, height): (usize, usize),
        rows: Range<usize>,
    ) -> Cow<'l, [[f32; 3]]> {
        if self.weights.is_empty() {
            return Cow::Borrowed(&light[rows.start * width..rows.end * width]);
        }
        // Whole rows are added up with a shift: no pixel is asked where it lies.
        let add = |sum: &mut [[f32; 3]], from: &[[f32; 3]], weight: f32| {
            for (sum, x) in sum.as_flattened_mut().iter_mut().zip(from.as_flattened()) {
                *sum += weight * x;
            }
        };
        let reach = self.reach;
        let (low, high) = (rows.start.saturating_sub(reach), (rows.end + reach).min(height));
        let mut across = vec![[0.0_f32; 3]; width * (high - low)];
        let mut wide = Vec::with_capacity(width + 2 * reach);
        let sums = across.chunks_exact_mut(width);
        for (sum, row) in sums.zip(light[low * width..].chunks_exact(width)) {
            wide.clear();
            wide.resize(reach, row[0]);
            wide.extend_from_slice(row);
            wide.resize(width + 2 * reach, row[width - 1]);
            for (k, &weight) in self.weights.iter().enumerate() {
                add(sum, &wide[k..k + width], weight);
            }
        }
        let mut both = vec![[0.0_f32; 3]; width * rows.len()];
        for (v, sum) in rows.zip(both.chunks_exact_mut(width)) {
            for (k, &weight) in self.weights.iter().enumerate() {
                let row = (v + k).saturating_sub(reach).min(height - 1) - low;
                add(sum, &across[row * width..(row + 1) * width], weight);
            }
        }
        Cow::Owned(both)
    }
}

/// Returns nearly normal noise of deviation 1: the sum of four even draws from one hash (Irwin and Hall).
#[inline]
pub(super) fn noise(key: u64, place: u64) -> f64 {
    // splitmix64, Steele, Lea and Flood, 2014.
    let mut z = key ^ place.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^= z >> 31;
    // Two draws at a time, then both; as what turns into a float at once.
    let two = (z & 0xFFFF_0000_FFFF) + (z >> 16 & 0xFFFF_0000_FFFF);
    let sum = (two + (two >> 32)) as i32 & 0x7_FFFF;
    (f64::from(sum) / 65535.0 - 2.0) * 3.0_f64.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_centred_and_of_deviation_one() {
        let n = 200_000;
        let draws: Vec<f64> = (0..n).map(|k| noise(7, k)).collect();
        let mean = draws.iter().sum::<f64>() / n as f64;
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / n as f64 - mean * mean;
        // Four standard errors.
        assert!(mean.abs() < 0.009 && (variance - 1.0).abs() < 0.012, "{mean} {variance}");
    }

    #[test]
    fn blur_keeps_the_light_and_its_middle() {
        let mut light = vec![[0.0_f32; 3]; 21 * 21];
        light[10 * 21 + 8] = [1.0, 2.0, 3.0];
        let soft = Blur::new(1.2).rows(&light, (21, 21), 0..21);
        let sum: f32 = soft.iter().map(|x| x[2]).sum();
        let middle: f32 =
            soft.iter().enumerate().map(|(k, x)| x[2] * (k % 21) as f32).sum::<f32>() / sum;
        assert!((sum - 3.0).abs() < 1e-4 && (middle - 8.0).abs() < 1e-4);
        assert!(soft[10 * 21 + 8][2] < 1.0);
    }
}
