//! A standing cylinder by the two upright lines and the two arcs of its contour.
//!
//! The eye and an upright side span a vertical plane that touches the cylinder: the two planes' bisector is
//! the bearing of the axis, and the angle between them, with the radius, its distance. Foot and rim are
//! circles on known planes, so that a point of an arc, seen on that plane, lies one radius from the axis;
//! this is the ellipse fit of the picture with what is known put in. All points together place the axis.

use nalgebra::{Vector2, Vector3};

use super::{Contour, KeyPoint, Placed, Refused, options, plane_covariance};
use crate::alignment::outline::{ObjectPose, Outline, Projector};
use crate::fit::{Residuals, solve};
use crate::world::Shape;

/// Which part of the silhouette a point of the contour belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Left,
    Right,
    Foot,
    Rim,
}

/// Largest angle between a side of the contour and the picture of an upright line, rad.
const WITHIN: f64 = 0.17;
/// What a point of the contour cannot be better than, px, and how far apart points are independent.
const FLOOR_PX: f64 = 0.6;
const INDEPENDENT_PX: f64 = 8.0;

/// Says of every own point of the contour what it is; `None` for a point at a bend between parts.
fn parts(contour: &Contour, view: &Projector) -> Vec<Option<Part>> {
    let n = contour.pixels.len();
    let reach = (n / 40).clamp(3, 12);
    (0..n)
        .map(|i| {
            if !contour.own[i] {
                return None;
            }
            let p = contour.pixels[i];
            let along = contour.pixels[(i + reach) % n] - contour.pixels[(i + n - reach) % n];
            let normal = contour.normals[i];
            // Where an upright line through this point goes in the picture.
            let near = view.eye() + 0.5 * view.ray(p);
            let up = view.pixel(near + Vector3::new(0.0, 0.0, 1e-3))? - view.pixel(near)?;
            let up = up.try_normalize(1e-12)?;
            let turn = (along.perp(&up) / along.norm().max(1e-9)).abs().min(1.0).asin();
            let right = Vector2::new(-up.y, up.x);
            if turn < WITHIN {
                Some(if normal.dot(&right) > 0.0 { Part::Right } else { Part::Left })
            } else if turn < 2.0 * WITHIN {
                None
            } else if normal.dot(&up) < 0.0 {
                Some(Part::Foot)
            } else {
                Some(Part::Rim)
            }
        })
        .collect()
}

/// Places a cylinder by its contour's sides and arcs.
pub(super) fn place(
    contour: &Contour,
    view: &Projector,
    radius: f64,
    height: f64,
) -> Result<Placed, Refused> {
    let shape = Shape::Cylinder { radius, height };
    let parts = parts(contour, view);
    let of = |part: Part| -> Vec<usize> {
        (0..parts.len()).filter(|&i| parts[i] == Some(part)).collect()
    };
    let (left, right, foot) = (of(Part::Left), of(Part::Right), of(Part::Foot));
    // Both sides, and the foot: without it nothing says where on the table the thing stands but its width.
    let least = parts.len() / 25;
    let enough = [&left, &right, &foot].into_iter().filter(|p| p.len() > least.max(4)).count();
    if enough < 3 {
        return Err(Refused::FewPoints(2 * enough, 6));
    }
    let step = (parts.len() / 150).max(1);
    let picked: Vec<(usize, Part)> =
        (0..parts.len()).step_by(step).filter_map(|i| Some((i, parts[i]?))).collect();
    // The foot's near half is a radius before the axis, less what its ends add.
    let eye = view.eye();
    let seen: Vec<Vector3<f64>> =
        foot.iter().filter_map(|&i| view.on_plane(contour.pixels[i], 0.0)).collect();
    let near = seen.iter().sum::<Vector3<f64>>() / seen.len().max(1) as f64;
    let away = (near - eye).xy().try_normalize(1e-9).ok_or(Refused::FewPoints(0, 6))?;
    let start = near.xy() + 0.7 * radius * away;
    let rays: Vec<Vector3<f64>> =
        picked.iter().map(|&(i, _)| view.ray(contour.pixels[i])).collect();
    let residuals = |x: &[f64], r: &mut [f64]| {
        let axis = Vector2::new(x[0], x[1]);
        let to = axis - eye.xy();
        let far = to.norm();
        let bearing = to / far;
        for (((i, part), ray), r) in picked.iter().zip(&rays).zip(r.iter_mut()) {
            let pixel = contour.pixels[*i];
            let on_rim = |z: f64| {
                let p = view.on_plane(pixel, z)?.xy();
                let out = (p - axis).try_normalize(1e-9)?;
                let q = axis + radius * out;
                Some((pixel - view.pixel(Vector3::new(q.x, q.y, z))?).dot(&contour.normals[*i]))
            };
            *r = match part {
                Part::Foot => on_rim(0.0).unwrap_or(f64::NAN),
                Part::Rim => on_rim(height).unwrap_or(f64::NAN),
                Part::Left | Part::Right => {
                    // How far the ray's vertical plane passes from the axis, less the radius.
                    let level = ray.xy();
                    let across = level.perp(&bearing) * far / level.norm();
                    let depth = far / bearing.dot(&level).max(1e-6);
                    (across.abs() - radius) / depth * view.intrinsics.fx
                }
            };
        }
    };
    let problem = Residuals::new(picked.len(), residuals);
    let fit = solve(&problem, &[start.x, start.y], &options(2))
        .map_err(|_| Refused::FewPoints(enough, 6))?;
    let pose = ObjectPose::upright(fit.x[0], fit.x[1], 0.0, 0.0);
    let noise = fit.noise_std.unwrap_or(1.0).max(1e-9);
    let px = contour.pixels.len() as f64 / picked.len() as f64;
    let inflate = (noise.max(FLOOR_PX) / noise).powi(2) * (INDEPENDENT_PX / px).max(1.0);
    let outline = Outline::new(view, &shape, &pose, 4);
    let rms_px = contour.distance(&outline.hull);

    // Where the measured sides meet foot and rim, and the arcs' middles.
    let to = (fit.x[0] - eye.x, fit.x[1] - eye.y);
    let facing = (-to.1).atan2(-to.0);
    let half = (radius / to.0.hypot(to.1)).min(1.0).acos();
    let body = |phi: f64, z: f64| Vector3::new(radius * phi.cos(), radius * phi.sin(), z);
    let mut points = Vec::new();
    let mut wanted = vec![(facing, 0.0)];
    for z in [0.0, height] {
        wanted.extend([(facing - half, z), (facing + half, z)]);
    }
    wanted.push((facing + std::f64::consts::PI, height));
    for (phi, z) in wanted {
        let body = body(phi, z);
        let Some(expected) = view.pixel(Vector3::new(fit.x[0], fit.x[1], 0.0) + body) else {
            continue;
        };
        // The contour's own point is reported, where it has one.
        let nearest = (0..contour.pixels.len()).filter(|&i| contour.own[i]).min_by(|&a, &b| {
            let far = |i: usize| (contour.pixels[i] - expected).norm_squared();
            far(a).total_cmp(&far(b))
        });
        if let Some(i) = nearest
            && (contour.pixels[i] - expected).norm() < 5.0 * noise.max(1.0)
        {
            points.push(KeyPoint { pixel: contour.pixels[i], body });
        }
    }
    Ok(Placed {
        points,
        x: fit.x[0],
        y: fit.x[1],
        yaw: 0.0,
        covariance: plane_covariance(&fit.covariance) * inflate,
        rms_px,
    })
}
