//! Pixels and readings → poses with uncertainty.
//!
//! Vision: [`vision::see`] finds the scene's objects in a picture, [`marks`] the table's printed dots.

// Seeing: pixels → objects on the table.
pub mod picture;
pub mod marks;
pub mod ball;
pub mod outline;
pub mod placement;
pub mod refine;
pub mod segment;
pub mod contour;
pub mod vision;
pub mod overlay;
