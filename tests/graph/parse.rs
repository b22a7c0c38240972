//! Parse graphs as what an executor walks.

use std::collections::BTreeMap;

use trueup::graph::energy::{self, Compared, Found};
use trueup::graph::{Energy, Evidence, Interval, ParseGraph, best, retry};
use trueup::language::ast::Remedy;

use super::tree::*;
use super::{Settings, built, kitchen};

fn pour() -> ParseGraph {
    let program = pouring();
    let graph = built(&program, &call("pour", &["jar", "cup"]));
    best(&graph, &Settings::new(&program, &kitchen).given()).unwrap()
}

#[test]
fn steps_stand_in_order_with_their_arguments() {
    let steps: Vec<_> = pour().steps.iter().map(|s| s.text.clone()).collect();
    assert_eq!(
        steps,
        [
            "approach(jar, side)",
            "grasp(jar, side)",
            "lift(jar, by: 12 cm)",
            "raise(jar, by: 15 cm)",
            "move_over(jar, cup)",
            "check above(jar, cup)",
            "pour_out(jar, to: 100 deg)",
            "untilt(jar)",
            "move_over(jar, tray)",
            "lower(jar)",
            "open_gripper()",
            "retreat(up: 10 cm)",
        ]
    );
}

fn texts(all: &[trueup::graph::Condition]) -> Vec<&str> {
    all.iter().map(|c| c.text.as_str()).collect()
}

#[test]
fn conditions_of_tasks_lie_on_their_first_and_last_steps() {
    let pg = pour();
    let first = &pg.steps[0];
    assert_eq!(
        texts(&first.needs),
        ["near(jar, cup)", "visible(jar) and not holding(any)", "gripper.open"],
        "outermost task first"
    );
    let lift = &pg.steps[2];
    assert_eq!(texts(&lift.gives), ["holding(jar)", "holding(jar)"]);
    assert_eq!(
        (lift.gives[0].owner.as_str(), lift.gives[1].owner.as_str()),
        ("pour/pick/lift", "pour/pick")
    );
    assert_eq!(texts(&lift.keeps), ["holding(jar)"]);
    let asked: Vec<_> =
        lift.gives[1].asks.iter().map(|q| q.with(|o| format!("transparent {o}"))).collect();
    assert_eq!(asked, ["Has the robot already picked up the transparent jar?"]);
    let last = pg.steps.last().unwrap();
    let gives = texts(&last.gives);
    assert_eq!(gives[0], "not holding(jar)", "innermost first");
    assert_eq!(gives[1], "volume(cup) >= 0.9 * filled(jar)");
    assert!(pg.steps[6].untils.iter().any(|c| c.text == "volume(cup) >= 0.9 * filled(jar)"));
    assert!(texts(&pg.steps[5].gives).contains(&"above(jar, cup)"), "a check asks its fluent");
    assert_eq!(pg.steps[3].together.as_deref(), Some("pour/together"));
}

#[test]
fn a_recovery_covers_the_call_it_names_and_the_outer_one_covers_everything() {
    let pg = pour();
    let of = |i: usize| -> Vec<&str> {
        pg.steps[i].recoveries.iter().map(|r| pg.recoveries[*r].path.as_str()).collect()
    };
    assert_eq!(of(1), ["pour/pick/on_failure", "pour/on_failure"], "innermost first");
    assert_eq!(of(0), ["pour/on_failure"]);
    let plan = &pg.recoveries[pg.steps[1].recoveries[0]];
    assert_eq!(plan.of.as_deref(), Some("grasp(jar)"));
    assert_eq!(plan.remedy, Some(Remedy::Retry { other: true, times: 2 }));
    assert_eq!(plan.steps.iter().map(|s| s.text.as_str()).collect::<Vec<_>>(), ["open_gripper()"]);
    let outer = &pg.recoveries[pg.steps[0].recoveries[0]];
    assert_eq!(outer.steps[0].text, "untilt(jar)");
    assert!(matches!(&outer.remedy, Some(Remedy::Abort(Some(why))) if why.contains("upright")));
}

/// 5.7 (5): stored and compared.
#[test]
fn a_parse_graph_survives_its_file_bit_for_bit() {
    let pg = pour();
    let text = serde_json::to_string(&pg).unwrap();
    let again: ParseGraph = serde_json::from_str(&text).unwrap();
    assert!(again == pg, "something was lost on the way");
    let program = pouring();
    let graph = built(&program, &call("pour", &["jar", "cup"]));
    let other =
        best(&graph, &Settings::new(&program, &kitchen).pin("pour/pick/either", "top").given())
            .unwrap();
    assert!(other != pg);
    assert_eq!(trueup::graph::infer::choices_that_differ(&other, &pg), 1);
}

#[test]
fn a_failed_grasp_is_tried_from_the_other_side_and_then_no_more() {
    let program = pouring();
    let graph = built(&program, &call("pour", &["jar", "cup"]));
    let settings = Settings::new(&program, &kitchen);
    let first = best(&graph, &settings.given()).unwrap();
    let mut tried = BTreeMap::new();
    let (second, from) = retry(&graph, &settings.given(), &first, 1, &mut tried).unwrap().unwrap();
    assert_eq!(second.branch("pour/pick/either"), Some("top"));
    assert_eq!(second.steps[from].text, "approach(jar, top)");
    assert_eq!(second.branch("pour/place/at"), first.branch("pour/place/at"));
    assert_eq!(retry(&graph, &settings.given(), &second, from + 1, &mut tried).unwrap(), None);
    // A step outside every choice has no other way.
    assert_eq!(retry(&graph, &settings.given(), &first, 7, &mut BTreeMap::new()).unwrap(), None);
}

