//! Which parse graph: drawn at random, the best, the k best, or a few that differ.
//!
//! Guards come first: a branch whose guard is false is out, and the others share its probability. The
//! best parse is found from the bottom up (least over an Or, sum over an And), never by listing all
//! parses, and so are the k best.
//!
//! Sources: Huang and Chiang, "Better k-best parsing", IWPT 2005 (the k lists of children are merged);
//! Thompson, "On the likelihood that one unknown probability exceeds another", Biometrika 1933.

use std::collections::BTreeMap;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::outcome::{self, Outcomes, Priors};
use super::parse_graph::{self, Taken, is_at_or_below};
use super::{
    Branch, Decides, Definitions, Error, Graph, Holds, Node, NodeId, NodeKind, Or, ParseGraph,
};
use crate::language::ast::Expr;
use crate::language::text;

/// Where a branch's prior is below this, it is a curiosity and not tried for its success alone.
pub(super) const PLAUSIBLE: f64 = 0.02;

/// How the branch of a free Or is chosen.
#[derive(Debug, Clone, Copy)]
pub enum Policy<'a> {
    /// By prior probability, as people would.
    Prior,
    /// By a draw from each plausible branch's Beta(successes + 1, failures + 1): explores.
    Thompson {
        /// What came of earlier runs.
        outcomes: &'a Outcomes,
        /// Whose outcomes count: `"twin"` or `"real"`.
        domain: &'a str,
    },
    /// By the mean of that distribution, then by prior: does not explore.
    Greedy {
        /// What came of earlier runs.
        outcomes: &'a Outcomes,
        /// Whose outcomes count.
        domain: &'a str,
    },
}

/// What an inference may use.
#[derive(Clone, Copy)]
pub struct Given<'a> {
    /// Where fluents are looked up, for their questions.
    pub definitions: &'a dyn Definitions,
    /// Whether a guard holds now.
    pub holds: &'a dyn Holds,
    /// Branches a person or another parse has fixed: Or path → branch.
    pub pins: &'a BTreeMap<String, String>,
    /// Priors learnt from demonstrations, in place of those in the text.
    pub priors: Option<&'a Priors>,
    /// What one node costs beside its choices, natural logarithm: 0 when nothing is known.
    pub cost: &'a dyn Fn(&Node) -> f64,
}

/// Draws a parse graph from the top down. The same seed draws the same.
///
/// # Errors
///
/// [`Error::NoBranch`] where every guard is false, [`Error::NoSuchBranch`] for a pin that fits nothing.
pub fn sample(
    graph: &Graph,
    given: &Given<'_>,
    policy: &Policy<'_>,
    seed: u64,
) -> Result<ParseGraph, Error> {
    check_pins(graph, given.pins)?;
    let mut rng = StdRng::seed_from_u64(seed);
    let mut taken = BTreeMap::new();
    let mut open = vec![graph.root().id];
    while let Some(id) = open.pop() {
        let node = graph.node(id);
        match &node.kind {
            NodeKind::And(and) => open.extend(and.children.iter().rev()),
            NodeKind::Or(or) => {
                let support = support(node, or, given)?;
                let branch = if or.decides.is_free() {
                    draw(or, &support, policy, &mut rng)
                } else {
                    by_probability(&support.branches, &mut rng)
                };
                open.push(or.branches[branch].node);
                taken.insert(id, support.take(id, branch));
            }
            NodeKind::Terminal(_) => {}
        }
    }
    Ok(foresee(graph, given, taken))
}

/// Returns the parse graph of least energy: −ln p of its choices plus the cost of its nodes.
///
/// # Errors
///
/// As [`sample`].
pub fn best(graph: &Graph, given: &Given<'_>) -> Result<ParseGraph, Error> {
    let mut all = k_best(graph, given, 1)?;
    Ok(all.swap_remove(0))
}

/// Returns the `k` parse graphs of least energy, least first; fewer when the graph has fewer.
///
/// # Errors
///
/// As [`sample`]. An inner Or that no branch fits rules out what leads to it; only when nothing is left
/// is it an error.
pub fn k_best(graph: &Graph, given: &Given<'_>, k: usize) -> Result<Vec<ParseGraph>, Error> {
    check_pins(graph, given.pins)?;
    let found = list(graph, graph.root().id, given, k.max(1))?;
    Ok(found.into_iter().map(|way| foresee(graph, given, way.taken)).collect())
}

