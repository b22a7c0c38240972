//! `trueup align map | intrinsics | offset` as people read them: what was fitted, how sure that is, and no wall of numbers.

use std::fmt::Write as _;

use crate::program::Scratch;

/// Number `i` of a fixed sequence that looks like noise, -1 to 1.
fn noise(i: u32) -> f64 {
    (f64::from(i) * 12.9898).sin() * 2.0 - f64::from(i % 2) + 0.5
}

#[test]
fn a_map_is_told_with_what_it_rests_on_and_how_far_it_is_known() {
    let scratch = Scratch::new("align-map");
    let mut table = "u_x[px],u_y[px],v_x[px],v_y[px]\n".to_owned();
    for i in 0..24_u32 {
        let (x, y) = (f64::from(i % 6) * 200.0, f64::from(i / 6) * 180.0);
        let wrong = if i == 7 { 90.0 } else { 0.0 };
        let (u, v) =
            (1.1 * x + 20.0 + 0.2 * noise(i) + wrong, 1.05 * y - 12.0 + 0.2 * noise(i + 50));
        let _ = writeln!(table, "{u},{v},{x},{y}");
    }
    scratch.file("pairs.csv", table);
    let said = scratch.trueup(&["align", "map", "pairs.csv", "--model", "auto"]);
    assert_eq!((said.code, said.err.as_str()), (0, ""), "{said:?}");
    for part in [
        "affine map, real from twin",
        "23 of 24 pairs",
        "counted from 0: 7",
        "known over",
        "evidence",
    ] {
        assert!(said.out.contains(part), "{part}: {}", said.out);
    }
    assert!(!said.out.contains("covariance"), "{}", said.out);
    assert!(said.out.lines().all(|line| line.chars().count() <= 110), "{}", said.out);
}

#[test]
fn an_offset_is_told_in_millimetres_with_where_it_is_known() {
    let scratch = Scratch::new("align-offset");
    let mut table = "xs[m],ys[m],zs[m],xr[m],yr[m],zr[m]\n".to_owned();
    for i in 0..12_u32 {
        let (x, y, z) = (
            0.4 + 0.05 * f64::from(i % 4),
            -0.1 + 0.1 * f64::from(i / 4),
            0.1 + 0.03 * f64::from(i % 3),
        );
        let off = |k: u32| 0.0002 * noise(3 * i + k);
        let _ = writeln!(
            table,
            "{},{},{},{x},{y},{z}",
            x + 0.005 + off(0),
            y + off(1),
            z - 0.003 + off(2)
        );
    }
    scratch.file("pairs.csv", table);
    let said = scratch.trueup(&["align", "offset", "pairs.csv", "--at", "0.5,0,0.3"]);
    assert_eq!((said.code, said.err.as_str()), (0, ""), "{said:?}");
    for part in [
        "translation offset, said from real",
        "12 pairs",
        "0.005",
        "mm",
        "at (0.500, 0.000, 0.300) m",
    ] {
        assert!(said.out.contains(part), "{part}: {}", said.out);
    }
}

#[test]
fn intrinsics_are_told_number_by_number_with_their_deviations() {
    let scratch = Scratch::new("align-intrinsics");
    // A camera of 900 px that looks at a board which is turned by 0.4 rad in four ways.
    let mut table = "x[m],y[m],z[m],u[px],v[px],view\n".to_owned();
    let mut moved = table.clone();
    for i in 0..4 * 54_u32 {
        let (way, k) = (f64::from(i / 54) * std::f64::consts::FRAC_PI_2 + 0.3, i % 54);
        let (bx, by) = (0.04 * f64::from(k % 9) - 0.16, 0.04 * f64::from(k / 9) - 0.10);
        // About the axis (cos, sin, 0), by Rodrigues' formula.
        let (axis, turn) = ([way.cos(), way.sin()], 0.4_f64);
        let (along, across) = (axis[0] * bx + axis[1] * by, axis[0] * by - axis[1] * bx);
        let x = bx * turn.cos() + axis[0] * along * (1.0 - turn.cos());
        let y = by * turn.cos() + axis[1] * along * (1.0 - turn.cos());
        let z = 0.7 + across * turn.sin();
        let (u, v) =
            (640.0 + 900.0 * x / z + 0.1 * noise(i), 360.0 + 900.0 * y / z + 0.1 * noise(i + 99));
        let _ = writeln!(table, "{bx},{by},0,{u},{v},{}", i / 54);
        let u = if i == 60 { u + 30.0 } else { u };
        let _ = writeln!(moved, "{bx},{by},0,{u},{v},{}", i / 54);
    }
    scratch.file("points.csv", table);
    let args = ["align", "intrinsics", "points.csv", "--distortion", "none"];
    let said = scratch.trueup(&args);
    assert_eq!((said.code, said.err.as_str()), (0, ""), "{said:?}");
    let line = said.out.lines().find(|line| line.trim_start().starts_with("fx ")).unwrap();
    let fx: f64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
    assert!((fx - 900.0).abs() < 5.0 && line.contains(" px ± "), "{line}");
    assert!(said.out.contains("camera from 216 points in 4 views"), "{}", said.out);
    assert!(!said.out.contains("left out"), "{}", said.out);
    scratch.file("moved.csv", moved);
    let left = scratch
        .trueup(&["align", "intrinsics", "moved.csv", "--distortion", "none", "--json"])
        .json();
    assert_eq!(
        (&left["outliers"][0]["view"], &left["outliers"][0]["point"]),
        (&"1".into(), &6.into()),
        "{left}"
    );
    assert!((left["fx_px"].as_f64().unwrap() - fx).abs() < 1.0, "{left}");
    assert!(said.out.contains("view 3") && !said.out.contains("covariance"), "{}", said.out);
}

/// All were told to spread their points.
#[test]
fn what_helps_is_that_of_the_cause() {
    let scratch = Scratch::new("align-help");
    let mut solid = "x[m],y[m],z[m],u[px],v[px],view\n".to_owned();
    let mut flat = solid.clone();
    let mut line = "u_x[px],u_y[px],v_x[px],v_y[px]\n".to_owned();
    for i in 0..12_u32 {
        let (x, y) = (f64::from(i % 4), f64::from(i / 4));
        let (u, v) = (600.0 + 50.0 * x + 3.0 * y, 300.0 + 48.0 * y - 2.0 * x);
        let _ = writeln!(solid, "{},{},{},{u},{v},a", 0.1 * x, 0.1 * y, 0.02 * noise(i));
        let _ = writeln!(flat, "{},{},0,{u},{v},a", 0.1 * x, 0.1 * y);
        let _ = writeln!(line, "{u},{u},{},{}", x + 4.0 * y, x + 4.0 * y);
    }
    for (file, table, what, help) in [
        ("solid.csv", solid, "intrinsics", "say where each view was seen from"),
        ("flat.csv", flat, "intrinsics", "`--image 1280x720`"),
        ("line.csv", line, "map", "spread the points"),
    ] {
        scratch.file(file, table);
        let said = scratch.trueup(&["align", what, file]);
        assert_eq!(said.code, 2, "{said:?}");
        assert!(said.err.contains("help: ") && said.err.contains(help), "{file}: {}", said.err);
    }
}
