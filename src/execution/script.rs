//! The rhai engine: atomic actions are scripts, and these are the words they may use.
//!
//! A script sees its action's parameters by name (objects as their names, quantities in SI), the units
//! `m cm mm deg rad s ms mL L kg g N`, and three handles: `camera` (look), `twin` (ask and plan), `arm`
//! (act). `choose` takes one of several ways, `remember` and `recall` carry a value to a later action.
//! Scripts have limits on operations, depth and size, and every binding that moves polls the cancel token.
//! What a script prints goes where its notes go.
//!
//! What the words do is in [`super::stage`], what may be asked of them in `super::bounds`; this file only binds
//! them and translates errors.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rhai::{Array, Dynamic, Engine, EvalAltResult, NativeCallContext, Position, Scope};

use super::bounds::{
    self, CALLS, CLEARANCE, HEFT, MASS, OPERATIONS, PITCH, RATE, Range, SHARE, SPEED, TILT, VOLUME,
    WAIT,
};
use super::conduct::Word;
use super::lines::{at_speed, straight};
use super::plan::{Grasp, Placement, Pour};
use super::stage::{ActionError, Stage};

/// A value handed to a script by the name of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub enum ScriptValue {
    /// An object or another name.
    Name(String),
    /// A quantity in SI.
    Number(f64),
    /// Yes or no.
    Truth(bool),
}

/// Why a script ended early.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScriptError {
    /// What it asked for could not be done.
    #[error("{error}")]
    Action {
        /// What.
        error: ActionError,
        /// Line in the script, from 1.
        line: Option<usize>,
    },
    /// The script itself is wrong.
    #[error("{file}:{line}: {message}")]
    Wrong {
        /// The script.
        file: String,
        /// Line, from 1; 0 when unknown.
        line: usize,
        /// What the engine says.
        message: String,
    },
}

impl ScriptError {
    /// Whether nothing more is done after it: a person said stop, or a device failed.
    pub fn ends_the_walk(&self) -> bool {
        matches!(self, Self::Action { error, .. } if error.ends_the_walk())
    }

    /// Whether planning and rehearsing again from where the arm is may help.
    pub fn can_be_planned_again(&self) -> bool {
        matches!(self, Self::Action { error, .. } if error.can_be_planned_again())
    }
}

/// The handle a script calls `arm`, `twin` or `camera`.
#[derive(Clone)]
struct Handle<const KIND: u8>(Arc<Mutex<Stage>>);

type Camera = Handle<0>;
type Twin = Handle<1>;
type Arm = Handle<2>;
type Fallible<T> = Result<T, Box<EvalAltResult>>;

impl<const KIND: u8> Handle<KIND> {
    fn stage(&self) -> MutexGuard<'_, Stage> {
        lock(&self.0)
    }

    /// Takes note of a line that acts, and waits while somebody holds the arm before it; then lends the
    /// stage.
    fn acts(&self, at: &NativeCallContext<'_>, does: String) -> Fallible<MutexGuard<'_, Stage>> {
        let line = at.call_position().line().unwrap_or(0);
        pass(&self.0, line, does).map_err(raise)?;
        Ok(self.stage())
    }

    /// Lends the stage to plan on, as often as a script may ask for a plan.
    fn plans(&self) -> Fallible<MutexGuard<'_, Stage>> {
        let mut stage = self.stage();
        stage.script_plans().map_err(raise)?;
        Ok(stage)
    }

    /// Returns one joint position for each joint of the arm.
    fn joints(&self, word: &str, q: &Array) -> Fallible<Vec<f64>> {
        let n = self.stage().cell().robot.n_joints();
        bounds::joints(word, q, n).map_err(raise)
    }
}

/// Asks whoever may hold the arm. The stage is free meanwhile: a person may think for long.
fn pass(stage: &Mutex<Stage>, line: usize, does: String) -> Result<(), ActionError> {
    let Some((gate, line, state)) = lock(stage).line_begins(line, does)? else { return Ok(()) };
    lock(stage).waits(true)?;
    let word = {
        let mut gate = gate.lock().unwrap_or_else(PoisonError::into_inner);
        (*gate)(&line, &state)
    };
    lock(stage).waits(false)?;
    match word {
        Word::Go => Ok(()),
        Word::Stop => Err(ActionError::Stopped),
    }
}

