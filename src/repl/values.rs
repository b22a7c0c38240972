//! Names that the prompt remembers: `let dose = 40 mL`, and `it`, the object of the last call.
//!
//! A name stands for its text wherever it is typed as a value, and what the line comes to is shown; so
//! what runs, what is recorded and what `:save` writes needs no prompt to be understood.

use std::collections::BTreeMap;

use crate::language::{TokenKind, tokens};

/// What the prompt remembers.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub(super) struct Values {
    named: BTreeMap<String, String>,
    it: Option<String>,
}

impl Values {
    /// Gives a name to a value, as text of the language.
    pub(super) fn set(&mut self, name: &str, value: String) {
        self.named.insert(name.to_owned(), value);
    }

    /// Lets `it` be an object.
    pub(super) fn set_it(&mut self, object: String) {
        self.it = Some(object);
    }

    /// Returns what `it` is.
    pub(super) fn it(&self) -> Option<&str> {
        self.it.as_deref()
    }

    /// Returns the names in order, with their values.
    pub(super) fn all(&self) -> impl Iterator<Item = (&str, &str)> {
        self.named.iter().map(|(name, value)| (name.as_str(), value.as_str()))
    }

    fn value(&self, word: &str) -> Option<&str> {
        match word {
            "it" => self.it(),
            word => self.named.get(word).map(String::as_str),
        }
    }

    /// Returns a line with every name put in; `None` when it has none.
    ///
    /// What is called, the name of an argument (`amount:`), what stands in quotes or in a note, and a unit
    /// behind its number are left alone.
    pub(super) fn fill(&self, line: &str) -> Option<String> {
        let tokens = tokens(line);
        let mut filled = String::new();
        let mut from = 0;
        for (i, token) in tokens.iter().enumerate() {
            let next = tokens.get(i + 1).map_or("", |next| next.text(line));
            let is_unit = i > 0 && tokens[i - 1].kind == TokenKind::Number;
            if token.kind != TokenKind::Word || matches!(next, "(" | ":") || is_unit {
                continue;
            }
            let Some(value) = self.value(token.text(line)) else { continue };
            filled += &line[from..token.from];
            filled += value;
            from = token.to;
        }
        if from == 0 {
            return None;
        }
        filled += &line[from..];
        Some(filled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_put_in_as_values_and_nowhere_else() {
        let mut values = Values::default();
        values.set("dose", "40 mL".into());
        values.set("mL", "3".into());
        values.set_it("jar".into());
        let fill = |line: &str| values.fill(line);
        assert_eq!(fill("pour(it, cup, amount: dose)").unwrap(), "pour(jar, cup, amount: 40 mL)");
        assert_eq!(fill("pour(jar, cup, dose: 5 mL)"), None);
        assert_eq!(fill("dose(jar)"), None);
        assert_eq!(fill("say(\"it\") // it"), None);
        assert_eq!(fill("put it down").unwrap(), "put jar down");
        assert_eq!(Values::default().fill("place(it)"), None);
    }
}
