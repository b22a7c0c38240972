//! Where one picture of a board was taken from, how sure that is, and how it changes with the camera's own numbers.
//!
//! In comes the corners of one picture; out comes `board_from_camera`, its covariance for corners that are off by one pixel, and
//! its change with the intrinsics. These three are all that the corners say of a camera whose numbers are nearly right: the
//! fit over all pictures needs no corner again.

use nalgebra::{
    Isometry3, Matrix3, Matrix6, SMatrix, Translation3, UnitQuaternion, Vector3, Vector6,
};

use super::types::Corners;
use crate::alignment::image_map::{self, Model, NoiseIn, Pair};
use crate::alignment::intrinsics::pose_from_homography;
use crate::alignment::reprojection::{INTRINSIC, POSE, Reprojection, Seen};
use crate::fit::{self, Jacobian, Problem as _};
use crate::world::{Intrinsics, Pixel, Pose, frame};

/// What one picture of the board says.
#[derive(Debug, Clone)]
pub(super) struct Sight {
    /// Where it was taken from, in board coordinates.
    pub(super) board_from_camera: Isometry3<f64>,
    /// Covariance of a turn (camera axes, rad) and a shift (board axes, m) of it, for corners off by 1 px.
    pub(super) covariance: Matrix6<f64>,
    /// How turn and shift follow the camera's numbers.
    pub(super) by_camera: SMatrix<f64, POSE, INTRINSIC>,
    /// Sum of the corners' squared distances from where they should be, px².
    pub(super) squares: f64,
    /// How many corners are seen.
    pub(super) corners: usize,
    /// The middle of those that are seen, in board coordinates, m: there the picture says best where the board is.
    pub(super) middle: Vector3<f64>,
    /// The same corners seen on a board that leans to the other side, where that fits too.
    pub(super) mirrored: Option<Box<Sight>>,
}

impl Sight {
    /// Returns where the picture was taken from if squares are `scale` times as large and turn and shift are added.
    pub(super) fn moved(&self, change: &Vector6<f64>, scale: f64) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(change[0], change[1], change[2]));
        let shift = Vector3::new(change[3], change[4], change[5]);
        let place = (self.board_from_camera.translation.vector + shift) * scale;
        Isometry3::from_parts(Translation3::from(place), self.board_from_camera.rotation * turn)
    }
}

/// Looks at the corners of one picture; `None` when they are not those of a plane before the camera.
pub(super) fn sight(points: &Corners, camera: &Intrinsics) -> Option<Sight> {
    let start = first(points, camera)?;
    // A plane that leans the other way looks nearly the same from afar; the better of both minima counts.
    let mirrored = mirrored(points, &start);
    let mut fits: Vec<Sight> = [start, mirrored]
        .into_iter()
        .filter_map(|pose| polished(points, camera, pose))
        .filter_map(|(problem, fit)| at_minimum(points, camera, &problem, &fit))
        .collect();
    fits.sort_by(|a, b| a.squares.total_cmp(&b.squares));
    let mut fits = fits.into_iter();
    let best = fits.next()?;
    let turned =
        |other: &Sight| other.board_from_camera.rotation.angle_to(&best.board_from_camera.rotation);
    let mirrored = fits.next().filter(|other| turned(other) > SAME).map(Box::new);
    Some(Sight { mirrored, ..best })
}

/// Minima that are turned by less than this against each other are one, rad. Chosen: far above what a fit stops at, and below
/// what any corner's noise turns a board by.
const SAME: f64 = 1e-4;

