//! Slips of the fingers: "pikc up teh jar" is asked back as "pick up the jar".
//!
//! Each word that no sentence has is exchanged for the nearest that one has. Nothing is done for it: what comes out is
//! only suggested, and only where it is understood.

use std::collections::BTreeSet;

use super::super::parse::nearest;
use super::knowledge::{Knowledge, Thing};
use super::meaning::Meaning;
use super::{LITTLE, describe, meant, question, relation};

/// Shorter words are near to too many.
const SHORTEST: usize = 3;
/// Who says more at once, in words, pasted something.
const LONGEST: usize = 40;

/// Returns a sentence without its slips, `said` as [`super::words`] makes it; `None` when it has none or means nothing
/// without them either.
pub(super) fn corrected(said: &str, with: &Knowledge<'_>) -> Option<String> {
    if said.split(' ').count() > LONGEST {
        return None;
    }
    let known = known(with);
    let is_slip = |word: &str| {
        word.chars().count() >= SHORTEST
            && word.chars().all(char::is_alphabetic)
            && !known.contains(word)
    };
    let correct = said.split(' ').map(|word| {
        let near = || nearest(word, known.iter().map(String::as_str));
        if is_slip(word) { near().unwrap_or(word) } else { word }
    });
    let corrected = correct.collect::<Vec<_>>().join(" ");
    if corrected == said {
        return None;
    }
    // Whether it can be done now is asked when somebody says so.
    let able = Knowledge { hindrance: &|_| None, ..*with };
    let is_understood = matches!(
        meant(&corrected, &able),
        Meaning::Clear(_) | Meaning::Ambiguous { .. } | Meaning::Asked { .. }
    );
    is_understood.then_some(corrected)
}

/// Returns the words of the sentences that are known, and of the things that are here.
fn known(with: &Knowledge<'_>) -> BTreeSet<String> {
    let mut known = BTreeSet::new();
    for callable in with.library.callables() {
        for say in callable.say() {
            known.extend(words_of(&say.text));
        }
    }
    for (fluent, _) in with.library.fluents() {
        known.extend(fluent.ask.iter().flat_map(|ask| words_of(&ask.text)));
    }
    for phrase in with.phrases {
        known.extend(words_of(&phrase.template.text));
    }
    let fixed = question::sentences().chain(relation::phrases()).chain(describe::qualities());
    known.extend(fixed.flat_map(words_of));
    known.extend(with.things.iter().flat_map(Thing::words));
    known.extend(LITTLE.iter().map(|word| (*word).to_owned()));
    known
}

/// Returns the words of a template, in lower case and without its slots.
fn words_of(template: &str) -> Vec<String> {
    let mut plain = String::new();
    let mut is_slot = false;
    for c in template.chars() {
        match c {
            '{' => is_slot = true,
            '}' => is_slot = false,
            c if !is_slot && (c.is_alphanumeric() || c == '\'') => plain.extend(c.to_lowercase()),
            _ => plain.push(' '),
        }
    }
    plain.split_whitespace().map(str::to_owned).collect()
}
