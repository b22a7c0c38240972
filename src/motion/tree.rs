//! The tree of a URDF: links in an order with parents first, and where the arm ends.

use std::collections::{BTreeMap, BTreeSet};

use urdf_rs::JointType;

use super::error::Error;
use super::fault::UrdfFault;

/// Names that URDFs give the flange, by common use: Kinova, ROS-Industrial, Universal Robots.
const FLANGE_NAMES: [&str; 4] = ["end_effector_link", "tool0", "ee_link", "flange"];

/// One link in the order that puts parents first.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    /// Index among the file's links.
    pub(super) link: usize,
    /// Place of the parent in this order.
    pub(super) parent: Option<usize>,
    /// Index among the file's joints.
    pub(super) joint: Option<usize>,
}

/// Returns the links, parents before children, otherwise as the file lists the joints.
///
/// # Errors
///
/// [`Error::Urdf`] if the links do not form one tree.
pub(super) fn order(urdf: &urdf_rs::Robot) -> Result<Vec<Step>, Error> {
    let fail = |what| Err(Error::Urdf { what });
    let mut index = BTreeMap::new();
    for (at, link) in urdf.links.iter().enumerate() {
        if index.insert(link.name.as_str(), at).is_some() {
            return fail(UrdfFault::SameName { name: link.name.clone() });
        }
    }
    let mut carried: Vec<Option<&str>> = vec![None; urdf.links.len()];
    let mut names = BTreeSet::new();
    for joint in &urdf.joints {
        if !names.insert(joint.name.as_str()) {
            return fail(UrdfFault::SameJoint { name: joint.name.clone() });
        }
        for end in [&joint.parent.link, &joint.child.link] {
            if !index.contains_key(end.as_str()) {
                return fail(UrdfFault::NoSuchLink {
                    joint: joint.name.clone(),
                    link: end.clone(),
                });
            }
        }
        let child = index[joint.child.link.as_str()];
        if let Some(other) = carried[child] {
            return fail(UrdfFault::TwoParents {
                link: joint.child.link.clone(),
                first: other.to_owned(),
                second: joint.name.clone(),
            });
        }
        carried[child] = Some(&joint.name);
    }
    let roots: Vec<usize> = (0..urdf.links.len()).filter(|&at| carried[at].is_none()).collect();
    let root = match roots[..] {
        [root] => root,
        [] => return fail(UrdfFault::NoRoot),
        [first, second, ..] => {
            return fail(UrdfFault::TwoRoots {
                first: urdf.links[first].name.clone(),
                second: urdf.links[second].name.clone(),
            });
        }
    };
    let mut steps = vec![Step { link: root, parent: None, joint: None }];
    let mut at = 0;
    while at < steps.len() {
        let parent = &urdf.links[steps[at].link].name;
        for (joint_idx, joint) in urdf.joints.iter().enumerate() {
            if joint.parent.link == *parent {
                let link = index[joint.child.link.as_str()];
                steps.push(Step { link, parent: Some(at), joint: Some(joint_idx) });
            }
        }
        at += 1;
    }
    if steps.len() < urdf.links.len() {
        return fail(UrdfFault::LooseLoop);
    }
    Ok(steps)
}

/// Returns the links from the root's child to `tip`.
pub(super) fn path(order: &[Step], tip: usize) -> Vec<usize> {
    let mut path = Vec::new();
    let mut at = tip;
    while let Some(parent) = order[at].parent {
        path.push(at);
        at = parent;
    }
    path.reverse();
    path
}

/// Returns where the arm ends when nobody says: along the only way with moving joints, then the
/// flange by its usual names, else the longest way of fixed joints.
///
/// # Errors
///
/// [`Error::Branches`] if the ways part before any joint moved, or one of them has more joints than all before it: fingers
/// have fewer than their arm, and arms more than the column that carries them.
pub(super) fn default_tip(
    urdf: &urdf_rs::Robot,
    order: &[Step],
    jaws: &[bool],
) -> Result<usize, Error> {
    let joint_moves =
        |at: usize| order[at].joint.is_some_and(|j| urdf.joints[j].joint_type != JointType::Fixed);
    let moves = |at: usize| joint_moves(at) && !jaws[at];
    let leads =
        |at: usize| moves(at) && order[at].joint.is_some_and(|j| urdf.joints[j].mimic.is_none());
    // Whether anything at or beyond a link moves, and how many joints of their own there are on the longest way.
    let (mut mobile, mut longest) = (vec![false; order.len()], vec![0; order.len()]);
    for at in (0..order.len()).rev() {
        mobile[at] |= moves(at);
        longest[at] += usize::from(leads(at));
        if let Some(parent) = order[at].parent {
            mobile[parent] |= mobile[at];
            longest[parent] = longest[parent].max(longest[at]);
        }
    }
    let mut at = 0;
    let mut passed = 0;
    let mut last = 0;
    loop {
        let next: Vec<usize> =
            (at + 1..order.len()).filter(|&c| order[c].parent == Some(at) && mobile[c]).collect();
        match next[..] {
            [] => break,
            [only] => {
                at = only;
                // What the arm goes on through is its own, also where something beside it moves alike.
                if joint_moves(at) {
                    passed += 1;
                    last = at;
                }
            }
            [..] if passed > 0 && next.iter().all(|&c| longest[c] <= passed) => break,
            [..] => {
                return Err(Error::Branches {
                    link: urdf.links[order[at].link].name.clone(),
                    ways: next.iter().map(|&c| urdf.links[order[c].link].name.clone()).collect(),
                });
            }
        }
    }
    // Links rigidly joined to the last that moved, with how far out they are.
    let mut depth = vec![None; order.len()];
    depth[last] = Some(0);
    for child in last + 1..order.len() {
        let parent = order[child].parent.and_then(|parent| depth[parent]);
        if let Some(d) = parent
            && order[child].joint.is_some_and(|j| urdf.joints[j].joint_type == JointType::Fixed)
        {
            depth[child] = Some(d + 1);
        }
    }
    let rigid = |at: &usize| depth[*at].is_some();
    let by_name = FLANGE_NAMES.iter().find_map(|name| {
        (last..order.len()).filter(rigid).find(|&at| urdf.links[order[at].link].name == *name)
    });
    let deepest =
        (last..order.len()).filter(rigid).max_by_key(|&at| (depth[at], std::cmp::Reverse(at)));
    Ok(by_name.or(deepest).unwrap_or(last))
}
