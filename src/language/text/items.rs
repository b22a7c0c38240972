//! Types, fluents, actions, tasks and lines of a script as text, laid out.

use super::super::ast::{ActionItem, FluentItem, Name, Param, Step, TaskItem, Text, TypeItem};
use super::super::format;
use super::steps::{braced, clauses, lines, recovery_lines, was};
use super::{expr, quantity, quoted};

/// Returns `type Container: Graspable`.
pub fn object_type(item: &TypeItem) -> String {
    let parents: Vec<&str> = item.parents.iter().map(|parent| parent.text.as_str()).collect();
    let parents =
        if parents.is_empty() { String::new() } else { format!(": {}", parents.join(", ")) };
    format(&format!("{}type {}{parents}", documented(&item.doc), item.name.text))
}

/// Returns `fluent holding(o: Graspable) = … ask "…"`.
pub fn fluent(item: &FluentItem) -> String {
    let ask = item.ask.as_ref().map(|ask| format!("\nask {}", quoted(&ask.text)));
    let head = head("fluent", &item.name, &item.params);
    let body = expr(&item.body);
    format(&format!("{}{head} =\n{body}{}", documented(&item.doc), ask.unwrap_or_default()))
}

/// Returns `action grasp(o: Graspable) { needs … run "…" }`.
pub fn action(item: &ActionItem) -> String {
    let mut parts = said(&item.say);
    parts.extend(clauses(&item.conditions));
    parts.extend(item.script.as_ref().map(|(script, _)| format!("run {}", quoted(script))));
    parts.extend(item.limit.map(|limit| format!("limit {}", quantity(limit.quantity))));
    let head = head("action", &item.name, &item.params);
    before(&item.doc, &was(&item.was), &format!("{head} {}", braced(&parts)))
}

/// Returns `task pick(o: Graspable) { … }`.
pub fn task(item: &TaskItem) -> String {
    let mut parts = said(&item.say);
    parts.extend(clauses(&item.conditions));
    parts.extend(item.limit.map(|limit| format!("limit {}", quantity(limit.quantity))));
    parts.extend(item.steps.iter().map(lines));
    parts.extend(item.recoveries.iter().map(recovery_lines));
    let head = head("task", &item.name, &item.params);
    before(&item.doc, &was(&item.was), &format!("{head} {}", braced(&parts)))
}

fn said(say: &[Text]) -> Vec<String> {
    say.iter().map(|say| format!("say {}", quoted(&say.text))).collect()
}

/// Returns a step at the top level of a script.
pub fn line(step: &Step) -> String {
    format(&lines(step))
}

fn before(doc: &[String], was: &[String], item: &str) -> String {
    let was: String = was.iter().flat_map(|old| [old.as_str(), "\n"]).collect();
    format(&format!("{}{was}{item}", documented(doc)))
}

fn documented(doc: &[String]) -> String {
    doc.iter().map(|line| format!("/// {line}").trim_end().to_owned() + "\n").collect()
}

fn head(word: &str, name: &Name, params: &[Param]) -> String {
    format!("{word} {}", super::super::assist::signature(&name.text, params))
}
