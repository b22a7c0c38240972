//! What of an object a camera sees as lines: its silhouette and the edges inside it.
//!
//! In: a camera, a solid, a pose (any, standing or held). Out: points along the visible edges with their
//! normals in the picture. Each point remembers where it sits on the solid, so that a fit can ask how it
//! moves when the pose does; for the sides of a cylinder, which touch the silhouette in a line that slides
//! as the cylinder moves, this is right to first order (the envelope). Other objects in front are the
//! caller's business.

mod lathe;
mod mesh;
mod projector;

use std::f64::consts::{PI, TAU};

use nalgebra::{Vector2, Vector3};

use crate::world::Shape;
use projector::PointsOf;

pub use projector::{ObjectPose, Projector};

/// What a visible line is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Between the object and what is behind it.
    Silhouette,
    /// Between two visible faces.
    Inner,
}

/// A point of a visible edge.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Where it is in the picture, px; it may lie outside.
    pub pixel: Vector2<f64>,
    /// Unit normal of the edge in the picture; of a silhouette, pointing out of the object.
    pub normal: Vector2<f64>,
    /// Where it sits on the object, m, object frame.
    pub body: Vector3<f64>,
    /// Length of outline it stands for, px.
    pub length: f64,
    /// What its edge is.
    pub kind: Kind,
    /// Which edge of the outline; samples of one edge follow each other.
    pub edge: usize,
}

/// The visible edges of an object.
#[derive(Debug, Clone, Default)]
pub struct Outline {
    /// Points along them.
    pub samples: Vec<Sample>,
    /// The silhouette's corner points (of a cylinder: many), in order around it, px.
    pub hull: Vec<Vector2<f64>>,
    /// Corners (cuboid) or the rims' extreme points (cylinder), px.
    pub key_points: Vec<Vector2<f64>>,
    /// Of a body that is not convex: points of its surface that are seen, px.
    pub within: Vec<Vector2<f64>>,
    /// Of a body that is not convex, when it was asked for whole: convex polygons that together are its silhouette, px.
    pub pieces: Vec<Vec<Vector2<f64>>>,
}

impl Outline {
    /// Returns the outline of a solid, `per_edge` points on each edge.
    ///
    /// Empty when part of the object is behind the camera or the camera is inside it.
    pub fn new(view: &Projector, shape: &Shape, pose: &ObjectPose, per_edge: usize) -> Self {
        let lines = Self::lines(view, shape, pose, per_edge);
        if lines.samples.is_empty() { lines } else { lines.closed(view, shape, pose) }
    }

    /// As [`Self::new`] without the silhouette's corner points, which cost as much as the lines; empty as there.
    pub fn lines(view: &Projector, shape: &Shape, pose: &ObjectPose, per_edge: usize) -> Self {
        match shape {
            Shape::Cuboid { size } => cuboid(view, *size, pose, per_edge),
            Shape::Cylinder { radius, height } => cylinder(view, *radius, *height, pose, per_edge),
            Shape::Lathe { profile } => lathe::lines(view, profile, pose, per_edge),
            Shape::Mesh { mesh } => mesh::lines(view, mesh, pose, per_edge),
            Shape::Mug { mug } => mesh::lines(view, mug.outside(), pose, per_edge),
        }
        .unwrap_or_default()
    }

    /// Adds the silhouette's corner points to the lines of the same solid at the same pose; empty as in [`Self::new`].
    #[must_use]
    pub fn closed(mut self, view: &Projector, shape: &Shape, pose: &ObjectPose) -> Self {
        let points = view.of(pose);
        let hull = match shape {
            Shape::Cuboid { size } => corners(*size).iter().map(|p| points.pixel(*p)).collect(),
            Shape::Cylinder { radius, height } => cylinder_rims(view, *radius, *height, pose),
            Shape::Lathe { profile } => lathe::rims(view, profile, pose),
            Shape::Mesh { mesh } => mesh.hull().iter().map(|p| points.pixel(*p)).collect(),
            Shape::Mug { mug } => mug.outside().hull().iter().map(|p| points.pixel(*p)).collect(),
        };
        let Some(hull): Option<Vec<Vector2<f64>>> = hull else { return Self::default() };
        self.hull = convex_hull(&hull);
        self
    }

    /// As [`Self::new`], with the pieces of a silhouette that is not convex.
    pub fn whole(view: &Projector, shape: &Shape, pose: &ObjectPose, per_edge: usize) -> Self {
        let mut outline = Self::new(view, shape, pose, per_edge);
        let surface = match shape {
            Shape::Mesh { mesh } => Some(mesh),
            Shape::Mug { mug } => Some(mug.outside()),
            Shape::Cuboid { .. } | Shape::Cylinder { .. } | Shape::Lathe { .. } => None,
        };
        if let Some(surface) = surface.filter(|_| !outline.hull.is_empty()) {
            outline.pieces = mesh::pieces(view, surface, pose).unwrap_or_default();
        }
        outline
    }

