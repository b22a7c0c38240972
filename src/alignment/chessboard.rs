//! A printed chessboard in a photograph: its inner corners, to a fraction of a pixel and in order.
//!
//! In comes a picture and the size of the board; out come the corners row by row. Places where two dark and two
//! bright sectors meet are found at several sizes of the picture (`saddle.rs`), joined into grids along the edges
//! between them (`grid.rs`), and put to a fraction of a pixel at full size (`subpixel.rs`). Brightness, contrast, turn and
//! the size of the squares are not known beforehand. Of a board that is partly hidden what is seen is found where its place on the
//! board can be told (`part.rs`); otherwise what was seen is said. Finding the camera from the corners is [`super::intrinsics`]'s work.

mod grid;
mod part;
mod saddle;
mod subpixel;

use image::RgbImage;
use nalgebra::Vector2;

use self::grid::Grid;
use self::saddle::Saddles;
use self::subpixel::lopsided;
pub(super) use self::subpixel::refine;
use super::picture::median;
use super::plane::Plane;
use crate::world::{Pixel, Point, frame};

/// A chessboard by its inner corners, where four squares meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// Inner corners along a row.
    pub columns: usize,
    /// Inner corners along a column.
    pub rows: usize,
    /// Side of a square, m.
    pub square: f64,
}

/// Why a text is no board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BadBoard {
    /// Fewer inner corners than a grid has.
    #[error("a board has at least 3 x 2 inner corners")]
    TooSmall,
    /// More inner corners than a photograph shows.
    #[error("a board has at most {MOST} inner corners a side")]
    TooLarge,
    /// A square without a size.
    #[error("a square has a side longer than 0")]
    NoSide,
}

/// Most inner corners a side. Chosen: with squares of 8 px a picture 4000 px wide shows 500, and nobody prints that.
const MOST: usize = 200;

impl Board {
    /// Returns the board, if it is one that can be looked for; `square` in m.
    ///
    /// # Errors
    ///
    /// [`BadBoard`].
    pub fn new(columns: usize, rows: usize, square: f64) -> Result<Self, BadBoard> {
        if columns.min(rows) < 2 || columns.max(rows) < 3 {
            return Err(BadBoard::TooSmall);
        }
        if columns.max(rows) > MOST {
            return Err(BadBoard::TooLarge);
        }
        if !(square > 0.0 && square.is_finite()) {
            return Err(BadBoard::NoSide);
        }
        Ok(Self { columns, rows, square })
    }

    /// Returns the corners on the board's plane z = 0, m, row by row.
    pub fn points(&self) -> Vec<Point<frame::World>> {
        let place = |i: usize| self.square * i as f64;
        (0..self.rows)
            .flat_map(|r| (0..self.columns).map(move |c| Point::new(place(c), place(r), 0.0)))
            .collect()
    }
}

/// Why a board was not found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotFound {
    /// Nothing like a chessboard.
    #[error("no chessboard seen")]
    Nothing,
    /// A whole board, but another one.
    #[error("found {columns}x{rows}, asked for {}x{}", asked.0, asked.1)]
    OtherSize {
        /// Columns of what was seen.
        columns: usize,
        /// Rows of it.
        rows: usize,
        /// Columns and rows asked for.
        asked: (usize, usize),
    },
    /// A board with corners hidden or outside the picture.
    #[error(
        "found {seen} corners of a board with at least {columns}x{rows}, asked for {}x{}: part of it is hidden, \
         blurred or outside the picture",
        asked.0, asked.1
    )]
    Partly {
        /// Corners that were seen.
        seen: usize,
        /// Columns they span.
        columns: usize,
        /// Rows they span.
        rows: usize,
        /// Columns and rows asked for.
        asked: (usize, usize),
    },
    /// A part of a board that may be this or that part of it.
    #[error(
        "found {seen} corners of {columns}x{rows} of the {}x{} asked for, which may lie in {places} places on the board: show \
         two sides of its margin, or a side more",
        asked.0, asked.1
    )]
    Anywhere {
        /// Corners that were seen.
        seen: usize,
        /// Columns they span.
        columns: usize,
        /// Rows they span.
        rows: usize,
        /// Columns and rows asked for.
        asked: (usize, usize),
        /// In how many places they may lie.
        places: usize,
    },
    /// Corners that are not where edges cross.
    #[error("found the board, but {corners} of its corners are too blurred to be placed")]
    Blurred {
        /// How many.
        corners: usize,
    },
}

