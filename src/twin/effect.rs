//! The effects of the vocabulary that the twin has a law for: what was found missing, put in.
//!
//! An [`Effect`] changes numbers the twin is built from, before it is built: the scene (a mass, a filling, a size) or
//! the [`Settings`] (friction, rotors, soft gears, how a rim lets go of liquid, how pads hold). Finding effects and fitting
//! their numbers is done in a layer above; what only changes a reading is corrected where it is read.

use nalgebra::Vector3;

use super::fluid::{Dribble, Rim};
use super::{Hindrance, Settings};
use crate::world::{Object, Scene};

/// One effect with its numbers, SI. Joints count from 0.
#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    /// `coulomb_friction(joint)`: a torque against the motion, N·m.
    CoulombFriction(usize, f64),
    /// `viscous_friction(joint)`: N·m·s/rad.
    ViscousFriction(usize, f64),
    /// `joint_compliance(joint)`: rad/(N·m).
    JointCompliance(usize, f64),
    /// `armature(joint)`: the rotor's inertia at the joint, kg·m², all of it.
    Armature(usize, f64),
    /// `object_mass(object)`: kg, without what is in it.
    ObjectMass(String, f64),
    /// `object_size(object)`: so much larger along its own axes, m.
    ObjectSize(String, Vector3<f64>),
    /// `liquid_volume(object)`: m³ at the beginning.
    LiquidVolume(String, f64),
    /// `liquid_viscosity(object)`: Pa·s of what is in it.
    LiquidViscosity(String, f64),
    /// `lip_dribble(object)`.
    LipDribble(String, Dribble),
    /// `overflow(object)`: m³ that it holds when it is full.
    Overflow(String, f64),
    /// `grip_slip(gripper) { rate }`: m/s by which what is held creeps along the pads.
    GripCreep(f64),
    /// `grip_slip(gripper) { friction }`: of the pads on what is held.
    GripFriction(f64),
}

impl Effect {
    /// Returns the effect that a name of the vocabulary, its place and its numbers (SI, by name) stand
    /// for, or `None` if the twin has no law for it or a number is missing.
    pub fn known(name: &str, at: &str, number: impl Fn(&str) -> Option<f64>) -> Option<Self> {
        let joint = || at.strip_prefix("joint_")?.parse::<usize>().ok()?.checked_sub(1);
        let object = || at.to_owned();
        Some(match name {
            "coulomb_friction" => Self::CoulombFriction(joint()?, number("torque")?),
            "viscous_friction" => Self::ViscousFriction(joint()?, number("coefficient")?),
            "joint_compliance" => Self::JointCompliance(joint()?, number("compliance")?),
            "armature" => Self::Armature(joint()?, number("inertia")?),
            "object_mass" => Self::ObjectMass(object(), number("mass")?),
            "object_size" => {
                let by = ["dx", "dy", "dz"].map(&number);
                by.iter().find(|by| by.is_some())?;
                Self::ObjectSize(object(), Vector3::from(by.map(|by| by.unwrap_or(0.0))))
            }
            "liquid_volume" => Self::LiquidVolume(object(), number("volume")?),
            "liquid_viscosity" => Self::LiquidViscosity(object(), number("viscosity")?),
            "lip_dribble" => {
                let dribble = Dribble { volume: number("volume")?, delay: number("delay")? };
                Self::LipDribble(object(), dribble)
            }
            "overflow" => Self::Overflow(object(), number("level")?),
            "grip_slip" if at == "gripper" => match (number("rate"), number("friction")) {
                (Some(rate), None) => Self::GripCreep(rate),
                (None, Some(friction)) => Self::GripFriction(friction),
                _ => return None,
            },
            _ => return None,
        })
    }

