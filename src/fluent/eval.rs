//! From an expression to what it is worth: names, operators, comparisons, quantifiers.

use std::cmp::Ordering;

use nalgebra::Vector3;

use super::reading::{Direction, Error, Reading, Term};
use super::{Evaluator, builtin, wording};
use crate::language::ast::{Arg, BinaryOp, Call, Expr, ExprKind};
use crate::language::bind::{self, Scope};
use crate::language::text;
use crate::units::{Dimension, Quantity};
use crate::world::Region;

/// Fluents inside fluents inside fluents: past this depth one is defined in terms of itself.
const DEEPEST: usize = 64;
/// A margin smaller than this many standard deviations decides nothing (LANGUAGE 3.4).
const DECIDES: f64 = 2.0;

/// A number with its unit, its doubt, and the way it grows.
#[derive(Debug, Clone)]
pub(super) struct Measure {
    /// SI; `None` when nobody knows.
    pub(super) value: Option<f64>,
    pub(super) dimension: Dimension,
    /// One standard deviation, SI.
    pub(super) sigma: f64,
    /// The thing whose motion along this unit vector (world) makes the value grow.
    pub(super) grows: Option<(String, Vector3<f64>)>,
    /// Why nobody knows.
    pub(super) unknown: Option<String>,
}

impl Measure {
    pub(super) fn exact(value: f64, dimension: Dimension) -> Self {
        Self { value: Some(value), dimension, sigma: 0.0, grows: None, unknown: None }
    }

    pub(super) fn unknown(dimension: Dimension, why: String) -> Self {
        Self { value: None, dimension, sigma: 0.0, grows: None, unknown: Some(why) }
    }

    fn quantity(&self) -> Option<Quantity> {
        self.value.map(|value| Quantity { value, dimension: self.dimension })
    }
}

/// What an expression can be.
#[derive(Debug, Clone)]
pub(super) enum Value {
    Measure(Measure),
    Truth(Box<Reading>),
    Place(builtin::Place),
    /// Where something may stand.
    Region(Region),
    /// An object, `gripper`, `table` or `any`.
    Thing(String),
    /// Any other word: `side`, `top`.
    Word(String),
}

impl Value {
    fn kind(&self) -> &'static str {
        match self {
            Self::Measure(_) => "a quantity",
            Self::Truth(_) => "true or false",
            Self::Place(_) => "a place",
            Self::Region(_) => wording::A_REGION,
            Self::Thing(_) => "a thing",
            Self::Word(_) => "a word",
        }
    }
}

/// Evaluates what is true or false.
pub(super) fn truth(on: &Evaluator<'_>, expr: &Expr, depth: usize) -> Result<Reading, Error> {
    match value(on, expr, depth)? {
        Value::Truth(reading) => Ok(*reading),
        Value::Word(name) => Err(unknown_name(on, &name)),
        other => Err(kind(expr, &other, wording::A_TRUTH)),
    }
}

/// Evaluates a quantity.
pub(super) fn measure(on: &Evaluator<'_>, expr: &Expr, depth: usize) -> Result<Measure, Error> {
    match value(on, expr, depth)? {
        Value::Measure(measure) => Ok(measure),
        Value::Word(name) => Err(unknown_name(on, &name)),
        other => Err(kind(expr, &other, "a quantity")),
    }
}

