//! Pictures as numbers: CIELAB planes, edge tensors at several scales, noise.
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

use super::plane::{Between, Plane, blurred_rows, nearest};

/// Makes three things of three, on as many processors as there are.
fn each<A: Send, B: Send>(from: [A; 3], make: impl Fn(A) -> B + Sync) -> [B; 3] {
    let [a, b, c] = from;
    let (a, (b, c)) = rayon::join(|| make(a), || rayon::join(|| make(b), || make(c)));
    [a, b, c]
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

/// Returns how much of D65's white there is in linear sRGB light: X, Y, Z.
#[inline]
fn of_white([r, g, b]: [f32; 3]) -> [f32; 3] {
    [
        (0.412_456 * r + 0.357_576 * g + 0.180_438 * b) / 0.950_47,
        0.212_673 * r + 0.715_152 * g + 0.072_175 * b,
        (0.019_334 * r + 0.119_192 * g + 0.950_304 * b) / 1.088_83,
    ]
}

/// Returns CIELAB's function of a share of white.
#[inline]
fn seen_of_white(t: f32) -> f32 {
    let root = cube_root(t.max(0.008));
    if t > 0.008_856 { root } else { 7.787 * t + 16.0 / 116.0 }
}

/// Returns CIELAB of that function's three values.
#[inline]
fn lab_of_seen([x, y, z]: [f32; 3]) -> [f32; 3] {
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Returns the cube root of a positive number that is neither subnormal nor infinite, rounded as well as single precision can be.
///
/// Two of Halley's steps in double precision from a third of the exponent: several at once, as a picture asks for three million.
///
/// Source: `FreeBSD`'s `s_cbrtf.c`, which is what `f32::cbrt` comes to as well.
#[inline]
fn cube_root(x: f32) -> f32 {
    /// `(127 - 127 / 3 - 0.03306235651) * 2^23`.
    const START: u32 = 709_958_130;
    let mut root = f64::from(f32::from_bits(x.to_bits() / 3 + START));
    let x = f64::from(x);
    for _ in 0..2 {
        let cube = root * root * root;
        root = root * (x + x + cube) / (x + cube + cube);
    }
    root as f32
}

/// Returns CIELAB (D65) of an sRGB colour.
pub fn lab(colour: [u8; 3]) -> [f32; 3] {
    lab_of_seen(of_white(colour.map(linear)).map(seen_of_white))
}

/// Edge strengths at one scale: the structure tensor of the three channels, without smoothing of its own.
#[derive(Debug, Clone)]
pub struct Level {
    /// Full-size pixels per pixel of this level.
    pub scale: f64,
    /// Its inverse, exact as the scale is a power of two.
    shrink: f64,
    width: usize,
    height: usize,
    /// The tensor's `xx`, `xy`, `yy` of each pixel, (CIELAB/px)², px of this level: side by side, as they are asked for.
    tensor: Vec<[f32; 3]>,
}

impl Level {
    fn new(planes: &[Plane; 3], scale: f64, spread: f32) -> Self {
        let (w, h) = (planes[0].width, planes[0].height);
        let slopes = |y: usize, tensor: &mut [f32]| {
            tensor.fill(0.0);
            if y == 0 || y + 1 >= h || w < 3 {
                return;
            }
            let n = w - 2;
            let (xx, rest) = tensor.split_at_mut(w);
            let (xy, yy) = rest.split_at_mut(w);
            let (xx, xy, yy) = (&mut xx[1..=n], &mut xy[1..=n], &mut yy[1..=n]);
            for plane in planes {
                let (here, above, below) = (plane.row(y), plane.row(y - 1), plane.row(y + 1));
                let (left, right) = (&here[..n], &here[2..]);
                let (above, below) = (&above[1..=n], &below[1..=n]);
                for x in 0..n {
                    let gx = 0.5 * (right[x] - left[x]);
                    let gy = 0.5 * (below[x] - above[x]);
                    xx[x] += gx * gx;
                    xy[x] += gx * gy;
                    yy[x] += gy * gy;
                }
            }
        };
        let beside = |[xx, xy, yy]: [&[f32]; 3], out: &mut [[f32; 3]]| {
            for (x, out) in out.iter_mut().enumerate() {
                *out = [xx[x], xy[x], yy[x]];
            }
        };
        let tensor = blurred_rows((w, h), spread, slopes, beside);
        Self { scale, shrink: 1.0 / scale, width: w, height: h, tensor }
    }

    /// Returns how strong an edge with this unit normal is at a full-size place, CIELAB/px of this level.
    ///
    /// What points elsewhere counts against: `nᵀTn / √(tr T)` is the gradient times the square of its
    /// cosine with the normal, so texture scores less than a line of equal strength.
    #[inline]
    pub fn edge(&self, u: f64, v: f64, normal: Vector2<f64>) -> f64 {
        let place = |at: f64, n: usize| {
            nearest((at + 0.5) * self.shrink - 0.5).clamp(0, n as i64 - 1) as usize
        };
        let [xx, xy, yy] = self.tensor[place(v, self.height) * self.width + place(u, self.width)];
        let (xx, xy, yy) = (f64::from(xx), f64::from(xy), f64::from(yy));
        let along =
            normal.x * normal.x * xx + 2.0 * normal.x * normal.y * xy + normal.y * normal.y * yy;
        along.max(0.0) / ((xx + yy).sqrt() + 1e-6)
    }

    /// Returns how strong the edge through a pixel of this level is, whichever way it runs, CIELAB/px of this level, and the
    /// angle of its normal, rad, between -π/2 and π/2.
    pub(super) fn strongest(&self, x: usize, y: usize) -> (f64, f64) {
        let [xx, xy, yy] = self.tensor[y * self.width + x].map(f64::from);
        let apart = (xx - yy).hypot(2.0 * xy);
        ((0.5 * (xx + yy + apart)).max(0.0).sqrt(), 0.5 * (2.0 * xy).atan2(xx - yy))
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

    /// Prepares a picture.
    pub fn new(image: &RgbImage) -> Self {
        let (w, h) = (image.width() as usize, image.height() as usize);
        let lut: [f32; 256] = std::array::from_fn(|value| linear(value as u8));
        let mut raw = [Plane::zeros(w, h), Plane::zeros(w, h), Plane::zeros(w, h)];
        let [l, a, b] = &mut raw;
        let rows = l.data.par_chunks_mut(w.max(1)).zip(a.data.par_chunks_mut(w.max(1)));
        let rows = rows.zip(b.data.par_chunks_mut(w.max(1)));
        // Three shares of white, then the roots of a row of each: several at once.
        rows.zip(image.as_raw().par_chunks(3 * w.max(1))).for_each(|(((l, a), b), bytes)| {
            for (x, rgb) in bytes.chunks_exact(3).enumerate() {
                [l[x], a[x], b[x]] = of_white([0, 1, 2].map(|c| lut[usize::from(rgb[c])]));
            }
            for row in [&mut *l, &mut *a, &mut *b] {
                for t in row {
                    *t = seen_of_white(*t);
                }
            }
            for x in 0..l.len() {
                [l[x], a[x], b[x]] = lab_of_seen([l[x], a[x], b[x]]);
            }
        });
        let is_grey = image.pixels().all(|p| {
            let [r, g, b] = p.0;
            r.abs_diff(g) < 3 && b.abs_diff(g) < 3
        });
        let noise = noise_of(&raw[0]);
        let lab = raw.map(|plane| plane.blurred(0.8));
        let (small, levels) = scaled(&lab);
        let light = each([0, 1, 2], |c: usize| light_halved(image, c, &lut).halved());
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

    /// The same picture at a quarter of its size, its noise that of sixteen pixels' mean.
    pub(super) fn quartered(&self) -> Self {
        let lab = self.small.clone();
        let (small, levels) = scaled(&lab);
        let chromaticity = [0, 1].map(|c: usize| self.chromaticity[c].halved().halved());
        let (noise, is_grey) = (self.noise / QUARTER, self.is_grey);
        Self { lab, small, chromaticity, levels, noise, is_grey }
    }

    /// Width and height, px.
    pub fn size(&self) -> (usize, usize) {
        (self.lab[0].width, self.lab[0].height)
    }
}

/// Returns planes at a quarter of their size, and the edges at full, half and a quarter of it.
fn scaled(lab: &[Plane; 3]) -> ([Plane; 3], [Level; 3]) {
    let half = each([0, 1, 2], |c: usize| lab[c].halved());
    let small = each([0, 1, 2], |c: usize| half[c].halved());
    let levels = [(lab, 1.0, 0.7), (&half, 2.0, 0.8), (&small, QUARTER, 1.2)]
        .map(|(planes, scale, spread)| Level::new(planes, scale, spread));
    (small, levels)
}

/// Returns one channel's linear light at half the size, each pixel the mean of four.
fn light_halved(image: &RgbImage, channel: usize, lut: &[f32; 256]) -> Plane {
    let (w, h) = (image.width() as usize, image.height() as usize);
    let mut half = Plane::zeros((w / 2).max(1), (h / 2).max(1));
    let width = half.width;
    for (y, out) in half.data.chunks_exact_mut(width).enumerate() {
        let [upper, lower] = [2 * y, 2 * y + 1].map(|y| {
            let at = 3 * w * y.min(h.saturating_sub(1));
            &image.as_raw()[at..at + 3 * w]
        });
        for (x, out) in out.iter_mut().enumerate() {
            let [left, right] =
                [2 * x, 2 * x + 1].map(|x| 3 * x.min(w.saturating_sub(1)) + channel);
            let [a, b, c, d] = [upper[left], upper[right], lower[left], lower[right]]
                .map(|value| lut[usize::from(value)]);
            *out = 0.25 * (a + b + c + d);
        }
    }
    half
}

/// Returns the standard deviation of the noise, robust against edges: the median absolute second difference.
fn noise_of(plane: &Plane) -> f64 {
    let mut seen = Vec::with_capacity(plane.data.len() / 9 + 1);
    for y in (1..plane.height.saturating_sub(1)).step_by(3) {
        let [above, here, below] = [y - 1, y, y + 1].map(|y| plane.row(y));
        for x in (1..plane.width.saturating_sub(1)).step_by(3) {
            let corners = above[x - 1] + above[x + 1] + below[x - 1] + below[x + 1];
            let sides = here[x - 1] + here[x + 1] + above[x] + below[x];
            seen.push(f64::from((corners - 2.0 * sides + 4.0 * here[x]).abs()));
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
    fn cube_roots_are_those_of_the_library() {
        for bits in (0.005_f32.to_bits()..2.0_f32.to_bits()).step_by(17) {
            let x = f32::from_bits(bits);
            assert_eq!(cube_root(x).to_bits(), x.cbrt().to_bits(), "{x}");
        }
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
