//! Looks at a motion along a curve: by how much it would have to be slowed for the limits of its joints to hold.
//!
//! Four joints at once ([`super::slopes`]). Between two looks nothing grows by more than a stated margin. What is done about
//! limits that are passed is not decided here ([`super::timing`]).

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use super::curve::Curve;
use super::lanes::{Job, Wide, run};
use super::passing::{Passing, Spans};
use super::polyline::mixed;
use super::profile::{Limits, cube_root};
use super::quad::Quad;
use super::ramp::State;
use super::slopes::{Four, Slopes, in_fours};

/// Looks at each span of constant jerk in a corner, besides the one at its start. Chosen with [`MARGIN`] on random paths: with three,
/// 45 of 600 with corners cut by 0.2 rad pass a limit of acceleration, by 0.1 %.
const LOOKS: f64 = 4.0;

/// Longest time between two looks elsewhere, s.
const LOOK: f64 = 0.01;

/// Between two looks speed, acceleration and jerk grow by no more than these factors. A speed bends away from a straight
/// line by an eighth of the jerk limit times [`LOOK`] squared, 0.05 % where full speed takes 0.25 s and full acceleration
/// 0.1 s; the others by what was measured on random paths (`tests/motion/trajectory.rs`).
pub(super) const MARGIN: [f64; 3] = [1.001, 1.004, 1.01];

const REST: State = State { s: 0.0, v: 0.0, a: 0.0 };

/// Looks at a motion along a curve, from its start to its end.
pub(super) struct Looks<'s, 'c> {
    slopes: &'s Slopes<'c>,
    /// One over each limit, times what the motion may grow by between two looks: speeds, accelerations, jerks.
    shares: Vec<[Four; 3]>,
    /// The stretch of the curve that was looked at last.
    piece: usize,
    /// The shares of the limits that a unit of each rate takes, on a straight stretch.
    straight: Option<[f64; 3]>,
}

impl<'s, 'c> Looks<'s, 'c> {
    pub(super) fn new(slopes: &'s Slopes<'c>, limits: &Limits) -> Self {
        let over = |list: &[f64], margin: f64| in_fours(list.iter().map(|x| margin / x), 0.0);
        let [speeds, pushes, jerks] = [
            over(&limits.velocity, MARGIN[0]),
            over(&limits.acceleration, MARGIN[1]),
            over(&limits.jerk, MARGIN[2]),
        ];
        let shares = (0..speeds.len()).map(|k| [speeds[k], pushes[k], jerks[k]]).collect();
        Self { slopes, shares, piece: 0, straight: None }
    }

    /// Looks at the mean over `window` s of a profile, which passes its knots at `times` and has the accelerations `pushes` from
    /// each on. Returns by how much the whole has to be slowed; raises `over` at each knot to how much it has to be slowed there.
    pub(super) fn mean(
        &mut self,
        times: &[f64],
        pushes: &[f64],
        window: f64,
        over: &mut [f64],
    ) -> f64 {
        run(Mean { looks: self, times, pushes, window, over })
    }

    /// Looks at a curve that is timed edge by edge and corner by corner: as [`Self::mean`], and tells the corners.
    pub(super) fn spans(&mut self, spans: &Spans, passing: &mut Passing) -> f64 {
        run(Each { looks: self, spans, passing })
    }

