//! A call, carried out: rehearse, choose, perform, compare after each step, recover, and say how it went.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use crate::execution::arm::Weighing;
use crate::execution::stage::ActionError;
use crate::execution::tape::Tape;
use crate::execution::timing::Past;
use crate::execution::trace::{Event, Observer, Outcome, StepRecord};
use crate::execution::walk::{Done, Walker};
use crate::graph::{self, Graph, ParseGraph};
use crate::language::ast::{Call, Remedy};
use crate::monitor::questionnaire::{self, Answer};
use crate::monitor::{self, Comparison};
use crate::vqa::Probe;
use crate::world::WorldState;

use super::lead::Turn;
use super::record::Recorder;
use super::rehearse::{Candidate, Rehearsal, Rehearsals};
use super::{Error, WorkCell, picture, tell};

/// How many candidates are rehearsed for one attempt.
const CANDIDATES: usize = 4;

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// Everything the task gives is true as measured, as far as anyone can tell.
    Success,
    /// It is not.
    Failure,
    /// A person or a limit stopped it.
    Stopped,
}

/// What became of the water.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Water {
    /// In the vessel that was poured into, mL.
    pub in_target_ml: f64,
    /// Left in the vessel that was poured from, mL.
    pub in_source_ml: f64,
    /// Anywhere else, mL.
    pub spilt_ml: f64,
    /// Whose scales say so.
    pub measured_by: String,
}

/// Seconds of wall time.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Timing {
    /// Calibrating and looking.
    pub perceive: f64,
    /// Building and choosing the graph.
    pub plan: f64,
    /// Rehearsing in the twin.
    pub simulate: f64,
    /// Performing on the arm.
    pub execute: f64,
    /// All of it.
    pub total: f64,
}

/// One rehearsal in a few words.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tried {
    /// What was chosen at each Or: `pick/either=level_side`.
    pub choices: Vec<String>,
    /// Which set of choices inside the scripts.
    pub variant: usize,
    /// Whether it survived.
    pub success: bool,
    /// Water on the table at its end, mL.
    pub spilt_ml: f64,
    /// Arm time, s.
    pub time_s: f64,
    /// Where and why it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
}

/// A run: the answer of `trueup run --json`, and `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The call: `pour(jar, cup)`.
    pub task: String,
    /// How it ended.
    pub outcome: Ending,
    /// Whether everything the task gives is true as measured.
    pub reached: bool,
    /// Why, when it did not succeed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// What would help, when a device failed: the arm, or the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device_help: Option<String>,
    /// The seed.
    pub seed: u64,
    /// `lab` or `twin`.
    pub robot: String,
    /// The program's version.
    pub version: String,
    /// The steps, as carried out.
    pub steps: Vec<StepRecord>,
    /// The questionnaire, answered by geometry after each step, and by a model where one is asked.
    pub questions: Vec<Vec<Answer>>,
    /// What the model that answers beside geometry showed it can do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub probe: Option<Probe>,
    /// What was tried in the twin, best first, attempt after attempt.
    pub rehearsals: Vec<Tried>,
    /// The parse graphs that were performed, one an attempt.
    pub parse_graphs: Vec<ParseGraph>,
    /// What the scales say at the end, where there are scales.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub water: Option<Water>,
    /// How long it took.
    pub timing_s: Timing,
    /// The run folder.
    pub run_dir: Option<String>,
}

