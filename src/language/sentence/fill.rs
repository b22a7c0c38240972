//! A template whose slots are filled → calls: each slot's words become a thing, a face or a quantity, each way of reading them a
//! call that is parsed and checked as if typed.
//!
//! Which template fits a sentence, and which reading was meant, is [`super`]'s.

use std::collections::BTreeMap;

use super::super::ast::{Call, Param, Span, Step};
use super::super::builtins::{self, Ty};
use super::super::diagnostic::{Diagnostic, Source};
use super::super::library::Scope;
use super::super::parse::parse_line;
use super::super::text;
use super::knowledge::{Knowledge, Phrase, Thing, either};
use super::meaning::Understood;
use super::resolve::{self, Found, Hindrance};
use super::share::{LEVEL, WHOLE};
use super::template::{Template, Whole};
use super::{describe, relation, shift};

/// What one template makes of a sentence.
pub(super) enum Reading {
    Calls(Vec<Understood>, Option<String>),
    Hindered(Hindrance),
}

/// Returns whether words name a thing that is here, whatever its kind.
fn names_a_thing(said: &str, slot: &str, with: &Knowledge<'_>) -> bool {
    resolve::resolve(said, &Ty::Object(builtins::OBJECT.to_owned()), slot, with).is_ok()
}

/// Fills a task's parameters with what the slots hold.
pub(super) fn filled(
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
                Ok(found) => {
                    if let Some(doubt) = may_be_amount(said, params, slots) {
                        return Reading::Hindered(Hindrance { after: i, ..doubt });
                    }
                    (said.as_str(), found)
                }
                Err(hindrance) => {
                    // Words that name a thing are no amount badly said, nor are they a part: another sentence was meant.
                    let is_other =
                        names_a_thing(said, slot, with) || template.whole(slot).is_some();
                    let after = if is_other { 0 } else { i };
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
    if let Some(doubt) = ways.iter().find_map(|way| named_beside(name, way, with)) {
        return Reading::Hindered(Hindrance { after: params.len(), ..doubt });
    }
    let question = which(&ways, with);
    for way in &mut ways {
        let settled = of_a_whole(way, params, template).and_then(|()| shift::settle(way, with));
        if let Err(hindrance) = settled {
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
            let understood = way.len();
            let way = way.iter().filter(|(_, said, _)| !said.is_empty()).cloned().collect();
            let call = checked(line, &template.text, way, defaults, with);
            call.map_err(|hindrance| Hindrance { after: understood, ..hindrance })
        })
        .collect();
    readings(calls, question)
}

/// Says when what names a thing may be an amount that nobody gave otherwise: "pour one cup".
fn may_be_amount(
    said: &str,
    params: &[Param],
    slots: &BTreeMap<String, String>,
) -> Option<Hindrance> {
    let noun = said.strip_prefix("one ").filter(|noun| *noun != "one")?;
    let is_open = |param: &Param| {
        matches!(Ty::named(&param.ty.text), Ty::Quantity(_))
            && !slots.contains_key(&param.name.text)
    };
    params.iter().any(is_open).then(|| {
        let help = format!("say \"the {noun}\", or an amount with its unit, such as `60 mL`");
        Hindrance::new(format!("\"{said}\" may be a thing or an amount"), Some(help))
    })
}

/// Says when what nobody named for a slot was named beside another: of "pour the jar next to the cup" the cup is no target.
fn named_beside(
    name: &str,
    way: &[(String, String, String)],
    with: &Knowledge<'_>,
) -> Option<Hindrance> {
    let mut unsaid = way.iter().filter(|(_, said, _)| said.is_empty());
    unsaid.find_map(|(slot, _, value)| {
        let mut told = way.iter().filter(|(_, said, _)| !said.is_empty());
        let clause = told.find_map(|(_, said, _)| describe::clause_with(said, value, with))?;
        let why = format!(
            "\"{}\" may tell which is meant, and does not say what `{slot}` is",
            relation::spoken(clause)
        );
        let values: Vec<&str> = way.iter().map(|(.., value)| value.as_str()).collect();
        let help = format!("if that is what is meant, write `{name}({})`", values.join(", "));
        Some(Hindrance::new(why, Some(help)))
    })
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
fn of_a_whole(
    way: &mut [(String, String, String)],
    params: &[Param],
    template: &Template,
) -> Result<(), Hindrance> {
    let known: BTreeMap<String, String> =
        way.iter().map(|(slot, _, value)| (slot.clone(), value.clone())).collect();
    for (slot, said, value) in way {
        if let Some(level) = value.strip_prefix(LEVEL) {
            let Some(less) = template.whole(slot).and_then(|whole| whole.less.as_ref()) else {
                let why = format!("\"{said}\" says how much is there in the end");
                return Err(Hindrance::new(why, Some("say \"fill the cup to 100 mL\"".into())));
            };
            *value = format!("{level} - {}", named(less, &known));
            continue;
        }
        if !value.contains(WHOLE) {
            continue;
        }
        if let Some(Whole { all, less }) = template.whole(slot) {
            *value = value.replace(WHOLE, &named(all, &known));
            if let Some(less) = less {
                *value = format!("{value} - {}", named(less, &known));
            }
            continue;
        }
        let param = params.iter().find(|param| param.name.text == *slot);
        let Some(whole) = param.and_then(|param| param.default.as_ref()) else {
            let why = format!("\"{said}\" needs a whole, and `{slot}` has none");
            return Err(Hindrance::new(why, Some("say a number with its unit".into())));
        };
        *value = value.replace(WHOLE, &named(&text::expr(whole), &known));
    }
    Ok(())
}

/// Puts what slots stand for in the place of their names.
fn named(formula: &str, known: &BTreeMap<String, String>) -> String {
    let mut written = String::new();
    for word in formula.split_inclusive(|c: char| !c.is_alphanumeric() && c != '_') {
        let name = word.trim_end_matches(|c: char| !c.is_alphanumeric() && c != '_');
        written += known.get(name).map_or(name, String::as_str);
        written += &word[name.len()..];
    }
    written
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
pub(super) fn taught(
    phrase: &Phrase,
    slots: &BTreeMap<String, String>,
    with: &Knowledge<'_>,
) -> Reading {
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
    let calls = ways
        .into_iter()
        .map(|way| checked(written(phrase, &way), &phrase.template.text, way, Vec::new(), with));
    readings(calls.collect(), question)
}

/// Writes a taught phrase's call with the values of a way in the place of its slots.
pub(super) fn written(phrase: &Phrase, way: &[(String, String, String)]) -> String {
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
    format!("{}({args})", phrase.call.name.text)
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
pub(super) fn checked(
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
    if let Some(wrong) = wrong.into_iter().find(Diagnostic::is_error) {
        return Err(Hindrance::new(wrong.message, wrong.help));
    }
    match step {
        Some(Step::Act(act)) => Ok(Understood {
            text: line,
            calls: vec![Call { span: Span::default(), ..act.call }],
            template: template.to_owned(),
            slots: slots
                .into_iter()
                .map(|(slot, said, value)| (slot, relation::spoken(&said), value))
                .collect(),
            defaults,
        }),
        _ => Err(Hindrance::new(format!("`{line}` is no call"), None)),
    }
}
