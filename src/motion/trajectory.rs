//! Joints over time: timed paths that keep speed, acceleration and jerk limits at every instant.
//!
//! A path of corners is rounded inside what is free, then timed (`timing`): as fast as the limits allow, along
//! exactly that path, from rest to rest.

use std::borrow::Cow;

use super::curve::{At, Curve};
use super::error::Error;
use super::fault::Untimed;
use super::polyline::{l2, mix};
pub use super::profile::Limits;
use super::timing::Timing;

/// A corner that can be cut no more than this is stopped at, rad: it would be crept through.
const LEAST_CUT: f64 = 0.01;

/// Where the joints are at one instant, and how they move.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Positions, rad.
    pub q: Vec<f64>,
    /// Speeds, rad/s.
    pub dq: Vec<f64>,
    /// Accelerations, rad/s².
    pub ddq: Vec<f64>,
}

/// Joints over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    parts: Vec<Part>,
}

/// One stretch: a curve and how it is run through.
#[derive(Debug, Clone, PartialEq)]
struct Part {
    /// When it begins, s.
    start: f64,
    /// How long it takes, s.
    duration: f64,
    curve: Curve,
    law: Law,
    /// Time runs slower by this factor than `law` says.
    stretch: f64,
}

/// How far along the curve one is after some time.
#[derive(Debug, Clone, PartialEq)]
enum Law {
    /// The curve's parameter is time.
    Time,
    /// As fast as limits allow.
    Timed(Timing),
}

impl Part {
    /// Returns how far along the curve one is at `t`, and the first two rates, before any stretching.
    fn along(&self, t: f64) -> [f64; 3] {
        match &self.law {
            Law::Time => [t.min(self.curve.length()), 1.0, 0.0],
            Law::Timed(timing) => {
                let [s, ds, dds, _] = timing.along(t);
                [s, ds, dds]
            }
        }
    }

    fn sample(&self, t: f64) -> Sample {
        let [s, ds, dds] = self.along((t / self.stretch).max(0.0));
        let At { q, dq, ddq, .. } = self.curve.at(s);
        let (k, kk) = (self.stretch, self.stretch * self.stretch);
        Sample {
            q,
            ddq: dq.iter().zip(&ddq).map(|(d, dd)| (d * dds + dd * ds * ds) / kk).collect(),
            dq: dq.iter().map(|d| d * ds / k).collect(),
        }
    }

    fn end(&self) -> Sample {
        let rest = vec![0.0; self.curve.end().len()];
        match self.law {
            Law::Timed(_) => Sample { q: self.curve.end().to_vec(), dq: rest.clone(), ddq: rest },
            Law::Time => Sample { q: self.curve.end().to_vec(), ..self.sample(self.duration) },
        }
    }
}

impl Trajectory {
    /// Times a path of corners at the limits. Corners are rounded where `free` allows it, at most
    /// `max_cut` rad along each edge; where it does not, the arm stops at the corner. `free(a, b)` says
    /// whether the short straight motion from `a` to `b` is free, with a tenth of a millimetre to spare, as
    /// [`super::collision::CollisionWorld::certify`] does.
    ///
    /// # Errors
    ///
    /// [`Error::Trajectory`] without a corner, or for limits that are not positive.
    pub fn through_corners(
        corners: &[Vec<f64>],
        limits: &Limits,
        max_cut: f64,
        free: &dyn Fn(&[f64], &[f64]) -> bool,
    ) -> Result<Self, Error> {
        let corners = distinct(corners, limits)?;
        if corners.len() < 2 {
            return Ok(Self::resting(&corners[0]));
        }
        let cuts = cut_corners(&corners, max_cut, free);
        let mut whole = Self { parts: Vec::new() };
        let mut from = 0;
        for to in 1..corners.len() {
            // A corner that cannot be rounded is an end of one motion and the start of the next.
            if to + 1 == corners.len() || cuts[to] <= 0.0 {
                let curve = Curve::rounded(&corners[from..=to], &cuts[from..=to]);
                whole.push(Part::timed(curve, limits));
                from = to;
            }
        }
        Ok(whole)
    }

