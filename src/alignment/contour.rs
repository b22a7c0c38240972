//! Whether a mask's outline is that of a solid: the gate against bites, spurs and ragged borders.
//!
//! Three numbers that need no model of the shape. Their limits were measured on good masks of cuboids,
//! cylinders and bottles against damaged copies: 95 of 100 good ones pass each. They catch ragged borders
//! and most spurs, few bites and leaks; those show in the overlap with the placed solid.
//!
//! Source: Suzuki and Abe, CVGIP 1985 (borders); the paper's failure "contour not smooth".

use image::GrayImage;
use imageproc::contours::{BorderType, find_contours};
use nalgebra::Vector2;

use super::outline::convex_hull;

/// How smooth a mask's outer border is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothness {
    /// Total turning over 2π after smoothing by a hundredth of the length: 1 for a convex shape.
    pub turning: f64,
    /// Length of the border over that of its convex hull.
    pub hull_ratio: f64,
    /// Area over that of the convex hull.
    pub solidity: f64,
}

/// Returns the longest outer border of a mask, smoothed along itself by a Gaussian of `sigma` px; `None`
/// when there is none of 20 px or more. Points are the mask's outermost pixels, about a pixel apart.
pub(super) fn outer_border(mask: &GrayImage, sigma: f64) -> Option<Vec<Vector2<f64>>> {
    let border: Vec<Vector2<f64>> = find_contours::<i32>(mask)
        .into_iter()
        .filter(|c| c.border_type == BorderType::Outer)
        .max_by_key(|c| c.points.len())?
        .points
        .iter()
        .map(|p| Vector2::new(f64::from(p.x), f64::from(p.y)))
        .collect();
    let n = border.len();
    if n < 20 {
        return None;
    }
    let reach = (3.0 * sigma).ceil() as usize;
    let smooth = (0..n).map(|i| {
        let (mut sum, mut weight) = (Vector2::zeros(), 0.0);
        for k in 0..=2 * reach {
            let w = (-0.5 * ((k as f64 - reach as f64) / sigma).powi(2)).exp();
            sum += w * border[(i + n + k - reach) % n];
            weight += w;
        }
        sum / weight
    });
    Some(smooth.collect())
}

impl Smoothness {
    /// Measures the longest outer border of a mask; `None` when there is none of 20 px or more.
    pub fn of(mask: &GrayImage) -> Option<Self> {
        // Turning is that of the outline, not of its pixels: smoothed by a hundredth of its length.
        let length = outer_border(mask, 2.0)?.len() as f64;
        let smooth = outer_border(mask, (0.012 * length).max(2.0))?;
        let n = smooth.len();
        let step = |i: usize| smooth[(i + 1) % n] - smooth[i % n];
        let turning = (0..n)
            .map(|i| {
                let (a, b) = (step(i), step(i + 1));
                a.perp(&b).atan2(a.dot(&b)).abs()
            })
            .sum::<f64>()
            / std::f64::consts::TAU;
        let hull = convex_hull(&smooth);
        let length = |p: &[Vector2<f64>]| {
            (0..p.len()).map(|i| (p[(i + 1) % p.len()] - p[i]).norm()).sum::<f64>()
        };
        let area = |p: &[Vector2<f64>]| {
            (0..p.len()).map(|i| p[i].perp(&p[(i + 1) % p.len()])).sum::<f64>().abs() / 2.0
        };
        Some(Self {
            turning,
            hull_ratio: length(&smooth) / length(&hull).max(1e-9),
            solidity: area(&smooth) / area(&hull).max(1e-9),
        })
    }

    /// Returns whether all three numbers are those of a good mask.
    pub fn is_smooth(&self) -> bool {
        self.turning < 2.35 && self.hull_ratio < 1.038 && self.solidity > 0.92
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    fn mask(inside: impl Fn(f64, f64) -> bool) -> GrayImage {
        GrayImage::from_fn(160, 160, |x, y| {
            Luma([if inside(f64::from(x) - 80.0, f64::from(y) - 80.0) { 255 } else { 0 }])
        })
    }

    #[test]
    fn solids_are_smooth_and_ragged_masks_are_not() {
        let disc = Smoothness::of(&mask(|x, y| x.hypot(y) < 50.0)).unwrap();
        let square =
            Smoothness::of(&mask(|x, y| (x + 0.3 * y).abs() < 40.0 && y.abs() < 50.0)).unwrap();
        assert!(disc.is_smooth() && square.is_smooth(), "{disc:?} {square:?}");
        let ragged = mask(|x, y| x.hypot(y) < 50.0 + 5.0 * (12.0 * y.atan2(x)).sin());
        let bitten = mask(|x, y| x.hypot(y) < 50.0 && (x - 45.0).hypot(y) > 25.0);
        assert!(!Smoothness::of(&ragged).unwrap().is_smooth());
        assert!(!Smoothness::of(&bitten).unwrap().is_smooth());
        assert_eq!(Smoothness::of(&mask(|_, _| false)), None);
    }
}
