//! Steps and blocks as text.
//!
//! One writing serves both shapes: each step of a block stands on a line of its own, and a step on one line
//! is the same with blanks for the line breaks, since line breaks mean nothing.

use std::fmt::Write as _;

use super::super::ast::{
    Act, Block, Call, Conditions, Expr, Hold, If, Name, Recovery, Remedy, Step, Text,
};
use super::{allen, call, expr, quantity, quoted};

/// Returns a step and all it holds, on one line.
pub fn step(step: &Step) -> String {
    on_one_line(&lines(step))
}

/// Returns `{ steps }` with its recoveries and holds, on one line.
pub fn block(block: &Block) -> String {
    on_one_line(&block_lines(block))
}

/// Returns `on failure of … { … }` on one line.
pub fn recovery(recovery: &Recovery) -> String {
    on_one_line(&recovery_lines(recovery))
}

/// Returns `retry other upto 2 times` or `abort "why"`.
pub fn remedy(remedy: &Remedy) -> String {
    match remedy {
        Remedy::Retry { other, times } => {
            let other = if *other { "other " } else { "" };
            format!("retry {other}upto {times} times")
        }
        Remedy::Abort(Some(why)) => format!("abort {}", quoted(why)),
        Remedy::Abort(None) => String::from("abort"),
    }
}

/// Returns `needs … keeps … gives …` on one line.
pub fn conditions(conditions: &Conditions) -> String {
    clauses(conditions).join(" ")
}

/// Returns `needs …`, `keeps …`, `gives …`, each a text of its own.
pub(super) fn clauses(conditions: &Conditions) -> Vec<String> {
    let Conditions { needs, keeps, gives } = conditions;
    let all = [("needs", needs), ("keeps", keeps), ("gives", gives)];
    let each = all.iter().flat_map(|(word, all)| all.iter().map(move |e| (word, e)));
    each.map(|(word, e)| format!("{word} {}", expr(e))).collect()
}

/// Returns `#[was("old")]` for each name something had before.
pub(super) fn was(names: &[Text]) -> Vec<String> {
    names.iter().map(|old| format!("#[was({})]", quoted(&old.text))).collect()
}

/// A text in quotes never holds a line break, so every one of these is between two tokens.
fn on_one_line(lines: &str) -> String {
    lines.replace('\n', " ")
}

/// Returns `{`, each part on a line of its own, `}`.
pub(super) fn braced(parts: &[String]) -> String {
    let parts: String = parts.iter().flat_map(|part| [part.as_str(), "\n"]).collect();
    format!("{{\n{parts}}}")
}

/// Returns a step with a line break wherever a person would have one; nothing is indented.
pub(super) fn lines(step: &Step) -> String {
    match step {
        Step::Act(Act { call: what, via, holds: all, label, .. }) => {
            let via: Vec<&str> = via.iter().map(|branch| branch.text.as_str()).collect();
            let via =
                if via.is_empty() { String::new() } else { format!(" via {}", via.join(", ")) };
            format!("{}{via}{}{}", call(what), holds(all), labelled(label.as_ref()))
        }
        Step::Sequence(all, _) => all.iter().map(lines).collect::<Vec<_>>().join(" then "),
        Step::Block(all) => block_lines(all),
        Step::Either(either) => {
            let mut text = String::from("either");
            for (i, branch) in either.branches.iter().enumerate() {
                text += if i == 0 { "" } else { "\nor" };
                for old in was(&branch.was) {
                    let _ = write!(text, " {old}");
                }
                let _ = write!(text, " {}", branch.name.text);
                if let Some(prior) = branch.prior {
                    let _ = write!(text, " prior {prior}");
                }
                if let Some(when) = &branch.when {
                    let _ = write!(text, " when {}", expr(when));
                }
                let _ = write!(text, " {}", block_lines(&branch.block));
            }
            text
        }
        Step::If(step) => decided(step),
        Step::Repeat(repeat) => {
            let block = block_lines(&repeat.block);
            let mut text = format!("repeat upto {} times {block}", repeat.times);
            if let Some(until) = &repeat.until {
                let _ = write!(text, " until {}", expr(until));
            }
            text
        }
        Step::Each(each) => {
            let when = each.when.as_ref().map(|when| format!(" when {}", expr(when)));
            let (name, kind) = (&each.name.text, &each.kind.text);
            let when = when.unwrap_or_default();
            format!("for {name} in {kind}{when} {}", block_lines(&each.block))
        }
        Step::Together(together) => {
            let mut parts: Vec<String> = together.steps.iter().map(lines).collect();
            parts.extend(together.timings.iter().map(|timing| {
                let (a, b) = (&timing.a.text, &timing.b.text);
                let by = timing.by.map(|by| format!(" by {}", quantity(by.quantity)));
                let by = by.unwrap_or_default();
                format!("timing {a} {} {b}{by}", allen(timing.relation))
            }));
            format!("together {}", braced(&parts))
        }
        Step::Check(what, _) => format!("check {}", expr(what)),
        Step::Break(stop) => match &stop.when {
            Some(when) => format!("break when {}", expr(when)),
            None => String::from("break"),
        },
        Step::Let(name, what, _) => format!("let {} = {}", name.text, expr(what)),
        Step::Bad(_) => String::from("?"),
    }
}

/// `else if` is an `else` whose block is one `if` and nothing beside it.
fn decided(step: &If) -> String {
    let mut text = format!("if {} {}", expr(&step.condition), block_lines(&step.then));
    match &step.otherwise {
        None => {}
        Some(Block { steps, recoveries, holds, label: None, .. })
            if recoveries.is_empty() && holds.is_empty() && matches!(steps[..], [Step::If(_)]) =>
        {
            let _ = write!(text, " else {}", lines(&steps[0]));
        }
        Some(block) => {
            let _ = write!(text, " else {}", block_lines(block));
        }
    }
    text
}

pub(super) fn block_lines(block: &Block) -> String {
    let parts = block.steps.iter().map(lines).chain(block.recoveries.iter().map(recovery_lines));
    let parts: Vec<String> = parts.collect();
    format!("{}{}{}", braced(&parts), holds(&block.holds), labelled(block.label.as_ref()))
}

pub(super) fn recovery_lines(recovery: &Recovery) -> String {
    let parts = recovery.steps.iter().map(lines).chain(recovery.remedy.as_ref().map(remedy));
    let parts: Vec<String> = parts.collect();
    format!("{} {}", on_failure(recovery.of.as_ref()), braced(&parts))
}

/// Returns `on failure`, `on failure of grasp` or `on failure of grasp(jar)`.
pub fn on_failure(of: Option<&Call>) -> String {
    match of {
        None => String::from("on failure"),
        // Of any call of it.
        Some(of) if of.args.is_empty() => format!("on failure of {}", of.name.text),
        Some(of) => format!("on failure of {}", call(of)),
    }
}

fn labelled(label: Option<&Name>) -> String {
    label.map(|label| format!(" as {}", label.text)).unwrap_or_default()
}

fn holds(holds: &[Hold]) -> String {
    holds.iter().fold(String::new(), |mut text, hold| {
        let (word, what): (&str, &Expr) = match hold {
            Hold::While(e) => ("while", e),
            Hold::Until(e) => ("until", e),
        };
        let _ = write!(text, " {word} {}", expr(what));
        text
    })
}
