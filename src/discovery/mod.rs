//! Where twin and measurement disagree, and what the twin lacks: the name, the place, the size.
//!
//! Recordings come in, a [`finding::Finding`] goes out. [`recording`] reads measured data, [`vocabulary`]
//! holds the names an effect may have, [`selection`] searches among explanations and judges them on data
//! they were not fitted to. Nothing here knows the truth of the lab: recordings are all it sees.

pub mod vocabulary;
pub mod finding;
pub mod recording;
