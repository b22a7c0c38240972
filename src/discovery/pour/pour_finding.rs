//! Pours → a finding.

use super::gap::{BORNE, PourGap, Term};
use super::pour_record::Pour;
use super::wording;
use crate::discovery::finding::{Channel, ParameterEstimate};
use crate::discovery::recording::{Error, Recording};
use crate::discovery::selection::{self, Hypothesis, Options, Outcome, Set};
use crate::discovery::why::{COUNT, Left, Seen, Shows, State, whys};
use crate::discovery::wording::{Worded, answer, sets};
use crate::discovery::{Investigation, Trace};
use crate::language::ast::EffectItem;
use crate::world::Scene;

/// Finds what a scene's twin lacks of pours: of several the last is held out, of one every second second, and of all where only the
/// last was poured in one turn. Pours between other
/// vessels than the last's are left out, with a note.
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
    let all: Vec<Pour> =
        recordings.iter().map(|recording| Pour::of(recording, scene)).collect::<Result<_, _>>()?;
    let mut notes: Vec<String> = recordings.iter().flat_map(|r| r.notes.clone()).collect();
    // An effect is at a vessel: pours between others say nothing of it.
    let vessels = all.last().map(|pour| pour.vessels.clone()).unwrap_or_default();
    let (pours, others): (Vec<Pour>, Vec<Pour>) =
        all.into_iter().partition(|pour| pour.vessels == vessels);
    notes.extend(others.iter().map(|pour| wording::other_vessels(&pour.name, &pour.vessels)));
    notes.extend(pours.iter().flat_map(|pour| pour.notes.clone()));
    let mut sets = sets(pours.len());
    if pours.len() == 1 {
        notes.push(wording::one_pour());
    } else if let Some((last, fitted)) = pours.split_last()
        && !last.is_in_steps()
        && fitted.iter().all(Pour::is_in_steps)
    {
        // Pours in steps say little of how fast a vessel runs out: the last is needed for it too.
        sets = vec![None; pours.len()];
        notes.push(wording::all_cut());
    }
    let mut gap = PourGap { pours, sets, known: (Vec::new(), Vec::new()) };
    notes.extend(take_known(&mut gap, known));
    let outcome = selection::search(&gap, options, progress)
        .map_err(|what| wording::diverged(what, &recordings[0].name))?;
    progress("writing the answer", 0.98);
    let traces = traces(&gap, &outcome);
    let whys = whys(&gap, &outcome, options.tie);
    let finding = answer(&gap, &outcome, options, notes);
    Ok(Investigation { finding, traces, whys, experiment: None, revision: None })
}

/// Gives the gap the effects that the model has already; returns a sentence for each that is not of a pour.
fn take_known(gap: &mut PourGap, known: &[EffectItem]) -> Vec<String> {
    let mut aside = Vec::new();
    for item in known {
        let term = Term::ALL
            .into_iter()
            .find(|term| term.name() == item.name.text && gap.site(term) == item.at.text);
        let number = |name: &str| {
            let parameter = item.parameters.iter().find(|parameter| parameter.name.text == name);
            parameter.map(|parameter| parameter.value.quantity.value)
        };
        let mine: Option<Vec<f64>> = term.and_then(|term| {
            let specs = selection::Residuals::specs(gap, &term);
            specs.iter().map(|spec| number(spec.name)).collect()
        });
        match term.zip(mine) {
            Some((term, mine)) => {
                gap.known.0.push(term);
                gap.known.1.extend(mine);
            }
            None => aside.push(wording::not_of_pouring(item)),
        }
    }
    aside
}

