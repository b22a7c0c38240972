//! The outcome of a search → a finding, for the small models: pours, and things held in the hand; and what is refused of
//! any recording.
//!
//! What is the model's own business is asked of it through [`Worded`]; what a verdict needs, how rivals are told
//! and how large an effect would have been seen is the same for all. How much is explained, and what is said of names that
//! explain too little, is so for arms in motion as well.

use std::fmt;

use super::finding::{
    self, Alternative, Channel, Effect, Explains, Finding, Gap, ModelChange, ParameterEstimate,
    SIGNIFICANT, Verdict, Visible, Worth, above_noise,
};
use super::model_file;
use super::recording::{Error, Recording};
use super::resample;
use super::selection::{
    self, Hypothesis, Options, Outcome, ParameterSpec, Rival, Set, sum_of_squares,
};
use super::vocabulary::{OBJECT_TRACKER, TRACKER, is_tracker};
use crate::units::significant;
use crate::world::Scene;

/// Writes a part of 1 in percent.
pub(super) fn percent(part: f64) -> String {
    significant(100.0 * part, 2)
}

/// Why a law is not named that contains the one that is.
pub(super) const NO_MORE: &str = "explains no more with more numbers: the simpler is named";

/// By how much the criterion, which counts squares and numbers, speaks against a rival; `what` was fitted and held out.
pub(super) fn fits_worse(behind: f64, what: &str) -> String {
    format!("fits worse: its criterion is {behind:.0} higher on the {what} fitted and held out")
}

/// How much of a gap is explained.
#[derive(Clone, Copy)]
pub(super) enum Explained {
    /// All that is not near noise.
    All,
    /// The most of it; some channels keep more than noise ([`keep`]).
    Most,
    /// A part; what is left is `rest` times the noise.
    Part { part: f64, rest: f64 },
}

impl fmt::Display for Explained {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::All => f.write_str("the gap"),
            Self::Most => f.write_str("most of the gap"),
            Self::Part { part, rest } => write!(
                f,
                "{} % of the gap (what is left is {} times the noise)",
                percent(*part),
                significant(*rest, 2)
            ),
        }
    }
}

/// What is said beside how much is explained: which channels keep more than their noise, each with what it keeps, its noise and
/// their unit.
pub(super) fn keep(channels: &[(&str, f64, f64, &str)]) -> String {
    let each = channels.iter().map(|(channel, left, noise, unit)| {
        let [left, noise] = [left, noise].map(|value| significant(*value, 3));
        format!("; {channel} keeps {left} {unit} beside {noise} {unit} of noise")
    });
    each.collect()
}

/// Returns what has no name, with the `leads` that come nearest to it and explain this part of the gap; `why` says that there
/// are leads at most.
pub(super) fn nearest(leads: &[Effect], explained: f64, why: &str) -> Effect {
    let part = percent(explained.max(0.0));
    let lead = |effect: &Effect| Alternative {
        name: effect.name.clone(),
        at: effect.at.clone(),
        delta_bic: effect.evidence.delta_bic,
        why_not: format!("the nearest that has a name, and explains only {part} % of the gap"),
    };
    let at = leads.first().map(|effect| effect.at.clone()).unwrap_or_default();
    Effect { alternatives: leads.iter().map(lead).collect(), ..Effect::unknown(at, why) }
}

/// That an effect of no size would have been seen in what was given, `what`.
pub(super) fn cannot_show(what: &str, blind: &[String]) -> String {
    format!("these {what} cannot show {} of any size", blind.join(", "))
}

/// That an effect of a model file is not of what is looked at, for the reason `why`; a `camera_shift` of that sits at `mine`.
pub(super) fn left_aside((name, at): (&str, &str), why: &str, mine: &str) -> String {
    let left = format!("effect {name}({at}) {why} and is left aside");
    if name != "camera_shift" {
        return left;
    }
    let seer = |at: &str| match at {
        TRACKER => "what sees the tip",
        OBJECT_TRACKER => "what sees a thing in the hand",
        _ => "the scene's camera",
    };
    let axes = if is_tracker(at) { "the base's axes" } else { "its own axes" };
    format!(
        "{left}: it says where {} stands, in {axes}; of {} it would be `{name}({mine})`",
        seer(at),
        seer(mine)
    )
}

/// Nothing was given to be looked at.
pub(super) fn no_recording() -> Error {
    Error::new("there is no recording", "command line", "name at least one CSV file")
}

