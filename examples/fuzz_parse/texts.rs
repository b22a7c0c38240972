//! Texts nobody means, and everything that is done with a text before a person sees an answer.
//!
//! Shared by the example, which takes as many as asked for, and by `tests/language/robust.rs`, which takes a
//! few at every run.

use rand::RngExt;
use rand::rngs::StdRng;
use trueup::language::ast::Item;
use trueup::language::sentence::{Reach, Template, words};
use trueup::language::{Library, Source, format, is_incomplete, parse};

/// The texts of the standard library, which are damaged.
pub(super) const FILES: [&str; 3] = [
    include_str!("../../stdlib/fluents/std.task"),
    include_str!("../../stdlib/tasks/std.task"),
    include_str!("../../stdlib/scenes/kitchen.task"),
];

/// Pieces that random texts are made of: every word of the language and some that are none.
pub(super) fn pieces() -> Vec<String> {
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
pub(super) fn draw(rng: &mut StdRng, pieces: &[String]) -> String {
    match rng.random_range(0..3) {
        0 => {
            let n = rng.random_range(0..40);
            let all = (0..n).map(|_| pieces[rng.random_range(0..pieces.len())].as_str());
            all.collect::<Vec<_>>().join(if rng.random_bool(0.8) { " " } else { "" })
        }
        1 => {
            let file: Vec<char> = FILES[rng.random_range(0..FILES.len())].chars().collect();
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

/// Reads a text, lays it out, checks it against the library, fits it to nothing; panics on what must not be.
pub(super) fn survives(text: &str, standard: &Library) {
    let (program, found) = parse(text);
    let is_bad = program.items.iter().any(|item| matches!(item, Item::Bad(_)));
    assert!(!is_bad || !found.is_empty(), "a silent loss: {text:?}");
    assert!(found.iter().all(|d| d.span.to <= text.len() && text.is_char_boundary(d.span.from)));
    is_incomplete(text);
    let _ = Template::read(text).map(|template| template.fit(&words(text), Reach::Long));
    let laid_out = format(text);
    assert_eq!(format(&laid_out), laid_out, "{text:?}");
    let mut library = standard.clone();
    let file = library.add(Source::new("random.task", text));
    let wrong = library.check_file(file, &library.scope("kitchen"));
    assert!(wrong.iter().all(|d| d.span.to <= text.len() && text.is_char_boundary(d.span.from)));
}
