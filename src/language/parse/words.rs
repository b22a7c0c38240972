//! The words of the language, and the nearest of them to a slip.

use super::super::ast::Span;

/// Leads from bytes of the slice to bytes of the original.
pub(super) type ToOriginal<'a> = dyn Fn(usize, usize) -> Span + 'a;

/// What may start an item, and what may start a step or a clause.
pub(super) const ITEMS: &[&str] =
    &["task", "action", "fluent", "type", "scene", "twin", "model", "import"];
pub(super) const STEPS: &[&str] = &[
    "either", "if", "repeat", "together", "check", "let", "needs", "keeps", "gives", "say",
    "limit", "timing", "retry", "abort", "while", "until", "then", "else", "break", "via",
];
pub(super) const CLAUSES: &[&str] = &["needs", "keeps", "gives", "run", "limit"];
pub(super) const ENTRIES: &[&str] = &["marks", "camera", "robot", "person"];
pub(super) const MODEL: &[&str] = &["input", "param", "state", "let", "output"];
pub(super) const VIEWS: &[&str] = &["image", "focal", "calibration", "looking", "at"];

/// How two steps may lie in time.
pub(super) const ALLEN: &[&str] =
    &["before", "meets", "overlaps", "starts", "during", "finishes", "equals"];

/// Words that may follow a number and are no units.
pub(super) const AFTER_NUMBER: &[&str] = &[
    "times", "when", "x", "and", "or", "within", "while", "until", "as", "by", "then", "if", "on",
];

/// Words that cannot be names.
pub(super) const RESERVED: &[&str] = &[
    "task", "action", "fluent", "type", "import", "needs", "keeps", "gives", "either", "or", "if",
    "else", "repeat", "together", "check", "let", "and", "not", "while", "until", "within", "true",
    "false",
];

/// Signs of other keyboards and other languages, each with the sign or the word of this one.
pub(super) const SIGNS: &[(&str, &str)] = &[
    ("\u{FF0C}", ","),
    ("\u{3001}", ","),
    ("\u{FF1A}", ":"),
    ("\u{FF08}", "("),
    ("\u{FF09}", ")"),
    ("\u{FF5B}", "{"),
    ("\u{FF5D}", "}"),
    ("\u{FF1D}", "="),
    ("=>", ">="),
    ("=<", "<="),
    ("&&", "and"),
    ("&", "and"),
    ("||", "or"),
    ("!", "not"),
];

/// Quotation marks, straight and as word processors set them.
pub(super) const QUOTES: &[char] = &[
    '"', '\'', '`', '\u{201C}', '\u{201D}', '\u{201E}', '\u{2018}', '\u{2019}', '\u{201A}',
    '\u{AB}', '\u{BB}', '\u{FF02}',
];

/// Returns the candidate nearest to a word, if any is near enough to be meant. A beginning is as near as a word
/// with one slip: `dist` is `distance`, and not `tilt`.
pub fn nearest<'a>(word: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let lower = word.to_lowercase();
    let length = lower.chars().count();
    let allowed = if length <= 3 { 1 } else { 2 };
    let distance = |c: &str| {
        if length >= 3 && c.starts_with(&lower) {
            return Some(1);
        }
        // A slip changes the length by one at most: what is longer or shorter needs no comparing.
        let is_near = c.chars().count().abs_diff(length) <= allowed;
        is_near.then(|| strsim::damerau_levenshtein(&lower, c))
    };
    candidates
        .filter_map(|c| Some((distance(&c.to_lowercase())?, c)))
        .filter(|(distance, c)| *distance <= allowed && *distance < c.chars().count())
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}
