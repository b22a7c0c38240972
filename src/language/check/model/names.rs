//! Names, functions, forms and missing equations of a model.

use std::collections::{BTreeMap, BTreeSet};

use super::super::super::ast::{Expr, ExprKind, ModelFormula, Name, Span, StartValue};
use super::super::super::diagnostic::Diagnostic;
use super::super::super::parse::nearest;
use super::{Check, MODEL_CONSTANTS, MODEL_FUNCTIONS, Sort, names_in};

impl<'a> Check<'a> {
    fn declare(&mut self, name: &'a Name, sort: Sort) {
        if name.text.is_empty() {
            return;
        }
        if let Some((_, first)) = self.kinds.get(&name.text) {
            self.out.push(
                Diagnostic::error(
                    "task::duplicate",
                    name.span,
                    format!("`{}` stands for two things", name.text),
                    "the second one",
                )
                .label(*first, "the first one")
                .help("give one of them another name"),
            );
            return;
        }
        self.kinds.insert(name.text.clone(), (sort, name.span));
    }

    /// Whether an output is read off what bears its name, or off a state that follows that.
    fn measures(&self, output: &ModelFormula) -> bool {
        let own = &output.name.text;
        let follows = |name: &str| {
            let equation = self.model.equations.iter().find(|e| e.name.text == name);
            equation.is_some_and(|e| names_in(&e.formula).iter().any(|n| n == own))
        };
        names_in(&output.formula).iter().any(|name| name == own || follows(name))
    }

    /// What is declared, and what has an equation.
    pub(super) fn names(&mut self) {
        let model = self.model;
        model.inputs.iter().for_each(|i| self.declare(&i.name, Sort::Input));
        model.params.iter().for_each(|p| self.declare(&p.name, Sort::Param));
        model.states.iter().for_each(|s| self.declare(&s.name, Sort::State));
        model.lets.iter().for_each(|l| self.declare(&l.name, Sort::Let));
        for output in &model.outputs {
            // `output h = h + bias` names what is measured after the state it is a measurement of.
            if !self.measures(output) || !self.kinds.contains_key(&output.name.text) {
                self.declare(&output.name, Sort::Output);
            }
        }
        let mut told = BTreeMap::new();
        for equation in &model.equations {
            let name = &equation.name;
            if let Some(first) = told.insert(name.text.clone(), name.span) {
                self.out.push(
                    Diagnostic::error(
                        "task::duplicate",
                        name.span,
                        format!("`{}` has two equations", name.text),
                        "the second one",
                    )
                    .label(first, "the first one")
                    .help("add their right-hand sides together"),
                );
            }
            if !model.states.iter().any(|s| s.name.text == name.text) {
                let states: Vec<&str> = model.states.iter().map(|s| s.name.text.as_str()).collect();
                let found = Diagnostic::error(
                    "task::unknown_name",
                    name.span,
                    format!("`{}` is not a state of this model", name.text),
                    "only states have a rate",
                );
                self.out.push(match nearest(&name.text, states.iter().copied()) {
                    Some(near) => found.did_you_mean(near),
                    None => found.help(format!("add `state {} = free`", name.text)),
                });
            }
        }
        for state in &model.states {
            if !told.contains_key(&state.name.text) {
                self.out.push(
                    Diagnostic::error(
                        "task::missing",
                        state.name.span,
                        format!("the state `{}` has no equation", state.name.text),
                        "what is its rate?",
                    )
                    .help(format!("add `{}' = …`", state.name.text)),
                );
            }
        }
        if model.outputs.is_empty() && !model.name.text.is_empty() {
            self.out.push(
                Diagnostic::error(
                    "task::missing",
                    model.name.span,
                    format!("the model `{}` has no output", model.name.text),
                    "nothing of it is measured",
                )
                .help("add `output y = …` with what the recording measures"),
            );
        }
    }

    /// What formulas are made of.
    pub(super) fn formulas(&mut self) {
        let model = self.model;
        for start in model.params.iter().chain(&model.states) {
            if let StartValue::Fixed(formula) = &start.value {
                // Only parameters, and only those above, have a value before the first instant.
                let own = model.params.iter().position(|p| p.name.span == start.name.span);
                let above: BTreeSet<&str> = model
                    .params
                    .iter()
                    .take(own.unwrap_or(model.params.len()))
                    .map(|p| p.name.text.as_str())
                    .collect();
                self.expr(formula, Some(&above));
            }
            if let Some([low, high]) = &start.range
                && low.quantity.value >= high.quantity.value
            {
                let span = Span { from: low.span.from, to: high.span.to };
                self.out.push(
                    Diagnostic::error(
                        "task::range",
                        span,
                        "this range is empty",
                        "nothing lies in it",
                    )
                    .help("write the smaller end first"),
                );
            }
        }
        for formula in model.lets.iter().chain(&model.equations) {
            self.expr(&formula.formula, None);
        }
        for output in &model.outputs {
            // `delay(…)` around a whole output is a late sensor.
            match &output.formula.kind {
                ExprKind::Call(call) if call.name.text == "delay" && call.args.len() == 2 => {
                    for arg in &call.args {
                        arg.values.iter().for_each(|e| self.expr(e, None));
                    }
                }
                _ => self.expr(&output.formula, None),
            }
        }
        self.cycles();
    }

