//! Printed dots and the touch-off ball, with known truth.

use nalgebra::Vector3;
use trueup::alignment::marks::{find_marker_ball, find_marks};
use trueup::alignment::vision::Error;
use trueup::world::{Camera, Point, Pose};

use super::paint::{Light, Painter, true_camera};
use crate::kitchen;

/// The dots' centres come back to a tenth of a pixel, though the guess is tens of pixels off.
#[test]
fn dots_are_found_through_a_wrong_guess() {
    let (scene, camera) = (kitchen::scene(), true_camera());
    let mut painter = Painter::new(&camera, [70, 72, 75]);
    painter.table(&scene);
    let image = painter.finish(&Light { gain: 0.9, slope: [0.5, -0.3], noise: 2.0, seed: 1 });
    let sightings = find_marks(&image, &scene, &scene.camera).unwrap();
    assert_eq!(sightings.len(), scene.marks.len(), "{sightings:?}");
    let (mut worst, mut offset) = (0.0_f64, 0.0_f64);
    for s in &sightings {
        let mark = scene.marks[s.mark_idx];
        let truth = camera.project(Point::new(mark.x, mark.y, 0.0)).unwrap();
        let guess = scene.camera.project(Point::new(mark.x, mark.y, 0.0)).unwrap();
        worst = worst.max(s.pixel.distance(truth));
        offset = offset.max(guess.distance(truth));
        assert!(s.sigma > 0.01 && s.sigma < 0.3, "{s:?}");
    }
    assert!(offset > 25.0, "the guess must be a bad one, it is {offset} px off");
    assert!(worst < 0.15, "worst centre error {worst} px");
}

/// Hidden dots are missing, false dots are not taken for them.
#[test]
fn hidden_dots_are_left_out_and_false_dots_ignored() {
    let (scene, camera) = (kitchen::scene(), true_camera());
    let mut painter = Painter::new(&camera, [70, 72, 75]);
    painter.table(&scene);
    for (x, y) in [(0.4, 0.1), (0.62, -0.2), (0.86, 0.07), (0.3, 0.0), (0.55, 0.22)] {
        painter.disc(x, y, 0.012, [35.0, 35.0, 35.0]);
    }
    // An arm across the table hides dots 1 and 4 wholly; the cup stands half over dot 8.
    painter.face(
        &[
            Vector3::new(0.0, -0.25, 0.0),
            Vector3::new(0.6, -0.42, 0.0),
            Vector3::new(0.6, -0.24, 0.0),
            Vector3::new(0.0, -0.06, 0.0),
        ],
        [190.0, 190.0, 195.0],
        1.0,
    );
    painter.object(&scene.objects[1], &Pose::upright(0.73, 0.16, 0.0, 0.0));
    let image = painter.finish(&Light::even(2));
    let sightings = find_marks(&image, &scene, &scene.camera).unwrap();
    assert!(sightings.len() >= 8, "{sightings:?}");
    for s in &sightings {
        assert!(![1, 4].contains(&s.mark_idx), "a hidden dot was found: {s:?}");
        let mark = scene.marks[s.mark_idx];
        let truth = camera.project(Point::new(mark.x, mark.y, 0.0)).unwrap();
        assert!(s.pixel.distance(truth) < 0.3, "{s:?} is {} px off", s.pixel.distance(truth));
    }
}

