//! Forms that stand beside the plain ones: renamed things, breakpoints, pinned branches, imports, and the
//! listing the language was designed with.

use trueup::language::ast::{Item, Step, TaskItem};
use trueup::language::{Library, Source, format, parse};

use super::{checked, each_is_told};

/// The design's own listing.
const SAMPLE: &str = include_str!("sample.task");

fn tasks(text: &str) -> Vec<TaskItem> {
    let (program, found) = parse(text);
    assert_eq!(found, [], "{text}");
    let tasks = program.items.into_iter().filter_map(|item| match item {
        Item::Task(task) => Some(task),
        _ => None,
    });
    tasks.collect()
}

#[test]
fn renamed_things_breakpoints_and_pinned_branches_read_as_written() {
    let text = "/// Fetch.\n#[was(\"get\")]\n#[was(\"bring\")]\ntask fetch(o: Graspable) {\n    \
                break\n    either #[was(\"left\")] side prior 0.5 { pick(o) via level_side, table while tall(o) as p }\n    \
                or #[was(\"up\")] top when tall(o) prior 0.5 { break when tall(o) look() }\n}\n";
    let [task] = &tasks(text)[..] else { panic!() };
    assert_eq!(task.doc, ["Fetch."]);
    let was: Vec<&str> = task.was.iter().map(|was| was.text.as_str()).collect();
    assert_eq!(was, ["get", "bring"]);
    assert!(matches!(&task.steps[0], Step::Break(stop) if stop.when.is_none()));
    let Step::Either(either) = &task.steps[1] else { panic!() };
    assert_eq!(either.branches[0].was[0].text, "left");
    let Step::Act(act) = &either.branches[0].block.steps[0] else { panic!() };
    let via: Vec<&str> = act.via.iter().map(|name| name.text.as_str()).collect();
    assert_eq!((via.as_slice(), act.holds.len()), (&["level_side", "table"][..], 1));
    assert_eq!(act.label.as_ref().unwrap().text, "p");
    // A guard may stand on either side of the prior.
    assert_eq!(either.branches[1].prior, Some(0.5));
    assert!(either.branches[1].when.is_some());
    let Step::Break(stop) = &either.branches[1].block.steps[0] else { panic!() };
    assert!(stop.when.is_some());
    assert_eq!(format(&format(text)), format(text));
    assert!(format(text).contains("#[was(\"get\")]"), "{}", format(text));
}

/// The words of the new forms may still be names.
#[test]
fn break_via_and_was_may_be_names() {
    let [task] = &tasks("task via(was: Graspable) { break(was) via(was) was(was) }")[..] else {
        panic!()
    };
    assert_eq!(task.steps.len(), 3);
}

#[test]
fn what_is_wrong_with_pins_breakpoints_and_renamings_is_told() {
    each_is_told(&[
        (
            "pick(jar) via level_sid",
            "task::unknown_name",
            "there is no branch in `pick` called `level_sid`",
            "did you mean `level_side`?",
        ),
        (
            "lift(jar, by: 3 cm) via side",
            "task::via",
            "there is nothing to choose in `lift`",
            "leave `via` out",
        ),
        (
            "task t() { break }",
            "task::break",
            "nothing follows that could be stopped before",
            "put it before the step that is to be looked at",
        ),
        (
            "task t() { break when height(jar) look() }",
            "task::type",
            "`when` takes a condition, and this is a length",
            "compare it, such as `height(jar) >= 12 cm`",
        ),
        (
            "#[was(\"pour\")]\ntask t() { look() }",
            "task::attribute",
            "there still is a task or action called `pour`",
            "name what this was called before it was renamed",
        ),
        (
            "#[is(\"pour\")]\ntask t() { look() }",
            "task::attribute",
            "an attribute stands before a task, an action or a branch",
            "write `#[was(\"old_name\")]` on the line before what was renamed",
        ),
    ]);
}

