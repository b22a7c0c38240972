//! The camera model: a pinhole with skew, radial and tangential distortion, and where it stands.
//!
//! Conventions, stated once: camera x right, y down, z forward; [`Pixel`] `u` right, `v` down, (0, 0)
//! the centre of the top-left pixel. Distortion acts on normalised coordinates `x = X/Z`, `y = Y/Z`:
//! `x_d = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)` and
//! `y_d = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y` with `r² = x² + y²` (`OpenCV`'s five).
//! A file that lacks `p1`, `p2` or `k3` means 0. A lens of [`LensModel::Fisheye`] has `k1` to `k4` of its own meaning (`fisheye.rs`);
//! what distorts, undistorts and differentiates here asks which it is, so that nobody else has to.
//!
//! Source: Brown, "Close-range camera calibration", Photogrammetric Engineering 1971; `OpenCV`, "Camera Calibration and
//! 3D Reconstruction" (the order).
//!
//! Fitting a camera is [`crate::alignment`]'s work, drawing with one is [`crate::twin`]'s.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::frame::{Camera as CameraFrame, Point, Pose, World};
use super::{Window, fisheye};

/// A place in an image, px.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pixel {
    /// To the right, px.
    pub u: f64,
    /// Down, px.
    pub v: f64,
}

impl Pixel {
    /// Returns the pixel at `(u, v)`.
    pub fn new(u: f64, v: f64) -> Self {
        Self { u, v }
    }

    /// Returns the distance to another pixel, px.
    pub fn distance(self, other: Self) -> f64 {
        (self.u - other.u).hypot(self.v - other.v)
    }
}

/// What the terms of a lens mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LensModel {
    /// Brown's: a pinhole's picture, bent by `k1 k2 p1 p2 k3`.
    #[default]
    Brown,
    /// Kannala and Brandt's: the angle from the axis, bent by `k1 k2 k3 k4`; `p1` and `p2` are 0.
    Fisheye,
}

impl LensModel {
    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Brown => "brown",
            Self::Fisheye => "fisheye",
        }
    }

    /// Whether a file may leave it out.
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands it over so")]
    fn is_brown(&self) -> bool {
        *self == Self::Brown
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands it over so")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// What is inside the camera: focal lengths, principal point, skew, distortion, image size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Intrinsics {
    /// Focal length along u, px.
    pub fx: f64,
    /// Focal length along v, px.
    pub fy: f64,
    /// Principal point, u, px.
    pub cx: f64,
    /// Principal point, v, px.
    pub cy: f64,
    /// Skew, px: `u = fx x + skew y + cx`.
    pub skew: f64,
    /// First radial distortion coefficient.
    pub k1: f64,
    /// Second radial distortion coefficient.
    pub k2: f64,
    /// First tangential distortion coefficient.
    #[serde(default)]
    pub p1: f64,
    /// Second tangential distortion coefficient.
    #[serde(default)]
    pub p2: f64,
    /// Third radial distortion coefficient.
    #[serde(default)]
    pub k3: f64,
    /// Fourth radial distortion coefficient, of a fisheye only.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub k4: f64,
    /// What the terms mean.
    #[serde(default, skip_serializing_if = "LensModel::is_brown")]
    pub model: LensModel,
    /// Image width, px.
    pub width: u32,
    /// Image height, px.
    pub height: u32,
}

/// A slope of the distorted by the true radius below this is the fold of a lens, where both sides show the same pixel.
/// Chosen: at 0.05 a pixel's step is twenty in the scene, which no photograph is used at.
pub(super) const FOLD: f64 = 0.05;

impl Intrinsics {
    /// Returns a distortion-free camera with square pixels and the principal point in the centre.
    pub fn centred(focal_px: f64, width: u32, height: u32) -> Self {
        Self {
            fx: focal_px,
            fy: focal_px,
            cx: (f64::from(width) - 1.0) / 2.0,
            cy: (f64::from(height) - 1.0) / 2.0,
            skew: 0.0,
            k1: 0.0,
            k2: 0.0,
            p1: 0.0,
            p2: 0.0,
            k3: 0.0,
            k4: 0.0,
            model: LensModel::Brown,
            width,
            height,
        }
    }

    /// The terms of a fisheye.
    fn angular(&self) -> [f64; 4] {
        [self.k1, self.k2, self.k3, self.k4]
    }

    /// A pixel before the lens's distortion is undone.
    fn bent(&self, pixel: Pixel) -> Vector2<f64> {
        let y = (pixel.v - self.cy) / self.fy;
        Vector2::new((pixel.u - self.cx - self.skew * y) / self.fx, y)
    }