/// Locks the stage. A panic elsewhere does not make the arm's state unreadable: it is still what it was.
fn lock(stage: &Mutex<Stage>) -> MutexGuard<'_, Stage> {
    stage.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Reads a script without running it.
///
/// # Errors
///
/// [`ScriptError::Wrong`] with the line that cannot be read.
pub fn readable(file: &str, text: &str) -> Result<(), ScriptError> {
    let wrong = |error: rhai::ParseError| ScriptError::Wrong {
        file: file.to_owned(),
        line: error.position().line().unwrap_or(0),
        message: error.err_type().to_string(),
    };
    bounds::engine().compile(text).map(|_| ()).map_err(wrong)
}

/// Runs action scripts over one stage.
pub struct Scripts {
    engine: Engine,
    stage: Arc<Mutex<Stage>>,
}

impl Scripts {
    /// Binds the words to a stage.
    pub fn new(stage: Stage) -> Self {
        let cancel = stage.cancel().clone();
        let stage = Arc::new(Mutex::new(stage));
        let mut engine = bounds::engine();
        engine.on_progress(move |_| cancel.is_cancelled().then(|| Dynamic::from("stopped")));
        bind_values(&mut engine);
        bind_camera(&mut engine);
        bind_twin(&mut engine);
        bind_arm(&mut engine);
        bind_memory(&mut engine, &stage);
        Self { engine, stage }
    }

    /// Lends the stage.
    pub fn stage(&self) -> MutexGuard<'_, Stage> {
        lock(&self.stage)
    }

    /// Runs the script `text` of file `file` with these arguments.
    ///
    /// # Errors
    ///
    /// [`ScriptError::Action`] with the binding's own error when the arm, the planner or a person said
    /// no; [`ScriptError::Wrong`] when the script cannot be read or misuses a word.
    pub fn run(
        &self,
        file: &str,
        text: &str,
        args: &BTreeMap<String, ScriptValue>,
    ) -> Result<(), ScriptError> {
        let mut scope = Scope::new();
        for (name, si) in UNITS {
            scope.push_constant(*name, *si);
        }
        scope.push("camera", Handle::<0>(self.stage.clone()));
        scope.push("twin", Handle::<1>(self.stage.clone()));
        scope.push("arm", Handle::<2>(self.stage.clone()));
        for (name, value) in args {
            match value {
                ScriptValue::Name(text) => scope.push(name.clone(), text.clone()),
                ScriptValue::Number(number) => scope.push(name.clone(), *number),
                ScriptValue::Truth(truth) => scope.push(name.clone(), *truth),
            };
        }
        self.stage()
            .script_begins(file, text)
            .map_err(|error| ScriptError::Action { error, line: None })?;
        let result = self.engine.run_with_scope(&mut scope, text);
        result.map_err(|error| translate(file, &error))
    }
}

/// Units as factors to SI, so that a script may write `12.0 * cm`.
const UNITS: &[(&str, f64)] = &[
    ("m", 1.0),
    ("cm", 0.01),
    ("mm", 0.001),
    ("deg", std::f64::consts::PI / 180.0),
    ("rad", 1.0),
    ("s", 1.0),
    ("ms", 0.001),
    ("mL", 1e-6),
    ("L", 1e-3),
    ("kg", 1.0),
    ("g", 0.001),
    ("N", 1.0),
];

