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
mod lit;
mod look;
mod noise;
mod opaque;
mod options;
mod patch;
mod rays;
mod room;
mod scene;
mod shade;
mod solid;
mod span;
mod square;
mod surface;
mod tile;
mod tone;
mod trace;
mod vectors;
mod glass;
mod known;
mod view;

use std::sync::{Mutex, PoisonError};

use image::RgbImage;
use rayon::prelude::*;
use wide::f32x4;

use crate::motion::widest;
use crate::world::Camera;
use edges::Edges;
use four::Plane;
use lens::Lens;
pub use look::ArmLook;
use opaque::NO_THING;
pub use options::Options;
use square::{BESIDE, Band, Beside, Eye, first_look};
use tile::{Content, PART, TILE, Tiles};
pub use tone::{develop, srgb};
use trace::Stage;
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
    // Once among the processors: a caller from outside would wait for a thread to wake at each step.
    let bytes = rayon::scope(|_| bytes_of(camera, view, *options));
    image_of(camera.intrinsics.width, camera.intrinsics.height, bytes)
}

fn bytes_of(camera: &Camera, view: &View, options: Options) -> Vec<u8> {
    let drawing = Drawing::new(camera, view, options);
    let (width, n) = (drawing.width, drawing.width * drawing.height);
    let band = (width * TILE).max(1);
    let has_edges = options.edge_samples > 1;
    let mut bytes = vec![0; 3 * n];
    // Without looks at edges no keys are kept, and of light never more than is being made bytes of.
    let mut keys = vec![0_u32; if has_edges { n } else { 0 }];
    let mut kept: Vec<_> = keys.chunks_mut(band).map(Some).collect();
    kept.resize_with(n.div_ceil(band), || None);
    let spare = Mutex::new(Vec::new());
    bytes.par_chunks_mut(3 * band).zip(kept).enumerate().with_max_len(1).for_each(
        |(row, (bytes, keys))| {
            let taken = spare.lock().unwrap_or_else(PoisonError::into_inner).pop();
            let (mut light, mut unkept) =
                taken.unwrap_or_else(|| (vec![[0.0; 3]; band], vec![0_u32; band]));
            let n = bytes.len() / 3;
            let keys = keys.unwrap_or(&mut unkept[..n]);
            drawing
                .first_looks(row, &mut Band { width, light: &mut light[..n], beside: None, keys });
            widest(
                #[inline(always)]
                || develop(light[..n].as_flattened(), bytes),
            );
            spare.lock().unwrap_or_else(PoisonError::into_inner).push((light, unkept));
        },
    );
    if has_edges {
        let edges = Edges::new(&drawing, &keys);
        bytes.par_chunks_mut((3 * width).max(1)).enumerate().for_each(|(v, row)| {
            edges.look(v, |u, light| develop(&light, &mut row[3 * u..3 * u + 3]));
        });
    }
    bytes
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
    tiles: Tiles,
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
        let tiles = Tiles::new(&stage, &lens, width, height);
        let plane = Plane::new(&lens, &stage.table);
        Self { stage, lens, plane, tiles, width, height, edge_samples: options.edge_samples }
    }

    /// Looks once at each pixel of the squares of a row of them.
    fn first_looks(&self, row: usize, band: &mut Band<'_>) {
        let eye = Eye { stage: &self.stage, lens: &self.lens, plane: &self.plane };
        let rows = band.light.len() / self.width;
        widest(
            #[inline(always)]
            || {
                for place in (0..self.width).step_by(TILE).map(|u| (u, row * TILE)) {
                    let tile = self.tiles.of(place.0, place.1);
                    let size = (TILE.min(self.width - place.0), rows);
                    first_look(&eye, tile, place, size, band);
                }
            },
        );
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
                let (content, candidates) = self.tiles.of(u, v).part(u % TILE, v % TILE);
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
