//! Long lines folded at blanks, so that a terminal does not cut words. What a line says is its caller's.
//!
//! How wide the terminal is it says itself, each time, for a person may change it. What goes to a file or to another
//! program is left as it is.

use std::borrow::Cow;
use std::io::IsTerminal;
#[cfg(unix)]
use std::os::fd::AsFd;

/// Columns of the narrowest terminal that is promised to be readable, and as many as a line of sentences has on a wider one.
const COLUMNS: usize = 80;
/// Columns of the narrowest terminal that is folded for. Chosen: a word and the indentation before it have room.
#[cfg(unix)]
const NARROWEST: usize = 20;
/// What stands in columns begins at most so far to the right; further on two blanks only part sentences.
const HANGING: usize = 28;

/// Returns how many columns the terminal behind a stream has; `None` where there is none, or it does not say.
#[cfg(unix)]
pub(super) fn columns(stream: &(impl IsTerminal + AsFd)) -> Option<usize> {
    let size = stream.is_terminal().then(|| rustix::termios::tcgetwinsize(stream).ok())??;
    Some(usize::from(size.ws_col)).filter(|columns| *columns >= NARROWEST)
}

/// Terminals of other systems are not asked.
#[cfg(not(unix))]
pub(super) fn columns(_: &impl IsTerminal) -> Option<usize> {
    None
}

/// Folds lines of sentences for a terminal of so many columns, or one that does not say how many.
pub(super) fn sentences(text: &str, columns: Option<usize>) -> String {
    folded(text, columns.map_or(COLUMNS, |columns| columns.min(COLUMNS)))
}

/// Folds what the terminal would cut, if it is one.
pub(super) fn fitted(text: &str, columns: Option<usize>) -> Cow<'_, str> {
    columns.map_or(Cow::Borrowed(text), |columns| Cow::Owned(folded(text, columns)))
}

/// Folds every line of a text that is too long; what is folded begins where the last column of its line does.
fn folded(text: &str, columns: usize) -> String {
    let lines: Vec<String> = text.split('\n').map(|text| line(text, columns)).collect();
    lines.join("\n")
}

fn line(text: &str, columns: usize) -> String {
    if width(text) <= columns {
        return text.to_owned();
    }
    let indent = text.chars().take_while(|c| *c == ' ').count();
    // At least half of the line is for words.
    let hanging = hanging(text, indent).min(columns / 2);
    let mut folded = text[..indent].to_owned();
    let mut at = indent;
    for (n, word) in text[indent..].split(' ').enumerate() {
        let wide = width(word);
        if n > 0 && at + 1 + wide > columns && at > hanging {
            folded.truncate(folded.trim_end_matches(' ').len());
            folded += "\n";
            folded += &" ".repeat(hanging);
            at = hanging;
        } else if n > 0 {
            folded.push(' ');
            at += 1;
        }
        folded += word;
        at += wide;
    }
    folded
}

/// Returns how many columns a text takes: what sets a colour takes none.
fn width(text: &str) -> usize {
    let mut is_colour = false;
    let mut columns = 0;
    for c in text.chars() {
        match c {
            '\x1b' => is_colour = true,
            _ if is_colour => is_colour = c != 'm',
            _ => columns += 1,
        }
    }
    columns
}

/// Returns where the text behind a line's first word begins, if it stands in a column of its own; else the indentation.
fn hanging(text: &str, indent: usize) -> usize {
    let rest = &text[indent..];
    let column = rest.find("  ").map(|gap| {
        let blanks = rest[gap..].chars().take_while(|c| *c == ' ').count();
        indent + width(&rest[..gap]) + blanks
    });
    column.filter(|column| *column <= HANGING).unwrap_or(indent)
}

#[cfg(test)]
mod tests {
    use super::{fitted, folded, sentences};

    #[test]
    fn long_lines_are_folded_at_blanks_below_their_column() {
        let long = format!("  say    \"{}\"\n  short", "fill the cup ".repeat(9).trim_end());
        let lines: Vec<String> = folded(&long, 80).lines().map(str::to_owned).collect();
        assert_eq!(lines.len(), 3, "{lines:?}");
        assert!(lines.iter().all(|line| line.chars().count() <= 80), "{lines:?}");
        assert!(lines[1].starts_with("         ") && lines[2] == "  short", "{lines:?}");
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(words(&lines.join(" ")), words(&long));
        // Colours take no room.
        let row = |head: &str| format!("{head}  needs {}asked after", "visible(jar) ".repeat(4));
        assert_eq!(folded(&row("\x1b[32m✓\x1b[0m"), 80), row("\x1b[32m✓\x1b[0m"));
        assert_eq!(folded(&row("123456789012"), 80).lines().count(), 2);
        // What has no blank stays whole.
        let path = "x".repeat(120);
        assert_eq!(folded(&path, 80), path);
    }
    #[test]
    fn a_narrow_terminal_is_folded_for_and_a_file_is_not() {
        let long = format!("                    needs {}", "visible(jar) ".repeat(9).trim_end());
        let narrow = fitted(&long, Some(40)).into_owned();
        assert!(narrow.lines().all(|line| line.chars().count() <= 40), "{narrow}");
        assert!(narrow.lines().all(|line| line.ends_with("visible(jar)")), "{narrow}");
        assert_eq!(fitted(&long, None), long);
        assert_eq!(fitted(&long, Some(200)), long);
        assert_eq!(fitted("a\n", Some(40)), "a\n");
        // Sentences are no wider on a wide terminal than on one that does not say.
        assert_eq!(sentences(&long, Some(200)), sentences(&long, None));
        assert!(
            sentences(&long, Some(60)).lines().count() > sentences(&long, None).lines().count()
        );
    }
}
