//! Inverse dynamics of the arm: the joint torques a motion takes.
//!
//! Links welded by fixed joints are merged into bodies once; [`Tree::inverse_dynamics`] then runs the
//! recursive Newton-Euler algorithm over them. The physics engine has no inverse dynamics of its own.
//!
//! Source: Luh, Walker and Paul, "On-line computational scheme for mechanical manipulators", 1980;
//! Featherstone, *Rigid Body Dynamics Algorithms*, 2008, §5.3.

use nalgebra::{Isometry3, Vector3};

use super::arm::{ArmModel, Inertia, JointKind, JointModel};

/// A rigid piece of the arm: one or more links welded together.
#[derive(Debug, Clone)]
pub struct Body {
    /// The body that carries it, `None` for the base.
    pub parent: Option<usize>,
    /// The joint that moves it, its parent pose given in the parent *body*; `None` for the base.
    pub joint: Option<JointModel>,
    /// Its inertia in its own frame.
    pub inertia: Inertia,
    /// The links in it, with their poses in the body.
    pub links: Vec<(usize, Isometry3<f64>)>,
}

/// The arm as bodies, each after the one that carries it.
#[derive(Debug, Clone)]
pub struct Tree {
    /// The bodies, the base first.
    pub bodies: Vec<Body>,
    /// The body of each arm joint, base first.
    pub arm: Vec<usize>,
    /// The body of each jaw, the leading one first.
    pub jaws: Vec<usize>,
    /// The body and the pose in it of each link.
    pub links: Vec<(usize, Isometry3<f64>)>,
}

impl Tree {
    /// Merges the links of the model into bodies.
    pub fn new(model: &ArmModel) -> Self {
        let base = Body {
            parent: None,
            joint: None,
            inertia: model.links[model.base].inertia,
            links: vec![(model.base, Isometry3::identity())],
        };
        let mut bodies = vec![base];
        let mut links = vec![(0, Isometry3::identity()); model.links.len()];
        let mut body_of_joint = vec![0; model.joints.len()];
        for (i, joint) in model.joints.iter().enumerate() {
            let (body, body_from_parent) = links[joint.parent];
            let link = &model.links[joint.child];
            if joint.kind == JointKind::Fixed {
                let body_from_link = body_from_parent * joint.origin;
                links[joint.child] = (body, body_from_link);
                let part = link.inertia.seen_from(&body_from_link);
                bodies[body].inertia = bodies[body].inertia.welded(&part);
                bodies[body].links.push((joint.child, body_from_link));
            } else {
                let origin = body_from_parent * joint.origin;
                bodies.push(Body {
                    parent: Some(body),
                    joint: Some(JointModel { origin, ..joint.clone() }),
                    inertia: link.inertia,
                    links: vec![(joint.child, Isometry3::identity())],
                });
                links[joint.child] = (bodies.len() - 1, Isometry3::identity());
            }
            body_of_joint[i] = links[joint.child].0;
        }
        let arm = model.arm.iter().map(|&i| body_of_joint[i]).collect();
        let jaws = model.jaws.iter().map(|&i| body_of_joint[i]).collect();
        Self { bodies, arm, jaws, links }
    }

    /// Returns the torque (N·m) or force (N) of each body's joint that makes the motion happen.
    ///
    /// `q`, `dq` and `ddq` hold one coordinate per body, rad or m and per s, 0 for the base; `gravity`
    /// is in base coordinates, m/s²; `load` is one more inertia held by a body, in that body's frame.
    ///
    /// Source: Featherstone, *Rigid Body Dynamics Algorithms*, table 5.1, in body coordinates.
    pub fn inverse_dynamics(
        &self,
        q: &[f64],
        dq: &[f64],
        ddq: &[f64],
        gravity: Vector3<f64>,
        load: Option<(usize, Inertia)>,
    ) -> Vec<f64> {
        let n = self.bodies.len();
        let mut poses = vec![Isometry3::identity(); n];
        let (mut w, mut dw) = (vec![Vector3::zeros(); n], vec![Vector3::zeros(); n]);
        // The linear velocity of a body's origin is not needed, its acceleration is. Gravity enters as
        // an upward acceleration of the base.
        let mut a = vec![-gravity; n];
        for (i, body) in self.bodies.iter().enumerate() {
            let (Some(parent), Some(joint)) = (body.parent, &body.joint) else { continue };
            let parent_from_body = joint.parent_from_child(q[i]);
            let back = parent_from_body.rotation.inverse();
            let arm = parent_from_body.translation.vector;
            let axis = joint.axis.into_inner();
            let (wp, dwp) = (back * w[parent], back * dw[parent]);
            let carried = back
                * (a[parent] + dw[parent].cross(&arm) + w[parent].cross(&w[parent].cross(&arm)));
            if joint.kind == JointKind::Revolute {
                w[i] = wp + axis * dq[i];
                dw[i] = dwp + axis * ddq[i] + wp.cross(&axis) * dq[i];
                a[i] = carried;
            } else {
                w[i] = wp;
                dw[i] = dwp;
                a[i] = carried + axis * ddq[i] + 2.0 * wp.cross(&axis) * dq[i];
            }
            poses[i] = parent_from_body;
        }
        let (mut force, mut moment) = (vec![Vector3::zeros(); n], vec![Vector3::zeros(); n]);
        let mut tau = vec![0.0; n];
        for i in (0..n).rev() {
            let body = &self.bodies[i];
            let mut inertia = body.inertia;
            if let Some((at, held)) = &load
                && *at == i
            {
                inertia = inertia.welded(held);
            }
            let c = inertia.com;
            let f = inertia.mass * (a[i] + dw[i].cross(&c) + w[i].cross(&w[i].cross(&c)));
            let turn = inertia.about_com * dw[i] + w[i].cross(&(inertia.about_com * w[i]));
            force[i] += f;
            moment[i] += turn + c.cross(&f);
            let (Some(parent), Some(joint)) = (body.parent, &body.joint) else { continue };
            let axis = joint.axis.into_inner();
            tau[i] = match joint.kind {
                JointKind::Prismatic => axis.dot(&force[i]),
                JointKind::Revolute | JointKind::Fixed => axis.dot(&moment[i]),
            };
            let f_parent = poses[i].rotation * force[i];
            let m_parent =
                poses[i].rotation * moment[i] + poses[i].translation.vector.cross(&f_parent);
            force[parent] += f_parent;
            moment[parent] += m_parent;
        }
        tau
    }
}
