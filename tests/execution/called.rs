//! A mistake in an action's script points at its line and at the line of the task that called it; a step that was
//! not rehearsed fails.

use std::collections::BTreeMap;

use trueup::arm::Cancel;
use trueup::execution::decisions::DecisionLog;
use trueup::execution::walk::{Texts, Walker};
use trueup::graph::{self, infer};
use trueup::language::ast::{Expr, Step};
use trueup::language::{Library, Source, parse_line};
use trueup::trace::Outcome;

/// One script, whatever is asked for.
struct Only(&'static str);

impl Texts for Only {
    fn script(&self, _: &str) -> Option<&str> {
        Some(self.0)
    }
}

/// How `wave()` ends when its script is this.
fn reason(script: &'static str) -> String {
    reason_on(DecisionLog::recording(), script)
}

/// How `wave()` ends with these decisions when its script is this.
fn reason_on(log: DecisionLog, script: &'static str) -> String {
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
    let mut scripts = super::scripts(&Cancel::default(), log);
    let scene = super::cell().scene;
    let start = scripts.context().state().unwrap();
    let texts = Only(script);
    let done =
        Walker::new(&mut scripts, &texts, &library, &scene, &start).step(&pg, 0, &[]).unwrap();
    assert_eq!(done.outcome, Outcome::Failure);
    done.failure.unwrap().to_string()
}

#[test]
fn both_lines_are_named() {
    let refused = reason("let a = 1;\nthrow \"not today\";\n");
    assert_eq!(refused, "not today (wag.rhai:2, called from wave.task:6)");
    let wrong = reason("let a = 1;\n\narm.fly();\n");
    assert!(wrong.starts_with("wag.rhai:3: "), "{wrong}");
    assert!(wrong.ends_with(", called from wave.task:6"), "{wrong}");
}

#[test]
fn a_step_that_no_rehearsal_came_to_fails_and_does_not_wait_for_itself() {
    let reason = reason_on(DecisionLog::recording().rewound(), "arm.wait(1.0);");
    assert!(reason.contains("the next step"), "{reason}");
}
