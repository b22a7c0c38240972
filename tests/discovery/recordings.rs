//! Reading recordings: what is right is read in SI, what is wrong is told with its place and a help.

use std::fmt::Write as _;

use trueup::discovery::finding::Verdict;
use trueup::discovery::recording::{Column, Map, Recording, Sidecar};
use trueup::discovery::{Options, Subject, investigate};
use trueup::motion::dynamics::{Bodies, Dynamics};
use trueup::units::Dimension;

use super::{bare_arm, recording};

fn read(csv: &str) -> Result<Recording, String> {
    read_with(csv, None, "")
}

fn read_with(csv: &str, sidecar: Option<&str>, map: &str) -> Result<Recording, String> {
    let map = Map::parse(map)
        .map_err(|error| format!("{} | {} | {}", error.what, error.place, error.help))?;
    Recording::read("r.csv", csv, sidecar.map(|text| ("r.json", text)), &map)
        .map_err(|error| format!("{} | {} | {}", error.what, error.place, error.help))
}

#[test]
fn units_become_si() {
    let r = read("t[ms],q_1[deg],tau_1[N*m]\n0,90,1\n10,180,2\n20,0,3\n").unwrap();
    assert_eq!(r.time, [0.0, 0.01, 0.02]);
    let q = r.column("q_1", Dimension::ANGLE).unwrap();
    assert!((q[1] - std::f64::consts::PI).abs() < 1e-12);
    assert_eq!(r.column("tau_1", Dimension::TORQUE).unwrap(), [1.0, 2.0, 3.0]);
}

#[test]
fn units_may_stand_in_a_second_header_line() {
    let with = |first, units| read(&format!("{first};q_1\n{units}\n0;90\n10;180\n20;0\n"));
    for units in ["ms;deg", "[ms];[deg]"] {
        let r = with("t", units).unwrap();
        assert_eq!(r.time, [0.0, 0.01, 0.02], "{units}: {:?}", r.notes);
        let q = r.column("q_1", Dimension::ANGLE).unwrap()[1];
        assert!((q - std::f64::consts::PI).abs() < 1e-12, "{units}");
    }
    assert_eq!(with("t[ms]", ";deg").unwrap().time, with("t[ms]", "ms;deg").unwrap().time);
    let wrong = with("t[s]", "ms;deg").unwrap_err();
    assert!(wrong.contains("second header line, of which `ms`"), "{wrong}");
    assert!(with("t", "ms;Deg").unwrap_err().contains("write `deg`"));
}

/// Stamps of ROS as integers: `t[ns]` was no unit, and a number of 1.7e18 is exact to 256 ns only.
#[test]
fn nanoseconds_since_the_epoch_are_a_time() {
    let mut csv = "t[ns],q_1[rad]\n".to_owned();
    for row in 0..20_u64 {
        writeln!(csv, "{},{row}", 1_734_567_800_123_456_789 + row * 1_000_000).unwrap();
    }
    let r = read(&csv).unwrap();
    assert_eq!((r.n_rows(), r.notes.len()), (20, 0), "{:?}", r.notes);
    assert!((r.step() - 1e-3).abs() < 1e-6 && (r.duration() - 0.019).abs() < 1e-6);
    let wrong = read(&csv.replace("t[ns]", "t[US]")).unwrap_err();
    assert!(wrong.contains("`US` is not a unit") && wrong.contains("write `[us]`"), "{wrong}");
    // Called seconds, or nothing at all, they are no time that a clock shows.
    assert!(read(&csv.replace("t[ns]", "t")).unwrap_err().contains("`t[ns]`"));
}

#[test]
fn foreign_names_are_mapped_and_get_the_unit_they_lack() {
    let csv = "t_s,u_pump_V,level\n0,1,2\n4,1,2\n8,1,3\n";
    let r = read_with(csv, None, "t_s=t[s],u_pump_V=u[mV],level=y").unwrap();
    assert_eq!(r.time, [0.0, 4.0, 8.0]);
    assert!((r.column("u", Dimension::VOLTAGE).unwrap()[0] - 1e-3).abs() < 1e-15);
    assert!(r.has("y"));
    let wrong = read_with(csv, None, "t_x=t[s]").unwrap_err();
    assert!(wrong.contains("`t_x`") && wrong.contains("t_s, u_pump_V, level"), "{wrong}");
    assert!(read_with(csv, None, "t_s").unwrap_err().contains("THEIRS=OURS"));
    assert!(read_with(csv, None, "t_s=t[parsec]").unwrap_err().contains("not a unit"));
}

