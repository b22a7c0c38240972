//! A cuboid by the corners of its contour.
//!
//! Every straight side of the contour is the picture of an edge that is upright or lies in one of two
//! level directions at right angles. A side and the eye span a plane with normal `N`; an edge of direction
//! `D` satisfies `N · D = 0`, so each level side votes for a turn by itself. With the turn chosen, sides
//! are grouped, neighbours of different groups meet in corners, and each corner is known by the groups
//! that meet there and by which half of the silhouette it is on.

use std::f64::consts::FRAC_PI_2;

use imageproc::geometry::approximate_polygon_dp;
use imageproc::point::Point;
use nalgebra::{Matrix3, Vector2, Vector3};

use super::{Contour, KeyPoint, Placed, Refused, options, plane_covariance};
use crate::alignment::outline::{ObjectPose, Outline, Projector, convex_hull};
use crate::alignment::placement::reduce;
use crate::fit::{Residuals, solve};
use crate::world::Shape;

/// A straight side of the contour.
struct Side {
    /// First and last point of the contour that were used.
    ends: (usize, usize),
    /// Unit normal of the plane through the eye, world.
    normal: Vector3<f64>,
    /// Unit direction from the eye to the side's middle, world.
    middle: Vector3<f64>,
    /// Length in the picture, px.
    length: f64,
    /// The direction it was grouped to: 0 and 1 level, 2 upright.
    group: usize,
}

/// Largest angle between a side and its group's direction, rad, in the picture.
const WITHIN: f64 = 0.14;
/// Fewest corners that place a cuboid.
const NEEDED: usize = 3;
/// What a corner cannot be better than, px: edges of real solids are rounded.
const FLOOR_PX: f64 = 0.45;

/// Returns the angle in the picture between a side and the direction of an edge, rad.
fn angle(side: &Side, direction: &Vector3<f64>) -> f64 {
    let predicted = side.middle.cross(direction);
    let norm = predicted.norm();
    if norm < 1e-6 { FRAC_PI_2 } else { (side.normal.dot(&predicted) / norm).abs().min(1.0).acos() }
}

/// Returns the three directions of a cuboid's edges.
fn directions(yaw: f64) -> [Vector3<f64>; 3] {
    let (sin, cos) = yaw.sin_cos();
    [Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0), Vector3::z()]
}

/// Cuts the contour into straight sides.
fn sides(contour: &Contour, view: &Projector) -> Vec<Side> {
    let n = contour.pixels.len();
    let middle = contour.middle();
    // Start where the contour is farthest from its middle: at a corner.
    let start = (0..n)
        .max_by(|&a, &b| {
            let far = |i: usize| (contour.pixels[i] - middle).norm_squared();
            far(a).total_cmp(&far(b))
        })
        .unwrap_or(0);
    let ring: Vec<Vector2<f64>> = (0..=n).map(|i| contour.pixels[(start + i) % n]).collect();
    let length: f64 = ring.windows(2).map(|p| (p[1] - p[0]).norm()).sum();
    let far = (0..n)
        .max_by(|&a, &b| (ring[a] - ring[0]).norm().total_cmp(&(ring[b] - ring[0]).norm()))
        .unwrap_or(n / 2)
        .clamp(1, n - 1);
    let cuts = |epsilon: f64| -> Vec<usize> {
        let mut cuts = Vec::new();
        for (from, to) in [(0, far), (far, n)] {
            let points: Vec<Point<f64>> =
                ring[from..=to].iter().map(|p| Point::new(p.x, p.y)).collect();
            let kept = approximate_polygon_dp(&points, epsilon, false);
            let mut at = from;
            for p in kept.iter().take(kept.len() - 1) {
                while at < to && (ring[at] - Vector2::new(p.x, p.y)).norm() > 1e-9 {
                    at += 1;
                }
                cuts.push(at);
            }
        }
        cuts.push(n);
        cuts
    };
    // The tolerance grows until no more sides remain than a cuboid's silhouette can have, and one to spare.
    let corners = [0.008, 0.011, 0.015, 0.02, 0.028]
        .into_iter()
        .map(|share| cuts(share * length))
        .find(|cuts| cuts.len() <= 8)
        .unwrap_or_default();
    let mut found = Vec::new();
    for pair in corners.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let trim = ((to - from) / 8).max(2);
        if to - from < 2 * trim + 6 {
            continue;
        }
        let of = |i: usize| (start + i) % n;
        let inner: Vec<usize> = (from + trim..=to - trim).map(of).collect();
        let own: Vec<usize> = inner.iter().copied().filter(|&i| contour.own[i]).collect();
        let px = (ring[to] - ring[from]).norm();
        // A side that is mostly another thing's border is none of the object's.
        if own.len() * 3 < inner.len() * 2 || px < 0.04 * length {
            continue;
        }
        // Total least squares: the plane through the eye nearest to all rays, without the far ones.
        let mut rays: Vec<Vector3<f64>> =
            own.iter().map(|&i| view.ray(contour.pixels[i])).collect();
        let mut normal = Vector3::zeros();
        for _ in 0..3 {
            let scatter: Matrix3<f64> = rays.iter().map(|r| r * r.transpose()).sum();
            let eigen = scatter.symmetric_eigen();
            let least = eigen.eigenvalues.imin();
            normal = eigen.eigenvectors.column(least).into_owned();
            let mut off: Vec<f64> = rays.iter().map(|r| r.dot(&normal).abs()).collect();
            let spread = 1.4826 * crate::alignment::picture::median(&mut off);
            rays.retain(|r| r.dot(&normal).abs() <= (3.0 * spread).max(1e-5));
        }
        let middle = rays.iter().sum::<Vector3<f64>>().normalize();
        found.push(Side { ends: (of(from), of(to)), normal, middle, length: px, group: 0 });
    }
    found
}

