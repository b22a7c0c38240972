//! A run as an RRD file that Rerun opens: joints, gripper, scale, poses, links, pictures, water, fluents and their
//! margins, steps and events, with one entity for what belongs in one view.
//!
//! Where a number is not known it is NaN, which Rerun draws as a gap. [`ABOUT`] is written into the file: what is where,
//! and in which unit.

use std::collections::BTreeMap;

use nalgebra::Isometry3;
use sha2::{Digest, Sha256};

use crate::rrd::{Component, Items, Recording, STEP_AFTER, Z_UP, path};
use crate::trace::{Event, FluentRow, Measure, StepRecord};
use crate::workcell::links::Links;
use crate::workcell::picture;
use crate::world::WorldState;

use super::rows::{self, Rows};
use super::{Error, Material};

/// Pictures of a chunk, bytes: about a second's worth, so that a reader loads what it shows.
const PICTURES: usize = 1 << 20;
/// Every how many rows of the arm, at 83 to 100 a second, its links are written: 21 to 25 times a second, as a film is shown.
const LINK_STRIDE: usize = 4;
/// How long the axes are that show a pose, m: of a cup's size, and of a link's.
const AXES: f32 = 0.05;

/// What a recording says of itself.
const ABOUT: &str = "\
The time line `arm_time` is the arm's own clock. Lengths are in m, turns are quaternions, the frame is the table's: z up.
Where a line breaks off, the value is unknown.

| entity | what |
|---|---|
| `/joints/position_rad`, `velocity_rad_per_s`, `torque_Nm`, `command_rad` | the joints that turn, base first, as the arm reports them |
| `/joints/position_m`, `velocity_m_per_s`, `force_N`, `command_m` | the joints that slide, where the arm has any |
| `/gripper/opening_m`, `/scale/mass_kg` | between the finger pads; on the scale |
| `/scene/measured/…`, `/scene/twin/…` | tool and things after each step, as measured and in the twin |
| `/scene/arm`, `/scene/arm/…` | the arm as a line from base to tool, and its links |
| `/camera/real`, `/camera/twin` | pictures before and after each step |
| `/film/real`, `/film/twin` | small pictures while the arm moved |
| `/water/twin_mL` | water in the twin's vessels, and spilt |
| `/fluents/expected`, `twin`, `measured` | after each step: 1 true, 0 false |
| `/margins/measured/…`, `/margins/twin/…` | by how much each fluent holds (positive) or fails, by unit |
| `/agreement` | exp(-n) of the n fluents that differ between twin and measurement (Eq. 8) |
| `/steps`, `/events` | what was done; what was said of it, at the time of the step it was said in |
";

/// A time, s, and what was worth what then.
type Timed<T> = Vec<(f64, T)>;

/// Returns an RRD file of the run.
///
/// # Errors
///
/// When `arm.csv` is no table of numbers, or the file cannot be put together.
pub fn rrd(material: &Material<'_>) -> Result<Vec<u8>, Error> {
    let run = material.run;
    let text = serde_json::to_vec(run).map_err(|error| Error::Format(error.to_string()))?;
    let hash = Sha256::new().chain_update(text).chain_update(material.arm).finalize();
    let number = hash.iter().take(16).fold(0_u128, |number, &byte| number << 8 | u128::from(byte));
    let digits = format!("{number:032x}");
    let seed = hash.iter().take(8).fold(0, |seed, &byte| seed << 8 | u64::from(byte));
    let source = concat!("trueup ", env!("CARGO_PKG_VERSION"));
    let mut file = Writer(Recording::new("trueup", &digits, source, seed));
    let name = (Component::RECORDING_NAME, Items::text(run.task.as_str()));
    file.always("/__properties", vec![name])?;
    let about = format!("# {}\n\n{ABOUT}", run.task);
    let about = [(Component::DOCUMENT, about), (Component::DOCUMENT_TYPE, "text/markdown".into())];
    file.always("/about", about.map(|(what, text)| (what, Items::text(text))).into())?;
    file.always("/scene", vec![(Component::VIEW, Items::Axes(vec![Z_UP]))])?;
    if !material.arm.is_empty() {
        let arm = Rows::read(material.arm)?;
        joints(&arm, &mut file)?;
        if let Some(links) = material.links {
            arm_moves(&arm, links, &mut file)?;
        }
    }
    states(material, &mut file)?;
    pictures(material, &mut file)?;
    water(material, &mut file)?;
    fluents(&run.steps, &mut file)?;
    file.log("/steps", steps(&run.steps))?;
    file.log("/events", events(material))?;
    file.0.finish().map_err(|error| Error::Format(error.to_string()))
}