impl Run {
    /// Returns a run of which only these steps are known, failed if the last of them did.
    pub fn so_far(task: &str, steps: &[StepRecord]) -> Self {
        let failed = steps.last().is_none_or(|step| step.outcome != Outcome::Success);
        Self {
            task: task.to_owned(),
            outcome: if failed { Ending::Failure } else { Ending::Success },
            reached: false,
            reason: None,
            device_help: None,
            seed: 0,
            robot: String::new(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            steps: steps.to_vec(),
            questions: Vec::new(),
            probe: None,
            rehearsals: Vec::new(),
            parse_graphs: Vec::new(),
            water: None,
            timing_s: Timing::default(),
            run_dir: None,
        }
    }
}

impl WorkCell {
    /// Carries out a call on the arm, rehearsed first, and keeps the run in a folder if one is given.
    ///
    /// # Errors
    ///
    /// Before anything moves: the call cannot be understood, an object is not seen, nothing survives the
    /// twin. Later failures are the run's outcome.
    pub fn run(
        &mut self,
        call: &Call,
        recorder: Option<Recorder>,
        watcher: Box<dyn Observer + Send>,
    ) -> Result<Run, Error> {
        let recorder = recorder.map(|recorder| Arc::new(Mutex::new(recorder)));
        let mut observers = vec![watcher];
        if let Some(recorder) = &recorder {
            observers.push(Box::new(Shared(recorder.clone())));
        }
        self.watched_by(observers);
        let total = self.now();
        let mut run = self.nothing_done(call);
        if let Some(recorder) = &recorder {
            let recorder = recorder.lock().unwrap_or_else(PoisonError::into_inner);
            run.run_dir = Some(recorder.dir().display().to_string());
        }
        self.lead_begins(&run.task, run.run_dir.as_deref());
        let carried = self.carry(call, &mut run, recorder.as_ref());
        self.lead_ends();
        self.watched_by(Vec::new());
        // Decisions of a performance that was cut short are not for whatever comes next.
        self.scripts.stage().set_tape(Tape::recording());
        run.timing_s.total = self.now() - total;
        let carried = match carried {
            Err(Error::Action(ActionError::Stopped)) => {
                run.outcome = Ending::Stopped;
                Ok(())
            }
            Err(error) => {
                run.reason = Some(error.to_string());
                if let Error::Action(ActionError::Device(device)) = &error {
                    run.device_help = Some(device.help().to_owned());
                }
                // Once something was done there is a run to speak of.
                if run.steps.is_empty() { Err(error) } else { Ok(()) }
            }
            Ok(()) => Ok(()),
        };
        // Whatever happened, the folder holds a whole document.
        let saved = keep(&run, recorder.as_ref());
        carried.and(saved).map(|()| run)
    }

    /// Returns the run of a call of which nothing has been done yet.
    fn nothing_done(&self, call: &Call) -> Run {
        let (seed, robot) = (self.seed, self.robot_name.clone());
        Run { seed, robot, ..Run::so_far(&crate::language::text::call(call), &[]) }
    }

    fn carry(
        &mut self,
        call: &Call,
        run: &mut Run,
        recorder: Option<&SharedRecorder>,
    ) -> Result<(), Error> {
        let begin = self.now();
        // The call is understood before anything is done for it.
        let graph = self.graph(call)?;
        if let Some(recorder) = recorder {
            let drawing = graph::draw::to_svg(&graph, &graph::draw::Drawing::default());
            let recorder = recorder.lock().unwrap_or_else(PoisonError::into_inner);
            let path = recorder.dir().join("graph.svg");
            recorder.write("graph.svg", &drawing).map_err(|error| Error::File { path, error })?;
        }
        if self.dial.percent() < 100 {
            let percent = self.dial.percent();
            self.note(&format!(
                "the arm moves at {percent} % of what is planned; `slow 100` while stepping undoes it"
            ));
        }
        self.probe_model(&graph, run)?;
        self.phase("perceive", "calibrating and looking");
        // What the call needs and does not find is said before the arm moves for regression 3.
        let perceived = self
            .perceive()
            .and_then(|()| self.check_needs(&graph))
            .and_then(|()| self.align_robot());
        run.timing_s.perceive = self.now() - begin;
        perceived?;
        let start = self.state()?;
        let attempted = self.attempt(&graph, &start, run, recorder);
        let weighing = self.scales.as_mut().and_then(|scales| scales.weigh());
        if let Some(weighing) = &weighing {
            run.water = Some(self.water(call, weighing));
        }
        attempted?;
        if run.outcome == Ending::Success {
            self.judge(&graph, &start, weighing.as_ref(), run)?;
        }
        Ok(())
    }

    /// Reads at the end what the call itself gives, with the scales' word on the water where there are
    /// scales: a false promise makes the run a failure, and only what is known to be true is reached.
    fn judge(
        &self,
        graph: &Graph,
        start: &WorldState,
        weighing: Option<&Weighing>,
        run: &mut Run,
    ) -> Result<(), Error> {
        let mut state = self.state()?;
        if let Some(weighing) = weighing {
            state.spilt = Some(weighing.spilt);
            for (vessel, water) in &weighing.water {
                if let Some(object) = state.object_mut(vessel) {
                    object.water = Some(*water);
                }
            }
        }
        let scene = self.cell.scene.clone();
        let walker = Walker::new(&self.scripts, &self.stdlib, &self.library, &scene, start);
        let last = run.parse_graphs.last().and_then(|pg| pg.steps.last());
        let given: Vec<_> = last
            .map_or(&[][..], |step| &step.gives)
            .iter()
            .filter(|given| given.owner == graph.root().path)
            .cloned()
            .collect();
        if let Some(broken) = walker.unmet(&given, &state) {
            run.outcome = Ending::Failure;
            run.reason = Some(format!("at the end it should have made true {broken}"));
        }
        run.reached =
            given.iter().all(|given| walker.read(&given.expr, &state).truth == Some(true));
        Ok(())
    }

