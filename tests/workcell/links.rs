//! The links of a run that is kept: found where the robot at hand gives the tool where the run says it was.

use trueup::lab::LabSettings;
use trueup::trace::{Outcome, StepRecord};
use trueup::workcell::links::Links;
use trueup::workcell::{Run, Stdlib};
use trueup::world::{Pose, WorldState};

use super::options;

/// Where the arm is, rad: near its home.
const Q: [f64; 7] = [0.0, 0.26, 3.1, -2.27, 0.0, 0.96, 1.5];

/// A run of one step, after which the tool was off by `off` m from where its joints have it.
fn run(off: f64) -> Run {
    let opened = trueup::workcell::WorkCell::open(options(LabSettings::default(), 1)).unwrap();
    let robot = Stdlib::embedded().robot(&opened.scene().robot).unwrap();
    let base_from_tool = robot.forward_tool(&Q).unwrap();
    let shift = Pose::upright(off, 0.0, 0.0, 0.0);
    let measured = WorldState {
        time: 1.0,
        q: Q.to_vec(),
        opening: 0.05,
        world_from_tool: shift * (opened.scene().world_from_base * base_from_tool),
        held: None,
        objects: Vec::new(),
        spilt: None,
        unknown: Vec::new(),
    };
    let step = StepRecord {
        number: 1,
        path: "home".into(),
        action: "home()".into(),
        call: None,
        outcome: Outcome::Success,
        not_needed: None,
        reason: None,
        failure: None,
        interval_s: [0.0, 1.0],
        fluents: Vec::new(),
        during: Vec::new(),
        lines: Vec::new(),
        planned_q: Vec::new(),
        hamming: 0,
        score: 1.0,
        measured,
        twin: None,
    };
    Run::so_far("home()", &[step])
}

#[test]
fn the_links_lead_from_the_base_to_the_tool() {
    let run = run(0.0);
    let links = Links::of(&run, options(LabSettings::default(), 1)).unwrap().unwrap();
    let poses = links.at(&Q, 0.05).unwrap();
    assert_eq!(poses.len(), links.names().len());
    let chain = links.chain();
    assert!(chain.len() > 8, "{chain:?}");
    let tool = poses[*chain.last().unwrap()].translation.vector;
    assert!((tool - run.steps[0].measured.world_from_tool.origin()).norm() < 1e-9);
    assert!(links.at(&Q[..6], 0.05).is_none(), "an arm of six joints is another arm");
}

#[test]
fn a_robot_that_has_the_tool_elsewhere_is_not_the_runs() {
    assert!(Links::of(&run(0.001), options(LabSettings::default(), 1)).unwrap().is_none());
    let untold = Run::so_far("home()", &[]);
    assert!(Links::of(&untold, options(LabSettings::default(), 1)).unwrap().is_none());
}
