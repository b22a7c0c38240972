//! The grammar's pairs → items and clauses of the tree.
//!
//! Steps are in [`super::step`], expressions in [`super::expression`], scenes and twins in
//! [`super::scene`]. A pair's own span
//! may end in blanks and notes, so spans are taken from the first token to the last.

use super::super::ast::{
    ActionItem, Conditions, FluentItem, Import, Item, Literal, Name, Param, Recovery, Remedy, Span,
    Step, TaskItem, Text, Timing, TypeItem,
};
use super::super::diagnostic::Diagnostic;
use super::brackets::Balanced;
use super::explain::{explain, wrong_units};
use super::expression::nothing;
use super::grammar::{Pair, Place, Rule};

/// Builds the tree of one balanced piece and collects what is wrong in it.
pub(super) struct Builder<'a> {
    pub(super) balanced: &'a Balanced,
    pub(super) diagnostics: Vec<Diagnostic>,
    /// Operands of the operators that the expression being read stands inside of.
    pub(super) above: usize,
}

/// What the clauses and steps between braces add up to.
#[derive(Default)]
pub(super) struct Body {
    pub(super) say: Vec<Text>,
    pub(super) conditions: Conditions,
    pub(super) script: Option<(String, Span)>,
    pub(super) limit: Option<Literal>,
    pub(super) steps: Vec<Step>,
    pub(super) recoveries: Vec<Recovery>,
    pub(super) timings: Vec<Timing>,
    pub(super) remedy: Option<Remedy>,
}

impl<'a> Builder<'a> {
    pub(super) fn new(balanced: &'a Balanced) -> Self {
        Self { balanced, diagnostics: Vec::new(), above: 0 }
    }

    /// Returns the bytes of a pair in the original, from its first token to its last.
    pub(super) fn span(&self, pair: &Pair) -> Span {
        let (from, to) = (pair.as_span().start(), tight_end(pair));
        self.balanced.original(from, to)
    }

    pub(super) fn name(&self, pair: &Pair) -> Name {
        Name { text: pair.as_str().into(), span: self.span(pair) }
    }

    /// Explains a slice that could not be read, unless its brackets have been complained about.
    pub(super) fn bad(&mut self, pair: &Pair, place: Place) -> Span {
        let span = self.span(pair);
        if !self.balanced.mended(span) {
            let text = &self.balanced.text;
            let (from, to) = (pair.as_span().start(), pair.as_span().end());
            // `12 parsecs`: the number has been read, and only with it the word makes sense.
            let before = text[..from].trim_end_matches([' ', '\t']);
            let digits = before.trim_end_matches(|c: char| c.is_ascii_digit() || c == '.').len();
            let with_number = |a: usize, b: usize| self.balanced.original(digits + a, digits + b);
            let line = before[..digits].rsplit('\n').next().unwrap_or_default();
            let mut found = wrong_units(line, &text[digits..to], &with_number);
            // The 4 of `k4 u` is no number.
            let part_of_name =
                before[..digits].ends_with(|c: char| c.is_alphanumeric() || c == '_');
            if found.is_empty() || part_of_name {
                let to_original = |a: usize, b: usize| self.balanced.original(from + a, from + b);
                let line = text[..from].rsplit('\n').next().unwrap_or_default();
                found = explain(place, line, &text[from..to], &to_original);
            }
            self.diagnostics.extend(found);
        }
        span
    }