/// Returns measured minus model before and after, pour by pour, kg.
fn traces(gap: &PourGap, outcome: &Outcome<Term>) -> Vec<Trace> {
    let of = |at: usize, pour: &Pour| {
        let left = |h: &Hypothesis<Term>| gap.left_of(at, &h.terms, &h.parameters);
        Trace {
            recording: pour.name.clone(),
            channel: "mass".into(),
            unit: "kg".into(),
            noise: pour.scale_noise,
            sigma: pour.noise.clone(),
            held_out: gap.held_out(at),
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

/// Half the time over which a stream is taken, s: the scale's noise is a gram or two of it.
const STREAM: f64 = 0.4;

impl PourGap {
    /// Returns measured minus model of one pour, kg.
    fn left_of(&self, at: usize, terms: &[Term], parameters: &[f64]) -> Vec<f64> {
        let (predicted, _) = self.predicted(at, terms, parameters);
        self.pours[at].left(&predicted)
    }

    /// Returns which rows of a pour were held out.
    fn held_out(&self, at: usize) -> Vec<bool> {
        let rows = 0..self.pours[at].time.len();
        rows.map(|row| !self.is_in(at, row, Set::Train)).collect()
    }
}

/// Returns how fast a reading changes, per second, over [`STREAM`] to both sides.
fn rate(time: &[f64], reading: &[f64]) -> Vec<f64> {
    let near = |row: usize| {
        let within = |other: &usize| (time[*other] - time[row]).abs() <= STREAM;
        let first = (0..=row).rev().take_while(within).last().unwrap_or(row);
        let last = (row..time.len()).take_while(within).last().unwrap_or(row);
        (reading[last] - reading[first]) / (time[last] - time[first]).max(1e-9)
    };
    (0..time.len()).map(near).collect()
}

/// What is read of a pour: row by row, or once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reading {
    Mass,
    Stream,
    Hand,
}

/// A pour by its number.
const POUR: &str = "pour";

impl PourGap {
    /// The readings of all pours, pour by pour.
    fn readings(&self) -> impl Iterator<Item = (usize, Reading)> {
        let all = [Reading::Mass, Reading::Stream, Reading::Hand];
        let of = move |at: usize| {
            let has_hand = self.pours[at].borne.is_some();
            let is_there = move |reading: &Reading| *reading != Reading::Hand || has_hand;
            all.into_iter().filter(is_there).map(move |reading| (at, reading))
        };
        (0..self.pours.len()).flat_map(of)
    }
}

impl Shows for PourGap {
    fn left(&self, terms: &[Term], parameters: &[f64]) -> Vec<Left> {
        let of = |(at, reading): (usize, Reading)| {
            let pour = &self.pours[at];
            let mass = || self.left_of(at, terms, parameters);
            let (channel, unit, noise, values) = match reading {
                Reading::Mass => ("mass", "kg", pour.scale_noise, mass()),
                Reading::Stream => {
                    ("stream", "kg/s", pour.scale_noise / STREAM, rate(&pour.time, &mass()))
                }
                Reading::Hand => {
                    let off = self.borne(at, terms, parameters);
                    ("hand", "kg", BORNE, off.into_iter().collect())
                }
            };
            let held_out = match reading {
                Reading::Hand => vec![!self.has_single(at, Set::Train)],
                _ => self.held_out(at),
            };
            Left { channel: channel.into(), unit: unit.into(), noise, held_out, values }
        };
        self.readings().map(of).collect()
    }

    fn states(&self, at: usize) -> Vec<State> {
        let Some((at, reading)) = self.readings().nth(at) else { return Vec::new() };
        let pour = &self.pours[at];
        let state = |name: &str, unit: &str, values: &[f64]| State {
            name: name.into(),
            unit: unit.into(),
            values: values.to_vec(),
        };
        if reading == Reading::Hand {
            return vec![state(POUR, COUNT, &[(at + 1) as f64])];
        }
        let begin = pour.time.first().copied().unwrap_or(0.0);
        let time: Vec<f64> = pour.time.iter().map(|t| t - begin).collect();
        vec![
            state("tilt", "rad", &pour.tilt),
            state("mass", "kg", &pour.mass),
            state("time", "s", &time),
        ]
    }

    fn told(&self, term: &Term) -> Option<(String, String)> {
        Some((term.name().to_owned(), self.site(term)))
    }

    fn seen(&self, term: &Term) -> Seen {
        let (channel, state) = match term {
            Term::Dribble | Term::Viscosity => ("stream", "tilt"),
            Term::Volume => ("mass", "tilt"),
            Term::Mass => ("hand", POUR),
            Term::Overflow | Term::Gain | Term::Clip => ("mass", "mass"),
            Term::Drift => ("mass", "time"),
        };
        Seen { channel: Some(channel.into()), state: Some(state.into()) }
    }
}

impl Worded for PourGap {
    fn name(&self, term: &Term) -> &'static str {
        term.name()
    }

    fn site(&self, term: &Term) -> String {
        let [source, target] = &self.pours[0].vessels;
        match term {
            Term::Volume | Term::Dribble | Term::Viscosity | Term::Mass => source.clone(),
            Term::Overflow => target.clone(),
            Term::Gain | Term::Drift | Term::Clip => "mass".into(),
        }
    }

    fn equation(&self, term: &Term, estimates: &[ParameterEstimate]) -> String {
        wording::equation(&self.pours[0].vessels, *term, estimates)
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

    fn apart(&self, term: &Term) -> Option<&'static str> {
        match term {
            Term::Mass => Some(wording::before_it_pours()),
            // What runs out follows from what the scales said, not from what it was filled with.
            Term::Volume if self.pours.iter().all(|pour| pour.held.is_some()) => {
                Some(wording::as_weighed())
            }
            _ => None,
        }
    }

    fn nothing(&self) -> &'static str {
        wording::nothing_missing()
    }

    fn doubt(&self) -> &'static str {
        wording::pour_otherwise()
    }
}

/// Says how large the gap of the scale's reading is, and when.
fn place(gap: &PourGap, nothing: &Hypothesis<Term>) -> Channel {
    let (mut square, mut rows, mut late) = (0.0, 0_usize, [0.0; 2]);
    for (at, pour) in gap.pours.iter().enumerate() {
        let left = gap.left_of(at, &[], &nothing.parameters);
        let upright_again = pour.tilt.iter().rposition(|tilt| tilt.abs() > 0.5).unwrap_or(0);
        for (row, left) in left.into_iter().enumerate() {
            square += left.powi(2);
            rows += 1;
            let scaled = left / pour.noise[row];
            late[usize::from(row > upright_again)] += scaled * scaled;
        }
    }
    let part = late[1] / (late[0] + late[1]).max(1e-9);
    Channel {
        channel: "mass".into(),
        rms: (square / rows.max(1) as f64).sqrt(),
        noise: gap.pours[0].scale_noise,
        unit: "kg".into(),
        share: beyond((square / rows.max(1) as f64).sqrt(), gap.pours[0].scale_noise),
        concentrated_in: wording::when(part).into(),
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
        concentrated_in: wording::before_it_pours().into(),
        heldout: None,
    })
}

/// Returns by how much a size exceeds its noise, as a square.
fn beyond(rms: f64, noise: f64) -> f64 {
    ((rms / noise).powi(2) - 1.0).max(1e-3)
}
