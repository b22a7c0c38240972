//! The moving frames of a robot, ready to be placed: what is rigid is joined once, and every joint turns about z.
//!
//! Between two joints that follow each other a URDF has any number of fixed links and an axis that points anywhere.
//! Here one frame stands for each driven joint. From its parent's frame it is moved, turned about the parent's z,
//! tilted about x, and then turned about its own z by its angle: any rotation is `Rz(φ) Rx(α) Rz(ψ)`. `ψ` is added to
//! the joint's angle, and `φ` to the parent's where the parent has one child only, so a joint costs two plane turns.
//!
//! Source: the angles are Euler's (z, x, z); a tree of bodies: Featherstone, *Rigid Body Dynamics Algorithms*, §4.1.

#![expect(clippy::inline_always, reason = "what is not inlined into `widest` misses the registers")]

use std::f64::consts::PI;

use nalgebra::{Isometry3, Matrix3, Rotation3, Unit, UnitQuaternion, Vector3};

use super::inertial::Inertial;
use super::lanes::Wide;
use super::quad::Quad;
use super::robot::{Drive, Link, Motion};
use super::sin_cos::{LANES, sin_cos};

/// A frame placed in base coordinates: its axes and its origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    pub(super) x: Vector3<f64>,
    pub(super) y: Vector3<f64>,
    pub(super) z: Vector3<f64>,
    /// m.
    pub(super) origin: Vector3<f64>,
}

impl Frame {
    /// Returns the frame of a pose.
    pub(super) fn of(pose: &Isometry3<f64>) -> Self {
        let m = pose.rotation.to_rotation_matrix().into_inner();
        Self {
            x: Vector3::new(m.m11, m.m21, m.m31),
            y: Vector3::new(m.m12, m.m22, m.m32),
            z: Vector3::new(m.m13, m.m23, m.m33),
            origin: pose.translation.vector,
        }
    }

    /// Returns the frame that is the base itself.
    pub(super) fn base() -> Self {
        Self { x: Vector3::x(), y: Vector3::y(), z: Vector3::z(), origin: Vector3::zeros() }
    }

    /// Returns a frame at the base's origin whose z lies along a vector.
    pub(super) fn towards(along: &Vector3<f64>) -> Self {
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), along)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI));
        Self::of(&Isometry3::from_parts(Vector3::zeros().into(), turn))
    }

    /// Returns the pose: the rotation's quaternion is worked out from the axes.
    pub(super) fn pose(&self) -> Isometry3<f64> {
        let turn =
            Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[self.x, self.y, self.z]));
        Isometry3::from_parts(self.origin.into(), UnitQuaternion::from_rotation_matrix(&turn))
    }

    /// Carries a direction of the frame into the base.
    #[inline]
    pub(super) fn direction(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// Carries a point of the frame into the base.
    #[inline]
    pub(super) fn point(&self, p: &Vector3<f64>) -> Vector3<f64> {
        self.origin + self.direction(p)
    }

    /// Carries a direction of the base into the frame.
    #[inline]
    pub(super) fn local(&self, v: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Returns the base as the frame sees it.
    pub(super) fn inverse(&self) -> Self {
        let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()].map(|v| self.local(&v));
        Self { x, y, z, origin: -self.local(&self.origin) }
    }

    /// Returns a frame that is given in this one.
    #[inline]
    pub(super) fn then(&self, inner: &Self) -> Self {
        Self {
            x: self.direction(&inner.x),
            y: self.direction(&inner.y),
            z: self.direction(&inner.z),
            origin: self.point(&inner.origin),
        }
    }

    /// Steps on to the frame of a node that hangs on this one; the turn is a sine and a cosine.
    #[inline(always)]
    fn step(&mut self, node: &Node, q: &[f64], turn: (f64, f64)) {
        self.origin = self.point(&node.shift);
        if let Some(before) = node.before {
            self.about_z(before);
        }
        self.about_x(node.tilt);
        if node.slides {
            self.origin += self.z * node.value(q);
        }
        self.about_z(turn);
    }

    /// Turns the frame about its own x.
    #[inline]
    fn about_x(&mut self, (sin, cos): (f64, f64)) {
        (self.y, self.z) = (self.y * cos + self.z * sin, self.z * cos - self.y * sin);
    }

    /// Turns the frame about its own y.
    #[inline]
    pub(super) fn about_y(&mut self, (sin, cos): (f64, f64)) {
        (self.z, self.x) = (self.z * cos + self.x * sin, self.x * cos - self.z * sin);
    }

    /// Turns the frame about its own z.
    #[inline]
    pub(super) fn about_z(&mut self, (sin, cos): (f64, f64)) {
        (self.x, self.y) = (self.x * cos + self.y * sin, self.y * cos - self.x * sin);
    }
}

