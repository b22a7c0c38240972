//! Seeing: a picture → the scene's objects, placed, with how sure.
use thiserror::Error as ThisError;

/// Why a picture could not be used at all. An object that is not found is an answer, not an error.
#[derive(Debug, Clone, PartialEq, ThisError)]
pub enum Error {
    /// The picture and the camera disagree about the picture's size.
    #[error(
        "the picture is {} x {} px, the camera's calibration is for {} x {} px; \
         use the calibration of this camera at this size",
        image.0, image.1, camera.0, camera.1
    )]
    WrongSize {
        /// Width and height of the picture, px.
        image: (u32, u32),
        /// Width and height in the calibration, px.
        camera: (u32, u32),
    },
    /// The scene has too few printed dots for a homography.
    #[error("the scene has {marks} table marks, alignment needs at least {needed}; add `marks dots` to the scene")]
    NoMarks {
        /// Marks in the scene.
        marks: usize,
        /// Marks needed.
        needed: usize,
    },
    /// Too few printed dots were recognised.
    #[error(
        "only {found} of {marks} table marks were recognised ({dots} dark dots seen, {needed} needed); \
         clear the table's dots, or correct the camera guess in the scene"
    )]
    TooFewMarks {
        /// Marks recognised.
        found: usize,
        /// Marks needed.
        needed: usize,
        /// Dark dots seen at all.
        dots: usize,
        /// Marks in the scene.
        marks: usize,
    },
}
