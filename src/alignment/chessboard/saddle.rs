//! Saddle points: places where two dark and two bright sectors meet.
//!
//! In comes a grey plane, out come the places at which brightness has a saddle, with the four rays that
//! part the sectors. A corner of a chessboard is one at any turn, contrast and brightness; an edge and
//! the end of a line are none.
//!
//! Source: Geiger, Moosmann, Car and Schuster, "Automatic camera and range sensor calibration using a single
//! shot", ICRA 2012 (two edge directions per corner); Chen and Zhang, "A new sub-pixel detector for x-corners in
//! camera calibration targets", WSCG 2005 (the Hessian's determinant).

#![expect(clippy::cast_possible_wrap, reason = "a picture has far fewer than 2^63 pixels")]

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix2, Vector2};

use crate::alignment::plane::Plane;

/// Smoothing before derivatives, px. Chosen: the blur of a lens in focus and of the pixels' own area is 0.5 to 1 px;
/// with half of it noise has saddles, with twice as much corners of squares of 6 px run into each other.
const SMOOTH: f32 = 1.2;
/// A saddle is the strongest within this many px. Chosen: half of the side of the smallest square that is looked for.
const APART: usize = 3;
/// Radius of the circle on which sectors are counted, px. Chosen: with half of it the circle lies in the blur, with
/// twice as much it leaves squares of 8 px.
const RING: f64 = 4.0;
/// Samples on the circle: one every 0.8 px of it, finer than the smoothing.
const SAMPLES: usize = 32;
/// Largest part of the circle's variance that turns its sign at half a turn: 0 for a saddle, 1 for an edge, 0.5 for
/// a junction of three. Chosen: noise of a fifth of the contrast leaves 0.1.
const ODD: f64 = 0.3;
/// Least distance of two neighbouring rays, rad: a square seen at 80° from its normal has corners of 10°.
const NARROW: f64 = 0.17;
/// Rays that are opposite are so within this, rad. Chosen: a lens bends an edge by a degree in a square; the rest is
/// noise of the circle's samples.
const OPPOSITE: f64 = 0.5;

/// A saddle of brightness.
#[derive(Debug, Clone, Copy)]
pub(super) struct Saddle {
    /// Where, px of its plane.
    pub(super) at: Vector2<f64>,
    /// The brightest less the darkest on the circle around it, grey levels.
    pub(super) contrast: f64,
    /// The angles of the edges that leave it, rad, clockwise as seen (v is down); the sector after the first
    /// and the third is bright.
    pub(super) rays: [f64; 4],
}

/// The smoothed plane and the strength of saddles in it.
pub(super) struct Saddles {
    pub(super) smooth: Plane,
    /// Root of minus the Hessian's determinant, grey levels per px².
    strength: Plane,
}

impl Saddles {
    pub(super) fn new(grey: &Plane) -> Self {
        let smooth = grey.blurred(SMOOTH);
        let (w, h) = (smooth.width, smooth.height);
        let mut strength = Plane::zeros(w, h);
        for y in 1..h.saturating_sub(1) {
            for x in 1..w.saturating_sub(1) {
                let at = y * w + x;
                let d = &smooth.data;
                let xx = d[at + 1] - 2.0 * d[at] + d[at - 1];
                let yy = d[at + w] - 2.0 * d[at] + d[at - w];
                let xy = 0.25 * (d[at + w + 1] - d[at + w - 1] - d[at - w + 1] + d[at - w - 1]);
                strength.data[at] = (xy * xy - xx * yy).max(0.0).sqrt();
            }
        }
        Self { smooth, strength }
    }

    /// Returns the saddles with four sectors around them, strongest first, `most` at most.
    pub(super) fn all(&self, most: usize) -> Vec<Saddle> {
        let (w, h) = (self.strength.width, self.strength.height);
        let data = &self.strength.data;
        let edge = RING as usize + 1;
        let mut places = Vec::new();
        for y in edge..h.saturating_sub(edge) {
            for x in edge..w.saturating_sub(edge) {
                let at = y * w + x;
                let s = data[at];
                // Of two that are equal the first one stays.
                let is_top = s > 0.0
                    && (y - APART..=y + APART).all(|ny| {
                        (x - APART..=x + APART).all(|nx| {
                            let other = data[(ny * w + nx).min(w * h - 1)];
                            other < s || (other <= s && ny * w + nx >= at)
                        })
                    });
                if is_top {
                    places.push((s, at));
                }
            }
        }
        places.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        // Not every saddle of brightness is one of a board: of those that noise and texture have, most lack sectors.
        places.iter().filter_map(|&(_, at)| self.at(at % w, at / w)).take(most).collect()
    }

