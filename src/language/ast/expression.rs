//! Calls, conditions and values.

use serde::{Deserialize, Serialize};

use super::{Name, Span};
use crate::units::Quantity;

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

impl Expr {
    /// Returns the names of what it calls and of the members it asks for; parameters and constants are none.
    pub fn calls(&self) -> Vec<&str> {
        let mut found = Vec::new();
        self.collect_calls(&mut found);
        found
    }

    fn collect_calls<'e>(&'e self, found: &mut Vec<&'e str>) {
        match &self.kind {
            ExprKind::Call(call) => {
                found.push(&call.name.text);
                let values = call.args.iter().flat_map(|arg| &arg.values);
                values.for_each(|value| value.collect_calls(found));
            }
            ExprKind::Member(of, name) => {
                found.push(&name.text);
                of.collect_calls(found);
            }
            ExprKind::Not(of) | ExprKind::Negate(of) => of.collect_calls(found),
            ExprKind::Binary(a, _, b) | ExprKind::Within(a, b) => {
                a.collect_calls(found);
                b.collect_calls(found);
            }
            ExprKind::Literal(_)
            | ExprKind::Text(_)
            | ExprKind::Bool(_)
            | ExprKind::Name(_)
            | ExprKind::Bad => {}
        }
    }
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
