//! A coloured ball on the gripper, for the touch-off routine: its centre in the picture.
//!
//! The ball's outline is found along rays from its middle, where the hue ends, and a circle is fitted that
//! ignores what is covered. A ball that is covered by more than a quarter, or is not there, is `None`:
//! a touch-off without a point is better than one with a wrong point.
//!
//! Source: the outline of a sphere is an ellipse whose centre lies outside the sphere's projected centre
//! by `sin²α / cos²θ` of its distance from the axis (α the sphere's half angle, θ its off-axis angle).

use image::RgbImage;
use nalgebra::{Matrix3, Vector2, Vector3};

use super::picture::{lab, median};
use crate::world::{Camera, Pixel};

/// The ball, seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BallSighting {
    /// Where its centre projects to, px.
    pub pixel: Pixel,
    /// Standard deviation of each coordinate, px.
    pub sigma: f64,
    /// Radius of its outline, px.
    pub radius_px: f64,
}

/// Rays along which the outline is looked for.
const RAYS: usize = 120;

/// Finds a matte ball of known colour (sRGB) and radius (m) in a picture.
///
/// `guess` gives the focal length, to refuse things that are too small or too large to be the ball at any
/// distance from 0.2 m to 4 m. `None` when nothing has the colour and the shape, or too much is covered.
pub fn find_marker_ball(
    image: &RgbImage,
    guess: &Camera,
    radius: f64,
    colour: [u8; 3],
) -> Option<BallSighting> {
    let (w, h) = (image.width() as usize, image.height() as usize);
    let target = lab(colour);
    let chroma = f64::from(target[1]).hypot(f64::from(target[2]));
    if chroma < 15.0 {
        return None;
    }
    let (ua, ub) = (f64::from(target[1]) / chroma, f64::from(target[2]) / chroma);
    // How much of a pixel's colour is the ball's: along the hue, less what is across it.
    let value = |x: usize, y: usize| {
        let [_, a, b] = lab(image.get_pixel(x as u32, y as u32).0).map(f64::from);
        (a * ua + b * ub) - 2.0 * (a * ub - b * ua).abs()
    };
    let hue: Vec<f64> = (0..w * h).map(|at| value(at % w, at / w)).collect();
    let threshold = 0.3 * chroma;
    let focal = guess.intrinsics.fx.abs();
    let (least, most) = (0.5 * focal * radius / 4.0, focal * radius / 0.2);
    let region = largest_region(&hue, w, h, threshold)?;
    let area = region.len() as f64;
    if area < std::f64::consts::PI * (least * least).max(4.0) * 0.5
        || area > std::f64::consts::PI * most * most
    {
        return None;
    }
    let mut middle = Vector2::zeros();
    for &at in &region {
        middle += Vector2::new((at % w) as f64, (at / w) as f64);
    }
    middle /= area;
    let mut circle = Vector3::new(middle.x, middle.y, (area / std::f64::consts::PI).sqrt());
    let mut fit = None;
    for _ in 0..3 {
        let rim = rim_points(&hue, w, h, circle, threshold);
        let (next, inliers, rms) = fit_circle(&rim, circle)?;
        circle = next;
        fit = Some((inliers, rms));
    }
    let (inliers, rms) = fit?;
    // The region must fill the circle: a crescent has a good arc but is no ball to measure.
    let fill = area / (std::f64::consts::PI * circle.z * circle.z);
    if inliers < RAYS * 3 / 4 || !(0.8..1.2).contains(&fill) || rms > 0.6 {
        return None;
    }
    let outline = Pixel::new(circle.x, circle.y);
    let n = guess.intrinsics.normalise(outline);
    // In normalised coordinates: centre of the ellipse × (1 - sin²α / cos²θ) = the sphere's centre.
    let cos2 = 1.0 / (1.0 + n.norm_squared());
    let sin2 = (circle.z / focal).powi(2) * cos2;
    let pixel = guess.intrinsics.pixel(n * (1.0 - sin2 / cos2));
    // Shading moves the half-way point of the hue; on painted balls that was up to 0.17 px.
    // What covers a piece of the rim pulls the rest with it: 0.7 px where a tenth of a 21 px ball was hidden.
    let hidden = 1.0 - inliers as f64 / RAYS as f64;
    let sigma = (rms * (2.0 / inliers as f64).sqrt()).hypot(0.1).hypot(0.3 * hidden * circle.z);
    Some(BallSighting { pixel, sigma, radius_px: circle.z })
}

