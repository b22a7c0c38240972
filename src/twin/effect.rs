//! The effects of the vocabulary that the twin has a law for: what was found missing, put in.
//!
//! An [`Effect`] changes numbers the twin is built from, before it is built: the scene (a mass, a
//! filling) or the [`Settings`] (friction, soft gears, water on a lip). Finding effects and fitting their
//! numbers is done in a layer above; what only changes a reading is corrected where it is read.

use super::Settings;
use super::fluid::Dribble;
use crate::world::Scene;

/// One effect with its numbers, SI. Joints count from 0.
#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    /// `coulomb_friction(joint)`: a torque against the motion, N·m.
    CoulombFriction(usize, f64),
    /// `viscous_friction(joint)`: N·m·s/rad.
    ViscousFriction(usize, f64),
    /// `joint_compliance(joint)`: rad/(N·m).
    JointCompliance(usize, f64),
    /// `object_mass(object)`: kg, without what is in it.
    ObjectMass(String, f64),
    /// `liquid_volume(object)`: m³ at the beginning.
    LiquidVolume(String, f64),
    /// `lip_dribble(object)`.
    LipDribble(String, Dribble),
}

impl Effect {
    /// Returns the effect that a name of the vocabulary, its place and its numbers (SI, by name) stand
    /// for, or `None` if the twin has no law for it or a number is missing.
    pub fn known(name: &str, at: &str, number: impl Fn(&str) -> Option<f64>) -> Option<Self> {
        let joint = || at.strip_prefix("joint_")?.parse::<usize>().ok()?.checked_sub(1);
        Some(match name {
            "coulomb_friction" => Self::CoulombFriction(joint()?, number("torque")?),
            "viscous_friction" => Self::ViscousFriction(joint()?, number("coefficient")?),
            "joint_compliance" => Self::JointCompliance(joint()?, number("compliance")?),
            "object_mass" => Self::ObjectMass(at.to_owned(), number("mass")?),
            "liquid_volume" => Self::LiquidVolume(at.to_owned(), number("volume")?),
            "lip_dribble" => {
                let dribble = Dribble { volume: number("volume")?, delay: number("delay")? };
                Self::LipDribble(at.to_owned(), dribble)
            }
            _ => return None,
        })
    }

    /// Puts the effect into a scene, if it is about the things in it.
    pub fn change_scene(&self, scene: &mut Scene) {
        for object in &mut scene.objects {
            match self {
                Self::ObjectMass(name, mass) if *name == object.name => object.mass = *mass,
                Self::LiquidVolume(name, volume) if *name == object.name => {
                    if let Some(cavity) = &mut object.cavity {
                        cavity.filled = volume.min(cavity.capacity);
                    }
                }
                _ => {}
            }
        }
    }

    /// Puts the effect into the numbers of the physics, if it is about how things move.
    pub fn change_settings(&self, settings: &mut Settings) {
        let arm = &mut settings.arm;
        let (list, joint, by) = match self {
            Self::CoulombFriction(joint, by) => (&mut arm.coulomb, *joint, *by),
            Self::ViscousFriction(joint, by) => (&mut arm.viscous, *joint, *by),
            Self::JointCompliance(joint, by) => (&mut arm.compliance, *joint, *by),
            Self::LipDribble(object, dribble) => {
                settings.dribbles.insert(object.clone(), *dribble);
                return;
            }
            Self::ObjectMass(..) | Self::LiquidVolume(..) => return,
        };
        if let Some(value) = list.get_mut(joint) {
            *value += by;
        }
    }
}
