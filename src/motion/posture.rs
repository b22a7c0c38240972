//! The solids of a robot where a configuration puts them, with balls around them for a first look.
//!
//! What is rigid is placed once, when the robot or what it holds changes. A look at a configuration then moves
//! frames and solids in memory that is used again. Nothing here knows what may touch what.

use std::cell::Cell;
use std::ops::Range;

use nalgebra::Vector3;

use super::body::Body;
use super::frames::{Frame, Frames};

/// A middle and a radius, m.
pub(super) type Ball = (Vector3<f64>, f64);

/// Whether two balls are farther apart than `bound` m.
#[inline]
pub(super) fn are_apart(a: &Ball, b: &Ball, bound: f64) -> bool {
    let reach = a.1 + b.1 + bound;
    reach < 0.0 || (b.0 - a.0).norm_squared() > reach * reach * (1.0 + 1e-12)
}

/// The solids at one configuration, base coordinates.
#[derive(Debug, Default)]
pub(super) struct Posture {
    frames: Vec<Frame>,
    /// Every solid, part by part.
    pub(super) bodies: Vec<Body>,
    /// Balls around them.
    pub(super) balls: Vec<Ball>,
    /// Balls around all solids of each part.
    pub(super) wholes: Vec<Ball>,
}

thread_local! {
    /// Memory of the last look, used again: planning looks some ten thousand times a second.
    static LAST: Cell<Posture> = Cell::default();
}

/// One solid of a part, ready to be placed.
#[derive(Debug, Clone, Copy)]
struct Ready {
    /// The driven frame it is fixed to; `None` for the base.
    node: Option<usize>,
    /// In that frame.
    body: Body,
    /// Around it, in that frame.
    ball: Ball,
}

/// The solids of all parts, ready to be placed.
#[derive(Debug, Clone, Default)]
pub(super) struct Solids {
    frames: Frames,
    /// Part by part.
    all: Vec<Ready>,
    /// Where those of each part begin, and where the last end.
    first: Vec<usize>,
    /// Per part: the frame it is fixed to, and a ball around it in that frame.
    wholes: Vec<(Option<usize>, Ball)>,
}

impl Solids {
    /// Returns the solids of parts: of each the link it moves with, and its solids in the link's frame.
    pub(super) fn of<'p>(
        frames: &Frames,
        parts: impl Iterator<Item = (usize, &'p [Body])>,
    ) -> Self {
        let mut solids = Self { frames: frames.clone(), first: vec![0], ..Self::default() };
        for (link, bodies) in parts {
            let (node, node_from_link) = frames.links[link];
            let frame = Frame::of(&node_from_link);
            let ready = bodies.iter().map(|body| {
                let body = body.moved(&frame);
                Ready { node, body, ball: body.bounds() }
            });
            let from = solids.all.len();
            solids.all.extend(ready);
            solids.first.push(solids.all.len());
            solids.wholes.push((node, around(&solids.all[from..])));
        }
        solids
    }

    /// Returns which solids are those of a part.
    #[inline]
    pub(super) fn of_part(&self, part: usize) -> Range<usize> {
        self.first[part]..self.first[part + 1]
    }

    /// Places the solids at joint positions `q` and shows them to `look`.
    pub(super) fn at<T>(&self, q: &[f64], look: impl FnOnce(&Posture) -> T) -> T {
        let mut posture = LAST.take();
        self.frames.place(q, &mut posture.frames);
        posture.bodies.clear();
        posture.balls.clear();
        for solid in &self.all {
            let (centre, radius) = solid.ball;
            let Some(node) = solid.node else {
                posture.bodies.push(solid.body);
                posture.balls.push(solid.ball);
                continue;
            };
            let frame = &posture.frames[node];
            posture.bodies.push(solid.body.moved(frame));
            posture.balls.push((frame.point(&centre), radius));
        }
        posture.wholes.clear();
        for &(node, (centre, radius)) in &self.wholes {
            let centre = node.map_or(centre, |node| posture.frames[node].point(&centre));
            posture.wholes.push((centre, radius));
        }
        let seen = look(&posture);
        LAST.set(posture);
        seen
    }
}

/// Returns a ball around the balls of some solids.
fn around(solids: &[Ready]) -> Ball {
    let middle = solids.iter().map(|solid| solid.ball.0).sum::<Vector3<f64>>();
    let middle = middle / solids.len().max(1) as f64;
    let reach = solids.iter().map(|solid| (solid.ball.0 - middle).norm() + solid.ball.1);
    (middle, reach.fold(0.0, f64::max))
}
