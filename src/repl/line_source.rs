//! Where lines come from: a terminal with an editor, or a pipe. Both give whole statements, one at a time.

use std::collections::VecDeque;
use std::fs;
use std::io::{self, BufRead};
use std::path::PathBuf;

use rustyline::error::ReadlineError;
use rustyline::history::DefaultHistory;
use rustyline::{Config, Editor};

use crate::files;
use crate::language;
use crate::report::{self, Failure};

use super::complete::Helper;
use super::paste;

/// What was typed.
pub(super) enum Typed {
    /// A statement, of as many lines as it needs.
    Statement(String),
    /// Ctrl-C.
    Interrupted,
    /// Nothing more comes.
    End,
}

/// Someone who types.
pub(super) trait LineSource {
    /// Returns whether it is a person at a terminal, who can be waited for.
    fn is_person(&self) -> bool;

    /// Is told whether words of stepping are taken from now on.
    fn stepping(&mut self, _on: bool) {}

    /// Forgets what was typed ahead: it was meant for an arm that had not been stopped, or before a question was seen.
    /// Returns whether a line of it is known of.
    fn forget(&mut self) -> bool {
        false
    }

    /// Waits for the next statement.
    ///
    /// # Errors
    ///
    /// When the lines cannot be read any more.
    fn next(&mut self, prompt: &str) -> Result<Typed, Failure>;
}

/// Lines of history that are kept.
const MOST_LINES: usize = 2000;

/// A person at a terminal; the history is kept after every line. The editor keeps what is typed while a line is carried
/// out, for the lines after it.
pub(super) struct Terminal {
    editor: Editor<Helper, DefaultHistory>,
    history: Option<PathBuf>,
    /// Statements that were typed or pasted together and are not done yet.
    pasted: VecDeque<String>,
}

fn broken(error: &ReadlineError) -> Failure {
    Failure::unavailable("terminal", format!("the terminal failed: {error}"))
}

/// Says how a statement is ended that goes on with another line.
fn tell_how_it_ends(open: &str) {
    report::complain(if language::is_in_block(open) {
        "a block is open: go on, or leave it with Ctrl-C"
    } else {
        "the line is not over: go on, or end it with an empty line"
    });
}

/// Returns an editor for the terminal in which nothing has been typed yet.
fn editor(
    helper: Helper,
    history: DefaultHistory,
) -> rustyline::Result<Editor<Helper, DefaultHistory>> {
    let config = Config::builder().max_history_size(MOST_LINES)?.build();
    let mut editor = Editor::with_history(config, history)?;
    editor.set_helper(Some(helper));
    Ok(editor)
}

impl Terminal {
    /// Takes the terminal.
    ///
    /// # Errors
    ///
    /// When the terminal itself fails.
    pub(super) fn new(helper: Helper, history: Option<PathBuf>) -> Result<Self, Failure> {
        let mut editor = editor(helper, DefaultHistory::new()).map_err(|error| broken(&error))?;
        if let Some(path) = &history {
            // A missing history is an empty one.
            let _ = editor.load_history(path);
        }
        Ok(Self { editor, history, pasted: VecDeque::new() })
    }

    /// Adds a statement to the history, as one, and keeps it: a program that is ended from outside has no later moment for it.
    fn remember(&mut self, statement: &str) {
        let statement = statement.trim_end();
        if !statement.is_empty() {
            // A history that takes nothing more is no reason to leave a line undone.
            let _ = self.editor.add_history_entry(statement);
            self.keep_history();
        }
    }

    /// Keeps the history, whole or not at all: the editor would empty the file before it writes.
    fn keep_history(&mut self) {
        let Some(path) = self.history.clone() else { return };
        let half = path.with_extension(format!("{}.part", std::process::id()));
        let saved = self.editor.save_history(&half).map_err(|error| match error {
            ReadlineError::Io(error) => error,
            error => io::Error::other(error),
        });
        let kept = saved.and_then(|()| match fs::File::open(&half) {
            // Nothing new was typed.
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            file => file.and_then(|file| file.sync_all()).and_then(|()| {
                fs::rename(&half, fs::canonicalize(&path).as_ref().unwrap_or(&path))
            }),
        });
        if let Err(error) = kept {
            let _ = fs::remove_file(&half);
            let why = Failure::unwritten(&path, &error).message;
            report::complain(&format!("what is typed is not kept any more: {why}"));
            // Said once, not after every line.
            self.history = None;
        }
    }
}

