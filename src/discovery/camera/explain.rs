//! The search's view of a camera: residuals in units of noise, and what could be missing.

use super::bent::Bent;
use super::term::{Channel, Feature, Law};
use super::views::Data;
use crate::discovery::selection::{Candidate, ParameterSpec, Residuals, Set};

/// What a formula must explain more than a name.
const UNNAMED: f64 = 20.0;

/// Highest degree of a formula's powers.
const DEGREE: u8 = 5;

/// The gap between points seen and a camera with the effects known.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraGap {
    /// The points.
    pub data: Data,
    /// Effects known, and their parameters one after the other.
    pub known: (Vec<Law>, Vec<f64>),
}

impl CameraGap {
    /// Returns the camera with the effects known and some more.
    pub fn bent(&self, laws: &[Law], parameters: &[f64]) -> Bent {
        let laws = [&self.known.0[..], laws].concat();
        let parameters = [&self.known.1[..], parameters].concat();
        Bent::new(&self.data.lens, self.data.up(), &laws, &parameters)
    }

    /// Returns the laws with names that the data could show.
    pub fn named(&self) -> Vec<Law> {
        let data = &self.data;
        let mut laws = vec![
            Law::Radial(false),
            Law::Radial(true),
            Law::Tangential,
            Law::Focal(false),
            Law::Focal(true),
            Law::Principal(true, false),
            Law::Principal(false, true),
            Law::Principal(true, true),
        ];
        if data.posed {
            // From one number to six: a camera that moved along one axis is the more likely story if that is enough.
            let [no, yes] = [false, true];
            for free in [
                [yes, no, no, no, no, no],
                [no, yes, no, no, no, no],
                [no, no, yes, no, no, no],
                [no, no, no, yes, no, no],
                [no, no, no, no, yes, no],
                [no, no, no, no, no, yes],
                [yes, yes, no, no, no, no],
                [no, no, no, yes, yes, no],
                [yes, yes, yes, no, no, no],
                [no, no, no, yes, yes, yes],
                [yes; 6],
            ] {
                laws.push(Law::Shift(free));
            }
            let on_table = data.sights.iter().filter(|sight| sight.on_table() && !sight.wrong);
            if on_table.count() >= 4 {
                laws.extend([
                    Law::Table(false, true),
                    Law::Table(true, false),
                    Law::Table(true, true),
                ]);
                if data.vertical.is_some() {
                    laws.push(Law::Lift);
                }
            }
        }
        if !data.tracks.is_empty() {
            laws.extend([Law::Delay, Law::Shutter]);
        }
        laws
    }
}

impl Residuals for CameraGap {
    type Term = Law;

    fn specs(&self, term: &Law) -> Vec<ParameterSpec> {
        term.specs(self.data.extent)
    }

    fn residuals(&self, set: Set, terms: &[Law], parameters: &[f64]) -> Option<Vec<f64>> {
        let found = self.data.residuals(&self.bent(terms, parameters), set)?;
        let sigma = self.data.sigma;
        Some(found.into_iter().flat_map(|(_, left)| [left.x / sigma, left.y / sigma]).collect())
    }

    fn count(&self, set: Set) -> usize {
        self.data.count(set)
    }

    fn candidates(
        &self,
        terms: &[Law],
        _left: &[f64],
        _instead_of: Option<&Law>,
    ) -> Vec<Candidate<Law>> {
        let start = |law: Law| -> Vec<f64> {
            law.specs(self.data.extent).iter().map(|spec| spec.neutral.unwrap_or(0.0)).collect()
        };
        let mut found: Vec<Candidate<Law>> = self
            .named()
            .into_iter()
            .map(|term| Candidate {
                term,
                with: Vec::new(),
                starts: vec![start(term)],
                surcharge: 0.0,
            })
            .collect();
        let mut features = vec![Feature::Radial];
        for channel in [Channel::U, Channel::V] {
            for total in 0..=DEGREE {
                features.extend((0..=total).map(|j| Feature::Monomial(channel, total - j, j)));
            }
            if self.data.timed {
                features.push(Feature::Drift(channel));
            }
        }
        found.extend(features.into_iter().map(|feature| {
            let term = Law::Feature(feature);
            Candidate { term, with: Vec::new(), starts: vec![start(term)], surcharge: UNNAMED }
        }));
        found.retain(|candidate| !terms.contains(&candidate.term));
        found
    }

    /// A number that ran to the end of its range is that of something else.
    fn is_sensible(&self, term: &Law, parameters: &[f64]) -> bool {
        let specs = self.specs(term);
        !specs.iter().zip(parameters).any(|(spec, value)| spec.has_run_out(*value))
    }

    fn names_stand_alone(&self) -> bool {
        true
    }

    fn compatible(&self, a: &Law, b: &Law) -> bool {
        match (a, b) {
            (Law::Feature(_), Law::Feature(_)) => a != b,
            // Beside a name a formula that says the same takes back what the name says.
            (name, Law::Feature(feature)) | (Law::Feature(feature), name) => !name.says(*feature),
            _ => a.name() != b.name(),
        }
    }

    fn contains(&self, general: &Law, special: &Law) -> bool {
        general.contains(*special)
    }
}
