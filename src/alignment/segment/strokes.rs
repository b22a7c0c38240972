//! Boxes that hold something whole, by the picture's edges alone: a thing's edges end within its box, those of what it
//! stands on and of its neighbours run across. Clear things have edges too, however little they differ in colour.
//!
//! Edges are thinned and followed into strokes that turn by no more than a right angle. A box is worth the strokes that
//! are wholly in it, less those in its middle, over its sides. What is in a box is not asked here.
//!
//! Source: Zitnick and Dollár, "Edge Boxes: Locating object proposals from edges", ECCV 2014, without the affinities
//! between strokes, and over the sides themselves, where the source's power of 1.5 puts small boxes before glasses.

use std::f64::consts::{FRAC_PI_2, PI};

use rayon::prelude::*;

use crate::alignment::picture::{Picture, median};

/// Gradient at which an edge counts in full, CIELAB/px: that of clear things
/// ([`crate::alignment::placement`]), so that they count as much as opaque ones.
const FULL_EDGE: f64 = 0.9;
/// Share of that from which there is an edge at all, and how many times the commonest gradient of the picture it must be,
/// which is the grain of what things stand on.
const LEAST: (f64, f64) = (0.3, 3.0);
/// Overlap of one box that is tried with the next: as in the source.
const NEXT: f64 = 0.65;
/// The longest box that is tried, as its longer side over the shorter: as in the source.
const LONGEST: f64 = 3.0;

/// A piece of edge: the box of its pixels, `[x0, y0, x1, y1]` px, and how much edge it is.
struct Stroke {
    held: [f64; 4],
    edge: f64,
}

/// Boxes between two shares of the picture's sides, px, tight around their strokes: the `most` that are worth most, of those
/// that overlap more than `same` the best.
pub(super) fn boxes(picture: &Picture, share: [f64; 2], same: f64, most: usize) -> Vec<[f64; 4]> {
    let strokes = strokes(picture);
    let (w, h) = (picture.lab[0].width as f64, picture.lab[0].height as f64);
    let grow = (1.0 / NEXT).sqrt();
    let lean = (1.0 + NEXT) / (2.0 * NEXT);
    let step = (1.0 - NEXT) / (1.0 + NEXT);
    let mut tried: Vec<[f64; 4]> = Vec::new();
    let leans = (LONGEST.ln() / (2.0 * lean.ln())).floor() as i32;
    let mut side = share[0] * w.min(h);
    while side < share[1] * w.max(h) {
        for k in -leans..=leans {
            let (bw, bh) = (side * lean.powi(k), side * lean.powi(-k));
            let fits = |b: f64, whole: f64| (share[0] * whole..share[1] * whole).contains(&b);
            if !fits(bw, w) || !fits(bh, h) {
                continue;
            }
            let places = |whole: f64, b: f64| -> Vec<f64> {
                let n = ((whole - b) / (step * b)).ceil().max(1.0);
                (0..=n as usize).map(|i| (whole - b) * i as f64 / n).collect()
            };
            for y in places(h, bh) {
                tried.extend(places(w, bw).into_iter().map(|x| [x, y, x + bw, y + bh]));
            }
        }
        side *= grow;
    }
    let mut found: Vec<([f64; 4], f64)> =
        tried.into_par_iter().filter_map(|at| worth(&strokes, at)).collect();
    found.retain(|(b, _)| {
        let sides = [(b[2] - b[0] + 1.0) / w, (b[3] - b[1] + 1.0) / h];
        sides.iter().all(|s| (share[0]..share[1]).contains(s))
    });
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut kept: Vec<[f64; 4]> = Vec::new();
    for (at, _) in found {
        if kept.len() < most && kept.iter().all(|other| overlap(*other, at) < same) {
            kept.push(at);
        }
    }
    kept
}

/// Shrinks a box to the strokes that are wholly in it, and says what it is worth then.
fn worth(strokes: &[Stroke], at: [f64; 4]) -> Option<([f64; 4], f64)> {
    let is_in = |stroke: &Stroke, b: &[f64; 4]| {
        let held = &stroke.held;
        held[0] >= b[0] && held[1] >= b[1] && held[2] <= b[2] && held[3] <= b[3]
    };
    let mut tight = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    let mut edge = 0.0;
    for stroke in strokes.iter().filter(|stroke| is_in(stroke, &at)) {
        let held = &stroke.held;
        tight = [
            tight[0].min(held[0]),
            tight[1].min(held[1]),
            tight[2].max(held[2]),
            tight[3].max(held[3]),
        ];
        edge += stroke.edge;
    }
    let (bw, bh) = (tight[2] - tight[0] + 1.0, tight[3] - tight[1] + 1.0);
    if edge == 0.0 || bw.max(bh) > LONGEST * bw.min(bh) {
        return None;
    }
    let middle =
        [tight[0] + bw / 4.0, tight[1] + bh / 4.0, tight[2] - bw / 4.0, tight[3] - bh / 4.0];
    let inner: f64 = strokes.iter().filter(|s| is_in(s, &middle)).map(|s| s.edge).sum();
    Some((tight, (edge - inner) / (bw + bh)))
}

