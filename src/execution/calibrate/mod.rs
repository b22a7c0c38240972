//! The three regressions in use: from photographs of the table and of the arm to a [`Calibration`].
//!
//! Regression 1 aligns the camera by the table's printed dots, regression 2 fits its intrinsics to the same
//! points, regression 3 has the arm visit points and asks the camera where the marker ball on the gripper
//! is ([`arm`]). Each can be left out, to see what it is worth. The other fits are [`crate::alignment`]'s.

use std::panic::resume_unwind;
use std::thread::{JoinHandle, spawn};

use nalgebra::{Vector2, Vector3};

use crate::alignment::ball::{BallSighting, find_marker_ball};
use crate::alignment::camera_fit::{self, Refine, refine_camera};
use crate::alignment::image_map::{self, Pair, fit_map};
use crate::alignment::marks::find_marks;
use crate::world::frame::{Tool, World};
use crate::world::{Camera, Point, Pose, Scene, Window};

use super::calibration::Calibration;
use super::cell::Cell;
use super::context::ActionContext;
use super::error::ActionError;
use super::wording;
use crate::arm::Plate;
use crate::motion::robot::Marker;
use crate::trace::{Event, NoWay};

pub mod arm;

/// Which regressions are in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Switches {
    /// Regression 1: camera alignment.
    pub camera: bool,
    /// Regression 2: intrinsics.
    pub intrinsics: bool,
    /// Regression 3: robot offset.
    pub offset: bool,
}

impl Default for Switches {
    fn default() -> Self {
        Self { camera: true, intrinsics: true, offset: true }
    }
}

/// Why the regressions could not be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The arm or the camera failed.
    #[error("{0}")]
    Action(#[from] ActionError),
    /// A fit gives no answer.
    #[error("the camera cannot be aligned: {0}")]
    Fit(#[from] crate::alignment::Error),
    /// The picture cannot be used.
    #[error("the camera cannot be aligned: {0}")]
    Picture(#[from] crate::alignment::vision::Error),
    /// The arm carries nothing to be seen by.
    #[error("the camera cannot be aligned: the robot's side file describes no marker ball")]
    NoMarker,
    /// The arm's marker was seen too rarely.
    #[error(
        "the marker ball was seen at {seen} of {reached} points that the arm came to, of {visited} in all{}; the offset needs at \
         least {needed}", wording::outside_picture(*outside)
    )]
    Unseen {
        /// Where it was seen.
        seen: usize,
        /// Where it was looked for: the points that the arm came to.
        reached: usize,
        /// The points at which the camera does not see it, by where camera and arm are thought to be.
        outside: usize,
        /// The points that it was to come to, and these.
        visited: usize,
        /// How many are needed.
        needed: usize,
    },
}

/// Fits regressions 1 and 2, those that are switched on, and puts them in force on the action context. Nothing
/// moves.
///
/// # Errors
///
/// When too few reference points are found, a fit is degenerate, or the camera fails.
pub fn camera(context: &mut ActionContext, switches: Switches) -> Result<(), Error> {
    let scene = context.declared().scene.clone();
    let mut calibration = Calibration::nominal(&scene);
    if let Some(shot) = context.body().photo().map_err(ActionError::from)? {
        let photo = shot();
        let found = from_marks(&photo, &scene, switches)?;
        (calibration.camera, calibration.notes) = (found.camera, found.notes);
        calibration.left.camera_m = found.left_m;
    }
    in_force(context, calibration, 0)
}

/// Fits regression 3, if it is switched on, and puts it in force on the action context. The arm moves among what
/// was seen on the table, so it must have looked before.
///
/// # Errors
///
/// When the marker is seen too rarely, the fit is degenerate, or the arm or camera fails.
pub fn robot(context: &mut ActionContext, switches: Switches) -> Result<(), Error> {
    let Some(mut calibration) = context.body().calibration().cloned() else { return Ok(()) };
    let told = calibration.notes.len();
    if switches.offset {
        context.doubting(DOUBT, |context| align_robot(context, &mut calibration))?;
    } else {
        calibration.notes.push(wording::arm_left_out());
    }
    in_force(context, calibration, told)
}

/// Puts a calibration in force and tells its notes from number `told` on.
fn in_force(
    context: &mut ActionContext,
    calibration: Calibration,
    told: usize,
) -> Result<(), Error> {
    for text in &calibration.notes[told..] {
        context.tell(&Event::detail(text.as_str()));
    }
    Ok(context.calibrate(calibration)?)
}

