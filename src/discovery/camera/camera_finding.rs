//! An outcome of the search, worded as a finding: effects, verdict, lines for the model file.

use std::collections::BTreeMap;

use super::dropped;
use super::explain::CameraGap;
use super::places::places;
use super::power::smallest_visible;
use super::term::Law;
use super::views::Data;
use super::wording::{self, Number};
use crate::discovery::finding::{
    self, Alternative, Effect, Finding, Gap, ModelChange, NextExperiment, Parameter, SIGNIFICANT,
    Verdict, Worth, above_noise,
};
use crate::discovery::selection::{self, Hypothesis, Options, Outcome, Residuals as _, Rival, Set};
use crate::discovery::wording::{NO_MORE, fits_worse};

/// Words an outcome as a finding.
pub(super) fn answer(
    gap: &CameraGap,
    outcome: &Outcome<Law>,
    options: &Options,
    mut notes: Vec<String>,
) -> Finding {
    let best = &outcome.best;
    let counts = [Set::Train, Set::Heldout].map(|set| gap.count(set).max(1));
    let split = |h| selection::split(gap, h);
    let left = above_noise(best.heldout, counts[1]).max(above_noise(best.train, counts[0]));
    let (visible, blind) = if best.terms.is_empty() {
        smallest_visible(gap, options)
    } else {
        (Vec::new(), Vec::new())
    };
    if !blind.is_empty() {
        notes.push(wording::cannot_show(&blind));
    }
    let (mut effects, added) = effects(gap, outcome, options);
    let ambiguous = effects.iter().any(|effect| effect.indistinguishable);
    let (verdict, reason) = verdict(&effects, ambiguous, left);
    if left > SIGNIFICANT && !effects.is_empty() {
        notes.push(wording::still_above(left));
    }
    let places = places(gap);
    if verdict == Verdict::Unknown && effects.is_empty() {
        effects.push(Effect::unknown("camera".into(), wording::NO_FORMULA));
    }
    let next_experiment = ambiguous
        .then(|| NextExperiment { why: wording::equally_well(&doubted(&effects)), commands: None });
    Finding {
        identified: Vec::new(),
        verdict,
        places,
        effects,
        gap: Gap::of(split(&outcome.nothing), split(best), 1.0),
        path: selection::path(gap, outcome, |t| Some((t.name().into(), t.site().into()))).1,
        model: ModelChange { added, ..ModelChange::default() },
        next_experiment,
        reason,
        smallest_visible: visible,
        notes,
    }
}

fn doubted(effects: &[Effect]) -> String {
    let names: Vec<String> = effects
        .iter()
        .filter(|effect| effect.indistinguishable)
        .map(|effect| format!("{}({})", effect.name, effect.at))
        .collect();
    names.join(" and ")
}

/// Words every effect, those that tie with it, and the lines of the model file. The numbers are of a fit to all points:
/// judging is over.
fn effects(
    gap: &CameraGap,
    outcome: &Outcome<Law>,
    options: &Options,
) -> (Vec<Effect>, Vec<String>) {
    let all = CameraGap { data: gap.data.all_fitted(), known: gap.known.clone() };
    // What leaves its range once all points are fitted keeps the numbers by which it was judged.
    let last = |h: &Hypothesis<Law>| {
        let fitted =
            selection::refit(&all, h.terms.clone(), h.parameters.clone(), h.surcharges.clone())
                .filter(|h| selection::is_sensible(&all, h))
                .unwrap_or_else(|| h.clone());
        dropped::doubted(&all, fitted)
    };
    let best = &outcome.best;
    let fitted = last(best);
    let (mut effects, mut lines): (Vec<Effect>, Vec<String>) = (Vec::new(), Vec::new());
    let mut unnamed: Option<usize> = None;
    for (at, law) in best.terms.iter().enumerate() {
        let rivals: Vec<&Rival<Law>> =
            outcome.rivals.iter().filter(|rival| rival.instead_of == at).collect();
        let ties = ties(&rivals, *law, options);
        let estimates = estimates(&all.data, &fitted, at);
        let mut effect = effect(&all.data, *law, &estimates, outcome.worth(at));
        effect.alternatives = alternatives(&all, &rivals, *law, options);
        effect.indistinguishable = !ties.is_empty();
        if let Law::Feature(_) = law {
            lines.push(format!("// unknown at camera: {}", effect.equation));
        } else if ties.is_empty() {
            lines.push(wording::line(*law, &estimates));
        }
        if let (Law::Feature(_), Some(first)) = (law, unnamed) {
            // Several formulas are one unknown effect.
            join(&mut effects[first], &effect);
        } else {
            if matches!(law, Law::Feature(_)) {
                unnamed = Some(effects.len());
            }
            effects.push(effect);
        }
        for rival in ties {
            let h = last(&rival.hypothesis);
            let at = h.terms.len() - 1;
            let estimates = self::estimates(&all.data, &h, at);
            let worth = outcome.worth_of(rival);
            let mut other = self::effect(&all.data, h.terms[at], &estimates, worth);
            other.indistinguishable = true;
            effects.push(other);
        }
    }
    (effects, lines)
}

