//! What the hand carried during a run and when it leaned on something, for `gap` on the arm's recording of it.
//!
//! The steps say when something was taken and left, the scene how heavy it is, the state after each step what was
//! inside. Nothing that was hidden is used: what the arm's torques say about the mass is what `gap` is to find.

use crate::discovery::recording::sidecar::{Carried, TorqueSensor};
use crate::discovery::recording::{Map, Recording, Segment, Sidecar};
use crate::motion::Robot;
use crate::trace::{Deed, Line, Outcome, StepRecord};
use crate::units::Dimension;
use crate::world::{Object, Scene, WATER_DENSITY};

use super::devices::place;
use super::{Error, Options, Run, links, poured, wording};

/// A scale is read so often, s.
const SCALE: f64 = 0.1;

/// Before the fingers open the table may bear the thing already, s.
const SET_DOWN: f64 = 0.3;

/// The words of scripts at which the hand leans on something: from there to the end of its step nobody knows how hard.
const LEANS: [&str; 4] = ["push", "pull", "move_until", "offer"];

/// The one of them after which what is held stays on its rail, which bears it.
const GUIDED: [&str; 1] = ["pull"];

/// Adds to the arm's recording of a run what the run says: its steps, what was carried, when the arm leaned on something, the encoders'
/// zeros that its calibration found, and on which side of the gears the embedded arms feel torques. What a sidecar of the
/// recording's own says stays.
pub fn carried(run: &Run, recording: &mut Recording, robot: &Robot, scene: &Scene) {
    let own = &mut recording.sidecar;
    if own.segments.is_empty() {
        own.segments = run.steps.iter().map(segment).collect();
    }
    // What the run's calibration found of the encoders is no gap of the model.
    let calibrated = run.calibration.as_ref().map_or(&[][..], |found| &found.zeros);
    if own.zero_offset.is_empty() && !calibrated.is_empty() {
        own.zero_offset = calibrated.to_vec();
        recording.notes.push(wording::zeros_calibrated(&recording.name));
    }
    let own = &mut recording.sidecar;
    if matches!(run.robot.as_str(), "lab" | "twin") {
        own.torque_sensor = TorqueSensor::Link;
    }
    if own.contacts.is_empty() {
        own.contacts = contacts(&run.steps);
    }
    if !own.carried.is_empty() {
        return;
    }
    let scale = poured::scale_under(run);
    let mut carried = Vec::new();
    for stretch in stretches(&run.steps).into_iter().filter(|stretch| !stretch.is_guided()) {
        let Some(mut one) = one(&stretch, robot, scene) else { continue };
        if stretch.goes_into(&scale) {
            weighed(&mut one, recording);
        }
        carried.push(one);
    }
    recording.sidecar.carried = carried;
}

/// Returns what a run says of the arm's recording of it, `arm` being the text of its `arm.csv`; `None` where the robot and the
/// scene at hand are not the run's, or the text is no recording.
///
/// # Errors
///
/// As [`super::WorkCell::open`].
pub fn told(run: &Run, arm: &str, mut options: Options) -> Result<Option<Sidecar>, Error> {
    let (_, scene, robot) = place(&mut options)?;
    if links::agree(run, &robot, &scene) == Some(false) {
        return Ok(None);
    }
    let Ok(mut recording) = Recording::read("arm.csv", arm, None, &Map::default()) else {
        return Ok(None);
    };
    carried(run, &mut recording, &robot, &scene);
    let mut told = recording.sidecar;
    told.robot = Some(scene.robot.clone());
    told.tip = robot.links().get(robot.tip()).map(|link| link.name.clone());
    Ok(Some(told))
}

/// Takes what was inside from the scale under the vessel that it was poured into, if one was read: what that gained is no
/// longer in the hand. That says when it left, which the states before and after a step do not.
fn weighed(carried: &mut Carried, recording: &Recording) {
    let (Some(first), Some(last)) = (carried.contents_kg.first(), carried.contents_kg.last())
    else {
        return;
    };
    let Ok(mass) = recording.column("mass", Dimension::MASS) else { return };
    let time = &recording.time;
    let row = |at: f64| time.partition_point(|t| *t < at).min(time.len() - 1);
    let (from, to) = (row(first[0]), row(last[0]));
    let every = ((SCALE / recording.step()).round() as usize).max(1);
    let read: Vec<[f64; 2]> = (from..=to)
        .step_by(every)
        .map(|row| [time[row], (first[1] - (mass[row] - mass[from]).max(0.0)).max(0.0)])
        .collect();
    if last[1] < first[1] {
        carried.contents_kg = read;
    }
}