/// What one photograph of the table's dots says of the camera.
#[derive(Debug, Clone, PartialEq)]
pub struct FromMarks {
    /// The camera, as far as the regressions that are in force adapt it.
    pub camera: Camera,
    /// What was fitted, in words.
    pub notes: Vec<String>,
    /// Root mean square distance along one axis of the table between a dot and where this camera sees it, m; `None` when
    /// nobody looked.
    pub left_m: Option<f64>,
}

/// Regressions 1 and 2 from one photograph of the table's dots.
///
/// # Errors
///
/// When too few dots are found or they do not determine the camera.
pub fn from_marks(
    photo: &image::RgbImage,
    scene: &Scene,
    switches: Switches,
) -> Result<FromMarks, Error> {
    let guess = scene.camera;
    // What a calibration says is known better than one picture of the table can tell.
    let is_lens_free = switches.intrinsics && scene.calibration.is_none();
    let mut notes = Vec::new();
    if !switches.camera && !is_lens_free {
        notes.push(wording::camera_left_out());
        return Ok(FromMarks { camera: guess, notes, left_m: None });
    }
    let sightings = find_marks(photo, scene, &guess)?;
    let on_table = |idx: usize| {
        let mark = &scene.marks[idx];
        Point::<World>::new(mark.x, mark.y, 0.0)
    };
    let pairs: Vec<Pair> = sightings
        .iter()
        .filter_map(|seen| {
            Some(Pair { real: seen.pixel, twin: guess.project(on_table(seen.mark_idx))? })
        })
        .collect();
    let map = fit_map(&pairs, image_map::Model::Projective, &image_map::Options::default())?;
    let points: Vec<_> = sightings
        .iter()
        .enumerate()
        .filter(|(i, _)| !map.outliers.contains(i))
        .map(|(_, seen)| camera_fit::Sighting {
            point: on_table(seen.mark_idx),
            pixel: seen.pixel,
            sigma: seen.sigma,
        })
        .collect();
    let (used, dots) = (points.len(), scene.marks.len());
    notes.push(wording::camera_aligned(used, dots, map.rms_px, switches.camera));
    let refine = match (switches.camera, is_lens_free) {
        (true, true) => Refine::all(),
        (true, false) => Refine::pose_only(),
        (false, _) => Refine::intrinsics_only(),
    };
    let fit = refine_camera(&guess, &points, &refine)?;
    let lens = &fit.camera.intrinsics;
    notes.push(wording::lens_fitted(lens, fit.rms_px, is_lens_free));
    let left_m = left_on_table(&fit.camera, &points);
    Ok(FromMarks { camera: fit.camera, notes, left_m })
}

/// Returns the root mean square, along one axis, of how far a camera puts points of the table from where they are, m.
fn left_on_table(camera: &Camera, points: &[camera_fit::Sighting]) -> Option<f64> {
    let square = |seen: &camera_fit::Sighting| {
        let at = camera.on_plane(seen.pixel, seen.point.coords().z)?;
        Some((at.coords() - seen.point.coords()).norm_squared())
    };
    let squares: Vec<f64> = points.iter().map(square).collect::<Option<_>>()?;
    let n = squares.len() as f64;
    (n > 0.0).then(|| (squares.iter().sum::<f64>() / (2.0 * n)).sqrt())
}

/// Stops after which more would say little: 24 numbers, for the 16 unknowns of [`arm`] (six of the base, seven zeros,
/// three of the gripper). With half of them there are fewer numbers than unknowns and the priors decide; with twice
/// as many the touch-off takes twice as long and goes through nearly all of the thirty points of [`visits`].
const WANTED: usize = 12;

/// How far an arm may be from where it says before regression 3, m: twice the most that was seen in the laboratory (8
/// to 19 mm, seeds 1 to 10 with `--without-regression 3`, `docs/results.md`). With half of it an arm that is a little
/// worse touches things on its way, with twice as much the things on the table leave it no point to visit.
pub const DOUBT: f64 = 0.04;

/// How far beyond its rim, px, a ball is measured, and as much again for what its picture is blurred by.
const BESIDE_PX: f64 = 8.0;

/// How long the arm rests before a photograph, s. Chosen: with half of it a hand that still swings is seen beside
/// where its joints say; twice as much adds 4 s to a calibration.
const REST: f64 = 0.3;
/// How fast the arm goes back, as a share of full speed. Chosen: nothing is in its hand; at half of it the way takes
/// twice as long, and more than 1 there is not.
const BACK_SPEED: f64 = 0.8;

/// Returns where in a picture a ball is that should be at `expected` and may be [`DOUBT`] beside it.
fn around(camera: &Camera, expected: Point<World>, radius: f64) -> Option<Window> {
    let (pixel, depth) = camera.project_with_depth(expected)?;
    let half = camera.intrinsics.fx.abs() / depth * (DOUBT + 2.0 * radius) + BESIDE_PX;
    Window::about(pixel, half, camera.intrinsics.width, camera.intrinsics.height)
}

