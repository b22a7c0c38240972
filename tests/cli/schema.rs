//! Every document of `--json` against its schema in `docs/schema/`.

use std::fmt::Write as _;
use std::fs;

use serde_json::Value;

use crate::program::Scratch;
use crate::schema::Schemas;

/// Schemas whose documents need an arm's controller, a model, a board or an hour: they are held to them where those are, but
/// for stopping an arm, its beat, labels, a probe and the paper's second and third table, which were compared by hand.
const ELSEWHERE: &[&str] = &[
    "common",
    "align-hand-eye",
    "camera-calibrate",
    "emulate",
    "kortex-beat",
    "kortex-status",
    "kortex-stop",
    "paper-table1",
    "paper-table2",
    "paper-table3",
    "trials",
    "trials-merge",
    "vqa-ask",
    "vqa-eval",
    "vqa-label",
    "vqa-probe",
];

/// A table of pairs, so that a map is fitted: u = 1.02 v + 5, with a little that is not.
fn pairs() -> String {
    let mut rows = String::from("u_x[px],u_y[px],v_x[px],v_y[px]");
    for k in 0..30 {
        let (x, y) = (f64::from(k * 37 % 30) * 40.0, f64::from(k * 11 % 30) * 20.0);
        let off = 0.2 * f64::from(k).sin();
        let _ = write!(rows, "\n{},{},{x},{y}", 1.02 * x + 5.0 + off, 0.99 * y - 3.0 - off);
    }
    rows
}

fn offsets() -> String {
    let mut rows = String::from("xs[m],ys[m],zs[m],xr[m],yr[m],zr[m]");
    for k in 0..20 {
        let p = [3, 7, 11].map(|by| 0.2 + 0.02 * f64::from(k * by % 20));
        let off = 5e-4 * f64::from(k).sin();
        let _ = write!(
            rows,
            "\n{},{},{},{},{},{}",
            p[0],
            p[1],
            p[2],
            p[0] + 0.01 + off,
            p[1] - 0.02,
            p[2] - off
        );
    }
    rows
}

/// Points of a board before a camera that is turned a little from view to view.
fn points() -> String {
    let mut rows = String::from("x[m],y[m],z[m],u[px],v[px],view");
    for view in 0..6 {
        let (a, b) = (0.3 * f64::from(view).sin(), 0.4 * f64::from(view + 2).cos());
        for k in 0..54 {
            let (x, y) = (0.025 * f64::from(k % 9), 0.025 * f64::from(k / 9));
            let (cx, cz) = (x * b.cos(), -x * b.sin());
            let (cy, cz) = (y * a.cos() - cz * a.sin(), y * a.sin() + cz * a.cos());
            let (cx, cy, cz) = (cx - 0.1, cy - 0.08, cz + 0.6);
            let off = 0.1 * f64::from(k * 7 + view).sin();
            let _ = write!(
                rows,
                "\n{x},{y},0,{},{},{view}",
                900.0 * cx / cz + 640.0 + off,
                900.0 * cy / cz + 360.0 - off
            );
        }
    }
    rows
}

struct Checked {
    scratch: Scratch,
    schemas: Schemas,
    seen: Vec<String>,
}

impl Checked {
    /// Runs a command with `--json` and holds what it prints to a schema; returns the document.
    fn is(&mut self, name: &str, args: &[&str]) -> Value {
        let said = self.scratch.trueup(&[args, &["--json"]].concat());
        let document: Value = serde_json::from_str(&said.out)
            .unwrap_or_else(|error| panic!("{args:?}: {error}: {}{}", said.out, said.err));
        self.schemas.holds(name, &document);
        self.seen.push(name.to_owned());
        document
    }
}

#[test]
fn what_is_printed_is_as_its_schema_says() {
    let scratch = Scratch::new("cli-schema");
    let mut checked = Checked { scratch, schemas: Schemas::read(), seen: Vec::new() };
    let put = |name: &str, text: &str| fs::write(checked.scratch.path(name), text).unwrap();
    put("bad.task", "task mine(o: Container) {\n    pick(jra)\n    tilt(o, 5)\n}\n");
    put("pairs.csv", &pairs());
    put("offsets.csv", &offsets());
    put("points.csv", &points());
    put("words.txt", "go\n");
    let q = "[0,0.26,3.14,-2.27,0,0.96,1.57]";
    put("way.json", &format!("{{\"start\": {q}, \"goals\": [{}]}}", q.replace("[0,", "[0.5,")));
    put(
        "blocked.json",
        &format!(
            "{{\"start\": {q}, \"goals\": [{q}], \"obstacles\": [{{\"shape\": \"sphere\", \"pose\": \
             {{\"xyz_m\": [0.4, 0, 0.4], \"quat_wxyz\": [1, 0, 0, 0]}}, \"size_m\": [0.3]}}]}}"
        ),
    );
    texts(&mut checked);
    robots(&mut checked);
    runs(&mut checked);
    let seen =
        |name: &&str| checked.seen.iter().any(|seen| seen == name) || ELSEWHERE.contains(name);
    let unseen: Vec<&str> = checked.schemas.names().filter(|name| !seen(name)).collect();
    assert!(unseen.is_empty(), "no document was held to {unseen:?}");
}

