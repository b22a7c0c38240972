//! A text → its syntax tree and what is wrong with it.
//!
//! Four passes: the text is cut where an item certainly starts, so that no mistake reaches past its
//! item; the brackets of each piece are balanced ([`brackets`]); the grammar reads it, swallowing what
//! it cannot read; and each swallowed slice is explained ([`explain`]). [`build`] turns the grammar's
//! pairs into the tree.
//!
//! Source: Ford, "Parsing Expression Grammars", POPL 2004; the grammar is `grammar/task.pest`.

mod brackets;
mod build;
mod explain;
mod grammar;
mod expression;
mod habit;
pub(crate) mod lexer;
mod model;
mod scene;
mod step;
mod words;

use std::num::NonZeroUsize;

use pest::Parser;

use super::ast::{Item, Program, Span, Step};
use super::diagnostic::{Diagnostic, limited};
use brackets::{Balanced, OpenAtEnd, balance, open_at_end};
use build::Builder;
use grammar::{Rule, TaskParser};
use lexer::{Kind, Token, tokens};
pub use words::nearest;

/// The most rules that may be tried on one item: a thousand times what a long task needs.
const MOST_CALLS: usize = 20_000_000;

/// Whether a word belongs to the language and cannot be a name.
pub(crate) fn is_reserved(word: &str) -> bool {
    words::RESERVED.contains(&word)
}

/// Reads a whole file. Never fails: what cannot be read is [`Item::Bad`] or [`Step::Bad`] and has a
/// diagnostic; all diagnostics come at once, in the order of the text, and from the thousandth on as one that counts.
pub fn parse(source: &str) -> (Program, Vec<Diagnostic>) {
    // Text may come from a model or a network: nothing keeps the parser busy for long.
    pest::set_call_limit(NonZeroUsize::new(MOST_CALLS));
    let mut program = Program::default();
    let mut diagnostics = Vec::new();
    for piece in pieces(source) {
        let balanced = balance(source, piece.from, piece.to);
        let mut builder = Builder::new(&balanced);
        if balanced.hopeless {
            program.items.push(Item::Bad(piece));
        } else {
            match TaskParser::parse(Rule::file, &balanced.text) {
                Ok(pairs) => program.items.extend(builder.file(pairs)),
                Err(error) => {
                    // The file rule accepts every text, so only a limit of pest's can lead here.
                    builder.diagnostics.push(Diagnostic::error(
                        "task::syntax",
                        piece,
                        format!("this is too involved to read: {}", error.variant.message()),
                        "starts here",
                    ));
                    program.items.push(Item::Bad(piece));
                }
            }
        }
        let found = builder.diagnostics;
        diagnostics.extend(balanced.diagnostics);
        diagnostics.extend(found);
    }
    diagnostics.sort_by_key(|d| (d.span.from, d.span.to));
    (program, limited(diagnostics))
}

/// Whether a word is one of the language: it cannot be a name, or begins an item or a step.
pub(crate) fn is_of_language(word: &str) -> bool {
    let begins = words::ITEMS.iter().chain(words::STEPS);
    is_reserved(word) || begins.chain(words::CLAUSES).any(|begin| *begin == word)
}

/// Reads one line of the prompt: a call or another step. `None` when there is nothing to do or it
/// cannot be read; the diagnostics say why.
pub fn parse_line(source: &str) -> (Option<Step>, Vec<Diagnostic>) {
    let (program, mut diagnostics) = parse(source);
    let mut steps = Vec::new();
    for item in program.items {
        match item {
            Item::Run(step) => steps.push(step),
            Item::Bad(_) => {}
            _ => diagnostics.push(
                Diagnostic::error(
                    "task::not_a_step",
                    Span { from: 0, to: source.trim_end().len() },
                    "the prompt runs steps; this defines something",
                    "not a step",
                )
                .help("save it in a `.task` file and run that; tasks of the `--scene` file are known here"),
            ),
        }
    }
    let step = match steps.len() {
        0 => None,
        1 => steps.pop(),
        _ => Some(Step::Sequence(steps, Span { from: 0, to: source.trim_end().len() })),
    };
    let step = step.filter(|_| !diagnostics.iter().any(Diagnostic::is_error));
    (step, diagnostics)
}

