//! A run in words: what happens as it happens, and how it ended.

use std::fmt::Write as _;
use std::io;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::arm::Pacing;
use crate::trace::{DuringRow, Event, FluentRow, Measure, Observer, Outcome, StepRecord};
use crate::units::Unit;
use crate::workcell::{Displaced, Ending, Run, State, TILTED, Water};

use super::{Style, complain, exit::stands, folded, shown as plainly};

/// Amounts of water differ that are farther apart than this, mL, and than this share of all of it. Chosen: vessels are filled to a few per
/// cent, and some drops stay in them.
const LEAST_ML: f64 = 5.0;
const SHARE: f64 = 0.1;

/// The bar on the terminal, if there is one, and whether more may come: the prompt takes it away when it
/// comes back before the work has wound down.
static BAR: Mutex<(Option<ProgressBar>, bool)> = Mutex::new((None, false));

/// Takes the bar off the terminal; none is drawn until another run begins.
pub fn hush() {
    let mut shown = BAR.lock().unwrap_or_else(PoisonError::into_inner);
    shown.1 = true;
    if let Some(bar) = shown.0.take() {
        bar.finish_and_clear();
    }
}

/// Takes the bar off the terminal until the next part of the work begins.
pub fn rest() {
    let mut shown = BAR.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(bar) = shown.0.take() {
        bar.finish_and_clear();
    }
}

/// Tells a run on the terminal: steps and tables on stdout, progress on stderr.
pub struct Console {
    style: Style,
    bar: Option<ProgressBar>,
    before: Vec<FluentRow>,
    told: Vec<String>,
    tells_steps: bool,
}

impl Console {
    /// Speaks in this style.
    pub fn new(style: Style) -> Self {
        BAR.lock().unwrap_or_else(PoisonError::into_inner).1 = false;
        Self { style, bar: None, before: Vec::new(), told: Vec::new(), tells_steps: true }
    }

    /// Leaves the steps to someone else: no word of what they are and came to, only of what goes on.
    #[must_use]
    pub fn without_steps(mut self) -> Self {
        self.tells_steps = false;
        self
    }

    fn clear(&mut self) {
        BAR.lock().unwrap_or_else(PoisonError::into_inner).0 = None;
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }

    fn spin(&mut self, message: &str) {
        self.clear();
        if self.style.quiet {
            return;
        }
        if !self.style.bars {
            complain(message);
            return;
        }
        let mut shown = BAR.lock().unwrap_or_else(PoisonError::into_inner);
        if shown.1 {
            return;
        }
        let look = ProgressStyle::with_template("{spinner} {msg} {elapsed}");
        let bar = ProgressBar::new_spinner()
            .with_style(look.unwrap_or_else(|_| ProgressStyle::default_spinner()));
        bar.set_message(plainly(message));
        bar.enable_steady_tick(Duration::from_millis(120));
        shown.0 = Some(bar.clone());
        self.bar = Some(bar);
    }
}

impl Observer for Console {
    fn event(&mut self, event: &Event) {
        match event {
            Event::Phase { name, detail } => self.spin(&format!("{name}: {detail}")),
            // What a second look finds again is not told again.
            Event::Note { text, is_detail }
                if !self.style.verbose && (*is_detail || self.told.contains(text)) => {}
            Event::Note { text, .. } => {
                self.told.push(text.clone());
                if !self.style.quiet && !self.style.json {
                    match &self.bar {
                        Some(bar) => {
                            let line = format!("  {}", plainly(text));
                            bar.println(folded::fitted(&line, folded::columns(&io::stderr())));
                        }
                        None => complain(&format!("  {text}")),
                    }
                }
            }
            Event::Progress { what, fraction } => {
                if let Some(bar) = &self.bar {
                    bar.set_message(format!("{} {:.0} %", plainly(what), fraction * 100.0));
                }
            }
            Event::StepStart { number, of, action, .. } => {
                // In lines, a step is told of when it is over, or by someone else.
                if self.style.bars || (self.tells_steps && self.style.verbose) {
                    self.spin(&format!("step {number} of {of}: {action}"));
                }
            }
            Event::StepEnd { record } => {
                self.clear();
                if self.tells_steps && !self.style.quiet {
                    let told = if self.style.verbose {
                        step(record, &self.before, 0, self.style)
                    } else {
                        line(record, self.style)
                    };
                    self.style.say(told.trim_end());
                }
                self.before.clone_from(&record.fluents);
            }
            Event::Tick(_) | Event::Picture { .. } | Event::Still(_) | Event::Tryout(_) => {}
        }
    }
}

