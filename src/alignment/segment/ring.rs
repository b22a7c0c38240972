//! A closed line around the middle of a box along which as much edge runs as can be: what is clear has an outline, and inside of it
//! the colours of what is behind, so that colours alone do not part it from there. Masks are made of it; whether one is a
//! thing's is the referee's.
//!
//! Around the middle of the box one point is chosen on each ray, at most some steps further out or in than on the ray before, so
//! that the sum of the edges between neighbours is the largest: dynamic programming along a band that is closed.
//!
//! Source: Amini, Weymouth and Jain, "Using dynamic programming for solving variational problems in vision", PAMI 1990.

use image::GrayImage;
use nalgebra::Vector2;

use super::snap::filled;
use crate::alignment::picture::Picture;

/// Rays around the middle.
const RAYS: usize = 160;
/// Places on each ray.
const STEPS: usize = 48;
/// How far a line may go in or out from one ray to the next, steps.
const TURN: usize = 3;
/// The innermost place on a ray, as a share of the way to the box.
const INNER: f64 = 0.2;

/// A band around the middle of a box, with how much edge there is between the places on neighbouring rays.
pub(super) struct Band {
    places: Vec<Vector2<f64>>,
    /// `[ray][step][turn]`: from that step to the one `turn - TURN` further on the next ray.
    edges: Vec<f64>,
    size: (u32, u32),
}

impl Band {
    /// Looks at the edges in a box `[u0, v0, u1, v1]`, px; `full` is half of an edge's worth, CIELAB/px.
    pub(super) fn new(picture: &Picture, bounds: [f64; 4], full: f64) -> Self {
        let (w, h) = picture.size();
        let middle = Vector2::new(bounds[0] + bounds[2], bounds[1] + bounds[3]) / 2.0;
        let half = Vector2::new(bounds[2] - bounds[0], bounds[3] - bounds[1]) / 2.0;
        let step = half.min() * (1.0 - INNER) / STEPS as f64;
        let k = if step < 1.5 {
            0
        } else if step < 3.0 {
            1
        } else {
            2
        };
        let (level, full) = (&picture.levels[k], full * [1.0, 2.0, 4.0][k]);
        let places: Vec<Vector2<f64>> = (0..RAYS * STEPS)
            .map(|i| {
                let angle = std::f64::consts::TAU * (i / STEPS) as f64 / RAYS as f64;
                let (sin, cos) = angle.sin_cos();
                let far = INNER + (1.0 - INNER) * ((i % STEPS) as f64 + 0.5) / STEPS as f64;
                let ray = Vector2::new(cos, sin) * (far / sin.abs().max(cos.abs()));
                middle + half.component_mul(&ray)
            })
            .collect();
        let mut edges = vec![-1.0; RAYS * STEPS * (2 * TURN + 1)];
        for ray in 0..RAYS {
            for from in 0..STEPS {
                for turn in 0..=2 * TURN {
                    let Some(to) = (from + turn).checked_sub(TURN).filter(|to| *to < STEPS) else {
                        continue;
                    };
                    let (a, b) =
                        (places[ray * STEPS + from], places[(ray + 1) % RAYS * STEPS + to]);
                    let Some(along) = (b - a).try_normalize(1e-9) else { continue };
                    let at = (a + b) / 2.0;
                    let g = level.edge(at.x, at.y, Vector2::new(along.y, -along.x));
                    edges[(ray * STEPS + from) * (2 * TURN + 1) + turn] = g / (g + full);
                }
            }
        }
        Self { places, edges, size: (w as u32, h as u32) }
    }

    /// The best closed line, filled; `bend` is what a step in or out costs, `out` what a place at the box is worth.
    pub(super) fn mask(&self, bend: f64, out: f64) -> GrayImage {
        // Once around to forget where it began, once more to be taken.
        let mut worth = vec![0.0; STEPS];
        let mut from = vec![0_usize; 2 * RAYS * STEPS];
        for round in 0..2 * RAYS {
            let ray = round % RAYS;
            let mut next = vec![f64::NEG_INFINITY; STEPS];
            for (step, held) in worth.iter().enumerate() {
                for turn in 0..=2 * TURN {
                    let Some(to) = (step + turn).checked_sub(TURN).filter(|to| *to < STEPS) else {
                        continue;
                    };
                    let value = held + self.edges[(ray * STEPS + step) * (2 * TURN + 1) + turn]
                        - bend * turn.abs_diff(TURN) as f64
                        + out * to as f64 / STEPS as f64;
                    if value > next[to] {
                        (next[to], from[round * STEPS + to]) = (value, step);
                    }
                }
            }
            worth = next;
        }
        let mut at = (0..STEPS).max_by(|a, b| worth[*a].total_cmp(&worth[*b])).unwrap_or(0);
        let mut line = vec![Vector2::zeros(); RAYS];
        for round in (RAYS / 2..2 * RAYS).rev() {
            // The last half round leads to the end chosen, the one before it is closed.
            if round < RAYS / 2 + RAYS {
                line[(round + 1) % RAYS] = self.places[(round + 1) % RAYS * STEPS + at];
            }
            at = from[round * STEPS + at];
        }
        filled(&line, self.size)
    }
}

#[cfg(test)]
mod tests {
    use image::{Rgb, RgbImage};

    use super::*;

    /// Inside are the colours of outside; only a line of two pixels and a highlight within say that there is something.
    #[test]
    fn a_ring_of_glass_is_filled_and_its_highlight_is_not() {
        let inside = |x: u32, y: u32| (f64::from(x) - 100.0).hypot(f64::from(y) - 90.0) < 60.0;
        let image = RgbImage::from_fn(200, 180, |x, y| {
            let far = (f64::from(x) - 100.0).hypot(f64::from(y) - 90.0);
            let is_highlight = (90..96).contains(&x) && (60..110).contains(&y);
            let light = 120 + (x / 6) as u8;
            Rgb([if (58.0..60.0).contains(&far) {
                90
            } else if is_highlight {
                250
            } else {
                light
            }; 3])
        });
        let band = Band::new(&Picture::new(&image), [20.0, 10.0, 180.0, 170.0], 1.5);
        let mask = band.mask(0.1, 0.35);
        let (mut both, mut either) = (0.0, 0.0);
        for (x, y, pixel) in mask.enumerate_pixels() {
            let (a, b) = (pixel.0[0] > 0, inside(x, y));
            both += f64::from(u8::from(a && b));
            either += f64::from(u8::from(a || b));
        }
        assert!(both / either > 0.95, "{}", both / either);
    }

    #[test]
    fn an_even_picture_and_a_box_at_its_border_give_no_panic() {
        let even = Picture::new(&RgbImage::from_pixel(40, 30, Rgb([120; 3])));
        for bounds in [[0.0, 0.0, 39.0, 29.0], [30.0, 20.0, 39.0, 29.0], [5.0, 5.0, 5.0, 5.0]] {
            Band::new(&even, bounds, 1.5).mask(0.1, 0.2);
        }
    }
}
