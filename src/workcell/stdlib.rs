//! The stdlib: embedded in the program, file by file overridden by a folder of the user's.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use include_dir::{Dir, DirEntry, include_dir};

use crate::execution::walk::Texts;
use crate::files::read;
use crate::motion;
use crate::motion::mesh;
use crate::motion::robot::Robot;

/// Why a scene's robot is none.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RobotError {
    /// No folder of that name.
    #[error("there is no robot `{name}`; the stdlib has {}", .known.join(", "))]
    None {
        /// What was asked for.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// A file in it is wrong.
    #[error("{path}: {error}")]
    Text {
        /// Its path in the stdlib.
        path: String,
        /// What is wrong with it.
        error: motion::Error,
    },
}

static EMBEDDED: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/stdlib");

/// Extensions of what a stdlib folder holds.
const TEXTS: [&str; 4] = ["task", "rhai", "urdf", "toml"];

/// Every text of the stdlib by its path in it: `tasks/std.task`, `actions/grasp.rhai`.
#[derive(Debug, Clone)]
pub struct Stdlib {
    files: BTreeMap<String, String>,
    /// The folder on the disk that a URDF of this path lies in, for its meshes.
    beside: BTreeMap<String, PathBuf>,
    /// The folder that was laid over what is embedded.
    folder: Option<PathBuf>,
    read: fn(&str) -> io::Result<String>,
}

/// Why nothing is read that a program imports.
#[derive(Debug, thiserror::Error)]
#[error("no files are read here")]
struct NoFiles;

impl Default for Stdlib {
    fn default() -> Self {
        Self {
            files: BTreeMap::new(),
            beside: BTreeMap::new(),
            folder: None,
            read: |_| Err(io::Error::new(io::ErrorKind::Unsupported, NoFiles)),
        }
    }
}

impl Stdlib {
    /// Returns what is embedded in the program.
    pub fn embedded() -> Self {
        let mut files = BTreeMap::new();
        collect(&EMBEDDED, &mut files);
        Self { files, ..Self::default() }
    }

    /// Lets what a program imports be read by `read`, path → text or why not.
    #[must_use]
    pub fn reading(mut self, read: fn(&str) -> io::Result<String>) -> Self {
        self.read = read;
        self
    }

    /// Reads a file that a program imports.
    ///
    /// # Errors
    ///
    /// Why it cannot be read.
    pub fn read(&self, path: &str) -> io::Result<String> {
        (self.read)(path)
    }

    /// Lays the files of a folder of the same shape over this one.
    ///
    /// # Errors
    ///
    /// The path that cannot be read, and why.
    pub fn with_folder(mut self, folder: &Path) -> Result<Self, (PathBuf, io::Error)> {
        self.folder = Some(folder.to_path_buf());
        let mut open = vec![folder.to_path_buf()];
        while let Some(dir) = open.pop() {
            let entries = fs::read_dir(&dir).map_err(|error| (dir.clone(), error))?;
            for entry in entries.flatten() {
                let path = entry.path();
                if path.is_dir() {
                    // A link to a folder may lead back to where it lies.
                    if !path.is_symlink() {
                        open.push(path);
                    }
                } else if path.extension().is_some_and(|e| TEXTS.iter().any(|text| e == *text)) {
                    let text = read::text(&path).map_err(|error| (path.clone(), error))?;
                    let name = path.strip_prefix(folder).unwrap_or(&path);
                    let name = name.to_string_lossy().replace('\\', "/");
                    self.beside.insert(name.clone(), dir.clone());
                    self.files.insert(name, text);
                }
            }
        }
        Ok(self)
    }

    /// Returns the folder that was laid over what is embedded, as it was named.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
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

    /// Returns the robot of a folder `robots/<name>/`: its URDF, and its side file `robot.toml` if it has one.
    ///
    /// # Errors
    ///
    /// `RobotError::None` with the names there are, or why the text is no robot.
    pub fn robot(&self, name: &str) -> Result<Robot, RobotError> {
        self.robot_to(name, None)
    }

    /// As [`Self::robot`], up to the link `tip`, where one is named.
    ///
    /// # Errors
    ///
    /// As [`Self::robot`], and for a link that it does not have.
    pub fn robot_to(&self, name: &str, tip: Option<&str>) -> Result<Robot, RobotError> {
        let folder = format!("robots/{name}/");
        let urdf = self.files.iter().find(|(path, _)| {
            path.starts_with(&folder) && Path::new(path).extension().is_some_and(|e| e == "urdf")
        });
        let Some((path, urdf)) = urdf else {
            let known = self.robots().into_iter().map(str::to_owned).collect();
            return Err(RobotError::None { name: name.to_owned(), known });
        };
        let side = self.file(&format!("{folder}robot.toml")).unwrap_or_default();
        let meshes = |name: &str| match self.beside.get(path) {
            Some(folder) => mesh::beside(folder, name),
            None => mesh::nowhere(name),
        };
        Robot::from_urdf_beside(urdf, side, tip, &meshes)
            .map_err(|error| RobotError::Text { path: path.clone(), error })
    }

    /// Returns the names of the robots, in their order.
    pub fn robots(&self) -> Vec<&str> {
        let urdfs = self.files.keys().filter(|path| {
            Path::new(path.as_str()).extension().is_some_and(|extension| extension == "urdf")
        });
        let folders = urdfs.filter_map(|path| path.strip_prefix("robots/")?.split_once('/'));
        let mut names: Vec<&str> = folders.map(|(name, _)| name).collect();
        names.dedup();
        names
    }

    /// Returns the file names of the scripts that actions may run.
    pub fn script_names(&self) -> impl Iterator<Item = &str> {
        self.files.keys().filter_map(|path| path.strip_prefix("actions/"))
    }

    /// Adds a script that a program imports.
    pub fn add_script(&mut self, name: &str, text: &str) {
        self.files.insert(format!("actions/{name}"), text.to_owned());
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
