//! From recordings of an arm to a finding: lays the arm out along them, searches, answers.

use rayon::prelude::*;

use super::against::hints;
use super::answer::{answer, different, loaded, synonym};
use super::chain::Chain;
use super::currents;
use super::data::{self, Data};
use super::experiment::Experiment;
use super::explain::ArmGap;
use super::links::{self, Carried, Gain, Links};
use super::load::{Load, Thing};
use super::places::places;
use super::plant::{Arm, Scene};
use super::plausible;
use super::simulate::Model;
use super::term::{Law, Term};
use super::traces::traces;
use crate::discovery::Investigation;
use crate::discovery::finding::{SIGNIFICANT, above_noise};
use crate::discovery::recording::{Error, Recording};
use crate::discovery::selection::{self, Gap as _, Options, Outcome, Set};
use crate::language::ast::EffectItem;
use crate::motion::Robot;
use crate::units::significant;

/// What an effect must explain more when the motion is not simulated but measured, in units of the
/// criterion; chosen so that arms without a hidden effect raise no alarm.
const MEASURED: f64 = 16.0;

/// Which part of what a friction's law may be wrong by a mass must explain more: it is felt by many sensors, the friction
/// by one.
const BROAD: f64 = 0.1;

/// Up to so many effects are searched for once more one after the other.
const FEW: usize = 4;

/// A sensor that leaves this many times its noise whatever is tried is not described by a few effects.
const FAR: f64 = 2.0;

