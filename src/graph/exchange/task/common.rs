//! What several closed texts have in common: one text with parameters.
//!
//! The least general one over the parameters that are given: where the texts differ there must stand a
//! parameter that has just these values. Where they do not differ a name is taken for a parameter that has its
//! value, since that is what a person would have written; a number only for a parameter that would stand nowhere else,
//! since many are alike by chance.
//!
//! Source: Plotkin, "A Note on Inductive Generalization", Machine Intelligence 5, 1970.

use std::collections::BTreeMap;

use crate::language::ast::{Arg, Call, Expr, ExprKind};
use crate::language::bind::Scope;
use crate::language::text;

use super::slots::Slots;

/// One place where an item stands, and what its parameters are worth there.
pub(super) struct Instance<T> {
    pub(super) item: T,
    pub(super) scope: Scope,
}

/// Returns the item that gives each instance when its parameters are filled in; `None` when there is none.
pub(super) fn in_common<T: Slots>(
    all: Vec<Instance<T>>,
    lets: &BTreeMap<String, String>,
) -> Option<T> {
    let frame = all.first()?.item.frame();
    if all.iter().any(|instance| instance.item.frame() != frame) {
        return None;
    }
    let contents: Vec<Vec<Expr>> = all.iter().map(|instance| instance.item.contents()).collect();
    let scopes = all.iter().map(|instance| &instance.scope).collect();
    let slots = |at: &Places<'_>| -> Option<Vec<Expr>> {
        let each = (0..contents[0].len()).map(|slot| {
            let exprs: Vec<&Expr> = contents.iter().map(|all| &all[slot]).collect();
            generalised(&exprs, at)
        });
        each.collect()
    };
    let mut at = Places { scopes, lets, idle: Vec::new() };
    let mut found = slots(&at)?;
    at.idle = idle(&at, &found);
    if !at.idle.is_empty() {
        found = slots(&at)?;
    }
    let mut found = found.into_iter();
    let mut item = all.into_iter().next()?.item;
    item.slots(&mut |expr| {
        if let Some(found) = found.next() {
            *expr = found;
        }
    });
    Some(item)
}

/// The places where an item stands.
struct Places<'a> {
    /// What its parameters are worth at each.
    scopes: Vec<&'a Scope>,
    /// Values by their names in the graph, where each is one of its own → as a text names them.
    lets: &'a BTreeMap<String, String>,
    /// Parameters for which numbers are taken as well.
    idle: Vec<String>,
}

/// Parameters that stand nowhere in an item although it takes them, and are worth a number that is not 0.
fn idle(at: &Places<'_>, found: &[Expr]) -> Vec<String> {
    let said: Vec<String> = found.iter().map(text::expr).collect();
    let stands = |param: &str| {
        let words =
            said.iter().flat_map(|said| said.split(|c: char| !c.is_alphanumeric() && c != '_'));
        words.into_iter().any(|word| word == param)
    };
    let params = at.scopes.first().into_iter().flat_map(|scope| scope.iter());
    let numbers = params.filter(|(_, value)| match value.kind {
        ExprKind::Literal(quantity) => quantity.value.abs() > 0.0,
        _ => false,
    });
    numbers.map(|(param, _)| param.clone()).filter(|param| !stands(param)).collect()
}

fn generalised(all: &[&Expr], at: &Places<'_>) -> Option<Expr> {
    let first = *all.first()?;
    let texts: Vec<String> = all.iter().map(|e| text::expr(e)).collect();
    let alike = texts.iter().all(|other| *other == texts[0]);
    let stands_for = |param: &String| {
        at.scopes
            .iter()
            .zip(&texts)
            .all(|(scope, said)| scope.get(param).map(text::expr).as_ref() == Some(said))
    };
    if alike && matches!(first.kind, ExprKind::Literal(_) | ExprKind::Text(_) | ExprKind::Bool(_)) {
        let idle = at.idle.iter().find(|param| stands_for(param));
        let kind = idle.map_or_else(|| first.kind.clone(), |param| ExprKind::Name(param.clone()));
        return Some(Expr { kind, span: first.span });
    }
    if let Some(param) = at.scopes.first()?.keys().find(|param| stands_for(param)) {
        return Some(Expr { kind: ExprKind::Name(param.clone()), span: first.span });
    }
    let each = |part: &dyn Fn(&ExprKind) -> Option<&Expr>| -> Option<Box<Expr>> {
        let parts: Option<Vec<&Expr>> = all.iter().map(|e| part(&e.kind)).collect();
        generalised(&parts?, at).map(Box::new)
    };
    let kind = match &first.kind {
        ExprKind::Member(_, name) => {
            let of = each(&|kind| match kind {
                ExprKind::Member(of, other) if other.text == name.text => Some(of),
                _ => None,
            })?;
            ExprKind::Member(of, name.clone())
        }
        ExprKind::Not(_) => ExprKind::Not(each(&|kind| match kind {
            ExprKind::Not(inner) => Some(inner),
            _ => None,
        })?),
        ExprKind::Negate(_) => ExprKind::Negate(each(&|kind| match kind {
            ExprKind::Negate(inner) => Some(inner),
            _ => None,
        })?),
        ExprKind::Binary(_, op, _) => {
            let side = |right: bool| {
                each(&|kind| match kind {
                    ExprKind::Binary(a, other, b) if other == op => Some(if right { b } else { a }),
                    _ => None,
                })
            };
            ExprKind::Binary(side(false)?, *op, side(true)?)
        }
        ExprKind::Within(..) => {
            let side = |right: bool| {
                each(&|kind| match kind {
                    ExprKind::Within(a, b) => Some(if right { b } else { a }),
                    _ => None,
                })
            };
            ExprKind::Within(side(false)?, side(true)?)
        }
        ExprKind::Call(call) => ExprKind::Call(generalised_call(call, all, at)?),
        ExprKind::Name(name) => {
            let local = |name: &String| at.lets.get(name).unwrap_or(name).clone();
            let local_name = local(name);
            let same =
                |e: &&Expr| matches!(&e.kind, ExprKind::Name(other) if local(other) == local_name);
            if !all.iter().all(same) {
                return None;
            }
            ExprKind::Name(local_name)
        }
        _ if alike => first.kind.clone(),
        _ => return None,
    };
    Some(Expr { kind, span: first.span })
}

fn generalised_call(first: &Call, all: &[&Expr], at: &Places<'_>) -> Option<Call> {
    let shape = |call: &Call| -> (String, Vec<(Option<String>, usize)>) {
        let arg = |arg: &Arg| (arg.name.as_ref().map(|name| name.text.clone()), arg.values.len());
        (call.name.text.clone(), call.args.iter().map(arg).collect())
    };
    let calls: Option<Vec<&Call>> = all
        .iter()
        .map(|e| match &e.kind {
            ExprKind::Call(call) if shape(call) == shape(first) => Some(call),
            _ => None,
        })
        .collect();
    let calls = calls?;
    let mut found = first.clone();
    for (i, arg) in found.args.iter_mut().enumerate() {
        for (j, value) in arg.values.iter_mut().enumerate() {
            let values: Vec<&Expr> = calls.iter().map(|call| &call.args[i].values[j]).collect();
            *value = generalised(&values, at)?;
        }
    }
    Some(found)
}