/// Chooses the turn that most of the contour agrees with, and groups the sides by it.
fn group(sides: &mut Vec<Side>) -> Option<f64> {
    let nearest = |side: &Side, yaw: f64| {
        let mut best = (f64::INFINITY, 0);
        for (k, direction) in directions(yaw).iter().enumerate() {
            let angle = angle(side, direction);
            if angle < best.0 {
                best = (angle, k);
            }
        }
        best
    };
    let support = |yaw: f64| -> f64 {
        sides
            .iter()
            .map(|side| {
                let off = nearest(side, yaw).0 / WITHIN;
                side.length * (1.0 - off * off).max(0.0)
            })
            .sum()
    };
    // N · (cos, sin, 0) = 0.
    let votes = sides.iter().map(|side| (-side.normal.x).atan2(side.normal.y));
    let mut best = votes.max_by(|a, b| support(*a).total_cmp(&support(*b)))?;
    let mut step: f64 = 0.04;
    // Nine halvings, and once round the circle at most between them: equal support must not lead on for ever.
    for _ in 0..250 {
        if step <= 1e-4 {
            break;
        }
        let next = [best - step, best, best + step];
        let better = next.into_iter().max_by(|a, b| support(*a).total_cmp(&support(*b)))?;
        if (better - best).abs() < 0.5 * step {
            step *= 0.5;
        }
        best = better;
    }
    for side in sides.iter_mut() {
        let (off, group) = nearest(side, best);
        side.group = if off < WITHIN { group } else { usize::MAX };
    }
    sides.retain(|side| side.group != usize::MAX);
    Some(best)
}

/// A corner of the contour: where two sides of different groups meet.
struct Corner {
    pixel: Vector2<f64>,
    groups: (usize, usize),
}

fn corners(contour: &Contour, view: &Projector, sides: &[Side]) -> Vec<Corner> {
    let n = contour.pixels.len();
    let mut found = Vec::new();
    for (i, a) in sides.iter().enumerate() {
        let b = &sides[(i + 1) % sides.len()];
        if a.group == b.group || sides.len() < 2 {
            continue;
        }
        let ray = a.normal.cross(&b.normal);
        let Some(pixel) = view.pixel_of(if ray.dot(&a.middle) < 0.0 { -ray } else { ray }) else {
            continue;
        };
        // Where the sides are said to meet, the contour must be: between the ends of the two.
        let gap = (b.ends.0 + n - a.ends.1) % n;
        let near = (0..=gap)
            .map(|k| (contour.pixels[(a.ends.1 + k) % n] - pixel).norm())
            .fold(f64::INFINITY, f64::min);
        if near < 0.12 * a.length.max(b.length) + 3.0 {
            found.push(Corner { pixel, groups: (a.group.min(b.group), a.group.max(b.group)) });
        }
    }
    found
}

