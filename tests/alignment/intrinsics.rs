//! Regression 2: planted cameras, what cannot be told, and two published calibrations.

use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand::rngs::StdRng;
use trueup::alignment::Error;
use trueup::alignment::intrinsics::lens::choose;
use trueup::alignment::intrinsics::strays::without;
use trueup::alignment::intrinsics::{
    Calibration, Distortion, ExtrinsicsPrior, Options, View, calibrate,
};
use trueup::world::frame::{Camera as CameraFrame, World};
use trueup::world::{Camera, Intrinsics, Pixel, Point, Pose};

use super::support::{normal, numbers};
use crate::absent::public;

fn planted() -> Intrinsics {
    Intrinsics {
        fx: 903.0,
        fy: 897.0,
        cx: 633.0,
        cy: 371.0,
        skew: 0.4,
        k1: -0.11,
        k2: 0.04,
        ..Intrinsics::centred(900.0, 1280, 720)
    }
}

/// Views of a 6 × 8 grid of 40 mm, from four sides, with noise of `sigma` px.
fn views(sigma: f64, known: bool, seed: u64) -> Vec<View> {
    let mut random = StdRng::seed_from_u64(seed);
    let eyes = [(0.35, 0.1, 0.4), (-0.25, 0.2, 0.45), (0.1, -0.35, 0.35), (0.02, 0.35, 0.5)];
    eyes.iter()
        .enumerate()
        .map(|(i, &(x, y, z))| {
            let camera =
                Camera::looking(planted(), Vector3::new(x, y, z), Vector3::new(0.01, 0.0, 0.0));
            let points = (0..48)
                .map(|k| {
                    let (a, b) = (f64::from(k % 8) - 3.5, f64::from(k / 8) - 2.5);
                    let point = Point::<World>::new(0.04 * a, 0.04 * b, 0.0);
                    let mut pixel = camera.project(point).unwrap();
                    pixel.u += sigma * normal(&mut random);
                    pixel.v += sigma * normal(&mut random);
                    (point, pixel)
                })
                .collect();
            let world_from_camera = known.then_some(camera.world_from_camera);
            View { name: format!("{i}"), points, world_from_camera }
        })
        .collect()
}

fn values(k: &Intrinsics) -> [f64; 7] {
    [k.fx, k.fy, k.cx, k.cy, k.skew, k.k1, k.k2]
}

#[test]
fn exact_points_give_the_exact_camera_with_and_without_extrinsics() {
    for known in [true, false] {
        let options = Options { skew: Some(true), ..Options::default() };
        let fit = calibrate(&views(0.0, known, 1), &options).unwrap();
        for (ours, truth) in values(&fit.intrinsics).iter().zip(values(&planted())) {
            assert!((ours - truth).abs() < 1e-6 * truth.abs().max(1.0), "{ours} for {truth}");
        }
        assert!(fit.rms_px < 1e-7);
        assert_eq!(fit.leverage.is_some(), known);
    }
}

#[test]
fn the_sigmas_are_what_repetition_shows() {
    for known in [true, false] {
        let options = Options { skew: Some(true), ..Options::default() };
        let runs = 150;
        let (mut seen, mut told) = ([0.0; 7], [0.0; 7]);
        for seed in 0..runs {
            let fit = calibrate(&views(0.3, known, seed), &options).unwrap();
            for (i, (ours, truth)) in
                values(&fit.intrinsics).iter().zip(values(&planted())).enumerate()
            {
                seen[i] += (ours - truth).powi(2) / runs as f64;
                told[i] += fit.std[i].powi(2) / runs as f64;
            }
        }
        for i in 0..7 {
            let ratio = (seen[i] / told[i]).sqrt();
            // The standard error of a standard deviation from 150 runs is 5.8 %.
            assert!((ratio - 1.0).abs() < 0.18, "known {known}, parameter {i}: {ratio}");
        }
    }
}

