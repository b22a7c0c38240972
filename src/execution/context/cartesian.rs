//! The tool in the world: where it is, straight to a pose, turned in its place.

use nalgebra::{UnitVector3, Vector3};

use super::super::decisions::{Entry, Kind};
use super::super::error::ActionError;
use super::super::plan::Planner;
use super::super::refusal::Refusal;
use super::super::tool_pose::ToolPose;
use super::ActionContext;
use crate::trace::NoWay;

/// How fast `arm.turn_about` turns the hand, rad/s. Chosen: 30 deg/s, a third of what joint 7 may do.
const TURNING: f64 = 30.0 * std::f64::consts::PI / 180.0;

impl ActionContext {
    /// `arm.pose()`: where the plan has the tool.
    pub(in super::super) fn tool_pose(&self) -> ToolPose {
        ToolPose(self.setting.cell.tool_pose(&self.run.q))
    }

    /// `arm.joints()`: joint positions as measured, rad; `arm.torques()`: joint torques, N·m.
    pub(in super::super) fn measured(&mut self) -> Result<(Vec<f64>, Vec<f64>), ActionError> {
        let feedback = self.body.arm().feedback()?;
        Ok((feedback.q, feedback.tau))
    }

    /// `twin.reach(pose)`: joint positions that bring the tool there and touch nothing, nearest first.
    pub(in super::super) fn reach(&mut self, at: &ToolPose) -> Result<Vec<Vec<f64>>, ActionError> {
        if let Some(found) = self.logged_path()? {
            return Ok(found);
        }
        let found = self.planner()?.reaches(&at.0)?;
        self.run.log.record(Entry::Path(found.clone()));
        Ok(found)
    }

    /// `arm.move_to(pose)`: there round everything in the way, the nearest way the arm has.
    pub(in super::super) fn move_to_pose(&mut self, at: &ToolPose) -> Result<(), ActionError> {
        let goals = self.reach(at)?;
        let goal = goals.first().ok_or(Refusal::NoWays)?.clone();
        self.move_to(&goal, None, 1.0)
    }

    /// `arm.line_to(pose, speed)`.
    pub(in super::super) fn line_to(
        &mut self,
        to: &ToolPose,
        speed: f64,
    ) -> Result<(), ActionError> {
        let path = self.planned_path(|planner| planner.line_to(&to.0))?;
        self.follow(&path, speed)
    }

    /// `arm.turn_about(axis, angle)`.
    pub(in super::super) fn turn_about(
        &mut self,
        axis: UnitVector3<f64>,
        angle: f64,
    ) -> Result<(), ActionError> {
        let path = self.planned_path(|planner| planner.turned(axis, angle))?;
        self.turn(&path, TURNING)
    }

    /// `twin.turned(o)`: how `o` is turned about the vertical, rad.
    pub(in super::super) fn turned(&mut self, o: &str) -> Result<f64, ActionError> {
        let state = self.state()?;
        let pose = state.object(o).and_then(|object| object.world_from_object);
        Ok(pose.ok_or_else(|| Refusal::UnknownPlace(o.to_owned()))?.yaw())
    }

    /// `twin.size(o)`: the box that `o` fills when it stands, m.
    pub(in super::super) fn size(&self, o: &str) -> Result<[f64; 3], ActionError> {
        let object = self.setting.cell.scene.object(o);
        let shape = &object.ok_or_else(|| Refusal::NoObject(o.to_owned()))?.shape;
        let [x, y] = shape.faces().unwrap_or([2.0 * shape.outer_radius(); 2]);
        Ok([x, y, shape.height()])
    }

    pub(super) fn logged_path(&mut self) -> Result<Option<Vec<Vec<f64>>>, ActionError> {
        Ok(self.run.log.next(Kind::Path, |entry| match entry {
            Entry::Path(path) => Some(path.clone()),
            _ => None,
        })?)
    }

    /// `arm.raise(by, least, speed)`: the tool straight up by `by` m, or by less that the arm can follow, `least` m at least.
    pub fn raise(&mut self, by: f64, least: f64, speed: f64) -> Result<(), ActionError> {
        let path = self.planned_path(|planner| planner.raise(by, least))?;
        self.follow(&path, speed)
    }

    /// Returns the path that the rehearsal took, or in a rehearsal what `plan` finds.
    pub(super) fn planned_path(
        &mut self,
        plan: impl FnOnce(&Planner) -> Result<Vec<Vec<f64>>, NoWay>,
    ) -> Result<Vec<Vec<f64>>, ActionError> {
        if let Some(path) = self.logged_path()? {
            return Ok(path);
        }
        let path = plan(&self.planner()?)?;
        self.run.log.record(Entry::Path(path.clone()));
        Ok(path)
    }

    /// Returns a direction of the world as the base has it.
    pub(super) fn in_base(&self, way: &Vector3<f64>) -> Vector3<f64> {
        self.setting.cell.scene.world_from_base.inverse().rotation() * way
    }
}
