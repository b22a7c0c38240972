//! The record of a run: events in order, and the hook that lets others watch.
//!
//! Records are data; [`crate::report`] words them and the run folder keeps them. Nothing here judges.

mod event;
mod failure;
mod line;
mod no_way;
mod rows;
mod step;

pub use event::{Event, Nobody, Observer, Still, Tryout, jpeg, small_jpeg};
pub use failure::{
    Cause, Mistimed, Overdue, Overload, Place, Shared, StepFailure, Unmet, Unrehearsed,
};
pub use line::{Call, Deed, Line};
pub use no_way::{FARTHEST_TOLD, NoWay, OffTable, Over, Tilted, TooNear, Why};
pub use rows::{DuringRow, Fared, FluentRow, Measure, TermRow};
pub use step::{Outcome, StepRecord};
