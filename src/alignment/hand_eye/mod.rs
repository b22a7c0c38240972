//! Hand-eye calibration: where a camera sits on a robot's wrist, or beside the robot, from pictures of a board and the robot's
//! pose at each.
//!
//! A camera on the wrist looks at a board that stays where it is (`base_from_flange X = base_from_board B`, with
//! `X = flange_from_camera` and `B = board_from_camera`); a fixed one at a board in the hand, the same with the flange's poses
//! inverted. [`table`] reads the poses, [`solve`] fits. First each picture alone gives `B` with its covariance (`board.rs`), three
//! pictures at a time a rough answer that half of the rows may spoil (`start.rs`); then everything is fitted together
//! (`refine.rs`): `X`, the board, the camera's own numbers as far as its calibration leaves them open, and the noise of the robot's
//! poses beside that of the corners. `judge.rs` leaves out each picture in turn, and measures the squares by the robot's
//! travel. `motions.rs` refuses what motions cannot tell. Finding corners and intrinsics is [`super::chessboard`]'s and
//! [`super::intrinsics`]' work.

mod board;
mod error;
mod judge;
mod motions;
mod noise;
mod refine;
mod start;
pub mod table;
mod types;
mod wording;

use nalgebra::Isometry3;

pub use error::Error;
pub use motions::Motions;
pub use types::{
    Corners, HandEye, Known, LeftOut, Mount, Noise, Options, Placed, Square, View, ViewFit,
};
pub use wording::Advice;

use board::Sight;
use refine::Refine;
use start::Start;

/// Finds where the camera is.
///
/// # Errors
///
/// [`Error`]: too few pictures or turns, poses that do not belong to the pictures or are in another unit, a mount
/// that cannot be told.
pub fn solve(views: &[View], camera: &Known, options: &Options) -> Result<HandEye, Error> {
    if views.len() < 3 {
        return Err(Error::TooFew { pictures: views.len() });
    }
    let robot: Vec<Isometry3<f64>> = views.iter().map(|v| *v.base_from_flange.isometry()).collect();
    for mount in options.mount.map_or(vec![Mount::Wrist, Mount::Fixed], |mount| vec![mount]) {
        Motions::of(mount, &robot).checked(mount)?;
    }
    let mut sights = sights(views, &robot, camera, options)?;
    let boards: Vec<_> = sights.iter().map(|s| s.board_from_camera).collect();
    let lever = lever(&robot, &boards);
    let Mounted { mount, start, other: other_mount } = mounted(&robot, &boards, lever, options)?;
    lean(&mut sights, &robot, mount, &start, lever);
    let problem = Refine::new(mount, &robot, &sights, camera, &options.board);
    let free = problem.fit(&start, lever, true)?;
    let square = problem.square(&free);
    if let Some(times) = square.other_unit() {
        return Err(Error::LengthUnit { times });
    }
    let fitted = if square.is_wrong { free } else { problem.fit(&start, lever, false)? };
    let kept: Vec<_> = (0..robot.len()).filter(|&i| fitted.is_used(i)).map(|i| robot[i]).collect();
    let motions = Motions::of(mount, &kept).checked(mount)?;
    Ok(problem.answer(views, &fitted, square, motions, other_mount))
}

/// Looks at every picture, with its corners in the order that goes with the others.
fn sights(
    views: &[View],
    robot: &[Isometry3<f64>],
    camera: &Known,
    options: &Options,
) -> Result<Vec<Sight>, Error> {
    let mut all = Vec::with_capacity(views.len());
    for view in views {
        let each = options.board.orders(&view.points);
        let seen: Option<Vec<Sight>> =
            each.iter().map(|points| board::sight(points, &camera.intrinsics)).collect();
        all.push(seen.ok_or_else(|| Error::NoBoard { picture: view.name.clone() })?);
    }
    // A turn between two pictures is as large for the robot as for the camera: the order of corners that makes it so is
    // the right one, up to a turn of the whole board. The picture that most others agree with is the first.
    let apart = |i: usize, j: usize, order: usize| {
        let turned = all[i][0]
            .board_from_camera
            .rotation
            .angle_to(&all[j][order].board_from_camera.rotation);
        (turned - robot[i].rotation.angle_to(&robot[j].rotation)).abs()
    };
    let best = |i: usize, j: usize| {
        let orders = 0..all[j].len();
        orders.min_by(|&a, &b| apart(i, j, a).total_cmp(&apart(i, j, b))).unwrap_or(0)
    };
    let wrong = |i: usize| (0..all.len()).map(|j| apart(i, j, best(i, j)).min(0.1)).sum::<f64>();
    let first = (0..all.len()).min_by(|&a, &b| wrong(a).total_cmp(&wrong(b))).unwrap_or(0);
    Ok((0..all.len()).map(|j| all[j][best(first, j)].clone()).collect())
}

