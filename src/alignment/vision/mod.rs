//! Seeing: a picture → the scene's objects, placed on the table, with how sure.
//!
//! [`see`] asks for every object of the scene where the picture supports it best ([`super::placement`]),
//! keeps objects out of each other, and looks again at what stands behind something else. The paper's way,
//! mask → contour → key points → pose ([`super::segment`], [`super::key_points`]), is the second candidate;
//! the picture's edges are the referee, and where the two ways part, that is said. An object that
//! is not on the table is an answer: `found: false` with the reason. [`verify`] asks whether a picture
//! supports an object at a given pose in the air. Nothing here moves, calibrates or talks to people.
//!
//! Source: the paper, section 2.2 (segment, contour, key points, placement).

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

mod believed;
mod drawer;
mod floors;
mod identity;
mod judge;
mod look;
mod own_cut;
mod probability;
mod rival;
mod stop;
mod together;
mod unexplained;
mod upon;
mod verify;
mod wording;

use image::{GrayImage, RgbImage};
use nalgebra::Vector3;
use serde::Serialize;
use thiserror::Error as ThisError;

use super::doubt::{Doubt, Meaning, TableDoubt};
use super::error::dots_seen;
use super::evidence::Score;
use super::key_points::Refused;
use super::outline::ObjectPose;
use super::placement::Window;
use crate::world::{Camera, Object, Scene};
use together::Sought;

pub use super::overlay::annotate;
pub use believed::Believed;
pub use look::Look;
pub use stop::Asks;
pub use unexplained::Unexplained;
pub use verify::verify;
pub use wording::NO_COLOUR;

/// Why a picture could not be used at all. An object that is not found is an answer, not an error.
#[derive(Debug, Clone, PartialEq, ThisError)]
pub enum Error {
    /// The picture and the camera disagree about the picture's size.
    #[error(
        "the picture is {} x {} px, the camera's calibration is for {} x {} px",
        image.0, image.1, camera.0, camera.1
    )]
    WrongSize {
        /// Width and height of the picture, px.
        image: (u32, u32),
        /// Width and height in the calibration, px.
        camera: (u32, u32),
    },
    /// The scene has too few printed dots for a homography.
    #[error("the scene has {marks} printed dots, alignment needs at least {needed}")]
    NoMarks {
        /// Marks in the scene.
        marks: usize,
        /// Marks needed.
        needed: usize,
    },
    /// Too few printed dots were recognised.
    #[error(
        "only {found} of {marks} table marks were recognised and {needed} are needed: {}; clear the table's dots, or correct \
         the camera guess in the scene",
        dots_seen(*.dots, *.needed)
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

/// Where to look and what to leave out.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// For some objects, by name, the part of the table to search; others are searched for everywhere.
    pub windows: BTreeMap<String, Window>,
    /// Objects that are known not to stand on the table, by name, such as what is in the hand: they are not looked for, and there is
    /// no sighting of them.
    pub elsewhere: BTreeSet<String>,
    /// How high above the table some objects stand, by name, m: on another, or in it. The others stand on the table.
    pub raised: BTreeMap<String, f64>,
    /// Non-zero where the picture shows something that is not to be judged, such as the arm; the
    /// picture's size.
    pub ignore: Option<GrayImage>,
    /// For some objects, by name, masks that somebody else made of them; the picture's size. Contour and key points are those of
    /// the best of them and of our own cut; how probable a find is stays the word of our own cut, with which that was measured.
    pub masks: BTreeMap<String, Vec<GrayImage>>,
}

/// Confidence from which an object counts as found: more likely there than not. Without a finer loss to weigh, that is
/// where being wrong either way is equally likely.
pub const FOUND: f64 = 0.5;

/// The two independent ways to a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Way {
    /// The solid's outline fitted to the picture's edges, without a mask.
    ModelFit,
    /// Mask, contour, key points: the paper's way.
    KeyPoints,
}

/// What the mask of a sighting is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MaskIs {
    /// The outline of the placed solid: no cut agrees with it.
    Silhouette,
    /// The picture's own cut.
    OwnCut,
    /// One that somebody else made.
    Offered,
}

/// What the way by mask, contour and key points came to, and what speaks for or against the pose.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Checks {
    /// Overlap of the picture's own cut with the silhouette of the pose; `None` when nothing was cut.
    pub mask_iou: Option<f64>,
    /// Share of the visible silhouette, by whole edges, that shows no edge in the picture.
    pub missing: f64,
    /// Whether the key points that are reported were measured on the contour.
    pub measured: bool,
    /// Where the model fit alone puts the object: x and y in m, yaw in rad.
    pub fit_place: Option<[f64; 3]>,
    /// Where the key points alone put the object: x and y in m, yaw in rad.
    pub key_point_place: Option<[f64; 3]>,
    /// One standard deviation of that position, m.
    pub key_point_std: f64,
    /// How far the two ways put the object apart, m.
    pub apart: Option<f64>,
    /// Why the contour was of no use.
    pub refused: Option<Refused>,
    /// Whether the contour was cut near the fit's outline, because the box alone gave none of use.
    pub helped: bool,
    /// Whether contour and key points are those of a mask that somebody else made.
    pub is_others: bool,
    /// What speaks for something else.
    pub identity: identity::Identity,
    /// How far away the places are that it may be at instead, m.
    pub elsewhere: f64,
    /// What the edges say against the table's place and the object's size.
    pub meaning: Meaning,
}

