//! What is wrong with points and cameras is told: what, where, what helps.

use std::fmt::Write as _;

use super::{LENS, Shot, Truth, asked, points, posed};

#[test]
fn mistakes_are_told_with_their_place() {
    let few = "x[m],y[m],z[m],u[px],v[px]\n0.5,0,0,1,2\n0.6,0,0,3,4\n".to_owned();
    let good = Truth::default().table_picture(Shot::with(1), true);
    let behind = format!(
        r#"{{{LENS}, "world_from_camera": {{"xyz_m": [0, 0, 2], "quat_wxyz": [1, 0, 0, 0]}}}}"#
    );
    let cases = [
        (few.clone(), posed(), "", "too few"),
        (good.clone(), "{}".into(), "", "nothing says what the camera is"),
        (good.clone(), behind, "", "behind the camera"),
        (good.clone(), posed(), "effect focal_error(camera) { fz_scale = 2 }", "no `fz_scale`"),
        (good.clone(), posed(), "effect image_delay(camera) { delay = 2 m }", "must be a time"),
        // Points off a plane, and no pose known.
        (good, format!("{{{LENS}}}"), "", ""),
    ];
    for (text, sidecar, known, says) in cases {
        let Err(error) = asked(&[text], &sidecar, known) else {
            assert!(says.is_empty(), "`{says}` was expected");
            continue;
        };
        assert!(error.what.contains(says), "{error}: {}", error.help);
        assert!(!error.place.is_empty() && !error.help.is_empty());
    }
    assert!(asked(&[], &posed(), "").is_err());
    assert!(points("p.csv", &few, "[]").is_err(), "a sidecar that is a list");
}

#[test]
fn a_point_at_two_places_at_once_is_told() {
    let mut text = String::from("x[m],y[m],z[m],u[px],v[px],t[s],point\n");
    for i in 0..20 {
        let t = f64::from(i % 10);
        writeln!(text, "{},0,0,{},300,{t},a", 0.3 + 0.02 * f64::from(i), 400 + i).unwrap();
    }
    let error = asked(&[text], &posed(), "").unwrap_err();
    assert!(error.what.contains("two places"), "{error}");
}

/// Pixels that were exchanged or mirrored were explained by formulas of thousands of px, and half a picture by a focal length of 0.5
/// and a centre 320 px off.
#[test]
fn pixels_that_say_something_else_are_told_by_name() {
    let truth = Truth { k: [-0.08, 0.0], ..Truth::default() };
    let good = truth.table_picture(Shot::with(3), true);
    let read = |how: &dyn Fn(f64, f64) -> (f64, f64)| {
        let mut lines = good.lines();
        let mut text = format!("{}\n", lines.next().unwrap());
        for line in lines {
            let cells: Vec<&str> = line.split(',').collect();
            let (u, v) = how(cells[3].parse().unwrap(), cells[4].parse().unwrap());
            writeln!(text, "{},{u},{v},{}", cells[..3].join(","), cells[5]).unwrap();
        }
        asked(&[text], &posed(), "")
    };
    let told = |how: &dyn Fn(f64, f64) -> (f64, f64), says: &str| {
        let error = read(how).unwrap_err();
        assert!(error.what.starts_with(says), "{error}");
        assert!(!error.help.is_empty());
    };
    told(&|u, v| (v, u), "u and v are exchanged");
    told(&|u, v| (1279.0 - u, v), "the picture is mirrored, left for right");
    told(&|u, v| (u, 719.0 - v), "the picture is mirrored, top for bottom");
    told(&|u, v| (1279.0 - u, 719.0 - v), "the picture is turned");
    told(&|u, v| (0.5 * u - 0.25, 0.5 * v - 0.25), "the pixels are of a picture 0.5 times");
    // As they are, and a camera that looks past by 40 px: no more than an effect.
    assert_eq!(super::names(&read(&|u, v| (u, v)).unwrap().finding), ["radial_distortion"]);
    assert!(read(&|u, v| (u + 40.0, v)).is_ok());
}