/// A thing that the scene does not have.
pub(super) fn no_such(name: &str, recording: &Recording, scene: &Scene) -> Error {
    let known: Vec<&str> = scene.objects.iter().map(|object| object.name.as_str()).collect();
    Error::new(
        format!("`{name}` is not in the scene `{}`", scene.name),
        &recording.name,
        format!("it has {}", known.join(", ")),
    )
}

/// A gap whose effects have names, places and equations.
pub(super) trait Worded: selection::Residuals {
    /// Returns an effect's name in the vocabulary.
    fn name(&self, term: &Self::Term) -> &'static str;
    /// Returns where it sits.
    fn site(&self, term: &Self::Term) -> String;
    /// Returns where it sits in a model file.
    fn seat(&self, term: &Self::Term) -> String {
        self.site(term)
    }
    /// Returns whether two are the same thing with more or fewer of its numbers, between which there is no doubt.
    fn is_same(&self, a: &Self::Term, b: &Self::Term) -> bool {
        let _ = (a, b);
        false
    }
    /// Returns its equation; `estimates` are its numbers in everyday units.
    fn equation(&self, term: &Self::Term, estimates: &[ParameterEstimate]) -> String;
    /// Returns the numbers of one effect of a hypothesis.
    fn estimates(&self, h: &Hypothesis<Self::Term>, at: usize) -> Vec<ParameterEstimate> {
        let before: usize = h.terms[..at].iter().map(|term| self.specs(term).len()).sum();
        let from = self.nuisance().len() + before;
        let of = |(i, spec): (usize, &ParameterSpec)| {
            let variance = h.covariance.get((from + i, from + i)).copied().unwrap_or(f64::NAN);
            let (value, std) = (h.parameters[from + i], variance.max(0.0).sqrt());
            (spec.name.to_owned(), value, std, spec.unit.to_owned())
        };
        self.specs(&h.terms[at]).iter().enumerate().map(of).collect()
    }
    /// Returns how large the gap of each channel is, and when, largest share first.
    fn places(&self, nothing: &Hypothesis<Self::Term>) -> Vec<Channel>;
    /// Returns how many standard deviations a sum of squares lies above what noise alone would leave.
    fn above(&self, sum: f64, count: usize) -> f64 {
        above_noise(sum, count)
    }
    /// Returns where what an effect explains is read, if that is read once and no part of the gap, which is told of rows that
    /// decide nothing.
    fn apart(&self, term: &Self::Term) -> Option<&'static str> {
        let _ = term;
        None
    }
    /// Returns the reason given when nothing is missing.
    fn nothing(&self) -> &'static str;
    /// Returns what to do when several effects explain the same.
    fn doubt(&self) -> &'static str;
}

/// Returns what each of `n` recordings is for: the last is held out; one alone is for both, second by second.
pub(super) fn sets(n: usize) -> Vec<Option<Set>> {
    let one = |at| if at + 1 == n { Set::Heldout } else { Set::Train };
    (0..n).map(|at| (n > 1).then(|| one(at))).collect()
}

/// Returns what a row of a recording is for, `seconds` after its first one.
pub(super) fn set_of(recording: Option<Set>, seconds: f64, row: usize, rows: usize) -> Set {
    let Some(set) = recording else {
        let second = seconds as usize;
        return match (second.is_multiple_of(2), resample::is_unseen_alone(second / 2)) {
            (true, _) => Set::Train,
            (false, is_unseen) => {
                if is_unseen {
                    Set::Unseen
                } else {
                    Set::Heldout
                }
            }
        };
    };
    if set == Set::Heldout && resample::is_unseen(row, rows) { Set::Unseen } else { set }
}

