//! How well a parse graph fits what was measured, as energies kept apart by where they come from.
//!
//! `E = Σ_Or −ln p + Σ_relations E_T + Σ_needs E_S + Σ_gives E_C + Σ_fluents E_data`; children of an And
//! are added, never averaged, since an average hides one impossible child. Every term is in nats.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::parse_graph::is_at_or_below;
use super::relation::{Interval, time_error};
use super::{Condition, ParseGraph};

/// What a false condition without a margin costs, nats (vcla/Causality's "impossible").
const IMPOSSIBLE: f64 = 10.0;
/// A relation off by this much costs one nat, s: chosen as a person's notion of "at the same time".
const TIME_SCALE: f64 = 0.1;
/// How often a fluent is misjudged where nothing better is known: `e⁻¹ / (1 + e⁻¹)`, for which `E_data`
/// differs from the paper's Hamming distance by a constant per fluent.
pub const PAPER_ERROR_RATE: f64 = 0.268_941_421_369_995_1;

/// The energy of one parse graph, term by term, nats.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Energy {
    /// −ln of the probability of the choices.
    pub choice: f64,
    /// Temporal relations that did not hold.
    pub temporal: f64,
    /// Conditions that did not hold before or during a step.
    pub spatial: f64,
    /// Promised effects that did not come.
    pub causal: f64,
    /// Fluents measured other than expected.
    pub data: f64,
}

impl Energy {
    /// Returns the sum of the terms.
    pub fn total(&self) -> f64 {
        self.choice + self.temporal + self.spatial + self.causal + self.data
    }
}

/// A condition as it was found.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Found {
    /// Whether it held; `None` when nobody knew.
    pub truth: Option<bool>,
    /// By how many standard deviations: positive when it held.
    pub margin_in_sigmas: Option<f64>,
}

/// A fluent as expected (by the twin) and as measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Compared {
    /// The fluent.
    pub fluent: String,
    /// What the twin says.
    pub expected: Option<bool>,
    /// What was measured.
    pub measured: Option<bool>,
    /// How often measuring it goes wrong; [`PAPER_ERROR_RATE`] when nothing is known.
    pub error_rate: f64,
}

/// What is known of a run, by step path.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Evidence {
    /// When each step ran.
    pub intervals: BTreeMap<String, Interval>,
    /// Conditions as found: step path → condition text → finding.
    pub found: BTreeMap<String, BTreeMap<String, Found>>,
    /// Fluents after steps, twin beside measured.
    pub compared: Vec<Compared>,
}

impl Evidence {
    /// Returns when a node of the graph ran: the interval that covers all its steps.
    pub fn interval(&self, path: &str) -> Option<Interval> {
        let below = self.intervals.iter().filter(|(step, _)| is_at_or_below(step, path));
        below.map(|(_, interval)| *interval).reduce(Interval::hull)
    }
}

/// Returns the energy of a parse graph given what is known; what is not known costs nothing.
pub fn energy(pg: &ParseGraph, evidence: &Evidence) -> Energy {
    let mut energy = Energy { choice: -pg.log_p, ..Energy::default() };
    for timing in &pg.timings {
        let (a, b) = (evidence.interval(&timing.a), evidence.interval(&timing.b));
        if let (Some(a), Some(b)) = (a, b) {
            energy.temporal += time_error(a, timing.relation, b, timing.by) / TIME_SCALE;
        }
    }
    for step in &pg.steps {
        let found = evidence.found.get(&step.path);
        let cost = |all: &[Condition]| -> f64 {
            let each = all.iter().filter_map(|condition| found?.get(&condition.text));
            each.map(Found::cost).sum()
        };
        energy.spatial += cost(&step.needs) + cost(&step.keeps);
        energy.causal += cost(&step.gives);
    }
    energy.data = evidence.compared.iter().map(Compared::cost).sum();
    energy
}

impl Found {
    /// `max(0, −m/σ)`; without a margin a false condition counts as impossible.
    fn cost(&self) -> f64 {
        match (self.margin_in_sigmas, self.truth) {
            (Some(margin), _) if margin.is_finite() => (-margin).clamp(0.0, IMPOSSIBLE),
            (_, Some(false)) => IMPOSSIBLE,
            _ => 0.0,
        }
    }
}

impl Compared {
    /// −ln p(measured | expected).
    fn cost(&self) -> f64 {
        let rate = self.error_rate.clamp(1e-6, 1.0 - 1e-6);
        match (self.expected, self.measured) {
            (Some(expected), Some(measured)) if expected == measured => -(1.0 - rate).ln(),
            (Some(_), Some(_)) => -rate.ln(),
            _ => 0.0,
        }
    }
}
