//! Texts nobody means: damaged, random, monstrous. A tree comes back, the mistake is told, nothing panics.

#[path = "../../examples/fuzz_parse/texts.rs"]
mod texts;

use rand::SeedableRng;
use rand::rngs::StdRng;
use trueup::language::{Library, parse};

/// The same texts by the million: `cargo run --release --example fuzz_parse -- 1000000`.
#[test]
fn random_texts_are_read_checked_and_laid_out() {
    let (pieces, standard) = (texts::pieces(), Library::standard());
    let mut rng = StdRng::seed_from_u64(1);
    for _ in 0..1_500 {
        texts::survives(&texts::draw(&mut rng, &pieces), &standard);
    }
}

/// A text that leads a backtracking parser astray is given up with a message, not pursued.
#[test]
fn a_text_that_would_take_for_ever_is_refused() {
    for text in [
        format!("model m {{ x' = {} }}", "2 ^ ( 3 ".repeat(60)),
        format!("f({})", "a: ".repeat(5_000)),
        "either a { } or ".repeat(3_000),
        "#[was(\"a\")] ".repeat(3_000),
        "pick(jar) via a, ".repeat(3_000),
    ] {
        let (_, found) = parse(&text);
        assert!(!found.is_empty(), "{text:.60}");
    }
}

#[test]
fn every_prefix_of_the_library_is_read() {
    for (name, text) in super::stdlib::TEXTS {
        for (end, _) in text.char_indices().step_by(7) {
            let (program, _) = parse(&text[..end]);
            assert!(program.items.len() < 80, "{name}");
        }
    }
}
