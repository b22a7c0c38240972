//! Networks of a program that was built without them (feature `onnx`): no file is opened, and that is said.

use std::convert::Infallible;
use std::path::Path;

use image::RgbImage;

use super::{Error, Mask, Where};

/// There is none.
pub struct Network(Infallible);

impl Network {
    /// Opens nothing.
    ///
    /// # Errors
    ///
    /// Always [`Error::NotBuilt`].
    pub fn open(_: &Path) -> Result<Self, Error> {
        Err(Error::NotBuilt)
    }

    /// Cannot be called.
    pub(super) fn ask(&self, _: &RgbImage, _: &[Where]) -> Result<Vec<Mask>, Error> {
        match self.0 {}
    }
}
