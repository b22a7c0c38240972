//! Numbers of bodies that fit and could be, beside what else is fitted.

use std::ops::Range;

use nalgebra::DMatrix;

use super::super::chain::Body;
use super::super::wording;
use super::body::{NAMES, NUMBERS, numbers, spread};
use super::consistent::consistent;
use super::fit::{Fit, LOAD, Parts, Problem};
use super::own::Links;
use crate::discovery::finding::Identified;

/// A number is told if the data say more of it than the file does: its uncertainty fell to this part.
const TOLD: f64 = 0.5;

/// A number of a joint is told from the bodies' if it is this many times its standard deviation beside them.
const SURE: f64 = 4.0;

/// What a file's numbers are rarely off by, in units of what they usually are.
const RARELY: f64 = 3.0;

/// Numbers of bodies that fit, and could be.
pub(super) struct Freed {
    /// What there is to be explained; a load has the inertia of a mass where it is.
    problem: Problem,
    /// All that was fitted, the bodies first.
    list: Vec<Range<usize>>,
    has_load: bool,
    changes: Vec<[f64; NUMBERS]>,
    /// The fit of all of them, whether they could be or not.
    free: Fit,
    /// The fit of the others, beside bodies that could be.
    with: Fit,
}

impl Freed {
    /// Fits bodies beside the numbers of `beside`.
    pub(super) fn of(
        problem: &Problem,
        bodies: &[Body],
        parts: &Parts,
        beside: &[Range<usize>],
    ) -> Option<Self> {
        let list: Vec<_> = std::iter::once(&parts.bodies).chain(beside).cloned().collect();
        let problem = problem.bearing(parts, &list)?;
        let free = problem.fit(&parts.only(&list))?;
        // What is not sure beside the bodies is left to them: beside bodies that are fixed it would look sure.
        let sure = |at: usize| {
            let is_open = parts.joints.contains(&at);
            !is_open || free.x[at].abs() > SURE * free.covariance[(at, at)].sqrt()
        };
        let all = list.iter().flat_map(Range::clone);
        let each: Vec<_> = all.filter(|at| sure(*at)).map(|at| at..at + 1).collect();
        let free = problem.fit(&parts.only(&each))?;
        let changes = consistent(&problem, bodies, &free)?;
        let with = problem.beside(&changes).fit(&parts.only(beside))?;
        let has_load = beside.contains(&parts.load);
        Some(Self { problem, list, has_load, changes, free, with })
    }

    /// Returns which is to be taken of several: the likeliest. Links that would have to be far from the file's cost more.
    pub(super) fn best(all: &[&Self]) -> Option<usize> {
        (0..all.len()).min_by(|a, b| all[*a].cost().total_cmp(&all[*b].cost()))
    }

    /// Returns how unlikely it is, in -2 ln of the odds, but for what so many numbers could have fitted. A load costs what its numbers
    /// do by the information criterion.
    fn cost(&self) -> f64 {
        let numbers = if self.has_load { LOAD.len() } else { 0 };
        self.problem.evidence(&self.free) + numbers as f64 * self.problem.price()
    }

    /// Returns how unlikely it is, in -2 ln of the odds: numbers of bodies cost what the recordings fitted narrow them to, of what
    /// files are usually right by (`MacKay`, "Bayesian interpolation", 1992).
    pub(super) fn unlikely(&self, parts: &Parts) -> f64 {
        let (covariance, prior) = (&self.free.covariance, &self.problem.prior);
        let fitted: Vec<usize> =
            parts.bodies.clone().filter(|at| covariance[(*at, *at)] > 0.0).collect();
        let narrowed = DMatrix::from_fn(fitted.len(), fitted.len(), |i, j| {
            let (i, j) = (fitted[i], fitted[j]);
            covariance[(i, j)] / (prior[i] * prior[j])
        });
        let narrowed = narrowed.symmetric_eigenvalues();
        self.cost() - narrowed.iter().map(|part| part.max(f64::EPSILON).ln()).sum::<f64>()
    }

    /// Returns what there is to be explained, with what was fitted of it, whether the bodies could be or not.
    pub(super) fn free(&self) -> (&Problem, &[Range<usize>], &Fit) {
        (&self.problem, &self.list, &self.free)
    }

    /// Returns the fit of all but the bodies, beside bodies that could be.
    pub(super) fn with(&self) -> &Fit {
        &self.with
    }

    /// Returns what it leaves of the recordings held out.
    pub(super) fn judged(&self, weights: &[f64]) -> f64 {
        self.problem.beside(&self.changes).judged(&self.with.x, weights)
    }

    /// Returns the links of them.
    pub(super) fn links(self, bodies: &[Body], is_better: bool) -> Links {
        let told = told(bodies, &self.changes, &self.free, &self.problem.prior);
        let Self { changes, has_load, .. } = self;
        Links { far: far(bodies, &told), changes, told, has_load, is_better }
    }
}

/// Says which number is furthest from the file's, if it is further than numbers of files are.
pub(super) fn far(bodies: &[Body], told: &[Identified]) -> Option<String> {
    let by = |number: &Identified| {
        let body = bodies.iter().find(|body| body.name == number.at)?;
        let at = NAMES.iter().position(|(name, _)| *name == number.parameter)?;
        Some((number.value - number.file).abs() / spread(body)[at])
    };
    let all = told.iter().filter_map(|number| Some((by(number)?, number)));
    let (by, number) = all.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (by > RARELY).then(|| wording::far_off(&number.parameter, &number.at, by))
}

/// Returns the numbers of which the data say more than the file does, and something else.
pub(super) fn told(
    bodies: &[Body],
    changes: &[[f64; NUMBERS]],
    fit: &Fit,
    prior: &[f64],
) -> Vec<Identified> {
    let mut found = Vec::new();
    for (b, (body, changes)) in bodies.iter().zip(changes).enumerate() {
        let own = numbers(body);
        for (k, (name, unit)) in NAMES.iter().enumerate() {
            let at = b * NUMBERS + k;
            let std = fit.covariance[(at, at)].max(0.0).sqrt();
            if std < TOLD * prior[at] && changes[k].abs() > 2.0 * std {
                found.push(Identified {
                    name: "inertial".into(),
                    at: body.name.clone(),
                    parameter: (*name).to_owned(),
                    file: own[k],
                    value: own[k] + changes[k],
                    std,
                    unit: (*unit).to_owned(),
                });
            }
        }
    }
    found
}
