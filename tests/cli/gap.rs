//! `trueup gap` as a stranger uses it: the finding, the model file, the page, the mistakes.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::discovery::bag::of_an_elbow;
use crate::program::Scratch;

fn recording(name: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/discovery/recordings");
    root.join(name).display().to_string()
}

#[test]
fn an_identified_geometry_becomes_a_copy_of_the_robots_file() {
    let scratch = Scratch::new("cli-gap-poses");
    let (table, urdf) = crate::discovery::poses::off_everywhere();
    scratch.file("poses.csv", table);
    scratch.file("arm.urdf", &urdf);
    let args = ["gap", "poses.csv", "--robot-file", "arm.urdf", "--json"];
    let said = scratch.trueup(&args);
    let finding: Value = serde_json::from_str(&said.out).unwrap();
    assert_eq!((said.code, &finding["verdict"]), (0, &"nothing_missing".into()), "{finding}");
    assert_eq!(finding["identified"][0]["unit"], "m");
    assert!(!scratch.path("arm.identified.urdf").exists(), "only --apply writes it");

    let said = scratch.trueup(&[&args[..4], &["--apply", "--out", "found", "--quiet"]].concat());
    assert_eq!((said.code, said.err.as_str()), (0, ""), "{said:?}");
    assert!(said.out.contains("numbers of the model are off, nothing else is missing"), "{said:?}");
    assert_eq!(fs::read_to_string(scratch.path("arm.urdf")).unwrap(), urdf, "the file stays");
    let copy = fs::read_to_string(scratch.path("arm.identified.urdf")).unwrap();
    assert!(copy.contains("<!-- numbers identified by trueup gap from poses.csv; arm.urdf is"));
    assert_eq!(fs::read_to_string(scratch.path("found/arm.identified.urdf")).unwrap(), copy);
    assert!(fs::read_to_string(scratch.path("found/gap.html")).unwrap().contains("<svg"));

    let again = ["gap", "poses.csv", "--robot-file", "arm.identified.urdf", "--json"];
    let finding = scratch.trueup(&again).json();
    assert_eq!(finding["verdict"], "nothing_missing");
    assert_eq!(finding["identified"], Value::Null);
    let said = scratch.typed(&[], ":undo-edit\n:undo-edit\n");
    assert_eq!(said.code, 0, "{said:?}");
    assert!(!scratch.path("arm.identified.urdf").exists(), "{said:?}");
}

#[test]
fn a_finding_is_written_into_the_twin_and_then_nothing_is_missing() {
    let scratch = Scratch::new("cli-gap");
    let model = "// Ours.\ntwin arm of kitchen {\n}\n";
    scratch.file("arm.task", model);
    let (a, b) = (recording("coulomb_a.csv"), recording("coulomb_b.csv"));
    let args = ["gap", &a, &b, "--model", "arm.task", "--json"];
    let said = scratch.trueup(&args);
    assert_eq!((said.code, said.err.as_str()), (0, ""), "{}", said.out);
    let finding: Value = serde_json::from_str(&said.out).unwrap();
    assert_eq!(finding["verdict"], "named");
    assert_eq!(finding["effects"][0]["name"], "coulomb_friction");
    assert_eq!(finding["effects"][0]["parameters"]["torque"]["unit"], "N*m");
    assert_eq!(finding["where"][0]["channel"], "tau_1");
    assert_eq!(finding["gap"]["metric"], "nrmse");
    assert!(finding["model"]["diff"].as_str().unwrap().contains("+    effect coulomb_friction"));
    assert_eq!(finding["next_experiment"], Value::Null);
    assert_eq!(
        fs::read_to_string(scratch.path("arm.task")).unwrap(),
        model,
        "only --apply changes it"
    );

    let said = scratch.trueup(&[&args[..5], &["--apply", "--out", "found", "--quiet"]].concat());
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(said.out.contains("one effect is missing"), "{}", said.out);
    assert!(said.out.contains("sign(dq_1)"), "{}", said.out);
    let changed = fs::read_to_string(scratch.path("arm.task")).unwrap();
    assert!(
        changed.starts_with("// Ours.\n") && changed.contains("// found by gap in coulomb_a.csv")
    );
    assert_eq!(fs::read_to_string(scratch.path("arm.task.before-gap")).unwrap(), model);
    let page = fs::read_to_string(scratch.path("found/gap.html")).unwrap();
    assert!(page.contains("<svg") && !page.contains("src="), "the page is one file");
    assert_eq!(scratch.trueup(&["check", "arm.task"]).code, 0);

    let said = scratch.trueup(&args);
    let finding: Value = serde_json::from_str(&said.out).unwrap();
    assert_eq!(finding["verdict"], "nothing_missing", "{}", said.out);
}

