//! `:quiz` through the binary: pictures of kept runs, answers, and how often they were geometry's.

use super::kept;
use crate::program::Scratch;

#[test]
fn a_quiz_asks_shows_the_margin_and_counts() {
    let scratch = Scratch::new("repl-quiz");
    kept::lay_out(&scratch);
    let said = scratch.typed(&[], ":quiz\n");
    assert!(said.out.contains("no run that is kept has a question"), "{}", said.out);
    // The first run has pictures after both of its steps.
    let run = "runs/20260101-090000-pour";
    scratch.file(&format!("{run}/frames/01-after-real.png"), "a picture");
    scratch.file(&format!("{run}/frames/02-after-real.png"), "a picture");
    let said = scratch
        .typed(&[], ":quiz above\nmaybe\n?\nn\n\n:quiz jump\n:quiz above\nhelp\nq\n:tasks\n");
    assert_eq!(said.code, 1, "{}", said.out);
    for part in [
        "frames/02-after-real.png",
        "`maybe` is no answer",
        "above(jar, cup): you said no, geometry says",
        "correct so far: above",
        "has a question about `jump`",
        "pour(",
    ] {
        assert!(said.out.contains(part), "{part} is missing: {}", said.out);
    }
    let kept = std::fs::read_to_string(scratch.path("runs/answers.jsonl")).unwrap();
    assert_eq!(kept.lines().count(), 1, "{kept}");
    assert!(kept.contains("\"person:trainee\"") && kept.contains("\"no\""), "{kept}");
}
