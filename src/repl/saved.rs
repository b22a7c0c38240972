//! `:save`: the calls of a session as a script that `trueup run` takes.
//!
//! What was done is a step of the script. What was stopped, or failed, is a remark in its place: nobody wants it made
//! again, and whoever reads the script sees that it was tried.

use std::fmt::Write as _;
use std::path::Path;

use crate::files::write;
use crate::report::Failure;
use crate::workcell::Ending;

use super::Session;

/// A call that was begun, and how it ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Made {
    /// As typed, names filled in; of several lines, perhaps.
    pub(super) call: String,
    pub(super) ending: Ending,
}

impl Made {
    /// The call as a remark of one line: `stopped: pour(jar, cup)`.
    fn remark(&self) -> String {
        let how = match self.ending {
            Ending::Success | Ending::Unconfirmed => "done",
            Ending::Failure => "failed",
            Ending::Stopped => "stopped",
            Ending::Unavailable => "not available",
        };
        let call: Vec<&str> = self.call.split_whitespace().collect();
        format!("{how}: {}", call.join(" "))
    }
}

/// Returns the text of a script of these calls.
fn script(made: &[Made]) -> String {
    let mut text = String::from("// Calls made at the prompt, in their order.\n\n");
    for made in made {
        if made.ending.is_done() {
            text.push_str(&made.call);
            text.push('\n');
        } else {
            let _ = writeln!(text, "// {}", made.remark());
        }
    }
    text
}

impl Session<'_, '_> {
    /// Writes the calls of this session as a script that `trueup run` takes.
    pub(super) fn save(&mut self, file: &str) -> Result<(), Failure> {
        if file.is_empty() {
            return Err(
                Failure::input("repl::save", "`:save` takes a file").help("`:save breakfast.task`")
            );
        }
        let left: Vec<String> =
            self.made.iter().filter(|made| !made.ending.is_done()).map(Made::remark).collect();
        let count = self.made.len() - left.len();
        if self.made.is_empty() {
            return Err(Failure::input("repl::save", "nothing has been run yet")
                .help("calls that were run are saved, in order"));
        }
        if count == 0 {
            let words = format!("no call was done to its end ({})", left.join("; "));
            return Err(Failure::input("repl::save", words)
                .help("calls that were done are saved, in order"));
        }
        let path = Path::new(file);
        let refused = |why: String| Failure::input("io::write", why).at(file);
        if path.exists() {
            return Err(refused("there is such a file already".into()).help("name another"));
        }
        let text = script(&self.made);
        write::replace(path, &text).map_err(|error| Failure::unwritten(path, &error))?;
        self.edits.made(":save", path, None, &text);
        let (calls, them) = if count == 1 { ("call", "it") } else { ("calls", "them") };
        let mut told = format!("{count} {calls} in {file}; `trueup run {file}` makes {them} again");
        if !left.is_empty() {
            let _ = write!(told, "\nonly a remark there: {}", left.join("; "));
        }
        self.style.say(told);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A call that was stopped, and one that failed for it, had been written as if they had been made.
    #[test]
    fn what_was_not_done_is_a_remark_of_one_line() {
        let made = |call: &str, ending| Made { call: call.into(), ending };
        let text = script(&[
            made("pick(jar)", Ending::Success),
            made("pour(jar,\n     cup)", Ending::Stopped),
            made("place(jar)", Ending::Failure),
            made("look()", Ending::Unconfirmed),
        ]);
        let expected = "// Calls made at the prompt, in their order.\n\npick(jar)\n\
                        // stopped: pour(jar, cup)\n// failed: place(jar)\nlook()\n";
        assert_eq!(text, expected);
        let (program, wrong) = crate::language::parse(&text);
        assert!(wrong.is_empty(), "{wrong:?}");
        assert_eq!(program.items.len(), 2);
    }
}