    /// Reads the pairs of a `file`.
    pub(super) fn file(&mut self, pairs: pest::iterators::Pairs<Rule>) -> Vec<Item> {
        let mut items = Vec::new();
        for pair in pairs.flat_map(Pair::into_inner) {
            let span = self.span(&pair);
            let doc = Self::doc(&pair);
            let rule = pair.as_rule();
            let mut inner = pair
                .clone()
                .into_inner()
                .filter(|p| !matches!(p.as_rule(), Rule::doc | Rule::was))
                .filter(|p| !is_keyword(p.as_rule()));
            items.push(match rule {
                Rule::import_ => {
                    let Some(path) = inner.next().map(|p| self.text(&p)) else { continue };
                    Item::Import(Import { path, span })
                }
                Rule::type_ => {
                    let mut names =
                        inner.filter(|p| p.as_rule() == Rule::id).map(|p| self.name(&p));
                    let Some(name) = names.next() else { continue };
                    Item::Type(TypeItem { doc, name, parents: names.collect(), span })
                }
                Rule::fluent => Item::Fluent(self.fluent(doc, inner, span)),
                Rule::action => {
                    let (name, params, body) = self.definition(inner);
                    Item::Action(ActionItem {
                        doc,
                        was: self.was(&pair),
                        name,
                        params,
                        say: body.say,
                        conditions: body.conditions,
                        script: body.script,
                        limit: body.limit,
                        span,
                    })
                }
                Rule::task => {
                    let (name, params, body) = self.definition(inner);
                    Item::Task(TaskItem {
                        doc,
                        was: self.was(&pair),
                        name,
                        params,
                        say: body.say,
                        conditions: body.conditions,
                        limit: body.limit,
                        steps: body.steps,
                        recoveries: body.recoveries,
                        span,
                    })
                }
                Rule::scene => Item::Scene(self.scene(doc, inner, span)),
                Rule::twin => Item::Twin(self.twin(doc, inner, span)),
                Rule::model => Item::Model(self.model(doc, &pair, span)),
                Rule::run_ => {
                    let Some(step) = inner.next().and_then(|p| self.step(&p, &mut Body::default()))
                    else {
                        continue;
                    };
                    Item::Run(step)
                }
                Rule::bad_item => Item::Bad(self.bad(&pair, Place::Item)),
                _ => continue,
            });
        }
        items
    }

