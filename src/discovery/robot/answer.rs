//! An outcome of the search, worded as a finding: effects, verdict, lines for the model file.

use std::collections::BTreeMap;

use super::colour::coloured_noise;
use super::explain::ArmGap;
use super::links::Carried;
use super::load::Thing;
use super::places::{most_of, places, staying};
use super::power::smallest_visible;
use super::term::{Law, Term};
use super::wording;
use crate::discovery::finding::{
    self, Alternative, Effect, Finding, Gap, Identified, ModelChange, NextExperiment, Parameter,
    SIGNIFICANT, Told, Value, Verdict, Worth, above_noise,
};
use crate::discovery::selection::{self, Gap as _, Hypothesis, Options, Outcome, Rival, Set};
use crate::units::significant;

/// Words an outcome as a finding; `fitted` is what was fitted where that is not all of the recordings.
pub(super) fn answer(
    gap: ArmGap,
    fitted: Option<ArmGap>,
    outcome: &Outcome<Term>,
    options: &Options,
    noise_is_estimated: bool,
    mut notes: Vec<String>,
) -> Finding {
    let counts = (gap.count(Set::Train), gap.count(Set::Heldout));
    let split = |h| selection::split(&gap, h);
    // Beside links that were identified rotors are numbers of the model, too: no description of an arm has them.
    let is_number = |term: &Term, own: &ArmGap| own.has_own_links() && term.law == Law::Armature;
    let (with_numbers, mut path) = selection::path(&gap, outcome, |term| {
        (!is_number(term, &gap)).then(|| (term.law.name().into(), term.seat(&gap.things)))
    });
    let is_off = outcome.best.terms.iter().any(|term| is_number(term, &gap));
    let before = if is_off { with_numbers } else { split(&outcome.nothing) };
    let shrink = Gap::of(before, split(&outcome.best), 1.0);
    let left_at = places(&gap, &outcome.best.terms, &outcome.best.parameters);
    let places = places(&gap, &[], &outcome.nothing.parameters);
    let left =
        above_noise(outcome.best.heldout, counts.1).max(above_noise(outcome.best.train, counts.0));
    let visible = if outcome.best.terms.is_empty() {
        smallest_visible(fitted.as_ref().unwrap_or(&gap), &outcome.nothing.parameters, options)
    } else {
        Vec::new()
    };
    let coloured = if noise_is_estimated && outcome.best.terms.is_empty() {
        coloured_noise(&gap, &outcome.best)
    } else {
        None
    };
    // The held-out numbers are settled; what is written into the model is fitted to all data.
    let mut all = fitted.unwrap_or(gap);
    let held = std::mem::take(&mut all.heldout);
    all.train.extend(held);
    let best = &outcome.best;
    let things = all.things.clone();
    // What leaves its range once all data are fitted keeps the numbers by which it was judged.
    let last = fit_all(&all, best)
        .filter(|h| selection::is_sensible(&all, h))
        .unwrap_or_else(|| best.clone());
    let mut effects: Vec<Effect> = Vec::new();
    let mut lines: Vec<String> = Vec::new();
    let (mut identified, mut number_lines) = (Vec::new(), Vec::new());
    let mut unnamed: BTreeMap<usize, usize> = BTreeMap::new();
    for (at, term) in best.terms.iter().enumerate() {
        let told = told_of(&all, &last, at);
        let mine = || outcome.rivals.iter().filter(|rival| rival.instead_of == at);
        let ties: Vec<&Rival<Term>> =
            mine().filter(|rival| rival.behind < options.tie && !synonym(rival, term)).collect();
        if is_number(term, &all) {
            identified.extend(told.iter().map(|told| off(&all, term, told)));
            number_lines.push(wording::line(term, &told, &things));
            continue;
        }
        let mut own = effect(term, &told, &things, outcome.worth(at));
        own.alternatives = alternatives(mine(), term, options, &things);
        if term.law == Law::TorqueGain && all.is_along() {
            own.alternatives.push(Alternative {
                name: Law::ActuatorGain.name().into(),
                at: own.at.clone(),
                delta_bic: 0.0,
                why_not: "the same where nobody recorded what the drive was told: only its commands tell whether \
                          the drive gives less or the sensor shows more"
                    .into(),
            });
        }
        own.indistinguishable = !ties.is_empty();
        if term.law.is_formula() {
            // The twin has no law for it; a reader of the file should know all the same.
            lines.push(format!("// unknown at {}: {}", own.at, own.equation));
        } else if ties.is_empty() {
            lines.push(wording::line(term, &told, &things));
        }
        // Several formulas at one joint are one unknown effect.
        let is_unnamed = own.name == "unknown";
        if let (true, Some(&first)) = (is_unnamed, unnamed.get(&term.joint)) {
            let more = own.equation.split_once("+= ").map_or("", |(_, more)| more).to_owned();
            effects[first].equation.push_str(" + ");
            effects[first].equation.push_str(&more);
            effects[first].parameters.extend(
                own.parameters.into_iter().map(|(name, p)| (format!("{name}_{}", at + 1), p)),
            );
            continue;
        }
        if is_unnamed {
            unnamed.insert(term.joint, effects.len());
        }
        effects.push(own);
        for rival in ties {
            let last_at = rival.hypothesis.terms.len() - 1;
            // Another gain goes with other links.
            let is_gain = |term: &Term| term.law == Law::TorqueGain;
            let has_others =
                all.has_own_links() && is_gain(term) && is_gain(&rival.hypothesis.terms[last_at]);
            let again = if has_others { None } else { fit_all(&all, &rival.hypothesis) };
            let h = again.unwrap_or_else(|| rival.hypothesis.clone());
            let other = h.terms[last_at];
            let told = told_of(&all, &h, last_at);
            let mut other = effect(&other, &told, &things, outcome.worth_of(rival));
            other.indistinguishable = true;
            effects.push(other);
        }
    }
    let ambiguous = effects.iter().any(|effect| effect.indistinguishable);
    // Noise that had to be estimated is known to a tenth.
    let is_white = left < SIGNIFICANT
        || (noise_is_estimated && shrink.after.train.max(shrink.after.heldout) < ESTIMATED);
    let rest = if is_white { Rest::Noise } else { coloured.map_or(Rest::More, Rest::Coloured) };
    let (verdict, reason) = verdict(&effects, ambiguous, (left, &left_at), rest, &shrink);
    // Names that leave most of the gap are a lead to follow, and no part of the model.
    let is_lead = matches!(verdict, Verdict::Unknown | Verdict::ModelInadequate)
        && effects.iter().any(|effect| effect.name != "unknown");
    let added = if is_lead { Vec::new() } else { [number_lines, lines].concat() };
    if verdict == Verdict::ModelInadequate {
        effects.clear();
        path.clear();
    } else if is_lead {
        effects = vec![nearest(&effects, shrink.shrink_heldout)];
    }
    let staying = staying(&places, &left_at);
    if !staying.is_empty() && !effects.is_empty() {
        notes.push(format!(
            "most of the gap stays at {}: check these columns first (order, sign, unit), then the gains of their drives",
            staying.join(", ")
        ));
    }
    if left > SIGNIFICANT && !effects.is_empty() {
        notes.push(format!(
            "what is left is still above noise ({left:.0} standard deviations of its sum of squares)"
        ));
    }
    if verdict == Verdict::Unknown && effects.is_empty() {
        let at = places.first().map_or_else(|| "robot".into(), |place| place.channel.clone());
        effects.push(Effect::unknown(at, "no formula predicts data it was not fitted to"));
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
        identified,
        verdict,
        places,
        effects,
        gap: shrink,
        path,
        model: ModelChange { added, ..ModelChange::default() },
        next_experiment,
        reason,
        smallest_visible: visible,
        notes,
    }
}

