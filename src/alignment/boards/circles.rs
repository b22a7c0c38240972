//! Grids of dark circles: rows above each other, or every second row shifted by half a step.
//!
//! Dark round regions are found, each one's middle by its darkness, and told apart by their places in the grid. All must be
//! in the picture. The middle of a circle's picture is not the picture of its middle: on a board tilted by `t` it is off by
//! `f (r/d)² sin t cos t`, a tenth of a pixel for 9 mm at half a metre and a focal length of 900 px. That is not put right.
//!
//! Source: the layouts of `OpenCV`'s `findCirclesGrid`; Heikkilä and Silvén, "A four-step camera calibration procedure",
//! CVPR 1997, §3 (the middle of an ellipse).

use image::{GrayImage, RgbImage};
use imageproc::region_labelling::{Connectivity, connected_components};
use nalgebra::Vector2;

use super::charuco::BadBoard;
use super::lattice::{Lattice, largest};
use super::{Found, NotFound};
use crate::alignment::plane::Plane;
use crate::world::{Pixel, Point};

/// A grid of circles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circles {
    /// Circles along a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Between two rows, and along a row between the columns of the plain grid, m.
    pub step: f64,
    /// Whether every second row is shifted by half of the way between two of its circles, which is two steps then.
    pub shifted: bool,
}

/// The least and the most pixels of a circle, the most as a share of the picture.
const LEAST_PIXELS: usize = 12;
const MOST_SHARE: f64 = 0.05;
/// Of a round region's pixels, the share of its ellipse that they fill: one of a half-moon is less, one of a square more.
const FILLED: [f64; 2] = [0.85, 1.12];
/// The longest ellipse that a circle is seen as: tilted by 70 deg.
const LONGEST: f64 = 3.0;

impl Circles {
    /// Returns the grid, if it is one that can be looked for; `step` in m.
    ///
    /// # Errors
    ///
    /// [`BadBoard`].
    pub fn new(columns: usize, rows: usize, step: f64, shifted: bool) -> Result<Self, BadBoard> {
        if columns.min(rows) < 3 {
            return Err(BadBoard::TooSmall { least: 3 });
        }
        if !(step > 0.0 && step.is_finite()) {
            return Err(BadBoard::Sides);
        }
        Ok(Self { columns, rows, step, shifted })
    }

    /// Returns the points, m, row by row.
    fn points(&self) -> Vec<Vector2<f64>> {
        let place = |c: usize, r: usize| {
            let x = if self.shifted { 2 * c + r % 2 } else { c };
            Vector2::new(x as f64, r as f64) * self.step
        };
        (0..self.rows).flat_map(|r| (0..self.columns).map(move |c| place(c, r))).collect()
    }

    /// Returns whether the board is bright at a place, m from the middle of its first circle; for printing it.
    #[must_use]
    pub fn is_bright(&self, x: f64, y: f64) -> bool {
        let radius = if self.shifted { 0.5 } else { 0.3 } * self.step;
        let row = (y / self.step).round();
        if !(0.0..self.rows as f64).contains(&row) {
            return true;
        }
        let (wide, shift) = if self.shifted { (2.0, row % 2.0) } else { (1.0, 0.0) };
        let column = ((x / self.step - shift) / wide).round();
        let middle = Vector2::new(column * wide + shift, row) * self.step;
        let is_one = (0.0..self.columns as f64).contains(&column);
        !is_one || (middle - Vector2::new(x, y)).norm() > radius
    }

    /// Finds the middles of all circles.
    ///
    /// # Errors
    ///
    /// [`NotFound::Circles`].
    pub fn find(&self, image: &RgbImage) -> Result<Found, NotFound> {
        let grey = Plane::grey(image);
        let asked = self.columns * self.rows;
        let mut most = 0;
        for dark in thresholds(&grey) {
            let middles = middles(&grey, &dark);
            let grid = largest(&middles);
            most = most.max(grid.len());
            if let Some(found) = self.told_apart(&grid, &middles) {
                return Ok(found);
            }
        }
        Err(NotFound::Circles { seen: most, asked })
    }

