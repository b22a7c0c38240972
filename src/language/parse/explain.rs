//! Why a slice could not be read, in words.
//!
//! A slice that a `bad_…` rule swallowed is looked at in this order: a unit that does not exist, a
//! starter that is misspelt, a reserved word used as a name, and last what the grammar expected at the
//! furthest place it came to. Brackets are out of the question here: they were balanced before.

use pest::Parser;
use pest::error::{ErrorVariant, InputLocation};

use super::super::ast::Span;
use super::super::builtins::{self, Ty};
use super::super::diagnostic::Diagnostic;
use super::grammar::{Place, Rule, TaskParser};
use super::habit::habit;
use super::lexer::{Kind, Token, tokens};
use super::words::{
    AFTER_NUMBER, ALLEN, CLAUSES, ENTRIES, ITEMS, MODEL, QUOTES, RESERVED, SIGNS, STEPS,
    ToOriginal, VIEWS, nearest,
};
use crate::units::{Dimension, UNITS, Unit, convert, known_units, suggest_unit};

/// Returns what is wrong with a slice; `line` is what stands before it on its line.
pub(super) fn explain(
    place: Place,
    line: &str,
    slice: &str,
    original: &ToOriginal,
) -> Vec<Diagnostic> {
    let code = code(slice);
    let units = wrong_units(line, slice, original);
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
    if let Some(found) = habit(place, line, slice, &code, original) {
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

/// Numbers with a word beside them that is no unit; `line` is what stands before the slice on its line.
pub(super) fn wrong_units(line: &str, slice: &str, original: &ToOriginal) -> Vec<Diagnostic> {
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
        let digits = number.text(slice);
        let height = text.strip_prefix(['x', 'X']).filter(|n| n.parse::<u32>().is_ok());
        if let Some(height) = height {
            let whole = format!("{digits} x {height}");
            let found = found.help(format!("write `{whole}`"));
            out.push(found.fix(original(number.from, word.to), whole));
            continue;
        }
        let converted = digits.parse::<f64>().ok().and_then(|value| convert(value, text));
        if let Some((value, unit)) = converted {
            let whole = format!("{value} {unit}");
            let help = format!("write `{whole}`  (units: {})", known_units());
            out.push(found.help(help).fix(original(number.from, word.to), whole));
            continue;
        }
        let wanted = measured(&format!("{line}{}", &slice[..number.from]));
        out.push(match meant(text, wanted) {
            Some(unit) => found
                .help(format!("write `{digits} {unit}`  (units: {})", known_units()))
                .fix(span, unit),
            None => found.help(format!("units: {}", known_units())),
        });
    }
    out
}

/// Returns what a number is of that comes after a text, where it is compared with what a function of the language measures,
/// or added to it: a length after `height(jar) >`.
fn measured(before: &str) -> Option<Dimension> {
    let tokens = code(before);
    let (sign, of) = tokens.split_last()?;
    if !matches!(sign.text(before), ">" | ">=" | "<" | "<=" | "==" | "!=" | "+" | "-") {
        return None;
    }
    let mut depth = 0_usize;
    let open = of.iter().rposition(|token| {
        match token.text(before) {
            ")" => depth += 1,
            "(" => depth = depth.saturating_sub(1),
            _ => {}
        }
        depth == 0
    })?;
    if of[open].text(before) != "(" {
        return None;
    }
    let (name, of) = of[..open].split_last()?;
    let is_factor = of.last().is_some_and(|token| matches!(token.text(before), "*" | "/"));
    match Ty::named(builtins::function(name.text(before))?.result) {
        Ty::Quantity(dimension) if !is_factor => Some(dimension),
        _ => None,
    }
}

/// Returns the unit that a wrong spelling means, of the dimension that is wanted if it is known: `ml` of a length is `mm`.
fn meant(text: &str, wanted: Option<Dimension>) -> Option<&'static str> {
    let suggested = suggest_unit(text);
    let Some(wanted) = wanted else { return suggested };
    let fits = |unit: &&str| Unit::parse(unit).is_ok_and(|unit| unit.dimension == wanted);
    let units = UNITS.iter().map(|(unit, ..)| *unit);
    suggested.filter(fits).or_else(|| nearest(text, units.filter(fits)))
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
        .did_you_mean(nearest),
    )
}

