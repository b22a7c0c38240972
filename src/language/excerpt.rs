//! The few lines that a diagnostic is drawn over: those around its labels, long ones cut to windows around
//! them, control characters as pictures.
//!
//! A drawing that repeated its whole line would be as long as the line, once for every mistake on it. Lines keep
//! their numbers and the labels their columns, wherever they come to lie in the excerpt.

use miette::{MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};

use super::ast::Span;
use super::diagnostic::{Diagnostic, Source};
use crate::plain::{picture, shortened, visible};

/// Lines kept on either side of a label; one more than is drawn.
const AROUND: usize = 2;
/// Lines of one label that are drawn.
const TALLEST: usize = 8;
/// A line of so many bytes is drawn whole.
const WHOLE: usize = 160;
/// Characters kept on either side of where a label begins or ends on a longer line.
const REACH: usize = 60;
/// Characters of a source's name.
const LONGEST_NAME: usize = 200;

/// A piece of a source, with the places of a diagnostic's labels in it.
#[derive(Debug)]
pub(super) struct Excerpt {
    name: String,
    text: String,
    /// Lines of the source before it.
    first_line: usize,
    /// Where each label lies in the excerpt: first byte, length.
    pub(super) spans: Vec<(usize, usize)>,
    /// The column, from 0, at which each label begins in the source.
    columns: Vec<usize>,
}

impl Excerpt {
    /// Cuts out what a diagnostic speaks of.
    pub(super) fn of(diagnostic: &Diagnostic, source: &Source) -> Self {
        let text = source.text.as_str();
        let labels: Vec<Span> =
            diagnostic.labels.iter().map(|label| drawable(text, label.span)).collect();
        let low = labels.iter().map(|span| span.from).min().unwrap_or(0);
        let high = labels.iter().map(|span| span.to).max().unwrap_or(0);
        let (from, to) = (lines_back(text, low), lines_on(text, high));
        let mut marks: Vec<(usize, usize)> =
            labels.iter().flat_map(|span| [(span.from, 0), (span.to, 0)]).collect();
        marks.sort_unstable();
        marks.dedup();
        let mut out = String::new();
        let mut at = from;
        for (i, line) in text[from..to].split('\n').enumerate() {
            if i > 0 {
                out.push('\n');
            }
            let on_line = |mark: &&mut (usize, usize)| (at..=at + line.len()).contains(&mark.0);
            let mut here: Vec<&mut (usize, usize)> = marks.iter_mut().filter(on_line).collect();
            copy(line, at, &mut here, &mut out);
            at += line.len() + 1;
        }
        let place = |byte: usize| {
            marks.iter().find(|mark| mark.0 == byte).map_or(out.len(), |(_, place)| *place)
        };
        let spans = labels.iter().map(|span| {
            let from = place(span.from);
            (from, place(span.to).saturating_sub(from))
        });
        Self {
            spans: spans.collect(),
            columns: labels.iter().map(|span| source.line_column(span.from).1 - 1).collect(),
            first_line: text[..from].matches('\n').count(),
            name: visible(&shortened(&source.name, LONGEST_NAME)).into_owned(),
            text: out,
        }
    }
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let found = self.text.as_str().read_span(span, before, after)?;
        let at = (span.offset(), span.len());
        // With lines around it the contents begin where a line does.
        let own = self.spans.iter().position(|own| before == 0 && *own == at);
        let column = own.map_or(found.column(), |at| self.columns[at]);
        Ok(Box::new(MietteSpanContents::new_named(
            self.name.clone(),
            found.data(),
            *found.span(),
            found.line() + self.first_line,
            column,
            found.line_count(),
        )))
    }
}

/// Returns the part of a span that is drawn: inside the text, and no more than a few lines.
fn drawable(text: &str, span: Span) -> Span {
    let inside = |byte: usize| {
        let mut byte = byte.min(text.len());
        while !text.is_char_boundary(byte) {
            byte -= 1;
        }
        byte
    };
    let from = inside(span.from);
    let to = inside(span.to).max(from);
    let is_tall = text[from..to].bytes().filter(|b| *b == b'\n').count() >= TALLEST;
    let line_end = text[from..to].find('\n').map_or(to, |end| from + end);
    Span { from, to: if is_tall { line_end } else { to } }
}

/// Returns where the line [`AROUND`] before that of a byte begins.
fn lines_back(text: &str, byte: usize) -> usize {
    let mut starts = text[..byte].rmatch_indices('\n').map(|(at, _)| at + 1);
    starts.nth(AROUND).unwrap_or(0)
}

/// Returns where the line [`AROUND`] after that of a byte ends.
fn lines_on(text: &str, byte: usize) -> usize {
    let mut ends = text[byte..].match_indices('\n').map(|(at, _)| byte + at);
    ends.nth(AROUND).unwrap_or(text.len())
}

