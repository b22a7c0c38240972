//! Sentences → calls: "Pour water from the transparent jar into the blue cup" → `pour(jar, cup)`.
//!
//! The shape of a sentence is matched first, by the `say` templates of tasks and by phrases a person has
//! taught; then each slot is resolved to an object, a face or a quantity. A sentence of several wishes, "pick up the
//! jar, then put it down", is as many calls, one after the other (`sequence`). So what is not understood has a
//! reason: no such sentence, no such object, or two of them. Nothing is guessed, and what comes out has
//! been parsed and checked like anything typed.
//!
//! Source of clear, ambiguous and impossible: Park et al., "CLARA", 2023 (arXiv 2306.10376).

mod advice;
mod describe;
mod fill;
mod hand;
mod knowledge;
mod meaning;
mod misspelt;
mod plural;
mod question;
mod relation;
mod resolve;
mod sequence;
mod share;
mod shift;
mod teaching;
mod template;

use super::ast::{Param, SceneItem, Step};
use super::builtins::Ty;
use super::parse::parse_line;
use super::text;
pub use advice::{instead, is_again, is_foreign};
use fill::{Reading, filled, taught};
use hand::Hand;
pub use knowledge::{Knowledge, Phrase, Spot, Thing};
pub use meaning::{Meaning, Understood, words};
use resolve::Hindrance;
pub use teaching::{displaced, single_words, sound};
pub use template::{Reach, Template, Whole, Wrong};

/// How many readings of an ambiguous sentence are offered.
const MOST_CHOICES: usize = 4;

/// Returns the things of a scene as sentences may name them.
pub fn things(scene: &SceneItem) -> Vec<Thing> {
    scene.things.iter().map(Thing::of).collect()
}

/// Reads a taught phrase: `"empty the {o}" = pour(o, cup)`.
///
/// # Errors
///
/// What is wrong with it, in a sentence with help: the template, the call, a slot the call does not use.
pub fn phrase(text: &str) -> Result<Phrase, Wrong> {
    let form = || Wrong {
        message: "a phrase is a sentence in quotes and the call it stands for".into(),
        help: "write `\"empty the {o}\" = pour(o, cup)`".into(),
    };
    let rest = text.trim().strip_prefix('"').ok_or_else(form)?;
    let (sentence, call) = rest.split_once('"').ok_or_else(form)?;
    let call = call.trim_start().strip_prefix('=').ok_or_else(form)?;
    let template = Template::read(sentence)?;
    let (step, wrong) = parse_line(call);
    let call = match step {
        Some(Step::Act(act)) if act.holds.is_empty() && act.via.is_empty() => act.call,
        _ => {
            let message = match wrong.first() {
                Some(wrong) => wrong.message.clone(),
                None => "a phrase stands for one call".into(),
            };
            return Err(Wrong { message, help: form().help });
        }
    };
    let written = text::call(&call);
    for slot in template.slots() {
        let used = call.args.iter().flat_map(|arg| &arg.values).any(|v| text::expr(v) == *slot);
        if !used {
            let message = format!("`{written}` does not use `{{{slot}}}`");
            return Err(Wrong { message, help: format!("name `{slot}` in the call") });
        }
    }
    Ok(Phrase { template, call })
}

/// Reads a sentence.
pub fn understand(sentence: &str, with: &Knowledge<'_>) -> Meaning {
    let said = words(sentence);
    let found = meant(&said, with);
    if matches!(found, Meaning::Unknown { .. })
        && let Some(corrected) = misspelt::corrected(&said, with)
    {
        return Meaning::Unknown { help: format!("did you mean \"{corrected}\"?") };
    }
    found
}

/// Reads a sentence as it stands; `said` as [`words`] makes it.
fn meant(said: &str, with: &Knowledge<'_>) -> Meaning {
    if let Some(asked) = question::understand(said, with) {
        return asked;
    }
    match one(said, with) {
        // Nothing is in the hand that nobody spoke of, unless what is known of the arm says so.
        Meaning::Ambiguous { question, choices } if with.it.is_none() => {
            let mut able = sequence::able(choices, Some(&Hand::Empty), with);
            if able.len() == 1 {
                alone(able.swap_remove(0), with)
            } else {
                Meaning::Ambiguous { question, choices: able }
            }
        }
        whole @ (Meaning::Clear(_) | Meaning::Ambiguous { .. }) => whole,
        whole => sequence::understand(said, with).unwrap_or(whole),
    }
}