    fn curve(&self) -> &'c Curve {
        self.slopes.curve()
    }

    #[inline(always)]
    fn enter<S: Wide>(&mut self, simd: S, piece: usize) {
        self.piece = piece;
        self.straight = None;
        if self.curve().is_straight(piece) {
            let mut most = [Quad::all(simd, 0.0); 3];
            let shares = &self.shares;
            let begin = self.curve().knots()[piece];
            self.slopes.at(
                simd,
                piece,
                begin,
                #[inline(always)]
                |k, [d, ..]| {
                    let each = shares[k].map(|share| d.abs() * Quad::of(simd, share));
                    for (most, each) in most.iter_mut().zip(each) {
                        *most = most.max(each);
                    }
                },
            );
            let [speed, push, jerk, _] =
                Quad::largest([most[0], most[1], most[2], most[2]]).lanes();
            self.straight = Some([speed, push, jerk]);
        }
    }

    /// Returns by how much the whole would have to be slowed (at least 1) at a place on the present stretch, passed with either of two
    /// jerks.
    #[inline(always)]
    fn here<S: Wide>(&self, simd: S, at: &State, jerks: [f64; 2]) -> [f64; 2] {
        let State { s, v, a } = *at;
        let shares = if let Some(most) = self.straight {
            let each = [most[0] * v, most[1] * a, most[2] * jerks[0], most[2] * jerks[1]];
            Quad::of(simd, each).abs()
        } else {
            self.bent(simd, (s, v, a), jerks)
        };
        if Quad::all(simd, 1.0).below(shares).is_nowhere() {
            [1.0; 2]
        } else {
            slower(shares.lanes())
        }
    }

    /// Returns the shares of the limits of speed, acceleration and jerk that are taken.
    #[inline(always)]
    fn bent<S: Wide>(&self, simd: S, (s, v, a): (f64, f64, f64), jerks: [f64; 2]) -> Quad<S> {
        let all = |x: f64| Quad::all(simd, x);
        let (fast, push, vv) = (all(v), all(a), all(v * v));
        let (va, vvv) = (all(3.0 * v * a), all(v * v * v));
        let jerks = jerks.map(all);
        let mut most = [all(0.0); 4];
        let shares = &self.shares;
        self.slopes.at(
            simd,
            self.piece,
            s,
            #[inline(always)]
            |k, [d, dd, ddd]| {
                let [speed, acceleration, jerk] = shares[k].map(|share| Quad::of(simd, share));
                let bends = dd * va + ddd * vvv;
                most[0] = most[0].max((d * fast).abs() * speed);
                most[1] = most[1].max((d * push + dd * vv).abs() * acceleration);
                most[2] = most[2].max((d * jerks[0] + bends).abs() * jerk);
                most[3] = most[3].max((d * jerks[1] + bends).abs() * jerk);
            },
        );
        Quad::largest(most)
    }

    /// Returns, where all the way to `to` is on the same straight stretch, by how much the whole would have to be slowed where the
    /// speed is highest: along what is straight the limits are passed most there or at the ends.
    fn straight_till(&self, to: &State, from: &State, jerk: f64) -> Option<f64> {
        let [most, ..] = self.straight?;
        if to.s >= self.curve().knots()[self.piece + 1] {
            return None;
        }
        let turns = from.a * to.a < 0.0;
        Some(if turns { most * from.after(-from.a / jerk, jerk).v.abs() } else { 1.0 })
    }

    /// Goes on to the stretch that `to` lies on; where stretches meet since `from`, both sides of that are looked at.
    #[inline(always)]
    fn cross<S: Wide>(&mut self, simd: S, from: &State, to: &State, jerk: f64) -> f64 {
        let mut passed = 1.0_f64;
        let knots = self.curve().knots();
        while self.piece + 2 < knots.len() && to.s >= knots[self.piece + 1] {
            let met = knots[self.piece + 1];
            let way = to.s - from.s;
            let share = if way > 0.0 { ((met - from.s) / way).clamp(0.0, 1.0) } else { 1.0 };
            let then =
                State { s: met, v: mixed(from.v, to.v, share), a: mixed(from.a, to.a, share) };
            for side in 0..2 {
                passed = passed.max(self.here(simd, &then, [jerk; 2])[0]);
                if side == 0 {
                    self.enter(simd, self.piece + 1);
                }
            }
        }
        passed
    }
}

/// Returns by how much all is to be slowed for these shares of the limits: of a speed, an acceleration and either of two jerks.
#[cold]
fn slower([speed, acceleration, first, second]: Four) -> [f64; 2] {
    let slower = speed.max(acceleration.sqrt()).max(1.0);
    [first, second].map(|jerk| if jerk > slower.powi(3) { cube_root(jerk) } else { slower })
}

