//! A thing cut out of a picture from a box around it, a point on it or a rough mask, without a scene, a camera or a pose.
//!
//! The cut is that of [`super`], on a coarser grid and several times: a border is cheap or dear, and the middle of the
//! box is more or less expected to be the thing. Glass needs another of these than a printed box does, so each is tried,
//! and a referee that knows nothing of colours ([`super::referee`]) chooses: the mask whose outline runs along the picture's
//! edges, is whole, and fills the box without touching it. A box is loose: it holds the thing and some of what is around it.
//!
//! Source: Rother, Kolmogorov and Blake, "`GrabCut`", SIGGRAPH 2004.

use image::{GrayImage, Luma};
use nalgebra::Vector2;
use rayon::prelude::*;

use super::chosen::{Ranks, Rated};
use super::flow::Flow;
use super::palette::Palette;
use super::referee::{self, Judged};
use super::ring::Band;
use super::snap::snapped;
use super::tidy;
use crate::alignment::picture::{Picture, median};
use crate::alignment::plane::Plane;

/// What a person says of where the thing is, px.
#[derive(Debug, Clone, PartialEq)]
pub enum Prompt {
    /// Inside this box `[u0, v0, u1, v1]`, with some room.
    Box([f64; 4]),
    /// At this place `[u, v]`.
    Point([f64; 2]),
    /// Roughly where this mask of the picture's size is not zero.
    Mask(GrayImage),
}

/// Who cut a thing out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum By {
    /// [`segment`].
    Ours,
    /// Somebody else.
    Other {
        /// What they think of it, of which 1 is meant to be sure.
        score: f64,
    },
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
    /// How much the outline is that of a whole thing, 0 to 1: by its edges, its form, and how it lies in the box.
    pub agreement: f64,
    /// Whether its outline is that of a solid: no bites, spurs or ragged parts.
    pub is_smooth: bool,
    /// Who cut it out.
    pub by: By,
}

impl Segment {
    /// Returns the box of the mask, `[u0, v0, u1, v1]`, px, and its area, px².
    pub fn extent(&self) -> ([f64; 4], usize) {
        extent(&self.mask).unwrap_or((self.bounds, 0))
    }
}

/// Returns the box of what is not zero in a mask, `[u0, v0, u1, v1]`, px, and its area, px²; `None` of an empty one.
pub fn extent(mask: &GrayImage) -> Option<([f64; 4], usize)> {
    let mut held = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    let mut area = 0;
    for (x, y, _) in mask.enumerate_pixels().filter(|(_, _, pixel)| pixel.0[0] > 0) {
        let (x, y) = (f64::from(x), f64::from(y));
        held = [held[0].min(x), held[1].min(y), held[2].max(x), held[3].max(y)];
        area += 1;
    }
    (area > 0).then_some((held, area))
}

/// Cells of the grid along the longer side of the box. Chosen: a bottle's neck is some five of them; with half as many
/// it is lost, with twice as many a cut takes ten times as long.
const CELLS: f64 = 80.0;
/// As [`CELLS`], at a glance. Chosen: a third takes a tenth of the time, and a bottle's neck is still two of them.
const GLANCE: f64 = 28.0;
/// Prices and expectations that are tried at a glance: those in the middle, and a firmer one for faint things.
const GLANCES: [(f64, f64); 3] = [(10.0, 1.5), (25.0, 1.5), (10.0, 4.0)];
/// How far across a border its edge is looked for at a glance, px of the small picture.
const BESIDE_PX: i32 = 1;
/// How far around the box colours of what is not the thing are learnt, as a share of its sides. Chosen: as much area again
/// as the box has, so that both palettes are learnt from as many cells; with half of it a shadow is most of it, with twice
/// as much the neighbours' colours are.
const AROUND: f64 = 0.25;
/// Prices of a border between cells of one colour, in units of log-likelihood. Chosen: [`super::BORDERS`] begins at 25 on
/// cells of 2 px; on both sides of that in steps of about two, since glass differs from what is behind it by one or two
/// units a cell and a printed box by ten. The referee chooses, so that a step too many costs only time.
const BORDERS: [f64; 4] = [4.0, 10.0, 25.0, 50.0];
/// How much the middle of the box is expected to be the thing, in units of log-likelihood: not at all, by odds of 4 and of
/// 50 to 1. Chosen: with none colours alone decide, with 4 only what differs clearly from the middle is cut off.
const EXPECTED: [f64; 3] = [0.0, 1.5, 4.0];
/// What a step in or out costs a closed line, and what a place at the box is worth to it, in edges ([`Band::mask`]). Measured on
/// five samples of `ClearGrasp`: where being further out is worth nothing the line runs along the highlights inside of a
/// bottle, where it is worth a whole edge along the box; steps at two fifths of the lower price follow highlights too.
const RINGS: [(f64, f64); 6] =
    [(0.05, 0.2), (0.05, 0.35), (0.05, 0.5), (0.1, 0.2), (0.1, 0.35), (0.1, 0.5)];
