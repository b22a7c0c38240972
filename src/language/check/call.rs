//! Arguments against parameters: how many, of which name, type and unit.

use super::super::ast::{Arg, BinaryOp, Call, Expr, ExprKind, Param, Span};
use super::super::builtins::{self, Ty};
use super::super::diagnostic::Diagnostic;
use super::super::library::Callable;
use super::super::text;
use super::{Checker, Names};
use crate::units::{Dimension, Quantity};

/// Places beside things. A thing may be put away from where it stands, or back to where it stood, but not beside itself.
const BESIDE: [&str; 6] = ["next_to", "left_of", "right_of", "in_front_of", "behind", "between"];

/// A parameter as a call sees it.
pub(super) struct Slot<'a> {
    pub(super) name: &'a str,
    pub(super) ty: Ty,
    pub(super) optional: bool,
}

impl Checker<'_> {
    /// Checks the arguments of a call against its parameters, and where it does something (`does`) also its amounts.
    pub(super) fn args(&mut self, call: &Call, slots: &[Slot], names: &Names, does: bool) {
        if self.decimal_comma(call, slots) {
            return;
        }
        let mut taken: Vec<bool> = vec![false; slots.len()];
        let mut incomplete = false;
        let mut things: Vec<(&str, &str)> = Vec::new();
        for arg in &call.args {
            let at = match &arg.name {
                Some(name) => slots.iter().position(|slot| slot.name == name.text),
                None => taken.iter().position(|taken| !taken),
            };
            let wanted = at.map(|at| &slots[at].ty);
            let typed = arg.values.iter().map(|value| self.argument(value, wanted, names));
            let types: Vec<Ty> = typed.collect();
            // An argument that could not be read may have been any of them.
            if arg.values.iter().any(|value| value.kind == ExprKind::Bad) {
                incomplete = true;
                continue;
            }
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
                if does {
                    self.amount(&slots[at], value);
                }
                self.another(&slots[at], value, &mut things);
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

    /// Works out the type of an argument. Where only a few words fit, a name that nothing has is no object that is missing, and
    /// those words are what would help.
    fn argument(&mut self, value: &Expr, wanted: Option<&Ty>, names: &Names) -> Ty {
        let kind = match wanted {
            Some(Ty::Face) => "Face",
            Some(Ty::View) => "View",
            _ => return self.expr(value, names),
        };
        let ExprKind::Name(name) = &value.kind else { return self.expr(value, names) };
        let is_known = name == "any"
            || names.contains_key(name)
            || self.scope.objects.contains_key(name)
            || builtins::constant(name).is_some()
            || builtins::function(name).is_some()
            || self.library.fluent(name).is_some()
            || self.library.callable(name).is_some();
        if is_known {
            return self.expr(value, names);
        }
        let fitting = builtins::CONSTANTS.iter().filter(|(_, ty, _)| *ty == kind);
        let fitting: Vec<&str> = fitting.map(|(name, ..)| *name).collect();
        self.unknown(name, value.span, &kind.to_lowercase(), &fitting);
        Ty::Any
    }

    /// Tells of `1,5 mL`, which is two arguments, where a quantity with a unit is wanted.
    fn decimal_comma(&mut self, call: &Call, slots: &[Slot]) -> bool {
        let literal = |arg: &Arg| {
            let [value] = arg.values.as_slice() else { return None };
            let ExprKind::Literal(quantity) = value.kind else { return None };
            Some((quantity.dimension, value.span))
        };
        let found = call.args.windows(2).enumerate().find_map(|(i, pair)| {
            let slot = match &pair[0].name {
                Some(name) => slots.iter().find(|slot| slot.name == name.text)?,
                None => slots.get(i)?,
            };
            let ((whole, first), (_, second)) = (literal(&pair[0])?, literal(&pair[1])?);
            let has_unit = matches!(slot.ty, Ty::Quantity(wanted) if !wanted.is_none());
            let is_one = first.to + 1 == second.from && pair[1].name.is_none();
            (has_unit && whole.is_none() && is_one).then_some((first, second))
        });
        let Some((first, second)) = found else { return false };
        let meant = format!("{}.{}", self.source.slice(first), self.source.slice(second));
        let span = Span { from: first.from, to: second.to };
        let message = "a decimal number is written with a point";
        self.tell(
            Diagnostic::error("task::argument", span, message, "read as two arguments")
                .help(format!("write `{meant}`"))
                .fix(span, meant),
        );
        true
    }

    pub(super) fn extra_argument(&mut self, call: &Call, arg: &Arg, slots: &[Slot]) {
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
            .help(format!("write `{}`", text::call(&without_extra(call, n)))),
        );
    }

    /// Refuses a thing that is given for two parameters: nothing is poured into itself, put on or beside itself, or stands there.
    fn another<'c>(
        &mut self,
        slot: &Slot<'c>,
        value: &'c Expr,
        things: &mut Vec<(&'c str, &'c str)>,
    ) {
        if let (Ty::Place, ExprKind::Call(place)) = (&slot.ty, &value.kind)
            && BESIDE.contains(&&*place.name.text)
        {
            for of in place.args.iter().flat_map(|arg| &arg.values) {
                self.another(slot, of, &mut things.clone());
            }
            return;
        }
        let (Ty::Object(_) | Ty::Place, ExprKind::Name(name)) = (&slot.ty, &value.kind) else {
            return;
        };
        match things.iter().find(|(_, known)| known == name) {
            Some((other, _)) if *other != slot.name => self.tell(
                Diagnostic::error(
                    "task::argument",
                    value.span,
                    format!("`{name}` is given for `{other}` and for `{}`", slot.name),
                    "the same thing again",
                )
                .help("name two different things"),
            ),
            _ => things.push((slot.name, name)),
        }
    }

    /// Refuses a thing that what is called needs to be another: `needs at != table`, and `clear(table)`.
    pub(super) fn excluded(&mut self, call: &Call, callable: Callable<'_>) {
        let params = callable.params();
        let is_param = |name: &str| params.iter().any(|param| param.name.text == name);
        let mut needs: Vec<&Expr> = callable.conditions().needs.iter().collect();
        while let Some(need) = needs.pop() {
            let ExprKind::Binary(a, op, b) = &need.kind else { continue };
            match (op, &a.kind, &b.kind) {
                (BinaryOp::And, ..) => needs.extend([&**a, &**b]),
                (BinaryOp::Ne, ExprKind::Name(param), ExprKind::Name(thing))
                    if is_param(param) && !is_param(thing) =>
                {
                    let Some(value) = given(call, params, param) else { continue };
                    if value.kind != ExprKind::Name(thing.clone()) {
                        continue;
                    }
                    let name = &call.name.text;
                    let message = format!("`{param}` of `{name}` cannot be `{thing}`");
                    let found =
                        Diagnostic::error("task::argument", value.span, message, "another thing");
                    let does = callable.doc().join(" ");
                    self.tell(found.help(format!("what `{name}` does: {does}")));
                }
                _ => {}
            }
        }
    }

    /// Complains of an amount that nobody can mean, as far as it can be read off the text: less than nothing to
    /// be poured, a year to be waited.
    fn amount(&mut self, slot: &Slot, value: &Expr) {
        let Some(given) = constant(value) else { return };
        if slot.ty != Ty::Quantity(given.dimension) {
            return;
        }
        let (least, most) = meant(given.dimension);
        let of = |value: f64| Quantity { value, ..given };
        // Nothing to be poured is no amount; nothing to be waited is.
        let is_volume = given.dimension == Dimension::VOLUME;
        if (least..=most).contains(&given.value) && !(is_volume && given.value <= 0.0) {
            return;
        }
        let (from, to) = if is_volume { ("more than", "and at most") } else { ("from", "to") };
        let diagnostic = Diagnostic::error(
            "task::amount",
            value.span,
            format!(
                "`{}` is {given}; it should be {from} {} {to} {}",
                slot.name,
                of(least),
                of(most)
            ),
            "out of range",
        );
        self.tell(
            diagnostic.help(format!("write an amount such as `{}`", sample(given.dimension))),
        );
    }

    /// Complains when a value is not what a parameter takes.
    pub(super) fn fits(&mut self, name: &str, wanted: &Ty, given: &Ty, value: &Expr) {
        let fine = match (wanted, given) {
            (Ty::Any, _) | (_, Ty::Any) | (Ty::Place, Ty::Object(_)) => true,
            // What a type is that nobody defined is told where it stands.
            (Ty::Object(wanted), _) if self.library.type_names().all(|ty| ty != wanted) => true,
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
            (Ty::Quantity(d), Ty::Quantity(none)) if none.is_none() => {
                let message = format!("`{name}` is {}, and `{text}` has no unit", wanted.words());
                with_unit(Diagnostic::error(code, value.span, message, "no unit"), &text, value, *d)
            }
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
            (Ty::Object(kind), Ty::Object(_)) => {
                let fitting: Vec<&str> = self
                    .scope
                    .objects
                    .iter()
                    .filter(|(_, ty)| self.library.is_a(ty, kind))
                    .map(|(name, _)| name.as_str())
                    .collect();
                let is_here = |name: &String| self.scope.objects.contains_key(name);
                let is_thing = matches!(&value.kind, ExprKind::Name(name) if is_here(name));
                if fitting.is_empty() && is_thing {
                    found.help(none_here(wanted, kind))
                } else if fitting.is_empty() {
                    found
                } else {
                    found.help(format!("what fits here: {}", fitting.join(", ")))
                }
            }
            (Ty::Object(_), Ty::Text)
                if self.scope.objects.contains_key(text.trim_matches('"')) =>
            {
                let plain = text.trim_matches('"');
                found.help(format!("write `{plain}`, without quotes")).fix(value.span, plain)
            }
            (Ty::Face, _) => found.help("write `side` or `top`"),
            (Ty::View, _) => found.help("write `robot` or `camera`"),
            (Ty::Place, _) => {
                let thing = self.scope.objects.iter().find(|(_, ty)| *ty != "Surface");
                let beside = thing.map_or_else(String::new, |(thing, _)| {
                    format!(", a place beside one such as `left_of({thing})`")
                });
                found.help(format!(
                    "name a thing{beside}, or a point of the table such as `point(50 cm, -20 cm)`"
                ))
            }
            _ => found,
        };
        self.tell(found);
    }
}