    /// `let a = b` and `let b = a`.
    fn cycles(&mut self) {
        let lets: BTreeMap<&str, &ModelFormula> =
            self.model.lets.iter().map(|l| (l.name.text.as_str(), l)).collect();
        for start in &self.model.lets {
            let mut seen = BTreeSet::new();
            let mut next = vec![start];
            while let Some(at) = next.pop() {
                for name in names_in(&at.formula) {
                    if name == start.name.text {
                        self.out.push(
                            Diagnostic::error(
                                "task::cycle",
                                start.name.span,
                                format!("`{name}` is defined by itself"),
                                "goes round in a circle",
                            )
                            .help("what depends on its own past is a state: give it a rate"),
                        );
                        return;
                    }
                    if let Some(inner) = lets.get(name.as_str())
                        && seen.insert(name)
                    {
                        next.push(inner);
                    }
                }
            }
        }
    }

    /// Names, functions and forms of a formula; `only` limits which names have a value.
    fn expr(&mut self, expr: &Expr, only: Option<&BTreeSet<&str>>) {
        match &expr.kind {
            ExprKind::Name(name) => self.name(name, expr.span, only),
            ExprKind::Negate(inner) => self.expr(inner, only),
            ExprKind::Binary(a, _, b) => {
                self.expr(a, only);
                self.expr(b, only);
            }
            ExprKind::Member(of, _) => {
                let name = if let ExprKind::Name(name) = &of.kind { name } else { "" };
                self.out.push(
                    Diagnostic::error(
                        "task::rate",
                        expr.span,
                        "a rate stands only on the left of its equation",
                        "not known here",
                    )
                    .help(format!(
                        "give its right-hand side a name, `let {name}_rate = …`, and use that twice"
                    )),
                );
            }
            ExprKind::Call(call) => {
                let Some((_, arity, _)) =
                    MODEL_FUNCTIONS.iter().find(|(name, ..)| *name == call.name.text)
                else {
                    let known = MODEL_FUNCTIONS.iter().map(|(name, ..)| *name);
                    let found = Diagnostic::error(
                        "task::unknown_name",
                        call.name.span,
                        format!("there is no function `{}`", call.name.text),
                        "unknown function",
                    );
                    self.out.push(match nearest(&call.name.text, known.clone()) {
                        Some(near) => found.did_you_mean(near),
                        None => found
                            .help(format!("functions: {}", known.collect::<Vec<_>>().join(" "))),
                    });
                    return;
                };
                if call.args.len() != *arity {
                    self.out.push(
                        Diagnostic::error(
                            "task::arity",
                            expr.span,
                            format!(
                                "`{}` takes {arity} value{}, not {}",
                                call.name.text,
                                if *arity == 1 { "" } else { "s" },
                                call.args.len()
                            ),
                            "wrong number of values",
                        )
                        .help("separate the values with commas"),
                    );
                }
                if call.name.text == "delay" {
                    self.delay(expr);
                }
                for value in call.args.iter().flat_map(|a| &a.values) {
                    self.expr(value, only);
                }
            }
            _ => {}
        }
    }

    /// Only what is measured has a past.
    fn delay(&mut self, expr: &Expr) {
        let ExprKind::Call(call) = &expr.kind else { return };
        let first = call.args.first().and_then(|a| a.values.first());
        let is_input = first.is_some_and(|e| {
            matches!(&e.kind, ExprKind::Name(n) if self.kinds.get(n).is_some_and(|(s, _)| *s == Sort::Input))
        });
        if !is_input {
            self.out.push(
                Diagnostic::error(
                    "task::delay",
                    expr.span,
                    "only an input, or a whole output, can be delayed",
                    "its past is not kept",
                )
                .help("write `delay(u, 40 ms)` with an input, or `output y = delay(…, 40 ms)`"),
            );
        }
        // A delay is one number for the whole recording.
        if let Some(time) = call.args.get(1).and_then(|a| a.values.first()) {
            for name in names_in(time) {
                if self.kinds.get(&name).is_some_and(|(sort, _)| *sort != Sort::Param) {
                    self.out.push(
                        Diagnostic::error(
                            "task::delay",
                            time.span,
                            "a delay does not change while the model runs",
                            format!("`{name}` does"),
                        )
                        .help("use a number or a parameter"),
                    );
                }
            }
        }
    }

    fn name(&mut self, name: &str, span: Span, only: Option<&BTreeSet<&str>>) {
        let constant = MODEL_CONSTANTS.iter().any(|(c, _)| *c == name);
        match (self.kinds.get(name), only) {
            (Some((Sort::Output, _)), _) => self.out.push(
                Diagnostic::error(
                    "task::output",
                    span,
                    format!("`{name}` is an output; formulas are of states and inputs"),
                    "an output",
                )
                .help("give what it is equal to a name with `let`, and use that in both places"),
            ),
            (Some(_), None) => {}
            (None, None) if constant || name == "t" => {}
            (_, Some(above)) if constant || above.contains(name) => {}
            (Some(_), Some(_)) => self.out.push(
                Diagnostic::error(
                    "task::order",
                    span,
                    format!("`{name}` has no value before the first instant"),
                    "not known yet",
                )
                .help("a value is made of numbers and of parameters that stand above it"),
            ),
            (None, _) => {
                let known: Vec<&str> = self.kinds.keys().map(String::as_str).collect();
                let found = Diagnostic::error(
                    "task::unknown_name",
                    span,
                    format!("this model has no `{name}`"),
                    "unknown name",
                );
                self.out.push(match nearest(name, known.into_iter()) {
                    Some(near) => found.did_you_mean(near),
                    None => found.help(format!("add `param {name} = free`, or `input {name}`")),
                });
            }
        }
    }
}
