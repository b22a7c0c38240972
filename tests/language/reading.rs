//! Texts that must come out as the tree they mean, and texts that nobody means.

use proptest::prelude::*;
use trueup::language::ast::{
    Allen, BinaryOp, ExprKind, Hold, Item, Program, Remedy, Step, TaskItem,
};
use trueup::language::{Source, Style, is_incomplete, parse, parse_line, render};
use trueup::units::Dimension;

/// Parses a text that is right.
fn clean(text: &str) -> Program {
    let (program, diagnostics) = parse(text);
    let source = Source::new("t.task", text);
    let told: String = diagnostics.iter().map(|d| render(d, &source, Style::Plain)).collect();
    assert!(told.is_empty(), "{told}");
    program
}

/// The one task of a text that is right.
fn task(text: &str) -> TaskItem {
    match clean(text).items.pop() {
        Some(Item::Task(task)) => task,
        other => panic!("not a task: {other:?}"),
    }
}

#[test]
fn every_form_of_step_reads_as_written() {
    let task = task(
        "/// Does it all.\n\
         task t(o: A, by: Length = 5 cm) {\n\
             say \"do {o}\"\n\
             needs visible(o) keeps held(o) gives up(o) limit 2 min\n\
             either a prior 0.7 when tall(o) { f(o) } or b prior 0.3 { g(o) then h() } or c { }\n\
             if x(o) { f(o) } else if y(o) { g(o) } else { h() }\n\
             repeat upto 3 times { f(o) } until x(o)\n\
             for p in A when x(p) { f(p) } for q in A { g(q) }\n\
             together { f(o) as p  g(o) while x(o) until y(o) as q  timing p overlaps q by 300 ms }\n\
             check x(o)  let d = 2 * by\n\
             { f(o) on failure { abort } } while x(o) as inner\n\
             g(o, at: tray | table)\n\
             on failure of f(o) { h() retry other upto 2 times }\n\
             on failure of g { abort \"why\" }\n\
             on failure { retry }\n\
         }",
    );
    assert_eq!(task.doc, ["Does it all."]);
    assert_eq!(task.say[0].text, "do {o}");
    let conditions = &task.conditions;
    let counts = (conditions.needs.len(), conditions.keeps.len(), conditions.gives.len());
    assert_eq!(counts, (1, 1, 1));
    assert!((task.limit.unwrap().quantity.value - 120.0).abs() < 1e-12);
    let [either, branch, repeat, some, all, together, check, bind, block, choice] =
        task.steps.as_slice()
    else {
        panic!("{:#?}", task.steps)
    };
    let Step::Either(either) = either else { panic!() };
    assert_eq!(either.branches.len(), 3);
    assert_eq!(either.branches[0].prior, Some(0.7));
    assert!(either.branches[0].when.is_some() && either.branches[1].when.is_none());
    assert!(
        matches!(&either.branches[1].block.steps[0], Step::Sequence(steps, _) if steps.len() == 2)
    );
    let Step::If(branch) = branch else { panic!() };
    let inner = &branch.otherwise.as_ref().unwrap().steps[0];
    assert!(matches!(inner, Step::If(inner) if inner.otherwise.is_some()));
    assert!(matches!(repeat, Step::Repeat(r) if r.times == 3 && r.until.is_some()));
    assert!(matches!(some, Step::Each(each) if each.kind.text == "A" && each.when.is_some()));
    assert!(matches!(all, Step::Each(each) if each.name.text == "q" && each.when.is_none()));
    let Step::Together(together) = together else { panic!() };
    assert_eq!(together.timings[0].relation, Allen::Overlaps);
    assert!((together.timings[0].by.unwrap().quantity.value - 0.3).abs() < 1e-12);
    let Step::Act(act) = &together.steps[1] else { panic!() };
    assert!(matches!(act.holds.as_slice(), [Hold::While(_), Hold::Until(_)]));
    assert_eq!(act.label.as_ref().unwrap().text, "q");
    assert!(matches!(check, Step::Check(..)) && matches!(bind, Step::Let(..)));
    let Step::Block(block) = block else { panic!() };
    assert_eq!((block.holds.len(), block.recoveries.len()), (1, 1));
    assert!(matches!(choice, Step::Act(a) if a.call.args[1].values.len() == 2));
    let remedies: Vec<_> = task.recoveries.iter().map(|r| r.remedy.clone().unwrap()).collect();
    assert_eq!(remedies[0], Remedy::Retry { other: true, times: 2 });
    assert_eq!(remedies[1], Remedy::Abort(Some("why".into())));
    assert_eq!(remedies[2], Remedy::Retry { other: false, times: 1 });
    assert_eq!(task.recoveries[1].of.as_ref().unwrap().name.text, "g");
}

