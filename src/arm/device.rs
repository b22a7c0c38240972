//! What an arm, a camera and a pair of kitchen scales can do, whoever stands behind them.
//!
//! The twin, the lab and a real Gen3 are all met through these traits, so what runs in one runs in the
//! others. Nothing here plans, judges or corrects. Motion is asked for as a [`Cleared`] trajectory or a
//! [`ClearedGrip`], which only [`super::limits`] can make: nothing moves an arm except through the limits.

use image::RgbImage;
use serde::{Deserialize, Serialize};

use super::cancel::Cancel;
use super::error::DeviceError;
use super::limits::{Cleared, ClearedGrip, ClearedTick};
use crate::world::{Mover, Window};

/// What the arm reports of itself at one instant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Feedback {
    /// Time since the arm was connected, s.
    pub time: f64,
    /// Joint positions commanded last, rad.
    pub q_cmd: Vec<f64>,
    /// Joint positions measured, rad.
    pub q: Vec<f64>,
    /// Joint speeds measured, rad/s.
    pub dq: Vec<f64>,
    /// Joint torques measured, N·m.
    pub tau: Vec<f64>,
    /// Opening between the finger pads measured, m.
    pub opening: f64,
    /// What a scale with a cable reads, kg: recorded with the rest, never asked by a task.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
    /// What moves by itself near the arm, all of it, where somebody watches: what is not in the list any more has gone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub moving: Vec<Mover>,
}

/// How evenly positions were streamed to an arm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pacing {
    /// Commands sent.
    pub sent: u64,
    /// Of them answered.
    pub answered: u64,
    /// Commands a second, Hz.
    pub rate_hz: f64,
    /// Half of the times between two commands are no longer, s.
    pub median_s: f64,
    /// 99 of 100 are no longer, s.
    pub p99_s: f64,
    /// The longest, s.
    pub worst_s: f64,
    /// Periods that passed without a command.
    pub missed: u64,
    /// Commands sent while the motion was slowed down or held because nothing was heard.
    pub held: u64,
    /// How often the arm left the stream and was asked back.
    pub left: u64,
}

/// How a grip ended.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Grip {
    /// Opening between the pads when the fingers came to rest, m.
    pub opening: f64,
    /// Whether something stopped the fingers before they got where they were sent.
    pub stalled: bool,
}

/// What a laboratory's kitchen scales say.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Weighing {
    /// Water in each vessel, by its name, m³.
    pub water: Vec<(String, f64)>,
    /// Water anywhere else, m³.
    pub spilt: f64,
}

/// Who leads an arm: is told how it is, and says where it is to be a control period later; nothing when it is led no further.
pub type Leader<'l> = dyn FnMut(&Feedback) -> Option<ClearedTick> + 'l;

/// A robot arm with a two-finger gripper.
pub trait Arm: Send {
    /// Returns what the arm says of itself now.
    fn feedback(&mut self) -> Result<Feedback, DeviceError>;

    /// Follows a trajectory to its end, polling `cancel`; `watch` sees every control tick.
    ///
    /// # Errors
    ///
    /// [`DeviceError::Stopped`] when cancelled: the arm has been brought to rest and holds.
    fn follow(
        &mut self,
        trajectory: &Cleared,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError>;

    /// Returns the control period with which it can be led ([`Self::lead`]), s; nothing where it only follows.
    fn led_every(&self) -> Option<f64> {
        None
    }

    /// Is led, a control period at a time, until `leader` says nothing more; is brought to rest then. `watch` sees every tick.
    ///
    /// # Errors
    ///
    /// [`DeviceError::Stopped`] when cancelled: the arm has been brought to rest and holds. [`DeviceError::Unavailable`] from an
    /// arm that only follows.
    fn lead(
        &mut self,
        _leader: &mut Leader<'_>,
        _cancel: &Cancel,
        _watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        Err(DeviceError::only_follows())
    }

    /// Moves the fingers as asked and waits until they rest.
    fn grip(
        &mut self,
        grip: &ClearedGrip,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<Grip, DeviceError>;

    /// Has the fingers go as asked once `after` s have passed, and returns at once: they move beside
    /// whatever the arm does then. [`Self::grip`] waits for them.
    ///
    /// # Errors
    ///
    /// [`DeviceError::Refused`] from an arm that cannot do both at a time.
    fn send_fingers(&mut self, grip: &ClearedGrip, after: f64) -> Result<(), DeviceError>;

    /// Holds still for `seconds`.
    fn wait(
        &mut self,
        seconds: f64,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError>;

    /// Brings the arm to rest as fast as its limits allow, and holds it.
    fn stop(&mut self);

    /// Tells whoever stands before the arm that what it holds may be taken, or not any more; a real one is seen to hold it out.
    fn offers(&mut self, _on: bool) {}

    /// Returns whether the connection to it is lost for good: whoever wants it connects anew.
    fn is_lost(&self) -> bool {
        false
    }

    /// Returns whether it was asked to stop and has not answered yet: whether it holds is not known.
    fn owes_stop(&self) -> bool {
        false
    }

    /// Returns how evenly was paced what was streamed since this was last asked, of an arm that is streamed to.
    fn pacing(&mut self) -> Option<Pacing> {
        None
    }
}

/// A photograph that has been taken, to be had by whoever calls it, in a thread of its own if it takes long.
pub type Shot = Box<dyn FnOnce() -> RgbImage + Send>;

/// A photograph that has been taken, to be had as a whole or in parts, as often as is wanted.
pub type Plate = Box<dyn Fn(Option<Window>) -> RgbImage + Send>;

/// A colour camera that stands still.
pub trait Camera: Send {
    /// Takes a photograph.
    fn photo(&mut self) -> Result<RgbImage, DeviceError>;

    /// Takes a photograph of this instant that may be had later, while the arm goes on, or in parts: who knows where to look need
    /// not see all of it.
    fn plate(&mut self) -> Result<Plate, DeviceError> {
        let image = self.photo()?;
        Ok(Box::new(move |window| match window {
            Some(part) => {
                image::imageops::crop_imm(&image, part.u, part.v, part.width, part.height)
                    .to_image()
            }
            None => image.clone(),
        }))
    }

    /// Returns what films beside this camera, if anything can; a camera whose pictures cost something does only for who
    /// looks on.
    fn film(&self, _is_watched: bool) -> Option<Box<dyn Film>> {
        None
    }
}

/// A small picture of some instant, to be had like a [`Shot`]; nothing when the camera gave none.
pub type SmallShot = Box<dyn FnOnce() -> Option<RgbImage> + Send>;

/// What takes small pictures for people while the arm moves. No measurement rests on them.
pub trait Film: Send {
    /// Takes a picture of this instant, `width` px wide, and returns at once; nothing while it is busy.
    fn shoot(&mut self, width: u32) -> Option<SmallShot>;
}

/// Scales under the vessels and the table, read when a run is over to say what became of the water.
pub trait Scales: Send {
    /// Reads them, or `None` where there are none.
    fn weigh(&mut self) -> Option<Weighing>;

    /// Returns the vessel on the scale with a cable, whose reading is recorded while the arm moves
    /// ([`Feedback::mass`]); `None` without one.
    fn with_cable(&self) -> Option<String> {
        None
    }
}
