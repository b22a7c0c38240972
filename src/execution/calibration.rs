//! What the three regressions found, and the cell as it is when they are believed. They are fitted in
//! [`super::calibrate`].

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::motion::Robot;
use crate::world::frame::{Base, World};
use crate::world::{Camera, Pose, Scene};

use super::cell::Cell;
use super::wording;

/// What the regressions found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// The camera as it stands and sees.
    pub camera: Camera,
    /// Carries a real pose into the pose the arm, its zeros put right, takes for it: `D` of `p_s = D p_r`
    /// (Eq. 7).
    pub reported_from_real: Pose<World, World>,
    /// Real angle less the reported one, rad, a joint each; none for none.
    pub zeros: Vec<f64>,
    /// How far the gripper sits from its place on the flange, m, flange axes.
    pub tool_shift: [f64; 3],
    /// What was fitted, in words, for the record.
    pub notes: Vec<String>,
    /// How far off what was found still is, as far as it was measured. Records of older programs do not say.
    #[serde(default)]
    pub left: Left,
}

/// How far the adapted camera and robot are from what was measured: standard deviations along one axis of the table, m.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Left {
    /// Of a dot of the table from where the camera in force sees it, whatever was fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_m: Option<f64>,
    /// Of the hand, at the points that were visited, by the fit's covariance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot_m: Option<f64>,
}

impl Calibration {
    /// Believes the scene file.
    pub fn nominal(scene: &Scene) -> Self {
        Self {
            camera: scene.camera,
            reported_from_real: Pose::identity(),
            zeros: Vec::new(),
            tool_shift: [0.0; 3],
            notes: vec![wording::nothing_calibrated()],
            left: Left::default(),
        }
    }

    /// Returns a cell as it really is: of the joint positions that the arm reports and takes, its robot,
    /// standing where its scene has it, makes real poses.
    ///
    /// Whoever plans and rehearses with this cell does so with the very joint positions that the arm is sent
    /// to, so the ends of its ranges, its speeds and its height over the table are the arm's own, and nothing
    /// is left to correct when the arm moves.
    pub fn cell(&self, declared: &Cell) -> Cell {
        let robot = self.robot(&declared.robot);
        let mut scene = Scene::clone(&declared.scene);
        scene.world_from_base = self.world_from_base(&scene);
        Cell { robot: Arc::new(robot), scene: Arc::new(scene), ..declared.clone() }
    }

    /// Returns a declared robot with the zeros and the gripper that were found.
    pub fn robot(&self, declared: &Robot) -> Robot {
        declared.clone().with_zero_offsets(&self.zeros).with_tool_shift(self.tool_shift.into())
    }

    /// Returns where the base of a declared scene really stands.
    pub fn world_from_base(&self, declared: &Scene) -> Pose<World, Base> {
        self.reported_from_real.inverse() * declared.world_from_base
    }
}
