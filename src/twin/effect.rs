//! One more term in the twin's equations: what an effect found in reality changes.
//!
//! The twin holds a list of [`Effect`]s and does not know its members; finding them and fitting their
//! parameters is done in a layer above. An effect may change what the servos are told, add torque at
//! the joints, change the arm before it is built, or change what a sensor says.

use std::fmt::Debug;

use crate::motion::Robot;

/// A named number of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name in programs.
    pub name: String,
    /// Its value, in SI.
    pub value: f64,
    /// Its unit, as the language writes it.
    pub unit: String,
}

/// What an effect may look at: the arm at the beginning of a step.
#[derive(Debug, Clone, Copy)]
pub struct Moment<'a> {
    /// Time since the twin began, s.
    pub time: f64,
    /// Joint angles, base first, rad.
    pub q: &'a [f64],
    /// Joint speeds, base first, rad/s.
    pub dq: &'a [f64],
}

/// One more term of the twin.
pub trait Effect: Debug + Send + Sync {
    /// Returns the effect's name in the vocabulary of effects.
    fn name(&self) -> &str;

    /// Returns the effect's parameters.
    fn parameters(&self) -> Vec<Parameter>;

    /// Changes the arm before it is built (zero offsets, mounting).
    fn geometry(&self, robot: Robot) -> Robot {
        robot
    }

    /// Changes the angles (rad) and speeds (rad/s) the servos aim at.
    fn command(&self, _moment: &Moment<'_>, _q: &mut [f64], _dq: &mut [f64]) {}

    /// Adds to the torques at the joints, N·m.
    fn torque(&self, _moment: &Moment<'_>, _tau: &mut [f64]) {}

    /// Changes the angles (rad) and torques (N·m) that the joints' sensors say.
    fn sensor(&self, _moment: &Moment<'_>, _q: &mut [f64], _tau: &mut [f64]) {}
}
