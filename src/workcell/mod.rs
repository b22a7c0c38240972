//! Arm, camera, world, twin and graph wired together; its verbs are the commands of the prompt and of the
//! command line, so both say the same.
//!
//! A [`WorkCell`] is opened once and keeps what it has learnt: the three regressions, where things stand,
//! and where the arm is. Nothing here prints; what happens is told to observers as it happens.

pub mod archive;
pub mod check;
pub mod devices;
pub mod fork;
pub mod learning;
pub mod picture;
pub mod carried;
pub mod poured;
mod weighed;
pub mod questions;
pub mod record;
pub mod rehearse;
pub mod stdlib;
mod together;
pub mod trials;
mod asking;
mod attempt;
mod choice;
mod error;
mod known;
mod lead;
mod needs;
mod now;
mod outcome;
mod perform;
mod run;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};

use image::RgbImage;

use crate::execution::arm::{Cancel, Scales};
use crate::execution::belief::Belief;
use crate::execution::calibrate::{self, Calibration, Switches};
use crate::execution::conduct::Dial;
use crate::execution::limits::Limits;
use crate::execution::real::RealBody;
use crate::execution::script::Scripts;
use crate::execution::stage::{ActionError, Cell, Pads, Stage};
use crate::execution::tape::Tape;
use crate::execution::trace::{Event, Observer};
use crate::graph::{self, Graph};
use crate::lab::LabSettings;
use crate::language::ast::{Call, Step};
use crate::language::{Diagnostic, Library, Source};
use crate::motion::robot::Robot;
use crate::twin::Settings;
use crate::twin::render::{ArmLook, View};
use crate::vqa::Endpoint;
use crate::world::{Scene, WorldState};
use fork::Moments;
use known::Known;
pub use known::unheeded_words;
use lead::SharedLead;

pub use devices::{Devices, Laboratory, laboratory, robot_of};
pub use error::Error;
pub use learning::Learnt;
pub use outcome::{Ending, Run, State, Timing, Tried, Water};
pub use stdlib::Stdlib;

/// How to open a cell.
#[derive(Debug, Clone)]
pub struct Options {
    /// `lab` or `twin`, or what an arm elsewhere is called.
    pub robot: String,
    /// A `.task` file with a scene, as path and text; the kitchen when `None`.
    pub scene: Option<Source>,
    /// A user's script whose items come with the library, as path and text.
    pub script: Option<Source>,
    /// The lab's settings.
    pub lab: LabSettings,
    /// The stdlib.
    pub stdlib: Stdlib,
    /// All chance comes from this.
    pub seed: u64,
    /// Which regressions are in force.
    pub switches: Switches,
    /// Returns seconds since some instant; only differences are used.
    pub clock: fn() -> f64,
}

/// Several observers as one.
#[derive(Default)]
pub struct Fan(Vec<Box<dyn Observer + Send>>);

impl Observer for Fan {
    fn event(&mut self, event: &Event) {
        for observer in &mut self.0 {
            observer.event(event);
        }
    }
}

/// Tells a shared observer.
fn tell(fan: &Mutex<Fan>, event: &Event) {
    fan.lock().unwrap_or_else(PoisonError::into_inner).event(event);
}

/// What a cell is put together from, beside its devices.
struct Parts {
    library: Library,
    stdlib: Stdlib,
    scene: Arc<Scene>,
    robot: Arc<Robot>,
    known: Known,
    /// The share of full speed that the arm is held to.
    pace: f64,
    belief: Belief,
    robot_name: String,
    seed: u64,
    switches: Switches,
    clock: fn() -> f64,
    cancel: Cancel,
}

/// Arm, cameras, world, twin and graph.
pub struct WorkCell {
    library: Library,
    stdlib: Stdlib,
    /// As the regressions in force found it.
    cell: Cell,
    look: ArmLook,
    settings: Settings,
    known: Known,
    scripts: Scripts,
    scales: Option<Box<dyn Scales>>,
    robot_name: String,
    seed: u64,
    switches: Switches,
    cancel: Cancel,
    clock: fn() -> f64,
    fan: Arc<Mutex<Fan>>,
    is_camera_aligned: bool,
    is_robot_aligned: bool,
    learnt: Learnt,
    dial: Dial,
    lead: Option<SharedLead>,
    model: Option<Endpoint>,
    moments: Moments,
}

impl WorkCell {
    /// Opens a cell: reads the library and the scene, and connects arm and camera. Nothing moves.
    ///
    /// # Errors
    ///
    /// What is wrong with the texts, all of it at once, or with the lab's settings.
    pub fn open(options: Options) -> Result<Self, Error> {
        Self::open_with(options, devices::laboratory_devices)
    }