    fn fluent<'i>(
        &mut self,
        doc: Vec<String>,
        inner: impl Iterator<Item = Pair<'i>>,
        span: Span,
    ) -> FluentItem {
        let mut item = FluentItem {
            doc,
            name: Name { text: String::new(), span },
            params: Vec::new(),
            body: nothing(span),
            ask: None,
            span,
        };
        for pair in inner {
            match pair.as_rule() {
                Rule::id => item.name = self.name(&pair),
                Rule::params => item.params = self.params(&pair),
                Rule::expr => item.body = self.expr(&pair),
                Rule::ask => item.ask = self.text_in(&pair),
                _ => {}
            }
        }
        item
    }

    /// Reads name, parameters and body of an action or a task.
    fn definition<'i>(
        &mut self,
        inner: impl Iterator<Item = Pair<'i>>,
    ) -> (Name, Vec<Param>, Body) {
        let mut name = Name { text: String::new(), span: Span::default() };
        let mut params = Vec::new();
        let mut body = Body::default();
        for pair in inner {
            match pair.as_rule() {
                Rule::id => name = self.name(&pair),
                Rule::params => params = self.params(&pair),
                _ => self.part(&pair, &mut body),
            }
        }
        if let Some(Timing { span, .. }) = body.timings.first() {
            self.timing_outside(*span);
        }
        (name, params, body)
    }

    fn params(&mut self, pair: &Pair) -> Vec<Param> {
        let mut out = Vec::new();
        for part in pair.clone().into_inner() {
            match part.as_rule() {
                Rule::param => {
                    let mut ids = part.clone().into_inner().filter(|p| p.as_rule() == Rule::id);
                    let (Some(name), Some(ty)) = (ids.next(), ids.next()) else { continue };
                    let default = find(&part, Rule::expr).map(|p| self.expr(&p));
                    out.push(Param { name: self.name(&name), ty: self.name(&ty), default });
                }
                Rule::bad_params => {
                    // The slice is read again with what stands before it, to be told in its place.
                    self.bad_list(pair, &part, Place::Params);
                    out.extend(self.salvaged(&part));
                }
                _ => {}
            }
        }
        out
    }

    /// What can still be told of parameters that could not be read, so that their uses are no second mistake: a
    /// type that is missing is empty, and fits everything.
    fn salvaged(&self, bad: &Pair) -> Vec<Param> {
        let (text, from) = (bad.as_str(), bad.as_span().start());
        let name_at = |at: usize| {
            let rest = &text[at..];
            let start = at + rest.len() - rest.trim_start().len();
            let is_part = |c: char| c.is_alphanumeric() || c == '_';
            let end = text[start..].find(|c| !is_part(c)).map_or(text.len(), |n| start + n);
            let span = self.balanced.original(from + start, from + end);
            (Name { text: text[start..end].into(), span }, end)
        };
        let mut found = Vec::new();
        let mut at = 0;
        for piece in text.split(',') {
            let (name, end) = name_at(at);
            let colon = text[end..at + piece.len().max(end - at)].find(':');
            let ty = match colon {
                Some(n) => name_at(end + n + 1).0,
                None => Name { text: String::new(), span: name.span },
            };
            if !name.text.is_empty() {
                found.push(Param { name, ty, default: None });
            }
            at += piece.len() + 1;
        }
        found
    }

    /// Explains a list between parentheses whose end could not be read.
    pub(super) fn bad_list(&mut self, list: &Pair, bad: &Pair, place: Place) {
        let open = find(list, Rule::lpar);
        let from = open.map_or(bad.as_span().start(), |p| p.as_span().start());
        let close = list.clone().into_inner().filter(|p| p.as_rule() == Rule::rpar).last();
        let to = close.map_or(bad.as_span().end(), |p| p.as_span().end());
        let span = self.balanced.original(bad.as_span().start(), bad.as_span().end());
        if self.balanced.mended(span) {
            return;
        }
        let slice = &self.balanced.text[from..to];
        let to_original = |a: usize, b: usize| self.balanced.original(from + a, from + b);
        self.diagnostics.extend(explain(place, "", slice, &to_original));
    }

    /// Reads one clause, step or recovery of a body.
    pub(super) fn part(&mut self, pair: &Pair, body: &mut Body) {
        match pair.as_rule() {
            Rule::say => body.say.extend(self.text_in(pair)),
            Rule::needs => self.condition(pair, |b| &mut b.conditions.needs, body),
            Rule::keeps => self.condition(pair, |b| &mut b.conditions.keeps, body),
            Rule::gives => self.condition(pair, |b| &mut b.conditions.gives, body),
            Rule::script => {
                if let Some(text) = find(pair, Rule::text) {
                    let span = self.span(&text);
                    self.once(body.script.is_some(), "run", self.span(pair));
                    body.script = Some((unquote(text.as_str()), span));
                }
            }
            Rule::limit => {
                self.once(body.limit.is_some(), "limit", self.span(pair));
                if !body.steps.is_empty() && !self.begins_line(pair) {
                    self.limit_of_a_step(pair);
                }
                body.limit = find(pair, Rule::quant).map(|p| self.literal(&p));
            }
            Rule::recover => {
                let recovery = self.recovery(pair);
                body.recoveries.push(recovery);
            }
            Rule::remedy => {
                self.once(body.remedy.is_some(), "retry or abort", self.span(pair));
                body.remedy = Some(self.remedy(pair));
            }
            Rule::step => {
                if body.remedy.is_some() {
                    self.after_remedy(pair);
                }
                if let Some(step) = self.step(pair, body) {
                    body.steps.push(step);
                }
            }
            Rule::bad_step | Rule::bad_clause => {
                let place =
                    if pair.as_rule() == Rule::bad_step { Place::Step } else { Place::Clause };
                // What follows an `either` or `if` that could not be read is lost with it.
                let orphan = matches!(body.steps.last(), Some(Step::Bad(_)))
                    && matches!(pair.as_str().split_whitespace().next(), Some("or" | "else"));
                let span = if orphan { self.span(pair) } else { self.bad(pair, place) };
                body.steps.push(Step::Bad(span));
            }
            _ => {}
        }
    }

    fn condition(
        &mut self,
        pair: &Pair,
        list: impl Fn(&mut Body) -> &mut Vec<super::super::ast::Expr>,
        body: &mut Body,
    ) {
        if let Some(expr) = find(pair, Rule::expr) {
            let expr = self.expr(&expr);
            list(body).push(expr);
        }
    }

    /// Complains when a clause that stands once stands twice.
    fn once(&mut self, already: bool, what: &str, span: Span) {
        if already {
            self.diagnostics.push(
                Diagnostic::error(
                    "task::duplicate",
                    span,
                    format!("duplicate `{what}`"),
                    "the second one",
                )
                .help("keep one of them"),
            );
        }
    }

    /// Returns whether only blanks stand before a pair on its line.
    pub(super) fn begins_line(&self, pair: &Pair) -> bool {
        let before = &self.balanced.text[..pair.as_span().start()];
        before.rsplit('\n').next().unwrap_or_default().trim().is_empty()
    }

    /// Warns of `place(o) limit 2 s`, which is the whole task's limit.
    fn limit_of_a_step(&mut self, pair: &Pair) {
        self.diagnostics.push(
            Diagnostic::warning(
                "task::limit",
                self.span(pair),
                "a step has no `limit` of its own; this is the whole task's",
                "stands behind a step",
            )
            .help(format!(
                "write `{}` on a line of its own if it is the task's, or make the step a task with this limit",
                pair.as_str().trim()
            )),
        );
    }

    fn after_remedy(&mut self, pair: &Pair) {
        self.diagnostics.push(
            Diagnostic::error(
                "task::recovery",
                self.span(pair),
                "a recovery ends with `retry` or `abort`",
                "never done",
            )
            .help("put this step before it"),
        );
    }

    pub(super) fn timing_outside(&mut self, span: Span) {
        self.diagnostics.push(
            Diagnostic::error(
                "task::timing",
                span,
                "`timing` relates steps that run at the same time",
                "not inside `together`",
            )
            .help("move it into the `together { … }` whose steps it names"),
        );
    }

    /// Reads a text in quotes.
    fn text(&self, pair: &Pair) -> Text {
        Text { text: unquote(pair.as_str()), span: self.span(pair) }
    }

    /// Reads the text in quotes inside a pair.
    pub(super) fn text_in(&self, pair: &Pair) -> Option<Text> {
        find(pair, Rule::text).map(|p| self.text(&p))
    }

    /// Reads the `#[was("old")]` before an item or a branch.
    pub(super) fn was(&self, pair: &Pair) -> Vec<Text> {
        let all = pair.clone().into_inner().filter(|p| p.as_rule() == Rule::was);
        all.filter_map(|p| self.text_in(&p)).collect()
    }

    /// Returns the documentation lines of an item, without their slashes.
    fn doc(pair: &Pair) -> Vec<String> {
        pair.clone()
            .into_inner()
            .take_while(|p| matches!(p.as_rule(), Rule::doc | Rule::was))
            .filter(|p| p.as_rule() == Rule::doc)
            .map(|p| {
                let line = p.as_str().trim_start_matches('/').trim_end();
                line.strip_prefix(' ').unwrap_or(line).to_string()
            })
            .collect()
    }
}

