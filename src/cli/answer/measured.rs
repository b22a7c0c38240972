//! What `trueup scene from` prints.

use std::path::Path;

use serde::Serialize;

use crate::alignment::measure::{Measured, Unmeasured};
use crate::alignment::vision::Sighting;
use crate::world::Shape;

/// The answer of `scene from`.
#[derive(Debug, Clone, Serialize)]
pub struct Answer {
    /// The scene file that was written.
    pub file: String,
    /// Things of the scene that were seen and stay as declared.
    pub declared: Vec<String>,
    /// What was measured.
    pub measured: Vec<Thing>,
    /// What is on the table and could not be measured.
    pub not_measured: Vec<Missed>,
}

/// A thing that was measured.
#[derive(Debug, Clone, Serialize)]
pub struct Thing {
    /// Its name in the scene.
    pub name: String,
    /// Its form and sizes, m.
    pub shape: Shape,
    /// Where its middle stands on the table, m.
    pub xy_m: [f64; 2],
    /// Its turn about z, rad.
    pub yaw_rad: f64,
    /// Standard deviation of its place, m.
    pub std_m: f64,
    /// Standard deviations of its sizes, m: of a cuboid along x, y and z, of a cylinder of its radius (twice) and height.
    pub size_std_m: [f64; 3],
    /// Root mean square distance between its outline and the solid's, px.
    pub rms_px: f64,
    /// Its colour, sRGB.
    pub colour: [u8; 3],
}

/// What could not be measured.
#[derive(Debug, Clone, Serialize)]
pub struct Missed {
    /// Where on the table it may be, m.
    pub xy_m: [f64; 2],
    /// Why.
    pub reason: String,
}

impl Answer {
    /// Words what was found as the answer.
    pub fn new(
        file: &Path,
        seen: &[Sighting],
        things: &[(&str, &Measured)],
        missed: &[([f64; 2], Unmeasured)],
    ) -> Self {
        let measured = things.iter().map(|(name, thing)| {
            let pose = &thing.world_from_object;
            Thing {
                name: (*name).to_owned(),
                shape: thing.shape.clone(),
                xy_m: pose.origin().xy().into(),
                yaw_rad: pose.rotation().euler_angles().2,
                std_m: thing.std,
                size_std_m: thing.size_std,
                rms_px: thing.rms_px,
                colour: thing.colour,
            }
        });
        let not_measured =
            missed.iter().map(|(at, why)| Missed { xy_m: *at, reason: why.to_string() });
        Self {
            file: file.display().to_string(),
            declared: seen.iter().map(|sighting| sighting.name.clone()).collect(),
            measured: measured.collect(),
            not_measured: not_measured.collect(),
        }
    }
}
