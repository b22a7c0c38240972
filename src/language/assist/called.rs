//! The call that a place lies in, and what is called there: what an editor shows while arguments are typed.

use super::super::builtins;
use super::super::library::Library;
use super::super::parse::lexer::{Kind, Token};
use super::{Place, code, describe, signature};

/// The call that is being typed.
pub(super) struct Around {
    /// Index of the token of its name.
    pub(super) name: usize,
    /// Which argument, from 0.
    pub(super) argument: usize,
    /// Index of the argument's first token.
    pub(super) start: usize,
}

/// A call whose arguments are being typed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Called {
    /// `pour(source: Container, target: Container)`.
    pub signature: String,
    /// What it does.
    pub doc: String,
    /// Its parameters as they stand in the signature.
    pub params: Vec<String>,
    /// Which of them is being given; none where there are fewer.
    pub active: Option<usize>,
}

/// Returns the innermost bracket that is open behind some tokens.
pub(super) fn open_bracket(code: &[Token]) -> Option<usize> {
    let mut depth = 0_i32;
    (0..code.len()).rev().find(|i| {
        match code[*i].kind {
            Kind::Close => depth += 1,
            Kind::Open => depth -= 1,
            _ => {}
        }
        depth < 0
    })
}

/// Returns the innermost call whose parenthesis is open behind some tokens; what is defined is not called.
pub(super) fn around(code: &[Token], text: &str) -> Option<Around> {
    let open = open_bracket(code)?;
    if code[open].text(text) != "(" {
        return None;
    }
    let name = open.checked_sub(1).filter(|i| code[*i].kind == Kind::Word)?;
    let (mut nested, mut argument, mut start) = (0, 0, open + 1);
    for (i, token) in code.iter().enumerate().skip(open + 1) {
        match (token.kind, token.text(text)) {
            (Kind::Open, _) => nested += 1,
            (Kind::Close, _) => nested -= 1,
            (_, ",") if nested == 0 => {
                argument += 1;
                start = i + 1;
            }
            _ => {}
        }
    }
    Some(Around { name, argument, start })
}

/// Whether a call's name is being defined there: `task name(`.
pub(super) fn defines(code: &[Token], name: usize, text: &str) -> bool {
    name > 0 && matches!(code[name - 1].text(text), "task" | "action" | "fluent")
}

/// Returns the call that is typed at a place.
pub fn called(place: &Place<'_>) -> Option<Called> {
    let before = place.text.get(..place.at)?;
    let code = code(before);
    let around = around(&code, before)?;
    if defines(&code, around.name, before) {
        return None;
    }
    let name = code[around.name].text(before);
    let params = params(place.library, name)?;
    let said = describe(place.library, place.scope, name).unwrap_or_default();
    let doc = said.lines().nth(1).map(|line| line.trim().to_owned()).unwrap_or_default();
    let text = |i: usize| code.get(i).map_or("", |token: &Token| token.text(before));
    let named = (text(around.start + 1) == ":").then(|| text(around.start));
    let active = match named {
        Some(named) => params.iter().position(|(name, _)| name == named),
        None => Some(around.argument).filter(|at| *at < params.len()),
    };
    let words: Vec<String> = params.into_iter().map(|(_, written)| written).collect();
    Some(Called { signature: format!("{name}({})", words.join(", ")), doc, params: words, active })
}

/// Returns the parameters of what is called: name, and as it is written in a signature.
fn params(library: &Library, name: &str) -> Option<Vec<(String, String)>> {
    let own = library.callable(name).map(|(callable, _)| callable.params());
    let own = own.or_else(|| library.fluent(name).map(|(fluent, _)| &fluent.params[..]));
    if let Some(own) = own {
        let written = |param| {
            let whole = signature("", std::slice::from_ref(param));
            (param.name.text.clone(), whole.trim_matches(['(', ')']).to_owned())
        };
        return Some(own.iter().map(written).collect());
    }
    let function = builtins::function(name)?;
    let params = function.params.iter();
    Some(params.map(|(name, ty)| ((*name).to_owned(), format!("{name}: {ty}"))).collect())
}
