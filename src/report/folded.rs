//! Long lines folded at blanks, so that a terminal does not cut words. What a line says is its caller's.

/// Columns of the narrowest terminal that is promised to be readable.
const COLUMNS: usize = 80;
/// What stands in columns begins at most so far to the right; further on two blanks only part sentences.
const HANGING: usize = 28;

/// Folds every line of a text that is too long; what is folded begins where the last column of its line does.
pub(super) fn folded(text: &str) -> String {
    let lines: Vec<String> = text.lines().map(line).collect();
    lines.join("\n")
}

fn line(text: &str) -> String {
    if width(text) <= COLUMNS {
        return text.to_owned();
    }
    let indent = text.chars().take_while(|c| *c == ' ').count();
    let hanging = hanging(text, indent);
    let mut folded = text[..indent].to_owned();
    let mut at = indent;
    for (n, word) in text[indent..].split(' ').enumerate() {
        let wide = width(word);
        if n > 0 && at + 1 + wide > COLUMNS && at > hanging {
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
    use super::folded;

    #[test]
    fn long_lines_are_folded_at_blanks_below_their_column() {
        let long = format!("  say    \"{}\"\n  short", "fill the cup ".repeat(9).trim_end());
        let lines: Vec<String> = folded(&long).lines().map(str::to_owned).collect();
        assert_eq!(lines.len(), 3, "{lines:?}");
        assert!(lines.iter().all(|line| line.chars().count() <= 80), "{lines:?}");
        assert!(lines[1].starts_with("         ") && lines[2] == "  short", "{lines:?}");
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(words(&lines.join(" ")), words(&long));
        // Colours take no room.
        let row = |head: &str| format!("{head}  needs {}asked after", "visible(jar) ".repeat(4));
        assert_eq!(folded(&row("\x1b[32m✓\x1b[0m")), row("\x1b[32m✓\x1b[0m"));
        assert_eq!(folded(&row("123456789012")).lines().count(), 2);
        // What has no blank stays whole.
        let path = "x".repeat(120);
        assert_eq!(folded(&path), path);
    }
}