    /// Returns convex polygons that together are the silhouette, px: its hull, where it has no pieces.
    pub fn polygons(&self) -> &[Vec<Vector2<f64>>] {
        if self.pieces.is_empty() { std::slice::from_ref(&self.hull) } else { &self.pieces }
    }

    /// Returns the bounding box of the silhouette `[u0, v0, u1, v1]`, px.
    pub fn bounds(&self) -> [f64; 4] {
        self.hull
            .iter()
            .fold([f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY], |b, p| {
                [b[0].min(p.x), b[1].min(p.y), b[2].max(p.x), b[3].max(p.y)]
            })
    }

    /// Returns whether a pixel lies inside the silhouette.
    pub fn contains(&self, p: Vector2<f64>) -> bool {
        self.polygons().iter().any(|polygon| inside_convex(polygon, p))
    }

    /// Returns how far a pixel is from the silhouette's border, px; negative inside. Where pieces of it overlap a pixel may
    /// be deeper than is said.
    pub fn depth(&self, p: Vector2<f64>) -> f64 {
        let depths = self.polygons().iter().map(|polygon| depth(polygon, p));
        depths.fold(f64::INFINITY, f64::min)
    }

    /// Returns the middle of the silhouette's corner points, px.
    pub fn middle(&self) -> Vector2<f64> {
        self.hull.iter().sum::<Vector2<f64>>() / self.hull.len().max(1) as f64
    }
}

/// Returns how far a point is from the border of a convex polygon, px; negative inside.
pub(super) fn depth(polygon: &[Vector2<f64>], p: Vector2<f64>) -> f64 {
    let mut least = f64::INFINITY;
    for (i, a) in polygon.iter().enumerate() {
        let along = polygon[(i + 1) % polygon.len()] - a;
        let t = ((p - a).dot(&along) / along.norm_squared().max(1e-12)).clamp(0.0, 1.0);
        least = least.min((a + t * along - p).norm());
    }
    if inside_convex(polygon, p) { -least } else { least }
}

/// Returns whether a point lies inside a convex polygon given in order, either way round.
pub(super) fn inside_convex(polygon: &[Vector2<f64>], p: Vector2<f64>) -> bool {
    let mut sign = 0.0;
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let cross = (b - a).perp(&(p - a));
        if cross * sign < 0.0 {
            return false;
        }
        if cross.abs() > 1e-12 {
            sign = cross.signum();
        }
    }
    polygon.len() >= 3
}

/// Returns the convex hull, counter-clockwise with v down being clockwise to the eye (monotone chain).
pub(super) fn convex_hull(points: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
    let mut sorted = points.to_vec();
    sorted.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup_by(|a, b| (*a - *b).norm() < 1e-9);
    if sorted.len() < 3 {
        return sorted;
    }
    let mut hull = Vec::with_capacity(sorted.len() + 1);
    half_hull(&mut hull, sorted.iter());
    half_hull(&mut hull, sorted.iter().rev());
    hull
}

/// Adds one side of a convex hull, of points in the order of their columns, without its last point.
fn half_hull<'p>(hull: &mut Vec<Vector2<f64>>, points: impl Iterator<Item = &'p Vector2<f64>>) {
    let first = hull.len();
    for &p in points {
        while hull.len() >= first + 2 {
            let (a, b) = (hull[hull.len() - 2], hull[hull.len() - 1]);
            if (b - a).perp(&(p - a)) > 0.0 {
                break;
            }
            hull.pop();
        }
        hull.push(p);
    }
    hull.pop();
}

/// Adds an edge of body points; the normal is turned away from `inside` (px) for silhouettes.
fn push_edge(
    samples: &mut Vec<Sample>,
    points: &PointsOf,
    body: impl Fn(f64) -> Vector3<f64>,
    n: usize,
    kind: Kind,
    inside: Vector2<f64>,
) -> Option<()> {
    let edge = samples.last().map_or(0, |sample| sample.edge + 1);
    let mut before = points.pixel(body(0.0))?;
    for i in 0..n {
        let t = (i as f64 + 0.5) / n as f64;
        let body_at = body(t);
        let pixel = points.pixel(body_at)?;
        let after = points.pixel(body((i + 1) as f64 / n as f64))?;
        let along = after - before;
        let length = along.norm();
        let mut normal = Vector2::new(-along.y, along.x) / length.max(1e-9);
        if normal.dot(&(pixel - inside)) < 0.0 {
            normal = -normal;
        }
        if length > 1e-6 {
            samples.push(Sample { pixel, normal, body: body_at, length, kind, edge });
        }
        before = after;
    }
    Some(())
}

