//! Statements out of lines: several lines of one call, prompts that were pasted with a transcript.

use crate::language;

/// The prompts that a pasted line may begin with.
const PROMPTS: &[&str] = &["lab>", "twin>", "real>", "kortex>", "y/n>"];
/// What a line that goes on begins with in a transcript.
const MORE: &str = " ... ";

/// Returns what follows a prompt, when the line begins with one.
fn after_prompt(line: &str) -> Option<&str> {
    let line = line.trim_start();
    PROMPTS.iter().find_map(|prompt| line.strip_prefix(prompt)).map(str::trim_start)
}

/// Returns a statement without the notes before it: at the prompt `///` documents nothing, and is one as `//` is.
pub(super) fn without_notes(statement: &str) -> &str {
    let mut rest = statement.trim_start();
    while rest.starts_with("//") {
        rest = rest.split_once('\n').map_or("", |(_, after)| after.trim_start());
    }
    rest
}

/// Whether a statement needs more lines.
pub(super) fn is_incomplete(statement: &str) -> bool {
    let statement = without_notes(statement);
    let is_command = statement.trim_start().starts_with([':', '?', '!']);
    !is_command && after_prompt(statement).is_none() && language::is_incomplete(statement)
}

/// Returns the statements in what was typed or pasted at once. Of a transcript, whose first line begins
/// with a prompt, only what was typed counts: its answers are passed over.
pub(super) fn statements(text: &str) -> Vec<String> {
    if after_prompt(text.lines().next().unwrap_or_default()).is_none() {
        return vec![text.trim().to_owned()];
    }
    let mut found: Vec<String> = Vec::new();
    for line in text.lines() {
        if let Some(first) = after_prompt(line) {
            found.push(first.to_owned());
        } else if let (Some(more), Some(last)) = (line.strip_prefix(MORE), found.last_mut()) {
            last.push('\n');
            *last += more;
        }
    }
    found
}

/// Puts statements together from the lines of a pipe.
#[derive(Default)]
pub(super) struct Lines {
    statement: String,
    /// Whether the input is a transcript: its first line began with a prompt.
    transcript: Option<bool>,
}

impl Lines {
    /// Takes a line; returns the statement it completes.
    pub(super) fn push(&mut self, line: &str) -> Option<String> {
        let is_transcript = *self.transcript.get_or_insert_with(|| after_prompt(line).is_some());
        let begins = self.statement.is_empty();
        let line = match after_prompt(line) {
            Some(rest) if begins => rest,
            _ if is_transcript && begins => return None,
            _ if is_transcript => line.strip_prefix(MORE).unwrap_or(line),
            _ => line,
        };
        self.statement += line;
        self.statement.push('\n');
        if is_incomplete(&self.statement) {
            return None;
        }
        Some(std::mem::take(&mut self.statement))
    }

    /// Returns what was begun and never completed.
    pub(super) fn rest(self) -> Option<String> {
        (!self.statement.trim().is_empty()).then_some(self.statement)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<String> {
        let mut lines = Lines::default();
        let mut found: Vec<String> =
            text.lines().filter_map(|line| lines.push(line)).map(|s| s.trim().to_owned()).collect();
        found.extend(lines.rest());
        found
    }

    #[test]
    fn of_a_transcript_only_what_was_typed_counts() {
        let transcript = "lab> :tasks\npick(o: Graspable)\nlab> pour(jar,\n ...   cup)\ndone\n";
        let typed = [":tasks", "pour(jar,\n  cup)"];
        assert_eq!(all(transcript), typed);
        assert_eq!(statements(transcript), typed);
    }

    #[test]
    fn a_note_before_a_statement_is_a_line_of_its_own() {
        assert_eq!(without_notes("/// Pour all.\n// of it\n pick(jar)\n"), "pick(jar)\n");
        assert_eq!(without_notes("/// Pour all."), "");
        assert_eq!(all("/// Pour all.\npick(jar)\n"), ["/// Pour all.", "pick(jar)"]);
        assert!(!is_incomplete("/// Pour all.\n:help ("));
        assert!(is_incomplete("/// Peek.\ntask peek() {"));
    }

    #[test]
    fn without_a_prompt_at_its_start_every_line_counts() {
        assert_eq!(all(":tasks\npick(jar)\n"), [":tasks", "pick(jar)"]);
        assert_eq!(all("pour(jar,\n"), ["pour(jar,\n"]);
        assert_eq!(statements("pour(jar,\n  cup)"), ["pour(jar,\n  cup)"]);
        // A prompt that comes later is taken off, and the lines after it still count.
        assert_eq!(all(":tasks\nlab> :help\n:runs"), [":tasks", ":help", ":runs"]);
    }
}