#[test]
fn wrong_extrinsics_are_refined_as_far_as_their_prior_allows() {
    let mut shaken = views(0.2, true, 3);
    for (i, view) in shaken.iter_mut().enumerate() {
        let pose = view.world_from_camera.unwrap();
        let turn = UnitQuaternion::from_euler_angles(0.004, -0.003 * i as f64, 0.002);
        let shift = Vector3::new(0.003, -0.002, 0.004);
        let moved: Pose<World, CameraFrame> =
            Pose::from_parts(pose.origin() + shift, pose.rotation() * turn);
        view.world_from_camera = Some(moved);
    }
    let stiff = calibrate(&shaken, &Options::default()).unwrap();
    let prior = ExtrinsicsPrior { position: 0.005, rotation: 0.005 };
    let options = Options { refine_extrinsics: Some(prior), sigma_px: 0.2, ..Options::default() };
    let soft = calibrate(&shaken, &options).unwrap();
    // The stiff fit has to bend the camera instead; the residuals give it away.
    let off = |fit: &Calibration| (fit.intrinsics.fx - 903.0).abs();
    assert!(off(&soft) < 3.0 * soft.std[0], "{} ± {}", off(&soft), soft.std[0]);
    assert!(off(&soft) < 0.6 * off(&stiff) && soft.rms_px < 0.35 && stiff.rms_px > 1.0);
    // It says how far the extrinsics had to move.
    assert!(soft.views.iter().all(|v| v.moved_m > 0.001 && v.moved_m < 0.02), "{:?}", soft.views);
    assert!(stiff.views.iter().all(|v| v.moved_m < 1e-12));
}

#[test]
fn one_view_with_the_picture_s_size_gives_the_focal_length() {
    let mut camera = Intrinsics::centred(900.0, 1280, 720);
    camera.k1 = -0.1;
    let camera =
        Camera::looking(camera, Vector3::new(0.4, 0.2, 0.4), Vector3::new(0.02, 0.01, 0.0));
    let points = (0..30)
        .map(|k| {
            let point = Point::<World>::new(
                0.05 * f64::from(k % 6) - 0.12,
                0.05 * f64::from(k / 6) - 0.1,
                0.0,
            );
            (point, camera.project(point).unwrap())
        })
        .collect();
    let view = View { name: "only".into(), points, world_from_camera: None };
    let options = Options { distortion: Distortion::K1, ..Options::default() };
    assert_eq!(calibrate(std::slice::from_ref(&view), &options), Err(Error::ImageSize));
    let options = Options { image_size: Some((1280, 720)), ..options };
    let fit = calibrate(&[view], &options).unwrap();
    assert!((fit.intrinsics.fx - 900.0).abs() < 1e-4 && (fit.intrinsics.k1 + 0.1).abs() < 1e-6);
    let back = fit.views[0].camera_from_world.inverse();
    assert!((back.origin() - Vector3::new(0.4, 0.2, 0.4)).norm() < 1e-7);
}

/// Of one picture the principal point is taken as its centre, held there, and `p1` and `p2` were fitted beside it: 568.7 ± 2.0 px
/// where 600 was true.
#[test]
fn the_doubt_of_one_view_has_that_of_the_centre_it_assumes() {
    let options = Options { image_size: Some((1280, 720)), ..Options::default() };
    for seed in 0..2 {
        for view in views(0.2, false, seed) {
            let (fit, compared) = choose(std::slice::from_ref(&view), &options).unwrap();
            let k = fit.intrinsics;
            let off = (k.fx - planted().fx).abs();
            // Noise alone would be 2 to 3 px, and the centre is 6 and 12 px off.
            assert!(fit.std[0] > 10.0 && fit.std[0] < 60.0, "{}: {:?}", view.name, fit.std);
            assert!(off < 2.5 * fit.std[0], "{}: {off} px off, ± {}", view.name, fit.std[0]);
            assert!(compared.iter().all(|choice| !choice.distortion.is_tangential()));
            assert!(k.p1.abs() + k.p2.abs() < f64::EPSILON, "{k:?}");
            // What was assumed is not said to be fitted.
            assert!(fit.std[2] + fit.std[3] < f64::EPSILON, "{:?}", fit.std);
        }
    }
    // With the pose known the centre is measured, and all choices are tried.
    let (_, compared) = choose(&views(0.2, true, 1)[..1], &options).unwrap();
    assert!(compared.iter().any(|choice| choice.distortion.is_tangential()), "{compared:?}");
}

