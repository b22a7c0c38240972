//! What people write who come from another language, another keyboard or a page of the manual: one mistake each, with what
//! is to be written instead.

use super::{checked, each_is_told};

#[test]
fn what_other_languages_write_is_told_with_what_is_written_here() {
    each_is_told(&[
        (
            "pour(jar, cup, amount: 1,5 mL)",
            "task::argument",
            "a decimal number is written with a point",
            "write `1.5 mL`",
        ),
        (
            "check height(jar) > 1,5 cm",
            "task::syntax",
            "a decimal number is written with a point",
            "write `1.5 cm`",
        ),
        (
            "fluent f(o: Graspable) = visible(o) and height(o) > 3 cm and",
            "task::syntax",
            "a condition is missing after `and`",
            "write the other condition, or leave the `and` out",
        ),
        (
            "pick(jar) and place(jar)",
            "task::separator",
            "`and` joins conditions, not steps",
            "write `then`, or nothing at all: steps run one after the other",
        ),
        (
            "fluent f(o: Graspable) = visible o",
            "task::call",
            "what `visible` is about stands in parentheses",
            "write `visible(o)`",
        ),
        (
            "task t(o: Graspable) {\n    pick(o) then\n}",
            "task::syntax",
            "a step is missing after `then`",
            "write what comes next, or leave the `then` out",
        ),
        ("check height(jar) => 3 cm", "task::syntax", "`=>` cannot stand here", "write `>=`"),
        (
            "fluent f(o: Graspable) = visible(o) && level(o)",
            "task::syntax",
            "`&&` cannot stand here",
            "write `and`",
        ),
        (
            "fluent f(o: Graspable) = visible(o) || level(o)",
            "task::syntax",
            "`||` cannot stand here",
            "write `or`",
        ),
        (
            "fluent f(o: Graspable) = !visible(o)",
            "task::syntax",
            "`!` cannot stand here",
            "write `not`",
        ),
        (
            "def serve(o):\n    pick(o)",
            "task::keyword",
            "`def` is no word here; definitions begin with `task`",
            "write `task serve(o: Graspable) { … }`",
        ),
        (
            "aufgabe serviere(o: Greifbar) {\n    nimm(o)\n}",
            "task::keyword",
            "`aufgabe` is no word here; definitions begin with `task`",
            "write `task serviere(o: Graspable) { … }`",
        ),
        ("# first the jar", "task::syntax", "remarks begin with `//`", "write `// first the jar`"),
        ("pick(jar) -- slowly", "task::syntax", "remarks begin with `//`", "write `// slowly`"),
        (
            "scene s { camera c { image 1280x720 } }",
            "task::unit",
            "`x720` is not a unit",
            "write `1280 x 720`",
        ),
        (
            "fluent f(o: Graspable) = g(o)\nfluent g(o: Graspable) = h(o)\nfluent h(o: Graspable) = f(o)",
            "task::cycle",
            "`g` is defined by itself, through `h` and `f`",
            "say what it is by things that can be measured",
        ),
    ]);
}

#[test]
fn one_slip_is_one_mistake() {
    let told = |text: &str| -> Vec<String> {
        checked(text).into_iter().map(|(_, message, _)| message).collect()
    };
    assert_eq!(
        told("pour(jar, cup, amount: 1,5 mL)"),
        ["a decimal number is written with a point"]
    );
    assert_eq!(
        told("/// Serve.\ntask serve(o: Graspable) {\n    pick(o)\n    place(o)\n\nserve(jar)\n"),
        ["`{` is never closed"]
    );
    assert_eq!(
        told(
            "task serve(o: Graspable) {\n    say \"serve the {o}\n    needs visible(o)\n    pick(o)\n}"
        ),
        ["this text is never closed"]
    );
    assert_eq!(told("scene s { camera c { image 1280x720 } }"), ["`x720` is not a unit"]);
    // A thing that only asks for what is in a circle is in none.
    let circle = "fluent f(o: Graspable) = f(o)\nfluent g(o: Graspable) = f(o)";
    assert_eq!(told(circle), ["`f` is defined by itself"]);
}
