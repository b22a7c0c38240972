//! What is known to be missing from the twin: the effects of the `twin` items that come with a scene.

use crate::language::ast::{EffectItem, TwinItem};
use crate::language::{Diagnostic, Library};
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

    /// Says what the twin has, ` with lip_dribble(jar)`, or nothing.
    pub(super) fn words(&self) -> String {
        let names: Vec<&str> = self.effects.iter().map(|(name, _)| name.as_str()).collect();
        if names.is_empty() { String::new() } else { format!(" with {}", names.join(", ")) }
    }
}

/// Returns the law by which the twin heeds an effect, or why it does not; without a scene it is not asked whether the
/// place is there.
fn heeded(item: &EffectItem, scene: Option<&Scene>, joints: usize) -> Result<Effect, String> {
    let law = Effect::known(&item.name.text, &item.at.text, |name| {
        let parameter = item.parameters.iter().find(|parameter| parameter.name.text == name)?;
        Some(parameter.value.quantity.value)
    });
    let law = law.ok_or("the twin has no law for it")?;
    match scene.and_then(|scene| law.hindrance(scene, joints)) {
        Some(why) => Err(why),
        None => Ok(law),
    }
}

/// Warns of the effects of a twin that change nothing in a rehearsal.
pub(super) fn unheeded(twin: &TwinItem, scene: Option<&Scene>) -> Vec<Diagnostic> {
    let warn = |item: &EffectItem| {
        let why = heeded(item, scene, usize::MAX).err()?;
        let message =
            format!("rehearsals do not simulate `{}({})`: {why}", item.name.text, item.at.text);
        let found = Diagnostic::warning("task::unheeded", item.name.span, message, "not simulated");
        Some(found.help("`gap` judges with it all the same; a run goes without it"))
    };
    twin.effects.iter().filter_map(warn).collect()
}

/// Says which effects of a model file rehearsals do not heed, in one sentence.
pub fn unheeded_words(effects: &[EffectItem]) -> Option<String> {
    let idle = effects.iter().filter(|item| heeded(item, None, usize::MAX).is_err());
    let names: Vec<String> =
        idle.map(|item| format!("{}({})", item.name.text, item.at.text)).collect();
    (!names.is_empty()).then(|| {
        let them = if names.len() == 1 { "it" } else { "them" };
        let names = names.join(", ");
        format!("the twin has no law for {names}: `gap` judges with {them}, rehearsals go without")
    })
}
