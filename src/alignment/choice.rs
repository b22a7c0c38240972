//! Which thing stands at which of the places that look like it: one place or none for each, so that no two share space.
//!
//! In come the candidates of [`super::placement`], out comes the consistent choice with the largest sum of scores, found by branch
//! and bound. How places are found and scored is not known here.

use nalgebra::Vector2;

use super::placement::{Candidate, FITTED};
use crate::world::Object;

/// How many candidates of each object are tried for a consistent choice, best first. Several of one look share a longer list,
/// whose end only says how unsure they are: with all of it what is absent took the place of a bottle, and the bottle one of
/// its own look-alikes, since two poor places count for more than one good one.
const CHOICES: usize = FITTED;
/// How much two things may overlap, m. Chosen: things are placed within 0.1 to 5 mm (`docs/results.md`), so that what
/// stands side by side may be seen a little into each other. With half of it things that touch exclude each other;
/// twice as much lets two things stand where hardly one does.
const SLACK_M: f64 = 0.003;
/// Corners of the polygon that stands for a circle there: inside it by 0.9 % of the radius, 0.7 mm of a cup.
const CIRCLE: usize = 24;

/// Says whether two things, each by its number and where it would be, cannot both be there.
pub type Conflict<'a> = dyn Fn((usize, &Candidate), (usize, &Candidate)) -> bool + 'a;

/// A choice that is being made, one thing after the other.
struct Choice<'a> {
    candidates: &'a [Vec<Candidate>],
    bar: f64,
    conflict: &'a Conflict<'a>,
    /// The most that this thing and those after it can add.
    ahead: Vec<f64>,
    chosen: Vec<Option<usize>>,
    best: (f64, Vec<Option<usize>>),
}

impl Choice<'_> {
    fn go(&mut self, sum: f64) {
        let at = self.chosen.len();
        if at == self.candidates.len() {
            if sum > self.best.0 {
                self.best = (sum, self.chosen.clone());
            }
            return;
        }
        // What cannot become the best is not gone through.
        if sum + self.ahead[at] <= self.best.0 {
            return;
        }
        for (idx, candidate) in self.candidates[at].iter().enumerate().take(CHOICES) {
            let free = self.chosen.iter().enumerate().all(|(other, choice)| {
                choice.is_none_or(|c| {
                    !(self.conflict)((at, candidate), (other, &self.candidates[other][c]))
                })
            });
            if free && candidate.score.total > self.bar {
                self.chosen.push(Some(idx));
                self.go(sum + candidate.score.total);
                self.chosen.pop();
            }
        }
        self.chosen.push(None);
        self.go(sum + self.bar);
        self.chosen.pop();
    }
}

/// Chooses one candidate (or none) for each object so that no two are in `conflict` and the sum of the
/// scores is largest. `None` costs `bar`, the score below which nothing is believed.
pub fn assign(candidates: &[Vec<Candidate>], bar: f64, conflict: &Conflict) -> Vec<Option<usize>> {
    let most = |all: &Vec<Candidate>| all.iter().map(|c| c.score.total).fold(bar, f64::max);
    let mut ahead = vec![0.0; candidates.len()];
    let mut sum = 0.0;
    for (at, all) in candidates.iter().enumerate().rev() {
        sum += most(all);
        ahead[at] = sum;
    }
    let best = (f64::NEG_INFINITY, vec![None; candidates.len()]);
    let mut choice = Choice { candidates, bar, conflict, ahead, chosen: Vec::new(), best };
    choice.go(0.0);
    choice.best.1
}

/// Returns whether two standing objects would share space, by more than `SLACK_M` of measurement error.
pub fn overlap(a: &Object, at: &Candidate, b: &Object, bt: &Candidate) -> bool {
    let footprint = |object: &Object, c: &Candidate| -> Vec<Vector2<f64>> {
        let (centre, turn) = (Vector2::new(c.x, c.y), nalgebra::Rotation2::new(c.yaw));
        let corners = object.shape.footprint(CIRCLE).into_iter();
        corners.map(|corner| centre + turn * corner).collect()
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
