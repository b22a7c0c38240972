//! The referee of masks: how much an outline is that of a whole thing, by the picture's edges and by its own form. It knows
//! nothing of colours, by which masks are cut, so that it is a second opinion. Masks are the caller's.

use image::GrayImage;
use nalgebra::Vector2;

use crate::alignment::contour::{Border, Smoothness};
use crate::alignment::picture::Picture;

/// Gradient at which an edge counts in full, CIELAB/px: between those of clear and of opaque things (0.9 and 2.4) of
/// [`crate::alignment::placement`], since nobody says which it is. At half of it grain is an edge, at twice it glass has
/// none.
pub(super) const FULL_EDGE: f64 = 1.5;
/// That gradient in units of the picture's noise at least: as for the smaller pictures of [`crate::alignment::placement`].
pub(super) const NOISE_EDGE: f64 = 0.5;
/// How far across the outline its edge is looked for, px: a mask is smoothed by 2 px, and its border lies between pixels.
pub(super) const ACROSS_PX: i32 = 3;
/// Points of the border to each side that give its direction: as far as [`ACROSS_PX`], so that a step of pixels is no turn.
const ALONG: usize = 3;
/// Smoothing of the border along itself, px: the stairs of pixels, as in [`Smoothness`].
const SMOOTH_PX: f64 = 2.0;
/// Border points within this share of the box's shorter side of it, and so many px at least, touch it. Chosen: a hundredth
/// on each side is the border's own width; with 5 % a thing in a tight box would touch it.
const TOUCH: (f64, f64) = (0.02, 2.0);
/// Share of a box's side that a thing fills at least: a loose box is a sixth too large on each side, which leaves three
/// quarters; a fifth less is a part of the thing. In a box of our own around a point it may be smaller, as the boxes grow
/// by 1.6 from one to the next.
const FILLS: [f64; 2] = [0.6, 0.3];

/// What the referee says of a mask.
pub(super) struct Judged {
    /// All together, 0 to 1.
    pub(super) total: f64,
    /// How well the outline runs along the picture's edges, 0 to 1.
    pub(super) edge: f64,
    /// Whether it is the outline of a solid.
    pub(super) is_smooth: bool,
    /// The outer border, px.
    pub(super) contour: Vec<[f64; 2]>,
}

/// Judges a mask in a box `[u0, v0, u1, v1]`, px; `is_own` when nobody gave that box. Its edges
/// are looked for so many px across.
pub(super) fn judge(
    picture: &Picture,
    mask: &GrayImage,
    bounds: [f64; 4],
    is_own: bool,
    across: i32,
) -> Option<Judged> {
    let outer = Border::of(mask)?;
    let border = outer.smooth(SMOOTH_PX);
    let n = border.len();
    let [u0, v0, u1, v1] = bounds;
    let edge = along(picture, &border, across);
    let (w, h) = (f64::from(mask.width()), f64::from(mask.height()));
    let room = (TOUCH.0 * (u1 - u0).min(v1 - v0)).max(TOUCH.1);
    // A thing may go on beyond the picture, not beyond its box.
    let is_at_box = |p: &&Vector2<f64>| {
        (p.x - u0 < room && u0 > 1.0)
            || (p.y - v0 < room && v0 > 1.0)
            || (u1 - p.x < room && u1 < w - 2.0)
            || (v1 - p.y < room && v1 < h - 2.0)
    };
    let touching = border.iter().filter(is_at_box).count() as f64 / n as f64;
    let low = border.iter().fold(border[0], |a, p| a.inf(p));
    let high = border.iter().fold(border[0], |a, p| a.sup(p));
    let fills = ((high.x - low.x) / (u1 - u0)).min((high.y - low.y) / (v1 - v0));
    let fills = (fills / FILLS[usize::from(is_own)]).min(1.0);
    let smooth = Smoothness::along(&outer);
    let total = edge * smooth.solidity * fills.powi(2) * (1.0 - touching).powi(2);
    let contour = border.iter().map(|p| [p.x, p.y]).collect();
    Some(Judged { total, edge, is_smooth: smooth.is_smooth(), contour })
}

/// The mean over the border of the strongest edge that runs along it there, 0 to 1.
fn along(picture: &Picture, border: &[Vector2<f64>], across: i32) -> f64 {
    let full = FULL_EDGE.max(picture.noise * NOISE_EDGE);
    let found = strengths(picture, border, across);
    let (mut sum, mut count) = (0.0, 0.0);
    for strength in found.into_iter().flatten() {
        sum += (strength / full).min(1.0);
        count += 1.0;
    }
    sum / f64::max(count, 1.0)
}

/// The strongest edge along a border at each of its points, CIELAB/px; `None` where it has no direction.
fn strengths(picture: &Picture, border: &[Vector2<f64>], across: i32) -> Vec<Option<f64>> {
    let n = border.len();
    let level = &picture.levels[0];
    let each = border.iter().enumerate().map(|(i, p)| {
        let step = border[(i + ALONG) % n] - border[(i + n - ALONG) % n];
        let step = step.try_normalize(1e-9)?;
        let normal = Vector2::new(step.y, -step.x);
        let beside = (-across..=across).map(|k| p + f64::from(k) * normal);
        Some(beside.map(|at| level.edge(at.x, at.y, normal)).fold(0.0, f64::max))
    });
    each.collect()
}

/// The strongest edge along a contour that was judged, at each of its points, CIELAB/px.
pub(super) fn edges_along(picture: &Picture, contour: &[[f64; 2]], across: i32) -> Vec<f64> {
    let border: Vec<Vector2<f64>> = contour.iter().map(|p| Vector2::from(*p)).collect();
    strengths(picture, &border, across).into_iter().map(Option::unwrap_or_default).collect()
}
