//! What every arm has in common: how it is brought to rest.

mod stopping;
