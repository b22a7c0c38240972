//! Descriptions of robots, planning problems and numbers for them.

use std::fmt::Write as _;

use super::{Bench, ENDS, REFUSED};

/// A chain of `n` links, its joints as `joint` describes them.
fn chain(n: usize, joint: &str) -> String {
    let mut text = String::from("<robot name=\"r\"><link name=\"l0\"/>");
    for k in 0..n {
        let (parent, child) = (k, k + 1);
        let _ = write!(
            text,
            "<link name=\"l{child}\"/><joint name=\"j{child}\" type=\"revolute\">\
             <parent link=\"l{parent}\"/><child link=\"l{child}\"/>{joint}</joint>"
        );
    }
    text + "</robot>"
}

const TURNING: &str = "<origin xyz=\"0 0 0.1\" rpy=\"0 0.3 0\"/><axis xyz=\"0 0 1\"/>\
                       <limit lower=\"-3\" upper=\"3\" effort=\"1\" velocity=\"1\"/>";

fn descriptions() -> Vec<Vec<u8>> {
    let text = |text: &str| text.as_bytes().to_vec();
    let inside = |inside: &str| chain(2, TURNING).replace("</robot>", &format!("{inside}</robot>"));
    let turning = |from: &str, to: &str| chain(2, &TURNING.replace(from, to)).into_bytes();
    let mut laughs = String::new();
    for k in 1..12 {
        let _ = write!(laughs, "<!ENTITY l{k} \"{}\">", format!("&l{};", k - 1).repeat(10));
    }
    vec![
        text(""),
        text("<robot>"),
        text("<robot name=\"r\"/>"),
        text("{\"robot\": 1}"),
        b"<robot name=\"\xff\"/>".to_vec(),
        vec![0; 1 << 20],
        format!("<robot name=\"r\">{}", "<link name=\"l\">".repeat(30_000)).into_bytes(),
        format!("{}{}", "<a>".repeat(100_000), "</a>".repeat(100_000)).into_bytes(),
        chain(20_000, TURNING).into_bytes(),
        chain(2, "").into_bytes(),
        turning("0 0 0.1", "nan 0 inf"),
        turning("0 0 0.1", "1e308 1e308 1e308"),
        turning("0 0 0.1", "0 0"),
        turning("0 0 1", "0 0 0"),
        turning("lower=\"-3\" upper=\"3\"", "lower=\"3\" upper=\"-3\""),
        turning("lower=\"-3\" upper=\"3\"", "lower=\"nan\" upper=\"inf\""),
        turning("velocity=\"1\"", "velocity=\"-1\""),
        turning("velocity=\"1\"", "velocity=\"0\""),
        // A circle, a link with two parents, a joint to nowhere, the same name twice.
        text("<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/>\
              <joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>\
              <joint name=\"k\" type=\"fixed\"><parent link=\"b\"/><child link=\"a\"/></joint></robot>"),
        text("<robot name=\"r\"><link name=\"a\"/>\
              <joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"a\"/></joint></robot>"),
        inside("<joint name=\"x\" type=\"fixed\"><parent link=\"l0\"/><child link=\"l2\"/></joint>").into_bytes(),
        inside("<joint name=\"x\" type=\"fixed\"><parent link=\"l0\"/><child link=\"gone\"/></joint>").into_bytes(),
        inside("<link name=\"l1\"/>").into_bytes(),
        inside("<link name=\"x\"><inertial><mass value=\"-5\"/><inertia ixx=\"nan\" ixy=\"0\" ixz=\"0\" \
                iyy=\"0\" iyz=\"0\" izz=\"0\"/></inertial></link>").into_bytes(),
        inside("<link name=\"x\"><collision><geometry><mesh filename=\"/dev/zero\"/></geometry></collision></link>").into_bytes(),
        inside("<link name=\"\x1b[2J\"/>").into_bytes(),
        format!("<?xml version=\"1.0\"?><!DOCTYPE r [<!ENTITY l0 \"ha\">{laughs}]><robot name=\"&l11;\"/>").into_bytes(),
    ]
}

#[test]
fn descriptions_of_robots_are_read_or_refused() {
    let mut bench = Bench::new("robots");
    for urdf in descriptions() {
        let files: &[(&str, &[u8])] = &[("r.urdf", &urdf)];
        bench.case(files, &["robot", "fk", "--robot-file", "r.urdf", "--q", "0.1,0.2"], ENDS);
        bench.case(files, &["robot", "dynamics", "--robot-file", "r.urdf", "--q", "0.1,0.2"], ENDS);
    }
    bench.end(50);
}

