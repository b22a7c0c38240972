//! `trueup camera calibrate` on photographs, and the file it writes, read by the others.

use std::fs;

use image::{Rgb, RgbImage};

use crate::absent::public;
use crate::program::Scratch;

/// A board seen face-on, as a scanner would.
fn face_on() -> RgbImage {
    RgbImage::from_fn(640, 480, |u, v| {
        let (x, y) = ((i64::from(u) - 120).div_euclid(40), (i64::from(v) - 100).div_euclid(40));
        let is_dark = (0..10).contains(&x) && (0..7).contains(&y) && (x + y) % 2 == 0;
        Rgb([if is_dark { 20 } else { 230 }; 3])
    })
}

#[test]
fn one_picture_that_is_face_on_is_refused_with_what_to_photograph() {
    let scratch = Scratch::new("calibrate-face-on");
    face_on().save(scratch.path("a.png")).unwrap();
    let args = ["camera", "calibrate", "a.png", "--board", "chessboard:9x6:25mm", "--json"];
    let said = scratch.trueup(&args);
    assert_eq!((said.code, said.error("code").as_str()), (2, "camera::views"), "{said:?}");
    assert!(said.error("help").contains("30 to 45 deg"), "{said:?}");
    let said = scratch.trueup(&["camera", "calibrate", "a.png", "--board", "chessboard:8x6:25mm"]);
    assert!(said.err.contains("a.png: found 9x6, asked for 8x6"), "{said:?}");
}

#[test]
fn one_picture_given_again_is_one_picture() {
    let scratch = Scratch::new("calibrate-again");
    for name in ["a.png", "b.png", "c.png"] {
        face_on().save(scratch.path(name)).unwrap();
    }
    let board = ["camera", "calibrate", "--board", "chessboard:9x6:25mm"];
    let said = scratch.trueup(&[&board[..], &["a.png", "b.png", "a.png", "--json"]].concat());
    assert_eq!((said.code, said.error("code").as_str()), (2, "camera::views"), "{said:?}");
    let one = scratch.trueup(&[&board[..], &["a.png", "--json"]].concat());
    let (said, one) = (said.error("message"), one.error("message"));
    assert!(said.starts_with(&one), "three of one are refused as one is: {said}");
    assert!(said.contains("b.png: the same picture as a.png"), "{said}");
}

#[test]
fn photographs_become_a_file_that_camera_see_reads() {
    let Some(dir) = public("opencv_chessboard") else { return };
    let scratch = Scratch::new("calibrate-photos");
    scratch.file("broken.png", "no picture");
    let mut names: Vec<String> = (1..=14)
        .filter(|i| *i != 10)
        .map(|i| dir.join(format!("left{i:02}.jpg")).display().to_string())
        .collect();
    names.push("broken.png".into());
    let mut args = vec!["camera", "calibrate", "--board", "chessboard:9x6:25mm"];
    args.extend(["--write", "camera.json", "--out", "seen", "--json"]);
    args.extend(names.iter().map(String::as_str));
    let answer = scratch.trueup(&args).document("camera-calibrate");
    assert!(answer["rms_px"].as_f64().unwrap() < 0.1954, "{answer}");
    assert!((answer["fx_px"].as_f64().unwrap() - 533.0).abs() < 1.0, "{answer}");
    assert!(answer["std"]["k1"].as_f64().unwrap() > 0.0);
    let pictures = answer["pictures"].as_array().unwrap();
    assert_eq!(pictures.iter().filter(|p| p["found"] == true).count(), 13);
    assert!(pictures[13]["reason"].as_str().unwrap().contains("cannot be read"), "{answer}");
    let drawn = fs::read_to_string(scratch.path("seen/corners.svg")).unwrap();
    assert_eq!(drawn.matches("<circle").count(), 13 * 54);

    // What was written is what was printed, and a camera for the others.
    let file: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(scratch.path("camera.json")).unwrap()).unwrap();
    assert_eq!(file, answer);
    RgbImage::from_pixel(640, 480, Rgb([120; 3])).save(scratch.path("table.png")).unwrap();
    let said = scratch.trueup(&["camera", "see", "table.png", "--calibration", "camera.json"]);
    assert_eq!(said.code, 1, "{said:?}");
    assert!(said.err.contains("the scene's guess of the camera is believed"), "{said:?}");

    args.retain(|arg| *arg != "--json");
    let said = scratch.trueup(&args);
    assert!(said.out.contains(" px ± "), "{said:?}");
    assert!(said.out.contains("camera from 13 of 14 pictures of 640 x 480 px"), "{said:?}");
}

/// A fisheye's file is read by what reads any other, and says what it is.
#[test]
fn a_fisheye_is_fitted_when_asked_for_and_its_file_is_read() {
    let Some(dir) = public("opencv_chessboard") else { return };
    let scratch = Scratch::new("calibrate-fisheye");
    let names: Vec<String> = [1, 2, 3, 5, 8, 12]
        .map(|i| dir.join(format!("left{i:02}.jpg")).display().to_string())
        .into();
    let mut args = vec!["camera", "calibrate", "--board", "chessboard:9x6:25mm", "--distortion"];
    args.extend(["fisheye-k1k2", "--write", "camera.json"]);
    args.extend(names.iter().map(String::as_str));
    let said = scratch.trueup(&args);
    assert!(said.out.contains("a fisheye: k1 to k4 bend the angle from the axis"), "{said:?}");
    assert!(said.out.contains("k4") && !said.out.contains("  p1"), "{said:?}");
    args.push("--json");
    let answer = scratch.trueup(&args).document("camera-calibrate");
    assert_eq!(answer["model"], "fisheye");
    assert_eq!(answer["camera"]["intrinsics"]["model"], "fisheye");
    assert_eq!(answer["std"]["k4"], 0.0);
    assert!(
        answer["std"]["k2"].as_f64().unwrap() > 0.0 && answer["rms_px"].as_f64().unwrap() < 0.3
    );
    RgbImage::from_pixel(640, 480, Rgb([120; 3])).save(scratch.path("table.png")).unwrap();
    let said = scratch.trueup(&["camera", "see", "table.png", "--calibration", "camera.json"]);
    assert_eq!(said.code, 1, "{said:?}");
    let mixed = r#"{"fx_px": 300, "cx_px": 320, "cy_px": 240, "p1": 0.1, "model": "fisheye"}"#;
    scratch.file("mixed.json", mixed);
    let said = scratch.trueup(&["camera", "see", "table.png", "--calibration", "mixed.json"]);
    assert_eq!(said.code, 2, "{said:?}");
    assert!(said.err.contains("p1 is no term of a fisheye lens"), "{said:?}");
}
