//! An arm's effects in the words of the vocabulary: numbers with uncertainty, equations, names of places.
//!
//! The fit works with parameters in which the model is as linear as possible (a sine and a cosine, a first
//! moment of mass); people and model files get amplitude and phase, mass and place. Uncertainty is
//! carried over to first order.

use nalgebra::DMatrix;

use super::load::Thing;
use super::term::{Feature, Law, Term};
use crate::discovery::finding::Told;
use crate::discovery::model_file;
use crate::units::significant;

/// Returns the effect's numbers in the order of the vocabulary. `covariance` is that of `parameters`; `things`
/// are what was carried.
pub fn told(
    term: &Term,
    parameters: &[f64],
    covariance: &DMatrix<f64>,
    things: &[Thing],
) -> Vec<Told> {
    let names = names(term.law);
    let slots = term.law.slots();
    let here = values(term.law, parameters);
    // ∂told/∂fitted, by central differences.
    let mut stds = vec![0.0; here.len()];
    let columns: Vec<Vec<f64>> = (0..parameters.len())
        .map(|i| {
            let step = 1e-3 * slots[i].scale;
            let mut moved = parameters.to_vec();
            moved[i] += step;
            let up = values(term.law, &moved);
            moved[i] -= 2.0 * step;
            let down = values(term.law, &moved);
            up.iter().zip(&down).map(|(up, down)| (up - down) / (2.0 * step)).collect()
        })
        .collect();
    for (at, std) in stds.iter_mut().enumerate() {
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
            (name.to_owned(), modelled + value, std, unit.to_owned())
        })
        .collect()
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
        Law::Feature(feature) => vec![("coefficient", unit(feature))],
        _ => law.slots().iter().map(|slot| (slot.name, slot.unit)).collect(),
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
        // A formula is told as it stands in the equation: what the sensor shows more.
        Law::Feature(_) => vec![-p[0]],
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

/// Writes a number with its unit, three digits.
fn number(value: f64, unit: &str) -> String {
    let text = significant(value, 3);
    if unit.is_empty() { text } else { format!("{text} {unit}") }
}

