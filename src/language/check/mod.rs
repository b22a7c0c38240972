//! What a tree says that cannot be meant: unknown names, wrong arguments, types, units.
//!
//! Everything is collected, nothing stops at the first mistake, and what is already wrong has the type
//! [`Ty::Any`], so that one mistake is told once. At most one near name is suggested.

mod call;
mod choice;
mod expression;
mod model;
mod settled;
mod steps;

use std::collections::BTreeMap;

use super::ast::{
    ActionItem, Conditions, Expr, FluentItem, Item, Name, Param, Program, Span, Step, TaskItem,
    Text,
};
use super::builtins::{self, Ty};
use super::diagnostic::{Diagnostic, Source};
use super::library::{Library, Scope};
use super::parse::nearest;
use super::sentence::Template;
use crate::units::{Dimension, Quantity};
use call::sample;
pub use model::{MODEL_CONSTANTS, MODEL_FUNCTIONS, ModelUnits, check_model, names_in};
pub(super) use steps::branches;

/// What names mean at one place: parameters and `let`s.
type Names = BTreeMap<String, Ty>;

/// Checks one source against a library.
pub(super) struct Checker<'a> {
    library: &'a Library,
    scope: &'a Scope,
    source: &'a Source,
    diagnostics: Vec<Diagnostic>,
    /// Fluents whose type is being worked out, outermost first.
    pending: Vec<String>,
    /// Fluents each of which asks for the next, and the last for the first, as far as they were met.
    circles: Vec<Vec<String>>,
    /// The types of the fluents worked out so far.
    fluents: BTreeMap<String, Ty>,
    /// Whether a task leads to ends alone, and not to a circle of tasks.
    ends: BTreeMap<String, bool>,
    /// Tasks that may still be looked at for circles.
    budget: usize,
}

/// Tasks that are looked at for circles in one file: enough for a thousand, each leading to each.
const MOST_LOOKS: usize = 1_000_000;

impl<'a> Checker<'a> {
    pub(super) fn new(library: &'a Library, scope: &'a Scope, source: &'a Source) -> Self {
        Self {
            library,
            scope,
            source,
            diagnostics: Vec::new(),
            pending: Vec::new(),
            circles: Vec::new(),
            fluents: BTreeMap::new(),
            ends: BTreeMap::new(),
            budget: MOST_LOOKS,
        }
    }

    /// Returns what was found, with the name of its file.
    pub(super) fn finish(mut self) -> Vec<Diagnostic> {
        for diagnostic in &mut self.diagnostics {
            diagnostic.file.clone_from(&self.source.name);
        }
        self.diagnostics
    }

