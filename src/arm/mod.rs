//! An arm, a camera and scales, whoever stands behind them, and the gate that every motion passes.
//!
//! [`device`] has the traits, [`cancel`] the wish to stop, [`limits`] the one gate; [`patience`], [`paced`] and
//! [`ticked`] make an arm of something simpler. Nothing here plans, judges or corrects.

pub mod cancel;
pub mod device;
mod error;
pub mod limits;
pub mod paced;
pub mod patience;
pub mod ticked;

pub use crate::world::Mover;
pub use cancel::Cancel;
pub use device::{
    Arm, Camera, Feedback, Film, Grip, Leader, Pacing, Plate, Scales, Shot, SmallShot, Weighing,
};
pub use error::DeviceError;
