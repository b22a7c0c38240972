//! The visible lines of what a lathe made: where its sides turn away, and its circles.
//!
//! On each stretch of the profile, a part of a cone, the sight touches along two straight lines: a tangent plane of a cone
//! touches it along one. Between the lines the side is seen; a circle is an outline where it ends what is seen.
//! Of a body that is not convex, points behind its own bulges are left out.

use std::f64::consts::{PI, TAU};

use nalgebra::{Vector2, Vector3};

use super::{Kind, ObjectPose, Outline, PointsOf, Projector, push_edge};
use crate::world::Profile;

/// Points of each circle for the hull: as for a cylinder.
const AROUND: usize = 32;
/// A bend by less shows no line, rad: 15 deg. Chosen: facets of a ball of twelve points bend by that much.
const CREASE: f64 = 15.0 * PI / 180.0;
/// Steps along a sight in which it is asked whether the body is in the way.
const STEPS: usize = 48;
/// A sight may pass so deep inside the body, m, before it is blocked: the body's own edge is not in its way.
const GRAZES: f64 = 5e-4;

/// Returns points whose hull is the silhouette of a round thing, px; `None` when one is behind the camera.
pub(super) fn rims(
    view: &Projector,
    profile: &Profile,
    pose: &ObjectPose,
) -> Option<Vec<Vector2<f64>>> {
    Drawn::new(view, profile, pose, 0).rims()
}

/// Returns the lines of a round thing; `None` when the camera is inside it or it is behind the camera.
pub(super) fn lines(
    view: &Projector,
    profile: &Profile,
    pose: &ObjectPose,
    per_edge: usize,
) -> Option<Outline> {
    let drawn = Drawn::new(view, profile, pose, per_edge);
    let eye = drawn.eye;
    let is_level = eye.z >= 0.0 && eye.z <= profile.height();
    if is_level && eye.xy().norm() <= profile.radius_at(eye.z) {
        return None;
    }
    let inside = drawn.points.pixel(Vector3::new(0.0, 0.0, 0.5 * profile.height()))?;
    let mut outline = Outline::default();
    drawn.sides(&mut outline, inside)?;
    drawn.circles(&mut outline, inside)?;
    if !profile.is_convex() {
        outline.samples.retain(|sample| !blocked(profile, &eye, &sample.body));
    }
    Some(outline)
}

/// Returns up to how far from the camera's direction a stretch's side is seen, rad: 0 not at all, π all around.
fn seen_half(([r0, z0], [r1, z1]): ([f64; 2], [f64; 2]), eye: &Vector3<f64>) -> f64 {
    // A normal (cos φ, sin φ, -slope) points towards the eye where |eye| cos(φ - φ_eye) exceeds this.
    let slope = (r1 - r0) / (z1 - z0);
    let reach = r0 + slope * (eye.z - z0);
    (reach / eye.xy().norm().max(1e-9)).clamp(-1.0, 1.0).acos()
}

/// Whether the body itself is before a point of its surface.
fn blocked(profile: &Profile, eye: &Vector3<f64>, at: &Vector3<f64>) -> bool {
    let sight = eye - at;
    // Beyond its own size nothing of it is in the way.
    let far = (2.0 * profile.widest() + profile.height()) / sight.norm().max(1e-9);
    (1..=STEPS).any(|k| {
        let p = at + sight * (far.min(1.0) * k as f64 / STEPS as f64);
        let is_level = p.z > 0.0 && p.z < profile.height();
        is_level && p.x.hypot(p.y) < profile.radius_at(p.z) - GRAZES
    })
}

struct Drawn<'a> {
    points: PointsOf,
    profile: &'a Profile,
    per_edge: usize,
    /// The camera, m, object frame.
    eye: Vector3<f64>,
    /// Where the camera is about the axis, rad.
    facing: f64,
    /// Of each stretch, up to how far from there it is seen, rad.
    halves: Vec<f64>,
}

impl<'a> Drawn<'a> {
    fn new(view: &Projector, profile: &'a Profile, pose: &ObjectPose, per_edge: usize) -> Self {
        let eye = (pose.isometry().inverse() * nalgebra::Point3::from(view.eye())).coords;
        let halves = profile.stretches().map(|stretch| seen_half(stretch, &eye)).collect();
        let facing = eye.y.atan2(eye.x);
        Self { points: view.of(pose), profile, per_edge, eye, facing, halves }
    }

