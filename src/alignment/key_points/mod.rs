//! The paper's way: a mask's contour → key points → a solid on the table.
//!
//! The contour of a mask is moved onto the nearest edges of the picture. Of a cuboid its straight sides are
//! grouped by the three directions they can have (`cuboid`): neighbours of different directions meet in
//! corners, and the corners, seen on the table and at the known height, place the solid. Of a cylinder
//! (`cylinder`) the two upright sides and the arcs of foot and rim, which are pictures of circles, place
//! the axis. Of any other form the whole silhouette is laid onto the contour (`silhouette`). Shape and size are taken as known; where to cut is the caller's business, and the mask is all
//! that is shared with the search of [`super::placement`], so that each can judge the other.
//!
//! Source: the paper, section 2.2; Suzuki and Abe, CVGIP 1985 (borders); Douglas and Peucker, 1973.

mod cuboid;
mod cylinder;
mod silhouette;

use image::GrayImage;
use nalgebra::{DMatrix, Matrix3, Vector2, Vector3};
use thiserror::Error as ThisError;

use super::contour::{Border, Smoothness};
use super::evidence::Hidden;
use super::outline::{ObjectPose, Outline, Projector};
use super::picture::Picture;
use super::refine::strongest;
use crate::fit;
use crate::world::{Material, Object, Shape};

/// A point of a solid that was found in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyPoint {
    /// Where in the picture, px.
    pub pixel: Vector2<f64>,
    /// Where on the solid, m, object frame.
    pub body: Vector3<f64>,
}

/// A solid placed by the key points of its contour.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed {
    /// The key points, in order around the contour.
    pub points: Vec<KeyPoint>,
    /// Position on the table, m.
    pub x: f64,
    /// Position on the table, m.
    pub y: f64,
    /// Turn about z, rad, reduced by the shape's symmetry.
    pub yaw: f64,
    /// Covariance of x, y (m²) and yaw (rad²).
    pub covariance: Matrix3<f64>,
    /// Root mean square distance between the contour and that of the placed solid, px.
    pub rms_px: f64,
}

impl Placed {
    /// Returns the pose on the table.
    pub fn pose(&self) -> ObjectPose {
        ObjectPose::upright(self.x, self.y, 0.0, self.yaw)
    }

    /// Returns one standard deviation of the position in the worst direction on the table, m.
    pub fn std(&self) -> f64 {
        self.covariance.fixed_view::<2, 2>(0, 0).into_owned().symmetric_eigenvalues().max().sqrt()
    }
}

/// Why a contour places nothing.
#[derive(Debug, Clone, Copy, PartialEq, ThisError)]
pub enum Refused {
    /// The mask is empty or a few pixels large.
    #[error("the picture's own cut is empty")]
    Empty,
    /// The paper's failure: the contour is not smooth.
    #[error("the contour is not smooth: it has dents, spurs or a ragged border")]
    Ragged(Smoothness),
    /// Too much of the contour is hidden or leaves the picture.
    #[error("only {:.0} % of the contour is the object's own", 100.0 * .0)]
    Hidden(f64),
    /// The sides do not have the directions of a solid standing on the table.
    #[error("the contour has {0} key points, {1} are needed")]
    FewPoints(usize, usize),
    /// The solid of the known size does not fit the contour.
    #[error("the known solid misses the contour by {0:.1} px")]
    Misfit(f64),
}

/// The border of a mask, moved onto the picture's edges.
pub(super) struct Contour {
    /// Points about a pixel apart, px, in order.
    pub(super) pixels: Vec<Vector2<f64>>,
    /// Whether a point is the object's own: not at another thing's border or the picture's.
    pub(super) own: Vec<bool>,
    /// Unit normals pointing out, px.
    pub(super) normals: Vec<Vector2<f64>>,
}

/// How far from the mask's border an edge of the picture may be, px.
const SNAP_PX: f64 = 3.0;
/// Largest root mean square distance between contour and placed solid, as a part of the solid's size in
/// the picture.
const MISFIT: f64 = 0.06;

impl Contour {
    /// The contour of a mask that has to be smooth.
    pub(super) fn smooth(
        mask: &GrayImage,
        picture: &Picture,
        hidden: &Hidden,
        material: Material,
    ) -> Result<Self, Refused> {
        let border = Border::of(mask).ok_or(Refused::Empty)?;
        let smoothness = Smoothness::along(&border);
        if !smoothness.is_smooth() {
            return Err(Refused::Ragged(smoothness));
        }
        Self::along(&border, picture, hidden, material)
    }