/// Power with which the edge along an outline counts once more where there is a box. The picture's word goes before that on form:
/// tumblers that touch are hollow together (0.7 of their hull) and edged all round (0.99); one and a half of them are whole
/// (0.93) and edged less (0.90), and were taken with 1.
const RUNS: i32 = 2;
/// Rounds of learning colours and cutting: one less than `GrabCut`'s customary five (Rother et al. show that most of the
/// energy falls in the first three); the last one changes hardly a cell.
const ROUNDS: usize = 4;
/// Sides of the boxes that are tried around a point, as shares of the picture's shorter side: from a cup two metres away to
/// one that fills the picture, each 1.6 times the one before, so that one of them is at most 30 % too large on each side.
const SIDES: [f64; 5] = [0.1, 0.17, 0.28, 0.45, 0.7];
/// The least side of a box that is cut, px: eight cells, as in [`super::cut`], below which four colours are not learnt.
pub const LEAST_SIDE: f64 = 8.0;
/// How far a rough mask may be wrong, as a share of its box: as much as a box drawn by hand is ([`LOOSE`]).
const ROUGH: f64 = 0.15;
/// Neighbouring cells that differ by this many times what half of them differ by (squared) are as likely parted as not.
/// Chosen: twice the grain itself. With half of it the grain of a table is a border, with twice as much a faint one is not.
const GRAIN: f64 = 4.0;
/// The least grain, CIELAB²: half a unit is less than eight bits of a dark pixel tell.
const LEAST_GRAIN: f64 = 0.25;
/// The share of half of a box that is expected not to be the thing: a box drawn by hand is a sixth too large on each side
/// (the boxes of `docs/results.md` are 15 %).
const LOOSE: f64 = 0.2;
/// A cell so near, in cells, to the point that was pointed at is the thing's: one pixel's colour may be chance, nine are not.
const POINTED: f64 = 1.5;
/// What a known cell costs to be taken for the other, in units of log-likelihood: more than all borders around it.
const KNOWN: f64 = 1e6;
/// Share of the price that a border costs even where colours differ most. Chosen: a speck of one cell then still costs
/// something; with ten times as much sharp corners are cut off.
const LEAST_PRICE: f64 = 0.02;
/// Smoothing of the cells before the mask is made, cells: half of one to each side takes off the stairs and no corner.
const STAIRS_CELLS: f32 = 0.8;

/// A box, px, and what is known within it.
#[derive(Clone)]
struct Place<'a> {
    bounds: [f64; 4],
    on: Option<Vector2<f64>>,
    rough: Option<&'a GrayImage>,
}

