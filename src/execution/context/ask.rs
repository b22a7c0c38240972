//! Looking, planning and choosing: the words `camera` and `twin` of a script.

use rand::RngExt;

use super::super::beside::Order;
use super::super::decisions::{Entry, Kind};
use super::super::error::ActionError;
use super::super::plan::{Grasp, Placement, Planner, Pour, Push, Stir, Wipe};
use super::super::refusal::Refusal;
use super::ActionContext;
use crate::motion::dynamics::GRAVITY;
use crate::trace::NoWay;
use crate::world::{Region, WATER_DENSITY};

/// The force of each finger with which things are held, N, and how many times the weight pads should hold.
const SQUEEZE: f64 = 40.0;
const SAFETY: f64 = 2.0;

impl ActionContext {
    /// `camera.look()`.
    pub fn look(&mut self) -> Result<(), ActionError> {
        if let Some(orders) = &mut self.step.orders {
            orders.push(Order::Look);
            return Ok(());
        }
        Ok(self.body.look()?)
    }

    /// Finds ways in the twin and remembers them, or repeats on the arm those that the rehearsal had.
    fn ways<T: Clone>(
        &mut self,
        kind: Kind,
        of: impl FnOnce(&Entry) -> Option<Vec<T>>,
        entry: impl FnOnce(Vec<T>) -> Entry,
        find: impl FnOnce(&Planner) -> Result<Vec<T>, NoWay>,
    ) -> Result<Vec<T>, ActionError> {
        if let Some(ways) = self.run.log.next(kind, of)? {
            return Ok(ways);
        }
        let ways = find(&self.planner()?)?;
        self.run.log.record(entry(ways.clone()));
        Ok(ways)
    }

    /// `twin.grasps(o, face, pitch)`: ways to take `o` at a face with the tool pitched down by `pitch` rad,
    /// best first.
    pub fn grasps(&mut self, o: &str, face: &str, pitch: f64) -> Result<Vec<Grasp>, ActionError> {
        let pitch = match face {
            "side" => pitch,
            "top" => std::f64::consts::FRAC_PI_2,
            other => return Err(Refusal::NoFace(other.to_owned()).into()),
        };
        let of = |entry: &Entry| match entry {
            Entry::Grasps(ways) => Some(ways.clone()),
            _ => None,
        };
        self.ways(Kind::Grasps, of, Entry::Grasps, |planner| planner.grasps(o, pitch))
    }

    /// `twin.pours(o, at, clearance)`: ways to pour from `o` in the hand into `at`, best first.
    pub fn pours(&mut self, o: &str, at: &str, clearance: f64) -> Result<Vec<Pour>, ActionError> {
        let of = |entry: &Entry| match entry {
            Entry::Pours(ways) => Some(ways.clone()),
            _ => None,
        };
        self.ways(Kind::Pours, of, Entry::Pours, |planner| planner.pours(o, at, clearance))
    }

    /// `twin.placements(o, at)`: ways to put `o` down on a free place of the table, on or in another thing, or beside
    /// others, best first.
    pub fn placements(&mut self, o: &str, at: &Region) -> Result<Vec<Placement>, ActionError> {
        let of = |entry: &Entry| match entry {
            Entry::Placements(ways) => Some(ways.clone()),
            _ => None,
        };
        self.ways(Kind::Placements, of, Entry::Placements, |planner| planner.placements(o, at))
    }

    /// `twin.turned_placements(o)`: ways to put down `o`, held from above, on a free place of the table, turned so that a level hand can take
    /// it there, best first.
    pub fn turned_placements(&mut self, o: &str) -> Result<Vec<Placement>, ActionError> {
        let of = |entry: &Entry| match entry {
            Entry::Placements(ways) => Some(ways.clone()),
            _ => None,
        };
        self.ways(Kind::Placements, of, Entry::Placements, |planner| planner.turned_placements(o))
    }

    /// `twin.pushes(o, at)`: ways to push `o` along what it stands on to a free place, best first.
    pub fn pushes(&mut self, o: &str, at: &Region) -> Result<Vec<Push>, ActionError> {
        let of = |entry: &Entry| match entry {
            Entry::Pushes(ways) => Some(ways.clone()),
            _ => None,
        };
        self.ways(Kind::Pushes, of, Entry::Pushes, |planner| planner.pushes(o, at))
    }

    /// `twin.stirs(tool, vessel)`: ways to stir with what is in the hand, best first.
    pub fn stirs(&mut self, tool: &str, vessel: &str) -> Result<Vec<Stir>, ActionError> {
        let of = |entry: &Entry| match entry {
            Entry::Stirs(ways) => Some(ways.clone()),
            _ => None,
        };
        self.ways(Kind::Stirs, of, Entry::Stirs, |planner| planner.stirs(tool, vessel))
    }

    /// `twin.wipes(o)`: ways to wipe the top of `o` with closed fingers.
    pub fn wipes(&mut self, o: &str) -> Result<Vec<Wipe>, ActionError> {
        let of = |entry: &Entry| match entry {
            Entry::Wipes(ways) => Some(ways.clone()),
            _ => None,
        };
        self.ways(Kind::Wipes, of, Entry::Wipes, |planner| planner.wipes(o))
    }