/// The camera that the points are seen by, as far as its lens does not bend.
const CAMERA: &str = r#"{"camera": {"fx_px": 800, "fy_px": 800, "cx_px": 640, "cy_px": 360},
    "world_from_camera": {"xyz_m": [0, 0, 0], "quat_wxyz": [1, 0, 0, 0]}}"#;

/// Points before that camera, whose lens bends by `k1`, with half a pixel of even noise.
fn points_through_a_lens(k1: f64, seed: u64) -> String {
    let mut text = String::from("x[m],y[m],z[m],u[px],v[px],view\n");
    let mut state = seed;
    let mut noise = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / f64::from(1 << 24) - 0.5
    };
    for (i, j) in (-6..=6).flat_map(|i| (-4..=4).map(move |j| (f64::from(i), f64::from(j)))) {
        let z = 1.0 + 0.1 * (i * j).rem_euclid(7.0);
        let (x, y) = (0.1 * i, 0.1 * j);
        let bent = 1.0 + k1 * (x * x + y * y);
        let (u, v) = (640.0 + 800.0 * x * bent + noise(), 360.0 + 800.0 * y * bent + noise());
        writeln!(text, "{},{},{z},{u:.3},{v:.3},1", x * z, y * z).unwrap();
    }
    text
}

#[test]
fn a_lens_is_written_into_the_twin_and_then_nothing_is_missing() {
    let scratch = Scratch::new("cli-gap-points");
    scratch.file("cell.task", "twin cell of kitchen {\n}\n");
    for (name, seed) in [("a", 1), ("b", 2)] {
        scratch.file(&format!("{name}.csv"), points_through_a_lens(-0.1, seed));
        scratch.file(&format!("{name}.json"), CAMERA);
    }
    let args = ["gap", "a.csv", "b.csv", "--model", "cell.task"];
    let said = scratch.trueup(&[&args[..], &["--apply", "--out", "found", "--json"]].concat());
    assert_eq!((said.code, said.err.as_str()), (0, ""), "{}", said.out);
    let finding: Value = serde_json::from_str(&said.out).unwrap();
    assert_eq!(finding["verdict"], "named", "{finding:#}");
    assert_eq!(finding["effects"][0]["name"], "radial_distortion");
    let k1 = finding["effects"][0]["parameters"]["k1"]["value"].as_f64().unwrap();
    assert!((k1 + 0.1).abs() < 0.01, "{k1}");
    let changed = fs::read_to_string(scratch.path("cell.task")).unwrap();
    assert!(changed.contains("effect radial_distortion(camera) { k1 = -0."), "{changed}");
    assert!(fs::read_to_string(scratch.path("found/gap.html")).unwrap().contains("<svg"));
    assert_eq!(scratch.trueup(&["check", "cell.task"]).code, 0);

    let said = scratch.trueup(&[&args[..], &["--json"]].concat());
    let finding: Value = serde_json::from_str(&said.out).unwrap();
    assert_eq!(finding["verdict"], "nothing_missing", "{finding:#}");
}

