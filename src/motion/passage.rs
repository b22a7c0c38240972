//! How a rounded corner is passed in the least time: the square of the speed along it, a Bernstein polynomial of degree 5.
//!
//! Limits of accelerations are linear in the square of the speed and its slope; those of jerks are made so about a constant
//! speed, on the safe side. So the passage is a small linear program ([`super::linear`]); a second one, about what the first found,
//! gains nothing. What a corner is worth besides the time it takes is how fast, and how hard pushed, the straight stretches beside
//! it begin and end.
//!
//! Limits are asked for at a few places; whoever times a path looks between them ([`super::timing`]).
//!
//! Source: Verscheure et al., "Time-optimal path tracking for robots: a convex optimization approach", TAC 2009 (the square of
//! the speed as unknown); inner approximation of what is not convex: Marks and Wright, Operations Research 1978.

use super::curve::{At, Curve};
use super::linear::Bounds;
use super::profile::Limits;
use super::ramp::{Along, Span, State};

/// Coefficients of a passage.
const N: usize = 6;
/// Places along a corner at which limits are asked for. Chosen on random paths of three to nine corners: with 8 it takes a tenth
/// less time to find and more looks have to mend, with 13 half as much again; durations differ by 0.2 %.
const PLACES: usize = 10;
/// Spans of constant jerk that a corner is passed in. Chosen likewise: with 10 motions take 0.1 % longer.
const SPANS: usize = 12;
/// The constant speed that is begun with, squared, as a share of what the bend allows: inside all bounds. Chosen.
const INSIDE: f64 = 0.95;
/// Where the square of the speed falls below this share of it, somewhere between nothing is left of it. Chosen.
const SLOWEST: f64 = 0.1;

/// The Bernstein polynomials and two derivatives at some place, 0 to 1.
type Basis = [[f64; N]; 3];

fn basis(u: f64) -> Basis {
    let powers = |n: i32, k: i32, times: f64| -> f64 {
        if (0..=n).contains(&k) { times * u.powi(k) * (1.0 - u).powi(n - k) } else { 0.0 }
    };
    let fifth = |k: i32| powers(5, k, [1.0, 5.0, 10.0, 10.0, 5.0, 1.0][k as usize]);
    let fourth = |k: i32| powers(4, k, [1.0, 4.0, 6.0, 4.0, 1.0, 0.0][k.max(0) as usize]);
    let third = |k: i32| powers(3, k, [1.0, 3.0, 3.0, 1.0, 0.0, 0.0][k.max(0) as usize]);
    let each = |of: &dyn Fn(i32) -> f64| [0, 1, 2, 3, 4, 5].map(of);
    [
        each(&fifth),
        each(&|k| 5.0 * (fourth(k - 1) - fourth(k))),
        each(&|k| 20.0 * (third(k - 2) - 2.0 * third(k - 1) + third(k))),
    ]
}

/// Place `k` of `0..=n` along a corner, 0 to 1: closer towards its ends, where the speed changes most.
fn share(k: usize, n: usize) -> f64 {
    0.5 - 0.5 * (std::f64::consts::PI * k as f64 / n as f64).cos()
}

