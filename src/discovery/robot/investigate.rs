//! From recordings of an arm to a finding: lays the arm out along them, searches, answers.

use super::against::hints;
use super::arm_finding::{answer, synonym};
use super::between;
use super::driven::driven_otherwise;
use super::error::Misfit;
use super::experiment::Experiment;
use super::explain::ArmGap;
use super::found::Found;
use super::laid_out;
use super::links::fit::BETTER;
use super::links::own::Links;
use super::links::{self, Beside, Gain, Own, Turned};
use super::machines;
use super::places::places;
use super::term::{Law, SENSIBLE_GAIN, Term};
use super::traces::traces;
use super::wording;
use crate::discovery::Investigation;
use crate::discovery::finding::{Finding, SIGNIFICANT, Verdict, above_noise};
use crate::discovery::recording::{Error, Recording};
use crate::discovery::selection::{self, Options, Outcome, Residuals as _, Set, sum_of_squares};
use crate::discovery::why::whys;
use crate::language::ast::EffectItem;
use crate::motion::Robot;

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

/// Of an arm simulated with its controller so many effects are looked for at first: with more the simulation is slow and one effect
/// hides another, and where the torques are measured the measured motion tells them apart.
const SIMULATED: usize = 3;

/// What leaves more than this many times the noise of the data fitted, or of those held out, is not explained well.
const POOR: f64 = 1.5;

/// What is found along the measured motion is told if it leaves less than this part of what the simulation leaves, in units of noise.
const LESS: f64 = 0.8;

/// Finds what an arm's model lacks: fits on `train`, judges on `heldout`. An arm whose controller is known is simulated with it;
/// what that does not explain is looked for along the measured motion, where torques were measured.
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
    let all = || train.iter().chain(heldout);
    if !all().all(|recording| is_simulated(recording) && shows_torques(recording)) {
        let found = investigated(robot, known, train, heldout, options, progress);
        let mut found = found.map_err(Trouble::error)?.0;
        if is_explained(&found) {
            return Ok(found);
        }
        let sets = [train, heldout];
        let parted = machines::parted(robot, known, sets, options, &mut found.finding);
        return Ok(parted.map_or(found, told_alone));
    }
    let few = Options { most: options.most.min(SIMULATED), ..*options };
    let simulated = investigated(robot, known, train, heldout, &few, progress);
    // What cannot be judged along the measured motion is judged as it is simulated.
    let mut along = || {
        let [fitted, judged] = [train, heldout].map(|all| all.iter().map(without_commands));
        let (fitted, judged): (Vec<_>, Vec<_>) = (fitted.collect(), judged.collect());
        let found = investigated(robot, known, &fitted, &judged, options, progress).ok();
        found.map(|found| found.0).filter(is_explained)
    };
    let told = |found, why| Ok(told_along(found, why, train, heldout));
    let (simulated, n_found) = match simulated {
        Ok(found) => found,
        Err(Trouble::RanAway(error)) => {
            return along().map_or(Err(error), |found| told(found, wording::along_of_runaway()));
        }
        Err(Trouble::Refused(error)) => return Err(error),
    };
    let along = if is_poor(&simulated) { along() } else { None };
    let left = |found: &Investigation| found.finding.gap.after.heldout;
    let simulated = match along {
        Some(found) if !is_poor(&found) => {
            return told(found, wording::along_instead(left(&simulated)));
        }
        _ if n_found >= few.most && few.most < options.most => {
            let found = investigated(robot, known, train, heldout, options, progress);
            found.map_err(Trouble::error)?.0
        }
        _ => simulated,
    };
    match along.filter(|found| is_poor(&simulated) && left(found) < LESS * left(&simulated)) {
        Some(found) => told(found, wording::along_instead(left(&simulated))),
        None => Ok(simulated),
    }
}

/// Why nothing was found out.
enum Trouble {
    /// The recordings and the model do not go together.
    Refused(Error),
    /// The model becomes infinite along them.
    RanAway(Error),
}

impl From<Error> for Trouble {
    fn from(error: Error) -> Self {
        Self::Refused(error)
    }
}

impl Trouble {
    fn error(self) -> Error {
        match self {
            Self::Refused(error) | Self::RanAway(error) => error,
        }
    }
}

/// Returns whether the recording tells how the arm was driven.
fn is_simulated(recording: &Recording) -> bool {
    recording.sidecar.controller.is_some() && recording.has("q_cmd_1")
}

/// Returns whether the recording tells which torques a measured motion took.
fn shows_torques(recording: &Recording) -> bool {
    recording.has("q_1") && (recording.has("tau_1") || recording.has("current_1"))
}

