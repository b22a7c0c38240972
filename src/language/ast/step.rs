//! The steps of a task, and what is done when one fails.

use serde::{Deserialize, Serialize};

use super::{Call, Expr, Literal, Name, Span, Text};

/// One step of a task.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// A call of a task or an action, with its holds and label.
    Act(Act),
    /// `a then b`, one after the other.
    Sequence(Vec<Step>, Span),
    /// `{ … }` with optional recoveries inside.
    Block(Block),
    /// `either x prior 0.7 when φ {…} or y {…}`.
    Either(Either),
    /// `if φ {…} else {…}`.
    If(If),
    /// `repeat upto n times {…} until φ`.
    Repeat(Repeat),
    /// `for o in Type when φ {…}`.
    Each(Each),
    /// `together {…}` with `timing a overlaps b by 300 ms`.
    Together(Together),
    /// `check φ`.
    Check(Expr, Span),
    /// `let x = expr`.
    Let(Name, Expr, Span),
    /// `break` or `break when φ`: stepping stops before the next step.
    Break(Break),
    /// What could not be read.
    Bad(Span),
}

impl Step {
    /// Returns the steps directly inside this one, in order.
    pub fn inside(&self) -> Vec<&Step> {
        match self {
            Self::Sequence(steps, _) => steps.iter().collect(),
            Self::Block(block) => block.steps.iter().collect(),
            Self::Either(either) => either.branches.iter().flat_map(|b| &b.block.steps).collect(),
            Self::If(step) => {
                let otherwise = step.otherwise.iter().flat_map(|block| &block.steps);
                step.then.steps.iter().chain(otherwise).collect()
            }
            Self::Repeat(repeat) => repeat.block.steps.iter().collect(),
            Self::Each(each) => each.block.steps.iter().collect(),
            Self::Together(together) => together.steps.iter().collect(),
            Self::Act(_) | Self::Check(..) | Self::Let(..) | Self::Break(_) | Self::Bad(_) => {
                Vec::new()
            }
        }
    }

    /// Returns its bytes.
    pub fn span(&self) -> Span {
        match self {
            Self::Act(act) => act.span,
            Self::Block(block) => block.span,
            Self::Either(either) => either.span,
            Self::If(step) => step.span,
            Self::Repeat(repeat) => repeat.span,
            Self::Each(each) => each.span,
            Self::Together(together) => together.span,
            Self::Break(stop) => stop.span,
            Self::Let(_, _, span)
            | Self::Sequence(_, span)
            | Self::Check(_, span)
            | Self::Bad(span) => *span,
        }
    }
}

/// `call via branch while φ until ψ as label`.
#[derive(Debug, Clone, PartialEq)]
pub struct Act {
    /// What is called.
    pub call: Call,
    /// `via side`: branches to take inside it, whatever is learnt.
    pub via: Vec<Name>,
    /// `while φ` and `until φ`, in order.
    pub holds: Vec<Hold>,
    /// `as name`.
    pub label: Option<Name>,
    /// Where.
    pub span: Span,
}

/// `break when φ`: a breakpoint in the text.
#[derive(Debug, Clone, PartialEq)]
pub struct Break {
    /// Stop only when this holds.
    pub when: Option<Expr>,
    /// Where.
    pub span: Span,
}

/// A condition on a running step.
#[derive(Debug, Clone, PartialEq)]
pub enum Hold {
    /// False stops the step and fails it.
    While(Expr),
    /// True finishes the step.
    Until(Expr),
}

/// `{ steps }` as a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Its steps.
    pub steps: Vec<Step>,
    /// Its own recoveries.
    pub recoveries: Vec<Recovery>,
    /// `while φ` and `until φ` after the closing brace.
    pub holds: Vec<Hold>,
    /// `as name`.
    pub label: Option<Name>,
    /// Where.
    pub span: Span,
}

/// An Or over named branches.
#[derive(Debug, Clone, PartialEq)]
pub struct Either {
    /// The branches, at least two.
    pub branches: Vec<Branch>,
    /// Where.
    pub span: Span,
}

/// One branch of [`Either`].
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    /// Its name; learnt counts hang on it.
    pub name: Name,
    /// `#[was("old")]`: names it had before.
    pub was: Vec<Text>,
    /// Prior probability, as written.
    pub prior: Option<f64>,
    /// Guard: out of the choice when false.
    pub when: Option<Expr>,
    /// What it does.
    pub block: Block,
}

/// `if φ {…} else {…}`.
#[derive(Debug, Clone, PartialEq)]
pub struct If {
    /// The condition.
    pub condition: Expr,
    /// Done when true.
    pub then: Block,
    /// Done when false: a block, or another `if` inside a block of one step.
    pub otherwise: Option<Block>,
    /// Where.
    pub span: Span,
}

/// `repeat upto n times {…} until φ`.
#[derive(Debug, Clone, PartialEq)]
pub struct Repeat {
    /// The most times it is done.
    pub times: u32,
    /// What is done.
    pub block: Block,
    /// When to stop early.
    pub until: Option<Expr>,
    /// Where.
    pub span: Span,
}

/// `for o in Type when φ {…}`: once for every thing of a type.
#[derive(Debug, Clone, PartialEq)]
pub struct Each {
    /// What each is called inside.
    pub name: Name,
    /// The type.
    pub kind: Name,
    /// Left out where this is false.
    pub when: Option<Expr>,
    /// What is done with each.
    pub block: Block,
    /// Where.
    pub span: Span,
}

/// `together {…}`.
#[derive(Debug, Clone, PartialEq)]
pub struct Together {
    /// What overlaps in time.
    pub steps: Vec<Step>,
    /// How.
    pub timings: Vec<Timing>,
    /// Where.
    pub span: Span,
}

/// `timing rising overlaps moving by 300 ms`.
#[derive(Debug, Clone, PartialEq)]
pub struct Timing {
    /// First label.
    pub a: Name,
    /// Allen's relation.
    pub relation: Allen,
    /// Second label.
    pub b: Name,
    /// By how much.
    pub by: Option<Literal>,
    /// Where.
    pub span: Span,
}

/// Allen's interval relations that the language names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Allen {
    /// Ends before the other begins.
    Before,
    /// Ends as the other begins.
    Meets,
    /// Begins first, ends inside the other.
    Overlaps,
    /// Begins with the other, ends first.
    Starts,
    /// Lies inside the other.
    During,
    /// Ends with the other, begins later.
    Finishes,
    /// Begins and ends with the other.
    Equals,
}

/// `on failure of grasp(o) { open_gripper() retry other upto 2 times }`.
#[derive(Debug, Clone, PartialEq)]
pub struct Recovery {
    /// Which call's failure; any in the task when `None`.
    pub of: Option<Call>,
    /// What is done first.
    pub steps: Vec<Step>,
    /// What then.
    pub remedy: Option<Remedy>,
    /// Where.
    pub span: Span,
}

/// How a recovery ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Remedy {
    /// `retry [other] [upto n times]`: the failed step, its Or node, or the task again.
    Retry {
        /// Take an untried branch.
        other: bool,
        /// At most this often.
        times: u32,
    },
    /// `abort "why"`.
    Abort(Option<String>),
}