    /// Gives each circle its place on the board, if the grid is the board's. Of two ways that the circles do not tell apart
    /// the one whose first circle is nearer to the picture's top left corner counts.
    fn told_apart(&self, grid: &Lattice, middles: &[Vector2<f64>]) -> Option<Found> {
        let points = self.points();
        if grid.len() != points.len() {
            return None;
        }
        // Steps of the grid along the board: a shifted board's nearest neighbours lie diagonally.
        let cell = |p: &Vector2<f64>| {
            let at = p / self.step;
            let (x, y) = (at.x.round() as i32, at.y.round() as i32);
            if self.shifted { ((x + y).div_euclid(2), (y - x).div_euclid(2)) } else { (x, y) }
        };
        let cells: Vec<(i32, i32)> = points.iter().map(cell).collect();
        let mut best: Option<(f64, Found)> = None;
        for turn in 0..4 {
            // Quarter turns only: a board is not seen mirrored.
            for flip in [false, true] {
                let moved = |(x, y): (i32, i32)| {
                    let (x, y) = if flip { (y, x) } else { (x, y) };
                    match turn {
                        0 => (x, y),
                        1 => (-y, x),
                        2 => (-x, -y),
                        _ => (y, -x),
                    }
                };
                let keys: Vec<(i32, i32)> = cells.iter().copied().map(moved).collect();
                let first = |list: &mut dyn Iterator<Item = (i32, i32)>| {
                    list.fold((i32::MAX, i32::MAX), |a, b| (a.0.min(b.0), a.1.min(b.1)))
                };
                let (own, seen) =
                    (first(&mut keys.iter().copied()), first(&mut grid.keys().copied()));
                let at = |key: &(i32, i32)| {
                    grid.get(&(key.0 - own.0 + seen.0, key.1 - own.1 + seen.1)).copied()
                };
                let Some(order) = keys.iter().map(at).collect::<Option<Vec<usize>>>() else {
                    continue;
                };
                let pixels: Vec<Vector2<f64>> = order.iter().map(|i| middles[*i]).collect();
                if is_mirrored(&points, &pixels) {
                    continue;
                }
                let from_corner = pixels[0].x + pixels[0].y;
                if best.as_ref().is_none_or(|(other, _)| from_corner < *other) {
                    let pair = |(p, q): (&Vector2<f64>, &Vector2<f64>)| {
                        (Point::new(p.x, p.y, 0.0), Pixel::new(q.x, q.y))
                    };
                    best = Some((from_corner, points.iter().zip(&pixels).map(pair).collect()));
                }
            }
        }
        best.map(|(_, found)| found)
    }
}

/// Whether x to y turns the other way in the picture than on the board.
fn is_mirrored(points: &[Vector2<f64>], pixels: &[Vector2<f64>]) -> bool {
    let middle = |list: &[Vector2<f64>]| list.iter().sum::<Vector2<f64>>() / list.len() as f64;
    let (a, b) = (middle(points), middle(pixels));
    // The sign of the best linear map's determinant.
    let mut m = nalgebra::Matrix2::zeros();
    for (p, q) in points.iter().zip(pixels) {
        m += (q - b) * (p - a).transpose();
    }
    m.determinant() < 0.0
}

/// Pictures in which what may be circles is white, by thresholds between the darkest and the brightest of places around.
fn thresholds(grey: &Plane) -> Vec<GrayImage> {
    let blur = |part: f64| {
        let sigma = part * grey.width.max(grey.height) as f64;
        // Blurred small, since it is smooth.
        let mut small = grey.clone();
        let mut size = 1.0;
        while sigma / size > 4.0 {
            small = small.halved();
            size *= 2.0;
        }
        (small.blurred((sigma / size) as f32), size)
    };
    [0.02, 0.05]
        .into_iter()
        .map(|part| {
            let (around, size) = blur(part);
            GrayImage::from_fn(grey.width as u32, grey.height as u32, |x, y| {
                let own = grey.data[y as usize * grey.width + x as usize];
                let at = |p: u32| (f64::from(p) + 0.5) / size - 0.5;
                let mean = around.sample(at(x), at(y));
                image::Luma([if own < 0.85 * mean - 4.0 { 255 } else { 0 }])
            })
        })
        .collect()
}

