//! `!2 * 3`: the prompt as a calculator, in the language of action scripts, with limits of its own.
//!
//! Nothing here reaches the arm: what moves it is a call, which is rehearsed first. Names that are given
//! with `let` stay, and `it` is the last answer.
//!
//! In scripts a unit is a factor to SI, and so it is here. A line is worked out a second time with quantities in the place of
//! numbers; where that comes to the same, the answer is told with its unit. Where it does not, since what is added is of
//! two kinds or a function knows numbers alone, the number is the answer.

use std::sync::Arc;

use rhai::module_resolvers::DummyModuleResolver;
use rhai::{Dynamic, Engine, EvalAltResult, Scope};

use crate::report::{self, Failure};
use crate::units::{Dimension, Quantity, Unit, significant};

/// Significant digits of an answer with a unit. Chosen: finer than anything on a table is measured.
const DIGITS: usize = 6;
/// Two ways to the same number differ by rounding, relative.
const ROUNDING: f64 = 1e-9;

/// The units of scripts, as factors to SI.
const UNITS: &[(&str, f64)] = &[
    ("m", 1.0),
    ("cm", 0.01),
    ("mm", 0.001),
    ("deg", std::f64::consts::PI / 180.0),
    ("rad", 1.0),
    ("mL", 1e-6),
    ("L", 1e-3),
    ("kg", 1.0),
    ("g", 0.001),
];

/// The calculator and what it remembers.
pub(super) struct Calculator {
    engine: Engine,
    scope: Scope<'static>,
    /// The second reading: the same names, with quantities in the place of numbers.
    measuring: Engine,
    quantities: Scope<'static>,
}

/// A number that may have a unit.
#[derive(Debug, Clone, Copy)]
struct Amount(Quantity);

impl From<f64> for Amount {
    fn from(number: f64) -> Self {
        Self(Quantity::number(number))
    }
}

impl From<i64> for Amount {
    fn from(number: i64) -> Self {
        Self(Quantity::number(number as f64))
    }
}

/// What is worked out, a plain number where no unit is left.
fn worked(value: f64, dimension: Dimension) -> Dynamic {
    if dimension.is_none() {
        Dynamic::from(value)
    } else {
        Dynamic::from(Amount(Quantity::new(value, dimension)))
    }
}

fn times(Amount(a): Amount, Amount(b): Amount) -> Dynamic {
    worked(a.value * b.value, a.dimension * b.dimension)
}

fn over(Amount(a): Amount, Amount(b): Amount) -> Dynamic {
    worked(a.value / b.value, a.dimension / b.dimension)
}

/// `a + b`, or `a - b` where `sign` is -1.
fn sum(Amount(a): Amount, Amount(b): Amount, sign: f64) -> Result<Dynamic, Box<EvalAltResult>> {
    if a.dimension != b.dimension {
        return Err("two kinds of quantities".into());
    }
    Ok(worked(a.value + sign * b.value, a.dimension))
}

/// Registers the four operations for pairs of types.
macro_rules! operations {
    ($engine:ident: $($a:ty, $b:ty;)+) => {
        $($engine
            .register_fn("+", |a: $a, b: $b| sum(a.into(), b.into(), 1.0))
            .register_fn("-", |a: $a, b: $b| sum(a.into(), b.into(), -1.0))
            .register_fn("*", |a: $a, b: $b| times(a.into(), b.into()))
            .register_fn("/", |a: $a, b: $b| over(a.into(), b.into()));)+
    };
}

/// Returns an engine whose numbers may have units, and which says nothing.
fn measuring(is_stopped: Arc<dyn Fn() -> bool + Send + Sync>) -> Engine {
    let mut engine = limited(is_stopped);
    engine.on_print(|_| ()).on_debug(|_, _, _| ());
    operations!(engine: Amount, Amount; Amount, f64; f64, Amount; Amount, i64; i64, Amount;);
    engine.register_fn("-", |Amount(a): Amount| Amount(Quantity::new(-a.value, a.dimension)));
    engine
}

/// Puts the units into a scope, as quantities.
fn push_quantities(scope: &mut Scope<'static>) {
    for (name, si) in UNITS {
        let dimension = Unit::parse(name).map_or(Dimension::NONE, |unit| unit.dimension);
        scope.push(*name, Amount(Quantity::new(*si, dimension)));
    }
}

/// Returns an engine with limits, that stops when it is told to.
fn limited(is_stopped: Arc<dyn Fn() -> bool + Send + Sync>) -> Engine {
    let mut engine = Engine::new();
    engine.set_max_operations(5_000_000);
    engine.set_max_call_levels(32);
    engine.set_max_expr_depths(64, 32);
    engine.set_max_string_size(64 * 1024);
    engine.set_max_array_size(10_000);
    engine.set_max_map_size(1_000);
    // Nothing here reaches a file or holds the prompt.
    engine.set_module_resolver(DummyModuleResolver::new());
    for word in ["import", "export", "eval", "curry"] {
        engine.disable_symbol(word);
    }
    engine.register_fn("sleep", |_: i64| asleep()).register_fn("sleep", |_: f64| asleep());
    engine.set_max_variables(1_000);
    engine.set_max_functions(200);
    engine.on_progress(move |_| is_stopped().then(|| Dynamic::from("stopped")));
    engine
}

