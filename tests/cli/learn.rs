//! `learn`: what stored runs say of the branches they took.

use serde_json::{Value, json};
use trueup::graph::{self, infer::Given};
use trueup::language::{Library, Source, parse_line};
use trueup::world::{Pose, WorldState};

use crate::program::Scratch;

/// A stored run of `pick(jar)` whose grasp by `branch` worked or did not.
fn run(branch: &str, worked: bool, robot: &str) -> Value {
    run_of(&format!("pick(jar) via {branch}"), branch, worked, robot)
}

/// The same of another line that comes to that branch.
fn run_of(line: &str, branch: &str, worked: bool, robot: &str) -> Value {
    let mut library = Library::standard();
    let (step, _) = parse_line(line);
    let call = library.define(&Source::default(), &[step.unwrap()]);
    let graph = graph::build(&library, &call).unwrap();
    let given = Given {
        definitions: &library,
        holds: &|_: &trueup::language::ast::Expr| None,
        pins: &std::collections::BTreeMap::new(),
        priors: None,
        cost: &|_| 0.0,
    };
    let pg = graph::best(&graph, &given).unwrap();
    let state = WorldState {
        time: 0.0,
        q: Vec::new(),
        opening: 0.0,
        world_from_tool: Pose::upright(0.0, 0.0, 0.0, 0.0),
        held: None,
        objects: Vec::new(),
        spilt: None,
        unknown: Vec::new(),
    };
    let inside = pg.steps.iter().filter(|step| step.path.contains(&format!(".{branch}/")));
    let steps: Vec<Value> = inside
        .map(|step| {
            let failed = step.path.ends_with("grasp") && !worked;
            json!({
                "number": 1, "path": step.path, "action": step.text,
                "outcome": if failed { "failure" } else { "success" },
                "interval_s": [0.0, 1.0], "fluents": [], "hamming": 0, "score": 1.0,
                "measured": state, "twin": null,
            })
        })
        .collect();
    json!({
        "task": "pick(jar)", "outcome": if worked { "success" } else { "failure" }, "reached": worked,
        "seed": 1, "robot": robot, "version": "0.1.0", "steps": steps, "questions": [],
        "rehearsals": [], "parse_graphs": [pg],
        "timing_s": {"perceive": 0.0, "plan": 0.0, "simulate": 0.0, "execute": 0.0, "total": 0.0},
        "run_dir": null,
    })
}

pub(super) fn folders(scratch: &Scratch) {
    for (name, branch, worked, robot) in [
        ("a", "level_side", true, "lab"),
        ("b", "level_side", false, "lab"),
        ("c", "tilted_side", true, "lab"),
        ("d", "level_side", true, "twin"),
    ] {
        scratch.file(&format!("runs/{name}/run.json"), run(branch, worked, robot).to_string());
    }
}

#[test]
fn runs_are_counted_once_by_domain_and_only_when_asked() {
    let scratch = Scratch::new("cli-learn");
    folders(&scratch);
    let read = |name: &str| std::fs::read_to_string(scratch.path(name)).unwrap_or_default();
    let said = scratch.trueup(&["learn", "runs", "--dry"]);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(
        said.out.contains("pick/either.level_side  on the arm  worked 0 of 0, now worked 1 of 2"),
        "{}",
        said.out
    );
    assert!(
        said.out.contains("pick/either.level_side  in the twin  worked 0 of 0, now worked 1 of 1"),
        "{}",
        said.out
    );
    assert_eq!(read("runs/outcomes-real.jsonl"), "", "--dry changes nothing");

    scratch.trueup(&["learn", "runs/a", "--quiet"]);
    let first = read("runs/outcomes-real.jsonl");
    assert_eq!(first.lines().count(), 1);
    // The rest is added at the end; what stands there is left alone, and nothing is counted twice.
    let json = scratch.trueup(&["learn", "runs", "--json"]).json();
    assert_eq!((json["runs"].as_u64(), json["known_before"].as_u64()), (Some(3), Some(1)));
    let all = read("runs/outcomes-real.jsonl");
    assert!(all.starts_with(&first) && all.lines().count() == 3);
    assert_eq!(read("runs/outcomes-twin.jsonl").lines().count(), 1);
    assert_eq!(scratch.trueup(&["learn", "runs", "--json"]).json()["runs"], 0);
    // The graph shows what is known.
    let said = scratch.trueup(&["graph", "pick(jar)"]);
    assert!(said.out.contains("worked 1 of 2"), "{}", said.out);
}