/// The long side of the picture that is searched first, px. Chosen: a board that fills a third of it has squares of
/// 30 px or so; with half of it small boards are lost at first, with twice as much time is.
const FIRST: usize = 1300;
/// The smallest long side that is searched, px: a board of ten squares of 8 px and as much around it.
const LEAST: usize = 160;
/// Saddles that are kept: so many per corner of the board, and so many beside it. Chosen: the board's are among the
/// strongest of a picture, and print beside it has some hundreds.
const KEPT: (usize, usize) = (8, 600);
/// Radius of the window of a corner, as a part of the distance to the nearest edge that is not its own, and px at
/// least. Chosen on OpenCV's 13 left views: the five-term lens fits the corners to 0.178 px at 0.3 and 0.4; at 0.5 the
/// paper's rim beyond the outer squares pulls corners away.
const WINDOW: (f64, f64) = (0.3, 3.0);
/// The part of a board's corners that may be too blurred to be placed; with more of them the picture is blurred. Chosen: what a finger covers.
const BLURRED: f64 = 0.25;
/// A corner that differs from itself at half a turn by more than the first, as a part of its contrast, and by more than so many times what
/// the board's corners do in the middle, is covered by something. Chosen on 60 drawn pictures with hands, sheets and shadows: of 2602 visible
/// corners used, those off by more than 0.3 px fall from 18 with 0.12 and 4 to 8; weights by how far edges pass the corner by gained
/// nothing beside it, and cost a tenth on clean corners.
const LOPSIDED: (f64, f64) = (0.08, 3.0);

/// Finds a chessboard's inner corners in a picture, row by row, px; whole or not at all.
///
/// The first corner is the one whose square inside the board is dark, where colours tell it; of two that colours do
/// not tell apart, the one nearer to the picture's top left corner. Rows follow clockwise to columns as seen.
///
/// # Errors
///
/// [`NotFound`], with what was seen instead.
pub fn find(image: &RgbImage, board: &Board) -> Result<Vec<Pixel>, NotFound> {
    match looked(image, board)? {
        Seen::Whole(pixels) => Ok(pixels),
        Seen::Part { not_whole, .. } => Err(not_whole),
    }
}

/// Finds the inner corners that are seen of a chessboard, with their numbers, row by row, from 0: all of them, or of a board that is
/// partly hidden those of a part of which the place on the board can be told.
///
/// # Errors
///
/// [`NotFound`], with what was seen instead.
pub fn find_seen(image: &RgbImage, board: &Board) -> Result<Vec<(usize, Pixel)>, NotFound> {
    match looked(image, board)? {
        Seen::Whole(pixels) => Ok(pixels.into_iter().enumerate().collect()),
        Seen::Part { corners, .. } => Ok(corners),
    }
}

/// What was seen of a board.
enum Seen {
    /// All corners, row by row.
    Whole(Vec<Pixel>),
    /// Some, with their numbers; and what to say if all are needed.
    Part { corners: Vec<(usize, Pixel)>, not_whole: NotFound },
}

