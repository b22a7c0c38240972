//! Sensors and actuators: offsets, gains, limits, dead zones, delays and lags.

use crate::units::Dimension;

use super::super::edit::{Patch, fresh};
use super::super::wording;
use super::{Draft, P, Range, p};

/// What an actuator does to an input.
pub(super) fn inputs(draft: &mut Draft) {
    let ground = draft.ground;
    for (i, (name, dimension)) in ground.compiled.inputs.iter().enumerate() {
        let range = ground.inputs[i];
        if range.span() <= 0.0 && range.rms <= 0.0 {
            continue;
        }
        let wrap = |template: String| {
            let equation = format!("{name} acts as {}", template.replace("{}", name));
            (Patch { input: Some((name.clone(), template)), ..Patch::default() }, equation)
        };
        scale(draft, ["input_offset", "input_gain"], name, (range, *dimension), &wrap);
        if range.span() <= 0.0 {
            continue;
        }
        let peak = range.low.abs().max(range.high.abs());
        draft.add(
            ("input_saturation", name),
            &[p("limit", "limit", *dimension, &[0.9 * peak, 0.7 * peak, 0.5 * peak])
                .within(0.02 * peak, peak)
                .shape()],
            &[],
            |n| wrap(format!("clamp({{}}, -{0}, {0})", n[0])),
        );
        // Of an input that stays away from 0 a small dead zone takes a constant, which is an offset.
        let one_way = range.low * range.high > 0.0;
        let least = if one_way { range.low.abs().min(range.high.abs()) } else { 0.0 };
        if least < 0.5 * peak {
            let size = (range.rms - least).max(1e-12);
            // One wider than the input usually is lets nothing act at all.
            draft.add(
                ("input_deadzone", name),
                &[p("width", "deadzone", *dimension, &[least + 0.05 * size, least + 0.3 * size])
                    .within(least, least + size)
                    .shape()],
                &[],
                |n| wrap(format!("deadzone({{}}, {})", n[0])),
            );
        }
        let delay = late(draft);
        draft.add(("input_delay", name), &[delay], &[], |n| wrap(format!("delay({{}}, {})", n[0])));
        if ground.compiled.states.is_empty() {
            continue;
        }
        let lagged = fresh(ground.model, &format!("{name}_lagged"));
        let lag = slow(draft);
        draft.add(("lag", name), &[lag], &[], |n| {
            let (mut patch, _) = wrap(lagged.clone());
            let rate = format!("({name} - {lagged})/{}", n[0]);
            patch.states.push((lagged.clone(), rate.clone()));
            (patch, format!("{name} acts as {lagged}, {lagged}' = {rate}"))
        });
    }
}

/// What a sensor does to an output.
pub(super) fn outputs(draft: &mut Draft) {
    let ground = draft.ground;
    for (o, output) in ground.compiled.outputs.iter().enumerate() {
        let (name, dimension) = (&output.name, output.dimension);
        let range = ground.outputs[o];
        let wrap = |template: String| {
            let equation =
                format!("{name} = {}", template.replace("{}", wording::WHAT_THE_MODEL_SAYS));
            (Patch { output: Some((name.clone(), template)), ..Patch::default() }, equation)
        };
        scale(draft, ["output_offset", "output_gain"], name, (range, dimension), &wrap);
        let per_time = dimension.map(|d| d / Dimension::TIME);
        draft.add(("output_drift", name), &[p("rate", "drift", per_time, &[0.0])], &[], |n| {
            wrap(format!("{{}} + {}*t", n[0]))
        });
        // A sensor reads zero as well: an end that keeps it from there is none.
        if range.span() > 0.0 && range.high > 0.0 {
            let at = |part: f64| (range.low + part * range.span()).max(0.0);
            draft.add(
                ("output_saturation", name),
                &[p("limit", "limit", dimension, &[at(0.98), at(0.9)])
                    .within(at(0.3), at(1.05))
                    .shape()],
                &[],
                |n| wrap(format!("min({{}}, {})", n[0])),
            );
        }
        if ground.compiled.states.is_empty() {
            continue;
        }
        let delay = late(draft);
        draft
            .add(("sensor_delay", name), &[delay], &[], |n| wrap(format!("delay({{}}, {})", n[0])));
        let lagged = fresh(ground.model, &format!("{name}_lagged"));
        let lag = slow(draft);
        draft.add(("lag", name), &[lag], &[], |n| {
            // The sensor is a state of its own that runs after what it measures.
            let patch = Patch {
                states: vec![(lagged.clone(), format!("({{{name}}} - {lagged})/{}", n[0]))],
                output: Some((name.clone(), lagged.clone())),
                ..Patch::default()
            };
            let rate = wording::lagging(&lagged, &n[0]);
            (patch, format!("{name} = {lagged}, {lagged}' = {rate}"))
        });
    }
}

/// An offset and a gain of a signal; `wrap` writes them around it.
fn scale(
    draft: &mut Draft,
    [offset, gain]: [&'static str; 2],
    name: &str,
    (range, dimension): (Range, Option<Dimension>),
    wrap: &dyn Fn(String) -> (Patch, String),
) {
    draft.add((offset, name), &[p("value", "offset", dimension, &[0.0])], &[], |n| {
        wrap(format!("{{}} + {}", n[0]))
    });
    // What stands still at 0 has no scale.
    if range.rms > 0.0 {
        let by = p("gain", "gain", Some(Dimension::NONE), &[1.0]).factor();
        draft.add((gain, name), &[by], &[], |n| wrap(format!("{}*({{}})", n[0])));
    }
}

/// A delay of about a row at least: less than that is a matter of when in a row each column was read.
fn late(draft: &Draft) -> P {
    let (row, step) = (draft.ground.row, draft.ground.step);
    let longest = (0.1 * draft.ground.duration).max(4.0 * step);
    p("delay", "delay", Some(Dimension::TIME), &[2.0 * step, 8.0 * step, 30.0 * step])
        .within(0.75 * row, longest)
        .shape()
}

/// The time of a first-order lag; below a row it is no other than a delay of so much, and one that is not over
/// within a stretch is no other than a wrong first value of it.
fn slow(draft: &Draft) -> P {
    let (step, stretch) = (draft.ground.step, draft.ground.stretch);
    let least = draft.ground.row.max(0.4 * step);
    p("time", "lag", Some(Dimension::TIME), &[2.0 * step, 10.0 * step, 50.0 * step])
        .within(least, (0.25 * stretch).max(2.0 * least))
        .shape()
}
