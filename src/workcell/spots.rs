//! Where things stand, how big they are and what they hold, for sentences that tell things by that.

use nalgebra::Point3;

use super::{Error, WorkCell};
use crate::language::sentence::Spot;
use crate::world::support;

impl WorkCell {
    /// Returns where each thing that was seen stands; looks at the table first if nobody has yet.
    ///
    /// # Errors
    ///
    /// As [`Self::perceive`].
    pub fn spots(&mut self) -> Result<Vec<(String, Spot)>, Error> {
        if !self.experience.has_looked {
            self.perceive()?;
        }
        let state = self.state()?;
        let scene = self.scene();
        let spots = scene.objects.iter().filter_map(|object| {
            let known = state.object(&object.name)?;
            let pose = known.world_from_object?;
            let middle = pose.isometry() * Point3::new(0.0, 0.0, 0.5 * object.shape.height());
            let seen = scene.world_from_base.isometry().inverse_transform_point(&middle);
            let spot = Spot {
                left: seen.y,
                ahead: seen.x,
                at: [middle.x, middle.y],
                facing: scene.world_from_base.yaw(),
                radius: object.shape.outer_radius(),
                height: object.shape.height(),
                volume: object.shape.volume(),
                on: support::below(scene, &state.objects, object, &pose).name,
                water: known.water,
            };
            Some((object.name.clone(), spot))
        });
        Ok(spots.collect())
    }
}
