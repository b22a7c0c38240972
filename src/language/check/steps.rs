//! Steps and recoveries: what is called, what must hold, what the branches are named.

use std::collections::{BTreeMap, BTreeSet};

use super::super::ast::{
    Act, Allen, Block, Call, Hold, Name, Recovery, Span, Step, TaskItem, Text, Together,
};
use super::super::builtins::{self, Ty};
use super::super::diagnostic::Diagnostic;
use super::super::library::Library;
use super::super::text;
use super::call::{Slot, slot};
use super::{Checker, Names};

impl Checker<'_> {
    pub(super) fn body(&mut self, steps: &[Step], recoveries: &[Recovery], names: &mut Names) {
        for step in steps {
            self.step(step, names);
        }
        self.labels(steps);
        if let Some(Step::Break(stop)) = steps.last() {
            self.tell(
                Diagnostic::warning(
                    "task::break",
                    stop.span,
                    "nothing follows that could be stopped before",
                    "the last step here",
                )
                .help("put it before the step that is to be looked at"),
            );
        }
        let mut found = Vec::new();
        for step in steps {
            calls(step, &mut found);
        }
        let called: Vec<&str> = found.iter().map(|call| call.name.text.as_str()).collect();
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

    /// Complains about a `by` that a relation has no use for.
    fn by_says_something(&mut self, relation: Allen, span: Span) {
        if matches!(relation, Allen::Before | Allen::Overlaps | Allen::During) {
            return;
        }
        let word = text::allen(relation);
        self.tell(
            Diagnostic::error(
                "task::timing",
                span,
                format!("`{word}` says exactly when, so there is nothing left for `by` to say"),
                "not needed",
            )
            .help("leave it out; `before`, `overlaps` and `during` take a `by`"),
        );
    }

    pub(super) fn block(&mut self, block: &Block, names: &Names) {
        let mut inside = names.clone();
        self.body(&block.steps, &block.recoveries, &mut inside);
        self.holds(&block.holds, names);
    }

    pub(super) fn holds(&mut self, holds: &[Hold], names: &Names) {
        for hold in holds {
            match hold {
                Hold::While(expr) => self.condition("while", expr, names),
                Hold::Until(expr) => self.condition("until", expr, names),
            }
        }
    }

    pub(super) fn step(&mut self, step: &Step, names: &mut Names) {
        match step {
            Step::Act(Act { call, via, holds, .. }) => {
                self.act(call, names);
                self.via(call, via);
                self.holds(holds, names);
            }
            Step::Sequence(steps, _) => steps.iter().for_each(|step| self.step(step, names)),
            Step::Block(block) => self.block(block, names),
            Step::Either(either) => self.either(either, names),
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
            Step::Each(each) => {
                self.object_type(&each.kind);
                let mut inside = names.clone();
                inside.insert(each.name.text.clone(), Ty::Object(each.kind.text.clone()));
                if let Some(when) = &each.when {
                    self.condition("when", when, &inside);
                }
                self.block(&each.block, &inside);
            }
            Step::Together(together) => self.together(together, names),
            Step::Check(expr, _) => self.condition("check", expr, names),
            Step::Let(name, expr, _) => {
                let ty = self.expr(expr, names);
                names.insert(name.text.clone(), ty);
            }
            Step::Break(stop) => {
                if let Some(when) = &stop.when {
                    self.condition("when", when, names);
                }
            }
            Step::Bad(_) => {}
        }
    }

    /// Checks steps that overlap in time: each by itself, their labels, and what `timing` says of them.
    fn together(&mut self, together: &Together, names: &Names) {
        let mut inside = names.clone();
        together.steps.iter().for_each(|step| self.step(step, &mut inside));
        self.labels(&together.steps);
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
                self.by_says_something(timing.relation, by.span);
            }
        }
    }

    /// Steps side by side carry different labels: a breakpoint or a `timing` means one of them.
    fn labels(&mut self, steps: &[Step]) {
        let mut open: Vec<&Step> = steps.iter().rev().collect();
        let mut seen: BTreeMap<&str, Span> = BTreeMap::new();
        while let Some(step) = open.pop() {
            let label = match step {
                Step::Act(act) => act.label.as_ref(),
                Step::Block(block) => block.label.as_ref(),
                Step::Sequence(inner, _) => {
                    open.extend(inner.iter().rev());
                    None
                }
                _ => None,
            };
            let Some(label) = label else { continue };
            if let Some(first) = seen.insert(&label.text, label.span) {
                self.tell(
                    Diagnostic::error(
                        "task::duplicate",
                        label.span,
                        format!("two steps here are called `{}`", label.text),
                        "the second one",
                    )
                    .label(first, "the first one")
                    .help("give each its own name"),
                );
            }
        }
    }

    /// Checks that a call has the branches that `via` names.
    fn via(&mut self, call: &Call, via: &[Name]) {
        if via.is_empty() || self.library.callable(&call.name.text).is_none() {
            return;
        }
        let mut known: Vec<String> = alternatives(call).collect();
        let mut seen = Vec::new();
        branches_in(self.library, &call.name.text, &mut seen, &mut known);
        for branch in via.iter().filter(|branch| !known.contains(&branch.text)) {
            let names: Vec<&str> = known.iter().map(String::as_str).collect();
            if names.is_empty() {
                let message = format!("there is nothing to choose in `{}`", call.name.text);
                let found = Diagnostic::error("task::via", branch.span, message, "no such branch");
                self.tell(found.help("leave `via` out"));
            } else {
                let what = format!("branch in `{}` called", call.name.text);
                self.unknown(&branch.text, branch.span, &what, &names);
            }
        }
    }

    /// Complains when an old name is still somebody's.
    pub(super) fn was(&mut self, was: &Text, taken: bool, what: &str) {
        if taken {
            self.tell(
                Diagnostic::error(
                    "task::attribute",
                    was.span,
                    format!("there still is a {what} called `{}`", was.text),
                    "not an old name",
                )
                .help("name what this was called before it was renamed"),
            );
        }
    }

    pub(super) fn act(&mut self, call: &Call, names: &Names) {
        let Some((callable, _)) = self.library.callable(&call.name.text) else {
            self.unknown_callable(&call.name);
            for value in call.args.iter().flat_map(|arg| &arg.values) {
                self.expr(value, names);
            }
            return;
        };
        let slots: Vec<Slot> = callable.params().iter().map(slot).collect();
        self.args(call, &slots, names, true);
        self.excluded(call, callable);
    }

    pub(super) fn unknown_callable(&mut self, name: &Name) {
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
}

