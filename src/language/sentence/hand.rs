//! What is in the hand after some calls, by what their tasks promise; and which calls it stands in the way of.
//!
//! "pick up the jar and put it on the tray": after `pick(jar)`, which gives `holding(jar)`, it is placed; `put` needs an
//! empty hand. What a task does not promise is not known, and stands in the way of nothing. "Take the jar and pour it into
//! the cup" is `pour(jar, cup)`, which needs an empty hand as well and takes the jar itself.

use super::super::ast::{BinaryOp, Call, Expr, ExprKind, Param};
use super::super::library::Library;

/// Fluents that say what is in the hand.
const HELD: &[&str] = &["holding", "held", "grasped"];

/// What is known to be in the hand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Hand {
    /// Nothing.
    Empty,
    /// This.
    Holds(String),
}

/// Returns what is in the hand after a call; what was there before, where its task says nothing of it.
pub(super) fn after(call: &Call, before: Option<Hand>, library: &Library) -> Option<Hand> {
    let (callable, _) = library.callable(&call.name.text)?;
    let gives = &callable.conditions().gives;
    let said = gives.iter().flat_map(parts).find_map(|part| of(part, call, callable.params()));
    match said {
        Some((thing, true)) => Some(Hand::Holds(thing)),
        Some((_, false)) => Some(Hand::Empty),
        None => before,
    }
}

/// Whether nothing that a call needs is false with that in the hand.
pub(super) fn can_begin(call: &Call, hand: &Hand, library: &Library) -> bool {
    let Some((callable, _)) = library.callable(&call.name.text) else { return true };
    let mut needs = callable.conditions().needs.iter().flat_map(parts);
    needs.all(|part| {
        of(part, call, callable.params()).is_none_or(|(thing, is_held)| match hand {
            Hand::Empty => !is_held,
            Hand::Holds(held) => is_held == (thing == "any" || *held == thing),
        })
    })
}

/// Whether a call begins by taking what another only takes: it needs an empty hand, and promises that this is not in the hand in
/// the end.
pub(super) fn takes_again(take: &Call, call: &Call, library: &Library) -> bool {
    let Some(thing) = taken(take, library) else { return false };
    let Some((callable, _)) = library.callable(&call.name.text) else { return false };
    let mut given = call.args.iter().flat_map(|arg| &arg.values);
    let mut promises = callable.conditions().gives.iter().flat_map(parts);
    given.any(|value| value.kind == ExprKind::Name(thing.clone()))
        && promises.any(|part| {
            of(part, call, callable.params())
                .is_some_and(|(left, is_held)| !is_held && (left == "any" || left == thing))
        })
        && can_begin(call, &Hand::Empty, library)
        && !can_begin(call, &Hand::Holds(thing), library)
}

/// Returns what a call takes into the hand, if its task promises nothing else.
fn taken(take: &Call, library: &Library) -> Option<String> {
    let (callable, _) = library.callable(&take.name.text)?;
    let promises = callable.conditions().gives.iter().flat_map(parts);
    let said: Option<Vec<_>> = promises.map(|part| of(part, take, callable.params())).collect();
    match said?.as_slice() {
        [(thing, true)] => Some(thing.clone()),
        _ => None,
    }
}

/// Returns the thing that a condition is about and whether it is to be held; `None` where it is not about the hand.
fn of(condition: &Expr, call: &Call, params: &[Param]) -> Option<(String, bool)> {
    match &condition.kind {
        ExprKind::Not(inner) => of(inner, call, params).map(|(thing, is_held)| (thing, !is_held)),
        ExprKind::Call(fluent) if HELD.contains(&&*fluent.name.text) => {
            let ExprKind::Name(name) = &fluent.args.first()?.values.first()?.kind else {
                return None;
            };
            let Some(at) = params.iter().position(|param| param.name.text == *name) else {
                return Some((name.clone(), true));
            };
            let named =
                call.args.iter().find(|arg| arg.name.as_ref().is_some_and(|own| own.text == *name));
            let given = named.or_else(|| call.args.get(at).filter(|arg| arg.name.is_none()))?;
            match &given.values.first()?.kind {
                ExprKind::Name(thing) => Some((thing.clone(), true)),
                _ => None,
            }
        }
        _ => None,
    }
}

/// Returns what must all hold for a condition to hold.
fn parts(condition: &Expr) -> Vec<&Expr> {
    match &condition.kind {
        ExprKind::Binary(a, BinaryOp::And, b) => parts(a).into_iter().chain(parts(b)).collect(),
        _ => vec![condition],
    }
}
