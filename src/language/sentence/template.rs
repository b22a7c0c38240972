//! Sentence templates: `pour [water|juice] from [the] {source} [in]to [the] {target}`.
//!
//! `(a|b)` is one of several, `[a]` may be left out, `{slot}` stands for a few words, `{amount of capacity(o)}` for a part of
//! what is named, and with `less filled(o)` for what of that is not there yet. A blank in a template
//! stands for a blank in the sentence, so `[in]to` is `to` or `into`. Reading a sentence is linear in its
//! length times the template's: every place of both is visited at most once.
//!
//! Source: the syntax is that of Home Assistant's hassil; the matcher is Thompson's, with priorities.

use std::collections::BTreeMap;
use std::iter::Peekable;
use std::str::Chars;

use super::share::is_share;

/// Brackets inside brackets beyond this are refused.
const MAX_DEPTH: usize = 8;
/// The most words that one slot stands for: "between the red cube and the green one" and two to spare.
const MAX_WORDS: usize = 10;

/// So many words tell a part at most: "to three quarters of it full".
const SHARE_WORDS: usize = 6;

/// A sentence with blanks to fill in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Template {
    /// The template as written.
    pub text: String,
    code: Vec<Op>,
    slots: Vec<String>,
    /// What a slot is a part of, where the template says so.
    wholes: Vec<Option<Whole>>,
}

/// What a part is taken of, as the language writes it, and what of that is there already.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Whole {
    /// All of it.
    pub all: String,
    /// What is taken away from a part of it, if anything is.
    pub less: Option<String>,
}

/// Why a text is no template.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wrong {
    /// One sentence.
    pub message: String,
    /// What to write.
    pub help: String,
}

/// How many words a slot takes where it could take fewer or more: "put the die on the tray on the table".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// As few as do: the die.
    Short,
    /// As many as do: the die on the tray.
    Long,
}

/// One instruction of the matcher.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Op {
    Char(char),
    Blank,
    /// Go on at the first, else at the second.
    Split(usize, usize),
    Jump(usize),
    Open(usize),
    /// One more character of a slot.
    Any,
    Close(usize),
}

impl Template {
    /// Reads a template.
    ///
    /// # Errors
    ///
    /// [`Wrong`]: a bracket that is not closed or not opened, a slot without a name or used twice, or no
    /// word at all.
    pub fn read(text: &str) -> Result<Self, Wrong> {
        let mut reader = Reader {
            rest: text.chars().peekable(),
            code: Vec::new(),
            slots: Vec::new(),
            wholes: Vec::new(),
            words: 0,
        };
        reader.alternatives(None, 0)?;
        if reader.words == 0 {
            return Err(wrong(
                "the sentence has no word of its own",
                "add the word that begins it",
            ));
        }
        let Reader { code, slots, wholes, .. } = reader;
        Ok(Self { text: text.to_owned(), code, slots, wholes })
    }

    /// Returns the names of its slots.
    pub fn slots(&self) -> &[String] {
        &self.slots
    }

    /// Returns what a slot is a part of, where the template says so.
    pub fn whole(&self, slot: &str) -> Option<&Whole> {
        self.wholes[self.slots.iter().position(|own| own == slot)?].as_ref()
    }