/// Returns up to `k` good parse graphs that differ in what people choose, the best first.
///
/// From the 8 k best, each next one is the one farthest from those taken, counted in choices that differ;
/// among equally far ones the better.
///
/// # Errors
///
/// As [`k_best`].
pub fn diverse(graph: &Graph, given: &Given<'_>, k: usize) -> Result<Vec<ParseGraph>, Error> {
    let mut rest = k_best(graph, given, k.saturating_mul(8))?;
    let mut picked = vec![rest.remove(0)];
    while picked.len() < k && !rest.is_empty() {
        let distance = |pg: &ParseGraph| {
            picked.iter().map(|other| choices_that_differ(pg, other)).min().unwrap_or(0)
        };
        let mut far = (0, distance(&rest[0]));
        for (i, pg) in rest.iter().enumerate().skip(1) {
            let d = distance(pg);
            if d > far.1 {
                far = (i, d);
            }
        }
        picked.push(rest.remove(far.0));
    }
    Ok(picked)
}

/// Returns how many free choices two parse graphs do not share.
pub fn choices_that_differ(a: &ParseGraph, b: &ParseGraph) -> usize {
    let (a, b) = (a.pins(), b.pins());
    let missing = b.keys().filter(|node| !a.contains_key(*node)).count();
    missing + a.iter().filter(|(node, branch)| b.get(*node) != Some(branch)).count()
}

/// After `step` of `failed` failed: the same choices but for the innermost free Or above that step that
/// has a branch not in `tried`, and the index of the step to go on from.
///
/// `tried` holds branches by Or path and gains the one that has just failed. `None` when everything above
/// the step was tried.
///
/// # Errors
///
/// As [`sample`]; a branch whose guard is false now counts as tried.
pub fn retry(
    graph: &Graph,
    given: &Given<'_>,
    failed: &ParseGraph,
    step: usize,
    tried: &mut BTreeMap<String, Vec<String>>,
) -> Result<Option<(ParseGraph, usize)>, Error> {
    let Some(at) = failed.steps.get(step).and_then(|step| graph.find(&step.path)) else {
        return Ok(None);
    };
    let mut node = at;
    while let Some(above) = node.parent {
        node = graph.node(above);
        let NodeKind::Or(or) = &node.kind else { continue };
        if !or.decides.is_free() {
            continue;
        }
        let done = tried.entry(node.path.clone()).or_default();
        if let Some(branch) = failed.branch(&node.path)
            && !done.iter().any(|b| b == branch)
        {
            done.push(branch.to_owned());
        }
        let without = BTreeMap::new();
        let Ok(mut support) = support(node, or, &Given { pins: &without, ..*given }) else {
            continue;
        };
        support.branches.retain(|(b, _)| !done.contains(&or.branches[*b].name));
        // The likeliest of those left; the first of equals.
        let next = support.branches.iter().rev().max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((next, _)) = next else { continue };
        let mut pins = failed.pins();
        pins.retain(|path, _| !is_at_or_below(path, &node.path));
        pins.extend(given.pins.iter().map(|(k, v)| (k.clone(), v.clone())));
        pins.insert(node.path.clone(), or.branches[*next].name.clone());
        let pg = best(graph, &Given { pins: &pins, ..*given })?;
        let from = pg.steps_of(&node.path).next().unwrap_or(step);
        return Ok(Some((pg, from)));
    }
    Ok(None)
}

/// After a step failed: the same parse graph, with what its recoveries do chosen anew by what holds now.
pub fn after_failure(graph: &Graph, given: &Given<'_>, failed: &ParseGraph) -> ParseGraph {
    let taken = failed.choices.iter().filter_map(|choice| {
        let node = graph.find(&choice.node)?;
        let NodeKind::Or(or) = &node.kind else { return None };
        let named = |name: &String| or.branches.iter().position(|branch| branch.name == *name);
        let taken = Taken {
            node: node.id,
            branch: named(&choice.branch)?,
            p: choice.p,
            possible: choice.possible.iter().filter_map(named).collect(),
            known: choice.assumed.as_ref().is_none_or(|assumed| assumed.is_known),
        };
        Some((node.id, taken))
    });
    finish(graph, given, taken.collect())
}

