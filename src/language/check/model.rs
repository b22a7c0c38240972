//! What a model says that cannot be meant: names, functions, missing equations, units.
//!
//! Units are checked where they are given and worked out where they follow: with `h' = k*u`, `h: V` and
//! `u: A`, `k` is in V/(A*s). A number without a unit may stand for anything, so a model written without
//! units has nothing to object to. Angles count as numbers here, as they do in SI: `g/l*sin(q)` is a
//! legitimate rate of a rate in rad/s².

use std::collections::{BTreeMap, BTreeSet};

use super::super::ast::{
    BinaryOp, Expr, ExprKind, ModelFormula, ModelItem, Name, Span, StartValue,
};
use super::super::diagnostic::Diagnostic;
use super::super::parse::nearest;
use crate::units::Dimension;

/// The functions of formulas with the number of their arguments.
pub const MODEL_FUNCTIONS: &[(&str, usize, &str)] = &[
    ("sqrt", 1, "the square root; 0 below 0"),
    ("sin", 1, "sine"),
    ("cos", 1, "cosine"),
    ("tan", 1, "tangent"),
    ("asin", 1, "inverse sine"),
    ("acos", 1, "inverse cosine"),
    ("atan", 1, "inverse tangent"),
    ("atan2", 2, "the angle of the point (x, y), written atan2(y, x)"),
    ("exp", 1, "exponential"),
    ("log", 1, "natural logarithm"),
    ("ln", 1, "natural logarithm"),
    ("sinh", 1, "hyperbolic sine"),
    ("cosh", 1, "hyperbolic cosine"),
    ("tanh", 1, "hyperbolic tangent"),
    ("abs", 1, "absolute value"),
    ("sign", 1, "-1, 0 or 1; steep rather than broken at 0"),
    ("step", 1, "0 below 0, 1 above"),
    ("min", 2, "the smaller"),
    ("max", 2, "the larger"),
    ("clamp", 3, "the first, kept between the second and the third"),
    ("deadzone", 2, "the first, without what lies within the second on both sides of 0"),
    ("delay", 2, "an input as it was so long ago; also around a whole output"),
    ("pow", 2, "a power; `x^2` says the same"),
    ("hypot", 2, "the length of (x, y)"),
];

/// Names that stand for numbers unless the model declares them.
pub const MODEL_CONSTANTS: &[(&str, f64)] = &[("pi", std::f64::consts::PI)];

/// The units of a model's names, as far as they are given or follow.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ModelUnits {
    known: BTreeMap<String, Fine>,
}

impl ModelUnits {
    /// Returns the dimension of an input, parameter, state, definition or output, when it is known and
    /// has whole powers.
    pub fn of(&self, name: &str) -> Option<Dimension> {
        self.known.get(name).and_then(|fine| fine.whole())
    }
}

/// Exponents in twelfths, so that roots have them too: length, mass, time, angle, current, pixel.
type Exponents = [i16; 6];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Fine(Exponents);

const NUMBER: Fine = Fine([0; 6]);

impl From<Dimension> for Fine {
    fn from(d: Dimension) -> Self {
        Self([d.length, d.mass, d.time, d.angle, d.current, d.pixel].map(|e| i16::from(e) * 12))
    }
}

impl Fine {
    fn zip(self, rhs: Self, f: impl Fn(i16, i16) -> i16) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], rhs.0[i])))
    }

    fn times(self, rhs: Self) -> Self {
        self.zip(rhs, i16::saturating_add)
    }

    fn over(self, rhs: Self) -> Self {
        self.zip(rhs, i16::saturating_sub)
    }

    /// `None` where the power has no twelfths.
    fn power(self, exponent: f64) -> Option<Self> {
        let mut out = [0; 6];
        for (to, from) in out.iter_mut().zip(self.0) {
            let value = f64::from(from) * exponent;
            if (value - value.round()).abs() > 1e-9 || value.abs() > 30_000.0 {
                return None;
            }
            *to = value.round() as i16;
        }
        Some(Self(out))
    }

    /// The same but for angles, which are numbers.
    fn same(self, rhs: Self) -> bool {
        (0..6).all(|i| i == 3 || self.0[i] == rhs.0[i])
    }

    fn is_number(self) -> bool {
        self.same(NUMBER)
    }

    fn whole(self) -> Option<Dimension> {
        let mut out = [0_i8; 6];
        for (to, from) in out.iter_mut().zip(self.0) {
            if from % 12 != 0 {
                return None;
            }
            *to = i8::try_from(from / 12).ok()?;
        }
        let [length, mass, time, angle, current, pixel] = out;
        Some(Dimension { length, mass, time, angle, current, pixel })
    }

    fn words(self) -> String {
        self.whole().map_or_else(
            || "a unit with roots in it".into(),
            |d| match d.si().as_str() {
                "" => "a plain number".into(),
                unit => format!("in {unit}"),
            },
        )
    }
}