/// The line was taken for the camera's own axes, and a camera of which nothing was wrong stood elsewhere; that `check` calls the
/// file wrong was not said.
#[test]
fn where_a_tracker_stands_is_written_as_a_trackers_and_left_aside_by_a_camera() {
    let scratch = Scratch::new("cli-gap-tracker");
    scratch.file("poses.csv", crate::discovery::poses::seen_from_elsewhere(0));
    let bench = "scene bench {\n    robot panda at (0 m, 0 m, 0 m)\n}\ntwin t of bench {\n}\n";
    scratch.file("bench.task", bench);
    let urdf = recording("gen3_bare.urdf");
    let args = ["gap", "poses.csv", "--robot-file", &urdf, "--model", "bench.task", "--apply"];
    let finding = scratch.trueup(&[&args[..], &["--json"]].concat()).json();
    assert_eq!(finding["effects"][0]["name"], "camera_shift", "{finding:#}");
    assert_eq!(finding["effects"][0]["at"], "camera");
    let model = fs::read_to_string(scratch.path("bench.task")).unwrap();
    assert!(model.contains("    effect camera_shift(tracker) { x = 0.00"), "{model}");
    let notes = finding["notes"].to_string();
    assert!(notes.contains("`trueup check bench.task` finds 2 mistakes"), "{notes}");
    assert!(notes.contains("the scene `bench` has no camera"), "{notes}");

    for (name, seed) in [("a", 1), ("b", 2)] {
        scratch.file(&format!("{name}.csv"), points_through_a_lens(0.0, seed));
        scratch.file(&format!("{name}.json"), CAMERA);
    }
    let finding = scratch.trueup(&["gap", "a.csv", "b.csv", "--model", "bench.task", "--json"]);
    let finding = finding.json();
    assert_eq!(finding["verdict"], "nothing_missing", "{finding:#}");
    let notes = finding["notes"].to_string();
    assert!(notes.contains("effect camera_shift(tracker) is not of the camera"), "{notes}");
}

