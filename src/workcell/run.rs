//! A call, from the line that was typed to the folder that is kept: perceive, attempt, weigh, judge.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Mutex, PoisonError};

use crate::execution::arm::{Cancel, Weighing};
use crate::execution::stage::ActionError;
use crate::execution::tape::Tape;
use crate::execution::trace::{Event, Observer};
use crate::execution::walk::Walker;
use crate::graph::{self, Graph};
use crate::language::ast::{Call, ExprKind};
use crate::language::text;
use crate::world::WorldState;

use super::record::Recorder;
use super::{Ending, Error, Run, State, Water, WorkCell};

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
        // From here on the run can be found again, whatever happens to the program.
        if let Err(error) = begin(&run, recorder.as_ref(), &self.cancel) {
            self.watched_by(Vec::new());
            return Err(error);
        }
        self.moments.begin(run.run_dir.as_deref());
        self.lead_begins(&run.task, run.run_dir.as_deref());
        // What was streamed before was another run's.
        self.scripts.stage().body().arm().pacing();
        let carried =
            catch_unwind(AssertUnwindSafe(|| self.carry(call, &mut run, recorder.as_ref())));
        let carried = match carried {
            Ok(carried) => carried,
            Err(panic) => self.give_up(run, recorder.as_ref(), panic),
        };
        run.stream = self.scripts.stage().body().arm().pacing();
        run.timing_s.waiting = self.lead_ends();
        self.watched_by(Vec::new());
        // Decisions of a performance that was cut short are not for whatever comes next.
        self.scripts.stage().set_tape(Tape::recording());
        run.timing_s.total = self.now() - total;
        let carried = match carried {
            Err(Error::Action(ActionError::Stopped)) => {
                run.outcome = Ending::Stopped;
                Ok(())
            }
            Err(error @ Error::Unrecorded { .. }) => {
                run.outcome = Ending::Stopped;
                run.reason = Some(error.to_string());
                Err(error)
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
        run.state = State::Ended;
        if let Some(trouble) = trouble(recorder.as_ref()) {
            run.reason = Some(format!("the run could not be recorded any further: {trouble}"));
        }
        let saved = keep(&run, recorder.as_ref());
        carried.and(saved).map(|()| run)
    }

    /// Brings the arm to rest after a mistake of the program's own and keeps what there is of the run; whoever
    /// called is told by the panic going on.
    fn give_up(
        &mut self,
        mut run: Run,
        recorder: Option<&SharedRecorder>,
        panic: Box<dyn Any + Send>,
    ) -> ! {
        self.halt();
        self.watched_by(Vec::new());
        run.state = State::Ended;
        run.outcome = Ending::Stopped;
        run.reason = Some("the program itself has a mistake; the arm was brought to rest".into());
        // That it cannot be kept either is the lesser trouble.
        let _ = keep(&run, recorder);
        resume_unwind(panic)
    }

    /// Returns the run of a call of which nothing has been done yet.
    fn nothing_done(&self, call: &Call) -> Run {
        let (seed, robot) = (self.seed, self.robot_name.clone());
        let state = State::Running;
        Run { state, seed, robot, ..Run::so_far(&text::call(call), &[]) }
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
        run.start = Some(start.clone());
        run.calibration = self.scripts.stage().body().calibration().cloned();
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

    /// Returns what the scales say about a call's first two vessels.
    fn water(&self, call: &Call, weighing: &Weighing) -> Water {
        let Weighing { water, spilt } = weighing;
        let named: Vec<String> = call
            .args
            .iter()
            .filter_map(|arg| match &arg.values.first()?.kind {
                ExprKind::Name(name) => Some(name.clone()),
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

/// A recorder that the run and its observers share.
pub(super) type SharedRecorder = Arc<Mutex<Recorder>>;

/// A recorder that the run also writes to itself.
struct Shared(SharedRecorder);

impl Observer for Shared {
    fn event(&mut self, event: &Event) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).event(event);
    }
}

/// Writes the run before anything is done in it; from then on what cannot be recorded asks for a stop.
fn begin(run: &Run, recorder: Option<&SharedRecorder>, stop: &Cancel) -> Result<(), Error> {
    let Some(recorder) = recorder else { return Ok(()) };
    let mut recorder = recorder.lock().unwrap_or_else(PoisonError::into_inner);
    let path = recorder.dir().join("run.json");
    recorder.save(run).map_err(|error| Error::File { path, error })?;
    recorder.stops(stop.clone());
    Ok(())
}

fn trouble(recorder: Option<&SharedRecorder>) -> Option<String> {
    recorder?.lock().unwrap_or_else(PoisonError::into_inner).trouble()
}

/// Writes the run as it stands, if it is kept.
pub(super) fn keep(run: &Run, recorder: Option<&SharedRecorder>) -> Result<(), Error> {
    let Some(recorder) = recorder else { return Ok(()) };
    let mut recorder = recorder.lock().unwrap_or_else(PoisonError::into_inner);
    let dir = recorder.dir().to_path_buf();
    recorder.save(run).map_err(|error| Error::Unrecorded { dir, error })
}
