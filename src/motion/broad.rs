//! The broad phase: which obstacles a ball may be near, four at a time.
//!
//! Each obstacle is a box with rounded edges that contains it: a capsule exactly, a cylinder in a square prism. A ball
//! is compared with four of them at once, without a root and without a branch. What it calls far is far; what it
//! calls near is looked at exactly.

use nalgebra::Vector3;
use wide::f64x4;

use super::body::Body;
use super::frames::Frame;

/// Obstacles of a group.
pub(super) const GROUP: usize = 4;

/// Four obstacles, number by number.
#[derive(Debug, Clone, Copy)]
struct Four {
    /// The axes of their boxes, by box axis and base axis.
    axes: [[f64x4; 3]; 3],
    origin: [f64x4; 3],
    half: [f64x4; 3],
    /// What the edges are rounded by, m.
    radius: f64x4,
}

/// A box, half its edges (m), and what it is rounded by (m).
type RoundedBox = (Frame, Vector3<f64>, f64);
/// One number of it.
type Number<'a> = dyn Fn(&RoundedBox) -> f64 + 'a;

/// Obstacles that stand still.
#[derive(Debug, Clone, Default)]
pub(super) struct Crowd {
    groups: Vec<Four>,
}

impl Crowd {
    pub(super) fn of<'b>(bodies: impl Iterator<Item = &'b Body>) -> Self {
        let boxes: Vec<RoundedBox> = bodies.map(rounded_box).collect();
        let group = |four: &[RoundedBox]| {
            // What is missing in the last group is nowhere.
            let lanes = |number: &Number<'_>, none: f64| {
                let mut lanes = [none; GROUP];
                for (lane, body) in lanes.iter_mut().zip(four) {
                    *lane = number(body);
                }
                f64x4::new(lanes)
            };
            let axis = |of: &dyn Fn(&Frame) -> Vector3<f64>| {
                [0, 1, 2].map(|i| lanes(&|body| of(&body.0)[i], 0.0))
            };
            Four {
                axes: [axis(&|f| f.x), axis(&|f| f.y), axis(&|f| f.z)],
                origin: axis(&|f| f.origin),
                half: [0, 1, 2].map(|i| lanes(&|body| body.1[i], 0.0)),
                radius: lanes(&|body| body.2, f64::NEG_INFINITY),
            }
        };
        Self { groups: boxes.chunks(GROUP).map(group).collect() }
    }

    /// Returns how many groups there are.
    pub(super) fn len(&self) -> usize {
        self.groups.len()
    }

    /// Returns a bit for each obstacle of a group that a ball with `reach` m around `centre` may touch.
    #[inline]
    pub(super) fn near(&self, group: usize, centre: &Vector3<f64>, reach: f64) -> u32 {
        let four = &self.groups[group];
        let k = f64x4::splat;
        let x = k(centre.x) - four.origin[0];
        let y = k(centre.y) - four.origin[1];
        let z = k(centre.z) - four.origin[2];
        let mut squared = f64x4::ZERO;
        for i in 0..3 {
            let [a, b, c] = four.axes[i];
            let beyond = ((a * x + b * y + c * z).abs() - four.half[i]).fast_max(f64x4::ZERO);
            squared += beyond * beyond;
        }
        // A hair more than asked for: rounding is no proof.
        let far = k(reach + 1e-9) + four.radius;
        (squared.simd_le(far * far) & far.simd_ge(f64x4::ZERO)).to_bitmask()
    }
}

/// Returns a box that contains a body when it is rounded by so much.
fn rounded_box(body: &Body) -> RoundedBox {
    match *body {
        Body::Cuboid { frame, half } => (frame, half, 0.0),
        Body::Cylinder { frame, radius, half } => (frame, Vector3::new(radius, radius, half), 0.0),
        Body::Round { a, b, radius } => {
            let along = b - a;
            let frame = Frame { origin: (a + b) * 0.5, ..Frame::towards(&along) };
            (frame, Vector3::new(0.0, 0.0, 0.5 * along.norm()), radius)
        }
    }
}
