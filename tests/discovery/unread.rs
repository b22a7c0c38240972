//! Cells that are no readings of their own: none is an effect, and the readings beside them say what they said.

use trueup::discovery::finding::{Finding, Verdict};
use trueup::discovery::recording::Recording;
use trueup::discovery::{Options, Subject, investigate};

use super::{bare_arm, number, recording};

/// What is found in two recordings whose columns were changed.
fn found(name: &str, change: impl Fn(&mut Recording)) -> Finding {
    let recordings = ["a", "b"].map(|which| {
        let mut recording = recording(&format!("{name}_{which}"));
        change(&mut recording);
        recording
    });
    let robot = bare_arm();
    let arm = Subject::Arm(&robot, &[]);
    investigate(&recordings, arm, &Options::default(), &mut |_, _| {}).unwrap().finding
}

fn is_noted(finding: &Finding, words: &str) -> bool {
    finding.notes.iter().any(|note| note.contains(words))
}

/// A cell of 9999 N·m in each joint's torques: such were `unknown(tau_6)`, two thousand million standard deviations above noise.
#[test]
fn cells_that_no_sensor_read_are_left_out() {
    let finding = found("coulomb", |recording| {
        let torques = recording.columns.iter_mut().filter(|c| c.name.starts_with("tau_"));
        for (at, column) in torques.enumerate() {
            column.values[37 + 61 * at] = 9999.0;
        }
    });
    assert_eq!(finding.verdict, Verdict::Named, "{finding:?}");
    let torque = number(&finding, "coulomb_friction", "torque");
    assert!((torque - 0.7896).abs() < 0.03, "{torque}");
    assert!(is_noted(&finding, "`tau_1` in line 39"), "{:?}", finding.notes);
}

/// Torques at half the rate of the log, each in two rows: such came half a row late.
#[test]
fn a_sensor_slower_than_the_log_is_not_late() {
    let finding = found("coulomb", |recording| {
        for column in recording.columns.iter_mut().filter(|c| c.name.starts_with("tau_")) {
            for row in 0..column.values.len() {
                column.values[row] = column.values[row - row % 2];
            }
        }
    });
    assert!(is_noted(&finding, "`tau` shows something new in"), "{:?}", finding.notes);
    assert_eq!(finding.verdict, Verdict::Named, "{finding:?}");
    let torque = number(&finding, "coulomb_friction", "torque");
    assert!((torque - 0.7896).abs() < 0.05, "{torque}");
}

/// A marker that was lost for 0.3 s was `unknown`, many times the noise.
#[test]
fn a_tracker_that_lost_its_marker_is_not_judged_there() {
    let finding = found("coulomb", |recording| {
        for column in recording.columns.iter_mut().filter(|c| c.name.starts_with("tcp_")) {
            let last = column.values[100];
            column.values[100..131].fill(last);
        }
    });
    assert_eq!(finding.verdict, Verdict::Named, "{finding:?}");
    assert_eq!(finding.effects[0].name, "coulomb_friction", "{finding:?}");
    assert!(is_noted(&finding, "`tcp` repeats one reading"), "{:?}", finding.notes);
}

/// Blanks every other row of a sensor.
fn blank(recording: &mut Recording, stem: &str, first: usize) {
    for column in recording.columns.iter_mut().filter(|c| c.name.starts_with(stem)) {
        column.values.iter_mut().skip(first).step_by(2).for_each(|value| *value = f64::NAN);
    }
}

/// Torques in every other row, positions and speeds in the others, as a table of two topics has them: each blank cell was an error of
/// its own.
#[test]
fn sensors_with_rows_of_their_own_are_judged_in_those() {
    let finding = found("coulomb", |recording| {
        blank(recording, "tau_", 1);
        blank(recording, "dq_", 0);
    });
    assert_eq!(finding.verdict, Verdict::Named, "{finding:?}");
    let torque = number(&finding, "coulomb_friction", "torque");
    assert!((torque - 0.7896).abs() < 0.05, "{torque}");
    assert!(is_noted(&finding, "250 of `tau_1`"), "{:?}", finding.notes);
}
