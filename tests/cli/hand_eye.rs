//! `trueup align hand-eye` on pictures of a board: rendered ones with a planted camera, and photographs where they are here.

use std::fmt::Write as _;
use std::fs;

use serde_json::Value;
use trueup::alignment::boards::Target;
use trueup::alignment::boards::charuco::Charuco;
use trueup::alignment::boards::tags::Family;
use trueup::alignment::hand_eye::Mount;

use crate::absent::public;
use crate::program::Scratch;
use crate::rig::{Rig, all_sides};
use crate::sheet::{sheet, taken};

/// A folder with pictures `a1.png` to `aN.png` and the table of poses in mm and quaternions.
fn photographed(scratch: &Scratch, rig: &Rig) -> Vec<String> {
    fs::create_dir_all(scratch.path("photos")).unwrap();
    let mut rows = Vec::new();
    for (i, pose) in rig.said(9).iter().enumerate() {
        rig.picture(i).save(scratch.path(&format!("photos/a{}.png", i + 1))).unwrap();
        let (t, q) = (pose.translation.vector * 1e3, pose.rotation);
        rows.push(format!("{},{},{},{},{},{},{}", t.x, t.y, t.z, q.w, q.i, q.j, q.k));
    }
    rows
}

fn table(header: &str, rows: &[String]) -> String {
    let mut text = format!("{header}\n");
    for row in rows {
        let _ = writeln!(text, "{row}");
    }
    text
}

const MM: &str = "x[mm],y[mm],z[mm],qw,qx,qy,qz";

fn vector(value: &Value) -> [f64; 3] {
    serde_json::from_value(value.clone()).unwrap()
}

fn far(value: &Value, truth: nalgebra::Vector3<f64>) -> f64 {
    (nalgebra::Vector3::from(vector(&value["xyz_m"])) - truth).norm()
}

#[test]
fn rendered_pictures_of_a_camera_on_the_wrist() {
    let scratch = Scratch::new("hand-eye-wrist");
    let rig = Rig::new(Mount::Wrist, &all_sides(12));
    let rows = photographed(&scratch, &rig);
    scratch.file("poses.csv", table(MM, &rows));
    let args = ["align", "hand-eye", "poses.csv", "photos", "--board", "chessboard:9x6:20mm"];
    let answer = scratch.trueup(&[&args[..], &["--json", "--out", "camera.json"]].concat());
    let answer = answer.document("align-hand-eye");
    assert_eq!(answer["camera_on"], "wrist");
    let camera = &answer["flange_from_camera"];
    // The camera is calibrated from the same pictures, so its focal length is known to a pixel or so.
    assert!(far(camera, rig.camera.translation.vector) < 2e-3, "{answer:#}");
    let std = vector(&answer["flange_from_camera_std"]["xyz_m"]);
    assert!(std.iter().all(|s| (5e-5..2e-3).contains(s)), "{std:?}");
    assert!(answer["leave_one_out"]["median_m"].as_f64().unwrap() < 1.5e-3, "{answer:#}");
    assert_eq!(answer["square"]["is_wrong"], false, "{answer:#}");
    assert!(answer["picture_rms_px"].as_f64().unwrap() < 0.1, "{answer:#}");
    // What was written is what was printed, and a camera for the others.
    let written: Value =
        serde_json::from_str(&fs::read_to_string(scratch.path("camera.json")).unwrap()).unwrap();
    assert_eq!(written, answer);
    let again = scratch.trueup(&[&args[..], &["--calibration", "camera.json"]].concat());
    assert!(again.out.contains("camera on the wrist, from 12 of 12 pictures"), "{again:?}");
    assert!(again.out.contains("predicted by the others to"), "{again:?}");

    // The squares are said to be of another size; one row is wrong, one names no picture.
    let named = |i: usize, row: &String| format!("{row},a{}.png", i + 1);
    let mut rows: Vec<String> = rows.iter().enumerate().map(|(i, row)| named(i, row)).collect();
    rows[3] = format!("9{}", rows[3]);
    rows.push(named(40, &rows[0].rsplit_once(',').unwrap().0.to_owned()));
    scratch.file("named.csv", table(&format!("{MM},file"), &rows));
    let said = scratch.trueup(&[
        "align",
        "hand-eye",
        "named.csv",
        "photos",
        "--board",
        "chessboard:9x6:35mm",
        "--camera",
        "wrist",
    ]);
    assert_eq!(said.code, 1, "{said:?}");
    assert!(
        said.out.contains("the squares look like 20.")
            || said.out.contains("the squares look like 19.9"),
        "{said:?}"
    );
    assert!(
        said.out.contains("a41.png") && said.out.contains("row 13: no such picture is given"),
        "{said:?}"
    );
    assert!(said.out.contains("a4.png was left out"), "{said:?}");
    assert!(said.out.contains("from 11 of 13 pictures"), "{said:?}");
}

