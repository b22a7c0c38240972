//! A reality that somebody else wrote: any simulator or robot behind protocol 1 of `docs/bridge.md`, one JSON object a
//! line over TCP. This side is the client.
//!
//! [`wire`] is what is said, [`link`] says it, [`check`] refuses answers that cannot be, `unread` says what is wrong with lines that are none, [`devices`] makes of it an arm, a camera
//! and scales. What is sent has passed [`crate::arm::limits`], since only [`crate::arm::ticked`] sends anything. Nothing
//! here knows a scene, a pose or a picture's meaning.

pub mod check;
pub mod devices;
pub mod error;
pub mod link;
mod unread;
pub mod wire;

pub use check::{Joint, Wanted};
pub use devices::{BridgeArm, BridgeCamera, BridgeScales, Bridged, connect};
pub use error::Error;
