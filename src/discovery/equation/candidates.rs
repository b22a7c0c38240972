//! Every effect that could sit in a model, with its places, its terms and where to start fitting it.
//!
//! The names are those of [`super::super::vocabulary`]. Which states are velocities is read off the
//! equations (`q' = v`) or the units; only velocities rub, only levels that stay above 0 overflow.

use crate::units::Dimension;

use super::compile::Compiled;
use super::edit::{NewParam, Patch, fresh};
use crate::language::ast::ModelItem;

/// What is known of a signal along the recordings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Least value.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
    /// Root mean square.
    pub rms: f64,
}

impl Range {
    /// Of some values.
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut sum, mut n) = (0.0, 0.0);
        for v in values {
            low = low.min(v);
            high = high.max(v);
            sum += v * v;
            n += 1.0;
        }
        Self { low, high, rms: f64::sqrt(sum / f64::max(n, 1.0)) }
    }

    fn span(self) -> f64 {
        (self.high - self.low).max(0.0)
    }

    /// Whether it is well on both sides of 0.
    fn changes_sign(self) -> bool {
        self.low < -0.02 * self.span() && self.high > 0.02 * self.span()
    }
}

/// What the candidates are made from.
#[derive(Debug, Clone)]
pub struct Ground<'a> {
    /// The model as text tree.
    pub model: &'a ModelItem,
    /// The model as program.
    pub compiled: &'a Compiled,
    /// Along the simulation, one per state.
    pub states: Vec<Range>,
    /// As measured, one per input.
    pub inputs: Vec<Range>,
    /// As measured, one per output.
    pub outputs: Vec<Range>,
    /// Rates of the states, one per state.
    pub rates: Vec<Range>,
    /// Usual step of the recordings, s.
    pub step: f64,
    /// Length of a recording, s.
    pub duration: f64,
    /// Lines in the spectrum of the residual, Hz, strongest first.
    pub lines: Vec<f64>,
}

/// An effect at a place.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its name in the vocabulary.
    pub kind: &'static str,
    /// Its place.
    pub at: String,
    /// What it changes; the values are one start of the fit.
    pub patches: Vec<Patch>,
    /// What it says as an equation, with parameter names.
    pub equation: String,
    /// Names of kinds it is a special case of.
    pub within: &'static [&'static str],
}

struct Draft<'a> {
    ground: &'a Ground<'a>,
    out: Vec<Candidate>,
}

/// One parameter of a draft: role, suffix of its name, dimension, range, starts.
struct P {
    role: &'static str,
    suffix: &'static str,
    dimension: Option<Dimension>,
    range: Option<[f64; 2]>,
    starts: Vec<f64>,
}

fn p(role: &'static str, suffix: &'static str, dimension: Option<Dimension>, starts: &[f64]) -> P {
    P { role, suffix, dimension, range: None, starts: starts.to_vec() }
}

impl P {
    fn within(mut self, low: f64, high: f64) -> Self {
        self.range = Some([low, high]);
        for start in &mut self.starts {
            *start = start.clamp(low, high);
        }
        self
    }
}

impl Draft<'_> {
    /// Adds a candidate; `write` makes the patch from the names of its parameters.
    fn add(
        &mut self,
        (kind, at): (&'static str, &str),
        params: &[P],
        within: &'static [&'static str],
        write: impl Fn(&[String]) -> (Patch, String),
    ) {
        let model = self.ground.model;
        let names: Vec<String> =
            params.iter().map(|p| fresh(model, &format!("{at}_{}", p.suffix))).collect();
        let (patch, equation) = write(&names);
        let n_starts = params.iter().map(|p| p.starts.len()).max().unwrap_or(1);
        let patches = (0..n_starts)
            .map(|i| Patch {
                title: format!("{kind}({at})"),
                params: params
                    .iter()
                    .zip(&names)
                    .map(|(p, name)| NewParam {
                        role: p.role,
                        name: name.clone(),
                        dimension: p.dimension,
                        range: p.range,
                        value: p.starts[i.min(p.starts.len() - 1)],
                        std: None,
                    })
                    .collect(),
                ..patch.clone()
            })
            .collect();
        self.out.push(Candidate { kind, at: at.into(), patches, equation, within });
    }
}

