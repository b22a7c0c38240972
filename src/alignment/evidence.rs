//! How well a picture agrees with a known solid at a pose: its edges, its colours, and changes against the bare table.
//!
//! The edge score is a mean plus the mean of its weakest third: a true outline has no side without support,
//! a chance alignment nearly always has one. Where a solid stands is searched for in [`super::placement`].

use std::borrow::Cow;
use std::sync::Arc;

use image::GrayImage;
use nalgebra::Vector2;

use super::likeness::likeness;
use super::outline::{Kind, ObjectPose, Outline, Projector, Sample, depth, inside_convex};
use super::picture::{Level, Picture, QUARTER};
use super::plane::{Plane, nearest};
use crate::world::{Material, Object};

/// What may not be judged in the picture: something else is in front.
#[derive(Debug, Clone, Default)]
pub struct Hidden {
    /// Non-zero where, for example, the arm is; the picture's size.
    pub mask: Option<Arc<GrayImage>>,
    /// Silhouettes of nearer objects, convex, px.
    pub hulls: Vec<Vec<Vector2<f64>>>,
}

impl Hidden {
    /// Returns whether a pixel is covered.
    #[inline]
    pub fn covers(&self, p: Vector2<f64>) -> bool {
        let masked = self.mask.as_ref().is_some_and(|mask| {
            let (x, y) = (nearest(p.x), nearest(p.y));
            let (w, h) = (i64::from(mask.width()), i64::from(mask.height()));
            let is_in = x >= 0 && y >= 0 && x < w && y < h;
            is_in && mask.as_raw()[(y * w + x) as usize] > 0
        });
        masked || self.hulls.iter().any(|hull| inside_convex(hull, p))
    }

    /// Returns whether an edge seen at a pixel, in a picture of one pixel for `scale`, may be that of a nearer object.
    pub(super) fn owns_edge(&self, p: Vector2<f64>, scale: f64) -> bool {
        self.hulls.iter().any(|hull| depth(hull, p) < EDGE_REACH_PX * scale)
    }
}

/// How far beside a nearer object its own edge is still seen, px of the level that is looked at. Chosen: the picture is smoothed
/// by 0.8 px and its edges by 0.7 to 1.2, so that an edge has a flank of some 2 px; with half of it that flank is support for
/// whatever is laid along it, with twice as much a quarter of what is left of a half-hidden thing of 50 px is not looked at.
const EDGE_REACH_PX: f64 = 2.0;

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
    /// Share of the outline inside the picture, not covered, and not beside an edge of what covers.
    pub visible: f64,
}

/// One object's evidence in one picture.
pub struct Evidence<'a> {
    pub(super) picture: &'a Picture,
    pub(super) view: &'a Projector,
    /// What is looked for.
    pub object: &'a Object,
    /// How little each small pixel looks like table, 0 to 1.
    change: &'a Plane,
    /// How much each small pixel looks like the object, 0 to 1; `None` when its colour says nothing.
    colour: Option<Cow<'a, Plane>>,
    /// What is covered.
    pub hidden: Cow<'a, Hidden>,
}

