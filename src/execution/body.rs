//! What an action context needs of an arm, twin or real: a body in a world, and what it can see while it moves.

use std::sync::{Arc, Mutex};

use crate::arm::{Arm, DeviceError, Feedback, Film, Grip, Plate, Shot};
use crate::trace::Observer;
use crate::world::{Pose, WorldState, frame};

use super::calibration::Calibration;
use super::cell::Cell;

/// Someone who watches, shared between the action context and whoever owns it.
pub type Watcher = Arc<Mutex<dyn Observer + Send>>;

/// What can be known of the world while the arm moves.
pub trait Sight: Send {
    /// Returns the world at this feedback; what nobody knows between pictures is left unknown.
    fn state(&mut self, feedback: &Feedback) -> WorldState;

    /// Returns whether two things touch, `None` when nobody can tell.
    fn contact(&self, a: &str, b: &str) -> Option<bool>;

    /// Whether a touch is known by what the joints feel alone.
    fn feels(&self) -> bool {
        false
    }
}

/// A body in a world: the twin's, or a real one behind devices.
pub trait Body: Send {
    /// Lends the arm.
    fn arm(&mut self) -> &mut dyn Arm;

    /// Returns the world as far as it is known now.
    fn state(&mut self) -> Result<WorldState, DeviceError>;

    /// Returns the world as it was known when the arm said last where it is, without asking it.
    fn last_state(&mut self) -> Option<WorldState> {
        None
    }

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

    /// Looks whether things that were put down stand where they were put, and takes what the picture shows for what is
    /// so; a thing that is not to be seen where it should be in full view is nowhere.
    fn confirm(&mut self, _names: &[String]) -> Result<(), DeviceError> {
        Ok(())
    }

    /// Takes note of how a grip on `aim` ended.
    fn gripped(&mut self, grip: Grip, aim: Option<&str>) -> Result<(), DeviceError>;

    /// Takes note that somebody was pulling at a thing when the fingers let it go: where it is nobody knows until a look shows it.
    fn given(&mut self, _o: &str) {}

    /// Takes note of the mass in the hand, kg.
    fn weighed(&mut self, mass: f64);

    /// Takes note that what was under way has ended before its end.
    fn cut_short(&mut self) {}

    /// Takes note of a better measurement of the mass in the hand, kg: nothing has left it since the last.
    fn bears(&mut self, _mass: f64) {}

    /// Takes note that what is held stands `by` m lower than it was believed to hang: it has slid in the hand.
    ///
    /// # Errors
    ///
    /// [`DeviceError`] when the arm does not say where it is.
    fn stands(&mut self, _by: f64) -> Result<(), DeviceError> {
        Ok(())
    }

    /// Takes note that a thing was pushed to where it is believed to stand now; `None` when the push was cut short.
    fn pushed(&mut self, _o: &str, _ends: Option<Pose<frame::World, frame::Object>>) {}

    /// Returns whether two things touch, `None` when nobody can tell.
    fn contact(&mut self, a: &str, b: &str) -> Option<bool>;

    /// Returns whether water still clings to the lip of `o`, as far as the twin knows of such a thing.
    fn drips(&mut self, _o: &str) -> bool {
        false
    }

    /// Takes a photograph, where there is a camera.
    fn photo(&mut self) -> Result<Option<Shot>, DeviceError> {
        Ok(self.plate()?.map(|plate| Box::new(move || plate(None)) as Shot))
    }

    /// Takes a photograph of which parts may be had, where there is a camera.
    fn plate(&mut self) -> Result<Option<Plate>, DeviceError> {
        Ok(None)
    }

    /// Returns what films beside the camera, where anything does ([`Camera::film`]).
    ///
    /// [`Camera::film`]: crate::arm::Camera::film
    fn film(&self, _is_watched: bool) -> Option<Box<dyn Film>> {
        None
    }

    /// Puts the three regressions in force, where there is something to correct: `cell` is the cell as they
    /// found it.
    fn calibrate(&mut self, _calibration: Calibration, _cell: &Cell) {}

    /// Returns how probable it is that things are where they were seen last, 0 to 1, by name.
    fn sure(&self) -> Vec<(String, f64)> {
        Vec::new()
    }

    /// Returns the regressions in force.
    fn calibration(&self) -> Option<&Calibration> {
        None
    }
}