/// One object of the scene as the picture shows it.
#[derive(Debug, Clone)]
pub struct Sighting {
    /// The object's name.
    pub name: String,
    /// Whether it is on the table in this picture, as far as one can be sure.
    pub found: bool,
    /// Whether its outline fits where it most probably is, wherever else it fits as well; never of what is clear.
    pub fits: bool,
    /// Why it is not found, or what speaks against a pose that was found.
    pub reason: Option<String>,
    /// What the picture says against the scene although the object is found: the pose may be off by more
    /// than its standard deviation.
    pub ambiguous: Option<String>,
    /// Where it stands, when found; upright by assumption, and as high as [`Options::raised`] says.
    pub world_from_object: Option<ObjectPose>,
    /// Where it most probably is when it was not found, if anywhere.
    pub likeliest: Option<ObjectPose>,
    /// Where it stood before, when it was not found and this picture does not show that it is gone from there.
    pub kept: Option<ObjectPose>,
    /// One standard deviation of its position, m: of the worst direction on the table, if that is where the scene and the camera
    /// say. Of what was not found it counts that it may be elsewhere.
    pub std: f64,
    /// One standard deviation of its position if it stands there at all, m; what was found has no other.
    pub std_if_there: f64,
    /// One standard deviation of its turn about z, rad; 0 for a cylinder.
    pub yaw_std: f64,
    /// How probable it is that it stands there, 0 to 1.
    pub confidence: f64,
    /// What the best pose scored, found or not.
    pub score: Score,
    /// How far behind the best other place is, as a share of the best score.
    pub gap: f64,
    /// `[u0, v0, u1, v1]` of its silhouette inside the picture, px.
    pub bbox: [f64; 4],
    /// Corners and rim points that are seen, px: the contour's own when it has them, else the placed solid's.
    pub key_points: Vec<[f64; 2]>,
    /// The silhouette's outline, px.
    pub hull: Vec<[f64; 2]>,
    /// 255 where the picture shows the object, or would if it were at its likeliest place; the picture's size.
    pub mask: Option<GrayImage>,
    /// What that mask is.
    pub mask_is: MaskIs,
    /// Which way the pose came.
    pub way: Way,
    /// What was checked.
    pub checks: Checks,
}

impl Sighting {
    /// Returns where a thing that was not found fits all the same: what is there is not something that nobody declared.
    pub(super) fn doubted(&self) -> Option<ObjectPose> {
        let is_doubted = self.fits && !self.found && self.kept.is_none();
        self.likeliest.filter(|_| is_doubted)
    }

    /// Words how a thing at a pose is turned, with how unsure that is where it is not seen.
    pub fn turned(&self, pose: &ObjectPose) -> String {
        wording::turned(pose.yaw(), self.yaw_std)
    }
}

/// Whether a picture supports an object at a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Support {
    /// The agreement's parts.
    pub score: Score,
    /// How sure that the object is there, 0 to 1.
    pub confidence: f64,
    /// How the outline would have to move in the picture to meet the edges best, px (u, v).
    pub shift_px: [f64; 2],
    /// What is left of the distances between outline and edges after that, px.
    pub rms_px: f64,
}

/// Score at which an object is as likely there as not, and the width of the step. Chosen between what was measured:
/// absent objects score up to 0.3 (belief 0.05), present ones from 0.57 (0.98). With a middle at half or twice of it
/// all or nothing is found; with half of the width a score at the middle decides alone, with twice as much absent
/// ones are believed to 0.18.
const HALF_BELIEVED: f64 = 0.42;
const BELIEF_WIDTH: f64 = 0.04;
/// How probable a wrong size may be of one that vouches for the table: no more likely than not.
const SIZE_DOUBTED: f64 = 0.5;

/// Returns how sure a total score alone makes, 0 to 1.
///
fn belief(score: &Score) -> f64 {
    1.0 / (1.0 + (-(score.total - HALF_BELIEVED) / BELIEF_WIDTH).exp())
}

fn check_size(image: &RgbImage, camera: &Camera) -> Result<(), Error> {
    let size = (camera.intrinsics.width, camera.intrinsics.height);
    if image.dimensions() == size {
        Ok(())
    } else {
        Err(Error::WrongSize { image: image.dimensions(), camera: size })
    }
}

