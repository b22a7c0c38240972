//! Points that are not where the camera that all others agree on shows them, and the camera without them.
//!
//! A corner that a sleeve bends, a tag that was read wrongly: few, and each far off. They are told by how far they are from
//! the fitted camera as a multiple of what points are off in the middle, left out, and all is fitted again, until none is found. What a lens
//! that fits badly leaves is no stray: it has no few points far beyond the others.

use nalgebra::Matrix;

use super::{Calibration, Error, View};
use crate::alignment::picture::median;

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
/// As `fit`'s for all points.
pub fn without<T>(
    views: &[View],
    fit: impl Fn(&[View]) -> Result<(Calibration, T), Error>,
) -> Result<Without<T>, Error> {
    let n: usize = views.iter().map(|view| view.points.len()).sum();
    // Which points of the views given are left.
    let mut kept: Vec<Vec<usize>> =
        views.iter().map(|view| (0..view.points.len()).collect()).collect();
    let mut found = Without { fit: fit(views)?, views: views.to_vec(), strays: Vec::new() };
    for _ in 0..ROUNDS {
        let residuals = &found.fit.0.residuals;
        let mut lengths: Vec<f64> = residuals.iter().flatten().map(Matrix::norm).collect();
        let limit = (CUT * median(&mut lengths) / MEDIAN).max(NEAR);
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
        let is_stray = |view: usize, point: usize| {
            strays.iter().any(|stray| (stray.view, stray.point) == (view, point))
        };
        for (view, kept) in kept.iter_mut().enumerate() {
            kept.retain(|point| !is_stray(view, *point));
        }
        let left = views.iter().zip(&kept).map(|(view, kept)| View {
            points: kept.iter().map(|&point| view.points[point]).collect(),
            ..view.clone()
        });
        let left: Vec<View> = left.collect();
        let Ok(again) = fit(&left) else { break };
        strays.sort_by_key(|stray| (stray.view, stray.point));
        found = Without { fit: again, views: left, strays };
    }
    Ok(found)
}
