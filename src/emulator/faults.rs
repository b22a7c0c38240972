//! Faults on demand: what a network and an arm do on a bad day, at will and repeatable by seed.

use std::time::Duration;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::kortex::messages::trajectory::{
    TrajectoryErrorElement, TrajectoryErrorType, WaypointList,
};

use super::call::{Answer, Fault};
use super::error::{Refused, WrongFault};

/// What goes wrong, and how often or when.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Faults {
    /// Share of UDP datagrams that are lost, each way.
    pub drop: f64,
    /// How late every answer is.
    pub delay: Duration,
    /// The controller answers nothing for so long, s, from [`Self::stall_at`] on.
    pub stall: f64,
    /// When it stalls, s after the start.
    pub stall_at: f64,
    /// Share of waypoint lists refused although nothing is wrong with them.
    pub refuse: f64,
    /// Share of actions that are given up on their way.
    pub abort: f64,
    /// Share of notifications of actions that are never sent.
    pub hush: f64,
    /// Share of answers that are refusals with a sub-code nobody knows.
    pub unknown: f64,
    /// When the arm goes into fault, s after the start.
    pub fault: Option<f64>,
    /// When someone presses the emergency stop, s after the start.
    pub estop: Option<f64>,
    /// TCP connections are cut after so long, s.
    pub cut: Option<f64>,
    /// When every session there is then is forgotten, s after the start.
    pub forget: Option<f64>,
    /// From when on the arm answers a stop and goes on, s after the start; its emergency stop works.
    pub deaf: Option<f64>,
    /// From when on nothing is told of the gripper, s after the start.
    pub gripper: Option<f64>,
}

impl std::str::FromStr for Faults {
    type Err = WrongFault;

    /// Reads `drop=0.01,stall=3s`.
    fn from_str(text: &str) -> Result<Self, WrongFault> {
        let mut faults = Self { stall_at: 5.0, ..Self::default() };
        for word in text.split(',').map(str::trim).filter(|word| !word.is_empty()) {
            let (name, value) =
                word.split_once('=').ok_or_else(|| WrongFault::NoValue(word.to_owned()))?;
            match name {
                "drop" => faults.drop = share(name, value)?,
                "refuse" => faults.refuse = share(name, value)?,
                "abort" => faults.abort = share(name, value)?,
                "hush" => faults.hush = share(name, value)?,
                "unknown" => faults.unknown = share(name, value)?,
                "delay" => faults.delay = Duration::from_secs_f64(seconds(name, value)?),
                "fault" => faults.fault = Some(seconds(name, value)?),
                "estop" => faults.estop = Some(seconds(name, value)?),
                "cut" => faults.cut = Some(seconds(name, value)?),
                "forget" => faults.forget = Some(seconds(name, value)?),
                "deaf" => faults.deaf = Some(seconds(name, value)?),
                "gripper" => faults.gripper = Some(seconds(name, value)?),
                "stall" => {
                    let (long, at) = value.split_once('@').unwrap_or((value, "5s"));
                    (faults.stall, faults.stall_at) = (seconds(name, long)?, seconds(name, at)?);
                }
                other => return Err(WrongFault::Unknown(other.to_owned())),
            }
        }
        Ok(faults)
    }
}

/// Reads a share between 0 and 1.
fn share(name: &str, text: &str) -> Result<f64, WrongFault> {
    let value: Option<f64> = text.parse().ok();
    value
        .filter(|value| (0.0..=1.0).contains(value))
        .ok_or_else(|| WrongFault::NoShare { name: name.to_owned(), text: text.to_owned() })
}

/// Reads `3s` or `20ms`, at most a day; s.
pub fn duration(text: &str) -> Option<f64> {
    let (number, scale) = match (text.strip_suffix("ms"), text.strip_suffix('s')) {
        (Some(number), _) => (number, 1e-3),
        (None, Some(number)) => (number, 1.0),
        (None, None) => ("", 1.0),
    };
    let value = number.parse().ok().map(|value: f64| value * scale);
    value.filter(|value| (0.0..=86_400.0).contains(value))
}

