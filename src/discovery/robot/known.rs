//! Effects that a model file knows already → laws with fixed parameters.

use super::data::Quantity;
use super::term::{Law, Term};
use crate::language::ast::EffectItem;
use crate::units::Unit;

/// The creep of dry friction where a model file gives none, rad/s.
const CREEP: f64 = 1e-3;

/// Reads one effect of a twin of an arm with `n` joints; `None` for an effect that is of something else
/// (a lens, a liquid).
///
/// # Errors
///
/// A sentence for a place that does not exist, or a parameter that is missing, unknown or of the wrong unit.
pub fn known(effect: &EffectItem, n: usize) -> Result<Option<(Term, Vec<f64>)>, String> {
    let name = effect.name.text.as_str();
    let at = effect.at.text.as_str();
    let number = |name: &str, unit: &str| -> Result<Option<f64>, String> {
        let Some(found) = effect.parameters.iter().find(|p| p.name.text == name) else {
            return Ok(None);
        };
        let quantity = found.value.quantity;
        let expected = Unit::parse(unit).map_or(quantity.dimension, |unit| unit.dimension);
        if quantity.dimension != expected {
            return Err(format!(
                "`{name}` of `{}({at})` is {}, but it must be {}",
                effect.name.text,
                quantity.dimension.words(),
                expected.words()
            ));
        }
        Ok(Some(quantity.value))
    };
    let needed = |name: &str, unit: &str| {
        number(name, unit)?.ok_or_else(|| format!("`{}({at})` has no `{name}`", effect.name.text))
    };
    let joint = || -> Result<usize, String> {
        at.strip_prefix("joint_")
            .and_then(|number| number.parse::<usize>().ok())
            .filter(|number| (1..=n).contains(number))
            .map(|number| number - 1)
            .ok_or_else(|| format!("`{name}({at})`: the robot has joint_1 to joint_{n}"))
    };
    let or = |value: Option<f64>, other: f64| value.unwrap_or(other);
    let found = |law: Law, joint: usize, values: Vec<f64>| Ok(Some((Term { law, joint }, values)));
    match name {
        "coulomb_friction" => {
            let creep = or(number("creep", "rad/s")?, CREEP);
            found(Law::Coulomb, joint()?, vec![needed("torque", "N*m")?, creep])
        }
        "viscous_friction" => {
            found(Law::Viscous, joint()?, vec![needed("coefficient", "N*m*s/rad")?])
        }
        "quadratic_friction" => {
            found(Law::Quadratic, joint()?, vec![needed("coefficient", "N*m*s^2/rad^2")?])
        }
        "stribeck_friction" => {
            let torque = needed("torque", "N*m")?;
            let peak = needed("stiction", "N*m")? - torque;
            let creep = or(number("creep", "rad/s")?, CREEP);
            let values = vec![torque, peak, needed("velocity", "rad/s")?, creep];
            found(Law::Stribeck, joint()?, values)
        }
        "asymmetric_friction" => {
            let creep = or(number("creep", "rad/s")?, CREEP);
            let values = vec![needed("forward", "N*m")?, needed("backward", "N*m")?, creep];
            found(Law::Asymmetric, joint()?, values)
        }
        "payload" => {
            let mass = needed("mass", "kg")?;
            let mut values = vec![mass];
            for name in ["com_x", "com_y", "com_z"] {
                values.push(mass * or(number(name, "m")?, 0.0));
            }
            found(Law::Payload, 0, values)
        }
        "link_mass" => found(Law::LinkMass, joint()?, vec![needed("mass", "kg")?]),
        "armature" => found(Law::Armature, joint()?, vec![needed("inertia", "kg*m^2")?]),
        "base_tilt" => {
            let values = vec![or(number("roll", "rad")?, 0.0), or(number("pitch", "rad")?, 0.0)];
            found(Law::BaseTilt, 0, values)
        }
        "torque_offset" => found(Law::TorqueOffset, joint()?, vec![needed("torque", "N*m")?]),
        "torque_gain" => found(Law::TorqueGain, joint()?, vec![needed("gain", "")?]),
        "torque_drift" => found(Law::TorqueDrift, joint()?, vec![needed("rate", "N*m/s")?]),
        "torque_ripple" => {
            let (amplitude, phase) =
                (needed("amplitude", "N*m")?, or(number("phase", "rad")?, 0.0));
            let values =
                vec![amplitude * phase.cos(), amplitude * phase.sin(), needed("order", "")?];
            found(Law::Ripple, joint()?, values)
        }
        "joint_compliance" => {
            found(Law::Compliance, joint()?, vec![needed("compliance", "rad/(N*m)")?])
        }
        "servo_sag" => found(Law::ServoSag, joint()?, vec![needed("compliance", "rad/(N*m)")?]),
        "backlash" => found(Law::Backlash, joint()?, vec![needed("width", "rad")?]),
        "command_delay" => found(Law::CommandDelay, 0, vec![needed("delay", "s")?]),
        "actuator_gain" => found(Law::ActuatorGain, joint()?, vec![needed("gain", "")?]),
        "saturation" => found(Law::Saturation, joint()?, vec![needed("limit", "N*m")?]),
        "sensor_delay" => {
            let quantities = [Quantity::Position, Quantity::Speed, Quantity::Torque, Quantity::Tip];
            let quantity = quantities.into_iter().find(|quantity| quantity.stem() == at);
            let quantity = quantity
                .ok_or_else(|| format!("`sensor_delay({at})`: the channels are q, dq, tau, tcp"))?;
            found(Law::SensorDelay(quantity), 0, vec![needed("delay", "s")?])
        }
        "joint_zero_offset" => found(Law::ZeroOffset, joint()?, vec![needed("angle", "rad")?]),
        "link_length" | "tool_offset" => {
            let mut values = Vec::new();
            for name in ["dx", "dy", "dz"] {
                values.push(or(number(name, "m")?, 0.0));
            }
            let law = if name == "link_length" { Law::LinkLength } else { Law::ToolOffset };
            let joint = if name == "link_length" { joint()? } else { 0 };
            found(law, joint, values)
        }
        "camera_shift" => {
            let mut values = Vec::new();
            for (name, unit) in [
                ("x", "m"),
                ("y", "m"),
                ("z", "m"),
                ("roll", "rad"),
                ("pitch", "rad"),
                ("yaw", "rad"),
            ] {
                values.push(or(number(name, unit)?, 0.0));
            }
            found(Law::CameraShift([true; 6]), 0, values)
        }
        "hysteresis" => {
            let values = vec![needed("torque", "N*m")?, needed("width", "rad")?];
            found(Law::Hysteresis, joint()?, values)
        }
        "linear_stiffness" => {
            found(Law::Stiffness, joint()?, vec![needed("coefficient", "N*m/rad")?])
        }
        "cubic_stiffness" => {
            found(Law::CubicStiffness, joint()?, vec![needed("coefficient", "N*m/rad^3")?])
        }
        "periodic_disturbance" => {
            let (amplitude, phase) =
                (needed("amplitude", "N*m")?, or(number("phase", "rad")?, 0.0));
            let values =
                vec![amplitude * phase.cos(), amplitude * phase.sin(), needed("frequency", "Hz")?];
            found(Law::Periodic, joint()?, values)
        }
        _ => Ok(None),
    }
}
