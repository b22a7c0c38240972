//! Statements out of lines: several lines of one call, prompts that were pasted with a transcript.

use std::collections::VecDeque;

use crate::language;

/// The prompts that a pasted line may begin with.
const PROMPTS: &[&str] = &["lab>", "twin>", "real>", "kortex>", "y/n>"];
/// What a line that goes on is asked for with, and begins with in a transcript.
pub(super) const MORE: &str = " ... ";

/// Returns what follows a prompt, when the line begins with one.
fn after_prompt(line: &str) -> Option<&str> {
    let line = line.trim_start();
    PROMPTS.iter().find_map(|prompt| line.strip_prefix(prompt)).map(str::trim_start)
}

/// Returns a line without what it begins with in a transcript when it goes on; blanks at its end may have been lost.
fn after_more(line: &str) -> &str {
    if line.trim_end() == MORE.trim_end() { "" } else { line.strip_prefix(MORE).unwrap_or(line) }
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

/// Whether a line ends the statement that is open before it, instead of going on with it: an empty one, unless a block is open,
/// and one that no statement has inside, a command or a question.
pub(super) fn ends(open: &str, line: &str) -> bool {
    let line = after_more(line).trim();
    if line.is_empty() {
        return !language::is_in_block(open);
    }
    line.starts_with([':', '?']) || after_prompt(line).is_some()
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
    /// Statements that are over.
    over: VecDeque<String>,
    /// Whether the input is a transcript: its first line began with a prompt.
    transcript: Option<bool>,
}

impl Lines {
    /// Takes a line.
    pub(super) fn push(&mut self, line: &str) {
        let is_transcript = *self.transcript.get_or_insert_with(|| after_prompt(line).is_some());
        let is_open = !self.statement.is_empty();
        let is_end = is_open && ends(&self.statement, line);
        if is_end {
            self.over.push_back(std::mem::take(&mut self.statement));
        }
        let line = match after_prompt(line) {
            Some(rest) if is_end || !is_open => rest,
            _ if is_transcript && !is_open => return,
            _ if is_transcript => after_more(line),
            _ => line,
        };
        if is_end && line.trim().is_empty() {
            return;
        }
        self.statement += line;
        self.statement.push('\n');
        if !is_incomplete(&self.statement) {
            self.over.push_back(std::mem::take(&mut self.statement));
        }
    }

    /// Returns the next statement that is over.
    pub(super) fn take(&mut self) -> Option<String> {
        self.over.pop_front()
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
        let mut found = Vec::new();
        for line in text.lines() {
            lines.push(line);
            while let Some(statement) = lines.take() {
                found.push(statement.trim().to_owned());
            }
        }
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

    /// `pour(jar, cup` swallowed all that was typed after it, `:quit` as well.
    #[test]
    fn an_open_parenthesis_is_ended_by_an_empty_line_a_command_or_a_question() {
        let typed = ["pour(jar, cup", ":objects", "1+1"];
        assert_eq!(all("pour(jar, cup\n:objects\n1+1\n"), typed);
        assert_eq!(all("pour(jar, cup\n\n:objects\n1+1\n"), typed);
        assert_eq!(all("pour(\n  ?pour\n"), ["pour(", "?pour"]);
        assert_eq!(all("pick(jar) then\n\nplace(jar)\n"), ["pick(jar) then", "place(jar)"]);
        // What is typed over several lines goes on, and in a block an empty line is one of it.
        assert_eq!(all("pour(jar,\n  cup)\n:objects\n"), ["pour(jar,\n  cup)", ":objects"]);
        let block = "task peek() {\n    look()\n\n    look()\n}";
        assert_eq!(all(&format!("{block}\n1+1")), [block, "1+1"]);
        // Else the steps after it would be carried out one by one.
        let open = "task peek() {\n    pour(jar, cup\n\n    place(jar)\n}";
        assert_eq!(all(&format!("{open}\n1+1")), [open, "1+1"]);
        assert_eq!(all("task peek() {\n:quit"), ["task peek() {", ":quit"]);
    }

    #[test]
    fn a_transcript_of_a_statement_that_was_ended_is_read_as_it_was_typed() {
        let typed = ["pour(jar, cup", "1+1"];
        for more in [" ... ", " ..."] {
            let shown = format!("lab> pour(jar, cup\n{more}\n`(` is never closed\nlab> 1+1\n2");
            assert_eq!(all(&shown), typed);
        }
        assert_eq!(all("lab> pour(jar, cup\nlab> 1+1\n2\n"), typed);
        let shown = "lab> pour(jar, cup\n ... :objects\n`(` is never closed\njar\n";
        assert_eq!(all(shown), ["pour(jar, cup", ":objects"]);
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