/// A board leans as it fits the corners best, or to the other side where that fits nearly as well and the robot says so: a small
/// part of a board, or one far away, does not tell.
fn lean(sights: &mut [Sight], robot: &[Isometry3<f64>], mount: Mount, start: &Start, lever: f64) {
    let noise = board::noise(sights);
    for (sight, flange) in sights.iter_mut().zip(robot) {
        let own = start.off(mount, flange, &sight.board_from_camera, lever);
        let squares = sight.squares;
        let is_alike = |other: &Sight| other.squares - squares < (refine::CUT * noise).powi(2);
        let Some(other) = sight.mirrored.take_if(|other| is_alike(other)) else { continue };
        if start.off(mount, flange, &other.board_from_camera, lever) < own {
            *sight = *other;
        }
    }
}

/// A length of the order of the robot's motions, m; not nothing where it only turned.
fn lever(robot: &[Isometry3<f64>], boards: &[Isometry3<f64>]) -> f64 {
    let travel = Motions::of(Mount::Wrist, robot).travel;
    let n = boards.len().max(1) as f64;
    let far = boards.iter().map(|b| b.translation.vector.norm()).sum::<f64>() / n;
    // Chosen: a tenth of the distance to the board is moved by a turn of 6 deg.
    travel.max(0.1 * far)
}

/// Two mounts that fit within this ratio of each other are alike. Chosen: the wrong one was 5 to 40 times worse on every
/// set of pictures tried.
const ALIKE: f64 = 2.0;

/// Which mount, where camera and board roughly are, and what the median picture is off by with the other mount (rad, m).
struct Mounted {
    mount: Mount,
    start: Start,
    other: Option<(f64, f64)>,
}

/// Finds the mount, if it was not said, and roughly where camera and board are.
fn mounted(
    robot: &[Isometry3<f64>],
    boards: &[Isometry3<f64>],
    lever: f64,
    options: &Options,
) -> Result<Mounted, Error> {
    let tried = |mount| start::search(mount, robot, boards, lever);
    let error = |mount, found: Option<&Start>| {
        let off = found.map_or((std::f64::consts::PI, lever), |s| (s.rotation, s.position));
        Error::NoFit { mount, rotation: off.0, position: off.1 }
    };
    if let Some(mount) = options.mount {
        return match tried(mount) {
            Some(start) if start.fits(lever) => Ok(Mounted { mount, start, other: None }),
            found => Err(error(mount, found.as_ref())),
        };
    }
    let (wrist, fixed) = (tried(Mount::Wrist), tried(Mount::Fixed));
    let score = |s: &Option<Start>| s.as_ref().map_or(f64::INFINITY, |s| s.score(lever));
    let is_wrist = score(&wrist) <= score(&fixed);
    let (mount, best, other) =
        if is_wrist { (Mount::Wrist, wrist, fixed) } else { (Mount::Fixed, fixed, wrist) };
    let Some(best) = best.filter(|s| s.fits(lever)) else {
        return Err(error(mount, None));
    };
    let of = |s: &Start| (s.rotation, s.position);
    if let Some(other) = &other
        && other.fits(lever)
        && other.score(lever) < ALIKE * best.score(lever)
    {
        let (wrist, fixed) = if is_wrist { (of(&best), of(other)) } else { (of(other), of(&best)) };
        return Err(Error::WhichMount { wrist, fixed });
    }
    let other = other.as_ref().map(of);
    Ok(Mounted { mount, start: best, other })
}
