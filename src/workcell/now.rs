//! The twin of a cell as it is known now: another cell, whose reality is what this one believes.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::execution::belief::Belief;
use crate::lab::{LabSettings, Spot, Start};
use crate::world::{Scene, WorldState};

use super::roles::Setup;
use super::{Error, Parts, WorkCell, devices, wording};

impl WorkCell {
    /// Opens a twin that begins where this cell is believed to be: things where they were seen, as much water
    /// in them as is known, the arm where it stands. Returns it with what could not be begun like that.
    ///
    /// # Errors
    ///
    /// When the arm does not answer, or the twin cannot be built.
    pub fn twin(&mut self) -> Result<(Self, Vec<String>), Error> {
        let state = self.state()?;
        let q = self.scripts.context().planned_q()?.to_vec();
        let (settings, unlike) = settings(&state, &q);
        let scene = Arc::new(filled(&self.model.cell.scene, &state));
        let devices =
            devices::simulated(&self.model.cell.robot, &scene, settings, self.setup.seed)?;
        let setup = Setup { robot_name: "twin".into(), ..self.setup.clone() };
        let parts = Parts {
            setup,
            scene: scene.clone(),
            robot: self.model.cell.robot.clone(),
            known: self.model.known.clone(),
            pace: 1.0,
            means: self.model.cell.means,
            belief: Belief::knowing(scene, &state),
            // Whoever wants to stop one wants to stop the other.
            cancel: self.controls.cancel.clone(),
        };
        let mut twin = Self::with(parts, devices);
        twin.experience.learnt = self.experience.learnt.clone();
        Ok((twin, unlike))
    }

    /// Returns the names of the objects whose places are known.
    pub fn known_objects(&mut self) -> Vec<String> {
        let Ok(state) = self.state() else { return Vec::new() };
        let known = state.objects.into_iter().filter(|o| o.world_from_object.is_some());
        known.map(|object| object.name).collect()
    }
}

/// A laboratory as assumed, with things where they are known to be; and what cannot be like that.
fn settings(state: &WorldState, q: &[f64]) -> (LabSettings, Vec<String>) {
    let mut settings = LabSettings::perfect();
    let (mut unlike, mut unknown) = (Vec::new(), BTreeSet::new());
    for object in &state.objects {
        let Some(pose) = object.world_from_object else {
            unknown.insert(object.name.as_str());
            continue;
        };
        let at = pose.origin();
        let spot = Spot { x_m: at.x, y_m: at.y, yaw_rad: pose.yaw() };
        settings.placement.fixed.insert(object.name.clone(), spot);
    }
    // Before the first look nobody knows of anything, and nothing needs to be said.
    if unknown.len() < state.objects.len() {
        for name in unknown {
            unlike.push(wording::stands_anywhere(name));
        }
    }
    match &state.held {
        Some(held) => {
            unlike.push(wording::stands_below(held));
        }
        None if !q.is_empty() => {
            settings.start = Start { q_rad: q.to_vec(), opening_m: Some(state.opening) };
        }
        None => {}
    }
    (settings, unlike)
}

/// Returns the scene with as much water in its vessels as is known to be.
fn filled(scene: &Scene, state: &WorldState) -> Scene {
    let mut scene = scene.clone();
    for object in &mut scene.objects {
        let known = state.object(&object.name).and_then(|known| known.water);
        if let (Some(cavity), Some(water)) = (&mut object.cavity, known) {
            cavity.filled = water;
        }
    }
    scene
}
