//! Where a camera sits: planted and found again, on the wrist and fixed, with what is wrong in the poses, the squares and the
//! motions named.

use nalgebra::{Isometry3, SMatrix, UnitQuaternion, Vector3};
use trueup::alignment::boards::Target;
use trueup::alignment::chessboard::Board;
use trueup::alignment::hand_eye::table::{Error as TableError, Reading, Table};
use trueup::alignment::hand_eye::{Advice, Error, HandEye, Known, Mount, Options, View, solve};
use trueup::world::Pose;

use crate::rig::{Rig, Turns, all_sides};

fn exact(rig: &Rig) -> Known {
    Known { intrinsics: rig.intrinsics, covariance: SMatrix::zeros() }
}

fn options(board: Board, mount: Option<Mount>) -> Options {
    Options { board: Target::from(board), mount }
}

fn found(rig: &Rig, views: &[View]) -> Result<HandEye, Error> {
    solve(views, &exact(rig), &options(rig.board, Some(rig.mount)))
}

/// How far the camera is from where it truly is, m and rad.
fn error(rig: &Rig, answer: &HandEye) -> (f64, f64) {
    let far = answer.camera.pose.translation.vector - rig.camera.translation.vector;
    (far.norm(), answer.camera.pose.rotation.angle_to(&rig.camera.rotation))
}

#[test]
fn a_camera_on_the_wrist_and_a_fixed_one_are_found_and_told_apart() {
    for mount in [Mount::Wrist, Mount::Fixed] {
        let rig = Rig::new(mount, &all_sides(12));
        let views = rig.views(&rig.board, 3);
        let answer = solve(&views, &exact(&rig), &options(rig.board, None)).unwrap();
        assert_eq!(answer.mount, mount);
        let (other_rotation, _) = answer.other_mount.unwrap();
        assert!(other_rotation > 0.05, "{mount:?}: {other_rotation}");
        let (position, rotation) = error(&rig, &answer);
        // Noise of 0.3 mm and 0.03 deg in the poses, 0.1 px in the corners: 0.25 mm and 0.03 deg an axis are said.
        assert!(position < 1e-3 && rotation < 2.5e-3, "{mount:?}: {position} {rotation}");
        assert!(!answer.square.is_wrong, "{:?}", answer.square);
        assert!(answer.views.iter().all(|v| v.is_used));
        let (median, _, worst) = answer.leave_one_out().unwrap();
        assert!(median.position < 1e-3 && worst.1.position < 2e-3, "{median:?} {worst:?}");
        assert!((answer.picture_rms_px / 0.134 - 1.0).abs() < 0.1, "{}", answer.picture_rms_px);
    }
}

/// Inverse poses make a camera on the wrist a fixed one, and the other way round: only where it would be is odd.
#[test]
fn inverse_poses_are_doubted_by_where_the_camera_would_be() {
    for (mount, other) in [(Mount::Wrist, Mount::Fixed), (Mount::Fixed, Mount::Wrist)] {
        let rig = Rig::new(mount, &all_sides(12));
        let mut views = rig.views(&rig.board, 3);
        let doubts = |views: &[View], said: Option<Mount>| {
            let answer = solve(views, &exact(&rig), &options(rig.board, said)).unwrap();
            let advice = answer.advice();
            let is_inverse = |a: &&Advice| matches!(a, Advice::Inverse { .. });
            (answer.mount, advice.iter().find(is_inverse).map(ToString::to_string))
        };
        assert_eq!(doubts(&views, None), (mount, None));
        for view in &mut views {
            view.base_from_flange = Pose::new(view.base_from_flange.isometry().inverse());
        }
        let (found, told) = doubts(&views, None);
        assert_eq!(found, other);
        let told = told.unwrap();
        assert!(told.contains(&format!("say `--camera {}`", other.name())), "{told}");
        // Who says where the camera is knows.
        assert_eq!(doubts(&views, Some(other)), (other, None));
    }
}

#[test]
fn without_noise_nothing_is_left() {
    for mount in [Mount::Wrist, Mount::Fixed] {
        let mut rig = Rig::new(mount, &all_sides(6));
        rig.noise = (0.0, 0.0, 0.0);
        let answer = found(&rig, &rig.views(&rig.board, 1)).unwrap();
        let (position, rotation) = error(&rig, &answer);
        assert!(position < 1e-7 && rotation < 1e-7, "{mount:?}: {position} {rotation}");
        assert!(
            answer.spread < 1e-7 && answer.rms_px < 1e-4,
            "{} {}",
            answer.spread,
            answer.rms_px
        );
    }
}

