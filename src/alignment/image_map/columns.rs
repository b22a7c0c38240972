//! Pairs in columns, four at a time: errors, normal equations and leave-one-out errors of a map in one pass each.
//!
//! Coordinates are normalised ([`super::pairs`]); errors come out in px. The normal matrix of a projective map is put together
//! from thirty-one sums, since its blocks are products of `z = (x, y, 1)/w` with itself: with `e = p - u`, `S` the covariance of
//! an error in units of the noise and `S⁻¹ = [[a, b], [b, d]]`, the rows of the Jacobian are `(z, 0, -p_u z₂)` and
//! `(0, z, -p_v z₂)`, `z₂` the first two of `z`.

#![expect(clippy::inline_always, reason = "what is not inlined into the pass misses the registers")]

use nalgebra::{Matrix3, SMatrix, SVector, Vector2};

use crate::alignment::lanes::{Four, Job, LANES, Lanes, Wide, run};

pub(super) type Normal = SMatrix<f64, 8, 8>;
pub(super) type Gradient = SVector<f64, 8>;

/// Four pairs: twin x and y, real u and v, normalised.
type Block = [Lanes; 4];

/// Some of the pairs.
pub(in crate::alignment) struct Columns {
    n: usize,
    blocks: Vec<Block>,
}

/// What an error is measured in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    /// Pixels of the real picture to one of its normalised units.
    pub(super) real: f64,
    /// The same over that of the twin's picture where both are noisy, 0 where the twin's is exact.
    pub(super) twin: f64,
}

/// What the rows say about a map.
pub(super) struct Sums {
    /// `JᵀS⁻¹J`, both triangles, in the order of the eight free entries, px².
    pub(super) normal: Normal,
    /// `JᵀS⁻¹e`, px².
    pub(super) gradient: Gradient,
    /// `Σ eᵀS⁻¹e`, px².
    pub(super) square: f64,
}

/// Nearer to its horizon a map has no value. Normalised points have a homogeneous coordinate near 1.
const HORIZON: f64 = 1e-9;

impl Columns {
    /// Puts pairs `(u, v)` into columns.
    pub(super) fn of(pairs: impl ExactSizeIterator<Item = (Vector2<f64>, Vector2<f64>)>) -> Self {
        let n = pairs.len();
        let mut blocks = vec![[[0.0; LANES]; 4]; n.div_ceil(LANES)];
        for (i, (u, v)) in pairs.enumerate() {
            let block = &mut blocks[i / LANES];
            for (column, value) in block.iter_mut().zip([v.x, v.y, u.x, u.y]) {
                column[i % LANES] = value;
            }
        }
        Self { n, blocks }
    }

    /// Appends the squared error of each pair, whitened, px²; infinite beyond the map's horizon.
    pub(super) fn errors2(&self, m: &Matrix3<f64>, scale: Scale, out: &mut Vec<f64>) {
        let from = out.len();
        out.resize(from + self.blocks.len() * LANES, 0.0);
        let (lanes, _) = out[from..].as_chunks_mut::<LANES>();
        run(Errors { m, scale, blocks: &self.blocks, out: lanes });
        out.truncate(from + self.n);
    }

    /// Returns the normal equations of weighted pairs, a weight each; `None` where one that counts is beyond the horizon.
    pub(super) fn sums(&self, m: &Matrix3<f64>, scale: Scale, weights: &[f64]) -> Option<Sums> {
        let (whole, rest) = weights.as_chunks::<LANES>();
        let mut last = [0.0; LANES];
        last[..rest.len()].copy_from_slice(rest);
        let last = (!rest.is_empty()).then_some(&last);
        let found =
            run(Accumulate { m, scale, blocks: &self.blocks, weights: whole.iter().chain(last) });
        assembled(&found, scale)
    }