/// Returns whether a text typed so far wants another line: an open bracket, or an end after which
/// something must follow.
pub fn is_incomplete(source: &str) -> bool {
    if open_at_end(source) != OpenAtEnd::default() {
        return true;
    }
    let code: Vec<Token> = tokens(source).into_iter().filter(|t| t.kind != Kind::Note).collect();
    let Some(last) = code.last() else { return false };
    let text = last.text(source);
    match last.kind {
        Kind::Doc => true,
        // A sentence ends with a mark; the language has none of these, nor signs of other keyboards.
        Kind::Sign if text.is_ascii() => !matches!(text, "%" | "?" | "!" | "." | ";" | "'" | "`"),
        Kind::Sign => text == "±",
        // A sentence may end with it: put the jar somewhere else.
        Kind::Word if text == "else" => {
            code.iter().any(|t| matches!(t.text(source), "if" | "either" | "}"))
        }
        Kind::Word => matches!(
            text,
            "and"
                | "or"
                | "not"
                | "within"
                | "while"
                | "until"
                | "then"
                | "as"
                | "check"
                | "let"
                | "if"
                | "either"
                | "repeat"
                | "together"
                | "needs"
                | "keeps"
                | "gives"
                | "import"
                | "task"
                | "action"
                | "fluent"
                | "type"
                | "via"
        ),
        // `task pick(o: Graspable)` waits for its body.
        Kind::Close => {
            text == ")"
                && matches!(code[0].text(source), "task" | "action" | "fluent" | "if" | "either")
                && !code.iter().any(|t| matches!(t.text(source), "{" | "="))
        }
        _ => false,
    }
}

/// Returns whether a text ends between the braces of a block.
pub fn is_in_block(source: &str) -> bool {
    open_at_end(source).braces > 0
}

/// Cuts a text where items certainly start: a reserved starter first on its line with a name after
/// it, or a `scene`, `twin` or `model` at the left edge; with the documentation lines before it.
fn pieces(source: &str) -> Vec<Span> {
    let tokens = tokens(source);
    let mut cuts = vec![0];
    for (i, token) in tokens.iter().enumerate() {
        let next = tokens.get(i + 1);
        let named = next.is_some_and(|t| matches!(t.kind, Kind::Word | Kind::Text));
        let starts = token.kind == Kind::Word
            && token.first_on_line
            && named
            && match token.text(source) {
                "task" | "action" | "fluent" | "type" | "import" => true,
                "scene" | "twin" | "model" => token.indent == 0,
                _ => false,
            };
        if starts {
            let first = tokens[i - leading(source, &tokens[..i])];
            cuts.push(first.from - first.indent);
        }
    }
    cuts.push(source.len());
    cuts.dedup();
    cuts.windows(2).map(|w| Span { from: w[0], to: w[1] }).filter(|s| s.from < s.to).collect()
}

/// Returns how many tokens at the end belong to the item that follows: its documentation and attributes.
fn leading(source: &str, before: &[Token]) -> usize {
    let mut taken = 0;
    loop {
        let rest = &before[..before.len() - taken];
        match rest.last() {
            Some(last) if last.kind == Kind::Doc => taken += 1,
            Some(last) if last.text(source) == "]" => {
                // `#[was("old")]` has seven tokens; anything longer is none.
                let start = rest.iter().rev().take(9).position(|t| t.text(source) == "#");
                match start {
                    Some(back) if rest[rest.len() - 1 - back].first_on_line => taken += back + 1,
                    _ => return taken,
                }
            }
            _ => return taken,
        }
    }
}

impl Balanced {
    /// Returns whether the original was mended inside or at the edge of a span: what is wrong there
    /// has been told.
    fn mended(&self, span: Span) -> bool {
        self.repairs.iter().any(|at| (span.from..=span.to).contains(at))
    }
}
