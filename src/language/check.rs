//! What a tree says that cannot be meant: unknown names, wrong arguments, types, units.
//!
//! Everything is collected, nothing stops at the first mistake, and what is already wrong has the type
//! [`Ty::Any`], so that one mistake is told once. At most one near name is suggested.

use std::collections::BTreeMap;

use super::ast::{
    Act, ActionItem, Arg, BinaryOp, Block, Call, Conditions, Expr, ExprKind, FluentItem, Hold,
    Item, Name, Param, Program, Recovery, Span, Step, TaskItem,
};
use super::builtins::{self, Ty};
use super::diagnostic::{Diagnostic, Source};
use super::library::{Library, Scope};
use super::parse::nearest;
use crate::units::{Dimension, Quantity};

/// What names mean at one place: parameters and `let`s.
type Names = BTreeMap<String, Ty>;

/// A parameter as a call sees it.
struct Slot<'a> {
    name: &'a str,
    ty: Ty,
    optional: bool,
}

/// Checks one source against a library.
pub(super) struct Checker<'a> {
    library: &'a Library,
    scope: &'a Scope,
    source: &'a Source,
    diagnostics: Vec<Diagnostic>,
    /// Fluents whose type is being worked out, outermost first.
    pending: Vec<String>,
    /// The types of the fluents worked out so far.
    fluents: BTreeMap<String, Ty>,
}

