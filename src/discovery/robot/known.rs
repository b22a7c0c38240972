//! Effects that a model file knows already → laws with fixed parameters.

use super::channels::Quantity;
use super::error::Misfit;
use super::term::{Law, Term};
use crate::discovery::vocabulary::{TRACKER, of_slide};
use crate::language::ast::EffectItem;
use crate::units::Unit;

/// The creep of dry friction where a model file gives none, rad/s.
const CREEP: f64 = 1e-3;

/// Effects of a joint with one number: name, law, the number's name and its unit.
const OF_ONE_NUMBER: [(&str, Law, &str, &str); 15] = [
    ("viscous_friction", Law::Viscous, "coefficient", "N*m*s/rad"),
    ("quadratic_friction", Law::Quadratic, "coefficient", "N*m*s^2/rad^2"),
    ("link_mass", Law::LinkMass, "mass", "kg"),
    ("armature", Law::Armature, "inertia", "kg*m^2"),
    ("torque_offset", Law::TorqueOffset, "torque", "N*m"),
    ("torque_gain", Law::TorqueGain, "gain", ""),
    ("torque_drift", Law::TorqueDrift, "rate", "N*m/s"),
    ("joint_compliance", Law::Compliance, "compliance", "rad/(N*m)"),
    ("servo_sag", Law::ServoSag, "compliance", "rad/(N*m)"),
    ("backlash", Law::Backlash, "width", "rad"),
    ("actuator_gain", Law::ActuatorGain, "gain", ""),
    ("saturation", Law::Saturation, "limit", "N*m"),
    ("joint_zero_offset", Law::ZeroOffset, "angle", "rad"),
    ("linear_stiffness", Law::Stiffness, "coefficient", "N*m/rad"),
    ("cubic_stiffness", Law::CubicStiffness, "coefficient", "N*m/rad^3"),
];

/// Where something is, m; what is left out is 0.
const PLACE: [(&str, &str); 3] = [("dx", "m"), ("dy", "m"), ("dz", "m")];
/// Where a mass is, m.
const CENTRE: [(&str, &str); 3] = [("com_x", "m"), ("com_y", "m"), ("com_z", "m")];
/// How something leans, rad.
const LEAN: [(&str, &str); 2] = [("roll", "rad"), ("pitch", "rad")];
/// Where something stands and how it is turned, m and rad.
const POSE: [(&str, &str); 6] =
    [("x", "m"), ("y", "m"), ("z", "m"), ("roll", "rad"), ("pitch", "rad"), ("yaw", "rad")];

/// Reads one effect of a twin of an arm, of whose joints `slides` says whether they slide; `None` for an effect that is of something else
/// (a lens, where a scene's camera stands, a liquid).
///
/// # Errors
///
/// A [`Misfit`] for a place that does not exist, or a parameter that is missing, unknown or of the wrong unit.
pub fn known(effect: &EffectItem, slides: &[bool]) -> Result<Option<(Term, Vec<f64>)>, Misfit> {
    let given = Given { effect, slides };
    let name = effect.name.text.as_str();
    if let Some((_, law, number, unit)) = OF_ONE_NUMBER.iter().find(|(known, ..)| *known == name) {
        let joint = given.joint()?;
        return Ok(Some((Term { law: *law, joint }, vec![given.needed(number, unit)?])));
    }
    let (law, joint, values) = match name {
        "coulomb_friction" => {
            let creep = given.creep()?;
            (Law::Coulomb, given.joint()?, vec![given.needed("torque", "N*m")?, creep])
        }
        "stribeck_friction" => {
            let torque = given.needed("torque", "N*m")?;
            let peak = given.needed("stiction", "N*m")? - torque;
            let creep = given.creep()?;
            let values = vec![torque, peak, given.needed("velocity", "rad/s")?, creep];
            (Law::Stribeck, given.joint()?, values)
        }
        "asymmetric_friction" => {
            let creep = given.creep()?;
            let [forward, backward] =
                [given.needed("forward", "N*m")?, given.needed("backward", "N*m")?];
            (Law::Asymmetric, given.joint()?, vec![forward, backward, creep])
        }
        "hysteresis" => {
            let values = vec![given.needed("torque", "N*m")?, given.needed("width", "rad")?];
            (Law::Hysteresis, given.joint()?, values)
        }
        "payload" => {
            let mass = given.needed("mass", "kg")?;
            let mut values = vec![mass];
            values.extend(given.or_zero(&CENTRE)?.into_iter().map(|place| mass * place));
            (Law::Payload, 0, values)
        }
        "base_tilt" => (Law::BaseTilt, 0, given.or_zero(&LEAN)?),
        "torque_ripple" => {
            let values = given.wave("order", "")?;
            (Law::Ripple, given.joint()?, values)
        }
        "periodic_disturbance" => {
            let values = given.wave("frequency", "Hz")?;
            (Law::Periodic, given.joint()?, values)
        }
        "command_delay" => (Law::CommandDelay, 0, vec![given.needed("delay", "s")?]),
        "sensor_delay" => {
            let law = Law::SensorDelay(given.channel()?);
            (law, 0, vec![given.needed("delay", "s")?])
        }
        "link_length" => {
            let values = given.or_zero(&PLACE)?;
            (Law::LinkLength, given.joint()?, values)
        }
        "tool_offset" => (Law::ToolOffset, 0, given.or_zero(&PLACE)?),
        "camera_shift" if given.effect.at.text == TRACKER => {
            (Law::CameraShift([true; 6]), 0, given.or_zero(&POSE)?)
        }
        _ => return Ok(None),
    };
    Ok(Some((Term { law, joint }, values)))
}

