//! The scale with a cable stands under one vessel: of a pour into another one it says nothing.

use trueup::discovery::recording::{Map, Recording};
use trueup::motion::Robot;
use trueup::report::Style;
use trueup::report::run::ending;
use trueup::trace::{Deed, FluentRow, Line, Outcome, StepRecord};
use trueup::workcell::{Run, Water, carried, poured};

use crate::kitchen;

/// A step of a second that did something, with so much in the jar after it, m³, and the jar in the hand or not.
fn step(number: usize, deed: Option<Deed>, water: f64, is_held: bool) -> StepRecord {
    let mut measured = kitchen::state([0.5, 0.1, 0.0], [0.6, -0.1, 0.0]);
    measured.objects[0].water = Some(water);
    measured.held = is_held.then(|| "jar".to_owned());
    let line = |deed| Line {
        script: "a.rhai".into(),
        line: 1,
        text: String::new(),
        does: String::new(),
        at_s: 0.0,
        deed: Some(deed),
    };
    StepRecord {
        number,
        path: "pour/step".into(),
        action: "step()".into(),
        call: None,
        outcome: Outcome::Success,
        not_needed: None,
        reason: None,
        failure: None,
        interval_s: [number as f64 - 1.0, number as f64],
        fluents: Vec::new(),
        during: Vec::new(),
        lines: deed.into_iter().map(line).collect(),
        planned_q: Vec::new(),
        hamming: 0,
        score: 1.0,
        measured,
        twin: None,
    }
}

/// A pour of 150 mL into `target`, with the scale under `under`.
fn run(target: &str, under: Option<&str>) -> Run {
    let took = Deed::Took { object: "jar".into() };
    let turned = Deed::Turned { source: "jar".into(), target: target.into() };
    let steps = [
        step(1, None, 150e-6, false),
        step(2, Some(took), 150e-6, true),
        step(3, Some(turned), 0.0, true),
        step(4, Some(Deed::Released), 0.0, false),
    ];
    Run { scale_under: under.map(str::to_owned), ..Run::so_far("pour(jar, bigcup)", &steps) }
}

/// Five seconds in which the scale's reading does not change.
fn recording() -> Recording {
    let rows: Vec<String> =
        (0..500).map(|row| format!("{:.2},0.1", 0.01 * f64::from(row))).collect();
    let csv = format!("t[s],mass[kg]\n{}\n", rows.join("\n"));
    Recording::read("arm.csv", &csv, None, &Map::default()).unwrap()
}

/// A jar was poured into `bigcup` beside a scale under `cup`, and `gap` said that it had held 0.32 mL.
#[test]
fn a_pour_beside_the_scale_is_not_compared_with_it() {
    let (robot, scene) = (Robot::gen3(), kitchen::scene());
    // A run of an older program does not say where the scale stood: under the cup, as it usually does.
    for under in [Some("cup"), None] {
        let refused =
            poured::pour(&run("bigcup", under), &recording(), &robot, &scene).unwrap_err();
        let told = refused.to_string();
        assert!(told.contains("`bigcup`") && told.contains("under `cup`"), "{told}");
    }
    // On the scale it is looked at: then the joints are missed.
    let refused = poured::pour(&run("cup", None), &recording(), &robot, &scene).unwrap_err();
    assert!(refused.to_string().contains("joint"), "{refused}");
}

#[test]
fn what_left_the_hand_is_not_read_off_a_scale_beside_it() {
    let (robot, scene) = (Robot::gen3(), kitchen::scene());
    let left = |target: &str| {
        let mut recording = recording();
        carried::carried(&run(target, Some("cup")), &mut recording, &robot, &scene);
        recording.sidecar.carried[0].contents_kg.last().unwrap()[1]
    };
    assert!(left("bigcup").abs() < 1e-9, "{} kg", left("bigcup"));
    assert!((left("cup") - 0.15).abs() < 1e-9, "{} kg", left("cup"));
}

/// Half of it was beside the cup, and the last word was that simulation and camera agree.
#[test]
fn amounts_that_the_scales_find_otherwise_are_told_beside_fluents_that_agree() {
    let mut run = run("cup", None);
    let last = run.steps.last_mut().unwrap();
    let mut twin = last.measured.clone();
    (twin.objects[0].water, twin.objects[1].water, twin.spilt) =
        (Some(0.0), Some(150e-6), Some(0.0));
    last.twin = Some(twin);
    last.fluents = vec![FluentRow {
        name: "level(jar)".into(),
        expected: None,
        twin: Some(true),
        measured: Some(true),
        margin: None,
        twin_margin: None,
        ask: None,
        why: None,
        std: None,
        direction: None,
        terms: Vec::new(),
    }];
    let said = |in_cup: f64, spilt_ml: f64| Water {
        in_target_ml: in_cup,
        in_source_ml: 0.0,
        vessels_ml: vec![("jar".into(), 0.0), ("cup".into(), in_cup)],
        spilt_ml,
        measured_by: "lab".into(),
    };
    run.water = Some(said(69.1, 80.9));
    let told = ending(&run, Style::plain());
    let line = "simulation and scales disagree: simulated 0.0 mL spilt, on the scales 80.9 mL; \
                simulated 150.0 mL in cup, on the scales 69.1 mL (simulation and camera agree on 1 of 1 fluents after 4 steps)";
    assert!(told.contains(line), "{told}");
    // A few drops, and a cup filled by hand.
    run.water = Some(said(155.0, 2.0));
    let told = ending(&run, Style::plain());
    assert!(told.contains("simulation and camera agree (1 of 1 fluents after 4 steps)"), "{told}");
}
