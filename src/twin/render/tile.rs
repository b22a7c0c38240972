//! Which things can appear in which square of the picture, so that a ray asks only those.
//!
//! Squares of [`TILE`] px in which things can appear are looked at again in parts of [`PART`] px: in most of them there is
//! only the table, or one thing before it.

use nalgebra::Vector3;
use rayon::prelude::*;
use wide::f32x4;

use super::lens::Lens;
use super::rays::Four3;
use super::trace::{Candidates, Stage};
use crate::world::Table;

/// Edge of a square, px.
pub(super) const TILE: usize = 16;
/// Edge of a part of a square, px: as many as are drawn at once.
pub(super) const PART: usize = 4;
/// Parts beside each other in a square.
const PARTS: usize = TILE / PART;

/// How far below the horizon a square must lie for its room to be drawn smoothly, as a slope: there the
/// floor changes little from pixel to pixel.
const LOW: f64 = -0.1;

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

    /// Returns whether there is a part of it in which only the table can be met.
    pub(super) fn shows_table(&self) -> bool {
        self.content == Content::Table
            || self.parts.iter().any(|part| part.content == Content::Table)
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

/// Returns the squares of a picture of `width` × `height` px, row by row.
pub(super) fn tiles(stage: &Stage<'_>, lens: &Lens, width: usize, height: usize) -> Vec<Tile> {
    let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
    let tile = |k: usize| tile(stage, lens, (k % columns) * TILE, (k / columns) * TILE);
    (0..columns * rows).into_par_iter().with_min_len(64).map(tile).collect()
}

fn tile(stage: &Stage<'_>, lens: &Lens, u: usize, v: usize) -> Tile {
    let square = Square::new(lens, u, v, TILE);
    let mut things: Vec<u32> = (0..stage.things.len() as u32).collect();
    things.retain(|&k| square.meets(stage, k));
    let marks = stage.marks.iter().enumerate().filter(|_| things.first() == Some(&0)).filter(
        |(_, mark)| {
            let to = Vector3::new(mark.x, mark.y, 0.0) - square.eye;
            let (along, far) = (to.dot(&square.axis), to.norm() + mark.radius);
            let reach = mark.radius + square.slope * far;
            to.norm_squared() - along * along <= reach * reach
        },
    );
    let marks = marks.map(|(k, _)| k as u32).collect();
    let content = square.content(stage, lens, &things);
    let (n_things, mut parts) = (things.len(), Vec::new());
    let is_mixed = match content {
        Content::Room(_) => false,
        Content::Table => !square.is_on(&stage.table),
        Content::Things => n_things > 0,
    };
    if is_mixed {
        parts.reserve(PARTS * PARTS);
        for k in 0..PARTS * PARTS {
            let square = Square::new(lens, u + k % PARTS * PART, v + k / PARTS * PART, PART);
            let from = things.len();
            for k in 0..n_things {
                if square.meets(stage, things[k]) {
                    things.push(things[k]);
                }
            }
            let content = square.content(stage, lens, &things[from..]);
            parts.push(Part { content, things: from..things.len() });
        }
    }
    Tile { content, things, n_things, marks, parts }
}

/// A square and the cone of rays through it.
struct Square {
    u: f64,
    v: f64,
    size: f64,
    eye: Vector3<f64>,
    /// Its middle, of length 1.
    axis: Vector3<f64>,
    /// The tangent of half the cone's angle.
    slope: f64,
    /// The rays about its corners.
    corners: Four3,
}

/// Corners in the order of [`Content::Room`].
const CORNERS: [(f64, f64); 4] = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];

impl Square {
    fn new(lens: &Lens, u: usize, v: usize, size: usize) -> Self {
        let place = (u, v);
        let (u, v, size) = (u as f64, v as f64, size as f64);
        let axis = lens.direction(u + size / 2.0, v + size / 2.0).normalize();
        // A pixel more on every side: looks go half a pixel beyond, and lines bow a little between corners.
        let (low, high) = (-1.5, size as f32 + 0.5);
        let beside = [[low, high, low, high], [low, low, high, high]];
        let (corners, _) = lens.four_rays(place, beside.map(f32x4::from));
        let off = (corners - Four3::of(axis.cast())).norm().to_array();
        // More than single precision rounds off, and far less than a pixel.
        let chord = f64::from(off[0].max(off[1]).max(off[2].max(off[3]))) + 1e-6;
        let cos = 1.0 - chord * chord / 2.0;
        let slope = (1.0 - cos * cos).max(0.0).sqrt() / cos;
        Self { u, v, size, eye: lens.centre, axis, slope, corners }
    }

    /// Returns whether every ray through it meets the table's top.
    fn is_on(&self, table: &Table) -> bool {
        let (x, y, z) = (self.corners.x, self.corners.y, self.corners.z);
        let far = f32x4::splat(-self.eye.z as f32) / z;
        let (x, y) = ((x * far).to_array(), (y * far).to_array());
        let is_seen = |k: usize| {
            let at = [self.eye.x + f64::from(x[k]), self.eye.y + f64::from(y[k])];
            far.to_array()[k] > 0.0 && table.holds(at[0], at[1], 1e-3)
        };
        (0..4).all(is_seen)
    }

    fn meets(&self, stage: &Stage<'_>, thing: u32) -> bool {
        stage.things[thing as usize].in_cone(self.eye, self.axis, self.slope)
    }

    fn content(&self, stage: &Stage<'_>, lens: &Lens, things: &[u32]) -> Content {
        match things {
            [] => {
                let rays = CORNERS.map(|(x, y)| {
                    lens.direction(self.u + x * self.size, self.v + y * self.size).normalize()
                });
                if rays.iter().all(|d| d.z < LOW) {
                    Content::Room(rays.map(|d| stage.lighting.room(self.eye, d).cast()))
                } else {
                    Content::Things
                }
            }
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
    use crate::world::{Camera, Intrinsics, Mark};

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
            let tiles = tiles(&stage, &lens, 72, 50);
            for (u, v) in (0..50).flat_map(|v| (0..72).map(move |u| (u, v))) {
                let (_, candidates) = tiles[v / TILE * 5 + u / TILE].part(u % TILE, v % TILE);
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