/// Finds the scene's objects, standing on the table, in a picture of a calibrated camera: [`Look::see`] of a picture of which nothing
/// else is asked.
///
/// # Errors
///
/// [`Error::WrongSize`] when the picture is not the camera's size.
pub fn see(
    image: &RgbImage,
    camera: &Camera,
    scene: &Scene,
    options: &Options,
) -> Result<Vec<Sighting>, Error> {
    Ok(Look::new(image, camera, scene)?.see(options))
}

impl Look<'_> {
    /// Finds the scene's objects, standing on the table.
    ///
    /// One sighting per object, in the scene's order, whether found or not; none of what [`Options::elsewhere`] names. None at
    /// all when the look was stopped. What looks nearer than on the table, over another thing, is looked for on that.
    pub fn see(&self, options: &Options) -> Vec<Sighting> {
        let Self { scene, camera, view, .. } = self;
        // What slides in a case is looked for along its rail.
        let is_sought = |object: &&Object| {
            scene.drawer(&object.name).is_none() && !options.elsewhere.contains(&object.name)
        };
        let on_table = scene.objects.iter().filter(is_sought);
        let everything = together::Everything {
            change: self.change(),
            picture: &self.picture,
            table: &scene.table,
            eye: view.eye(),
            ignore: options.ignore.clone().map(Arc::new),
            stop: &self.stop,
            sought: on_table.map(|object| Sought::of(object, camera, options)).collect(),
        };
        let mut sightings = everything.judged();
        if self.is_stopped() {
            return Vec::new();
        }
        blame(&mut sightings, view.eye().z);
        for (i, ((sighting, _), sought)) in sightings.iter_mut().zip(&everything.sought).enumerate()
        {
            if let Some((others, share)) = everything.only_colour_tells(i) {
                judge::without_colour(sighting, &others, share);
            }
            judge::decide(sighting);
            let raised = |pose: ObjectPose| {
                ObjectPose::from_parts(
                    pose.origin() + Vector3::z() * sought.height,
                    pose.rotation(),
                )
            };
            sighting.world_from_object = sighting.world_from_object.map(raised);
            sighting.likeliest = sighting.likeliest.map(raised);
        }
        let mut seen: Vec<Sighting> = sightings.into_iter().map(|s| s.0).collect();
        if !scene.drawers.is_empty() {
            self.drawers(options.ignore.as_ref(), &mut seen);
        }
        self.upon_others(&seen, options).unwrap_or(seen)
    }

    /// Adds what slides in cases to what was seen, in the scene's order, and tells the fronts of the cases from their backs.
    fn drawers(&self, ignore: Option<&GrayImage>, seen: &mut Vec<Sighting>) {
        let Some(table) = self.table() else { return };
        let Self { picture, view, scene, .. } = self;
        let looking = drawer::Looking { picture, view, table, scene, ignore };
        for (at, object) in scene.objects.iter().enumerate() {
            let Some(drawer) = scene.drawer(&object.name) else { continue };
            let Some(case) = seen.iter_mut().find(|sighting| sighting.name == drawer.case) else {
                continue;
            };
            let Some(drawn) = looking.drawn(drawer, case) else { continue };
            if case.found {
                case.world_from_object = Some(drawn.case);
            }
            seen.insert(at.min(seen.len()), drawn.tray);
        }
    }
}

/// Divides what looks wrong between the things and the table under all of them.
fn blame(sightings: &mut [(Sighting, Option<Doubt>)], eye_height: f64) {
    // The table is one for all: what each says of it tells how far the others may be off.
    let told: Vec<Doubt> = sightings.iter().filter_map(|s| s.1).collect();
    let table = TableDoubt::of(&told);
    for (sighting, doubt) in &mut *sightings {
        judge::weigh(sighting, doubt.as_ref(), table.as_ref(), eye_height);
    }
    // Who does not look as said may be right and the table wrong, unless another that looks as it should
    // vouches for the table.
    let sound: Vec<bool> = sightings
        .iter()
        .map(|(s, _)| {
            let meaning = &s.checks.meaning;
            s.confidence >= FOUND && meaning.size + meaning.raised < SIZE_DOUBTED
        })
        .collect();
    let refused: Vec<bool> = sightings.iter().map(|(s, _)| s.confidence < FOUND).collect();
    for i in 0..sightings.len() {
        let vouched = (0..sound.len()).any(|j| j != i && sound[j]);
        let odd = (0..refused.len()).any(|j| refused[j] && sightings[j].1.is_some()) || !sound[i];
        if !vouched && odd {
            let blamed: Vec<Doubt> = (0..refused.len())
                .filter(|&j| j == i || refused[j])
                .filter_map(|j| sightings[j].1)
                .collect();
            if let Some(blamed) = TableDoubt::to_blame(&blamed) {
                let (sighting, doubt) = &mut sightings[i];
                judge::suspect(sighting, doubt.as_ref(), &blamed, eye_height);
            }
        }
    }
}
