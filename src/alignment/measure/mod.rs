//! A thing of unknown size: the solid on the table whose silhouette is the outline of a mask.
//!
//! In: a picture, its camera and the mask of one thing that stands on the table. Out: the cuboid or the cylinder that fits
//! its outline best, with place, sizes and how certain each is. Both are fitted to the outline, from several heights and
//! turns; the simpler one is taken unless the other explains the outline better, and is then moved onto the picture's own
//! edges, those inside the outline too. A shadow that was cut out with it is taken off before. What stands on something else, is hidden in part or has another form is measured
//! wrongly, or refused by how far its edges are off, all together or over a stretch of the outline.
//!
//! Source: the paper, §2.2 (contour → key points → pose, sizes known); Schwarz, "Estimating the dimension of a model",
//! Annals of Statistics 1978 (which of the two solids); Harris, "Tracking with rigid models", 1992 (moving edges).

mod blur;
mod start;
mod stretches;

use std::f64::consts::{FRAC_PI_2, SQRT_2};

use image::{GrayImage, RgbImage};
use nalgebra::{Vector2, Vector3};
use thiserror::Error as ThisError;

use super::error::open_side;
use super::evidence::Hidden;
use super::key_points::{Contour, Refused};
use super::outline::{ObjectPose, Outline, Projector};
use super::picture::Picture;
use super::refine::strongest;
use super::segment::{Prompt, segment, without_shadow};
use crate::fit::{self, Fit, Loss, Residuals};
use crate::world::frame::Object;
use crate::world::{Camera, Form, Material, Point, Shape, Unknown};
use blur::edge_width;
use start::Start;
use stretches::apart;

/// Room around a region, as a share of its box: a box drawn by hand is as loose, and the cut expects that.
const ROOM: f64 = 0.15;
/// Points of the outline that are compared. Chosen: one every few pixels of a thing in a picture of a megapixel.
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
/// What a stretch of the outline may leave the solid by, px, and the same as a part of its size in the picture; more where
/// edges are blurred. Boxes and cans of drawn pictures, one of them a JPEG of quality 40, were off by 0.1 to 0.9 px, a can on
/// its side taken for a box of 120 px by 1.8 px, a printed flower by 2.0 px, two boxes taken for one by 11 px.
const STRETCH_PX: f64 = 1.0;
const STRETCH_PART: f64 = 0.01;
/// A size is told if it is known to this share of the larger of height and radius. Chosen: what is known worse a hand
/// cannot be set to take.
const TOLD: f64 = 0.1;
/// Samples of an edge of a solid where its corners alone are used, and where the picture is searched along it.
const CORNERS: usize = 1;
const ALONG: usize = 24;
/// What the edges of a picture are off all together, px: at the foot a thing and its shadow meet, and in pictures of the
/// laboratory heights come out 1 px short. No fit of one picture tells.
const SOFT_PX: f64 = 1.0;
/// How far from a solid's edge the picture's is looked for, px, round after round: as far as a mask is off at first.
const REACH_PX: [f64; 4] = [5.0, 4.0, 3.0, 2.0];
/// The gradient that counts in full, CIELAB/px, as for opaque things in [`super::key_points`].
const FULL: f64 = 2.4;
/// The least share of an edge, and of all edges of a solid, that the picture shows. Chosen: an inner edge between two faces
/// of one brightness is not seen, a whole side in the colour of the table is too much.
const SHOWN: f64 = 0.6;

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

impl Measured {
    /// Bounds the thing more closely than what its region in the picture alone says.
    pub fn bound(self) -> Unknown {
        let worst = self.size_std.iter().fold(self.std, |worst, std| worst.max(*std));
        let within = 2.0 * worst;
        let Self { shape, world_from_object, colour, .. } = self;
        Unknown {
            at: world_from_object.origin().xy().into(),
            radius: shape.outer_radius() + within,
            height: shape.height() + within,
            form: Some(Form { shape, world_from_object, within, colour }),
        }
    }
}

