//! What the words of the language and its units say, in a line or two.

use crate::units::{Dimension, UNITS};

/// The words that start a step or a clause, and those that follow one.
pub(super) const STARTERS: &[&str] = &[
    "either",
    "if",
    "repeat",
    "for",
    "together",
    "check",
    "let",
    "break",
    "needs",
    "keeps",
    "gives",
    "say",
    "limit",
    "on failure",
];

/// The words that start an item.
pub(super) const ITEMS: &[&str] =
    &["task", "action", "fluent", "type", "scene", "twin", "model", "import"];

/// Returns what a word of the language says.
pub(super) fn keyword(word: &str) -> Option<&'static str> {
    Some(match word {
        "task" => "task name(parameters) { … }\nSomething to do, made of steps.",
        "action" => {
            "action name(parameters) { … run \"script.rhai\" }\nOne thing the robot does, by one script."
        }
        "fluent" => {
            "fluent name(parameters) = condition\nSomething that can be true, with a margin."
        }
        "type" => "type Name: Parent\nA kind of thing on the table.",
        "import" => {
            "import \"file\"\nDefinitions of another `.task` file, or a script for the actions here."
        }
        "scene" => "scene name { … }\nWhat stands on the table, the camera and the robot.",
        "twin" => "twin name of scene { … }\nThe effects that the simulation knows.",
        "model" => "model name { … }\nEquations: inputs, states, outputs.",
        "needs" => "needs condition\nMust hold before.",
        "keeps" => "keeps condition\nMust hold all the time.",
        "gives" => "gives condition\nHolds afterwards; whatever is not named stays as it was.",
        "either" => {
            "either a prior 0.7 when condition { … } or b { … }\nOne of several named ways."
        }
        "or" => "or\nThe next way of a choice, or one of two conditions.",
        "prior" => "prior 0.7\nHow likely people take this way.",
        "when" => "when condition\nThe way is possible only when this holds.",
        "if" => "if condition { … } else { … }\nDecided by the condition, never learnt.",
        "else" => "else { … }\nDone when the condition is false.",
        "repeat" => {
            "repeat upto 3 times { … } until condition\nDone again until the condition holds, at most so often."
        }
        "for" | "in" => {
            "for o in Type when condition { … }\nOnce for every thing of a type in the scene."
        }
        "upto" | "times" => "repeat upto 3 times { … }\nEvery loop has an end.",
        "together" => {
            "together { … timing a overlaps b by 300 ms }\nSteps at the same time, related by `timing`."
        }
        "timing" => {
            "timing a before b by 1 s\nHow two labelled steps lie in time: before, meets, overlaps, starts, during, finishes, equals."
        }
        "check" => "check condition\nAsks, records the answer, and fails when it is no.",
        "let" => "let name = value\nGives a value a name for the steps that follow.",
        "while" => {
            "step while condition\nMust hold during the step; when it does not, the step is stopped and has failed."
        }
        "until" => "step until condition\nEnds the step when it becomes true.",
        "then" => "a() then b()\nOne after the other.",
        "as" => "step as name\nA label, for `timing` and for breakpoints.",
        "via" => "pick(jar) via from_above\nThe branch to take inside a call, whatever is learnt.",
        "break" => "break when condition\nStepping stops before the next step.",
        "on" | "failure" => {
            "on failure of step(…) { … retry other upto 2 times }\nWhat is done when a step fails."
        }
        "retry" => "retry [other] [upto 2 times]\nThe same again, or a branch not yet tried.",
        "other" => "retry other\nA branch that has not been tried.",
        "abort" => "abort \"why\"\nGives up, and says why.",
        "say" => "say \"(pick|grab) [up] [the] {o}\"\nA sentence that means this task.",
        "ask" => "ask \"Is the {o} level?\"\nThe question whose answer the fluent is.",
        "run" => "run \"script.rhai\"\nThe script of an action.",
        "limit" => "limit 20 s\nThe time it may take.",
        "within" => "a == b within 5 mm\nHow close is close enough.",
        "was" => "#[was(\"old\")]\nThe name it had; what was learnt under it goes on counting.",
        "and" => "a and b\nBoth; as good as the worse of them.",
        "not" => "not a\nThe contrary.",
        _ => return None,
    })
}

/// Returns what a unit measures.
pub(super) fn unit(word: &str) -> Option<String> {
    let (unit, _, dimension) = UNITS.iter().find(|(unit, ..)| *unit == word)?;
    Some(format!("{unit}: {}", dimension.words()))
}

/// Returns the units of a dimension.
pub(super) fn units(dimension: Dimension) -> impl Iterator<Item = &'static str> {
    UNITS.iter().filter(move |(_, _, d)| *d == dimension).map(|(unit, ..)| *unit)
}
