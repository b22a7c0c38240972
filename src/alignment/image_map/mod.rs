//! Regression 1: the map `ũ = M ṽ` from the twin's pixels to the real camera's (Eq. 2 and 3).
//!
//! [`fit_map`] takes pairs of pixels and returns `M` with its covariance, the rows that do not belong,
//! and the leave-one-out error. [`compare`] sets the three models of the paper side by side: scale (2 degrees of
//! freedom: one factor per axis), affine (6) and projective (8); [`Model::Auto`] chooses among them by evidence.
//! [`MapFit::uncertainty`] says how far a map can be trusted over the picture, [`MapFit::warnings`] what to beware of.
//!
//! A map of the picture plane cannot undo a lens: undistort the pixels first where the lens is known.
//!
//! Source: Hartley and Zisserman, *Multiple View Geometry*, 2nd ed., §4 (normalisation, gold standard,
//! Sampson error); Schwarz 1978 (BIC).

mod fit;
mod columns;
mod model;
mod normalise;
mod pairs;
mod projective;
mod compared;
mod corner;
mod select;
mod trust;
mod wording;

use super::Error;
use crate::world::Pixel;
pub use compared::Compared;
use fit::{describe, fit_one};
pub use model::{MapFit, Model, NoiseIn, Options, Pair, apply, invert};
pub use trust::{Grid, Side, Warning, reached};

/// Finds the map from the twin's pixels to the real ones.
///
/// # Errors
///
/// [`Error::TooFew`], [`Error::NotFinite`], [`Error::Coincident`], [`Error::Collinear`],
/// [`Error::Degenerate`], [`Error::NoConsensus`], [`Error::OriginAtInfinity`]; with [`Model::Auto`] only
/// when no model can be fitted.
pub fn fit_map(pairs: &[Pair], model: Model, options: &Options) -> Result<MapFit, Error> {
    fit_map_ranked(pairs, None, model, options)
}

/// [`fit_map`] with a score for each pair, higher where it is likelier right: the search looks at those first.
///
/// # Errors
///
/// Those of [`fit_map`]; [`Error::Length`] when there is not one score for each pair.
pub fn fit_map_ranked(
    pairs: &[Pair],
    scores: Option<&[f64]>,
    model: Model,
    options: &Options,
) -> Result<MapFit, Error> {
    let is_finite = |p: Pixel| p.u.is_finite() && p.v.is_finite();
    if let Some(row) = pairs.iter().position(|p| !is_finite(p.real) || !is_finite(p.twin)) {
        return Err(Error::NotFinite { what: "the pairs", row });
    }
    if let Some(scores) = scores {
        let (given, expected) = (scores.len(), pairs.len());
        if given != expected {
            return Err(Error::Length { what: "scores", given, expected });
        }
        if let Some(row) = scores.iter().position(|score| !score.is_finite()) {
            return Err(Error::NotFinite { what: "the scores", row });
        }
    }
    if model == Model::Auto {
        return select::choose(pairs, scores, options);
    }
    let (map, inliers) = fit_one(pairs, scores, model, options)?;
    let reason = wording::asked_for(model.name());
    let mut fit = describe(pairs, &map, &inliers, Vec::new(), reason)?;
    fit.compared = vec![select::entry(&map, &fit, inliers.len())];
    Ok(fit)
}

/// Fits every form that they determine to the rows that a fit kept, simplest first.
pub fn compare(pairs: &[Pair], fit: &MapFit, options: &Options) -> Vec<Compared> {
    let is_kept = |row: &usize| fit.outliers.binary_search(row).is_err();
    let kept: Vec<usize> = (0..pairs.len()).filter(is_kept).collect();
    select::compare(pairs, &kept, options)
}