/// An effect as a model file gives it.
struct Given<'e> {
    effect: &'e EffectItem,
    /// Whether each joint of the robot slides.
    slides: &'e [bool],
}

impl Given<'_> {
    fn name(&self) -> String {
        self.effect.name.text.clone()
    }

    fn at(&self) -> String {
        self.effect.at.text.clone()
    }

    /// Returns a number in SI, if it is given.
    fn number(&self, name: &str, unit: &'static str) -> Result<Option<f64>, Misfit> {
        let Some(found) = self.effect.parameters.iter().find(|p| p.name.text == name) else {
            return Ok(None);
        };
        let quantity = found.value.quantity;
        let slides = self.joint().is_ok_and(|joint| self.slides[joint]);
        let unit = if slides { of_slide(name, unit) } else { unit };
        let expected = Unit::parse(unit).map_or(quantity.dimension, |unit| unit.dimension);
        if quantity.dimension != expected {
            return Err(Misfit::EffectUnit {
                parameter: name.into(),
                effect: self.name(),
                at: self.at(),
                is: quantity.dimension,
                expected,
            });
        }
        Ok(Some(quantity.value))
    }

    /// Returns a number in SI that must be given.
    fn needed(&self, name: &str, unit: &'static str) -> Result<f64, Misfit> {
        self.number(name, unit)?.ok_or_else(|| Misfit::EffectLacks {
            parameter: name.into(),
            effect: self.name(),
            at: self.at(),
        })
    }

    /// Returns numbers in SI, 0 for those that are not given.
    fn or_zero(&self, names: &[(&str, &'static str)]) -> Result<Vec<f64>, Misfit> {
        names.iter().map(|(name, unit)| Ok(self.number(name, unit)?.unwrap_or(0.0))).collect()
    }

    /// Returns the speed below which dry friction gives way, rad/s; m/s where the joint slides.
    fn creep(&self) -> Result<f64, Misfit> {
        Ok(self.number("creep", "rad/s")?.unwrap_or(CREEP))
    }

    /// Returns sine and cosine of a wave of a torque, and how often it comes.
    fn wave(&self, often: &str, unit: &'static str) -> Result<Vec<f64>, Misfit> {
        let amplitude = self.needed("amplitude", "N*m")?;
        let phase = self.number("phase", "rad")?.unwrap_or(0.0);
        let often = self.needed(often, unit)?;
        Ok(vec![amplitude * phase.cos(), amplitude * phase.sin(), often])
    }

    /// Returns the joint where it is, from 0.
    fn joint(&self) -> Result<usize, Misfit> {
        let joint = self.effect.at.text.strip_prefix("joint_");
        joint
            .and_then(|number| number.parse::<usize>().ok())
            .filter(|number| (1..=self.slides.len()).contains(number))
            .map(|number| number - 1)
            .ok_or_else(|| Misfit::EffectJoint {
                effect: self.name(),
                at: self.at(),
                n: self.slides.len(),
            })
    }

    /// Returns the channel where it is.
    fn channel(&self) -> Result<Quantity, Misfit> {
        let quantities = [Quantity::Position, Quantity::Speed, Quantity::Torque, Quantity::Tip];
        let quantity =
            quantities.into_iter().find(|quantity| quantity.stem() == self.effect.at.text);
        quantity.ok_or_else(|| Misfit::EffectChannel { at: self.at() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::ast::Item;
    use crate::language::parse;

    fn effect(text: &str) -> EffectItem {
        let items = parse(&format!("twin t of s {{ effect {text} }}")).0.items;
        let twin = items.into_iter().find_map(|item| match item {
            Item::Twin(twin) => Some(twin),
            _ => None,
        });
        twin.unwrap().effects.first().unwrap().clone()
    }

    #[test]
    fn friction_of_a_joint_that_slides_is_a_force() {
        let force = effect("coulomb_friction(joint_2) { torque = 14 N, creep = 0.002 m/s }");
        let (term, values) = known(&force, &[false, true]).unwrap().unwrap();
        assert_eq!(term, Term { law: Law::Coulomb, joint: 1 });
        assert!((values[0] - 14.0).abs() < 1e-12 && (values[1] - 0.002).abs() < 1e-12);
        assert!(known(&force, &[false, false]).is_err());
        let torque = effect("coulomb_friction(joint_2) { torque = 14 N*m }");
        assert!(known(&torque, &[false, true]).is_err());
        assert!(known(&torque, &[false, false]).is_ok());
    }
}
