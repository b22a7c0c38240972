//! Where a camera sits, by every kind of board: drawn pictures, a planted camera on the wrist and beside the arm, parts of a
//! board, sides of another length than was said.

use image::{Rgb, RgbImage};
use nalgebra::SMatrix;
use trueup::alignment::boards::charuco::Charuco;
use trueup::alignment::boards::circles::Circles;
use trueup::alignment::boards::tag_grid::TagGrid;
use trueup::alignment::boards::tags::Family;
use trueup::alignment::boards::{Sides, Target};
use trueup::alignment::chessboard::Board;
use trueup::alignment::hand_eye::{HandEye, Known, Mount, Options, View, solve};
use trueup::world::Pose;

use crate::rig::Rig;
use crate::sheet::{Sheet, sheet, taken};

/// A board of each kind, some 20 cm wide, with its lengths `times` as large.
fn targets(times: f64) -> Vec<Target> {
    let family = |name: &str| Family::named(name).unwrap();
    let charuco = Charuco::new(7, 5, 0.03 * times, 0.022 * times, family("4x4_50"));
    vec![
        Target::Chessboard(Board::new(9, 6, 0.02 * times).unwrap()),
        Target::Charuco(charuco.unwrap()),
        Target::Tags(TagGrid::new(4, 3, 0.04 * times, 0.3, family("36h11")).unwrap()),
        Target::Circles(Circles::new(7, 6, 0.025 * times, false).unwrap()),
        Target::Circles(Circles::new(4, 11, 0.015 * times, true).unwrap()),
    ]
}

/// What is seen of a board in drawn pictures, each changed by `spoil`.
fn views(
    rig: &Rig,
    sheet: &Sheet,
    said: &Target,
    spoil: &dyn Fn(usize, &mut RgbImage),
) -> Vec<View> {
    let poses = rig.said(3);
    let view = |i: usize| {
        let mut picture = taken(sheet, &rig.seen_by(i), i as u64);
        spoil(i, &mut picture);
        let points = said.find(&picture).unwrap_or_else(|why| panic!("{said:?} {i}: {why}"));
        View { name: i.to_string(), base_from_flange: Pose::new(poses[i]), points }
    };
    (0..poses.len()).map(view).collect()
}

fn solved(rig: &Rig, views: &[View], said: &Target) -> HandEye {
    let camera = Known { intrinsics: rig.intrinsics, covariance: SMatrix::zeros() };
    let options = Options { board: said.clone(), mount: None };
    solve(views, &camera, &options).unwrap_or_else(|why| panic!("{said:?}: {why}"))
}

/// How far the camera is from where it truly is, m and rad.
fn error(rig: &Rig, answer: &HandEye) -> (f64, f64) {
    let far = answer.camera.pose.translation.vector - rig.camera.translation.vector;
    (far.norm(), answer.camera.pose.rotation.angle_to(&rig.camera.rotation))
}

#[test]
fn every_board_finds_a_camera_on_the_wrist_and_a_fixed_one() {
    for (k, target) in targets(1.0).iter().enumerate() {
        let sheet = sheet(target);
        for mount in [Mount::Wrist, Mount::Fixed] {
            let rig = Rig::before(mount, &sheet, 8);
            let answer = solved(&rig, &views(&rig, &sheet, target, &|_, _| {}), target);
            let (position, rotation) = error(&rig, &answer);
            assert_eq!(answer.mount, mount, "{k}");
            // Noise of 0.3 mm and 0.03 deg in the poses, as for the chessboard's points in `hand_eye.rs`.
            assert!(position < 1.5e-3 && rotation < 3e-3, "{k} {mount}: {position} {rotation}");
            assert!(!answer.square.is_wrong, "{k} {mount}: {:?}", answer.square);
            assert!(answer.views.iter().all(|v| v.is_used), "{k} {mount}: {:?}", answer.views);
        }
    }
}

#[test]
fn sides_of_another_length_are_named_for_what_they_are() {
    let (drawn, said) = (targets(1.0), targets(1.1));
    for (k, (mount, of, word)) in [
        (Mount::Wrist, Sides::Squares, "the squares look like"),
        (Mount::Fixed, Sides::Tags, "the tags look like"),
        (Mount::Wrist, Sides::Steps, "the steps between rows look like"),
    ]
    .into_iter()
    .enumerate()
    .map(|(i, case)| (i + 1, case))
    {
        let sheet = sheet(&drawn[k]);
        let rig = Rig::before(mount, &sheet, 12);
        let answer = solved(&rig, &views(&rig, &sheet, &said[k], &|_, _| {}), &said[k]);
        let (truth, _) = drawn[k].side();
        let square = answer.square;
        assert!(square.is_wrong && square.of == of, "{k}: {square:?}");
        assert!((square.measured / truth - 1.0).abs() < 0.01, "{k}: {square:?}");
        assert!(answer.advice()[0].to_string().contains(word), "{k}: {:?}", answer.advice());
        assert!(error(&rig, &answer).0 < 2e-3, "{k}: {:?}", error(&rig, &answer));
    }
}

/// A hand over another half of the board in every picture.
#[test]
fn parts_of_a_board_are_enough() {
    for target in &targets(1.0)[1..3] {
        let sheet = sheet(target);
        for mount in [Mount::Wrist, Mount::Fixed] {
            let rig = Rig::before(mount, &sheet, 12);
            let hand = |i: usize, picture: &mut RgbImage| {
                let (w, h) = picture.dimensions();
                for (u, v, pixel) in picture.enumerate_pixels_mut() {
                    let is_covered = match i % 4 {
                        0 => u > w / 2,
                        1 => v > h / 2,
                        2 => u < w / 2,
                        _ => v < h / 2,
                    };
                    if is_covered {
                        *pixel = Rgb([150, 110, 90]);
                    }
                }
            };
            let views = views(&rig, &sheet, target, &hand);
            let answer = solved(&rig, &views, target);
            let (position, rotation) = error(&rig, &answer);
            assert_eq!(answer.mount, mount);
            assert!(position < 2e-3 && rotation < 4e-3, "{mount}: {position} {rotation}");
            assert!(!answer.square.is_wrong, "{mount}: {:?}", answer.square);
            assert!(answer.views.iter().all(|v| v.is_used), "{mount}: {:?}", answer.views);
        }
    }
}

/// A plain grid of circles looks the same from both ends: found in either order, it is put in one.
#[test]
fn the_orders_of_a_board_are_the_turns_that_leave_it_the_same() {
    let alike: Vec<usize> = targets(1.0).iter().map(|t| t.orders(&Vec::new()).len()).collect();
    assert_eq!(alike, [1, 1, 1, 2, 1]);
    let even = Target::Circles(Circles::new(4, 8, 0.02, true).unwrap());
    assert_eq!(even.orders(&Vec::new()).len(), 2);
    let square = Target::Circles(Circles::new(6, 6, 0.02, false).unwrap());
    assert_eq!(square.orders(&Vec::new()).len(), 4);
    // Turned about the middle, a point of the board is a point of the board.
    let sheet = sheet(&even);
    let rig = Rig::before(Mount::Wrist, &sheet, 1);
    let found = even.find(&taken(&sheet, &rig.seen_by(0), 1)).unwrap();
    for order in even.orders(&found) {
        for (point, _) in &order {
            let is_one = found.iter().any(|(p, _)| (p.coords() - point.coords()).norm() < 1e-12);
            assert!(is_one, "{point:?}");
        }
    }
}
