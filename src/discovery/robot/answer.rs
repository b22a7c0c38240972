//! From recordings of an arm to a finding.

use std::collections::BTreeMap;

use super::chain::Chain;
use super::data::{Channel, Data, Quantity};
use super::experiment::Experiment;
use super::explain::ArmGap;
use super::plant::{Arm, Scene};
use super::simulate::Model;
use super::term::{Law, Term};
use super::wording::{self, Told};
use crate::discovery::finding::{
    self, Alternative, Effect, Evidence, Finding, Gap, ModelChange, NextExperiment, Parameter,
    Split, Value, Verdict, Visible,
};
use crate::discovery::recording::{Error, Recording};
use crate::discovery::selection::{
    self, Gap as _, Hypothesis, Options, Outcome, Rival, Set, sum_of_squares,
};
use crate::discovery::{Investigation, Trace};
use crate::language::ast::EffectItem;
use crate::motion::Robot;
use crate::units::significant;

/// A misfit this many standard deviations of χ² above its expectation is no noise.
const SIGNIFICANT: f64 = 5.0;

/// What an effect must explain more when the motion is not simulated but measured, in units of the
/// criterion; chosen so that arms without a hidden effect raise no alarm.
const MEASURED: f64 = 16.0;

impl Arm {
    /// Returns the arm a recording was made with.
    ///
    /// # Errors
    ///
    /// An [`Error`] for a robot that is no chain, or a sidecar whose lists are not of its length.
    pub fn of(robot: &Robot, recording: &Recording) -> Result<Self, Error> {
        let sidecar = &recording.sidecar;
        let n = robot.n_joints();
        let wrong = |what: String, help: &str| Error {
            what,
            place: recording.name.clone(),
            help: help.into(),
        };
        let gravity = sidecar.gravity.unwrap_or(crate::motion::dynamics::GRAVITY);
        let chain = Chain::new(robot, sidecar.tip.as_deref(), gravity)
            .map_err(|what| wrong(what, "name the robot's file and tip, or another robot"))?;
        if !sidecar.armature.is_empty() && sidecar.armature.len() < n {
            let given = sidecar.armature.len();
            return Err(wrong(
                format!("`armature_kg_m2` has {given} values, the robot {n} joints"),
                "give one value per joint",
            ));
        }
        if let Some(controller) = &sidecar.controller {
            let limits = controller.torque_limit_nm.len();
            if controller.kp_nm_per_rad.len() != n || (limits != 0 && limits != n) {
                return Err(wrong(
                    format!(
                        "the controller is for {} joints, the robot has {n}",
                        controller.kp_nm_per_rad.len()
                    ),
                    "give one gain and one limit per joint; is it the right robot?",
                ));
            }
            if !matches!(controller.kind.as_str(), "pd_with_gravity" | "pd") {
                return Err(wrong(
                    format!("a controller of type `{}` is not known", controller.kind),
                    "known are `pd_with_gravity` and `pd`; leave the controller out to judge \
                     torques and tip along the measured motion",
                ));
            }
        }
        let mut armature = sidecar.armature.clone();
        armature.resize(n, 0.0);
        Ok(Self {
            chain,
            armature,
            controller: sidecar.controller.clone(),
            torque_sensor: sidecar.torque_sensor,
            joint_names: robot.joints().iter().map(|joint| joint.name.clone()).collect(),
        })
    }
}