/// Reads the slice again by the strict rule and words what was expected where it stopped.
fn expected(place: Place, slice: &str, code: &[Token], original: &ToOriginal) -> Diagnostic {
    let first = code.first().map_or("", |t| t.text(slice));
    // What reads well alone stands in the wrong place.
    let (at, rules) =
        stopped(place, slice).unwrap_or_else(|| (code.first().map_or(0, |t| t.from), Vec::new()));
    // The token at or after the place; blanks and notes before it do not count.
    let Some(token) = code.iter().find(|t| t.to > at).copied() else {
        return too_short(place, first, code, &rules, original);
    };
    // Of `&&` and `=>` the lexer has seen the first half: they are no signs of this language.
    let halves = ["&&", "||", "=>", "=<"];
    let is_half = halves.iter().any(|sign| slice[token.from..].starts_with(sign));
    let end = token.to + usize::from(is_half);
    let found = Unexpected {
        text: &slice[token.from..end],
        span: original(token.from, end),
        first,
        is_parameter: place == Place::Params || matches!(first, "task" | "action" | "fluent"),
        rules: &rules,
    };
    let before = code.iter().rev().find(|t| t.to <= token.from).map_or("o", |t| t.text(slice));
    found
        .reserved()
        .or_else(|| found.untyped(before))
        .or_else(|| found.unseparated(token.kind))
        .unwrap_or_else(|| found.misplaced())
}

/// Where the strict rule stops in the slice and what it would take there; `None` if it reads all of it.
fn stopped(place: Place, slice: &str) -> Option<(usize, Vec<Rule>)> {
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
    let error = TaskParser::parse(rule, slice).err()?;
    let at = match error.location {
        InputLocation::Pos(at) | InputLocation::Span((at, _)) => at,
    };
    let rules = match error.variant {
        ErrorVariant::ParsingError { positives, .. } => positives,
        ErrorVariant::CustomError { .. } => Vec::new(),
    };
    Some((at, rules))
}

/// A slice that ends before it says enough.
fn too_short(
    place: Place,
    first: &str,
    code: &[Token],
    rules: &[Rule],
    original: &ToOriginal,
) -> Diagnostic {
    let words = words(rules);
    let list = sentence(&words);
    let last = code.last().map_or(0, |t| t.to);
    let found = Diagnostic::error(
        "task::syntax",
        original(last.saturating_sub(1), last),
        "something is missing after this",
        if list.is_empty() { "it ends too early".to_string() } else { format!("expected {list}") },
    );
    if words == ["`or`"] {
        found.help("a choice has at least two branches: `or other { … }`")
    } else if code.len() == 1
        && matches!(place, Place::Step | Place::Item)
        && !RESERVED.contains(&first)
    {
        found.help(format!("write `{first}()`, with what it acts on between the parentheses"))
    } else {
        found
    }
}

/// A token at which the strict rule stopped.
struct Unexpected<'a> {
    text: &'a str,
    span: Span,
    /// The first word of the slice.
    first: &'a str,
    /// Whether what stands here is a parameter, not an argument.
    is_parameter: bool,
    /// What the rule would take instead.
    rules: &'a [Rule],
}

