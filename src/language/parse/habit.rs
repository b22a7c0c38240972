//! What other languages and other tools have taught people to write, answered with what to write here.
//!
//! A habit is a row of [`HABITS`], or of [`MODEL_HABITS`] for the lines of a model. The first row that is met
//! answers, so what is told from its beginning stands before what any word may begin.

use super::super::diagnostic::Diagnostic;
use super::grammar::Place;
use super::lexer::{Kind, Token, tokens};
use super::words::{ITEMS, MODEL, RESERVED, STEPS, ToOriginal, nearest};
use crate::units::known_units;

/// Words that a condition follows.
const CONDITIONS: &[&str] = &["needs", "keeps", "gives", "check"];

/// What other languages have taught people to write.
pub(super) fn habit(
    place: Place,
    line: &str,
    slice: &str,
    code: &[Token],
    original: &ToOriginal,
) -> Option<Diagnostic> {
    code.first()?;
    let written = Written { place, line, slice, code };
    let habits = match place {
        Place::Args => return argument_with_equals(&written, original),
        Place::Model => MODEL_HABITS,
        Place::Step | Place::Item | Place::Clause => HABITS,
        _ => return None,
    };
    let met = habits.iter().find(|habit| (habit.is_met)(&written))?;
    let at = code[met.at.min(code.len() - 1)];
    let span = original(at.from, at.to);
    let found = Diagnostic::error(met.code, span, (met.message)(&written), met.label);
    Some(found.help((met.help)(&written)))
}

/// A slice that could not be read, with where it stands.
struct Written<'a> {
    /// What was to be read.
    place: Place,
    /// What stands before the slice on its line.
    line: &'a str,
    slice: &'a str,
    /// The slice's tokens without notes, at least one.
    code: &'a [Token],
}

impl Written<'_> {
    /// Returns the text of a token, or an empty one behind the last.
    fn text(&self, i: usize) -> &str {
        self.code.get(i).map_or("", |t| t.text(self.slice))
    }

    /// Returns whether there is such a token and it looks like this.
    fn is(&self, i: usize, kind: Kind) -> bool {
        self.code.get(i).is_some_and(|t| t.kind == kind)
    }

    /// Returns the line's last word, which the first token of the slice is meant for.
    fn asked(&self) -> &str {
        tokens(self.line).last().map_or("", |t| t.text(self.line))
    }

    /// Returns whether a condition is under way on the line.
    fn asks(&self) -> bool {
        tokens(self.line).first().is_some_and(|t| CONDITIONS.contains(&t.text(self.line)))
    }

    /// Returns whether the line ends in `gives holding` or `= visible`, with the word it is about still to come.
    fn asks_bare(&self) -> bool {
        let text = |token: &Token| token.text(self.line);
        match tokens(self.line).as_slice() {
            [word, .., before, asked] => {
                (CONDITIONS.contains(&text(word)) || text(word) == "fluent")
                    && matches!(text(before), "=" | "and" | "or" | "not")
                    && is_name(asked, text(asked))
            }
            [word, asked] => CONDITIONS.contains(&text(word)) && is_name(asked, text(asked)),
            _ => false,
        }
    }

    /// Returns whether a condition is under way: on the line, or in an item that the line goes on with.
    fn is_in_condition(&self) -> bool {
        let opens = |text: &str| {
            CONDITIONS.contains(&text)
                || matches!(text, "fluent" | "while" | "until" | "if" | "when" | "within")
                || matches!(text, ">=" | "<=" | "==" | "!=" | ">" | "<")
        };
        tokens(self.line).iter().any(|t| opens(t.text(self.line)))
            || (self.place == Place::Item && self.line.starts_with([' ', '\t']))
    }

    /// Returns whether the first word is one of a model's, or nearly one.
    fn begins_like_a_model(&self) -> bool {
        MODEL.contains(&self.text(0)) || nearest(self.text(0), MODEL.iter().copied()).is_some()
    }
}

