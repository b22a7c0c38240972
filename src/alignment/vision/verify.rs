//! Whether a picture supports an object at a pose that is expected, standing or held.

use image::{GrayImage, RgbImage};
use nalgebra::Vector2;

use super::{Error, Support, belief, change_of, check_size};
use crate::alignment::outline::{Kind, ObjectPose, Projector};
use crate::alignment::picture::{Picture, median};
use crate::alignment::placement::{Evidence, Hidden};
use crate::alignment::refine::strongest;
use crate::world::{Camera, Object, Scene};

/// Asks whether a picture supports an object at a pose, standing or held, anywhere in view.
///
/// `ignore` is non-zero where something else, such as the fingers, is in front.
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
    check_size(image, camera)?;
    let picture = Picture::new(image);
    let view = Projector::new(camera);
    let change = change_of(&picture, &view, scene);
    let hidden = Hidden { mask: ignore.cloned(), hulls: Vec::new() };
    let evidence = Evidence::new(&picture, &view, object, &change, hidden);
    let score = evidence.score(world_from_object, 0, 16);
    let outline = evidence.outline(world_from_object, 16);
    let (w, h) = picture.size();
    let looks: Vec<(Vector2<f64>, f64, f64)> = outline
        .samples
        .iter()
        .filter(|s| {
            s.kind == Kind::Silhouette
                && s.pixel.x > 2.0
                && s.pixel.y > 2.0
                && s.pixel.x < w as f64 - 3.0
                && s.pixel.y < h as f64 - 3.0
                && !evidence.hidden.covers(s.pixel)
        })
        .filter_map(|s| {
            let (offset, strength) = strongest(&picture, s.pixel, s.normal, (2.0, 8.0, false))?;
            Some((s.normal, offset, strength * s.length))
        })
        .collect();
    let mut shift = Vector2::zeros();
    let mut rms = 0.0;
    for _ in 0..8 {
        let mut off: Vec<f64> = looks.iter().map(|l| (l.1 - l.0.dot(&shift)).abs()).collect();
        let spread = (1.4826 * median(&mut off)).max(0.3);
        let (mut normal, mut rhs) = (nalgebra::Matrix2::identity() * 1e-6, Vector2::zeros());
        let (mut square, mut weight) = (0.0, 1e-9);
        for (n, offset, w) in &looks {
            let residual = offset - n.dot(&shift);
            let t = (residual / (4.0 * spread)).powi(2);
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
    Ok(Support { score, confidence: belief(&score), shift_px: [shift.x, shift.y], rms_px: rms })
}
