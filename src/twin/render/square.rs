//! How a square of the picture is looked at once, row by row of what is alike in it: room, table, plain things, or anything.
//!
//! What can be met in a square was found before ([`super::tile`]), and pixels where surfaces meet are looked at closely afterwards
//! ([`super::edges`]).

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use std::ops::Range;

use nalgebra::Vector3;
use wide::f32x4;

use super::four::Plane;
use super::known::Known;
use super::lens::Lens;
use super::opaque::Asked;
use super::patch::{Patch, Row};
use super::tile::{Content, PART, TILE, Tile};
use super::tone::{BRIGHTEST, clamped};
use super::trace::{Candidates, Sample, Stage, key_of_table};
use super::view::{NOTHING, TABLE};
use crate::motion::widest;

/// How far four pixels of a row are right of and below the first of them, px.
pub(super) const BESIDE: [[f32; 4]; 2] = [[0.0, 1.0, 2.0, 3.0], [0.0; 4]];

/// What looks: at what, and through which lens.
pub(super) struct Eye<'e> {
    pub(super) stage: &'e Stage<'e>,
    pub(super) lens: &'e Lens,
    pub(super) plane: &'e Plane,
}

/// Some rows of a picture that is being drawn, or a stretch of one of them.
pub(super) struct Band<'b> {
    /// Pixels from one row to the next.
    pub(super) width: usize,
    pub(super) light: &'b mut [[f32; 3]],
    pub(super) beside: Option<Beside<'b>>,
    pub(super) keys: &'b mut [u32],
}

/// What is told of some rows of a picture beside their light.
pub(super) struct Beside<'b> {
    pub(super) depth: &'b mut [f32],
    pub(super) ids: &'b mut [u16],
    pub(super) glass: &'b mut [u16],
}

impl Band<'_> {
    /// Returns a stretch of it.
    #[inline(always)]
    fn stretch(&mut self, at: Range<usize>) -> Band<'_> {
        let beside = self.beside.as_mut().map(|beside| Beside {
            depth: &mut beside.depth[at.clone()],
            ids: &mut beside.ids[at.clone()],
            glass: &mut beside.glass[at.clone()],
        });
        let (light, keys) = (&mut self.light[at.clone()], &mut self.keys[at]);
        Band { width: self.width, light, beside, keys }
    }

    #[inline]
    fn put(&mut self, at: usize, sample: &Sample) {
        self.light[at] = clamped(sample.light);
        if let Some(beside) = &mut self.beside {
            beside.depth[at] = sample.distance as f32;
            beside.ids[at] = sample.id;
            beside.glass[at] = sample.glass;
        }
        self.keys[at] = folded(sample.key);
    }
}

/// Looks once at each pixel of a square of a band; `place` is its corner in the picture, `size` how much of it is there.
#[inline(always)]
pub(super) fn first_look(
    eye: &Eye<'_>,
    tile: &Tile,
    place: (usize, usize),
    size: (usize, usize),
    band: &mut Band<'_>,
) {
    let edge = if tile.has_parts() { PART } else { TILE };
    let patch = tile.shows_top().then(|| Patch::new(&eye.stage.lighting, eye.lens, place));
    let patch = patch.flatten();
    for y in (0..size.1).step_by(edge) {
        let mut x = 0;
        while x < size.0 {
            let (content, candidates) = tile.part(x, y);
            let mut end = x + edge;
            // Parts beside each other that show only the table's top are drawn as one.
            while content == Content::Top && end < size.0 && tile.part(end, y).0 == content {
                end += edge;
            }
            let n = end.min(size.0) - x;
            let is_plain = content == Content::Things && eye.stage.are_plain(candidates.things);
            for row in y..(y + edge).min(size.1) {
                let (u, v) = (place.0 + x, place.1 + row);
                let at = row * band.width + u;
                let stretch = band.stretch(at..at + n);
                match content {
                    Content::Room(corners) => {
                        let (part, height) = (1.0 / edge as f32, (row - y) as f32);
                        let left = corners[0] + (corners[2] - corners[0]) * (height * part);
                        let right = corners[1] + (corners[3] - corners[1]) * (height * part);
                        room_row(left, (right - left) * part, stretch);
                    }
                    Content::Top | Content::Table => match &patch {
                        Some(patch) if content == Content::Top => {
                            patch_row(eye, candidates, &patch.row(row), x / PART, stretch);
                        }
                        _ => table_row(eye, candidates, (u, v), stretch),
                    },
                    Content::Things if is_plain => plain_row(eye, candidates, (u, v), stretch),
                    Content::Things => row_of_things(eye, candidates, (u, v), stretch),
                }
            }
            x = end;
        }
    }
}

