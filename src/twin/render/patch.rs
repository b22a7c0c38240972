//! The table's top in a square of the picture, from a few of its places.
//!
//! Where the rays of a square meet the table changes smoothly from pixel to pixel: a quadratic through nine of them is right to a
//! hundredth of a pixel, and where it is not the square is drawn in another way. Light between the grain is asked at
//! the corners of parts of the square where it changes evenly between them, else at each pixel. The grain is asked at
//! each pixel always.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use nalgebra::Vector3;
use wide::f32x4;

use super::lens::Lens;
use super::light::{Fold, Lighting};
use super::tile::{PART, TILE};

/// How far apart the places are through which the quadratic goes, px.
const APART: f32 = (TILE / 2) as f32;

/// How far right of and below a square's corner places of it are asked, in [`APART`]: those of the quadratic row by row, two between
/// them, and one for nothing.
const PLACES: [[f32; 12]; 2] = [
    [0.0, 1.0, 2.0, 0.0, 1.0, 2.0, 0.0, 1.0, 2.0, 0.5, 1.5, 0.0],
    [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 0.5, 0.5, 0.0],
];

/// Parts of a square beside each other, and corners of them.
const PARTS: usize = TILE / PART;
const CORNERS: usize = PARTS + 1;

/// How far light between corners may be from what it is there, as linear light: a third of a step of a byte.
const EVEN: f32 = 0.002;

/// A square of the picture, in some parts of which every ray meets the table's top.
pub(super) struct Patch<'l> {
    lighting: &'l Lighting,
    /// Places (x and y, m): what stands before each power of the pixel's column, for each power of its row.
    places: [[f32x4; 3]; 2],
    /// How places are turned to places of the grain, where the square does not reach over a fold of it.
    fold: Option<Fold>,
    /// The table's light but for its grain at the corners of its parts, row by row, if it is even between them.
    corners: Option<[f32x4; CORNERS * CORNERS]>,
    /// The depth along camera z as what stands before x, y and 1.
    depth: [f32; 3],
}

/// A row of a square.
pub(super) struct Row<'p> {
    patch: &'p Patch<'p>,
    x: [f32; 3],
    y: [f32; 3],
    /// The light between the corners above and below, where that is kept.
    corners: Option<[f32x4; CORNERS]>,
}

impl<'l> Patch<'l> {
    /// Returns the square at `(u, v)` px, as if the table had no end; `None` where it is seen so flat that it is not smooth.
    pub(super) fn new(lighting: &'l Lighting, lens: &Lens, (u, v): (usize, usize)) -> Option<Self> {
        let o = lens.centre;
        if o.z < 1e-3 {
            return None;
        }
        // Three by three places and two between them, of which single precision is right to a ten-thousandth of a pixel.
        let [right, below] = PLACES;
        let mut places = [[[0.0_f64; 2]; 4]; 3];
        for (k, places) in places.iter_mut().enumerate() {
            let at = |off: &[f32; 12]| {
                let [a, b, c, d] = [off[4 * k], off[4 * k + 1], off[4 * k + 2], off[4 * k + 3]];
                f32x4::from([a, b, c, d]) * f32x4::splat(APART)
            };
            let (d, length) = lens.four_rays((u, v), [at(&right), at(&below)]);
            if (d.z * length).simd_ge(f32x4::splat(-1e-3)).any() {
                return None;
            }
            let far = f32x4::splat(-o.z as f32) / d.z;
            let (x, y) = ((d.x * far).to_array(), (d.y * far).to_array());
            for (lane, place) in places.iter_mut().enumerate() {
                *place = [o.x + f64::from(x[lane]), o.y + f64::from(y[lane])];
            }
        }
        let places = places.as_flattened();
        let mut met = [[[0.0_f64; 2]; 3]; 3];
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for (met, place) in met.as_flattened_mut().iter_mut().zip(places) {
            *met = *place;
            for k in 0..2 {
                (low[k], high[k]) = (low[k].min(met[k]), high[k].max(met[k]));
            }
        }
        let between = [places[9], places[10]];
        // A quadratic reaches beyond what it goes through by an eighth at most.
        for k in 0..2 {
            let over = (high[k] - low[k]) / 8.0;
            (low[k], high[k]) = (low[k] - over, high[k] + over);
        }
        let places = [0, 1].map(|k| quadratic(&met, k));
        let scale = (high[0] - low[0]).max(high[1] - low[1]) as f32 / TILE as f32;
        for (there, s) in between.iter().zip([0.5, 1.5]) {
            let (s, t) = (s * APART, 0.5 * APART);
            for k in 0..2 {
                let [x0, x1, x2] = powers(&places[k], t);
                if (x0 + s * (x1 + s * x2) - there[k] as f32).abs() > 0.01 * scale {
                    return None;
                }
            }
        }
        let z = lens.world_from_camera().column(2).into_owned();
        let depth = Vector3::new(z.x, z.y, -z.dot(&o)).cast().into();
        let fold = Fold::between(low, high);
        let even = lighting.shade.unevenness(low, high, PARTS as f32) < EVEN;
        let mut patch = Self { lighting, places, fold, corners: None, depth };
        if even {
            patch.corners = Some(patch.light_corners());
        }
        Some(patch)
    }

