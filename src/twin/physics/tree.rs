//! The arm as the physics takes it from the [`Robot`]: bodies with inertia, joined in a tree.
//!
//! Links that nothing moves against each other are welded into one [`Body`]. Every entry of `q` moves
//! one body, the opening moves the two jaws; what else the robot's file lets move stays put. What
//! torques a motion takes is [`crate::motion::dynamics`]'s to say, not the engine's.

use nalgebra::Isometry3;

use super::super::{Error, Unfit};
use crate::motion::Inertial;
use crate::motion::dynamics::Linkage;
use crate::motion::robot::{Drive, Joint, Link, Motion, Robot};

/// A rigid piece of the arm: one or more links welded together.
#[derive(Debug, Clone)]
pub struct Body {
    /// The body that carries it, `None` for the base.
    pub parent: Option<usize>,
    /// The joint that moves it, its origin given in the parent *body*; `None` for the base.
    pub joint: Option<Joint>,
    /// Its inertia in its own frame.
    pub inertial: Inertial,
    /// The links in it, by index in the robot, with their poses in the body.
    pub links: Vec<(usize, Isometry3<f64>)>,
}

/// The arm as bodies, each after the one that carries it.
#[derive(Debug, Clone)]
pub struct Tree {
    /// The bodies, the base first.
    pub bodies: Vec<Body>,
    /// The body of each entry of `q`.
    pub arm: Vec<usize>,
    /// The bodies of the two jaws.
    pub jaws: [usize; 2],
    /// The bodies beyond the last joint of the arm.
    pub hand: Vec<usize>,
    /// The body and the pose in it of each link of the robot.
    pub links: Vec<(usize, Isometry3<f64>)>,
    /// The same as motion reckons with it, joints by the bodies they move: the base is none.
    pub(super) linkage: Linkage,
}

impl Tree {
    /// Welds the links of a robot into bodies.
    ///
    /// # Errors
    ///
    /// [`Error::Robot`] when joints of the arm follow each other, or the gripper is not a pair of sliding
    /// jaws that move alike: the physics couples nothing else.
    pub fn new(robot: &Robot) -> Result<Self, Error> {
        let mut bodies: Vec<Body> = Vec::new();
        let mut links: Vec<(usize, Isometry3<f64>)> = Vec::new();
        for (at, link) in robot.links().iter().enumerate() {
            let inertial = link.inertial.unwrap_or_else(Inertial::zero);
            let (parent, body_from_parent) = match link.parent {
                Some(parent) => (Some(links[parent].0), links[parent].1),
                None => (None, Isometry3::identity()),
            };
            let joint = &link.joint;
            match parent {
                Some(body) if !moves(link) => {
                    // Nothing drives it, so no q enters its value; knuckles stay where the jaws are open.
                    let stays_at = joint.parent_from_link(joint.value(&[], robot.max_opening()));
                    let body_from_link = body_from_parent * stays_at;
                    let part = inertial.seen_from(&body_from_link);
                    bodies[body].inertial = bodies[body].inertial.welded(&part);
                    bodies[body].links.push((at, body_from_link));
                    links.push((body, body_from_link));
                }
                _ => {
                    let parent_from_link = body_from_parent * joint.parent_from_link;
                    let joint = parent.map(|_| Joint { parent_from_link, ..joint.clone() });
                    let own = vec![(at, Isometry3::identity())];
                    bodies.push(Body { parent, joint, inertial, links: own });
                    links.push((bodies.len() - 1, Isometry3::identity()));
                }
            }
        }
        let driven = robot.links().iter().filter(|l| matches!(l.joint.drive, Drive::Joint { .. }));
        if driven.count() != robot.n_joints() {
            return Err(Unfit::Mimic.into());
        }
        let arm: Vec<usize> = robot.joints().iter().map(|joint| links[joint.link].0).collect();
        let pair = robot.pair().ok_or(Unfit::Gripper)?;
        let jaws = pair.map(|link| links[link].0);
        let mut hand: Vec<usize> = arm.last().copied().into_iter().collect();
        for (at, body) in bodies.iter().enumerate() {
            if body.parent.is_some_and(|parent| hand.contains(&parent)) {
                hand.push(at);
            }
        }
        let mut driven = robot.links().to_vec();
        for (link, &(body, _)) in driven.iter_mut().zip(&links) {
            if moves(link) && link.parent.is_some() {
                let index = body - 1;
                link.joint.drive = Drive::Joint { index, multiplier: 1.0, offset: 0.0 };
            }
        }
        let linkage = Linkage::of(&driven, robot.max_opening(), bodies.len() - 1);
        Ok(Self { bodies, arm, jaws, hand, links, linkage })
    }
}

/// Returns whether `q` or the opening moves a link against its parent.
fn moves(link: &Link) -> bool {
    match link.joint.drive {
        Drive::Joint { .. } => true,
        Drive::Jaw { .. } => link.joint.motion == Motion::Slide,
        Drive::None | Drive::Knuckle { .. } => false,
    }
}
