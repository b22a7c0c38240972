//! An arm's effects as people and model files have them: numbers with uncertainty, and lines of a model.
//!
//! The fit works with parameters in which the model is as linear as possible (a sine and a cosine, a first
//! moment of mass); people and model files get amplitude and phase, mass and place. Uncertainty is
//! carried over to first order. Of what the motion does not show at all it is infinite: the number is one that was assumed.

use nalgebra::DMatrix;

use super::load::Thing;
use super::term::{Feature, Law, Term};
use crate::discovery::finding::ParameterEstimate;
use crate::discovery::model_file;
use crate::discovery::vocabulary::of_slide;

/// Returns the effect's numbers in the order of the vocabulary. `covariance` is that of `parameters`; `things`
/// are what was carried, and `slides` says whether its joint does.
pub(super) fn estimates(
    term: &Term,
    parameters: &[f64],
    covariance: &DMatrix<f64>,
    things: &[Thing],
    slides: bool,
) -> Vec<ParameterEstimate> {
    let names = names(term.law);
    let slides = slides && term.law.is_at_joint();
    let specs = term.law.specs();
    let here = values(term.law, parameters);
    // ∂told/∂fitted, by central differences.
    let mut stds = vec![0.0; here.len()];
    let columns: Vec<Vec<f64>> = (0..parameters.len())
        .map(|i| {
            let step = 1e-3 * specs[i].scale;
            let mut moved = parameters.to_vec();
            moved[i] += step;
            let up = values(term.law, &moved);
            moved[i] -= 2.0 * step;
            let down = values(term.law, &moved);
            up.iter().zip(&down).map(|(up, down)| (up - down) / (2.0 * step)).collect()
        })
        .collect();
    let open = open(covariance);
    for (at, std) in stds.iter_mut().enumerate() {
        if columns.iter().zip(&open).any(|(column, open)| *open && column[at].abs() > 0.0) {
            *std = f64::INFINITY;
            continue;
        }
        let mut variance = 0.0;
        for i in 0..parameters.len() {
            for k in 0..parameters.len() {
                variance += columns[i][at] * covariance[(i, k)] * columns[k][at];
            }
        }
        *std = variance.max(0.0).sqrt();
    }
    // What is fitted is how much heavier a thing is than modelled.
    let modelled = match term.law {
        Law::ObjectMass => things.get(term.joint).map_or(0.0, |thing| thing.mass),
        _ => 0.0,
    };
    names
        .into_iter()
        .zip(here.iter().zip(stds))
        .map(|((name, unit), (value, std))| {
            let unit = if slides { of_slide(name, unit) } else { unit };
            (name.to_owned(), modelled + value, std, unit.to_owned())
        })
        .collect()
}

/// Returns which of the numbers of an effect nothing determines: those that a fit gives no variance, where others have one.
fn open(covariance: &DMatrix<f64>) -> Vec<bool> {
    let variances = covariance.diagonal();
    let is_fitted = variances.iter().any(|variance| *variance > 0.0);
    variances.iter().map(|variance| is_fitted && *variance <= 0.0).collect()
}

fn names(law: Law) -> Vec<(&'static str, &'static str)> {
    match law {
        Law::Stribeck => {
            vec![("torque", "N*m"), ("stiction", "N*m"), ("velocity", "rad/s"), ("creep", "rad/s")]
        }
        Law::Payload => vec![("mass", "kg"), ("com_x", "m"), ("com_y", "m"), ("com_z", "m")],
        Law::Ripple => vec![("amplitude", "N*m"), ("order", ""), ("phase", "rad")],
        Law::LoadRipple => vec![("amplitude", ""), ("order", ""), ("phase", "rad")],
        Law::Periodic => vec![("amplitude", "N*m"), ("frequency", "Hz"), ("phase", "rad")],
        Law::Hysteresis => vec![("torque", "N*m"), ("width", "rad"), ("n", "")],
        Law::Feature(feature) => {
            let creep = feature.is_friction().then_some(("creep", "rad/s"));
            std::iter::once(("coefficient", unit(feature))).chain(creep).collect()
        }
        _ => law.specs().iter().map(|spec| (spec.name, spec.unit)).collect(),
    }
}