/// How much more a formula must explain than the name in whose place it comes.
const UNNAMED: f64 = 0.1;

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
    let things = things(train.iter().chain(heldout));
    let mut read = Vec::new();
    for recording in train.iter().chain(heldout) {
        let arm = Arm::of(robot, recording)?;
        let data = Data::new(recording, arm.chain.n())?;
        plausible::check(&arm, robot.joints(), &data, &recording.name)?;
        read.push((arm, data));
    }
    data::settle_noise(read.iter_mut().map(|(_, data)| data));
    let mut models = Vec::new();
    for (recording, (arm, data)) in train.iter().chain(heldout).zip(read) {
        notes.extend(recording.notes.iter().cloned());
        notes.extend(data.notes.iter().cloned());
        let scene = Scene::new(&arm, data);
        if !scene.closed_loop {
            notes.push(format!(
                "{}: no controller is known; torque and tip are judged along the measured motion",
                recording.name
            ));
        }
        let carried = recording.sidecar.carried.iter().map(|carried| {
            let at = things.iter().position(|thing| thing.name == carried.object).unwrap_or(0);
            Load::new(&arm, &scene.plant, carried, at, things[at].mass)
        });
        let loads = carried.collect();
        models.push(Model::new(arm, scene, loads));
    }
    notes.dedup();
    let place = train.first().map_or("", |recording| &recording.name);
    notes.extend(currents::turned(&mut models, train.len(), place)?);
    for (model, recording) in models.iter().zip(train.iter().chain(heldout)) {
        plausible::check_torques(model, &recording.name)?;
    }
    let held = models.split_off(train.len());
    let mut present = (Vec::new(), Vec::new());
    for effect in known {
        let thing = things.iter().position(|thing| thing.name == effect.at.text);
        let heavier = effect.parameters.iter().find(|parameter| parameter.name.text == "mass");
        if let ("object_mass", Some(joint), Some(mass)) =
            (effect.name.text.as_str(), thing, heavier)
        {
            present.0.push(Term { law: Law::ObjectMass, joint });
            present.1.push(mass.value.quantity.value - things[joint].mass);
            continue;
        }
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
    let mut gap = ArmGap {
        train: models,
        heldout: held,
        known: present,
        things,
        unexplained: Default::default(),
        settled: Vec::new(),
    };
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
    // A special case of a law may leave as much as any law that is right.
    options.generality = options.imperfection;
    if gap.train.iter().any(|model| !model.scene.closed_loop) {
        // The accelerations of a measured motion have errors of their own, which are not white.
        options.least_gain += MEASURED;
        // Nor is the effects' law: a real arm is never described to the noise of its sensors.
        options.forgiven = f64::INFINITY;
        // Every joint of a real arm has friction of two kinds and a rotor, every sensor an offset, and
        // every link may weigh otherwise.
        options.most = options.most.max(6 * robot.n_joints());
        options.broad = BROAD;
        options.unnamed = UNNAMED;
    }
    let options = &options;
    progress("identifying the links", 0.0);
    let mut names: Vec<&str> = train.iter().chain(heldout).map(|r| r.name.as_str()).collect();
    let numbers = links::identified(&gap).unwrap_or_default();
    let differs =
        |finding| Investigation { finding, traces: Vec::new(), experiment: None, revision: None };
    if numbers.are_apart
        && let Some((carried, of_train)) = bearing(&mut gap)
    {
        let who = if of_train { train } else { heldout };
        let who: Vec<&str> = who.iter().map(|recording| recording.name.as_str()).collect();
        return Ok(differs(loaded(&gap, &carried, &who.join(", "), options, notes)));
    }
    if let Some(words) = &numbers.different {
        return Ok(differs(different(&gap, words, notes)));
    }
    let found = found(&mut gap, numbers.own, options, progress).map_err(runs_away)?;
    let Found { mut outcome, mut fitted, own, mut filed } = found;
    if outcome.best.terms.is_empty()
        && above_noise(outcome.nothing.train, gap.count(Set::Train)) < SIGNIFICANT
        && above_noise(outcome.nothing.heldout, gap.count(Set::Heldout)) > SIGNIFICANT
    {
        // The motion to fit does not show it, the other does: exchange the two.
        for gap in std::iter::once(&mut gap).chain(&mut filed) {
            std::mem::swap(&mut gap.train, &mut gap.heldout);
        }
        names.rotate_left(train.len());
        (outcome, fitted) = searched(&gap, options, progress).map_err(runs_away)?;
        notes.push(
            "the data to fit show nothing beyond noise, the data held out do: their roles were \
             exchanged"
                .into(),
        );
    }
    if gap.laid_out_again(&outcome.best) {
        outcome = selection::search(&gap, options, progress).map_err(runs_away)?;
    }
    progress("writing the answer", 0.98);
    let traces = traces(filed.as_ref().unwrap_or(&gap), &gap, &outcome, &names);
    let experiment = experiment(&gap, &outcome, options, robot);
    let is_estimated = |recording: &Recording| {
        let noise = &recording.sidecar.noise;
        noise.q_rad.is_none() && noise.tau_nm.is_none() && noise.tcp_m.is_none()
    };
    let is_estimated = train.iter().chain(heldout).any(is_estimated);
    let chain = gap.train[0].arm.chain.clone();
    let mut finding = answer(gap, fitted, &outcome, options, is_estimated, notes);
    let revision = own.as_ref().map(|links| links.revision(&chain));
    if let (Some(links), Some(filed)) = (own, filed) {
        let first = "the numbers of the links are identified first; what is missing is looked for beside them";
        finding.notes.push(first.into());
        finding.notes.extend(links.far);
        let (left, places) = (selection::left(&filed), places(&filed, &[], &[]));
        finding = finding.identified_first(links.told, left, places);
    }
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
    finding.notes.extend(hints(&finding, &traces));
    let experiment = experiment.map(|experiment| experiment.csv);
    Ok(Investigation { finding, traces, experiment, revision })
}

/// Returns the load that the recordings held out bear, or those fitted, which then change their places; and whether it is those.
fn bearing(gap: &mut ArmGap) -> Option<(Carried, bool)> {
    for of_train in [false, true] {
        if let Some(carried) = links::carried(gap) {
            return Some((carried, of_train));
        }
        std::mem::swap(&mut gap.train, &mut gap.heldout);
    }
    None
}

/// What the search found, beside which numbers.
struct Found {
    outcome: Outcome<Term>,
    fitted: Option<ArmGap>,
    /// The links' numbers, where the file's are left.
    own: Option<Links>,
    /// The gap with the file's, then.
    filed: Option<ArmGap>,
}

