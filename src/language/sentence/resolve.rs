//! A slot's words → the thing, face or quantity they name.

use super::super::builtins::{self, Ty};
use super::super::library::Library;
use super::super::text;
use super::knowledge::{Knowledge, Thing, either};
use super::share::{LEVEL, WHOLE, level, share};
use crate::units::{Dimension, Quantity, Unit, convert, suggest_unit, units_of};

/// Words that may stand before the name of a thing and say nothing about which.
const ARTICLES: &[&str] = &["the", "a", "an", "this", "that", "my", "your", "our", "some"];

/// Words that every thing answers to.
const ANYTHING: &[&str] = &["one", "thing", "object", "item"];

/// What is poured from and into.
pub(super) const VESSEL: &str = "Container";

/// What is in vessels.
const CONTENTS: &[&str] = &["water", "juice", "contents"];

/// Words for what was named before.
const PRONOUNS: &[&str] = &["it", "that", "this", "that one", "this one"];

/// One thing that words may mean.
pub(super) struct Found {
    /// As the language writes it; of a part of something, with [`super::share::WHOLE`] for all of it.
    pub(super) value: String,
    /// As a person would.
    pub(super) shown: String,
}

/// Why words mean nothing here, and what would help.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{why}")]
pub(super) struct Hindrance {
    pub(super) why: String,
    pub(super) help: Option<String>,
    /// So many slots were understood before: the sentence that comes furthest is the one that was meant.
    pub(super) after: usize,
}

impl Hindrance {
    pub(super) fn new(why: impl Into<String>, help: Option<String>) -> Self {
        Self { why: why.into(), help, after: 0 }
    }
}

/// Returns what words may mean where a value of type `ty` is wanted.
pub(super) fn resolve(
    said: &str,
    ty: &Ty,
    slot: &str,
    with: &Knowledge<'_>,
) -> Result<Vec<Found>, Hindrance> {
    if PRONOUNS.contains(&said) && !matches!(ty, Ty::Quantity(_) | Ty::Face) {
        let kind = match ty {
            Ty::Object(kind) if !kind.is_empty() => Some(kind.as_str()),
            _ => None,
        };
        return it(said, kind, with);
    }
    if *ty == Ty::Place
        && let Some(found) = super::relation::resolve(said, slot, with)
    {
        return found;
    }
    match ty {
        Ty::Quantity(dimension) => quantity(said, *dimension, slot),
        Ty::Face => {
            let word = bare(said);
            match word.as_str() {
                "side" | "top" => Ok(vec![Found { value: word.clone(), shown: word }]),
                _ => {
                    let help = Some("say `side` or `top`".into());
                    Err(Hindrance::new(format!("`{said}` is no face"), help))
                }
            }
        }
        Ty::Object(kind) if !kind.is_empty() => objects(said, Some(kind), slot, with),
        _ => objects(said, None, slot, with),
    }
}

/// Returns what was named before; where nothing was, says what could be named.
fn it(said: &str, kind: Option<&str>, with: &Knowledge<'_>) -> Result<Vec<Found>, Hindrance> {
    let thing = with.it.and_then(|name| with.things.iter().find(|thing| thing.name == name));
    thing
        .map(|thing| vec![Found { value: thing.name.clone(), shown: thing.shown().to_owned() }])
        .ok_or_else(|| {
            let help = list(kind.unwrap_or(builtins::OBJECT), with.library, with.things);
            let help = help.or_else(|| Some("name the thing".into()));
            Hindrance::new(format!("nothing was named before \"{said}\""), help)
        })
}

/// Returns everything that may be meant where nothing was said.
pub(super) fn unsaid(ty: &Ty, with: &Knowledge<'_>) -> Vec<Found> {
    let Ty::Object(kind) = ty else { return Vec::new() };
    let fitting = with.things.iter().filter(|thing| with.library.is_a(&thing.kind, kind));
    fitting
        .map(|thing| Found { value: thing.name.clone(), shown: thing.shown().to_owned() })
        .collect()
}

/// Takes articles away.
fn bare(said: &str) -> String {
    let words = said.split(' ').filter(|word| !ARTICLES.contains(word));
    words.collect::<Vec<_>>().join(" ")
}

/// Returns the things that words may mean: by name or by looks, else by where they stand and how they are.
pub(super) fn objects(
    said: &str,
    kind: Option<&str>,
    slot: &str,
    with: &Knowledge<'_>,
) -> Result<Vec<Found>, Hindrance> {
    let phrase = bare(said);
    if PRONOUNS.contains(&phrase.as_str()) {
        return it(&phrase, kind, with);
    }
    let by_name = named(&phrase, kind, slot, with);
    if by_name.is_ok() {
        return by_name;
    }
    if let Some(word) = broken_off(said, &phrase) {
        let kind = kind.unwrap_or(builtins::OBJECT);
        let why = format!("the name of a thing is missing after \"{word}\"");
        return Err(Hindrance::new(why, list(kind, with.library, with.things)));
    }
    super::describe::described(&phrase, kind, slot, with).unwrap_or(by_name)
}

