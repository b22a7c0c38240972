//! The texts of a cell: the stdlib read into a library, and its scene.

use super::{Error, Stdlib};
use crate::language::ast::Item;
use crate::language::library::DEFAULT_SCENE;
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

/// Reads the text that was named for its scene into a library, with what it imports, and returns its number.
///
/// # Errors
///
/// [`Error::NoScene`] when it has none: it does not quietly mean another one's.
pub fn add_scene(library: &mut Library, stdlib: &Stdlib, source: Source) -> Result<usize, Error> {
    let name = source.name.clone();
    let file = library.add_with(source, &|path| stdlib.read(path));
    if own_scene(library, file).is_none() { Err(Error::NoScene(name)) } else { Ok(file) }
}

fn own_scene(library: &Library, file: usize) -> Option<&str> {
    library.program(file)?.items.iter().find_map(|item| match item {
        Item::Scene(scene) => Some(scene.name.text.as_str()),
        _ => None,
    })
}

/// Returns the name of the scene that calls of a source are for: its own, else the one that is meant when nobody names one, else
/// the first there is. What it imports gives definitions, and its scene is not set up.
pub fn scene_name(library: &Library, source: Option<usize>) -> Option<&str> {
    let own = source.and_then(|file| own_scene(library, file));
    let default = || library.scene(DEFAULT_SCENE).or_else(|| library.scenes().next());
    own.or_else(|| default().map(|(scene, _)| scene.name.text.as_str()))
}

/// Returns the scene of a source, as [`scene_name`] says which.
///
/// # Errors
///
/// When there is none, or it makes no sense.
pub fn scene_of(library: &Library, source: Option<usize>) -> Result<Scene, Error> {
    let found = scene_name(library, source).and_then(|name| library.scene(name));
    let (item, from) = found.ok_or_else(|| Error::NoScene("the library".into()))?;
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
