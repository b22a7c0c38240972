//! Pours as something to be explained: [`Residuals`] over what a vessel held, how it ran out and where it went.

use super::flow::{Flow, arrived};
use super::pour_record::Pour;
use crate::discovery::selection::{Candidate, ParameterSpec, Residuals, Set};
use crate::discovery::wording::set_of;
use crate::twin::hold::WATER;
use crate::world::WATER_DENSITY;

/// What can be missing from a pour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Term {
    /// `liquid_volume(source)`: it held another volume than declared.
    Volume,
    /// `lip_dribble(source)`: water ran on after it was upright.
    Dribble,
    /// `liquid_viscosity(source)`: it flows more slowly the less of it stands above the lip.
    Viscosity,
    /// `overflow(target)`: it is full, and the rest runs over.
    Overflow,
    /// `object_mass(source)`: it weighs more or less in the hand than declared.
    Mass,
    /// `output_gain(mass)`: the scale reads in other units than it says.
    Gain,
    /// `output_drift(mass)`: the scale's zero drifts.
    Drift,
    /// `output_saturation(mass)`: the scale reads no more than its limit.
    Clip,
}

impl Term {
    pub(super) const ALL: [Self; 8] = [
        Self::Volume,
        Self::Dribble,
        Self::Viscosity,
        Self::Overflow,
        Self::Mass,
        Self::Gain,
        Self::Drift,
        Self::Clip,
    ];

    /// Returns its name in the vocabulary.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Volume => "liquid_volume",
            Self::Dribble => "lip_dribble",
            Self::Viscosity => "liquid_viscosity",
            Self::Overflow => "overflow",
            Self::Mass => "object_mass",
            Self::Gain => "output_gain",
            Self::Drift => "output_drift",
            Self::Clip => "output_saturation",
        }
    }
}

/// Some pours to fit and some to judge; rows of a single one take turns.
#[derive(Debug)]
pub(super) struct PourGap {
    pub(super) pours: Vec<Pour>,
    /// Which set the rows of each pour belong to: all to one, or (`None`) stretches of a second in turn.
    pub(super) sets: Vec<Option<Set>>,
    /// Effects that the model has already, with their numbers one after the other.
    pub(super) known: (Vec<Term>, Vec<f64>),
}

/// How exactly a vessel is filled to what is declared, as a part of it: by eye, to a line.
const FILLED: f64 = 0.03;

/// A vessel that holds what it is filled with to this, m³, was not poured from before.
const UNTOUCHED: f64 = 1e-7;

/// How well the water beside the vessels is told, m³: some of it dries, some stays on the gripper.
const BESIDE: f64 = 5e-6;

/// Parameters of the model itself, the same for all pours.
const OWN: [(ParameterSpec, f64); 3] = [
    (spec("discharge", "", 0.1, (0.1, 4.0)), 1.0),
    (spec("delay", "s", 0.02, (0.0, 0.8)), 0.15),
    (spec("lean", "rad", 0.01, (-0.2, 0.2)), 0.0),
];

const fn spec(
    name: &'static str,
    unit: &'static str,
    scale: f64,
    range: (f64, f64),
) -> ParameterSpec {
    ParameterSpec { name, unit, scale, range, neutral: None, least: 0.0 }
}

impl PourGap {
    /// Returns whether a row of a pour belongs to a set.
    pub(super) fn is_in(&self, at: usize, row: usize, set: Set) -> bool {
        let time = &self.pours[at].time;
        set_of(self.sets[at], time[row] - time[0], row, time.len()) == set
    }

    /// Returns whether what was read once belongs to a set: to what decides, since it cannot be cut.
    pub(super) fn has_single(&self, at: usize, set: Set) -> bool {
        set != Set::Unseen && self.sets[at].is_none_or(|own| own == set)
    }

    /// Returns the readings that effects predict for one pour, kg, and the water beside both vessels at its
    /// end, m³.
    pub(super) fn predicted(
        &self,
        at: usize,
        terms: &[Term],
        parameters: &[f64],
    ) -> (Vec<f64>, f64) {
        let pour = &self.pours[at];
        let (own, found) = parameters.split_at(OWN.len());
        let mut flow = Flow {
            volume: self.at_first(at, terms, parameters),
            discharge: own[0],
            delay: own[1],
            lean: own[2],
            film: (0.0, 1.0),
            viscosity: 0.0,
            there: pour.there,
            brim: pour.brim,
        };
        let (mut gain, mut drift, mut most) = (1.0, 0.0, f64::INFINITY);
        let lists = [(&self.known.0[..], &self.known.1[..]), (terms, found)];
        for (terms, mut numbers) in lists {
            for term in terms {
                let (mine, rest) = numbers.split_at(self.specs(term).len());
                numbers = rest;
                match term {
                    Term::Dribble => flow.film = (mine[0], mine[1]),
                    Term::Gain => gain *= mine[0],
                    Term::Drift => drift += mine[0],
                    // What water's own does is in the discharge.
                    Term::Viscosity => flow.viscosity = (mine[0] - WATER).max(0.0),
                    Term::Overflow => flow.brim = mine[0],
                    Term::Clip => most = mine[0],
                    // The volume is in the flow, and what the hand bears does not pour otherwise.
                    Term::Volume | Term::Mass => {}
                }
            }
        }
        let start = pour.time[0];
        let (there, beside) = arrived(pour, &flow);
        let read = |(volume, time): (&f64, &f64)| {
            let gained = WATER_DENSITY * (volume - pour.there);
            (gain * gained + drift * (time - start)).min(most - pour.zero)
        };
        (there.iter().zip(&pour.time).map(read).collect(), beside)
    }
}

