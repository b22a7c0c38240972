//! Pictures as numbers: CIELAB planes, smoothing, edge tensors at several scales, noise.
//!
//! Everything downstream measures colour differences in CIELAB units, where 1 is about the smallest
//! difference a person sees, so one threshold serves light and dark, grey and coloured pictures. Nothing
//! here knows of objects or cameras.
//!
//! Source: CIE 15 (CIELAB, D65); Di Zenzo, "A note on the gradient of a multi-image", 1986 (the tensor);
//! Immerkær, "Fast noise variance estimation", 1996.

#![expect(clippy::cast_possible_wrap, reason = "a picture has far fewer than 2^63 pixels")]

use std::sync::LazyLock;

use image::RgbImage;
use nalgebra::Vector2;
use rayon::prelude::*;

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
        let radius = (2.5 * sigma).ceil() as i64;
        let mut kernel: Vec<f32> =
            (-radius..=radius).map(|i| (-0.5 * (i as f32 / sigma).powi(2)).exp()).collect();
        let sum: f32 = kernel.iter().sum();
        for k in &mut kernel {
            *k /= sum;
        }
        let (w, h) = (self.width, self.height);
        let r = radius as usize;
        let mut across = vec![0.0_f32; w * h];
        let mut row = vec![0.0_f32; w + 2 * r];
        for y in 0..h {
            let source = &self.data[y * w..(y + 1) * w];
            row[..r].fill(source[0]);
            row[r..r + w].copy_from_slice(source);
            row[r + w..].fill(source[w - 1]);
            let out = &mut across[y * w..(y + 1) * w];
            for (k, weight) in kernel.iter().enumerate() {
                add(out, &row[k..k + w], *weight);
            }
        }
        let mut data = vec![0.0_f32; w * h];
        for y in 0..h {
            let out = &mut data[y * w..(y + 1) * w];
            for (k, weight) in kernel.iter().enumerate() {
                let from = (y as i64 + k as i64 - radius).clamp(0, h as i64 - 1) as usize;
                add(out, &across[from * w..(from + 1) * w], *weight);
            }
        }
        Self { width: w, height: h, data }
    }

    /// Returns the plane at half size, each pixel the mean of four.
    #[must_use]
    pub fn halved(&self) -> Self {
        let (w, h) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let mut half = Self::zeros(w, h);
        for y in 0..h {
            for x in 0..w {
                let (a, b) = (2 * x as i64, 2 * y as i64);
                half.data[y * w + x] = 0.25
                    * (self.at(a, b)
                        + self.at(a + 1, b)
                        + self.at(a, b + 1)
                        + self.at(a + 1, b + 1));
            }
        }
        half
    }
}

/// A place between four pixels of planes of one size.
#[derive(Debug, Clone, Copy)]
struct Between {
    /// Top left, top right, bottom left, bottom right.
    at: [usize; 4],
    /// How far it is to the right and down, 0 to 1.
    far: [f32; 2],
}

impl Between {
    #[inline]
    fn pixels(of: &Plane, u: f64, v: f64) -> Self {
        let (x, y) = (u.floor(), v.floor());
        let clamped = |at: i64, n: usize| at.clamp(0, n as i64 - 1) as usize;
        let (left, right) = (clamped(x as i64, of.width), clamped(x as i64 + 1, of.width));
        let (top, bottom) = (clamped(y as i64, of.height), clamped(y as i64 + 1, of.height));
        let row = |y: usize| y * of.width;
        Self {
            at: [row(top) + left, row(top) + right, row(bottom) + left, row(bottom) + right],
            far: [(u - x) as f32, (v - y) as f32],
        }
    }

    #[inline]
    fn of(&self, plane: &Plane) -> f32 {
        let ([a, b, c, d], [right, down]) = (self.at, self.far);
        let top = plane.data[a] * (1.0 - right) + plane.data[b] * right;
        let bottom = plane.data[c] * (1.0 - right) + plane.data[d] * right;
        top * (1.0 - down) + bottom * down
    }
}

/// Makes three things of three, on as many processors as there are.
fn each<A: Send, B: Send>(from: [A; 3], make: impl Fn(A) -> B + Sync) -> [B; 3] {
    let [a, b, c] = from;
    let (a, (b, c)) = rayon::join(|| make(a), || rayon::join(|| make(b), || make(c)));
    [a, b, c]
}

/// Adds a row times a weight: plain indices are several at once in every profile.
#[inline]
fn add(sum: &mut [f32], row: &[f32], weight: f32) {
    let n = sum.len().min(row.len());
    let (sum, row) = (&mut sum[..n], &row[..n]);
    for x in 0..n {
        sum[x] += weight * row[x];
    }
}

/// Weights of red, green and blue in grey: Rec. ITU-R BT.601, §2.5.1.
pub(super) const GREY: [f64; 3] = [0.299, 0.587, 0.114];
/// What turns a median of absolute deviations into a standard deviation: `1 / Φ⁻¹(3/4)` (Rousseeuw and Croux,
/// "Alternatives to the median absolute deviation", JASA 1993).
pub(super) const ROBUST: f64 = 1.4826;
/// What keeps the chromaticity of black from being noise, in linear light from 0 to 3. Chosen: with half of it the
/// noise of an 8-bit zero (0.0003 a step) makes a colour of shadows, with twice as much a dark blue thing turns grey.
pub(super) const BLACK: f32 = 0.01;

