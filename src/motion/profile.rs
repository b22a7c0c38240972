//! How fast a curve can be run through: the profile of speeds along it that the limits of joints allow.
//!
//! Speeds and accelerations are kept here at every knot, of the jerk only what the bends of the curve ask for: the rest
//! is [`super::timing`]'s.
//!
//! Source: reachability analysis: Pham and Pham, "A new approach to time-optimal path parameterization
//! based on reachability analysis", T-RO 2018, its two-variable programs solved in closed form.

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use super::curve::Curve;
use super::lanes::{Job, Wide, run};
use super::quad::Quad;
use super::robot::Robot;
use super::slopes::{Four, Slopes, in_fours};

/// An acceleration goes from none to its limit in this time, s, where no jerk limit is known. Chosen: no jerk limit of the
/// Gen3 is published; at its accelerations this means 99 to 172 rad/s³. With twice as much a hand turns back too late to end a
/// pour: 35 mL for 30.
const TIME_TO_FULL_ACCELERATION: f64 = 0.05;

/// Limits of a motion, one entry per joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Highest speeds, rad/s.
    pub velocity: Vec<f64>,
    /// Highest accelerations, rad/s².
    pub acceleration: Vec<f64>,
    /// Highest jerks, rad/s³.
    pub jerk: Vec<f64>,
}

impl Limits {
    /// Returns limits of speed (rad/s) and acceleration (rad/s²), the acceleration reached from none in 0.05 s.
    pub fn new(velocity: Vec<f64>, acceleration: Vec<f64>) -> Self {
        let jerk = acceleration.iter().map(|a| a / TIME_TO_FULL_ACCELERATION).collect();
        Self { velocity, acceleration, jerk }
    }

    /// Returns the robot's own limits.
    pub fn of(robot: &Robot) -> Self {
        let joints = robot.joints();
        let mut limits = Self::new(
            joints.iter().map(|joint| joint.velocity).collect(),
            joints.iter().map(|joint| joint.acceleration).collect(),
        );
        for (limit, joint) in limits.jerk.iter_mut().zip(joints) {
            *limit = joint.jerk.unwrap_or(*limit);
        }
        limits
    }

    /// Returns the limits with speeds times `speed`, accelerations and jerks times `acceleration`.
    #[must_use]
    pub fn scaled(&self, speed: f64, acceleration: f64) -> Self {
        let times = |list: &[f64], factor: f64| list.iter().map(|x| x * factor).collect();
        Self {
            velocity: times(&self.velocity, speed),
            acceleration: times(&self.acceleration, acceleration),
            jerk: times(&self.jerk, acceleration),
        }
    }
}

/// `s(t)` with constant acceleration between knots.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Profile {
    /// When each knot is passed, s.
    t: Vec<f64>,
    s: Vec<f64>,
    v: Vec<f64>,
    /// The rate of `v` from each knot on; none after the last.
    a: Vec<f64>,
    /// The integral of `s` up to each knot.
    sum: Vec<f64>,
}

impl Profile {
    /// Returns the integral of `s`, `s`, its rate and the rate of that at `t`; before and after it rests at the ends.
    pub(super) fn at(&self, t: f64) -> [f64; 4] {
        let passed = self.t.partition_point(|knot| *knot <= t);
        let Some(k) = passed.checked_sub(1) else { return [0.0; 4] };
        let tau = t - self.t[k];
        let (s, v, a) = (self.s[k], self.v[k], self.a[k]);
        [
            self.sum[k] + tau * (s + tau * (v / 2.0 + tau * a / 6.0)),
            s + tau * (v + tau * a / 2.0),
            v + tau * a,
            a,
        ]
    }

    pub(super) fn duration(&self) -> f64 {
        *self.t.last().expect("a profile has knots")
    }

    /// Returns when each knot is passed, s.
    pub(super) fn times(&self) -> &[f64] {
        &self.t
    }

