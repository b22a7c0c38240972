//! What one sentence means, and how that is answered: a call, a question, why it is impossible, what would be understood. Tables of
//! sentences are in `sentences`.

use trueup::language::ast::Call;
use trueup::language::sentence::{
    Knowledge, Meaning, Phrase, Spot, displaced, phrase, single_words, sound, things, understand,
    words,
};
use trueup::language::{Library, Source, text};

/// The kitchen with a second cup and a block that nothing can be poured into.
const TABLE: &str = "scene table {
    jar: Container = cuboid(6 cm, 6 cm, 14 cm) { looks \"transparent jar\" }
    cup: Container = cylinder(radius 4 cm, height 9 cm) { looks \"blue cup\" }
    cup2: Container = cylinder(radius 4 cm, height 9 cm) { looks \"red cup\" }
    block: Graspable = cuboid(5 cm, 5 cm, 5 cm)
}";

fn read(
    sentence: &str,
    phrases: &[Phrase],
    hindrance: &dyn Fn(&Call) -> Option<String>,
) -> Meaning {
    at_the_table(|with| understand(sentence, &Knowledge { phrases, hindrance, ..*with }))
}

fn at_the_table<T>(ask: impl Fn(&Knowledge<'_>) -> T) -> T {
    let mut library = Library::standard();
    library.add(Source::new("table.task", TABLE));
    let things = things(library.scene("table").unwrap().0);
    ask(&Knowledge {
        library: &library,
        things: &things,
        phrases: &[],
        it: None,
        spot: &nowhere,
        hindrance: &nothing,
    })
}

pub(super) fn nothing(_: &Call) -> Option<String> {
    None
}

pub(super) fn nowhere(_: &str) -> Option<Spot> {
    None
}

fn clear(sentence: &str) -> String {
    match read(sentence, &[], &nothing) {
        Meaning::Clear(found) => found.text,
        other => panic!("{sentence}: {other:?}"),
    }
}

#[test]
fn a_clear_sentence_is_one_call() {
    let cases = [
        ("Pour water from the transparent jar into the blue cup", "pour(jar, cup)"),
        ("pour the jar to the red cup.", "pour(jar, cup2)"),
        ("Please grab the jar", "pick(jar)"),
        ("Could you please pick up the block, robot? Thanks!", "pick(block)"),
        ("take cup2 now", "pick(cup2)"),
        ("put the block down", "place(block)"),
        ("hand me the block", "hand_over(block)"),
        ("please hand over the jar", "hand_over(jar)"),
    ];
    for (sentence, call) in cases {
        assert_eq!(clear(sentence), call, "{sentence}");
    }
    let Meaning::Clear(found) = read("pour the jar into the blue cup", &[], &nothing) else {
        panic!()
    };
    assert_eq!(found.defaults, ["amount: filled(source)"]);
    let slots: Vec<(&str, &str)> =
        found.slots.iter().map(|(slot, said, _)| (slot.as_str(), said.as_str())).collect();
    assert_eq!(slots, [("source", "jar"), ("target", "blue cup")]);
    assert!(found.template.starts_with("pour "));
}

#[test]
fn two_cups_make_a_question() {
    let Meaning::Ambiguous { question, choices } = read("pour the jar into the cup", &[], &nothing)
    else {
        panic!()
    };
    assert_eq!(question, "which cup: blue cup or red cup?");
    let calls: Vec<&str> = choices.iter().map(|choice| choice.text.as_str()).collect();
    assert_eq!(calls, ["pour(jar, cup)", "pour(jar, cup2)"]);
    // If one of them cannot be done now, the other was meant.
    let full = |call: &Call| (text::call(call) == "pour(jar, cup)").then(|| "cup is full".into());
    let Meaning::Clear(found) = read("pour the jar into the cup", &[], &full) else { panic!() };
    assert_eq!(found.text, "pour(jar, cup2)");
}

fn impossible(sentence: &str) -> (String, String) {
    match read(sentence, &[], &nothing) {
        Meaning::Impossible { why, help } => (why, help.unwrap_or_default()),
        other => panic!("{sentence}: {other:?}"),
    }
}

#[test]
fn an_impossible_wish_says_what_there_is() {
    assert_eq!(
        impossible("pour the jar into the green cup"),
        ("there is no green cup here".into(), "there is: blue cup or red cup".into())
    );
    let (why, help) = impossible("pour the jar into the kettle");
    assert_eq!(why, "there is no kettle here");
    assert_eq!(help, "what fits here: transparent jar, blue cup, red cup");
    let (why, _) = impossible("pour the jar into the block");
    assert_eq!(why, "`target` is a Container, and the block is a Graspable");
    let far = |_: &Call| Some("`reachable(jar)` is false by 31 mm".to_owned());
    let Meaning::Impossible { why, .. } = read("grab the jar", &[], &far) else { panic!() };
    assert_eq!(why, "`reachable(jar)` is false by 31 mm");
}

#[test]
fn an_unknown_sentence_is_answered_with_the_nearest_one() {
    let Meaning::Unknown { help } = read("decant the jar into the cup", &[], &nothing) else {
        panic!()
    };
    assert!(help.starts_with("say it like \"pour "), "{help}");
    // One that shares a thing or a little word only is not like it.
    for said in ["get jar", "dance with the jar"] {
        let Meaning::Unknown { help } = read(said, &[], &nothing) else { panic!("{said}") };
        assert!(help.starts_with("a sentence that is known: \"pick "), "{said}: {help}");
    }
    // What no sentence is for has other means, and other languages than English are none.
    for (said, means) in [
        ("gieße das Wasser in den Becher", "in English, such as \"pick up the transparent jar\""),
        ("again", "the Up key recalls it"),
        ("once more, please", "the Up key recalls it"),
        ("undo", "cannot be undone: say where things are to go, such as \"put the transparent jar"),
        ("undo that", "cannot be undone"),
        ("stop", "Ctrl-C stops the arm"),
        ("all of it", "say into what, such as \"pour all of it into the red cup\""),
        ("move the jar", "say where to, such as \"move the transparent jar to the table\""),
    ] {
        let Meaning::Unknown { help } = read(said, &[], &nothing) else { panic!("{said}") };
        assert!(help.contains(means), "{said}: {help}");
    }
    // Politeness is skipped at the edges and nowhere else.
    let inside = read("pour please from the jar into the red cup", &[], &nothing);
    assert!(matches!(inside, Meaning::Impossible { .. }), "{inside:?}");
    assert!(matches!(read("", &[], &nothing), Meaning::Unknown { .. }));
}

/// "pikc up teh jar" was answered with the sentence that anything is answered with.
#[test]
fn a_misspelt_sentence_is_asked_back_where_it_is_understood_without_its_slips() {
    for (said, meant) in [
        ("Pikc up teh jar!", "pick up the jar"),
        ("purr the jar into teh red cup", "pour the jar into the red cup"),
        ("wher is the jra?", "where is the jar"),
    ] {
        let Meaning::Unknown { help } = read(said, &[], &nothing) else { panic!("{said}") };
        assert_eq!(help, format!("did you mean \"{meant}\"?"));
    }
}

#[test]
fn a_taught_phrase_is_read_before_what_was_there() {
    let taught =
        phrase("\"empty [out] the {o} into {there}\" = pour(o, there, amount: 60 mL)").unwrap();
    let phrases = [taught];
    let Meaning::Clear(found) = read("empty out the jar into the red cup", &phrases, &nothing)
    else {
        panic!()
    };
    assert_eq!(found.text, "pour(jar, cup2, amount: 60 mL)");
    let Meaning::Impossible { why, .. } = read("empty the jar into the block", &phrases, &nothing)
    else {
        panic!()
    };
    assert_eq!(why, "`there` is a Container, and the block is a Graspable");
    for wrong in [
        "empty the {o} = pour(o, cup)",
        "\"empty the {o}\"",
        "\"empty the {o}\" = pour(jar, cup)",
        "\"empty the {o}\" = pour(o, cup",
        "\"empty (the {o}\" = pour(o, cup)",
        "\"empty the {o}\" = check tall(o)",
    ] {
        assert!(phrase(wrong).is_err(), "{wrong}");
    }
}

/// Calls that cannot work and sentences that are never heard were learnt all the same.
#[test]
fn a_phrase_that_could_never_be_used_says_why() {
    let judged = |text: &str| at_the_table(|with| sound(&phrase(text).unwrap(), with));
    for good in [
        "\"empty [out] the {o} into {there}\" = pour(o, there, amount: 60 mL)",
        "\"pour {amount} from {a} to {b}\" = pour(a, b, amount: amount)",
        "\"leave the {o} on the {there}\" = put(o, at: there)",
        "\"dance\" = pick(jar)",
    ] {
        assert_eq!(judged(good), Ok(()), "{good}");
    }
    for (wrong, told) in [
        ("\"wobble the {o}\" = pour(o, cup, speed: 3)", "no parameter of `pour` called `speed`"),
        ("\"wobble the {o}\" = pour(o, 5 cm)", "5 cm"),
        ("\"wobble the {o}\" = pick(o, nothing)", "nothing"),
        ("\"please dance\" = pick(jar)", "is never heard: it is taken for \"dance\""),
        ("\"where is the {o}\" = pick(o)", "is a question already"),
    ] {
        let why = judged(wrong).unwrap_err();
        assert!(why.message.contains(told), "{wrong}: {}", why.message);
        assert!(!why.help.is_empty(), "{wrong}");
    }
}

/// A phrase that turned a sentence of a task around was learnt without a word.
#[test]
fn a_phrase_names_the_sentence_that_it_takes_over() {
    let taken = |text: &str| at_the_table(|with| displaced(&phrase(text).unwrap(), with));
    for text in ["\"pour {a} into {b}\" = pour(b, a)", "\"[quickly] pick up {o}\" = place(o)"] {
        let (said, meant) = taken(text).unwrap_or_else(|| panic!("{text}"));
        let before = read(&said, &[], &nothing);
        let is_that = match before {
            Meaning::Clear(found) => found.text == meant,
            Meaning::Ambiguous { choices, .. } => choices.iter().any(|found| found.text == meant),
            _ => false,
        };
        assert!(is_that, "{said}: {meant}");
    }
    // The first says which cup is meant, the second is new.
    for text in ["\"empty the {o}\" = pour(o, cup)", "\"tip the {o}\" = pour(o, cup)"] {
        assert_eq!(taken(text), None, "{text}");
    }
}

#[test]
fn a_phrase_that_cannot_be_filled_in_leaves_other_sentences_alone() {
    let phrases = [phrase("\"empty the {o}\" = pour(o, cup)").unwrap()];
    let meaning = read("empty the jar into the red cup", &phrases, &nothing);
    let Meaning::Clear(found) = meaning else { panic!("{meaning:?}") };
    assert_eq!(found.text, "pour(jar, cup2)");
}

#[test]
fn single_words_of_a_phrase_are_told() {
    let of = |text: &str| single_words(&phrase(text).unwrap());
    assert_eq!(of("\"dance\" = pick(jar)"), ["dance"]);
    assert_eq!(of("\"(dance|hop) [about]\" = pick(jar)"), ["dance", "hop"]);
    assert!(of("\"dance {o}\" = pick(o)").is_empty());
}

#[test]
fn quantities_are_heard_with_their_units() {
    let taught = phrase("\"pour {amount} from {a} to {b}\" = pour(a, b, amount: amount)").unwrap();
    let phrases = [taught];
    for (said, unit) in
        [("60 ml", "60 mL"), ("60ml", "60 mL"), ("0.1 l", "0.1 L"), ("5 cl", "50 mL")]
    {
        let sentence = format!("pour {said} from the jar to the red cup");
        let Meaning::Clear(found) = read(&sentence, &phrases, &nothing) else { panic!("{said}") };
        assert_eq!(found.text, format!("pour(jar, cup2, amount: {unit})"));
    }
    let sentence = "pour 60 cm from the jar to the red cup";
    assert!(matches!(read(sentence, &phrases, &nothing), Meaning::Impossible { .. }));
}

#[test]
fn words_are_lower_case_and_without_marks() {
    assert_eq!(words("  Hey, robot: please POUR the jar!  Thank you. "), "pour the jar");
    assert_eq!(words("please"), "please");
}

#[test]
fn what_is_held_is_it() {
    let mut library = Library::standard();
    library.add(Source::new("table.task", TABLE));
    let things = things(library.scene("table").unwrap().0);
    let with = Knowledge {
        library: &library,
        things: &things,
        phrases: &[],
        it: Some("cup2"),
        spot: &nowhere,
        hindrance: &nothing,
    };
    let Meaning::Clear(found) = understand("put it down", &with) else { panic!() };
    assert_eq!(found.text, "place(cup2)");
}

/// The help named a jar in a scene that had none.
#[test]
fn a_question_that_is_not_understood_names_what_is_here() {
    let mut library = Library::standard();
    library.add(Source::new(
        "one.task",
        "scene one { mug: Container = cylinder(radius 4 cm, height 9 cm) }",
    ));
    let things = things(library.scene("one").unwrap().0);
    let with = Knowledge {
        library: &library,
        things: &things,
        phrases: &[],
        it: None,
        spot: &nowhere,
        hindrance: &nothing,
    };
    let Meaning::Unknown { help } = understand("why is it so", &with) else { panic!() };
    assert!(help.contains("`visible(mug)`") && !help.contains("jar"), "{help}");
}
