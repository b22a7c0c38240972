//! What people are told of a run by the cell: its phases and notes, why it ended, what speaks against a text.
//!
//! Why a verb of the cell cannot be done stands with its error ([`super::Error`]).

use std::fmt::Display;

use crate::alignment::marks::NEEDED;
use crate::execution::context::Brushed;
use crate::fluent::Score;
use crate::language::ast::{EffectItem, Name, Span};
use crate::language::{Diagnostic, nearest};
use crate::trace::{Shared, Unmet};
use crate::vqa::{Endpoint, Reply, Said};

use super::known::Unheeded;
use super::outcome::Tried;

// Phases of a run, and what is told in them.

/// The phase in which parse graphs are chosen.
pub(super) fn choosing() -> &'static str {
    "choosing parse graphs"
}

/// The phase in which the regressions are fitted and the table is looked at.
pub(super) fn perceiving() -> &'static str {
    "calibrating and looking"
}

/// The phase in which a plan is carried out, by an arm or by the twin's.
pub(super) fn arm_moves(is_twin: bool) -> &'static str {
    if is_twin { "in the twin; no arm moves" } else { "the arm moves" }
}

/// The phase in which candidates are rehearsed, in a twin that has these effects.
pub(super) fn rehearsing(candidates: usize, effects: &[&str]) -> String {
    let with =
        if effects.is_empty() { String::new() } else { format!(" with {}", effects.join(", ")) };
    format!("up to {candidates} candidates in the twin{with}")
}

/// An effect that the twin of a rehearsal does not have.
pub(super) fn effect_left_out(name: &str, why: &Unheeded) -> String {
    format!("effect {name} is left out: {why}")
}

/// A step on the arm failed.
pub(super) fn step_failed(reason: &str) -> String {
    format!("step failed: {reason}")
}

/// The arm found things otherwise than rehearsed.
pub(super) fn planning_again() -> &'static str {
    "planning the rest again from where the arm is"
}

/// A recovery begins.
pub(super) fn recovering(path: &str) -> String {
    format!("recovering: {path}")
}

/// That the arm moved something that it was to go past, in which step.
pub(super) fn brushed(step: &str, brushed: &Brushed) -> String {
    format!("{step} moves `{}` by {:.1} mm on its way", brushed.object, brushed.by * 1e3)
}

/// The same, after how a rehearsal went.
fn beside(tried: &Tried) -> String {
    tried.brushed.as_ref().map(|brushed| format!("; {brushed}")).unwrap_or_default()
}

/// How a rehearsal went.
pub(super) fn went(tried: &Tried) -> String {
    match &tried.failed {
        None => {
            let brushed = beside(tried);
            let (spilt, time) = (tried.spilt_ml, tried.time_s);
            format!("succeeded, {spilt:.1} mL spilt, {time:.0} s of arm time{brushed}")
        }
        Some(why) => format!("failed at {why}"),
    }
}

/// How many simulated plans succeeded, and which one runs; what failed is told by who gives up.
pub(super) fn plans((succeeded, all): (usize, usize), branches: &str, best: &Tried) -> String {
    let chosen = if succeeded == 0 {
        String::new()
    } else {
        let way = if branches.is_empty() { "the best" } else { branches };
        let (spilt, time, brushed) = (best.spilt_ml, best.time_s, beside(best));
        format!("; {way}: {spilt:.1} mL spilt, {time:.0} s of arm time{brushed}")
    };
    let s = if all == 1 { "" } else { "s" };
    format!("{succeeded} of {all} simulated plan{s} succeeded{chosen}")
}

/// That less likely plans are simulated.
pub(super) fn other_plans() -> &'static str {
    "none of the likeliest plans succeeded; others are simulated"
}

/// Rehearsals of one choice of branches that went alike.
pub(super) fn twin_line(branches: &str, variants: &str, went: &str) -> String {
    format!("twin: {branches}{variants} {went}")
}

/// The speed dial is turned down.
pub(super) fn slowed(percent: u8) -> String {
    format!("the arm moves at {percent} % of what is planned; `slow 100` while stepping undoes it")
}

/// A `break` stands before a step of a run that nobody steps.
pub(super) fn break_passed(number: usize, step: &str) -> String {
    format!("a `break` stands before step {number} {step}; it pauses only a run that is stepped")
}

// Why a run ended as it did.

/// How [`unrecorded`] begins.
const UNRECORDED: &str = "the run could not be recorded any further: ";

/// What can be said of it was not written down.
pub(super) fn unrecorded(trouble: impl Display) -> String {
    format!("{UNRECORDED}{trouble}")
}

/// Whether a line says so.
pub(super) fn is_unrecorded(line: &str) -> bool {
    line.starts_with(UNRECORDED)
}

/// The program panicked.
pub(super) fn program_failed() -> String {
    "the program itself has a mistake; the arm was brought to rest".to_owned()
}

