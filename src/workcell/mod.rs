//! Arm, camera, world, twin and graph wired together; its verbs are the commands of the prompt and of the
//! command line, so both say the same.
//!
//! A [`WorkCell`] is opened once and keeps what it has learnt: the three regressions, where things stand,
//! and where the arm is. Nothing here prints; what happens is told to observers as it happens.

mod options;
mod texts;
pub mod archive;
pub mod check;
pub mod devices;
pub mod fork;
pub mod learning;
pub mod matching;
pub mod paper;

pub mod picture;
pub mod carried;
pub mod poured;
mod weighed;
mod wording;
pub mod questions;
pub mod record;
pub mod rehearse;
pub mod spots;
mod stdlib;
mod strain;
mod together;
pub mod trials;
mod aims;
mod album;
mod asking;
mod attempt;
mod choice;
mod displaced;
mod error;
pub mod film;
mod filming;
mod known;
mod lead;
mod leader;
pub mod links;
mod moments;
mod needs;
mod now;
mod outcome;
mod perform;
mod promises;
mod roles;
mod run;
mod setting;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use crate::arm::limits::Limits;
use crate::arm::{Cancel, Scales, Shot};
use crate::execution::belief::Belief;
use crate::execution::calibrate;
use crate::execution::calibration::Calibration;
use crate::execution::cell::{Cell, Pads};
use crate::execution::conduct::Dial;
use crate::execution::context::ActionContext;
use crate::execution::decisions::DecisionLog;
use crate::execution::error::ActionError;
use crate::execution::real::RealBody;
use crate::execution::script::Scripts;
use crate::graph::{self, Graph, InScene};
use crate::language::ast::{Call, Step};
use crate::language::{Diagnostic, Library, Source};
use crate::motion::Robot;
use crate::motion::free::Means;
use crate::trace::Observer;
use crate::twin::Settings;
use crate::twin::render::{ArmLook, View};
use crate::world::{Camera, Scene, WorldState};
use known::Known;
pub use known::unheeded_words;

pub use roles::Fan;
use roles::{Audience, Controls, Experience, Model, Setup};

pub use devices::{Devices, Laboratory, laboratory, robot_of};
pub use displaced::Displaced;
pub use error::{Error, InTwin, NoCorners, NoRun, Short, WhatIf};
pub use learning::Learnt;
pub use needs::TILTED;
pub use options::{CANDIDATES, Options};
pub use outcome::{Aims, Ending, Run, State, Timing, Tried, Water};
pub use setting::Setting;
pub use stdlib::{RobotError, Stdlib};
use texts::with_sources;
pub use texts::{add_scene, library, scene_name, scene_of};

/// What a cell is put together from, beside its devices.
struct Parts {
    setup: Setup,
    scene: Arc<Scene>,
    robot: Arc<Robot>,
    known: Known,
    /// The share of full speed that the arm is held to.
    pace: f64,
    means: Means,
    belief: Belief,
    cancel: Cancel,
}

