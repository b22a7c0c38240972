//! The bare table as a smooth surface of colour, and what differs from it.

use nalgebra::{SMatrix, SVector, Vector2};

use super::outline::{Projector, inside_convex};
use super::picture::{Picture, Plane, median};
use crate::world::Table;

type Coefficients = SVector<f64, 6>;

/// The table's colour: per CIELAB channel a quadratic in the picture's coordinates.
#[derive(Debug, Clone)]
pub struct TableModel {
    channels: [Coefficients; 3],
    /// Robust standard deviation of each channel around its surface, CIELAB.
    pub spread: [f64; 3],
    size: (usize, usize),
}

fn basis(x: f64, y: f64) -> Coefficients {
    Coefficients::from([1.0, x, y, x * x, x * y, y * y])
}

impl TableModel {
    /// Fits the surface to the pixels of the table's top by iteratively reweighted least squares.
    ///
    /// Objects, dots and the arm are outliers as long as bare table is the commonest thing to be seen.
    /// `None` when the table covers less than some hundred pixels.
    pub fn fit(picture: &Picture, view: &Projector, table: &Table) -> Option<Self> {
        let (w, h) = (picture.small[0].width, picture.small[0].height);
        let polygon = table_polygon(view, table)?;
        let mut rows: Vec<(usize, Coefficients)> = Vec::new();
        for y in (0..h).step_by(2) {
            for x in (0..w).step_by(2) {
                let p = Vector2::new(4.0 * x as f64 + 1.5, 4.0 * y as f64 + 1.5);
                if inside_convex(&polygon, p) {
                    rows.push((y * w + x, basis(x as f64 / w as f64, y as f64 / h as f64)));
                }
            }
        }
        if rows.len() < 100 {
            return None;
        }
        let mut channels = [Coefficients::zeros(); 3];
        let mut spread = [1.0; 3];
        // All channels share the weights: a blue cup is as little table in lightness as in colour.
        let mut weights = vec![1.0; rows.len()];
        for round in 0..12 {
            let mut square = vec![0.0; rows.len()];
            for c in 0..3 {
                let (mut normal, mut rhs) = (SMatrix::<f64, 6, 6>::zeros(), Coefficients::zeros());
                for ((at, row), weight) in rows.iter().zip(&weights) {
                    normal += *weight * row * row.transpose();
                    rhs += *weight * row * f64::from(picture.small[c].data[*at]);
                }
                for k in 0..6 {
                    normal[(k, k)] += 1e-6;
                }
                channels[c] = normal.cholesky()?.solve(&rhs);
                let residuals: Vec<f64> = rows
                    .iter()
                    .map(|(at, row)| f64::from(picture.small[c].data[*at]) - row.dot(&channels[c]))
                    .collect();
                let mut off: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
                spread[c] = (1.4826 * median(&mut off)).max(0.4);
                for (s, r) in square.iter_mut().zip(&residuals) {
                    *s += (r / spread[c]).powi(2);
                }
            }
            // From mild to firm: first the majority, then only what is close to it.
            let reach: f64 = if round < 4 { 30.0 } else { 12.0 };
            for (weight, s) in weights.iter_mut().zip(&square) {
                *weight = if *s < reach { (1.0 - s / reach).powi(2) } else { 1e-4 };
            }
        }
        Some(Self { channels, spread, size: (w, h) })
    }

    /// Returns the table's colour at a pixel of the small picture, CIELAB.
    pub fn colour(&self, x: f64, y: f64) -> [f64; 3] {
        let row = basis(x / self.size.0 as f64, y / self.size.1 as f64);
        self.channels.map(|c| row.dot(&c))
    }

    /// Returns, per small pixel, how little it looks like table: 0 (bare) to 1.
    ///
    /// Lightness counts a third: a shadow darkens the table and leaves its colour.
    pub fn change(&self, picture: &Picture) -> Plane {
        let (w, h) = self.size;
        let mut change = Plane::zeros(w, h);
        for y in 0..h {
            for x in 0..w {
                let table = self.colour(x as f64, y as f64);
                let mut far = 0.0;
                for (c, colour) in table.iter().enumerate() {
                    let d = f64::from(picture.small[c].data[y * w + x]) - colour;
                    let share = if c == 0 && !picture.is_grey { 0.33 } else { 1.0 };
                    far += share * (d / (self.spread[c] + 0.6)).powi(2);
                }
                // Three spreads are half a change.
                change.data[y * w + x] = (1.0 - (-far / 13.0).exp()) as f32;
            }
        }
        change
    }
}

/// Returns the table's top in the picture, px, if all of it is in front of the camera.
fn table_polygon(view: &Projector, table: &Table) -> Option<Vec<Vector2<f64>>> {
    table.corners().iter().map(|c| view.pixel(nalgebra::Vector3::new(c[0], c[1], 0.0))).collect()
}