#[test]
fn mistakes_are_told_with_their_place() {
    let scratch = Scratch::new("cli-gap-mistakes");
    let control = recording("control_a.csv");
    scratch.file("nan.csv", "t[s],q_cmd_1[rad],tau_1[N*m]\n0,0,0\n0.1,nan,0\n0.2,0,0\n0.3,0,0\n0.4,0,0\n0.5,0,0\n0.6,0,0\n0.7,0,0\n0.8,0,0\n0.9,0,0\n1,0,0\n");
    scratch.file("two.csv", "t[s],q_1[rad]\n0,0\n1,1\n");
    scratch.file("lost.csv", "t[s],q_1[rad]\n0,0\n1,1\n2,1\n");
    scratch.file("lost.json", r#"{"robot": "nowhere.urdf"}"#);
    scratch.file("blind.csv", "x[m],y[m],z[m],u[px],v[px]\n0,0,1,2,3\n");
    scratch.file("no_twin.task", "fluent f(o: Object) = true\n");
    let six: Vec<String> = (1..=6).map(|n| format!(",q_{n}[rad],tau_{n}[N*m]")).collect();
    let rows = (0..20).fold(String::new(), |all, k| format!("{all}{k}{}\n", ",0".repeat(12)));
    scratch.file("six.csv", format!("t[s]{}\n{rows}", six.concat()));
    let copy = fs::read_to_string(&control).unwrap();
    scratch.file("copy.csv", copy.trim_end());
    let sidecar = fs::read_to_string(control.replace(".csv", ".json")).unwrap();
    scratch.file("copy.json", sidecar);
    let cases: [(&[&str], &str, &str); 11] = [
        (&["gap", &control, "copy.csv"], "gap::same", "same rows"),
        (&["gap", "six.csv"], "gap::robot", "6 joints, and no robot is named"),
        (&["gap"], "usage", "required"),
        (&["gap", "gone.csv"], "io::missing", "gone.csv"),
        (&["gap", "two.csv"], "gap::recording", "2 rows"),
        (&["gap", "lost.csv"], "gap::robot", "nowhere.urdf"),
        (&["gap", "blind.csv"], "gap::recording", "what the camera is"),
        (&["gap", "nan.csv"], "gap::recording", "`nan`"),
        (&["gap", &control, "--holdout", "2"], "gap::holdout", "2"),
        (&["gap", &control, "--apply"], "gap::apply", "model file"),
        (&["gap", &control, "--model", "no_twin.task"], "gap::model", "no `twin`"),
    ];
    for (args, code, says) in cases {
        let said = scratch.trueup(&[args, &["--json"]].concat());
        assert_eq!(said.code, 2, "{args:?}: {}", said.out);
        let answer: Value = serde_json::from_str(&said.out).unwrap();
        let error = &answer["error"];
        assert_eq!(error["code"], code, "{args:?}: {}", said.out);
        assert!(error["message"].as_str().unwrap().contains(says), "{args:?}: {}", said.out);
    }
}

/// The help named `--map` alone, where the arm's file counts its gripper as one more joint.
#[test]
fn a_recording_that_ends_before_the_gripper_is_told_the_tip_that_would_do() {
    let scratch = Scratch::new("cli-gap-tip");
    let joint = |n: usize| {
        format!(
            r#"<link name="link_{n}"/><joint name="joint_{n}" type="revolute"><parent link="link_{}"/><child link="link_{n}"/>
            <origin xyz="0 0 0.2"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="1" effort="9"/></joint>"#,
            n - 1
        )
    };
    let joints: String = (1..=3).map(joint).collect();
    scratch.file("arm.urdf", format!(r#"<robot name="arm"><link name="link_0"/>{joints}</robot>"#));
    let rows = (0..20).fold(String::new(), |all, k| format!("{all}{k}{}\n", ",0".repeat(4)));
    scratch.file("two.csv", format!("t[s],q_1[rad],q_2[rad],tau_1[N*m],tau_2[N*m]\n{rows}"));
    let told = |sidecar: &str| {
        scratch.file("two.json", sidecar);
        let said = scratch.trueup(&["gap", "two.csv", "--json"]);
        assert_eq!(said.code, 2, "{}", said.out);
        let answer: Value = serde_json::from_str(&said.out).unwrap();
        answer["error"].to_string()
    };
    let error = told(r#"{"robot": "arm.urdf"}"#);
    assert!(error.contains("no column `q_3`"), "{error}");
    assert!(error.contains("before the joint joint_3"), "{error}");
    assert!(error.contains(r#"`\"tip\": \"link_2\"`"#), "{error}");
    assert!(error.contains("`--map 'THEIRS=q_3[rad]'`"), "{error}");
    let error = told(r#"{"robot": "arm.urdf", "tip": "link_2"}"#);
    assert!(!error.contains("q_3"), "{error}");
}

/// `gen3_2f85` alone was one of the stdlib's robots; `panda` was a file that is not found.
#[test]
fn a_sidecar_names_a_robot_of_the_stdlib() {
    let scratch = Scratch::new("cli-gap-stdlib");
    let columns: Vec<String> = (1..=9).map(|n| format!(",q_{n}[rad],tau_{n}[N*m]")).collect();
    let rows = (0..20).fold(String::new(), |all, k| format!("{all}{k}{}\n", ",0".repeat(18)));
    scratch.file("nine.csv", format!("t[s]{}\n{rows}", columns.concat()));
    // None of them has nine joints, and that is what is wrong.
    for robot in ["gen3", "gen3_2f85", "panda", "ur5e_2f85"] {
        scratch.file("nine.json", format!(r#"{{"robot": "{robot}"}}"#));
        let said = scratch.trueup(&["gap", "nine.csv", "--json"]);
        assert_eq!(said.error("code"), "gap::recording", "{robot}: {}", said.out);
        assert!(said.error("message").contains("9 columns"), "{robot}: {}", said.out);
    }
    let said = scratch.trueup(&["gap", "nine.csv", "--robot-file", "panda", "--json"]);
    assert!(said.error("message").contains("9 columns"), "{}", said.out);
    scratch.file("nine.json", r#"{"robot": "pandar"}"#);
    let said = scratch.trueup(&["gap", "nine.csv", "--json"]);
    assert_eq!(said.error("code"), "gap::robot", "{}", said.out);
    assert!(said.error("help").contains("gen3_2f85, panda, ur5e_2f85"), "{}", said.out);
}

/// It was told that there is no such robot, after a note that the option does nothing, and to name it otherwise last.
#[test]
fn a_robots_file_under_the_wrong_option_is_told_under_which_once() {
    let scratch = Scratch::new("cli-gap-robot");
    let said = scratch.trueup(&["gap", "walk.csv", "--robot", "arm.urdf"]);
    assert_eq!(said.code, 2, "{said:?}");
    assert!(said.err.starts_with("error: `gap` runs on no arm"), "{}", said.err);
    assert_eq!(said.err.matches("`--robot-file arm.urdf`").count(), 1, "{}", said.err);
    let said = scratch.trueup(&["run", "a.task", "--robot", "arm.urdf"]);
    assert!(said.err.contains("there is no robot `arm.urdf`"), "{}", said.err);
}

/// The folder that `ros2 bag record` writes was refused, as no run, and so was the sidecar beside it.
#[test]
fn the_folder_of_a_bag_is_one_recording_with_its_sidecar_beside_it() {
    let scratch = Scratch::new("cli-gap-bag");
    scratch.file("walk/metadata.yaml", "rosbag2_bagfile_information:\n");
    // Neither part has the three states that a recording needs.
    scratch.file("walk/walk_0.mcap", of_an_elbow(1.0, 2));
    scratch.file("walk/walk_1.mcap", of_an_elbow(1.02, 2));
    scratch.file("walk.json", r#"{"robot": "nowhere.urdf"}"#);
    for folder in ["walk", "walk/"] {
        let said = scratch.trueup(&["gap", folder, "--json"]);
        assert_eq!(said.error("code"), "gap::robot", "{}", said.out);
        assert!(said.error("message").contains("nowhere.urdf"), "{}", said.out);
    }
    // Its robot lies where its sidecar does.
    scratch.file("nowhere.urdf", "<robot");
    let said = scratch.trueup(&["gap", "walk", "--json"]);
    assert!(said.error("where").contains("nowhere.urdf"), "{}", said.out);
}

/// Files that are no text were told as "not UTF-8", without a way on.
#[test]
fn a_recording_in_another_form_is_told_with_what_makes_a_readable_one() {
    let scratch = Scratch::new("cli-gap-forms");
    scratch.file("walk/metadata.yaml", "rosbag2_bagfile_information:\n");
    scratch.file("walk/walk_0.db3", b"SQLite format 3\0\x10\0\xff");
    scratch.file("run.parquet", b"PAR1\x15\x04\xff\xfe");
    scratch.file("run.csv.gz", b"\x1f\x8b\x08\x00\xff");
    scratch.file("noise.csv", b"t[s],q_1[rad]\n\xff\xfe");
    let cases = [
        ("walk", "gap::format", "`ros2 bag convert -i walk -o"),
        ("walk/walk_0.db3", "gap::format", "uri: walk/walk_0_mcap"),
        ("run.parquet", "gap::format", "read_parquet('run.parquet').to_csv('run.csv'"),
        ("run.csv.gz", "gap::format", "gunzip -k run.csv.gz"),
        ("noise.csv", "io::text", "UTF-8"),
    ];
    for (path, code, helps) in cases {
        let said = scratch.trueup(&["gap", path, "--json"]);
        assert_eq!((said.code, said.error("code").as_str()), (2, code), "{path}: {}", said.out);
        assert!(said.error("help").contains(helps), "{path}: {}", said.out);
    }
}

/// A jar that creeps down at `rate` m/s in a hand that sways, seen at 20 Hz with half a millimetre of even noise.
fn held(rate: f64, seed: u64) -> String {
    let mut text = String::from(
        "t[s],tcp_x[m],tcp_y[m],tcp_z[m],gripper[mm],object_x[m],object_y[m],object_z[m]\n",
    );
    let mut state = seed;
    let mut even = move || {
        state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
        5e-4 * 3.0_f64.sqrt() * ((state >> 40) as f64 / f64::from(1_u32 << 23) - 1.0)
    };
    for row in 0..240 {
        let t = f64::from(row) * 0.05;
        let (x, y, z) =
            (0.5 + 0.1 * (0.9 * t).sin(), 0.1 * (0.6 * t).cos(), 0.3 + 0.05 * (0.7 * t).sin());
        let fingers = if t < 1.0 { 85.0 } else { 65.0 };
        let crept = rate * (t - 1.0).max(0.0);
        let seen = (x + 0.002 + even(), y - 0.01 + even(), z - 0.05 - crept + even());
        writeln!(
            text,
            "{t:.2},{x:.5},{y:.5},{z:.5},{fingers},{:.5},{:.5},{:.5}",
            seen.0, seen.1, seen.2
        )
        .unwrap();
    }
    text
}

#[test]
fn a_grip_that_slips_is_named_from_files_and_kept_in_the_twin() {
    let scratch = Scratch::new("cli-gap-held");
    scratch.file("bench.task", "twin bench of kitchen {\n}\n");
    for (name, seed) in [("a", 1), ("b", 2)] {
        scratch.file(&format!("{name}.csv"), held(0.002, seed));
        scratch.file(&format!("{name}.json"), r#"{"held": {"object": "jar"}}"#);
    }
    let args = ["gap", "a.csv", "b.csv", "--model", "bench.task", "--apply", "--json"];
    let finding = scratch.trueup(&args).json();
    assert_eq!(finding["verdict"], "named", "{finding}");
    assert_eq!(finding["effects"][0]["name"], "grip_slip");
    let rate = finding["effects"][0]["parameters"]["rate"]["value"].as_f64().unwrap();
    assert!((rate - 0.002).abs() < 1e-4, "{rate} m/s");
    assert_eq!(finding["fluents"], Value::Null, "there is no run in it");
    assert_eq!(scratch.trueup(&["check", "bench.task"]).code, 0);
    let again = scratch.trueup(&args[..6]);
    assert!(again.out.contains("nothing is missing"), "{}{}", again.out, again.err);

    let said = scratch.trueup(&["gap", "a.csv", &recording("coulomb_a.csv"), "--json"]);
    assert_eq!((said.code, said.error("code").as_str()), (2, "gap::mixed"));
    scratch.file("a.json", r#"{"held": {"object": "jug"}}"#);
    let said = scratch.trueup(&["gap", "a.csv", "--json"]);
    assert_eq!((said.code, said.error("code").as_str()), (2, "gap::recording"));
    assert!(said.error("help").contains("jar"), "{}", said.out);
}

/// Copies a folder; texts pass through `change`, names through the same.
fn copied(from: &Path, to: &Path, change: &dyn Fn(&str) -> String) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let name = change(path.file_name().unwrap().to_str().unwrap());
        if path.is_dir() {
            copied(&path, &to.join(name), change);
        } else {
            let text = fs::read_to_string(&path).unwrap();
            let is_ours = path.extension().is_some_and(|ending| ending == "task");
            fs::write(to.join(name), if is_ours { change(&text) } else { text }).unwrap();
        }
    }
}

/// What a run did is kept by the bindings, so actions may be called anything.
#[test]
fn a_pour_by_any_other_name_is_a_pour_to_gap() {
    let scratch = Scratch::new("cli-gap-renamed");
    let stdlib = Path::new(env!("CARGO_MANIFEST_DIR")).join("stdlib");
    for folder in ["actions", "tasks"] {
        copied(&stdlib.join(folder), &scratch.path("own").join(folder), &|text| {
            let text = text.replace("grasp.rhai", "seize.rhai").replace("tilt.rhai", "tip.rhai");
            let text = text.replace("unseize", "ungrasp").replace("untip.rhai", "untilt.rhai");
            let text = text.replace("lower.rhai", "let_down.rhai").replace(" lower(", " let_down(");
            let text = text
                .replace(" grasp(o", " seize(o")
                .replace("failure of grasp", "failure of seize");
            text.replace("action tilt(", "action tip(")
                .replace("    tilt(source, target", "    tip(source, target")
        });
    }
    scratch.file(
        "plain.toml",
        "[switches]\ncamera_pose = false\nlens = false\nsensor = false\nlight = false\n\
         zero_offsets = false\ntool_offset = false\njoint_friction = false\ncompliance = false\n\
         latency = false\nreadings = false\nsurfaces = false\nfill = false\n",
    );
    let with = ["--stdlib", "own", "--lab", "plain.toml", "--without-regression", "3"];
    let said = scratch.trueup(&[&["-c", "pour(jar, cup)", "--record", "runs"], &with[..]].concat());
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    assert!(said.out.contains("seize(jar") && said.out.contains("tip(jar, cup"), "{}", said.out);
    let run = fs::read_dir(scratch.path("runs")).unwrap().next().unwrap().unwrap().path();
    let said = scratch.trueup(&["gap", &run.display().to_string(), "--stdlib", "own"]);
    assert!(said.out.contains("the scale read what the model says"), "{}{}", said.out, said.err);
    assert!(said.out.contains("liquid_volume"), "{}", said.out);
}

/// A folder of runs as it is after a day: one that was refused, two in which the arm moved, and answers to a quiz.
#[test]
fn a_folder_of_runs_is_its_runs_and_what_cannot_serve_is_named() {
    let scratch = Scratch::new("cli-gap-runs");
    let said = scratch.trueup(&["-c", "pour(jar, cup, amount: 900 mL)", "--record", "runs"]);
    assert_ne!(said.code, 0, "{}", said.out);
    let refused = fs::read_dir(scratch.path("runs")).unwrap().next().unwrap().unwrap().path();
    assert!(fs::read_to_string(refused.join("arm.csv")).unwrap().lines().count() < 2);
    let moved = ["29991231-000001-sway", "29991231-000002-sway"].map(|name| format!("runs/{name}"));
    for (folder, seed) in moved.iter().zip([1, 2]) {
        fs::create_dir(scratch.path(folder)).unwrap();
        fs::copy(refused.join("run.json"), scratch.path(folder).join("run.json")).unwrap();
        scratch.file(&format!("{folder}/arm.csv"), held(0.002, seed));
        scratch.file(&format!("{folder}/arm.json"), r#"{"held": {"object": "jar"}}"#);
    }
    scratch.file("runs/answers.jsonl", "{}\n");
    let notes = |args: &[&str]| {
        let finding = scratch.trueup(&[&["gap"], args, &["--json"]].concat()).json();
        assert_eq!(finding["effects"][0]["name"], "grip_slip", "{finding}");
        finding["notes"].to_string()
    };
    let refused = refused.strip_prefix(scratch.path("")).unwrap().display().to_string();
    let all = ["runs/answers.jsonl", &refused, &moved[0], &moved[1]];
    let told = notes(&all);
    assert!(told.contains("answers.jsonl is left out: no recording"), "{told}");
    let still = "is left out: the run ended before the arm moved";
    assert!(told.contains(still), "{told}");
    assert!(notes(&["runs"]).contains(still));
    assert!(!notes(&["2", "3"]).contains("left out"));

    let said = scratch.trueup(&["gap", "1", "--json"]);
    assert_eq!((said.code, said.error("code").as_str()), (2, "gap::nothing"), "{}", said.out);
    assert!(said.error("help").contains("before the arm moved"), "{}", said.out);
    let said = scratch.trueup(&["gap", "7", "--json"]);
    assert_eq!((said.code, said.error("code").as_str()), (2, "run::unknown"), "{}", said.out);

    // A run that was made elsewhere is not judged by what is at hand.
    let place = format!("{}/run.json", moved[0]);
    let record = fs::read_to_string(scratch.path(&place)).unwrap();
    let elsewhere =
        record.replacen(r#""scene":{"name":"kitchen""#, r#""scene":{"name":"bench""#, 1);
    assert_ne!(elsewhere, record, "the record says what it was made with");
    scratch.file(&place, elsewhere);
    let said = scratch.trueup(&["gap", &moved[0], "--json"]);
    assert_eq!((said.code, said.error("code").as_str()), (2, "gap::setting"), "{}", said.out);
    assert!(said.error("help").contains("--scene FILE"), "{}", said.out);
}
