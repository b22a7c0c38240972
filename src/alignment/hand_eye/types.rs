//! What goes into a hand-eye calibration and what comes out of it, as data.

use std::fmt;

use nalgebra::{Isometry3, SMatrix, Vector3};

use super::motions::Motions;
use crate::alignment::boards::{Sides, Target};
use crate::alignment::reprojection::INTRINSIC;
use crate::world::{Intrinsics, Pixel, Point, Pose, frame};

/// Points of the board and where they are seen.
pub type Corners = Vec<(Point<frame::World>, Pixel)>;

/// Where the camera is mounted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mount {
    /// On the wrist; the board stays where it is.
    Wrist,
    /// Beside the robot; the board is in the hand.
    Fixed,
}

impl Mount {
    /// Returns its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wrist => "wrist",
            Self::Fixed => "fixed",
        }
    }

    /// Returns the frame that the camera is fixed to.
    pub fn carrier(self) -> &'static str {
        match self {
            Self::Wrist => "flange",
            Self::Fixed => "base",
        }
    }

    /// Returns the frame that the board is fixed to.
    pub fn other(self) -> &'static str {
        match self {
            Self::Wrist => "base",
            Self::Fixed => "flange",
        }
    }
}

impl fmt::Display for Mount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Wrist => "on the wrist",
            Self::Fixed => "fixed",
        })
    }
}

/// One picture of the board and where the robot was.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Its name in messages.
    pub name: String,
    /// Where the robot says its flange was.
    pub base_from_flange: Pose<frame::Base, frame::Flange>,
    /// The board's corners that are seen, with the board's own coordinates (z = 0). A part of them will do.
    pub points: Corners,
}

/// What is known of the camera itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// Its numbers.
    pub intrinsics: Intrinsics,
    /// Their covariance, in the order of [`crate::alignment::intrinsics::NAMES`]: zero where they are taken as exact.
    pub covariance: SMatrix<f64, INTRINSIC, INTRINSIC>,
}

/// How to calibrate.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The board, with the length of its sides as it was said.
    pub board: Target,
    /// Where the camera is mounted; `None` lets the pictures tell.
    pub mount: Option<Mount>,
}

/// Where something is, with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// Its pose in the frame it is fixed to.
    pub pose: Isometry3<f64>,
    /// Standard deviation of its place along the axes of that frame, m.
    pub std_position: Vector3<f64>,
    /// Standard deviation of its turn about its own axes, rad.
    pub std_rotation: Vector3<f64>,
}

/// What the other pictures predict of one is off by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// Of the middle of what is seen of the board, in the robot's base, m.
    pub position: f64,
    /// Of the board's turn, rad.
    pub rotation: f64,
}

/// The side of a square (of a tag, the step between circles), as it was said and as the robot's travel measures it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Square {
    /// What of the board has this length.
    pub of: Sides,
    /// As it was said, m.
    pub said: f64,
    /// As it is measured, m.
    pub measured: f64,
    /// Standard deviation of that, m: the larger one of the fit's and the jackknife's.
    pub std: f64,
    /// Whether it is another size than was said. Then the measured one was used.
    pub is_wrong: bool,
}

/// How far poses and pictures disagree: standard deviations along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Of a turn, rad.
    pub rotation: f64,
    /// Of a place, m.
    pub position: f64,
}

/// One picture after the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewFit {
    /// Its name.
    pub name: String,
    /// Whether it was used; if not, it disagrees with the others.
    pub is_used: bool,
    /// How the flange seems to be turned from where the robot says, rad.
    pub rotation: f64,
    /// How far it seems to be from there, m.
    pub position: f64,
    /// What the others predict of it is off by so much; `None` where they are too few.
    pub left_out: Option<LeftOut>,
    /// The picture whose row of the table would fit, for one that was not used.
    pub row_of: Option<usize>,
}

/// Camera and board, and how sure they are.
#[derive(Debug, Clone, PartialEq)]
pub struct HandEye {
    /// Where the camera is mounted.
    pub mount: Mount,
    /// What the median picture is off by were it mounted the other way (rad, m); `None` where that was not tried.
    pub other_mount: Option<(f64, f64)>,
    /// `flange_from_camera`, or `base_from_camera` of a fixed one.
    pub camera: Placed,
    /// `base_from_board`, or `flange_from_board` where the camera is fixed.
    pub board: Placed,
    /// The camera's numbers, as corners and robot leave them.
    pub intrinsics: Intrinsics,
    /// The squares, measured by the robot's travel.
    pub square: Square,
    /// How far poses and pictures disagree.
    pub noise: Noise,
    /// Root mean square distance of the corners from where robot, camera and board put them, px.
    pub rms_px: f64,
    /// The same with each picture's board where it fits best, px: what the corners alone leave.
    pub picture_rms_px: f64,
    /// Root mean square distance of the middle of what a picture sees of the board from where all together put it, m.
    pub spread: f64,
    /// The pictures in the order given.
    pub views: Vec<ViewFit>,
    /// How the robot moved.
    pub motions: Motions,
}

/// The flange as the robot says it was against where camera and board put it: `flange_from_flange`.
pub(super) fn off(
    mount: Mount,
    base_from_flange: &Isometry3<f64>,
    camera: &Isometry3<f64>,
    board: &Isometry3<f64>,
    board_from_camera: &Isometry3<f64>,
) -> Isometry3<f64> {
    let implied = match mount {
        Mount::Wrist => board * board_from_camera * camera.inverse(),
        Mount::Fixed => camera * board_from_camera.inverse() * board.inverse(),
    };
    base_from_flange.inverse() * implied
}