    /// Returns a point of the surface, `turn` rad from the camera's direction.
    fn at(&self, [radius, z]: [f64; 2], turn: f64) -> Vector3<f64> {
        let (sin, cos) = (self.facing + turn).sin_cos();
        Vector3::new(radius * cos, radius * sin, z)
    }

    fn rims(&self) -> Option<Vec<Vector2<f64>>> {
        let mut points = Vec::with_capacity(AROUND * self.profile.points().len());
        for point in self.profile.points() {
            for k in 0..AROUND {
                points.push(self.points.pixel(self.at(*point, TAU * k as f64 / AROUND as f64))?);
            }
        }
        for ((from, to), half) in self.profile.stretches().zip(&self.halves) {
            for turn in [-half, *half] {
                points.push(self.points.pixel(self.at(from, turn))?);
                points.push(self.points.pixel(self.at(to, turn))?);
            }
        }
        Some(points)
    }

    /// Adds the lines along which sides turn away.
    fn sides(&self, outline: &mut Outline, inside: Vector2<f64>) -> Option<()> {
        let high = self.profile.height();
        for (([r0, z0], [r1, z1]), half) in self.profile.stretches().zip(&self.halves) {
            if *half <= 0.0 || *half >= PI {
                continue;
            }
            // A stretch has points as it has height.
            let n = ((self.per_edge as f64 * (z1 - z0) / high).ceil() as usize).max(2);
            for turn in [-half, *half] {
                let side = |t: f64| self.at([r0 + (r1 - r0) * t, z0 + (z1 - z0) * t], turn);
                let samples = &mut outline.samples;
                push_edge(samples, &self.points, side, n, Kind::Silhouette, inside)?;
                for end in [0.0, 1.0] {
                    outline.key_points.push(self.points.pixel(side(end))?);
                }
            }
        }
        Some(())
    }

    /// Adds the circles at the ends and where the profile bends, as far as they are seen.
    fn circles(&self, outline: &mut Outline, inside: Vector2<f64>) -> Option<()> {
        let (points, eye) = (self.profile.points(), &self.eye);
        let last = points.len() - 1;
        for (k, point) in points.iter().enumerate() {
            // What is below the circle and above it; an end's face is seen all around or not at all.
            let face = |is_seen: bool| if is_seen { PI } else { 0.0 };
            let below = if k == 0 { face(eye.z < 0.0) } else { self.halves[k - 1] };
            let above =
                if k == last { face(eye.z > self.profile.height()) } else { self.halves[k] };
            let (both, one) = (below.min(above), below.max(above));
            let is_end = k == 0 || k == last;
            if both > 0.0 && (is_end || self.bend(k) > CREASE) {
                self.arc(outline, *point, [-both, both], Kind::Inner, inside)?;
            }
            if one > both {
                if both > 0.0 {
                    self.arc(outline, *point, [-one, -both], Kind::Silhouette, inside)?;
                    self.arc(outline, *point, [both, one], Kind::Silhouette, inside)?;
                } else {
                    self.arc(outline, *point, [-one, one], Kind::Silhouette, inside)?;
                }
            }
            if is_end {
                for turn in [0.0, PI].into_iter().filter(|turn| *turn < one + 1e-9) {
                    outline.key_points.push(self.points.pixel(self.at(*point, turn))?);
                }
            }
        }
        Some(())
    }

    /// Returns by how much the profile bends at a point, rad.
    fn bend(&self, k: usize) -> f64 {
        let points = self.profile.points();
        let leans = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]).atan2(b[1] - a[1]);
        (leans(points[k], points[k + 1]) - leans(points[k - 1], points[k])).abs()
    }

    fn arc(
        &self,
        outline: &mut Outline,
        point: [f64; 2],
        [from, to]: [f64; 2],
        kind: Kind,
        inside: Vector2<f64>,
    ) -> Option<()> {
        // A half circle has twice as many points as an edge; a tip has none.
        let n = (2.0 * self.per_edge as f64 * (to - from) / PI).round() as usize;
        if n == 0 || point[0] <= 0.0 {
            return Some(());
        }
        let arc = |t: f64| self.at(point, from + (to - from) * t);
        push_edge(&mut outline.samples, &self.points, arc, n, kind, inside)
    }
}
