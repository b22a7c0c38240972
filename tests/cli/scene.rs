//! `trueup scene from PHOTO`: what stands on a table is measured and written as a scene that runs.

use std::fs;
use std::path::{Path, PathBuf};

use image::{Rgb, RgbImage};
use trueup::alignment::hand_eye::Mount;
use trueup::lab::{Lab, LabSettings};
use trueup::language::{Library, Source};
use trueup::motion::Robot;
use trueup::scene;
use trueup::world::{Intrinsics, Scene};

use crate::program::Scratch;
use crate::rig::{Rig, all_sides};

fn table(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/tables/{name}.task"))
}

fn scene_of_table(name: &str) -> Scene {
    let path = table(name);
    let mut library = Library::new();
    library.add(Source::new(path.display().to_string(), fs::read_to_string(&path).unwrap()));
    let (item, source) = library.scenes().next().unwrap();
    scene::from_item(item, source).unwrap()
}

/// Takes a photograph of a table of `tests/tables/` in the laboratory of a seed, under a name in the folder.
fn photograph(scratch: &Scratch, table: &str, seed: &str) -> String {
    let scene = self::table(table);
    let scene = scene.to_str().unwrap();
    let runs = format!("runs-{table}");
    let args = ["-c", "home()", "--scene", scene, "--seed", seed, "--record", &runs, "--json"];
    let folder = scratch.trueup(&args).json()["run_dir"].as_str().unwrap().to_owned();
    let frames = fs::read_dir(scratch.path(&folder).join("frames")).unwrap();
    let mut frames: Vec<_> = frames.map(|frame| frame.unwrap().path()).collect();
    frames.retain(|path| path.to_string_lossy().ends_with("after-real.png"));
    frames.pop().unwrap().to_str().unwrap().to_owned()
}

/// Eight photographs of a printed board, one of the table, four commands: nobody tells the program what is inside the
/// camera, or what stands on the table.
#[test]
fn a_newcomer_s_path_from_a_printed_board_to_things_that_are_found() {
    let scratch = Scratch::new("cli-newcomer");
    let mut rig = Rig::new(Mount::Fixed, &all_sides(8));
    rig.intrinsics = Intrinsics::centred(905.0, 1280, 720);
    (rig.intrinsics.cx, rig.intrinsics.k1, rig.intrinsics.k2) = (628.0, -0.13, 0.04);
    fs::create_dir_all(scratch.path("photos")).unwrap();
    for i in 0..rig.sights.len() {
        rig.picture(i).save(scratch.path(&format!("photos/{i}.png"))).unwrap();
    }
    let photos: Vec<String> = (0..8).map(|i| format!("photos/{i}.png")).collect();
    let mut calibrate = vec!["camera", "calibrate", "--board", "chessboard:9x6:20mm"];
    calibrate.extend(["--write", "camera.json", "--json"]);
    calibrate.extend(photos.iter().map(String::as_str));
    let answer = scratch.trueup(&calibrate).json();
    assert!((answer["fx_px"].as_f64().unwrap() - 905.0).abs() < 3.0, "{answer}");

    // The table through the same lens; where the camera stands is known to some centimetres.
    let mut scene = scene_of_table("boxes");
    scene.camera.intrinsics = rig.intrinsics;
    scene.calibration = Some("as it is".into());
    let mut lab = Lab::new(&Robot::gen3(), &scene, LabSettings::default(), 4).unwrap();
    lab.photo().save(scratch.path("table.png")).unwrap();

    let from = ["scene", "from", "table.png", "--calibration", "camera.json", "--out", "mine.task"];
    let said = scratch.trueup(&[&from[..], &["--json"]].concat());
    assert_eq!(said.code, 0, "{said:?}");
    assert_eq!(said.json()["measured"].as_array().unwrap().len(), 3, "{said:?}");
    let text = fs::read_to_string(scratch.path("mine.task")).unwrap();
    assert!(text.contains("camera overhead { calibration \"camera.json\" at"), "{text}");
    assert_eq!(scratch.trueup(&["check", "mine.task"]).code, 0);
    let seen = scratch.trueup(&["camera", "see", "table.png", "--scene", "mine.task", "--json"]);
    assert_eq!(seen.code, 0, "{seen:?}");
    // The lens is kept as calibrated, and the dots say where the camera stands: no warning, no guess.
    assert!(!seen.err.contains("warning"), "{seen:?}");
}

/// It was written as if the camera were known, with exit code 0.
#[test]
fn a_scene_through_a_camera_that_is_guessed_says_so() {
    let scratch = Scratch::new("cli-scene-guess");
    let image = RgbImage::from_pixel(1280, 720, Rgb([200, 176, 144]));
    image.save(scratch.path("bare.png")).unwrap();
    let said = scratch.trueup(&["scene", "from", "bare.png", "--out", "bare.task"]);
    assert_eq!(said.code, 1, "{said:?}");
    assert!(said.err.contains("are needed: 0 dark dots were seen"), "{said:?}");
    let text = fs::read_to_string(scratch.path("bare.task")).unwrap();
    assert!(text.contains("where it stands is a guess"), "{text}");
    assert_eq!(scratch.trueup(&["check", "bare.task"]).code, 0);
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
        // One view of the table leaves the focal length open by more than its residual says.
        let lens = said.err.lines().find(|line| line.contains("regression 2: focal"));
        assert!(lens.is_some_and(|line| line.matches(" ± ").count() >= 3), "{}", said.err);
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