/// Returns the median of some values, 0 of none; the order is lost.
pub(super) fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let mid = values.len() / 2;
    *values.select_nth_unstable_by(mid, f64::total_cmp).1
}

/// Returns linear light (0 to 1) of an 8-bit sRGB value, from a table: a picture asks three million times.
pub(super) fn linear(value: u8) -> f32 {
    static TABLE: LazyLock<[f32; 256]> = LazyLock::new(|| {
        std::array::from_fn(|value| {
            let c = value as f32 / 255.0;
            if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        })
    });
    TABLE[usize::from(value)]
}

/// Returns CIELAB (D65) of linear sRGB light.
fn lab_of_linear([r, g, b]: [f32; 3]) -> [f32; 3] {
    let f = |t: f32| if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 };
    let x = f((0.412_456 * r + 0.357_576 * g + 0.180_438 * b) / 0.950_47);
    let y = f(0.212_673 * r + 0.715_152 * g + 0.072_175 * b);
    let z = f((0.019_334 * r + 0.119_192 * g + 0.950_304 * b) / 1.088_83);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Returns CIELAB (D65) of an sRGB colour.
pub fn lab(colour: [u8; 3]) -> [f32; 3] {
    lab_of_linear(colour.map(linear))
}

/// Edge strengths at one scale: the structure tensor of the three channels, without smoothing of its own.
#[derive(Debug, Clone)]
pub struct Level {
    /// Full-size pixels per pixel of this level.
    pub scale: f64,
    width: usize,
    height: usize,
    /// The tensor's `xx`, `xy`, `yy` of each pixel, (CIELAB/px)², px of this level: side by side, as they are asked for.
    tensor: Vec<[f32; 3]>,
}

impl Level {
    fn new(planes: &[Plane; 3], scale: f64, spread: f32) -> Self {
        let (w, h) = (planes[0].width, planes[0].height);
        let mut tensor = [Plane::zeros(w, h), Plane::zeros(w, h), Plane::zeros(w, h)];
        for plane in planes {
            for y in 1..h.saturating_sub(1) {
                for x in 1..w.saturating_sub(1) {
                    let at = y * w + x;
                    let gx = 0.5 * (plane.data[at + 1] - plane.data[at - 1]);
                    let gy = 0.5 * (plane.data[at + w] - plane.data[at - w]);
                    tensor[0].data[at] += gx * gx;
                    tensor[1].data[at] += gx * gy;
                    tensor[2].data[at] += gy * gy;
                }
            }
        }
        if spread > 0.0 {
            tensor = tensor.map(|plane| plane.blurred(spread));
        }
        let [xx, xy, yy] = &tensor;
        let tensor = (0..w * h).map(|at| [xx.data[at], xy.data[at], yy.data[at]]).collect();
        Self { scale, width: w, height: h, tensor }
    }

    /// Returns how strong an edge with this unit normal is at a full-size place, CIELAB/px of this level.
    ///
    /// What points elsewhere counts against: `nᵀTn / √(tr T)` is the gradient times the square of its
    /// cosine with the normal, so texture scores less than a line of equal strength.
    #[inline]
    pub fn edge(&self, u: f64, v: f64, normal: Vector2<f64>) -> f64 {
        let place = |at: f64, n: usize| {
            (((at + 0.5) / self.scale - 0.5).round() as i64).clamp(0, n as i64 - 1) as usize
        };
        let [xx, xy, yy] = self.tensor[place(v, self.height) * self.width + place(u, self.width)];
        let (xx, xy, yy) = (f64::from(xx), f64::from(xy), f64::from(yy));
        let along =
            normal.x * normal.x * xx + 2.0 * normal.x * normal.y * xy + normal.y * normal.y * yy;
        along.max(0.0) / ((xx + yy).sqrt() + 1e-6)
    }
}

/// Pixels of the picture to one of its quarter size.
pub const QUARTER: f64 = 4.0;

/// A picture prepared for looking: CIELAB planes, edges at three scales, noise.
#[derive(Debug, Clone)]
pub struct Picture {
    /// Lightness, green–red, blue–yellow, smoothed by 0.8 px.
    pub lab: [Plane; 3],
    /// As [`Self::lab`], a quarter of the size.
    pub small: [Plane; 3],
    /// Chromaticity `r/(r+g+b)` and `b/(r+g+b)` of linear light at a quarter of the size.
    pub chromaticity: [Plane; 2],
    /// Edges at full, half and a quarter of the size.
    pub levels: [Level; 3],
    /// Standard deviation of the lightness noise before smoothing, CIELAB.
    pub noise: f64,
    /// Whether the picture has no colour at all, so that colours say nothing.
    pub is_grey: bool,
}