/// The file, by what is put into it.
struct Writer(Recording);

impl Writer {
    fn always(&mut self, entity: &str, columns: Vec<(Component, Items)>) -> Result<(), Error> {
        self.0.always(entity, columns).map_err(|error| Error::Format(error.to_string()))
    }

    fn add(
        &mut self,
        entity: &str,
        times: &[i64],
        columns: Vec<(Component, Items)>,
    ) -> Result<(), Error> {
        self.0.add(entity, times, columns).map_err(|error| Error::Format(error.to_string()))
    }

    /// Lines of one view, as many as names.
    fn lines(
        &mut self,
        entity: &str,
        names: &[String],
        rows: Timed<Vec<f64>>,
        more: Option<(Component, Items)>,
    ) -> Result<(), Error> {
        if rows.is_empty() || names.is_empty() {
            return Ok(());
        }
        let named = (Component::LINE_NAMES, Items::Texts(names.to_vec()));
        self.always(entity, [named].into_iter().chain(more).collect())?;
        let (times, rows) = in_order(rows);
        self.add(entity, &times, vec![(Component::SCALARS, Items::Numbers(rows.concat()))])
    }

    /// Lines that keep their value until the next point.
    fn steps(
        &mut self,
        entity: &str,
        names: &[String],
        rows: Timed<Vec<f64>>,
    ) -> Result<(), Error> {
        let modes = (Component::LINE_MODES, Items::Codes(vec![STEP_AFTER; names.len()]));
        self.lines(entity, names, rows, Some(modes))
    }

    /// A thing that moves, with its name beside it or not.
    fn moves(
        &mut self,
        entity: &str,
        poses: Timed<Isometry3<f64>>,
        is_named: bool,
    ) -> Result<(), Error> {
        if poses.is_empty() {
            return Ok(());
        }
        let axes = (Component::AXIS_LENGTH, Items::Lengths(vec![AXES]));
        let name = (Component::SHOW_FRAME, Items::Flags(vec![is_named]));
        self.always(entity, vec![axes, name])?;
        let (times, poses) = in_order(poses);
        let at = poses.iter().map(|pose| single(pose.translation.vector.into())).collect();
        let turned = poses.iter().map(|pose| single(pose.rotation.coords.into())).collect();
        let at = (Component::TRANSLATION, Items::Points(at));
        self.add(entity, &times, vec![at, (Component::QUATERNION, Items::Turns(turned))])
    }

    /// Pictures, JPEG or PNG.
    fn pictures(&mut self, entity: &str, pictures: Timed<Vec<u8>>) -> Result<(), Error> {
        let (times, pictures) = in_order(pictures);
        let mut gathered = (Vec::new(), Vec::new(), Vec::new());
        let mut size = 0;
        let n_pictures = pictures.len();
        for (n, (time, picture)) in times.into_iter().zip(pictures).enumerate() {
            let is_png = picture.starts_with(b"\x89PNG");
            let kind = if is_png { "image/png" } else { "image/jpeg" };
            size += picture.len();
            gathered.0.push(time);
            gathered.1.push(picture);
            gathered.2.push(kind.to_owned());
            if size < PICTURES && n + 1 < n_pictures {
                continue;
            }
            let (times, files, kinds) = std::mem::take(&mut gathered);
            size = 0;
            let files = (Component::IMAGE, Items::Files(files));
            self.add(entity, &times, vec![files, (Component::IMAGE_TYPE, Items::Texts(kinds))])?;
        }
        Ok(())
    }

    /// Lines of a log, each with how much it matters.
    fn log(&mut self, entity: &str, lines: Timed<(&str, String)>) -> Result<(), Error> {
        let (times, lines) = in_order(lines);
        let (levels, texts) =
            lines.into_iter().map(|(level, text)| (level.to_owned(), text)).unzip();
        let levels = (Component::LOG_LEVEL, Items::Texts(levels));
        self.add(entity, &times, vec![(Component::LOG, Items::Texts(texts)), levels])
    }
}

fn nanoseconds(time: f64) -> i64 {
    (time * 1e9).round() as i64
}

fn single<const N: usize>(numbers: [f64; N]) -> [f32; N] {
    numbers.map(|number| number as f32)
}

/// Returns times in ns and what was then, earliest first.
fn in_order<T>(mut timed: Timed<T>) -> (Vec<i64>, Vec<T>) {
    timed.sort_by(|a, b| a.0.total_cmp(&b.0));
    timed.into_iter().map(|(time, what)| (nanoseconds(time), what)).unzip()
}

