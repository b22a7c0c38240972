//! `robot fk | ik | dynamics | plan`: the JSON of the interface, with the reference numbers in it.

use serde_json::Value;

use crate::program::Scratch;

/// Reference configurations of the Gen3: joint positions, flange pose, gravity torques of the arm.
const REFERENCE: &str = include_str!("../motion/reference.csv");

/// Returns the named columns of each row of the reference, rows first.
fn columns(names: &[&str]) -> Vec<Vec<f64>> {
    let mut lines = REFERENCE.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at: Vec<usize> =
        names.iter().map(|name| header.iter().position(|column| column == name).unwrap()).collect();
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            at.iter().map(|&column| cells[column].parse().unwrap()).collect()
        })
        .collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn close(a: &[f64], b: &[f64], by: f64) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= by)
}

#[test]
fn fk_agrees_with_the_reference_poses() {
    let scratch = Scratch::new("cli-fk");
    scratch.file("q.csv", REFERENCE);
    let said = scratch.trueup(&["robot", "fk", "--q-file", "q.csv", "--json"]);
    assert_eq!((said.code, said.err.as_str()), (0, ""));
    let document = said.json();
    let poses = document["poses"].as_array().unwrap();
    let expected = columns(&["px", "py", "pz", "qw", "qx", "qy", "qz"]);
    assert_eq!(poses.len(), expected.len());
    for (pose, expected) in poses.iter().zip(&expected) {
        assert_eq!(pose["tip"], "end_effector_link");
        let xyz = numbers(&pose["xyz_m"]);
        assert!(close(&xyz, &expected[..3], 1e-9), "{pose} against {expected:?}");
        let quaternion = numbers(&pose["quat_wxyz"]);
        let same = quaternion.iter().zip(&expected[3..]).map(|(a, b)| a * b).sum::<f64>();
        // A quaternion and its negative are one rotation; the reference has 12 digits.
        assert!((same.abs() - 1.0).abs() < 1e-9, "{pose} against {expected:?}");
    }
    // One row on the line, and a negative number is not an option.
    let said = scratch.trueup(&["robot", "fk", "--q", "-2.3,1.2,0.4,-1.9,2.6,-1.3,-1.7", "--json"]);
    let xyz = numbers(&said.json()["poses"][0]["xyz_m"]);
    assert!(close(&xyz, &[-0.342_948_612_576, 0.078_961_164_678_8, 0.746_965_256_435], 1e-9));
}

/// `robot check panda` was answered, `robot fk --robot-file panda` was not.
#[test]
fn a_robot_of_the_stdlib_is_named_everywhere_alike() {
    let scratch = Scratch::new("cli-fk-named");
    let q = "0,-0.7,0,-2.3,0,1.5,0.7";
    let fk = |which: &[&str]| {
        let said = scratch.trueup(&[&["robot", "fk", "--q", q, "--json"][..], which].concat());
        assert_eq!(said.code, 0, "{said:?}");
        said.json()["poses"].clone()
    };
    let folder = crate::program::project("stdlib/robots/panda");
    assert_eq!(fk(&["--robot-file", "panda"]), fk(&["--robot-file", &folder]));
    let hand = fk(&["--robot-file", "panda", "--tip", "panda_hand"]);
    assert_eq!(hand[0]["tip"], "panda_hand");
    let said = scratch.trueup(&["robot", "fk", "--q", q, "--robot-file", "pandar"]);
    assert_eq!(said.code, 2, "{said:?}");
}

