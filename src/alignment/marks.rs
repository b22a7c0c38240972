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

#![expect(clippy::cast_possible_wrap, reason = "a picture has far fewer than 2^63 pixels")]

use image::RgbImage;
use nalgebra::{DMatrix, Matrix3, Vector2, Vector3};

use super::picture::GREY;
use super::vision::Error;
use crate::world::{Camera, Mark, Pixel, Point, Scene};

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

/// Largest error of the guess that is searched, px. Chosen: a camera at 1 m with 900 px that is turned by 8 deg or
/// stands 14 cm beside its place. With half of it a camera that was knocked is not found again, with twice as much
/// the dots of a table, 18 cm and 150 px apart in the kitchen, are taken for each other.
const REACH_PX: f64 = 130.0;
/// How far a dot may be from its place once a homography is fitted, px: what a lens may add. Chosen: `k1` of -0.08
/// moves a point half way to the corner of a picture of 1280 px by 5 px, of which a homography takes up most. With
/// half of it dots of the corners are left out, with twice as much a dark thing beside a hidden dot passes for it.
const CLOSE_PX: f64 = 4.0;
/// A homography has eight unknowns; five dots leave two numbers to contradict it.
const NEEDED: usize = 5;

/// A pixel is dark when it is below this share of the mean of its surroundings, and by so many grey levels of 255.
/// Chosen: at a share of 0.9 the soft shadow of a thing is dark as well, at 0.6 a dot of grey ink is not; half of the
/// levels is noise in a dim room, twice as many hide dots in it.
const DARK: (f64, f64) = (0.8, 8.0);
/// Half of the window of that mean, in radii of the largest dot, and pixels beyond: a window of about three dots, in
/// which the paper around a dot outweighs it ten to one (36 to π squares of the radius).
const WINDOW: (f64, usize) = (3.0, 3);
/// Least and largest area of a dot's picture, in squares of the smallest and the largest expected radius (a circle
/// has π), and the least in px: the guess may be 40 % wrong in distance, and a tilt of 75° foreshortens: at least π ·
/// cos 75° / 1.4² = 0.41, at most π / 0.6² = 8.7, with room for what is counted as dark. Below 6 px there is no shape
/// to judge.
const LEAST_AREA: (f64, f64) = (0.25, 6.0);
const MOST_AREA: f64 = 12.0;
/// What pixels add to a second moment: the variance of a square of side 1, 1/12.
const PIXEL: f64 = 1.0 / 12.0;
/// What an axis is not thinner than, px², so that a line of pixels is no division by nothing.
const THIN: f64 = 0.01;
/// The narrowest ellipse, as a ratio of its axes and in px of its half: cos 75° = 0.26 less the rounding of small
/// dots. Chosen: with half of it edges of shadows are dots, with twice as much dots of a flat view are lost.
const NARROW: (f64, f64) = (0.22, 1.2);
/// Area over that of the ellipse of the same moments: 1 for an ellipse, 0.955 for a rectangle, 3/π. A rectangle
/// passes and is refused by consensus; a crescent or two dots in one do not. Chosen: pixels of a small dot leave some
/// per cent.
const FILL: std::ops::RangeInclusive<f64> = 0.88..=1.12;
/// How far from the middle the ground is looked at, in long half axes and px beyond: past the ring below.
const REACH: (f64, i64) = (1.9, 2);
/// The core whose median is the ink, as a share of the radius, and the ring whose median is the paper, px outside the
/// edge. Chosen: the edge of a dot is blurred over some 2 px either way; half of the gap has blur in the ring, twice
/// of it the next thing.
const CORE: f64 = 0.6;
const RING_PX: [f64; 2] = [2.5, 5.5];
/// Fewest pixels of core and ring for a median that one pixel does not decide.
const FEWEST: [usize; 2] = [4, 12];
/// A pixel of the ring is dark when it is this share of the contrast below the paper; more than this share of dark
/// ones, and the dot touches something, so that its centre cannot be trusted. Chosen: 0.06 is 22° of the ring; with
/// half of it dust refuses a dot, with twice as much a dot at a thing's foot is taken.
const DARK_RING: (f64, f64) = (0.35, 0.06);
/// Least contrast, grey levels. Chosen: twice what makes a pixel dark; at half of it noise has contrast, twice as
/// much is not there in a dim room.
const CONTRAST: f64 = 15.0;
/// Pixels of the ring within this share of the contrast of the paper give the plane of its brightness.
const PAPER: f64 = 0.3;
/// Past two pixels outside the ellipse there is nothing but paper and noise, px.
const OUTSIDE_PX: f64 = 2.2;
/// How far a pixel's share of ink may be outside of 0 to 1: noise, which would be biased if it were cut at once.
const SHARE: [f64; 2] = [-0.2, 1.2];
/// Least sum of the shares of ink, of the area: less is no dark disc but a dark rim.
const INKED: f64 = 0.5;
/// What is not modelled of a centre, px: print and paper. Chosen: with half of it the fit of the lens believes dots
/// to 0.015 px, finer than a printer's dot (600 a inch are 0.04 mm, 0.04 px in the kitchen); with twice as much it is
/// not told from the noise of an ordinary camera.
const FLOOR_PX: f64 = 0.03;
/// Radius of a blob over that expected. A guess that is 40 % wrong in distance, and a tilt of 75°, whose root is in the
/// geometric mean of the axes: √(cos 75°) / 1.4 = 0.36, and 1 / 0.6 = 1.67.
const RATIO: std::ops::Range<f64> = 0.35..1.7;
/// Dots nearer together than this do not give a similarity, px: a centre that is 1 px off would turn it by 0.4°.
/// Chosen: with half of it the noise of a dot decides the turn, with twice as much a table that is small in the
/// picture has no pairs.
const SPAN_PX: f64 = 150.0;
/// How much a similarity may scale and turn the guess, rad: a distance wrong by a third, a camera rolled by 17°.
/// Chosen: twice as much lets a grid of dots match itself rotated, half of it is a camera that was not touched.
const SCALE: std::ops::Range<f64> = 0.75..1.33;
const ROLL: f64 = 0.3;
/// How far a dot may be from its place under a similarity, px, and then under maps with more freedom, each from the
/// pairs of the last: affine twice, then a homography. Chosen: falling from what perspective adds to a similarity to
/// [`CLOSE_PX`], each step by less than a half, so that no right dot is lost on the way; the same at half of them
/// loses dots of a tilted guess, at twice of them takes neighbours.
const SIMILAR_PX: f64 = 18.0;
const CLOSER: [(f64, bool); 5] =
    [(16.0, true), (10.0, true), (8.0, false), (CLOSE_PX, false), (CLOSE_PX, false)];
