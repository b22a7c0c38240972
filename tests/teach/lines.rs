//! Inside a step: pauses before the lines of its script that act.

use trueup::execution::conduct::{Ahead, Conductor, Word};
use trueup::teach::record;
use trueup::teach::stepper::{Setup, Stepper};
use trueup::teach::stops::Stops;
use trueup::trace::Line;
use trueup::trace::Outcome;

use super::{Script, came_to, plan, teaching};
use crate::repl::kept::pour;

fn line(number: usize) -> Line {
    Line {
        deed: None,
        script: "grasp.rhai".into(),
        line: number,
        text: format!("arm.wait({number}.0);"),
        does: format!("hold still for {number}.0 s"),
        at_s: 0.0,
    }
}

/// The third step, `grasp(jar)`, runs a script.
fn steps() -> Vec<Ahead> {
    let mut steps = plan();
    steps[2].script = Some("grasp.rhai".into());
    steps
}

/// Conducts the plan, the third step by lines 2 to 4, of which some may not be paused at; returns what was
/// done: steps by number, lines by `3:line`.
fn conduct(stepper: &mut Stepper<Script>, tilted: &[usize]) -> Vec<String> {
    stepper.begins("pour(jar, cup)", None);
    let mut done = Vec::new();
    for ahead in &steps() {
        if stepper.before(ahead) == Word::Stop {
            return done;
        }
        done.push(ahead.number.to_string());
        let lines: &[usize] = if ahead.number == 3 { &[2, 3, 4] } else { &[] };
        for &number in lines {
            let why = tilted.contains(&number).then_some("the jar is tilted by 40 deg");
            if stepper.within(ahead, &line(number), why) == Word::Stop {
                return done;
            }
            done.push(format!("3:{number}"));
        }
        if stepper.after(ahead, &came_to(ahead, Vec::new(), Outcome::Success)) == Word::Stop {
            return done;
        }
    }
    done
}

/// Conducts with these words; returns what was done, the lines paused at, and the story.
fn told(words: &[&str], setup: Setup, tilted: &[usize]) -> (Vec<String>, Vec<u64>, Script) {
    let script = Script::of(words);
    let mut stepper = Stepper::new(script.clone(), setup);
    let done = conduct(&mut stepper, tilted);
    let paused = script.all("line");
    let paused = paused.iter().map(|event| event["line"]["line"].as_u64().unwrap()).collect();
    (done, paused, script)
}

#[test]
fn into_a_step_pauses_before_each_line_and_nothing_is_done_before_the_first() {
    let (done, paused, script) = told(&["next", "next", "into", "quit"], teaching(None), &[]);
    assert_eq!(done, ["1", "2", "3"], "the step has begun, and no line of it");
    assert_eq!(paused, [2]);
    assert!(script.story().contains(&"pour 3/6 line 2> ".to_owned()), "{:?}", script.story());

    let words = ["next", "next", "into", "next", "", "over", "quit"];
    let (done, paused, _) = told(&words, teaching(None), &[]);
    assert_eq!(done, ["1", "2", "3", "3:2", "3:3", "3:4"]);
    assert_eq!(paused, [2, 3, 4]);
}

#[test]
fn out_is_back_at_the_task_and_continue_goes_on() {
    let (done, paused, script) =
        told(&["next", "next", "into", "out", "quit"], teaching(None), &[]);
    assert_eq!((done.len(), paused), (6, vec![2]), "{done:?}");
    assert_eq!(super::pauses(&script), [1, 2, 3, 4], "the next step is paused before");
    let (done, ..) = told(&["next", "next", "into", "continue"], teaching(None), &[]);
    assert_eq!(done.last().unwrap(), "6");
    // Looking back from a line shows the step before, and moves nothing.
    let words = ["next", "next", "into", "back", "next", "into", "quit"];
    let (done, paused, script) = told(&words, teaching(None), &[]);
    assert_eq!((done.len(), paused), (3, vec![2]));
    assert_eq!(script.all("looking")[0]["record"]["number"], 2);
    assert_eq!(script.all("inside").len(), 1, "a line has no inside");
}

#[test]
fn where_the_arm_cannot_be_left_a_line_is_passed_and_it_is_said_once() {
    let (done, paused, script) =
        told(&["next", "next", "into", "next", "quit"], teaching(None), &[3, 4]);
    assert_eq!(paused, [2]);
    let passed = script.all("passing_line");
    assert_eq!(passed.len(), 1, "a loop may tilt in many small turns");
    assert_eq!(
        (&passed[0]["line"]["line"], &passed[0]["why"]),
        (&3.into(), &"the jar is tilted by 40 deg".into())
    );
    assert_eq!(done.last().unwrap(), "3:4");
    assert_eq!(super::pauses(&script), [1, 2, 3, 4], "the pause is made up for before step 4");
}

#[test]
fn a_line_can_be_a_breakpoint() {
    let stops = Stops::default();
    stops.set("grasp.rhai:3");
    let (done, paused, script) = told(&["next", "quit"], Setup { stops, ..Setup::default() }, &[]);
    assert_eq!(paused, [3, 4], "after a breakpoint it is stepped");
    assert_eq!(done.last().unwrap(), "3:3");
    assert_eq!(script.all("line")[0]["stop"], "grasp.rhai:3");
    // It is believed without being a step's name.
    let script = Script::of(&["break lift.rhai:2", "break lift.rhai", "quit"]);
    Stepper::new(script.clone(), teaching(None)).before(&plan()[0]);
    let shown = script.all("stops");
    assert_eq!((&shown[0]["unknown"], &shown[0]["stops"][0]), (&().into(), &"lift.rhai:2".into()));
    assert_eq!(shown[1]["unknown"], "lift.rhai");
}

#[test]
fn a_record_is_stepped_by_lines_as_far_as_it_holds_them() {
    let run = pour("level_side", 0.1, 0.066, 0.001);
    let steps = record::steps(&run.steps, &run.parse_graphs);
    let setup = || Setup { steps: true, ..Setup::default() };
    let script = Script::of(&["into", "next", "into", "quit"]);
    Stepper::new(script.clone(), setup()).over_record(&run.task, None, &steps);
    assert_eq!(script.all("line")[0]["line"]["text"], "arm.raise(by, by - 2.0 * cm, 0.3);");
    assert_eq!(script.all("inside").len(), 1, "of the second step no script is known");
    let mut bare = run.clone();
    bare.steps[0].lines.clear();
    let mut steps = record::steps(&bare.steps, &bare.parse_graphs);
    steps[0].0.script = Some("lift.rhai".into());
    let script = Script::of(&["into", "quit"]);
    Stepper::new(script.clone(), setup()).over_record(&bare.task, None, &steps);
    assert_eq!(script.all("no_lines").len(), 1);
}
