//! What touches what, what the jaws hold, and with what forces others push on hand and held thing.
//!
//! It is the last step that says so: the engine's contacts, or those of what is held without it (`held.rs`).

use nalgebra::{Isometry3, Vector3};
use rapier3d_f64::dynamics::RigidBodyHandle;
use rapier3d_f64::geometry::{Collider, ColliderHandle, NEW_CONTACT_BIT};
use rapier3d_f64::utils::OrthonormalBasis;

use super::{PRESSES, Part, Physics, TOUCH};
use crate::twin::convert::{from_engine, pose_from_engine};

impl Physics {
    /// Returns whether two bodies touch.
    pub fn touch(&self, a: Part, b: Part) -> bool {
        if let Some(held) = &self.alone.held
            && [a, b].contains(&Part::Object(held.object))
        {
            let body = |part: Part| if let Part::Body(body) = part { Some(body) } else { None };
            return body(a).or(body(b)).is_some_and(|body| Self::is_touched(held, body));
        }
        let (Some(a), Some(b)) = (self.handle(a), self.handle(b)) else { return false };
        let touching = |x: ColliderHandle, y: ColliderHandle| {
            let pair = self.narrow_phase.contact_pair(x, y);
            let deepest = pair.and_then(|pair| pair.find_deepest_contact());
            deepest.is_some_and(|(_, contact)| contact.dist < TOUCH)
        };
        let of = |handle: RigidBodyHandle| self.bodies[handle].colliders();
        of(a).iter().any(|&x| of(b).iter().any(|&y| touching(x, y)))
    }

    /// Returns whether both jaws press on the object: what they only push aside is touched beside their pads.
    pub fn holds(&self, object: usize) -> bool {
        if let Some(held) = &self.alone.held {
            return held.object == object && held.is_pressed;
        }
        if self.alone.is_here() {
            return false;
        }
        let Some(held) = self.handle(Part::Object(object)) else { return false };
        self.tree.jaws.iter().all(|&jaw| {
            let Some(joint) = &self.tree.bodies[jaw].joint else { return false };
            let closes = self.body_pose(jaw) * joint.axis.into_inner();
            let of = |body: RigidBodyHandle| self.bodies[body].colliders();
            let presses = |x: &ColliderHandle, y: &ColliderHandle| {
                let pair = self.narrow_phase.contact_pair(*x, *y);
                pair.is_some_and(|pair| {
                    pair.solver_manifolds().iter().any(|manifold| {
                        let normal = from_engine(manifold.data.normal);
                        normal.dot(&closes).abs() > PRESSES
                            && manifold.points.iter().any(|point| point.dist < TOUCH)
                    })
                })
            };
            of(self.links[jaw]).iter().any(|x| of(held).iter().any(|y| presses(x, y)))
        })
    }

    /// Returns where, m in the world, and with what force, N, others push on the hand and on the object that it holds: what
    /// is beyond the last joint of the arm.
    ///
    /// The forces are those of the last step, whose length is `dt` s.
    pub fn pushes(&self, held: Option<usize>, dt: f64) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        if self.alone.is_here() {
            return Vec::new();
        }
        let own = self.tree.hand.iter().map(|body| self.links[*body]);
        let own: Vec<_> = own.chain(held.and_then(|object| self.objects[object])).collect();
        let is_own = |collider: ColliderHandle| {
            let parent = self.colliders.get(collider).and_then(Collider::parent);
            parent.is_some_and(|parent| own.contains(&parent))
        };
        let mut pushes = Vec::new();
        for &collider in own.iter().flat_map(|body| self.bodies[*body].colliders()) {
            for pair in self.narrow_phase.contact_pairs_with(collider) {
                if is_own(pair.collider1) && is_own(pair.collider2) {
                    continue;
                }
                let Some(first) = self.colliders.get(pair.collider1) else { continue };
                // The normal points out of the first, so the first is pushed against it.
                let sign = if is_own(pair.collider1) { -1.0 } else { 1.0 };
                for manifold in pair.solver_manifolds() {
                    let within =
                        manifold.subshape_pos1().map_or_else(Isometry3::identity, pose_from_engine);
                    let at = pose_from_engine(first.position()) * within;
                    // The engine sums up friction along these two.
                    let against = -manifold.data.normal;
                    let aside = against.orthonormal_vector();
                    let axes = [aside, against.cross(aside)].map(from_engine);
                    let normal = from_engine(manifold.data.normal);
                    // A point that was not solved in this step keeps what it did when it last was.
                    let solved = manifold.data.solver_contacts.iter().map(|contact| {
                        &manifold.points[(contact.contact_id[0] & !NEW_CONTACT_BIT) as usize]
                    });
                    for contact in solved {
                        let friction = &contact.data.tangent_impulse;
                        let aside = axes[0] * friction.x + axes[1] * friction.y;
                        let impulse = normal * contact.data.impulse - aside;
                        let point = at * nalgebra::Point3::from(from_engine(contact.local_p1));
                        pushes.push((point.coords, impulse * (sign / dt)));
                    }
                }
            }
        }
        pushes
    }

    fn handle(&self, part: Part) -> Option<RigidBodyHandle> {
        match part {
            Part::Body(body) => self.links.get(body).copied(),
            Part::Object(object) => self.objects.get(object).copied().flatten(),
            Part::Table => Some(self.table),
        }
    }
}
