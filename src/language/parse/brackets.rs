//! Balances brackets and quotes before the grammar reads a text, and tells which ones were wrong.
//!
//! A bracket that is never closed would cost a parser the rest of the file, and its message would
//! name the place where reading stopped instead of the bracket. So they are looked for first: a
//! missing closing bracket is put in and an extra one is blanked out, each with a diagnostic, and
//! [`Balanced::original`] leads from the text so mended back to the bytes the person wrote.

use super::super::ast::Span;
use super::super::diagnostic::Diagnostic;
use super::lexer::{Kind, Token, tokens};

/// Brackets inside brackets beyond this are refused: no person writes them, and every later pass may
/// then recurse.
const MAX_DEPTH: usize = 64;

/// A piece of source with balanced brackets.
#[derive(Debug)]
pub(crate) struct Balanced {
    /// The mended text.
    pub(crate) text: String,
    /// What was wrong.
    pub(crate) diagnostics: Vec<Diagnostic>,
    /// Where the original was mended, in its bytes.
    pub(crate) repairs: Vec<usize>,
    /// Whether it must not be parsed: brackets too deep.
    pub(crate) hopeless: bool,
    /// First byte in the mended text, first byte in the original, length; inserted bytes have none.
    pieces: Vec<(usize, usize, usize)>,
}

impl Balanced {
    /// Returns the original bytes of a span of the mended text.
    pub(crate) fn original(&self, from: usize, to: usize) -> Span {
        let start = self.origin(from, false);
        let end = if to > from { self.origin(to - 1, true) } else { start };
        Span { from: start, to: end.max(start) }
    }

    /// The original place of one byte, or of the place just after it.
    fn origin(&self, byte: usize, after: bool) -> usize {
        let i = self.pieces.partition_point(|(mended, ..)| *mended <= byte);
        let Some((mended, original, len)) = i.checked_sub(1).and_then(|i| self.pieces.get(i))
        else {
            return self.pieces.first().map_or(0, |(_, original, _)| *original);
        };
        let inside = byte - mended;
        if inside < *len { original + inside + usize::from(after) } else { original + len }
    }
}

/// An edit of the original: put `insert` in at `at`, or blank `at` out when empty.
struct Edit {
    at: usize,
    insert: &'static str,
}

/// Reserved words that no expression can hold: one inside parentheses means they were not closed.
const NEVER_IN_PARENTHESES: &[&str] = &[
    "needs", "keeps", "gives", "either", "if", "else", "repeat", "together", "check", "let",
    "while", "until", "import", "type", "fluent", "action", "task",
];

/// Balances `source[from..to]`.
pub(crate) fn balance(source: &str, from: usize, to: usize) -> Balanced {
    let piece = &source[from..to];
    let all: Vec<Token> = tokens(piece)
        .into_iter()
        .map(|t| Token { from: t.from + from, to: t.to + from, ..t })
        .collect();
    let mut edits: Vec<Edit> = Vec::new();
    let mut diagnostics = Vec::new();
    // Unclosed texts first: the brackets inside them never count.
    for token in all.iter().filter(|t| t.kind == Kind::OpenText) {
        let text = token.text(source);
        let end = token.from + text_len(text);
        edits.push(Edit { at: end, insert: "\"" });
        diagnostics.push(
            Diagnostic::error(
                "task::unclosed",
                Span { from: token.from, to: end },
                "this text is never closed",
                "opened here",
            )
            .help("add `\"` where the text ends, on the same line"),
        );
    }
    let relexed;
    let code: Vec<Token> = if edits.is_empty() {
        all
    } else {
        // The brackets after the mended quote are tokens again.
        relexed = apply(source, from, to, &edits);
        tokens(&relexed.text)
            .into_iter()
            .map(|t| {
                let span = relexed.original(t.from, t.to);
                Token { from: span.from, to: span.to, ..t }
            })
            .collect()
    };
    let code: Vec<Token> =
        code.into_iter().filter(|t| !matches!(t.kind, Kind::Note | Kind::Doc)).collect();
    let hopeless = match_brackets(source, to, &code, &mut edits, &mut diagnostics);
    let mut out = apply(source, from, to, &edits);
    out.diagnostics = diagnostics;
    out.hopeless = hopeless;
    out
}

/// Returns how much of a text that is never closed is the text: a bracket at the line's end that nothing in the text opens
/// most likely closes something outside, and the `}` of `"serve the {o}` does not.
fn text_len(text: &str) -> usize {
    let mut rest = text.trim_end();
    loop {
        let (open, close) = match rest.chars().next_back() {
            Some('}') => ('{', '}'),
            Some(')') => ('(', ')'),
            _ => return rest.len().max(1),
        };
        if rest.matches(close).count() <= rest.matches(open).count() {
            return rest.len();
        }
        rest = rest[..rest.len() - 1].trim_end();
    }
}

