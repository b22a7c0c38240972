//! Points that are not where the camera that all others agree on shows them, and the camera without them.
//!
//! A corner that a sleeve bends, a tag that was read wrongly: few, and each far off. They are told by how far they are from
//! the fitted camera as a multiple of what points are off in the middle, left out, and all is fitted again, until none is found. What a lens
//! that fits badly leaves is no stray: it has no few points far beyond the others.
//!
//! What is so far off that no camera comes out, or a poor one, is left out before the first: `gross.rs` suspects it.

use nalgebra::Matrix;

use super::{Calibration, Error, View, gross};
use crate::alignment::picture::median;
use crate::world::Camera;

/// A point is a stray when it is so many times farther off than noise that the median of all points tells: one in ten million.
/// Chosen above 4, beyond which 1 of 3000 clean ones lies, since what is left of a lens has longer tails than noise.
const CUT: f64 = 6.0;
/// The median length of a two-dimensional standard normal vector.
const MEDIAN: f64 = 1.177;
/// Nearer than this nothing is a stray, px: the pictures are without noise.
const NEAR: f64 = 0.05;
/// The part of the points that may be strays. More is a camera that does not fit.
const MOST: f64 = 0.1;
/// Points that a view keeps.
const LEAST: usize = 6;
/// Of a view those that are off by this part of its farthest are left out at once: what is far off draws the view to itself, and others away.
const AT_ONCE: f64 = 0.5;
/// Times that all is fitted. Each finds what the strays before have hidden; ten of them halve the farthest a thousand times.
const ROUNDS: usize = 10;
/// What is suspected before there is a camera is wrong where without it points are off by less than this part of what they are off
/// with it, in the middle. Chosen: noise alters a median of 50 points by a tenth, a corner at the other end of the picture by ten times.
const CLEARER: f64 = 0.5;

/// A point that was left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stray {
    /// Of which view.
    pub view: usize,
    /// Which of its points as they were given.
    pub point: usize,
    /// How far it is from where the camera shows it, px.
    pub off_px: f64,
}

/// A camera from views without their strays.
#[derive(Debug, Clone, PartialEq)]
pub struct Without<T> {
    /// The camera, and what `fit` has to say beside it.
    pub fit: (Calibration, T),
    /// The views without them.
    pub views: Vec<View>,
    /// What was left out, in the order of views.
    pub strays: Vec<Stray>,
}

/// Fits with `fit`, leaves out the strays, and fits again.
///
/// # Errors
///
/// As `fit`'s: for all points, or, where some are suspected, without them.
pub fn without<T>(
    views: &[View],
    fit: impl Fn(&[View]) -> Result<(Calibration, T), Error>,
) -> Result<Without<T>, Error> {
    let n: usize = views.iter().map(|view| view.points.len()).sum();
    let mut found = begun(views, &fit)?;
    for _ in 0..ROUNDS {
        let residuals = &found.fit.0.residuals;
        let limit = (CUT * middle(&found.fit.0) / MEDIAN).max(NEAR);
        let kept = kept(views, &places(&found.strays));
        let mut strays = found.strays.clone();
        for (view, residuals) in residuals.iter().enumerate() {
            let worst = residuals.iter().map(Matrix::norm).fold(0.0, f64::max);
            let limit = limit.max(AT_ONCE * worst);
            let far = residuals.iter().zip(&kept[view]).filter(|(r, _)| r.norm() > limit);
            let far = far.map(|(r, &point)| Stray { view, point, off_px: r.norm() });
            let far: Vec<Stray> = far.collect();
            if kept[view].len() >= far.len() + LEAST {
                strays.extend(far);
            }
        }
        if strays.len() == found.strays.len() || strays.len() as f64 > MOST * n as f64 {
            break;
        }
        strays.sort_by_key(|stray| (stray.view, stray.point));
        let left = without_these(views, &places(&strays));
        let Ok(again) = fit(&left) else { break };
        found = Without { fit: again, views: left, strays };
    }
    Ok(found)
}

/// The first camera: of all points, or without those that are grossly wrong.
fn begun<T>(
    views: &[View],
    fit: &impl Fn(&[View]) -> Result<(Calibration, T), Error>,
) -> Result<Without<T>, Error> {
    let n: usize = views.iter().map(|view| view.points.len()).sum();
    let all = fit(views).map(|fit| Without { fit, views: views.to_vec(), strays: Vec::new() });
    let suspects = gross::suspects(views);
    if suspects.is_empty() || suspects.len() as f64 > MOST * n as f64 {
        return all;
    }
    let clear = without_these(views, &suspects);
    if clear.iter().any(|view| view.points.len() < LEAST) {
        return all;
    }
    match (all, fit(&clear)) {
        (Ok(all), Err(_)) => Ok(all),
        (Ok(all), Ok(fewer)) if middle(&fewer.0) > CLEARER * middle(&all.fit.0) => Ok(all),
        (all, fewer) => {
            let fit = fewer?;
            let off = |(view, point): (usize, usize)| {
                let (at, pixel) = views[view].points[point];
                let world_from_camera = fit.0.views[view].camera_from_world.inverse();
                let camera = Camera { intrinsics: fit.0.intrinsics, world_from_camera };
                let off_px = camera.project(at)?.distance(pixel);
                Some(Stray { view, point, off_px })
            };
            // What the camera cannot show at all is no corner that was seen elsewhere.
            let strays: Option<Vec<Stray>> = suspects.into_iter().map(off).collect();
            strays.map_or(all, |strays| Ok(Without { fit, views: clear, strays }))
        }
    }
}

/// How far a point is off in the middle, px.
fn middle(calibration: &Calibration) -> f64 {
    median(&mut calibration.residuals.iter().flatten().map(Matrix::norm).collect::<Vec<_>>())
}

/// Of which view each is, and which of its points.
fn places(strays: &[Stray]) -> Vec<(usize, usize)> {
    strays.iter().map(|stray| (stray.view, stray.point)).collect()
}

/// Which points of each view are left without some.
fn kept(views: &[View], out: &[(usize, usize)]) -> Vec<Vec<usize>> {
    let of = |(i, view): (usize, &View)| {
        (0..view.points.len()).filter(|&point| !out.contains(&(i, point))).collect()
    };
    views.iter().enumerate().map(of).collect()
}

/// The views without some of their points.
fn without_these(views: &[View], out: &[(usize, usize)]) -> Vec<View> {
    let left = views.iter().zip(kept(views, out)).map(|(view, kept)| View {
        points: kept.iter().map(|&point| view.points[point]).collect(),
        ..view.clone()
    });
    left.collect()
}
