//! Grids of dark circles: rows above each other, or every second row shifted by half a step.
//!
//! Dark round regions (`discs`) are told apart by their places in the grid, then each one's middle is measured, and
//! what a circle's picture is off from the picture of its middle is taken off (`eccentricity`). All must be in the
//! picture.
//!
//! Source: the layouts of `OpenCV`'s `findCirclesGrid`.

use image::RgbImage;
use nalgebra::Vector2;

use super::charuco::BadBoard;
use super::discs::{Regions, thresholds};
use super::lattice::{Lattice, largest};
use super::{Found, NotFound, eccentricity};
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
    /// [`NotFound::Circles`], and [`NotFound::Exchanged`] of the board with columns and rows exchanged.
    pub fn find(&self, image: &RgbImage) -> Result<Found, NotFound> {
        let grey = Plane::grey(image);
        let asked = self.columns * self.rows;
        let (mut most, mut is_exchanged) = (0, false);
        let exchanged = Self { columns: self.rows, rows: self.columns, ..*self };
        for dark in thresholds(&grey) {
            let regions = Regions::of(&dark);
            let rough: Vec<Vector2<f64>> = regions.round.iter().map(|disc| disc.middle).collect();
            let grid = largest(&rough);
            most = most.max(grid.len());
            let Some(order) = self.told_apart(&grid, &rough) else {
                is_exchanged |= exchanged.told_apart(&grid, &rough).is_some();
                continue;
            };
            let measured = |&i: &usize| {
                let disc = &regions.round[i];
                regions.measured(&grey, disc).unwrap_or(*disc)
            };
            let discs: Vec<_> = order.iter().map(measured).collect();
            let points = self.points();
            let middles = eccentricity::without(&points, &discs, (grey.width, grey.height));
            let pair = |(p, q): (&Vector2<f64>, &Vector2<f64>)| {
                (Point::new(p.x, p.y, 0.0), Pixel::new(q.x, q.y))
            };
            return Ok(points.iter().zip(&middles).map(pair).collect());
        }
        if is_exchanged {
            return Err(NotFound::Exchanged { columns: self.rows, rows: self.columns });
        }
        Err(NotFound::Circles { seen: most, asked })
    }

    /// Returns which of the middles is that of each circle of the board, row by row, if the grid is the board's. Of two ways
    /// that the circles do not tell apart the one whose first circle is nearer to the picture's top left corner counts.
    fn told_apart(&self, grid: &Lattice, middles: &[Vector2<f64>]) -> Option<Vec<usize>> {
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
        let mut best: Option<(f64, Vec<usize>)> = None;
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
                    best = Some((from_corner, order));
                }
            }
        }
        best.map(|(_, order)| order)
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
