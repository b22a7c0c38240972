//! Where the links of the arm were at joint positions of a run that is kept.
//!
//! A run folder does not hold its robot; it names it ([`super::Setting`]). The robot and the scene at hand, with what the run's
//! regressions found, are believed to be the run's if they give the tool at the joint positions of its steps where its steps
//! say it was.

use nalgebra::Isometry3;

use crate::motion::Robot;
use crate::world::frame::{Base, World};
use crate::world::{Pose, Scene, WorldState};

use super::devices::place;
use super::{Error, Options, Run};

/// How far off the tool may be for the robot to be the run's, m. Chosen: positions are written to 1e-6 rad or better,
/// 1e-6 m at the tool; another robot, or one whose zeros are not the run's, is a millimetre off or more.
const SAME: f64 = 1e-4;

/// The links of a run's arm.
#[derive(Debug)]
pub struct Links {
    robot: Robot,
    world_from_base: Pose<World, Base>,
}

impl Links {
    /// Returns the links of a run's arm; `None` when the robot and the scene at hand are not the run's, or it has no
    /// state to tell by.
    ///
    /// # Errors
    ///
    /// As [`super::WorkCell::open`].
    pub fn of(run: &Run, mut options: Options) -> Result<Option<Self>, Error> {
        let (_, scene, robot) = place(&mut options)?;
        Ok(Self::believed(run, &robot, &scene))
    }

    fn believed(run: &Run, robot: &Robot, scene: &Scene) -> Option<Self> {
        let links = Self::found(run, robot, scene);
        (links.agree(run) == Some(true)).then_some(links)
    }

    /// Returns the links of a robot in a scene with what the run's regressions found.
    fn found(run: &Run, robot: &Robot, scene: &Scene) -> Self {
        match &run.calibration {
            None => Self { robot: robot.clone(), world_from_base: scene.world_from_base },
            Some(found) => {
                let world_from_base = found.world_from_base(scene);
                Self { robot: found.robot(robot), world_from_base }
            }
        }
    }

    /// Whether they have the tool where a run says that it was; `None` of a run that says it nowhere.
    fn agree(&self, run: &Run) -> Option<bool> {
        let mut states = run.start.iter().chain(run.steps.iter().map(|step| &step.measured));
        let is_known = states.clone().next().is_some();
        is_known.then(|| states.all(|state| self.is_at(state)))
    }

    fn is_at(&self, state: &WorldState) -> bool {
        let Ok(base_from_tool) = self.robot.forward_tool(&state.q) else { return false };
        let tool = (self.world_from_base * base_from_tool).origin();
        (tool - state.world_from_tool.origin()).norm() <= SAME
    }

    /// Returns their names, parents before their children.
    pub fn names(&self) -> Vec<&str> {
        self.robot.links().iter().map(|link| link.name.as_str()).collect()
    }

    /// Returns those on the way from the base to the tool, or to the tip of an arm without one, by their places.
    pub fn chain(&self) -> Vec<usize> {
        let links = self.robot.links();
        let last = self.robot.tool().unwrap_or(self.robot.tip());
        let mut chain: Vec<usize> =
            std::iter::successors(Some(last), |&link| links[link].parent).collect();
        chain.reverse();
        chain
    }

    /// Returns where they are in the world at joint positions `q`, rad, with the jaws `opening` m apart; `None` for
    /// positions of another arm.
    pub fn at(&self, q: &[f64], opening: f64) -> Option<Vec<Isometry3<f64>>> {
        let base_from_link = self.robot.link_poses(q, opening).ok()?;
        let world_from_base = self.world_from_base.isometry();
        Some(base_from_link.iter().map(|pose| world_from_base * pose).collect())
    }
}

/// Whether a robot in a scene is the run's: with what the run's regressions found it has the tool at the joint positions of the
/// steps where the steps say it was. `None` of a run that has no state to tell by.
pub fn agree(run: &Run, robot: &Robot, scene: &Scene) -> Option<bool> {
    Links::found(run, robot, scene).agree(run)
}