/// Finds the marker ball in a photograph: where it is expected, and if it is not there, anywhere.
fn sighted(
    plate: &Plate,
    camera: &Camera,
    expected: Option<Window>,
    ball: &Marker,
) -> Option<BallSighting> {
    let look = |camera: &Camera, window| {
        find_marker_ball(&plate(window), camera, ball.radius, ball.colour)
    };
    let near = expected.and_then(|window| {
        let seen = look(&camera.within(&window), Some(window))?;
        Some(BallSighting { pixel: window.in_whole(seen.pixel), ..seen })
    });
    near.or_else(|| look(camera, None))
}

/// Regression 3: the arm visits points, the camera says where the marker ball is.
fn align_robot(context: &mut ActionContext, calibration: &mut Calibration) -> Result<(), Error> {
    let Cell { scene, robot, .. } = context.declared().clone();
    let (Some(ball), Some(marker)) = (robot.marker().copied(), robot.marker_in_flange()) else {
        return Err(Error::NoMarker);
    };
    let start = context.planned_q().to_vec();
    let mut stops = Vec::new();
    // The ball is looked for while the arm goes on.
    let mut looking: Option<JoinHandle<Option<arm::Stop>>> = None;
    let found = |looking: &mut Option<JoinHandle<_>>| {
        let stop = looking.take().map(JoinHandle::join)?;
        stop.unwrap_or_else(|panic| resume_unwind(panic))
    };
    let visits = visits(&scene);
    let visited = visits.len();
    let (mut reached, mut outside) = (0, 0);
    let marker_in_tool = robot.flange_from_tool().inverse() * marker;
    for (n, at) in visits.into_iter().enumerate() {
        if stops.len() + usize::from(looking.is_some()) >= WANTED {
            stops.extend(found(&mut looking));
        }
        if stops.len() >= WANTED {
            break;
        }
        context.tell(&Event::Progress {
            what: "touch-off".into(),
            fraction: (stops.len() as f64 / WANTED as f64).max(n as f64 / visited as f64),
        });
        let ball_at = at * marker_in_tool;
        let (camera, lens) = (calibration.camera, calibration.camera.intrinsics);
        let shown = camera.project(ball_at);
        outside += usize::from(shown.is_none_or(|pixel| !lens.contains(pixel)));
        if around(&camera, ball_at, ball.radius).is_none() {
            continue;
        }
        // A point that cannot be reached among the objects, or that the limits refuse, is passed over.
        match context.visit(&at) {
            Ok(()) => {}
            Err(ActionError::NoWay(_) | ActionError::Limit(_)) => continue,
            Err(error) => return Err(error.into()),
        }
        reached += 1;
        context.wait(REST)?;
        let Some(plate) = context.body().plate().map_err(ActionError::from)? else { continue };
        let q = context.reported_q()?;
        let expected = robot.forward(&q).ok().and_then(|base_from_flange| {
            around(&camera, scene.world_from_base * (base_from_flange * marker), ball.radius)
        });
        stops.extend(found(&mut looking));
        looking = Some(spawn(move || {
            let seen = sighted(&plate, &camera, expected, &ball)?;
            Some(arm::Stop { q, pixel: seen.pixel, sigma: seen.sigma })
        }));
    }
    stops.extend(found(&mut looking));
    // Back to where it hid nothing.
    context.move_to(&start, None, BACK_SPEED).map_err(|error| match error {
        ActionError::NoWay(no_way) => {
            ActionError::NoWay(NoWay { what: wording::back_from_touch_off(), ..no_way })
        }
        other => other,
    })?;
    if stops.len() < arm::NEEDED {
        let (seen, needed) = (stops.len(), arm::NEEDED);
        return Err(Error::Unseen { seen, reached, outside, visited, needed });
    }
    let fit = arm::fit_arm(
        &robot,
        scene.world_from_base,
        marker,
        &calibration.camera,
        &stops,
        &arm::Priors::default(),
    )?;
    let used = stops.len() - fit.outliers.len();
    calibration.notes.push(wording::arm_fitted(used, visited, &fit));
    calibration.reported_from_real = fit.reported_from_real;
    calibration.zeros = fit.zeros;
    calibration.tool_shift = fit.tool_shift.into();
    calibration.left.robot_m = Some(fit.std);
    Ok(())
}

