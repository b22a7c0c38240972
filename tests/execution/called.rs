//! A mistake in an action's script points at its line and at the line of the task that called it.

use std::collections::BTreeMap;

use trueup::execution::arm::Cancel;
use trueup::execution::tape::Tape;
use trueup::execution::trace::Outcome;
use trueup::execution::walk::{Texts, Walker};
use trueup::graph::{self, infer};
use trueup::language::ast::{Expr, Step};
use trueup::language::{Library, Source, parse_line};

/// One script, whatever is asked for.
struct Only(&'static str);

impl Texts for Only {
    fn script(&self, _: &str) -> Option<&str> {
        Some(self.0)
    }
}

/// How `wave()` ends when its script is this.
fn reason(script: &'static str) -> String {
    let mut library = Library::standard();
    let text = "action wag() {\n    run \"wag.rhai\"\n}\n\ntask wave() {\n    wag()\n}\n";
    library.add(Source::new("wave.task", text));
    let Some(Step::Act(act)) = parse_line("wave()").0 else { panic!("no call") };
    let graph = graph::build(&library, &act.call).unwrap();
    let given = infer::Given {
        definitions: &library,
        holds: &|_: &Expr| None,
        pins: &BTreeMap::new(),
        priors: None,
        cost: &|_| 0.0,
    };
    let pg = graph::best(&graph, &given).unwrap();
    let scripts = super::scripts(&Cancel::default(), Tape::recording());
    let scene = super::cell().scene;
    let start = scripts.stage().state().unwrap();
    let texts = Only(script);
    let done = Walker::new(&scripts, &texts, &library, &scene, &start).step(&pg, 0, &[]).unwrap();
    assert_eq!(done.outcome, Outcome::Failure);
    done.reason.unwrap()
}

#[test]
fn both_lines_are_named() {
    let refused = reason("let a = 1;\nthrow \"not today\";\n");
    assert_eq!(refused, "not today (wag.rhai:2, called from wave.task:6)");
    let wrong = reason("let a = 1;\n\narm.fly();\n");
    assert!(wrong.starts_with("wag.rhai:3: "), "{wrong}");
    assert!(wrong.ends_with(", called from wave.task:6"), "{wrong}");
}