/// Gradient at which an edge counts in full, CIELAB/px, of an opaque and of a clear thing. Chosen: a step of about 8
/// CIELAB for opaque things and 3 for clear ones, over some three pixels of blur. With half of it shadows and the
/// grain of a table count as edges, with twice as much a dull thing on a table of its own lightness has none.
const FULL_EDGE: [f64; 2] = [2.4, 0.9];
/// That gradient in units of the picture's noise at least, at full size and smaller. Chosen: averaging four or
/// sixteen pixels leaves less noise; with half of it grain is support, with twice as much a dark picture has no
/// edges.
const NOISE_EDGE: [f64; 2] = [0.9, 0.5];
/// Scale below which a level of the picture is the full one: between its 1 and the 2 of the next.
const FULL_SIZE: f64 = 1.5;
/// Weight of an inner edge beside one of the silhouette: of a clear thing and of an unlit one it may be invisible.
/// Chosen between none, with which a cuboid's turn is told by its outline alone, and the whole, with which what is
/// not there counts as missing.
pub(super) const INNER: f64 = 0.5;
/// Edges of a solid that are told apart: a cuboid has twelve; what has more shares the last one.
pub(super) const EDGES: usize = 16;
/// Share of the outline in view below which nothing is scored. Chosen: a quarter is one side of a cuboid; with half
/// of that any line agrees, with twice as much nothing at the picture's border is found.
const LEAST_VISIBLE: f64 = 0.25;
/// An edge counts by itself when it is at least this share of what is in view. Chosen: of a cuboid's nine visible
/// edges one has a ninth on average; one that is foreshortened to a quarter of that has some pixels, in which noise
/// decides, and with twice as much the short upright edges of a flat thing would not count.
const WHOLE_EDGE: f64 = 0.06;
/// The part of the outline whose support is the weakest: a third, as in the prototype that placed real cubes,
/// cylinders and cans within 5 mm. With two parts it is nearly the mean again, with six the noise of a few points.
const WEAKEST_PART: f64 = 3.0;
/// Shares of the weakest third and of the weakest whole edge in [`Score::weakest`]. Chosen: the same for both. The
/// third alone does not see that the foot of a tube is missing whose sides fit, the edge alone not that support is
/// scattered by chance.
const THIRD: f64 = 0.5;
const WORST: f64 = 0.5;
/// Shares of the mean and of the weakest part in what the edges say, and of edges, colour and change in the whole,
/// with a colour and without. Chosen, each set adding up to 1, so that a score is from 0 to 1: edges tell the place
/// and decide; colour tells which thing it is; a change of the table is what any thing and its shadow makes. How far
/// present and absent things are apart with these is measured at [`super::vision`]'s `belief`, and
/// `tests/alignment_vision/see.rs` holds them to it: with little colour things of one shape exchange places, with
/// twice as much a coloured thing is placed by its blob, not by its edges.
const OF_EDGES: [f64; 2] = [0.6, 0.4];
const WITH_COLOUR: [f64; 3] = [0.45, 0.4, 0.15];
const WITHOUT_COLOUR: [f64; 2] = [0.8, 0.2];
/// Share of the outline in view from which it counts in full; less of it agrees with much by chance, and counts by
/// the root of its share. Chosen: with half of it a third of an outline is believed as a whole one, with 1 a thing
/// behind another loses by being there.
const IN_FULL: f64 = 0.7;
/// How far from the silhouette's middle to its rim the inside and the outside are looked at, as shares. Chosen: from
/// a third of the way, where the rim's own light is not yet, to 0.85, and just beyond; at 1.4 what is looked at is
/// the neighbour.
const INSIDE: [f64; 3] = [0.35, 0.62, 0.85];
const OUTSIDE: f64 = 1.2;
/// How far beyond the rim of what is not convex it is looked, as shares of half its width: just outside, as for the others,
/// and as far as most of a thing is from its own part. Chosen: at 0.2 alone a bracket turned away is as good as its plate
/// seen from before; at 1 what is looked at is the neighbour.
const BEYOND: [f64; 2] = [OUTSIDE - 1.0, 0.6];
/// How much of what is found outside is taken off: of change, which a shadow makes there as well, half; of colour, of
/// which nothing should be there, more. Chosen between none, with which a large blob is as good as a thing, and all,
/// with which two things of one colour side by side erase each other.
const CHANGE_OUTSIDE: f64 = 0.5;
const COLOUR_OUTSIDE: f64 = 0.7;
/// Every second point of the silhouette is looked at for its regions, which are flat: half the time, the same mean.
const REGION_STEP: usize = 2;
impl<'a> Evidence<'a> {
    /// Gathers what the picture says about one object.
    pub fn new(
        picture: &'a Picture,
        view: &'a Projector,
        object: &'a Object,
        change: &'a Plane,
        hidden: Hidden,
    ) -> Self {
        let colour = likeness(picture, object).map(Cow::Owned);
        Self { picture, view, object, change, colour, hidden: Cow::Owned(hidden) }
    }