    /// As [`Self::open`], with the devices that `connect` returns for the scene's robot.
    ///
    /// # Errors
    ///
    /// As [`Self::open`], and what `connect` says.
    pub fn open_with(
        mut options: Options,
        connect: impl FnOnce(&Arc<Robot>, &Scene, &Options) -> Result<Devices, Error>,
    ) -> Result<Self, Error> {
        let (library, scene, robot) = devices::place(&mut options)?;
        let known = Known::of(&library, &scene, robot.n_joints());
        // Reality is put up from what is declared; everything else works with what is known.
        let devices = connect(&robot, &scene, &options)?;
        let scene = Arc::new(known.scene(&scene));
        let (robot, pace) = match &devices.limits {
            None => (robot, 1.0),
            Some(most) => {
                let shares = robot.joints().iter().zip(&most.velocity);
                let pace = shares.map(|(own, most)| most / own.velocity).fold(1.0, f64::min);
                let own = Robot::clone(&robot);
                (Arc::new(own.with_limits(&most.velocity, &most.acceleration)), pace)
            }
        };
        let Options { robot: robot_name, stdlib, seed, switches, clock, .. } = options;
        let parts = Parts {
            library,
            stdlib,
            belief: Belief::new(scene.clone()),
            scene,
            robot,
            known,
            pace,
            robot_name,
            seed,
            switches,
            clock,
            cancel: Cancel::default(),
        };
        Ok(Self::with(parts, devices))
    }

    /// Puts a cell together.
    fn with(parts: Parts, devices: Devices) -> Self {
        let Devices { arm, camera, scales, limits: _ } = devices;
        let Parts { library, stdlib, scene, robot, known, pace, belief, cancel, .. } = parts;
        let limits = Limits { pace, ..Limits::default() };
        let mut settings = Settings::for_arm(&robot);
        known.change(&mut settings);
        let pads = Pads::of(&settings);
        let cell = Cell { robot: robot.clone(), scene: scene.clone(), limits, pads };
        let look = ArmLook::new(&robot);
        let fan: Arc<Mutex<Fan>> = Arc::default();
        let body = RealBody::new(
            cell.clone(),
            arm,
            camera,
            Calibration::nominal(&scene),
            belief,
            look.clone(),
            fan.clone(),
        );
        let dial = Dial::default();
        let mut stage = Stage::new(
            cell.clone(),
            Box::new(body),
            Vec::new(),
            Tape::recording(),
            (parts.seed, 0),
            cancel.clone(),
            fan.clone(),
        );
        stage.obey(dial.clone());
        Self {
            library,
            cell,
            settings,
            known,
            look,
            stdlib,
            scripts: Scripts::new(stage),
            scales,
            robot_name: parts.robot_name,
            seed: parts.seed,
            switches: parts.switches,
            cancel,
            clock: parts.clock,
            fan,
            is_camera_aligned: false,
            is_robot_aligned: false,
            learnt: Learnt::default(),
            dial,
            lead: None,
            model: None,
            moments: Moments::default(),
        }
    }

    /// Returns the wish to stop that everything in this cell obeys.
    pub fn cancel(&self) -> Cancel {
        self.cancel.clone()
    }

    /// Returns the speed dial of this cell's arm.
    pub fn dial(&self) -> Dial {
        self.dial.clone()
    }

    /// Returns the clock of this cell: seconds since some instant.
    pub fn clock(&self) -> fn() -> f64 {
        self.clock
    }

    /// Returns the arm's name: `lab`, `twin`, or where it is.
    pub fn robot_name(&self) -> &str {
        &self.robot_name
    }

    /// Returns the texts this cell knows.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// Returns the scene.
    pub fn scene(&self) -> &Scene {
        &self.cell.scene
    }

    /// Lets choices rest on what is known from earlier runs.
    pub fn learn_from(&mut self, learnt: Learnt) {
        self.learnt = learnt;
    }

    /// Returns the call that carries out steps: see [`Library::define`].
    pub fn define(&mut self, source: &Source, steps: &[Step]) -> Call {
        self.library.define(source, steps)
    }

    /// Lets someone watch from now on, in place of all who watched before.
    pub fn watched_by(&mut self, observers: Vec<Box<dyn Observer + Send>>) {
        *self.fan.lock().unwrap_or_else(PoisonError::into_inner) = Fan(observers);
    }

    /// Returns the And-Or graph of a call.
    ///
    /// # Errors
    ///
    /// Every reason why the call has none.
    pub fn graph(&self, call: &Call) -> Result<Graph, Error> {
        graph::build(&self.library, call).map_err(Error::Graph)
    }

    /// Returns the world as far as it is known now.
    ///
    /// # Errors
    ///
    /// When the arm does not answer.
    pub fn state(&self) -> Result<WorldState, Error> {
        Ok(self.scripts.stage().state()?)
    }