#[test]
fn gravity_torques_agree_with_the_reference() {
    let scratch = Scratch::new("cli-dynamics");
    scratch.file("q.csv", REFERENCE);
    let said = scratch.trueup(&["robot", "dynamics", "--q-file", "q.csv", "--json"]);
    assert_eq!((said.code, said.err.as_str()), (0, ""));
    let document = said.json();
    let rows = document["rows"].as_array().unwrap();
    let names: Vec<String> = (1..=7).map(|joint| format!("g_V12_{joint}")).collect();
    let expected = columns(&names.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(rows.len(), expected.len());
    for (row, expected) in rows.iter().zip(&expected) {
        let torques = numbers(&row["gravity_nm"]);
        assert!(close(&torques, expected, 1e-6), "{torques:?} against {expected:?}");
        let mass: Vec<Vec<f64>> =
            row["mass_matrix"].as_array().unwrap().iter().map(numbers).collect();
        assert_eq!(mass.len(), 7);
        for (i, row) in mass.iter().enumerate() {
            assert!(row[i] > 0.0);
            for (k, element) in row.iter().enumerate() {
                assert!((element - mass[k][i]).abs() < 1e-12, "M is symmetric");
            }
        }
    }
}

/// What `ik` finds, `fk` confirms; what it does not find has a reason and a distance.
#[test]
fn ik_finds_what_fk_reaches_and_says_how_far_off_the_rest_is() {
    let scratch = Scratch::new("cli-ik");
    let poses = columns(&["px", "py", "pz", "qw", "qx", "qy", "qz"]);
    // `home`, and a point three metres away.
    let home: Vec<String> = poses[1].iter().map(f64::to_string).collect();
    scratch.file("poses.csv", format!("x,y,z,qw,qx,qy,qz\n{}\n3,0,0.3,1,0,0,0\n", home.join(",")));
    let said = scratch.trueup(&["robot", "ik", "--pose-file", "poses.csv", "--json"]);
    assert_eq!((said.code, said.err.as_str()), (1, ""), "one of them is not found");
    let document = said.json();
    let [found, far] = &document["solutions"].as_array().unwrap()[..] else {
        panic!("{document}");
    };
    assert_eq!(found["found"], true);
    assert!(found["position_error_m"].as_f64().unwrap() < 1e-6);
    assert!(found["rotation_error_rad"].as_f64().unwrap() < 1e-6);
    assert!(found["time_us"].as_f64().unwrap() >= 0.0);
    let q: Vec<String> = numbers(&found["q_rad"]).iter().map(f64::to_string).collect();
    let back = scratch.trueup(&["robot", "fk", "--q", &q.join(","), "--json"]).json();
    assert!(close(&numbers(&back["poses"][0]["xyz_m"]), &poses[1][..3], 1e-6));
    assert_eq!(far["found"], false);
    assert_eq!(far["reason"], "out_of_reach");
    // The flange reaches 0.9 m from a shoulder 0.285 m up.
    let nearest = far["nearest_m"].as_f64().unwrap();
    assert!((1.9..2.3).contains(&nearest), "{nearest}");
}

#[test]
fn a_plan_goes_round_an_obstacle_and_a_walled_in_goal_has_none() {
    let scratch = Scratch::new("cli-plan");
    let post = r#"{"shape": "cylinder", "pose": {"xyz_m": [0.5, 0.0, 0.4], "quat_wxyz": [1, 0, 0, 0]},
                   "size_m": [0.05, 0.8]}"#;
    let (start, goal) =
        ([-0.9, 0.9, 3.1, -1.6, 0.0, 1.0, 1.57], [0.9, 0.9, 3.1, -1.6, 0.0, 1.0, 1.57]);
    let problem = |obstacle: &str| {
        format!(r#"{{"start": {start:?}, "goals": [{goal:?}], "obstacles": [{obstacle}]}}"#)
    };
    scratch.file("post.json", problem(post));
    let said =
        scratch.trueup(&["robot", "plan", "--problem", "post.json", "--json", "--seed", "3"]);
    assert_eq!((said.code, said.err.as_str()), (0, ""), "{}", said.out);
    let plan = said.json();
    assert_eq!(plan["found"], true);
    let path: Vec<Vec<f64>> = plan["path_rad"].as_array().unwrap().iter().map(numbers).collect();
    assert!(path.len() > 2, "straight through the post is no way");
    assert!(close(&path[0], &start, 1e-9));
    assert!(close(path.last().unwrap(), &goal, 1e-9));
    let time = numbers(&plan["time_s"]);
    assert_eq!(time.len(), path.len());
    assert!(time.windows(2).all(|t| t[1] > t[0]));
    let t = numbers(&plan["trajectory"]["t_s"]);
    assert_eq!(t.len(), plan["trajectory"]["q_rad"].as_array().unwrap().len());
    assert!(plan["min_clearance_m"].as_f64().unwrap() > 0.0);
    assert!(plan["length_rad"].as_f64().unwrap() > 1.8);
    let again = scratch
        .trueup(&["robot", "plan", "--problem", "post.json", "--json", "--seed", "3"])
        .json();
    assert_eq!(again["path_rad"], plan["path_rad"], "same seed, same path");
    let told = scratch.trueup(&["robot", "plan", "--problem", "post.json", "--seed", "3"]);
    assert_eq!((told.code, told.err.as_str()), (0, ""), "{}", told.out);
    assert!(told.out.lines().count() <= 18 && told.out.contains("`--json`"), "{}", told.out);
    assert!(told.out.contains(" mm from anything"), "{}", told.out);
    assert!(told.out.contains(" corners to the goal, "), "{}", told.out);

    let on_the_goal = r#"{"shape": "sphere", "pose": {"xyz_m": [0.0, 0.0, 0.6], "quat_wxyz": [1, 0, 0, 0]},
                          "size_m": [0.6]}"#;
    scratch.file("walled.json", problem(on_the_goal));
    let said = scratch.trueup(&["robot", "plan", "--problem", "walled.json", "--json"]);
    assert_eq!(said.code, 1, "{}", said.out);
    assert_eq!(said.json()["found"], false);
    assert!(!said.json()["reason"].as_str().unwrap().is_empty());
}