/// Returns the pixels of the largest connected region above a threshold.
fn largest_region(hue: &[f64], w: usize, h: usize, threshold: f64) -> Option<Vec<usize>> {
    let mut seen = vec![false; w * h];
    let mut best: Vec<usize> = Vec::new();
    for start in 0..w * h {
        if seen[start] || hue[start] < threshold {
            continue;
        }
        let mut region = vec![start];
        seen[start] = true;
        let mut next = 0;
        while next < region.len() {
            let at = region[next];
            next += 1;
            let (x, y) = (at % w, at / w);
            let around = [
                (x > 0).then(|| at - 1),
                (x + 1 < w).then_some(at + 1),
                (y > 0).then(|| at.wrapping_sub(w)),
                (y + 1 < h).then_some(at + w),
            ];
            for neighbour in around.into_iter().flatten() {
                if !seen[neighbour] && hue[neighbour] >= threshold {
                    seen[neighbour] = true;
                    region.push(neighbour);
                }
            }
        }
        if region.len() > best.len() {
            best = region;
        }
    }
    (best.len() >= 12).then_some(best)
}

/// Returns where the hue falls to half of what it is just inside, along rays from the circle's centre.
fn rim_points(
    hue: &[f64],
    w: usize,
    h: usize,
    circle: Vector3<f64>,
    threshold: f64,
) -> Vec<Vector2<f64>> {
    let sample = |p: Vector2<f64>| {
        let (x, y) = (p.x.clamp(0.0, w as f64 - 1.001), p.y.clamp(0.0, h as f64 - 1.001));
        let (x0, y0) = (x.floor() as usize, y.floor() as usize);
        let (fx, fy) = (x - x0 as f64, y - y0 as f64);
        let at = |i: usize, j: usize| hue[(y0 + j).min(h - 1) * w + (x0 + i).min(w - 1)];
        (at(0, 0) * (1.0 - fx) + at(1, 0) * fx) * (1.0 - fy)
            + (at(0, 1) * (1.0 - fx) + at(1, 1) * fx) * fy
    };
    let centre = circle.xy();
    let radius = circle.z;
    let mut rim = Vec::new();
    for i in 0..RAYS {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / RAYS as f64).sin_cos();
        let direction = Vector2::new(cos, sin);
        let step = 0.25;
        let inner = (radius - 4.0).max(0.5 * radius);
        let plateau =
            (0..5).map(|k| sample(centre + direction * (inner - 0.5 * f64::from(k)))).sum::<f64>()
                / 5.0;
        if plateau < threshold {
            continue;
        }
        let beyond = sample(centre + direction * (radius + 4.0)).min(0.5 * plateau).max(-plateau);
        let level = 0.5 * (plateau + beyond);
        let mut before = sample(centre + direction * inner);
        let mut r = inner;
        // No picture is so large that a ray is longer than this.
        for _ in 0..100_000 {
            if r >= radius + 4.0 {
                break;
            }
            let here = sample(centre + direction * (r + step));
            if before >= level && here < level {
                let share = (before - level) / (before - here);
                rim.push(centre + direction * (r + step * share));
                break;
            }
            before = here;
            r += step;
        }
    }
    rim
}

/// Fits a circle with Tukey weights; returns it, the number of points within 1.5 px, and their RMS, px.
fn fit_circle(rim: &[Vector2<f64>], start: Vector3<f64>) -> Option<(Vector3<f64>, usize, f64)> {
    if rim.len() < RAYS / 2 {
        return None;
    }
    let mut circle = start;
    for round in 0..20 {
        // At last only points as close as most of them: a covering edge pulls while it is within reach.
        let reach = if round < 5 {
            6.0
        } else {
            let mut off: Vec<f64> =
                rim.iter().map(|p| ((p - circle.xy()).norm() - circle.z).abs()).collect();
            (4.0 * median(&mut off)).clamp(0.3, 2.0)
        };
        let (mut normal, mut rhs) = (Matrix3::zeros(), Vector3::zeros());
        for p in rim {
            let d = p - circle.xy();
            let distance = d.norm().max(1e-9);
            let residual = distance - circle.z;
            let t = (residual / reach).powi(2);
            if t < 1.0 {
                let weight = (1.0 - t).powi(2);
                let row = Vector3::new(d.x / distance, d.y / distance, 1.0);
                normal += weight * row * row.transpose();
                rhs += weight * row * residual;
            }
        }
        circle += normal.try_inverse()? * rhs;
    }
    let residuals: Vec<f64> =
        rim.iter().map(|p| (p - circle.xy()).norm() - circle.z).filter(|r| r.abs() < 1.5).collect();
    let n = residuals.len();
    let rms = (residuals.iter().map(|r| r * r).sum::<f64>() / n.max(1) as f64).sqrt();
    (n > 0 && circle.z > 1.0).then_some((circle, n, rms))
}
