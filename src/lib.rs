//! trueup: a task language and prompt for a robot arm whose digital twin tells the truth.
//!
//! Data flow one way, layer by layer: text becomes a checked tree ([`language`]), the tree a
//! spatial-temporal-causal And-Or graph ([`graph`]), whose conditions are read in a state of the [`world`]
//! ([`fluent`]); pixels and joint readings become poses in it ([`alignment`]); a goal becomes joints over time
//! ([`motion`]), is tried in the [`twin`], and is executed ([`execution`]) on an [`arm`], which may be the
//! embedded [`lab`] or a Gen3 ([`kortex`]), whose controller the [`emulator`] can play; it is recorded ([`trace`])
//! and judged ([`monitor`]), also by models that look at its pictures ([`vqa`]), and taught step by step
//! ([`teach`]). From recordings [`discovery`] names what the model lacks. [`workcell`] wires the layers together,
//! [`report`] words what they say, [`repl`] and [`cli`] are the two doors, and [`lsp`] answers an editor.

pub mod units;
pub mod files;
pub mod plain;
pub mod lines;
pub mod http;
pub mod fit;
pub mod world;
pub mod language;
pub mod graph;
pub mod scene;
pub mod fluent;
pub mod alignment;
pub mod motion;
pub mod twin;
pub mod lab;
pub mod arm;
pub mod kortex;
pub mod bridge;
pub mod trace;
pub mod execution;
pub mod emulator;
pub mod vqa;
pub mod monitor;
pub mod teach;
pub mod discovery;
pub mod workcell;
pub mod report;
pub mod page;
pub mod repl;
pub mod lsp;
pub mod cli;