    /// Gradient at which an edge counts in full, CIELAB/px at this level.
    pub(super) fn full_edge(&self, level: &Level) -> f64 {
        let base = match self.object.material {
            Material::Opaque => FULL_EDGE[0],
            Material::Transparent => FULL_EDGE[1],
        };
        let noise = self.picture.noise * NOISE_EDGE[usize::from(level.scale >= FULL_SIZE)];
        f64::max(base, noise)
    }

    /// Returns the outline at a pose, `per_edge` points an edge.
    pub fn outline(&self, pose: &ObjectPose, per_edge: usize) -> Outline {
        Outline::new(self.view, &self.object.shape, pose, per_edge)
    }

    /// Returns the outline at a pose with the pieces of a silhouette that is not convex, `per_edge` points an edge.
    pub fn silhouette(&self, pose: &ObjectPose, per_edge: usize) -> Outline {
        Outline::whole(self.view, &self.object.shape, pose, per_edge)
    }

    /// Scores a pose at a level of the picture (0 full size, 2 a quarter).
    pub fn score(&self, pose: &ObjectPose, level: usize, per_edge: usize) -> Score {
        self.score_above(f64::NEG_INFINITY, pose, level, per_edge).unwrap_or_default()
    }

    /// As [`Self::score`], `None` where the edges alone say that the whole is no more than `least`: the regions need not be
    /// asked then.
    pub(super) fn score_above(
        &self,
        least: f64,
        pose: &ObjectPose,
        level: usize,
        per_edge: usize,
    ) -> Option<Score> {
        let outline = Outline::lines(self.view, &self.object.shape, pose, per_edge);
        if outline.samples.is_empty() {
            return Some(Score::default());
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
        let mut by_edge = [(0.0_f64, 0.0_f64); EDGES];
        for s in &outline.samples {
            let weight = s.length * if s.kind == Kind::Inner { INNER } else { 1.0 };
            all += weight;
            // Laid along what hides it, a thing would have that one's edge for its own, and more of itself in view.
            if judged(s.pixel) && !self.hidden.owns_edge(s.pixel, level.scale) {
                seen += weight;
                let edge = level.edge(s.pixel.x, s.pixel.y, s.normal) / full;
                support.push((edge.min(1.0), weight));
                let slot = &mut by_edge[s.edge.min(EDGES - 1)];
                slot.0 += edge.min(1.0) * weight;
                slot.1 += weight;
            }
        }
        let visible = seen / all.max(1e-9);
        if visible < LEAST_VISIBLE {
            return Some(Score { visible, ..Score::default() });
        }
        let edge = support.iter().map(|s| s.0 * s.1).sum::<f64>() / seen;
        let (weak, weight) = weakest(&mut support, seen / WEAKEST_PART);
        // A whole edge without support (the foot of a tube whose sides fit) weighs as much as a third.
        let worst_edge = by_edge
            .iter()
            .filter(|e| e.1 > WHOLE_EDGE * seen)
            .map(|e| e.0 / e.1)
            .fold(1.0, f64::min);
        let weakest = THIRD * (weak / weight.max(1e-9)) + WORST * worst_edge;
        let edges = OF_EDGES[0] * edge + OF_EDGES[1] * weakest;
        let whole = |change: f64, colour: Option<f64>| {
            let total = match colour {
                Some(colour) => {
                    WITH_COLOUR[0] * edges + WITH_COLOUR[1] * colour + WITH_COLOUR[2] * change
                }
                None => WITHOUT_COLOUR[0] * edges + WITHOUT_COLOUR[1] * change,
            };
            total * (visible / IN_FULL).min(1.0).sqrt()
        };
        if whole(1.0, self.colour.as_ref().map(|_| 1.0)) <= least {
            return None;
        }
        let outline = outline.closed(self.view, &self.object.shape, pose);
        if outline.hull.is_empty() {
            return Some(Score::default());
        }
        let (change, colour) = self.regions(&outline, judged);
        Some(Score { total: whole(change, colour), edge, weakest, colour, change, visible })
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
        // A pixel of the quarter picture is mixed with what is in front of it beside that.
        let beside = [(-QUARTER, 0.0), (QUARTER, 0.0), (0.0, -QUARTER), (0.0, QUARTER)];
        let is_mixed = |p: Vector2<f64>| {
            !self.hidden.hulls.is_empty()
                && beside.iter().any(|(u, v)| self.hidden.covers(p + Vector2::new(*u, *v)))
        };
        let mut ask = |place: usize, p: Vector2<f64>| {
            if !judged(p) || is_mixed(p) {
                return;
            }
            let [x, y] = [p.x, p.y].map(|at| nearest((at + 0.5) / QUARTER - 0.5));
            counts[place] += 1.0;
            sums[place][0] += f64::from(self.change.at(x, y));
            if let Some(colour) = &self.colour {
                sums[place][1] += f64::from(colour.at(x, y));
            }
        };
        let rim = outline.samples.iter().filter(|s| s.kind == Kind::Silhouette);
        if outline.within.is_empty() {
            for s in rim.step_by(REGION_STEP) {
                let out = s.pixel - middle;
                for far in INSIDE {
                    ask(0, middle + out * far);
                }
                ask(1, middle + out * OUTSIDE);
            }
        } else {
            // The middle of what is not convex may be beside it: its own points are asked. Seen from one side it may look
            // like a part of what it is from another; then the rest of it is seen beyond the rim.
            let [u0, v0, u1, v1] = outline.bounds();
            let half = 0.25 * (u1 - u0 + v1 - v0);
            outline.within.iter().for_each(|p| ask(0, *p));
            let rim: Vec<&Sample> = rim.step_by(REGION_STEP).collect();
            for far in BEYOND {
                let beyond = rim.iter().map(|s| s.pixel + s.normal * (far * half));
                beyond.filter(|p| !outline.contains(*p)).for_each(|p| ask(1, p));
            }
        }
        let mean = |place: usize, what: usize| sums[place][what] / counts[place].max(1.0);
        let change = (mean(0, 0) - CHANGE_OUTSIDE * mean(1, 0)).clamp(0.0, 1.0);
        let colour = self
            .colour
            .as_ref()
            .map(|_| (mean(0, 1) - COLOUR_OUTSIDE * mean(1, 1)).clamp(0.0, 1.0));
        (change, colour)
    }

    /// Returns the same evidence asked for another object, whose colour is that of this one.
    pub fn of<'b>(&'b self, object: &'b Object) -> Evidence<'b> {
        let colour = self.colour.as_deref().map(Cow::Borrowed);
        Evidence { object, colour, hidden: Cow::Borrowed(&*self.hidden), ..*self }
    }
}

/// Returns the sum of values times their weights, and that of the weights, of the least values that make up so much weight.
/// Only these are put in order.
fn weakest(values: &mut [(f64, f64)], most: f64) -> (f64, f64) {
    let by_value = |a: &(f64, f64), b: &(f64, f64)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1));
    let half = values.len() / 2;
    if half > 0 {
        values.select_nth_unstable_by(half, by_value);
    }
    let (least, more) = values.split_at_mut(half);
    let (mut sum, mut weight) = (0.0, 0.0);
    for part in [least, more] {
        if weight >= most {
            break;
        }
        part.sort_unstable_by(by_value);
        for (value, length) in part {
            if weight >= most {
                break;
            }
            sum += *value * *length;
            weight += *length;
        }
    }
    (sum, weight)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nearer_things_edge_is_its_own_to_where_it_ends_to_be_seen() {
        let square = [(10.0, 10.0), (30.0, 10.0), (30.0, 30.0), (10.0, 30.0)];
        let square: Vec<Vector2<f64>> = square.map(|(u, v)| Vector2::new(u, v)).to_vec();
        let hidden = Hidden { mask: None, hulls: vec![square] };
        let beside = Vector2::new(31.5, 20.0);
        assert!(hidden.owns_edge(beside, 1.0) && !hidden.covers(beside));
        let farther = Vector2::new(32.5, 20.0);
        assert!(!hidden.owns_edge(farther, 1.0) && hidden.owns_edge(farther, 2.0));
        assert!(!Hidden::default().owns_edge(beside, 1.0));
    }
}
