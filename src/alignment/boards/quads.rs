//! Dark four-sided shapes in a picture: what may be a tag.
//!
//! Pixels darker than their surroundings are joined to regions, whose borders are made polygons; those with four corners
//! are put to a fraction of a pixel by lines along their sides. Several sizes of surroundings are tried, and regions that
//! touch at their corners are parted.
//!
//! Source: Garrido-Jurado, Muñoz-Salinas, Madrid-Cuevas and Marín-Jiménez, "Automatic generation and detection of highly
//! reliable fiducial markers under occlusion", Pattern Recognition 2014, §4.1.

use image::{GrayImage, Luma};
use imageproc::contours::{BorderType, find_contours};
use imageproc::distance_transform::Norm;
use imageproc::morphology;
use imageproc::point::Point;
use nalgebra::Vector2;

use crate::alignment::plane::Plane;

/// Corners clockwise as seen, px.
pub(super) type Quad = [Vector2<f64>; 4];

/// How much darker than its surroundings a pixel is, grey levels. Chosen: three times the noise of a dim picture.
const DARKER: f64 = 7.0;
/// Half sides of the surroundings, px, and as a part of the picture's long side.
const AROUND: [f64; 2] = [7.0, 21.0];
const AROUND_PART: f64 = 0.05;
/// The shortest side that is looked at, px: a tag of 8 cells with less than a pixel a cell says nothing.
const LEAST_SIDE: f64 = 8.0;
/// How far a border may be from its polygon, as a part of its length.
const STRAIGHT: f64 = 0.03;
/// Places along a side at which its edge is measured, and the share of the side at each end that is left out: corners are
/// rounded by blur.
const ALONG: usize = 24;
const ENDS: f64 = 0.12;
/// An edge is looked for within this part of the side's length, and px at most.
const BESIDE: (f64, f64) = (0.08, 4.0);

/// Finds dark quadrangles of 8 px a side and more, clockwise, each once for every way in which it was found.
pub(super) fn quads(grey: &Plane) -> Vec<Quad> {
    let long = grey.width.max(grey.height) as f64;
    let mut found = Vec::new();
    let sums = Sums::of(grey);
    for radius in AROUND.into_iter().chain([AROUND_PART * long]) {
        let dark = darker(grey, &sums, radius as usize);
        // Squares that touch at their corners are one region until their rims are taken away.
        let thin = morphology::erode(&dark, Norm::LInf, 1);
        for (mask, grow) in [(&dark, 0.0), (&thin, 1.0)] {
            for contour in find_contours::<i32>(mask) {
                if contour.border_type == BorderType::Outer
                    && let Some(quad) = four_sided(&contour.points)
                {
                    let quad = grown(&quad, grow + 0.5);
                    found.push(sharpened(grey, &quad).unwrap_or(quad));
                }
            }
        }
    }
    found
}

/// Sums of all pixels above and to the left.
struct Sums {
    width: usize,
    sums: Vec<f64>,
}

impl Sums {
    fn of(plane: &Plane) -> Self {
        let (w, h) = (plane.width, plane.height);
        let mut sums = vec![0.0; (w + 1) * (h + 1)];
        for y in 0..h {
            let mut row = 0.0;
            for x in 0..w {
                row += f64::from(plane.data[y * w + x]);
                sums[(y + 1) * (w + 1) + x + 1] = sums[y * (w + 1) + x + 1] + row;
            }
        }
        Self { width: w + 1, sums }
    }

    fn within(&self, x: std::ops::Range<usize>, y: std::ops::Range<usize>) -> f64 {
        let at = |x: usize, y: usize| self.sums[y * self.width + x];
        at(x.end, y.end) - at(x.start, y.end) - at(x.end, y.start) + at(x.start, y.start)
    }
}

/// Pixels that are darker than the mean of the square around them.
fn darker(grey: &Plane, sums: &Sums, radius: usize) -> GrayImage {
    let (w, h) = (grey.width, grey.height);
    GrayImage::from_fn(w as u32, h as u32, |x, y| {
        let (x, y) = (x as usize, y as usize);
        let columns = x.saturating_sub(radius)..(x + radius + 1).min(w);
        let rows = y.saturating_sub(radius)..(y + radius + 1).min(h);
        let count = columns.len() * rows.len();
        let mean = sums.within(columns, rows) / count as f64;
        Luma([if f64::from(grey.data[y * w + x]) < mean - DARKER { 255 } else { 0 }])
    })
}

/// The corners of a border that is a convex quadrangle, clockwise.
fn four_sided(border: &[Point<i32>]) -> Option<Quad> {
    let size = border.len() as f64;
    if size < 4.0 * LEAST_SIDE {
        return None;
    }
    let point = |p: &Point<i32>| Vector2::new(f64::from(p.x), f64::from(p.y));
    let mut ring: Vec<Vector2<f64>> = border.iter().map(point).collect();
    // A border begins anywhere on a side; what is farthest from there is a corner, and what is farthest from that another.
    let farthest = |ring: &[Vector2<f64>]| {
        let far = |i: &usize| (ring[*i] - ring[0]).norm_squared();
        (0..ring.len()).max_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0)
    };
    let first = farthest(&ring);
    ring.rotate_left(first);
    let other = farthest(&ring);
    ring.push(ring[0]);
    let mut corners = vec![ring[0]];
    corner_between(&ring[..=other], STRAIGHT * size, &mut corners);
    corners.push(ring[other]);
    corner_between(&ring[other..], STRAIGHT * size, &mut corners);
    let mut quad: Quad = corners.try_into().ok()?;
    let turn = |i: usize| {
        let [p, q, r] = [quad[i], quad[(i + 1) % 4], quad[(i + 2) % 4]];
        (q - p).perp(&(r - q))
    };
    let turns: Vec<f64> = (0..4).map(turn).collect();
    let is_convex = turns.iter().all(|t| *t > 0.0) || turns.iter().all(|t| *t < 0.0);
    // v is down: a positive turn is clockwise as seen.
    if turns[0] < 0.0 {
        quad.swap(1, 3);
    }
    let is_large = (0..4).all(|i| (quad[(i + 1) % 4] - quad[i]).norm() >= LEAST_SIDE);
    (is_convex && is_large).then_some(quad)
}

