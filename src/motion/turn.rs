//! The turn of a joint by its sine and cosine, in four branches of the closed form at once, and where
//! `a cos x + b sin x = c`. Angles are not worked out here.

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use super::lanes::Wide;
use super::quad::{Marks, Quad};

/// A root is clear of the other when the square of the sine between them is above this.
const CLEAR: f64 = 0.01;
/// A stretched arm: rounding, or the wrist offset that the first pass leaves out, may put the target
/// this much (relative) out of reach; the polish then decides.
const SLACK: f64 = 1e-3;

/// A sine and a cosine for each of four branches.
#[derive(Clone, Copy)]
pub(super) struct Turn<S: Wide> {
    pub(super) sin: Quad<S>,
    pub(super) cos: Quad<S>,
}

/// One of the two roots, in four branches.
pub(super) struct Root<S: Wide> {
    pub(super) turn: Turn<S>,
    /// What `a sin x - b cos x` is there: how much less `a cos x + b sin x` becomes, per rad.
    pub(super) side: Quad<S>,
    /// `c² - a² - b²` and `a² + b²`.
    pub(super) lack: Quad<S>,
    pub(super) size: Quad<S>,
    /// Where there is one.
    pub(super) holds: Marks<S>,
    /// Where the slack was needed.
    pub(super) is_stretched: Marks<S>,
    /// Where it is far from the other root.
    pub(super) is_clear: Marks<S>,
}

/// Returns the root of `a cos x + b sin x = c` that `sign` picks, `free` where any `x` will do; `None` where there is
/// none in any branch.
#[inline(always)]
pub(super) fn root<S: Wide>(
    a: Quad<S>,
    b: Quad<S>,
    c: Quad<S>,
    sign: Quad<S>,
    free: f64,
) -> Option<Root<S>> {
    let k = |x: f64| Quad::all(a.simd(), x);
    let (size, square) = (a * a + b * b, c * c);
    let rest = size - square;
    let (is_any, is_stretched) = (size.below(k(1e-24)), rest.below(k(0.0)));
    let reaches = (size * k((1.0 + SLACK) * (1.0 + SLACK))).reaches(square);
    let holds = if is_any.is_nowhere() {
        reaches
    } else {
        (is_any.not() & reaches) | (is_any & c.abs().below(k(1e-9)))
    };
    if holds.is_nowhere() {
        return None;
    }
    let side = sign * rest.max(k(0.0)).sqrt();
    let (sin, cos) = (b * c + a * side, a * c - b * side);
    let turn = if (is_stretched | is_any).is_nowhere() {
        // The root of their squares is known: it takes longer than all the rest.
        let scale = k(1.0) / size;
        Turn { sin: sin * scale, cos: cos * scale }
    } else {
        unit(sin, cos, free, 1e-36)
    };
    let is_clear = (k(CLEAR) * size).below(rest);
    Some(Root { turn, side, lack: -rest, size, holds, is_stretched, is_clear })
}

/// Returns the turn towards a direction; `free`, rad, where the direction's square is no more than `least`.
#[inline(always)]
pub(super) fn unit<S: Wide>(sin: Quad<S>, cos: Quad<S>, free: f64, least: f64) -> Turn<S> {
    let k = |x: f64| Quad::all(sin.simd(), x);
    let squared = sin * sin + cos * cos;
    let points = k(least).below(squared);
    let scale = k(1.0) / squared.sqrt();
    let turn = Turn { sin: sin * scale, cos: cos * scale };
    if points.is_everywhere() { turn } else { turn.or(points, free) }
}

impl<S: Wide> Turn<S> {
    /// Returns the sine of the turn from another, given by its sine and cosine.
    #[inline(always)]
    pub(super) fn sin_from(&self, (sin, cos): (f64, f64)) -> Quad<S> {
        let k = |x: f64| Quad::all(self.sin.simd(), x);
        self.sin * k(cos) - self.cos * k(sin)
    }

    /// Returns the cosine of the turn from another.
    #[inline(always)]
    pub(super) fn cos_from(&self, (sin, cos): (f64, f64)) -> Quad<S> {
        let k = |x: f64| Quad::all(self.sin.simd(), x);
        self.cos * k(cos) + self.sin * k(sin)
    }

    /// Keeps the turn in some lanes and takes an angle, rad, in the others.
    #[cold]
    fn or(self, kept: Marks<S>, free: f64) -> Self {
        let (s, c) = free.sin_cos();
        let k = |x: f64| Quad::all(self.sin.simd(), x);
        Self { sin: kept.pick(self.sin, k(s)), cos: kept.pick(self.cos, k(c)) }
    }
}
