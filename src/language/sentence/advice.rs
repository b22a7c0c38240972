//! What helps somebody whose sentence is not known and is like none: words that a prompt has other means for, and sentences in
//! another language than English.

use super::knowledge::{Knowledge, Thing};
use super::resolve::VESSEL;
use super::share::share;

/// Words that wish the last thing done once more, of an operator in whatever language.
const AGAIN: &[&str] = &[
    "again",
    "once again",
    "once more",
    "one more time",
    "repeat",
    "repeat it",
    "repeat that",
    "do it again",
    "do that again",
    "do it once more",
    "try again",
    "try it again",
    "same again",
    "the same again",
    "nochmal",
    "noch mal",
    "noch einmal",
    "encore",
    "encore une fois",
    "otra vez",
    "ancora",
    "ancora una volta",
];

/// Words that mean to take back or end what was done, alone or before what they are said of, and what does so; `{o}` is a thing
/// that can be carried.
const INSTEAD: &[(&[&str], &str)] = &[
    (
        &["undo", "revert"],
        "what the arm did cannot be undone: say where things are to go, such as \"put the {o} on the table\"; \
         `:undo-edit` takes back a change to a file",
    ),
    (&["stop", "halt"], "Ctrl-C stops the arm while it moves"),
];

/// Words for carrying a thing, which say nothing without a place.
const CARRYING: &[&str] = &["move", "bring", "shift", "carry"];

/// Words of other languages that begin or join wishes, and that are no words of English: German, French, Spanish and Italian.
const FOREIGN: &[&str] = &[
    "bitte",
    "danke",
    "das",
    "den",
    "dem",
    "gib",
    "gieß",
    "gieße",
    "könntest",
    "mir",
    "nimm",
    "stell",
    "stelle",
    "und",
    "le",
    "la",
    "les",
    "merci",
    "prends",
    "une",
    "verse",
    "donne",
    "el",
    "los",
    "gracias",
    "por",
    "coge",
    "toma",
    "una",
    "vierte",
    "grazie",
    "il",
    "lo",
    "prendi",
    "versa",
];

/// Whether words are of another language than English, as far as the commonest words tell.
pub fn is_foreign(said: &str) -> bool {
    said.split(' ').any(|word| FOREIGN.contains(&word.to_lowercase().as_str()))
}

/// Whether words, as [`super::words`] makes them, wish the last thing done once more and say nothing else.
pub fn is_again(said: &str) -> bool {
    AGAIN.contains(&said)
}

/// Returns what to do instead of what is said, where it is no sentence that could be like one that is known; `said` as
/// [`super::words`] makes it.
pub fn instead(said: &str, with: &Knowledge<'_>) -> Option<String> {
    let shown =
        with.things.iter().find(|thing| is_carried(thing, with)).map_or("jar", Thing::shown);
    if is_again(said) {
        return Some("say it once more; at the prompt the Up key recalls it".to_owned());
    }
    let begins = said.split(' ').next().unwrap_or(said);
    if let Some((_, help)) = INSTEAD.iter().find(|(words, _)| words.contains(&begins)) {
        return Some(help.replace("{o}", shown));
    }
    if share(said).is_some() {
        let is_vessel = |thing: &&Thing| with.library.is_a(&thing.kind, VESSEL);
        let target = with.things.iter().rfind(is_vessel).map_or("cup", Thing::shown);
        return Some(format!("say into what, such as \"pour {said} into the {target}\""));
    }
    let (verb, rest) = said.split_once(' ')?;
    if CARRYING.contains(&verb) && !rest.contains(" to ") {
        return Some(format!("say where to, such as \"{verb} the {shown} to the table\""));
    }
    is_foreign(said).then(|| format!("sentences are in English, such as \"pick up the {shown}\""))
}

/// Whether a thing is one that the arm carries.
fn is_carried(thing: &Thing, with: &Knowledge<'_>) -> bool {
    with.library.is_a(&thing.kind, "Graspable")
}
