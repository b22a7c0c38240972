//! The software camera: colour, depth and who is where, for any [`View`] through any [`Camera`].
//!
//! Every pixel's ray is bent by the lens as [`crate::world::camera`] says, then meets closed-form solids
//! directly: straight edges come out as the curves a real lens makes of them, and outlines are exact. A
//! first pass looks once per pixel; wherever neighbours see different surfaces a second pass looks sixteen
//! times, so an edge lies where it belongs to a small fraction of a pixel. Where there are only table, boxes, cylinders and
//! capsules, four rays go at once in single precision (`four.rs`, `rays.rs`, `opaque.rs`); glass, hollows and other forms are
//! looked at ray by ray in double precision. Rows are shared out over the processors; the result does not depend on how many there are.
//!
//! What a sensor adds to the light (noise, vignetting, blur) is not drawn here: the twin's camera is ideal,
//! the laboratory's is [`crate`]'s `lab` layer's affair.

mod cast;
mod edges;
mod form;
mod four;
mod lens;
mod light;
mod look;
mod opaque;
mod options;
mod patch;
mod rays;
mod scene;
mod shade;
mod solid;
mod surface;
mod tile;
mod tone;
mod trace;
mod glass;
mod known;
mod view;

use std::ops::Range;

use image::RgbImage;
use nalgebra::Vector3;
use rayon::prelude::*;
use wide::f32x4;

use crate::world::Camera;
use edges::Edges;
use four::Plane;
use known::Known;
use lens::Lens;
pub use look::ArmLook;
use opaque::{Asked, NO_THING};
pub use options::Options;
use patch::Patch;
use tile::{Content, PART, TILE, Tile};
use tone::{BRIGHTEST, clamped};
pub use tone::{develop, srgb};
use trace::{Candidates, Sample, Stage};
pub use view::{Ball, Body, FIRST_BODY, Light, MARKER, NOTHING, Paint, Shape, TABLE, View, WATER};

/// Pictures are drawn in squares of so many px: the same squares, the same picture.
pub const SQUARE: u32 = TILE as u32;

/// A picture as light, row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Radiance {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// Linear red, green, blue; 1 is white paper in a good exposure, highlights go beyond.
    pub light: Vec<[f32; 3]>,
    /// Depth of what is opaque along camera z, m; infinite where nothing is.
    pub depth: Vec<f32>,
    /// What is opaque there: [`TABLE`], [`MARKER`], [`FIRST_BODY`] + k, or [`NOTHING`]. Taken along the
    /// straight line of sight, although glass in front may show something beside it.
    pub ids: Vec<u16>,
    /// Which transparent thing is in front of it: a body, [`WATER`], or [`NOTHING`].
    pub glass_ids: Vec<u16>,
}

/// A developed picture, row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// sRGB.
    pub colour: RgbImage,
    /// As in [`Radiance`].
    pub depth: Vec<f32>,
    /// As in [`Radiance`].
    pub ids: Vec<u16>,
    /// As in [`Radiance`].
    pub glass_ids: Vec<u16>,
}

/// Draws a view as an ideal camera develops it.
pub fn render(camera: &Camera, view: &View, options: &Options) -> Frame {
    let Radiance { width, height, light, depth, ids, glass_ids } = radiance(camera, view, options);
    let mut bytes = vec![0; light.len() * 3];
    bytes
        .par_chunks_mut(3 * 1024)
        .zip(light.par_chunks(1024))
        .for_each(|(bytes, light)| develop(light.as_flattened(), bytes));
    Frame { colour: image_of(width, height, bytes), depth, ids, glass_ids }
}

/// Returns the colours of [`render`] alone, for which nothing else is kept.
pub fn picture(camera: &Camera, view: &View, options: &Options) -> RgbImage {
    let drawing = Drawing::new(camera, view, *options);
    let (width, n) = (drawing.width, drawing.width * drawing.height);
    let (mut bytes, mut keys) = (vec![0; 3 * n], vec![0_u32; n]);
    let band = (width * TILE).max(1);
    bytes.par_chunks_mut(3 * band).zip(keys.par_chunks_mut(band)).enumerate().for_each_init(
        Vec::new,
        |light, (row, (bytes, keys))| {
            light.resize(keys.len(), [0.0; 3]);
            drawing.first_looks(row, &mut Band { width, light, beside: None, keys });
            develop(light.as_flattened(), bytes);
        },
    );
    if options.edge_samples > 1 {
        let edges = Edges::new(&drawing, &keys);
        bytes.par_chunks_mut((3 * width).max(1)).enumerate().for_each(|(v, row)| {
            edges.look(v, |u, light| develop(&light, &mut row[3 * u..3 * u + 3]));
        });
    }
    image_of(camera.intrinsics.width, camera.intrinsics.height, bytes)
}