/// Searches with the numbers that fit the recordings, which `gap` has from then on.
fn found(
    gap: &mut ArmGap,
    numbers: Option<(Links, Vec<Gain>)>,
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Found, String> {
    let Some((links, mut gains)) = numbers else {
        let (outcome, fitted) = searched(gap, options, progress)?;
        return Ok(Found { outcome, fitted, own: None, filed: None });
    };
    if gains.first().is_some_and(|gain| gain.links.is_better) {
        let gain = gains.remove(0);
        let with = gap.with_links(&gain.links);
        let (mut outcome, fitted) = searched(&with, options, progress)?;
        let own = Term { law: Law::TorqueGain, joint: gain.joint };
        if let Some(at) = outcome.best.terms.iter().position(|term| *term == own) {
            let others = gains.iter().map(|other| other.instead_of(&gain, at, &outcome.best));
            outcome.rivals.extend(others);
            outcome.rivals.sort_by(|a, b| a.behind.total_cmp(&b.behind));
            let filed = Some(std::mem::replace(gap, with));
            return Ok(Found { outcome, fitted, own: Some(gain.links), filed });
        }
    }
    if links.is_better {
        let with = gap.with_links(&links);
        let filed = Some(std::mem::replace(gap, with));
        let (outcome, fitted) = searched(gap, options, progress)?;
        return Ok(Found { outcome, fitted, own: Some(links), filed });
    }
    let (outcome, fitted) = searched(gap, options, progress)?;
    // One link or a load has a name; several weights that are off at once are numbers of the file.
    if n_weights(&outcome) > 1 {
        let with = gap.with_links(&links);
        let (other, its) = searched(&with, options, progress)?;
        if n_weights(&other) < n_weights(&outcome)
            && links::BETTER * other.best.heldout <= outcome.best.heldout
        {
            let filed = Some(std::mem::replace(gap, with));
            return Ok(Found { outcome: other, fitted: its, own: Some(links), filed });
        }
    }
    Ok(Found { outcome, fitted, own: None, filed: None })
}

/// Returns how many weights were found to be off.
fn n_weights(outcome: &Outcome<Term>) -> usize {
    let terms = outcome.best.terms.iter();
    terms.filter(|term| matches!(term.law, Law::LinkMass | Law::Payload)).count()
}

/// Searches; returns what was found, and the gap it was fitted to where that is not all of the recordings.
fn searched(
    gap: &ArmGap,
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<(Outcome<Term>, Option<ArmGap>), String> {
    if !gap.is_along() {
        return Ok((selection::search(gap, options, progress)?, None));
    }
    let mut fitted = gap.for_search();
    let runs_away = "the model runs away on the data; check its parameters and units";
    let (usual, floors) = selection::floors(&fitted).ok_or(runs_away)?;
    fitted.soften(&floors);
    let mut outcome = selection::search_linear(&fitted, usual, options, progress)?;
    if outcome.best.terms.len() <= FEW {
        // Of a few effects the shapes can be fitted from the beginning, and what no shape on a list explains may be one of them.
        let options = Options { most: 2 * FEW, ..*options };
        if floors.iter().all(|floor| *floor < FAR) {
            fitted = gap.for_search();
        }
        let other = selection::search(&fitted, &options, progress)?;
        selection::judge(&fitted, &mut outcome.best);
        if other.best.evidence() < outcome.best.evidence() {
            outcome = other;
        }
    }
    let ties = outcome.rivals.iter_mut().filter(|rival| rival.behind < options.tie);
    let told = [&mut outcome.nothing, &mut outcome.best].into_iter().chain(&mut outcome.without);
    let told: Vec<_> = told.chain(ties.map(|rival| &mut rival.hypothesis)).collect();
    told.into_par_iter().for_each(|hypothesis| selection::judge(gap, hypothesis));
    Ok((outcome, Some(fitted)))
}

/// Returns what was carried in any of the recordings, each thing once.
fn things<'a>(recordings: impl Iterator<Item = &'a Recording>) -> Vec<Thing> {
    let mut found: Vec<Thing> = Vec::new();
    for carried in recordings.flat_map(|recording| &recording.sidecar.carried) {
        if found.iter().all(|thing| thing.name != carried.object) {
            found.push(Thing { name: carried.object.clone(), mass: carried.mass_kg });
        }
    }
    found
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
