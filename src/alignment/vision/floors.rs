//! What is seen where it cannot stand, low inside of a tray or high beside it, is looked for again as high as what is below it.
//!
//! A small thing looks alike on a tray and on the table behind it. Which it is follows from where that would be: in the
//! middle of the tray nothing stands on the table.

use super::together::SAME_FLOOR;
use super::{Believed, Look, Options, Sighting};
use crate::world::{Object, ObjectState, Pose, Scene, support};

/// Higher than anything that stands on a table, m: what is below is looked for from there.
const FAR_ABOVE: f64 = 3.0;

impl Look<'_> {
    /// Finds the scene's objects as [`Look::see`] does, each as high as what is below it where it is seen; `options` then says
    /// how high. `known` is where things were believed to be before, for those that this picture does not show: what the picture
    /// hides, or supports at that very place, is kept there ([`Sighting::kept`]).
    ///
    /// Another look is taken where something is seen at a height at which it cannot stand there; none otherwise. Of a look that was
    /// stopped ([`Look::is_stopped`]) nothing is told.
    pub fn see_standing(&self, options: &mut Options, known: &[ObjectState]) -> Vec<Sighting> {
        let scene = self.scene;
        let seen = self.see(options);
        let states: Vec<ObjectState> = seen.iter().map(|sighting| state(sighting, known)).collect();
        let mut is_changed = false;
        for sighting in seen.iter().filter(|sighting| sighting.found) {
            let Some(object) = scene.object(&sighting.name) else { continue };
            let Some(height) = floor(scene, &states, object, sighting) else { continue };
            let taken = options.raised.get(&sighting.name).copied().unwrap_or(0.0);
            if (height - taken).abs() > SAME_FLOOR {
                options.raised.insert(sighting.name.clone(), height);
                is_changed = true;
            }
        }
        let mut seen = if is_changed { self.see(options) } else { seen };
        let objects: Vec<ObjectState> =
            seen.iter().map(|sighting| state(sighting, known)).collect();
        let believed = Believed { look: self, objects: &objects, arm: options.ignore.as_ref() };
        believed.keep(&mut seen);
        seen
    }
}

/// Returns how high what is below the place of a sighting bears a thing, m. What stands higher than where it was seen stands on
/// it, if anything, and bears it nowhere; nor does what is inside of it.
fn floor(
    scene: &Scene,
    states: &[ObjectState],
    object: &Object,
    sighting: &Sighting,
) -> Option<f64> {
    let pose = sighting.world_from_object?;
    let at = pose.origin();
    let may_bear = |state: &&ObjectState| {
        let (Some(other), Some(there)) = (scene.object(&state.name), state.world_from_object)
        else {
            return false;
        };
        let base = there.origin();
        base.z <= at.z + SAME_FLOOR && !support::holds(object, &pose, other, base)
    };
    let lower: Vec<ObjectState> = states.iter().filter(may_bear).cloned().collect();
    let above = Pose::upright(at.x, at.y, FAR_ABOVE, 0.0);
    Some(support::below(scene, &lower, object, &above).height)
}

/// What is known of a thing: by the sighting if it was found, else as before.
fn state(sighting: &Sighting, known: &[ObjectState]) -> ObjectState {
    let before = || known.iter().find(|o| o.name == sighting.name)?.world_from_object;
    let seen = sighting.world_from_object.filter(|_| sighting.found);
    ObjectState {
        name: sighting.name.clone(),
        world_from_object: seen.or_else(before),
        std: sighting.std,
        water: None,
    }
}
