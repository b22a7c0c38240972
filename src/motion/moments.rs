//! A rigid body by its moments: mass, mass times place, and mass times place squared.
//!
//! Unlike an inertia about a centre of mass they add up, turn in a plane with nine products, and give the torque of any
//! motion of a body as one product of matrices. Whether they are those of a body that can exist is not asked.
//!
//! Source: the pseudo-inertia of Wensing, Kim and Slotine, "Linear matrix inequalities for physically consistent inertial
//! parameter identification", RA-L 2018; its second moments are half the trace of the inertia less the inertia.

#![expect(clippy::inline_always, reason = "what is not inlined into `widest` misses the registers")]

use nalgebra::Vector3;

use super::inertial::Inertial;
use super::steps::Step;

/// The moments of a body about the origin of a frame, in its axes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Moments {
    /// kg.
    pub(super) mass: f64,
    /// Mass times place, kg·m.
    pub(super) first: Vector3<f64>,
    /// Mass times place times place, kg·m²: xx, yy, zz, then xy, xz, yz.
    pub(super) second: [f64; 6],
}

impl Moments {
    /// Returns the moments of a body that is given in the same frame.
    pub(super) fn of(body: &Inertial) -> Self {
        let (first, i) = (body.com * body.mass, &body.inertia);
        let half = 0.5 * i.trace();
        let (f, c) = (&first, &body.com);
        let second = [
            half - i.m11 + f.x * c.x,
            half - i.m22 + f.y * c.y,
            half - i.m33 + f.z * c.z,
            f.x * c.y - i.m12,
            f.x * c.z - i.m13,
            f.y * c.z - i.m23,
        ];
        Self { mass: body.mass, first, second }
    }

    /// Adds a body that is given in the frame a step beyond this one.
    #[inline(always)]
    pub(super) fn add(&mut self, beyond: &Self, step: &Step) {
        let h = step.outward(&beyond.first);
        let [xx, yy, zz, xy, xz, yz] = beyond.second;
        let [xx, yy, xy, xz, yz] = turned([xx, yy, xy, xz, yz], step.turn);
        let [yy, zz, yz, xy, xz] = turned([yy, zz, yz, xy, xz], step.tilt);
        let [xx, yy, xy, xz, yz] = match step.before {
            Some(before) => turned([xx, yy, xy, xz, yz], before),
            None => [xx, yy, xy, xz, yz],
        };
        let r = &step.reach;
        let moved = h + r * beyond.mass;
        self.mass += beyond.mass;
        self.first += moved;
        self.second[0] += xx + r.x * (moved.x + h.x);
        self.second[1] += yy + r.y * (moved.y + h.y);
        self.second[2] += zz + r.z * (moved.z + h.z);
        self.second[3] += xy + r.x * moved.y + h.x * r.y;
        self.second[4] += xz + r.x * moved.z + h.x * r.z;
        self.second[5] += yz + r.y * moved.z + h.y * r.z;
    }

    /// Returns force and moment that give a turn about z, 1 rad/s².
    #[inline(always)]
    pub(super) fn turned_about_z(&self) -> (Vector3<f64>, Vector3<f64>) {
        let [xx, yy, _, _, xz, yz] = self.second;
        (Vector3::new(-self.first.y, self.first.x, 0.0), Vector3::new(-xz, -yz, xx + yy))
    }

    /// Returns force and moment that push along z, 1 m/s².
    #[inline(always)]
    pub(super) fn pushed_along_z(&self) -> (Vector3<f64>, Vector3<f64>) {
        let (x, y) = (self.first.x, self.first.y);
        (Vector3::new(0.0, 0.0, self.mass), Vector3::new(y, -x, 0.0))
    }

    /// Returns force and moment when the frame's origin is accelerated by `acc`, m/s², and a place `r` by `field` times
    /// `r` more, 1/s².
    #[inline(always)]
    pub(super) fn moved(&self, acc: &Vector3<f64>, field: &Field) -> (Vector3<f64>, Vector3<f64>) {
        let force = acc * self.mass + field.times(&self.first);
        let [xx, yy, zz, xy, xz, yz] = self.second;
        let ([fx, fy, fz], [gx, gy, gz], [hx, hy, hz]) = (field.x, field.y, field.z);
        // The moment is what is not symmetric in the field times the second moments.
        let spin = Vector3::new(
            (hx * xy + hy * yy + hz * yz) - (gx * xz + gy * yz + gz * zz),
            (fx * xz + fy * yz + fz * zz) - (hx * xx + hy * xy + hz * xz),
            (gx * xx + gy * xy + gz * xz) - (fx * xy + fy * yy + fz * yz),
        );
        (force, spin + self.first.cross(acc))
    }
}

