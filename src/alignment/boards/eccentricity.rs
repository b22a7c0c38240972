//! The eccentricity of circles: how far the middle of a circle's picture is from the picture of its middle.
//!
//! What is nearer is larger: on a board tilted by `t` the middle of what is seen is off by `f (r/d)² sin t cos t`, a seventh of a
//! pixel for a radius of 11 mm at 0.6 m and a focal length of 900 px, and a lens adds to that. Circles beside each other are off alike,
//! so that a focal length from such middles is little wrong, but by more than its ±; without the part of perspective
//! alone it is more wrong than with both. So the map from the board to the picture has a lens: a homography, and two radial terms
//! about the picture's middle, fitted to the middles themselves. How large the circles are is told by their area.
//!
//! Source: Heikkilä and Silvén, "A four-step camera calibration procedure", CVPR 1997, §3 (the middle of an ellipse);
//! Heikkilä, "Geometric camera calibration using circular control points", PAMI 2000 (with a lens).

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector2};

use super::discs::Disc;
use super::tags::through;
use crate::alignment::marks::fit_homography;
use crate::alignment::picture::median;
use crate::fit::{self, Residuals};

/// Corners of the polygon that stands for a circle. Where its middle is depends on their number by less than a thousandth.
const CORNERS: usize = 64;
/// A circle that is small, in half sizes of the board: its area tells the scale of the map.
const SMALL: f64 = 1e-3;
/// A homography's numbers without the last, which is 1.
const PLANE: usize = 8;

/// A map from the board to the picture, both in half sizes about their middles.
struct Map {
    plane: Matrix3<f64>,
    /// `1 + a ρ² + b ρ⁴` times the way from the picture's middle.
    lens: [f64; 2],
}

/// Returns where the picture of each point is whose circle is seen as a disc, px: the disc's middle without its eccentricity, or,
/// where no map fits, with it. Points are on the board, m, the picture's width and height in px.
pub(super) fn without(
    points: &[Vector2<f64>],
    discs: &[Disc],
    (width, height): (usize, usize),
) -> Vec<Vector2<f64>> {
    let seen = discs.iter().map(|disc| disc.middle);
    let middle = points.iter().sum::<Vector2<f64>>() / points.len().max(1) as f64;
    let half = points.iter().map(|p| (p - middle).norm()).fold(f64::MIN_POSITIVE, f64::max);
    let board: Vec<Vector2<f64>> = points.iter().map(|p| (p - middle) / half).collect();
    let (width, height) = (width as f64, height as f64);
    let (centre, size) = (0.5 * Vector2::new(width - 1.0, height - 1.0), 0.5 * width.hypot(height));
    let picture: Vec<Vector2<f64>> = seen.clone().map(|p| (p - centre) / size).collect();
    let Some(map) = Map::fitted(&board, &picture) else { return seen.collect() };
    let scale = |(p, disc): (&Vector2<f64>, &Disc)| {
        disc.area / size.powi(2) / (map.circle(p, SMALL).0 / SMALL.powi(2))
    };
    let radius = median(&mut board.iter().zip(discs).map(scale).collect::<Vec<_>>()).sqrt();
    let off: Vec<Vector2<f64>> = board.iter().map(|p| size * map.circle(p, radius).1).collect();
    if off.iter().all(|d| d.iter().all(|along| along.is_finite())) {
        seen.zip(off).map(|(p, off)| p - off).collect()
    } else {
        seen.collect()
    }
}

impl Map {
    fn fitted(board: &[Vector2<f64>], picture: &[Vector2<f64>]) -> Option<Self> {
        let pairs: Vec<_> = board.iter().copied().zip(picture.iter().copied()).collect();
        let start = fit_homography(&pairs)?;
        let start = start / start[(2, 2)];
        let mut x: Vec<f64> = start.transpose().iter().take(PLANE).copied().collect();
        x.extend([0.0; 2]);
        let problem = Residuals::new(2 * pairs.len(), |x: &[f64], r: &mut [f64]| {
            let map = Self::of(x);
            for ((p, q), r) in pairs.iter().zip(r.chunks_exact_mut(2)) {
                r.copy_from_slice((map.shown(p) - q).as_slice());
            }
        });
        let fit = fit::solve(&problem, &x, &fit::Options::default()).ok()?;
        Some(Self::of(&fit.x))
    }

    fn of(x: &[f64]) -> Self {
        let plane = Matrix3::new(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], 1.0);
        Self { plane, lens: [x[PLANE], x[PLANE + 1]] }
    }

    fn shown(&self, p: &Vector2<f64>) -> Vector2<f64> {
        let q = through(&self.plane, p);
        let square = q.norm_squared();
        q * (1.0 + square * (self.lens[0] + square * self.lens[1]))
    }

    /// The area of a circle's picture, and how far its middle is from the picture of the circle's middle.
    fn circle(&self, middle: &Vector2<f64>, radius: f64) -> (f64, Vector2<f64>) {
        let centre = self.shown(middle);
        let rim = |i: usize| {
            let (sin, cos) = (TAU * i as f64 / CORNERS as f64).sin_cos();
            self.shown(&(middle + radius * Vector2::new(cos, sin))) - centre
        };
        let rim: Vec<Vector2<f64>> = (0..CORNERS).map(rim).collect();
        let (mut twice, mut first) = (0.0, Vector2::zeros());
        for (i, p) in rim.iter().enumerate() {
            let q = &rim[(i + 1) % CORNERS];
            let cross = p.perp(q);
            twice += cross;
            first += (p + q) * cross;
        }
        (0.5 * twice.abs(), first / (3.0 * twice))
    }
}
