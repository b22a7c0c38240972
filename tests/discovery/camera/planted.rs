//! One effect at a time, pairs, none, and what cannot be told.

use trueup::discovery::finding::{Finding, Verdict};

use super::{FOCAL, Shot, Truth, asked, assert_number, found, names, posed, unposed};

/// Two pictures of the table, the second held out.
fn of_table(truth: &Truth, tops: bool) -> Finding {
    let texts = [1, 2].map(|seed| truth.table_picture(Shot::with(seed), tops));
    found(&texts, &posed())
}

fn one(finding: &Finding, name: &str) {
    assert_eq!(finding.verdict, Verdict::Named, "{finding:#?}");
    assert_eq!(names(finding), [name], "{finding:#?}");
    assert!(finding.gap.shrink_heldout > 0.9, "{:?}", finding.gap);
    // It is read off some 70 numbers, which know it to a twelfth.
    assert!((finding.gap.after.heldout - 1.0).abs() < 0.25, "{:?}", finding.gap);
}

#[test]
fn nothing_is_found_where_nothing_was_planted() {
    let finding = of_table(&Truth::default(), true);
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{finding:#?}");
    assert!(finding.effects.is_empty() && finding.model.added.is_empty());
    assert!((finding.gap.before.heldout - 1.0).abs() < 0.1, "{:?}", finding.gap);
    assert!(finding.notes.iter().any(|note| note.contains("wrong matches")), "{:?}", finding.notes);
    let seen = |name: &str, parameter: &str| {
        let found = finding.smallest_visible.iter();
        found.clone().find(|v| v.name == name && v.parameter == parameter).unwrap().least
    };
    // σ √(needed) / √(Σ (∂u/∂k1)²) is of the order of 0.3 px · 4 / (800 px · 0.05 · √200).
    assert!((1e-4..1e-2).contains(&seen("radial_distortion", "k1")));
    assert!((1e-5..1e-2).contains(&seen("camera_shift", "pitch")));
    assert!((0.02..2.0).contains(&seen("principal_point_shift", "du")));
}

#[test]
fn a_barrel_lens_is_named_with_its_size() {
    let finding = of_table(&Truth { k: [-0.12, 0.0], ..Truth::default() }, true);
    one(&finding, "radial_distortion");
    assert_number(&finding.effects[0], "k1", 0, -0.12);
    assert!(finding.model.added[0].starts_with("effect radial_distortion(camera) { k1 = -0.1"));
    assert!(finding.places.iter().any(|place| place.concentrated_in.contains("r^3")));
}

#[test]
fn a_lens_of_two_numbers_gets_two() {
    let finding = of_table(&Truth { k: [-0.25, 0.15], ..Truth::default() }, true);
    one(&finding, "radial_distortion");
    assert_number(&finding.effects[0], "k1", 0, -0.25);
    assert_number(&finding.effects[0], "k2", 0, 0.15);
}

/// Of a lens of -0.08 and 0.04 `k1` alone was told, as -0.0730 ± 0.0007: ten times nearer than it is.
#[test]
fn what_a_second_number_would_change_is_in_the_doubt_of_the_first() {
    // Three standard deviations of k2, which move k1 by nine of its own.
    let truth = Truth { k: [-0.08, 0.004], ..Truth::default() };
    for seed in 1..=4 {
        let texts = [seed, seed + 50].map(|seed| truth.table_picture(Shot::with(seed), true));
        let finding = found(&texts, &posed());
        one(&finding, "radial_distortion");
        assert_number(&finding.effects[0], "k1", 0, -0.08);
    }
}

#[test]
fn a_decentred_lens_is_named() {
    let finding = of_table(&Truth { p: [0.003, -0.004], ..Truth::default() }, true);
    one(&finding, "tangential_distortion");
    assert_number(&finding.effects[0], "p1", 0, 0.003);
    assert_number(&finding.effects[0], "p2", 0, -0.004);
}

#[test]
fn a_wrong_focal_length_is_named() {
    let finding = of_table(&Truth { focal: [1.015, 1.015], ..Truth::default() }, true);
    one(&finding, "focal_error");
    assert_number(&finding.effects[0], "fx_scale", 0, 1.015);
    let finding = of_table(&Truth { focal: [1.02, 0.99], ..Truth::default() }, true);
    one(&finding, "focal_error");
    assert_number(&finding.effects[0], "fy_scale", 0, 0.99);
}

#[test]
fn a_shifted_centre_is_named() {
    let finding = of_table(&Truth { centre: [9.0, -6.0], ..Truth::default() }, true);
    one(&finding, "principal_point_shift");
    assert_number(&finding.effects[0], "du", 0, 9.0);
    assert_number(&finding.effects[0], "dv", 0, -6.0);
}

#[test]
fn a_camera_that_was_pushed_is_named() {
    let shift = [0.02, -0.01, 0.015, 0.01, -0.02, 0.03];
    let finding = of_table(&Truth { shift, ..Truth::default() }, true);
    one(&finding, "camera_shift");
    assert!(finding.model.added[0].starts_with("effect camera_shift(camera) { x = 0.0"));
    for (component, truth) in shift.into_iter().enumerate() {
        let parameter = if component < 3 { "xyz" } else { "rpy" };
        assert_number(&finding.effects[0], parameter, component % 3, truth);
    }
}

#[test]
fn a_tilted_table_is_named() {
    let truth = Truth { table: [0.02, -0.015, 0.006], ..Truth::default() };
    let finding = of_table(&truth, true);
    one(&finding, "table_tilt");
    assert_eq!(finding.effects[0].at, "table");
    assert_number(&finding.effects[0], "roll", 0, 0.02);
    assert_number(&finding.effects[0], "pitch", 0, -0.015);
    assert_number(&finding.effects[0], "height", 0, 0.006);
}

#[test]
fn an_old_picture_is_named() {
    let truth = Truth { delay: 0.06, ..Truth::default() };
    let finding = found(&[truth.film(Shot::with(3))], &posed());
    one(&finding, "image_delay");
    assert_number(&finding.effects[0], "delay", 0, 0.06);
    assert!(finding.places[0].concentrated_in.contains("speed"), "{:?}", finding.places);
}

#[test]
fn a_rolling_shutter_is_named() {
    let truth = Truth { row_time: 4e-5, ..Truth::default() };
    let finding = found(&[truth.film(Shot::with(4))], &posed());
    one(&finding, "rolling_shutter");
    assert_number(&finding.effects[0], "row_time", 0, 4e-5);
}

#[test]
fn a_lens_is_named_though_nobody_knows_where_the_camera_stood() {
    let truth = Truth { k: [-0.2, 0.0], ..Truth::default() };
    let finding = found(&[truth.board_pictures(Shot::with(5), 9, true)], &unposed());
    one(&finding, "radial_distortion");
    assert_number(&finding.effects[0], "k1", 0, -0.2);
    let truth = Truth { focal: [1.03, 1.03], ..Truth::default() };
    let finding = found(&[truth.board_pictures(Shot::with(6), 9, true)], &unposed());
    one(&finding, "focal_error");
    assert_number(&finding.effects[0], "fx_scale", 0, 1.03);
}

#[test]
fn pairs_are_both_named() {
    let lens = Truth { k: [-0.15, 0.0], centre: [7.0, 5.0], ..Truth::default() };
    assert_eq!(names(&of_table(&lens, true)), ["principal_point_shift", "radial_distortion"]);
    let pushed =
        Truth { k: [-0.15, 0.0], shift: [0.02, 0.0, 0.01, 0.0, 0.015, 0.02], ..Truth::default() };
    let finding = of_table(&pushed, true);
    assert_eq!(names(&finding), ["camera_shift", "radial_distortion"], "{finding:#?}");
    assert_eq!(finding.verdict, Verdict::Several);
    let late = Truth { delay: 0.05, focal: [1.02, 1.02], ..Truth::default() };
    let finding = found(&[late.film(Shot::with(7))], &posed());
    assert_eq!(names(&finding), ["focal_error", "image_delay"], "{finding:#?}");
}

#[test]
fn what_has_no_name_gets_a_formula() {
    let truth = Truth { strange: |x, y| (25.0 * x * x * y, 0.0), ..Truth::default() };
    let finding = of_table(&truth, true);
    assert_eq!(finding.verdict, Verdict::Unknown, "{finding:#?}");
    assert!(finding.effects[0].equation.contains("x^2*y"), "{}", finding.effects[0].equation);
    assert_number(&finding.effects[0], "coefficient", 0, 25.0);
    assert!(finding.model.added[0].starts_with("// unknown at camera: u += "));
}

/// A bulge of 5 px in one spot was four effects: a focal length ten times too long at the end of its range, beside a formula that
/// cancelled it and was not written, so that the model got a thousand times worse.
#[test]
fn a_bulge_in_one_spot_has_no_name() {
    let bulge = |x: f64, y: f64| {
        let square = (x + 0.17).powi(2) + (y + 0.01).powi(2);
        (5.0 * (-square / 0.15_f64.powi(2)).exp(), 0.0)
    };
    let finding = of_table(&Truth { strange: bulge, ..Truth::default() }, true);
    assert_eq!(finding.verdict, Verdict::Unknown, "{finding:#?}");
    assert_eq!(names(&finding), ["unknown"], "{finding:#?}");
    let is_comment = |line: &String| line.starts_with("// unknown at camera");
    assert!(finding.model.added.iter().all(is_comment), "{:?}", finding.model.added);
}

#[test]
fn a_wavy_picture_has_no_name() {
    let truth = Truth { strange: |_, y| (0.0, 1.5 * (16.0 * y).sin()), ..Truth::default() };
    let finding = of_table(&truth, true);
    assert_eq!(finding.verdict, Verdict::Unknown, "{finding:#?}");
    assert_eq!(names(&finding), ["unknown"], "{finding:#?}");
}

/// A picture that is turned over left to right and pressed together is no focal length, however short.
#[test]
fn a_number_at_the_end_of_its_range_is_not_named() {
    let truth = Truth { strange: |x, _| (-1.3 * FOCAL * x, 0.0), ..Truth::default() };
    let finding = of_table(&truth, true);
    assert!(!names(&finding).contains(&"focal_error"), "{finding:#?}");
}

/// With marks on the table alone, a table too low and a camera too high are the same picture.
#[test]
fn a_lower_table_and_a_higher_camera_are_a_doubt() {
    let truth = Truth { table: [0.0, 0.0, -0.01], ..Truth::default() };
    let texts = [1, 2].map(|seed| truth.table_picture(Shot::with(seed), false));
    let investigation = asked(&texts, &posed(), "").unwrap();
    let finding = &investigation.finding;
    assert_eq!(finding.verdict, Verdict::Ambiguous, "{finding:#?}");
    assert_eq!(names(finding), ["camera_shift", "table_tilt"]);
    assert!(finding.effects.iter().all(|effect| effect.indistinguishable));
    assert!(finding.model.added.is_empty(), "a doubt is not written into the model");
    let why = &finding.next_experiment.as_ref().unwrap().why;
    assert!(why.contains("flat target"), "{why}");
    let table = investigation.experiment.as_ref().unwrap();
    assert!(table.lines().count() > 2 && table.starts_with("pose,x[m]"), "{table}");
    // The picture proposed, points off the table, settles it.
    let finding = of_table(&truth, true);
    assert_eq!((finding.verdict, names(&finding)), (Verdict::Named, vec!["table_tilt"]));
}

/// A flat target square to the camera: nearer, or a longer lens?
#[test]
fn focal_length_and_distance_are_a_doubt_on_a_flat_target_square_to_the_camera() {
    let above = super::looking(
        nalgebra::Vector3::new(0.5, 0.0, 1.0),
        nalgebra::Vector3::new(0.5, 0.0, 0.0),
    );
    let q = above.rotation.quaternion();
    let sidecar = format!(
        r#"{{{}, "world_from_camera": {{"xyz_m": [0.5, 0, 1], "quat_wxyz": [{}, {}, {}, {}]}}}}"#,
        super::LENS,
        q.w,
        q.i,
        q.j,
        q.k
    );
    let truth = Truth { focal: [1.01, 1.01], ..Truth::default() };
    let shot = Shot { noise: 0.2, wrong: 0.0, seed: 8 };
    let mut random = rand::SeedableRng::seed_from_u64(8);
    let mut text = String::from("x[m],y[m],z[m],u[px],v[px]\n");
    for (i, j) in (0..10).flat_map(|i| (0..10).map(move |j| (i, j))) {
        let at = nalgebra::Vector3::new(f64::from(i) * 0.08 + 0.14, f64::from(j) * 0.1 - 0.45, 0.0);
        // No column for a view: the row ends with the pixel.
        let mut row = String::new();
        truth.row(&mut row, &mut random, shot, (&above, at), "");
        text.push_str(&row.replace(",\n", "\n"));
    }
    let finding = found(&[text], &sidecar);
    assert_eq!(finding.verdict, Verdict::Ambiguous, "{finding:#?}");
    assert!(names(&finding).contains(&"focal_error"), "{:?}", names(&finding));
    assert!(names(&finding).contains(&"camera_shift"), "{:?}", names(&finding));
}

/// The same without a pose: the distance takes it all up, and the answer says that it was blind.
#[test]
fn what_the_pictures_cannot_show_is_said() {
    let truth = Truth { focal: [1.05, 1.05], ..Truth::default() };
    let finding = found(&[truth.board_pictures(Shot::with(9), 6, false)], &unposed());
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{finding:#?}");
    let blind = finding.notes.iter().find(|note| note.contains("cannot show")).unwrap();
    assert!(blind.contains("focal_error"), "{blind}");
}

/// A tracker's place is in the base's axes: as the camera's own it once made a perfect camera stand elsewhere.
#[test]
fn where_a_tracker_stands_says_nothing_of_the_camera() {
    let texts = [1, 2].map(|seed| Truth::default().table_picture(Shot::with(seed), true));
    let knowing = |at: &str| {
        let line = format!("effect camera_shift({at}) {{ x = 20 mm, y = -10 mm, z = 15 mm }}");
        asked(&texts, &posed(), &line).unwrap().finding
    };
    for at in ["tracker", "object_tracker"] {
        let finding = knowing(at);
        assert_eq!(finding.verdict, Verdict::NothingMissing, "{finding:#?}");
        let aside = format!("effect camera_shift({at}) is not of the camera and is left aside");
        assert!(finding.notes.iter().any(|note| note.starts_with(&aside)), "{:?}", finding.notes);
    }
    // As a file has it in which the two were one word.
    let finding = knowing("camera");
    assert!(names(&finding).contains(&"camera_shift"), "{finding:#?}");
    let told = |note: &String| note.contains("call it `camera_shift(tracker)`");
    assert!(finding.notes.iter().any(told), "{:?}", finding.notes);
}

#[test]
fn what_the_model_knows_is_not_missing() {
    let truth = Truth { k: [-0.12, 0.0], centre: [9.0, -6.0], ..Truth::default() };
    let texts = [1, 2].map(|seed| truth.table_picture(Shot::with(seed), true));
    let finding = found(&texts, &posed());
    let lines = finding.model.added.join(" ");
    let again = asked(&texts, &posed(), &lines).unwrap().finding;
    assert_eq!(again.verdict, Verdict::NothingMissing, "{lines}\n{again:#?}");
}

#[test]
fn a_quarter_of_wrong_matches_is_no_effect() {
    let shot = |seed| Shot { wrong: 0.25, ..Shot::with(seed) };
    let none = [1, 2].map(|seed| Truth::default().table_picture(shot(seed), true));
    let finding = found(&none, &posed());
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{finding:#?}");
    let truth = Truth { k: [-0.1, 0.0], ..Truth::default() };
    let bent = [1, 2].map(|seed| truth.table_picture(shot(seed), true));
    one(&found(&bent, &posed()), "radial_distortion");
}

#[test]
fn the_same_points_give_the_same_finding() {
    let truth = Truth { k: [-0.12, 0.0], ..Truth::default() };
    let json = || serde_json::to_string(&of_table(&truth, true)).unwrap();
    assert_eq!(json(), json());
}
