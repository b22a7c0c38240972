//! Long lines folded at blanks, so that a terminal does not cut words. What a line says is its caller's.
//!
//! The rows of a table stay rows: their first column loses the room that it does not need, and where that is not enough, each
//! row has it on a line of its own, with the other columns below.
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
/// What stands below a row's first column is so far to the right of it.
const BELOW: usize = 4;
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
    columns.map_or(Cow::Borrowed(text), |columns| {
        Cow::Owned(folded(&with_narrow_tables(text, columns), columns))
    })
}

/// Makes the tables of a text narrower that are wider than the terminal.
fn with_narrow_tables(text: &str, columns: usize) -> String {
    let lines: Vec<&str> = text.split('\n').collect();
    let mut narrow: Vec<String> = Vec::new();
    let same = |a: &&str, b: &&str| indent(&visible(a)) == indent(&visible(b));
    for block in lines.chunk_by(same) {
        match narrower(block, columns) {
            Some(rows) => narrow.extend(rows),
            None => narrow.extend(block.iter().map(|line| (*line).to_owned())),
        }
    }
    narrow.join("\n")
}

/// Returns lines that are rows of a table, narrower; `None` where they are none, or fit already, or would not fit so either.
fn narrower(rows: &[&str], columns: usize) -> Option<Vec<String>> {
    let shown: Vec<Vec<(usize, char)>> = rows.iter().map(|row| visible(row)).collect();
    let widest = shown.iter().map(Vec::len).max().filter(|widest| *widest > columns)?;
    let is_blank =
        |column: usize| shown.iter().all(|row| row.get(column).is_none_or(|(_, c)| *c == ' '));
    let indent = indent(&shown[0]);
    // The second column: two blanks stand before it in every row.
    let second = (indent + 3..widest)
        .find(|at| is_blank(at - 2) && is_blank(at - 1) && !is_blank(*at))
        .filter(|at| rows.len() > 1 && *at > HANGING)?;
    let first_ends = (indent..second).rev().find(|at| !is_blank(*at))? + 1;
    let squeezed = first_ends + 2;
    let is_squeezed = widest - (second - squeezed) <= columns;
    if !is_squeezed && indent + BELOW + widest - second > columns {
        return None;
    }
    let row = |(text, shown): (&&str, &Vec<(usize, char)>)| {
        let Some((from, _)) = shown.get(second) else { return (*text).to_owned() };
        let (head, rest) = text.split_at(*from);
        if is_squeezed {
            let (head, blanks) = head.split_at(shown[squeezed].0);
            // What sets a colour may stand among them.
            return format!("{head}{}{rest}", blanks.replace(' ', ""));
        }
        format!("{}\n{}{rest}", head.trim_end(), " ".repeat(indent + BELOW))
    };
    Some(rows.iter().zip(&shown).map(row).collect())
}

/// Returns the characters of a text that take a column, with the byte each begins at: what sets a colour takes none.
fn visible(text: &str) -> Vec<(usize, char)> {
    let mut is_colour = false;
    let takes_column = |(_, c): &(usize, char)| {
        let is_part = is_colour || *c == '\x1b';
        is_colour = is_part && *c != 'm';
        !is_part
    };
    text.char_indices().filter(takes_column).collect()
}

/// Returns how many blanks a line begins with.
fn indent(shown: &[(usize, char)]) -> usize {
    shown.iter().take_while(|(_, c)| *c == ' ').count()
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

/// Returns how many columns a text takes.
fn width(text: &str) -> usize {
    visible(text).len()
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

    /// A row's cells were folded into the lines of the next one.
    #[test]
    fn a_table_stays_one_on_a_narrow_terminal() {
        let row = |name: &str, cells: [&str; 4]| {
            let [expected, twin, measured, margin] = cells;
            let line = format!("    {name:<40} {expected:<8} {twin:<4} {measured:<8} {margin}");
            line.trim_end().to_owned()
        };
        let table = |name: &str| {
            let head = row("fluent", ["expected", "twin", "measured", "margin"]);
            let wrong = row(name, ["yes", "yes", "no", "+12.5 mm"]);
            let right = row("held(jar)", ["", "yes", "yes", ""]);
            format!("✓  3  lift(jar)\n\x1b[2m{head}\x1b[0m\n\x1b[31m{wrong}\x1b[0m\n{right}\n")
        };
        let short = table("rests_on(jar, cup)");
        let narrow = fitted(&short, Some(60)).into_owned();
        assert_eq!(narrow.lines().count(), short.lines().count(), "{narrow}");
        assert!(narrow.lines().all(|line| super::width(line) <= 60), "{narrow}");
        assert!(narrow.contains("\x1b[31m    rests_on(jar, cup)  yes      yes  no       +12.5 mm"));
        assert!(narrow.contains("\n    held(jar)                    yes  yes\n"), "{narrow}");
        // A name that leaves no room has a line of its own, and so have the others.
        let long = table("rests_on(jar, left_of(cup, camera))");
        let narrow = fitted(&long, Some(60)).into_owned();
        assert_eq!(narrow.lines().count(), 1 + 2 * 3, "{narrow}");
        assert!(narrow.contains("    fluent\n        expected twin measured margin"), "{narrow}");
        assert!(narrow.ends_with("\n    held(jar)\n                 yes  yes\n"), "{narrow}");
        assert_eq!(fitted(&long, Some(100)), long);
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