    /// Returns the saddle nearest to a place, `reach` px at most away.
    pub(super) fn near(&self, place: Vector2<f64>, reach: f64) -> Option<Saddle> {
        let (w, h) = (self.strength.width as i64, self.strength.height as i64);
        let edge = RING as i64 + 1;
        let r = reach.ceil() as i64;
        let (cx, cy) = (place.x.round() as i64, place.y.round() as i64);
        let mut best: Option<(f32, i64, i64)> = None;
        for y in (cy - r).max(edge)..=(cy + r).min(h - 1 - edge) {
            for x in (cx - r).max(edge)..=(cx + r).min(w - 1 - edge) {
                let s = self.strength.at(x, y);
                if best.is_none_or(|b| s > b.0) {
                    best = Some((s, x, y));
                }
            }
        }
        let (_, x, y) = best?;
        self.at(x as usize, y as usize).filter(|saddle| (saddle.at - place).norm() <= reach)
    }

    /// Returns the saddle at a pixel, if there are four sectors around it.
    fn at(&self, x: usize, y: usize) -> Option<Saddle> {
        let at = self.stationary(x, y)?;
        let (rays, contrast) = self.rays(at)?;
        Some(Saddle { at, contrast, rays })
    }

    /// The place where the quadratic through the pixel's neighbours has no slope.
    fn stationary(&self, x: usize, y: usize) -> Option<Vector2<f64>> {
        let (x, y) = (x as i64, y as i64);
        let s = |dx: i64, dy: i64| f64::from(self.smooth.at(x + dx, y + dy));
        let slope = Vector2::new(0.5 * (s(1, 0) - s(-1, 0)), 0.5 * (s(0, 1) - s(0, -1)));
        let xy = 0.25 * (s(1, 1) - s(-1, 1) - s(1, -1) + s(-1, -1));
        let hessian = Matrix2::new(
            s(1, 0) - 2.0 * s(0, 0) + s(-1, 0),
            xy,
            xy,
            s(0, 1) - 2.0 * s(0, 0) + s(0, -1),
        );
        let step = -(hessian.try_inverse()? * slope);
        // A place a pixel and a half away is another pixel's.
        (step.norm() < 1.5).then(|| Vector2::new(x as f64, y as f64) + step)
    }

    /// The four edges that leave a place, and the contrast around it; `None` where there are not two dark and two bright sectors.
    fn rays(&self, at: Vector2<f64>) -> Option<([f64; 4], f64)> {
        let mut ring = [0.0; SAMPLES];
        for (k, value) in ring.iter_mut().enumerate() {
            let angle = TAU * k as f64 / SAMPLES as f64;
            let place = at + RING * Vector2::new(angle.cos(), angle.sin());
            *value = f64::from(self.smooth.sample(place.x, place.y));
        }
        let most = ring.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let least = ring.iter().copied().fold(f64::INFINITY, f64::min);
        let middle = f64::midpoint(most, least);
        let half = SAMPLES / 2;
        let (mut odd, mut total) = (0.0, 0.0);
        for k in 0..half {
            let (a, b) = (ring[k] - middle, ring[k + half] - middle);
            odd += 0.5 * (a - b) * (a - b);
            total += a * a + b * b;
        }
        if total <= 0.0 || odd > ODD * total {
            return None;
        }
        // Where the sign changes, to a fraction of a sample; upwards first.
        let mut crossings: Vec<(f64, bool)> = Vec::with_capacity(4);
        for k in 0..SAMPLES {
            let (a, b) = (ring[k] - middle, ring[(k + 1) % SAMPLES] - middle);
            if (a < 0.0) != (b < 0.0) {
                let angle = TAU * (k as f64 + a / (a - b)) / SAMPLES as f64;
                crossings.push((angle, b >= 0.0));
            }
        }
        if crossings.len() != 4 {
            return None;
        }
        if !crossings[0].1 {
            crossings.rotate_left(1);
        }
        let rays = [0, 1, 2, 3].map(|k: usize| crossings[k].0);
        let is_spread = (0..4).all(|k| turn(rays[k], rays[(k + 1) % 4]).abs() > NARROW);
        let is_cross = (0..2).all(|k| PI - turn(rays[k], rays[k + 2]).abs() < OPPOSITE);
        (is_spread && is_cross).then_some((rays, most - least))
    }
}

/// Returns the turn from one angle to another, rad, from -π to π.
pub(super) fn turn(from: f64, to: f64) -> f64 {
    (to - from + PI).rem_euclid(TAU) - PI
}