    /// Times a dense path, as a Cartesian motion gives it, at the limits: a smooth curve through every point.
    ///
    /// # Errors
    ///
    /// As [`Self::through_corners`].
    pub fn through_points(points: &[Vec<f64>], limits: &Limits) -> Result<Self, Error> {
        let points = distinct(points, limits)?;
        if points.len() < 2 {
            return Ok(Self::resting(&points[0]));
        }
        let mut whole = Self { parts: Vec::new() };
        whole.push(Part::timed(Curve::through(&points), limits));
        Ok(whole)
    }

    /// Returns the motion through `points` at given `times` (s, increasing), at rest at both ends. Limits
    /// are the caller's to check, with [`Self::worst`].
    ///
    /// # Errors
    ///
    /// [`Error::Trajectory`] if there are not as many times as points, or they do not increase.
    pub fn from_points(times: &[f64], points: &[Vec<f64>]) -> Result<Self, Error> {
        let fail = |what| Err(Error::Trajectory { what });
        if times.len() != points.len() || times.len() < 2 {
            return fail(Untimed::Counts);
        }
        if !times.windows(2).all(|t| t[1] > t[0] && t[1].is_finite()) {
            return fail(Untimed::Times);
        }
        let n = points[0].len();
        if points.iter().any(|p| p.len() != n || p.iter().any(|x| !x.is_finite())) {
            return fail(Untimed::Points);
        }
        let knots: Vec<f64> = times.iter().map(|t| t - times[0]).collect();
        let rest = vec![0.0; n];
        let curve = Curve::spline(&knots, points, [&rest, &rest]);
        let duration = curve.length();
        let part = Part { start: 0.0, duration, curve, law: Law::Time, stretch: 1.0 };
        Ok(Self { parts: vec![part] })
    }

    /// Returns the trajectory that stays where it is and takes no time.
    pub fn resting(q: &[f64]) -> Self {
        let knots = [0.0, 1e-9];
        let rest = vec![0.0; q.len()];
        let curve = Curve::spline(&knots, &[q.to_vec(), q.to_vec()], [&rest, &rest]);
        let part = Part { start: 0.0, duration: 0.0, curve, law: Law::Time, stretch: 1.0 };
        Self { parts: vec![part] }
    }

    /// Returns how long it takes, s.
    pub fn duration(&self) -> f64 {
        self.parts.last().map_or(0.0, |part| part.start + part.duration)
    }

    /// Returns where the joints are at `t`, s; before and after, where they begin and end.
    pub fn sample(&self, t: f64) -> Sample {
        let last = self.parts.last().expect("a trajectory has a part");
        if t >= self.duration() {
            return last.end();
        }
        let at = self.parts.partition_point(|part| part.start <= t).max(1) - 1;
        let part = &self.parts[at];
        part.sample((t - part.start).max(0.0))
    }

    /// Returns the first and the last position.
    pub fn ends(&self) -> (Vec<f64>, Vec<f64>) {
        (self.sample(0.0).q, self.sample(self.duration()).q)
    }

    /// Appends another trajectory, which must begin where this one ends (to 1e-6 rad).
    ///
    /// # Errors
    ///
    /// [`Error::Trajectory`] if it begins elsewhere.
    pub fn then(mut self, next: &Self) -> Result<Self, Error> {
        let gap = l2(&self.ends().1, &next.ends().0);
        if gap > 1e-6 {
            return Err(Error::Trajectory { what: Untimed::Gap { gap } });
        }
        for part in &next.parts {
            self.push(part.clone());
        }
        Ok(self)
    }

    /// Returns the same motion, `factor` times as slow.
    #[must_use]
    pub fn slowed(mut self, factor: f64) -> Self {
        for part in &mut self.parts {
            part.start *= factor;
            part.duration *= factor;
            part.stretch *= factor;
        }
        self
    }