    /// Rehearses and performs until the task is done or given up.
    fn attempt(
        &mut self,
        graph: &Graph,
        start: &WorldState,
        run: &mut Run,
        recorder: Option<&SharedRecorder>,
    ) -> Result<(), Error> {
        let begin = self.now();
        self.phase("plan", "choosing parse graphs");
        let mut candidates = self.candidates(graph, start)?;
        run.timing_s.plan += self.now() - begin;
        self.scripts.stage().set_past(Past::default());
        let mut tried_branches = BTreeMap::new();
        let mut used: BTreeMap<String, u32> = BTreeMap::new();
        loop {
            let best = self.rehearse(candidates, start, run)?;
            let begin = self.now();
            self.phase("execute", "the arm moves");
            let failed = self.perform(graph, &best, start, run, recorder);
            run.timing_s.execute += self.now() - begin;
            let Some((index, reason)) = failed? else {
                run.outcome = Ending::Success;
                return Ok(());
            };
            self.note(&format!("step failed: {reason}"));
            let pg = &best.candidate.pg;
            let recovery = recovery(pg, index, &used);
            let Some(recovery) = recovery else {
                run.reason = Some(reason);
                return Ok(());
            };
            let plan = self.recovery_now(graph, pg, recovery)?;
            *used.entry(plan.path.clone()).or_default() += 1;
            self.note(&format!("recovering: {}", plan.path));
            if let Err(error) = self.carry_out(graph, &plan.steps, start, run, recorder) {
                let stopped = matches!(error, Error::Action(ActionError::Stopped));
                run.reason = Some(format!("{reason}; then the recovery failed: {error}"));
                return if stopped { Err(error) } else { Ok(()) };
            }
            match plan.remedy {
                Some(Remedy::Retry { other, .. }) => {
                    let from = if other {
                        self.other_branch(graph, pg, index, &mut tried_branches)?
                    } else {
                        None
                    };
                    let (pg, from) = from.unwrap_or_else(|| (pg.clone(), first_of(pg, index)));
                    candidates = (0..CANDIDATES)
                        .map(|variant| Candidate { pg: pg.clone(), from, variant })
                        .collect();
                }
                Some(Remedy::Abort(why)) => {
                    run.reason = Some(match why {
                        Some(why) => format!("{reason}; {why}"),
                        None => reason,
                    });
                    return Ok(());
                }
                None => {
                    run.reason = Some(reason);
                    return Ok(());
                }
            }
        }
    }

    /// Returns the candidates of a first attempt: the likeliest parse graphs, each with its best ways and
    /// with others.
    fn candidates(&self, graph: &Graph, start: &WorldState) -> Result<Vec<Candidate>, Error> {
        let pgs = self.parses(graph, start, CANDIDATES / 2)?;
        Ok((0..CANDIDATES)
            .map(|i| Candidate { pg: pgs[i % pgs.len()].clone(), from: 0, variant: i / pgs.len() })
            .collect())
    }

    /// Rehearses candidates from the present and returns the best survivor.
    fn rehearse(
        &mut self,
        candidates: Vec<Candidate>,
        start: &WorldState,
        run: &mut Run,
    ) -> Result<Rehearsal, Error> {
        let begin = self.now();
        let n = candidates.len();
        self.phase("simulate", &format!("{n} candidates in the twin{}", self.known.words()));
        for name in &self.known.aside {
            self.note(&format!("{name} is not simulated: the twin has no law for it"));
        }
        let state = self.state()?;
        let q = self.scripts.stage().planned_q().to_vec();
        let memory = self.scripts.stage().memory().clone();
        let past = self.scripts.stage().past().clone();
        let finished = Mutex::new(0_usize);
        let tried = Rehearsals {
            cell: &self.cell,
            look: &self.look,
            settings: &self.settings,
            stdlib: &self.stdlib,
            library: &self.library,
            state: &state,
            start,
            q: &q,
            memory: &memory,
            past: &past,
            seed: self.seed,
            cancel: &self.cancel,
        }
        .all(candidates, &|_| {
            let mut finished = finished.lock().unwrap_or_else(PoisonError::into_inner);
            *finished += 1;
            tell(
                &self.fan,
                &Event::Progress {
                    what: "rehearsals".into(),
                    fraction: *finished as f64 / n as f64,
                },
            );
        })?;
        run.timing_s.simulate += self.now() - begin;
        run.rehearsals.extend(tried.iter().map(summary));
        for rehearsal in &tried {
            self.note(&told(rehearsal));
        }
        let Some(best) = tried.into_iter().next() else {
            return Err(Error::NothingToDo);
        };
        match best.failure() {
            None => Ok(best),
            Some((index, reason)) => Err(Error::NoSurvivor {
                tried: n,
                step: best.candidate.pg.steps[index].text.clone(),
                reason: reason.to_owned(),
            }),
        }
    }