/// Follows the thinned edges of a picture.
fn strokes(picture: &Picture) -> Vec<Stroke> {
    let (w, h) = (picture.lab[0].width, picture.lab[0].height);
    let level = &picture.levels[0];
    let edges: Vec<(f64, f64)> = (0..w * h).map(|i| level.strongest(i % w, i / w)).collect();
    let mut all: Vec<f64> = edges.iter().map(|edge| edge.0).collect();
    let common = median(&mut all);
    let least = (LEAST.0 * FULL_EDGE).max(LEAST.1 * common);
    let full = FULL_EDGE.max(least);
    // Across an edge its pixel is the strongest of three.
    let mut open: Vec<bool> = (0..w * h)
        .map(|i| {
            let (x, y) = (i % w, i / w);
            let (strength, angle) = edges[i];
            if strength < least || x == 0 || y == 0 || x + 1 == w || y + 1 == h {
                return false;
            }
            let by = (angle.sin().round() * w as f64 + angle.cos().round()) as isize;
            let beside = |by: isize| edges[i.wrapping_add_signed(by)].0;
            strength >= beside(by) && strength > beside(-by)
        })
        .collect();
    let mut found = Vec::new();
    for start in 0..w * h {
        if !open[start] {
            continue;
        }
        let (mut at, mut turned) = (start, 0.0);
        let mut stroke = Stroke { held: [w as f64, h as f64, 0.0, 0.0], edge: 0.0 };
        loop {
            open[at] = false;
            let (x, y) = ((at % w) as f64, (at / w) as f64);
            let held = stroke.held;
            stroke.held = [held[0].min(x), held[1].min(y), held[2].max(x), held[3].max(y)];
            stroke.edge += (edges[at].0 / full).min(1.0);
            let turn = |to: usize| {
                let by = (edges[to].1 - edges[at].1).abs();
                by.min(PI - by)
            };
            let next =
                [at - w - 1, at - w, at - w + 1, at - 1, at + 1, at + w - 1, at + w, at + w + 1]
                    .into_iter()
                    .filter(|to| open[*to])
                    .min_by(|a, b| turn(*a).total_cmp(&turn(*b)));
            let Some(next) = next else { break };
            turned += turn(next);
            if turned > FRAC_PI_2 {
                break;
            }
            at = next;
        }
        found.push(stroke);
    }
    found
}

/// What two boxes share over what either has.
fn overlap(a: [f64; 4], b: [f64; 4]) -> f64 {
    let area = |c: [f64; 4]| (c[2] - c[0] + 1.0).max(0.0) * (c[3] - c[1] + 1.0).max(0.0);
    let both = area([a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])]);
    both / (area(a) + area(b) - both).max(1.0)
}

#[cfg(test)]
mod tests {
    use image::{Rgb, RgbImage};

    use super::*;

    /// A wall meets a table, and a block stands before the line; the line runs on, so no box is around a part of it alone.
    #[test]
    fn what_edges_end_in_is_boxed_and_what_they_run_through_is_not() {
        let block = [60, 50, 100, 110];
        let image = RgbImage::from_fn(160, 160, |x, y| {
            let is_in = (block[0]..block[2]).contains(&x) && (block[1]..block[3]).contains(&y);
            Rgb([if is_in {
                60
            } else if y < 80 {
                200
            } else {
                150
            }; 3])
        });
        let found = boxes(&Picture::new(&image), [0.04, 0.75], 0.7, 3);
        let off = |b: &[f64; 4]| {
            let sides = b.iter().zip(block).map(|(a, b)| (a - f64::from(b)).abs());
            sides.fold(0.0, f64::max)
        };
        assert!(off(&found[0]) < 3.0, "{found:?}");
    }

    #[test]
    fn an_even_picture_has_no_boxes() {
        for (w, h) in [(1, 1), (2, 40), (64, 64)] {
            let even = Picture::new(&RgbImage::from_pixel(w, h, Rgb([120; 3])));
            assert!(boxes(&even, [0.04, 0.75], 0.7, 10).is_empty(), "{w} x {h}");
        }
    }
}
