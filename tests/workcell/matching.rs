//! Eq. 1: the three probabilities, what is unknown, and where they stand in a record.

use trueup::execution::calibration::{Calibration, Left};
use trueup::workcell::matching::{Matching, ROOM, within};
use trueup::workcell::trials::Spread;
use trueup::workcell::{Ending, Run};
use trueup::world::{ObjectState, Pose, WorldState};

use crate::kitchen;
use crate::repl::kept::pour;

fn thing(name: &str, std: f64) -> ObjectState {
    ObjectState {
        name: name.into(),
        world_from_object: std.is_finite().then(|| Pose::upright(0.6, 0.1, 0.0, 0.0)),
        std,
        water: None,
    }
}

fn world(objects: Vec<ObjectState>) -> WorldState {
    let run: Run = pour("level_side", 0.1, 0.01, 0.001);
    WorldState { objects, ..run.steps[0].measured.clone() }
}

fn calibration(camera_m: Option<f64>, robot_m: Option<f64>) -> Calibration {
    let left = Left { camera_m, robot_m };
    Calibration { left, ..Calibration::nominal(&kitchen::scene()) }
}

/// Rayleigh's distribution: half of the errors are within 1.1774 standard deviations, 39.35 % within one.
#[test]
fn an_error_on_the_table_is_within_the_room_as_rayleigh_says() {
    assert!((within(1.177_41, 1.0) - 0.5).abs() < 1e-5);
    assert!((within(1.0, 1.0) - 0.393_469).abs() < 1e-6);
    assert!((within(ROOM, 0.0) - 1.0).abs() < 1e-15);
    assert!(within(ROOM, 1.0) < 1e-3);
}

#[test]
fn the_product_is_over_camera_scene_and_robot() {
    let world = world(vec![thing("jar", 0.002), thing("cup", 0.005), thing("lost", f64::INFINITY)]);
    let sure = [("jar".to_owned(), 0.98), ("cup".to_owned(), 0.9), ("lost".to_owned(), 0.1)];
    let found = Matching::of(Some(&calibration(Some(0.004), Some(0.006))), &world, &sure);
    let scene = 0.98 * within(ROOM, 0.002) * 0.9 * within(ROOM, 0.005);
    assert!((found.scene.unwrap() - scene).abs() < 1e-12);
    let names: Vec<_> = found.things.iter().map(|thing| thing.name.as_str()).collect();
    assert_eq!(names, ["jar", "cup"]);
    let all = within(ROOM, 0.004) * scene * within(ROOM, 0.006);
    assert!((found.probability.unwrap() - all).abs() < 1e-12, "{found:?}");
}

#[test]
fn what_nobody_measured_has_no_probability() {
    let world = world(vec![thing("jar", 0.002)]);
    let sure = [("jar".to_owned(), 0.98)];
    let left_out = Matching::of(Some(&calibration(Some(0.001), None)), &world, &sure);
    assert!(left_out.camera.is_some() && left_out.robot.is_none());
    assert_eq!(left_out.probability, None);
    let nothing = Matching::of(None, &world, &[]);
    assert_eq!((nothing.camera, nothing.scene, nothing.probability), (None, None, None));
}

#[test]
fn a_record_keeps_them_and_older_records_are_read_without() {
    let mut run = pour("level_side", 0.1, 0.01, 0.001);
    let older = serde_json::to_value(&run).unwrap();
    assert!(older.get("match").is_none());
    assert_eq!(serde_json::from_value::<Run>(older).unwrap().outcome, run.outcome);
    let world = world(vec![thing("jar", 0.002)]);
    let sure = [("jar".to_owned(), 0.98)];
    run.matching = Some(Matching::of(Some(&calibration(Some(0.001), Some(0.002))), &world, &sure));
    let text = serde_json::to_value(&run).unwrap();
    for key in ["camera", "robot"] {
        assert!(text["match"][key]["probability"].is_number(), "{text}");
    }
    assert!(text["match"]["scene"].is_number() && text["match"]["probability"].is_number());
    let back: Run = serde_json::from_value(text).unwrap();
    assert_eq!(back.matching, run.matching);
    assert_ne!(back.outcome, Ending::Stopped);
}

#[test]
fn a_spread_is_mean_and_deviation_of_one() {
    let of = |values: &[f64]| Spread::of(values.iter().copied());
    assert_eq!(of(&[]), None);
    assert_eq!(of(&[3.0]).map(|s| (s.mean, s.std, s.n)), Some((3.0, 0.0, 1)));
    // 2, 4, 4, 4, 5, 5, 7, 9: mean 5, sum of squares 32 over 7.
    let eight = of(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]).unwrap();
    assert!(
        (eight.mean - 5.0).abs() < 1e-12 && (eight.std - (32.0_f64 / 7.0).sqrt()).abs() < 1e-12
    );
}