/// An open bracket on the way.
struct Open {
    token: Token,
    /// Indentation of its line.
    indent: usize,
}

/// Finds the brackets that do not match; returns whether they are too deep to go on.
fn match_brackets(
    source: &str,
    end: usize,
    code: &[Token],
    edits: &mut Vec<Edit>,
    diagnostics: &mut Vec<Diagnostic>,
) -> bool {
    let count = |bracket| code.iter().filter(|t| t.text(source) == bracket).count();
    if let Some(token) = tower(source, code) {
        diagnostics.push(
            Diagnostic::error(
                "task::depth",
                span(token),
                format!("powers of powers are more than {MAX_DEPTH} high"),
                "this one is too high",
            )
            .help("give a part of the formula a name with `let`"),
        );
        return true;
    }
    let braces_missing = count("{") > count("}");
    let mut open: Vec<Open> = Vec::new();
    let mut line_indent = 0;
    for (i, token) in code.iter().enumerate() {
        if token.first_on_line {
            line_indent = token.indent;
        }
        let text = token.text(source);
        let before = i.checked_sub(1).map(|i| code[i]);
        let place = (before.map_or(token.from, |b| b.to), Some(*token));
        if open.last().is_some_and(|o| o.token.text(source) == "(")
            && ends_parentheses(source, code, i)
        {
            close(source, &mut open, &["("], place, edits, diagnostics);
        }
        if braces_missing && !open.is_empty() && begins_file_step(source, code, i) {
            close(source, &mut open, &["(", "{"], place, edits, diagnostics);
        }
        match (token.kind, text) {
            (Kind::Open, _) => {
                open.push(Open { token: *token, indent: line_indent });
                if open.len() > MAX_DEPTH {
                    diagnostics.push(
                        Diagnostic::error(
                            "task::depth",
                            span(*token),
                            format!("brackets are nested more than {MAX_DEPTH} deep"),
                            "this one is too deep",
                        )
                        .help("move an inner part into a task or fluent of its own"),
                    );
                    return true;
                }
            }
            (Kind::Close, ")") => {
                if open.last().is_some_and(|o| o.token.text(source) == "(") {
                    open.pop();
                } else {
                    extra(*token, text, edits, diagnostics);
                }
            }
            (Kind::Close, _) => {
                // A brace at the left of the last open line closes an outer one: the inner is open.
                if braces_missing && token.first_on_line {
                    let outer = open.iter().any(|o| o.indent == token.indent);
                    while outer && open.last().is_some_and(|o| o.indent > token.indent) {
                        let inner = open.pop().expect("the last one was just looked at");
                        let at = before.map_or(token.from, |b| b.to);
                        edits.push(Edit { at, insert: "}" });
                        diagnostics.push(unclosed(source, inner.token, Some(*token)));
                    }
                }
                if open.pop().is_none() {
                    extra(*token, text, edits, diagnostics);
                }
            }
            _ => {}
        }
    }
    let last = code.last().map_or(end, |t| t.to);
    // One message: the outer ones would most likely have been closed too.
    close(source, &mut open, &["(", "{"], (last, None), edits, diagnostics);
    false
}

/// Finds the sign with which powers of powers, `a^b^c`, are too high. The grammar goes down one rule for each, and
/// no bracket says so.
fn tower(source: &str, code: &[Token]) -> Option<Token> {
    let mut height = 0;
    for (i, token) in code.iter().enumerate() {
        let next = code.get(i + 1);
        let is_double = next.is_some_and(|n| n.from == token.to && n.text(source) == "*");
        let before = i.checked_sub(1).map_or("", |i| code[i].text(source));
        match token.text(source) {
            "^" => height += 1,
            "*" if is_double => height += 1,
            // The second half of `**`, and the sign of an exponent.
            "*" if before == "*" => {}
            "-" if matches!(before, "^" | "*") => {}
            _ if matches!(token.kind, Kind::Sign) && !matches!(token.text(source), "." | "'") => {
                height = 0;
            }
            _ => {}
        }
        if height > MAX_DEPTH {
            return Some(*token);
        }
    }
    None
}