fn looked(image: &RgbImage, board: &Board) -> Result<Seen, NotFound> {
    let mut levels = vec![Plane::grey(image)];
    while let Some(last) = levels.last()
        && last.width.max(last.height) >= 2 * LEAST
    {
        levels.push(last.halved());
    }
    let long = |level: usize| levels[level].width.max(levels[level].height);
    let first = (0..levels.len()).find(|&level| long(level) <= FIRST).unwrap_or(0);
    // Finer ones find small squares, coarser ones those in blur and noise.
    let order = (0..=first).rev().chain(first + 1..levels.len());
    let mut best: Option<(Grid, usize)> = None;
    for level in order {
        for grid in in_plane(&levels[level], board) {
            if let Some(grid) = ordered(&grid, board) {
                let corners = refined(&levels, level, &grid);
                return whole(corners, &grid, board);
            }
            if best.as_ref().is_none_or(|(other, _)| grid.n_seen() > other.n_seen()) {
                best = Some((grid, level));
            }
        }
    }
    let Some((grid, level)) = best else { return Err(NotFound::Nothing) };
    let not_whole = |places| seen(&grid, board, places);
    // A whole board of another size is not a part of this one.
    if matches!(not_whole(0), NotFound::OtherSize { .. }) && !is_inside(&grid, board) {
        return Err(not_whole(0));
    }
    let placed = part::placed(&levels[level], &grid, board).map_err(not_whole)?;
    let corners = refined(&levels, level, &placed.grid).into_iter().enumerate();
    let corners =
        corners.filter_map(|(k, at)| Some((placed.number(k, board), at.pixel()?))).collect();
    Ok(Seen::Part { corners, not_whole: not_whole(1) })
}

/// What there is to say of a board of which every corner was seen, when some of them cannot be used.
fn whole(corners: Vec<Placed>, grid: &Grid, board: &Board) -> Result<Seen, NotFound> {
    let count = |what: Placed| corners.iter().filter(|corner| **corner == what).count();
    let (blurred, covered) = (count(Placed::Blurred), count(Placed::Covered));
    if blurred as f64 > BLURRED * corners.len() as f64 {
        return Err(NotFound::Blurred { corners: blurred });
    }
    let covered = covered + blurred;
    if covered == 0 {
        return Ok(Seen::Whole(corners.into_iter().filter_map(Placed::pixel).collect()));
    }
    let asked = (board.columns, board.rows);
    let seen = grid.n_seen() - covered;
    let not_whole = NotFound::Partly { seen, columns: grid.n_columns, rows: grid.n_rows, asked };
    let corners = corners.into_iter().enumerate();
    let corners = corners.filter_map(|(k, corner)| Some((k, corner.pixel()?))).collect();
    Ok(Seen::Part { corners, not_whole })
}

/// Whether a grid may be a part of a board.
fn is_inside(grid: &Grid, board: &Board) -> bool {
    let (long, short) = (grid.n_columns.max(grid.n_rows), grid.n_columns.min(grid.n_rows));
    long <= board.columns.max(board.rows) && short <= board.columns.min(board.rows)
}

fn in_plane(plane: &Plane, board: &Board) -> Vec<Grid> {
    let saddles = Saddles::new(plane);
    let most = KEPT.0 * board.columns * board.rows + KEPT.1;
    grid::grids(&saddles, &saddles.all(most))
}

/// What to say of a grid that is not the board asked for, and may lie in so many places on it.
fn seen(grid: &Grid, board: &Board, places: usize) -> NotFound {
    let asked = (board.columns, board.rows);
    // Named the way it was asked: the long side where the asked one has it.
    let (long, short) = (grid.n_columns.max(grid.n_rows), grid.n_columns.min(grid.n_rows));
    let (columns, rows) = if asked.0 >= asked.1 { (long, short) } else { (short, long) };
    let seen = grid.n_seen();
    if places > 1 {
        NotFound::Anywhere { seen, columns, rows, asked, places }
    } else if seen == columns * rows && (columns, rows) != asked {
        NotFound::OtherSize { columns, rows, asked }
    } else {
        NotFound::Partly { seen, columns, rows, asked }
    }
}

