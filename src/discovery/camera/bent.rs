//! A camera with effects on it: from a point, a pose and a time to a pixel.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector2, Vector3};

use super::lens::Lens;
use super::term::{Channel, Feature, Law};

/// A camera as some effects leave it.
#[derive(Debug, Clone, PartialEq)]
pub struct Bent {
    lens: Lens,
    /// Carries points from where the camera was thought to be to where it is.
    here_from_thought: Isometry3<f64>,
    /// Carries points of the table from where they were thought to be to where they are.
    table: Option<Isometry3<f64>>,
    /// How old a picture is, s.
    pub delay: f64,
    /// How much later a row is taken than the one above it, s.
    pub row_time: f64,
    features: Vec<(Feature, f64)>,
}

/// Returns the turn of `roll` about x, then `pitch` about y, then `yaw` about z, all fixed axes.
fn turn(roll: f64, pitch: f64, yaw: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(roll, pitch, yaw)
}

impl Bent {
    /// Bends a lens: effects in order, `parameters` one after the other as [`Law::specs`] has them; `vertical` is
    /// the world's z in the camera's axes.
    pub fn new(lens: &Lens, vertical: Vector3<f64>, laws: &[Law], parameters: &[f64]) -> Self {
        let mut bent = Self {
            lens: *lens,
            here_from_thought: Isometry3::identity(),
            table: None,
            delay: 0.0,
            row_time: 0.0,
            features: Vec::new(),
        };
        let mut from = 0;
        for law in laws {
            from += bent.add(*law, vertical, &parameters[from..]);
        }
        bent
    }

    /// Adds an effect and returns how many parameters it took.
    fn add(&mut self, law: Law, vertical: Vector3<f64>, p: &[f64]) -> usize {
        match law {
            Law::Radial(k2) => {
                self.lens.k[0] += p[0];
                if k2 {
                    self.lens.k[1] += p[1];
                }
                1 + usize::from(k2)
            }
            Law::Tangential => {
                self.lens.p[0] += p[0];
                self.lens.p[1] += p[1];
                2
            }
            Law::Focal(each) => {
                let (x, y) = (p[0], p[usize::from(each)]);
                self.lens.fx *= x;
                self.lens.skew *= x;
                self.lens.fy *= y;
                1 + usize::from(each)
            }
            Law::Principal(u, v) => {
                if u {
                    self.lens.cx += p[0];
                }
                if v {
                    self.lens.cy += p[usize::from(u)];
                }
                usize::from(u) + usize::from(v)
            }
            Law::Shift(free) => {
                let mut at = 0;
                let six = free.map(|free| {
                    let value = if free { p[at] } else { 0.0 };
                    at += usize::from(free);
                    value
                });
                self.shift(Vector3::new(six[0], six[1], six[2]), turn(six[3], six[4], six[5]));
                at
            }
            Law::Lift => {
                self.shift(vertical * p[0], UnitQuaternion::identity());
                1
            }
            Law::Table(tilt, height) => {
                let turned = if tilt { turn(p[0], p[1], 0.0) } else { UnitQuaternion::identity() };
                let used = if tilt { 2 } else { 0 };
                let up = Vector3::z() * if height { p[used] } else { 0.0 };
                let moved = Isometry3::from_parts(Translation3::from(up), turned);
                self.table = Some(moved * self.table.unwrap_or_else(Isometry3::identity));
                used + usize::from(height)
            }
            Law::Delay => {
                self.delay += p[0];
                1
            }
            Law::Shutter => {
                self.row_time += p[0];
                1
            }
            Law::Feature(feature) => {
                self.features.push((feature, p[0]));
                1
            }
        }
    }

    /// Moves the camera in its own axes.
    fn shift(&mut self, by: Vector3<f64>, turned: UnitQuaternion<f64>) {
        let moved = Isometry3::from_parts(Translation3::from(by), turned);
        self.here_from_thought = moved.inverse() * self.here_from_thought;
    }