#[test]
fn every_mistake_says_what_where_and_what_helps() {
    let cases = [
        ("", "the file is empty", "r.csv"),
        ("q_1[rad]\n1\n2\n3\n", "no time column", "r.csv:1"),
        ("t[s],q_1[rad]\n", "there are no rows", "r.csv"),
        ("t[s],q_1[rad]\n0,1\n1,2\n", "there are 2 rows", "r.csv"),
        (
            "t[s],q_1[rad]\n0,1\n1,2\n0.5,3\n",
            "time goes back from 1 s to 0.5 s",
            "r.csv:4, column `t`",
        ),
        ("t[s],q_1[rad]\n0,1\n1,2\n1,3\n", "two different rows are of the same time", "r.csv:4"),
        ("t[s],q_1[rad]\n0,1\nnan,2\n2,3\n", "`nan` is not a time", "r.csv:3, column `t`"),
        ("t[s],q_1[rad]\n0,1\n1\n2,3\n", "the row has 1 cells, the header 2", "r.csv:3"),
        (
            "t[s],q_1[kg]\n0,1\n1,2\n2,3\n",
            "column `q_1` is in kg, but it must be an angle",
            "column `q_1`",
        ),
        ("t[kg],q_1[rad]\n0,1\n1,2\n2,3\n", "`t` is in kg", "column `t`"),
        ("t[s],q_1[turns]\n0,1\n1,2\n2,3\n", "`turns` is not a unit", "column `q_1[turns]`"),
        (
            "t[s],q_1[rad],q_1[deg]\n0,1,1\n1,2,2\n2,3,3\n",
            "two columns are called `q_1`",
            "r.csv:1",
        ),
    ];
    for (csv, what, place) in cases {
        let error = read(csv).unwrap_err();
        let parts: Vec<&str> = error.split(" | ").collect();
        assert!(parts[0].contains(what), "{csv:?}: {error}");
        assert!(parts[1].contains(place), "{csv:?}: {error}");
        assert!(parts[2].split_whitespace().count() > 3, "{csv:?} gets help: {error}");
    }
}

/// Rows of several runs in one table, each with a clock that begins at 0.
fn in_a_row(runs: &[u32]) -> String {
    let row = |run: usize, i: u32| format!("{},{}\n", f64::from(i) * 0.01, run + 1);
    let rows = runs.iter().enumerate().flat_map(|(run, n)| (0..*n).map(move |i| row(run, i)));
    format!("t[s],q_1[rad]\n{}", rows.collect::<String>())
}

fn read_runs(csv: &str) -> Result<Vec<Recording>, String> {
    Recording::read_runs("r.csv", csv, None, &Map::default())
        .map_err(|error| format!("{} | {} | {}", error.what, error.place, error.help))
}

#[test]
fn a_clock_that_starts_again_begins_another_recording() {
    let runs = read_runs(&in_a_row(&[40, 25, 30])).unwrap();
    assert_eq!(runs.iter().map(Recording::n_rows).collect::<Vec<_>>(), [40, 25, 30]);
    for (run, value) in runs.iter().zip([1.0, 2.0, 3.0]) {
        let q = run.column("q_1", Dimension::ANGLE).unwrap();
        assert!(q.iter().all(|q| q.to_bits() == f64::to_bits(value)), "{}", run.name);
        assert!(run.time[0].abs() < 1e-12);
    }
    assert_eq!(runs[2].name, "r.csv, run 3 of 3");
    let note = &runs[0].notes[0];
    assert!(note.contains("read as 3 recordings of 25 to 40 rows"), "{note}");
    // Where one recording is asked for, several are a mistake.
    assert!(read(&in_a_row(&[40, 25])).unwrap_err().contains("the file holds 2 runs"));
}

