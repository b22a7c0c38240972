//! The frames of a robot in eight configurations of a straight joint motion, and how fast they move.
//!
//! As [`super::frames`], every number eight times and in single precision.

#![expect(clippy::inline_always, reason = "what is not inlined into the look misses the registers")]

use std::f64::consts::{FRAC_2_PI, TAU};

use super::frames::{Frames, Node};
use super::lanes::{Eight, LANES, Three, Vectors, Wide, packed, short};

/// A frame of eight configurations: its axes and its origin, in base coordinates.
pub(super) type Frame8 = [Vectors; 4];

/// One driven joint; see [`super::frames::Node`].
#[derive(Debug, Clone)]
pub(super) struct Joint {
    pub(super) parent: Option<usize>,
    pub(super) index: usize,
    pub(super) multiplier: f64,
    pub(super) offset: f64,
    pub(super) slides: bool,
    pub(super) shift: [f32; 3],
    /// Of the shift, m.
    pub(super) length: f64,
    before: Option<[f32; 2]>,
    tilt: Tilt,
    after: f64,
}

/// How far a joint's axis is tilted from that of the one before. Arms are made of right angles: these cost nothing.
#[derive(Debug, Clone, Copy)]
enum Tilt {
    None,
    /// By a quarter turn, to the left or to the right.
    Quarter {
        is_left: bool,
    },
    /// By an angle of this sine and cosine.
    By([f32; 2]),
}

impl Tilt {
    /// An angle as small as this, rad, is rounding.
    const ROUNDING: f64 = 1e-12;

    fn of((sin, cos): (f64, f64)) -> Self {
        if cos > 0.0 && sin.abs() < Self::ROUNDING {
            Self::None
        } else if cos.abs() < Self::ROUNDING {
            Self::Quarter { is_left: sin > 0.0 }
        } else {
            Self::By([sin as f32, cos as f32])
        }
    }
}

/// Returns the driven joints.
pub(super) fn joints(frames: &Frames) -> Vec<Joint> {
    let pair = |(sin, cos): (f64, f64)| [sin as f32, cos as f32];
    let joint = |node: &Node| Joint {
        parent: node.parent,
        index: node.index,
        multiplier: node.multiplier,
        offset: node.offset,
        slides: node.slides,
        shift: short(&node.shift),
        length: node.shift.norm(),
        before: node.before.map(pair),
        tilt: Tilt::of(node.tilt),
        after: node.after,
    };
    frames.nodes.iter().map(joint).collect()
}

/// Frames that are placed, and how fast they move.
#[derive(Debug, Default)]
pub(super) struct Placed8 {
    pub(super) frames: Vec<Frame8>,
    /// Of each frame: the speed of its origin, m for the whole way, and that of its turning, rad.
    pub(super) speeds: Vec<[Vectors; 2]>,
}

/// Places the frames of all joints at shares `at` of the straight joint motion between two ends; with `sweeps` their speeds
/// as well.
#[inline(always)]
pub(super) fn place<S: Wide>(
    simd: S,
    joints: &[Joint],
    ends: (&[f64], &[f64]),
    at: &[f64; LANES],
    sweeps: bool,
    placed: &mut Placed8,
) {
    let Placed8 { frames, speeds } = placed;
    frames.clear();
    speeds.clear();
    for joint in joints {
        let (from, to) = (ends.0[joint.index], ends.1[joint.index]);
        let along = Eight::of(simd, packed(at));
        let (first, rate) =
            (joint.multiplier * from + joint.offset, joint.multiplier * (to - from));
        let (sin, cos) = if joint.slides {
            sin_cos(Eight::all(simd, joint.after as f32))
        } else {
            // Whole turns are taken out where they cost no digits.
            let angle = first + joint.after;
            let angle = (angle - (angle / TAU).round_ties_even() * TAU) as f32;
            sin_cos(Eight::all(simd, angle) + along * Eight::all(simd, rate as f32))
        };
        let base;
        let [x, y, z, start] = if let Some(parent) = joint.parent {
            &frames[parent]
        } else {
            base = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]]
                .map(|axis| Three::all(simd, axis).lanes());
            &base
        };
        let (x, y, z) = (Three::of(simd, *x), Three::of(simd, *y), Three::of(simd, *z));
        let start = Three::of(simd, *start);
        let [a, b, c] = joint.shift;
        let mut origin = start;
        // Most shifts lie along one axis.
        for (axis, along) in [(x, a), (y, b), (z, c)] {
            if along != 0.0 {
                origin = origin + axis.scaled(Eight::all(simd, along));
            }
        }
        let (x, y) = match joint.before {
            Some([sin, cos]) => turned(x, y, Eight::all(simd, sin), Eight::all(simd, cos)),
            None => (x, y),
        };
        let (y, z) = match joint.tilt {
            Tilt::None => (y, z),
            Tilt::Quarter { is_left: true } => (z, Three::all(simd, [0.0; 3]) - y),
            Tilt::Quarter { is_left: false } => (Three::all(simd, [0.0; 3]) - z, y),
            Tilt::By([s, c]) => turned(y, z, Eight::all(simd, s), Eight::all(simd, c)),
        };
        if joint.slides {
            let value = Eight::all(simd, first as f32) + along * Eight::all(simd, rate as f32);
            origin = origin + z.scaled(value);
        }
        let (x, y) = turned(x, y, sin, cos);
        if sweeps {
            let still = Three::all(simd, [0.0; 3]).lanes();
            let [speed, turning] = joint.parent.map_or([still; 2], |parent| speeds[parent]);
            let (mut speed, mut turning) = (Three::of(simd, speed), Three::of(simd, turning));
            speed = speed + turning.cross(origin - start);
            let rate = Eight::all(simd, rate as f32);
            if joint.slides {
                speed = speed + z.scaled(rate);
            } else {
                turning = turning + z.scaled(rate);
            }
            speeds.push([speed.lanes(), turning.lanes()]);
        }
        frames.push([x.lanes(), y.lanes(), z.lanes(), origin.lanes()]);
    }
}

