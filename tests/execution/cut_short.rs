//! A step that a person stopped: what was on its way is in doubt in its record, too.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use trueup::arm::{Arm, Cancel, DeviceError, Grip};
use trueup::execution::body::{Body, Sight};
use trueup::execution::context::ActionContext;
use trueup::execution::decisions::DecisionLog;
use trueup::execution::error::ActionError;
use trueup::execution::script::Scripts;
use trueup::execution::twin_arm::TwinBody;
use trueup::execution::walk::{Texts, Walker};
use trueup::graph::{self, infer};
use trueup::language::ast::{Expr, Step};
use trueup::language::{Library, Source, parse_line};
use trueup::trace::{Nobody, Outcome};
use trueup::world::WorldState;

use crate::kitchen;

struct Rises;

impl Texts for Rises {
    fn script(&self, _: &str) -> Option<&str> {
        Some("arm.move_by([0.0, 0.0, 0.05], 0.2);")
    }
}

/// The twin's arm, of whose water nothing is known once something was cut short; it may say no more then.
struct Unweighed {
    twin: TwinBody,
    falls_silent: bool,
    is_in_doubt: bool,
}

impl Unweighed {
    fn known(&mut self) -> Result<WorldState, DeviceError> {
        let mut state = self.twin.state()?;
        for object in state.objects.iter_mut().filter(|_| self.is_in_doubt) {
            object.water = None;
        }
        Ok(state)
    }
}

impl Body for Unweighed {
    fn arm(&mut self) -> &mut dyn Arm {
        self.twin.arm()
    }

    fn state(&mut self) -> Result<WorldState, DeviceError> {
        if self.is_in_doubt && self.falls_silent {
            return Err(DeviceError::Unavailable("too warm to say".into()));
        }
        self.known()
    }

    fn last_state(&mut self) -> Option<WorldState> {
        self.known().ok()
    }

    fn sight(&self) -> Box<dyn Sight> {
        self.twin.sight()
    }

    fn look(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    fn gripped(&mut self, _grip: Grip, _aim: Option<&str>) -> Result<(), DeviceError> {
        Ok(())
    }

    fn weighed(&mut self, _mass: f64) {}

    fn cut_short(&mut self) {
        self.is_in_doubt = true;
    }

    fn contact(&mut self, _a: &str, _b: &str) -> Option<bool> {
        None
    }
}

/// Ctrl-C in the middle of `tilt`: its record told the contents from before the turn as measured, "pouring(jar, cup) no, by
/// -2 mL", and the prompt a moment later that it is unknown.
#[test]
fn what_was_on_its_way_is_unknown_in_the_record_of_the_step_that_was_stopped() {
    is_recorded(false);
}

/// A bridge that refused `step`, and then `feedback`: only that was told, and there was no step in the run.
#[test]
fn a_step_is_recorded_though_the_arm_says_no_more_where_it_is() {
    is_recorded(true);
}

/// Holds what is recorded of a step that was stopped against what it should be.
fn is_recorded(falls_silent: bool) {
    let mut library = Library::standard();
    let text = "action rise() { run \"rise.rhai\" }\ntask t() { rise() }\n";
    library.add(Source::new("t.task", text));
    let Some(Step::Act(act)) = parse_line("t()").0 else { panic!("no call") };
    let graph = graph::build(&library, &act.call).unwrap();
    let given = infer::Given {
        definitions: &library,
        holds: &|_: &Expr| None,
        pins: &BTreeMap::new(),
        priors: None,
        cost: &|_| 0.0,
    };
    let pg = graph::best(&graph, &given).unwrap();
    let cell = super::cell();
    let scene = cell.scene.clone();
    let state = super::state(&kitchen::HOME, [0.60, -0.10, 0.0]);
    let twin = TwinBody::new(super::twin(&scene, &state));
    let cancel = Cancel::default();
    let mut scripts = Scripts::new(ActionContext::new(
        cell,
        Box::new(Unweighed { twin, falls_silent, is_in_doubt: false }),
        kitchen::HOME.to_vec(),
        DecisionLog::recording(),
        (1, 0),
        cancel.clone(),
        Arc::new(Mutex::new(Nobody)),
    ));
    let start = scripts.context().state().unwrap();
    assert!(start.object("jar").unwrap().water.is_some());
    let mut walker = Walker::new(&mut scripts, &Rises, &library, &scene, &start);
    cancel.cancel();
    let error = walker.step(&pg, 0, &[]).unwrap_err();
    assert!(matches!(error, ActionError::Stopped), "{error}");
    let done = walker.interrupted(&pg, 0, start.time, &[], &error).unwrap();
    assert_eq!(done.outcome, Outcome::Stopped);
    let water: Vec<Option<f64>> = done.state.objects.iter().map(|object| object.water).collect();
    assert!(water.iter().all(Option::is_none), "{water:?}");
}
