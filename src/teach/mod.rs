//! A run, one step at a time: what comes next and what it came to, forwards and backwards, with questions
//! asked before the answer is shown.
//!
//! [`stepper`] is the logic: it is a [`crate::execution::conduct::Conductor`] for a run that is going on,
//! and walks over the record of one that is over ([`record`]) in the same way. It takes words ([`words`]),
//! knows where to pause ([`stops`]), and keeps what people answer apart from what is known ([`answers`]).
//! It knows no terminal and prints nothing: a [`shown::Front`] shows and asks. Looking back never moves
//! an arm; only `next`, `over`, `out` and `continue` let a run go on.

pub mod answers;
mod grant;
mod questions;
pub mod quiz;
pub mod record;
pub mod shown;
pub mod stepper;
pub mod stops;
pub mod wording;
pub mod words;