    /// Returns the words that each slot stands for, when the whole sentence fits: lower case, one blank
    /// between words, as [`super::words`] makes it.
    pub fn fit(&self, sentence: &str, reach: Reach) -> Option<BTreeMap<String, String>> {
        let chars: Vec<char> = sentence.chars().collect();
        let mut tried = vec![false; (self.code.len() + 1) * (chars.len() + 1)];
        let mut open = vec![(0, 0, vec![None; self.slots.len()])];
        while let Some((at, pos, slots)) = open.pop() {
            let place = at * (chars.len() + 1) + pos;
            if std::mem::replace(&mut tried[place], true) {
                continue;
            }
            let after_blank = pos == 0 || chars[pos - 1] == ' ';
            let Some(op) = self.code.get(at) else {
                // A blank that a left-out word leaves behind costs nothing.
                if pos == chars.len() {
                    return Some(self.words_of(&chars, &slots));
                }
                continue;
            };
            match op {
                Op::Char(c) if chars.get(pos) == Some(c) => open.push((at + 1, pos + 1, slots)),
                Op::Blank if chars.get(pos) == Some(&' ') => open.push((at + 1, pos + 1, slots)),
                Op::Blank if after_blank || pos == chars.len() => open.push((at + 1, pos, slots)),
                Op::Split(first, second) => {
                    let is_slot = self.code.get(*second) == Some(&Op::Any);
                    let (first, second) = match reach {
                        Reach::Long if is_slot => (second, first),
                        _ => (first, second),
                    };
                    // The last pushed is tried first.
                    open.push((*second, pos, slots.clone()));
                    open.push((*first, pos, slots));
                }
                Op::Jump(to) => open.push((*to, pos, slots)),
                // A part begins with the words of one, so that it is told from the thing before it.
                Op::Open(slot)
                    if self.wholes[*slot].is_some() && !begins_with_share(&chars[pos..]) => {}
                Op::Open(slot) if after_blank && chars.get(pos).is_some_and(|c| *c != ' ') => {
                    let mut slots = slots;
                    slots[*slot] = Some((pos, pos));
                    open.push((at + 1, pos, slots));
                }
                Op::Any if pos < chars.len() => open.push((at + 1, pos + 1, slots)),
                Op::Close(slot) => {
                    let mut slots = slots;
                    let from = slots[*slot].map_or(pos, |(from, _)| from);
                    let ends = pos == chars.len() || chars[pos] == ' ';
                    let words = chars[from..pos].iter().filter(|c| **c == ' ').count() + 1;
                    let is_share = || is_share(&chars[from..pos].iter().collect::<String>());
                    let fits = self.wholes[*slot].is_none() || is_share();
                    if ends && pos > from && words <= MAX_WORDS && fits {
                        slots[*slot] = Some((from, pos));
                        open.push((at + 1, pos, slots));
                    }
                }
                // What does not fit here ends this attempt.
                Op::Char(_) | Op::Blank | Op::Open(_) | Op::Any => {}
            }
        }
        None
    }

    fn words_of(
        &self,
        chars: &[char],
        slots: &[Option<(usize, usize)>],
    ) -> BTreeMap<String, String> {
        let filled = self.slots.iter().zip(slots).filter_map(|(name, slot)| {
            let (from, to) = (*slot)?;
            Some((name.clone(), chars[from..to].iter().collect::<String>()))
        });
        filled.collect()
    }

    /// Returns an example sentence: the first of alternatives, what may be left out put in, slots filled in
    /// by `word`.
    pub fn example(&self, word: impl Fn(&str) -> String) -> String {
        let mut out = String::new();
        let mut at = 0;
        while let Some(op) = self.code.get(at) {
            at += 1;
            match op {
                Op::Char(c) => out.push(*c),
                Op::Blank => out.push(' '),
                Op::Split(first, _) => at = *first,
                Op::Jump(to) => at = *to,
                Op::Open(slot) => out.push_str(&word(&self.slots[*slot])),
                // The loop of a slot: `Any` and its way back are passed over.
                Op::Any => at += 2,
                Op::Close(_) => {}
            }
        }
        out.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Returns sentences that fit, at most `most`, the first as [`Self::example`] has it: each of alternatives, with and
    /// without what may be left out, slots filled in by `word`.
    pub(super) fn ways(&self, most: usize, word: impl Fn(&str) -> String) -> Vec<String> {
        let mut found = Vec::new();
        let mut open = vec![(0, String::new())];
        while let Some((at, mut out)) = open.pop() {
            if found.len() == most {
                break;
            }
            let next = match self.code.get(at) {
                None => {
                    found.push(out.split_whitespace().collect::<Vec<_>>().join(" "));
                    continue;
                }
                Some(Op::Split(first, second)) => {
                    open.push((*second, out.clone()));
                    *first
                }
                Some(Op::Jump(to)) => *to,
                Some(Op::Char(c)) => {
                    out.push(*c);
                    at + 1
                }
                Some(Op::Blank) => {
                    out.push(' ');
                    at + 1
                }
                Some(Op::Open(slot)) => {
                    out.push_str(&word(&self.slots[*slot]));
                    at + 1
                }
                // The loop of a slot is passed over.
                Some(Op::Any) => at + 2,
                Some(Op::Close(_)) => at + 1,
            };
            open.push((next, out));
        }
        found
    }
}

/// Whether words that may be a part, such as "two thirds" or "50 per cent full", begin a text.
fn begins_with_share(chars: &[char]) -> bool {
    let text: String = chars.iter().collect();
    let ends = text.match_indices(' ').map(|(at, _)| at).chain([text.len()]);
    ends.take(SHARE_WORDS).any(|end| is_share(&text[..end]))
}

fn wrong(message: impl Into<String>, help: impl Into<String>) -> Wrong {
    Wrong { message: message.into(), help: help.into() }
}

struct Reader<'t> {
    rest: Peekable<Chars<'t>>,
    code: Vec<Op>,
    slots: Vec<String>,
    wholes: Vec<Option<Whole>>,
    words: usize,
}