    /// Returns the acceleration from each knot on; none after the last.
    pub(super) fn pushes(&self) -> &[f64] {
        &self.a
    }
}

/// A curve at knots along it, as its timing sees it.
pub(super) struct Shape {
    s: Vec<f64>,
    /// Lists of four joints a knot.
    fours: usize,
    /// What the acceleration limit of each joint allows along the curve: at the square `x` of the speed along it no more than `reach +
    /// slope x` and no less than `slope x - reach`.
    bounds: Vec<Bound>,
    /// The largest square of the speed along the curve that speeds and jerks of joints allow at each knot.
    most: Vec<f64>,
}

/// `reach` and `slope` of four joints.
type Bound = [Four; 2];

impl Shape {
    pub(super) fn of(slopes: &Slopes, limits: &Limits) -> Self {
        let (s, fours) = (grid(slopes.curve()), limits.velocity.len().div_ceil(4));
        let mut shape = Self {
            bounds: Vec::with_capacity(s.len() * fours),
            most: Vec::with_capacity(s.len()),
            fours,
            s,
        };
        // An empty lane has no derivatives, and so no bounds.
        let each = |list: &[f64]| in_fours(list.iter().copied(), 1.0);
        let limits = [each(&limits.velocity), each(&limits.acceleration), each(&limits.jerk)];
        run(Knots { slopes, limits: &limits, shape: &mut shape });
        shape
    }

    /// Returns how many knots there are.
    pub(super) fn len(&self) -> usize {
        self.s.len()
    }

    fn bounds(&self, knot: usize) -> &[Bound] {
        &self.bounds[knot * self.fours..(knot + 1) * self.fours]
    }
}

/// Works out what the limits allow at each knot.
struct Knots<'k, 'c> {
    slopes: &'k Slopes<'c>,
    limits: &'k [Vec<Four>; 3],
    shape: &'k mut Shape,
}

impl Job for Knots<'_, '_> {
    type Found = ();

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) {
        let Self { slopes, limits: [speeds, pushes, jerks], shape } = self;
        let knots = slopes.curve().knots();
        let all = |x: f64| Quad::all(simd, x);
        let (none, endless, least) = (all(0.0), all(f64::INFINITY), all(LEAST));
        let mut piece = 0;
        for &s in &shape.s {
            while piece + 2 < knots.len() && s >= knots[piece + 1] {
                piece += 1;
            }
            // How the joints' jerks, and one over speeds and accelerations, compare with their limits.
            let mut most = [none; 3];
            if piece > 0 && knots[piece] >= s {
                // Where two stretches meet only the third derivative jumps.
                slopes.on(piece - 1).at(
                    simd,
                    s,
                    #[inline(always)]
                    |k, [.., ddd]| most[0] = most[0].max(ddd.abs() / Quad::of(simd, jerks[k])),
                );
            }
            let bounds = &mut shape.bounds;
            slopes.on(piece).at(
                simd,
                s,
                #[inline(always)]
                |k, [d, dd, ddd]| {
                    let push = Quad::of(simd, pushes[k]);
                    let moves = least.below(d.abs());
                    let per = all(1.0) / moves.pick(d, all(1.0));
                    let reach = moves.pick(push * per.abs(), endless);
                    let slope = moves.pick(-(dd * per), none);
                    bounds.push([reach.lanes(), slope.lanes()]);
                    most[0] = most[0].max(ddd.abs() / Quad::of(simd, jerks[k]));
                    most[1] = most[1].max(moves.pick(d.abs() / Quad::of(simd, speeds[k]), none));
                    let bends = least.below(dd.abs());
                    let turned = bends.pick(dd.abs() / push, none);
                    most[2] = most[2].max(moves.pick(none, turned));
                },
            );
            let [jerk, speed, push, _] = Quad::largest([most[0], most[1], most[2], none]).lanes();
            let most = (1.0 / (speed * speed)).min(1.0 / push);
            // The square of the speed at which the bend alone asks for the whole jerk is its share to the power of -2/3.
            let is_bound = jerk * jerk * (most * most * most) > 1.0;
            shape.most.push(if is_bound { cube_root(jerk).powi(-2) } else { most });
        }
    }
}

