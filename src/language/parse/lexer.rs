//! Words, numbers, brackets and comments of a text, before any grammar.
//!
//! Brackets are balanced and bad slices are explained on these tokens, and the formatter lays them
//! out; what they mean together is the grammar's business. Every byte that is not a blank belongs to
//! exactly one token.

/// What a token looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A name, a keyword or a unit.
    Word,
    /// Digits with point and exponent.
    Number,
    /// `"…"`, complete.
    Text,
    /// `"…` to the end of its line.
    OpenText,
    /// `// …`.
    Note,
    /// `/// …`.
    Doc,
    /// `(` or `{`.
    Open,
    /// `)` or `}`.
    Close,
    /// An operator or any other sign.
    Sign,
}

/// A token with its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Token {
    /// What it looks like.
    pub(crate) kind: Kind,
    /// First byte.
    pub(crate) from: usize,
    /// One past the last byte.
    pub(crate) to: usize,
    /// Whether only blanks stand before it on its line.
    pub(crate) first_on_line: bool,
    /// Blanks before it when it is first on its line, else 0.
    pub(crate) indent: usize,
}

impl Token {
    /// Returns its text.
    pub(crate) fn text<'a>(&self, source: &'a str) -> &'a str {
        &source[self.from..self.to]
    }
}

/// Operators of two characters.
const PAIRS: [&str; 5] = [">=", "<=", "==", "!=", "+-"];

/// Splits a text into its tokens.
pub(crate) fn tokens(source: &str) -> Vec<Token> {
    let mut out: Vec<Token> = Vec::new();
    let mut line_start = 0;
    let mut at = 0;
    let mut fresh_line = true;
    while let Some(c) = source[at..].chars().next() {
        if c == '\n' {
            at += 1;
            line_start = at;
            fresh_line = true;
            continue;
        }
        if c.is_whitespace() || c == '\u{FEFF}' {
            at += c.len_utf8();
            continue;
        }
        let rest = &source[at..];
        let to_line_end = || line_len(rest);
        let (kind, len) = match c {
            '/' if rest.starts_with("///") => (Kind::Doc, to_line_end()),
            '/' if rest.starts_with("//") => (Kind::Note, to_line_end()),
            '"' => match closing_quote(rest) {
                Some(end) => (Kind::Text, end),
                None => (Kind::OpenText, to_line_end()),
            },
            '(' | '{' => (Kind::Open, 1),
            ')' | '}' => (Kind::Close, 1),
            c if c.is_ascii_digit() => (Kind::Number, number_len(rest)),
            c if c.is_alphanumeric() || c == '_' => {
                let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_');
                (Kind::Word, end.unwrap_or(rest.len()))
            }
            _ if PAIRS.iter().any(|pair| rest.starts_with(pair)) => (Kind::Sign, 2),
            c => (Kind::Sign, c.len_utf8()),
        };
        let indent = if fresh_line { at - line_start } else { 0 };
        out.push(Token { kind, from: at, to: at + len, first_on_line: fresh_line, indent });
        fresh_line = false;
        at += len;
    }
    out
}

/// The length of the rest of the line, without blanks at its end.
fn line_len(rest: &str) -> usize {
    rest.split('\n').next().unwrap_or_default().trim_end().len()
}

/// Returns the byte after the quote that closes the text starting at 0, if it closes on its line.
fn closing_quote(rest: &str) -> Option<usize> {
    let mut escaped = false;
    for (i, c) in rest.char_indices().skip(1) {
        match c {
            '\n' => return None,
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return Some(i + 1),
            _ => {}
        }
    }
    None
}

/// The grammar's `num`.
fn number_len(rest: &str) -> usize {
    let bytes = rest.as_bytes();
    let digits = |mut i: usize| {
        while bytes.get(i).is_some_and(|b| b.is_ascii_digit() || *b == b'_') {
            i += 1;
        }
        i
    };
    let is_digit = |i: usize| bytes.get(i).is_some_and(u8::is_ascii_digit);
    let mut end = digits(0);
    if bytes.get(end) == Some(&b'.') && is_digit(end + 1) {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        if is_digit(end + 1 + sign) {
            end = digits(end + 1 + sign);
        }
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_that_is_not_blank_is_in_one_token() {
        let source =
            "task f(o: A) { // note\n  lift(o, by: 1.5e-2 m) \"a\\\"b\" >= +- °é \"open }\n}";
        let tokens = tokens(source);
        let mut at = 0;
        for token in &tokens {
            assert!(source[at..token.from].trim().is_empty());
            assert!(token.to > token.from);
            at = token.to;
        }
        assert!(source[at..].trim().is_empty());
        let kinds = |kind| tokens.iter().filter(|t| t.kind == kind).count();
        assert_eq!((kinds(Kind::Text), kinds(Kind::OpenText), kinds(Kind::Note)), (1, 1, 1));
        assert_eq!(kinds(Kind::Number), 1);
    }
}
