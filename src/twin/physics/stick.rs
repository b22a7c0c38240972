//! What the jaws hold sticks to the pads, and creeps along them as soft pads let it.
//!
//! The engine's friction stops what moves along a pad and forgets where it was. A pad that is carried around goes along an
//! arc, what it holds along a chord, and so a jar drifts by up to 0.1 µm in every step of a motion, always to the same side.
//! Here is kept where a thing sticks to each pad, and the pad's surface moves so that it comes back there: a spring along the
//! pad, whose force the engine finds and holds below the limit of friction. What slides is held from where it has come to.
//!
//! What creeps is carried along in the same way: the place where it sticks moves as the weight pulls, at the rate that was
//! found, while nothing but the jaws bears the thing.
//!
//! Source: Cundall and Strack, "A discrete numerical model for granular assemblies", Géotechnique 29, 1979.

use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use rapier3d_f64::dynamics::RigidBodyHandle;
use rapier3d_f64::geometry::{ContactManifold, NEW_CONTACT_BIT};
use rapier3d_f64::pipeline::{ContactModificationContext, PhysicsHooks};

use super::{Part, Physics};
use crate::twin::convert::{from_engine, to_engine};

/// Share of the way back that is gone in a step: chosen, less than all of it, since contacts are solved one after the other.
const BACK: f64 = 0.2;

/// Of what friction can bear, the share from which on a thing slides: one that slides takes all of it.
const SLIDES: f64 = 0.99;

/// What is farther from where it stuck than this has slid, m: a hundred times what a step of a motion brings.
const FAR: f64 = 5e-5;

/// A thing that sticks to a jaw.
#[derive(Debug, Clone)]
pub(super) struct Stuck {
    /// Body of the jaw, in [`super::Tree::bodies`].
    jaw: usize,
    object: usize,
    /// Where the thing is when nothing pulls at it.
    jaw_from_thing: Isometry3<f64>,
}

/// How a jaw's surface moves what sticks to it in this step.
struct Pull {
    jaw: RigidBodyHandle,
    thing: RigidBodyHandle,
    /// From where the thing is to where it should be.
    back: Isometry3<f64>,
    /// How fast it creeps, m/s in the world.
    creep: Vector3<f64>,
}

/// The motion of the jaws' surfaces in a step.
pub(super) struct Pulls {
    each: Vec<Pull>,
    /// Steps in a second, times the share of the way back that is gone in each.
    rate: f64,
}

impl Physics {
    /// Looks what sticks to the jaws, and returns how they pull at it. `creep` is in m/s.
    pub(super) fn pulls(&mut self, creep: f64) -> Pulls {
        let dt = self.parameters.dt;
        let held: Vec<usize> =
            (0..self.objects.len()).filter(|&object| self.holds(object)).collect();
        let before = std::mem::take(&mut self.stuck);
        let mut each = Vec::new();
        for object in held {
            let hangs = creep != 0.0 && !self.touch(Part::Object(object), Part::Table);
            for jaw in self.tree.jaws {
                let Some(thing) = self.objects[object] else { continue };
                let Some(world_from_thing) = self.object_pose(object) else { continue };
                let world_from_jaw = self.body_pose(jaw);
                let was = before.iter().find(|stuck| stuck.jaw == jaw && stuck.object == object);
                let sticks = was.map(|was| world_from_jaw * was.jaw_from_thing);
                let sticks = sticks.filter(|sticks| {
                    !self.slides(jaw, object, &(sticks * world_from_thing.inverse()))
                });
                let sticks = sticks.unwrap_or(world_from_thing);
                let creep = if hangs { self.downwards(jaw) * creep } else { Vector3::zeros() };
                let back = sticks * world_from_thing.inverse();
                let sticks = Translation3::from(creep * dt) * sticks;
                let jaw_from_thing = world_from_jaw.inverse() * sticks;
                self.stuck.push(Stuck { jaw, object, jaw_from_thing });
                each.push(Pull { jaw: self.links[jaw], thing, back, creep });
            }
        }
        Pulls { each, rate: BACK / dt }
    }

