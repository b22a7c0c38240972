//! Pours → a finding.

use super::data::Pour;
use super::gap::{PourGap, Term};
use crate::discovery::finding::{
    self, Alternative, Channel, Effect, Evidence, Finding, Gap, ModelChange, SIGNIFICANT, Split,
    Told, Verdict, Visible, above_noise,
};
use crate::discovery::model_file;
use crate::discovery::recording::{Error, Recording};
use crate::discovery::selection::{
    self, Gap as _, Hypothesis, Options, Outcome, Set, sum_of_squares,
};
use crate::discovery::{Investigation, Trace};
use crate::language::ast::EffectItem;
use crate::units::significant;
use crate::world::Scene;

/// Finds what a scene's twin lacks of pours: of several the last is held out, of one every second second.
///
/// # Errors
///
/// An [`Error`] for recordings that are no pours, or vessels the scene does not have.
pub fn investigate(
    scene: &Scene,
    known: &[EffectItem],
    recordings: &[Recording],
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Investigation, Error> {
    let pours: Vec<Pour> =
        recordings.iter().map(|recording| Pour::of(recording, scene)).collect::<Result<_, _>>()?;
    let mut notes: Vec<String> = recordings.iter().flat_map(|r| r.notes.clone()).collect();
    notes.extend(pours.iter().flat_map(|pour| pour.notes.clone()));
    let last = pours.len() - 1;
    let sets = (0..pours.len())
        .map(|at| match (last, at == last) {
            (0, _) => None,
            (_, true) => Some(Set::Heldout),
            (_, false) => Some(Set::Train),
        })
        .collect();
    if last == 0 {
        notes.push(
            "one pour cannot be cut in two: every second second of it is held out; a second run would \
             be a better judge"
                .into(),
        );
    }
    let (known, aside) = known_terms(known, &pours[0]);
    notes.extend(aside);
    let gap = PourGap { pours, sets, known };
    let runs_away = |what: String| Error {
        what,
        place: recordings[0].name.clone(),
        help: "is the scale's column in kg, and the tilt in rad or deg?".into(),
    };
    let outcome = selection::search(&gap, options, progress).map_err(runs_away)?;
    progress("writing the answer", 0.98);
    let traces = traces(&gap, &outcome);
    let finding = answer(&gap, &outcome, options, notes);
    Ok(Investigation { finding, traces, experiment: None })
}

/// Returns the effects that the model has already, and a sentence for each that is not of a pour.
fn known_terms(known: &[EffectItem], pour: &Pour) -> ((Vec<Term>, Vec<f64>), Vec<String>) {
    let (mut terms, mut numbers, mut aside) = (Vec::new(), Vec::new(), Vec::new());
    for item in known {
        let term = Term::ALL
            .into_iter()
            .find(|term| term.name() == item.name.text && term.seat(pour) == item.at.text);
        let number = |name: &str| {
            let parameter = item.parameters.iter().find(|parameter| parameter.name.text == name);
            parameter.map(|parameter| parameter.value.quantity.value)
        };
        let mine: Option<Vec<f64>> = match term {
            Some(Term::Volume) => number("volume").map(|volume| vec![volume]),
            Some(Term::Dribble) => number("volume").zip(number("delay")).map(|(v, d)| vec![v, d]),
            Some(Term::Gain) => number("gain").map(|gain| vec![gain]),
            Some(Term::Drift) => number("rate").map(|rate| vec![rate]),
            None => None,
        };
        match (term, mine) {
            (Some(term), Some(mine)) => {
                terms.push(term);
                numbers.extend(mine);
            }
            _ => aside.push(format!(
                "effect {}({}) does not change a pour and is left aside",
                item.name.text, item.at.text
            )),
        }
    }
    ((terms, numbers), aside)
}

/// Returns measured minus model before and after, pour by pour, kg.
fn traces(gap: &PourGap, outcome: &Outcome<Term>) -> Vec<Trace> {
    let of = |at: usize, pour: &Pour| {
        let left = |h: &Hypothesis<Term>| {
            let predicted = gap.predicted(at, &h.terms, &h.parameters);
            pour.mass.iter().zip(predicted).map(|(mass, value)| mass - value).collect()
        };
        Trace {
            recording: pour.name.clone(),
            channel: "mass".into(),
            unit: "kg".into(),
            noise: pour.scale_noise,
            held_out: gap.sets[at] == Some(Set::Heldout),
            time: pour.time.clone(),
            before: left(&outcome.nothing),
            after: left(&outcome.best),
        }
    };
    gap.pours.iter().enumerate().map(|(at, pour)| of(at, pour)).collect()
}

/// Returns the numbers of one effect: name, value, standard deviation, unit.
fn told(gap: &PourGap, h: &Hypothesis<Term>, at: usize) -> Vec<Told> {
    let before: usize = h.terms[..at].iter().map(|term| gap.slots(term).len()).sum();
    let from = gap.nuisance().len() + before;
    let slots = gap.slots(&h.terms[at]);
    let of = |(i, slot): (usize, &selection::Slot)| {
        let variance = h.covariance.get((from + i, from + i)).copied().unwrap_or(f64::NAN);
        let (value, std) = (h.parameters[from + i], variance.max(0.0).sqrt());
        (slot.name.to_owned(), value, std, slot.unit.to_owned())
    };
    slots.iter().enumerate().map(of).collect()
}

/// Returns the numbers as people write them: what is poured is in millilitres.
fn everyday(told: &[Told]) -> Vec<Told> {
    let of = |(name, value, std, unit): &Told| match unit.as_str() {
        "m^3" => (name.clone(), value * 1e6, std * 1e6, "mL".to_owned()),
        _ => (name.clone(), *value, *std, unit.clone()),
    };
    told.iter().map(of).collect()
}

/// Returns an effect as an equation.
fn equation(term: Term, told: &[Told], pour: &Pour) -> String {
    let number = |i: usize| {
        let (_, value, _, unit) = &told[i];
        format!("{} {unit}", significant(*value, 3)).trim_end().to_owned()
    };
    let [source, target] = &pour.vessels;
    match term {
        Term::Volume => format!("volume({source}) = {} at first", number(0)),
        Term::Dribble => format!(
            "volume({target}) += {} * (1 - exp(-t_upright/{})) after {source} is upright",
            number(0),
            number(1)
        ),
        Term::Gain => format!("mass *= {}", number(0)),
        Term::Drift => format!("mass += {} * t", number(0)),
    }
}

fn answer(
    gap: &PourGap,
    outcome: &Outcome<Term>,
    options: &Options,
    mut notes: Vec<String>,
) -> Finding {
    let best = &outcome.best;
    let pour = &gap.pours[0];
    let counts = (gap.count(Set::Train), gap.count(Set::Heldout));
    let rms = |sum: f64, count: usize| (sum / count.max(1) as f64).sqrt();
    let split = |h: &Hypothesis<Term>| Split {
        train: rms(h.train, counts.0),
        heldout: rms(h.heldout, counts.1),
    };
    let explained = (outcome.nothing.heldout - best.heldout).max(1e-9);
    let mut effects = Vec::new();
    let mut lines = Vec::new();
    for (at, term) in best.terms.iter().enumerate() {
        let told = told(gap, best, at);
        let without = &outcome.without[at];
        let rivals = || outcome.rivals.iter().filter(|rival| rival.instead_of == at);
        let tied = rivals().any(|rival| rival.behind < options.tie);
        let alternatives = rivals().filter_map(|rival| {
            let other = *rival.hypothesis.terms.last()?;
            let why_not = if rival.behind < options.tie {
                "explains the data as well; this pour does not tell the two apart".to_owned()
            } else {
                format!(
                    "leaves a sum of squares larger by {:.0} on the data fitted and held out",
                    rival.behind
                )
            };
            let (name, at) = (other.name().to_owned(), other.seat(pour));
            Some(Alternative { name, at, delta_bic: rival.behind, why_not })
        });
        if !tied {
            lines.push(model_file::line(term.name(), &term.seat(pour), &everyday(&told)));
        }
        effects.push(Effect {
            name: term.name().into(),
            at: term.seat(pour),
            parameters: finding::grouped(term.name(), &told),
            evidence: Evidence {
                delta_bic: without.criterion() - best.criterion(),
                heldout_gain: ((without.heldout - best.heldout) / explained).clamp(-1.0, 1.0),
            },
            equation: equation(*term, &everyday(&told), pour),
            alternatives: alternatives.take(3).collect(),
            indistinguishable: tied,
        });
    }
    let left = above_noise(best.heldout, counts.1).max(above_noise(best.train, counts.0));
    if left > SIGNIFICANT && !effects.is_empty() {
        notes.push(format!(
            "what is left is still above noise ({left:.0} standard deviations of its sum of squares)"
        ));
    }
    let (verdict, reason) = verdict(&effects, left);
    let visible = if effects.is_empty() { visible(gap, outcome, options) } else { Vec::new() };
    Finding {
        verdict,
        places: vec![place(gap, outcome)],
        effects,
        gap: Gap::of(split(&outcome.nothing), split(best), 1.0),
        model: ModelChange { added: lines, ..ModelChange::default() },
        next_experiment: None,
        reason,
        smallest_visible: visible,
        notes,
    }
}

fn verdict(effects: &[Effect], left: f64) -> (Verdict, String) {
    let name = |effect: &Effect| format!("{} at {}", effect.name, effect.at);
    match effects {
        [] if left < SIGNIFICANT => (
            Verdict::NothingMissing,
            "the scale read what the model says, within noise, and no effect explains any of the rest"
                .into(),
        ),
        [] => (
            Verdict::Unknown,
            format!("the gap is {left:.0} standard deviations above noise, but no effect explains it"),
        ),
        several if several.iter().any(|effect| effect.indistinguishable) => (
            Verdict::Ambiguous,
            "several effects explain this pour equally well; pour another volume, and wait with the \
             vessel upright over the other"
                .into(),
        ),
        [one] => {
            (Verdict::Named, format!("{} explains the gap, also on data held out", name(one)))
        }
        several => (
            Verdict::Several,
            format!(
                "{} together explain the gap, also on data held out",
                several.iter().map(name).collect::<Vec<_>>().join(" and ")
            ),
        ),
    }
}

/// Says how large the gap of the scale's reading is, and when.
fn place(gap: &PourGap, outcome: &Outcome<Term>) -> Channel {
    let (mut square, mut rows, mut late) = (0.0, 0_usize, [0.0; 2]);
    for (at, pour) in gap.pours.iter().enumerate() {
        let predicted = gap.predicted(at, &[], &outcome.nothing.parameters);
        let upright_again = pour.tilt.iter().rposition(|tilt| tilt.abs() > 0.5).unwrap_or(0);
        for (row, (mass, value)) in pour.mass.iter().zip(predicted).enumerate() {
            square += (mass - value).powi(2);
            rows += 1;
            let scaled = (mass - value) / pour.noise[row];
            late[usize::from(row > upright_again)] += scaled * scaled;
        }
    }
    let part = late[1] / (late[0] + late[1]).max(1e-9);
    let when = if part > 0.6 {
        "after the vessel is upright again"
    } else if part < 0.2 {
        "while it pours"
    } else {
        "while it pours and after"
    };
    Channel {
        channel: "mass".into(),
        rms: (square / rows.max(1) as f64).sqrt(),
        noise: gap.pours[0].scale_noise,
        unit: "kg".into(),
        share: 1.0,
        concentrated_in: when.into(),
    }
}

/// Returns how small a change of each number would have been seen.
fn visible(gap: &PourGap, outcome: &Outcome<Term>, options: &Options) -> Vec<Visible> {
    let own = &outcome.nothing.parameters;
    let Some(base) = gap.residuals(Set::Train, &[], own) else { return Vec::new() };
    let count = base.len() as f64;
    let mut found = Vec::new();
    for candidate in gap.candidates(&[], &base, None) {
        let slots = gap.slots(&candidate.term);
        let mut moved = candidate.starts[0].clone();
        moved[0] = slots[0].neutral.unwrap_or(0.0) + slots[0].scale;
        let parameters = [&own[..], &moved].concat();
        let Some(with) = gap.residuals(Set::Train, &[candidate.term], &parameters) else {
            continue;
        };
        let change: Vec<f64> = with.iter().zip(&base).map(|(a, b)| a - b).collect();
        let strength = sum_of_squares(&change).sqrt() / slots[0].scale;
        if strength > 0.0 {
            let needed = options.least_gain + slots.len() as f64 * count.ln();
            found.push(Visible {
                name: candidate.term.name().into(),
                at: candidate.term.seat(&gap.pours[0]),
                parameter: slots[0].name.into(),
                least: (needed.sqrt() / strength).max(slots[0].least),
                unit: slots[0].unit.into(),
            });
        }
    }
    found
}