impl Reader<'_> {
    /// Reads `a|b|c` up to `closing`, and writes code that tries them in turn.
    fn alternatives(&mut self, closing: Option<char>, depth: usize) -> Result<(), Wrong> {
        if depth > MAX_DEPTH {
            return Err(wrong(
                format!("brackets are nested more than {MAX_DEPTH} deep"),
                "write two sentences instead of one",
            ));
        }
        let mut ends = Vec::new();
        loop {
            let split = self.code.len();
            self.code.push(Op::Jump(split + 1));
            let found = self.sequence(closing, depth)?;
            if found != Some('|') {
                if found != closing {
                    let closing = closing.unwrap_or(' ');
                    let open = if closing == ')' { '(' } else { '[' };
                    return Err(wrong(
                        format!("`{open}` is never closed in the sentence"),
                        format!("add `{closing}` where it should end"),
                    ));
                }
                break;
            }
            ends.push(self.code.len());
            self.code.push(Op::Jump(0));
            self.code[split] = Op::Split(split + 1, self.code.len());
        }
        let end = self.code.len();
        for at in ends {
            self.code[at] = Op::Jump(end);
        }
        Ok(())
    }

    /// Reads up to `|`, `closing` or the end, which it returns.
    fn sequence(&mut self, closing: Option<char>, depth: usize) -> Result<Option<char>, Wrong> {
        while let Some(c) = self.rest.next() {
            match c {
                '|' => return Ok(Some('|')),
                c if Some(c) == closing => return Ok(Some(c)),
                '(' => self.alternatives(Some(')'), depth + 1)?,
                '[' => {
                    let split = self.code.len();
                    self.code.push(Op::Jump(0));
                    self.alternatives(Some(']'), depth + 1)?;
                    self.code[split] = Op::Split(split + 1, self.code.len());
                }
                ')' | ']' => {
                    return Err(wrong(
                        format!("`{c}` closes nothing in the sentence"),
                        format!("remove this `{c}`, or open it earlier"),
                    ));
                }
                '{' => self.slot()?,
                '}' => {
                    return Err(wrong(
                        "`}` closes nothing in the sentence",
                        "a slot is written `{name}`",
                    ));
                }
                c if c.is_whitespace() => {
                    if self.code.last() != Some(&Op::Blank) {
                        self.code.push(Op::Blank);
                    }
                }
                c => {
                    self.words += 1;
                    self.code.extend(c.to_lowercase().map(Op::Char));
                }
            }
        }
        Ok(None)
    }

    fn slot(&mut self) -> Result<(), Wrong> {
        let form = || wrong("a slot is the name of a parameter in braces", "write it as `{name}`");
        let mut inside = String::new();
        loop {
            match self.rest.next() {
                Some('}') => break,
                Some(c) if c != '{' => inside.push(c),
                _ => return Err(form()),
            }
        }
        let (name, whole) = match inside.split_once(" of ") {
            None => (inside, None),
            Some((name, all)) => {
                let (all, less) = match all.split_once(" less ") {
                    None => (all, None),
                    Some((all, less)) => (all, Some(less.trim().to_owned())),
                };
                (name.to_owned(), Some(Whole { all: all.trim().to_owned(), less }))
            }
        };
        if name.chars().any(|c| !c.is_alphanumeric() && c != '_') {
            return Err(form());
        }
        if name.is_empty() {
            return Err(wrong("a slot has no name", "write it as `{name}`"));
        }
        if self.slots.contains(&name) {
            return Err(wrong(
                format!("`{{{name}}}` stands in the sentence twice"),
                "each slot is filled once",
            ));
        }
        self.slots.push(name);
        self.wholes.push(whole);
        let slot = self.slots.len() - 1;
        self.code.push(Op::Open(slot));
        // As few characters as do: what follows the slot is looked for first.
        let again = self.code.len();
        self.code.push(Op::Any);
        self.code.push(Op::Split(again + 2, again));
        self.code.push(Op::Close(slot));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fits(template: &str, sentence: &str) -> Option<Vec<(String, String)>> {
        let found = Template::read(template).unwrap().fit(sentence, Reach::Short)?;
        Some(found.into_iter().collect())
    }

    #[test]
    fn alternatives_options_and_slots_fit_as_read() {
        const POUR: &str = "pour [water|juice] from [the] {source} [in]to [the] {target}";
        let both =
            |a: &str, b: &str| Some(vec![("source".into(), a.into()), ("target".into(), b.into())]);
        assert_eq!(fits(POUR, "pour from jar to cup"), both("jar", "cup"));
        assert_eq!(
            fits(POUR, "pour water from the transparent jar into the blue cup"),
            both("transparent jar", "blue cup")
        );
        assert_eq!(fits(POUR, "pour milk from jar to cup"), None);
        assert_eq!(fits(POUR, "pour from jar to"), None);
        assert_eq!(
            fits("(pick|grab) [up] {o}", "grab the jar"),
            Some(vec![("o".into(), "the jar".into())])
        );
        assert_eq!(fits("open", "open"), Some(vec![]));
        assert_eq!(fits("open [it]", "opened"), None);
    }

    #[test]
    fn a_slot_may_say_what_it_is_a_part_of() {
        let template = Template::read("fill {o} {amount of capacity(o) less filled(o)}").unwrap();
        assert_eq!(template.slots(), ["o", "amount"]);
        let whole = template.whole("amount").unwrap();
        assert_eq!((whole.all.as_str(), whole.less.as_deref()), ("capacity(o)", Some("filled(o)")));
        assert_eq!(template.whole("o"), None);
        let found = template.fit("fill red cup half full", Reach::Short).unwrap();
        assert_eq!((&*found["o"], &*found["amount"]), ("red cup", "half full"));
        assert_eq!(template.fit("fill red cup please", Reach::Short), None);
    }

    #[test]
    fn what_is_no_template_says_why() {
        for text in [
            "pick (up {o}",
            "pick [up {o}",
            "pick) {o}",
            "{o",
            "{}",
            "{o}",
            "{a} x {a}",
            "{a b} x",
            "a } b",
            "",
            "[ ]",
        ] {
            assert!(Template::read(text).is_err(), "{text}");
        }
        let deep = format!("{}a{}", "(".repeat(20), ")".repeat(20));
        assert!(Template::read(&deep).is_err());
    }

    /// Nested options over a long sentence: a matcher that tries every way would not come back.
    #[test]
    fn a_hard_template_is_still_quick() {
        let template = "[a] ".repeat(40) + "{x} b";
        let sentence = "a ".repeat(80) + "c";
        assert_eq!(Template::read(&template).unwrap().fit(&sentence, Reach::Short), None);
    }

    #[test]
    fn an_example_takes_the_first_way() {
        let template = Template::read("(pick|grab) [up] [the] {o}").unwrap();
        assert_eq!(template.example(|slot| format!("<{slot}>")), "pick up the <o>");
    }

    #[test]
    fn every_way_to_say_it_is_found_up_to_a_limit() {
        let template = Template::read("(pick|grab) [up] {o}").unwrap();
        let ways = template.ways(9, |_| "it".into());
        assert_eq!(ways, ["pick up it", "pick it", "grab up it", "grab it"]);
        let many = Template::read(&("[a] ".repeat(40) + "b")).unwrap();
        assert_eq!(many.ways(16, |_| String::new()).len(), 16);
    }
}