/// Tells a rotor as a number of the model: what it knew, and what the recordings say.
fn off(all: &ArmGap, term: &Term, (parameter, more, std, unit): &Told) -> Identified {
    let (terms, values) = &all.known;
    let known = terms.iter().position(|known| known == term).map_or(0.0, |at| {
        values[terms[..at].iter().map(|term| term.law.slots().len()).sum::<usize>()]
    });
    let file = all.train[0].arm.armature[term.joint] + known;
    Identified {
        name: term.law.name().into(),
        at: term.seat(&all.things),
        parameter: parameter.clone(),
        file,
        value: file + more,
        std: *std,
        unit: unit.clone(),
    }
}

/// Words recordings that are not of one machine.
pub(super) fn different(gap: &ArmGap, words: &str, notes: Vec<String>) -> Finding {
    let split = selection::left(gap);
    Finding {
        identified: Vec::new(),
        verdict: Verdict::DifferentMachines,
        places: places(gap, &[], &[]),
        effects: Vec::new(),
        gap: Gap::of(split, split, 1.0),
        path: Vec::new(),
        model: ModelChange::default(),
        next_experiment: None,
        reason: format!(
            "{words}; no model of one machine holds for both, so nothing is looked for: compare recordings of the \
             same arm, with the same load in the same place"
        ),
        smallest_visible: Vec::new(),
        notes,
    }
}