    /// Performs a rehearsal on the arm; returns the step that failed and why, if one did.
    fn perform(
        &mut self,
        graph: &Graph,
        rehearsal: &Rehearsal,
        start: &WorldState,
        run: &mut Run,
        recorder: Option<&SharedRecorder>,
    ) -> Result<Option<(usize, String)>, Error> {
        let pg = &rehearsal.candidate.pg;
        run.parse_graphs.push(pg.clone());
        self.scripts.stage().set_tape(rehearsal.tape.rewound());
        let scene = self.cell.scene.clone();
        let watched = pg.fluents();
        let mut failed = None;
        for (k, index) in (rehearsal.candidate.from..pg.steps.len()).enumerate() {
            let number = run.steps.len() + 1;
            let turn = Turn { graph, pg, index, number, follows: k > 0, start };
            // Whoever is asked sees what there is before the step.
            self.photo_for_run(&format!("{number:02}-before-real"))?;
            let before = if k == 0 { &rehearsal.start } else { &rehearsal.views[k - 1] };
            self.twin_picture(&format!("{number:02}-before-twin"), before);
            let ahead = self.ask_before(&turn)?;
            self.tell(&Event::StepStart {
                number,
                of: run.steps.len() + pg.steps.len() - index,
                action: pg.steps[index].text.clone(),
                path: pg.steps[index].path.clone(),
            });
            let begin = self.state()?.time;
            let (done, cut_short) = {
                let mut walker =
                    Walker::new(&self.scripts, &self.stdlib, &self.library, &scene, start);
                match walker.step(pg, index, &watched) {
                    Ok(done) => (done, None),
                    // The step is recorded as far as it came.
                    Err(error) => {
                        (walker.interrupted(pg, index, begin, &watched, &error)?, Some(error))
                    }
                }
            };
            let twin = rehearsal.steps.get(k);
            let comparison = monitor::compare(twin.map_or(&[], |t| &t.fluents), &done.fluents);
            if done.outcome != Outcome::Success {
                let reason = done.reason.clone().unwrap_or_default();
                failed = Some((index, format!("{}: {reason}", pg.steps[index].text)));
            }
            run.questions.push(questionnaire::by_geometry(&comparison.rows));
            let record = record(pg, number, done, comparison, twin);
            self.tell(&Event::StepEnd { record: Box::new(record.clone()) });
            run.steps.push(record);
            keep(run, recorder)?;
            let real = self.photo_for_run(&picture::after(number, "real"))?;
            let twin = rehearsal
                .views
                .get(k)
                .map(|view| self.twin_picture(&picture::after(number, "twin"), view));
            if cut_short.is_none() && self.ask_model(run, real.as_ref(), twin.as_ref()) {
                keep(run, recorder)?;
            }
            let asked = self.ask_after(&turn, ahead, run.steps.last());
            if let Some(error) = cut_short {
                return Err(error.into());
            }
            asked?;
            if failed.is_some() {
                break;
            }
        }
        self.scripts.stage().set_tape(Tape::recording());
        Ok(failed)
    }

    /// Carries out the steps of a recovery: rehearsed first, like everything that moves the arm.
    fn carry_out(
        &mut self,
        graph: &Graph,
        steps: &[graph::Step],
        start: &WorldState,
        run: &mut Run,
        recorder: Option<&SharedRecorder>,
    ) -> Result<(), Error> {
        if steps.is_empty() {
            return Ok(());
        }
        let pg = ParseGraph {
            call: "recovery".into(),
            choices: Vec::new(),
            steps: steps.to_vec(),
            timings: Vec::new(),
            recoveries: Vec::new(),
            log_p: 0.0,
        };
        let candidates =
            (0..2).map(|variant| Candidate { pg: pg.clone(), from: 0, variant }).collect();
        let best = self.rehearse(candidates, start, run)?;
        self.perform(graph, &best, start, run, recorder)?;
        Ok(())
    }

