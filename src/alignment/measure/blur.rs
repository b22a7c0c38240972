//! How wide the edges of a thing are in a picture: out of focus, or something moved while it was taken.
//!
//! In: a picture and the outline of a solid. Out: a width, px. Where in a wide edge the thing ends no picture tells, and a
//! fit does not notice, since an outline that is too large all round fits as well.

use nalgebra::Vector2;

use crate::alignment::outline::{Kind, Outline};
use crate::alignment::picture::Picture;

/// Steps across an edge to either side, and how long one is, px: 8 px, as wide as edges of use are.
const STEPS: i32 = 16;
const STEP_PX: f64 = 0.5;
/// Steps that a gradient is taken over, as in [`crate::alignment::refine::strongest`].
const OVER: usize = 4;

/// Returns how wide the silhouette's edges are, px: the upper quartile, since what moved blurs the edges across its way
/// alone; 0 where none is as steep as `full`, CIELAB/px. A sharp edge is 2 to 3 px wide.
pub(super) fn edge_width(picture: &Picture, outline: &Outline, full: f64) -> f64 {
    let silhouette = outline.samples.iter().filter(|sample| sample.kind == Kind::Silhouette);
    let mut widths: Vec<f64> =
        silhouette.filter_map(|sample| width(picture, sample.pixel, sample.normal, full)).collect();
    widths.sort_unstable_by(f64::total_cmp);
    widths.get(3 * widths.len() / 4).copied().unwrap_or(0.0)
}

/// The whole contrast over the steepest gradient, px.
fn width(picture: &Picture, at: Vector2<f64>, normal: Vector2<f64>, full: f64) -> Option<f64> {
    let across = (-STEPS..=STEPS).map(|step| {
        let pixel = at + normal * (f64::from(step) * STEP_PX);
        picture.lab_at(pixel.x, pixel.y)
    });
    let colours: Vec<[f32; 3]> = across.collect();
    let apart = |from: usize, to: usize| {
        let off = (0..3).map(|c| f64::from(colours[to][c] - colours[from][c]).powi(2));
        off.sum::<f64>().sqrt()
    };
    let last = colours.len() - 1;
    let gradients = (0..=last - OVER).map(|from| apart(from, from + OVER));
    let steepest = gradients.fold(0.0, f64::max) / (OVER as f64 * STEP_PX);
    (steepest >= full).then(|| apart(0, last) / steepest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alignment::outline::Sample;
    use image::{Rgb, RgbImage};
    use nalgebra::Vector3;

    #[test]
    fn an_edge_that_moved_is_as_wide_as_it_moved() {
        let sample = |v: f64| Sample {
            pixel: Vector2::new(50.0, v),
            normal: Vector2::x(),
            body: Vector3::zeros(),
            length: 1.0,
            kind: Kind::Silhouette,
            edge: 0,
        };
        let samples = (10..30).map(|v| sample(f64::from(v))).collect();
        let outline = Outline { samples, ..Outline::default() };
        let width = |moved: f64| {
            let image = RgbImage::from_fn(100, 40, |u, _| {
                let share = ((f64::from(u) - 50.0) / moved + 0.5).clamp(0.0, 1.0);
                Rgb([(100.0 + 80.0 * share) as u8; 3])
            });
            edge_width(&Picture::new(&image), &outline, 2.4)
        };
        assert!(width(1.0) < 3.5, "{}", width(1.0));
        assert!((width(9.0) - 9.0).abs() < 2.0, "{}", width(9.0));
        // Nothing to be seen.
        assert!(width(1e6).abs() < 1e-9, "{}", width(1e6));
    }
}
