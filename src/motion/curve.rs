//! Curves in joint space without time: straight edges with rounded corners, or a spline through points.
//!
//! A curve has a parameter `s` from 0 to its length and two continuous derivatives, so that a smooth
//! `s(t)` gives continuous accelerations. Timing it is [`super::trajectory`].

use super::polyline::{l2, mix};

/// A point of a curve and its first three derivatives by `s`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct At {
    pub(super) q: Vec<f64>,
    pub(super) dq: Vec<f64>,
    pub(super) ddq: Vec<f64>,
    /// On the side that was asked for, where two stretches meet.
    pub(super) dddq: Vec<f64>,
}

impl At {
    /// Returns memory for a point of so many joints.
    pub(super) fn new(joints: usize) -> Self {
        let none = || vec![0.0; joints];
        Self { q: none(), dq: none(), ddq: none(), dddq: none() }
    }
}

/// What a stretch of a curve is, by where its numbers begin, one list of all joints after the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Piece {
    /// From one point straight to another.
    Line(usize),
    /// A corner rounded by a Bézier curve of degree 5 whose ends are straight: control points `from`,
    /// half-way to the corner, twice the corner, half-way on, `to`. Its numbers: `from`, the corner, `to`.
    Corner(usize),
    /// A cubic by its end points and slopes: `from`, the slope there, `to`, the slope there.
    Cubic(usize),
}

/// A curve, constant.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Curve {
    joints: usize,
    pieces: Vec<Piece>,
    numbers: Vec<f64>,
    /// Where each piece begins, and where the last ends.
    knots: Vec<f64>,
}

impl Curve {
    /// Returns the polyline through `corners` with corner `i` cut `cuts[i]` rad before and after it; ends
    /// have no cut. Neighbouring corners must differ.
    pub(super) fn rounded(corners: &[Vec<f64>], cuts: &[f64]) -> Self {
        let joints = corners[0].len();
        let mut curve = Self { joints, pieces: Vec::new(), numbers: Vec::new(), knots: vec![0.0] };
        let mut at = corners[0].clone();
        for i in 1..corners.len() {
            let (before, corner) = (&corners[i - 1], &corners[i]);
            let edge = l2(before, corner);
            let cut = if i + 1 < corners.len() { cuts[i] } else { 0.0 };
            let to = if cut > 0.0 { mix(corner, before, cut / edge) } else { corner.clone() };
            let straight = l2(&at, &to);
            if straight > 1e-12 {
                curve.push(Piece::Line, &[&at, &to], straight);
            }
            at = to;
            if cut > 0.0 {
                let next = mix(corner, &corners[i + 1], cut / l2(corner, &corners[i + 1]));
                // At its ends the Bézier curve moves 5/2 of the cut per unit of its own parameter: with
                // this length `s` runs at unit speed there, as on the straight edges.
                curve.push(Piece::Corner, &[&at, corner, &next], 2.5 * cut);
                at = next;
            }
        }
        curve
    }

    fn push(&mut self, piece: fn(usize) -> Piece, lists: &[&[f64]], size: f64) {
        self.pieces.push(piece(self.numbers.len()));
        for list in lists {
            self.numbers.extend_from_slice(list);
        }
        self.knots.push(self.length() + size);
    }

