//! Everything that stands out in a picture, cut out without anybody pointing: boxes are proposed by what edges end in
//! them ([`super::strokes`]), each is glanced at in a picture of a quarter of the size, and what looks whole is cut as with a
//! box that a person drew.
//!
//! A bottle's neck has an outline too, and so have two bottles that stand close: of cuts that overlap those are kept that
//! have the most outline together. What fills the picture or is a speck is nothing that stands on a table.

use image::GrayImage;
use rayon::prelude::*;

use super::chosen::{Ranks, Rated, chosen};
use super::prompt::{Prompt, Segment, glance, segment};
use super::strokes::boxes;
use crate::alignment::picture::{Picture, QUARTER};

/// Least and largest share of the picture's sides that a box has. Chosen: a cup two metres away has a twentieth; what has
/// more than three quarters is what things stand on or before.
const SHARE: [f64; 2] = [0.04, 0.75];
/// How much larger a box becomes than what is in it, on each side as a share: as one that is drawn by hand.
const ROOM: f64 = 0.15;
/// Overlap of two boxes above which they are one. Chosen: at 0.7 a box is a tenth larger on each side, less than its room.
const SAME: f64 = 0.7;
/// Share of the smaller of two cuts from which they are not both told: things that stand side by side share no pixel, and
/// a fifth is more than two borders are off by. On the five samples of `ClearGrasp` 0.1 and 0.3 find as many of the labelled things.
pub(super) const SHARED: f64 = 0.2;
/// Power of its agreement that a cut's side counts with: one that agrees by 0.95 is worth as much as one twice as large
/// that agrees by 0.9. On the same samples 8 and 20 find as many.
const SURE: i32 = 12;
/// Boxes that are glanced at, the most promising first. Chosen: faint things came up to the 260th.
const GLANCES: usize = 300;
/// What the referee must say of a glance for a second look: a little more than of a cut, as small pictures have firmer
/// edges.
const PROMISING: f64 = 0.6;
/// What the referee must say of a cut to be told. Chosen: half of the outline on an edge and all else right, or all of it
/// and a fifth of the form missing twice over.
pub(super) const TOLD: f64 = 0.5;

/// Cuts out everything that stands out, what is most surely whole first.
pub fn everything(picture: &Picture) -> Vec<Segment> {
    let small = picture.quartered();
    let ranks = Ranks::new(&small);
    let glances: Vec<Rated> = boxes(&small, SHARE, SAME, GLANCES)
        .into_par_iter()
        .filter_map(|bounds| glance(&small, roomy(&small, bounds), &ranks))
        .filter(|rated| rated.sure() > PROMISING)
        .collect();
    let cuts = chosen(glances)
        .into_par_iter()
        .filter_map(|cut| {
            let [u0, v0, u1, v1] = cut.extent().0;
            let held = [u0, v0, u1 + 1.0, v1 + 1.0].map(|at| QUARTER * at);
            segment(picture, &Prompt::Box(roomy(picture, held)))
        })
        .filter(|cut| cut.agreement > TOLD)
        .collect();
    apart(cuts)
}

/// Keeps of cuts that overlap those that have the most outline together, each as much as it agrees; what is most surely whole
/// comes first.
pub(super) fn apart(cuts: Vec<Segment>) -> Vec<Segment> {
    let mut sized: Vec<(f64, Segment)> =
        cuts.into_iter().map(|cut| ((cut.extent().1 as f64).sqrt(), cut)).collect();
    // From the smallest on, so that parts and their whole are weighed once all the parts are there.
    sized.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut told: Vec<(f64, Segment)> = Vec::new();
    for (side, cut) in sized {
        let worth = side * cut.agreement.powi(SURE);
        let meets: Vec<bool> =
            told.iter().map(|(_, other)| shared(&cut.mask, &other.mask) >= SHARED).collect();
        let against: f64 = told.iter().zip(&meets).filter(|(_, m)| **m).map(|(t, _)| t.0).sum();
        if worth > against {
            let mut meets = meets.into_iter();
            told.retain(|_| !meets.next().unwrap_or(false));
            told.push((worth, cut));
        }
    }
    told.sort_by(|a, b| b.1.agreement.total_cmp(&a.1.agreement));
    told.into_iter().map(|(_, cut)| cut).collect()
}

/// A box with some room, within the picture.
pub(super) fn roomy(picture: &Picture, [u0, v0, u1, v1]: [f64; 4]) -> [f64; 4] {
    let (w, h) = (picture.size().0 as f64, picture.size().1 as f64);
    let (du, dv) = (ROOM * (u1 - u0 + 1.0), ROOM * (v1 - v0 + 1.0));
    [(u0 - du).max(0.0), (v0 - dv).max(0.0), (u1 + du).min(w - 1.0), (v1 + dv).min(h - 1.0)]
}

/// What two masks share over what the smaller one has.
fn shared(a: &GrayImage, b: &GrayImage) -> f64 {
    let (mut both, mut one, mut other) = (0.0, 0.0, 0.0);
    for (p, q) in a.pixels().zip(b.pixels()) {
        let (p, q) = (p.0[0] > 0, q.0[0] > 0);
        both += f64::from(u8::from(p && q));
        one += f64::from(u8::from(p));
        other += f64::from(u8::from(q));
    }
    both / f64::max(f64::min(one, other), 1.0)
}
