//! What the sensors of an arm would have read, for a list of effects.
//!
//! [`Model::predict`] gives every channel of a recording. With a known controller the motion is simulated
//! from the commands at the controller's rate (`closed_loop`); without one the measured motion is taken
//! as it is, and torque and tip are predicted from it (`along`). `active` sorts the effects by where they
//! act, `needed` adds up what the bodies need, `friction` has the laws of the joints, `sensors` turns a motion into readings. Which effects to
//! try is not decided here.

mod model;
mod active;
mod along;
mod closed_loop;
mod friction;
mod needed;
mod recent;
mod sensors;

use std::sync::{Arc as Shared, Mutex, OnceLock};

use active::ActiveEffects;

use super::chain::{Chain, Excess};
use super::channels::{Channel, Quantity};
use super::links::body;
use super::load::Load;
use super::plant::{Arm, Course};
use super::term::{Law, Term, only};
use crate::discovery::selection::{ParameterSpec, Set};
use model::{CROSSES, ColumnKey, GridPoint, Motion, Moving, REMEMBERED, STRAY};
pub use model::{Model, is_in};
use recent::Recent;

impl Model {
    /// Returns the model of an arm along a recording, in which it carried `loads`.
    pub fn new(arm: Arm, course: Course, loads: Vec<Load>) -> Self {
        let n = course.plant.n;
        let mut carried = Vec::new();
        for load in &loads {
            carried.resize(load.per_kilogram.len(), 0.0);
            for (at, to) in carried.iter_mut().enumerate() {
                *to += load.mass[at / n] * load.per_kilogram[at];
            }
        }
        Self {
            arm,
            course,
            columns: Mutex::default(),
            crosses: Recent::new(CROSSES),
            motions: Recent::new(REMEMBERED),
            borne: Recent::new(REMEMBERED),
            bare: OnceLock::new(),
            counted: OnceLock::new(),
            counts: [const { OnceLock::new() }; 3],
            loads,
            carried: Shared::new(carried),
        }
    }

    /// Returns the same with as many rows as a search needs: no more than it takes to follow an arm, and of a long
    /// recording stretches all over it.
    #[must_use]
    pub fn thinned(&self) -> Self {
        Self::new(self.arm.clone(), self.course.thinned(), self.loads.clone())
    }

    /// Returns whether the zero of an encoder shows in the torques: where the motion is as measured. On either side of the gear
    /// the links' weight is in them.
    pub fn feels_zeros(&self) -> bool {
        !self.course.closed_loop && self.course.data.has(Quantity::Torque)
    }

    /// Returns which channels are predicted, in the order of [`Self::predict`]: positions and speeds
    /// only where the motion is simulated.
    pub fn is_predicted(&self, quantity: Quantity) -> bool {
        self.course.closed_loop || matches!(quantity, Quantity::Torque | Quantity::Tip)
    }

    /// Returns the parameters of the simulation itself, fitted beside those of any effects: where the motion is
    /// simulated, how the arm moves within a tick and how friction stops it.
    pub fn own(&self) -> Vec<(ParameterSpec, f64)> {
        if self.course.closed_loop { closed_loop::OWN.to_vec() } else { Vec::new() }
    }

    /// Returns what each predicted channel would have read, one list of rows after the other, SI, with the
    /// simulation's `own` parameters (empty for the usual ones). `None` if the motion runs away.
    pub fn predict(&self, own: &[f64], terms: &[Term], parameters: &[f64]) -> Option<Vec<f64>> {
        let active = ActiveEffects::sorted(self, terms, parameters);
        let motion = self.motion(&active, own, terms, parameters)?;
        Some(sensors::read(self, &active, &motion))
    }

    /// Lays the arm out again about the motion that these effects give it, if that is far from the path there is:
    /// what acts on the bodies is right to first order about it. `None` where the path is near enough.
    pub fn about(&self, own: &[f64], terms: &[Term], parameters: &[f64]) -> Option<Self> {
        let course = &self.course;
        if !course.closed_loop {
            return None;
        }
        let active = ActiveEffects::sorted(self, terms, parameters);
        let motion = self.motion(&active, own, terms, parameters)?;
        let late = if course.follows_command { active.delay } else { 0.0 };
        let stray = course.data.time.iter().enumerate().map(|(row, time)| {
            let here = GridPoint::at(&course.plant, time - late).all(&course.plant.q);
            let off = motion.joints.iter().zip(here).map(|(joint, q)| (joint.q[row] - q).abs());
            off.fold(0.0, f64::max)
        });
        if stray.fold(0.0, f64::max) < STRAY {
            return None;
        }
        let links = motion
            .joints
            .iter()
            .map(|joint| joint.q.iter().zip(&joint.gap).map(|(motor, gap)| motor + gap).collect());
        let path: Vec<Vec<f64>> = links.collect();
        let course = Course::about(&self.arm, course.data.clone(), Some(&path));
        Some(Self::new(self.arm.clone(), course, self.loads.clone()))
    }

