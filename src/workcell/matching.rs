//! How well the twin's parse graph matches the real one, by the paper's Eq. 1: the product of three probabilities, that of the
//! camera, of the scene and of the robot.
//!
//! The paper does not say how the three are worked out. Here each is the probability that what was adapted is within
//! [`ROOM`] of what is real, by what was measured: a normal error on the table with the standard deviation that the regression
//! or the picture itself states, so `1 - exp(-room² / 2σ²)` (Rayleigh). Of a thing that was seen the probability that it is the
//! thing comes on top. What nobody measured has no probability, and then the product has none.
//!
//! Source: Zeng, Zhao and Wu, Eq. 1.

use serde::{Deserialize, Serialize};

use crate::execution::calibration::Calibration;
use crate::world::WorldState;

/// How far the twin may be off for a task to go as rehearsed, m: what the fingers of a 2F-85 (85 mm) have to each side of the
/// paper's jar (65 mm). With half of it a pour that goes well has a low probability, with twice as much one that fails a high
/// one.
pub const ROOM: f64 = 0.010;

/// One factor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Factor {
    /// That it is within the room, 0 to 1.
    pub probability: f64,
    /// Standard deviation along one axis of the table, m.
    pub std_m: f64,
}

/// One thing of the scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Thing {
    /// Its name.
    pub name: String,
    /// That it is within the room of where it was seen, 0 to 1.
    pub probability: f64,
    /// That what was seen there is it, 0 to 1.
    pub is_it: f64,
    /// Standard deviation of its place along one axis of the table, m.
    pub std_m: f64,
}

/// The three factors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Matching {
    /// What counts as the same, m.
    pub room_m: f64,
    /// `P(pg_camera^s | pg_camera^r)`: by the dots on the table, under the camera in force.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<Factor>,
    /// `P(pg_scene^s | pg_scene^r)`: over the things that were seen, the product of theirs; `None` when none was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<f64>,
    /// What the scene's is made of.
    pub things: Vec<Thing>,
    /// `P(pg_robot^s | pg_robot^r)`: by the points that the arm visited before the camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robot: Option<Factor>,
    /// `P(pg^s | pg^r)`, their product; `None` where one of them is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probability: Option<f64>,
}

impl Factor {
    /// Returns the factor of a standard deviation along one axis, m; `None` of none.
    pub fn of(std_m: f64) -> Option<Self> {
        std_m.is_finite().then(|| Self { probability: within(ROOM, std_m), std_m })
    }
}

/// Returns the probability that an error on the table with this standard deviation along each axis is within `room`, m.
pub fn within(room: f64, std: f64) -> f64 {
    if std > 0.0 { 1.0 - (-0.5 * (room / std).powi(2)).exp() } else { 1.0 }
}

impl Matching {
    /// Returns the factors of a run that begins at `start`; `sure` is how probable it is that each thing is where it was seen,
    /// by name.
    pub fn of(
        calibration: Option<&Calibration>,
        start: &WorldState,
        sure: &[(String, f64)],
    ) -> Self {
        let left = calibration.map(|found| found.left).unwrap_or_default();
        let camera = left.camera_m.and_then(Factor::of);
        let robot = left.robot_m.and_then(Factor::of);
        let things: Vec<Thing> = start
            .objects
            .iter()
            .filter(|object| object.world_from_object.is_some() && object.std.is_finite())
            .filter_map(|object| {
                let (name, is_it) = sure.iter().find(|(name, _)| *name == object.name)?;
                Some(Thing {
                    name: name.clone(),
                    probability: is_it * within(ROOM, object.std),
                    is_it: *is_it,
                    std_m: object.std,
                })
            })
            .collect();
        let scene =
            (!things.is_empty()).then(|| things.iter().map(|thing| thing.probability).product());
        let probability = camera
            .zip(scene)
            .zip(robot)
            .map(|((camera, scene), robot)| camera.probability * scene * robot.probability);
        Self { room_m: ROOM, camera, scene, things, robot, probability }
    }
}
