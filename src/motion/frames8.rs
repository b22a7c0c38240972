//! The frames of a robot in eight configurations of a straight joint motion, and how fast they move.
//!
//! As [`super::frames`], every number eight times and in single precision.

#![expect(clippy::inline_always, reason = "what is not inlined into the look misses the registers")]

use super::frames::{Frames, Node};
use super::lanes::{Eight, LANES, Three, Vectors, Wide, packed, short};
use super::polyline::mixed;
use super::sin_cos::sin_cos;

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
    shift: [f32; 3],
    /// Of the shift, m.
    pub(super) length: f64,
    before: Option<[f32; 2]>,
    tilt: [f32; 2],
    after: f64,
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
        tilt: pair(node.tilt),
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
        let (mut value, mut angles) = ([0.0; LANES], [joint.after; LANES]);
        for lane in 0..LANES {
            value[lane] = joint.multiplier * mixed(from, to, at[lane]) + joint.offset;
            angles[lane] = if joint.slides { joint.after } else { value[lane] + joint.after };
        }
        let (sines, cosines) = sin_cos(&angles);
        let sin = Eight::of(simd, packed(&sines));
        let cos = Eight::of(simd, packed(&cosines));
        let [x, y, z, origin] = match joint.parent {
            Some(parent) => frames[parent],
            None => [
                Three::all(simd, [1.0, 0.0, 0.0]).lanes(),
                Three::all(simd, [0.0, 1.0, 0.0]).lanes(),
                Three::all(simd, [0.0, 0.0, 1.0]).lanes(),
                Three::all(simd, [0.0; 3]).lanes(),
            ],
        };
        let (x, y, z) = (Three::of(simd, x), Three::of(simd, y), Three::of(simd, z));
        let [a, b, c] = joint.shift;
        let start = Three::of(simd, origin);
        let mut origin = start
            + (x.scaled(Eight::all(simd, a)) + y.scaled(Eight::all(simd, b)))
            + z.scaled(Eight::all(simd, c));
        let (x, y) = match joint.before {
            Some([sin, cos]) => turned(x, y, Eight::all(simd, sin), Eight::all(simd, cos)),
            None => (x, y),
        };
        let [s, c] = joint.tilt;
        let (y, z) = turned(y, z, Eight::all(simd, s), Eight::all(simd, c));
        if joint.slides {
            origin = origin + z.scaled(Eight::of(simd, packed(&value)));
        }
        let (x, y) = turned(x, y, sin, cos);
        if sweeps {
            let still = Three::all(simd, [0.0; 3]).lanes();
            let [speed, turning] = joint.parent.map_or([still; 2], |parent| speeds[parent]);
            let (mut speed, mut turning) = (Three::of(simd, speed), Three::of(simd, turning));
            speed = speed + turning.cross(origin - start);
            let rate = Eight::all(simd, (joint.multiplier * (to - from)) as f32);
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