/// What pixels are divided by for the equations of an affine map, so that its columns are of like size. Any of this
/// order would do.
const CENTI: f64 = 100.0;
/// Ratio of singular values below which points do not determine a homography: far above rounding (1e-16), far below
/// the 1e-2 or so of points that are spread.
const SINGULAR: f64 = 1e-6;
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

/// A grey picture, row by row.
struct Grey {
    width: usize,
    height: usize,
    data: Vec<f64>,
    /// Sums over all pixels up and left, one wider and higher than the picture.
    sums: Vec<f64>,
}

fn grey(image: &RgbImage) -> Grey {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let data: Vec<f64> = image
        .pixels()
        .map(|p| {
            GREY[0] * f64::from(p.0[0]) + GREY[1] * f64::from(p.0[1]) + GREY[2] * f64::from(p.0[2])
        })
        .collect();
    let mut sums = vec![0.0; (width + 1) * (height + 1)];
    for y in 0..height {
        let mut row = 0.0;
        for x in 0..width {
            row += data[y * width + x];
            sums[(y + 1) * (width + 1) + x + 1] = sums[y * (width + 1) + x + 1] + row;
        }
    }
    Grey { width, height, data, sums }
}

impl Grey {
    fn mean(&self, x: usize, y: usize, half: usize) -> f64 {
        let (x0, y0) = (x.saturating_sub(half), y.saturating_sub(half));
        let (x1, y1) = ((x + half + 1).min(self.width), (y + half + 1).min(self.height));
        let w = self.width + 1;
        let sum = self.sums[y1 * w + x1] - self.sums[y0 * w + x1] - self.sums[y1 * w + x0]
            + self.sums[y0 * w + x0];
        sum / ((x1 - x0) * (y1 - y0)) as f64
    }
}

/// A dark ellipse.
#[derive(Debug, Clone, Copy)]
struct Blob {
    centre: Vector2<f64>,
    /// Geometric mean of the semi-axes, px.
    radius: f64,
    sigma: f64,
}