/// Words an outcome.
pub(super) fn answer<G: Worded>(
    gap: &G,
    outcome: &Outcome<G::Term>,
    options: &Options,
    mut notes: Vec<String>,
) -> Finding {
    let best = &outcome.best;
    let counts = (gap.count(Set::Train), gap.count(Set::Heldout));
    let split = |h| selection::split(gap, h);
    let shrink = Gap::of(split(&outcome.nothing), split(best), 1.0);
    let left = gap.above(best.heldout, counts.1).max(gap.above(best.train, counts.0));
    let explains = if left < SIGNIFICANT { Explains::All } else { shrink.explains() };
    let (mut effects, mut leads) = (Vec::new(), Vec::new());
    let mut lines = Vec::new();
    for (at, term) in best.terms.iter().enumerate() {
        let is_other = |rival: &&Rival<G::Term>| {
            let last = rival.hypothesis.terms.last();
            rival.instead_of == at && !last.is_some_and(|other| gap.is_same(other, term))
        };
        let rivals = || outcome.rivals.iter().filter(is_other);
        let ties: Vec<_> = rivals().filter(|rival| rival.behind < options.tie).collect();
        let mut own = effect(gap, best, at, outcome.worth(at));
        // What is read once is as sure whatever the gap is.
        if explains == Explains::TooLittle && gap.apart(term).is_none() {
            leads.push(own);
            continue;
        }
        own.alternatives = rivals()
            .filter_map(|rival| {
                let other = rival.hypothesis.terms.last()?;
                let why_not = if rival.behind < options.tie {
                    "explains the data as well; these recordings do not tell the two apart"
                        .to_owned()
                } else {
                    fits_worse(rival.behind, "data")
                };
                let (name, at) = (gap.name(other).to_owned(), gap.site(other));
                Some(Alternative { name, at, delta_bic: rival.behind, why_not })
            })
            .take(3)
            .collect();
        own.indistinguishable = !ties.is_empty();
        if ties.is_empty() {
            let estimates = everyday(&gap.estimates(best, at));
            lines.push(model_file::line(gap.name(term), &gap.seat(term), &estimates));
        }
        effects.push(own);
        for rival in ties {
            let h = &rival.hypothesis;
            let mut other = effect(gap, h, h.terms.len() - 1, outcome.worth_of(rival));
            other.indistinguishable = true;
            effects.push(other);
        }
    }
    if left > SIGNIFICANT && !best.terms.is_empty() {
        notes.push(format!(
            "what is left is still above noise ({left:.0} standard deviations of its sum of squares)"
        ));
    }
    let apart: Vec<&str> = best.terms.iter().filter_map(|term| gap.apart(term)).collect();
    let is_apart = !apart.is_empty() && apart.len() == best.terms.len();
    let (part, rest) = (shrink.shrink_heldout, shrink.after.heldout);
    let (verdict, mut reason) = match explains {
        Explains::TooLittle => (Verdict::Unknown, too_little(&leads, &effects, (part, rest), left)),
        _ if is_apart => verdict(gap, &effects, left, READ),
        Explains::All => verdict(gap, &effects, left, &Explained::All.to_string()),
        Explains::Part => verdict(gap, &effects, left, &Explained::Part { part, rest }.to_string()),
    };
    if !apart.is_empty() {
        reason.push_str(&apart_of_the_gap(&apart));
    }
    if !leads.is_empty() {
        effects.push(nearest(&leads, part, NO_NAME));
    }
    let visible = if best.terms.is_empty() { visible(gap, outcome, options) } else { Vec::new() };
    Finding {
        verdict,
        places: gap.places(&outcome.nothing),
        effects,
        gap: shrink,
        path: selection::path(gap, outcome, |t| Some((gap.name(t).into(), gap.site(t)))).1,
        model: ModelChange { added: lines, ..ModelChange::default() },
        next_experiment: None,
        reason,
        smallest_visible: visible,
        identified: Vec::new(),
        notes,
    }
}

/// Tells one effect of a hypothesis.
fn effect<G: Worded>(gap: &G, h: &Hypothesis<G::Term>, at: usize, worth: Worth) -> Effect {
    let term = &h.terms[at];
    let estimates = gap.estimates(h, at);
    let equation = gap.equation(term, &everyday(&estimates));
    let parameters = finding::grouped(gap.name(term), &estimates);
    Effect::new((gap.name(term), gap.site(term)), parameters, worth, equation)
}

/// Returns the numbers as people write them: what is poured is in millilitres.
fn everyday(estimates: &[ParameterEstimate]) -> Vec<ParameterEstimate> {
    let of = |(name, value, std, unit): &ParameterEstimate| match unit.as_str() {
        "m^3" => (name.clone(), value * 1e6, std * 1e6, "mL".to_owned()),
        _ => (name.clone(), *value, *std, unit.clone()),
    };
    estimates.iter().map(of).collect()
}

