//! Where a known solid stands on the table, from a picture and without a mask.
//!
//! A cuboid or cylinder of known size on the plane z = 0 has three unknowns (a cylinder two). Every pose of
//! a grid over the table is scored by how well the picture's edges, colours and changes against the table
//! agree with the solid's predicted outline; the best are climbed at finer scales and fitted by
//! [`super::refine`]. Several distinct candidates come back, best first, so that the caller can see how far
//! behind the runner-up is and keep objects out of each other.
//!
//! The edge score is a mean plus the mean of its weakest third: a true outline has no side without support,
//! a chance alignment nearly always has one.
//!
//! Source: the paper, section 2.2 (solids from key points); Lowe, "Fitting parameterized 3-D models", PAMI
//! 1991; VISP's moving edges for the fit.

use std::f64::consts::{FRAC_PI_2, PI};

use image::GrayImage;
use nalgebra::Vector2;
use rayon::prelude::*;

use super::doubt::Doubt;
use super::outline::{Kind, ObjectPose, Outline, Projector, inside_convex};
use super::picture::{Level, Picture, Plane, lab, linear};
use super::refine::{self, Fit};
use crate::world::{Material, Object, Shape};

/// What may not be judged in the picture: something else is in front.
#[derive(Debug, Clone, Default)]
pub struct Hidden {
    /// Non-zero where, for example, the arm is; the picture's size.
    pub mask: Option<GrayImage>,
    /// Silhouettes of nearer objects, convex, px.
    pub hulls: Vec<Vec<Vector2<f64>>>,
}

impl Hidden {
    /// Returns whether a pixel is covered.
    pub fn covers(&self, p: Vector2<f64>) -> bool {
        let (x, y) = (p.x.round(), p.y.round());
        let masked = self.mask.as_ref().is_some_and(|mask| {
            x >= 0.0
                && y >= 0.0
                && x < f64::from(mask.width())
                && y < f64::from(mask.height())
                && mask.get_pixel(x as u32, y as u32).0[0] > 0
        });
        masked || self.hulls.iter().any(|hull| inside_convex(hull, p))
    }
}

/// How well a picture agrees with an object at a pose; every part from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Score {
    /// All parts together.
    pub total: f64,
    /// Mean edge support along the visible outline.
    pub edge: f64,
    /// Mean edge support of the weakest third of it.
    pub weakest: f64,
    /// Share of the inside that has the object's colour, less the share outside; `None` without colour.
    pub colour: Option<f64>,
    /// Share of the inside that does not look like bare table, less half the share outside.
    pub change: f64,
    /// Share of the outline inside the picture and not covered.
    pub visible: f64,
}

/// A place where an object may stand.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// Position on the table, m.
    pub x: f64,
    /// Position on the table, m.
    pub y: f64,
    /// Turn about z, rad, reduced by the shape's symmetry.
    pub yaw: f64,
    /// The agreement.
    pub score: Score,
    /// The sub-pixel fit, once it was made.
    pub fit: Option<Fit>,
}

impl Candidate {
    /// Returns the pose on the table.
    pub fn pose(&self) -> ObjectPose {
        ObjectPose::upright(self.x, self.y, 0.0, self.yaw)
    }

    /// Returns the distance to another candidate on the table, m.
    pub fn distance(&self, other: &Self) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }
}

/// Where to look: a rectangle of the table, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Least and largest x, m.
    pub x: [f64; 2],
    /// Least and largest y, m.
    pub y: [f64; 2],
}

/// One object's evidence in one picture.
pub struct Evidence<'a> {
    picture: &'a Picture,
    view: &'a Projector,
    /// What is looked for.
    pub object: &'a Object,
    /// How little each small pixel looks like table, 0 to 1.
    change: &'a Plane,
    /// How much each small pixel looks like the object, 0 to 1; `None` when its colour says nothing.
    colour: Option<Plane>,
    /// What is covered.
    pub hidden: Hidden,
}

