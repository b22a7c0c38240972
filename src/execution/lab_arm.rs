//! `Arm`, `Camera` and `Scales` over the lab: the only file that sees both.
//!
//! What crosses here is what a laboratory lets one see: commands in; feedback, photographs and the kitchen
//! scales' readings out.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use image::RgbImage;

use crate::lab::Lab;
use crate::motion::Robot;

use super::wording;
use crate::arm::ticked::{Brake, Plant, Ticked};
use crate::arm::{Camera, DeviceError, Feedback, Film, Plate, Scales, SmallShot, Weighing};

/// The lab, shared by its arm, its camera and its scales.
pub type SharedLab = Arc<Mutex<Lab>>;

/// The lab's arm.
pub type LabArm = Ticked<LabPlant>;

/// The lab as something that is stepped.
pub struct LabPlant(SharedLab);

/// The lab's camera.
pub struct LabCamera(pub SharedLab);

/// The lab's kitchen scales.
pub struct LabScales(pub SharedLab);

/// Connects to the lab's arm where it stands; it is braked as its file allows.
pub fn connect(lab: SharedLab, robot: &Robot) -> LabArm {
    Ticked::new(plant(lab), Brake::of(robot))
}

/// Returns the lab's arm as something that is stepped, for a controller of its own.
pub fn plant(lab: SharedLab) -> LabPlant {
    LabPlant(lab)
}

fn lock(lab: &SharedLab) -> MutexGuard<'_, Lab> {
    lab.lock().unwrap_or_else(PoisonError::into_inner)
}

fn broken(error: impl std::fmt::Display) -> DeviceError {
    DeviceError::Unavailable(wording::lab_failed(error))
}

impl Plant for LabPlant {
    fn command(&mut self, q: &[f64], dq: &[f64]) -> Result<(), DeviceError> {
        lock(&self.0).command(q, dq).map_err(broken)
    }

    fn aim(&mut self, opening: f64, speed: f64, force: f64) -> Result<(), DeviceError> {
        lock(&self.0).grip(opening, speed, force).map_err(broken)
    }

    fn advance(&mut self, seconds: f64) -> Result<(), DeviceError> {
        lock(&self.0).advance(seconds).map_err(broken)
    }

    fn offers(&mut self, on: bool) {
        lock(&self.0).offer(on);
    }

    fn report(&mut self) -> Feedback {
        let told = lock(&self.0).feedback();
        Feedback {
            time: told.time,
            q_cmd: Vec::new(),
            q: told.q,
            dq: told.dq,
            tau: told.tau,
            opening: told.opening,
            mass: told.scale,
            moving: told.moving,
        }
    }
}

impl Camera for LabCamera {
    fn photo(&mut self) -> Result<RgbImage, DeviceError> {
        Ok(self.plate()?(None))
    }

    fn plate(&mut self) -> Result<Plate, DeviceError> {
        // The laboratory is held for as long as the shutter is open, not while the picture is drawn.
        let negative = lock(&self.0).shutter();
        Ok(Box::new(move |window| negative.develop(window)))
    }

    fn film(&self, _is_watched: bool) -> Option<Box<dyn Film>> {
        Some(Box::new(LabFilm(self.0.clone())))
    }
}

/// The lab's camera as it films.
struct LabFilm(SharedLab);

impl Film for LabFilm {
    fn shoot(&mut self, width: u32) -> Option<SmallShot> {
        let negative = lock(&self.0).film(width);
        Some(Box::new(move || Some(negative.develop(None))))
    }
}

impl Scales for LabScales {
    fn weigh(&mut self) -> Option<Weighing> {
        let read = lock(&self.0).scales();
        Some(Weighing { water: read.water, spilt: read.spilt })
    }

    fn with_cable(&self) -> Option<String> {
        lock(&self.0).scale_under().map(str::to_owned)
    }
}