/// One driven joint, seen from the frame of the one before.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Node {
    /// The frame it hangs on; `None` for the base.
    pub(super) parent: Option<usize>,
    /// Which entry of `q` drives it.
    pub(super) index: usize,
    /// Its value is `multiplier × q[index] + offset`, rad or m.
    pub(super) multiplier: f64,
    pub(super) offset: f64,
    /// Whether it slides along z, instead of turning about it.
    pub(super) slides: bool,
    /// From the parent's origin, in the parent's frame, m.
    pub(super) shift: Vector3<f64>,
    /// Sine and cosine of the turn about the parent's z, unless the parent has taken it into its own.
    pub(super) before: Option<(f64, f64)>,
    /// Sine and cosine of the tilt about x.
    pub(super) tilt: (f64, f64),
    /// The angle about z besides the joint's own, rad.
    pub(super) after: f64,
}

/// The driven joints of some links, parents first.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Frames {
    pub(super) nodes: Vec<Node>,
    /// Per link: the frame it is fixed to (`None` for the base), and where it stands in that frame.
    pub(super) links: Vec<(Option<usize>, Isometry3<f64>)>,
    /// Whether every frame hangs on the one before.
    pub(super) is_chain: bool,
}

impl Frames {
    /// Returns the frames of the links for which `counts`, jaws at an opening of `opening` m. The parents of those
    /// links must count as well.
    pub(super) fn of(links: &[Link], opening: f64, counts: impl Fn(usize) -> bool) -> Self {
        let mut frames = Self::default();
        for (at, link) in links.iter().enumerate() {
            let Some(parent) = link.parent.filter(|_| counts(at)) else {
                frames.links.push((None, Isometry3::identity()));
                continue;
            };
            let (parent, node_from_parent) = frames.links[parent];
            let joint = &link.joint;
            let Drive::Joint { index, multiplier, offset } = joint.drive else {
                let step = joint.parent_from_link(joint.value(&[], opening));
                frames.links.push((parent, node_from_parent * step));
                continue;
            };
            let axis = joint.axis.into_inner();
            let link_from_node = UnitQuaternion::rotation_between(&Vector3::z(), &axis)
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI));
            let fixed = node_from_parent * joint.parent_from_link * link_from_node;
            let [before, tilt, after] = zxz(&fixed.rotation);
            frames.links.push((
                Some(frames.nodes.len()),
                Isometry3::from_parts(Vector3::zeros().into(), link_from_node.inverse()),
            ));
            frames.nodes.push(Node {
                parent,
                index,
                multiplier,
                offset,
                slides: joint.motion == Motion::Slide,
                shift: fixed.translation.vector,
                before: Some(before.sin_cos()),
                tilt: tilt.sin_cos(),
                after,
            });
        }
        frames.take_over();
        frames
    }

    /// Lets each frame with one child turn by what the child's would turn first.
    fn take_over(&mut self) {
        let mut children = vec![0_usize; self.nodes.len()];
        for node in &self.nodes {
            if let Some(parent) = node.parent {
                children[parent] += 1;
            }
        }
        for at in 0..self.nodes.len() {
            let Some(parent) = self.nodes[at].parent.filter(|&parent| children[parent] == 1) else {
                continue;
            };
            let (sin, cos) = self.nodes[at].before.take().expect("every node begins with one");
            self.nodes[parent].after += sin.atan2(cos);
            // What is fixed to the parent's frame now stands turned back in it.
            let back = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -sin.atan2(cos));
            self.nodes[at].shift = back * self.nodes[at].shift;
            for (node, pose) in &mut self.links {
                if *node == Some(parent) {
                    *pose = back * *pose;
                }
            }
        }
        self.is_chain =
            self.nodes.iter().enumerate().all(|(at, node)| node.parent == at.checked_sub(1));
    }

    /// Welds what has mass on a link to the body of the frame it is fixed to. What is fixed to the base stays out.
    pub(super) fn join(&self, link: usize, inertial: &Inertial, bodies: &mut [Inertial]) {
        let (Some(node), node_from_link) = self.links[link] else { return };
        let part = inertial.seen_from(&node_from_link);
        bodies[node] = if bodies[node].mass + part.mass > 0.0 {
            bodies[node].welded(&part)
        } else {
            // Nothing has a centre of mass here.
            Inertial { inertia: bodies[node].inertia + part.inertia, ..Inertial::zero() }
        };
    }

    /// Writes every frame for joint positions `q` (rad, m for sliding joints).
    #[inline]
    pub(super) fn place(&self, q: &[f64], placed: &mut Vec<Frame>) {
        placed.clear();
        self.each(q, |node, turn| {
            let mut frame = node.parent.map_or_else(Frame::base, |parent| placed[parent]);
            frame.step(node, q, turn);
            placed.push(frame);
        });
    }

    /// Runs along a chain to a frame that is given in the last: `visit` is told each node, its z and its origin, each with
    /// a nought behind.
    #[inline(always)]
    pub(super) fn run<S: Wide>(
        &self,
        simd: S,
        q: &[f64],
        end: &Frame,
        mut visit: impl FnMut(&Node, Quad<S>, Quad<S>),
    ) -> Frame {
        debug_assert!(self.is_chain, "the way to a tip has no branch");
        let mut x = Quad::of(simd, [1.0, 0.0, 0.0, 0.0]);
        let mut y = Quad::of(simd, [0.0, 1.0, 0.0, 0.0]);
        let mut z = Quad::of(simd, [0.0, 0.0, 1.0, 0.0]);
        let mut origin = Quad::all(simd, 0.0);
        self.each(
            q,
            #[inline(always)]
            |node, turn| {
                origin = origin + along([x, y, z], &node.shift);
                if let Some(before) = node.before {
                    (x, y) = turned(x, y, before);
                }
                (y, z) = turned(y, z, node.tilt);
                if node.slides {
                    origin = origin + z * Quad::all(simd, node.value(q));
                }
                visit(node, z, origin);
                (x, y) = turned(x, y, turn);
            },
        );
        let axes = [x, y, z];
        Frame {
            x: along(axes, &end.x).short(),
            y: along(axes, &end.y).short(),
            z: along(axes, &end.z).short(),
            origin: (origin + along(axes, &end.origin)).short(),
        }
    }

    /// Tells of each node, parents first, the sine and cosine of its turn about z.
    #[inline(always)]
    fn each(&self, q: &[f64], mut visit: impl FnMut(&Node, (f64, f64))) {
        for nodes in self.nodes.chunks(LANES) {
            let mut angles = [0.0; LANES];
            for (angle, node) in angles.iter_mut().zip(nodes) {
                *angle = node.after + if node.slides { 0.0 } else { node.value(q) };
            }
            let (sines, cosines) = sin_cos(&angles);
            for (node, turn) in nodes.iter().zip(sines.into_iter().zip(cosines)) {
                visit(node, turn);
            }
        }
    }
}

