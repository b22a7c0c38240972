//! The graph as an indented tree of text, for a terminal.
//!
//! ```text
//! pick(jar)                            And
//! ├─ either                            Or   (5 outcomes on the arm)
//! │  ├─ side   prior 0.70   worked 9 of 10   when tall(jar)
//! ```

use std::fmt::Write as _;

use super::{And, Branch, Decides, Form, Graph, Node, NodeId, NodeKind, Outcomes, Priors, Role};
use crate::language::text;

/// Where the kind of a node stands, in characters from the left.
const COLUMN: usize = 44;

/// What is shown beside the text's own numbers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Learnt<'a> {
    /// What came of earlier runs, and whose: `"twin"` or `"real"`.
    pub outcomes: Option<(&'a Outcomes, &'a str)>,
    /// Priors from demonstrations.
    pub priors: Option<&'a Priors>,
    /// Without box-drawing characters.
    pub is_plain: bool,
}

/// Returns the tree of the graph, a line per node, ending in a newline.
///
/// Runs of steps without inner structure share a line: `approach(jar, side) ─meets─ grasp(jar, side)`.
pub fn outline(graph: &Graph, learnt: &Learnt<'_>) -> String {
    let mut writer = Writer { graph, learnt, text: String::new() };
    writer.node(graph.root().id, "", "", None);
    writer.text
}

struct Writer<'a> {
    graph: &'a Graph,
    learnt: &'a Learnt<'a>,
    text: String,
}

