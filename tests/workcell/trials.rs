//! Trials: what a run counts for, the table, and the command that goes on where it ended.

use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::{Field, Row};
use serde_json::json;
use trueup::execution::calibrate::Switches;
use trueup::workcell::trials::{Trial, table};
use trueup::workcell::{Aims, Ending, Error, Water, WorkCell};

use super::{call, plain};
use crate::program::Scratch;
use crate::repl::kept::pour;

/// A pour that ended with so much water in the cup, the jar and on the table, mL.
fn trial(seed: u64, target: f64, source: f64, spilt: f64) -> Trial {
    let mut run = pour("level_side", 0.1, 0.01, 0.001);
    run.seed = seed;
    let (in_target_ml, in_source_ml, spilt_ml) = (target, source, spilt);
    let vessels_ml = vec![("jar".into(), source), ("cup".into(), target)];
    let measured_by = "lab".into();
    run.water = Some(Water { in_target_ml, in_source_ml, vessels_ml, spilt_ml, measured_by });
    run.aims = Some(Aims { holds: true, pours: true });
    Trial::of(&run, Switches::default())
}

/// A column of a Parquet file as text, `-` where nothing is.
fn column(file: &str, name: &str) -> Vec<String> {
    let reader = SerializedFileReader::try_from(std::path::Path::new(file)).unwrap();
    let rows = reader.get_row_iter(None).unwrap().map(Result::unwrap);
    let one = |row: Row| {
        let (_, field) = row.get_column_iter().find(|(own, _)| *own == name).unwrap();
        if matches!(field, Field::Null) { "-".to_owned() } else { field.to_string() }
    };
    rows.map(one).collect()
}

#[test]
fn trials_are_a_table_in_parquet() {
    let scratch = Scratch::new("trials-parquet");
    let (poured, mut refused) = (trial(7, 150.0, 4.0, 0.5), trial(u64::MAX, 0.0, 150.0, 12.0));
    refused = Trial { outcome: None, in_target_ml: None, without: vec![1, 3], ..refused };
    let lines = [&poured, &refused].map(|trial| serde_json::to_string(trial).unwrap() + "\n");
    scratch.file("t/trials.jsonl", lines.concat());
    let said = scratch.trueup(&["trials", "merge", "t", "--parquet", "t.parquet"]);
    assert_eq!(said.code, 0, "{said:?}");
    assert!(said.err.contains("2 trials are a table in t.parquet"), "{said:?}");
    let path = scratch.path("t.parquet").display().to_string();
    assert_eq!(column(&path, "seed"), ["7", "18446744073709551615"]);
    assert_eq!(column(&path, "outcome"), [json!("success").to_string(), "-".into()]);
    assert_eq!(column(&path, "in_target_ml"), ["150.0", "-"]);
    assert_eq!(column(&path, "spilt_ml"), ["0.5", "12.0"]);
    assert_eq!(column(&path, "arm_s"), ["8.0", "8.0"]);
    assert_eq!(column(&path, "without_regression_1"), ["false", "true"]);
    assert_eq!(column(&path, "without_regression_2"), ["false", "false"]);
    let unwritten = scratch.trueup(&["trials", "merge", "t", "--parquet", "none/t.parquet"]);
    assert_eq!(unwritten.code, 2, "{unwritten:?}");
}

#[test]
fn a_part_that_is_missing_is_told() {
    let scratch = Scratch::new("trials-parts");
    let line = |seed| serde_json::to_string(&trial(seed, 150.0, 4.0, 0.5)).unwrap() + "\n";
    let told = |name: &str, seed| {
        scratch.file(name, line(seed));
        let said = scratch.trueup(&["trials", "merge", "t"]);
        assert_eq!(said.code, 0, "{said:?}");
        said.err
    };
    let said = told("t/trials-1of2.jsonl", 1);
    assert!(said.contains("part 2 of 2 is not among these files"), "{said}");
    let said = told("t/trials-2of2.jsonl", 2);
    assert!(!said.contains("not among"), "{said}");
    let said = told("t/trials-2of4.jsonl", 3);
    assert!(said.contains("parts 1, 3, 4 of 4 are not among these files"), "{said}");
    let said = told("t/trials-1of18446744073709551615.jsonl", 4);
    assert!(said.contains("18446744073709551614 of 18446744073709551615 parts are"), "{said}");
}