/// Draws a view as light, before a sensor makes numbers of it.
pub fn radiance(camera: &Camera, view: &View, options: &Options) -> Radiance {
    let drawing = Drawing::new(camera, view, *options);
    let (width, n) = (drawing.width, drawing.width * drawing.height);
    let mut drawn = Radiance {
        width: camera.intrinsics.width,
        height: camera.intrinsics.height,
        light: vec![[0.0; 3]; n],
        depth: vec![0.0; n],
        ids: vec![NOTHING; n],
        glass_ids: vec![NOTHING; n],
    };
    let mut keys = vec![0_u32; n];
    let band = (width * TILE).max(1);
    drawn
        .light
        .par_chunks_mut(band)
        .zip(drawn.depth.par_chunks_mut(band))
        .zip(drawn.ids.par_chunks_mut(band))
        .zip(drawn.glass_ids.par_chunks_mut(band))
        .zip(keys.par_chunks_mut(band))
        .enumerate()
        .for_each(|(row, ((((light, depth), ids), glass), keys))| {
            let beside = Some(Beside { depth, ids, glass });
            drawing.first_looks(row, &mut Band { width, light, beside, keys });
        });
    drawing.look_at_edges(&keys, &mut drawn.light);
    drawn
}

/// Returns the light of [`radiance`] alone, for which nothing else is kept.
pub fn light(camera: &Camera, view: &View, options: &Options) -> Vec<[f32; 3]> {
    let drawing = Drawing::new(camera, view, *options);
    let (width, n) = (drawing.width, drawing.width * drawing.height);
    let (mut light, mut keys) = (vec![[0.0; 3]; n], vec![0_u32; n]);
    let band = (width * TILE).max(1);
    light.par_chunks_mut(band).zip(keys.par_chunks_mut(band)).enumerate().for_each(
        |(row, (light, keys))| {
            drawing.first_looks(row, &mut Band { width, light, beside: None, keys });
        },
    );
    drawing.look_at_edges(&keys, &mut light);
    light
}

/// Returns where something opaque but the table is seen, row by row: nothing is lit for it.
pub fn solids(camera: &Camera, view: &View) -> Vec<bool> {
    let drawing = Drawing::new(camera, view, Options::quick());
    let mut seen = vec![false; drawing.width * drawing.height];
    let band = (drawing.width * TILE).max(1);
    seen.par_chunks_mut(band).enumerate().for_each(|(row, seen)| drawing.find_solids(row, seen));
    seen
}

fn image_of(width: u32, height: u32, bytes: Vec<u8>) -> RgbImage {
    RgbImage::from_raw(width, height, bytes)
        .expect("three bytes were made for each of width × height pixels")
}

/// A view made ready to be drawn through a camera.
struct Drawing<'v> {
    stage: Stage<'v>,
    lens: Lens,
    plane: Plane,
    tiles: Vec<Tile>,
    /// Squares beside each other.
    columns: usize,
    width: usize,
    height: usize,
    /// Looks at a pixel where surfaces meet.
    edge_samples: u16,
}

impl<'v> Drawing<'v> {
    fn new(camera: &Camera, view: &'v View, options: Options) -> Self {
        let (width, height) = (camera.intrinsics.width as usize, camera.intrinsics.height as usize);
        let lens = Lens::new(camera);
        let stage = Stage::new(view, options, lens.centre);
        let tiles = tile::tiles(&stage, &lens, width, height);
        let plane = Plane::new(&lens, &stage.table);
        let (columns, edge_samples) = (width.div_ceil(TILE), options.edge_samples);
        Self { stage, lens, plane, tiles, columns, width, height, edge_samples }
    }

    /// Looks once at each pixel of the squares of a row of them.
    fn first_looks(&self, row: usize, band: &mut Band<'_>) {
        let eye = Eye { stage: &self.stage, lens: &self.lens, plane: &self.plane };
        let rows = band.light.len() / self.width;
        for column in 0..self.columns {
            let tile = &self.tiles[row * self.columns + column];
            let place = (column * TILE, row * TILE);
            let size = (TILE.min(self.width - place.0), rows);
            first_look(&eye, tile, place, size, band);
        }
    }

    /// Looks closely wherever neighbours saw different surfaces.
    fn look_at_edges(&self, keys: &[u32], light: &mut [[f32; 3]]) {
        if self.edge_samples > 1 {
            let edges = Edges::new(self, keys);
            light.par_chunks_mut(self.width.max(1)).enumerate().for_each(|(v, row)| {
                edges.look(v, |u, light| row[u] = light);
            });
        }
    }

