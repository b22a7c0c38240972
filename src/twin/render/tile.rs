//! Which things can appear in which square of the picture, so that a ray asks only those.
//!
//! Squares of [`TILE`] px in which things can appear are looked at again in parts of [`PART`] px: in most of them there is
//! only the table, or one thing before it.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::lens::Lens;
use super::trace::{Candidates, Stage};

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
    let tile = |k: usize| {
        let (u, v) = (((k % columns) * TILE) as f64, ((k / columns) * TILE) as f64);
        tile(stage, lens, u, v)
    };
    (0..columns * rows).into_par_iter().with_min_len(64).map(tile).collect()
}

fn tile(stage: &Stage<'_>, lens: &Lens, u: f64, v: f64) -> Tile {
    let square = Square::new(lens, u, v, TILE);
    let mut things: Vec<u32> = (0..stage.things.len() as u32).collect();
    things.retain(|&k| square.meets(stage, k));
    let marks = stage.marks.iter().enumerate().filter(|(_, mark)| {
        let to = Vector3::new(mark.x, mark.y, 0.0) - square.eye;
        let (along, far) = (to.dot(&square.axis), to.norm() + mark.radius);
        let reach = mark.radius + square.slope * far;
        to.norm_squared() - along * along <= reach * reach
    });
    let marks = marks.map(|(k, _)| k as u32).collect();
    let content = square.content(stage, lens, &things);
    let (n_things, mut parts) = (things.len(), Vec::new());
    if content == Content::Things && n_things > 0 {
        parts.reserve(PARTS * PARTS);
        for k in 0..PARTS * PARTS {
            let at = |k: usize| (k * PART) as f64;
            let square = Square::new(lens, u + at(k % PARTS), v + at(k / PARTS), PART);
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
}

/// Corners in the order of [`Content::Room`].
const CORNERS: [(f64, f64); 4] = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];

impl Square {
    fn new(lens: &Lens, u: f64, v: f64, size: usize) -> Self {
        let size = size as f64;
        let axis = lens.direction(u + size / 2.0, v + size / 2.0).normalize();
        // A pixel more on every side: looks go half a pixel beyond, and lines bow a little between corners.
        let cos = CORNERS
            .map(|(x, y)| {
                let reach = |at: f64| at * (size + 2.0) - 1.5;
                lens.direction(u + reach(x), v + reach(y)).normalize().dot(&axis)
            })
            .into_iter()
            .fold(1.0, f64::min);
        let slope = (1.0 - cos * cos).max(0.0).sqrt() / cos;
        Self { u, v, size, eye: lens.centre, axis, slope }
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