/// Finds dark, filled, elliptic blobs with a bright border all round.
fn dark_blobs(grey: &Grey, smallest: f64, largest: f64) -> Vec<Blob> {
    let (w, h) = (grey.width, grey.height);
    let half = (WINDOW.0 * largest).ceil() as usize + WINDOW.1;
    let dark: Vec<bool> = (0..w * h)
        .map(|at| {
            let mean = grey.mean(at % w, at / w, half);
            grey.data[at] < DARK.0 * mean - DARK.1
        })
        .collect();
    let least = (LEAST_AREA.0 * smallest * smallest).max(LEAST_AREA.1);
    let most = MOST_AREA * largest * largest;
    let mut seen = vec![false; w * h];
    let mut blobs = Vec::new();
    let mut stack = Vec::new();
    let mut region: Vec<usize> = Vec::new();
    for start in 0..w * h {
        if seen[start] || !dark[start] {
            continue;
        }
        region.clear();
        stack.push(start);
        seen[start] = true;
        let mut touches = false;
        while let Some(at) = stack.pop() {
            region.push(at);
            let (x, y) = (at % w, at / w);
            if x < 2 || y < 2 || x + 3 > w || y + 3 > h {
                touches = true;
                continue;
            }
            for next in [at - 1, at + 1, at - w, at + w] {
                if dark[next] && !seen[next] {
                    seen[next] = true;
                    stack.push(next);
                }
            }
        }
        let area = region.len() as f64;
        if !touches && area >= least && area <= most {
            blobs.extend(measure(grey, &region));
        }
    }
    blobs
}

/// Judges one dark region; `None` when it is no whole ellipse on a brighter ground.
fn measure(grey: &Grey, region: &[usize]) -> Option<Blob> {
    let w = grey.width;
    let area = region.len() as f64;
    let (mut mean, mut second) = (Vector2::zeros(), nalgebra::Matrix2::zeros());
    for &at in region {
        mean += Vector2::new((at % w) as f64, (at / w) as f64);
    }
    mean /= area;
    for &at in region {
        let d = Vector2::new((at % w) as f64, (at / w) as f64) - mean;
        second += d * d.transpose();
    }
    second /= area;
    let eigen = second.symmetric_eigen();
    let (big, small) = (eigen.eigenvalues.max(), eigen.eigenvalues.min());
    // For a filled ellipse the moments are a²/4 and b²/4, and the pixels' own size.
    let (a, b) = (2.0 * (big - PIXEL).max(THIN).sqrt(), 2.0 * (small - PIXEL).max(THIN).sqrt());
    let fill = area / (std::f64::consts::PI * a * b);
    if b < NARROW.0 * a || b < NARROW.1 || !FILL.contains(&fill) {
        return None;
    }
    // The ground and the ink, from a ring outside and from the core.
    let inverse = second.try_inverse()?;
    let reach = (REACH.0 * a).ceil() as i64 + REACH.1;
    let (cx, cy) = (mean.x.round() as i64, mean.y.round() as i64);
    let (mut ring, mut core) = (Vec::new(), Vec::new());
    let inside = |x: i64, y: i64| x >= 0 && y >= 0 && x < w as i64 && y < grey.height as i64;
    for y in cy - reach..=cy + reach {
        for x in cx - reach..=cx + reach {
            if !inside(x, y) {
                continue;
            }
            let d = Vector2::new(x as f64, y as f64) - mean;
            let radius = 0.5 * (d.transpose() * inverse * d)[0].sqrt();
            let value = grey.data[y as usize * w + x as usize];
            if radius < CORE {
                core.push(value);
            } else if radius * b > b + RING_PX[0] && radius * b < b + RING_PX[1] {
                ring.push((value, d));
            }
        }
    }
    if core.len() < FEWEST[0] || ring.len() < FEWEST[1] {
        return None;
    }
    let ink = super::picture::median(&mut core);
    let mut values: Vec<f64> = ring.iter().map(|r| r.0).collect();
    let paper = super::picture::median(&mut values);
    let contrast = paper - ink;
    let dark_border = ring.iter().filter(|r| r.0 < paper - DARK_RING.0 * contrast).count() as f64;
    if contrast < CONTRAST || dark_border > DARK_RING.1 * ring.len() as f64 {
        return None;
    }
    let noise = super::picture::ROBUST * {
        let mut deviations: Vec<f64> = ring.iter().map(|r| (r.0 - paper).abs()).collect();
        super::picture::median(&mut deviations)
    };
    // The paper's brightness as a plane, so that a gradient of light does not pull the centre.
    let ground = {
        let rows = ring.iter().filter(|r| (r.0 - paper).abs() < PAPER * contrast);
        let (mut normal, mut rhs) = (Matrix3::zeros(), Vector3::zeros());
        for (value, d) in rows {
            let row = Vector3::new(1.0, d.x, d.y);
            normal += row * row.transpose();
            rhs += row * *value;
        }
        normal.try_inverse()? * rhs
    };
    let (mut weight, mut first) = (0.0, Vector2::zeros());
    for y in cy - reach..=cy + reach {
        for x in cx - reach..=cx + reach {
            if !inside(x, y) {
                continue;
            }
            let d = Vector2::new(x as f64, y as f64) - mean;
            let radius = 0.5 * (d.transpose() * inverse * d)[0].sqrt();
            if radius * b < b + OUTSIDE_PX {
                let value = grey.data[y as usize * w + x as usize];
                let level = ground.x + ground.y * d.x + ground.z * d.y;
                let share = ((level - value) / (level - ink).max(1.0)).clamp(SHARE[0], SHARE[1]);
                weight += share;
                first += share * d;
            }
        }
    }
    if weight < INKED * area {
        return None;
    }
    // The centroid's noise: each pixel moves it by its lever over the area; a floor for what is not modelled.
    let spread = (noise / contrast) * (a * a / 4.0 / area).sqrt();
    Some(Blob {
        centre: mean + first / weight,
        radius: (a * b).sqrt(),
        sigma: (spread * spread + FLOOR_PX * FLOOR_PX).sqrt(),
    })
}

