//! Motion: published reference values, laws, closed forms.

mod analytic;
mod arms;
mod benchmaker;
mod cartesian;
mod collision;
pub(crate) mod ik;
mod mimics;
mod problems;
mod reference;
pub(crate) mod robots;
mod giving_way;
mod rmpflow;
mod rrt;
mod trajectory;