impl Drop for Console {
    fn drop(&mut self) {
        self.clear();
    }
}

/// What stands in a step's line instead of how it was compared, where it was not needed.
pub(super) fn not_needed(record: &StepRecord) -> Option<String> {
    let held = record.not_needed.as_ref().filter(|_| record.outcome == Outcome::Success)?;
    Some(format!("not needed: {held} was true before"))
}

/// How many fluents simulation and camera both know after a step, and of how many they say the same.
fn compared(record: &StepRecord) -> (usize, usize) {
    counted(record, 0)
}

/// As [`compared`], of a record in which so many of those that both know are left out.
fn counted(record: &StepRecord, withheld: usize) -> (usize, usize) {
    let known = record.fluents.iter().filter(|row| row.twin.is_some() && row.measured.is_some());
    let known = known.count() + withheld;
    (known - record.hamming.min(known), known)
}

/// Words how well simulation and measurement agree after a step.
pub(super) fn agreement(record: &StepRecord) -> String {
    agree(compared(record), "")
}

/// Words of how many fluents both say the same: all of `same` and `known`, or by how many they differ.
fn agree((same, known): (usize, usize), of_what: &str) -> String {
    if same == known {
        format!("simulation and camera agree ({same} of {known}{of_what})")
    } else {
        format!("simulation and camera disagree on {} of {known}{of_what}", known - same)
    }
}

/// Words a step on one line; below it only why it failed, and what contradicts what was promised or simulated.
fn line(record: &StepRecord, style: Style) -> String {
    if let Some(told) = not_needed(record) {
        return head(record, &told, style);
    }
    let (same, known) = compared(record);
    let told = if same < known { format!("agree on {same} of {known}") } else { String::new() };
    let mut text = head(record, &told, style);
    text += &below(record, style);
    text += &table(record.fluents.iter().filter(|row| contradicts(row)), style);
    text
}

/// Words one step: its line, and those of its fluents that are news after the fluents `before` it; Eq. 8 of the
/// paper where a person wants all numbers. `run.json` keeps them all. Of the fluents that both know, `withheld` are not in
/// the record, for a person is to be asked about them; they count all the same.
pub fn step(record: &StepRecord, before: &[FluentRow], withheld: usize, style: Style) -> String {
    if let (Some(told), false) = (not_needed(record), before.is_empty()) {
        return head(record, &told, style);
    }
    let (same, known) = counted(record, withheld);
    let mut told = format!("agree on {same} of {known}");
    if style.verbose {
        let _ = write!(told, " (P {:.2})", record.score);
    }
    told = not_needed(record).unwrap_or(told);
    let mut text = head(record, &told, style);
    text += &below(record, style);
    text += &table(record.fluents.iter().filter(|row| is_news(row, before)), style);
    text
}

fn head(record: &StepRecord, told: &str, style: Style) -> String {
    let mark = match record.outcome {
        Outcome::Success if !record.was_carried_out() => "–".to_owned(),
        Outcome::Success => style.green("✓"),
        Outcome::Failure => style.red("✗"),
        Outcome::Stopped => style.red("◦"),
    };
    let seconds = record.interval_s[1] - record.interval_s[0];
    let text =
        format!("{mark} {:>2}  {:<40} {seconds:>5.1} s  {told}", record.number, record.action);
    format!("{}\n", text.trim_end())
}

