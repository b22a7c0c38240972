//! A Kinova Gen3 over Kortex, the protocol its controller speaks: natively, without the vendor's library.
//!
//! From the wire upwards: [`frame`] and [`messages`] are bytes, [`rpc`] and [`refusal`] are names for
//! numbers, [`degrees`] is where the wire's units end, [`link`] is a session, [`arm`] an arm like any other, [`stream`] and
//! [`beat`] its thousand positions a second, [`pacing`] how evenly they left.
//! [`supervisor`] looks after an arm beside whoever commands it.
//! What was tried on an arm and what only against the emulator is said in `docs/kortex.md`.
//!
//! ```
//! use std::{sync::Arc, time::Duration};
//! use trueup::emulator::{Emulator, Ideal, Options};
//! use trueup::kortex::{link::Login, supervisor::Supervisor};
//! use trueup::motion::Robot;
//!
//! // A controller of the program's own stands in for the arm's.
//! let robot = Robot::gen3();
//! let plant = Box::new(Ideal::new(robot.pose("home").unwrap()));
//! let emulator = Emulator::start(Arc::new(robot), plant, &Options::default()).unwrap();
//! let (host, port) = (emulator.tcp().ip().to_string(), emulator.tcp().port());
//! let login = Login { user: "admin".into(), password: "admin".into() };
//! let arm = Supervisor::open(&host, port, &login, Duration::from_secs(5)).unwrap();
//! let status = arm.status().unwrap();
//! assert!(status.joints.len() == 7 && status.faults.is_empty());
//! ```

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
pub mod supervisor;
pub mod arm;
pub mod stream;
pub mod beat;
pub mod pacing;
mod waypoints;
mod wording;