    /// Marks where something opaque but the table is seen in the squares of a row of them.
    fn find_solids(&self, row: usize, seen: &mut [bool]) {
        for (below, seen) in seen.chunks_mut(self.width).enumerate() {
            let v = row * TILE + below;
            for (part, seen) in seen.chunks_mut(PART).enumerate() {
                let u = part * PART;
                let tile = &self.tiles[row * self.columns + u / TILE];
                let (content, candidates) = tile.part(u % TILE, v % TILE);
                if content != Content::Things {
                    continue;
                }
                if self.stage.are_plain(candidates.things) {
                    let (d, _) = self.lens.four_rays((u, v), BESIDE.map(f32x4::from));
                    let things = self.stage.see_four(d, candidates.things).things;
                    for (seen, thing) in seen.iter_mut().zip(things) {
                        *seen = thing != NO_THING && thing != 0;
                    }
                    continue;
                }
                for (k, seen) in seen.iter_mut().enumerate() {
                    let d = self.lens.direction((u + k) as f64, v as f64).normalize();
                    let met = self.stage.see(self.lens.centre, d, Some(candidates), 0);
                    let id = self.stage.id(&met);
                    *seen = id != NOTHING && id != TABLE;
                }
            }
        }
    }
}

/// How far four pixels of a row are right of and below the first of them, px.
const BESIDE: [[f32; 4]; 2] = [[0.0, 1.0, 2.0, 3.0], [0.0; 4]];

/// What looks: at what, and through which lens.
struct Eye<'e> {
    stage: &'e Stage<'e>,
    lens: &'e Lens,
    plane: &'e Plane,
}

/// Some rows of a picture that is being drawn.
struct Band<'b> {
    width: usize,
    light: &'b mut [[f32; 3]],
    beside: Option<Beside<'b>>,
    keys: &'b mut [u32],
}

/// What is told of some rows of a picture beside their light.
struct Beside<'b> {
    depth: &'b mut [f32],
    ids: &'b mut [u16],
    glass: &'b mut [u16],
}

impl Band<'_> {
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
fn first_look(
    eye: &Eye<'_>,
    tile: &Tile,
    place: (usize, usize),
    size: (usize, usize),
    band: &mut Band<'_>,
) {
    let edge = if tile.has_parts() { PART } else { TILE };
    let patch = tile
        .shows_table()
        .then(|| Patch::new(&eye.stage.lighting, eye.lens, &eye.stage.table, place));
    let patch = patch.flatten();
    for y in (0..size.1).step_by(edge) {
        for x in (0..size.0).step_by(edge) {
            let (content, candidates) = tile.part(x, y);
            let size = (edge.min(size.0 - x), edge.min(size.1 - y));
            let is_plain = content == Content::Things && eye.stage.are_plain(candidates.things);
            for row in y..y + size.1 {
                let (u, v) = (place.0 + x, place.1 + row);
                let at = row * band.width + u;
                match content {
                    Content::Room(corners) => {
                        let (part, height) = (1.0 / edge as f32, (row - y) as f32);
                        let left = corners[0] + (corners[2] - corners[0]) * (height * part);
                        let right = corners[1] + (corners[3] - corners[1]) * (height * part);
                        room_row(left, (right - left) * part, at..at + size.0, band);
                    }
                    Content::Table => match &patch {
                        Some(patch) => {
                            patch_row(eye, candidates, &patch.row(row), x, at..at + size.0, band);
                        }
                        None => table_row(eye, candidates, (u, v), at..at + size.0, band),
                    },
                    Content::Things if is_plain => {
                        plain_row(eye, candidates, (u, v), at..at + size.0, band);
                    }
                    Content::Things => {
                        for k in 0..size.0 {
                            let d = eye.lens.direction((u + k) as f64, v as f64);
                            let length = d.norm();
                            let sample =
                                eye.stage.look(eye.lens.centre, d / length, Some(candidates), 0);
                            let distance = sample.distance / length;
                            band.put(at + k, &Sample { distance, ..sample });
                        }
                    }
                }
            }
        }
    }
}

/// Draws a stretch of a row where there is only room, whose light changes by `step` from pixel to pixel.
fn room_row(first: Vector3<f32>, step: Vector3<f32>, stretch: Range<usize>, band: &mut Band<'_>) {
    let four = |v: Vector3<f32>| f32x4::from([v.x, v.y, v.z, 0.0]);
    let (mut light, step) = (four(first), four(step));
    for at in stretch.clone() {
        let cut = light.fast_max(f32x4::splat(0.0)).fast_min(f32x4::splat(BRIGHTEST));
        let [r, g, b, _] = cut.to_array();
        band.light[at] = [r, g, b];
        light += step;
    }
    if let Some(beside) = &mut band.beside {
        beside.depth[stretch.clone()].fill(f32::INFINITY);
        beside.ids[stretch.clone()].fill(NOTHING);
        beside.glass[stretch.clone()].fill(NOTHING);
    }
    band.keys[stretch].fill(0);
}

