//! What a text defines, item by item: the outline that an editor shows.

use super::super::ast::{Item, Name, Span};
use super::super::parse;

/// What an item is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SymbolKind {
    /// A type of things.
    Type,
    /// A fluent.
    Fluent,
    /// An action.
    Action,
    /// A task.
    Task,
    /// A scene.
    Scene,
    /// A thing of a scene.
    Thing,
    /// A twin.
    Twin,
    /// A model given by its equations.
    Model,
}

/// Something that is defined.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symbol {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: SymbolKind,
    /// All of it.
    pub span: Span,
    /// Its name's place.
    pub at: Span,
    /// What is defined within.
    pub within: Vec<Symbol>,
}

/// Returns what a text defines, in its order.
pub fn outline(text: &str) -> Vec<Symbol> {
    let symbol = |name: &Name, kind, span| Symbol {
        name: name.text.clone(),
        kind,
        span,
        at: name.span,
        within: Vec::new(),
    };
    let (program, _) = parse(text);
    let items = program.items.iter().filter_map(|item| {
        Some(match item {
            Item::Type(item) => symbol(&item.name, SymbolKind::Type, item.span),
            Item::Fluent(item) => symbol(&item.name, SymbolKind::Fluent, item.span),
            Item::Action(item) => symbol(&item.name, SymbolKind::Action, item.span),
            Item::Task(item) => symbol(&item.name, SymbolKind::Task, item.span),
            Item::Twin(item) => symbol(&item.name, SymbolKind::Twin, item.span),
            Item::Model(item) => symbol(&item.name, SymbolKind::Model, item.span),
            Item::Scene(item) => {
                let things = item.things.iter();
                let things = things.map(|t| symbol(&t.name, SymbolKind::Thing, t.name.span));
                Symbol {
                    within: things.collect(),
                    ..symbol(&item.name, SymbolKind::Scene, item.span)
                }
            }
            Item::Import(_) | Item::Run(_) | Item::Bad(_) => return None,
        })
    });
    // Half-typed, an item has no name yet; an editor takes none without.
    items.filter(|symbol| !symbol.name.is_empty()).collect()
}
