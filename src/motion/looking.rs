//! One look at eight configurations: which of them are nearer to something than asked for, or may be.
//!
//! What the robot and the obstacles are is [`super::batch`]'s. Where a stretch of the way is looked at whole, spheres follow
//! their tangents as far as they lead towards an obstacle ([`super::beyond`]), and two parts move against each other only by
//! the joints between them.

#![expect(clippy::inline_always, reason = "what is not inlined into the look misses the registers")]

use pulp::f32x8;

use super::batch::{Batch, Part, Question};
use super::beyond::beyond_swept;
use super::frames8::{Placed8, carried, place};
use super::lanes::{Eight, Job, LANES, Three, Vectors, Wide, packed};

/// Memory of the last look, used again.
#[derive(Debug, Default)]
pub(super) struct Work {
    placed: Placed8,
    /// Of each part: the middle of its ball.
    balls: Vec<Vectors>,
    near: Vec<u32>,
    /// Middles of spheres of a part, and their radii.
    ends: Vec<(Vectors, f32)>,
    /// The part that was the last to be too near something: it is looked at first, since what comes next often is so as well.
    first: usize,
}

/// A question about a robot among obstacles, and memory to answer it in.
pub(super) struct Looking<'a> {
    pub(super) batch: &'a Batch,
    pub(super) question: &'a Question<'a>,
    pub(super) work: &'a mut Work,
}

impl Job for Looking<'_> {
    type Found = u8;

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) -> u8 {
        let Self { batch, question, work } = self;
        let sweeps = !question.bends.is_empty();
        let ends = (question.from, question.to);
        place(simd, &batch.joints, ends, &question.at, sweeps, &mut work.placed);
        let frames = &work.placed.frames;
        let room = Eight::all(simd, question.room as f32 + batch.slack);
        let half = Eight::of(simd, packed(&question.half));
        let mut found = 0;
        let n = batch.parts.len();
        work.balls.resize(n, [f32x8(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0); 3]);
        let first = work.first;
        // From the hand backwards: what is far out collides first.
        let others = (0..n).rev().filter(|at| *at != first);
        for at in (first..n).take(1).chain(others) {
            let part = &batch.parts[at];
            let ball = carried(simd, frames, part.node, part.ball.centre);
            let moving = Moving::of(simd, &work.placed, part.node);
            work.balls[at] = ball.lanes();
            let mut room = room;
            let mut grown = Eight::all(simd, 0.0);
            if sweeps {
                let bend = Eight::all(simd, 0.5 * question.bends[at] as f32);
                room = room + half * half * bend;
                let turning = moving.turning.norm() * Eight::all(simd, part.spread);
                grown = half * (moving.at(ball).norm() + turning);
            }
            let reach = room + grown + Eight::all(simd, part.ball.radius);
            Self::near(batch, simd, part, ball, reach, &mut work.near);
            if work.near.is_empty() {
                continue;
            }
            for sphere in &batch.spheres[part.spheres.clone()] {
                let centre = carried(simd, frames, part.node, sphere.centre);
                let reach = room + Eight::all(simd, sphere.radius);
                let mut gap = Eight::all(simd, f32::INFINITY);
                if sweeps {
                    let speed = moving.at(centre);
                    for &thing in &work.near {
                        let thing = &batch.things[thing as usize];
                        gap = gap.min(thing.beyond_swept(simd, (centre, speed), reach, half));
                    }
                } else {
                    for &thing in &work.near {
                        gap = gap.min(batch.things[thing as usize].beyond(simd, centre, reach));
                    }
                }
                let flagged = gap.below_zero();
                if flagged != 0 {
                    found |= flagged;
                    work.first = at;
                    if !question.all {
                        return found;
                    }
                }
            }
        }
        found | Looking { batch, question, work }.pairs(simd, room, half)
    }
}

