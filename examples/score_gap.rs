//! Scores `gap` on a folder of recordings whose hidden effects are known: `recordings/NNN_a.csv` to fit,
//! `NNN_b.csv` to judge, `truth/NNN.json` to compare with.
//!
//! `cargo run --release --example score_gap -- DIR [--robot-dir DIR] [ID...]`; without a folder there is
//! nothing to score. The truth is opened here and nowhere else in the project.
#![expect(clippy::print_stdout, reason = "an example shows what it does")]
#![expect(clippy::disallowed_methods, reason = "how long it takes is one of the scores")]

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::Value;
use trueup::discovery::finding::{self, Effect, Finding, Verdict};
use trueup::discovery::recording::{Map, Recording};
use trueup::discovery::{Options, Subject, investigate};
use trueup::motion::Robot;

/// A name and a place.
type Seat = (String, String);

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let Some(folder) = arguments.next().map(PathBuf::from) else {
        println!("skipped: no folder to score; give one with recordings/ and truth/");
        return Ok(());
    };
    let mut robot_dir = folder.join("../../../robot");
    let mut wanted: Vec<String> = Vec::new();
    while let Some(argument) = arguments.next() {
        if argument == "--robot-dir" {
            robot_dir = arguments.next().ok_or("--robot-dir needs a folder")?.into();
        } else {
            wanted.push(argument);
        }
    }
    let mut ids: Vec<String> = std::fs::read_dir(folder.join("truth"))?
        .filter_map(|entry| entry.ok()?.path().file_stem()?.to_str().map(str::to_owned))
        .filter(|id| wanted.is_empty() || wanted.contains(id))
        .collect();
    ids.sort();
    let mut score = Score::default();
    for id in &ids {
        let start = Instant::now();
        let finding = analyse(&folder, &robot_dir, id)?;
        let seconds = start.elapsed().as_secs_f64();
        let text = std::fs::read_to_string(folder.join("truth").join(format!("{id}.json")))?;
        let truth: Value = serde_json::from_str(&text)?;
        score.add(id, &finding, &truth, seconds);
    }
    score.print();
    Ok(())
}

/// Fits on `a`, judges on `b`.
fn analyse(folder: &Path, robot_dir: &Path, id: &str) -> Result<Finding, Box<dyn Error>> {
    let mut recordings = Vec::new();
    for part in ["a", "b"] {
        let path = folder.join("recordings").join(format!("{id}_{part}.csv"));
        let sidecar = std::fs::read_to_string(path.with_extension("json")).ok();
        let sidecar = sidecar.as_deref().map(|text| ("sidecar", text));
        let text = std::fs::read_to_string(&path)?;
        let read = Recording::read(&path.display().to_string(), &text, sidecar, &Map::default());
        recordings.push(read.map_err(|error| format!("{}: {error}", error.place))?);
    }
    let sidecar = &recordings[0].sidecar;
    let robot = match &sidecar.robot {
        Some(name) => Robot::from_file(&robot_dir.join(name), sidecar.tip.as_deref())?,
        None => Robot::gen3(),
    };
    let options = Options::default();
    let found = investigate(&recordings, Subject::Arm(&robot, &[]), &options, &mut |_, _| {});
    found.map(|found| found.finding).map_err(|error| format!("{}: {error}", error.place).into())
}

#[derive(Default)]
struct Score {
    singles: (usize, usize),
    /// Of the singles, how many were right but not alone, or ambiguous.
    doubts: usize,
    pairs: (usize, usize),
    controls: (usize, usize),
    sizes: (usize, usize),
    shrinks: Vec<f64>,
    /// The share of draws that name it, of each name that is in no doubt.
    steady: Vec<f64>,
    seconds: Vec<f64>,
    confusion: BTreeMap<(String, String), usize>,
}

impl Score {
    fn add(&mut self, id: &str, finding: &Finding, truth: &Value, seconds: f64) {
        let hidden: Vec<&Value> =
            truth["effects"].as_array().map_or(Vec::new(), |all| all.iter().collect());
        let found: Vec<&Effect> = finding.effects.iter().collect();
        self.seconds.push(seconds);
        let said: Vec<String> = found.iter().map(|e| format!("{}({})", e.name, e.at)).collect();
        self.steady.extend(found.iter().filter(|e| !e.indistinguishable).map(|e| e.stability));
        let verdict = serde_json::to_value(finding.verdict).unwrap_or_default();
        let verdict = verdict.as_str().unwrap_or_default().to_owned();
        let names: Vec<String> =
            hidden.iter().map(|e| format!("{}({})", text(&e["name"]), text(&e["at"]))).collect();
        let hit = |effect: &Value| found.iter().find(|found| accepts(effect, found));
        let hits = hidden.iter().filter(|effect| hit(effect).is_some()).count();
        let extra = finding.verdict != Verdict::Ambiguous && found.len() > hidden.len();
        let right = hits == hidden.len() && !extra;
        let mut sizes = Vec::new();
        match hidden.len() {
            0 => {
                self.controls.1 += 1;
                self.controls.0 += usize::from(found.is_empty());
            }
            1 => {
                self.singles.1 += 1;
                self.singles.0 += usize::from(right);
                self.doubts += usize::from(right && finding.verdict == Verdict::Ambiguous);
            }
            _ => {
                self.pairs.1 += 1;
                self.pairs.0 += usize::from(right);
            }
        }
        for effect in &hidden {
            let Some(found) = hit(effect) else { continue };
            if let Some(error) = size_error(effect, found) {
                self.sizes.1 += 1;
                self.sizes.0 += usize::from(error < 0.1);
                sizes.push(format!("{:.1} %", error * 100.0));
            }
        }
        if !hidden.is_empty() && finding.gap.before.heldout > 1.02 {
            self.shrinks.push(finding.gap.shrink_heldout);
        }
        let key = |names: &[String]| {
            let kinds: Vec<&str> =
                names.iter().map(|n| n.split('(').next().unwrap_or_default()).collect();
            if kinds.is_empty() { "nothing".to_owned() } else { kinds.join(" + ") }
        };
        *self.confusion.entry((key(&names), key(&said))).or_insert(0) += 1;
        println!(
            "{} {id} {seconds:5.1} s  {:<15} gap {:6.2} -> {:5.3}  {}  |  hidden {}  size off {}  {:.2}",
            if right { "ok   " } else { "WRONG" },
            verdict,
            finding.gap.before.heldout,
            finding.gap.after.heldout,
            said.join(" + "),
            names.join(" + "),
            sizes.join(", "),
            found.iter().map(|effect| effect.stability).fold(1.0, f64::min),
        );
    }

