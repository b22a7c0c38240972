//! That there is no way for the arm, and why, as data.

use serde::{Deserialize, Serialize};

/// What is less out of reach is reached, m: half of the millimetre that messages are rounded to.
const FOLLOWED: f64 = 5e-4;
/// The farthest that is told as out of reach, m: farther than any table is long. What is said to be so far is farther off than
/// anybody knows.
pub const FARTHEST_TOLD: f64 = 9.99;

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
    /// The fingers do not close on it.
    TooNarrow {
        /// Its width where they would hold it, m; the largest.
        width: f64,
        /// How wide they are open when they are closed, m.
        opening: f64,
    },
    /// Fingers find no two sides opposite each other.
    NoSides,
    /// The palm is against it before the fingers reach far enough round it.
    FingersShort {
        /// How much longer they would have to be, m.
        by: f64,
    },
    /// The arm does not reach.
    OutOfReach {
        /// The smallest distance between the goal and what the tool can reach, m.
        nearest: f64,
    },
    /// The arm reaches it only where less is left to the end of a joint's range than plans keep.
    AtEnd {
        /// The joint.
        joint: String,
    },
    /// The arm reaches it, but cannot turn its hand there as it would have to.
    NotTurned,
    /// The arm does not reach the place over a thing.
    OverOutOfReach(Over),
    /// Every reachable way touches something.
    Blocked {
        /// How many ways were tried.
        tried: usize,
        /// What was touched most often.
        by: String,
    },
    /// Every reachable way into a vessel touches its walls.
    Walls {
        /// How many ways were tried.
        tried: usize,
        /// What was touched most often.
        by: String,
        /// The vessel.
        vessel: String,
    },
    /// The search ended without a path.
    NoPath(String),
    /// What is in the hand is tilted further than it may be carried.
    Tilted(Tilted),
    /// Where the way begins or ends, the arm runs into what is in its hand.
    IntoHeld {
        /// What is in the hand.
        held: String,
        /// What overlaps, and by how much.
        says: String,
    },
    /// Where the way begins or ends is nearer to something than is kept as long as the arm is not calibrated.
    TooNear(Box<TooNear>),
    /// It would not stand on the table.
    OffTable(OffTable),
    /// It has room nowhere on the table where the arm sets things down of itself, nor where it stood.
    NoFreePlace,
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

impl Why {
    /// Returns why there is no way into a vessel: its own walls, where they are what was touched most often.
    pub(crate) fn into_vessel(self, vessel: Option<&str>) -> Self {
        match (self, vessel) {
            (Self::Blocked { tried, by }, Some(vessel))
                if by.ends_with(&format!(" with {vessel}")) =>
            {
                Self::Walls { tried, by, vessel: vessel.to_owned() }
            }
            (why, _) => why,
        }
    }
}

/// A place at which a thing would not stand on the table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OffTable {
    /// The point at which it was to stand, m; `None` for a place that is told by other things.
    pub at: Option<[f64; 2]>,
    /// The corners of the table with the least and the greatest x and y, m.
    pub table: [[f64; 2]; 2],
    /// How far from the edge its middle has to be, m.
    pub edge: f64,
}

/// A thing in the hand that is tilted further than it may be carried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tilted {
    /// The thing.
    pub held: String,
    /// Whether it is a vessel.
    pub is_vessel: bool,
    /// How far from upright it is, rad.
    pub angle: f64,
    /// How far from upright it may be on the way, rad.
    pub most: f64,
}

/// Two things that are too near to each other until the arm is calibrated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TooNear {
    /// Whether the way begins or ends there: "start" or "goal".
    pub which: String,
    /// A part of the arm, or what is in the hand.
    pub first: String,
    /// What it is near to.
    pub second: String,
    /// The distance between them, m; negative where they overlap.
    pub apart: f64,
    /// The distance that is kept, m.
    pub kept: f64,
}

/// A place over a thing that the arm does not reach.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Over {
    /// The thing.
    pub target: String,
    /// The smallest distance between the goal and what the tool can reach, m.
    pub nearest: f64,
}

impl std::fmt::Display for OffTable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [[x0, y0], [x1, y1]] = self.table.map(|corner| corner.map(|m| 100.0 * m));
        match self.at.map(|at| at.map(|m| 100.0 * m)) {
            Some([x, y]) if x < x0 || x > x1 || y < y0 || y > y1 => {
                write!(f, "({x:.1}, {y:.1}) cm is off the table")
            }
            Some([x, y]) => write!(
                f,
                "({x:.1}, {y:.1}) cm is less than {:.1} cm from the edge of the table",
                100.0 * self.edge
            ),
            None => write!(f, "every place there is off the table, or too near its edge"),
        }?;
        write!(f, "; the table is from x = {x0:.0} to {x1:.0} cm and y = {y0:.0} to {y1:.0} cm")
    }
}

impl std::fmt::Display for Tilted {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (angle, most) = (self.angle.to_degrees(), self.most.to_degrees());
        let held = &self.held;
        write!(
            f,
            "`{held}` is tilted by {angle:.1} deg, and is carried within {most:.1} deg of upright"
        )
    }
}

impl std::fmt::Display for TooNear {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { which, first, second, apart, kept } = self;
        write!(f, "at the {which} {first} and {second} ")?;
        match apart * 1e3 {
            apart if apart < -0.5 => write!(f, "overlap by {:.0} mm", -apart),
            apart if apart < 0.5 => write!(f, "touch"),
            apart => write!(f, "are {apart:.0} mm apart"),
        }?;
        write!(f, "; {:.0} mm are kept until the arm is calibrated", kept * 1e3)
    }
}

