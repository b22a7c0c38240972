//! Conditions in force while a whole run goes on: what the arm loses and the twin did not, and what then.

use trueup::execution::calibrate::Switches;
use trueup::execution::trace::{Fared, Nobody, Outcome};
use trueup::lab::{LabSettings, Spot};
use trueup::language::{Source, parse_line};
use trueup::report::why::{Question, why};
use trueup::workcell::{Ending, Options, Run, WorkCell};

use super::options;

/// A cell with an action that moves the tool up or down, on a laboratory that is not quite as assumed.
fn open() -> WorkCell {
    let mut lab = LabSettings::default();
    for (name, x_m, y_m) in [("jar", 0.60, 0.10), ("cup", 0.58, -0.22)] {
        lab.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad: 0.3 });
    }
    let text = "action rise(by: Length) { run \"rise.rhai\" }\n";
    let mut options = Options {
        switches: Switches { offset: false, ..Switches::default() },
        script: Some(Source::new("rise.task", text)),
        ..options(lab, 1)
    };
    options.stdlib.add_script("rise.rhai", "arm.move_by([0.0, 0.0, by], 0.2);");
    WorkCell::open(options).unwrap()
}

/// Runs a block of steps as the prompt does.
fn run(cell: &mut WorkCell, steps: &str) -> Run {
    let (step, wrong) = parse_line(steps);
    assert!(wrong.is_empty(), "{wrong:?}");
    let call = cell.define(&Source::new("prompt", steps), &[step.unwrap()]);
    cell.run(&call, None, Box::new(Nobody)).unwrap()
}

fn told(run: &Run) -> String {
    let place = |_: &str| None;
    why(&Question { run, number: None, fluent: None, earlier: &[], place: &place }).unwrap()
}

/// The arm goes a hair higher than its twin. A limit between the two is kept in the rehearsal and broken on the
/// arm, which stops, and recovers as the text says. An `until` is true on the arm when it is in the twin.
#[test]
fn what_only_the_arm_breaks_stops_it_and_the_recovery_follows() {
    let mut cell = open();
    let kept = run(&mut cell, "{ rise(by: 5 cm) while height(gripper) <= 60 cm  rise(by: -5 cm) }");
    assert_eq!(kept.outcome, Ending::Success, "{:?}", kept.reason);
    let row = &kept.steps[0].during[0];
    let least = |fared: &Fared| fared.least.as_ref().unwrap().value;
    let (measured, twin) = (least(&row.measured), least(row.twin.as_ref().unwrap()));
    assert!(twin - measured > 5e-5, "measured {measured}, in the twin {twin}");
    let limit = 0.60 - 0.5 * (measured + twin);

    let broken = run(
        &mut cell,
        &format!(
            "{{ rise(by: 5 cm) while height(gripper) <= {limit:.6} m
                on failure {{ rise(by: -5 cm) abort \"that is too high\" }} }}"
        ),
    );
    assert_eq!(broken.outcome, Ending::Failure);
    let reason = broken.reason.as_deref().unwrap();
    assert!(reason.starts_with("rise(by: 5 cm): it lost `height(gripper) <= "), "{reason}");
    assert!(reason.ends_with("; that is too high"), "{reason}");
    let did: Vec<_> = broken.steps.iter().map(|s| (s.action.as_str(), s.outcome)).collect();
    assert_eq!(did, [("rise(by: 5 cm)", Outcome::Failure), ("rise(by: -5 cm)", Outcome::Success)]);
    assert!(broken.rehearsals[0].success, "it was kept in the twin");
    let said = told(&broken);
    assert!(said.contains("smallest margin -") && said.contains("in the twin +"), "{said}");

    let low = run(&mut cell, "{ rise(by: -15 cm) until height(gripper) <= 40 cm }");
    assert_eq!(low.outcome, Ending::Success, "{:?}", low.reason);
    let row = &low.steps[0].during[0];
    assert!(row.ends && !row.measured.by_rehearsal);
    let (real, twin) = (row.measured.became_true_s.unwrap(), row.twin.as_ref().unwrap());
    assert!((real - twin.became_true_s.unwrap()).abs() < 0.13, "{row:?}");
    let line =
        format!("until height(gripper) <= 40 cm: true {real:.2} s into the step; in the twin");
    let said = told(&low);
    assert!(said.contains(&line), "{line}: {said}");
}
