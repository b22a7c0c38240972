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
use super::slopes::{Four, On, Slopes, in_fours};

/// Looks at each span of constant jerk in a corner, besides the one at its start. Chosen with [`MARGIN`] on random paths: with three,
/// 45 of 600 with corners cut by 0.2 rad pass a limit of acceleration, by 0.1 %.
const LOOKS: u32 = 4;

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
    /// The stretch of the curve that was looked at last, where the next begins if there is one, and its derivatives.
    piece: usize,
    end: f64,
    on: On<'s>,
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
        Self { slopes, shares, piece: 0, end: 0.0, on: slopes.on(0), straight: None }
    }

    /// Looks at the mean over `window` s of a profile, which passes its knots at `times` and has the accelerations `pushes` from
    /// each on, none from the last on. Returns by how much the whole has to be slowed; raises `over` at each knot to how much it
    /// has to be slowed there. Ends early where it is by more than `enough`.
    pub(super) fn mean(
        &mut self,
        (times, pushes): (&[f64], &[f64]),
        window: f64,
        enough: f64,
        over: &mut [f64],
    ) -> f64 {
        run(Mean { looks: self, times, pushes, window, enough, over })
    }

    /// Looks at a curve that is timed edge by edge and corner by corner: as [`Self::mean`], and tells the corners.
    pub(super) fn spans(&mut self, spans: &Spans, passing: &mut Passing) -> f64 {
        run(Each { looks: self, spans, passing })
    }

    /// Returns one over each limit of four joints, times what the motion may grow by between two looks: speeds, accelerations, jerks.
    pub(super) fn shares(&self) -> &[[Four; 3]] {
        &self.shares
    }

    fn curve(&self) -> &'c Curve {
        self.slopes.curve()
    }

    #[inline(always)]
    fn enter<S: Wide>(&mut self, simd: S, piece: usize) {
        let knots = self.curve().knots();
        let is_last = piece + 2 == knots.len();
        (self.piece, self.on) = (piece, self.slopes.on(piece));
        self.end = if is_last { f64::INFINITY } else { knots[piece + 1] };
        self.straight = None;
        if self.curve().is_straight(piece) {
            let most = self.on.most(simd, knots[piece], &self.shares, |[d, ..]| [d; 3]);
            self.straight = Some(most);
        }
    }

    /// Returns the shares of the limits that are taken at a place on the present stretch: of speed and acceleration, and of jerk with
    /// either of two.
    #[inline(always)]
    fn here<S: Wide>(&self, simd: S, at: &State, jerks: [f64; 2]) -> Quad<S> {
        let State { s, v, a } = *at;
        match self.straight {
            Some(most) => {
                let each = [most[0] * v, most[1] * a, most[2] * jerks[0], most[2] * jerks[1]];
                Quad::of(simd, each).abs()
            }
            None => self.bent(simd, (s, v, a), jerks),
        }
    }

    /// As [`Self::here`], where the stretch is not straight.
    #[inline(always)]
    fn bent<S: Wide>(&self, simd: S, (s, v, a): (f64, f64, f64), jerks: [f64; 2]) -> Quad<S> {
        let all = |x: f64| Quad::all(simd, x);
        let (fast, push, vv) = (all(v), all(a), all(v * v));
        let (va, vvv) = (all(3.0 * v * a), all(v * v * v));
        let jerks = [all(jerks[0]), all(jerks[1])];
        let mut most = [all(0.0); 4];
        let shares = &self.shares;
        self.on.at(
            simd,
            s,
            #[inline(always)]
            |k, [d, dd, ddd]| {
                let [speed, acceleration, jerk] = shares[k];
                let (speed, acceleration) = (Quad::of(simd, speed), Quad::of(simd, acceleration));
                let jerk = Quad::of(simd, jerk);
                let bends = dd * va + ddd * vvv;
                most[0] = most[0].max((d * fast).abs() * speed);
                most[1] = most[1].max((d * push + dd * vv).abs() * acceleration);
                most[2] = most[2].max((d * jerks[0] + bends).abs() * jerk);
                most[3] = most[3].max((d * jerks[1] + bends).abs() * jerk);
            },
        );
        Quad::largest(most)
    }

    /// Returns, where all the way to `to` is on the same straight stretch, the share of the limit that the highest speed takes if that is
    /// between the ends: along what is straight the limits are passed most there or at the ends.
    #[inline(always)]
    fn straight_till(&self, to: &State, from: &State, jerk: f64) -> Option<f64> {
        let [most, ..] = self.straight.filter(|_| to.s < self.end)?;
        let turns = from.a * to.a < 0.0;
        Some(if turns { most * from.after(-from.a / jerk, jerk).v.abs() } else { 0.0 })
    }

    /// Goes on to the stretch that `to` lies on; where stretches meet since `from`, both sides of that are looked at.
    #[inline(always)]
    fn cross<S: Wide>(
        &mut self,
        simd: S,
        (from, to): (&State, &State),
        jerk: f64,
        mut most: Quad<S>,
    ) -> Quad<S> {
        while to.s >= self.end {
            let (met, way) = (self.end, to.s - from.s);
            let share = if way > 0.0 { ((met - from.s) / way).clamp(0.0, 1.0) } else { 1.0 };
            let then =
                State { s: met, v: mixed(from.v, to.v, share), a: mixed(from.a, to.a, share) };
            most = most.max(self.here(simd, &then, [jerk; 2]));
            self.enter(simd, self.piece + 1);
            most = most.max(self.here(simd, &then, [jerk; 2]));
        }
        most
    }
}

