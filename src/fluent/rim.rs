//! Rims: the upper edge of a vessel in any attitude, and the part of it water would leave by.

use nalgebra::Vector3;

use crate::world::object::Object;
use crate::world::{Point, Pose, frame};

/// Points of an outline are this many to a full turn or to an edge: under 1 mm apart on a cup.
const FINENESS: usize = 96;
/// Rim points this close to the lowest count as the lip, m: water bulges that far over an edge.
const WETTED: f64 = 0.002;
/// Below this tilt, rad, any point of the rim may still become the lip.
const UPRIGHT: f64 = 5.0 * std::f64::consts::PI / 180.0;

type WorldFromObject = Pose<frame::World, frame::Object>;

/// Returns the centre of the rim (of the top, for a solid thing) in the world, m.
pub fn rim_centre(object: &Object, world_from_object: &WorldFromObject) -> Vector3<f64> {
    (*world_from_object * Point::new(0.0, 0.0, object.shape.height())).coords()
}

/// Returns the middle of the axis in the world, m.
pub(super) fn middle(object: &Object, world_from_object: &WorldFromObject) -> Vector3<f64> {
    (*world_from_object * Point::new(0.0, 0.0, 0.5 * object.shape.height())).coords()
}

/// Returns the height of the lowest point of the whole object in the world, m.
///
/// Source: the support function of its shape along −z.
pub fn lowest_of(object: &Object, world_from_object: &WorldFromObject) -> f64 {
    let down = world_from_object.rotation().inverse() * -Vector3::z();
    world_from_object.origin().z - object.shape.reach(&down)
}

/// Returns the rim as points in the world, m.
pub(super) fn outline(object: &Object, world_from_object: &WorldFromObject) -> Vec<Vector3<f64>> {
    let z = object.shape.height();
    let at = |x: f64, y: f64| (*world_from_object * Point::new(x, y, z)).coords();
    match object.shape.faces() {
        None => (0..FINENESS)
            .map(|i| {
                let radius = object.shape.rim_radius();
                let (sin, cos) = (std::f64::consts::TAU * i as f64 / FINENESS as f64).sin_cos();
                at(radius * cos, radius * sin)
            })
            .collect(),
        Some([x, y]) => {
            let (hx, hy) = (x / 2.0, y / 2.0);
            let corners = [(-hx, -hy), (hx, -hy), (hx, hy), (-hx, hy)];
            let edge = |k: usize| {
                let ((x0, y0), (x1, y1)) = (corners[k], corners[(k + 1) % 4]);
                (0..FINENESS).map(move |i| {
                    let s = i as f64 / FINENESS as f64;
                    at(x0 + s * (x1 - x0), y0 + s * (y1 - y0))
                })
            };
            (0..4).flat_map(edge).collect()
        }
    }
}

/// Where water leaves a vessel: one point when it is tilted, the whole rim while it stands.
#[derive(Debug, Clone)]
pub(super) struct Lip {
    /// The middle of the lowest part of the rim, m.
    pub(super) point: Vector3<f64>,
    /// Height of the lowest rim point, m.
    pub(super) height: f64,
    /// While the vessel stands upright: every point that may become the lip.
    pub(super) open: Vec<Vector3<f64>>,
}

/// Returns the lip of a vessel.
pub(super) fn lip(object: &Object, world_from_object: &WorldFromObject) -> Lip {
    let rim = outline(object, world_from_object);
    let height = rim.iter().fold(f64::INFINITY, |low, p| low.min(p.z));
    if world_from_object.tilt() < UPRIGHT {
        return Lip { point: rim_centre(object, world_from_object), height, open: rim };
    }
    let low: Vec<_> = rim.iter().filter(|p| p.z <= height + WETTED).collect();
    let point = low.iter().copied().sum::<Vector3<f64>>() / low.len() as f64;
    Lip { point, height, open: Vec::new() }
}
