//! Moving edges: the last fraction of a pixel of a placement, and how sure it is.
//!
//! From a pose that is right to a few pixels, the picture is searched along the normals of the predicted
//! outline for the strongest edge, and the pose is moved by Gauss-Newton with Tukey weights so that the
//! outline meets them. The covariance is that of the normal equations, scaled by the residuals that are
//! left, and by how much whole edges disagree (White's sandwich, clustered). The plane z = 0 is taken as given.
//!
//! Source: Harris, "Tracking with rigid models", 1992 (the `RAPiD` tracker); Drummond and Cipolla, "Real-time visual
//! tracking of complex structures", PAMI 2002; Comport et al., TVCG 2006 (robust weights).

use nalgebra::{Matrix3, Vector2, Vector3};

use super::evidence::Hidden;
use super::outline::{Kind, ObjectPose, Outline, Projector};
use super::picture::{Picture, median};
use crate::world::{Material, Shape};

/// A placement fitted to edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Position on the table, m.
    pub x: f64,
    /// Position on the table, m.
    pub y: f64,
    /// Turn about z, rad.
    pub yaw: f64,
    /// Covariance of x, y (m²) and yaw (rad²).
    pub covariance: Matrix3<f64>,
    /// Root mean square distance between outline and edges used, px.
    pub rms_px: f64,
    /// Share of the visible outline that found an edge within 2.5 px.
    pub support: f64,
}

/// What no picture shows: the camera's own calibration and edges that are not quite where the solid ends, px.
const FLOOR_PX: f64 = 0.15;
/// The same of a clear thing: its wall shows two edges, and which of them is seen changes along the outline.
const CLEAR_FLOOR_PX: f64 = 0.6;
/// Neighbouring edge points share pixels; about every third pixel along an edge is new information.
pub(super) const INDEPENDENT_PX: f64 = 3.0;

/// Step of the differences, m and rad.
const H: f64 = 1e-5;

/// One look along one normal.
pub(super) struct Edge {
    /// Where the outline is, px.
    pub(super) pixel: Vector2<f64>,
    /// Unit normal of the outline.
    pub(super) normal: Vector2<f64>,
    /// Where it sits on the solid, m, object frame.
    pub(super) body: Vector3<f64>,
    /// How far along the normal the picture's edge is, px.
    pub(super) offset: f64,
    /// Length of outline it stands for times the edge's strength, px.
    pub(super) weight: f64,
    /// Which edge of the solid.
    pub(super) of: usize,
}

impl Edge {
    /// Returns how far along the normal a point of the solid is from this edge's, px, at another pose.
    pub(super) fn slope(&self, view: &Projector, pose: &ObjectPose, body: Vector3<f64>) -> f64 {
        let world = pose.isometry() * nalgebra::Point3::from(body);
        view.pixel(world.coords).map_or(0.0, |p| self.normal.dot(&(p - self.pixel)))
    }
}

/// The edges near a pose.
pub(super) struct Look {
    /// What was found along the normals.
    pub(super) edges: Vec<Edge>,
    /// Length of outline that was judged, px; inner edges count half.
    pub(super) judged: f64,
    /// Share of the visible silhouette that belongs to edges of which hardly anything is seen.
    pub(super) missing: f64,
}

