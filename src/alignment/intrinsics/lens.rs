//! Which terms a lens needs: each is kept only if the views pay for it.
//!
//! Every choice of terms is fitted to the same views. A term more always fits better; the Bayesian information
//! criterion asks it to lower the residuals by more than a term that is nothing would, `BIC = n ln(RSS/n) + k ln n`.
//! A lens that shows one place of the scene twice inside the picture is taken only where nothing else fits nearly
//! as well, and a fisheye only where the evidence for it is very strong: a barrel is bent by either.
//!
//! A term that is not paid for is small, not nothing, and moves the others: the doubt that is said includes what the choices
//! beside it say, each weighed by Akaike's criterion, which asks how well it predicts rather than whether it is true.
//!
//! Source: Schwarz, "Estimating the dimension of a model", Annals of Statistics 1978; Kass and Raftery, "Bayes
//! factors", JASA 1995; Burnham and Anderson, *Model Selection and Multimodel Inference*, 2002, §4.3 (the doubt).

use nalgebra::{SMatrix, SVector, Vector2};

use super::{Calibration, Distortion, Error, Options, View, calibrate, coverage, numbers};
use crate::alignment::reprojection::INTRINSIC;
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
/// `options.distortion` is not looked at. Of one view of a plane `p1` and `p2` are not tried: its principal point is
/// assumed, and they would take up how far that is off, at the price of the focal length.
///
/// # Errors
///
/// As [`calibrate`]'s for a pinhole, when no choice gives an answer.
pub fn choose(views: &[View], options: &Options) -> Result<(Calibration, Vec<Compared>), Error> {
    let mut refused = None;
    let mut fits: Vec<(Compared, Calibration)> = Vec::new();
    let is_centre_assumed = matches!(views, [only] if only.world_from_camera.is_none());
    let tried = |choice: &Distortion| !(is_centre_assumed && choice.is_tangential());
    for distortion in Distortion::ALL.into_iter().filter(tried) {
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
    let covariance = covariance(&fits, chosen);
    let mut fit = fits.swap_remove(chosen).1;
    fit.covariance = covariance;
    fit.std = std::array::from_fn(|i| covariance[(i, i)].max(0.0).sqrt());
    Ok((fit, compared))
}

/// Returns the covariance of what the chosen terms leave to be fitted, about the chosen values, with the doubt which terms the
/// lens has: what each choice that means the same says of them, and how far it is from them.
fn covariance(
    fits: &[(Compared, Calibration)],
    chosen: usize,
) -> SMatrix<f64, INTRINSIC, INTRINSIC> {
    let (own, fit) = &fits[chosen];
    let beside = || {
        fits.iter().filter(|(other, _)| {
            let is_like = other.distortion.model() == own.distortion.model();
            is_like && (other.is_one_to_one || !own.is_one_to_one)
        })
    };
    let most = beside().map(|(of, fit)| support(fit, of.distortion)).fold(f64::MIN, f64::max);
    let (mut weights, mut sum) = (0.0, SMatrix::<f64, INTRINSIC, INTRINSIC>::zeros());
    for (of, other) in beside() {
        let weight = (support(other, of.distortion) - most).exp();
        let off = numbers(&other.intrinsics) - numbers(&fit.intrinsics);
        sum += (other.covariance + off * off.transpose()) * weight;
        weights += weight;
    }
    let is_fitted =
        SVector::<f64, INTRINSIC>::from_fn(|i, _| f64::from(u8::from(fit.std[i] > 0.0)));
    (sum / weights).component_mul(&(is_fitted * is_fitted.transpose()))
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

/// `-BIC/2`.
fn evidence(fit: &Calibration, distortion: Distortion) -> f64 {
    log_likelihood(fit) - 0.5 * terms(distortion) * numbers_seen(fit).ln()
}

/// `-AIC/2`.
fn support(fit: &Calibration, distortion: Distortion) -> f64 {
    log_likelihood(fit) - terms(distortion)
}

/// Of the residuals, but for a constant.
fn log_likelihood(fit: &Calibration) -> f64 {
    // Per coordinate; the other parameters are the same for all choices.
    let variance = 0.5 * fit.rms_px.max(ROUNDING).powi(2);
    -0.5 * numbers_seen(fit) * variance.ln()
}

fn numbers_seen(fit: &Calibration) -> f64 {
    2.0 * fit.residuals.iter().map(Vec::len).sum::<usize>() as f64
}

fn terms(distortion: Distortion) -> f64 {
    distortion.terms().iter().filter(|is_fitted| **is_fitted).count() as f64
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
