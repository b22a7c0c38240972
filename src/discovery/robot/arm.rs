//! The arm a recording was made with: the robot's file, and what the sidecar says of it.

use super::chain::Chain;
use super::error::Misfit;
use super::plant::Arm;
use crate::discovery::recording::sidecar::Controller;
use crate::discovery::recording::{Error, Recording};
use crate::motion::Robot;
use crate::motion::dynamics::GRAVITY;

impl Arm {
    /// Returns the arm a recording was made with.
    ///
    /// # Errors
    ///
    /// An [`Error`] for a robot that is no chain, or a sidecar whose lists are not of its length.
    pub fn of(robot: &Robot, recording: &Recording) -> Result<Self, Error> {
        Self::told(robot, recording).map_err(|misfit| misfit.at(&recording.name))
    }

    fn told(robot: &Robot, recording: &Recording) -> Result<Self, Misfit> {
        let sidecar = &recording.sidecar;
        let n = robot.n_joints();
        let gravity = sidecar.gravity.unwrap_or([0.0, 0.0, -GRAVITY]).into();
        let lists =
            [("armature_kg_m2", &sidecar.armature), ("zero_offset_rad", &sidecar.zero_offset)];
        for (key, list) in lists {
            if !list.is_empty() && list.len() < n {
                return Err(Misfit::JointList { key, given: list.len(), n });
            }
        }
        let robot = &robot.clone().with_zero_offsets(&sidecar.zero_offset);
        let chain = Chain::new(robot, sidecar.tip.as_deref(), gravity)?;
        if let Some(controller) = &sidecar.controller {
            check(controller, n)?;
        }
        let mut armature = sidecar.armature.clone();
        armature.resize(n, 0.0);
        Ok(Self {
            chain,
            armature,
            controller: sidecar.controller.clone(),
            torque_sensor: sidecar.torque_sensor,
            joint_names: robot.joints().iter().map(|joint| joint.name.clone()).collect(),
        })
    }
}

/// Checks that a controller is of a robot with `n` joints, and can be simulated.
fn check(controller: &Controller, n: usize) -> Result<(), Misfit> {
    let (given, limits) = (controller.kp_nm_per_rad.len(), controller.torque_limit_nm.len());
    if given != n || (limits != 0 && limits != n) {
        return Err(Misfit::Controller { given, n });
    }
    if !matches!(controller.kind.as_str(), "pd_with_gravity" | "pd") {
        return Err(Misfit::ControllerKind { kind: controller.kind.clone() });
    }
    Ok(())
}
