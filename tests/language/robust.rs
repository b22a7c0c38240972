//! Texts nobody means: damaged, random, monstrous. A tree comes back, the mistake is told, nothing panics.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::language::ast::Item;
use trueup::language::sentence::{Template, words};
use trueup::language::{Library, Source, format, is_incomplete, parse};

/// Pieces that random texts are made of: every word of the language and some that are none.
fn pieces() -> Vec<String> {
    let grammar = include_str!("../../grammar/task.pest");
    let mut pieces: Vec<String> = grammar
        .split('"')
        .skip(1)
        .step_by(2)
        .filter(|piece| !piece.is_empty() && !piece.contains('\\'))
        .map(str::to_owned)
        .collect();
    let more = [
        "jar",
        "o",
        "(",
        ")",
        "{",
        "}",
        "\"a {o}\"",
        "12 cm",
        "0.5",
        "\n",
        "é",
        "// n\n",
        "/// d\n",
    ];
    pieces.extend(more.map(str::to_owned));
    pieces
}

/// One text drawn from `rng`: pieces, a damaged file, or any characters.
fn draw(rng: &mut StdRng, pieces: &[String], files: &[&str]) -> String {
    match rng.random_range(0..3) {
        0 => {
            let n = rng.random_range(0..40);
            let all = (0..n).map(|_| pieces[rng.random_range(0..pieces.len())].as_str());
            all.collect::<Vec<_>>().join(if rng.random_bool(0.8) { " " } else { "" })
        }
        1 => {
            let file: Vec<char> = files[rng.random_range(0..files.len())].chars().collect();
            let from = rng.random_range(0..file.len());
            let to = (from + rng.random_range(0..400)).min(file.len());
            let mut slice: Vec<char> = file[from..to].to_vec();
            for _ in 0..rng.random_range(0..4) {
                if !slice.is_empty() {
                    let at = rng.random_range(0..slice.len());
                    slice[at] = ['{', '}', '(', '"', 'x', '\n', '#'][rng.random_range(0..7)];
                }
            }
            slice.into_iter().collect()
        }
        _ => (0..rng.random_range(0..60)).map(|_| rng.random::<char>()).collect(),
    }
}

/// Everything that is done with a text before a person sees an answer.
fn survives(text: &str) {
    let (program, found) = parse(text);
    let is_bad = program.items.iter().any(|item| matches!(item, Item::Bad(_)));
    assert!(!is_bad || !found.is_empty(), "a silent loss: {text:?}");
    assert!(found.iter().all(|d| d.span.to <= text.len() && text.is_char_boundary(d.span.from)));
    is_incomplete(text);
    let _ = Template::read(text).map(|template| template.fit(&words(text)));
    let laid_out = format(text);
    assert_eq!(format(&laid_out), laid_out, "{text:?}");
}

fn many(count: u64, seed: u64) {
    let (pieces, files) = (pieces(), super::stdlib::TEXTS.map(|(_, text)| text));
    let mut rng = StdRng::seed_from_u64(seed);
    for _ in 0..count {
        survives(&draw(&mut rng, &pieces, &files));
    }
}

#[test]
fn random_texts_are_survived() {
    many(1_500, 1);
}

/// Run by hand: `cargo test --release --test main a_million -- --ignored`.
#[test]
#[ignore = "takes minutes"]
fn a_million_random_texts_are_survived() {
    many(1_000_000, 2);
}

/// The check goes further than the parser: it follows names.
#[test]
fn random_texts_are_checked_without_a_panic() {
    let (pieces, files) = (pieces(), super::stdlib::TEXTS.map(|(_, text)| text));
    let mut rng = StdRng::seed_from_u64(3);
    let standard = Library::standard();
    for _ in 0..150 {
        let text = draw(&mut rng, &pieces, &files);
        let mut library = standard.clone();
        let file = library.add(Source::new("random.task", text));
        library.check_file(file, &library.scope("kitchen"));
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
