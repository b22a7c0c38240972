//! A Kinova Gen3 over Kortex, the protocol its controller speaks: natively, without the vendor's library.
//!
//! From the wire upwards: [`frame`] and [`messages`] are bytes, [`rpc`] and [`refusal`] are names for
//! numbers, [`degrees`] is where the wire's units end, [`link`] is a session, [`arm`] an arm like any other, [`stream`] and
//! [`beat`] its thousand positions a second, [`pacing`] how evenly they left.
//! [`desk`] looks after an arm beside whoever commands it.
//! What was tried on an arm and what only against the emulator is said in `docs/kortex.md`.

pub mod rpc;
pub mod frame;
pub mod messages;
pub mod refusal;
mod error;
pub mod degrees;
pub mod clock;
pub mod link;
pub mod about;
pub mod safety;
pub mod desk;
pub mod arm;
pub mod stream;
pub mod beat;
pub mod pacing;
mod waypoints;
mod wording;
