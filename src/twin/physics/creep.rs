//! What hangs in the jaws creeps along the pads, as soft pads let it.
//!
//! The engine's contacts hold a thing still on the pads; a pad whose surface moves carries it along. So the pads'
//! surfaces move the way the weight pulls, at the rate that was found, while nothing but the jaws bears the thing.

use rapier3d_f64::dynamics::RigidBodyHandle;
use rapier3d_f64::math::Vector;
use rapier3d_f64::pipeline::{ContactModificationContext, PhysicsHooks};

use super::{Part, Physics};
use crate::twin::convert::to_engine;

/// Which contacts creep, and how.
pub(super) struct Creep {
    jaws: Vec<RigidBodyHandle>,
    /// Objects that hang in the jaws.
    hanging: Vec<RigidBodyHandle>,
    /// Direction of gravity.
    down: Vector,
    /// m/s.
    rate: f64,
}

impl Physics {
    /// Returns the creep of what hangs in the jaws, if anything does.
    pub(super) fn creeping(&self, rate: f64) -> Option<Creep> {
        if rate == 0.0 {
            return None;
        }
        let hangs = |i: &usize| self.holds(*i) && !self.touch(Part::Object(*i), Part::Table);
        let hanging: Vec<RigidBodyHandle> =
            (0..self.objects.len()).filter(hangs).filter_map(|i| self.objects[i]).collect();
        let down = to_engine(&self.gravity.try_normalize(1e-9)?);
        let jaws = self.tree.jaws.iter().map(|&jaw| self.links[jaw]).collect();
        (!hanging.is_empty()).then_some(Creep { jaws, hanging, down, rate })
    }
}

impl PhysicsHooks for Creep {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext<'_>) {
        let (Some(first), Some(second)) = (context.rigid_body1, context.rigid_body2) else {
            return;
        };
        // The engine adds the velocity to the first body's surface.
        let sign = if self.jaws.contains(&first) && self.hanging.contains(&second) {
            1.0
        } else if self.jaws.contains(&second) && self.hanging.contains(&first) {
            -1.0
        } else {
            return;
        };
        let Some(contacts) = context.rigid_mut() else { return };
        let normal = *contacts.normal;
        let along = self.down - normal * self.down.dot(normal);
        let Some(along) = along.try_normalize() else { return };
        for contact in contacts.solver_contacts.iter_mut() {
            contact.tangent_velocity = along * (sign * self.rate);
        }
    }
}
