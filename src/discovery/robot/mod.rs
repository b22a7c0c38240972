//! An arm against its recordings: the closed loop simulated again with effects.

pub mod error;
pub mod chain;
mod colour;
pub mod channels;
pub mod spline;
pub mod smooth;
pub mod plant;
pub mod term;
mod traces;
pub mod simulate;
mod note;
mod estimates;
mod scan;
mod arm;
mod laid_out;
pub mod candidates;
pub mod explain;
pub mod wording;
pub mod known;
pub mod experiment;
pub mod investigate;
pub mod load;
mod against;
mod arm_finding;
mod currents;
mod gravity;
mod links;
mod places;
mod plausible;
mod poses;
mod power;
mod rows;
mod thin;

pub use investigate::investigate;
pub(super) use plausible::check_clock;
pub(super) use poses::{are_poses, investigate as at_poses};
