//! Grids of tags, as Kalibr prints them: `AprilTag`s of which each corner touches a small dark square.
//!
//! Tags are numbered row by row. Every corner of a tag's frame is a point, placed where the edges around it meet; a part
//! of the grid is enough. Which side of a tag is up is not the same everywhere: Kalibr's stand on their heads against `OpenCV`'s codes, which
//! are those read here. All four turns are tried, and the one that most tags agree with is the grid's.
//!
//! Source: the layout of Kalibr's `aprilgrid` target (number 0 at the bottom left, x right and y up); Hartley and Zisserman, 2nd ed.,
//! §2.5 (the cross-ratio, which tells the gap that is printed).

use std::collections::BTreeMap;

use image::RgbImage;
use nalgebra::Vector2;

use super::charuco::{BadBoard, consistent};
use super::tags::{Family, Tag, crosses, square_to, through};
use super::{Found, LEAST, NotFound};
use crate::alignment::chessboard::refine;
use crate::alignment::picture::median;
use crate::alignment::plane::Plane;
use crate::world::{Pixel, Point, frame};

/// A grid of tags.
#[derive(Debug, Clone, PartialEq)]
pub struct TagGrid {
    /// Tags along a row.
    pub columns: usize,
    /// Tags along a column.
    pub rows: usize,
    /// Side of a tag, its dark frame included, m.
    pub tag: f64,
    /// The gap between two tags as a part of their side.
    pub gap: f64,
    /// The tags.
    pub family: Family,
}

/// Widths of the dark frame, in cells: Kalibr's tags have two, others one.
const FRAMES: [usize; 2] = [2, 1];
/// The window in which a corner is placed: as a part of the tag's side, px at least, and at most as a part of the gap.
const WINDOW: (f64, f64, f64) = (0.15, 2.0, 0.7);
/// Where the squares around a corner are looked at, as a part of the gap: in the middle of the small dark ones.
const AROUND: f64 = 0.4;
/// A tag that is farther than this part of its side from where all tags together put it is another board's.
const ASTRAY: f64 = 0.6;
/// So many pairs of neighbouring edges must tell a gap: two tags side by side have two.
const PAIRS: usize = 8;
/// A gap that differs by less than this part of a tag is the one that is said: lenses bend what pairs tell by up to 0.006 of it
/// (drawn, `k1` of -0.4 and a fisheye).
const APART: f64 = 0.02;

impl TagGrid {
    /// Returns the grid, if it is one that can be looked for; `tag` in m, `gap` as a part of it.
    ///
    /// # Errors
    ///
    /// [`BadBoard`].
    pub fn new(
        columns: usize,
        rows: usize,
        tag: f64,
        gap: f64,
        family: Family,
    ) -> Result<Self, BadBoard> {
        if columns.min(rows) < 1 || columns.max(rows) < 2 {
            return Err(BadBoard::TooSmall { least: 2 });
        }
        if !(tag > 0.0 && tag.is_finite() && gap > 0.0 && gap < 10.0) {
            return Err(BadBoard::Sides);
        }
        let (needed, has) = (columns * rows, family.codes.len());
        if needed > has {
            return Err(BadBoard::TooMany { needed, family: family.name, has });
        }
        Ok(Self { columns, rows, tag, gap, family })
    }

    /// The corners of a tag on the board, m, in the order of [`Tag::corners`] if all tags are printed turned clockwise by so many
    /// quarters; y is up.
    fn on_board(&self, number: usize, turn: usize) -> [Vector2<f64>; 4] {
        let pitch = self.tag * (1.0 + self.gap);
        let (x, y) =
            ((number % self.columns) as f64 * pitch, (number / self.columns) as f64 * pitch);
        let side = self.tag;
        let mut corners =
            [[x, y + side], [x + side, y + side], [x + side, y], [x, y]].map(Vector2::from);
        corners.rotate_left(turn % 4);
        corners
    }

    /// Returns whether the grid is bright at a place, m from the bottom left corner of its first tag, y up; for printing it as
    /// Kalibr does.
    #[must_use]
    pub fn is_bright(&self, x: f64, y: f64) -> bool {
        let pitch = self.tag * (1.0 + self.gap);
        let (column, row) = ((x / pitch).floor(), (y / pitch).floor());
        let (u, v) = (x - column * pitch, y - row * pitch);
        let between = (u >= self.tag, v >= self.tag);
        let (first, last) = (-1.0, (self.columns as f64, self.rows as f64));
        if between == (true, true) {
            // The small dark squares, also around the outer tags.
            return !((first..last.0).contains(&column) && (first..last.1).contains(&row));
        }
        let inside = (0.0..last.0).contains(&column) && (0.0..last.1).contains(&row);
        if between != (false, false) || !inside {
            return true;
        }
        let number = row as usize * self.columns + column as usize;
        let cells = (self.family.side + 2 * FRAMES[0]) as f64;
        let frame = FRAMES[0] as f64;
        let (c, r) = ((u / self.tag * cells).floor(), ((1.0 - v / self.tag) * cells).floor());
        let inner = |at: f64| (frame..cells - frame).contains(&at);
        // Upside down.
        let from_end = |at: f64| (cells - frame - 1.0 - at) as usize;
        inner(c) && inner(r) && self.family.is_bright(number, from_end(c), from_end(r))
    }

