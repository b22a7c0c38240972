//! When a curve is where: as fast as the speed, acceleration and jerk of every joint allow, from rest to rest.
//!
//! A curve of straight edges and rounded corners is timed edge by edge and corner by corner ([`super::passing`]); a corner that
//! then passes limits between the places where they were asked for is passed as much slower.
//!
//! Any other is the mean of a profile over a window of time. The profile of [`super::profile`] changes its acceleration at once; its
//! mean does so gradually, and follows the same curve: smoothing acts on how far along the arm is, not on where it goes. Where
//! a limit is then passed, the profile is made slower there, and only there.
//!
//! What little is left over a limit slows the whole. Every stretch of the result is a cubic in time along a polynomial. It is
//! looked at where its pieces meet, from both sides, and so often between that nothing grows by more than a stated margin.
//!
//! Source: smoothing by a moving average: Biagiotti and Melchiorri, "FIR filters for online trajectory planning
//! with time- and frequency-domain specifications", Control Engineering Practice 2012.

use super::curve::{At, Curve};
use super::passing::{Passing, Spans};
use super::polyline::mixed;
use super::profile::{Limits, Profile, Shape, fastest};

/// How often the profile is made slower where limits are passed. Chosen: twelve more gain less than 1 % of the duration
/// on random paths of two to nine corners.
const ROUNDS: usize = 4;

/// A motion that takes less than so many windows is tried with both. Chosen: there the window is a tenth of the time, and
/// which one is better shows only when what passes the limits is slowed; in longer motions the first look tells.
const SHORT: f64 = 20.0;

/// A share by which limits may be passed before another round is worth its time; the whole is slowed by it.
const NEARLY: f64 = 1.003;

/// How often corners that pass limits are looked at and made slower. Chosen: after the first time hardly any passes them.
const TRIES: usize = 3;

/// Looks at each span of constant jerk in a corner, besides the one at its start. Chosen with [`MARGIN`] on random paths: with three,
/// 45 of 600 with corners cut by 0.2 rad pass a limit of acceleration, by 0.1 %.
const LOOKS: f64 = 4.0;

/// Longest time between two looks elsewhere, s.
const LOOK: f64 = 0.01;

/// Between two looks speed, acceleration and jerk grow by no more than these factors. A speed bends away from a straight
/// line by an eighth of the jerk limit times [`LOOK`] squared, 0.05 % where full speed takes 0.25 s and full acceleration
/// 0.1 s; the others by what was measured on random paths (`tests/motion/trajectory.rs`).
const MARGIN: [f64; 3] = [1.001, 1.004, 1.01];

/// How far along a curve one is over time.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Timing {
    /// The mean of a profile over a window.
    Mean(Mean),
    /// Edge by edge and corner by corner.
    Spans(Spans),
}

impl Timing {
    /// Times a curve; also returns by how much the whole has to be slowed for the limits to hold (at least 1).
    pub(super) fn of(curve: &Curve, limits: &Limits) -> (Self, f64) {
        let over = |list: &[f64], margin: f64| list.iter().map(|x| x / margin).collect();
        let within = Limits {
            velocity: over(&limits.velocity, MARGIN[0]),
            acceleration: over(&limits.acceleration, MARGIN[1]),
            jerk: over(&limits.jerk, MARGIN[2]),
        };
        if let Some((spans, stretch)) = by_corners(curve, limits, &within) {
            return (Self::Spans(spans), stretch);
        }
        let (mean, stretch) = Mean::of(curve, limits);
        (Self::Mean(mean), stretch)
    }

    /// Returns how long it takes, s.
    pub(super) fn duration(&self) -> f64 {
        match self {
            Self::Mean(mean) => mean.duration(),
            Self::Spans(spans) => spans.duration(),
        }
    }

    /// Returns how far along the curve one is at `t`, and three rates of that.
    pub(super) fn along(&self, t: f64) -> [f64; 4] {
        match self {
            Self::Mean(mean) => mean.along(t),
            Self::Spans(spans) => spans.along(t),
        }
    }
}

/// Times a curve edge by edge and corner by corner, corners slower where they pass limits, if that can be.
fn by_corners(curve: &Curve, limits: &Limits, within: &Limits) -> Option<(Spans, f64)> {
    let mut passing = Passing::of(curve, within)?;
    let mut looks = Looks::new(curve, limits);
    let mut best: Option<(Spans, f64)> = None;
    for _ in 0..TRIES {
        let spans = passing.timed()?;
        looks.begin();
        let mut stretch = 1.0_f64;
        for k in 0..spans.len() {
            let passed = looks.span(&spans, k);
            stretch = stretch.max(passed);
            if passed > 1.0 {
                passing.exceeds(spans.piece(k), passed);
            }
        }
        if best.as_ref().is_none_or(|(best, by)| spans.duration() * stretch < best.duration() * by)
        {
            best = Some((spans, stretch));
        }
        if stretch < NEARLY {
            break;
        }
        passing.slow();
    }
    best
}