/// Returns pairs (mark index, blob index) that one homography explains; empty when nothing fits.
fn consensus(
    marks: &[Mark],
    expected: &[(usize, Pixel, f64)],
    blobs: &[Blob],
) -> Vec<(usize, usize)> {
    let at = |p: Pixel| Vector2::new(p.u, p.v);
    let near: Vec<Vec<usize>> = expected
        .iter()
        .map(|&(_, pixel, radius)| {
            (0..blobs.len())
                .filter(|&b| {
                    let ratio = blobs[b].radius / radius;
                    (blobs[b].centre - at(pixel)).norm() < REACH_PX && RATIO.contains(&ratio)
                })
                .collect()
        })
        .collect();
    // Every pair of pairs gives a similarity near the identity; the one that brings most dots close wins.
    let mut best: (usize, f64, Vec<(usize, usize)>) = (0, f64::INFINITY, Vec::new());
    for i in 0..expected.len() {
        for j in i + 1..expected.len() {
            let (pi, pj) = (at(expected[i].1), at(expected[j].1));
            let span = pj - pi;
            if span.norm() < SPAN_PX {
                continue;
            }
            for &bi in &near[i] {
                for &bj in &near[j] {
                    let seen = blobs[bj].centre - blobs[bi].centre;
                    let scale = seen.norm() / span.norm();
                    let turn = (span.x * seen.y - span.y * seen.x).atan2(span.dot(&seen));
                    if bi == bj || !SCALE.contains(&scale) || turn.abs() > ROLL {
                        continue;
                    }
                    let rotation = nalgebra::Rotation2::new(turn);
                    let map = |p: Vector2<f64>| blobs[bi].centre + rotation * (p - pi) * scale;
                    let (pairs, cost) = assign(
                        expected.len(),
                        SIMILAR_PX,
                        |k| map(at(expected[k].1)),
                        &near,
                        blobs,
                    );
                    if pairs.len() > best.0 || (pairs.len() == best.0 && cost < best.1) {
                        best = (pairs.len(), cost, pairs);
                    }
                }
            }
        }
    }
    // Then maps with more freedom and less tolerance, each from the last one's pairs.
    let mut pairs = best.2;
    for (tolerance, affine) in CLOSER {
        let places: Vec<(Vector2<f64>, Vector2<f64>)> = pairs
            .iter()
            .map(|&(k, b)| (plane_point(&marks[expected[k].0]), blobs[b].centre))
            .collect();
        let guess: Vec<(Vector2<f64>, Vector2<f64>)> =
            pairs.iter().map(|&(k, b)| (at(expected[k].1), blobs[b].centre)).collect();
        let (next, _) = if affine {
            let Some(map) = fit_affine(&guess) else { return Vec::new() };
            assign(expected.len(), tolerance, |k| map(at(expected[k].1)), &near, blobs)
        } else {
            let Some(h) = fit_homography(&places) else { return Vec::new() };
            assign(
                expected.len(),
                tolerance,
                |k| through(&h, plane_point(&marks[expected[k].0])),
                &near,
                blobs,
            )
        };
        pairs = next;
    }
    pairs.into_iter().map(|(k, b)| (expected[k].0, b)).collect()
}