/// How well an arm weighs what is in its hand, kg: its model is a few milliradians off, and what is held stands
/// a little beside the tool's point.
pub(super) const BORNE: f64 = 0.02;

impl PourGap {
    /// Returns the first number of an effect, if the model or the hypothesis has it.
    fn said(&self, wanted: Term, terms: &[Term], parameters: &[f64]) -> Option<f64> {
        let mut said = None;
        let found = &parameters[OWN.len()..];
        for (terms, mut numbers) in [(&self.known.0[..], &self.known.1[..]), (terms, found)] {
            for term in terms {
                let (mine, rest) = numbers.split_at(self.specs(term).len());
                numbers = rest;
                if *term == wanted {
                    said = Some(mine[0]);
                }
            }
        }
        said
    }

    /// Returns how far what was weighed once for a pour is from what the effects say, in units of how exactly that is
    /// known: what the vessel held, beside what it is filled to, and what the hand bore.
    fn weighed(&self, at: usize, terms: &[Term], parameters: &[f64]) -> Vec<f64> {
        let pour = &self.pours[at];
        let filled = self.believed(at, terms, parameters);
        let most = pour.first.unwrap_or(0.0).max(pour.declared);
        let held = pour.held.map(|held| (held - filled) / (FILLED * most.max(1e-6)));
        let borne = self.borne(at, terms, parameters).map(|off| off / BORNE);
        held.into_iter().chain(borne).collect()
    }

    /// Returns what a vessel held at first, m³: what scales said of this very pour is better than what holds for all.
    fn at_first(&self, at: usize, terms: &[Term], parameters: &[f64]) -> f64 {
        self.pours[at].held.unwrap_or_else(|| self.believed(at, terms, parameters).max(0.0))
    }

    /// Returns what a vessel held at first, m³, as the effects say: what it was filled with, less what has left it since.
    fn believed(&self, at: usize, terms: &[Term], parameters: &[f64]) -> f64 {
        let filled = self.said(Term::Volume, terms, parameters);
        filled.unwrap_or(self.pours[at].declared) - self.drawn(at)
    }

    /// Returns what had left a vessel before this pour, m³, by the belief of whoever poured: nothing where it was as full as
    /// the scene or its twin says.
    fn drawn(&self, at: usize) -> f64 {
        let pour = &self.pours[at];
        let Some(first) = pour.first else { return 0.0 };
        let known = self.known_volume();
        let is_new = [Some(pour.declared), known]
            .into_iter()
            .flatten()
            .any(|full| (first - full).abs() < UNTOUCHED);
        if is_new { 0.0 } else { known.unwrap_or(pour.declared) - first }
    }

    /// Returns what the model says already that the vessel is filled with, m³.
    fn known_volume(&self) -> Option<f64> {
        let mut numbers = &self.known.1[..];
        let mut said = None;
        for term in &self.known.0 {
            let (mine, rest) = numbers.split_at(self.specs(term).len());
            numbers = rest;
            if *term == Term::Volume {
                said = Some(mine[0]);
            }
        }
        said
    }

    /// Returns by how much the hand bore more than the effects say, kg; `None` if nobody weighed it.
    pub(super) fn borne(&self, at: usize, terms: &[Term], parameters: &[f64]) -> Option<f64> {
        let pour = &self.pours[at];
        let empty = self.said(Term::Mass, terms, parameters).unwrap_or(pour.empty);
        let inside = self.at_first(at, terms, parameters);
        Some(pour.borne? - empty - WATER_DENSITY * inside)
    }
}

impl Residuals for PourGap {
    type Term = Term;

    fn nuisance(&self) -> Vec<(ParameterSpec, f64)> {
        OWN.to_vec()
    }