/// The end of the last token inside a pair: pest counts the blanks before an absent optional in.
pub(super) fn tight_end(pair: &Pair) -> usize {
    let mut last = pair.clone();
    while let Some(inner) = last.clone().into_inner().next_back() {
        last = inner;
    }
    let start = last.as_span().start();
    start + last.as_str().trim_end().len()
}

/// Returns the first pair of a rule directly inside a pair.
pub(super) fn find<'i>(pair: &Pair<'i>, rule: Rule) -> Option<Pair<'i>> {
    pair.clone().into_inner().find(|p| p.as_rule() == rule)
}

/// Takes the quotes off and resolves `\"`, `\\` and `\n`.
pub(super) fn unquote(text: &str) -> String {
    let inner = text.strip_prefix('"').unwrap_or(text);
    let inner = inner.strip_suffix('"').unwrap_or(inner);
    let mut out = String::with_capacity(inner.len());
    let mut chars = inner.chars();
    while let Some(c) = chars.next() {
        match c {
            '\\' => match chars.next() {
                Some('n') => out.push('\n'),
                Some(other) => out.push(other),
                None => {}
            },
            c => out.push(c),
        }
    }
    out
}

/// Reads the grammar's `num`; what it accepts is always a number, though it may overflow to infinity.
pub(super) fn number(text: &str) -> f64 {
    text.replace('_', "").parse().unwrap_or(f64::NAN)
}

/// Whether a rule only spells a keyword.
fn is_keyword(rule: Rule) -> bool {
    format!("{rule:?}").starts_with("K_")
}
