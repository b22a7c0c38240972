//! Two numbers for every branch: how people choose (prior) and how often it worked (success).
//!
//! [`Priors`] are learnt from demonstrations alone. A robot's own runs feed [`Outcomes`] and never the
//! priors: fed by its own choices, a prior of 0.7 for the worse of two branches stays there for good.
//! Twin and arm are counted apart. Outcomes are an append-only file of JSON lines, so two programs may
//! write and nothing is lost when one of them stops half-way.

use std::collections::{BTreeMap, BTreeSet};

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde::{Deserialize, Serialize};

use super::infer::PLAUSIBLE;
use super::{Branch, Error, Graph, NodeId, NodeKind, Or, ParseGraph};

/// How many demonstrations the prior in the text is worth.
const PRIOR_STRENGTH: f64 = 10.0;

/// How often a branch worked and failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Counts {
    /// Worked.
    pub worked: u32,
    /// Failed.
    pub failed: u32,
}

impl Counts {
    /// Returns the mean of Beta(worked + 1, failed + 1).
    pub fn mean(&self) -> f64 {
        (f64::from(self.worked) + 1.0) / (f64::from(self.worked) + f64::from(self.failed) + 2.0)
    }

    /// Returns how often it was tried.
    pub fn tries(&self) -> u32 {
        self.worked + self.failed
    }
}

/// One line of an outcomes file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Outcome {
    /// The branch: `pick/either.side`.
    pub branch: String,
    /// Fingerprint of the branch's text, hexadecimal.
    pub text: String,
    /// `"twin"` or `"real"`.
    pub domain: String,
    /// Whether it worked.
    pub worked: bool,
    /// The run it comes from.
    pub run: String,
}

/// What came of every branch in earlier runs.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Outcomes {
    counts: BTreeMap<(String, String, String), Counts>,
}

impl Outcomes {
    /// Reads the lines of an outcomes file.
    ///
    /// # Errors
    ///
    /// [`Error::Outcomes`] with the line that is not an outcome. A line that a crash cut short, which has
    /// no closing brace, is passed over.
    pub fn read(lines: &str) -> Result<Self, Error> {
        let mut all = Self::default();
        for (i, line) in lines.lines().enumerate() {
            if line.trim().is_empty() {
                continue;
            }
            match serde_json::from_str(line) {
                Ok(outcome) => all.add(&outcome),
                Err(_) if line.starts_with('{') && !line.trim_end().ends_with('}') => {}
                Err(error) => {
                    return Err(Error::Outcomes { line: i + 1, why: error.to_string() });
                }
            }
        }
        Ok(all)
    }

    /// Returns whether anything is known.
    pub fn is_empty(&self) -> bool {
        self.counts.is_empty()
    }

    /// Returns every branch with its counts: key, fingerprint, domain.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str, &str, Counts)> {
        self.counts.iter().map(|((branch, text, domain), counts)| {
            (branch.as_str(), text.as_str(), domain.as_str(), *counts)
        })
    }

    /// Counts one outcome.
    pub fn add(&mut self, outcome: &Outcome) {
        let key = (outcome.branch.clone(), outcome.text.clone(), outcome.domain.clone());
        let counts = self.counts.entry(key).or_default();
        if outcome.worked {
            counts.worked += 1;
        } else {
            counts.failed += 1;
        }
    }

    /// Returns the counts of a branch as it is written today, under its name and those it had before.
    pub fn of(&self, branch: &Branch, domain: &str) -> Counts {
        let keys = std::iter::once(&branch.key).chain(&branch.was);
        keys.map(|key| self.at(key, branch.text, domain)).fold(Counts::default(), |a, b| Counts {
            worked: a.worked + b.worked,
            failed: a.failed + b.failed,
        })
    }

    /// Returns the counts that hang on a key and a fingerprint.
    pub fn at(&self, key: &str, text: u64, domain: &str) -> Counts {
        let key = (key.to_owned(), fingerprint(text), domain.to_owned());
        self.counts.get(&key).copied().unwrap_or_default()
    }
}

/// Returns one outcome for every free choice of a run, to be counted and written to the file.
///
/// `worked(path)` says whether the Or of that path did what it was for; `None` when the run never came
/// so far, which is no outcome.
pub fn outcomes_of(
    pg: &ParseGraph,
    domain: &str,
    run: &str,
    worked: impl Fn(&str) -> Option<bool>,
) -> Vec<Outcome> {
    let free = pg.choices.iter().filter(|choice| choice.is_free);
    let known = free.filter_map(|choice| {
        Some(Outcome {
            branch: choice.key.clone(),
            text: choice.text.clone(),
            domain: domain.to_owned(),
            worked: worked(&choice.node)?,
            run: run.to_owned(),
        })
    });
    known.collect()
}