/// What the call itself promises is false when all is done.
pub(super) fn promise_broken(broken: &Unmet) -> String {
    format!("at the end it promised {broken}")
}

/// Why a run that did everything is unconfirmed; `why` is why nobody knows, and `is_near` whether the measurement is too coarse.
pub(super) fn promise_unknown(promised: &str, why: Option<&str>, is_near: bool) -> String {
    let why = why.map(|why| format!(": {why}")).unwrap_or_default();
    let next = if is_near { "; `look()` measures it again" } else { "" };
    format!("nothing that was measured says whether `{promised}`{why}{next}")
}

/// The step that was recovered from, and why its recovery failed.
pub(super) fn recovery_failed(reason: &str, error: impl Display) -> String {
    format!("{reason}; then the recovery failed: {error}")
}

// A model that is asked.

/// The phase in which a model is tried out.
pub(super) fn probing(model: &Endpoint) -> String {
    format!("probing {} at {}", model.model(), model.base())
}

/// The model is on another machine.
pub(super) fn pictures_leave(host: &str) -> String {
    format!("the pictures of this run leave this machine: they go to {host}")
}

/// The model takes no notice of pictures.
pub(super) fn model_is_blind() -> &'static str {
    "the model cannot tell red from blue: it does not see the pictures"
}

/// The model may answer in another form than asked for.
pub(super) fn form_is_free() -> &'static str {
    "the server does not enforce the form of a reply; what cannot be read is unparsed"
}

/// The phase in which a model looks at pictures.
pub(super) fn model_looks(model: &Endpoint) -> String {
    format!("{} looks, the arm holds still", model.model())
}

/// What came back: how many answers, how many that cannot be read, how long it took, and the score with them.
pub(super) fn model_answered(told: &str, score: &Score) -> String {
    format!(
        "{told}; with its answers twin and camera image differ in {} of {}: P = {:.2}",
        score.hamming, score.known, score.p
    )
}

/// How many answers came back, how many that cannot be read, and how long it took.
pub(super) fn replies(replies: &[(usize, Reply)]) -> String {
    let unparsed = replies.iter().filter(|(_, reply)| reply.answer == Said::Unparsed);
    let (unparsed, first) = (unparsed.clone().count(), unparsed.clone().next());
    let seconds: f64 = replies.iter().map(|(_, reply)| reply.latency_s).sum();
    let why = first.and_then(|(_, reply)| reply.why.as_deref());
    let why = why.map(|why| format!(" ({why}), geometry's stand")).unwrap_or_default();
    format!("the model: {} answers in {seconds:.1} s, {unparsed} unparsed{why}", replies.len())
}

// What a run says of its recording.

/// The encoders' zeros are those of the run's calibration.
pub(super) fn zeros_calibrated(recording: &str) -> String {
    format!("{recording}: the joint zeros found by the run's calibration are used")
}

// How the twin of a cell differs from it.

/// Nobody knows where a thing is.
pub(super) fn stands_anywhere(object: &str) -> String {
    format!("the position of the {object} is unknown; the twin puts it anywhere")
}

/// A twin does not begin with a full hand.
pub(super) fn stands_below(held: &str) -> String {
    format!("the {held} is in the hand: in the twin it stands below, the arm is at home")
}

// A pour that cannot be taken out of a run.

/// An object of the run is not in the scene.
pub(super) fn not_in_scene(object: &str, scene: &str) -> String {
    format!("`{object}` is not in the scene `{scene}`")
}

/// What helps then.
pub(super) fn give_the_scene() -> String {
    "give the scene of the run with `--scene FILE` or `--model FILE`".to_owned()
}

/// What was in a vessel before a pour is nowhere recorded.
pub(super) fn content_unrecorded(vessel: &str) -> String {
    format!("what `{vessel}` held before the pour is not recorded")
}

/// What helps then.
pub(super) fn weigh_it() -> String {
    "a run with scales, or one that knows what is in its vessels, says so; `RUN/arm.csv` is looked at as the arm's motion"
        .to_owned()
}

/// The scale that is read while the arm moves stood elsewhere.
pub(super) fn scale_elsewhere(source: &str, target: &str, under: &str) -> String {
    format!(
        "`{source}` was poured into `{target}`, and the scale that is read meanwhile stood under `{under}`: how it ran is not recorded, \
         and cannot be judged"
    )
}

/// What helps then.
pub(super) fn put_on_the_scale(target: &str) -> String {
    format!(
        "pour with `{target}` on the scale (`scale.under` of the laboratory's settings); `RUN/arm.csv` is looked at as the arm's motion"
    )
}

/// The recording has no joints.
pub(super) fn no_joints_recorded() -> String {
    "the run's recording has no joint positions".to_owned()
}

