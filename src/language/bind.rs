//! Filling in arguments: parameters become what the caller gave, all the way down an expression.
//!
//! Expressions are closed by substitution rather than worked out: `0.9 * filled(source)` becomes
//! `0.9 * filled(jar)` and gets its value from the state in which it is asked.

use std::collections::BTreeMap;

use super::ast::{Arg, Call, Expr, ExprKind, Param, Span};

/// What the names in scope stand for.
pub type Scope = BTreeMap<String, Expr>;

/// Returns `expr` with every name in scope replaced; the bytes stay those of `expr`.
pub fn fill(expr: &Expr, scope: &Scope) -> Expr {
    let inner = |e: &Expr| Box::new(fill(e, scope));
    let kind = match &expr.kind {
        ExprKind::Name(name) => match scope.get(name) {
            Some(value) => return at(value, expr.span),
            None => ExprKind::Name(name.clone()),
        },
        ExprKind::Call(call) => ExprKind::Call(fill_call(call, scope)),
        ExprKind::Member(of, name) => ExprKind::Member(inner(of), name.clone()),
        ExprKind::Not(e) => ExprKind::Not(inner(e)),
        ExprKind::Negate(e) => ExprKind::Negate(inner(e)),
        ExprKind::Binary(a, op, b) => ExprKind::Binary(inner(a), *op, inner(b)),
        ExprKind::Within(e, by) => ExprKind::Within(inner(e), inner(by)),
        kind @ (ExprKind::Literal(_) | ExprKind::Text(_) | ExprKind::Bool(_) | ExprKind::Bad) => {
            kind.clone()
        }
    };
    Expr { kind, span: expr.span }
}

/// Returns `call` with its arguments filled in.
pub fn fill_call(call: &Call, scope: &Scope) -> Call {
    let args = call.args.iter().map(|arg| Arg {
        name: arg.name.clone(),
        values: arg.values.iter().map(|value| fill(value, scope)).collect(),
        span: arg.span,
    });
    Call { name: call.name.clone(), args: args.collect(), span: call.span }
}

/// Returns `expr` as if it stood at `span`: what is put in points to where it is used, since the bytes it
/// came from may be another file's.
fn at(expr: &Expr, span: Span) -> Expr {
    let inner = |e: &Expr| Box::new(at(e, span));
    let kind = match &expr.kind {
        ExprKind::Call(call) => {
            let args = call.args.iter().map(|arg| Arg {
                name: arg.name.clone(),
                values: arg.values.iter().map(|value| at(value, span)).collect(),
                span,
            });
            ExprKind::Call(Call { name: call.name.clone(), args: args.collect(), span })
        }
        ExprKind::Member(of, name) => ExprKind::Member(inner(of), name.clone()),
        ExprKind::Not(e) => ExprKind::Not(inner(e)),
        ExprKind::Negate(e) => ExprKind::Negate(inner(e)),
        ExprKind::Binary(a, op, b) => ExprKind::Binary(inner(a), *op, inner(b)),
        ExprKind::Within(e, by) => ExprKind::Within(inner(e), inner(by)),
        leaf => leaf.clone(),
    };
    Expr { kind, span }
}

/// A parameter with the values it may take; more than one makes an Or.
#[derive(Debug, Clone)]
pub struct Bound {
    /// The parameter.
    pub name: String,
    /// The values, as the caller wrote them, or the default.
    pub values: Vec<Expr>,
    /// Whether the value is a default, written in terms of the parameters before it.
    pub default: bool,
}

/// An argument that does not fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Misfit {
    /// One sentence.
    pub message: String,
    /// Where.
    pub span: Span,
    /// How it is declared.
    pub help: Option<String>,
}

/// Gives each parameter its values, first those without a name in order, then those with one.
///
/// `what` is how a message calls it: ``task `pour` ``. A default may name the parameters before it.
///
/// # Errors
///
/// [`Misfit`] for the first argument that does not fit.
pub fn arguments(what: &str, params: &[Param], call: &Call) -> Result<Vec<Bound>, Misfit> {
    let misfit = |message, span, help| Misfit { message, span, help };
    let signature = || {
        let all: Vec<String> =
            params.iter().map(|p| format!("{}: {}", p.name.text, p.ty.text)).collect();
        Some(format!("it is declared as `{}({})`", call.name.text, all.join(", ")))
    };
    let mut given: BTreeMap<&str, &Arg> = BTreeMap::new();
    let mut bare = params.iter();
    for arg in &call.args {
        let param = match &arg.name {
            Some(name) => params.iter().find(|p| p.name.text == name.text).ok_or_else(|| {
                let message = format!("{what} has no parameter `{}`", name.text);
                misfit(message, name.span, signature())
            })?,
            None => bare.next().ok_or_else(|| {
                let message = format!("{what} takes {}, not more", count(params.len()));
                misfit(message, arg.span, signature())
            })?,
        };
        if given.insert(&param.name.text, arg).is_some() {
            let message = format!("`{}` of {what} is given twice", param.name.text);
            return Err(misfit(message, arg.span, None));
        }
    }
    let mut bound = Vec::new();
    for param in params {
        let (values, default) = match (given.get(param.name.text.as_str()), &param.default) {
            (Some(arg), _) if !arg.values.is_empty() => (arg.values.clone(), false),
            (None, Some(default)) => (vec![default.clone()], true),
            _ => {
                let message = format!("{what} needs `{}`", param.name.text);
                return Err(misfit(message, call.span, signature()));
            }
        };
        bound.push(Bound { name: param.name.text.clone(), values, default });
    }
    Ok(bound)
}

fn count(n: usize) -> String {
    match n {
        0 => "no argument".into(),
        1 => "one argument".into(),
        n => format!("{n} arguments"),
    }
}