/// 5.7 (11), as far as it is the graph's: another branch is another structure, told as such.
#[test]
fn twin_and_arm_are_matched_by_node() {
    let program = pouring();
    let graph = built(&program, &call("pour", &["jar", "cup"]));
    let twin = pour();
    assert_eq!(twin.matched(&pour()).both.len(), twin.steps.len());
    let top = Settings::new(&program, &kitchen).pin("pour/pick/either", "top");
    let matched = twin.matched(&best(&graph, &top.given()).unwrap());
    assert_eq!((matched.only_first, matched.only_second), (vec![0, 1], vec![0, 1]));
    assert_eq!(matched.both[0], (2, 2));
}

/// A recovery may name the arguments of a task, bare or not.
#[test]
fn a_recovery_of_a_task_covers_every_step_of_it() {
    use trueup::language::ast::{Item, Recovery};
    let mut program = pouring();
    for (index, key) in ["", "o"].into_iter().enumerate() {
        let mut outer =
            task("outer", vec![], vec![act(call("pick", &["jar"])), act(call("untilt", &["jar"]))]);
        outer.recoveries = vec![Recovery {
            of: Some(call_with("pick", vec![(key, vec![n("jar")])])),
            steps: vec![],
            remedy: Some(Remedy::Retry { other: false, times: 1 }),
            span: at(),
        }];
        program.items.push(Item::Task(outer));
        let graph = built(&program, &call("outer", &[]));
        let pg = best(&graph, &Settings::new(&program, &kitchen).given()).unwrap();
        let covered: Vec<bool> = pg.steps.iter().map(|s| s.recoveries.contains(&0)).collect();
        assert_eq!(covered, [true, true, true, false], "written way {index}");
    }
}

#[test]
fn what_a_decided_choice_took_for_granted_is_kept() {
    let pg = pour();
    let choice = pg.choices.iter().find(|c| c.node == "pour/if").unwrap();
    let assumed = choice.assumed.as_ref().unwrap();
    assert_eq!(
        (assumed.text.as_str(), assumed.value, assumed.is_known),
        ("lidded(jar)", false, true)
    );
    let program = pouring();
    let graph = built(&program, &call("pour", &["jar", "cup"]));
    let nobody = |_: &_| None;
    let guess = best(&graph, &Settings::new(&program, &nobody).given()).unwrap();
    let choice = guess.choices.iter().find(|c| c.node == "pour/if").unwrap();
    assert!(!choice.assumed.as_ref().unwrap().is_known);
}

/// 5.7 (8): the terms stand apart and add up.
#[test]
fn energy_is_the_sum_of_its_terms_and_each_term_answers_to_its_own_evidence() {
    let pg = pour();
    let silent = energy::energy(&pg, &Evidence::default());
    assert!((silent.total() + pg.log_p).abs() < 1e-12, "with no evidence only the choices cost");
    let mut evidence = Evidence::default();
    for (i, step) in pg.steps.iter().enumerate() {
        let t = i as f64;
        evidence.intervals.insert(step.path.clone(), Interval { from: t, to: t + 1.0 });
    }
    // The two steps done together overlap by the 0.3 s asked for.
    let (rising, moving) = (&pg.steps[3].path, &pg.steps[4].path);
    evidence.intervals.insert(rising.clone(), Interval { from: 3.0, to: 4.3 });
    evidence.intervals.insert(moving.clone(), Interval { from: 4.0, to: 5.0 });
    let timely = energy::energy(&pg, &evidence);
    assert!(timely.temporal.abs() < 1e-9, "{timely:?}");
    evidence.intervals.insert(rising.clone(), Interval { from: 3.0, to: 4.5 });
    let late = energy::energy(&pg, &evidence);
    assert!((late.temporal - 2.0).abs() < 1e-9, "0.2 s too much overlap: {}", late.temporal);
    let mut found = |step: usize, text: &str, sigmas: f64| {
        let found = Found { truth: Some(sigmas > 0.0), margin_in_sigmas: Some(sigmas) };
        let of = evidence.found.entry(pg.steps[step].path.clone()).or_default();
        of.insert(text.into(), found);
    };
    found(1, "reachable(jar, side) and gripper.open", -3.0);
    found(1, "contact(gripper, jar)", -2.0);
    found(5, "above(jar, cup)", 4.0);
    evidence.compared.push(Compared {
        fluent: "above(jar, cup)".into(),
        expected: Some(true),
        measured: Some(false),
        error_rate: energy::PAPER_ERROR_RATE,
    });
    let all = energy::energy(&pg, &evidence);
    assert!((all.spatial - 3.0).abs() < 1e-12 && (all.causal - 2.0).abs() < 1e-12, "{all:?}");
    let Energy { choice, temporal, spatial, causal, data } = all;
    assert!((all.total() - (choice + temporal + spatial + causal + data)).abs() < 1e-12);
    // Under the paper's error rate, one mismatch costs exactly 1 nat more than an agreement.
    evidence.compared[0].measured = Some(true);
    let agreed = energy::energy(&pg, &evidence);
    assert!((all.data - agreed.data - 1.0).abs() < 1e-12);
}

/// 5.7 (9): what no step speaks of is inert, and needs no declaration.
#[test]
fn the_fluent_vector_lists_what_is_spoken_of_once() {
    let fluents: Vec<_> = pour().fluents().iter().map(trueup::language::text::expr).collect();
    let unique: std::collections::BTreeSet<_> = fluents.iter().collect();
    assert_eq!(unique.len(), fluents.len());
    assert!(fluents.iter().any(|f| f == "above(jar, cup)"));
    assert!(!fluents.iter().any(|f| f.contains("lidded")), "the branch with the lid is not taken");
}
