//! What a cell works with: an arm, a camera, scales, and what the arm allows.
//!
//! The laboratory's are made here; those of an arm elsewhere are handed in.

use std::sync::{Arc, Mutex};

use crate::arm::paced::Paced;
use crate::arm::ticked::{Brake, Ticked};
use crate::arm::{Arm, Camera, Cancel, Scales};
use crate::execution::lab_arm::{self, LabCamera, LabPlant, LabScales, SharedLab};
use crate::lab::{Lab, LabSettings};
use crate::language::{Diagnostic, Library};
use crate::motion::robot::Robot;
use crate::motion::trajectory::Limits;
use crate::world::Scene;

use super::{Error, Options, add_scene, check, library, scene_of, with_sources};

/// An arm, a camera, and scales where there are some.
pub struct Devices {
    /// The arm.
    pub arm: Box<dyn Arm>,
    /// The camera that looks at the table.
    pub camera: Box<dyn Camera>,
    /// Scales under the vessels, read when a run is over.
    pub scales: Option<Box<dyn Scales>>,
    /// Speeds and accelerations that are planned within, where the robot's own file allows more.
    pub limits: Option<Limits>,
    /// The wish to stop that they obey too, while they wait for an answer.
    pub cancel: Cancel,
}

/// Reads the library and finds the scene and its robot; nothing is connected.
pub(super) fn place(options: &mut Options) -> Result<(Library, Arc<Scene>, Arc<Robot>), Error> {
    let mut library = library(&options.stdlib);
    let scene_source = options.scene.take();
    let scene_source =
        scene_source.map(|source| add_scene(&mut library, &options.stdlib, source)).transpose()?;
    let read = |path: &str| options.stdlib.read(path);
    let script = options.script.take().map(|source| library.add_with(source, &read));
    for (name, text) in library.scripts() {
        options.stdlib.add_script(name, text);
    }
    let scene = Arc::new(scene_of(&library, scene_source.or(script))?);
    let scope = library.scope(&scene.name);
    let all = (0..library.len())
        .flat_map(|file| check::check_file(&library, &options.stdlib, file, &scope));
    let wrong = with_sources(&library, all.filter(Diagnostic::is_error));
    if !wrong.is_empty() {
        return Err(Error::Text(wrong));
    }
    let robot = Arc::new(options.stdlib.robot(&scene.robot)?);
    Ok((library, scene, robot))
}

fn lab_of(robot: &Robot, scene: &Scene, options: &Options) -> Result<SharedLab, Error> {
    let settings = match options.robot.as_str() {
        "twin" => LabSettings::perfect(),
        _ => options.lab.clone(),
    };
    settings.check_places(scene)?;
    let lab = Lab::new(robot, scene, settings, options.seed);
    Ok(Arc::new(Mutex::new(lab?)))
}

/// Returns the laboratory's devices.
pub(super) fn laboratory_devices(
    robot: &Arc<Robot>,
    scene: &Scene,
    options: &Options,
) -> Result<Devices, Error> {
    let lab = lab_of(robot, scene, options)?;
    let mut devices = of_lab(lab.clone(), robot);
    if options.is_real_time {
        let paced = Paced::new(lab_arm::plant(lab), options.clock);
        devices.arm = Box::new(Ticked::new(paced, Brake::of(robot)));
    }
    Ok(devices)
}

/// Returns the devices of a laboratory with these settings.
pub(super) fn simulated(
    robot: &Robot,
    scene: &Scene,
    settings: LabSettings,
    seed: u64,
) -> Result<Devices, Error> {
    let lab = Lab::new(robot, scene, settings, seed);
    Ok(of_lab(Arc::new(Mutex::new(lab?)), robot))
}

fn of_lab(lab: SharedLab, robot: &Robot) -> Devices {
    Devices {
        arm: Box::new(lab_arm::connect(lab.clone(), robot)),
        camera: Box::new(LabCamera(lab.clone())),
        scales: Some(Box::new(LabScales(lab))),
        limits: None,
        cancel: Cancel::default(),
    }
}

/// Returns the vessel that stands on a laboratory's scale with a cable unless its settings name another.
pub(super) fn usually_on_the_scale() -> String {
    LabSettings::default().scale.under
}

/// A laboratory without a program: its arm to be put behind a controller, its camera and scales beside it.
pub struct Laboratory {
    /// The robot as its file says.
    pub robot: Arc<Robot>,
    /// The arm, to be stepped.
    pub plant: LabPlant,
    /// The camera.
    pub camera: LabCamera,
    /// The scales.
    pub scales: LabScales,
}

/// Returns the robot of a scene, with nothing around it.
///
/// # Errors
///
/// As [`super::WorkCell::open`].
pub fn robot_of(mut options: Options) -> Result<Arc<Robot>, Error> {
    Ok(place(&mut options)?.2)
}

/// Opens the laboratory of a scene.
///
/// # Errors
///
/// As [`super::WorkCell::open`].
pub fn laboratory(mut options: Options) -> Result<Laboratory, Error> {
    let (_, scene, robot) = place(&mut options)?;
    let lab = lab_of(&robot, &scene, &options)?;
    Ok(Laboratory {
        robot,
        plant: lab_arm::plant(lab.clone()),
        camera: LabCamera(lab.clone()),
        scales: LabScales(lab),
    })
}