#[test]
fn rows_in_disorder_are_no_other_run() {
    let ordered = in_a_row(&[40]);
    let lines: Vec<&str> = ordered.lines().collect();
    // A row near the beginning written again late; two halves the wrong way round.
    let late = [&lines[..30], &lines[2..3], &lines[30..]].concat().join("\n");
    let turned = [&lines[..1], &lines[21..], &lines[1..21]].concat().join("\n");
    for csv in [late, turned] {
        let error = read_runs(&csv).unwrap_err();
        assert!(error.contains("time goes back"), "{error}");
    }
}

/// A bad cell is a matter of the run it stands in.
#[test]
fn a_bad_cell_spoils_its_own_run_alone_and_all_of_them_are_told() {
    let csv = in_a_row(&[20, 20]).replacen(",1\n", ",inf\n", 8);
    let runs = read_runs(&csv).unwrap();
    assert!(runs[1].column("q_1", Dimension::ANGLE).is_ok());
    let error = runs[0].column("q_1", Dimension::ANGLE).unwrap_err();
    assert!(error.what.contains("7 other cells") && error.what.contains("lines 3, 4"), "{error:?}");
    assert!(error.what.contains("and 2 more") && error.place.contains(":2, column"), "{error:?}");
    assert!(error.help.contains("`#`"), "{error:?}");
    let commented =
        csv.lines().map(|l| if l.contains("inf") { format!("#{l}\n") } else { format!("{l}\n") });
    let runs = read_runs(&commented.collect::<String>()).unwrap();
    assert_eq!(runs[0].n_rows(), 12);
    assert!(runs[0].column("q_1", Dimension::ANGLE).is_ok());
}

/// The Gen3's own observer writes an `inf` now and then: a column nobody asks for may hold it.
#[test]
fn a_bad_cell_is_told_when_its_column_is_asked_for() {
    let r = read("t[s],q_1[rad],note\n0,1,inf\n1,x,inf\n2,3,\n").unwrap();
    let error = r.column("q_1", Dimension::ANGLE).unwrap_err();
    assert!(error.what.contains("`x`"), "{error:?}");
    assert!(error.place.contains("r.csv:3, column `q_1`"), "{error:?}");
    assert!(r.column("dq_1", Dimension::ANGULAR_SPEED).unwrap_err().help.contains("q_1"));
}

#[test]
fn a_stuttering_logger_is_forgiven_and_noted() {
    let r = read("t[s],q_1[rad]\n0,1\n0,1\n1,2\n2,3\n").unwrap();
    assert_eq!(r.n_rows(), 3);
    assert!(r.notes[0].contains("1 rows repeat"), "{:?}", r.notes);
}

