//! Why what a script asks for is refused before anything is done, with the numbers that decided.
//!
//! What the limits, the planner and the devices refuse is their own ([`super::error::ActionError`] has all of it).

use crate::motion;
use crate::twin;
use crate::units::significant;

/// Why what a script asks for is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// The script itself gave up: the words it throws.
    #[error("{0}")]
    Thrown(String),
    /// It wants to sleep.
    #[error("`sleep` would hold the program, not the arm; `arm.wait(seconds)` holds the arm")]
    Sleep,
    /// It asks for the time.
    #[error("a script has no clock, so that it does the same each time")]
    NoClock,
    /// An argument is out of its range, or is no number.
    #[error("{0}")]
    OutOfRange(OutOfRange),
    /// What stands for a number is none.
    #[error("`{word}` takes a number as {what}, and this is a {found}")]
    NotANumber {
        /// The word of the script.
        word: String,
        /// Which of its arguments.
        what: String,
        /// What it is, as the engine calls it.
        found: &'static str,
    },
    /// Something in a list is no number.
    #[error("`{word}` takes numbers, and number {at} is a {found}")]
    NoNumber {
        /// The word of the script.
        word: String,
        /// Its place in the list, from 1.
        at: usize,
        /// What it is, as the engine calls it.
        found: &'static str,
    },
    /// There are not as many joint positions as joints.
    #[error(
        "`{word}` takes one position for each of the {joints} joints, in rad, and was given {given}"
    )]
    Joints {
        /// The word of the script.
        word: String,
        /// How many joints the arm has.
        joints: usize,
        /// How many positions there are.
        given: usize,
    },
    /// A way has not three numbers.
    #[error("`{word}` takes [x, y, z] in m, and was given {given} numbers")]
    Way {
        /// The word of the script.
        word: String,
        /// How many numbers there are.
        given: usize,
    },
    /// An axis has no direction.
    #[error("`{word}` takes an axis [x, y, z] that points somewhere")]
    Axis {
        /// The word of the script.
        word: String,
    },
    /// The name of what is to be remembered is empty or too long.
    #[error("the name of what is remembered should have 1 to {longest} characters")]
    MemoryName {
        /// The longest name, characters.
        longest: usize,
    },
    /// What is to be remembered is not a value, or too large.
    #[error("`{name}` cannot be remembered: {why}")]
    Memory {
        /// Its name, of a long one the beginning.
        name: String,
        /// Why not.
        why: NoMemory,
    },
    /// Actions remember as much as they may.
    #[error("actions remember {most} things already, and no more")]
    Memories {
        /// How many things they may remember.
        most: usize,
    },
    /// It acts without end.
    #[error("a script may act {most} times, and this one goes on")]
    Acts {
        /// How many of its lines may act.
        most: usize,
    },
    /// It asks for plans without end.
    #[error("a script may ask for {most} plans, and this one goes on")]
    Plans {
        /// How many it may ask for.
        most: usize,
    },
    /// A grasp is asked for at what is no face.
    #[error("there is no face `{0}`; faces are side and top")]
    NoFace(String),
    /// There is no such object in the scene.
    #[error("there is no `{0}`")]
    NoObject(String),
    /// It is not in the hand.
    #[error("`{0}` is not in the hand")]
    NotHeld(String),
    /// What the fingers hold would fall when they open.
    #[error(
        "`{object}` is in the hand and would fall {:.0} cm onto `{onto}`; put it down with `place({object})`",
        1e2 * .drop
    )]
    Falls {
        /// What is held.
        object: String,
        /// How far it would fall, m.
        drop: f64,
        /// What it would fall onto.
        onto: String,
    },
    /// Nobody took what was held out.
    #[error("nobody pulled at the `{object}` within {seconds:.0} s; it is still in the hand")]
    NobodyPulled {
        /// What was held out.
        object: String,
        /// How long, s.
        seconds: f64,
    },
    /// It slides in nothing.
    #[error("`{0}` is no drawer")]
    NoDrawer(String),
    /// Nobody knows where an object is.
    #[error("the position of `{0}` has not been measured")]
    UnknownPlace(String),
    /// Nobody knows how much water an object holds.
    #[error("the volume in `{0}` has not been measured")]
    UnknownVolume(String),
    /// The fingers may not press as hard as a thing would need.
    #[error(
        "pads with a friction of {friction:.3} would have to press the {mass:.2} kg of `{object}` with \
         {needed:.0} N; the fingers may press with {most:.0} N"
    )]
    TooHeavy {
        /// The thing.
        object: String,
        /// Its mass with what is in it, kg.
        mass: f64,
        /// The pads' coefficient of friction.
        friction: f64,
        /// The force of each finger that would hold it, N.
        needed: f64,
        /// The force with which a finger may press, N.
        most: f64,
    },
    /// The hand bears what cannot be in it: the torques are wrong, or in another unit.
    #[error(
        "{mass:.1} kg were weighed in the hand with `{object}`, where all things with full vessels are {all:.2} kg; are the \
         joints' torques in N*m?"
    )]
    Heft {
        /// What is in the hand.
        object: String,
        /// What was weighed, kg.
        mass: f64,
        /// What all things of the scene weigh with full vessels, kg.
        all: f64,
    },
    /// One of no ways is to be chosen.
    #[error("there is nothing to choose from")]
    NoWays,
    /// The way that was chosen is not among those that were given.
    #[error("choose was given nothing")]
    NotAmongWays,
    /// The hand is to be turned along a path that it is not on.
    #[error("the hand is not on the path that it is to be turned along")]
    NotOnPath,
    /// The hand is to be drawn back on a way that begins elsewhere.
    #[error(
        "the hand is {:.0} mm beside and {:.0} mm above where that way begins",
        .beside * 1e3,
        .above * 1e3
    )]
    NotAtWay {
        /// How far the hand is beside its beginning, m.
        beside: f64,
        /// How far it is above, m.
        above: f64,
    },
    /// Nothing was felt on a way that was to end where something is.
    #[error("nothing was felt with {force:.1} N on the way of {:.0} mm", .way * 1e3)]
    NothingFelt {
        /// The force that was to be felt, N.
        force: f64,
        /// How far the hand went, m.
        way: f64,
    },
    /// The arm was stopped for something that moves by itself.
    #[error("the arm was stopped: `{name}` would have come within {:.0} cm", 100.0 * .apart.max(0.0))]
    CameNear {
        /// What it is called.
        name: String,
        /// How near it would have come, m.
        apart: f64,
        /// When the arm was told to stop, s of arm time.
        time: f64,
    },
    /// Something that moves by itself stayed in the way.
    #[error("`{name}` has been in the way for {seconds:.0} s; the arm waits no longer")]
    InTheWay {
        /// What it is called.
        name: String,
        /// How long it was waited for, s.
        seconds: f64,
    },
    /// The joints cannot feel a force along this way.
    #[error("the joints do not feel what pushes that way")]
    Numb,
    /// What holds the arm is to be done beside a motion.
    #[error("this holds the arm, so it cannot be done beside a motion")]
    HoldsArm,
    /// The motion cannot be computed, or the robot has no such pose.
    #[error("{0}")]
    Motion(#[from] motion::Error),
    /// The twin that is to rehearse cannot be built.
    #[error("the twin cannot be built: {0}")]
    NoTwin(twin::Error),
}