/// Bearings of the points to visit from the base, rad, and their distances from it, m: on the table where a level
/// hand comes low and high (0.5 to 0.72 m, and 6 cm before it), and 32 deg to either side, which is 0.33 m across at
/// the far end, as wide as the marks on the table of the kitchen. Chosen: at half of it turns of the base are not
/// told from shifts; at twice it points are behind the arm or out of its reach (0.9 m with the arm straight).
const BEARINGS: [f64; 5] = [-0.55, -0.28, 0.0, 0.28, 0.55];
const DISTANCES: [f64; 3] = [0.44, 0.54, 0.64];
/// Heights of the points over the table, m, and how much higher the second round is. Chosen: from a grasp of a jar of
/// 14 cm lifted clear to where it is poured from; at half of it the hand is among the objects, at twice it the arm is
/// where it never works, and joint 4 ends where a level hand is 0.275 m high at 0.5 m (a base on the table). A point that
/// is out of reach is passed over. By inverse kinematics the stdlib's three arms reach 27 to 30 of the thirty from a base
/// 0.3 m below the table to 0.4 m over it.
const HEIGHTS: [f64; 3] = [0.17, 0.23, 0.29];
const HIGHER: f64 = 0.07;
/// Turns of the hand from its bearing, rad, and its pitches: a zero of a joint or a gripper beside its place shows
/// only when the hand turns. Chosen: 52 deg is what a grasp from aside or a pour has; at half of it shift and turn of
/// the gripper are told apart half as well, at twice it the hand points back to the base and the arm is in the
/// picture before its ball.
const ASIDE: [f64; 5] = [0.0, 0.9, -0.9, 0.45, -0.45];
const PITCHES: [f64; 2] = [0.0, 0.35];

/// Points over the table, near and far, left and right, low and high, the hand ahead and aside, level and
/// pitched down: as it will come to take and to pour, since an error is known where it was looked at.
fn visits(scene: &Scene) -> Vec<Pose<World, Tool>> {
    let base = scene.world_from_base.origin().xy();
    let mut visits = Vec::new();
    // The second round, higher and turned otherwise, is for what stands in the way of the first.
    for (round, higher) in [(0, 0.0), (1, HIGHER)] {
        for (i, bearing) in BEARINGS.into_iter().enumerate() {
            for (j, reach) in DISTANCES.into_iter().enumerate() {
                let height = HEIGHTS[(i + j) % HEIGHTS.len()] + higher;
                let aside = ASIDE[(2 * i + 3 * j + 2 * round) % ASIDE.len()];
                let pitch = PITCHES[(i + j) % PITCHES.len()];
                let at = base + reach * Vector2::new(bearing.cos(), bearing.sin());
                let at = Vector3::new(at.x, at.y, height);
                visits.push(super::plan::side_pose(at, bearing + aside, pitch));
            }
        }
    }
    visits
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{Intrinsics, Table};

    fn scene(base: Vector3<f64>) -> Scene {
        let (size, colour) = (Vector3::new(1.2, 0.8, 0.02), [200; 3]);
        let lens = Intrinsics::centred(900.0, 1280, 720);
        Scene {
            name: "bench".into(),
            table: Table { size, centre: [0.5, 0.0], colour },
            marks: Vec::new(),
            objects: Vec::new(),
            drawers: Vec::new(),
            camera_name: "overhead".into(),
            camera: Camera::looking(
                lens,
                Vector3::new(1.25, 0.0, 0.85),
                Vector3::new(0.6, 0.0, 0.05),
            ),
            person: None,
            calibration: None,
            robot: "gen3_2f85".into(),
            world_from_base: Pose::upright(base.x, base.y, base.z, 0.0),
        }
    }

    /// On a pedestal of 40 cm the hand was shown to a camera that looks at the table from beside it, where it saw none of 27 points;
    /// of a base 20 cm below the table all but four were in the table.
    #[test]
    fn points_are_over_the_table_wherever_the_base_is() {
        let on_table = visits(&scene(Vector3::zeros()));
        for z in [0.4, -0.2] {
            let base = Vector3::new(0.1, -0.2, z);
            for (at, level) in visits(&scene(base)).iter().zip(&on_table) {
                let by = at.origin() - level.origin();
                assert!((by - Vector3::new(0.1, -0.2, 0.0)).norm() < 1e-12, "{by}");
            }
        }
    }

    #[test]
    fn a_ball_that_may_be_at_the_rim_is_looked_for_and_one_far_outside_is_not() {
        let camera = scene(Vector3::zeros()).camera;
        let is_looked_for = |z: f64| around(&camera, Point::new(0.6, 0.0, z), 0.014).is_some();
        assert!(is_looked_for(0.2));
        // The picture ends at 0.49 m there.
        assert!(is_looked_for(0.50) && !is_looked_for(0.60));
    }
}
