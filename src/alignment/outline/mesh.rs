//! The visible lines of a mesh, projected: what an eye sees of it is [`crate::world::mesh::lines`]'s.

use nalgebra::{Point3, Vector2};

use super::{Kind, ObjectPose, Outline, Projector, Sample, convex_hull};
use crate::world::Mesh;

/// Up to so many points on a side the lines are those of the nearest direction that is worked out: a search at half and at
/// a quarter of the picture's size asks for so many ([`crate::alignment::placement`]).
const ROUGHLY: usize = 8;

/// Returns the lines of a mesh; `None` when none is seen or part of one is behind the camera.
pub(super) fn lines(
    view: &Projector,
    mesh: &Mesh,
    pose: &ObjectPose,
    per_edge: usize,
) -> Option<Outline> {
    let eye = (pose.isometry().inverse() * Point3::from(view.eye())).coords;
    let points = view.of(pose);
    let (rough, exact);
    let seen = if per_edge <= ROUGHLY {
        rough = mesh.roughly_seen(&eye, per_edge);
        &*rough
    } else {
        exact = mesh.seen(&eye, per_edge);
        &exact
    };
    let mut samples = Vec::with_capacity(seen.spots.len());
    for spot in &seen.spots {
        let half = spot.along * (0.5 * spot.length);
        let (before, pixel, after) =
            (points.pixel(spot.at - half)?, points.pixel(spot.at)?, points.pixel(spot.at + half)?);
        let along = after - before;
        let length = along.norm() * spot.shows;
        // A line towards the eye has no length in the picture.
        let Some(along) = along.try_normalize(1e-6) else { continue };
        let normal = Vector2::new(-along.y, along.x);
        let out = points.pixel(spot.at + spot.out * spot.length.max(1e-3))? - pixel;
        let normal = if normal.dot(&out) < 0.0 { -normal } else { normal };
        let kind = if spot.is_rim { Kind::Silhouette } else { Kind::Inner };
        samples.push(Sample { pixel, normal, body: spot.at, length, kind, edge: spot.line });
    }
    let within = seen.within.iter().filter_map(|p| points.pixel(*p)).collect();
    Some(Outline { samples, within, ..Outline::default() }).filter(|o| !o.samples.is_empty())
}

/// Returns convex polygons that together are a mesh's silhouette, px: those of its convex parts.
pub(super) fn pieces(
    view: &Projector,
    mesh: &Mesh,
    pose: &ObjectPose,
) -> Option<Vec<Vec<Vector2<f64>>>> {
    let points = view.of(pose);
    let piece = |part: &Vec<_>| -> Option<Vec<Vector2<f64>>> {
        let pixels: Option<Vec<Vector2<f64>>> = part.iter().map(|p| points.pixel(*p)).collect();
        Some(convex_hull(&pixels?))
    };
    mesh.parts().iter().map(piece).collect()
}
