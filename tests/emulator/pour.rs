//! The kitchen over the wire: the lab's arm behind the emulated controller, everything else as ever.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use trueup::arm::Cancel;
use trueup::emulator::{Emulator, Options as Wire, Pace};
use trueup::execution::calibrate::Switches;
use trueup::execution::lab_arm::{self, LabCamera, LabScales};
use trueup::kortex::arm::{KortexArm, Options as Client};
use trueup::lab::{Lab, LabSettings, Spot};
use trueup::language::ast::Step;
use trueup::language::parse_line;
use trueup::motion::free::Means;
use trueup::trace::Nobody;
use trueup::workcell::{CANDIDATES, Devices, Ending, Options, Run, Stdlib, WorkCell};

use super::admin;

fn no_time() -> f64 {
    0.0
}

/// A laboratory that is as assumed, so that regression 3 can be spared, with places that do.
fn options() -> Options {
    let mut lab = LabSettings::perfect();
    for (name, x_m, y_m) in [("jar", 0.60, 0.10), ("cup", 0.58, -0.22)] {
        lab.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad: 0.3 });
    }
    Options {
        robot: "lab".into(),
        scene: None,
        script: None,
        lab,
        stdlib: Stdlib::embedded(),
        seed: 1,
        switches: Switches { offset: false, ..Switches::default() },
        candidates: CANDIDATES,
        means: Means::default(),
        is_real_time: false,
        clock: no_time,
    }
}

fn run(cell: &mut WorkCell, text: &str) -> Run {
    let Some(Step::Act(act)) = parse_line(text).0 else { panic!("{text} is no call") };
    cell.run(&act.call, None, Box::new(Nobody)).unwrap()
}

#[test]
fn a_pour_over_the_wire_ends_as_in_the_lab() {
    let mut held: Option<Emulator> = None;
    let mut cell = WorkCell::open_with(options(), |robot, scene, options| {
        let lab = Lab::new(robot, scene, options.lab.clone(), options.seed).unwrap();
        let lab = Arc::new(Mutex::new(lab));
        let wire = Wire { pace: Pace::Eager, ..Wire::default() };
        let plant = Box::new(lab_arm::plant(lab.clone()));
        let emulator = Emulator::start(robot.clone(), plant, &wire).unwrap();
        let arm = KortexArm::connect(Client {
            host: "127.0.0.1".into(),
            port: emulator.tcp().port(),
            stream: None,
            login: admin(),
            rate: 40.0,
            timeout: Duration::from_mins(1),
            patience: Duration::from_mins(1),
            near: robot.pose("home").unwrap().to_vec(),
            max_opening: robot.max_opening(),
            clock: emulator.clock(),
        })
        .unwrap();
        held = Some(emulator);
        Ok(Devices {
            limits: Some(arm.about().soft.clone()),
            arm: Box::new(arm),
            camera: Box::new(LabCamera(lab.clone())),
            scales: Some(Box::new(LabScales(lab))),
            cancel: Cancel::default(),
        })
    })
    .unwrap();
    let over = run(&mut cell, "pour(jar, cup)");
    assert_eq!(over.outcome, Ending::Success, "{:?}", over.reason);
    let lab = run(&mut WorkCell::open(options()).unwrap(), "pour(jar, cup)");
    assert_eq!(lab.outcome, Ending::Success, "{:?}", lab.reason);
    assert_eq!(over.reached, lab.reached);
    let actions =
        |run: &Run| -> Vec<String> { run.steps.iter().map(|step| step.action.clone()).collect() };
    assert_eq!(actions(&over), actions(&lab));
    let (over, lab) = (over.water.unwrap(), lab.water.unwrap());
    assert!(over.spilt_ml < 5.0, "{over:?}");
    assert!((over.in_target_ml - lab.in_target_ml).abs() < 15.0, "{over:?} against {lab:?}");
    assert!(held.unwrap().status().sessions > 0);
}
