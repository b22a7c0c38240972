//! `trueup explain CODE`: what a code means, with a wrong and a right example.

use std::fmt::Write as _;

use clap::Args;
use serde_json::json;

use crate::language::codes::{self, Explanation};
use crate::language::nearest;
use crate::report::{Failure, Style};

use crate::report::exit::Exit;

/// Say what the code of a mistake means.
#[derive(Debug, Args)]
pub(super) struct ExplainArgs {
    /// A code such as `task::unit`, or `unit` alone; without one, every code is listed.
    code: Option<String>,
}

/// `trueup explain CODE`.
pub(super) fn explain(args: &ExplainArgs, style: Style) -> Result<Exit, Failure> {
    let Some(code) = &args.code else {
        let all: Vec<&str> = codes::explanations().map(|e| e.code).collect();
        if style.json {
            style.document(&json!({ "codes": all }));
        }
        style.say(all.join("\n"));
        return Ok(Exit::Yes);
    };
    let code = code.trim();
    let Some(found) = codes::explain(code) else {
        let failure = Failure::input("explain::unknown", format!("there is no code `{code}`"));
        let near = nearest(code, codes::explanations().map(|e| e.code));
        return Err(match near {
            Some(near) => failure.help(format!("did you mean `{near}`?")),
            None => failure.help("`trueup explain` lists every code"),
        });
    };
    if style.json {
        let Explanation { code, meaning, wrong, right } = found;
        style.document(&json!({"code": code, "meaning": meaning, "wrong": wrong, "right": right}));
    } else {
        style.say(told(&found));
    }
    Ok(Exit::Yes)
}

fn told(explanation: &Explanation<'_>) -> String {
    let mut text = format!("{}\n\n{}", explanation.code, explanation.meaning);
    let examples = [("wrong", explanation.wrong), ("right", explanation.right)];
    for (word, example) in examples.iter().filter_map(|(word, e)| e.map(|e| (word, e))) {
        let _ = write!(text, "\n\n{word}\n");
        let lines: Vec<String> = example.lines().map(|line| format!("    {line}")).collect();
        text += &lines.join("\n");
    }
    text
}