impl Unexpected<'_> {
    fn could_be(&self, rule: Rule) -> bool {
        self.rules.contains(&rule)
    }

    fn label(&self) -> String {
        match sentence(&words(self.rules)) {
            list if list.is_empty() => "not expected here".to_string(),
            list => format!("expected {list}"),
        }
    }

    /// A word of the language where a name is wanted.
    fn reserved(&self) -> Option<Diagnostic> {
        let text = self.text;
        (RESERVED.contains(&text) && self.could_be(Rule::id)).then(|| {
            Diagnostic::error(
                "task::reserved",
                self.span,
                format!("`{text}` is a word of the language and cannot be a name"),
                "expected a name",
            )
            .help(format!("choose another name, such as `{text}_`"))
        })
    }

    /// A parameter without its type; `name` is the token before.
    fn untyped(&self, name: &str) -> Option<Diagnostic> {
        (self.could_be(Rule::colon) && self.is_parameter).then(|| {
            Diagnostic::error(
                "task::syntax",
                self.span,
                "a parameter says of what type it is",
                self.label(),
            )
            .help(format!("write `{name}: Graspable`, or another type"))
        })
    }

    /// A value right after another.
    fn unseparated(&self, kind: Kind) -> Option<Diagnostic> {
        let is_operand = matches!(kind, Kind::Word | Kind::Number | Kind::Text);
        (self.could_be(Rule::comma) && is_operand).then(|| {
            let what = if self.is_parameter { "parameters" } else { "arguments" };
            Diagnostic::error(
                "task::comma",
                self.span,
                format!("missing `,` before `{}`", self.text),
                "expected `)`, `,`",
            )
            .help(format!("separate {what} with commas"))
            .insert(self.span.from, ", ")
        })
    }

    /// Anything else, with a hint where one is likely to fit.
    fn misplaced(&self) -> Diagnostic {
        let text = self.text;
        let message = format!("`{text}` cannot stand here");
        let found = Diagnostic::error("task::syntax", self.span, message, self.label());
        if self.could_be(Rule::allen)
            && let Some(near) = nearest(text, ALLEN.iter().copied())
        {
            return found.did_you_mean(near);
        }
        let meant = SIGNS.iter().find(|(sign, _)| *sign == text).map(|(_, meant)| *meant);
        if let Some(meant) = meant.or((text == ";" && self.could_be(Rule::comma)).then_some(",")) {
            let found = found.help(format!("write `{meant}`"));
            // A word wants blanks around it, and what stands there is not known here.
            let is_word = meant.starts_with(char::is_alphabetic);
            return if is_word { found } else { found.fix(self.span, meant) };
        }
        if text == "#" {
            return found.help("remarks begin with `//`");
        }
        if text.starts_with(QUOTES) {
            return found.help(if self.could_be(Rule::text) {
                "a text stands in straight quotation marks: `\"…\"`"
            } else {
                "write it without quotation marks"
            });
        }
        if text == "%" {
            return found.help("a probability is a number from 0 to 1, such as `0.7`");
        }
        let opens = matches!(self.first, "if" | "repeat" | "for" | "either" | "together");
        if self.could_be(Rule::lbr) && opens {
            return found.help("what is done stands in braces: `{ … }`");
        }
        found
    }
}

/// The expected rules in words, most telling first, each once.
fn words(rules: &[Rule]) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    // Where a block is wanted, that the condition before it could go on is no news.
    let wants_block = rules.iter().any(|rule| matches!(rule, Rule::lbr | Rule::block));
    let goes_on = |rule: &Rule| {
        let joins = matches!(rule, Rule::comparator | Rule::K_and | Rule::K_or | Rule::K_within);
        joins || matches!(rule, Rule::plus | Rule::minus | Rule::times | Rule::divided)
    };
    for rule in rules.iter().filter(|rule| !(wants_block && goes_on(rule))) {
        let word = match rule {
            Rule::EOI | Rule::doc | Rule::bad_args | Rule::bad_params | Rule::dot | Rule::was => {
                continue;
            }
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
            Rule::hash => "`#`".into(),
            Rule::lsq => "`[`".into(),
            Rule::rsq => "`]`".into(),
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
        for unit in ["1/s", "1/s^2", "1/m/s^2", "1/(N*m)", "rad/(N*m)"] {
            let text = format!("5 {unit}");
            assert_eq!(TaskParser::parse(Rule::quant, &text).unwrap().as_str(), text);
        }
        for number in ["51/s", "5e1/s", "5 1/x", "5 1"] {
            let read = TaskParser::parse(Rule::quant, number).unwrap();
            assert!(read.as_str().bytes().all(|byte| byte != b'/' && byte != b' '), "{read}");
        }
    }

    #[test]
    fn one_near_word_is_suggested_and_a_far_one_is_not() {
        assert_eq!(nearest("tsak", ITEMS.iter().copied()), Some("task"));
        assert_eq!(nearest("banana", ITEMS.iter().copied()), None);
        assert_eq!(nearest("jra", ["jar", "cup"].into_iter()), Some("jar"));
    }
}
