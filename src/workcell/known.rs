//! What is known to be missing from the twin: the effects of the `twin` items that come with a scene.

use crate::language::Library;
use crate::language::ast::EffectItem;
use crate::twin::{Effect, Settings};
use crate::world::Scene;

/// The effects of a scene's twins.
#[derive(Debug, Clone, Default)]
pub(super) struct Known {
    /// Those the twin has a law for, each with its name: `lip_dribble(jar)`.
    effects: Vec<(String, Effect)>,
    /// The names of the others, each with why it changes nothing here.
    pub(super) aside: Vec<(String, String)>,
}

impl Known {
    /// Collects the effects of every `twin … of` the scene, in the order of their files; the arm has so many joints.
    pub(super) fn of(library: &Library, scene: &Scene, joints: usize) -> Self {
        let mut known = Self::default();
        let twins = library.twins().filter(|(twin, _)| twin.of.text == scene.name);
        for item in twins.flat_map(|(twin, _)| &twin.effects) {
            let name = format!("{}({})", item.name.text, item.at.text);
            let Some(effect) = law(item) else {
                known.aside.push((name, "the twin has no law for it".into()));
                continue;
            };
            match effect.hindrance(scene, joints) {
                None => known.effects.push((name, effect)),
                Some(why) => known.aside.push((name, why)),
            }
        }
        known
    }

    /// Returns the scene as it is known to be.
    pub(super) fn scene(&self, declared: &Scene) -> Scene {
        let mut scene = declared.clone();
        for (_, effect) in &self.effects {
            effect.change_scene(&mut scene);
        }
        scene
    }

    /// Puts the effects into the numbers of the twin's physics.
    pub(super) fn change(&self, settings: &mut Settings) {
        for (_, effect) in &self.effects {
            effect.change_settings(settings);
        }
    }

    /// Says what the twin has, ` with lip_dribble(jar)`, or nothing.
    pub(super) fn words(&self) -> String {
        let names: Vec<&str> = self.effects.iter().map(|(name, _)| name.as_str()).collect();
        if names.is_empty() { String::new() } else { format!(" with {}", names.join(", ")) }
    }
}

fn law(item: &EffectItem) -> Option<Effect> {
    Effect::known(&item.name.text, &item.at.text, |name| {
        let parameter = item.parameters.iter().find(|parameter| parameter.name.text == name)?;
        Some(parameter.value.quantity.value)
    })
}
