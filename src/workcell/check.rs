//! Everything that is wrong with a text, whoever knows it.
//!
//! The language finds wrong names, types and units; the world knows what a scene can be, discovery which
//! effects there are, and the stdlib which scripts. `check`, the editor and the cell all ask here, so none
//! of them lets pass what another refuses.

use rayon::prelude::*;

use crate::alignment::marks;
use crate::discovery::vocabulary;
use crate::execution::walk::Texts as _;
use crate::execution::{lint, uses};
use crate::language::ast::{Conditions, Item, Program, Span, Step};
use crate::language::names_in;
use crate::language::{Diagnostic, Library, Scope, Source, nearest};
use crate::scene;

use super::{Error, Stdlib, WorkCell, add_scene, scene_name, wording};

/// Returns what names mean in a file: the objects of the scene that a run of it sets up.
pub fn scope_of(library: &Library, file: usize) -> Scope {
    scene_name(library, Some(file)).map_or_else(Scope::default, |name| library.scope(name))
}

/// Checks texts, each by itself over the stdlib, side by side; what is wrong comes in their order. Calls are judged by
/// `scene`, where one is named, as a run does.
///
/// # Errors
///
/// [`Error::NoScene`] when the text that is named for its scene has none.
pub fn check_all(
    stdlib: &Stdlib,
    scene: Option<Source>,
    sources: Vec<Source>,
) -> Result<Vec<(Diagnostic, Source)>, Error> {
    let mut standard = super::library(stdlib);
    let named = scene.map(|source| add_scene(&mut standard, stdlib, source)).transpose()?;
    let found: Vec<Vec<(Diagnostic, Source)>> = sources
        .into_par_iter()
        .map(|source| {
            let mut library = standard.clone();
            let file = library.add_with(source.clone(), &|path| stdlib.read(path));
            let scope = scope_of(&library, named.unwrap_or(file));
            let found = check_file(&library, stdlib, file, &scope);
            found.into_iter().map(|diagnostic| (diagnostic, source.clone())).collect()
        })
        .collect();
    Ok(found.into_iter().flatten().collect())
}

/// Returns everything that is wrong with one file of a library, in the order of its text.
pub fn check_file(
    library: &Library,
    stdlib: &Stdlib,
    file: usize,
    scope: &Scope,
) -> Vec<Diagnostic> {
    let mut found = library.check_file(file, scope);
    let (Some(program), Some(source)) = (library.program(file), library.source(file)) else {
        return found;
    };
    let errors: Vec<Span> = found.iter().filter(|d| d.is_error()).map(|d| d.span).collect();
    let is_inside = |inner: Span, outer: Span| outer.from <= inner.from && inner.to <= outer.to;
    let mut deeper = Vec::new();
    for item in &program.items {
        match item {
            Item::Scene(scene) => {
                let wrong = scene::from_item(scene, source).err().unwrap_or_default();
                // What could not be read is not missing.
                let damaged = errors.iter().any(|error| is_inside(*error, scene.span));
                deeper.extend(wrong.into_iter().filter(|d| !damaged || d.code != "task::missing"));
                let dots: usize = scene.marks.iter().map(|group| group.centres.len()).sum();
                let known = stdlib.robots();
                let robot = scene.robots.first().map(|robot| &robot.name);
                if let Some(name) = robot.filter(|name| !known.contains(&name.text.as_str())) {
                    deeper.push(wording::no_robot(name, &known));
                }
                if let Some(group) = scene.marks.first().filter(|_| dots < marks::NEEDED) {
                    deeper.push(wording::few_marks(group.span, dots));
                }
            }
            Item::Twin(twin) => {
                let of = library.scenes().find(|(scene, _)| scene.name.text == twin.of.text);
                let scene = of.and_then(|(item, source)| scene::from_item(item, source).ok());
                let turns = |joint: usize| {
                    let robot = scene.as_ref().and_then(|s| stdlib.robot(&s.robot).ok());
                    robot.is_some_and(|robot| robot.sliding().get(joint) == Some(&false))
                };
                let wrong = vocabulary::check(twin, &turns);
                if wrong.is_empty() {
                    deeper.extend(super::known::unheeded(twin, scene.as_ref()));
                }
                deeper.extend(wrong);
            }
            _ => {}
        }
    }
    deeper.extend(scripts(program, library, stdlib));
    deeper.extend(unread(program, library, stdlib));
    deeper.extend(super::together::check(program, library, stdlib));
    // One mistake is told once.
    deeper.retain(|d| !errors.iter().any(|e| e.from < d.span.to && d.span.from < e.to));
    found.extend(deeper.into_iter().map(|d| Diagnostic { file: source.name.clone(), ..d }));
    found.sort_by_key(|d| (d.span.from, d.span.to));
    found
}

impl WorkCell {
    /// Returns the texts that the cell works with, imported scripts among them.
    pub fn stdlib(&self) -> &Stdlib {
        &self.setup.stdlib
    }
}

/// Returns everything that is wrong with a step typed at the prompt.
pub fn check_step(
    step: &Step,
    source: &Source,
    library: &Library,
    stdlib: &Stdlib,
    scope: &Scope,
) -> Vec<Diagnostic> {
    let mut found = library.check_step(step, source, scope);
    found.extend(super::together::check_step(step, library, stdlib));
    found
}

/// Complains about actions whose script nobody has.
fn scripts(program: &Program, library: &Library, stdlib: &Stdlib) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for item in &program.items {
        let Item::Action(action) = item else { continue };
        let Some((name, span)) = &action.script else { continue };
        let own = library.scripts().get(name).map(String::as_str);
        if let Some(text) = own.or_else(|| stdlib.script(name)) {
            let params = action.params.iter().map(|param| param.name.text.as_str());
            if let Err(error) = lint::readable(name, text, params) {
                found.push(wording::unreadable_script(&error, *span));
            }
            continue;
        }
        let known = stdlib.script_names().chain(library.scripts().keys().map(String::as_str));
        found.push(wording::no_script(name, *span, nearest(name, known)));
    }
    found
}

/// Complains about parameters that an action takes and neither its script nor its conditions look at: what they ask
/// for would not be done, and nobody would notice.
fn unread(program: &Program, library: &Library, stdlib: &Stdlib) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for item in &program.items {
        let Item::Action(action) = item else { continue };
        let Some((file, _)) = &action.script else { continue };
        let own = library.scripts().get(file).map(String::as_str);
        let Some(script) = own.or_else(|| stdlib.script(file)) else { continue };
        let Conditions { needs, keeps, gives } = &action.conditions;
        let judged: Vec<String> =
            [needs, keeps, gives].into_iter().flatten().flat_map(names_in).collect();
        for param in &action.params {
            let name = &param.name.text;
            if uses::says(script, name) || judged.contains(name) {
                continue;
            }
            found.push(wording::unread(file, name, param.name.span));
        }
    }
    found
}