/// Coarse grid step, m; at the quarter-size picture this is about three pixels.
const GRID_M: f64 = 0.015;
/// Coarse yaw step, rad.
const GRID_YAW: f64 = PI / 12.0;

impl<'a> Evidence<'a> {
    /// Gathers what the picture says about one object.
    pub fn new(
        picture: &'a Picture,
        view: &'a Projector,
        object: &'a Object,
        change: &'a Plane,
        hidden: Hidden,
    ) -> Self {
        let colour = likeness(picture, object);
        Self { picture, view, object, change, colour, hidden }
    }

    /// Gradient at which an edge counts in full, CIELAB/px at this level.
    fn full_edge(&self, level: &Level) -> f64 {
        // Chosen: a step of about 8 CIELAB for opaque things, 3 for clear ones, and never within the noise.
        let base = match self.object.material {
            Material::Opaque => 2.4,
            Material::Transparent => 0.9,
        };
        let noise = self.picture.noise * if level.scale < 1.5 { 0.9 } else { 0.5 };
        f64::max(base, noise)
    }

    /// Returns the outline at a pose, `per_edge` points an edge.
    pub fn outline(&self, pose: &ObjectPose, per_edge: usize) -> Outline {
        Outline::new(self.view, &self.object.shape, pose, per_edge)
    }

