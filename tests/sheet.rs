//! Boards drawn through a lens, as a camera at a known place sees them.

use image::{Rgb, RgbImage};
use rand::rngs::StdRng;
use rand::{RngExt as _, SeedableRng as _};
use trueup::alignment::boards::Target;
use trueup::world::Camera;

use crate::sights::Sights;

/// What is drawn of a board, and its middle, m.
pub(crate) struct Sheet {
    pub(crate) is_bright: Box<dyn Fn(f64, f64) -> bool>,
    pub(crate) middle: [f64; 2],
    /// Whether the board's y is up, seen from its front.
    pub(crate) is_up: bool,
}

pub(crate) fn sheet(target: &Target) -> Sheet {
    match target.clone() {
        Target::Charuco(b) => Sheet {
            middle: [0.5 * b.square * b.columns as f64, 0.5 * b.square * b.rows as f64],
            is_bright: Box::new(move |x, y| b.is_bright(x, y)),
            is_up: false,
        },
        Target::Tags(b) => {
            let pitch = b.tag * (1.0 + b.gap);
            Sheet {
                middle: [0.5 * pitch * b.columns as f64, 0.5 * pitch * b.rows as f64],
                is_bright: Box::new(move |x, y| b.is_bright(x, y)),
                is_up: true,
            }
        }
        Target::Circles(b) => {
            let wide = if b.shifted { 2 * b.columns } else { b.columns };
            Sheet {
                middle: [0.5 * b.step * (wide as f64 - 1.0), 0.5 * b.step * (b.rows as f64 - 1.0)],
                is_bright: Box::new(move |x, y| b.is_bright(x, y)),
                is_up: false,
            }
        }
        Target::Chessboard(b) => Sheet {
            middle: [
                0.5 * b.square * (b.columns as f64 - 1.0),
                0.5 * b.square * (b.rows as f64 - 1.0),
            ],
            is_bright: Box::new(move |x, y| {
                let (c, r) = ((x / b.square).floor(), (y / b.square).floor());
                let is_on =
                    (-1.0..b.columns as f64).contains(&c) && (-1.0..b.rows as f64).contains(&r);
                !is_on || (c + r).rem_euclid(2.0) > 0.5
            }),
            is_up: false,
        },
    }
}

/// The picture: four looks a pixel, noise of 2 grey levels.
pub(crate) fn taken(sheet: &Sheet, camera: &Camera, seed: u64) -> RgbImage {
    let sights = Sights::of(camera);
    let mut random = StdRng::seed_from_u64(seed);
    RgbImage::from_fn(camera.intrinsics.width, camera.intrinsics.height, |u, v| {
        let mut sum = 0.0;
        for i in 0..4 {
            let (du, dv) = (f64::from(i % 2) / 2.0 - 0.25, f64::from(i / 2) / 2.0 - 0.25);
            let at = sights.on_plane(f64::from(u) + du, f64::from(v) + dv);
            sum += if at.is_some_and(|[x, y]| (sheet.is_bright)(x, y)) { 205.0 } else { 35.0 };
        }
        let grey: f64 = sum / 4.0 + random.random_range(-3.5..3.5);
        Rgb([grey.round().clamp(0.0, 255.0) as u8; 3])
    })
}