/// Evaluates anything.
pub(super) fn value(on: &Evaluator<'_>, expr: &Expr, depth: usize) -> Result<Value, Error> {
    if is_atom(expr) && mentions_any(expr) {
        return Ok(Value::Truth(Box::new(some_object(on, expr, depth)?)));
    }
    let reading = |reading| Ok(Value::Truth(Box::new(reading)));
    match &expr.kind {
        ExprKind::Literal(q) => Ok(Value::Measure(Measure::exact(q.value, q.dimension))),
        ExprKind::Text(text) => Ok(Value::Word(text.clone())),
        ExprKind::Bool(truth) => reading(Reading::plain(expr, Some(*truth), None)),
        ExprKind::Name(name) => Ok(named(on, name)),
        ExprKind::Call(call) => called(on, expr, call, depth),
        ExprKind::Member(of, name) => match value(on, of, depth)? {
            Value::Thing(thing) => builtin::member(on, expr, &thing, &name.text),
            Value::Word(word) => Err(unknown_name(on, &word)),
            other => Err(kind(of, &other, "a thing")),
        },
        ExprKind::Not(inner) => reading(truth(on, inner, depth)?.negated()),
        ExprKind::Negate(inner) => {
            let mut m = measure(on, inner, depth)?;
            m.value = m.value.map(|v| -v);
            m.grows = m.grows.map(|(thing, way)| (thing, -way));
            Ok(Value::Measure(m))
        }
        ExprKind::Binary(a, op @ (BinaryOp::And | BinaryOp::Or), b) => {
            let (a, b) = (truth(on, a, depth)?, truth(on, b, depth)?);
            reading(a.joined(b, *op == BinaryOp::And))
        }
        ExprKind::Binary(
            a,
            op @ (BinaryOp::Add | BinaryOp::Sub | BinaryOp::Mul | BinaryOp::Div),
            b,
        ) => {
            let left = measure(on, a, depth)?;
            let right = measure(on, b, depth)?;
            arithmetic((a, left), *op, (b, right)).map(Value::Measure)
        }
        ExprKind::Binary(a, op, b) => reading(compare(on, expr, (a, *op, b), None, depth)?),
        ExprKind::Within(inner, by) => {
            let ExprKind::Binary(a, op, b) = &inner.kind else {
                let found = value(on, inner, depth)?;
                return Err(kind(inner, &found, wording::A_COMPARISON));
            };
            let tolerance = measure(on, by, depth)?;
            reading(compare(on, expr, (a, *op, b), Some(&(&**by, tolerance)), depth)?)
        }
        ExprKind::Bad => Err(Error::Unreadable),
    }
}

fn named(on: &Evaluator<'_>, name: &str) -> Value {
    if let Some(q) = on.bindings.get(name) {
        return Value::Measure(Measure::exact(q.value, q.dimension));
    }
    let is_thing = matches!(name, "gripper" | "table" | "any") || on.scene.object(name).is_some();
    if is_thing { Value::Thing(name.to_owned()) } else { Value::Word(name.to_owned()) }
}

/// Calls a fluent of the program, or failing that a function of the language.
fn called(on: &Evaluator<'_>, expr: &Expr, call: &Call, depth: usize) -> Result<Value, Error> {
    let name = &call.name.text;
    let Some(item) = on.fluents.fluent(name) else {
        return builtin::call(on, expr, call, depth);
    };
    if depth >= DEEPEST {
        return Err(Error::Circular { name: name.clone() });
    }
    let bound = bind::arguments(&format!("fluent `{name}`"), &item.params, call)
        .map_err(|misfit| Error::Arguments { message: misfit.message })?;
    let mut scope = Scope::new();
    for argument in bound {
        let [value] = argument.values.as_slice() else {
            let message = wording::more_than_one(&argument.name, name);
            return Err(Error::Arguments { message });
        };
        let value = if argument.default { bind::fill(value, &scope) } else { value.clone() };
        scope.insert(argument.name, value);
    }
    let body = bind::fill(&item.body, &scope);
    let mut value = value(on, &body, depth + 1)?;
    if let Value::Truth(reading) = &mut value {
        reading.fluent.get_or_insert_with(|| name.clone());
    }
    Ok(value)
}

/// Whether an expression is the widest that one `any` can range over.
fn is_atom(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Call(_) | ExprKind::Within(..) | ExprKind::Member(..) => true,
        ExprKind::Binary(_, op, _) => !matches!(op, BinaryOp::And | BinaryOp::Or),
        _ => false,
    }
}

fn mentions_any(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Name(name) => name == "any",
        ExprKind::Call(call) => call.args.iter().flat_map(|arg| &arg.values).any(mentions_any),
        ExprKind::Member(inner, _) | ExprKind::Not(inner) | ExprKind::Negate(inner) => {
            mentions_any(inner)
        }
        ExprKind::Binary(a, _, b) | ExprKind::Within(a, b) => mentions_any(a) || mentions_any(b),
        ExprKind::Literal(_) | ExprKind::Text(_) | ExprKind::Bool(_) | ExprKind::Bad => false,
    }
}