impl Picture {
    /// Returns the colour at a place in px, CIELAB; outside, the border's.
    #[inline]
    pub fn lab_at(&self, u: f64, v: f64) -> [f32; 3] {
        let between = Between::pixels(&self.lab[0], u, v);
        [between.of(&self.lab[0]), between.of(&self.lab[1]), between.of(&self.lab[2])]
    }

    /// Prepares a picture; costs about a tenth of a second per megapixel.
    pub fn new(image: &RgbImage) -> Self {
        let (w, h) = (image.width() as usize, image.height() as usize);
        let lut: Vec<f32> = (0..=255).map(linear).collect();
        let mut both = vec![[0.0_f32; 6]; w * h];
        both.par_chunks_mut(w.max(1)).zip(image.as_raw().par_chunks(3 * w.max(1))).for_each(
            |(row, bytes)| {
                for (to, rgb) in row.iter_mut().zip(bytes.chunks_exact(3)) {
                    let light = [0, 1, 2].map(|c| lut[usize::from(rgb[c])]);
                    let [l, a, b] = lab_of_linear(light);
                    *to = [l, a, b, light[0], light[1], light[2]];
                }
            },
        );
        let plane = |c: usize| {
            let data = both.iter().map(|both| both[c]).collect();
            Plane { width: w, height: h, data }
        };
        let is_grey = image.pixels().all(|p| {
            let [r, g, b] = p.0;
            r.abs_diff(g) < 3 && b.abs_diff(g) < 3
        });
        let raw = each([0, 1, 2], plane);
        let noise = noise_of(&raw[0]);
        let lab = each([0, 1, 2], |c: usize| raw[c].blurred(0.8));
        let half = [0, 1, 2].map(|c| lab[c].halved());
        let small = [0, 1, 2].map(|c| half[c].halved());
        let levels = each([(&lab, 1.0, 0.7), (&half, 2.0, 0.8), (&small, QUARTER, 1.2)], |level| {
            let (planes, scale, spread): (&[Plane; 3], f64, f32) = level;
            Level::new(planes, scale, spread)
        });
        let light = [3, 4, 5].map(plane);
        let light = light.map(|plane| plane.halved().halved());
        let mut chromaticity = [
            Plane::zeros(small[0].width, small[0].height),
            Plane::zeros(small[0].width, small[0].height),
        ];
        for at in 0..chromaticity[0].data.len() {
            let [r, g, b] = [0, 1, 2].map(|c| light[c].data[at]);
            // A little white keeps the ratio of near-black pixels from being noise.
            let sum = r + g + b + BLACK;
            chromaticity[0].data[at] = (r + BLACK / 3.0) / sum;
            chromaticity[1].data[at] = (b + BLACK / 3.0) / sum;
        }
        Self { lab, small, chromaticity, levels, noise, is_grey }
    }

    /// Width and height, px.
    pub fn size(&self) -> (usize, usize) {
        (self.lab[0].width, self.lab[0].height)
    }
}

/// Returns the standard deviation of the noise, robust against edges: the median absolute second difference.
fn noise_of(plane: &Plane) -> f64 {
    let mut seen = Vec::new();
    for y in (1..plane.height.saturating_sub(1)).step_by(3) {
        for x in (1..plane.width.saturating_sub(1)).step_by(3) {
            let (x, y) = (x as i64, y as i64);
            let corners = plane.at(x - 1, y - 1)
                + plane.at(x + 1, y - 1)
                + plane.at(x - 1, y + 1)
                + plane.at(x + 1, y + 1);
            let sides =
                plane.at(x - 1, y) + plane.at(x + 1, y) + plane.at(x, y - 1) + plane.at(x, y + 1);
            seen.push(f64::from((corners - 2.0 * sides + 4.0 * plane.at(x, y)).abs()));
        }
    }
    // The mask's norm is 6; 0.6745 turns a median into a standard deviation. Quantisation to 8 bit alone
    // is about 0.1 CIELAB, and a noiseless picture is never better than that.
    (median(&mut seen) / (6.0 * 0.6745)).max(0.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colours_have_their_published_lab() {
        // Bruce Lindbloom's calculator, D65.
        for (rgb, expected) in [
            ([255, 255, 255], [100.0, 0.0, 0.0]),
            ([255, 0, 0], [53.24, 80.09, 67.20]),
            ([0, 0, 255], [32.30, 79.19, -107.86]),
        ] {
            let got = lab(rgb);
            for c in 0..3 {
                assert!((got[c] - expected[c]).abs() < 0.1, "{rgb:?}: {got:?} not {expected:?}");
            }
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

    #[test]
    fn an_edge_answers_to_its_normal_only() {
        let image = RgbImage::from_fn(80, 80, |x, _| {
            image::Rgb(if x < 40 { [60, 60, 60] } else { [180, 180, 180] })
        });
        let picture = Picture::new(&image);
        let level = &picture.levels[0];
        let across = level.edge(39.5, 40.0, Vector2::new(1.0, 0.0));
        let along = level.edge(39.5, 40.0, Vector2::new(0.0, 1.0));
        assert!(across > 10.0 && along < 1e-3, "{across} {along}");
    }
}
