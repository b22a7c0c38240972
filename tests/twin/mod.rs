//! The twin: what it draws.

mod render;