/// Why a thing was not measured.
#[derive(Debug, Clone, Copy, PartialEq, ThisError)]
pub enum Unmeasured {
    /// The mask has no outline to go by.
    #[error(transparent)]
    Outline(#[from] Refused),
    /// Neither solid fits: root mean square distance of the better one, px.
    #[error("neither a box nor a can has its outline; the better one is off by {0:.1} px")]
    Misfit(f64),
    /// A solid fits but for a stretch of the outline: how far that leaves it on the mean, px.
    #[error(
        "neither a box nor a can has its outline; a stretch of it leaves the better one by {0:.1} px: two things that touch, \
         or one that is round where it should be straight"
    )]
    Stretch(f64),
    /// A solid fits, and so do others: the standard deviation of a size, m, infinite where nothing tells it.
    #[error("this view does not tell its size, {}; take a picture from another place", open_side(*.0))]
    Undetermined(f64),
    /// What was cut out lies on the table like a sheet: a shadow, a print, a reflection.
    #[error("it is flat")]
    Flat,
    /// Nothing in the region stands out from what is around it.
    #[error("it cannot be cut out")]
    Uncut,
}

/// Measures what stands in a box of the picture, `[u0, v0, u1, v1]` px, as [`super::vision::Look::unexplained_regions`] finds it.
///
/// # Errors
///
/// [`Unmeasured`] as [`measure`] does, or when nothing can be cut out there.
pub fn measure_in(
    picture: &Picture,
    image: &RgbImage,
    camera: &Camera,
    [u0, v0, u1, v1]: [f64; 4],
) -> Result<Measured, Unmeasured> {
    let (du, dv) = (ROOM * (u1 - u0), ROOM * (v1 - v0));
    let around = Prompt::Box([u0 - du, v0 - dv, u1 + du, v1 + dv]);
    let cut = segment(picture, &around).ok_or(Unmeasured::Uncut)?;
    let lit = without_shadow(image, &cut.mask);
    measure(picture, image, camera, lit.as_ref().unwrap_or(&cut.mask))
}

/// Measures the thing that a mask of the picture's size covers.
///
/// # Errors
///
/// [`Unmeasured`] when the mask's outline is not that of a solid, is hidden or leaves the picture, when neither solid
/// fits it, or when solids of other sizes fit as well.
pub fn measure(
    picture: &Picture,
    image: &RgbImage,
    camera: &Camera,
    mask: &GrayImage,
) -> Result<Measured, Unmeasured> {
    let contour = Contour::smooth(mask, picture, &Hidden::default(), Material::Opaque)?;
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
        return Err(Unmeasured::Misfit(rms_px));
    }
    let found = refined(&view, picture, found.x).ok_or(Unmeasured::Misfit(rms_px))?;
    let rms_px = EDGE_PX * found.rms;
    let (mut shape, mut world_from_object) = solid(&found.x);
    // What leaves the solid all along a stretch is of another form, however well the rest fits.
    let outline = Outline::new(&view, &shape, &world_from_object, ALONG);
    // In a wide edge the thing may end anywhere, of which the standard deviation is a twelfth's root.
    let wide_px = edge_width(picture, &outline, FULL) / f64::sqrt(12.0);
    let apart_px = apart(picture, &contour, &outline.hull, FULL);
    if apart_px > STRETCH_PX.max(STRETCH_PART * start.size_px).max(wide_px) {
        return Err(Unmeasured::Stretch(apart_px));
    }
    let far = (world_from_object.origin() - view.eye()).norm();
    // A size lies between two edges, each off as a whole by as much as edges are off.
    let soft = SOFT_PX.max(SQRT_2 * rms_px).max(wide_px) * far / camera.intrinsics.fx;
    let of_size = |i: usize, size: f64| (found.std(i) * size).hypot(soft);
    let mut size_std = match shape {
        Shape::Cuboid { size } => [of_size(3, size.x), of_size(4, size.y), of_size(2, size.z)],
        Shape::Cylinder { radius, height } => {
            [of_size(3, radius), of_size(3, radius), of_size(2, height)]
        }
        // Only boxes and cans are measured.
        Shape::Lathe { .. } | Shape::Mesh { .. } | Shape::Mug { .. } => [f64::INFINITY; 3],
    };
    let worst = size_std.iter().fold(0.0_f64, |worst, std| worst.max(*std));
    if worst > TOLD * shape.height().max(shape.outer_radius()) {
        return Err(Unmeasured::Undetermined(worst));
    }
    // The longer side is along x: the same box is not told once as 75 x 121 mm and once as 121 x 75 mm.
    if let Shape::Cuboid { size } = &mut shape
        && size.y > size.x
    {
        size.swap_rows(0, 1);
        size_std.swap(0, 1);
        let (at, yaw) = (world_from_object.origin(), world_from_object.yaw() + FRAC_PI_2);
        world_from_object = ObjectPose::upright(at.x, at.y, 0.0, yaw);
    }
    // What is no higher than its edges are soft has no side that was seen.
    if shape.height() < 2.0 * size_std[2] {
        return Err(Unmeasured::Flat);
    }
    let place = found.covariance.view((0, 0), (2, 2)).symmetric_eigenvalues().max();
    let std = place.max(0.0).sqrt().hypot(soft);
    let colour = colour_in(image, mask);
    Ok(Measured { shape, world_from_object, std, size_std, rms_px, colour })
}

