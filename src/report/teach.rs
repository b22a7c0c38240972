//! Stepping in words: what comes next, what it came to, questions, hints; and a front that says them.

use std::fmt::Write as _;

use serde_json::json;

use crate::execution::conduct::{Ahead, Part, Stated};
use crate::teach::answers::{Answer, Answered};
use crate::teach::shown::{Front, Shown};
use crate::teach::wording::WORDS;
use crate::teach::words::{Takes, Wrong};
use crate::trace::{FluentRow, Outcome, StepRecord};
use crate::workcell::{Run, picture};

use super::run::people;
use super::{Style, record, run, why};

/// Where a fluent is defined.
pub type Place = Box<dyn Fn(&str) -> Option<String> + Send>;
/// Earlier runs of the same task, with their numbers, read when they are needed.
pub type Earlier = Box<dyn Fn() -> Vec<(usize, Run)> + Send>;

/// Says what is shown, on stdout, and asks through `ask`.
pub struct Teller<A> {
    style: Style,
    ask: A,
    place: Place,
    earlier: Earlier,
    has_shown_words: bool,
}

impl<A: FnMut(&str) -> Option<String> + Send> Teller<A> {
    /// Speaks in this style; `ask` returns the next line for a prompt, `None` when there is none.
    pub fn new(style: Style, place: Place, earlier: Earlier, ask: A) -> Self {
        Self { style, ask, place, earlier, has_shown_words: false }
    }

    fn words(&mut self, shown: &Shown<'_>) -> String {
        let style = self.style;
        match shown {
            Shown::Ahead { ahead, task, stop, blind } => {
                let mut text = coming(ahead, *task, stop.as_deref(), *blind);
                if !std::mem::replace(&mut self.has_shown_words, true) {
                    let words: Vec<&str> = WORDS.iter().map(|(word, ..)| *word).collect();
                    let _ = write!(text, "\n  {}\n  Enter = next; help", words.join("  "));
                }
                text
            }
            Shown::Inside { task: Some(task), ahead } => inside(task, ahead),
            Shown::Inside { task: None, ahead } => match &ahead.script {
                Some(_) => "a script line runs as a whole; `next` runs it".to_owned(),
                None => format!("{} is a single step without a script; next does it", ahead.action),
            },
            Shown::Line { line, stop, .. } => {
                let head = format!("{}  {}", line.place(), line.text);
                let paused = stop.as_ref().map(|stop| format!("\n  paused at `{stop}`"));
                format!("{head}{}\n  {}", paused.unwrap_or_default(), line.does)
            }
            Shown::PassingLine { line, why, .. } => format!(
                "{} {} begins without a pause: {why}; the next pause is where the arm can be left",
                line.place(),
                line.text
            ),
            Shown::NoLines { ahead } => {
                format!("the record of {} holds no lines of its script", ahead.action)
            }
            Shown::Passing { ahead, why } => format!(
                "step {} {} begins without a pause: {why}; the next pause is where the arm can be left",
                ahead.number, ahead.action
            ),
            Shown::Question { question, .. } => {
                format!("{question}\n  y yes   n no   u can't tell   Enter leaves it out")
            }
            Shown::Done { record, before, withheld } => {
                run::step(record, before, *withheld, style).trim_end().to_owned()
            }
            Shown::Compared { answered } => compared(answered, "; `hint` tells more", style),
            Shown::Failed { record, is_over: true } => {
                format!("step {} failed; Enter shows what was done about that", record.number)
            }
            Shown::Failed { record, is_over: false } => format!(
                "step {} failed; Enter lets the task do what it says about that, quit leaves the arm \
                 as it is",
                record.number
            ),
            Shown::Looking { record, run_dir, withheld, .. } => {
                let mut text =
                    format!("looking at step {}; the arm has not moved\n", record.number);
                text += &run::step(record, &[], *withheld, style);
                text += &record::everything_else(record);
                if let Some(dir) = run_dir {
                    let _ = write!(
                        text,
                        "       pictures: {} to {:02}-after-twin",
                        picture::file(dir, &picture::before(record.number, "real")).display(),
                        record.number
                    );
                }
                text.trim_end().to_owned()
            }
            Shown::Present { next } => match next {
                Some(next) => {
                    format!("back at the present: step {next} is next; nothing has moved")
                }
                None => "back at the present; nothing has moved".to_owned(),
            },
            Shown::Hint { rung, row, steps } => self.hint(*rung, row, steps),
            Shown::NoHint { steps } => self.without_hint(steps),
            Shown::Why { fluent, steps } => self.why(*fluent, steps),
            Shown::Slow { percent: Some(percent) } => format!(
                "the arm moves at {percent} % of what is planned; pouring keeps its own rate"
            ),
            Shown::Slow { percent: None } => {
                "nothing moves here: this is the record of a run".to_owned()
            }
            Shown::Stops { stops, unknown, near } => {
                breakpoints(stops, unknown.as_deref(), near.as_deref())
            }
            Shown::Over => "all steps are done; back looks at earlier ones, Enter ends".to_owned(),
            Shown::Help => help(),
            Shown::NotAWord { line, wrong } => not_a_word(line, wrong),
            Shown::AnswerFirst { line } => {
                format!("`{line}` is no answer: y, n or u for can't tell; Enter leaves it out")
            }
            Shown::NoStep { of: 0 } => "there is no step to look back at yet".to_owned(),
            Shown::NoStep { of } => {
                format!("no such step: {of} have run so far")
            }
            Shown::Trouble { path, why } => {
                format!("the answer could not be kept in {}: {why}", path.display())
            }
        }
    }

