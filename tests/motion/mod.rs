//! Motion: published reference values, laws, closed forms.

mod ik;
mod reference;
mod robots;