/// The mean of a profile over time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mean {
    profile: Profile,
    /// Time that the profile is averaged over, s.
    window: f64,
}

impl Mean {
    /// As [`Timing::of`].
    fn of(curve: &Curve, limits: &Limits) -> (Self, f64) {
        let shape = Shape::of(curve, limits);
        let mut looks = Looks::new(curve, limits);
        let rises = limits.acceleration.iter().zip(&limits.jerk).map(|(a, j)| a / j * MARGIN[2]);
        let rise = rises.fold(0.0, f64::max);
        let profile = fastest(&shape, limits, &vec![1.0; shape.len()]);
        let first = Round::of(Self { profile, window: rise }, &mut looks);
        if first.stretch < NEARLY {
            return (first.timing, first.stretch);
        }
        // In the longer window a push may turn into a brake at once, in the shorter one speeds are reached sooner.
        let longer = Self { window: 2.0 * rise, ..first.timing.clone() };
        let longer = Round::of(longer, &mut looks);
        let is_short = first.timing.duration() < SHORT * rise;
        let (likelier, other) =
            if longer.takes() < first.takes() { (longer, first) } else { (first, longer) };
        let mut slowed = |begin: Round| slower_where_passed(&shape, limits, &mut looks, begin);
        let mut best = slowed(likelier);
        if is_short {
            let other = slowed(other);
            if other.takes() < best.takes() {
                best = other;
            }
        }
        (best.timing, best.stretch)
    }

    /// Returns how long it takes, s.
    pub(super) fn duration(&self) -> f64 {
        self.profile.duration() + self.window
    }

    /// Returns how far along the curve one is at `t`, and three rates of that.
    pub(super) fn along(&self, t: f64) -> [f64; 4] {
        self.mean(self.profile.at(t), self.profile.at(t - self.window))
    }

    fn mean(&self, now: [f64; 4], then: [f64; 4]) -> [f64; 4] {
        std::array::from_fn(|i| (now[i] - then[i]) / self.window)
    }

    /// Returns by how much the whole has to be slowed for the limits to hold; raises `over` at each knot to how much it
    /// has to be slowed there.
    fn excess(&self, looks: &mut Looks, over: &mut [f64]) -> f64 {
        let times = self.profile.times();
        let last = times.len() - 1;
        let mut worst = 1.0_f64;
        // Knots that the profile has passed, and the profile a window ago: until either passes one more, the motion along
        // the curve is one cubic.
        let (mut now, mut then, mut t) = (1, 0, 0.0);
        looks.begin();
        while then <= last {
            let next_now = times.get(now).copied().unwrap_or(f64::INFINITY);
            let next_then = times[then] + self.window;
            let end = next_now.min(next_then);
            let rates = |t: f64| {
                self.mean(self.profile.after(now, t), self.profile.after(then, t - self.window))
            };
            let passed = looks.through(&rates, t, end);
            if passed > 1.0 {
                worst = worst.max(passed);
                for over in &mut over[then.saturating_sub(1)..=now.min(last)] {
                    *over = over.max(passed);
                }
            }
            t = end;
            now += usize::from(next_now <= end);
            then += usize::from(next_then <= end);
        }
        worst
    }
}

/// Makes a profile slower where limits are passed, some times over, and returns the best timing met.
fn slower_where_passed(shape: &Shape, limits: &Limits, looks: &mut Looks, begin: Round) -> Round {
    let mut pace = vec![1.0; shape.len()];
    let (mut over, mut stretch) = (begin.over.clone(), begin.stretch);
    let mut best = begin;
    for _ in 1..ROUNDS {
        if stretch < NEARLY {
            break;
        }
        for (pace, over) in pace.iter_mut().zip(&over) {
            *pace /= over;
        }
        let profile = fastest(shape, limits, &pace);
        let round = Round::of(Mean { profile, window: best.timing.window }, looks);
        over.clone_from(&round.over);
        stretch = round.stretch;
        if round.takes() < best.takes() {
            best = round;
        }
    }
    best
}