fn named(
    phrase: &str,
    kind: Option<&str>,
    slot: &str,
    with: &Knowledge<'_>,
) -> Result<Vec<Found>, Hindrance> {
    let (library, things) = (with.library, with.things);
    let wanted: Vec<&str> = phrase.split(' ').filter(|word| !word.is_empty()).collect();
    let named = |thing: &&Thing| {
        let words = thing.words();
        let fits = |word: &&str| ANYTHING.contains(word) || words.iter().any(|known| known == word);
        !wanted.is_empty() && wanted.iter().all(fits)
    };
    // A name or a description that fits exactly leaves no doubt.
    let exact = |thing: &&Thing| {
        thing.name.to_lowercase() == phrase || thing.looks.to_lowercase() == phrase
    };
    let described: Vec<&Thing> = things.iter().filter(named).collect();
    let exactly: Vec<&Thing> = described.iter().copied().filter(exact).collect();
    // "the cup" is the thing called `cup` only while no other thing is a cup.
    let one_word = wanted.len() == 1;
    let found = if exactly.len() == 1 && !one_word { exactly } else { described };
    let fits = |thing: &&&Thing| kind.is_none_or(|kind| library.is_a(&thing.kind, kind));
    let fitting: Vec<&Thing> = found.iter().filter(fits).copied().collect();
    if !fitting.is_empty() {
        let each = fitting
            .into_iter()
            .map(|thing| Found { value: thing.name.clone(), shown: thing.shown().to_owned() });
        return Ok(each.collect());
    }
    if let Some(thing) = found.first() {
        let kind = kind.unwrap_or(builtins::OBJECT);
        let why = format!("`{slot}` is {}, and the {phrase} is {}", of(kind), of(&thing.kind));
        return Err(Hindrance::new(why, list(kind, library, things)));
    }
    Err(missing(phrase, kind.unwrap_or(builtins::OBJECT), library, things))
}

/// `a Container`.
fn of(kind: &str) -> String {
    Ty::Object(kind.to_owned()).words()
}

/// Words that begin what is said of a thing, and name none.
const BEHIND: &[&str] = &[
    "to", "up", "with", "in", "into", "on", "onto", "at", "until", "by", "for", "from", "of", "off",
];

/// The same that may also end what is said: "pick the jar up".
const ENDINGS: &[&str] = &["up", "off", "in", "on", "by"];

/// Words behind the name of a thing that say how, how often or which way, and that no sentence takes; so do those in "-ly".
const HOW: &[&str] = &[
    "again", "aside", "away", "back", "bit", "but", "fast", "once", "please", "twice", "until",
    "upside", "when", "where", "while",
];

/// Those of them that say where to.
const WHERE_TO: &[&str] = &["aside", "away", "back", "where"];

/// Returns whether a word is one of a thing that is here.
pub(super) fn is_of_a_thing(word: &str, with: &Knowledge<'_>) -> bool {
    let is_own = |thing: &Thing| thing.words().iter().any(|known| known == word);
    ANYTHING.contains(&word) || with.things.iter().any(is_own)
}

/// Returns the word after which the name of a thing is missing: `to` of `cube next to`, where the sentence ends too early.
fn broken_off<'s>(said: &'s str, phrase: &str) -> Option<&'s str> {
    let last = said.rsplit(' ').next().unwrap_or(said);
    let is_open = BEHIND.contains(&last) && (phrase == last || !ENDINGS.contains(&last));
    (phrase.is_empty() || is_open).then_some(last)
}

/// Returns words that follow the name of a thing and were not understood: `to brink` of `cup to brink`.
fn not_understood<'p>(phrase: &'p str, things: &[Thing]) -> Option<(&'p str, &'p str)> {
    let places = phrase.match_indices(' ').map(|(at, _)| (&phrase[..at], &phrase[at + 1..]));
    places.into_iter().find(|(noun, rest)| {
        let first = rest.split(' ').next().unwrap_or_default();
        let is_named = |thing: &Thing| {
            let words = thing.words();
            noun.split(' ').all(|word| words.iter().any(|known| known == word))
        };
        let is_open = BEHIND.contains(&first) || HOW.contains(&first) || first.ends_with("ly");
        is_open && (*noun == "it" || things.iter().any(is_named))
    })
}

