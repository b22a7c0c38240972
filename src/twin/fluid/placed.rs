//! A pose made ready to be applied to many points.

use nalgebra::{Isometry3, Vector3};

/// A pose as the images of the axes and of the origin: a point costs half of what a quaternion asks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed {
    axes: [Vector3<f32>; 3],
    origin: Vector3<f32>,
}

impl Placed {
    pub(super) fn new(pose: &Isometry3<f32>) -> Self {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| pose.rotation * axis);
        Self { axes, origin: pose.translation.vector }
    }

    /// Returns the image of a point.
    pub(super) fn point(&self, p: &Vector3<f32>) -> Vector3<f32> {
        self.vector(p) + self.origin
    }

    /// Returns the image of a direction.
    pub(super) fn vector(&self, v: &Vector3<f32>) -> Vector3<f32> {
        self.axes[0] * v.x + self.axes[1] * v.y + self.axes[2] * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, UnitQuaternion};

    #[test]
    fn it_does_what_the_pose_does() {
        let turn = UnitQuaternion::from_euler_angles(0.3, -1.1, 2.0);
        let pose = Isometry3::from_parts(Vector3::new(0.4, -0.2, 0.9).into(), turn);
        let p = Vector3::new(0.03, -0.05, 0.11);
        let placed = Placed::new(&pose);
        assert!((placed.point(&p) - (pose * Point3::from(p)).coords).norm() < 1e-6);
        assert!((placed.vector(&p) - turn * p).norm() < 1e-6);
    }
}