#[test]
fn operators_bind_as_mathematics_and_people_expect() {
    let body = |text: &str| match clean(text).items.pop() {
        Some(Item::Fluent(fluent)) => fluent.body.kind,
        other => panic!("{other:?}"),
    };
    // `or` loosest, then `and`, then `not`, then the comparison with its tolerance.
    let ExprKind::Binary(left, BinaryOp::Or, _) =
        body("fluent f() = a and not b == 2 cm within 1 mm or c")
    else {
        panic!()
    };
    let ExprKind::Binary(_, BinaryOp::And, not) = left.kind else { panic!() };
    let ExprKind::Not(inner) = not.kind else { panic!() };
    assert!(matches!(inner.kind, ExprKind::Within(..)));
    // a - b - c is (a - b) - c; a + b * c is a + (b * c).
    let ExprKind::Binary(left, BinaryOp::Sub, _) = body("fluent f() = a - b - c") else { panic!() };
    assert!(matches!(left.kind, ExprKind::Binary(_, BinaryOp::Sub, _)));
    let ExprKind::Binary(_, BinaryOp::Add, right) = body("fluent f() = a + b * -c") else {
        panic!()
    };
    assert!(matches!(right.kind, ExprKind::Binary(_, BinaryOp::Mul, _)));
    assert!(matches!(body("fluent f() = gripper.open"), ExprKind::Member(..)));
}

#[test]
fn spans_hold_the_words_and_no_blank_or_note() {
    let text = "task t() {\n    lift(o)   // note\n    check height(o) > 1 cm   \n}\n";
    let source = Source::new("t", text);
    let task = task(text);
    let Step::Act(act) = &task.steps[0] else { panic!() };
    assert_eq!(source.slice(act.span), "lift(o)");
    let Step::Check(expr, span) = &task.steps[1] else { panic!() };
    assert_eq!(source.slice(expr.span), "height(o) > 1 cm");
    assert_eq!(source.slice(*span), "check height(o) > 1 cm");
    assert_eq!(source.slice(task.span), text.trim_end());
}

#[test]
fn words_that_look_like_keywords_or_units_may_be_names() {
    let task = task(
        "task retry(by: Length, order: A, android: A, notify: A, m: A) {\n\
             wait(5)\n cm(order)\n abort()\n limit(m)\n m(x: 3)\n check tall(on)\n}",
    );
    assert_eq!(task.params.len(), 5);
    assert_eq!(task.steps.len(), 6);
    // `5` at a line's end and `cm(order)` below are two things.
    let Step::Act(wait) = &task.steps[0] else { panic!() };
    assert!(
        matches!(&wait.call.args[0].values[0].kind, ExprKind::Literal(q) if q.dimension.is_none())
    );
}

#[test]
fn scenes_twins_and_models_read_as_in_the_design() {
    let program = clean(
        "/// As it stands today.\n\
         twin kitchen_twin of kitchen {\n\
             effect coulomb_friction(joint_4) { torque = 1.83 N*m +- 0.04 N*m }   // run 21\n\
             effect joint_zero_offset(joint_2) { angle = -0.41 deg }\n\
             effect joint_compliance(joint_2) { compliance = 2e-4 rad/(N*m) }\n\
         }\n\
         model tanks {\n    h1' = -k1*sqrt(h1) + k4*u   // { a brace in a note\n    output y: V = h2\n}\n\
         import \"geometry.rhai\"\n",
    );
    let [Item::Twin(twin), Item::Model(model), Item::Import(import)] = program.items.as_slice()
    else {
        panic!("{program:#?}")
    };
    assert_eq!((twin.of.text.as_str(), twin.effects.len()), ("kitchen", 3));
    let torque = &twin.effects[0].parameters[0];
    assert_eq!(torque.value.quantity.dimension, Dimension::TORQUE);
    assert!((torque.std.unwrap().quantity.value - 0.04).abs() < 1e-12);
    let angle = twin.effects[1].parameters[0].value.quantity.value;
    assert!((angle + 0.41_f64.to_radians()).abs() < 1e-12);
    assert!(model.body.to > model.body.from);
    assert_eq!(import.path.text, "geometry.rhai");
}

