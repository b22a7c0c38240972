//! `!2 * 3`: the prompt as a calculator, in the language of action scripts, with limits of its own.
//!
//! Nothing here reaches the arm: what moves it is a call, which is rehearsed first. Names that are given
//! with `let` stay, and `it` is the last answer.
//!
//! In scripts a unit is a factor to SI, and so it is here. A line is worked out a second time with quantities in the place of
//! numbers; where that comes to the same, the answer is told with its unit, and where it has two kinds of them in one sum it is
//! refused. Where a function knows numbers alone, the number is the answer. A quotient of whole numbers is what it is, not its whole part.

use std::sync::{Arc, Mutex, PoisonError};

use rhai::module_resolvers::DummyModuleResolver;
use rhai::{Dynamic, Engine, EvalAltResult, Scope};

use crate::report::{self, Failure};
use crate::units::{Dimension, Quantity, Unit, significant};

/// Significant digits of an answer with a unit. Chosen: finer than anything on a table is measured.
const DIGITS: usize = 6;
/// What two kinds of quantities have none of.
const MIXED: &str = "are two kinds, and have no";
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

/// Says whether a sum is to stop.
type Wish = Box<dyn Fn() -> bool + Send>;

/// The calculator and what it remembers.
pub(super) struct Calculator {
    /// What ends a sum early.
    wish: Arc<Mutex<Wish>>,
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

/// What comes of an operation.
type Answer = Result<Dynamic, Box<EvalAltResult>>;

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

fn over(Amount(a): Amount, Amount(b): Amount) -> Answer {
    Ok(worked(quotient(a.value, b.value)?, a.dimension / b.dimension))
}

/// `a + b`, or `a - b` where `sign` is -1.
fn sum(Amount(a): Amount, Amount(b): Amount, sign: f64) -> Answer {
    same_kind(a, b, "sum")?;
    Ok(worked(a.value + sign * b.value, a.dimension))
}

/// Refuses what two quantities of different kinds have none of; a number without a unit may be meant as one that has it.
fn same_kind(a: Quantity, b: Quantity, what: &str) -> Result<(), Box<EvalAltResult>> {
    if a.dimension == b.dimension {
        return Ok(());
    }
    if a.dimension.is_none() || b.dimension.is_none() {
        return Err("one of the two has no unit".into());
    }
    Err(format!("{} and {} {MIXED} {what}", a.dimension.words(), b.dimension.words()).into())
}

fn quotient(a: f64, b: f64) -> Result<f64, Box<EvalAltResult>> {
    if b.abs() > 0.0 { Ok(a / b) } else { Err("division by zero".into()) }
}

/// Returns a whole number where the division comes out even.
fn of_whole(a: i64, b: i64) -> Answer {
    match a.checked_rem(b) {
        Some(0) => Ok(Dynamic::from(a / b)),
        _ => Ok(Dynamic::from(quotient(a as f64, b as f64)?)),
    }
}

/// Returns whether a text is not of the language of scripts, or has names that it does not know.
fn is_of_words(error: &EvalAltResult) -> bool {
    use EvalAltResult::{ErrorFunctionNotFound, ErrorParsing, ErrorVariableNotFound};
    matches!(error, ErrorParsing(..) | ErrorVariableNotFound(..) | ErrorFunctionNotFound(..))
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
    let compared = |word: &'static str, is: fn(f64, f64) -> bool| {
        move |Amount(a): Amount, Amount(b): Amount| -> Result<bool, Box<EvalAltResult>> {
            same_kind(a, b, word)?;
            Ok(is(a.value, b.value))
        }
    };
    engine
        .register_fn("<", compared("order", |a, b| a < b))
        .register_fn(">", compared("order", |a, b| a > b))
        .register_fn("<=", compared("order", |a, b| a <= b))
        .register_fn(">=", compared("order", |a, b| a >= b));
    let one_of = |is: fn(f64, f64) -> f64| {
        move |Amount(a): Amount, Amount(b): Amount| -> Answer {
            same_kind(a, b, "order")?;
            Ok(worked(is(a.value, b.value), a.dimension))
        }
    };
    engine.register_fn("min", one_of(f64::min)).register_fn("max", one_of(f64::max));
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
    engine.set_fast_operators(false);
    engine
        .register_fn("/", of_whole)
        .register_fn("/", quotient)
        .register_fn("/", |a: f64, b: i64| quotient(a, b as f64))
        .register_fn("/", |a: i64, b: f64| quotient(a as f64, b));
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
    pub(super) fn new(is_stopped: impl Fn() -> bool + Send + 'static) -> Self {
        let wish: Arc<Mutex<Wish>> = Arc::new(Mutex::new(Box::new(is_stopped)));
        let asked = Arc::clone(&wish);
        let is_stopped: Arc<dyn Fn() -> bool + Send + Sync> =
            Arc::new(move || asked.lock().unwrap_or_else(PoisonError::into_inner)());
        let mut engine = limited(Arc::clone(&is_stopped));
        engine.on_print(report::out);
        engine.on_debug(|text, _, _| report::out(text));
        let mut scope = Scope::new();
        for (name, si) in UNITS {
            scope.push_constant(*name, *si);
        }
        let mut quantities = Scope::new();
        push_quantities(&mut quantities);
        Self { wish, engine, scope, measuring: measuring(is_stopped), quantities }
    }