/// Copies a line that begins at byte `start` of its source, whole or in windows around the marks, which are
/// given their places in the copy.
fn copy(line: &str, start: usize, marks: &mut [&mut (usize, usize)], out: &mut String) {
    let line = line.strip_suffix('\r').unwrap_or(line);
    for mark in marks.iter_mut() {
        // Behind a carriage return is where the line ends.
        mark.1 = mark.0.min(start + line.len());
    }
    let windows = windows(line, marks.iter().map(|mark| mark.1 - start));
    let mut places: Vec<Option<usize>> = vec![None; marks.len()];
    let mut done = 0;
    for (from, to) in windows {
        if from > done {
            out.push('…');
        }
        for (at, c) in line[from..to].char_indices() {
            for (mark, place) in marks.iter().zip(&mut places) {
                if mark.1 == start + from + at {
                    place.get_or_insert(out.len());
                }
            }
            out.push(picture(c));
        }
        for (mark, place) in marks.iter().zip(&mut places) {
            if mark.1 == start + to {
                place.get_or_insert(out.len());
            }
        }
        done = to;
    }
    if done < line.len() {
        out.push('…');
    }
    for (mark, place) in marks.iter_mut().zip(places) {
        mark.1 = place.unwrap_or(out.len());
    }
}

/// Returns the parts of a line that are shown, in order and apart from each other.
fn windows(line: &str, marks: impl Iterator<Item = usize>) -> Vec<(usize, usize)> {
    if line.len() <= WHOLE {
        return vec![(0, line.len())];
    }
    let around = |mark: usize| {
        let back = line[..mark].char_indices().rev().take(REACH).last();
        let on = line[mark..].char_indices().nth(REACH);
        (back.map_or(mark, |(at, _)| at), on.map_or(line.len(), |(at, _)| mark + at))
    };
    let mut found: Vec<(usize, usize)> = marks.map(around).collect();
    if found.is_empty() {
        found.push(around(0));
    }
    found.sort_unstable();
    let mut apart: Vec<(usize, usize)> = Vec::new();
    for (from, to) in found {
        match apart.last_mut() {
            Some(last) if from <= last.1 => last.1 = last.1.max(to),
            _ => apart.push((from, to)),
        }
    }
    apart
}

#[cfg(test)]
mod tests {
    use super::super::diagnostic::{Style, render};
    use super::*;

    fn drawn(text: &str, from: usize, to: usize) -> String {
        let diagnostic = Diagnostic::error("task::unit", Span { from, to }, "wrong", "here");
        render(&diagnostic, &Source::new("a.task", text), Style::Plain)
    }

    #[test]
    fn a_line_of_megabytes_is_drawn_as_a_window() {
        let line = format!("{}kup{}", "é ".repeat(500_000), " b".repeat(500_000));
        let at = line.find("kup").unwrap();
        let text = format!("first\n{line}\nlast\n");
        let drawn = drawn(&text, 6 + at, 6 + at + 3);
        assert!(drawn.len() < 1000, "{} bytes", drawn.len());
        assert!(drawn.contains("a.task:2:1000001"), "the column of the source: {drawn}");
        let lines: Vec<&str> = drawn.lines().collect();
        let shown = lines.iter().position(|line| line.contains("kup")).unwrap();
        assert!(lines[shown].contains('…') && lines[shown].contains(" 2 │"), "{drawn}");
        let under = |what: &str, line: &str| line.split(what).next().unwrap().chars().count();
        assert_eq!(under("kup", lines[shown]), under("─┬─", lines[shown + 1]), "{drawn}");
        assert!(drawn.contains("first") && drawn.contains("last"), "{drawn}");
    }

    #[test]
    fn a_label_of_a_thousand_lines_is_drawn_by_its_first() {
        let text = format!("task f() {{\n{}}}\n", "  g()\n".repeat(1000));
        let drawn = drawn(&text, 0, text.len());
        assert!(drawn.lines().count() < 12, "{drawn}");
    }

    #[test]
    fn control_characters_are_drawn_as_pictures_in_their_columns() {
        let text = "a \x1b[2J kup\r\nb\x07\n";
        let at = text.find("kup").unwrap();
        let drawn = drawn(text, at, at + 3);
        assert!(!drawn.contains('\x1b') && drawn.contains("a ␛[2J kup"), "{drawn}");
        assert!(drawn.contains("a.task:1:8") && drawn.contains("b␇"), "{drawn}");
    }

    #[test]
    fn what_is_short_is_drawn_as_it_is() {
        let text = "one\ntwo\nthree\nfour\nfive\nsix\n";
        for (from, to) in [(0, 3), (4, 7), (20, 23), (24, 27), (28, 28), (99, 99), (4, 13)] {
            let drawn = drawn(text, from, to);
            let line = Source::new("", text).line_column(from).0;
            assert!(drawn.contains(&format!("a.task:{line}:")), "{from}: {drawn}");
            assert!(drawn.contains("wrong"), "{drawn}");
        }
    }
}
