//! One pass of the closed form ([`super::closed_form`]): four branches at once, by triangles, for a wrist centre that is known.
//!
//! Where the wrist centre is, and how often a pass is made, is not decided here.
//!
//! Source: as there.

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use nalgebra::Vector3;

use super::closed_form::ClosedForm;
use super::frames::Frame;
use super::lanes::Wide;
use super::quad::{Marks, Quad};
use super::turn::{Turn, root, unit};

/// A root that is out of reach by more, of its size and of the forearm's, is none: a polish puts right ten thousand times less.
const HOPELESS: [f64; 2] = [1e-5, 1e-12];
/// The wrist's bearing is clear when the square of how far it points is above this, against the forearm's.
const CLEAR: f64 = 0.01;

/// Three numbers for each of four branches.
pub(super) type Three<S> = [Quad<S>; 3];

/// What is the same for all branches and passes.
pub(super) struct Target<'w, S> {
    pub(super) simd: S,
    pub(super) turn: &'w Frame,
    pub(super) q3: (f64, f64),
    pub(super) near: &'w [f64; 7],
}

/// Where four branches stand after a pass.
#[derive(Clone, Copy)]
pub(super) struct Pass<S: Wide> {
    pub(super) turns: [Turn<S>; 7],
    /// The wrist centre it was made for, m.
    pub(super) wrist: Three<S>,
    /// The same before joint 2 turns it, and then how far ahead it is.
    pub(super) arm: Three<S>,
    pub(super) ahead: Quad<S>,
    /// Slopes of the roots for joints 4 and 2.
    pub(super) sides: [Quad<S>; 2],
    /// Lanes in which there is a solution.
    pub(super) holds: Marks<S>,
    /// Lanes in which a root was out of reach by less than the slack.
    pub(super) is_stretched: Marks<S>,
    /// Lanes in which one was by [`HOPELESS`], and the wrist is not stretched: joint 7 says where it is.
    pub(super) is_hopeless: Marks<S>,
    /// Lanes in which no root and no bearing is anywhere near where it ceases to be one.
    pub(super) is_clear: Marks<S>,
}

impl ClosedForm {
    /// Solves for four branches with the wrist centre at `w`; `None` where none of them has a solution.
    #[inline(always)]
    pub(super) fn pass<S: Wide>(
        &self,
        w: &Three<S>,
        target: &Target<'_, S>,
        elbow: Quad<S>,
    ) -> Option<Pass<S>> {
        let simd = target.simd;
        let k = |x: f64| Quad::all(simd, x);
        let (s3, c3) = (k(target.q3.0), k(target.q3.1));
        let (d2, l1, d4, l2) = (k(self.d2), k(self.l1), k(self.d4), k(self.l2));
        let near = |i: usize| target.near[i];
        // |w|² in q4: A cos q4 + B sin q4 = C.
        let two = k(2.0);
        let fixed = d2 * d2 + l1 * l1 + d4 * d4 + l2 * l2 + two * d2 * d4 * c3;
        let across = w[0] * w[0] + w[1] * w[1];
        let length = across + w[2] * w[2];
        let four = root(two * l1 * l2, two * d2 * l2 * s3, length - fixed, elbow, near(3))?;
        let (holds4, out4, clear4) = (four.holds, four.is_stretched, four.is_clear);
        let hopeless = |lack: Quad<S>, size: Quad<S>| {
            (k(HOPELESS[0]) * size + k(HOPELESS[1]) * l2 * l2).below(lack)
        };
        let hopeless4 = hopeless(four.lack, four.size);
        let (side4, four) = (four.side, four.turn);
        // The wrist before joint 2 turns it.
        let (x, y, z) =
            (c3 * l2 * four.sin - s3 * d4, s3 * l2 * four.sin + c3 * d4 + d2, l1 + l2 * four.cos);
        // Height: z cos q2 - x sin q2.
        let two = root(z, -x, w[2], Quad::of(simd, [1.0, -1.0, 1.0, -1.0]), near(1))?;
        let (holds2, out2, clear2) = (two.holds, two.is_stretched, two.is_clear);
        let hopeless2 = hopeless(two.lack, two.size);
        let (side2, two) = (two.side, two.turn);
        let holds = holds2 & holds4;
        if holds.is_nowhere() {
            return None;
        }
        let ahead = two.cos * x + two.sin * z;
        let one = unit(ahead * w[1] - y * w[0], ahead * w[0] + y * w[1], near(0), 1e-18);
        // What rotation is left for the wrist: Z5 Y6 Z7, by columns.
        let wanted = target.turn;
        let mut left = [three(simd, &wanted.x), three(simd, &wanted.y), three(simd, &wanted.z)];
        for column in &mut left {
            let [x, y, z] = *column;
            let (x, y) = (one.cos * x + one.sin * y, one.cos * y - one.sin * x);
            let (x, z) = (two.cos * x - two.sin * z, two.sin * x + two.cos * z);
            let (x, y) = (c3 * x + s3 * y, c3 * y - s3 * x);
            let (x, z) = (four.cos * x - four.sin * z, four.sin * x + four.cos * z);
            *column = [x, y, z];
        }
        let flip = Quad::of(simd, [1.0, 1.0, -1.0, -1.0]);
        let [to_x, to_y, to_z] = left[2];
        let five = unit(flip * to_y, flip * to_x, near(4), 1e-18);
        let six = Turn { sin: to_x * five.cos + to_y * five.sin, cos: to_z };
        let seven = Turn {
            sin: five.cos * left[0][1] - five.sin * left[0][0],
            cos: five.cos * left[1][1] - five.sin * left[1][0],
        };
        let three = Turn { sin: s3, cos: c3 };
        Some(Pass {
            turns: [one, two, three, four, five, six, seven],
            wrist: *w,
            arm: [x, y, z],
            ahead,
            sides: [side4, side2],
            holds,
            is_stretched: out2 | out4,
            is_hopeless: (hopeless2 | hopeless4) & k(CLEAR).below(six.sin * six.sin),
            is_clear: clear2 & clear4 & across.reaches(k(CLEAR) * l2 * l2),
        })
    }

