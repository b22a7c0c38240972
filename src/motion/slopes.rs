//! The derivatives of a curve, four joints at once ([`super::quad`]).
//!
//! What [`super::curve`] says of its stretches is multiplied out once; a look adds up three lists of four joints, or two on a
//! corner, whose weights all joints share. Empty lanes hold noughts. Where the curve is, is not asked here.

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use super::curve::{Curve, Piece, bend};
use super::lanes::Wide;
use super::quad::Quad;

/// Four joints.
pub(super) type Four = [f64; 4];

/// A curve's derivatives.
pub(super) struct Slopes<'c> {
    curve: &'c Curve,
    /// Lists of four joints a stretch.
    fours: usize,
    stretches: Vec<Stretch>,
    /// Of what is no corner the derivatives at its start. Of a corner its two legs.
    legs: Vec<[Four; 3]>,
}

/// Where a stretch begins, one over its length, and whether it is a corner.
#[derive(Clone, Copy)]
struct Stretch {
    begin: f64,
    per: f64,
    bends: bool,
}

/// Puts one number a joint into lists of four.
pub(super) fn in_fours(numbers: impl ExactSizeIterator<Item = f64>, empty: f64) -> Vec<Four> {
    let mut fours = vec![[empty; 4]; numbers.len().div_ceil(4)];
    for (i, x) in numbers.enumerate() {
        fours[i / 4][i % 4] = x;
    }
    fours
}

impl<'c> Slopes<'c> {
    pub(super) fn of(curve: &'c Curve) -> Self {
        let fours = curve.end().len().div_ceil(4);
        let knots = curve.knots();
        let mut stretches = Vec::with_capacity(knots.len());
        let mut legs = vec![[[0.0; 4]; 3]; (knots.len() - 1) * fours];
        for (k, piece) in curve.pieces().iter().enumerate() {
            let per = (knots[k + 1] - knots[k]).recip();
            let bends = matches!(piece, Piece::Corner(_));
            stretches.push(Stretch { begin: knots[k], per, bends });
            let mut put = |i: usize, each: [f64; 3]| {
                for (leg, x) in legs[k * fours + i / 4].iter_mut().zip(each) {
                    leg[i % 4] = x;
                }
            };
            match *piece {
                Piece::Line(at) => {
                    let [from, to] = curve.lists(at);
                    for (i, (from, to)) in from.iter().zip(to).enumerate() {
                        put(i, [(to - from) * per, 0.0, 0.0]);
                    }
                }
                Piece::Corner(at) => {
                    let [from, corner, to] = curve.lists(at);
                    for i in 0..from.len() {
                        put(i, [corner[i] - from[i], to[i] - corner[i], 0.0]);
                    }
                }
                Piece::Cubic(at) => {
                    let [from, slope_from, to, slope_to] = curve.lists(at);
                    for i in 0..from.len() {
                        let (a, b) = (slope_from[i], slope_to[i]);
                        let d = (to[i] - from[i]) * per;
                        let second = (6.0 * d - 4.0 * a - 2.0 * b) * per;
                        put(i, [a, second, 6.0 * (a + b - 2.0 * d) * (per * per)]);
                    }
                }
            }
        }
        Self { curve, fours, stretches, legs }
    }

    pub(super) fn curve(&self) -> &'c Curve {
        self.curve
    }

    /// Returns a stretch.
    #[inline]
    pub(super) fn on(&self, piece: usize) -> On<'_> {
        let legs = &self.legs[piece * self.fours..][..self.fours];
        On { stretch: self.stretches[piece], legs }
    }
}

/// A stretch of a curve, of which derivatives are asked for.
#[derive(Clone, Copy)]
pub(super) struct On<'s> {
    stretch: Stretch,
    legs: &'s [[Four; 3]],
}

