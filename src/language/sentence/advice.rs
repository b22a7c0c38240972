//! What helps somebody whose sentence is not known and is like none: words that a prompt has other means for, and sentences in
//! another language than English.

use super::knowledge::{Knowledge, Thing};

/// Words that mean to be told what was meant before, or to end or take back what was done, and what does so.
const INSTEAD: &[(&str, &str)] = &[
    ("again", "say it once more; at the prompt the Up key recalls it"),
    ("repeat", "say it once more; at the prompt the Up key recalls it"),
    ("repeat that", "say it once more; at the prompt the Up key recalls it"),
    ("do it again", "say it once more; at the prompt the Up key recalls it"),
    (
        "undo",
        "the arm takes nothing back: say where things are to go, such as \"put the jar on the table\"",
    ),
    (
        "undo it",
        "the arm takes nothing back: say where things are to go, such as \"put the jar on the table\"",
    ),
    ("stop", "Ctrl-C stops the arm while it moves"),
    ("halt", "Ctrl-C stops the arm while it moves"),
    ("stop it", "Ctrl-C stops the arm while it moves"),
    ("stop moving", "Ctrl-C stops the arm while it moves"),
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

/// Returns what to do instead of what is said, where it is no sentence that could be like one that is known.
pub(super) fn instead(said: &str, with: &Knowledge<'_>) -> Option<String> {
    if let Some((_, help)) = INSTEAD.iter().find(|(words, _)| *words == said) {
        return Some((*help).to_owned());
    }
    let shown =
        with.things.iter().find(|thing| is_carried(thing, with)).map_or("jar", Thing::shown);
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
