//! Stepping without a terminal: over records, and as the conductor of runs that are made up here.

mod answers;
mod lines;

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use serde_json::Value;
use trueup::execution::conduct::{Ahead, Conductor, Dial, Later, Mark, Part, Stated, Word};
use trueup::teach::record;
use trueup::teach::shown::{Front, Shown};
use trueup::teach::stepper::{Setup, Stepper};
use trueup::teach::stops::Stops;
use trueup::trace::{FluentRow, Measure, Outcome, StepRecord};

use crate::repl::kept::pour;

/// Everything that was shown, as events, and every prompt.
#[derive(Debug, Clone, Default)]
struct Script {
    lines: Arc<Mutex<VecDeque<String>>>,
    events: Arc<Mutex<Vec<Value>>>,
}

impl Script {
    fn of(lines: &[&str]) -> Self {
        let script = Self::default();
        script.lines.lock().unwrap().extend(lines.iter().map(|line| (*line).to_owned()));
        script
    }

    fn events(&self) -> Vec<Value> {
        self.events.lock().unwrap().clone()
    }

    /// Names of events and prompts, in order.
    fn story(&self) -> Vec<String> {
        let name = |event: &Value| match event["prompt"].as_str() {
            Some(prompt) => prompt.to_owned(),
            None => event["event"].as_str().unwrap().to_owned(),
        };
        self.events().iter().map(name).collect()
    }

    fn all(&self, event: &str) -> Vec<Value> {
        self.events().into_iter().filter(|shown| shown["event"] == event).collect()
    }
}

impl Front for Script {
    fn show(&mut self, shown: &Shown<'_>) {
        self.events.lock().unwrap().push(serde_json::to_value(shown).unwrap());
    }

    fn ask(&mut self, prompt: &str) -> Option<String> {
        self.events.lock().unwrap().push(serde_json::json!({ "prompt": prompt }));
        self.lines.lock().unwrap().pop_front()
    }
}

fn teaching(answers: Option<PathBuf>) -> Setup {
    Setup { teaches: true, steps: true, answers, ..Setup::default() }
}

/// Steps of a task `pour` with a sub-task `pick` of three: 1, 2 to 4, 5 and 6.
fn plan() -> Vec<Ahead> {
    let step = |path: &str, action: &str| (path.to_owned(), action.to_owned());
    let steps = [
        step("pour/check_ready_to_pick", "check ready_to_pick(jar)"),
        step("pour/pick/either.side/approach", "approach(jar)"),
        step("pour/pick/either.side/grasp", "grasp(jar)"),
        step("pour/pick/lift", "lift(jar)"),
        step("pour/tilt", "tilt(jar)"),
        step("pour/untilt", "untilt(jar)"),
    ];
    let part = |path: &str, label: &str, first, last| Part {
        path: path.into(),
        label: label.into(),
        is_branch: path.contains('.'),
        first,
        last,
    };
    let later = |from: usize| {
        let rest = steps.iter().enumerate().skip(from);
        rest.map(|(i, (path, action))| Later {
            number: i + 1,
            path: path.clone(),
            action: action.clone(),
        })
        .collect()
    };
    steps
        .iter()
        .enumerate()
        .map(|(i, (path, action))| {
            let mut parts = vec![part("pour", "pour(jar, cup)", 1, 6)];
            if path.contains("/pick/") {
                parts.push(part("pour/pick", "pick(jar)", 2, 4));
            }
            if path.contains("side") {
                parts.push(part("pour/pick/either.side", "side", 2, 3));
            }
            Ahead {
                number: i + 1,
                of: 6,
                path: path.clone(),
                action: action.clone(),
                place: None,
                script: None,
                parts,
                needs: Vec::new(),
                keeps: Vec::new(),
                gives: Vec::new(),
                mark: None,
                later: later(i + 1),
            }
        })
        .collect()
}

/// What a step came to, with the fluents that are given.
fn came_to(ahead: &Ahead, fluents: Vec<FluentRow>, outcome: Outcome) -> StepRecord {
    let model = &pour("level_side", 0.1, 0.01, 0.001).steps[0];
    StepRecord {
        number: ahead.number,
        path: ahead.path.clone(),
        action: ahead.action.clone(),
        outcome,
        reason: (outcome == Outcome::Failure).then(|| "it slipped".to_owned()),
        fluents,
        ..model.clone()
    }
}

