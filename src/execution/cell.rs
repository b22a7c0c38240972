//! What never changes while actions run: arm, scene, limits, finger pads, as declared or as the regressions found
//! them.

use std::sync::Arc;

use crate::arm::limits::{Cleared, ClearedGrip, LimitError, Limits};
use crate::motion::Robot;
use crate::motion::free::Means;
use crate::motion::trajectory::Trajectory;
use crate::twin::Settings;
use crate::world::frame::{Tool, World};
use crate::world::{Pose, Scene};

/// What never changes while actions run: the cell as it is declared, or as the regressions found it.
#[derive(Debug, Clone)]
pub struct Cell {
    /// The arm model.
    pub robot: Arc<Robot>,
    /// What is known beforehand.
    pub scene: Arc<Scene>,
    /// Bounds on every motion.
    pub limits: Limits,
    /// How the finger pads hold.
    pub pads: Pads,
    /// How free motions are found.
    pub means: Means,
}

impl Cell {
    /// Returns the tool's pose at joint positions `q`, rad.
    pub fn tool_pose(&self, q: &[f64]) -> Pose<World, Tool> {
        let base_from_tool = self.robot.forward_tool(q).expect("the plan has one angle per joint");
        self.scene.world_from_base * base_from_tool
    }

    /// Passes a trajectory that begins at the last command `from` (rad) through the limits.
    ///
    /// # Errors
    ///
    /// As [`Limits::clear`].
    pub fn clear(&self, trajectory: Trajectory, from: &[f64]) -> Result<Cleared, LimitError> {
        self.limits.clear(&self.robot, &self.scene.world_from_base, trajectory, from)
    }

    /// Passes a grip through the limits: opening in m, speed in m/s, force of each pad in N.
    ///
    /// # Errors
    ///
    /// As [`Limits::clear_grip`].
    pub fn clear_grip(
        &self,
        opening: f64,
        speed: f64,
        force: f64,
    ) -> Result<ClearedGrip, LimitError> {
        self.limits.clear_grip(&self.robot, opening, speed, force)
    }
}

/// What is known of how the finger pads hold a thing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pads {
    /// Coefficient of friction on what is held.
    pub friction: f64,
    /// Coefficient of friction of what things stand on.
    pub table_friction: f64,
    /// How fast a thing creeps along them the way its weight pulls, m/s.
    pub creep: f64,
}

impl Pads {
    /// Takes what the twin is built with.
    pub fn of(settings: &Settings) -> Self {
        let friction = &settings.friction;
        let (pads, table) = (friction.pad_object, friction.table_object);
        Self { friction: pads, table_friction: table, creep: friction.pad_creep }
    }
}