#[test]
fn rendered_pictures_of_a_fixed_camera_and_what_its_table_gets_wrong() {
    let scratch = Scratch::new("hand-eye-fixed");
    let rig = Rig::new(Mount::Fixed, &all_sides(8));
    let rows = photographed(&scratch, &rig);
    scratch.file("poses.csv", table(MM, &rows));
    let run = |file: &str, more: &[&str]| {
        let args = ["align", "hand-eye", file, "photos", "--board", "chessboard:9x6:20mm"];
        scratch.trueup(&[&args[..], more].concat())
    };
    let answer = run("poses.csv", &["--json", "--out", "camera.json"]).json();
    assert_eq!(answer["camera_on"], "fixed");
    assert!(far(&answer["base_from_camera"], rig.camera.translation.vector) < 5e-3, "{answer:#}");
    assert!(answer.get("world_from_camera").is_none());

    // With a scene, the place of the camera in the world goes with it, where others read it.
    scratch.file("camera.json", fs::read(scratch.path("camera.json")).unwrap());
    let kitchen = concat!(env!("CARGO_MANIFEST_DIR"), "/stdlib/scenes/kitchen.task");
    let placed = run("poses.csv", &["--json", "--scene", kitchen]).json();
    assert_eq!(placed["world_from_camera"]["xyz_m"], placed["base_from_camera"]["xyz_m"]);

    // In another unit than the header says.
    scratch.file("metres.csv", table("x[m],y[m],z[m],qw,qx,qy,qz", &rows));
    let said = run("metres.csv", &["--json"]);
    assert_eq!((said.code, said.error("code").as_str()), (2, "align::poses"), "{said:?}");
    assert!(said.error("help").contains("the numbers look like mm"), "{said:?}");

    // The real part is not where the header says; the camera is said to be on the wrist.
    scratch.file("last.csv", table("x[mm],y[mm],z[mm],qx,qy,qz,qw", &rows));
    let said = run("last.csv", &["--json", "--camera", "fixed"]);
    assert_eq!(said.error("code"), "align::poses", "{said:?}");
    assert!(said.error("help").contains("w, x, y, z"), "{said:?}");
    let said = run("poses.csv", &["--json", "--camera", "wrist"]);
    assert!(said.error("help").contains("flange_from_base"), "{said:?}");
    assert!(said.error("help").ends_with("or with `--camera fixed`"), "{said:?}");

    // The names stand in the reverse order of the poses.
    let named = |(i, row): (usize, &String)| format!("{row},a{}.png", i + 1);
    let reversed: Vec<String> = rows.iter().rev().enumerate().map(named).collect();
    scratch.file("reversed.csv", table(&format!("{MM},file"), &reversed));
    let said = run("reversed.csv", &["--json"]);
    assert_eq!(said.error("code"), "align::poses", "{said:?}");
    assert!(said.error("help").contains("in the reverse order of the pictures"), "{said:?}");

    // Turns in rad under a header in deg are too small to tell anything; so are those of a wrist that stood still.
    let row = |pose: &nalgebra::Isometry3<f64>, r: nalgebra::Vector3<f64>| {
        let t = pose.translation.vector * 1e3;
        format!("{},{},{},{},{},{}", t.x, t.y, t.z, r.x, r.y, r.z)
    };
    let header = "x[mm],y[mm],z[mm],rx[deg],ry[deg],rz[deg]";
    let said = rig.said(9);
    let turned: Vec<_> = said.iter().map(|pose| row(pose, pose.rotation.scaled_axis())).collect();
    scratch.file("turned.csv", table(header, &turned));
    let refused = run("turned.csv", &["--json"]);
    assert_eq!(refused.error("code"), "align::poses", "{refused:?}");
    assert!(refused.error("help").contains("its angles are in rad, not in deg"), "{refused:?}");
    let still: Vec<_> = said.iter().map(|pose| row(pose, nalgebra::Vector3::x())).collect();
    scratch.file("still.csv", table(header, &still));
    let refused = run("still.csv", &["--json"]);
    assert_eq!(refused.error("code"), "align::motions", "{refused:?}");

    // Fewer rows than pictures, and a table that cannot be read.
    scratch.file("short.csv", table(MM, &rows[..5]));
    let said = run("short.csv", &["--json"]);
    assert_eq!(said.error("code"), "align::pictures", "{said:?}");
    scratch.file("bad.csv", "x[mm],y[mm],z[mm]\n1,2,3\n");
    assert_eq!(run("bad.csv", &["--json"]).error("code"), "align::table");
    let said = scratch.trueup(&[
        "align",
        "hand-eye",
        "poses.csv",
        "nowhere",
        "--board",
        "chessboard:9x6:20mm",
        "--json",
    ]);
    assert_eq!(said.code, 2, "{said:?}");
}

