//! The canonical layout of a text.
//!
//! Line breaks are the writer's; indentation, the blanks between tokens and runs of empty lines are
//! not. Working on tokens keeps every note and never changes what a text means: the tokens that come
//! out are the tokens that went in, in their order. Alignment of columns is not kept.

use super::parse::lexer::{Kind, Token, tokens};

/// Lays a text out: four blanks for each open bracket, one blank between tokens, at most one empty
/// line in a row, a newline at the end. Laying out twice changes nothing.
pub fn format(source: &str) -> String {
    let tokens = tokens(source);
    let mut out = String::with_capacity(source.len());
    let mut depth = 0_usize;
    let mut line: Vec<Token> = Vec::new();
    let mut before: Option<Token> = None;
    for (i, token) in tokens.iter().enumerate() {
        line.push(*token);
        let ends = tokens.get(i + 1).is_none_or(|next| next.first_on_line);
        if !ends {
            continue;
        }
        if let Some(before) = before
            && source[before.to..line[0].from].matches('\n').count() > 1
        {
            out.push('\n');
        }
        write_line(source, &line, before, &mut depth, &mut out);
        before = line.last().copied();
        line.clear();
    }
    out
}

/// Writes one line with its indentation.
fn write_line(
    source: &str,
    line: &[Token],
    before: Option<Token>,
    depth: &mut usize,
    out: &mut String,
) {
    let closing = line.iter().take_while(|t| t.kind == Kind::Close).count();
    let mut indent = depth.saturating_sub(closing);
    // What goes on with the line before stands one step further in.
    let first = line[0].text(source);
    let goes_on = matches!(first, "and" | "ask" | "within" | "+" | "-" | "*" | "/" | "|")
        || matches!(first, "<" | ">" | "<=" | ">=" | "==" | "!=")
        // The `or` of a choice follows a brace, that of a condition does not.
        || first == "or" && before.is_some_and(|t| t.text(source) != "}")
        || before.is_some_and(|t| matches!(t.text(source), "=" | "and" | "not" | "+" | "-" | "*"));
    if goes_on && line[0].kind != Kind::Close {
        indent += 1;
    }
    for _ in 0..indent {
        out.push_str("    ");
    }
    let mut last: Option<(Token, Option<Token>)> = None;
    for token in line {
        if let Some((previous, earlier)) = last
            && blank_between(source, earlier, previous, *token)
        {
            out.push(' ');
        }
        let text = token.text(source);
        out.push_str(text);
        match token.kind {
            Kind::Open => *depth += 1,
            Kind::Close => *depth = depth.saturating_sub(1),
            _ => {}
        }
        last = Some((*token, last.map(|(previous, _)| previous)));
    }
    out.push('\n');
}

/// Words after which a minus is the sign of a number, not a subtraction.
const BEFORE_SIGN: &[&str] = &[
    "and", "or", "not", "within", "check", "if", "while", "until", "when", "needs", "keeps",
    "gives", "to", "in",
];

/// Whether a blank stands between two tokens of one line.
fn blank_between(source: &str, earlier: Option<Token>, left: Token, right: Token) -> bool {
    let (a, b) = (left.text(source), right.text(source));
    let touching = left.to == right.from;
    if left.kind == Kind::Note || right.kind == Kind::Note {
        return true;
    }
    // `#[was("old")]` is one word to a reader.
    if matches!(a, "#" | "[")
        || matches!(b, "[" | "]")
        || b == "(" && earlier.is_some_and(|t| t.text(source) == "[")
    {
        return false;
    }
    // A call's parenthesis stands at its name; `at (0 m, 0 m)` has a blank, and the writer knows which.
    if b == "(" && left.kind == Kind::Word {
        return !touching;
    }
    // `5 . 3` is wrong, but it must not become another number.
    if (a == "." && right.kind == Kind::Number) || (b == "." && left.kind == Kind::Number) {
        return !touching;
    }
    if matches!(b, "," | ")" | ".")
        || matches!(a, "(" | ".")
        || (b == ":" && left.kind == Kind::Word)
    {
        return false;
    }
    // Units hold together: `N*m`, `rad/s^2`; so does what the writer put together of signs.
    if matches!(a, "*" | "/" | "^" | "·") || matches!(b, "*" | "/" | "^" | "·" | "%" | "°" | "'")
    {
        return !touching;
    }
    // A sign before a number is its sign unless an operand stands before it.
    if a == "-" {
        return earlier.is_some_and(|t| {
            let text = t.text(source);
            t.kind == Kind::Number
                || text == ")"
                || t.kind == Kind::Word && !BEFORE_SIGN.contains(&text)
        });
    }
    true
}

#[cfg(test)]
mod tests {
    use super::super::parse::parse;
    use super::*;

    const UGLY: &str = "// a note\n\n\n\nfluent   near( a:A,b :A ) =\ndistance(a,b)<=5 cm  // why\n\
        task f(o:A){\n  needs   visible(o)\nor held(o)\n    g(o , by : -5 mm) \n\n}\n\
        twin t of k{ effect e(j){ torque=1.83 N*m +- 0.04 N*m } }";

    #[test]
    fn ugly_text_comes_out_laid_out() {
        let expected = "// a note\n\nfluent near(a: A, b: A) =\n    distance(a, b) <= 5 cm // why\n\
            task f(o: A) {\n    needs visible(o)\n        or held(o)\n    g(o, by: -5 mm)\n\n}\n\
            twin t of k { effect e(j) { torque = 1.83 N*m +- 0.04 N*m } }\n";
        assert_eq!(format(UGLY), expected);
    }

    #[test]
    fn laying_out_twice_changes_nothing_and_tokens_stay() {
        let texts = [
            UGLY,
            include_str!("../../stdlib/tasks/std.task"),
            include_str!("../../stdlib/fluents/std.task"),
            include_str!("../../stdlib/scenes/kitchen.task"),
        ];
        for text in texts {
            let once = format(text);
            assert_eq!(format(&once), once);
            let words = |t: &str| -> Vec<String> {
                tokens(t).iter().map(|token| token.text(t).to_string()).collect()
            };
            assert_eq!(words(&once), words(text));
            let (a, b) = (parse(text), parse(&once));
            assert_eq!(a.0.items.len(), b.0.items.len());
            assert_eq!(a.1.len(), b.1.len());
        }
    }
}