/// The arm's recording.
fn joints(arm: &Rows, file: &mut Writer) -> Result<(), Error> {
    let groups = [
        ("q", "/joints/position_rad", ("m", "/joints/position_m")),
        ("dq", "/joints/velocity_rad_per_s", ("m/s", "/joints/velocity_m_per_s")),
        ("tau", "/joints/torque_Nm", ("N", "/joints/force_N")),
        ("q_cmd", "/joints/command_rad", ("m", "/joints/command_m")),
    ];
    for (stem, turning, (unit, sliding)) in groups {
        let all = arm.group(stem).into_iter().zip(1_usize..);
        let (slide, turn): (Vec<_>, Vec<_>) = all.partition(|(place, _)| arm.is_in(*place, unit));
        for (entity, joints) in [(turning, turn), (sliding, slide)] {
            let (places, numbers): (Vec<usize>, Vec<usize>) = joints.into_iter().unzip();
            let names: Vec<String> = numbers.iter().map(|n| format!("joint_{n}")).collect();
            let rows = arm.rows.iter().map(|row| (rows::time(row), rows::values(row, &places)));
            file.lines(entity, &names, rows.collect(), None)?;
        }
    }
    for (column, entity) in [("gripper", "/gripper/opening_m"), ("mass", "/scale/mass_kg")] {
        let Some(place) = arm.column(column) else { continue };
        let rows = arm.rows.iter().map(|row| (rows::time(row), rows::values(row, &[place])));
        file.lines(entity, &[column.to_owned()], rows.collect(), None)?;
    }
    Ok(())
}

/// The links while the arm moved.
fn arm_moves(arm: &Rows, links: &Links, file: &mut Writer) -> Result<(), Error> {
    let (places, opening) = (arm.group("q"), arm.column("gripper"));
    let rows = arm.rows.iter().step_by(LINK_STRIDE).filter_map(|row| {
        let opening = opening.and_then(|place| row.get(place)).copied().unwrap_or_default();
        Some((rows::time(row), links.at(&rows::values(row, &places), opening)?))
    });
    let rows: Timed<Vec<Isometry3<f64>>> = rows.collect();
    for (n, name) in links.names().into_iter().enumerate() {
        let poses = rows.iter().map(|(time, poses)| (*time, poses[n])).collect();
        // A dozen names on top of each other tell nothing.
        file.moves(&path(&["scene", "arm", name]), poses, false)?;
    }
    let chain = links.chain();
    let strip = |poses: &[Isometry3<f64>]| {
        chain.iter().map(|&link| single(poses[link].translation.vector.into())).collect()
    };
    let strips = rows.iter().map(|(time, poses)| (*time, strip(poses))).collect();
    let (times, strips) = in_order(strips);
    file.add("/scene/arm", &times, vec![(Component::STRIPS, Items::Strips(strips))])
}

/// Where tool and things were at the start and after each step.
fn states(material: &Material<'_>, file: &mut Writer) -> Result<(), Error> {
    let steps = &material.run.steps;
    let measured = material.run.start.iter().chain(steps.iter().map(|step| &step.measured));
    let twin = steps.iter().filter_map(|step| step.twin.as_ref());
    poses("measured", measured, file)?;
    poses("twin", twin, file)
}

fn poses<'a>(
    whose: &str,
    states: impl Iterator<Item = &'a WorldState>,
    file: &mut Writer,
) -> Result<(), Error> {
    let mut things: BTreeMap<&str, Timed<Isometry3<f64>>> = BTreeMap::new();
    for state in states {
        let mut at = |name, pose| things.entry(name).or_default().push((state.time, pose));
        at("tool", *state.world_from_tool.isometry());
        for object in &state.objects {
            if let Some(pose) = &object.world_from_object {
                at(&object.name, *pose.isometry());
            }
        }
    }
    for (name, poses) in things {
        file.moves(&path(&["scene", whose, name]), poses, true)?;
    }
    Ok(())
}

/// What camera and twin showed, before and after steps and while the arm moved.
fn pictures(material: &Material<'_>, file: &mut Writer) -> Result<(), Error> {
    for whose in ["real", "twin"] {
        let mut seen = Vec::new();
        for (n, step) in material.run.steps.iter().enumerate() {
            let [begin, end] = step.interval_s;
            // What is seen before a later step is what was seen after the one before.
            let before = (n == 0).then(|| (begin, picture::before(step.number, whose)));
            let after = (end, picture::after(step.number, whose));
            for (time, name) in before.into_iter().chain([after]) {
                seen.extend((material.picture)(&name).map(|data| (time, data)));
            }
        }
        file.pictures(&path(&["camera", whose]), seen)?;
        let stills = material
            .film
            .moments
            .iter()
            .filter_map(|moment| Some((moment.time, (material.still)(moment.number, whose)?)));
        file.pictures(&path(&["film", whose]), stills.collect())?;
    }
    Ok(())
}

