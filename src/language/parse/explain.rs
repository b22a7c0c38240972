//! Why a slice could not be read, in words.
//!
//! A slice that a `bad_…` rule swallowed is looked at in this order: a unit that does not exist, a
//! starter that is misspelt, a reserved word used as a name, and last what the grammar expected at the
//! furthest place it came to. Brackets are out of the question here: they were balanced before.

use pest::Parser;
use pest::error::{ErrorVariant, InputLocation};

use super::super::ast::Span;
use super::super::diagnostic::Diagnostic;
use super::lexer::{Kind, Token, tokens};
use super::{Place, Rule, TaskParser};
use crate::units::{UNITS, known_units, suggest_unit};

/// Leads from bytes of the slice to bytes of the original.
type ToOriginal<'a> = dyn Fn(usize, usize) -> Span + 'a;

/// What may start an item, and what may start a step or a clause.
const ITEMS: &[&str] = &["task", "action", "fluent", "type", "scene", "twin", "model", "import"];
const STEPS: &[&str] = &[
    "either", "if", "repeat", "together", "check", "let", "needs", "keeps", "gives", "say",
    "limit", "timing", "retry", "abort", "while", "until", "then", "else",
];
const CLAUSES: &[&str] = &["needs", "keeps", "gives", "run", "limit"];
const ENTRIES: &[&str] = &["marks", "camera", "robot"];
const MODEL: &[&str] = &["input", "param", "state", "let", "output"];
const VIEWS: &[&str] = &["image", "focal", "looking", "at"];

/// Words that may follow a number and are no units.
const AFTER_NUMBER: &[&str] = &[
    "times", "when", "x", "and", "or", "within", "while", "until", "as", "by", "then", "if", "on",
];

/// Words that cannot be names.
const RESERVED: &[&str] = &[
    "task", "action", "fluent", "type", "import", "needs", "keeps", "gives", "either", "or", "if",
    "else", "repeat", "together", "check", "let", "and", "not", "while", "until", "within", "true",
    "false",
];

/// Returns what is wrong with a slice.
pub(super) fn explain(place: Place, slice: &str, original: &ToOriginal) -> Vec<Diagnostic> {
    let code = code(slice);
    let units = wrong_units(slice, original);
    if !units.is_empty() {
        return units;
    }
    let Some(first) = code.first() else {
        return vec![Diagnostic::error(
            "task::syntax",
            original(0, slice.len()),
            "there is nothing here to read",
            "expected something here",
        )];
    };
    if let Some(found) = habit(place, slice, &code, original) {
        return vec![found];
    }
    if let Some(found) = misspelt(place, slice, &code, *first, original) {
        return vec![found];
    }
    vec![expected(place, slice, &code, original)]
}

/// The tokens that are no notes.
fn code(slice: &str) -> Vec<Token> {
    tokens(slice).into_iter().filter(|t| !matches!(t.kind, Kind::Note | Kind::Doc)).collect()
}

/// Numbers with a word beside them that is no unit.
pub(super) fn wrong_units(slice: &str, original: &ToOriginal) -> Vec<Diagnostic> {
    let mut out = Vec::new();
    let code = code(slice);
    for (i, pair) in code.windows(2).enumerate() {
        let [number, word] = pair else { continue };
        if number.kind != Kind::Number || word.kind != Kind::Word || word.first_on_line {
            continue;
        }
        let text = word.text(slice);
        let known = UNITS.iter().any(|(unit, ..)| *unit == text);
        let after = code.get(i + 2).map_or("", |t| t.text(slice));
        // `name(`, `name:` and keywords begin something new.
        if known
            || AFTER_NUMBER.contains(&text)
            || RESERVED.contains(&text)
            || matches!(after, "(" | ":")
        {
            continue;
        }
        let span = original(word.from, word.to);
        let found = Diagnostic::error(
            "task::unit",
            span,
            format!("`{text}` is not a unit"),
            "unknown unit",
        );
        out.push(match suggest_unit(text) {
            Some(unit) => found.help(format!(
                "write `{} {unit}`  (units: {})",
                number.text(slice),
                known_units()
            )),
            None => found.help(format!("units: {}", known_units())),
        });
    }
    out
}

