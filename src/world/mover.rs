//! Something that moves by itself near an arm, as whoever watches the cell saw it last: a ball around it.
//!
//! No model of what it is and none of where it will be; a person is a ball for each hand, arm and head.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Something that moves by itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mover {
    /// What it is called; the same thing keeps its name.
    pub name: String,
    /// The middle of the ball, m, world.
    pub at: Vector3<f64>,
    /// Its radius, m.
    pub radius: f64,
    /// How long ago it was there, s.
    #[serde(default)]
    pub age: f64,
}

impl Mover {
    /// The largest ball there is, m: larger than a person.
    pub const LARGEST: f64 = 2.0;
    /// As many are told of at a time, and no more.
    pub const MOST: usize = 64;

    /// Whether its numbers are some that a ball can have: finite, a radius up to [`Self::LARGEST`], not of the future.
    pub fn is_sound(&self) -> bool {
        self.at.iter().all(|x| x.is_finite())
            && self.radius > 0.0
            && self.radius <= Self::LARGEST
            && self.age >= 0.0
            && self.age.is_finite()
    }
}
