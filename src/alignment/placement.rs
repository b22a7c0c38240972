//! Where a known solid stands on the table, from a picture and without a mask.
//!
//! A cuboid or cylinder of known size on the plane z = 0 has three unknowns (a cylinder two). Every pose of
//! a grid over the table is scored by how well the picture's edges, colours and changes against the table
//! agree with the solid's predicted outline; the best are climbed at finer scales and fitted by
//! [`super::refine`]. Several distinct candidates come back, best first, so that the caller can see how far
//! behind the runner-up is and keep objects out of each other, which is [`super::choice`]'s work.
//!
//! How a pose is scored is [`super::evidence`]'s.
//!
//! Source: the paper, section 2.2 (solids from key points); Lowe, "Fitting parameterized 3-D models", PAMI
//! 1991; VISP's moving edges for the fit.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::doubt::Doubt;
use super::evidence::{Evidence, Score};
use super::outline::{ObjectPose, inside_convex};
use super::refine::{self, Fit};
use crate::world::Shape;

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

    /// Returns how far another candidate is turned against this one, rad; `symmetry` is the turn that looks the same, 0 of
    /// what is round.
    pub(super) fn turned(&self, other: &Self, symmetry: f64) -> f64 {
        if symmetry > 0.0 {
            let difference = (self.yaw - other.yaw).rem_euclid(symmetry);
            difference.min(symmetry - difference)
        } else {
            0.0
        }
    }

    /// Returns the score, less what a fit may lose of it where there is none: edges that agree are worth as much.
    fn worth(&self) -> f64 {
        self.score.total * if self.fit.is_some() { 1.0 } else { LOSS }
    }
}

/// What a search came to.
#[derive(Debug, Clone, Default)]
pub struct Searched {
    /// Up to eight distinct places, fitted, best first.
    pub best: Vec<Candidate>,
    /// The places that look most like the thing, as scored at half size, best first.
    pub alike: Vec<Candidate>,
}

/// Where to look: a rectangle of the table, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Least and largest x, m.
    pub x: [f64; 2],
    /// Least and largest y, m.
    pub y: [f64; 2],
}

/// Coarse grid step, m; at the quarter-size picture this is about three pixels (the kitchen's camera, 900 px at 1.07 m,
/// has 210 of them a metre). Chosen: with half of it four times as many places are scored; with twice as much a place
/// is up to 9 px from the nearest one, farther than an edge of that picture is wide.
const GRID_M: f64 = 0.015;
/// Coarse yaw step, rad: at the corner of a 65 mm square, 46 mm from its axis, 15 deg are 12 mm, as much as [`GRID_M`].
const GRID_YAW: f64 = PI / 12.0;

/// Score below which a place of the grid is not kept: a sixth of what is believed at all ([`super::vision`]). Chosen:
/// only to keep lists short.
const HOPELESS: f64 = 0.05;
/// The three rounds of the search: how many candidates are kept, and how far two must be apart to be two, m and rad:
/// somewhat more than the step before, halved by the climb. Chosen: with half as many a right place behind many
/// look-alikes is lost, with twice as many this part of the search takes twice as long.
const COARSE: (usize, f64, f64) = (40, 0.02, 0.3);
const FINER: (usize, f64, f64) = (12, 0.012, 0.15);
/// Around how many places it is looked once more for each thing, how many steps to each side, and how long each is, m. Chosen:
/// 24 mm are what two places of the first round are apart, and 6 mm are 4 px of the half picture at a metre, from where a climb
/// of 8 mm comes to the top; with twice as many places this part takes as long as the first round.
const AROUND: (usize, i32, f64) = (3, 4, 0.006);
/// The candidates that come out.
pub(super) const FITTED: usize = 8;
/// First steps of the climbs, m and rad: half of [`GRID_M`] and [`GRID_YAW`], and at full size three times where that
/// climb ends (3 mm are 2.5 px of the kitchen's picture). In [`HALVINGS`] rounds, each with half the step, they come
/// down to 1 mm and 0.4 mm.
const CLIMB: (f64, f64) = (0.008, 0.12);
const LAST_CLIMB: (f64, f64) = (0.003, 0.03);
/// Halvings of a climb, and steps with one length: six of the first are three grid steps. Chosen: a climb that goes
/// farther has come to another place, which the grid has as well; with half of either a climb stops short of the top.
const HALVINGS: usize = 4;
const STEPS: usize = 6;
/// Points on each edge of the outline at the three scales: a point every 3 to 4 px of the full, half and quarter
/// picture for an edge of 55 px (65 mm in the kitchen). Neighbouring points share pixels below that; with half as
/// many a gap is overlooked.
const POINTS: [usize; 3] = [16, 8, 5];
/// How often a fit is repeated from its own result: the second time with the outline seen from there. Chosen: with
/// one the outline is that of a place some millimetres off; each more costs the same and starts nearer to its own
/// end.
const FITS: usize = 2;
/// How much of its score a fit may lose: moving edges are finer than the score, which is flat within some pixels
/// where edges are strong. Chosen: at 1 no fit of a sharp picture would be kept, at 0.84 one that has slipped to
/// another thing's edge is.
const LOSS: f64 = 0.92;

