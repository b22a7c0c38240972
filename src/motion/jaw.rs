//! Jaws that slide: brought to one form, whichever way their file counts, and how near and far they come to each other.
//!
//! In that form a jaw's joint counts outwards from where the pads meet, so that each jaw is half of the opening from there.
//! URDFs count otherwise: both joints along one axis, the second with `<mimic multiplier="-1"/>`; towards the middle; from
//! another place, with an offset. Nothing moves by that: axis, range and zero change together.

use nalgebra::{Isometry3, Unit, Vector3};

use super::robot::{Drive, Joint, Robot};

impl Joint {
    /// Counts a joint that slides the other way round.
    pub(super) fn turn_round(&mut self) {
        self.axis = -self.axis;
        self.range = (-self.range.1, -self.range.0);
    }

    /// Counts a joint that slides from where it is at `zero` m.
    pub(super) fn count_from(&mut self, zero: f64) {
        self.parent_from_link = self.parent_from_link(zero);
        self.range = (self.range.0 - zero, self.range.1 - zero);
    }
}

/// Whether a range of a finger that leads lies on the side where its joint counts down: it opens against its axis.
pub(super) fn counts_inwards((lower, upper): (f64, f64)) -> bool {
    upper < -lower
}

impl Robot {
    /// Drives a jaw by `multiplier` of the opening and `offset` m, its joint turned round and counted anew where needed.
    pub(super) fn drive_jaw(&mut self, link: usize, multiplier: f64, offset: f64) {
        let joint = &mut self.links[link].joint;
        let sign = if multiplier < 0.0 { -1.0 } else { 1.0 };
        if sign < 0.0 {
            joint.turn_round();
        }
        // From nowhere nothing is counted; such a jaw is no half of a pair.
        let offset = if offset.is_finite() {
            joint.count_from(sign * offset);
            0.0
        } else {
            offset
        };
        joint.drive = Drive::Jaw { multiplier: sign * multiplier, offset };
    }

    /// Works out how near and how far the jaws come to each other once all are driven. Where they do not close all the way by
    /// their ranges, their shapes say from where they are counted.
    pub(super) fn measure_openings(&mut self) {
        if let Some(pair) = self.pair()
            && pair.iter().all(|&jaw| self.links[jaw].joint.range.0 > 0.0)
        {
            self.count_from_the_pads(pair);
        }
        let jaws: Vec<usize> = self.jaws().collect();
        let (mut least, mut most) = (0.0_f64, f64::INFINITY);
        for &jaw in &jaws {
            let joint = &self.links[jaw].joint;
            if let Drive::Jaw { multiplier, .. } = joint.drive
                && multiplier > 0.0
            {
                least = least.max(joint.range.0 / multiplier);
                most = most.min(joint.range.1 / multiplier);
            }
        }
        if !jaws.is_empty() {
            (self.min_opening, self.max_opening) = (least, most.max(0.0));
        }
    }

    /// Counts two jaws from where the shapes of their pads would meet, but from no farther out than the ranges let them come.
    fn count_from_the_pads(&mut self, [left, right]: [usize; 2]) {
        let Ok(poses) = self.link_poses(&vec![0.0; self.n_joints()], 0.0) else { return };
        let along = Unit::new_normalize(self.outward(left, &poses));
        let faces = [(left, -along), (right, along)];
        let [Some(first), Some(second)] =
            faces.map(|(jaw, inward)| self.face(jaw, &poses, &inward))
        else {
            return;
        };
        // With the opening at 0 the jaws are as near as their ranges let them come.
        let lowers = [left, right].map(|jaw| self.links[jaw].joint.range.0);
        let apart = -first - second;
        let zero = f64::midpoint(lowers[0], lowers[1]) - 0.5 * apart;
        if zero.is_finite() {
            for jaw in [left, right] {
                self.links[jaw].joint.count_from(zero.min(lowers[0]).min(lowers[1]));
            }
        }
    }

    /// Returns where a jaw goes while it opens, a unit vector in base coordinates, with the links at `poses`.
    fn outward(&self, jaw: usize, poses: &[Isometry3<f64>]) -> Vector3<f64> {
        poses[jaw].rotation * self.links[jaw].joint.axis.into_inner()
    }

    /// Returns the two jaws where there are two that slide apart, each by half of the opening from where they meet.
    pub fn pair(&self) -> Option<[usize; 2]> {
        let jaws: Vec<usize> = self.jaws().collect();
        let &[left, right] = jaws.as_slice() else { return None };
        let halves = |jaw: usize| match self.links[jaw].joint.drive {
            Drive::Jaw { multiplier, offset } => (multiplier - 0.5).abs() + offset.abs() < 1e-9,
            Drive::None | Drive::Joint { .. } | Drive::Knuckle { .. } => false,
        };
        let poses = self.link_poses(&vec![0.0; self.n_joints()], 0.0).ok()?;
        let part = self.outward(left, &poses).dot(&self.outward(right, &poses)) < 0.0;
        (halves(left) && halves(right) && part).then_some([left, right])
    }
}
