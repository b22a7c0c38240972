//! What about a robot, its recordings and its model does not go together (what helps: `refusal`). Where it was met is said by
//! whoever meets it (`Misfit::at`).

use std::fmt::{self, Display};

use crate::discovery::recording;
use crate::discovery::selection::Set;
use crate::motion;
use crate::units::{Dimension, significant};

/// Why nothing can be found out of recordings of an arm. Joints count from 0 here, and from 1 where they are told.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Misfit {
    /// The robot has more joints than are handled.
    #[error("the robot has {n} joints; at most {most} are handled")]
    TooManyJoints {
        /// How many it has.
        n: usize,
        /// How many it may have.
        most: usize,
    },
    /// The tip that the sidecar names is no link of the robot.
    #[error(transparent)]
    NoTip(motion::Error),
    /// The robot is no chain.
    #[error("joint {joint} follows another or branches off; only a chain is handled")]
    NoChain {
        /// The joint by its name.
        joint: String,
    },
    /// The tip is not at the end of the chain.
    #[error("the tip must sit on the last moving link")]
    TipElsewhere,
    /// A list of rotors or zeros is too short.
    #[error("`{key}` has {given} values, the robot {n} joints")]
    JointList {
        /// What the sidecar calls it.
        key: &'static str,
        /// How many values there are.
        given: usize,
        /// How many joints.
        n: usize,
    },
    /// The controller is of another robot.
    #[error("the controller is for {given} joints, the robot has {n}")]
    Controller {
        /// How many joints it is for.
        given: usize,
        /// How many there are.
        n: usize,
    },
    /// The controller works in a way that is not simulated.
    #[error("a controller of type `{kind}` is not known")]
    ControllerKind {
        /// What the sidecar calls it.
        kind: String,
    },
    /// There are more columns than joints.
    #[error("the recording has {given} columns `{stem}_*`, the robot {n} joints")]
    TooManyColumns {
        /// What the columns' names begin with.
        stem: &'static str,
        /// How many there are.
        given: usize,
        /// How many joints.
        n: usize,
    },
    /// A list of the drives' constants is too short.
    #[error("`torque_constant_nm_per_a` has {given} values, the robot {n} joints")]
    TorqueConstants {
        /// How many values there are.
        given: usize,
        /// How many joints.
        n: usize,
    },
    /// No column says what an arm did.
    #[error("the recording holds nothing measured: none of `q_n`, `dq_n`, `tau_n`, `tcp_x`")]
    NothingMeasured {
        /// The columns that there are.
        columns: Vec<String>,
    },
    /// No column says how it moved.
    #[error("the recording holds no motion: neither `q_cmd_n` nor `q_n`")]
    NoMotion {
        /// The columns that there are.
        columns: Vec<String>,
    },
    /// Nothing that is measured is predicted.
    #[error("the recordings hold a motion, but nothing to compare with a model of the arm")]
    NothingPredicted,
    /// The arm leaned on something in every row that would be judged.
    #[error(
        "the arm pushed, pulled or pressed in all of what is fitted or held out, nobody knows how hard"
    )]
    OnlyContacts,
    /// Rows are too far apart.
    #[error("the rows are {} s apart, too far to follow the motion of an arm", significant(*.step, 3))]
    Coarse {
        /// The usual step, s.
        step: f64,
    },
    /// Time is in another unit than it says.
    #[error(
        "`t` looks like {unit}: `dq_{}` is {} times what the change of `q_{}` says",
        .joint + 1, significant(*.ratio, 3), .joint + 1
    )]
    Clock {
        /// In which.
        unit: TimeUnit,
        /// A joint that shows it.
        joint: usize,
        /// Its speed over the change of its angle.
        ratio: f64,
    },
    /// The speeds of all joints are the same multiple, near to one, of what angles and stamps say.
    #[error(
        "`dq_n` is {} times what the change of `q_n` over `t` says, in each of the {joints} joints that move enough to tell: \
         time stamps or speeds are wrong by this factor",
        significant(*.ratio, 3)
    )]
    Paced {
        /// Which multiple.
        ratio: f64,
        /// Of how many joints.
        joints: usize,
    },
    /// One column is a multiple of what another says.
    #[error(
        "`{}` {} {} times what {} says",
        .pair.told(*.joint), .pair.verb(), significant(*.ratio, 3), .pair.from(*.joint)
    )]
    Scaled {
        /// Which two.
        pair: Pair,
        /// Of which joint.
        joint: usize,
        /// Size of the second over that of the first.
        ratio: f64,
    },
    /// One column has the sign of another turned.
    #[error("`{}` runs against {}", .pair.told(*.joint), .pair.from(*.joint))]
    Against {
        /// Which two.
        pair: Pair,
        /// Of which joint.
        joint: usize,
    },
    /// A column is of another joint than it says.
    #[error("`{}` follows {}, not {}", .pair.told(*.joint), .pair.from(*.other), .pair.from(*.joint))]
    OfAnother {
        /// Which two.
        pair: Pair,
        /// Of which joint it says it is.
        joint: usize,
        /// Of which it is.
        other: usize,
    },
    /// A joint is where it cannot be.
    #[error(
        "`{column}` goes to {} {unit}, but {joint} {} from {} to {} {unit}", significant(*.to, 3),
        if *.unit == "m" { "slides" } else { "turns" },
        significant(.limits[0], 3), significant(.limits[1], 3)
    )]
    BeyondLimits {
        /// The column.
        column: String,
        /// The joint by its name.
        joint: String,
        /// Furthest angle, rad; way of a joint that slides, m.
        to: f64,
        /// What it may be, rad or m.
        limits: [f64; 2],
        /// Which of the two.
        unit: &'static str,
    },
    /// The tip goes further than the arm is long.
    #[error(
        "`{column}` travels {} m, but the arm reaches {} m from its base",
        significant(*.travels, 3), significant(*.reach, 3)
    )]
    BeyondReach {
        /// The column.
        column: String,
        /// From its lowest value to its highest, m.
        travels: f64,
        /// How long the arm is, m.
        reach: f64,
    },
    /// All torques are the same multiple of what the model needs.
    #[error(
        "the {} of {same} joints are about {} times what the model needs",
        if *.of_currents { "currents times `torque_constant_nm_per_a`" } else { "torques" },
        significant(*.ratio, 2)
    )]
    TorquesScaled {
        /// Of how many joints.
        same: usize,
        /// Which multiple.
        ratio: f64,
        /// Whether they are currents times what the sidecar says an ampere is worth.
        of_currents: bool,
    },
    /// The weight of the arm is not in the torques.
    #[error("the torques of {joints} joints are those of an arm without weight")]
    Weightless {
        /// Of how many joints that bear weight.
        joints: usize,
    },
    /// Gravity points elsewhere than was said.
    #[error(
        "the torques of {joints} joints are those of an arm mounted otherwise: they show a gravity of ({}, {}, {}) m/s^2 \
         in the axes of its base",
        significant(.gravity[0], 3), significant(.gravity[1], 3), significant(.gravity[2], 3)
    )]
    Mounted {
        /// Of how many joints that bear weight.
        joints: usize,
        /// Which gravity they show, m/s², base axes.
        gravity: [f64; 3],
    },
    /// Torques have the wrong sign.
    #[error(
        "{} against what the arm needs: with the sign turned, weight, friction and rotors leave {} % of the residual",
        run_against(.joints), significant(100.0 * .left, 2)
    )]
    TorquesAgainst {
        /// Of which joints.
        joints: Vec<usize>,
        /// Which part of what the model leaves of them stays once they are turned, as a root mean square.
        left: f64,
    },
    /// A sensor was found to say the opposite of what acts.
    #[error("`tau_{}` reads {} times what acts at its joint", .joint + 1, significant(*.gain, 2))]
    TorqueTurned {
        /// Of which joint.
        joint: usize,
        /// Which multiple.
        gain: f64,
    },
    /// Recordings of an arm that stands.
    #[error(
        "too little motion to tell: no joint turns by more than {} rad in what is {}",
        significant(*.most, 2), if *.set == Set::Train { "fitted" } else { "held out" }
    )]
    HardlyMoves {
        /// The furthest that a joint turns, rad.
        most: f64,
        /// Where.
        set: Set,
    },
    /// Recordings whose motion tells less than what would have to be told.
    #[error(
        "{} s of this motion are too short to tell: friction, offsets and rotors come out so uncertain that nothing \
         predicted from them can be judged",
        significant(*.seconds, 2)
    )]
    TooShort {
        /// How long those fitted are, s.
        seconds: f64,
    },
    /// Currents have the wrong sign.
    #[error("{} against what the arm needs", currents_run(.joints))]
    CurrentsAgainst {
        /// Of which joints.
        joints: Vec<usize>,
    },
    /// Currents say nothing of torques.
    #[error(
        "the currents do not follow what the arm needs, so that what an ampere is worth is not known"
    )]
    CurrentsUnrelated,
    /// Currents at rest, without the drives' constants.
    #[error("at rest currents say nothing of what an ampere is worth")]
    CurrentsAtRest,
    /// Poses that tell nothing.
    #[error("{n} poses are too few: their readings are no more than what they would have to tell")]
    TooFewPoses {
        /// How many are fitted.
        n: usize,
    },
    /// A parameter of a known effect is in another unit.
    #[error("`{parameter}` of `{effect}({at})` is {}, but it must be {}", .is.words(), .expected.words())]
    EffectUnit {
        /// Which parameter.
        parameter: String,
        /// Of which effect.
        effect: String,
        /// Where.
        at: String,
        /// What it is.
        is: Dimension,
        /// What it must be.
        expected: Dimension,
    },
    /// A known effect lacks a parameter.
    #[error("`{effect}({at})` has no `{parameter}`")]
    EffectLacks {
        /// Which parameter.
        parameter: String,
        /// Which effect.
        effect: String,
        /// Where.
        at: String,
    },
    /// A known effect is at a joint that the robot does not have.
    #[error("`{effect}({at})`: the robot has joint_1 to joint_{n}")]
    EffectJoint {
        /// Which effect.
        effect: String,
        /// Where.
        at: String,
        /// How many joints there are.
        n: usize,
    },
    /// A known delay is of a channel that there is not.
    #[error("`sensor_delay({at})`: the channels are q, dq, tau, tcp")]
    EffectChannel {
        /// Where.
        at: String,
    },
    /// The model becomes infinite along the recordings.
    #[error("the model runs away on the data; check its parameters and units")]
    RunsAway,
    /// The search for effects ended without an outcome.
    #[error("{why}")]
    NoOutcome {
        /// What the search says.
        why: String,
        /// Whether it was among poses at rest.
        is_at_rest: bool,
    },
}

