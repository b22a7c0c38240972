//! Sentences → calls: "Pour water from the transparent jar into the blue cup" → `pour(jar, cup)`.
//!
//! The shape of a sentence is matched first, by the `say` templates of tasks and by phrases a person has
//! taught; then each slot is resolved to an object, a face or a quantity. So what is not understood has a
//! reason: no such sentence, no such object, or two of them. Nothing is guessed, and what comes out has
//! been parsed and checked like anything typed.
//!
//! Source of clear, ambiguous and impossible: Park et al., "CLARA", 2023 (arXiv 2306.10376).

mod resolve;
mod template;

use std::collections::BTreeMap;

use super::ast::{Call, Param, SceneItem, Span, Step};
use super::builtins::Ty;
use super::diagnostic::Source;
use super::library::{Library, Scope};
use super::parse::parse_line;
use super::text;
pub use resolve::Thing;
use resolve::{Found, Hindrance};
pub use template::{Template, Wrong};

/// Words that say how a wish is meant and not what is wished, at the edges of a sentence.
const POLITE: &[&str] = &[
    "please",
    "kindly",
    "now",
    "then",
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

/// A call that a sentence means, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Understood {
    /// The call as typed at the prompt.
    pub text: String,
    /// The call.
    pub call: Call,
    /// The template that fits.
    pub template: String,
    /// What each slot stands for: slot, words, value.
    pub slots: Vec<(String, String, String)>,
    /// What the sentence does not say and the task fills in: `amount: filled(source)`.
    pub defaults: Vec<String>,
}

/// A sentence that a person has taught, and the call it stands for: `"empty the {o}" = pour(o, cup)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Phrase {
    /// The sentence.
    pub template: Template,
    /// The call; a slot's name in it stands for what the slot holds.
    pub call: Call,
}

/// What sentences are read with.
#[derive(Clone, Copy)]
pub struct Knowledge<'a> {
    /// Tasks with their templates.
    pub library: &'a Library,
    /// What is on the table.
    pub things: &'a [Thing],
    /// What has been taught.
    pub phrases: &'a [Phrase],
    /// Says why a call cannot be done now, if somebody knows: which need fails, and by how much.
    pub hindrance: &'a dyn Fn(&Call) -> Option<String>,
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
    let mut readings: Vec<Understood> = Vec::new();
    let mut hindrances: Vec<Hindrance> = Vec::new();
    let mut question = None;
    for phrase in with.phrases {
        if let Some(slots) = phrase.template.fit(&said) {
            let reading = taught(phrase, &slots, with);
            collect(reading, &mut readings, &mut hindrances, &mut question);
        }
    }
    // What has been taught goes before what was there.
    if readings.is_empty() && hindrances.is_empty() {
        for (task, _) in with.library.tasks() {
            for say in &task.say {
                let Ok(template) = Template::read(&say.text) else { continue };
                let Some(slots) = template.fit(&said) else { continue };
                let reading = filled(&task.name.text, &task.params, &template, &slots, with);
                collect(reading, &mut readings, &mut hindrances, &mut question);
            }
        }
    }
    conclude(&said, readings, hindrances, question, with)
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

fn conclude(
    said: &str,
    mut readings: Vec<Understood>,
    hindrances: Vec<Hindrance>,
    question: Option<String>,
    with: &Knowledge<'_>,
) -> Meaning {
    if readings.len() > 1 {
        // A reading that cannot be done now is not what was meant, if another can be.
        let able = |reading: &Understood| (with.hindrance)(&reading.call).is_none();
        let possible: Vec<Understood> = readings.iter().filter(|r| able(r)).cloned().collect();
        if !possible.is_empty() {
            readings = possible;
        }
    }
    match readings.len() {
        0 => match hindrances.into_iter().next() {
            Some(Hindrance { why, help }) => Meaning::Impossible { why, help },
            None => Meaning::Unknown { help: nearest_sentence(said, with) },
        },
        1 => {
            let reading = readings.swap_remove(0);
            match (with.hindrance)(&reading.call) {
                Some(why) => Meaning::Impossible { why, help: None },
                None => Meaning::Clear(reading),
            }
        }
        _ => {
            readings.truncate(MOST_CHOICES);
            let question = question.unwrap_or_else(|| "which of these?".into());
            Meaning::Ambiguous { question, choices: readings }
        }
    }
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
    let mut question = None;
    for param in params {
        let Some(said) = slots.get(&param.name.text) else { continue };
        let ty = Ty::named(&param.ty.text);
        let found = match resolve::resolve(said, &ty, &param.name.text, with.library, with.things) {
            Ok(found) => found,
            Err(hindrance) => return Reading::Hindered(hindrance),
        };
        if found.len() > 1 {
            let names: Vec<&str> = found.iter().map(|found| found.shown.as_str()).collect();
            question = question.or_else(|| Some(format!("which {said}: {}?", either(&names))));
        }
        ways = ways.iter().flat_map(|way| extend(way, &param.name.text, said, &found)).collect();
        ways.truncate(64);
    }
    // Nobody pours a jar into itself, unless there is only one thing it can be.
    let different = |way: &Vec<(String, String, String)>| {
        way.iter().enumerate().all(|(i, (_, _, value))| way[..i].iter().all(|w| w.2 != *value))
    };
    if ways.len() > 1 && ways.iter().any(different) {
        ways.retain(different);
    }
    let calls: Vec<Result<Understood, Hindrance>> = ways
        .into_iter()
        .map(|way| {
            let bare = params.iter().take_while(|p| way.iter().any(|(s, ..)| *s == p.name.text));
            let bare = bare.count();
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
            let defaults: Vec<String> = defaults.collect();
            checked(line, &template.text, way, defaults, with)
        })
        .collect();
    readings(calls, question)
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
        let found = match resolve::resolve(said, &ty, slot, with.library, with.things) {
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
            call: Call { span: Span::default(), ..act.call },
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
            let example = template.example(|slot| {
                let param = task.params.iter().find(|param| param.name.text == slot);
                let thing = param.and_then(|param| {
                    with.things.iter().find(|t| with.library.is_a(&t.kind, &param.ty.text))
                });
                thing.map_or_else(|| slot.to_owned(), |thing| thing.shown().to_owned())
            });
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

/// `a`, `a or b`, `a, b or c`.
fn either(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}
