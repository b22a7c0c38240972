//! A thing cut out of a picture from a box around it or a point on it, without a scene, a camera or a pose.
//!
//! The cut is that of [`super`], on a coarser grid and several times: a border is cheap or dear, and the middle of the
//! box is more or less expected to be the thing. Glass needs another of these than a printed box does, so each is tried,
//! and a referee that knows nothing of colours chooses: the mask whose outline runs along the picture's edges, is whole,
//! and fills the box without touching it. A box is loose: it holds the thing and some of what is around it.
//!
//! Source: Rother, Kolmogorov and Blake, "`GrabCut`", SIGGRAPH 2004.

use image::{GrayImage, Luma};
use nalgebra::Vector2;
use rayon::prelude::*;

use super::flow::Flow;
use super::palette::Palette;
use super::tidy;
use crate::alignment::contour::{Smoothness, outer_border};
use crate::alignment::picture::{Picture, Plane, median};

/// What a person says of where the thing is, px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prompt {
    /// Inside this box `[u0, v0, u1, v1]`, with some room.
    Box([f64; 4]),
    /// At this place `[u, v]`.
    Point([f64; 2]),
}

/// A thing cut out.
#[derive(Debug, Clone)]
pub struct Segment {
    /// 255 where the thing is; the picture's size.
    pub mask: GrayImage,
    /// Its outer border, px, in order, closed.
    pub contour: Vec<[f64; 2]>,
    /// The box it was looked for in, `[u0, v0, u1, v1]`, px.
    pub bounds: [f64; 4],
    /// How well the outline runs along the picture's edges, 0 to 1.
    pub edge: f64,
    /// Whether its outline is that of a solid: no bites, spurs or ragged parts.
    pub is_smooth: bool,
}

/// Cells of the grid along the longer side of the box. Chosen: a bottle's neck is some five of them; with half as many
/// it is lost, with twice as many a cut takes ten times as long.
const CELLS: f64 = 80.0;
/// How far around the box colours of what is not the thing are learnt, as a share of its sides.
const AROUND: f64 = 0.25;
/// Prices of a border between cells of one colour, in units of log-likelihood.
const BORDERS: [f64; 4] = [4.0, 10.0, 25.0, 50.0];
/// How much the middle of the box is expected to be the thing, in units of log-likelihood.
const EXPECTED: [f64; 3] = [0.0, 1.5, 4.0];
/// Rounds of learning colours and cutting.
const ROUNDS: usize = 4;
/// Sides, px, of the boxes that are tried around a point, as shares of the picture's shorter side.
const SIDES: [f64; 5] = [0.1, 0.17, 0.28, 0.45, 0.7];

/// A box, px, and a place in it that is the thing's, if one is known.
type Place = ([f64; 4], Option<Vector2<f64>>);

/// Cuts a thing out; `None` when nothing separates there.
pub fn segment(picture: &Picture, prompt: Prompt) -> Option<Segment> {
    let (w, h) = (picture.size().0 as f64, picture.size().1 as f64);
    let boxes: Vec<Place> = match prompt {
        Prompt::Box(b) => vec![(b, None)],
        Prompt::Point([u, v]) => SIDES
            .iter()
            .map(|side| 0.5 * side * w.min(h))
            .map(|half| ([u - half, v - half, u + half, v + half], Some(Vector2::new(u, v))))
            .collect(),
    };
    let tried: Vec<(Place, f64, f64)> = boxes
        .into_iter()
        .map(|(b, on)| ([b[0].max(0.0), b[1].max(0.0), b[2].min(w - 1.0), b[3].min(h - 1.0)], on))
        .flat_map(|(b, on)| {
            BORDERS
                .iter()
                .flat_map(move |&border| EXPECTED.iter().map(move |&e| ((b, on), border, e)))
        })
        .collect();
    let best = tried
        .into_par_iter()
        .filter_map(|((bounds, on), border, expected)| {
            let mask = Grid::new(picture, bounds, on)?.cut(border, expected)?;
            let judged = judge(picture, &mask, bounds, on)?;
            Some((judged, mask, bounds))
        })
        .max_by(|a, b| a.0.total.total_cmp(&b.0.total))?;
    let (judged, mask, bounds) = best;
    Some(Segment {
        contour: judged.contour,
        edge: judged.edge,
        is_smooth: judged.is_smooth,
        mask,
        bounds,
    })
}

/// The cells of a box and of what is around it.
struct Grid<'a> {
    picture: &'a Picture,
    bounds: [f64; 4],
    on: Option<Vector2<f64>>,
    /// Side of a cell, px, and the first one's corner.
    side: usize,
    from: [usize; 2],
    size: [usize; 2],
    colours: Vec<[f64; 3]>,
}

