//! Whether a robot's axes meet as the closed form ([`super::closed_form`]) wants them: found by where they are, not by name.
//!
//! How far the model then is from the robot itself is tried; what it is solved for is not looked at here.

use nalgebra::Vector3;

use super::closed_form::{ClosedForm, MEET};
use super::frames::Frame;
use super::kinematics::frame_error;
use super::robot::Robot;
use super::screws::Screws;

/// How far, as a cosine, neighbouring axes may be from a right angle.
const SQUARE: f64 = 1e-4;
/// A model whose axes meet and are square to this, m and rad, needs no polish: its solutions are its own.
const IDEAL: f64 = 1e-13;

impl ClosedForm {
    /// Returns the closed form if the robot has the right geometry: seven turning joints whose
    /// neighbouring axes meet at right angles.
    pub fn of(robot: &Robot) -> Option<Self> {
        let screws = Screws::of(robot)?;
        let axes: [Vector3<f64>; 7] = screws.axes.try_into().ok()?;
        let points = screws.points;
        let mut meet = [Vector3::zeros(); 6];
        for i in 0..6 {
            if axes[i].dot(&axes[i + 1]).abs() > SQUARE {
                return None;
            }
            let normal = axes[i].cross(&axes[i + 1]);
            let between = points[i + 1] - points[i];
            if between.dot(&normal).abs() > MEET {
                return None;
            }
            meet[i] = points[i] + axes[i] * between.dot(&axes[i]);
        }
        // From one meeting point to the next the way leads along the axis they share.
        let along = |i: usize| (meet[i] - meet[i - 1]).dot(&axes[i]);
        let [d2, l1, d4, l2, d6] = [1, 2, 3, 4, 5].map(along);
        // Without an upper arm and a forearm there is no triangle to solve; the wrist offset must be
        // small for its iteration to converge.
        if l2.abs() < 0.01 || l1.abs() < 0.01 || d6.abs() > 0.05 * l2.abs() {
            return None;
        }
        let y = (axes[1] - axes[0] * axes[0].dot(&axes[1])).normalize();
        let base = Frame { x: y.cross(&axes[0]), y, z: axes[0], origin: meet[0] };
        let (last, zero) = unwound(base, &axes);
        let last = Frame { origin: meet[5], ..last };
        let pose = screws.tip;
        let tip = Frame {
            x: last.local(&pose.x),
            y: last.local(&pose.y),
            z: last.local(&pose.z),
            origin: last.local(&(pose.origin - meet[5])),
        };
        let mut form = Self { base, tip, zero, d2, l1, d4, l2, d6, is_ideal: false };
        form.is_ideal = form.error_of(robot) < IDEAL;
        Some(form)
    }

    /// Returns how far the model is from the robot itself, m and rad, at a few positions of the joints.
    fn error_of(&self, robot: &Robot) -> f64 {
        // Any positions will do that are no special ones.
        const TRIED: [[f64; 7]; 3] = [
            [0.3, -0.7, 1.1, 0.9, -0.4, 1.2, 2.1],
            [-1.9, 0.6, -2.3, -1.4, 0.8, -0.5, 0.2],
            [2.6, 1.3, 0.4, 1.8, -1.7, 0.9, -2.8],
        ];
        TRIED
            .iter()
            .map(|q| frame_error(&self.forward(q), &robot.tip_frame(q)).amax())
            .fold(0.0, f64::max)
    }

    /// Returns where the model puts the tip.
    fn forward(&self, q: &[f64; 7]) -> Frame {
        let mut frame = self.base;
        let steps = [0.0, 0.0, self.d2, self.l1, self.d4, self.l2, self.d6];
        for (i, (q, zero)) in q.iter().zip(self.zero).enumerate() {
            let (sin, cos) = (q + zero).sin_cos();
            // The way from one meeting point to the next lies along the axis before.
            if i > 1 {
                frame.origin += if i % 2 == 0 { frame.y } else { frame.z } * steps[i];
            }
            if i % 2 == 0 {
                frame.about_z((sin, cos));
            } else {
                frame.about_y((sin, cos));
            }
        }
        frame.then(&self.tip)
    }
}

/// Follows the axes from the base outwards; returns the frame of the last, and each joint's angle at zero.
fn unwound(mut frame: Frame, axes: &[Vector3<f64>; 7]) -> (Frame, [f64; 7]) {
    let mut zero = [0.0; 7];
    // Each joint turns the frame until its y or its z is the next axis.
    for i in 0..6 {
        let next = frame.local(&axes[i + 1]);
        if i % 2 == 0 {
            zero[i] = (-next.x).atan2(next.y);
            frame.about_z(zero[i].sin_cos());
        } else {
            zero[i] = next.x.atan2(next.z);
            frame.about_y(zero[i].sin_cos());
        }
    }
    (frame, zero)
}
