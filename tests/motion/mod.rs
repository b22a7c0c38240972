//! Motion: published reference values, laws, closed forms.

mod collision;
mod ik;
mod reference;
mod robots;
mod rrt;
mod trajectory;
