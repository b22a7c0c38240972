//! Whether objects can stand where the settings put them: on the table, and none in another.

use super::settings::{LabSettings, Spot};
use super::{Error, Unsound};
use crate::world::{Object, Pose, Scene, Shape, frame};

/// Things that are this far in each other still stand beside each other, m. Chosen: what a place in centimetres is rounded by.
const TOUCHING: f64 = 0.001;
/// Points around what is round: the middle of a side between two of them is 0.2 mm inside a circle of 10 cm.
const AROUND: usize = 48;

impl LabSettings {
    /// Says which objects of a scene cannot stand where they are put.
    ///
    /// # Errors
    ///
    /// [`Error::Settings`] names the first object that is put off the table, or the first two of which one is in the other.
    pub fn check_places(&self, scene: &Scene) -> Result<(), Error> {
        let clutter = self.clutter.iter().enumerate().map(|(k, thing)| thing.object(k + 1));
        let clutter: Vec<Object> = clutter.collect();
        // What slides in a case goes where its case goes.
        let objects = scene.objects.iter().filter(|object| scene.drawer(&object.name).is_none());
        let mut put: Vec<(&Object, &Spot)> = Vec::new();
        for object in objects.chain(&clutter) {
            let Some(spot) = self.placement.fixed.get(&object.name) else { continue };
            if !scene.table.holds(spot.x_m, spot.y_m, 0.0) {
                let [low, _, high, _] = scene.table.corners();
                let (name, at) = (object.name.clone(), [spot.x_m, spot.y_m]);
                return Err(Unsound::OffTable { name, at, table: [low, high] }.into());
            }
            for (other, place) in &put {
                let by = overlap((object, spot), (other, place));
                if by > TOUCHING {
                    let names = [other.name.clone(), object.name.clone()];
                    return Err(Unsound::Overlap { names, by }.into());
                }
            }
            put.push((object, spot));
        }
        Ok(())
    }
}

/// Returns how far one of two things on the table is inside the other, m; 0 where neither is.
fn overlap(one: (&Object, &Spot), two: (&Object, &Spot)) -> f64 {
    deepest(one, two).max(deepest(two, one))
}

/// Returns how far inside one thing the point of another is that is deepest in it, m.
fn deepest((of, at): (&Object, &Spot), (inside, there): (&Object, &Spot)) -> f64 {
    let pose = |spot: &Spot| -> Pose<frame::World, frame::Object> {
        Pose::upright(spot.x_m, spot.y_m, 0.0, spot.yaw_rad)
    };
    let between = pose(there).isometry().inverse() * pose(at).isometry();
    let half = nalgebra::Vector3::new(0.0, 0.0, 0.5 * of.shape.height());
    let points = of.shape.outline(AROUND).into_iter().chain([half]);
    let depths = points.filter_map(|point| {
        let p = (between * nalgebra::Point3::from(point)).coords;
        (p.z <= inside.shape.height()).then(|| match &inside.shape {
            Shape::Lathe { profile } => profile.radius_at(p.z) - p.x.hypot(p.y),
            shape => shape.inset(p.x, p.y),
        })
    });
    depths.fold(0.0, f64::max)
}
