//! Models given by equations: what they leave out.

pub mod number;
pub mod integrate;
mod program;
pub mod compile;
pub mod data;
pub mod simulate;
pub mod estimate;
pub mod edit;
pub mod candidates;
pub mod score;
pub mod fitting;