fn values(law: Law, p: &[f64]) -> Vec<f64> {
    match law {
        Law::Stribeck => vec![p[0], p[0] + p[1], p[2], p[3]],
        Law::Payload => {
            let mass = if p[0].abs() < 1e-9 { 1e-9 } else { p[0] };
            vec![p[0], p[1] / mass, p[2] / mass, p[3] / mass]
        }
        // a sin x + b cos x = A sin(x + φ).
        Law::Ripple | Law::LoadRipple | Law::Periodic => {
            vec![p[0].hypot(p[1]), p[2], p[1].atan2(p[0])]
        }
        // A formula is told as it stands in the equation: what the sensor shows more. Friction is fitted as it resists.
        Law::Feature(feature) if !feature.is_friction() => vec![-p[0]],
        Law::Above | Law::Below => vec![-p[0], p[1]],
        // The exponent is part of the law: it is not fitted.
        Law::Hysteresis => vec![p[0], p[1], 2.0],
        _ => p.to_vec(),
    }
}

/// Returns the unit of a feature's coefficient, so that the product is a torque.
fn unit(feature: Feature) -> &'static str {
    match feature {
        Feature::Square => "N*m/rad^2",
        Feature::Sine(_)
        | Feature::Cosine(_)
        | Feature::Decay(_)
        | Feature::One
        | Feature::RootSpeed
        | Feature::FrictionTimesSine
        | Feature::FrictionTimesCosine => "N*m",
        Feature::PositionTimesSpeed => "N*m*s/rad^2",
        Feature::SpeedCubed => "N*m*s^3/rad^3",
        Feature::Time => "N*m/s",
        Feature::FrictionTimesLoad => "",
        Feature::FrictionTimesDistance => "N*m/rad",
    }
}

/// Writes the line of a model file.
pub(super) fn line(term: &Term, estimates: &[ParameterEstimate], things: &[Thing]) -> String {
    model_file::line(term.law.name(), &term.seat(things), estimates)
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;

    /// A load of which no torque shows how high it is, as where all axes stand upright.
    #[test]
    fn a_coordinate_that_nothing_shows_is_not_determined() {
        let term = Term { law: Law::Payload, joint: 0 };
        let told = |variances: [f64; 4]| {
            let covariance = DMatrix::from_diagonal(&DVector::from_row_slice(&variances));
            estimates(&term, &[2.0, 0.2, 0.0, 0.0], &covariance, &[], false)
        };
        let std = |all: &[ParameterEstimate], at: usize| all[at].2;
        let shown = told([1e-4, 4e-4, 4e-4, 4e-4]);
        let open = told([1e-4, 4e-4, 4e-4, 0.0]);
        assert!((0..3).all(|at| (std(&open, at) - std(&shown, at)).abs() < 1e-12), "{open:?}");
        assert!((std(&shown, 3) - 0.01).abs() < 1e-9 && std(&open, 3).is_infinite(), "{open:?}");
        let line = line(&term, &open, &[]);
        assert!(line.ends_with("com_z = 0 m }"), "{line}");
        // What was not fitted at all is left without a deviation.
        let fixed = told([0.0; 4]);
        assert!((0..4).all(|at| std(&fixed, at).abs() < 1e-12), "{fixed:?}");
    }

    #[test]
    fn a_joint_that_slides_rubs_in_newtons() {
        let covariance = DMatrix::from_diagonal(&DVector::from_row_slice(&[1e-4, 1e-10]));
        let told = |law, slides| {
            let term = Term { law, joint: 2 };
            let told = estimates(&term, &[14.0, 2e-3], &covariance, &[], slides);
            told.into_iter().map(|(name, .., unit)| (name, unit)).collect::<Vec<_>>()
        };
        let of = |torque: &str, creep: &str| {
            [("torque", torque), ("creep", creep)].map(|(a, b)| (a.to_owned(), b.to_owned()))
        };
        assert_eq!(told(Law::Coulomb, true), of("N", "m/s"));
        assert_eq!(told(Law::Coulomb, false), of("N*m", "rad/s"));
        // A base leans by angles, whatever the first joint does.
        assert!(told(Law::BaseTilt, true).iter().all(|(_, unit)| unit == "rad"));
    }
}
