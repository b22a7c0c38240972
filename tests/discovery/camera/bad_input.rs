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