/// An argument that is out of its range: NaN is in none.
#[derive(Debug, Clone, PartialEq)]
pub struct OutOfRange {
    /// The word of the script.
    pub word: String,
    /// Which of its arguments: `the speed`.
    pub what: String,
    /// What was given, in the unit.
    pub value: f64,
    /// The least and the most that it may be, in the unit.
    pub range: [f64; 2],
    /// The unit; empty for a bare number.
    pub unit: &'static str,
}

impl std::fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { word, what, value, range, unit } = self;
        let blank = if unit.is_empty() { "" } else { " " };
        let [value, least, most] = [*value, range[0], range[1]].map(|value| significant(value, 4));
        write!(
            f,
            "{what} of `{word}` is {value}{blank}{unit}; it should be {least} to {most}{blank}{unit}"
        )
    }
}

/// Why something cannot be remembered for a later action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoMemory {
    /// It is too large.
    #[error("it has more than {most} parts")]
    Parts {
        /// How many parts it may have.
        most: usize,
    },
    /// Its parts lie too deep in each other.
    #[error("it is more than {most} lists deep")]
    Deep {
        /// How deep they may lie.
        most: usize,
    },
    /// It would act on another arm than the one that is meant.
    #[error("it is or holds a handle, such as `arm`, or a function")]
    Handle,
}

/// What is wrong with a script itself.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Mistake {
    /// It goes on without end.
    #[error("it has no end after {operations} operations; is there a loop without one?")]
    Endless {
        /// How many operations of the engine it may take.
        operations: u64,
    },
    /// Its functions call each other without end.
    #[error("its functions call each other more than {calls} deep (stack overflow)")]
    TooDeep {
        /// How deep they may.
        calls: usize,
    },
    /// There is none.
    #[error("there is no such script; actions look in `actions/` of the stdlib")]
    NoScript,
    /// A word with other arguments than it takes.
    #[error("it is written `{written}`")]
    Misused {
        /// How it is written.
        written: String,
    },
    /// A word that there is not.
    #[error("there is no word `{name}`; did you mean `{meant}`?")]
    Unknown {
        /// What was written.
        name: String,
        /// How what is like it is written.
        meant: String,
    },
    /// A word that there is not, and none is like it.
    #[error("there is no word `{name}`")]
    NoWord {
        /// What was written.
        name: String,
    },
    /// It cannot be read, or misuses a word: what the engine says.
    #[error("{0}")]
    Engine(String),
}
