//! Text of strangers as it may be shown: no control characters, and no longer than a person reads.
//!
//! A name in a task file, a header of a table or a reply of a model may hold what a terminal obeys: a colour, a
//! title, a jump of the cursor over what was said before. Such characters are shown as pictures, `␛` for escape,
//! and are never sent. What is long loses its middle.

use std::borrow::Cow;

/// Lines of one text that are shown.
const MOST_LINES: usize = 16;

/// What a colour of this program may be made of: reset, bold, dim, italic, underlined, their ends, and the colours
/// that can be read on dark and on light ground. Nothing that hides.
const COLOURS: &[&str] =
    &["0", "1", "2", "3", "4", "22", "23", "24", "31", "32", "33", "34", "35", "36", "39"];

/// Returns a character as it is shown: itself, or a picture of one that a terminal would obey or that turns the
/// direction of reading. One character stands for one, so columns stay.
pub fn picture(c: char) -> char {
    match c {
        '\t' => c,
        '\0'..='\u{1f}' => char::from_u32(0x2400 + u32::from(c)).unwrap_or('\u{fffd}'),
        '\u{7f}' => '\u{2421}',
        '\u{80}'..='\u{9f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => '\u{fffd}',
        c => c,
    }
}

/// Returns a text without control characters; lines and tabs stay.
pub fn visible(text: &str) -> Cow<'_, str> {
    if text.chars().all(|c| c == '\n' || picture(c) == c) {
        return Cow::Borrowed(text);
    }
    let text = text.replace("\r\n", "\n");
    Cow::Owned(text.chars().map(|c| if c == '\n' { c } else { picture(c) }).collect())
}

/// As [`visible`], but colours of this program pass, and none lasts beyond the text.
pub fn coloured(text: &str) -> Cow<'_, str> {
    if !text.contains('\x1b') {
        return visible(text);
    }
    let mut parts = text.split('\x1b');
    let mut out = visible(parts.next().unwrap_or_default()).into_owned();
    let mut is_open = false;
    for part in parts {
        let colour = part.strip_prefix('[').and_then(|rest| rest.split_once('m'));
        let colour = colour.filter(|(codes, _)| codes.split(';').all(|c| COLOURS.contains(&c)));
        if let Some((codes, rest)) = colour {
            out.push_str("\x1b[");
            out.push_str(codes);
            out.push('m');
            out.push_str(&visible(rest));
            is_open = codes != "0";
        } else {
            out.push(picture('\x1b'));
            out.push_str(&visible(part));
        }
    }
    if is_open {
        out.push_str("\x1b[0m");
    }
    Cow::Owned(out)
}

/// Returns a text of at most `most` characters and a few lines: of a longer one begin and end, with `…` between.
pub fn shortened(text: &str, most: usize) -> Cow<'_, str> {
    let fits = |text: &str| text.len() <= most || text.chars().nth(most).is_none();
    let lines = text.bytes().filter(|b| *b == b'\n').count() + 1;
    if lines <= MOST_LINES && fits(text) {
        return Cow::Borrowed(text);
    }
    let mut out = text.to_owned();
    if lines > MOST_LINES {
        let (first, last) = (MOST_LINES * 2 / 3, MOST_LINES / 3);
        let head: Vec<&str> = text.lines().take(first).collect();
        let mut tail: Vec<&str> = text.lines().rev().take(last).collect();
        tail.reverse();
        out = format!(
            "{}\n… {} more lines …\n{}",
            head.join("\n"),
            lines - first - last,
            tail.join("\n")
        );
    }
    if !fits(&out) {
        let tail = most / 3;
        let head: String = out.chars().take(most - tail - 1).collect();
        let mut end: Vec<char> = out.chars().rev().take(tail).collect();
        end.reverse();
        out = format!("{head}…{}", end.into_iter().collect::<String>());
    }
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_escape_sequence_is_shown_and_not_sent() {
        assert_eq!(visible("a\x1b]0;title\x07b"), "a␛]0;title␇b");
        assert_eq!(visible("one\r\ntwo\tthree\rfour"), "one\ntwo\tthree␍four");
        assert_eq!(visible("\u{9b}2J \u{202e}cba"), "\u{fffd}2J \u{fffd}cba");
        assert!(matches!(visible("grün, 水, ±1 mm"), Cow::Borrowed(_)));
    }

    #[test]
    fn only_colours_that_hide_nothing_pass_and_end_with_the_text() {
        assert_eq!(coloured("\x1b[31merror:\x1b[0m no"), "\x1b[31merror:\x1b[0m no");
        assert_eq!(coloured("\x1b[36;1;4mlink"), "\x1b[36;1;4mlink\x1b[0m");
        for hostile in
            ["\x1b[8mhidden", "\x1b[2J", "\x1b[38;2;0;0;0mx", "\x1b]8;;http://x\x07", "\x1b"]
        {
            assert!(!coloured(hostile).contains('\x1b'), "{hostile:?}");
        }
    }

    #[test]
    fn a_long_text_loses_its_middle() {
        let long = format!("`{}` is not known", "a".repeat(1_000_000));
        let short = shortened(&long, 100);
        assert_eq!(short.chars().count(), 100);
        assert!(
            short.starts_with("`aaa") && short.contains('…') && short.ends_with("is not known")
        );
        assert_eq!(shortened("änd", 3), "änd");
        let many = shortened(&"line\n".repeat(10_000), 1000).into_owned();
        assert!(many.lines().count() <= MOST_LINES + 1 && many.contains("more lines"), "{many}");
    }
}