/// Pairs each expected place with the nearest blob within `tolerance` px, each blob once; and the cost.
fn assign(
    n: usize,
    tolerance: f64,
    place: impl Fn(usize) -> Vector2<f64>,
    near: &[Vec<usize>],
    blobs: &[Blob],
) -> (Vec<(usize, usize)>, f64) {
    let mut offers: Vec<(f64, usize, usize)> = Vec::new();
    for (k, near) in near.iter().enumerate().take(n) {
        let p = place(k);
        for &b in near {
            let distance = (blobs[b].centre - p).norm();
            if distance < tolerance {
                offers.push((distance, k, b));
            }
        }
    }
    offers.sort_by(|x, y| x.0.total_cmp(&y.0));
    let (mut pairs, mut cost) = (Vec::<(usize, usize)>::new(), 0.0);
    for (distance, k, b) in offers {
        if pairs.iter().all(|&(pk, pb)| pk != k && pb != b) {
            pairs.push((k, b));
            cost += distance * distance;
        }
    }
    (pairs, cost)
}

/// Fits `v = A u + b` by least squares, `None` with fewer than three pairs or pairs on one line.
fn fit_affine(
    pairs: &[(Vector2<f64>, Vector2<f64>)],
) -> Option<impl Fn(Vector2<f64>) -> Vector2<f64> + use<>> {
    if pairs.len() < 3 {
        return None;
    }
    let (mut normal, mut rhs) = (Matrix3::zeros(), nalgebra::Matrix3x2::zeros());
    for (u, v) in pairs {
        let row = Vector3::new(u.x / CENTI, u.y / CENTI, 1.0);
        normal += row * row.transpose();
        rhs += row * v.transpose();
    }
    let solution = normal.try_inverse()? * rhs;
    Some(move |u: Vector2<f64>| {
        (Vector3::new(u.x / CENTI, u.y / CENTI, 1.0).transpose() * solution).transpose()
    })
}

/// Fits the homography of at least four pairs by the normalised direct linear transform.
pub(super) fn fit_homography(pairs: &[(Vector2<f64>, Vector2<f64>)]) -> Option<Matrix3<f64>> {
    if pairs.len() < 4 {
        return None;
    }
    let normaliser = |points: &[Vector2<f64>]| {
        let n = points.len() as f64;
        let mean = points.iter().sum::<Vector2<f64>>() / n;
        let spread = points.iter().map(|p| (p - mean).norm()).sum::<f64>() / n;
        let s = std::f64::consts::SQRT_2 / spread.max(1e-12);
        Matrix3::new(s, 0.0, -s * mean.x, 0.0, s, -s * mean.y, 0.0, 0.0, 1.0)
    };
    let from: Vec<Vector2<f64>> = pairs.iter().map(|p| p.0).collect();
    let to: Vec<Vector2<f64>> = pairs.iter().map(|p| p.1).collect();
    let (tu, tv) = (normaliser(&from), normaliser(&to));
    let mut a = DMatrix::zeros((2 * pairs.len()).max(9), 9);
    for (i, (u, v)) in pairs.iter().enumerate() {
        let (u, v) = (through(&tu, *u), through(&tv, *v));
        let rows = [
            [-u.x, -u.y, -1.0, 0.0, 0.0, 0.0, v.x * u.x, v.x * u.y, v.x],
            [0.0, 0.0, 0.0, -u.x, -u.y, -1.0, v.y * u.x, v.y * u.y, v.y],
        ];
        for (k, row) in rows.iter().enumerate() {
            for (c, value) in row.iter().enumerate() {
                a[(2 * i + k, c)] = *value;
            }
        }
    }
    let svd = a.svd(false, true);
    let order = {
        let mut order: Vec<usize> = (0..svd.singular_values.len()).collect();
        order.sort_by(|&x, &y| svd.singular_values[x].total_cmp(&svd.singular_values[y]));
        order
    };
    // A second vanishing direction means that the points do not determine the map.
    if svd.singular_values[order[1]] < SINGULAR * svd.singular_values[order[8]] {
        return None;
    }
    let rows = svd.v_t?;
    let h = rows.row(order[0]);
    let normalised = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
    Some(tv.try_inverse()? * normalised * tu)
}

fn through(h: &Matrix3<f64>, p: Vector2<f64>) -> Vector2<f64> {
    let q = h * Vector3::new(p.x, p.y, 1.0);
    q.xy() / q.z
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
