//! Jaws that turn on coupled knuckles, as a 2F-85's do: what opening a knuckle's angle makes, and the two sliding jaws
//! that stand for them.
//!
//! In the URDF one joint leads and the others mimic it. The two links that are farthest out on both sides are the pads.
//! How far apart their shapes are is worked out at many angles; from that the angle at an opening is a cubic. Knuckles
//! and fingers follow it. The pads are taken as sliding apart on a line, at the place and in the direction they have
//! half open; how far real ones come forward beside it is said in a [`Note`].

use nalgebra::{Isometry3, Matrix4, Unit, Vector3, Vector4};

use super::fault::Note;
use super::robot::{Drive, Motion, Robot};
use super::solid::Solid;

/// Angles at which the gap is worked out. Chosen: the cubic has four numbers.
const SAMPLES: usize = 65;
/// What moves its jaws by less is no gripper, m.
const LEAST: f64 = 2e-3;

/// A joint of the gripper that turns with the one that leads: `multiplier × angle + offset`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Knuckle {
    /// The link it carries.
    pub(super) link: usize,
    /// Factor; 1 for the one that leads.
    pub(super) multiplier: f64,
    /// Summand, rad.
    pub(super) offset: f64,
}

impl Robot {
    /// Makes a gripper of joints that turn together, the leading one between `range` rad; returns whether they are one.
    pub(super) fn couple(&mut self, knuckles: &[Knuckle], range: (f64, f64)) -> bool {
        let Some([left, right]) = self.outermost(knuckles) else { return false };
        let Some(hand) = self.common(left, right) else { return false };
        if !(range.0.is_finite() && range.1.is_finite() && range.0 < range.1) {
            return false;
        }
        let place = |angle: f64| self.placed_in(hand, knuckles, angle);
        let apart = |poses: &[Isometry3<f64>]| {
            poses[left].translation.vector - poses[right].translation.vector
        };
        let (low, high) = (apart(&place(range.0)), apart(&place(range.1)));
        let Some(along) = Unit::try_new(low - high, LEAST) else { return false };
        let is_open_low = along.dot(&low).abs() >= along.dot(&high).abs();
        let (open, shut) = if is_open_low { range } else { (range.1, range.0) };
        let wide = if is_open_low { low } else { high };
        let along = if along.dot(&wide) >= 0.0 { along } else { -along };
        let gap = |angle: f64| {
            let poses = place(angle);
            let face = |pad: usize, along: Unit<Vector3<f64>>| {
                let origin = || along.dot(&poses[pad].translation.vector);
                self.face(pad, &poses, &along).unwrap_or_else(origin)
            };
            -face(left, -along) - face(right, along)
        };
        let angles = (0..SAMPLES).map(|k| open + (shut - open) * k as f64 / (SAMPLES - 1) as f64);
        let table: Vec<(f64, f64)> =
            angles.map(|angle| (gap(angle), angle)).take_while(|(gap, _)| *gap >= 0.0).collect();
        let Some(&(widest, _)) = table.first().filter(|(gap, _)| *gap > LEAST) else {
            return false;
        };
        let Some(angle) = cubic(&table) else { return false };

        let half = value(&angle, widest / 2.0);
        let (poses, between) = (place(half), gap(half));
        // What ends before the pads meet does not close all the way.
        let (narrowest, _) = table[table.len() - 1];
        let ends_apart = table.len() == SAMPLES && narrowest > LEAST;
        let narrowest = if ends_apart { narrowest } else { 0.0 };
        let (first, last) = (place(open), place(table[table.len() - 1].1));
        let travel = last[left].translation.vector - first[left].translation.vector;
        let advance = (travel - along.into_inner() * along.dot(&travel)).norm();
        for knuckle in knuckles {
            let Knuckle { link, multiplier, offset } = *knuckle;
            self.links[link].joint.drive = Drive::Knuckle { angle, multiplier, offset };
        }
        for (pad, outward) in [(left, along), (right, -along)] {
            let mut closed = poses[pad];
            closed.translation.vector -= outward.into_inner() * (between / 2.0);
            let link = &mut self.links[pad];
            link.parent = Some(hand);
            let joint = &mut link.joint;
            joint.axis = closed.rotation.inverse() * outward;
            joint.parent_from_link = closed;
            joint.motion = Motion::Slide;
            joint.range = (narrowest / 2.0, widest / 2.0);
            joint.drive = Drive::Jaw { multiplier: 0.5, offset: 0.0 };
        }
        (self.min_opening, self.max_opening) = (narrowest, widest);
        self.notes.push(Note::Coupled {
            least_mm: (narrowest * 1e3).round() as u32,
            opening_mm: (widest * 1e3).round() as u32,
            advance_mm: (advance * 1e3).round() as u32,
        });
        true
    }