/// [`Looks::mean`].
struct Mean<'l, 's, 'c> {
    looks: &'l mut Looks<'s, 'c>,
    times: &'l [f64],
    pushes: &'l [f64],
    window: f64,
    over: &'l mut [f64],
}

impl Job for Mean<'_, '_, '_> {
    type Found = f64;

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) -> f64 {
        let Self { looks, times, pushes, window, over } = self;
        let last = times.len() - 1;
        let push = |passed: usize| if passed == 0 { 0.0 } else { pushes[passed - 1] };
        let jerk_after = |now: usize, then: usize| (push(now) - push(then)) / window;
        let mut worst = 1.0_f64;
        // Knots that the profile has passed, and the profile a window ago: until either passes one more, the motion along
        // the curve is one cubic.
        let (mut now, mut then, mut t) = (1, 0, 0.0);
        let (mut at, mut jerk) = (REST, jerk_after(1, 0));
        looks.enter(simd, 0);
        let [_, mut passed] = looks.here(simd, &at, [0.0, jerk]);
        while then <= last {
            let knots = then.saturating_sub(1)..=now.min(last);
            let next_now = times.get(now).copied().unwrap_or(f64::INFINITY);
            let next_then = times[then] + window;
            let end = next_now.min(next_then);
            now += usize::from(next_now <= end);
            then += usize::from(next_then <= end);
            let jerk_then = if then > last { 0.0 } else { jerk_after(now.min(last + 1), then) };
            let (begin, takes) = (at, end - t);
            let mut steps = 1;
            if let Some(highest) = looks.straight_till(&begin.after(takes, jerk), &begin, jerk) {
                passed = passed.max(highest);
            } else if takes > LOOK {
                steps = (takes / LOOK).ceil() as usize;
            }
            let mut sides = [1.0; 2];
            for k in 1..=steps {
                let is_end = k == steps;
                let share = if is_end { takes } else { takes * k as f64 / steps as f64 };
                let next = begin.after(share, jerk);
                passed = passed.max(looks.cross(simd, &at, &next, jerk));
                // At the end the jerk jumps: both sides are looked at.
                sides = looks.here(simd, &next, [jerk, if is_end { jerk_then } else { jerk }]);
                passed = passed.max(sides[0]);
                at = next;
            }
            if passed > 1.0 {
                worst = worst.max(passed);
                for over in &mut over[knots] {
                    *over = over.max(passed);
                }
            }
            (t, jerk, passed) = (end, jerk_then, sides[1]);
        }
        worst
    }
}

/// [`Looks::spans`].
struct Each<'l, 's, 'c, 'p> {
    looks: &'l mut Looks<'s, 'c>,
    spans: &'l Spans,
    passing: &'l mut Passing<'p>,
}

impl Job for Each<'_, '_, '_, '_> {
    type Found = f64;

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) -> f64 {
        let Self { looks, spans, passing } = self;
        looks.enter(simd, 0);
        let mut worst = 1.0_f64;
        for k in 0..spans.len() {
            let piece = spans.piece(k);
            if piece != looks.piece {
                looks.enter(simd, piece);
            }
            let (begin, takes, jerk) = spans.span(k);
            let mut passed = looks.here(simd, &begin, [jerk; 2])[0];
            let steps = if looks.straight.is_some() { 1.0 } else { LOOKS };
            for n in 1..=steps as usize {
                let at = begin.after(takes * n as f64 / steps, jerk);
                passed = passed.max(looks.here(simd, &at, [jerk; 2])[0]);
                if let Some(highest) = looks.straight_till(&at, &begin, jerk) {
                    passed = passed.max(highest);
                }
            }
            if passed > 1.0 {
                worst = worst.max(passed);
                passing.exceeds(piece, passed);
            }
        }
        worst
    }
}