fn segment(step: &StepRecord) -> Segment {
    let [from, to] = step.interval_s;
    Segment { name: step.action.clone(), from, to }
}

/// Returns when the arm leaned on something: from the line that does to the end of its step, and as long as the hand holds what a
/// rail guides.
fn contacts(steps: &[StepRecord]) -> Vec<Segment> {
    let leaning = steps.iter().filter_map(|step| {
        let line = step.lines.iter().find(|line| calls(line, &LEANS))?;
        Some(Segment { from: step.interval_s[0] + line.at_s, ..segment(step) })
    });
    let guided = stretches(steps).into_iter().filter(Stretch::is_guided).filter_map(|stretch| {
        let (first, last) = (stretch.steps.first()?, stretch.left.or(stretch.steps.last())?);
        let [from, to] = [first.interval_s[0], last.interval_s[1]];
        Some(Segment { name: stretch.name.to_owned(), from, to })
    });
    leaning.chain(guided).collect()
}

/// Returns whether a line of a script calls one of these words.
fn calls(line: &Line, words: &[&str]) -> bool {
    let text = line.text.as_str();
    let is_called = |word: &&str| {
        text.match_indices(*word).any(|(at, _)| {
            let before = text[..at].chars().next_back();
            let is_whole = before.is_none_or(|c| !c.is_alphanumeric() && c != '_');
            is_whole && text[at + word.len()..].trim_start().starts_with('(')
        })
    };
    words.iter().any(is_called)
}

/// Steps during which one thing was held, the step that took it first; with it the step that left it.
struct Stretch<'a> {
    name: &'a str,
    steps: &'a [StepRecord],
    left: Option<&'a StepRecord>,
}

impl Stretch<'_> {
    /// Returns whether what was held is on a rail, as a drawer is.
    fn is_guided(&self) -> bool {
        self.steps.iter().flat_map(|step| &step.lines).any(|line| calls(line, &GUIDED))
    }

    /// Returns whether all that was poured meanwhile went into `vessel`, as far as the steps say.
    fn goes_into(&self, vessel: &str) -> bool {
        let deeds = self.steps.iter().flat_map(StepRecord::deeds);
        let mut targets = deeds.filter_map(|deed| match deed {
            Deed::Turned { source, target } if source == self.name => Some(target),
            _ => None,
        });
        targets.all(|target| target == vessel)
    }
}

fn stretches(steps: &[StepRecord]) -> Vec<Stretch<'_>> {
    let mut found = Vec::new();
    let mut from = 0;
    while from < steps.len() {
        let Some(name) = steps[from].measured.held.as_deref() else {
            from += 1;
            continue;
        };
        let holds = |step: &StepRecord| step.measured.held.as_deref() == Some(name);
        let count = steps[from..].iter().take_while(|step| holds(step)).count();
        let left = steps.get(from + count);
        // What was in the hand when the run began, or dropped in a step that failed, has no known begin or end.
        if steps[from].outcome == Outcome::Success && from > 0 {
            found.push(Stretch { name, steps: &steps[from..from + count], left });
        }
        from += count;
    }
    found
}

fn one(stretch: &Stretch<'_>, robot: &Robot, scene: &Scene) -> Option<Carried> {
    let object = scene.object(stretch.name)?;
    let took = stretch.steps.first()?;
    let state = &took.measured;
    let pose = state.object(stretch.name)?.world_from_object?;
    let flange = scene.world_from_base.isometry() * robot.forward(&state.q).ok()?.isometry();
    let mut water: Vec<[f64; 2]> = Vec::new();
    let mut inside = |time: f64, step: &StepRecord| {
        if let Some(volume) = step.measured.object(stretch.name).and_then(|object| object.water) {
            water.push([time, WATER_DENSITY * volume]);
        }
    };
    inside(took.interval_s[1], took);
    for pair in
        stretch.steps.windows(2).filter(|pair| pair[1].interval_s[1] > pair[1].interval_s[0])
    {
        // What is inside changes while a step runs, evenly for all that is known.
        inside(pair[1].interval_s[0], &pair[0]);
        inside(pair[1].interval_s[1], &pair[1]);
    }
    let middle = middle(object, water.first().map_or(0.0, |[_, kg]| *kg));
    let com = flange.inverse() * (pose.isometry() * nalgebra::Point3::new(0.0, 0.0, middle));
    let end = stretch.steps.last()?.interval_s[1];
    let left_s =
        stretch.left.map_or([end, end], |step| [step.interval_s[0] - SET_DOWN, step.interval_s[1]]);
    Some(Carried {
        object: stretch.name.to_owned(),
        taken_s: took.interval_s,
        left_s: [left_s[0].max(took.interval_s[1]), left_s[1]],
        mass_kg: object.mass,
        contents_kg: water,
        com_m: [com.x, com.y, com.z],
    })
}

