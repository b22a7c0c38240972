//! A picture the laboratory's camera has taken and that is not drawn yet.
//!
//! It holds all that the picture shows, so that the arm can go on while it is drawn. What it knows of the
//! laboratory's truth it keeps to itself: only the picture comes out.

use image::RgbImage;
use image::imageops::crop_imm;

use crate::twin::render::{self, Options, View};
use crate::world::{Camera, Window};

use super::sensor;
use super::truth::Exposure;

/// An exposed picture.
pub struct Negative {
    view: View,
    camera: Camera,
    exposure: Exposure,
    key: u64,
    options: Options,
}

impl Negative {
    pub(super) fn new(view: View, camera: Camera, exposure: Exposure, key: u64) -> Self {
        Self { view, camera, exposure, key, options: Options::default() }
    }

    /// As one of the small pictures of a film: drawn quickly.
    pub(super) fn of_film(view: View, camera: Camera, exposure: Exposure) -> Self {
        Self { options: Options::film(), ..Self::new(view, camera, exposure, 0) }
    }

    /// Draws the picture, or only what of it is in a window; the same each time.
    pub fn develop(&self, window: Option<Window>) -> RgbImage {
        let intrinsics = &self.camera.intrinsics;
        let whole = Window { u: 0, v: 0, width: intrinsics.width, height: intrinsics.height };
        // Blur reaches in from beside the window, and squares are drawn as they are in the whole.
        let drawn = window.map_or(whole, |window| {
            window.grown(sensor::reach(&self.exposure) + 1, render::SQUARE, &whole)
        });
        let light = render::light(&self.camera.within(&drawn), &self.view, &self.options);
        let photo = sensor::expose(&light, &self.exposure, self.key, (&drawn, &whole));
        let Some(part) = window else { return photo };
        let (u, v) = (part.u - drawn.u, part.v - drawn.v);
        crop_imm(&photo, u, v, part.width, part.height).to_image()
    }
}