#[test]
fn a_pour_counts_as_the_paper_counts() {
    let clean = trial(1, 150.0, 4.0, 0.0);
    assert_eq!((clean.picked, clean.poured), (Some(true), Some(true)));
    assert!(clean.is_clean());
    // Two steps of 4 s.
    assert!((clean.arm_s - 8.0).abs() < 1e-12);
    let leaky = trial(2, 148.0, 0.0, 6.0);
    let short = trial(3, 120.0, 30.0, 0.0);
    let wet = trial(4, 138.0, 0.0, 12.0);
    let mut refused = trial(5, 0.0, 150.0, 0.0);
    refused = Trial { outcome: None, picked: None, poured: None, in_target_ml: None, ..refused };
    let rows = table(&[clean, leaky, short, wet, refused], 10.0);
    let [row] = &rows[..] else { panic!("{rows:?}") };
    assert_eq!((row.method.as_str(), row.n), ("all regressions", 5));
    let counts = [row.pick_up, row.pour_water, row.success_soft, row.success_hard];
    let counts = counts.map(|share| share.map(|share| (share.yes, share.of)));
    // 138 of 150 mL is 92 %: poured, and too much on the table even for soft.
    assert_eq!(counts, [Some((4, 5)), Some((3, 5)), Some((2, 5)), Some((1, 5))]);
    let failed: Vec<_> = row.failures.iter().map(|failed| failed.seed).collect();
    assert_eq!(failed, [2, 3, 4, 5]);
    assert_eq!(row.failures[0].reason, "water on the table");
    assert_eq!(row.failures[1].reason, "not all of the water arrived");
    let poured = row.in_target_ml.unwrap();
    assert!((poured.mean - (150.0 + 148.0 + 138.0) / 3.0).abs() < 1e-9, "{poured:?}");
}

#[test]
fn what_is_given_up_before_its_first_step_fails_in_every_column_of_its_task() {
    let counts = |holds: bool, pours: bool| {
        let (aims, why) = (Aims { holds, pours }, Error::NotSeen("jar".into()));
        let refused = |seed| Trial::refused(seed, Switches::default(), "t()", aims, &why, 1.0);
        let rows = table(&[refused(1), refused(2)], 10.0);
        let row = &rows[0];
        [row.pick_up, row.pour_water, row.success_soft].map(|share| share.map(|s| (s.yes, s.of)))
    };
    let none = Some((0, 2));
    assert_eq!(counts(true, true), [none, none, none]);
    assert_eq!(counts(true, false), [none, None, none]);
    assert_eq!(counts(false, false), [None, None, none]);
}

#[test]
fn what_a_call_aims_at_is_known_before_it_is_done() {
    let cell = WorkCell::open(plain()).unwrap();
    for (text, holds, pours) in [
        ("pour(jar, cup)", true, true),
        ("pick(jar)", true, false),
        // It takes nothing, whatever recovers from its failure.
        ("look()", false, false),
    ] {
        let graph = cell.graph(&call(text)).unwrap();
        assert_eq!(cell.aims(&graph), Aims { holds, pours }, "{text}");
    }
}

/// Published values of Wilson's interval at 95 %.
#[test]
fn the_interval_is_wilsons() {
    let poured = |yes: u64, of: u64| {
        let trials: Vec<Trial> = (0..of)
            .map(|i| if i < yes { trial(i, 150.0, 0.0, 0.0) } else { trial(i, 1.0, 149.0, 0.0) })
            .collect();
        table(&trials, 10.0)[0].pour_water.unwrap().wilson_95
    };
    for ((yes, of), [low, high]) in [
        ((20, 20), [0.8389, 1.0]),
        ((15, 20), [0.5313, 0.8881]),
        ((0, 10), [0.0, 0.2775]),
        ((1, 2), [0.0945, 0.9055]),
    ] {
        let [a, b] = poured(yes, of);
        assert!((a - low).abs() < 1e-4 && (b - high).abs() < 1e-4, "{yes}/{of}: {a} {b}");
    }
}

#[test]
fn rows_are_the_sets_that_were_left_out_and_the_last_trial_of_a_seed_counts() {
    let without = |which: &[u8], seed: u64, target: f64| Trial {
        without: which.to_vec(),
        ..trial(seed, target, 150.0 - target, 0.0)
    };
    let trials = [
        without(&[3], 1, 10.0),
        without(&[], 1, 10.0),
        without(&[], 1, 150.0),
        without(&[1, 2], 1, 150.0),
        without(&[], 2, 150.0),
    ];
    let rows = table(&trials, 10.0);
    let names: Vec<_> = rows.iter().map(|row| (row.method.as_str(), row.n)).collect();
    let expected =
        [("all regressions", 2), ("without regression 3", 1), ("without regressions 1, 2", 1)];
    assert_eq!(names, expected);
    assert_eq!(rows[0].pour_water.unwrap().yes, 2);
    assert_eq!(
        Trial::of(&pour("a", 0.1, 0.064, 0.001), Switches::default()).outcome,
        Some(Ending::Failure)
    );
}

/// Nothing hidden and regression 3 spared, so that a trial is a second's work.
const PLAIN: &str = "[switches]\ncamera_pose = false\nlens = false\nsensor = false\nlight = false\n\
    zero_offsets = false\ntool_offset = false\njoint_friction = false\ncompliance = false\n\
    latency = false\nreadings = false\nsurfaces = false\nfill = false\n";