/// Returns the height of the middle of mass of a vessel with so much water (kg) in it over its base, m.
fn middle(object: &Object, water: f64) -> f64 {
    let own = 0.5 * object.shape.height();
    let Some(cavity) = object.cavity.filter(|cavity| cavity.capacity > 0.0) else { return own };
    let full = object.shape.height() - cavity.wall;
    let level = (water / WATER_DENSITY / cavity.capacity).clamp(0.0, 1.0) * full;
    let total = (object.mass + water).max(1e-9);
    (object.mass * own + water * (cavity.wall + 0.5 * level)) / total
}

#[cfg(test)]
mod tests {
    use crate::world::{Pose, WorldState};

    use super::*;

    fn line(text: &str, at_s: f64) -> Line {
        let (script, does) = ("own.rhai".into(), String::new());
        Line { script, line: 1, text: text.into(), does, at_s, deed: None }
    }

    /// A step from one second to the next that says this line half a second after it began, and then holds this.
    fn step(number: usize, text: &str, held: Option<&str>) -> StepRecord {
        let measured = WorldState {
            time: number as f64 + 1.0,
            q: vec![0.0; 7],
            opening: 0.05,
            world_from_tool: Pose::upright(0.4, 0.0, 0.3, 0.0),
            held: held.map(str::to_owned),
            objects: Vec::new(),
            spilt: None,
            unknown: Vec::new(),
        };
        StepRecord {
            number,
            path: String::new(),
            action: format!("step_{number}()"),
            call: None,
            outcome: Outcome::Success,
            not_needed: None,
            reason: None,
            failure: None,
            interval_s: [number as f64, number as f64 + 1.0],
            fluents: Vec::new(),
            during: Vec::new(),
            lines: vec![line(text, 0.5)],
            planned_q: Vec::new(),
            hamming: 0,
            score: 1.0,
            measured,
            twin: None,
        }
    }

    #[test]
    fn a_word_is_called_where_it_stands_by_itself() {
        assert!(calls(&line("arm.move_until([0.0, 0.0, -0.1], 4.0 * N);", 0.0), &LEANS));
        assert!(calls(&line("let went = arm.pull (way, 25.0 * N);", 0.0), &LEANS));
        for text in ["let push = choose(twin.pushes(o, at));", "arm.my_push(leg);", "arm.open();"] {
            assert!(!calls(&line(text, 0.0), &LEANS), "{text}");
        }
    }

    /// A drawer was taken for a load that the hand carries, and what its rail resists for an effect.
    #[test]
    fn the_arm_leans_from_the_line_on_and_on_a_rail_as_long_as_it_holds() {
        let spans = |steps: &[StepRecord]| -> Vec<[f64; 2]> {
            contacts(steps).iter().map(|contact| [contact.from, contact.to]).collect()
        };
        let (moves, closes) = ("arm.move_to(a);", "arm.close(d, 9.0);");
        let pushed = [step(0, moves, None), step(1, "arm.push(leg);", None), step(2, moves, None)];
        assert_eq!(spans(&pushed), [[1.5, 2.0]]);
        let carried = [step(0, moves, None), step(1, closes, Some("jar")), step(2, moves, None)];
        assert!(spans(&carried).is_empty());
        let drawn = [
            step(0, moves, None),
            step(1, closes, Some("drawer")),
            step(2, "arm.pull(way, 25.0);", Some("drawer")),
            step(3, "arm.open();", None),
        ];
        assert_eq!(spans(&drawn), [[2.5, 3.0], [1.0, 4.0]]);
    }
}