/// Cuts a thing out; `None` when nothing separates there.
pub fn segment(picture: &Picture, prompt: &Prompt) -> Option<Segment> {
    let (w, h) = (picture.size().0 as f64, picture.size().1 as f64);
    let boxes: Vec<Place> = match prompt {
        Prompt::Box(bounds) => vec![Place { bounds: *bounds, on: None, rough: None }],
        Prompt::Point([u, v]) => SIDES
            .iter()
            .map(|side| 0.5 * side * w.min(h))
            .map(|half| Place {
                bounds: [u - half, v - half, u + half, v + half],
                on: Some(Vector2::new(*u, *v)),
                rough: None,
            })
            .collect(),
        Prompt::Mask(mask) => {
            let ([u0, v0, u1, v1], _) = extent(mask)?;
            let (du, dv) = (ROUGH * (u1 - u0), ROUGH * (v1 - v0));
            let bounds = [u0 - du, v0 - dv, u1 + du, v1 + dv];
            vec![Place { bounds, on: None, rough: Some(mask) }]
        }
    };
    let is_own = matches!(prompt, Prompt::Point(_));
    let best = best_of(picture, boxes, is_own)?;
    let (mask, bounds) = (snapped(picture, best.mask), best.bounds);
    let judged = referee::judge(picture, &mask, bounds, is_own, referee::ACROSS_PX)?;
    Some(Segment::of(judged, mask, bounds))
}

/// What seems to be in a box of a picture of a quarter of the size: few cuts on a coarse grid, edges looked for only beside
/// the border, since further off there is always one.
pub(super) fn glance(picture: &Picture, bounds: [f64; 4], ranks: &Ranks) -> Option<Rated> {
    let tried = GLANCES.into_iter().filter_map(|(border, expected)| {
        let at = Place { bounds, on: None, rough: None };
        let mask = Grid::new(picture, at, GLANCE)?.cut(border, expected)?;
        let judged = referee::judge(picture, &mask, bounds, false, BESIDE_PX)?;
        let strengths = referee::edges_along(picture, &judged.contour, BESIDE_PX);
        Some(Rated::new(Segment::of(judged, mask, bounds), &strengths, ranks))
    });
    tried.max_by(|a, b| a.sure().total_cmp(&b.sure()))
}

/// The cut of several boxes, prices and expectations that the referee likes best.
fn best_of(picture: &Picture, boxes: Vec<Place>, is_own: bool) -> Option<Segment> {
    let (w, h) = (picture.size().0 as f64, picture.size().1 as f64);
    let boxes: Vec<Place> = boxes
        .into_iter()
        .map(|mut place| {
            let b = place.bounds;
            place.bounds = [b[0].max(0.0), b[1].max(0.0), b[2].min(w - 1.0), b[3].min(h - 1.0)];
            place
        })
        .collect();
    let is_box = |place: &&Place| place.on.is_none() && place.rough.is_none();
    let rings: Vec<[f64; 4]> = boxes.iter().filter(is_box).map(|place| place.bounds).collect();
    let tried: Vec<(Place, f64, f64)> = boxes
        .into_iter()
        .flat_map(|place| {
            BORDERS.iter().flat_map(move |&border| {
                let place = place.clone();
                EXPECTED.iter().map(move |&expected| (place.clone(), border, expected))
            })
        })
        .collect();
    let judged = |mask: GrayImage, bounds: [f64; 4]| {
        let judged = referee::judge(picture, &mask, bounds, is_own, referee::ACROSS_PX)?;
        Some(Segment::of(judged, mask, bounds))
    };
    let full = referee::FULL_EDGE.max(picture.noise * referee::NOISE_EDGE);
    let ringed = rings.into_par_iter().flat_map_iter(|bounds| {
        let band = Band::new(picture, bounds, full);
        RINGS.iter().filter_map(move |&(bend, out)| judged(band.mask(bend, out), bounds))
    });
    let cut = tried.into_par_iter().filter_map(|(place, border, expected)| {
        let bounds = place.bounds;
        judged(Grid::new(picture, place, CELLS)?.cut(border, expected)?, bounds)
    });
    let found: Vec<Segment> = cut.chain(ringed).filter(|cut| cut.agreement > 0.0).collect();
    let liked = |cut: &Segment| cut.agreement * if is_own { 1.0 } else { cut.edge.powi(RUNS) };
    found.into_iter().max_by(|a, b| liked(a).total_cmp(&liked(b)))
}

impl Segment {
    fn of(judged: Judged, mask: GrayImage, bounds: [f64; 4]) -> Self {
        let Judged { total, edge, is_smooth, contour } = judged;
        Self { mask, contour, bounds, edge, agreement: total, is_smooth, by: By::Ours }
    }
}