/// Words recordings of one machine of which some bear a load: `who` says which.
pub(super) fn loaded(
    gap: &ArmGap,
    carried: &Carried,
    who: &str,
    options: &Options,
    notes: Vec<String>,
) -> Finding {
    let outcome = selection::judged(&carried.gap, carried.load.clone(), options);
    let (best, things) = (&outcome.best, &carried.gap.things);
    let told = told_of(&carried.gap, best, 0);
    let (mass, std) = told.first().map_or((0.0, 0.0), |told| (told.1, told.2));
    let reason = format!(
        "{who} bear {} ± {} kg more at the tool than the others; with it one model holds for all of them, so nothing else \
         is looked for: compare recordings with the same load",
        significant(mass, 3),
        significant(std, 1)
    );
    let [nothing, with] = [&outcome.nothing, best].map(|h| selection::split(&carried.gap, h));
    Finding {
        effects: vec![effect(&best.terms[0], &told, things, outcome.worth(0))],
        places: places(&carried.gap, &[], &[]),
        gap: Gap::of(nothing, with, 1.0),
        reason,
        ..different(gap, "", notes)
    }
}

/// Returns what has no name, with those that come nearest to it.
fn nearest(leads: &[Effect], explained: f64) -> Effect {
    let part = significant(100.0 * explained.max(0.0), 2);
    let lead = |effect: &Effect| Alternative {
        name: effect.name.clone(),
        at: effect.at.clone(),
        delta_bic: effect.evidence.delta_bic,
        why_not: format!("the nearest that has a name, and explains only {part} % of the gap"),
    };
    let at = leads.first().map_or_else(|| "robot".into(), |effect| effect.at.clone());
    let nothing = "no effect that has a name, and no formula, explains it";
    Effect { alternatives: leads.iter().map(lead).collect(), ..Effect::unknown(at, nothing) }
}

/// Tells an effect.
fn effect(term: &Term, told: &[Told], things: &[Thing], worth: Worth) -> Effect {
    let name = term.law.name();
    let equation = wording::equation(term, told);
    Effect::new((name, term.seat(things)), parameters(name, told), worth, equation)
}

/// Returns whether the rival is the same thing under another name, so that no doubt about the machine
/// is left: a shift of the tracker with more or fewer of its numbers free, friction with another corner.
pub(super) fn synonym(rival: &Rival<Term>, chosen: &Term) -> bool {
    let other = rival.hypothesis.terms.last();
    other.is_some_and(|other| {
        other.law.name() == chosen.law.name() && other.seat(&[]) == chosen.seat(&[])
    })
}

/// Effects that explain less than this part of the gap are not what is missing.
const EXPLAINED: f64 = 0.5;