/// `φ(any)`: some object of the scene for which φ holds.
fn some_object(on: &Evaluator<'_>, expr: &Expr, depth: usize) -> Result<Reading, Error> {
    let mut found: Option<Reading> = None;
    for object in &on.scene.objects {
        let stands_for = Expr { kind: ExprKind::Name(object.name.clone()), span: expr.span };
        let scope = Scope::from([("any".to_owned(), stands_for)]);
        let reading = truth(on, &bind::fill(expr, &scope), depth)?;
        found = Some(match found {
            Some(best) => best.joined(reading, false),
            None => reading,
        });
    }
    Ok(found.unwrap_or_else(|| Reading::plain(expr, Some(false), None)))
}

fn arithmetic(
    (left, a): (&Expr, Measure),
    op: BinaryOp,
    (right, b): (&Expr, Measure),
) -> Result<Measure, Error> {
    let unknown = a.unknown.clone().or_else(|| b.unknown.clone());
    let combine = |f: fn(f64, f64) -> f64| Some(f(a.value?, b.value?)).filter(|v| v.is_finite());
    let turned = |grows: &Option<(String, Vector3<f64>)>, sign: f64| {
        grows.as_ref().map(|(thing, way)| (thing.clone(), way * sign))
    };
    let (value, dimension, sigma, grows) = match op {
        BinaryOp::Add | BinaryOp::Sub => {
            if a.dimension != b.dimension {
                return Err(Error::Dimension { left: text::expr(left), right: text::expr(right) });
            }
            let sign = if op == BinaryOp::Add { 1.0 } else { -1.0 };
            let sum: fn(f64, f64) -> f64 =
                if op == BinaryOp::Add { |x, y| x + y } else { |x, y| x - y };
            let grows = turned(&a.grows, 1.0).or_else(|| turned(&b.grows, sign));
            (combine(sum), a.dimension, a.sigma.hypot(b.sigma), grows)
        }
        BinaryOp::Mul => {
            let (x, y) = (a.value.unwrap_or(0.0), b.value.unwrap_or(0.0));
            let sigma = (x * b.sigma).hypot(y * a.sigma);
            let grows = turned(&a.grows, y.signum()).or_else(|| turned(&b.grows, x.signum()));
            (combine(|x, y| x * y), add(a.dimension, b.dimension, 1), sigma, grows)
        }
        _ => {
            let (x, y) = (a.value.unwrap_or(0.0), b.value.unwrap_or(f64::INFINITY));
            let sigma = (a.sigma / y).hypot(x * b.sigma / (y * y));
            let grows = turned(&a.grows, y.signum());
            (combine(|x, y| x / y), add(a.dimension, b.dimension, -1), sigma, grows)
        }
    };
    let by_zero = matches!(op, BinaryOp::Div) && b.value.is_some_and(|by| by == 0.0);
    let say: fn(&str) -> String = if by_zero { wording::zero_divisor } else { wording::no_number };
    let why = || unknown.unwrap_or_else(|| say(&text::expr(right)));
    let unknown = if value.is_none() { Some(why()) } else { None };
    Ok(Measure { value, dimension, sigma, grows, unknown })
}

fn add(a: Dimension, b: Dimension, sign: i8) -> Dimension {
    let sum = |x: i8, y: i8| x.saturating_add(y.saturating_mul(sign));
    Dimension {
        length: sum(a.length, b.length),
        mass: sum(a.mass, b.mass),
        time: sum(a.time, b.time),
        angle: sum(a.angle, b.angle),
        current: sum(a.current, b.current),
        pixel: sum(a.pixel, b.pixel),
    }
}