/// Turns second moments in a plane of axes a and b, c being the third: aa, bb, ab, ac, bc.
#[inline(always)]
fn turned([aa, bb, ab, ac, bc]: [f64; 5], (sin, cos): (f64, f64)) -> [f64; 5] {
    let mixed = sin * (aa - bb) + 2.0 * cos * ab;
    let over = sin * mixed;
    [aa - over, bb + over, cos * mixed - ab, cos * ac - sin * bc, sin * ac + cos * bc]
}

/// How the accelerations of the places of a body that turns differ: `[α]× + [ω]×²`, 1/s², by rows.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Field {
    x: [f64; 3],
    y: [f64; 3],
    z: [f64; 3],
}

impl Field {
    /// Returns the field of a turn at `omega` rad/s and `alpha` rad/s².
    #[inline(always)]
    pub(super) fn of(omega: &Vector3<f64>, alpha: &Vector3<f64>) -> Self {
        let (xx, yy, zz) = (omega.x * omega.x, omega.y * omega.y, omega.z * omega.z);
        let (xy, xz, yz) = (omega.x * omega.y, omega.x * omega.z, omega.y * omega.z);
        Self {
            x: [-(yy + zz), xy - alpha.z, xz + alpha.y],
            y: [xy + alpha.z, -(xx + zz), yz - alpha.x],
            z: [xz - alpha.y, yz + alpha.x, -(xx + yy)],
        }
    }

    #[inline(always)]
    pub(super) fn times(&self, r: &Vector3<f64>) -> Vector3<f64> {
        let row = |[a, b, c]: [f64; 3]| a * r.x + b * r.y + c * r.z;
        Vector3::new(row(self.x), row(self.y), row(self.z))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Rotation3};

    use super::*;

    fn body() -> Inertial {
        let inertia = Matrix3::new(0.03, 0.002, -0.001, 0.002, 0.04, 0.003, -0.001, 0.003, 0.05);
        Inertial { mass: 1.7, com: Vector3::new(0.1, -0.2, 0.3), inertia }
    }

    /// Newton and Euler about the centre of mass, and what the moments say.
    #[test]
    fn force_and_moment_are_those_of_newton_and_euler() {
        let body = body();
        let (omega, alpha) = (Vector3::new(0.7, -1.1, 0.4), Vector3::new(-2.0, 0.3, 1.5));
        let acc = Vector3::new(1.0, 2.0, -9.0);
        let (force, moment) = Moments::of(&body).moved(&acc, &Field::of(&omega, &alpha));
        let at_com = acc + alpha.cross(&body.com) + omega.cross(&omega.cross(&body.com));
        let expected = at_com * body.mass;
        let spin = body.inertia * alpha + omega.cross(&(body.inertia * omega));
        assert!((force - expected).norm() < 1e-13);
        assert!((moment - spin - body.com.cross(&expected)).norm() < 1e-13);
    }

    #[test]
    fn a_body_beyond_a_step_is_added_as_it_is_seen_from_here() {
        let reach = Vector3::new(0.2, 0.5, -0.4);
        let pair = |angle: f64| (angle.sin(), angle.cos());
        for before in [None, Some(0.9)] {
            let step = Step { before: before.map(pair), tilt: pair(-0.6), turn: pair(2.1), reach };
            let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), before.unwrap_or(0.0))
                * Rotation3::from_axis_angle(&Vector3::x_axis(), -0.6)
                * Rotation3::from_axis_angle(&Vector3::z_axis(), 2.1);
            let seen =
                body().seen_from(&nalgebra::Isometry3::from_parts(reach.into(), turn.into()));
            let expected = Moments::of(&seen);
            let mut sum = Moments::default();
            sum.add(&Moments::of(&body()), &step);
            assert!((sum.mass - expected.mass).abs() < 1e-13);
            assert!((sum.first - expected.first).norm() < 1e-13);
            for (a, b) in sum.second.iter().zip(expected.second) {
                assert!((a - b).abs() < 1e-13, "{a} {b}");
            }
            let v = Vector3::new(0.3, -0.8, 0.5);
            assert!((step.outward(&v) - turn * v).norm() < 1e-14);
            assert!((step.inward(&(turn * v)) - v).norm() < 1e-14);
        }
    }
}
