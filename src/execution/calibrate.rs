//! The three regressions in use: from photographs of the table and of the arm to a [`Calibration`].
//!
//! Regression 1 aligns the camera by the table's printed dots, regression 2 fits its intrinsics to the same
//! points, regression 3 has the arm visit points and asks the camera where the marker ball on the gripper
//! is. Each can be left out, to see what it is worth. The fits themselves are [`crate::alignment`]'s.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::alignment::ball::find_marker_ball;
use crate::alignment::camera_fit::{self, Refine, refine_camera};
use crate::alignment::image_map::{self, Pair, fit_map};
use crate::alignment::marks::find_marks;
use crate::alignment::offset;
use crate::alignment::offset::pixels::{self, fit_offset_from_pixels};
use crate::world::frame::{Tool, World};
use crate::world::{Camera, Point, Pose, Scene};

use super::stage::{ActionError, Stage};
use super::trace::Event;

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
    /// Carries a real pose into the pose the arm must report to be there: `D` of `p_s = D p_r` (Eq. 7).
    pub reported_from_real: Pose<World, World>,
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
            notes: vec!["nothing has been calibrated".into()],
        }
    }

    /// Returns the pose the arm must report to be really at `tool`.
    pub fn reported_from_real(&self, tool: &Pose<World, Tool>) -> Pose<World, Tool> {
        self.reported_from_real * *tool
    }

    /// Returns where the tool really is when the arm reports `tool`.
    pub fn real_from_reported(&self, tool: &Pose<World, Tool>) -> Pose<World, Tool> {
        self.reported_from_real.inverse() * *tool
    }
}

/// Fits the regressions that are switched on and puts them in force on the stage.
///
/// # Errors
///
/// When too few reference points are found, a fit is degenerate, or the arm or camera fails.
pub fn run(stage: &mut Stage, switches: Switches) -> Result<(), Error> {
    let scene = stage.cell().scene.clone();
    let mut calibration = Calibration::nominal(&scene);
    calibration.notes.clear();
    if let Some(photo) = stage.body().photo().map_err(ActionError::from)? {
        align_camera(&photo, &scene, switches, &mut calibration)?;
    }
    stage.body().calibrate(calibration.clone());
    stage.find_arm()?;
    if switches.offset {
        // The arm goes among what stands on the table, so it looks first.
        stage.look()?;
        align_robot(stage, &mut calibration)?;
        stage.body().calibrate(calibration.clone());
        stage.find_arm()?;
    } else {
        calibration.notes.push("regression 3 left out: the arm is taken at its word".into());
    }
    for text in &calibration.notes {
        stage.tell(&Event::Note { text: text.clone() });
    }
    Ok(())
}

/// Regressions 1 and 2 from one photograph of the table's dots.
fn align_camera(
    photo: &image::RgbImage,
    scene: &Scene,
    switches: Switches,
    calibration: &mut Calibration,
) -> Result<(), Error> {
    let guess = scene.camera;
    if !switches.camera && !switches.intrinsics {
        calibration.notes.push("regressions 1 and 2 left out: the scene file is believed".into());
        return Ok(());
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
    calibration.notes.push(format!(
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
    calibration.camera = fit.camera;
    let k = fit.camera.intrinsics;
    calibration.notes.push(format!(
        "regression 2: focal {:.1} px, centre ({:.1}, {:.1}) px, k1 {:.4}, rms {:.2} px{}",
        k.fx,
        k.cx,
        k.cy,
        k.k1,
        fit.rms_px,
        if switches.intrinsics { "" } else { " (left out: the scene file's lens is believed)" },
    ));
    Ok(())
}

/// Fewest points the offset is fitted to.
const NEEDED: usize = 6;

/// Regression 3: the arm visits points, the camera says where the marker ball is.
fn align_robot(stage: &mut Stage, calibration: &mut Calibration) -> Result<(), Error> {
    let scene = stage.cell().scene.clone();
    let marker = super::real::marker();
    let flange_from_tool = stage.cell().robot.flange_from_tool();
    let mut seen = Vec::new();
    let visits = visits(&scene);
    let visited = visits.len();
    for (n, at) in visits.into_iter().enumerate() {
        stage.tell(&Event::Progress {
            what: "touch-off".into(),
            fraction: n as f64 / visited as f64,
        });
        // A point that cannot be reached among the objects is passed over.
        match stage.visit(&at) {
            Ok(()) => {}
            Err(ActionError::NoWay(_)) => continue,
            Err(error) => return Err(error.into()),
        }
        stage.wait(0.3)?;
        let Some(photo) = stage.body().photo().map_err(ActionError::from)? else { continue };
        let camera = &calibration.camera;
        let Some(ball) = find_marker_ball(&photo, camera, marker.radius, marker.colour) else {
            continue;
        };
        let reported = stage.reported_tool()?;
        let ball_in_tool = flange_from_tool.inverse() * Point::from(marker.centre);
        seen.push(pixels::Sighting {
            reported: (reported * ball_in_tool).coords(),
            pixel: ball.pixel,
            sigma: ball.sigma,
        });
    }
    if seen.len() < NEEDED {
        return Err(Error::Unseen { seen: seen.len(), visited, needed: NEEDED });
    }
    let fit = fit_offset_from_pixels(
        &seen,
        &calibration.camera,
        offset::Model::Rigid,
        &pixels::Priors::default(),
    )?;
    calibration.reported_from_real = fit.real_from_reported.inverse();
    calibration.notes.push(format!(
        "regression 3: {} of {visited} points, the arm is {:.1} mm and {:.2} deg off where it says, \
         rms {:.2} px before and {:.2} px after",
        seen.len(),
        fit.shift.norm() * 1e3,
        fit.turn.norm().to_degrees(),
        fit.rms_before_px,
        fit.rms_px,
    ));
    Ok(())
}

/// Points over the table, near and far, left and right, low and high, the hand level and facing out so
/// that the ball on its back is seen.
fn visits(scene: &Scene) -> Vec<Pose<World, Tool>> {
    let base = scene.world_from_base.origin();
    let mut visits = Vec::new();
    for (i, heading) in [-0.50_f64, -0.25, 0.0, 0.25, 0.50].into_iter().enumerate() {
        for (j, reach) in [0.46, 0.56, 0.66].into_iter().enumerate() {
            let height = [0.17, 0.23, 0.29][(i + j) % 3];
            let at = base + Vector3::new(reach * heading.cos(), reach * heading.sin(), height);
            visits.push(super::plan::side_pose(at, heading, 0.0));
        }
    }
    visits
}
