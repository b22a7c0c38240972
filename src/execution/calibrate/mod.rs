//! The three regressions in use: from photographs of the table and of the arm to a [`Calibration`].
//!
//! Regression 1 aligns the camera by the table's printed dots, regression 2 fits its intrinsics to the same
//! points, regression 3 has the arm visit points and asks the camera where the marker ball on the gripper
//! is ([`arm`]). Each can be left out, to see what it is worth. The other fits are [`crate::alignment`]'s.

use std::sync::Arc;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::alignment::ball::find_marker_ball;
use crate::alignment::camera_fit::{self, Refine, refine_camera};
use crate::alignment::image_map::{self, Pair, fit_map};
use crate::alignment::marks::find_marks;
use crate::motion::robot::Robot;
use crate::world::frame::{Tool, World};
use crate::world::{Camera, Point, Pose, Scene};

use super::stage::{ActionError, Cell, Stage};
use super::trace::Event;

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

/// What the regressions found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// The camera as it stands and sees.
    pub camera: Camera,
    /// Carries a real pose into the pose the arm, its zeros put right, takes for it: `D` of `p_s = D p_r`
    /// (Eq. 7).
    pub reported_from_real: Pose<World, World>,
    /// Real angle less the reported one, rad, a joint each; none for none.
    pub zeros: Vec<f64>,
    /// How far the gripper sits from its place on the flange, m, flange axes.
    pub tool_shift: [f64; 3],
    /// What was fitted, in words, for the record.
    pub notes: Vec<String>,
}

/// Why the regressions could not be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The arm or the camera failed.
    #[error("{0}")]
    Action(#[from] ActionError),
    /// The picture or the fit.
    #[error("the camera cannot be aligned: {0}")]
    Alignment(String),
    /// The arm's marker was seen too rarely.
    #[error(
        "the marker ball was seen at {seen} of {visited} points; the offset needs at least {needed}"
    )]
    Unseen {
        /// Where it was seen.
        seen: usize,
        /// Where it was looked for.
        visited: usize,
        /// How many are needed.
        needed: usize,
    },
}

impl From<crate::alignment::Error> for Error {
    fn from(error: crate::alignment::Error) -> Self {
        Self::Alignment(error.to_string())
    }
}

impl From<crate::alignment::vision::Error> for Error {
    fn from(error: crate::alignment::vision::Error) -> Self {
        Self::Alignment(error.to_string())
    }
}

impl Calibration {
    /// Believes the scene file.
    pub fn nominal(scene: &Scene) -> Self {
        Self {
            camera: scene.camera,
            reported_from_real: Pose::identity(),
            zeros: Vec::new(),
            tool_shift: [0.0; 3],
            notes: vec!["nothing has been calibrated".into()],
        }
    }

    /// Returns a cell as it really is: of the joint positions that the arm reports and takes, its robot,
    /// standing where its scene has it, makes real poses.
    ///
    /// Whoever plans and rehearses with this cell does so with the very joint positions that the arm is sent
    /// to, so the ends of its ranges, its speeds and its height over the table are the arm's own, and nothing
    /// is left to correct when the arm moves.
    pub fn cell(&self, declared: &Cell) -> Cell {
        let robot = Robot::clone(&declared.robot)
            .with_zero_offsets(&self.zeros)
            .with_tool_shift(self.tool_shift.into());
        let mut scene = Scene::clone(&declared.scene);
        scene.world_from_base = self.reported_from_real.inverse() * scene.world_from_base;
        Cell { robot: Arc::new(robot), scene: Arc::new(scene), ..declared.clone() }
    }
}

/// Fits regressions 1 and 2, those that are switched on, and puts them in force on the stage. Nothing
/// moves.
///
/// # Errors
///
/// When too few reference points are found, a fit is degenerate, or the camera fails.
pub fn camera(stage: &mut Stage, switches: Switches) -> Result<(), Error> {
    let scene = stage.declared().scene.clone();
    let mut calibration = Calibration::nominal(&scene);
    if let Some(photo) = stage.body().photo().map_err(ActionError::from)? {
        (calibration.camera, calibration.notes) = from_marks(&photo, &scene, switches)?;
    }
    in_force(stage, calibration, 0)
}

/// Fits regression 3, if it is switched on, and puts it in force on the stage. The arm moves among what
/// was seen on the table, so it must have looked before.
///
/// # Errors
///
/// When the marker is seen too rarely, the fit is degenerate, or the arm or camera fails.
pub fn robot(stage: &mut Stage, switches: Switches) -> Result<(), Error> {
    let Some(mut calibration) = stage.body().calibration().cloned() else { return Ok(()) };
    let told = calibration.notes.len();
    if switches.offset {
        stage.doubt_arm(DOUBT);
        let aligned = align_robot(stage, &mut calibration);
        stage.doubt_arm(0.0);
        aligned?;
    } else {
        calibration.notes.push("regression 3 left out: the arm is taken at its word".into());
    }
    in_force(stage, calibration, told)
}

/// Puts a calibration in force and tells its notes from number `told` on.
fn in_force(stage: &mut Stage, calibration: Calibration, told: usize) -> Result<(), Error> {
    for text in &calibration.notes[told..] {
        stage.tell(&Event::Note { text: text.clone() });
    }
    Ok(stage.calibrate(calibration)?)
}