    /// `twin.squeeze(o)`: the force of each finger that holds `o` with what is in it, N: the usual one, or as much
    /// more as pads with less friction need.
    pub fn squeeze(&mut self, o: &str) -> Result<f64, ActionError> {
        let object = self.setting.cell.scene.object(o);
        let object = object.ok_or_else(|| Refusal::NoObject(o.to_owned()))?;
        let mass = object.mass + WATER_DENSITY * self.volume(o).unwrap_or(0.0);
        let friction = self.setting.cell.pads.friction;
        let needed = SAFETY * mass * GRAVITY / (2.0 * friction.max(1e-6));
        let most = self.setting.cell.limits.finger_force;
        if needed > most {
            return Err(
                Refusal::TooHeavy { object: o.to_owned(), mass, friction, needed, most }.into()
            );
        }
        Ok(needed.max(SQUEEZE.min(most)))
    }

    /// `twin.enough(o, volume)`: whether `o` has gained so much, m³, since the run began in the twin; on the
    /// arm, which cannot weigh while it pours, what the twin said at this point of the rehearsal.
    pub fn enough(&mut self, o: &str, volume: f64) -> Result<bool, ActionError> {
        self.foreseen(|context| Ok(context.volume(o)? >= volume))
    }

    /// `twin.drips(o)`: whether water still clings to the lip of `o` in the twin; on the arm, which cannot
    /// see it, what the twin said at this point of the rehearsal.
    pub fn drips(&mut self, o: &str) -> Result<bool, ActionError> {
        self.foreseen(|context| Ok(context.body.drips(o)))
    }

    /// Answers a question in the twin and remembers the answer, or repeats it on the arm.
    fn foreseen(
        &mut self,
        ask: impl FnOnce(&mut Self) -> Result<bool, ActionError>,
    ) -> Result<bool, ActionError> {
        let logged = self.run.log.next(Kind::Answer, |entry| match entry {
            Entry::Choice(chosen) => Some(*chosen == 1),
            _ => None,
        })?;
        if let Some(answer) = logged {
            return Ok(answer);
        }
        let answer = ask(self)?;
        self.run.log.record(Entry::Choice(usize::from(answer)));
        Ok(answer)
    }

    /// `choose(ways)`: the best one in the first candidate, a good one in the others.
    pub fn choose(&mut self, n: usize) -> Result<usize, ActionError> {
        let logged = self.run.log.next(Kind::Choice, |entry| match entry {
            Entry::Choice(chosen) => Some(*chosen),
            _ => None,
        })?;
        if let Some(chosen) = logged {
            return Ok(chosen);
        }
        if n == 0 {
            return Err(Refusal::NoWays.into());
        }
        let mut chosen = 0;
        // Ways come best first, so later ones are taken ever more rarely.
        while self.run.variant > 0 && chosen + 1 < n && self.run.chance.random_bool(0.5) {
            chosen += 1;
        }
        self.run.log.record(Entry::Choice(chosen));
        Ok(chosen)
    }

    /// `twin.pose_named(name)`: joint positions of a named pose of the robot, rad.
    pub fn named_pose(&self, name: &str) -> Result<Vec<f64>, ActionError> {
        let pose = self.setting.cell.robot.pose(name);
        pose.map(<[f64]>::to_vec).map_err(|error| Refusal::from(error).into())
    }

    /// `twin.position(o)`: where `o` stands, m in the world.
    pub fn position(&mut self, o: &str) -> Result<[f64; 3], ActionError> {
        let state = self.state()?;
        let pose = state.object(o).and_then(|object| object.world_from_object);
        let pose = pose.ok_or_else(|| Refusal::UnknownPlace(o.to_owned()))?;
        Ok(pose.origin().into())
    }

    /// `twin.handings(o)`: joint positions that hold `o` out where it is handed over, nearest first.
    pub fn handings(&mut self, o: &str) -> Result<Vec<Vec<f64>>, ActionError> {
        self.planned_path(|planner| planner.handings(o))
    }

    /// `twin.drawn(o)`: how far a drawer is drawn, m.
    pub fn drawn(&mut self, o: &str) -> Result<f64, ActionError> {
        let state = self.state()?;
        let scene = self.setting.cell.scene.clone();
        let drawer = scene.drawer(o).ok_or_else(|| Refusal::NoDrawer(o.to_owned()))?;
        let drawn = drawer.drawn_in(&scene, &state);
        drawn.ok_or_else(|| Refusal::UnknownPlace(o.to_owned()).into())
    }

    /// `twin.travel(o)`: how far a drawer can be drawn, m.
    pub fn travel(&self, o: &str) -> Result<f64, ActionError> {
        let drawer = self.setting.cell.scene.drawer(o);
        Ok(drawer.ok_or_else(|| Refusal::NoDrawer(o.to_owned()))?.travel)
    }

    /// `twin.volume(o)`: water in `o`, m³.
    pub fn volume(&mut self, o: &str) -> Result<f64, ActionError> {
        let state = self.state()?;
        let water = state.object(o).and_then(|object| object.water);
        water.ok_or_else(|| Refusal::UnknownVolume(o.to_owned()).into())
    }
}
