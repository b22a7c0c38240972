//! Sentences → calls: "Pour water from the transparent jar into the blue cup" → `pour(jar, cup)`.
//!
//! The shape of a sentence is matched first, by the `say` templates of tasks and by phrases a person has
//! taught; then each slot is resolved to an object, a face or a quantity. A sentence of several wishes, "pick up the
//! jar, then put it down", is as many calls, one after the other (`sequence`). So what is not understood has a
//! reason: no such sentence, no such object, or two of them. Nothing is guessed, and what comes out has
//! been parsed and checked like anything typed.
//!
//! Source of clear, ambiguous and impossible: Park et al., "CLARA", 2023 (arXiv 2306.10376).

mod describe;
mod knowledge;
mod relation;
mod resolve;
mod sequence;
mod template;

use std::collections::BTreeMap;

use super::ast::{Call, Param, SceneItem, Span, Step};
use super::builtins::{self, Ty};
use super::diagnostic::Source;
use super::library::Scope;
use super::parse::parse_line;
use super::text;
use knowledge::either;
pub use knowledge::{Knowledge, Phrase, Spot, Thing};
use resolve::{Found, Hindrance};
pub use template::{Reach, Template, Wrong};

/// Words that say how a wish is meant and not what is wished, at the edges of a sentence.
const POLITE: &[&str] = &[
    "please",
    "kindly",
    "now",
    "then",
    "first",
    "next",
    "finally",
    "and",
    "robot",
    "hey",
    "ok",
    "okay",
    "thanks",
    "just",
    "so",
    "well",
    "could you",
    "can you",
    "would you",
    "will you",
    "i want you to",
    "i would like you to",
    "thank you",
    "for me",
    "go ahead and",
    "let us",
    "let's",
];

/// How many readings of an ambiguous sentence are offered.
const MOST_CHOICES: usize = 4;

/// What a sentence comes to.
#[derive(Debug, Clone, PartialEq)]
pub enum Meaning {
    /// One call.
    Clear(Understood),
    /// Several; a person has to say which.
    Ambiguous {
        /// Which `cup`: blue cup or red cup?
        question: String,
        /// The calls, at most four.
        choices: Vec<Understood>,
    },
    /// The wish is understood and cannot be met.
    Impossible {
        /// One sentence.
        why: String,
        /// What would help.
        help: Option<String>,
    },
    /// No sentence like it is known.
    Unknown {
        /// What would help.
        help: String,
    },
}

/// What a sentence means, and why: a call, or several that follow each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Understood {
    /// As typed at the prompt: `pick(jar) then place(jar)`.
    pub text: String,
    /// The calls, one at least.
    pub calls: Vec<Call>,
    /// The template that fits; of several calls, each one's.
    pub template: String,
    /// What each slot stands for: slot, words, value.
    pub slots: Vec<(String, String, String)>,
    /// What the sentence does not say and the task fills in: `amount: filled(source)`.
    pub defaults: Vec<String>,
}

/// Returns the things of a scene as sentences may name them.
pub fn things(scene: &SceneItem) -> Vec<Thing> {
    scene.things.iter().map(Thing::of).collect()
}

/// Returns a sentence in lower case with one blank between words, without marks at the ends of words and
/// without politeness at its edges.
pub fn words(sentence: &str) -> String {
    let lower = sentence.to_lowercase();
    let cleaned: Vec<&str> = lower
        .split_whitespace()
        .map(|word| {
            word.trim_matches(|c: char| matches!(c, '.' | ',' | '!' | '?' | ';' | ':' | '"'))
        })
        .filter(|word| !word.is_empty())
        .collect();
    let mut rest = cleaned.join(" ");
    loop {
        let before = rest.len();
        for polite in POLITE {
            if let Some(after) = rest.strip_prefix(polite)
                && after.starts_with(' ')
            {
                rest = after.trim_start().to_owned();
            }
            if let Some(head) = rest.strip_suffix(polite)
                && head.ends_with(' ')
            {
                rest = head.trim_end().to_owned();
            }
        }
        if rest.len() == before {
            return rest;
        }
    }
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
    match one(&said, with) {
        whole @ (Meaning::Clear(_) | Meaning::Ambiguous { .. }) => whole,
        whole => sequence::understand(&said, with).unwrap_or(whole),
    }
}

