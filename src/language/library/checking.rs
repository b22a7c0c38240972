//! What is wrong with the files of a library.

use std::collections::BTreeMap;

use super::super::ast::{Item, Program, SceneItem, Span, Step};
use super::super::builtins;
use super::super::check::Checker;
use super::super::diagnostic::{Diagnostic, Source, limited};
use super::{Kind, Library, Scope, key};

impl Library {
    /// Complains about what one file defines twice or what is built in, and of a second scene: nothing says which is meant.
    pub(super) fn find_doubles(program: &Program, diagnostics: &mut Vec<Diagnostic>) {
        let scenes: Vec<&SceneItem> = program.items.iter().filter_map(scene).collect();
        for pair in scenes.windows(2).filter(|pair| pair[0].name.text != pair[1].name.text) {
            let name = &pair[1].name.text;
            diagnostics.push(
                Diagnostic::error(
                    "task::duplicate",
                    pair[1].name.span,
                    "a file has one scene, and this is another",
                    "which of them is meant?",
                )
                .label(pair[0].name.span, "the one before it")
                .help(format!("put `{name}` into a file of its own, and name that with `--scene`")),
            );
        }
        let mut seen: BTreeMap<(Kind, &str), Span> = BTreeMap::new();
        for (kind, name) in program.items.iter().filter_map(key) {
            // An action may be called `tilt` beside the angle `tilt`: one is done, one is asked.
            let built_in = kind == Kind::Fluent && builtins::function(&name.text).is_some();
            if built_in {
                diagnostics.push(
                    Diagnostic::error(
                        "task::built_in",
                        name.span,
                        format!("`{}` is built in", name.text),
                        "cannot be defined anew",
                    )
                    .help("choose another name for yours"),
                );
            }
            if let Some(first) = seen.insert((kind, &name.text), name.span) {
                diagnostics.push(
                    Diagnostic::error(
                        "task::duplicate",
                        name.span,
                        format!("`{}` is defined twice", name.text),
                        "the second one",
                    )
                    .label(first, "the first one")
                    .help("remove or rename one of them"),
                );
            }
        }
    }

    /// Checks every file: names, arguments, types, units. Returns all that is wrong, syntax included,
    /// each with the name of its file, in the order of the files and their texts.
    pub fn check(&self, scope: &Scope) -> Vec<Diagnostic> {
        (0..self.files.len()).flat_map(|file| self.check_file(file, scope)).collect()
    }

    /// As [`Self::check`], one file alone.
    pub fn check_file(&self, file: usize, scope: &Scope) -> Vec<Diagnostic> {
        let Some(file) = self.files.get(file) else { return Vec::new() };
        let mut out = file.diagnostics.clone();
        let mut checker = Checker::new(self, scope, &file.source);
        checker.program(&file.program);
        // What stands at a place that could not be read is wrong because of that: `12 parsecs` has a
        // wrong unit, not none.
        let text = &file.source.text;
        let because = |d: &Diagnostic| {
            file.diagnostics.iter().any(|syntax| {
                syntax.span.from >= d.span.from
                    && text
                        .get(d.span.to.min(syntax.span.from)..syntax.span.from)
                        .is_some_and(|between| between.chars().all(|c| c == ' '))
            })
        };
        // Nor is anything said to be missing from an item that could not be read in full.
        let damaged = |d: &Diagnostic| {
            let inside = |span: Span, at: Span| span.from <= at.from && at.to <= span.to;
            let item = file.program.items.iter().filter_map(span_of).find(|s| inside(*s, d.span));
            d.code == "task::missing"
                && item.is_some_and(|item| file.diagnostics.iter().any(|s| inside(item, s.span)))
        };
        let found = checker.finish().into_iter().filter(|d| !because(d) && !damaged(d));
        out.extend(limited(found.collect()));
        out.sort_by_key(|d| (d.span.from, d.span.to));
        out
    }

    /// Checks a step typed at the prompt against the definitions here.
    pub fn check_step(&self, step: &Step, source: &Source, scope: &Scope) -> Vec<Diagnostic> {
        let mut checker = Checker::new(self, scope, source);
        checker.top_step(step);
        limited(checker.finish())
    }
}

fn scene(item: &Item) -> Option<&SceneItem> {
    match item {
        Item::Scene(scene) => Some(scene),
        _ => None,
    }
}

/// Returns the bytes of an item that has clauses.
fn span_of(item: &Item) -> Option<Span> {
    match item {
        Item::Action(item) => Some(item.span),
        Item::Task(item) => Some(item.span),
        Item::Scene(item) => Some(item.span),
        Item::Model(item) => Some(item.span),
        _ => None,
    }
}