/// Finds the binding's own error inside the engine's, whatever calls it is wrapped in.
fn translate(file: &str, error: &EvalAltResult) -> ScriptError {
    let line = |position: Position| position.line();
    match error {
        EvalAltResult::ErrorTerminated(token, position) => {
            let error = token.clone().try_cast::<ActionError>().unwrap_or(ActionError::Stopped);
            ScriptError::Action { error, line: line(*position) }
        }
        EvalAltResult::ErrorRuntime(token, position) => {
            if let Some(error) = token.clone().try_cast::<ActionError>() {
                return ScriptError::Action { error, line: line(*position) };
            }
            // `throw "words"` in a script is the script's own way to say no.
            let error = ActionError::Refused(token.to_string());
            ScriptError::Action { error, line: line(*position) }
        }
        EvalAltResult::ErrorInFunctionCall(_, _, inner, _) => translate(file, inner),
        other => ScriptError::Wrong {
            file: file.to_owned(),
            line: other.position().line().unwrap_or(0),
            message: match other {
                EvalAltResult::ErrorTooManyOperations(_) => {
                    format!(
                        "it has no end after {OPERATIONS} operations; is there a loop without one?"
                    )
                }
                EvalAltResult::ErrorStackOverflow(_) => {
                    format!("its functions call each other more than {CALLS} deep (stack overflow)")
                }
                other => other.to_string(),
            },
        },
    }
}

/// Carries an action's error through the engine. What ends the step cannot be caught by a script, anything
/// else can.
#[expect(
    clippy::unnecessary_box_returns,
    reason = "the engine's functions fail with a boxed error"
)]
fn raise(error: ActionError) -> Box<EvalAltResult> {
    let can_be_caught = error.can_be_caught();
    let token = Dynamic::from(error);
    Box::new(if can_be_caught {
        EvalAltResult::ErrorRuntime(token, Position::NONE)
    } else {
        EvalAltResult::ErrorTerminated(token, Position::NONE)
    })
}

/// Returns an argument that is in its range, or raises what is wrong with it.
fn within(word: &str, what: &str, value: f64, range: Range) -> Fallible<f64> {
    range.check(word, what, value).map_err(raise)
}

fn array(values: impl IntoIterator<Item = f64>) -> Array {
    values.into_iter().map(Dynamic::from).collect()
}

fn list<T: Clone + Send + Sync + 'static>(values: Vec<T>) -> Array {
    values.into_iter().map(Dynamic::from).collect()
}

fn bind_values(engine: &mut Engine) {
    engine
        .register_type_with_name::<Grasp>("Grasp")
        .register_get("before", |grasp: &mut Grasp| array(grasp.before.iter().copied()))
        .register_get("way_in", |grasp: &mut Grasp| Path(grasp.way_in.clone()))
        .register_get("way_out", |grasp: &mut Grasp| {
            Path(grasp.way_in.iter().rev().cloned().collect())
        })
        .register_get("clearance", |grasp: &mut Grasp| grasp.clearance)
        .register_type_with_name::<Pour>("Pour")
        .register_get("start", |pour: &mut Pour| array(pour.start.iter().copied()))
        .register_get("turn", |pour: &mut Pour| Path(pour.turn.clone()))
        .register_get("back", |pour: &mut Pour| Path(pour.turn.iter().rev().cloned().collect()))
        .register_get("clearance", |pour: &mut Pour| pour.clearance)
        .register_fn("share_holding", |pour: &mut Pour, volume: f64| {
            Ok(pour.share_holding(within("share_holding", "the volume", volume, VOLUME)?))
                as Fallible<f64>
        })
        .register_type_with_name::<Placement>("Placement")
        .register_get("above", |place: &mut Placement| array(place.above.iter().copied()))
        .register_get("way_down", |place: &mut Placement| Path(place.way_down.clone()))
        .register_get("way_out", |place: &mut Placement| Path(place.way_out.clone()))
        .register_type_with_name::<Path>("Path");
}

/// A joint path in a script's hands.
#[derive(Clone)]
pub(super) struct Path(Vec<Vec<f64>>);

fn bind_camera(engine: &mut Engine) {
    engine.register_type_with_name::<Camera>("Camera").register_fn(
        "look",
        |at: NativeCallContext<'_>, camera: &mut Camera| {
            let does = "photograph the table and find everything on it anew";
            camera.acts(&at, does.into())?.look().map_err(raise)
        },
    );
}

