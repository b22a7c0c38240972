//! A mask's border moved onto the picture's edge beside it. Cells are some pixels wide and a cut is kind to those on the
//! border, so that masks come out a pixel or two too large: a disc of 45 px had 46.5. What the mask is of is the caller's.

use image::{GrayImage, Luma};
use nalgebra::Vector2;

use crate::alignment::contour::Border;
use crate::alignment::picture::{Picture, median};

/// How far an edge is looked for across the border, px: as far as the referee does, which is what a cut may be off.
const ACROSS_PX: i32 = 3;
/// Points of the border to each side whose edges are asked together: 17 px, twice the smoothing of a mask to each side, so
/// that one highlight does not pull the border and a corner is not cut off.
const BESIDE: usize = 8;
/// Smoothing of the border along itself, px, as in the referee.
const SMOOTH_PX: f64 = 2.0;
/// Share of the strongest edge of all from which an edge says where the border is. Chosen: weaker ones are grain.
const SPEAKS: f64 = 0.1;

/// Moves the outer border of a mask to the strongest edge within some pixels; the mask as it is where there is none.
pub(super) fn snapped(picture: &Picture, mask: GrayImage) -> GrayImage {
    let Some(border) = Border::of(&mask) else { return mask };
    let border = border.smooth(SMOOTH_PX);
    let n = border.len();
    let across: Vec<Vector2<f64>> = (0..n)
        .map(|i| {
            let step =
                border[(i + ACROSS_PX as usize) % n] - border[(i + n - ACROSS_PX as usize) % n];
            let step = step.try_normalize(1e-9).unwrap_or_else(Vector2::zeros);
            Vector2::new(step.y, -step.x)
        })
        .collect();
    let level = &picture.levels[0];
    let found: Vec<(f64, f64)> = border
        .iter()
        .zip(&across)
        .map(|(p, normal)| {
            (-ACROSS_PX..=ACROSS_PX)
                .map(|k| {
                    let at = p + f64::from(k) * normal;
                    (f64::from(k), level.edge(at.x, at.y, *normal))
                })
                .fold((0.0, 0.0), |best, next| if next.1 > best.1 { next } else { best })
        })
        .collect();
    let least = SPEAKS * found.iter().map(|f| f.1).fold(0.0, f64::max);
    let moved: Vec<Vector2<f64>> = (0..n)
        .map(|i| {
            let beside = (0..=2 * BESIDE).map(|k| found[(i + n + k - BESIDE) % n]);
            let mut offsets: Vec<f64> =
                beside.filter(|(_, strength)| *strength > least).map(|f| f.0).collect();
            let by = if offsets.is_empty() { 0.0 } else { median(&mut offsets) };
            border[i] + by * across[i]
        })
        .collect();
    filled(&moved, mask.dimensions())
}

/// Fills a closed line: a pixel is inside when its middle is, by the even-odd rule along its row.
pub(super) fn filled(closed: &[Vector2<f64>], (w, h): (u32, u32)) -> GrayImage {
    let mut mask = GrayImage::new(w, h);
    for y in 0..h {
        let v = f64::from(y);
        let mut crossings: Vec<f64> = Vec::new();
        for (i, a) in closed.iter().enumerate() {
            let b = closed[(i + 1) % closed.len()];
            if (a.y > v) != (b.y > v) {
                crossings.push(a.x + (v - a.y) / (b.y - a.y) * (b.x - a.x));
            }
        }
        crossings.sort_by(f64::total_cmp);
        for pair in crossings.chunks_exact(2) {
            let from = pair[0].ceil().max(0.0) as u32;
            let to = pair[1].floor().min(f64::from(w) - 1.0);
            if to >= f64::from(from) {
                (from..=to as u32).for_each(|x| mask.put_pixel(x, y, Luma([255])));
            }
        }
    }
    mask
}
