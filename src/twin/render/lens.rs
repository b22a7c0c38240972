//! From pixels to rays through a lens with distortion, quickly.
//!
//! Undoing the distortion takes a Newton search on the radius. A picture asks for it a million times with
//! the same lens, so the factor is tabulated over the squared radius and interpolated; the error is below
//! 2e-8 of the radius, a few hundred-thousandths of a pixel. A lens with tangential terms is not the same all round, and a
//! fisheye's factor has no end; their pixels are searched one by one. What a fisheye shows at 89° from its axis or farther is drawn as what is
//! there.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use nalgebra::{Matrix3, Vector2, Vector3};
use rayon::prelude::*;
use wide::f32x4;

use super::vectors::Four3;

use crate::world::frame::times;
use crate::world::{Camera, Intrinsics, LensModel};

/// Entries of the table per unit of the squared radius: linear interpolation between so many leaves the error named above. They do
/// not depend on the picture's size, so that a part of a picture is drawn as it is in the whole, up to [`WIDE`].
const DENSE: f64 = 4096.0;

/// The squared radius up to which a table is as dense: 55 deg from the axis. Of lenses that see farther it is half as dense for
/// each doubling.
const WIDE: f64 = 2.0;

/// A camera made ready for drawing.
pub(super) struct Lens {
    intrinsics: Intrinsics,
    world_from_camera: Matrix3<f64>,
    /// The same in single precision.
    single_turn: Matrix3<f32>,
    /// The camera centre, m, world.
    pub(super) centre: Vector3<f64>,
    /// Undistortion factor over the squared distorted radius, and what one step of it is worth.
    factors: Vec<f64>,
    steps_per_unit: f64,
    /// The last step that is asked for.
    last: usize,
    /// The same in single precision: the factor at each step, and how much more it is at the next.
    single: Vec<[f32; 2]>,
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
        let doublings = (reach / WIDE).log2().ceil().clamp(0.0, 64.0);
        let steps_per_unit = DENSE / doublings.exp2();
        let last = (reach * steps_per_unit).ceil().max(1.0) as usize;
        let factors: Vec<f64> = (0..last + 2)
            .into_par_iter()
            .with_min_len(512)
            .map(|k| {
                let r = (k as f64 / steps_per_unit).sqrt().max(1e-6);
                i.undistort(Vector2::new(r, 0.0)).x / r
            })
            .collect();
        let single = factors.windows(2).map(|f| [f[0] as f32, (f[1] - f[0]) as f32]).collect();
        let turn = *camera.world_from_camera.rotation().to_rotation_matrix().matrix();
        Self {
            intrinsics: i,
            world_from_camera: turn,
            single_turn: turn.cast(),
            centre: camera.world_from_camera.origin(),
            factors,
            steps_per_unit,
            last,
            single,
        }
    }

    /// Returns how the camera is turned in the world.
    pub(super) fn world_from_camera(&self) -> &Matrix3<f64> {
        &self.world_from_camera
    }

    /// Returns whether the lens has a table of factors, so that [`Self::four`] can be asked.
    pub(super) fn is_radial(&self) -> bool {
        self.intrinsics.is_radial() && self.intrinsics.model == LensModel::Brown
    }

    /// Returns `x/z` and `y/z` in camera coordinates of the rays through the four pixels from `(u, v)` to the right; of a lens
    /// that is the same all round.
    #[inline]
    pub(super) fn four(&self, u: usize, v: usize) -> [f32x4; 2] {
        let i = &self.intrinsics;
        let y = (v as f64 - i.cy) / i.fy;
        let from = (u as f64 - i.cx - i.skew * y) / i.fx;
        let step = (1.0 / i.fx) as f32;
        let x = f32x4::splat(from as f32) + f32x4::from([0.0, step, 2.0 * step, 3.0 * step]);
        self.undistorted(x, f32x4::splat(y as f32))
    }

    /// Returns the directions (unit, world) through four places of the picture, `offsets` px right of and below the pixel
    /// `(u, v)`, and how long they are where camera z grows by 1.
    #[inline(always)]
    pub(super) fn four_rays(
        &self,
        (u, v): (usize, usize),
        [right, below]: [f32x4; 2],
    ) -> (Four3, f32x4) {
        let [x, y] = if self.is_radial() {
            let i = &self.intrinsics;
            let y = (v as f64 - i.cy) / i.fy;
            let x = (u as f64 - i.cx - i.skew * y) / i.fx;
            let below = below * f32x4::splat((1.0 / i.fy) as f32);
            let right = right * f32x4::splat((1.0 / i.fx) as f32)
                - below * f32x4::splat((i.skew / i.fx) as f32);
            self.undistorted(f32x4::splat(x as f32) + right, f32x4::splat(y as f32) + below)
        } else {
            let (right, below) = (right.to_array(), below.to_array());
            let mut places = [[0.0_f32; 4]; 2];
            for k in 0..4 {
                let at = |at: usize, off: f32| at as f64 + f64::from(off);
                let n = self.undistort(at(u, right[k]), at(v, below[k]));
                (places[0][k], places[1][k]) = (n.x as f32, n.y as f32);
            }
            places.map(f32x4::from)
        };
        self.through(x, y)
    }

    /// Returns the directions (unit, world) through places `right` and `below` px of the pixel `(u, v)` and of three that follow it
    /// `apart` px from each other: the same of each, whatever the others are.
    #[inline(always)]
    pub(super) fn rays_beside(
        &self,
        (u, v): (usize, usize),
        apart: usize,
        [right, below]: [f32; 2],
    ) -> Four3 {
        let (mut xs, mut ys) = ([0.0_f32; 4], [0.0_f32; 4]);
        let i = &self.intrinsics;
        for k in 0..4 {
            let u = (u + k * apart) as f64 + f64::from(right);
            let v = v as f64 + f64::from(below);
            if self.is_radial() {
                let y = (v - i.cy) / i.fy;
                (xs[k], ys[k]) = (((u - i.cx - i.skew * y) / i.fx) as f32, y as f32);
            } else {
                let n = self.undistort(u, v);
                (xs[k], ys[k]) = (n.x as f32, n.y as f32);
            }
        }
        let (x, y) = (f32x4::from(xs), f32x4::from(ys));
        let [x, y] = if self.is_radial() { self.undistorted(x, y) } else { [x, y] };
        self.through(x, y).0
    }

    /// Returns directions (unit, world) of which `x/z` and `y/z` in camera coordinates are given, and how long they are where camera z
    /// grows by 1.
    #[inline(always)]
    fn through(&self, x: f32x4, y: f32x4) -> (Four3, f32x4) {
        let d = Four3 { x, y, z: f32x4::splat(1.0) };
        let length = d.norm();
        (d.turned(&self.single_turn) * (f32x4::splat(1.0) / length), length)
    }

    /// Returns `x/z` and `y/z` through `(u, v)` px.
    #[inline]
    fn undistort(&self, u: f64, v: f64) -> Vector2<f64> {
        let i = &self.intrinsics;
        let y = (v - i.cy) / i.fy;
        i.undistort(Vector2::new((u - i.cx - i.skew * y) / i.fx, y))
    }

    /// Takes the distortion off four places; of a lens that is the same all round.
    #[inline(always)]
    fn undistorted(&self, x: f32x4, y: f32x4) -> [f32x4; 2] {
        let at = (x * x + y * y) * f32x4::splat(self.steps_per_unit as f32);
        let cells = at.fast_min(f32x4::splat(self.last as f32)).fast_trunc_int();
        let (mut start, mut more) = ([0.0; 4], [0.0; 4]);
        for (k, cell) in cells.to_array().into_iter().enumerate() {
            [start[k], more[k]] = self.single[cell as usize];
        }
        let over = at - f32x4::from_i32x4(cells);
        let factor = f32x4::from(start) + f32x4::from(more) * over;
        [x * factor, y * factor]
    }

    /// Returns the direction through `(u, v)` px, world, scaled so that camera z grows by 1.
    #[inline]
    pub(super) fn direction(&self, u: f64, v: f64) -> Vector3<f64> {
        let i = &self.intrinsics;
        let y = (v - i.cy) / i.fy;
        let x = (u - i.cx - i.skew * y) / i.fx;
        if !self.is_radial() {
            let n = self.undistort(u, v);
            return times(&self.world_from_camera, &Vector3::new(n.x, n.y, 1.0));
        }
        let at = (x * x + y * y) * self.steps_per_unit;
        let cell = (at as usize).min(self.last);
        let s =
            self.factors[cell] + (self.factors[cell + 1] - self.factors[cell]) * (at - cell as f64);
        times(&self.world_from_camera, &Vector3::new(x * s, y * s, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::Pixel;

    #[test]
    fn the_table_of_factors_agrees_with_the_camera_model() {
        let mut intrinsics = Intrinsics::centred(880.0, 1280, 720);
        (intrinsics.k1, intrinsics.k2, intrinsics.skew) = (-0.18, 0.04, 0.7);
        for (p1, p2, k3) in [(0.0, 0.0, 0.0), (1e-3, -2e-3, 0.02)] {
            (intrinsics.p1, intrinsics.p2, intrinsics.k3) = (p1, p2, k3);
            let (eye, target) = (Vector3::new(1.2, 0.1, 0.9), Vector3::new(0.5, 0.0, 0.0));
            let camera = Camera::looking(intrinsics, eye, target);
            let lens = Lens::new(&camera);
            for (u, v) in
                [(-0.5, -0.5), (0.0, 719.0), (640.2, 359.7), (1279.4, 719.4), (17.0, 300.0)]
            {
                let slow = camera.ray(Pixel::new(u, v)).direction;
                let quick = lens.direction(u, v).normalize();
                assert!((slow - quick).norm() < 2e-8, "{u} {v}: {}", (slow - quick).norm());
            }
            let mut fisheye = camera;
            (fisheye.intrinsics.p1, fisheye.intrinsics.p2, fisheye.intrinsics.k3) = (0.0, 0.0, 0.0);
            (fisheye.intrinsics.k4, fisheye.intrinsics.model) = (0.01, LensModel::Fisheye);
            let slow = fisheye.ray(Pixel::new(17.0, 300.0)).direction;
            let quick = Lens::new(&fisheye).direction(17.0, 300.0).normalize();
            assert!((slow - quick).norm() < 1e-9);
            if lens.is_radial() {
                let [x, y] = lens.four(1276, 3).map(f32x4::to_array);
                for k in 0..4 {
                    let slow = camera.ray(Pixel::new(1276.0 + k as f64, 3.0)).direction;
                    let ray = Vector3::new(f64::from(x[k]), f64::from(y[k]), 1.0);
                    let quick = lens.world_from_camera * ray.normalize();
                    assert!((slow - quick).norm() < 3e-7, "{k}: {}", (slow - quick).norm());
                }
            }
        }
    }
}
