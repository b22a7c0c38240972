//! The hand of the documents that reaches across the table: what is printed there is what happens.

use std::sync::{Arc, Mutex};

use trueup::lab::LabSettings;
use trueup::trace::{Event, Observer};
use trueup::workcell::WorkCell;

use super::{call, options};

/// What was told.
#[derive(Clone, Default)]
struct Notes(Arc<Mutex<Vec<String>>>);

impl Observer for Notes {
    fn event(&mut self, event: &Event) {
        let Event::Note { text, .. } = event else { return };
        self.0.lock().unwrap().push(text.clone());
    }
}

/// Its first corner was in the way of the touch-off, where it rests until it begins: every run ended there.
#[test]
fn the_example_of_something_that_moves_works() {
    let page = include_str!("../../docs/lab.md");
    let block = page.split("```toml\n").find(|block| block.starts_with("[[moving]]")).unwrap();
    let settings = LabSettings::from_toml(block.split("```").next().unwrap()).unwrap();
    assert_eq!(settings.moving.len(), 1);
    let notes = Notes::default();
    let mut cell = WorkCell::open(options(settings, 1)).unwrap();
    let run = cell.run(&call("pour(jar, cup)"), None, Box::new(notes.clone())).unwrap();
    assert!(run.outcome.is_done(), "{:?}", run.reason);
    let notes = notes.0.lock().unwrap();
    assert!(notes.iter().any(|note| note.contains("the arm waits: `hand`")), "{notes:?}");
}