/// The cells of a box and of what is around it.
struct Grid<'a> {
    picture: &'a Picture,
    at: Place<'a>,
    /// Side of a cell, px, and the first one's corner.
    side: usize,
    from: [usize; 2],
    size: [usize; 2],
    colours: Vec<[f64; 3]>,
}

impl<'a> Grid<'a> {
    fn new(picture: &'a Picture, at: Place<'a>, cells: f64) -> Option<Self> {
        let (w, h) = picture.size();
        let bounds = at.bounds;
        let (bw, bh) = (bounds[2] - bounds[0], bounds[3] - bounds[1]);
        if bw < LEAST_SIDE || bh < LEAST_SIDE {
            return None;
        }
        let side = (bw.max(bh) / cells).ceil().max(1.0) as usize;
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
                picture.lab_at(x, y).map(f64::from)
            })
            .collect();
        Some(Self { picture, at, side, from, size, colours })
    }

    /// The middle of a cell, px.
    fn place(&self, i: usize) -> Vector2<f64> {
        let at = |k: usize, n: usize| {
            ((self.from[k] + n) * self.side) as f64 + self.side as f64 / 2.0 - 0.5
        };
        Vector2::new(at(0, i % self.size[0]), at(1, i / self.size[0]))
    }

    /// The pixel in the middle of a cell.
    fn clamped(&self, i: usize) -> Vector2<f64> {
        let (w, h) = self.picture.size();
        let p = self.place(i);
        Vector2::new(p.x.clamp(0.0, w as f64 - 1.0), p.y.clamp(0.0, h as f64 - 1.0))
    }

    /// How far inside the box a cell is, as a share of half of its sides; negative outside.
    fn inside(&self, i: usize) -> f64 {
        let p = self.place(i);
        let b = self.at.bounds;
        let near = |at: f64, low: f64, high: f64| 2.0 * (at - low).min(high - at) / (high - low);
        near(p.x, b[0], b[2]).min(near(p.y, b[1], b[3]))
    }

    fn cut(&self, border: f64, expected: f64) -> Option<GrayImage> {
        let n = self.colours.len();
        let inside: Vec<f64> = (0..n).map(|i| self.inside(i)).collect();
        let on: Vec<bool> = (0..n)
            .map(|i| {
                let near =
                    |on: Vector2<f64>| (self.place(i) - on).amax() <= POINTED * self.side as f64;
                self.at.on.is_some_and(near)
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
        let grain = (GRAIN * median(&mut steps)).max(LEAST_GRAIN).min(mean);
        let rough: Option<Vec<bool>> = self.at.rough.map(|mask| {
            let is_in = |p: Vector2<f64>| mask.get_pixel(p.x as u32, p.y as u32).0[0] > 0;
            (0..n).map(|i| is_in(self.clamped(i))).collect()
        });
        let begin = || inside.iter().map(|d| *d > 0.0).collect();
        let mut object: Vec<bool> = rough.clone().unwrap_or_else(begin);
        for _ in 0..ROUNDS {
            let of = |wanted: bool| -> Vec<[f64; 3]> {
                (0..n).filter(|&i| object[i] == wanted).map(|i| self.colours[i]).collect()
            };
            let (own, other) = (Palette::learn(&of(true))?, Palette::learn(&of(false))?);
            let mut flow = Flow::new(n);
            for i in 0..n {
                let preference = if on[i] {
                    KNOWN
                } else if inside[i] <= 0.0 {
                    -KNOWN
                } else {
                    let middle = match &rough {
                        Some(rough) => f64::from(i8::from(rough[i])) * 2.0 - 1.0,
                        None => ((inside[i] - LOOSE) / LOOSE).clamp(-1.0, 1.0),
                    };
                    other.cost(&self.colours[i]) - own.cost(&self.colours[i]) + expected * middle
                };
                flow.terminal(i, preference);
            }
            for &(a, b, share) in &links {
                let alike = (-far(a, b) / (2.0 * grain)).exp();
                flow.link(a, b, border * (share * alike + LEAST_PRICE));
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
        let soft = soft.blurred(STAIRS_CELLS);
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