    /// Returns the cubic spline with two continuous derivatives through `points` at parameters `knots`,
    /// with the slopes given at its ends.
    ///
    /// Source: de Boor, *A Practical Guide to Splines*, 1978, chapter IV (complete spline).
    pub(super) fn spline(knots: &[f64], points: &[Vec<f64>], ends: [&[f64]; 2]) -> Self {
        let (n, dof) = (points.len(), points[0].len());
        let h: Vec<f64> = knots.windows(2).map(|k| k[1] - k[0]).collect();
        // Points and slopes in turn.
        let mut numbers = Vec::with_capacity(2 * n * dof);
        for point in points {
            numbers.extend_from_slice(point);
            numbers.resize(numbers.len() + dof, 0.0);
        }
        let slope = |i: usize, j: usize| (2 * i + 1) * dof + j;
        let last = slope(n - 1, 0);
        numbers[dof..2 * dof].copy_from_slice(ends[0]);
        numbers[last..].copy_from_slice(ends[1]);
        // Tridiagonal: h_i m_{i-1} + 2 (h_{i-1} + h_i) m_i + h_{i-1} m_{i+1} = right-hand side.
        let mut upper = vec![0.0; n];
        for i in 1..n - 1 {
            let pivot = 2.0 * (h[i - 1] + h[i]) - h[i] * upper[i - 1];
            upper[i] = h[i - 1] / pivot;
            for j in 0..dof {
                let secant = |i: usize| (points[i + 1][j] - points[i][j]) / h[i];
                let right = 3.0 * (h[i] * secant(i - 1) + h[i - 1] * secant(i));
                let right = if i + 2 == n { right - h[i - 1] * ends[1][j] } else { right };
                numbers[slope(i, j)] = (right - h[i] * numbers[slope(i - 1, j)]) / pivot;
            }
        }
        for i in (1..n.saturating_sub(2)).rev() {
            for j in 0..dof {
                let next = numbers[slope(i + 1, j)];
                numbers[slope(i, j)] -= upper[i] * next;
            }
        }
        let pieces = (0..n - 1).map(|i| Piece::Cubic(2 * i * dof)).collect();
        Self { joints: dof, pieces, numbers, knots: knots.to_vec() }
    }

    /// Returns the spline through `points` by chord length, its end slopes those of parabolas.
    pub(super) fn through(points: &[Vec<f64>]) -> Self {
        let mut knots = vec![0.0];
        for edge in points.windows(2) {
            let last = *knots.last().expect("it begins with one");
            knots.push(last + l2(&edge[0], &edge[1]));
        }
        let n = points.len();
        let slope = |a: usize, b: usize, c: usize| -> Vec<f64> {
            let (h, k) = (knots[b] - knots[a], knots[c] - knots[a]);
            (0..points[a].len())
                .map(|j| {
                    let (u, v) =
                        ((points[b][j] - points[a][j]) / h, (points[c][j] - points[a][j]) / k);
                    u + (u - v) * h / (k - h)
                })
                .collect()
        };
        let ends = if n == 2 {
            let straight: Vec<f64> =
                points[0].iter().zip(&points[1]).map(|(a, b)| (b - a) / knots[1]).collect();
            [straight.clone(), straight]
        } else {
            [slope(0, 1, 2), slope(n - 1, n - 2, n - 3)]
        };
        Self::spline(&knots, points, [&ends[0], &ends[1]])
    }

    pub(super) fn length(&self) -> f64 {
        *self.knots.last().expect("it holds at least the start")
    }

    /// Returns the parameters where pieces meet, ends included.
    pub(super) fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Returns the stretches, in order.
    pub(super) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Returns lists of all joints, from where the numbers of a stretch begin.
    #[inline]
    pub(super) fn lists<const N: usize>(&self, begin: usize) -> [&[f64]; N] {
        let n = self.joints;
        std::array::from_fn(|k| &self.numbers[begin + k * n..begin + (k + 1) * n])
    }

    /// Returns whether a stretch is straight.
    pub(super) fn is_straight(&self, piece: usize) -> bool {
        matches!(self.pieces[piece], Piece::Line(_))
    }

    /// Returns the end point itself, free of rounding.
    pub(super) fn end(&self) -> &[f64] {
        self.to(self.pieces.len() - 1)
    }

    /// Returns the point at which a stretch ends.
    fn to(&self, piece: usize) -> &[f64] {
        let [to] = match self.pieces[piece] {
            Piece::Line(at) => self.lists(at + self.joints),
            Piece::Corner(at) | Piece::Cubic(at) => self.lists(at + 2 * self.joints),
        };
        to
    }

