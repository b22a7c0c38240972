//! A photograph made ready once, for all that is asked of it: finding things, asking for one at a place, and what no thing
//! explains. What is asked is answered by the other modules; nothing here looks.

use std::sync::OnceLock;

use image::RgbImage;

use super::stop::{Asks, Stop};
use super::{Error, check_size};
use crate::alignment::outline::Projector;
use crate::alignment::picture::Picture;
use crate::alignment::plane::Plane;
use crate::alignment::segment::TableModel;
use crate::world::{Camera, Scene};

/// A photograph of a scene through a calibrated camera, made ready for looking.
#[derive(Debug)]
pub struct Look<'a> {
    /// As it was taken.
    pub(super) image: &'a RgbImage,
    /// The camera that took it.
    pub(super) camera: &'a Camera,
    /// What may be in it.
    pub(super) scene: &'a Scene,
    pub(super) picture: Picture,
    pub(super) view: Projector,
    /// What does not look like bare table, with the table's colours, once either is asked for.
    table: OnceLock<(Option<TableModel>, Plane)>,
    pub(super) stop: Stop<'a>,
}

impl<'a> Look<'a> {
    /// Makes a photograph ready.
    ///
    /// # Errors
    ///
    /// [`Error::WrongSize`] when the photograph is not the camera's size.
    pub fn new(image: &'a RgbImage, camera: &'a Camera, scene: &'a Scene) -> Result<Self, Error> {
        check_size(image, camera)?;
        let (picture, view) = (Picture::new(image), Projector::new(camera));
        let (table, stop) = (OnceLock::new(), Stop::default());
        Ok(Self { image, camera, scene, picture, view, table, stop })
    }

    /// Lets the look end as soon as `asks` says so, which is asked between its parts. What was found until then is not
    /// told: see [`Self::is_stopped`].
    #[must_use]
    pub fn until(mut self, asks: Asks<'a>) -> Self {
        self.stop = Stop::when(asks);
        self
    }

    /// Whether somebody has wanted the look to end: what it returned is then not what the photograph shows.
    pub fn is_stopped(&self) -> bool {
        self.stop.is_asked()
    }

    /// Whether the photograph has any colour, by which things of one form are told apart.
    pub fn has_colour(&self) -> bool {
        !self.picture.is_grey
    }

    fn bare(&self) -> &(Option<TableModel>, Plane) {
        self.table.get_or_init(|| {
            let table = TableModel::fit(&self.picture, &self.view, &self.scene.table);
            let small = &self.picture.small[0];
            let nothing = || Plane::zeros(small.width, small.height);
            let change = table.as_ref().map_or_else(nothing, |table| table.change(&self.picture));
            (table, change)
        })
    }

    /// The bare table's colours, when a table is in view.
    pub(super) fn table(&self) -> Option<&TableModel> {
        self.bare().0.as_ref()
    }

    /// What does not look like bare table; nothing, when no table is in view.
    pub(super) fn change(&self) -> &Plane {
        &self.bare().1
    }
}
