//! Parts of a file that are written in the language, read by its parser: calls, conditions, signatures.

use std::collections::BTreeMap;

use serde_json::Value;

use super::super::{Decides, Error, Role};
use super::error::Unread;
use crate::language::ast::{Allen, Call, Expr, ExprKind, Item, Param, Remedy, Span, Step};
use crate::language::parse;

/// The parameters of what is called: `"lift(o: Graspable, by: Length = 12 cm)"`.
pub(super) fn signatures(value: &Value, key: &str) -> Result<BTreeMap<String, Vec<Param>>, Error> {
    let all = value[key].as_array().into_iter().flatten().filter_map(Value::as_str);
    let each = all.map(|said| {
        let (mut program, wrong_parts) = parse(&format!("fluent {said} = true"));
        match program.items.pop() {
            Some(Item::Fluent(item)) if wrong_parts.is_empty() => Ok((item.name.text, item.params)),
            _ => Err(Error::Exchange(Unread::Signature(said.to_owned()))),
        }
    });
    each.collect()
}

pub(super) fn decides(word: &str) -> Result<Decides, Error> {
    Ok(match word.split_once(' ') {
        Some(("argument", name)) => Decides::Argument(name.to_owned()),
        Some(("if", condition)) => Decides::Condition(expr(condition)?),
        Some(("until", condition)) => Decides::Repetition(expr(condition)?),
        None if word == "choice" => Decides::Choice,
        None if word == "failure" => Decides::Recovery,
        _ => return Err(Error::Exchange(Unread::Decides(word.to_owned()))),
    })
}

pub(super) fn allen(word: &str) -> Result<Allen, Error> {
    use Allen::{Before, During, Equals, Finishes, Meets, Overlaps, Starts};
    let all = [Before, Meets, Overlaps, Starts, During, Finishes, Equals];
    let found = all.into_iter().find(|relation| crate::language::text::allen(*relation) == word);
    found.ok_or_else(|| Error::Exchange(Unread::Allen(word.to_owned())))
}

pub(super) fn role(word: &str) -> Result<Role, Error> {
    use Role::{Checks, Gives, Guard, Keeps, Needs, Until};
    let all = [Needs, Keeps, Gives, Checks, Until, Guard];
    let found = all.into_iter().find(|role| role.word() == word);
    found.ok_or_else(|| Error::Exchange(Unread::Role(word.to_owned())))
}

/// Reads a condition or a value as the language writes it.
pub(super) fn expr(said: &str) -> Result<Expr, Error> {
    let (mut program, wrong_parts) = parse(&format!("fluent f() = {said}"));
    match program.items.pop() {
        Some(Item::Fluent(fluent))
            if wrong_parts.is_empty() && fluent.body.kind != ExprKind::Bad =>
        {
            Ok(fluent.body)
        }
        _ => Err(Error::Exchange(Unread::Expr(said.to_owned()))),
    }
}

pub(super) fn call(said: &str) -> Result<Call, Error> {
    let (mut program, wrong_parts) = parse(said);
    match program.items.pop() {
        Some(Item::Run(Step::Act(act))) if wrong_parts.is_empty() => Ok(act.call),
        // `on failure of grasp`: any call of it.
        _ if is_name(said) => {
            let name = crate::language::ast::Name { text: said.to_owned(), span: Span::default() };
            Ok(Call { name, args: Vec::new(), span: Span::default() })
        }
        _ => Err(Error::Exchange(Unread::Call(said.to_owned()))),
    }
}

fn is_name(said: &str) -> bool {
    !said.is_empty() && said.chars().all(|c| c.is_alphanumeric() || c == '_')
}

pub(super) fn remedy(said: &str) -> Result<Remedy, Error> {
    let (mut program, _) = parse(&format!("task t() {{ on failure {{ {said} }} }}"));
    match program.items.pop() {
        Some(Item::Task(mut task)) => task.recoveries.pop().and_then(|recovery| recovery.remedy),
        _ => None,
    }
    .ok_or_else(|| Error::Exchange(Unread::Remedy(said.to_owned())))
}