/// The errors over the standard deviations that are said, over 40 drawings of the noise.
#[test]
fn the_standard_deviations_are_what_the_errors_are() {
    for mount in [Mount::Wrist, Mount::Fixed] {
        let rig = Rig::new(mount, &all_sides(12));
        let (mut sum, mut n) = (0.0, 0.0);
        let mut noise = 0.0;
        for seed in 0..40 {
            let answer = found(&rig, &rig.views(&rig.board, seed)).unwrap();
            let far = answer.camera.pose.translation.vector - rig.camera.translation.vector;
            let turn = (rig.camera.rotation.inverse() * answer.camera.pose.rotation).scaled_axis();
            for axis in 0..3 {
                sum += (far[axis] / answer.camera.std_position[axis]).powi(2);
                sum += (turn[axis] / answer.camera.std_rotation[axis]).powi(2);
                n += 2.0;
            }
            noise += answer.noise.position / 40.0;
        }
        // A mean of 240 squares, not all independent, of numbers of variance 1 (a little more, as the noise is estimated).
        let mean: f64 = sum / n;
        assert!((0.7..1.5).contains(&mean), "{mount:?}: {mean}");
        assert!((noise / rig.noise.2 - 1.0).abs() < 0.15, "{mount:?}: {noise}");
    }
}

#[test]
fn squares_of_another_size_are_named_and_measured() {
    for (mount, said) in [(Mount::Wrist, 0.035), (Mount::Fixed, 0.021), (Mount::Wrist, 0.0194)] {
        let rig = Rig::new(mount, &all_sides(12));
        let said = Board::new(9, 6, said).unwrap();
        let views = rig.views(&said, 5);
        let answer = solve(&views, &exact(&rig), &options(said, None)).unwrap();
        assert!(answer.square.is_wrong, "{said:?}: {:?}", answer.square);
        assert!(
            (answer.square.measured - 0.02).abs() < 4.0 * answer.square.std,
            "{:?}",
            answer.square
        );
        assert!(answer.square.std < 1e-4, "{:?}", answer.square);
        let told = answer.advice()[0].to_string();
        assert!(
            told.contains("the squares look like 20.0") || told.contains("look like 19.9"),
            "{told}"
        );
        let (position, _) = error(&rig, &answer);
        assert!(position < 2e-3, "{said:?}: {position}");
    }
}

/// Nobody is told of a wrong square whose squares are right: 40 drawings, noise of a bad arm.
#[test]
fn right_squares_are_not_doubted() {
    let mut rig = Rig::new(Mount::Wrist, &all_sides(10));
    rig.noise = (0.2, 5e-3, 2e-3);
    for seed in 0..40 {
        let answer = found(&rig, &rig.views(&rig.board, seed)).unwrap();
        assert!(!answer.square.is_wrong, "{seed}: {:?}", answer.square);
    }
}

#[test]
fn positions_in_another_unit_are_named() {
    let rig = Rig::new(Mount::Wrist, &all_sides(10));
    for times in [1000.0, 0.001, 100.0, 1.0 / 25.4, 1.0 / 0.0254, 0.0254] {
        let mut views = rig.views(&rig.board, 2);
        for view in &mut views {
            let mut pose = *view.base_from_flange.isometry();
            pose.translation.vector *= times;
            view.base_from_flange = Pose::new(pose);
        }
        match found(&rig, &views) {
            Err(Error::LengthUnit { times: told }) => {
                assert!((told / times - 1.0).abs() < 0.05, "{told}");
            }
            other => panic!("{times}: {other:?}"),
        }
    }
}

#[test]
fn motions_that_tell_nothing_are_refused_with_the_axis() {
    // The board is turned about the line of sight only, which is one axis of the flange.
    let one: Vec<Turns> = (0..8).map(|i| (0.4, 0.3, 0.2 * f64::from(i), 0.5)).collect();
    let rig = Rig::new(Mount::Wrist, &one);
    match found(&rig, &rig.views(&rig.board, 1)) {
        Err(Error::OneAxis { axis, about, across, .. }) => {
            let truth = rig.camera.rotation * Vector3::z();
            assert!(axis.dot(&truth).abs() > 0.999, "{axis}");
            assert!(about > 0.3 && across < 0.01, "{about} {across}");
        }
        other => panic!("{other:?}"),
    }
    let none: Vec<Turns> = (0..8).map(|i| (0.4, 0.3, 0.2, 0.4 + 0.02 * f64::from(i))).collect();
    let rig = Rig::new(Mount::Fixed, &none);
    let refused = found(&rig, &rig.views(&rig.board, 1));
    assert!(matches!(refused, Err(Error::NotTurned { .. })), "{refused:?}");
    let rig = Rig::new(Mount::Wrist, &all_sides(2));
    let refused = found(&rig, &rig.views(&rig.board, 1));
    assert_eq!(refused, Err(Error::TooFew { pictures: 2 }));
}