/// With `--samples 1000` there was "no path found with 13134 samples", and "`--samples 10000` searches longer".
#[test]
fn samples_are_counted_in_all_and_more_are_offered_than_were_tried() {
    let scratch = Scratch::new("cli-plan-samples");
    let joint = |name: &str, from: &str, to: &str, axis: &str| {
        format!(
            r#"<joint name="{name}" type="prismatic"><parent link="{from}"/><child link="{to}"/><axis xyz="{axis}"/>
               <limit lower="-1" upper="1" velocity="1" effort="100"/></joint>"#
        )
    };
    let joints = [joint("x", "base", "bar", "1 0 0"), joint("y", "bar", "body", "0 1 0")].concat();
    scratch.file(
        "cube.urdf",
        format!(
            r#"<robot name="cube"><link name="base"/><link name="bar"/><link name="body"><collision>
               <geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>{joints}</robot>"#
        ),
    );
    scratch.file(
        "wall.json",
        r#"{"start": [-0.5, 0], "goals": [[0.5, 0]], "obstacles": [{"name": "wall", "shape": "box",
            "size_m": [0.1, 4, 1], "pose": {"xyz_m": [0, 0, 0], "quat_wxyz": [1, 0, 0, 0]}}]}"#,
    );
    let args = ["robot", "plan", "--robot-file", "cube.urdf", "--problem", "wall.json", "--json"];
    let said = scratch.trueup(&[&args[..], &["--samples", "40"]].concat());
    assert_eq!((said.code, said.err.as_str()), (1, ""), "{}", said.out);
    let answer = said.json();
    let reason = answer["reason"].as_str().unwrap();
    assert!(reason.starts_with("no path found with 40 samples: "), "{reason}");
    assert!(answer["help"].as_str().unwrap().starts_with("`--samples 400` searches"), "{answer}");
}

/// An arm of two joints without masses: the first part has no shape, the second a mesh that is not read.
const UNSEEN: &str = r#"<robot name="r"><link name="base"/><link name="mid"/>
  <link name="arm"><collision><geometry><mesh filename="arm.dae"/></geometry></collision></link>
  <joint name="a" type="revolute"><parent link="base"/><child link="mid"/><origin xyz="0 0 0.5"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="50" velocity="2"/></joint>
  <joint name="b" type="revolute"><parent link="mid"/><child link="arm"/><origin xyz="0.1 0 0.1"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="50" velocity="2"/></joint></robot>"#;