    /// Returns the same lens before `width` pixels across, as many down as keep the picture's shape, and how many of them
    /// make one of now. The outer edges of the picture stay where they are.
    fn resized(&self, width: u32) -> (Self, f64) {
        let scale = f64::from(width) / f64::from(self.width.max(1));
        let height = (f64::from(self.height) * scale).round().max(1.0) as u32;
        let centre = |c: f64| (c + 0.5) * scale - 0.5;
        let (cx, cy) = (centre(self.cx), centre(self.cy));
        let (fx, fy, skew) = (self.fx * scale, self.fy * scale, self.skew * scale);
        (Self { fx, fy, cx, cy, skew, width, height, ..*self }, scale)
    }

    /// Returns what a window of the picture is taken with: the same lens, and pixels counted from the window's corner.
    #[must_use]
    pub fn within(&self, window: &Window) -> Self {
        let (cx, cy) = (self.cx - f64::from(window.u), self.cy - f64::from(window.v));
        Self { cx, cy, width: window.width, height: window.height, ..*self }
    }

    /// Returns the paper's matrix I (Eq. 4) without its last column.
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::new(self.fx, self.skew, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0)
    }

    /// Returns the pixel of normalised, undistorted image coordinates.
    #[inline]
    pub fn pixel(&self, normalised: Vector2<f64>) -> Pixel {
        let d = self.distort(normalised);
        Pixel::new(self.fx * d.x + self.skew * d.y + self.cx, self.fy * d.y + self.cy)
    }

    /// Returns the normalised, undistorted image coordinates of a pixel; of a fisheye those of 89° from the axis for all that is farther.
    pub fn normalise(&self, pixel: Pixel) -> Vector2<f64> {
        self.undistort(self.bent(pixel))
    }

    /// Returns the unit direction of a pixel's ray, camera axes; a fisheye's may point backwards.
    pub fn direction(&self, pixel: Pixel) -> Vector3<f64> {
        match self.model {
            LensModel::Brown => {
                let n = self.normalise(pixel);
                Vector3::new(n.x, n.y, 1.0).normalize()
            }
            LensModel::Fisheye => {
                let d = self.bent(pixel);
                let angle = fisheye::angle(self.angular(), d.norm());
                let outwards = d.try_normalize(f64::MIN_POSITIVE).unwrap_or_default();
                let (sin, cos) = angle.sin_cos();
                Vector3::new(sin * outwards.x, sin * outwards.y, cos)
            }
        }
    }

    /// Returns the distorted coordinates of a point of the camera's frame, `None` where the lens cannot see: behind the camera, of a
    /// fisheye straight behind.
    pub fn shown(&self, p: Vector3<f64>) -> Option<Vector2<f64>> {
        match self.model {
            LensModel::Brown => (p.z > 1e-9).then(|| self.distort(p.xy() / p.z)),
            LensModel::Fisheye => fisheye::shown_at(self.angular(), p),
        }
    }

    /// Returns the derivatives of [`Self::shown`] by the point, and by the lens's terms in the order `k1 k2 p1 p2 k3 k4`.
    pub fn shown_slopes(&self, p: Vector3<f64>) -> (Matrix2x3<f64>, [Vector2<f64>; 6]) {
        if self.model == LensModel::Fisheye {
            let [k1, k2, k3, k4] = fisheye::by_terms(p);
            let by_terms = [k1, k2, Vector2::zeros(), Vector2::zeros(), k3, k4];
            return (fisheye::shown_slope(self.angular(), p), by_terms);
        }
        let n = p.xy() / p.z;
        let normal_from_point =
            Matrix2x3::new(1.0 / p.z, 0.0, -n.x / p.z, 0.0, 1.0 / p.z, -n.y / p.z);
        let r2 = n.norm_squared();
        let xy = 2.0 * n.x * n.y;
        let by_terms = [
            n * r2,
            n * (r2 * r2),
            Vector2::new(xy, r2 + 2.0 * n.y * n.y),
            Vector2::new(r2 + 2.0 * n.x * n.x, xy),
            n * (r2 * r2 * r2),
            Vector2::zeros(),
        ];
        (self.distortion_slope(n) * normal_from_point, by_terms)
    }

    /// Returns whether a fisheye shows the angles from the axis one after the other as far as a pixel, and no farther than normalised
    /// coordinates go; of another lens nothing is known.
    pub fn is_even_to(&self, pixel: Pixel) -> Option<bool> {
        let k = self.angular();
        (self.model == LensModel::Fisheye).then(|| {
            fisheye::grows_to(k, fisheye::angle(k, self.bent(pixel).norm()).min(fisheye::WIDEST))
        })
    }

    /// Applies the distortion to normalised coordinates.
    #[inline]
    pub fn distort(&self, n: Vector2<f64>) -> Vector2<f64> {
        if self.model == LensModel::Fisheye {
            return fisheye::distort(self.angular(), n);
        }
        let r2 = n.norm_squared();
        let radial = n * (1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3)));
        if self.is_radial() {
            return radial;
        }
        let xy = 2.0 * n.x * n.y;
        radial
            + Vector2::new(
                self.p1 * xy + self.p2 * (r2 + 2.0 * n.x * n.x),
                self.p1 * (r2 + 2.0 * n.y * n.y) + self.p2 * xy,
            )
    }

    /// Returns the derivatives of [`Self::distort`] by the normalised coordinates.
    pub fn distortion_slope(&self, n: Vector2<f64>) -> Matrix2<f64> {
        if self.model == LensModel::Fisheye {
            return fisheye::slope(self.angular(), n);
        }
        let r2 = n.norm_squared();
        let radial = Matrix2::identity() * (1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3)))
            + n * n.transpose() * (2.0 * (self.k1 + r2 * (2.0 * self.k2 + r2 * 3.0 * self.k3)));
        if self.is_radial() {
            return radial;
        }
        let across = 2.0 * (self.p1 * n.x + self.p2 * n.y);
        radial
            + Matrix2::new(
                2.0 * self.p1 * n.y + 6.0 * self.p2 * n.x,
                across,
                across,
                6.0 * self.p1 * n.y + 2.0 * self.p2 * n.x,
            )
    }

    /// Returns whether the lens has no tangential terms, so that it is the same all round.
    #[inline]
    pub fn is_radial(&self) -> bool {
        self.p1 == 0.0 && self.p2 == 0.0
    }

    /// Removes the distortion: by Newton's method on the radius, then on both coordinates where it is tangential.
    pub fn undistort(&self, d: Vector2<f64>) -> Vector2<f64> {
        if self.model == LensModel::Fisheye {
            return fisheye::undistort(self.angular(), d);
        }
        let n = self.undistort_radius(d);
        if self.is_radial() {
            return n;
        }
        let mut at = n;
        for _ in 0..12 {
            let slope = self.distortion_slope(at);
            // Past the fold the map turns over; stay on the near branch.
            let Some(back) = slope.try_inverse().filter(|_| slope.determinant() > FOLD * FOLD)
            else {
                return at;
            };
            let step = back * (self.distort(at) - d);
            at -= step;
            if step.norm() < 1e-14 {
                break;
            }
        }
        at
    }

    /// Removes the radial distortion.
    fn undistort_radius(&self, d: Vector2<f64>) -> Vector2<f64> {
        let rd = d.norm();
        if rd < 1e-12 {
            return d;
        }
        let mut r = rd;
        for _ in 0..12 {
            let r2 = r * r;
            let f = r * (1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))) - rd;
            let slope = 1.0 + r2 * (3.0 * self.k1 + r2 * (5.0 * self.k2 + r2 * (7.0 * self.k3)));
            // Past the fold of a strong barrel lens the slope vanishes; stay on the near branch.
            if slope < FOLD {
                break;
            }
            let step = f / slope;
            r -= step;
            if step.abs() < 1e-14 {
                break;
            }
        }
        d * (r / rd)
    }

    /// Returns whether the pixel lies in the image.
    pub fn contains(&self, p: Pixel) -> bool {
        p.u >= -0.5
            && p.v >= -0.5
            && p.u < f64::from(self.width) - 0.5
            && p.v < f64::from(self.height) - 0.5
    }
}