/// What is said of numbers that are read once: at each of `places`.
fn apart_of_the_gap(places: &[&str]) -> String {
    let mut places = places.to_vec();
    places.dedup();
    format!("; {} is read once and is no part of the gap in numbers", places.join(" and "))
}

/// What names explain of which nothing is part of the gap in numbers.
const READ: &str = "what was read of it";
/// That there are leads at most.
const NO_NAME: &str = "no effect that has a name explains it";

/// That effects, with their places, explain what is said next.
fn explain(effects: &[Effect]) -> String {
    let name = |effect: &Effect| format!("{} at {}", effect.name, effect.at);
    let names: Vec<String> = effects.iter().map(name).collect();
    let explain = if effects.len() == 1 { "explains" } else { "together explain" };
    format!("{} {explain}", names.join(" and "))
}

/// That most of a gap has no name: the `leads` explain a part of it and leave so many times the noise; `read` are the names of
/// what is no part of it. What is left is `left` standard deviations above noise.
fn too_little(leads: &[Effect], read: &[Effect], (part, rest): (f64, f64), left: f64) -> String {
    let found = if leads.is_empty() {
        format!("the gap is {left:.0} standard deviations above noise, but no effect explains it")
    } else {
        format!(
            "{} only {} % of the gap on data held out and {} {} times the noise: {NO_NAME}",
            explain(leads),
            percent(part.max(0.0)),
            if leads.len() == 1 { "leaves" } else { "leave" },
            significant(rest, 2)
        )
    };
    if read.is_empty() {
        return found;
    }
    format!("{} {READ}, and {found}", explain(read))
}

/// `what` they explain, if there are any.
fn verdict<G: Worded>(gap: &G, effects: &[Effect], left: f64, what: &str) -> (Verdict, String) {
    match effects {
        [] if left < SIGNIFICANT => (Verdict::NothingMissing, gap.nothing().into()),
        [] => (Verdict::Unknown, too_little(&[], &[], (0.0, 0.0), left)),
        several if several.iter().any(|effect| effect.indistinguishable) => (
            Verdict::Ambiguous,
            format!("several effects explain this equally well; {}", gap.doubt()),
        ),
        all => {
            let verdict = if all.len() == 1 { Verdict::Named } else { Verdict::Several };
            (verdict, format!("{} {what}, also on data held out", explain(all)))
        }
    }
}

/// A change that is small yet visible must do more than this, in units of noise, or no change of that kind is seen.
const BLIND: f64 = 1e-2;

/// Returns how small a change of each number would have been seen.
fn visible<G: Worded>(gap: &G, outcome: &Outcome<G::Term>, options: &Options) -> Vec<Visible> {
    let own = &outcome.nothing.parameters;
    let Some(base) = gap.residuals(Set::Train, &[], own) else { return Vec::new() };
    let count = base.len() as f64;
    let mut found: Vec<Visible> = Vec::new();
    for candidate in gap.candidates(&[], &base, None) {
        let specs = gap.specs(&candidate.term);
        // A threshold that nothing reached has no size that would have been seen.
        let Some(neutral) = specs[0].neutral else { continue };
        let mut moved = candidate.starts[0].clone();
        moved[0] = neutral + specs[0].scale;
        if moved[0] > specs[0].range.1 {
            moved[0] = neutral - specs[0].scale;
        }
        let parameters = [&own[..], &moved].concat();
        let Some(with) =
            gap.residuals(Set::Train, std::slice::from_ref(&candidate.term), &parameters)
        else {
            continue;
        };
        let change: Vec<f64> = with.iter().zip(&base).map(|(a, b)| a - b).collect();
        let strength = sum_of_squares(&change).sqrt() / specs[0].scale;
        if strength * specs[0].scale > BLIND {
            let needed = options.least_gain + specs.len() as f64 * count.ln();
            let visible = Visible {
                name: gap.name(&candidate.term).into(),
                at: gap.site(&candidate.term),
                parameter: specs[0].name.into(),
                least: (needed.sqrt() / strength).max(specs[0].least),
                unit: specs[0].unit.into(),
            };
            // What is tried with more or fewer numbers free is seen by the form that asks least.
            let is_same = |told: &&mut Visible| {
                (&told.name, &told.at, &told.parameter)
                    == (&visible.name, &visible.at, &visible.parameter)
            };
            match found.iter_mut().find(is_same) {
                Some(told) => told.least = told.least.min(visible.least),
                None => found.push(visible),
            }
        }
    }
    found
}