/// What is known of an expression's unit.
#[derive(Clone, Copy)]
struct Known {
    fine: Option<Fine>,
    /// A number without a unit had a part in it, so it may be otherwise.
    soft: bool,
}

const ANYTHING: Known = Known { fine: None, soft: true };

/// Checks a model by itself; it leans on nothing outside.
pub fn check_model(model: &ModelItem) -> (ModelUnits, Vec<Diagnostic>) {
    let mut check =
        Check { model, units: BTreeMap::new(), kinds: BTreeMap::new(), out: Vec::new() };
    check.names();
    check.formulas();
    if check.out.is_empty() {
        check.dimensions();
    }
    (ModelUnits { known: check.units }, check.out)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sort {
    Input,
    Param,
    State,
    Let,
    Output,
}

struct Check<'a> {
    model: &'a ModelItem,
    units: BTreeMap<String, Fine>,
    kinds: BTreeMap<String, (Sort, Span)>,
    out: Vec<Diagnostic>,
}

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

    fn names(&mut self) {
        let model = self.model;
        model.inputs.iter().for_each(|i| self.declare(&i.name, Sort::Input));
        model.params.iter().for_each(|p| self.declare(&p.name, Sort::Param));
        model.states.iter().for_each(|s| self.declare(&s.name, Sort::State));
        model.lets.iter().for_each(|l| self.declare(&l.name, Sort::Let));
        for output in &model.outputs {
            // `output h = h` names what is measured after the state it is.
            let itself =
                matches!(&output.formula.kind, ExprKind::Name(n) if *n == output.name.text);
            if !itself || !self.kinds.contains_key(&output.name.text) {
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
                let help = nearest(&name.text, states.iter().copied()).map_or_else(
                    || format!("add `state {} = free`", name.text),
                    |near| format!("did you mean `{near}`?"),
                );
                self.out.push(
                    Diagnostic::error(
                        "task::unknown_name",
                        name.span,
                        format!("`{}` is not a state of this model", name.text),
                        "only states have a rate",
                    )
                    .help(help),
                );
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

    fn formulas(&mut self) {
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
                        Some(near) => found.help(format!("did you mean `{near}`?")),
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
                    Some(near) => found.help(format!("did you mean `{near}`?")),
                    None => found.help(format!("add `param {name} = free`, or `input {name}`")),
                });
            }
        }
    }

    /// Works units out until nothing new follows, then objects.
    fn dimensions(&mut self) {
        let model = self.model;
        for input in &model.inputs {
            self.give(&input.name.text, input.unit.map(|u| u.unit.dimension));
        }
        for start in model.params.iter().chain(&model.states) {
            self.give(&start.name.text, start.unit.map(|u| u.unit.dimension));
            match &start.value {
                StartValue::Free(Some(guess)) if !is_plain(guess.quantity.dimension) => {
                    self.give(&start.name.text, Some(guess.quantity.dimension));
                }
                _ => {}
            }
        }
        for formula in model.lets.iter().chain(&model.outputs) {
            self.give(&formula.name.text, formula.unit.map(|u| u.unit.dimension));
        }
        for _ in 0..8 {
            let before = self.units.len();
            self.sweep();
            if self.units.len() == before {
                break;
            }
        }
        self.object();
    }

    fn give(&mut self, name: &str, dimension: Option<Dimension>) {
        if let Some(dimension) = dimension {
            self.units.entry(name.into()).or_insert_with(|| dimension.into());
        }
    }

    /// The unit the right-hand side of each formula must have.
    fn targets(&self) -> Vec<(&'a Name, &'a Expr, Option<Fine>)> {
        let model = self.model;
        let time = Fine::from(Dimension::TIME);
        let mut out = Vec::new();
        for start in model.params.iter().chain(&model.states) {
            if let StartValue::Fixed(formula) = &start.value {
                out.push((&start.name, formula, self.units.get(&start.name.text).copied()));
            }
        }
        for formula in model.lets.iter().chain(&model.outputs) {
            out.push((
                &formula.name,
                &formula.formula,
                self.units.get(&formula.name.text).copied(),
            ));
        }
        for equation in &model.equations {
            let of = self.units.get(&equation.name.text).map(|u| u.over(time));
            out.push((&equation.name, &equation.formula, of));
        }
        out
    }

    fn sweep(&mut self) {
        let time = Fine::from(Dimension::TIME);
        let n_rates = self.model.equations.len();
        let targets = self.targets();
        let n = targets.len();
        for (i, (name, formula, target)) in targets.into_iter().enumerate() {
            if let Some(target) = target {
                self.expect(formula, target);
            } else if let Known { fine: Some(fine), soft: false } = self.unit(formula, &mut None) {
                let of = if i >= n - n_rates { fine.times(time) } else { fine };
                self.units.entry(name.text.clone()).or_insert(of);
            }
        }
    }

    /// Passes a unit down to the names it settles.
    fn expect(&mut self, expr: &Expr, target: Fine) {
        match &expr.kind {
            ExprKind::Name(name) if self.kinds.contains_key(name) => {
                self.units.entry(name.clone()).or_insert(target);
            }
            ExprKind::Negate(inner) => self.expect(inner, target),
            ExprKind::Binary(a, BinaryOp::Add | BinaryOp::Sub, b) => {
                self.expect(a, target);
                self.expect(b, target);
            }
            ExprKind::Binary(a, BinaryOp::Mul, b) => {
                match (self.unit(a, &mut None).fine, self.unit(b, &mut None).fine) {
                    (Some(a), None) => self.expect(b, target.over(a)),
                    (None, Some(b)) => self.expect(a, target.over(b)),
                    _ => {}
                }
            }
            ExprKind::Binary(a, BinaryOp::Div, b) => {
                match (self.unit(a, &mut None).fine, self.unit(b, &mut None).fine) {
                    (Some(a), None) => self.expect(b, a.over(target)),
                    (None, Some(b)) => self.expect(a, target.times(b)),
                    _ => {}
                }
            }
            ExprKind::Call(call) => {
                let args: Vec<&Expr> = call.args.iter().flat_map(|a| &a.values).collect();
                match (call.name.text.as_str(), args.as_slice()) {
                    ("sqrt", [a]) => {
                        if let Some(square) = target.power(2.0) {
                            self.expect(a, square);
                        }
                    }
                    ("abs", [a]) => self.expect(a, target),
                    ("min" | "max" | "deadzone" | "clamp", all) => {
                        for a in all {
                            self.expect(a, target);
                        }
                    }
                    ("delay", [a, b]) => {
                        self.expect(a, target);
                        self.expect(b, Dimension::TIME.into());
                    }
                    _ => {}
                }
            }
            _ => {}
        }
    }

    fn object(&mut self) {
        for (name, formula, target) in self.targets() {
            let mut told = Some(Vec::new());
            let found = self.unit(formula, &mut told);
            let told = told.unwrap_or_default();
            let clean = told.is_empty();
            self.out.extend(told);
            if let (true, Some(target), Known { fine: Some(fine), soft: false }) =
                (clean, target, found)
                && !fine.same(target)
            {
                let rate = self.model.equations.iter().any(|e| e.formula.span == formula.span);
                self.out.push(
                    Diagnostic::error(
                        "task::unit",
                        formula.span,
                        format!(
                            "`{}{}` is {}, its formula {}",
                            name.text,
                            if rate { "'" } else { "" },
                            target.words(),
                            fine.words()
                        ),
                        "another unit",
                    )
                    .help(
                        "give a factor the unit that is missing, or none at all if it is not known",
                    ),
                );
            }
        }
        for start in self.model.params.iter().chain(&self.model.states) {
            let Some(unit) = self.units.get(&start.name.text).copied() else { continue };
            let guess = match &start.value {
                StartValue::Free(guess) => *guess,
                StartValue::Fixed(_) => None,
            };
            for literal in guess.iter().chain(start.range.iter().flatten()) {
                let fine = Fine::from(literal.quantity.dimension);
                if !is_plain(literal.quantity.dimension) && !fine.same(unit) {
                    self.out.push(
                        Diagnostic::error(
                            "task::unit",
                            literal.span,
                            format!("`{}` is {}", start.name.text, unit.words()),
                            fine.words(),
                        )
                        .help("give it in the same unit"),
                    );
                }
            }
        }
    }

    /// The unit of an expression; complains into `told` when there is one.
    fn unit(&self, expr: &Expr, told: &mut Option<Vec<Diagnostic>>) -> Known {
        let hard = |fine| Known { fine: Some(fine), soft: false };
        match &expr.kind {
            ExprKind::Literal(quantity) => {
                Known { fine: Some(quantity.dimension.into()), soft: is_plain(quantity.dimension) }
            }
            ExprKind::Name(name) => match self.units.get(name) {
                Some(fine) => hard(*fine),
                None if name == "t" => hard(Dimension::TIME.into()),
                None if MODEL_CONSTANTS.iter().any(|(c, _)| c == name) => hard(NUMBER),
                None => ANYTHING,
            },
            ExprKind::Negate(inner) => self.unit(inner, told),
            ExprKind::Binary(a, op, b) => {
                let (x, y) = (self.unit(a, told), self.unit(b, told));
                match op {
                    BinaryOp::Mul | BinaryOp::Div => {
                        let fine = x.fine.zip(y.fine).map(|(a, b)| {
                            if *op == BinaryOp::Mul { a.times(b) } else { a.over(b) }
                        });
                        Known { fine, soft: x.soft || y.soft }
                    }
                    _ => alike(expr.span, &[(a, x), (b, y)], told),
                }
            }
            ExprKind::Call(call) => {
                let args: Vec<&Expr> = call.args.iter().flat_map(|a| &a.values).collect();
                let units: Vec<Known> = args.iter().map(|a| self.unit(a, told)).collect();
                let pairs: Vec<(&Expr, Known)> =
                    args.iter().copied().zip(units.iter().copied()).collect();
                match (call.name.text.as_str(), pairs.as_slice()) {
                    ("sqrt", [(_, x)]) => {
                        Known { fine: x.fine.and_then(|f| f.power(0.5)), soft: x.soft }
                    }
                    ("abs", [(_, x)]) => *x,
                    ("delay", [(_, x), (time, by)]) => {
                        if let (Some(fine), false) = (by.fine, by.soft)
                            && !fine.same(Dimension::TIME.into())
                        {
                            tell(
                                told,
                                time.span,
                                format!("a delay is in s, this is {}", fine.words()),
                            );
                        }
                        *x
                    }
                    ("pow", [(_, x), (by, _)]) => {
                        let exponent = constant(by);
                        match (x.fine, exponent) {
                            (Some(fine), Some(n)) => Known { fine: fine.power(n), soft: x.soft },
                            (Some(fine), None) if fine.is_number() => hard(NUMBER),
                            _ => ANYTHING,
                        }
                    }
                    ("min" | "max" | "clamp" | "deadzone" | "hypot", all) => {
                        alike(expr.span, all, told)
                    }
                    ("sign" | "step", _) => hard(NUMBER),
                    ("atan2", all) => {
                        alike(expr.span, all, told);
                        hard(Dimension::ANGLE.into())
                    }
                    (name, [(arg, x)]) => {
                        if let (Some(fine), false) = (x.fine, x.soft)
                            && !fine.is_number()
                        {
                            tell(
                                told,
                                arg.span,
                                format!(
                                    "`{name}` takes a plain number or an angle, this is {}",
                                    fine.words()
                                ),
                            );
                        }
                        hard(NUMBER)
                    }
                    _ => ANYTHING,
                }
            }
            _ => ANYTHING,
        }
    }
}