    pub(super) fn of(
        mask: &GrayImage,
        picture: &Picture,
        hidden: &Hidden,
        material: Material,
    ) -> Result<Self, Refused> {
        let border = Border::of(mask).ok_or(Refused::Empty)?;
        Self::along(&border, picture, hidden, material)
    }

    fn along(
        border: &Border,
        picture: &Picture,
        hidden: &Hidden,
        material: Material,
    ) -> Result<Self, Refused> {
        let smooth = border.smooth(2.0);
        let n = smooth.len();
        let (w, h) = picture.size();
        let area: f64 = (0..n).map(|i| smooth[i].perp(&smooth[(i + 1) % n])).sum();
        let (full, lines) = match material {
            Material::Opaque => (2.4, false),
            Material::Transparent => (0.9, true),
        };
        let (mut pixels, mut own, mut normals) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..n {
            let along = smooth[(i + 2) % n] - smooth[(i + n - 2) % n];
            let Some(along) = along.try_normalize(1e-9) else { continue };
            let normal = Vector2::new(along.y, -along.x) * area.signum();
            // The border's pixels belong to the mask; the border lies half a pixel farther out.
            let p = smooth[i] + 0.5 * normal;
            let edge = strongest(picture, p, normal, (full, SNAP_PX, lines));
            let q = p + edge.map_or(0.0, |e| e.0) * normal;
            let inside = q.x > 3.0 && q.y > 3.0 && q.x < w as f64 - 4.0 && q.y < h as f64 - 4.0;
            own.push(inside && !hidden.covers(q) && !hidden.covers(q + 4.0 * normal));
            pixels.push(q);
            normals.push(normal);
        }
        let share = own.iter().filter(|o| **o).count() as f64 / own.len().max(1) as f64;
        if share < 0.5 {
            return Err(Refused::Hidden(share));
        }
        Ok(Self { pixels, own, normals })
    }

    /// Returns the area's centre, px.
    fn middle(&self) -> Vector2<f64> {
        let n = self.pixels.len();
        let (mut sum, mut area) = (Vector2::zeros(), 0.0);
        for i in 0..n {
            let (a, b) = (self.pixels[i], self.pixels[(i + 1) % n]);
            let cross = a.perp(&b);
            sum += cross * (a + b);
            area += 3.0 * cross;
        }
        sum / area
    }

    /// Returns where a solid of this size and turn stands for its silhouette to have this contour's middle.
    fn stand(&self, view: &Projector, shape: &Shape, yaw: f64) -> Option<ObjectPose> {
        let on_plane = |p: Vector2<f64>| view.on_plane(p, shape.height() / 2.0);
        let mut at = on_plane(self.middle())?;
        for _ in 0..4 {
            let pose = ObjectPose::upright(at.x, at.y, 0.0, yaw);
            let hull = Outline::new(view, shape, &pose, 4).hull;
            if hull.len() < 3 {
                return None;
            }
            let own = vec![true; hull.len()];
            let predicted = Self { pixels: hull, own, normals: Vec::new() };
            at += on_plane(self.middle())? - on_plane(predicted.middle())?;
        }
        Some(ObjectPose::upright(at.x, at.y, 0.0, yaw))
    }

    /// Returns the root mean square distance from the own points to a convex hull, px.
    fn distance(&self, hull: &[Vector2<f64>]) -> f64 {
        let (mut sum, mut n) = (0.0, 0.0);
        for (p, _) in self.pixels.iter().zip(&self.own).filter(|(_, own)| **own) {
            let mut least = f64::INFINITY;
            for (i, a) in hull.iter().enumerate() {
                let along = hull[(i + 1) % hull.len()] - a;
                let t = ((p - a).dot(&along) / along.norm_squared().max(1e-12)).clamp(0.0, 1.0);
                least = least.min((a + t * along - p).norm());
            }
            sum += least * least;
            n += 1.0;
        }
        f64::sqrt(sum / f64::max(n, 1.0))
    }
}

