//! Every effect that has a name, as tables. What a row says is [`Kind`]'s; what is asked of it is [`super`]'s.

mod cell;
mod signal;

use super::{Kind, Odds, ParameterKind, SiteKind};

const fn number(name: &'static str, unit: &'static str) -> ParameterKind {
    ParameterKind { name, unit, components: &[] }
}

const fn kind(
    name: &'static str,
    odds: Odds,
    sites: &'static [SiteKind],
    parameters: &'static [ParameterKind],
    does: &'static str,
    shows: &'static str,
) -> Kind {
    Kind { name, odds, sites, parameters, does, shows }
}

/// Every effect that has a name: those of what stands in a cell, and those of any model or signal.
pub const KINDS: &[&[Kind]] = &[cell::KINDS, signal::KINDS];
