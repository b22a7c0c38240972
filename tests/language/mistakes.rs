//! What a person is told of each mistake, word by word: code, message, and the one thing that helps. How it is drawn is not
//! asked here.

use super::{checked, each_is_told};

#[test]
fn a_parameter_without_a_type_is_one_mistake() {
    let found = checked(
        "/// Two.\ntask two(a, b: Graspable, far: Length) {\n    needs visible(a)\n    pick(a)\n    pick(b)\n    lift(b, by: far)\n}\n",
    );
    let told: Vec<(&str, &str)> = found.iter().map(|(_, m, h)| (m.as_str(), h.as_str())).collect();
    let expected =
        [("a parameter says of what type it is", "write `a: Graspable`, or another type")];
    assert_eq!(told, expected);
    // What the others are is known all the same.
    let found = checked("/// Two.\ntask two(a, b: Length) {\n    pick(b)\n}\n");
    assert_eq!(found.len(), 2, "{found:?}");
}

#[test]
fn nothing_is_done_to_a_thing_with_itself() {
    let said = |step: &str| -> Vec<String> {
        let found = checked(&format!("task t(a: Container, b: Container) {{\n    {step}\n}}\n"));
        found.into_iter().map(|(_, message, _)| message).collect()
    };
    for (step, other) in [
        ("pour(a, a)", "`a` is given for `source` and for `target`"),
        ("push(a, at: left_of(a))", "`a` is given for `o` and for `at`"),
        ("put(a, at: between(b, a))", "`a` is given for `o` and for `at`"),
        ("check rests_on(a, left_of(a))", "`a` is given for `o` and for `at`"),
        ("check near(a, a)", "`a` is given for `a` and for `b`"),
    ] {
        assert_eq!(said(step), [other], "{step}");
    }
    for step in ["put(a, at: left_of(b))", "put(a, at: away_from(a, b))", "put(a, at: start_of(a))"]
    {
        assert!(said(step).is_empty(), "{step}: {:?}", said(step));
    }
}

#[test]
fn what_is_promised_of_what_no_step_changes_is_told() {
    let said = |gives: &str| {
        checked(&format!("task t(a: Container) {{\n    gives {gives}\n    pick(a)\n}}\n")).len()
    };
    assert_eq!([said("filled(a) >= 2 mL"), said("holding(a) and capacity(a) >= 2 mL")], [1, 1]);
    assert_eq!([said("volume(a) - filled(a) <= 2 mL"), said("holding(a)")], [0, 0]);
}

#[test]
fn an_unknown_name_is_told_with_the_nearest_or_the_known_ones() {
    each_is_told(&[
        ("pour(jra, cup)", "task::unknown_name", "there is no object `jra`", "did you mean `jar`?"),
        (
            "pour(bottle, cup)",
            "task::unknown_name",
            "there is no object `bottle`",
            "known are: cup, jar, table",
        ),
        (
            "put(jar, at: left_of(cup, up))",
            "task::unknown_name",
            "there is no view `up`",
            "known are: robot, camera",
        ),
        (
            "approach(jar, tpo)",
            "task::unknown_name",
            "there is no face `tpo`",
            "did you mean `top`?",
        ),
        (
            "put(jar, at: 5 cm)",
            "task::type",
            "`at` is a place, and `5 cm` is a length",
            "name a thing, a place beside one such as `left_of(cup)`, or a point of the table such as `point(50 cm, -20 cm)`",
        ),
        (
            "puor(jar, cup)",
            "task::unknown_name",
            "there is no task or action `puor`",
            "did you mean `pour`?",
        ),
        (
            "lift(jar, up: 5 cm)",
            "task::unknown_name",
            "there is no parameter of `lift` called `up`",
            "known are: o, by",
        ),
        (
            "check lvel(jar)",
            "task::unknown_name",
            "there is no fluent `lvel`",
            "did you mean `level`?",
        ),
        (
            "check gripper.opne",
            "task::unknown_name",
            "there is no member `opne`",
            "did you mean `open`?",
        ),
        (
            "task t(o: Grasbable) { look() }",
            "task::unknown_name",
            "there is no type `Grasbable`",
            "did you mean `Graspable`?",
        ),
    ]);
}