/// Returns which corner of the solid each corner of the contour is, m, object frame.
fn name(
    corners: &[Corner],
    view: &Projector,
    size: Vector3<f64>,
    pose: &ObjectPose,
) -> Vec<KeyPoint> {
    let body: Vec<Vector3<f64>> = (0..8)
        .map(|i| {
            let side = |bit: usize, length: f64| if i & bit == 0 { -length } else { length } / 2.0;
            Vector3::new(side(1, size.x), side(2, size.y), side(4, size.z) + size.z / 2.0)
        })
        .collect();
    let pixels: Option<Vec<Vector2<f64>>> = body
        .iter()
        .map(|b| view.pixel((pose.isometry() * nalgebra::Point3::from(*b)).coords))
        .collect();
    let Some(pixels) = pixels else { return Vec::new() };
    let hull: Vec<usize> = convex_hull(&pixels)
        .iter()
        .filter_map(|p| pixels.iter().position(|q| (p - q).norm() < 1e-9))
        .collect();
    let axis = |a: usize, b: usize| (a ^ b).trailing_zeros() as usize;
    let mut named: Vec<KeyPoint> = Vec::new();
    for corner in corners {
        let of = |k: usize| {
            let (before, here) = (hull[(k + hull.len() - 1) % hull.len()], hull[k]);
            let after = hull[(k + 1) % hull.len()];
            let (a, b) = (axis(before, here), axis(here, after));
            (a.min(b), a.max(b))
        };
        let same = (0..hull.len()).filter(|&k| of(k) == corner.groups).map(|k| hull[k]);
        let nearest = same.min_by(|&a, &b| {
            (pixels[a] - corner.pixel).norm().total_cmp(&(pixels[b] - corner.pixel).norm())
        });
        if let Some(k) = nearest
            && named.iter().all(|other| (other.body - body[k]).norm() > 1e-9)
        {
            named.push(KeyPoint { pixel: corner.pixel, body: body[k] });
        }
    }
    named
}

/// Places a cuboid by its contour's corners.
pub(super) fn place(
    contour: &Contour,
    view: &Projector,
    size: Vector3<f64>,
) -> Result<Placed, Refused> {
    let shape = Shape::Cuboid { size };
    let mut sides = sides(contour, view);
    let few = |n: usize| Refused::FewPoints(n, NEEDED);
    let yaw = group(&mut sides).ok_or(few(0))?;
    let corners = corners(contour, view, &sides);
    if corners.len() < NEEDED {
        return Err(few(corners.len()));
    }
    // Which level direction is the long one is settled by what fits; a square base has no choice.
    let turns = if shape.symmetry() < 3.0 { 1 } else { 2 };
    let mut best: Option<Placed> = None;
    for turn in 0..turns {
        let quarter = turn == 1;
        let yaw = yaw + if quarter { FRAC_PI_2 } else { 0.0 };
        let swap = |g: usize| if quarter && g < 2 { 1 - g } else { g };
        let corners: Vec<Corner> = corners
            .iter()
            .map(|c| {
                let (a, b) = (swap(c.groups.0), swap(c.groups.1));
                Corner { pixel: c.pixel, groups: (a.min(b), a.max(b)) }
            })
            .collect();
        let Some(mut pose) = contour.stand(view, &shape, yaw) else { continue };
        let mut placed = None;
        for _ in 0..3 {
            let points = name(&corners, view, size, &pose);
            if points.len() < NEEDED {
                break;
            }
            let residuals = |x: &[f64], r: &mut [f64]| {
                let pose = ObjectPose::upright(x[0], x[1], 0.0, x[2]);
                for (point, r) in points.iter().zip(r.chunks_exact_mut(2)) {
                    let world = (pose.isometry() * nalgebra::Point3::from(point.body)).coords;
                    let off = view.pixel(world).map(|p| p - point.pixel);
                    let off = off.unwrap_or_else(|| Vector2::repeat(f64::NAN));
                    r[0] = off.x;
                    r[1] = off.y;
                }
            };
            let mut problem = Residuals::new(2 * points.len(), residuals);
            problem.block = 2;
            let start = [pose.origin().x, pose.origin().y, pose.yaw()];
            let Ok(fit) = solve(&problem, &start, &options(3)) else { break };
            pose = ObjectPose::upright(fit.x[0], fit.x[1], 0.0, fit.x[2]);
            let outline = Outline::new(view, &shape, &pose, 4);
            // With few corners the residuals know little of their own size.
            let noise = fit.noise_std.unwrap_or(1.0).max(1e-9);
            let least = noise.max(FLOOR_PX).max(1.0 / points.len() as f64);
            let yaw = reduce(fit.x[2], &shape);
            // The corners keep their places on the solid under the turn it is reduced by.
            let turned = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), fit.x[2] - yaw);
            placed = Some(Placed {
                points: points.iter().map(|p| KeyPoint { body: turned * p.body, ..*p }).collect(),
                x: fit.x[0],
                y: fit.x[1],
                yaw,
                covariance: plane_covariance(&fit.covariance) * (least / noise).powi(2),
                rms_px: contour.distance(&outline.hull),
            });
        }
        if let Some(placed) = placed
            && best.as_ref().is_none_or(|b| placed.rms_px < b.rms_px)
        {
            best = Some(placed);
        }
    }
    best.ok_or(few(0))
}