/// Places a solid of known shape on the table by the key points of its mask's contour.
///
/// # Errors
///
/// [`Refused`] says why the contour is of no use; the caller then has the mask-free search alone.
pub fn place(
    mask: &GrayImage,
    picture: &Picture,
    view: &Projector,
    object: &Object,
    hidden: &Hidden,
) -> Result<Placed, Refused> {
    // What is said to have a neck or petals need not have a smooth contour; whether it is that contour, the fit tells.
    let is_smooth = matches!(object.shape, Shape::Cuboid { .. } | Shape::Cylinder { .. });
    let of = if is_smooth { Contour::smooth } else { Contour::of };
    let contour = of(mask, picture, hidden, object.material)?;
    let placed = match object.shape {
        Shape::Cuboid { size } => cuboid::place(&contour, view, size)?,
        Shape::Cylinder { radius, height } => cylinder::place(&contour, view, radius, height)?,
        Shape::Lathe { .. } | Shape::Mesh { .. } | Shape::Mug { .. } => {
            silhouette::place(&contour, view, &object.shape)?
        }
    };
    let [u0, v0, u1, v1] = Outline::new(view, &object.shape, &placed.pose(), 4).bounds();
    if placed.rms_px > (MISFIT * (u1 - u0).min(v1 - v0)).max(2.0) {
        return Err(Refused::Misfit(placed.rms_px));
    }
    Ok(placed)
}

/// Returns x, y, yaw covariance from the first rows of a fit; a missing yaw is 0.
fn plane_covariance(covariance: &DMatrix<f64>) -> Matrix3<f64> {
    let n = covariance.nrows().min(3);
    Matrix3::from_fn(|i, j| if i < n && j < n { covariance[(i, j)] } else { 0.0 })
}

