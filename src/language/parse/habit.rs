//! What other languages and other tools have taught people to write, answered with what to write here.

use super::super::diagnostic::Diagnostic;
use super::Place;
use super::explain::{ITEMS, MODEL, RESERVED, STEPS, ToOriginal, nearest};
use super::lexer::{Kind, Token, tokens};

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
    let text = |i: usize| code.get(i).map_or("", |t| t.text(slice));
    let first = code.first()?;
    let tell = |at: &Token, code: &'static str, message: String, label: &str, help: String| {
        Some(Diagnostic::error(code, original(at.from, at.to), message, label).help(help))
    };
    if place == Place::Args {
        let at = code.iter().position(|t| t.text(slice) == "=")?;
        let name = text(at.checked_sub(1)?);
        let end = code[at..].iter().find(|t| matches!(t.text(slice), "," | ")"));
        let value = slice[code[at].to..end.map_or(slice.len(), |t| t.from)].trim();
        return tell(
            &code[at],
            "task::equals",
            "an argument is given with `:`, not with `=`".into(),
            "expected `:`",
            format!("write `{name}: {value}`"),
        );
    }
    if place == Place::Model {
        return model_habit(slice, code, original);
    }
    if !matches!(place, Place::Step | Place::Item | Place::Clause) {
        return None;
    }
    let asks = tokens(line).first().map(|t| t.text(line)).filter(|word| CONDITIONS.contains(word));
    match text(0) {
        "," if asks.is_some() => tell(
            first,
            "task::separator",
            "conditions are joined with `and`".into(),
            "not a `,`",
            "write `and` instead of the `,`".into(),
        ),
        // `gives holding o`
        name if asks.is_some() && code.len() == 1 && first.kind == Kind::Word => {
            let asked =
                tokens(line).last().map(|t| t.text(line)).filter(|_| line.ends_with(' '))?;
            tell(
                first,
                "task::call",
                format!("what `{asked}` is about stands in parentheses"),
                "expected `(`",
                format!("write `{asked}({name})`"),
            )
        }
        word @ ("elif" | "elsif" | "elseif") => tell(
            first,
            "task::keyword",
            format!("`{word}` is two words here"),
            "not a word of the language",
            "write `else if`".into(),
        ),
        "ask" if code.get(1).is_some_and(|t| t.kind != Kind::Text) => tell(
            &code[1],
            "task::syntax",
            "a question stands in quotes".into(),
            "expected a text in quotes",
            format!("write `ask \"{}\"`", slice[code[1].from..].trim_end()),
        ),
        "if" if line.trim_end().ends_with("break") => tell(
            first,
            "task::syntax",
            "a breakpoint says when with `when`".into(),
            "expected `when`",
            format!("write `break when {}`", slice[first.to..].trim()),
        ),
        "repeat" if text(1) == "until" => tell(
            &code[1],
            "task::loop",
            "a repetition says how often at most".into(),
            "expected `upto`",
            "write `repeat upto 10 times { … } until …`".into(),
        ),
        "upto" if code.get(1).is_some_and(|t| t.kind == Kind::Number) => tell(
            &code[1],
            "task::count",
            "how often is said with `times`".into(),
            "expected `times` behind it",
            format!("write `upto {} times`", text(1)),
        ),
        "." if text(1) == "then" => tell(
            first,
            "task::separator",
            "steps are not joined with a dot".into(),
            "not needed",
            "write `a() then b()`".into(),
        ),
        // `wait 2 s`
        name if first.kind == Kind::Word
            && !RESERVED.contains(&name)
            && !STEPS.contains(&name)
            && code.get(1).is_some_and(|t| t.kind == Kind::Number && !t.first_on_line)
            && code.len() <= 3 =>
        {
            let given = slice[code[1].from..code[code.len() - 1].to].trim();
            tell(
                &code[1],
                "task::call",
                format!("what `{name}` acts on stands in parentheses"),
                "expected `(`",
                format!("write `{name}({given})`"),
            )
        }
        "=" => tell(
            first,
            "task::equals",
            "`=` gives a value; it does not compare".into(),
            "expected a comparison",
            "write `==` with `within` and a tolerance, or `>=`, `<=`".into(),
        ),
        sign @ (";" | ",") => tell(
            first,
            "task::separator",
            format!("steps need no `{sign}` between them"),
            "not needed",
            format!("remove the `{sign}`"),
        ),
        "and" => tell(
            first,
            "task::separator",
            "`and` joins conditions, not steps".into(),
            "expected a step",
            "write `then`, or nothing at all: steps run one after the other".into(),
        ),
        word @ ("while" | "for" | "loop") => tell(
            first,
            "task::loop",
            format!("there is no `{word}` loop: every loop has an end"),
            "not a step",
            "write `repeat upto 10 times { … } until …`; after a call, `while` says what must hold"
                .into(),
        ),
        "repeat" if code.get(1).is_some_and(|t| t.kind == Kind::Number) => tell(
            &code[1],
            "task::loop",
            "a repetition says how often at most".into(),
            "expected `upto`",
            format!("write `repeat upto {} times {{ … }}`", text(1)),
        ),
        "retry" | "abort" if text(1) != "(" => tell(
            first,
            "task::recovery",
            format!("`{}` says how a recovery ends", text(0)),
            "not inside `on failure`",
            format!("write `on failure {{ {} }}`", text(0)),
        ),
        "as" => tell(
            first,
            "task::label",
            "only a call or a block in braces carries a name".into(),
            "nothing here to name",
            format!("put braces around it: `{{ … }} as {}`", text(1)),
        ),
        "via" => tell(
            first,
            "task::via",
            "`via` names a branch to take inside a call".into(),
            "no call before this",
            format!("write it after the call: `pick(jar) via {}`", text(1)),
        ),
        "#" => tell(
            first,
            "task::attribute",
            "an attribute stands before a task, an action or a branch".into(),
            "belongs to nothing",
            "write `#[was(\"old_name\")]` on the line before what was renamed".into(),
        ),
        "either" if text(1) == "{" => tell(
            &code[1],
            "task::branch",
            "each branch of a choice has a name".into(),
            "expected a name",
            "write `either left { … } or right { … }`".into(),
        ),
        "on" if text(1) == "failure" && !matches!(text(2), "of" | "{") => tell(
            &code[1.max(code.len().min(3) - 1)],
            "task::recovery",
            "a recovery says whose failure it answers with `of`".into(),
            "expected `of` or `{`",
            format!("write `on failure of {} {{ … }}`", text(2)),
        ),
        "say" if place == Place::Clause => tell(
            first,
            "task::syntax",
            "only tasks have sentences".into(),
            "not in an action",
            "put it into the task that calls this action".into(),
        ),
        "on" if place == Place::Item && text(1) == "failure" => tell(
            first,
            "task::recovery",
            "a recovery belongs to a task".into(),
            "outside of any",
            "put it between the braces of the task whose failure it answers".into(),
        ),
        name if place == Place::Clause && first.kind == Kind::Word && text(1) == "(" => tell(
            first,
            "task::syntax",
            "an action runs one script and has no steps".into(),
            "a step",
            format!("make it a task, or call `{name}` from the script"),
        ),
        name if text(1) == "[" => tell(
            &code[1],
            "task::syntax",
            "`[` cannot stand here".into(),
            "expected `(`",
            format!("arguments stand in parentheses: `{name}(…)`"),
        ),
        // `pour jar cup`: a command line's habit.
        name if code.len() > 1
            && code.iter().all(|t| t.kind == Kind::Word && !RESERVED.contains(&t.text(slice)))
            && nearest(name, ITEMS.iter().chain(STEPS).copied()).is_none() =>
        {
            let args: Vec<&str> = code[1..].iter().map(|t| t.text(slice)).collect();
            tell(
                &code[1],
                "task::call",
                format!("what `{name}` acts on stands in parentheses"),
                "expected `(`",
                format!("write `{name}({})`", args.join(", ")),
            )
        }
        _ => None,
    }
}