/// Reads a sentence as one wish; `said` as [`words`] makes it. Of its ways to be read the first that is a call counts.
fn one(said: &str, with: &Knowledge<'_>) -> Meaning {
    let mut hindrances: Vec<Hindrance> = Vec::new();
    for reading in relation::readings(said) {
        for reach in [Reach::Short, Reach::Long] {
            let (calls, question) = calls(&reading, reach, with, &mut hindrances);
            if !calls.is_empty() {
                return conclude(calls, question, with);
            }
        }
    }
    match hindrances.into_iter().rev().max_by_key(|hindrance| hindrance.after) {
        Some(Hindrance { why, help, .. }) => Meaning::Impossible { why, help },
        None => Meaning::Unknown { help: nearest_sentence(said, with) },
    }
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
    // What has been taught goes before what was there.
    if readings.is_empty() && hindrances.len() == before {
        for (task, _) in with.library.tasks() {
            for say in &task.say {
                let Ok(template) = Template::read(&say.text) else { continue };
                let slots = template.fit(said, reach);
                let Some(slots) = slots.filter(|slots| !slots.values().any(is_broken)) else {
                    continue;
                };
                let reading = filled(&task.name.text, &task.params, &template, &slots, with);
                collect(reading, &mut readings, hindrances, &mut question);
            }
        }
    }
    (readings, question)
}

/// What one template makes of a sentence.
enum Reading {
    Calls(Vec<Understood>, Option<String>),
    Hindered(Hindrance),
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
    if readings.len() > 1 {
        // A reading that cannot be done now is not what was meant, if another can be.
        let able = |reading: &Understood| hindrance(reading, with).is_none();
        let possible: Vec<Understood> = readings.iter().filter(|r| able(r)).cloned().collect();
        if !possible.is_empty() {
            readings = possible;
        }
    }
    if readings.len() == 1 {
        let reading = readings.swap_remove(0);
        return match hindrance(&reading, with) {
            Some(why) => Meaning::Impossible { why, help: None },
            None => Meaning::Clear(reading),
        };
    }
    readings.truncate(MOST_CHOICES);
    let question = question.unwrap_or_else(|| "which of these?".into());
    Meaning::Ambiguous { question, choices: readings }
}

/// Says why a reading cannot be done now: its first call, for the others follow what it does.
fn hindrance(reading: &Understood, with: &Knowledge<'_>) -> Option<String> {
    reading.calls.first().and_then(|call| (with.hindrance)(call))
}

/// Returns whether words name a thing that is here, whatever its kind.
fn names_a_thing(said: &str, slot: &str, with: &Knowledge<'_>) -> bool {
    resolve::resolve(said, &Ty::Object(builtins::OBJECT.to_owned()), slot, with).is_ok()
}

/// Fills a task's parameters with what the slots hold.
fn filled(
    name: &str,
    params: &[Param],
    template: &Template,
    slots: &BTreeMap<String, String>,
    with: &Knowledge<'_>,
) -> Reading {
    let mut ways: Vec<Vec<(String, String, String)>> = vec![Vec::new()];
    for (i, param) in params.iter().enumerate() {
        let ty = Ty::named(&param.ty.text);
        let slot = param.name.text.as_str();
        let (said, found) = match slots.get(slot) {
            Some(said) => match resolve::resolve(said, &ty, slot, with) {
                Ok(found) => (said.as_str(), found),
                Err(hindrance) => {
                    // Words that name a thing are no amount badly said: another sentence was meant.
                    let after = if names_a_thing(said, slot, with) { 0 } else { i };
                    return Reading::Hindered(Hindrance { after, ..hindrance });
                }
            },
            // What nobody said, and what has to be: anything that fits.
            None if param.default.is_none() => ("", resolve::unsaid(&ty, with)),
            None => continue,
        };
        ways = ways.iter().flat_map(|way| extend(way, slot, said, &found)).collect();
        ways.truncate(64);
    }
    // Nobody pours a jar into itself, unless there is only one thing it can be.
    let different = |way: &Vec<(String, String, String)>| {
        way.iter().enumerate().all(|(i, (_, _, value))| way[..i].iter().all(|w| w.2 != *value))
    };
    if ways.len() > 1 && ways.iter().any(different) {
        ways.retain(different);
    }
    let question = which(&ways, with);
    for way in &mut ways {
        if let Err(hindrance) = of_a_whole(way, params) {
            return Reading::Hindered(hindrance);
        }
    }
    let calls: Vec<Result<Understood, Hindrance>> = ways
        .into_iter()
        .map(|way| {
            // What may be left out is named, so that it is seen what it is.
            let bare = params.iter().take_while(|param| param.default.is_none()).count();
            let args = params.iter().enumerate().filter_map(|(i, param)| {
                let (_, _, value) = way.iter().find(|(slot, ..)| *slot == param.name.text)?;
                let text =
                    if i < bare { value.clone() } else { format!("{}: {value}", param.name.text) };
                Some(text)
            });
            let line = format!("{name}({})", args.collect::<Vec<_>>().join(", "));
            let missing = params.iter().filter(|p| way.iter().all(|(s, ..)| *s != p.name.text));
            let defaults = missing.filter_map(|param| {
                let value = text::expr(param.default.as_ref()?);
                Some(format!("{}: {value}", param.name.text))
            });
            let unsaid = way.iter().filter(|(_, said, _)| said.is_empty());
            let unsaid = unsaid.map(|(slot, _, value)| format!("{slot}: {value}"));
            let defaults: Vec<String> = unsaid.chain(defaults).collect();
            let way = way.iter().filter(|(_, said, _)| !said.is_empty()).cloned().collect();
            checked(line, &template.text, way, defaults, with)
        })
        .collect();
    readings(calls, question)
}

