//! Bad input: one clear message, the right exit code, nothing half-written, with and without `--json`.

use crate::program::{Scratch, project};

/// One way to get it wrong, and what must be said.
struct Case {
    args: &'static [&'static str],
    exit: i32,
    code: &'static str,
    /// Part of the message.
    says: &'static str,
    /// Part of the help, if there must be any.
    helps: &'static str,
}

const fn case(
    args: &'static [&'static str],
    exit: i32,
    code: &'static str,
    says: &'static str,
    helps: &'static str,
) -> Case {
    Case { args, exit, code, says, helps }
}

const CASES: &[Case] = &[
    // Usage.
    case(&["frobnicate"], 2, "usage", "frobnicate", ""),
    case(&["run"], 2, "usage", "required", ""),
    case(&["check"], 2, "usage", "required", ""),
    case(&["-c", "pour(jar, cup)", "--seed", "abc"], 2, "usage", "abc", ""),
    case(&["-c", "pour(jar, cup)", "--robot", "foo"], 2, "robot::unknown", "foo", "lab"),
    case(
        &["-c", "pour(jar, cup)", "--robot", "kortex://10.0.0.1"],
        4,
        "robot::no_camera",
        "camera",
        "--camera-at",
    ),
    case(
        &["-c", "pour(jar, cup)", "--without-regression", "4"],
        2,
        "usage::regression",
        "4",
        "offset",
    ),
    // Files.
    case(&["check", "gone.task"], 2, "io::missing", "gone.task", ""),
    case(&["fmt", "gone.task"], 2, "io::missing", "gone.task", ""),
    case(&["graph", "gone.task"], 2, "io::missing", "gone.task", ""),
    case(&["run", "gone.task"], 2, "io::missing", "gone.task", ""),
    case(&["run", "."], 2, "io::read", "directory", ""),
    case(&["run", "bytes.task"], 2, "io::text", "bytes.task", "UTF-8"),
    case(&["run", "empty.task"], 2, "script::empty", "calls nothing", "pour(jar, cup)"),
    case(&["-c", "pour(jar, cup)", "--scene", "gone.task"], 2, "io::missing", "gone.task", ""),
    case(
        &["-c", "pour(jar, cup)", "--scene", "ur5.task"],
        2,
        "scene::robot",
        "gen3_2f85",
        "robots/",
    ),
    case(&["-c", "pour(jar, cup)", "--lab", "gone.toml"], 2, "io::missing", "gone.toml", ""),
    case(&["-c", "pour(jar, cup)", "--lab", "bad.toml"], 2, "lab::settings", "`foo`", ""),
    case(&["-c", "pour(jar, cup)", "--lab", "kettle.toml"], 2, "lab::settings", "kettle", ""),
    case(&["-c", "pour(jar, cup)", "--stdlib", "gone"], 2, "io::read", "gone", "stdlib"),
    case(
        &["-c", "pour(jar, cup)", "--record", "afile/x"],
        2,
        "io::write",
        "run folder",
        "--record",
    ),
    // Texts.
    case(&["run", "open.task"], 2, "task::unclosed", "never closed", ")"),
    case(&["run", "kup.task"], 2, "task::unknown_name", "`kup`", "`cup`"),
    case(&["run", "puor.task"], 2, "task::unknown_name", "`puor`", "`pour`"),
    case(&["run", "unit.task"], 2, "task::unit", "a length", "mL"),
    case(&["-c", "pour(jar"], 2, "task::unclosed", "never closed", ")"),
    case(&["-c", "pour(jar, kup)"], 2, "task::unknown_name", "`kup`", "`cup`"),
    case(&["-c", "puor(jar, cup)"], 2, "task::unknown_name", "`puor`", "`pour`"),
    case(&["-c", "pour(jar, cup, amount: 5 cm)"], 2, "task::unit", "a length", "mL"),
    case(&["-c", ""], 2, "task::empty", "nothing", "pour(jar, cup)"),
    // Robot.
    case(&["robot", "fk", "--q", "1,2"], 2, "robot::input", "7 are needed", ""),
    case(&["robot", "fk", "--q", "1,2,3,4,5,6,x"], 2, "robot::input", "\"x\"", ""),
    case(&["robot", "fk", "--q", "1,2,3,4,5,6,nan"], 2, "robot::input", "finite", ""),
    case(&["robot", "fk", "--q", ""], 2, "robot::input", "no numbers", ""),
    case(&["robot", "fk"], 2, "usage", "--q", ""),
    case(&["robot", "fk", "--q-file", "gone.csv"], 2, "io::missing", "gone.csv", ""),
    case(
        &["robot", "fk", "--q", "0", "--robot-file", "gone.urdf"],
        2,
        "robot::input",
        "gone.urdf",
        "",
    ),
    case(&["robot", "fk", "--q", "0", "--robot-file", "kup.task"], 2, "robot::input", "", ""),
    case(&["robot", "fk", "--q", "0", "--tip", "elbow"], 2, "robot::input", "elbow", ""),
    case(&["robot", "ik", "--pose", "0,0,0,0,0,0,0"], 2, "robot::input", "quaternion", ""),
    case(&["robot", "dynamics", "--q", "0,0,0"], 2, "robot::input", "7 are needed", ""),
    case(&["robot", "plan", "--problem", "gone.json"], 2, "io::missing", "gone.json", ""),
    case(
        &["robot", "plan", "--problem", "kup.task"],
        2,
        "robot::problem",
        "not a planning problem",
        "start",
    ),
    case(&["robot", "plan", "--problem", "cone.json"], 2, "robot::input", "cone", ""),
    case(&["robot", "plan", "--problem", "slip.json"], 2, "robot::problem", "`obstcles`", "box"),
    case(&["--speed", "5", "-c", "home()"], 2, "usage", "from 0.02 to 1", ""),
    case(&["--speed", "nan", "-c", "home()"], 2, "usage", "from 0.02 to 1", ""),
    case(
        &["--scene", "high.task", "-c", "home()"],
        2,
        "task::point",
        "heights are measured",
        "write `at (0.5 m, 0 m)`",
    ),
    // Camera.
    case(&["camera", "calibrate", "tiny.png"], 2, "usage", "--board", ""),
    case(&["camera", "calibrate", "tiny.png", "--board", "9x6"], 2, "usage", "25mm", ""),
    case(
        &["camera", "calibrate", "gone.png", "tiny.png", "--board", "chessboard:9x6:25mm"],
        2,
        "camera::board",
        "no chessboard seen",
        "inner corners",
    ),
    case(&["camera", "segment", "gone.png"], 2, "io::image", "gone.png", "PNG"),
    case(&["camera", "segment", "tiny.png", "--point", "9,999"], 2, "camera::prompt", "px", "left"),
    case(&["camera", "see", "gone.png"], 2, "io::image", "gone.png", "PNG"),
    case(&["camera", "see", "kup.task"], 2, "io::image", "kup.task", "PNG"),
    case(&["camera", "see", "broken.png"], 2, "io::image", "broken.png", "PNG"),
    case(&["camera", "see", "tiny.png"], 2, "camera::picture", "1280", ""),
    case(&["camera", "see", "tiny.png", "--scene", "gone.task"], 2, "io::missing", "gone.task", ""),
    case(&["camera", "see", "tiny.png", "--scene", "open.task"], 2, "task::unclosed", "", ""),
    case(
        &["camera", "see", "tiny.png", "--calibration", "kup.task"],
        2,
        "camera::calibration",
        "",
        "camera",
    ),
];