fn asking(name: &str, expected: Option<bool>, measured: Option<bool>) -> FluentRow {
    FluentRow {
        name: name.into(),
        expected,
        twin: Some(true),
        measured,
        margin: Some(Measure { value: -0.031, unit: "m".into() }),
        twin_margin: None,
        ask: Some(format!("Is it so: {name}?")),
        why: None,
        std: Some(Measure { value: 0.004, unit: "m".into() }),
        direction: None,
        terms: Vec::new(),
    }
}

/// Conducts the plan; returns the numbers of the steps that were carried out.
fn conduct(stepper: &mut Stepper<Script>, plan: &[Ahead]) -> Vec<usize> {
    stepper.begins("pour(jar, cup)", None);
    let mut done = Vec::new();
    for ahead in plan {
        if stepper.before(ahead) == Word::Stop {
            break;
        }
        done.push(ahead.number);
        let record = came_to(ahead, Vec::new(), Outcome::Success);
        if stepper.after(ahead, &record) == Word::Stop {
            break;
        }
    }
    done
}

/// The numbers of the steps before which a person was asked.
fn pauses(script: &Script) -> Vec<u64> {
    script.all("ahead").iter().map(|event| event["ahead"]["number"].as_u64().unwrap()).collect()
}

#[test]
fn next_is_one_step_wherever_it_lies() {
    let script = Script::of(&["next", "", "next", "next", "next", "next"]);
    let mut stepper = Stepper::new(script.clone(), teaching(None));
    assert_eq!(conduct(&mut stepper, &plan()), [1, 2, 3, 4, 5, 6]);
    assert_eq!(pauses(&script), [1, 2, 3, 4, 5, 6]);
    let prompts: Vec<_> = script.story().into_iter().filter(|line| line.ends_with("> ")).collect();
    assert_eq!(prompts[0], "pour 1/6> ");
    assert_eq!(prompts.last().unwrap(), "pour done> ");
}

#[test]
fn over_carries_out_a_whole_sub_task_and_out_the_rest_of_one() {
    let script = Script::of(&["next", "over", "quit"]);
    let mut stepper = Stepper::new(script.clone(), teaching(None));
    assert_eq!(conduct(&mut stepper, &plan()), [1, 2, 3, 4]);
    assert_eq!(pauses(&script), [1, 2, 5]);

    let script = Script::of(&["next", "next", "out", "quit"]);
    let mut stepper = Stepper::new(script.clone(), teaching(None));
    assert_eq!(conduct(&mut stepper, &plan()), [1, 2, 3, 4]);
    assert_eq!(pauses(&script), [1, 2, 3, 5]);
}

#[test]
fn into_shows_a_sub_task_and_moves_nothing() {
    let script = Script::of(&["next", "into", "over", "quit"]);
    let mut stepper = Stepper::new(script.clone(), teaching(None));
    // Once it was entered, `over` is about the step alone.
    assert_eq!(conduct(&mut stepper, &plan()), [1, 2]);
    let inside = &script.all("inside")[0];
    assert_eq!(inside["task"]["label"], "pick(jar)");
    assert_eq!(inside["task"]["last"], 4);
}

#[test]
fn back_and_forward_look_and_never_carry_anything_out() {
    let lines =
        ["next", "next", "back", "back", "back", "forward", "next", "back 1", "continue", "quit"];
    let script = Script::of(&lines);
    let mut stepper = Stepper::new(script.clone(), teaching(None));
    assert_eq!(conduct(&mut stepper, &plan()), [1, 2], "only `next` at the present moves");
    let looked: Vec<_> =
        script.all("looking").iter().map(|event| event["record"]["number"].clone()).collect();
    assert_eq!(looked, [2, 1, 2, 1]);
    // The third `back` finds nothing before step 1; `next` and `continue` come back to the present.
    assert_eq!(script.all("no_step").len(), 1);
    let present = script.all("present");
    assert_eq!(present.len(), 2);
    assert!(present.iter().all(|event| event["next"] == 3));
}

