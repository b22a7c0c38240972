//! A task call → a spatial-temporal-causal And-Or graph, and the parse graphs it allows.
//!
//! Going down the tree, an And node is a sub-task and lists its steps, an Or node is a choice between
//! named branches (or between the values of an argument), a terminal is one atomic action with the
//! fluents it needs, keeps and gives. Across the tree run three kinds of relation: temporal (Allen's
//! intervals), causal (terminal → fluent) and spatial (fluent over objects). A [`Graph`] is constant
//! once built; a [`ParseGraph`] is one choice at every Or and is what an executor walks.
//!
//! Nothing here knows geometry: whether a fluent holds is asked through [`Holds`].
//!
//! Sources: Zeng, Zhao and Wu, "Triple Regression for `Sim2Real` Adaptation", section 2.1; Xiong, Shukla,
//! Xiong and Zhu, "Robot Learning with a Spatial, Temporal, and Causal And-Or Graph", ICRA 2016.

mod bind;
pub mod build;
pub mod draw;
pub mod energy;
pub mod exchange;
pub mod fluent;
pub mod infer;
pub mod outcome;
pub mod outline;
pub mod parse_graph;
pub mod relation;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use exchange::{Unread, Unsaid};

use crate::language::Library;
use crate::language::ast::{
    ActionItem, Call, Expr, FluentItem, Item, Param, Program, Span, TaskItem,
};

pub use build::build;
pub use energy::{Energy, Evidence};
pub use fluent::FluentNode;
pub use infer::{Policy, after_failure, best, diverse, k_best, retry, sample};
pub use outcome::{Counts, Outcomes, Priors};
pub use parse_graph::{
    Choice, Condition, Matched, ParseGraph, RecoveryPlan, Step, TimeLimit, is_at_or_below,
};
pub use relation::{Interval, Relation, Role, time_error};

/// Where the graph looks up what a program calls; the language's library implements it.
pub trait Definitions {
    /// Returns the task of that name.
    fn task(&self, name: &str) -> Option<&TaskItem>;
    /// Returns the action of that name.
    fn action(&self, name: &str) -> Option<&ActionItem>;
    /// Returns the fluent of that name.
    fn fluent(&self, name: &str) -> Option<&FluentItem>;
    /// Returns the name of the file a task, action or fluent was read from.
    fn file_of(&self, _name: &str) -> Option<&str> {
        None
    }
    /// Returns the text of an action's script, so that editing it starts new counts.
    fn script(&self, _path: &str) -> Option<&str> {
        None
    }
    /// Returns the names of the things of a type that stand in the scene, in its order; none where no scene is known.
    fn things(&self, _kind: &str) -> Vec<String> {
        Vec::new()
    }
}

/// One file by itself; a later item of the same name replaces an earlier one.
impl Definitions for Program {
    fn task(&self, name: &str) -> Option<&TaskItem> {
        self.items.iter().rev().find_map(|item| match item {
            Item::Task(task) if task.name.text == name => Some(task),
            _ => None,
        })
    }

    fn action(&self, name: &str) -> Option<&ActionItem> {
        self.items.iter().rev().find_map(|item| match item {
            Item::Action(action) if action.name.text == name => Some(action),
            _ => None,
        })
    }

    fn fluent(&self, name: &str) -> Option<&FluentItem> {
        self.items.iter().rev().find_map(|item| match item {
            Item::Fluent(fluent) if fluent.name.text == name => Some(fluent),
            _ => None,
        })
    }
}

/// Answers whether a closed expression holds now; `None` when nobody knows.
///
/// Any `Fn(&Expr) -> Option<bool>` is one.
pub trait Holds {
    /// Returns whether `what` holds, `None` when it is not known.
    fn holds(&self, what: &Expr) -> Option<bool>;
}

impl<F: Fn(&Expr) -> Option<bool>> Holds for F {
    fn holds(&self, what: &Expr) -> Option<bool> {
        self(what)
    }
}

/// The stdlib with a user's files over it.
impl Definitions for Library {
    fn task(&self, name: &str) -> Option<&TaskItem> {
        Some(self.task(name)?.0)
    }

    fn action(&self, name: &str) -> Option<&ActionItem> {
        Some(self.action(name)?.0)
    }

    fn fluent(&self, name: &str) -> Option<&FluentItem> {
        Some(self.fluent(name)?.0)
    }

    fn file_of(&self, name: &str) -> Option<&str> {
        let of_callable = self.callable(name).map(|(_, source)| source);
        let source = of_callable.or_else(|| self.fluent(name).map(|(_, source)| source))?;
        Some(&source.name)
    }
}

/// A library beside a scene, whose things `for` goes through.
#[derive(Clone, Copy)]
pub struct InScene<'a> {
    /// What tasks, actions and fluents mean.
    pub library: &'a Library,
    /// The name of the scene.
    pub scene: &'a str,
}