    fn specs(&self, term: &Term) -> Vec<ParameterSpec> {
        let declared = self.pours[0].declared;
        let with = |spec: ParameterSpec, neutral: f64, least: f64| ParameterSpec {
            neutral: Some(neutral),
            least,
            ..spec
        };
        match term {
            Term::Volume => {
                // Two millilitres stay on the walls, or came with the last guest.
                vec![with(spec("volume", "m^3", 2e-6, (0.0, 1e-2)), declared, 2e-6)]
            }
            Term::Dribble => vec![
                with(spec("volume", "m^3", 1e-6, (0.0, 1e-3)), 0.0, 1e-6),
                spec("delay", "s", 0.1, (0.1, 20.0)),
            ],
            Term::Gain => vec![with(spec("gain", "", 0.01, (0.2, 5.0)), 1.0, 0.005)],
            Term::Viscosity => {
                // Ten times water looks like water that was poured a little later.
                vec![with(spec("viscosity", "Pa*s", 0.01, (WATER, 100.0)), WATER, 0.01)]
            }
            Term::Mass => {
                // As well as it is weighed; a glass is as heavy as it says to a few grams.
                vec![with(spec("mass", "kg", 5e-3, (1e-3, 50.0)), self.pours[0].empty, BORNE)]
            }
            Term::Overflow => vec![spec("level", "m^3", 1e-6, (1e-6, 1e-2))],
            Term::Clip => vec![spec("limit", "kg", 1e-3, (1e-3, 10.0))],
            Term::Drift => vec![with(spec("rate", "kg/s", 1e-5, (-1e-2, 1e-2)), 0.0, 1e-5)],
        }
    }

    fn residuals(&self, set: Set, terms: &[Term], parameters: &[f64]) -> Option<Vec<f64>> {
        let mut all = Vec::new();
        for (at, pour) in self.pours.iter().enumerate() {
            if !(0..pour.time.len()).any(|row| self.is_in(at, row, set)) {
                continue;
            }
            let (predicted, beside) = self.predicted(at, terms, parameters);
            for (row, left) in pour.left(&predicted).into_iter().enumerate() {
                if self.is_in(at, row, set) {
                    all.push(left / pour.noise[row]);
                }
            }
            if self.has_single(at, set) {
                all.extend(self.weighed(at, terms, parameters));
                all.extend(pour.beside.map(|seen| (seen - beside) / BESIDE));
            }
        }
        all.iter().all(|value| value.is_finite()).then_some(all)
    }

    fn count(&self, set: Set) -> usize {
        let rows =
            |at: usize| (0..self.pours[at].time.len()).filter(move |row| self.is_in(at, *row, set));
        let filling = |at: usize| {
            let pour = &self.pours[at];
            let weighed = [pour.held, pour.beside, pour.borne].iter().flatten().count();
            if self.has_single(at, set) { weighed } else { 0 }
        };
        (0..self.pours.len()).map(|at| rows(at).count() + filling(at)).sum()
    }

    fn compatible(&self, a: &Term, b: &Term) -> bool {
        use Term::{Clip, Overflow};
        a != b && !matches!((a, b), (Clip, Overflow) | (Overflow, Clip))
    }

    fn candidates(
        &self,
        terms: &[Term],
        _left: &[f64],
        _instead_of: Option<&Term>,
    ) -> Vec<Candidate<Term>> {
        let declared = self.pours[0].declared;
        let most = |pour: &Pour| pour.mass.iter().copied().fold(0.0, f64::max);
        // Where the reading stopped, less and less of what came.
        let below = |from: &dyn Fn(&Pour) -> f64, factor: f64| {
            let highest = |part: f64| {
                let stops = self.pours.iter().map(|pour| from(pour) + part * most(pour) * factor);
                stops.fold(0.0, f64::max)
            };
            [1.0, 0.98, 0.95, 0.9, 0.8, 0.6].map(|part| vec![highest(part)]).to_vec()
        };
        let felt = self.pours.iter().any(|pour| pour.borne.is_some());
        let free = |term: &Term| {
            let can_tell = *term != Term::Mass || felt;
            can_tell && !terms.contains(term) && !self.known.0.contains(term)
        };
        Term::ALL
            .into_iter()
            .filter(free)
            .map(|term| {
                let starts = match term {
                    Term::Volume => vec![vec![declared]],
                    Term::Dribble => [0.5, 1.5, 4.0].map(|delay| vec![8e-6, delay]).to_vec(),
                    Term::Gain => vec![vec![1.0]],
                    Term::Drift => vec![vec![0.0]],
                    Term::Viscosity => [WATER, 0.05, 0.3, 2.0].map(|value| vec![value]).to_vec(),
                    Term::Mass => vec![vec![self.pours[0].empty]],
                    Term::Overflow => below(&|pour| pour.there, 1.0 / WATER_DENSITY),
                    Term::Clip => below(&|pour| pour.zero, 1.0),
                };
                Candidate { term, with: Vec::new(), starts, surcharge: 0.0 }
            })
            .collect()
    }
}
