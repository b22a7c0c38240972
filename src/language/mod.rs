//! Text → checked syntax tree and diagnostics. Parsing never fails.

pub mod ast;
pub mod bind;
pub mod text;