/// Returns the shares that are taken at a place as the way goes on from there, with the second of both jerks.
#[inline(always)]
fn onward<S: Wide>(shares: Quad<S>) -> Quad<S> {
    let [speed, acceleration, _, jerk] = shares.lanes();
    Quad::of(shares.simd(), [speed, acceleration, jerk, jerk])
}

/// Returns by how much all is to be slowed (at least 1) for the largest shares of the limits met up to a place: of speed, acceleration
/// and jerk; the last, of the jerk from there on, does not count.
#[inline(always)]
fn slower<S: Wide>(most: Quad<S>) -> f64 {
    const COUNT: u8 = 0b0111;
    if Quad::all(most.simd(), 1.0).below(most).bits() & COUNT == 0 {
        return 1.0;
    }
    let [speed, acceleration, jerk, _] = most.lanes();
    let slower = speed.max(acceleration.sqrt()).max(1.0);
    if jerk > slower.powi(3) { cube_root(jerk) } else { slower }
}

/// [`Looks::mean`].
struct Mean<'l, 's, 'c> {
    looks: &'l mut Looks<'s, 'c>,
    times: &'l [f64],
    pushes: &'l [f64],
    window: f64,
    enough: f64,
    over: &'l mut [f64],
}

impl Job for Mean<'_, '_, '_> {
    type Found = f64;

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) -> f64 {
        let Self { looks, times, pushes, window, enough, over } = self;
        let (last, per) = (times.len() - 1, window.recip());
        let push = |passed: usize| if passed == 0 { 0.0 } else { pushes[passed - 1] };
        let mut worst = 1.0_f64;
        // Knots that the profile has passed, and the profile a window ago: until either passes one more, the motion along
        // the curve is one cubic.
        let (mut now, mut then, mut t) = (1, 0, 0.0);
        let (mut at, mut jerk) = (REST, push(now) * per);
        looks.enter(simd, 0);
        let mut most = looks.here(simd, &at, [jerk; 2]);
        while then <= last && worst <= enough {
            let knots = then.saturating_sub(1)..=now.min(last);
            let next_now = times.get(now).copied().unwrap_or(f64::INFINITY);
            let next_then = times[then] + window;
            let end = if next_now < next_then { next_now } else { next_then };
            // Which of them comes first is as good as chance: no branch would foretell it.
            now += usize::from(next_now <= end);
            then += usize::from(next_then <= end);
            let next_jerk = (push(now) - push(then)) * per;
            let takes = end - t;
            let to = at.after(takes, jerk);
            if let Some(peak) = looks.straight_till(&to, &at, jerk) {
                most = most.max(Quad::of(simd, [peak, 0.0, 0.0, 0.0]));
            } else if takes > LOOK {
                let (begin, steps) = (at, (takes / LOOK).ceil() as usize);
                for k in 1..steps {
                    let between = begin.after(takes * k as f64 / steps as f64, jerk);
                    most = looks.cross(simd, (&at, &between), jerk, most);
                    most = most.max(looks.here(simd, &between, [jerk; 2]));
                    at = between;
                }
            }
            most = looks.cross(simd, (&at, &to), jerk, most);
            // At the end the jerk jumps: both sides are looked at.
            let sides = looks.here(simd, &to, [jerk, next_jerk]);
            let passed = slower(most.max(sides));
            if passed > 1.0 {
                worst = worst.max(passed);
                for over in &mut over[knots] {
                    *over = if passed > *over { passed } else { *over };
                }
            }
            (t, at, jerk, most) = (end, to, next_jerk, onward(sides));
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
        let (mut worst, mut onwards) = (1.0_f64, Quad::all(simd, 0.0));
        for k in 0..spans.len() {
            let piece = spans.piece(k);
            if piece != looks.piece {
                looks.enter(simd, piece);
            }
            let (begin, takes, jerk) = spans.span(k);
            // The end of a span is the start of the next, which has another jerk.
            let is_seen = k > 0 && spans.piece(k - 1) == piece;
            let next = if k + 1 < spans.len() { spans.span(k + 1).2 } else { 0.0 };
            let mut most = if is_seen { onwards } else { looks.here(simd, &begin, [jerk; 2]) };
            let steps = if looks.straight.is_some() { 1 } else { LOOKS };
            for n in 1..=steps {
                let at = begin.after(takes * f64::from(n) / f64::from(steps), jerk);
                let sides = looks.here(simd, &at, [jerk, next]);
                (most, onwards) = (most.max(sides), onward(sides));
                if let Some(peak) = looks.straight_till(&at, &begin, jerk) {
                    most = most.max(Quad::of(simd, [peak, 0.0, 0.0, 0.0]));
                }
            }
            let passed = slower(most);
            if passed > 1.0 {
                worst = worst.max(passed);
                passing.exceeds(piece, passed);
            }
        }
        worst
    }
}
