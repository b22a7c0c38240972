//! Execution: the gate before the arm, decisions kept in a log, scripts kept in bounds, and one contract for
//! every arm.

mod adapted;
mod amount;
mod arm_fit;
mod called;
mod contract;
mod cut_short;
mod during;
mod dial;
mod kortex;
mod limits;
mod moving;
mod script;
mod decisions;
mod together;
mod walked;

use std::sync::{Arc, Mutex};

use trueup::arm::Cancel;
use trueup::arm::limits::Limits;
use trueup::execution::body::Watcher;
use trueup::execution::cell::{Cell, Pads};
use trueup::execution::context::ActionContext;
use trueup::execution::decisions::DecisionLog;
use trueup::execution::script::Scripts;
use trueup::execution::twin_arm::{SharedTwin, TwinBody};
use trueup::motion::free::Means;
use trueup::motion::robot::Robot;
use trueup::trace::Nobody;
use trueup::twin::{Settings, Twin};
use trueup::world::{Scene, WorldState};

use crate::kitchen;

/// The kitchen's arm and things, with no water, which nothing here needs.
fn cell() -> Cell {
    let mut scene = kitchen::scene();
    for object in &mut scene.objects {
        if let Some(cavity) = &mut object.cavity {
            cavity.filled = 0.0;
        }
    }
    let robot = Arc::new(Robot::gen3());
    let pads = Pads::of(&Settings::for_arm(&robot));
    Cell { robot, scene: Arc::new(scene), limits: Limits::default(), pads, means: Means::default() }
}

/// The arm at `q`, the jar at `jar` (x, y m, yaw rad), the cup out of the way.
fn state(q: &[f64], jar: [f64; 3]) -> WorldState {
    let mut state = kitchen::state(jar, [0.45, 0.33, 0.0]);
    state.q = q.to_vec();
    for object in &mut state.objects {
        object.water = Some(0.0);
    }
    state
}

fn twin(scene: &Scene, state: &WorldState) -> SharedTwin {
    let arm = crate::twin::gen3();
    let settings = Settings::for_arm(&arm);
    Arc::new(Mutex::new(Twin::new(&arm, scene, state, settings).unwrap()))
}

/// Scripts over a twin at home with the jar in front.
fn scripts(cancel: &Cancel, log: DecisionLog) -> Scripts {
    scripts_watched(cancel, log, Arc::new(Mutex::new(Nobody)))
}

fn scripts_watched(cancel: &Cancel, log: DecisionLog, watcher: Watcher) -> Scripts {
    let cell = cell();
    let state = state(&kitchen::HOME, [0.60, -0.10, 0.0]);
    let twin = twin(&cell.scene, &state);
    let context = ActionContext::new(
        cell,
        Box::new(TwinBody::new(twin)),
        kitchen::HOME.to_vec(),
        log,
        (1, 0),
        cancel.clone(),
        watcher,
    );
    Scripts::new(context)
}