/// Robust options for `n` unknowns: residuals in px, scales in m and rad.
fn options(n: usize) -> fit::Options {
    fit::Options {
        loss: fit::Loss::Cauchy(2.0),
        max_iterations: 40,
        scales: vec![0.01; n],
        ..fit::Options::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::mug::Sizes;
    use crate::world::{Camera, Intrinsics, Mug, Profile};
    use image::{Luma, Rgb, RgbImage};
    use std::sync::Arc;

    fn view() -> Projector {
        let mut intrinsics = Intrinsics::centred(900.0, 1280, 720);
        (intrinsics.k1, intrinsics.k2) = (-0.12, 0.02);
        Projector::new(&Camera::looking(
            intrinsics,
            Vector3::new(1.25, 0.0, 0.85),
            Vector3::new(0.6, 0.0, 0.05),
        ))
    }

    fn object(shape: Shape) -> Object {
        Object {
            name: "thing".into(),
            kind: "Block".into(),
            shape,
            cavity: None,
            looks: "red".into(),
            material: Material::Opaque,
            colour: [180, 40, 30],
            mass: 0.1,
        }
    }

    /// A picture of one flat silhouette, and its mask.
    fn paint(view: &Projector, shape: &Shape, pose: &ObjectPose) -> (Picture, GrayImage) {
        let outline = Outline::whole(view, shape, pose, 40);
        let inside = |x: u32, y: u32| outline.contains(Vector2::new(f64::from(x), f64::from(y)));
        let image = RgbImage::from_fn(1280, 720, |x, y| {
            Rgb(if inside(x, y) { [180, 40, 30] } else { [200, 176, 144] })
        });
        let mask = GrayImage::from_fn(1280, 720, |x, y| Luma([if inside(x, y) { 255 } else { 0 }]));
        (Picture::new(&image), mask)
    }

    /// Corners and arcs of silhouettes through a lens give the poses back.
    #[test]
    fn silhouettes_give_their_poses_back() {
        let view = view();
        for (shape, x, y, yaw) in [
            (Shape::Cuboid { size: Vector3::new(0.065, 0.065, 0.14) }, 0.6, 0.1, 0.5),
            (Shape::Cuboid { size: Vector3::new(0.065, 0.065, 0.14) }, 0.5, -0.2, -0.6),
            (Shape::Cuboid { size: Vector3::new(0.12, 0.07, 0.08) }, 0.55, -0.15, 0.9),
            (Shape::Cuboid { size: Vector3::new(0.12, 0.07, 0.08) }, 0.6, 0.2, -1.2),
            (Shape::Cylinder { radius: 0.08, height: 0.095 }, 0.5, 0.2, 0.0),
            (Shape::Cylinder { radius: 0.035, height: 0.12 }, 0.65, -0.1, 0.0),
        ] {
            let pose = ObjectPose::upright(x, y, 0.0, yaw);
            let (picture, mask) = paint(&view, &shape, &pose);
            let placed =
                place(&mask, &picture, &view, &object(shape.clone()), &Hidden::default()).unwrap();
            let far = 1e3 * (placed.x - x).hypot(placed.y - y);
            let turn = reduced(placed.yaw - yaw, shape.symmetry());
            assert!(far < 0.8 && turn.abs() < 0.01, "{shape:?}: {far:.2} mm, {turn:.4} rad");
            assert!(far < 4e3 * placed.std(), "{shape:?}: {far:.2} mm, std {} m", placed.std());
            assert!(placed.points.len() >= 4, "{shape:?}: {:?}", placed.points);
            for point in &placed.points {
                let world = pose.isometry() * nalgebra::Point3::from(point.body);
                let miss = (view.pixel(world.coords).unwrap() - point.pixel).norm();
                // A rim's end slides along the rim for next to nothing.
                let slack = if shape.symmetry() > 0.0 { 2.0 } else { 6.0 };
                assert!(miss < slack, "{shape:?}: {point:?} is {miss:.1} px off");
            }
        }
    }

    /// A vase, a cup that opens upwards, a mug with its handle: by the whole silhouette.
    #[test]
    fn what_is_no_solid_is_placed_by_its_contour_too() {
        let view = view();
        let vase = [[0.03, 0.0], [0.04, 0.05], [0.032, 0.11]];
        let mug = Sizes { radius: 0.042, height: 0.1, handle: 0.032, thick: 0.01 };
        for (shape, x, y, yaw) in [
            (Shape::Lathe { profile: Profile::new(&vase).unwrap() }, 0.6, 0.1, 0.0),
            (Shape::Lathe { profile: Profile::cone(0.025, 0.04, 0.11).unwrap() }, 0.5, -0.2, 0.0),
            (Shape::Mug { mug: Arc::new(Mug::new(mug).unwrap()) }, 0.55, -0.1, 1.2),
        ] {
            let pose = ObjectPose::upright(x, y, 0.0, yaw);
            let (picture, mask) = paint(&view, &shape, &pose);
            let placed =
                place(&mask, &picture, &view, &object(shape.clone()), &Hidden::default()).unwrap();
            let far = 1e3 * (placed.x - x).hypot(placed.y - y);
            let turn = reduced(placed.yaw - yaw, shape.symmetry());
            assert!(far < 1.5 && turn.abs() < 0.03, "{shape:?}: {far:.2} mm, {turn:.4} rad");
            assert!(far < 4e3 * placed.std(), "{shape:?}: {far:.2} mm, std {} m", placed.std());
        }
    }

    fn reduced(turn: f64, symmetry: f64) -> f64 {
        if symmetry > 0.0 { turn - symmetry * (turn / symmetry).round() } else { 0.0 }
    }

    /// The paper's failure, and others: each is named, none is a pose.
    #[test]
    fn bad_masks_are_refused_by_name() {
        let view = view();
        let shape = Shape::Cuboid { size: Vector3::new(0.065, 0.065, 0.14) };
        let pose = ObjectPose::upright(0.6, 0.0, 0.0, 0.5);
        let (picture, mask) = paint(&view, &shape, &pose);
        let try_with = |mask: &GrayImage, hidden: &Hidden| {
            place(mask, &picture, &view, &object(shape.clone()), hidden)
        };
        let middle = view.pixel(Vector3::new(0.6, 0.0, 0.07)).unwrap();
        let mut bitten = mask.clone();
        for (x, y, p) in bitten.enumerate_pixels_mut() {
            let at = Vector2::new(f64::from(x), f64::from(y)) - middle;
            if (at - Vector2::new(35.0, 0.0)).norm() < 25.0 {
                p.0[0] = 0;
            }
        }
        let none = Hidden::default();
        assert!(matches!(try_with(&bitten, &none), Err(Refused::Ragged(_))));
        assert!(matches!(try_with(&GrayImage::new(1280, 720), &none), Err(Refused::Empty)));
        let all = GrayImage::from_pixel(1280, 720, Luma([255]));
        let behind = Hidden { mask: Some(Arc::new(all)), hulls: Vec::new() };
        assert!(matches!(try_with(&mask, &behind), Err(Refused::Hidden(_))));
        // A disc is no cuboid.
        let disc = GrayImage::from_fn(1280, 720, |x, y| {
            let at = Vector2::new(f64::from(x), f64::from(y)) - middle;
            Luma([if at.norm() < 50.0 { 255 } else { 0 }])
        });
        assert!(try_with(&disc, &none).is_err());
    }
}
