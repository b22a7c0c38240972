//! The turn of a joint by its sine and cosine, in four branches of the closed form at once, and where
//! `a cos x + b sin x = c`. Angles are not worked out here.

#![expect(clippy::inline_always, reason = "what is not inlined into `widest` misses the registers")]

use wide::f64x4;

/// A root is clear of the other when the square of the sine between them is above this.
const CLEAR: f64 = 0.01;
/// A stretched arm: rounding, or the wrist offset that the first pass leaves out, may put the target
/// this much (relative) out of reach; the polish then decides.
const SLACK: f64 = 1e-3;

/// A sine and a cosine for each of four branches.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    pub(super) sin: f64x4,
    pub(super) cos: f64x4,
}

/// One of the two roots, in four branches.
pub(super) struct Root {
    pub(super) turn: Turn,
    /// Where there is one.
    pub(super) holds: f64x4,
    /// Where the slack was needed.
    pub(super) is_stretched: f64x4,
    /// Where it is far from the other root.
    pub(super) is_clear: f64x4,
}

/// Returns the root of `a cos x + b sin x = c` that `sign` picks, `free` where any `x` will do; `None` where there is
/// none in any branch.
#[inline(always)]
pub(super) fn root(a: f64x4, b: f64x4, c: f64x4, sign: f64x4, free: f64) -> Option<Root> {
    let size = a * a + b * b;
    let is_any = size.simd_lt(f64x4::splat(1e-24));
    let most = f64x4::splat((1.0 + SLACK) * (1.0 + SLACK));
    let reaches = (size * most).simd_ge(c * c);
    let holds = (!is_any & reaches) | (is_any & c.abs().simd_lt(f64x4::splat(1e-9)));
    if holds.none() {
        return None;
    }
    let rest = size - c * c;
    let side = sign * rest.max(f64x4::ZERO).sqrt();
    let (sin, cos) = (b * c + a * side, a * c - b * side);
    let turn = if (rest.simd_ge(f64x4::ZERO) & !is_any).all() {
        // The root of their squares is known: it takes longer than all the rest.
        let scale = f64x4::ONE / size;
        Turn { sin: sin * scale, cos: cos * scale }
    } else {
        unit(sin, cos, free, 1e-36)
    };
    let (is_stretched, is_clear) =
        (rest.simd_lt(f64x4::ZERO), rest.simd_gt(f64x4::splat(CLEAR) * size));
    Some(Root { turn, holds, is_stretched, is_clear })
}

/// Returns the turn towards a direction; `free`, rad, where the direction's square is no more than `least`.
#[inline(always)]
pub(super) fn unit(sin: f64x4, cos: f64x4, free: f64, least: f64) -> Turn {
    let squared = sin * sin + cos * cos;
    let points = squared.simd_gt(f64x4::splat(least));
    let scale = f64x4::ONE / squared.sqrt();
    let turn = Turn { sin: sin * scale, cos: cos * scale };
    if points.all() { turn } else { turn.or(points, free) }
}

impl Turn {
    /// Returns the sine of the turn from another, given by its sine and cosine.
    #[inline]
    pub(super) fn sin_from(&self, (sin, cos): (f64, f64)) -> f64x4 {
        self.sin * f64x4::splat(cos) - self.cos * f64x4::splat(sin)
    }

    /// Returns the cosine of the turn from another.
    #[inline]
    pub(super) fn cos_from(&self, (sin, cos): (f64, f64)) -> f64x4 {
        self.cos * f64x4::splat(cos) + self.sin * f64x4::splat(sin)
    }

    /// Keeps the turn in some lanes and takes an angle, rad, in the others.
    #[cold]
    fn or(self, kept: f64x4, free: f64) -> Self {
        let (s, c) = free.sin_cos();
        Self {
            sin: kept.bitselect(self.sin, f64x4::splat(s)),
            cos: kept.bitselect(self.cos, f64x4::splat(c)),
        }
    }
}
