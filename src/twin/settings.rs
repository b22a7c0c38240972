//! Everything physical about the twin that is a number.
//!
//! The lab is the same engine with other numbers, so whatever reality may do differently is a field
//! here or part of the [`Robot`] and the [`crate::world::Scene`] the twin is built from.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::fluid::{FluidSettings, Rim};
use crate::motion::Robot;

/// How the arm's joints are driven and what resists them; one entry per joint, base first.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmSettings {
    /// Stiffness of the position servo, N·m/rad.
    pub kp: Vec<f64>,
    /// Damping of the position servo, N·m·s/rad.
    pub kd: Vec<f64>,
    /// Reflected inertia of the rotors, kg·m².
    pub armature: Vec<f64>,
    /// Coulomb friction, N·m.
    pub coulomb: Vec<f64>,
    /// Viscous friction, N·m·s/rad.
    pub viscous: Vec<f64>,
    /// Compliance of the gears, rad/(N·m): the link gives way by this much per torque while the
    /// encoder, on the motor's side, does not see it.
    pub compliance: Vec<f64>,
    /// The share of the links' weight the servo does not compensate: 0 is ideal, 1 is no compensation.
    pub uncompensated: f64,
}

/// How the jaws are driven.
#[derive(Debug, Clone, PartialEq)]
pub struct GripperSettings {
    /// Stiffness of the jaw servo, N/m.
    pub kp: f64,
    /// Damping of the jaw servo, N·s/m.
    pub kd: f64,
    /// Reflected inertia of the drive at each jaw, kg.
    pub armature: f64,
    /// Force of each jaw until [`super::Twin::grip`] says otherwise, N.
    pub force: f64,
}

/// Coulomb friction coefficients of pairs of surfaces.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionSettings {
    /// Finger pad on object.
    pub pad_object: f64,
    /// Table on object.
    pub table_object: f64,
    /// Object on object; also arm on object.
    pub object_object: f64,
    /// How fast a held object creeps along the pads the way its weight pulls, m/s.
    pub pad_creep: f64,
    /// What resists a drawer, N, however fast it is drawn.
    pub drawer: f64,
}

/// Every number of the physics.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Time step of the rigid bodies, s.
    pub dt: f64,
    /// Parts of a step, in each of which the engine works out mass matrix and constraints anew.
    pub solver_iterations: usize,
    /// How often contacts and motors are gone through, one after the other, in each part.
    pub sweeps: usize,
    /// Gravity in the world, m/s².
    pub gravity: Vector3<f64>,
    /// The arm's joints.
    pub arm: ArmSettings,
    /// The jaws.
    pub gripper: GripperSettings,
    /// Friction between surfaces.
    pub friction: FrictionSettings,
    /// The water.
    pub fluid: FluidSettings,
    /// Vessels whose rim lets go of water in a way of its own, by name.
    pub rims: BTreeMap<String, Rim>,
    /// Seed of all chance: the jitter of the water's particles.
    pub seed: u64,
}

impl Settings {
    /// Returns the settings of an ideal servo on this arm: gravity compensated, no friction, no
    /// compliance.
    ///
    /// Gains, armature and contact settings are those measured to track within 1 mrad RMS and to hold
    /// a thin-walled jar with less than 0.1 mm of slip at this time step.
    pub fn for_arm(robot: &Robot) -> Self {
        let n = robot.n_joints();
        // The Gen3's large actuators have 39 N·m, the small ones 9 N·m.
        let scaled = |gain: f64| {
            let scale = |effort: f64| if effort > 20.0 { 1.0 } else { 0.25 };
            robot.joints().iter().map(|joint| gain * scale(joint.effort)).collect()
        };
        Self {
            dt: 1.0 / 500.0,
            solver_iterations: 1,
            sweeps: 4,
            gravity: Vector3::new(0.0, 0.0, -9.81),
            arm: ArmSettings {
                kp: scaled(4000.0),
                kd: scaled(200.0),
                armature: vec![0.1; n],
                coulomb: vec![0.0; n],
                viscous: vec![0.0; n],
                compliance: vec![0.0; n],
                uncompensated: 0.0,
            },
            gripper: GripperSettings { kp: 40_000.0, kd: 400.0, armature: 0.1, force: 40.0 },
            friction: FrictionSettings {
                pad_object: 0.8,
                table_object: 0.4,
                object_object: 0.4,
                pad_creep: 0.0,
                // Chosen: a small wooden drawer with something in it, the middle of what the laboratory draws.
                drawer: 4.0,
            },
            fluid: FluidSettings::default(),
            rims: BTreeMap::new(),
            seed: 0,
        }
    }
}
