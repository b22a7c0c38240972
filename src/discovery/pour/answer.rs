//! Pours → a finding.

use super::data::Pour;
use super::gap::{BORNE, PourGap, Term};
use crate::discovery::finding::{Channel, Told};
use crate::discovery::recording::{Error, Recording};
use crate::discovery::selection::{self, Hypothesis, Options, Outcome, Set};
use crate::discovery::worded::{self, Worded};
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
    let sets = worded::sets(pours.len());
    if pours.len() == 1 {
        notes.push(
            "one pour cannot be cut in two: every second second of it is held out; a second run would \
             be a better judge"
                .into(),
        );
    }
    let mut gap = PourGap { pours, sets, known: (Vec::new(), Vec::new()) };
    notes.extend(take_known(&mut gap, known));
    let runs_away = |what: String| Error {
        what,
        place: recordings[0].name.clone(),
        help: "is the scale's column in kg, and the tilt in rad or deg?".into(),
    };
    let outcome = selection::search(&gap, options, progress).map_err(runs_away)?;
    progress("writing the answer", 0.98);
    let traces = traces(&gap, &outcome);
    let finding = worded::answer(&gap, &outcome, options, notes);
    Ok(Investigation { finding, traces, experiment: None, revision: None })
}

/// Gives the gap the effects that the model has already; returns a sentence for each that is not of a pour.
fn take_known(gap: &mut PourGap, known: &[EffectItem]) -> Vec<String> {
    let mut aside = Vec::new();
    for item in known {
        let term = Term::ALL
            .into_iter()
            .find(|term| term.name() == item.name.text && gap.seat(term) == item.at.text);
        let number = |name: &str| {
            let parameter = item.parameters.iter().find(|parameter| parameter.name.text == name);
            parameter.map(|parameter| parameter.value.quantity.value)
        };
        let mine: Option<Vec<f64>> = term.and_then(|term| {
            let slots = selection::Gap::slots(gap, &term);
            slots.iter().map(|slot| number(slot.name)).collect()
        });
        match term.zip(mine) {
            Some((term, mine)) => {
                gap.known.0.push(term);
                gap.known.1.extend(mine);
            }
            None => aside.push(format!(
                "effect {}({}) does not change a pour and is left aside",
                item.name.text, item.at.text
            )),
        }
    }
    aside
}

/// Returns measured minus model before and after, pour by pour, kg.
fn traces(gap: &PourGap, outcome: &Outcome<Term>) -> Vec<Trace> {
    let of = |at: usize, pour: &Pour| {
        let left = |h: &Hypothesis<Term>| {
            let (predicted, _) = gap.predicted(at, &h.terms, &h.parameters);
            pour.mass.iter().zip(predicted).map(|(mass, value)| mass - value).collect()
        };
        Trace {
            recording: pour.name.clone(),
            channel: "mass".into(),
            unit: "kg".into(),
            noise: pour.scale_noise,
            held_out: gap.sets[at] == Some(Set::Heldout),
            along: "s",
            time: pour.time.clone(),
            before: left(&outcome.nothing),
            after: left(&outcome.best),
            unseen: (0..pour.time.len()).map(|row| gap.is_in(at, row, Set::Unseen)).collect(),
            against: None,
        }
    };
    gap.pours.iter().enumerate().map(|(at, pour)| of(at, pour)).collect()
}

impl Worded for PourGap {
    fn name(&self, term: &Term) -> &'static str {
        term.name()
    }

    fn seat(&self, term: &Term) -> String {
        let [source, target] = &self.pours[0].vessels;
        match term {
            Term::Volume | Term::Dribble | Term::Viscosity | Term::Mass => source.clone(),
            Term::Overflow => target.clone(),
            Term::Gain | Term::Drift | Term::Clip => "mass".into(),
        }
    }

    fn equation(&self, term: &Term, told: &[Told]) -> String {
        let number = |i: usize| {
            let (_, value, _, unit) = &told[i];
            format!("{} {unit}", significant(*value, 3)).trim_end().to_owned()
        };
        let [source, target] = &self.pours[0].vessels;
        match term {
            Term::Volume => format!("volume({source}) = {} at first", number(0)),
            Term::Dribble => format!(
                "volume({target}) += {} * (1 - exp(-t_upright/{})) after {source} is upright",
                number(0),
                number(1)
            ),
            Term::Viscosity => format!(
                "what stands above the lip of {source} leaves through a film, w*rho*g*h^3*slope/(3*{})",
                number(0)
            ),
            Term::Overflow => format!("volume({target}) <= {}, the rest runs over", number(0)),
            Term::Mass => format!("{source} weighs {} when it is empty", number(0)),
            Term::Gain => format!("mass *= {}", number(0)),
            Term::Drift => format!("mass += {} * t", number(0)),
            Term::Clip => format!("mass <= {} as read", number(0)),
        }
    }

    fn places(&self, nothing: &Hypothesis<Term>) -> Vec<Channel> {
        let mut found = vec![place(self, nothing)];
        found.extend(felt(self, nothing));
        let shares: f64 = found.iter().map(|channel| channel.share).sum();
        for channel in &mut found {
            channel.share /= shares.max(1e-9);
        }
        found.sort_by(|a, b| b.share.total_cmp(&a.share));
        found
    }

    fn nothing(&self) -> &'static str {
        "the scale read what the model says, within noise, and no effect explains any of the rest"
    }

    fn doubt(&self) -> &'static str {
        "pour another volume, wait with the vessel upright over the other, and weigh what is beside it"
    }
}

/// Says how large the gap of the scale's reading is, and when.
fn place(gap: &PourGap, nothing: &Hypothesis<Term>) -> Channel {
    let (mut square, mut rows, mut late) = (0.0, 0_usize, [0.0; 2]);
    for (at, pour) in gap.pours.iter().enumerate() {
        let (predicted, _) = gap.predicted(at, &[], &nothing.parameters);
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
        share: beyond((square / rows.max(1) as f64).sqrt(), gap.pours[0].scale_noise),
        concentrated_in: when.into(),
        heldout: None,
    }
}

/// Says how far what the hand bore before it poured is from what is declared, if it was weighed.
fn felt(gap: &PourGap, nothing: &Hypothesis<Term>) -> Option<Channel> {
    let off = |at: usize| gap.borne(at, &[], &nothing.parameters);
    let off: Vec<f64> = (0..gap.pours.len()).filter_map(off).collect();
    let square: f64 = off.iter().map(|off| off * off).sum();
    let rms = (square / off.len().max(1) as f64).sqrt();
    (!off.is_empty()).then(|| Channel {
        channel: "hand".into(),
        rms,
        noise: BORNE,
        unit: "kg".into(),
        share: beyond(rms, BORNE),
        concentrated_in: "what it bears before it pours".into(),
        heldout: None,
    })
}

/// Returns by how much a size exceeds its noise, as a square.
fn beyond(rms: f64, noise: f64) -> f64 {
    ((rms / noise).powi(2) - 1.0).max(1e-3)
}
