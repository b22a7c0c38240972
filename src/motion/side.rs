//! The side file `robot.toml`: what a URDF has no place for.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::error::Error;
use super::fault::SideFault;
use super::robot::{Drive, Joint, Link, Marker, Motion, Robot};

/// What the link is called that a tool centre point without a link of its own becomes.
const TOOL: &str = "tool (robot.toml)";

/// The file, key by key.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SideFile {
    /// The tip when no other is named.
    pub(super) tip: Option<String>,
    tool: Option<ToolPoint>,
    marker: Option<MarkerBall>,
    max_acceleration_rad_s2: Option<Vec<f64>>,
    max_jerk_rad_s3: Option<Vec<f64>>,
    #[serde(default)]
    poses_deg: BTreeMap<String, Vec<f64>>,
    #[serde(default)]
    unchecked: Vec<Unchecked>,
}

/// Says so if a list of limits is not a positive number for each joint.
fn positive(limits: &[f64], joints: usize, key: &'static str) -> Result<(), Error> {
    if limits.len() < joints || limits.iter().any(|limit| limit.is_nan() || *limit <= 0.0) {
        return Err(Error::SideFile { what: SideFault::JointLimits { key, joints } });
    }
    Ok(())
}

/// Says of a link that there is none where the file names it, under `key`.
pub(super) fn named_in_file(key: &'static str) -> impl Fn(Error) -> Error {
    move |error| match error {
        Error::NoLink { name, known } => {
            Error::SideFile { what: SideFault::NoLink { key, name, known } }
        }
        other => other,
    }
}

/// Where the tool centre point is: at a link of the URDF, or at a place on one.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum ToolPoint {
    Link(String),
    Place(ToolPlace),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ToolPlace {
    link: String,
    #[serde(default)]
    xyz_m: [f64; 3],
    #[serde(default)]
    rpy_deg: [f64; 3],
}

impl ToolPoint {
    /// Returns the index of the tool's link; a place becomes one.
    fn on(&self, robot: &mut Robot) -> Result<usize, Error> {
        let place = match self {
            Self::Link(name) => return robot.link(name).map_err(named_in_file("tool")),
            Self::Place(place) => place,
        };
        if place.xyz_m.iter().chain(&place.rpy_deg).any(|x| !x.is_finite()) {
            return Err(Error::SideFile { what: SideFault::ToolNumbers });
        }
        let parent = robot.link(&place.link).map_err(named_in_file("tool: link"))?;
        let [roll, pitch, yaw] = place.rpy_deg.map(f64::to_radians);
        let joint = Joint {
            name: String::new(),
            parent_from_link: Isometry3::from_parts(
                Translation3::from(Vector3::from(place.xyz_m)),
                UnitQuaternion::from_euler_angles(roll, pitch, yaw),
            ),
            motion: Motion::Fixed,
            axis: Vector3::z_axis(),
            drive: Drive::None,
            range: (0.0, 0.0),
        };
        let (visual, collision) = (Vec::new(), Vec::new());
        let (name, parent) = (TOOL.to_owned(), Some(parent));
        robot.links.push(Link { name, parent, joint, inertial: None, visual, collision });
        Ok(robot.links.len() - 1)
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Unchecked {
    link: String,
    with: Vec<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MarkerBall {
    link: String,
    centre_m: [f64; 3],
    radius_m: f64,
    colour_srgb: [u8; 3],
}

impl MarkerBall {
    fn on(&self, robot: &Robot) -> Result<Marker, Error> {
        let wrong = |what| Err(Error::SideFile { what });
        let link = robot.link(&self.link).map_err(named_in_file("[marker] link"))?;
        let mut above = Some(link);
        while let Some(at) = above {
            if robot.jaws().any(|jaw| jaw == at) {
                return wrong(SideFault::MarkerMoves { link: self.link.clone() });
            }
            above = robot.links[at].parent;
        }
        let positive = self.radius_m.is_finite() && self.radius_m > 0.0;
        if !positive || self.centre_m.iter().any(|x| !x.is_finite()) {
            return wrong(SideFault::MarkerNumbers);
        }
        let (centre, radius) = (self.centre_m.into(), self.radius_m);
        Ok(Marker { link, centre, radius, colour: self.colour_srgb })
    }
}

impl SideFile {
    pub(super) fn parse(text: &str) -> Result<Self, Error> {
        toml::from_str(text)
            .map_err(|error| Error::SideFile { what: SideFault::Format(error.to_string()) })
    }

    /// Adds what the file says to a robot that was just read; `whole` is how many joints the arm has up to the tip that is
    /// meant where nobody names one.
    pub(super) fn apply(self, robot: &mut Robot, whole: usize) -> Result<(), Error> {
        if let Some(tool) = &self.tool {
            robot.tool = Some(tool.on(robot)?);
        }
        if let Some(marker) = &self.marker {
            robot.marker = Some(marker.on(robot)?);
        }
        robot.has_side_file = !self.unchecked.is_empty();
        for entry in &self.unchecked {
            let first = robot.link(&entry.link).map_err(named_in_file("[[unchecked]] link"))?;
            for other in &entry.with {
                let second = robot.link(other).map_err(named_in_file("[[unchecked]] with"))?;
                robot.unchecked.push((first.min(second), first.max(second)));
            }
        }
        // A tip half-way up the arm has fewer joints than the file speaks of; the first ones are meant.
        let n = robot.joints.len();
        if let Some(limits) = &self.max_acceleration_rad_s2 {
            positive(limits, n, "max_acceleration_rad_s2")?;
            robot.states_accelerations = true;
            for (joint, limit) in robot.joints.iter_mut().zip(limits) {
                joint.acceleration = *limit;
            }
        }
        if let Some(limits) = &self.max_jerk_rad_s3 {
            positive(limits, n, "max_jerk_rad_s3")?;
            for (joint, limit) in robot.joints.iter_mut().zip(limits) {
                joint.jerk = Some(*limit);
            }
        }
        for (name, pose) in self.poses_deg {
            let most = n.max(whole);
            if pose.len() < n || pose.len() > most {
                let joints = if pose.len() < n { n } else { most };
                let what = SideFault::PoseLength { name, angles: pose.len(), joints };
                return Err(Error::SideFile { what });
            }
            let in_si = |(joint, value): (usize, &f64)| {
                if robot.slides(joint) { *value } else { value.to_radians() }
            };
            let q = pose[..n].iter().enumerate().map(in_si).collect();
            robot.poses.insert(name, q);
        }
        Ok(())
    }
}