impl<'a> Checker<'a> {
    pub(super) fn new(library: &'a Library, scope: &'a Scope, source: &'a Source) -> Self {
        Self {
            library,
            scope,
            source,
            diagnostics: Vec::new(),
            pending: Vec::new(),
            fluents: BTreeMap::new(),
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
                Item::Import(_) | Item::Model(_) | Item::Bad(_) => {}
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
            Some(near) => found.help(format!("did you mean `{near}`?")),
            None if known.is_empty() => found,
            None if known.len() <= 8 => found.help(format!("known are: {}", known.join(", "))),
            None => found.help("Tab or `:help` lists what is known"),
        });
    }

    /// Checks parameters and returns what they mean inside.
    fn params(&mut self, params: &[Param]) -> Names {
        let mut names = Names::new();
        for param in params {
            let known = builtins::TYPES.iter().any(|(name, _)| *name == param.ty.text)
                || Dimension::named(&param.ty.text).is_some();
            if !known && !self.library.type_names().any(|ty| ty == param.ty.text) {
                let mut known: Vec<&str> = self.library.type_names().collect();
                known.extend(builtins::TYPES.iter().map(|(name, _)| *name));
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
            self.slots(ask, &item.params, item.span, "question");
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
    fn slots(&mut self, text: &str, params: &[Param], span: Span, what: &str) {
        for rest in text.split('{').skip(1) {
            let slot = rest.split('}').next().unwrap_or_default();
            if !params.iter().any(|param| param.name.text == slot) {
                let known: Vec<&str> = params.iter().map(|p| p.name.text.as_str()).collect();
                let found = Diagnostic::error(
                    "task::unknown_name",
                    span,
                    format!("the {what} names `{{{slot}}}`, which is no parameter"),
                    format!("in \"{text}\""),
                );
                self.tell(found.help(format!("parameters are: {}", known.join(", "))));
            }
        }
    }

    fn action(&mut self, item: &ActionItem) {
        let names = self.params(&item.params);
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

    fn task(&mut self, item: &TaskItem) {
        let mut names = self.params(&item.params);
        for say in &item.say {
            self.slots(say, &item.params, item.name.span, "sentence");
        }
        self.conditions(&item.conditions, &names);
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
            found.help(format!("write `{text} s`"))
        } else {
            found.help("write a time, such as `20 s`")
        });
    }

    fn body(&mut self, steps: &[Step], recoveries: &[Recovery], names: &mut Names) {
        for step in steps {
            self.step(step, names);
        }
        let mut called = Vec::new();
        for step in steps {
            calls(step, &mut called);
        }
        for recovery in recoveries {
            if let Some(of) = &recovery.of {
                if self.library.callable(&of.name.text).is_none() {
                    self.unknown_callable(&of.name);
                } else if !called.contains(&of.name.text.as_str()) {
                    let name = &of.name.text;
                    self.tell(
                        Diagnostic::warning(
                            "task::recovery",
                            of.name.span,
                            format!("`{name}` is not called here, so its failure is never met"),
                            "no such step",
                        )
                        .help("move the recovery to where the step is called"),
                    );
                }
                for value in of.args.iter().flat_map(|arg| &arg.values) {
                    self.expr(value, names);
                }
            }
            let mut inside = names.clone();
            for step in &recovery.steps {
                self.step(step, &mut inside);
            }
        }
    }

    fn block(&mut self, block: &Block, names: &Names) {
        let mut inside = names.clone();
        self.body(&block.steps, &block.recoveries, &mut inside);
        self.holds(&block.holds, names);
    }

    fn holds(&mut self, holds: &[Hold], names: &Names) {
        for hold in holds {
            match hold {
                Hold::While(expr) => self.condition("while", expr, names),
                Hold::Until(expr) => self.condition("until", expr, names),
            }
        }
    }

    fn step(&mut self, step: &Step, names: &mut Names) {
        match step {
            Step::Act(Act { call, holds, .. }) => {
                self.act(call, names);
                self.holds(holds, names);
            }
            Step::Sequence(steps, _) => steps.iter().for_each(|step| self.step(step, names)),
            Step::Block(block) => self.block(block, names),
            Step::Either(either) => {
                let mut seen: BTreeMap<&str, Span> = BTreeMap::new();
                for branch in &either.branches {
                    if let Some(first) = seen.insert(&branch.name.text, branch.name.span) {
                        self.tell(
                            Diagnostic::error(
                                "task::duplicate",
                                branch.name.span,
                                format!("two branches are called `{}`", branch.name.text),
                                "the second one",
                            )
                            .label(first, "the first one")
                            .help("learnt counts hang on the name, so each needs its own"),
                        );
                    }
                    if branch.prior.is_some_and(|prior| !(0.0..=1.0).contains(&prior)) {
                        self.tell(
                            Diagnostic::error(
                                "task::prior",
                                branch.name.span,
                                format!("the prior of `{}` is not a probability", branch.name.text),
                                "of this branch",
                            )
                            .help("write a number from 0 to 1"),
                        );
                    }
                    if let Some(when) = &branch.when {
                        self.condition("when", when, names);
                    }
                    self.block(&branch.block, names);
                }
                let given: Vec<f64> = either.branches.iter().filter_map(|b| b.prior).collect();
                let sum: f64 = given.iter().sum();
                let wrong = sum > 1.001 || (given.len() == either.branches.len() && sum < 0.999);
                if wrong {
                    self.tell(
                        Diagnostic::warning(
                            "task::prior",
                            either.span,
                            format!("the priors of these branches add up to {sum:.2}, not to 1"),
                            "they will be scaled",
                        )
                        .help("write priors that add up to 1"),
                    );
                }
            }
            Step::If(step) => {
                self.condition("if", &step.condition, names);
                self.block(&step.then, names);
                if let Some(otherwise) = &step.otherwise {
                    self.block(otherwise, names);
                }
            }
            Step::Repeat(repeat) => {
                self.block(&repeat.block, names);
                if let Some(until) = &repeat.until {
                    self.condition("until", until, names);
                }
            }
            Step::Together(together) => {
                let mut inside = names.clone();
                together.steps.iter().for_each(|step| self.step(step, &mut inside));
                let labels: Vec<&str> = together
                    .steps
                    .iter()
                    .filter_map(|step| match step {
                        Step::Act(act) => act.label.as_ref(),
                        Step::Block(block) => block.label.as_ref(),
                        _ => None,
                    })
                    .map(|name| name.text.as_str())
                    .collect();
                for timing in &together.timings {
                    for name in [&timing.a, &timing.b] {
                        if !labels.contains(&name.text.as_str()) {
                            self.unknown(&name.text, name.span, "step labelled", &labels);
                        }
                    }
                    if let Some(by) = timing.by {
                        self.time("by", by.quantity, by.span);
                    }
                }
            }
            Step::Check(expr, _) => self.condition("check", expr, names),
            Step::Let(name, expr, _) => {
                let ty = self.expr(expr, names);
                names.insert(name.text.clone(), ty);
            }
            Step::Bad(_) => {}
        }
    }

    fn act(&mut self, call: &Call, names: &Names) {
        let Some((callable, _)) = self.library.callable(&call.name.text) else {
            self.unknown_callable(&call.name);
            for value in call.args.iter().flat_map(|arg| &arg.values) {
                self.expr(value, names);
            }
            return;
        };
        let slots: Vec<Slot> = callable.params().iter().map(slot).collect();
        self.args(call, &slots, names);
    }

    fn unknown_callable(&mut self, name: &Name) {
        let text = &name.text;
        if builtins::function(text).is_some() || self.library.fluent(text).is_some() {
            self.tell(
                Diagnostic::error(
                    "task::not_a_step",
                    name.span,
                    format!("`{text}` is something to ask, not something to do"),
                    "a fluent",
                )
                .help(format!("to ask it, write `check {text}(…)`")),
            );
            return;
        }
        let tasks = self.library.tasks().map(|(task, _)| task.name.text.as_str());
        let actions = self.library.actions().map(|(action, _)| action.name.text.as_str());
        let known: Vec<&str> = tasks.chain(actions).collect();
        self.unknown(text, name.span, "task or action", &known);
    }

    /// Checks the arguments of a call against its parameters.
    fn args(&mut self, call: &Call, slots: &[Slot], names: &Names) {
        let mut taken: Vec<bool> = vec![false; slots.len()];
        let mut incomplete = false;
        for arg in &call.args {
            let types: Vec<Ty> = arg.values.iter().map(|value| self.expr(value, names)).collect();
            // An argument that could not be read may have been any of them.
            if arg.values.iter().any(|value| value.kind == ExprKind::Bad) {
                incomplete = true;
                continue;
            }
            let at = match &arg.name {
                Some(name) => slots.iter().position(|slot| slot.name == name.text),
                None => taken.iter().position(|taken| !taken),
            };
            let Some(at) = at else {
                incomplete |= arg.name.is_some();
                self.extra_argument(call, arg, slots);
                continue;
            };
            if taken[at] {
                self.tell(
                    Diagnostic::error(
                        "task::argument",
                        arg.span,
                        format!("`{}` is given twice", slots[at].name),
                        "the second one",
                    )
                    .help("keep one of them"),
                );
            }
            taken[at] = true;
            for (value, given) in arg.values.iter().zip(&types) {
                self.fits(slots[at].name, &slots[at].ty, given, value);
            }
        }
        if incomplete {
            return;
        }
        let missing: Vec<String> = slots
            .iter()
            .zip(&taken)
            .filter(|(slot, taken)| !slot.optional && !**taken)
            .map(|(slot, _)| format!("`{}`, {}", slot.name, slot.ty.words()))
            .collect();
        if !missing.is_empty() {
            self.tell(
                Diagnostic::error(
                    "task::argument",
                    call.span,
                    format!("`{}` lacks {}", call.name.text, missing.join(" and ")),
                    "something is missing here",
                )
                .help(format!("write {}", signature(&call.name.text, slots))),
            );
        }
    }

    fn extra_argument(&mut self, call: &Call, arg: &Arg, slots: &[Slot]) {
        if let Some(name) = &arg.name {
            let known: Vec<&str> = slots.iter().map(|slot| slot.name).collect();
            let what = format!("parameter of `{}` called", call.name.text);
            self.unknown(&name.text, name.span, &what, &known);
            return;
        }
        let n = slots.len();
        let takes = match n {
            0 => "nothing".to_string(),
            1 => "1 argument".into(),
            n => format!("{n} arguments"),
        };
        self.tell(
            Diagnostic::error(
                "task::argument",
                arg.span,
                format!("`{}` takes {takes}", call.name.text),
                "one too many",
            )
            .help(format!("write {}", signature(&call.name.text, slots))),
        );
    }

    /// Complains when a value is not what a parameter takes.
    fn fits(&mut self, name: &str, wanted: &Ty, given: &Ty, value: &Expr) {
        let fine = match (wanted, given) {
            (Ty::Any, _) | (_, Ty::Any) | (Ty::Place, Ty::Object(_)) => true,
            (Ty::Object(wanted), Ty::Object(given)) => self.library.is_a(given, wanted),
            (wanted, given) => wanted == given,
        };
        if fine {
            return;
        }
        let text = self.source.slice(value.span).to_string();
        let code = match (wanted, given) {
            (Ty::Quantity(_), Ty::Quantity(_)) => "task::unit",
            _ => "task::type",
        };
        let found = match (wanted, given) {
            (Ty::Quantity(d), Ty::Quantity(none)) if none.is_none() => Diagnostic::error(
                code,
                value.span,
                format!("`{name}` is {}, and `{text}` has no unit", wanted.words()),
                "no unit",
            )
            .help(missing_unit(&text, value, *d)),
            _ => Diagnostic::error(
                code,
                value.span,
                format!("`{name}` is {}, and `{text}` is {}", wanted.words(), given.words()),
                format!("expected {}", wanted.words()),
            ),
        };
        let found = match (wanted, given) {
            (Ty::Quantity(d), Ty::Quantity(other)) if !other.is_none() => {
                found.help(format!("write {}, such as `{}`", d.words(), sample(*d)))
            }
            (Ty::Object(wanted), Ty::Object(_)) => {
                let fitting: Vec<&str> = self
                    .scope
                    .objects
                    .iter()
                    .filter(|(_, ty)| self.library.is_a(ty, wanted))
                    .map(|(name, _)| name.as_str())
                    .collect();
                if fitting.is_empty() {
                    found
                } else {
                    found.help(format!("what fits here: {}", fitting.join(", ")))
                }
            }
            (Ty::Face, _) => found.help("write `side` or `top`"),
            _ => found,
        };
        self.tell(found);
    }

    /// Returns the type of an expression and tells what is wrong in it.
    fn expr(&mut self, expr: &Expr, names: &Names) -> Ty {
        match &expr.kind {
            ExprKind::Literal(quantity) => Ty::Quantity(quantity.dimension),
            ExprKind::Text(_) => Ty::Text,
            ExprKind::Bool(_) => Ty::Bool,
            ExprKind::Bad => Ty::Any,
            ExprKind::Name(name) => self.name(name, expr.span, names),
            ExprKind::Call(call) => self.call(call, names),
            ExprKind::Member(of, member) => self.member(of, member, names),
            ExprKind::Not(inner) => {
                self.condition("not", inner, names);
                Ty::Bool
            }
            ExprKind::Negate(inner) => match self.expr(inner, names) {
                ty @ (Ty::Quantity(_) | Ty::Any) => ty,
                ty => self.not_a_number(inner.span, &ty),
            },
            ExprKind::Within(comparison, tolerance) => {
                let given = self.expr(tolerance, names);
                let ExprKind::Binary(left, BinaryOp::Eq | BinaryOp::Ne, right) = &comparison.kind
                else {
                    self.expr(comparison, names);
                    self.tell(
                        Diagnostic::error(
                            "task::tolerance",
                            tolerance.span,
                            "`within` gives a tolerance to `==`, and there is none",
                            "tolerance of what?",
                        )
                        .help("write `x == 60 mL within 10 mL`, or leave the tolerance out"),
                    );
                    return Ty::Bool;
                };
                if let Ty::Quantity(dimension) = self.same(left, right, names) {
                    self.fits("the tolerance", &Ty::Quantity(dimension), &given, tolerance);
                }
                Ty::Bool
            }
            ExprKind::Binary(left, op, right) => self.binary(left, *op, right, expr.span, names),
        }
    }

    fn name(&mut self, name: &str, span: Span, names: &Names) -> Ty {
        if let Some(ty) = names.get(name) {
            return ty.clone();
        }
        if name == "any" {
            return Ty::Any;
        }
        if let Some(ty) = self.scope.objects.get(name) {
            return Ty::named(ty);
        }
        if let Some(ty) = builtins::constant(name) {
            return Ty::named(ty);
        }
        let callable = builtins::function(name).is_some()
            || self.library.fluent(name).is_some()
            || self.library.callable(name).is_some();
        if callable {
            self.tell(
                Diagnostic::error(
                    "task::call",
                    span,
                    format!("`{name}` wants arguments"),
                    "named, but not called",
                )
                .help(format!("write `{name}(…)`")),
            );
            return Ty::Any;
        }
        let known: Vec<&str> = names
            .keys()
            .chain(self.scope.objects.keys())
            .map(String::as_str)
            .chain(builtins::CONSTANTS.iter().map(|(name, ..)| *name))
            .collect();
        let what = if names.is_empty() { "object" } else { "parameter or object" };
        // The constants are suggested when near, but a list of what is here should name objects.
        let here: Vec<&str> =
            names.keys().chain(self.scope.objects.keys()).map(String::as_str).collect();
        match nearest(name, known.iter().copied()) {
            Some(_) => self.unknown(name, span, what, &known),
            None => self.unknown(name, span, what, &here),
        }
        Ty::Any
    }

    fn call(&mut self, call: &Call, names: &Names) -> Ty {
        let name = call.name.text.as_str();
        if let Some(function) = builtins::function(name) {
            let required = function.params.len() - function.optional;
            let slots: Vec<Slot> = function
                .params
                .iter()
                .enumerate()
                .map(|(i, (name, ty))| Slot { name, ty: Ty::named(ty), optional: i >= required })
                .collect();
            self.args(call, &slots, names);
            return Ty::named(function.result);
        }
        if let Some((fluent, _)) = self.library.fluent(name) {
            let slots: Vec<Slot> = fluent.params.iter().map(slot).collect();
            self.args(call, &slots, names);
            return self.fluent_type(fluent, call.name.span);
        }
        for value in call.args.iter().flat_map(|arg| &arg.values) {
            self.expr(value, names);
        }
        if self.library.callable(name).is_some() {
            self.tell(
                Diagnostic::error(
                    "task::not_a_fluent",
                    call.name.span,
                    format!("`{name}` is something to do, not something to ask"),
                    "a task or action",
                )
                .help("write it as a step of its own"),
            );
            return Ty::Any;
        }
        let fluents = self.library.fluents().map(|(fluent, _)| fluent.name.text.as_str());
        let known: Vec<&str> = builtins::FUNCTIONS.iter().map(|f| f.name).chain(fluents).collect();
        self.unknown(name, call.name.span, "fluent", &known);
        Ty::Any
    }

    /// Works out what a fluent is worth: true or false, or a quantity.
    fn fluent_type(&mut self, fluent: &FluentItem, span: Span) -> Ty {
        let name = &fluent.name.text;
        if self.pending.contains(name) {
            self.tell(
                Diagnostic::error(
                    "task::cycle",
                    span,
                    format!("`{name}` is explained by itself"),
                    "asked again here",
                )
                .help("say what it is by things that can be measured"),
            );
            return Ty::Any;
        }
        if let Some(ty) = self.fluents.get(name) {
            return ty.clone();
        }
        // Fluents of fluents of fluents: beyond this nobody follows, and neither does the stack.
        if self.pending.len() > 64 {
            return Ty::Any;
        }
        self.pending.push(name.clone());
        let told = self.diagnostics.len();
        let names: Names = fluent
            .params
            .iter()
            .map(|param| (param.name.text.clone(), Ty::named(&param.ty.text)))
            .collect();
        let ty = self.expr(&fluent.body, &names);
        // Its own mistakes are told where it is defined; that it leads back here is told here.
        let cycle = self.diagnostics[told..].iter().any(|d| d.code == "task::cycle");
        self.diagnostics.truncate(told);
        self.pending.pop();
        self.fluents.insert(name.clone(), ty.clone());
        if cycle && self.pending.len() == 1 {
            self.tell(
                Diagnostic::error(
                    "task::cycle",
                    span,
                    format!("`{name}` leads back to what it is to explain"),
                    "in a circle",
                )
                .help("say what it is by things that can be measured"),
            );
        }
        ty
    }

    fn member(&mut self, of: &Expr, member: &Name, names: &Names) -> Ty {
        let ExprKind::Name(object) = &of.kind else {
            self.expr(of, names);
            return self.unknown_member(member, &[]);
        };
        if let Some(ty) = builtins::member(object, &member.text) {
            return Ty::named(ty);
        }
        self.name(object, of.span, names);
        let known: Vec<&str> = builtins::MEMBERS
            .iter()
            .filter(|(its, ..)| its == object)
            .map(|(_, name, ..)| *name)
            .collect();
        self.unknown_member(member, &known)
    }

    fn unknown_member(&mut self, member: &Name, known: &[&str]) -> Ty {
        let text = &member.text;
        let function = builtins::function(text).is_some() || self.library.fluent(text).is_some();
        if known.is_empty() && function {
            self.tell(
                Diagnostic::error(
                    "task::unknown_name",
                    member.span,
                    format!("`{text}` is asked with the object in parentheses"),
                    "not a member",
                )
                .help(format!("write `{text}(…)`")),
            );
        } else {
            self.unknown(text, member.span, "member", known);
        }
        Ty::Any
    }

    fn binary(&mut self, left: &Expr, op: BinaryOp, right: &Expr, span: Span, names: &Names) -> Ty {
        match op {
            BinaryOp::Or | BinaryOp::And => {
                let word = if op == BinaryOp::Or { "or" } else { "and" };
                self.condition(word, left, names);
                self.condition(word, right, names);
                Ty::Bool
            }
            BinaryOp::Eq | BinaryOp::Ne => {
                if let Ty::Quantity(dimension) = self.same(left, right, names) {
                    self.tell(
                        Diagnostic::error(
                            "task::tolerance",
                            span,
                            "two measured quantities are never exactly equal",
                            "how close is close enough?",
                        )
                        .help(format!(
                            "add a tolerance: `{} within {}`",
                            self.source.slice(span),
                            small(dimension)
                        )),
                    );
                }
                Ty::Bool
            }
            BinaryOp::Le | BinaryOp::Ge | BinaryOp::Lt | BinaryOp::Gt => {
                match self.same(left, right, names) {
                    Ty::Quantity(_) | Ty::Any => {}
                    ty => {
                        self.not_a_number(span, &ty);
                    }
                }
                Ty::Bool
            }
            BinaryOp::Add | BinaryOp::Sub => match self.same(left, right, names) {
                ty @ (Ty::Quantity(_) | Ty::Any) => ty,
                ty => self.not_a_number(span, &ty),
            },
            BinaryOp::Mul | BinaryOp::Div => {
                let (a, b) = (self.expr(left, names), self.expr(right, names));
                match (a, b) {
                    (Ty::Quantity(a), Ty::Quantity(b)) => {
                        Ty::Quantity(if op == BinaryOp::Mul { a * b } else { a / b })
                    }
                    (Ty::Any, _) | (_, Ty::Any) => Ty::Any,
                    (Ty::Quantity(_), ty) => self.not_a_number(right.span, &ty),
                    (ty, _) => self.not_a_number(left.span, &ty),
                }
            }
        }
    }

    /// Checks that two sides are of one kind and returns it.
    fn same(&mut self, left: &Expr, right: &Expr, names: &Names) -> Ty {
        let (a, b) = (self.expr(left, names), self.expr(right, names));
        match (&a, &b) {
            (Ty::Any, _) | (_, Ty::Any) => Ty::Any,
            // Two objects may be compared whatever their types.
            (Ty::Object(_) | Ty::Place, Ty::Object(_) | Ty::Place) => a,
            (a_ty, b_ty) if a_ty == b_ty => a,
            (Ty::Quantity(d), Ty::Quantity(none)) if none.is_none() => {
                self.unit_beside(right, left, *d)
            }
            (Ty::Quantity(none), Ty::Quantity(d)) if none.is_none() => {
                self.unit_beside(left, right, *d)
            }
            _ => {
                let code = match (&a, &b) {
                    (Ty::Quantity(_), Ty::Quantity(_)) => "task::unit",
                    _ => "task::type",
                };
                self.tell(
                    Diagnostic::error(
                        code,
                        right.span,
                        format!(
                            "`{}` is {}, and `{}` is {}",
                            self.source.slice(left.span),
                            a.words(),
                            self.source.slice(right.span),
                            b.words()
                        ),
                        format!("this is {}", b.words()),
                    )
                    .label(left.span, format!("this is {}", a.words()))
                    .help("put quantities of one kind on both sides"),
                );
                Ty::Any
            }
        }
    }

    /// `bare` has no unit beside `other`, which has one.
    fn unit_beside(&mut self, bare: &Expr, other: &Expr, dimension: Dimension) -> Ty {
        let text = self.source.slice(bare.span).to_string();
        self.tell(
            Diagnostic::error(
                "task::unit",
                bare.span,
                format!(
                    "`{}` is {}, and `{text}` has no unit",
                    self.source.slice(other.span),
                    dimension.words()
                ),
                "no unit",
            )
            .help(missing_unit(&text, bare, dimension)),
        );
        Ty::Any
    }

    fn not_a_number(&mut self, span: Span, ty: &Ty) -> Ty {
        self.tell(
            Diagnostic::error(
                "task::type",
                span,
                format!(
                    "this takes quantities, and `{}` is {}",
                    self.source.slice(span),
                    ty.words()
                ),
                "not a quantity",
            )
            .help("measure it first, such as `height(jar)`"),
        );
        Ty::Any
    }
}

/// What a parameter asks for, as a call sees it.
fn slot(param: &Param) -> Slot<'_> {
    Slot {
        name: &param.name.text,
        ty: Ty::named(&param.ty.text),
        optional: param.default.is_some(),
    }
}