/// Returns a recording without what the arm was asked for: it is judged along its measured motion then.
fn without_commands(recording: &Recording) -> Recording {
    let mut own = recording.clone();
    own.columns.retain(|column| !column.name.starts_with("q_cmd"));
    own
}

/// Returns whether much more than noise is left.
fn is_poor(found: &Investigation) -> bool {
    let after = found.finding.gap.after;
    after.train.max(after.heldout) > POOR
}

/// Returns whether a finding says what is missing, or that nothing is.
fn is_explained(found: &Investigation) -> bool {
    !matches!(
        found.finding.verdict,
        Verdict::Unknown | Verdict::ModelInadequate | Verdict::DifferentMachines
    )
}

/// Tells a finding that has nothing to be shown beside it.
fn told_alone(finding: Finding) -> Investigation {
    let (traces, whys) = (Vec::new(), Vec::new());
    Investigation { finding, traces, whys, experiment: None, revision: None }
}

/// Notes that what was found was found along the measured motion, and why.
fn told_along(
    mut found: Investigation,
    why: String,
    train: &[Recording],
    heldout: &[Recording],
) -> Investigation {
    let notes = &mut found.finding.notes;
    let of_no_controller = |note: &String| {
        train.iter().chain(heldout).any(|r| *note == wording::no_controller(&r.name))
    };
    notes.retain(|note| !of_no_controller(note));
    notes.insert(0, why);
    found
}

