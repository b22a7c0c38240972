//! Printed targets that a camera is calibrated with: what each has on it, and where that is in a photograph.
//!
//! A chessboard ([`super::chessboard`]) is whole in the picture, or hidden so that one place on it is left for what is seen. A `ChArUco` board ([`charuco`]) and a grid of
//! tags ([`tag_grid`]) say by their tags which part of them is seen, so any part will do. Circles ([`circles`]) stand in a
//! grid, whole as well. What a board is as a whole is `form`'s. Finding the camera from what was found is [`super::intrinsics`]'s work.

pub mod charuco;
pub mod circles;
mod discs;
mod eccentricity;
mod form;
mod lattice;
mod quads;
pub mod tag_grid;
pub mod tags;

use image::RgbImage;
use nalgebra::{Matrix2, Vector2};

use self::charuco::Charuco;
use self::circles::Circles;
pub use self::form::Sides;
use self::tag_grid::TagGrid;
use super::chessboard::{self, Board};
use super::image_map::{self, Model, NoiseIn, Pair};
use crate::world::{Pixel, Point, frame};

/// Points of a target, m, and where they appear, px.
pub type Found = Vec<(Point<frame::World>, Pixel)>;

/// A printed target.
#[derive(Debug, Clone, PartialEq)]
pub enum Target {
    /// A plain chessboard.
    Chessboard(Board),
    /// A chessboard with tags in its bright squares.
    Charuco(Charuco),
    /// Tags in a grid.
    Tags(TagGrid),
    /// Circles in a grid.
    Circles(Circles),
}

/// Why a target was not found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotFound {
    /// No chessboard, or another one.
    #[error("{0}")]
    Chessboard(chessboard::NotFound),
    /// No tag of the family.
    #[error("no tag of {family} seen")]
    NoTags {
        /// What the tags are called.
        family: String,
    },
    /// Too few points.
    #[error("{tags} tags of {family} seen, and {points} points of the board: {least} are needed")]
    TooFew {
        /// How many tags were read.
        tags: usize,
        /// What they are called.
        family: String,
        /// Points that could be placed.
        points: usize,
        /// How many it takes.
        least: usize,
    },
    /// Tags that the board does not have.
    #[error("tags of {family} are seen, but not where the board has them: is its layout right?")]
    OtherBoard {
        /// What they are called.
        family: String,
    },
    /// Points that are all on one line.
    #[error(
        "{points} points of the board seen, all on one line, from which its plane cannot be told"
    )]
    OnALine {
        /// How many.
        points: usize,
    },
    /// The circles of the board with columns and rows exchanged.
    #[error("the circles are those of {columns}x{rows}, along a row and down")]
    Exchanged {
        /// Circles along a row.
        columns: usize,
        /// Rows.
        rows: usize,
    },
    /// Circles that are not those of the board.
    #[error("{seen} circles in a grid seen, the board has {asked}: all must be in the picture")]
    Circles {
        /// The most that stand in one grid.
        seen: usize,
        /// How many the board has.
        asked: usize,
    },
}

/// Points that a picture must show of a board with tags: four hold a plane, two more its mistakes. Chosen.
const LEAST: usize = 6;

impl Target {
    /// Finds the target's points in a picture.
    ///
    /// # Errors
    ///
    /// [`NotFound`], with what was seen instead.
    pub fn find(&self, image: &RgbImage) -> Result<Found, NotFound> {
        match self {
            Self::Chessboard(board) => {
                let seen = chessboard::find_seen(image, board).map_err(NotFound::Chessboard)?;
                let points = board.points();
                let whole = seen.len() == points.len();
                let found = seen.into_iter().map(|(k, pixel)| (points[k], pixel)).collect();
                // What hides a part hides a part of corners beside it.
                if whole { Ok(found) } else { of_a_plane(without_strays(found)) }
            }
            Self::Charuco(board) => board.find(image).map(without_strays).and_then(of_a_plane),
            Self::Tags(board) => board.find(image).map(without_strays).and_then(of_a_plane),
            Self::Circles(board) => board.find(image),
        }
    }
}

/// Refuses what a narrow part of a board shows: one row of corners.
fn of_a_plane(found: Found) -> Result<Found, NotFound> {
    let middle = found.iter().map(|(p, _)| p.coords().xy()).sum::<Vector2<f64>>()
        / found.len().max(1) as f64;
    let scatter: Matrix2<f64> =
        found.iter().map(|(p, _)| p.coords().xy() - middle).map(|d| d * d.transpose()).sum();
    let spread = scatter.symmetric_eigenvalues();
    // Points of a board are on lines exactly, or rows apart.
    if spread.min() > 1e-9 * spread.max() {
        Ok(found)
    } else {
        Err(NotFound::OnALine { points: found.len() })
    }
}

/// Points around one that say where it should be.
const NEIGHBOURS: usize = 8;
/// A point that is farther from there than this, px, and than so many times what points are in the middle, is another thing's.
const STRAY: (f64, f64) = (1.0, 6.0);

/// Leaves out points that are not where a plane through the points around them puts them: the edge of a hand through a
/// corner. Near by no lens bends a plane by as much.
fn without_strays(mut found: Found) -> Found {
    while found.len() > NEIGHBOURS + 1 {
        let off: Vec<f64> = (0..found.len()).map(|k| off_neighbours(&found, k)).collect();
        let mut sorted = off.clone();
        sorted.sort_by(f64::total_cmp);
        let most = (STRAY.1 * sorted[sorted.len() / 2]).max(STRAY.0);
        let worst = (0..off.len()).max_by(|&a, &b| off[a].total_cmp(&off[b]));
        match worst.filter(|&k| off[k] > most) {
            Some(worst) => found.remove(worst),
            None => break,
        };
    }
    found
}

/// How far a point is from where those around it put it, px; 0 where they do not say.
fn off_neighbours(found: &Found, k: usize) -> f64 {
    let (point, pixel) = &found[k];
    let far = |i: &usize| (found[*i].0.coords() - point.coords()).norm_squared();
    let mut others: Vec<usize> = (0..found.len()).filter(|i| *i != k).collect();
    others.sort_by(|a, b| far(a).total_cmp(&far(b)));
    let pairs: Vec<Pair> = others[..NEIGHBOURS.min(others.len())]
        .iter()
        .map(|&i| {
            let at = found[i].0.coords();
            Pair { real: found[i].1, twin: Pixel::new(at.x, at.y) }
        })
        .collect();
    let options = image_map::Options { robust: false, noise: NoiseIn::Real, seed: 0 };
    let Ok(map) = image_map::fit_map(&pairs, Model::Projective, &options) else { return 0.0 };
    let at = tags::through(&map.m, &point.coords().xy());
    (at - Vector2::new(pixel.u, pixel.v)).norm()
}

impl From<Board> for Target {
    fn from(board: Board) -> Self {
        Self::Chessboard(board)
    }
}