/// Returns the cube root of a positive number, to 1e-14 of it: the library's takes as long as several looks.
///
/// Source: Halley's steps, from a third of the exponent as in Kahan's note "Computing a real cube root", 1991.
#[inline]
pub(super) fn cube_root(x: f64) -> f64 {
    let mut root = f64::from_bits(x.to_bits() / 3 + (0x2A9F_7893 << 32));
    for _ in 0..2 {
        let cube = root * root * root;
        root *= (cube + 2.0 * x) / (2.0 * cube + x);
    }
    root
}

/// Derivatives by the length of a curve below this are none: no limit comes near through them.
const LEAST: f64 = 1e-12;

/// The fastest profile of speeds along a curve, from rest to rest, `pace` times as fast at each knot as the limits allow.
///
/// With `x = ṡ²` and `u = s̈`, joint accelerations are `q'u + q''x`: linear. Backwards, the largest `x` at
/// each knot from which the next can be entered; then forwards, as fast as that allows.
pub(super) fn fastest(shape: &Shape, pace: &[f64]) -> Profile {
    run(Fastest { shape, pace })
}

/// [`fastest`].
struct Fastest<'f> {
    shape: &'f Shape,
    pace: &'f [f64],
}

impl Job for Fastest<'_> {
    type Found = Profile;

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) -> Profile {
        let Self { shape, pace } = self;
        let n = shape.len();
        let step = |i: usize| shape.s[i + 1] - shape.s[i];
        let mut top = vec![0.0; n];
        for i in (0..n - 1).rev() {
            let pace = pace[i] * pace[i];
            let most = shape.most[i] * pace;
            top[i] = highest(simd, shape.bounds(i), most, pace, (top[i + 1], step(i)));
        }
        top[0] = 0.0;
        let none = || vec![0.0; n];
        let mut profile =
            Profile { t: none(), s: shape.s.clone(), v: none(), a: none(), sum: none() };
        let mut x = 0.0;
        for i in 0..n - 1 {
            let push = hardest_push(simd, shape.bounds(i), pace[i] * pace[i], x);
            x = (x + 2.0 * step(i) * push).clamp(0.0, top[i + 1]);
            let (v, next) = (profile.v[i], f64::sqrt(x));
            let h = 2.0 * step(i) / (v + next).max(1e-9);
            let a = (next - v) / h;
            profile.a[i] = a;
            profile.v[i + 1] = next;
            profile.t[i + 1] = profile.t[i] + h;
            profile.sum[i + 1] = profile.sum[i] + h * (shape.s[i] + h * (v / 2.0 + h * a / 6.0));
        }
        profile
    }
}

/// Length between two knots on a straight and on a bent stretch, rad. Chosen on random paths of three to nine corners: with
/// half of it on bends motions are 0.5 to 2 % shorter and take up to half again as long to time; on straight stretches
/// half of it gains 0.2 %.
const BETWEEN: [f64; 2] = [0.1, 0.02];

/// Knots along the curve: fine enough that its shape hardly changes between two, finer towards the ends,
/// where the arm is slow and each knot takes long.
fn grid(curve: &Curve) -> Vec<f64> {
    let length = curve.length();
    let mut grid = Vec::new();
    // A curve of one stretch has as many knots as one of many has at least, in all.
    let least = (64.0 / (curve.knots().len() - 1) as f64).clamp(2.0, 16.0);
    for (k, piece) in curve.knots().windows(2).enumerate() {
        let size = piece[1] - piece[0];
        let between = BETWEEN[usize::from(!curve.is_straight(k))];
        let parts = (size / between).ceil().clamp(least.ceil(), 200.0) as usize;
        grid.extend((0..parts).map(|k| piece[0] + size * k as f64 / parts as f64));
    }
    grid.push(length);
    let near = [1e-5, 1e-4, 4e-4, 1e-3, 2e-3, 4e-3, 7e-3];
    grid.extend(near.iter().map(|share| share * length));
    grid.extend(near.iter().map(|share| length - share * length));
    // Nearly sorted, which the stable sort makes use of.
    grid.sort_by(f64::total_cmp);
    grid.dedup_by(|b, a| *b - *a < 1e-7 * length);
    if let Some(last) = grid.last_mut() {
        *last = length;
    }
    grid
}