/// Returns the rivals that the data cannot tell from the law chosen, one a name.
fn ties<'a>(rivals: &[&'a Rival<Law>], chosen: Law, options: &Options) -> Vec<&'a Rival<Law>> {
    let mut found: Vec<&Rival<Law>> = Vec::new();
    for rival in rivals {
        let Some(law) = rival.hypothesis.terms.last() else { continue };
        let again = found
            .iter()
            .any(|other| other.hypothesis.terms.last().is_some_and(|o| o.name() == law.name()));
        if rival.behind < options.tie && law.name() != chosen.name() && !again {
            found.push(rival);
        }
    }
    found
}

fn effect(data: &Data, law: Law, estimates: &[Number], worth: Worth) -> Effect {
    let equation = wording::equation(law, estimates, &data.lens);
    Effect::new((law.name(), law.site().into()), parameters(law, estimates), worth, equation)
}

/// Adds a second formula to the first.
fn join(first: &mut Effect, more: &Effect) {
    first.equation.push_str("; ");
    first.equation.push_str(&more.equation);
    let number = first.parameters.len() + 1;
    for parameter in more.parameters.values() {
        first.parameters.insert(format!("coefficient_{number}"), parameter.clone());
    }
    // Its evidence is that of all its parts.
    first.evidence.delta_bic += more.evidence.delta_bic;
    first.evidence.heldout_gain =
        (first.evidence.heldout_gain + more.evidence.heldout_gain).min(1.0);
    first.heldout_share = first.evidence.heldout_gain.max(0.0);
    first.stability = first.stability.min(more.stability);
}

fn parameters(law: Law, estimates: &[Number]) -> BTreeMap<String, Parameter> {
    let numbers: Vec<(String, f64, f64, String)> =
        estimates.iter().map(|n| (n.name.to_owned(), n.value, n.std, n.unit.to_owned())).collect();
    finding::grouped(law.name(), &numbers)
}

fn estimates(data: &Data, h: &Hypothesis<Law>, at: usize) -> Vec<Number> {
    let from: usize = h.terms[..at].iter().map(|law| law.specs(data.extent).len()).sum();
    let count = h.terms[at].specs(data.extent).len();
    let covariance = h.covariance.view((from, from), (count, count)).into_owned();
    wording::estimates(h.terms[at], &h.parameters[from..from + count], &covariance, data.up())
}

/// Returns the runners-up, one a name.
fn alternatives(
    gap: &CameraGap,
    rivals: &[&Rival<Law>],
    chosen: Law,
    options: &Options,
) -> Vec<Alternative> {
    let mut found: Vec<Alternative> = Vec::new();
    for rival in rivals {
        let Some(law) = rival.hypothesis.terms.last() else { continue };
        let again = found.iter().any(|other| other.name == law.name());
        if again || law.name() == chosen.name() {
            continue;
        }
        let why_not = if rival.behind < options.tie {
            wording::AS_WELL.to_owned()
        } else if law.contains(chosen) && rival.hypothesis.parameters.len() > 1 {
            NO_MORE.to_owned()
        } else {
            fits_worse(rival.behind, "points")
        };
        found.push(Alternative {
            name: law.name().into(),
            at: law.site().into(),
            delta_bic: rival.behind,
            why_not,
        });
    }
    found.truncate(3);
    if matches!(chosen, Law::Table(..)) && gap.data.sights.iter().all(super::views::Sight::on_table)
    {
        found.retain(|other| other.name != "camera_shift");
        found.push(Alternative {
            name: "camera_shift".into(),
            at: "camera".into(),
            delta_bic: 0.0,
            why_not: wording::MOVED_OPPOSITE.into(),
        });
    }
    found
}

fn verdict(effects: &[Effect], ambiguous: bool, left: f64) -> (Verdict, String) {
    if effects.is_empty() {
        return if left < SIGNIFICANT {
            (Verdict::NothingMissing, wording::ALL_NOISE.into())
        } else {
            (Verdict::Unknown, wording::nothing_predicts(left))
        };
    }
    if ambiguous {
        return (Verdict::Ambiguous, wording::SEVERAL_AS_WELL.into());
    }
    if effects.iter().all(|effect| effect.name == "unknown") {
        return (Verdict::Unknown, wording::FORMULA_ONLY.into());
    }
    match effects {
        [one] => (Verdict::Named, wording::explains(&one.name, &one.at)),
        more => (Verdict::Several, wording::explain_together(more.len())),
    }
}