/// Says that nothing in the scene is of a type, and where it is told what such a thing is.
fn none_here(wanted: &Ty, kind: &str) -> String {
    let wanted = wanted.words();
    format!("nothing in this scene is {wanted}; `?{kind}` at the prompt says what one is")
}

/// Returns the one value that a call gives for a parameter.
fn given<'c>(call: &'c Call, params: &[Param], name: &str) -> Option<&'c Expr> {
    let named = |arg: &&Arg| arg.name.as_ref().is_some_and(|own| own.text == name);
    let by_place = || {
        let at = params.iter().position(|param| param.name.text == name)?;
        call.args.get(at).filter(|arg| arg.name.is_none())
    };
    match call.args.iter().find(named).or_else(by_place)?.values.as_slice() {
        [value] => Some(value),
        _ => None,
    }
}

/// Returns what an expression is worth that holds nothing but numbers.
pub(super) fn constant(value: &Expr) -> Option<Quantity> {
    match &value.kind {
        ExprKind::Literal(quantity) => Some(*quantity),
        ExprKind::Negate(inner) => {
            constant(inner).map(|inner| Quantity { value: -inner.value, ..inner })
        }
        ExprKind::Binary(a, op, b) => {
            let (a, b) = (constant(a)?, constant(b)?);
            let alike = a.dimension == b.dimension;
            match op {
                BinaryOp::Add if alike => Some(Quantity { value: a.value + b.value, ..a }),
                BinaryOp::Sub if alike => Some(Quantity { value: a.value - b.value, ..a }),
                BinaryOp::Mul if a.dimension.is_none() => {
                    Some(Quantity { value: a.value * b.value, ..b })
                }
                BinaryOp::Div if b.value == 0.0 => None,
                BinaryOp::Mul | BinaryOp::Div if b.dimension.is_none() => {
                    let times = *op == BinaryOp::Mul;
                    let value = if times { a.value * b.value } else { a.value / b.value };
                    Some(Quantity { value, ..a })
                }
                _ => None,
            }
        }
        _ => None,
    }
}

