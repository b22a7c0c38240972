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
    if text.chars().count() <= COLUMNS {
        return text.to_owned();
    }
    let indent = text.chars().take_while(|c| *c == ' ').count();
    let hanging = hanging(text, indent);
    let mut folded = text[..indent].to_owned();
    let mut at = indent;
    for (n, word) in text[indent..].split(' ').enumerate() {
        let wide = word.chars().count();
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

/// Returns where the text behind a line's first word begins, if it stands in a column of its own; else the indentation.
fn hanging(text: &str, indent: usize) -> usize {
    let rest = &text[indent..];
    let column = rest.find("  ").map(|gap| {
        let blanks = rest[gap..].chars().take_while(|c| *c == ' ').count();
        indent + rest[..gap].chars().count() + blanks
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
        // What has no blank stays whole.
        let path = "x".repeat(120);
        assert_eq!(folded(&path), path);
    }
}