#[test]
fn a_sidecar_that_cannot_be_is_refused() {
    let csv = "t[s],q_1[rad]\n0,1\n1,2\n2,3\n";
    for (text, what) in [
        ("{", "not a recording's sidecar"),
        (r#"{"noise": {"q_rad": -1}}"#, "`noise.q_rad` is -1"),
        (r#"{"torque_sensor": "elbow"}"#, "elbow"),
        (
            r#"{"controller": {"type": "pd", "kp_nm_per_rad": [1], "kd_nm_s_per_rad": []}}"#,
            "unequal numbers",
        ),
    ] {
        let error = read_with(csv, Some(text), "").unwrap_err();
        assert!(error.contains(what) && error.contains("r.json"), "{text}: {error}");
    }
    let known = r#"{"noise": {"tau_nm": [0.1, 0.2], "q_rad": 1e-4}, "colour": "red"}"#;
    let r = read_with(csv, Some(known), "").unwrap();
    assert_eq!(r.sidecar.noise.tau_nm.unwrap().of(1), Some(0.2));
    let turned = r#"{"torque_constant_nm_per_a": [11.6, -11.6]}"#;
    let r = read_with(csv, Some(turned), "").unwrap();
    assert_eq!(r.sidecar.torque_constant.unwrap().of(1), Some(-11.6));
}

#[test]
fn a_recording_of_something_else_is_told() {
    let robot = bare_arm();
    let of = |csv: &str| {
        let r = [read(csv).unwrap(), read(csv).unwrap()];
        let arm = Subject::Arm(&robot, &[]);
        investigate(&r, arm, &Options::default(), &mut |_, _| {}).unwrap_err()
    };
    let error = of("t[s],u[V]\n0,1\n1,2\n2,3\n");
    assert!(error.what.contains("nothing measured") && error.help.contains("--map"), "{error:?}");
    let error = of("t[s],q_1[rad]\n0,1\n1,2\n2,3\n");
    assert!(error.what.contains("no column `q_2`"), "{error:?}");
    let seven: Vec<String> = (1..=7).map(|n| format!("q_{n}[rad]")).collect();
    let row = ",0".repeat(7);
    let error = of(&format!("t[s],{}\n0{row}\n1{row}\n2{row}\n", seven.join(",")));
    assert!(error.what.contains("nothing to compare") && error.help.contains("tau_n"), "{error:?}");
    let eight: Vec<String> = (1..=8).map(|n| format!("q_{n}[rad]")).collect();
    let row = ",0".repeat(8);
    let error = of(&format!("t[s],{}\n0{row}\n1{row}\n2{row}\n", eight.join(",")));
    assert!(error.what.contains("8 columns") && error.help.contains("--robot-file"), "{error:?}");
}

/// What is wrong with the first recording of the friction case when some of its columns are changed.
fn refused(change: impl Fn(&mut Recording)) -> trueup::discovery::recording::Error {
    let mut recordings = [recording("coulomb_a"), recording("coulomb_b")];
    recordings.iter_mut().for_each(change);
    let robot = bare_arm();
    let arm = Subject::Arm(&robot, &[]);
    investigate(&recordings, arm, &Options::default(), &mut |_, _| {}).unwrap_err()
}

/// Multiplies every column whose name begins so.
fn times(recording: &mut Recording, stem: &str, factor: f64) {
    for column in recording.columns.iter_mut().filter(|c| c.name.starts_with(stem)) {
        column.values.iter_mut().for_each(|value| *value *= factor);
    }
}

fn rename(recording: &mut Recording, from: &str, to: &str) {
    let column = recording.columns.iter_mut().find(|c| c.name == from).unwrap();
    to.clone_into(&mut column.name);
}

/// Without these checks each of them was searched for effects, for minutes in the case of the clock.
#[test]
fn columns_that_cannot_be_what_they_are_called_are_refused() {
    let degrees = 180.0 / std::f64::consts::PI;
    let error = refused(|r| times(r, "q_", degrees));
    assert!(error.what.contains("`dq_1` is 0.017"), "{error:?}");
    let error = refused(|r| {
        times(r, "q_", degrees);
        times(r, "q_cmd", 1.0 / degrees);
    });
    assert!(
        error.what.starts_with("`q_1` moves 57.") && error.what.ends_with("what `q_cmd_1` says"),
        "{error:?}"
    );
    assert!(error.help.contains("q_1[deg]") && error.place.contains("`q_1`"), "{error:?}");
    let error = refused(|r| r.time.iter_mut().for_each(|t| *t *= 1000.0));
    assert!(error.what.ends_with("times what the change of `q_1` says"), "{error:?}");
    assert!(error.help.contains("t[ms]"), "{error:?}");
    assert!(error.what.starts_with("`t` looks like milliseconds"), "{error:?}");
    let error = refused(|r| r.time.iter_mut().for_each(|t| *t *= 1e6));
    assert!(error.what.starts_with("`t` looks like microseconds"), "{error:?}");
    assert!(error.help.contains("`t[us]`") && error.place.contains("column `t`"), "{error:?}");
    let error = refused(|r| {
        r.columns.retain(|c| !c.name.starts_with("dq"));
        r.time.iter_mut().for_each(|t| *t *= 1000.0);
    });
    assert!(error.what.contains("s apart, too far to follow"), "{error:?}");
    let error = refused(|r| times(r, "tcp", 1000.0));
    assert!(error.what.contains("`tcp_x` travels") && error.help.contains("mm"), "{error:?}");
    let error = refused(|r| times(r, "tau", -1.0));
    assert!(error.what.contains("about -1 times") && error.help.contains("sign"), "{error:?}");
    let error = refused(|r| times(r, "tau", 1000.0));
    assert!(error.what.contains("times what the model needs"), "{error:?}");
    assert!(error.help.contains("tau_1[mN*m]"), "{error:?}");
    let error = refused(|r| {
        rename(r, "q_2", "q_x");
        rename(r, "q_3", "q_2");
        rename(r, "q_x", "q_3");
    });
    assert!(error.what.contains("`q_2` follows `q_cmd_3`, not `q_cmd_2`"), "{error:?}");
}

/// Stamps 8 % too long were explained by a rotor and two wrong torque sensors.
#[test]
fn stamps_of_another_rate_than_the_speeds_are_refused() {
    let error = refused(|r| r.time.iter_mut().for_each(|t| *t *= 1.08));
    assert!(error.what.starts_with("`dq_n` is 1.08 times what the change of `q_n`"), "{error:?}");
    assert!(error.help.contains("divide `t` by 1.08"), "{error:?}");
    assert!(error.place.contains("columns `t` and `dq_n`"), "{error:?}");
}

/// Adds a multiple of what the arm weighs at each row, N·m.
fn weigh(recording: &mut Recording, part: f64) {
    let robot = bare_arm();
    let dynamics = Dynamics::new(&robot, Bodies::All);
    let of = |recording: &Recording, name: &str| {
        recording.columns.iter().position(|column| column.name == name).unwrap()
    };
    for row in 0..recording.time.len() {
        let q: Vec<f64> = (1..=7)
            .map(|joint| recording.columns[of(recording, &format!("q_{joint}"))].values[row])
            .collect();
        for (joint, torque) in dynamics.gravity_torques(&q).unwrap().iter().enumerate() {
            let tau = of(recording, &format!("tau_{}", joint + 1));
            recording.columns[tau].values[row] += part * torque;
        }
    }
}

/// They were searched for effects, or, of an arm that hangs, the sign of all torques was to be turned.
#[test]
fn torques_without_weight_and_of_an_arm_that_hangs_are_told_with_what_the_sidecar_must_say() {
    let error = refused(|r| weigh(r, -1.0));
    assert!(error.what.ends_with("those of an arm without weight"), "{error:?}");
    assert!(error.help.contains("`\"gravity_m_s2\": 0`"), "{error:?}");
    let error = refused(|r| weigh(r, -2.0));
    assert!(error.what.contains("an arm mounted otherwise"), "{error:?}");
    assert!(error.help.contains("`\"gravity_m_s2\": [0, 0, 9.81]`"), "{error:?}");
}

/// An arm on a wall or a ceiling is judged as one that stands, once the sidecar says so.
#[test]
fn an_arm_that_hangs_lacks_nothing_where_its_sidecar_says_so() {
    let text = r#"{"gravity_m_s2": [0, 0, 9.81]}"#;
    let hung = Sidecar::read("hung.json", text).unwrap();
    let down = Sidecar::read("down.json", r#"{"gravity_m_s2": -9.81}"#).unwrap();
    assert_eq!((hung.gravity, down.gravity), (Some([0.0, 0.0, 9.81]), Some([0.0, 0.0, 9.81])));
    let error = Sidecar::read("two.json", r#"{"gravity_m_s2": [0, 9.81]}"#).unwrap_err();
    assert!(error.what.contains("a number or three"), "{error:?}");
    let mut recordings = [recording("control_a"), recording("control_b")];
    for recording in &mut recordings {
        weigh(recording, -2.0);
        recording.sidecar.gravity = hung.gravity;
        recording.sidecar.controller = None;
    }
    let robot = bare_arm();
    let arm = Subject::Arm(&robot, &[]);
    let found = investigate(&recordings, arm, &Options::default(), &mut |_, _| {}).unwrap();
    assert_eq!(found.finding.verdict, Verdict::NothingMissing, "{:#?}", found.finding.effects);
}

/// Without a controller the torques of one joint are enough; with one a sensor that says the opposite is no effect either.
#[test]
fn a_torque_of_the_other_sign_is_refused() {
    let error = refused(|r| {
        r.sidecar.controller = None;
        times(r, "tau_4", -1.0);
    });
    assert!(error.what.starts_with("`tau_4` runs against what the arm needs"), "{error:?}");
    assert!(error.help.starts_with("turn their sign"), "{error:?}");
    let error = refused(|r| times(r, "tau_1", -1.0));
    assert!(error.what.starts_with("`tau_1` reads -1 times"), "{error:?}");
}

/// Half a second of a motion was explained by effects of thousands of N·m, or was called another machine than its end.
#[test]
fn a_motion_that_is_too_short_to_tell_is_refused() {
    let error = refused(|r| {
        *r = r.split(0.9).unwrap().0;
        r.sidecar.controller = None;
    });
    assert!(error.what.contains("too short to tell"), "{error:?}");
    assert!(error.help.contains("turn both ways"), "{error:?}");
    let error = refused(|r| {
        r.sidecar.controller = None;
        let still = |c: &&mut Column| c.name.starts_with("q_") || c.name.starts_with("dq_");
        r.columns.iter_mut().filter(still).for_each(|c| {
            c.values.iter_mut().enumerate().for_each(|(k, v)| *v = 1e-4 * (k % 2) as f64);
        });
        r.columns.retain(|c| !c.name.starts_with("q_cmd"));
    });
    assert!(error.what.starts_with("too little motion to tell"), "{error:?}");
    assert!(error.what.ends_with("fitted"), "{error:?}");
}

/// Two seconds of a real arm, of which the last stood still, were explained by twelve effects.
#[test]
fn what_is_held_out_has_to_move_too() {
    let mut recordings = [recording("coulomb_a"), recording("coulomb_b")];
    for r in &mut recordings {
        r.sidecar.controller = None;
        r.columns.retain(|c| !c.name.starts_with("q_cmd"));
    }
    for column in recordings[1].columns.iter_mut().filter(|c| c.name.starts_with("q_")) {
        column.values.fill(0.3);
    }
    for column in recordings[1].columns.iter_mut().filter(|c| c.name.starts_with("dq_")) {
        column.values.fill(0.0);
    }
    let robot = bare_arm();
    let arm = Subject::Arm(&robot, &[]);
    let error = investigate(&recordings, arm, &Options::default(), &mut |_, _| {}).unwrap_err();
    assert!(error.what.starts_with("too little motion to tell"), "{error:?}");
    assert!(error.what.ends_with("held out"), "{error:?}");
    assert!(error.help.contains("poses at rest"), "{error:?}");
}

#[test]
fn semicolons_and_decimal_commas_are_read() {
    let read_q = |csv: &str| {
        let r = read(csv).unwrap();
        (r.time.clone(), r.column("q_1", Dimension::ANGLE).unwrap().to_vec())
    };
    let expected = (vec![0.0, 0.5, 1.0], vec![1.0, 1.5, -0.02]);
    for csv in [
        "t[s];q_1[rad]\n0;1.0\n0.5;1.5\n1;-0.02\n",
        "# a logger\nt[s];q_1[rad]\r\n0;1,0\r\n0,5;1,5\r\n1;-2,0e-2\r\n",
    ] {
        assert_eq!(read_q(csv), expected, "{csv:?}");
    }
    // Where cells have points, a comma may stand between thousands.
    let both = read("t[s];q_1[rad]\n0;1.5\n1;1,500\n2;1\n").unwrap();
    let error = both.column("q_1", Dimension::ANGLE).unwrap_err();
    assert!(error.what.contains("`1,500` is not a finite number"), "{error:?}");
}

/// Positions alone, in degrees: nothing to compare them with but the joints' limits.
#[test]
fn angles_beyond_the_joints_limits_are_refused() {
    let error = refused(|r| {
        r.sidecar.controller = None;
        r.columns.retain(|c| !c.name.starts_with("dq") && !c.name.starts_with("q_cmd"));
        times(r, "q_", 180.0 / std::f64::consts::PI);
    });
    assert!(error.what.contains("turns from -2.24 to 2.24 rad"), "{error:?}");
    assert!(error.help.contains("[deg]"), "{error:?}");
}

/// Some loggers write zeros for what they do not measure.
#[test]
fn torques_that_are_zero_throughout_are_taken_as_not_measured() {
    let mut recordings = [recording("control_a"), recording("control_b")];
    for recording in &mut recordings {
        times(recording, "tau", 0.0);
    }
    let robot = bare_arm();
    let arm = Subject::Arm(&robot, &[]);
    let found = investigate(&recordings, arm, &Options::default(), &mut |_, _| {}).unwrap().finding;
    assert!(found.effects.is_empty(), "{:?}", found.effects);
    assert!(found.notes.iter().any(|note| note.contains("not measured")), "{:?}", found.notes);
}

/// A stray stamp at the end: the grid of a simulation would be as long as the time until then.
#[test]
fn a_recording_is_judged_as_far_as_a_grid_of_time_holds_it() {
    let mut text = "t[s],q_1[rad]\n".to_owned();
    for k in 0..1000 {
        let _ = writeln!(text, "{},{k}", f64::from(k) * 0.01);
    }
    let whole = read(&text).unwrap();
    assert_eq!(whole.within(10.0, 1000), None);
    let stray = read(&format!("{text}1e9,0\n")).unwrap();
    let cut = stray.within(900.0, 200_000).unwrap();
    assert_eq!((cut.n_rows(), cut.columns[0].values.len()), (1000, 1000));
    let note = cut.notes.last().unwrap();
    assert!(note.contains("1000 of 1001 rows") && note.contains("later"), "{note}");
    let thin = whole.within(900.0, 300).unwrap();
    assert_eq!(thin.n_rows(), 250);
    assert!(thin.notes.last().unwrap().contains("every 4th"), "{:?}", thin.notes);
}

/// The cells of ten thousand rows of text are counted, and the first few are told.
#[test]
fn a_column_of_words_is_told_by_its_first_cells() {
    let rows: Vec<String> = (0..20_000).map(|k| format!("{k},word")).collect();
    let read = read(&format!("t[s],q_1[rad]\n{}\n", rows.join("\n"))).unwrap();
    let column = &read.columns[0];
    assert_eq!((column.n_bad, column.bad.len()), (20_000, 10_000));
    let error = read.column("q_1", Dimension::ANGLE).unwrap_err();
    assert!(error.what.contains("nor are 19999 other cells"), "{}", error.what);
}

/// Each column with blank cells was an error of its own, one after the other.
#[test]
fn columns_with_blank_cells_are_told_at_once_or_read_as_blank() {
    let mut csv = "t[s],q_1[rad],tau_1[N*m],note\n".to_owned();
    for row in 0..24 {
        let (q, tau) = if row % 2 == 0 { ("0.5", "") } else { ("NaN", "2") };
        let _ = writeln!(csv, "{row},{q},{tau},word");
    }
    let r = read(&csv).unwrap();
    let error = r.column("tau_1", Dimension::TORQUE).unwrap_err();
    assert!(error.what.starts_with("an empty cell is not a finite number"), "{error:?}");
    assert!(error.what.ends_with("other columns have such cells, too: `q_1`"), "{error:?}");
    let tau = r.column_with_blanks("tau_1", Dimension::TORQUE).unwrap();
    assert!(tau[0].is_nan() && (tau[1] - 2.0).abs() < 1e-12);
    let q = r.group_with_blanks("q", 1, Dimension::ANGLE).unwrap().unwrap();
    assert_eq!(q[0].iter().filter(|value| value.is_finite()).count(), 12);
    // Words are no blanks, nor are nine numbers a column.
    let worded = read(&csv.replacen("NaN", "off", 1)).unwrap();
    assert!(worded.column_with_blanks("q_1", Dimension::ANGLE).is_err());
    let short: Vec<&str> = csv.lines().take(20).collect();
    let short = read(&short.join("\n")).unwrap();
    assert!(short.column_with_blanks("tau_1", Dimension::TORQUE).is_err());
}