    fn print(&self) {
        println!("\nhidden -> said");
        for ((hidden, said), count) in &self.confusion {
            let mark = if hidden == said { ' ' } else { '*' };
            println!("{mark} {count:3}  {hidden} -> {said}");
        }
        let of = |(right, all): (usize, usize)| format!("{right}/{all}");
        println!(
            "\nsingle effects named with place: {} ({} as a doubt)",
            of(self.singles),
            self.doubts
        );
        println!("pairs, both named with place:    {}", of(self.pairs));
        println!("controls without a false alarm:  {}", of(self.controls));
        println!("sizes within 10 %:               {}", of(self.sizes));
        let mut shrinks = self.shrinks.clone();
        shrinks.sort_by(f64::total_cmp);
        if let (Some(least), Some(median)) = (shrinks.first(), shrinks.get(shrinks.len() / 2)) {
            println!("held-out shrink:                 least {least:.3}, median {median:.3}");
        }
        let least = self.steady.iter().copied().fold(1.0, f64::min);
        let below = self.steady.iter().filter(|share| **share < 0.9).count();
        println!(
            "draws that name it:              least {least:.2}, below 0.9 {below} of {}",
            self.steady.len()
        );
        let most = self.seconds.iter().copied().fold(0.0, f64::max);
        let mean = self.seconds.iter().sum::<f64>() / self.seconds.len().max(1) as f64;
        println!("seconds per pair of recordings:  mean {mean:.1}, most {most:.1}");
    }
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

/// Returns whether what was found is the hidden effect or one that the truth says is as right.
fn accepts(hidden: &Value, found: &Effect) -> bool {
    let mut right: Vec<Seat> = vec![(text(&hidden["name"]).into(), text(&hidden["at"]).into())];
    for other in hidden["also"].as_array().map_or(&[][..], Vec::as_slice) {
        let at = other[1].as_str().unwrap_or_else(|| text(&hidden["at"]));
        right.push((text(&other[0]).into(), at.into()));
    }
    right.iter().any(|(name, at)| *name == found.name && *at == found.at)
}

/// Returns the relative error of the effect's size, where the truth gives one number to compare.
fn size_error(hidden: &Value, found: &Effect) -> Option<f64> {
    let truth = hidden["magnitude"].as_f64()?;
    let number = |name: &str| match &found.parameters.get(name)?.value {
        finding::Value::Number(value) => Some(*value),
        finding::Value::Vector(values) => Some(values.iter().map(|v| v * v).sum::<f64>().sqrt()),
    };
    let length = |names: &[&str]| {
        let sum: f64 = names.iter().filter_map(|name| number(name)).map(|v| v * v).sum();
        (sum > 0.0).then(|| sum.sqrt())
    };
    let size = match found.name.as_str() {
        "asymmetric_friction" => number("forward")? - number("backward")?,
        "stribeck_friction" => number("stiction")? - number("torque")?,
        "torque_gain" => number("gain")? - 1.0,
        "actuator_gain" => 1.0 - number("gain")?,
        "tool_offset" | "link_length" => length(&["dx", "dy", "dz"])?,
        "camera_shift" => length(&["xyz"]).or_else(|| length(&["rpy"]))?,
        "base_tilt" => length(&["roll", "pitch"])?,
        "payload" => number("mass")?,
        "torque_ripple" => number("amplitude")?,
        "joint_zero_offset" => number("angle")?,
        "saturation" => number("limit")?,
        "backlash" => number("width")?,
        "joint_compliance" => number("compliance")?,
        "command_delay" | "sensor_delay" => number("delay")?,
        "torque_drift" => number("rate")?,
        "coulomb_friction" | "hysteresis" | "torque_offset" => number("torque")?,
        "viscous_friction" | "quadratic_friction" | "unknown" => number("coefficient")?,
        _ => return None,
    };
    Some((size.abs() / truth.abs() - 1.0).abs())
}
