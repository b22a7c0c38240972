//! Reading a text with everything it imports.

use std::fmt::Display;
use std::path::Path;
use std::sync::Arc;

use super::super::ast::{Import, Item};
use super::super::diagnostic::{Diagnostic, Source};
use super::super::parse;
use super::Library;

/// Files that one text may import, those that its imports import among them; each leads to the next by recursion.
const MOST_IMPORTS: usize = 100;
/// What a file of definitions ends with.
const TASK: &str = "task";
/// What a script ends with.
const SCRIPT: &str = "rhai";

impl Library {
    /// As [`Self::add`], with everything it imports, read first by `read`: a `.task` file gives its
    /// definitions, a `.rhai` file is a script that actions run by its name, and no other file is read.
    ///
    /// A path is looked for beside the file that imports it. What cannot be read is told by
    /// [`Self::check`] where it is imported.
    pub fn add_with<E: Display>(
        &mut self,
        source: Source,
        read: &dyn Fn(&str) -> Result<String, E>,
    ) -> usize {
        let mut open = vec![source.name.clone()];
        self.add_imports(source, read, &mut open)
    }

    /// Returns the file that a text imports, itself or through others, whose scene has an object of that name.
    pub fn imported_scene_with(&self, importer: &str, object: &str) -> Option<&str> {
        let mut open = vec![importer.to_owned()];
        let mut next = 0;
        while let Some(name) = open.get(next).cloned() {
            next += 1;
            let Some(file) = self.files.iter().find(|file| file.source.name == name) else {
                continue;
            };
            for item in &file.program.items {
                match item {
                    Item::Import(import) => {
                        let path = beside(&name, &import.path.text);
                        if !open.contains(&path) {
                            open.push(path);
                        }
                    }
                    Item::Scene(scene)
                        if name != importer
                            && scene.things.iter().any(|thing| thing.name.text == object) =>
                    {
                        return Some(&file.source.name);
                    }
                    _ => {}
                }
            }
        }
        None
    }

    fn add_imports<E: Display>(
        &mut self,
        source: Source,
        read: &dyn Fn(&str) -> Result<String, E>,
        open: &mut Vec<String>,
    ) -> usize {
        let mut wrong = Vec::new();
        for import in imports(&source.text) {
            let path = beside(&source.name, &import.path.text);
            let Some(ending) = ending(&path) else {
                let is_there = |near: &String| read(&beside(&source.name, near)).is_ok();
                let near = with_endings(&import.path.text).into_iter().find(is_there);
                wrong.push(no_import(&import, near.as_deref()));
                continue;
            };
            // Two files that import each other are read once each.
            if open.contains(&path) {
                continue;
            }
            if open.len() > MOST_IMPORTS {
                wrong.push(one_import_more(&import));
                break;
            }
            open.push(path.clone());
            match read(&path) {
                Ok(text) if ending == TASK => {
                    let imported = self.add_imports(Source::new(path.clone(), text), read, open);
                    if self.files[imported].diagnostics.iter().any(Diagnostic::is_error) {
                        wrong.push(broken_import(&import, &path));
                    }
                }
                Ok(text) => {
                    let name = path.rsplit('/').next().unwrap_or(&path).to_owned();
                    self.scripts.insert(name, text);
                }
                Err(why) => wrong.push(missing_import(&import, &path, &why)),
            }
        }
        let name = source.name.clone();
        let at = self.add(source);
        for mut diagnostic in wrong {
            diagnostic.file.clone_from(&name);
            Arc::make_mut(&mut self.files[at]).diagnostics.push(diagnostic);
        }
        at
    }
}

/// Returns the imports of a text.
fn imports(text: &str) -> Vec<Import> {
    // Most files import nothing, and need not be read twice for that.
    if !text.contains("import") {
        return Vec::new();
    }
    let items = parse(text).0.items.into_iter();
    let imports = items.filter_map(|item| match item {
        Item::Import(import) => Some(import),
        _ => None,
    });
    imports.collect()
}

/// Returns the path of an import as seen from where the importing file is seen from.
fn beside(importer: &str, path: &str) -> String {
    if path.starts_with('/') {
        return path.to_owned();
    }
    let folder = importer.rsplit_once('/').map(|(folder, _)| folder);
    let mut parts: Vec<&str> = folder.map(|f| f.split('/').collect()).unwrap_or_default();
    for part in path.split('/') {
        match part {
            "." | "" => {}
            ".." if parts.last().is_some_and(|last| !matches!(*last, "" | "..")) => {
                parts.pop();
            }
            part => parts.push(part),
        }
    }
    parts.join("/")
}

/// Returns what a file that may be imported ends with: [`TASK`] or [`SCRIPT`].
fn ending(path: &str) -> Option<&'static str> {
    let extension = Path::new(path).extension()?;
    [TASK, SCRIPT].into_iter().find(|known| extension == *known)
}

/// Returns a path with the endings of what may be imported instead of its own.
fn with_endings(path: &str) -> [String; 2] {
    let name = path.rfind('/').map_or(0, |slash| slash + 1);
    let dot = path[name..].rfind('.').filter(|dot| *dot > 0);
    let stem = dot.map_or(path, |dot| &path[..name + dot]);
    [TASK, SCRIPT].map(|ending| format!("{stem}.{ending}"))
}

/// A file that is neither definitions nor a script; `near` is one beside it that may be meant.
fn no_import(import: &Import, near: Option<&str>) -> Diagnostic {
    let path = &import.path.text;
    let found = Diagnostic::error(
        "task::import",
        import.path.span,
        format!("`{path}` is neither a `.{TASK}` file nor a `.{SCRIPT}` script"),
        "imported here",
    );
    match near {
        Some(near) => found
            .help(format!("did you mean `{near}`?"))
            .fix(import.path.span, format!("\"{near}\"")),
        None => found.help(format!(
            "import definitions from a `.{TASK}` file, or a script of actions from a `.{SCRIPT}` file"
        )),
    }
}

fn missing_import(import: &Import, path: &str, why: &dyn Display) -> Diagnostic {
    Diagnostic::error(
        "task::import",
        import.path.span,
        format!("cannot read `{path}`: {why}"),
        "imported here",
    )
    .help("a path is looked for beside the file that imports it")
}

fn one_import_more(import: &Import) -> Diagnostic {
    Diagnostic::error(
        "task::import",
        import.path.span,
        format!("more than {MOST_IMPORTS} files are imported"),
        "one too many",
    )
    .help("put what belongs together into one file")
}

fn broken_import(import: &Import, path: &str) -> Diagnostic {
    Diagnostic::error(
        "task::import",
        import.path.span,
        format!("`{path}` has mistakes"),
        "imported here",
    )
    .help(format!("`trueup check {path}` tells them"))
}
