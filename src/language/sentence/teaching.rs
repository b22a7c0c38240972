//! What a phrase would do, asked before it is learnt: whether its call works, whether it is ever heard, and
//! which sentence means something else from then on.
//!
//! Nothing is said for it and nothing moves: the sentences are made up from the phrase, from the templates of tasks and from
//! the things that are here.

use super::super::ast::Param;
use super::super::builtins::{self, Ty};
use super::super::text;
use super::fill::{checked, written};
use super::knowledge::{Knowledge, Phrase, Thing};
use super::meaning::{Meaning, Understood, words};
use super::template::{Reach, Template, Wrong};
use super::{example, meant};

/// So many sentences of a template are tried at most.
const MOST_WAYS: usize = 16;

/// Returns the sentences that are a single word, of those that a phrase is heard as.
pub fn single_words(phrase: &Phrase) -> Vec<String> {
    let said = phrase.template.ways(MOST_WAYS, |_| "a b".to_owned());
    said.iter().map(|said| words(said)).filter(|said| !said.contains(' ')).collect()
}

/// Says why a phrase could never be used.
///
/// # Errors
///
/// [`Wrong`]: no sentence is heard as its own, what is asked so is a question, or its call is none, as the checker says.
pub fn sound(phrase: &Phrase, with: &Knowledge<'_>) -> Result<(), Wrong> {
    let name = &phrase.call.name.text;
    let Some((callable, _)) = with.library.callable(name) else {
        return Err(Wrong {
            message: format!("there is no task or action `{name}`"),
            help: "`:tasks` lists what can be called".into(),
        });
    };
    let types = types(phrase, callable.params());
    let of = |slot: &str| types.iter().find(|(own, _)| own == slot).map(|(_, ty)| ty);
    let said = phrase.template.ways(MOST_WAYS, |slot| {
        if phrase.template.whole(slot).is_some() {
            return "half".to_owned();
        }
        of(slot).map_or_else(|| slot.to_owned(), |ty| sample(slot, ty))
    });
    let mut heard =
        said.iter().filter(|said| phrase.template.fit(&words(said), Reach::Short).is_some());
    let Some(heard) = heard.next() else {
        let heard = said.first().map(|said| words(said)).unwrap_or_default();
        return Err(Wrong {
            message: format!(
                "\"{}\" is never heard: it is taken for \"{heard}\", without marks and words of politeness",
                phrase.template.text
            ),
            help: "write the sentence without them; they may still be said".into(),
        });
    };
    let untaught = Knowledge { phrases: &[], ..*with };
    for said in own(phrase, with).iter().chain([heard]) {
        if let Meaning::Asked { line, .. } = meant(&words(said), &untaught) {
            return Err(Wrong {
                message: format!("\"{said}\" is a question already, and asks for `{line}`"),
                help: "begin the sentence with what is to be done".into(),
            });
        }
    }
    // Slots are things of the kinds that the call takes, whatever stands here.
    let is_thing = |ty: &Ty| !matches!(ty, Ty::Quantity(_) | Ty::Face | Ty::View | Ty::Bool);
    let own = types.iter().filter(|(_, ty)| is_thing(ty)).map(|(slot, ty)| Thing {
        name: slot.clone(),
        kind: match ty {
            Ty::Object(kind) => kind.clone(),
            _ => builtins::OBJECT.to_owned(),
        },
        looks: String::new(),
    });
    let others = with.things.iter().filter(|thing| of(&thing.name).is_none()).cloned();
    let things: Vec<Thing> = own.chain(others).collect();
    let way: Vec<(String, String, String)> =
        types.iter().map(|(slot, ty)| (slot.clone(), slot.clone(), sample(slot, ty))).collect();
    let line = written(phrase, &way);
    let with = Knowledge { things: &things, ..*with };
    checked(line, &phrase.template.text, way, Vec::new(), &with).map(|_| ()).map_err(|wrong| {
        let help = wrong.help.unwrap_or_else(|| format!("`?{name}` says what it takes"));
        Wrong { message: wrong.why, help }
    })
}

