//! Why a step did not succeed, with the numbers that decided. `Display` words it; nobody reads the words.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::arm::limits::LimitError;
use crate::language::text;
use crate::units::{Dimension, Quantity, told_apart};

use super::no_way::NoWay;

/// A condition that was read and is false.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Unmet {
    /// The condition as text: `above(jar, cup) and upright(cup)`.
    pub condition: String,
    /// The part of it that decided; the whole condition where it has no parts.
    pub term: String,
    /// By how much it fails, where it has a margin.
    pub margin: Option<Quantity>,
    /// What was compared, with what limit.
    pub numbers: Option<(Quantity, Quantity)>,
}

impl Unmet {
    /// Whether a text is this condition, or the part of it that decided.
    pub fn is(&self, text: &str) -> bool {
        self.condition == text || self.term == text
    }
}

impl fmt::Display for Unmet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}`, which is false", self.term)?;
        let Some(Quantity { value, dimension }) = self.margin else { return Ok(()) };
        write!(f, " by {}", Quantity { value: value.abs(), dimension })?;
        match self.numbers {
            Some((value, limit)) => {
                let [value, limit] = told_apart(value, limit);
                write!(f, " ({value}, limit {limit})")
            }
            None => Ok(()),
        }
    }
}

/// A time limit that was exceeded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Overdue {
    /// Whose limit: `pick(jar)`.
    pub of: String,
    /// How long it has taken, s.
    pub took_s: f64,
    /// The limit at full speed, s.
    pub limit_s: f64,
    /// The share of full speed that the arm was held to, in the mean over that time.
    pub pace: f64,
}

impl fmt::Display for Overdue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // As a limit is written in a text: `4 s`.
        let text = |value| text::quantity(Quantity { value, dimension: Dimension::TIME });
        let Self { of, took_s, limit_s, pace } = self;
        write!(f, "{of} has taken {took_s:.2} s, and its limit is {}", text(*limit_s))?;
        if *pace < 1.0 {
            write!(f, " at full speed, {} at {pace:.2} of it", text(limit_s / pace))?;
        }
        Ok(())
    }
}

/// A relation between intervals that does not hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mistimed {
    /// The two sides, as the text calls them.
    pub sides: [String; 2],
    /// The relation as it is written: `during`.
    pub relation: String,
    /// By how much it should hold, s.
    pub by_s: Option<f64>,
    /// How far it is from holding, s.
    pub error_s: f64,
    /// From when to when each side went, s from the earlier beginning.
    pub went_s: [[f64; 2]; 2],
}

impl fmt::Display for Mistimed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = &self.sides;
        let by = self.by_s.map(|by| format!(" by {by:.2} s")).unwrap_or_default();
        let [[a_from, a_to], [b_from, b_to]] = self.went_s;
        write!(
            f,
            "`{a} {} {b}{by}` is off by {:.2} s: {a} went from {a_from:.2} s to {a_to:.2} s and {b} from \
             {b_from:.2} s to {b_to:.2} s",
            self.relation, self.error_s
        )
    }
}

/// What two steps that are to go on together both need.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shared {
    /// The arm's joints.
    Arm,
    /// The fingers.
    Fingers,
    /// The camera.
    Camera,
}

impl fmt::Display for Shared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Arm => "need the arm",
            Self::Fingers => "move the fingers",
            Self::Camera => "take a picture",
        })
    }
}

/// How far from its rehearsal a step would have had to go.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Unrehearsed {
    /// The hand would have to turn further.
    Turn {
        /// How far, rad.
        needed: f64,
        /// How far the rehearsal turned it, rad.
        rehearsed: f64,
    },
    /// Something that was to be felt was not there.
    Touch {
        /// How far the hand went, m.
        went: f64,
        /// How far it went in the rehearsal, m.
        rehearsed: f64,
    },
    /// A joint is elsewhere than where the rehearsal went on.
    Start {
        /// How far off the worst joint is, rad.
        off: f64,
    },
}

impl fmt::Display for Unrehearsed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Turn { needed, rehearsed } => write!(
                f,
                "the hand would have to turn {:.0} deg where the rehearsal turned it {:.0} deg, which is \
                 too far to go unrehearsed",
                needed.to_degrees(),
                rehearsed.to_degrees()
            ),
            Self::Touch { went, rehearsed } => write!(
                f,
                "nothing was felt {:.0} mm along the way; the rehearsal felt it after {:.0} mm, and further is too far \
                 to go unrehearsed",
                went * 1e3,
                rehearsed * 1e3
            ),
            Self::Start { off } => write!(
                f,
                "a joint is {:.1} deg from where the rehearsal went on, which is too far to go \
                 unrehearsed",
                off.to_degrees()
            ),
        }
    }
}

/// A joint that would carry more than the robot's file says that it may.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Overload {
    /// The joint's name.
    pub joint: String,
    /// Whether it slides: then it carries N, not N·m.
    pub slides: bool,
    /// What it would carry, a mean over a quarter of a second, N·m or N.
    pub torque: f64,
    /// What it may carry, N·m or N.
    pub limit: f64,
    /// What is in the hand.
    pub held: Option<String>,
}

impl fmt::Display for Overload {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { joint, slides, torque, limit, held } = self;
        let unit = if *slides { "N" } else { "N·m" };
        write!(f, "{joint} would carry {torque:.1} {unit}, and its limit is {limit:.1} {unit}")?;
        match held {
            Some(held) => write!(f, ", with `{held}` in the hand"),
            None => Ok(()),
        }
    }
}

/// Where a script stood when it gave up.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
    /// The script: `lift.rhai`.
    pub script: String,
    /// The line, from 1; 0 when unknown.
    pub line: usize,
    /// The line of the task that calls it: `tasks/std.task:188`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub called_from: Option<String>,
}

/// Why a step did not succeed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// What must hold before it does not.
    #[error("it needs {0}")]
    Needs(Unmet),
    /// What it promises does not hold after it.
    #[error("it promised {0}")]
    Promise(Unmet),
    /// What must hold throughout was lost; after so many s of the step, when that is known.
    #[error("it lost {unmet}{}", after(*.after_s))]
    Lost {
        /// What.
        unmet: Unmet,
        /// When, s from the beginning of the step.
        after_s: Option<f64>,
    },
    /// Its script was over before what was to end it came true.
    #[error("it came to its end before {0}")]
    Unfinished(Unmet),
    /// The rehearsal found it done already, and it is not.
    #[error("in the rehearsal there was nothing to do here; now there is: {0}")]
    NotDoneAlready(Unmet),
    /// What ends it did not come true when it did in the rehearsal.
    #[error(
        "{unmet} {after_s:.2} s into the step, {late_s:.2} s later than it was true in the rehearsal"
    )]
    Late {
        /// What.
        unmet: Unmet,
        /// When it was given up, s from the beginning of the step.
        after_s: f64,
        /// How much later than in the rehearsal that is, s.
        late_s: f64,
    },
    /// A time limit is exceeded.
    #[error("{0}")]
    Overdue(Overdue),
    /// A rehearsal takes more arm time than it is given.
    #[error("it is not over within {allowed_s} s of arm time")]
    Endless {
        /// What it is given, s.
        allowed_s: f64,
    },
    /// A relation in time does not hold.
    #[error("{0}")]
    Mistimed(Mistimed),
    /// Two steps that are to go on together need the same.
    #[error("{} and {} cannot go on together: both {both}", .steps[0], .steps[1])]
    Conflict {
        /// The steps as calls.
        steps: [String; 2],
        /// What both need.
        both: Shared,
    },
    /// What goes on beside it failed.
    #[error("what goes on beside it failed")]
    Beside,
    /// Its script asked for something else than in the rehearsal.
    #[error(
        "the step went differently than rehearsed: it asked for {asked} where the rehearsal had {had}"
    )]
    Diverged {
        /// What was asked for.
        asked: String,
        /// What the rehearsal had at this place.
        had: String,
    },
    /// The arm would have to go where the rehearsal did not lead it.
    #[error("{0}")]
    Unrehearsed(Unrehearsed),
    /// The limits refused a motion or a grip.
    #[error("{0}")]
    Limit(LimitError),
    /// There is no way.
    #[error("{0}")]
    NoWay(NoWay),
    /// It recalls what no earlier action remembered.
    #[error("no earlier action remembered a `{name}`")]
    NotRemembered {
        /// What it recalls.
        name: String,
    },
    /// The fingers may not press as hard as a thing would need: what the binding says.
    #[error("{0}")]
    TooHeavy(String),
    /// A joint would carry more than it may: what the rehearsal measured.
    #[error("{0}")]
    Overloaded(Overload),
    /// Its script gave up, or a binding refused what the script asked for: their own words.
    #[error("{0}")]
    Refused(String),
    /// Its script cannot be run: what the engine says.
    #[error("{0}")]
    Script(String),
    /// A person stopped it.
    #[error("stopped; the arm holds its position")]
    Stopped,
    /// A person stopped it, and the arm has not answered yet that it holds.
    #[error("asked to stop; the arm has not answered yet")]
    StopUnanswered,
    /// A device failed: what it says.
    #[error("{0}")]
    Device(String),
}

fn after(after_s: Option<f64>) -> String {
    after_s.map(|after| format!(" {after:.2} s into the step")).unwrap_or_default()
}

impl Cause {
    /// Returns the condition it is about, if it is about one.
    pub fn unmet(&self) -> Option<&Unmet> {
        match self {
            Self::Needs(unmet)
            | Self::Promise(unmet)
            | Self::Unfinished(unmet)
            | Self::NotDoneAlready(unmet)
            | Self::Lost { unmet, .. }
            | Self::Late { unmet, .. } => Some(unmet),
            _ => None,
        }
    }
}

/// Why a step did not succeed, and where its script stood.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StepFailure {
    /// Why.
    pub cause: Cause,
    /// Where, when it was a line of a script.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<Place>,
}

impl From<Cause> for StepFailure {
    fn from(cause: Cause) -> Self {
        Self { cause, place: None }
    }
}

impl fmt::Display for StepFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cause, place } = self;
        let Some(Place { script, line, called_from }) = place else { return write!(f, "{cause}") };
        let from = called_from.as_ref().map(|from| format!(", called from {from}"));
        let from = from.unwrap_or_default();
        match cause {
            Cause::Script(says) => write!(f, "{script}:{line}: {says}{from}"),
            cause => write!(f, "{cause} ({script}:{line}{from})"),
        }
    }
}
