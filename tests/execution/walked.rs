//! Small tasks walked through in the twin, with eyes that know, are blind, or see a thing elsewhere than it is. What is expected of
//! a walk is not said here.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::Vector3;
use trueup::arm::{Arm, Cancel, DeviceError, Feedback, Grip};
use trueup::execution::body::{Body, Sight};
use trueup::execution::conduct::Dial;
use trueup::execution::context::ActionContext;
use trueup::execution::decisions::DecisionLog;
use trueup::execution::done::Done;
use trueup::execution::error::ActionError;
use trueup::execution::script::Scripts;
use trueup::execution::twin_arm::TwinBody;
use trueup::execution::walk::{Texts, Walker};
use trueup::graph::{self, ParseGraph, infer};
use trueup::language::ast::{Expr, Step};
use trueup::language::{Library, Source, parse_line};
use trueup::trace::{Event, Observer, Outcome};
use trueup::world::WorldState;

use crate::kitchen;

/// Actions that move the tool a known way, and one that does nothing but wait.
const ACTIONS: &str = "
action rise(by: Length) { run \"rise.rhai\" }
action dip(by: Length) { keeps height(gripper) >= 5 cm  run \"rise.rhai\" }
action twice(by: Length) { run \"twice.rhai\" }
action ahead(by: Length) { run \"ahead.rhai\" }
action pause(time: Time) { limit 1 s  run \"pause.rhai\" }
action spread() { gives gripper.open  run \"spread.rhai\" }
action peek() { run \"peek.rhai\" }
";

struct Actions;

impl Texts for Actions {
    fn script(&self, name: &str) -> Option<&str> {
        match name {
            "rise.rhai" => Some("arm.move_by([0.0, 0.0, by], 0.2);"),
            "twice.rhai" => Some(
                "arm.move_by([0.0, 0.0, by], 0.2);\ntry { arm.move_by([0.0, 0.0, by], 0.2); } catch { }",
            ),
            "ahead.rhai" => Some("arm.move_by([by, 0.0, 0.0], 0.2);"),
            "pause.rhai" => Some("arm.wait(time);"),
            "spread.rhai" => Some("arm.open();"),
            "peek.rhai" => Some("camera.look();"),
            _ => None,
        }
    }
}

/// Keeps every tick of the arm.
#[derive(Default)]
pub(super) struct Ticks(Vec<Feedback>);

impl Observer for Ticks {
    fn event(&mut self, event: &Event) {
        if let Event::Tick(feedback) = event {
            self.0.push(feedback.clone());
        }
    }
}

/// The twin's arm with other eyes: where the jar is measured to be, from where it is.
struct Seen {
    twin: TwinBody,
    /// Measured this much nearer to the arm, m; `None` when nobody sees it.
    nearer: Option<f64>,
}

struct SeenSight {
    twin: Box<dyn Sight>,
    nearer: Option<f64>,
}

fn seen(mut state: WorldState, nearer: Option<f64>) -> WorldState {
    let jar = state.object_mut("jar").unwrap();
    jar.world_from_object = nearer.and_then(|nearer| {
        let pose = jar.world_from_object?;
        let at = pose.origin();
        Some(trueup::world::Pose::upright(at.x - nearer, at.y, at.z, pose.yaw()))
    });
    state
}

impl Sight for SeenSight {
    fn state(&mut self, feedback: &Feedback) -> WorldState {
        seen(self.twin.state(feedback), self.nearer)
    }

    fn contact(&self, _a: &str, _b: &str) -> Option<bool> {
        None
    }
}

impl Body for Seen {
    fn arm(&mut self) -> &mut dyn Arm {
        self.twin.arm()
    }

    fn sight(&self) -> Box<dyn Sight> {
        Box::new(SeenSight { twin: self.twin.sight(), nearer: self.nearer })
    }

    fn state(&mut self) -> Result<WorldState, DeviceError> {
        Ok(seen(self.twin.state()?, self.nearer))
    }

    fn look(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    fn gripped(&mut self, _grip: Grip, _aim: Option<&str>) -> Result<(), DeviceError> {
        Ok(())
    }

    fn weighed(&mut self, _mass: f64) {}

    fn contact(&mut self, _a: &str, _b: &str) -> Option<bool> {
        None
    }
}

/// Who looks for the jar.
#[derive(Clone, Copy)]
pub(super) enum Eyes {
    /// The twin, which knows.
    Twins,
    /// Nobody.
    Blind,
    /// Somebody who sees it so much nearer to the arm, m.
    Nearer(f64),
}

/// One walk through a task, and everything the arm reported.
pub(super) struct Walked {
    pub(super) steps: Vec<Result<Done, ActionError>>,
    pub(super) ticks: Vec<Feedback>,
    pub(super) log: DecisionLog,
    pub(super) q: Vec<f64>,
}

impl Walked {
    pub(super) fn step(&self, index: usize) -> &Done {
        self.steps[index].as_ref().unwrap()
    }

    pub(super) fn reason(&self, index: usize) -> String {
        self.step(index).failure.as_ref().map(ToString::to_string).unwrap_or_default()
    }
}

pub(super) fn plan(tasks: &str, call: &str) -> (Library, ParseGraph) {
    let mut library = Library::standard();
    library.add(Source::new("test.task", format!("{ACTIONS}{tasks}")));
    let Some(Step::Act(act)) = parse_line(call).0 else { panic!("no call") };
    let graph = graph::build(&library, &act.call).unwrap();
    let given = infer::Given {
        definitions: &library,
        holds: &|_: &Expr| None,
        pins: &BTreeMap::new(),
        priors: None,
        cost: &|_| 0.0,
    };
    let pg = graph::best(&graph, &given).unwrap();
    (library, pg)
}

/// Walks `task t() { … }` to its first step that fails.
pub(super) fn walk_with(body: &str, log: DecisionLog, eyes: Eyes, cancel: &Cancel) -> Walked {
    walk_dialled(body, log, eyes, cancel, &[])
}

/// As [`walk_with`], the dial turned to so many percent before each step; left where it is before more.
fn walk_dialled(
    body: &str,
    log: DecisionLog,
    eyes: Eyes,
    cancel: &Cancel,
    percents: &[u8],
) -> Walked {
    let (library, pg) = plan(&format!("task t() {body}"), "t()");
    let cell = super::cell();
    // The jar stands straight ahead.
    let tool = tool_at_home();
    let mut state = super::state(&kitchen::HOME, [tool.x + AHEAD, tool.y, 0.0]);
    state.opening = 0.02;
    let twin = TwinBody::new(super::twin(&cell.scene, &state));
    let body: Box<dyn Body> = match eyes {
        Eyes::Twins => Box::new(twin),
        Eyes::Blind => Box::new(Seen { twin, nearer: None }),
        Eyes::Nearer(by) => Box::new(Seen { twin, nearer: Some(by) }),
    };
    let ticks = Arc::new(Mutex::new(Ticks::default()));
    let scene = cell.scene.clone();
    let mut context = ActionContext::new(
        cell,
        body,
        kitchen::HOME.to_vec(),
        log,
        (1, 0),
        cancel.clone(),
        ticks.clone(),
    );
    let dial = Dial::default();
    context.obey(dial.clone());
    let mut scripts = Scripts::new(context);
    let start = scripts.context().state().unwrap();
    let mut walker = Walker::new(&mut scripts, &Actions, &library, &scene, &start);
    let mut steps = Vec::new();
    for index in 0..pg.steps.len() {
        if let Some(percent) = percents.get(index) {
            dial.turn(*percent);
        }
        let step = walker.step(&pg, index, &[]);
        let goes_on = step.as_ref().is_ok_and(|done| done.outcome == Outcome::Success);
        steps.push(step);
        if !goes_on {
            break;
        }
    }
    let log = scripts.context().log().clone();
    let q = scripts.context().planned_q().unwrap().to_vec();
    let ticks = std::mem::take(&mut ticks.lock().unwrap_or_else(PoisonError::into_inner).0);
    Walked { steps, ticks, log, q }
}

pub(super) fn walk(body: &str) -> Walked {
    walk_with(body, DecisionLog::recording(), Eyes::Twins, &Cancel::default())
}

pub(super) fn walk_slowly(body: &str, percents: &[u8]) -> Walked {
    walk_dialled(body, DecisionLog::recording(), Eyes::Twins, &Cancel::default(), percents)
}

/// How far ahead of the tool the jar stands, m.
pub(super) const AHEAD: f64 = 0.25;

/// Where the tool is at home, m.
pub(super) fn tool_at_home() -> Vector3<f64> {
    crate::twin::gen3().forward_tool(&kitchen::HOME).unwrap().origin()
}
