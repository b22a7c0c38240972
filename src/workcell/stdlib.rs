//! The stdlib: embedded in the program, file by file overridden by a folder of the user's.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use include_dir::{Dir, DirEntry, include_dir};

use crate::execution::walk::Texts;

static EMBEDDED: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/stdlib");

/// Every text of the stdlib by its path in it: `tasks/std.task`, `actions/grasp.rhai`.
#[derive(Debug, Clone, Default)]
pub struct Stdlib {
    files: BTreeMap<String, String>,
}

impl Stdlib {
    /// Returns what is embedded in the program.
    pub fn embedded() -> Self {
        let mut files = BTreeMap::new();
        collect(&EMBEDDED, &mut files);
        Self { files }
    }

    /// Lays the files of a folder of the same shape over this one.
    ///
    /// # Errors
    ///
    /// The path that cannot be read, and why.
    pub fn with_folder(mut self, folder: &Path) -> Result<Self, (PathBuf, std::io::Error)> {
        let mut open = vec![folder.to_path_buf()];
        while let Some(dir) = open.pop() {
            let entries = fs::read_dir(&dir).map_err(|error| (dir.clone(), error))?;
            for entry in entries.flatten() {
                let path = entry.path();
                if path.is_dir() {
                    open.push(path);
                } else if path.extension().is_some_and(|e| e == "task" || e == "rhai") {
                    let text = fs::read_to_string(&path).map_err(|error| (path.clone(), error))?;
                    let name = path.strip_prefix(folder).unwrap_or(&path);
                    self.files.insert(name.to_string_lossy().replace('\\', "/"), text);
                }
            }
        }
        Ok(self)
    }

    /// Returns the `.task` files, path and text, in the order they build on each other.
    pub fn tasks(&self) -> impl Iterator<Item = (&str, &str)> {
        let of = |folder: &'static str| {
            self.files
                .iter()
                .filter(move |(path, _)| path.starts_with(folder) && is_task(path))
                .map(|(path, text)| (path.as_str(), text.as_str()))
        };
        of("fluents/").chain(of("tasks/")).chain(of("scenes/"))
    }

    /// Returns one file.
    pub fn file(&self, path: &str) -> Option<&str> {
        self.files.get(path).map(String::as_str)
    }
}

impl Texts for Stdlib {
    fn script(&self, name: &str) -> Option<&str> {
        self.file(&format!("actions/{name}"))
    }
}

fn is_task(path: &str) -> bool {
    Path::new(path).extension().is_some_and(|extension| extension == "task")
}

fn collect(dir: &Dir<'_>, files: &mut BTreeMap<String, String>) {
    for entry in dir.entries() {
        match entry {
            DirEntry::Dir(dir) => collect(dir, files),
            DirEntry::File(file) => {
                if let Some(text) = file.contents_utf8() {
                    files.insert(file.path().to_string_lossy().replace('\\', "/"), text.to_owned());
                }
            }
        }
    }
}
