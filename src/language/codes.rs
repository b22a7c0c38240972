//! What each code means: the sections of `docs/errors.md`, which people read and the program prints.

/// The page.
const PAGE: &str = include_str!("../../docs/errors.md");

/// One section of the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Explanation<'a> {
    /// `task::unit`.
    pub code: &'a str,
    /// What it means, in a paragraph or two.
    pub meaning: &'a str,
    /// A text that raises it; `None` where no text does.
    pub wrong: Option<&'a str>,
    /// The same text put right.
    pub right: Option<&'a str>,
}

/// Returns what a code means; the layer before it (`task::`) may be left out.
pub fn explain(code: &str) -> Option<Explanation<'static>> {
    let fits = |e: &Explanation<'_>| {
        e.code == code || e.code.rsplit_once("::").is_some_and(|(_, short)| short == code)
    };
    explanations().find(fits)
}

/// Returns every section, in the order of the page.
pub fn explanations() -> impl Iterator<Item = Explanation<'static>> {
    PAGE.split("\n## ").skip(1).map(|section| {
        let (code, rest) = section.split_once('\n').unwrap_or((section, ""));
        let meaning = rest.split("\nWrong:").next().unwrap_or(rest);
        Explanation {
            code: code.trim(),
            meaning: meaning.trim(),
            wrong: example(rest, "Wrong:"),
            right: example(rest, "Right:"),
        }
    })
}

/// The fenced text after a word at the start of a line.
fn example<'a>(section: &'a str, word: &str) -> Option<&'a str> {
    let after = section.split_once(word)?.1.split_once("```\n")?.1;
    Some(after.split_once("```")?.0)
}
