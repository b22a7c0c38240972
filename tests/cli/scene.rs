//! `trueup scene from PHOTO`: what stands on a table is measured and written as a scene that runs.

use std::fs;
use std::path::Path;

use crate::program::Scratch;

/// Takes a photograph of a table of `tests/tables/` in the laboratory of a seed, under a name in the folder.
fn photograph(scratch: &Scratch, table: &str, seed: &str) -> String {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/tables/{table}.task"));
    let scene = scene.to_str().unwrap();
    let runs = format!("runs-{table}");
    let args = ["-c", "home()", "--scene", scene, "--seed", seed, "--record", &runs, "--json"];
    let folder = scratch.trueup(&args).json()["run_dir"].as_str().unwrap().to_owned();
    let frames = fs::read_dir(scratch.path(&folder).join("frames")).unwrap();
    let mut frames: Vec<_> = frames.map(|frame| frame.unwrap().path()).collect();
    frames.retain(|path| path.to_string_lossy().ends_with("after-real.png"));
    frames.pop().unwrap().to_str().unwrap().to_owned()
}

#[test]
fn boxes_and_cans_that_nobody_declared_are_measured_to_two_millimetres() {
    let scratch = Scratch::new("cli-scene");
    for (table, sizes) in [
        ("boxes", [["60", "110", "70"], ["70", "70", "35"], ["200", "160", "20"]].as_slice()),
        ("cans", [["33", "33", "110"], ["36", "36", "60"]].as_slice()),
    ] {
        let photo = photograph(&scratch, table, "4");
        let file = format!("{table}_seen.task");
        let said = scratch.trueup(&["scene", "from", &photo, "--out", &file, "--json"]);
        assert_eq!(said.code, 0, "{}", said.err);
        let answer = said.json();
        assert!(answer["declared"].as_array().unwrap().is_empty(), "{answer}");
        let measured = answer["measured"].as_array().unwrap();
        assert_eq!(measured.len(), sizes.len(), "{answer}");
        for wanted in sizes {
            let [a, b, height] = wanted.map(|mm| 1e-3 * mm.parse::<f64>().unwrap());
            let number = |value: &serde_json::Value| value.as_f64().unwrap_or(f64::NAN);
            let fits = |thing: &&serde_json::Value| {
                let shape = &thing["shape"];
                let [x, y, z] = if shape["cylinder"].is_object() {
                    let radius = number(&shape["cylinder"]["radius"]);
                    [radius, radius, number(&shape["cylinder"]["height"])]
                } else {
                    [0, 1, 2].map(|i| number(&shape["cuboid"]["size"][i]))
                };
                let level = [x.min(y) - a.min(b), x.max(y) - a.max(b), z - height];
                level.iter().all(|off| off.abs() < 2e-3)
            };
            assert_eq!(measured.iter().filter(fits).count(), 1, "{wanted:?} mm: {answer}");
        }
        // What was written is a scene, and what was measured is found again where it stands.
        assert_eq!(scratch.trueup(&["check", &file]).code, 0);
        let seen = scratch.trueup(&["camera", "see", &photo, "--scene", &file, "--json"]);
        assert_eq!(seen.code, 0, "{}", seen.out);
        // Nothing is overwritten.
        let again = scratch.trueup(&["scene", "from", &photo, "--out", &file, "--json"]);
        assert_eq!((again.code, again.error("code").as_str()), (2, "new::there"));
    }
    let said = scratch.trueup(&["scene", "from", "boxes_seen.task", "--out", "Not.task", "--json"]);
    assert_eq!((said.code, said.error("code").as_str()), (2, "new::name"));
}
