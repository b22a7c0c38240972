//! What may be wrong with a reality behind a bridge, and what would help.

use std::fmt;

use crate::arm::{DeviceError, Mover};

/// What is wrong with a bridge or its answers.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// Nobody listens there.
    #[error("no bridge at {place}: {why}")]
    Nobody {
        /// Where.
        place: String,
        /// What the system says.
        why: String,
    },
    /// The address is of no machine.
    #[error("no bridge at {place}: the address has no host")]
    NoHost {
        /// Where.
        place: String,
    },
    /// The connection ended.
    #[error("the bridge closed the connection before it answered `{request}`")]
    Closed {
        /// What was asked.
        request: &'static str,
    },
    /// The connection failed.
    #[error("the connection to the bridge failed at `{request}`: {why}")]
    Broken {
        /// What was asked.
        request: &'static str,
        /// What the system says.
        why: String,
    },
    /// No answer came.
    #[error("the bridge did not answer `{request}` within {within_s:.0} s")]
    Silent {
        /// What was asked.
        request: &'static str,
        /// How long was waited, s.
        within_s: f64,
    },
    /// An answer has no end.
    #[error("the answer to `{request}` is longer than {limit_mib} MiB")]
    TooLong {
        /// What was asked.
        request: &'static str,
        /// The longest line, MiB.
        limit_mib: usize,
    },
    /// An answer ends in the middle of its object, or before it.
    #[error("the answer to `{request}` ends too early: {}", shown(.begins))]
    CutShort {
        /// What was asked.
        request: &'static str,
        /// How it begins.
        begins: String,
    },
    /// A list where an object is due.
    #[error(
        "{}the answer to `{request}` is a list: the protocol has one object there",
        .key.map(|key| format!("`{key}` in ")).unwrap_or_default()
    )]
    List {
        /// What was asked.
        request: &'static str,
        /// Under which key; none for the whole answer.
        key: Option<&'static str>,
    },
    /// An answer is no JSON, or has not the keys and types that it must.
    #[error(
        "the answer to `{request}` cannot be read: {why}{}; {}",
        .key.as_ref().map(|key| format!(", in `{key}`")).unwrap_or_default(),
        shown(.begins)
    )]
    Unfit {
        /// What was asked.
        request: &'static str,
        /// Why not.
        why: String,
        /// Under which key, where it is known.
        key: Option<String>,
        /// How it begins.
        begins: String,
    },
    /// What an answer holds cannot be read.
    #[error("the answer to `{request}` cannot be read: {why}")]
    Unreadable {
        /// What was asked.
        request: &'static str,
        /// Why not.
        why: String,
    },
    /// The server speaks another version.
    #[error("the bridge speaks version {theirs} of the protocol, this program version {ours}")]
    Version {
        /// The server's.
        theirs: u32,
        /// This program's.
        ours: u32,
    },
    /// It is another robot, or its joints are in another order.
    #[error("the bridge has the joints {theirs}; the scene's robot has {ours}")]
    Joints {
        /// The server's names.
        theirs: String,
        /// The robot's names.
        ours: String,
    },
    /// A list has the wrong length.
    #[error(
        "`{field}` in the answer to `{request}` has {got} numbers; the robot has {joints} joints"
    )]
    Length {
        /// What was asked.
        request: &'static str,
        /// Which list.
        field: &'static str,
        /// Its length.
        got: usize,
        /// How many there must be.
        joints: usize,
    },
    /// A number is none.
    #[error(
        "`{field}`{} in the answer to `{request}` is no finite number",
        .joint.map(|joint| format!(" of joint {joint}")).unwrap_or_default()
    )]
    NotFinite {
        /// What was asked.
        request: &'static str,
        /// Which number.
        field: &'static str,
        /// Of which joint, from 1, where there is one for each.
        joint: Option<usize>,
    },
    /// Something that moves by itself is no ball at a time before now.
    #[error(
        "number {which} of `moving` in the answer to `{request}` is no ball with a name of its own"
    )]
    Mover {
        /// What was asked.
        request: &'static str,
        /// Its place in the list, from 1.
        which: usize,
    },
    /// More moves by itself than is heard of.
    #[error("`moving` in the answer to `{request}` has {got} balls; {} are heard of", Mover::MOST)]
    Movers {
        /// What was asked.
        request: &'static str,
        /// How many there are.
        got: usize,
    },
    /// The server's clock went back.
    #[error("the bridge's clock went back from {from:.6} s to {to:.6} s")]
    ClockWentBack {
        /// The time before, s.
        from: f64,
        /// The time now, s.
        to: f64,
    },
    /// The server's clock stands while time is to pass.
    #[error("the bridge's clock stands still at {at:.6} s, though {passed:.1} s were to pass")]
    ClockStands {
        /// What it says, s.
        at: f64,
        /// How much time it was to let pass, s.
        passed: f64,
    },
    /// The server's clock goes on by more than was asked.
    #[error("the bridge's clock went on by {leap:.3} s, though {asked:.3} s were to pass")]
    ClockLeaps {
        /// By how much it went on, s.
        leap: f64,
        /// How much time it was to let pass, s.
        asked: f64,
    },
    /// A number is far from all that it can be.
    #[error(
        "`{field}`{} in the answer to `{request}` is {value:.2}, far outside {:.2} to {:.2}{}",
        .joint.map(|joint| format!(" of joint {joint}")).unwrap_or_default(),
        .range.0,
        .range.1,
        .probably.map(|unit| format!(": probably in {unit}")).unwrap_or_default()
    )]
    Units {
        /// What was asked.
        request: &'static str,
        /// Which number.
        field: &'static str,
        /// Of which joint, from 1, where there is one for each.
        joint: Option<usize>,
        /// What it says.
        value: f64,
        /// What it can be, in SI units.
        range: (f64, f64),
        /// In which unit it would be well.
        probably: Option<Unit>,
    },
    /// A torque that no motor gives came after some that could be.
    #[error(
        "`tau` of joint {joint} in the answer to `{request}` is {value:.0} after {before:.1}, where {most:.0} is the most: the joint felt a knock, or the simulation has diverged"
    )]
    Knock {
        /// What was asked.
        request: &'static str,
        /// Joint number from 1.
        joint: usize,
        /// What it says, N·m or N.
        value: f64,
        /// What it said before, N·m or N.
        before: f64,
        /// What its motor may carry, N·m or N.
        most: f64,
    },
    /// Fingers are open by less than nothing.
    #[error(
        "`opening` in the answer to `{request}` is {opening_mm:.0} mm: a gripper cannot open by less than 0"
    )]
    Negative {
        /// What was asked.
        request: &'static str,
        /// What it says, mm.
        opening_mm: f64,
    },
    /// A joint is far from where it was just before.
    #[error(
        "`q` of joint {joint} in the answer to `{request}` changed by {turned_deg:.0} deg within {:.0} ms: it turns at {limit_deg_s:.0} deg/s at most",
        .within_s * 1e3
    )]
    Leap {
        /// What was asked.
        request: &'static str,
        /// Which joint, from 1.
        joint: usize,
        /// By how much it changed, degrees.
        turned_deg: f64,
        /// In how much time, s.
        within_s: f64,
        /// How fast it can be, deg/s.
        limit_deg_s: f64,
    },
    /// The numbers stay as they are while commands go on.
    #[error(
        "the server's numbers do not change: `q` and `dq` in its answers to `step` were the same for {passed_s:.2} s, while `q` was commanded on by {sent_deg:.0} deg"
    )]
    Frozen {
        /// For how long, s.
        passed_s: f64,
        /// How far commands went on, degrees.
        sent_deg: f64,
    },
    /// An answer waits though nothing was asked.
    #[error("after its answer to `{after}` the bridge sent another that nobody asked for")]
    Unasked {
        /// What was answered last.
        after: &'static str,
    },
    /// Somebody wished to stop before an answer came.
    #[error("stopped before the bridge answered `{request}`")]
    Interrupted {
        /// What was asked.
        request: &'static str,
    },
    /// There is no camera, and none was named.
    #[error("the bridge has no camera, and nothing is done unseen")]
    NoCamera,
    /// A picture is of another camera than the scene's.
    #[error("the bridge's camera takes {theirs} px, the scene's camera {ours} px")]
    Picture {
        /// Width x height of the server's.
        theirs: String,
        /// Width x height of the scene's.
        ours: String,
    },
    /// A picture is of another size than the server said.
    #[error("the bridge's picture has {sent} px, its `hello` says {said} px")]
    PictureSize {
        /// Width x height of the picture.
        sent: String,
        /// Width x height that `hello` said.
        said: String,
    },
    /// A negative volume of water.
    #[error("the scales of the bridge say {volume_m3} m3 of {which}")]
    Scales {
        /// A vessel's name, or what was spilt.
        which: String,
        /// What they say, m³.
        volume_m3: f64,
    },
    /// The server said no.
    #[error("the bridge refused `{request}`: {why}")]
    Refused {
        /// What was asked.
        request: &'static str,
        /// What it said.
        why: String,
        /// What it said would help; may be empty.
        help: String,
    },
}