    fn why(&self, fluent: Option<&str>, steps: &[StepRecord]) -> String {
        let run = Run::so_far("the run so far", steps);
        if steps.is_empty() {
            return "no step has run yet".to_owned();
        }
        let earlier = (self.earlier)();
        let place = &*self.place;
        let asked = why::Question { run: &run, number: None, fluent, earlier: &earlier, place };
        why::latest(&asked).unwrap_or_else(|failure| match failure.help {
            Some(help) => format!("{}; {help}", failure.message),
            None => failure.message,
        })
    }

    /// By how much, which way, what to try.
    fn hint(&self, rung: usize, row: &FluentRow, steps: &[StepRecord]) -> String {
        match (rung, &row.direction, steps.last()) {
            (1, ..) => closeness(row, steps.last()),
            (2, Some(direction), _) => why::way(direction, row.margin.as_ref()),
            // Where no way is known, what to try comes at once.
            (_, _, None) => "there is nothing more to try".to_owned(),
            (_, _, Some(step)) => match self.tries(step, Some(row), steps).trim_start() {
                "" => "there is nothing more to try than to look: `why` has the numbers".into(),
                tries => tries.to_owned(),
            },
        }
    }

    /// What there is to say where no fluent came out otherwise than it should.
    fn without_hint(&self, steps: &[StepRecord]) -> String {
        let Some(step) = steps.last() else {
            return "no step has run yet; a hint is about what came out otherwise than it should"
                .to_owned();
        };
        if step.outcome == Outcome::Failure {
            return format!("{}{}", failed(step), self.tries(step, None, steps));
        }
        let asked = step.fluents.iter().find(|row| row.expected.is_some());
        let about = asked.map_or_else(String::new, |row| format!(" {}", row.name));
        format!(
            "there is nothing to give a hint about: nothing of step {} came out otherwise than it should; \
             `why{about}` has the numbers",
            step.number
        )
    }

    fn tries(&self, step: &StepRecord, row: Option<&FluentRow>, steps: &[StepRecord]) -> String {
        let run = Run::so_far("the run so far", steps);
        let place = &*self.place;
        let asked = why::Question { run: &run, number: None, fluent: None, earlier: &[], place };
        why::tries(&asked, step, row)
    }
}

/// By how much a fluent is what it is after a step; where it has no margin, what is known instead and what can be done next.
fn closeness(row: &FluentRow, step: Option<&StepRecord>) -> String {
    let mut text = why::verdict(row);
    if row.margin.is_some() {
        return text;
    }
    if let (Some(false), Some(why)) = (row.measured, &row.why) {
        let _ = write!(text, " ({why})");
    }
    let unmet = |step: &StepRecord| {
        let unmet = step.failure.as_ref().and_then(|failure| failure.cause.unmet());
        unmet.is_some_and(|unmet| unmet.is(&row.name))
    };
    // That it is false is no reason why it is.
    if let Some(step) = step.filter(|step| step.outcome == Outcome::Failure && !unmet(step)) {
        let _ = write!(text, "\n{}", failed(step));
    }
    let next = if row.direction.is_some() { "which way" } else { "what to try" };
    let _ = write!(
        text,
        "\n`hint` again says {next}; `back` shows the step, and where its pictures are"
    );
    text
}

