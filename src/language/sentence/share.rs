//! Parts of a whole, as people say them: "half", "two thirds", "to 80 %", "a third full".

use super::super::text;
use crate::units::Quantity;

/// Parts of a whole, as people say them, and what they are multiplied with and divided by.
const SHARES: &[(&str, u8, u8)] = &[
    ("all", 1, 1),
    ("everything", 1, 1),
    ("brim", 1, 1),
    ("the rest", 1, 1),
    ("half", 1, 2),
    ("halfway", 1, 2),
    ("half way", 1, 2),
    ("one half", 1, 2),
    ("a half", 1, 2),
    ("third", 1, 3),
    ("one third", 1, 3),
    ("a third", 1, 3),
    ("two thirds", 2, 3),
    ("quarter", 1, 4),
    ("one quarter", 1, 4),
    ("a quarter", 1, 4),
    ("three quarters", 3, 4),
];

/// What stands for the whole in the value of a part of it, until it is known of what.
pub(super) const WHOLE: &str = "WHOLE";

/// What stands before an amount that something is to hold in the end: what is there is taken away from it.
pub(super) const LEVEL: &str = "LEVEL ";

/// Whether words tell a part, or a level.
pub(super) fn is_share(said: &str) -> bool {
    share(said).is_some() || level(said).is_some_and(is_amount)
}

/// `to 100 ml`, `up to 100 ml`: the amount that is there in the end.
pub(super) fn level(said: &str) -> Option<&str> {
    let amount = said.strip_prefix("up ").unwrap_or(said).strip_prefix("to ")?;
    amount.starts_with(|c: char| c.is_ascii_digit()).then_some(amount)
}

/// `100 ml`: a number and one word for its unit.
fn is_amount(said: &str) -> bool {
    let unit = said.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.').trim_start();
    !unit.is_empty() && unit.chars().all(char::is_alphabetic)
}

/// `half`, `two thirds`, `25 %`, `to the half`, `a third full`: a part of [`WHOLE`].
pub(super) fn share(said: &str) -> Option<String> {
    let part = said.trim_end_matches(" of it").trim_end_matches(" full");
    let part = part.trim_start_matches("up ").trim_start_matches("to ");
    let is_it = |words: &str| words == part || part.strip_prefix("the ") == Some(words);
    if let Some((_, times, by)) = SHARES.iter().find(|(words, ..)| is_it(words)) {
        return Some(match (times, by) {
            (1, 1) => WHOLE.to_owned(),
            (1, by) => format!("{WHOLE} / {by}"),
            (times, by) => format!("{times} * {WHOLE} / {by}"),
        });
    }
    let number = ["%", "percent", "per cent"].iter().find_map(|word| part.strip_suffix(word))?;
    let percent = number.trim().parse::<f64>().ok().filter(|p| *p > 0.0 && *p <= 100.0)?;
    Some(format!("{} * {WHOLE}", text::quantity(Quantity::number(percent / 100.0))))
}
