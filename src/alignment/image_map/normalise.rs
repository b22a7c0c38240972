//! Coordinates that a fit is easy in, the map of one point, and whether points spread enough.

use nalgebra::{Matrix2, Matrix3, Vector2};

pub(super) use super::corner::with_unit_corner;
use super::{Error, Model, Pair};
use crate::world::Pixel;

/// `n = (pixel - centre) / size`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub(super) centre: Vector2<f64>,
    pub(super) size: f64,
}

impl Frame {
    pub(super) fn of(pixels: impl Iterator<Item = Pixel> + Clone, keep_origin: bool) -> Self {
        let n = pixels.clone().count().max(1) as f64;
        let centre = if keep_origin {
            Vector2::zeros()
        } else {
            pixels.clone().map(|p| Vector2::new(p.u, p.v)).sum::<Vector2<f64>>() / n
        };
        let square = pixels.map(|p| (Vector2::new(p.u, p.v) - centre).norm_squared()).sum::<f64>();
        let size = (square / (2.0 * n)).sqrt();
        Self { centre, size: if size > 0.0 { size } else { 1.0 } }
    }

    pub(super) fn normalise(&self, p: Pixel) -> Vector2<f64> {
        (Vector2::new(p.u, p.v) - self.centre) / self.size
    }

    /// Pixel from normalised.
    pub(super) fn matrix(&self) -> Matrix3<f64> {
        let (c, s) = (self.centre, self.size);
        Matrix3::new(s, 0.0, c.x, 0.0, s, c.y, 0.0, 0.0, 1.0)
    }

    pub(super) fn inverse(&self) -> Matrix3<f64> {
        let (c, s) = (self.centre, self.size);
        Matrix3::new(1.0 / s, 0.0, -c.x / s, 0.0, 1.0 / s, -c.y / s, 0.0, 0.0, 1.0)
    }
}

/// The map of one normalised point: image, and its derivative.
pub(super) fn project(
    m: &Matrix3<f64>,
    v: Vector2<f64>,
) -> Option<(Vector2<f64>, Matrix2<f64>, f64)> {
    let w = m[(2, 0)] * v.x + m[(2, 1)] * v.y + m[(2, 2)];
    if w <= 1e-9 {
        return None;
    }
    let x = (m[(0, 0)] * v.x + m[(0, 1)] * v.y + m[(0, 2)]) / w;
    let y = (m[(1, 0)] * v.x + m[(1, 1)] * v.y + m[(1, 2)]) / w;
    let d = Matrix2::new(
        m[(0, 0)] - x * m[(2, 0)],
        m[(0, 1)] - x * m[(2, 1)],
        m[(1, 0)] - y * m[(2, 0)],
        m[(1, 1)] - y * m[(2, 1)],
    ) / w;
    Some((Vector2::new(x, y), d, w))
}

/// The entries uu, uv, vv of the scatter about the mean, px².
fn scatter(pixels: impl Iterator<Item = Pixel> + Clone) -> [f64; 3] {
    let (mut n, mut mean) = (0.0, Vector2::zeros());
    for p in pixels.clone() {
        mean += Vector2::new(p.u, p.v);
        n += 1.0;
    }
    mean /= f64::max(n, 1.0);
    let mut sums = [0.0; 3];
    for p in pixels {
        let (u, v) = (p.u - mean.x, p.v - mean.y);
        sums[0] += u * u;
        sums[1] += u * v;
        sums[2] += v * v;
    }
    sums.map(|sum| sum / f64::max(n, 1.0))
}

/// Root mean square distance of points from the line nearest to them, px.
pub(super) fn across(pixels: impl Iterator<Item = Pixel> + Clone) -> f64 {
    let [uu, uv, vv] = scatter(pixels);
    Matrix2::new(uu, uv, uv, vv).symmetric_eigenvalues().min().max(0.0).sqrt()
}

/// The points of one picture, and what they are called.
type Side = (&'static str, fn(&Pair) -> Pixel);

/// Refuses points that are all one, or on one line where the model needs two dimensions.
pub(super) fn check_spread(pairs: &[Pair], rows: &[usize], model: Model) -> Result<(), Error> {
    if model == Model::Scale {
        return Ok(());
    }
    let sides: [Side; 2] = [("real points", |p| p.real), ("twin points", |p| p.twin)];
    for (what, side) in sides {
        let [uu, uv, vv] = scatter(rows.iter().map(|&i| side(&pairs[i])));
        let spread = (uu + vv).sqrt();
        if spread < 1e-6 {
            return Err(Error::Coincident { what, spread, unit: "px" });
        }
        let across = Matrix2::new(uu, uv, uv, vv).symmetric_eigenvalues().min().max(0.0).sqrt();
        if across < 1e-6 * spread {
            return Err(Error::Collinear { what, ratio: across / spread });
        }
    }
    Ok(())
}