impl std::fmt::Display for Over {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { target, nearest } = self;
        if *nearest < FOLLOWED {
            return write!(
                f,
                "the arm reaches over `{target}` but cannot turn there as far as a pour needs"
            );
        }
        if *nearest >= FARTHEST_TOLD {
            return write!(f, "the arm does not get over `{target}`");
        }
        write!(f, "the place over `{target}` is {:.0} mm out of reach", nearest * 1e3)
    }
}

impl std::fmt::Display for NoWay {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "no way {}: ", self.what)?;
        match &self.why {
            Why::NotSeen(o) => write!(f, "the position of `{o}` has not been measured"),
            Why::TooWide { width, opening } if width < opening => write!(
                f,
                "it is {:.0} mm wide where they would hold it, which leaves too little room between fingers that open {:.0} mm",
                width * 1e3,
                opening * 1e3
            ),
            Why::TooWide { width, opening } => write!(
                f,
                "it is {:.0} mm wide and the fingers open {:.0} mm",
                width * 1e3,
                opening * 1e3
            ),
            Why::TooNarrow { width, opening } => write!(
                f,
                "it is {:.0} mm wide where they would hold it, and the fingers stay {:.0} mm open when they close",
                width * 1e3,
                opening * 1e3
            ),
            Why::NoSides => {
                write!(f, "fingers that close level find no two upright sides opposite each other")
            }
            Why::FingersShort { by } => write!(
                f,
                "the fingers are {:.0} mm too short to reach far enough round it: the palm is against it before they do",
                (by * 1e3).max(1.0)
            ),
            Why::OutOfReach { nearest } if *nearest < FOLLOWED => {
                write!(f, "the arm reaches it but cannot follow the straight way there and back")
            }
            Why::OutOfReach { nearest } if *nearest >= FARTHEST_TOLD => {
                write!(f, "the arm does not get there")
            }
            Why::OutOfReach { nearest } => {
                write!(f, "it is {:.0} mm out of reach", nearest * 1e3)
            }
            Why::AtEnd { joint } => {
                write!(f, "the arm reaches it only with `{joint}` at the end of its range")
            }
            Why::NotTurned => {
                write!(f, "the arm reaches it, but cannot turn its hand there as it would have to")
            }
            Why::OverOutOfReach(over) => write!(f, "{over}"),
            Why::Blocked { tried: 0, by } => write!(f, "there is no room; `{by}` is in the way"),
            Why::Blocked { tried, by } | Why::Walls { tried, by, .. } => {
                write!(f, "all {tried} reachable ways touch something, mostly {by}")
            }
            Why::OffTable(off) => write!(f, "{off}"),
            Why::NoFreePlace => {
                write!(f, "no place on the table within the arm's reach has room for it")
            }
            Why::NoPath(says) | Why::IntoHeld { says, .. } => {
                write!(f, "no path was found ({says})")
            }
            Why::Tilted(tilted) => write!(f, "{tilted}"),
            Why::TooNear(near) => write!(f, "{near}"),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distance_that_nobody_knows_is_not_told() {
        let said = |why| NoWay { what: "to grasp `jar`".into(), why }.to_string();
        assert!(said(Why::OutOfReach { nearest: 0.02 }).contains("20 mm out of reach"));
        let far = said(Why::OutOfReach { nearest: FARTHEST_TOLD });
        assert!(!far.contains(" mm"), "{far}");
        let end = said(Why::AtEnd { joint: "lift".into() });
        assert!(end.ends_with("only with `lift` at the end of its range"), "{end}");
        let walls =
            |by: &str, vessel| Why::Blocked { tried: 60, by: by.into() }.into_vessel(vessel);
        assert!(matches!(walls("hand with bin", Some("bin")), Why::Walls { .. }));
        assert!(matches!(walls("hand with bin", None), Why::Blocked { .. }));
        assert!(matches!(walls("hand with can", Some("bin")), Why::Blocked { .. }));
        assert!(said(walls("hand with bin", Some("bin"))).ends_with("mostly hand with bin"));
        // Fingers need room beside the thing.
        let tight = said(Why::TooWide { width: 0.082, opening: 0.085 });
        assert!(tight.contains("too little room"), "{tight}");
        let thin = said(Why::TooNarrow { width: 0.025, opening: 0.04 });
        assert!(thin.ends_with(
            "25 mm wide where they would hold it, and the fingers stay 40 mm open when they close"
        ));
        let near = |apart| {
            let (which, first, second) = ("start".into(), "cart".into(), "table".into());
            said(Why::TooNear(Box::new(TooNear { which, first, second, apart, kept: 0.04 })))
        };
        assert!(near(0.02).ends_with(
            "cart and table are 20 mm apart; 40 mm are kept until the arm is calibrated"
        ));
        assert!(near(1e-9).contains("cart and table touch;"), "{}", near(1e-9));
        assert!(near(-0.01).contains("overlap by 10 mm"));
        let (held, angle, most) = ("jar".into(), 0.8936, 8_f64.to_radians());
        let tilted = said(Why::Tilted(Tilted { held, is_vessel: true, angle, most }));
        assert!(
            tilted
                .ends_with("`jar` is tilted by 51.2 deg, and is carried within 8.0 deg of upright")
        );
        let table = [[0.0, -0.38], [1.0, 0.38]];
        let off = |at| said(Why::OffTable(OffTable { at: Some(at), table, edge: 0.04 }));
        assert!(off([1.6, 0.0]).contains("(160.0, 0.0) cm is off the table"));
        assert!(off([0.6, -0.36]).contains("less than 4.0 cm from the edge"));
        assert!(off([0.6, -0.36]).ends_with("from x = 0 to 100 cm and y = -38 to 38 cm"));
    }
}
