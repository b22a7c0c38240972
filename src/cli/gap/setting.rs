//! Whether the scene and the robot at hand are those that a run was made with.
//!
//! Another arm's model explains nothing of a recording: what it lacks would be invented.

use std::path::Path;

use crate::motion::Robot;
use crate::report::Failure;
use crate::workcell::{Run, links};
use crate::world::Scene;

/// What helps where nobody knows what a run was made with.
const NAME_IT: &str =
    "name the run's scene with `--scene FILE`, and the folder of its robot with `--stdlib DIR`";

/// What is at hand to judge runs by.
pub(super) struct AtHand<'a> {
    pub(super) robot: &'a Robot,
    pub(super) scene: &'a Scene,
    /// Whether somebody said that it is to be this scene.
    pub(super) is_named: bool,
}

impl AtHand<'_> {
    /// Says why a run is of another arm or scene, if it is.
    pub(super) fn refuses(&self, run: &Run) -> Option<Failure> {
        let Self { robot, scene, is_named } = *self;
        let (name, arm) = (&scene.name, &scene.robot);
        let agree = links::agree(run, robot, scene);
        let said = run.setting.as_ref();
        if agree == Some(false) {
            let what = format!(
                "these joints do not put the tool of `{arm}`, the arm of the scene `{name}`, where the run says that it was"
            );
            return Some(refusal(what, run));
        }
        let is_other = |own: &str, with: &str| {
            (!is_named && own != *name) || (agree.is_none() && with != *arm)
        };
        let other = said.filter(|said| is_other(&said.name, &said.robot))?;
        let what = format!(
            "the run was made with `{}` in the scene `{}`, and at hand is `{arm}` in `{name}`",
            other.robot, other.name
        );
        Some(refusal(what, run))
    }
}

/// A run of another arm or scene; where the run says what it was made with, that is what helps.
fn refusal(what: String, run: &Run) -> Failure {
    let file = run.setting.as_ref().and_then(|said| said.file.as_ref());
    let gone = file.filter(|file| !Path::new(file).is_file());
    let help = gone.map_or_else(
        || NAME_IT.to_owned(),
        |file| format!("its scene was in {file}, which is not there now; {NAME_IT}"),
    );
    Failure::input("gap::setting", what).help(help)
}

/// Says that the file of a run's scene has been edited since, if it has; `text` is what it holds now.
pub(super) fn changed(run: &Run, file: &Path, text: &str) -> Option<String> {
    let said = run.setting.as_ref()?;
    let is_it = said.file.as_deref().is_some_and(|named| Path::new(named) == file);
    (is_it && said.is_changed(text)).then(|| {
        format!(
            "{} has been edited since the run was made; it is taken as it is now",
            file.display()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workcell::{Setting, Stdlib, library, scene_of};
    use crate::world::{Pose, WorldState};

    /// A run that began where the arm of the kitchen is at home, its tool `off` m aside.
    fn run(robot: &Robot, scene: &Scene, off: f64) -> Run {
        let q = vec![0.3; robot.n_joints()];
        let base_from_tool = robot.forward_tool(&q).unwrap();
        let shift = Pose::upright(off, 0.0, 0.0, 0.0);
        let start = WorldState {
            time: 0.0,
            q,
            opening: 0.05,
            world_from_tool: shift * (scene.world_from_base * base_from_tool),
            held: None,
            objects: Vec::new(),
            spilt: None,
            unknown: Vec::new(),
        };
        Run { start: Some(start), ..Run::so_far("home()", &[]) }
    }

    fn setting(name: &str, robot: &str, file: Option<&str>) -> Setting {
        let (file, sha256) = (file.map(str::to_owned), file.map(|_| "00".to_owned()));
        Setting { name: name.into(), robot: robot.into(), file, sha256, stdlib: None }
    }

    /// A run of a Panda was judged by the Gen3, and four effects were named.
    #[test]
    fn a_run_of_another_arm_or_scene_is_refused_and_its_own_is_not() {
        let stdlib = Stdlib::embedded();
        let scene = scene_of(&library(&stdlib), None).unwrap();
        let robot = stdlib.robot(&scene.robot).unwrap();
        let own = AtHand { robot: &robot, scene: &scene, is_named: false };
        let kitchen = run(&robot, &scene, 0.0);
        assert_eq!(own.refuses(&kitchen), None, "a record that does not say is judged by its tool");
        assert_eq!(own.refuses(&Run::so_far("home()", &[])), None, "nothing to tell by");
        let off = own.refuses(&run(&robot, &scene, 0.001)).unwrap();
        assert!(off.message.contains("do not put the tool") && off.code == "gap::setting");

        let panda = stdlib.robot("panda").unwrap();
        let theirs = run(&panda, &scene, 0.0);
        assert!(own.refuses(&theirs).is_some());
        let theirs_only = AtHand { robot: &panda, ..own };
        assert_eq!(theirs_only.refuses(&theirs), None);

        // The same arm on another table, whose file is gone: named, it is taken at its word.
        let moved =
            Run { setting: Some(setting("bench", &scene.robot, Some("gone.task"))), ..kitchen };
        let why = own.refuses(&moved).unwrap();
        assert!(why.message.contains("in the scene `bench`"), "{}", why.message);
        assert!(why.help.unwrap().contains("gone.task, which is not there"));
        assert_eq!(AtHand { is_named: true, ..own }.refuses(&moved), None);
        let unmoved =
            Run { setting: Some(setting("bench", "panda", None)), ..Run::so_far("home()", &[]) };
        assert!(AtHand { is_named: true, ..own }.refuses(&unmoved).is_some());
    }

    #[test]
    fn a_scene_that_was_edited_since_is_told() {
        let run = Run {
            setting: Some(setting("bench", "panda", Some("a.task"))),
            ..Run::so_far("p()", &[])
        };
        assert!(changed(&run, Path::new("a.task"), "scene").unwrap().contains("a.task"));
        assert_eq!(changed(&run, Path::new("b.task"), "scene"), None);
    }
}
