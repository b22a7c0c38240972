//! What can go wrong in the regressions. Rows are counted from 0 in the order given.

use crate::fit;

/// Why views of a plane do not determine a camera.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TooAlike {
    /// Fewer than three.
    #[error("a skew takes three")]
    Skew,
    /// Noise or a strong lens, and too few views against it.
    #[error("the closed form gives no real focal length")]
    NoFocalLength,
    /// A map that no camera in front of the plane has.
    #[error("a homography is not one of a plane in front of the camera")]
    NotInFront,
    /// The focal length is hardly known: its relative standard deviation.
    #[error("the focal length is known to {:.0} % only", 100.0 * .0)]
    Unsure(f64),
    /// One view at right angles.
    #[error("the plane is seen face-on, so its distance and the focal length trade")]
    FaceOn,
    /// Views of one direction.
    #[error("they are parallel to each other")]
    Parallel,
    /// Parameters that change together without a change of the pictures.
    #[error("{} can change together unseen", .0.join(", "))]
    Unseen(Vec<&'static str>),
}

/// Why a regression gives no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// Too few measurements for the model.
    #[error(
        "{what} needs at least {needed} {of}, {given} given: measure more, or choose a simpler model"
    )]
    TooFew {
        /// The model.
        what: &'static str,
        /// What is counted.
        of: &'static str,
        /// How many it needs.
        needed: usize,
        /// How many there are.
        given: usize,
    },
    /// A number is NaN or infinite.
    #[error("row {row} of {what} is not a finite number")]
    NotFinite {
        /// Which table.
        what: &'static str,
        /// Which row.
        row: usize,
    },
    /// All points are the same point.
    #[error(
        "the {what} all lie within {spread:.3e} {unit} of each other: they say nothing about scale \
         or direction, spread them out"
    )]
    Coincident {
        /// Which points.
        what: &'static str,
        /// Root mean square distance from their centre.
        spread: f64,
        /// Unit of the spread.
        unit: &'static str,
    },
    /// All points lie on one line.
    #[error(
        "the {what} lie on one line (across it they spread {ratio:.1e} of their length): \
         add points off the line, or choose `scale`"
    )]
    Collinear {
        /// Which points.
        what: &'static str,
        /// Spread across the line over spread along it.
        ratio: f64,
    },
    /// The points leave directions of the model free.
    #[error(
        "the points do not determine {model}: {free} of its directions are free \
         (no four of the points are in general position); add points, or choose a simpler model"
    )]
    Degenerate {
        /// The model.
        model: &'static str,
        /// How many directions are free.
        free: usize,
    },
    /// No map that keeps all points on one side of its horizon goes through them.
    #[error(
        "no projective map takes the twin points to the real ones with all of them in front of the camera ({given} pairs): at \
         least one is paired wrongly, or the points are numbered otherwise in one of the pictures"
    )]
    Crossed {
        /// How many pairs there are.
        given: usize,
    },
    /// The map cannot be written with a 1 in its corner.
    #[error(
        "the map sends the twin's pixel (0, 0) to infinity (h33 = 0), so it has no form with a 1 in \
         its corner (Eq. 3): move the origin of the twin's pixels, for example to the image centre"
    )]
    OriginAtInfinity,
    /// The map cannot be inverted.
    #[error("the map is singular: it squeezes the plane into a line")]
    Singular,
    /// No model agrees with enough of the measurements.
    #[error(
        "no {model} agrees with more than {agreeing} of {given} {of}: check that the rows are paired \
         rightly"
    )]
    NoConsensus {
        /// The model.
        model: &'static str,
        /// How many agree with the best one.
        agreeing: usize,
        /// How many there are.
        given: usize,
        /// What is counted.
        of: &'static str,
    },
    /// Known extrinsics, but the points hardly spread in a direction.
    #[error(
        "std({axis}/Z) is {spread:.2e}: the points hardly spread across the picture in {axis}, so the \
         focal length would be off by about {relative:.0} % per pixel of noise; spread the points"
    )]
    NoLeverage {
        /// `X` or `Y`.
        axis: char,
        /// The standard deviation of `X/Z` or `Y/Z`.
        spread: f64,
        /// Relative error of the focal length per pixel of noise, %.
        relative: f64,
    },
    /// The views are too alike for Zhang's closed form.
    #[error(
        "{views} view(s) of the plane do not determine the camera ({why}): add views tilted in other \
         directions by 20° or more"
    )]
    Views {
        /// How many views.
        views: usize,
        /// Why.
        why: TooAlike,
    },
    /// A point lies behind the camera.
    #[error(
        "point {row} lies behind the camera: check the extrinsics' direction (world_from_camera)"
    )]
    BehindCamera {
        /// Which point.
        row: usize,
    },
    /// The points of a planar target are not on z = 0.
    #[error(
        "row {row}: z = {z} m, but without extrinsics every point must lie on the target's plane z = 0; \
         give POINTS.extrinsics.json"
    )]
    OffPlane {
        /// Which row.
        row: usize,
        /// Its z, m.
        z: f64,
    },
    /// The image size is needed and was not given.
    #[error("one view needs the image size, to place the principal point in its centre")]
    ImageSize,
    /// A list has the wrong length.
    #[error("{what}: {given} given, {expected} expected")]
    Length {
        /// Which list.
        what: &'static str,
        /// Its length.
        given: usize,
        /// The length it should have.
        expected: usize,
    },
    /// The model does not exist in this form.
    #[error("{what} has no {model} form; use {instead}")]
    NoSuchModel {
        /// Which regression.
        what: &'static str,
        /// The model asked for.
        model: &'static str,
        /// What there is.
        instead: &'static str,
    },
    /// The solver.
    #[error(transparent)]
    Fit(#[from] fit::Error),
}

