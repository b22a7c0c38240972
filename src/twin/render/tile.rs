//! Which things can appear in which square of the picture, so that a ray asks only those.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::lens::Lens;
use super::trace::{Candidates, Stage};

/// Edge of a square, px.
pub(super) const TILE: usize = 16;

/// How far below the horizon a square must lie for its room to be drawn smoothly, as a slope: there the
/// floor changes little from pixel to pixel.
const LOW: f64 = -0.1;

/// One square of the picture.
#[derive(Debug, Clone)]
pub(super) struct Tile {
    pub(super) candidates: Candidates,
    pub(super) content: Content,
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
    let size = TILE as f64;
    let axis = lens.direction(u + size / 2.0, v + size / 2.0).normalize();
    let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
    // A pixel more on every side: looks go half a pixel beyond, and lines bow a little between corners.
    let cos = corners
        .map(|(x, y)| {
            let reach = |at: f64| at * (size + 2.0) - 1.5;
            lens.direction(u + reach(x), v + reach(y)).normalize().dot(&axis)
        })
        .into_iter()
        .fold(1.0, f64::min);
    let slope = (1.0 - cos * cos).max(0.0).sqrt() / cos;
    let eye = lens.centre;
    let met = |&k: &u32| stage.things[k as usize].in_cone(eye, axis, slope);
    let things: Vec<u32> = (0..stage.things.len() as u32).filter(met).collect();
    let marks = stage.marks.iter().enumerate().filter(|(_, mark)| {
        let to = Vector3::new(mark.x, mark.y, 0.0) - eye;
        let (along, far) = (to.dot(&axis), to.norm() + mark.radius);
        let reach = mark.radius + slope * far;
        to.norm_squared() - along * along <= reach * reach
    });
    let marks = marks.map(|(k, _)| k as u32).collect();
    let content = match things.as_slice() {
        [] => {
            let rays = corners.map(|(x, y)| lens.direction(u + x * size, v + y * size).normalize());
            if rays.iter().all(|d| d.z < LOW) {
                Content::Room(rays.map(|d| stage.lighting.room(eye, d).cast()))
            } else {
                Content::Things
            }
        }
        [0] => Content::Table,
        _ => Content::Things,
    };
    Tile { candidates: Candidates { things, marks }, content }
}