/// More effects than this that together do not explain it are no lead either.
const LEADS: usize = 2;

/// A gap that is smaller than this many times the noise is told as explained; it is at the noise or near it.
const NEAR_NOISE: f64 = 2.0;

/// Noise estimated from a channel is that near to what it is.
const ESTIMATED: f64 = 1.1;

/// What is left.
#[derive(Clone, Copy)]
enum Rest {
    Noise,
    /// Coloured noise, this part of the signal.
    Coloured(f64),
    More,
}

fn verdict(
    effects: &[Effect],
    ambiguous: bool,
    (left, at): (f64, &[finding::Channel]),
    of: Rest,
    gap: &Gap,
) -> (Verdict, String) {
    if effects.is_empty() {
        return match of {
            Rest::Noise => (
                Verdict::NothingMissing,
                "measured minus model is noise, and no effect explains any of it on data it was not \
                 fitted to"
                    .into(),
            ),
            Rest::Coloured(part) => (
                Verdict::NothingMissing,
                format!(
                    "measured minus model is coloured noise, correlated from row to row: it is {} % of the signal, as \
                     large throughout, and no effect explains any of it on data it was not fitted to",
                    significant(100.0 * part, 2)
                ),
            ),
            Rest::More => (
                Verdict::Unknown,
                format!(
                    "the gap is {left:.0} standard deviations above noise, but no effect and no formula \
                     predicts data it was not fitted to"
                ),
            ),
        };
    }
    if ambiguous {
        return (
            Verdict::Ambiguous,
            "several effects explain the data equally well; the motion does not tell them apart"
                .into(),
        );
    }
    let is_small = gap.after.heldout < NEAR_NOISE;
    let rest = significant(gap.after.heldout, 2);
    if gap.shrink_heldout < EXPLAINED && !is_small {
        let part = significant(100.0 * gap.shrink_heldout.max(0.0), 2);
        let is_lead = effects.len() <= LEADS;
        return (
            if is_lead { Verdict::Unknown } else { Verdict::ModelInadequate },
            format!(
                "what was found explains only {part} % of the gap on data held out and leaves {rest} times \
                 the noise, most of it at {}; check first the units and the signs of the columns, the robot's file, \
                 its mounting and the gains of the drives",
                most_of(at)
            ),
        );
    }
    let explained = if is_small {
        "the gap".to_owned()
    } else {
        let part = significant(100.0 * gap.shrink_heldout, 2);
        format!("{part} % of the gap (what is left is {rest} times the noise)")
    };
    let unnamed = effects.iter().filter(|effect| effect.name == "unknown").count();
    if unnamed == effects.len() {
        return (
            Verdict::Unknown,
            format!(
                "no named effect explains the gap; the formula explains {explained}, also on data held out"
            ),
        );
    }
    match effects {
        [one] => (
            Verdict::Named,
            format!("{} at {} explains {explained}, also on data held out", one.name, one.at),
        ),
        more => (
            Verdict::Several,
            format!("{} effects together explain {explained}, also on data held out", more.len()),
        ),
    }
}

/// Returns the numbers of one effect of a hypothesis.
fn told_of(gap: &ArmGap, h: &Hypothesis<Term>, at: usize) -> Vec<Told> {
    let before: usize = h.terms[..at].iter().map(|term| term.law.slots().len()).sum();
    let from = gap.nuisance().len() + before;
    let count = h.terms[at].law.slots().len();
    let covariance = h.covariance.view((from, from), (count, count)).into_owned();
    wording::told(&h.terms[at], &h.parameters[from..from + count], &covariance, &gap.things)
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
    things: &[Thing],
) -> Vec<Alternative> {
    let mut found: Vec<Alternative> = Vec::new();
    for rival in rivals {
        let Some(term) = rival.hypothesis.terms.last() else { continue };
        let (name, at) = (term.law.name().to_owned(), term.seat(things));
        let again = found.iter().any(|other| other.name == name && other.at == at);
        if again || (name == chosen.law.name() && at == chosen.seat(things)) {
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
