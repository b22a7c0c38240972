//! Which things can appear in which square of the picture, so that a ray asks only those.
//!
//! Squares of [`TILE`] px in which things can appear are looked at again in parts of [`PART`] px: in most of them there is
//! only the table, or one thing before it.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use nalgebra::Vector3;
use rayon::prelude::*;
use wide::f32x4;

use super::lens::Lens;
use super::trace::{Candidates, Stage};
use super::vectors::Four3;
use crate::motion::widest;
use crate::world::{Mark, Table};

/// Edge of a square, px.
pub(super) const TILE: usize = 16;
/// Edge of a part of a square, px: as many as are drawn at once.
pub(super) const PART: usize = 4;
/// Parts beside each other in a square.
const PARTS: usize = TILE / PART;

/// How far below the horizon a square must lie for its room to be drawn smoothly, as a slope: there the
/// floor changes little from pixel to pixel.
const LOW: f32 = -0.1;

/// One square of the picture.
#[derive(Debug, Clone)]
pub(super) struct Tile {
    /// How it is drawn when it has no parts.
    pub(super) content: Content,
    /// What is met in it, and after that what is met in each of its parts.
    things: Vec<u32>,
    n_things: usize,
    marks: Vec<u32>,
    /// Its parts, row by row; none when the whole of it is alike.
    parts: Vec<Part>,
}

/// A part of a square.
#[derive(Debug, Clone)]
struct Part {
    content: Content,
    /// Where its things stand among those of the square.
    things: std::ops::Range<usize>,
}

/// How a square is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Content {
    /// Only room, far enough below the horizon: its light at the corners of the square, top left, top
    /// right, bottom left, bottom right; between them it is smooth.
    Room([Vector3<f32>; 4]),
    /// Only the table's top.
    Top,
    /// Only table and room.
    Table,
    /// Anything.
    Things,
}

impl Tile {
    /// Returns whether it is drawn part by part.
    pub(super) fn has_parts(&self) -> bool {
        !self.parts.is_empty()
    }

    /// Returns whether there is a part of it in which only the table's top can be met.
    pub(super) fn shows_top(&self) -> bool {
        self.content == Content::Top || self.parts.iter().any(|part| part.content == Content::Top)
    }

    /// Returns what can be met anywhere in it.
    pub(super) fn candidates(&self) -> Candidates<'_> {
        Candidates { things: &self.things[..self.n_things], marks: &self.marks }
    }

    /// Returns how the part with the pixel `(x, y)` of the square is drawn, and what can be met in it.
    pub(super) fn part(&self, x: usize, y: usize) -> (Content, Candidates<'_>) {
        self.parts.get(y / PART * PARTS + x / PART).map_or_else(
            || (self.content, self.candidates()),
            |part| {
                let things = &self.things[part.things.clone()];
                (part.content, Candidates { things, marks: &self.marks })
            },
        )
    }
}

/// The squares of a picture.
pub(super) struct Tiles {
    /// Row by row, in each as many as are a multiple of [`BESIDE`].
    tiles: Vec<Tile>,
    columns: usize,
}

/// So many squares beside each other are looked at together.
const BESIDE: usize = 4;

impl Tiles {
    /// Returns the squares of a picture of `width` × `height` px.
    pub(super) fn new(stage: &Stage<'_>, lens: &Lens, width: usize, height: usize) -> Self {
        let (groups, rows) = (width.div_ceil(TILE * BESIDE), height.div_ceil(TILE));
        let four = |k: usize| {
            widest(
                #[inline(always)]
                || tiles(stage, lens, (k % groups) * TILE * BESIDE, (k / groups) * TILE, width),
            )
        };
        let fours: Vec<[Tile; BESIDE]> =
            (0..groups * rows).into_par_iter().with_min_len(8).map(four).collect();
        Self { tiles: fours.into_flattened(), columns: groups * BESIDE }
    }

    /// Returns the square with the pixel `(u, v)`.
    #[inline]
    pub(super) fn of(&self, u: usize, v: usize) -> &Tile {
        &self.tiles[v / TILE * self.columns + u / TILE]
    }
}

/// Returns the squares beside each other of which the first begins at `(u, v)` px; beyond the picture's `width` they are empty.
#[inline(always)]
fn tiles(stage: &Stage<'_>, lens: &Lens, u: usize, v: usize, width: usize) -> [Tile; BESIDE] {
    let squares = Squares::new(lens, u, v, TILE);
    let met: Vec<u32> = (0..stage.things.len()).map(|k| squares.meet(stage, k)).collect();
    let on_top = squares.are_on(&stage.table);
    std::array::from_fn(|k| {
        if u + k * TILE >= width {
            let (things, marks, parts) = (Vec::new(), Vec::new(), Vec::new());
            return Tile { content: Content::Things, things, n_things: 0, marks, parts };
        }
        let things = (0_u32..).zip(&met).filter(|(_, met)| *met >> k & 1 == 1).map(|(at, _)| at);
        let mut things: Vec<u32> = things.collect();
        let marks = if things.first() == Some(&0) { squares.marks(stage, k) } else { Vec::new() };
        let content = squares.content(stage, lens, &things, (k, on_top));
        let n_things = things.len();
        let is_mixed = match content {
            Content::Room(_) | Content::Top => false,
            Content::Table => true,
            Content::Things => n_things > 0,
        };
        let parts =
            if is_mixed { parts(stage, lens, (u + k * TILE, v), &mut things) } else { Vec::new() };
        Tile { content, things, n_things, marks, parts }
    })
}