/// The branches of an Or that are possible, with their probabilities.
struct Support {
    branches: Vec<(usize, f64)>,
    /// Whether a decided Or was decided by somebody who knew.
    known: bool,
}

impl Support {
    fn take(&self, node: NodeId, branch: usize) -> Taken {
        let p = self.branches.iter().find(|(b, _)| *b == branch).map_or(0.0, |(_, p)| *p);
        let possible = self.branches.iter().map(|(b, _)| *b).collect();
        Taken { node, branch, p, possible, known: self.known }
    }
}

fn support(node: &Node, or: &Or, given: &Given<'_>) -> Result<Support, Error> {
    let via = or.via.map(|at| &or.branches[at].name);
    let pinned = given.pins.get(&node.path).or(via);
    let mut known = true;
    let mut branches: Vec<(usize, f64)> = match &or.decides {
        Decides::Choice | Decides::Argument(_) => {
            let learnt = given.priors.map(|priors| priors.of(or));
            let prior = |i: usize| learnt.as_ref().map_or(or.branches[i].prior, |p| p[i]);
            let possible = |branch: &Branch| {
                branch.guard.as_ref().is_none_or(|guard| given.holds.holds(guard) != Some(false))
            };
            let all = or.branches.iter().enumerate();
            all.filter(|(_, branch)| possible(branch)).map(|(i, _)| (i, prior(i))).collect()
        }
        Decides::Condition(condition) => match given.holds.holds(condition) {
            Some(true) => vec![(0, 1.0)],
            Some(false) => vec![(1, 1.0)],
            None => {
                known = false;
                vec![(0, 0.5), (1, 0.5)]
            }
        },
        // Planned in full; a run that is done sooner passes over the rest.
        Decides::Repetition(_) => vec![(0, 0.0), (1, 1.0)],
        Decides::Recovery => vec![(0, 1.0)],
    };
    if let Some(pin) = pinned {
        branches.retain(|(i, _)| or.branches[*i].name == *pin);
        if let [(_, p)] = branches.as_mut_slice() {
            *p = 1.0;
        }
    }
    branches.retain(|(_, p)| *p > 0.0);
    let total: f64 = branches.iter().map(|(_, p)| p).sum();
    for (_, p) in &mut branches {
        *p /= total;
    }
    if branches.is_empty() {
        let guards = or.branches.iter().map(|branch| match (&branch.guard, &or.decides) {
            (Some(guard), _) => format!("`{}` only when {}", branch.name, text::expr(guard)),
            (None, Decides::Condition(c)) => format!("`{}` by {}", branch.name, text::expr(c)),
            (None, _) => format!("`{}` not asked for", branch.name),
        });
        let why = guards.collect::<Vec<_>>().join(", ");
        return Err(Error::NoBranch { node: node.path.clone(), why });
    }
    Ok(Support { branches, known })
}

fn check_pins(graph: &Graph, pins: &BTreeMap<String, String>) -> Result<(), Error> {
    for (path, branch) in pins {
        let known = match graph.find(path).map(|node| &node.kind) {
            Some(NodeKind::Or(or)) => or.branches.iter().map(|b| b.name.clone()).collect(),
            _ => Vec::new(),
        };
        if !known.contains(branch) {
            let (node, branch) = (path.clone(), branch.clone());
            return Err(Error::NoSuchBranch { node, branch, known });
        }
    }
    Ok(())
}

fn draw(or: &Or, support: &Support, policy: &Policy<'_>, rng: &mut StdRng) -> usize {
    let scores = |score: &mut dyn FnMut(&Branch) -> f64| {
        let plausible = support.branches.iter().filter(|(_, p)| *p >= PLAUSIBLE);
        let mut top: Option<(usize, f64, f64)> = None;
        for (i, p) in plausible {
            let s = score(&or.branches[*i]);
            // A later branch has to be better, or as good and likelier.
            if top.is_none_or(|(_, best, prior)| s > best || (s >= best && *p > prior)) {
                top = Some((*i, s, *p));
            }
        }
        top.map_or(support.branches[0].0, |(i, ..)| i)
    };
    match policy {
        Policy::Prior => by_probability(&support.branches, rng),
        Policy::Thompson { outcomes, domain } => {
            scores(&mut |branch| outcome::draw_beta(&outcomes.of(branch, domain), rng))
        }
        Policy::Greedy { outcomes, domain } => {
            scores(&mut |branch| outcomes.of(branch, domain).mean())
        }
    }
}