/// Finds what an arm's model lacks: fits on `train`, judges on `heldout`.
///
/// # Errors
///
/// An [`Error`] for recordings that hold nothing of this arm, or a model that runs away on them.
pub fn investigate(
    robot: &Robot,
    known: &[EffectItem],
    train: &[Recording],
    heldout: &[Recording],
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Investigation, Error> {
    let mut notes: Vec<String> = Vec::new();
    let mut models = Vec::new();
    for recording in train.iter().chain(heldout) {
        notes.extend(recording.notes.iter().cloned());
        let arm = Arm::of(robot, recording)?;
        let data = Data::new(recording, arm.chain.n())?;
        notes.extend(data.notes.iter().cloned());
        let scene = Scene::new(&arm, data);
        if !scene.closed_loop {
            notes.push(format!(
                "{}: no controller is known; torque and tip are judged along the measured motion",
                recording.name
            ));
        }
        models.push(Model::new(arm, scene));
    }
    notes.dedup();
    let held = models.split_off(train.len());
    let mut present = (Vec::new(), Vec::new());
    for effect in known {
        let read = super::known::known(effect, robot.n_joints()).map_err(|what| Error {
            what,
            place: format!("effect {}({})", effect.name.text, effect.at.text),
            help: "see the vocabulary of effects for names, places and parameters".into(),
        })?;
        match read {
            Some((term, values)) => {
                present.0.push(term);
                present.1.extend(values);
            }
            None => notes.push(format!(
                "effect {}({}) is not of the arm and is left aside",
                effect.name.text, effect.at.text
            )),
        }
    }
    let mut gap = ArmGap { train: models, heldout: held, known: present };
    let runs_away = |what: String| Error {
        what,
        place: train.first().map_or(String::new(), |recording| recording.name.clone()),
        help: "check the units of the columns, the robot's file and the controller's gains".into(),
    };
    if gap.count(Set::Train) == 0 || gap.count(Set::Heldout) == 0 {
        return Err(Error {
            what: "the recordings hold a motion, but nothing to compare with a model of the arm"
                .into(),
            place: train.first().map_or(String::new(), |recording| recording.name.clone()),
            help: "record torques (`tau_n`) or the tip (`tcp_x`), or say in the sidecar what the \
                   controller is: then positions can be predicted too"
                .into(),
        });
    }
    let mut options = *options;
    if gap.train.iter().any(|model| !model.scene.closed_loop) {
        // The accelerations of a measured motion have errors of their own, which are not white.
        options.least_gain += MEASURED;
    }
    let options = &options;
    let mut outcome = selection::search(&gap, options, progress).map_err(runs_away)?;
    let beyond = |sum: f64, count: usize| (sum - count as f64) / (2.0 * count as f64).sqrt();
    if outcome.best.terms.is_empty()
        && beyond(outcome.nothing.train, gap.count(Set::Train)) < SIGNIFICANT
        && beyond(outcome.nothing.heldout, gap.count(Set::Heldout)) > SIGNIFICANT
    {
        // The motion to fit does not show it, the other does: exchange the two.
        let ArmGap { train, heldout, known } = gap;
        gap = ArmGap { train: heldout, heldout: train, known };
        outcome = selection::search(&gap, options, progress).map_err(runs_away)?;
        notes.push(
            "the data to fit show nothing beyond noise, the data held out do: their roles were \
             exchanged"
                .into(),
        );
    }
    progress("writing the answer", 0.98);
    let traces = traces(&gap, &outcome.best, train.iter().chain(heldout).map(|r| r.name.as_str()));
    let experiment = experiment(&gap, &outcome, options, robot);
    let mut finding = answer(gap, &outcome, options, notes);
    if let Some(next) = &mut finding.next_experiment {
        let detail = match &experiment {
            Some(experiment) => format!(
                "; in the motion proposed they differ by {} standard deviations",
                significant(experiment.separation, 2)
            ),
            None => "; no motion of the arm tells them apart in these channels: measure something \
                     else, such as a second marker on the base or the table"
                .into(),
        };
        next.why.push_str(&detail);
    }
    Ok(Investigation { finding, traces, experiment: experiment.map(|experiment| experiment.csv) })
}

/// Returns the motion that would settle the first doubt, if there is a doubt and such a motion.
fn experiment(
    gap: &ArmGap,
    outcome: &Outcome<Term>,
    options: &Options,
    robot: &Robot,
) -> Option<Experiment> {
    let rival = outcome.rivals.iter().find(|rival| {
        rival.behind < options.tie && !synonym(rival, &outcome.best.terms[rival.instead_of])
    })?;
    // Any seed will do; always the same one, so that the same doubt gets the same motion.
    super::experiment::settle(
        gap.train.first()?,
        robot.joints(),
        [&outcome.best, &rival.hypothesis],
        1,
    )
}

/// Returns measured minus model before and after for every channel of every recording.
fn traces<'a>(
    gap: &ArmGap,
    best: &Hypothesis<Term>,
    names: impl Iterator<Item = &'a str>,
) -> Vec<Trace> {
    let mut found = Vec::new();
    let models = gap.train.iter().map(|m| (m, false)).chain(gap.heldout.iter().map(|m| (m, true)));
    for ((model, held_out), name) in models.zip(names) {
        let all = |terms: &[Term], parameters: &[f64]| {
            let terms = [&gap.known.0[..], terms].concat();
            model.residuals(&terms, &[&gap.known.1[..], parameters].concat())
        };
        let (Some(before), Some(after)) = (all(&[], &[]), all(&best.terms, &best.parameters))
        else {
            continue;
        };
        let data = &model.scene.data;
        let rows = data.n_rows();
        let predicted = data.channels.iter().filter(|c| model.is_predicted(c.quantity));
        for (at, channel) in predicted.enumerate() {
            let in_units = |residuals: &[f64]| {
                residuals[at * rows..(at + 1) * rows].iter().map(|r| r * channel.noise).collect()
            };
            found.push(Trace {
                recording: name.to_owned(),
                channel: channel.name.clone(),
                unit: channel.quantity.unit().to_owned(),
                noise: channel.noise,
                held_out,
                time: data.time.clone(),
                before: in_units(&before),
                after: in_units(&after),
            });
        }
    }
    found
}

