//! Models given by equations: what a `model` block leaves out.
//!
//! [`investigate`] is the front door. A model's text is parsed and checked (`language`), compiled to a flat
//! program ([`compile`]), run along recordings ([`simulate`]) and fitted ([`estimate`], [`fitting`]). Every
//! effect that could sit in it is a change of its text ([`candidates`], [`edit`]); a search adds those
//! that pay on data fitted and held out ([`search`], judged as [`hypothesis`] says). The answer is a [`super::finding::Finding`] with the difference of the text.

pub mod number;
mod program;
mod error;
mod registers;
pub mod compile;
pub mod integrate;
pub mod columns;
mod delayed;
pub mod simulate;
pub mod windows;
pub mod estimate;
pub mod fitting;
pub mod baseline;
pub mod edit;
pub mod candidates;
pub mod score;
pub mod hypothesis;
mod meaning;
mod stand_in;
mod ground;
mod stretches;
mod anchor;
pub mod search;
mod conclude;
mod late;
pub mod rivals;
mod steady;
mod linear;
mod features;
pub mod unknown;
mod in_one_word;
mod power;
mod profile;
mod between;
mod clock;
mod experiment;
mod place;
mod prepare;
mod shown;
mod wording;
mod model_finding;
mod investigate;
#[cfg(test)]
mod made;

pub use edit::model_in;
pub use error::Error;
pub use investigate::{Options, Outcome, investigate};
