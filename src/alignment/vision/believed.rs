//! What a picture says of a thing at the place where it is believed to stand: shown there, hidden there, or gone.
//!
//! It does not look for the thing anywhere else. Gone is what is in full view there while the picture does not support it at the
//! very pose; what the arm or another thing hides is believed as before.

use image::GrayImage;
use nalgebra::Vector3;

use super::together::SAME_FLOOR;
use super::{Look, ObjectPose, Sighting};
use crate::alignment::outline::Outline;
use crate::world::{Object, ObjectState, Point, Pose, frame, support};

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
/// Points on each edge of its outline, which is a polygon of them.
const HULL_POINTS: usize = 4;

/// A picture, and what is known of everything in it.
pub struct Believed<'a> {
    /// The picture, its camera, and what may be in it.
    pub look: &'a Look<'a>,
    /// Where things are, as far as it is known.
    pub objects: &'a [ObjectState],
    /// Non-zero where the arm is in the picture.
    pub arm: Option<&'a GrayImage>,
}

impl Believed<'_> {
    /// Whether a thing is gone from where it is believed to stand: in full view there, and not supported by the picture.
    pub fn is_gone(&self, object: &Object, pose: &ObjectPose) -> bool {
        if self.hidden(object, pose) > HIDDEN {
            return false;
        }
        let support = self.look.verify(object, pose, self.arm);
        support.confidence < SURE || support.rms_px > self.leaning(object, pose)
    }

    /// Takes note of what was not found, stood somewhere before, and is not gone from there.
    pub(super) fn keep(&self, seen: &mut [Sighting]) {
        for sighting in seen.iter_mut().filter(|sighting| !sighting.found) {
            let known = self.objects.iter().find(|known| known.name == sighting.name);
            let (Some(object), Some(pose)) =
                (self.look.scene.object(&sighting.name), known.and_then(|o| o.world_from_object))
            else {
                continue;
            };
            let below = support::below(self.look.scene, self.objects, object, &pose);
            let stands = (pose.origin().z - below.height).abs() < SAME_FLOOR;
            if stands && !self.is_gone(object, &pose) {
                let outline = Outline::whole(&self.look.view, &object.shape, &pose, HULL_POINTS);
                sighting.hull = outline.hull.iter().map(|p| [p.x, p.y]).collect();
                sighting.kept = Some(pose);
            }
        }
    }

    /// Returns what is left, px, between an upright outline and the edges of a thing that leans by half of what `upright`
    /// allows: its top is aside by so much of its height, its base is not, and the best shift halves it (a uniform
    /// spread has a standard deviation of its width over the root of 12). Less than a pixel is not told apart.
    fn leaning(&self, object: &Object, pose: &ObjectPose) -> f64 {
        let camera = self.look.camera;
        let far = (pose.origin() - camera.world_from_camera.origin()).norm();
        let aside = object.shape.height() * (0.5 * LEANS).sin();
        (camera.intrinsics.fx * aside / far.max(1e-6) / 12_f64.sqrt()).max(1.0)
    }

    /// Returns the share of a thing's outline that the arm, or another thing before it, hides.
    fn hidden(&self, object: &Object, pose: &ObjectPose) -> f64 {
        let eye = self.look.camera.world_from_camera.origin();
        let far = (pose.origin() - eye).norm();
        let before = self.look.scene.objects.iter().filter(|other| other.name != object.name);
        let before: Vec<_> = before
            .filter_map(|other| {
                let known = self.objects.iter().find(|known| known.name == other.name)?;
                let pose = known.world_from_object?;
                ((pose.origin() - eye).norm() < far).then_some((other, pose))
            })
            .collect();
        let points = object.shape.outline(AROUND);
        let count = points.len().max(1);
        let hidden = points.into_iter().filter(|point| {
            let at = (*pose * Point::<frame::Object>::from(*point)).coords();
            self.is_out_of_view(at)
                || before.iter().any(|(other, pose)| crosses(other, pose, eye, at))
        });
        hidden.count() as f64 / count as f64
    }

    /// Whether a point is beside the picture or where the arm is in it.
    fn is_out_of_view(&self, at: Vector3<f64>) -> bool {
        let (w, h) = self.look.image.dimensions();
        self.look.camera.project(Point::<frame::World>::from(at)).is_none_or(|pixel| {
            let (u, v) = (pixel.u.round(), pixel.v.round());
            let inside = u >= 0.0 && v >= 0.0 && u < f64::from(w) && v < f64::from(h);
            !inside
                || self.arm.is_some_and(|arm| {
                    let (u, v) = (u as u32, v as u32);
                    u < arm.width() && v < arm.height() && arm.get_pixel(u, v)[0] > 0
                })
        })
    }
}

/// Whether the line of sight from `eye` to a point goes through a thing, by the upright cylinder about it.
fn crosses(
    other: &Object,
    pose: &Pose<frame::World, frame::Object>,
    eye: Vector3<f64>,
    at: Vector3<f64>,
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