    /// Writes the squared error of each pair as predicted from all others, px² of the real picture, to first order (PRESS):
    /// `(I - L S⁻¹)⁻¹ e`, `L = J C Jᵀ` with `C` the covariance of the eight entries at a noise of 1 px. What nothing else
    /// holds comes out infinite.
    pub(super) fn left_out(&self, m: &Matrix3<f64>, scale: Scale, c: &Normal) -> Vec<f64> {
        let mut out = vec![0.0; self.blocks.len() * LANES];
        let (lanes, _) = out.as_chunks_mut::<LANES>();
        run(LeaveOut { m, scale, c, blocks: &self.blocks, out: lanes });
        out.truncate(self.n);
        out
    }
}

/// A map before four points, and what follows from where it puts them.
struct Lens<S: Wide> {
    m: [Four<S>; 9],
    scale: Scale,
    real: Four<S>,
    twin: Four<S>,
    one: Four<S>,
    zero: Four<S>,
    horizon: Four<S>,
}

/// Four points under a map.
struct Seen<S: Wide> {
    x: Four<S>,
    y: Four<S>,
    /// Reciprocal of the homogeneous coordinate; 1 beyond the horizon, where it is less than [`HORIZON`].
    inverse: Four<S>,
    w: Four<S>,
    /// Where the map puts them, normalised, and how far that is off, px.
    p: [Four<S>; 2],
    e: [Four<S>; 2],
    /// `S⁻¹`: uu, uv, vv.
    white: [Four<S>; 3],
}

impl<S: Wide> Lens<S> {
    #[inline(always)]
    fn new(simd: S, m: &Matrix3<f64>, scale: Scale) -> Self {
        // Closures, and what takes them, would be compiled for the plain machine: everything stands in loops here.
        let mut entries = [Four::all(simd, 0.0); 9];
        for i in 0..3 {
            for j in 0..3 {
                entries[3 * i + j] = Four::all(simd, m[(i, j)]);
            }
        }
        Self {
            m: entries,
            scale,
            real: Four::all(simd, scale.real),
            twin: Four::all(simd, scale.twin),
            one: Four::all(simd, 1.0),
            zero: Four::all(simd, 0.0),
            horizon: Four::all(simd, HORIZON),
        }
    }

    #[inline(always)]
    fn see(&self, simd: S, block: &Block) -> Seen<S> {
        let (x, y) = (Four::of(simd, &block[0]), Four::of(simd, &block[1]));
        let (u, v) = (Four::of(simd, &block[2]), Four::of(simd, &block[3]));
        let m = &self.m;
        let w = m[6] * x + m[7] * y + m[8];
        let inverse = self.one / w.above(self.horizon, w, self.one);
        let px = (m[0] * x + m[1] * y + m[2]) * inverse;
        let py = (m[3] * x + m[4] * y + m[5]) * inverse;
        let e = [(px - u) * self.real, (py - v) * self.real];
        // Where the twin's pixels are exact the derivative does not matter; the branch is the same for all blocks.
        let white = if self.scale.twin > 0.0 {
            let by = inverse * self.twin;
            let (j00, j01) = ((m[0] - px * m[6]) * by, (m[1] - px * m[7]) * by);
            let (j10, j11) = ((m[3] - py * m[6]) * by, (m[4] - py * m[7]) * by);
            // S = I + J Jᵀ, inverted.
            let uu = self.one + j00 * j00 + j01 * j01;
            let uv = j00 * j10 + j01 * j11;
            let vv = self.one + j10 * j10 + j11 * j11;
            let by = self.one / (uu * vv - uv * uv);
            [vv * by, self.zero - uv * by, uu * by]
        } else {
            [self.one, self.zero, self.one]
        };
        Seen { x, y, inverse, w, p: [px, py], e, white }
    }
}

struct Errors<'a> {
    m: &'a Matrix3<f64>,
    scale: Scale,
    blocks: &'a [Block],
    out: &'a mut [Lanes],
}

