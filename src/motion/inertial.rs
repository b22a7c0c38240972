//! Mass and how it is spread: of a link, of a payload, of several welded together.
//!
//! Source: the parallel axis theorem; Featherstone, *Rigid Body Dynamics Algorithms*, 2008, §2.13.

use nalgebra::{Isometry3, Matrix3, Vector3};

/// Mass and how it is spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertial {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the body's frame, m.
    pub com: Vector3<f64>,
    /// Inertia about the centre of mass, axes of the body's frame, kg·m².
    pub inertia: Matrix3<f64>,
}

impl Inertial {
    /// Returns whether a body could have these numbers: a mass that is not negative, and principal moments above 0, each at most the sum of the
    /// other two. Makers round: a hundredth of the largest is let pass.
    pub fn is_of_a_body(&self) -> bool {
        let moments = self.inertia.symmetric_eigenvalues();
        let (largest, sum) = (moments.max(), moments.sum());
        self.mass >= 0.0
            && largest > 0.0
            && moments.min() > -0.01 * largest
            && 2.0 * largest < sum + 0.01 * largest
    }

    /// Returns the inertia of nothing.
    pub fn zero() -> Self {
        Self { mass: 0.0, com: Vector3::zeros(), inertia: Matrix3::zeros() }
    }

    /// Returns this body as seen from a frame in which the body's frame stands at `pose`.
    #[must_use]
    pub fn seen_from(&self, pose: &Isometry3<f64>) -> Self {
        let turn = pose.rotation.to_rotation_matrix();
        Self {
            mass: self.mass,
            com: pose.rotation * self.com + pose.translation.vector,
            inertia: turn.matrix() * self.inertia * turn.matrix().transpose(),
        }
    }

    /// Returns two bodies welded together, both given in the same frame.
    #[must_use]
    pub fn welded(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        if mass <= 0.0 {
            return Self::zero();
        }
        let com = (self.com * self.mass + other.com * other.mass) / mass;
        let about = |part: &Self| {
            let d = part.com - com;
            part.inertia + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * part.mass
        };
        Self { mass, com, inertia: about(self) + about(other) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two balls on a rod are a dumb-bell: `2 (m l² + I)` across the rod, `2 I` along it, wherever and
    /// however it is seen.
    #[test]
    fn two_balls_on_a_rod_have_a_dumb_bells_inertia() {
        let ball =
            Inertial { mass: 1.5, com: Vector3::zeros(), inertia: Matrix3::identity() * 0.002 };
        let end = |x: f64| ball.seen_from(&Isometry3::translation(x, 0.0, 0.0));
        let bell = end(-0.2).welded(&end(0.2));
        let across = 2.0 * (1.5 * 0.04 + 0.002);
        let expected = Matrix3::from_diagonal(&Vector3::new(0.004, across, across));
        assert!((bell.mass - 3.0).abs() < 1e-12 && bell.com.norm() < 1e-12);
        assert!((bell.inertia - expected).norm() < 1e-12, "{}", bell.inertia);

        let pose = Isometry3::new(Vector3::new(0.3, -0.1, 0.5), Vector3::new(0.4, 1.1, -0.7));
        let whole = bell.seen_from(&pose);
        let parts = end(-0.2).seen_from(&pose).welded(&end(0.2).seen_from(&pose));
        assert!((whole.com - pose.translation.vector).norm() < 1e-12);
        assert!((whole.inertia - parts.inertia).norm() < 1e-12);
        assert_eq!(Inertial::zero().welded(&Inertial::zero()), Inertial::zero());
    }
}