/// Turns two axes in their plane.
#[inline(always)]
fn turned<S: Wide>(a: Quad<S>, b: Quad<S>, (sin, cos): (f64, f64)) -> (Quad<S>, Quad<S>) {
    let (sin, cos) = (Quad::all(a.simd(), sin), Quad::all(a.simd(), cos));
    (a * cos + b * sin, b * cos - a * sin)
}

/// Returns a vector that is given in three axes.
#[inline(always)]
fn along<S: Wide>([x, y, z]: [Quad<S>; 3], v: &Vector3<f64>) -> Quad<S> {
    let k = |a: f64| Quad::all(x.simd(), a);
    x * k(v.x) + y * k(v.y) + z * k(v.z)
}

impl Node {
    /// Returns the joint's value, rad or m.
    #[inline]
    pub(super) fn value(&self, q: &[f64]) -> f64 {
        self.multiplier * q[self.index] + self.offset
    }
}

/// Returns the angles of a rotation as turns about z, x and z, the first of them done last.
fn zxz(turn: &UnitQuaternion<f64>) -> [f64; 3] {
    let m = turn.to_rotation_matrix();
    let tilt = m[(0, 2)].hypot(m[(1, 2)]).atan2(m[(2, 2)]);
    let before = if m[(0, 2)].hypot(m[(1, 2)]) > 1e-9 { m[(0, 2)].atan2(-m[(1, 2)]) } else { 0.0 };
    // Whatever the first two are, the third is what is left.
    let about = |axis: &Unit<Vector3<f64>>, angle| UnitQuaternion::from_axis_angle(axis, angle);
    let two = about(&Vector3::z_axis(), before) * about(&Vector3::x_axis(), tilt);
    let left = two.inverse() * turn;
    let x = left * Vector3::x();
    [before, tilt, x.y.atan2(x.x)]
}
