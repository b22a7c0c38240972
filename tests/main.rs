//! All tests in one binary, a module per layer; each further binary would link the physics engine again.
#![expect(clippy::unwrap_used, reason = "a failed unwrap in a test is a failed test")]

mod language;
mod alignment_vision;
mod layers;
mod wording;
mod circles;
mod motion;
mod kitchen;
mod absent;
mod twin;
mod graph;
mod world;
mod lab;
mod fit;
mod film;
mod alignment;
mod program;
mod schema;
mod rig;
mod sheet;
mod sights;
mod arm;
mod execution;
mod bridge;
mod emulator;
mod vqa;
mod monitor;
mod discovery;
mod workcell;
mod cli;
#[cfg(target_os = "linux")]
mod hostile;
mod lsp;
mod teach;
mod repl;
mod newcomers;
mod page;
