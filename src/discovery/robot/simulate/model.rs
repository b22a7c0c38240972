//! What is simulated: an arm with its effects, a motion, and the grid it is computed on.

use super::super::chain::MOST_JOINTS;
use super::super::channels::Channel;
use super::super::load::Load;
use super::super::plant::{Arm, Course, Plant};
use super::super::term::Term;
use super::along;
use super::recent::Recent;
use crate::discovery::selection::Set;
use std::collections::BTreeMap;
use std::sync::{Arc as Shared, Mutex, OnceLock};

/// An arm laid out along one recording, ready to be simulated with any effects.
#[derive(Debug)]
pub struct Model {
    /// The arm.
    pub arm: Arm,
    /// The recording.
    pub course: Course,
    pub(super) columns: Mutex<BTreeMap<ColumnKey, Shared<Vec<f64>>>>,
    /// What two changes take beyond both by themselves.
    pub(super) crosses: Recent<(ColumnKey, ColumnKey), Vec<f64>>,
    /// The last few motions, each with the effects that moved it: effects of the sensors alone need no
    /// new simulation.
    pub(super) motions: Recent<Moving, Motion>,
    /// What the last effects on the bodies needed, by grid point: most effects of a joint leave it as it was.
    pub(super) borne: Recent<(Vec<Term>, Vec<f64>), Vec<f64>>,
    /// What a measured motion needs without any effects: worked out once.
    pub(super) bare: OnceLock<along::Bare>,
    /// Of each channel that is predicted, which rows count, all rows of one after those of another: worked out once.
    pub(super) counted: OnceLock<Vec<bool>>,
    /// How many of them are of each [`Set`].
    pub(super) counts: [OnceLock<usize>; 3],
    /// What the hand carried.
    pub loads: Vec<Load>,
    /// Torque that took, as far as it is known, by grid point; empty if nothing was carried.
    pub(super) carried: Shared<Vec<f64>>,
}

impl Model {
    /// Returns the SI unit of a channel.
    pub fn unit(&self, channel: &Channel) -> &'static str {
        channel.quantity.unit(self.arm.chain.slides(channel.index))
    }
}

/// What makes a simulated motion: the simulation's own numbers, and effects with theirs.
#[derive(Debug, PartialEq)]
pub(super) struct Moving {
    pub(super) own: Vec<f64>,
    pub(super) terms: Vec<Term>,
    pub(super) parameters: Vec<f64>,
}

/// Which change to the bodies a torque column is of: kind, joint or body, axis.
pub(super) type ColumnKey = (u8, usize, u8);

/// Further than this from its path an arm is laid out again, rad: the square of it times the arm's weight is a
/// part of the noise of its torques.
pub(super) const STRAY: f64 = 0.03;

/// How many motions are remembered, and how many torques that bodies need.
pub(super) const REMEMBERED: usize = 4;

/// How many torques that two changes to the bodies take together are remembered: those of a load beside the base's tilt and every
/// joint's zero.
pub(super) const CROSSES: usize = 64;

/// What the simulation leaves behind.
#[derive(Debug)]
pub(super) struct Motion {
    pub(super) joints: Vec<Shared<JointMotion>>,
}

/// What it leaves behind of a joint, row by row; rad, rad/s and N·m.
#[derive(Debug)]
pub(super) struct JointMotion {
    pub(super) q: Shared<Vec<f64>>,
    pub(super) dq: Shared<Vec<f64>>,
    pub(super) tau: Vec<f64>,
    pub(super) load: Shared<Vec<f64>>,
    /// Where the link stands beyond its encoder in a gap.
    pub(super) gap: Vec<f64>,
}

/// Returns whether a row of a recording belongs to a set of which the recording is.
pub fn is_in(set: Set, unseen: bool) -> bool {
    match set {
        Set::Train => true,
        Set::Heldout => !unseen,
        Set::Unseen => unseen,
    }
}

/// A time between two points of the plant's grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct GridPoint {
    pub(super) n: usize,
    pub(super) index: usize,
    pub(super) part: f64,
}

impl GridPoint {
    /// Returns where `time` lies on the grid of the plant, kept inside it.
    pub(super) fn at(plant: &Plant, time: f64) -> Self {
        let grid = ((time - plant.start) / plant.step).clamp(0.0, (plant.len - 2) as f64);
        let index = grid as usize;
        Self { n: plant.n, index, part: grid - index as f64 }
    }

    /// Returns the values of all joints there, linear between the two points.
    pub(super) fn all(self, values: &[f64]) -> [f64; MOST_JOINTS] {
        let at = self.index * self.n;
        let (a, b) = values[at..at + 2 * self.n].split_at(self.n);
        let mut all = [0.0; MOST_JOINTS];
        for j in 0..self.n {
            all[j] = a[j] + self.part * (b[j] - a[j]);
        }
        all
    }

    /// Returns a value of joint `j` there, linear between the two points.
    pub(super) fn of(self, values: &[f64], j: usize) -> f64 {
        let (a, b) = (values[self.index * self.n + j], values[(self.index + 1) * self.n + j]);
        a + self.part * (b - a)
    }
}
