//! Pixels and readings → poses with uncertainty: vision and the paper's three regressions.
//!
//! Seeing: [`vision::see`] finds the scene's objects in a picture, [`marks`] the table's printed dots and
//! the ball on the gripper. Regression 1, [`image_map`]: the twin's picture onto the real one. Regression
//! 2, [`intrinsics`] and [`camera_fit`]: the camera's own numbers, and where it stands. Regression 3,
//! [`offset`]: from where the arm says it is to where it is. [`hand_eye`] finds where a camera sits on a wrist, or
//! beside an arm, from pictures of a board. [`files`] reads tables of pairs, views and poses.
//! All three regressions share one least-squares solver ([`crate::fit`])
//! and one way of telling outliers ([`consensus`]).
//!
//! Source: Zeng, Zhao and Wu, "Triple Regression for `Sim2Real` Adaptation", section 2.2.
//!
//! ```
//! use trueup::alignment::files::read_map_pairs;
//! use trueup::alignment::image_map::{Model, Options, fit_map};
//!
//! // The same points in two pictures, 10 px apart; the map takes `v` to `u`.
//! let pairs = "u_x[px],u_y[px],v_x[px],v_y[px]
//! 0,0,10,0
//! 640,0,650,0
//! 0,480,10,480
//! 640,480,650,480
//! 320,100,330,100
//! 200,300,210,300
//! ";
//! let fit = fit_map(&read_map_pairs(pairs).unwrap(), Model::Auto, &Options::default()).unwrap();
//! assert!(fit.rms_px < 1e-6 && (fit.m[(0, 2)] + 10.0).abs() < 1e-6);
//! ```

// Seeing: pixels → objects on the table.
pub mod decode;
pub mod picture;
pub mod plane;
pub mod marks;
pub mod chessboard;
pub mod boards;
pub mod ball;
pub mod outline;
pub mod evidence;
pub mod placement;
pub mod choice;
mod likeness;
pub mod refine;
pub mod doubt;
pub mod segment;
pub mod contour;
pub mod key_points;
pub mod measure;
pub mod vision;
pub mod overlay;

// The three regressions.
mod error;
mod lanes;
mod reprojection;
pub mod consensus;
pub mod rigid;
pub mod image_map;
pub mod intrinsics;
pub mod camera_fit;
pub mod offset;
pub mod hand_eye;
pub mod files;

pub use error::{Error, TooAlike};
