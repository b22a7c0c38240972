//! The three regressions in use: from photographs of the table and of the arm to a [`Calibration`].
//!
//! Regression 1 aligns the camera by the table's printed dots, regression 2 fits its intrinsics to the same
//! points, regression 3 has the arm visit points and asks the camera where the marker ball on the gripper
//! is ([`arm`]). Each can be left out, to see what it is worth. The other fits are [`crate::alignment`]'s.

use std::panic::resume_unwind;
use std::thread::{JoinHandle, spawn};

use crate::alignment::ball::{BallSighting, find_marker_ball};
use crate::alignment::camera_fit::{self, Refine, refine_camera};
use crate::alignment::image_map::{self, Pair, fit_map};
use crate::alignment::marks::find_marks;
use crate::world::frame::{Flange, Tool, World};
use crate::world::{Camera, Point, Pose, Scene, Window};

use super::calibration::Calibration;
use super::cell::Cell;
use super::context::ActionContext;
use super::error::ActionError;
use super::wording;
use crate::arm::Plate;
use crate::motion::robot::{Marker, Robot};
use crate::trace::{Event, NoWay, Why};

pub mod arm;
mod visited;
mod visits;

pub use visited::Visited;
use visits::{Visit, visits};

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
    #[error("{}", wording::seen_too_rarely(.0))]
    Unseen(Visited),
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
    notes.push(wording::lens_fitted(&fit, is_lens_free));
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
/// as many the touch-off takes twice as long and goes through nearly all of the thirty points of [`visits()`].
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

/// Whether the arm came to a point to visit, and if not, why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Came {
    There,
    /// The ball would be outside the picture, so it was not tried.
    Outside,
    OutOfReach,
    /// Something is in the way, or the limits refuse the way there.
    InTheWay,
}

/// What became of a point to visit.
#[derive(Debug, Clone, Copy)]
struct Tried {
    came: Came,
    /// Whether the ball is in the picture there, by where camera and arm are thought to be.
    is_shown: bool,
}

/// A touch-off under way.
struct TouchOff<'a> {
    robot: &'a Robot,
    scene: &'a Scene,
    camera: Camera,
    ball: Marker,
    /// The middle of the ball.
    marker: Point<Flange>,
    marker_in_tool: Point<Tool>,
    stops: Vec<arm::Stop>,
    /// The ball is looked for while the arm goes on.
    looking: Option<JoinHandle<Option<arm::Stop>>>,
}

impl TouchOff<'_> {
    /// Waits for what was seen last.
    fn look(&mut self) {
        if let Some(looking) = self.looking.take() {
            self.stops.extend(looking.join().unwrap_or_else(|panic| resume_unwind(panic)));
        }
    }

    /// Whether there are as many stops as are wanted.
    fn is_enough(&mut self) -> bool {
        if self.stops.len() + usize::from(self.looking.is_some()) >= WANTED {
            self.look();
        }
        self.stops.len() >= WANTED
    }

    /// Tells how much is done after so many points of all.
    fn tell(&self, context: &ActionContext, n: usize, points: usize) {
        context.tell(&Event::Progress {
            what: "touch-off".into(),
            fraction: (self.stops.len() as f64 / WANTED as f64).max(n as f64 / points as f64),
        });
    }

    /// Brings the tool to a pose and begins to look for the ball. A pose whose ball is outside the picture is passed over, and
    /// so is one that cannot be reached among the objects, or that the limits refuse.
    fn visit(
        &mut self,
        context: &mut ActionContext,
        at: &Pose<World, Tool>,
    ) -> Result<Tried, Error> {
        let (camera, ball, marker) = (self.camera, self.ball, self.marker);
        let ball_at = *at * self.marker_in_tool;
        let shown = camera.project(ball_at);
        let is_shown = shown.is_some_and(|pixel| camera.intrinsics.contains(pixel));
        let tried = |came| Ok(Tried { came, is_shown });
        if around(&camera, ball_at, ball.radius).is_none() {
            return tried(Came::Outside);
        }
        match context.visit(at) {
            Ok(()) => {}
            Err(ActionError::NoWay(NoWay { why: Why::OutOfReach { .. }, .. })) => {
                return tried(Came::OutOfReach);
            }
            Err(ActionError::NoWay(_) | ActionError::Limit(_)) => return tried(Came::InTheWay),
            Err(error) => return Err(error.into()),
        }
        context.wait(REST)?;
        let Some(plate) = context.body().plate().map_err(ActionError::from)? else {
            return tried(Came::There);
        };
        let q = context.reported_q()?;
        let expected = self.robot.forward(&q).ok().and_then(|base_from_flange| {
            let world_from_base = self.scene.world_from_base;
            around(&camera, world_from_base * (base_from_flange * marker), ball.radius)
        });
        self.look();
        self.looking = Some(spawn(move || {
            let seen = sighted(&plate, &camera, expected, &ball)?;
            Some(arm::Stop { q, pixel: seen.pixel, sigma: seen.sigma })
        }));
        tried(Came::There)
    }

    /// Has the arm visit points; returns what became of each.
    fn go_round(
        &mut self,
        context: &mut ActionContext,
        visits: &[Visit],
    ) -> Result<Vec<Tried>, Error> {
        let mut all = Vec::with_capacity(visits.len());
        for (n, visit) in visits.iter().enumerate() {
            if self.is_enough() {
                break;
            }
            self.tell(context, n, visits.len());
            all.push(self.visit(context, &visit.level())?);
        }
        self.look();
        if self.stops.len() >= arm::NEEDED {
            return Ok(all);
        }
        // An arm that points down whatever it does takes none of these: a steep hand, where it was not level.
        for (n, (visit, tried)) in visits.iter().zip(&mut all).enumerate() {
            if tried.came == Came::There {
                continue;
            }
            if self.is_enough() {
                break;
            }
            self.tell(context, n, visits.len());
            for at in visit.steep(self.marker_in_tool, &self.camera) {
                let steep = self.visit(context, &at)?;
                if steep.came != Came::Outside {
                    *tried = steep;
                }
                if steep.came == Came::There {
                    break;
                }
            }
        }
        self.look();
        Ok(all)
    }
}