/// A camera in the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// What is inside.
    pub intrinsics: Intrinsics,
    /// Where it stands.
    pub world_from_camera: Pose<World, CameraFrame>,
}

/// A half-line from the camera centre, in world coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// The camera centre, m.
    pub origin: Vector3<f64>,
    /// Unit direction.
    pub direction: Vector3<f64>,
}

impl Ray {
    /// Returns the point of the ray on the plane `normal · p = offset`, or `None` when it never meets it.
    ///
    /// This is the paper's use of a known plane to solve Eq. 6 for the 3D point.
    pub fn meet_plane(&self, normal: Vector3<f64>, offset: f64) -> Option<Point<World>> {
        let slope = normal.dot(&self.direction);
        if slope.abs() < 1e-9 {
            return None;
        }
        let t = (offset - normal.dot(&self.origin)) / slope;
        (t > 0.0).then(|| Point::from(self.origin + self.direction * t))
    }
}

impl Camera {
    /// Returns a camera at `eye` looking at `target` (m, world), image upright as seen with world z up.
    pub fn looking(intrinsics: Intrinsics, eye: Vector3<f64>, target: Vector3<f64>) -> Self {
        let z = (target - eye).normalize();
        let up = if z.cross(&Vector3::z()).norm() > 1e-6 { Vector3::z() } else { Vector3::x() };
        let x = z.cross(&up).normalize();
        let y = z.cross(&x);
        let rotation =
            nalgebra::Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, z]));
        Self { intrinsics, world_from_camera: Pose::from_parts(eye, rotation.into()) }
    }

    /// Returns the camera that a window of the picture is taken with.
    #[must_use]
    pub fn within(&self, window: &Window) -> Self {
        Self { intrinsics: self.intrinsics.within(window), ..*self }
    }

    /// Returns this camera with pictures of `width` pixels across that show the same, and how many of their pixels make one
    /// of now.
    pub fn resized(&self, width: u32) -> (Self, f64) {
        let (intrinsics, scale) = self.intrinsics.resized(width);
        (Self { intrinsics, ..*self }, scale)
    }

    /// Returns the pixel of a world point, or `None` when it lies behind the camera.
    #[inline]
    pub fn project(&self, point: Point<World>) -> Option<Pixel> {
        self.project_with_depth(point).map(|(pixel, _)| pixel)
    }

    /// As [`Self::project`], with the depth along camera z, m.
    #[inline]
    pub fn project_with_depth(&self, point: Point<World>) -> Option<(Pixel, f64)> {
        let p = (self.world_from_camera.inverse() * point).coords();
        (p.z > 1e-6).then(|| (self.intrinsics.pixel(Vector2::new(p.x / p.z, p.y / p.z)), p.z))
    }

    /// Returns the ray through a pixel.
    pub fn ray(&self, pixel: Pixel) -> Ray {
        let direction = self.world_from_camera.rotation() * self.intrinsics.direction(pixel);
        Ray { origin: self.world_from_camera.origin(), direction: direction.normalize() }
    }

    /// Returns the world point of a pixel on the horizontal plane at height `z` m, if it is in view.
    pub fn on_plane(&self, pixel: Pixel, z: f64) -> Option<Point<World>> {
        self.ray(pixel).meet_plane(Vector3::z(), z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        let mut intrinsics = Intrinsics::centred(900.0, 1280, 720);
        intrinsics.k1 = -0.12;
        intrinsics.k2 = 0.03;
        intrinsics.skew = 0.4;
        Camera::looking(intrinsics, Vector3::new(1.25, 0.0, 0.85), Vector3::new(0.6, 0.0, 0.05))
    }

    #[test]
    fn a_table_point_comes_back_from_its_pixel() {
        let camera = camera();
        for (x, y) in [(0.5, 0.0), (0.3, -0.3), (0.8, 0.25)] {
            let pixel = camera.project(Point::new(x, y, 0.0)).unwrap();
            let back = camera.on_plane(pixel, 0.0).unwrap().coords();
            assert!((back - Vector3::new(x, y, 0.0)).norm() < 1e-9, "{back:?}");
        }
    }

    #[test]
    fn all_five_terms_are_undone() {
        let mut k = camera().intrinsics;
        (k.p1, k.p2, k.k3) = (1.2e-3, -8e-4, 0.05);
        for n in [Vector2::new(0.55, -0.3), Vector2::new(-0.6, 0.35), Vector2::zeros()] {
            assert!((k.undistort(k.distort(n)) - n).norm() < 1e-12, "{n:?}");
        }
    }

    /// Worked by hand from Brown's formula: x = 0.2, y = 0.1, so r² = 0.05.
    #[test]
    fn the_terms_are_browns_in_opencvs_order() {
        let mut k = Intrinsics::centred(1.0, 1, 1);
        (k.p1, k.p2, k.k3) = (0.01, -0.02, 2.0);
        let d = k.distort(Vector2::new(0.2, 0.1)) - Vector2::new(0.2, 0.1);
        assert!((d.x - (0.2 * 2.0 * 0.05_f64.powi(3) + 0.02 * 0.02 - 0.02 * 0.13)).abs() < 1e-15);
        assert!((d.y - (0.1 * 2.0 * 0.05_f64.powi(3) + 0.01 * 0.07 - 0.04 * 0.02)).abs() < 1e-15);
    }

    #[test]
    fn a_file_with_fewer_terms_is_read() {
        let old = r#"{"fx":1.0,"fy":1.0,"cx":0.0,"cy":0.0,"skew":0.0,"k1":-0.2,"k2":0.1,"width":4,"height":3}"#;
        let k: Intrinsics = serde_json::from_str(old).unwrap();
        assert!(k.is_radial() && k.k3 == 0.0);
    }

    #[test]
    fn the_image_is_upright_and_not_mirrored() {
        let camera = camera();
        let low = camera.project(Point::new(0.6, 0.0, 0.0)).unwrap();
        let high = camera.project(Point::new(0.6, 0.0, 0.2)).unwrap();
        assert!(high.v < low.v, "higher points are further up in the picture");
        // The camera looks along -x, so world +y is on its right.
        let right = camera.project(Point::new(0.6, 0.1, 0.0)).unwrap();
        assert!(right.u > low.u);
    }
}
