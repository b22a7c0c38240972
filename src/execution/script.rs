//! The rhai engine: atomic actions are scripts.
//!
//! A script sees its action's parameters by name (objects as their names, quantities in SI), the units
//! `m cm mm deg rad s ms mL L kg g N`, and three handles: `camera` (look), `twin` (ask and plan), `arm`
//! (act). `choose` takes one of several ways, `remember` and `recall` carry a value to a later action.
//! Scripts have limits on operations, depth and size, and every binding that moves polls the cancel token.
//! What a script prints goes where its notes go.
//!
//! The words are bound in `super::words` to what they do in [`super::context`]; this file runs scripts and translates
//! errors.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard};

use rhai::{Dynamic, Engine, EvalAltResult, Position, Scope};

use crate::language::nearest;
use crate::language::script_words::words_of;
use crate::world::Region;

use super::bounds::{self, CALLS, OPERATIONS};
use super::context::ActionContext;
use super::error::ActionError;
use super::handle::{Handle, lock, waiting};
use super::refusal::{Mistake, Refusal};
use super::words;

/// A value handed to a script by the name of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub enum ScriptValue {
    /// An object or another name.
    Name(String),
    /// A quantity in SI.
    Number(f64),
    /// Yes or no.
    Truth(bool),
    /// Where something may stand: `left_of(cup)`.
    Region(Region),
}

/// Why a script ended early.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScriptError {
    /// What it asked for could not be done.
    #[error("{error}")]
    Action {
        /// What.
        error: ActionError,
        /// Line in the script, from 1.
        line: Option<usize>,
    },
    /// The script itself is wrong.
    #[error("{file}:{line}: {mistake}")]
    Wrong {
        /// The script.
        file: String,
        /// Line, from 1; 0 when unknown.
        line: usize,
        /// What is wrong with it.
        mistake: Mistake,
    },
}

impl ScriptError {
    /// Whether nothing more is done after it: a person said stop, or a device failed.
    pub fn ends_the_walk(&self) -> bool {
        matches!(self, Self::Action { error, .. } if error.ends_the_walk())
    }

    /// Whether planning and rehearsing again from where the arm is may help.
    pub fn can_be_planned_again(&self) -> bool {
        matches!(self, Self::Action { error, .. } if error.can_be_planned_again())
    }
}

/// Runs action scripts over one action context.
pub struct Scripts {
    engine: Engine,
    context: Arc<Mutex<ActionContext>>,
}

impl Scripts {
    /// Binds the words to an action context.
    pub fn new(context: ActionContext) -> Self {
        let cancel = context.cancel().clone();
        let context = Arc::new(Mutex::new(context));
        let mut engine = bounds::engine();
        engine.on_progress(move |_| cancel.is_cancelled().then(|| Dynamic::from("stopped")));
        words::bind(&mut engine, &context);
        Self { engine, context }
    }

    /// Lends the action context, to one at a time: whoever has it must give it back before anything else is done.
    pub fn context(&mut self) -> MutexGuard<'_, ActionContext> {
        lock(&self.context)
    }

    /// Lets arm time stand still while something is asked.
    ///
    /// # Errors
    ///
    /// When the arm does not answer.
    pub fn waiting<T>(&mut self, ask: impl FnOnce() -> T) -> Result<T, ActionError> {
        waiting(&self.context, ask)
    }

    /// Runs the script `text` of file `file` with these arguments.
    ///
    /// # Errors
    ///
    /// [`ScriptError::Action`] with the binding's own error when the arm, the planner or a person said
    /// no; [`ScriptError::Wrong`] when the script cannot be read or misuses a word.
    pub fn run(
        &mut self,
        file: &str,
        text: &str,
        args: &BTreeMap<String, ScriptValue>,
    ) -> Result<(), ScriptError> {
        let mut scope = Scope::new();
        for (name, si) in UNITS {
            scope.push_constant(*name, *si);
        }
        scope.push("camera", Handle::<0>(self.context.clone()));
        scope.push("twin", Handle::<1>(self.context.clone()));
        scope.push("arm", Handle::<2>(self.context.clone()));
        for (name, value) in args {
            match value {
                ScriptValue::Name(text) => scope.push(name.clone(), text.clone()),
                ScriptValue::Number(number) => scope.push(name.clone(), *number),
                ScriptValue::Truth(truth) => scope.push(name.clone(), *truth),
                ScriptValue::Region(region) => scope.push(name.clone(), region.clone()),
            };
        }
        self.context()
            .script_begins(file, text)
            .map_err(|error| ScriptError::Action { error, line: None })?;
        let result = self.engine.run_with_scope(&mut scope, text);
        result.map_err(|error| translate(file, &error))
    }
}

/// Units as factors to SI, so that a script may write `12.0 * cm`.
pub(super) const UNITS: &[(&str, f64)] = &[
    ("m", 1.0),
    ("cm", 0.01),
    ("mm", 0.001),
    ("deg", std::f64::consts::PI / 180.0),
    ("rad", 1.0),
    ("s", 1.0),
    ("ms", 0.001),
    ("mL", 1e-6),
    ("L", 1e-3),
    ("kg", 1.0),
    ("g", 0.001),
    ("N", 1.0),
];

/// Says what is wrong with a call of a word that there is not, or not with such arguments: `moveby (Arm, array, f64)`.
fn misused(called: &str) -> Mistake {
    let (name, arguments) = called.split_once(" (").unwrap_or((called, ""));
    let first = arguments.split([',', ')']).next().unwrap_or_default().trim().to_lowercase();
    let mut words: Vec<_> = words_of(&first).collect();
    if words.is_empty() {
        words = words_of("").collect();
    }
    let near = nearest(name, words.iter().map(|word| word.name));
    let like = |name: &str| words.iter().find(|word| word.name == name);
    match (like(name), near.and_then(like)) {
        (Some(word), _) => Mistake::Misused { written: word.written() },
        (None, Some(word)) => {
            let of = if word.of.is_empty() { String::new() } else { format!("{}.", word.of) };
            Mistake::Unknown { name: of + name, meant: word.written() }
        }
        (None, None) => Mistake::Engine(format!("Function not found: {called}")),
    }
}

/// Finds the binding's own error inside the engine's, whatever calls it is wrapped in.
fn translate(file: &str, error: &EvalAltResult) -> ScriptError {
    let line = |position: Position| position.line();
    match error {
        EvalAltResult::ErrorTerminated(token, position) => {
            let error = token.clone().try_cast::<ActionError>().unwrap_or(ActionError::Stopped);
            ScriptError::Action { error, line: line(*position) }
        }
        EvalAltResult::ErrorRuntime(token, position) => {
            if let Some(error) = token.clone().try_cast::<ActionError>() {
                return ScriptError::Action { error, line: line(*position) };
            }
            // `throw "words"` in a script is the script's own way to say no.
            let error = Refusal::Thrown(token.to_string()).into();
            ScriptError::Action { error, line: line(*position) }
        }
        EvalAltResult::ErrorInFunctionCall(_, _, inner, _) => translate(file, inner),
        other => ScriptError::Wrong {
            file: file.to_owned(),
            line: other.position().line().unwrap_or(0),
            mistake: match other {
                EvalAltResult::ErrorTooManyOperations(_) => {
                    Mistake::Endless { operations: OPERATIONS }
                }
                EvalAltResult::ErrorStackOverflow(_) => Mistake::TooDeep { calls: CALLS },
                EvalAltResult::ErrorFunctionNotFound(called, _) => misused(called),
                other => Mistake::Engine(other.to_string()),
            },
        },
    }
}
