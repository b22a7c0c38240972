//! What the legend of a drawing says beside its shapes.

/// An And node.
pub(super) const AND: &str = "And: all of it, top to bottom";
/// An Or node, with its numbers.
pub(super) const OR: &str = "Or: one of them (prior · worked)";
/// An action.
pub(super) const ACTION: &str = "action";
/// A check.
pub(super) const CHECK: &str = "check";
/// What is done after a failure.
pub(super) const RECOVERY: &str = "on failure";
/// A fluent.
pub(super) const FLUENT: &str = "fluent (double: between objects)";
/// One after the other.
pub(super) const TIME: &str = "then";