/// Regression 3: the arm visits points, the camera says where the marker ball is.
fn align_robot(context: &mut ActionContext, calibration: &mut Calibration) -> Result<(), Error> {
    let Cell { scene, robot, .. } = context.declared().clone();
    let (Some(ball), Some(marker)) = (robot.marker().copied(), robot.marker_in_flange()) else {
        return Err(Error::NoMarker);
    };
    let start = context.planned_q()?.to_vec();
    let visits = visits(&scene);
    let mut touch_off = TouchOff {
        robot: &robot,
        scene: &scene,
        camera: calibration.camera,
        ball,
        marker,
        marker_in_tool: robot.flange_from_tool().inverse() * marker,
        stops: Vec::new(),
        looking: None,
    };
    let tried = touch_off.go_round(context, &visits)?;
    let stops = touch_off.stops;
    // Back to where it hid nothing.
    context.move_to(&start, None, BACK_SPEED).map_err(|error| match error {
        ActionError::NoWay(no_way) => {
            ActionError::NoWay(NoWay { what: wording::back_from_touch_off(), ..no_way })
        }
        other => other,
    })?;
    if stops.len() < arm::NEEDED {
        return Err(Error::Unseen(visited(&tried, stops.len())));
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
    calibration.notes.push(wording::arm_fitted(used, visits.len(), &fit));
    calibration.reported_from_real = fit.reported_from_real;
    calibration.zeros = fit.zeros;
    calibration.tool_shift = fit.tool_shift.into();
    calibration.left.robot_m = Some(fit.std);
    Ok(())
}

/// Counts what became of the points, the ball seen at `seen` of them.
fn visited(tried: &[Tried], seen: usize) -> Visited {
    let count = |is: &dyn Fn(&Tried) -> bool| tried.iter().filter(|&tried| is(tried)).count();
    let shown = |came: Came| count(&|tried: &Tried| tried.is_shown && tried.came == came);
    Visited {
        seen,
        reached: count(&|tried| tried.came == Came::There),
        outside: count(&|tried| !tried.is_shown),
        out_of_reach: shown(Came::OutOfReach),
        in_the_way: shown(Came::InTheWay),
        points: tried.len(),
        needed: arm::NEEDED,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::world::{Intrinsics, Table};

    pub(super) fn scene(base: Vector3<f64>) -> Scene {
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

    #[test]
    fn a_ball_that_may_be_at_the_rim_is_looked_for_and_one_far_outside_is_not() {
        let camera = scene(Vector3::zeros()).camera;
        let is_looked_for = |z: f64| around(&camera, Point::new(0.6, 0.0, z), 0.014).is_some();
        assert!(is_looked_for(0.2));
        // The picture ends at 0.49 m there.
        assert!(is_looked_for(0.50) && !is_looked_for(0.60));
    }
}