impl Evidence<'_> {
    /// Climbs from a candidate at half size, where scores of several solids are compared.
    pub fn nearby(&self, from: &Candidate) -> Candidate {
        self.climb(from, 1, POINTS[1], CLIMB)
    }

    /// Searches a window of the table; returns distinct candidates, best first: up to `FITTED` for each of the `n` things of
    /// this look that may be in view, and no more than that of one place, so that the turns and the surroundings of the one
    /// seen best do not crowd out the others. Once `is_stopped` the rest is left out, and what is returned is of no use.
    pub fn search(
        &self,
        window: &Window,
        n: usize,
        is_stopped: &(dyn Fn() -> bool + Sync),
    ) -> Searched {
        let symmetry = self.object.shape.symmetry();
        let place = self.object.shape.outer_radius();
        let distinct = |all: &[Candidate], kept| distinct(all, kept, symmetry, (n, place));
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
            .filter(|_| !is_stopped())
            .flat_map_iter(|&x| {
                let turns = move |y| (0..n_yaw).map(move |k| (y, k as f64 * GRID_YAW));
                steps(window.y).flat_map(turns).filter_map(move |(y, yaw)| {
                    let pose = ObjectPose::upright(x, y, 0.0, yaw);
                    let score = self.score_above(HOPELESS, &pose, 2, POINTS[2])?;
                    (score.total > HOPELESS).then_some(Candidate { x, y, yaw, score, fit: None })
                })
            })
            .collect();
        let coarse = distinct(&all, COARSE);
        let goes_on = |_: &&Candidate| !is_stopped();
        let climbed = coarse.par_iter().filter(goes_on);
        let finer: Vec<Candidate> = climbed.map(|c| self.climb(c, 1, POINTS[1], CLIMB)).collect();
        let alike = distinct(&finer, COARSE);
        let mut finer = distinct(&finer, FINER);
        if !matches!(self.object.shape, Shape::Cuboid { .. } | Shape::Cylinder { .. }) {
            finer.extend(self.looked_around(&finer, n));
            finer = distinct(&finer, FINER);
        }
        let fitted: Vec<Candidate> =
            finer.par_iter().filter(goes_on).map(|c| self.fit(c)).collect();
        Searched { best: distinct(&fitted, (FITTED, FINER.1, FINER.2)), alike }
    }

    /// Whether something is in front of a part of a candidate's outline.
    pub fn is_behind(&self, at: &Candidate) -> bool {
        let outline = self.outline(&at.pose(), POINTS[2]);
        let covered = |p| self.hidden.hulls.iter().any(|hull| inside_convex(hull, p));
        outline.samples.iter().any(|sample| covered(sample.pixel))
    }

    /// Returns the places around a candidate at any turn, its own among them, fitted to the full picture, best first: each that
    /// a fit comes to once.
    pub fn around(&self, from: &Candidate) -> Vec<Candidate> {
        let symmetry = self.object.shape.symmetry();
        let turns = self.looked_around(std::slice::from_ref(from), 1);
        let mut starts = distinct(&turns, FINER, symmetry, (1, 0.0));
        starts.push(*from);
        let mut fitted: Vec<Candidate> = starts.par_iter().map(|c| self.fit(c)).collect();
        fitted.sort_by(|a, b| b.worth().total_cmp(&a.worth()));
        let mut kept: Vec<Candidate> = Vec::new();
        for place in fitted {
            let is_same = |other: &Candidate| {
                place.distance(other) < LAST_CLIMB.0 && place.turned(other, symmetry) < LAST_CLIMB.1
            };
            if !kept.iter().any(is_same) {
                kept.push(place);
            }
        }
        kept
    }

    /// Looks around the best places once more, at half size and at every turn: what has round corners scores alike at any
    /// turn in the quarter picture, so that a wrong one may stand where the right one does not come to.
    fn looked_around(&self, places: &[Candidate], n: usize) -> Vec<Candidate> {
        let symmetry = self.object.shape.symmetry();
        let n_yaw = if symmetry > 0.0 { (symmetry / GRID_YAW).round() as usize } else { 1 };
        let one_each = distinct(
            places,
            (AROUND.0 * n, self.object.shape.outer_radius(), PI),
            symmetry,
            (1, 0.0),
        );
        let best_of = |place: &Candidate, yaw: f64| {
            let span = -AROUND.1..=AROUND.1;
            let all = span.clone().flat_map(|i| span.clone().map(move |j| (i, j)));
            let tried = all.map(|(i, j)| {
                let (x, y) = (place.x + AROUND.2 * f64::from(i), place.y + AROUND.2 * f64::from(j));
                let score = self.score(&ObjectPose::upright(x, y, 0.0, yaw), 1, POINTS[1]);
                Candidate { x, y, yaw, score, fit: None }
            });
            tried.max_by(|a, b| a.score.total.total_cmp(&b.score.total))
        };
        let turns = (0..n_yaw).map(|k| k as f64 * GRID_YAW);
        let starts: Vec<(&Candidate, f64)> =
            turns.flat_map(|yaw| one_each.iter().map(move |place| (place, yaw))).collect();
        let found = starts.par_iter().filter_map(|(place, yaw)| best_of(place, *yaw));
        found.map(|c| self.climb(&c, 1, POINTS[1], CLIMB)).collect()
    }

    /// Climbs to a nearby best score with halving steps.
    fn climb(
        &self,
        from: &Candidate,
        level: usize,
        per_edge: usize,
        (step, turn): (f64, f64),
    ) -> Candidate {
        let turns = self.object.shape.symmetry() > 0.0;
        let mut best = *from;
        best.score = self.score(&best.pose(), level, per_edge);
        let (mut step, mut turn) = (step, turn);
        for _ in 0..HALVINGS {
            for _ in 0..STEPS {
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
                    let least = next.score.total;
                    let score = self.score_above(least, &trial.pose(), level, per_edge);
                    if let Some(score) = score.filter(|score| score.total > least) {
                        trial.score = score;
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
        let mut best = self.climb(from, 0, POINTS[0], LAST_CLIMB);
        for _ in 0..FITS {
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
            next.score = self.score(&next.pose(), 0, POINTS[0]);
            next.fit = Some(fit);
            if next.score.total < LOSS * best.score.total {
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

/// Keeps the best candidates that differ by more than `apart` m or `turned` rad: `most` of them times the `n` things that are
/// looked for, and of each place, `wide` m, no more than `most`.
fn distinct(
    candidates: &[Candidate],
    (most, apart, turned): (usize, f64, f64),
    symmetry: f64,
    (n, wide): (usize, f64),
) -> Vec<Candidate> {
    // Candidates are long, and most are not even looked at.
    let mut order: Vec<(f64, usize)> =
        candidates.iter().enumerate().map(|(at, c)| (c.score.total, at)).collect();
    order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut kept: Vec<Candidate> = Vec::new();
    for (_, at) in order {
        let candidate = candidates[at];
        let same = |other: &Candidate| {
            candidate.distance(other) < apart && candidate.turned(other, symmetry) < turned
        };
        let is_crowded =
            n > 1 && kept.iter().filter(|k| k.distance(&candidate) < wide).count() >= most;
        if !is_crowded && !kept.iter().any(same) {
            kept.push(candidate);
            if kept.len() == most * n {
                break;
            }
        }
    }
    kept
}