fn seconds(name: &str, text: &str) -> Result<f64, WrongFault> {
    let wrong = || WrongFault::NoTime { name: name.to_owned(), text: text.to_owned() };
    duration(text).ok_or_else(wrong)
}

/// Faults with the dice that decide them.
#[derive(Debug)]
pub(super) struct Chance {
    faults: Faults,
    dice: StdRng,
    /// Whether the running action will be given up: decided once for each.
    is_doomed: bool,
    abort_in: u32,
    /// How long it is since the start, s.
    since: f64,
}

impl Chance {
    pub(super) fn new(faults: Faults, seed: u64) -> Self {
        Self {
            faults,
            dice: StdRng::seed_from_u64(seed),
            is_doomed: false,
            abort_in: 0,
            since: 0.0,
        }
    }

    fn happens(&mut self, share: f64) -> bool {
        share > 0.0 && self.dice.random_bool(share)
    }

    /// Returns whether a datagram is lost.
    pub(super) fn drops(&mut self) -> bool {
        self.happens(self.faults.drop)
    }

    /// Returns whether a notification is never sent.
    pub(super) fn hushes(&mut self) -> bool {
        self.happens(self.faults.hush)
    }

    /// Puts a refusal nobody knows in place of an answer, now and then.
    pub(super) fn garble(&mut self, answer: Answer) -> Answer {
        if answer.is_ok() && self.happens(self.faults.unknown) {
            return Err(Refused::Planted);
        }
        answer
    }

    /// Refuses a list now and then, and decides whether its action will be given up.
    pub(super) fn refuses(&mut self, list: &WaypointList) -> Option<TrajectoryErrorElement> {
        self.is_doomed = self.happens(self.faults.abort);
        // A tenth of a second after it began.
        self.abort_in = 50;
        self.happens(self.faults.refuse).then(|| TrajectoryErrorElement {
            error_type: TrajectoryErrorType::InvalidAcceleration as i32,
            error_value: 999.0,
            min_value: -1.0,
            max_value: 1.0,
            waypoint_index: list.waypoints.len() as u32 / 2,
            message: "planted".to_owned(),
            ..TrajectoryErrorElement::default()
        })
    }

    /// Returns whether the running action is given up in this tick.
    pub(super) fn aborts(&mut self) -> bool {
        if !self.is_doomed {
            return false;
        }
        self.abort_in = self.abort_in.saturating_sub(1);
        if self.abort_in == 0 {
            self.is_doomed = false;
            return true;
        }
        false
    }

    /// Returns whether a stop is answered and not obeyed now.
    pub(super) fn is_deaf(&self) -> bool {
        self.faults.deaf.is_some_and(|from| self.since >= from)
    }

    /// Returns whether nothing is told of the gripper now.
    pub(super) fn is_gripper_gone(&self) -> bool {
        self.faults.gripper.is_some_and(|from| self.since >= from)
    }

    /// Takes note of how long it is since the start, s.
    pub(super) fn at(&mut self, since: f64) {
        self.since = since;
    }

    /// Returns whether sessions are forgotten so long after the start, s; once.
    pub(super) fn forgets(&mut self) -> bool {
        self.faults.forget.take_if(|at| self.since >= *at).is_some()
    }

    /// Returns the faults that are due so long after the start, s, each once.
    pub(super) fn due(&mut self) -> Vec<Fault> {
        let mut due = Vec::new();
        if self.faults.fault.is_some_and(|at| self.since >= at) {
            self.faults.fault = None;
            due.push(Fault::Other);
        }
        if self.faults.estop.is_some_and(|at| self.since >= at) {
            self.faults.estop = None;
            due.push(Fault::EmergencyStop);
        }
        due
    }
}