#[test]
fn numbers_for_robots_are_answered_or_refused() {
    let mut bench = Bench::new("numbers");
    for q in [
        "1e308,0,0,0,0,0,0",
        "1e15,1e15,0,0,0,0,0",
        ",,,,,,",
        "0,0,0,0,0,0,0,0",
        "1,2,3,4,5,6,inf",
        "٣,0,0,0,0,0,0",
    ] {
        bench.case(&[], &["robot", "fk", "--q", q], ENDS);
        bench.case(&[], &["robot", "dynamics", "--q", q], ENDS);
    }
    let long = vec!["0"; 20_000].join(",");
    bench.case(&[], &["robot", "fk", "--q", &long], REFUSED);
    for pose in [
        "nan,0,0,1,0,0,0",
        "inf,0,0,1,0,0,0",
        "1e308,0,0,1,0,0,0",
        "0,0,0,0,0,0,0",
        "0.5,0,0.3,1e308,1e308,1,1",
        "0.5,0,0.3,1e-300,0,0,0",
        "0,0,0",
        "1e9,0,0,1,0,0,0",
    ] {
        bench.case(&[], &["robot", "ik", "--pose", pose], ENDS);
    }
    for table in
        ["", "a,b\n1,2\n", "1,2,3,4,5,6,7\nx\n", "nan,nan,nan,nan,nan,nan,nan\n", "\u{1b}[2J\n"]
    {
        bench.case(&[("q.csv", table.as_bytes())], &["robot", "fk", "--q-file", "q.csv"], ENDS);
        bench.case(&[("q.csv", table.as_bytes())], &["robot", "ik", "--pose-file", "q.csv"], ENDS);
    }
    bench.end(30);
}

fn problems() -> Vec<String> {
    let zeros = "[0, 0, 0, 0, 0, 0, 0]";
    let start = "[0, 0.26, 3.14, -2.27, 0, 0.96, 1.57]";
    let goal = "[1, 0.26, 3.14, -2.27, 0, 0.96, 1.57]";
    let with = |start: &str, goals: &str, obstacles: &str| {
        format!("{{\"start\": {start}, \"goals\": {goals}, \"obstacles\": {obstacles}}}")
    };
    let thing = |shape: &str, size: &str, at: &str| {
        let pose = format!("{{\"xyz_m\": {at}, \"quat_wxyz\": [1, 0, 0, 0]}}");
        let thing = format!("[{{\"shape\": \"{shape}\", \"pose\": {pose}, \"size_m\": {size}}}]");
        with(start, &format!("[{goal}]"), &thing)
    };
    let one = |q: &str| format!("[{q}]");
    vec![
        with("[]", "[[]]", "[]"),
        with(zeros, "[]", "[]"),
        with("[0]", &one(zeros), "[]"),
        with(zeros, &one("[0]"), "[]"),
        with("[1e308, 0, 0, 0, 0, 0, 0]", &one(zeros), "[]"),
        with(start, &one("[0, 1e308, 0, 0, 0, 0, 0]"), "[]"),
        with(start, &one("[0, 1e15, 0, 0, 0, 0, 0]"), "[]"),
        with("[1e999, 0, 0, 0, 0, 0, 0]", &one(zeros), "[]"),
        with("[null, 0, 0, 0, 0, 0, 0]", &one(zeros), "[]"),
        with(start, &one(start), "[]"),
        with(start, &format!("[{}]", vec![goal; 3000].join(", ")), "[]"),
        thing("box", "[0, 0, 0]", "[0.4, 0, 0.3]"),
        thing("box", "[-1, 1, 1]", "[0.4, 0, 0.3]"),
        thing("box", "[1e308, 1e308, 1e308]", "[0.4, 0, 0.3]"),
        thing("box", "[1, 1]", "[0.4, 0, 0.3]"),
        thing("box", "[2, 2, 2]", "[0, 0, 0.5]"),
        thing("sphere", "[]", "[0.4, 0, 0.3]"),
        thing("sphere", "[1e-300]", "[0.4, 0, 0.3]"),
        thing("sphere", "[0.5]", "[0.4, 0, 0.3]"),
        thing("sphere", "[0.1]", "[1e308, 0, 0.3]"),
        thing("cylinder", "[0.3, 0]", "[0.4, 0, 0.3]"),
        thing("cylinder", "[0.3, 1.5]", "[0.2, 0.1, 0.3]"),
        thing("\\u001b[2J", "[1]", "[0.4, 0, 0.3]"),
        thing("box", "[0.1, 0.1, 0.1]", "[0.4, 0, 0.3]").replace("[1, 0, 0, 0]", "[0, 0, 0, 0]"),
        thing("box", "[0.1, 0.1, 0.1]", "[0.4, 0, 0.3]")
            .replace("[1, 0, 0, 0]", "[1e308, 1e308, 0, 0]"),
        format!("{{\"start\": {}1{}}}", "[".repeat(100_000), "]".repeat(100_000)),
        "{\"start\": [0".to_owned(),
        "null".to_owned(),
    ]
}

#[test]
fn planning_problems_are_answered_or_refused() {
    let mut bench = Bench::new("problems");
    for problem in problems() {
        let files: &[(&str, &[u8])] = &[("p.json", problem.as_bytes())];
        bench.case(files, &["robot", "plan", "--problem", "p.json"], ENDS);
    }
    bench.end(28);
}