    /// Evaluates the curve at `s`, clamped to its ends.
    pub(super) fn at(&self, s: f64) -> At {
        let mut out = At::new(self.end().len());
        self.on_piece(self.piece_at(s), s, &mut out);
        out
    }

    /// Returns which stretch `s` lies on, the later one where two meet.
    pub(super) fn piece_at(&self, s: f64) -> usize {
        self.knots.partition_point(|knot| *knot <= s).clamp(1, self.pieces.len()) - 1
    }

    /// Returns the point at `s`, clamped to the ends.
    pub(super) fn place(&self, s: f64) -> Vec<f64> {
        let mut q = vec![0.0; self.end().len()];
        self.place_into(s, &mut q);
        q
    }

    /// As [`Self::place`], into memory that is there already.
    pub(super) fn place_into(&self, s: f64, q: &mut [f64]) {
        self.place_on(self.piece_at(s), s, q);
    }

    /// As [`Self::at`], of the stretch numbered `piece`, into memory that is there already.
    fn on_piece(&self, piece: usize, s: f64, out: &mut At) {
        self.slopes(piece, s, out);
        self.place_on(piece, s, &mut out.q);
    }

    fn place_on(&self, piece: usize, s: f64, out: &mut [f64]) {
        let u = self.share(piece, s);
        let h = self.knots[piece + 1] - self.knots[piece];
        if u >= 1.0 {
            out.copy_from_slice(self.to(piece));
            return;
        }
        match self.pieces[piece] {
            Piece::Line(at) => {
                let [from, to] = self.lists(at);
                for (q, (from, to)) in out.iter_mut().zip(from.iter().zip(to)) {
                    *q = from + u * (to - from);
                }
            }
            Piece::Corner(at) => {
                let [from, corner, to] = self.lists(at);
                let ([a, ..], [b, ..]) = bend(u);
                for (i, q) in out.iter_mut().enumerate() {
                    *q = from[i] + a * (corner[i] - from[i]) + b * (to[i] - corner[i]);
                }
            }
            Piece::Cubic(at) => {
                let [from, slope_from, to, slope_to] = self.lists(at);
                for (i, q) in out.iter_mut().enumerate() {
                    let (a, b, d) = (h * slope_from[i], h * slope_to[i], to[i] - from[i]);
                    *q = from[i] + u * (a + u * (3.0 * d - 2.0 * a - b + u * (a + b - 2.0 * d)));
                }
            }
        }
    }

    /// How far through the stretch numbered `piece` one is at `s`: 0 to 1.
    fn share(&self, piece: usize, s: f64) -> f64 {
        let [begin, end] = [self.knots[piece], self.knots[piece + 1]];
        (s.clamp(0.0, self.length()) - begin) / (end - begin)
    }