fn compare(
    on: &Evaluator<'_>,
    expr: &Expr,
    (a, op, b): (&Expr, BinaryOp, &Expr),
    tolerance: Option<&(&Expr, Measure)>,
    depth: usize,
) -> Result<Reading, Error> {
    let (left, right) = (value(on, a, depth)?, value(on, b, depth)?);
    let (left, right) = match (left, right) {
        (Value::Measure(left), Value::Measure(right)) => (left, right),
        (left, right) => return same(on, expr, (a, left), op, (b, right)),
    };
    if left.dimension != right.dimension {
        return Err(Error::Dimension { left: text::expr(a), right: text::expr(b) });
    }
    let within = match tolerance {
        Some((by, tolerance)) if tolerance.dimension != left.dimension => {
            return Err(Error::Dimension { left: text::expr(a), right: text::expr(by) });
        }
        Some((_, tolerance)) => match tolerance.quantity() {
            Some(is) if is.value <= 0.0 => {
                let least = Quantity { value: 0.0, ..is };
                return Err(Error::Tolerance { is: is.to_string(), least: least.to_string() });
            }
            is => is.map(|is| is.value),
        },
        None if matches!(op, BinaryOp::Eq | BinaryOp::Ne) => {
            return Err(Error::NoTolerance { term: text::expr(expr) });
        }
        None => None,
    };
    let slack = within.unwrap_or(0.0);
    // margin(a, b) and the sign with which it grows with a.
    let (margin, sign): (fn(f64, f64, f64) -> f64, f64) = match op {
        BinaryOp::Ge | BinaryOp::Gt => (|x, y, t| x - y + t, 1.0),
        BinaryOp::Eq | BinaryOp::Ne => {
            let above = left.value > right.value;
            let sign = if above == (op == BinaryOp::Ne) { 1.0 } else { -1.0 };
            if op == BinaryOp::Eq {
                (|x, y, t| t - (x - y).abs(), sign)
            } else {
                (|x, y, t| (x - y).abs() - t, sign)
            }
        }
        _ => (|x, y, t| y - x + t, -1.0),
    };
    let lacks = tolerance.is_some_and(|(_, t)| t.value.is_none());
    let margin = match (left.value, right.value) {
        (Some(x), Some(y)) if !lacks => Some(margin(x, y, slack)).filter(|m| m.is_finite()),
        _ => None,
    };
    let grows = match (&left.grows, &right.grows) {
        (Some((thing, way)), _) => Some((thing.clone(), way * sign)),
        (None, Some((thing, way))) => Some((thing.clone(), way * -sign)),
        (None, None) => None,
    };
    let unknown = left.unknown.clone().or(right.unknown.clone());
    Ok(with_margin(
        on,
        expr,
        &Comparison {
            value: left.quantity(),
            limit: right.quantity(),
            margin,
            dimension: left.dimension,
            sigma: left.sigma.hypot(right.sigma),
            tolerance: within
                .filter(|t| *t > 0.0)
                .unwrap_or_else(|| usual_tolerance(left.dimension)),
            is_strict: matches!(op, BinaryOp::Lt | BinaryOp::Gt | BinaryOp::Ne),
            grows,
            unknown,
        },
    ))
}

/// `==` and `!=` between things, words and truths.
fn same(
    on: &Evaluator<'_>,
    expr: &Expr,
    (a, left): (&Expr, Value),
    op: BinaryOp,
    (b, right): (&Expr, Value),
) -> Result<Reading, Error> {
    let is_same = match (&left, &right) {
        (Value::Thing(x) | Value::Word(x), Value::Thing(y) | Value::Word(y)) => Some(x == y),
        (Value::Truth(x), Value::Truth(y)) => match (x.truth, y.truth) {
            (Some(x), Some(y)) => Some(x == y),
            _ => None,
        },
        (Value::Measure(_), Value::Word(word)) | (Value::Word(word), Value::Measure(_)) => {
            return Err(unknown_name(on, word));
        }
        (Value::Measure(_), other) => return Err(kind(b, other, "a quantity")),
        (other, _) => return Err(kind(a, other, "a quantity")),
    };
    let truth = match op {
        BinaryOp::Eq => is_same,
        BinaryOp::Ne => is_same.map(|same| !same),
        _ => return Err(kind(a, &left, "a quantity")),
    };
    Ok(Reading::plain(expr, truth, Some(wording::ONE_SIDE.into())))
}

/// What a comparison found.
pub(super) struct Comparison {
    pub(super) value: Option<Quantity>,
    pub(super) limit: Option<Quantity>,
    pub(super) margin: Option<f64>,
    pub(super) dimension: Dimension,
    pub(super) sigma: f64,
    pub(super) tolerance: f64,
    /// Whether a margin of exactly 0 does not hold.
    pub(super) is_strict: bool,
    /// The thing whose motion along this vector makes the *margin* grow.
    pub(super) grows: Option<(String, Vector3<f64>)>,
    pub(super) unknown: Option<String>,
}

