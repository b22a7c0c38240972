//! A parse graph → commands, and a record of what came of them.
//!
//! An action is a rhai script ([`script`]) over a [`stage`]: an arm ([`arm`]), what is known of the world,
//! and the tape of decisions ([`tape`]). [`walk`] carries out the steps of a parse graph on any stage; the
//! twin's ([`twin_arm`]) rehearses, a real one ([`real`], with the devices of [`lab_arm`], [`kortex`] or
//! [`snapshot`]) performs. Every motion passes
//! [`limits`]; between the steps, and before the [`lines`] of a script, a conductor may be asked ([`conduct`]).

pub mod arm;
pub mod limits;
pub mod plan;
pub mod tape;
pub mod during;
pub mod timing;
pub mod uses;
pub mod beside;
mod together;
pub mod trace;
pub mod conduct;
pub mod lines;
mod patience;
pub mod stage;
mod bounds;
pub mod script;
pub mod calibrate;
pub mod belief;
pub mod real;
pub mod ticked;
pub mod twin_arm;
pub mod lab_arm;
pub mod walk;
pub mod kortex;
pub mod snapshot;