impl Error {
    /// Returns what would help.
    pub fn help(&self) -> &'static str {
        match self {
            Self::TooFew { .. } | Self::Fit(fit::Error::TooFew { .. }) => {
                "add rows to the table; a form with fewer terms needs fewer"
            }
            Self::NotFinite { .. } | Self::Fit(_) => "correct that row, or leave it out",
            Self::Coincident { .. }
            | Self::Collinear { .. }
            | Self::Degenerate { .. }
            | Self::NoLeverage { .. } => {
                "spread the points over the whole picture or table, and repeat a few"
            }
            Self::Crossed { .. } | Self::NoConsensus { .. } => {
                "is each row one point, seen on both sides? are columns exchanged, or rows of one side in another order?"
            }
            Self::OriginAtInfinity => {
                "take the picture's centre off both columns of the twin's pixels"
            }
            Self::Singular => "is a column the same in all rows, or twice in the table?",
            Self::Views { why: TooAlike::Skew, .. } => "add views, or fit no skew",
            Self::Views { .. } => {
                "hold the plane tilted by 30 to 45 deg to the left, to the right, up and down, and in all parts of the picture"
            }
            Self::BehindCamera { .. } => {
                "`world_from_camera` takes the camera's points to the world, its z forward; where the inverse is stored, invert it"
            }
            Self::OffPlane { .. } => {
                "say where each view was seen from, or count x and y in the target's plane with z = 0"
            }
            Self::ImageSize => "say `--image 1280x720`, or add a view",
            Self::Length { .. } => "give one for each, or none at all",
            Self::NoSuchModel { .. } => "take the form that it names",
        }
    }
}

/// How far a view leaves a side open, m: its standard deviation.
pub(super) fn open_side(std: f64) -> String {
    if std.is_finite() {
        format!("± {:.0} mm on one side", 1e3 * std)
    } else {
        "one side of it is not seen at all".into()
    }
}

/// What became of dark dots of which too few were recognised as the scene's.
pub(super) fn dots_seen(dots: usize, needed: usize) -> String {
    if dots < needed {
        format!("{dots} dark dots were seen")
    } else {
        format!("{dots} dark dots were seen, but no {needed} of them lie as the scene's do")
    }
}
