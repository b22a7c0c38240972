//! One table of words for scripts: the engine binds what it lists, and the document shows what it lists.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use trueup::language::script_words::{WORDS, describe, table};

/// Where the list stands in `docs/language.md`.
const BEGIN: &str = "<!-- words of scripts, from src/language/script_words.rs -->\n";
const END: &str = "<!-- end of the words -->\n";

fn read(path: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

/// `TRUEUP_DOCS=write cargo test script_words` writes the list anew.
#[test]
fn the_document_lists_every_word() {
    let text = read("docs/language.md");
    let (before, rest) = text.split_once(BEGIN).expect("the list has a beginning");
    let (listed, after) = rest.split_once(END).expect("the list has an end");
    if std::env::var("TRUEUP_DOCS").is_ok_and(|value| value == "write") {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/language.md");
        fs::write(path, format!("{before}{BEGIN}{}{END}{after}", table())).unwrap();
        return;
    }
    assert!(listed == table(), "write it anew: TRUEUP_DOCS=write cargo test script_words");
}

/// The names that a text registers with the engine.
fn bound(text: &str) -> BTreeSet<String> {
    let names = |call: &'static str| {
        text.split(call).skip(1).filter_map(|rest| {
            let name = rest.trim_start().strip_prefix('"')?;
            Some(name.split_once('"')?.0.to_owned())
        })
    };
    names("register_fn(").chain(names("register_get(")).collect()
}

#[test]
fn the_engine_binds_what_is_listed_and_nothing_else() {
    let bound = bound(&read("src/execution/words.rs"));
    let listed: BTreeSet<String> = WORDS.iter().map(|word| word.name.to_owned()).collect();
    let unlisted: Vec<_> = bound.difference(&listed).collect();
    let unbound: Vec<_> = listed.difference(&bound).collect();
    assert!(
        unlisted.is_empty() && unbound.is_empty(),
        "unlisted {unlisted:?}, unbound {unbound:?}"
    );
    let written: BTreeSet<_> =
        WORDS.iter().map(trueup::language::script_words::ScriptWord::full_name).collect();
    assert_eq!(written.len(), WORDS.len(), "a word is listed twice");
}

#[test]
fn a_word_is_described_by_its_name_or_by_what_it_is_of() {
    let close = describe("arm.close").unwrap();
    assert!(close.starts_with("arm.close(o, force)\n"), "{close}");
    assert_eq!(describe("close"), Some(close));
    assert!(describe("camera").unwrap().contains("camera.look()"));
    assert_eq!(describe("arm.pour"), None);
    assert_eq!(describe(""), None);
}
