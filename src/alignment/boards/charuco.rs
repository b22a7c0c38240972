//! `ChArUco` boards: a chessboard with a tag in each bright square.
//!
//! Tags say which squares are seen; the chessboard's inner corners next to them are looked for where the tags put them, and
//! placed as a chessboard's are. A part of the board is enough. Both orders in which `OpenCV` has laid out boards are
//! tried.
//!
//! Source: the layout of `OpenCV`'s `CharucoBoard`, since 4.6 and before.

use image::RgbImage;
use nalgebra::Vector2;

use super::tags::{Family, Tag, crosses, square_to, through};
use super::{Found, LEAST, NotFound};
use crate::alignment::chessboard::refine;
use crate::alignment::image_map::{self, Model, NoiseIn, Pair};
use crate::alignment::plane::Plane;
use crate::world::{Pixel, Point};

/// A `ChArUco` board.
#[derive(Debug, Clone, PartialEq)]
pub struct Charuco {
    /// Squares along a row.
    pub columns: usize,
    /// Squares along a column.
    pub rows: usize,
    /// Side of a square, m.
    pub square: f64,
    /// Side of a tag, its dark frame included, m.
    pub tag: f64,
    /// The tags.
    pub family: Family,
}

/// Why numbers are no board with tags.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BadBoard {
    /// Too few squares or tags.
    #[error("a board has at least {least} a side")]
    TooSmall {
        /// How many a side.
        least: usize,
    },
    /// Sizes that do not fit together.
    #[error("a side is longer than 0, a tag shorter than its square")]
    Sides,
    /// More tags than the family has.
    #[error("the board needs {needed} tags, {family} has {has}")]
    TooMany {
        /// How many it needs.
        needed: usize,
        /// The family.
        family: &'static str,
        /// How many there are.
        has: usize,
    },
}

/// The least radius of the window in which a corner is placed, px, and as a part of the way to the nearest tag.
const WINDOW: (f64, f64) = (3.0, 0.7);
/// A corner is at most so far from where the tags beside it put it: px, and as a part of the way to the nearest tag. Chosen:
/// ten times what the corners of a tag are off by.
const STRAY: (f64, f64) = (2.0, 0.3);
/// Where the squares around a corner are looked at, as a part of the rim around a tag: in its middle.
const AROUND: f64 = 0.5;
/// A tag that is farther than this part of its side from where all tags together put it is another board's. Lenses that bend
/// a board by less are no matter.
const ASTRAY: f64 = 0.6;

impl Charuco {
    /// Returns the board, if it is one that can be looked for; lengths in m.
    ///
    /// # Errors
    ///
    /// [`BadBoard`].
    pub fn new(
        columns: usize,
        rows: usize,
        square: f64,
        tag: f64,
        family: Family,
    ) -> Result<Self, BadBoard> {
        if columns.min(rows) < 3 {
            return Err(BadBoard::TooSmall { least: 3 });
        }
        if !(tag > 0.0 && tag < square && square.is_finite()) {
            return Err(BadBoard::Sides);
        }
        let (needed, has) = ((columns * rows).div_ceil(2), family.codes.len());
        if needed > has {
            return Err(BadBoard::TooMany { needed, family: family.name, has });
        }
        Ok(Self { columns, rows, square, tag, family })
    }

    /// The squares that have tags, by number: column and row. `early` is the order before `OpenCV` 4.6, which differs
    /// where there is an even number of rows.
    fn tagged(&self, early: bool) -> Vec<(usize, usize)> {
        let shift = usize::from(early && self.rows.is_multiple_of(2));
        let squares = (0..self.rows).flat_map(|r| (0..self.columns).map(move |c| (c, r)));
        squares.filter(|(c, r)| (c + r + shift) % 2 == 1).collect()
    }

    /// Returns whether the board is bright at a place, m from its top left corner; for printing it.
    #[must_use]
    pub fn is_bright(&self, x: f64, y: f64) -> bool {
        let (column, row) = ((x / self.square).floor(), (y / self.square).floor());
        let inside = |at: f64, most: usize| (0.0..most as f64).contains(&at);
        if !inside(column, self.columns) || !inside(row, self.rows) {
            return true;
        }
        let (column, row) = (column as usize, row as usize);
        if (column + row).is_multiple_of(2) {
            return false;
        }
        // Every second square has a tag.
        let square = row * self.columns + column;
        let number = square / 2;
        let rim = 0.5 * (self.square - self.tag);
        let cells = (self.family.side + 2) as f64;
        let cell = |at: f64, square: usize| {
            ((at - square as f64 * self.square - rim) / self.tag * cells).floor()
        };
        let (c, r) = (cell(x, column), cell(y, row));
        if !(0.0..cells).contains(&c) || !(0.0..cells).contains(&r) {
            return true;
        }
        let inner = |at: f64| (1.0..cells - 1.0).contains(&at);
        inner(c) && inner(r) && self.family.is_bright(number, c as usize - 1, r as usize - 1)
    }