/// Adds the corners of a piece of a border to a list, its ends left out.
///
/// Source: Douglas and Peucker, 1973, with distances to the stretch between two corners, not to its line: `imageproc`'s
/// polygons lose corners of borders that begin along a side.
fn corner_between(piece: &[Vector2<f64>], most: f64, corners: &mut Vec<Vector2<f64>>) {
    let [first, .., last] = piece else { return };
    let along = last - first;
    let square = along.norm_squared();
    let off = |p: &Vector2<f64>| {
        let t = if square > 0.0 { ((p - first).dot(&along) / square).clamp(0.0, 1.0) } else { 0.0 };
        (p - (first + along * t)).norm()
    };
    let farthest = (0..piece.len()).max_by(|&a, &b| off(&piece[a]).total_cmp(&off(&piece[b])));
    if let Some(at) = farthest.filter(|&at| off(&piece[at]) > most) {
        corner_between(&piece[..=at], most, corners);
        corners.push(piece[at]);
        corner_between(&piece[at..], most, corners);
    }
}

/// Moves corners away from the middle by `by` px: a border runs through the middles of the outermost pixels.
fn grown(quad: &Quad, by: f64) -> Quad {
    let middle = quad.iter().sum::<Vector2<f64>>() / 4.0;
    quad.map(|corner| {
        let out = corner - middle;
        // To the side, not along the diagonal.
        corner + out * (by * std::f64::consts::SQRT_2 / out.norm().max(1.0))
    })
}

/// Puts the sides where the picture gets brighter most, and the corners where these meet; `None` where a side has no edge.
fn sharpened(grey: &Plane, quad: &Quad) -> Option<Quad> {
    let mut lines = Vec::with_capacity(4);
    for i in 0..4 {
        lines.push(edge(grey, &quad[i], &quad[(i + 1) % 4])?);
    }
    let mut corners = *quad;
    for i in 0..4 {
        let (p, u) = lines[(i + 3) % 4];
        let (q, v) = lines[i];
        let across = u.perp(&v);
        if across.abs() < 0.1 {
            return None;
        }
        corners[i] = p + u * ((q - p).perp(&v) / across);
        if (corners[i] - quad[i]).norm() > 2.0 * BESIDE.1 {
            return None;
        }
    }
    Some(corners)
}

/// The line along which it gets brighter outside of a side: a point of it and its direction.
fn edge(
    grey: &Plane,
    from: &Vector2<f64>,
    to: &Vector2<f64>,
) -> Option<(Vector2<f64>, Vector2<f64>)> {
    let along = to - from;
    let out = Vector2::new(along.y, -along.x).normalize();
    let reach = (BESIDE.0 * along.norm()).clamp(1.5, BESIDE.1);
    let mut points: Vec<Vector2<f64>> = Vec::with_capacity(ALONG);
    for k in 0..ALONG {
        let share = ENDS + (1.0 - 2.0 * ENDS) * k as f64 / (ALONG - 1) as f64;
        let at = from + along * share;
        let slope = |s: f64| {
            let [a, b] = [at + out * (s - 0.5), at + out * (s + 0.5)];
            f64::from(grey.sample(b.x, b.y)) - f64::from(grey.sample(a.x, a.y))
        };
        let steps = (2.0 * reach / 0.25).ceil() as usize;
        let place = |k: usize| -reach + 2.0 * reach * k as f64 / steps as f64;
        let best = (1..steps).max_by(|&a, &b| slope(place(a)).total_cmp(&slope(place(b))))?;
        let [l, m, r] = [best - 1, best, best + 1].map(|k| slope(place(k)));
        if m < DARKER {
            continue;
        }
        let bend = l - 2.0 * m + r;
        let shift = if bend < 0.0 { 0.5 * (l - r) / bend } else { 0.0 };
        points.push(at + out * (place(best) + shift.clamp(-0.5, 0.5) * 2.0 * reach / steps as f64));
    }
    let mut line = fitted(&points)?;
    // What is farther than the others are is another edge.
    for _ in 0..2 {
        let off = |p: &Vector2<f64>| line.1.perp(&(p - line.0)).abs();
        let mut sorted: Vec<f64> = points.iter().map(off).collect();
        sorted.sort_by(f64::total_cmp);
        let most = (3.0 * sorted[sorted.len() / 2]).max(0.2);
        points.retain(|p| line.1.perp(&(p - line.0)).abs() <= most);
        line = fitted(&points)?;
    }
    (points.len() * 2 >= ALONG).then_some(line)
}

/// The line with the least squares of distances.
fn fitted(points: &[Vector2<f64>]) -> Option<(Vector2<f64>, Vector2<f64>)> {
    if points.len() < 3 {
        return None;
    }
    let middle = points.iter().sum::<Vector2<f64>>() / points.len() as f64;
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for p in points {
        let d = p - middle;
        xx += d.x * d.x;
        xy += d.x * d.y;
        yy += d.y * d.y;
    }
    let angle = 0.5 * f64::atan2(2.0 * xy, xx - yy);
    Some((middle, Vector2::new(angle.cos(), angle.sin())))
}
