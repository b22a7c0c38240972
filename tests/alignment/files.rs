//! Tables in, answers out: what `INTERFACES.md` fixes.

use std::fmt::Write;

use serde_json::Value;
use trueup::alignment::files::{
    Error, read_map_pairs, read_offset_pairs, read_ranked_pairs, read_views,
};
use trueup::alignment::image_map::{self, fit_map};
use trueup::alignment::intrinsics::{self, calibrate};
use trueup::alignment::offset::{self, fit_offset};
use trueup::cli::answer::align::{IntrinsicsAnswer, MapAnswer, OffsetAnswer};

const PAIRS: &str = "u_x[px],u_y[px],v_x[px],v_y[px]
10,20,11,19
200,30,190,33
210,180,205,176
15,170,12,171
100,90,98,91
";

#[test]
fn columns_may_stand_in_any_order_and_lengths_in_any_unit() {
    let a = read_map_pairs(PAIRS).unwrap();
    let turned = "\u{feff}v_y[px], note, u_y[px],v_x[px],u_x[px]\n19,first,20,11,10\n";
    assert_eq!(read_map_pairs(turned).unwrap(), a[..1]);
    let offsets = "xs[mm],ys[cm],zs[in],xr[m],yr[m],zr[m]\n100,10,10,0.1,0.1,0.25\n";
    let pair = read_offset_pairs(offsets).unwrap()[0];
    assert!((pair.said - nalgebra::Vector3::new(0.1, 0.1, 0.254)).amax() < 1e-15);
}

