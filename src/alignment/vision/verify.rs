//! Whether a picture supports an object at a pose that is expected, standing or held.

use std::sync::Arc;

use image::{GrayImage, RgbImage};
use nalgebra::Vector2;

use super::{Error, Look, Support, belief};
use crate::alignment::evidence::{Evidence, Hidden};
use crate::alignment::outline::{Kind, ObjectPose};
use crate::alignment::picture::{ROBUST, median};
use crate::alignment::refine::strongest;
use crate::world::{Camera, Object, Scene};

/// How far from the picture's border points are judged, px: as far as colours are sampled for a gradient (two half
/// steps and the pixel between), so that none is read from beyond it.
const BORDER_PX: f64 = 2.0;
/// Points on each edge of the outline, as where a placement is scored at full size.
const POINTS: usize = 16;
/// An edge counts in full at this gradient, CIELAB/px, and is looked for so far from the outline, px. Chosen: between
/// clear and opaque things of [`crate::alignment::evidence`], and some millimetres, which is what a hand may hold a
/// thing askew (8 px are 1 cm in the kitchen). With half the reach that is not seen as a shift, with twice as much a
/// finger's edge is.
const LOOK: (f64, f64) = (2.0, 8.0);
/// Rounds of reweighting. Chosen: weights follow the shift and the shift the weights; with half as many rounds a
/// shift of several px may stop on its way, with twice as many it costs as much again.
const ROUNDS: usize = 8;
/// What the spread is not below, px: pictures are not measured better by single points; with none two exact points
/// would outvote all others.
const LEAST_SPREAD: f64 = 0.3;
/// Spreads beyond which a point has no weight: Tukey's biweight, whose 4.685 is 95 % efficient on clean data; at 4
/// somewhat firmer against a neighbour's edge (Huber, *Robust Statistics*, 1981).
const TUKEY: f64 = 4.0;
/// What keeps the equations from being singular and a mean from dividing by nothing, beside weights of some hundred px.
const TINY: [f64; 2] = [1e-6, 1e-9];

/// Asks whether a picture supports an object at a pose: [`Look::verify`] of a picture of which nothing else is asked.
///
/// # Errors
///
/// [`Error::WrongSize`] when the picture is not the camera's size.
pub fn verify(
    image: &RgbImage,
    camera: &Camera,
    scene: &Scene,
    object: &Object,
    world_from_object: &ObjectPose,
    ignore: Option<&GrayImage>,
) -> Result<Support, Error> {
    Ok(Look::new(image, camera, scene)?.verify(object, world_from_object, ignore))
}

impl Look<'_> {
    /// Asks whether the picture supports an object at a pose, standing or held, anywhere in view.
    ///
    /// `ignore` is non-zero where something else, such as the fingers, is in front.
    pub fn verify(
        &self,
        object: &Object,
        world_from_object: &ObjectPose,
        ignore: Option<&GrayImage>,
    ) -> Support {
        let picture = &self.picture;
        let hidden = Hidden { mask: ignore.cloned().map(Arc::new), hulls: Vec::new() };
        let evidence = Evidence::new(picture, &self.view, object, self.change(), hidden);
        let score = evidence.score(world_from_object, 0, POINTS);
        let outline = evidence.outline(world_from_object, POINTS);
        let (w, h) = picture.size();
        let looks: Vec<(Vector2<f64>, f64, f64)> = outline
            .samples
            .iter()
            .filter(|s| {
                s.kind == Kind::Silhouette
                    && s.pixel.x > BORDER_PX
                    && s.pixel.y > BORDER_PX
                    && s.pixel.x < w as f64 - 1.0 - BORDER_PX
                    && s.pixel.y < h as f64 - 1.0 - BORDER_PX
                    && !evidence.hidden.covers(s.pixel)
            })
            .filter_map(|s| {
                let (offset, strength) =
                    strongest(picture, s.pixel, s.normal, (LOOK.0, LOOK.1, false))?;
                Some((s.normal, offset, strength * s.length))
            })
            .collect();
        let mut shift = Vector2::zeros();
        let mut rms = 0.0;
        for _ in 0..ROUNDS {
            let mut off: Vec<f64> = looks.iter().map(|l| (l.1 - l.0.dot(&shift)).abs()).collect();
            let spread = (ROBUST * median(&mut off)).max(LEAST_SPREAD);
            let (mut normal, mut rhs) = (nalgebra::Matrix2::identity() * TINY[0], Vector2::zeros());
            let (mut square, mut weight) = (0.0, TINY[1]);
            for (n, offset, w) in &looks {
                let residual = offset - n.dot(&shift);
                let t = (residual / (TUKEY * spread)).powi(2);
                if t < 1.0 {
                    let w = w * (1.0 - t).powi(2);
                    normal += w * n * n.transpose();
                    rhs += w * n * residual;
                    square += w * residual * residual;
                    weight += w;
                }
            }
            if let Some(inverse) = normal.try_inverse() {
                shift += inverse * rhs;
            }
            rms = (square / weight).sqrt();
        }
        Support { score, confidence: belief(&score), shift_px: [shift.x, shift.y], rms_px: rms }
    }
}
