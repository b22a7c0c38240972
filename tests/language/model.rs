//! `model` blocks: what is read, and what is objected to.

use trueup::language::ast::{Item, ModelItem, StartValue};
use trueup::language::{Diagnostic, check_model, parse};
use trueup::units::Dimension;

fn model(text: &str) -> ModelItem {
    let (program, diagnostics) = parse(text);
    assert!(diagnostics.is_empty(), "{diagnostics:#?}");
    let model = program.items.into_iter().find_map(|item| match item {
        Item::Model(model) => Some(model),
        _ => None,
    });
    model.expect("a model")
}

/// Code, message and help of what is wrong with a model's body.
fn told(body: &str) -> Vec<(&'static str, String, String)> {
    let found: Vec<Diagnostic> = check_model(&model(&format!("model m {{\n{body}\n}}\n"))).1;
    found.into_iter().map(|d| (d.code, d.message, d.help.unwrap_or_default())).collect()
}

#[track_caller]
fn only(body: &str, code: &str, message: &str, help: &str) {
    let found = told(body);
    assert_eq!(found.len(), 1, "{found:#?}");
    assert_eq!(found[0].0, code, "{found:#?}");
    assert!(found[0].1.contains(message), "{found:#?}");
    assert!(found[0].2.contains(help), "{found:#?}");
}

const TANK: &str = "\
/// A tank.
model tank {
    input  u: V, w
    param  k: m/V/s = free ~ 0.05 in 0 to 1, area = 2 m^2
    state  h: m = free ~ 1 m, z = 0
    let    out = k*sqrt(h)
    h' = k*u - out        // level
    z' = (h - z)/(2 s)
    output y: m = h
    output late = delay(h, 40 ms)
}
";

#[test]
fn every_part_of_a_model_is_read() {
    let model = model(TANK);
    assert_eq!((model.name.text.as_str(), model.doc.len()), ("tank", 1));
    let names: Vec<&str> = model.inputs.iter().map(|i| i.name.text.as_str()).collect();
    assert_eq!(names, ["u", "w"]);
    assert_eq!(model.inputs[0].unit.unwrap().unit.dimension, Dimension::VOLTAGE);
    let StartValue::Free(Some(guess)) = &model.params[0].value else { panic!("{model:#?}") };
    assert!((guess.quantity.value - 0.05).abs() < 1e-15);
    let [low, high] = model.params[0].range.unwrap();
    assert!(low.quantity.value.abs() < 1e-15 && (high.quantity.value - 1.0).abs() < 1e-15);
    assert!(matches!(model.params[1].value, StartValue::Fixed(_)));
    let counts = (model.states.len(), model.lets.len(), model.equations.len(), model.outputs.len());
    assert_eq!(counts, (2, 1, 2, 2));
    let body = &TANK[model.body.from..model.body.to];
    assert!(body.contains("input") && !body.contains('}'), "{body}");
}

#[test]
fn units_follow_from_those_that_are_given() {
    let body = "input u: V\nparam k = free, c = free\nstate x: m = free, v = free\nx' = v\nv' = k*u - c*v\noutput y = x";
    let (units, found) = check_model(&model(&format!("model m {{\n{body}\n}}\n")));
    assert!(found.is_empty(), "{found:#?}");
    assert_eq!(units.of("v"), Some(Dimension::SPEED));
    assert_eq!(units.of("c"), Some(Dimension::FREQUENCY));
    let acceleration = Dimension::SPEED / Dimension::TIME;
    assert_eq!(units.of("k"), Some(acceleration / Dimension::VOLTAGE));
    assert_eq!(units.of("y"), Some(Dimension::LENGTH));
}

/// The formula that `gap` found was written with it, and could not be read again.
#[test]
fn a_unit_with_nothing_above_the_line_is_read() {
    let of = |guess: &str| {
        let model = model(&format!(
            "model m {{\ninput u\nparam k = free ~ {guess}\nstate x = 0\nx' = k*u\noutput y = x\n}}\n"
        ));
        let StartValue::Free(Some(guess)) = &model.params[0].value else { panic!("{model:#?}") };
        guess.quantity
    };
    let per_second = Dimension::FREQUENCY;
    assert_eq!(of("1 1/s^2").dimension, per_second / Dimension::TIME);
    let found = of("-1.506 1/m/s^2");
    assert_eq!(found.dimension, per_second / Dimension::TIME / Dimension::LENGTH);
    assert!((found.value + 1.506).abs() < 1e-12, "{found:?}");
    assert!((of("3 1/min").value - 0.05).abs() < 1e-12);
    let found = parse("model m {\ninput u\nparam k = free ~ 1 1/sec\n}\n").1;
    assert_eq!(found[0].code, "task::operator", "{found:#?}");
    let help = found[0].help.as_deref().unwrap();
    assert!(help.starts_with("`1/sec` is not a unit; units: "), "{help}");
}