/// The middles of dark round regions.
fn middles(grey: &Plane, dark: &GrayImage) -> Vec<Vector2<f64>> {
    let labels = connected_components(dark, Connectivity::Four, image::Luma([0]));
    let count = labels.pixels().map(|p| p.0[0]).max().unwrap_or(0) as usize;
    // Number of pixels, sums of x, y, xx, xy, yy, and the box around.
    let mut sums = vec![[0.0_f64; 6]; count + 1];
    let mut boxes = vec![[u32::MAX, u32::MAX, 0, 0]; count + 1];
    for (x, y, label) in labels.enumerate_pixels() {
        let label = label.0[0] as usize;
        if label == 0 {
            continue;
        }
        let (u, v) = (f64::from(x), f64::from(y));
        for (sum, value) in sums[label].iter_mut().zip([1.0, u, v, u * u, u * v, v * v]) {
            *sum += value;
        }
        let b = &mut boxes[label];
        *b = [b[0].min(x), b[1].min(y), b[2].max(x), b[3].max(y)];
    }
    let largest = MOST_SHARE * (grey.width * grey.height) as f64;
    let round = (1..=count).filter(|&k| {
        let [n, x, y, xx, xy, yy] = sums[k];
        // What the picture's border cuts has no middle.
        let [left, top, right, bottom] = boxes[k].map(|at| at as usize);
        let is_cut = left == 0 || top == 0 || right + 1 >= grey.width || bottom + 1 >= grey.height;
        if is_cut || n < LEAST_PIXELS as f64 || n > largest {
            return false;
        }
        let (a, b, c) =
            (xx / n - (x / n).powi(2), xy / n - x * y / n / n, yy / n - (y / n).powi(2));
        // A pixel's own width.
        let (a, c) = (a + 1.0 / 12.0, c + 1.0 / 12.0);
        let (mean, off) = (0.5 * (a + c), (0.25 * (a - c).powi(2) + b * b).sqrt());
        let (long, short) = ((mean + off).sqrt(), (mean - off).max(1e-9).sqrt());
        // An ellipse's half axes are twice the deviations of its pixels.
        let filled = n / (std::f64::consts::PI * 4.0 * long * short);
        (FILLED[0]..FILLED[1]).contains(&filled) && long < LONGEST * short
    });
    round.map(|k| middle(grey, boxes[k])).collect()
}

/// The middle of what is darker than the rim of a box around a region.
fn middle(grey: &Plane, [left, top, right, bottom]: [u32; 4]) -> Vector2<f64> {
    let pad = 2;
    let (x0, y0) = (i64::from(left) - pad, i64::from(top) - pad);
    let (x1, y1) = (i64::from(right) + pad, i64::from(bottom) + pad);
    let mut rim: Vec<f32> = Vec::new();
    for x in x0..=x1 {
        rim.extend([grey.at(x, y0), grey.at(x, y1)]);
    }
    for y in y0..=y1 {
        rim.extend([grey.at(x0, y), grey.at(x1, y)]);
    }
    rim.sort_by(f32::total_cmp);
    let bright = f64::from(rim[rim.len() / 2]);
    let (mut sum, mut weight) = (Vector2::zeros(), 0.0);
    for y in y0..=y1 {
        for x in x0..=x1 {
            // What is nearly as bright as the rim is its noise.
            let darker = (bright - f64::from(grey.at(x, y)) - 0.1 * bright).max(0.0);
            sum += Vector2::new(x as f64, y as f64) * darker;
            weight += darker;
        }
    }
    if weight > 0.0 { sum / weight } else { Vector2::new((x0 + x1) as f64, (y0 + y1) as f64) / 2.0 }
}
