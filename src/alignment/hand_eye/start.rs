//! Where the camera and the board are, roughly: from three pictures at a time, in closed form, whatever else is wrong.
//!
//! With `G` how a frame that the camera is fixed to moved between two pictures and `B` how the camera moved before the board,
//! `G X = X B`. Its turns are axes that belong together, `α = R β`; then its shifts are linear in the camera's place and in
//! the size of the squares. Of many triples the one that the median picture agrees with best is taken, so that up to
//! half of the rows may be wrong, and solved again with all that agree.
//!
//! Sources: Park and Martin, "Robot Sensor Calibration: Solving AX = XB on the Euclidean Group", 1994 (turns); Rousseeuw,
//! "Least Median of Squares Regression", 1984.

use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3,
};

use super::types::{Mount, off};
use crate::alignment::rigid::turn_between;

/// A camera and a board that roughly agree with the pictures.
#[derive(Debug, Clone)]
pub(super) struct Start {
    /// `carrier_from_camera`.
    pub(super) camera: Isometry3<f64>,
    /// `other_from_board`.
    pub(super) board: Isometry3<f64>,
    /// How many times as large the squares are as was said.
    pub(super) scale: f64,
    /// What the median picture is off by, rad.
    pub(super) rotation: f64,
    /// What the median picture is off by, m.
    pub(super) position: f64,
}

/// Triples that are tried at most. Chosen: all of 15 pictures; of more, with a third of the rows wrong, a good triple is
/// missed with a probability of 0.7^455.
const TRIPLES: usize = 455;
/// A turn and a part of the robot's travel that count alike: what is left of arms that are calibrated badly (measured on
/// a hobby arm: 0.4 deg, 2 mm of 150 mm).
const ALIKE: (f64, f64) = (0.007, 0.01);
/// Turns beyond this have an uncertain axis, rad: at half a turn both of its signs are right.
const LARGE: f64 = 2.8;
/// What the median picture may be off by: rad, and a part of the travel. Chosen: six times the worst arm measured.
const FITS: (f64, f64) = (0.04, 0.1);

impl Start {
    /// Returns whether half of the pictures agree at all.
    pub(super) fn fits(&self, travel: f64) -> bool {
        self.rotation < FITS.0 && self.position < FITS.1 * travel
    }

    /// Returns how badly the median picture agrees; 1 is what a bad arm leaves.
    pub(super) fn score(&self, travel: f64) -> f64 {
        size((self.rotation, self.position), travel)
    }

    /// Returns how badly one picture agrees, in the same measure.
    pub(super) fn off(
        &self,
        mount: Mount,
        flange: &Isometry3<f64>,
        board_from_camera: &Isometry3<f64>,
        travel: f64,
    ) -> f64 {
        let placed = (self.camera, self.board, self.scale);
        size(error(mount, flange, board_from_camera, &placed), travel)
    }
}

/// Rotation and position together; 1 is what a bad arm leaves.
fn size((rotation, position): (f64, f64), travel: f64) -> f64 {
    (rotation / ALIKE.0).hypot(position / (ALIKE.1 * travel))
}

/// Finds camera and board from `base_from_flange` and `board_from_camera` of each picture; `None` when no three determine them.
pub(super) fn search(
    mount: Mount,
    robot: &[Isometry3<f64>],
    boards: &[Isometry3<f64>],
    travel: f64,
) -> Option<Start> {
    let n = robot.len();
    let all: Vec<[usize; 3]> =
        (0..n).flat_map(|i| (0..i).flat_map(move |j| (0..j).map(move |k| [i, j, k]))).collect();
    // Every so many of them, which mixes far and near ones without chance.
    let step = all.len().div_ceil(TRIPLES).max(1);
    let triples = all.iter().step_by(step);
    let solve = |some: &[usize]| {
        let (camera, board, scale) = closed(mount, robot, boards, some)?;
        let each = errors(mount, robot, boards, &(camera, board, scale));
        let size = |e: &(f64, f64)| size(*e, travel);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| size(&each[a]).total_cmp(&size(&each[b])));
        let middle = order[n / 2];
        let (mut turns, mut shifts): (Vec<f64>, Vec<f64>) = each.iter().copied().unzip();
        turns.sort_by(f64::total_cmp);
        shifts.sort_by(f64::total_cmp);
        let (rotation, position) = (turns[n / 2], shifts[n / 2]);
        let near = size(&each[middle]).max(1.0);
        let agreeing: Vec<usize> =
            order.into_iter().filter(|&i| size(&each[i]) <= 3.0 * near).collect();
        Some((Start { camera, board, scale, rotation, position }, agreeing))
    };
    let mut best: Option<(Start, Vec<usize>)> = None;
    for triple in triples {
        let Some(found) = solve(triple) else { continue };
        if best.as_ref().is_none_or(|(b, _)| found.0.score(travel) < b.score(travel)) {
            best = Some(found);
        }
    }
    let (mut best, mut agreeing) = best?;
    for _ in 0..3 {
        let Some((next, more)) = solve(&agreeing) else { break };
        // Three pictures can fit the median one by luck; all that agree say more.
        if next.score(travel) > 2.0 * best.score(travel).max(1.0) {
            break;
        }
        (best, agreeing) = (next, more);
    }
    Some(best)
}

