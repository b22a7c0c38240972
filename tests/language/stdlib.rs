//! The standard library reads and checks clean, and no damage to it costs more than the damaged item.

use trueup::language::ast::Item;
use trueup::language::{Library, Source, Style, parse, render};

/// The texts of the standard library.
pub(super) const TEXTS: [(&str, &str); 6] = [
    ("fluents/std.task", include_str!("../../stdlib/fluents/std.task")),
    ("tasks/std.task", include_str!("../../stdlib/tasks/std.task")),
    ("scenes/kitchen.task", include_str!("../../stdlib/scenes/kitchen.task")),
    ("pour.task", include_str!("../../scripts/pour.task")),
    ("models/tanks.task", include_str!("../../stdlib/models/tanks.task")),
    ("models/emps.task", include_str!("../../stdlib/models/emps.task")),
];

#[test]
fn a_later_file_replaces_by_name_and_knows_where_each_came_from() {
    let mut library = Library::standard();
    assert_eq!(library.default_scene(), "kitchen");
    let (_, source) = library.task("pick").unwrap();
    assert_eq!(source.name, "stdlib/tasks/std.task");
    let mine = "task pick(o: Graspable) { look() }\nscene scratch { }\npick(jar)\n";
    let file = library.add(Source::new("mine.task", mine));
    let (task, source) = library.task("pick").unwrap();
    assert_eq!((task.steps.len(), source.name.as_str()), (1, "mine.task"));
    assert!(library.task("pour").is_some() && library.action("grasp").is_some());
    assert_eq!((library.default_scene(), library.runs(file).count()), ("scratch", 1));
    // The same name again is the same file, edited.
    assert_eq!(library.add(Source::new("mine.task", "look()")), file);
    assert_eq!(library.task("pick").unwrap().1.name, "stdlib/tasks/std.task");
}

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

/// Damage is done to one item between its neighbours: what it could cost beyond them, the cut at their
/// starts keeps away, and a whole file for each of its characters would take a minute.
#[test]
fn deleting_any_one_character_costs_at_most_its_item() {
    for (name, text) in TEXTS {
        let starts = item_starts(text);
        for (i, start) in starts.iter().enumerate() {
            let end = starts.get(i + 1).copied().unwrap_or(text.len());
            let from = if i == 0 { 0 } else { starts[i - 1] };
            let to = starts.get(i + 2).copied().unwrap_or(text.len());
            let window = &text[from..to];
            let whole = parse(window).0.items.len();
            for (at, c) in text[*start..end].char_indices() {
                let mut damaged = window.to_string();
                damaged.remove(start - from + at);
                let (program, diagnostics) = parse(&damaged);
                let good = program.items.iter().filter(|i| !matches!(i, Item::Bad(_))).count();
                assert!(
                    good + 1 >= whole,
                    "{name}: without the {c:?} at byte {} only {good} of {whole} items are left",
                    start + at
                );
                let bad = program.items.iter().any(|i| matches!(i, Item::Bad(_)));
                assert!(!bad || !diagnostics.is_empty(), "{name}: byte {at}: a silent loss");
            }
        }
    }
}

/// Where the items of a text start, with the documentation before them.
fn item_starts(text: &str) -> Vec<usize> {
    let mut starts = vec![0];
    let mut at = 0;
    let mut documented = false;
    for line in text.split_inclusive('\n') {
        let word = line.split(' ').next().unwrap();
        let item = ["task", "action", "fluent", "type", "scene", "model"].contains(&word);
        if !documented && (item || line.starts_with("///")) {
            starts.push(at);
        }
        documented = line.starts_with("///");
        at += line.len();
    }
    starts.dedup();
    starts
}
