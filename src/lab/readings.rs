//! What can be read in the laboratory: what the arm says of itself, and what scales say; noise and steps are its settings'.

use crate::world::Mover;

use super::settings::Scale;
use super::{Lab, STOPPED_SHORT, passer, sensor};

/// What the arm says of itself, through its sensors.
#[derive(Debug, Clone, PartialEq)]
pub struct Feedback {
    /// Time since the laboratory was opened, s.
    pub time: f64,
    /// Joint angles as the encoders read them, base first, rad.
    pub q: Vec<f64>,
    /// Joint speeds, base first, rad/s.
    pub dq: Vec<f64>,
    /// Joint torques as the sensors read them, base first, N·m, positive as the joint turns.
    pub tau: Vec<f64>,
    /// Opening between the pads, m.
    pub opening: f64,
    /// Current of the gripper's motor, A.
    pub gripper_current: f64,
    /// Whether the fingers were stopped by something on their way, as a Robotiq gripper reports it.
    pub grasped: bool,
    /// What the kitchen scale with a cable reads, kg: the water in the vessel on it. `None` without one.
    pub scale: Option<f64>,
    /// What moves through the laboratory by itself, as whoever watches saw it last.
    pub moving: Vec<Mover>,
}

/// What kitchen scales under each vessel and under the table say.
#[derive(Debug, Clone, PartialEq)]
pub struct Weighing {
    /// Water in each vessel, m³, by name.
    pub water: Vec<(String, f64)>,
    /// Water in no vessel, m³.
    pub spilt: f64,
}

impl Weighing {
    /// Returns the water in a vessel, m³.
    pub fn water_in(&self, name: &str) -> Option<f64> {
        self.water.iter().find(|(vessel, _)| vessel == name).map(|&(_, water)| water)
    }
}

/// What kitchen scales resolve, m³ of water: a tenth of a gram.
const SCALE: f64 = 1e-7;

impl Lab {
    /// Returns what the arm says of itself now. Asked twice at one instant it says the same.
    pub fn feedback(&self) -> Feedback {
        let r = &self.settings.readings;
        let on = if self.settings.switches.readings { 1.0 } else { 0.0 };
        let noise = |channel: u64, i: usize, sigma: f64| {
            on * sigma * sensor::noise(self.key(2 + channel, self.steps), i as u64)
        };
        let step = if on > 0.0 { r.q_step_rad } else { 0.0 };
        let rounded = |q: f64| if step > 0.0 { (q / step).round() * step } else { q };
        let each = |values: Vec<f64>, channel: u64, sigma: f64| -> Vec<f64> {
            values.iter().enumerate().map(|(i, x)| x + noise(channel, i, sigma)).collect()
        };
        let q = each(self.world.encoders(), 0, r.q_sigma_rad).into_iter().map(rounded).collect();
        let tau = each(self.world.torques_sensed(), 2, r.tau_sigma_nm);
        let opening = (self.world.opening() + noise(3, 0, r.opening_sigma_m)).max(0.0);
        let grasped = self.jaws.closing
            && !self.jaws.moving
            && self.world.opening() > self.jaws.goal + STOPPED_SHORT;
        Feedback {
            time: self.time(),
            q,
            dq: each(self.world.dq(), 1, r.dq_sigma_rad_s),
            tau: tau.iter().zip(&self.truth.tau_bias).map(|(tau, bias)| tau + bias).collect(),
            opening,
            // As measured on a real gripper: 1 A while it moves, 0.05 A while it holds.
            gripper_current: if self.jaws.moving {
                1.0
            } else if grasped {
                0.05
            } else {
                0.0
            },
            grasped,
            scale: self.scale(),
            moving: passer::told(
                &self.settings.moving,
                &self.settings.watch,
                self.settings.switches.readings,
                self.time(),
                |look| self.key(8, look),
            ),
        }
    }

    /// Returns the vessel that stands on the kitchen scale with a cable, if one does: whoever put it there knows.
    pub fn scale_under(&self) -> Option<&str> {
        let under = self.settings.scale.under.as_str();
        let state = self.world.state();
        state.object(under).is_some_and(|object| object.water.is_some()).then_some(under)
    }

    /// What the kitchen scale reads, kg; one gram a millilitre.
    fn scale(&self) -> Option<f64> {
        let Scale { under, sigma_kg, step_kg } = &self.settings.scale;
        let state = self.world.state();
        let water = state.object(under)?.water? * 1e3;
        let on = if self.settings.switches.readings { 1.0 } else { 0.0 };
        let read = water + on * sigma_kg * sensor::noise(self.key(7, self.steps), 0);
        Some(if on * step_kg > 0.0 { (read / step_kg).round() * step_kg } else { read })
    }

    /// Returns what kitchen scales say: how a run is scored once it is over. A task must not look.
    pub fn scales(&self) -> Weighing {
        let read = |volume: f64| (volume / SCALE).round() * SCALE;
        let state = self.world.state();
        let vessels = state.objects.iter();
        Weighing {
            water: vessels
                .filter_map(|object| Some((object.name.clone(), read(object.water?))))
                .collect(),
            spilt: read(state.spilt.unwrap_or(0.0)),
        }
    }
}
