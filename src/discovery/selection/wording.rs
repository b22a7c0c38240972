//! What is said while effects are searched for.

/// Said while a gap is written out, linear in its effects.
pub(super) const WRITING_OUT: &str = "writing the gap out";
/// Said while effects join.
pub(super) const LOOKING: &str = "looking for what explains the gap";
/// Said after one joined.
pub(super) const EXCHANGING: &str = "trying to exchange and to leave out";
/// Said after the last one joined.
pub(super) const EXCHANGING_ALL: &str = "trying to exchange and to leave out, all of them";
/// Said while it is judged how far behind the others are.
pub(super) const COMPARING: &str = "comparing rivals";