    /// Scores a pose at a level of the picture (0 full size, 2 a quarter).
    pub fn score(&self, pose: &ObjectPose, level: usize, per_edge: usize) -> Score {
        let outline = self.outline(pose, per_edge);
        if outline.samples.is_empty() {
            return Score::default();
        }
        let (w, h) = self.picture.size();
        let margin = self.picture.levels[level].scale;
        let judged = |p: Vector2<f64>| {
            p.x >= margin
                && p.y >= margin
                && p.x < w as f64 - 1.0 - margin
                && p.y < h as f64 - 1.0 - margin
                && !self.hidden.covers(p)
        };
        let level = &self.picture.levels[level];
        let full = self.full_edge(level);
        let mut support: Vec<(f64, f64)> = Vec::with_capacity(outline.samples.len());
        let (mut all, mut seen) = (0.0, 0.0);
        let mut by_edge = [(0.0_f64, 0.0_f64); 16];
        for s in &outline.samples {
            // Inner edges of a clear thing and of an unlit one may be invisible; they count half.
            let weight = s.length * if s.kind == Kind::Inner { 0.5 } else { 1.0 };
            all += weight;
            if judged(s.pixel) {
                seen += weight;
                let edge = level.edge(s.pixel.x, s.pixel.y, s.normal) / full;
                support.push((edge.min(1.0), weight));
                let slot = &mut by_edge[s.edge.min(15)];
                slot.0 += edge.min(1.0) * weight;
                slot.1 += weight;
            }
        }
        let visible = seen / all.max(1e-9);
        if visible < 0.25 {
            return Score { visible, ..Score::default() };
        }
        let edge = support.iter().map(|s| s.0 * s.1).sum::<f64>() / seen;
        support.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut weak, mut weight) = (0.0, 0.0);
        for (value, length) in support {
            if weight >= seen / 3.0 {
                break;
            }
            weak += value * length;
            weight += length;
        }
        // A whole edge without support (the foot of a tube whose sides fit) weighs as much as a third.
        let worst_edge =
            by_edge.iter().filter(|e| e.1 > 0.06 * seen).map(|e| e.0 / e.1).fold(1.0, f64::min);
        let weakest = 0.5 * (weak / weight.max(1e-9)) + 0.5 * worst_edge;
        let (change, colour) = self.regions(&outline, judged);
        let edges = 0.6 * edge + 0.4 * weakest;
        let total = match colour {
            Some(colour) => 0.45 * edges + 0.4 * colour + 0.15 * change,
            None => 0.8 * edges + 0.2 * change,
        };
        // A little of an outline at the picture's border agrees with much by chance.
        let total = total * (visible / 0.7).min(1.0).sqrt();
        Score { total, edge, weakest, colour, change, visible }
    }

    /// Returns the mean change and likeness inside the silhouette against just outside it.
    fn regions(
        &self,
        outline: &Outline,
        judged: impl Fn(Vector2<f64>) -> bool,
    ) -> (f64, Option<f64>) {
        let middle = outline.middle();
        let mut sums = [[0.0_f64; 2]; 2];
        let mut counts = [0.0_f64; 2];
        let rim: Vec<&super::outline::Sample> =
            outline.samples.iter().filter(|s| s.kind == Kind::Silhouette).collect();
        for s in rim.iter().step_by(2) {
            for (place, far) in [(0, 0.35), (0, 0.62), (0, 0.85), (1, 1.2)] {
                let p = middle + (s.pixel - middle) * far;
                if !judged(p) {
                    continue;
                }
                let (x, y) = (((p.x + 0.5) / 4.0 - 0.5).round(), ((p.y + 0.5) / 4.0 - 0.5).round());
                counts[place] += 1.0;
                sums[place][0] += f64::from(self.change.at(x as i64, y as i64));
                if let Some(colour) = &self.colour {
                    sums[place][1] += f64::from(colour.at(x as i64, y as i64));
                }
            }
        }
        let mean = |place: usize, what: usize| sums[place][what] / counts[place].max(1.0);
        let change = (mean(0, 0) - 0.5 * mean(1, 0)).clamp(0.0, 1.0);
        let colour = self.colour.as_ref().map(|_| (mean(0, 1) - 0.7 * mean(1, 1)).clamp(0.0, 1.0));
        (change, colour)
    }

    /// Searches a window of the table; returns up to eight distinct candidates, best first.
    pub fn search(&self, window: &Window) -> Vec<Candidate> {
        let symmetry = self.object.shape.symmetry();
        let n_yaw = if symmetry > 0.0 { (symmetry / GRID_YAW).round() as usize } else { 1 };
        let steps = |range: [f64; 2]| {
            let n = ((range[1] - range[0]) / GRID_M).ceil().max(0.0) as usize;
            (0..=n).map(move |i| {
                if n == 0 {
                    range[0]
                } else {
                    range[0] + (range[1] - range[0]) * i as f64 / n as f64
                }
            })
        };
        let columns: Vec<f64> = steps(window.x).collect();
        let all: Vec<Candidate> = columns
            .par_iter()
            .flat_map_iter(|&x| {
                let turns = move |y| (0..n_yaw).map(move |k| (y, k as f64 * GRID_YAW));
                steps(window.y).flat_map(turns).filter_map(move |(y, yaw)| {
                    let score = self.score(&ObjectPose::upright(x, y, 0.0, yaw), 2, 5);
                    (score.total > 0.05).then_some(Candidate { x, y, yaw, score, fit: None })
                })
            })
            .collect();
        let coarse = distinct(all, 40, 0.02, 0.3, symmetry);
        let finer: Vec<Candidate> =
            coarse.par_iter().map(|c| self.climb(c, 1, 8, 0.008, 0.12)).collect();
        let finer = distinct(finer, 12, 0.012, 0.15, symmetry);
        let fitted: Vec<Candidate> = finer.par_iter().map(|c| self.fit(c)).collect();
        distinct(fitted, 8, 0.012, 0.15, symmetry)
    }

    /// Climbs to a nearby best score with halving steps.
    fn climb(
        &self,
        from: &Candidate,
        level: usize,
        per_edge: usize,
        step: f64,
        turn: f64,
    ) -> Candidate {
        let turns = self.object.shape.symmetry() > 0.0;
        let mut best = *from;
        best.score = self.score(&best.pose(), level, per_edge);
        let (mut step, mut turn) = (step, turn);
        for _ in 0..4 {
            for _ in 0..6 {
                let mut next = best;
                let moves = [
                    (step, 0.0, 0.0),
                    (-step, 0.0, 0.0),
                    (0.0, step, 0.0),
                    (0.0, -step, 0.0),
                    (0.0, 0.0, turn),
                    (0.0, 0.0, -turn),
                ];
                for (dx, dy, dyaw) in moves.iter().take(if turns { 6 } else { 4 }) {
                    let mut trial =
                        Candidate { x: best.x + dx, y: best.y + dy, yaw: best.yaw + dyaw, ..best };
                    trial.score = self.score(&trial.pose(), level, per_edge);
                    if trial.score.total > next.score.total {
                        next = trial;
                    }
                }
                if next.score.total <= best.score.total {
                    break;
                }
                best = next;
            }
            step *= 0.5;
            turn *= 0.5;
        }
        best
    }

    /// Asks the edges near a pose for what the fit takes as known; `pivot` is the table's centre, m.
    pub fn doubt(&self, pose: &ObjectPose, pivot: [f64; 2]) -> Option<Doubt> {
        let full = self.full_edge(&self.picture.levels[0]);
        let how = (full, self.object.material, pivot);
        Doubt::ask(self.picture, self.view, &self.object.shape, pose, &self.hidden, how)
    }

    /// Fits a candidate to the full picture: climbing, then moving edges; keeps whichever scores better.
    pub fn fit(&self, from: &Candidate) -> Candidate {
        let mut best = self.climb(from, 0, 16, 0.003, 0.03);
        for _ in 0..2 {
            let refined = refine::refine(
                self.picture,
                self.view,
                &self.object.shape,
                &best.pose(),
                &self.hidden,
                self.full_edge(&self.picture.levels[0]),
                self.object.material,
            );
            let Some(fit) = refined else { break };
            let mut next = best;
            next.x = fit.x;
            next.y = fit.y;
            next.yaw = fit.yaw;
            next.score = self.score(&next.pose(), 0, 16);
            next.fit = Some(fit);
            // Moving edges are finer than the score, which is flat within some pixels where edges are strong:
            // a small loss is no loss.
            if next.score.total < 0.92 * best.score.total {
                break;
            }
            best = next;
        }
        best.yaw = reduce(best.yaw, &self.object.shape);
        best
    }
}

