//! Questions → what the prompt is asked: "how much water is in the jar?" → `filled(jar)`, "where is the cup?" → `:objects`.
//!
//! Nothing moves for a question. The sentences that ask are few and fixed, and beside them every fluent's own `ask`:
//! "Is the jar above the cup?" is `above(jar, cup)`.

use super::super::ast::FluentItem;
use super::super::builtins::{self, Ty};
use super::knowledge::{Knowledge, either};
use super::meaning::{Meaning, words};
use super::resolve::{self, Hindrance};
use super::template::{Reach, Template};

/// The slot that stands for a vessel; every other stands for a thing.
const VESSEL: &str = "v";
/// What people ask, and what the prompt is asked then.
const ASKED: &[(&str, &str)] = &[
    ("where (is|are) [the] {o} [now]", ":objects"),
    ("where (is everything|are things|does everything stand)", ":objects"),
    ("what (do|can) you see [now]", ":objects"),
    ("what is [there] [on the table]", ":objects"),
    ("how much [water|juice] is [there] [left] in [the] {v}", "filled({v})"),
    ("how full is [the] {v}", "filled({v})"),
    ("is [the] {v} (full|empty)", "filled({v})"),
    ("is there [any|still] [water|juice] [left] in [the] {v}", "filled({v})"),
    ("how much [water|juice] (is|was) (spilt|spilled)", "spilt()"),
    ("(was|is) anything (spilt|spilled)", "spilt()"),
    (
        "[why] (did|has) (it|you|that|this|anything|something|water|any water|the water) (spill|spilt|spilled) \
         [anything|something|water|any water]",
        "spilt()",
    ),
    (
        "[why] (did|has) [the] {o} (spill|spilt|spilled) [anything|something|water|any water]",
        "spilt()",
    ),
    // "Can you" is politeness, and is gone.
    ("[do you] see [the] {o}", "visible({o})"),
    ("[do you] (reach|get at) [the] {o}", "reachable({o})"),
    ("is [the] {o} within reach", "reachable({o})"),
    ("(are you holding|do you hold|do you have|have you got) [the] {o}", "held({o})"),
    ("is [the] {o} (held|in the hand|in your hand|in the gripper)", "held({o})"),
    ("are you holding anything", "held(any)"),
    ("is [the] {a} (on|in|on top of) [the] {b}", "rests_on({a}, {b})"),
    ("does [the] {a} stand (on|in) [the] {b}", "rests_on({a}, {b})"),
    ("is [the] {o} upright", "upright({o})"),
    ("how far (is|are) [the] {a} (from|and) [the] {b} [apart]", "distance({a}, {b})"),
    ("how (high|high up) is [the] {o}", "height({o})"),
    (
        "why (did|was|has) (it|that|this) [not] (fail|failed|work|worked|go wrong|gone wrong)",
        ":why",
    ),
    ("what (went wrong|happened)", ":why"),
    ("why not", ":why"),
    ("what can (you|i|one) (do|say|ask)", ":tasks"),
    ("what can be done", ":tasks"),
    ("help me", ":help"),
];
/// Words that a question begins with.
const BEGINS: &[&str] = &[
    "are", "can", "did", "do", "does", "has", "have", "how", "is", "was", "what", "when", "where",
    "which", "who", "why",
];

/// Reads a sentence as a question, `said` as [`words`] makes it; `None` when none that is known is like it.
pub(super) fn understand(said: &str, with: &Knowledge<'_>) -> Option<Meaning> {
    let fixed = ASKED.iter().map(|(sentence, line)| ((*sentence).to_owned(), (*line).to_owned()));
    let own = with.library.fluents().filter_map(|(fluent, _)| own(fluent));
    let mut hindered = None;
    for (sentence, line) in fixed.chain(own) {
        let Ok(template) = Template::read(&sentence) else { continue };
        for reach in [Reach::Short, Reach::Long] {
            let Some(slots) = template.fit(said, reach) else { continue };
            match slots.iter().try_fold(line.clone(), |line, (slot, said)| {
                let thing = thing(said, slot, with)?;
                Ok(line.replace(&format!("{{{slot}}}"), &thing))
            }) {
                Ok(line) => return Some(Meaning::Asked { line, template: sentence }),
                Err(hindrance) => hindered = hindered.or(Some(hindrance)),
            }
        }
    }
    hindered.map(|Hindrance { why, help, .. }| Meaning::Impossible { why, help })
}

/// Returns the sentences that ask, as templates; those of fluents are not among them.
pub(super) fn sentences() -> impl Iterator<Item = &'static str> {
    ASKED.iter().map(|(sentence, _)| *sentence)
}

/// Whether a sentence is a question, known or not.
pub(super) fn begins(said: &str) -> bool {
    said.split(' ').next().is_some_and(|word| BEGINS.contains(&word))
}

/// A fluent's own question, and the fluent with what its slots hold.
fn own(fluent: &FluentItem) -> Option<(String, String)> {
    let ask = words(&fluent.ask.as_ref()?.text);
    let asked = fluent.params.iter().filter(|param| param.default.is_none());
    let slots: Vec<String> = asked.map(|param| format!("{{{}}}", param.name.text)).collect();
    let line = format!("{}({})", fluent.name.text, slots.join(", "));
    slots.iter().all(|slot| ask.contains(slot)).then(|| (ask.replace(" the ", " [the] "), line))
}

/// Returns the thing that words mean; an error says which there are when they may mean several.
fn thing(said: &str, slot: &str, with: &Knowledge<'_>) -> Result<String, Hindrance> {
    let ty = match slot {
        VESSEL => Ty::named("Container"),
        _ => Ty::Object(builtins::OBJECT.to_owned()),
    };
    let found = resolve::resolve(said, &ty, slot, with)?;
    match found.as_slice() {
        [one] => Ok(one.value.clone()),
        several => {
            let names: Vec<&str> = several.iter().map(|found| found.shown.as_str()).collect();
            let help = Some("ask again, and say which".into());
            Err(Hindrance::new(format!("which {said}: {}?", either(&names)), help))
        }
    }
}