    /// Returns the direction along a jaw's pad in which weight pulls; none along a level one.
    fn downwards(&self, jaw: usize) -> Vector3<f64> {
        let closes = self.tree.bodies[jaw].joint.as_ref().map(|joint| joint.axis.into_inner());
        let normal = self.body_pose(jaw) * closes.unwrap_or_default();
        let along = self.gravity - normal * self.gravity.dot(&normal);
        along.try_normalize(1e-9).unwrap_or_default()
    }

    /// Returns whether a thing slid along a jaw in the last step; `back` brings it to where it stuck.
    fn slides(&self, jaw: usize, object: usize, back: &Isometry3<f64>) -> bool {
        if let Some(held) = &self.alone.held {
            let far = |at: &Vector3<f64>, normal: &Vector3<f64>| along(back, at, normal).norm();
            let (bears, borne, far) = self.bears(held, jaw, far);
            return borne >= SLIDES * bears || far > FAR;
        }
        let Some(object) = self.objects[object] else { return true };
        let jaw = &self.bodies[self.links[jaw]];
        let (mut bears, mut borne, mut far) = (0.0, 0.0, 0.0_f64);
        for &x in jaw.colliders() {
            for &y in self.bodies[object].colliders() {
                let Some(pair) = self.narrow_phase.contact_pair(x, y) else { continue };
                for manifold in pair.solver_manifolds() {
                    let (can, does) = friction(manifold);
                    bears += can;
                    borne += does;
                    let normal = from_engine(manifold.data.normal);
                    for contact in &manifold.data.solver_contacts {
                        let (at, _) =
                            manifold.data.solver_contact_world_points(contact, &self.bodies);
                        far = far.max(along(back, &from_engine(at), &normal).norm());
                    }
                }
            }
        }
        borne >= SLIDES * bears || far > FAR
    }
}

/// Returns how much friction the points of a contact could bear and how much they do, N·s in the last step.
fn friction(manifold: &ContactManifold) -> (f64, f64) {
    let solved = manifold.data.solver_contacts.iter();
    let solved = solved
        .map(|contact| &manifold.points[(contact.contact_id[0] & !NEW_CONTACT_BIT) as usize].data);
    solved.fold((0.0, 0.0), |(can, does), point| {
        (can + manifold.data.friction * point.impulse, does + point.tangent_impulse.norm())
    })
}

/// Returns how a place in the world moves along a surface when it is brought back, m.
fn along(back: &Isometry3<f64>, at: &Vector3<f64>, normal: &Vector3<f64>) -> Vector3<f64> {
    let way = (back * Point3::from(*at)).coords - at;
    way - normal * way.dot(normal)
}

impl Pulls {
    /// Returns how fast a jaw's surface moves at a place on what sticks to it, m/s in the world.
    pub(super) fn at(
        &self,
        jaw: RigidBodyHandle,
        thing: RigidBodyHandle,
        at: &Vector3<f64>,
        normal: &Vector3<f64>,
    ) -> Vector3<f64> {
        let Some(pull) = self.each.iter().find(|pull| pull.jaw == jaw && pull.thing == thing)
        else {
            return Vector3::zeros();
        };
        let creep = pull.creep - normal * pull.creep.dot(normal);
        along(&pull.back, at, normal) * self.rate + creep
    }
}

impl PhysicsHooks for Pulls {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext<'_>) {
        let (Some(first), Some(second)) = (context.rigid_body1, context.rigid_body2) else {
            return;
        };
        let between = |pull: &&Pull| {
            (pull.jaw, pull.thing) == (first, second) || (pull.thing, pull.jaw) == (first, second)
        };
        let Some(pull) = self.each.iter().find(between) else { return };
        // The engine adds the velocity to the first body's surface.
        let sign = if pull.jaw == first { 1.0 } else { -1.0 };
        let Some(contacts) = context.rigid_mut() else { return };
        let normal = from_engine(*contacts.normal);
        let creep = pull.creep - normal * pull.creep.dot(&normal);
        for contact in contacts.solver_contacts.iter_mut() {
            let at = from_engine(0.5 * (contact.anchor1 + contact.anchor2));
            let velocity = along(&pull.back, &at, &normal) * self.rate + creep;
            contact.tangent_velocity = to_engine(&(velocity * sign));
        }
    }
}
