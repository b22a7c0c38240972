//! The syntax tree: what a `.task` file says, each node with the bytes it came from.
//!
//! A tree exists for every input; what could not be read is [`Item::Bad`] or [`Step::Bad`] and has a
//! diagnostic of its own. Names are not resolved here, units are: a [`Literal`] is in SI.

use serde::{Deserialize, Serialize};

use crate::units::{Quantity, Unit};

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

/// `name(arg, by: 12 cm)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Call {
    /// What is called.
    pub name: Name,
    /// With what.
    pub args: Vec<Arg>,
    /// Where.
    pub span: Span,
}

/// One argument: `at: tray | table` has two alternatives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Arg {
    /// `at:`.
    pub name: Option<Name>,
    /// One value, or the alternatives of an Or node over the parameter.
    pub values: Vec<Expr>,
    /// Where.
    pub span: Span,
}

/// A number with its unit, in SI.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Literal {
    /// The quantity.
    pub quantity: Quantity,
    /// Where.
    pub span: Span,
}

/// An expression.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Expr {
    /// What it is.
    pub kind: ExprKind,
    /// Where.
    pub span: Span,
}

/// The forms of an expression.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ExprKind {
    /// `12 cm`, `0.5`.
    Literal(Quantity),
    /// `"text"`.
    Text(String),
    /// `true`, `false`.
    Bool(bool),
    /// `jar`, `side`, `any`.
    Name(String),
    /// `height(o)`.
    Call(Call),
    /// `gripper.open`, `table.height`.
    Member(Box<Expr>, Name),
    /// `not φ`.
    Not(Box<Expr>),
    /// `-x`.
    Negate(Box<Expr>),
    /// `a op b`.
    Binary(Box<Expr>, BinaryOp, Box<Expr>),
    /// `a == b within t`; the tolerance belongs to the comparison.
    Within(Box<Expr>, Box<Expr>),
    /// What could not be read.
    Bad,
}

/// Binary operators, loosest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum BinaryOp {
    /// `or`
    Or,
    /// `and`
    And,
    /// `==`
    Eq,
    /// `!=`
    Ne,
    /// `<=`
    Le,
    /// `>=`
    Ge,
    /// `<`
    Lt,
    /// `>`
    Gt,
    /// `+`
    Add,
    /// `-`
    Sub,
    /// `*`
    Mul,
    /// `/`
    Div,
}

/// `scene kitchen { … }`.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneItem {
    /// Documentation.
    pub doc: Vec<String>,
    /// Its name.
    pub name: Name,
    /// `jar: Container = cuboid(…) { … }`.
    pub things: Vec<SceneThing>,
    /// `marks dots(radius 12 mm) { (x, y) … }`: centres and radius.
    pub marks: Vec<SceneMarks>,
    /// `camera overhead { … }`.
    pub cameras: Vec<SceneCamera>,
    /// `robot gen3_2f85 at (0 m, 0 m, 0 m)`.
    pub robots: Vec<SceneRobot>,
    /// Where.
    pub span: Span,
}

/// `jar: Container = cuboid(65 mm, 65 mm, 140 mm) at (…) { wall 3 mm … }`.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneThing {
    /// Its name.
    pub name: Name,
    /// Its type.
    pub ty: Name,
    /// `box`, `cuboid` or `cylinder`, with arguments bare or named.
    pub shape: Call,
    /// `at (x, y[, z])`.
    pub at: Option<(Vec<Literal>, Span)>,
    /// `wall 3 mm`, `looks "…"`, `colour "#…"`, …
    pub properties: Vec<Property>,
    /// Where.
    pub span: Span,
}

/// `wall 3 mm` inside braces.
#[derive(Debug, Clone, PartialEq)]
pub struct Property {
    /// Its name.
    pub name: Name,
    /// `~`: a guess that alignment may move.
    pub guess: bool,
    /// Its value: a quantity, a text, or several.
    pub value: Vec<Expr>,
    /// Where.
    pub span: Span,
}

/// `marks dots(radius 12 mm) { (0.25 m, -0.36 m) … }`.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneMarks {
    /// Radius of each dot.
    pub radius: Literal,
    /// Centres on the table.
    pub centres: Vec<[Literal; 2]>,
    /// Where.
    pub span: Span,
}

