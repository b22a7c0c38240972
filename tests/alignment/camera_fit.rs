//! The scene's camera from one picture of the table's marks.

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use rand::SeedableRng;
use rand::rngs::StdRng;
use trueup::alignment::Error;
use trueup::alignment::camera_fit::{PARAMETERS, Priors, Refine, Sighting, refine_camera};
use trueup::world::frame::World;
use trueup::world::{Camera, Intrinsics, Pixel, Point, Pose};

use super::support::normal;

fn truth() -> Camera {
    let mut k = Intrinsics::centred(930.0, 1280, 720);
    k.k1 = -0.08;
    (k.cx, k.cy) = (645.0, 352.0);
    Camera::looking(k, Vector3::new(1.25, 0.05, 0.85), Vector3::new(0.6, 0.0, 0.05))
}

/// The camera as the scene file thinks it is: 30 mm and 2° off, with a plain lens.
fn guess() -> Camera {
    let t = truth();
    let turn = UnitQuaternion::from_euler_angles(0.03, -0.02, 0.015);
    Camera {
        intrinsics: Intrinsics::centred(900.0, 1280, 720),
        world_from_camera: Pose::from_parts(
            t.world_from_camera.origin() + Vector3::new(0.02, -0.015, 0.02),
            t.world_from_camera.rotation() * turn,
        ),
    }
}

/// A 4 × 5 grid of marks on the table and, with `above`, six points above it.
fn sightings(sigma: f64, above: bool, seed: u64) -> Vec<Sighting> {
    let mut random = StdRng::seed_from_u64(seed);
    let mut points: Vec<Point<World>> = (0..20)
        .map(|k| Point::new(0.3 + 0.15 * f64::from(k % 4), -0.32 + 0.16 * f64::from(k / 4), 0.0))
        .collect();
    if above {
        points.extend((0..6).map(|k| {
            Point::new(
                0.4 + 0.06 * f64::from(k),
                0.1 * f64::from(k % 3) - 0.1,
                0.1 + 0.04 * f64::from(k),
            )
        }));
    }
    points
        .into_iter()
        .map(|point| {
            let mut pixel = truth().project(point).unwrap();
            pixel.u += sigma * normal(&mut random);
            pixel.v += sigma * normal(&mut random);
            Sighting { point, pixel, sigma: sigma.max(0.05) }
        })
        .collect()
}

/// Root mean square error on the table of what the camera says of 25 places, m.
fn table_error(camera: &Camera) -> f64 {
    let mut sum = 0.0;
    for k in 0..25 {
        let p =
            Point::<World>::new(0.3 + 0.11 * f64::from(k % 5), -0.3 + 0.15 * f64::from(k / 5), 0.0);
        let seen = camera.on_plane(truth().project(p).unwrap(), 0.0).unwrap();
        sum += (seen.coords() - p.coords()).norm_squared();
    }
    (sum / 25.0_f64).sqrt()
}

#[test]
fn marks_bring_the_table_within_a_millimetre() {
    let before = table_error(&guess());
    for above in [false, true] {
        let fit = refine_camera(&guess(), &sightings(0.3, above, 1), &Refine::all()).unwrap();
        let after = table_error(&fit.camera);
        assert!(before > 0.015 && after < 0.0007, "{before} m before, {after} m after");
        assert!(fit.outliers.is_empty() && fit.rms_px < 0.6 && (fit.chi - 1.0).abs() < 0.4);
        assert!(fit.moved_m > 0.01 && fit.turned_rad > 0.02);
    }
}

#[test]
fn exact_points_off_the_plane_give_the_exact_camera() {
    let mut refine = Refine::all();
    refine.priors.focal = f64::INFINITY;
    refine.priors.principal = f64::INFINITY;
    refine.priors.k1 = f64::INFINITY;
    let fit = refine_camera(&guess(), &sightings(0.0, true, 1), &refine).unwrap();
    let (k, t) = (fit.camera.intrinsics, truth().intrinsics);
    for (ours, truth) in [(k.fx, t.fx), (k.fy, t.fy), (k.cx, t.cx), (k.cy, t.cy), (k.k1, t.k1)] {
        assert!((ours - truth).abs() < 1e-5 * truth.abs().max(1.0), "{ours} for {truth}");
    }
    let shift = fit.camera.world_from_camera.origin() - truth().world_from_camera.origin();
    assert!(shift.norm() < 1e-7);
    assert!(fit.unobservable.is_empty(), "{:?}", fit.unobservable);
}

#[test]
fn wrongly_matched_marks_are_named_and_do_no_harm() {
    let mut seen = sightings(0.3, false, 2);
    let swapped = seen[4].pixel;
    seen[4].pixel = seen[9].pixel;
    seen[9].pixel = swapped;
    seen[15].pixel.u += 60.0;
    let fit = refine_camera(&guess(), &seen, &Refine::all()).unwrap();
    assert_eq!(fit.outliers, [4, 9, 15]);
    assert!(table_error(&fit.camera) < 0.001);
}

#[test]
fn a_guess_from_the_wrong_side_still_ends_right() {
    let mut far = guess();
    far.world_from_camera =
        Camera::looking(far.intrinsics, Vector3::new(0.6, 0.9, 1.2), Vector3::new(0.5, 0.0, 0.0))
            .world_from_camera;
    let fit = refine_camera(&far, &sightings(0.3, false, 3), &Refine::all()).unwrap();
    assert!(table_error(&fit.camera) < 0.001 && fit.turned_rad > 0.5);
}

