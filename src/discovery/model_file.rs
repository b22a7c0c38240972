//! A `twin` block as text: the effects it knows, and new ones added where a person would write them.
//!
//! Nothing but the new lines changes: comments, order and layout stay. Text in, text out; the caller reads
//! and writes the file.

use std::fmt::Write as _;

use super::finding::ParameterEstimate;
use crate::language::ast::{EffectItem, Item, TwinItem};
use crate::language::{self, Diagnostic};
use crate::units::significant;

/// Lines shown before and after a change.
const CONTEXT: usize = 3;

/// What is wrong with a model file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The text has mistakes.
    #[error("the model file has mistakes")]
    Mistakes(Vec<Diagnostic>),
    /// There is no `twin` in it.
    #[error("the model file has no `twin`")]
    NoTwin,
}

/// A model file with a twin.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFile {
    text: String,
    twin: TwinItem,
}

impl ModelFile {
    /// Reads the text of a model file; of several twins, the first counts.
    ///
    /// # Errors
    ///
    /// [`Error`].
    pub fn read(text: &str) -> Result<Self, Error> {
        let (program, diagnostics) = language::parse(text);
        if diagnostics.iter().any(Diagnostic::is_error) {
            return Err(Error::Mistakes(diagnostics));
        }
        let twin = program.items.into_iter().find_map(|item| match item {
            Item::Twin(twin) => Some(twin),
            _ => None,
        });
        Ok(Self { text: text.to_owned(), twin: twin.ok_or(Error::NoTwin)? })
    }

    /// Returns the text as it was read.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the name of the scene that the twin is of.
    pub fn scene(&self) -> &str {
        &self.twin.of.text
    }

    /// Returns the effects the twin knows.
    pub fn effects(&self) -> &[EffectItem] {
        &self.twin.effects
    }

    /// Returns the text with these lines at the end of the twin, under a comment that says where they
    /// come from.
    #[must_use]
    pub fn with(&self, lines: &[String], provenance: &str) -> String {
        if lines.is_empty() {
            return self.text.clone();
        }
        // The span ends with the closing brace.
        let close = self.twin.span.from
            + self.text[self.twin.span.from..self.twin.span.to].rfind('}').unwrap_or(0);
        let (before, after) = self.text.split_at(close);
        // As the line of the closing brace is indented, and one step more.
        let start = before.rfind('\n').map_or(0, |at| at + 1);
        let outer: String = before[start..].chars().take_while(|c| c.is_whitespace()).collect();
        let own_line = before[start..].trim().is_empty();
        let mut text =
            if own_line { before[..start].to_owned() } else { format!("{}\n", before.trim_end()) };
        let _ = writeln!(text, "{outer}    // {provenance}");
        for line in lines {
            let _ = writeln!(text, "{outer}    {line}");
        }
        text.push_str(&outer);
        text.push_str(after);
        text
    }
}

/// Returns the change from one text to the other as a unified diff with three lines around it.
pub fn diff(name: &str, before: &str, after: &str) -> String {
    let (old, new): (Vec<&str>, Vec<&str>) = (before.lines().collect(), after.lines().collect());
    if old == new {
        return String::new();
    }
    // Lines are only added in one place, so what is common at both ends frames the change.
    let first = old.iter().zip(&new).take_while(|(a, b)| a == b).count();
    let most = old.len().min(new.len()) - first;
    let last =
        old.iter().rev().zip(new.iter().rev()).take(most).take_while(|(a, b)| a == b).count();
    let from = first.saturating_sub(CONTEXT);
    let (old_to, new_to) =
        ((old.len() - last + CONTEXT).min(old.len()), (new.len() - last + CONTEXT).min(new.len()));
    let mut text = format!("--- {name}\n+++ {name}\n");
    let _ = writeln!(text, "@@ -{},{} +{},{} @@", from + 1, old_to - from, from + 1, new_to - from);
    let mut put = |sign: char, lines: &[&str]| {
        for line in lines {
            let _ = writeln!(text, "{sign}{line}");
        }
    };
    put(' ', &old[from..first]);
    put('-', &old[first..old.len() - last]);
    put('+', &new[first..new.len() - last]);
    put(' ', &old[old.len() - last..old_to]);
    text
}

/// Writes the line of a model file that holds an effect.
pub fn line(name: &str, at: &str, estimates: &[ParameterEstimate]) -> String {
    let parameters: Vec<String> = estimates
        .iter()
        .map(|(number, value, std, unit)| {
            // Digits enough that rounding is far below the uncertainty.
            let digits = if *std > 0.0 && value.abs() > 0.0 {
                ((value.abs() / std).log10().ceil() as i32 + 2).clamp(3, 9) as usize
            } else {
                6
            };
            let space = if unit.is_empty() { "" } else { " " };
            let value = significant(*value, digits);
            if *std > 0.0 && std.is_finite() {
                let std = significant(*std, 2);
                format!("{number} = {value}{space}{unit} +- {std}{space}{unit}")
            } else {
                format!("{number} = {value}{space}{unit}")
            }
        })
        .collect();
    format!("effect {name}({at}) {{ {} }}", parameters.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "\
// Ours since spring.
twin kitchen_twin of kitchen {
    effect coulomb_friction(joint_4) { torque = 1.83 N*m }   // by hand
}

/// Another thing.
fluent far(o: Object) = true
";

    #[test]
    fn lines_are_added_and_nothing_else_changes() {
        let file = ModelFile::read(FILE).unwrap();
        assert_eq!(file.effects().len(), 1);
        let line = "effect payload(tool) { mass = 0.5 kg, com_x = 0.01 m }".to_owned();
        let after = file.with(&[line], "found by gap");
        let gone: Vec<&str> = FILE.lines().filter(|l| !after.lines().any(|a| a == *l)).collect();
        assert_eq!(gone, [""; 0], "every old line is still there");
        let again = ModelFile::read(&after).unwrap();
        assert_eq!(again.effects().len(), 2);
        assert_eq!(again.effects()[1].parameters[0].name.text, "mass");
        let diff = diff("kitchen.task", FILE, &after);
        let added: Vec<&str> = diff.lines().filter(|l| l.starts_with("+ ")).collect();
        assert_eq!(
            added,
            ["+    // found by gap", "+    effect payload(tool) { mass = 0.5 kg, com_x = 0.01 m }"]
        );
        assert!(diff.contains("@@ -1,6 +1,8 @@"), "{diff}");
    }

    #[test]
    fn a_twin_on_one_line_is_opened() {
        let file = ModelFile::read("twin t of s { }\n").unwrap();
        let after = file.with(&["effect base_tilt(base) { roll = 1 deg }".into()], "found");
        assert_eq!(ModelFile::read(&after).unwrap().effects().len(), 1, "{after}");
    }

    #[test]
    fn a_file_without_a_twin_is_refused() {
        assert_eq!(ModelFile::read("task t() { }").unwrap_err(), Error::NoTwin);
        assert!(matches!(ModelFile::read("twin {"), Err(Error::Mistakes(_))));
    }
}
