//! What a stage needs of an arm, twin or real, and why an action could not be done.

use std::sync::{Arc, Mutex};

use image::RgbImage;

use crate::world::WorldState;

use super::super::arm::{Arm, DeviceError, Grip};
use super::super::calibrate::Calibration;
use super::super::during::Sight;
use super::super::limits::LimitError;
use super::super::plan::{NoWay, Why};
use super::super::tape::OffTape;
use super::super::trace::Observer;
use super::Cell;

/// Why an action could not be done.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ActionError {
    /// A person asked to stop.
    #[error("stopped; the arm holds its position")]
    Stopped,
    /// A device failed.
    #[error("{0}")]
    Device(DeviceError),
    /// The limits refused the motion.
    #[error("{0}")]
    Limit(#[from] LimitError),
    /// There is no way to do it.
    #[error("{0}")]
    NoWay(NoWay),
    /// It is not what was rehearsed.
    #[error("{0}")]
    OffTape(#[from] OffTape),
    /// The arm would have to go where the rehearsal did not lead it.
    #[error("{0}")]
    Unrehearsed(String),
    /// The script itself gave up.
    #[error("{0}")]
    Refused(String),
    /// What ends the step is true: no error, but nothing more is to be done in it.
    #[error("the step is over")]
    Ended,
    /// A condition that must hold while the step runs is broken, or its time is up.
    #[error("{0}")]
    Broken(String),
}

impl ActionError {
    /// Whether a script may catch it and go on.
    pub fn can_be_caught(&self) -> bool {
        !matches!(self, Self::Stopped | Self::Ended | Self::Broken(_))
    }

    /// Whether planning and rehearsing again from where the arm is may help: what was rehearsed does not fit what
    /// was found, and was not begun.
    pub fn can_be_planned_again(&self) -> bool {
        matches!(self, Self::Limit(_) | Self::NoWay(_) | Self::OffTape(_) | Self::Unrehearsed(_))
    }

    /// Whether nothing more is done after it: a person said stop, or a device failed.
    pub fn ends_the_walk(&self) -> bool {
        matches!(self, Self::Stopped | Self::Device(_))
    }
}

impl From<DeviceError> for ActionError {
    fn from(error: DeviceError) -> Self {
        match error {
            DeviceError::Stopped => Self::Stopped,
            other => Self::Device(other),
        }
    }
}

impl From<NoWay> for ActionError {
    fn from(no: NoWay) -> Self {
        match no.why {
            Why::Stopped => Self::Stopped,
            _ => Self::NoWay(no),
        }
    }
}

/// Someone who watches, shared between the stage and whoever owns it.
pub type Watcher = Arc<Mutex<dyn Observer + Send>>;

/// A body in a world: the twin's, or a real one behind devices.
pub trait Body: Send {
    /// Lends the arm.
    fn arm(&mut self) -> &mut dyn Arm;

    /// Returns the world as far as it is known now.
    fn state(&mut self) -> Result<WorldState, DeviceError>;

    /// Returns what can be known of the world while the arm moves.
    fn sight(&self) -> Box<dyn Sight>;

    /// Lets arm time stand still while a person is asked, or go on.
    fn waits(&mut self, _on: bool) -> Result<(), DeviceError> {
        Ok(())
    }

    /// Looks at the table and takes what it sees for what is there.
    fn look(&mut self) -> Result<(), DeviceError>;

    /// Photographs the table; what the picture shows is worked out beside whatever the arm does next, and is
    /// known after [`Self::look_end`].
    fn look_begin(&mut self) -> Result<(), DeviceError> {
        self.look()
    }

    /// Takes what the picture of [`Self::look_begin`] shows for what is there.
    fn look_end(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    /// Takes note of how a grip on `aim` ended.
    fn gripped(&mut self, grip: Grip, aim: Option<&str>) -> Result<(), DeviceError>;

    /// Takes note of the mass in the hand, kg.
    fn weighed(&mut self, mass: f64);

    /// Takes note of a better measurement of the mass in the hand, kg: nothing has left it since the last.
    fn bears(&mut self, _mass: f64) {}

    /// Returns whether two things touch, `None` when nobody can tell.
    fn contact(&mut self, a: &str, b: &str) -> Option<bool>;

    /// Returns whether water still clings to the lip of `o`, as far as the twin knows of such a thing.
    fn drips(&mut self, _o: &str) -> bool {
        false
    }

    /// Takes a photograph, where there is a camera.
    fn photo(&mut self) -> Result<Option<RgbImage>, DeviceError> {
        Ok(None)
    }

    /// Puts the three regressions in force, where there is something to correct: `cell` is the cell as they
    /// found it.
    fn calibrate(&mut self, _calibration: Calibration, _cell: &Cell) {}

    /// Returns the regressions in force.
    fn calibration(&self) -> Option<&Calibration> {
        None
    }
}