/// Finds what an arm's model lacks, and how many effects the search took for it.
fn investigated(
    robot: &Robot,
    known: &[EffectItem],
    train: &[Recording],
    heldout: &[Recording],
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<(Investigation, usize), Trouble> {
    let (mut gap, mut notes) = laid_out::gap(robot, known, train, heldout)?;
    let place = train.first().map_or("", |recording| &recording.name);
    let runs_away = |misfit: Misfit| Trouble::RanAway(misfit.at(place));
    let options = &searched_with(options, &gap, robot.n_joints());
    progress(wording::IDENTIFYING, 0.0);
    let mut names: Vec<&str> = train.iter().chain(heldout).map(|r| r.name.as_str()).collect();
    machines::settle_delay(&mut gap, &mut notes);
    let numbers = links::identified(&gap).unwrap_or_default();
    if numbers.is_too_short {
        let seconds = train.iter().map(Recording::duration).sum();
        return Err(Misfit::TooShort { seconds }.at(place).into());
    }
    if let Some(turned) = numbers.turned {
        let all = if turned.of_heldout { heldout } else { train };
        let names: Vec<&str> = all.iter().map(|recording| recording.name.as_str()).collect();
        let Turned { joints, left, .. } = turned;
        return Err(Misfit::TorquesAgainst { joints, left }.at(names.join(", ")).into());
    }
    if let Some(finding) = machines::apart(&mut gap, &numbers, [train, heldout], options, &notes) {
        return Ok((told_alone(finding), 0));
    }
    let mut found = found(&mut gap, numbers.own, options, progress).map_err(runs_away)?;
    if let Some(turned) = turned(&gap, &found.outcome) {
        return Err(turned.at(names.join(", ")).into());
    }
    if shows_in_held_out_alone(&gap, &found.outcome) {
        // The motion to fit does not show it, the other does: exchange the two.
        for gap in std::iter::once(&mut gap).chain(&mut found.filed) {
            std::mem::swap(&mut gap.train, &mut gap.heldout);
        }
        names.rotate_left(train.len());
        (found.outcome, found.fitted) = searched(&gap, options, progress).map_err(runs_away)?;
        notes.push(wording::exchanged());
    }
    if gap.laid_out_again(&found.outcome.best) {
        let again = selection::search(&gap, options, progress).map_err(Misfit::searching);
        found.outcome = again.map_err(runs_away)?;
    }
    progress(wording::WRITING, 0.98);
    let is_estimated = train.iter().chain(heldout).any(has_no_noise);
    // More of what explains nothing is not looked for.
    let n_found = if found.is_little(&gap) { 0 } else { found.outcome.best.terms.len() };
    Ok((told(gap, found, &names, options, robot, is_estimated, notes), n_found))
}

/// Returns how to search: along measured motions otherwise than in simulated ones.
fn searched_with(options: &Options, gap: &ArmGap, n_joints: usize) -> Options {
    let mut options = *options;
    // A special case of a law may leave as much as any law that is right.
    options.generality = options.imperfection;
    if gap.train.iter().any(|model| !model.course.closed_loop) {
        // The accelerations of a measured motion have errors of their own, which are not white.
        options.least_gain += MEASURED;
        // Nor is the effects' law: a real arm is never described to the noise of its sensors.
        options.forgiven = f64::INFINITY;
        // Every joint of a real arm has friction of two kinds and a rotor, every sensor an offset, and
        // every link may weigh otherwise.
        options.most = options.most.max(6 * n_joints);
        options.broad = BROAD;
        options.unnamed = UNNAMED;
    }
    options
}

/// Returns whether the data held out show something beyond noise and those fitted nothing.
fn shows_in_held_out_alone(gap: &ArmGap, outcome: &Outcome<Term>) -> bool {
    outcome.best.terms.is_empty()
        && above_noise(outcome.nothing.train, gap.count(Set::Train)) < SIGNIFICANT
        && above_noise(outcome.nothing.heldout, gap.count(Set::Heldout)) > SIGNIFICANT
}

/// Returns whether nobody says how noisy a recording is.
fn has_no_noise(recording: &Recording) -> bool {
    let noise = &recording.sidecar.noise;
    noise.q_rad.is_none() && noise.tau_nm.is_none() && noise.tcp_m.is_none()
}

/// Tells what was found; `names` are those of the recordings, the fitted ones first.
fn told(
    gap: ArmGap,
    found: Found,
    names: &[&str],
    options: &Options,
    robot: &Robot,
    noise_is_estimated: bool,
    mut notes: Vec<String>,
) -> Investigation {
    let otherwise = driven_otherwise(&gap, &found.outcome.best);
    if !otherwise.is_empty() {
        notes.push(wording::another_controller(&otherwise));
    }
    let (gap, found) = if found.is_worse(&gap) {
        notes.push(wording::not_borne_out());
        found.without(gap)
    } else if found.is_little(&gap) {
        notes.push(wording::too_little_for_a_list(found.outcome.best.terms.len()));
        found.without(gap)
    } else {
        (gap, found)
    };
    let Found { outcome, fitted, own, filed } = found;
    let changed = between::changed(&gap, &outcome.best, names);
    let traces = traces(filed.as_ref().unwrap_or(&gap), &gap, &outcome, names);
    let whys = whys(&gap, &outcome, options.tie);
    let experiment = experiment(&gap, &outcome, options, robot);
    let chain = gap.train[0].arm.chain.clone();
    let mut finding = answer(gap, fitted, &outcome, options, noise_is_estimated, notes);
    // Of what is not explained it is asked whether one machine is seen at all.
    if !matches!(finding.verdict, Verdict::Unknown | Verdict::ModelInadequate) {
        finding.notes.splice(0..0, changed);
    }
    let revision = own.as_ref().map(|links| links.revision(&chain));
    if let (Some(links), Some(filed)) = (own, filed) {
        finding.notes.push(wording::links_first());
        finding.notes.extend(links.far);
        let (left, places) = (selection::left(&filed), places(&filed, &[], &[]));
        finding = finding.identified_first(links.told, left, places);
    }
    if let Some(next) = &mut finding.next_experiment {
        let separation = experiment.as_ref().map(|experiment| experiment.separation);
        next.why.push_str(&wording::in_proposed_motion(separation));
    }
    finding.notes.extend(hints(&finding, &traces));
    let experiment = experiment.map(|experiment| experiment.csv);
    Investigation { finding, traces, whys, experiment, revision }
}

/// Returns which sensor an outcome takes for one that says the opposite of what acts, within what a gain may be: no sensor does.
fn turned(gap: &ArmGap, outcome: &Outcome<Term>) -> Option<Misfit> {
    let best = &outcome.best;
    let mut at = gap.nuisance().len();
    best.terms.iter().find_map(|term| {
        let gain = best.parameters[at];
        at += gap.specs(term).len();
        let is_turned = term.law == Law::TorqueGain && SENSIBLE_GAIN.contains(&-gain);
        is_turned.then_some(Misfit::TorqueTurned { joint: term.joint, gain })
    })
}

/// Searches with the numbers that fit the recordings, which `gap` has from then on.
fn found(
    gap: &mut ArmGap,
    numbers: Option<Own>,
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Found, Misfit> {
    let Own { links, beside } = numbers.unwrap_or_default();
    if let Some(Beside { terms, links }) = beside {
        let with = WithLinks::searched(gap, links, options, progress)?;
        // Links that go with what the search does not find again are wrong.
        let has = |term| with.outcome.best.terms.contains(term);
        if terms.iter().all(has) && is_less(&with.outcome, gap) {
            return Ok(with.found(gap));
        }
    }
    let Some((links, mut gains)) = links else {
        let (outcome, fitted) = searched(gap, options, progress)?;
        return Ok(Found { outcome, fitted, own: None, filed: None });
    };
    if gains.first().is_some_and(|gain| gain.links.is_better) {
        let Gain { links, joint, explained, .. } = gains.remove(0);
        let mut with = WithLinks::searched(gap, links, options, progress)?;
        let own = Term { law: Law::TorqueGain, joint };
        let outcome = &mut with.outcome;
        if let Some(at) = outcome.best.terms.iter().position(|term| *term == own) {
            let others = gains.iter().map(|other| other.instead_of(explained, at, &outcome.best));
            outcome.rivals.extend(others);
            outcome.rivals.sort_by(|a, b| a.behind.total_cmp(&b.behind));
            return Ok(with.found(gap));
        }
    }
    if links.is_better {
        let with = WithLinks::searched(gap, links.clone(), options, progress)?;
        if is_less(&with.outcome, gap) {
            return Ok(with.found(gap));
        }
    }
    let (outcome, fitted) = searched(gap, options, progress)?;
    // One link or a load has a name; several weights that are off at once are numbers of the file.
    if n_weights(&outcome) > 1 {
        let with = WithLinks::searched(gap, links, options, progress)?;
        if n_weights(&with.outcome) < n_weights(&outcome)
            && BETTER * with.outcome.best.heldout <= outcome.best.heldout
        {
            return Ok(with.found(gap));
        }
    }
    Ok(Found { outcome, fitted, own: None, filed: None })
}

/// What a search finds beside other links than the file's.
struct WithLinks {
    links: Links,
    gap: ArmGap,
    outcome: Outcome<Term>,
    fitted: Option<ArmGap>,
}

impl WithLinks {
    /// Searches beside `links`, and once more beside those that go with what is found.
    fn searched(
        filed: &ArmGap,
        links: Links,
        options: &Options,
        progress: &mut dyn FnMut(&str, f64),
    ) -> Result<Self, Misfit> {
        let mut of = |links: Links| {
            let gap = filed.with_links(&links);
            let (outcome, fitted) = searched(&gap, options, progress)?;
            Ok(Self { links, gap, outcome, fitted })
        };
        let first = of(links)?;
        let best = &first.outcome.best;
        // What every joint has was beside them from the beginning.
        let is_new = |term: &Term| !links::is_of_joint(term);
        let is_asked = filed.things.is_empty() && best.terms.iter().any(is_new);
        let fitted = first.fitted.as_ref().filter(|_| is_asked);
        let bodies = &filed.train[0].arm.chain.bodies;
        let settled = fitted.and_then(|gap| links::settled(gap, (bodies, &first.links), best));
        let Some(links) = settled else { return Ok(first) };
        let again = of(links)?;
        let is_better = again.outcome.best.evidence() < first.outcome.best.evidence();
        Ok(if is_better { again } else { first })
    }

    /// Returns it as what was found; `gap` has these links from then on.
    fn found(self, gap: &mut ArmGap) -> Found {
        let Self { links, gap: with, outcome, fitted } = self;
        let filed = Some(std::mem::replace(gap, with));
        Found { outcome, fitted, own: Some(links), filed }
    }
}

/// Returns whether links with all that was found beside them leave less than the file by itself.
fn is_less(outcome: &Outcome<Term>, filed: &ArmGap) -> bool {
    let as_filed = filed.residuals(Set::Heldout, &[], &[]).map(|left| sum_of_squares(&left));
    as_filed.is_none_or(|left| outcome.best.heldout < left)
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
) -> Result<(Outcome<Term>, Option<ArmGap>), Misfit> {
    if !gap.is_along() {
        let outcome = selection::search(gap, options, progress).map_err(Misfit::searching)?;
        return Ok((outcome, None));
    }
    let mut fitted = gap.for_search();
    let (usual, floors) = selection::floors(&fitted).ok_or(Misfit::RunsAway)?;
    fitted.soften(&floors);
    let mut outcome =
        selection::search_linear(&fitted, usual, options, progress).map_err(Misfit::searching)?;
    if outcome.best.terms.len() <= FEW {
        // Of a few effects the shapes can be fitted from the beginning, and what no shape on a list explains may be one of them.
        let options = Options { most: 2 * FEW, ..*options };
        if floors.iter().all(|floor| *floor < FAR) {
            fitted = gap.for_search();
        }
        let other = selection::search(&fitted, &options, progress).map_err(Misfit::searching)?;
        selection::judge(&fitted, &mut outcome.best);
        if other.best.evidence() < outcome.best.evidence() {
            outcome = other;
        }
    }
    Ok((selection::upheld(gap, &fitted, outcome, options), Some(fitted)))
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