    /// Returns the gap that pictures show where it is clearly not this grid's: of the two edges of a tag and those of its neighbour
    /// four corners lie on a line, and their cross-ratio is what no camera changes.
    ///
    /// `found` are points that this grid found, a picture each.
    #[must_use]
    pub fn other_gap<'a>(&self, found: impl IntoIterator<Item = &'a Found>) -> Option<f64> {
        let mut gaps: Vec<f64> = found.into_iter().flat_map(|found| self.gaps(found)).collect();
        if gaps.len() < PAIRS {
            return None;
        }
        let gap = median(&mut gaps);
        let mut off: Vec<f64> = gaps.iter().map(|other| (other - gap).abs()).collect();
        // Of a median, and neighbouring pairs share corners: five times what is far beyond chance.
        let unsure = 5.0 * 2.0 * median(&mut off) / (gaps.len() as f64).sqrt();
        ((gap - self.gap).abs() > unsure.max(APART)).then_some(gap)
    }

    /// The gaps that pairs of neighbouring tags show in one picture, as parts of their side.
    fn gaps(&self, found: &Found) -> Vec<f64> {
        let corners: BTreeMap<(i32, i32), Vector2<f64>> = found
            .iter()
            .map(|(point, pixel)| (self.corner(point), Vector2::new(pixel.u, pixel.v)))
            .collect();
        let four = |(x, y): (i32, i32), is_along: bool| {
            let at = |k: i32| corners.get(&if is_along { (x + k, y) } else { (x, y + k) }).copied();
            gap_of([at(0)?, at(1)?, at(2)?, at(3)?])
        };
        let firsts = corners.keys().flat_map(|&(x, y)| {
            let along = (x % 2 == 0).then(|| four((x, y), true)).flatten();
            let across = (y % 2 == 0).then(|| four((x, y), false)).flatten();
            along.into_iter().chain(across)
        });
        firsts.collect()
    }

    /// Which corner of the grid a point is: twice its tag's column and row, and one more on the tag's right and its upper side.
    fn corner(&self, point: &Point<frame::World>) -> (i32, i32) {
        let pitch = self.tag * (1.0 + self.gap);
        let of = |x: f64| {
            let number = ((x + 0.5 * self.gap * self.tag) / pitch).floor();
            2 * number as i32 + i32::from(x - number * pitch > 0.5 * self.tag)
        };
        (of(point.coords().x), of(point.coords().y))
    }

    /// Returns the same points of a grid with another gap.
    #[must_use]
    pub fn spaced(&self, gap: f64, found: &Found) -> Found {
        let more = self.tag * (gap - self.gap);
        let moved = |(point, pixel): &(Point<frame::World>, Pixel)| {
            let (column, row) = self.corner(point);
            let by = |of: i32| f64::from(of.div_euclid(2)) * more;
            let at = point.coords();
            (Point::new(at.x + by(column), at.y + by(row), at.z), *pixel)
        };
        found.iter().map(moved).collect()
    }

    /// Finds the corners of the tags that are seen.
    ///
    /// # Errors
    ///
    /// [`NotFound`].
    pub fn find(&self, image: &RgbImage) -> Result<Found, NotFound> {
        let grey = Plane::grey(image);
        let tags = self.family.tags(&grey, &FRAMES);
        let family = || self.family.name.to_owned();
        if tags.is_empty() {
            return Err(NotFound::NoTags { family: family() });
        }
        let has = self.columns * self.rows;
        let known: Vec<(&Tag, usize)> =
            tags.iter().filter(|tag| tag.number < has).map(|tag| (tag, tag.number)).collect();
        let turned = (0..4).filter_map(|turn| {
            Some((turn, consistent(&known, &|number| self.on_board(number, turn), ASTRAY)?))
        });
        let (turn, kept) = turned
            .max_by_key(|(_, kept)| kept.len())
            .ok_or_else(|| NotFound::OtherBoard { family: family() })?;
        let mut found = Vec::new();
        for &at in &kept {
            let (tag, number) = known[at];
            let map = square_to(&tag.corners);
            // Steps out of the tag at its top left corner, and on clockwise.
            let steps = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            let units = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
            for (i, (corner, place)) in
                tag.corners.iter().zip(self.on_board(number, turn)).enumerate()
            {
                let side = (tag.corners[1] - tag.corners[0]).norm();
                let radius = (WINDOW.0 * side).min(WINDOW.2 * self.gap * side).max(WINDOW.1);
                let unit = Vector2::new(units[i].0, units[i].1);
                let beside = |(x, y): (f64, f64)| {
                    let by = Vector2::new(x, y) * (AROUND * self.gap);
                    through(&map, &(unit + by)) - through(&map, &unit)
                };
                // Dark are the tag and the small square beyond its corner.
                let is_bright = std::array::from_fn(|k| (k + i) % 2 == 1);
                if let Some(at) = refine(&grey, *corner, radius)
                    && crosses(&grey, &steps.map(|step| at + beside(step)), is_bright)
                {
                    found.push((Point::new(place.x, place.y, 0.0), Pixel::new(at.x, at.y)));
                }
            }
        }
        if found.len() < LEAST {
            let (tags, points) = (kept.len(), found.len());
            return Err(NotFound::TooFew { tags, family: family(), points, least: LEAST });
        }
        Ok(found)
    }
}

/// The gap between two tags as a part of their side, from their edges one behind the other; `None` where they do not lie so.
fn gap_of([first, second, third, fourth]: [Vector2<f64>; 4]) -> Option<f64> {
    let along = (fourth - first).try_normalize(f64::MIN_POSITIVE)?;
    let [b, c, d] = [second, third, fourth].map(|corner| (corner - first).dot(&along));
    if !(0.0 < b && b < c && c < d) {
        return None;
    }
    // With a side of 1 the corners are at 0, 1, p and p + 1: p² / (p² - 1).
    let ratio = c * (d - b) / ((c - b) * d);
    (ratio > 1.0).then(|| (ratio / (ratio - 1.0)).sqrt() - 1.0)
}
