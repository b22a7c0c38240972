//! Arm, camera, world, twin and graph wired together; its verbs are the commands of the prompt and of the
//! command line, so both say the same.
//!
//! A [`WorkCell`] is opened once and keeps what it has learnt: the three regressions, where things stand,
//! and where the arm is. Nothing here prints; what happens is told to observers as it happens.

pub mod archive;
pub mod check;
pub mod devices;
pub mod learning;
pub mod picture;
pub mod poured;
pub mod questions;
pub mod record;
pub mod rehearse;
pub mod stdlib;
pub mod together;
pub mod trials;
mod asking;
mod known;
mod lead;
mod perform;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use image::RgbImage;

use crate::execution::arm::{Cancel, DeviceError, Scales};
use crate::execution::calibrate::{self, Calibration, Switches};
use crate::execution::conduct::Dial;
use crate::execution::limits::Limits;
use crate::execution::real::{Belief, RealBody};
use crate::execution::script::Scripts;
use crate::execution::stage::{ActionError, Cell, Stage};
use crate::execution::tape::Tape;
use crate::execution::trace::{Event, Observer};
use crate::execution::walk::Walker;
use crate::graph::{self, Graph, ParseGraph, RecoveryPlan, infer};
use crate::lab::LabSettings;
use crate::language::ast::{BinaryOp, Call, Expr, ExprKind, Step};
use crate::language::{Diagnostic, Library, Source};
use crate::motion::robot::Robot;
use crate::twin::Settings;
use crate::twin::render::{ArmLook, View};
use crate::units::Quantity;
use crate::vqa::Endpoint;
use crate::world::fluent::Reading;
use crate::world::{Scene, WorldState};
use known::Known;
use lead::Lead;

pub use devices::{Devices, Laboratory, laboratory, robot_of};
pub use learning::Learnt;
pub use perform::{Ending, Run, Timing, Tried, Water};
pub use stdlib::Stdlib;

