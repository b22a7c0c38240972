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
//! looked at ([`super::looks`]) where its pieces meet, from both sides, and so often between that nothing grows by more than a
//! stated margin.
//!
//! Source: smoothing by a moving average: Biagiotti and Melchiorri, "FIR filters for online trajectory planning
//! with time- and frequency-domain specifications", Control Engineering Practice 2012.

use super::curve::Curve;
use super::looks::{Looks, MARGIN};
use super::passing::{Passing, Spans};
use super::profile::{Limits, Profile, Shape, fastest};
use super::slopes::Slopes;

/// How often the profile is made slower where limits are passed. Chosen: twelve more gain less than 1 % of the duration
/// on random paths of two to nine corners.
const ROUNDS: usize = 4;

/// A motion that takes less than so many windows is tried with both. Chosen: there the window is a tenth of the time, and
/// which one is better shows only when what passes the limits is slowed; in longer motions the first look tells.
const SHORT: f64 = 20.0;

/// A share by which limits may be passed before another round is worth its time; the whole is slowed by it.
const NEARLY: f64 = 1.003;

/// By how much a motion has to be slowed that passes its jerk limits twofold: the cube root of two. In a window twice as long it is
/// likely to keep them, so that one is looked at before any more is asked of this.
const TWOFOLD: f64 = 1.26;

/// How often corners that pass limits are looked at and made slower. Chosen: after the first time hardly any passes them.
const TRIES: usize = 3;

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
        let slopes = Slopes::of(curve);
        if let Some((spans, stretch)) = by_corners(&slopes, limits) {
            return (Self::Spans(spans), stretch);
        }
        let (mean, stretch) = Mean::of(&slopes, limits);
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
fn by_corners(slopes: &Slopes, limits: &Limits) -> Option<(Spans, f64)> {
    let mut looks = Looks::new(slopes, limits);
    let mut passing = Passing::of(slopes, looks.shares())?;
    let mut best: Option<(Spans, f64)> = None;
    for _ in 0..TRIES {
        let spans = passing.timed()?;
        let stretch = looks.spans(&spans, &mut passing);
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
    fn of(slopes: &Slopes, limits: &Limits) -> (Self, f64) {
        let shape = Shape::of(slopes, limits);
        let mut looks = Looks::new(slopes, limits);
        let rises = limits.acceleration.iter().zip(&limits.jerk).map(|(a, j)| a / j * MARGIN[2]);
        let rise = rises.fold(0.0, f64::max);
        let profile = fastest(&shape, &vec![1.0; shape.len()]);
        let first = Self { profile, window: rise };
        let is_short = first.duration() < SHORT * rise;
        let least = |stretch: f64| if is_short { f64::INFINITY } else { stretch };
        let mut first = Round::of(first, &mut looks, least(TWOFOLD));
        if first.stretch < NEARLY {
            return (first.timing, first.stretch);
        }
        // In the longer window a push may turn into a brake at once, in the shorter one speeds are reached sooner.
        let longer = Self { window: 2.0 * rise, ..first.timing.clone() };
        let is_whole = is_short || first.stretch <= TWOFOLD;
        let enough = if is_whole { first.takes() / longer.duration() } else { f64::INFINITY };
        let longer = Round::of(longer, &mut looks, least(enough));
        if !is_whole && longer.takes() >= first.takes() {
            first = Round::of(first.timing, &mut looks, f64::INFINITY);
        }
        let (likelier, other) =
            if longer.takes() < first.takes() { (longer, first) } else { (first, longer) };
        let mut slowed = |begin: Round| slower_where_passed(&shape, &mut looks, begin);
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
}

/// Makes a profile slower where limits are passed, some times over, and returns the best timing met.
fn slower_where_passed(shape: &Shape, looks: &mut Looks, begin: Round) -> Round {
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
        let profile = fastest(shape, &pace);
        let timing = Mean { profile, window: best.timing.window };
        let round = Round::of(timing, looks, f64::INFINITY);
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
    /// Looks at a timing, to its end or until it is known to have to be slowed by more than `enough`.
    fn of(timing: Mean, looks: &mut Looks, enough: f64) -> Self {
        let mut over = vec![1.0; timing.profile.times().len()];
        let Mean { profile, window } = &timing;
        let motion = (profile.times(), profile.pushes());
        let stretch = looks.mean(motion, *window, enough, &mut over);
        Self { timing, stretch, over }
    }

    /// How long the motion takes when it is slowed, s.
    fn takes(&self) -> f64 {
        self.timing.duration() * self.stretch
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
            let (mean, slower) = Mean::of(&Slopes::of(&curve), &limits);
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
