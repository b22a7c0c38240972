//! A call, from the line that was typed to the folder that is kept: perceive, attempt, weigh, judge.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::slice;
use std::sync::{Arc, Mutex, PoisonError};

use crate::arm::{Cancel, Weighing};
use crate::execution::decisions::DecisionLog;
use crate::execution::error::ActionError;
use crate::execution::reader::Reader;
use crate::fluent::Reading;
use crate::graph::{self, Graph};
use crate::language::ast::{Call, Expr, ExprKind};
use crate::language::text;
use crate::trace::{Event, Observer};
use crate::world::WorldState;

use super::album::Album;
use super::displaced::{ELSEWHERE, displaced};
use super::filming::Filming;
use super::matching::Matching;
use super::promises::{self, Verdict};
use super::record::Recorder;
use super::{Ending, Error, Run, State, Water, WorkCell, wording};

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
        let mut observers: Vec<Box<dyn Observer + Send>> = Vec::new();
        // First: whoever watches finds on disk what it is told of.
        if let Some(recorder) = &recorder {
            observers.push(Box::new(Shared(recorder.clone())));
        }
        observers.push(watcher);
        self.watched_by(observers);
        let total = self.now();
        let mut run = self.nothing_done(call);
        let sliding = self.scripts.context().declared().robot.sliding();
        if let Some(recorder) = &recorder {
            let mut recorder = recorder.lock().unwrap_or_else(PoisonError::into_inner);
            recorder.slide(sliding);
            run.run_dir = Some(recorder.dir().display().to_string());
        }
        // From here on the run can be found again, whatever happens to the program.
        if let Err(error) = begin(&run, recorder.as_ref(), &self.controls.cancel) {
            self.watched_by(Vec::new());
            return Err(error);
        }
        self.experience.moments.begin(run.run_dir.as_deref());
        self.lead_begins(&run.task, run.run_dir.as_deref());
        // What was streamed before was another run's.
        self.scripts.context().body().arm().pacing();
        let carried =
            catch_unwind(AssertUnwindSafe(|| self.carry(call, &mut run, recorder.as_ref())));
        let carried = match carried {
            Ok(carried) => carried,
            Err(panic) => self.give_up(run, recorder.as_ref(), panic),
        };
        run.stream = self.scripts.context().body().arm().pacing();
        run.timing_s.waiting = self.lead_ends();
        self.watched_by(Vec::new());
        // Decisions of a performance that was cut short are not for whatever comes next.
        self.scripts.context().set_log(DecisionLog::recording());
        run.timing_s.total = self.now() - total;
        let carried = match carried {
            Err(Error::Action(ActionError::Stopped)) => {
                run.outcome = Ending::Stopped;
                run.stop_unanswered = self.scripts.context().body().arm().owes_stop();
                Ok(())
            }
            Err(error @ Error::Unrecorded { .. }) => {
                run.outcome = Ending::Stopped;
                run.reason = Some(error.to_string());
                Err(error)
            }
            Err(error) => {
                // What fails while a recovery runs has been told with what it was to recover from.
                run.reason.get_or_insert_with(|| error.to_string());
                if let Error::Action(ActionError::Device(device)) = &error {
                    run.outcome =
                        if device.is_limit() { Ending::Stopped } else { Ending::Unavailable };
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
            run.reason = Some(wording::unrecorded(trouble));
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
        run.reason = Some(wording::program_failed());
        // That it cannot be kept either is the lesser trouble.
        let _ = keep(&run, recorder);
        resume_unwind(panic)
    }

    /// Returns the run of a call of which nothing has been done yet.
    fn nothing_done(&self, call: &Call) -> Run {
        let (seed, robot) = (self.setup.seed, self.setup.robot_name.clone());
        let state = State::Running;
        let scale_under = self.scales.as_ref().and_then(|scales| scales.with_cable());
        let setting = Some(self.setup.setting.clone());
        Run { state, seed, robot, setting, scale_under, ..Run::so_far(&text::call(call), &[]) }
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
        if self.controls.dial.percent() < 100 {
            let percent = self.controls.dial.percent();
            self.audience.note(&wording::slowed(percent));
        }
        self.check_places(&graph)?;
        self.probe_model(&graph, run)?;
        self.audience.phase("perceive", wording::perceiving());
        // What the call needs and does not find is said before the arm moves for regression 3.
        let perceived = self
            .perceive()
            .and_then(|()| self.check_needs(&graph))
            .and_then(|()| self.align_robot());
        let perceived_at = self.now();
        run.timing_s.perceive = perceived_at - begin;
        perceived?;
        let start = self.state()?;
        run.start = Some(start.clone());
        let sure = self.scripts.context().body().sure();
        run.calibration = self.scripts.context().body().calibration().cloned();
        run.matching = Some(Matching::of(run.calibration.as_ref(), &start, &sure));
        let album = Album::new(self.audience.fan.clone());
        let is_filmed = |recorder: &SharedRecorder| {
            recorder.lock().unwrap_or_else(PoisonError::into_inner).is_filmed()
        };
        let filming = recorder.is_some_and(is_filmed).then(|| {
            let is_watched = self.audience.sees_rehearsals;
            let film = self.scripts.context().body().film(is_watched);
            Filming::new(film, album.jobs(), (self.setup.is_real_time, is_watched))
        });
        if let Some(filming) = &filming {
            self.audience.add(Box::new(filming.clone()));
        }
        let (graph, start) = (&graph, &start);
        let mut on = UnderWay { graph, start, run: &mut *run, recorder, album, filming };
        let attempted = self.attempt(&mut on);
        let UnderWay { album, .. } = on;
        let attempted_at = self.now();
        let time = &mut run.timing_s;
        // What neither rehearses nor performs chooses what is done next.
        let counted = time.simulate + time.execute + time.waiting;
        time.plan = (attempted_at - perceived_at - counted).max(0.0);
        if attempted.is_err() || run.outcome != Ending::Success {
            self.scripts.context().body().cut_short();
        }
        run.displaced = displaced(self.scene(), start, &run.steps);
        let weighing = self.scales.as_mut().and_then(|scales| scales.weigh());
        let has_vessels = self.scene().objects.iter().any(|o| self.is_vessel(&o.name));
        if let Some(weighing) = weighing.as_ref().filter(|_| has_vessels) {
            run.water = Some(self.water(call, weighing));
        }
        // The last pictures are drawn while what was reached is judged.
        let judged = match attempted {
            Ok(()) if run.outcome == Ending::Success => {
                self.judge(graph, start, weighing.as_ref(), run)
            }
            attempted => attempted,
        };
        let judged_at = self.now();
        run.timing_s.perceive += judged_at - attempted_at;
        let newest = album.finish();
        if let Some(recorder) = recorder {
            recorder.lock().unwrap_or_else(PoisonError::into_inner).keep_whole(&newest);
        }
        run.timing_s.pictures = self.now() - judged_at;
        judged
    }

    /// Judges at the end what the call and its parts promised, with the scales' word on the water where there are
    /// scales: a false promise makes the run a failure, one that nobody can judge leaves it unconfirmed, and only what
    /// is known to be true is reached.
    fn judge(
        &mut self,
        graph: &Graph,
        start: &WorldState,
        weighing: Option<&Weighing>,
        run: &mut Run,
    ) -> Result<(), Error> {
        let believed = self.state()?;
        let moved = moved(start, &believed);
        self.scripts.context().body().confirm(&moved).map_err(ActionError::from)?;
        let mut state = self.state()?;
        if let Some(weighing) = weighing {
            state.spilt = Some(weighing.spilt);
            for (vessel, water) in &weighing.water {
                if let Some(object) = state.object_mut(vessel) {
                    object.water = Some(*water);
                }
            }
        }
        let scene = self.model.cell.scene.clone();
        let reader = Reader::new(&mut self.scripts, &self.setup.library, &scene, start);
        let promises = promises::promises(run, &graph.root().path, &scene);
        let truth = |expr: &Expr, state: &WorldState| reader.read(expr, state).truth;
        let told = match promises::judge(&promises, &state, &truth) {
            Verdict::Kept => None,
            Verdict::Broken(condition) => {
                let broken = reader.unmet(slice::from_ref(condition), &state);
                broken.map(|broken| (Ending::Failure, wording::promise_broken(&broken)))
            }
            Verdict::Unknown(promise) => {
                let (condition, is_past) = (&promise.condition, promise.is_past);
                let at = if is_past { promise.after } else { &state };
                let Reading { unknown: why, margin, .. } = reader.read(&condition.expr, at);
                let is_near = margin.is_some() && !is_past;
                let why = wording::promise_unknown(&condition.text, why.as_deref(), is_near);
                Some((Ending::Unconfirmed, why))
            }
        };
        run.reached = told.is_none();
        if let Some((outcome, why)) = told {
            run.outcome = outcome;
            run.reason = Some(why);
        }
        Ok(())
    }

    /// Whether liquid is held by a thing; a drawer is as hollow, and holds none.
    pub(super) fn is_vessel(&self, name: &str) -> bool {
        let scene = self.scene();
        scene.object(name).is_some_and(|o| o.cavity.is_some()) && scene.drawer(name).is_none()
    }

    /// Returns what the scales say about a call's first two vessels, and about all.
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
            vessels_ml: water
                .iter()
                .filter(|(name, _)| self.is_vessel(name))
                .map(|(name, volume)| (name.clone(), volume * 1e6))
                .collect(),
            spilt_ml: spilt * 1e6,
            measured_by: self.setup.robot_name.clone(),
        }
    }
}

