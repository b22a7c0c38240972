//! The parts of a robot ([`super::robot`]): its links, its joints and their limits, as they were read. Where they stand is not known here.

use nalgebra::{Isometry3, Unit, Vector3};

use super::inertial::Inertial;
use super::solid::Placed;

/// How a joint lets its child move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Not at all.
    Fixed,
    /// Turns about its axis; rad.
    Turn,
    /// Slides along its axis; m.
    Slide,
}

/// What a joint's value follows: `multiplier × source + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// Nothing: the joint is fixed.
    None,
    /// Entry `index` of `q`.
    Joint {
        /// Which entry.
        index: usize,
        /// Factor; 1 unless the joint mimics another.
        multiplier: f64,
        /// Summand, rad or m.
        offset: f64,
    },
    /// The gripper's opening.
    Jaw {
        /// Share of the opening, m/m; 0 for a part that is not moved.
        multiplier: f64,
        /// Summand, rad or m.
        offset: f64,
    },
    /// The gripper's opening, through the angle that its leading knuckle has then.
    Knuckle {
        /// The angle, rad, as a cubic of the opening in m, constant term first.
        angle: [f64; 4],
        /// Factor on the angle.
        multiplier: f64,
        /// Summand, rad.
        offset: f64,
    },
}

impl Drive {
    /// Returns whether the gripper's opening moves it.
    pub fn is_of_gripper(&self) -> bool {
        matches!(self, Self::Jaw { .. } | Self::Knuckle { .. })
    }
}

/// The joint that carries a link, seen from the link.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Its name; empty for the root.
    pub name: String,
    /// Carries points of the link into its parent when the joint is at 0.
    pub parent_from_link: Isometry3<f64>,
    /// How it moves.
    pub motion: Motion,
    /// About or along what, in the link frame.
    pub axis: Unit<Vector3<f64>>,
    /// What moves it.
    pub drive: Drive,
    /// Lowest and highest value, rad or m.
    pub range: (f64, f64),
}

/// One shape of a link as it is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Visual {
    /// The shape, in the link frame.
    pub placed: Placed,
    /// Its colour, sRGB, if the file gives one.
    pub colour: Option<[u8; 3]>,
}

/// A matt coloured ball glued to the robot, by which a camera sees where the tool is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marker {
    /// Index of the link that carries it.
    pub link: usize,
    /// Its centre in that link's frame, m.
    pub centre: Vector3<f64>,
    /// Its radius, m.
    pub radius: f64,
    /// Its colour, sRGB.
    pub colour: [u8; 3],
}

/// One rigid body of the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Its name.
    pub name: String,
    /// Index of the parent link; `None` for the root. Parents come before their children.
    pub parent: Option<usize>,
    /// The joint to the parent.
    pub joint: Joint,
    /// Its mass, if it has any.
    pub inertial: Option<Inertial>,
    /// What is drawn.
    pub visual: Vec<Visual>,
    /// What must not touch anything, in the link frame.
    pub collision: Vec<Placed>,
}

/// Limits of one entry of `q`.
#[derive(Debug, Clone, PartialEq)]
pub struct JointLimits {
    /// The joint's name.
    pub name: String,
    /// Index of the link it carries.
    pub link: usize,
    /// Whether it may turn without end; then `lower` and `upper` are infinite.
    pub continuous: bool,
    /// Lowest position, rad or m.
    pub lower: f64,
    /// Highest position, rad or m.
    pub upper: f64,
    /// Highest speed, rad/s or m/s.
    pub velocity: f64,
    /// Highest acceleration, rad/s² or m/s².
    pub acceleration: f64,
    /// Highest jerk, rad/s³ or m/s³, where the robot's files state one.
    pub jerk: Option<f64>,
    /// Highest torque or force, N·m or N; infinite if the file says none.
    pub effort: f64,
}