    fn tell(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// Checks a whole file.
    pub(super) fn program(&mut self, program: &Program) {
        // What a script's `let` names, its later steps know.
        let mut names = Names::new();
        for item in &program.items {
            match item {
                Item::Type(item) => {
                    for parent in &item.parents {
                        self.object_type(parent);
                        if parent.text == item.name.text
                            || self.library.is_a(&parent.text, &item.name.text)
                        {
                            self.tell(Diagnostic::error(
                                "task::cycle",
                                parent.span,
                                format!("`{}` would descend from itself", item.name.text),
                                "through this",
                            ));
                        }
                    }
                }
                Item::Fluent(item) => self.fluent(item),
                Item::Action(item) => self.action(item),
                Item::Task(item) => self.task(item),
                Item::Scene(item) => {
                    for thing in &item.things {
                        self.object_type(&thing.ty);
                    }
                }
                Item::Twin(item) => {
                    if self.library.scene(&item.of.text).is_none() && !item.of.text.is_empty() {
                        let names: Vec<&str> =
                            self.library.scenes().map(|(s, _)| s.name.text.as_str()).collect();
                        self.unknown(&item.of.text, item.of.span, "scene", &names);
                    }
                }
                Item::Run(step) => self.step(step, &mut names),
                Item::Model(item) => self.diagnostics.extend(check_model(item).1),
                Item::Import(_) | Item::Bad(_) => {}
            }
        }
    }

    /// Checks a step outside any task, where only the scene's objects have names.
    pub(super) fn top_step(&mut self, step: &Step) {
        self.step(step, &mut Names::new());
    }

    fn object_type(&mut self, name: &Name) {
        if self.library.type_names().any(|ty| ty == name.text) || name.text.is_empty() {
            return;
        }
        let names: Vec<&str> = self.library.type_names().collect();
        self.unknown(&name.text, name.span, "type", &names);
    }

    /// `name` is not known; one near name is suggested, or all of a few.
    fn unknown(&mut self, name: &str, span: Span, what: &str, known: &[&str]) {
        let found = Diagnostic::error(
            "task::unknown_name",
            span,
            format!("there is no {what} `{name}`"),
            "not known",
        );
        self.tell(match nearest(name, known.iter().copied()) {
            Some(near) => found.did_you_mean(near),
            None if known.is_empty() => found,
            None if known.len() <= 8 => found.help(format!("known are: {}", known.join(", "))),
            None => {
                let some = known[..6].join(", ");
                found.help(format!("known are: {some} and {} more", known.len() - 6))
            }
        });
    }

    /// Checks parameters and returns what they mean inside.
    fn params(&mut self, params: &[Param]) -> Names {
        let mut names = Names::new();
        for param in params {
            if param.ty.text.is_empty() {
                // That it says none has been told.
                names.insert(param.name.text.clone(), Ty::Any);
                continue;
            }
            let known = builtins::TYPES.iter().any(|(name, _)| *name == param.ty.text)
                || Dimension::named(&param.ty.text).is_some();
            if !known && !self.library.type_names().any(|ty| ty == param.ty.text) {
                let mut known: Vec<&str> = self.library.type_names().collect();
                let built_in = builtins::TYPES.iter().map(|(name, _)| *name);
                known.extend(built_in.filter(|name| *name != builtins::OBJECT));
                // Pushed one by one: the two kinds of names live differently long.
                for name in Dimension::names() {
                    known.push(name);
                }
                self.unknown(&param.ty.text, param.ty.span, "type", &known);
                names.insert(param.name.text.clone(), Ty::Any);
                continue;
            }
            let ty = Ty::named(&param.ty.text);
            if let Some(default) = &param.default {
                let given = self.expr(default, &names);
                self.fits(&param.name.text, &ty, &given, default);
            }
            if names.insert(param.name.text.clone(), ty).is_some() {
                self.tell(
                    Diagnostic::error(
                        "task::duplicate",
                        param.name.span,
                        format!("`{}` is a parameter twice", param.name.text),
                        "the second one",
                    )
                    .help("give it another name"),
                );
            }
        }
        names
    }

    fn fluent(&mut self, item: &FluentItem) {
        let names = self.params(&item.params);
        self.pending.push(item.name.text.clone());
        let ty = self.expr(&item.body, &names);
        self.pending.pop();
        if let Some(ask) = &item.ask {
            self.slots(ask, &item.params, "question");
            if !matches!(ty, Ty::Bool | Ty::Any) {
                self.tell(
                    Diagnostic::error(
                        "task::type",
                        item.body.span,
                        format!("`{}` asks a question, but is {}", item.name.text, ty.words()),
                        "not true or false",
                    )
                    .help("compare it with a limit, so that the answer is yes or no"),
                );
            }
        }
    }

    /// Checks the `{name}`s of a question or a sentence.
    fn slots(&mut self, text: &Text, params: &[Param], what: &str) {
        let Text { text, span } = text;
        for rest in text.split('{').skip(1) {
            let slot = rest.split('}').next().unwrap_or_default();
            // A part says what it is a part of: `{amount of capacity(o)}`.
            let slot = slot.split_once(" of ").map_or(slot, |(name, _)| name);
            if !params.iter().any(|param| param.name.text == slot) {
                let known: Vec<&str> = params.iter().map(|p| p.name.text.as_str()).collect();
                let found = Diagnostic::error(
                    "task::unknown_name",
                    *span,
                    format!("the {what} names `{{{slot}}}`, which is no parameter"),
                    "no such parameter",
                );
                self.tell(match nearest(slot, known.iter().copied()) {
                    Some(near) => found.help(format!("did you mean `{{{near}}}`?")),
                    None if known.is_empty() => found.help("it has no parameters"),
                    None => found.help(format!("parameters are: {}", known.join(", "))),
                });
            }
        }
    }

    fn action(&mut self, item: &ActionItem) {
        let names = self.params(&item.params);
        for was in &item.was {
            let taken = self.library.callable(&was.text).is_some();
            self.was(was, taken, "task or action");
        }
        self.sentences(&item.say, &item.params);
        self.conditions(&item.conditions, &names);
        if item.script.is_none() {
            self.tell(
                Diagnostic::error(
                    "task::missing",
                    item.name.span,
                    format!("the action `{}` does nothing", item.name.text),
                    "it runs no script",
                )
                .help(format!("add `run \"{}.rhai\"`", item.name.text)),
            );
        }
        if let Some(limit) = item.limit {
            self.time("limit", limit.quantity, limit.span);
        }
    }

    fn sentences(&mut self, said: &[Text], params: &[Param]) {
        for say in said {
            self.slots(say, params, "sentence");
            if let Err(wrong) = Template::read(&say.text) {
                let seen = "in this sentence";
                let told = Diagnostic::error("task::template", say.span, wrong.message, seen);
                self.tell(told.help(wrong.help));
            }
        }
    }

    fn task(&mut self, item: &TaskItem) {
        let mut names = self.params(&item.params);
        for was in &item.was {
            let taken = self.library.callable(&was.text).is_some();
            self.was(was, taken, "task or action");
        }
        let (ends, budget) = (&mut self.ends, &mut self.budget);
        if let Some(call) = steps::leads_back(self.library, item, ends, budget) {
            let message = if call.name.text == item.name.text {
                format!("`{}` calls itself", item.name.text)
            } else {
                format!("`{}` leads back to `{}`", call.name.text, item.name.text)
            };
            self.tell(
                Diagnostic::error("task::recursion", call.span, message, "would never end")
                    .help("write `repeat upto 3 times { … }` for what is done again"),
            );
        }
        self.sentences(&item.say, &item.params);
        self.conditions(&item.conditions, &names);
        self.settled(&item.conditions.gives);
        if let Some(limit) = item.limit {
            self.time("limit", limit.quantity, limit.span);
        }
        self.body(&item.steps, &item.recoveries, &mut names);
    }

    fn conditions(&mut self, conditions: &Conditions, names: &Names) {
        let all = [
            ("needs", &conditions.needs),
            ("keeps", &conditions.keeps),
            ("gives", &conditions.gives),
        ];
        for (what, list) in all {
            for expr in list {
                self.condition(what, expr, names);
            }
        }
    }

    /// Checks that an expression is true or false.
    fn condition(&mut self, what: &str, expr: &Expr, names: &Names) {
        let ty = self.expr(expr, names);
        if matches!(ty, Ty::Bool | Ty::Any) {
            return;
        }
        let found = Diagnostic::error(
            "task::type",
            expr.span,
            format!("`{what}` takes a condition, and this is {}", ty.words()),
            "neither true nor false",
        );
        let text = self.source.slice(expr.span);
        self.tell(match ty {
            Ty::Quantity(d) => found.help(format!("compare it, such as `{text} >= {}`", sample(d))),
            _ => found.help("write a comparison or a fluent, such as `visible(jar)`"),
        });
    }

    fn time(&mut self, what: &str, quantity: Quantity, span: Span) {
        if quantity.dimension == Dimension::TIME {
            // A day is longer than anything that is done on a table.
            if quantity.value > 0.0 && quantity.value <= 86_400.0 {
                return;
            }
            let told =
                format!("`{what}` is {quantity}; it should be more than 0 s and at most a day");
            self.tell(
                Diagnostic::error("task::amount", span, told, "out of range")
                    .help("write a time, such as `20 s`"),
            );
            return;
        }
        let text = self.source.slice(span).to_string();
        let found = Diagnostic::error(
            "task::unit",
            span,
            format!("`{what}` takes a time, and this is {}", quantity.dimension.words()),
            "not a time",
        );
        self.tell(if quantity.dimension.is_none() {
            found.help(format!("write `{text} s`")).insert(span.to, " s")
        } else {
            found.help("write a time, such as `20 s`")
        });
    }
}