/// Words an outcome as a finding.
fn answer(
    gap: ArmGap,
    outcome: &Outcome<Term>,
    options: &Options,
    mut notes: Vec<String>,
) -> Finding {
    let counts = (gap.count(Set::Train), gap.count(Set::Heldout));
    let rms = |sum: f64, count: usize| (sum / count.max(1) as f64).sqrt();
    let split = |h: &Hypothesis<Term>| Split {
        train: rms(h.train, counts.0),
        heldout: rms(h.heldout, counts.1),
    };
    let shrink = Gap::of(split(&outcome.nothing), split(&outcome.best), 1.0);
    let places = places(&gap);
    let beyond = |sum: f64, count: usize| (sum - count as f64) / (2.0 * count as f64).sqrt();
    let left = beyond(outcome.best.heldout, counts.1).max(beyond(outcome.best.train, counts.0));
    let visible =
        if outcome.best.terms.is_empty() { smallest_visible(&gap, options) } else { Vec::new() };
    // The held-out numbers are settled; what is written into the model is fitted to all data.
    let mut all = gap;
    let held = std::mem::take(&mut all.heldout);
    all.train.extend(held);
    let best = &outcome.best;
    let last = fit_all(&all, best).unwrap_or_else(|| best.clone());
    let mut effects: Vec<Effect> = Vec::new();
    let mut lines: Vec<String> = Vec::new();
    let explained = (outcome.nothing.heldout - best.heldout).max(1e-9);
    let mut unnamed: BTreeMap<usize, usize> = BTreeMap::new();
    for (at, term) in best.terms.iter().enumerate() {
        let told = told_of(&last, at);
        let without = &outcome.without[at];
        let mine = || outcome.rivals.iter().filter(|rival| rival.instead_of == at);
        let ties: Vec<&Rival<Term>> =
            mine().filter(|rival| rival.behind < options.tie && !synonym(rival, term)).collect();
        let effect = Effect {
            name: term.law.name().into(),
            at: term.seat(),
            parameters: parameters(term.law.name(), &told),
            evidence: Evidence {
                delta_bic: without.criterion() - best.criterion(),
                heldout_gain: ((without.heldout - best.heldout) / explained).clamp(-1.0, 1.0),
            },
            equation: wording::equation(term, &told),
            alternatives: alternatives(mine(), term, options),
            indistinguishable: !ties.is_empty(),
        };
        if matches!(term.law, Law::Feature(_) | Law::Above | Law::Below) {
            // The twin has no law for it; a reader of the file should know all the same.
            lines.push(format!("// unknown at {}: {}", effect.at, effect.equation));
        } else if ties.is_empty() {
            lines.push(wording::line(term, &told));
        }
        // Several formulas at one joint are one unknown effect.
        let is_unnamed = effect.name == "unknown";
        if let (true, Some(&first)) = (is_unnamed, unnamed.get(&term.joint)) {
            let more = effect.equation.split_once("+= ").map_or("", |(_, more)| more).to_owned();
            effects[first].equation.push_str(" + ");
            effects[first].equation.push_str(&more);
            effects[first].parameters.extend(
                effect.parameters.into_iter().map(|(name, p)| (format!("{name}_{}", at + 1), p)),
            );
            continue;
        }
        if is_unnamed {
            unnamed.insert(term.joint, effects.len());
        }
        effects.push(effect);
        for rival in ties {
            let h = fit_all(&all, &rival.hypothesis).unwrap_or_else(|| rival.hypothesis.clone());
            let last_at = h.terms.len() - 1;
            let other = h.terms[last_at];
            let told = told_of(&h, last_at);
            effects.push(Effect {
                name: other.law.name().into(),
                at: other.seat(),
                parameters: parameters(other.law.name(), &told),
                evidence: Evidence {
                    delta_bic: without.criterion() - rival.hypothesis.criterion(),
                    heldout_gain: ((without.heldout - rival.hypothesis.heldout) / explained)
                        .clamp(-1.0, 1.0),
                },
                equation: wording::equation(&other, &told),
                alternatives: Vec::new(),
                indistinguishable: true,
            });
        }
    }
    let ambiguous = effects.iter().any(|effect| effect.indistinguishable);
    let (verdict, reason) = verdict(&effects, ambiguous, left, best.terms.len());
    if left > SIGNIFICANT && !effects.is_empty() {
        notes.push(format!(
            "what is left is still above noise ({left:.0} standard deviations of its sum of squares)"
        ));
    }
    if verdict == Verdict::Unknown && effects.is_empty() {
        effects.push(Effect {
            name: "unknown".into(),
            at: places.first().map_or_else(|| "robot".into(), |place| place.channel.clone()),
            parameters: BTreeMap::new(),
            evidence: Evidence::default(),
            equation: "no formula predicts data it was not fitted to".into(),
            alternatives: Vec::new(),
            indistinguishable: false,
        });
    }
    let next_experiment = ambiguous.then(|| NextExperiment {
        why: format!(
            "{} explain these data equally well",
            effects
                .iter()
                .filter(|effect| effect.indistinguishable)
                .map(|effect| format!("{}({})", effect.name, effect.at))
                .collect::<Vec<_>>()
                .join(" and ")
        ),
        commands: None,
    });
    Finding {
        verdict,
        places,
        effects,
        gap: shrink,
        model: ModelChange { added: lines, ..ModelChange::default() },
        next_experiment,
        reason,
        smallest_visible: visible,
        notes,
    }
}

