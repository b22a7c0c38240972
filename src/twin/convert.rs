//! Our vectors and poses ↔ the physics engine's, and nothing else: the only file that names both.
//!
//! The engine's mathematics is `glam` in f64; ours is `nalgebra`. Both are SI, so a conversion changes
//! the type and no bit of the value.

use nalgebra::{Isometry3, Vector3};
use rapier3d_f64::dynamics::MassProperties;
use rapier3d_f64::math::{Matrix as EngineMatrix, Pose as EnginePose, Vector as EngineVector};

use crate::motion::Inertial;

/// Returns the engine's vector.
pub fn to_engine(v: &Vector3<f64>) -> EngineVector {
    (*v).into()
}

/// Returns our vector.
pub fn from_engine(v: EngineVector) -> Vector3<f64> {
    v.into()
}

/// Returns the engine's pose.
pub fn pose_to_engine(pose: &Isometry3<f64>) -> EnginePose {
    (*pose).into()
}

/// Returns our isometry.
pub fn pose_from_engine(pose: &EnginePose) -> Isometry3<f64> {
    (*pose).into()
}

/// Returns the engine's mass properties of a rigid body.
pub fn inertia_to_engine(inertial: &Inertial) -> MassProperties {
    let matrix: EngineMatrix = inertial.inertia.into();
    MassProperties::with_inertia_matrix(to_engine(&inertial.com), inertial.mass, matrix)
}
