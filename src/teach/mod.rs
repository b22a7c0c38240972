//! Teaching: what people answer, kept apart from what is known.

pub mod answers;