fn below(record: &StepRecord, style: Style) -> String {
    let mut text = String::new();
    if let Some(reason) = &record.reason {
        let _ = writeln!(text, "       {}", style.red(reason));
    }
    for line in record.during.iter().filter(|row| row.ends).filter_map(during) {
        let _ = writeln!(text, "       {line}");
    }
    text
}

fn table<'a>(rows: impl Iterator<Item = &'a FluentRow>, style: Style) -> String {
    let rows: String = rows.map(|row| fluent(row, style)).collect();
    if rows.is_empty() {
        return rows;
    }
    let head =
        format!("    {:<40} {:<8} {:<4} {:<8} margin", "fluent", "expected", "twin", "measured");
    format!("{}\n{rows}", style.dim(&head))
}

/// Whether measurement contradicts the simulation or the promise, or the simulation the promise.
fn contradicts(row: &FluentRow) -> bool {
    let differ = |a, b| matches!((a, b), (Some(a), Some(b)) if a != b);
    differ(row.twin, row.measured)
        || differ(row.expected, row.measured)
        || differ(row.expected, row.twin)
}

/// A fluent is news when the step should have made it true, when it changed, when twin and measurement
/// differ, and when people are asked about it.
pub(super) fn is_news(row: &FluentRow, before: &[FluentRow]) -> bool {
    let earlier = before.iter().find(|earlier| earlier.name == row.name);
    let changed = earlier.is_some_and(|e| e.twin != row.twin || e.measured != row.measured);
    let differs = matches!((row.twin, row.measured), (Some(a), Some(b)) if a != b);
    row.expected.is_some() || changed || differs || row.ask.is_some()
}

fn fluent(row: &FluentRow, style: Style) -> String {
    let word = |truth: Option<bool>| match truth {
        Some(true) => "yes",
        Some(false) => "no",
        None => "?",
    };
    let margin = row.margin.as_ref().map(people).unwrap_or_default();
    let expected = row.expected.map_or("", |truth| word(Some(truth)));
    let line = format!(
        "    {:<40} {expected:<8} {:<4} {:<8} {margin}",
        row.name,
        word(row.twin),
        word(row.measured),
    );
    format!(
        "{}\n",
        if contradicts(row) { style.red(line.trim_end()) } else { line.trim_end().to_owned() }
    )
}

/// Words how a condition fared while a step ran; `None` when nobody could tell.
pub fn during(row: &DuringRow) -> Option<String> {
    let DuringRow { name, ends, measured, twin } = row;
    if *ends {
        return Some(match (measured.became_true_s, twin.as_ref().and_then(|t| t.became_true_s)) {
            (Some(at), _) if measured.by_rehearsal => format!(
                "until {name}: {at:.2} s into the step, as simulated; it could not be measured"
            ),
            (Some(at), Some(twin)) => {
                format!("until {name}: true {at:.2} s into the step; in the twin after {twin:.2} s")
            }
            (Some(at), None) => format!("until {name}: true {at:.2} s into the step"),
            (None, _) => format!("until {name}: it did not become true while the step ran"),
        });
    }
    let (least, at) = (measured.least.as_ref()?, measured.least_at_s?);
    let twin = twin.as_ref().and_then(|twin| twin.least.as_ref());
    let twin = twin.map(|twin| format!("; in the twin {}", people(twin))).unwrap_or_default();
    Some(format!(
        "{name} throughout: smallest margin {}, {at:.2} s into the step{twin}",
        people(least)
    ))
}

/// Returns a measure in the unit people use, with its sign.
pub fn people(measure: &Measure) -> String {
    match Unit::parse(&measure.unit) {
        Ok(unit) => unit.of(measure.value).signed(),
        Err(_) => format!("{:+.3} {}", measure.value, measure.unit),
    }
}

