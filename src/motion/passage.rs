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

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use std::sync::LazyLock;

use super::lanes::Wide;
use super::linear::Bounds;
use super::profile::cube_root;
use super::quad::Quad;
use super::ramp::{Along, Span, State};
use super::slopes::{Four, Slopes};

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

/// Places along a corner, 0 to 1, and the polynomials there: what all corners share.
struct Places {
    asked: [(f64, Basis); PLACES],
    spans: [(f64, Basis); SPANS + 1],
}

static ALONG: LazyLock<Places> = LazyLock::new(|| {
    let at = |k: usize, n: usize| (share(k, n), basis(share(k, n)));
    Places {
        asked: std::array::from_fn(|k| at(k, PLACES - 1)),
        spans: std::array::from_fn(|k| at(k, SPANS)),
    }
});

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
    /// Finds how the stretch numbered `piece` is passed: `per` has one over each limit (of speeds, accelerations and jerks), `sides`
    /// the straight stretches before and after it and the highest speeds there.
    #[inline(always)]
    pub(super) fn of<S: Wide>(
        simd: S,
        (slopes, piece): (&Slopes, usize),
        per: &[[Four; 3]],
        sides: [(Along, f64); 2],
        bounds: &mut Bounds<N>,
    ) -> Self {
        let [begin, end] = [slopes.curve().knots()[piece], slopes.curve().knots()[piece + 1]];
        let length = end - begin;
        let places = &ALONG.asked;
        let on = slopes.on(piece);
        // What is steady keeps all limits at every place.
        let (mut alone, mut steady) = ([([0.0; N], 0.0); PLACES + 2], f64::INFINITY);
        for ((share, basis), alone) in places.iter().zip(&mut alone) {
            let [speed, push, turn] = on.most(simd, begin + length * share, per, |each| each);
            *alone = (basis[0], speed.powi(-2));
            steady = steady.min(speed.powi(-2)).min(push.recip()).min(cube_root(turn).powi(-2));
        }
        let steady = INSIDE * steady;
        bounds.clear();
        for (share, basis) in places {
            let limited = Limited { basis, length, steady };
            on.at(
                simd,
                begin + length * share,
                #[inline(always)]
                |k, slopes| limited.bound(bounds, slopes, &per[k]),
            );
        }
        // It brakes where it begins and pushes where it ends, or does neither.
        (alone[PLACES].0[0], alone[PLACES].0[1]) = (-1.0, 1.0);
        (alone[PLACES + 1].0[N - 2], alone[PLACES + 1].0[N - 1]) = (1.0, -1.0);
        bounds.push_each(&alone);
        let mut best = [steady; N];
        bounds.climb(simd, &worth(&best, length, sides), &mut best);
        if places.iter().any(|(_, basis)| dot(&best, &basis[0]) < SLOWEST * steady) {
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
    pub(super) fn spans(&self, out: &mut Vec<Span>) -> (f64, f64) {
        let x = self.coefficients();
        let (v, a) = self.begins();
        let mut state = State { s: 0.0, v, a };
        for (share, basis) in &ALONG.spans[1..] {
            // With a constant jerk from `a` to `next`, `size = v t + (2 a + next) t² / 6`.
            let next = 0.5 * dot(&x, &basis[1]) / self.length;
            let size = self.length * share - state.s;
            let bent = (2.0 * state.a + next) / 1.5;
            let t = 2.0 * size / (state.v + (state.v * state.v + bent * size).max(0.0).sqrt());
            let jerk = (next - state.a) / t;
            out.push((t, jerk));
            state = state.after(t, jerk);
        }
        (state.v, state.a)
    }
}

/// A place where limits are asked for: the square of the speed is sought along a corner of some length, about a steady one.
struct Limited<'b> {
    basis: &'b Basis,
    length: f64,
    steady: f64,
}

impl Limited<'_> {
    /// Adds the limits of acceleration and jerk of four joints, by the three derivatives there and one over the limits.
    #[inline(always)]
    fn bound<S: Wide>(&self, bounds: &mut Bounds<N>, slopes: [Quad<S>; 3], per: &[Four; 3]) {
        let [d, dd, ddd] = slopes;
        let simd = d.simd();
        let all = |x: f64| Quad::all(simd, x);
        let (acceleration, jerk) = (Quad::of(simd, per[1]), Quad::of(simd, per[2]));
        // The acceleration along the curve is half the slope of the square of the speed; the jerk is its slope times the speed.
        let (push, turn) = (0.5 / self.length, 0.5 / (self.length * self.length));
        let pushed = [acceleration * dd, acceleration * d * all(push)];
        let jerked = [jerk * ddd, jerk * dd * all(3.0 * push), jerk * d * all(turn)];
        // `J / √x` lies above its tangent.
        let root = self.steady.sqrt();
        let (most, tangent) = (1.5 / root, 0.5 / (self.steady * root));
        let [mut push, mut brake, mut more, mut less] = [[all(0.0); N]; 4];
        for k in 0..N {
            let (value, first) = (all(self.basis[0][k]), all(self.basis[1][k]));
            let (second, over) = (all(self.basis[2][k]), all(tangent * self.basis[0][k]));
            push[k] = pushed[0] * value + pushed[1] * first;
            brake[k] = -push[k];
            let row = jerked[0] * value + jerked[1] * first + jerked[2] * second;
            (more[k], less[k]) = (over + row, over - row);
        }
        bounds.push(&push, all(1.0));
        bounds.push(&brake, all(1.0));
        bounds.push(&more, all(most));
        bounds.push(&less, all(most));
    }
}

/// How much time each coefficient saves.
fn worth(x: &[f64; N], length: f64, sides: [(Along, f64); 2]) -> [f64; N] {
    let places = &ALONG.asked;
    let mut worth = [0.0; N];
    let mut add = |share: f64, basis: &[f64; N]| {
        worth.iter_mut().zip(basis).for_each(|(worth, basis)| *worth += share * basis);
    };
    for (k, (_, basis)) in places.iter().enumerate() {
        let around = places[(k + 1).min(PLACES - 1)].0 - places[k.saturating_sub(1)].0;
        let x = dot(x, &basis[0]);
        add(0.25 * around * length / (x * x.sqrt()), &basis[0]);
    }
    // Beside the corner a speed that is there already need not be reached, and a push that is there need not grow; what is gained
    // is the time less what it takes at the highest speed to go as far.
    let ends = [(&places[0].1, -1.0), (&places[PLACES - 1].1, 1.0)];
    for ((side, highest), (basis, sign)) in sides.into_iter().zip(ends) {
        let v = dot(x, &basis[0]).sqrt();
        let a = sign * 0.5 * dot(x, &basis[1]) / length;
        let gain = (1.0 - v / highest).max(0.0) / side.a;
        add(gain * 0.5 / v, &basis[0]);
        add(gain * sign * 0.5 * (side.a - a).max(0.0) / (side.j * length), &basis[1]);
    }
    worth
}