/// Returns the yaw between -symmetry/2 and symmetry/2, 0 for a cylinder.
pub(super) fn reduce(yaw: f64, shape: &Shape) -> f64 {
    let symmetry = shape.symmetry();
    if symmetry > 0.0 { yaw - symmetry * (yaw / symmetry).round() } else { 0.0 }
}

/// Keeps the best candidates that differ by more than `apart` m or `turned` rad, at most `n`.
fn distinct(
    mut candidates: Vec<Candidate>,
    n: usize,
    apart: f64,
    turned: f64,
    symmetry: f64,
) -> Vec<Candidate> {
    candidates.sort_by(|a, b| b.score.total.total_cmp(&a.score.total));
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in candidates {
        let same = |other: &Candidate| {
            let turn = if symmetry > 0.0 {
                let difference = (candidate.yaw - other.yaw).rem_euclid(symmetry);
                difference.min(symmetry - difference)
            } else {
                0.0
            };
            candidate.distance(other) < apart && turn < turned
        };
        if !kept.iter().any(same) {
            kept.push(candidate);
            if kept.len() == n {
                break;
            }
        }
    }
    kept
}

/// Returns how much each small pixel has the object's colour, `None` when that says nothing.
fn likeness(picture: &Picture, object: &Object) -> Option<Plane> {
    if object.material == Material::Transparent || picture.is_grey {
        return None;
    }
    let [_, a, b] = lab(object.colour);
    if a.hypot(b) > 18.0 {
        // A coloured thing keeps its chromaticity in any light; its lightness it does not keep.
        let [r, g, bl] = object.colour.map(linear);
        let sum = r + g + bl + 0.01;
        let (cr, cb) = ((r + 0.01 / 3.0) / sum, (bl + 0.01 / 3.0) / sum);
        let mut plane = Plane::zeros(picture.small[0].width, picture.small[0].height);
        for (at, value) in plane.data.iter_mut().enumerate() {
            let dr = picture.chromaticity[0].data[at] - cr;
            let db = picture.chromaticity[1].data[at] - cb;
            *value = (-(dr * dr + db * db) / (2.0 * 0.09 * 0.09)).exp();
        }
        return Some(plane);
    }
    let target = lab(object.colour);
    let mut plane = Plane::zeros(picture.small[0].width, picture.small[0].height);
    for (at, value) in plane.data.iter_mut().enumerate() {
        let d = [0, 1, 2].map(|c| picture.small[c].data[at] - target[c]);
        let far = (d[0] / 25.0).powi(2) + (d[1] / 8.0).powi(2) + (d[2] / 8.0).powi(2);
        *value = (-0.5 * far).exp();
    }
    Some(plane)
}

