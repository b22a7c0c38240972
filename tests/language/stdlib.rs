//! The standard library reads and checks clean, and no damage to it costs more than the damaged item.

use trueup::language::ast::Item;
use trueup::language::{Library, Source, Style, parse, render};

/// The texts of the standard library.
pub(super) const TEXTS: [(&str, &str); 4] = [
    ("fluents/std.task", include_str!("../../stdlib/fluents/std.task")),
    ("tasks/std.task", include_str!("../../stdlib/tasks/std.task")),
    ("scenes/kitchen.task", include_str!("../../stdlib/scenes/kitchen.task")),
    ("pour.task", include_str!("../../scripts/pour.task")),
];

#[test]
fn the_standard_library_checks_clean_with_the_pour_script() {
    let mut library = Library::standard();
    library.add(Source::new("pour.task", TEXTS[3].1));
    let found = library.check(&library.scope("kitchen"));
    let told: String = found
        .iter()
        .map(|d| render(d, library.source_named(&d.file).unwrap(), Style::Plain))
        .collect();
    assert!(found.is_empty(), "{told}");
    assert_eq!(library.scope("kitchen").objects["jar"], "Container");
    assert!(library.is_a("Container", "Graspable") && !library.is_a("Surface", "Graspable"));
}

#[test]
fn deleting_any_one_character_costs_at_most_its_item() {
    for (name, text) in TEXTS {
        let whole = parse(text).0.items.len();
        for (at, c) in text.char_indices() {
            let mut damaged = text.to_string();
            damaged.remove(at);
            let (program, diagnostics) = parse(&damaged);
            let good = program.items.iter().filter(|i| !matches!(i, Item::Bad(_))).count();
            assert!(
                good + 1 >= whole,
                "{name}: without the {c:?} at byte {at} only {good} of {whole} items are left"
            );
            let bad = program.items.iter().any(|i| matches!(i, Item::Bad(_)));
            assert!(!bad || !diagnostics.is_empty(), "{name}: byte {at}: a silent loss");
        }
    }
}