/// Returns whether a remark begins here as other languages begin one.
fn remarks(w: &Written<'_>) -> bool {
    match (w.text(0), w.text(1)) {
        ("#", next) => next != "[",
        ("-", "-") | ("/", "*") => w.code[0].to == w.code[1].from,
        _ => false,
    }
}

/// Returns whether this is `def serve(o):` or `aufgabe serviere(o) {`: two words, parameters, and what begins a body.
fn defines(w: &Written<'_>) -> bool {
    let is_word = |i: usize| w.code.get(i).is_some_and(|t| is_name(t, w.text(i)));
    let close = w.code.iter().position(|t| t.text(w.slice) == ")");
    w.place == Place::Item
        && is_word(0)
        && is_word(1)
        && w.text(2) == "("
        && close.is_some_and(|close| matches!(w.text(close + 1), "{" | ":"))
        && nearest(w.text(0), ITEMS.iter().chain(STEPS).copied()).is_none()
}

/// Returns whether a decimal number goes on here behind a comma: the `,5 mL` of `1,5 mL`.
fn is_decimal(w: &Written<'_>) -> bool {
    w.text(0) == ","
        && w.is(1, Kind::Number)
        && w.code[0].to == w.code[1].from
        && w.line.ends_with(|c: char| c.is_ascii_digit())
}

/// Returns whether a token is a word that may be a name.
fn is_name(token: &Token, text: &str) -> bool {
    token.kind == Kind::Word && !RESERVED.contains(&text)
}

/// `lift(jar, by = 12 cm)`.
fn argument_with_equals(written: &Written, original: &ToOriginal) -> Option<Diagnostic> {
    let Written { slice, code, .. } = *written;
    let at = code.iter().position(|t| t.text(slice) == "=")?;
    let name = written.text(at.checked_sub(1)?);
    let end = code[at..].iter().find(|t| matches!(t.text(slice), "," | ")"));
    let value = slice[code[at].to..end.map_or(slice.len(), |t| t.from)].trim();
    let found = Diagnostic::error(
        "task::equals",
        original(code[at].from, code[at].to),
        "an argument is given with `:`, not with `=`",
        "expected `:`",
    );
    let sign = original(code[at - 1].to, code[at].to);
    Some(found.help(format!("write `{name}: {value}`")).fix(sign, ":"))
}