#[test]
fn what_is_wrong_with_a_recovery_is_told() {
    each_is_told(&[
        (
            "task t() { look() on failure { abort \"no\" home() } }",
            "task::recovery",
            "a recovery ends with `retry` or `abort`",
            "put this step before it",
        ),
        (
            "task t() { look() on failure look { home() } }",
            "task::recovery",
            "a recovery says whose failure it answers with `of`",
            "write `on failure of look { … }`",
        ),
        (
            "task t() { look() abort \"no\" }",
            "task::recovery",
            "`abort` says how a recovery ends",
            "write `on failure { abort }`",
        ),
    ]);
}

#[test]
fn what_is_wrong_with_a_sentence_is_told() {
    each_is_told(&[
        (
            "task t(o: Graspable) { say \"get {p}\" pick(o) }",
            "task::unknown_name",
            "the sentence names `{p}`, which is no parameter",
            "parameters are: o",
        ),
        (
            "task t(o: Graspable) { say \"[get {o}\" pick(o) }",
            "task::template",
            "`[` is never closed in the sentence",
            "add `]` where it should end",
        ),
        (
            "action a() { say \"[hello\" run \"home.rhai\" }",
            "task::template",
            "`[` is never closed in the sentence",
            "add `]` where it should end",
        ),
    ]);
}

#[test]
fn what_is_wrong_with_the_steps_of_a_task_is_told() {
    each_is_told(&[
        (
            "task a() { b() } task b() { a() }",
            "task::recursion",
            "`b` leads back to `a`",
            "write `repeat upto 3 times { … }` for what is done again",
        ),
        (
            "task t() { look() as a home() as a }",
            "task::duplicate",
            "two steps here are called `a`",
            "give each its own name",
        ),
        (
            "task t() { together { look() as a home() as b timing a befor b } }",
            "task::syntax",
            "`befor` cannot stand here",
            "did you mean `before`?",
        ),
        (
            "task t() { either a prior 70 % { look() } or b { home() } }",
            "task::syntax",
            "`%` cannot stand here",
            "a probability is a number from 0 to 1, such as `0.7`",
        ),
        (
            "check near(jar, cup | jar)",
            "task::alternatives",
            "`near` is asked about one thing at a time",
            "ask twice and join the answers with `or`; `|` is for what is done",
        ),
    ]);
}

/// The design's listing is syntax without a fault; what its check tells is what the standard library has
/// under other names, and one real mistake: `place` takes any graspable thing and asks whether it is level,
/// which is defined for containers.
#[test]
fn the_listing_of_the_design_reads_clean_and_the_check_says_what_it_lacks() {
    assert_eq!(parse(SAMPLE).1, []);
    let told: Vec<String> = checked(SAMPLE).into_iter().map(|(_, message, _)| message).collect();
    let lacking = ["inside", "lidded", "unlid", "raise", "watch", "tray"];
    for name in lacking {
        assert!(told.iter().any(|message| message.contains(&format!("`{name}`"))), "{name}");
    }
    let mistake = "`o` is a Container, and `o` is a Graspable";
    assert!(told.iter().any(|message| message == mistake));
    // With those names defined, and that mistake put right, nothing is left to tell.
    let defined = SAMPLE.replace("fluent level(o: Container)", "fluent level(o: Graspable)")
        + "type Tray: Surface\n\
           fluent inside(o: Graspable, at: Place) = offset(center(o), at) <= 5 cm\n\
           fluent lidded(o: Container) = capacity(o) <= 0 mL\n\
           fluent visible_all(o: Graspable) = visible(o)\n\
           action unlid(o: Container) { run \"home.rhai\" }\n\
           action raise(o: Graspable, by: Length) { run \"lift.rhai\" }\n\
           action watch(o: Graspable) { run \"look.rhai\" }\n\
           action approach(o: Graspable, face: Face) { run \"approach.rhai\" }\n\
           action move_over(o: Graspable, at: Place, clearance: Length) { run \"move_over.rhai\" }\n\
           action tilt(o: Container, to: Angle) { run \"tilt.rhai\" }\n\
           action untilt(o: Container) { run \"untilt.rhai\" }\n\
           scene listing { tray: Tray = box(20 cm, 20 cm, 1 cm) }\n";
    let mut library = Library::standard();
    let file = library.add(Source::new("listing.task", defined.clone()));
    let mut scope = library.scope("kitchen");
    scope.objects.extend(library.scope("listing").objects);
    let found: Vec<String> = library
        .check_file(file, &scope)
        .into_iter()
        .map(|d| format!("{}: {}", library.source(file).unwrap().place(d.span), d.message))
        .collect();
    // `contact` wants things, and `at` is a place: the listing's `lower` cannot be said with what is built in.
    assert_eq!(found, ["listing.task:41: `b` is an Object, and `at` is a place"]);
}

