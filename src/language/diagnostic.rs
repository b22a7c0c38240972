//! What is wrong with a text and what would help: one value, drawn, narrated or written as JSON.
//!
//! A [`Diagnostic`] names bytes of one [`Source`]. Lines and columns are counted here and only here:
//! both start at 1, columns count characters. Nothing is printed; [`render`] returns the text. What came in may
//! be hostile or a line of megabytes: what is drawn is an `Excerpt`, and messages lose their middle.
//!
//! Source: the graphics and the narration are miette's.

use std::fmt;

use miette::{
    GraphicalReportHandler, GraphicalTheme, LabeledSpan, NarratableReportHandler,
    Severity as MietteSeverity, ThemeCharacters, ThemeStyles,
};
use serde::{Deserialize, Serialize};

use super::ast::Span;
use super::excerpt::Excerpt;
use crate::plain::{shortened, visible};

/// A text with the name a person knows it by: a file name, `std.task`, `prompt`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Source {
    /// Its name.
    pub name: String,
    /// The whole text.
    pub text: String,
}

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Worth a look; the program can run.
    Warning,
    /// The item that holds it cannot run.
    Error,
}

/// A place with a few words beside it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    /// Which bytes.
    pub span: Span,
    /// The words; may be empty.
    pub text: String,
}

/// A change of a text: what stands in its place, which may be nothing, or a place between two characters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fix {
    /// Which bytes.
    pub span: Span,
    /// What is to stand there.
    pub text: String,
}

/// One thing that is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Which kind of mistake, stable: `task::unit`, `task::unclosed`, `task::unknown_name`, …
    pub code: &'static str,
    /// How bad.
    pub severity: Severity,
    /// One sentence.
    pub message: String,
    /// The name of the source it is in; empty until a [`super::Library`] or a caller says so.
    pub file: String,
    /// The bytes the sentence is about.
    pub span: Span,
    /// What to mark, the place itself first.
    pub labels: Vec<Label>,
    /// What to do about it.
    pub help: Option<String>,
    /// The change that does it, where there is only one.
    pub fix: Option<Fix>,
    /// How many mistakes it stands for: 1, or those that [`limited`] left out.
    pub count: usize,
}

/// Characters of a message, a label and a help that are kept; a name of a megabyte may be in them.
const LONGEST: (usize, usize, usize) = (500, 160, 600);

/// Mistakes of one text that are told one by one.
pub const MOST: usize = 1000;

/// How [`render`] draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Lines and arrows, in colour.
    Colour,
    /// Lines and arrows, no colour: `NO_COLOR`, files.
    Plain,
    /// Sentences only, for a screen reader.
    Narrated,
}

impl Source {
    /// A text under a name.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        Self { name: name.into(), text: text.into() }
    }

    /// Returns line and column, both from 1, of a byte; the column counts characters.
    pub fn line_column(&self, byte: usize) -> (usize, usize) {
        let mut end = byte.min(self.text.len());
        while !self.text.is_char_boundary(end) {
            end -= 1;
        }
        let before = &self.text[..end];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
    }

    /// Returns the text of a span, empty when it does not lie in this source.
    pub fn slice(&self, span: Span) -> &str {
        self.text.get(span.from..span.to).unwrap_or_default()
    }

    /// Returns `std.task:11`, as a place is named in a sentence.
    pub fn place(&self, span: Span) -> String {
        format!("{}:{}", self.name, self.line_column(span.from).0)
    }
}

impl Diagnostic {
    /// An error at a place, with a label there.
    pub fn error(
        code: &'static str,
        span: Span,
        message: impl Into<String>,
        label: impl Into<String>,
    ) -> Self {
        let diagnostic = Self {
            code,
            severity: Severity::Error,
            message: shortened(&message.into(), LONGEST.0).into_owned(),
            file: String::new(),
            span,
            labels: Vec::new(),
            help: None,
            fix: None,
            count: 1,
        };
        diagnostic.label(span, label)
    }

    /// As [`Self::error`], but the program can run.
    pub fn warning(
        code: &'static str,
        span: Span,
        message: impl Into<String>,
        label: impl Into<String>,
    ) -> Self {
        Self { severity: Severity::Warning, ..Self::error(code, span, message, label) }
    }

