//! Whether things that were put down stand where they were put, by a photograph: independent of the hand that put them.
//!
//! A thing is gone only when nothing speaks for it: it is not found near its place, it is in full view there, and the
//! picture does not support it at the very pose. What the arm or another thing hides is believed as before.

use std::collections::BTreeMap;

use image::{GrayImage, RgbImage};

use crate::alignment::vision::{self, Error, Options, Sighting};
use crate::world::{Camera, Object, Point, Pose, Scene, WorldState, frame};

/// A thing found so near to where it was put stands there, m: what a hand may be off (8 to 19 mm in `docs/results.md`) and
/// a centimetre that things slide when they are let go.
const THERE: f64 = 0.03;
/// From this share of its outline on that something hides, a thing is not in full view. Chosen: with half of it a finger
/// across a cup hides the cup, with twice as much a cup of which a third is seen would have to be recognised.
const HIDDEN: f64 = 0.3;
/// So sure the picture has to be of a thing at its pose, where it is in full view and was not found by looking: nineteen
/// to one, as for the intervals in `docs/results.md`. What leans or lies agrees with an upright outline in part.
const SURE: f64 = 0.95;
/// What `upright` allows, rad: 5 deg (`stdlib/fluents/std.task`).
const LEANS: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Points around a thing that are asked whether something hides them.
const AROUND: usize = 24;

/// What a photograph is judged with.
pub(super) struct Confirmation<'a> {
    pub(super) photo: &'a RgbImage,
    pub(super) camera: &'a Camera,
    pub(super) scene: &'a Scene,
    /// How high some things stand, m.
    pub(super) raised: BTreeMap<String, f64>,
    /// Where the arm is in the picture.
    pub(super) mask: &'a GrayImage,
}

impl Confirmation<'_> {
    /// Returns the things of `names` that are gone from where they are believed to stand, and everything seen.
    ///
    /// # Errors
    ///
    /// [`Error::WrongSize`] when the picture is not the camera's size.
    pub(super) fn judge(
        &self,
        names: &[String],
        state: &WorldState,
    ) -> Result<(Vec<String>, Vec<Sighting>), Error> {
        let mut options = Options {
            ignore: Some(self.mask.clone()),
            raised: self.raised.clone(),
            ..Options::default()
        };
        let seen = vision::see_standing(
            self.photo,
            self.camera,
            self.scene,
            &mut options,
            &state.objects,
        )?;
        let mut gone = Vec::new();
        for name in names {
            let Some(object) = self.scene.object(name) else { continue };
            let Some(pose) = state.object(name).and_then(|known| known.world_from_object) else {
                continue;
            };
            let is_there = seen.iter().filter(|s| s.name == *name && s.found).any(|s| {
                s.world_from_object.is_some_and(|at| (at.origin() - pose.origin()).norm() < THERE)
            });
            if is_there || self.hidden(object, &pose, state) > HIDDEN {
                continue;
            }
            let ignore = Some(self.mask);
            let support =
                vision::verify(self.photo, self.camera, self.scene, object, &pose, ignore)?;
            if support.confidence < SURE || support.rms_px > self.leaning(object, &pose) {
                gone.push(name.clone());
            }
        }
        Ok((gone, seen))
    }

    /// Returns what is left, px, between an upright outline and the edges of a thing that leans by half of what `upright`
    /// allows: its top is aside by so much of its height, its base is not, and the best shift halves it (a uniform
    /// spread has a standard deviation of its width over the root of 12). Less than a pixel is not told apart.
    fn leaning(&self, object: &Object, pose: &Pose<frame::World, frame::Object>) -> f64 {
        let far = (pose.origin() - self.camera.world_from_camera.origin()).norm();
        let aside = object.shape.height() * (0.5 * LEANS).sin();
        (self.camera.intrinsics.fx * aside / far.max(1e-6) / 12_f64.sqrt()).max(1.0)
    }

    /// Returns the share of a thing's outline that the arm, or another thing before it, hides.
    fn hidden(
        &self,
        object: &Object,
        pose: &Pose<frame::World, frame::Object>,
        state: &WorldState,
    ) -> f64 {
        let eye = self.camera.world_from_camera.origin();
        let far = (pose.origin() - eye).norm();
        let before = self.scene.objects.iter().filter(|other| other.name != object.name);
        let before: Vec<_> = before
            .filter_map(|other| {
                let pose = state.object(&other.name)?.world_from_object?;
                ((pose.origin() - eye).norm() < far).then_some((other, pose))
            })
            .collect();
        let points = object.shape.outline(AROUND);
        let count = points.len().max(1);
        let hidden = points.into_iter().filter(|point| {
            let at = (*pose * Point::<frame::Object>::from(*point)).coords();
            let arm = self.camera.project(Point::<frame::World>::from(at)).is_none_or(|pixel| {
                let (u, v) = (pixel.u.round(), pixel.v.round());
                let (w, h) = (f64::from(self.mask.width()), f64::from(self.mask.height()));
                let inside = u >= 0.0 && v >= 0.0 && u < w && v < h;
                !inside || self.mask.get_pixel(u as u32, v as u32)[0] > 0
            });
            arm || before.iter().any(|(other, pose)| crosses(other, pose, eye, at))
        });
        hidden.count() as f64 / count as f64
    }
}

/// Whether the line of sight from `eye` to a point goes through a thing, by the upright cylinder about it.
fn crosses(
    other: &Object,
    pose: &Pose<frame::World, frame::Object>,
    eye: nalgebra::Vector3<f64>,
    at: nalgebra::Vector3<f64>,
) -> bool {
    /// Looks along the line: 5 mm apart over half a metre.
    const LOOKS: u32 = 100;
    let base = pose.origin();
    (1..LOOKS).any(|k| {
        // Only the last half metre of the line is near the table.
        let back = (eye - at).normalize() * 0.005 * f64::from(k);
        let p = at + back;
        (p - base).xy().norm() < other.shape.outer_radius()
            && p.z >= base.z
            && p.z <= base.z + other.shape.height()
    })
}
