//! Two things told by one word: "swap the cups" is read as "swap the blue cup and the red cup", where there are two.

use super::knowledge::{Knowledge, either};
use super::resolve::{self, Found, Hindrance};

/// Words before a plural, which it begins after.
const BEFORE: &[&str] = &["the", "both", "two", "these", "those"];

/// Returns the sentence with its plural told thing by thing, and what hinders that where it is not of two; `None` where nothing in
/// it is a plural.
pub(super) fn pair(said: &str, with: &Knowledge<'_>) -> Option<(String, Option<Hindrance>)> {
    let words: Vec<&str> = said.split(' ').collect();
    let mut next = None;
    words.iter().enumerate().find_map(|(at, word)| {
        let begin = next;
        if BEFORE.contains(word) {
            next = Some(at + 1);
        }
        let begin = begin?;
        let (noun, found) = singulars(word).find_map(|one| {
            let looks = words[begin..at].iter().copied().chain([one]);
            let found = resolve::objects(&looks.collect::<Vec<_>>().join(" "), None, "", with);
            Some((one, found.ok()?))
        })?;
        let first = (0..begin).rev().take_while(|k| BEFORE.contains(&words[*k])).last()?;
        let (both, hindrance) = told(&found, noun)?;
        let parts = words[..first].iter().copied().chain([both.as_str()]);
        let parts: Vec<&str> = parts.chain(words[at + 1..].iter().copied()).collect();
        Some((parts.join(" "), hindrance))
    })
}

/// Returns what one of a plural may be called.
fn singulars(word: &str) -> impl Iterator<Item = &str> {
    let irregular = (word == "dice").then_some("die");
    irregular.into_iter().chain(["s", "es"].into_iter().filter_map(|end| word.strip_suffix(end)))
}

/// Names two things one by one, or those that stand for two and why these are not.
fn told(found: &[Found], noun: &str) -> Option<(String, Option<Hindrance>)> {
    let (a, b) = (found.first()?, found.get(1).or(found.first())?);
    let both = format!("the {} and the {}", called(a, b), called(b, a));
    let names: Vec<&str> = found.iter().map(|one| one.shown.as_str()).collect();
    let (why, help) = match names.as_slice() {
        [_, _] => return Some((both, None)),
        [one] => (format!("only one {noun} is here: {one}"), "name two things"),
        _ => (format!("more than two fit: {}", either(&names)), "say which two"),
    };
    // Further than a slot that takes a plural for a name.
    Some((both, Some(Hindrance { after: 1, ..Hindrance::new(why, Some(help.into())) })))
}

/// What one is called that the other is not.
fn called<'f>(one: &'f Found, other: &Found) -> &'f str {
    if one.shown == other.shown { &one.value } else { &one.shown }
}
