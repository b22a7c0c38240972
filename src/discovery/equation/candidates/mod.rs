//! Every effect that could sit in a model, with its places, its terms and where to start fitting it.
//!
//! The names are those of [`super::super::vocabulary`]. Which states are velocities is read off the
//! equations (`q' = v`) or the units; only velocities rub, only levels that stay above 0 overflow.

mod draft;
mod laws;
mod friction;
mod forces;
mod levels;
mod signals;

pub use draft::{Candidate, Ground, Range, velocities};
use draft::{Draft, P, depends, p};
pub(super) use laws::price;

/// Every candidate for a model.
pub fn candidates(ground: &Ground) -> Vec<Candidate> {
    let mut draft = Draft { ground, out: Vec::new() };
    if ground.compiled.states.is_empty() {
        friction::friction_of_inputs(&mut draft);
    } else {
        friction::friction(&mut draft);
        forces::stiffness(&mut draft);
        levels::levels(&mut draft);
        forces::disturbances(&mut draft);
    }
    signals::inputs(&mut draft);
    signals::outputs(&mut draft);
    draft.out
}
