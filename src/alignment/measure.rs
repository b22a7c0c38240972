//! A thing of unknown size: the solid on the table whose silhouette is the outline of a mask.
//!
//! In: a picture, its camera and the mask of one thing that stands on the table. Out: the cuboid or the cylinder that fits
//! its outline best, with place, sizes and how certain each is. Both are fitted, from several heights and turns; the
//! simpler one is taken unless the other explains the outline better. What stands on something else, is hidden in part
//! or has another form is measured wrongly or refused by what the outline is off.
//!
//! Source: the paper, §2.2 (contour → key points → pose, sizes known); Schwarz, "Estimating the dimension of a model",
//! Annals of Statistics 1978 (which of the two solids).

use std::f64::consts::FRAC_PI_2;

use image::{GrayImage, RgbImage};
use nalgebra::Vector2;

use super::key_points::{Contour, Refused};
use super::outline::{ObjectPose, Outline, Projector};
use super::picture::Picture;
use super::placement::Hidden;
use crate::fit::{self, Fit, Loss, Residuals};
use crate::world::{Camera, Material, Shape};

/// Points of the outline that are compared: one every some pixels of a thing in a picture of a megapixel. Chosen: with
/// half as many a small box has two on a short side, with twice as many the fit takes twice as long and ends at the same.
const POINTS: usize = 160;
/// Heights that are begun with, in the thing's width: of a plate, of a cube, of a can and of a bottle.
const HEIGHTS: [f64; 4] = [0.3, 0.9, 1.6, 3.0];
/// Turns that a cuboid is begun with, as shares of a quarter turn.
const TURNS: [f64; 4] = [0.0, 0.25, 0.5, 0.75];
/// An outline is known to so much, px: the noise of an edge that was moved onto the picture's (`key_points`).
const EDGE_PX: f64 = 0.5;
/// Points of the outline farther off than this many of that pull no harder: a highlight, the foot's own shadow.
const FAR: f64 = 4.0;
/// Largest root mean square distance between outline and solid, as a part of its size in the picture: half of what a solid
/// of known size may miss it by ([`super::key_points`]), since here its size was fitted to it.
const MISFIT: f64 = 0.03;
/// Samples of an edge of a solid's outline; its corners alone are used.
const PER_EDGE: usize = 1;

/// A thing as it was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Its solid, sizes in m.
    pub shape: Shape,
    /// Where it stands.
    pub world_from_object: ObjectPose,
    /// Standard deviation of its place on the table, in the worst direction, m.
    pub std: f64,
    /// Standard deviation of its sizes, m: of a cuboid along x, y and z, of a cylinder of its radius (twice) and height.
    pub size_std: [f64; 3],
    /// Root mean square distance between outline and solid, px.
    pub rms_px: f64,
    /// Its colour: the middle of what the mask covers, sRGB.
    pub colour: [u8; 3],
}

/// Measures the thing that a mask of the picture's size covers.
///
/// # Errors
///
/// [`Refused`] when the mask's outline is not that of a solid, is hidden or leaves the picture, or when neither solid
/// fits it.
pub fn measure(image: &RgbImage, camera: &Camera, mask: &GrayImage) -> Result<Measured, Refused> {
    let picture = Picture::new(image);
    let contour = Contour::of(mask, &picture, &Hidden::default(), Material::Opaque)?;
    let own = contour.pixels.iter().zip(&contour.own).filter(|(_, own)| **own);
    let own: Vec<Vector2<f64>> = own.map(|(pixel, _)| *pixel).collect();
    let points: Vec<Vector2<f64>> =
        own.iter().step_by(own.len().div_ceil(POINTS).max(1)).copied().collect();
    let view = Projector::new(camera);
    let start = Start::of(&view, &points).ok_or(Refused::Empty)?;
    let cylinder = best(&view, &points, HEIGHTS.map(|height| start.cylinder(height)));
    let cuboids =
        HEIGHTS.into_iter().flat_map(|height| TURNS.map(|turn| start.cuboid(height, turn)));
    let cuboid = best(&view, &points, cuboids);
    // Schwarz: a cuboid has two numbers more, and has to explain more than chance would with them.
    let n = points.len() as f64;
    let price = |fit: &Fit, numbers: f64| 2.0 * fit.cost + numbers * n.ln();
    let found = match (cylinder, cuboid) {
        (Some(round), Some(straight)) => {
            if price(&round, 4.0) <= price(&straight, 6.0) {
                round
            } else {
                straight
            }
        }
        (round, straight) => round.or(straight).ok_or(Refused::FewPoints(points.len(), 6))?,
    };
    let rms_px = EDGE_PX * found.rms;
    if rms_px > MISFIT * start.size_px {
        return Err(Refused::Misfit(rms_px));
    }
    let (shape, world_from_object) = solid(&found.x);
    let of_size = |i: usize, size: f64| found.std(i) * size;
    let size_std = match shape {
        Shape::Cuboid { size } => [of_size(3, size.x), of_size(4, size.y), of_size(2, size.z)],
        Shape::Cylinder { radius, height } => {
            [of_size(3, radius), of_size(3, radius), of_size(2, height)]
        }
    };
    let std = found.covariance.view((0, 0), (2, 2)).symmetric_eigenvalues().max().max(0.0).sqrt();
    let colour = colour_in(image, mask);
    Ok(Measured { shape, world_from_object, std, size_std, rms_px, colour })
}