/// What helps when the recording does not fit the robot.
pub(super) fn check_the_robot() -> String {
    "is it the recording of this robot?".to_owned()
}

// Trials.

/// A trial that was ended because it took longer, s.
pub(super) fn not_within(seconds: f64) -> String {
    format!("not within {seconds} s")
}

/// Why a trial that ended by itself counts as no clean success.
pub(super) fn not_clean(poured: Option<bool>) -> String {
    match poured {
        Some(false) => "not all of the water arrived".to_owned(),
        _ => "water on the table".to_owned(),
    }
}

/// The row of trials without these regressions.
pub(super) fn method(without: &[u8]) -> String {
    match without {
        [] => "all regressions".to_owned(),
        [one] => format!("without regression {one}"),
        more => {
            let names: Vec<String> = more.iter().map(ToString::to_string).collect();
            format!("without regressions {}", names.join(", "))
        }
    }
}

// What speaks against a text.

/// Which effects of a model file rehearsals do not heed.
pub(super) fn no_law_for(names: &[String]) -> String {
    let them = if names.len() == 1 { "it" } else { "them" };
    let names = names.join(", ");
    format!("the twin has no law for {names}: `gap` judges with {them}, rehearsals go without")
}

/// An effect of a twin that changes nothing in a rehearsal.
pub(super) fn unheeded(item: &EffectItem, why: &Unheeded) -> Diagnostic {
    let message =
        format!("rehearsals do not simulate `{}({})`: {why}", item.name.text, item.at.text);
    Diagnostic::warning("task::unheeded", item.name.span, message, "not simulated")
        .help("`gap` judges with it all the same; a run goes without it")
}

/// A scene with fewer dots than the camera's place is told from.
pub(super) fn few_marks(marks: Span, dots: usize) -> Diagnostic {
    let there =
        if dots == 1 { "there is 1 dot".to_owned() } else { format!("there are {dots} dots") };
    let message = format!("a camera is aligned by {NEEDED} dots or more, and {there}");
    Diagnostic::warning("scene::marks", marks, message, "a run with a camera stops here")
        .help("print more dots, spread over the table, and write where their centres are")
}

/// A scene's robot that the stdlib has not.
pub(super) fn no_robot(name: &Name, known: &[&str]) -> Diagnostic {
    let own = &name.text;
    let message = format!("there is no robot `{own}`; the stdlib has {}", known.join(", "));
    let unknown = Diagnostic::error("scene::robot", name.span, message, "not in `robots/`");
    let added = "`--stdlib DIR` adds `DIR/robots/NAME/NAME.urdf` and its `robot.toml`";
    match nearest(own, known.iter().copied()) {
        Some(near) => unknown.help(format!("did you mean `{near}`? {added}")).fix(name.span, near),
        None => unknown.help(added),
    }
}

/// An action's script that nobody has; `near` is the name that is most like it.
pub(super) fn no_script(name: &str, span: Span, near: Option<&str>) -> Diagnostic {
    let message = format!("there is no script `{name}`");
    let unknown =
        Diagnostic::error("task::script", span, message, "not in `actions/`, not imported");
    unknown.help(match near {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("write it beside this file and `import \"{name}\"`"),
    })
}

/// An action's script whose text is no script.
pub(super) fn unreadable_script(error: &impl Display, span: Span) -> Diagnostic {
    Diagnostic::error("task::script", span, format!("the script cannot run: {error}"), "run here")
        .help("correct that line of the script")
}

/// A parameter of an action that its script never reads, nor its conditions.
pub(super) fn unread(script: &str, param: &str, span: Span) -> Diagnostic {
    let message = format!("`{script}` never reads `{param}`");
    let label = "whatever is given here makes no difference";
    Diagnostic::error("task::unread", span, message, label)
        .help(format!("use `{param}` in `{script}`, or leave the parameter out"))
}

/// A step of a `together` that needs what another needs that stands first.
pub(super) fn both_need(step: Span, first: Span, both: Shared) -> Diagnostic {
    let message = format!("these two cannot go on together: both {both}");
    Diagnostic::error("task::together", step, message, "and so does this")
        .label(first, "this does")
        .help("write them one after the other: `a() then b()`")
}

/// An `until` at a step of a `together` beside the one that moves the arm.
pub(super) fn until_beside(step: Span) -> Diagnostic {
    let message = "only the step that moves the arm can be ended by `until` here";
    Diagnostic::error("task::together", step, message, "goes on beside it")
        .help("put the `until` behind the step that moves the arm")
}

/// A `together` inside another.
pub(super) fn nested_together(inner: Span, outer: Span) -> Diagnostic {
    let message = "a `together` does not stand inside another";
    Diagnostic::error("task::together", inner, message, "inside another")
        .label(outer, "this one")
        .help("name all that goes on at the same time in one `together { … }`")
}