#[test]
fn switching_a_regression_off_keeps_what_it_would_find() {
    let seen = sightings(0.3, false, 4);
    let pose = refine_camera(&guess(), &seen, &Refine::pose_only()).unwrap();
    assert_eq!(pose.camera.intrinsics, guess().intrinsics);
    let inside = refine_camera(&guess(), &seen, &Refine::intrinsics_only()).unwrap();
    assert!(inside.moved_m < 1e-12 && inside.turned_rad < 1e-7);
    let all = refine_camera(&guess(), &seen, &Refine::all()).unwrap();
    let error = |fit: &trueup::alignment::camera_fit::CameraFit| table_error(&fit.camera);
    assert!(error(&all) < error(&pose) && error(&pose) < error(&inside));
}

#[test]
fn the_spread_on_the_table_is_as_told() {
    let runs = 150;
    let place = Point::<World>::new(0.55, 0.22, 0.0);
    let pixel = truth().project(place).unwrap();
    let (mut seen, mut told) = ([0.0; 2], [0.0; 2]);
    for seed in 0..runs {
        let mut refine = Refine::all();
        refine.robust = false;
        (refine.priors.focal, refine.priors.principal, refine.priors.k1) = (0.05, 10.0, 0.1);
        // The guess is drawn as its priors say, or they would not be priors.
        let mut random = StdRng::seed_from_u64(7000 + seed);
        let mut from = guess();
        let k = &mut from.intrinsics;
        k.fx = truth().intrinsics.fx * (1.0 + 0.05 * normal(&mut random));
        k.fy = k.fx;
        k.cx = truth().intrinsics.cx + 10.0 * normal(&mut random);
        k.cy = truth().intrinsics.cy + 10.0 * normal(&mut random);
        k.k1 = truth().intrinsics.k1 + 0.1 * normal(&mut random);
        let fit = refine_camera(&from, &sightings(0.3, false, 50 + seed), &refine).unwrap();
        let e = fit.camera.on_plane(pixel, 0.0).unwrap().coords() - place.coords();
        let c = fit.plane_covariance(pixel, 0.0).unwrap();
        seen[0] += e.x * e.x / runs as f64;
        seen[1] += e.y * e.y / runs as f64;
        told[0] += c[(0, 0)] / runs as f64;
        told[1] += c[(1, 1)] / runs as f64;
    }
    for axis in 0..2 {
        let ratio = (seen[axis] / told[axis]).sqrt();
        // 5.8 % for 150 runs, and the covariance is never narrowed below what the sigmas say.
        assert!((0.75..1.15).contains(&ratio), "axis {axis}: {ratio}");
    }
}

#[test]
fn what_the_marks_cannot_tell_is_named() {
    // Straight from above the focal length and the distance trade.
    let k = Intrinsics::centred(900.0, 1280, 720);
    let above = Camera::looking(k, Vector3::new(0.5, 0.0, 1.5), Vector3::new(0.5, 0.0, 0.0));
    let seen: Vec<Sighting> = (0..12)
        .map(|i| {
            let point = Point::<World>::new(
                0.3 + 0.12 * f64::from(i % 4),
                0.15 * f64::from(i / 4) - 0.2,
                0.0,
            );
            Sighting { point, pixel: above.project(point).unwrap(), sigma: 0.3 }
        })
        .collect();
    let mut refine = Refine::all();
    refine.priors.focal = 0.02;
    refine.k1 = false;
    let fit = refine_camera(&above, &seen, &refine).unwrap();
    assert!(fit.unobservable.contains(&PARAMETERS[0]), "{:?}", fit.unobservable);
    assert!((fit.std[0] / 18.0 - 1.0).abs() < 0.1, "{}", fit.std[0]);

    let few = refine_camera(&above, &seen[..3], &refine);
    assert!(matches!(few, Err(Error::TooFew { needed: 4, given: 3, .. })));
    let mut broken = seen;
    broken[2].pixel = Pixel::new(f64::NAN, 0.0);
    assert!(matches!(
        refine_camera(&above, &broken, &refine),
        Err(Error::NotFinite { row: 2, .. })
    ));
}

/// `scene from` said ± 1.2 mm of a box 36 mm from its place, with a camera that was only guessed.
#[test]
fn a_camera_that_is_put_down_by_eye_leaves_places_centimetres_open() {
    let eye = Vector3::new(1.25, 0.0, 0.85);
    let camera = Camera::looking(Intrinsics::centred(900.0, 1280, 720), eye, Vector3::zeros());
    let at = Vector2::new(0.6, 0.05);
    let spread = Priors::by_eye().on_table(&camera, at);
    assert!(spread.place > 0.03 && spread.place < 0.15, "{spread:?}");
    assert!(spread.length > 0.04 && spread.length < 0.2, "{spread:?}");
    // Shifted along the table by 1 cm a camera sees things shifted by as much; raised by it, by more the flatter it looks.
    let shifted =
        Priors { position: 0.01, rotation: 0.0, focal: 0.0, principal: 0.0, ..Priors::by_eye() };
    let spread = shifted.on_table(&camera, at);
    let along = (eye.xy() - at).norm() / eye.z;
    assert!((spread.place - 0.01 * along.hypot(1.0)).abs() < 5e-4, "{spread:?}");
    // A place behind the camera.
    assert!(Priors::by_eye().on_table(&camera, Vector2::new(5.0, 0.0)).place.is_infinite());
}