#[test]
fn views_keep_their_order_and_take_their_extrinsics() {
    let points = "x[m],y[m],z[m],u[px],v[px],view\n0,0,0,1,2,b\n0,1,0,3,4,a\n1,0,0,5,6,b\n";
    let views = read_views(points, None).unwrap();
    assert_eq!(views.iter().map(|v| v.name.as_str()).collect::<Vec<_>>(), ["b", "a"]);
    assert_eq!((views[0].points.len(), views[0].world_from_camera), (2, None));
    let pose = r#"{"xyz_m": [0, 0, 1], "quat_wxyz": [0, 1, 0, 0]}"#;
    for file in [
        format!(r#"{{"a": {pose}, "b": {pose}}}"#),
        format!(r#"{{"a": {{"world_from_camera": {pose}}}, "b": {pose}}}"#),
    ] {
        let views = read_views(points, Some(&file)).unwrap();
        let pose = views[1].world_from_camera.unwrap();
        assert!((pose.origin().z - 1.0).abs() < 1e-15 && (pose.axis(2).z + 1.0).abs() < 1e-15);
    }
    let missing = read_views(points, Some(&format!(r#"{{"b": {pose}}}"#)));
    assert!(
        matches!(missing, Err(Error::MissingView { ref view, .. }) if view == "a"),
        "{missing:?}"
    );
    assert!(matches!(read_views(points, Some("[1]")), Err(Error::Extrinsics { .. })));
    let alone = read_views("x[m],y[m],z[m],u[px],v[px]\n0,0,0,1,2\n", None).unwrap();
    assert_eq!((alone.len(), alone[0].name.as_str()), (1, "1"));
}

#[test]
fn mistakes_are_told_with_their_place() {
    let said = |text: &str| read_map_pairs(text).unwrap_err().to_string();
    assert_eq!(
        said("u_x[px],u_y[px],v_x[px]\n1,2,3\n"),
        "no column `v_y`; the header has `u_x[px]`, `u_y[px]`, `v_x[px]`; expected \
         `u_x[px],u_y[px],v_x[px],v_y[px]`"
    );
    assert_eq!(
        said("u_x[px],u_y[mm],v_x[px],v_y[px]\n1,2,3,4\n"),
        "column `u_y` is in `mm`; write `u_y[px]`"
    );
    assert_eq!(
        said("u_x[px],u_y,v_x[px],v_y[px]\n1,2,3,4\n"),
        "column `u_y` has no unit; write `u_y[px]`"
    );
    assert_eq!(
        said("u_x[px],u_y[px],v_x[px],v_y[px]\n1,2,3,4\n1,2,,4\n"),
        "row 2, column `v_x`: `` is not a finite number"
    );
    assert_eq!(
        said("u_x[px],u_y[px],v_x[px],v_y[px]\n1,nan,3,4\n"),
        "row 1, column `u_y`: `nan` is not a finite number"
    );
    assert!(said("u_x[px],u_y[px],v_x[px],v_y[px]\n1,2,3\n").starts_with("row 1: "));
    assert!(said("u_x[px],u_y[px],v_x[px],v_y[px],u_x[px]\n").contains("twice"));
    assert!(said("").starts_with("the table is empty"));
    assert!(said("u_x[px],u_y[px],v_x[px],v_y[px]\n").starts_with("the table is empty"));
}

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

fn has(value: &Value, wanted: &[&str]) {
    for key in wanted {
        assert!(keys(value).contains(key), "no `{key}` in {:?}", keys(value));
    }
}

#[test]
fn answers_have_the_keys_that_others_rely_on() {
    let pairs = read_map_pairs(PAIRS).unwrap();
    let fit =
        fit_map(&pairs, image_map::Model::Projective, &image_map::Options::default()).unwrap();
    let map = serde_json::to_value(MapAnswer::from(&fit)).unwrap();
    has(&map, &["model", "M", "rms_px", "mse_px", "std_px", "outliers", "leave_one_out_px"]);
    has(&map, &["covariance", "compared"]);
    has(&map["compared"][0], &["model", "dof", "mse_px", "evidence"]);
    assert_eq!(map["model"], "projective");
    // Rows of rows: the shift of u is at the end of the first.
    assert!((map["M"][0][2].as_f64().unwrap() - fit.m[(0, 2)]).abs() < 1e-12);
    assert!((map["M"][2][2].as_f64().unwrap() - 1.0).abs() < 1e-12);
    assert_eq!(map["covariance"].as_array().unwrap().len(), 8);

    let mut table = String::from("xs[m],ys[m],zs[m],xr[m],yr[m],zr[m]\n");
    for i in 0..8 {
        let (x, y, z) =
            (0.1 * f64::from(i % 2), 0.1 * f64::from(i / 2 % 2), 0.1 * f64::from(i / 4));
        writeln!(table, "{},{y},{z},{x},{y},{z}", x + 0.02).unwrap();
    }
    let pairs = read_offset_pairs(&table).unwrap();
    let fit = fit_offset(&pairs, offset::Model::Rigid, &offset::Options::default()).unwrap();
    let offset = serde_json::to_value(OffsetAnswer::from(&fit)).unwrap();
    has(&offset, &["model", "D", "rms_m", "outliers", "compared"]);
    assert!((offset["D"][0][3].as_f64().unwrap() - 0.02).abs() < 1e-9);

    let mut table = String::from("x[m],y[m],z[m],u[px],v[px],view\n");
    for i in 0..9 {
        let (x, y) = (0.1 * f64::from(i % 3), 0.1 * f64::from(i / 3));
        // A camera 1 m above, looking down, x to the right and y up the picture; f = 500, centre 320, 240.
        let (u, v) = (500.0 * x + 320.0, -500.0 * y + 240.0);
        writeln!(table, "{x},{y},0,{u},{v},top").unwrap();
    }
    let pose = r#"{"top": {"xyz_m": [0, 0, 1], "quat_wxyz": [0, 1, 0, 0]}}"#;
    let views = read_views(&table, Some(pose)).unwrap();
    let options = intrinsics::Options {
        distortion: intrinsics::Distortion::None,
        ..intrinsics::Options::default()
    };
    let fit = calibrate(&views, &options).unwrap();
    let answer = serde_json::to_value(IntrinsicsAnswer::from(&fit)).unwrap();
    has(&answer, &["fx_px", "fy_px", "cx_px", "cy_px", "skew_px", "k1", "k2", "std", "rms_px"]);
    has(&answer["views"][0], &["view", "camera_from_world"]);
    has(&answer["views"][0]["camera_from_world"], &["xyz_m", "quat_wxyz"]);
    assert!((answer["fx_px"].as_f64().unwrap() - 500.0).abs() < 1e-6);
    assert!((answer["cy_px"].as_f64().unwrap() - 240.0).abs() < 1e-6);
}

#[test]
fn a_column_of_scores_is_read_where_there_is_one() {
    let (pairs, scores) = read_ranked_pairs(PAIRS).unwrap();
    assert_eq!((pairs.len(), scores), (5, None));
    let ranked = "u_x[px],u_y[px],v_x[px],v_y[px],score\n1,2,3,4,0.5\n5,6,7,8,-2\n";
    let (pairs, scores) = read_ranked_pairs(ranked).unwrap();
    assert_eq!((pairs.len(), scores), (2, Some(vec![0.5, -2.0])));
    let wrong = ranked.replace("-2", "good");
    let cell = Error::Cell { row: 2, column: "score", text: "good".into() };
    assert_eq!(read_ranked_pairs(&wrong), Err(cell));
}
