//! What a person who is writing wants to know: what could stand here, what a word means, where it is defined and where
//! else it stands, what is called, what a text holds.
//!
//! The prompt and the editor ask the same functions, so both say the same. Everything is read from texts
//! and from the names of a scene; no device is asked, and nothing here waits. A text may be half-typed.

mod called;
mod complete;
mod describe;
mod names;
mod outline;
mod words;

use super::ast::{Item, Param, Program, Span, Step};
use super::library::{Library, Scope};
use super::parse;
use super::parse::lexer::{Kind, Token, tokens};

pub use called::{Called, called};
pub use complete::{Completion, CompletionKind, complete};
pub use describe::{Promises, describe, nearest_name, promises, signature};
pub use names::{is_name, meant, uses, word};
pub use outline::{Symbol, SymbolKind, outline};

/// A text at one place, with what names mean there.
#[derive(Clone, Copy)]
pub struct Place<'a> {
    /// What is defined.
    pub library: &'a Library,
    /// The objects there are.
    pub scope: &'a Scope,
    /// The text.
    pub text: &'a str,
    /// A byte of it.
    pub at: usize,
}

/// What a word means, and which bytes it has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hover {
    /// The word.
    pub span: Span,
    /// What it means, as lines of plain text; the first is its signature or its type.
    pub text: String,
}

/// Where something is defined.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Definition {
    /// The name of the source; empty for the text that was asked about.
    pub file: String,
    /// The name there.
    pub span: Span,
}

/// Returns what the word at a place means.
pub fn hover(place: &Place<'_>) -> Option<Hover> {
    let code = code(place.text);
    let i = word_at(&code, place.at)?;
    let word = code[i].text(place.text);
    let span = Span { from: code[i].from, to: code[i].to };
    let said = |text: String| Some(Hover { span, text });
    let (program, _) = parse(place.text);
    let is_called = code.get(i + 1).is_some_and(|next| next.text(place.text) == "(");
    if !is_called && let Some(ty) = local(&program, place.at, word) {
        return said(format!("{word}: {ty}"));
    }
    if code[i].kind == Kind::Word
        && i > 0
        && code[i - 1].kind == Kind::Number
        && let Some(text) = words::unit(word)
    {
        return said(text);
    }
    if complete::is_asked(&code[..i], place.text)
        && let Some(text) = describe::asked(place.library, word)
    {
        return said(text);
    }
    // A word of the language explains itself, unless something was given its name.
    describe(place.library, place.scope, word)
        .or_else(|| words::keyword(word).map(str::to_owned))
        .and_then(said)
}

/// Returns where the word at a place is defined.
pub fn definition(place: &Place<'_>) -> Option<Definition> {
    let code = code(place.text);
    let (program, _) = parse(place.text);
    defined(place, &code, &program, word_at(&code, place.at)?)
}

/// Returns where a token's word is defined.
fn defined(place: &Place<'_>, code: &[Token], program: &Program, i: usize) -> Option<Definition> {
    let word = code[i].text(place.text);
    let at = code[i].from;
    let here = |span| Some(Definition { file: String::new(), span });
    let library = place.library;
    let file = |(span, source): (Span, &super::Source)| {
        Some(Definition { file: source.name.clone(), span })
    };
    let next = code.get(i + 1).map_or("", |next| next.text(place.text));
    // `amount: 30 mL` names a parameter of what is called.
    if next == ":"
        && let Some(around) = called::around(&code[..i], place.text)
        && !called::defines(code, around.name, place.text)
    {
        return param_of(library, code[around.name].text(place.text), word).and_then(file);
    }
    if next != "("
        && let Some(item) = item_at(program, at)
        && let Some(span) = local_at(item, at, word)
    {
        return here(span);
    }
    let callable = library.callable(word).map(|(found, source)| (found.span(), source));
    let fluent = library.fluent(word).map(|(found, source)| (found.name.span, source));
    let is_asked = complete::is_asked(&code[..i], place.text);
    if is_asked && fluent.is_none() && super::builtins::function(word).is_some() {
        return None;
    }
    let callable = callable.filter(|_| !is_asked || fluent.is_none());
    let ty = library.object_type(word).map(|(found, source)| (found.name.span, source));
    let scene = library.scene(word).map(|(found, source)| (found.name.span, source));
    let thing = library.scenes().find_map(|(scene, source)| {
        let thing = scene.things.iter().find(|thing| thing.name.text == word)?;
        Some((thing.name.span, source))
    });
    callable.or(fluent).or(ty).or(scene).or(thing).and_then(file)
}

/// Where a parameter of what is called is defined.
fn param_of<'a>(
    library: &'a Library,
    called: &str,
    param: &str,
) -> Option<(Span, &'a super::Source)> {
    let callable = library.callable(called).map(|(found, source)| (found.params(), source));
    let fluent = || library.fluent(called).map(|(found, source)| (&found.params[..], source));
    let (params, source) = callable.or_else(fluent)?;
    let found = params.iter().find(|known| known.name.text == param)?;
    Some((found.name.span, source))
}

/// Where a parameter or a `let` of an item is defined that has a meaning at a place.
fn local_at(item: &Item, at: usize, word: &str) -> Option<Span> {
    let param = params(item).iter().find(|param| param.name.text == word);
    let Item::Task(task) = item else { return param.map(|param| param.name.span) };
    let lets = task.steps.iter().rev().filter_map(|step| match step {
        Step::Let(name, _, span) if span.from <= at => Some(name),
        _ => None,
    });
    let found = lets.into_iter().find(|name| name.text == word).map(|name| name.span);
    found.or(param.map(|param| param.name.span))
}

/// The tokens that are no notes.
fn code(text: &str) -> Vec<Token> {
    tokens(text).into_iter().filter(|t| !matches!(t.kind, Kind::Note | Kind::Doc)).collect()
}

/// The index of the word that a byte lies in or right behind.
fn word_at(code: &[Token], at: usize) -> Option<usize> {
    code.iter().position(|t| t.kind == Kind::Word && t.from <= at && at <= t.to)
}

/// The item that a byte lies in.
fn item_at(program: &Program, at: usize) -> Option<&Item> {
    program.items.iter().find(|item| {
        let span = match item {
            Item::Fluent(item) => item.span,
            Item::Action(item) => item.span,
            Item::Task(item) => item.span,
            _ => return false,
        };
        span.from <= at && at <= span.to
    })
}

fn params(item: &Item) -> &[Param] {
    match item {
        Item::Fluent(item) => &item.params,
        Item::Action(item) => &item.params,
        Item::Task(item) => &item.params,
        _ => &[],
    }
}

/// The type of a parameter or the value of a `let` at a place.
fn local(program: &Program, at: usize, word: &str) -> Option<String> {
    locals(program, at).into_iter().find(|(name, _)| name == word).map(|(_, ty)| ty)
}

/// The parameters and `let`s that have a meaning at a place: name, type or value.
fn locals(program: &Program, at: usize) -> Vec<(String, String)> {
    let Some(item) = item_at(program, at) else { return Vec::new() };
    let params = params(item).iter();
    let mut found: Vec<_> =
        params.map(|param| (param.name.text.clone(), param.ty.text.clone())).collect();
    if let Item::Task(task) = item {
        found.extend(task.steps.iter().filter_map(|step| match step {
            Step::Let(name, value, span) if span.to <= at => {
                Some((name.text.clone(), super::text::expr(value)))
            }
            _ => None,
        }));
    }
    found
}
