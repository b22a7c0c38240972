//! A curve of straight edges and rounded corners, timed edge by edge and corner by corner.
//!
//! Corners come first, each as fast as its limits allow ([`super::passage`]); the straight stretches between lead from one to the
//! next ([`super::ramp`]). Where one is too short for that, the corners beside it are passed more steadily. Not every curve can be
//! timed so: [`super::timing`] has the way for the others.

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use super::curve::Curve;
use super::lanes::{Job, Wide, run};
use super::linear::Bounds;
use super::passage::Passage;
use super::ramp::{Along, Span, State};
use super::slopes::{Four, Slopes};

/// Lists of four bounds that a corner of an arm of seven or eight joints has, to ask for their memory at once.
const FOURS: usize = 84;
/// Shares of the best passage that are tried, where a straight stretch is too short. Chosen.
const SHARES: [f64; 5] = [1.0, 0.7, 0.4, 0.2, 0.0];

/// How far along a curve one is over time: spans of constant jerk.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Spans {
    /// When each begins, s, and where one is then; the end last.
    states: Vec<(f64, State)>,
    jerks: Vec<f64>,
    /// The stretch of the curve that each is on.
    pieces: Vec<usize>,
}

impl Spans {
    fn with_capacity(n: usize) -> Self {
        let rest = (0.0, State { s: 0.0, v: 0.0, a: 0.0 });
        let mut states = Vec::with_capacity(n + 1);
        states.push(rest);
        Self { states, jerks: Vec::with_capacity(n), pieces: Vec::with_capacity(n) }
    }

    /// Goes on for some spans on a stretch, from rest at first.
    fn go(&mut self, piece: usize, spans: &[Span]) {
        for &(t, jerk) in spans.iter().filter(|(t, _)| *t > 0.0) {
            let (time, state) = self.states[self.states.len() - 1];
            self.states.push((time + t, state.after(t, jerk)));
            self.jerks.push(jerk);
            self.pieces.push(piece);
        }
    }

    /// Returns which stretch of the curve a span is on.
    pub(super) fn piece(&self, span: usize) -> usize {
        self.pieces[span]
    }

    /// Returns how long it takes, s.
    pub(super) fn duration(&self) -> f64 {
        self.states.last().map_or(0.0, |(t, _)| *t)
    }

    /// Returns how many spans there are.
    pub(super) fn len(&self) -> usize {
        self.jerks.len()
    }

    /// Returns where a span begins, how long it takes, s, and its jerk.
    pub(super) fn span(&self, span: usize) -> (State, f64, f64) {
        let (begin, state) = self.states[span];
        (state, self.states[span + 1].0 - begin, self.jerks[span])
    }

    /// Returns how far along the curve one is at `t`, and three rates of that.
    pub(super) fn along(&self, t: f64) -> [f64; 4] {
        let passed = self.states.partition_point(|(begin, _)| *begin <= t);
        let span = passed.clamp(1, self.len()) - 1;
        let (begin, state) = self.states[span];
        let State { s, v, a } = state.after(t - begin, self.jerks[span]);
        [s, v, a, self.jerks[span]]
    }
}

/// A curve of edges and corners that is being timed.
pub(super) struct Passing<'c> {
    curve: &'c Curve,
    edges: Vec<Along>,
    corners: Vec<Passage>,
}

impl<'c> Passing<'c> {
    /// Finds how each corner is passed, if the curve is one of edges and corners in turn; `per` has one over each limit of four joints:
    /// speeds, accelerations, jerks.
    pub(super) fn of(slopes: &Slopes<'c>, per: &[[Four; 3]]) -> Option<Self> {
        let curve = slopes.curve();
        let pieces = curve.knots().len() - 1;
        if pieces.is_multiple_of(2) || (0..pieces).any(|k| curve.is_straight(k) == (k % 2 == 1)) {
            return None;
        }
        Some(run(Pass { slopes, per }))
    }

    /// Takes note that limits are passed on a stretch, where all is to be so many times as slow.
    pub(super) fn exceeds(&mut self, piece: usize, factor: f64) {
        if let Some(corner) = self.corners.get_mut(piece / 2).filter(|_| piece % 2 == 1) {
            corner.excess = corner.excess.max(factor);
        }
    }

    /// Passes corners on which limits are passed as much slower.
    pub(super) fn slow(&mut self) {
        for corner in &mut self.corners {
            corner.slower *= corner.excess;
            corner.excess = 1.0;
        }
    }

    /// Returns the whole, or nothing where a straight stretch is too short for any of it.
    pub(super) fn timed(&mut self) -> Option<Spans> {
        // Every edge may ask for every share.
        for _ in 0..SHARES.len() * self.edges.len() {
            let edge = match joined(self.curve, &self.edges, &self.corners) {
                Ok(spans) => return Some(spans),
                Err(edge) => edge,
            };
            let mut is_last = true;
            for corner in [edge.checked_sub(1), Some(edge)].into_iter().flatten() {
                let Some(corner) = self.corners.get_mut(corner) else { continue };
                if let Some(next) = SHARES.iter().find(|share| **share < corner.share) {
                    (corner.share, is_last) = (*next, false);
                }
            }
            if is_last {
                break;
            }
        }
        None
    }
}

/// [`Passing::of`], of a curve of edges and corners.
struct Pass<'s, 'c> {
    slopes: &'s Slopes<'c>,
    per: &'s [[Four; 3]],
}

impl<'c> Job for Pass<'_, 'c> {
    type Found = Passing<'c>;

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) -> Passing<'c> {
        let Self { slopes, per } = self;
        let curve = slopes.curve();
        let knots = curve.knots();
        let edges: Vec<Along> = (0..knots.len() - 1)
            .step_by(2)
            .map(|k| {
                let [v, a, j] = slopes.on(k).most(simd, knots[k], per, |[d, ..]| [d; 3]);
                Along { v: v.recip(), a: a.recip(), j: j.recip() }
            })
            .collect();
        let highest = |k: usize| {
            let size = knots[2 * k + 1] - knots[2 * k];
            (edges[k], edges[k].v.min((edges[k].a * size).sqrt()))
        };
        let mut bounds = Bounds::with_capacity(FOURS);
        let mut corners = Vec::with_capacity(edges.len());
        for k in 1..edges.len() {
            let sides = [highest(k - 1), highest(k)];
            corners.push(Passage::of(simd, (slopes, 2 * k - 1), per, sides, &mut bounds));
        }
        Passing { curve, edges, corners }
    }
}

/// Joins corners by edges; or says which edge is too short.
fn joined(curve: &Curve, edges: &[Along], corners: &[Passage]) -> Result<Spans, usize> {
    let mut spans = Spans::with_capacity(20 * edges.len());
    let mut from = (0.0, 0.0);
    let mut passing = Vec::new();
    for (k, edge) in edges.iter().enumerate() {
        let to = corners.get(k).map_or((0.0, 0.0), Passage::begins);
        let length = curve.knots()[2 * k + 1] - curve.knots()[2 * k];
        spans.go(2 * k, &edge.between(from, to, length).ok_or(k)?);
        if let Some(corner) = corners.get(k) {
            passing.clear();
            from = corner.spans(&mut passing);
            spans.go(2 * k + 1, &passing);
        }
    }
    Ok(spans)
}