/// Asks for the first slot in which readings differ.
fn which(ways: &[Vec<(String, String, String)>], with: &Knowledge<'_>) -> Option<String> {
    let first = ways.first()?;
    let (at, (slot, said, _)) = first
        .iter()
        .enumerate()
        .find(|(at, (_, _, value))| ways.iter().any(|way| way[*at].2 != *value))?;
    let mut names: Vec<&str> = Vec::new();
    for way in ways {
        let value = relation::of(&way[at].2);
        let thing = with.things.iter().find(|thing| thing.name == value);
        let name = thing.map_or(value, Thing::shown);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let what = if said.is_empty() { slot } else { said };
    let (before, what) = relation::split(what);
    Some(format!("{before}which {}: {}?", relation::spoken(what), either(&names)))
}

/// Puts the whole into what was said as a part of it: half of `filled(source)` is `filled(jar) / 2`.
fn of_a_whole(way: &mut [(String, String, String)], params: &[Param]) -> Result<(), Hindrance> {
    let known: BTreeMap<String, String> =
        way.iter().map(|(slot, _, value)| (slot.clone(), value.clone())).collect();
    for (slot, said, value) in way {
        if !value.contains(resolve::WHOLE) {
            continue;
        }
        let param = params.iter().find(|param| param.name.text == *slot);
        let Some(whole) = param.and_then(|param| param.default.as_ref()) else {
            let why = format!("\"{said}\" needs a whole, and `{slot}` has none");
            return Err(Hindrance::new(why, Some("say a number with its unit".into())));
        };
        let mut written = String::new();
        for word in text::expr(whole).split_inclusive(|c: char| !c.is_alphanumeric() && c != '_') {
            let name = word.trim_end_matches(|c: char| !c.is_alphanumeric() && c != '_');
            let rest = &word[name.len()..];
            written += known.get(name).map_or(name, String::as_str);
            written += rest;
        }
        *value = value.replace(resolve::WHOLE, &written);
    }
    Ok(())
}

fn extend(
    way: &[(String, String, String)],
    slot: &str,
    said: &str,
    found: &[Found],
) -> Vec<Vec<(String, String, String)>> {
    let each = found.iter().map(|found| {
        let mut way = way.to_vec();
        way.push((slot.to_owned(), said.to_owned(), found.value.clone()));
        way
    });
    each.collect()
}

/// Fills a taught phrase's call with what the slots hold.
fn taught(phrase: &Phrase, slots: &BTreeMap<String, String>, with: &Knowledge<'_>) -> Reading {
    let Some((callable, _)) = with.library.callable(&phrase.call.name.text) else {
        let why = format!("there is no task or action `{}` any more", phrase.call.name.text);
        return Reading::Hindered(Hindrance::new(why, Some("teach the phrase anew".into())));
    };
    // A slot takes the type of the parameter it is given to.
    let params = callable.params();
    let mut ways: Vec<Vec<(String, String, String)>> = vec![Vec::new()];
    let mut question = None;
    for (i, arg) in phrase.call.args.iter().enumerate() {
        let param = match &arg.name {
            Some(name) => params.iter().find(|p| p.name.text == name.text),
            None => params.get(i),
        };
        let Some((slot, said)) =
            arg.values.first().and_then(|value| slots.get_key_value(&text::expr(value)))
        else {
            continue;
        };
        let ty = param.map_or(Ty::Any, |param| Ty::named(&param.ty.text));
        let found = match resolve::resolve(said, &ty, slot, with) {
            Ok(found) => found,
            Err(hindrance) => return Reading::Hindered(hindrance),
        };
        if found.len() > 1 {
            let names: Vec<&str> = found.iter().map(|found| found.shown.as_str()).collect();
            question = question.or_else(|| Some(format!("which {said}: {}?", either(&names))));
        }
        ways = ways.iter().flat_map(|way| extend(way, slot, said, &found)).collect();
        ways.truncate(64);
    }
    let calls = ways.into_iter().map(|way| {
        let args = phrase.call.args.iter().map(|arg| {
            let values = arg.values.iter().map(|value| {
                let written = text::expr(value);
                let found = way.iter().find(|(slot, ..)| *slot == written);
                found.map_or(written, |(_, _, value)| value.clone())
            });
            let values = values.collect::<Vec<_>>().join(" | ");
            match &arg.name {
                Some(name) => format!("{}: {values}", name.text),
                None => values,
            }
        });
        let args = args.collect::<Vec<_>>().join(", ");
        let line = format!("{}({args})", phrase.call.name.text);
        checked(line, &phrase.template.text, way.clone(), Vec::new(), with)
    });
    readings(calls.collect(), question)
}

fn readings(calls: Vec<Result<Understood, Hindrance>>, question: Option<String>) -> Reading {
    let mut good = Vec::new();
    let mut first = None;
    for call in calls {
        match call {
            Ok(call) => good.push(call),
            Err(wrong) => first = first.or(Some(wrong)),
        }
    }
    match (good.is_empty(), first) {
        (true, Some(hindrance)) => Reading::Hindered(hindrance),
        _ => Reading::Calls(good, question),
    }
}

/// Reads a call that was put together as if it had been typed.
fn checked(
    line: String,
    template: &str,
    slots: Vec<(String, String, String)>,
    defaults: Vec<String>,
    with: &Knowledge<'_>,
) -> Result<Understood, Hindrance> {
    let (step, mut wrong) = parse_line(&line);
    let objects = with.things.iter().map(|thing| (thing.name.clone(), thing.kind.clone()));
    let scope = Scope { objects: objects.collect() };
    if let Some(step) = &step {
        wrong.extend(with.library.check_step(step, &Source::new("sentence", line.clone()), &scope));
    }
    if let Some(wrong) = wrong.into_iter().find(super::Diagnostic::is_error) {
        return Err(Hindrance::new(wrong.message, wrong.help));
    }
    match step {
        Some(Step::Act(act)) => Ok(Understood {
            text: line,
            calls: vec![Call { span: Span::default(), ..act.call }],
            template: template.to_owned(),
            slots,
            defaults,
        }),
        _ => Err(Hindrance::new(format!("`{line}` is no call"), None)),
    }
}

/// Returns an example of the known sentence that shares most words with what was said.
fn nearest_sentence(said: &str, with: &Knowledge<'_>) -> String {
    let spoken: Vec<&str> = said.split(' ').collect();
    let mut best: Option<(usize, String)> = None;
    for (task, _) in with.library.tasks() {
        for say in &task.say {
            let Ok(template) = Template::read(&say.text) else { continue };
            let example = example(&template, &task.params, with);
            let known: Vec<&str> = example.split(' ').collect();
            let shared = spoken.iter().filter(|word| known.contains(*word)).count();
            if best.as_ref().is_none_or(|(most, _)| shared > *most) {
                best = Some((shared, example));
            }
        }
    }
    match best {
        Some((shared, example)) if shared > 0 => format!("say it like \"{example}\""),
        Some((_, example)) => format!("a sentence that is known: \"{example}\""),
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
