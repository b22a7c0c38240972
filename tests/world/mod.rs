//! The state of the world, and what fluents are worth in it.

mod fluent;
mod shapes;
