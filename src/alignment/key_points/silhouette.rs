//! A standing thing of any form by the whole of its contour.
//!
//! What is neither a box nor a cylinder has no corners and arcs by which its contour could be taken apart. Its silhouette is
//! laid onto the contour instead: at several turns so that both have one middle, then so that every point of the contour lies
//! on the nearest stretch of silhouette that faces the same way. Colours and inner lines have no part in it.
//!
//! Source: Besl and `McKay`, "A method for registration of 3-D shapes", PAMI 1992 (closest points); Chen and Medioni, "Object
//! modelling by registration of multiple range images", 1992 (distances along normals).

use std::f64::consts::PI;

use nalgebra::{Matrix3, Point3, Vector2, Vector3};

use super::{Contour, KeyPoint, Placed, Refused};
use crate::alignment::outline::{Kind, ObjectPose, Outline, Projector, Sample};
use crate::world::Shape;

/// Turns that are tried are so far apart, rad: twice the 15 deg of the search for places, since each is followed to its end.
/// With half of it twice as many end in the same few; twice as much is half of what a square looks the same after.
const TURN: f64 = PI / 6.0;
/// Rounds from each start with the lines of a nearby direction, and from the best with its own lines. Chosen: a start is some
/// px off, and each round of closest points leaves a third of that; with half as many the best start is not told.
const ROUNDS: [usize; 2] = [8, 4];
/// Points on a line as long as the thing's mean side, of both kinds of rounds: as many as a search at half size asks for, and
/// as the fit to edges does.
const POINTS: [usize; 2] = [8, 24];
/// So many points of the contour are laid down at most: one every 3 px of a thing of 100 px, about as far apart as the
/// contour is measured anew.
const PICKED: usize = 150;
/// Two directions are the same side of a thing within 60 deg, as the cosine. With none the two sides of a neck change
/// places; at 30 deg a corner that is rounded off has no partner.
const SAME_SIDE: f64 = 0.5;
/// Distance at which a point counts half, px (Cauchy's weights, as for boxes and cylinders).
const CAUCHY_PX: f64 = 2.0;
/// What a contour is not better than, px, and how far apart its points are independent: as for a cylinder.
const FLOOR_PX: f64 = 0.6;
const INDEPENDENT_PX: f64 = 8.0;
/// Step of the differences, m and rad.
const H: f64 = 1e-5;
/// A key point is reported where the contour passes within so many px of it, or of the distance that is left.
const NEAR_PX: f64 = 3.0;

/// A silhouette laid onto a contour.
struct Laid {
    /// x, y, m, and the turn, rad.
    state: Vector3<f64>,
    /// The inverse of the normal equations, a point counting once.
    inverse: Matrix3<f64>,
    /// Root mean square distance of the contour's points, px.
    rms_px: f64,
}

/// Places a thing by its contour.
pub(super) fn place(contour: &Contour, view: &Projector, shape: &Shape) -> Result<Placed, Refused> {
    let symmetry = shape.symmetry();
    let turns = (symmetry / TURN).ceil().max(1.0) as usize;
    let starts = (0..turns).filter_map(|k| {
        let yaw = symmetry * k as f64 / turns as f64;
        let start = contour.stand(view, shape, yaw)?;
        let at = start.origin();
        settled(contour, view, shape, Vector3::new(at.x, at.y, yaw), 0)
    });
    let nothing = Refused::FewPoints(0, 3);
    let best = starts.min_by(|a, b| a.rms_px.total_cmp(&b.rms_px)).ok_or(nothing)?;
    let laid = settled(contour, view, shape, best.state, 1).ok_or(nothing)?;
    let [x, y, yaw] = laid.state.into();
    let apart = contour.pixels.len() as f64 / picked(contour).count().max(1) as f64;
    let variance = laid.rms_px.max(FLOOR_PX).powi(2) * (INDEPENDENT_PX / apart).max(1.0);
    Ok(Placed {
        points: points(contour, view, shape, &laid),
        x,
        y,
        yaw: crate::alignment::placement::reduce(yaw, shape),
        covariance: laid.inverse * variance,
        rms_px: laid.rms_px,
    })
}

/// The points of a contour that are laid down: where and which way out.
fn picked(contour: &Contour) -> impl Iterator<Item = (Vector2<f64>, Vector2<f64>)> + '_ {
    let step = (contour.pixels.len() / PICKED).max(1);
    let own = (0..contour.pixels.len()).step_by(step).filter(|&i| contour.own[i]);
    own.map(|i| (contour.pixels[i], contour.normals[i]))
}