    /// Returns what the scales say about a call's first two vessels.
    fn water(&self, call: &Call, weighing: &Weighing) -> Water {
        let Weighing { water, spilt } = weighing;
        let named: Vec<String> = call
            .args
            .iter()
            .filter_map(|arg| match &arg.values.first()?.kind {
                crate::language::ast::ExprKind::Name(name) => Some(name.clone()),
                _ => None,
            })
            .collect();
        let of = |name: Option<&String>| {
            let found = name.and_then(|name| water.iter().find(|(vessel, _)| vessel == name));
            found.map_or(0.0, |(_, volume)| volume * 1e6)
        };
        Water {
            in_source_ml: of(named.first()),
            in_target_ml: of(named.get(1)),
            spilt_ml: spilt * 1e6,
            measured_by: self.robot_name.clone(),
        }
    }
}

/// Returns the innermost recovery in force for a step that still has tries left.
fn recovery(pg: &ParseGraph, index: usize, used: &BTreeMap<String, u32>) -> Option<usize> {
    pg.steps[index].recoveries.iter().copied().find(|&at| {
        let plan = &pg.recoveries[at];
        let most = match plan.remedy {
            Some(Remedy::Retry { times, .. }) => times,
            _ => 1,
        };
        used.get(&plan.path).copied().unwrap_or(0) < most
    })
}

type SharedRecorder = Arc<Mutex<Recorder>>;

/// A recorder that the run also writes to itself.
struct Shared(SharedRecorder);

impl Observer for Shared {
    fn event(&mut self, event: &Event) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).event(event);
    }
}

/// Writes the run as it stands, if it is kept.
fn keep(run: &Run, recorder: Option<&SharedRecorder>) -> Result<(), Error> {
    recorder.map_or(Ok(()), |recorder| {
        save(&mut recorder.lock().unwrap_or_else(PoisonError::into_inner), run)
    })
}

fn save(recorder: &mut Recorder, run: &Run) -> Result<(), Error> {
    let path = recorder.dir().join("run.json");
    recorder.save(run).map_err(|error| Error::File { path, error })
}

/// Returns the first step of the smallest sub-task that holds a step, to be done again.
fn first_of(pg: &ParseGraph, index: usize) -> usize {
    let path = &pg.steps[index].path;
    let above = path.rsplit_once('/').map_or(path.as_str(), |(above, _)| above);
    pg.steps_of(above).next().unwrap_or(index)
}

fn record(
    pg: &ParseGraph,
    number: usize,
    done: Done,
    comparison: Comparison,
    twin: Option<&Done>,
) -> StepRecord {
    let step = &pg.steps[done.index];
    let during = monitor::during(twin.map_or(&[], |twin| &twin.held), &done.held);
    StepRecord {
        number,
        path: step.path.clone(),
        action: step.text.clone(),
        outcome: done.outcome,
        reason: done.reason,
        interval_s: done.interval,
        fluents: comparison.rows,
        during,
        hamming: comparison.score.hamming,
        score: comparison.score.p,
        measured: done.state,
        twin: twin.map(|twin| twin.state.clone()),
    }
}

fn summary(rehearsal: &Rehearsal) -> Tried {
    let pg = &rehearsal.candidate.pg;
    let choices = pg.choices.iter().map(|c| format!("{}={}", c.node, c.branch)).collect();
    Tried {
        choices,
        variant: rehearsal.candidate.variant,
        success: rehearsal.worth.success,
        spilt_ml: rehearsal.worth.spilt * 1e6,
        time_s: rehearsal.worth.time,
        failed: rehearsal
            .failure()
            .map(|(index, reason)| format!("{}: {reason}", pg.steps[index].text)),
    }
}

fn told(rehearsal: &Rehearsal) -> String {
    let tried = summary(rehearsal);
    let free = rehearsal.candidate.pg.choices.iter().filter(|c| c.is_free);
    let branches: Vec<_> = free.map(|c| c.branch.as_str()).collect();
    let name = format!("{} #{}", branches.join(" "), tried.variant);
    match tried.failed {
        None => format!(
            "twin: {name} survived, {:.1} mL spilt, {:.0} s on the arm",
            tried.spilt_ml, tried.time_s
        ),
        Some(why) => format!("twin: {name} failed at {why}"),
    }
}