    /// Adds what to do about it.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(shortened(&help.into(), LONGEST.2).into_owned());
        self
    }

    /// Adds the name that was probably meant, which is to stand where this one does.
    #[must_use]
    pub fn did_you_mean(self, near: &str) -> Self {
        let span = self.span;
        self.help(format!("did you mean `{near}`?")).fix(span, near)
    }

    /// Adds the change that mends it.
    #[must_use]
    pub fn fix(mut self, span: Span, text: impl Into<String>) -> Self {
        self.fix = Some(Fix { span, text: text.into() });
        self
    }

    /// Adds what mends it by being written at a place.
    #[must_use]
    pub fn insert(self, at: usize, text: impl Into<String>) -> Self {
        self.fix(Span { from: at, to: at }, text)
    }

    /// The same about a text without its first `bytes`: for what was read with words before it that nobody wrote.
    #[must_use]
    pub fn without_first(mut self, bytes: usize) -> Self {
        let spans = self.labels.iter_mut().map(|label| &mut label.span);
        let spans = spans.chain(self.fix.as_mut().map(|fix| &mut fix.span));
        for span in spans.chain([&mut self.span]) {
            span.from = span.from.saturating_sub(bytes);
            span.to = span.to.saturating_sub(bytes);
        }
        self
    }

    /// Marks a further place.
    #[must_use]
    pub fn label(mut self, span: Span, text: impl Into<String>) -> Self {
        let text = shortened(&text.into(), LONGEST.1).into_owned();
        self.labels.push(Label { span, text });
        self
    }

    /// Returns whether it keeps the program from running.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }

    /// Returns the object that `trueup check --json` lists.
    pub fn to_json(&self, source: &Source) -> serde_json::Value {
        let (line, column) = source.line_column(self.span.from);
        let labels: Vec<_> = self
            .labels
            .iter()
            .map(|label| {
                let (line, column) = source.line_column(label.span.from);
                serde_json::json!({
                    "span": [label.span.from, label.span.to],
                    "line": line, "column": column, "message": label.text,
                })
            })
            .collect();
        serde_json::json!({
            "code": self.code,
            "severity": self.severity,
            "message": self.message,
            "file": if self.file.is_empty() { &source.name } else { &self.file },
            "span": [self.span.from, self.span.to],
            "line": line,
            "column": column,
            "labels": labels,
            "help": self.help,
            "fix": self.fix.as_ref().map(|fix| {
                serde_json::json!({"span": [fix.span.from, fix.span.to], "text": fix.text})
            }),
        })
    }
}

/// Returns the first [`MOST`] of what is wrong with a text, in the order of the text, and one more that counts
/// the others: they are most likely one mistake many times.
pub fn limited(mut all: Vec<Diagnostic>) -> Vec<Diagnostic> {
    if all.len() <= MOST {
        return all;
    }
    // A mistake that keeps the program from running is never left out for a warning.
    let in_order = |a: &Diagnostic, b: &Diagnostic| {
        (&a.file, a.span.from, a.span.to).cmp(&(&b.file, b.span.from, b.span.to))
    };
    all.sort_by(in_order);
    all.sort_by_key(|d| !d.is_error());
    let others = all.split_off(MOST);
    all.sort_by(in_order);
    let count = others.iter().map(|d| d.count).sum();
    let words = match count {
        1 => "1 more mistake is not listed".to_owned(),
        _ => format!("{count} more mistakes are not listed"),
    };
    let first = others.iter().min_by(|a, b| in_order(a, b));
    let (file, at) = first.map_or_else(
        || (String::new(), Span { from: 0, to: 0 }),
        |first| (first.file.clone(), first.span),
    );
    let has_errors = others.iter().any(Diagnostic::is_error);
    let kind = if has_errors { Diagnostic::error } else { Diagnostic::warning };
    let more = kind("task::more", at, words, "the first of them");
    all.push(Diagnostic { file, count, ..more.help("mend these first, and check again") });
    all
}

/// Draws a diagnostic over its source, ending in a newline.
pub fn render(diagnostic: &Diagnostic, source: &Source, style: Style) -> String {
    let excerpt = Excerpt::of(diagnostic, source);
    let view = View { diagnostic, excerpt };
    let mut out = String::new();
    let drawn = match style {
        Style::Narrated => {
            NarratableReportHandler::new().with_context_lines(1).render_report(&mut out, &view)
        }
        Style::Colour | Style::Plain => {
            let theme = match style {
                // The sixteen colours of the terminal, which a person has set to be read.
                Style::Colour => GraphicalTheme {
                    characters: ThemeCharacters::unicode(),
                    styles: ThemeStyles::ansi(),
                },
                _ => GraphicalTheme::unicode_nocolor(),
            };
            GraphicalReportHandler::new_themed(theme)
                .with_links(false)
                .with_width(100)
                .with_context_lines(1)
                .render_report(&mut out, &view)
        }
    };
    if drawn.is_err() {
        // The spans do not fit the text, so the words have to do.
        let words = format!("{}: {}\n", source.place(diagnostic.span), diagnostic.message);
        out = visible(&words).into_owned();
    }
    out
}

/// miette's view of a diagnostic with its text.
#[derive(Debug)]
struct View<'a> {
    diagnostic: &'a Diagnostic,
    excerpt: Excerpt,
}

impl fmt::Display for View<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&visible(&self.diagnostic.message))
    }
}

impl std::error::Error for View<'_> {}

impl miette::Diagnostic for View<'_> {
    fn code<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(self.diagnostic.code))
    }

    fn severity(&self) -> Option<MietteSeverity> {
        Some(match self.diagnostic.severity {
            Severity::Warning => MietteSeverity::Warning,
            Severity::Error => MietteSeverity::Error,
        })
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.diagnostic.help.as_ref().map(|help| Box::new(visible(help)) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn miette::SourceCode> {
        Some(&self.excerpt)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let spans = self.excerpt.spans.iter();
        Some(Box::new(self.diagnostic.labels.iter().zip(spans).enumerate().map(
            |(i, (label, &(from, len)))| {
                let text = (!label.text.is_empty()).then(|| visible(&label.text).into_owned());
                if i == 0 {
                    LabeledSpan::new_primary_with_span(text, (from, len))
                } else {
                    LabeledSpan::new_with_span(text, (from, len))
                }
            },
        )))
    }
}