/// A second round of `repeat … until` that was not needed counted as a grasp that worked.
#[test]
fn what_was_not_needed_teaches_nothing() {
    let scratch = Scratch::new("cli-learn-spared");
    let mut spared = run("level_side", true, "lab");
    for step in spared["steps"].as_array_mut().unwrap() {
        step["not_needed"] = json!("rests_on(jar, left_of(cup))");
    }
    scratch.file("runs/a/run.json", run("level_side", true, "lab").to_string());
    scratch.file("runs/b/run.json", spared.to_string());
    let said = scratch.trueup(&["learn", "runs", "--dry"]);
    assert!(said.out.contains("worked 0 of 0, now worked 1 of 1"), "{}", said.out);
}

#[test]
fn demonstrations_move_the_priors_and_nothing_else() {
    let scratch = Scratch::new("cli-learn-shown");
    folders(&scratch);
    let json = scratch.trueup(&["learn", "runs", "--demonstrations", "--json"]).json();
    assert_eq!(json["counts"], json!({"pick/either.level_side": 3, "pick/either.tilted_side": 1}));
    assert!(!scratch.path("runs/outcomes-real.jsonl").exists());
    let said = scratch.trueup(&["graph", "pick(jar)"]);
    // Ten earlier ones at 0.6 and three of four shown: 9 of 14.
    assert!(said.out.contains("prior 0.64"), "{}", said.out);
}

/// A plain `pick(jar)` counted as a demonstration of what the planner took, and once more each time it was learnt from: the
/// lock-in that priors are kept apart for.
#[test]
fn what_the_robot_chose_is_no_demonstration_and_a_run_counts_once() {
    let scratch = Scratch::new("cli-learn-own");
    scratch.file("runs/own/run.json", run_of("pick(jar)", "level_side", true, "lab").to_string());
    let learn = ["learn", "runs", "--demonstrations"];
    let json = scratch.trueup(&[&learn[..], &["--json"]].concat()).json();
    assert_eq!(json["counts"], json!({}));
    assert_eq!(
        (json["demonstrations"].as_u64(), json["without_choice"].as_u64()),
        (Some(0), Some(1))
    );
    assert!(!scratch.path("runs/priors.json").exists());

    scratch.file("runs/asked/run.json", run("tilted_side", true, "lab").to_string());
    for known in [0, 1] {
        let json = scratch.trueup(&[&learn[..], &["--json"]].concat()).json();
        assert_eq!(json["counts"], json!({"pick/either.tilted_side": 1}));
        assert_eq!(json["known_before"].as_u64(), Some(known));
    }
    let said = scratch.trueup(&learn);
    assert!(said.out.contains("pick/either.tilted_side  chosen 1 time\n"), "{}", said.out);
    assert!(said.out.contains("learnt from: 0 runs; known before: 1"), "{}", said.out);
}

#[test]
fn what_is_no_run_is_refused() {
    let scratch = Scratch::new("cli-learn-bad");
    scratch.file("empty/notes.txt", "nothing");
    assert_eq!(scratch.trueup(&["learn", "empty", "--json"]).error("code"), "learn::none");
    scratch.file("spoilt/run.json", "{}");
    assert_eq!(scratch.trueup(&["learn", "spoilt", "--json"]).error("code"), "learn::run");
    folders(&scratch);
    scratch.file("runs/outcomes-real.jsonl", "nonsense}\n");
    assert_eq!(scratch.trueup(&["learn", "runs/a", "--json"]).error("code"), "learn::file");
}