#[test]
fn the_first_look_back_is_at_the_step_carried_out_last_also_at_the_end() {
    let script = Script::of(&["next", "back", "quit"]);
    let mut stepper = Stepper::new(script.clone(), teaching(None));
    assert_eq!(conduct(&mut stepper, &plan()[5..]), [6]);
    assert_eq!(script.story().last().unwrap(), "pour looking at 6> ");

    let plan = plan();
    let script = Script::of(&["next", "next", "back", "quit"]);
    let mut stepper = Stepper::new(script.clone(), teaching(None));
    conduct(&mut stepper, &plan[..1]);
    stepper.before(&plan[2]);
    stepper.after(&plan[2], &came_to(&plan[2], Vec::new(), Outcome::Failure));
    assert_eq!(script.all("looking")[0]["record"]["number"], 3, "the one that failed");
}

#[test]
fn a_breakpoint_pauses_what_goes_on_by_itself() {
    let stops = Stops::default();
    stops.set("grasp");
    let setup = Setup { stops: stops.clone(), ..teaching(None) };
    let script = Script::of(&["continue", "break tilt", "break tlit", "clear grasp", "continue"]);
    let mut stepper = Stepper::new(script.clone(), setup);
    assert_eq!(conduct(&mut stepper, &plan()), [1, 2, 3, 4], "no word is left at the tilt");
    assert_eq!(pauses(&script), [1, 3, 5]);
    assert_eq!(script.all("ahead")[1]["stop"], "grasp");
    let shown = script.all("stops");
    assert_eq!((&shown[1]["unknown"], &shown[1]["near"]), (&"tlit".into(), &"tilt".into()));
    assert_eq!(stops.all(), ["tilt"]);
}

#[test]
fn without_stepping_only_breakpoints_pause() {
    let script = Script::of(&[]);
    let mut stepper = Stepper::new(script.clone(), Setup::default());
    assert_eq!(conduct(&mut stepper, &plan()), [1, 2, 3, 4, 5, 6]);
    assert!(script.events().is_empty());

    let mut marked = plan();
    marked[3].mark = Some(Mark { when: None, holds: true });
    marked[1].mark = Some(Mark { when: Some("held(jar)".into()), holds: false });
    let script = Script::of(&["next", "quit"]);
    let mut stepper = Stepper::new(script.clone(), Setup::default());
    assert_eq!(conduct(&mut stepper, &marked), [1, 2, 3, 4]);
    assert_eq!(pauses(&script), [4, 5], "after a breakpoint it is stepped");
}

#[test]
fn no_word_that_comes_is_the_wish_to_stop() {
    let script = Script::of(&[]);
    let mut stepper = Stepper::new(script.clone(), teaching(None));
    assert_eq!(conduct(&mut stepper, &plan()), [0; 0]);
    // But not where all is done.
    let script = Script::of(&["next"]);
    let mut stepper = Stepper::new(script.clone(), teaching(None));
    assert_eq!(conduct(&mut stepper, &plan()[5..]), [6]);
    assert_eq!(script.all("over").len(), 1);
}

#[test]
fn a_pause_that_is_not_safe_is_put_off_and_said() {
    let script = Script::of(&["quit"]);
    let mut stepper = Stepper::new(script.clone(), Setup::default());
    let plan = plan();
    stepper.passing(&plan[5], "the jar is tilted by 62 deg");
    assert!(script.events().is_empty(), "nobody wanted to pause there");

    let stops = Stops::default();
    stops.set("untilt");
    let mut stepper = Stepper::new(script.clone(), Setup { stops, ..Setup::default() });
    stepper.passing(&plan[5], "the jar is tilted by 62 deg");
    assert_eq!(script.all("passing")[0]["why"], "the jar is tilted by 62 deg");
    assert_eq!(stepper.before(&plan[0]), Word::Stop, "the next safe place pauses");
}

