//! The fingers and what hangs in them.

use nalgebra::Vector3;

use super::super::belief::LET_DOWN;
use super::super::beside::Order;
use super::super::error::ActionError;
use super::super::plan::{gravity_torque, mass_of};
use super::super::refusal::Refusal;
use super::ActionContext;
use crate::arm::{Feedback, Grip};
use crate::fluent::lowest_of;
use crate::world::{Object, Scene, WATER_DENSITY, support};

/// How fast the fingers go, m/s, and with how much force they open, N.
const FINGER_SPEED: f64 = 0.06;
const OPEN_FORCE: f64 = 60.0;
/// Fingers that have opened by so much hold nothing any more, m: pads give way by less.
const LET_GO: f64 = 0.002;
/// What a grip's progress is counted in, s: nobody knows beforehand how long it takes.
const GRIP: f64 = 1.0;

/// Returns the mass of all things of a scene with their vessels full, kg.
fn everything(scene: &Scene) -> f64 {
    let water = |object: &Object| object.cavity.map_or(0.0, |inside| inside.capacity);
    scene.objects.iter().map(|object| object.mass + WATER_DENSITY * water(object)).sum()
}

/// Returns from what on no mass was weighed, but torques that are wrong or in another unit, kg; `all` is what everything weighs. Chosen:
/// a scene is believed to be right to a factor of three, and a hand that presses a little to feel like 2 kg.
fn most_told(all: f64) -> f64 {
    (3.0 * all).max(2.0)
}

impl ActionContext {
    /// Opens the fingers, to so many m or as wide as they go, once `after` s have passed, beside whatever the arm does
    /// then.
    pub fn open_beside(&mut self, width: Option<f64>, after: f64) -> Result<(), ActionError> {
        let width = width.unwrap_or_else(|| self.setting.cell.robot.max_opening());
        let grip = self.setting.cell.clear_grip(width, FINGER_SPEED, OPEN_FORCE)?;
        Ok(self.body.arm().send_fingers(&grip, after)?)
    }

    /// `arm.open()`: fingers as wide as they go.
    pub fn open(&mut self) -> Result<(), ActionError> {
        self.move_fingers(None)
    }

    /// `arm.open_to(width)`: fingers to so many m between the pads, closed when that is less than they are open.
    pub fn open_to(&mut self, width: f64) -> Result<(), ActionError> {
        self.move_fingers(Some(width))
    }

    /// Moves the fingers to so many m between the pads, or as wide as they go; what they hold is let go when they open.
    ///
    /// # Errors
    ///
    /// [`Refusal::Falls`] when what they hold would fall, and nobody pulls at it.
    pub fn move_fingers(&mut self, width: Option<f64>) -> Result<(), ActionError> {
        self.may_let_go(width)?;
        if let Some(orders) = &mut self.step.orders {
            orders.push(Order::Open(width));
            return Ok(());
        }
        let to = width.unwrap_or_else(|| self.setting.cell.robot.max_opening());
        let before = self.body.arm().feedback()?;
        let held = self.body.state()?.held;
        let felt = self.run.rest.is_some();
        let grip = self.grip(to, OPEN_FORCE)?;
        let is_wider = width.is_none() || grip.opening > before.opening + LET_GO;
        let let_go = held.filter(|_| is_wider);
        if let Some(held) = &let_go {
            self.run.past.worked.released(held, before.time, felt);
        }
        if is_wider || self.body.state()?.held.is_none() {
            self.body.gripped(grip, None)?;
        }
        if let Some(o) = let_go.filter(|o| self.run.past.worked.handed(o) == Some(true))
            && !self.is_down(&o)?
        {
            self.body.given(&o);
        }
        Ok(())
    }

    /// Refuses to open the fingers on what would fall: it has to be put down, or taken by somebody, first. A drawer stays
    /// where it is.
    fn may_let_go(&mut self, width: Option<f64>) -> Result<(), ActionError> {
        let state = self.body.state()?;
        let scene = &self.setting.cell.scene;
        let is_wider = width.is_none_or(|width| width > state.opening + LET_GO);
        let held = state.held.as_deref().filter(|held| scene.drawer(held).is_none());
        let Some(held) = held.filter(|_| is_wider) else { return Ok(()) };
        let pose = state.object(held).and_then(|known| known.world_from_object);
        let Some((object, pose)) = scene.object(held).zip(pose) else { return Ok(()) };
        let below = support::below(scene, &state.objects, object, &pose);
        let drop = lowest_of(object, &pose) - below.height;
        if drop <= LET_DOWN {
            return Ok(());
        }
        let now = self.body.arm().feedback()?.time;
        if self.run.past.worked.is_pulled(now) {
            return Ok(());
        }
        let onto = below.name.unwrap_or_else(|| "table".to_owned());
        Err(Refusal::Falls { object: held.to_owned(), drop, onto }.into())
    }

