//! Square tags with a number on them: families of codes, and the tags of a picture.
//!
//! A tag is a dark frame around a square of bright and dark cells. The codes are those of `OpenCV`'s `ArUco` dictionaries
//! and of `AprilTag`, read row by row from the tag's own top left corner, bright cells being ones.
//!
//! Source: Garrido-Jurado et al., Pattern Recognition 2014 (`ArUco`); Olson, "`AprilTag`: A robust and flexible visual
//! fiducial system", ICRA 2011.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::quads::{Quad, quads};
use crate::alignment::plane::Plane;

/// Families by name: cells along a side of the code, codes, and how many of them there are.
const FAMILIES: [(&str, usize, &str, usize); 19] = [
    ("4x4_50", 4, include_str!("dictionaries/4x4.txt"), 50),
    ("4x4_100", 4, include_str!("dictionaries/4x4.txt"), 100),
    ("4x4_250", 4, include_str!("dictionaries/4x4.txt"), 250),
    ("4x4_1000", 4, include_str!("dictionaries/4x4.txt"), 1000),
    ("5x5_50", 5, include_str!("dictionaries/5x5.txt"), 50),
    ("5x5_100", 5, include_str!("dictionaries/5x5.txt"), 100),
    ("5x5_250", 5, include_str!("dictionaries/5x5.txt"), 250),
    ("5x5_1000", 5, include_str!("dictionaries/5x5.txt"), 1000),
    ("6x6_50", 6, include_str!("dictionaries/6x6.txt"), 50),
    ("6x6_100", 6, include_str!("dictionaries/6x6.txt"), 100),
    ("6x6_250", 6, include_str!("dictionaries/6x6.txt"), 250),
    ("6x6_1000", 6, include_str!("dictionaries/6x6.txt"), 1000),
    ("7x7_50", 7, include_str!("dictionaries/7x7.txt"), 50),
    ("7x7_100", 7, include_str!("dictionaries/7x7.txt"), 100),
    ("7x7_250", 7, include_str!("dictionaries/7x7.txt"), 250),
    ("7x7_1000", 7, include_str!("dictionaries/7x7.txt"), 1000),
    ("16h5", 4, include_str!("dictionaries/16h5.txt"), 30),
    ("25h9", 5, include_str!("dictionaries/25h9.txt"), 35),
    ("36h11", 6, include_str!("dictionaries/36h11.txt"), 587),
];

/// Cells read wrongly that are put right at most. Chosen: with more, print beside the board is read as tags.
const MENDED: u32 = 2;
/// A tag's bright cells are so much brighter than its frame, grey levels. Chosen: as for an edge of the frame, thrice.
const CONTRAST: f64 = 20.0;
/// The share of a frame's cells that may be bright: a reflection, a finger.
const FRAME_WRONG: f64 = 0.15;
/// Two tags of one number nearer than this part of their side are one that was found twice.
const SAME: f64 = 0.5;

/// A family of tags.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Family {
    /// What it is called: `4x4_50`, `36h11`.
    pub name: &'static str,
    /// Cells along a side of the code.
    pub(super) side: usize,
    /// The codes by number, bright cells ones, row by row.
    pub(super) codes: Vec<u64>,
    /// Wrong cells that are put right.
    mends: u32,
}

/// A tag in a picture.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tag {
    pub(super) number: usize,
    /// The corners of its frame, px: its own top left first, clockwise.
    pub(super) corners: Quad,
    /// Bright less dark, grey levels.
    contrast: f64,
}

impl Family {
    /// Returns the family of this name; `aruco` dictionaries may be called `DICT_4X4_50` as well, tags `tag36h11`.
    pub fn named(name: &str) -> Option<Self> {
        let plain = name.to_lowercase().replace("dict_", "").replace("apriltag_", "");
        let plain = plain.trim_start_matches("tag").trim_start_matches('t');
        let (name, side, text, count) = FAMILIES.into_iter().find(|(own, ..)| *own == plain)?;
        let code = |word: &str| u64::from_str_radix(word, 16).ok();
        let codes: Vec<u64> = text.split_whitespace().filter_map(code).take(count).collect();
        let mut family = Self { name, side, codes, mends: 0 };
        family.mends = (family.distance().saturating_sub(1) / 2).min(MENDED);
        Some(family)
    }