/// Regressions 1 and 2 from one photograph of the table's dots: the camera, and what was fitted in words.
///
/// # Errors
///
/// When too few dots are found or they do not determine the camera.
pub fn from_marks(
    photo: &image::RgbImage,
    scene: &Scene,
    switches: Switches,
) -> Result<(Camera, Vec<String>), Error> {
    let guess = scene.camera;
    let mut notes = Vec::new();
    if !switches.camera && !switches.intrinsics {
        notes.push("regressions 1 and 2 left out: the scene file is believed".into());
        return Ok((guess, notes));
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
    notes.push(format!(
        "regression 1: {} of {} dots, projective map, rms {:.2} px, camera {}",
        points.len(),
        scene.marks.len(),
        map.rms_px,
        if switches.camera { "aligned" } else { "left where the scene file says" },
    ));
    let refine = match (switches.camera, switches.intrinsics) {
        (true, true) => Refine::all(),
        (true, false) => Refine::pose_only(),
        (false, _) => Refine::intrinsics_only(),
    };
    let fit = refine_camera(&guess, &points, &refine)?;
    let k = fit.camera.intrinsics;
    notes.push(format!(
        "regression 2: focal {:.1} px, centre ({:.1}, {:.1}) px, k1 {:.4}, rms {:.2} px{}",
        k.fx,
        k.cx,
        k.cy,
        k.k1,
        fit.rms_px,
        if switches.intrinsics { "" } else { " (left out: the scene file's lens is believed)" },
    ));
    Ok((fit.camera, notes))
}

/// Stops after which more would say little.
const WANTED: usize = 12;

/// How far an arm may be from where it says before regression 3, m.
const DOUBT: f64 = 0.04;

/// Regression 3: the arm visits points, the camera says where the marker ball is.
fn align_robot(stage: &mut Stage, calibration: &mut Calibration) -> Result<(), Error> {
    let Cell { scene, robot, .. } = stage.declared().clone();
    let (Some(ball), Some(marker)) = (robot.marker(), robot.marker_in_flange()) else {
        return Err(Error::Alignment("the robot's side file describes no marker ball".into()));
    };
    let start = stage.planned_q().to_vec();
    let mut stops = Vec::new();
    let visits = visits(&scene);
    let visited = visits.len();
    for (n, at) in visits.into_iter().enumerate() {
        if stops.len() >= WANTED {
            break;
        }
        stage.tell(&Event::Progress {
            what: "touch-off".into(),
            fraction: (stops.len() as f64 / WANTED as f64).max(n as f64 / visited as f64),
        });
        // A point that cannot be reached among the objects, or that the limits refuse, is passed over.
        match stage.visit(&at) {
            Ok(()) => {}
            Err(ActionError::NoWay(_) | ActionError::Limit(_)) => continue,
            Err(error) => return Err(error.into()),
        }
        stage.wait(0.3)?;
        let Some(photo) = stage.body().photo().map_err(ActionError::from)? else { continue };
        let camera = &calibration.camera;
        let Some(seen) = find_marker_ball(&photo, camera, ball.radius, ball.colour) else {
            continue;
        };
        let q = stage.reported_q()?;
        stops.push(arm::Stop { q, pixel: seen.pixel, sigma: seen.sigma });
    }
    // Back to where it hid nothing.
    stage.move_to(&start, None, 0.8)?;
    if stops.len() < arm::NEEDED {
        return Err(Error::Unseen { seen: stops.len(), visited, needed: arm::NEEDED });
    }
    let fit = arm::fit_arm(
        &robot,
        scene.world_from_base,
        marker,
        &calibration.camera,
        &stops,
        &arm::Priors::default(),
    )?;
    calibration.notes.push(format!(
        "regression 3: {} of {visited} points, the arm is {:.1} mm off where it says, \
         rms {:.2} px before and {:.2} px after",
        stops.len() - fit.outliers.len(),
        fit.off * 1e3,
        fit.rms_before_px,
        fit.rms_px,
    ));
    calibration.reported_from_real = fit.reported_from_real;
    calibration.zeros = fit.zeros;
    calibration.tool_shift = fit.tool_shift.into();
    Ok(())
}

/// Points over the table, near and far, left and right, low and high, the hand ahead and aside, level and
/// pitched down: as it will come to take and to pour, since an error is known where it was looked at.
fn visits(scene: &Scene) -> Vec<Pose<World, Tool>> {
    let base = scene.world_from_base.origin();
    let mut visits = Vec::new();
    // The second round, higher and turned otherwise, is for what stands in the way of the first.
    for (round, higher) in [(0, 0.0), (1, 0.07)] {
        for (i, bearing) in [-0.55_f64, -0.28, 0.0, 0.28, 0.55].into_iter().enumerate() {
            for (j, reach) in [0.44, 0.54, 0.64].into_iter().enumerate() {
                let height = [0.17, 0.23, 0.29][(i + j) % 3] + higher;
                let aside = [0.0, 0.9, -0.9, 0.45, -0.45][(2 * i + 3 * j + 2 * round) % 5];
                let pitch = [0.0, 0.35][(i + j) % 2];
                let at = base + Vector3::new(reach * bearing.cos(), reach * bearing.sin(), height);
                visits.push(super::plan::side_pose(at, bearing + aside, pitch));
            }
        }
    }
    visits
}
