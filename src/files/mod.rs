//! Files of people: read only when they are files and of a size one can hold, written whole or not at all.
//!
//! What is inside them is the business of those who ask. Files that only grow are [`crate::lines`].

mod error;
pub mod read;
pub mod write;