/// Reads a sentence as one wish; `said` as [`words`] makes it. Of its ways to be read the first that is a call counts.
fn one(said: &str, with: &Knowledge<'_>) -> Meaning {
    let mut hindrances: Vec<Hindrance> = Vec::new();
    if let Some(meaning) = read(said, with, &mut hindrances) {
        return meaning;
    }
    if let Some((both, not_two)) = plural::pair(said, with) {
        let mut of_both = Vec::new();
        let meaning = read(&both, with, &mut of_both);
        match not_two {
            None => match meaning {
                Some(meaning) => return meaning,
                None => hindrances.extend(of_both),
            },
            // It hinders only what would be understood of two.
            Some(why) if meaning.is_some() || !of_both.is_empty() => hindrances.push(why),
            Some(_) => {}
        }
    }
    match hindrances.into_iter().rev().max_by_key(|hindrance| hindrance.after) {
        Some(Hindrance { why, help, .. }) => Meaning::Impossible { why, help },
        None => Meaning::Unknown { help: nearest_sentence(said, with) },
    }
}

/// Reads a sentence in each of its ways until one is a call.
fn read(said: &str, with: &Knowledge<'_>, hindrances: &mut Vec<Hindrance>) -> Option<Meaning> {
    for reading in relation::readings(said) {
        for reach in [Reach::Short, Reach::Long] {
            let (calls, question) = calls(&reading, reach, with, hindrances);
            if !calls.is_empty() {
                return Some(conclude(calls, question, with));
            }
        }
    }
    None
}

/// Returns the calls that a sentence may be, read in one way, and what to ask if there are several.
fn calls(
    said: &str,
    reach: Reach,
    with: &Knowledge<'_>,
    hindrances: &mut Vec<Hindrance>,
) -> (Vec<Understood>, Option<String>) {
    let (mut readings, mut question) = (Vec::new(), None);
    let before = hindrances.len();
    let is_broken = |said: &String| relation::holds_place(said);
    for phrase in with.phrases {
        if let Some(slots) = phrase.template.fit(said, reach)
            && !slots.values().any(is_broken)
        {
            let reading = taught(phrase, &slots, with);
            collect(reading, &mut readings, hindrances, &mut question);
        }
    }
    // What has been taught goes before what was there; where it fits and cannot be filled in, it is what says why.
    let is_hindered = hindrances.len() > before;
    if readings.is_empty() {
        let mut others = Vec::new();
        for callable in with.library.callables() {
            for say in callable.say() {
                let Ok(template) = Template::read(&say.text) else { continue };
                let slots = template.fit(without_particle(said, &say.text), reach);
                let Some(slots) = slots.filter(|slots| !slots.values().any(is_broken)) else {
                    continue;
                };
                let reading = filled(callable.name(), callable.params(), &template, &slots, with);
                collect(reading, &mut readings, &mut others, &mut question);
            }
        }
        if !is_hindered {
            hindrances.append(&mut others);
        }
    }
    (readings, question)
}

/// Takes away the "up" that people say behind the thing, where a template has it before: "pick it up".
fn without_particle<'s>(said: &'s str, template: &str) -> &'s str {
    let head = said.strip_suffix(" up").filter(|head| head.contains(' '));
    head.filter(|_| template.contains("[up]")).unwrap_or(said)
}

fn collect(
    reading: Reading,
    readings: &mut Vec<Understood>,
    hindrances: &mut Vec<Hindrance>,
    question: &mut Option<String>,
) {
    match reading {
        Reading::Calls(calls, which) => {
            *question = question.take().or(which);
            for call in calls {
                if readings.iter().all(|known| known.text != call.text) {
                    readings.push(call);
                }
            }
        }
        Reading::Hindered(hindrance) => hindrances.push(hindrance),
    }
}

/// Chooses among calls, one at least.
fn conclude(
    mut readings: Vec<Understood>,
    question: Option<String>,
    with: &Knowledge<'_>,
) -> Meaning {
    let idle: Vec<bool> = readings.iter().map(|one| has_idle_words(one, &readings)).collect();
    let mut is_idle = idle.into_iter();
    readings.retain(|_| !is_idle.next().unwrap_or(false));
    if readings.len() > 1 {
        // A reading that cannot be done now is not what was meant, if another can be.
        let able = |reading: &Understood| hindrance(reading, with).is_none();
        let possible: Vec<Understood> = readings.iter().filter(|r| able(r)).cloned().collect();
        if !possible.is_empty() {
            readings = possible;
        }
    }
    if readings.len() == 1 {
        return alone(readings.swap_remove(0), with);
    }
    readings.truncate(MOST_CHOICES);
    let question = question.unwrap_or_else(|| "which of these?".into());
    Meaning::Ambiguous { question, choices: readings }
}

