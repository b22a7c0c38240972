//! The words of stepping: what a line asks for. Their table is in [`super::wording`].

use crate::language;

use super::answers::Answer;
use super::wording::WORDS;

/// What a person wants.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Wish {
    /// One step.
    Next,
    /// What a sub-task is made of, and a pause at each of its steps; of a step, at each line of its script.
    Into,
    /// The whole sub-task ahead, or the step.
    Over,
    /// The rest of the sub-task that the step ahead is part of, or of the script.
    Out,
    /// To the next breakpoint, or the end.
    Continue,
    /// A look at an earlier step: the one before, or that number.
    Back(Option<usize>),
    /// A look at the step after the one looked at.
    Forward,
    /// Why a fluent is what it is; what failed when `None`.
    Why(Option<String>),
    /// The next rung of the ladder of hints.
    Hint,
    /// The speed dial: where it stands, or a new place, percent.
    Slow(Option<u8>),
    /// Which breakpoints there are.
    Stops,
    /// One more breakpoint.
    Break(String),
    /// One breakpoint fewer, or none at all.
    Clear(Option<String>),
    /// The end; the arm holds its position.
    Quit,
    /// The words.
    Help,
}

/// Why a line is no wish.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Wrong {
    /// There is no such word; the nearest, if one is near.
    Unknown(Option<&'static str>),
    /// It takes something else: what.
    Takes(Takes),
    /// An answer, and no question is open.
    NoQuestion,
}

/// What a word takes after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Takes {
    /// It stands alone.
    #[error("nothing")]
    Nothing,
    /// Which step.
    #[error("the number of a step")]
    StepNumber,
    /// How fast.
    #[error("a speed from 1 to 100 %")]
    Speed,
}

/// Returns whether a line begins with a word of stepping, or answers a question.
pub fn is_one(line: &str) -> bool {
    let (word, _) = split(line);
    word.is_empty()
        || matches!(word, "help" | "?" | "stop" | "halt" | "q")
        || is_word(word)
        || Answer::parse(line).is_some()
}

/// Returns whether a word is one of stepping, as the table has them.
pub fn is_word(word: &str) -> bool {
    WORDS.iter().any(|(name, ..)| *name == word)
}

/// The first word, with or without a colon, and the rest.
fn split(line: &str) -> (&str, &str) {
    let line = line.trim();
    let line = line.strip_prefix(':').unwrap_or(line);
    let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    (word, rest.trim())
}

/// Reads a line.
///
/// # Errors
///
/// What is wrong with it.
pub fn parse(line: &str) -> Result<Wish, Wrong> {
    let (word, rest) = split(line);
    let named = (!rest.is_empty()).then(|| rest.to_owned());
    let wish = match word {
        "" | "next" => Wish::Next,
        "into" => Wish::Into,
        "over" => Wish::Over,
        "out" => Wish::Out,
        "continue" => Wish::Continue,
        "back" => match named {
            None => Wish::Back(None),
            Some(number) => {
                Wish::Back(Some(number.parse().map_err(|_| Wrong::Takes(Takes::StepNumber))?))
            }
        },
        "forward" => Wish::Forward,
        "why" => Wish::Why(named),
        "hint" => Wish::Hint,
        "slow" => match named {
            None => Wish::Slow(None),
            Some(percent) => Wish::Slow(Some(percentage(&percent)?)),
        },
        "break" => match rest.split_once(char::is_whitespace).unwrap_or((rest, "")) {
            ("", _) => Wish::Stops,
            ("clear", "") => Wish::Clear(None),
            ("clear", step) => Wish::Clear(Some(step.trim().to_owned())),
            _ => Wish::Break(rest.to_owned()),
        },
        "clear" => Wish::Clear(named),
        "quit" | "q" | "stop" | "halt" => Wish::Quit,
        "help" | "?" => Wish::Help,
        _ if Answer::parse(line).is_some() => return Err(Wrong::NoQuestion),
        _ => {
            let near = language::nearest(word, WORDS.iter().map(|(name, ..)| *name));
            return Err(Wrong::Unknown(near));
        }
    };
    if !rest.is_empty() && WORDS.iter().any(|(name, takes, _)| *name == word && takes.is_empty()) {
        return Err(Wrong::Takes(Takes::Nothing));
    }
    Ok(wish)
}

fn percentage(text: &str) -> Result<u8, Wrong> {
    let number = text.trim_end_matches('%').trim().parse().ok();
    let percent = number.filter(|percent| (1..=100).contains(percent));
    percent.ok_or(Wrong::Takes(Takes::Speed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_with_and_without_a_colon() {
        assert_eq!(parse(""), Ok(Wish::Next));
        assert_eq!(parse(" :continue "), Ok(Wish::Continue));
        assert_eq!(parse("back 3"), Ok(Wish::Back(Some(3))));
        assert_eq!(parse("why above(jar, cup)"), Ok(Wish::Why(Some("above(jar, cup)".into()))));
        assert_eq!(parse("slow 30 %"), Ok(Wish::Slow(Some(30))));
        assert_eq!(parse("break grasp(jar, side)"), Ok(Wish::Break("grasp(jar, side)".into())));
        assert_eq!(parse("break clear grasp"), Ok(Wish::Clear(Some("grasp".into()))));
        assert_eq!(parse(":stop"), Ok(Wish::Quit));
        assert_eq!(parse("q"), Ok(Wish::Quit));
        // Who asks what there is to say has not said that it cannot be told.
        assert_eq!(parse("?"), Ok(Wish::Help));
    }

    #[test]
    fn what_is_no_word_never_moves_anything() {
        assert_eq!(parse("nxet"), Err(Wrong::Unknown(Some("next"))));
        // An answer that comes a moment too late.
        assert_eq!(parse("n"), Err(Wrong::NoQuestion));
        assert_eq!(parse("next 3"), Err(Wrong::Takes(Takes::Nothing)));
        assert_eq!(parse("slow 0"), Err(Wrong::Takes(Takes::Speed)));
        assert_eq!(parse("slow 101"), Err(Wrong::Takes(Takes::Speed)));
        assert_eq!(parse("back x"), Err(Wrong::Takes(Takes::StepNumber)));
    }

    #[test]
    fn every_word_of_the_table_is_read() {
        for (name, takes, _) in WORDS {
            assert!(parse(name).is_ok(), "{name}");
            assert_eq!(parse(&format!("{name} 5")).is_ok(), !takes.is_empty(), "{name}");
        }
    }
}