    /// Returns what each of the joints that are worked out turns, rad, as the wrist centre moves by `by`, m, and the hand does not turn; to first
    /// order.
    #[inline(always)]
    pub(super) fn step<S: Wide>(
        &self,
        pass: &Pass<S>,
        target: &Target<'_, S>,
        by: &Three<S>,
    ) -> [Quad<S>; 6] {
        let k = |x: f64| Quad::all(target.simd, x);
        let (s3, c3) = (k(target.q3.0), k(target.q3.1));
        let [_, two, _, four, five, six, _] = &pass.turns;
        let (w, [_, y, _], [side4, side2]) = (&pass.wrist, pass.arm, pass.sides);
        // The three equations of a pass, each by its slope.
        let longer = w[0] * by[0] + w[1] * by[1] + w[2] * by[2];
        let turn4 = k(-2.0) * longer / side4;
        let swung = k(self.l2) * turn4;
        let (dx, dy, dz) = (c3 * four.cos * swung, s3 * four.cos * swung, -(four.sin * swung));
        let turn2 = (two.cos * dz - two.sin * dx - by[2]) / side2;
        let farther = two.cos * dx + two.sin * dz + w[2] * turn2;
        let across = w[0] * w[0] + w[1] * w[1];
        let turn1 = ((w[0] * by[1] - w[1] * by[0]) - (pass.ahead * dy - y * farther)) / across;
        // The forearm's turn in its own axes; the wrist undoes it.
        let (up_x, up_y) = (-(c3 * two.sin), s3 * two.sin);
        let turned = turn1 * up_x + turn2 * s3;
        let lifted = turn1 * two.cos;
        let about_x = four.sin * lifted - four.cos * turned;
        let about_y = -(turn1 * up_y + turn2 * c3 + turn4);
        let about_z = -(four.sin * turned + four.cos * lifted);
        let turn6 = five.cos * about_y - five.sin * about_x;
        let turn7 = (five.cos * about_x + five.sin * about_y) / six.sin;
        let turn5 = about_z - six.cos * turn7;
        [turn1, turn2, turn4, turn5, turn6, turn7]
    }
}

#[inline(always)]
pub(super) fn three<S: Wide>(simd: S, v: &Vector3<f64>) -> Three<S> {
    [Quad::all(simd, v.x), Quad::all(simd, v.y), Quad::all(simd, v.z)]
}