impl Writer<'_> {
    /// Writes a node after `first`, and what is below it after `rest`.
    fn node(&mut self, id: NodeId, first: &str, rest: &str, branch: Option<(&Branch, f64)>) {
        let node = self.graph.node(id);
        let said = match branch {
            Some((branch, prior)) => self.branch(branch, prior, node),
            None => node.label.clone(),
        };
        match &node.kind {
            NodeKind::Terminal(_) => self.line(first, &format!("{said}{}", holds(node)), ""),
            NodeKind::Or(or) => {
                let note = match &or.decides {
                    Decides::Choice | Decides::Argument(_) => self.tried(or),
                    _ => String::new(),
                };
                let via = or.via.map(|at| format!(" via {}", or.branches[at].name));
                self.line(
                    first,
                    &format!("{said}{}", via.unwrap_or_default()),
                    &format!("Or{note}"),
                );
                let priors = self.learnt.priors.map(|priors| priors.of(or));
                let count = or.branches.len();
                for (i, branch) in or.branches.iter().enumerate() {
                    let prior = priors.as_ref().map_or(branch.prior, |p| p[i]);
                    let is_free = or.decides.is_free();
                    let shown = if is_free { prior } else { f64::NAN };
                    if matches!(or.decides, Decides::Recovery) && branch.name == "nominal" {
                        continue;
                    }
                    let (tee, bar) = self.branches(i + 1 == count);
                    let (first, rest) = (format!("{rest}{tee}"), format!("{rest}{bar}"));
                    self.node(branch.node, &first, &rest, Some((branch, shown)));
                }
            }
            NodeKind::And(and) => {
                let kind = match and.form {
                    Form::Task(_) => "And",
                    Form::Together => "And, together",
                    Form::Repeat => "And, in turn",
                    _ => "",
                };
                self.line(first, &format!("{said}{}", holds(node)), kind);
                self.inside(node, and, rest);
            }
        }
    }

    fn inside(&mut self, node: &Node, and: &And, rest: &str) {
        // Consecutive terminals without conditions share a line.
        let mut groups: Vec<Vec<NodeId>> = Vec::new();
        for child in &and.children {
            let node = self.graph.node(*child);
            let is_simple = matches!(node.kind, NodeKind::Terminal(_)) && holds(node).is_empty();
            match groups.last_mut() {
                Some(group) if is_simple && and.form == Form::Sequence => {
                    let last = self.graph.node(group[group.len() - 1]);
                    let fits = matches!(last.kind, NodeKind::Terminal(_)) && holds(last).is_empty();
                    if fits { group.push(*child) } else { groups.push(vec![*child]) }
                }
                _ => groups.push(vec![*child]),
            }
        }
        let remedy = match &and.form {
            Form::Recovery { remedy, .. } => remedy.as_ref().map(text::remedy),
            _ => None,
        };
        let conditions: Vec<String> = [
            ("needs", &and.causes.needs),
            ("keeps", &and.causes.keeps),
            ("gives", &and.causes.gives),
        ]
        .iter()
        .filter(|_| matches!(and.form, Form::Task(_)))
        .flat_map(|(word, all)| all.iter().map(move |e| format!("{word} {}", text::expr(e))))
        .collect();
        let timings = self.timings(node);
        let below = groups.len()
            + and.recoveries.len()
            + usize::from(remedy.is_some())
            + conditions.len()
            + timings.len();
        let mut written = 0;
        let mut next = |writer: &Self| {
            written += 1;
            writer.branches(written == below)
        };
        for group in &groups {
            let (tee, bar) = next(self);
            if let [one] = group.as_slice() {
                self.node(*one, &format!("{rest}{tee}"), &format!("{rest}{bar}"), None);
            } else {
                let labels: Vec<_> =
                    group.iter().map(|id| self.graph.node(*id).label.as_str()).collect();
                let joint = if self.learnt.is_plain { " -meets- " } else { " ─meets─ " };
                self.line(&format!("{rest}{tee}"), &labels.join(joint), "");
            }
        }
        for recovery in &and.recoveries {
            let (tee, bar) = next(self);
            self.node(*recovery, &format!("{rest}{tee}"), &format!("{rest}{bar}"), None);
        }
        for line in timings.into_iter().chain(remedy).chain(conditions) {
            let (tee, _) = next(self);
            self.line(&format!("{rest}{tee}"), &line, "");
        }
    }

    /// `timing` lines of a `together`.
    fn timings(&self, node: &Node) -> Vec<String> {
        let NodeKind::And(and) = &node.kind else { return Vec::new() };
        if and.form != Form::Together {
            return Vec::new();
        }
        let all = self.graph.relations.iter().filter_map(|relation| match relation {
            super::Relation::Temporal { a, allen, b, by } if and.children.contains(a) => {
                let name = |id: &NodeId| {
                    let path = &self.graph.node(*id).path;
                    path.rsplit(['/', '.']).next().unwrap_or(path).to_owned()
                };
                let by = by.map(|s| format!(" by {s} s")).unwrap_or_default();
                Some(format!("{} {} {}{by}", name(a), text::allen(*allen), name(b)))
            }
            _ => None,
        });
        all.collect()
    }

    fn branch(&self, branch: &Branch, prior: f64, node: &Node) -> String {
        let mut said = branch.name.clone();
        if prior.is_finite() {
            let _ = write!(said, "   prior {prior:.2}");
        }
        if let Some((outcomes, domain)) = self.learnt.outcomes {
            let counts = outcomes.of(branch, domain);
            if counts.tries() > 0 {
                let _ = write!(said, "   worked {} of {}", counts.worked, counts.tries());
            }
        }
        if let Some(guard) = &branch.guard {
            let _ = write!(said, "   when {}", text::expr(guard));
        }
        let is_call = match &node.kind {
            NodeKind::And(and) => matches!(and.form, Form::Task(_)),
            _ => true,
        };
        if is_call {
            let _ = write!(said, "   {}", node.label);
        }
        said
    }

    fn tried(&self, or: &super::Or) -> String {
        let Some((outcomes, domain)) = self.learnt.outcomes else { return String::new() };
        let n: u32 = or.branches.iter().map(|b| outcomes.of(b, domain).tries()).sum();
        let whose = if domain == "real" { "on the arm" } else { "in the twin" };
        match n {
            0 => format!("   (no outcomes {whose} yet)"),
            1 => format!("   (1 outcome {whose})"),
            n => format!("   ({n} outcomes {whose})"),
        }
    }

    fn branches(&self, is_last: bool) -> (&'static str, &'static str) {
        match (self.learnt.is_plain, is_last) {
            (false, false) => ("├─ ", "│  "),
            (false, true) => ("└─ ", "   "),
            (true, false) => ("|- ", "|  "),
            (true, true) => ("`- ", "   "),
        }
    }

    fn line(&mut self, before: &str, said: &str, kind: &str) {
        let line = format!("{before}{said}");
        let gap = COLUMN.saturating_sub(line.chars().count()).max(2);
        self.text.push_str(&line);
        if !kind.is_empty() {
            self.text.extend(std::iter::repeat_n(' ', gap));
            self.text.push_str(kind);
        }
        self.text.push('\n');
    }
}

/// Returns `   while …   until …` of a step.
fn holds(node: &Node) -> String {
    let holding = match &node.kind {
        NodeKind::And(and) => &and.holding,
        NodeKind::Terminal(terminal) => &terminal.holding,
        NodeKind::Or(_) => return String::new(),
    };
    let mut said = String::new();
    for e in &holding.whiles {
        let _ = write!(said, "   while {}", text::expr(e));
    }
    for e in &holding.untils {
        let _ = write!(said, "   {} {}", Role::Until.word(), text::expr(e));
    }
    said
}