fn texts(checked: &mut Checked) {
    checked.is("new", &["new", "task", "tidy"]);
    checked.is("check", &["check", "bad.task"]);
    checked.is("check", &["check", "tidy.task"]);
    checked.is("error", &["check", "gone.task"]);
    checked.is("error", &["--nonsense"]);
    checked.is("fmt", &["fmt", "--check", "tidy.task"]);
    checked.is("test", &["test", "tidy.task", "--list"]);
    checked.is("explain", &["explain"]);
    checked.is("explain", &["explain", "task::unit"]);
    checked.is("explain", &["explain", "run::unknown"]);
    checked.is("help", &["help"]);
    checked.is("help", &["help", "gap"]);
    checked.is("doc", &["doc"]);
    checked.is("doc", &["doc", "pour"]);
    for sentence in ["pour the transparent jar into the blue cup", "pour it", "dance"] {
        checked.is("say", &["say", sentence]);
    }
    checked.is("graph", &["graph", "pour(jar, cup)"]);
    checked.is("completions", &["completions", "bash"]);
    checked.is("doctor", &["doctor"]);
    checked.is("marks", &["marks"]);
    checked.is("lab-hide", &["lab", "hide"]);
    checked.is("lab-reveal", &["lab", "reveal", "hidden.toml"]);
    checked.is("lab-reveal", &["lab", "reveal", "hidden.toml", "--guess", "lip_dribble(jar)"]);
}

fn robots(checked: &mut Checked) {
    let root = env!("CARGO_MANIFEST_DIR");
    let q = "0,0.26,3.14,-2.27,0,0.96,1.57";
    checked.is("robot-fk", &["robot", "fk", "--q", q]);
    checked.is("robot-ik", &["robot", "ik", "--pose", "0.5,0,0.3,0.5,0.5,0.5,0.5"]);
    checked.is("robot-ik", &["robot", "ik", "--pose", "5,0,0.3,0.5,0.5,0.5,0.5"]);
    checked.is("robot-dynamics", &["robot", "dynamics", "--q", q]);
    checked.is("robot-plan", &["robot", "plan", "--problem", "way.json"]);
    checked.is("robot-plan", &["robot", "plan", "--problem", "blocked.json"]);
    // An arm without shapes and masses.
    let bare = r#"<robot name="r"><link name="base"/><link name="arm"/>
        <joint name="a" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
        <limit lower="-2" upper="2" effort="50" velocity="2"/></joint></robot>"#;
    fs::write(checked.scratch.path("bare.urdf"), bare).unwrap();
    fs::write(checked.scratch.path("turn.json"), r#"{"start": [0], "goals": [[1]]}"#).unwrap();
    fs::write(checked.scratch.path("far.json"), r#"{"start": [0], "goals": [[3]]}"#).unwrap();
    for problem in ["turn.json", "far.json"] {
        let plan = ["robot", "plan", "--robot-file", "bare.urdf", "--problem", problem];
        assert!(checked.is("robot-plan", &plan)["left_out"].is_array());
    }
    let dynamics = ["robot", "dynamics", "--robot-file", "bare.urdf", "--q", "0.3"];
    assert!(checked.is("robot-dynamics", &dynamics)["notes"].is_array());
    checked
        .is("robot-check", &["robot", "check", &format!("{root}/stdlib/robots/panda/panda.urdf")]);
    checked.is("align-map", &["align", "map", "pairs.csv", "--model", "auto"]);
    checked.is("align-offset", &["align", "offset", "offsets.csv", "--at", "0.5,0,0.3"]);
    checked.is("align-intrinsics", &["align", "intrinsics", "points.csv"]);
    for pair in ["coulomb", "control"] {
        let file = |which: &str| format!("{root}/tests/discovery/recordings/{pair}_{which}.csv");
        checked.is("gap", &["gap", &file("a"), &file("b")]);
    }
}

fn runs(checked: &mut Checked) {
    checked.is("runs", &["runs"]);
    let run = checked.is("run", &["-c", "pick(jar)"]);
    let kept = checked.scratch.path(run["run_dir"].as_str().unwrap()).join("run.json");
    let kept: Value = serde_json::from_str(&fs::read_to_string(kept).unwrap()).unwrap();
    checked.schemas.holds("run", &kept);
    checked.is("error", &["-c", "pick(jra)"]);
    checked.is("question", &["-c", "visible(jar)"]);
    checked.is("question", &["-c", "filled(jar)"]);
    checked.is("run", &["-c", "home()", "--robot", "twin"]);
    checked.is("runs", &["runs"]);
    checked.is("runs", &["runs", "show", "1"]);
    checked.is("runs", &["runs", "diff", "1", "2"]);
    checked.is("replay", &["replay", "1"]);
    checked.is("replay", &["replay", "1", "--step", "2"]);
    checked.is("report", &["report", "1"]);
    checked.is("export", &["export", "1", "--csv", "run.csv"]);
    checked.is("learn", &["learn", "runs"]);
    checked.is("learn", &["learn", "runs", "--demonstrations"]);
    let picture = format!("{}/frames/01-before-real.jpg", run["run_dir"].as_str().unwrap());
    checked.is("camera-see", &["camera", "see", &picture, "--out", "seen"]);
    checked.is("camera-segment", &["camera", "segment", &picture]);
    checked.is("scene-from", &["scene", "from", &picture, "--out", "found.task"]);
    let lines =
        checked.scratch.trueup(&["teach", "pick(jar)", "--script", "words.txt", "--json"]).out;
    for line in lines.lines() {
        checked.schemas.holds("teach", &serde_json::from_str(line).unwrap());
        checked.seen.push("teach".to_owned());
    }
}
