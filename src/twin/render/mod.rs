//! The software camera: colour, depth and who is where, for any [`View`] through any [`Camera`].
//!
//! Every pixel's ray is bent by the lens as [`crate::world::camera`] says, then meets closed-form solids
//! directly: straight edges come out as the curves a real lens makes of them, and outlines are exact. A
//! first pass looks once per pixel; wherever neighbours see different surfaces a second pass looks sixteen
//! times, so an edge lies where it belongs to a small fraction of a pixel. Rows are shared out over the
//! processors; the result does not depend on how many there are.
//!
//! What a sensor adds to the light (noise, vignetting, blur) is not drawn here: the twin's camera is ideal,
//! the laboratory's is [`crate`]'s `lab` layer's affair.

mod lens;
mod light;
mod look;
mod scene;
mod solid;
mod trace;
mod view;

use std::sync::LazyLock;

use image::RgbImage;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::world::Camera;
use lens::Lens;
use light::Lighting;
pub use look::ArmLook;
use trace::{Sample, Stage};
pub use view::{Ball, Body, FIRST_BODY, Light, MARKER, NOTHING, Paint, Shape, TABLE, View, WATER};

/// How a picture is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Looks per pixel where surfaces meet; 1 draws without a second pass.
    pub edge_samples: u16,
    /// Whether things cast shadows.
    pub shadows: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { edge_samples: 16, shadows: true }
    }
}

impl Options {
    /// Returns the quickest drawing: ragged edges, no shadows.
    pub fn quick() -> Self {
        Self { edge_samples: 1, shadows: false }
    }
}

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
    bytes.par_chunks_mut(3 * 1024).zip(light.par_chunks(1024)).for_each(|(bytes, light)| {
        for (bytes, light) in bytes.chunks_exact_mut(3).zip(light) {
            bytes.copy_from_slice(&light.map(developed));
        }
    });
    let colour = RgbImage::from_raw(width, height, bytes)
        .expect("three bytes were made for each of width × height pixels");
    Frame { colour, depth, ids, glass_ids }
}

/// Draws a view as light, before a sensor makes numbers of it.
pub fn radiance(camera: &Camera, view: &View, options: &Options) -> Radiance {
    let (width, height) = (camera.intrinsics.width as usize, camera.intrinsics.height as usize);
    let things = scene::things(view);
    let lighting = Lighting::new(view, &things, options.shadows);
    let stage = Stage { things, lighting, marks: &view.marks };
    let lens = Lens::new(camera);
    let tiles = Tiles::new(&stage, &lens, width, height);
    let look = |u: f64, v: f64, list: &[u32]| -> (Sample, f64) {
        let d = lens.direction(u, v);
        let length = d.norm();
        (stage.look(lens.centre, d / length, Some(list), 0), length)
    };

    let mut first =
        vec![
            Pixel { light: [0.0; 3], key: 0, depth: f32::INFINITY, id: NOTHING, glass: NOTHING };
            width * height
        ];
    first.par_chunks_mut(width.max(1)).enumerate().for_each(|(v, row)| {
        for (u, pixel) in row.iter_mut().enumerate() {
            let (sample, length) = look(u as f64, v as f64, tiles.at(u, v));
            *pixel = Pixel {
                light: clamped(sample.light),
                key: sample.key,
                depth: (sample.distance / length) as f32,
                id: sample.id,
                glass: sample.glass,
            };
        }
    });

    let mut light: Vec<[f32; 3]> = first.iter().map(|pixel| pixel.light).collect();
    if options.edge_samples > 1 {
        let n = options.edge_samples;
        let offsets: Vec<[f64; 2]> = (0..n).map(|k| offset(k, n)).collect();
        light.par_chunks_mut(width.max(1)).enumerate().for_each(|(v, row)| {
            for (u, light) in row.iter_mut().enumerate() {
                if !edge(&first, width, height, u, v) {
                    continue;
                }
                let mut sum = [0.0_f32; 3];
                for [du, dv] in &offsets {
                    let (sample, _) = look(u as f64 + du, v as f64 + dv, tiles.at(u, v));
                    let one = clamped(sample.light);
                    sum = [sum[0] + one[0], sum[1] + one[1], sum[2] + one[2]];
                }
                *light = sum.map(|x| x / f32::from(n));
            }
        });
    }
    Radiance {
        width: camera.intrinsics.width,
        height: camera.intrinsics.height,
        light,
        depth: first.iter().map(|pixel| pixel.depth).collect(),
        ids: first.iter().map(|pixel| pixel.id).collect(),
        glass_ids: first.iter().map(|pixel| pixel.glass).collect(),
    }
}