/// Turns two axes in their plane, the first towards the second.
#[inline(always)]
fn turned<S: Wide>(a: Three<S>, b: Three<S>, sin: Eight<S>, cos: Eight<S>) -> (Three<S>, Three<S>) {
    (a.scaled(cos) + b.scaled(sin), b.scaled(cos) - a.scaled(sin))
}

/// Returns sines and cosines of angles, rad; off by 3e-7 at most for angles up to some turns.
///
/// Source: Moshier's Cephes, `sinf.c`: polynomials on ±π/4, and π/2 in three pieces (Cody and Waite).
#[inline(always)]
fn sin_cos<S: Wide>(angle: Eight<S>) -> (Eight<S>, Eight<S>) {
    let simd = angle.simd();
    let quarters = (angle * Eight::all(simd, FRAC_2_PI as f32)).rounded();
    let x = angle - quarters * Eight::all(simd, 1.570_312_5);
    let x = x - quarters * Eight::all(simd, 4.837_513e-4);
    let x = x - quarters * Eight::all(simd, 7.549_79e-8);
    let z = x * x;
    let sin = Eight::all(simd, 8.332_161e-3) - z * Eight::all(simd, 1.951_529_6e-4);
    let sin = x + x * z * (z * sin - Eight::all(simd, 1.666_665_5e-1));
    let cos = Eight::all(simd, 4.166_664_6e-2)
        + z * (z * Eight::all(simd, 2.443_315_7e-5) - Eight::all(simd, 1.388_731_6e-3));
    let cos = Eight::all(simd, 1.0) - z * Eight::all(simd, 0.5) + z * z * cos;
    // Which quarter it is, as numbers: odd ones change places, then signs.
    let half = (quarters * Eight::all(simd, 0.5) - Eight::all(simd, 0.25)).rounded();
    let odd = quarters - half * Eight::all(simd, 2.0);
    let even = Eight::all(simd, 1.0) - odd;
    // A half turn more or less changes both signs.
    let sign = half
        - (half * Eight::all(simd, 0.5) - Eight::all(simd, 0.25)).rounded() * Eight::all(simd, 2.0);
    let sign = Eight::all(simd, 1.0) - sign * Eight::all(simd, 2.0);
    (sign * (even * sin + odd * cos), sign * (even * cos - odd * sin))
}

/// Carries a point of a frame into the base; without a frame it is there already.
#[inline(always)]
pub(super) fn carried<S: Wide>(
    simd: S,
    frames: &[Frame8],
    node: Option<usize>,
    point: [f32; 3],
) -> Three<S> {
    let Some(node) = node else { return Three::all(simd, point) };
    let [x, y, z, origin] = frames[node];
    let [a, b, c] = point;
    (Three::of(simd, x).scaled(Eight::all(simd, a))
        + Three::of(simd, y).scaled(Eight::all(simd, b)))
        + (Three::of(simd, z).scaled(Eight::all(simd, c)) + Three::of(simd, origin))
}