/// A hand over a part of the board in each picture, as people hold boards; the size is said wrong at first.
#[test]
fn parts_of_a_board_with_tags_and_a_wrong_size() {
    let scratch = Scratch::new("hand-eye-charuco");
    let family = Family::named("4x4_50").unwrap();
    let sheet = sheet(&Target::Charuco(Charuco::new(7, 5, 0.03, 0.022, family).unwrap()));
    let rig = Rig::before(Mount::Fixed, &sheet, 10);
    fs::create_dir_all(scratch.path("photos")).unwrap();
    let mut rows = Vec::new();
    for (i, pose) in rig.said(9).iter().enumerate() {
        let mut picture = taken(&sheet, &rig.seen_by(i), i as u64);
        for (u, _, pixel) in picture.enumerate_pixels_mut() {
            if (u > 330) == (i % 2 == 0) {
                *pixel = image::Rgb([150, 110, 90]);
            }
        }
        picture.save(scratch.path(&format!("photos/a{}.png", i + 1))).unwrap();
        let (t, q) = (pose.translation.vector * 1e3, pose.rotation);
        rows.push(format!("{},{},{},{},{},{},{}", t.x, t.y, t.z, q.w, q.i, q.j, q.k));
    }
    scratch.file("poses.csv", table(MM, &rows));
    let camera = serde_json::json!({"camera": {"intrinsics": rig.intrinsics}});
    scratch.file("camera.json", camera.to_string());
    let run = |board: &str| {
        let args = ["align", "hand-eye", "poses.csv", "photos", "--calibration", "camera.json"];
        scratch.trueup(&[&args[..], &["--json", "--board", board]].concat())
    };
    let answer = run("charuco:7x5:30mm:22mm:4x4_50").document("align-hand-eye");
    assert_eq!(answer["camera_on"], "fixed");
    assert!(far(&answer["base_from_camera"], rig.camera.translation.vector) < 2e-3, "{answer:#}");
    let wrong = run("charuco:7x5:33mm:24.2mm:4x4_50");
    assert_eq!(wrong.code, 1, "{wrong:?}");
    let answer: Value = serde_json::from_str(&wrong.out).unwrap();
    assert_eq!(answer["square"]["of"], "squares");
    assert!((answer["square"]["measured_m"].as_f64().unwrap() - 0.03).abs() < 5e-4, "{answer:#}");
    // Another board altogether.
    let none = run("aprilgrid:6x6:88mm:0.3");
    assert_eq!(none.error("code"), "camera::board", "{none:?}");
}

/// Eight photographs from the wrist of a Franka arm, with `ViSP`. Their squares are said to be 23.6 mm; the sheet is A4, by which
/// they are 26.1 to 26.3 mm.
#[test]
fn photographs_whose_squares_are_not_what_was_said() {
    let Some(dir) = public("visp_hand_eye") else { return };
    let scratch = Scratch::new("hand-eye-visp");
    let (poses, photos) = (dir.join("poses.csv").display().to_string(), dir.display().to_string());
    let camera = dir.join("camera.json").display().to_string();
    let run = |board: &str| {
        let args = [
            "align",
            "hand-eye",
            &poses,
            &photos,
            "--calibration",
            &camera,
            "--json",
            "--board",
            board,
        ];
        scratch.trueup(&args)
    };
    let said = run("chessboard:9x6:23.6mm");
    assert_eq!(said.code, 1, "{said:?}");
    let answer: Value = serde_json::from_str(&said.out).unwrap();
    let square = answer["square"]["measured_m"].as_f64().unwrap();
    assert!((0.0258..0.0275).contains(&square), "{answer:#}");
    // Measured: 2.5 mm and 2.8 mm; OpenCV's best with the size that was said: 4.9 mm and 5.7 mm.
    assert!(answer["spread_m"].as_f64().unwrap() < 3.0e-3, "{answer:#}");
    assert!(answer["leave_one_out"]["median_m"].as_f64().unwrap() < 3.2e-3, "{answer:#}");
    let right = run("chessboard:9x6:26.2mm").json();
    assert_eq!(right["square"]["is_wrong"], false, "{right:#}");
    assert!(right["leave_one_out"]["rms_m"].as_f64().unwrap() < 3.6e-3, "{right:#}");
}