    /// Returns the two links that have most turning joints between them and the hand.
    fn outermost(&self, knuckles: &[Knuckle]) -> Option<[usize; 2]> {
        let depth = |link: usize| {
            let turns = |at: &usize| knuckles.iter().any(|knuckle| knuckle.link == *at);
            self.above(link).filter(turns).count()
        };
        let most = knuckles.iter().map(|knuckle| depth(knuckle.link)).max()?;
        let mut links = knuckles.iter().map(|k| k.link).filter(|&link| depth(link) == most);
        match (links.next(), links.next(), links.next()) {
            (Some(left), Some(right), None) => Some([left, right]),
            _ => None,
        }
    }

    /// A link and all that carry it.
    fn above(&self, link: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(link), |&at| self.links[at].parent)
    }

    /// Returns the nearest link that carries both.
    fn common(&self, left: usize, right: usize) -> Option<usize> {
        self.above(left).skip(1).find(|&link| self.above(right).any(|other| other == link))
    }

    /// Returns where the links beyond the hand are, in its frame, with the leading joint at `angle` rad.
    fn placed_in(&self, hand: usize, knuckles: &[Knuckle], angle: f64) -> Vec<Isometry3<f64>> {
        let mut poses = vec![Isometry3::identity(); self.links.len()];
        for (at, link) in self.links.iter().enumerate() {
            let Some(parent) =
                link.parent.filter(|_| at != hand && self.above(at).any(|a| a == hand))
            else {
                continue;
            };
            let knuckle = knuckles.iter().find(|knuckle| knuckle.link == at);
            let value = knuckle.map_or(0.0, |knuckle| knuckle.multiplier * angle + knuckle.offset);
            poses[at] = poses[parent] * link.joint.parent_from_link(value);
        }
        poses
    }

    /// Returns how far a pad and all that is fixed to it reach along a direction, m; `None` where they have no shape.
    pub(super) fn face(
        &self,
        pad: usize,
        poses: &[Isometry3<f64>],
        along: &Unit<Vector3<f64>>,
    ) -> Option<f64> {
        let solids = (pad..self.links.len())
            .filter(|&link| self.carrier(link) == pad)
            .flat_map(|link| self.links[link].collision.iter().map(move |solid| (link, solid)));
        let reach = solids.map(|(link, placed)| {
            let pose = poses[link] * placed.pose;
            let local = pose.rotation.inverse() * along.into_inner();
            along.dot(&pose.translation.vector) + support(&placed.solid, &local)
        });
        reach.max_by(f64::total_cmp)
    }
}

/// Returns how far a solid reaches along a unit vector of its own frame, m.
fn support(solid: &Solid, along: &Vector3<f64>) -> f64 {
    match *solid {
        Solid::Sphere { radius } => radius,
        Solid::Capsule { radius, half } => radius + half * along.z.abs(),
        Solid::Cylinder { radius, half } => radius * along.xy().norm() + half * along.z.abs(),
        Solid::Cuboid { half } => half.dot(&along.abs()),
    }
}

/// Returns the cubic through pairs of an opening and an angle, constant term first: least squares.
fn cubic(table: &[(f64, f64)]) -> Option<[f64; 4]> {
    let (mut square, mut side) = (Matrix4::<f64>::zeros(), Vector4::zeros());
    // In parts of the widest opening, or the powers would differ by five digits.
    let widest = table.first()?.0;
    for (gap, angle) in table {
        let s = gap / widest;
        let powers = Vector4::new(1.0, s, s * s, s * s * s);
        square += powers * powers.transpose();
        side += powers * *angle;
    }
    let found = square.lu().solve(&side)?;
    let (w, w2) = (widest, widest * widest);
    Some([found[0], found[1] / w, found[2] / w2, found[3] / (w2 * w)])
}

/// Returns the value of a cubic.
pub(super) fn value(cubic: &[f64; 4], at: f64) -> f64 {
    cubic.iter().rev().fold(0.0, |sum, c| sum * at + c)
}