    /// Ends sums early when this says so, from now on.
    pub(super) fn stops_when(&mut self, is_stopped: impl Fn() -> bool + Send + 'static) {
        *self.wish.lock().unwrap_or_else(PoisonError::into_inner) = Box::new(is_stopped);
    }

    /// Works out an expression; nothing comes of a statement.
    ///
    /// # Errors
    ///
    /// What the engine says, with the place. What was remembered before stays.
    pub(super) fn answer(&mut self, text: &str) -> Result<Option<String>, Failure> {
        let known = self.scope.len();
        let answer = self.engine.eval_with_scope::<Dynamic>(&mut self.scope, text);
        let told = answer.and_then(|value| Ok((self.measured(text, &value)?, value)));
        match told {
            Ok((_, value)) if value.is_unit() => Ok(None),
            Ok((told, value)) => {
                let told = told.unwrap_or_else(|| value.to_string());
                self.scope.set_or_push("it", value);
                Ok(Some(told))
            }
            Err(error) => {
                // Half of a statement that failed leaves no names behind.
                self.scope.rewind(known);
                let place = error.position();
                let message = error.to_string();
                let said = message.split(" (line ").next().unwrap_or(&message);
                let said = said.strip_prefix("Runtime error: ").unwrap_or(said);
                let mut failure = Failure::input("repl::calculator", said.to_owned());
                if is_of_words(&error) {
                    failure = failure.help(
                        "behind `!` a unit is a factor, `150 * mL / 3`; without it a line takes units as usual, `150 mL / 3`",
                    );
                }
                Err(match (place.line(), place.position()) {
                    (Some(line), Some(column)) => failure.at(format!("prompt:{line}:{column}")),
                    _ => failure,
                })
            }
        }
    }

    /// Works a text out once more with quantities, of which the number is known; returns it with its unit, where it has one.
    fn measured(
        &mut self,
        text: &str,
        known: &Dynamic,
    ) -> Result<Option<String>, Box<EvalAltResult>> {
        let answer = self.measuring.eval_with_scope::<Dynamic>(&mut self.quantities, text);
        let value = match answer {
            Ok(value) => value,
            Err(error) if error.to_string().contains(MIXED) => return Err(error),
            Err(_) => {
                // What was named by then may be of no use: the numbers are.
                self.quantities = self.scope.clone();
                push_quantities(&mut self.quantities);
                if !known.is_unit() {
                    self.quantities.set_or_push("it", known.clone());
                }
                return Ok(None);
            }
        };
        if value.is_unit() {
            return Ok(None);
        }
        self.quantities.set_or_push("it", value.clone());
        let (Some(Amount(amount)), Ok(number)) = (value.try_cast::<Amount>(), known.as_float())
        else {
            return Ok(None);
        };
        if (amount.value - number).abs() > ROUNDING * number.abs() {
            return Ok(None);
        }
        let (value, unit) = amount.in_everyday_unit();
        Ok(Some(format!("{} {unit}", significant(value, DIGITS))))
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
        assert_eq!(ask("min(3 * cm, 20 * mm)"), "20 mm");
    }

    /// `!7/2*cm` was 30 mm, `!1 * kg / 0` inf kg, and a length beside a volume was added to it.
    #[test]
    fn a_sum_is_right_or_refused() {
        let mut calculator = Calculator::new(|| false);
        let mut ask = |text: &str| calculator.answer(text);
        for (text, answer) in [
            ("7/2*cm", "35 mm"),
            ("3/4 * 200*mL", "150 mL"),
            ("1/4", "0.25"),
            ("8/2", "4"),
            ("let n = 9; n / 2", "4.5"),
        ] {
            assert_eq!(ask(text).unwrap().unwrap(), answer, "{text}");
        }
        assert_eq!(ask("1 * kg / 0").unwrap_err().message, "division by zero");
        for text in ["10*cm + 3*mL", "10*cm > 9*mL", "150*mL/3 + 10*g", "max(1*m, 2*kg)"] {
            let error = ask(text).unwrap_err();
            assert!(error.message.contains("are two kinds"), "{text}: {}", error.message);
        }
        assert_eq!(ask("n * 2").unwrap().unwrap(), "18");
    }

    #[test]
    fn what_ends_a_sum_may_change() {
        let mut calculator = Calculator::new(|| true);
        assert!(calculator.answer("2 * 3").is_err());
        calculator.stops_when(|| false);
        assert_eq!(calculator.answer("2 * 3").unwrap().unwrap(), "6");
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
