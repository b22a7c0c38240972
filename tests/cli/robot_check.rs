//! `robot check`, and the kitchen with the other arms of the stdlib.

use std::fs;

use serde_json::Value;

use crate::program::{Scratch, project};

/// An arm of one joint, as somebody begins.
const BARE: &str = r#"<robot name="bare"><link name="base"/><link name="arm"/>
  <joint name="a" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="0" effort="0"/></joint></robot>"#;

fn states(document: &Value) -> Vec<(&str, &str)> {
    let checks = document["checks"].as_array().unwrap();
    checks.iter().map(|c| (c["name"].as_str().unwrap(), c["state"].as_str().unwrap())).collect()
}

#[test]
fn the_stdlibs_robots_are_ready_for_a_pour() {
    let scratch = Scratch::new("cli-robot-check");
    for name in ["gen3_2f85", "panda", "ur5e_2f85"] {
        let said = scratch.trueup(&["robot", "check", name, "--json"]);
        let document = said.json();
        assert_eq!(said.code, 0, "{document}");
        let all = ["kinematics", "planning", "twin", "pour"];
        assert_eq!(document["usable_for"], serde_json::json!(all), "{name}");
        assert!(states(&document).iter().all(|(_, state)| *state == "ok"), "{document}");
    }
}

#[test]
fn what_a_bare_urdf_lacks_is_said_with_what_to_write() {
    let scratch = Scratch::new("cli-robot-check-bare");
    scratch.file("bare.urdf", BARE);
    let said = scratch.trueup(&["robot", "check", "bare.urdf", "--json"]);
    let document = said.json();
    assert_eq!(said.code, 1);
    assert_eq!(document["usable_for"], serde_json::json!(["kinematics"]));
    let states = states(&document);
    for missing in ["shapes", "inertias", "jaws", "tool", "marker", "home", "retract"] {
        assert!(states.contains(&(missing, "missing")), "{missing}: {states:?}");
    }
    for assumed in ["speeds", "accelerations", "torques", "pairs"] {
        assert!(states.contains(&(assumed, "assumed")), "{assumed}: {states:?}");
    }
    for check in document["checks"].as_array().unwrap() {
        assert_eq!(check["state"] == "ok", check["write"].is_null(), "{check}");
    }
    let said = scratch.trueup(&["robot", "check", "bare.urdf"]);
    assert_eq!(said.code, 1);
    assert!(
        said.out.contains("missing  marker") && said.out.contains("write [marker]"),
        "{}",
        said.out
    );
    assert!(said.out.trim_end().ends_with("bare: usable for kinematics"), "{}", said.out);
    // What is no robot is bad input.
    scratch.file("no.urdf", "<robot/>");
    let said = scratch.trueup(&["robot", "check", "no.urdf"]);
    assert!(said.code == 2 && said.err.contains("whose root is `<robot"), "{}", said.err);
    // What is one, but for an element, is told which.
    let drawn = r#"<link name="arm"><visual><geometry><box size="1 1 1"/></geometry><material name="m">
        <texture/></material></visual></link>"#;
    scratch.file("lacks.urdf", BARE.replace("<link name=\"arm\"/>", drawn));
    let said = scratch.trueup(&["robot", "check", "lacks.urdf"]);
    assert!(said.err.contains("line 2: <texture> of link arm has no filename"), "{}", said.err);
    assert!(said.err.contains("help: write the filename of this <texture>"), "{}", said.err);
    assert_eq!(scratch.trueup(&["robot", "check", "nothing.urdf"]).code, 2);
}