/// The common unit of what is added or compared.
fn alike(span: Span, parts: &[(&Expr, Known)], told: &mut Option<Vec<Diagnostic>>) -> Known {
    let firm = parts.iter().find_map(|(_, k)| k.fine.filter(|_| !k.soft));
    let Some(firm) = firm else {
        return Known { fine: parts.iter().find_map(|(_, k)| k.fine), soft: true };
    };
    for (part, known) in parts {
        if let Known { fine: Some(fine), soft: false } = known
            && !fine.same(firm)
        {
            let _ = span;
            tell(
                told,
                part.span,
                format!("this is {}, what stands before it {}", fine.words(), firm.words()),
            );
            break;
        }
    }
    Known { fine: Some(firm), soft: false }
}

fn tell(told: &mut Option<Vec<Diagnostic>>, span: Span, message: String) {
    if let Some(told) = told {
        told.push(
            Diagnostic::error("task::unit", span, message, "another unit")
                .help("only like can be added to like; a factor may lack its unit"),
        );
    }
}

fn is_plain(dimension: Dimension) -> bool {
    dimension == Dimension::NONE
}

/// The value of an exponent that is written out.
fn constant(expr: &Expr) -> Option<f64> {
    match &expr.kind {
        ExprKind::Literal(q) if is_plain(q.dimension) => Some(q.value),
        ExprKind::Negate(inner) => constant(inner).map(|v| -v),
        ExprKind::Binary(a, BinaryOp::Div, b) => Some(constant(a)? / constant(b)?),
        _ => None,
    }
}

/// The names in a formula.
pub fn names_in(expr: &Expr) -> Vec<String> {
    let mut out = Vec::new();
    let mut todo = vec![expr];
    while let Some(expr) = todo.pop() {
        match &expr.kind {
            ExprKind::Name(name) => out.push(name.clone()),
            ExprKind::Negate(inner) | ExprKind::Member(inner, _) => todo.push(inner),
            ExprKind::Binary(a, _, b) => todo.extend([&**b, &**a]),
            ExprKind::Call(call) => {
                todo.extend(call.args.iter().rev().flat_map(|a| a.values.iter().rev()));
            }
            _ => {}
        }
    }
    out
}
