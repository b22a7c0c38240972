//! Inside a room no more than four files may depend on each other in a circle: such files are one thought, and
//! more than four are none.
//!
//! What a file depends on is read off its paths (`use` and in the code), followed through the re-exports of
//! `mod.rs` to the file that defines the item.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use super::layers::rust_files;

/// Files that may depend on each other in a circle.
const MOST: usize = 4;

type Module = Vec<String>;

/// Every file of the program by its module path, and the paths in it.
struct Sources {
    modules: BTreeMap<Module, Paths>,
}

/// The paths of one file.
struct Paths {
    /// Those of its `use` statements, whole.
    uses: Vec<Module>,
    /// Those in its code.
    code: Vec<Module>,
    /// Whether items are only passed on by a `use`.
    passed_on: BTreeSet<Module>,
}

#[test]
fn no_circle_inside_a_room_is_larger_than_four_files() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut modules = BTreeMap::new();
    for path in rust_files(&src) {
        let inside = path.strip_prefix(&src).unwrap().with_extension("");
        let mut module: Module =
            inside.iter().map(|part| part.to_str().unwrap().to_owned()).collect();
        if module.last().is_some_and(|last| last == "mod") {
            module.pop();
        }
        let text = fs::read_to_string(&path).unwrap();
        let text = text.split("#[cfg(test)]\nmod tests").next().unwrap();
        modules.insert(module, paths(text));
    }
    let sources = Sources { modules };
    let edges: BTreeMap<&Module, BTreeSet<Module>> =
        sources.modules.keys().map(|module| (module, sources.needs(module))).collect();
    let mut wrong = Vec::new();
    let mut told: BTreeSet<&Module> = BTreeSet::new();
    for module in sources.modules.keys() {
        if told.contains(module) {
            continue;
        }
        let circle: Vec<&Module> = reached(module, &edges)
            .into_iter()
            .filter(|other| reached(other, &edges).contains(module))
            .collect();
        told.extend(&circle);
        if circle.len() > MOST {
            let names: Vec<String> = circle.iter().map(|module| module.join("/")).collect();
            wrong.push(names.join(", "));
        }
    }
    assert!(wrong.is_empty(), "circles of more than {MOST} files:\n{}", wrong.join("\n"));
}

/// Returns what can be reached from a file inside its room.
fn reached<'a>(
    from: &Module,
    edges: &'a BTreeMap<&'a Module, BTreeSet<Module>>,
) -> BTreeSet<&'a Module> {
    let mut found = BTreeSet::new();
    let mut open = vec![from];
    while let Some(next) = open.pop() {
        for other in edges[next].iter().filter(|other| other[0] == from[0]) {
            if found.insert(other) {
                open.push(other);
            }
        }
    }
    found
}

/// Reads the paths off a file.
fn paths(text: &str) -> Paths {
    let code: String = text
        .lines()
        .map(|line| without_visibility(line.split("//").next().unwrap_or_default()))
        .collect::<Vec<_>>()
        .join("\n");
    let mut found = Paths { uses: Vec::new(), code: Vec::new(), passed_on: BTreeSet::new() };
    let mut rest = String::new();
    for statement in code.split_inclusive(';') {
        let at = statement.rfind("use ").filter(|at| {
            let before = statement[..*at].rsplit('\n').next().unwrap_or_default().trim();
            before.is_empty() || before.starts_with("pub")
        });
        let Some(at) = at else {
            rest += statement;
            continue;
        };
        rest += &statement[..at];
        let is_public = statement[..at].trim_end().ends_with(['b', ')']);
        for path in expanded(statement[at + 4..].trim_end_matches(';')) {
            if is_public {
                found.passed_on.insert(path.clone());
            }
            found.uses.push(path);
        }
    }
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    for word in rest.split(|c: char| !is_part(c)) {
        let parts: Module = word.split("::").map(str::to_owned).collect();
        if parts.len() > 1 && parts.iter().all(|part| !part.is_empty()) {
            found.code.push(parts);
        }
    }
    found
}

/// Takes `(in super::…)` out of a line: it names a room, and needs nothing of it.
fn without_visibility(line: &str) -> String {
    match line
        .split_once("pub(in ")
        .and_then(|(before, rest)| Some((before, rest.split_once(')')?.1)))
    {
        Some((before, after)) => format!("{before}pub{}", without_visibility(after)),
        None => line.to_owned(),
    }
}

/// Writes the braces of a `use` out: `a::{b, c::d}` is `a::b` and `a::c::d`.
fn expanded(path: &str) -> Vec<Module> {
    let path = path.split(" as ").next().unwrap_or_default().trim();
    let Some((head, inner)) = path.split_once('{') else {
        return vec![path.split("::").map(|part| part.trim().to_owned()).collect()];
    };
    let inner = inner.trim_end().trim_end_matches('}');
    let head: Module =
        head.split("::").map(|part| part.trim().to_owned()).filter(|p| !p.is_empty()).collect();
    let (mut parts, mut depth, mut from) = (Vec::new(), 0, 0);
    for (at, c) in inner.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&inner[from..at]);
                from = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&inner[from..]);
    let parts = parts.into_iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(expanded).map(|tail| head.iter().cloned().chain(tail).collect()).collect()
}

impl Sources {
    /// Returns the files that a file needs.
    fn needs(&self, module: &Module) -> BTreeSet<Module> {
        let own = &self.modules[module];
        let uses = own.uses.iter().filter(|path| !own.passed_on.contains(*path));
        let all = uses.chain(&own.code).filter_map(|path| self.file(module, path, 0));
        all.filter(|other| other != module).collect()
    }

    /// Returns the file that defines what a path in `module` means.
    fn file(&self, module: &Module, path: &Module, depth: usize) -> Option<Module> {
        let mut whole = module.clone();
        let mut parts = path.as_slice();
        match parts[0].as_str() {
            "crate" => {
                whole.clear();
                parts = &parts[1..];
            }
            "self" => parts = &parts[1..],
            "super" => {
                while parts.first().is_some_and(|part| part == "super") {
                    whole.pop();
                    parts = &parts[1..];
                }
            }
            child => {
                whole.push(child.to_owned());
                if !self.modules.contains_key(&whole) {
                    return None;
                }
                whole.pop();
            }
        }
        whole.extend_from_slice(parts);
        let n = (1..=whole.len()).rev().find(|n| self.modules.contains_key(&whole[..*n]))?;
        let (found, rest) = whole.split_at(n);
        let found = found.to_vec();
        // What a file only imports is defined elsewhere.
        let imported = rest.first().and_then(|item| {
            let uses = self.modules[&found].uses.iter();
            uses.into_iter().find(|path| path.last() == Some(item) && path.len() > 1)
        });
        match imported.filter(|_| depth < 6) {
            Some(path) => self.file(&found, path, depth + 1).or(Some(found)),
            None => Some(found),
        }
    }
}
