//! Motion: published reference values, laws, closed forms.

mod reference;
mod robots;