#[test]
fn questions_are_asked_before_anything_is_shown_and_compared_after() {
    let ahead = &plan()[4];
    let rows = vec![
        asking("pouring(jar, cup)", Some(true), Some(false)),
        asking("above(jar, cup)", Some(true), Some(true)),
        asking("holding(jar)", None, Some(true)),
    ];
    let record = came_to(ahead, rows, Outcome::Success);
    let script = Script::of(&["next", "back", "y", "yes", "hint", "hint", "hint", "quit"]);
    let mut stepper = Stepper::new(script.clone(), teaching(None));
    assert_eq!(stepper.before(ahead), Word::Go);
    assert_eq!(stepper.after(ahead, &record), Word::Go);
    stepper.before(&plan()[5]);
    let story = script.story();
    let at = |name: &str| story.iter().position(|line| line == name).unwrap();
    assert!(at("question") < at("done") && at("done") < at("compared"), "{story:?}");
    let questions = script.all("question");
    assert_eq!(questions.len(), 2, "what the step was not about is not asked");
    assert_eq!(script.all("answer_first").len(), 1, "looking back would give it away");
    let done = &script.all("done")[0]["record"]["fluents"];
    assert!(done.as_array().unwrap().iter().all(|row| row["name"] != "holding(jar)"));
    let compared = script.all("compared");
    let pouring = &compared[0]["answered"];
    assert_eq!((&pouring["answer"], &pouring["geometry"]), (&"yes".into(), &"no".into()));
    assert_eq!(pouring["margin"]["value"], -0.031);
    assert_eq!(compared[1]["answered"]["geometry"], "yes");
    // The comparison was the first rung.
    let rungs: Vec<_> = script.all("hint").iter().map(|event| event["rung"].clone()).collect();
    assert_eq!(rungs, [2, 3, 3]);
}

#[test]
fn what_a_question_is_about_is_kept_back_before_the_step() {
    let mut ahead = plan()[0].clone();
    ahead.gives = vec![Stated {
        text: "ready_to_pick(jar)".into(),
        truth: Some(true),
        margin: None,
        asks: true,
    }];
    let script = Script::of(&["quit"]);
    Stepper::new(script.clone(), teaching(None)).before(&ahead);
    assert_eq!(script.all("ahead")[0]["blind"], true);
}

#[test]
fn a_failed_step_pauses_before_the_task_does_anything_about_it() {
    let plan = plan();
    let record = came_to(&plan[2], Vec::new(), Outcome::Failure);
    let script = Script::of(&["continue", "why", "quit"]);
    let stops = Stops::default();
    let mut stepper = Stepper::new(script.clone(), Setup { stops, ..teaching(None) });
    stepper.before(&plan[2]);
    assert_eq!(stepper.after(&plan[2], &record), Word::Stop);
    assert_eq!(script.all("failed").len(), 1);
    assert_eq!(script.all("why")[0]["steps"][0]["reason"], "it slipped");
}

#[test]
fn the_dial_is_turned_by_slow_and_by_nothing_else() {
    let dial = Dial::default();
    let setup = Setup { dial: Some(dial.clone()), ..teaching(None) };
    let script = Script::of(&["slow", "slow 25 %", "slow 0", "quit"]);
    Stepper::new(script.clone(), setup).before(&plan()[0]);
    let shown: Vec<_> = script.all("slow").iter().map(|event| event["percent"].clone()).collect();
    assert_eq!(shown, [100, 25]);
    assert_eq!((dial.percent(), script.all("not_a_word").len()), (25, 1));
    assert!((dial.stretch() - 4.0).abs() < 1e-12);
}

#[test]
fn a_run_that_is_over_is_stepped_through_like_one_that_goes_on() {
    let run = pour("level_side", 0.1, 0.066, 0.001);
    let steps = record::steps(&run.steps, &run.parse_graphs);
    let script = Script::of(&["next", "y", "next", "u", "back", "next", "next"]);
    let mut stepper = Stepper::new(script.clone(), teaching(None));
    stepper.over_record(&run.task, None, &steps);
    let story = script.story();
    assert_eq!(
        story,
        [
            "ahead",
            "pour 1/2> ",
            "question",
            "y/n/u> ",
            "done",
            "compared",
            "ahead",
            "pour 2/2> ",
            "question",
            "y/n/u> ",
            "question",
            "y/n/u> ",
            "answer_first",
            "y/n/u> ",
            "answer_first",
            "y/n/u> ",
            "answer_first",
            "y/n/u> ",
            "done",
            "compared",
            "failed",
            "pour failed> ",
        ]
    );
}
