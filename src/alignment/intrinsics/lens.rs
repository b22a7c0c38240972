//! Which terms a lens needs: each is kept only if the views pay for it.
//!
//! Every choice of terms is fitted to the same views. A term more always fits better; the Bayesian information
//! criterion asks it to lower the residuals by more than a term that is nothing would, `BIC = n ln(RSS/n) + k ln n`.
//! A lens that shows one place of the scene twice inside the picture is taken only where nothing else fits nearly
//! as well, and a fisheye only where the evidence for it is very strong: a barrel is bent by either.
//!
//! Source: Schwarz, "Estimating the dimension of a model", Annals of Statistics 1978; Kass and Raftery, "Bayes
//! factors", JASA 1995.

use nalgebra::Vector2;

use super::{Calibration, Distortion, Error, Options, View, calibrate, coverage};
use crate::world::{Intrinsics, LensModel, Pixel};

/// One choice of terms beside the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compared {
    /// The terms.
    pub distortion: Distortion,
    /// Root mean square reprojection error per point, px.
    pub rms_px: f64,
    /// `-BIC/2`; more is better. Only differences mean something.
    pub evidence: f64,
    /// Whether it can be undone everywhere in the picture.
    pub is_one_to_one: bool,
}

/// Finds what is inside the camera with the terms of the lens that the views pay for, and says how all choices fit.
///
/// `options.distortion` is not looked at.
///
/// # Errors
///
/// As [`calibrate`]'s for a pinhole, when no choice gives an answer.
pub fn choose(views: &[View], options: &Options) -> Result<(Calibration, Vec<Compared>), Error> {
    let mut refused = None;
    let mut fits: Vec<(Compared, Calibration)> = Vec::new();
    for distortion in Distortion::ALL {
        match calibrate(views, &Options { distortion, ..*options }) {
            Ok(fit) => {
                let evidence = evidence(&fit, distortion);
                let is_one_to_one = is_one_to_one(&fit.intrinsics, views);
                let rms_px = fit.rms_px;
                fits.push((Compared { distortion, rms_px, evidence, is_one_to_one }, fit));
            }
            // The plainest one says why.
            Err(error) => {
                refused.get_or_insert(error);
            }
        }
    }
    // A barrel seen face-on has a focal length only if it is believed to be a fisheye's: what no pinhole makes of such views, no fisheye may.
    if fits.iter().all(|(compared, _)| compared.distortion.model() == LensModel::Fisheye) {
        fits.retain(|(_, fit)| fit.views.len() >= coverage::PLANES && is_tilted(fit));
    }
    let compared: Vec<Compared> = fits.iter().map(|(compared, _)| *compared).collect();
    let Some(chosen) = best(&compared) else {
        return Err(refused.unwrap_or(Error::Degenerate { model: "the lens", free: 1 }));
    };
    Ok((fits.swap_remove(chosen).1, compared))
}

/// Which choice it is.
fn best(compared: &[Compared]) -> Option<usize> {
    let most = |is_allowed: &dyn Fn(&Compared) -> bool| {
        let allowed = compared.iter().enumerate().filter(|(_, c)| is_allowed(c));
        allowed.max_by(|a, b| a.1.evidence.total_cmp(&b.1.evidence))
    };
    let of = |model: LensModel| {
        let any = most(&|c| c.distortion.model() == model);
        let whole = most(&|c| c.distortion.model() == model && c.is_one_to_one);
        whole.filter(|w| any.is_none_or(|a| w.1.evidence + STRONG > a.1.evidence)).or(any)
    };
    match (of(LensModel::Brown), of(LensModel::Fisheye)) {
        (Some(brown), Some(fisheye)) => {
            // What folds must be better by as much as a fisheye must be otherwise.
            let ahead = if brown.1.is_one_to_one { STRONG } else { -STRONG };
            let is_fisheye =
                fisheye.1.is_one_to_one && fisheye.1.evidence > brown.1.evidence + ahead;
            Some(if is_fisheye { fisheye.0 } else { brown.0 })
        }
        (one, other) => one.or(other).map(|(index, _)| index),
    }
}

/// Whether the target leans in some view.
fn is_tilted(fit: &Calibration) -> bool {
    fit.views.iter().any(|view| coverage::held(view).tilt >= coverage::FACE_ON)
}

/// More evidence than this is very strong: twice the logarithm of a Bayes factor above 10 (Kass and Raftery, §3.2).
const STRONG: f64 = 5.0;
/// Residuals below this are rounding, px: without noise all choices that hold the truth fit alike.
const ROUNDING: f64 = 1e-6;

fn evidence(fit: &Calibration, distortion: Distortion) -> f64 {
    let n = 2.0 * fit.residuals.iter().map(Vec::len).sum::<usize>() as f64;
    // Per coordinate; the other parameters are the same for all choices.
    let variance = 0.5 * fit.rms_px.max(ROUNDING).powi(2);
    let terms = distortion.terms().iter().filter(|is_fitted| **is_fitted).count() as f64;
    -0.5 * (n * variance.ln() + terms * n.ln())
}

/// Whether the lens can be undone at the picture's corners, or, where its size is not known, at every point seen.
pub(super) fn is_one_to_one(k: &Intrinsics, views: &[View]) -> bool {
    if k.model == LensModel::Fisheye {
        let pixels: Vec<Pixel> = if k.width > 0 && k.height > 0 {
            let (w, h) = (f64::from(k.width) - 1.0, f64::from(k.height) - 1.0);
            [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)].map(|(u, v)| Pixel::new(u, v)).into()
        } else {
            views.iter().flat_map(|view| &view.points).map(|(_, pixel)| *pixel).collect()
        };
        return pixels.into_iter().all(|pixel| k.is_even_to(pixel).unwrap_or(true));
    }
    let comes_back = |pixel: Pixel| {
        let back = k.pixel(k.normalise(pixel));
        // Far below any noise, far above the search's rounding.
        back.distance(pixel) < 1e-3
    };
    let grows = |n: Vector2<f64>| k.distortion_slope(n).determinant() > 0.0;
    let (w, h) = (f64::from(k.width) - 1.0, f64::from(k.height) - 1.0);
    if w > 0.0 && h > 0.0 {
        let corners = [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)].map(|(u, v)| Pixel::new(u, v));
        // On the way to a corner as well: a fold further in shows as a slope that turns.
        return corners.into_iter().all(|corner| {
            let n = k.normalise(corner);
            comes_back(corner) && (1..=8).all(|i| grows(n * (f64::from(i) / 8.0)))
        });
    }
    views.iter().flat_map(|view| &view.points).all(|(_, pixel)| comes_back(*pixel))
}
