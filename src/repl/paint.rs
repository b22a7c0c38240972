//! Colours of a line while it is typed. They repeat what the words say: a call that exists, an object that
//! is on the table, a number with its unit.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::language::{TokenKind, is_reserved, tokens};

/// Names that are shown as known.
#[derive(Debug, Clone, Default)]
pub(super) struct Known {
    /// Tasks, actions and fluents.
    pub(super) calls: BTreeSet<String>,
    /// Objects.
    pub(super) objects: BTreeSet<String>,
}

// Colours and weights as ECMA-48 numbers them (SGR): cyan, green, yellow, magenta, bold, faint.
const CALL: u8 = 36;
const OBJECT: u8 = 32;
const NUMBER: u8 = 33;
const TEXT: u8 = 35;
const WORD: u8 = 1;
const NOTE: u8 = 2;

/// Returns a line with its colours, of the same width.
pub(super) fn paint(line: &str, known: &Known) -> String {
    if line.starts_with([':', '?', '!']) {
        let end = line.find(char::is_whitespace).unwrap_or(line.len());
        return format!("\x1b[{WORD}m{}\x1b[0m{}", &line[..end], &line[end..]);
    }
    let tokens = tokens(line);
    let mut painted = String::with_capacity(2 * line.len());
    let mut from = 0;
    for (i, token) in tokens.iter().enumerate() {
        let text = token.text(line);
        let after_number = i > 0 && tokens[i - 1].kind == TokenKind::Number;
        let colour = match token.kind {
            TokenKind::Word if is_reserved(text) => Some(WORD),
            TokenKind::Word if known.calls.contains(text) => Some(CALL),
            TokenKind::Word if known.objects.contains(text) => Some(OBJECT),
            TokenKind::Word if after_number => Some(NUMBER),
            TokenKind::Number => Some(NUMBER),
            TokenKind::Text | TokenKind::OpenText => Some(TEXT),
            TokenKind::Note | TokenKind::Doc => Some(NOTE),
            _ => None,
        };
        painted += &line[from..token.from];
        match colour {
            Some(colour) => {
                let _ = write!(painted, "\x1b[{colour}m{text}\x1b[0m");
            }
            None => painted += text,
        }
        from = token.to;
    }
    painted + &line[from..]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bare(painted: &str) -> String {
        let mut text = String::new();
        let mut rest = painted;
        while let Some((before, after)) = rest.split_once('\x1b') {
            text += before;
            rest = after.split_once('m').map_or("", |(_, rest)| rest);
        }
        text + rest
    }

    #[test]
    fn a_painted_line_is_the_line() {
        let known = Known {
            calls: BTreeSet::from(["pour".into()]),
            objects: BTreeSet::from(["jar".into()]),
        };
        for line in [
            "pour(jar, cup, amount: 40 mL) while held(jar) // slowly",
            ":graph pour(jar, cup)",
            "?pour",
            "!2 * 3",
            "say \"open",
            "  grüße \u{1f600} {",
            "",
        ] {
            assert_eq!(bare(&paint(line, &known)), line);
        }
        let painted = paint("pour(jar, 40 mL)", &known);
        assert!(painted.starts_with("\x1b[36mpour\x1b[0m(\x1b[32mjar\x1b[0m"), "{painted:?}");
        assert!(painted.contains("\x1b[33m40\x1b[0m \x1b[33mmL\x1b[0m"), "{painted:?}");
    }
}
