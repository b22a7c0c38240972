//! What the arm is commanded, tick by tick over whole tasks: no joint faster and none pushed harder than the limits say, the first tick of
//! every motion included.
//!
//! Of a pour by weighing one command stepped by 0.008 rad while the hand held a leaning jar: a motion may begin a little beside the last
//! command, and it began there. So did strokes of a wipe.

use std::sync::{Arc, Mutex};

use trueup::arm::limits::Limits;
use trueup::lab::LabSettings;
use trueup::language::Source;
use trueup::motion::Robot;
use trueup::trace::{Event, Observer};
use trueup::workcell::{Options, WorkCell};

use super::{call, options};

/// When the arm was sent somewhere, s, and where, rad.
type Sent = (f64, Vec<f64>);

/// All that the arm was sent.
#[derive(Clone, Default)]
struct Commands(Arc<Mutex<Vec<Sent>>>);

impl Observer for Commands {
    fn event(&mut self, event: &Event) {
        let Event::Tick(feedback) = event else { return };
        self.0.lock().unwrap().push((feedback.time, feedback.q_cmd.clone()));
    }
}

/// Carries a call out in a laboratory that is as wrong as they are, and returns what the arm was sent.
fn sent(line: &str, scene: Option<Source>) -> Vec<Sent> {
    let commands = Commands::default();
    let mut cell = WorkCell::open(Options { scene, ..options(LabSettings::default(), 2) }).unwrap();
    let run = cell.run(&call(line), None, Box::new(commands.clone())).unwrap();
    assert!(run.outcome.is_done(), "{line}: {:?}", run.reason);
    std::mem::take(&mut *commands.0.lock().unwrap())
}

/// Fails for the first command that no arm within its limits follows.
fn keeps_the_limits(line: &str, sent: &[Sent]) {
    let (robot, most) = (Robot::gen3(), Limits::default().scale + 1e-6);
    assert!(sent.len() > 1000, "{line}: {} ticks", sent.len());
    for three in sent.windows(3) {
        let (before, now) = (three[1].0 - three[0].0, three[2].0 - three[1].0);
        let times = three[1].0;
        assert!(before > 0.0 && now > 0.0, "{line}: the clock stands at {times:.3} s");
        for (i, joint) in robot.joints().iter().enumerate() {
            let at = |k: usize| three[k].1[i];
            let (was, is) = ((at(1) - at(0)) / before, (at(2) - at(1)) / now);
            let push = (is - was) / (0.5 * (before + now));
            let (fast, hard) = (is.abs() / joint.velocity, push.abs() / joint.acceleration);
            assert!(
                fast <= most && hard <= most,
                "{line}: joint {} at {times:.3} s: {fast:.2} of its speed, {hard:.2} of its acceleration",
                i + 1
            );
        }
    }
}

#[test]
fn a_pour_by_weighing_steps_nowhere() {
    let line = "pour(jar, cup, amount: 60 mL)";
    keeps_the_limits(line, &sent(line, None));
}

#[test]
fn a_wipe_steps_nowhere() {
    let line = "wipe(plate)";
    let scene = Source::new("wiping.task", include_str!("../tables/wiping.task"));
    keeps_the_limits(line, &sent(line, Some(scene)));
}
