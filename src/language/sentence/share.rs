//! Parts of a whole, as people say them: "half", "two thirds", "to 80 %", "a third full".

use super::super::text;
use crate::units::Quantity;

/// Parts of a whole, as people say them, and what they are multiplied with and divided by.
const SHARES: &[(&str, u8, u8)] = &[
    ("all", 1, 1),
    ("everything", 1, 1),
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

/// Whether words tell a part.
pub(super) fn is_share(said: &str) -> bool {
    share(said).is_some()
}

/// `half`, `two thirds`, `25 %`, `to the half`, `a third full`: a part of [`WHOLE`].
pub(super) fn share(said: &str) -> Option<String> {
    let part = said.trim_end_matches(" of it").trim_end_matches(" full");
    let part = part.trim_start_matches("to ");
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