/// Returns whether the rival is the same thing under another name, so that no doubt about the machine
/// is left: a shift of the tracker with more or fewer of its numbers free, friction with another corner.
fn synonym(rival: &Rival<Term>, chosen: &Term) -> bool {
    let other = rival.hypothesis.terms.last();
    other
        .is_some_and(|other| other.law.name() == chosen.law.name() && other.seat() == chosen.seat())
}

fn verdict(effects: &[Effect], ambiguous: bool, left: f64, terms: usize) -> (Verdict, String) {
    if terms == 0 {
        return if left < SIGNIFICANT {
            (
                Verdict::NothingMissing,
                "measured minus model is noise, and no effect explains any of it on data it was not \
                 fitted to"
                    .into(),
            )
        } else {
            (
                Verdict::Unknown,
                format!(
                    "the gap is {left:.0} standard deviations above noise, but no effect and no formula \
                     predicts data it was not fitted to"
                ),
            )
        };
    }
    if ambiguous {
        return (
            Verdict::Ambiguous,
            "several effects explain the data equally well; the motion does not tell them apart"
                .into(),
        );
    }
    let unnamed = effects.iter().filter(|effect| effect.name == "unknown").count();
    if unnamed == effects.len() {
        return (
            Verdict::Unknown,
            "no named effect explains the gap; the formula predicts data it was not fitted to"
                .into(),
        );
    }
    match effects {
        [one] => (
            Verdict::Named,
            format!("{} at {} explains the gap, also on data held out", one.name, one.at),
        ),
        more => (
            Verdict::Several,
            format!("{} effects together explain the gap, also on data held out", more.len()),
        ),
    }
}

/// Returns the numbers of one effect of a hypothesis.
fn told_of(h: &Hypothesis<Term>, at: usize) -> Vec<Told> {
    let from: usize = h.terms[..at].iter().map(|term| term.law.slots().len()).sum();
    let count = h.terms[at].law.slots().len();
    let covariance = h.covariance.view((from, from), (count, count)).into_owned();
    wording::told(&h.terms[at], &h.parameters[from..from + count], &covariance)
}

fn parameters(name: &str, told: &[Told]) -> BTreeMap<String, Parameter> {
    let mut grouped = finding::grouped(name, told);
    // A creep that the motion does not show is no number to pass on.
    grouped.retain(|name, parameter| {
        name != "creep"
            || matches!((&parameter.value, &parameter.std),
                (Value::Number(value), Value::Number(std)) if *std > 0.0 && *std < 0.5 * value)
    });
    grouped
}