/// A unit that is none of the protocol's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Of an angle.
    Degrees,
    /// Of a length.
    Millimetres,
    /// Of an opening, 1 where it is widest.
    Fractions,
    /// Of an opening, 100 where it is widest.
    PerCent,
    /// Of a Robotiq gripper's opening, 0 to 255.
    Counts,
    /// Of a torque.
    Millinewtons,
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Degrees => "degrees",
            Self::Millimetres => "mm",
            Self::Fractions => "fractions of its widest (0 to 1)",
            Self::PerCent => "per cent of its widest",
            Self::Counts => "a gripper's counts (0 to 255)",
            Self::Millinewtons => "mN*m or N*mm",
        })
    }
}

/// Says how a line begins.
fn shown(begins: &str) -> String {
    if begins.is_empty() { "it is an empty line".into() } else { format!("it begins `{begins}`") }
}

/// A clock that goes on by this times what was asked, or by twice or half of that, counts ms.
const MILLI: f64 = 1e3;

impl Error {
    /// Returns whether something that listens there answered, and what it says cannot be worked with.
    pub fn is_answer(&self) -> bool {
        !matches!(
            self,
            Self::Nobody { .. }
                | Self::NoHost { .. }
                | Self::Closed { .. }
                | Self::Broken { .. }
                | Self::Silent { .. }
                | Self::Interrupted { .. }
        )
    }

