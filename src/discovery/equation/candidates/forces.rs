//! Forces that pull back, remember the path, or come round by themselves.
//!
//! Source: Bouc 1967, Wen, "Method for Random Vibration of Hysteretic Systems", 1976.

use crate::units::Dimension;

use super::super::edit::{Patch, fresh};
use super::{Draft, p, velocities};

/// Springs, straight and hardening, and loops of hysteresis.
pub(super) fn stiffness(draft: &mut Draft) {
    let ground = draft.ground;
    let model = ground.compiled;
    for (v, q) in velocities(ground) {
        let Some(q) = q else { continue };
        let (vn, qn) = (model.states[v].name.clone(), model.states[q].name.clone());
        let (vd, qd) = (model.units.of(&vn), model.units.of(&qn));
        let rate_dim = vd.map(|d| d / Dimension::TIME);
        let per = |n: u8| rate_dim.zip(qd).map(|(r, q)| (0..n).fold(r, |d, _| d / q));
        let rate = ground.rates[v].rms.max(1e-12);
        let size = ground.states[q].rms.max(1e-12);
        let write = |term: String| {
            let patch = Patch { rates: vec![(vn.clone(), term.clone())], ..Patch::default() };
            (patch, format!("{vn}' += {term}").replace("+= - ", "-= "))
        };
        let k = 0.1 * rate / size;
        draft.add(
            ("linear_stiffness", &qn),
            &[p("coefficient", "stiffness", per(1), &[k])],
            &[],
            |n| write(format!("- {}*{qn}", n[0])),
        );
        draft.add(
            ("cubic_stiffness", &qn),
            &[p("coefficient", "cubic", per(3), &[k / (size * size)])],
            &[],
            |n| write(format!("- {}*{qn}^3", n[0])),
        );
        if !ground.states[v].changes_sign() {
            continue;
        }
        hysteresis(draft, (&vn, &qn), (rate_dim, qd), &write);
    }
}

/// Bouc and Wen's loop: a force between `-alpha` and `alpha`, reached within `width` of a reversal; and the
/// same with a `skew`, by which it stiffens on the way out (below 0) or gives way sooner (above 1).
fn hysteresis(
    draft: &mut Draft,
    (vn, qn): (&str, &str),
    (rate_dim, qd): (Option<Dimension>, Option<Dimension>),
    write: &dyn Fn(String) -> (Patch, String),
) {
    let ground = draft.ground;
    let Some(q) = ground.compiled.states.iter().position(|s| s.name == qn) else { return };
    let span = ground.states[q].span().max(1e-12);
    let name = fresh(ground.model, &format!("{qn}_loop"));
    // Linear in its size where the path is given, so it begins from none.
    let alpha = || p("alpha", "hysteresis", rate_dim, &[0.0]);
    let width = |parts: &[f64]| {
        let starts: Vec<f64> = parts.iter().map(|part| part * span).collect();
        p("width", "width", qd, &starts).within(0.002 * span, 2.0 * span).shape()
    };
    let looped = |n: &[String], bend: &str| {
        let (mut patch, equation) = write(format!("- {}*{name}", n[0]));
        let rate = format!("{vn}/{}*(1 - 0.5*abs({name})*({bend} + sign({vn}*{name})))", n[1]);
        patch.states.push((name.clone(), rate.clone()));
        (patch, format!("{equation}, {name}' = {rate}"))
    };
    let plain = [alpha(), width(&[0.04, 0.12, 0.35])];
    draft.add(("hysteresis", qn), &plain, &["hysteresis"], |n| looped(n, "1"));
    let skew = p("skew", "skew", Some(Dimension::NONE), &[-1.0, -1.0, 2.0]);
    let skewed = [alpha(), width(&[0.1, 0.4, 0.2]), skew.within(-5.0, 5.0).shape()];
    draft.add(("hysteresis", qn), &skewed, &[], |n| looped(n, &n[2]));
}

/// A hum at each line of the residual's spectrum.
pub(super) fn disturbances(draft: &mut Draft) {
    let ground = draft.ground;
    let model = ground.compiled;
    let found = velocities(ground);
    for (s, state) in model.states.iter().enumerate() {
        // A hum is a force: it acts on velocities, not on positions.
        if found.iter().any(|(_, q)| *q == Some(s)) || ground.lines.is_empty() {
            continue;
        }
        let name = state.name.clone();
        let rate_dim = model.units.of(&name).map(|d| d / Dimension::TIME);
        let rate = ground.rates[s].rms.max(1e-12);
        let mut amplitudes = Vec::new();
        let mut frequencies = Vec::new();
        let mut phases = Vec::new();
        for line in &ground.lines {
            for phase in [0.0, 2.0, 4.0] {
                amplitudes.push(0.1 * rate);
                frequencies.push(*line);
                phases.push(phase);
            }
        }
        draft.add(
            ("periodic_disturbance", &name),
            &[
                p("amplitude", "hum", rate_dim, &amplitudes),
                p("frequency", "hum_frequency", Some(Dimension::FREQUENCY), &frequencies)
                    .within(1e-9, 0.5 / ground.step)
                    .shape(),
                p("phase", "hum_phase", Some(Dimension::ANGLE), &phases).shape(),
            ],
            &[],
            |n| {
                let term = format!("+ {}*sin(2*pi*{}*t + {})", n[0], n[1], n[2]);
                let patch = Patch { rates: vec![(name.clone(), term.clone())], ..Patch::default() };
                (patch, format!("{name}' += {}", term.trim_start_matches("+ ")))
            },
        );
    }
}
