//! Pictures → a film as an MP4 file that browsers, players and OpenCV open: H.264 of the constrained baseline profile.
//!
//! The encoder is for what runs show: a camera that stands still, of which most of the picture is as it was. A picture
//! is coded whole (`intra`) every few seconds, so that players can jump there; in between only macroblocks that changed
//! are, as a difference to the same place of the picture before. There is no search for motion, no second reference, no
//! arithmetic coding and no deblocking. `container` puts the coded pictures into a file. Nothing here knows a run.
//!
//! Sources: ITU-T H.264 (08/2021); ISO/IEC 14496-12 and 14496-15 for the file; Richardson, *The H.264 Advanced Video
//! Compression Standard*, 2010, §7.2 for transform and quantiser.

mod bits;
mod cavlc;
mod codes;
mod container;
mod encoder;
pub mod letters;
mod planes;
mod transform;

use image::RgbImage;

use encoder::Encoder;

/// A film being made.
pub struct Film {
    encoder: Encoder,
    /// Pictures a second, Hz.
    rate: u32,
    /// Coded pictures, each with whether it stands by itself.
    coded: Vec<(Vec<u8>, bool)>,
}

impl Film {
    /// A film of `width` × `height` px, `rate` pictures a second.
    pub fn new(width: u32, height: u32, rate: u32) -> Self {
        Self { encoder: Encoder::new(width, height), rate: rate.max(1), coded: Vec::new() }
    }

    /// Adds a picture of the film's size; of a larger one the upper left corner, of a smaller one with black around it.
    pub fn add(&mut self, picture: &RgbImage) {
        // A jump lands at most five seconds away.
        let is_whole = self.coded.len().is_multiple_of(5 * self.rate as usize);
        self.coded.push((self.encoder.picture(picture, is_whole), is_whole));
    }

    /// Returns the file.
    pub fn finish(self) -> Vec<u8> {
        container::file(&self.encoder, self.rate, &self.coded)
    }
}