#[test]
fn small_turns_are_advised_against() {
    let turns: Vec<Turns> = (0..8)
        .map(|i| (0.3 + 0.06 * f64::from(i % 2), 0.8 * f64::from(i % 3), 0.25 * f64::from(i), 0.5))
        .collect();
    let rig = Rig::new(Mount::Wrist, &turns);
    let answer = found(&rig, &rig.views(&rig.board, 1)).unwrap();
    let advice = answer.advice();
    let few = |a: &Advice| matches!(a, Advice::Few { pictures: 8 });
    assert!(advice.iter().any(few), "{advice:?}");
    let turn = |a: &Advice| matches!(a, Advice::Turn { .. } | Advice::Unsure { .. });
    assert_eq!(
        advice.iter().any(turn),
        answer.motions.wanting().is_some() || answer.camera.std_position.max() > 5e-3
    );
}

#[test]
fn a_bad_pose_and_exchanged_rows_are_left_out_and_named() {
    for mount in [Mount::Wrist, Mount::Fixed] {
        let rig = Rig::new(mount, &all_sides(12));
        let mut views = rig.views(&rig.board, 4);
        let bad = *views[7].base_from_flange.isometry() * Isometry3::translation(0.0, 0.02, 0.0);
        views[7].base_from_flange = Pose::new(bad);
        let answer = found(&rig, &views).unwrap();
        let out: Vec<usize> = (0..12).filter(|&i| !answer.views[i].is_used).collect();
        assert_eq!(out, [7], "{mount:?}");
        assert!((answer.views[7].position - 0.02).abs() < 2e-3, "{:?}", answer.views[7]);
        assert_eq!(answer.views[7].row_of, None);

        let mut views = rig.views(&rig.board, 4);
        let (a, b) = (views[2].base_from_flange, views[9].base_from_flange);
        (views[2].base_from_flange, views[9].base_from_flange) = (b, a);
        let answer = found(&rig, &views).unwrap();
        let out: Vec<usize> = (0..12).filter(|&i| !answer.views[i].is_used).collect();
        assert_eq!(out, [2, 9], "{mount:?}");
        assert_eq!((answer.views[2].row_of, answer.views[9].row_of), (Some(9), Some(2)));
        let (position, rotation) = error(&rig, &answer);
        assert!(position < 1e-3 && rotation < 2.5e-3, "{mount:?}: {position} {rotation}");
        let told = answer.advice()[0].to_string();
        assert!(told.contains("the row of 9 fits it"), "{told}");
    }
}

/// Poses that are known to 0.02 mm put the right row beyond the cut: it was named for one of two exchanged pictures, or none.
#[test]
fn exchanged_rows_of_a_good_arm_are_named_both() {
    for mount in [Mount::Wrist, Mount::Fixed] {
        let mut rig = Rig::new(mount, &all_sides(10));
        rig.noise = (0.05, 2e-5, 2e-5);
        for (a, b) in [(1, 4), (2, 7), (3, 8)] {
            let mut views = rig.views(&rig.board, 4);
            let (of_a, of_b) = (views[a].base_from_flange, views[b].base_from_flange);
            (views[a].base_from_flange, views[b].base_from_flange) = (of_b, of_a);
            let answer = found(&rig, &views).unwrap();
            let named = (answer.views[a].row_of, answer.views[b].row_of);
            assert_eq!(named, (Some(b), Some(a)), "{mount:?}");
        }
        // Of a typing error the nearest row is far nearer than its own, and not right.
        let mut views = rig.views(&rig.board, 4);
        let typed = Isometry3::translation(2.0, 0.0, 0.0) * views[5].base_from_flange.isometry();
        views[5].base_from_flange = Pose::new(typed);
        let answer = found(&rig, &views).unwrap();
        assert_eq!((answer.views[5].is_used, answer.views[5].row_of), (false, None), "{mount:?}");
    }
}

#[test]
fn poses_that_do_not_belong_to_the_pictures_are_refused() {
    let rig = Rig::new(Mount::Wrist, &all_sides(10));
    let mut views = rig.views(&rig.board, 4);
    let poses: Vec<_> = views.iter().map(|v| v.base_from_flange).collect();
    for (i, view) in views.iter_mut().enumerate() {
        view.base_from_flange = poses[(3 * i + 4) % 10];
    }
    let refused = found(&rig, &views);
    assert!(matches!(refused, Err(Error::NoFit { .. })), "{refused:?}");
    let refused = solve(&views, &exact(&rig), &options(rig.board, None));
    assert!(matches!(refused, Err(Error::NoFit { .. })), "{refused:?}");
}