/// Names the scales of a robot: the laboratory's are its own, a real arm's stand beside it.
pub(super) fn scales_of(robot: &str) -> String {
    if robot.contains("://") {
        format!("the scales beside {robot}")
    } else {
        format!("the {robot}'s scales")
    }
}

/// Words where the water is: every vessel by its name, and what is in none.
fn volumes(water: &Water) -> String {
    let older =
        [("target".to_owned(), water.in_target_ml), ("source".to_owned(), water.in_source_ml)];
    let vessels = if water.vessels_ml.is_empty() { &older[..] } else { &water.vessels_ml };
    let mut told: Vec<String> =
        vessels.iter().map(|(name, volume)| format!("{name} {volume:.1} mL")).collect();
    told.push(format!("spilt {:.1} mL", water.spilt_ml));
    told.join(", ")
}

/// Words how evenly positions were streamed to an arm.
pub fn pacing(told: &Pacing) -> String {
    let mut text = format!(
        "streamed {} positions at {:.0} Hz: {:.2} ms apart at the median, {:.2} ms at p99, {:.1} ms at worst; \
         {} periods missed, {} of the positions answered",
        told.sent,
        told.rate_hz,
        told.median_s * 1e3,
        told.p99_s * 1e3,
        told.worst_s * 1e3,
        told.missed,
        told.answered
    );
    if told.left > 0 {
        let _ = write!(text, "; the arm left the stream {} times and was asked back", told.left);
    }
    text
}

/// Returns the vessel that a run which was stopped or failed has left tilted in the hand.
fn left_tilted(run: &Run) -> Option<&str> {
    if !matches!(run.outcome, Ending::Stopped | Ending::Failure | Ending::Unavailable) {
        return None;
    }
    let world = &run.steps.last()?.measured;
    let held = world.held.as_deref()?;
    let known = world.object(held)?;
    let held_water = run.start.as_ref()?.object(held)?.water.is_some();
    (held_water && known.world_from_object?.tilt() > TILTED).then_some(held)
}

/// Words that a thing stands elsewhere, though nothing was to move it.
fn displaced(thing: &Displaced) -> String {
    format!(
        "`{}` stands {:.0} mm (± {:.1} mm) from where it was seen before the run, and no step took or pushed it",
        thing.object,
        thing.by_m * 1e3,
        thing.std_m * 1e3
    )
}

/// Says what a run that was stopped left in the hand, and what puts it down.
pub(super) fn left_in_hand(run: &Run) -> Option<String> {
    let world = run.steps.last().map(|step| &step.measured).or(run.start.as_ref())?;
    let held = world.held.as_deref().filter(|_| run.outcome == Ending::Stopped)?;
    Some(match left_tilted(run) {
        // What is to be done with it is told as well.
        Some(_) => format!("`{held}` is in the hand"),
        None => format!("`{held}` is in the hand; `place({held})` puts it down"),
    })
}

/// Words how well simulation and reality agree over a run: of the fluents after each step, and of amounts of water at its end where
/// these differ.
fn agreed(run: &Run) -> Option<String> {
    let all = run.carried_out().map(compared);
    let (same, known) = all.fold((0, 0), |all, step| (all.0 + step.0, all.1 + step.1));
    let n_steps = run.carried_out().count();
    let s = if n_steps == 1 { "" } else { "s" };
    let after = format!("fluents after {n_steps} step{s}");
    match (known > 0, amounts(run)) {
        (true, None) => Some(agree((same, known), &format!(" {after}"))),
        (true, Some(amounts)) => Some(format!(
            "simulation and scales disagree: {amounts} (simulation and camera agree on {same} of {known} {after})"
        )),
        (false, Some(amounts)) => Some(format!("simulation and scales disagree: {amounts}")),
        (false, None) => None,
    }
}