/// Draws a stretch of a row of a square where there is only the table, from its column `x` on.
fn patch_row(
    eye: &Eye<'_>,
    candidates: Candidates<'_>,
    row: &patch::Row<'_>,
    x: usize,
    stretch: Range<usize>,
    band: &mut Band<'_>,
) {
    let key = folded(trace::key_of_table(false));
    for first in (0..stretch.len()).step_by(PART) {
        let here = stretch.start + first..(stretch.start + first + PART).min(stretch.end);
        let part = (x + first) / PART;
        let quad = row.quad(part);
        let light = row.light(part, &quad);
        for (light, [r, g, b, _]) in band.light[here.clone()].iter_mut().zip(&light) {
            *light = [*r, *g, *b];
        }
        if let Some(beside) = &mut band.beside {
            beside.depth[here.clone()].copy_from_slice(&row.depth(&quad)[..here.len()]);
            beside.ids[here.clone()].fill(TABLE);
            beside.glass[here.clone()].fill(NOTHING);
        }
        band.keys[here.clone()].fill(key);
        if !candidates.marks.is_empty() {
            let (x, y) = (quad.x.to_array(), quad.y.to_array());
            for (k, at) in here.enumerate() {
                let (x, y) = (f64::from(x[k]), f64::from(y[k]));
                if eye.stage.mark_at(x, y, Some(candidates.marks)).is_some() {
                    band.light[at] = clamped(eye.stage.lighting.mark(x, y).cast());
                    band.keys[at] = folded(trace::key_of_table(true));
                }
            }
        }
    }
}

/// Draws a stretch of a row where there are only table and room, from the pixel `(u, v)` on.
fn table_row(
    eye: &Eye<'_>,
    candidates: Candidates<'_>,
    (u, v): (usize, usize),
    stretch: Range<usize>,
    band: &mut Band<'_>,
) {
    let key = folded(trace::key_of_table(false));
    let n = stretch.len();
    for first in (0..n).step_by(4) {
        let here = stretch.start + first..(stretch.start + first + 4).min(stretch.end);
        let Some(four) = eye.plane.meet(eye.lens, u + first, v) else {
            plain_row(eye, candidates, (u + first, v), here, band);
            continue;
        };
        let light = four.light(&eye.stage.lighting);
        for (k, at) in here.clone().enumerate() {
            let [r, g, b, _] = light[k];
            band.light[at] = [r, g, b];
        }
        if let Some(beside) = &mut band.beside {
            beside.depth[here.clone()].copy_from_slice(&four.depth[..here.len()]);
            beside.ids[here.clone()].fill(TABLE);
            beside.glass[here.clone()].fill(NOTHING);
        }
        band.keys[here.clone()].fill(key);
        if !candidates.marks.is_empty() {
            for (k, (x, y)) in four.places().into_iter().enumerate().take(here.len()) {
                let marks = Some(candidates.marks);
                let at = [f64::from(x), f64::from(y)];
                if eye.stage.mark_at(at[0], at[1], marks).is_some() {
                    band.light[here.start + k] =
                        clamped(eye.stage.lighting.mark(at[0], at[1]).cast());
                    band.keys[here.start + k] = folded(trace::key_of_table(true));
                }
            }
        }
    }
}

/// Draws a stretch of a row where only plain solids can be seen, from the pixel `(u, v)` on.
fn plain_row(
    eye: &Eye<'_>,
    candidates: Candidates<'_>,
    (u, v): (usize, usize),
    stretch: Range<usize>,
    band: &mut Band<'_>,
) {
    let mut known = Known::default();
    for first in (0..stretch.len()).step_by(4) {
        let (d, length) = eye.lens.four_rays((u + first, v), BESIDE.map(f32x4::from));
        let seen = eye.stage.see_four(d, candidates.things);
        let looks = eye.stage.look_four(d, seen, candidates.marks, Asked::ALL, &mut known);
        let length = length.to_array();
        let here = stretch.start + first..(stretch.start + first + 4).min(stretch.end);
        for (k, at) in here.enumerate() {
            band.light[at] = looks.light[k];
            band.keys[at] = folded(looks.keys[k]);
            if let Some(beside) = &mut band.beside {
                beside.depth[at] = looks.distances[k] / length[k];
                beside.ids[at] = looks.ids[k];
                beside.glass[at] = looks.glass[k];
            }
        }
    }
}

/// Returns half as many digits of a key.
#[inline]
fn folded(key: u64) -> u32 {
    (key ^ key >> 32) as u32
}
