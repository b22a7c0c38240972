//! Tables as loggers write them: cells parted by spaces or tabs, arrays of columns, columns without a name or without anything in
//! them.

use trueup::discovery::recording::{Error, Flaw, Map, Recording};
use trueup::units::Dimension;

fn read(text: &str, map: &str) -> Result<Recording, Error> {
    Recording::read("r.csv", text, None, &Map::parse(map)?)
}

/// The exports of UR's RTDE client have spaces: a header of seven names was one column that no map knew.
#[test]
fn cells_may_be_parted_by_spaces_or_tabs() {
    let spaces = "timestamp actual_q_0\n12345.678 1.6e-06\n12345.686  0.5\n12345.694 -1\n";
    let map = "timestamp=t[s],actual_q_0=q_1[rad]";
    for text in [
        spaces.to_owned(),
        spaces.replace("  ", " ").replace(' ', "\t"),
        spaces.replace('\n', " \r\n"),
        spaces.replace("timestamp ", "# of Monday\n timestamp\t"),
        spaces.replace('.', ","),
        spaces.replace("actual_q_0", "actual_q_0 [rad]"),
        spaces.replace("actual_q_0\n", "actual_q_0\n[s] [rad]\n"),
    ] {
        let read = read(&text, map).unwrap_or_else(|error| panic!("{text:?}: {error:?}"));
        assert_eq!(read.time, [12345.678, 12345.686, 12345.694], "{text:?}");
        assert_eq!(read.column("q_1", Dimension::ANGLE).unwrap(), [1.6e-6, 0.5, -1.0], "{text:?}");
    }
    // Where tabs part cells, one may be blank, and a name may have a space in it.
    let tabs = read("t[s]\tq 1[rad]\ttau_1[N*m]\n0\t1\t\n1\t2\t3\n2\t3\t4\n", "q 1=q_1").unwrap();
    assert_eq!(tabs.column("q_1", Dimension::ANGLE).unwrap(), [1.0, 2.0, 3.0]);
    let error = read("t[s] q_1[rad] tau_1[N*m]\n0 1 2\n1 2\n2 3 4\n", "").unwrap_err();
    assert_eq!(error.flaw(), Some(&Flaw::PartedBySpaces(2, 3)));
    assert_eq!(error.place, "r.csv:3");
    assert!(error.what.contains("parted by spaces"), "{error:?}");
}

/// libfranka's names: `0` was said to be no unit.
#[test]
fn columns_of_arrays_are_numbered_from_one() {
    let table = |names: &str| {
        let cells =
            |row: i32| format!("{row}{}\n", format!(",{row}").repeat(names.matches(',').count()));
        format!("{names}\n{}", (0..3).map(cells).collect::<String>())
    };
    let names = |text: &str, map: &str| {
        let read = read(&table(text), map).unwrap_or_else(|error| panic!("{text}: {error:?}"));
        let names: Vec<String> = read.columns.iter().map(|column| column.name.clone()).collect();
        names.join(" ")
    };
    assert_eq!(names("t[s],q[0],q[1],dq[0],dq[1]", ""), "q_1 q_2 dq_1 dq_2");
    assert_eq!(names("t[s],q[1],q[2]", ""), "q_1 q_2");
    // Some are missing: which joint is which is for a map to say.
    assert_eq!(names("t[s],q[0],q[2]", ""), "q[0] q[2]");
    assert_eq!(names("t[s],q[0],q[2]", "q[2]=q_1[rad]"), "q[0] q_1");
    assert_eq!(names("t[s],tau_J[0],tau_J[1]", "tau_J=tau[N*m]"), "tau_1 tau_2");
    assert_eq!(names("t[s],tau_J[0],tau_J[1]", "tau_J[1]=tau_1"), "tau_J_1 tau_1");
    // By itself it is the unit of a plain number.
    assert_eq!(names("t[s],share[1]", ""), "share");
    let read = read(&table("t[s],q[0] [deg],q[1][deg]"), "").unwrap();
    assert!(
        (read.column("q_2", Dimension::ANGLE).unwrap()[2] - 2.0_f64.to_radians()).abs() < 1e-12
    );
    let map = Map::parse("tau=tau").unwrap();
    let text = table("t[s],tau_J[0],tau_J[1]");
    let error = Recording::read("r.csv", &text, None, &map).unwrap_err();
    assert!(matches!(error.flaw(), Some(Flaw::NotRenamed { .. })), "{error:?}");
}

#[test]
fn a_column_with_nothing_in_it_is_left_out_with_a_note() {
    let rows = |last: &str| {
        let row = |k: i32| format!("{k},{k},{k},{last},,nan,1\n");
        (0..20).map(row).collect::<String>()
    };
    let header = "t[s],q_1[rad],dq_1[rad/s],dq_2[rad/s],mass[kg],,tau_1[N*m]\n";
    let blank = read(&format!("{header}{}", rows("")), "").unwrap();
    let left: Vec<&str> = blank.columns.iter().map(|column| column.name.as_str()).collect();
    // The speed of one joint by itself is no use.
    assert_eq!(left, ["q_1", "column_6", "tau_1"]);
    let note = blank.notes.iter().find(|note| note.contains("left out")).unwrap();
    assert!(note.contains("`dq_2`") && note.contains("`mass`"), "{note}");
    let speeds = read(&format!("{header}{}", rows("0")), "").unwrap();
    assert!(speeds.has("dq_1") && speeds.has("dq_2") && !speeds.has("mass"));
    // Of torques, of which each says something, one that is blank is a mistake, told where they are asked for.
    let torques = "t[s],q_1[rad],tau_1[N*m],tau_2[N*m]\n0,1,2,\n1,2,3,\n2,3,4,\n";
    let torques = read(torques, "").unwrap();
    assert!(torques.group("tau", 2, Dimension::TORQUE).unwrap_err().what.contains("an empty cell"));
}
