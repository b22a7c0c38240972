//! Everything that stands out in a picture, cut out without anybody pointing: boxes are proposed, and each is a prompt.
//!
//! A place is no background where its colour is not that of a smooth surface through the picture, or where there is an
//! edge. Pieces of that, joined over gaps of several widths, are the boxes; [`super::prompt`] cuts each, and the referee's
//! word decides between cuts that overlap. What fills the picture or is a speck is nothing that stands on a table.

use image::{GrayImage, Luma};
use imageproc::distance_transform::Norm;
use imageproc::morphology;
use imageproc::region_labelling::{Connectivity, connected_components};
use nalgebra::Vector2;

use super::TableModel;
use super::prompt::{Prompt, Segment, segment};
use crate::alignment::picture::{Picture, QUARTER};

/// How little like the background a place must look: a half is three of its spreads ([`TableModel::change`]); a quarter
/// and three quarters beside it, since glass changes little and wood much.
const CHANGES: [f32; 3] = [0.25, 0.5, 0.75];
/// Gradients from which a place is an edge, CIELAB/px of the quarter picture: where edges of clear and of opaque things
/// count in full ([`crate::alignment::placement`]), since a picture of a quarter has the steps of the full one.
const EDGES: [f64; 2] = [0.9, 2.4];
/// Gaps that are joined, px of the quarter picture: none to speak of, a highlight's, and the middle of a glass.
const GAPS: [u8; 3] = [1, 3, 7];
/// Least and largest share of the picture's sides that a box has. Chosen: a cup two metres away has a twentieth; what has
/// more than three quarters is what things stand on or before.
const SHARE: [f64; 2] = [0.04, 0.75];
/// How much larger a box becomes than the piece in it, on each side as a share: as one that is drawn by hand.
const ROOM: f64 = 0.15;
/// Overlap of two boxes above which they are one, and of two cuts. Chosen: at 0.8 a box is 6 % larger on each side, less
/// than its room; of two cuts that share more than half of either one is a part or a union of the other.
const SAME: [f64; 2] = [0.8, 0.5];
/// Boxes that are cut at most, the most promising first: some ten seconds of a picture of a megapixel on two cores; each is twelve cuts.
const CUT_AT_MOST: usize = 24;
/// What the referee must say of a cut to be told. Chosen: half of the outline on an edge and all else right, or all of it
/// and a fifth of the form missing twice over.
pub(super) const TOLD: f64 = 0.5;

/// Cuts out everything that stands out, what is most surely whole first.
pub fn everything(picture: &Picture) -> Vec<Segment> {
    let mut boxes: Vec<([f64; 4], f64)> = Vec::new();
    for mask in outstanding(picture) {
        for gap in GAPS {
            for (found, share) in pieces(picture, &morphology::close(&mask, Norm::L2, gap)) {
                if !boxes.iter().any(|(other, _)| box_overlap(*other, found) > SAME[0]) {
                    boxes.push((found, share));
                }
            }
        }
    }
    // What fills its box is a thing rather than a line that runs through the picture.
    boxes.sort_by(|a, b| b.1.total_cmp(&a.1));
    let cuts = boxes
        .into_iter()
        .take(CUT_AT_MOST)
        .filter_map(|(bounds, _)| segment(picture, &Prompt::Box(bounds)))
        .filter(|cut| cut.agreement > TOLD)
        .collect();
    apart(cuts)
}

/// Keeps of cuts that overlap the one that agrees most; what is most surely whole comes first.
pub(super) fn apart(mut cuts: Vec<Segment>) -> Vec<Segment> {
    cuts.sort_by(|a, b| b.agreement.total_cmp(&a.agreement));
    let mut told: Vec<Segment> = Vec::new();
    for cut in cuts {
        if told.iter().all(|other| shared(&cut.mask, &other.mask) < SAME[1]) {
            told.push(cut);
        }
    }
    told
}

/// Where the picture is not background, by each measure of it; of the quarter size.
fn outstanding(picture: &Picture) -> Vec<GrayImage> {
    let (w, h) = (picture.small[0].width, picture.small[0].height);
    let mut all = Vec::new();
    if let Some(background) = TableModel::fit_where(picture, |_| true) {
        let change = background.change(picture);
        for least in CHANGES {
            all.push(GrayImage::from_fn(w as u32, h as u32, |x, y| {
                Luma([if change.data[y as usize * w + x as usize] > least { 255 } else { 0 }])
            }));
        }
    }
    let level = &picture.levels[2];
    let across = [Vector2::x(), Vector2::y()];
    for least in EDGES {
        all.push(GrayImage::from_fn(w as u32, h as u32, |x, y| {
            let [u, v] = [x, y].map(|at| QUARTER * f64::from(at) + 0.5 * (QUARTER - 1.0));
            let edge = across.map(|way| level.edge(u, v, way));
            Luma([if edge[0].max(edge[1]) > least { 255 } else { 0 }])
        }));
    }
    all
}

/// The boxes of a mask's pieces, px of the full picture, with the share of each that its piece fills.
fn pieces(picture: &Picture, mask: &GrayImage) -> Vec<([f64; 4], f64)> {
    let (w, h) = (picture.size().0 as f64, picture.size().1 as f64);
    let labels = connected_components(mask, Connectivity::Eight, Luma([0]));
    let count = labels.pixels().map(|label| label.0[0]).max().unwrap_or(0) as usize;
    let none = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    let mut held = vec![(none, 0.0); count + 1];
    for (x, y, label) in labels.enumerate_pixels() {
        let (bounds, area) = &mut held[label.0[0] as usize];
        let (x, y) = (f64::from(x), f64::from(y));
        *bounds = [bounds[0].min(x), bounds[1].min(y), bounds[2].max(x), bounds[3].max(y)];
        *area += 1.0;
    }
    held.into_iter()
        .skip(1)
        .filter_map(|(b, area)| {
            let (bw, bh) = (b[2] - b[0] + 1.0, b[3] - b[1] + 1.0);
            let share = [QUARTER * bw / w, QUARTER * bh / h];
            let is_thing = share.iter().all(|s| (SHARE[0]..SHARE[1]).contains(s));
            let [du, dv] = [ROOM * QUARTER * bw, ROOM * QUARTER * bh];
            let bounds = [
                (QUARTER * b[0] - du).max(0.0),
                (QUARTER * b[1] - dv).max(0.0),
                (QUARTER * (b[2] + 1.0) + du).min(w - 1.0),
                (QUARTER * (b[3] + 1.0) + dv).min(h - 1.0),
            ];
            is_thing.then_some((bounds, area / (bw * bh)))
        })
        .collect()
}

/// What two boxes share over what either has.
fn box_overlap(a: [f64; 4], b: [f64; 4]) -> f64 {
    let area = |c: [f64; 4]| (c[2] - c[0]).max(0.0) * (c[3] - c[1]).max(0.0);
    let both = area([a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])]);
    both / (area(a) + area(b) - both).max(1.0)
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