fn by_probability(branches: &[(usize, f64)], rng: &mut StdRng) -> usize {
    let mut left: f64 = rng.random();
    for (branch, p) in branches {
        left -= p;
        if left < 0.0 {
            return *branch;
        }
    }
    // Rounding may leave a hair; it belongs to the last.
    branches[branches.len() - 1].0
}

/// One way through part of the graph.
#[derive(Clone)]
struct Way {
    energy: f64,
    taken: BTreeMap<NodeId, Taken>,
}

/// Returns the `k` ways of least energy through what lies below a node, least first.
fn list(graph: &Graph, id: NodeId, given: &Given<'_>, k: usize) -> Result<Vec<Way>, Error> {
    let node = graph.node(id);
    let own = (given.cost)(node);
    let mut ways = match &node.kind {
        NodeKind::Terminal(_) => vec![Way { energy: 0.0, taken: BTreeMap::new() }],
        NodeKind::And(and) => {
            let mut ways = vec![Way { energy: 0.0, taken: BTreeMap::new() }];
            for child in &and.children {
                ways = merge(&ways, &list(graph, *child, given, k)?, k);
            }
            ways
        }
        NodeKind::Or(or) => {
            let support = support(node, or, given)?;
            let mut ways = Vec::new();
            let mut stuck = None;
            for (branch, p) in &support.branches {
                match list(graph, or.branches[*branch].node, given, k) {
                    Ok(below) => ways.extend(below.into_iter().map(|mut way| {
                        way.energy -= p.ln();
                        way.taken.insert(id, support.take(id, *branch));
                        way
                    })),
                    Err(error) => stuck = Some(error),
                }
            }
            if let (true, Some(error)) = (ways.is_empty(), stuck) {
                return Err(error);
            }
            // Stable, so that of equals the one written first comes first.
            ways.sort_by(|a, b| a.energy.total_cmp(&b.energy));
            ways.truncate(k);
            ways
        }
    };
    for way in &mut ways {
        way.energy += own;
    }
    Ok(ways)
}

/// Returns the `k` cheapest pairs of two sorted lists.
///
/// Only pairs (i, j) with (i + 1)(j + 1) ≤ k can be among them: every pair with smaller indices is at
/// least as cheap.
fn merge(a: &[Way], b: &[Way], k: usize) -> Vec<Way> {
    let mut pairs = Vec::new();
    for (i, x) in a.iter().enumerate().take(k) {
        for (j, y) in b.iter().enumerate().take(k / (i + 1)) {
            pairs.push((x.energy + y.energy, i, j));
        }
    }
    pairs.sort_by(|x, y| x.0.total_cmp(&y.0));
    pairs.truncate(k);
    let join = |(energy, i, j): (f64, usize, usize)| {
        let mut taken = a[i].taken.clone();
        taken.extend(b[j].taken.clone());
        Way { energy, taken }
    };
    pairs.into_iter().map(join).collect()
}

/// Writes a parse graph out before anything has failed: what will be known when something has is not known
/// now, so no guard is asked in recoveries.
fn foresee(graph: &Graph, given: &Given<'_>, taken: BTreeMap<NodeId, Taken>) -> ParseGraph {
    let later = |_: &Expr| None;
    finish(graph, &Given { holds: &later, ..*given }, taken)
}

/// Adds the choices inside recoveries, which are not part of the probability, and writes the parse graph out.
fn finish(graph: &Graph, given: &Given<'_>, taken: BTreeMap<NodeId, Taken>) -> ParseGraph {
    let mut taken = taken;
    let no_pins = BTreeMap::new();
    let free = |_: &Node| 0.0;
    let given = Given { pins: &no_pins, cost: &free, ..*given };
    for node in graph.nodes() {
        let NodeKind::And(and) = &node.kind else { continue };
        if !matches!(and.form, super::Form::Recovery { .. }) {
            continue;
        }
        if let Ok(ways) = list(graph, node.id, &given, 1)
            && let Some(way) = ways.into_iter().next()
        {
            for (id, choice) in way.taken {
                taken.entry(id).or_insert(choice);
            }
        }
    }
    parse_graph::realise(graph, given.definitions, &taken)
}