/// Whether the token at `i` cannot stand inside parentheses.
fn ends_parentheses(source: &str, code: &[Token], i: usize) -> bool {
    let text = code[i].text(source);
    let next = code.get(i + 1);
    let next_text = next.map_or("", |t| t.text(source));
    match code[i].kind {
        Kind::Open => text == "{",
        Kind::Close => text == "}",
        Kind::Word => {
            let clause = match text {
                "run" | "say" | "ask" => next.is_some_and(|t| t.kind == Kind::Text),
                "on" => next_text == "failure",
                word => NEVER_IN_PARENTHESES.contains(&word),
            };
            // Two operands side by side on two lines, the second a call: the next step has begun.
            let beside = i > 0
                && {
                    let before = code[i - 1];
                    let operand = match before.kind {
                        Kind::Number | Kind::Text => true,
                        Kind::Word => {
                            !matches!(before.text(source), "and" | "or" | "not" | "within")
                        }
                        Kind::Close => before.text(source) == ")",
                        _ => false,
                    };
                    code[i].first_on_line && operand && next_text == "("
                }
                && !matches!(text, "and" | "or" | "not" | "within");
            clause || beside
        }
        _ => false,
    }
}

/// Whether the token at `i` is a call at the left edge below a line that is indented, and so a step of the file.
fn begins_file_step(source: &str, code: &[Token], i: usize) -> bool {
    let token = code[i];
    let is_call =
        token.kind == Kind::Word && code.get(i + 1).is_some_and(|t| t.text(source) == "(");
    let above = || code[..i].iter().rev().find(|t| t.first_on_line);
    is_call && token.first_on_line && token.indent == 0 && above().is_some_and(|t| t.indent > 0)
}

/// Closes the open brackets of these kinds, innermost first, at a place and before the token there; tells of the innermost.
fn close(
    source: &str,
    open: &mut Vec<Open>,
    kinds: &[&str],
    (at, found): (usize, Option<Token>),
    edits: &mut Vec<Edit>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let mut told = false;
    while let Some(left) = open.pop_if(|o| kinds.contains(&o.token.text(source))) {
        let is_brace = left.token.text(source) == "{";
        edits.push(Edit { at, insert: if is_brace { "}" } else { ")" } });
        if !told {
            diagnostics.push(unclosed(source, left.token, found));
            told = true;
        }
    }
}

fn span(token: Token) -> Span {
    Span { from: token.from, to: token.to }
}

/// `bracket` is never closed; it should have been before `found`.
fn unclosed(source: &str, bracket: Token, found: Option<Token>) -> Diagnostic {
    let text = bracket.text(source);
    let closing = if text == "{" { "}" } else { ")" };
    let diagnostic = Diagnostic::error(
        "task::unclosed",
        span(bracket),
        format!("`{text}` is never closed"),
        "opened here",
    );
    match found {
        Some(found) => diagnostic
            .label(span(found), "expected the closing bracket before this")
            .help(format!("add `{closing}` before this `{}`", found.text(source)))
            .insert(found.from, closing),
        None => diagnostic.help(format!("add `{closing}` where it should end")),
    }
}

/// `bracket` closes nothing: it is blanked out.
fn extra(bracket: Token, text: &str, edits: &mut Vec<Edit>, diagnostics: &mut Vec<Diagnostic>) {
    edits.push(Edit { at: bracket.from, insert: "" });
    diagnostics.push(
        Diagnostic::error(
            "task::unopened",
            span(bracket),
            format!("`{text}` closes nothing"),
            "no bracket is open here",
        )
        .help(format!("remove this `{text}`, or open it earlier"))
        .fix(span(bracket), ""),
    );
}

/// Applies the edits in the order of their places; those at one place in the order given.
fn apply(source: &str, from: usize, to: usize, edits: &[Edit]) -> Balanced {
    let mut order: Vec<usize> = (0..edits.len()).collect();
    order.sort_by_key(|i| edits[*i].at);
    let mut text = String::with_capacity(to - from + edits.len());
    let mut pieces = Vec::new();
    let mut at = from;
    for i in order {
        let edit = &edits[i];
        if edit.at > at {
            pieces.push((text.len(), at, edit.at - at));
            text.push_str(&source[at..edit.at]);
            at = edit.at;
        }
        if edit.insert.is_empty() {
            // Blanked out: one byte for one byte, so the pieces keep their length.
            pieces.push((text.len(), at, 1));
            text.push(' ');
            at += 1;
        } else {
            pieces.push((text.len(), at, 0));
            text.push_str(edit.insert);
        }
    }
    pieces.push((text.len(), at, to.saturating_sub(at)));
    text.push_str(source.get(at..to).unwrap_or_default());
    Balanced {
        text,
        diagnostics: Vec::new(),
        repairs: edits.iter().map(|edit| edit.at).collect(),
        hopeless: false,
        pieces,
    }
}

/// The brackets that are open where a text ends.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct OpenAtEnd {
    /// How many blocks.
    pub(crate) braces: usize,
    /// How many parentheses in the innermost of them.
    pub(crate) parentheses: usize,
}

