//! What an action script acts upon: one arm, what is known of the world, and the tape of decisions.
//!
//! The same words serve the twin and the arm. In the twin they plan and record; on the arm they play what
//! the twin survived, corrected by regression 3, through [`super::limits`]. The words are bound to rhai in
//! [`super::script`]; planning itself is in [`super::plan`].

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use image::RgbImage;
use nalgebra::Vector3;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rhai::Dynamic;

use crate::motion::robot::Robot;
use crate::motion::trajectory::{self, Trajectory};
use crate::world::frame::{Tool, World};
use crate::world::{Pose, Scene, WorldState};

use super::arm::{Arm, Cancel, DeviceError, Feedback, Grip};
use super::beside::{Openings, Order};
use super::calibrate::Calibration;
use super::conduct::Dial;
use super::during::{During, Sight};
use super::limits::{LimitError, Limits};
use super::plan::{Grasp, NoWay, Placement, Planner, Pour};
use super::tape::{Ended, Entry, OffTape, Tape};
use super::timing::Past;
use super::trace::{Event, Observer};

/// Why an action could not be done.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ActionError {
    /// A person asked to stop.
    #[error("stopped; the arm holds its position")]
    Stopped,
    /// A device failed.
    #[error("{0}")]
    Device(DeviceError),
    /// The limits refused the motion.
    #[error("{0}")]
    Limit(#[from] LimitError),
    /// There is no way to do it.
    #[error("{0}")]
    NoWay(#[from] NoWay),
    /// It is not what was rehearsed.
    #[error("{0}")]
    OffTape(#[from] OffTape),
    /// The script itself gave up.
    #[error("{0}")]
    Refused(String),
    /// What ends the step is true: no error, but nothing more is to be done in it.
    #[error("the step is over")]
    Ended,
    /// A condition that must hold while the step runs is broken, or its time is up.
    #[error("{0}")]
    Broken(String),
}

impl ActionError {
    /// Whether a script may catch it and go on.
    pub fn can_be_caught(&self) -> bool {
        !matches!(self, Self::Stopped | Self::Ended | Self::Broken(_))
    }
}

impl From<DeviceError> for ActionError {
    fn from(error: DeviceError) -> Self {
        match error {
            DeviceError::Stopped => Self::Stopped,
            other => Self::Device(other),
        }
    }
}

/// Someone who watches, shared between the stage and whoever owns it.
pub type Watcher = Arc<Mutex<dyn Observer + Send>>;

/// A body in a world: the twin's, or a real one behind devices.
pub trait Body: Send {
    /// Lends the arm.
    fn arm(&mut self) -> &mut dyn Arm;

    /// Returns the world as far as it is known now.
    fn state(&mut self) -> Result<WorldState, DeviceError>;

    /// Returns what can be known of the world while the arm moves.
    fn sight(&self) -> Box<dyn Sight>;

    /// Looks at the table and takes what it sees for what is there.
    fn look(&mut self) -> Result<(), DeviceError>;

    /// Photographs the table; what the picture shows is worked out beside whatever the arm does next, and is
    /// known after [`Self::look_end`].
    fn look_begin(&mut self) -> Result<(), DeviceError> {
        self.look()
    }

    /// Takes what the picture of [`Self::look_begin`] shows for what is there.
    fn look_end(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    /// Returns the joint positions to command so that the arm really goes to `q` (regression 3).
    fn correct(&self, q: &[f64]) -> Vec<f64>;

    /// Returns where the arm really is, as joint positions of the plan, when it was sent to `q`: what
    /// [`Self::correct`] undoes.
    fn uncorrect(&self, q: &[f64]) -> Vec<f64>;

    /// Takes note of how a grip on `aim` ended.
    fn gripped(&mut self, grip: Grip, aim: Option<&str>) -> Result<(), DeviceError>;

    /// Takes note of the mass in the hand, kg.
    fn weighed(&mut self, mass: f64);

    /// Returns whether two things touch, `None` when nobody can tell.
    fn contact(&mut self, a: &str, b: &str) -> Option<bool>;

    /// Returns whether water still clings to the lip of `o`, as far as the twin knows of such a thing.
    fn drips(&mut self, _o: &str) -> bool {
        false
    }

    /// Takes a photograph, where there is a camera.
    fn photo(&mut self) -> Result<Option<RgbImage>, DeviceError> {
        Ok(None)
    }

    /// Puts the three regressions in force, where there is something to correct.
    fn calibrate(&mut self, _calibration: Calibration) {}

    /// Returns the regressions in force.
    fn calibration(&self) -> Option<&Calibration> {
        None
    }
}

/// What never changes while actions run.
#[derive(Debug, Clone)]
pub struct Cell {
    /// The arm model.
    pub robot: Arc<Robot>,
    /// What is known beforehand.
    pub scene: Arc<Scene>,
    /// Bounds on every motion.
    pub limits: Limits,
}

/// What actions remember for later actions, by name.
pub type Memory = BTreeMap<String, Dynamic>;

/// One arm, one belief, one tape.
pub struct Stage {
    cell: Cell,
    body: Box<dyn Body>,
    tape: Tape,
    chance: StdRng,
    /// Which of several equally planned candidates this is; 0 always takes the best way.
    variant: usize,
    /// Where the plan has the arm, rad, before correction.
    q: Vec<f64>,
    /// Joint torques with an empty hand, beyond the model, N·m.
    tare: Option<Vec<f64>>,
    /// How far the arm may be from where it says, m; plans leave so much more room around objects.
    doubt: f64,
    memory: Memory,
    /// What must hold, and what ends the step, while one runs.
    during: Option<During>,
    /// Whether the step before ended sooner than its script.
    was_cut: bool,
    past: Past,
    /// What a script wants done beside a motion, while it is asked.
    orders: Option<Vec<Order>>,
    /// How far the fingers were open, while something is done beside a motion.
    openings: Option<Openings>,
    cancel: Cancel,
    dial: Dial,
    watcher: Watcher,
}

/// An arm further than this from where its next path begins is not led there, rad: what lies between was
/// not rehearsed.
const BRIDGE: f64 = 0.2;
/// How fast it is led there, as a share of full speed.
const BRIDGE_SPEED: f64 = 0.3;
/// How fast the fingers go, m/s, and with how much force they open, N.
const FINGER_SPEED: f64 = 0.06;
const OPEN_FORCE: f64 = 60.0;
/// What a grip's progress is counted in, s: nobody knows beforehand how long it takes.
const GRIP: f64 = 1.0;

impl Stage {
    /// Puts a body on stage where the plan has it at `q` (rad).
    pub fn new(
        cell: Cell,
        body: Box<dyn Body>,
        q: Vec<f64>,
        tape: Tape,
        chance: (u64, usize),
        cancel: Cancel,
        watcher: Watcher,
    ) -> Self {
        let (seed, variant) = chance;
        let mixed = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(variant as u64);
        let chance = StdRng::seed_from_u64(mixed);
        Self {
            cell,
            body,
            tape,
            chance,
            variant,
            q,
            tare: None,
            doubt: 0.0,
            memory: Memory::new(),
            during: None,
            was_cut: false,
            past: Past::default(),
            orders: None,
            openings: None,
            cancel,
            dial: Dial::default(),
            watcher,
        }
    }

    /// Lets a dial slow the arm down from now on.
    pub fn obey(&mut self, dial: Dial) {
        self.dial = dial;
    }

    /// Returns the wish to stop that this stage obeys.
    pub fn cancel(&self) -> &Cancel {
        &self.cancel
    }

    /// Returns the constants.
    pub fn cell(&self) -> &Cell {
        &self.cell
    }

    /// Returns where the plan has the arm, rad.
    pub fn planned_q(&self) -> &[f64] {
        &self.q
    }

    /// Lets the plan begin where the arm was last sent, as the regressions in force understand it.
    pub fn find_arm(&mut self) -> Result<(), ActionError> {
        let sent = self.body.arm().feedback()?.q_cmd;
        let mut q = self.body.uncorrect(&sent);
        // A stop may leave a joint, or what is read of it, a hair past its range: plans begin inside.
        for (q, limit) in q.iter_mut().zip(self.cell.robot.joints()) {
            if (*q - q.clamp(limit.lower, limit.upper)).abs() < self.cell.limits.jump {
                *q = q.clamp(limit.lower + 1e-6, limit.upper - 1e-6);
            }
        }
        self.q = q;
        Ok(())
    }

    /// Sets how far the arm may be from where it says, m.
    pub fn doubt_arm(&mut self, doubt: f64) {
        self.doubt = doubt;
    }

    /// Returns what was decided so far.
    pub fn tape(&self) -> &Tape {
        &self.tape
    }

    /// Plays these decisions from now on, or records new ones.
    pub fn set_tape(&mut self, tape: Tape) {
        self.tape = tape;
    }

    /// Returns what actions remember.
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// Puts other memories in place.
    pub fn set_memory(&mut self, memory: Memory) {
        self.memory = memory;
    }

    /// Returns what is known of the times of this run's steps.
    pub fn past(&mut self) -> &mut Past {
        &mut self.past
    }

    /// Puts the times of a run in place: none when it begins, those so far when it is rehearsed further.
    pub fn set_past(&mut self, past: Past) {
        self.past = past;
    }

    /// From now on scripts are asked what they want done beside a motion, and nothing is done.
    pub fn take_orders(&mut self) {
        self.orders = Some(Vec::new());
    }

    /// Ends that, and returns what they want.
    pub fn orders(&mut self) -> Vec<Order> {
        self.orders.take().unwrap_or_default()
    }

    /// Opens the fingers once `after` s have passed, beside whatever the arm does then.
    pub fn open_beside(&mut self, after: f64) -> Result<(), ActionError> {
        let widest = self.cell.robot.max_opening();
        let grip = self.cell.limits.clear_grip(&self.cell, widest, FINGER_SPEED, OPEN_FORCE)?;
        Ok(self.body.arm().send_fingers(&grip, after)?)
    }

    /// Takes note of the fingers' opening at every tick, or no longer.
    pub fn note_openings(&mut self, openings: Option<Openings>) {
        self.openings = openings;
    }

    /// Begins the step of that path on the tape; returns when the rehearsal saw what ends it come true.
    pub fn begin_step(&mut self, path: &str) -> Result<Option<Ended>, OffTape> {
        self.tape.begin(path, std::mem::take(&mut self.was_cut))
    }

    /// Ends the step that just began, since what ends it is true already.
    pub fn ended_on_arrival(&mut self) {
        self.tape.record(Entry::Ended(Ended::OnArrival));
        self.was_cut = true;
    }

    /// Puts conditions in force for everything the arm does from now on.
    pub fn watch_over(&mut self, during: During) {
        self.during = Some(during);
    }

    /// Puts them out of force, and returns how they fared.
    pub fn watched_over(&mut self) -> Option<During> {
        let during = self.during.take();
        self.was_cut |= during.as_ref().is_some_and(|during| during.cut().is_some());
        during
    }

    /// `remember(name, value)`.
    pub fn remember(&mut self, name: &str, value: Dynamic) {
        self.memory.insert(name.to_owned(), value);
    }

    /// `recall(name)`.
    pub fn recall(&self, name: &str) -> Result<Dynamic, ActionError> {
        self.memory
            .get(name)
            .cloned()
            .ok_or_else(|| ActionError::Refused(format!("no earlier action remembered a `{name}`")))
    }

    /// Lends the body.
    pub fn body(&mut self) -> &mut dyn Body {
        self.body.as_mut()
    }

    /// Returns the world as far as it is known now.
    pub fn state(&mut self) -> Result<WorldState, ActionError> {
        Ok(self.body.state()?)
    }

    /// Tells whoever watches.
    pub fn tell(&self, event: &Event) {
        self.watcher.lock().unwrap_or_else(PoisonError::into_inner).event(event);
    }

    /// Returns how the arm can get at `o`: nothing, or why not.
    pub fn reachable(&mut self, o: &str) -> Result<(), NoWay> {
        match self.planner() {
            Ok(planner) => planner.reachable(o),
            // An arm that does not answer is a device error the next step will tell.
            Err(_) => Ok(()),
        }
    }

    /// Goes to a tool pose round everything in the way; for calibration, without a tape.
    pub fn visit(&mut self, at: &Pose<World, Tool>) -> Result<(), ActionError> {
        let planner = self.planner()?;
        let seed = self.chance.random();
        let path = planner.visit(at, seed)?;
        self.drive_corners(&path, 0.8)
    }

    /// Returns the joint positions the arm itself reports, rad.
    pub fn reported_q(&mut self) -> Result<Vec<f64>, ActionError> {
        Ok(self.body.arm().feedback()?.q)
    }

    /// `camera.look()`.
    pub fn look(&mut self) -> Result<(), ActionError> {
        if let Some(orders) = &mut self.orders {
            orders.push(Order::Look);
            return Ok(());
        }
        Ok(self.body.look()?)
    }

    /// `twin.grasps(o, face, pitch)`: ways to take `o` at a face with the tool pitched down by `pitch` rad,
    /// best first.
    pub fn grasps(&mut self, o: &str, face: &str, pitch: f64) -> Result<Vec<Grasp>, ActionError> {
        let taped = self.tape.next("ways to grasp", |entry| match entry {
            Entry::Grasps(ways) => Some(ways.clone()),
            _ => None,
        })?;
        if let Some(ways) = taped {
            return Ok(ways);
        }
        let pitch = match face {
            "side" => pitch,
            "top" => std::f64::consts::FRAC_PI_2,
            other => {
                let words = format!("there is no face `{other}`; faces are side and top");
                return Err(ActionError::Refused(words));
            }
        };
        let ways = self.planner()?.grasps(o, pitch)?;
        self.tape.record(Entry::Grasps(ways.clone()));
        Ok(ways)
    }

    /// `twin.pours(o, at, clearance)`: ways to pour from `o` in the hand into `at`, best first.
    pub fn pours(&mut self, o: &str, at: &str, clearance: f64) -> Result<Vec<Pour>, ActionError> {
        let taped = self.tape.next("ways to pour", |entry| match entry {
            Entry::Pours(ways) => Some(ways.clone()),
            _ => None,
        })?;
        if let Some(ways) = taped {
            return Ok(ways);
        }
        let ways = self.planner()?.pours(o, at, clearance)?;
        self.tape.record(Entry::Pours(ways.clone()));
        Ok(ways)
    }

    /// `twin.placements(o)`: ways to put `o` down on a free place of the table, best first.
    pub fn placements(&mut self, o: &str) -> Result<Vec<Placement>, ActionError> {
        let taped = self.tape.next("ways to put down", |entry| match entry {
            Entry::Placements(ways) => Some(ways.clone()),
            _ => None,
        })?;
        if let Some(ways) = taped {
            return Ok(ways);
        }
        let ways = self.planner()?.placements(o)?;
        self.tape.record(Entry::Placements(ways.clone()));
        Ok(ways)
    }

    /// `twin.enough(o, volume)`: whether `o` has gained so much, m³, since the run began in the twin; on the
    /// arm, which cannot weigh while it pours, what the twin said at this point of the rehearsal.
    pub fn enough(&mut self, o: &str, volume: f64) -> Result<bool, ActionError> {
        self.foreseen(|stage| Ok(stage.volume(o)? >= volume))
    }

    /// `twin.drips(o)`: whether water still clings to the lip of `o` in the twin; on the arm, which cannot
    /// see it, what the twin said at this point of the rehearsal.
    pub fn drips(&mut self, o: &str) -> Result<bool, ActionError> {
        self.foreseen(|stage| Ok(stage.body.drips(o)))
    }

    /// Answers a question in the twin and remembers the answer, or repeats it on the arm.
    fn foreseen(
        &mut self,
        ask: impl FnOnce(&mut Self) -> Result<bool, ActionError>,
    ) -> Result<bool, ActionError> {
        let taped = self.tape.next("a yes or no", |entry| match entry {
            Entry::Choice(chosen) => Some(*chosen == 1),
            _ => None,
        })?;
        if let Some(answer) = taped {
            return Ok(answer);
        }
        let answer = ask(self)?;
        self.tape.record(Entry::Choice(usize::from(answer)));
        Ok(answer)
    }

    /// `choose(ways)`: the best one in the first candidate, a good one in the others.
    pub fn choose(&mut self, n: usize) -> Result<usize, ActionError> {
        let taped = self.tape.next("a choice", |entry| match entry {
            Entry::Choice(chosen) => Some(*chosen),
            _ => None,
        })?;
        if let Some(chosen) = taped {
            return Ok(chosen);
        }
        if n == 0 {
            return Err(ActionError::Refused("there is nothing to choose from".into()));
        }
        let mut chosen = 0;
        // Ways come best first, so later ones are taken ever more rarely.
        while self.variant > 0 && chosen + 1 < n && self.chance.random_bool(0.5) {
            chosen += 1;
        }
        self.tape.record(Entry::Choice(chosen));
        Ok(chosen)
    }

    /// `twin.pose_named(name)`: joint positions of a named pose of the robot, rad.
    pub fn named_pose(&self, name: &str) -> Result<Vec<f64>, ActionError> {
        let pose = self.cell.robot.pose(name);
        pose.map(<[f64]>::to_vec).map_err(|error| ActionError::Refused(error.to_string()))
    }

    /// `twin.position(o)`: where `o` stands, m in the world.
    pub fn position(&mut self, o: &str) -> Result<[f64; 3], ActionError> {
        let state = self.state()?;
        let pose = state.object(o).and_then(|object| object.world_from_object);
        let pose =
            pose.ok_or_else(|| ActionError::Refused(format!("nobody knows where `{o}` is")))?;
        Ok(pose.origin().into())
    }

    /// `twin.volume(o)`: water in `o`, m³.
    pub fn volume(&mut self, o: &str) -> Result<f64, ActionError> {
        let state = self.state()?;
        let water = state.object(o).and_then(|object| object.water);
        water.ok_or_else(|| ActionError::Refused(format!("nobody knows how much is in `{o}`")))
    }

    /// `arm.move_to(q)`, `arm.carry_to(q, tilt, speed)`: a free motion round everything in the way, with the
    /// hand within `tilt` rad of upright when that is asked for.
    pub fn move_to(&mut self, q: &[f64], tilt: Option<f64>, speed: f64) -> Result<(), ActionError> {
        let path = if let Some(path) = self.taped_path()? {
            path
        } else {
            let seed = self.chance.random();
            let path = self.planner()?.free(q, tilt, seed)?;
            self.tape.record(Entry::Path(path.clone()));
            path
        };
        self.drive_corners(&path, speed)
    }

    /// `arm.move_by([x, y, z], speed)`: a straight line of the tool in the world, orientation kept.
    pub fn move_by(&mut self, by: [f64; 3], speed: f64) -> Result<(), ActionError> {
        let path = if let Some(path) = self.taped_path()? {
            path
        } else {
            let path = self.planner()?.line(Vector3::from(by))?;
            self.tape.record(Entry::Path(path.clone()));
            path
        };
        self.follow(&path, speed)
    }

    /// `arm.follow(path, speed)`: a joint path at a fraction of the speed limits.
    pub fn follow(&mut self, path: &[Vec<f64>], speed: f64) -> Result<(), ActionError> {
        let trajectory = Trajectory::through_points(&self.corrected(path), &self.paced(speed))
            .map_err(|error| ActionError::Refused(error.to_string()))?;
        self.drive(self.dialled(trajectory), path)
    }

    /// Follows straight joint motions from corner to corner, the corners a little rounded.
    fn drive_corners(&mut self, corners: &[Vec<f64>], speed: f64) -> Result<(), ActionError> {
        // Planning keeps a margin wider than a corner cut this short moves any point of the arm, rad.
        const CUT: f64 = 0.05;
        let corrected = self.corrected(corners);
        let trajectory =
            Trajectory::through_corners(&corrected, &self.paced(speed), CUT, &|_, _| true)
                .map_err(|error| ActionError::Refused(error.to_string()))?;
        self.drive(self.dialled(trajectory), corners)
    }

    /// Returns the same motion as slow as the dial says. Turns that pour are left as they are: see [`Dial`].
    fn dialled(&self, trajectory: Trajectory) -> Trajectory {
        match self.dial.percent() {
            100 => trajectory,
            _ => trajectory.slowed(self.dial.stretch()),
        }
    }

    /// Returns the robot's limits at a fraction of its speed.
    fn paced(&self, speed: f64) -> trajectory::Limits {
        let speed = speed.clamp(0.02, 1.0);
        trajectory::Limits::of(&self.cell.robot).scaled(speed, speed)
    }

    /// `arm.turn(path, rate)`: a joint path that turns the hand, at `rate` rad/s.
    pub fn turn(&mut self, path: &[Vec<f64>], rate: f64) -> Result<(), ActionError> {
        let angle = super::plan::turned_angle(&self.cell.robot, path);
        let trajectory = Trajectory::through_points(&self.corrected(path), &self.paced(1.0))
            .map_err(|error| ActionError::Refused(error.to_string()))?;
        let slower = angle / rate.max(1e-3) / trajectory.duration().max(1e-3);
        let trajectory = if slower > 1.0 { trajectory.slowed(slower) } else { trajectory };
        self.drive(trajectory, path)
    }

    /// `arm.turn_back(path, rate)`: what is left of a turn, back to its beginning, from wherever it stopped.
    pub fn turn_back(&mut self, path: &[Vec<f64>], rate: f64) -> Result<(), ActionError> {
        let off = |q: &[f64]| super::plan::distance(q, &self.q);
        let Some(at) = (0..path.len()).min_by(|&a, &b| off(&path[a]).total_cmp(&off(&path[b])))
        else {
            return Ok(());
        };
        let mut back: Vec<_> = path[..=at].iter().rev().cloned().collect();
        if off(&path[at]) > 0.01 {
            back.insert(0, self.q.clone());
        }
        if back.len() < 2 { Ok(()) } else { self.turn(&back, rate) }
    }

    /// `arm.open()`: fingers as wide as they go.
    pub fn open(&mut self) -> Result<(), ActionError> {
        if let Some(orders) = &mut self.orders {
            orders.push(Order::Open);
            return Ok(());
        }
        let widest = self.cell.robot.max_opening();
        let grip = self.grip(widest, OPEN_FORCE)?;
        self.body.gripped(grip, None)?;
        Ok(())
    }

    /// `arm.close(o, force)`: fingers closed on `o` with at most `force` N.
    pub fn close(&mut self, o: &str, force: f64) -> Result<(), ActionError> {
        self.tare()?;
        let grip = self.grip(0.0, force)?;
        self.body.gripped(grip, Some(o))?;
        Ok(())
    }

    /// `arm.wait(seconds)`.
    pub fn wait(&mut self, seconds: f64) -> Result<(), ActionError> {
        self.act(seconds, |arm, cancel, watch| arm.wait(seconds, cancel, watch))
    }

    /// `arm.opening()`: opening between the pads, m.
    pub fn opening(&mut self) -> Result<f64, ActionError> {
        Ok(self.body.arm().feedback()?.opening)
    }

    /// `arm.weigh()`: the mass in the hand, kg, from joint torques held still for half a second.
    ///
    /// The tare taken before the fingers closed takes the sensors' bias out.
    pub fn weigh(&mut self) -> Result<f64, ActionError> {
        let (q, mut excess) = self.torque_excess(0.5)?;
        if let Some(tare) = &self.tare {
            for (joint, bias) in excess.iter_mut().zip(tare) {
                *joint -= bias;
            }
        }
        let column = super::plan::payload_torque(&self.cell.robot, &q);
        let along: f64 = column.iter().zip(&excess).map(|(c, e)| c * e).sum();
        let norm: f64 = column.iter().map(|c| c * c).sum();
        let mass = if norm > 1e-9 { along / norm } else { 0.0 };
        self.body.weighed(mass);
        Ok(mass)
    }

    fn tare(&mut self) -> Result<(), ActionError> {
        self.tare = Some(self.torque_excess(0.5)?.1);
        Ok(())
    }

    /// Returns the mean joint positions and the mean torques beyond the model's, over `seconds` at rest.
    fn torque_excess(&mut self, seconds: f64) -> Result<(Vec<f64>, Vec<f64>), ActionError> {
        let mut samples: Vec<Feedback> = Vec::new();
        // The arm swings out for a moment before the torques are worth reading.
        self.wait(0.3)?;
        self.act(seconds, |arm, cancel, watch| {
            arm.wait(seconds, cancel, &mut |feedback| {
                samples.push(feedback.clone());
                watch(feedback);
            })
        })?;
        let n = self.q.len();
        let mean = |pick: &dyn Fn(&Feedback) -> &Vec<f64>| -> Vec<f64> {
            let count = samples.len().max(1) as f64;
            (0..n)
                .map(|joint| samples.iter().map(|s| pick(s)[joint]).sum::<f64>() / count)
                .collect()
        };
        let (q, tau) = (mean(&|s| &s.q), mean(&|s| &s.tau));
        let model = super::plan::gravity_torque(&self.cell.robot, &q);
        Ok((q, tau.iter().zip(model).map(|(tau, g)| tau - g).collect()))
    }

    fn grip(&mut self, opening: f64, force: f64) -> Result<Grip, ActionError> {
        let grip = self.cell.limits.clear_grip(&self.cell, opening, FINGER_SPEED, force)?;
        self.act(GRIP, |arm, cancel, watch| arm.grip(&grip, cancel, watch))
    }

    /// Has the arm do something that is to take `seconds`, with whoever watches told of every tick and the
    /// conditions in force read.
    fn act<T>(
        &mut self,
        seconds: f64,
        doing: impl FnOnce(&mut dyn Arm, &Cancel, &mut dyn FnMut(&Feedback)) -> Result<T, DeviceError>,
    ) -> Result<T, ActionError> {
        if self.orders.is_some() {
            let words = "this holds the arm, so it cannot be done beside a motion";
            return Err(ActionError::Refused(words.into()));
        }
        let (mut ticks, openings) = (ticks(&self.watcher), self.openings.clone());
        let mut tell = |feedback: &Feedback| {
            ticks(feedback);
            if let Some(openings) = &openings {
                openings.note(feedback);
            }
        };
        let Some(mut during) = self.during.take() else {
            return Ok(doing(self.body.arm(), &self.cancel, &mut tell)?);
        };
        during.motion_begins(self.body.sight(), seconds);
        // What cuts this motion short is not a wish to stop everything.
        let stop = self.cancel.child();
        let done = doing(self.body.arm(), &stop, &mut |feedback| {
            tell(feedback);
            if during.sees(feedback) {
                stop.cancel();
            }
        });
        during.motion_ends();
        let cut = during.cut().cloned();
        if let Some(ended) = during.ended() {
            self.tape.record(Entry::Ended(ended));
        }
        self.during = Some(during);
        match (done, cut) {
            (Err(DeviceError::Stopped), _) if self.cancel.is_cancelled() => {
                Err(ActionError::Stopped)
            }
            (Err(DeviceError::Stopped) | Ok(_), Some(cut)) => Err(cut.into()),
            (done, _) => Ok(done?),
        }
    }

    fn taped_path(&mut self) -> Result<Option<Vec<Vec<f64>>>, ActionError> {
        Ok(self.tape.next("a path", |entry| match entry {
            Entry::Path(path) => Some(path.clone()),
            _ => None,
        })?)
    }

    fn corrected(&self, path: &[Vec<f64>]) -> Vec<Vec<f64>> {
        path.iter().map(|q| self.body.correct(q)).collect()
    }

    /// Clears a trajectory and follows it; the plan then has the arm at the end of `path`.
    fn drive(&mut self, trajectory: Trajectory, path: &[Vec<f64>]) -> Result<(), ActionError> {
        self.bridge(path)?;
        let from = self.body.arm().feedback()?.q_cmd;
        let cleared = self.cell.limits.clear(&self.cell, trajectory, &from)?;
        let seconds = cleared.trajectory().duration();
        if let Err(error) = self.act(seconds, |arm, stop, watch| arm.follow(&cleared, stop, watch))
        {
            // The motion was cut short: the next plan begins where the arm was left, not at the path's end.
            self.find_arm()?;
            return Err(error);
        }
        if let Some(last) = path.last() {
            self.q.clone_from(last);
        }
        Ok(())
    }

    /// Leads the arm to where a rehearsed path begins, when a step before ended a little sooner or later
    /// than in the rehearsal.
    fn bridge(&mut self, path: &[Vec<f64>]) -> Result<(), ActionError> {
        let Some(first) = path.first().filter(|_| self.tape.is_playing()) else { return Ok(()) };
        let apart = |(a, b): (&f64, &f64)| (a - b).abs();
        let off = first.iter().zip(&self.q).map(apart).fold(0.0, f64::max);
        // What the limits would let pass anyway needs no motion of its own.
        if off < 0.5 * self.cell.limits.jump {
            return Ok(());
        }
        if off > BRIDGE {
            let off = off.to_degrees();
            return Err(ActionError::Refused(format!(
                "a joint is {off:.1} deg from where the rehearsal went on, which is too far to go \
                 unrehearsed"
            )));
        }
        let way = [self.q.clone(), first.clone()];
        let trajectory =
            Trajectory::through_points(&self.corrected(&way), &self.paced(BRIDGE_SPEED))
                .map_err(|error| ActionError::Refused(error.to_string()))?;
        let from = self.body.arm().feedback()?.q_cmd;
        let cleared = self.cell.limits.clear(&self.cell, trajectory, &from)?;
        let seconds = cleared.trajectory().duration();
        let led = self.act(seconds, |arm, stop, watch| arm.follow(&cleared, stop, watch));
        if let Some(during) = &mut self.during {
            during.uncount();
        }
        if led.is_err() {
            self.find_arm()?;
        }
        self.q.clone_from(first);
        led
    }

    fn planner(&mut self) -> Result<Planner, ActionError> {
        let state = self.body.state()?;
        let (q, cancel) = (self.q.clone(), self.cancel.clone());
        Ok(Planner::new(self.cell.clone(), state, q, self.doubt, cancel))
    }
}

fn ticks(watcher: &Watcher) -> impl FnMut(&Feedback) + use<> {
    let watcher = watcher.clone();
    move |feedback| {
        let mut watcher = watcher.lock().unwrap_or_else(PoisonError::into_inner);
        watcher.event(&Event::Tick(feedback.clone()));
    }
}
