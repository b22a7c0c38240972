//! `say`: sentences to calls, without a robot.

use crate::program::Scratch;

#[test]
fn the_sentence_of_the_paper_is_the_call_of_the_paper() {
    let scratch = Scratch::new("cli-say");
    let sentence = "Pour water from the transparent jar into the blue cup";
    let said = scratch.trueup(&["say", sentence]);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(said.out.starts_with("= pour(jar, cup)\n"), "{}", said.out);
    assert!(said.out.contains("target: \"blue cup\" is cup"), "{}", said.out);
    let json = scratch.trueup(&["say", sentence, "--json"]).json();
    assert_eq!(
        (json["meaning"].as_str(), json["call"].as_str()),
        (Some("clear"), Some("pour(jar, cup)"))
    );
    assert_eq!(json["defaults"], serde_json::json!(["amount: filled(source)"]));
    // What is typed as the language is the language.
    assert_eq!(scratch.trueup(&["say", "pick(jar)", "--json"]).json()["call"], "pick(jar)");
    assert_eq!(scratch.everything(), [""; 0], "understanding leaves nothing behind");
}

#[test]
fn what_is_ambiguous_impossible_or_unknown_is_told_apart() {
    let scratch = Scratch::new("cli-say-not");
    let kitchen = crate::program::project("stdlib/scenes/kitchen.task");
    let two = std::fs::read_to_string(kitchen).unwrap().replace(
        "    marks",
        "    cup2: Container = cylinder(radius 4 cm, height 9 cm) { wall 3 mm  looks \"red cup\" }\n    marks",
    );
    scratch.file("two.task", &two);
    let ask = |sentence: &str| {
        let said = scratch.trueup(&["say", sentence, "--scene", "two.task", "--json"]);
        assert_eq!(said.code, 1, "{sentence}");
        said.json()
    };
    let found = ask("please pour the jar into the cup");
    assert_eq!(found["meaning"], "ambiguous");
    assert_eq!(found["question"], "which cup: blue cup or red cup?");
    assert_eq!(found["choices"][1]["call"], "pour(jar, cup2)");
    let found = ask("pour the jar into the green cup");
    assert_eq!(
        (found["meaning"].as_str(), found["why"].as_str()),
        (Some("impossible"), Some("there is no green cup here"))
    );
    assert_eq!(found["help"], "there is: blue cup or red cup");
    assert_eq!(ask("juggle the cups")["meaning"], "unknown");
}

#[test]
fn taught_phrases_come_from_a_file() {
    let scratch = Scratch::new("cli-say-phrases");
    scratch.file("mine.txt", "// mine\n\"empty the {o}\" = pour(o, cup)\n");
    let said = scratch.trueup(&["say", "Empty the jar!", "--phrases", "mine.txt"]);
    assert!(said.out.starts_with("= pour(jar, cup)\n"), "{}", said.out);
    scratch.file("bad.txt", "\n\"empty (the {o}\" = pour(o, cup)\n");
    let said = scratch.trueup(&["say", "empty the jar", "--phrases", "bad.txt", "--json"]);
    assert_eq!((said.code, said.error("where")), (2, "bad.txt:2".to_owned()));
}