impl<'a> Grid<'a> {
    fn new(picture: &'a Picture, bounds: [f64; 4], on: Option<Vector2<f64>>) -> Option<Self> {
        let (w, h) = picture.size();
        let (bw, bh) = (bounds[2] - bounds[0], bounds[3] - bounds[1]);
        if bw < 8.0 || bh < 8.0 {
            return None;
        }
        let side = (bw.max(bh) / CELLS).ceil().max(1.0) as usize;
        let low = |at: f64, by: f64| (at - AROUND * by).max(0.0) as usize / side;
        let high = |at: f64, by: f64, end: usize| {
            ((at + AROUND * by).min(end as f64 - 1.0).max(0.0) as usize / side)
                .min((end - 1) / side)
        };
        let from = [low(bounds[0], bw), low(bounds[1], bh)];
        let to = [high(bounds[2], bw, w), high(bounds[3], bh, h)];
        let size = [to[0].checked_sub(from[0])? + 1, to[1].checked_sub(from[1])? + 1];
        let half = side as f64 / 2.0 - 0.5;
        let colours = (0..size[0] * size[1])
            .map(|i| {
                let x = ((from[0] + i % size[0]) * side) as f64 + half;
                let y = ((from[1] + i / size[0]) * side) as f64 + half;
                [0, 1, 2].map(|c| f64::from(picture.lab[c].sample(x, y)))
            })
            .collect();
        Some(Self { picture, bounds, on, side, from, size, colours })
    }

    /// The middle of a cell, px.
    fn place(&self, i: usize) -> Vector2<f64> {
        let at = |k: usize, n: usize| {
            ((self.from[k] + n) * self.side) as f64 + self.side as f64 / 2.0 - 0.5
        };
        Vector2::new(at(0, i % self.size[0]), at(1, i / self.size[0]))
    }

    /// How far inside the box a cell is, as a share of half of its sides; negative outside.
    fn inside(&self, i: usize) -> f64 {
        let p = self.place(i);
        let b = self.bounds;
        let near = |at: f64, low: f64, high: f64| 2.0 * (at - low).min(high - at) / (high - low);
        near(p.x, b[0], b[2]).min(near(p.y, b[1], b[3]))
    }

    fn cut(&self, border: f64, expected: f64) -> Option<GrayImage> {
        let n = self.colours.len();
        let inside: Vec<f64> = (0..n).map(|i| self.inside(i)).collect();
        let on: Vec<bool> = (0..n)
            .map(|i| {
                self.on.is_some_and(|on| (self.place(i) - on).amax() <= 1.5 * self.side as f64)
            })
            .collect();
        let far = |a: usize, b: usize| {
            (0..3).map(|c| (self.colours[a][c] - self.colours[b][c]).powi(2)).sum::<f64>()
        };
        let [cols, rows] = self.size;
        let mut links: Vec<(usize, usize, f64)> = Vec::with_capacity(4 * n);
        for i in 0..n {
            let (x, y) = (i % cols, i / cols);
            let diagonal = std::f64::consts::FRAC_1_SQRT_2;
            for (open, to, share) in [
                (x + 1 < cols, i + 1, 1.0),
                (y + 1 < rows, i + cols, 1.0),
                (x + 1 < cols && y + 1 < rows, i + cols + 1, diagonal),
                (x > 0 && y + 1 < rows, i + cols - 1, diagonal),
            ] {
                if open {
                    links.push((i, to, share));
                }
            }
        }
        // The grain of the picture here: half of the neighbours differ by less.
        let mut steps: Vec<f64> = links.iter().map(|l| far(l.0, l.1)).collect();
        let mean = steps.iter().sum::<f64>() / steps.len().max(1) as f64;
        let grain = (GRAIN * median(&mut steps)).max(0.25).min(mean);
        let mut object: Vec<bool> = inside.iter().map(|d| *d > 0.0).collect();
        for _ in 0..ROUNDS {
            let of = |wanted: bool| -> Vec<[f64; 3]> {
                (0..n).filter(|&i| object[i] == wanted).map(|i| self.colours[i]).collect()
            };
            let (own, other) = (Palette::learn(&of(true))?, Palette::learn(&of(false))?);
            let mut flow = Flow::new(n);
            for i in 0..n {
                let preference = if on[i] {
                    1e6
                } else if inside[i] <= 0.0 {
                    -1e6
                } else {
                    // A loose box is some sixth too large on each side.
                    let middle = ((inside[i] - LOOSE) / LOOSE).clamp(-1.0, 1.0);
                    other.cost(&self.colours[i]) - own.cost(&self.colours[i]) + expected * middle
                };
                flow.terminal(i, preference);
            }
            for &(a, b, share) in &links {
                flow.link(
                    a,
                    b,
                    border * share * (-far(a, b) / (2.0 * grain)).exp() + 0.02 * border,
                );
            }
            object = flow.source_side();
        }
        self.mask(&object)
    }