#[test]
fn trials_go_on_where_they_ended_and_shards_make_one_table() {
    let scratch = Scratch::new("trials");
    scratch.file("plain.toml", PLAIN);
    let with = ["--lab", "plain.toml", "--without-regression", "3", "--out", "t"];
    let try_it = |more: &[&str]| {
        let said = scratch.trueup(&[&["trials", "--task", "look()"], more, &with].concat());
        assert_eq!(said.code, 0, "{}{}", said.out, said.err);
        said
    };
    let first = try_it(&["--n", "1"]);
    assert!(
        first.err.contains("trial 1 of 1: seed 1 without regression 3: done; 0.0 mL spilt"),
        "{}",
        first.err
    );
    assert!(first.out.lines().nth(1).unwrap().starts_with("without regression 3"), "{}", first.out);
    let second = try_it(&["--n", "2", "--json"]).document("trials");
    assert_eq!((second["done"].as_u64(), second["stopped"].as_bool()), (Some(2), Some(false)));
    let row = &second["rows"][0];
    assert_eq!((row["success_hard"]["yes"].as_u64(), row["n"].as_u64()), (Some(2), Some(2)));
    assert_eq!(
        (&row["pick_up"], &row["pour_water"]),
        (&serde_json::Value::Null, &serde_json::Value::Null)
    );
    let kept = std::fs::read_to_string(scratch.path("t/trials.jsonl")).unwrap();
    assert_eq!(kept.lines().count(), 2, "the first was not made again: {kept}");
    let runs = trueup::workcell::archive::entries(&scratch.path("t"));
    let seeds: Vec<u64> = runs.iter().map(|run| run.load().unwrap().seed).collect();
    assert_eq!(seeds, [1, 2]);
    // What another machine made of its part.
    let other = kept.lines().last().unwrap().replace("\"seed\":2", "\"seed\":3");
    scratch.file("t/trials-2of2.jsonl", other);
    scratch.trueup(&["trials", "merge", "t", "--json"]).document("trials-merge");
    let whole = scratch.trueup(&["trials", "merge", "t", "--csv"]);
    let row = whole.out.lines().nth(1).unwrap();
    assert!(row.starts_with("without regression 3,3,,,,,,,3,"), "{}", whole.out);
    let spoilt = kept.lines().next().unwrap().replace("\"setup\":\"", "\"setup\":\"0");
    scratch.file("t/trials-1of2.jsonl", spoilt);
    let said = scratch.trueup(&["trials", "merge", "t", "--json"]);
    assert_eq!((said.code, said.error("code")), (2, "trials::setup".to_owned()));
    // Another task is another table.
    let said = scratch.trueup(&["trials", "--task", "home()", "--n", "1", "--out", "t", "--json"]);
    assert_eq!((said.code, said.error("code")), (2, "trials::setup".to_owned()));
}

/// A seed that takes too long is a trial that failed, and the next has its turn.
#[test]
fn a_trial_beyond_its_budget_has_failed_and_trials_go_on() {
    let scratch = Scratch::new("trials-budget");
    scratch.file("plain.toml", PLAIN);
    let args = [
        "trials",
        "--task",
        "pour(jar, cup)",
        "--n",
        "2",
        "--budget",
        "0.3",
        "--lab",
        "plain.toml",
    ];
    let said = scratch.trueup(&[&args[..], &["--out", "t", "--json"]].concat());
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    let document = said.document("trials");
    assert_eq!(document["done"], 2);
    for trial in document["trials"].as_array().unwrap() {
        assert_eq!(
            (&trial["outcome"], &trial["reason"]),
            (&json!("failure"), &json!("not within 0.3 s"))
        );
        assert_eq!((&trial["picked"], &trial["poured"]), (&json!(false), &json!(false)));
    }
    assert_eq!(document["rows"][0]["failures"][1]["reason"], "not within 0.3 s");
    for bad in ["0", "-1", "nan", "1e300", "soon"] {
        let said = scratch.trueup(&["trials", "--task", "look()", "--budget", bad, "--json"]);
        assert_eq!((said.code, said.error("code")), (2, "usage".to_owned()), "{bad}");
    }
}

#[test]
fn what_cannot_be_tried_is_said() {
    let scratch = Scratch::new("trials-wrong");
    let code = |args: &[&str]| {
        let said = scratch.trueup(&[&["trials"], args, &["--json"]].concat());
        assert_eq!(said.code, 2, "{}", said.out);
        said.error("code")
    };
    assert_eq!(code(&[]), "usage");
    assert_eq!(code(&["--task", "look()", "--shard", "3/2"]), "usage");
    assert_eq!(code(&["--task", "look()", "--robot", "kortex://me@10.0.0.9"]), "trials::robot");
    assert_eq!(code(&["--task", "lok()"]), "task::unknown_name");
    for none in ["nofile.task", "scripts/nofile"] {
        assert_eq!(code(&["--task", none]), "io::missing", "{none}");
    }
    assert_eq!(code(&["--task", "look()", "--ablate", "4"]), "usage::regression");
    scratch.file("empty/trials.jsonl", "");
    assert_eq!(code(&["merge", "empty"]), "trials::none");
    assert!(scratch.path("trials").read_dir().is_err(), "nothing was made for a mistake");
}
