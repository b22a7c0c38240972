//! The residuals that every camera fit shares: where points should appear less where they were seen.
//!
//! Parameters: `fx, fy, cx, cy, skew, k1, k2, p1, p2, k3, k4`, then per view a turn `w` (rad, camera axes) and a shift `d`
//! (m, world axes) from the pose the view started with: `world_from_camera = (c0 + d, R0 exp([w]×))`. So
//! a prior on `d` is one on where the camera stands.
//!
//! Source of the derivatives: Solà, Deray and Atchuthan, "A micro Lie theory", 2018, §IV.B.

use nalgebra::{Matrix2, Matrix3, UnitQuaternion, Vector3};

use crate::fit::{Jacobian, Problem};
use crate::world::{Intrinsics, LensModel, Pixel, Pose, frame};

/// Number of intrinsic parameters.
pub(super) const INTRINSIC: usize = 11;
/// Where the lens's terms begin among them.
pub(super) const LENS: usize = 5;
/// Number of parameters of a pose.
pub(super) const POSE: usize = 6;

/// One pixel of one point, with its standard deviation in px.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    pub(super) view: usize,
    pub(super) point: Vector3<f64>,
    pub(super) pixel: Pixel,
    pub(super) sigma: f64,
}

/// The least-squares problem.
pub(super) struct Reprojection {
    pub(super) seen: Vec<Seen>,
    /// The pose each view started with.
    pub(super) poses: Vec<Pose<frame::World, frame::Camera>>,
    /// With `Some(a)`, `fy = fx / a` and the parameter `fy` is not used.
    pub(super) aspect: Option<f64>,
    pub(super) size: (u32, u32),
    /// What the lens's terms mean.
    pub(super) lens: LensModel,
}

/// A pose at its current parameters, as the residuals need it.
struct At {
    camera_from_world: Matrix3<f64>,
    centre: Vector3<f64>,
    /// `J_l(-w)`.
    left: Matrix3<f64>,
}

/// Returns the left Jacobian of the rotation group at `w`.
fn left_jacobian(w: Vector3<f64>) -> Matrix3<f64> {
    let angle2 = w.norm_squared();
    let cross = w.cross_matrix();
    let (a, b) = if angle2 < 1e-8 {
        (0.5 - angle2 / 24.0, 1.0 / 6.0 - angle2 / 120.0)
    } else {
        let angle = angle2.sqrt();
        ((1.0 - angle.cos()) / angle2, (angle - angle.sin()) / (angle2 * angle))
    };
    Matrix3::identity() + cross * a + cross * cross * b
}

impl Reprojection {
    pub(super) fn n_parameters(&self) -> usize {
        INTRINSIC + POSE * self.poses.len()
    }

    /// The parameters of intrinsics with every pose where it started.
    pub(super) fn start(&self, k: &Intrinsics) -> Vec<f64> {
        let mut x = vec![0.0; self.n_parameters()];
        x[..INTRINSIC]
            .copy_from_slice(&[k.fx, k.fy, k.cx, k.cy, k.skew, k.k1, k.k2, k.p1, k.p2, k.k3, k.k4]);
        x
    }

    pub(super) fn intrinsics(&self, x: &[f64]) -> Intrinsics {
        Intrinsics {
            fx: x[0],
            fy: self.aspect.map_or(x[1], |a| x[0] / a),
            cx: x[2],
            cy: x[3],
            skew: x[4],
            k1: x[5],
            k2: x[6],
            p1: x[7],
            p2: x[8],
            k3: x[9],
            k4: x[10],
            model: self.lens,
            width: self.size.0,
            height: self.size.1,
        }
    }

    pub(super) fn pose(&self, x: &[f64], view: usize) -> Pose<frame::World, frame::Camera> {
        let p = &x[INTRINSIC + POSE * view..INTRINSIC + POSE * (view + 1)];
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(p[0], p[1], p[2]));
        let start = &self.poses[view];
        let shift = Vector3::new(p[3], p[4], p[5]);
        Pose::from_parts(start.origin() + shift, start.rotation() * turn)
    }

    /// Writes the parameters that put a view at `pose`.
    pub(super) fn set_pose(
        &self,
        x: &mut [f64],
        view: usize,
        pose: &Pose<frame::World, frame::Camera>,
    ) {
        let start = &self.poses[view];
        let turn = (start.rotation().inverse() * pose.rotation()).scaled_axis();
        let shift = pose.origin() - start.origin();
        let p = &mut x[INTRINSIC + POSE * view..INTRINSIC + POSE * (view + 1)];
        p[..3].copy_from_slice(turn.as_slice());
        p[3..].copy_from_slice(shift.as_slice());
    }

    fn views(&self, x: &[f64]) -> Vec<At> {
        (0..self.poses.len())
            .map(|view| {
                let pose = self.pose(x, view);
                let p = &x[INTRINSIC + POSE * view..];
                At {
                    camera_from_world: pose.rotation().inverse().to_rotation_matrix().into_inner(),
                    centre: pose.origin(),
                    left: left_jacobian(-Vector3::new(p[0], p[1], p[2])),
                }
            })
            .collect()
    }
}

