//! Text → checked syntax tree and diagnostics. Parsing never fails.
//!
//! [`parse`] reads a file, [`parse_line`] a line typed at the prompt; both always return a tree, and
//! beside it everything that is wrong. A [`Library`] merges the standard library with a user's files
//! and looks names up; [`Library::check`] finds wrong names, arguments, types and units. [`builtins`]
//! is the list of what fluents may measure. Nothing here knows a robot or evaluates anything.
//!
//! ```
//! use trueup::language::{ast::Item, parse};
//!
//! let (program, wrong) = parse("task fetch(o: Object) { pick(o) then place(o) }");
//! assert!(matches!(program.items[..], [Item::Task(_)]) && wrong.is_empty());
//! let (_, wrong) = parse("task fetch(o: Object) { pick(o) then }");
//! assert!(wrong[0].is_error());
//! ```

pub mod assist;
pub mod ast;
pub mod bind;
pub mod builtins;
pub mod codes;
pub mod diagnostic;
pub mod format;
pub mod library;
pub mod script_words;
pub mod sentence;
pub mod text;
mod check;
mod excerpt;
mod parse;

pub use check::{MODEL_CONSTANTS, MODEL_FUNCTIONS, ModelUnits, check_model, names_in};
pub use diagnostic::{Diagnostic, Fix, Label, Severity, Source, Style, limited, render};
pub use format::format;
pub use library::{Library, Scope};
pub(crate) use parse::lexer::{Kind as TokenKind, tokens};
pub use parse::{is_in_block, is_incomplete, nearest, parse, parse_line};
pub(crate) use parse::{is_of_language, is_reserved};