impl Job for Errors<'_> {
    type Found = ();

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) {
        let lens = Lens::new(simd, self.m, self.scale);
        let infinite = Four::all(simd, f64::INFINITY);
        let two = Four::all(simd, 2.0);
        for (block, out) in self.blocks.iter().zip(self.out) {
            let Seen { w, e: [eu, ev], white: [a, b, d], .. } = lens.see(simd, block);
            let square = a * eu * eu + two * b * eu * ev + d * ev * ev;
            *out = w.above(lens.horizon, square, infinite).lanes();
        }
    }
}

/// How many sums there are: six each of `z zᵀ` with the three entries of `S⁻¹`, five each of `z z₂ᵀ`, three of `z₂ z₂ᵀ`, eight of
/// the gradient, the squares, and the weight beyond the horizon.
const SUMS: usize = 41;

struct Accumulate<'a, W: Iterator<Item = &'a Lanes>> {
    m: &'a Matrix3<f64>,
    scale: Scale,
    blocks: &'a [Block],
    weights: W,
}

impl<'a, W: Iterator<Item = &'a Lanes>> Job for Accumulate<'a, W> {
    type Found = [f64; SUMS];

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) -> [f64; SUMS] {
        let lens = Lens::new(simd, self.m, self.scale);
        let mut sums = [lens.zero; SUMS];
        for (block, weights) in self.blocks.iter().zip(self.weights) {
            // What counts for nothing costs nothing: outliers in a row are many.
            if weights[0] + weights[1] + weights[2] + weights[3] <= 0.0 {
                continue;
            }
            let seen = lens.see(simd, block);
            let weight = Four::of(simd, weights);
            let Seen { x, y, inverse, p: [px, py], e: [eu, ev], white: [a, b, d], .. } = seen;
            let (zx, zy) = (x * inverse, y * inverse);
            let zz = [zx * zx, zx * zy, zy * zy, zx * inverse, zy * inverse, inverse * inverse];
            let (a, b, d) = (weight * a, weight * b, weight * d);
            let (alpha, beta) = (px * a + py * b, px * b + py * d);
            let gamma = px * alpha + py * beta;
            for k in 0..6 {
                sums[k] = sums[k] + a * zz[k];
                sums[6 + k] = sums[6 + k] + b * zz[k];
                sums[12 + k] = sums[12 + k] + d * zz[k];
            }
            for k in 0..5 {
                sums[18 + k] = sums[18 + k] + alpha * zz[k];
                sums[23 + k] = sums[23 + k] + beta * zz[k];
            }
            for k in 0..3 {
                sums[28 + k] = sums[28 + k] + gamma * zz[k];
            }
            let (su, sv) = (a * eu + b * ev, b * eu + d * ev);
            let both = px * su + py * sv;
            let z = [zx, zy, inverse];
            for k in 0..3 {
                sums[31 + k] = sums[31 + k] + su * z[k];
                sums[34 + k] = sums[34 + k] + sv * z[k];
            }
            for k in 0..2 {
                sums[37 + k] = sums[37 + k] + both * z[k];
            }
            sums[39] = sums[39] + eu * su + ev * sv;
            sums[40] = sums[40] + seen.w.above(lens.horizon, lens.zero, weight);
        }
        let mut found = [0.0; SUMS];
        for k in 0..SUMS {
            found[k] = sums[k].sum();
        }
        found
    }
}

/// Where the products of `z` stand among the sums of `z zᵀ`.
const AT: [[usize; 3]; 3] = [[0, 1, 3], [1, 2, 4], [3, 4, 5]];

