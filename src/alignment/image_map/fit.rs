//! One form fitted robustly to the pairs, and what is said of the fit.

use super::super::Error;
use super::super::consensus;

use super::compared::Compared;
use super::model::{MapFit, Model, Options, Pair, apply};
use super::normalise;
use super::pairs::{Map, Pairs};

/// Fits one form: the map and the rows that agree with it.
pub(super) fn fit_one(
    pairs: &[Pair],
    scores: Option<&[f64]>,
    model: Model,
    options: &Options,
) -> Result<(Map, Vec<usize>), Error> {
    let needed = model.minimal();
    if pairs.len() < needed {
        let (what, given) = (model.name(), pairs.len());
        return Err(Error::TooFew { what, of: "pairs", needed, given });
    }
    let all: Vec<usize> = (0..pairs.len()).collect();
    normalise::check_spread(pairs, &all, model)?;
    let data = Pairs::new(pairs, model, options.noise);
    if !options.robust || pairs.len() <= needed {
        let map = data.fit(&all)?;
        return Ok((map, all));
    }
    let Some(found) = consensus::search(&data, scores, options.seed) else {
        // What is wrong with all of them together is what to say; samples may fail for either reason.
        data.fit(&all)?;
        return Err(Error::Degenerate { model: model.name(), free: 1 });
    };
    if found.inliers.len() < needed {
        return Err(Error::NoConsensus {
            model: model.name(),
            agreeing: found.inliers.len(),
            given: pairs.len(),
            of: "pairs",
        });
    }
    normalise::check_spread(pairs, &found.inliers, model)?;
    let map = data.polish(found.model, &found.inliers)?;
    Ok((map, found.inliers))
}

/// Puts the answer together.
pub(super) fn describe(
    pairs: &[Pair],
    map: &Map,
    inliers: &[usize],
    compared: Vec<Compared>,
    reason: String,
) -> Result<MapFit, Error> {
    let (m, covariance) = map.in_pixels()?;
    let lengths: Vec<f64> = inliers
        .iter()
        .map(|&i| apply(&m, pairs[i].twin).map_or(f64::INFINITY, |p| p.distance(pairs[i].real)))
        .collect();
    let n = lengths.len() as f64;
    let mse_px = lengths.iter().map(|l| l * l).sum::<f64>() / n;
    let mean = lengths.iter().sum::<f64>() / n;
    let std_px = (lengths.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / n).sqrt();
    let mut outliers = Vec::new();
    let mut inside = inliers.iter().peekable();
    for row in 0..pairs.len() {
        if inside.next_if(|&&i| i == row).is_none() {
            outliers.push(row);
        }
    }
    Ok(MapFit {
        model: map.model,
        m,
        rms_px: mse_px.sqrt(),
        mse_px,
        std_px,
        noise_px: map.noise_px,
        kept: inliers.len(),
        outliers,
        leave_one_out_px: map.leave_one_out_px,
        worst: map.worst,
        covariance,
        conditioning: map.conditioning,
        area_px2: map.area,
        compared,
        reason,
    })
}
