//! Why poses and pictures do not tell where the camera is, and what would.

use nalgebra::Vector3;

use super::types::Mount;
use crate::fit;

/// Why there is no answer. Lengths in m, angles in rad.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// Too few pictures show the board.
    #[error(
        "{pictures} picture(s) show the board and have a pose; two motions about different axes are the least, which takes \
         three pictures"
    )]
    TooFew {
        /// How many there are.
        pictures: usize,
    },
    /// The wrist was hardly turned.
    #[error(
        "the wrist was turned by {:.1} deg at most between pictures: without turns nobody can tell where the camera sits, \
         only how it is turned", largest.to_degrees()
    )]
    NotTurned {
        /// The root mean square turn about the axis with most of it.
        largest: f64,
    },
    /// All turns are about one axis.
    #[error(
        "all turns are about one axis, ({:.2}, {:.2}, {:.2}) in the {} frame (by {:.0} deg; across it {:.1} deg): the \
         camera's place along that axis is not determined",
        axis.x, axis.y, axis.z, mount.carrier(), about.to_degrees(), across.to_degrees()
    )]
    OneAxis {
        /// Where the camera is mounted.
        mount: Mount,
        /// The axis, in the frame that the camera is fixed to.
        axis: Vector3<f64>,
        /// Root mean square turn about it.
        about: f64,
        /// Root mean square turn about the next axis.
        across: f64,
    },
    /// No placement of camera and board agrees with half of the pictures.
    #[error(
        "poses and pictures do not belong together: with the camera {mount} the best placement leaves half of the \
         pictures {:.0} deg or {:.0} mm off and more", rotation.to_degrees(), 1e3 * position
    )]
    NoFit {
        /// Where the camera was taken to be.
        mount: Mount,
        /// The median picture's error.
        rotation: f64,
        /// The median picture's error.
        position: f64,
    },
    /// Wrist and fixed fit alike.
    #[error(
        "a camera on the wrist ({:.1} mm, {:.2} deg off) and a fixed one ({:.1} mm, {:.2} deg off) fit alike",
        1e3 * wrist.1, wrist.0.to_degrees(), 1e3 * fixed.1, fixed.0.to_degrees()
    )]
    WhichMount {
        /// Rotation and position that the median picture is off by.
        wrist: (f64, f64),
        /// The same for a fixed camera.
        fixed: (f64, f64),
    },
    /// The robot's positions are in another unit than was said.
    #[error(
        "the robot's travel is {} times what the pictures show: its positions are in another unit than the header says",
        significant(*times)
    )]
    LengthUnit {
        /// The robot's travel over the camera's.
        times: f64,
    },
    /// A picture's corners are no picture of a board.
    #[error("the corners in {picture} are not those of a flat board before the camera")]
    NoBoard {
        /// Its name.
        picture: String,
    },
    /// The solver.
    #[error(transparent)]
    Fit(#[from] fit::Error),
}

fn significant(value: f64) -> String {
    if value >= 1.0 { format!("{value:.0}") } else { format!("{value:.4}") }
}
