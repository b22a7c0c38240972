//! The texts of a cell: the stdlib read into a library, and its scene.

use super::{Error, Stdlib};
use crate::language::{Diagnostic, Library, Source};
use crate::scene;
use crate::world::Scene;

/// Reads the stdlib into a library.
pub fn library(stdlib: &Stdlib) -> Library {
    let mut library = Library::new();
    for (path, text) in stdlib.tasks() {
        library.add(Source::new(path, text));
    }
    library
}

/// Returns the scene of a source, or the first one there is.
///
/// # Errors
///
/// When there is none, or it makes no sense.
pub fn scene_of(library: &Library, source: Option<usize>) -> Result<Scene, Error> {
    let mut scenes: Vec<_> = library.scenes().collect();
    let own = source.and_then(|at| {
        let name = &library.source(at)?.name;
        scenes.iter().position(|(_, from)| from.name == *name)
    });
    if scenes.is_empty() {
        return Err(Error::NoScene("the library".into()));
    }
    let (item, from) = scenes.swap_remove(own.unwrap_or(0));
    scene::from_item(item, from)
        .map_err(|wrong| Error::Text(with_sources(library, wrong.into_iter())))
}

/// Puts beside each diagnostic the text it is about.
pub(super) fn with_sources(
    library: &Library,
    diagnostics: impl Iterator<Item = Diagnostic>,
) -> Vec<(Diagnostic, Source)> {
    diagnostics
        .map(|diagnostic| {
            let source = library.source_named(&diagnostic.file).cloned().unwrap_or_default();
            (diagnostic, source)
        })
        .collect()
}
