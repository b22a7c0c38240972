//! Where points of the world and of an object are in a picture, and the lines of sight back.
//!
//! A camera is unpacked once, and an object's pose once more, since the search for a thing asks for millions of points. Which
//! points of a solid are worth asking for is [`super`]'s.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::world::frame::times;
use crate::world::{Camera, Intrinsics, Pixel, Pose, frame};

/// A pose of an object in the world.
pub type ObjectPose = Pose<frame::World, frame::Object>;

/// A camera unpacked for projecting many points.
#[derive(Debug, Clone, Copy)]
pub struct Projector {
    rotation: Matrix3<f64>,
    shift: Vector3<f64>,
    eye: Vector3<f64>,
    /// What is inside the camera.
    pub intrinsics: Intrinsics,
}

impl Projector {
    /// Unpacks a camera.
    pub fn new(camera: &Camera) -> Self {
        let inverse = camera.world_from_camera.inverse();
        Self {
            rotation: inverse.rotation().to_rotation_matrix().into_inner(),
            shift: inverse.origin(),
            eye: camera.world_from_camera.origin(),
            intrinsics: camera.intrinsics,
        }
    }

    /// Returns the pixel of a world point, `None` behind the camera.
    #[inline]
    pub fn pixel(&self, point: Vector3<f64>) -> Option<Vector2<f64>> {
        pixel(&self.intrinsics, times(&self.rotation, &point) + self.shift)
    }

    /// Returns what projects the points of an object at a pose.
    pub(super) fn of(&self, pose: &ObjectPose) -> PointsOf {
        let turn = pose.rotation().to_rotation_matrix();
        PointsOf {
            rotation: self.rotation * turn.matrix(),
            shift: times(&self.rotation, &pose.origin()) + self.shift,
            intrinsics: self.intrinsics,
        }
    }

    /// Returns the unit direction from the eye through a pixel, world; lines of sight are straight again.
    pub fn ray(&self, pixel: Vector2<f64>) -> Vector3<f64> {
        let n = self.intrinsics.normalise(Pixel::new(pixel.x, pixel.y));
        (self.rotation.transpose() * Vector3::new(n.x, n.y, 1.0)).normalize()
    }

    /// Returns the pixel of a direction from the eye, `None` when it points behind the camera.
    pub fn pixel_of(&self, direction: Vector3<f64>) -> Option<Vector2<f64>> {
        self.pixel(self.eye + direction.try_normalize(1e-12)?)
    }

    /// Returns where a pixel's line of sight meets the level plane at height `z` m; `None` beyond 10 m.
    pub fn on_plane(&self, pixel: Vector2<f64>, z: f64) -> Option<Vector3<f64>> {
        let ray = self.ray(pixel);
        let far = (z - self.eye.z) / ray.z;
        (far > 0.0 && far < 10.0).then(|| self.eye + far * ray)
    }

    /// Returns the camera centre, m, world.
    pub fn eye(&self) -> Vector3<f64> {
        self.eye
    }
}

/// Returns the pixel of a point in the camera's frame, `None` behind the camera.
#[inline]
fn pixel(intrinsics: &Intrinsics, p: Vector3<f64>) -> Option<Vector2<f64>> {
    if p.z <= 0.02 {
        return None;
    }
    let pixel = intrinsics.pixel(Vector2::new(p.x / p.z, p.y / p.z));
    Some(Vector2::new(pixel.u, pixel.v))
}

/// Projects points of an object that is somewhere: the search for a thing asks for millions.
#[derive(Debug, Clone, Copy)]
pub(super) struct PointsOf {
    rotation: Matrix3<f64>,
    shift: Vector3<f64>,
    intrinsics: Intrinsics,
}

impl PointsOf {
    /// Returns the pixel of a point, m, object frame; `None` behind the camera.
    #[inline]
    pub(super) fn pixel(&self, body: Vector3<f64>) -> Option<Vector2<f64>> {
        pixel(&self.intrinsics, times(&self.rotation, &body) + self.shift)
    }
}