    /// Finds the inner corners beside the tags that are seen, in board coordinates from the top left corner of its first
    /// square, and in the picture.
    ///
    /// # Errors
    ///
    /// [`NotFound`].
    pub fn find(&self, image: &RgbImage) -> Result<Found, NotFound> {
        let grey = Plane::grey(image);
        let tags = self.family.tags(&grey, &[1]);
        let family = || self.family.name.to_owned();
        if tags.is_empty() {
            return Err(NotFound::NoTags { family: family() });
        }
        let layouts = [false, true].map(|early| self.tagged(early));
        let placed = layouts.map(|squares| self.in_place(&tags, &squares));
        let [now, early] = placed;
        let (now, early) = (now.unwrap_or_default(), early.unwrap_or_default());
        let placed = if early.len() > now.len() { early } else { now };
        if placed.is_empty() {
            return Err(NotFound::OtherBoard { family: family() });
        }
        let found = self.corners(&grey, &placed);
        if found.len() < LEAST {
            let (tags, points) = (placed.len(), found.len());
            return Err(NotFound::TooFew { tags, family: family(), points, least: LEAST });
        }
        Ok(found)
    }

    /// The corners of a tag on the board, m, its own top left first.
    fn on_board(&self, (column, row): (usize, usize)) -> [Vector2<f64>; 4] {
        let rim = 0.5 * (self.square - self.tag);
        let (x, y) = (column as f64 * self.square + rim, row as f64 * self.square + rim);
        let side = self.tag;
        [[x, y], [x + side, y], [x + side, y + side], [x, y + side]].map(Vector2::from)
    }

    /// The tags with their squares, without those that are not where the board has them; `None` when nothing fits.
    fn in_place<'t>(
        &self,
        tags: &'t [Tag],
        squares: &[(usize, usize)],
    ) -> Option<Vec<(&'t Tag, (usize, usize))>> {
        let known: Vec<(&Tag, (usize, usize))> =
            tags.iter().filter_map(|tag| Some((tag, *squares.get(tag.number)?))).collect();
        let on_board = |square| self.on_board(square);
        let kept = consistent(&known, &on_board, ASTRAY)?;
        Some(kept.into_iter().map(|at| known[at]).collect())
    }

    /// The inner corners next to tags, placed to a fraction of a pixel.
    fn corners(&self, grey: &Plane, placed: &[(&Tag, (usize, usize))]) -> Found {
        let mut found = Vec::new();
        let inner = (1..self.rows).flat_map(|r| (1..self.columns).map(move |c| (c, r)));
        for (column, row) in inner {
            let place = Vector2::new(column as f64, row as f64) * self.square;
            // The tags of the two bright squares that meet there.
            let beside = placed.iter().filter(|(_, (c, r))| {
                (column - 1..=column).contains(c) && (row - 1..=row).contains(r)
            });
            let (mut sum, mut count, mut near) = (Vector2::zeros(), 0.0, f64::INFINITY);
            let mut around = [Vector2::zeros(); 4];
            let mut is_bright = [false; 4];
            for (tag, square) in beside {
                let own = self.on_board(*square);
                let at = through(&square_to(&tag.corners), &((place - own[0]) / self.tag));
                sum += at;
                count += 1.0;
                for (k, (x, y)) in
                    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].into_iter().enumerate()
                {
                    let rim = 0.5 * (self.square - self.tag) * AROUND;
                    let beside = place + Vector2::new(x, y) * rim;
                    let map = square_to(&tag.corners);
                    around[k] = through(&map, &((beside - own[0]) / self.tag)) - at;
                }
                // Bright squares meet where tags are, on one diagonal.
                let is_falling = (square.0 == column) == (square.1 == row);
                is_bright = [is_falling, !is_falling, is_falling, !is_falling];
                let far = |corner: &Vector2<f64>| (corner - at).norm();
                near = tag.corners.iter().map(far).fold(near, f64::min);
            }
            if count == 0.0 {
                continue;
            }
            let start: Vector2<f64> = sum / count;
            let inside = |at: f64, size: usize| at > 0.0 && at < size as f64 - 1.0;
            if !inside(start.x, grey.width) || !inside(start.y, grey.height) {
                continue;
            }
            let placed = refine(grey, start, (WINDOW.1 * near).max(WINDOW.0));
            let astray = (STRAY.1 * near).max(STRAY.0);
            if let Some(at) = placed
                && (at - start).norm() < astray
                && crosses(grey, &around.map(|by| at + by), is_bright)
            {
                found.push((Point::new(place.x, place.y, 0.0), Pixel::new(at.x, at.y)));
            }
        }
        found
    }
}

/// Returns which tags are where one map of the board's plane to the picture puts them, within a part of their side; `None`
/// when there is no such map.
pub(super) fn consistent<S: Copy>(
    known: &[(&Tag, S)],
    on_board: &dyn Fn(S) -> [Vector2<f64>; 4],
    astray: f64,
) -> Option<Vec<usize>> {
    let pixel = |p: &Vector2<f64>| Pixel::new(p.x, p.y);
    let pairs: Vec<Pair> = known
        .iter()
        .flat_map(|(tag, at)| {
            let board = on_board(*at);
            (0..4).map(move |i| Pair { real: pixel(&tag.corners[i]), twin: pixel(&board[i]) })
        })
        .collect();
    let options = image_map::Options { robust: known.len() > 2, noise: NoiseIn::Real, seed: 0 };
    let map = image_map::fit_map(&pairs, Model::Projective, &options).ok()?.m;
    let kept: Vec<usize> = (0..known.len())
        .filter(|&k| {
            let (tag, at) = &known[k];
            let side = (tag.corners[1] - tag.corners[0]).norm();
            let board = on_board(*at);
            (0..4).all(|i| (through(&map, &board[i]) - tag.corners[i]).norm() < astray * side)
        })
        .collect();
    // Any tags lie on some plane; a board holds most of those that are seen on one.
    (2 * kept.len() > known.len()).then_some(kept)
}
