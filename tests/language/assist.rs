//! What is offered while somebody writes, and what a word is said to mean.

use trueup::language::assist::{Place, complete, definition, hover, promises};
use trueup::language::ast::Step;
use trueup::language::{Library, Source, parse_line};

/// Completes at the `|` of a text, after the standard library.
fn offers(marked: &str) -> Vec<String> {
    let at = marked.rfind('¦').unwrap();
    let text = marked.replacen('¦', "", 1);
    let mut library = Library::standard();
    library.add(Source::new("mine.task", text.clone()));
    let scope = library.scope("kitchen");
    let place = Place { library: &library, scope: &scope, text: &text, at };
    complete(&place).into_iter().map(|offer| offer.label).collect()
}

#[test]
fn what_fits_the_type_of_an_argument_is_offered() {
    assert_eq!(offers("pour(¦"), ["cup", "jar", "source:", "target:", "amount:"]);
    assert_eq!(offers("pour(jar, c¦"), ["cup"]);
    assert_eq!(offers("approach(jar, ¦"), ["side", "top", "face:", "pitch:"]);
    assert_eq!(offers("approach(jar, face: t¦"), ["top"]);
    assert_eq!(offers("task t(it: Container) { pour(i¦ }"), ["it"]);
    // Nothing is offered where a value has just ended, in a note, or in a text.
    assert_eq!(offers("pour(jar ¦"), [""; 0]);
    assert_eq!(offers("// pour(¦"), [""; 0]);
    assert_eq!(offers("task t() { say \"po¦"), [""; 0]);
}

#[test]
fn what_may_begin_ends_or_follow_is_offered() {
    let top = offers("¦");
    for wanted in ["pour", "pick", "grasp", "task", "fluent", "check"] {
        assert!(top.iter().any(|offer| offer == wanted), "{wanted}");
    }
    let step = offers("task t() { ¦ }");
    assert!(step.iter().any(|o| o == "either") && !step.iter().any(|o| o == "fluent"));
    let value = offers("check ¦");
    assert!(value.iter().any(|o| o == "holding") && !value.iter().any(|o| o == "pick"));
    assert_eq!(offers("check vis¦"), ["visible"]);
    assert!(offers("task t(o: Con¦").contains(&"Container".to_owned()));
    assert!(offers("lift(jar, by: 12 ¦").contains(&"cm".to_owned()));
    assert_eq!(offers("pour(jar, cup, 150 m¦"), ["mL"]);
    assert_eq!(offers("pour(jar, cup, amount: 150 ¦"), ["mL", "L"]);
    assert_eq!(offers("pour(jar, cup, amount: filled(jar) - 15 m¦"), ["mL"]);
    // What is divided by may be of any kind.
    assert!(offers("pour(jar, cup, filled(jar) / 15 m¦").contains(&"mm".to_owned()));
    let ways = ["level_side", "tilted_side", "from_above", "turned_first"];
    assert_eq!(offers("pick(jar) via ¦"), ways);
    assert_eq!(offers("task ¦"), [""; 0]);
}

/// `pick up the ` offered every call, and `put(jar, at: ` the jar and no place beside another thing.
#[test]
fn a_sentence_is_offered_things_and_a_place_its_relations() {
    assert_eq!(offers("pick up the ¦"), ["cup", "jar", "table"]);
    assert_eq!(offers("pick up the j¦"), ["jar"]);
    assert_eq!(offers("put(jar, at: le¦"), ["left_of"]);
    let places = offers("put(jar, at: ¦");
    for wanted in ["cup", "table", "left_of", "point"] {
        assert!(places.iter().any(|offer| offer == wanted), "{wanted}: {places:?}");
    }
    assert!(!places.iter().any(|offer| offer == "jar"), "{places:?}");
    // Where a step may begin, it is offered.
    assert!(offers("pick(jar) as a\n¦").iter().any(|offer| offer == "pour"));
    assert_eq!(offers("task t() {\n    pour(\n        jar ¦"), [""; 0]);
}

fn said(text: &str, word: &str) -> String {
    let library = Library::standard();
    let scope = library.scope("kitchen");
    let at = text.find(word).unwrap();
    let place = Place { library: &library, scope: &scope, text, at };
    hover(&place).map(|hover| hover.text).unwrap_or_default()
}

#[test]
fn a_word_is_said_to_mean_what_it_means_there() {
    assert!(said("pick(jar)", "pick").contains("gives  holding(o)"));
    assert!(said("pick(jar)", "jar").starts_with("jar: Container"));
    assert_eq!(said("task t(o: Graspable) { pick(o) }", "o)"), "o: Graspable");
    assert!(said("check level(jar)", "level").contains("tilt(o) == 0 deg within 10 deg"));
    assert!(said("check tilt(jar) <= 5 deg", "deg").contains("angle"));
    assert!(said("pick(jar) while held(jar)", "while").contains("during the step"));
    assert!(said("type Mug: Container", "Container").contains("open vessel"));
    assert_eq!(said("fly(jar)", "fly"), "");
}

#[test]
fn a_word_leads_to_where_it_is_defined() {
    let library = Library::standard();
    let scope = library.scope("kitchen");
    let text = "task t(o: Graspable) { let up = 3 cm pick(o) lift(o, by: up) }";
    let at = |word: &str| {
        let place = Place { library: &library, scope: &scope, text, at: text.rfind(word).unwrap() };
        definition(&place)
    };
    let pick = at("pick").unwrap();
    assert_eq!(library.source_named(&pick.file).unwrap().slice(pick.span), "pick");
    assert_eq!(pick.file, "stdlib/tasks/std.task");
    assert_eq!(at("o,").unwrap().span.from, text.find("o:").unwrap());
    assert_eq!(at("cm"), None);
}

#[test]
fn a_call_promises_what_its_task_says_with_its_own_arguments() {
    let library = Library::standard();
    let (step, _) = parse_line("pour(jar, cup)");
    let Some(Step::Act(act)) = step else { panic!() };
    let promises = promises(&library, &act.call).unwrap();
    assert_eq!(promises.gives[0], "poured(cup, filled(jar))");
    assert_eq!(promises.needs[0], "not held(any)");
    assert!(promises.needs[1].starts_with("visible(jar) and visible(cup)"));
    assert!(promises.keeps.is_empty());
}