    /// Says why the effect changes nothing with these things and an arm of so many joints, if it does not.
    pub fn hindrance(&self, scene: &Scene, joints: usize) -> Option<Hindrance> {
        let (name, vessel) = match self {
            Self::CoulombFriction(joint, _)
            | Self::ViscousFriction(joint, _)
            | Self::JointCompliance(joint, _)
            | Self::Armature(joint, _) => {
                let beyond = *joint >= joints;
                return beyond.then_some(Hindrance::NoJoint(joints));
            }
            Self::GripCreep(_) | Self::GripFriction(_) => return None,
            Self::ObjectMass(name, _) | Self::ObjectSize(name, _) => (name, false),
            Self::LiquidVolume(name, _)
            | Self::LiquidViscosity(name, _)
            | Self::LipDribble(name, _)
            | Self::Overflow(name, _) => (name, true),
        };
        match scene.object(name) {
            None => Some(Hindrance::NoObject { scene: scene.name.clone(), object: name.clone() }),
            Some(object) if vessel && object.cavity.is_none() => {
                Some(Hindrance::NoVessel(name.clone()))
            }
            Some(_) => None,
        }
    }

    /// Puts the effect into a scene, if it is about the things in it.
    pub fn change_scene(&self, scene: &mut Scene) {
        for object in &mut scene.objects {
            match self {
                Self::ObjectMass(name, mass) if *name == object.name => object.mass = *mass,
                Self::ObjectSize(name, by) if *name == object.name => grow(object, by),
                Self::LiquidVolume(name, volume) if *name == object.name => {
                    if let Some(cavity) = &mut object.cavity {
                        cavity.filled = volume.min(cavity.capacity);
                    }
                }
                Self::Overflow(name, level) if *name == object.name => {
                    if let Some(cavity) = &mut object.cavity {
                        cavity.capacity = level.min(cavity.capacity);
                    }
                }
                _ => {}
            }
        }
    }

    /// Puts the effect into the numbers of the physics, if it is about how things move.
    pub fn change_settings(&self, settings: &mut Settings) {
        let add = |list: &mut Vec<f64>, joint: usize, by: f64| {
            if let Some(value) = list.get_mut(joint) {
                *value += by;
            }
        };
        let (arm, friction) = (&mut settings.arm, &mut settings.friction);
        let rims = &mut settings.rims;
        let mut rim = |name: &String, change: &dyn Fn(&mut Rim)| {
            change(rims.entry(name.clone()).or_default());
        };
        match self {
            Self::CoulombFriction(joint, by) => add(&mut arm.coulomb, *joint, *by),
            Self::ViscousFriction(joint, by) => add(&mut arm.viscous, *joint, *by),
            Self::JointCompliance(joint, by) => add(&mut arm.compliance, *joint, *by),
            // Of a model that says it, not added to the one that a twin has for its servo's sake.
            Self::Armature(joint, inertia) => {
                if let Some(own) = arm.armature.get_mut(*joint) {
                    *own = *inertia;
                }
            }
            Self::LipDribble(name, dribble) => rim(name, &|rim| rim.dribble = Some(*dribble)),
            Self::LiquidViscosity(name, value) => rim(name, &|rim| rim.viscosity = Some(*value)),
            Self::Overflow(name, level) => rim(name, &|rim| rim.brim = Some(*level)),
            Self::GripCreep(rate) => friction.pad_creep = *rate,
            Self::GripFriction(value) => friction.pad_object = *value,
            Self::ObjectMass(..) | Self::ObjectSize(..) | Self::LiquidVolume(..) => {}
        }
    }
}

/// Makes an object larger by so much along its own axes, m; a vessel that was full at its rim still is.
fn grow(object: &mut Object, by: &Vector3<f64>) {
    let inside = |object: &Object| object.inside().map_or(0.0, |inside| inside.volume());
    let before = inside(object);
    object.shape = object.shape.stretched(by);
    let after = inside(object);
    if let Some(cavity) = &mut object.cavity {
        let to_rim = cavity.capacity > before * (1.0 - 1e-6);
        cavity.capacity = if to_rim { after } else { cavity.capacity.min(after) };
    }
}
