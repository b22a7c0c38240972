//! Places told by their relation to things: "to the left of the cup" → `left_of(cup)`.
//!
//! A sentence's words for a relation are joined into the language's own before templates are matched, so that `{at}`
//! after "at" is one slot: "put the jar next to the cup" is read as "put the jar at `next_to` the cup".

use super::knowledge::Knowledge;
use super::resolve::{self, Found, Hindrance};
use super::shift;
use crate::language::builtins::Ty;

/// What people say, and what the language calls it; the longer before those that they hold.
const SAID: &[(&str, &str)] = &[
    ("on the left hand side of", "left_of"),
    ("to the left hand side of", "left_of"),
    ("on the left side of", "left_of"),
    ("to the left side of", "left_of"),
    ("on the left of", "left_of"),
    ("to the left of", "left_of"),
    ("left of", "left_of"),
    ("on the right hand side of", "right_of"),
    ("to the right hand side of", "right_of"),
    ("on the right side of", "right_of"),
    ("to the right side of", "right_of"),
    ("on the right of", "right_of"),
    ("to the right of", "right_of"),
    ("right of", "right_of"),
    ("in front of", "in_front_of"),
    ("in between", "between"),
    ("between", "between"),
    ("behind", "behind"),
    ("right next to", "next_to"),
    ("next to", "next_to"),
    ("beside", "next_to"),
    ("close to", "next_to"),
    ("near", "next_to"),
];

/// Returns what people say of where something is.
pub(super) fn phrases() -> impl Iterator<Item = &'static str> {
    SAID.iter().map(|(phrase, _)| *phrase)
}

/// Returns the ways to read a sentence in which relations are one word each, as the language writes them: one of them
/// tells the place, after "at", the last first; or none does, and each tells which thing is meant.
pub(super) fn readings(said: &str) -> Vec<String> {
    if let Some(shifted) = shift::marked(said) {
        return vec![shifted];
    }
    let (mut rest, mut parts, mut words) = (said, Vec::new(), Vec::new());
    loop {
        let found = SAID.iter().filter_map(|(phrase, word)| {
            let at = rest.find(&format!(" {phrase} "))?;
            Some((at, phrase.len(), *word))
        });
        // Where two begin at one place, the longer is listed first.
        let Some((at, len, word)) = found.min_by_key(|(at, len, _)| (*at, usize::MAX - len)) else {
            break;
        };
        parts.push(&rest[..at]);
        words.push(word);
        rest = &rest[at + 1 + len..];
    }
    let read = |place: Option<usize>| {
        let mut read = String::new();
        for (k, (part, word)) in parts.iter().zip(&words).enumerate() {
            let is_place = place == Some(k);
            read += if is_place { part.trim_end_matches(" at") } else { part };
            read += if is_place { " at " } else { " " };
            read += word;
        }
        read + rest
    };
    (0..words.len()).rev().map(Some).chain([None]).map(read).collect()
}

/// Whether words hold the place of a reading: then they name no thing.
pub(super) fn holds_place(said: &str) -> bool {
    SAID.iter().any(|(_, word)| said.contains(&format!(" at {word} ")))
}

/// What is said of what is between one thing.
pub(super) fn between_two() -> Hindrance {
    let help = Some("say \"between the jar and the cup\"".into());
    Hindrance::new("what is between is between two things", help)
}

/// Returns words with their relations as people say them: `in front of`.
pub(super) fn spoken(words: &str) -> String {
    let each = words.split(' ').map(|word| {
        let is_one = SAID.iter().any(|(_, known)| *known == word);
        if is_one { word.replace('_', " ") } else { word.to_owned() }
    });
    each.collect::<Vec<_>>().join(" ")
}

/// Returns what the words of a relation may mean; `None` when they are none.
pub(super) fn resolve(
    said: &str,
    slot: &str,
    with: &Knowledge<'_>,
) -> Option<Result<Vec<Found>, Hindrance>> {
    if let Some(found) = shift::resolve(said) {
        return Some(Ok(vec![found]));
    }
    // An article may stand before it, as it does in templates.
    let said = said.strip_prefix("the ").unwrap_or(said);
    let (word, rest) = said.split_once(' ')?;
    SAID.iter().any(|(_, known)| *known == word).then(|| {
        let thing = |said: &str| resolve::resolve(said, &Ty::Object(String::new()), slot, with);
        let shown = word.replace('_', " ");
        if word != "between" {
            let things = thing(rest)?.into_iter();
            return Ok(things
                .map(|of| Found {
                    value: format!("{word}({})", of.value),
                    shown: format!("{shown} {}", of.shown),
                })
                .collect());
        }
        let Some((a, b)) = rest.split_once(" and ") else {
            return match &all(rest, slot, with)[..] {
                [a, b] => Ok(vec![Found {
                    value: format!("between({}, {})", a.value, b.value),
                    shown: format!("{shown} {} and {}", a.shown, b.shown),
                }]),
                _ => Err(between_two()),
            };
        };
        let (first, second) = (thing(a)?, thing(b)?);
        let pairs = first.iter().flat_map(|a| second.iter().map(move |b| (a, b)));
        Ok(pairs
            .filter(|(a, b)| a.value != b.value)
            .map(|(a, b)| Found {
                value: format!("between({}, {})", a.value, b.value),
                shown: format!("{shown} {} and {}", a.shown, b.shown),
            })
            .collect())
    })
}

/// Returns the things that a plural names: "the cups".
fn all(said: &str, slot: &str, with: &Knowledge<'_>) -> Vec<Found> {
    let one = said.strip_suffix('s').unwrap_or_default();
    resolve::resolve(one, &Ty::Object(String::new()), slot, with).unwrap_or_default()
}

/// Returns the thing that a relation with one thing is told by: `cup` of `left_of(cup)`; any other value as it is.
pub(super) fn of(value: &str) -> &str {
    let inside = value.split_once('(').and_then(|(word, rest)| {
        let inside = rest.strip_suffix(')')?;
        (!inside.contains(',') && SAID.iter().any(|(_, known)| *known == word)).then_some(inside)
    });
    inside.unwrap_or(value)
}

/// Splits what was said into its relation, with a blank after it, and the thing: `in front of ` and `cup`.
pub(super) fn split(said: &str) -> (String, &str) {
    match said.split_once(' ') {
        Some((word, rest)) if SAID.iter().any(|(_, known)| *known == word) => {
            (format!("{} ", word.replace('_', " ")), rest.trim_start_matches("the "))
        }
        _ => (String::new(), said),
    }
}

#[cfg(test)]
mod tests {
    use super::readings;

    #[test]
    fn relations_are_one_word_and_one_of_them_may_be_the_place() {
        for (said, read) in [
            ("put the jar to the left of the cup", "put the jar at left_of the cup"),
            ("put the jar right next to the cup", "put the jar at next_to the cup"),
            ("put it in between the jar and the cup", "put it at between the jar and the cup"),
            ("put the jar at in front of it", "put the jar at in_front_of it"),
            ("pick up the jar", "pick up the jar"),
            ("put the rightmost jar down", "put the rightmost jar down"),
        ] {
            assert_eq!(readings(said)[0], read);
        }
        assert_eq!(
            readings("put the cup beside the jar left of the tray"),
            [
                "put the cup next_to the jar at left_of the tray",
                "put the cup at next_to the jar left_of the tray",
                "put the cup next_to the jar left_of the tray",
            ]
        );
    }
}
