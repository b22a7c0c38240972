//! What `trueup camera calibrate` prints and writes: the answer of `align intrinsics`, the camera as
//! [`crate::world::camera_file`] reads it, the pictures, and what to photograph next.

use serde::Serialize;

use crate::alignment::boards::Target;
use crate::alignment::intrinsics::Calibration;
use crate::alignment::intrinsics::coverage::Coverage;
use crate::alignment::intrinsics::lens::Compared;
use crate::alignment::intrinsics::strays::Stray;
use crate::report::calibrated::{Picture, Seen};
use crate::world::Intrinsics;

use super::align::IntrinsicsAnswer;

/// The answer of `camera calibrate`, and the file that `--write` makes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Answer {
    /// The camera as a calibration file has it.
    pub camera: CameraAnswer,
    /// The answer of `align intrinsics`.
    #[serde(flatten)]
    pub intrinsics: IntrinsicsAnswer,
    /// The board.
    pub board: BoardAnswer,
    /// Every picture given.
    pub pictures: Vec<PictureAnswer>,
    /// The choices of the lens's terms side by side; empty where they were asked for.
    pub compared: Vec<LensCompared>,
    /// Points in each ninth of the picture, rows from the top.
    pub corners_in_ninths: [[usize; 3]; 3],
    /// What the next pictures should show.
    pub advice: Vec<String>,
}

/// The camera; where it stands is not known from a board.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CameraAnswer {
    /// What is inside.
    pub intrinsics: Intrinsics,
}

/// The board; what it does not have is left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoardAnswer {
    /// `chessboard`, `charuco`, `aprilgrid`, `circles` or `acircles`.
    pub kind: &'static str,
    /// Inner corners of a chessboard, squares, tags or circles along a row.
    pub columns: usize,
    /// The same along a column.
    pub rows: usize,
    /// Side of a square, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub square_m: Option<f64>,
    /// Side of a tag, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tag_m: Option<f64>,
    /// Between two rows of circles, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_m: Option<f64>,
    /// The tags.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tags: Option<&'static str>,
}

impl From<&Target> for BoardAnswer {
    fn from(target: &Target) -> Self {
        let plain = |kind, columns, rows| Self {
            kind,
            columns,
            rows,
            square_m: None,
            tag_m: None,
            step_m: None,
            tags: None,
        };
        match target {
            Target::Chessboard(b) => {
                let square_m = Some(b.square);
                Self { square_m, ..plain("chessboard", b.columns, b.rows) }
            }
            Target::Charuco(b) => Self {
                square_m: Some(b.square),
                tag_m: Some(b.tag),
                tags: Some(b.family.name),
                ..plain("charuco", b.columns, b.rows)
            },
            Target::Tags(b) => Self {
                tag_m: Some(b.tag),
                tags: Some(b.family.name),
                ..plain("aprilgrid", b.columns, b.rows)
            },
            Target::Circles(b) => {
                let kind = if b.shifted { "acircles" } else { "circles" };
                Self { step_m: Some(b.step), ..plain(kind, b.columns, b.rows) }
            }
        }
    }
}

/// One picture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PictureAnswer {
    /// Its file.
    pub picture: String,
    /// Whether the board was found in it.
    pub found: bool,
    /// Why not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Corners that were seen and left out, since the camera shows them elsewhere.
    #[serde(skip_serializing_if = "is_none_left_out")]
    pub left_out: usize,
    /// Between the board's normal and the optical axis, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tilt_rad: Option<f64>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands it over so")]
fn is_none_left_out(left_out: &usize) -> bool {
    *left_out == 0
}

/// One choice of the lens's terms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LensCompared {
    /// The terms.
    pub distortion: &'static str,
    /// Root mean square reprojection error, px.
    pub rms_px: f64,
    /// `-BIC/2`; more is better.
    pub evidence: f64,
}

impl Answer {
    /// Words a calibration as the answer.
    pub fn new(
        fit: &Calibration,
        coverage: &Coverage,
        compared: &[Compared],
        board: &Target,
        pictures: &[Picture],
        strays: &[Stray],
    ) -> Self {
        let pictures = pictures.iter().map(|picture| {
            let (tilt_rad, left_out) = match picture.seen {
                Seen::Board(view) => (
                    coverage.held.get(view).map(|held| held.tilt),
                    strays.iter().filter(|stray| stray.view == view).count(),
                ),
                _ => (None, 0),
            };
            PictureAnswer {
                picture: picture.name.clone(),
                found: matches!(picture.seen, Seen::Board(_)),
                reason: picture.why_not(),
                left_out,
                tilt_rad,
            }
        });
        Self {
            camera: CameraAnswer { intrinsics: fit.intrinsics },
            intrinsics: IntrinsicsAnswer::from(fit),
            board: BoardAnswer::from(board),
            pictures: pictures.collect(),
            compared: compared
                .iter()
                .map(|c| LensCompared {
                    distortion: c.distortion.name(),
                    rms_px: c.rms_px,
                    evidence: c.evidence,
                })
                .collect(),
            corners_in_ninths: coverage.ninths,
            advice: coverage.advice(fit).iter().map(ToString::to_string).collect(),
        }
    }
}
