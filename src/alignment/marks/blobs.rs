//! Dark blobs of a picture that may be printed dots: against their surroundings, by their shape, each with its centre and how
//! sure that is. Which dot is which is [`super::consensus`]'s.

#![expect(clippy::cast_possible_wrap, reason = "a picture has far fewer than 2^63 pixels")]

use image::RgbImage;
use nalgebra::{Matrix3, Vector2, Vector3};

use super::super::picture::{self, GREY};

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
/// A grey picture, row by row.
pub(super) struct Grey {
    width: usize,
    height: usize,
    data: Vec<f64>,
    /// Sums over all pixels up and left, one wider and higher than the picture.
    sums: Vec<f64>,
}

pub(super) fn grey(image: &RgbImage) -> Grey {
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
pub(super) struct Blob {
    pub(super) centre: Vector2<f64>,
    /// Geometric mean of the semi-axes, px.
    pub(super) radius: f64,
    pub(super) sigma: f64,
}

/// Finds dark, filled, elliptic blobs with a bright border all round.
pub(super) fn dark_blobs(grey: &Grey, smallest: f64, largest: f64) -> Vec<Blob> {
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
    let ink = picture::median(&mut core);
    let mut values: Vec<f64> = ring.iter().map(|r| r.0).collect();
    let paper = picture::median(&mut values);
    let contrast = paper - ink;
    let dark_border = ring.iter().filter(|r| r.0 < paper - DARK_RING.0 * contrast).count() as f64;
    if contrast < CONTRAST || dark_border > DARK_RING.1 * ring.len() as f64 {
        return None;
    }
    let noise = picture::ROBUST * {
        let mut deviations: Vec<f64> = ring.iter().map(|r| (r.0 - paper).abs()).collect();
        picture::median(&mut deviations)
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