/// Names what there is when what was asked for is not there.
fn missing(phrase: &str, kind: &str, library: &Library, things: &[Thing]) -> Hindrance {
    // "Everything" may be all things as well as all of the water; of vessels it is the water.
    let is_part = share(phrase).is_some_and(|part| part != WHOLE || kind == VESSEL);
    if is_part || phrase.starts_with(|c: char| c.is_ascii_digit()) {
        let amount = if is_part { phrase } else { "60 mL" };
        let help = Some(format!("say into what, such as \"pour {amount} into the cup\""));
        return Hindrance::new(format!("\"{phrase}\" is an amount, and a thing is meant"), help);
    }
    if CONTENTS.contains(&phrase) {
        let help = Some("say how much, and into what, such as \"pour 60 mL into the cup\"".into());
        return Hindrance::new(format!("\"{phrase}\" does not say how much, or of what"), help);
    }
    if let Some(unit) = unknown_unit(phrase, things) {
        return no_unit(unit, Dimension::LENGTH);
    }
    if let Some((noun, rest)) = not_understood(phrase, things) {
        let why = format!("\"{rest}\" is not understood behind \"{noun}\"");
        let first = rest.split(' ').next().unwrap_or_default();
        let help = if WHERE_TO.contains(&first) {
            let thing = if noun == "it" { noun.to_owned() } else { format!("the {noun}") };
            format!("say where it is to go, such as \"put {thing} on the table\"")
        } else {
            "leave it out, or write the call itself".to_owned()
        };
        return Hindrance::new(why, Some(help));
    }
    if let Some((first, rest)) = phrase.split_once(' ')
        && BEHIND.contains(&first)
    {
        let why = format!("\"{first}\" is not understood before \"{rest}\"");
        return Hindrance::new(why, Some("leave it out, or write the call itself".into()));
    }
    let noun = phrase.rsplit(' ').next().unwrap_or(phrase);
    let alike: Vec<&str> = things
        .iter()
        .filter(|thing| thing.words().iter().any(|word| word == noun))
        .map(Thing::shown)
        .collect();
    let help = if alike.is_empty() {
        list(kind, library, things)
    } else {
        Some(format!("there is: {}", either(&alike)))
    };
    Hindrance::new(format!("there is no {phrase} here"), help)
}

fn list(kind: &str, library: &Library, things: &[Thing]) -> Option<String> {
    let fitting: Vec<&str> =
        things.iter().filter(|t| library.is_a(&t.kind, kind)).map(Thing::shown).collect();
    match fitting.as_slice() {
        [] if kind == builtins::OBJECT => None,
        [] => Some(format!("nothing here is {}; `?{kind}` says what one is", of(kind))),
        fitting => Some(format!("what fits here: {}", fitting.join(", "))),
    }
}

/// `60 ml`, `60 millilitres`, `12 cm`.
fn quantity(said: &str, dimension: Dimension, slot: &str) -> Result<Vec<Found>, Hindrance> {
    if let Some(share) = share(said) {
        return Ok(vec![Found { value: share, shown: said.to_owned() }]);
    }
    if let Some(amount) = level(said) {
        let mut found = quantity(amount, dimension, slot)?;
        for one in &mut found {
            one.value.insert_str(0, LEVEL);
        }
        return Ok(found);
    }
    let example = format!("say a number with its unit, such as `60 {}`", dimension.everyday_unit());
    let nothing = |why: String| Err(Hindrance::new(why, Some(example.clone())));
    let compact = said.replace(' ', "");
    let digits = compact.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(compact.len());
    let (number, spelt) = compact.split_at(digits);
    let Ok(value) = number.parse::<f64>() else {
        return nothing(format!("`{said}` is no number for `{slot}`"));
    };
    // Sentences are read in lower case, units are not written so.
    let known = ["mL", "L", "N", "V", "A"].into_iter().find(|u| u.to_lowercase() == spelt);
    let unit = known.or_else(|| Unit::parse(spelt).is_ok().then_some(spelt));
    let heard = text::quantity(Quantity::number(value));
    let meant = unit.or_else(|| suggest_unit(spelt)).map(|unit| (heard, unit));
    let is_foreign = meant.is_none();
    let Some((number, unit)) = meant.or_else(|| convert(value, spelt)) else {
        return Err(no_unit(spelt, dimension));
    };
    match Unit::parse(unit) {
        Ok(parsed) if parsed.dimension == dimension => {
            let text = format!("{number} {unit}");
            Ok(vec![Found { value: text.clone(), shown: text }])
        }
        // An ounce may be one of a volume, and is none that is known.
        _ if is_foreign => Err(no_unit(spelt, dimension)),
        _ => nothing(format!("`{slot}` is {}, and `{said}` is not", dimension.words())),
    }
}

/// Says that a unit is not known, and which there are.
fn no_unit(spelt: &str, dimension: Dimension) -> Hindrance {
    let why = format!("`{spelt}` is not a known unit of {}", dimension.words());
    let units = either(&units_of(dimension));
    let help = format!("say it in {units}, such as `60 {}`", dimension.everyday_unit());
    Hindrance::new(why, Some(help))
}

/// Returns the unit behind a number behind the name of a thing, where no unit is spelt so: `spans` of `jar 2 spans`.
fn unknown_unit<'p>(phrase: &'p str, things: &[Thing]) -> Option<&'p str> {
    let (head, unit) = phrase.rsplit_once(' ')?;
    let (noun, number) = head.rsplit_once(' ')?;
    let is_known = Unit::parse(unit).is_ok() || suggest_unit(unit).is_some();
    let is_other = is_known || BEHIND.contains(&unit) || HOW.contains(&unit);
    let is_word = unit.chars().all(char::is_alphabetic) && !is_other;
    let is_named = |thing: &Thing| {
        let words = thing.words();
        noun.split(' ').all(|word| words.iter().any(|known| known == word))
    };
    (is_word && number.parse::<f64>().is_ok() && things.iter().any(is_named)).then_some(unit)
}
