//! The runs there are, each read once as long as its document does not change.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use crate::workcell::Run;
use crate::workcell::archive::{self, Entry};

/// How many runs are kept in memory and asked about, the newest first.
const MOST: usize = 100;

/// A document's size and time: when either changes, it is read again.
type Stamp = (u64, Option<SystemTime>);

/// What was read at which stamp; nothing when it could not be read.
type Known = (Stamp, Option<Arc<Run>>);

/// Run folders below one root.
pub(super) struct RunIndex {
    root: PathBuf,
    known: Mutex<BTreeMap<PathBuf, Known>>,
}

impl RunIndex {
    pub(super) fn new(root: PathBuf) -> Self {
        Self { root, known: Mutex::default() }
    }

    pub(super) fn root(&self) -> &Path {
        &self.root
    }

    /// Returns the folders, the oldest first.
    pub(super) fn entries(&self) -> Vec<Entry> {
        archive::entries(&self.root)
    }

    /// Returns the folder of that name or number.
    pub(super) fn entry(&self, wanted: &str) -> Option<Entry> {
        let mut all = self.entries().into_iter();
        all.find(|entry| entry.name == wanted || wanted.parse() == Ok(entry.number))
    }

    /// Reads a run; `None` when its document cannot be read.
    pub(super) fn run(&self, dir: &Path) -> Option<Arc<Run>> {
        let stamp = |path: &Path| {
            let facts = fs::metadata(path).ok()?;
            Some((facts.len(), facts.modified().ok()))
        };
        let now = stamp(&dir.join("run.json"))?;
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((then, run)) = known().get(dir)
            && *then == now
        {
            return run.clone();
        }
        // Read outside of the lock: a long document holds nobody up.
        let run = archive::load(dir).ok().map(Arc::new);
        let mut known = known();
        if known.len() >= MOST {
            known.pop_first();
        }
        known.insert(dir.to_owned(), (now, run.clone()));
        run
    }

    /// Returns the newest runs that can be read, the oldest of them first.
    pub(super) fn runs(&self) -> Vec<(Entry, Arc<Run>)> {
        let entries = self.entries();
        let first = entries.len().saturating_sub(MOST);
        let runs = entries.into_iter().skip(first);
        runs.filter_map(|entry| Some((entry.clone(), self.run(&entry.dir)?))).collect()
    }

    /// Returns earlier runs of the same task, with their numbers, the oldest first.
    pub(super) fn earlier(&self, entry: &Entry, run: &Run) -> Vec<(usize, Run)> {
        archive::earlier(run, Some(entry.number), &self.entries())
    }
}