    fn light_corners(&self) -> [f32x4; CORNERS * CORNERS] {
        let mut corners = [f32x4::splat(0.0); CORNERS * CORNERS];
        let mut first = 0;
        while first < corners.len() {
            let (mut x, mut y) = ([0.0; 4], [0.0; 4]);
            for k in 0..4 {
                let at = (first + k).min(corners.len() - 1);
                let s = (at % CORNERS * PART) as f32;
                let t = (at / CORNERS * PART) as f32;
                let [a, b, c] = powers(&self.places[0], t);
                x[k] = a + s * (b + s * c);
                let [a, b, c] = powers(&self.places[1], t);
                y[k] = a + s * (b + s * c);
            }
            let four = self.lighting.shade.four(f32x4::from(x), f32x4::from(y));
            let n = (corners.len() - first).min(4);
            corners[first..first + n].copy_from_slice(&four[..n]);
            first += 4;
        }
        corners
    }

    /// Returns the row `t` px below the square's first.
    #[inline(always)]
    pub(super) fn row(&self, t: usize) -> Row<'_> {
        let corners = self.corners.as_ref().map(|corners| {
            let (at, down) = (t / PART * CORNERS, (t % PART) as f32 / PART as f32);
            let (above, below) = (&corners[at..][..CORNERS], &corners[at + CORNERS..][..CORNERS]);
            let mut between = [f32x4::splat(0.0); CORNERS];
            for k in 0..CORNERS {
                between[k] = above[k] + (below[k] - above[k]) * f32x4::splat(down);
            }
            between
        });
        let t = t as f32;
        Row { patch: self, x: powers(&self.places[0], t), y: powers(&self.places[1], t), corners }
    }
}

impl Row<'_> {
    /// Returns where the pixels of part `part` of the row see the table (x and y, m).
    #[inline(always)]
    pub(super) fn places(&self, part: usize) -> [f32x4; 2] {
        let s = f32x4::splat((part * PART) as f32) + f32x4::from([0.0, 1.0, 2.0, 3.0]);
        let place =
            |[a, b, c]: [f32; 3]| (f32x4::splat(c) * s + f32x4::splat(b)) * s + f32x4::splat(a);
        [place(self.x), place(self.y)]
    }

    /// Puts the light of pixels from part `part` on into `light`.
    #[inline(always)]
    pub(super) fn light(&self, part: usize, light: &mut [[f32; 3]]) {
        let (quads, rest) = light.as_chunks_mut::<PART>();
        let n = quads.len();
        for (k, quad) in quads.iter_mut().enumerate() {
            *quad = self.quad(part + k);
        }
        if !rest.is_empty() {
            rest.copy_from_slice(&self.quad(part + n)[..rest.len()]);
        }
    }

    /// Returns the light of the pixels of part `part`.
    #[inline(always)]
    fn quad(&self, part: usize) -> [[f32; 3]; PART] {
        let Patch { lighting, fold, .. } = self.patch;
        let [x, y] = self.places(part);
        let wood = match fold {
            Some(fold) => lighting.on_table.grains_in(fold, x, y),
            None => lighting.on_table.grains(x, y),
        };
        let plain = match &self.corners {
            Some(corners) => {
                let left = corners[part];
                let step = (corners[part + 1] - left) * f32x4::splat(1.0 / PART as f32);
                let second = left + step;
                let third = second + step;
                [left, second, third, third + step]
            }
            None => lighting.shade.four(x, y),
        };
        let [a, b, c, d] = lighting.grained(plain, wood);
        [[a[0], a[1], a[2]], [b[0], b[1], b[2]], [c[0], c[1], c[2]], [d[0], d[1], d[2]]]
    }

    /// Puts how deep the places from part `part` on are along camera z, m, into `depths`.
    #[inline(always)]
    pub(super) fn depth(&self, part: usize, depths: &mut [f32]) {
        let [toward_x, toward_y, one] = self.patch.depth.map(f32x4::splat);
        for (k, depths) in depths.chunks_mut(PART).enumerate() {
            let [x, y] = self.places(part + k);
            let depth = (x * toward_x + y * toward_y + one).to_array();
            depths.copy_from_slice(&depth[..depths.len()]);
        }
    }
}

/// Returns what stands before each power of the column for each power of the row, so that the quadratic goes through nine places.
fn quadratic(met: &[[[f64; 2]; 3]; 3], axis: usize) -> [f32x4; 3] {
    let apart = f64::from(APART);
    // Along a line: the value, and what stands before the first and the second power.
    let along = |[a, b, c]: [f64; 3]| {
        let (first, second) = ((c - a) / (2.0 * apart), (c - 2.0 * b + a) / (2.0 * apart * apart));
        [a, first - second * 2.0 * apart, second]
    };
    let rows = [0, 1, 2]
        .map(|row: usize| along([met[row][0][axis], met[row][1][axis], met[row][2][axis]]));
    let mut powers = [[0.0_f32; 4]; 3];
    for column in 0..3 {
        let down = along([rows[0][column], rows[1][column], rows[2][column]]);
        for (power, down) in powers.iter_mut().zip(down) {
            power[column] = down as f32;
        }
    }
    powers.map(f32x4::from)
}

/// Returns what stands before the powers of the column in row `t`.
#[inline(always)]
fn powers(place: &[f32x4; 3], t: f32) -> [f32; 3] {
    let t = f32x4::splat(t);
    let [a, b, c, _] = ((place[2] * t + place[1]) * t + place[0]).to_array();
    [a, b, c]
}