/// Arm, cameras, world, twin and graph.
pub struct WorkCell {
    setup: Setup,
    model: Model,
    experience: Experience,
    audience: Audience,
    controls: Controls,
    /// The arm, what is known of the world, and the scripts that act on them.
    scripts: Scripts,
    scales: Option<Box<dyn Scales>>,
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
        let setting = Setting::of(&library, &options.stdlib, &scene);
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
        let is_real_time =
            options.is_real_time || !matches!(options.robot.as_str(), "lab" | "twin");
        let Options { robot: robot_name, stdlib, seed, switches, candidates, means, clock, .. } =
            options;
        let candidates = candidates.max(1);
        let setup = Setup {
            library,
            stdlib,
            setting,
            robot_name,
            seed,
            switches,
            candidates,
            is_real_time,
            clock,
        };
        let belief = Belief::new(scene.clone());
        let cancel = devices.cancel.clone();
        let parts = Parts { setup, scene, robot, known, pace, means, belief, cancel };
        Ok(Self::with(parts, devices))
    }

    /// Puts a cell together.
    fn with(parts: Parts, devices: Devices) -> Self {
        let Devices { arm, camera, scales, limits: _, cancel: _ } = devices;
        let Parts { setup, scene, robot, known, pace, means, belief, cancel } = parts;
        let limits = Limits { pace, ..Limits::default() };
        let mut settings = Settings::for_arm(&robot);
        known.change(&mut settings);
        let pads = Pads::of(&settings);
        let cell = Cell { robot: robot.clone(), scene: scene.clone(), limits, pads, means };
        let look = ArmLook::new(&robot);
        let audience = Audience::default();
        let controls = Controls { cancel, dial: Dial::default() };
        let body = RealBody::new(
            cell.clone(),
            arm,
            camera,
            Calibration::nominal(&scene),
            belief,
            look.clone(),
            audience.fan.clone(),
        )
        .obeying(controls.cancel.clone());
        let mut context = ActionContext::new(
            cell.clone(),
            Box::new(body),
            Vec::new(),
            DecisionLog::recording(),
            (setup.seed, 0),
            controls.cancel.clone(),
            audience.fan.clone(),
        );
        context.obey(controls.dial.clone());
        Self {
            setup,
            model: Model { cell, look, settings, known },
            experience: Experience::default(),
            audience,
            controls,
            scripts: Scripts::new(context),
            scales,
        }
    }

    /// Returns the wish to stop that everything in this cell obeys.
    pub fn cancel(&self) -> Cancel {
        self.controls.cancel.clone()
    }

    /// Returns the speed dial of this cell's arm.
    pub fn dial(&self) -> Dial {
        self.controls.dial.clone()
    }

    /// Returns the clock of this cell: seconds since some instant.
    pub fn clock(&self) -> fn() -> f64 {
        self.setup.clock
    }

    /// Returns the arm's name: `lab`, `twin`, or where it is.
    pub fn robot_name(&self) -> &str {
        &self.setup.robot_name
    }

    /// Returns the texts this cell knows.
    pub fn library(&self) -> &Library {
        &self.setup.library
    }

    /// Returns the scene.
    pub fn scene(&self) -> &Scene {
        &self.model.cell.scene
    }

    /// Lets choices rest on what is known from earlier runs.
    pub fn learn_from(&mut self, learnt: Learnt) {
        self.experience.learnt = learnt;
    }

    /// Returns the call that carries out steps: see [`Library::define`].
    pub fn define(&mut self, source: &Source, steps: &[Step]) -> Call {
        self.setup.library.define(source, steps)
    }

    /// Lets someone watch from now on, in place of all who watched before.
    pub fn watched_by(&mut self, observers: Vec<Box<dyn Observer + Send>>) {
        self.audience.is(observers);
    }

    /// Shows rehearsals to who watches from now on, in small pictures.
    pub fn show_rehearsals(&mut self) {
        self.audience.sees_rehearsals = true;
    }

    /// Returns the And-Or graph of a call.
    ///
    /// # Errors
    ///
    /// Every reason why the call has none.
    pub fn graph(&self, call: &Call) -> Result<Graph, Error> {
        let definitions =
            InScene { library: &self.setup.library, scene: &self.model.cell.scene.name };
        graph::build(&definitions, call).map_err(Error::Graph)
    }

    /// Returns the world as far as it is known now.
    ///
    /// # Errors
    ///
    /// When the arm does not answer.
    pub fn state(&mut self) -> Result<WorldState, Error> {
        Ok(self.scripts.context().state()?)
    }

    /// Aligns camera and robot if that has not been done, and looks.
    ///
    /// # Errors
    ///
    /// When the table's marks cannot be found, or a device fails.
    pub fn perceive(&mut self) -> Result<(), Error> {
        if !self.experience.is_camera_aligned {
            let aligned = calibrate::camera(&mut self.scripts.context(), self.setup.switches);
            self.model.adapt(self.scripts.context().cell().clone());
            aligned?;
            self.experience.is_camera_aligned = true;
        }
        self.scripts.context().look()?;
        self.experience.has_looked = true;
        Ok(())
    }

    /// Fits the three regressions anew: camera alignment, intrinsics, robot offset.
    ///
    /// # Errors
    ///
    /// As [`Self::perceive`], or when the marker on the gripper is not seen.
    pub fn align(&mut self) -> Result<(), Error> {
        self.experience.is_camera_aligned = false;
        self.experience.is_robot_aligned = false;
        self.experience.has_looked = false;
        self.perceive()?;
        self.align_robot()
    }

    /// Has the arm visit points before the camera, unless that has been done; then looks again.
    fn align_robot(&mut self) -> Result<(), Error> {
        if !self.experience.is_robot_aligned {
            let aligned = calibrate::robot(&mut self.scripts.context(), self.setup.switches);
            self.model.adapt(self.scripts.context().cell().clone());
            aligned?;
            self.experience.is_robot_aligned = true;
            self.scripts.context().look()?;
        }
        Ok(())
    }

    /// Returns the number that the twin's chance comes from.
    pub fn seed(&self) -> u64 {
        self.setup.seed
    }

    /// Lets the twin's chance come from another number.
    pub fn set_seed(&mut self, seed: u64) {
        self.setup.seed = seed;
    }

    /// Checks a line typed at the prompt and returns what is wrong with it.
    pub fn check_line(&self, step: &Step, source: &Source) -> Vec<Diagnostic> {
        let scope = self.setup.library.scope(&self.model.cell.scene.name);
        check::check_step(step, source, &self.setup.library, &self.setup.stdlib, &scope)
    }

    /// Returns whether the connection to the arm is lost for good: another cell has to be opened.
    pub fn is_lost(&mut self) -> bool {
        self.scripts.context().body().arm().is_lost()
    }

    /// Brings the arm to rest where it is, after a mistake of the program's own.
    pub fn halt(&mut self) {
        // What went wrong may go wrong again, and must not hide the first mistake.
        let stop = AssertUnwindSafe(|| {
            let mut context = self.scripts.context();
            context.body().arm().stop();
            // Where the arm is, and not where it was going, is where the next plan begins.
            context.find_arm()
        });
        let _ = catch_unwind(stop);
    }

    fn now(&self) -> f64 {
        (self.setup.clock)()
    }

    /// Takes a photograph, where there is a camera.
    fn shoot(&mut self) -> Result<Option<Shot>, Error> {
        Ok(self.scripts.context().body().photo().map_err(ActionError::from)?)
    }

    /// Returns the picture of a view through the camera as it is known.
    fn shoot_twin(&mut self, view: &View) -> Shot {
        let (camera, view) = (self.camera(), view.clone());
        Box::new(move || picture::draw(&camera, &view))
    }

    /// Returns the camera as it is known.
    fn camera(&mut self) -> Camera {
        let camera = self.scripts.context().body().calibration().map(|found| found.camera);
        camera.unwrap_or(self.model.cell.scene.camera)
    }
}
