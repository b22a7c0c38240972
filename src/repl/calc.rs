//! `!2 * 3`: the prompt as a calculator, in the language of action scripts, with limits of its own.
//!
//! Nothing here reaches the arm: what moves it is a call, which is rehearsed first. Names that are given
//! with `let` stay, and `it` is the last answer.

use rhai::module_resolvers::DummyModuleResolver;
use rhai::{Dynamic, Engine, EvalAltResult, Scope};

use crate::report::{self, Failure};

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
}

fn asleep() -> Result<(), Box<EvalAltResult>> {
    Err("`sleep` would hold the prompt".into())
}

impl Calculator {
    /// A calculator that ends early when `is_stopped` says so.
    pub(super) fn new(is_stopped: impl Fn() -> bool + Send + Sync + 'static) -> Self {
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
        engine.on_print(report::out);
        engine.on_debug(|text, _, _| report::out(text));
        let mut scope = Scope::new();
        for (name, si) in UNITS {
            scope.push_constant(*name, *si);
        }
        Self { engine, scope }
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
            Ok(value) if value.is_unit() => Ok(None),
            Ok(value) => {
                let told = value.to_string();
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

    #[test]
    fn depth_and_size_have_limits_and_a_stop_ends_it() {
        let mut calculator = Calculator::new(|| false);
        assert!(calculator.answer("fn f(n) { f(n + 1) } f(0)").is_err());
        assert!(calculator.answer("let s = \"x\"; loop { s += s; }").is_err());
        assert!(calculator.answer("let a = []; loop { a.push(1); }").is_err());
        assert!(Calculator::new(|| true).answer("loop { }").is_err());
    }
}
