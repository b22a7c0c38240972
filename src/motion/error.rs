//! What can go wrong in this layer; each variant carries the numbers that explain it.

use super::fault::{NoWay, SideFault, Stop, Untimed, UrdfFault};

/// Why a motion could not be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A file could not be read.
    #[error("cannot read {path}: {what}")]
    File {
        /// Which file.
        path: String,
        /// What the system said.
        what: String,
    },
    /// The text is not a URDF this program understands.
    #[error("not a usable URDF: {what}")]
    Urdf {
        /// What is wrong with it.
        what: UrdfFault,
    },
    /// The file beside the URDF is wrong.
    #[error("robot.toml: {what}")]
    SideFile {
        /// What is wrong with it.
        what: SideFault,
    },
    /// There is no such link.
    #[error("the robot has no link {name}; it has {}", known.join(", "))]
    NoLink {
        /// What was asked for.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// There is no such named pose.
    #[error("the robot has no pose {name}; it has {}", if known.is_empty() { "none".into() } else { known.join(", ") })]
    NoPose {
        /// What was asked for.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// No joint moves between the root and the tip.
    #[error("no joint moves between the root and {tip}")]
    NoJoints {
        /// The tip.
        tip: String,
    },
    /// The file has several arms.
    #[error("the robot branches at {link} into {}: name the tip", ways.join(" and "))]
    Branches {
        /// Where.
        link: String,
        /// First link of each way.
        ways: Vec<String>,
    },
    /// A list of joint values has the wrong length.
    #[error("{found} joint values were given; the robot has {expected} joints")]
    WrongLength {
        /// How many joints there are.
        expected: usize,
        /// How many values were given.
        found: usize,
    },
    /// A joint value is NaN or infinite.
    #[error("the value of {joint} is not a finite number")]
    NotFinite {
        /// Which joint.
        joint: String,
    },
    /// A joint value is so large that nothing can be computed with it.
    #[error("{joint} is at {value:e}; joint positions go up to {most} rad or m")]
    TooFar {
        /// Which joint.
        joint: String,
        /// Where it would be.
        value: f64,
        /// The largest that is taken.
        most: f64,
    },
    /// A joint is outside its range.
    #[error("{}", said_of_limit((which, joint), *value, (*lower, *upper), unit))]
    Limit {
        /// "start" or "goal"; one of several goals is "goal 2 of 5".
        which: String,
        /// Which joint.
        joint: String,
        /// Where it would be, rad or m.
        value: f64,
        /// Its lowest position.
        lower: f64,
        /// Its highest position.
        upper: f64,
        /// What its positions are in: "rad" or "m".
        unit: &'static str,
    },
    /// The start or goal of a motion is in collision, or nearer to something than is wanted.
    #[error("{}", said_of_collision((which, first, second), *depth, *margin))]
    Collision {
        /// "start" or "goal"; one of several goals is "goal 2 of 5".
        which: String,
        /// One of the two.
        first: String,
        /// The other.
        second: String,
        /// By how much the distance is too small, m.
        depth: f64,
        /// The distance that is wanted, m.
        margin: f64,
    },
    /// The start or goal does not keep the tool's axis inside its cone.
    #[error("{} tilts the tool by {:.1}°, more than {:.1}°", named(which), angle.to_degrees(), max_angle.to_degrees())]
    Tilted {
        /// "start" or "goal"; one of several goals is "goal 2 of 5".
        which: String,
        /// Tilt, rad.
        angle: f64,
        /// Highest tilt allowed, rad.
        max_angle: f64,
    },
    /// No path was found.
    #[error("no path found with {samples} samples: {why}")]
    NoPath {
        /// How many samples trees were grown towards; of policies, how many steps they made.
        samples: usize,
        /// What is known about it.
        why: NoWay,
    },
    /// The search used up its budget.
    #[error("nothing was found within a budget of about {seconds} s of computing")]
    Spent {
        /// What the budget is on the machine this was written on, s.
        seconds: u64,
    },
    /// A Cartesian path cannot be followed to its end.
    #[error("the path can be followed only {:.0} % of the way: {why}", fraction * 100.0)]
    Cartesian {
        /// Share of the path that was followed.
        fraction: f64,
        /// What stopped it.
        why: Stop,
    },
    /// Text that should hold numbers does not.
    #[error("{what}")]
    Input {
        /// What is wrong, and where.
        what: String,
    },
    /// A trajectory cannot be made from what was given.
    #[error("no trajectory: {what}")]
    Trajectory {
        /// Why.
        what: Untimed,
    },
    /// Where an obstacle was seen is no place, or it was seen earlier than before.
    #[error(
        "the place of {name}, seen at {time} s, is not finite, or not later than the sight before"
    )]
    Sight {
        /// Which obstacle.
        name: String,
        /// When it was seen, s.
        time: f64,
    },
    /// A search without a goal.
    #[error("no goal was given")]
    NoGoal,
    /// A person or a watcher asked to stop.
    #[error("stopped")]
    Cancelled,
}

