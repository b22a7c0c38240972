//! The And-Or graph: LANGUAGE 5.7, point by point, and what else it promises.

mod build;
mod exchange;
mod infer;
mod parse;
mod points;
mod show;
pub(crate) mod tree;

use std::collections::BTreeMap;

use trueup::graph::{self, Graph, Holds, Node, Priors, infer::Given};
use trueup::language::ast::{Call, Expr, Program};
use trueup::language::text;

/// Builds or shows why not.
fn built(program: &Program, call: &Call) -> Graph {
    graph::build(program, call).unwrap_or_else(|problems| panic!("{problems:#?}"))
}

/// The kitchen of the tests: the jar is tall and without a lid.
fn kitchen(what: &Expr) -> Option<bool> {
    match text::expr(what).as_str() {
        "tall(jar)" => Some(true),
        "lidded(jar)" | "tall(bottle)" | "lidded(bottle)" => Some(false),
        _ => None,
    }
}

fn free(_: &Node) -> f64 {
    0.0
}

struct Settings<'a> {
    program: &'a Program,
    holds: &'a dyn Holds,
    pins: BTreeMap<String, String>,
    priors: Option<Priors>,
}

impl<'a> Settings<'a> {
    fn new(program: &'a Program, holds: &'a dyn Holds) -> Self {
        Self { program, holds, pins: BTreeMap::new(), priors: None }
    }

    fn pin(mut self, node: &str, branch: &str) -> Self {
        self.pins.insert(node.into(), branch.into());
        self
    }

    fn given(&self) -> Given<'_> {
        Given {
            definitions: self.program,
            holds: self.holds,
            pins: &self.pins,
            priors: self.priors.as_ref(),
            cost: &free,
        }
    }
}
