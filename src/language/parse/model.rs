//! The grammar's pairs → models: inputs, parameters, states, equations and outputs.
//!
//! A formula is read into the same [`Expr`] as any other; a power becomes a call of `pow` and a rate on a
//! right-hand side a member `x.'`. What its names mean is `language::check`'s question.

use super::super::ast::{
    Arg, Call, Expr, ExprKind, Literal, ModelFormula, ModelItem, ModelSignal, ModelStart,
    ModelUnit, Name, Span, StartValue,
};
use super::super::diagnostic::Diagnostic;
use super::build::{Builder, find};
use super::expression::{no_name, nothing};
use super::grammar::{Pair, Place, Rule};
use crate::units::{Unit, known_units, suggest_unit};

impl Builder<'_> {
    /// Reads `model name { … }`.
    pub(super) fn model(&mut self, doc: Vec<String>, pair: &Pair, span: Span) -> ModelItem {
        let mut item = ModelItem {
            doc,
            name: no_name(span),
            inputs: Vec::new(),
            params: Vec::new(),
            states: Vec::new(),
            lets: Vec::new(),
            equations: Vec::new(),
            outputs: Vec::new(),
            body: Span { from: span.to, to: span.to },
            span,
        };
        let (mut from, mut to) = (None, None);
        for part in pair.clone().into_inner() {
            match part.as_rule() {
                Rule::id => item.name = self.name(&part),
                Rule::lbr => from = Some(part.as_span().end()),
                Rule::rbr => to = Some(part.as_span().start()),
                Rule::inputs => {
                    let signals = part.into_inner().filter(|p| p.as_rule() == Rule::signal);
                    item.inputs.extend(signals.filter_map(|p| self.signal(&p)));
                }
                Rule::parameters => item.params.extend(self.starts(&part)),
                Rule::states => item.states.extend(self.starts(&part)),
                Rule::define => item.lets.extend(self.named_in(&part)),
                Rule::outputs => item.outputs.extend(self.named_in(&part)),
                Rule::equation => item.equations.extend(self.equation(&part)),
                Rule::bad_entry => {
                    self.bad(&part, Place::Model);
                }
                _ => {}
            }
        }
        if let (Some(from), Some(to)) = (from, to) {
            item.body = self.balanced.original(from, to);
        }
        item
    }

    fn signal(&mut self, pair: &Pair) -> Option<ModelSignal> {
        let name = self.name(&find(pair, Rule::id)?);
        Some(ModelSignal { name, unit: self.in_unit(pair) })
    }

    fn starts(&mut self, pair: &Pair) -> Vec<ModelStart> {
        let starts = pair.clone().into_inner().filter(|p| p.as_rule() == Rule::start);
        starts.filter_map(|p| self.start(&p)).collect()
    }

    /// Reads `k: 1/s = free ~ 0.05 in 0 to 1`.
    fn start(&mut self, pair: &Pair) -> Option<ModelStart> {
        let name = self.name(&find(pair, Rule::id)?);
        let unit = self.in_unit(pair);
        let value = if let Some(formula) = find(pair, Rule::formula) {
            StartValue::Fixed(self.formula(&formula))
        } else {
            let holder = find(pair, Rule::free).unwrap_or_else(|| pair.clone());
            let guess = find(&holder, Rule::first_guess).and_then(|p| find(&p, Rule::signed));
            StartValue::Free(guess.map(|p| self.signed(&p)))
        };
        let range = find(pair, Rule::range).and_then(|range| {
            let ends: Vec<Literal> = range
                .into_inner()
                .filter(|p| p.as_rule() == Rule::signed)
                .map(|p| self.signed(&p))
                .collect();
            <[Literal; 2]>::try_from(ends).ok()
        });
        Some(ModelStart { name, unit, value, range, span: self.span(pair) })
    }

    fn named_in(&mut self, pair: &Pair) -> Vec<ModelFormula> {
        let named = pair.clone().into_inner().filter(|p| p.as_rule() == Rule::named);
        named
            .filter_map(|p| {
                let name = self.name(&find(&p, Rule::id)?);
                let unit = self.in_unit(&p);
                let formula = self.formula(&find(&p, Rule::formula)?);
                Some(ModelFormula { name, unit, formula, span: self.span(&p) })
            })
            .collect()
    }

    fn equation(&mut self, pair: &Pair) -> Option<ModelFormula> {
        let name = self.name(&find(&find(pair, Rule::rate)?, Rule::id)?);
        let formula = self.formula(&find(pair, Rule::formula)?);
        Some(ModelFormula { name, unit: None, formula, span: self.span(pair) })
    }

    /// Reads `: V`.
    fn in_unit(&mut self, pair: &Pair) -> Option<ModelUnit> {
        let text = find(&find(pair, Rule::in_unit)?, Rule::unit_text)?;
        let span = self.span(&text);
        let Ok(unit) = Unit::parse(text.as_str()) else {
            let found = Diagnostic::error(
                "task::unit",
                span,
                format!("`{}` is not a unit", text.as_str()),
                "unknown unit",
            );
            self.diagnostics.push(match suggest_unit(text.as_str()) {
                Some(unit) => found
                    .help(format!("write `{unit}`  (units: {})", known_units()))
                    .fix(span, unit),
                None => found.help(format!(
                    "units: {} and their products, such as `N*m*s/rad`; leave it out if it has none",
                    known_units()
                )),
            });
            return None;
        };
        Some(ModelUnit { unit, span })
    }

    /// Reads a formula; its span covers the parentheses around it.
    fn formula(&mut self, pair: &Pair) -> Expr {
        let span = self.span(pair);
        Expr { span, ..self.part_of_formula(pair) }
    }

    fn part_of_formula(&mut self, pair: &Pair) -> Expr {
        let span = self.span(pair);
        match pair.as_rule() {
            Rule::formula | Rule::formula_product => self.chain(pair, span),
            Rule::formula_factor => self.prefixed(pair, span, Rule::minus, ExprKind::Negate),
            Rule::formula_power | Rule::formula_exponent => self.power(pair, span),
            Rule::formula_call => self.formula_call(pair, span),
            Rule::quant => Expr { kind: ExprKind::Literal(self.literal(pair).quantity), span },
            Rule::id => Expr { kind: ExprKind::Name(pair.as_str().into()), span },
            Rule::rate => {
                let Some(id) = find(pair, Rule::id) else { return nothing(span) };
                let of = Expr { kind: ExprKind::Name(id.as_str().into()), span: self.span(&id) };
                let prime = Name { text: "'".into(), span };
                Expr { kind: ExprKind::Member(Box::new(of), prime), span }
            }
            _ => nothing(span),
        }
    }

    /// `a`, `a^b`, `-a` as an exponent.
    fn power(&mut self, pair: &Pair, span: Span) -> Expr {
        let mut base = None;
        let mut exponent = None;
        let mut negative = false;
        for part in pair.clone().into_inner() {
            match part.as_rule() {
                Rule::minus => negative = true,
                Rule::power_sign | Rule::lpar | Rule::rpar => {}
                Rule::formula_exponent => exponent = Some(self.expr(&part)),
                _ => base = Some(self.expr(&part)),
            }
        }
        let Some(base) = base else { return nothing(span) };
        let base =
            if negative { Expr { kind: ExprKind::Negate(Box::new(base)), span } } else { base };
        let Some(exponent) = exponent else { return base };
        let name = Name { text: "pow".into(), span };
        let arg = |value: Expr| Arg { name: None, span: value.span, values: vec![value] };
        let args = vec![arg(base), arg(exponent)];
        Expr { kind: ExprKind::Call(Call { name, args, span }), span }
    }

    fn formula_call(&mut self, pair: &Pair, span: Span) -> Expr {
        let Some(name) = find(pair, Rule::id).map(|p| self.name(&p)) else { return nothing(span) };
        let args = pair
            .clone()
            .into_inner()
            .filter(|p| p.as_rule() == Rule::formula)
            .map(|p| Arg { name: None, values: vec![self.formula(&p)], span: self.span(&p) })
            .collect();
        Expr { kind: ExprKind::Call(Call { name, args, span }), span }
    }

    /// The rules of formulas, for [`Builder::expr`].
    pub(super) fn formula_rule(&mut self, pair: &Pair) -> Option<Expr> {
        matches!(
            pair.as_rule(),
            Rule::formula
                | Rule::formula_product
                | Rule::formula_factor
                | Rule::formula_power
                | Rule::formula_exponent
                | Rule::formula_call
                | Rule::rate
                | Rule::id
        )
        .then(|| self.part_of_formula(pair))
    }
}