/// A habit: how it is told, and what is answered.
struct Habit {
    /// Whether this is it.
    is_met: fn(&Written<'_>) -> bool,
    /// Index of the token that is pointed at; the last one where there are fewer.
    at: usize,
    code: &'static str,
    message: fn(&Written<'_>) -> String,
    label: &'static str,
    help: fn(&Written<'_>) -> String,
}

/// Habits of steps, items and clauses.
const HABITS: &[Habit] = &[
    Habit {
        is_met: is_decimal,
        at: 0,
        code: "task::syntax",
        message: |_| "a decimal number is written with a point".into(),
        label: "not a `,`",
        help: |w| {
            let has_unit = w.is(2, Kind::Word) && !w.code[2].first_on_line;
            let unit = if has_unit { format!(" {}", w.text(2)) } else { String::new() };
            format!("write `{}.{}{unit}`", w.asked(), w.text(1))
        },
    },
    Habit {
        is_met: |w| w.text(0) == "," && w.asks(),
        at: 0,
        code: "task::separator",
        message: |_| "conditions are joined with `and`".into(),
        label: "not a `,`",
        help: |_| "write `and` instead of the `,`".into(),
    },
    // `gives holding o`
    Habit {
        is_met: |w| {
            let goes_on = matches!(w.text(1), "and" | "or" | "ask");
            w.asks_bare() && is_name(&w.code[0], w.text(0)) && (w.code.len() == 1 || goes_on)
        },
        at: 0,
        code: "task::call",
        message: |w| format!("what `{}` is about stands in parentheses", w.asked()),
        label: "expected `(`",
        help: |w| format!("write `{}({})`", w.asked(), w.text(0)),
    },
    Habit {
        is_met: |w| matches!(w.text(0), "elif" | "elsif" | "elseif"),
        at: 0,
        code: "task::keyword",
        message: |w| format!("`{}` is two words here", w.text(0)),
        label: "not a word of the language",
        help: |_| "write `else if`".into(),
    },
    Habit {
        is_met: |w| w.text(0) == "ask" && w.code.len() > 1 && !w.is(1, Kind::Text),
        at: 1,
        code: "task::syntax",
        message: |_| "a question stands in quotes".into(),
        label: "expected a text in quotes",
        help: |w| format!("write `ask \"{}\"`", w.slice[w.code[1].from..].trim_end()),
    },
    Habit {
        is_met: |w| w.text(0) == "if" && w.line.trim_end().ends_with("break"),
        at: 0,
        code: "task::syntax",
        message: |_| "a breakpoint says when with `when`".into(),
        label: "expected `when`",
        help: |w| format!("write `break when {}`", w.slice[w.code[0].to..].trim()),
    },
    Habit {
        is_met: |w| w.text(0) == "repeat" && w.text(1) == "until",
        at: 1,
        code: "task::loop",
        message: |_| "a repetition says how often at most".into(),
        label: "expected `upto`",
        help: |_| "write `repeat upto 10 times { … } until …`".into(),
    },
    Habit {
        is_met: |w| w.text(0) == "upto" && w.is(1, Kind::Number),
        at: 1,
        code: "task::count",
        message: |_| "how often is said with `times`".into(),
        label: "expected `times` behind it",
        help: |w| format!("write `upto {} times`", w.text(1)),
    },
    Habit {
        is_met: |w| w.text(0) == "." && w.text(1) == "then",
        at: 0,
        code: "task::separator",
        message: |_| "steps are not joined with a dot".into(),
        label: "not needed",
        help: |_| "write `a() then b()`".into(),
    },
    Habit {
        is_met: |w| w.text(0) == "then" && w.code.len() > 1 && w.text(1) != "(",
        at: 0,
        code: "task::separator",
        message: |_| "`then` joins two steps, and begins none".into(),
        label: "no step before this",
        help: |_| "leave the `then` out, or write it between two: `a() then b()`".into(),
    },
    Habit {
        is_met: |w| w.text(0) == "then" && w.code.len() == 1,
        at: 0,
        code: "task::syntax",
        message: |_| "a step is missing after `then`".into(),
        label: "expected a step behind it",
        help: |_| "write what comes next, or leave the `then` out".into(),
    },
    // `wait 2 s`
    Habit {
        is_met: |w| {
            is_name(&w.code[0], w.text(0))
                && !STEPS.contains(&w.text(0))
                && w.is(1, Kind::Number)
                && !w.code[1].first_on_line
                && w.code.len() <= 3
        },
        at: 1,
        code: "task::call",
        message: |w| format!("what `{}` acts on stands in parentheses", w.text(0)),
        label: "expected `(`",
        help: |w| {
            let given = w.slice[w.code[1].from..w.code[w.code.len() - 1].to].trim();
            format!("write `{}({given})`", w.text(0))
        },
    },
    Habit {
        is_met: |w| w.text(0) == "=" && !matches!(w.text(1), ">" | "<"),
        at: 0,
        code: "task::equals",
        message: |_| "`=` gives a value; it does not compare".into(),
        label: "expected a comparison",
        help: |_| "write `==` with `within` and a tolerance, or `>=`, `<=`".into(),
    },
    Habit {
        is_met: |w| matches!(w.text(0), ";" | ","),
        at: 0,
        code: "task::separator",
        message: |w| format!("steps need no `{}` between them", w.text(0)),
        label: "not needed",
        help: |w| format!("remove the `{}`", w.text(0)),
    },
    Habit {
        is_met: |w| matches!(w.text(0), "and" | "or") && w.code.len() == 1 && w.is_in_condition(),
        at: 0,
        code: "task::syntax",
        message: |w| format!("a condition is missing after `{}`", w.text(0)),
        label: "expected a condition behind it",
        help: |w| format!("write the other condition, or leave the `{}` out", w.text(0)),
    },
    Habit {
        is_met: |w| w.text(0) == "and",
        at: 0,
        code: "task::separator",
        message: |_| "`and` joins conditions, not steps".into(),
        label: "expected a step",
        help: |_| "write `then`, or nothing at all: steps run one after the other".into(),
    },
    Habit {
        is_met: |w| {
            matches!(w.text(0), "while" | "loop") || (w.text(0) == "for" && w.text(2) != "in")
        },
        at: 0,
        code: "task::loop",
        message: |w| format!("there is no `{}` loop: every loop has an end", w.text(0)),
        label: "not a step",
        help: |w| {
            if w.text(0) == "for" {
                "write `for o in Graspable { … }`, or `repeat upto 10 times { … }`".into()
            } else {
                "write `repeat upto 10 times { … } until …`; after a call, `while` says what must hold"
                    .into()
            }
        },
    },
    Habit {
        is_met: |w| w.text(0) == "repeat" && w.is(1, Kind::Number),
        at: 1,
        code: "task::loop",
        message: |_| "a repetition says how often at most".into(),
        label: "expected `upto`",
        help: |w| format!("write `repeat upto {} times {{ … }}`", w.text(1)),
    },
    Habit {
        is_met: |w| matches!(w.text(0), "retry" | "abort") && w.text(1) != "(",
        at: 0,
        code: "task::recovery",
        message: |w| format!("`{}` says how a recovery ends", w.text(0)),
        label: "not inside `on failure`",
        help: |w| format!("write `on failure {{ {} }}`", w.text(0)),
    },
    Habit {
        is_met: |w| w.text(0) == "as",
        at: 0,
        code: "task::label",
        message: |_| "only a call or a block in braces carries a name".into(),
        label: "nothing here to name",
        help: |w| format!("put braces around it: `{{ … }} as {}`", w.text(1)),
    },
    Habit {
        is_met: |w| w.text(0) == "via",
        at: 0,
        code: "task::via",
        message: |_| "`via` names a branch to take inside a call".into(),
        label: "no call before this",
        help: |w| format!("write it after the call: `pick(jar) via {}`", w.text(1)),
    },
    Habit {
        is_met: remarks,
        at: 0,
        code: "task::syntax",
        message: |_| "remarks begin with `//`".into(),
        label: "not a remark here",
        help: |w| {
            let rest = w.slice[w.code[usize::from(w.text(0) != "#")].to..].lines().next();
            let said = rest.unwrap_or_default().trim_end_matches("*/").trim();
            format!("write `{}`", format!("// {said}").trim_end())
        },
    },
    Habit {
        is_met: |w| w.text(0) == "#",
        at: 0,
        code: "task::attribute",
        message: |_| "an attribute stands before a task, an action or a branch".into(),
        label: "belongs to nothing",
        help: |_| "write `#[was(\"old_name\")]` on the line before what was renamed".into(),
    },
    Habit {
        is_met: |w| w.text(0) == "either" && w.text(1) == "{",
        at: 1,
        code: "task::branch",
        message: |_| "each branch of a choice has a name".into(),
        label: "expected a name",
        help: |_| "write `either left { … } or right { … }`".into(),
    },
    Habit {
        is_met: |w| w.text(0) == "on" && w.text(1) == "failure" && !matches!(w.text(2), "of" | "{"),
        at: 2,
        code: "task::recovery",
        message: |_| "a recovery says whose failure it answers with `of`".into(),
        label: "expected `of` or `{`",
        help: |w| format!("write `on failure of {} {{ … }}`", w.text(2)),
    },
    Habit {
        is_met: |w| w.text(0) == "on" && w.place == Place::Item && w.text(1) == "failure",
        at: 0,
        code: "task::recovery",
        message: |_| "a recovery belongs to a task".into(),
        label: "outside of any",
        help: |_| "put it between the braces of the task whose failure it answers".into(),
    },
    Habit {
        is_met: |w| w.place == Place::Clause && w.is(0, Kind::Word) && w.text(1) == "(",
        at: 0,
        code: "task::syntax",
        message: |_| "an action runs one script and has no steps".into(),
        label: "a step",
        help: |w| format!("make it a task, or call `{}` from the script", w.text(0)),
    },
    Habit {
        is_met: |w| w.text(1) == "[",
        at: 1,
        code: "task::syntax",
        message: |_| "`[` cannot stand here".into(),
        label: "expected `(`",
        help: |w| format!("arguments stand in parentheses: `{}(…)`", w.text(0)),
    },
    Habit {
        is_met: defines,
        at: 0,
        code: "task::keyword",
        message: |w| format!("`{}` is no word here; definitions begin with `task`", w.text(0)),
        label: "not a word of the language",
        help: |w| format!("write `task {}(o: Graspable) {{ … }}`", w.text(1)),
    },
    // `pour jar cup`: a command line's habit.
    Habit {
        is_met: |w| {
            w.code.len() > 1
                && w.code.iter().all(|t| is_name(t, t.text(w.slice)))
                && nearest(w.text(0), ITEMS.iter().chain(STEPS).copied()).is_none()
        },
        at: 1,
        code: "task::call",
        message: |w| format!("what `{}` acts on stands in parentheses", w.text(0)),
        label: "expected `(`",
        help: |w| {
            let args: Vec<&str> = w.code[1..].iter().map(|t| t.text(w.slice)).collect();
            format!("write `{}({})`", w.text(0), args.join(", "))
        },
    },
];

/// Habits of the lines of a model.
const MODEL_HABITS: &[Habit] = &[
    Habit {
        is_met: |w| matches!(w.text(0), ";" | ","),
        at: 0,
        code: "task::separator",
        message: |w| format!("the lines of a model need no `{}` between them", w.text(0)),
        label: "not needed",
        help: |w| format!("remove the `{}`", w.text(0)),
    },
    Habit {
        is_met: |w| w.text(0) == "d" && w.text(1) == "/",
        at: 0,
        code: "task::rate",
        message: |_| "the rate of a state is written with a dash".into(),
        label: "expected a rate such as `x'`",
        help: |_| "write `x' = …`".into(),
    },
    // `k4 u`: what stands beside a complete formula was meant as part of it.
    Habit {
        is_met: |w| {
            !w.begins_like_a_model()
                && (w.is(0, Kind::Word) || w.is(0, Kind::Number))
                && !matches!(w.text(1), "'" | "=" | ":")
        },
        at: 0,
        code: "task::operator",
        message: |w| format!("there is no operator before `{}`", w.text(0)),
        label: "expected `*`, `/`, `+` or `-`",
        help: |w| match (w.text(0), w.text(1)) {
            ("1", "/") => format!("`1/{}` is not a unit; units: {}", w.text(2), known_units()),
            _ => "a product is written with `*`".into(),
        },
    },
    Habit {
        is_met: |w| w.is(0, Kind::Word) && !w.begins_like_a_model() && w.text(1) == "=",
        at: 0,
        code: "task::rate",
        message: |w| format!("`{} = …` is neither a rate nor a definition", w.text(0)),
        label: "expected `x' =`, `let`, `param`, `state` or `output`",
        help: |w| {
            let name = w.text(0);
            format!("write `{name}' = …` for the rate of a state, or `let {name} = …` for a name")
        },
    },
];
