//! Every place where a name means the same, and what it can be renamed to.
//!
//! Two words mean the same if they are defined at the same place. What an editor does not hold, and the standard
//! library, is not looked through.

use super::super::ast::Span;
use super::super::parse;
use super::super::parse::lexer::{Kind, tokens};
use super::{Definition, Place, code, defined, definition, word_at, words};

/// Returns the spans at which a text speaks of what is defined at a place; `here` is the text's own name.
pub fn uses(place: &Place<'_>, wanted: &Definition, word: &str, here: &str) -> Vec<Span> {
    let code = code(place.text);
    let (program, _) = parse(place.text);
    let is_same = |i: &usize| {
        code[*i].kind == Kind::Word
            && code[*i].text(place.text) == word
            && defined(place, &code, &program, *i)
                .is_some_and(|found| named(found, here) == *wanted)
    };
    let same = (0..code.len()).filter(is_same);
    same.map(|i| Span { from: code[i].from, to: code[i].to }).collect()
}

/// Returns where the word at a place is defined; `here` is the text's own name.
pub fn meant(place: &Place<'_>, here: &str) -> Option<Definition> {
    definition(place).map(|found| named(found, here))
}

/// The same, with the text's name where it lies in the text itself.
fn named(found: Definition, here: &str) -> Definition {
    let file = if found.file.is_empty() { here.to_owned() } else { found.file };
    Definition { file, ..found }
}

/// Returns the word at a place.
pub fn word<'a>(place: &Place<'a>) -> Option<(&'a str, Span)> {
    let code = code(place.text);
    let token = &code[word_at(&code, place.at)?];
    Some((token.text(place.text), Span { from: token.from, to: token.to }))
}

/// Whether a text can be a name: one word, and none that the language begins something with.
pub fn is_name(text: &str) -> bool {
    let tokens = tokens(text);
    matches!(tokens.as_slice(), [one] if one.kind == Kind::Word && one.text(text) == text)
        && words::keyword(text).is_none()
}