/// Returns the grid turned so that its columns and rows are the board's, `None` if it is not that board.
fn ordered(grid: &Grid, board: &Board) -> Option<Grid> {
    if grid.corners.iter().any(Option::is_none) {
        return None;
    }
    let mut turns = vec![grid.clone()];
    for _ in 0..3 {
        turns.extend(turns.last().map(Grid::turned));
    }
    turns.retain(|g| (g.n_columns, g.n_rows) == (board.columns, board.rows));
    let from_top_left = |g: &Grid| g.corners[0].map_or(f64::INFINITY, |p| p.x + p.y);
    turns.into_iter().min_by(|a, b| {
        b.is_dark.cmp(&a.is_dark).then(from_top_left(a).total_cmp(&from_top_left(b)))
    })
}

/// A corner of a grid at full size.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Placed {
    /// To a fraction of a pixel.
    At(Pixel),
    /// It was not seen.
    Unseen,
    /// Too blurred to be placed.
    Blurred,
    /// Something that is no board reaches into its window.
    Covered,
}

impl Placed {
    fn pixel(self) -> Option<Pixel> {
        match self {
            Self::At(pixel) => Some(pixel),
            _ => None,
        }
    }
}

/// Puts corners that were found at one size of the picture to a fraction of a pixel at full size.
fn refined(levels: &[Plane], level: usize, grid: &Grid) -> Vec<Placed> {
    let mut corners = grid.corners.clone();
    let mut is_lost = vec![false; corners.len()];
    for (step, plane) in levels[..=level].iter().rev().enumerate() {
        if step > 0 {
            // Pixels' centres are whole numbers, so a pixel of half the size begins at -0.5.
            for corner in corners.iter_mut().flatten() {
                *corner = *corner * 2.0 + Vector2::new(0.5, 0.5);
            }
        }
        for i in 0..corners.len() {
            let Some(corner) = corners[i] else { continue };
            let at = refine(plane, corner, window(&corners, i, grid));
            is_lost[i] = at.is_none();
            corners[i] = at.or(Some(corner));
        }
    }
    let odd = |i: usize| {
        let at = corners[i].filter(|_| !is_lost[i])?;
        Some(lopsided(&levels[0], at, window(&corners, i, grid)))
    };
    let odd: Vec<Option<f64>> = (0..corners.len()).map(odd).collect();
    let usual = median(&mut odd.iter().flatten().copied().collect::<Vec<_>>());
    let most = (LOPSIDED.1 * usual).max(LOPSIDED.0);
    let placed = |i: usize| match (corners[i], odd[i]) {
        (None, _) => Placed::Unseen,
        (Some(_), None) => Placed::Blurred,
        (Some(_), Some(odd)) if odd > most => Placed::Covered,
        (Some(at), Some(_)) => Placed::At(Pixel::new(at.x, at.y)),
    };
    (0..corners.len()).map(placed).collect()
}

/// The radius of the window of a corner, px.
fn window(corners: &[Option<Vector2<f64>>], i: usize, grid: &Grid) -> f64 {
    (WINDOW.0 * free(corners, i, grid)).max(WINDOW.1)
}

/// The distance from a corner to the nearest edge that does not run through it, px; 0 of one without neighbours.
fn free(corners: &[Option<Vector2<f64>>], i: usize, grid: &Grid) -> f64 {
    let (column, row, w) = (i % grid.n_columns, i / grid.n_columns, grid.n_columns);
    let beside = [(column > 0).then(|| i - 1), (column + 1 < w).then_some(i + 1)];
    let above = [(row > 0).then(|| i - w), (row + 1 < grid.n_rows).then_some(i + w)];
    let seen = |k: Option<usize>| k.and_then(|k| Some(corners[k]? - corners[i]?));
    let mut least = f64::INFINITY;
    for a in beside.into_iter().filter_map(seen) {
        for b in above.into_iter().filter_map(seen) {
            // The heights of the square over its sides.
            least = least.min(a.perp(&b).abs() / a.norm().max(b.norm()).max(f64::MIN_POSITIVE));
        }
    }
    if least.is_finite() { least } else { 0.0 }
}