    /// Aligns camera and robot if that has not been done, and looks.
    ///
    /// # Errors
    ///
    /// When the table's marks cannot be found, or a device fails.
    pub fn perceive(&mut self) -> Result<(), Error> {
        if !self.is_camera_aligned {
            let aligned = calibrate::camera(&mut self.scripts.stage(), self.switches);
            self.adapt();
            aligned?;
            self.is_camera_aligned = true;
        }
        Ok(self.scripts.stage().look()?)
    }

    /// Fits the three regressions anew: camera alignment, intrinsics, robot offset.
    ///
    /// # Errors
    ///
    /// As [`Self::perceive`], or when the marker on the gripper is not seen.
    pub fn align(&mut self) -> Result<(), Error> {
        self.is_camera_aligned = false;
        self.is_robot_aligned = false;
        self.perceive()?;
        self.align_robot()
    }

    /// Has the arm visit points before the camera, unless that has been done; then looks again.
    fn align_robot(&mut self) -> Result<(), Error> {
        if !self.is_robot_aligned {
            let aligned = calibrate::robot(&mut self.scripts.stage(), self.switches);
            self.adapt();
            aligned?;
            self.is_robot_aligned = true;
            self.scripts.stage().look()?;
        }
        Ok(())
    }

    /// Takes the cell as the regressions found it: the twin is built of the same arm that is sent.
    fn adapt(&mut self) {
        self.cell = self.scripts.stage().cell().clone();
        self.look = ArmLook::new(&self.cell.robot);
    }

    /// Returns the number that the twin's chance comes from.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Lets the twin's chance come from another number.
    pub fn set_seed(&mut self, seed: u64) {
        self.seed = seed;
    }

    /// Checks a line typed at the prompt and returns what is wrong with it.
    pub fn check_line(&self, step: &Step, source: &Source) -> Vec<Diagnostic> {
        let scope = self.library.scope(&self.cell.scene.name);
        check::check_step(step, source, &self.library, &self.stdlib, &scope)
    }

    /// Brings the arm to rest where it is, after a mistake of the program's own.
    pub fn halt(&self) {
        // What went wrong may go wrong again, and must not hide the first mistake.
        let stop = AssertUnwindSafe(|| {
            let mut stage = self.scripts.stage();
            stage.body().arm().stop();
            // Where the arm is, and not where it was going, is where the next plan begins.
            stage.find_arm()
        });
        let _ = catch_unwind(stop);
    }

    fn now(&self) -> f64 {
        (self.clock)()
    }

    fn tell(&self, event: &Event) {
        tell(&self.fan, event);
    }

    fn phase(&self, name: &str, detail: &str) {
        self.tell(&Event::Phase { name: name.into(), detail: detail.into() });
    }

    fn note(&self, text: &str) {
        self.tell(&Event::Note { text: text.into() });
    }

    fn photo_for_run(&self, name: &str) -> Result<Option<RgbImage>, Error> {
        let image = self.scripts.stage().body().photo().map_err(ActionError::from)?;
        if let Some(image) = &image {
            self.tell(&Event::Picture { name: name.into(), image: image.clone() });
        }
        Ok(image)
    }

    fn twin_picture(&self, name: &str, view: &View) -> RgbImage {
        let camera = self.scripts.stage().body().calibration().map(|found| found.camera);
        let image = picture::draw(&camera.unwrap_or(self.cell.scene.camera), view);
        self.tell(&Event::Picture { name: name.into(), image: image.clone() });
        image
    }
}

/// Reads the stdlib into a library.
pub fn library(stdlib: &Stdlib) -> Library {
    let mut library = Library::new();
    for (path, text) in stdlib.tasks() {
        library.add(Source::new(path, text));
    }
    library
}

/// Returns the scene of a source, or the first one there is.
///
/// # Errors
///
/// When there is none, or it makes no sense.
pub fn scene_of(library: &Library, source: Option<usize>) -> Result<Scene, Error> {
    let mut scenes: Vec<_> = library.scenes().collect();
    let own = source.and_then(|at| {
        let name = &library.source(at)?.name;
        scenes.iter().position(|(_, from)| from.name == *name)
    });
    if scenes.is_empty() {
        return Err(Error::NoScene("the library".into()));
    }
    let (item, from) = scenes.swap_remove(own.unwrap_or(0));
    Scene::from_item(item, from)
        .map_err(|wrong| Error::Text(with_sources(library, wrong.into_iter())))
}

/// Puts beside each diagnostic the text it is about.
fn with_sources(
    library: &Library,
    diagnostics: impl Iterator<Item = Diagnostic>,
) -> Vec<(Diagnostic, Source)> {
    diagnostics
        .map(|diagnostic| {
            let source = library.source_named(&diagnostic.file).cloned().unwrap_or_default();
            (diagnostic, source)
        })
        .collect()
}
