//! Answers in a file that only grows.

use std::fs;

use trueup::teach::answers::{Answer, Answered, TRAINEE, Tally, append, progress, read};
use trueup::trace::{FluentRow, Measure};

use crate::program::Scratch;
use crate::repl::kept::pour;

fn answered(answer: Answer, off: f64, sigma: f64) -> Answered {
    let run = pour("level_side", 0.1, off, sigma);
    let step = &run.steps[1];
    let row: &FluentRow = step.fluents.iter().find(|row| row.name.starts_with("above")).unwrap();
    Answered::new(TRAINEE, "20260101-pour", step, row, answer).unwrap()
}

#[test]
fn an_answer_is_kept_with_what_geometry_said_and_never_as_a_label() {
    let scratch = Scratch::new("teach-answers");
    let path = scratch.path("deep/answers.jsonl");
    assert_eq!(read(&path).unwrap(), (Vec::new(), 0));
    let wrong = answered(Answer::Yes, 0.066, 0.001);
    append(&path, &wrong).unwrap();
    append(&path, &answered(Answer::No, 0.066, 0.001)).unwrap();
    let before = fs::read_to_string(&path).unwrap();
    fs::write(&path, format!("{before}not json\n\n")).unwrap();
    append(&path, &answered(Answer::CannotTell, 0.036, 0.002)).unwrap();
    let (found, unreadable) = read(&path).unwrap();
    assert_eq!((found.len(), unreadable), (3, 1));
    assert_eq!(found[0], wrong);
    assert!(found.iter().all(|answered| answered.by == "person:trainee"));
    assert_eq!(found[0].margin, Some(Measure { value: 0.035 - 0.066, unit: "m".into() }));
    assert_eq!((found[0].geometry, found[0].agrees()), (Answer::No, false));
    assert!(fs::read_to_string(&path).unwrap().starts_with(&before), "it only grows");
}

/// What geometry cannot tell is neither right nor wrong.
#[test]
fn progress_counts_by_person_and_fluent_where_geometry_knows() {
    let mut answers = vec![
        answered(Answer::Yes, 0.066, 0.001),
        answered(Answer::No, 0.066, 0.001),
        answered(Answer::CannotTell, 0.066, 0.001),
        answered(Answer::CannotTell, 0.036, 0.002),
        answered(Answer::Yes, 0.036, 0.002),
    ];
    answers[1].by = "person:other".into();
    let found = progress(&answers);
    let key = |by: &str| (by.to_owned(), "above".to_owned());
    assert_eq!(found.len(), 2);
    assert_eq!(found[&key(TRAINEE)], Tally { right: 0, of: 2, open: 2 });
    assert_eq!(found[&key("person:other")], Tally { right: 1, of: 1, open: 0 });
}

#[test]
fn answers_are_read_as_people_type_them() {
    for (word, answer) in [
        ("y", Answer::Yes),
        (" YES ", Answer::Yes),
        ("n", Answer::No),
        ("u", Answer::CannotTell),
        ("can't tell", Answer::CannotTell),
    ] {
        assert_eq!(Answer::parse(word), Some(answer), "{word}");
    }
    assert_eq!(Answer::parse("maybe"), None);
}