#[test]
fn what_cannot_be_told_is_refused() {
    let options = Options::default();
    // All points in the middle of the picture: no lever for the focal length.
    let camera = Camera::looking(planted(), Vector3::new(0.0, 0.0, 1.0), Vector3::zeros());
    let points = (0..12)
        .map(|k| {
            let point = Point::<World>::new(1e-4 * f64::from(k), 3e-2 * f64::from(k % 5), 0.0);
            (point, camera.project(point).unwrap())
        })
        .collect();
    let narrow =
        View { name: "narrow".into(), points, world_from_camera: Some(camera.world_from_camera) };
    let refused = calibrate(std::slice::from_ref(&narrow), &options);
    assert!(matches!(refused, Err(Error::NoLeverage { .. })), "{refused:?}");

    // Seen from below, the camera looks away.
    let mut behind = narrow.clone();
    let away = Camera::looking(planted(), Vector3::new(0.0, 0.0, 1.0), Vector3::new(0.0, 0.1, 2.0));
    behind.world_from_camera = Some(away.world_from_camera);
    assert!(matches!(calibrate(&[behind], &options), Err(Error::BehindCamera { row: 0 })));

    // Three views from the same direction: Zhang's equations say the same thing three times.
    let same: Vec<View> = (0..3).map(|_| views(0.0, false, 1).swap_remove(0)).collect();
    let parallel = calibrate(&same, &options);
    assert!(matches!(parallel, Err(Error::Views { views: 3, .. })), "{parallel:?}");

    let mut raised = views(0.0, false, 1);
    raised[1].points[4].0 = Point::new(0.0, 0.0, 0.02);
    assert!(matches!(calibrate(&raised, &options), Err(Error::OffPlane { row: 52, .. })));

    let mut mixed = views(0.0, true, 1);
    mixed[2].world_from_camera = None;
    assert!(matches!(
        calibrate(&mixed, &options),
        Err(Error::Length { given: 3, expected: 4, .. })
    ));
    assert!(matches!(calibrate(&[], &options), Err(Error::TooFew { .. })));
}

#[test]
fn zhang_s_five_views_give_his_published_camera() {
    let Some(dir) = public("zhang_planar") else { return };
    let read = |name: &str| numbers(&std::fs::read_to_string(dir.join(name)).unwrap());
    let model = read("Model.txt");
    let views: Vec<View> = (1..=5)
        .map(|i| {
            let data = read(&format!("data{i}.txt"));
            assert_eq!(data.len(), model.len());
            let points = model
                .chunks_exact(2)
                .zip(data.chunks_exact(2))
                .map(|(m, p)| {
                    (Point::new(0.0254 * m[0], 0.0254 * m[1], 0.0), Pixel::new(p[0], p[1]))
                })
                .collect();
            View { name: format!("data{i}"), points, world_from_camera: None }
        })
        .collect();
    let fit = calibrate(&views, &Options::default()).unwrap();
    let k = fit.intrinsics;
    // alpha, beta, u0, v0, gamma, k1, k2 as published.
    let published = [832.5, 832.53, 303.959, 206.585, 0.204_494, -0.228_601, 0.190_353];
    for (ours, theirs) in values(&k).iter().zip(published) {
        assert!((ours / theirs - 1.0).abs() < 1e-3, "{ours} for {theirs}");
    }
    assert!((fit.rms_px - 0.336_434).abs() < 1e-4, "{}", fit.rms_px);
    let sigmas = [1.407, 1.386, 0.712, 0.659, 0.0783, 0.004_14, 0.0249];
    for (ours, theirs) in fit.std.iter().zip(sigmas) {
        assert!((ours / theirs - 1.0).abs() < 0.02, "{ours} for {theirs}");
    }
    // The first published pose; its file has inches.
    let text =
        std::fs::read_to_string(dir.join("calibration-result-zhang-withdistortion.txt")).unwrap();
    let n = numbers(&text);
    let t = Vector3::new(n[16], n[17], n[18]) * 0.0254;
    assert!((fit.views[0].camera_from_world.origin() - t).norm() < 1e-3);

    let pinhole = Options { distortion: Distortion::None, ..Options::default() };
    let fit = calibrate(&views, &pinhole).unwrap();
    assert!(
        (fit.intrinsics.fx / 867.3083 - 1.0).abs() < 1e-5 && (fit.rms_px - 1.11587).abs() < 1e-4
    );
}