/// Returns the corners of a cuboid, m, object frame: of the bits of a corner's number each says whether it lies at the upper
/// end of an axis.
fn corners(size: Vector3<f64>) -> [Vector3<f64>; 8] {
    let end = |i: usize, axis: usize, half: f64| if i >> axis & 1 == 0 { -half } else { half };
    std::array::from_fn(|i| {
        let z = if i & 4 == 0 { 0.0 } else { size.z };
        Vector3::new(end(i, 0, size.x / 2.0), end(i, 1, size.y / 2.0), z)
    })
}

fn cuboid(
    view: &Projector,
    size: Vector3<f64>,
    pose: &ObjectPose,
    per_edge: usize,
) -> Option<Outline> {
    let eye = pose.isometry().inverse() * nalgebra::Point3::from(view.eye());
    // Faces by axis and side: x-, x+, y-, y+, z-, z+.
    let low = Vector3::new(-size.x / 2.0, -size.y / 2.0, 0.0);
    let high = Vector3::new(size.x / 2.0, size.y / 2.0, size.z);
    let visible = |axis: usize, side: usize| {
        if side == 0 { eye[axis] < low[axis] } else { eye[axis] > high[axis] }
    };
    let corners = corners(size);
    let points = view.of(pose);
    let mut pixels = [Vector2::zeros(); 8];
    for (pixel, corner) in pixels.iter_mut().zip(&corners) {
        *pixel = points.pixel(*corner)?;
    }
    let inside = pixels.iter().sum::<Vector2<f64>>() / 8.0;
    let mut outline = Outline {
        // Of twelve edges nine are seen at most.
        samples: Vec::with_capacity(9 * per_edge),
        ..Outline::default()
    };
    let mut seen = [false; 8];
    for axis in 0..3 {
        let (other, third) = ((axis + 1) % 3, (axis + 2) % 3);
        for (s, t) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let faces = usize::from(visible(other, s)) + usize::from(visible(third, t));
            if faces == 0 {
                continue;
            }
            let from = (s << other) | (t << third);
            let to = from | (1 << axis);
            seen[from] = true;
            seen[to] = true;
            let (a, b) = (corners[from], corners[to]);
            let kind = if faces == 1 { Kind::Silhouette } else { Kind::Inner };
            let along = |u| a + (b - a) * u;
            push_edge(&mut outline.samples, &points, along, per_edge, kind, inside)?;
        }
    }
    outline.key_points = (0..8).filter(|&i| seen[i]).map(|i| pixels[i]).collect();
    Some(outline)
}

/// A cylinder before a camera.
struct Round {
    points: PointsOf,
    radius: f64,
    /// The camera, m, object frame.
    eye: Vector3<f64>,
    /// Where the camera is about the axis, rad.
    facing: f64,
    /// How far from there the sides turn away, rad; `None` from above or below.
    opening: Option<f64>,
}

impl Round {
    fn new(view: &Projector, radius: f64, pose: &ObjectPose) -> Self {
        let eye = (pose.isometry().inverse() * nalgebra::Point3::from(view.eye())).coords;
        let away = eye.xy().norm();
        // The generators whose tangent plane holds the camera: cos(φ - φ_eye) = r / |eye|.
        let opening = (away > radius * 1.0001).then(|| (radius / away).acos());
        Self { points: view.of(pose), radius, eye, facing: eye.y.atan2(eye.x), opening }
    }

    fn at(&self, phi: f64) -> Vector2<f64> {
        Vector2::new(self.radius * phi.cos(), self.radius * phi.sin())
    }

    /// Returns the lines along which the sides turn away.
    fn sides(&self) -> Option<[Vector2<f64>; 2]> {
        let half = self.opening?;
        Some([self.at(self.facing - half), self.at(self.facing + half)])
    }
}

/// Returns points whose hull is the silhouette of a cylinder, px; `None` when one is behind the camera.
fn cylinder_rims(
    view: &Projector,
    radius: f64,
    height: f64,
    pose: &ObjectPose,
) -> Option<Vec<Vector2<f64>>> {
    let round = Round::new(view, radius, pose);
    let around = (0..32).map(|i| round.at(TAU * f64::from(i) / 32.0 + round.facing));
    let mut rims = Vec::with_capacity(68);
    for on_rim in around.chain(round.sides().into_iter().flatten()) {
        for z in [0.0, height] {
            rims.push(round.points.pixel(on_rim.push(z))?);
        }
    }
    Some(rims)
}