/// Returns the parts of the square at `(u, v)` px, and adds what is met in each to the `things` that are met in any.
#[inline(always)]
fn parts(
    stage: &Stage<'_>,
    lens: &Lens,
    (u, v): (usize, usize),
    things: &mut Vec<u32>,
) -> Vec<Part> {
    let n_things = things.len();
    let mut parts = Vec::with_capacity(PARTS * PARTS);
    let mut met = vec![0; n_things];
    for row in 0..PARTS {
        let squares = Squares::new(lens, u, v + row * PART, PART);
        for (met, &thing) in met.iter_mut().zip(&*things) {
            *met = squares.meet(stage, thing as usize);
        }
        let on_top = squares.are_on(&stage.table);
        for k in 0..PARTS {
            let from = things.len();
            for at in 0..n_things {
                if met[at] >> k & 1 == 1 {
                    things.push(things[at]);
                }
            }
            let content = squares.content(stage, lens, &things[from..], (k, on_top));
            parts.push(Part { content, things: from..things.len() });
        }
    }
    parts
}

/// Squares beside each other and the cones of rays through them.
struct Squares {
    /// The corner of the first, px.
    place: (usize, usize),
    size: usize,
    eye: Vector3<f64>,
    /// Their middles, of length 1.
    axes: Four3,
    /// The tangents of half the cones' angles.
    slopes: f32x4,
    /// The rays about their corners.
    corners: [Four3; 4],
}

/// Corners in the order of [`Content::Room`].
const CORNERS: [[f32; 4]; 2] = [[0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]];

impl Squares {
    #[inline(always)]
    fn new(lens: &Lens, u: usize, v: usize, size: usize) -> Self {
        let place = (u, v);
        let edge = size as f32;
        let axes = lens.rays_beside(place, size, [(edge - 1.0) / 2.0; 2]);
        // Looks go half a pixel beyond; lines bow between corners, far less than a pixel in a whole square and a sixteenth of that
        // in a part.
        let beyond = 0.5 + edge / TILE as f32;
        let (low, high) = (-beyond, edge - 1.0 + beyond);
        let (left, right) = ([[low, low], [low, high]], [[high, low], [high, high]]);
        let corners = [
            lens.rays_beside(place, size, left[0]),
            lens.rays_beside(place, size, right[0]),
            lens.rays_beside(place, size, left[1]),
            lens.rays_beside(place, size, right[1]),
        ];
        let mut chord = f32x4::splat(0.0);
        for corner in corners {
            chord = chord.fast_max((corner - axes).norm());
        }
        // More than single precision rounds off, and far less than a pixel.
        let chord = chord + f32x4::splat(2e-6);
        let (one, half2) = (f32x4::splat(1.0), chord * chord * f32x4::splat(0.5));
        let cos = one - half2;
        let sine = chord * (one - half2 * f32x4::splat(0.5)).fast_max(f32x4::splat(0.0)).sqrt();
        Self { place, size, eye: lens.centre, axes, slopes: sine / cos, corners }
    }

    /// Returns which of them have only rays that meet the table's top, a bit each.
    #[inline(always)]
    fn are_on(&self, table: &Table) -> u32 {
        let (zero, eye) = (f32x4::splat(0.0), self.eye);
        let mut on = zero.simd_le(zero);
        for Four3 { x, y, z } in self.corners {
            let far = f32x4::splat(-eye.z as f32) / z;
            let within = |at: f32x4, k: usize, size: f64| {
                let from_middle = at * far + f32x4::splat((eye[k] - table.centre[k]) as f32);
                from_middle.abs().simd_le(f32x4::splat((size / 2.0 - 1e-3) as f32))
            };
            on &= far.simd_gt(zero) & within(x, 0, table.size.x) & within(y, 1, table.size.y);
        }
        on.to_bitmask()
    }

    /// Returns in which of them a thing can be met, a bit each. A few more may be told, none less.
    #[inline(always)]
    fn meet(&self, stage: &Stage<'_>, index: usize) -> u32 {
        let thing = &stage.things[index];
        let Some(plain) = &stage.plain[index] else {
            let slopes = self.slopes.to_array();
            let meets = |k: &usize| {
                let axis = self.axes.lane(*k).normalize();
                thing.in_cone(self.eye, axis, f64::from(slopes[*k]))
            };
            return (0..BESIDE).filter(meets).map(|k| 1 << k).sum();
        };
        // As `Thing::in_cone`; what is added is more than single precision rounds off.
        let to = thing.centre - self.eye;
        let (far, radius) = (to.norm() as f32, thing.radius as f32);
        let width = self.slopes * f32x4::splat(far + radius) + f32x4::splat(1e-5 * (1.0 + far));
        let along = Four3::of(to.cast()).dot(self.axes);
        let reach = width + f32x4::splat(radius);
        let off2 = f32x4::splat(far * far * (1.0 - 2e-6)) - along * along;
        let is_near = along.simd_ge(-reach) & off2.simd_le(reach * reach);
        if !is_near.any() {
            return 0;
        }
        (is_near & plain.is_about(self.axes, width)).to_bitmask()
    }

