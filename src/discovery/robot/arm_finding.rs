//! An outcome of the search, worded as a finding: effects, verdict, lines for the model file.

use std::collections::BTreeMap;

use super::colour::coloured_noise;
use super::estimates;
use super::explain::ArmGap;
use super::links::Carried;
use super::load::Thing;
use super::places::{kept, most_of, places, staying};
use super::power::smallest_visible;
use super::term::{Law, Term};
use super::wording::{self, Explained, Reason, WhyNot};
use crate::discovery::finding::{
    self, Alternative, ESTIMATED, EXPLAINED, Effect, Explains, Finding, Gap, Identified,
    ModelChange, NextExperiment, Parameter, ParameterEstimate, SIGNIFICANT, Value, Verdict,
    Visible, Worth, above_noise,
};
use crate::discovery::selection::{self, Hypothesis, Options, Outcome, Residuals as _, Rival, Set};
use crate::discovery::wording::{cannot_show, nearest};

/// Words an outcome as a finding; `fitted` is what was fitted where that is not all of the recordings.
pub(super) fn answer(
    gap: ArmGap,
    fitted: Option<ArmGap>,
    outcome: &Outcome<Term>,
    options: &Options,
    noise_is_estimated: bool,
    mut notes: Vec<String>,
) -> Finding {
    let judged = Judged::of(&gap, fitted.as_ref(), outcome, options, noise_is_estimated);
    let Judged { mut path, shrink, left, left_at, places, kept, visible, blind, coloured } = judged;
    // The held-out numbers are settled; what is written into the model is fitted to all data.
    let mut all = fitted.unwrap_or(gap);
    let held = std::mem::take(&mut all.heldout);
    all.train.extend(held);
    let Answered { mut effects, lines, identified, number_lines } =
        Answered::of(&all, outcome, options);
    let ambiguous = effects.iter().any(|effect| effect.indistinguishable);
    // Noise that had to be estimated is known to a tenth.
    let is_white = left < SIGNIFICANT
        || (noise_is_estimated && shrink.after.train.max(shrink.after.heldout) < ESTIMATED);
    let rest = if is_white { Rest::Noise } else { coloured.map_or(Rest::More, Rest::Coloured) };
    let (verdict, reason) = verdict(&effects, ambiguous, (left, &left_at, &kept), rest, &shrink);
    // Names that leave most of the gap are a lead to follow, and no part of the model.
    let is_lead = matches!(verdict, Verdict::Unknown | Verdict::ModelInadequate)
        && effects.iter().any(|effect| effect.name != "unknown");
    let added = if is_lead { Vec::new() } else { [number_lines, lines].concat() };
    if verdict == Verdict::ModelInadequate {
        effects.clear();
        path.clear();
    } else if is_lead {
        effects = vec![nearest(&effects, shrink.shrink_heldout, wording::NOTHING_EXPLAINS)];
    }
    let staying = staying(&places, &left_at);
    if !staying.is_empty() && !effects.is_empty() {
        notes.push(wording::stays_at(&staying));
    }
    if left > SIGNIFICANT && !effects.is_empty() {
        notes.push(wording::still_above_noise(left));
    }
    if verdict == Verdict::NothingMissing && !blind.is_empty() {
        notes.push(cannot_show("recordings", &blind));
    }
    if verdict == Verdict::Unknown && effects.is_empty() {
        let at = places.first().map_or_else(|| "robot".into(), |place| place.channel.clone());
        effects.push(Effect::unknown(at, wording::NO_FORMULA));
    }
    let next_experiment =
        ambiguous.then(|| NextExperiment { why: wording::equally_well(&effects), commands: None });
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

/// Returns whether a term is a number of the model: beside links that were identified rotors are, too, for no description of
/// an arm has them.
fn is_number(term: &Term, own: &ArmGap) -> bool {
    own.has_own_links() && term.law == Law::Armature
}

/// What the outcome leaves, judged by the data held out.
struct Judged {
    path: Vec<finding::Step>,
    shrink: Gap,
    /// Standard deviations above noise.
    left: f64,
    left_at: Vec<finding::Channel>,
    places: Vec<finding::Channel>,
    /// What channels keep beside noise, in words.
    kept: String,
    visible: Vec<Visible>,
    /// Effects that would have been seen at no size.
    blind: Vec<String>,
    /// The part of the signal that coloured noise is, if nothing but that is left.
    coloured: Option<f64>,
}

impl Judged {
    fn of(
        gap: &ArmGap,
        fitted: Option<&ArmGap>,
        outcome: &Outcome<Term>,
        options: &Options,
        noise_is_estimated: bool,
    ) -> Self {
        let counts = (gap.count(Set::Train), gap.count(Set::Heldout));
        let split = |h| selection::split(gap, h);
        let (with_numbers, path) = selection::path(gap, outcome, |term| {
            (!is_number(term, gap)).then(|| (term.law.name().into(), term.site(&gap.things)))
        });
        let best = &outcome.best;
        let is_off = best.terms.iter().any(|term| is_number(term, gap));
        let before = if is_off { with_numbers } else { split(&outcome.nothing) };
        let shrink = Gap::of(before, split(best), 1.0);
        let left_at = places(gap, &best.terms, &best.parameters);
        let kept = kept(gap, best);
        let places = places(gap, &[], &outcome.nothing.parameters);
        let left = above_noise(best.heldout, counts.1).max(above_noise(best.train, counts.0));
        let (visible, blind) = if best.terms.is_empty() {
            smallest_visible(fitted.unwrap_or(gap), &outcome.nothing.parameters, options)
        } else {
            (Vec::new(), Vec::new())
        };
        let coloured = if noise_is_estimated && best.terms.is_empty() {
            coloured_noise(gap, best)
        } else {
            None
        };
        Self { path, shrink, left, left_at, places, kept, visible, blind, coloured }
    }
}

/// The effects of an outcome, fitted to all data.
#[derive(Default)]
struct Answered {
    effects: Vec<Effect>,
    /// Their lines of a model file.
    lines: Vec<String>,
    /// Those that are numbers of the model, and their lines.
    identified: Vec<Identified>,
    number_lines: Vec<String>,
}

impl Answered {
    fn of(all: &ArmGap, outcome: &Outcome<Term>, options: &Options) -> Self {
        let (best, things) = (&outcome.best, &all.things);
        // What leaves its range once all data are fitted keeps the numbers by which it was judged.
        let last = fit_all(all, best)
            .filter(|h| selection::is_sensible(all, h))
            .unwrap_or_else(|| best.clone());
        let last = Hypothesis { covariance: all.covariance(&last), ..last };
        let mut found = Self::default();
        let mut unnamed: BTreeMap<usize, usize> = BTreeMap::new();
        for (at, term) in best.terms.iter().enumerate() {
            let estimates = estimates_of(all, &last, at);
            let mine = || outcome.rivals.iter().filter(|rival| rival.instead_of == at);
            let ties: Vec<&Rival<Term>> = mine()
                .filter(|rival| rival.behind < options.tie && !synonym(rival, term))
                .collect();
            if is_number(term, all) {
                found.identified.extend(estimates.iter().map(|estimate| off(all, term, estimate)));
                found.number_lines.push(estimates::line(term, &estimates, things));
                continue;
            }
            let mut own = effect(term, &estimates, things, outcome.worth(at));
            own.alternatives = alternatives(mine(), term, options, all);
            if term.law == Law::TorqueGain && all.is_along() {
                own.alternatives.push(Alternative {
                    name: Law::ActuatorGain.name().into(),
                    at: own.at.clone(),
                    delta_bic: 0.0,
                    why_not: WhyNot::NoCommands.to_string(),
                });
            }
            own.indistinguishable = !ties.is_empty();
            if term.law.is_formula() {
                // The twin has no law for it; a reader of the file should know all the same.
                found.lines.push(format!("// unknown at {}: {}", own.at, own.equation));
            } else if ties.is_empty() {
                found.lines.push(estimates::line(term, &estimates, things));
            }
            // Several formulas at one joint are one unknown effect.
            let is_unnamed = own.name == "unknown";
            if let (true, Some(&first)) = (is_unnamed, unnamed.get(&term.joint)) {
                join(&mut found.effects[first], own, at);
                continue;
            }
            if is_unnamed {
                unnamed.insert(term.joint, found.effects.len());
            }
            found.effects.push(own);
            found.effects.extend(ties.into_iter().map(|rival| tied(all, rival, outcome)));
        }
        found
    }
}

/// Adds a formula to the unknown effect at the same joint.
fn join(first: &mut Effect, own: Effect, at: usize) {
    let more = own.equation.split_once("+= ").map_or("", |(_, more)| more);
    first.equation.push_str(" + ");
    first.equation.push_str(more);
    first
        .parameters
        .extend(own.parameters.into_iter().map(|(name, p)| (format!("{name}_{}", at + 1), p)));
}

/// Tells a rival that explains as much.
fn tied(all: &ArmGap, rival: &Rival<Term>, outcome: &Outcome<Term>) -> Effect {
    let last_at = rival.hypothesis.terms.len() - 1;
    // Another gain goes with other links.
    let is_gain = |term: &Term| term.law == Law::TorqueGain;
    let instead_of = &outcome.best.terms[rival.instead_of];
    let has_others =
        all.has_own_links() && is_gain(instead_of) && is_gain(&rival.hypothesis.terms[last_at]);
    let again = if has_others { None } else { fit_all(all, &rival.hypothesis) };
    let h = again.map(|h| Hypothesis { covariance: all.covariance(&h), ..h });
    let h = h.unwrap_or_else(|| rival.hypothesis.clone());
    let estimates = estimates_of(all, &h, last_at);
    let mut other = effect(&h.terms[last_at], &estimates, &all.things, outcome.worth_of(rival));
    other.indistinguishable = true;
    other
}

/// Tells a rotor as a number of the model: what it knew, and what the recordings say.
fn off(all: &ArmGap, term: &Term, (parameter, more, std, unit): &ParameterEstimate) -> Identified {
    let (terms, values) = &all.known;
    let known = terms.iter().position(|known| known == term).map_or(0.0, |at| {
        values[terms[..at].iter().map(|term| term.law.specs().len()).sum::<usize>()]
    });
    let file = all.train[0].arm.armature[term.joint] + known;
    Identified {
        name: term.law.name().into(),
        at: term.site(&all.things),
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
        reason: wording::no_one_machine(words),
        smallest_visible: Vec::new(),
        notes,
    }
}

/// Words recordings of one machine of which some bear a load: `who` says which.
pub(super) fn loaded(
    gap: &ArmGap,
    carried: &Carried,
    who: &[&str],
    options: &Options,
    notes: Vec<String>,
) -> Finding {
    let outcome = selection::judged(&carried.gap, carried.load.clone(), options);
    let (best, things) = (&outcome.best, &carried.gap.things);
    let estimates = estimates_of(&carried.gap, best, 0);
    let (mass, std) = estimates.first().map_or((0.0, 0.0), |estimate| (estimate.1, estimate.2));
    let reason = wording::bear_more(who, mass, std);
    let [nothing, with] = [&outcome.nothing, best].map(|h| selection::split(&carried.gap, h));
    Finding {
        effects: vec![effect(&best.terms[0], &estimates, things, outcome.worth(0))],
        places: places(&carried.gap, &[], &[]),
        gap: Gap::of(nothing, with, 1.0),
        reason,
        ..different(gap, "", notes)
    }
}

/// Tells an effect.
fn effect(term: &Term, estimates: &[ParameterEstimate], things: &[Thing], worth: Worth) -> Effect {
    let name = term.law.name();
    let equation = wording::equation(term, estimates);
    Effect::new((name, term.site(things)), parameters(name, estimates), worth, equation)
}

/// Returns whether the rival is the same thing under another name, so that no doubt about the machine
/// is left: a shift of the tracker with more or fewer of its numbers free, friction with another corner.
pub(super) fn synonym(rival: &Rival<Term>, chosen: &Term) -> bool {
    let other = rival.hypothesis.terms.last();
    other.is_some_and(|other| {
        other.law.name() == chosen.law.name() && other.site(&[]) == chosen.site(&[])
    })
}

/// More effects than this that together explain too little are no lead either.
const LEADS: usize = 2;

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
    (left, at, kept): (f64, &[finding::Channel], &str),
    of: Rest,
    gap: &Gap,
) -> (Verdict, String) {
    let estimates = |verdict, reason: Reason| (verdict, reason.to_string());
    if effects.is_empty() {
        return match of {
            Rest::Noise => estimates(Verdict::NothingMissing, Reason::Noise),
            Rest::Coloured(part) => estimates(Verdict::NothingMissing, Reason::Coloured(part)),
            Rest::More => estimates(Verdict::Unknown, Reason::Unexplained(left)),
        };
    }
    if ambiguous {
        return estimates(Verdict::Ambiguous, Reason::Doubt);
    }
    let (part, rest) = (gap.shrink_heldout, gap.after.heldout);
    let explained = match gap.explains() {
        Explains::All if kept.is_empty() => Explained::All,
        Explains::All if part >= EXPLAINED => Explained::Most,
        Explains::All | Explains::Part => Explained::Part { part, rest },
        Explains::TooLittle => {
            let is_lead = effects.len() <= LEADS;
            let verdict = if is_lead { Verdict::Unknown } else { Verdict::ModelInadequate };
            let at = &most_of(at);
            return estimates(verdict, Reason::TooLittle { explained: part, rest, at });
        }
    };
    let (verdict, reason) = match effects {
        all if all.iter().all(|effect| effect.name == "unknown") => {
            estimates(Verdict::Unknown, Reason::Formula(explained))
        }
        [one] => estimates(Verdict::Named, Reason::One(one, explained)),
        more => estimates(Verdict::Several, Reason::Several(more.len(), explained)),
    };
    (verdict, reason + kept)
}