/// Draws a stretch of a row where there is only room, whose light changes by `step` from pixel to pixel.
#[inline(always)]
fn room_row(first: Vector3<f32>, step: Vector3<f32>, stretch: Band<'_>) {
    let four = |v: Vector3<f32>| f32x4::from([v.x, v.y, v.z, 0.0]);
    let (mut light, step) = (four(first), four(step));
    for lit in &mut *stretch.light {
        let cut = light.fast_max(f32x4::splat(0.0)).fast_min(f32x4::splat(BRIGHTEST));
        let [r, g, b, _] = cut.to_array();
        *lit = [r, g, b];
        light += step;
    }
    if let Some(beside) = stretch.beside {
        beside.depth.fill(f32::INFINITY);
        beside.ids.fill(NOTHING);
        beside.glass.fill(NOTHING);
    }
    stretch.keys.fill(0);
}

/// Draws a stretch of a row of a square where there is only the table, from its part `part` on.
#[inline(always)]
fn patch_row(
    eye: &Eye<'_>,
    candidates: Candidates<'_>,
    row: &Row<'_>,
    part: usize,
    stretch: Band<'_>,
) {
    row.light(part, stretch.light);
    stretch.keys.fill(folded(key_of_table(false)));
    if let Some(beside) = stretch.beside {
        row.depth(part, beside.depth);
        beside.ids.fill(TABLE);
        beside.glass.fill(NOTHING);
    }
    if candidates.marks.is_empty() {
        return;
    }
    let quads = stretch.light.chunks_mut(PART).zip(stretch.keys.chunks_mut(PART));
    for (k, (light, keys)) in quads.enumerate() {
        let [x, y] = row.places(part + k).map(f32x4::to_array);
        mark(eye, candidates, [x, y], light, keys);
    }
}

/// Draws a stretch of a row where there are only table and room, from the pixel `(u, v)` on.
#[inline(always)]
fn table_row(
    eye: &Eye<'_>,
    candidates: Candidates<'_>,
    (u, v): (usize, usize),
    mut stretch: Band<'_>,
) {
    let n = stretch.light.len();
    for first in (0..n).step_by(PART) {
        let mut here = stretch.stretch(first..(first + PART).min(n));
        let Some(four) = eye.plane.meet(eye.lens, u + first, v) else {
            plain_row(eye, candidates, (u + first, v), here);
            continue;
        };
        for (light, [r, g, b, _]) in here.light.iter_mut().zip(four.light(&eye.stage.lighting)) {
            *light = [r, g, b];
        }
        here.keys.fill(folded(key_of_table(false)));
        if let Some(beside) = &mut here.beside {
            beside.depth.copy_from_slice(&four.depth[..beside.depth.len()]);
            beside.ids.fill(TABLE);
            beside.glass.fill(NOTHING);
        }
        if !candidates.marks.is_empty() {
            mark(eye, candidates, four.places(), here.light, here.keys);
        }
    }
}

/// Draws the marks that are at up to four places of the table (x and y, m).
fn mark(
    eye: &Eye<'_>,
    candidates: Candidates<'_>,
    [x, y]: [[f32; 4]; 2],
    light: &mut [[f32; 3]],
    keys: &mut [u32],
) {
    for (k, (light, key)) in light.iter_mut().zip(keys).enumerate() {
        let (x, y) = (f64::from(x[k]), f64::from(y[k]));
        if eye.stage.mark_at(x, y, Some(candidates.marks)).is_some() {
            *light = clamped(eye.stage.lighting.mark(x, y).cast());
            *key = folded(key_of_table(true));
        }
    }
}

/// Draws a stretch of a row where only plain solids can be seen, from the pixel `(u, v)` on.
fn plain_row(
    eye: &Eye<'_>,
    candidates: Candidates<'_>,
    (u, v): (usize, usize),
    mut stretch: Band<'_>,
) {
    widest(
        #[inline(always)]
        || {
            let n = stretch.light.len();
            let mut known = Known::default();
            for first in (0..n).step_by(PART) {
                let (d, length) = eye.lens.four_rays((u + first, v), BESIDE.map(f32x4::from));
                let seen = eye.stage.see_four(d, candidates.things);
                let looks = eye.stage.look_four(d, seen, candidates.marks, Asked::ALL, &mut known);
                let length = length.to_array();
                for (k, at) in (first..(first + PART).min(n)).enumerate() {
                    stretch.light[at] = looks.light[k];
                    stretch.keys[at] = folded(looks.keys[k]);
                    if let Some(beside) = &mut stretch.beside {
                        beside.depth[at] = looks.distances[k] / length[k];
                        beside.ids[at] = looks.ids[k];
                        beside.glass[at] = looks.glass[k];
                    }
                }
            }
        },
    );
}

/// Draws a stretch of a row where anything can be seen, from the pixel `(u, v)` on.
fn row_of_things(
    eye: &Eye<'_>,
    candidates: Candidates<'_>,
    (u, v): (usize, usize),
    mut stretch: Band<'_>,
) {
    for k in 0..stretch.light.len() {
        let d = eye.lens.direction((u + k) as f64, v as f64);
        let length = d.norm();
        let sample = eye.stage.look(eye.lens.centre, d / length, Some(candidates), 0);
        let distance = sample.distance / length;
        stretch.put(k, &Sample { distance, ..sample });
    }
}

/// Returns half as many digits of a key.
#[inline]
fn folded(key: u64) -> u32 {
    (key ^ key >> 32) as u32
}