    /// Returns where a point of the world truly is; `on_table` for one that the table carries.
    pub fn carried(&self, point: Vector3<f64>, on_table: bool) -> Vector3<f64> {
        match &self.table {
            Some(table) if on_table => table.transform_point(&point.into()).coords,
            _ => point,
        }
    }

    /// Returns the pixel of a point given in the axes of the camera as it was thought to stand; `None` behind it.
    pub fn pixel(&self, point: Vector3<f64>, time: f64) -> Option<Vector2<f64>> {
        let c = self.here_from_thought.transform_point(&point.into());
        if c.z <= 1e-6 {
            return None;
        }
        let n = Vector2::new(c.x / c.z, c.y / c.z);
        let mut pixel = self.lens.pixel(n);
        for (feature, coefficient) in &self.features {
            pixel += shape(*feature, n, time) * *coefficient;
        }
        Some(pixel)
    }
}

/// Returns what a feature of coefficient 1 adds at normalised coordinates and a time, px.
pub fn shape(feature: Feature, n: Vector2<f64>, time: f64) -> Vector2<f64> {
    let along = |channel: Channel, value: f64| match channel {
        Channel::U => Vector2::new(value, 0.0),
        Channel::V => Vector2::new(0.0, value),
    };
    match feature {
        Feature::Monomial(channel, i, j) => {
            along(channel, n.x.powi(i32::from(i)) * n.y.powi(i32::from(j)))
        }
        Feature::Radial => n * n.norm_squared().powi(3),
        Feature::Drift(channel) => along(channel, time),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::Intrinsics;

    fn lens() -> Lens {
        Lens::from(Intrinsics::centred(800.0, 640, 480))
    }

    fn pixel(laws: &[Law], parameters: &[f64], point: Vector3<f64>) -> Vector2<f64> {
        Bent::new(&lens(), Vector3::z(), laws, parameters).pixel(point, 0.0).unwrap()
    }

    #[test]
    fn a_camera_further_right_sees_things_further_left() {
        let point = Vector3::new(0.1, 0.2, 2.0);
        let before = pixel(&[], &[], point);
        let free = [true, false, false, false, false, false];
        let after = pixel(&[Law::Shift(free)], &[0.01], point);
        // 1 cm at 2 m and f = 800 px.
        assert!((after - before - Vector2::new(-4.0, 0.0)).norm() < 1e-12);
        // Turned about its y axis it looks to the right: things move left by f tan.
        let free = [false, false, false, false, true, false];
        let ahead = pixel(&[Law::Shift(free)], &[0.01], Vector3::new(0.0, 0.0, 1.0));
        assert!((ahead.x - (319.5 - 800.0 * 0.01_f64.tan())).abs() < 1e-9);
    }

    #[test]
    fn effects_take_their_own_parameters() {
        let laws = [Law::Focal(true), Law::Principal(false, true), Law::Radial(false)];
        let point = Vector3::new(0.3, 0.1, 1.0);
        let all = pixel(&laws, &[1.1, 0.9, 3.0, 0.5], point);
        let r = 1.0 + 0.5 * 0.1;
        let expected = Vector2::new(319.5 + 880.0 * 0.3 * r, 239.5 + 3.0 + 720.0 * 0.1 * r);
        assert!((all - expected).norm() < 1e-9);
    }

    #[test]
    fn only_the_table_is_tilted_by_the_table() {
        let bent = Bent::new(&lens(), Vector3::z(), &[Law::Table(true, true)], &[0.1, 0.0, 0.02]);
        let point = Vector3::new(0.0, 1.0, 0.0);
        let on = bent.carried(point, true);
        assert!((on - Vector3::new(0.0, 0.1_f64.cos(), 0.02 + 0.1_f64.sin())).norm() < 1e-12);
        assert_eq!(bent.carried(point, false), point);
        assert!(bent.pixel(Vector3::new(0.0, 0.0, -1.0), 0.0).is_none());
    }
}