/// Words the amounts of water that the scales found other than the simulation left them after the last step, if there are any. One that
/// a person stopped was not to come to what was simulated.
fn amounts(run: &Run) -> Option<String> {
    let (water, last) = (run.water.as_ref()?, run.steps.last()?);
    let twin = last.twin.as_ref().filter(|_| last.outcome != Outcome::Stopped)?;
    let all = twin.objects.iter().filter_map(|object| object.water).sum::<f64>()
        + twin.spilt.unwrap_or(0.0);
    let enough = LEAST_ML.max(SHARE * all * 1e6);
    let vessels = water.vessels_ml.iter().filter_map(|(name, said)| {
        Some((format!("in {name}"), twin.object(name)?.water? * 1e6, *said))
    });
    let spilt = twin.spilt.map(|spilt| ("spilt".to_owned(), spilt * 1e6, water.spilt_ml));
    let told: Vec<String> = spilt
        .into_iter()
        .chain(vessels)
        .filter(|(_, simulated, said)| (simulated - said).abs() > enough)
        .map(|(what, simulated, said)| {
            format!("simulated {simulated:.1} mL {what}, on the scales {said:.1} mL")
        })
        .collect();
    (!told.is_empty()).then(|| told.join("; "))
}

/// Words how a run ended.
pub fn ending(run: &Run, style: Style) -> String {
    let mut text = match run.outcome {
        _ if run.state == State::Running => {
            style.red(&format!("not over: {}; {} steps are kept so far", run.task, run.steps.len()))
        }
        Ending::Success => style.green(&format!("done: {}", run.task)),
        Ending::Unconfirmed => style.red(&format!("unconfirmed: {}", run.task)),
        Ending::Failure => style.red(&format!("failed: {}", run.task)),
        Ending::Unavailable => style.red(&format!("not available: {}", run.task)),
        Ending::Stopped => style.red(&format!("stopped: {}; {}", run.task, stands(run))),
    };
    if run.outcome == Ending::Success && run.state == State::Ended && run.steps.is_empty() {
        text += "\n  there was nothing to do: no step was needed";
    }
    if let Some(reason) = &run.reason {
        let _ = write!(text, "\n  {reason}");
    }
    if let Some(help) = &run.device_help {
        let _ = write!(text, "\n  help: {help}");
    }
    if let Some(held) = left_in_hand(run) {
        let _ = write!(text, "\n  {held}");
    }
    if let Some(tilted) = left_tilted(run) {
        let _ = write!(
            text,
            "\n  `{tilted}` is left tilted and may still run; `untilt({tilted})` brings it upright and weighs it"
        );
    }
    for thing in &run.displaced {
        let _ = write!(text, "\n  {}", displaced(thing));
    }
    if let Some(water) = &run.water {
        let _ = write!(text, "\n  water on {}: {}", scales_of(&water.measured_by), volumes(water));
    }
    if let Some(matching) = &run.matching {
        let _ = write!(text, "\n  {}", super::paper::matching(matching));
    }
    if let Some(told) = agreed(run) {
        let _ = write!(text, "\n  {told}");
    }
    match run.steps.iter().filter(|step| not_needed(step).is_some()).count() {
        0 => {}
        1 => text += "\n  1 step was not needed",
        spared => {
            let _ = write!(text, "\n  {spared} steps were not needed");
        }
    }
    let t = &run.timing_s;
    if run.state == State::Ended {
        let _ = write!(
            text,
            "\n  wall time {:.1} s: {:.1} perceiving, {:.1} planning, {:.1} simulating, {:.1} executing",
            t.total, t.perceive, t.plan, t.simulate, t.execute
        );
        // Of a record that does not say nothing is told.
        if t.pictures > 0.0 {
            let _ = write!(text, ", {:.1} drawing pictures", t.pictures);
        }
        if t.waiting >= 0.05 {
            let _ = write!(text, ", {:.1} s waiting for you", t.waiting);
        }
    }
    if let Some(stream) = &run.stream {
        let _ = write!(text, "\n  {}", pacing(stream));
    }
    if let Some(dir) = &run.run_dir {
        let _ = write!(text, "\n  run folder: {dir}");
    }
    text
}