    /// Whether a thing stands where the fingers let it go, on the table or on another; a drawer always does.
    fn is_down(&mut self, o: &str) -> Result<bool, ActionError> {
        let state = self.body.state()?;
        let scene = &self.setting.cell.scene;
        let pose = state.object(o).and_then(|known| known.world_from_object);
        let stands = scene.object(o).zip(pose).is_some_and(|(object, pose)| {
            let below = support::below(scene, &state.objects, object, &pose);
            pose.origin().z - below.height < LET_DOWN
        });
        Ok(stands || scene.drawer(o).is_some())
    }

    /// `arm.close(o, force)`: fingers closed on `o` with at most `force` N.
    pub fn close(&mut self, o: &str, force: f64) -> Result<(), ActionError> {
        // What the fingers may not do is said before the arm holds still for it.
        self.setting.cell.clear_grip(0.0, FINGER_SPEED, force)?;
        self.tare()?;
        let stood = self.body.state()?.object(o).and_then(|known| known.world_from_object);
        let grip = self.grip(0.0, force)?;
        self.run.past.worked.took(o);
        self.run.past.taken = stood.map(|pose| (o.to_owned(), pose.origin().xy().into()));
        self.body.gripped(grip, Some(o))?;
        Ok(())
    }

    /// `arm.wait(seconds)`.
    pub fn wait(&mut self, seconds: f64) -> Result<(), ActionError> {
        self.act(seconds, |arm, cancel, watch| arm.wait(seconds, cancel, watch))
    }

    /// `arm.opening()`: opening between the pads, m.
    pub fn opening(&mut self) -> Result<f64, ActionError> {
        Ok(self.body.arm().feedback()?.opening)
    }

    /// `arm.heft(seconds)`: the mass in the hand, kg, from joint torques at rest, averaged so long; nothing is
    /// concluded from it.
    ///
    /// # Errors
    ///
    /// [`Refusal::Heft`] of more than there can be: no water is told from it.
    pub fn heft(&mut self, seconds: f64) -> Result<f64, ActionError> {
        let mass = self.hangs(seconds)?;
        let all = everything(&self.setting.cell.scene);
        if let Some(object) = self.body.state()?.held
            && mass.abs() > most_told(all)
        {
            return Err(Refusal::Heft { object, mass, all }.into());
        }
        Ok(mass)
    }

    /// Returns the mass in the hand, kg, as the joints feel it over so many s, less than none when the hand presses.
    ///
    /// The tare taken before the fingers closed takes the sensors' bias out.
    fn hangs(&mut self, seconds: f64) -> Result<f64, ActionError> {
        let (q, mut excess) = self.torque_excess(seconds)?;
        if let Some(tare) = &self.run.tare {
            for (joint, bias) in excess.iter_mut().zip(tare) {
                *joint -= bias;
            }
        }
        let at = self.load_centre()?;
        let mass = mass_of(&self.setting.cell.robot, &q, &excess, &at);
        self.step.running.found(&format!("{:.1} g", 1e3 * mass));
        Ok(mass)
    }

    /// `arm.stands(o)`: whether `o`, which is believed to hang higher over what is below it than it was to be let down to,
    /// has slid in the hand and stands: then the arm, which was sent lower, presses on it, and the joints feel that.
    ///
    /// # Errors
    ///
    /// [`Refusal::NotHeld`] of what is not in the hand.
    pub fn stands(&mut self, o: &str) -> Result<bool, ActionError> {
        /// Where it was to be let down to, with room for what a calibrated arm is off, m.
        const DOWN: f64 = 0.004;
        /// So much less than nothing the hand bears when the arm presses, kg. Chosen: a newton; one weighing of half a second is
        /// off by 1.2 g (`docs/lab.md`).
        const PRESSES: f64 = -0.1;
        /// Averaged so long, s.
        const FEELS: f64 = 0.5;
        let state = self.body.state()?;
        let object = self.setting.cell.scene.object(o).filter(|_| state.held.as_deref() == Some(o));
        let object = object.ok_or_else(|| Refusal::NotHeld(o.to_owned()))?;
        let Some(pose) = state.object(o).and_then(|known| known.world_from_object) else {
            return Ok(false);
        };
        let below = support::below(&self.setting.cell.scene, &state.objects, object, &pose);
        let drop = pose.origin().z - below.height;
        if drop < DOWN || self.hangs(FEELS)? > PRESSES {
            return Ok(false);
        }
        self.body.stands(drop)?;
        Ok(true)
    }