fn pose([x, y, yaw]: [f64; 3]) -> ObjectPose {
    ObjectPose::upright(x, y, 0.0, yaw)
}

/// Lays a silhouette down in the rounds of one kind; `None` where it has none or does not come to rest.
fn settled(
    contour: &Contour,
    view: &Projector,
    shape: &Shape,
    start: Vector3<f64>,
    kind: usize,
) -> Option<Laid> {
    let mut laid = laid(contour, view, shape, start, POINTS[kind])?;
    for _ in 0..ROUNDS[kind] {
        laid = self::laid(contour, view, shape, laid.0.state + laid.1, POINTS[kind])?;
    }
    Some(laid.0)
}

/// Looks at a silhouette where it lies; returns the step that would lay it better beside it.
fn laid(
    contour: &Contour,
    view: &Projector,
    shape: &Shape,
    state: Vector3<f64>,
    per_edge: usize,
) -> Option<(Laid, Vector3<f64>)> {
    let outline = Outline::new(view, shape, &pose(state.into()), per_edge);
    let rim: Vec<&Sample> = outline.samples.iter().filter(|s| s.kind == Kind::Silhouette).collect();
    let moved = [0, 1, 2].map(|k| {
        let mut at = state;
        at[k] += H;
        pose(at.into())
    });
    let (mut normal, mut rhs) = (Matrix3::zeros(), Vector3::zeros());
    let (mut square, mut count) = (0.0, 0.0);
    for (p, out) in picked(contour) {
        let faces = |s: &&&Sample| s.normal.dot(&out) > SAME_SIDE;
        let far = |s: &Sample| (s.pixel - p).norm_squared();
        let nearest = rim.iter().filter(faces).min_by(|a, b| far(a).total_cmp(&far(b)));
        let nearest = nearest.or_else(|| rim.iter().min_by(|a, b| far(a).total_cmp(&far(b))))?;
        let off = nearest.normal.dot(&(p - nearest.pixel));
        // Between two samples the silhouette goes on; beyond its end it does not.
        let aside = (far(nearest) - off * off).max(0.0).sqrt() - nearest.length;
        let distance = off.hypot(aside.max(0.0));
        square += distance * distance;
        count += 1.0;
        let row = Vector3::from_fn(|k, _| {
            let world = moved[k].isometry() * Point3::from(nearest.body);
            view.pixel(world.coords).map_or(0.0, |q| nearest.normal.dot(&(q - nearest.pixel)) / H)
        });
        let weight = 1.0 / (1.0 + (distance / CAUCHY_PX).powi(2));
        normal += weight * row * row.transpose();
        rhs += weight * row * off;
    }
    if shape.symmetry() <= 0.0 {
        for k in 0..3 {
            normal[(k, 2)] = 0.0;
            normal[(2, k)] = 0.0;
        }
        (normal[(2, 2)], rhs.z) = (1.0, 0.0);
    }
    let mut inverse = normal.try_inverse()?;
    let step = inverse * rhs;
    if shape.symmetry() <= 0.0 {
        inverse[(2, 2)] = 0.0;
    }
    let rms_px = (square / f64::max(count, 1.0)).sqrt();
    let is_finite = step.iter().chain(inverse.iter()).all(|v| v.is_finite());
    is_finite.then_some((Laid { state, inverse, rms_px }, step))
}

/// Where the silhouette's lines begin, measured on the contour where it passes there.
fn points(contour: &Contour, view: &Projector, shape: &Shape, laid: &Laid) -> Vec<KeyPoint> {
    let outline = Outline::new(view, shape, &pose(laid.state.into()), POINTS[1]);
    let mut before = None;
    let mut points = Vec::new();
    for sample in outline.samples.iter().filter(|s| s.kind == Kind::Silhouette) {
        if before.replace(sample.edge) == Some(sample.edge) {
            continue;
        }
        let far = |i: usize| (contour.pixels[i] - sample.pixel).norm();
        let own = (0..contour.pixels.len()).filter(|&i| contour.own[i]);
        if let Some(i) = own.min_by(|&a, &b| far(a).total_cmp(&far(b)))
            && far(i) < NEAR_PX * laid.rms_px.max(1.0)
        {
            points.push(KeyPoint { pixel: contour.pixels[i], body: sample.body });
        }
    }
    points
}
