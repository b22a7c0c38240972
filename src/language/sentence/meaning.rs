//! What a sentence can come to, and a sentence without what means nothing.

use super::super::ast::Call;

/// Words that say how a wish is meant and not what is wished, at the edges of a sentence.
const POLITE: &[&str] = &[
    "please",
    "kindly",
    "now",
    "then",
    "first",
    "next",
    "finally",
    "and",
    "robot",
    "hey",
    "ok",
    "okay",
    "thanks",
    "just",
    "so",
    "well",
    "could you",
    "can you",
    "would you",
    "will you",
    "i want you to",
    "i would like you to",
    "thank you",
    "for me",
    "go ahead and",
    "let us",
    "let's",
];

/// What a sentence comes to.
#[derive(Debug, Clone, PartialEq)]
pub enum Meaning {
    /// One call.
    Clear(Understood),
    /// Several; a person has to say which.
    Ambiguous {
        /// Which `cup`: blue cup or red cup?
        question: String,
        /// The calls, at most four.
        choices: Vec<Understood>,
    },
    /// A question; nothing moves for it.
    Asked {
        /// What the prompt is asked: a fluent, a quantity, or a command with its colon.
        line: String,
        /// The template that fits.
        template: String,
    },
    /// The wish is understood and cannot be met.
    Impossible {
        /// One sentence.
        why: String,
        /// What would help.
        help: Option<String>,
    },
    /// No sentence like it is known.
    Unknown {
        /// What would help.
        help: String,
    },
}

/// What a sentence means, and why: a call, or several that follow each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Understood {
    /// As typed at the prompt: `pick(jar) then place(jar)`.
    pub text: String,
    /// The calls, one at least.
    pub calls: Vec<Call>,
    /// The template that fits; of several calls, each one's.
    pub template: String,
    /// What each slot stands for: slot, words, value.
    pub slots: Vec<(String, String, String)>,
    /// What the sentence does not say and the task fills in: `amount: filled(source)`.
    pub defaults: Vec<String>,
}

/// Returns a sentence in lower case with one blank between words, without marks at the ends of words and
/// without politeness at its edges.
pub fn words(sentence: &str) -> String {
    let lower = sentence.to_lowercase();
    let cleaned: Vec<&str> = lower
        .split_whitespace()
        .map(|word| {
            word.trim_matches(|c: char| matches!(c, '.' | ',' | '!' | '?' | ';' | ':' | '"'))
        })
        .filter(|word| !word.is_empty())
        .collect();
    let mut rest = cleaned.join(" ");
    loop {
        let before = rest.len();
        for polite in POLITE {
            if let Some(after) = rest.strip_prefix(polite)
                && after.starts_with(' ')
            {
                rest = after.trim_start().to_owned();
            }
            if let Some(head) = rest.strip_suffix(polite)
                && head.ends_with(' ')
            {
                rest = head.trim_end().to_owned();
            }
        }
        if rest.len() == before {
            return rest;
        }
    }
}