fn fit_all(all: &ArmGap, h: &Hypothesis<Term>) -> Option<Hypothesis<Term>> {
    selection::refit(all, h.terms.clone(), h.parameters.clone(), h.surcharges.clone())
}

/// Returns the runners-up, one per name and place.
fn alternatives<'a>(
    rivals: impl Iterator<Item = &'a Rival<Term>>,
    chosen: &Term,
    options: &Options,
) -> Vec<Alternative> {
    let mut found: Vec<Alternative> = Vec::new();
    for rival in rivals {
        let Some(term) = rival.hypothesis.terms.last() else { continue };
        let (name, at) = (term.law.name().to_owned(), term.seat());
        let again = found.iter().any(|other| other.name == name && other.at == at);
        if again || (name == chosen.law.name() && at == chosen.seat()) {
            continue;
        }
        let why_not = if rival.behind < options.tie {
            "explains the data as well; the motion does not tell the two apart".to_owned()
        } else {
            format!(
                "leaves a sum of squares larger by {:.0} on the data fitted and held out",
                rival.behind
            )
        };
        found.push(Alternative { name, at, delta_bic: rival.behind, why_not });
    }
    found.truncate(3);
    // A rigid shift of what the tracker sees has two names.
    if matches!(chosen.law, Law::CameraShift(_)) {
        found.push(Alternative {
            name: "base_shift".into(),
            at: "base".into(),
            delta_bic: 0.0,
            why_not:
                "the same rigid transform seen from the other side: only a second marker that does \
                      not move with the arm tells which of the two moved"
                    .into(),
        });
    }
    found
}

/// Says how much of the gap each channel carries and what its residual follows.
fn places(gap: &ArmGap) -> Vec<finding::Channel> {
    struct Sum {
        unit: &'static str,
        square: f64,
        noise: f64,
        excess: f64,
        rows: usize,
        follows: (f64, String),
    }
    let mut sums: BTreeMap<(Quantity, usize), (String, Sum)> = BTreeMap::new();
    for model in gap.train.iter().chain(&gap.heldout) {
        let Some(residuals) = model.residuals(&gap.known.0, &gap.known.1) else { continue };
        let data = &model.scene.data;
        let rows = data.n_rows();
        let first = model.scene.first_row;
        let predicted = data.channels.iter().filter(|c| model.is_predicted(c.quantity));
        for (at, channel) in predicted.enumerate() {
            let part = &residuals[at * rows + first..at * rows + model.scene.last_row];
            let square = sum_of_squares(part);
            let entry = sums.entry((channel.quantity, channel.index)).or_insert_with(|| {
                let sum = Sum {
                    unit: channel.quantity.unit(),
                    square: 0.0,
                    noise: channel.noise,
                    excess: 0.0,
                    rows: 0,
                    follows: (0.0, String::new()),
                };
                (channel.name.clone(), sum)
            });
            let sum = &mut entry.1;
            sum.square += square * channel.noise.powi(2);
            sum.excess += square - part.len() as f64;
            sum.rows += part.len();
            let follows = follows(model, channel, part);
            if follows.0 > sum.follows.0 {
                sum.follows = follows;
            }
        }
    }
    let total: f64 = sums.values().map(|(_, sum)| sum.excess.max(0.0)).sum();
    let mut places: Vec<finding::Channel> = sums
        .into_values()
        .map(|(name, sum)| {
            // Within three standard deviations of χ² it is noise.
            let excess = sum.excess > 3.0 * (2.0 * sum.rows as f64).sqrt();
            finding::Channel {
                channel: name,
                rms: (sum.square / sum.rows.max(1) as f64).sqrt(),
                noise: sum.noise,
                unit: sum.unit.into(),
                share: if total > 0.0 { sum.excess.max(0.0) / total } else { 0.0 },
                concentrated_in: if excess { sum.follows.1 } else { "nothing beyond noise".into() },
            }
        })
        .collect();
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places
}

