//! Seeing: a picture → the scene's objects, placed, with how sure.
use thiserror::Error as ThisError;

/// Why a picture could not be used at all. An object that is not found is an answer, not an error.
#[derive(Debug, Clone, PartialEq, ThisError)]
pub enum Error {
    /// The picture and the camera disagree about the picture's size.
    #[error(
        "the picture is {} x {} px, the camera's calibration is for {} x {} px; \
         use the calibration of this camera at this size",
        image.0, image.1, camera.0, camera.1
    )]
    WrongSize {
        /// Width and height of the picture, px.
        image: (u32, u32),
        /// Width and height in the calibration, px.
        camera: (u32, u32),
    },
    /// The scene has too few printed dots for a homography.
    #[error("the scene has {marks} table marks, alignment needs at least {needed}; add `marks dots` to the scene")]
    NoMarks {
        /// Marks in the scene.
        marks: usize,
        /// Marks needed.
        needed: usize,
    },
    /// Too few printed dots were recognised.
    #[error(
        "only {found} of {marks} table marks were recognised ({dots} dark dots seen, {needed} needed); \
         clear the table's dots, or correct the camera guess in the scene"
    )]
    TooFewMarks {
        /// Marks recognised.
        found: usize,
        /// Marks needed.
        needed: usize,
        /// Dark dots seen at all.
        dots: usize,
        /// Marks in the scene.
        marks: usize,
    },
}

use image::{GrayImage, RgbImage};
use std::collections::BTreeMap;

use super::outline::{ObjectPose, Projector};
use super::picture::{Picture, Plane};
use super::placement::{Candidate, Evidence, Hidden, Score, Window, assign};
use super::segment::TableModel;
use crate::world::{Camera, Scene};

/// Where to look and what to leave out.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// For some objects, by name, the part of the table to search; others are searched for everywhere.
    pub windows: BTreeMap<String, Window>,
    /// Non-zero where the picture shows something that is not to be judged, such as the arm.
    pub ignore: Option<GrayImage>,
}

/// One object of the scene as the picture shows it.
#[derive(Debug, Clone)]
pub struct Sighting {
    pub name: String,
    pub found: bool,
    pub reason: Option<String>,
    pub world_from_object: Option<ObjectPose>,
    pub score: Score,
    pub gap: f64,
    pub candidate: Option<Candidate>,
}

pub fn see(image: &RgbImage, camera: &Camera, scene: &Scene, options: &Options) -> Result<Vec<Sighting>, Error> {
    let picture = Picture::new(image);
    let view = Projector::new(camera);
    let change = TableModel::fit(&picture, &view, &scene.table).map_or_else(
        || Plane::zeros(picture.small[0].width, picture.small[0].height),
        |table| table.change(&picture),
    );
    let mut all = Vec::new();
    for object in &scene.objects {
        let hidden = Hidden { mask: options.ignore.clone(), hulls: Vec::new() };
        let evidence = Evidence::new(&picture, &view, object, &change, hidden);
        let [a, _, b, _] = scene.table.corners();
        let window = options.windows.get(&object.name).copied().unwrap_or(Window { x: [a[0], b[0]], y: [a[1], b[1]] });
        all.push(evidence.search(&window));
    }
    let objects: Vec<_> = scene.objects.iter().collect();
    let chosen = assign(&objects, &all, 0.1);
    Ok(scene.objects.iter().zip(&all).zip(chosen).map(|((object, c), k)| {
        let best = k.map(|k| c[k]);
        let next = best.and_then(|b| c.iter().find(|o| o.distance(&b) > 0.025));
        Sighting {
            name: object.name.clone(),
            found: best.is_some(),
            reason: None,
            world_from_object: best.map(|b| b.pose()),
            score: best.map(|b| b.score).unwrap_or_default(),
            gap: best.map_or(0.0, |b| 1.0 - next.map_or(0.0, |n| n.score.total / b.score.total)),
            candidate: best,
        }
    }).collect())
}
