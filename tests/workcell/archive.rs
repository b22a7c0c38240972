//! Run folders of older programs are read: what they did not keep is told from what they did.

use std::fs;

use trueup::trace::{Deed, StepRecord};
use trueup::workcell::{Aims, archive};

use crate::program::Scratch;
use crate::repl::kept::pour;

#[test]
fn what_an_older_program_did_to_things_is_told_by_the_names_of_its_actions() {
    let scratch = Scratch::new("old-record");
    let mut run = pour("level_side", 0.1, 0.01, 0.001);
    run.steps[0].action = "grasp(jar, side)".into();
    run.steps[1].action = "tilt(jar, cup, amount: 50 mL)".into();
    let mut old = serde_json::to_value(&run).unwrap();
    for step in old["steps"].as_array_mut().unwrap() {
        let step = step.as_object_mut().unwrap();
        for newer in ["call", "failure", "lines"] {
            step.remove(newer);
        }
    }
    let dir = scratch.path("run");
    fs::create_dir(&dir).unwrap();
    fs::write(dir.join("run.json"), old.to_string()).unwrap();
    let read = archive::load(&dir).unwrap();
    let deeds: Vec<_> = read.steps.iter().flat_map(|step| step.deeds().cloned()).collect();
    let expected = [
        Deed::Took { object: "jar".into() },
        Deed::Turned { source: "jar".into(), target: "cup".into() },
    ];
    assert_eq!(deeds, expected);

    // What a newer one keeps stands, whatever its actions are called.
    run.aims = Some(Aims::default());
    fs::write(dir.join("run.json"), serde_json::to_string(&run).unwrap()).unwrap();
    let read = archive::load(&dir).unwrap();
    assert_eq!(read.steps.iter().flat_map(StepRecord::deeds).count(), 0);
}