/// A unit that a time in seconds may be taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeUnit {
    /// Thousandths of a second.
    Milliseconds,
    /// Millionths of a second.
    Microseconds,
}

impl TimeUnit {
    /// Returns how many of it are a second.
    pub(super) fn per_second(self) -> f64 {
        match self {
            Self::Milliseconds => 1e3,
            Self::Microseconds => 1e6,
        }
    }

    pub(super) fn symbol(self) -> &'static str {
        match self {
            Self::Milliseconds => "ms",
            Self::Microseconds => "us",
        }
    }
}

impl Display for TimeUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Milliseconds => "milliseconds",
            Self::Microseconds => "microseconds",
        })
    }
}

/// Says that the torques of joints, from 0, run.
fn run_against(joints: &[usize]) -> String {
    let names: Vec<String> = joints.iter().map(|joint| format!("`tau_{}`", joint + 1)).collect();
    match names.split_last() {
        Some((last, [])) => format!("{last} runs"),
        Some((last, others)) => format!("{} and {last} run", others.join(", ")),
        None => "torques run".into(),
    }
}

/// Says that the currents of joints, from 0, run.
fn currents_run(joints: &[usize]) -> String {
    let numbers: Vec<String> = joints.iter().map(|joint| (joint + 1).to_string()).collect();
    match numbers.split_last() {
        Some((last, others)) if !others.is_empty() => {
            format!("the currents of joints {} and {last} run", others.join(", "))
        }
        _ => format!("the current of joint {} runs", numbers.concat()),
    }
}