/// One corner of 192 read elsewhere in the picture: the views were said to be too alike, or the points on a line.
#[test]
fn a_corner_at_the_other_end_of_the_picture_is_left_out() {
    let fit =
        |views: &[View]| calibrate(views, &Options::default()).map(|calibration| (calibration, ()));
    let ends = [(10.0, 10.0), (1270.0, 15.0), (20.0, 700.0), (1250.0, 690.0), (640.0, -900.0)];
    for (i, (u, v)) in ends.into_iter().enumerate() {
        let mut wrong = views(0.2, false, 5);
        let point = 11 * i;
        wrong[i % 4].points[point].1 = Pixel::new(u, v);
        let found = without(&wrong, fit).unwrap();
        let out: Vec<_> = found.strays.iter().map(|stray| (stray.view, stray.point)).collect();
        assert_eq!(out, [(i % 4, point)]);
        let calibration = found.fit.0;
        let off = (calibration.intrinsics.fx - planted().fx).abs();
        assert!(off < 4.0 * calibration.std[0] && calibration.rms_px < 0.4, "{i}: {off} px");
    }
    // One in each view, too.
    let mut wrong = views(0.2, false, 6);
    for (i, view) in wrong.iter_mut().enumerate() {
        view.points[7 * i + 3].1 = Pixel::new(1200.0 - 350.0 * i as f64, 20.0);
    }
    let found = without(&wrong, fit).unwrap();
    let out: Vec<_> = found.strays.iter().map(|stray| (stray.view, stray.point)).collect();
    assert_eq!(out, [(0, 3), (1, 10), (2, 17), (3, 24)]);
    assert!(found.fit.0.rms_px < 0.4, "{}", found.fit.0.rms_px);
}

#[test]
fn thirteen_chessboards_reach_the_peer_s_error() {
    let Some(dir) = public("opencv_chessboard") else { return };
    let text = std::fs::read_to_string(dir.join("corners_left_cv2.csv")).unwrap();
    let mut views: Vec<View> = Vec::new();
    for line in text.lines().skip(1) {
        let (name, rest) = line.split_once(',').unwrap();
        let n = numbers(rest);
        if views.last().is_none_or(|v| v.name != name) {
            views.push(View { name: name.into(), points: Vec::new(), world_from_camera: None });
        }
        let point = Point::new(0.025 * n[2], 0.025 * n[1], 0.0);
        views.last_mut().unwrap().points.push((point, Pixel::new(n[3], n[4])));
    }
    assert_eq!(views.len(), 13);
    let options = Options { skew: Some(false), ..Options::default() };
    let fit = calibrate(&views, &options).unwrap();
    // cv2 with k1 and k2 alone: 0.20417. Its 0.19542 takes tangential terms that our lens lacks.
    assert!((fit.rms_px - 0.20417).abs() < 1e-5, "{}", fit.rms_px);
    assert!((fit.intrinsics.fx - 532.827).abs() < 2.0, "{}", fit.intrinsics.fx);
}