    /// As [`Self::on_piece`], the derivatives alone.
    pub(super) fn slopes(&self, piece: usize, s: f64, out: &mut At) {
        let u = self.share(piece, s);
        let h = self.knots[piece + 1] - self.knots[piece];
        let n = out.dq.len();
        let (dq, ddq, dddq) = (&mut out.dq[..n], &mut out.ddq[..n], &mut out.dddq[..n]);
        let per = [h.recip(), h.powi(-2), h.powi(-3)];
        match self.pieces[piece] {
            Piece::Line(at) => {
                let [from, to] = self.lists(at);
                let (from, to) = (&from[..n], &to[..n]);
                for i in 0..n {
                    dq[i] = (to[i] - from[i]) * per[0];
                }
                ddq.fill(0.0);
                dddq.fill(0.0);
            }
            Piece::Corner(at) => {
                let [from, corner, to] = self.lists(at);
                let ([_, a1, a2, a3], [_, b1, b2, b3]) = bend(u);
                let [a1, b1] = [a1, b1].map(|weight| weight * per[0]);
                let [a2, b2] = [a2, b2].map(|weight| weight * per[1]);
                let [a3, b3] = [a3, b3].map(|weight| weight * per[2]);
                let (from, corner, to) = (&from[..n], &corner[..n], &to[..n]);
                for i in 0..n {
                    let (a, b) = (corner[i] - from[i], to[i] - corner[i]);
                    dq[i] = a1 * a + b1 * b;
                    ddq[i] = a2 * a + b2 * b;
                    dddq[i] = a3 * a + b3 * b;
                }
            }
            Piece::Cubic(at) => {
                let [from, slope_from, to, slope_to] = self.lists(at);
                let (from, to) = (&from[..n], &to[..n]);
                let (slope_from, slope_to) = (&slope_from[..n], &slope_to[..n]);
                for i in 0..n {
                    let (a, b) = (h * slope_from[i], h * slope_to[i]);
                    let d = to[i] - from[i];
                    // Hermite: from + a u + (3d - 2a - b) u² + (a + b - 2d) u³.
                    let (c2, c3) = (3.0 * d - 2.0 * a - b, a + b - 2.0 * d);
                    dq[i] = (a + u * (2.0 * c2 + 3.0 * u * c3)) * per[0];
                    ddq[i] = (2.0 * c2 + 6.0 * u * c3) * per[1];
                    dddq[i] = 6.0 * c3 * per[2];
                }
            }
        }
    }
}

/// How much of its first and of its second leg a rounded corner has run through at `u`, and three derivatives of each.
///
/// The hodograph of the Bézier curve has the first leg at its first two control points, the second at its last two.
#[inline]
pub(super) fn bend(u: f64) -> ([f64; 4], [f64; 4]) {
    let second = |u: f64| {
        let uu = u * u;
        let [first, bends] = [2.5 * uu * u * (4.0 - 3.0 * u), 30.0 * uu * (1.0 - u)];
        [uu * uu * (2.5 - 1.5 * u), first, bends, u * (60.0 - 90.0 * u)]
    };
    // The first leg is the second, run through backwards.
    let [value, first, bends, third] = second(1.0 - u);
    ([1.0 - value, first, -bends, third], second(u))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn smooth(curve: &Curve) {
        let h = 1e-6;
        let n = 400;
        for k in 1..n {
            let s = curve.length() * f64::from(k) / f64::from(n);
            let (before, here, after) = (curve.at(s - h), curve.at(s), curve.at(s + h));
            for i in 0..here.q.len() {
                let first = (after.q[i] - before.q[i]) / (2.0 * h);
                assert!((first - here.dq[i]).abs() < 1e-6, "s {s}");
                // The third derivative is bounded, so this also says that none jumps.
                assert!((after.dq[i] - before.dq[i] - 2.0 * h * here.ddq[i]).abs() < 1e-9, "s {s}");
                let bend = (after.ddq[i] - before.ddq[i]) / (2.0 * h);
                let meets = curve.knots().iter().any(|knot| (knot - s).abs() <= h);
                assert!(meets || (bend - here.dddq[i]).abs() < 1e-4, "s {s}: {bend}");
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_curve_and_do_not_jump() {
        let corners = [vec![0.0, 0.0], vec![1.0, 0.0], vec![1.0, 0.8], vec![0.2, 1.0]];
        let curve = Curve::rounded(&corners, &[0.0, 0.3, 0.4, 0.0]);
        smooth(&curve);
        assert_eq!(curve.at(0.0).q, corners[0]);
        assert_eq!(curve.at(curve.length()).q, corners[3]);
        let points: Vec<Vec<f64>> =
            (0..20).map(|k| f64::from(k) * 0.1).map(|t| vec![t.sin(), t.cos(), t * t]).collect();
        let curve = Curve::through(&points);
        smooth(&curve);
        for (k, point) in points.iter().enumerate() {
            assert!(l2(&curve.at(curve.knots()[k]).q, point) < 1e-12);
        }
    }
}