/// Returns the brackets that are open where a text ends. No brace stands inside parentheses: one ends those that were left open.
pub(crate) fn open_at_end(source: &str) -> OpenAtEnd {
    let mut open = OpenAtEnd::default();
    for token in tokens(source) {
        match (token.kind, token.text(source)) {
            (Kind::Open, "{") => open = OpenAtEnd { braces: open.braces + 1, parentheses: 0 },
            (Kind::Close, "}") => {
                open = OpenAtEnd { braces: open.braces.saturating_sub(1), parentheses: 0 };
            }
            (Kind::Open, _) => open.parentheses += 1,
            (Kind::Close, _) => open.parentheses = open.parentheses.saturating_sub(1),
            _ => {}
        }
    }
    open
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mended(source: &str) -> (String, Vec<String>) {
        let out = balance(source, 0, source.len());
        (out.text, out.diagnostics.into_iter().map(|d| d.message).collect())
    }

    #[test]
    fn a_balanced_text_is_left_alone() {
        let source = "task f(o: A) { g(o) // ) \n say \"}\" }";
        assert_eq!(mended(source), (source.into(), vec![]));
    }

    #[test]
    fn a_parenthesis_is_closed_before_what_cannot_stand_inside() {
        assert_eq!(mended("{ grasp(o, top }").0, "{ grasp(o, top) }");
        assert_eq!(
            mended("{ needs visible(o\n gives held(o) }").0,
            "{ needs visible(o)\n gives held(o) }"
        );
        assert_eq!(mended("{ lift(o\n grasp(o) }").0, "{ lift(o)\n grasp(o) }");
        assert_eq!(mended("task f(o: A { g(o) }").0, "task f(o: A) { g(o) }");
        assert_eq!(mended("f(g(h(x").0, "f(g(h(x)))");
        // A list over several lines is no mistake.
        assert_eq!(mended("f(a,\n g(b),\n h(c) +\n k(d))").1.len(), 0);
    }

    #[test]
    fn a_brace_is_closed_where_the_indentation_says() {
        let (text, messages) = mended("task a() {\n    if x {\n        f()\n    g()\n}\n");
        assert_eq!(messages, ["`{` is never closed"]);
        assert!(text.ends_with("g()}\n}\n"), "{text}");
    }

    #[test]
    fn a_block_that_is_open_ends_before_a_step_at_the_left_edge() {
        let (text, messages) = mended("task a() {\n    f()\n\na(jar)\n");
        assert_eq!(messages, ["`{` is never closed"]);
        assert_eq!(text, "task a() {\n    f()}\n\na(jar)\n");
    }

    #[test]
    fn a_brace_that_a_text_opens_is_of_the_text() {
        assert_eq!(mended("{ say \"the {o}\n f(o) }").0, "{ say \"the {o}\"\n f(o) }");
        assert_eq!(mended("{ f(\"jar) }").0, "{ f(\"jar\") }");
    }

    #[test]
    fn an_extra_bracket_is_blanked_out_and_bytes_lead_back() {
        let out = balance("f(a)) }", 0, 7);
        assert_eq!(out.text, "f(a)   ");
        assert_eq!(out.diagnostics.len(), 2);
        let out = balance("  \"ab\nf(x\n", 2, 10);
        assert_eq!(out.text, "\"ab\"\nf(x)\n");
        let at = out.text.find('x').unwrap();
        assert_eq!(out.original(at, at + 1), Span { from: 8, to: 9 });
        assert_eq!(out.original(at, at + 2), Span { from: 8, to: 9 });
    }

    #[test]
    fn powers_too_high_are_refused_and_products_of_powers_are_not() {
        for hostile in ["x^".repeat(1000) + "2", "x**".repeat(1000) + "2", "x^-".repeat(1000) + "2"]
        {
            assert!(balance(&hostile, 0, hostile.len()).hopeless, "{hostile}");
        }
        for good in ["x^2*".repeat(1000) + "2", "x^2 + ".repeat(1000) + "2", "x**2 * ".repeat(1000)]
        {
            assert!(!balance(&good, 0, good.len()).hopeless, "{good}");
        }
    }

    #[test]
    fn what_is_open_at_the_end_is_counted_and_a_brace_ends_parentheses() {
        let open = |source| {
            let OpenAtEnd { braces, parentheses } = open_at_end(source);
            (braces, parentheses)
        };
        assert_eq!(open("pour(jar, cup"), (0, 1));
        assert_eq!(open("pour(jar, cup) // ("), (0, 0));
        assert_eq!(open("task f(o: A) { g(o"), (1, 1));
        assert_eq!(open("task f(o: A) { g(o }"), (0, 0));
        assert_eq!(open("task f(o: A { g(o)"), (1, 0));
        assert_eq!(open("g(o)) h("), (0, 1));
    }

    #[test]
    fn brackets_too_deep_are_refused_and_not_followed() {
        assert!(balance(&"(".repeat(100_000), 0, 100_000).hopeless);
    }
}
