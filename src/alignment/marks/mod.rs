//! The table's printed dots: where they are in a picture, to a fraction of a pixel, and which is which.
//!
//! In comes a picture and a rough guess of the camera; out come pairs (mark, pixel) for the regressions.
//! Dark blobs are found against their surroundings, judged by their shape, and matched to the scene's
//! marks by consensus: a similarity explains the guess's error first, then a homography. A dot that is
//! half hidden, or a dark thing that is no dot, is left out rather than guessed.
//!
//! A circle's centre is not the centre of its picture. [`find_marks`] returns the projected *centre*: the
//! difference is predicted from the homography and taken off.
//!
//! Source: Heikkilä, "Geometric camera calibration using circular control points", PAMI 2000 (the bias);
//! Hartley and Zisserman, *Multiple View Geometry*, 2004, §4.1 (the homography).

mod blobs;
mod consensus;

use image::RgbImage;
use nalgebra::{Matrix3, Vector2};

use super::vision::Error;
use crate::world::{Camera, Mark, Pixel, Point, Scene};
use blobs::{dark_blobs, grey};
pub(super) use consensus::fit_homography;
use consensus::{consensus, through};

pub use super::ball::{BallSighting, find_marker_ball};

/// One mark of the scene, seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkSighting {
    /// Which of the scene's marks.
    pub mark_idx: usize,
    /// Where its centre is in the picture, px, as the lens shows it (not undistorted).
    pub pixel: Pixel,
    /// Standard deviation of each coordinate, px.
    pub sigma: f64,
}

/// A homography has eight unknowns; five dots leave two numbers to contradict it.
pub const NEEDED: usize = 5;

/// Corners of the polygon that stands for a dot's rim: the area it lacks, 0.16 %, is the same all round and moves no
/// centre.
const CORNERS: usize = 64;

/// Finds the scene's printed dots in a picture.
///
/// `guess` may be off by some ten pixels everywhere; dots may be hidden. The sightings come in the order of
/// the scene's marks.
///
/// # Errors
///
/// [`Error::WrongSize`] when the picture is not the guess's size, [`Error::NoMarks`] when the scene has
/// fewer than five marks, [`Error::TooFewMarks`] when fewer than five are seen where one homography
/// puts them.
pub fn find_marks(
    image: &RgbImage,
    scene: &Scene,
    guess: &Camera,
) -> Result<Vec<MarkSighting>, Error> {
    let size = (guess.intrinsics.width, guess.intrinsics.height);
    if image.dimensions() != size {
        return Err(Error::WrongSize { image: image.dimensions(), camera: size });
    }
    if scene.marks.len() < NEEDED {
        return Err(Error::NoMarks { marks: scene.marks.len(), needed: NEEDED });
    }
    let expected: Vec<(usize, Pixel, f64)> = scene
        .marks
        .iter()
        .enumerate()
        .filter_map(|(idx, mark)| {
            let (pixel, depth) = guess.project_with_depth(Point::new(mark.x, mark.y, 0.0))?;
            Some((idx, pixel, guess.intrinsics.fx.abs() * mark.radius / depth))
        })
        .collect();
    let largest = expected.iter().map(|e| e.2).fold(1.0, f64::max);
    let smallest = expected.iter().map(|e| e.2).fold(f64::INFINITY, f64::min);
    let blobs = dark_blobs(&grey(image), smallest, largest);
    let pairs = consensus(&scene.marks, &expected, &blobs);
    if pairs.len() < NEEDED {
        return Err(Error::TooFewMarks {
            found: pairs.len(),
            needed: NEEDED,
            dots: blobs.len(),
            marks: scene.marks.len(),
        });
    }
    let places: Vec<(Vector2<f64>, Vector2<f64>)> = pairs
        .iter()
        .map(|&(idx, blob)| (plane_point(&scene.marks[idx]), blobs[blob].centre))
        .collect();
    let homography = fit_homography(&places).ok_or(Error::TooFewMarks {
        found: pairs.len(),
        needed: NEEDED,
        dots: blobs.len(),
        marks: scene.marks.len(),
    })?;
    let mut sightings: Vec<MarkSighting> = pairs
        .iter()
        .map(|&(idx, blob)| {
            let blob = &blobs[blob];
            let bias = circle_bias(&homography, &scene.marks[idx]);
            let at = blob.centre - bias;
            MarkSighting { mark_idx: idx, pixel: Pixel::new(at.x, at.y), sigma: blob.sigma }
        })
        .collect();
    sightings.sort_by_key(|sighting| sighting.mark_idx);
    Ok(sightings)
}

fn plane_point(mark: &Mark) -> Vector2<f64> {
    Vector2::new(mark.x, mark.y)
}

/// Returns the centroid of a mark's picture minus the picture of its centre, px.
fn circle_bias(h: &Matrix3<f64>, mark: &Mark) -> Vector2<f64> {
    const N: usize = CORNERS;
    let centre = through(h, plane_point(mark));
    let ring: Vec<Vector2<f64>> = (0..N)
        .map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / N as f64).sin_cos();
            through(h, plane_point(mark) + mark.radius * Vector2::new(cos, sin)) - centre
        })
        .collect();
    let (mut area, mut first) = (0.0, Vector2::zeros());
    for i in 0..N {
        let (p, q) = (ring[i], ring[(i + 1) % N]);
        let cross = p.x * q.y - p.y * q.x;
        area += cross;
        first += (p + q) * cross;
    }
    if area.abs() < 1e-9 { Vector2::zeros() } else { first / (3.0 * area) }
}
