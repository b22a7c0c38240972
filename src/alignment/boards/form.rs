//! A board as a whole: the length that is said of it, its middle, and the turns after which it looks the same. Finding it in
//! a picture is each board's own work.

use std::fmt;

use nalgebra::Vector2;

use super::{Found, Target};
use crate::world::{Point, frame};

/// What the length that is said of a board is the length of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sides {
    /// The sides of its squares.
    Squares,
    /// The sides of its tags, with their dark frames.
    Tags,
    /// The steps from a row of circles to the next.
    Steps,
}

impl Sides {
    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Squares => "squares",
            Self::Tags => "tags",
            Self::Steps => "steps",
        }
    }
}

impl fmt::Display for Sides {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Squares => "squares",
            Self::Tags => "tags",
            Self::Steps => "steps between rows",
        })
    }
}

impl Target {
    /// Returns the length that is said of the board, m, and what has it. All its other lengths go with it.
    pub fn side(&self) -> (f64, Sides) {
        match self {
            Self::Chessboard(board) => (board.square, Sides::Squares),
            Self::Charuco(board) => (board.square, Sides::Squares),
            Self::Tags(board) => (board.tag, Sides::Tags),
            Self::Circles(board) => (board.step, Sides::Steps),
        }
    }

    /// Returns the middle of all its points, in its own coordinates, m.
    pub fn middle(&self) -> Point<frame::World> {
        let half = |n: f64, step: f64| 0.5 * n * step;
        let (x, y) = match self {
            Self::Chessboard(board) => (
                half(board.columns as f64 - 1.0, board.square),
                half(board.rows as f64 - 1.0, board.square),
            ),
            // Its coordinates begin at the corner of its first square.
            Self::Charuco(board) => {
                (half(board.columns as f64, board.square), half(board.rows as f64, board.square))
            }
            Self::Tags(board) => {
                let long = |n: usize| n as f64 * (1.0 + board.gap) - board.gap;
                (half(long(board.columns), board.tag), half(long(board.rows), board.tag))
            }
            Self::Circles(board) => {
                let wide = if board.shifted { 2 * board.columns } else { board.columns };
                (half(wide as f64 - 1.0, board.step), half(board.rows as f64 - 1.0, board.step))
            }
        };
        Point::new(x, y, 0.0)
    }

    /// Returns the quarter turns about its middle after which nobody can tell that it was turned.
    fn alike(&self) -> &'static [u8] {
        let is_turned = |columns: usize, rows: usize| -> &'static [u8] {
            if columns == rows { &[0, 1, 2, 3] } else { &[0, 2] }
        };
        match self {
            // Half a turn exchanges dark and bright where the sides are an even and an odd number.
            Self::Chessboard(board) if (board.columns + board.rows) % 2 == 1 => &[0],
            Self::Chessboard(board) => is_turned(board.columns, board.rows),
            Self::Circles(board) if !board.shifted => is_turned(board.columns, board.rows),
            // The last row of an even number is shifted, the first is not: half a turn exchanges them.
            Self::Circles(board) if board.rows % 2 == 0 => &[0, 2],
            Self::Charuco(_) | Self::Tags(_) | Self::Circles(_) => &[0],
        }
    }

    /// Returns the ways in which the points that were found may belong to the board, as it looks the same from several sides.
    pub fn orders(&self, found: &Found) -> Vec<Found> {
        let middle = self.middle().coords().xy();
        let turned = |turn: u8| -> Found {
            let each = found.iter().map(|(point, pixel)| {
                let d = point.coords().xy() - middle;
                let d = match turn {
                    0 => d,
                    1 => Vector2::new(-d.y, d.x),
                    2 => -d,
                    _ => Vector2::new(d.y, -d.x),
                };
                (Point::new(middle.x + d.x, middle.y + d.y, point.coords().z), *pixel)
            });
            each.collect()
        };
        self.alike()
            .iter()
            .map(|&turn| if turn == 0 { found.clone() } else { turned(turn) })
            .collect()
    }
}