#[test]
fn a_number_without_its_unit_or_with_another_is_told() {
    each_is_told(&[
        (
            "lift(jar, by: 12)",
            "task::unit",
            "`by` is a length, and `12` has no unit",
            "write `12 cm`",
        ),
        (
            "lift(jar, by: 5 s)",
            "task::unit",
            "`by` is a length, and `5 s` is a time",
            "write a length, such as `12 cm`",
        ),
        (
            "check height(jar) > 3",
            "task::unit",
            "`height(jar)` is a length, and `3` has no unit",
            "write `3 cm`",
        ),
        (
            "check height(jar) > tilt(jar)",
            "task::unit",
            "`height(jar)` is a length, and `tilt(jar)` is an angle",
            "put quantities of one kind on both sides",
        ),
        (
            "action a() { run \"a.rhai\" limit 5 cm }",
            "task::unit",
            "`limit` takes a time, and this is a length",
            "write a time, such as `20 s`",
        ),
    ]);
}

/// `3 inch` was to be written `3 cm`, another length, and `height(jar) > 3 ml` as a volume.
#[test]
fn a_unit_of_another_system_is_converted_and_a_misspelt_one_is_of_the_kind_that_is_wanted() {
    for (text, write) in [
        ("check height(jar) > 3 inches", "7.62 cm"),
        ("lift(jar, by: 3 in)", "7.62 cm"),
        ("check height(jar) > 3 ml", "3 mm"),
        ("check tall(jar) and volume(cup) + volume(jar) > 3 ml", "3 mL"),
        ("pour(jar, cup, amount: 3 ml)", "3 mL"),
    ] {
        let found = checked(text);
        let [(code, _, help)] = found.as_slice() else { panic!("{text}: {found:?}") };
        assert_eq!(*code, "task::unit", "{text}");
        assert!(help.starts_with(&format!("write `{write}`  (units: ")), "{text}: {help}");
    }
}

#[test]
fn arguments_that_do_not_fit_a_call_are_told() {
    each_is_told(&[
        (
            "pour(jar)",
            "task::argument",
            "`pour` lacks `target`, a Container",
            "write `pour(source, target, amount)`",
        ),
        (
            "pour(jar, cup, 60 mL, 3)",
            "task::argument",
            "`pour` takes 3 arguments",
            "write `pour(jar, cup, 60 mL)`",
        ),
        (
            "pour(jar, table)",
            "task::type",
            "`target` is a Container, and `table` is a Surface",
            "what fits here: cup, jar",
        ),
        (
            "open_drawer(jar)",
            "task::type",
            "`d` is a Drawer, and `jar` is a Container",
            "nothing in this scene is a Drawer; `?Drawer` at the prompt says what one is",
        ),
        (
            "pour jar cup",
            "task::call",
            "what `pour` acts on stands in parentheses",
            "write `pour(jar, cup)`",
        ),
        (
            "lift(jar, by = 12 cm)",
            "task::equals",
            "an argument is given with `:`, not with `=`",
            "write `by: 12 cm`",
        ),
    ]);
}

/// `within -3 deg` held by 3 deg, `within 0 deg` was unknown whatever was measured, and so was a quotient by zero.
#[test]
fn a_tolerance_of_nothing_and_a_quotient_by_zero_are_told() {
    each_is_told(&[
        (
            "check tilt(jar) == 0 deg within -3 deg",
            "task::tolerance",
            "the tolerance is -3 deg; it should be more than 0 deg",
            "write `within 3 deg`",
        ),
        (
            "check height(jar) == 9 cm within 2 mm - 2 mm",
            "task::tolerance",
            "the tolerance is 0 mm; it should be more than 0 mm",
            "write how close, such as `within 5 mm`",
        ),
        (
            "check height(jar) / 0 > 3 cm",
            "task::division",
            "`0` is zero, and nothing can be divided by it",
            "divide by something that is not zero",
        ),
        (
            "pour(jar, cup, amount: 60 mL / (2 - 2))",
            "task::division",
            "`2 - 2` is zero, and nothing can be divided by it",
            "divide by something that is not zero",
        ),
    ]);
}

#[test]
fn a_condition_that_cannot_be_read_off_is_told() {
    each_is_told(&[
        (
            "check volume(cup) == 60 mL",
            "task::tolerance",
            "two measured quantities are never exactly equal",
            "add a tolerance: `volume(cup) == 60 mL within 10 mL`",
        ),
        (
            "check height(jar)",
            "task::type",
            "`check` takes a condition, and this is a length",
            "compare it, such as `height(jar) >= 12 cm`",
        ),
        (
            "check height(jar) = 3 cm",
            "task::equals",
            "`=` gives a value; it does not compare",
            "write `==` with `within` and a tolerance, or `>=`, `<=`",
        ),
        (
            "check 1 cm < height(jar) < 5 cm",
            "task::chain",
            "a comparison has two sides",
            "compare two at a time and join them with `and`",
        ),
        (
            "holding(jar)",
            "task::not_a_step",
            "`holding` is something to ask, not something to do",
            "to ask it, write `check holding(…)`",
        ),
        (
            "check jar.level",
            "task::unknown_name",
            "`level` is asked with the object in parentheses",
            "write `level(…)`",
        ),
    ]);
}

