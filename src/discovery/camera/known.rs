//! Effects that a model file knows already → laws with fixed parameters.

pub use super::error::BadParameter;
use super::term::Law;
use crate::discovery::vocabulary::is_tracker;
use crate::language::ast::EffectItem;
use crate::units::Unit;

/// Reads one effect of a twin; `None` for an effect that is not of the scene's camera or the table.
///
/// # Errors
///
/// [`BadParameter`] for a parameter that is unknown, missing or of the wrong unit.
pub fn known(effect: &EffectItem) -> Result<Option<(Law, Vec<f64>)>, BadParameter> {
    let law = match effect.name.text.as_str() {
        "radial_distortion" => Law::Radial(true),
        "tangential_distortion" => Law::Tangential,
        "focal_error" => Law::Focal(true),
        "principal_point_shift" => Law::Principal(true, true),
        "camera_shift" if !is_tracker(&effect.at.text) => Law::Shift([true; 6]),
        "table_tilt" => Law::Table(true, true),
        "image_delay" => Law::Delay,
        "rolling_shutter" => Law::Shutter,
        _ => return Ok(None),
    };
    let here = format!("{}({})", effect.name.text, effect.at.text);
    let numbers = law.shown();
    for given in &effect.parameters {
        if !numbers.iter().any(|(name, ..)| *name == given.name.text) {
            return Err(BadParameter::Unknown {
                effect: here,
                parameter: given.name.text.clone(),
                known: numbers.iter().map(|(name, ..)| *name).collect(),
            });
        }
    }
    let mut values = Vec::new();
    for (name, unit, _) in numbers {
        let given = effect.parameters.iter().find(|given| given.name.text == name);
        // What is not given is as if it were not there; a delay must be given.
        let missing = match law {
            Law::Focal(_) => Some(1.0),
            Law::Delay | Law::Shutter => None,
            _ => Some(0.0),
        };
        let Some(given) = given else {
            values.push(
                missing.ok_or_else(|| BadParameter::Missing {
                    effect: here.clone(),
                    parameter: name,
                })?,
            );
            continue;
        };
        let quantity = given.value.quantity;
        let expected = Unit::parse(unit).map_or(quantity.dimension, |unit| unit.dimension);
        if quantity.dimension != expected {
            let is = quantity.dimension;
            return Err(BadParameter::Unit { effect: here, parameter: name, is, expected });
        }
        values.push(quantity.value);
    }
    Ok(Some((law, values)))
}