fn bind_twin(engine: &mut Engine) {
    engine
        .register_type_with_name::<Twin>("Twin")
        .register_fn("grasps", |twin: &mut Twin, o: &str, face: &str, pitch: f64| {
            let pitch = within("grasps", "the pitch", pitch, PITCH)?;
            twin.plans()?.grasps(o, face, pitch).map(list).map_err(raise)
        })
        .register_fn("pours", |twin: &mut Twin, o: &str, at: &str, clearance: f64| {
            let clearance = within("pours", "the clearance", clearance, CLEARANCE)?;
            twin.plans()?.pours(o, at, clearance).map(list).map_err(raise)
        })
        .register_fn("placements", |twin: &mut Twin, o: &str| {
            twin.plans()?.placements(o).map(list).map_err(raise)
        })
        .register_fn("pose_named", |twin: &mut Twin, name: &str| {
            twin.stage().named_pose(name).map(array).map_err(raise)
        })
        .register_fn("position", |twin: &mut Twin, o: &str| {
            twin.stage().position(o).map(array).map_err(raise)
        })
        .register_fn("enough", |twin: &mut Twin, o: &str, volume: f64| {
            let volume = within("enough", "the volume", volume, VOLUME)?;
            twin.stage().enough(o, volume).map_err(raise)
        })
        .register_fn("squeeze", |twin: &mut Twin, o: &str| twin.stage().squeeze(o).map_err(raise))
        .register_fn("drips", |twin: &mut Twin, o: &str| twin.stage().drips(o).map_err(raise))
        .register_fn("volume", |twin: &mut Twin, o: &str| twin.stage().volume(o).map_err(raise));
}

fn bind_arm(engine: &mut Engine) {
    engine.register_type_with_name::<Arm>("Arm");
    bind_hand(engine);
    bind_ways(engine);
    bind_turns(engine);
}

/// The fingers, and holding still.
fn bind_hand(engine: &mut Engine) {
    engine
        .register_fn("open", |at: NativeCallContext<'_>, arm: &mut Arm| {
            arm.acts(&at, "open the fingers as wide as they go".into())?.open().map_err(raise)
        })
        .register_fn("close", |at: NativeCallContext<'_>, arm: &mut Arm, o: &str, force: f64| {
            let does = format!("close the fingers on the {o} with at most {force:.0} N");
            arm.acts(&at, does)?.close(o, force).map_err(raise)
        })
        .register_fn("weigh", |at: NativeCallContext<'_>, arm: &mut Arm| {
            let does = "hold still and weigh what is in the hand by the joints' torques";
            arm.acts(&at, does.into())?.weigh().map_err(raise)
        })
        .register_fn("heft", |at: NativeCallContext<'_>, arm: &mut Arm, seconds: f64| {
            let seconds = within("heft", "the time", seconds, HEFT)?;
            let does =
                format!("hold still and feel for {seconds:.1} s how heavy what is in the hand is");
            arm.acts(&at, does)?.heft(seconds).map_err(raise)
        })
        .register_fn("weighed", |arm: &mut Arm, mass: f64| {
            let mass = within("weighed", "the mass", mass, MASS)?;
            arm.stage().weighed(mass);
            Ok(()) as Fallible<()>
        })
        .register_fn("bears", |arm: &mut Arm, mass: f64| {
            let mass = within("bears", "the mass", mass, MASS)?;
            arm.stage().bears(mass);
            Ok(()) as Fallible<()>
        })
        .register_fn("opening", |arm: &mut Arm| arm.stage().opening().map_err(raise))
        .register_fn("wait", |at: NativeCallContext<'_>, arm: &mut Arm, seconds: f64| {
            let seconds = within("wait", "the time", seconds, WAIT)?;
            arm.acts(&at, format!("hold still for {seconds:.1} s"))?.wait(seconds).map_err(raise)
        });
}

