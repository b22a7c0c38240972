//! The arguments that every command takes.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::http::Address;
use crate::motion::free::Means;
use crate::workcell::CANDIDATES;

use super::numbers;

// The sections of `--help` that shared options stand in.
const EVERYWHERE: &str = "Every command";
const ARM: &str = "Arm, camera and scales";
const CELL: &str = "Scene, laboratory and files";
const PLANS: &str = "Planning";
const MODEL: &str = "A model that answers questions";

/// Options every command takes.
#[derive(Debug, Clone, Args)]
pub(super) struct Common {
    /// Print one JSON document on stdout and nothing else there.
    #[arg(long, global = true, help_heading = EVERYWHERE)]
    pub(super) json: bool,
    /// No progress and no tables.
    #[arg(long, short, global = true, help_heading = EVERYWHERE)]
    pub(super) quiet: bool,
    /// All there is about every step: each fluent that the step changed, promised or asks about.
    #[arg(long, short, global = true, help_heading = EVERYWHERE, conflicts_with = "quiet")]
    pub(super) verbose: bool,
    /// All chance comes from this number.
    #[arg(long, global = true, help_heading = EVERYWHERE, default_value_t = 1, value_parser = numbers::seed)]
    pub(super) seed: u64,
}

/// How free motions are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Motion {
    /// Paths are searched.
    Rrt,
    /// The arm is pulled and pushed.
    Rmpflow,
}

impl From<Motion> for Means {
    fn from(motion: Motion) -> Self {
        match motion {
            Motion::Rrt => Self::Rrt,
            Motion::Rmpflow => Self::Rmpflow,
        }
    }
}

/// How fast the laboratory's time passes while the arm moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Pace {
    /// As fast as it can be computed.
    Fast,
    /// No faster than time passes.
    Real,
}

/// What a command works with.
#[derive(Debug, Clone, Args)]
pub(super) struct CellArgs {
    /// The arm: `lab`, the built-in simulated laboratory, `twin`, the simulation alone, `kortex://USER@HOST[:PORT]`, a Gen3, with
    /// its password in `KORTEX_PASSWORD`, or `bridge://HOST:PORT`, a simulator or robot of your own.
    #[arg(long, global = true, help_heading = ARM, default_value = "lab")]
    pub(super) robot: String,
    /// The camera beside a Gen3 or a bridge: `http://HOST[:PORT]/PATH`, which answers with a PNG or JPEG picture.
    #[arg(long, global = true, help_heading = ARM, value_name = "URL")]
    pub(super) camera_at: Option<Address>,
    /// Scales beside a Gen3 or a bridge: `http://HOST[:PORT]/PATH`, which answers with JSON, as the emulator does.
    #[arg(long, global = true, help_heading = ARM, value_name = "URL")]
    pub(super) scales_at: Option<Address>,
    /// The share of a real arm's speed and acceleration limits that is used, from 0.02 to 1.
    #[arg(long, global = true, help_heading = ARM, value_name = "SHARE", value_parser = numbers::share, default_value_t = 0.1)]
    pub(super) speed: f64,
    /// Send a Gen3 positions at 1 kHz over UDP, at the port after its TCP port, instead of waypoints.
    #[arg(long, global = true, help_heading = ARM)]
    pub(super) stream: bool,
    /// How fast the laboratory's arm moves: `fast`, as fast as it can be computed, or `real`, as a real one.
    #[arg(long, global = true, help_heading = ARM, value_name = "PACE", default_value = "fast", hide_possible_values = true)]
    pub(super) pace: Pace,
    /// Let a real arm move without typing `move` first; at an open prompt each call is asked about all the same, until `:confirm none`.
    #[arg(long, global = true, help_heading = ARM)]
    pub(super) yes: bool,
    /// A `.task` file with a `scene`, instead of the kitchen of the stdlib.
    #[arg(long, global = true, help_heading = CELL, value_name = "FILE")]
    pub(super) scene: Option<PathBuf>,
    /// Settings of the lab (TOML), instead of its defaults.
    #[arg(long, global = true, help_heading = CELL, value_name = "FILE")]
    pub(super) lab: Option<PathBuf>,
    /// A folder whose files come before the embedded stdlib.
    #[arg(long, global = true, help_heading = CELL, value_name = "DIR")]
    pub(super) stdlib: Option<PathBuf>,
    /// Where run folders are made.
    #[arg(long, global = true, help_heading = CELL, value_name = "DIR", default_value = "runs")]
    pub(super) record: PathBuf,
    /// Try branches in proportion to how likely they are the best, instead of the best known.
    #[arg(long, global = true, help_heading = PLANS)]
    pub(super) explore: bool,
    /// How many plans are tried in the twin at most before the arm moves, from 1 to 64; one that spills nothing is enough.
    #[arg(long, global = true, help_heading = PLANS, value_name = "N", default_value_t = CANDIDATES, value_parser = numbers::candidates)]
    pub(super) candidates: usize,
    /// How free motions are found: `rrt`, a searched path, or `rmpflow`, pulled by the goal and pushed by obstacles.
    #[arg(long, global = true, help_heading = PLANS, value_name = "MEANS", default_value = "rrt", hide_possible_values = true)]
    pub(super) motion: Motion,
    /// Leave a regression out, to see what it is worth: 1 camera alignment, 2 intrinsics, 3 robot offset.
    #[arg(long, global = true, help_heading = PLANS, value_name = "1|2|3", value_delimiter = ',')]
    pub(super) without_regression: Vec<u8>,
    /// A vision-language model, `http://HOST:PORT/v1`, that answers the questions of runs beside geometry and
    /// at the prompt proposes calls for sentences; its key is in `TRUEUP_VQA_KEY`.
    #[arg(long, global = true, help_heading = MODEL, value_name = "URL")]
    pub(super) ask_endpoint: Option<Address>,
    /// The name of that model; the only one that is served when left out.
    #[arg(long, global = true, help_heading = MODEL, value_name = "NAME", requires = "ask_endpoint")]
    pub(super) ask_model: Option<String>,
    /// How long one of its replies may take, s.
    #[arg(long, global = true, help_heading = MODEL, value_name = "S", default_value_t = 20.0, value_parser = numbers::seconds)]
    pub(super) ask_timeout: f64,
}

/// What every command is given beside its own arguments.
#[derive(Debug, Clone, Args)]
pub(super) struct Shared {
    #[command(flatten)]
    pub(super) common: Common,
    #[command(flatten)]
    pub(super) cell: CellArgs,
}