/// The sRGB transfer function: linear light (clamped to 0–1) to 0–1.
pub fn srgb(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// Returns the sRGB byte of linear light, from a table: a picture asks three million times.
fn developed(x: f32) -> u8 {
    const STEPS: f32 = 16383.0;
    static TABLE: LazyLock<Vec<u8>> = LazyLock::new(|| {
        (0..16384).map(|k| (srgb(k as f32 / STEPS) * 255.0 + 0.5) as u8).collect()
    });
    TABLE[(x.clamp(0.0, 1.0) * STEPS + 0.5) as usize]
}

/// The first look at a pixel.
#[derive(Debug, Clone, Copy)]
struct Pixel {
    light: [f32; 3],
    key: u64,
    depth: f32,
    id: u16,
    glass: u16,
}

/// Highlights are cut where a sensor's pixel would be full several times over; else one bright look would
/// outweigh all others of an edge.
fn clamped(light: Vector3<f64>) -> [f32; 3] {
    [light.x, light.y, light.z].map(|x| x.clamp(0.0, 4.0) as f32)
}

/// Returns whether any of the eight neighbours sees another surface.
fn edge(first: &[Pixel], width: usize, height: usize, u: usize, v: usize) -> bool {
    let key = first[v * width + u].key;
    (v.saturating_sub(1)..(v + 2).min(height))
        .any(|y| (u.saturating_sub(1)..(u + 2).min(width)).any(|x| first[y * width + x].key != key))
}

/// Returns the k-th of n places in a pixel (Hammersley's points): all their columns and all their rows
/// differ, so that an edge along either axis is measured to 1/n of a pixel.
fn offset(k: u16, n: u16) -> [f64; 2] {
    let across = (f64::from(k) + 0.5) / f64::from(n);
    let down = f64::from(k.reverse_bits()) / 65536.0 + 0.5 / f64::from(n.next_power_of_two());
    [across - 0.5, down - 0.5]
}

/// Which things can appear in which square of the picture.
struct Tiles {
    columns: usize,
    lists: Vec<Vec<u32>>,
}

/// Edge of a square, px.
const TILE: usize = 16;

impl Tiles {
    fn new(stage: &Stage, lens: &Lens, width: usize, height: usize) -> Self {
        let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
        let mut lists = vec![Vec::new(); columns * rows];
        for (index, thing) in stage.things.iter().enumerate() {
            let (across, down) = match lens.frame(&thing.corners()) {
                None => (0..columns, 0..rows),
                Some([u0, v0, u1, v1]) => {
                    let range = |low: f64, high: f64, n: usize| {
                        let tile = |x: f64| (x / TILE as f64).floor().clamp(-1.0, n as f64);
                        tile(low).max(0.0) as usize..((tile(high) + 1.0) as usize).min(n)
                    };
                    (range(u0, u1, columns), range(v0, v1, rows))
                }
            };
            for row in down {
                for column in across.clone() {
                    lists[row * columns + column].push(index as u32);
                }
            }
        }
        Self { columns, lists }
    }

    fn at(&self, u: usize, v: usize) -> &[u32] {
        &self.lists[(v / TILE) * self.columns + u / TILE]
    }
}