    /// Returns which marks of the table can be met in the k-th.
    fn marks(&self, stage: &Stage<'_>, k: usize) -> Vec<u32> {
        let axis = self.axes.lane(k).normalize();
        let slope = f64::from(self.slopes.to_array()[k]);
        let is_met = |mark: &Mark| {
            let to = Vector3::new(mark.x, mark.y, 0.0) - self.eye;
            let (along, far) = (to.dot(&axis), to.norm() + mark.radius);
            let reach = mark.radius + slope * far;
            to.norm_squared() - along * along <= reach * reach
        };
        (0_u32..).zip(stage.marks).filter(|(_, mark)| is_met(mark)).map(|(at, _)| at).collect()
    }

    /// Returns how the k-th is drawn, where `things` can be met; `on_top` tells which show only the table's top.
    #[inline(always)]
    fn content(
        &self,
        stage: &Stage<'_>,
        lens: &Lens,
        things: &[u32],
        (k, on_top): (usize, u32),
    ) -> Content {
        match things {
            [] => {
                let edge = f32x4::splat(self.size as f32);
                let place = (self.place.0 + k * self.size, self.place.1);
                let (rays, _) = lens.four_rays(place, CORNERS.map(|at| f32x4::from(at) * edge));
                if rays.z.simd_lt(f32x4::splat(LOW)).all() {
                    Content::Room(stage.lighting.room_four(self.eye, rays).each())
                } else {
                    Content::Things
                }
            }
            [0] if on_top >> k & 1 == 1 => Content::Top,
            [0] => Content::Table,
            _ => Content::Things,
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::twin::render::{Body, Light, Options, Paint, Shape, View};
    use crate::world::{Camera, Intrinsics};

    /// Things of every size before, beside and behind the camera, around it, and close to it.
    #[test]
    fn squares_leave_out_nothing_that_is_seen() {
        let (mut met, mut left_out) = (0, 0);
        for scene in 0..12 {
            let wave = |k: f64| (f64::from(scene) * 1.7 + k * 2.3).sin();
            let body = |k: usize| {
                let a = k as f64;
                let size = 10_f64.powf(1.5 * wave(a + 0.1) - 1.2);
                let shape = match k % 3 {
                    0 => Shape::Cuboid(Vector3::new(size, 0.4 * size, 0.7 * size)),
                    1 => Shape::Cylinder { radius: 0.3 * size, length: size },
                    _ => Shape::Capsule { radius: 0.2 * size, length: size },
                };
                let place = Vector3::new(2.0 * wave(a), 2.0 * wave(a + 0.3), 1.5 * wave(a + 0.7));
                let turn = Vector3::new(wave(a + 0.2), wave(a + 0.4), wave(a + 0.6)) * 3.0;
                let world_from_body = Isometry3::new(place, turn);
                let paint = Paint::opaque([120; 3], 0.3);
                Body { name: String::new(), shape, world_from_body, paint }
            };
            let view = View {
                table: Table {
                    size: Vector3::new(0.9, 0.7, 0.03),
                    centre: [0.5, 0.0],
                    colour: [200, 176, 144],
                },
                marks: vec![Mark { x: 0.4, y: 0.1, radius: 0.05 }],
                bodies: (0..15).map(body).collect(),
                water: Vec::new(),
                particle_radius: 0.004,
                light: Light::default(),
                marker: None,
            };
            let mut intrinsics = Intrinsics::centred(60.0, 72, 50);
            intrinsics.k1 = -0.1;
            let eye = Vector3::new(1.2 + 0.3 * wave(9.0), 0.3 * wave(8.0), 0.8);
            let camera = Camera::looking(intrinsics, eye, Vector3::new(0.5, 0.0, 0.05));
            let lens = Lens::new(&camera);
            let stage = Stage::new(&view, Options::quick(), lens.centre);
            let tiles = Tiles::new(&stage, &lens, 72, 50);
            for (u, v) in (0..50).flat_map(|v| (0..72).map(move |u| (u, v))) {
                let (_, candidates) = tiles.of(u, v).part(u % TILE, v % TILE);
                // Looks at an edge go half a pixel to either side.
                for (x, y) in [(-0.5, -0.5), (0.0, 0.0), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)] {
                    let d = lens.direction(u as f64 + x, v as f64 + y).normalize();
                    let some = stage.see(lens.centre, d, Some(candidates), 0);
                    let all = stage.see(lens.centre, d, None, 0);
                    assert_eq!(some.surface(), all.surface(), "scene {scene}: {u} {v} {x} {y}");
                    met += usize::from(all.surface() != 0);
                }
                left_out += stage.things.len() - candidates.things.len();
            }
        }
        assert!(met > 0 && left_out > 0, "{met} met, {left_out} left out");
    }
}