/// What other languages have taught people to write.
fn habit(place: Place, slice: &str, code: &[Token], original: &ToOriginal) -> Option<Diagnostic> {
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
    match text(0) {
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

/// A first word that is one or two letters away from one that may stand there.
fn misspelt(
    place: Place,
    slice: &str,
    code: &[Token],
    first: Token,
    original: &ToOriginal,
) -> Option<Diagnostic> {
    let candidates: Vec<&str> = match place {
        Place::Item => ITEMS.iter().chain(STEPS).copied().collect(),
        Place::Step => STEPS.to_vec(),
        Place::Clause => CLAUSES.to_vec(),
        Place::Entry => ENTRIES.to_vec(),
        Place::View => VIEWS.to_vec(),
        Place::Effect => vec!["effect"],
        Place::Model => MODEL.to_vec(),
        _ => return None,
    };
    let word = first.text(slice);
    let called = code.get(1).is_some_and(|t| matches!(t.text(slice), "(" | ":"));
    if first.kind != Kind::Word || candidates.contains(&word) || called {
        return None;
    }
    let nearest = nearest(word, candidates.iter().copied())?;
    Some(
        Diagnostic::error(
            "task::keyword",
            original(first.from, first.to),
            format!("`{word}` cannot start anything here"),
            "not a word of the language",
        )
        .help(format!("did you mean `{nearest}`?")),
    )
}

/// Returns the candidate nearest to a word, if any is near enough to be meant.
pub fn nearest<'a>(word: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let lower = word.to_lowercase();
    let allowed = if lower.chars().count() <= 3 { 1 } else { 2 };
    candidates
        .map(|c| (strsim::damerau_levenshtein(&lower, &c.to_lowercase()), c))
        .filter(|(distance, c)| *distance <= allowed && *distance < c.chars().count())
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// Reads the slice again by the strict rule and words what was expected where it stopped.
fn expected(place: Place, slice: &str, code: &[Token], original: &ToOriginal) -> Diagnostic {
    let first = code.first().map_or("", |t| t.text(slice));
    let rule = match place {
        Place::Item => Rule::only_item,
        Place::Step => Rule::only_step,
        Place::Clause => Rule::only_clause,
        Place::Entry => Rule::only_entry,
        Place::Property => Rule::only_property,
        Place::View => Rule::only_view,
        Place::Point => Rule::only_point,
        Place::Effect => Rule::only_effect,
        Place::Model => Rule::only_model_entry,
        Place::Parameter => Rule::only_parameter,
        Place::Params => Rule::only_params,
        Place::Args => Rule::only_args,
        Place::Extents => Rule::only_extents,
    };
    let (at, rules) = match TaskParser::parse(rule, slice) {
        Err(error) => {
            let at = match error.location {
                InputLocation::Pos(at) | InputLocation::Span((at, _)) => at,
            };
            let rules = match error.variant {
                ErrorVariant::ParsingError { positives, .. } => positives,
                ErrorVariant::CustomError { .. } => Vec::new(),
            };
            (at, rules)
        }
        // What reads well alone stands in the wrong place.
        Ok(_) => (code.first().map_or(0, |t| t.from), Vec::new()),
    };
    // The token at or after the place; blanks and notes before it do not count.
    let token = code.iter().find(|t| t.to > at).copied();
    let words = words(&rules);
    let list = sentence(&words);
    let Some(token) = token else {
        let last = code.last().map_or(0, |t| t.to);
        let found = Diagnostic::error(
            "task::syntax",
            original(last.saturating_sub(1), last),
            "something is missing after this",
            if list.is_empty() {
                "it ends too early".to_string()
            } else {
                format!("expected {list}")
            },
        );
        return if words == ["`or`"] {
            found.help("a choice has at least two branches: `or other { … }`")
        } else if code.len() == 1 && matches!(place, Place::Step | Place::Item) {
            found.help(format!("to run `{first}`, write `{first}(…)` with what it acts on"))
        } else {
            found
        };
    };
    let text = token.text(slice);
    let span = original(token.from, token.to);
    let label =
        if list.is_empty() { "not expected here".to_string() } else { format!("expected {list}") };
    let has = |rule: Rule| rules.contains(&rule);
    if RESERVED.contains(&text) && has(Rule::id) {
        return Diagnostic::error(
            "task::reserved",
            span,
            format!("`{text}` is a word of the language and cannot be a name"),
            "expected a name",
        )
        .help(format!("choose another name, such as `{text}_`"));
    }
    let operand = matches!(token.kind, Kind::Word | Kind::Number | Kind::Text);
    if has(Rule::comma) && operand {
        let what = if place == Place::Params || matches!(first, "task" | "action" | "fluent") {
            "parameters"
        } else {
            "arguments"
        };
        return Diagnostic::error(
            "task::comma",
            span,
            format!("missing `,` before `{text}`"),
            "expected `)`, `,`",
        )
        .help(format!("separate {what} with commas"));
    }
    Diagnostic::error("task::syntax", span, format!("`{text}` cannot stand here"), label)
}

/// The expected rules in words, most telling first, each once.
fn words(rules: &[Rule]) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for rule in rules {
        let word = match rule {
            Rule::EOI | Rule::doc | Rule::bad_args | Rule::bad_params | Rule::dot => continue,
            Rule::lpar => "`(`".into(),
            Rule::rpar => "`)`".into(),
            Rule::lbr | Rule::block => "`{`".into(),
            Rule::rbr => "`}`".into(),
            Rule::comma => "`,`".into(),
            Rule::colon => "`:`".into(),
            Rule::assign => "`=`".into(),
            Rule::pipe => "`|`".into(),
            Rule::guess => "`~`".into(),
            Rule::plus_minus => "`+-`".into(),
            Rule::id => "a name".into(),
            Rule::text => "a text in quotes".into(),
            Rule::num => "a number".into(),
            Rule::quant | Rule::signed => "a quantity such as `12 cm`".into(),
            Rule::unit | Rule::unit_text => "a unit".into(),
            Rule::params => "`(` and parameters".into(),
            Rule::point => "a point such as `(0 m, 0 m)`".into(),
            Rule::call => "a call such as `grasp(jar)`".into(),
            Rule::allen => {
                "`before`, `meets`, `overlaps`, `starts`, `during`, `finishes` or `equals`".into()
            }
            Rule::comparator => "a comparison".into(),
            Rule::plus | Rule::minus | Rule::times | Rule::divided => "an operator".into(),
            Rule::expr
            | Rule::conjunction
            | Rule::negation
            | Rule::comparison
            | Rule::sum
            | Rule::product
            | Rule::factor
            | Rule::path
            | Rule::K_not
            | Rule::K_true
            | Rule::K_false => "a value or a condition".into(),
            Rule::step | Rule::act | Rule::one => "a step".into(),
            Rule::rate => "a rate such as `x'`".into(),
            Rule::formula
            | Rule::formula_product
            | Rule::formula_factor
            | Rule::formula_power
            | Rule::formula_call => "a formula".into(),
            Rule::shape => "a shape such as `cuboid(6 cm, 6 cm, 14 cm)`".into(),
            rule => {
                let name = format!("{rule:?}");
                match name.strip_prefix("K_") {
                    Some(keyword) => format!("`{keyword}`"),
                    None => continue,
                }
            }
        };
        if !out.contains(&word) {
            out.push(word);
        }
    }
    // A value may go on in a dozen ways; a list of a dozen helps nobody.
    out.truncate(4);
    out
}

/// `a`, `a or b`, `a, b or c`.
fn sentence(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Unit;

    #[test]
    fn the_grammar_spells_exactly_the_units_of_the_table() {
        for (unit, ..) in UNITS {
            let text = format!("5 {unit}");
            let read = TaskParser::parse(Rule::quant, &text).unwrap();
            assert_eq!(read.as_str(), text, "the grammar lacks `{unit}`");
        }
        let grammar = include_str!("../../../grammar/task.pest");
        let rule = grammar.split("unit_name = _{").nth(1).unwrap().split('}').next().unwrap();
        for name in rule.split('|').map(|part| part.trim().trim_matches('"')) {
            assert!(Unit::parse(name).is_ok(), "the table lacks `{name}`");
        }
    }

    #[test]
    fn one_near_word_is_suggested_and_a_far_one_is_not() {
        assert_eq!(nearest("tsak", ITEMS.iter().copied()), Some("task"));
        assert_eq!(nearest("banana", ITEMS.iter().copied()), None);
        assert_eq!(nearest("jra", ["jar", "cup"].into_iter()), Some("jar"));
    }
}