fn asleep() -> Result<(), Box<EvalAltResult>> {
    Err("`sleep` would hold the prompt".into())
}

impl Calculator {
    /// A calculator that ends early when `is_stopped` says so.
    pub(super) fn new(is_stopped: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        let is_stopped: Arc<dyn Fn() -> bool + Send + Sync> = Arc::new(is_stopped);
        let mut engine = limited(Arc::clone(&is_stopped));
        engine.on_print(report::out);
        engine.on_debug(|text, _, _| report::out(text));
        let mut scope = Scope::new();
        for (name, si) in UNITS {
            scope.push_constant(*name, *si);
        }
        let mut quantities = Scope::new();
        push_quantities(&mut quantities);
        Self { engine, scope, measuring: measuring(is_stopped), quantities }
    }

    /// Works out an expression; nothing comes of a statement.
    ///
    /// # Errors
    ///
    /// What the engine says, with the place. What was remembered before stays.
    pub(super) fn answer(&mut self, text: &str) -> Result<Option<String>, Failure> {
        let known = self.scope.len();
        let answer = self.engine.eval_with_scope::<Dynamic>(&mut self.scope, text);
        match answer {
            Ok(value) if value.is_unit() => {
                self.measured(text, &value);
                Ok(None)
            }
            Ok(value) => {
                let told = self.measured(text, &value).unwrap_or_else(|| value.to_string());
                self.scope.set_or_push("it", value);
                Ok(Some(told))
            }
            Err(error) => {
                // Half of a statement that failed leaves no names behind.
                self.scope.rewind(known);
                let place = error.position();
                let message = error.to_string();
                let said = message.split(" (line ").next().unwrap_or(&message);
                let failure = Failure::input("repl::calculator", said.to_owned());
                Err(match (place.line(), place.position()) {
                    (Some(line), Some(column)) => failure.at(format!("prompt:{line}:{column}")),
                    _ => failure,
                })
            }
        }
    }

    /// Works a text out once more with quantities, of which the number is known; returns it with its unit, where it has one.
    fn measured(&mut self, text: &str, known: &Dynamic) -> Option<String> {
        let answer = self.measuring.eval_with_scope::<Dynamic>(&mut self.quantities, text);
        let Ok(value) = answer else {
            // What was named by then may be of no use: the numbers are.
            self.quantities = self.scope.clone();
            push_quantities(&mut self.quantities);
            if !known.is_unit() {
                self.quantities.set_or_push("it", known.clone());
            }
            return None;
        };
        if value.is_unit() {
            return None;
        }
        self.quantities.set_or_push("it", value.clone());
        let Amount(amount) = value.try_cast::<Amount>()?;
        let number = known.as_float().ok()?;
        if (amount.value - number).abs() > ROUNDING * number.abs() {
            return None;
        }
        let (value, unit) = amount.in_everyday_unit();
        Some(format!("{} {unit}", significant(value, DIGITS)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_the_last_answer_outlive_errors() {
        let mut calculator = Calculator::new(|| false);
        let mut ask = |text: &str| calculator.answer(text);
        assert_eq!(ask("let x = 6 * 7").unwrap(), None);
        assert_eq!(ask("x + 1").unwrap().unwrap(), "43");
        assert!(ask("let y = 1; y + nothing").is_err());
        assert!(ask("loop { }").unwrap_err().message.contains("operations"));
        assert_eq!(ask("it + x").unwrap().unwrap(), "85");
        assert!(ask("y").is_err());
        assert_eq!(ask("150 * mL / L").unwrap().unwrap(), "0.15");
    }

    /// `!150 * mL / 3`, which the help of the prompt has, was answered with 0.00005.
    #[test]
    fn an_answer_has_its_unit_where_all_of_it_has() {
        let mut calculator = Calculator::new(|| false);
        let mut ask = |text: &str| calculator.answer(text).unwrap().unwrap_or_default();
        assert_eq!(ask("150 * mL / 3"), "50 mL");
        assert_eq!(ask("it * 2"), "100 mL");
        assert_eq!(ask("let side = 5 * cm; side * side"), "0.0025 m^2");
        assert_eq!(ask("-(side + 2 * mm)"), "-52 mm");
        assert_eq!(ask("30 * deg"), "30 deg");
        // What a script can work out is worked out, with or without a unit.
        assert_eq!(ask("side + 1"), "1.05");
        assert_eq!(ask("side"), "0.05");
        assert_eq!(ask("30 * cm"), "30 cm");
        assert_eq!(ask("cos(0 * deg)"), "1.0");
        assert_eq!(ask("5 * cm > 30 * mm"), "true");
    }

    #[test]
    fn depth_and_size_have_limits_and_a_stop_ends_it() {
        let mut calculator = Calculator::new(|| false);
        assert!(calculator.answer("fn f(n) { f(n + 1) } f(0)").is_err());
        assert!(calculator.answer("let s = \"x\"; loop { s += s; }").is_err());
        assert!(calculator.answer("let a = []; loop { a.push(1); }").is_err());
        assert!(Calculator::new(|| true).answer("loop { }").is_err());
    }
}