/// A timing that was looked at.
struct Round {
    timing: Mean,
    /// By how much the whole has to be slowed for the limits to hold, and each knot alone.
    stretch: f64,
    over: Vec<f64>,
}

impl Round {
    fn of(timing: Mean, looks: &mut Looks) -> Self {
        let mut over = vec![1.0; timing.profile.times().len()];
        let stretch = timing.excess(looks, &mut over);
        Self { timing, stretch, over }
    }

    /// How long the motion takes when it is slowed, s.
    fn takes(&self) -> f64 {
        self.timing.duration() * self.stretch
    }
}

/// Looks at a motion along a curve, from its start to its end.
struct Looks<'c> {
    curve: &'c Curve,
    /// One over each limit, times what the motion may grow by between two looks: speeds, accelerations, jerks.
    shares: [Vec<f64>; 3],
    /// The stretch of the curve that was looked at last.
    piece: usize,
    /// The shares of the limits that a unit of each rate takes, on a straight stretch.
    straight: Option<[f64; 3]>,
    /// How far along, how fast, and with what acceleration the look before was, and the curve there.
    before: [f64; 3],
    at: At,
}

impl<'c> Looks<'c> {
    fn new(curve: &'c Curve, limits: &Limits) -> Self {
        let over = |list: &[f64], margin: f64| list.iter().map(|x| margin / x).collect();
        let shares = [
            over(&limits.velocity, MARGIN[0]),
            over(&limits.acceleration, MARGIN[1]),
            over(&limits.jerk, MARGIN[2]),
        ];
        let at = At::new(limits.velocity.len());
        Self { curve, shares, piece: 0, straight: None, before: [0.0; 3], at }
    }

    fn begin(&mut self) {
        self.before = [0.0; 3];
        self.enter(0);
    }

    fn enter(&mut self, piece: usize) {
        self.piece = piece;
        self.curve.slopes(piece, self.curve.knots()[piece], &mut self.at);
        self.straight = self.curve.is_straight(piece).then(|| {
            self.shares.each_ref().map(|share| {
                self.at.dq.iter().zip(share).map(|(d, k)| d.abs() * k).fold(0.0, f64::max)
            })
        });
    }

    /// Returns by how much the whole would have to be slowed (at least 1) for the limits to hold from `from`, where the look
    /// before was, to `to`; in between the motion along the curve, and three rates of it, are a cubic in time.
    fn through(&mut self, rates: &impl Fn(f64) -> [f64; 4], from: f64, to: f64) -> f64 {
        let [s, v, a, jerk] = rates(to);
        // The jerk may have jumped since.
        let [_, v_from, a_from] = self.before;
        let mut passed = self.here([v_from, a_from, jerk]);
        if self.straight.is_some() && s < self.curve.knots()[self.piece + 1] {
            // Along what is straight the limits are passed most at the ends, or where the speed is highest.
            if a_from * a < 0.0 {
                let [_, highest, _, _] = rates(from + (to - from) * a_from / (a_from - a));
                passed = passed.max(self.here([highest, 0.0, jerk]));
            }
            self.before = [s, v, a];
            return passed.max(self.here([v, a, jerk]));
        }
        let steps = ((to - from) / LOOK).ceil().max(1.0);
        for k in 1..steps as usize {
            passed = passed.max(self.look(rates(from + (to - from) * k as f64 / steps)));
        }
        passed.max(self.look([s, v, a, jerk]))
    }

    /// As [`Self::through`], of a span of constant jerk on one stretch.
    fn span(&mut self, spans: &Spans, k: usize) -> f64 {
        let piece = spans.piece(k);
        if piece != self.piece {
            self.enter(piece);
        }
        let (from, to) = spans.times(k);
        let [_, v_from, a_from, jerk] = spans.on(k, from);
        let [_, v, a, _] = spans.on(k, to);
        if self.straight.is_some() {
            let mut passed = self.here([v_from, a_from, jerk]).max(self.here([v, a, jerk]));
            if a_from * a < 0.0 {
                let [_, highest, _, _] = spans.on(k, from - a_from / jerk);
                passed = passed.max(self.here([highest, 0.0, jerk]));
            }
            return passed;
        }
        // Where one span ends the next begins: the curve was evaluated there.
        let mut passed = self.here([v_from, a_from, jerk]);
        for n in 1..=LOOKS as usize {
            let [s, v, a, jerk] = spans.on(k, from + (to - from) * n as f64 / LOOKS);
            self.curve.slopes(piece, s, &mut self.at);
            passed = passed.max(self.here([v, a, jerk]));
        }
        passed
    }

