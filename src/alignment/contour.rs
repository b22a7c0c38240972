//! Whether a mask's outline is that of a solid: the gate against bites, spurs and ragged borders.
//!
//! Three numbers that need no model of the shape. Their limits were measured on good masks of cuboids,
//! cylinders and bottles against damaged copies: 95 of 100 good ones pass each. They catch ragged borders
//! and most spurs, few bites and leaks; those show in the overlap with the placed solid.
//!
//! Source: Suzuki and Abe, CVGIP 1985 (borders); the paper's failure "contour not smooth".

use image::{GrayImage, imageops};
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

/// The longest outer border of a mask, as its outermost pixels, about a pixel apart: looked for once, smoothed as often as
/// is asked.
pub(super) struct Border(Vec<Vector2<f64>>);

impl Border {
    /// Follows the border; `None` when there is none of 20 px or more.
    pub(super) fn of(mask: &GrayImage) -> Option<Self> {
        let [x0, y0, x1, y1] = held(mask)?;
        // With one empty pixel around it, if the picture has one there, as in the whole picture.
        let (u, v) = (x0.saturating_sub(1), y0.saturating_sub(1));
        let (w, h) = (mask.width().min(x1 + 2) - u, mask.height().min(y1 + 2) - v);
        let part = imageops::crop_imm(mask, u, v, w, h).to_image();
        let (u, v) = (f64::from(u), f64::from(v));
        let border: Vec<Vector2<f64>> = find_contours::<i32>(&part)
            .into_iter()
            .filter(|c| c.border_type == BorderType::Outer)
            .max_by_key(|c| c.points.len())?
            .points
            .iter()
            .map(|p| Vector2::new(f64::from(p.x) + u, f64::from(p.y) + v))
            .collect();
        (border.len() >= 20).then_some(Self(border))
    }

    /// Returns the border smoothed along itself by a Gaussian of `sigma` px.
    pub(super) fn smooth(&self, sigma: f64) -> Vec<Vector2<f64>> {
        let Self(border) = self;
        let n = border.len();
        let reach = (3.0 * sigma).ceil() as usize;
        let weights: Vec<f64> = (0..=2 * reach)
            .map(|k| (-0.5 * ((k as f64 - reach as f64) / sigma).powi(2)).exp())
            .collect();
        let smooth = (0..n).map(|i| {
            let (mut sum, mut weight) = (Vector2::zeros(), 0.0);
            for (k, w) in weights.iter().enumerate() {
                sum += *w * border[(i + n + k - reach) % n];
                weight += w;
            }
            sum / weight
        });
        smooth.collect()
    }
}

/// Returns the columns and rows, first and last, of what is not zero in a mask; `None` of an empty one.
pub(super) fn held(mask: &GrayImage) -> Option<[u32; 4]> {
    let w = mask.width() as usize;
    let rows = || mask.as_raw().chunks_exact(w.max(1));
    let is_held = |row: &[u8]| row.iter().any(|value| *value > 0);
    let y0 = rows().position(is_held)?;
    let y1 = rows().rposition(is_held)?;
    let (mut x0, mut x1) = (w, 0);
    for row in rows().take(y1 + 1).skip(y0) {
        if let Some(first) = row.iter().position(|value| *value > 0) {
            x0 = x0.min(first);
            x1 = x1.max(row.iter().rposition(|value| *value > 0).unwrap_or(first));
        }
    }
    Some([x0, y0, x1, y1].map(|at| at as u32))
}

impl Smoothness {
    /// Measures the longest outer border of a mask; `None` when there is none of 20 px or more.
    pub fn of(mask: &GrayImage) -> Option<Self> {
        Border::of(mask).map(|border| Self::along(&border))
    }

    /// As [`Self::of`], of a border that is known.
    pub(super) fn along(border: &Border) -> Self {
        // Turning is that of the outline, not of its pixels: smoothed by a hundredth of its length.
        let length = border.0.len() as f64;
        let smooth = border.smooth((0.012 * length).max(2.0));
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
        Self {
            turning,
            hull_ratio: length(&smooth) / length(&hull).max(1e-9),
            solidity: area(&smooth) / area(&hull).max(1e-9),
        }
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

    /// A border is followed in the part of a picture that holds the mask: also where that ends with the picture.
    #[test]
    fn borders_are_those_of_the_whole_picture() {
        for (x, y) in [(0.0, 0.0), (-70.0, 10.0), (75.0, -60.0), (-60.0, 75.0)] {
            let mask = mask(|u, v| (u - x).hypot(v - y) < 30.0);
            let whole = find_contours::<i32>(&mask)
                .into_iter()
                .filter(|c| c.border_type == BorderType::Outer)
                .max_by_key(|c| c.points.len());
            let whole: Vec<Vector2<f64>> = whole
                .into_iter()
                .flat_map(|c| c.points)
                .map(|p| Vector2::new(f64::from(p.x), f64::from(p.y)))
                .collect();
            assert_eq!(Border::of(&mask).map_or_else(Vec::new, |border| border.0), whole);
        }
    }
}