/// A run under way: what it is of, what there is of it so far, and where it is kept.
pub(super) struct UnderWay<'a> {
    pub(super) graph: &'a Graph,
    /// The world when it began.
    pub(super) start: &'a WorldState,
    pub(super) run: &'a mut Run,
    pub(super) recorder: Option<&'a SharedRecorder>,
    /// The pictures of its steps.
    pub(super) album: Album,
    /// The film of it, if one is kept.
    pub(super) filming: Option<Filming>,
}

impl UnderWay<'_> {
    /// Writes the run as it stands, if it is kept.
    pub(super) fn keep(&self) -> Result<(), Error> {
        keep(self.run, self.recorder)
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
fn keep(run: &Run, recorder: Option<&SharedRecorder>) -> Result<(), Error> {
    let Some(recorder) = recorder else { return Ok(()) };
    let mut recorder = recorder.lock().unwrap_or_else(PoisonError::into_inner);
    let dir = recorder.dir().to_path_buf();
    recorder.save(run).map_err(|error| Error::Unrecorded { dir, error })
}

/// Returns the things that stand elsewhere than at the start.
fn moved(start: &WorldState, now: &WorldState) -> Vec<String> {
    let stands = now.objects.iter().filter(|object| now.held.as_ref() != Some(&object.name));
    let elsewhere = stands.filter(|object| {
        let before = start.object(&object.name).and_then(|known| known.world_from_object);
        before
            .zip(object.world_from_object)
            .is_some_and(|(before, after)| (before.origin() - after.origin()).norm() > ELSEWHERE)
    });
    elsewhere.map(|object| object.name.clone()).collect()
}