    /// Where what is held hangs, in the frame of the tool, m: its middle, which is not where the fingers meet.
    fn load_centre(&mut self) -> Result<Vector3<f64>, ActionError> {
        let state = self.body.state()?;
        let held = state.held.as_deref().and_then(|name| {
            let height = self.setting.cell.scene.object(name)?.shape.height();
            Some((state.object(name)?.world_from_object?, height))
        });
        let centre = held.map(|(pose, height)| {
            let tool_from_object = state.world_from_tool.inverse() * pose;
            tool_from_object.origin() + tool_from_object.rotation() * (0.5 * height * Vector3::z())
        });
        Ok(centre.unwrap_or_default())
    }

    /// `arm.weighed(mass)`: the hand bears so much, kg: what it bears less than it did went into what is below.
    pub fn weighed(&mut self, mass: f64) {
        self.body.weighed(mass);
    }

    /// `arm.bears(mass)`: the hand bears so much, kg, and always did since it was weighed last: that is now known
    /// better.
    pub fn bears(&mut self, mass: f64) {
        self.body.bears(mass);
    }

    /// `arm.weigh()`: the mass in the hand, kg, held still for half a second, and what follows from it.
    pub fn weigh(&mut self) -> Result<f64, ActionError> {
        let mass = self.heft(0.5)?;
        self.weighed(mass);
        Ok(mass)
    }

    fn tare(&mut self) -> Result<(), ActionError> {
        self.run.tare = Some(self.torque_excess(0.5)?.1);
        Ok(())
    }

    /// Returns the mean joint positions and the mean torques beyond the model's, over `seconds` at rest.
    pub(super) fn torque_excess(
        &mut self,
        seconds: f64,
    ) -> Result<(Vec<f64>, Vec<f64>), ActionError> {
        let mut samples: Vec<Feedback> = Vec::new();
        // The arm swings out for a moment before the torques are worth reading.
        self.wait(0.3)?;
        self.act(seconds, |arm, cancel, watch| {
            arm.wait(seconds, cancel, &mut |feedback| {
                samples.push(feedback.clone());
                watch(feedback);
            })
        })?;
        let n = self.run.q.len();
        let mean = |pick: &dyn Fn(&Feedback) -> &Vec<f64>| -> Vec<f64> {
            let count = samples.len().max(1) as f64;
            (0..n)
                .map(|joint| samples.iter().map(|s| pick(s)[joint]).sum::<f64>() / count)
                .collect()
        };
        let (q, tau) = (mean(&|s| &s.q), mean(&|s| &s.tau));
        let model = gravity_torque(&self.setting.cell.robot, &q);
        Ok((q, tau.iter().zip(model).map(|(tau, g)| tau - g).collect()))
    }

    fn grip(&mut self, opening: f64, force: f64) -> Result<Grip, ActionError> {
        // What is in the hand afterwards is felt as well.
        self.run.rest = None;
        let grip = self.setting.cell.clear_grip(opening, FINGER_SPEED, force)?;
        self.act(GRIP, |arm, cancel, watch| arm.grip(&grip, cancel, watch))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{Shape, object, scene};

    /// 466.6 kg were weighed where torques came in mN·m, and 67 L of water put down for the cup.
    #[test]
    fn what_the_scene_cannot_weigh_is_not_weighed() {
        let vessel =
            |capacity| object::vessel(Shape::Cylinder { radius: 0.04, height: 0.15 }, capacity);
        let all = everything(&scene::bare(vec![vessel(5e-4), vessel(3e-4)]));
        assert!((all - 1.0).abs() < 1e-9, "{all}");
        // A jar of twice the mass that was declared is one.
        assert!((2.0..4.0).contains(&most_told(all)));
        assert!(466.6 > most_told(all) && most_told(0.02) > 1.0);
    }
}