impl Problem for Reprojection {
    fn n_residuals(&self) -> usize {
        2 * self.seen.len()
    }

    fn block(&self) -> usize {
        2
    }

    fn residuals(&self, x: &[f64], r: &mut [f64]) {
        let k = self.intrinsics(x);
        let views = self.views(x);
        for (seen, r) in self.seen.iter().zip(r.chunks_exact_mut(2)) {
            let at = &views[seen.view];
            let p = at.camera_from_world * (seen.point - at.centre);
            let Some(d) = k.shown(p) else {
                r.fill(f64::INFINITY);
                continue;
            };
            r[0] = (k.fx * d.x + k.skew * d.y + k.cx - seen.pixel.u) / seen.sigma;
            r[1] = (k.fy * d.y + k.cy - seen.pixel.v) / seen.sigma;
        }
    }

    fn jacobian(&self, x: &[f64], j: &mut Jacobian) -> bool {
        let k = self.intrinsics(x);
        let views = self.views(x);
        for (i, seen) in self.seen.iter().enumerate() {
            let at = &views[seen.view];
            let p = at.camera_from_world * (seen.point - at.centre);
            let Some(d) = k.shown(p) else { continue };
            let per = 1.0 / seen.sigma;
            let pixel_from_distorted = Matrix2::new(k.fx, k.skew, 0.0, k.fy) * per;
            let (distorted_from_point, by_terms) = k.shown_slopes(p);
            let pixel_from_point = pixel_from_distorted * distorted_from_point;
            let by_turn = pixel_from_point * p.cross_matrix() * at.left;
            let by_shift = -pixel_from_point * at.camera_from_world;
            let by_lens = by_terms.map(|slope| pixel_from_distorted * slope);
            let column = INTRINSIC + POSE * seen.view;
            let u = j.row_mut(2 * i);
            u[0] = d.x * per;
            u[2] = per;
            u[4] = d.y * per;
            for (c, slope) in by_lens.iter().enumerate() {
                u[LENS + c] = slope.x;
            }
            for c in 0..3 {
                u[column + c] = by_turn[(0, c)];
                u[column + 3 + c] = by_shift[(0, c)];
            }
            let v = j.row_mut(2 * i + 1);
            match self.aspect {
                Some(a) => v[0] = d.y * per / a,
                None => v[1] = d.y * per,
            }
            v[3] = per;
            for (c, slope) in by_lens.iter().enumerate() {
                v[LENS + c] = slope.y;
            }
            for c in 0..3 {
                v[column + c] = by_turn[(1, c)];
                v[column + 3 + c] = by_shift[(1, c)];
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::Camera;

    #[test]
    fn derivatives_agree_with_differences() {
        let mut k = Intrinsics::centred(800.0, 1280, 720);
        (k.fy, k.skew, k.k1, k.k2) = (790.0, 0.7, -0.2, 0.1);
        (k.p1, k.p2, k.k3) = (2e-3, -1e-3, 0.05);
        differentiated(k);
        (k.p1, k.p2, k.k4, k.model) = (0.0, 0.0, -0.02, LensModel::Fisheye);
        differentiated(k);
    }

    fn differentiated(k: Intrinsics) {
        let camera = Camera::looking(k, Vector3::new(1.0, 0.3, 0.9), Vector3::new(0.4, 0.0, 0.0));
        let seen: Vec<Seen> = (0..12)
            .map(|i| {
                let (a, b) = (f64::from(i % 4), f64::from(i / 4));
                Seen {
                    view: 0,
                    point: Vector3::new(0.2 + 0.1 * a, -0.2 + 0.15 * b, 0.05 * (a * b).sin()),
                    pixel: Pixel::new(600.0 + a, 300.0 - b),
                    sigma: 0.7,
                }
            })
            .collect();
        for aspect in [None, Some(1.02)] {
            let problem = Reprojection {
                seen: seen.clone(),
                poses: vec![camera.world_from_camera],
                aspect,
                size: (1280, 720),
                lens: k.model,
            };
            let mut x = problem.start(&k);
            x[INTRINSIC..].copy_from_slice(&[0.2, -0.3, 0.15, 0.02, -0.03, 0.05]);
            let mut exact = Jacobian::zeros(24, INTRINSIC + POSE);
            problem.jacobian(&x, &mut exact);
            let h = 1e-6;
            let (mut up, mut down) = (vec![0.0; 24], vec![0.0; 24]);
            for c in 0..INTRINSIC + POSE {
                let mut at = x.clone();
                at[c] += h;
                problem.residuals(&at, &mut up);
                at[c] -= 2.0 * h;
                problem.residuals(&at, &mut down);
                for row in 0..24 {
                    let slope = (up[row] - down[row]) / (2.0 * h);
                    let error = (slope - exact.row(row)[c]).abs();
                    assert!(error < 1e-5 * (1.0 + slope.abs()), "{row} {c}: {error}");
                }
            }
        }
    }
}
