//! A reality behind a bridge: the protocol as it is spoken, bad answers, and a whole run over it.

mod answers;
mod reality;
mod run;
mod stopping;
