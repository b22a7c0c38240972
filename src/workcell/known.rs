//! What is known to be missing from the twin: the effects of the `twin` items that come with a scene.

use crate::language::ast::{EffectItem, TwinItem};
use crate::language::{Diagnostic, Library};
use crate::twin::{Effect, Hindrance, Settings};
use crate::world::Scene;

use super::wording;

/// Why a rehearsal does not simulate an effect.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum Unheeded {
    /// Nobody wrote down how.
    #[error("the twin has no law for it")]
    NoLaw,
    /// There is nothing in the scene that it could be about.
    #[error("{0}")]
    Hindered(Hindrance),
}

/// The effects of a scene's twins.
#[derive(Debug, Clone, Default)]
pub(super) struct Known {
    /// Those the twin has a law for, each with its name: `lip_dribble(jar)`.
    effects: Vec<(String, Effect)>,
    /// The names of the others, each with why it changes nothing here.
    pub(super) aside: Vec<(String, Unheeded)>,
}

impl Known {
    /// Collects the effects of every `twin … of` the scene, in the order of their files; the arm has so many joints.
    pub(super) fn of(library: &Library, scene: &Scene, joints: usize) -> Self {
        let mut known = Self::default();
        let twins = library.twins().filter(|(twin, _)| twin.of.text == scene.name);
        for item in twins.flat_map(|(twin, _)| &twin.effects) {
            let name = format!("{}({})", item.name.text, item.at.text);
            match heeded(item, Some(scene), joints) {
                Ok(effect) => known.effects.push((name, effect)),
                Err(why) => known.aside.push((name, why)),
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

    /// Returns the names of those that the twin has: `lip_dribble(jar)`.
    pub(super) fn names(&self) -> Vec<&str> {
        self.effects.iter().map(|(name, _)| name.as_str()).collect()
    }
}

/// Returns the law by which the twin heeds an effect, or why it does not; without a scene it is not asked whether the
/// place is there.
fn heeded(item: &EffectItem, scene: Option<&Scene>, joints: usize) -> Result<Effect, Unheeded> {
    let law = Effect::known(&item.name.text, &item.at.text, |name| {
        let parameter = item.parameters.iter().find(|parameter| parameter.name.text == name)?;
        Some(parameter.value.quantity.value)
    });
    let law = law.ok_or(Unheeded::NoLaw)?;
    match scene.and_then(|scene| law.hindrance(scene, joints)) {
        Some(why) => Err(Unheeded::Hindered(why)),
        None => Ok(law),
    }
}

/// Warns of the effects of a twin that change nothing in a rehearsal.
pub(super) fn unheeded(twin: &TwinItem, scene: Option<&Scene>) -> Vec<Diagnostic> {
    let warn = |item: &EffectItem| {
        let why = heeded(item, scene, usize::MAX).err()?;
        Some(wording::unheeded(item, &why))
    };
    twin.effects.iter().filter_map(warn).collect()
}

/// Says which effects of a model file rehearsals do not heed, in one sentence.
pub fn unheeded_words(effects: &[EffectItem]) -> Option<String> {
    let idle = effects.iter().filter(|item| heeded(item, None, usize::MAX).is_err());
    let names: Vec<String> =
        idle.map(|item| format!("{}({})", item.name.text, item.at.text)).collect();
    (!names.is_empty()).then(|| wording::no_law_for(&names))
}