/// Rotation (rad) and position (m) that each picture is off by.
fn errors(
    mount: Mount,
    robot: &[Isometry3<f64>],
    boards: &[Isometry3<f64>],
    placed: &(Isometry3<f64>, Isometry3<f64>, f64),
) -> Vec<(f64, f64)> {
    robot.iter().zip(boards).map(|(flange, b)| error(mount, flange, b, placed)).collect()
}

/// Rotation (rad) and position (m) that a picture is off by.
fn error(
    mount: Mount,
    flange: &Isometry3<f64>,
    board_from_camera: &Isometry3<f64>,
    (camera, board, scale): &(Isometry3<f64>, Isometry3<f64>, f64),
) -> (f64, f64) {
    let mut b = *board_from_camera;
    b.translation.vector *= *scale;
    let e = off(mount, flange, camera, board, &b);
    (e.rotation.angle(), e.translation.vector.norm())
}

/// Solves `G X = X B` for some pictures, with the size of the squares free.
fn closed(
    mount: Mount,
    robot: &[Isometry3<f64>],
    boards: &[Isometry3<f64>],
    some: &[usize],
) -> Option<(Isometry3<f64>, Isometry3<f64>, f64)> {
    let moved = |i: usize| match mount {
        Mount::Wrist => robot[i],
        Mount::Fixed => robot[i].inverse(),
    };
    let (mut pairs, mut motions) = (Vec::new(), Vec::new());
    for &i in some {
        for &j in some {
            if i == j {
                continue;
            }
            let g = moved(j).inverse() * moved(i);
            let b = boards[j].inverse() * boards[i];
            if g.rotation.angle().max(b.rotation.angle()) < LARGE {
                pairs.push((b.rotation.scaled_axis(), g.rotation.scaled_axis()));
            }
            motions.push((g, b));
        }
    }
    let turn = turn_between(&pairs)?;
    let mut a = DMatrix::zeros(3 * motions.len(), 4);
    let mut rest = DVector::zeros(3 * motions.len());
    for (k, (g, b)) in motions.iter().enumerate() {
        let lever = g.rotation.to_rotation_matrix().into_inner() - Matrix3::identity();
        a.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&lever);
        a.fixed_view_mut::<3, 1>(3 * k, 3).copy_from(&-(turn * b.translation.vector));
        rest.fixed_rows_mut::<3>(3 * k).copy_from(&-g.translation.vector);
    }
    // In units in which both kinds of unknowns are about 1.
    let size = a.column(3).norm().max(f64::MIN_POSITIVE);
    let lever = a.columns(0, 3).norm().max(f64::MIN_POSITIVE);
    a.column_mut(3).scale_mut(1.0 / size);
    a.columns_mut(0, 3).scale_mut(1.0 / lever);
    let svd = a.svd(true, true);
    let found = svd.solve(&rest, 1e-9 * svd.singular_values.max()).ok()?;
    let scale = found[3] / size;
    if !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    let place = Vector3::new(found[0], found[1], found[2]) / lever;
    let camera = Isometry3::from_parts(Translation3::from(place), turn);
    let board = board_of(&camera, scale, some.iter().map(|&i| (moved(i), boards[i])))?;
    Some((camera, board, scale))
}

/// The board's mean place, given the camera's.
fn board_of(
    camera: &Isometry3<f64>,
    scale: f64,
    pictures: impl Iterator<Item = (Isometry3<f64>, Isometry3<f64>)>,
) -> Option<Isometry3<f64>> {
    let (mut turns, mut place, mut n) =
        (Quaternion::<f64>::from_parts(0.0, Vector3::zeros()), Vector3::zeros(), 0.0);
    for (carrier, mut b) in pictures {
        b.translation.vector *= scale;
        let board = carrier * camera * b.inverse();
        let q = board.rotation.into_inner();
        turns += if turns.dot(&q) < 0.0 { -q } else { q };
        place += board.translation.vector;
        n += 1.0;
    }
    let turn = UnitQuaternion::try_new(turns, 1e-9)?;
    Some(Isometry3::from_parts(Translation3::from(place / n), turn))
}