/// Fits x, y and yaw; `None` when too few edges are near, or they do not determine the pose.
///
/// `full` is the gradient, CIELAB/px, at which an edge counts in full.
pub fn refine(
    picture: &Picture,
    view: &Projector,
    shape: &Shape,
    pose: &ObjectPose,
    hidden: &Hidden,
    full: f64,
    material: Material,
) -> Option<Fit> {
    // A clear thing's edge may be a thin line of light or dark, with a gradient on either side of it.
    let lines = material == Material::Transparent;
    let turns = shape.symmetry() > 0.0;
    let (start, start_yaw) = (pose.origin(), pose.yaw());
    let mut state = Vector3::new(start.x, start.y, start_yaw);
    let reaches = [6.0, 5.0, 4.0, 3.5, 3.0, 2.5, 2.5, 2.5];
    let mut last = None;
    for reach in reaches {
        let pose = ObjectPose::upright(state.x, state.y, 0.0, state.z);
        let Look { edges, judged, .. } =
            look(picture, view, shape, &pose, hidden, (full, reach, lines));
        let moved = [
            ObjectPose::upright(state.x + H, state.y, 0.0, state.z),
            ObjectPose::upright(state.x, state.y + H, 0.0, state.z),
            ObjectPose::upright(state.x, state.y, 0.0, state.z + H),
        ];
        let mut off: Vec<f64> = edges.iter().map(|e| e.offset.abs()).collect();
        let spread = (1.4826 * median(&mut off)).max(0.3);
        let (mut normal, mut rhs) = (Matrix3::zeros(), Vector3::zeros());
        let (mut square, mut weight, mut near) = (0.0, 0.0, 0.0);
        let mut pulls = [Vector3::zeros(); 16];
        for edge in &edges {
            let t = (edge.offset / (4.0 * spread)).powi(2);
            if t < 1.0 {
                let w = edge.weight * (1.0 - t).powi(2);
                let row = Vector3::from_fn(|k, _| edge.slope(view, &moved[k], edge.body) / H);
                normal += w * row * row.transpose();
                rhs += w * row * edge.offset;
                pulls[edge.of.min(15)] += w * row * edge.offset;
                square += w * edge.offset * edge.offset;
                weight += w;
            }
            if edge.offset.abs() < 2.5 {
                near += edge.weight;
            }
        }
        if !turns {
            for k in 0..3 {
                normal[(k, 2)] = 0.0;
                normal[(2, k)] = 0.0;
            }
            normal[(2, 2)] = 1.0;
            rhs.z = 0.0;
            for pull in &mut pulls {
                pull.z = 0.0;
            }
        }
        if weight < 0.15 * judged {
            return None;
        }
        let inverse = normal.try_inverse()?;
        let step = inverse * rhs;
        state += step;
        let moved = (state.x - start.x).hypot(state.y - start.y);
        // The start was right to a few pixels; whatever runs farther follows another thing's edge.
        if moved > 0.008 || !step.iter().all(|s| s.is_finite()) {
            return None;
        }
        let rms = (square / weight.max(1e-9)).sqrt();
        let meat = pulls.iter().fold(Matrix3::zeros(), |sum, pull| sum + pull * pull.transpose());
        last = Some((inverse, inverse * meat * inverse, rms, near / judged.max(1e-9)));
    }
    let (inverse, by_edge, rms_px, support) = last?;
    // Weights are px of outline, so `inverse` is per px; each independent stretch is one measurement.
    // An edge that is off as a whole (a rounded rim, a shadow's border) is off by one error, not many: the
    // sandwich with whole edges as clusters adds what the edges disagree by.
    let mut covariance = inverse * INDEPENDENT_PX * (rms_px * rms_px) + by_edge;
    let metres_per_px = {
        let depth = (view.eye() - Vector3::new(state.x, state.y, shape.height() / 2.0)).norm();
        depth / view.intrinsics.fx.abs()
    };
    let floor = if lines { CLEAR_FLOOR_PX } else { FLOOR_PX };
    let floor = (floor * metres_per_px).powi(2);
    covariance[(0, 0)] += floor;
    covariance[(1, 1)] += floor;
    if turns {
        covariance[(2, 2)] += floor / shape.outer_radius().powi(2);
    } else {
        covariance[(2, 2)] = 0.0;
    }
    Some(Fit { x: state.x, y: state.y, yaw: state.z, covariance, rms_px, support })
}

