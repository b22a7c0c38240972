//! The forms of the map, what is fitted to, how, and what a fit says.

use super::super::Error;
use super::compared::Compared;
use super::corner;
use crate::world::Pixel;
use nalgebra::{DMatrix, Matrix3, Vector2, Vector3};

/// One reference point in both pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Where the real camera sees it.
    pub real: Pixel,
    /// Where the twin's camera sees it.
    pub twin: Pixel,
}

/// Which form `M` takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// `u = diag(s_x, s_y) v`: 2 degrees of freedom.
    Scale,
    /// `c = 0`: 6 degrees of freedom.
    Affine,
    /// The full matrix of Eq. 3: 8 degrees of freedom.
    Projective,
    /// The one of the three with the most evidence.
    Auto,
}

impl Model {
    /// The three forms, simplest first.
    pub const FORMS: [Self; 3] = [Self::Scale, Self::Affine, Self::Projective];

    /// Returns its name as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scale => "scale",
            Self::Affine => "affine",
            Self::Projective => "projective",
            Self::Auto => "auto",
        }
    }

    /// Returns the model of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Scale, Self::Affine, Self::Projective, Self::Auto]
            .into_iter()
            .find(|m| m.name() == name)
    }

    /// Returns its degrees of freedom (0 for `Auto`).
    pub fn dof(self) -> usize {
        match self {
            Self::Scale => 2,
            Self::Affine => 6,
            Self::Projective => 8,
            Self::Auto => 0,
        }
    }

    /// Returns how many pairs determine it.
    pub fn minimal(self) -> usize {
        match self {
            Self::Scale | Self::Auto => 1,
            Self::Affine => 3,
            Self::Projective => 4,
        }
    }
}

/// Which of the two pictures is measured with noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NoiseIn {
    /// Both alike: errors are whitened by `I + J Jᵀ`, `J` the map's local derivative (Sampson). This is
    /// what symmetric transfer aims at; summing the two transfer errors would count each error twice and
    /// weigh magnified points wrongly.
    #[default]
    Both,
    /// The real picture only; the twin's pixels are computed and exact.
    Real,
}

/// How to fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Whether rows may be outliers. Without, every row counts.
    pub robust: bool,
    /// Where the noise is.
    pub noise: NoiseIn,
    /// Seed of the sample search.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { robust: true, noise: NoiseIn::Both, seed: 0 }
    }
}

/// The map and what is known about it. Errors are distances `‖u - Mv‖` in the real picture, over the rows
/// that are not outliers.
#[derive(Debug, Clone, PartialEq)]
pub struct MapFit {
    /// The form, never [`Model::Auto`].
    pub model: Model,
    /// `M`, real from twin, with a 1 in its corner.
    pub m: Matrix3<f64>,
    /// Root mean square error, px.
    pub rms_px: f64,
    /// Mean square error, px².
    pub mse_px: f64,
    /// Standard deviation of the errors' lengths, px.
    pub std_px: f64,
    /// Standard deviation of the noise of one coordinate, px, 0 without redundancy.
    pub noise_px: f64,
    /// How many rows it rests on.
    pub kept: usize,
    /// Rows left out, in order.
    pub outliers: Vec<usize>,
    /// Root mean square error of each row as predicted from all others, px; `None` without redundancy.
    pub leave_one_out_px: Option<f64>,
    /// The row predicted worst from all others, and by how much, px.
    pub worst: Option<(usize, f64)>,
    /// Covariance of the free entries of `M` in row order: `m11 m22` for scale, `m11 … m23` for affine,
    /// `m11 … m32` for projective.
    pub covariance: DMatrix<f64>,
    /// Least singular value over the largest of the scaled design; near 0 the points hardly do.
    pub conditioning: f64,
    /// Area of the real picture that wrong pairs may lie in, px²: that of the bounding box of its points.
    pub area_px2: f64,
    /// The models side by side on the same rows, simplest first; the one that was asked for alone unless
    /// [`compare`](super::compare) was asked.
    pub compared: Vec<Compared>,
    /// Why this model.
    pub reason: String,
}

impl MapFit {
    /// Returns the real pixel of a twin pixel, `None` on or beyond the map's horizon.
    pub fn apply(&self, twin: Pixel) -> Option<Pixel> {
        apply(&self.m, twin)
    }

    /// Returns `M⁻¹`, twin from real, with a 1 in its corner.
    ///
    /// # Errors
    ///
    /// [`Error::Singular`] or [`Error::OriginAtInfinity`].
    pub fn inverse(&self) -> Result<Matrix3<f64>, Error> {
        invert(&self.m)
    }

    /// Returns the standard deviation of the real pixel of a twin pixel that comes from the fit's own
    /// uncertainty: along u and v, px. `None` on or beyond the horizon.
    pub fn std_at(&self, twin: Pixel) -> Option<Vector2<f64>> {
        let at = self.apply(twin)?;
        let (x, y) = (twin.u, twin.v);
        let w = self.m[(2, 0)] * x + self.m[(2, 1)] * y + 1.0;
        let rows: [Vec<f64>; 2] = match self.model {
            Model::Scale => [vec![x, 0.0], vec![0.0, y]],
            Model::Affine => [vec![x, y, 1.0, 0.0, 0.0, 0.0], vec![0.0, 0.0, 0.0, x, y, 1.0]],
            _ => [
                vec![x / w, y / w, 1.0 / w, 0.0, 0.0, 0.0, -at.u * x / w, -at.u * y / w],
                vec![0.0, 0.0, 0.0, x / w, y / w, 1.0 / w, -at.v * x / w, -at.v * y / w],
            ],
        };
        let std = |row: &Vec<f64>| {
            let j = nalgebra::DVector::from_column_slice(row);
            j.dot(&(&self.covariance * &j)).max(0.0).sqrt()
        };
        Some(Vector2::new(std(&rows[0]), std(&rows[1])))
    }
}

/// Returns the image of a pixel under a 3 × 3 map, `None` on or beyond its horizon (where the
/// homogeneous coordinate is no longer positive).
pub fn apply(m: &Matrix3<f64>, pixel: Pixel) -> Option<Pixel> {
    let p = m * Vector3::new(pixel.u, pixel.v, 1.0);
    (p.z > 1e-12).then(|| Pixel::new(p.x / p.z, p.y / p.z))
}

/// Returns the inverse of a map with a 1 in its corner.
///
/// # Errors
///
/// [`Error::Singular`], or [`Error::OriginAtInfinity`] when the inverse has a 0 in its corner.
pub fn invert(m: &Matrix3<f64>) -> Result<Matrix3<f64>, Error> {
    let inverse = m.try_inverse().ok_or(Error::Singular)?;
    corner::with_unit_corner(inverse)
}
