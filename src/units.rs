//! Quantities and their literals: the one file that spells `cm`, `deg` or `mL`.
//!
//! A [`Quantity`] is a number in SI with its [`Dimension`]; angles count as a dimension of their own so
//! that `12 deg` is never taken for a plain number. Nothing here parses programs; that is
//! [`crate::language`]'s work.

use serde::{Deserialize, Serialize};

/// Exponents of the base quantities a unit is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
pub struct Dimension {
    /// Length, m.
    pub length: i8,
    /// Mass, kg.
    pub mass: i8,
    /// Time, s.
    pub time: i8,
    /// Angle, rad.
    pub angle: i8,
    /// Electric current, A.
    pub current: i8,
    /// Pixels, px.
    pub pixel: i8,
}

/// A number in SI units with its dimension.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Quantity {
    /// The value in SI: m, kg, s, rad, A, px and their products.
    pub value: f64,
    /// What it measures.
    pub dimension: Dimension,
}
