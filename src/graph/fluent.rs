//! Fluents as nodes of the graph: what can change, with the arguments filled in.
//!
//! What a fluent is *worth* is not known here; `fluent` works that out from a state.

use std::collections::BTreeSet;

use super::Definitions;
use crate::language::ast::{BinaryOp, Expr, ExprKind};
use crate::language::bind::{self, Scope};
use crate::language::text;

/// A fluent that some node needs, keeps, gives, asks or is guarded by.
#[derive(Debug, Clone, PartialEq)]
pub struct FluentNode {
    /// `f:holding(jar)`.
    pub id: String,
    /// `holding(jar)`, or the comparison itself when it has no name.
    pub text: String,
    /// What it is, arguments filled in, when the program defines it.
    pub body: Option<String>,
    /// The question for a person or a model, with the objects' names in it.
    pub ask: Option<String>,
    /// The question as the program writes it, with blanks.
    pub template: Option<String>,
    /// The objects it speaks of, in the order of the arguments.
    pub objects: Vec<String>,
    /// Whether it has a value and a limit, hence a margin, rather than being yes or no alone.
    pub is_real: bool,
}

/// A question as the program writes it, and what its blanks stand for.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Question {
    /// The fluent asked about, arguments filled in.
    pub fluent: String,
    /// `Is the {a} above the {b}?`
    pub template: String,
    /// What each blank stands for: `("a", "jar")`.
    pub blanks: Vec<(String, String)>,
}

impl Question {
    /// Returns the question with `name_of(object)` in the blanks.
    pub fn with(&self, name_of: impl Fn(&str) -> String) -> String {
        self.blanks.iter().fold(self.template.clone(), |said, (blank, object)| {
            said.replace(&format!("{{{blank}}}"), &name_of(object))
        })
    }
}

/// Splits a condition at `and`, `or` and `not` into the fluents it is made of, with their sign.
pub fn atoms(expr: &Expr) -> Vec<(&Expr, bool)> {
    fn walk<'a>(e: &'a Expr, negated: bool, found: &mut Vec<(&'a Expr, bool)>) {
        match &e.kind {
            ExprKind::Not(inner) => walk(inner, !negated, found),
            ExprKind::Binary(a, BinaryOp::And | BinaryOp::Or, b) => {
                walk(a, negated, found);
                walk(b, negated, found);
            }
            _ => found.push((e, negated)),
        }
    }
    let mut found = Vec::new();
    walk(expr, false, &mut found);
    found
}

/// Returns the questions that a condition's fluents put, those stated as true first.
pub fn questions(expr: &Expr, definitions: &dyn Definitions) -> Vec<Question> {
    let positive = atoms(expr).into_iter().filter(|(_, negated)| !negated);
    positive.filter_map(|(atom, _)| question(atom, definitions)).collect()
}

fn question(atom: &Expr, definitions: &dyn Definitions) -> Option<Question> {
    let ExprKind::Call(call) = &atom.kind else { return None };
    let item = definitions.fluent(&call.name.text)?;
    let template = item.ask.as_ref()?.text.clone();
    let bound = bind::arguments("", &item.params, call).ok()?;
    let blanks =
        bound.into_iter().filter_map(|b| Some((b.name, text::expr(b.values.first()?)))).collect();
    Some(Question { fluent: text::expr(atom), template, blanks })
}

/// Makes the node of one fluent. `objects` are the names that stand for things.
pub(super) fn node(
    atom: &Expr,
    definitions: &dyn Definitions,
    objects: &BTreeSet<String>,
) -> FluentNode {
    let text = text::expr(atom);
    let body = body(atom, definitions);
    let mut found = Vec::new();
    names(atom, &mut |name| {
        let is_thing = objects.contains(name) || name == "gripper" || name == "table";
        if is_thing && !found.iter().any(|f| f == name) {
            found.push(name.to_owned());
        }
    });
    let is_real = body.as_ref().map_or_else(|| has_limit(atom), has_limit);
    let question = question(atom, definitions);
    FluentNode {
        id: format!("f:{text}"),
        text,
        body: body.as_ref().map(text::expr),
        ask: question.as_ref().map(|question| question.with(str::to_owned)),
        template: question.map(|question| question.template),
        objects: found,
        is_real,
    }
}

/// Returns what a fluent of the program stands for, arguments filled in.
fn body(atom: &Expr, definitions: &dyn Definitions) -> Option<Expr> {
    let ExprKind::Call(call) = &atom.kind else { return None };
    let item = definitions.fluent(&call.name.text)?;
    let bound = bind::arguments("", &item.params, call).ok()?;
    let mut scope = Scope::new();
    for b in bound {
        let value = b.values.into_iter().next()?;
        let value = if b.default { bind::fill(&value, &scope) } else { value };
        scope.insert(b.name, value);
    }
    Some(bind::fill(&item.body, &scope))
}

fn has_limit(e: &Expr) -> bool {
    match &e.kind {
        ExprKind::Not(inner) => has_limit(inner),
        ExprKind::Binary(a, BinaryOp::And | BinaryOp::Or, b) => has_limit(a) || has_limit(b),
        ExprKind::Binary(..) | ExprKind::Within(..) => true,
        _ => false,
    }
}

fn names(e: &Expr, found: &mut impl FnMut(&str)) {
    match &e.kind {
        ExprKind::Name(name) => found(name),
        ExprKind::Call(call) => {
            for value in call.args.iter().flat_map(|arg| &arg.values) {
                names(value, found);
            }
        }
        ExprKind::Member(inner, _) | ExprKind::Not(inner) | ExprKind::Negate(inner) => {
            names(inner, found);
        }
        ExprKind::Binary(a, _, b) | ExprKind::Within(a, b) => {
            names(a, found);
            names(b, found);
        }
        ExprKind::Literal(_) | ExprKind::Text(_) | ExprKind::Bool(_) | ExprKind::Bad => {}
    }
}