/// "Leave `--tip` out", where there was none.
#[test]
fn a_link_that_robot_toml_names_and_the_urdf_has_not_is_told_with_its_key() {
    let scratch = Scratch::new("cli-robot-check-side");
    scratch.file("bare.urdf", BARE);
    let told = |side: &str, tip: &[&str]| {
        scratch.file("robot.toml", side);
        let said = scratch.trueup(&[&["robot", "check", "bare.urdf"][..], tip].concat());
        assert_eq!(said.code, 2, "{}", said.out);
        said.err
    };
    let err = told("[[unchecked]]\nlink = \"arn\"\nwith = [\"base\"]\n", &[]);
    assert!(err.contains("robot.toml: [[unchecked]] link: the robot has no link arn"), "{err}");
    assert!(err.contains("did you mean `arm`?") && !err.contains("--tip"), "{err}");
    let err = told("tip = \"elsewhere\"\n", &[]);
    assert!(err.contains("robot.toml: tip: the robot has no link elsewhere"), "{err}");
    let err = told("", &["--tip", "elsewhere"]);
    assert!(!err.contains("robot.toml") && err.contains("leave `--tip` out"), "{err}");
}

/// "Which open 80 mm", of fingers that stay 40 mm open, and "on every moving part" of parts whose only mesh was not read.
#[test]
fn how_far_fingers_close_and_what_has_no_shape_are_told() {
    let scratch = Scratch::new("cli-robot-check-least");
    let stdlib =
        |name: &str| fs::read_to_string(project(&format!("stdlib/robots/panda/{name}"))).unwrap();
    let text = stdlib("panda.urdf");
    let range = "lower=\"0\" upper=\"0.04\"";
    assert_eq!(text.matches(range).count(), 2);
    scratch.file("low.urdf", text.replace(range, "lower=\"0.02\" upper=\"0.04\""));
    scratch.file("robot.toml", stdlib("robot.toml"));
    let said = scratch.trueup(&["robot", "check", "low.urdf"]);
    assert!(said.out.contains("2, which open 40 to 80 mm"), "{}", said.out);

    let shape = "<link name=\"arm\"><collision><geometry><box size=\"0.1 0.1 0.1\"/></geometry></collision></link>\
                 <link name=\"plate\"><collision><geometry><mesh filename=\"plate.dae\"/></geometry></collision></link>\
                 <joint name=\"p\" type=\"fixed\"><parent link=\"arm\"/><child link=\"plate\"/></joint>";
    scratch.file("robot.toml", "");
    scratch.file("plate.urdf", BARE.replace("<link name=\"arm\"/>", shape));
    let said = scratch.trueup(&["robot", "check", "plate.urdf"]);
    assert!(said.out.contains("1 solids; none on plate"), "{}", said.out);
}

/// A home in which the arm touched itself took planning away, which an arm without any home kept.
#[test]
fn planning_needs_no_home() {
    let scratch = Scratch::new("cli-robot-check-home");
    let body = |name: &str| {
        format!(
            "<link name=\"{name}\"><collision><geometry><box size=\"0.2 0.2 0.1\"/></geometry></collision></link>"
        )
    };
    let next = |name: &str, from: &str, to: &str| {
        format!(
            "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{from}\"/><child link=\"{to}\"/><origin xyz=\"0.3 0 0\"/>\
             <axis xyz=\"0 0 1\"/><limit lower=\"-3.1\" upper=\"3.1\" velocity=\"1\" effort=\"1\"/></joint>"
        )
    };
    // Three steps of 0.3 m, each turned by about 120 deg, end where they began.
    let links = ["l0", "l1", "l2", "l3"];
    let text: String = links.iter().map(|name| body(name)).collect();
    let joints: String = (0..3).map(|i| next(&format!("j{i}"), links[i], links[i + 1])).collect();
    scratch.file("fold.urdf", format!("<robot name=\"fold\">{text}{joints}</robot>"));
    let usable = |home: &str| {
        scratch.file("robot.toml", home);
        let document = scratch.trueup(&["robot", "check", "fold.urdf", "--json"]).json();
        let told =
            document["checks"].as_array().unwrap().iter().find(|c| c["name"] == "self_collision");
        (document["usable_for"].clone(), told.cloned())
    };
    let (without, _) = usable("");
    let (folded, told) = usable("[poses_deg]\nhome = [115, 120, 0]\n");
    assert!(without.as_array().unwrap().iter().any(|to| to == "planning"), "{without}");
    assert_eq!(folded, without);
    let told = told.unwrap();
    assert_eq!(
        (told["state"].as_str(), told["needed_for"].as_str()),
        (Some("missing"), Some("pour"))
    );
}