#[test]
fn a_step_that_reads_otherwise_elsewhere_is_told() {
    each_is_told(&[
        ("pour(jar, cup);", "task::separator", "steps need no `;` between them", "remove the `;`"),
        (
            "repeat 3 times { look() }",
            "task::loop",
            "a repetition says how often at most",
            "write `repeat upto 3 times { … }`",
        ),
        (
            "either a { look() }",
            "task::syntax",
            "something is missing after this",
            "a choice has at least two branches: `or other { … }`",
        ),
        (
            "pick(jar) wihle held(jar)",
            "task::keyword",
            "`wihle` cannot start anything here",
            "did you mean `while`?",
        ),
        (
            "look",
            "task::syntax",
            "something is missing after this",
            "write `look()`, with what it acts on between the parentheses",
        ),
        ("pour(jar，cup)", "task::syntax", "`，` cannot stand here", "write `,`"),
        ("pour(jar; cup)", "task::syntax", "`;` cannot stand here", "write `,`"),
        (
            "“pour(jar, cup)”",
            "task::syntax",
            "`“` cannot stand here",
            "write it without quotation marks",
        ),
        (
            "then place(jar)",
            "task::separator",
            "`then` joins two steps, and begins none",
            "leave the `then` out, or write it between two: `a() then b()`",
        ),
        (
            "pour(jar, cup))",
            "task::unopened",
            "`)` closes nothing",
            "remove this `)`, or open it earlier",
        ),
        (
            "task t() { repeat upto 0 times { look() } }",
            "task::count",
            "`0` is not a number of times",
            "write how often at most, such as `3 times`",
        ),
        (
            "task t() { timing a before b look() }",
            "task::timing",
            "`timing` relates steps that run at the same time",
            "move it into the `together { … }` whose steps it names",
        ),
    ]);
}

#[test]
fn a_definition_that_cannot_stand_is_told() {
    each_is_told(&[
        (
            "action a() {\n    look()\n    run \"a.rhai\"\n}",
            "task::syntax",
            "an action runs one script and has no steps",
            "make it a task, or call `look` from the script",
        ),
        (
            "scene s { c: Container = cylinder(radius 8 cm height 9 cm) }",
            "task::comma",
            "missing `,` before `height`",
            "separate arguments with commas",
        ),
        (
            "scene s { c: Container = cylinder(radius 8 cm, height 9 cm) { looks blue } }",
            "task::syntax",
            "`blue` cannot stand here",
            "",
        ),
        (
            "task t(or: Graspable) { look() }",
            "task::reserved",
            "`or` is a word of the language and cannot be a name",
            "choose another name, such as `or_`",
        ),
        (
            "fluent f() = g()\nfluent g() = f()",
            "task::cycle",
            "`g` is defined by itself, through `f`",
            "say what it is by things that can be measured",
        ),
        (
            "fluent tilt(o: Object) = true",
            "task::built_in",
            "`tilt` is built in",
            "choose another name for yours",
        ),
        (
            "action a() { limit 5 s }",
            "task::missing",
            "the action `a` does nothing",
            "add `run \"a.rhai\"`",
        ),
    ]);
}

#[test]
fn one_mistake_is_told_once() {
    assert_eq!(checked("pour(jar, cup, amount: 60 mL / 0)").len(), 1);
    for text in [
        "pour(jra, cup)",
        "lift(jar, by: 12 parsecs)",
        "pour(jar, cup",
        "task t() { tilt( }",
        "check height(jar) > 5 parsecs",
    ] {
        assert_eq!(checked(text).len(), 1, "{text}: {:?}", checked(text));
    }
}

#[test]
fn fluents_of_fluents_are_followed_once_and_not_forever() {
    // Followed anew at each mention, sixty doublings would outlast the arm.
    let doubled = |i: u32| format!("fluent f{i}(o: Object) = f{0}(o) and f{0}(o)\n", i - 1);
    let fluents: String = (1..60).map(doubled).collect();
    let text = format!("fluent f0(o: Object) = height(o) > 1 cm\n{fluents}check f59(jar)\n");
    assert_eq!(checked(&text), []);
}

