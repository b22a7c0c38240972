//! Every code has an explanation, and every explanation is true.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::Path;

use trueup::graph;
use trueup::language::ast::{Item, Step};
use trueup::language::codes::{Explanation, explain, explanations};
use trueup::language::{Diagnostic, Library, Source, parse_line};
use trueup::workcell::check::{check_file, scope_of};
use trueup::workcell::{Stdlib, library};

use crate::program::Scratch;

/// Codes that no text can raise: something else is wrong first, or the program itself would have to be.
const BEYOND_TEXTS: &[&str] = &[
    "task::formula",
    "task::more",
    "graph::empty",
    "graph::file",
    "graph::no_branch",
    "graph::repeat",
    "graph::text",
];

/// A reader that knows one file.
fn cups(path: &str) -> io::Result<String> {
    match path {
        "cups.task" => Ok("type Cup: Container\n".into()),
        _ => Err(io::Error::other("there is no such file")),
    }
}

/// Returns the codes that an example raises.
fn raised(code: &str, text: &str) -> BTreeSet<&'static str> {
    let stdlib = Stdlib::embedded().reading(cups);
    let mut library: Library = library(&stdlib);
    let source = Source::new("example.task", text);
    let file = library.add_with(source.clone(), &|path| stdlib.read(path));
    if code.starts_with("graph::") {
        let runs: Vec<Step> = library.runs(file).cloned().collect();
        let call = library.define(&source, &runs);
        return match graph::build(&library, &call) {
            Ok(_) => BTreeSet::new(),
            Err(problems) => problems.iter().map(|problem| problem.code).collect(),
        };
    }
    // Text without anything to run is told by whoever was to run it.
    if code == "task::empty" {
        let (step, found) = parse_line(text);
        assert_eq!(found, []);
        return if step.is_none() { BTreeSet::from(["task::empty"]) } else { BTreeSet::new() };
    }
    let scope = scope_of(&library, file);
    let found: Vec<Diagnostic> = check_file(&library, &stdlib, file, &scope);
    found.iter().map(|diagnostic| diagnostic.code).collect()
}

#[test]
fn each_wrong_example_raises_its_code_alone_and_each_right_one_nothing() {
    for Explanation { code, meaning, wrong, right } in explanations() {
        assert!(meaning.ends_with(['.', '`']) && meaning.len() > 20, "{code}: {meaning}");
        let of_text = code.starts_with("task::") || code.starts_with("graph::");
        if !of_text || BEYOND_TEXTS.contains(&code) {
            assert_eq!((wrong, right), (None, None), "{code}");
            continue;
        }
        let (wrong, right) = (wrong.expect(code), right.expect(code));
        assert_eq!(raised(code, wrong), BTreeSet::from([code]), "{code}: {wrong}");
        assert_eq!(raised(code, right), BTreeSet::new(), "{code}: {right}");
    }
}

#[test]
fn every_code_in_the_program_is_explained_and_no_other() {
    let mut raised = BTreeSet::new();
    let mut open = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("src")];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            raised.extend(codes_in(&fs::read_to_string(&path).unwrap()));
        }
    }
    let explained: BTreeSet<String> = explanations().map(|e| e.code.to_owned()).collect();
    assert_eq!(explanations().count(), explained.len(), "a code is explained twice");
    let missing: Vec<_> = raised.difference(&explained).collect();
    assert!(missing.is_empty(), "docs/errors.md says nothing of {missing:?}");
    let idle: Vec<_> = explained.difference(&raised).collect();
    assert!(idle.is_empty(), "docs/errors.md explains what nothing raises: {idle:?}");
}

/// The texts in quotes that look like `layer::word`.
fn codes_in(text: &str) -> impl Iterator<Item = String> + '_ {
    let is_word = |s: &str| !s.is_empty() && s.chars().all(|c| c.is_ascii_lowercase() || c == '_');
    text.split('"').skip(1).step_by(1).filter_map(move |quoted| {
        let (layer, word) = quoted.split_once("::")?;
        (is_word(layer) && is_word(word)).then(|| quoted.to_owned())
    })
}

#[test]
fn a_short_code_is_enough_and_an_unknown_one_is_answered() {
    assert_eq!(explain("unit"), explain("task::unit"));
    let scratch = Scratch::new("cli-explain");
    let said = scratch.trueup(&["explain", "task::tolerance"]);
    assert_eq!(said.code, 0);
    for part in ["task::tolerance", "never exactly equal", "wrong\n", "right\n", "within 10 mL"] {
        assert!(said.out.contains(part), "{part}: {}", said.out);
    }
    let json = scratch.trueup(&["explain", "unit", "--json"]).json();
    assert_eq!(json["code"], "task::unit");
    assert_eq!(json["right"], "lift(jar, by: 12 cm)\n");
    let said = scratch.trueup(&["explain", "task::unti", "--json"]);
    assert_eq!((said.code, said.error("help")), (2, "did you mean `task::unit`?".to_owned()));
    let listed = scratch.trueup(&["explain"]);
    assert_eq!(listed.out.lines().count(), explanations().count());
}

/// What the parser alone raises is covered by the whole check; here the two are held together.
#[test]
fn a_definition_at_the_prompt_is_no_step() {
    let (step, found) = parse_line("type A");
    assert!(step.is_none());
    assert!(explain(found[0].code).is_some());
    let items = trueup::language::parse("look()").0.items;
    assert!(matches!(items.as_slice(), [Item::Run(_)]));
}
