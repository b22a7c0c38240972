//! A parse graph → commands, and a record of what came of them.
//!
//! An action is a rhai script ([`script`]) over a [`context`]: an arm ([`crate::arm`]), what is known of the world,
//! and the log of decisions ([`decisions`]). [`walk`] executes the steps of a parse graph on any action context; the
//! twin's ([`twin_arm`]) rehearses, a real one ([`real`], with the devices of [`lab_arm`], [`crate::kortex`] or
//! [`snapshot`]) performs. Every motion passes [`crate::arm::limits`]; between the steps, and before the [`lines`] of
//! a script, a conductor may be asked ([`conduct`]). What is recorded is in [`crate::trace`].

pub mod cell;
pub mod plan;
pub mod decisions;
pub mod paces;
pub mod during;
pub mod timing;
pub mod uses;
pub mod beside;
mod together;
pub mod conduct;
mod confirm;
pub mod lines;
pub mod refusal;
pub mod error;
pub mod wording;
pub mod body;
pub mod done;
pub mod context;
mod path;
mod tool_pose;
mod worked;
mod bounds;
mod handle;
mod words;
pub mod lint;
pub mod script;
pub mod calibration;
pub mod calibrate;
pub mod belief;
pub mod reader;
pub mod real;
pub mod twin_arm;
pub mod lab_arm;
pub mod walk;
pub mod snapshot;