fn assembled(sums: &[f64; SUMS], scale: Scale) -> Option<Sums> {
    if sums[40] > 0.0 || !sums[39].is_finite() {
        return None;
    }
    let (mut normal, mut gradient) = (Normal::zeros(), Gradient::zeros());
    for i in 0..3 {
        for j in 0..3 {
            let k = AT[i][j];
            normal[(i, j)] = sums[k];
            normal[(i, 3 + j)] = sums[6 + k];
            normal[(3 + i, j)] = sums[6 + k];
            normal[(3 + i, 3 + j)] = sums[12 + k];
            if j < 2 {
                (normal[(i, 6 + j)], normal[(6 + j, i)]) = (-sums[18 + k], -sums[18 + k]);
                (normal[(3 + i, 6 + j)], normal[(6 + j, 3 + i)]) = (-sums[23 + k], -sums[23 + k]);
                if i < 2 {
                    normal[(6 + i, 6 + j)] = sums[28 + k];
                }
            }
        }
        gradient[i] = sums[31 + i];
        gradient[3 + i] = sums[34 + i];
        if i < 2 {
            gradient[6 + i] = -sums[37 + i];
        }
    }
    // Entries of the map are in normalised units, errors in px.
    let per = scale.real;
    Some(Sums { normal: normal * (per * per), gradient: gradient * per, square: sums[39] })
}

struct LeaveOut<'a> {
    m: &'a Matrix3<f64>,
    scale: Scale,
    c: &'a Normal,
    blocks: &'a [Block],
    out: &'a mut [Lanes],
}

impl LeaveOut<'_> {
    /// The six coefficients of a quadratic form in `z` whose matrix is a block of the covariance, made symmetric; the columns
    /// of `z₂` have no third.
    fn form(&self, row: usize, column: usize) -> [f64; 6] {
        let at = |i: usize, j: usize| {
            let is_there = |from: usize, k: usize| from < 6 || k < 2;
            if is_there(row, i) && is_there(column, j) {
                self.c[(row + i, column + j)]
            } else {
                0.0
            }
        };
        let both = |i: usize, j: usize| at(i, j) + at(j, i);
        [at(0, 0), both(0, 1), at(1, 1), both(0, 2), both(1, 2), at(2, 2)]
    }
}

impl Job for LeaveOut<'_> {
    type Found = ();

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) {
        let lens = Lens::new(simd, self.m, self.scale);
        let places = [(0, 0), (0, 3), (3, 3), (0, 6), (3, 6), (6, 6)];
        let mut forms = [[lens.zero; 6]; 6];
        for i in 0..6 {
            let form = self.form(places[i].0, places[i].1);
            for k in 0..6 {
                forms[i][k] = Four::all(simd, form[k]);
            }
        }
        let two = Four::all(simd, 2.0);
        let (infinite, least) = (Four::all(simd, f64::INFINITY), Four::all(simd, 1e-9));
        // Entries of the map are in normalised units, errors in px.
        let per2 = lens.real * lens.real;
        for (block, out) in self.blocks.iter().zip(self.out) {
            let seen = lens.see(simd, block);
            let Seen { x, y, inverse, p: [px, py], e: [eu, ev], white: [a, b, d], .. } = seen;
            let (zx, zy) = (x * inverse, y * inverse);
            let zz = [zx * zx, zx * zy, zy * zy, zx * inverse, zy * inverse, inverse * inverse];
            let mut values = [lens.zero; 6];
            for i in 0..6 {
                for k in 0..6 {
                    values[i] = values[i] + forms[i][k] * zz[k];
                }
                values[i] = values[i] * per2;
            }
            let [uu, uv, vv, ug, vg, gg] = values;
            let luu = uu - two * px * ug + px * px * gg;
            let luv = uv - py * ug - px * vg + px * py * gg;
            let lvv = vv - two * py * vg + py * py * gg;
            // R = I - L S⁻¹, and R⁻¹ e.
            let (r00, r01) = (lens.one - luu * a - luv * b, lens.zero - luu * b - luv * d);
            let (r10, r11) = (lens.zero - luv * a - lvv * b, lens.one - luv * b - lvv * d);
            let det = r00 * r11 - r01 * r10;
            let (eu, ev) = ((r11 * eu - r01 * ev) / det, (r00 * ev - r10 * eu) / det);
            let square = eu * eu + ev * ev;
            let held = det.above(least, square, infinite);
            *out = seen.w.above(lens.horizon, held, infinite).lanes();
        }
    }
}