/// The names of the branches that alternatives in a call's arguments make.
fn alternatives(call: &Call) -> impl Iterator<Item = String> + '_ {
    let several = call.args.iter().filter(|arg| arg.values.len() > 1);
    several.flat_map(|arg| arg.values.iter().map(text::expr))
}

/// Collects the names of every branch that a task may come to.
fn branches_in(library: &Library, name: &str, seen: &mut Vec<String>, out: &mut Vec<String>) {
    let Some((task, _)) = library.task(name) else { return };
    if seen.iter().any(|known| known == name) {
        return;
    }
    seen.push(name.to_owned());
    let mut open: Vec<&Step> = task.steps.iter().collect();
    let mut found = Vec::new();
    while let Some(step) = open.pop() {
        if let Step::Either(either) = step {
            out.extend(either.branches.iter().map(|branch| branch.name.text.clone()));
        }
        match step {
            Step::Act(act) => found.push(&act.call),
            step => open.extend(step.inside()),
        }
    }
    for call in found {
        out.extend(alternatives(call));
        branches_in(library, &call.name.text, seen, out);
    }
}

/// Returns the names of the branches inside a task, those of the tasks it calls included.
pub(crate) fn branches(library: &Library, name: &str) -> Vec<String> {
    let mut found = Vec::new();
    branches_in(library, name, &mut Vec::new(), &mut found);
    found
}

/// Returns a call in a task's steps that leads back to the task itself.
///
/// `ends` holds of tasks whether they lead to ends alone and not to a circle, and learns more. What is looked at
/// besides, where tasks go round in circles, is taken off `budget`; when it is used up, no more is found.
pub(super) fn leads_back<'t>(
    library: &Library,
    task: &'t TaskItem,
    ends: &mut BTreeMap<String, bool>,
    budget: &mut usize,
) -> Option<&'t Call> {
    if leads_to_ends(library, &task.name.text, ends) {
        return None;
    }
    let mut own = Vec::new();
    task.steps.iter().for_each(|step| calls(step, &mut own));
    task.recoveries.iter().flat_map(|r| &r.steps).for_each(|step| calls(step, &mut own));
    own.into_iter().find(|call| {
        let mut open = vec![call.name.text.clone()];
        let mut seen: BTreeSet<String> = BTreeSet::new();
        while let Some(name) = open.pop() {
            if name == task.name.text {
                return true;
            }
            if ends.get(&name) == Some(&true) || *budget == 0 || !seen.insert(name.clone()) {
                continue;
            }
            *budget -= 1;
            if let Some((task, _)) = library.task(&name) {
                let mut next = Vec::new();
                task.steps.iter().for_each(|step| calls(step, &mut next));
                open.extend(next.iter().map(|call| call.name.text.clone()));
            }
        }
        false
    })
}

/// Returns whether nothing that a task leads to goes round in a circle; each task is gone into once, however many
/// lead to it, and without recursion.
fn leads_to_ends(library: &Library, task: &str, ends: &mut BTreeMap<String, bool>) -> bool {
    if let Some(known) = ends.get(task) {
        return *known;
    }
    let next = |name: &str| -> Vec<String> {
        let Some((task, _)) = library.task(name) else { return Vec::new() };
        let mut found = Vec::new();
        task.steps.iter().for_each(|step| calls(step, &mut found));
        task.recoveries.iter().flat_map(|r| &r.steps).for_each(|step| calls(step, &mut found));
        found.into_iter().map(|call| call.name.text.clone()).collect()
    };
    let mut seen = BTreeSet::from([task.to_owned()]);
    let mut way = vec![(task.to_owned(), next(task), true)];
    let mut ended = true;
    while let Some((name, open, ends_here)) = way.last_mut() {
        if let Some(call) = open.pop() {
            if let Some(known) = ends.get(&call) {
                *ends_here &= known;
            } else if seen.insert(call.clone()) {
                let after = next(&call);
                way.push((call, after, true));
            } else {
                // It is being gone into: a circle.
                *ends_here = false;
            }
            continue;
        }
        let name = std::mem::take(name);
        ended = *ends_here;
        way.pop();
        if let Some((.., above)) = way.last_mut() {
            *above &= ended;
        }
        ends.insert(name, ended);
    }
    ended
}

/// Collects everything a step calls.
fn calls<'s>(step: &'s Step, out: &mut Vec<&'s Call>) {
    let mut open = vec![step];
    while let Some(step) = open.pop() {
        match step {
            Step::Act(act) => out.push(&act.call),
            step => open.extend(step.inside()),
        }
    }
}