/// A board of 8 x 6 inner corners looks the same from both ends: its corners may come in either order.
#[test]
fn boards_that_look_alike_from_both_ends_are_put_in_one_order() {
    let mut rig = Rig::new(Mount::Wrist, &all_sides(10));
    rig.board = Board::new(8, 6, 0.02).unwrap();
    let mut views = rig.views(&rig.board, 6);
    for view in views.iter_mut().step_by(3) {
        let pixels: Vec<_> = view.points.iter().rev().map(|p| p.1).collect();
        view.points.iter_mut().zip(pixels).for_each(|(p, pixel)| p.1 = pixel);
    }
    let answer = found(&rig, &views).unwrap();
    assert!(answer.views.iter().all(|v| v.is_used), "{answer:?}");
    let (position, rotation) = error(&rig, &answer);
    assert!(position < 1e-3 && rotation < 2.5e-3, "{position} {rotation}");
    assert!(answer.rms_px < 1.0, "{}", answer.rms_px);
}

#[test]
fn a_table_is_read_in_each_form_and_other_readings_are_offered() {
    let turn = UnitQuaternion::from_euler_angles(0.3, -0.4, 0.5);
    let (v, (r, p, y)): (_, (f64, f64, f64)) = (turn.scaled_axis(), turn.euler_angles());
    let forms = [
        format!(
            "x[mm],y[mm],z[mm],qw,qx,qy,qz\n100,200,300,{},{},{},{}\n",
            turn.w, turn.i, turn.j, turn.k
        ),
        format!(
            "x[m],y[m],z[m],rx[rad],ry[rad],rz[rad],file\n0.1,0.2,0.3,{},{},{},a.png\n",
            v.x, v.y, v.z
        ),
        format!(
            "roll[deg],pitch[deg],yaw[deg],x[cm],y[m],z[m]\n{},{},{},10,0.2,0.3\n",
            r.to_degrees(),
            p.to_degrees(),
            y.to_degrees()
        ),
    ];
    for text in &forms {
        let table = Table::read(text).unwrap();
        let pose = table.poses()[0];
        assert!((pose.origin() - Vector3::new(0.1, 0.2, 0.3)).norm() < 1e-12, "{text}");
        assert!(pose.rotation().angle_to(&turn) < 1e-9, "{text}");
        assert_eq!(table.files.is_some(), text.contains("a.png"));
        let readings = table.readings();
        let offers = |wanted: Reading| readings.iter().any(|(reading, _)| *reading == wanted);
        assert!(offers(Reading::Inverse) && offers(Reading::Reversed), "{text}");
    }
    let wrong = |text: &str| Table::read(text).unwrap_err();
    assert!(matches!(
        wrong("x,y,z,qw,qx,qy,qz\n0,0,0,1,0,0,0"),
        TableError::Unit { column: "x", .. }
    ));
    assert!(matches!(wrong("x[m],y[m],z[m]\n0,0,0"), TableError::Rotation { .. }));
    assert!(matches!(
        wrong("x[m],y[m],z[m],rx[rad],ry[rad],rz[rad],qw\n"),
        TableError::Rotation { .. }
    ));
    assert!(matches!(
        wrong("x[m],y[m],rx[rad],ry[rad],rz[rad]\n0,0,0,0,0"),
        TableError::Missing { column: "z", .. }
    ));
    assert!(matches!(
        wrong("x[m],y[m],z[m],rx[mm],ry[rad],rz[rad]\n"),
        TableError::Unit { column: "rx", .. }
    ));
    assert!(matches!(
        wrong("x[m],y[m],z[m],qw,qx,qy,qz\n0,0,0,1,1,0,0"),
        TableError::Length { row: 1, .. }
    ));
    assert!(matches!(
        wrong("x[m],y[m],z[m],qw,qx,qy,qz\n0,0,nan,1,0,0,0"),
        TableError::Cell { .. }
    ));
    assert!(matches!(wrong("x[m],x[m],z[m],qw,qx,qy,qz\n"), TableError::Twice { .. }));
    assert!(matches!(wrong("x[m],y[m],z[m],qw,qx,qy,qz\n"), TableError::Empty));
    assert!(matches!(wrong(""), TableError::Empty));
    assert!(matches!(wrong("x[m],y[m],z[m],qw,qx,qy,qz\n0,0\n"), TableError::Csv { row: 1, .. }));
}
