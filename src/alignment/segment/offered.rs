//! Masks that others made, beside our own: the same referee judges both, and the better one is taken.
//!
//! A mask is judged as it came, and once more with its border moved onto the edge beside it, as our own are. What its maker thinks
//! of it is told and decides nothing: makers are sure of different things.

use image::GrayImage;

use super::everything::{TOLD, apart, roomy};
use super::prompt::{By, Prompt, Segment, extent};
use super::referee::{self, Judged};
use super::snap::snapped;
use crate::alignment::picture::Picture;

/// Judges a mask of somebody else's; `score` is what its maker thinks of it. `None` of an empty one, and of one without an outline.
pub fn offered(
    picture: &Picture,
    mask: &GrayImage,
    score: f64,
    prompt: Option<&Prompt>,
) -> Option<Segment> {
    let bounds = match prompt {
        Some(Prompt::Box(bounds)) => *bounds,
        _ => around(picture, mask)?,
    };
    let is_own = !matches!(prompt, Some(Prompt::Box(_)));
    let judged = |mask: GrayImage| {
        let Judged { total, edge, is_smooth, contour } =
            referee::judge(picture, &mask, bounds, is_own, referee::ACROSS_PX)?;
        Some(Segment {
            mask,
            contour,
            bounds,
            edge,
            agreement: total,
            is_smooth,
            by: By::Other { score },
        })
    };
    let mask = inside(mask);
    let (as_it_is, moved) = (judged(mask.clone()), judged(snapped(picture, mask)));
    as_it_is.into_iter().chain(moved).reduce(better)
}

/// A mask without the picture's outermost pixels: an outline is one that closes within the picture.
pub(in crate::alignment) fn inside(mask: &GrayImage) -> GrayImage {
    let mut mask = mask.clone();
    let (w, h) = mask.dimensions();
    for (x, y, pixel) in mask.enumerate_pixels_mut() {
        if x == 0 || y == 0 || x + 1 == w || y + 1 == h {
            pixel.0[0] = 0;
        }
    }
    mask
}

/// How much a mask is that of a whole thing, 0 to 1, in a box around it; 0 of one that is none.
pub(in crate::alignment) fn agreement(picture: &Picture, mask: &GrayImage) -> f64 {
    let bounds = around(picture, mask);
    bounds
        .and_then(|b| referee::judge(picture, mask, b, true, referee::ACROSS_PX))
        .map_or(0.0, |judged| judged.total)
}

/// Chooses between cuts of one thing, or keeps of many those that do not overlap, the best of each.
pub fn best(cuts: Vec<Segment>, is_one: bool) -> Vec<Segment> {
    if is_one {
        return cuts.into_iter().reduce(better).into_iter().collect();
    }
    apart(cuts.into_iter().filter(|cut| cut.agreement > TOLD).collect())
}

/// The one that agrees more; the first of two alike.
fn better(one: Segment, other: Segment) -> Segment {
    if other.agreement > one.agreement { other } else { one }
}

/// The box of a mask with some room, px.
fn around(picture: &Picture, mask: &GrayImage) -> Option<[f64; 4]> {
    extent(mask).map(|(held, _)| roomy(picture, held))
}
