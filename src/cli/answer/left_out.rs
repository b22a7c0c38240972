//! What of a robot an answer knows nothing of: parts without a shape, which nothing can be kept clear of, and without a mass.
//!
//! A robot in, names out. Whether that matters for a use of the robot, and what to write, is `robot check`'s to say.

use std::fmt::Write as _;

use serde::Serialize;

use crate::motion::dynamics::Bodies;
use crate::motion::fault::Note;
use crate::motion::robot::{Drive, Motion, Robot};

/// Something of a robot that is not checked for collisions.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// The link.
    pub link: String,
    /// Its mesh, as the URDF names it, where that is what is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// Why.
    pub why: String,
}

/// Returns what is not checked for collisions: meshes that are not read, and parts that move and have no shape.
pub(super) fn of_collisions(robot: &Robot) -> Vec<LeftOut> {
    let links = robot.links();
    let meshes = robot.notes().iter().filter_map(|note| match note {
        Note::Mesh { link, file, what } => {
            Some(LeftOut { link: link.clone(), mesh: Some(file.clone()), why: what.to_string() })
        }
        _ => None,
    });
    let mut found: Vec<LeftOut> = meshes.collect();
    let is_told = |link: usize| found.iter().any(|left| left.link == links[link].name);
    let is_bare = |part: &Vec<usize>| {
        part.iter().all(|&link| links[link].collision.is_empty() && !is_told(link))
    };
    let bare: Vec<LeftOut> = parts(robot)
        .into_iter()
        .filter(is_bare)
        .map(|part| LeftOut {
            link: links[part[0]].name.clone(),
            mesh: None,
            why: "it has no collision shape".to_owned(),
        })
        .collect();
    found.extend(bare);
    found
}

/// Returns the same as lines for people that follow others, each after a line break; nothing where all is checked.
pub(super) fn lines(left_out: &[LeftOut]) -> String {
    if left_out.is_empty() {
        return String::new();
    }
    let mut text = String::from("\nnot checked for collisions:");
    for LeftOut { link, mesh, why } in left_out {
        let mesh = mesh.as_ref().map(|mesh| format!("the mesh {mesh} is left out: "));
        let _ = write!(text, "\n  {link}: {}{why}", mesh.unwrap_or_default());
    }
    text + "\nhelp: <collision> with a box, cylinder or sphere, or a mesh in STL or OBJ"
}

/// Returns what is to be known of torques and masses, one sentence each: which of the parts that count have no mass.
pub(super) fn of_masses(robot: &Robot, bodies: Bodies) -> Vec<String> {
    let links = robot.links();
    let mut counts = vec![true; links.len()];
    for (at, link) in links.iter().enumerate() {
        let is_beyond = |parent: usize| parent == robot.tip() || !counts[parent];
        let is_left = bodies == Bodies::UpToTip && link.parent.is_some_and(is_beyond);
        counts[at] = !is_left;
    }
    let is_light = |part: &Vec<usize>| {
        counts[part[0]] && part.iter().all(|&link| !counts[link] || links[link].inertial.is_none())
    };
    let light = parts(robot).into_iter().filter(is_light);
    let names: Vec<&str> = light.map(|part| links[part[0]].name.as_str()).collect();
    if names.is_empty() {
        return Vec::new();
    }
    vec![format!(
        "no <inertial> with a mass: {}; gravity and mass matrix are those of the other parts alone",
        names.join(", ")
    )]
}

/// Returns the parts that `q` or the opening moves, as links that are fixed to each other; the first is the one with
/// the joint.
pub(super) fn parts(robot: &Robot) -> Vec<Vec<usize>> {
    let moves = |link: usize| {
        let joint = &robot.links()[link].joint;
        matches!(joint.drive, Drive::Joint { .. })
            || (joint.motion == Motion::Slide && joint.drive.is_of_gripper())
    };
    let all = 0..robot.links().len();
    let roots = all.clone().filter(|&link| moves(link));
    roots.map(|root| all.clone().filter(|&link| robot.carrier(link) == root).collect()).collect()
}