/// Where a fit begins.
struct Start {
    /// The foot's nearest place to the camera, m.
    near: Vector2<f64>,
    /// Away from the camera on the table, of length 1.
    away: Vector2<f64>,
    /// Across, m.
    width: f64,
    /// The longer side of the outline's box, px.
    size_px: f64,
}

impl Start {
    /// Reads it off an outline: what is nearest to the camera on the table is on the foot.
    fn of(view: &Projector, points: &[Vector2<f64>]) -> Option<Self> {
        let ground: Vec<Vector2<f64>> =
            points.iter().filter_map(|p| Some(view.on_plane(*p, 0.0)?.xy())).collect();
        let eye = view.eye().xy();
        let middle = ground.iter().sum::<Vector2<f64>>() / ground.len().max(1) as f64;
        let away = (middle - eye).try_normalize(1e-9)?;
        let near = ground.iter().map(|p| (p - eye).dot(&away)).fold(f64::INFINITY, f64::min);
        let across = ground.iter().map(|p| (p - eye).perp(&away));
        let (left, right) =
            across.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, r), at| (l.min(at), r.max(at)));
        let [low, high] = [f64::min, f64::max].map(|of: fn(f64, f64) -> f64| {
            points.iter().copied().reduce(|a, b| Vector2::new(of(a.x, b.x), of(a.y, b.y)))
        });
        // `perp` is positive to one side; the middle of both sides is on the line through the foot's middle.
        let aside = Vector2::new(away.y, -away.x) * (0.5 * (left + right));
        Some(Self {
            near: eye + away * near + aside,
            away,
            width: right - left,
            size_px: (high? - low?).amax(),
        })
        .filter(|start| start.width > 0.0 && start.width.is_finite())
    }

    /// Place, logarithm of height and radius of a cylinder so many widths high.
    fn cylinder(&self, height: f64) -> Vec<f64> {
        let radius = 0.5 * self.width;
        let at = self.near + self.away * radius;
        vec![at.x, at.y, (height * self.width).ln(), radius.ln()]
    }

    /// Place, logarithms of height and sides, and turn of a cuboid so many widths high.
    fn cuboid(&self, height: f64, turn: f64) -> Vec<f64> {
        let at = self.near + self.away * (0.5 * self.width);
        let side = (0.8 * self.width).ln();
        let yaw = self.away.y.atan2(self.away.x) + turn * FRAC_PI_2;
        vec![at.x, at.y, (height * self.width).ln(), side, side, yaw]
    }
}

/// Returns the solid that some numbers are, and its pose: four of a cylinder, six of a cuboid.
fn solid(x: &[f64]) -> (Shape, ObjectPose) {
    let height = x[2].exp();
    match *x {
        [x, y, _, side_x, side_y, yaw] => {
            let size = nalgebra::Vector3::new(side_x.exp(), side_y.exp(), height);
            (Shape::Cuboid { size }, ObjectPose::upright(x, y, 0.0, yaw))
        }
        _ => {
            let shape = Shape::Cylinder { radius: x[3].exp(), height };
            (shape, ObjectPose::upright(x[0], x[1], 0.0, 0.0))
        }
    }
}