impl LineSource for Terminal {
    fn is_person(&self) -> bool {
        true
    }

    fn stepping(&mut self, on: bool) {
        if let Some(helper) = self.editor.helper_mut() {
            helper.steps = on;
        }
    }

    fn forget(&mut self) -> bool {
        let was_any = files::read::forget_typed() || !self.pasted.is_empty();
        self.pasted.clear();
        let Some(helper) = self.editor.helper().cloned() else { return was_any };
        let history = std::mem::take(self.editor.history_mut());
        // Only a new editor has nothing typed into it. A terminal that fails does so at the next line as well.
        match editor(helper, history) {
            Ok(fresh) => self.editor = fresh,
            Err(error) => report::complain(&broken(&error).message),
        }
        was_any
    }

    fn next(&mut self, prompt: &str) -> Result<Typed, Failure> {
        if let Some(statement) = self.pasted.pop_front() {
            return Ok(Typed::Statement(statement));
        }
        let (mut open, mut is_told) = (String::new(), false);
        loop {
            if let Some(helper) = self.editor.helper_mut() {
                helper.open.clone_from(&open);
            }
            let shown = if open.is_empty() { prompt } else { paste::MORE };
            let line = match self.editor.readline(shown) {
                Ok(line) => line,
                Err(ReadlineError::Interrupted) => {
                    self.pasted.clear();
                    return Ok(Typed::Interrupted);
                }
                Err(ReadlineError::Eof) if open.is_empty() => return Ok(Typed::End),
                // Ctrl-D ends the statement first.
                Err(ReadlineError::Eof) => {
                    self.remember(&open);
                    return Ok(Typed::Statement(open));
                }
                Err(error) => return Err(broken(&error)),
            };
            if !open.is_empty() && paste::ends(&open, &line) {
                self.remember(&open);
                self.pasted.push_back(std::mem::take(&mut open));
                if line.trim().is_empty() {
                    break;
                }
            }
            open += &line;
            if !paste::is_incomplete(&open) {
                self.remember(&open);
                self.pasted.extend(paste::statements(&open));
                break;
            }
            // At every statement that is left open, and not after each of its lines.
            if !std::mem::replace(&mut is_told, true) {
                tell_how_it_ends(&open);
            }
            open.push('\n');
        }
        Ok(Typed::Statement(self.pasted.pop_front().unwrap_or_default()))
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.keep_history();
    }
}

/// Lines that come from anywhere.
pub(super) struct Pipe<'a> {
    input: &'a mut dyn BufRead,
    lines: paste::Lines,
}

impl<'a> Pipe<'a> {
    /// Reads these lines.
    pub(super) fn new(input: &'a mut dyn BufRead) -> Self {
        Self { input, lines: paste::Lines::default() }
    }
}

impl LineSource for Pipe<'_> {
    fn is_person(&self) -> bool {
        false
    }

    fn next(&mut self, _: &str) -> Result<Typed, Failure> {
        loop {
            if let Some(statement) = self.lines.take() {
                return Ok(Typed::Statement(statement));
            }
            let line = files::read::line(self.input).map_err(|error| {
                Failure::input("io::read", format!("cannot read input: {error}"))
            })?;
            if line.is_empty() {
                let rest = std::mem::take(&mut self.lines).rest();
                return Ok(rest.map_or(Typed::End, Typed::Statement));
            }
            self.lines.push(line.trim_end_matches(['\n', '\r']));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::Library;
    use crate::report::Style;

    #[test]
    fn what_was_typed_ahead_is_forgotten_and_the_history_is_not() {
        let library = Library::standard();
        let scope = library.scope(library.default_scene());
        let style = Style { json: false, quiet: false, verbose: false, colour: false, bars: false };
        let mut terminal = Terminal::new(Helper::new(library, scope, style), None).unwrap();
        terminal.editor.add_history_entry("pour(jar, cup)").unwrap();
        terminal.pasted.push_back("place(jar)".into());
        terminal.stepping(true);
        assert!(terminal.forget());
        assert!(terminal.pasted.is_empty());
        assert_eq!(terminal.editor.history().iter().collect::<Vec<_>>(), ["pour(jar, cup)"]);
        assert!(terminal.editor.helper().is_some_and(|helper| helper.steps));
    }
}