/// `camera overhead { image 1280 x 720 focal ~ 900 px at (…) looking (…) }`.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneCamera {
    /// Its name.
    pub name: Name,
    /// Width and height, px.
    pub image: [u32; 2],
    /// Focal length, px.
    pub focal: f64,
    /// Where it stands.
    pub at: [Literal; 3],
    /// What it looks at.
    pub looking: [Literal; 3],
    /// Where.
    pub span: Span,
}

/// `robot gen3_2f85 at (0 m, 0 m, 0 m)`.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneRobot {
    /// Its folder in `stdlib/robots/`.
    pub name: Name,
    /// Where its base stands.
    pub at: [Literal; 3],
    /// Where.
    pub span: Span,
}

/// `twin kitchen_twin of kitchen { effect … }`.
#[derive(Debug, Clone, PartialEq)]
pub struct TwinItem {
    /// Documentation.
    pub doc: Vec<String>,
    /// Its name.
    pub name: Name,
    /// The scene it is of.
    pub of: Name,
    /// The effects already known.
    pub effects: Vec<EffectItem>,
    /// Where.
    pub span: Span,
}

/// `effect coulomb_friction(joint_4) { torque = 1.83 N*m +- 0.04 N*m }`.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectItem {
    /// Its name from the vocabulary of effects.
    pub name: Name,
    /// Joint, link, camera, object, state or output.
    pub at: Name,
    /// `torque = 1.83 N*m +- 0.04 N*m`.
    pub parameters: Vec<EffectParameter>,
    /// Where.
    pub span: Span,
}

/// One parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectParameter {
    /// Its name.
    pub name: Name,
    /// Its value.
    pub value: Literal,
    /// One standard deviation.
    pub std: Option<Literal>,
}

/// `model tanks { … }`: inputs, parameters, states, equations and outputs.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelItem {
    /// Documentation.
    pub doc: Vec<String>,
    /// Its name.
    pub name: Name,
    /// `input u: V`.
    pub inputs: Vec<ModelSignal>,
    /// `param k = 0.05, c = free`.
    pub params: Vec<ModelStart>,
    /// `state h = free`: the value at the first instant.
    pub states: Vec<ModelStart>,
    /// `let flow = k*sqrt(h)`.
    pub lets: Vec<ModelFormula>,
    /// `h' = u - flow`: the rates of the states.
    pub equations: Vec<ModelFormula>,
    /// `output y: V = h`.
    pub outputs: Vec<ModelFormula>,
    /// The bytes between the braces.
    pub body: Span,
    /// Where.
    pub span: Span,
}

/// A unit as a model names it: `: V`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelUnit {
    /// The unit.
    pub unit: Unit,
    /// Where.
    pub span: Span,
}

/// `u: V`, measured and given to the model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSignal {
    /// Its name.
    pub name: Name,
    /// Its unit, where one is given.
    pub unit: Option<ModelUnit>,
}

/// A parameter, or a state with its value at the first instant.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelStart {
    /// Its name.
    pub name: Name,
    /// Its unit, where one is given.
    pub unit: Option<ModelUnit>,
    /// Its value, or that the data give it.
    pub value: StartValue,
    /// `in 0 to 1`: what a free value may be.
    pub range: Option<[Literal; 2]>,
    /// Where.
    pub span: Span,
}

/// What a parameter or an initial state is.
#[derive(Debug, Clone, PartialEq)]
pub enum StartValue {
    /// `= 9.81 m/s^2`, `= 2*pi*f`.
    Fixed(Expr),
    /// `= free`, `= free ~ 0.05`, `~ 0.05`, or nothing at all.
    Free(Option<Literal>),
}

/// `h' = …`, `let flow = …` or `output y: V = …`.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFormula {
    /// The name on its left; for a rate the state's.
    pub name: Name,
    /// Its unit, where one is given.
    pub unit: Option<ModelUnit>,
    /// What it is equal to. Powers are calls of `pow`.
    pub formula: Expr,
    /// Where.
    pub span: Span,
}