fn signature(name: &str, slots: &[Slot]) -> String {
    let params: Vec<&str> = slots.iter().map(|slot| slot.name).collect();
    format!("`{name}({})`", params.join(", "))
}

/// What to write instead of a number without a unit.
fn missing_unit(text: &str, value: &Expr, dimension: Dimension) -> String {
    let literal = match &value.kind {
        ExprKind::Literal(_) => true,
        ExprKind::Negate(inner) => matches!(inner.kind, ExprKind::Literal(_)),
        _ => false,
    };
    if literal {
        format!("write `{text} {}`", dimension.everyday_unit())
    } else {
        format!("write {}, such as `{}`", dimension.words(), sample(dimension))
    }
}

/// An everyday quantity of a dimension, as an example.
fn sample(dimension: Dimension) -> String {
    let number = match dimension {
        Dimension::LENGTH => "12",
        Dimension::VOLUME => "60",
        Dimension::ANGLE => "45",
        Dimension::MASS => "200",
        _ => "5",
    };
    format!("{number} {}", dimension.everyday_unit()).trim_end().into()
}

/// An everyday tolerance of a dimension, as an example.
fn small(dimension: Dimension) -> String {
    match dimension {
        Dimension::LENGTH => "5 mm".into(),
        Dimension::NONE => "0.05".into(),
        dimension => format!("10 {}", dimension.everyday_unit()),
    }
}

/// Collects the names of everything a step calls.
fn calls<'s>(step: &'s Step, out: &mut Vec<&'s str>) {
    let block = |block: &'s Block, out: &mut Vec<&'s str>| {
        block.steps.iter().for_each(|step| calls(step, out));
    };
    match step {
        Step::Act(act) => out.push(&act.call.name.text),
        Step::Sequence(steps, _) => steps.iter().for_each(|step| calls(step, out)),
        Step::Block(inner) => block(inner, out),
        Step::Either(either) => either.branches.iter().for_each(|b| block(&b.block, out)),
        Step::If(step) => {
            block(&step.then, out);
            if let Some(otherwise) = &step.otherwise {
                block(otherwise, out);
            }
        }
        Step::Repeat(repeat) => block(&repeat.block, out),
        Step::Together(together) => together.steps.iter().for_each(|step| calls(step, out)),
        Step::Check(..) | Step::Let(..) | Step::Bad(_) => {}
    }
}