/// Returns the solid that some numbers are, and its pose: four of a cylinder, six of a cuboid.
fn solid(x: &[f64]) -> (Shape, ObjectPose) {
    let height = x[2].exp();
    if let [x, y, _, side_x, side_y, yaw] = *x {
        let size = Vector3::new(side_x.exp(), side_y.exp(), height);
        return (Shape::Cuboid { size }, ObjectPose::upright(x, y, 0.0, yaw));
    }
    let shape = Shape::Cylinder { radius: x[3].exp(), height };
    (shape, ObjectPose::upright(x[0], x[1], 0.0, 0.0))
}

/// Fits a solid to an outline from several beginnings and returns the best.
fn best(
    view: &Projector,
    points: &[Vector2<f64>],
    starts: impl IntoIterator<Item = Vec<f64>>,
) -> Option<Fit> {
    let problem = Residuals::new(points.len(), |x: &[f64], r: &mut [f64]| {
        let (shape, pose) = solid(x);
        let outline = Outline::new(view, &shape, &pose, CORNERS);
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

/// An edge of the picture beside one of a solid.
struct Edge {
    /// Where on the solid, in its sizes.
    body: Vector3<f64>,
    normal: Vector2<f64>,
    /// How far along the normal the edge is, px.
    along: f64,
    /// Which of the solid's edges.
    of: usize,
}

/// Moves a solid, its sizes too, onto the edges of the picture; `None` where the picture does not show them.
fn refined(view: &Projector, picture: &Picture, start: Vec<f64>) -> Option<Fit> {
    let mut x = start;
    let mut found = None;
    for reach in REACH_PX {
        let (shape, pose) = solid(&x);
        let outline = Outline::new(view, &shape, &pose, ALONG);
        let unit = extent(&shape).map(f64::recip);
        let mut edges: Vec<Edge> = outline
            .samples
            .iter()
            .filter_map(|sample| {
                let how = (FULL, reach, false);
                let (offset, _) = strongest(picture, sample.pixel, sample.normal, how)?;
                let along = sample.normal.dot(&sample.pixel) + offset;
                let body = sample.body.component_mul(&unit);
                Some(Edge { body, normal: sample.normal, along, of: sample.edge })
            })
            .collect();
        // One that the picture hardly shows would be drawn to whatever else is near; it is left out whole.
        let looked = |of: usize| outline.samples.iter().filter(|s| s.edge == of).count();
        let seen = |of: usize| edges.iter().filter(|edge| edge.of == of).count();
        let hardly: Vec<usize> = (0..=outline.samples.iter().map(|s| s.edge).max().unwrap_or(0))
            .filter(|&of| (seen(of) as f64) < SHOWN * looked(of) as f64)
            .collect();
        edges.retain(|edge| !hardly.contains(&edge.of));
        if (edges.len() as f64) < SHOWN * outline.samples.len().max(1) as f64 {
            return None;
        }
        let problem = Residuals::new(edges.len(), |x: &[f64], r: &mut [f64]| {
            let (shape, pose) = solid(x);
            let size = extent(&shape);
            for (r, edge) in r.iter_mut().zip(&edges) {
                let at = pose * Point::<Object>::from(edge.body.component_mul(&size));
                *r = view.pixel(at.coords()).map_or(f64::INFINITY, |pixel| {
                    (edge.normal.dot(&pixel) - edge.along) / EDGE_PX
                });
            }
        });
        let options = fit::Options { loss: Loss::Cauchy(FAR), ..fit::Options::default() };
        let fit = fit::solve(&problem, &x, &options).ok()?;
        x.clone_from(&fit.x);
        found = Some(fit);
    }
    found
}

/// Returns the sizes of a solid along its axes, m.
fn extent(shape: &Shape) -> Vector3<f64> {
    let radius = shape.outer_radius();
    let [x, y] = shape.faces().unwrap_or([radius, radius]);
    Vector3::new(x, y, shape.height())
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
    use super::*;
    use crate::world::Intrinsics;
    use crate::world::frame::World;
    use image::{Luma, Rgb};

    fn camera() -> Camera {
        let intrinsics = Intrinsics::centred(900.0, 1280, 720);
        Camera::looking(intrinsics, Vector3::new(1.25, 0.0, 0.85), Vector3::new(0.6, 0.0, 0.05))
    }

    /// A flat picture of a solid, and its mask.
    fn painted(shape: &Shape, pose: &ObjectPose) -> (RgbImage, GrayImage) {
        let outline = Outline::new(&Projector::new(&camera()), shape, pose, 8);
        let inside = |u: u32, v: u32| outline.contains(Vector2::new(f64::from(u), f64::from(v)));
        // The top is as large as the foot, on a plane at its height.
        let view = Projector::new(&camera());
        let top = |at: Vector2<f64>| {
            view.on_plane(at, shape.height()).is_some_and(|on| {
                let local = (pose.inverse() * Point::<World>::from(on)).coords();
                shape.is_below(local.x, local.y)
            })
        };
        let image = RgbImage::from_fn(1280, 720, |u, v| {
            let at = Vector2::new(f64::from(u), f64::from(v));
            Rgb(match (inside(u, v), top(at)) {
                (false, _) => [200, 176, 144],
                (true, true) => [220, 60, 60],
                (true, false) => [150, 30, 30],
            })
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
            let found = measure(&Picture::new(&image), &image, &camera(), &mask).unwrap();
            let at = found.world_from_object.origin();
            assert!((at.xy() - Vector2::new(x, y)).norm() < 2e-3, "{shape:?}: {found:?}");
            assert!((found.shape.height() - shape.height()).abs() < 2e-3, "{shape:?}: {found:?}");
            let off = match (&found.shape, &shape) {
                (Shape::Cuboid { size: a }, Shape::Cuboid { size: b }) => {
                    let [a, b] =
                        [a, b].map(|s: &Vector3<f64>| Vector2::new(s.x.min(s.y), s.x.max(s.y)));
                    (a - b).amax()
                }
                (Shape::Cylinder { radius: a, .. }, Shape::Cylinder { radius: b, .. }) => {
                    (a - b).abs()
                }
                _ => f64::INFINITY,
            };
            assert!(off < 2e-3, "{shape:?}: {found:?}");
            // The longer side is told first, and lies as it does.
            if let (Shape::Cuboid { size: own }, Shape::Cuboid { size }) = (&found.shape, &shape) {
                let turned = yaw + if size.y > size.x { FRAC_PI_2 } else { 0.0 };
                let off = (found.world_from_object.yaw() - turned).sin().abs();
                let is_square = (size.x - size.y).abs() < 1e-9;
                assert!(own.x >= own.y && (is_square || off < 0.05), "{shape:?}: {found:?}");
            }
            assert!(found.size_std.iter().all(|std| *std < 2e-3), "{found:?}");
            assert!(found.colour[0] >= 150 && found.colour[1] <= 60, "{found:?}");
        }
    }

    /// A box of 75 x 121 x 82 mm was measured as 117 x 83 x 106 mm ± 1.2 mm, its shadow as a part of it.
    #[test]
    fn a_cast_shadow_is_no_part_of_a_thing() {
        let shape = Shape::Cuboid { size: Vector3::new(0.075, 0.12, 0.08) };
        let pose = ObjectPose::upright(0.6, 0.1, 0.0, 0.5);
        let (mut image, mut mask) = painted(&shape, &pose);
        // The lamp is low on one side; a third of the light is left.
        let foot = Shape::Cuboid { size: Vector3::new(0.075, 0.12, 1e-3) };
        let view = Projector::new(&camera());
        let solid = Outline::new(&view, &shape, &pose, 8);
        for step in 0..12 {
            let by = 0.004 * f64::from(step);
            let there = ObjectPose::upright(0.6 + by, 0.1 - by, 0.0, 0.5);
            let shadow = Outline::new(&view, &foot, &there, 8);
            for (u, v, pixel) in image.enumerate_pixels_mut() {
                let at = Vector2::new(f64::from(u), f64::from(v));
                if shadow.contains(at) && !solid.contains(at) {
                    *pixel = Rgb([118, 103, 84]);
                    mask.put_pixel(u, v, Luma([255]));
                }
            }
        }
        let lit = without_shadow(&image, &mask).unwrap();
        assert_eq!(without_shadow(&image, &lit), None);
        let found = measure(&Picture::new(&image), &image, &camera(), &lit).unwrap();
        let Shape::Cuboid { size } = found.shape else { panic!("{found:?}") };
        let sides = Vector3::new(size.x.min(size.y), size.x.max(size.y), size.z);
        assert!((sides - Vector3::new(0.075, 0.12, 0.08)).amax() < 3e-3, "{found:?}");
        let off = found.world_from_object.origin().xy() - Vector2::new(0.6, 0.1);
        assert!(off.norm() < 3e-3, "{found:?}");
    }

    /// Two boxes of 70 and 50 mm height side by side were told as one of 100 x 80 x 69 mm ± 1.4 mm.
    #[test]
    fn what_leaves_a_solid_over_a_stretch_is_refused() {
        let cuboid = |y, z| Shape::Cuboid { size: Vector3::new(0.08, y, z) };
        let (mut image, mut mask) =
            painted(&cuboid(0.05, 0.07), &ObjectPose::upright(0.5, -0.15, 0.0, 0.0));
        let (lower, of_lower) =
            painted(&cuboid(0.05, 0.05), &ObjectPose::upright(0.5, -0.1, 0.0, 0.0));
        for (u, v, is_lower) in of_lower.enumerate_pixels() {
            // The lower one is nearer to the camera.
            if is_lower.0[0] > 0 {
                mask.put_pixel(u, v, Luma([255]));
                image.put_pixel(u, v, *lower.get_pixel(u, v));
            }
        }
        let found = measure(&Picture::new(&image), &image, &camera(), &mask);
        assert!(found.is_err(), "{found:?}");
    }

    #[test]
    fn what_is_no_solid_is_refused() {
        let image = RgbImage::from_pixel(1280, 720, Rgb([200, 176, 144]));
        let empty = GrayImage::new(1280, 720);
        let found = measure(&Picture::new(&image), &image, &camera(), &empty);
        assert_eq!(found, Err(Unmeasured::Outline(Refused::Empty)));
        // An L on the table.
        let is_l = |u: u32, v: u32| {
            (500..700).contains(&u) && (300..500).contains(&v) && (u < 560 || v > 440)
        };
        let mask = GrayImage::from_fn(1280, 720, |u, v| Luma([if is_l(u, v) { 255 } else { 0 }]));
        assert!(measure(&Picture::new(&image), &image, &camera(), &mask).is_err());
        // A sheet: a box of 0 mm was written into a scene, which could then not be read.
        let sheet = Shape::Cuboid { size: Vector3::new(0.06, 0.056, 2e-4) };
        let (image, mask) = painted(&sheet, &ObjectPose::upright(0.6, 0.0, 0.0, 0.3));
        let found = measure(&Picture::new(&image), &image, &camera(), &mask);
        assert_eq!(found, Err(Unmeasured::Flat));
    }
}