/// Two columns that say the same of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pair {
    /// Commands and positions.
    Positions,
    /// Changes of positions and speeds.
    Speeds,
}

impl Pair {
    /// Returns the column that is doubted.
    pub(super) fn told(self, joint: usize) -> String {
        match self {
            Self::Positions => format!("q_{}", joint + 1),
            Self::Speeds => format!("dq_{}", joint + 1),
        }
    }

    fn from(self, joint: usize) -> String {
        match self {
            Self::Positions => format!("`q_cmd_{}`", joint + 1),
            Self::Speeds => format!("the change of `q_{}`", joint + 1),
        }
    }

    fn verb(self) -> &'static str {
        match self {
            Self::Positions => "moves",
            Self::Speeds => "is",
        }
    }

    /// Returns headers with their units.
    pub(super) fn headers(self) -> &'static str {
        match self {
            Self::Positions => "q_1[deg]",
            Self::Speeds => "dq_1[deg/s]` or `t[ms]",
        }
    }
}

impl Misfit {
    /// Says that a search among motions ended with `why`.
    pub(super) fn searching(why: impl Display) -> Self {
        Self::NoOutcome { why: why.to_string(), is_at_rest: false }
    }

    /// Says that a search among poses at rest ended with `why`.
    pub(super) fn searching_at_rest(why: impl Display) -> Self {
        Self::NoOutcome { why: why.to_string(), is_at_rest: true }
    }

    /// Returns it as what is wrong with a recording, at `place`.
    pub(super) fn at(self, place: impl Into<String>) -> recording::Error {
        let help = self.help();
        recording::Error::new(self.to_string(), place, help)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_columns_that_do_not_agree_are_told_by_their_names() {
        let scaled = Misfit::Scaled { pair: Pair::Speeds, joint: 1, ratio: 57.3 };
        assert_eq!(scaled.to_string(), "`dq_2` is 57.3 times what the change of `q_2` says");
        let other = Misfit::OfAnother { pair: Pair::Positions, joint: 0, other: 2 };
        assert_eq!(other.to_string(), "`q_1` follows `q_cmd_3`, not `q_cmd_1`");
        let help = scaled.help();
        assert!(help.contains("such as `dq_1[deg/s]` or `t[ms]`, or give it"), "{help}");
    }

    #[test]
    fn currents_are_told_by_their_joints_and_by_what_an_ampere_would_be_worth() {
        let of = |joints: &[usize]| Misfit::CurrentsAgainst { joints: joints.to_vec() }.to_string();
        assert_eq!(of(&[1]), "the current of joint 2 runs against what the arm needs");
        assert_eq!(of(&[1, 4]), "the currents of joints 2 and 5 run against what the arm needs");
        // The constant of the motor, its gear forgotten.
        let scaled = |of_currents| Misfit::TorquesScaled { same: 5, ratio: 0.01, of_currents };
        let help = scaled(true).help();
        assert!(help.contains("ratio of the gear") && help.contains("about 100 times"), "{help}");
        assert!(scaled(false).help().contains("`tau_1[mN*m]`"));
    }
}