impl Looking<'_> {
    /// Finds the obstacles that a part's ball, so much larger, is near in any of eight configurations.
    #[inline(always)]
    fn near<S: Wide>(
        batch: &Batch,
        simd: S,
        part: &Part,
        ball: Three<S>,
        reach: Eight<S>,
        near: &mut Vec<u32>,
    ) {
        near.clear();
        let most = reach.most();
        let axes = [ball.x, ball.y, ball.z];
        let low = axes.map(|x| Eight::all(simd, x.least() - most));
        let high = axes.map(|x| Eight::all(simd, x.most() + most));
        for (eight, (ends, mask)) in batch.boxes.iter().zip(&part.masks).enumerate() {
            let mut overlap = Eight::all(simd, f32::INFINITY);
            for axis in 0..3 {
                overlap = overlap.min(high[axis] - Eight::of(simd, ends[axis]));
                overlap = overlap.min(Eight::of(simd, ends[3 + axis]) - low[axis]);
            }
            let mut left = mask & !overlap.below_zero();
            while left != 0 {
                let place = eight * LANES + left.trailing_zeros() as usize;
                left &= left - 1;
                if batch.things[place].beyond(simd, ball, reach).below_zero() != 0 {
                    near.push(place as u32);
                }
            }
        }
    }

    /// Returns a bit for each configuration in which parts that must not touch each other are too near.
    #[inline(always)]
    fn pairs<S: Wide>(self, simd: S, room: Eight<S>, half: Eight<S>) -> u8 {
        let Self { batch, question, work } = self;
        let Work { placed, balls, ends, .. } = work;
        let frames = &placed.frames;
        let sweeps = !question.bends.is_empty();
        let mut found = 0;
        for (at, pair) in batch.pairs.iter().enumerate() {
            let (a, b) = (&batch.parts[pair.first], &batch.parts[pair.second]);
            let (middle, other) = (balls[pair.first], balls[pair.second]);
            let (middle, other) = (Three::of(simd, middle), Three::of(simd, other));
            let mut room = room;
            let mut grown = Eight::all(simd, 0.0);
            if sweeps {
                let bend = 0.5 * question.bends[batch.parts.len() + at] as f32;
                room = room + half * half * Eight::all(simd, bend);
                // What moves both moves neither towards the other.
                let fixed = Moving::of(simd, placed, pair.shared);
                for (part, ball) in [(a, middle), (b, other)] {
                    let own = Moving::of(simd, placed, part.node);
                    let speed = own.at(ball) - fixed.at(ball);
                    let turning = (own.turning - fixed.turning).norm();
                    grown = grown + half * (speed.norm() + turning * Eight::all(simd, part.spread));
                }
            }
            let reach = room + grown + Eight::all(simd, a.ball.radius + b.ball.radius);
            if apart(middle, other, reach).below_zero() == 0 {
                continue;
            }
            // First the part of fewer spheres: of it only what is near the other one's ball.
            let (a, b, middle, other) = if a.spheres.len() < b.spheres.len() {
                (b, a, other, middle)
            } else {
                (a, b, middle, other)
            };
            ends.clear();
            for sphere in &batch.spheres[b.spheres.clone()] {
                let centre = carried(simd, frames, b.node, sphere.centre);
                let radius = Eight::all(simd, sphere.radius + a.ball.radius);
                if apart(centre, middle, room + grown + radius).below_zero() != 0 {
                    ends.push((centre.lanes(), sphere.radius));
                }
            }
            if ends.is_empty() {
                continue;
            }
            let own = Moving::of(simd, placed, a.node);
            let others = Moving::of(simd, placed, b.node);
            for sphere in &batch.spheres[a.spheres.clone()] {
                let centre = carried(simd, frames, a.node, sphere.centre);
                let reach = room + Eight::all(simd, sphere.radius);
                let whole = reach + grown + Eight::all(simd, b.ball.radius);
                if apart(centre, other, whole).below_zero() == 0 {
                    continue;
                }
                for &(end, radius) in &*ends {
                    let end = Three::of(simd, end);
                    let reach = reach + Eight::all(simd, radius);
                    let gap = if sweeps {
                        let (between, speed) = (centre - end, own.at(centre) - others.at(end));
                        beyond_swept(between.dot(between), between.dot(speed), reach, half)
                    } else {
                        apart(centre, end, reach)
                    };
                    found |= gap.below_zero();
                    if found != 0 && !question.all {
                        return found;
                    }
                }
            }
        }
        found
    }
}

/// How a frame moves, for the whole way: the speed of its origin, m, and that of its turning, rad.
#[derive(Clone, Copy)]
struct Moving<S: Wide> {
    origin: Three<S>,
    speed: Three<S>,
    turning: Three<S>,
}

impl<S: Wide> Moving<S> {
    /// Returns how a frame moves; without one, or where speeds are not known, it stands still.
    #[inline(always)]
    fn of(simd: S, placed: &Placed8, node: Option<usize>) -> Self {
        let still = Three::all(simd, [0.0; 3]);
        match node {
            Some(node) if !placed.speeds.is_empty() => {
                let [speed, turning] = placed.speeds[node];
                let (speed, turning) = (Three::of(simd, speed), Three::of(simd, turning));
                Self { origin: Three::of(simd, placed.frames[node][3]), speed, turning }
            }
            _ => Self { origin: still, speed: still, turning: still },
        }
    }

    /// Returns the speed of a point that moves with the frame, m for the whole way.
    #[inline(always)]
    fn at(&self, point: Three<S>) -> Three<S> {
        self.speed + self.turning.cross(point - self.origin)
    }
}

/// Returns by how much the squared distance of two points exceeds that of `reach`.
#[inline(always)]
fn apart<S: Wide>(a: Three<S>, b: Three<S>, reach: Eight<S>) -> Eight<S> {
    let between = a - b;
    between.dot(between) - reach * reach
}
