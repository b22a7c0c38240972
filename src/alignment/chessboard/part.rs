//! A part of a chessboard: where on the board it lies, if only one place will do.
//!
//! Of a grid that was seen with corners missing three things are known: how many columns and rows it spans, what colour its
//! squares have, and on which sides the board ends: there a row of squares is followed by a bright margin. Every turn and every shift of
//! the grid on the board that agrees with all three is a place; a board that looks the same from several sides has each of them as
//! often. Several places are no place: then nobody can tell which corner is which.

use super::Board;
use super::grid::Grid;
use crate::alignment::plane::Plane;

/// The part of the board's corners that must be seen. Chosen: half of it. Fewer are too easily those of something else that is
/// chequered.
const LEAST: f64 = 0.5;
/// How far beyond the outermost corners the squares outside begin to be looked at, and how far at most they go, in sides of a
/// square: past the blur of the corners' own edges, and a whole side, which perspective makes longer by a seventh. Prints cut the
/// outer squares short as they like.
const OUTSIDE: (f64, f64) = (0.12, 1.15);
/// Between two looks, and the width of margin that must be seen, in sides: some pixels of a square of 30 px, as narrow as a margin is that
/// somebody has cut.
const STEP: f64 = 0.04;
const MARGIN: f64 = 0.08;
/// The part of a side's squares that must look as they should for the board to end there. Chosen: all but one of nine, for a speck
/// or a finger.
const AGREE: f64 = 0.85;
/// Up to this part of the way from dark to bright inside the board a square is dark, and from the second on a margin is bright: paper, not
/// skin, which is some half as bright.
const DARK: f64 = 0.5;
const BRIGHT: f64 = 0.75;

/// A grid as it lies on the board: its corners with their numbers on it.
pub(super) struct Placed {
    pub(super) grid: Grid,
    /// Columns and rows of the board before its first.
    shift: (usize, usize),
}

impl Placed {
    /// The number on the board, row by row, of a corner of the grid.
    pub(super) fn number(&self, corner: usize, board: &Board) -> usize {
        let (column, row) = (corner % self.grid.n_columns, corner / self.grid.n_columns);
        (row + self.shift.1) * board.columns + column + self.shift.0
    }
}

/// Finds the place of a grid; how many there are, if not one.
pub(super) fn placed(plane: &Plane, grid: &Grid, board: &Board) -> Result<Placed, usize> {
    if (grid.n_seen() as f64) < LEAST * (board.columns * board.rows) as f64 {
        return Err(0);
    }
    let mut places = Vec::new();
    let mut turned = grid.clone();
    for _ in 0..4 {
        for shift in shifts(plane, &turned, board) {
            places.push(Placed { grid: turned.clone(), shift });
        }
        turned = turned.turned();
    }
    // A board with an even sum of sides looks the same turned by half, a square one turned by a quarter.
    let alike = match (board.columns + board.rows) % 2 {
        1 => 1,
        _ if board.columns == board.rows => 4,
        _ => 2,
    };
    if places.len() > alike {
        return Err(places.len().div_ceil(alike));
    }
    let from_top_left = |placed: &Placed| {
        let first = placed.grid.corners.iter().flatten().next();
        first.map_or(f64::INFINITY, |p| p.x + p.y)
    };
    let places = places.into_iter();
    places.min_by(|a, b| from_top_left(a).total_cmp(&from_top_left(b))).ok_or(0)
}

/// The shifts of a grid on the board that agree with its size, colours and sides.
fn shifts(plane: &Plane, grid: &Grid, board: &Board) -> Vec<(usize, usize)> {
    if grid.n_columns > board.columns || grid.n_rows > board.rows {
        return Vec::new();
    }
    let room = (board.columns - grid.n_columns, board.rows - grid.n_rows);
    // A side that the board fills needs no looking at.
    let ends = if room == (0, 0) { [false; 4] } else { ends(plane, grid) };
    let is_right = |(column, row): &(usize, usize)| {
        // The first square inside is dark, where colours tell that one from the last.
        let is_dark = (column + row) % 2 == 0;
        let agrees = (board.columns + board.rows).is_multiple_of(2) || grid.is_dark == is_dark;
        let [top, right, bottom, left] = ends;
        agrees
            && (!top || *row == 0)
            && (!bottom || *row == room.1)
            && (!left || *column == 0)
            && (!right || *column == room.0)
    };
    let all = (0..=room.1).flat_map(|row| (0..=room.0).map(move |column| (column, row)));
    all.filter(is_right).collect()
}