/// The same for the lines of a model.
fn model_habit(slice: &str, code: &[Token], original: &ToOriginal) -> Option<Diagnostic> {
    let text = |i: usize| code.get(i).map_or("", |t| t.text(slice));
    let first = code.first()?;
    let span = original(first.from, first.to);
    let known = MODEL.contains(&text(0)) || nearest(text(0), MODEL.iter().copied()).is_some();
    match text(0) {
        sign @ (";" | ",") => Some(
            Diagnostic::error(
                "task::separator",
                span,
                format!("the lines of a model need no `{sign}` between them"),
                "not needed",
            )
            .help(format!("remove the `{sign}`")),
        ),
        "d" if text(1) == "/" => Some(
            Diagnostic::error(
                "task::rate",
                span,
                "the rate of a state is written with a dash",
                "expected a rate such as `x'`",
            )
            .help("write `x' = …`"),
        ),
        // `k4 u`: what stands beside a complete formula was meant as part of it.
        name if !known
            && matches!(first.kind, Kind::Word | Kind::Number)
            && !matches!(text(1), "'" | "=" | ":") =>
        {
            Some(
                Diagnostic::error(
                    "task::operator",
                    span,
                    format!("there is no operator before `{name}`"),
                    "expected `*`, `/`, `+` or `-`",
                )
                .help("a product is written with `*`"),
            )
        }
        name if first.kind == Kind::Word && !known && text(1) == "=" => Some(
            Diagnostic::error(
                "task::rate",
                span,
                format!("`{name} = …` is neither a rate nor a definition"),
                "expected `x' =`, `let`, `param`, `state` or `output`",
            )
            .help(format!(
                "write `{name}' = …` for the rate of a state, or `let {name} = …` for a name"
            )),
        ),
        _ => None,
    }
}