#[test]
fn the_prompt_runs_steps_and_asks_for_more_when_a_text_is_open() {
    let (step, found) = parse_line("pour(jar, cup)");
    assert!(found.is_empty() && matches!(step, Some(Step::Act(_))));
    let (step, _) = parse_line("pick(jar) then place(jar)");
    assert!(matches!(step, Some(Step::Sequence(steps, _)) if steps.len() == 2));
    let (step, found) = parse_line("pour(jar, cup");
    assert!(step.is_none() && found[0].code == "task::unclosed");
    let (step, found) = parse_line("type A");
    assert!(step.is_none() && found[0].code == "task::not_a_step");
    assert_eq!(parse_line("  // nothing\n"), (None, vec![]));
    for open in [
        "task t() {",
        "pour(jar,",
        "check",
        "pick(jar) then",
        "task t(o: A)",
        "check a <=",
        "/// d",
        "if held(jar) { place(jar) } else",
    ] {
        assert!(is_incomplete(open), "{open}");
    }
    for whole in [
        "pour(jar, cup)",
        "",
        "check tall(jar)",
        "task t() { }",
        "pour(jar))",
        "fluent f() = a",
        "where is the jar?",
        "pick up the jar!",
        "put the jar somewhere else",
        "pour(jar, cup);",
        "“pour(jar, cup)”",
    ] {
        assert!(!is_incomplete(whole), "{whole}");
    }
}

#[test]
fn monstrous_texts_are_answered_and_not_followed() {
    let texts = [
        "(".repeat(20_000),
        "{\n".repeat(5_000),
        format!("check {}a", "not ".repeat(20_000)),
        format!("check {}", "a + ".repeat(20_000)),
        format!("check a{}", ".b".repeat(20_000)),
        format!("if a {{ }} {}", "else if a { } ".repeat(2_000)),
        format!("f({})", "- ".repeat(20_000)),
        "\"".repeat(9_999),
        "/// only documentation\n".repeat(1_000),
        "either a { ".repeat(60),
    ];
    for text in texts {
        let (_, found) = parse(&text);
        let start: String = text.chars().take(20).collect();
        assert!(!found.is_empty() || text.starts_with("///"), "{start}");
    }
}

/// Pieces of the language, in any order.
fn fragments() -> impl Strategy<Value = String> {
    let words = prop::sample::select(vec![
        "task ",
        "action ",
        "fluent ",
        "scene ",
        "twin ",
        "of ",
        "model ",
        "type ",
        "pick",
        "(",
        ")",
        "{",
        "}",
        "o: ",
        "Graspable",
        ", ",
        "\n",
        "needs ",
        "gives ",
        "either ",
        "or ",
        "if ",
        "else ",
        "check ",
        "let ",
        "x = ",
        "12 cm",
        "5 parsecs",
        "\"text\"",
        "\"",
        "on failure ",
        "retry ",
        "while ",
        "until ",
        "not ",
        "and ",
        "== ",
        "within ",
        "<= ",
        "- ",
        "// note",
        "/// doc",
        "together ",
        "timing ",
        "repeat upto 3 times ",
        "gripper.open",
        "at ",
        "camera ",
        "image 640 x 480 ",
        "marks ",
        "~ ",
        "+- ",
        "°",
        "é",
        "=",
        "|",
        "'",
        "\u{a0}",
        "\r\n",
    ]);
    prop::collection::vec(words, 0..60).prop_map(|words| words.concat())
}

/// A tree for everything, diagnostics that lie in the text, and no panic, drawn or not.
fn survives(text: &str) {
    let (program, diagnostics) = parse(text);
    let source = Source::new("fuzz.task", text);
    let silent = diagnostics.is_empty();
    assert!(!silent || !program.items.iter().any(|item| matches!(item, Item::Bad(_))), "{text:?}");
    for diagnostic in &diagnostics {
        for label in &diagnostic.labels {
            assert!(label.span.from <= label.span.to && label.span.to <= text.len(), "{text:?}");
            assert!(text.is_char_boundary(label.span.from) && text.is_char_boundary(label.span.to));
        }
        render(diagnostic, &source, Style::Plain);
    }
    let laid_out = trueup::language::format(text);
    assert_eq!(trueup::language::format(&laid_out), laid_out, "{text:?}");
    is_incomplete(text);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_string_is_survived(text in "\\PC{0,80}") {
        survives(&text);
    }

    #[test]
    fn any_mix_of_the_language_is_survived(text in fragments()) {
        survives(&text);
    }
}
