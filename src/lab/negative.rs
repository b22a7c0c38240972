//! A picture the laboratory's camera has taken and that is not drawn yet.
//!
//! It holds all that the picture shows, so that the arm can go on while it is drawn. What it knows of the
//! laboratory's truth it keeps to itself: only the picture comes out.

use image::RgbImage;

use crate::twin::render::{self, Options, View};
use crate::world::Camera;

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

    /// Draws the picture; the same each time.
    pub fn develop(&self) -> RgbImage {
        let drawn = render::radiance(&self.camera, &self.view, &self.options);
        sensor::expose(&drawn, &self.exposure, self.key)
    }
}
