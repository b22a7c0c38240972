//! Regression 1: the map `ũ = M ṽ` from the twin's pixels to the real camera's (Eq. 2 and 3).
//!
//! [`fit_map`] takes pairs of pixels and returns `M` with its covariance, the rows that do not belong,
//! the leave-one-out error, and a comparison of the three models of the paper: scale (2 degrees of
//! freedom: one factor per axis), affine (6) and projective (8). [`Model::Auto`] chooses by evidence.
//!
//! A map of the picture plane cannot undo a lens: undistort the pixels first where the lens is known.
//!
//! Source: Hartley and Zisserman, *Multiple View Geometry*, 2nd ed., §4 (normalisation, gold standard,
//! Sampson error); Schwarz 1978 (BIC).

mod fit;
mod model;
mod normalise;
mod pairs;
mod projective;
mod compared;
mod corner;
mod select;
mod wording;

use super::Error;
pub use compared::Compared;
use fit::{describe, fit_one};
pub use model::{MapFit, Model, NoiseIn, Options, Pair, apply, invert};

/// Finds the map from the twin's pixels to the real ones.
///
/// # Errors
///
/// [`Error::TooFew`], [`Error::NotFinite`], [`Error::Coincident`], [`Error::Collinear`],
/// [`Error::Degenerate`], [`Error::NoConsensus`], [`Error::OriginAtInfinity`]; with [`Model::Auto`] only
/// when no model can be fitted.
pub fn fit_map(pairs: &[Pair], model: Model, options: &Options) -> Result<MapFit, Error> {
    for (row, p) in pairs.iter().enumerate() {
        if ![p.real.u, p.real.v, p.twin.u, p.twin.v].iter().all(|v| v.is_finite()) {
            return Err(Error::NotFinite { what: "the pairs", row });
        }
    }
    if model == Model::Auto {
        return select::choose(pairs, options);
    }
    let (map, inliers) = fit_one(pairs, model, options)?;
    let compared = select::compare(pairs, &inliers, options);
    describe(pairs, &map, &inliers, compared, format!("{} was asked for", model.name()))
}
