//! No layer outside `lab` can read its truth: shown on the source, where a getter would have to be.

use std::fs;
use std::path::{Path, PathBuf};

use trueup::lab::{Lab, LabSettings};
use trueup::motion::Robot;

use crate::kitchen;

fn src() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let text = text.split("#[cfg(test)]").next().unwrap_or_default();
    text.lines()
        .map(|line| line.split("//").next().unwrap_or_default())
        .collect::<Vec<_>>()
        .join("\n")
}

/// All that can be asked of a laboratory. A new public function has to be argued for here: does a person
/// with an arm, a camera and kitchen scales know what it returns?
const ASKED: &[&str] = &[
    "new", "photo", "shutter", "command", "grip", "stop", "advance", "feedback", "scales", "time",
    "water_in",
];

#[test]
fn a_laboratory_offers_only_what_a_laboratory_offers() {
    let text = code(&src().join("lab/mod.rs"));
    let found: Vec<&str> = text
        .split("pub fn ")
        .skip(1)
        .map(|rest| rest.split(['(', '<']).next().unwrap_or_default())
        .collect();
    for name in &found {
        assert!(ASKED.contains(name), "`{name}` is not among what a laboratory may be asked");
    }
    assert_eq!(found.len(), ASKED.len(), "the list names functions that are no more");
    // The truth is known in its own module and to the laboratory only, and no module of it is public.
    assert!(!text.contains("pub mod"), "every module of the laboratory is private");
    // An exposed picture gives the picture and nothing else.
    let negative = code(&src().join("lab/negative.rs"));
    let public: Vec<&str> = negative.split("pub fn ").skip(1).collect();
    assert!(public.len() == 1 && public[0].starts_with("develop"), "a picture gives away more");
    assert!(!negative.contains("derive") && !negative.contains("pub view"));
    assert!(!code(&src().join("lab/truth.rs")).replace("pub(super)", "").contains("pub "));
    let lab = text.split("pub struct Lab {").nth(1).unwrap().split('}').next().unwrap();
    assert!(!lab.contains("pub "), "a field of the laboratory is public");
    for word in ["impl Clone for Lab", "impl Deref", "impl Serialize for Lab", "impl AsRef"] {
        assert!(!text.contains(word), "{word}");
    }
    let before = text.split("pub struct Lab {").next().unwrap();
    assert!(!before.trim_end().ends_with(']'), "nothing is derived for the laboratory");
}

#[test]
fn what_is_printed_of_a_laboratory_tells_nothing() {
    let scene = kitchen::scene();
    let lab = Lab::new(&Robot::gen3(), &scene, LabSettings::default(), 11).unwrap();
    assert_eq!(format!("{lab:?}"), "Lab { seed: 11, .. }");
}

/// Only the arm and camera that stand for the laboratory may name it, and what wires or serves them.
#[test]
fn few_layers_know_the_laboratory_at_all() {
    let allowed = ["lab", "execution/lab_arm.rs", "execution/lab_arm", "workcell", "cli"];
    let mut wrong = Vec::new();
    let mut folders = vec![src()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let inside = path.strip_prefix(src()).unwrap().to_owned();
            let ours = allowed.iter().any(|name| inside.starts_with(name));
            if !ours && inside.extension().is_some_and(|e| e == "rs") {
                let text = code(&path);
                if text.contains("crate::lab") || text.contains("trueup::lab") {
                    wrong.push(inside.display().to_string());
                }
            }
        }
    }
    assert!(wrong.is_empty(), "these files name the laboratory: {wrong:?}");
}
