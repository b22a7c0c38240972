//! That there is no way for the arm, and why, as data.

use serde::{Deserialize, Serialize};

/// What is less out of reach is reached, m: half of the millimetre that messages are rounded to.
const FOLLOWED: f64 = 5e-4;

/// There is no way, and why.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NoWay {
    /// What was wanted: "to grasp `jar`".
    pub what: String,
    /// Why not.
    pub why: Why,
}

/// Why there is no way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Why {
    /// Nobody knows where the object is.
    NotSeen(String),
    /// It does not fit between the fingers.
    TooWide {
        /// Its narrowest width, m.
        width: f64,
        /// The fingers' opening, m.
        opening: f64,
    },
    /// Fingers find no two sides opposite each other.
    NoSides,
    /// The arm does not reach.
    OutOfReach {
        /// The smallest distance between the goal and what the tool can reach, m.
        nearest: f64,
    },
    /// Every reachable way touches something.
    Blocked {
        /// How many ways were tried.
        tried: usize,
        /// What was touched most often.
        by: String,
    },
    /// The search ended without a path.
    NoPath(String),
    /// There is too little water to stir.
    Shallow {
        /// How deep it is, m.
        depth: f64,
        /// How deep it should be, m.
        least: f64,
    },
    /// There is nothing in the hand.
    EmptyHand,
    /// The hand is over the opening that is to be poured from.
    OverOpening,
    /// Pushed, it would tip over.
    Topples {
        /// How high it is, m.
        height: f64,
        /// The highest of its width that slides, m.
        most: f64,
        /// The coefficient of friction that this rests on.
        friction: f64,
    },
    /// Pushing does not bring it onto something else.
    Lifted {
        /// What bears it.
        from: String,
        /// What was to bear it.
        to: String,
    },
    /// The search used up its budget, which stands for about so many seconds of computing.
    NotWithin(u64),
    /// A person asked to stop.
    Stopped,
}

impl std::fmt::Display for NoWay {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "no way {}: ", self.what)?;
        match &self.why {
            Why::NotSeen(o) => write!(f, "the position of `{o}` has not been measured"),
            Why::TooWide { width, opening } => write!(
                f,
                "it is {:.0} mm wide and the fingers open {:.0} mm",
                width * 1e3,
                opening * 1e3
            ),
            Why::NoSides => {
                write!(f, "fingers that close level find no two upright sides opposite each other")
            }
            Why::OutOfReach { nearest } if *nearest < FOLLOWED => {
                write!(f, "the arm reaches it but cannot follow the straight way there and back")
            }
            Why::OutOfReach { nearest } => {
                write!(f, "it is {:.0} mm out of reach", nearest * 1e3)
            }
            Why::Blocked { tried: 0, by } => write!(f, "there is no room; `{by}` is in the way"),
            Why::Blocked { tried, by } => {
                write!(f, "all {tried} reachable ways touch something, mostly {by}")
            }
            Why::NoPath(why) => write!(f, "no path was found ({why})"),
            Why::Topples { height, most, friction } => write!(
                f,
                "it is {:.0} mm high and would tip over; with a friction of {friction:.2} what is as narrow may be at \
                 most {:.0} mm high",
                height * 1e3,
                most * 1e3
            ),
            Why::Lifted { from, to } => {
                write!(f, "it stands on `{from}`, and pushing does not bring it onto `{to}`")
            }
            Why::Shallow { depth, least } => write!(
                f,
                "its water is {:.0} mm deep, and a tool needs {:.0} mm",
                depth * 1e3,
                least * 1e3
            ),
            Why::EmptyHand => write!(f, "there is nothing in the hand"),
            Why::OverOpening => write!(f, "the hand that holds it from above is over its opening"),
            Why::NotWithin(seconds) => {
                write!(f, "none was found within a budget of about {seconds} s of computing")
            }
            Why::Stopped => write!(f, "stopped"),
        }
    }
}

impl std::error::Error for NoWay {}
