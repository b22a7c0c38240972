//! Steps and recoveries: what is called, what must hold, what the branches are named.

use std::collections::BTreeMap;

use super::super::ast::{Act, Block, Call, Hold, Name, Recovery, Span, Step};
use super::super::builtins;
use super::super::diagnostic::Diagnostic;
use super::call::{Slot, slot};
use super::{Checker, Names};

impl Checker<'_> {
    pub(super) fn body(&mut self, steps: &[Step], recoveries: &[Recovery], names: &mut Names) {
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

    pub(super) fn act(&mut self, call: &Call, names: &Names) {
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