/// Returns the reading of a comparison.
pub(super) fn with_margin(on: &Evaluator<'_>, expr: &Expr, found: &Comparison) -> Reading {
    let quantity = |value| Quantity { value, dimension: found.dimension };
    let mut unknown = found.unknown.clone();
    let truth = found.margin.and_then(|margin| {
        if margin.abs() < DECIDES * found.sigma {
            let (margin, sigma) = (quantity(margin), quantity(found.sigma));
            let (margin, sigma) = (text::quantity(margin), text::quantity(sigma));
            unknown = Some(wording::within_noise(&margin, &sigma));
            return None;
        }
        Some(margin > 0.0 || (margin >= 0.0 && !found.is_strict))
    });
    if truth.is_none() {
        unknown.get_or_insert_with(|| wording::NO_VALUE.into());
    }
    let direction = match (&found.grows, truth) {
        (Some((object, way)), Some(false) | None) if found.margin.is_some_and(|m| m < 0.0) => {
            way.try_normalize(1e-9).map(|way| Direction {
                object: object.clone(),
                world: way.into(),
                camera: seen_by_camera(on, &way).into(),
            })
        }
        _ => None,
    };
    let margin = found.margin.map(quantity);
    let term = Term {
        text: text::expr(expr),
        span: expr.span,
        truth,
        value: found.value,
        limit: found.limit,
        margin,
        sigma: found.sigma,
    };
    Reading {
        truth,
        value: found.value,
        limit: found.limit,
        margin,
        sigma: found.sigma,
        rank: found.margin.map_or(0.0, |margin| margin / found.tolerance),
        term: term.text.clone(),
        span: expr.span,
        fluent: None,
        direction,
        unknown: if truth.is_none() { unknown } else { None },
        error: None,
        terms: vec![term],
    }
}

/// What counts as a lot in each unit, where a term names no tolerance of its own; chosen.
pub(super) fn usual_tolerance(dimension: Dimension) -> f64 {
    match (dimension.length, dimension.mass, dimension.time, dimension.angle) {
        // 10 mm, 10 g, 10 mm/s.
        (1, 0, 0 | -1, 0) | (0, 1, 0, 0) => 0.01,
        (3, 0, 0, 0) => 10e-6,
        (0, 0, 0, 1) => 5.0_f64.to_radians(),
        (0, 0, 0, 0) => 0.1,
        // 1 s, 1 N, one of anything else.
        _ => 1.0,
    }
}

/// Returns the dominant direction of a world vector as the camera sees it.
fn seen_by_camera(on: &Evaluator<'_>, way: &Vector3<f64>) -> &'static str {
    let seen = on.scene.camera.world_from_camera.rotation().inverse() * way;
    let names = [("left", "right"), ("up", "down"), ("nearer", "farther")];
    let largest = |i: &usize, j: &usize| seen[*i].abs().partial_cmp(&seen[*j].abs());
    let axis = (0..3).max_by(|i, j| largest(i, j).unwrap_or(Ordering::Equal)).unwrap_or(0);
    if seen[axis] < 0.0 { names[axis].0 } else { names[axis].1 }
}

pub(super) fn kind(expr: &Expr, found: &Value, wanted: &str) -> Error {
    let (term, is) = (text::expr(expr), found.kind().to_owned());
    Error::Kind { term, is, wanted: wanted.to_owned() }
}

pub(super) fn unknown_name(on: &Evaluator<'_>, name: &str) -> Error {
    // A slip of a letter or two, not another word.
    let near = |other: &&str| strsim::damerau_levenshtein(name, other);
    let known = on.scene.objects.iter().map(|o| o.name.as_str()).chain(["gripper", "table"]);
    let best = known.min_by_key(near);
    let suggestion = best.filter(|best| near(best) <= 1.max(name.len() / 3)).map(str::to_owned);
    Error::UnknownName { name: name.to_owned(), suggestion }
}

/// Returns the one value of an argument.
pub(super) fn single<'a>(call: &Call, arg: &'a Arg) -> Result<&'a Expr, Error> {
    match arg.values.as_slice() {
        [value] => Ok(value),
        _ => Err(Error::Arguments { message: wording::no_alternatives(&call.name.text) }),
    }
}