/// Writes what the effect adds to the model. Torques are what the motor must give more than modelled.
pub fn equation(term: &Term, told: &[Told]) -> String {
    let j = term.joint + 1;
    let n = |i: usize| told.get(i).map_or(String::new(), |(_, v, _, unit)| number(*v, unit));
    let v = |i: usize| told.get(i).map_or(0.0, |(_, value, _, _)| *value);
    let minus =
        |i: usize| told.get(i).map_or(String::new(), |(_, value, _, unit)| number(-value, unit));
    match term.law {
        Law::Coulomb | Law::SmoothCoulomb => format!("tau_{j} += {} * sign(dq_{j})", n(0)),
        Law::Viscous => format!("tau_{j} += {} * dq_{j}", n(0)),
        Law::Quadratic => format!("tau_{j} += {} * dq_{j}*abs(dq_{j})", n(0)),
        Law::Stribeck => format!(
            "tau_{j} += ({} + {} * exp(-(dq_{j}/({}))^2)) * sign(dq_{j})",
            n(0),
            number(v(1) - v(0), "N*m"),
            n(2)
        ),
        Law::Asymmetric => {
            format!("tau_{j} += {} where dq_{j} > 0, {} where dq_{j} < 0", n(0), minus(1))
        }
        Law::Payload => format!(
            "tau += J_c(q)' * {} * (ddx_c - g), c = ({}, {}, {}) m in the tip's frame",
            n(0),
            significant(v(1), 3),
            significant(v(2), 3),
            significant(v(3), 3)
        ),
        Law::ObjectMass => {
            format!(
                "tau += J_c(q)' * m * (ddx_c - g) from grasp to release, m = {} + contents",
                n(0)
            )
        }
        Law::LinkMass => format!("the link after joint {j} weighs {} more", n(0)),
        Law::Armature => format!("tau_{j} += {} * ddq_{j}", n(0)),
        Law::BaseTilt => {
            format!("g = R(roll {}, pitch {})' * (0, 0, -g)", n(0), n(1))
        }
        Law::TorqueOffset => format!("measured tau_{j} = tau_{j} + {}", n(0)),
        Law::TorqueGain => format!("measured tau_{j} = {} * tau_{j}", n(0)),
        Law::TorqueDrift => format!("measured tau_{j} = tau_{j} + {} * t", n(0)),
        Law::Ripple => {
            format!("tau_{j} -= {} * sin({} * q_{j} + {})", n(0), significant(v(1), 4), n(2))
        }
        Law::Periodic => {
            format!("tau_{j} -= {} * sin(2*pi * {} * t + {})", n(0), n(1), n(2))
        }
        Law::Compliance => format!("link angle {j} = q_{j} - {} * load_{j}", n(0)),
        Law::ServoSag => format!("q_{j} = q_cmd_{j} - {} * load_{j}", n(0)),
        Law::Backlash => {
            format!("link angle {j} = q_{j} + gap, abs(gap) <= {}", number(v(0) / 2.0, "rad"))
        }
        Law::CommandDelay => format!("q_cmd acts {} late", n(0)),
        Law::ActuatorGain => format!("torque at joint {j} = {} * tau_{j}", n(0)),
        Law::Saturation => format!("abs(tau_{j}) <= {}", n(0)),
        Law::SensorDelay(quantity) => format!("{}(t) is of t - {}", quantity.stem(), n(0)),
        Law::ZeroOffset => format!("joint angle {j} = q_{j} + {}", n(0)),
        Law::LinkLength => format!(
            "joint {j} sits ({}, {}, {}) m further in the frame of the link before it",
            significant(v(0), 3),
            significant(v(1), 3),
            significant(v(2), 3)
        ),
        Law::ToolOffset => format!(
            "tip = flange + R * ({}, {}, {}) m",
            significant(v(0), 3),
            significant(v(1), 3),
            significant(v(2), 3)
        ),
        Law::CameraShift(_) => {
            let parts: Vec<String> = told
                .iter()
                .map(|(name, value, _, unit)| format!("{name} {}", number(*value, unit)))
                .collect();
            format!("tcp = R * tip + d with {}", parts.join(", "))
        }
        Law::Hysteresis => {
            format!("tau_{j} += {} * z, {} * dz/dt = dq_{j} - abs(dq_{j})*z*abs(z)", n(0), n(1))
        }
        Law::Stiffness => format!("tau_{j} += {} * q_{j}", n(0)),
        Law::CubicStiffness => format!("tau_{j} += {} * q_{j}^3", n(0)),
        Law::Above => format!("tau_{j} += {} * max(0, q_{j} - {})", n(0), n(1)),
        Law::Below => format!("tau_{j} += {} * max(0, {} - q_{j})", n(0), n(1)),
        Law::LoadRipple => format!(
            "tau_{j} += {} * load_{j} * sin({} * q_{j} + {})",
            minus(0),
            significant(v(1), 4),
            n(2)
        ),
        Law::FadingDry => format!("tau_{j} += {} * sign(dq_{j})*exp(-t / ({}))", n(0), n(1)),
        Law::FadingFluid => format!("tau_{j} += {} * dq_{j}*exp(-t / ({}))", n(0), n(1)),
        Law::Feature(feature) => {
            format!("tau_{j} += {} * {}", n(0), shape(feature, j))
        }
    }
}

/// Writes a feature as a formula.
fn shape(feature: Feature, j: usize) -> String {
    match feature {
        Feature::Square => format!("q_{j}^2"),
        Feature::Sine(k) => format!("sin({} * q_{j})", significant(k, 4)),
        Feature::Cosine(k) => format!("cos({} * q_{j})", significant(k, 4)),
        Feature::PositionTimesSpeed => format!("q_{j}*abs(dq_{j})"),
        Feature::SpeedCubed => format!("dq_{j}^3"),
        Feature::RootSpeed => format!("sqrt(abs(dq_{j}))*sign(dq_{j})"),
        Feature::Decay(tau) => format!("exp(-t / ({} s))", significant(tau, 3)),
        Feature::Time => "t".into(),
        Feature::One => "1".into(),
        Feature::FrictionTimesDistance => format!("abs(q_{j})*sign(dq_{j})"),
        Feature::FrictionTimesSine => format!("sin(q_{j})*sign(dq_{j})"),
        Feature::FrictionTimesCosine => format!("cos(q_{j})*sign(dq_{j})"),
        Feature::FrictionTimesLoad => format!("abs(load_{j})*sign(dq_{j})"),
    }
}

/// Writes the line of a model file.
pub fn line(term: &Term, told: &[Told], things: &[Thing]) -> String {
    model_file::line(term.law.name(), &term.seat(things), told)
}