/// "Can touch nothing", of an arm whose meshes were left out.
#[test]
fn a_plan_names_what_of_the_arm_it_does_not_check() {
    let scratch = Scratch::new("cli-plan-unseen");
    scratch.file("unseen.urdf", UNSEEN);
    let ball = r#"{"shape": "sphere", "size_m": [0.1], "pose": {"xyz_m": [0.3, 0.15, 0.32], "quat_wxyz": [1, 0, 0, 0]}}"#;
    let problem = |start: &str| {
        format!(r#"{{"start": {start}, "goals": [[1, 0.5]], "obstacles": [{ball}]}}"#)
    };
    scratch.file("way.json", problem("[0, 0]"));
    scratch.file("beyond.json", problem("[3, 0]"));
    let plan = |robot: &str, problem: &str, more: &[&str]| {
        let args = ["robot", "plan", "--robot-file", robot, "--problem", problem];
        scratch.trueup(&[&args[..], more].concat())
    };
    let said = plan("unseen.urdf", "way.json", &["--json"]);
    assert_eq!((said.code, said.err.as_str()), (0, ""), "{}", said.out);
    let answer = said.json();
    assert!(answer["min_clearance_m"].is_null(), "{answer}");
    let left = answer["left_out"].as_array().unwrap();
    assert_eq!(left.len(), 2, "{answer}");
    assert_eq!(left[0]["link"], "arm");
    assert_eq!(left[0]["mesh"], "arm.dae");
    assert!(left[0]["why"].as_str().unwrap().contains("dae is not read"), "{answer}");
    assert_eq!(left[1]["link"], "mid");
    assert!(left[1].get("mesh").is_none() && left[1]["why"].is_string(), "{answer}");
    let told = plan("unseen.urdf", "way.json", &[]).out;
    assert!(told.contains("and nothing of it is checked for collisions\n"), "{told}");
    assert!(told.contains("\n  arm: the mesh arm.dae is left out: dae is not read"), "{told}");
    assert!(told.contains("\n  mid: it has no collision shape\n"), "{told}");
    assert!(!told.contains("touch nothing"), "{told}");
    let told = plan("unseen.urdf", "beyond.json", &[]);
    assert!(told.code == 1 && told.out.contains("arm.dae is left out"), "{}", told.out);

    // A shape on one of the two: its distance is that of what is checked.
    let ball = "<link name=\"mid\"><collision><geometry><sphere radius=\"0.05\"/></geometry></collision></link>";
    scratch.file("half.urdf", UNSEEN.replace("<link name=\"mid\"/>", ball));
    let told = plan("half.urdf", "way.json", &[]).out;
    assert!(told.contains("and what is checked comes to "), "{told}");
    assert!(told.contains("arm.dae is left out") && !told.contains("mid: "), "{told}");
    // The arms of the stdlib have a shape on every part.
    for (robot, rest) in [("panda", "-0.7,0,-2.3,0,1.5,0.7"), ("ur5e_2f85", "-1.5,1.5,0,1.5,0")] {
        scratch.file("turn.json", format!(r#"{{"start": [0,{rest}], "goals": [[0.1,{rest}]]}}"#));
        let answer = plan(robot, "turn.json", &["--json"]).json();
        assert!(answer["found"].is_boolean() && answer.get("left_out").is_none(), "{answer}");
    }
}

/// All zeros, and no word.
#[test]
fn dynamics_without_masses_say_so() {
    let scratch = Scratch::new("cli-dynamics-massless");
    scratch.file("unseen.urdf", UNSEEN);
    let dynamics = |robot: &str, more: &[&str]| {
        let args = ["robot", "dynamics", "--robot-file", robot, "--q", "0.3,0.4"];
        scratch.trueup(&[&args[..], more].concat())
    };
    let notes = dynamics("unseen.urdf", &["--json"]).json()["notes"].clone();
    let note = "no <inertial> with a mass: mid, arm; gravity and mass matrix are those of the other parts alone";
    assert_eq!(notes, serde_json::json!([note]));
    let told = dynamics("unseen.urdf", &[]);
    assert!(told.code == 0 && told.out.contains(note), "{}", told.out);
    let mass = "<link name=\"mid\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>";
    scratch.file("half.urdf", UNSEEN.replace("<link name=\"mid\"/>", mass));
    let told = dynamics("half.urdf", &[]);
    assert!(told.out.contains("with a mass: arm;"), "{}", told.out);
    let q = "0,0.26,3.14,-2.27,0,0.96,1.57";
    for args in [
        &["robot", "dynamics", "--q", q, "--json"][..],
        &["robot", "dynamics", "--q", q, "--json", "--with-gripper"],
    ] {
        let said = scratch.trueup(args);
        assert!(said.json().get("notes").is_none(), "{}", said.out);
    }
}

#[test]
fn bad_numbers_are_one_message_and_exit_code_2() {
    let scratch = Scratch::new("cli-robot-numbers");
    scratch.file(
        "far.json",
        r#"{"start": [1e300, 0, 0, 0, 0, 0, 0], "goals": [[0, 0, 0, 0, 0, 0, 0]]}"#,
    );
    scratch.file("none.json", r#"{"start": [0, 0, 0, 0, 0, 0, 0], "goals": []}"#);
    for args in [
        &["fk", "--q", "1e308,0,0,0,0,0,0"][..],
        &["fk", "--q", "nan,0,0,0,0,0,0"],
        &["dynamics", "--q", "inf,0,0,0,0,0,0"],
        &["ik", "--pose", "1e308,0,0,1,0,0,0"],
        &["ik", "--pose", "0.5,0,0.3,1,0,0,0", "--near", "1e300,0,0,0,0,0,0"],
        &["plan", "--problem", "far.json"],
        &["plan", "--problem", "none.json"],
    ] {
        let said = scratch.trueup(&[&["robot"], args, &["--json"]].concat());
        assert_eq!((said.code, said.err.as_str()), (2, ""), "{args:?}: {}", said.out);
        assert!(!said.error("message").is_empty(), "{args:?}");
    }
}