/// Looks along every normal of the outline for the picture's edges.
pub(super) fn look(
    picture: &Picture,
    view: &Projector,
    shape: &Shape,
    pose: &ObjectPose,
    hidden: &Hidden,
    how: (f64, f64, bool),
) -> Look {
    let outline = Outline::new(view, shape, pose, 24);
    let (w, h) = picture.size();
    let mut edges = Vec::with_capacity(outline.samples.len());
    let mut judged = 0.0;
    let (mut found, mut looked, mut rim) = ([0.0_f64; 16], [0.0_f64; 16], [0.0_f64; 16]);
    for sample in &outline.samples {
        let p = sample.pixel;
        if p.x < 3.0 || p.y < 3.0 || p.x > w as f64 - 4.0 || p.y > h as f64 - 4.0 {
            continue;
        }
        if hidden.covers(p) || hidden.owns_edge(p, 1.0) {
            continue;
        }
        let edge = strongest(picture, p, sample.normal, how);
        // What is in front has edges too: where one of them is seen, nothing is known of what is behind it.
        if edge.is_some_and(|(offset, _)| hidden.owns_edge(p + sample.normal * offset, 1.0)) {
            continue;
        }
        let weight = sample.length * if sample.kind == Kind::Inner { 0.5 } else { 1.0 };
        judged += weight;
        let of = sample.edge.min(15);
        looked[of] += weight;
        if sample.kind == Kind::Silhouette {
            rim[of] += weight;
        }
        let Some((offset, strength)) = edge else { continue };
        found[of] += weight;
        edges.push(Edge {
            pixel: p,
            normal: sample.normal,
            body: sample.body,
            offset,
            weight: weight * strength,
            of,
        });
    }
    // An edge of the solid that the picture hardly shows (a rim out of view, a side in the dark) would be
    // drawn to whatever else is near; it is left out whole.
    edges.retain(|e| found[e.of] > 0.25 * looked[e.of]);
    let gone: f64 = (0..16).filter(|&k| found[k] < 0.4 * looked[k]).map(|k| rim[k]).sum();
    Look { edges, judged, missing: gone / rim.iter().sum::<f64>().max(1e-9) }
}

/// Returns the offset along the normal, px, of the strongest edge within `reach`, and its strength 0 to 1.
///
/// `full` is the gradient that counts in full, CIELAB/px; with `lines` two
/// opposite flanks of a thin line are taken for one edge in its middle.
pub fn strongest(
    picture: &Picture,
    p: Vector2<f64>,
    normal: Vector2<f64>,
    (full, reach, lines): (f64, f64, bool),
) -> Option<(f64, f64)> {
    // Along the normal, px: an edge is blurred over 2 to 3 px, and the peak between three steps is that of a parabola.
    const STEP: f64 = 0.5;
    let n = (reach / STEP).round() as i64;
    let colours: Vec<[f32; 3]> = (-n - 2..=n + 2)
        .map(|k| {
            let q = p + normal * (k as f64 * STEP);
            picture.lab_at(q.x, q.y)
        })
        .collect();
    let gradient: Vec<f64> = (0..colours.len() - 4)
        .map(|k| {
            let (a, b) = (colours[k], colours[k + 4]);
            let square: f32 = (0..3).map(|c| (b[c] - a[c]).powi(2)).sum();
            f64::from(square.sqrt()) / (4.0 * STEP)
        })
        .collect();
    let rises = |k: usize| colours[k + 4][0] > colours[k][0];
    let mut peaks: Vec<(f64, f64, bool)> = Vec::new();
    let mut best: Option<(f64, usize)> = None;
    for k in 1..gradient.len() - 1 {
        let (before, here, after) = (gradient[k - 1], gradient[k], gradient[k + 1]);
        if here < before || here <= after || here < 0.35 * full {
            continue;
        }
        let bend = before - 2.0 * here + after;
        let shift = if bend < -1e-9 { 0.5 * (before - after) / bend } else { 0.0 };
        let offset = (k as f64 - n as f64 + shift) * STEP;
        // A near edge is preferred to a somewhat stronger one far off.
        let value = here.min(full) * (-0.5 * (offset / (0.6 * reach)).powi(2)).exp();
        if best.is_none_or(|b| value > b.0) {
            best = Some((value, peaks.len()));
        }
        peaks.push((offset, here, rises(k)));
    }
    let (mut offset, strength, rising) = peaks[best?.1];
    if lines {
        // The two flanks of a line: opposite, near, and of like strength. The edge is its middle.
        let flank = peaks.iter().find(|(other, here, rises)| {
            *rises != rising && (other - offset).abs() < 3.6 && *here > 0.4 * strength
        });
        if let Some((other, here, _)) = flank
            && strength > 0.4 * here
        {
            offset = 0.5 * (offset + other);
        }
    }
    Some((offset, (strength / full).min(1.0)))
}
