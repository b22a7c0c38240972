//! What a free motion moved that is not in the hand: nothing, unless the arm brushed past it.
//!
//! In the twin it is known what moved; a rehearsal is judged by it. Of an arm it is known after a look.

use crate::world::{Scene, WorldState, support};

use super::super::error::ActionError;
use super::ActionContext;

/// What is less far from where it was than this was not moved, m: twice as far as the twin takes surfaces to touch (0.5 mm, `TOUCH`
/// in `twin::physics`), for what is pressed apart from two sides. What nothing touched moved by at most 0.02 mm in a run.
const MOVED: f64 = 1e-3;

/// Something that a free motion moved.
#[derive(Debug, Clone, PartialEq)]
pub struct Brushed {
    /// What.
    pub object: String,
    /// How far it is from where it was, m.
    pub by: f64,
}

impl ActionContext {
    /// `arm.move_to(q)`, `arm.carry_to(q, tilt, speed)`: a free motion round everything in the way, with the
    /// hand within `tilt` rad of upright when that is asked for.
    pub fn move_to(&mut self, q: &[f64], tilt: Option<f64>, speed: f64) -> Result<(), ActionError> {
        let before = self.state()?;
        self.go_to(q, tilt, speed)?;
        let after = self.state()?;
        let found = brushed(&self.setting.cell.scene, &before, &after);
        let known = self.run.brushed.as_ref().map_or(0.0, |known| known.by);
        if let Some(found) = found.filter(|found| found.by > known) {
            self.run.brushed = Some(found);
        }
        Ok(())
    }

    /// Returns what free motions moved farthest since this was asked last, if they moved anything.
    pub fn take_brushed(&mut self) -> Option<Brushed> {
        self.run.brushed.take()
    }
}

/// Returns what is farthest from where it was before a free motion, but for what was in the hand and what that bore.
fn brushed(scene: &Scene, before: &WorldState, after: &WorldState) -> Option<Brushed> {
    let moved = scene.objects.iter().filter_map(|object| {
        let at = |state: &WorldState| Some(state.object(&object.name)?.world_from_object?.origin());
        let by = (at(after)? - at(before)?).norm();
        let is_carried = || {
            let pile = support::pile(scene, &before.objects, &object.name);
            before.held.as_ref().is_some_and(|held| pile.contains(held))
        };
        (by > MOVED && !is_carried()).then(|| Brushed { object: object.name.clone(), by })
    });
    moved.max_by(|a, b| a.by.total_cmp(&b.by))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::object::vessel;
    use crate::world::{Object, ObjectState, Pose, Shape};

    #[test]
    fn what_the_arm_brushed_is_told_and_what_it_carried_is_not() {
        let side = |side: f64| Shape::Cuboid { size: nalgebra::Vector3::repeat(side) };
        let named =
            |name: &str, shape| Object { name: name.into(), cavity: None, ..vessel(shape, 1e-3) };
        let things = [("tray", 0.1), ("on_it", 0.04), ("can", 0.06), ("tin", 0.06)];
        let scene =
            crate::world::scene::bare(things.map(|(name, size)| named(name, side(size))).to_vec());
        let state = |places: [[f64; 3]; 4]| WorldState {
            time: 0.0,
            q: Vec::new(),
            opening: 0.04,
            world_from_tool: Pose::identity(),
            held: Some("tray".into()),
            spilt: None,
            unknown: Vec::new(),
            objects: things
                .iter()
                .zip(places)
                .map(|((name, _), [x, y, z])| ObjectState {
                    name: (*name).into(),
                    world_from_object: Some(Pose::upright(x, y, z, 0.0)),
                    std: 0.0,
                    water: None,
                })
                .collect(),
        };
        let before = state([[0.4, 0.0, 0.2], [0.4, 0.0, 0.3], [0.5, 0.3, 0.0], [0.6, 0.2, 0.0]]);
        let after = [[0.4, 0.3, 0.2], [0.4, 0.3, 0.3], [0.5, 0.3003, 0.0], [0.6, 0.2, 0.0]];
        assert_eq!(brushed(&scene, &before, &state(after)), None);
        let after = [[0.4, 0.3, 0.2], [0.4, 0.3, 0.3], [0.5, 0.304, 0.0], [0.602, 0.2, 0.0]];
        let found = brushed(&scene, &before, &state(after)).unwrap();
        assert!(found.object == "can" && (found.by - 0.004).abs() < 1e-9, "{found:?}");
    }
}