/// Chooses one candidate (or none) for each object so that no two stand in one place and the sum of the
/// scores is largest. `None` costs `bar`, the score below which nothing is believed.
pub fn assign(objects: &[&Object], candidates: &[Vec<Candidate>], bar: f64) -> Vec<Option<usize>> {
    fn go(
        objects: &[&Object],
        candidates: &[Vec<Candidate>],
        bar: f64,
        chosen: &mut Vec<Option<usize>>,
        sum: f64,
        best: &mut (f64, Vec<Option<usize>>),
    ) {
        let at = chosen.len();
        if at == objects.len() {
            if sum > best.0 {
                *best = (sum, chosen.clone());
            }
            return;
        }
        for (idx, candidate) in candidates[at].iter().enumerate().take(8) {
            let free = chosen.iter().enumerate().all(|(other, choice)| {
                choice.is_none_or(|c| {
                    !overlap(objects[at], candidate, objects[other], &candidates[other][c])
                })
            });
            if free && candidate.score.total > bar {
                chosen.push(Some(idx));
                go(objects, candidates, bar, chosen, sum + candidate.score.total, best);
                chosen.pop();
            }
        }
        chosen.push(None);
        go(objects, candidates, bar, chosen, sum + bar, best);
        chosen.pop();
    }
    let mut best = (f64::NEG_INFINITY, vec![None; objects.len()]);
    go(objects, candidates, bar, &mut Vec::new(), 0.0, &mut best);
    best.1
}

/// Returns whether two standing objects would share space, by more than 3 mm of measurement error.
pub fn overlap(a: &Object, at: &Candidate, b: &Object, bt: &Candidate) -> bool {
    const SLACK_M: f64 = 0.003;
    let footprint = |object: &Object, c: &Candidate| -> Vec<Vector2<f64>> {
        let centre = Vector2::new(c.x, c.y);
        match object.shape {
            Shape::Cuboid { size } => [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
                .map(|(sx, sy)| {
                    let corner = Vector2::new(sx * size.x / 2.0, sy * size.y / 2.0);
                    centre + nalgebra::Rotation2::new(c.yaw) * corner
                })
                .to_vec(),
            Shape::Cylinder { radius, .. } => (0..24)
                .map(|i| {
                    let (sin, cos) = (f64::from(i) * FRAC_PI_2 / 6.0).sin_cos();
                    centre + radius * Vector2::new(cos, sin)
                })
                .collect(),
        }
    };
    let (p, q) = (footprint(a, at), footprint(b, bt));
    // Separating axes: convex polygons are apart exactly when some edge normal separates them.
    let separates = |polygon: &[Vector2<f64>]| {
        (0..polygon.len()).any(|i| {
            let edge = polygon[(i + 1) % polygon.len()] - polygon[i];
            let axis = Vector2::new(edge.y, -edge.x).normalize();
            let range = |points: &[Vector2<f64>]| {
                points
                    .iter()
                    .map(|p| axis.dot(p))
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), d| {
                        (low.min(d), high.max(d))
                    })
            };
            let ((pl, ph), (ql, qh)) = (range(&p), range(&q));
            ph - SLACK_M <= ql || qh - SLACK_M <= pl
        })
    };
    !separates(&p) && !separates(&q)
}
