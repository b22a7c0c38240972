//! What a script holds of the action context: a handle that lends it to one line at a time, and the way of an error
//! through the engine.
//!
//! A line that acts is taken note of first, and whoever may hold the arm is asked before it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rhai::{Array, Dynamic, EvalAltResult, NativeCallContext, Position};

use super::bounds;
use super::conduct::Word;
use super::context::ActionContext;
use super::error::ActionError;
use crate::trace::Deed;

/// The handle a script calls `arm`, `twin` or `camera`.
#[derive(Clone)]
pub(super) struct Handle<const KIND: u8>(pub(super) Arc<Mutex<ActionContext>>);

pub(super) type Camera = Handle<0>;
pub(super) type Twin = Handle<1>;
pub(super) type Arm = Handle<2>;
/// What a word of a script returns.
pub(super) type Fallible<T> = Result<T, Box<EvalAltResult>>;

impl<const KIND: u8> Handle<KIND> {
    /// Lends the action context.
    pub(super) fn context(&self) -> MutexGuard<'_, ActionContext> {
        lock(&self.0)
    }

    /// Takes note of a line that acts, and waits while somebody holds the arm before it; then lends the
    /// action context.
    pub(super) fn acts(
        &self,
        at: &NativeCallContext<'_>,
        does: String,
    ) -> Fallible<MutexGuard<'_, ActionContext>> {
        self.acts_on(at, does, None)
    }

    /// As [`Self::acts`], with what the line does to things.
    pub(super) fn acts_on(
        &self,
        at: &NativeCallContext<'_>,
        does: String,
        deed: Option<Deed>,
    ) -> Fallible<MutexGuard<'_, ActionContext>> {
        let line = at.call_position().line().unwrap_or(0);
        pass(&self.0, line, does, deed).map_err(raise)?;
        Ok(self.context())
    }

    /// Lends the action context to plan on, as often as a script may ask for a plan.
    pub(super) fn plans(&self) -> Fallible<MutexGuard<'_, ActionContext>> {
        let mut context = self.context();
        context.script_plans().map_err(raise)?;
        Ok(context)
    }

    /// Returns one joint position for each joint of the arm.
    pub(super) fn joints(&self, word: &str, q: &Array) -> Fallible<Vec<f64>> {
        let n = self.context().cell().robot.n_joints();
        bounds::joints(word, q, n).map_err(raise)
    }
}

/// Lets arm time stand still while something is asked. The action context is free meanwhile.
pub(super) fn waiting<T>(
    context: &Mutex<ActionContext>,
    ask: impl FnOnce() -> T,
) -> Result<T, ActionError> {
    lock(context).waits(true)?;
    let answer = ask();
    lock(context).waits(false)?;
    Ok(answer)
}

/// Asks whoever may hold the arm. The action context is free meanwhile: a person may think for long.
fn pass(
    context: &Mutex<ActionContext>,
    line: usize,
    does: String,
    deed: Option<Deed>,
) -> Result<(), ActionError> {
    let Some((gate, line, state)) = lock(context).line_begins(line, does, deed)? else {
        return Ok(());
    };
    let word = waiting(context, || {
        let mut gate = gate.lock().unwrap_or_else(PoisonError::into_inner);
        (*gate)(&line, &state)
    });
    match word? {
        Word::Go => Ok(()),
        Word::Stop => Err(ActionError::Stopped),
    }
}

/// Locks the action context. A panic elsewhere does not make the arm's state unreadable: it is still what it was.
pub(super) fn lock(context: &Mutex<ActionContext>) -> MutexGuard<'_, ActionContext> {
    context.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Carries an action's error through the engine. What ends the step cannot be caught by a script, anything
/// else can.
#[expect(
    clippy::unnecessary_box_returns,
    reason = "the engine's functions fail with a boxed error"
)]
pub(super) fn raise(error: impl Into<ActionError>) -> Box<EvalAltResult> {
    let error: ActionError = error.into();
    let can_be_caught = error.can_be_caught();
    let token = Dynamic::from(error);
    Box::new(if can_be_caught {
        EvalAltResult::ErrorRuntime(token, Position::NONE)
    } else {
        EvalAltResult::ErrorTerminated(token, Position::NONE)
    })
}