/// What people write who have not read the manual, and the one thing that helps.
#[test]
fn what_strangers_write_is_answered_with_what_to_write() {
    let inside = |step: &str| format!("task t(o: Container) {{\n    {step}\n}}\n");
    for (text, help) in [
        (inside("needs visible(o), tall(o)"), "write `and` instead of the `,`"),
        (inside("gives holding o"), "write `holding(o)`"),
        (inside("check tall(o) and"), "write the other condition, or leave the `and` out"),
        (inside("lift 12 cm"), "write `lift(12 cm)`"),
        (inside("if tall(o) { look() } elif held(o) { home() }"), "write `else if`"),
        (inside("if tall(o) lift(o)"), "what is done stands in braces: `{ … }`"),
        (inside("break if tall(o)\n    look()"), "write `break when tall(o)`"),
        (inside("repeat until tall(o) { look() }"), "write `repeat upto 10 times { … } until …`"),
        (
            inside("place(o) limit 2 s"),
            "write `limit 2 s` on a line of its own if it is the task's, or make the step a task with this limit",
        ),
        (inside("pick(o).then(place(o))"), "write `a() then b()`"),
        (inside("pick(o)\n    on failure of pick { retry other upto 2 }"), "write `upto 2 times`"),
        (inside("pick(\"jar\")"), "write `jar`, without quotes"),
        ("fluent sad(o: Object) = held(o) ask Is it?\n".into(), "write `ask \"Is it?\"`"),
        ("fluent glad(o) = true\n".into(), "write `o: Graspable`, or another type"),
        (
            "task t(o: Mug) { pick(o) }\n".into(),
            "known are: Container, Drawer, Graspable, Surface, Object, Place and 18 more",
        ),
    ] {
        let found = checked(&text);
        let [(_, message, said)] = found.as_slice() else { panic!("{text}{found:?}") };
        assert_eq!(said, help, "{text}{message}");
    }
}

/// `pick(o)`, and on the next line `while holding(o) { look() }`: it was a `pick` held to that, and then a block.
#[test]
fn a_loop_behind_a_step_is_told_as_one() {
    let inside = |steps: &str| checked(&format!("task t(o: Container) {{\n    {steps}\n}}\n"));
    let loops = [
        ("while", "pick(o)\n    while holding(o) { look() }\n    place(o)"),
        ("while", "pick(o)\n    while holding(o)\n    {\n        look()\n    }"),
        ("until", "pick(o) until held(o) { look() }"),
        ("while", "{ pick(o) } while held(o) { look() }"),
    ];
    let help =
        "write `repeat upto 10 times { … } until …`; a block that follows the step begins a line";
    for (word, steps) in loops {
        let message = format!("there is no `{word}` loop: every loop has an end");
        assert_eq!(inside(steps), [("task::loop", message, help.to_owned())], "{steps}");
        let found = checked(&steps.replace("(o)", "(jar)"));
        assert_eq!(found.first().map(|told| told.0), Some("task::loop"), "{steps}");
    }
    for whole in [
        "pick(o) while held(o)\n    { look() } as looking",
        "pick(o)\n    while held(o)\n    look()",
        "pick(o) while held(o) as taking { look() }",
    ] {
        assert_eq!(inside(whole), [], "{whole}");
    }
}

/// The last of them was taken, and nothing said so.
#[test]
fn a_second_scene_in_a_file_is_told() {
    let jar = "jar: Container = cuboid(6 cm, 6 cm, 14 cm)";
    let found = checked(&format!("scene a {{ {jar} }}\nscene b {{ {jar} }}\n"));
    let told = (found[0].0, found[0].1.as_str(), found[0].2.as_str());
    let help = "put `b` into a file of its own, and name that with `--scene`";
    assert_eq!(told, ("task::duplicate", "a file has one scene, and this is another", help));
}

/// It means: put everything on the table onto the table. It was rehearsed, and could never succeed.
#[test]
fn the_table_is_not_cleared_onto_itself() {
    let clear = "what `clear` does: Put everything that stands on, or in, one thing on the table.";
    let told = [
        ("clear(table)", "task::argument", "`at` of `clear` cannot be `table`", clear),
        ("clear(at: table)", "task::argument", "`at` of `clear` cannot be `table`", clear),
        (
            "collect(table)",
            "task::argument",
            "`at` of `collect` cannot be `table`",
            "what `collect` does: Put everything that stands on the table on, or in, one thing.",
        ),
    ];
    each_is_told(&told);
    assert_eq!(checked("clear(cup)"), []);
}