#[test]
fn a_model_without_units_has_nothing_to_object_to() {
    assert!(
        told("input u\nparam k = free\nstate x = 0\nx' = k*u - x + 3\noutput y = x").is_empty()
    );
}

#[test]
fn what_cannot_be_added_is_told_where_it_stands() {
    only(
        "input u: V\nstate x: m = 0\nx' = x/(1 s) + u\noutput y = x",
        "task::unit",
        "this is in V, what stands before it in m/s",
        "only like can be added to like",
    );
    only(
        "state x: m = 0\nstate v: m/s = 0\nx' = v*v\nv' = -x/(1 s^2)\noutput y = x",
        "task::unit",
        "`x'` is in m/s, its formula in m^2/s^2",
        "a factor",
    );
    only(
        "state x: m = 0\nx' = -sin(x)*(1 m/s)\noutput y = x",
        "task::unit",
        "`sin` takes a plain number or an angle, this is in m",
        "",
    );
    only(
        "param k: 1/s = free ~ 3 V\nstate x = 0\nx' = -k*x\noutput y = x",
        "task::unit",
        "`k` is in 1/s",
        "same unit",
    );
}

#[test]
fn names_that_are_not_there_are_told_with_the_nearest() {
    only(
        "param gain = 1\nstate x = 0\nx' = -gian*x\noutput y = x",
        "task::unknown_name",
        "no `gian`",
        "`gain`",
    );
    only(
        "state x = 0\nx' = -sqrrt(x)\noutput y = x",
        "task::unknown_name",
        "no function `sqrrt`",
        "`sqrt`",
    );
    only(
        "state x = 0\nx' = -x\nz' = x\noutput y = x",
        "task::unknown_name",
        "`z` is not a state",
        "",
    );
}

/// What is measured may bear the name of the state it is a measurement of, sensor and all; nothing else may.
#[test]
fn an_output_may_be_called_as_the_state_it_measures() {
    for output in ["x", "1.1*x", "x + 0.2", "delay(x, 0.1 s)"] {
        let found = told(&format!("state x = 0\nx' = -x\noutput x = {output}"));
        assert!(found.is_empty(), "{output}: {found:#?}");
    }
    let other = "state x = 0\nstate z = 0\nx' = -x\nz' = -z\noutput x = z";
    only(other, "task::duplicate", "two things", "another name");
}

#[test]
fn what_is_missing_or_double_is_told() {
    only("state x = 0\noutput y = x", "task::missing", "`x` has no equation", "x' = …");
    only("state x = 0\nx' = -x", "task::missing", "has no output", "output y = …");
    only(
        "state x = 0\nx' = -x\nx' = x\noutput y = x",
        "task::duplicate",
        "two equations",
        "together",
    );
    only(
        "param x = 1\nstate x = 0\nx' = -x\noutput y = x",
        "task::duplicate",
        "two things",
        "another name",
    );
    only(
        "param k = free in 2 to 1\nstate x = 0\nx' = -k*x\noutput y = x",
        "task::range",
        "empty",
        "smaller end first",
    );
    only(
        "let a = b\nlet b = a\nstate x = 0\nx' = a\noutput y = x",
        "task::cycle",
        "defined by itself",
        "state",
    );
}

#[test]
fn only_what_is_measured_has_a_past() {
    only(
        "state x = 0\nx' = -delay(x, 1 s)\noutput y = x",
        "task::delay",
        "only an input, or a whole output",
        "",
    );
    only(
        "input u\nstate x = 0\nx' = delay(u, x)\noutput y = x",
        "task::delay",
        "does not change",
        "parameter",
    );
    assert!(told("input u\nparam d = free ~ 0.1 s\nstate x = 0\nx' = delay(u, d) - x\noutput y = delay(x, d)").is_empty());
}

#[test]
fn functions_take_as_many_values_as_they_take() {
    only(
        "state x = 0\nx' = -atan2(x)\noutput y = x",
        "task::arity",
        "takes 2 values, not 1",
        "commas",
    );
}

/// One mistake costs one entry; the rest of the model is read.
#[test]
fn a_broken_line_costs_that_line() {
    let (program, diagnostics) = parse(
        "model m {\n    input u\n    prm k = 1\n    state x = 0\n    x' = u - x\n    output y = x\n}\n",
    );
    assert_eq!(diagnostics.len(), 1, "{diagnostics:#?}");
    let Some(Item::Model(model)) = program.items.first() else { panic!("{program:#?}") };
    assert_eq!((model.inputs.len(), model.states.len(), model.outputs.len()), (1, 1, 1));
}

/// The powers of a formula bind as in mathematics: `-x^2` is negative, `2^-1` is a half.
#[test]
fn powers_bind_tighter_than_signs() {
    let model = model("model m {\n    state x = 0\n    x' = -x^2 + 2^-1\n    output y = x\n}\n");
    let text = format!("{:?}", model.equations[0].formula.kind);
    assert!(text.find("Negate").unwrap() < text.find("pow").unwrap(), "{text}");
}
