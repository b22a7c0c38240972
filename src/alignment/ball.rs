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

/// Rays along which the outline is looked for: on a ball of 14 mm radius in the kitchen (12 px) one for 0.6 px of its
/// rim, closer than pixels are independent; on one of 20 px radius one a pixel. With half of them a large ball is
/// measured worse, twice as many say the same again.
const RAYS: usize = 120;
/// Least chroma of a ball, CIELAB: below it hue is noise. Chosen: with half of it a grey ball would be looked for by
/// the tint of the lamp, with twice as much a pale one is refused that could be found.
const COLOURED: f64 = 15.0;
/// How much more a colour across the ball's hue counts against it than one along it counts for it: a hue 27° beside
/// (`atan 1/2`) is nothing.
const ACROSS: f64 = 2.0;
/// Share of the ball's chroma from which a pixel is its: what its shaded side has. Chosen: with half of it what
/// reflects the ball is of it, with twice as much only its lit side is.
const OF_BALL: f64 = 0.3;
/// Distances at which a ball is looked for, m: from the camera's near focus to the far end of a large cell; the
/// farther one may be twice as far as its radius says.
const NEAREST: f64 = 0.2;
const FARTHEST: f64 = 4.0;
const FARTHER: f64 = 0.5;
/// Least radius of a region, px, squared, and the share of its circle that it covers at least: a ball of 2 px has no
/// outline to measure, and half of a ball is too little to begin from.
const LEAST_PX2: f64 = 4.0;
const HALF_COVERED: f64 = 0.5;
/// Fewest pixels of a region: those of a circle of 2 px radius.
const LEAST_REGION: usize = 12;
/// How often rim and circle are found from each other: the first rim is along rays from the region's middle, which a
/// piece that is covered draws aside.
const ROUNDS: usize = 3;
/// Share of the rays that find the rim: a ball that is covered by more than a quarter is not there.
const UNCOVERED: (usize, usize) = (3, 4);
/// Area of the region over that of the circle: a crescent has a good arc but is no ball to measure. Chosen: at 0.9
/// the soft rim of a small ball refuses it, at 0.6 a quarter may be missing that the rays did not see.
const FILL: std::ops::Range<f64> = 0.8..1.2;
/// Largest root mean square distance of the rim from the circle, px. Chosen: a round ball in noise has 0.1 to 0.2;
/// half of it refuses a ball that is painted unevenly, twice as much takes a box's corner.
const RMS_PX: f64 = 0.6;
/// What shading may move a centre by, px: it moves the half-way point of the hue; on painted balls that was up to
/// 0.17 px.
const SHADING_PX: f64 = 0.1;
/// How far what covers a share of the rim pulls the centre, in radii a share: 0.7 px where a tenth of a 21 px ball
/// was hidden (0.33).
const PULL: f64 = 0.3;
/// Steps along a ray, px, and how far inside and outside of the circle it goes. Chosen: the rim is blurred over 2 to
/// 3 px and the first circle is off by as much. With half the reach a rim is missed, with twice as much a neighbour's
/// is found.
const STEP_PX: f64 = 0.25;
const REACH_PX: f64 = 4.0;
/// Where a ray begins at least, as a share of the radius: in a small ball not beyond the middle of it.
const INNER: f64 = 0.5;
/// Samples of the hue just inside of that and how far apart, px: their mean is what the rim falls from.
const PLATEAU: i32 = 5;
const PLATEAU_STEP_PX: f64 = 0.5;
/// Half of what the hue falls by is the rim; what is beyond counts as at most half of the ball's own and at least its
/// opposite.
const HALF: f64 = 0.5;
/// Steps of the circle's fit, of which the first so many have a reach of [`FAR_PX`]. Chosen: a circle has three
/// unknowns and converges in a few; half may stop on the way where much is covered.
const FIT_ROUNDS: usize = 20;
const FAR_ROUNDS: usize = 5;
const FAR_PX: f64 = 6.0;
/// Then as many medians of the distances, but not less or more than so many px: a covering edge pulls while it is
/// within reach, and noise alone must not be cut.
const MEDIANS: f64 = 4.0;
const CLOSE_PX: std::ops::RangeInclusive<f64> = 0.3..=2.0;
/// Points of the rim within this of the circle are counted as seen, px. Chosen: several times [`RMS_PX`]'s ordinary
/// 0.2; with half of it a ball that is not quite round loses rays, with twice as much what covers it counts as rim.
const SEEN_PX: f64 = 1.5;

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
    if chroma < COLOURED {
        return None;
    }
    let (ua, ub) = (f64::from(target[1]) / chroma, f64::from(target[2]) / chroma);
    // How much of a pixel's colour is the ball's: along the hue, less what is across it.
    let value = |x: usize, y: usize| {
        let [_, a, b] = lab(image.get_pixel(x as u32, y as u32).0).map(f64::from);
        (a * ua + b * ub) - ACROSS * (a * ub - b * ua).abs()
    };
    let hue: Vec<f64> = (0..w * h).map(|at| value(at % w, at / w)).collect();
    let threshold = OF_BALL * chroma;
    let focal = guess.intrinsics.fx.abs();
    let (least, most) = (FARTHER * focal * radius / FARTHEST, focal * radius / NEAREST);
    let region = largest_region(&hue, w, h, threshold)?;
    let area = region.len() as f64;
    if area < std::f64::consts::PI * (least * least).max(LEAST_PX2) * HALF_COVERED
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
    for _ in 0..ROUNDS {
        let rim = rim_points(&hue, w, h, circle, threshold);
        let (next, inliers, rms) = fit_circle(&rim, circle)?;
        circle = next;
        fit = Some((inliers, rms));
    }
    let (inliers, rms) = fit?;
    let fill = area / (std::f64::consts::PI * circle.z * circle.z);
    if inliers < RAYS * UNCOVERED.0 / UNCOVERED.1 || !FILL.contains(&fill) || rms > RMS_PX {
        return None;
    }
    let outline = Pixel::new(circle.x, circle.y);
    let n = guess.intrinsics.normalise(outline);
    // In normalised coordinates: centre of the ellipse × (1 - sin²α / cos²θ) = the sphere's centre.
    let cos2 = 1.0 / (1.0 + n.norm_squared());
    let sin2 = (circle.z / focal).powi(2) * cos2;
    let pixel = guess.intrinsics.pixel(n * (1.0 - sin2 / cos2));
    let hidden = 1.0 - inliers as f64 / RAYS as f64;
    let sigma =
        (rms * (2.0 / inliers as f64).sqrt()).hypot(SHADING_PX).hypot(PULL * hidden * circle.z);
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
    (best.len() >= LEAST_REGION).then_some(best)
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
        let step = STEP_PX;
        let inner = (radius - REACH_PX).max(INNER * radius);
        let plateau = (0..PLATEAU)
            .map(|k| sample(centre + direction * (inner - PLATEAU_STEP_PX * f64::from(k))))
            .sum::<f64>()
            / f64::from(PLATEAU);
        if plateau < threshold {
            continue;
        }
        let beyond =
            sample(centre + direction * (radius + REACH_PX)).min(HALF * plateau).max(-plateau);
        let level = HALF * (plateau + beyond);
        let mut before = sample(centre + direction * inner);
        let mut r = inner;
        // No picture is so large that a ray is longer than this.
        for _ in 0..100_000 {
            if r >= radius + REACH_PX {
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

/// Fits a circle with Tukey weights; returns it, the number of points within [`SEEN_PX`], and their RMS, px.
fn fit_circle(rim: &[Vector2<f64>], start: Vector3<f64>) -> Option<(Vector3<f64>, usize, f64)> {
    if rim.len() < RAYS / 2 {
        return None;
    }
    let mut circle = start;
    for round in 0..FIT_ROUNDS {
        // At last only points as close as most of them: a covering edge pulls while it is within reach.
        let reach = if round < FAR_ROUNDS {
            FAR_PX
        } else {
            let mut off: Vec<f64> =
                rim.iter().map(|p| ((p - circle.xy()).norm() - circle.z).abs()).collect();
            (MEDIANS * median(&mut off)).clamp(*CLOSE_PX.start(), *CLOSE_PX.end())
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
    let residuals: Vec<f64> = rim
        .iter()
        .map(|p| (p - circle.xy()).norm() - circle.z)
        .filter(|r| r.abs() < SEEN_PX)
        .collect();
    let n = residuals.len();
    let rms = (residuals.iter().map(|r| r * r).sum::<f64>() / n.max(1) as f64).sqrt();
    (n > 0 && circle.z > 1.0).then_some((circle, n, rms))
}
