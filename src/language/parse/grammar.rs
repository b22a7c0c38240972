//! The parser that pest derives from `grammar/task.pest`, and what is read by which of its rules.

/// Apart, because the derive documents nothing.
mod derived {
    /// Reads the rules of `grammar/task.pest`.
    #[derive(pest_derive::Parser)]
    #[grammar = "grammar/task.pest"]
    pub(in super::super) struct TaskParser;
}

pub(super) use derived::{Rule, TaskParser};

/// One node of what pest read.
pub(super) type Pair<'i> = pest::iterators::Pair<'i, Rule>;

/// What a diagnostic calls a slice's place in the text, and how the slice is read again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// At the top level.
    Item,
    /// Between the braces of a task or block.
    Step,
    /// Between the braces of an action.
    Clause,
    /// Between the braces of a scene.
    Entry,
    /// Between the braces of a thing.
    Property,
    /// Between the braces of a camera.
    View,
    /// Between the braces of marks.
    Point,
    /// Between the braces of a twin.
    Effect,
    /// Between the braces of a model.
    Model,
    /// Between the braces of an effect.
    Parameter,
    /// Between the parentheses of a definition.
    Params,
    /// Between the parentheses of a call.
    Args,
    /// Between the parentheses of a shape.
    Extents,
}