/// Guesses off by up to 60 px in any direction, seeded.
#[test]
fn many_wrong_guesses_all_match_the_same_dots() {
    use rand::{RngExt, SeedableRng};
    let (scene, camera) = (kitchen::scene(), true_camera());
    let mut painter = Painter::new(&camera, [70, 72, 75]);
    painter.table(&scene);
    let image = painter.finish(&Light::even(3));
    let mut rng = rand::rngs::StdRng::seed_from_u64(7);
    for trial in 0..12 {
        let mut guess = camera;
        let mut wobble = |size: f64| (rng.random::<f64>() * 2.0 - 1.0) * size;
        let shift = Vector3::new(wobble(0.03), wobble(0.03), wobble(0.03));
        let target = Vector3::new(0.58 + wobble(0.04), wobble(0.04), 0.04);
        guess = Camera::looking(guess.intrinsics, guess.world_from_camera.origin() + shift, target);
        guess.intrinsics.fx *= 1.0 + wobble(0.03);
        guess.intrinsics.fy = guess.intrinsics.fx;
        guess.intrinsics.k1 = 0.0;
        guess.intrinsics.k2 = 0.0;
        let sightings = find_marks(&image, &scene, &guess).unwrap();
        assert!(sightings.len() >= 12, "trial {trial}: {} found", sightings.len());
        for s in &sightings {
            let mark = scene.marks[s.mark_idx];
            let truth = camera.project(Point::new(mark.x, mark.y, 0.0)).unwrap();
            assert!(s.pixel.distance(truth) < 0.2, "trial {trial}: {s:?}");
        }
    }
}

#[test]
fn a_bare_table_says_that_there_are_no_dots() {
    let (scene, camera) = (kitchen::scene(), true_camera());
    let mut bare = scene.clone();
    bare.marks.clear();
    let mut painter = Painter::new(&camera, [70, 72, 75]);
    painter.table(&bare);
    let image = painter.finish(&Light::even(4));
    let error = find_marks(&image, &scene, &scene.camera).unwrap_err();
    assert!(matches!(error, Error::TooFewMarks { found, .. } if found < 5), "{error}");
    assert!(matches!(find_marks(&image, &bare, &scene.camera), Err(Error::NoMarks { .. })));
    let small = image::RgbImage::new(64, 48);
    assert!(matches!(find_marks(&small, &scene, &scene.camera), Err(Error::WrongSize { .. })));
}

#[test]
fn the_ball_is_found_to_a_quarter_of_a_pixel_or_not_at_all() {
    let (scene, camera) = (kitchen::scene(), true_camera());
    let magenta = [0xd0, 0x20, 0x8f];
    for (i, centre) in
        [Vector3::new(0.5, 0.2, 0.15), Vector3::new(0.7, -0.3, 0.3), Vector3::new(0.4, 0.0, 0.02)]
            .into_iter()
            .enumerate()
    {
        let paint = |covered: f64| {
            let mut painter = Painter::new(&camera, [70, 72, 75]);
            painter.table(&scene);
            painter.object(&scene.objects[1], &Pose::upright(0.6, 0.0, 0.0, 0.0));
            painter.ball(centre, 0.018, magenta);
            let pixel = camera.project(Point::from(centre)).unwrap();
            let r = 921.0 * 0.018 / (centre - camera.world_from_camera.origin()).norm();
            let edge = pixel.u - r + 2.0 * r * covered;
            painter.polygon(
                &[
                    (pixel.u - 60.0, pixel.v - 60.0),
                    (edge, pixel.v - 60.0),
                    (edge, pixel.v + 60.0),
                    (pixel.u - 60.0, pixel.v + 60.0),
                ],
                [120.0, 120.0, 125.0],
                if covered > 0.0 { 1.0 } else { 0.0 },
            );
            painter.finish(&Light::even(10 + i as u64))
        };
        let truth = camera.project(Point::from(centre)).unwrap();
        let seen = find_marker_ball(&paint(0.0), &scene.camera, 0.018, magenta).unwrap();
        assert!(seen.pixel.distance(truth) < 0.25, "{seen:?} against {truth:?}");
        let grazed = find_marker_ball(&paint(0.1), &scene.camera, 0.018, magenta);
        if let Some(seen) = grazed {
            let off = seen.pixel.distance(truth);
            assert!(off < 1.0 && off < 3.0 * seen.sigma, "{seen:?} against {truth:?}");
        }
        assert_eq!(find_marker_ball(&paint(0.55), &scene.camera, 0.018, magenta), None);
        assert_eq!(find_marker_ball(&paint(1.2), &scene.camera, 0.018, magenta), None);
    }
}