/// Priors from demonstrations: relative frequency, with the text's prior as ten earlier ones.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Priors {
    /// How often people took each branch, by key.
    pub counts: BTreeMap<String, u32>,
    /// The runs that are counted in them. Files of older programs name none.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub runs: BTreeSet<String>,
}

impl Priors {
    /// Counts what a person asked for in one demonstration, and nothing that the robot chose in it. Returns how many
    /// branches that were.
    pub fn learn(&mut self, demonstration: &ParseGraph) -> usize {
        let asked = demonstration.choices.iter().filter(|choice| choice.is_free && choice.is_asked);
        let mut found = 0;
        for choice in asked {
            *self.counts.entry(choice.key.clone()).or_default() += 1;
            found += 1;
        }
        found
    }

    /// Returns the probability of each branch of an Or; they add up to 1.
    pub fn of(&self, or: &Or) -> Vec<f64> {
        let seen = |branch: &Branch| {
            let keys = std::iter::once(&branch.key).chain(&branch.was);
            f64::from(keys.filter_map(|key| self.counts.get(key)).sum::<u32>())
        };
        let total: f64 = PRIOR_STRENGTH + or.branches.iter().map(seen).sum::<f64>();
        or.branches.iter().map(|b| PRIOR_STRENGTH.mul_add(b.prior, seen(b)) / total).collect()
    }
}

/// Returns what each branch of the free Ors costs beside its prior, nats, so that what worked decides
/// among the plausible branches and the prior decides only while nothing is known.
///
/// A branch is worth the mean of its Beta distribution, or with `explore` a draw from it under that seed
/// (Thompson). An Or none of whose branches was ever tried costs nothing.
pub fn costs(
    graph: &Graph,
    outcomes: &Outcomes,
    domain: &str,
    priors: Option<&Priors>,
    explore: Option<u64>,
) -> BTreeMap<NodeId, f64> {
    let mut rng = StdRng::seed_from_u64(explore.unwrap_or(0));
    let mut costs = BTreeMap::new();
    for node in graph.nodes() {
        let NodeKind::Or(or) = &node.kind else { continue };
        let tried = or.branches.iter().any(|branch| outcomes.of(branch, domain).tries() > 0);
        if !or.decides.is_free() || !tried {
            continue;
        }
        let written = || or.branches.iter().map(|branch| branch.prior).collect();
        let shares: Vec<f64> = priors.map_or_else(written, |priors| priors.of(or));
        for (branch, prior) in or.branches.iter().zip(shares) {
            if prior < PLAUSIBLE {
                continue;
            }
            let counts = outcomes.of(branch, domain);
            let worth =
                if explore.is_some() { draw_beta(&counts, &mut rng) } else { counts.mean() };
            // Takes the prior's own −ln p back and puts the success in its place.
            costs.insert(branch.node, prior.ln() - worth.max(1e-6).ln());
        }
    }
    costs
}

/// Draws from Beta(worked + 1, failed + 1).
pub fn draw_beta(counts: &Counts, rng: &mut StdRng) -> f64 {
    let a = draw_gamma(f64::from(counts.worked) + 1.0, rng);
    let b = draw_gamma(f64::from(counts.failed) + 1.0, rng);
    a / (a + b)
}

/// Draws from Gamma(shape, 1), shape ≥ 1.
///
/// Source: Marsaglia and Tsang, "A simple method for generating gamma variables", ACM TOMS 26, 2000.
fn draw_gamma(shape: f64, rng: &mut StdRng) -> f64 {
    let d = shape - 1.0 / 3.0;
    let c = 1.0 / (9.0 * d).sqrt();
    loop {
        let x = draw_normal(rng);
        let v = (1.0 + c * x).powi(3);
        if v <= 0.0 {
            continue;
        }
        let u: f64 = 1.0 - rng.random::<f64>();
        if u.ln() < 0.5 * x * x + d - d * v + d * v.ln() {
            return d * v;
        }
    }
}

/// Draws from N(0, 1) by Box and Muller's formula.
fn draw_normal(rng: &mut StdRng) -> f64 {
    let u: f64 = 1.0 - rng.random::<f64>();
    let v: f64 = rng.random();
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// Writes a fingerprint as files hold it.
pub(super) fn fingerprint(text: u64) -> String {
    format!("{text:016x}")
}