/// Returns the numbers of one effect of a hypothesis.
fn estimates_of(gap: &ArmGap, h: &Hypothesis<Term>, at: usize) -> Vec<ParameterEstimate> {
    let before: usize = h.terms[..at].iter().map(|term| term.law.specs().len()).sum();
    let from = gap.nuisance().len() + before;
    let count = h.terms[at].law.specs().len();
    let (term, own) = (&h.terms[at], &h.parameters[from..from + count]);
    let fitted = h.covariance.view((from, from), (count, count)).into_owned();
    let mut covariance = &fitted + gap.drives.covariance(term, own);
    // What the motion does not show stays open, whatever an ampere is worth.
    for i in (0..count).filter(|i| fitted[(*i, *i)] <= 0.0) {
        covariance.row_mut(i).fill(0.0);
        covariance.column_mut(i).fill(0.0);
    }
    let slides = gap.train[0].arm.chain.slides(term.joint);
    estimates::estimates(term, own, &covariance, &gap.things, slides)
}

fn parameters(name: &str, estimates: &[ParameterEstimate]) -> BTreeMap<String, Parameter> {
    let mut grouped = finding::grouped(name, estimates);
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
    all: &ArmGap,
) -> Vec<Alternative> {
    let things = &all.things;
    let mut found: Vec<Alternative> = Vec::new();
    for rival in rivals {
        let Some(term) = rival.hypothesis.terms.last() else { continue };
        let (name, at) = (term.law.name().to_owned(), term.site(things));
        let again = found.iter().any(|other| other.name == name && other.at == at);
        if again || (name == chosen.law.name() && at == chosen.site(things)) {
            continue;
        }
        let is_tied = rival.behind < options.tie;
        let why_not = match rival.behind {
            _ if is_tied => WhyNot::Tied,
            _ if all.contains(term, chosen) => WhyNot::Richer,
            behind => WhyNot::FitsWorse(behind),
        };
        let why_not = why_not.to_string();
        found.push(Alternative { name, at, delta_bic: rival.behind, why_not });
    }
    found.truncate(3);
    // A rigid shift of what the tracker sees has two names.
    if matches!(chosen.law, Law::CameraShift(_)) {
        found.push(Alternative {
            name: "base_shift".into(),
            at: "base".into(),
            delta_bic: 0.0,
            why_not: WhyNot::SeenFromTheOtherSide.to_string(),
        });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discovery::finding::{Evidence, Split};
    use crate::discovery::wording::keep;

    /// Of a square wave a sine "explained the gap", and a sensor kept three times its noise.
    #[test]
    fn what_a_channel_keeps_is_said_beside_the_name() {
        let (site, worth) =
            (("periodic_disturbance", "joint_1".into()), (Evidence::default(), 1.0));
        let effect = Effect::new(site, BTreeMap::new(), worth, String::new());
        let split = |left| Split { train: left, heldout: left };
        let of = |before: f64, after: f64, kept: &str| {
            let gap = Gap::of(split(before), split(after), 1.0);
            verdict(std::slice::from_ref(&effect), false, (190.0, &[], kept), Rest::More, &gap)
        };
        let (named, reason) = of(3.36, 1.7, "");
        assert_eq!(named, Verdict::Named);
        let all = "periodic_disturbance at joint_1 explains the gap, also on data held out";
        assert_eq!(reason, all);
        let kept = keep(&[("tau_1", 1.09, 0.334, "N*m")]);
        let (named, reason) = of(3.36, 1.7, &kept);
        assert_eq!(named, Verdict::Named);
        let (start, end) = reason.split_once("; ").unwrap();
        assert_eq!(start, all.replace("the gap", "most of the gap"));
        assert_eq!(end, "tau_1 keeps 1.09 N*m beside 0.334 N*m of noise");
        let (_, reason) = of(8.0, 2.5, &kept);
        assert!(reason.contains(" 2.5 times the noise") && reason.ends_with(&kept), "{reason}");
    }
}