/// Returns a sentence that means something else once a phrase is known, with the call that it meant before; `None` when no
/// sentence is known that does.
pub fn displaced(phrase: &Phrase, with: &Knowledge<'_>) -> Option<(String, String)> {
    let before = Knowledge { phrases: &[], hindrance: &|_| None, ..*with };
    let phrases = [phrase.clone()];
    let after = Knowledge { phrases: &phrases, ..before };
    let known = with.library.callables().flat_map(|callable| {
        let say = callable.say().iter().filter_map(|say| Template::read(&say.text).ok());
        say.map(|template| example(&template, callable.params(), with)).collect::<Vec<_>>()
    });
    own(phrase, with).into_iter().chain(known).find_map(|sentence| {
        let said = words(&sentence);
        phrase.template.fit(&said, Reach::Short)?;
        let meant_before = calls(meant(&said, &before));
        let first = meant_before.first()?;
        let meant_after = calls(meant(&said, &after));
        // Two slots filled with one thing are no sentence that somebody says.
        if meant_after.iter().any(is_twice) {
            return None;
        }
        let is_same = |call: &Understood| meant_before.iter().any(|old| old.text == call.text);
        let stays = !meant_after.is_empty() && meant_after.iter().all(is_same);
        (!stays).then(|| (said, first.text.clone()))
    })
}

/// Returns sentences of a phrase, its slots filled with things that are here; none where nothing fits.
fn own(phrase: &Phrase, with: &Knowledge<'_>) -> Vec<String> {
    let Some((callable, _)) = with.library.callable(&phrase.call.name.text) else {
        return Vec::new();
    };
    let types = types(phrase, callable.params());
    let fitting = |ty: &Ty| -> Vec<String> {
        let kind = match ty {
            Ty::Object(kind) => kind.as_str(),
            _ => builtins::OBJECT,
        };
        let things = with.things.iter().filter(|thing| with.library.is_a(&thing.kind, kind));
        things.map(|thing| thing.name.clone()).collect()
    };
    let mut found = Vec::new();
    for turn in 0..with.things.len() {
        let words: Vec<(&str, String)> = types
            .iter()
            .enumerate()
            .filter_map(|(at, (slot, ty))| {
                let word = match ty {
                    Ty::Quantity(_) | Ty::Face | Ty::View | Ty::Bool => sample(slot, ty),
                    _ => {
                        let things = fitting(ty);
                        things.get((turn + at) % things.len().max(1))?.clone()
                    }
                };
                Some((slot.as_str(), word))
            })
            .collect();
        if words.len() < types.len() {
            return found;
        }
        found.extend(phrase.template.ways(MOST_WAYS, |slot| {
            let word = words.iter().find(|(own, _)| *own == slot);
            word.map_or_else(|| slot.to_owned(), |(_, word)| word.clone())
        }));
    }
    found
}

/// Returns the type of each slot: that of the parameter it is given to.
fn types(phrase: &Phrase, params: &[Param]) -> Vec<(String, Ty)> {
    let slots = phrase.template.slots();
    let typed = phrase.call.args.iter().enumerate().filter_map(|(i, arg)| {
        let slot = text::expr(arg.values.first()?);
        let param = match &arg.name {
            Some(name) => params.iter().find(|param| param.name.text == name.text),
            None => params.get(i),
        };
        let ty = param.map_or(Ty::Any, |param| Ty::named(&param.ty.text));
        slots.contains(&slot).then_some((slot, ty))
    });
    typed.collect()
}

/// Returns what could be said for a slot of a type; for a thing the slot's own name.
fn sample(slot: &str, ty: &Ty) -> String {
    match ty {
        Ty::Quantity(dimension) => format!("60 {}", dimension.everyday_unit()).trim_end().into(),
        Ty::Face => "side".into(),
        Ty::View => "robot".into(),
        _ => slot.to_owned(),
    }
}

fn calls(meaning: Meaning) -> Vec<Understood> {
    match meaning {
        Meaning::Clear(found) => vec![found],
        Meaning::Ambiguous { choices, .. } => choices,
        _ => Vec::new(),
    }
}

/// Whether a call is given one thing twice.
fn is_twice(found: &Understood) -> bool {
    found.calls.iter().any(|call| {
        let values: Vec<String> =
            call.args.iter().flat_map(|arg| &arg.values).map(text::expr).collect();
        values.iter().enumerate().any(|(at, value)| values[..at].contains(value))
    })
}
