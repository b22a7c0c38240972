//! The syntax tree: what a `.task` file says, each node with the bytes it came from.
//!
//! A tree exists for every input; what could not be read is [`Item::Bad`] or [`Step::Bad`] and has a
//! diagnostic of its own. Names are not resolved here, units are: a [`Literal`] is in SI.

mod expression;
mod model;
mod scene;
mod step;

use serde::{Deserialize, Serialize};

pub use expression::{Arg, BinaryOp, Call, Expr, ExprKind, Literal};
pub use model::{
    EffectItem, EffectParameter, ModelFormula, ModelItem, ModelSignal, ModelStart, ModelUnit,
    StartValue, TwinItem,
};
pub use scene::{Property, SceneCamera, SceneItem, SceneLens, SceneMarks, SceneRobot, SceneThing};
pub use step::{
    Act, Allen, Block, Branch, Break, Each, Either, Hold, If, Recovery, Remedy, Repeat, Step,
    Timing, Together,
};

/// A range of bytes of one source text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub struct Span {
    /// First byte.
    pub from: usize,
    /// One past the last byte.
    pub to: usize,
}

/// A name where it stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Name {
    /// The name.
    pub text: String,
    /// Where.
    pub span: Span,
}

/// A text in quotes where it stands.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Text {
    /// The text, without its quotes.
    pub text: String,
    /// Where.
    pub span: Span,
}

/// A whole file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Program {
    /// Its items in order.
    pub items: Vec<Item>,
}

/// One top-level item, or a line typed at the prompt (a call).
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// `import "file"`.
    Import(Import),
    /// `type Container: Graspable`.
    Type(TypeItem),
    /// `fluent holding(o: Graspable) = …`.
    Fluent(FluentItem),
    /// `action grasp(o: Graspable) { … }`.
    Action(ActionItem),
    /// `task pick(o: Graspable) { … }`.
    Task(TaskItem),
    /// `scene kitchen { … }`.
    Scene(SceneItem),
    /// `twin kitchen_twin of kitchen { … }`.
    Twin(TwinItem),
    /// `model tanks { … }`.
    Model(ModelItem),
    /// A call or other step at the top level of a script: `pour(jar, cup)`.
    Run(Step),
    /// What could not be read; its diagnostics say why.
    Bad(Span),
}

/// `import "geometry.rhai"`.
#[derive(Debug, Clone, PartialEq)]
pub struct Import {
    /// The file named, as written.
    pub path: Text,
    /// Where.
    pub span: Span,
}

/// `type Container: Graspable, Visible`.
#[derive(Debug, Clone, PartialEq)]
pub struct TypeItem {
    /// Documentation lines (`///`), without the slashes.
    pub doc: Vec<String>,
    /// Its name.
    pub name: Name,
    /// The types it also is.
    pub parents: Vec<Name>,
    /// Where.
    pub span: Span,
}

/// One parameter: `by: Length = 5 cm`.
#[derive(Debug, Clone, PartialEq)]
pub struct Param {
    /// Its name.
    pub name: Name,
    /// Its type: an object type or a quantity (`Length`, `Angle`, `Volume`, `Time`, `Mass`, `Force`).
    pub ty: Name,
    /// Its default.
    pub default: Option<Expr>,
}

/// `fluent name(params) = body ask "…"`.
#[derive(Debug, Clone, PartialEq)]
pub struct FluentItem {
    /// Documentation.
    pub doc: Vec<String>,
    /// Its name.
    pub name: Name,
    /// Its parameters.
    pub params: Vec<Param>,
    /// What it is: a comparison gives truth and margin.
    pub body: Expr,
    /// The question for a person or a model; `{o}` stands for the object's display name.
    pub ask: Option<Text>,
    /// Where.
    pub span: Span,
}

/// `action name(params) { needs … keeps … gives … run "…" limit … }`.
#[derive(Debug, Clone, PartialEq)]
pub struct ActionItem {
    /// Documentation.
    pub doc: Vec<String>,
    /// `#[was("old")]`: names it had before.
    pub was: Vec<Text>,
    /// Its name.
    pub name: Name,
    /// Its parameters.
    pub params: Vec<Param>,
    /// Sentence templates.
    pub say: Vec<Text>,
    /// What must hold before, during and after.
    pub conditions: Conditions,
    /// The rhai script it runs.
    pub script: Option<(String, Span)>,
    /// The time it may take, s.
    pub limit: Option<Literal>,
    /// Where.
    pub span: Span,
}

/// The causal clauses of an action or a task.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Conditions {
    /// Must hold before.
    pub needs: Vec<Expr>,
    /// Must hold throughout.
    pub keeps: Vec<Expr>,
    /// Holds afterwards.
    pub gives: Vec<Expr>,
}

/// `task name(params) { clauses and steps }`.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskItem {
    /// Documentation.
    pub doc: Vec<String>,
    /// `#[was("old")]`: names it had before.
    pub was: Vec<Text>,
    /// Its name.
    pub name: Name,
    /// Its parameters.
    pub params: Vec<Param>,
    /// Sentence templates.
    pub say: Vec<Text>,
    /// What must hold before, during and after.
    pub conditions: Conditions,
    /// The time it may take.
    pub limit: Option<Literal>,
    /// Its steps in order.
    pub steps: Vec<Step>,
    /// What to do when something in it fails.
    pub recoveries: Vec<Recovery>,
    /// Where.
    pub span: Span,
}
