//! Pixels and readings → poses with uncertainty: the paper's three regressions.
//!
//! Regression 1, [`image_map`]: the twin's picture onto the real one. Regression 2, [`intrinsics`] and
//! [`camera_fit`]: the camera's own numbers, and where it stands. Regression 3, [`offset`]: from where
//! the arm says it is to where it is. [`files`] reads what the commands are given, [`answer`] is what
//! they print. All three share one least-squares solver ([`crate::fit`]) and one way of telling outliers
//! ([`consensus`]).
//!
//! Source: Zeng, Zhao and Wu, "Triple Regression for `Sim2Real` Adaptation", section 2.2.

// The three regressions.
mod error;
pub mod consensus;
pub mod image_map;
mod reprojection;
pub mod intrinsics;
pub mod camera_fit;
pub mod offset;
pub mod files;
pub mod answer;

pub use error::Error;
