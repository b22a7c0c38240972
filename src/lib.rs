//! trueup: a task language and prompt for a robot arm whose digital twin tells the truth.
//!
//! Data flow one way, layer by layer: text becomes a checked tree ([`language`]), the tree a
//! spatial-temporal-causal And-Or graph ([`graph`]), whose conditions are read in a state of the [`world`]
//! ([`fluent`]); pixels and joint readings become poses in it ([`alignment`]); a goal becomes joints over time
//! ([`motion`]), is tried in the [`twin`], and is executed ([`execution`]) on an [`arm`], which may be the
//! embedded [`lab`], a Gen3 ([`kortex`]) whose controller the [`emulator`] can play, or somebody else's reality
//! ([`bridge`]); it is recorded ([`trace`]) and judged ([`monitor`]), also by models that look at its pictures
//! ([`vqa`]), and taught step by step ([`teach`]). From recordings [`discovery`] names what the model lacks.
//! [`workcell`] wires the layers together, [`report`] words what they say, [`repl`] and [`cli`] are the two doors,
//! and [`lsp`] answers an editor.
//!
//! Each layer can be used without those above it. Where to begin:
//!
//! | to | call |
//! |---|---|
//! | move an arm: kinematics, dynamics, collisions, paths, timing | [`motion::Robot`], [`motion::ik::Solver`], [`motion::rrt::plan`], [`motion::trajectory::Trajectory`] |
//! | fit cameras and offsets, find things in a picture | [`alignment::image_map::fit_map`], [`alignment::intrinsics::calibrate`], [`alignment::offset::fit_offset`], [`alignment::vision::see`] |
//! | name what a model lacks | [`discovery::investigate`] for arms, cameras, pours; [`discovery::equation::investigate`] for equations |
//! | speak with a Gen3 | [`kortex::link::Link`], [`kortex::arm::KortexArm`], [`kortex::supervisor::Supervisor`] |
//! | simulate an arm, things and water | [`twin::Twin`] |
//! | read the task language | [`language::parse()`], [`language::Library`] |
//!
//! Features, all on by default: `kortex` (the Gen3 and its emulator), `vqa` (models, cameras and scales at web
//! addresses), `page` (the teaching page), `lsp` (the language server), `bags` (ROS 2 bags), `arrow` (files for Rerun). Without them
//! nothing is built that speaks TLS.

pub mod units;
pub mod files;
pub mod plain;
pub mod lines;
pub mod http;
pub mod masks;
pub mod film;
#[cfg(feature = "arrow")]
pub mod rrd;
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
#[cfg(feature = "kortex")]
pub mod kortex;
pub mod bridge;
pub mod trace;
pub mod execution;
#[cfg(feature = "kortex")]
pub mod emulator;
pub mod vqa;
pub mod monitor;
pub mod teach;
pub mod discovery;
pub mod workcell;
pub mod report;
#[cfg(feature = "page")]
pub mod page;
pub mod repl;
#[cfg(feature = "lsp")]
pub mod lsp;
pub mod cli;