/// Concludes from the only reading that is left.
fn alone(reading: Understood, with: &Knowledge<'_>) -> Meaning {
    match hindrance(&reading, with) {
        Some(why) => Meaning::Impossible { why, help: None },
        None => Meaning::Clear(reading),
    }
}

/// Whether a reading takes words for a description that chooses nothing, and another reading puts them to use: "put the mug
/// on the can" where there is one mug, which is a mug and a place, and not the mug that is on the can, put anywhere.
fn has_idle_words(reading: &Understood, all: &[Understood]) -> bool {
    reading.slots.iter().any(|(slot, said, value)| {
        let fewer = |other: &Understood| {
            let own = other.slots.iter().find(|(own, ..)| own == slot)?;
            let rest = said.strip_prefix(own.1.as_str())?;
            (rest.starts_with(' ') && other.slots.len() > reading.slots.len())
                .then(|| own.2 == *value)
        };
        let mut chosen = all.iter().filter_map(fewer).peekable();
        chosen.peek().is_some() && chosen.all(|is_same| is_same)
    })
}

/// Says why a reading cannot be done now: its first call, for the others follow what it does.
fn hindrance(reading: &Understood, with: &Knowledge<'_>) -> Option<String> {
    reading.calls.first().and_then(|call| (with.hindrance)(call))
}

/// The task whose sentence is shown to somebody of whom no word is known: one thing that is there, and little that can fail.
const FIRST: &str = "pick";

/// Words that say nothing of what is meant.
const LITTLE: &[&str] = &[
    "the", "a", "an", "of", "to", "in", "into", "on", "onto", "from", "with", "at", "by", "up",
    "down", "out", "off", "over", "under", "and", "it",
];

/// Returns an example of the known sentence that shares most words with what was said, of those that share a word for what is
/// done, or two for things.
fn nearest_sentence(said: &str, with: &Knowledge<'_>) -> String {
    let spoken: Vec<&str> = said.split(' ').collect();
    let mut best: Option<(usize, String)> = None;
    let mut first: Option<String> = None;
    if let Some(help) = instead(said, with) {
        return help;
    }
    if question::begins(said) {
        let thing = with.things.first();
        let (shown, name) = thing.map_or(("jar", "jar"), |thing| (thing.shown(), &thing.name));
        return format!(
            "ask \"where is the {shown}\", or for a condition such as `visible({name})`"
        );
    }
    for callable in with.library.callables() {
        for say in callable.say() {
            let Ok(template) = Template::read(&say.text) else { continue };
            let example = example(&template, callable.params(), with);
            let known: Vec<&str> = example.split(' ').collect();
            let shared = spoken.iter().filter(|word| known.contains(*word)).count();
            let tells = |word: &&&str| !LITTLE.contains(*word);
            let telling: Vec<&str> = spoken.iter().filter(tells).copied().collect();
            let without_slots = template.example(|_| String::new());
            let deeds = without_slots.split(' ').filter(|word| telling.contains(word)).count();
            let is_alike =
                deeds > 0 || telling.iter().filter(|word| known.contains(*word)).count() > 1;
            if callable.name() == FIRST {
                first.get_or_insert_with(|| example.clone());
            }
            let shared = if is_alike { shared } else { 0 };
            if best.as_ref().is_none_or(|(most, _)| shared > *most) {
                best = Some((shared, example));
            }
        }
    }
    match best {
        Some((shared, example)) if shared > 0 => format!("say it like \"{example}\""),
        Some((_, example)) => {
            let example = first.unwrap_or(example);
            format!("a sentence that is known: \"{example}\"")
        }
        None => "no task here has sentences; type a call such as `pour(jar, cup)`".into(),
    }
}

/// Returns a sentence of a template in which each slot names another thing.
fn example(template: &Template, params: &[Param], with: &Knowledge<'_>) -> String {
    let mut named: Vec<(&str, String)> = Vec::new();
    for param in params {
        let found = match Ty::named(&param.ty.text) {
            Ty::Quantity(dimension) => Some(format!("60 {}", dimension.everyday_unit())),
            Ty::Object(kind) => {
                let fits = |thing: &&Thing| with.library.is_a(&thing.kind, &kind);
                let new = |thing: &&Thing| named.iter().all(|(_, known)| known != thing.shown());
                let thing = with.things.iter().filter(fits).find(new);
                thing.map(|thing| thing.shown().to_owned())
            }
            _ => None,
        };
        named.push((&param.name.text, found.unwrap_or_else(|| param.name.text.clone())));
    }
    template.example(|slot| {
        let word = named.iter().find(|(name, _)| *name == slot);
        word.map_or_else(|| slot.to_owned(), |(_, word)| word.clone())
    })
}