/// Returns what the residual of a channel follows most, with the part it explains.
fn follows(model: &Model, channel: &Channel, part: &[f64]) -> (f64, String) {
    let scene = &model.scene;
    let (data, plant) = (&scene.data, &scene.plant);
    let n = plant.n;
    let first = scene.first_row;
    let at = |values: &[f64], joint: usize| -> Vec<f64> {
        data.time[first..scene.last_row]
            .iter()
            .map(|time| {
                let k = ((time - plant.start) / plant.step).round() as usize;
                values[k.min(plant.len - 1) * n + joint]
            })
            .collect()
    };
    let own = channel.quantity != Quantity::Tip;
    let joints: Vec<usize> = if own { vec![channel.index] } else { (0..n).collect() };
    let mut features: Vec<(String, Vec<f64>)> = vec![
        ("a constant".into(), vec![1.0; part.len()]),
        (
            "time".into(),
            data.time[first..scene.last_row].iter().map(|t| t - data.time[0]).collect(),
        ),
    ];
    for j in joints {
        let (q, dq, ddq) = (at(&plant.q, j), at(&plant.dq, j), at(&plant.ddq, j));
        let load = at(&plant.bias, j);
        let name = |what: &str| what.replace('#', &format!("_{}", j + 1));
        features.push((name("sign(dq#)"), dq.iter().map(|v| (v / 5e-3).tanh()).collect()));
        features.push((name("dq#"), dq.clone()));
        features.push((name("dq#*abs(dq#)"), dq.iter().map(|v| v * v.abs()).collect()));
        features.push((name("ddq#"), ddq));
        features.push((name("q#"), q));
        features.push((name("the load at joint#"), load));
    }
    let total = sum_of_squares(part).max(1e-300);
    let mut best = (0.0, String::from("no single state"));
    for (name, values) in features {
        let norm = sum_of_squares(&values);
        if norm <= 0.0 {
            continue;
        }
        let along: f64 = values.iter().zip(part).map(|(v, r)| v * r).sum();
        let explained = along * along / norm / total;
        if explained > best.0 {
            best = (explained, name);
        }
    }
    let (explained, name) = best;
    let when = segments(model, part);
    let text = if explained > 0.3 {
        format!("{name}, {when}")
    } else {
        format!("no single state, {when}")
    };
    (explained.max(1e-6), text)
}

/// Says in which stretches of time the residual is large.
fn segments(model: &Model, part: &[f64]) -> String {
    let data = &model.scene.data;
    let first = model.scene.first_row;
    let total = sum_of_squares(part).max(1e-300);
    let quarter = part.len().div_ceil(4).max(1);
    let shares: Vec<f64> =
        part.chunks(quarter).map(|chunk| sum_of_squares(chunk) / total).collect();
    match shares.iter().position(|share| *share > 0.7) {
        Some(at) => {
            let from = data.time[first + at * quarter];
            let to = data.time[(first + (at + 1) * quarter).min(data.n_rows()) - 1];
            format!("mostly from {from:.1} s to {to:.1} s")
        }
        None => "all segments".into(),
    }
}

/// Returns how small an effect of each common kind would have been seen: the power of the test.
fn smallest_visible(gap: &ArmGap, options: &Options) -> Vec<Visible> {
    let Some(base) = gap.residuals(Set::Train, &[], &[]) else { return Vec::new() };
    let count = gap.count(Set::Train) as f64;
    let mut visible = Vec::new();
    for candidate in gap.candidates(&[], &base) {
        let law = candidate.term.law;
        let wanted = matches!(
            law,
            Law::Coulomb
                | Law::Viscous
                | Law::Payload
                | Law::TorqueOffset
                | Law::ZeroOffset
                | Law::Compliance
                | Law::CommandDelay
                | Law::ToolOffset
        );
        let slots = law.slots();
        let (Some(slot), Some(start)) = (slots.first(), candidate.starts.first()) else { continue };
        if !wanted {
            continue;
        }
        let mut moved = start.clone();
        moved[0] += slot.scale;
        let Some(with) = gap.residuals(Set::Train, &[candidate.term], &moved) else { continue };
        let difference: Vec<f64> = with.iter().zip(&base).map(|(a, b)| a - b).collect();
        let strength = sum_of_squares(&difference).sqrt() / slot.scale;
        if strength <= 0.0 {
            continue;
        }
        let needed = options.least_gain + slots.len() as f64 * count.ln();
        visible.push(Visible {
            name: law.name().into(),
            at: candidate.term.seat(),
            parameter: slot.name.into(),
            least: needed.sqrt() / strength,
            unit: slot.unit.into(),
        });
    }
    visible
}