/// The largest `x`, no more than `most`, for which some `u` keeps the limits times `pace` and leads to at most `next.0` after
/// `next.1`.
///
/// Each limit of an acceleration bounds `u` from below and from above by a line over `x`: the room between the highest
/// of the lower ones and the lowest of the upper ones shrinks the faster the larger `x`, so that Newton's steps from the
/// largest `x` meet the last one with room from above.
#[inline(always)]
fn highest<S: Wide>(simd: S, bounds: &[Bound], most: f64, pace: f64, next: (f64, f64)) -> f64 {
    let per = 1.0 / (2.0 * next.1);
    let last = (next.0 * per, -per);
    let all = |x: f64| Quad::all(simd, x);
    let mut x = most;
    // As many steps as there are pairs of lines that could bind.
    for _ in 0..8 * bounds.len() + 2 {
        let none = all(f64::NEG_INFINITY);
        // The upper ones are turned round.
        let (mut lower, mut upper) = (none, none);
        for [reach, slope] in bounds {
            let middle = Quad::of(simd, *slope) * all(x);
            let reach = Quad::of(simd, *reach) * all(pace);
            lower = lower.max(middle - reach);
            upper = upper.max(-(middle + reach));
        }
        let [lower, upper, ..] = Quad::largest([lower, upper, none, none]).lanes();
        if (last.0 + last.1 * x).min(-upper) >= lower {
            break;
        }
        x = match nearer(bounds, x, pace, last) {
            Some(nearer) => nearer,
            None => return 0.0,
        };
    }
    x
}

/// Returns where the two lines that leave the least room at `x` meet, if they do below it.
fn nearer(bounds: &[Bound], x: f64, pace: f64, last: (f64, f64)) -> Option<f64> {
    let mut lower = (f64::NEG_INFINITY, 0.0, 0.0);
    let mut upper = (last.0 + last.1 * x, last.0, last.1);
    for [reaches, slopes] in bounds {
        for (reach, &slope) in reaches.iter().zip(slopes) {
            let reach = reach * pace;
            if slope * x - reach > lower.0 {
                lower = (slope * x - reach, -reach, slope);
            }
            if slope * x + reach < upper.0 {
                upper = (slope * x + reach, reach, slope);
            }
        }
    }
    let steeper = lower.2 - upper.2;
    (steeper > 1e-15).then(|| ((upper.1 - lower.1) / steeper).clamp(0.0, x * (1.0 - f64::EPSILON)))
}

/// The largest `u` that keeps the acceleration limits times `pace` at `x`.
#[inline(always)]
fn hardest_push<S: Wide>(simd: S, bounds: &[Bound], pace: f64, x: f64) -> f64 {
    let mut most = Quad::all(simd, f64::INFINITY);
    for [reach, slope] in bounds {
        let push = Quad::of(simd, *reach) * Quad::all(simd, pace)
            + Quad::of(simd, *slope) * Quad::all(simd, x);
        most = most.min(push);
    }
    let [a, b, c, d] = most.lanes();
    a.min(b).min(c.min(d))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_root_cubed_is_the_number() {
        for k in -600..600 {
            let x = 1.071_f64.powi(k);
            assert!((cube_root(x).powi(3) / x - 1.0).abs() < 3e-14, "{x}");
        }
    }
}