/// What a minimum says: its pose, how sure that is, and how it follows the camera's numbers.
fn at_minimum(
    points: &Corners,
    camera: &Intrinsics,
    problem: &Reprojection,
    fit: &fit::Fit,
) -> Option<Sight> {
    let pose = problem.pose(&fit.x, 0);
    // The derivatives at the place found, where turn and shift are 0.
    let there = Reprojection { poses: vec![pose], seen: problem.seen.clone(), ..*problem };
    let x = there.start(camera);
    let mut jacobian = Jacobian::zeros(2 * points.len(), INTRINSIC + POSE);
    there.jacobian(&x, &mut jacobian);
    let mut normal = Matrix6::zeros();
    let mut mixed = SMatrix::<f64, POSE, INTRINSIC>::zeros();
    for row in 0..2 * points.len() {
        let row = jacobian.row(row);
        let by_pose = Vector6::from_row_slice(&row[INTRINSIC..]);
        let by_camera = SMatrix::<f64, 1, INTRINSIC>::from_row_slice(&row[..INTRINSIC]);
        normal += by_pose * by_pose.transpose();
        mixed += by_pose * by_camera;
    }
    let covariance = normal.try_inverse()?;
    if !covariance.iter().all(|v| v.is_finite()) {
        return None;
    }
    Some(Sight {
        board_from_camera: *pose.isometry(),
        covariance,
        by_camera: -covariance * mixed,
        squares: fit.residuals.iter().map(|r| r * r).sum(),
        corners: points.len(),
        middle: middle(points),
        mirrored: None,
    })
}

/// The noise of a corner's coordinate, px, by what is left of all pictures.
pub(super) fn noise(sights: &[Sight]) -> f64 {
    let corners: usize = sights.iter().map(|s| s.corners).sum();
    let squares: f64 = sights.iter().map(|s| s.squares).sum();
    // Each picture's pose takes six of its coordinates.
    let rest = (2 * corners).saturating_sub(6 * sights.len()).max(1) as f64;
    // Corners without noise leave rounding; below this nothing is measured.
    (squares / rest).sqrt().max(1e-4)
}

/// The middle of points, m.
fn middle(points: &Corners) -> Vector3<f64> {
    let n = points.len().max(1) as f64;
    points.iter().map(|(p, _)| p.coords()).sum::<Vector3<f64>>() / n
}

/// The pose by the map from the board's plane to the picture without its lens.
fn first(points: &Corners, camera: &Intrinsics) -> Option<Pose<frame::World, frame::Camera>> {
    let pair = |(point, pixel): &(crate::world::Point<frame::World>, Pixel)| {
        let (n, p) = (camera.normalise(*pixel), point.coords());
        Pair { real: Pixel::new(n.x, n.y), twin: Pixel::new(p.x, p.y) }
    };
    let pairs: Vec<Pair> = points.iter().map(pair).collect();
    let options = image_map::Options { robust: false, noise: NoiseIn::Real, seed: 0 };
    let map = image_map::fit_map(&pairs, Model::Projective, &options).ok()?;
    pose_from_homography(&Matrix3::identity(), &map.m)
}

/// The pose from which the board leans by as much to the other side of the line of sight.
///
/// Source: Schweighofer and Pinz, "Robust Pose Estimation from a Planar Target", PAMI 2006, §3.
fn mirrored(
    points: &Corners,
    pose: &Pose<frame::World, frame::Camera>,
) -> Pose<frame::World, frame::Camera> {
    let middle = middle(points);
    let camera_from_board = pose.isometry().inverse();
    let sight = camera_from_board * nalgebra::Point3::from(middle);
    let (normal, along) = (camera_from_board.rotation * Vector3::z(), sight.coords);
    let along = along.normalize() * normal.dot(&along).signum();
    let turn = UnitQuaternion::rotation_between(&normal, &along)
        .map_or_else(UnitQuaternion::identity, |half| half * half);
    let rotation = turn * camera_from_board.rotation;
    let place = sight.coords - rotation * middle;
    Pose::new(Isometry3::from_parts(Translation3::from(place), rotation).inverse())
}

fn polished(
    points: &Corners,
    camera: &Intrinsics,
    pose: Pose<frame::World, frame::Camera>,
) -> Option<(Reprojection, fit::Fit)> {
    let seen = points.iter().map(|(point, pixel)| Seen {
        view: 0,
        point: point.coords(),
        pixel: *pixel,
        sigma: 1.0,
    });
    let size = (camera.width, camera.height);
    let lens = camera.model;
    let problem =
        Reprojection { seen: seen.collect(), poses: vec![pose], aspect: None, size, lens };
    let options = fit::Options { fixed: (0..INTRINSIC).collect(), ..fit::Options::default() };
    let fit = fit::solve(&problem, &problem.start(camera), &options).ok()?;
    Some((problem, fit))
}