/// It was usable for a pour, and the first run ended with "link and table overlap by 20.0 mm".
#[test]
fn a_home_from_which_no_run_begins_is_told() {
    let scratch = Scratch::new("cli-robot-check-low");
    let at = |z: f64| {
        let shape = format!(
            "<link name=\"arm\"><collision><origin xyz=\"0 0 {z}\"/><geometry><box size=\"0.2 0.2 0.1\"/></geometry>\
             </collision></link>"
        );
        scratch.file("low.urdf", BARE.replace("<link name=\"arm\"/>", &shape));
        scratch.file("robot.toml", "[poses_deg]\nhome = [0]\n");
        let document = scratch.trueup(&["robot", "check", "low.urdf", "--json"]).json();
        let mut checks = document["checks"].as_array().unwrap().iter();
        checks.find(|check| check["name"] == "home").unwrap().clone()
    };
    let low = at(0.07);
    assert_eq!(low["state"], "missing");
    let found = low["found"].as_str().unwrap();
    assert!(found.contains("arm is 20 mm from") && found.contains("40 mm are kept"), "{found}");
    assert_eq!(at(0.12)["state"], "ok");
}

/// "Another place of the base" was advised whatever kept the hand from every place.
#[test]
fn what_keeps_the_hand_from_every_place_is_told_with_what_to_write() {
    let scratch = Scratch::new("cli-robot-check-reach");
    let stdlib = |name: &str| {
        fs::read_to_string(project(&format!("stdlib/robots/ur5e_2f85/{name}"))).unwrap()
    };
    let reach = |from: &str, to: &str| {
        let arm = stdlib("ur5e_2f85.urdf");
        assert_eq!(arm.matches(from).count(), 1, "{from}");
        scratch.file("arm.urdf", arm.replace(from, to));
        let document = scratch.trueup(&["robot", "check", "arm.urdf", "--json"]).json();
        let mut checks = document["checks"].as_array().unwrap().iter();
        let reach = checks.find(|check| check["name"] == "reach").unwrap();
        assert_eq!(reach["state"], "missing", "{reach}");
        ["found", "write"].map(|key| reach[key].as_str().unwrap().to_owned())
    };
    scratch.file("robot.toml", stdlib("robot.toml"));
    let turns = "rpy=\"0 0 0\"/><axis xyz=\"0 0 1\"/><limit lower=\"-6.283185307179586\" upper=\"6.283185307179586\"";
    let wrist = format!("<origin xyz=\"-0.3922 0 0.1333\" {turns}");
    let narrow = wrist.replace("6.283185307179586", "0.3");
    let [found, write] = reach(&wrist, &narrow);
    assert!(found.contains("0 of 8") && found.contains("the range of wrist_1_joint"), "{found}");
    assert!(write.starts_with("<limit") && write.contains("wrist_1_joint"), "{write}");
    let ball = "<origin xyz=\"0.0011 -0.0021 -0.0276\"/><geometry><sphere radius=\"0.0421\"/>";
    let [found, write] = reach(ball, &ball.replace("0.0421", "0.3"));
    assert!(found.contains("wrist_3_link") && found.contains(" overlap by "), "{found}");
    assert!(write.contains("shapes") && write.contains("wrist_3_link"), "{write}");
}

/// The cheapest run that grasps: the twin alone, which is as its model says, and one candidate.
#[test]
fn the_other_arms_pick_up_the_kitchens_jar() {
    for arm in ["panda", "ur5e"] {
        let scratch = Scratch::new(&format!("cli-pick-{arm}"));
        let scene = project(&format!("stdlib/scenes/kitchen_{arm}.task"));
        let said = scratch.trueup(&[
            "--scene",
            &scene,
            "--robot",
            "twin",
            "--without-regression",
            "3",
            "--candidates",
            "1",
            "-c",
            "pick(jar)",
            "--json",
        ]);
        let document = said.json();
        assert_eq!(said.code, 0, "{arm}: {document} {}", said.err);
        assert_eq!(document["outcome"], "success", "{arm}");
    }
}
