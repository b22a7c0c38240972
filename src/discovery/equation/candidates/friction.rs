//! Forces against a motion: viscous, quadratic, dry, each also by direction, and with a peak at breakaway.
//!
//! Source: Olsson et al., "Friction Models and Friction Compensation", 1998.

use crate::units::Dimension;

use super::super::edit::Patch;
use super::{Draft, Range, p, velocities};

/// The forms of a force against a velocity `v`; `sign` leads each term.
fn rubbing(
    draft: &mut Draft,
    names: [&'static str; 5],
    (at, v): (&str, &str),
    (size, rate, rate_dim, v_dim): (Range, f64, Option<Dimension>, Option<Dimension>),
    both_ways: bool,
    write: &dyn Fn(String) -> (Patch, String),
    sign: &str,
) {
    let rms = size.rms.max(1e-12);
    let over = |a: Option<Dimension>, b: Option<Dimension>| a.zip(b).map(|(a, b)| a / b);
    let c1 = 0.1 * rate / rms;
    let square = v_dim.map(|d| d * d);
    let [linear, quadratic, dry, asymmetric, stribeck] = names;
    draft.add(
        (linear, at),
        &[p("coefficient", "damping", over(rate_dim, v_dim), &[c1])],
        &["asymmetric_damping"],
        |n| write(format!("{sign} {}*{v}", n[0])),
    );
    draft.add(
        (quadratic, at),
        &[p("coefficient", "drag", over(rate_dim, square), &[c1 / rms])],
        &[],
        |n| write(format!("{sign} {}*{v}*abs({v})", n[0])),
    );
    // Where nothing turns round it is a constant, and so is an offset: a doubt.
    let role = if dry == "coulomb_friction" { "torque" } else { "coefficient" };
    draft.add(
        (dry, at),
        &[p(role, "dry", rate_dim, &[0.1 * rate])],
        &["asymmetric_friction", "stribeck_friction"],
        |n| write(format!("{sign} {}*sign({v})", n[0])),
    );
    if !both_ways {
        return;
    }
    draft.add(
        ("asymmetric_damping", at),
        &[
            p("forward", "damping_forward", over(rate_dim, v_dim), &[c1]),
            p("backward", "damping_backward", over(rate_dim, v_dim), &[0.5 * c1]),
        ],
        &[],
        |n| write(format!("{sign} ({}*max({v}, 0) + {}*min({v}, 0))", n[0], n[1])),
    );
    draft.add(
        (asymmetric, at),
        &[
            p("forward", "dry_forward", rate_dim, &[0.1 * rate]),
            p("backward", "dry_backward", rate_dim, &[0.05 * rate]),
        ],
        &[],
        |n| write(format!("{sign} ({}*step({v}) - {}*step(-{v}))", n[0], n[1])),
    );
    // Linear in both amounts where the velocity is given: those begin from none, the velocity from every size it
    // may have, since between those sizes lie false bottoms.
    let velocities = [0.03, 0.1, 0.3, 1.0].map(|part| part * rms);
    draft.add(
        (stribeck, at),
        &[
            p("torque", "kinetic", rate_dim, &[0.0]).within(0.0, 1e3 * rate),
            p("stiction", "static", rate_dim, &[0.0]).within(0.0, 1e3 * rate),
            p("velocity", "stribeck", v_dim, &velocities).within(0.002 * rms, 3.0 * rms).shape(),
        ],
        &[],
        |n| {
            write(format!(
                "{sign} ({0} + ({1} - {0})*exp(-({v}/{2})^2))*sign({v})",
                n[0], n[1], n[2]
            ))
        },
    );
}

pub(super) fn friction(draft: &mut Draft) {
    let ground = draft.ground;
    let model = ground.compiled;
    let found = velocities(ground);
    for (s, state) in model.states.iter().enumerate() {
        let name = state.name.clone();
        let dimension = model.units.of(&name);
        let rate_dim = dimension.map(|d| d / Dimension::TIME);
        let rate = ground.rates[s].rms.max(1e-12);
        let write = |term: String| {
            let patch = Patch { rates: vec![(name.clone(), term.clone())], ..Patch::default() };
            (patch, format!("{name}' += {term}").replace("+= - ", "-= "))
        };
        if found.iter().any(|(v, _)| *v == s) {
            let names = [
                "linear_damping",
                "quadratic_drag",
                "dry_friction",
                "asymmetric_friction",
                "stribeck_friction",
            ];
            let both = ground.states[s].changes_sign() && ground.turns[s] > 0;
            let about = (ground.states[s], rate, rate_dim, dimension);
            rubbing(draft, names, (&name, &name), about, both, &write, "-");
        } else if !found.iter().any(|(_, q)| *q == Some(s)) {
            let c = 0.1 * rate / ground.states[s].rms.max(1e-12);
            draft.add(
                ("linear_damping", &name),
                &[p("coefficient", "damping", Some(Dimension::FREQUENCY), &[c])],
                &[],
                |n| write(format!("- {}*{name}", n[0])),
            );
        }
    }
}

/// Without states what rubs is a measured velocity, and the force is an output.
pub(super) fn friction_of_inputs(draft: &mut Draft) {
    let ground = draft.ground;
    let model = ground.compiled;
    for output in &model.outputs {
        for (i, (input, dimension)) in model.inputs.iter().enumerate() {
            let speed =
                dimension.is_none_or(|d| d == Dimension::SPEED || d == Dimension::ANGULAR_SPEED);
            if !speed {
                continue;
            }
            let o = model.outputs.iter().position(|x| x.name == output.name).unwrap_or(0);
            let mechanical =
                output.dimension.is_some_and(|d| d == Dimension::TORQUE || d == Dimension::FORCE);
            let names = if mechanical {
                [
                    "viscous_friction",
                    "quadratic_friction",
                    "coulomb_friction",
                    "asymmetric_friction",
                    "stribeck_friction",
                ]
            } else {
                [
                    "linear_damping",
                    "quadratic_drag",
                    "dry_friction",
                    "asymmetric_friction",
                    "stribeck_friction",
                ]
            };
            let out = output.name.clone();
            let write = |term: String| {
                let patch =
                    Patch { outputs: vec![(out.clone(), term.clone())], ..Patch::default() };
                (patch, format!("{out} += {}", term.trim_start_matches("+ ")))
            };
            let both = ground.inputs[i].changes_sign();
            let about =
                (ground.inputs[i], ground.outputs[o].rms.max(1e-12), output.dimension, *dimension);
            let at =
                if model.outputs.len() == 1 { input.clone() } else { format!("{input}_{out}") };
            rubbing(draft, names, (&at, input), about, both, &write, "+");
        }
    }
}
