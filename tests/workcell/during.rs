//! Conditions in force while a whole run goes on, as they are kept and told.

use trueup::execution::calibrate::Switches;
use trueup::lab::{LabSettings, Spot};
use trueup::language::{Source, parse_line};
use trueup::report::why::{Question, why};
use trueup::trace::{Fared, Nobody};
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

/// What is measured while the arm moves is kept beside what the twin had, and `:why` tells both: the smallest
/// margin of a condition that held, and when an `until` became true.
#[test]
fn how_conditions_fared_is_kept_and_told_for_both_worlds() {
    let mut cell = open();
    let run = run(
        &mut cell,
        "{ rise(by: 5 cm) while height(gripper) <= 60 cm  rise(by: -15 cm) until height(gripper) <= 40 cm }",
    );
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
    let said = told(&run);

    let row = &run.steps[0].during[0];
    let least = |fared: &Fared| fared.least.as_ref().unwrap().value;
    let (measured, twin) = (least(&row.measured), least(row.twin.as_ref().unwrap()));
    assert!((measured - twin).abs() < 5e-3, "measured {measured}, in the twin {twin}");
    assert!(said.contains("tightest margin, in step 1 rise(by: 5 cm): "), "{said}");

    let row = &run.steps[1].during[0];
    assert!(row.ends && !row.measured.by_rehearsal);
    let (real, twin) = (row.measured.became_true_s.unwrap(), row.twin.as_ref().unwrap());
    assert!((real - twin.became_true_s.unwrap()).abs() < 0.13, "{row:?}");
    let line =
        format!("until height(gripper) <= 40 cm: true {real:.2} s into the step; in the twin");
    assert!(said.contains(&line), "{line}: {said}");
}
