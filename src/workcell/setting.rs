//! The scene and the arm that a run was made with, as its record names them.
//!
//! A run folder does not hold its robot or its scene: it says where they were. Whether those at hand are the run's is judged by
//! [`super::links`].

use serde::{Deserialize, Serialize};

use crate::language::Library;
use crate::lines;
use crate::world::Scene;

use super::Stdlib;

/// Where the scene and the arm of a run were found.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Setting {
    /// The scene's name.
    pub name: String,
    /// The arm's: a folder of `robots/` in the stdlib.
    pub robot: String,
    /// The file that the scene stands in, as it was given; none of a scene of the stdlib.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// SHA-256 of the text of that file, in hexadecimal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
    /// The folder whose files came before the embedded stdlib, as it was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stdlib: Option<String>,
}

impl Setting {
    /// Returns the setting of a scene that was read into a library over the stdlib.
    pub(super) fn of(library: &Library, stdlib: &Stdlib, scene: &Scene) -> Self {
        let source = library.scene(&scene.name).map(|(_, source)| source);
        let is_own = |name: &str, text: &str| stdlib.file(name) != Some(text);
        let own = source.filter(|source| is_own(&source.name, &source.text));
        Self {
            name: scene.name.clone(),
            robot: scene.robot.clone(),
            file: own.map(|source| source.name.clone()),
            sha256: own.map(|source| lines::fingerprint(&[source.text.as_str()])),
            stdlib: stdlib.folder().map(|folder| folder.display().to_string()),
        }
    }

    /// Whether the text of its file is another now.
    pub fn is_changed(&self, text: &str) -> bool {
        self.sha256.as_ref().is_some_and(|then| *then != lines::fingerprint(&[text]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::Source;
    use crate::workcell::{library, scene_of};

    #[test]
    fn a_scene_of_ones_own_is_named_with_its_file_and_one_of_the_stdlib_without() {
        let stdlib = Stdlib::embedded();
        let mut library = library(&stdlib);
        let kitchen = scene_of(&library, None).unwrap();
        let made = Setting::of(&library, &stdlib, &kitchen);
        assert_eq!((made.name.as_str(), made.robot.as_str()), ("kitchen", "gen3_2f85"));
        assert_eq!((made.file, made.sha256, made.stdlib), (None, None, None));

        let kitchen = stdlib.file("scenes/kitchen.task").unwrap();
        let text = kitchen.replace("scene kitchen", "scene bench");
        let file = library.add(Source::new("mine/bench.task", text.as_str()));
        let bench = scene_of(&library, Some(file)).unwrap();
        let made = Setting::of(&library, &stdlib, &bench);
        assert_eq!((made.name.as_str(), made.file.as_deref()), ("bench", Some("mine/bench.task")));
        assert!(!made.is_changed(&text) && made.is_changed(kitchen));
    }
}