impl On<'_> {
    /// Gives the first three derivatives at `s` to `each`, four joints after the other.
    #[inline(always)]
    pub(super) fn at<S: Wide>(&self, simd: S, s: f64, each: impl FnMut(usize, [Quad<S>; 3])) {
        // Loops of known length are unrolled: two lists are those of most arms.
        match <&[_; 2]>::try_from(self.legs) {
            Ok(two) => self.sized(simd, two, s, each),
            Err(_) => self.sized(simd, self.legs, s, each),
        }
    }

    #[inline(always)]
    fn sized<S: Wide>(
        &self,
        simd: S,
        legs: &[[Four; 3]],
        s: f64,
        mut each: impl FnMut(usize, [Quad<S>; 3]),
    ) {
        let Stretch { begin, per, bends } = self.stretch;
        let t = s - begin;
        if bends {
            let ([_, a1, a2, a3], [_, b1, b2, b3]) = bend((t * per).clamp(0.0, 1.0));
            let (p, pp, ppp) = (per, per * per, per * per * per);
            let all = |x: f64| Quad::all(simd, x);
            let (a1, a2, a3) = (all(a1 * p), all(a2 * pp), all(a3 * ppp));
            let (b1, b2, b3) = (all(b1 * p), all(b2 * pp), all(b3 * ppp));
            for (k, [first, second, _]) in legs.iter().enumerate() {
                let (a, b) = (Quad::of(simd, *first), Quad::of(simd, *second));
                each(k, [a1 * a + b1 * b, a2 * a + b2 * b, a3 * a + b3 * b]);
            }
        } else {
            let (t, half) = (Quad::all(simd, t), Quad::all(simd, 0.5 * t));
            for (k, [first, second, third]) in legs.iter().enumerate() {
                let (first, second) = (Quad::of(simd, *first), Quad::of(simd, *second));
                let third = Quad::of(simd, *third);
                each(k, [first + t * (second + half * third), second + t * third, third]);
            }
        }
    }

    /// Returns the largest sizes of three numbers of each joint, made of the derivatives at `s` by `of`, as shares: `per` has one over what
    /// each is measured by.
    #[inline(always)]
    pub(super) fn most<S: Wide>(
        &self,
        simd: S,
        s: f64,
        per: &[[Four; 3]],
        of: impl Fn([Quad<S>; 3]) -> [Quad<S>; 3],
    ) -> [f64; 3] {
        let none = Quad::all(simd, 0.0);
        let mut most = [none; 3];
        self.at(
            simd,
            s,
            #[inline(always)]
            |k, slopes| {
                let each = of(slopes);
                for i in 0..3 {
                    most[i] = most[i].max(each[i].abs() * Quad::of(simd, per[k][i]));
                }
            },
        );
        let [a, b, c, _] = Quad::largest([most[0], most[1], most[2], none]).lanes();
        [a, b, c]
    }
}

#[cfg(test)]
mod tests {
    use super::super::curve::At;
    use super::super::lanes::{Job, run};
    use super::*;

    /// All derivatives at a place, joint by joint.
    struct Asked<'s, 'c>(&'s Slopes<'c>, usize, f64);

    impl Job for Asked<'_, '_> {
        type Found = Vec<[Four; 3]>;

        #[inline(always)]
        fn with<S: Wide>(self, simd: S) -> Vec<[Four; 3]> {
            let mut found = Vec::new();
            self.0.on(self.1).at(simd, self.2, |_, each| found.push(each.map(Quad::lanes)));
            found
        }
    }

    #[test]
    fn derivatives_are_those_of_the_curve() {
        let corner = |k: usize| (0..5).map(|i| ((3 * i + 7 * k) as f64).sin()).collect();
        let corners: Vec<Vec<f64>> = (0..4).map(corner).collect();
        let [rounded, spline] =
            [Curve::rounded(&corners, &[0.0, 0.2, 0.3, 0.0]), Curve::through(&corners)];
        for curve in [rounded, spline] {
            let slopes = Slopes::of(&curve);
            let mut at = At::new(5);
            for k in 0..=100 {
                let s = curve.length() * f64::from(k) / 100.0;
                let piece = curve.piece_at(s);
                curve.slopes(piece, s, &mut at);
                let found = run(Asked(&slopes, piece, s));
                for i in 0..8 {
                    let found = found[i / 4].map(|four| four[i % 4]);
                    let of = |list: &[f64]| list.get(i).copied().unwrap_or(0.0);
                    for (found, wanted) in
                        found.iter().zip([&at.dq, &at.ddq, &at.dddq].map(|x| of(x)))
                    {
                        assert!((found - wanted).abs() < 1e-10 * (1.0 + wanted.abs()), "{s}");
                    }
                }
            }
        }
    }
}
