//! From pixels to rays through a lens with distortion, quickly.
//!
//! Undoing the distortion takes a Newton search on the radius. A picture asks for it a million times with
//! the same lens, so the factor is tabulated over the squared radius and interpolated; the error is below
//! 1e-9 of the radius, far under a thousandth of a pixel.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::world::{Camera, Pixel, Point};

const STEPS: usize = 8192;

/// A camera made ready for drawing.
pub(super) struct Lens {
    camera: Camera,
    world_from_camera: Matrix3<f64>,
    /// The camera centre, m, world.
    pub(super) centre: Vector3<f64>,
    /// Undistortion factor over the squared distorted radius, and what one step of it is worth.
    factors: Vec<f64>,
    steps_per_unit: f64,
    /// Undistorted radius beyond which the lens model folds back on itself.
    fold: f64,
}

impl Lens {
    pub(super) fn new(camera: &Camera) -> Self {
        let i = camera.intrinsics;
        let reach = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
            .map(|(x, y): (f64, f64)| {
                // A pixel more than the image on every side.
                let u = f64::midpoint(f64::from(i.width), x * (f64::from(i.width) + 2.0));
                let v = f64::midpoint(f64::from(i.height), y * (f64::from(i.height) + 2.0));
                let y = (v - i.cy) / i.fy;
                Vector2::new((u - i.cx - i.skew * y) / i.fx, y).norm_squared()
            })
            .into_iter()
            .fold(0.0, f64::max);
        let steps_per_unit = STEPS as f64 / reach;
        let factors = (0..=STEPS + 1)
            .map(|k| {
                let r = (k as f64 / steps_per_unit).sqrt().max(1e-6);
                i.undistort(Vector2::new(r, 0.0)).x / r
            })
            .collect();
        Self {
            camera: *camera,
            world_from_camera: *camera.world_from_camera.rotation().to_rotation_matrix().matrix(),
            centre: camera.world_from_camera.origin(),
            factors,
            steps_per_unit,
            fold: fold(i.k1, i.k2),
        }
    }

    /// Returns the direction through `(u, v)` px, world, scaled so that camera z grows by 1.
    pub(super) fn direction(&self, u: f64, v: f64) -> Vector3<f64> {
        let i = &self.camera.intrinsics;
        let y = (v - i.cy) / i.fy;
        let x = (u - i.cx - i.skew * y) / i.fx;
        let at = (x * x + y * y) * self.steps_per_unit;
        let cell = (at as usize).min(STEPS);
        let s =
            self.factors[cell] + (self.factors[cell + 1] - self.factors[cell]) * (at - cell as f64);
        self.world_from_camera * Vector3::new(x * s, y * s, 1.0)
    }

    /// Returns a rectangle `[u0, v0, u1, v1]` of pixels that holds the picture of a box, or `None` when
    /// the box reaches behind the camera. `corners` are the box's, m, world.
    pub(super) fn frame(&self, corners: &[Vector3<f64>]) -> Option<[f64; 4]> {
        let camera_from_world = self.camera.world_from_camera.inverse();
        let mut rect = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        for &corner in corners {
            let p = (camera_from_world * Point::from(corner)).coords();
            if p.z < 0.02 {
                return None;
            }
            let mut n = Vector2::new(p.x / p.z, p.y / p.z);
            if n.norm() > self.fold {
                n *= self.fold / n.norm();
            }
            let Pixel { u, v } = self.camera.intrinsics.pixel(n);
            rect = [rect[0].min(u), rect[1].min(v), rect[2].max(u), rect[3].max(v)];
        }
        // The lens bows straight edges outwards between the corners. Over an edge of the length l (in
        // focal lengths) at radius r the bow is at most 6 |k1| r l² / 8: a tenth of l is ample.
        let pad = 3.0 + 0.1 * (rect[2] - rect[0]).max(rect[3] - rect[1]);
        Some([rect[0] - pad, rect[1] - pad, rect[2] + pad, rect[3] + pad])
    }
}

/// Returns the radius at which `r (1 + k1 r² + k2 r⁴)` stops growing.
fn fold(k1: f64, k2: f64) -> f64 {
    let mut r = 0.0_f64;
    while r < 10.0 {
        let r2 = r * r;
        if 1.0 + r2 * (3.0 * k1 + 5.0 * k2 * r2) < 0.05 {
            break;
        }
        r += 0.01;
    }
    r
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::Intrinsics;

    #[test]
    fn the_table_of_factors_agrees_with_the_camera_model() {
        let mut intrinsics = Intrinsics::centred(880.0, 1280, 720);
        (intrinsics.k1, intrinsics.k2, intrinsics.skew) = (-0.18, 0.04, 0.7);
        let camera =
            Camera::looking(intrinsics, Vector3::new(1.2, 0.1, 0.9), Vector3::new(0.5, 0.0, 0.0));
        let lens = Lens::new(&camera);
        for (u, v) in [(-0.5, -0.5), (0.0, 719.0), (640.2, 359.7), (1279.4, 719.4), (17.0, 300.0)] {
            let slow = camera.ray(Pixel::new(u, v)).direction;
            let quick = lens.direction(u, v).normalize();
            assert!((slow - quick).norm() < 1e-9, "{u} {v}: {}", (slow - quick).norm());
        }
    }
}