impl Definitions for InScene<'_> {
    fn task(&self, name: &str) -> Option<&TaskItem> {
        Definitions::task(self.library, name)
    }

    fn action(&self, name: &str) -> Option<&ActionItem> {
        Definitions::action(self.library, name)
    }

    fn fluent(&self, name: &str) -> Option<&FluentItem> {
        Definitions::fluent(self.library, name)
    }

    fn file_of(&self, name: &str) -> Option<&str> {
        Definitions::file_of(self.library, name)
    }

    fn script(&self, path: &str) -> Option<&str> {
        Definitions::script(self.library, path)
    }

    fn things(&self, kind: &str) -> Vec<String> {
        let Some((scene, _)) = self.library.scene(self.scene) else { return Vec::new() };
        let things = scene.things.iter().filter(|thing| self.library.is_a(&thing.ty.text, kind));
        things.map(|thing| thing.name.text.clone()).filter(|name| name != "table").collect()
    }
}

/// What stands in the way of building a graph.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{message}")]
pub struct Problem {
    /// A short stable code: `graph::recursion`, `graph::unknown`, …
    pub code: &'static str,
    /// One sentence.
    pub message: String,
    /// The bytes it is about, of the file that `within` was read from.
    pub span: Span,
    /// The task whose text `span` points into; empty for the call that was asked for.
    pub within: String,
    /// What would help.
    pub help: Option<String>,
}

/// What can go wrong with a graph that was built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// Every branch of an Or is ruled out.
    #[error("no branch of `{node}` is possible now: {why}")]
    NoBranch {
        /// The path of the Or.
        node: String,
        /// The guard of each branch, in words.
        why: String,
    },
    /// A pin names an Or or a branch that is not there.
    #[error("`{node}` has no branch `{branch}`{}", if .known.is_empty() { String::new() }
        else { format!("; it has {}", .known.join(", ")) })]
    NoSuchBranch {
        /// The path of the Or.
        node: String,
        /// The branch asked for.
        branch: String,
        /// The branches there are; empty when there is no such Or.
        known: Vec<String>,
    },
    /// What a graph has and no text can say.
    #[error("no text of the language is this graph: {0}")]
    Text(Unsaid),
    /// A file with a graph cannot be read.
    #[error("the graph cannot be read: {0}")]
    Exchange(Unread),
    /// A file with outcomes cannot be read.
    #[error("line {line} of the outcomes is not an outcome: {why}")]
    Outcomes {
        /// Counted from 1.
        line: usize,
        /// What the reader said.
        why: String,
    },
}

/// Addresses a node of one [`Graph`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct NodeId(pub(crate) u32);

impl NodeId {
    fn idx(self) -> usize {
        self.0 as usize
    }
}

/// A node of the graph.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Its own address.
    pub id: NodeId,
    /// Its name for people and files, unique: `pour/pick/either.side/grasp`.
    pub path: String,
    /// The same seen from the task it is written in, so that what is learnt serves every caller:
    /// `pick/either.side/grasp`.
    pub key: String,
    /// What a drawing says in it.
    pub label: String,
    /// The bytes it came from, in the file `within` was read from.
    pub span: Span,
    /// The task it is written in.
    pub within: String,
    /// The node above.
    pub parent: Option<NodeId>,
    /// `break` stands before it in the text.
    pub pause: Option<Pause>,
    /// And, Or or terminal.
    pub kind: NodeKind,
}

/// A breakpoint in the text: stepping stops before the node that carries it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pause {
    /// Only when this holds; always when `None`.
    pub when: Option<Expr>,
}

/// The three kinds of node.
#[derive(Debug, Clone, PartialEq)]
pub enum NodeKind {
    /// All children are done.
    And(And),
    /// One branch is done.
    Or(Or),
    /// Cannot be taken apart further.
    Terminal(Terminal),
}

/// `while φ` and `until φ` on a node, arguments filled in.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Holding {
    /// Must hold while the node is done.
    pub whiles: Vec<Expr>,
    /// Ends the node when true.
    pub untils: Vec<Expr>,
}

/// Needs, keeps and gives with their arguments filled in.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Causes {
    /// Must hold before.
    pub needs: Vec<Expr>,
    /// Must hold throughout.
    pub keeps: Vec<Expr>,
    /// Holds afterwards.
    pub gives: Vec<Expr>,
}

/// A sub-task: all of its children.
#[derive(Debug, Clone, PartialEq)]
pub struct And {
    /// What the children are to each other.
    pub form: Form,
    /// In order.
    pub children: Vec<NodeId>,
    /// What the task says must hold before, during and after.
    pub causes: Causes,
    /// `while` and `until` around all of it.
    pub holding: Holding,
    /// The Or nodes of `on failure` clauses, in the order written; not among `children`.
    pub recoveries: Vec<NodeId>,
    /// The time it may take, s.
    pub limit: Option<f64>,
}

