//! Why something cannot be simulated, with its numbers.

/// What can go wrong in the twin.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The robot file describes nothing the physics can move.
    #[error("{0}")]
    Robot(#[from] Unfit),
    /// A list has not one entry per joint.
    #[error("`{what}` has {found} entries; the arm has {expected} joints")]
    WrongLength {
        /// Which list.
        what: &'static str,
        /// Entries it should have.
        expected: usize,
        /// Entries it has.
        found: usize,
    },
    /// A number that is not finite came in or out.
    #[error("`{what}` is not a finite number at {time} s")]
    NotFinite {
        /// Which quantity.
        what: String,
        /// Time in the twin, s.
        time: f64,
    },
    /// A vessel is to hold more than fits below its rim.
    #[error("{water_ml:.0} mL of water do not fit into `{vessel}`")]
    Overfull {
        /// Which vessel.
        vessel: String,
        /// The water it was to hold, mL.
        water_ml: f64,
    },
    /// An object without mass.
    #[error("`{0}` has no mass; give it one in the scene")]
    Massless(String),
}

/// Why the physics cannot move a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Unfit {
    /// A joint of the arm mimics another.
    #[error("joints of the arm follow each other, which the twin cannot simulate")]
    Mimic,
    /// The fingers are something else than two jaws that slide alike.
    #[error("the gripper is not a pair of coupled sliding jaws")]
    Gripper,
}

/// Why an effect changes nothing with these things and this arm.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Hindrance {
    /// It sits at a joint beyond the last.
    #[error("the arm has {0} joints")]
    NoJoint(usize),
    /// It sits at an object that is not there.
    #[error("the scene `{scene}` has no object `{object}`")]
    NoObject {
        /// The scene's name.
        scene: String,
        /// The object's name.
        object: String,
    },
    /// It is about liquid, and its object holds none.
    #[error("`{0}` is no vessel")]
    NoVessel(String),
}
