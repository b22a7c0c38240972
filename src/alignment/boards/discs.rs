//! Dark round regions of a picture, and where the middle of each is.
//!
//! Regions are what is darker than the places around, round those that fill their ellipse. A middle is that of the
//! ink inside an ellipse around the region, which ends half of the way to the next dark thing: of a box around a region the corners
//! hold parts of its neighbours where there is little white between them.

use image::{GrayImage, ImageBuffer, Luma};
use imageproc::region_labelling::{Connectivity, connected_components};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::alignment::picture::median;
use crate::alignment::plane::Plane;

/// The least and the most pixels of a disc, the most as a share of the picture.
const LEAST_PIXELS: usize = 12;
const MOST_SHARE: f64 = 0.05;
/// Of a round region's pixels, the share of its ellipse that they fill: one of a half-moon is less, one of a square more.
const FILLED: [f64; 2] = [0.85, 1.12];
/// The longest ellipse that a circle is seen as: tilted by 70 deg.
const LONGEST: f64 = 3.0;
/// How far beyond its ellipse a disc is measured at most, px: the blur of an edge of a sharp picture, twice. Chosen.
const MARGIN: f64 = 5.0;
/// The outer part of the margin, which is paper, and the inner part of the ellipse, which is ink. Chosen.
const PAPER: f64 = 0.5;
const CORE: f64 = 0.6;
/// Pixels of the paper within this share of the contrast of its median give the plane of its brightness.
const EVEN: f64 = 0.3;
/// So near to paper or ink, in parts of the contrast, a pixel is one or the other, and the rest noise. Chosen: five times the noise of an
/// ordinary camera before a printed board; with less the noise of all pixels between two circles moves the middle.
const NOISE: f64 = 0.1;
/// Times that the ellipse is laid around what was found: a threshold takes too little of a disc on the side where others make
/// the places around darker. Chosen: the third moves the middle by hundredths of a pixel.
const PASSES: usize = 4;

/// A dark round region.
#[derive(Debug, Clone, Copy)]
pub(super) struct Disc {
    /// Its middle, px.
    pub(super) middle: Vector2<f64>,
    /// Its area, px².
    pub(super) area: f64,
    /// The covariance of its pixels, px².
    spread: Matrix2<f64>,
    label: u32,
}

/// The dark regions of a picture.
pub(super) struct Regions {
    labels: ImageBuffer<Luma<u32>, Vec<u32>>,
    /// Pixels of each label; 0 is what is not dark.
    counts: Vec<usize>,
    /// Those that are round, measured by their pixels.
    pub(super) round: Vec<Disc>,
}

/// A pixel at a disc.
struct At {
    /// From the disc's middle, px.
    from: Vector2<f64>,
    /// How far it is from there, 1 on the ellipse.
    share: f64,
    /// How far it is beyond the ellipse, px.
    beyond: f64,
    grey: f64,
}

/// Pictures in which what may be circles is white, by thresholds between the darkest and the brightest of places around.
pub(super) fn thresholds(grey: &Plane) -> Vec<GrayImage> {
    let blur = |part: f64| {
        let sigma = part * grey.width.max(grey.height) as f64;
        // Blurred small, since it is smooth.
        let mut small = grey.clone();
        let mut size = 1.0;
        while sigma / size > 4.0 {
            small = small.halved();
            size *= 2.0;
        }
        (small.blurred((sigma / size) as f32), size)
    };
    [0.02, 0.05]
        .into_iter()
        .map(|part| {
            let (around, size) = blur(part);
            GrayImage::from_fn(grey.width as u32, grey.height as u32, |x, y| {
                let own = grey.data[y as usize * grey.width + x as usize];
                let at = |p: u32| (f64::from(p) + 0.5) / size - 0.5;
                let mean = around.sample(at(x), at(y));
                Luma([if own < 0.85 * mean - 4.0 { 255 } else { 0 }])
            })
        })
        .collect()
}

impl Regions {
    /// Finds the regions of what is white.
    pub(super) fn of(dark: &GrayImage) -> Self {
        let (width, height) = dark.dimensions();
        let labels = connected_components(dark, Connectivity::Four, Luma([0]));
        let count = labels.pixels().map(|p| p.0[0]).max().unwrap_or(0) as usize;
        // Number of pixels, sums of x, y, xx, xy, yy, and the box around.
        let mut counts = vec![0_usize; count + 1];
        let mut sums = vec![[0.0_f64; 5]; count + 1];
        let mut boxes = vec![[u32::MAX, u32::MAX, 0, 0]; count + 1];
        for (x, y, label) in labels.enumerate_pixels() {
            let label = label.0[0] as usize;
            if label == 0 {
                continue;
            }
            counts[label] += 1;
            let (u, v) = (f64::from(x), f64::from(y));
            for (sum, value) in sums[label].iter_mut().zip([u, v, u * u, u * v, v * v]) {
                *sum += value;
            }
            let b = &mut boxes[label];
            *b = [b[0].min(x), b[1].min(y), b[2].max(x), b[3].max(y)];
        }
        let largest = MOST_SHARE * f64::from(width) * f64::from(height);
        let round = (1..=count).filter_map(|k| {
            let area = counts[k] as f64;
            // What the picture's border cuts has no middle.
            let [left, top, right, bottom] = boxes[k];
            let is_cut = left == 0 || top == 0 || right + 1 >= width || bottom + 1 >= height;
            if is_cut || counts[k] < LEAST_PIXELS || area > largest {
                return None;
            }
            let [x, y, xx, xy, yy] = sums[k].map(|sum| sum / area);
            // A pixel's own width.
            let (a, b, c) = (xx - x * x + 1.0 / 12.0, xy - x * y, yy - y * y + 1.0 / 12.0);
            let spread = Matrix2::new(a, b, b, c);
            let along = spread.symmetric_eigenvalues();
            let (long, short) = (along.max().sqrt(), along.min().max(1e-9).sqrt());
            // An ellipse's half axes are twice the deviations of its pixels.
            let filled = area / (std::f64::consts::PI * 4.0 * long * short);
            let is_round = (FILLED[0]..FILLED[1]).contains(&filled) && long < LONGEST * short;
            let (middle, label) = (Vector2::new(x, y), k as u32);
            is_round.then_some(Disc { middle, area, spread, label })
        });
        let round = round.collect();
        Self { labels, counts, round }
    }