fn cylinder(
    view: &Projector,
    radius: f64,
    height: f64,
    pose: &ObjectPose,
    per_edge: usize,
) -> Option<Outline> {
    let round = Round::new(view, radius, pose);
    let (sees_top, sees_bottom) = (round.eye.z > height, round.eye.z < 0.0);
    if round.opening.is_none() && !sees_top && !sees_bottom {
        return None;
    }
    let rim = |phi: f64, z: f64| round.at(phi).push(z);
    let (points, facing) = (&round.points, round.facing);
    let inside = points.pixel(Vector3::new(0.0, 0.0, height / 2.0))?;
    let mut outline = Outline::default();
    let samples = &mut outline.samples;
    for side in round.sides().into_iter().flatten() {
        for z in [0.0, height] {
            outline.key_points.push(points.pixel(side.push(z))?);
        }
        let side = |t: f64| side.push(t * height);
        push_edge(samples, points, side, per_edge, Kind::Silhouette, inside)?;
    }
    for (z, sees_face) in [(0.0, sees_bottom), (height, sees_top)] {
        let half = round.opening.unwrap_or(0.0);
        if half > 0.0 {
            // The near half of the rim is always seen; it lies inside when the face beyond is seen too.
            let near = |t: f64| rim(facing - half + 2.0 * half * t, z);
            let kind = if sees_face { Kind::Inner } else { Kind::Silhouette };
            push_edge(samples, points, near, 2 * per_edge, kind, inside)?;
            outline.key_points.push(points.pixel(rim(facing, z))?);
        }
        if sees_face {
            let far = |t: f64| rim(facing + half + (TAU - 2.0 * half) * t, z);
            push_edge(samples, points, far, 2 * per_edge, Kind::Silhouette, inside)?;
            outline.key_points.push(points.pixel(rim(facing + PI, z))?);
        }
    }
    Some(outline)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{Camera, Intrinsics, Profile};

    fn view() -> Projector {
        Projector::new(&Camera::looking(
            Intrinsics::centred(900.0, 1280, 720),
            Vector3::new(1.25, 0.0, 0.85),
            Vector3::new(0.6, 0.0, 0.05),
        ))
    }

    #[test]
    fn a_cuboid_seen_from_above_shows_nine_edges_and_seven_corners() {
        let shape = Shape::Cuboid { size: Vector3::new(0.065, 0.065, 0.14) };
        let outline = Outline::new(&view(), &shape, &ObjectPose::upright(0.6, 0.1, 0.0, 0.4), 10);
        assert_eq!(outline.samples.len(), 90);
        assert_eq!(outline.key_points.len(), 7);
        assert_eq!(outline.hull.len(), 6);
        let silhouette = outline.samples.iter().filter(|s| s.kind == Kind::Silhouette).count();
        assert_eq!(silhouette, 60);
    }

    #[test]
    fn a_lathe_of_straight_sides_is_seen_as_a_cylinder() {
        let pose = ObjectPose::upright(0.6, 0.1, 0.0, 0.4);
        let (radius, height) = (0.04, 0.1);
        let can = Outline::new(&view(), &Shape::Cylinder { radius, height }, &pose, 10);
        let profile = Profile::new(&[[radius, 0.0], [radius, 0.5 * height], [radius, height]]);
        let turned = Shape::Lathe { profile: profile.unwrap() };
        let turned = Outline::new(&view(), &turned, &pose, 10);
        for sample in &turned.samples {
            let near = can.samples.iter().filter(|other| other.kind == sample.kind);
            let near = near.map(|other| (other.pixel - sample.pixel).norm());
            assert!(near.fold(f64::INFINITY, f64::min) < 8.0, "{sample:?}");
        }
        let length = |outline: &Outline| outline.samples.iter().map(|s| s.length).sum::<f64>();
        assert!((length(&turned) / length(&can) - 1.0).abs() < 0.02);
    }

    #[test]
    fn silhouette_points_lie_on_the_hull_and_their_normals_leave_it() {
        for shape in [
            Shape::Cuboid { size: Vector3::new(0.06, 0.1, 0.14) },
            Shape::Cylinder { radius: 0.08, height: 0.095 },
            Shape::Lathe { profile: Profile::cone(0.03, 0.045, 0.12).unwrap() },
            Shape::Lathe { profile: Profile::cone(0.05, 0.0, 0.12).unwrap() },
            Shape::Lathe { profile: Profile::ball(0.04).unwrap() },
        ] {
            let outline =
                Outline::new(&view(), &shape, &ObjectPose::upright(0.55, -0.1, 0.0, 0.9), 12);
            for s in outline.samples.iter().filter(|s| s.kind == Kind::Silhouette) {
                assert!(outline.contains(s.pixel - 2.0 * s.normal), "inside: {s:?}");
                assert!(!outline.contains(s.pixel + 2.0 * s.normal), "outside: {s:?}");
            }
        }
    }
}