/// Why a verb of the cell could not be done.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file cannot be read or written.
    #[error("{path}: {error}")]
    File {
        /// Which.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// The text has mistakes.
    #[error("{} mistakes in the text", .0.len())]
    Text(Vec<(Diagnostic, Source)>),
    /// The call cannot be made a graph.
    #[error("{}", .0.iter().map(|p| p.message.as_str()).collect::<Vec<_>>().join("; "))]
    Graph(Vec<graph::Problem>),
    /// No branch of the graph is possible.
    #[error("{0}")]
    Branch(#[from] graph::Error),
    /// There is no such scene.
    #[error("no `scene` in {0}")]
    NoScene(String),
    /// The scene's robot is none, or lacks what every action needs.
    #[error("{0}")]
    Robot(#[from] stdlib::RobotError),
    /// The lab cannot be built.
    #[error("the lab cannot be built: {0}")]
    Lab(String),
    /// The camera's picture cannot be aligned.
    #[error("{0}")]
    Calibrate(calibrate::Error),
    /// Objects the call needs are not where the camera looks.
    #[error("{} cannot be seen: {}", .0.iter().map(|(o, _)| format!("`{o}`")).collect::<Vec<_>>().join(", "),
        .0.iter().map(|(_, why)| why.as_str()).collect::<Vec<_>>().join("; "))]
    NotSeen(Vec<(String, String)>),
    /// The arm does not get at an object the call needs; nothing has moved.
    #[error("`{object}` is {:.0} mm out of reach", .by * 1e3)]
    OutOfReach {
        /// Which.
        object: String,
        /// How far, m.
        by: f64,
    },
    /// What the call needs is false before it begins; nothing has moved.
    #[error("`{call}` needs `{what}`, which is false{by}")]
    Needs {
        /// The call.
        call: String,
        /// The condition.
        what: String,
        /// By how much, in words: ` by 3 mm`.
        by: String,
    },
    /// Everything failed in the twin.
    #[error("none of {tried} candidates survived the twin; the best failed at {step}: {reason}")]
    NoSurvivor {
        /// How many were tried.
        tried: usize,
        /// Where the best one failed.
        step: String,
        /// Why.
        reason: String,
    },
    /// A folder holds no run that can be read.
    #[error("{path} is no run that can be read: {why}")]
    Record {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// There is nothing to do.
    #[error("there is nothing to do")]
    NothingToDo,
    /// The model that was to answer questions does not answer.
    #[error("the model at {endpoint} does not answer: {why}")]
    Model {
        /// Where it was looked for.
        endpoint: String,
        /// Why.
        why: String,
    },
    /// An action could not be done.
    #[error("{0}")]
    Action(#[from] ActionError),
}

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

/// Arm, cameras, world, twin and graph.
pub struct WorkCell {
    library: Library,
    stdlib: Stdlib,
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
    lead: Option<Lead>,
    model: Option<Endpoint>,
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
        let known = Known::of(&library, &scene.name);
        // Reality is put up from what is declared; everything else works with what is known.
        let Devices { arm, camera, scales, limits } = connect(&robot, &scene, &options)?;
        let scene = Arc::new(known.scene(&scene));
        let (robot, pace) = match limits {
            None => (robot, 1.0),
            Some(most) => {
                let shares = robot.joints().iter().zip(&most.velocity);
                let pace = shares.map(|(own, most)| most / own.velocity).fold(1.0, f64::min);
                let own = Robot::clone(&robot);
                (Arc::new(own.with_limits(&most.velocity, &most.acceleration)), pace)
            }
        };
        let limits = Limits { pace, ..Limits::default() };
        let cell = Cell { robot: robot.clone(), scene: scene.clone(), limits };
        let look = ArmLook::new(&robot);
        let fan: Arc<Mutex<Fan>> = Arc::default();
        let cancel = Cancel::default();
        let body = RealBody::new(
            cell.clone(),
            arm,
            camera,
            Calibration::nominal(&scene),
            Belief::new(scene),
            look.clone(),
            fan.clone(),
        );
        let dial = Dial::default();
        let mut stage = Stage::new(
            cell.clone(),
            Box::new(body),
            Vec::new(),
            Tape::recording(),
            (options.seed, 0),
            cancel.clone(),
            fan.clone(),
        );
        stage.obey(dial.clone());
        let mut settings = Settings::for_arm(&robot);
        known.change(&mut settings);
        Ok(Self {
            library,
            cell,
            settings,
            known,
            look,
            stdlib: options.stdlib,
            scripts: Scripts::new(stage),
            scales,
            robot_name: options.robot,
            seed: options.seed,
            switches: options.switches,
            cancel,
            clock: options.clock,
            fan,
            is_camera_aligned: false,
            is_robot_aligned: false,
            learnt: Learnt::default(),
            dial,
            lead: None,
            model: None,
        })
    }

    /// Returns the wish to stop that everything in this cell obeys.
    pub fn cancel(&self) -> Cancel {
        self.cancel.clone()
    }

    /// Returns the speed dial of this cell's arm.
    pub fn dial(&self) -> Dial {
        self.dial.clone()
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
            calibrate::camera(&mut self.scripts.stage(), self.switches)?;
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
            calibrate::robot(&mut self.scripts.stage(), self.switches)?;
            self.is_robot_aligned = true;
            self.scripts.stage().look()?;
        }
        Ok(())
    }

    /// Says which of the call's own needs is false now; what nobody knows does not stand in the way.
    fn check_needs(&self, graph: &Graph) -> Result<(), Error> {
        let state = self.state()?;
        let likeliest = self.parses(graph, &state, 1)?;
        let Some(first) = likeliest.first().and_then(|pg| pg.steps.first()) else {
            return Ok(());
        };
        let scene = self.cell.scene.clone();
        let walker = Walker::new(&self.scripts, &self.stdlib, &self.library, &scene, &state);
        let root = &graph.root().path;
        let own = first.needs.iter().filter(|need| need.owner == *root);
        for part in own.flat_map(|need| parts(&need.expr)) {
            let reading = walker.read(part, &state);
            if reading.truth != Some(false) {
                continue;
            }
            let by = reading.margin.map_or(0.0, |margin| margin.value.abs());
            return Err(match about(part) {
                Some(("reachable", object)) => Error::OutOfReach { object, by },
                Some(("visible", object)) => {
                    Error::NotSeen(vec![(object, "nothing in the picture looks like it".into())])
                }
                _ => Error::Needs {
                    call: graph.root().label.clone(),
                    what: crate::language::text::expr(part),
                    by: reading.margin.map_or_else(String::new, |mut margin| {
                        margin.value = margin.value.abs();
                        format!(" by {margin}")
                    }),
                },
            });
        }
        Ok(())
    }

    /// Returns up to `k` parse graphs that differ in what people choose, the likeliest first.
    fn parses(
        &self,
        graph: &Graph,
        start: &WorldState,
        k: usize,
    ) -> Result<Vec<ParseGraph>, Error> {
        Ok(self.inferring(graph, start, |given| graph::diverse(graph, given, k))?)
    }

    /// Returns what is to be done about a failure, chosen by what holds now.
    fn recovery_now(
        &self,
        graph: &Graph,
        failed: &ParseGraph,
        plan: usize,
    ) -> Result<RecoveryPlan, Error> {
        let state = self.state()?;
        let foreseen = &failed.recoveries[plan];
        let now = self.inferring(graph, &state, |given| graph::after_failure(graph, given, failed));
        let now = now.recoveries.into_iter().find(|plan| plan.path == foreseen.path);
        Ok(now.unwrap_or_else(|| foreseen.clone()))
    }

    /// After a failed step: the same choices but for the nearest branch not yet tried, and where to go on.
    fn other_branch(
        &self,
        graph: &Graph,
        failed: &ParseGraph,
        index: usize,
        tried: &mut BTreeMap<String, Vec<String>>,
    ) -> Result<Option<(ParseGraph, usize)>, Error> {
        let state = self.state()?;
        let retry = |given: &infer::Given<'_>| graph::retry(graph, given, failed, index, tried);
        Ok(self.inferring(graph, &state, retry)?)
    }

    /// Infers with what holds in a state of the world, and with what earlier runs have taught.
    fn inferring<T>(
        &self,
        graph: &Graph,
        state: &WorldState,
        infer: impl FnOnce(&infer::Given<'_>) -> T,
    ) -> T {
        let Learnt { outcomes, priors, domain, explore } = &self.learnt;
        let explore = explore.then_some(self.seed);
        let costs = graph::outcome::costs(graph, outcomes, domain, priors.as_ref(), explore);
        let scene = self.cell.scene.clone();
        let walker = Walker::new(&self.scripts, &self.stdlib, &self.library, &scene, state);
        infer(&infer::Given {
            definitions: &self.library,
            holds: &|expr: &Expr| walker.read(expr, state).truth,
            pins: &BTreeMap::new(),
            priors: priors.as_ref(),
            cost: &|node| costs.get(&node.id).copied().unwrap_or(0.0),
        })
    }

    /// Returns what a condition is worth now.
    ///
    /// # Errors
    ///
    /// When the arm does not answer.
    pub fn read(&self, condition: &Expr) -> Result<Reading, Error> {
        let state = self.state()?;
        let scene = self.cell.scene.clone();
        let walker = Walker::new(&self.scripts, &self.stdlib, &self.library, &scene, &state);
        Ok(walker.read(condition, &state))
    }

    /// Returns what a quantity is worth now; `None` when nobody knows, or it is none.
    ///
    /// # Errors
    ///
    /// When the arm does not answer.
    pub fn quantity(&self, expr: &Expr) -> Result<Option<Quantity>, Error> {
        let state = self.state()?;
        let scene = self.cell.scene.clone();
        let walker = Walker::new(&self.scripts, &self.stdlib, &self.library, &scene, &state);
        Ok(walker.quantity(expr, &state))
    }

    /// Returns why a call cannot be done as far as is known now: which of its needs is false. Before the
    /// first look at the table nobody knows of any.
    pub fn hindrance(&self, call: &Call) -> Option<String> {
        if !self.is_camera_aligned {
            return None;
        }
        let checked = self.graph(call).and_then(|graph| self.check_needs(&graph));
        checked.err().map(|error| error.to_string())
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
        let mut wrong = self.library.check_step(step, source, &scope);
        wrong.extend(together::check_step(step, &self.library, &self.stdlib));
        wrong
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

/// Returns what must all hold for a condition to hold.
fn parts(condition: &Expr) -> Vec<&Expr> {
    match &condition.kind {
        ExprKind::Binary(a, BinaryOp::And, b) => parts(a).into_iter().chain(parts(b)).collect(),
        _ => vec![condition],
    }
}

/// Returns the name and the first argument of a fluent: `reachable` and `cup` of `reachable(cup)`.
fn about(fluent: &Expr) -> Option<(&str, String)> {
    let ExprKind::Call(call) = &fluent.kind else { return None };
    match &call.args.first()?.values.first()?.kind {
        ExprKind::Name(object) => Some((&call.name.text, object.clone())),
        _ => None,
    }
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

impl From<calibrate::Error> for Error {
    fn from(error: calibrate::Error) -> Self {
        match error {
            // A stop is a stop wherever it reaches the arm.
            calibrate::Error::Action(error) => Self::Action(error),
            other => Self::Calibrate(other),
        }
    }
}

impl From<DeviceError> for Error {
    fn from(error: DeviceError) -> Self {
        Self::Action(error.into())
    }
}