    /// Cells as a mask of the picture's size, smoothed over their stairs.
    fn mask(&self, object: &[bool]) -> Option<GrayImage> {
        let (w, h) = self.picture.size();
        let mut soft = Plane::zeros(self.size[0], self.size[1]);
        for (value, inside) in soft.data.iter_mut().zip(object) {
            *value = f32::from(u8::from(*inside));
        }
        let soft = soft.blurred(0.8);
        let mut mask = GrayImage::new(w as u32, h as u32);
        let [x0, y0] = self.from.map(|f| f * self.side);
        let x1 = (x0 + self.size[0] * self.side).min(w);
        let y1 = (y0 + self.size[1] * self.side).min(h);
        let side = self.side as f64;
        let mut any = false;
        for y in y0..y1 {
            for x in x0..x1 {
                let u = ((x - x0) as f64 + 0.5) / side - 0.5;
                let v = ((y - y0) as f64 + 0.5) / side - 0.5;
                if soft.sample(u, v) > 0.5 {
                    mask.put_pixel(x as u32, y as u32, Luma([255]));
                    any = true;
                }
            }
        }
        any.then(|| tidy(&mask, [x0, y0, x1, y1]))
    }
}

/// Neighbouring cells that differ by this many times what half of them differ by (squared) are as likely parted as not.
const GRAIN: f64 = 4.0;
/// The share of half of a box that is expected not to be the thing.
const LOOSE: f64 = 0.2;

/// What the referee says of a mask.
struct Judged {
    total: f64,
    edge: f64,
    is_smooth: bool,
    contour: Vec<[f64; 2]>,
}

/// Judges a mask by its outline alone.
fn judge(
    picture: &Picture,
    mask: &GrayImage,
    bounds: [f64; 4],
    on: Option<Vector2<f64>>,
) -> Option<Judged> {
    let border = outer_border(mask, 2.0)?;
    let n = border.len();
    let (w, h) = (f64::from(mask.width()), f64::from(mask.height()));
    let [u0, v0, u1, v1] = bounds;
    let room = (0.02 * (u1 - u0).min(v1 - v0)).max(2.0);
    // The strongest edge in or against the outline's own direction, over what the surroundings have on average.
    let level = &picture.levels[0];
    let (mut along, mut touching) = (0.0, 0.0);
    let mut strengths: Vec<f64> = Vec::with_capacity(n);
    for (i, p) in border.iter().enumerate() {
        let step = border[(i + 3) % n] - border[(i + n - 3) % n];
        let Some(step) = step.try_normalize(1e-9) else { continue };
        let normal = Vector2::new(step.y, -step.x);
        let best = (-3..=3)
            .map(|k| {
                level.edge(p.x + f64::from(k) * normal.x, p.y + f64::from(k) * normal.y, normal)
            })
            .fold(0.0, f64::max);
        strengths.push(best);
        along += 1.0;
        // A thing may go on beyond the picture, not beyond its box.
        let at_box = (p.x - u0 < room && u0 > 1.0)
            || (p.y - v0 < room && v0 > 1.0)
            || (u1 - p.x < room && u1 < w - 2.0)
            || (v1 - p.y < room && v1 < h - 2.0);
        touching += f64::from(u8::from(at_box));
    }
    let full = (FULL_EDGE).max(picture.noise * 0.5);
    let edge = strengths.iter().map(|s| (s / full).min(1.0)).sum::<f64>() / f64::max(along, 1.0);
    let low = border.iter().fold(border[0], |a, p| a.inf(p));
    let high = border.iter().fold(border[0], |a, p| a.sup(p));
    let fills = ((high.x - low.x) / (u1 - u0)).min((high.y - low.y) / (v1 - v0));
    let smooth = Smoothness::of(mask)?;
    // With a point the box is ours, and what it holds may be small in it.
    let least = if on.is_some() { 0.3 } else { 0.6 };
    let fills = (fills / least).min(1.0);
    let total =
        edge * smooth.solidity * fills * fills * (1.0 - touching / f64::max(along, 1.0)).powi(2);
    let contour = border.iter().map(|p| [p.x, p.y]).collect();
    Some(Judged { total, edge, is_smooth: smooth.is_smooth(), contour })
}

/// Gradient at which an edge counts in full, CIELAB/px: between that of clear and of opaque things.
const FULL_EDGE: f64 = 1.5;