/// Files that a library is told of by path.
fn files(path: &str) -> std::io::Result<String> {
    match path {
        "lib/cups.task" => Ok("import \"../types.task\"\ntype Cup: Mug\n".into()),
        "types.task" => Ok("import \"lib/cups.task\"\ntype Mug: Container\n".into()),
        "lib/wave.rhai" => Ok("arm.wait(1.0);".into()),
        "lib/bad.task" => Ok("type\n".into()),
        path => Err(std::io::Error::other(format!("there is no {path}"))),
    }
}

#[test]
fn imports_bring_definitions_and_scripts_and_may_go_in_circles() {
    let mut library = Library::standard();
    let text = "import \"cups.task\"\nimport \"wave.rhai\"\ntask t(c: Cup) { look() }\n";
    let file = library.add_with(Source::new("lib/mine.task", text), &files);
    assert_eq!(library.check_file(file, &library.scope("kitchen")), []);
    assert!(library.is_a("Cup", "Mug") && library.is_a("Cup", "Graspable"));
    assert_eq!(library.scripts()["wave.rhai"], "arm.wait(1.0);");
    // What a file defines itself stands over what it imports.
    let text = "import \"cups.task\"\ntype Cup: Surface\n";
    library.add_with(Source::new("lib/other.task", text), &files);
    assert!(library.is_a("Cup", "Surface") && !library.is_a("Cup", "Mug"));
}

#[test]
fn an_import_that_fails_is_told_where_it_stands() {
    let mut library = Library::standard();
    let text = "import \"gone.task\"\nimport \"bad.task\"\n";
    let file = library.add_with(Source::new("lib/mine.task", text), &files);
    let found = library.check_file(file, &library.scope("kitchen"));
    let told: Vec<(&str, &str)> = found.iter().map(|d| (d.code, d.message.as_str())).collect();
    assert_eq!(
        told,
        [
            ("task::import", "cannot read `lib/gone.task`: there is no lib/gone.task"),
            ("task::import", "`lib/bad.task` has mistakes"),
        ]
    );
    assert_eq!(library.source(file).unwrap().slice(found[0].span), "\"gone.task\"");
}

/// Any other file was taken for a script that nobody ran, `/etc/passwd` as well, without a word.
#[test]
fn an_import_is_a_task_file_or_a_script_and_nothing_else() {
    let help = "import definitions from a `.task` file, or a script of actions from a `.rhai` file";
    let cases = [
        ("cups.tasks", "did you mean `cups.task`?"),
        ("cups", "did you mean `cups.task`?"),
        ("wave.rhia", "did you mean `wave.rhai`?"),
        ("../lib/cups.txt", "did you mean `../lib/cups.task`?"),
        ("/etc/passwd", help),
        (".task", help),
        (".", help),
    ];
    for (path, help) in cases {
        let mut library = Library::standard();
        let text = format!("import \"{path}\"\n");
        let file = library.add_with(Source::new("lib/mine.task", text), &files);
        let found = library.check_file(file, &library.scope("kitchen"));
        let [found] = found.as_slice() else { panic!("{path}: {found:?}") };
        let told = (found.code, found.message.clone(), found.help.as_deref().unwrap_or_default());
        let message = format!("`{path}` is neither a `.task` file nor a `.rhai` script");
        assert_eq!(told, ("task::import", message, help));
        assert_eq!(library.source(file).unwrap().slice(found.span), format!("\"{path}\""));
    }
}