/// That a step failed, and why.
fn failed(step: &StepRecord) -> String {
    let why = step.reason.as_ref().map_or_else(String::new, |reason| format!(": {reason}"));
    format!("step {} {} failed{why}", step.number, step.action)
}

impl<A: FnMut(&str) -> Option<String> + Send> Front for Teller<A> {
    fn show(&mut self, shown: &Shown<'_>) {
        run::rest();
        if self.style.json {
            return self.style.event(shown);
        }
        let words = self.words(shown);
        self.style.tell(&words);
    }

    fn ask(&mut self, prompt: &str) -> Option<String> {
        run::rest();
        (self.ask)(prompt)
    }
}

/// Says how a run that was stepped ended, for programs.
pub fn ended(run: &Run, style: Style) {
    style.event(&json!({"event": "run", "run": run}));
}

/// What is about to happen: the step, what it is part of, what it needs, keeps and gives.
fn coming(ahead: &Ahead, task: Option<&Part>, stop: Option<&str>, blind: bool) -> String {
    let place = ahead.place.as_deref().unwrap_or_default();
    let head = format!("step {} of {}  {}", ahead.number, ahead.of, ahead.action);
    let mut text = format!("{head:<56} {place}").trim_end().to_owned();
    if let Some(stop) = stop {
        let _ = write!(text, "\n  paused at `{stop}`");
    }
    let branch = |inside: &str| {
        let taken =
            ahead.inside().iter().rfind(|part| part.is_branch && part.path.starts_with(inside));
        taken.map_or_else(String::new, |part| format!(", branch {}", part.label))
    };
    let whole = ahead.inside().iter().rev().find(|part| !part.is_branch);
    match (task, whole) {
        (Some(task), _) => {
            let _ = write!(
                text,
                "\n  begins {}, steps {} to {}{}: into shows them, over does them all",
                task.label,
                task.first,
                task.last,
                branch(&task.path)
            );
        }
        (None, Some(whole)) => {
            let _ = write!(text, "\n  in {}{}", whole.label, branch(&whole.path));
        }
        (None, None) => {}
    }
    let asked_after = |stated: &Stated| {
        blind && stated.asks && ahead.gives.iter().any(|given| given.text == stated.text)
    };
    for (name, conditions) in
        [("needs", &ahead.needs), ("keeps", &ahead.keeps), ("gives", &ahead.gives)]
    {
        for stated in conditions {
            let now = if asked_after(stated) { "asked after".to_owned() } else { now(stated) };
            let line = format!("\n  {name}  {:<60} {now}", stated.text);
            text += line.trim_end();
        }
    }
    text
}

fn now(stated: &Stated) -> String {
    let margin = stated.margin.as_ref().map(|m| format!(" ({})", people(m))).unwrap_or_default();
    match stated.truth {
        Some(true) => format!("now yes{margin}"),
        Some(false) => format!("now no{margin}"),
        None => "not known now".to_owned(),
    }
}

/// The steps of a sub-task.
fn inside(task: &Part, ahead: &Ahead) -> String {
    let mut text = format!("{} is steps {} to {}", task.label, task.first, task.last);
    for branch in ahead.inside().iter().filter(|part| part.is_branch) {
        let _ =
            write!(text, "\n  branch {}, steps {} to {}", branch.label, branch.first, branch.last);
    }
    let _ = write!(text, "\n  {:>3}  {}", ahead.number, ahead.action);
    for later in ahead.later.iter().take_while(|later| later.number <= task.last) {
        let _ = write!(text, "\n  {:>3}  {}", later.number, later.action);
    }
    text
}

/// What a person said beside what geometry says, with the margin; `more` ends it where they differ.
pub fn compared(answered: &Answered, more: &str, style: Style) -> String {
    let margin = answered.margin.as_ref().map(people);
    let std = answered.std.as_ref().map(|std| format!(" ± {}", why::unsigned(std)));
    let by = match (margin, answered.geometry) {
        (Some(margin), _) => format!(" ({margin}{})", std.unwrap_or_default()),
        (None, _) => String::new(),
    };
    let (said, is) = (answered.answer.words(), answered.geometry.words());
    let name = &answered.fluent;
    if answered.agrees() {
        return style.green(&format!("{name}: you said {said}, geometry says so too{by}"));
    }
    let twin = match answered.twin {
        Answer::CannotTell => String::new(),
        twin => format!("; the twin has it {}", twin.words()),
    };
    let text = format!("{name}: you said {said}, geometry says {is}{by}{twin}{more}");
    style.red(&text)
}