    /// Returns what would help.
    pub fn help(&self) -> &str {
        match self {
            Self::Nobody { .. } | Self::NoHost { .. } => {
                "start the server first (an example: `examples/bridge/`), then name it `bridge://HOST:PORT`"
            }
            Self::Silent { request: "hello", .. } => {
                "does the server still build its world, or is another client connected? Look at what it printed, and try again"
            }
            Self::Unasked { .. } => {
                "let the server send one line for every line, and none by itself"
            }
            Self::Units { field: "tau", .. } => {
                "the protocol has N*m; if these are, mend the joint's `effort` in the robot's URDF"
            }
            Self::Knock { .. } => {
                "see what the arm ran into; a simulation diverges less with shorter time steps and softer contacts"
            }
            Self::Units { field: "opening", .. } => {
                "the protocol has the way between the pads, in m; closed fingers are open by 0 m"
            }
            Self::Negative { .. } => {
                "is its sign turned, or its zero off? Closed fingers are open by 0 m"
            }
            Self::Leap { .. } => {
                "are the signs and the order of the joints the same in every answer, those of the URDF?"
            }
            Self::Frozen { .. } => "let the server read its arm anew for each answer",
            Self::Units { .. } => "the protocol has SI units: rad, rad/s, m, s, N·m",
            Self::ClockLeaps { leap, asked } if (0.5..=2.0).contains(&(leap / asked / MILLI)) => {
                "`t` is in s, and probably is in ms here"
            }
            Self::ClockLeaps { .. } => {
                "let `t` go on by the `dt` of each `step`, or say `\"realtime\": true` in `hello` if it passes by itself"
            }
            Self::Interrupted { .. } => "call it again to go on",
            Self::Closed { .. } | Self::Broken { .. } | Self::Silent { .. } => {
                "look at what the server printed; one answer is expected for every line"
            }
            Self::Unreadable { request: "photo", .. } => {
                "answer with a PNG file in base64, as `docs/bridge.md` says"
            }
            Self::CutShort { .. } => {
                "send each answer as one whole line, with a line break at its end and none before"
            }
            Self::List { key: Some("camera"), .. } => {
                "there is one camera, `\"camera\": {\"width\": 1280, \"height\": 720}`; `--camera-at http://HOST/PATH` names another in its place"
            }
            Self::TooLong { .. }
            | Self::List { .. }
            | Self::Unfit { .. }
            | Self::Unreadable { .. } => {
                "answer with one JSON object a line, with the keys that `docs/bridge.md` has for it"
            }
            Self::Version { .. } => "run a server that speaks the same version",
            Self::Joints { .. } => {
                "load the same robot in the server, its joints in the order of the URDF"
            }
            Self::Length { .. } | Self::NotFinite { .. } => {
                "let the server check what it sends: one finite number for each joint"
            }
            Self::Mover { .. } => {
                "give each a name of its own, its middle in m, a radius above 0 and up to 2 m, and an age of 0 s or more"
            }
            Self::Movers { .. } => "put balls around what is near the arm, and leave the rest out",
            Self::ClockWentBack { .. } => {
                "let the server's time only go on; a reset needs a new connection"
            }
            Self::ClockStands { .. } => "let `t` go on by the `dt` of each `step`",
            Self::NoCamera => "name one that sees the table: `--camera-at http://HOST/PATH`",
            Self::Picture { .. } => {
                "give the scene's camera that size, or let the server draw pictures of the scene's size"
            }
            Self::PictureSize { .. } => {
                "send pictures of the size that `hello` says, which is that of the scene's camera"
            }
            Self::Scales { .. } => "let the server's scales say m3, 0 or more",
            Self::Refused { help, .. } if !help.is_empty() => help,
            Self::Refused { .. } => "look at what the server printed",
        }
    }
}

impl From<Error> for DeviceError {
    fn from(error: Error) -> Self {
        if matches!(error, Error::Interrupted { .. }) {
            return Self::Stopped;
        }
        Self::Refused { what: error.to_string(), help: error.help().to_owned() }
    }
}