/// Fits a solid to an outline from several beginnings and returns the best.
fn best(
    view: &Projector,
    points: &[Vector2<f64>],
    starts: impl IntoIterator<Item = Vec<f64>>,
) -> Option<Fit> {
    let problem = Residuals::new(points.len(), |x: &[f64], r: &mut [f64]| {
        let (shape, pose) = solid(x);
        let outline = Outline::new(view, &shape, &pose, PER_EDGE);
        if outline.hull.len() < 3 {
            r.fill(f64::INFINITY);
            return;
        }
        for (r, point) in r.iter_mut().zip(points) {
            *r = outline.depth(*point) / EDGE_PX;
        }
    });
    let options = fit::Options { loss: Loss::Huber(FAR), ..fit::Options::default() };
    let fits = starts.into_iter().filter_map(|start| fit::solve(&problem, &start, &options).ok());
    fits.min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// Returns the middle of each channel where a mask is not zero.
fn colour_in(image: &RgbImage, mask: &GrayImage) -> [u8; 3] {
    std::array::from_fn(|channel| {
        let inside = image.pixels().zip(mask.pixels()).filter(|(_, mask)| mask.0[0] > 0);
        let mut values: Vec<u8> = inside.map(|(pixel, _)| pixel.0[channel]).collect();
        if values.is_empty() {
            return 0;
        }
        let middle = values.len() / 2;
        *values.select_nth_unstable(middle).1
    })
}

#[cfg(test)]
mod tests {
    use image::{Luma, Rgb};
    use nalgebra::Vector3;

    use super::*;
    use crate::world::Intrinsics;

    fn camera() -> Camera {
        let intrinsics = Intrinsics::centred(900.0, 1280, 720);
        Camera::looking(intrinsics, Vector3::new(1.25, 0.0, 0.85), Vector3::new(0.6, 0.0, 0.05))
    }

    /// A flat picture of a solid, and its mask.
    fn painted(shape: &Shape, pose: &ObjectPose) -> (RgbImage, GrayImage) {
        let outline = Outline::new(&Projector::new(&camera()), shape, pose, 8);
        let inside = |u: u32, v: u32| outline.contains(Vector2::new(f64::from(u), f64::from(v)));
        let image = RgbImage::from_fn(1280, 720, |u, v| {
            Rgb(if inside(u, v) { [190, 40, 40] } else { [200, 176, 144] })
        });
        let mask = GrayImage::from_fn(1280, 720, |u, v| Luma([if inside(u, v) { 255 } else { 0 }]));
        (image, mask)
    }

    #[test]
    fn sizes_and_places_come_back_from_an_outline() {
        let cuboid = |x, y, z| Shape::Cuboid { size: Vector3::new(x, y, z) };
        let round = |radius, height| Shape::Cylinder { radius, height };
        for (shape, x, y, yaw) in [
            (round(0.04, 0.12), 0.55, 0.1, 0.0),
            (round(0.06, 0.03), 0.5, -0.2, 0.0),
            (cuboid(0.06, 0.06, 0.06), 0.6, -0.1, 0.4),
            (cuboid(0.12, 0.06, 0.04), 0.5, 0.15, -0.7),
            (cuboid(0.05, 0.08, 0.16), 0.65, 0.0, 1.2),
        ] {
            let (image, mask) = painted(&shape, &ObjectPose::upright(x, y, 0.0, yaw));
            let found = measure(&image, &camera(), &mask).unwrap();
            let at = found.world_from_object.origin();
            assert!((at.xy() - Vector2::new(x, y)).norm() < 2e-3, "{shape:?}: {found:?}");
            assert!((found.shape.height() - shape.height()).abs() < 2e-3, "{shape:?}: {found:?}");
            let off = match (found.shape, shape) {
                (Shape::Cuboid { size: a }, Shape::Cuboid { size: b }) => {
                    let [a, b] = [a, b].map(|s| Vector2::new(s.x.min(s.y), s.x.max(s.y)));
                    (a - b).amax()
                }
                (Shape::Cylinder { radius: a, .. }, Shape::Cylinder { radius: b, .. }) => {
                    (a - b).abs()
                }
                _ => f64::INFINITY,
            };
            assert!(off < 2e-3, "{shape:?}: {found:?}");
            assert!(found.size_std.iter().all(|std| *std < 2e-3), "{found:?}");
            assert_eq!(found.colour, [190, 40, 40]);
        }
    }

    #[test]
    fn what_is_no_solid_is_refused() {
        let image = RgbImage::from_pixel(1280, 720, Rgb([200, 176, 144]));
        let empty = GrayImage::new(1280, 720);
        assert_eq!(measure(&image, &camera(), &empty), Err(Refused::Empty));
        // An L on the table.
        let is_l = |u: u32, v: u32| {
            (500..700).contains(&u) && (300..500).contains(&v) && (u < 560 || v > 440)
        };
        let mask = GrayImage::from_fn(1280, 720, |u, v| Luma([if is_l(u, v) { 255 } else { 0 }]));
        assert!(measure(&image, &camera(), &mask).is_err());
    }
}
