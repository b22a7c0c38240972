//! `--robot bridge://HOST:PORT`: a reality that somebody else wrote, and what stands beside it.

use std::fmt;

use crate::arm::{Camera, Cancel, DeviceError, Scales};
use crate::bridge::{self, Error as Trouble, Joint, Wanted};
use crate::execution::snapshot::{WebCamera, WebScales};
use crate::motion::robot::Robot;
use crate::motion::trajectory::Limits;
use crate::report::Failure;
use crate::workcell::{Devices, Error};
use crate::world::Scene;

use super::shared::CellArgs;

/// How a reality behind a bridge is named.
pub(super) const SCHEME: &str = "bridge://";

/// Where a bridge is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Target {
    /// `HOST:PORT`.
    pub(super) place: String,
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{SCHEME}{}", self.place)
    }
}

/// Reads `HOST:PORT`.
pub(super) fn target(rest: &str) -> Result<Target, Failure> {
    let place = rest.trim_end_matches('/');
    let is_whole = place
        .rsplit_once(':')
        .is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok());
    if !is_whole {
        return Err(Failure::input("robot::address", "the bridge's address is not whole")
            .at(format!("{SCHEME}{rest}"))
            .help("it is `bridge://HOST:PORT`, with a port up to 65535"));
    }
    Ok(Target { place: place.to_owned() })
}

/// Says that a reality cannot be worked with, as everything that is wrong with a device is said.
pub(super) fn refused(trouble: Trouble) -> Error {
    DeviceError::from(trouble).into()
}

/// Connects to the reality and what stands beside it. Nothing moves.
pub(super) fn devices(
    target: &Target,
    robot: &Robot,
    scene: &Scene,
    args: &CellArgs,
) -> Result<Devices, Trouble> {
    let joints = robot.joints().iter().zip(Limits::of(robot).jerk).map(|(joint, jerk)| Joint {
        name: joint.name.clone(),
        range: (joint.lower, joint.upper),
        effort: joint.effort,
        velocity: joint.velocity,
        acceleration: joint.acceleration,
        jerk,
    });
    let wanted = Wanted {
        robot: scene.robot.clone(),
        joints: joints.collect(),
        max_opening: robot.max_opening(),
    };
    let cancel = Cancel::default();
    let bridged = bridge::connect(&target.place, wanted, cancel.clone())?;
    let camera: Box<dyn Camera> = match (&args.camera_at, bridged.camera) {
        (Some(address), _) => Box::new(WebCamera(address.clone())),
        (None, Some(camera)) => {
            let lens = &scene.camera.intrinsics;
            let size = bridged.hello.camera.map(|size| (size.width, size.height));
            if let Some((width, height)) = size
                && (width, height) != (lens.width, lens.height)
            {
                return Err(Trouble::Picture {
                    theirs: format!("{width} x {height}"),
                    ours: format!("{} x {}", lens.width, lens.height),
                });
            }
            Box::new(camera)
        }
        (None, None) => return Err(Trouble::NoCamera),
    };
    let scales: Option<Box<dyn Scales>> = match (&args.scales_at, bridged.scales) {
        (Some(address), _) => Some(Box::new(WebScales(address.clone()))),
        (None, Some(scales)) => Some(Box::new(scales)),
        (None, None) => None,
    };
    // A simulator has all the speed that the robot's file allows; what runs in real time may be a robot.
    let limits = bridged.hello.realtime.then(|| Limits::of(robot).scaled(args.speed, args.speed));
    Ok(Devices { arm: Box::new(bridged.arm), camera, scales, limits, cancel })
}