/// What an And node came from.
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
    /// The body of a task: the call that asked for it, arguments filled in.
    Task(Call),
    /// A block, a branch, a sequence.
    Sequence,
    /// `together { … }`: children overlap in time as the temporal relations say.
    Together,
    /// `repeat`.
    Repeat,
    /// Nothing to do: `if` without `else`, a loop that is done.
    Skip,
    /// What is done when a step fails.
    Recovery {
        /// Whose failure; any in the task above when `None`.
        of: Option<Call>,
        /// What follows.
        remedy: Option<crate::language::ast::Remedy>,
    },
}

/// A choice.
#[derive(Debug, Clone, PartialEq)]
pub struct Or {
    /// Who decides.
    pub decides: Decides,
    /// The branch that `via` asks for: the only one taken.
    pub via: Option<usize>,
    /// At least one.
    pub branches: Vec<Branch>,
}

/// What decides an Or.
#[derive(Debug, Clone, PartialEq)]
pub enum Decides {
    /// `either … or …`: learnt.
    Choice,
    /// `at: tray | table`: learnt; the parameter.
    Argument(String),
    /// `if φ`: the first branch when true, the second when false.
    Condition(Expr),
    /// `repeat … until φ`: `done` when true, else `again`; planned in full.
    Repetition(Expr),
    /// `on failure`: `nominal` until something fails; never learnt.
    Recovery,
}

impl Decides {
    /// Returns whether people choose here, so that the branches have priors and outcomes.
    pub fn is_free(&self) -> bool {
        matches!(self, Self::Choice | Self::Argument(_))
    }
}

/// One branch of an Or.
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    /// Its name; learnt counts hang on it.
    pub name: String,
    /// Prior probability; those of one Or add up to 1.
    pub prior: f64,
    /// Out of the choice when false.
    pub guard: Option<Expr>,
    /// The key that learnt counts hang on: `pick/either.side`.
    pub key: String,
    /// The keys it had before it was renamed: `#[was("old")]`.
    pub was: Vec<String>,
    /// Fingerprint of the text it is made of; another text starts new counts.
    pub text: u64,
    /// What it does.
    pub node: NodeId,
}

/// An atomic action as (fluents before, action, fluents after).
#[derive(Debug, Clone, PartialEq)]
pub struct Terminal {
    /// What it does.
    pub does: Does,
    /// Fluents before, during and after.
    pub causes: Causes,
    /// `while` and `until`.
    pub holding: Holding,
    /// The rhai script it runs.
    pub script: Option<String>,
    /// The time it may take, s.
    pub limit: Option<f64>,
}

/// What a terminal does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Does {
    /// Runs an action.
    Action {
        /// Its name.
        name: String,
        /// Every parameter with its value, in the order declared.
        args: Vec<Argument>,
    },
    /// Asks whether a fluent holds, and fails when it does not.
    Check(Expr),
    /// Works out a value now, for later steps to use by name.
    Let {
        /// Unique in the graph.
        name: String,
        /// What it is worth when reached.
        value: Expr,
    },
}

/// A parameter and its value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Argument {
    /// The parameter.
    pub name: String,
    /// Its value: an object's name, a face, a quantity, or an expression to be worked out when reached.
    pub value: Expr,
    /// The value as text.
    pub text: String,
}

/// The And-Or graph of one call.
#[derive(Debug, Clone, PartialEq)]
pub struct Graph {
    nodes: Vec<Node>,
    root: NodeId,
    /// The call it was built from, arguments and defaults filled in.
    pub call: Call,
    /// Temporal, causal and spatial relations.
    pub relations: Vec<Relation>,
    /// Every fluent that some node speaks of, with its arguments filled in.
    pub fluents: Vec<FluentNode>,
    /// The file each task and action was read from, where known.
    pub files: BTreeMap<String, String>,
    /// What its tasks, actions and fluents take.
    pub signatures: Signatures,
}

/// Parameters by the name of what takes them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Signatures {
    /// Of tasks and actions, which are called alike.
    pub callables: BTreeMap<String, Vec<Param>>,
    /// Of fluents.
    pub fluents: BTreeMap<String, Vec<Param>>,
}

impl Graph {
    /// Returns the top node.
    pub fn root(&self) -> &Node {
        self.node(self.root)
    }

    /// Returns the node at that address.
    pub fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id.idx()]
    }

    /// Returns every node, those above before those below.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Returns the node of that path.
    pub fn find(&self, path: &str) -> Option<&Node> {
        self.nodes.iter().find(|node| node.path == path)
    }

    /// Returns the nodes directly below, branches and recoveries included, in order.
    pub fn below(&self, node: &Node) -> Vec<NodeId> {
        match &node.kind {
            NodeKind::And(and) => and.children.iter().chain(&and.recoveries).copied().collect(),
            NodeKind::Or(or) => or.branches.iter().map(|branch| branch.node).collect(),
            NodeKind::Terminal(_) => Vec::new(),
        }
    }
}
