//! What can go wrong in the laboratory.

use thiserror::Error as ThisError;

use crate::twin::{self, Hindrance};
use crate::units::significant;

/// What can go wrong in the laboratory.
#[derive(Debug, Clone, PartialEq, ThisError)]
pub enum Error {
    /// Settings that make no sense.
    #[error("the laboratory's settings: {0}")]
    Settings(#[from] Unsound),
    /// The objects do not fit on the table as the settings ask.
    #[error(
        "no place was found for the objects in {tries} tries; widen `placement.radius_m`, \
         `placement.apart_m` or `placement.side_rad`, or fix places in `placement.fixed`"
    )]
    NoPlace {
        /// How often it was tried.
        tries: usize,
    },
    /// The arm, or the physics below it.
    #[error(transparent)]
    Twin(#[from] twin::Error),
}

/// What makes no sense in a laboratory's settings.
#[derive(Debug, Clone, PartialEq, ThisError)]
pub enum Unsound {
    /// The text is no TOML, or has a key that is not known.
    #[error("{0}")]
    Toml(String),
    /// A number is not between the least and the most that makes sense.
    #[error(
        "`{key}` = {} should be from {} to {}",
        significant(*.value, 6), significant(.allowed[0], 4), significant(.allowed[1], 4)
    )]
    Outside {
        /// Where it stands.
        key: String,
        /// The number, in the unit that the key says.
        value: f64,
        /// The least and the most.
        allowed: [f64; 2],
    },
    /// A draw is turned round, or reaches out of what makes sense.
    #[error(
        "`{key}` = [{}, {}] should be [lowest, highest], both from {} to {}",
        significant(.range[0], 6), significant(.range[1], 6),
        significant(.allowed[0], 4), significant(.allowed[1], 4)
    )]
    Turned {
        /// Where it stands.
        key: String,
        /// The draw, in the unit that the key says.
        range: [f64; 2],
        /// The least and the most.
        allowed: [f64; 2],
    },
    /// An object that is not there is given a place.
    #[error("`placement.fixed.{0}`: the scene has no object `{0}`")]
    NoObject(String),
    /// An object is given a place beside the table.
    #[error(
        "`placement.fixed.{name}`: ({}, {}) m is off the table, which is from x = {} to {} m and y = {} to {} m",
        significant(.at[0], 4), significant(.at[1], 4), significant(.table[0][0], 4),
        significant(.table[1][0], 4), significant(.table[0][1], 4), significant(.table[1][1], 4)
    )]
    OffTable {
        /// Its name.
        name: String,
        /// Where its middle is to be, m.
        at: [f64; 2],
        /// The corners of the table with the least and the greatest x and y, m.
        table: [[f64; 2]; 2],
    },
    /// Two objects are given places where one is in the other.
    #[error(
        "`placement.fixed.{}` and `placement.fixed.{}`: one would be {:.0} mm inside the other",
        .names[0], .names[1], .by * 1e3
    )]
    Overlap {
        /// Their names.
        names: [String; 2],
        /// How far, m.
        by: f64,
    },
    /// Something that moves has no name, or that of another.
    #[error("`moving[{0}].name`: what moves needs a name of its own")]
    NoName(usize),
    /// An effect changes nothing with these things.
    #[error("`effects`: {0}")]
    Hindered(#[from] Hindrance),
    /// An effect, or its numbers, that nothing is known to do.
    #[error("`effects`: `{name}({at})` with {numbers} is nothing the laboratory can do")]
    NoLaw {
        /// Its name.
        name: String,
        /// Where it should sit.
        at: String,
        /// The names of its numbers, one after the other.
        numbers: String,
    },
    /// There is no water for an effect to hide in.
    #[error("no vessel of `{0}` holds water")]
    NoWater(String),
    /// The seal is none, or was changed.
    #[error("`sealed` is not as `trueup lab hide` wrote it")]
    Seal,
}
