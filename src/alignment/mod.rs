//! Pixels and readings → poses with uncertainty: vision and the paper's three regressions.
//!
//! Seeing: [`vision::see`] finds the scene's objects in a picture, [`marks`] the table's printed dots and
//! the ball on the gripper. Regression 1, [`image_map`]: the twin's picture onto the real one. Regression
//! 2, [`intrinsics`] and [`camera_fit`]: the camera's own numbers, and where it stands. Regression 3,
//! [`offset`]: from where the arm says it is to where it is. [`files`] reads what the commands are given,
//! [`answer`] is what they print. All three regressions share one least-squares solver ([`crate::fit`])
//! and one way of telling outliers ([`consensus`]).
//!
//! Source: Zeng, Zhao and Wu, "Triple Regression for `Sim2Real` Adaptation", section 2.2.

// Seeing: pixels → objects on the table.
pub mod decode;
pub mod picture;
pub mod marks;
pub mod ball;
pub mod outline;
pub mod placement;
pub mod refine;
pub mod doubt;
pub mod segment;
pub mod contour;
pub mod key_points;
pub mod vision;
pub mod overlay;

// The three regressions.
mod error;
mod reprojection;
pub mod consensus;
pub mod rigid;
pub mod image_map;
pub mod intrinsics;
pub mod camera_fit;
pub mod offset;
pub mod files;
pub mod answer;

pub use error::{Error, TooAlike};