/// Whether the board ends at the grid's top, right, bottom and left.
fn ends(plane: &Plane, grid: &Grid) -> [bool; 4] {
    let mut turned = grid.clone();
    let mut ends = [false; 4];
    // Turned by a quarter, what was left is at the top.
    for side in [0, 3, 2, 1] {
        ends[side] = ends_at_top(plane, &turned);
        turned = turned.turned();
    }
    ends
}

/// Whether beyond the first row of corners there is one row of squares, and then a bright margin.
///
/// From a dark square outside the picture turns bright within a side and stays so for the margin's width; a bright one is bright as far as
/// that. Where the board goes on, the bright ones turn dark; what covers it is not as bright as paper.
fn ends_at_top(plane: &Plane, grid: &Grid) -> bool {
    let Some((dark, bright)) = inks(plane, grid) else { return false };
    let share = |value: f64| (value - dark) / (bright - dark).max(f64::MIN_POSITIVE);
    let at = |column: usize, row: usize| grid.corners[row * grid.n_columns + column];
    let (mut ends, mut n_dark, mut light) = (Vec::new(), 0.0, Vec::new());
    for column in 0..grid.n_columns - 1 {
        let four = [at(column, 0), at(column + 1, 0), at(column, 1), at(column + 1, 1)];
        let [Some(a), Some(b), Some(c), Some(d)] = four else { continue };
        let (from, out) = (0.5 * (a + b), 0.5 * (a + b) - 0.5 * (c + d));
        let look = move |far: f64| {
            let p = from + out * far;
            let (w, h) = (plane.width as f64 - 1.0, plane.height as f64 - 1.0);
            let is_in = p.x > 0.0 && p.y > 0.0 && p.x < w && p.y < h;
            if is_in { share(f64::from(plane.sample(p.x, p.y))) } else { f64::NAN }
        };
        // Above a dark square is a bright one.
        if grid.is_dark == (column % 2 == 0) {
            light.push(look);
        } else {
            n_dark += 1.0;
            let far = steps(OUTSIDE.0, OUTSIDE.1).find(|far| look(*far) > BRIGHT);
            let is_margin = |far: &f64| steps(*far, far + MARGIN).all(|far| look(far) > BRIGHT);
            ends.extend(far.filter(|far| look(OUTSIDE.0) < DARK && is_margin(far)));
        }
    }
    ends.sort_by(f64::total_cmp);
    let Some(&end) = ends.get(ends.len() / 2) else { return false };
    let n_light = light.len() as f64;
    let is_bright =
        light.iter().map(|look| steps(OUTSIDE.0, end + MARGIN).all(|far| look(far) > BRIGHT));
    let bright = is_bright.filter(|is_bright| *is_bright).count() as f64;
    // Two of each at least, so that a speck is no side.
    ends.len() as f64 >= (AGREE * n_dark).max(2.0) && bright >= (AGREE * n_light).max(2.0)
}

/// Distances from one to another, a step apart.
fn steps(from: f64, to: f64) -> impl Iterator<Item = f64> {
    let n = ((to - from) / STEP).round().max(0.0) as usize;
    (0..=n).map(move |k| from + STEP * k as f64)
}

/// How bright dark and bright squares inside are, on the mean.
fn inks(plane: &Plane, grid: &Grid) -> Option<(f64, f64)> {
    let (mut sums, mut counts) = ([0.0; 2], [0.0; 2]);
    for row in 0..grid.n_rows - 1 {
        for column in 0..grid.n_columns - 1 {
            let first = row * grid.n_columns + column;
            let four = [first, first + 1, first + grid.n_columns, first + grid.n_columns + 1];
            let [Some(a), Some(b), Some(c), Some(d)] = four.map(|k| grid.corners[k]) else {
                continue;
            };
            let p = 0.25 * (a + b + c + d);
            let is_bright = usize::from(grid.is_dark != ((row + column) % 2 == 0));
            sums[is_bright] += f64::from(plane.sample(p.x, p.y));
            counts[is_bright] += 1.0;
        }
    }
    (counts[0] > 0.0 && counts[1] > 0.0).then(|| (sums[0] / counts[0], sums[1] / counts[1]))
}
