//! What the limits of single joints say of a branch of the closed form before it is worked out to the end.
//!
//! The first pass leaves out the wrist's small offset, so its angles are nearly right. Where one of them is outside its
//! range by more than that error can be, the branch is no solution, and how far it is outside is known well enough
//! to compare.

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use std::f64::consts::PI;

use super::lanes::Wide;
use super::quad::{Marks, Quad};
use super::robot::Robot;
use super::turn::Turn;

/// The range of one joint, seen from its middle.
#[derive(Debug, Clone, Copy)]
struct Range {
    /// Sine and cosine of the middle.
    middle: (f64, f64),
    /// Half its width, rad.
    half: f64,
    /// The cosine at its ends and the blur beyond.
    end: f64,
}

/// The ranges of the joints that have any, those only that are worked out.
#[derive(Debug, Clone)]
pub(super) struct Gate {
    ranges: [Option<Range>; 7],
}

impl Gate {
    /// Returns the gate for angles that may be off by `blur`, rad; `zero` are the angles of joints that read 0.
    pub(super) fn of(robot: &Robot, zero: &[f64; 7], blur: f64) -> Self {
        let mut ranges = [None; 7];
        for (i, joint) in robot.joints().iter().enumerate().filter(|(i, _)| *i != 2) {
            let middle = 0.5 * (joint.lower + joint.upper);
            let half = 0.5 * (joint.upper - joint.lower);
            // A range of a whole turn shuts nothing out.
            if middle.is_finite() && half + blur < PI {
                let end = (half + blur).cos();
                ranges[i] = Some(Range { middle: (middle + zero[i]).sin_cos(), half, end });
            }
        }
        Self { ranges }
    }

    /// Returns which of four branches are outside some range by more than the blur.
    #[inline(always)]
    pub(super) fn shuts<S: Wide>(&self, simd: S, turns: &[Turn<S>; 7]) -> Marks<S> {
        let mut shut = Quad::all(simd, 0.0).below(Quad::all(simd, 0.0));
        for (range, turn) in self.ranges.iter().zip(turns) {
            if let Some(range) = range {
                shut = shut | turn.cos_from(range.middle).below(Quad::all(simd, range.end));
            }
        }
        shut
    }

    /// Returns how far four branches are outside the ranges at most, rad.
    #[inline(always)]
    pub(super) fn beyond<S: Wide>(&self, simd: S, turns: &[Turn<S>; 7]) -> [f64; 4] {
        let mut most = Quad::all(simd, f64::NEG_INFINITY);
        for (range, turn) in self.ranges.iter().zip(turns) {
            if let Some(range) = range {
                let (sin, cos) = (turn.sin_from(range.middle).abs(), turn.cos_from(range.middle));
                most = most.max(sin.angle(cos) - Quad::all(simd, range.half));
            }
        }
        most.lanes()
    }
}