/// Names an end of a motion: one of several goals has its number, the others an article.
fn named(which: &str) -> String {
    if which.contains(' ') { which.to_owned() } else { format!("the {which}") }
}

/// Words a joint position beyond a limit, by how much as well: what lies just beyond reads as the limit itself.
fn said_of_limit(
    (which, joint): (&str, &str),
    value: f64,
    (lower, upper): (f64, f64),
    unit: &str,
) -> String {
    let beyond = (lower - value).max(value - upper);
    let beyond = if beyond < 1e-3 { format!("{beyond:.1e}") } else { format!("{beyond:.4}") };
    let which = named(which);
    format!(
        "{which} has {joint} at {value:.4}, {beyond} {unit} outside its range {lower:.4} to {upper:.4}"
    )
}

/// Half of the tenth of a millimetre that distances are told to, m: what is nearer than this touches.
const TOUCHING: f64 = 5e-5;

/// Words two parts that overlap, or are nearer to each other than is wanted; m.
fn said_of_collision(parts: (&str, &str, &str), depth: f64, margin: f64) -> String {
    let (which, first, second) = parts;
    let which = named(which);
    if (depth - margin).abs() < TOUCHING {
        return format!("{which} is in collision: {first} and {second} touch");
    }
    if depth >= margin {
        let overlap = (depth - margin) * 1e3;
        return format!("{which} is in collision: {first} and {second} overlap by {overlap:.1} mm");
    }
    let (apart, wanted) = ((margin - depth) * 1e3, margin * 1e3);
    format!(
        "{which} is too near to something: {first} and {second} are {apart:.1} mm apart, and {wanted:.1} mm are to be kept"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// "0.0 mm apart, and 0.0 mm are to be kept".
    #[test]
    fn what_touches_is_said_to_touch() {
        let said = |apart: f64, margin: f64| {
            said_of_collision(("start", "rod", "table"), margin - apart, margin)
        };
        assert!(said(0.0, 0.0).ends_with("rod and table touch"), "{}", said(0.0, 0.0));
        assert!(said(1e-9, 0.0).ends_with("rod and table touch"), "{}", said(1e-9, 0.0));
        assert!(said(-0.002, 0.0).ends_with("overlap by 2.0 mm"));
        assert!(said(0.01, 0.02).ends_with("10.0 mm apart, and 20.0 mm are to be kept"));
    }

    /// "`wrist_roll_joint` is at 3.1416, outside its range -3.1416 to 3.1416".
    #[test]
    fn what_is_just_beyond_a_limit_is_told_by_how_much() {
        let said = |which: &str, value: f64| Error::Limit {
            which: which.into(),
            joint: "wrist".into(),
            value,
            lower: -2.8974,
            upper: 2.8974,
            unit: "rad",
        };
        let just = said("goal 2 of 5", 2.897_403_7).to_string();
        assert_eq!(
            just,
            "goal 2 of 5 has wrist at 2.8974, 3.7e-6 rad outside its range -2.8974 to 2.8974"
        );
        let far = said("start", -3.2).to_string();
        assert!(far.starts_with("the start has wrist at -3.2000, 0.3026 rad outside"), "{far}");
    }
}
