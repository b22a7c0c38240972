//! The side file `robot.toml`: what a URDF has no place for.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::error::Error;
use super::fault::SideFault;
use super::robot::{Marker, Robot};

/// The file, key by key.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SideFile {
    /// The tip when no other is named.
    pub(super) tip: Option<String>,
    tool: Option<String>,
    marker: Option<MarkerBall>,
    max_acceleration_rad_s2: Option<Vec<f64>>,
    #[serde(default)]
    poses_deg: BTreeMap<String, Vec<f64>>,
    #[serde(default)]
    unchecked: Vec<Unchecked>,
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
        let link = robot.link(&self.link)?;
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

    /// Adds what the file says to a robot that was just read.
    pub(super) fn apply(self, robot: &mut Robot) -> Result<(), Error> {
        if let Some(tool) = &self.tool {
            robot.tool = Some(robot.link(tool)?);
        }
        if let Some(marker) = &self.marker {
            robot.marker = Some(marker.on(robot)?);
        }
        robot.has_side_file = !self.unchecked.is_empty();
        for entry in &self.unchecked {
            let first = robot.link(&entry.link)?;
            for other in &entry.with {
                let second = robot.link(other)?;
                robot.unchecked.push((first.min(second), first.max(second)));
            }
        }
        // A tip half-way up the arm has fewer joints than the file speaks of; the first ones are meant.
        let n = robot.joints.len();
        if let Some(limits) = &self.max_acceleration_rad_s2 {
            if limits.len() < n || limits.iter().any(|a| a.is_nan() || *a <= 0.0) {
                let what = SideFault::Accelerations { joints: n };
                return Err(Error::SideFile { what });
            }
            for (joint, limit) in robot.joints.iter_mut().zip(limits) {
                joint.acceleration = *limit;
            }
        }
        for (name, pose) in self.poses_deg {
            if pose.len() < n {
                let what = SideFault::PoseLength { name, angles: pose.len(), joints: n };
                return Err(Error::SideFile { what });
            }
            let radians = pose[..n].iter().map(|deg| deg.to_radians()).collect();
            robot.poses.insert(name, radians);
        }
        Ok(())
    }
}