    /// Measures a disc by how dark its pixels are between its own ink and the paper around it; `None` where it is no darker.
    pub(super) fn measured(&self, grey: &Plane, disc: &Disc) -> Option<Disc> {
        let mut found = *disc;
        for _ in 0..PASSES {
            let inverse = found.spread.try_inverse()?;
            let margin = self.margin(&found, &inverse);
            found = inked(&found, &around(grey, &found, &inverse, margin), margin)?;
        }
        Some(found)
    }

    /// How far beyond its ellipse a disc is measured, px: half of the way to another region that is no speck.
    fn margin(&self, disc: &Disc, inverse: &Matrix2<f64>) -> f64 {
        let (width, height) = self.labels.dimensions();
        let reach = reach(disc, 2.0 * MARGIN);
        let range = |middle: f64, size: u32| {
            let last = f64::from(size) - 1.0;
            (middle - reach).clamp(0.0, last) as u32..=(middle + reach).clamp(0.0, last) as u32
        };
        let mut nearest = 2.0 * MARGIN;
        for y in range(disc.middle.y, height) {
            for x in range(disc.middle.x, width) {
                let label = self.labels.get_pixel(x, y).0[0];
                let is_other = label != 0 && label != disc.label;
                if is_other && self.counts[label as usize] >= LEAST_PIXELS {
                    let from = Vector2::new(f64::from(x), f64::from(y)) - disc.middle;
                    nearest = nearest.min(beyond(&from, share(inverse, &from)));
                }
            }
        }
        0.5 * nearest
    }
}

/// How far from its middle a disc and so much beyond it reach, px.
fn reach(disc: &Disc, margin: f64) -> f64 {
    2.0 * disc.spread.symmetric_eigenvalues().max().sqrt() + margin
}

/// How far a place is from an ellipse's middle, 1 on the ellipse.
fn share(inverse: &Matrix2<f64>, from: &Vector2<f64>) -> f64 {
    0.5 * from.dot(&(inverse * from)).sqrt()
}

/// How far a place is beyond an ellipse on the line from its middle, px; less than 0 inside.
fn beyond(from: &Vector2<f64>, share: f64) -> f64 {
    if share > 0.0 { from.norm() * (1.0 - 1.0 / share) } else { f64::NEG_INFINITY }
}

/// The pixels of a disc and of its margin.
fn around(grey: &Plane, disc: &Disc, inverse: &Matrix2<f64>, margin: f64) -> Vec<At> {
    let reach = reach(disc, margin);
    let range = |middle: f64| (middle - reach).floor() as i64..=(middle + reach).ceil() as i64;
    let at = |x: i64, y: i64| {
        let from = Vector2::new(x as f64, y as f64) - disc.middle;
        let share = share(inverse, &from);
        At { from, share, beyond: beyond(&from, share), grey: f64::from(grey.at(x, y)) }
    };
    range(disc.middle.y)
        .flat_map(|y| range(disc.middle.x).map(move |x| (x, y)))
        .map(|(x, y)| at(x, y))
        .filter(|at| at.beyond <= margin)
        .collect()
}

/// The disc by its ink: inside a pixel is all ink, beyond none, and at the edge the part of the contrast that it is darker by.
fn inked(disc: &Disc, around: &[At], margin: f64) -> Option<Disc> {
    let greys = |is_in: &dyn Fn(&At) -> bool| -> Vec<f64> {
        around.iter().filter(|at| is_in(at)).map(|at| at.grey).collect()
    };
    let ink = median(&mut greys(&|at| at.share < CORE));
    let is_paper = |at: &At| at.beyond > PAPER * margin;
    let paper = median(&mut greys(&is_paper));
    let contrast = paper - ink;
    if contrast <= 0.0 {
        return None;
    }
    // The paper's brightness as a plane, so that a gradient of light does not pull the middle.
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for at in around.iter().filter(|at| is_paper(at) && (at.grey - paper).abs() < EVEN * contrast) {
        let row = Vector3::new(1.0, at.from.x, at.from.y);
        normal += row * row.transpose();
        right += row * at.grey;
    }
    let level = normal.try_inverse()? * right;
    let (mut area, mut first, mut second) = (0.0, Vector2::zeros(), Matrix2::zeros());
    for at in around {
        let level = level.x + level.y * at.from.x + level.z * at.from.y;
        let dark = ((level - at.grey) / (level - ink)).clamp(NOISE, 1.0 - NOISE);
        let share = (dark - NOISE) / (1.0 - 2.0 * NOISE);
        area += share;
        first += at.from * share;
        second += at.from * at.from.transpose() * share;
    }
    let off = first / area;
    let (middle, spread) = (disc.middle + off, second / area - off * off.transpose());
    // What has no ink gives no middle, and a level as dark as the ink no number.
    let is_found = area > 0.0 && middle.iter().chain(spread.iter()).all(|x| x.is_finite());
    is_found.then_some(Disc { middle, area, spread, ..*disc })
}