/// Ways of the arm.
fn bind_ways(engine: &mut Engine) {
    engine
        .register_fn("move_to", |at: NativeCallContext<'_>, arm: &mut Arm, q: Array| {
            let q = arm.joints("move_to", &q)?;
            let does = format!("move round everything in the way{}", at_speed(1.0));
            arm.acts(&at, does)?.move_to(&q, None, 1.0).map_err(raise)
        })
        .register_fn(
            "carry_to",
            |at: NativeCallContext<'_>, arm: &mut Arm, q: Array, tilt: f64, speed: f64| {
                let q = arm.joints("carry_to", &q)?;
                let tilt = within("carry_to", "the tilt", tilt, TILT)?;
                let speed = within("carry_to", "the speed", speed, SPEED)?;
                let lean = tilt.to_degrees();
                let does = format!(
                    "carry what is held round everything in the way, leaning at most {lean:.0} deg,{}",
                    at_speed(speed)
                );
                arm.acts(&at, does)?.move_to(&q, Some(tilt), speed).map_err(raise)
            },
        )
        .register_fn(
            "follow",
            |at: NativeCallContext<'_>, arm: &mut Arm, path: Path, speed: f64| {
                let speed = within("follow", "the speed", speed, SPEED)?;
                let does = format!("follow the path that was found{}", at_speed(speed));
                arm.acts(&at, does)?.follow(&path.0, speed).map_err(raise)
            },
        )
        .register_fn(
            "draw_back",
            |at: NativeCallContext<'_>, arm: &mut Arm, path: Path, speed: f64| {
                let speed = within("draw_back", "the speed", speed, SPEED)?;
                let does = format!("draw the hand back the way it came{}", at_speed(speed));
                arm.acts(&at, does)?.draw_back(&path.0, speed).map_err(raise)
            },
        )
        .register_fn(
            "move_by",
            |at: NativeCallContext<'_>, arm: &mut Arm, by: Array, speed: f64| {
                let by = bounds::way("move_by", &by).map_err(raise)?;
                let speed = within("move_by", "the speed", speed, SPEED)?;
                arm.acts(&at, straight(by, speed))?.move_by(by, speed).map_err(raise)
            },
        );
}

/// Turns of the hand.
fn bind_turns(engine: &mut Engine) {
    engine
        .register_fn("turn", |at: NativeCallContext<'_>, arm: &mut Arm, path: Path, rate: f64| {
            let rate = within("turn", "the rate", rate, RATE)?;
            let does = format!("turn the hand along its path at {:.0} deg/s", rate.to_degrees());
            arm.acts(&at, does)?.turn(&path.0, rate).map_err(raise)
        })
        .register_fn(
            "turn_back",
            |at: NativeCallContext<'_>, arm: &mut Arm, path: Path, rate: f64| {
                let rate = within("turn_back", "the rate", rate, RATE)?;
                let does = format!("turn the hand back upright at {:.0} deg/s", rate.to_degrees());
                arm.acts(&at, does)?.turn_back(&path.0, rate).map_err(raise)
            },
        )
        .register_fn(
            "turn_to",
            |at: NativeCallContext<'_>, arm: &mut Arm, path: Path, share: f64, rate: f64| {
                let share = within("turn_to", "the share", share, SHARE)?;
                let rate = within("turn_to", "the rate", rate, RATE)?;
                let does = format!(
                    "turn the hand to {:.1} % of its path at {:.0} deg/s",
                    100.0 * share,
                    rate.to_degrees()
                );
                arm.acts(&at, does)?.turn_to(&path.0, share, rate).map_err(raise)
            },
        );
}

fn bind_memory(engine: &mut Engine, stage: &Arc<Mutex<Stage>>) {
    let keeper = stage.clone();
    engine.register_fn("remember", move |name: &str, value: Dynamic| {
        lock(&keeper).remember(name, value).map_err(raise)
    });
    let keeper = stage.clone();
    engine.register_fn("recall", move |name: &str| lock(&keeper).recall(name).map_err(raise));
    let teller = stage.clone();
    engine.register_fn("note", move |text: &str| lock(&teller).note(text));
    let teller = stage.clone();
    engine.on_print(move |text| lock(&teller).note(text));
    let teller = stage.clone();
    engine.on_debug(move |text, _, _| lock(&teller).note(text));
    let chooser = stage.clone();
    engine.register_fn("choose", move |ways: Array| -> Fallible<Dynamic> {
        let chosen = lock(&chooser).choose(ways.len()).map_err(raise)?;
        ways.into_iter().nth(chosen).ok_or_else(|| "choose was given nothing".into())
    });
}