    /// Returns the names of all families.
    pub fn names() -> Vec<&'static str> {
        FAMILIES.iter().map(|(name, ..)| *name).collect()
    }

    /// Returns whether a cell of a tag is bright; the code's first row and column are 0.
    #[must_use]
    pub fn is_bright(&self, number: usize, column: usize, row: usize) -> bool {
        let at = self.side * self.side - 1 - (row * self.side + column);
        self.codes.get(number).is_some_and(|code| code >> at & 1 == 1)
    }

    /// Returns how many cells any two tags differ in at least, however they are turned.
    fn distance(&self) -> u32 {
        let turned: Vec<[u64; 4]> = self.codes.iter().map(|code| self.turns(*code)).collect();
        let mut least = u32::MAX;
        for (i, turns) in turned.iter().enumerate() {
            // A tag must not be taken for itself turned either.
            for other in &turns[1..] {
                least = least.min((turns[0] ^ other).count_ones());
            }
            for other in &self.codes[i + 1..] {
                least = turns.iter().map(|turn| (turn ^ other).count_ones()).fold(least, u32::min);
            }
        }
        least
    }

    /// Returns a code as it is read after so many quarter turns of the tag anticlockwise.
    fn turns(&self, code: u64) -> [u64; 4] {
        let n = self.side;
        let turned = |code: u64| {
            let mut out = 0_u64;
            for row in 0..n {
                for column in 0..n {
                    // What is read at (row, column) stood at (column, n - 1 - row) before.
                    let from = n * n - 1 - (column * n + n - 1 - row);
                    out = out << 1 | (code >> from & 1);
                }
            }
            out
        };
        let first = turned(code);
        let second = turned(first);
        [code, first, second, turned(second)]
    }

    /// Returns the number of the tag that reads like this, and by how many quarter turns anticlockwise.
    fn read(&self, code: u64) -> Option<(usize, usize)> {
        let turns = self.turns(code);
        let near = self.codes.iter().enumerate().flat_map(|(number, own)| {
            // The tag was turned by as much as the reading has to be turned back.
            turns
                .iter()
                .enumerate()
                .map(move |(back, turn)| ((turn ^ own).count_ones(), number, (4 - back) % 4))
        });
        let (wrong, number, turned) = near.min_by_key(|(wrong, ..)| *wrong)?;
        (wrong <= self.mends).then_some((number, turned))
    }

    /// Finds the tags of a picture, each once. `frames` are the widths, in cells, that their dark frames may have.
    pub(super) fn tags(&self, grey: &Plane, frames: &[usize]) -> Vec<Tag> {
        let mut found: Vec<Tag> = Vec::new();
        for quad in quads(grey) {
            for &frame in frames {
                let Some(tag) = self.tag(grey, &quad, frame) else { continue };
                let side = (tag.corners[1] - tag.corners[0]).norm();
                let middle = |t: &Tag| t.corners.iter().sum::<Vector2<f64>>() / 4.0;
                let same = found.iter_mut().find(|other| {
                    other.number == tag.number
                        && (middle(other) - middle(&tag)).norm() < SAME * side
                });
                match same {
                    Some(other) if other.contrast < tag.contrast => *other = tag,
                    Some(_) => {}
                    None => found.push(tag),
                }
            }
        }
        // A number that is seen at two places says nothing about either.
        let numbers: Vec<usize> = found.iter().map(|tag| tag.number).collect();
        let is_single = |number: usize| numbers.iter().filter(|n| **n == number).count() == 1;
        found.retain(|tag| is_single(tag.number));
        found.sort_by_key(|tag| tag.number);
        found
    }

    /// Reads a quadrangle with a frame of so many cells.
    fn tag(&self, grey: &Plane, quad: &Quad, frame: usize) -> Option<Tag> {
        let cells = self.side + 2 * frame;
        let map = square_to(quad);
        let level = |column: usize, row: usize| {
            // The middle half of a cell, where its neighbours do not blur into it.
            let places = [-0.2, 0.0, 0.2];
            let mut sum = 0.0;
            for dy in places {
                for dx in places {
                    let u = (column as f64 + 0.5 + dx) / cells as f64;
                    let v = (row as f64 + 0.5 + dy) / cells as f64;
                    let p = through(&map, &Vector2::new(u, v));
                    sum += f64::from(grey.sample(p.x, p.y));
                }
            }
            sum / 9.0
        };
        let inside = |at: usize| (frame..frame + self.side).contains(&at);
        let (mut around, mut code) = (Vec::new(), Vec::new());
        for row in 0..cells {
            for column in 0..cells {
                let list = if inside(row) && inside(column) { &mut code } else { &mut around };
                list.push(level(column, row));
            }
        }
        let dark = median(&around);
        let bright = code.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let contrast = bright - dark;
        if contrast < CONTRAST {
            return None;
        }
        let is_bright = |level: f64| level > 0.5 * (bright + dark);
        let wrong = around.iter().filter(|level| is_bright(**level)).count();
        if wrong as f64 > FRAME_WRONG * around.len() as f64 {
            return None;
        }
        let read = code.iter().fold(0_u64, |code, level| code << 1 | u64::from(is_bright(*level)));
        let (number, turned) = self.read(read)?;
        let mut corners = *quad;
        // Turned anticlockwise by a quarter, the tag's top left corner is at the bottom left.
        corners.rotate_left((4 - turned) % 4);
        Some(Tag { number, corners, contrast })
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// The map of the unit square (corners (0, 0), (1, 0), (1, 1), (0, 1)) onto a quadrangle.
///
/// Source: Heckbert, "Fundamentals of texture mapping and image warping", 1989, §2.2.3.
pub(super) fn square_to(quad: &Quad) -> Matrix3<f64> {
    let [a, b, c, d] = *quad;
    let (p, q, s) = (b - c, d - c, a - b + c - d);
    let across = p.perp(&q);
    let (g, h) =
        if across == 0.0 { (0.0, 0.0) } else { (s.perp(&q) / across, p.perp(&s) / across) };
    let (e, f) = (b - a + b * g, d - a + d * h);
    Matrix3::new(e.x, f.x, a.x, e.y, f.y, a.y, g, h, 1.0)
}

/// Carries a point through a map of planes.
pub(super) fn through(map: &Matrix3<f64>, p: &Vector2<f64>) -> Vector2<f64> {
    let q = map * Vector3::new(p.x, p.y, 1.0);
    Vector2::new(q.x / q.z, q.y / q.z)
}

/// Whether dark and bright squares cross at a corner as printed: `around` are places in the four squares, `is_bright` whether
/// each is bright. What covers a corner, a finger or another sheet, is none of the board.
pub(super) fn crosses(grey: &Plane, around: &[Vector2<f64>; 4], is_bright: [bool; 4]) -> bool {
    let levels = around.map(|p| f64::from(grey.sample(p.x, p.y)));
    let side = |bright: bool| {
        let of = levels.iter().zip(is_bright).filter(move |(_, own)| *own == bright);
        of.map(|(level, _)| *level)
    };
    let dark = side(false).fold(f64::NEG_INFINITY, f64::max);
    let (low, high) =
        (side(true).fold(f64::INFINITY, f64::min), side(true).fold(f64::NEG_INFINITY, f64::max));
    // Each bright square stands out from both dark ones by more than from the other bright one.
    low - dark > CONTRAST.max(high - low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_read_however_they_are_turned_and_with_a_wrong_cell() {
        for name in Family::names() {
            let family = Family::named(name).unwrap();
            for number in [0, 7, family.codes.len() - 1] {
                for (turned, code) in family.turns(family.codes[number]).into_iter().enumerate() {
                    assert_eq!(family.read(code), Some((number, turned)), "{name} {number}");
                    if family.mends > 0 {
                        assert_eq!(family.read(code ^ 4), Some((number, turned)), "{name}");
                    }
                }
            }
        }
        assert_eq!(Family::named("DICT_4X4_50").unwrap().name, "4x4_50");
        assert_eq!(Family::named("tag36h11").unwrap().codes.len(), 587);
        assert!(Family::named("8x8_50").is_none());
    }

    #[test]
    fn a_square_is_carried_onto_a_quadrangle() {
        let quad = [[1.0, 2.0], [9.0, 1.0], [8.0, 7.0], [2.0, 6.0]].map(Vector2::from);
        let map = square_to(&quad);
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        for (corner, expected) in corners.into_iter().zip(quad) {
            assert!((through(&map, &Vector2::from(corner)) - expected).norm() < 1e-12);
        }
    }
}