/// Returns the least and the most that an argument of a step may be, SI: wide enough for anything on a table.
fn meant(dimension: Dimension) -> (f64, f64) {
    match dimension {
        Dimension::VOLUME => (0.0, 10e-3),
        Dimension::TIME => (0.0, 86_400.0),
        Dimension::MASS => (0.0, 100.0),
        Dimension::LENGTH => (-10.0, 10.0),
        _ => (-1e9, 1e9),
    }
}

/// What a parameter asks for, as a call sees it.
pub(super) fn slot(param: &Param) -> Slot<'_> {
    Slot {
        name: &param.name.text,
        ty: Ty::named(&param.ty.text),
        optional: param.default.is_some(),
    }
}

/// Returns a call with no more than `n` arguments.
fn without_extra(call: &Call, n: usize) -> Call {
    let args = call.args.iter().take(n).cloned().collect();
    Call { name: call.name.clone(), args, span: call.span }
}

pub(super) fn signature(name: &str, slots: &[Slot]) -> String {
    let params: Vec<&str> = slots.iter().map(|slot| slot.name).collect();
    format!("`{name}({})`", params.join(", "))
}

/// Says what to write instead of a number without a unit.
pub(super) fn with_unit(
    found: Diagnostic,
    text: &str,
    value: &Expr,
    dimension: Dimension,
) -> Diagnostic {
    let literal = match &value.kind {
        ExprKind::Literal(_) => true,
        ExprKind::Negate(inner) => matches!(inner.kind, ExprKind::Literal(_)),
        _ => false,
    };
    let unit = dimension.everyday_unit();
    if literal {
        found.help(format!("write `{text} {unit}`")).insert(value.span.to, format!(" {unit}"))
    } else {
        found.help(format!("write {}, such as `{}`", dimension.words(), sample(dimension)))
    }
}

/// An everyday quantity of a dimension, as an example.
pub(super) fn sample(dimension: Dimension) -> String {
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
pub(super) fn small(dimension: Dimension) -> String {
    match dimension {
        Dimension::LENGTH => "5 mm".into(),
        Dimension::NONE => "0.05".into(),
        dimension => format!("10 {}", dimension.everyday_unit()),
    }
}