/// Which states are velocities, with the state they are the rate of.
pub fn velocities(ground: &Ground) -> Vec<(usize, Option<usize>)> {
    let model = ground.compiled;
    let n = model.states.len();
    let of = |v: usize| (0..n).find(|&q| q != v && model.rates[q] == model.state_regs[v]);
    (0..n)
        .filter_map(|v| {
            let dimension = model.units.of(&model.states[v].name);
            let by_unit =
                dimension.is_some_and(|d| d == Dimension::SPEED || d == Dimension::ANGULAR_SPEED);
            if let Some(q) = of(v) {
                return Some((v, Some(q)));
            }
            // Without units a state that goes both ways and is not the integral of another may be one.
            let position = (0..n).any(|w| w != v && model.rates[v] == model.state_regs[w]);
            let open = dimension.is_none() && !position && ground.states[v].changes_sign();
            (by_unit || open).then_some((v, None))
        })
        .collect()
}

/// Every candidate for a model.
pub fn candidates(ground: &Ground) -> Vec<Candidate> {
    let mut draft = Draft { ground, out: Vec::new() };
    if ground.compiled.states.is_empty() {
        friction_of_inputs(&mut draft);
    } else {
        friction(&mut draft);
        stiffness(&mut draft);
        levels(&mut draft);
        disturbances(&mut draft);
    }
    inputs(&mut draft);
    outputs(&mut draft);
    draft.out
}

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
    let role = if dry == "coulomb_friction" { "torque" } else { "coefficient" };
    draft.add(
        (dry, at),
        &[p(role, "dry", rate_dim, &[0.1 * rate])],
        &["asymmetric_friction", "stribeck_friction"],
        |n| write(format!("{sign} {}*sign({v})", n[0])),
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
    let least = 0.002 * rms;
    draft.add(
        (stribeck, at),
        &[
            p("torque", "kinetic", rate_dim, &[0.1 * rate, 0.1 * rate]).within(0.0, 1e3 * rate),
            p("stiction", "static", rate_dim, &[0.2 * rate, 0.2 * rate]).within(0.0, 1e3 * rate),
            p("velocity", "stribeck", v_dim, &[0.1 * rms, 0.4 * rms]).within(least, 3.0 * rms),
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

fn friction(draft: &mut Draft) {
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
            let both = ground.states[s].changes_sign();
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
fn friction_of_inputs(draft: &mut Draft) {
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
            // What rubs in one direction only looks like a constant there; its sign is still the motion's.
            let both = ground.inputs[i].span() > 0.0;
            let about =
                (ground.inputs[i], ground.outputs[o].rms.max(1e-12), output.dimension, *dimension);
            let at =
                if model.outputs.len() == 1 { input.clone() } else { format!("{input}_{out}") };
            rubbing(draft, names, (&at, input), about, both, &write, "+");
        }
    }
}

fn stiffness(draft: &mut Draft) {
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
        // Bouc-Wen with a force between -alpha and alpha, reached within `width` of a reversal.
        let loop_state = fresh(ground.model, &format!("{qn}_loop"));
        let span = ground.states[q].span().max(1e-12);
        draft.add(
            ("hysteresis", &qn),
            &[
                p("alpha", "hysteresis", rate_dim, &[0.1 * rate, 0.1 * rate, 0.3 * rate]),
                p("width", "width", qd, &[0.03 * span, 0.2 * span, 0.1 * span])
                    .within(0.002 * span, 2.0 * span),
            ],
            &[],
            |n| {
                let (mut patch, equation) = write(format!("- {}*{loop_state}", n[0]));
                let rate = format!(
                    "{vn}/{0}*(1 - 0.5*abs({loop_state})*(1 + sign({vn}*{loop_state})))",
                    n[1]
                );
                patch.states.push((loop_state.clone(), rate.clone()));
                (patch, format!("{equation}, {loop_state}' = {rate}"))
            },
        );
    }
}

/// Vessels that run over: the state spills what is above a level, and what is spilt may go on.
fn levels(draft: &mut Draft) {
    let ground = draft.ground;
    let model = ground.compiled;
    let found = velocities(ground);
    for (s, state) in model.states.iter().enumerate() {
        let mechanical = found.iter().any(|(v, q)| *v == s || *q == Some(s));
        let range = ground.states[s];
        if mechanical || range.low < -0.05 * range.span() || range.span() <= 0.0 {
            continue;
        }
        let name = state.name.clone();
        let dimension = model.units.of(&name);
        // Over the brim a level falls back within half a step of the recording; quicker would shake a step of RK4.
        let brim = crate::units::significant(2.0 / ground.step, 2);
        let spill = fresh(ground.model, &format!("{name}_spill"));
        let at = |part: f64| range.low + part * range.span();
        let starts = [at(0.95), at(0.85), at(0.7), at(0.5)];
        let level = || {
            p("level", "full", dimension, &starts).within(at(0.05), at(1.0) + 0.02 * range.span())
        };
        let next: Vec<String> = model
            .states
            .iter()
            .filter(|other| other.name != name)
            .filter(|other| {
                ground.model.equations.iter().any(|e| {
                    e.name.text == other.name
                        && crate::language::names_in(&e.formula)
                            .iter()
                            .any(|n| depends(ground.model, n, &name))
                })
            })
            .map(|other| other.name.clone())
            .collect();
        let write = |n: &[String], to: Option<&String>| {
            let mut patch = Patch::default();
            patch.lets.push((spill.clone(), format!("{brim}*max({name} - {}, 0)", n[0])));
            patch.rates.push((name.clone(), format!("- {spill}")));
            let mut equation = format!("{name} spills above {}", n[0]);
            if let Some(to) = to {
                patch.rates.push((to.clone(), format!("+ {}*{spill}", n[1])));
                equation = format!("{equation}, {} of it goes on to {to}", n[1]);
            }
            (patch, equation)
        };
        draft.add(("overflow", &name), &[level()], &[], |n| write(n, None));
        for to in &next {
            let share = p("share", "share", Some(Dimension::NONE), &[0.5]).within(0.0, 3.0);
            draft.add(("overflow", &name), &[level(), share], &[], |n| write(n, Some(to)));
        }
    }
}

/// Whether a name is `state` or is defined by it.
fn depends(model: &ModelItem, name: &str, state: &str) -> bool {
    name == state
        || model.lets.iter().any(|l| {
            l.name.text == name
                && crate::language::names_in(&l.formula)
                    .iter()
                    .any(|n| n != name && depends(model, n, state))
        })
}

fn disturbances(draft: &mut Draft) {
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
                    .within(1e-9, 0.5 / ground.step),
                p("phase", "hum_phase", Some(Dimension::ANGLE), &phases),
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

fn inputs(draft: &mut Draft) {
    let ground = draft.ground;
    for (i, (name, dimension)) in ground.compiled.inputs.iter().enumerate() {
        let range = ground.inputs[i];
        if range.span() <= 0.0 && range.rms <= 0.0 {
            continue;
        }
        let size = range.rms.max(1e-12);
        let wrap = |template: String| {
            let equation = format!("{name} acts as {}", template.replace("{}", name));
            (Patch { input: Some((name.clone(), template)), ..Patch::default() }, equation)
        };
        draft.add(
            ("input_offset", name),
            &[p("value", "offset", *dimension, &[0.05 * size])],
            &[],
            |n| wrap(format!("{{}} + {}", n[0])),
        );
        draft.add(
            ("input_gain", name),
            &[p("gain", "gain", Some(Dimension::NONE), &[1.05])],
            &[],
            |n| wrap(format!("{}*{{}}", n[0])),
        );
        if range.span() <= 0.0 {
            continue;
        }
        let peak = range.low.abs().max(range.high.abs());
        draft.add(
            ("input_saturation", name),
            &[p("limit", "limit", *dimension, &[0.9 * peak, 0.7 * peak, 0.5 * peak])
                .within(0.02 * peak, peak)],
            &[],
            |n| wrap(format!("clamp({{}}, -{0}, {0})", n[0])),
        );
        if range.changes_sign() {
            draft.add(
                ("input_deadzone", name),
                &[p("width", "deadzone", *dimension, &[0.05 * size, 0.3 * size]).within(0.0, peak)],
                &[],
                |n| wrap(format!("deadzone({{}}, {})", n[0])),
            );
        }
        let step = ground.step;
        let longest = 0.1 * ground.duration;
        draft.add(
            ("input_delay", name),
            &[p("delay", "delay", Some(Dimension::TIME), &[2.0 * step, 8.0 * step, 30.0 * step])
                .within(0.0, longest.max(2.0 * step))],
            &[],
            |n| wrap(format!("delay({{}}, {})", n[0])),
        );
        if ground.compiled.states.is_empty() {
            continue;
        }
        let lagged = fresh(ground.model, &format!("{name}_lagged"));
        draft.add(
            ("lag", name),
            &[p("time", "lag", Some(Dimension::TIME), &[2.0 * step, 10.0 * step, 50.0 * step])
                .within(0.5 * step, ground.duration)],
            &[],
            |n| {
                let (mut patch, _) = wrap(lagged.clone());
                let rate = format!("({name} - {lagged})/{}", n[0]);
                patch.states.push((lagged.clone(), rate.clone()));
                (patch, format!("{name} acts as {lagged}, {lagged}' = {rate}"))
            },
        );
    }
}

fn outputs(draft: &mut Draft) {
    let ground = draft.ground;
    for (o, output) in ground.compiled.outputs.iter().enumerate() {
        let (name, dimension) = (&output.name, output.dimension);
        let range = ground.outputs[o];
        let size = range.rms.max(1e-12);
        let wrap = |template: String| {
            let equation = format!("{name} = {}", template.replace("{}", "what the model says"));
            (Patch { output: Some((name.clone(), template)), ..Patch::default() }, equation)
        };
        draft.add(
            ("output_offset", name),
            &[p("value", "offset", dimension, &[0.05 * size])],
            &[],
            |n| wrap(format!("{{}} + {}", n[0])),
        );
        draft.add(
            ("output_gain", name),
            &[p("gain", "gain", Some(Dimension::NONE), &[1.05])],
            &[],
            |n| wrap(format!("{}*({{}})", n[0])),
        );
        let per_time = dimension.map(|d| d / Dimension::TIME);
        draft.add(
            ("output_drift", name),
            &[p("rate", "drift", per_time, &[0.05 * size / ground.duration.max(1e-12)])],
            &[],
            |n| wrap(format!("{{}} + {}*t", n[0])),
        );
        if range.span() > 0.0 {
            let at = |part: f64| range.low + part * range.span();
            draft.add(
                ("output_saturation", name),
                &[p("limit", "limit", dimension, &[at(0.98), at(0.9)]).within(at(0.3), at(1.05))],
                &[],
                |n| wrap(format!("min({{}}, {})", n[0])),
            );
        }
        if ground.compiled.states.is_empty() {
            continue;
        }
        let step = ground.step;
        draft.add(
            ("sensor_delay", name),
            &[p("delay", "delay", Some(Dimension::TIME), &[2.0 * step, 8.0 * step, 30.0 * step])
                .within(0.0, (0.1 * ground.duration).max(2.0 * step))],
            &[],
            |n| wrap(format!("delay({{}}, {})", n[0])),
        );
        let lagged = fresh(ground.model, &format!("{name}_lagged"));
        let formula = ground.model.outputs[o].formula.clone();
        let _ = formula;
        draft.add(
            ("lag", name),
            &[p("time", "lag", Some(Dimension::TIME), &[2.0 * step, 10.0 * step, 50.0 * step])
                .within(0.5 * step, ground.duration)],
            &[],
            |n| {
                // The sensor is a state of its own that runs after what it measures.
                let patch = Patch {
                    states: vec![(lagged.clone(), format!("({{{name}}} - {lagged})/{}", n[0]))],
                    output: Some((name.clone(), lagged.clone())),
                    ..Patch::default()
                };
                (
                    patch,
                    format!(
                        "{name} = {lagged}, {lagged}' = (what the model says - {lagged})/{}",
                        n[0]
                    ),
                )
            },
        );
    }
}