    /// Returns the motion, simulated or remembered; `None` if it runs away.
    fn motion(
        &self,
        active: &ActiveEffects,
        own: &[f64],
        terms: &[Term],
        parameters: &[f64],
    ) -> Option<Shared<Motion>> {
        if !self.course.closed_loop {
            return Some(Shared::new(along::measured(self, active)));
        }
        // How friction stops a joint shows only where there is any.
        let is_stopped = active.dry.iter().any(|dry| dry.sharp);
        let own = if is_stopped { own } else { own.split_at(own.len().min(1)).0 };
        let (terms, parameters) = only(terms, parameters, Law::moves);
        let moving = Moving { own: own.to_vec(), terms, parameters };
        if let Some(known) = self.motions.find(&moving) {
            return Some(known);
        }
        let motion = closed_loop::simulate(self, active, own)?;
        Some(self.motions.keep(moving, motion))
    }

    /// Returns measured minus predicted in units of noise, in the order of [`Self::predict`]; rows that
    /// are not judged are 0.
    pub fn residuals(&self, own: &[f64], terms: &[Term], parameters: &[f64]) -> Option<Vec<f64>> {
        let mut values = self.predict(own, terms, parameters)?;
        let rows = self.course.data.n_rows().max(1);
        let channels =
            self.predicted().zip(values.chunks_mut(rows)).zip(self.counted().chunks(rows));
        for ((channel, values), counted) in channels {
            let rows = values.iter_mut().zip(&channel.values).zip(counted);
            for ((value, measured), counts) in rows {
                *value = if *counts { (measured - *value) / channel.noise } else { 0.0 };
            }
        }
        values.iter().all(|value| value.is_finite()).then_some(values)
    }

    /// Returns how many independent values are judged.
    pub fn count(&self, set: Set) -> usize {
        let count = || self.predicted().map(|channel| self.judged(channel, set)).sum();
        *self.counts[set as usize].get_or_init(count)
    }

    /// Returns by how much each residual falls for one unit more of each number of each body, in the order of
    /// [`Self::residuals`]: all numbers of the first body, then those of the next.
    pub(super) fn body_columns(&self) -> Vec<Vec<f64>> {
        let bodies = self.arm.chain.bodies.iter().enumerate();
        let heavier: Vec<(usize, Excess)> = bodies
            .flat_map(|(at, body)| {
                (0..body::NUMBERS).map(move |number| {
                    let mut changed = body.clone();
                    body::change(&mut changed, number, 1.0);
                    (at, Excess::of(&changed, body))
                })
            })
            .collect();
        let columns = self.course.plant.columns(&self.arm, &heavier);
        let mut found = vec![Vec::new(); columns.len()];
        for channel in self.predicted() {
            for (row, time) in self.course.data.time.iter().enumerate() {
                let is_felt = channel.quantity == Quantity::Torque && self.is_judged(channel, row);
                let at = is_felt.then(|| GridPoint::at(&self.course.plant, *time));
                for (found, column) in found.iter_mut().zip(&columns) {
                    found.push(
                        at.as_ref().map_or(0.0, |at| at.of(column, channel.index) / channel.noise),
                    );
                }
            }
        }
        found
    }

    /// Returns the same with other numbers of its bodies.
    #[must_use]
    pub(super) fn with_bodies(&self, changes: &[[f64; body::NUMBERS]]) -> Self {
        let mut arm = self.arm.clone();
        for (body, changes) in arm.chain.bodies.iter_mut().zip(changes) {
            changes.iter().enumerate().for_each(|(k, by)| body::change(body, k, *by));
        }
        Self::new(arm, self.course.clone(), self.loads.clone())
    }

    /// Returns how many rows of a channel are judged.
    pub fn judged(&self, channel: &Channel, set: Set) -> usize {
        let rows = self.course.first_row..self.course.last_row;
        let own = rows.filter(|&row| is_in(set, self.course.unseen[row]));
        own.filter(|&row| self.is_judged(channel, row)).count()
    }

    /// Returns the channels that are predicted, in the order of [`Self::predict`].
    fn predicted(&self) -> impl Iterator<Item = &Channel> {
        self.course.data.channels.iter().filter(|channel| self.is_predicted(channel.quantity))
    }

    /// Returns which rows of the channels that are predicted count, all rows of one after those of another.
    fn counted(&self) -> &[bool] {
        self.counted.get_or_init(|| {
            let rows = 0..self.course.data.n_rows();
            self.predicted()
                .flat_map(|channel| rows.clone().map(|row| self.is_judged(channel, row)))
                .collect()
        })
    }

    /// Returns whether a channel's row counts.
    fn is_judged(&self, channel: &Channel, row: usize) -> bool {
        let course = &self.course;
        let doubt = channel.quantity == Quantity::Torque
            && course.in_doubt.get(row * course.plant.n + channel.index) == Some(&true);
        let time = course.data.time[row];
        let unsure = channel.quantity == Quantity::Torque
            && self.loads.iter().any(|load| load.is_unsure(time));
        let is_inside = (course.first_row..course.last_row).contains(&row);
        let is_measured = channel.is_read(row) && course.blind.get(row) != Some(&true);
        is_inside && is_measured && !doubt && !unsure
    }

    /// Returns the torque column of a change to the bodies, computed once.
    fn column(
        &self,
        key: ColumnKey,
        unit: f64,
        change: impl Fn(&mut Chain) + Sync,
    ) -> Shared<Vec<f64>> {
        if let Some(found) =
            self.columns.lock().expect("no thread panics while it holds the lock").get(&key)
        {
            return Shared::clone(found);
        }
        let column = Shared::new(self.course.plant.column(&self.arm, change, unit));
        let mut columns = self.columns.lock().expect("no thread panics while it holds the lock");
        Shared::clone(columns.entry(key).or_insert(column))
    }
}