fn scratch(name: &str) -> Scratch {
    let scratch = Scratch::new(name);
    scratch.file("bytes.task", b"\xff\xfe\x00pour");
    scratch.file("empty.task", "// Nothing yet.\n");
    scratch.file("open.task", "pour(jar, cup\n");
    let kitchen = std::fs::read_to_string(project("stdlib/scenes/kitchen.task")).unwrap();
    scratch.file("ur5.task", kitchen.replace("robot gen3_2f85", "robot ur5"));
    scratch.file("kup.task", "pour(jar, kup)\n");
    scratch.file("puor.task", "puor(jar, cup)\n");
    scratch.file("unit.task", "pour(jar, cup, amount: 5 cm)\n");
    scratch.file("bad.toml", "[foo]\nx = 1\n");
    scratch.file("kettle.toml", "[placement.fixed.kettle]\nx_m = 0.5\ny_m = 0.0\n");
    scratch.file("afile", "a file where a folder is wanted");
    let zeros = "[0, 0, 0, 0, 0, 0, 0]";
    scratch.file(
        "cone.json",
        format!(
            r#"{{"start": {zeros}, "goals": [{zeros}], "obstacles": [{{"shape": "cone",
                "pose": {{"xyz_m": [1, 0, 0], "quat_wxyz": [1, 0, 0, 0]}}, "size_m": [0.1]}}]}}"#
        ),
    );
    scratch
        .file("slip.json", format!(r#"{{"start": {zeros}, "goals": [{zeros}], "obstcles": []}}"#));
    let table = "box(120 cm, 80 cm, 2 cm) at (0.50 m, 0 m";
    assert!(kitchen.contains(table), "the kitchen's table is elsewhere");
    scratch.file("high.task", kitchen.replace(table, &format!("{table}, 20 cm")));
    scratch.file("broken.png", b"\x89PNG\r\n\x1a\nand then nothing");
    image::RgbImage::new(8, 6).save(scratch.path("tiny.png")).unwrap();
    scratch
}

#[test]
fn each_mistake_is_one_json_error_and_nothing_else() {
    let scratch = scratch("cli-bad-json");
    let before = scratch.everything();
    for Case { args, exit, code, says, helps } in CASES {
        let said = scratch.trueup(&[*args, &["--json"]].concat());
        assert_eq!(said.code, *exit, "{args:?}: {said:?}");
        assert_eq!(said.error("code"), *code, "{args:?}");
        let (message, place) = (said.error("message"), said.error("where"));
        assert!(format!("{message} {place}").contains(says), "{args:?}: {message} ({place})");
        assert!(said.error("help").contains(helps), "{args:?}: {}", said.error("help"));
        assert_eq!(said.err, "", "{args:?}");
    }
    assert_eq!(scratch.everything(), before, "nothing was written");
}

#[test]
fn each_mistake_is_told_once_to_a_person() {
    let scratch = scratch("cli-bad-text");
    let before = scratch.everything();
    for Case { args, exit, code, says, helps } in CASES {
        let said = scratch.trueup(args);
        assert_eq!(said.code, *exit, "{args:?}: {said:?}");
        assert_eq!(said.out, "", "{args:?}: a mistake is no answer");
        assert!(said.err.contains(says) && said.err.contains(helps), "{args:?}: {}", said.err);
        // What clap says of usage is clap's own.
        for line in said
            .err
            .lines()
            .filter(|_| *code != "usage")
            .map(str::trim)
            .filter(|line| line.len() > 8)
        {
            assert_eq!(said.err.matches(line).count(), 1, "{args:?}: twice `{line}`: {}", said.err);
        }
    }
    assert_eq!(scratch.everything(), before, "nothing was written");
}

#[test]
fn a_prompt_has_no_json_form() {
    let said = Scratch::new("cli-bad-prompt").trueup(&["--json"]);
    assert_eq!((said.code, said.error("code").as_str()), (2, "usage"));
}

/// A scene file with no scene in it, and one whose scene makes no sense.
#[test]
fn a_scene_file_must_have_a_scene() {
    let scratch = Scratch::new("cli-bad-scene");
    scratch.file("none.task", "task nothing() { }\n");
    let said = scratch.trueup(&["-c", "pick(jar)", "--scene", "none.task", "--json"]);
    assert_eq!((said.code, said.error("code").as_str()), (2, "scene::missing"), "{}", said.out);
    assert!(said.error("message").contains("none.task"), "{}", said.out);
    let kitchen = std::fs::read_to_string(project("stdlib/scenes/kitchen.task")).unwrap();
    scratch.file("odd.task", kitchen.replace("radius 80 mm", "radius 80 mL"));
    let said = scratch.trueup(&["-c", "pick(jar)", "--scene", "odd.task", "--json"]);
    assert_eq!((said.code, said.error("code").as_str()), (2, "task::unit"), "{}", said.out);
    assert!(said.error("where").starts_with("odd.task:"), "{}", said.out);
}
