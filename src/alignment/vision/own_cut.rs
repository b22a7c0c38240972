//! The paper's way to a pose: the picture's own cut of a thing, and where its contour's key points put it. Whether that is
//! believed is [`super::judge`]'s.

use image::GrayImage;
use nalgebra::Vector2;

use crate::alignment::evidence::Evidence;
use crate::alignment::key_points::{self, Placed};
use crate::alignment::outline::{Outline, Projector};
use crate::alignment::picture::Picture;
use crate::alignment::segment::{BORDERS, Expect, agreement, cut, inside};

/// A cut of an object, the picture's own or one that somebody else offered, and where its contour's key points put it.
pub(super) struct OwnCut {
    pub(super) mask: GrayImage,
    pub(super) placed: Result<Placed, key_points::Refused>,
    /// Whether it was cut near the fit's outline.
    pub(super) helped: bool,
}

/// How far from the fit's outline a border is looked for when the box alone does not separate, px. Chosen: 1 cm
/// in the kitchen (840 px/m), what a fit that is right to some pixels and a size that is wrong by some per cent come to
/// together. With half of it a border that is there is not within, with twice as much the neighbour's is.
const BAND_PX: f64 = 9.0;

/// Goes the paper's way: cuts the object out, and places it by its contour's key points.
///
/// The first cuts start from the box alone and share nothing else with the fit. Where they give no contour
/// of use (a thing's own pattern, a neighbour of its colour) the border is looked for near the fit's outline.
pub(super) fn own_cut(
    picture: &Picture,
    view: &Projector,
    evidence: &Evidence,
    outline: &Outline,
    bbox: [f64; 4],
) -> Option<OwnCut> {
    let boxed = |p: Vector2<f64>| {
        let inside = p.x > bbox[0] && p.y > bbox[1] && p.x < bbox[2] && p.y < bbox[3];
        match (evidence.hidden.covers(p), inside) {
            (true, _) => Expect::Ground,
            (_, true) => Expect::Inside,
            _ => Expect::Outside,
        }
    };
    let band = |p: Vector2<f64>| {
        let far = outline.depth(p);
        if far > BAND_PX || evidence.hidden.covers(p) {
            Expect::Ground
        } else if far > 0.0 {
            Expect::Outside
        } else if far > -BAND_PX {
            Expect::Inside
        } else {
            Expect::Object
        }
    };
    let mut first = None;
    for (border, helped) in [(BORDERS[0], false), (BORDERS[1], false), (BORDERS[0], true)] {
        let mask = if helped {
            cut(picture, bbox, band, border)
        } else {
            cut(picture, bbox, boxed, border)
        };
        let Some(mask) = mask else { continue };
        let placed = key_points::place(&mask, picture, view, evidence.object, &evidence.hidden);
        let done = placed.is_ok();
        let own = OwnCut { mask, placed, helped };
        if done {
            return Some(own);
        }
        first = first.or(Some(own));
    }
    first
}

/// Chooses the better of the picture's own cut and those that others offered: one whose contour gives key points before one whose
/// does not, then the one that is more the outline of a whole thing. Returns whether it is another's as well.
pub(super) fn chosen<'c>(
    picture: &Picture,
    own: Option<&'c OwnCut>,
    offered: &'c [OwnCut],
) -> Option<(&'c OwnCut, bool)> {
    // Without an offer nothing is weighed.
    if offered.is_empty() {
        return own.map(|own| (own, false));
    }
    let worth =
        |cut: &OwnCut| f64::from(u8::from(cut.placed.is_ok())) + agreement(picture, &cut.mask);
    let all = own.map(|own| (own, false)).into_iter().chain(offered.iter().map(|cut| (cut, true)));
    let mut all = all.map(|(cut, is_other)| (cut, is_other, worth(cut)));
    let first = all.next()?;
    let best = all.fold(first, |best, next| if next.2 > best.2 { next } else { best });
    Some((best.0, best.1))
}

/// Places an object by the contour of masks that others offered, without what is known to cover it.
pub(super) fn offered_cuts(
    picture: &Picture,
    view: &Projector,
    evidence: &Evidence,
    masks: &[GrayImage],
) -> Vec<OwnCut> {
    let place = |mask: &GrayImage| {
        let mut mask = inside(mask);
        for (x, y, pixel) in mask.enumerate_pixels_mut() {
            if evidence.hidden.covers(Vector2::new(f64::from(x), f64::from(y))) {
                pixel.0[0] = 0;
            }
        }
        let placed = key_points::place(&mask, picture, view, evidence.object, &evidence.hidden);
        OwnCut { mask, placed, helped: false }
    };
    masks.iter().map(place).collect()
}

/// Returns the overlap of two masks: what both have over what either has.
pub(super) fn overlap(one: &GrayImage, other: &GrayImage) -> f64 {
    let (mut both, mut either) = (0_usize, 0_usize);
    let w = one.width().max(1) as usize;
    for (one, other) in one.as_raw().chunks(w).zip(other.as_raw().chunks(w)) {
        let (mut in_both, mut in_either) = (0_u32, 0_u32);
        for (a, b) in one.iter().zip(other) {
            in_both += u32::from(*a > 0 && *b > 0);
            in_either += u32::from(*a > 0 || *b > 0);
        }
        both += in_both as usize;
        either += in_either as usize;
    }
    both as f64 / f64::max(either as f64, 1.0)
}