fn breakpoints(stops: &[String], unknown: Option<&str>, near: Option<&str>) -> String {
    let list = if stops.is_empty() {
        "no breakpoint is set, beside the `break` marks of the text".to_owned()
    } else {
        format!("pauses before {}", stops.join(", "))
    };
    match (unknown, near) {
        (None, _) => list,
        (Some(name), Some(near)) => {
            format!("no step from here on is called `{name}`: did you mean `{near}`?\n{list}")
        }
        (Some(name), None) => {
            format!("no step from here on is called `{name}`; into lists some\n{list}")
        }
    }
}

fn help() -> String {
    let mut text = String::new();
    for (word, takes, what) in WORDS {
        let _ = writeln!(text, "  {:<18} {what}", format!("{word} {takes}"));
    }
    text.truncate(text.trim_end().len());
    text
}

fn not_a_word(line: &str, wrong: &Wrong) -> String {
    match wrong {
        Wrong::Unknown(Some(near)) => format!("`{line}` is no word here: did you mean `{near}`?"),
        Wrong::Unknown(None) => format!("`{line}` is no word here; help lists them"),
        Wrong::Takes(Takes::Nothing) => format!("`{line}`: that word takes nothing after it"),
        Wrong::Takes(what) => format!("`{line}`: that word takes {what}"),
        Wrong::NoQuestion => format!("`{line}`: no question is open; Enter carries out the step"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::{Cause, Overdue, Unmet};
    use crate::world::{Pose, WorldState};

    fn grasp(cause: Cause) -> StepRecord {
        let row = FluentRow {
            name: "grasped(jar)".into(),
            expected: Some(true),
            twin: Some(true),
            measured: Some(false),
            margin: None,
            twin_margin: None,
            ask: None,
            why: None,
            std: None,
            direction: None,
            terms: Vec::new(),
        };
        StepRecord {
            number: 3,
            path: "pick/grasp".into(),
            action: "grasp(jar)".into(),
            call: None,
            outcome: Outcome::Failure,
            not_needed: None,
            reason: Some(cause.to_string()),
            failure: Some(cause.into()),
            interval_s: [0.0, 1.0],
            fluents: vec![row],
            during: Vec::new(),
            lines: Vec::new(),
            planned_q: Vec::new(),
            hamming: 0,
            score: 1.0,
            measured: WorldState {
                time: 0.0,
                q: Vec::new(),
                opening: 0.08,
                world_from_tool: Pose::upright(0.4, 0.0, 0.3, 0.0),
                held: None,
                objects: Vec::new(),
                spilt: None,
                unknown: Vec::new(),
            },
            twin: None,
        }
    }

    /// A hint after a failed step was one bare line, "grasped(jar) is false".
    #[test]
    fn a_hint_without_a_number_says_why_and_what_can_be_done_next() {
        let next =
            "`hint` again says what to try; `back` shows the step, and where its pictures are";
        let of = "grasp(jar)".to_owned();
        let late = grasp(Cause::Overdue(Overdue { of, took_s: 20.04, limit_s: 20.0, pace: 1.0 }));
        assert_eq!(
            closeness(&late.fluents[0], Some(&late)),
            format!(
                "grasped(jar) is false\nstep 3 grasp(jar) failed: grasp(jar) has taken 20.04 s, and its limit is \
                 20 s\n{next}"
            )
        );
        let (condition, term) = ("grasped(jar)".to_owned(), "grasped(jar)".to_owned());
        let empty = Unmet { condition, term, margin: None, numbers: None };
        let empty = grasp(Cause::Promise(empty));
        let said = closeness(&empty.fluents[0], Some(&empty));
        assert_eq!(said, format!("grasped(jar) is false\n{next}"));
    }
    /// The same step was "agree on 8 of 8" while it was stepped through and "9 of 9" in `:back`.
    #[test]
    fn what_a_person_is_to_be_asked_about_counts_and_is_not_shown() {
        let of = "grasp(jar)".to_owned();
        let cause = Cause::Overdue(Overdue { of, took_s: 20.04, limit_s: 20.0, pace: 1.0 });
        let mut record = grasp(cause);
        record.fluents[0].measured = Some(true);
        let told = |withheld| run::step(&record, &[], withheld, Style::plain());
        assert!(told(0).contains("agree on 1 of 1"), "{}", told(0));
        assert!(told(1).contains("agree on 2 of 2"), "{}", told(1));
        assert_eq!(told(0).lines().count(), told(1).lines().count());
    }
}