    /// Looks at `s`, passed at these rates. Where the curve's stretches meet since the look before, both sides of that are
    /// looked at.
    fn look(&mut self, [s, v, a, jerk]: [f64; 4]) -> f64 {
        let mut passed = 1.0_f64;
        let knots = self.curve.knots();
        while self.piece + 2 < knots.len() && s >= knots[self.piece + 1] {
            let met = knots[self.piece + 1];
            let [far, fast, push] = self.before;
            let share = if s > far { ((met - far) / (s - far)).clamp(0.0, 1.0) } else { 1.0 };
            let then = [mixed(fast, v, share), mixed(push, a, share), jerk];
            self.curve.slopes(self.piece, met, &mut self.at);
            passed = passed.max(self.here(then));
            self.enter(self.piece + 1);
            passed = passed.max(self.here(then));
        }
        self.before = [s, v, a];
        self.curve.slopes(self.piece, s, &mut self.at);
        passed.max(self.here([v, a, jerk]))
    }

    /// Returns by how much the whole would have to be slowed (at least 1) where the curve was evaluated.
    fn here(&self, [v, a, j]: [f64; 3]) -> f64 {
        let [speed, acceleration, jerk] = match self.straight {
            Some(most) => [most[0] * v.abs(), most[1] * a.abs(), most[2] * j.abs()],
            None => self.bent([v, a, j]),
        };
        if speed <= 1.0 && acceleration <= 1.0 && jerk <= 1.0 {
            return 1.0;
        }
        let slower = speed.max(acceleration.sqrt());
        if jerk > slower.powi(3) { jerk.cbrt() } else { slower }
    }

    /// Returns the shares of the limits of speed, acceleration and jerk that are taken where the curve was evaluated.
    fn bent(&self, [v, a, j]: [f64; 3]) -> [f64; 3] {
        let At { dq, ddq, dddq, .. } = &self.at;
        let n = dq.len();
        let (dq, ddq, dddq) = (&dq[..n], &ddq[..n], &dddq[..n]);
        let [fast, push, turn] = self.shares.each_ref().map(|shares| &shares[..n]);
        let (vv, va, vvv) = (v * v, 3.0 * v * a, v * v * v);
        let mut most = [0.0_f64; 3];
        for i in 0..n {
            let shares = [
                (dq[i] * v).abs() * fast[i],
                (dq[i] * a + ddq[i] * vv).abs() * push[i],
                (dq[i] * j + ddq[i] * va + dddq[i] * vvv).abs() * turn[i],
            ];
            for (most, share) in most.iter_mut().zip(shares) {
                if share > *most {
                    *most = share;
                }
            }
        }
        most
    }
}

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// Corner by corner motions are quicker than averaged ones on all but a few paths, by a tenth in the mean.
    #[test]
    fn corner_by_corner_is_quicker() {
        let limits = Limits::new(vec![1.4; 7], vec![6.0; 7]);
        let mut random = StdRng::seed_from_u64(3);
        let (mut by_corner, mut averaged, mut quicker) = (0.0, 0.0, 0);
        for _ in 0..40 {
            let mut corner = || (0..7).map(|_| random.random_range(-1.0..1.0)).collect();
            let corners: Vec<Vec<f64>> = (0..5).map(|_| corner()).collect();
            let curve = Curve::rounded(&corners, &[0.0, 0.05, 0.05, 0.05, 0.0]);
            let (timing, stretch) = Timing::of(&curve, &limits);
            assert!(matches!(timing, Timing::Spans(_)) && stretch < NEARLY);
            let (mean, slower) = Mean::of(&curve, &limits);
            let [one, other] = [timing.duration() * stretch, mean.duration() * slower];
            by_corner += one;
            averaged += other;
            quicker += i32::from(one < other);
        }
        assert!(by_corner < 0.95 * averaged && quicker >= 38, "{by_corner} {averaged} {quicker}");
    }

    /// Where corners follow one another without a straight stretch between them, the mean takes over.
    #[test]
    fn corners_side_by_side_are_timed_too() {
        let limits = Limits::new(vec![1.0; 2], vec![3.0; 2]);
        let corners = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.2], [0.4, 0.2]].map(|q| q.to_vec());
        let curve = Curve::rounded(&corners, &[0.0, 0.1, 0.1, 0.0]);
        let (timing, stretch) = Timing::of(&curve, &limits);
        assert!(matches!(timing, Timing::Mean(_)));
        assert!(timing.duration() * stretch > 0.4);
    }
}