    /// Returns the largest share of its limit that any speed and any acceleration takes, looked at every
    /// `step` s.
    pub fn worst(&self, limits: &Limits, step: f64) -> (f64, f64) {
        let n = (self.duration() / step).ceil().max(1.0) as usize;
        let mut worst = (0.0_f64, 0.0_f64);
        for k in 0..=n {
            let sample = self.sample(self.duration() * (k as f64 / n as f64));
            for i in 0..sample.q.len() {
                worst.0 = worst.0.max(sample.dq[i].abs() / limits.velocity[i]);
                worst.1 = worst.1.max(sample.ddq[i].abs() / limits.acceleration[i]);
            }
        }
        worst
    }

    /// Returns instants `step` s apart, the end included, and the positions there.
    pub fn sampled(&self, step: f64) -> (Vec<f64>, Vec<Vec<f64>>) {
        let n = (self.duration() / step).ceil().max(1.0) as usize;
        let times: Vec<f64> = (0..=n).map(|k| self.duration() * (k as f64 / n as f64)).collect();
        let points = times.iter().map(|&t| self.sample(t).q).collect();
        (times, points)
    }

    fn push(&mut self, mut part: Part) {
        part.start = self.duration();
        self.parts.push(part);
    }
}

impl Part {
    /// Times a curve at the limits.
    fn timed(curve: Curve, limits: &Limits) -> Self {
        let (timing, stretch) = Timing::of(&curve, limits);
        let duration = timing.duration() * stretch;
        Self { start: 0.0, duration, curve, law: Law::Timed(timing), stretch }
    }
}

/// Drops points that repeat the one before and checks what is left.
fn distinct<'p>(points: &'p [Vec<f64>], limits: &Limits) -> Result<Cow<'p, [Vec<f64>]>, Error> {
    let fail = |what| Err(Error::Trajectory { what });
    let n = limits.velocity.len();
    if points.is_empty() {
        return fail(Untimed::Empty);
    }
    if points.iter().any(|p| p.len() != n || p.iter().any(|x| !x.is_finite())) {
        return fail(Untimed::Joints);
    }
    let all = || limits.velocity.iter().chain(&limits.acceleration).chain(&limits.jerk);
    if limits.acceleration.len() != n || limits.jerk.len() != n || !all().all(|x| *x > 0.0) {
        return fail(Untimed::Limits);
    }
    if points.windows(2).all(|pair| l2(&pair[0], &pair[1]) > 1e-9) {
        return Ok(Cow::Borrowed(points));
    }
    let mut kept: Vec<Vec<f64>> = Vec::with_capacity(points.len());
    for point in points {
        if kept.last().is_none_or(|last| l2(last, point) > 1e-9) {
            kept.push(point.clone());
        }
    }
    Ok(Cow::Owned(kept))
}

/// Returns how far each corner may be cut: half its shorter edge or `max_cut`, halved until it is free.
fn cut_corners(
    corners: &[Vec<f64>],
    max_cut: f64,
    free: &dyn Fn(&[f64], &[f64]) -> bool,
) -> Vec<f64> {
    let n = corners.len();
    let mut cuts = vec![0.0; n];
    for i in 1..n - 1 {
        let (before, after) = (l2(&corners[i - 1], &corners[i]), l2(&corners[i], &corners[i + 1]));
        let mut cut = (0.5 * before).min(0.5 * after).min(max_cut);
        while cut >= LEAST_CUT {
            let from = mix(&corners[i], &corners[i - 1], cut / before);
            let to = mix(&corners[i], &corners[i + 1], cut / after);
            let bend = Curve::rounded(&[from, corners[i].clone(), to], &[0.0, cut, 0.0]);
            // Chords this short leave the curve by less than the 0.1 mm that `free` keeps.
            let chords = (bend.length() / 0.004).ceil().max(16.0) as usize;
            let (mut from, mut to) = (bend.place(0.0), vec![0.0; corners[i].len()]);
            let is_free = (1..=chords).all(|k| {
                bend.place_into(bend.length() * k as f64 / chords as f64, &mut to);
                let chord = free(&from, &to);
                std::mem::swap(&mut from, &mut to);
                chord
            });
            if is_free {
                cuts[i] = cut;
                break;
            }
            cut *= 0.5;
        }
    }
    cuts
}
