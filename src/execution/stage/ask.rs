//! Looking, planning and choosing: the words `camera` and `twin` of a script.

use rand::RngExt;

use super::super::beside::Order;
use super::super::plan::{Grasp, Placement, Pour};
use super::super::tape::Entry;
use super::{ActionError, Stage};
use crate::motion::dynamics::GRAVITY;
use crate::world::WATER_DENSITY;

/// The force of each finger with which things are held, N, and how many times the weight pads should hold.
const SQUEEZE: f64 = 40.0;
const SAFETY: f64 = 2.0;

impl Stage {
    /// `camera.look()`.
    pub fn look(&mut self) -> Result<(), ActionError> {
        if let Some(orders) = &mut self.orders {
            orders.push(Order::Look);
            return Ok(());
        }
        Ok(self.body.look()?)
    }

    /// `twin.grasps(o, face, pitch)`: ways to take `o` at a face with the tool pitched down by `pitch` rad,
    /// best first.
    pub fn grasps(&mut self, o: &str, face: &str, pitch: f64) -> Result<Vec<Grasp>, ActionError> {
        let taped = self.tape.next("ways to grasp", |entry| match entry {
            Entry::Grasps(ways) => Some(ways.clone()),
            _ => None,
        })?;
        if let Some(ways) = taped {
            return Ok(ways);
        }
        let pitch = match face {
            "side" => pitch,
            "top" => std::f64::consts::FRAC_PI_2,
            other => {
                let words = format!("there is no face `{other}`; faces are side and top");
                return Err(ActionError::Refused(words));
            }
        };
        let ways = self.planner()?.grasps(o, pitch)?;
        self.tape.record(Entry::Grasps(ways.clone()));
        Ok(ways)
    }

    /// `twin.pours(o, at, clearance)`: ways to pour from `o` in the hand into `at`, best first.
    pub fn pours(&mut self, o: &str, at: &str, clearance: f64) -> Result<Vec<Pour>, ActionError> {
        let taped = self.tape.next("ways to pour", |entry| match entry {
            Entry::Pours(ways) => Some(ways.clone()),
            _ => None,
        })?;
        if let Some(ways) = taped {
            return Ok(ways);
        }
        let ways = self.planner()?.pours(o, at, clearance)?;
        self.tape.record(Entry::Pours(ways.clone()));
        Ok(ways)
    }

    /// `twin.placements(o)`: ways to put `o` down on a free place of the table, best first.
    pub fn placements(&mut self, o: &str) -> Result<Vec<Placement>, ActionError> {
        let taped = self.tape.next("ways to put down", |entry| match entry {
            Entry::Placements(ways) => Some(ways.clone()),
            _ => None,
        })?;
        if let Some(ways) = taped {
            return Ok(ways);
        }
        let ways = self.planner()?.placements(o)?;
        self.tape.record(Entry::Placements(ways.clone()));
        Ok(ways)
    }

    /// `twin.squeeze(o)`: the force of each finger that holds `o` with what is in it, N: the usual one, or as much
    /// more as pads with less friction need.
    pub fn squeeze(&mut self, o: &str) -> Result<f64, ActionError> {
        let object = self.cell.scene.object(o);
        let object = object.ok_or_else(|| ActionError::Refused(format!("there is no `{o}`")))?;
        let mass = object.mass + WATER_DENSITY * self.volume(o).unwrap_or(0.0);
        let friction = self.cell.pads.friction;
        let needed = SAFETY * mass * GRAVITY / (2.0 * friction.max(1e-6));
        let most = self.cell.limits.finger_force;
        if needed > most {
            return Err(ActionError::Refused(format!(
                "pads with a friction of {friction:.3} would have to press the {mass:.2} kg of `{o}` with \
                 {needed:.0} N; the fingers may press with {most:.0} N"
            )));
        }
        Ok(needed.max(SQUEEZE.min(most)))
    }

    /// `twin.enough(o, volume)`: whether `o` has gained so much, m³, since the run began in the twin; on the
    /// arm, which cannot weigh while it pours, what the twin said at this point of the rehearsal.
    pub fn enough(&mut self, o: &str, volume: f64) -> Result<bool, ActionError> {
        self.foreseen(|stage| Ok(stage.volume(o)? >= volume))
    }

    /// `twin.drips(o)`: whether water still clings to the lip of `o` in the twin; on the arm, which cannot
    /// see it, what the twin said at this point of the rehearsal.
    pub fn drips(&mut self, o: &str) -> Result<bool, ActionError> {
        self.foreseen(|stage| Ok(stage.body.drips(o)))
    }

    /// Answers a question in the twin and remembers the answer, or repeats it on the arm.
    fn foreseen(
        &mut self,
        ask: impl FnOnce(&mut Self) -> Result<bool, ActionError>,
    ) -> Result<bool, ActionError> {
        let taped = self.tape.next("a yes or no", |entry| match entry {
            Entry::Choice(chosen) => Some(*chosen == 1),
            _ => None,
        })?;
        if let Some(answer) = taped {
            return Ok(answer);
        }
        let answer = ask(self)?;
        self.tape.record(Entry::Choice(usize::from(answer)));
        Ok(answer)
    }

    /// `choose(ways)`: the best one in the first candidate, a good one in the others.
    pub fn choose(&mut self, n: usize) -> Result<usize, ActionError> {
        let taped = self.tape.next("a choice", |entry| match entry {
            Entry::Choice(chosen) => Some(*chosen),
            _ => None,
        })?;
        if let Some(chosen) = taped {
            return Ok(chosen);
        }
        if n == 0 {
            return Err(ActionError::Refused("there is nothing to choose from".into()));
        }
        let mut chosen = 0;
        // Ways come best first, so later ones are taken ever more rarely.
        while self.variant > 0 && chosen + 1 < n && self.chance.random_bool(0.5) {
            chosen += 1;
        }
        self.tape.record(Entry::Choice(chosen));
        Ok(chosen)
    }

    /// `twin.pose_named(name)`: joint positions of a named pose of the robot, rad.
    pub fn named_pose(&self, name: &str) -> Result<Vec<f64>, ActionError> {
        let pose = self.cell.robot.pose(name);
        pose.map(<[f64]>::to_vec).map_err(|error| ActionError::Refused(error.to_string()))
    }

    /// `twin.position(o)`: where `o` stands, m in the world.
    pub fn position(&mut self, o: &str) -> Result<[f64; 3], ActionError> {
        let state = self.state()?;
        let pose = state.object(o).and_then(|object| object.world_from_object);
        let pose =
            pose.ok_or_else(|| ActionError::Refused(format!("nobody knows where `{o}` is")))?;
        Ok(pose.origin().into())
    }

    /// `twin.volume(o)`: water in `o`, m³.
    pub fn volume(&mut self, o: &str) -> Result<f64, ActionError> {
        let state = self.state()?;
        let water = state.object(o).and_then(|object| object.water);
        water.ok_or_else(|| ActionError::Refused(format!("nobody knows how much is in `{o}`")))
    }
}