/// The water in the twin while the arm moved.
fn water(material: &Material<'_>, file: &mut Writer) -> Result<(), Error> {
    let moments = &material.film.moments;
    let rows = moments.iter().map(|moment| (moment.time, moment.water_ml.clone())).collect();
    file.lines("/water/twin_mL", &material.film.vessels, rows, None)
}

/// What was true after each step, and by how much.
fn fluents(steps: &[StepRecord], file: &mut Writer) -> Result<(), Error> {
    let all = || steps.iter().flat_map(|step| &step.fluents);
    let mut names: Vec<String> = Vec::new();
    let mut by_unit: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    let note = |names: &mut Vec<String>, row: &FluentRow| {
        if !names.contains(&row.name) {
            names.push(row.name.clone());
        }
    };
    for row in all() {
        note(&mut names, row);
        for margin in [&row.margin, &row.twin_margin].into_iter().flatten() {
            note(by_unit.entry(&margin.unit).or_default(), row);
        }
    }
    let truth = |truth: Option<bool>| truth.map_or(f64::NAN, |truth| f64::from(u8::from(truth)));
    for whose in ["expected", "twin", "measured"] {
        let of = |row: &FluentRow| match whose {
            "expected" => row.expected,
            "twin" => row.twin,
            _ => row.measured,
        };
        let rows = after_steps(steps, &names, |row| truth(of(row)));
        file.steps(&path(&["fluents", whose]), &names, rows)?;
    }
    for (unit, names) in &by_unit {
        let value = |margin: &Option<Measure>| {
            margin.as_ref().filter(|margin| margin.unit == *unit).map_or(f64::NAN, |m| m.value)
        };
        let rows = after_steps(steps, names, |row| value(&row.margin));
        file.steps(&path(&["margins", "measured", unit]), names, rows)?;
        let rows = after_steps(steps, names, |row| value(&row.twin_margin));
        file.steps(&path(&["margins", "twin", unit]), names, rows)?;
    }
    let rows = steps.iter().map(|step| (step.interval_s[1], vec![step.score])).collect();
    file.steps("/agreement", &["agreement".to_owned()], rows)
}

/// What the fluents of those names were worth after each step, NaN for those that were not judged.
fn after_steps(
    steps: &[StepRecord],
    names: &[String],
    of: impl Fn(&FluentRow) -> f64,
) -> Timed<Vec<f64>> {
    let worth = |step: &StepRecord, name: &String| {
        step.fluents.iter().find(|row| row.name == *name).map_or(f64::NAN, &of)
    };
    let rows = steps
        .iter()
        .map(|step| (step.interval_s[1], names.iter().map(|name| worth(step, name)).collect()));
    rows.collect()
}

/// The beginnings and ends of the steps, in words.
fn steps(steps: &[StepRecord]) -> Timed<(&'static str, String)> {
    let lines = steps.iter().flat_map(|step| {
        let (number, [begin, end]) = (step.number, step.interval_s);
        let ended = match &step.reason {
            None => ("INFO", format!("step {number} done: {}", step.action)),
            Some(reason) => ("WARN", format!("step {number} failed: {}: {reason}", step.action)),
        };
        [(begin, ("INFO", format!("step {number}: {}", step.action))), (end, ended)]
    });
    lines.collect()
}

/// What was said: an event has no time of its own, but it comes after the beginning or the end of a step.
fn events(material: &Material<'_>) -> Timed<(&'static str, String)> {
    let run = material.run;
    let mut now = run.start.as_ref().map_or(0.0, |state| state.time);
    let mut lines = Vec::new();
    for event in material.events.lines().filter_map(|line| serde_json::from_str(line).ok()) {
        match event {
            Event::Phase { name, detail } => {
                lines.push((now, ("INFO", format!("{name}: {detail}"))));
            }
            Event::Note { text, is_detail } => {
                lines.push((now, (if is_detail { "DEBUG" } else { "INFO" }, text)));
            }
            Event::StepStart { number, .. } => {
                let step = run.steps.iter().find(|step| step.number == number);
                now = step.map_or(now, |step| step.interval_s[0]);
            }
            Event::StepEnd { record } => now = record.interval_s[1],
            _ => {}
        }
    }
    lines
}