fn dot(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// What all corners share.
pub(super) struct Places {
    asked: Vec<Basis>,
    spans: Vec<Basis>,
}

impl Places {
    pub(super) fn new() -> Self {
        let along = |n: usize| (0..=n).map(|k| basis(share(k, n))).collect();
        Self { asked: along(PLACES - 1), spans: along(SPANS) }
    }
}

/// One corner, and how it is passed.
pub(super) struct Passage {
    length: f64,
    /// The square of a constant speed that is possible.
    steady: f64,
    best: [f64; N],
    /// How much of the best passage is used; the rest is steady.
    pub(super) share: f64,
    /// How many times as slow it is passed.
    pub(super) slower: f64,
    /// How many times as slow it is to be passed for the limits to hold.
    pub(super) excess: f64,
}

impl Passage {
    /// Finds how the stretch numbered `piece` is passed, `sides` being the straight ones before and after it, and the highest speeds
    /// there.
    pub(super) fn of(
        curve: &Curve,
        piece: usize,
        limits: &Limits,
        sides: [(Along, f64); 2],
        places: &Places,
        bounds: &mut Bounds<N>,
    ) -> Self {
        let [begin, end] = [curve.knots()[piece], curve.knots()[piece + 1]];
        let length = end - begin;
        let mut at = vec![At::new(limits.velocity.len()); PLACES];
        let mut steady = f64::INFINITY;
        for (k, at) in at.iter_mut().enumerate() {
            curve.slopes(piece, begin + length * share(k, PLACES - 1), at);
            steady = steady.min(steady_at(at, limits));
        }
        let steady = INSIDE * steady;
        bounds.clear();
        for (at, basis) in at.iter().zip(&places.asked) {
            bound(bounds, at, basis, length, limits, steady);
        }
        // It brakes where it begins and pushes where it ends, or does neither.
        let mut flat = [0.0; N];
        (flat[0], flat[1]) = (-1.0, 1.0);
        bounds.push(&flat, 0.0);
        flat = [0.0; N];
        (flat[N - 2], flat[N - 1]) = (1.0, -1.0);
        bounds.push(&flat, 0.0);
        let mut best = [steady; N];
        bounds.climb(&worth(&best, length, sides, places), &mut best);
        if places.asked.iter().any(|basis| dot(&best, &basis[0]) < SLOWEST * steady) {
            best = [steady; N];
        }
        Self { length, steady, best, share: 1.0, slower: 1.0, excess: 1.0 }
    }

    fn coefficients(&self) -> [f64; N] {
        let faster = self.slower.powi(-2);
        self.best.map(|x| faster * (self.steady + self.share * (x - self.steady)))
    }

    /// Returns the speed and the acceleration it begins with.
    pub(super) fn begins(&self) -> (f64, f64) {
        let x = self.coefficients();
        (x[0].sqrt(), 2.5 * (x[1] - x[0]) / self.length)
    }

    /// Returns spans of constant jerk that pass it, and the speed and the acceleration at its end.
    pub(super) fn spans(&self, places: &Places, out: &mut Vec<Span>) -> (f64, f64) {
        let x = self.coefficients();
        let (v, a) = self.begins();
        let mut state = State { s: 0.0, v, a };
        for (k, basis) in places.spans.iter().enumerate().skip(1) {
            // With a constant jerk from `a` to `next`, `size = v t + (2 a + next) t² / 6`.
            let next = 0.5 * dot(&x, &basis[1]) / self.length;
            let size = self.length * share(k, SPANS) - state.s;
            let bent = (2.0 * state.a + next) / 1.5;
            let t = 2.0 * size / (state.v + (state.v * state.v + bent * size).max(0.0).sqrt());
            let jerk = (next - state.a) / t;
            out.push((t, jerk));
            state = state.after(t, jerk);
        }
        (state.v, state.a)
    }
}

/// The square of the constant speed that all limits allow at a place.
fn steady_at(at: &At, limits: &Limits) -> f64 {
    let mut most = f64::INFINITY;
    for i in 0..at.dq.len() {
        let over = |limit: f64, x: f64| limit / x.abs().max(1e-12);
        let fast = over(limits.velocity[i], at.dq[i]).powi(2);
        let turn = over(limits.jerk[i], at.dddq[i]).cbrt().powi(2);
        most = most.min(fast).min(turn).min(over(limits.acceleration[i], at.ddq[i]));
    }
    most
}

/// Adds the limits at a place, where the square of the speed was `x`.
fn bound(bounds: &mut Bounds<N>, at: &At, basis: &Basis, length: f64, limits: &Limits, x: f64) {
    let [value, first, second] = basis;
    // The acceleration along the curve is half the slope of the square of the speed; the jerk is its slope times the speed.
    let (push, turn) = (0.5 / length, 0.5 / (length * length));
    let mut fast = f64::INFINITY;
    for i in 0..at.dq.len() {
        let (d, dd, ddd) = (at.dq[i], at.ddq[i], at.dddq[i]);
        fast = fast.min((limits.velocity[i] / d.abs().max(1e-12)).powi(2));
        let per = limits.acceleration[i].recip();
        let (a, b) = (per * d * push, per * dd);
        let row: [f64; N] = std::array::from_fn(|k| a * first[k] + b * value[k]);
        bounds.push(&row, 1.0);
        bounds.push(&row.map(|x| -x), 1.0);
        // `J / √x` lies above its tangent.
        let per = limits.jerk[i].recip();
        let (a, b, c) = (per * d * turn, per * 3.0 * dd * push, per * ddd);
        let (most, tangent) = (1.5 / x.sqrt(), 0.5 / (x * x.sqrt()));
        let row: [f64; N] = std::array::from_fn(|k| a * second[k] + b * first[k] + c * value[k]);
        let over = value.map(|value| tangent * value);
        bounds.push(&std::array::from_fn(|k| over[k] + row[k]), most);
        bounds.push(&std::array::from_fn(|k| over[k] - row[k]), most);
    }
    bounds.push(value, fast);
}

/// How much time each coefficient saves.
fn worth(x: &[f64; N], length: f64, sides: [(Along, f64); 2], places: &Places) -> [f64; N] {
    let mut worth = [0.0; N];
    let mut add = |share: f64, basis: &[f64; N]| {
        worth.iter_mut().zip(basis).for_each(|(worth, basis)| *worth += share * basis);
    };
    for (k, basis) in places.asked.iter().enumerate() {
        let place = |k: usize| share(k, PLACES - 1);
        let around = place((k + 1).min(PLACES - 1)) - place(k.saturating_sub(1));
        let x = dot(x, &basis[0]);
        add(0.25 * around * length / (x * x.sqrt()), &basis[0]);
    }
    // Beside the corner a speed that is there already need not be reached, and a push that is there need not grow; what is gained
    // is the time less what it takes at the highest speed to go as far.
    let ends = [(&places.asked[0], -1.0), (&places.asked[PLACES - 1], 1.0)];
    for ((side, highest), (basis, sign)) in sides.into_iter().zip(ends) {
        let v = dot(x, &basis[0]).sqrt();
        let a = sign * 0.5 * dot(x, &basis[1]) / length;
        let gain = (1.0 - v / highest).max(0.0) / side.a;
        add(gain * 0.5 / v, &basis[0]);
        add(gain * sign * 0.5 * (side.a - a).max(0.0) / (side.j * length), &basis[1]);
    }
    worth
}
