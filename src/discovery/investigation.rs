//! What an investigation is asked and what it returns, whatever kind of model it is about.

use super::finding::{Finding, Left};
use super::selection;
use super::why::Why;
use crate::motion::revise::Revision;

/// An investigation: the finding and what a page shows beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Investigation {
    /// The answer.
    pub finding: Finding,
    /// Measured minus model over time, before and after.
    pub traces: Vec<Trace>,
    /// Why each effect is named.
    pub whys: Vec<Why>,
    /// The commands that would settle a doubt, as the text of a recording.
    pub experiment: Option<String>,
    /// The numbers of the robot's file as they were identified, where they were.
    pub revision: Option<Revision>,
}

/// Measured minus model of one channel of one recording, before and after.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// The recording's name.
    pub recording: String,
    /// The channel's name.
    pub channel: String,
    /// Its SI unit.
    pub unit: String,
    /// Its noise, in that unit.
    pub noise: f64,
    /// How exactly each value is expected to be met, in that unit: its noise, and more where the model is not exact.
    /// Values are weighed by it.
    pub sigma: Vec<f64>,
    /// Which values were held out.
    pub held_out: Vec<bool>,
    /// What `time` is in: `s`, or what it counts, such as `poses`.
    pub along: &'static str,
    /// When each value was read.
    pub time: Vec<f64>,
    /// Without the effects, in its unit.
    pub before: Vec<f64>,
    /// With them.
    pub after: Vec<f64>,
    /// Which values of data held out decided nothing; nowhere where they are too few to set some aside.
    pub unseen: Vec<bool>,
    /// The state that what is left then depends on most, if on any.
    pub against: Option<Against>,
}

/// A state that what is left of a channel depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct Against {
    /// Its name.
    pub state: String,
    /// Its SI unit.
    pub unit: String,
    /// The part of what is left, in squares, that some curve over it takes away.
    pub part: f64,
    /// Its values, row by row.
    pub values: Vec<f64>,
}

/// Returns the root mean square over the rows that are judged; the others are 0.
pub(super) fn rms_judged<'a>(values: impl Iterator<Item = &'a f64>) -> f64 {
    let judged = values.filter(|value| value.abs() > 0.0);
    let (sum, rows) = judged.fold((0.0, 0_usize), |(sum, rows), v| (sum + v * v, rows + 1));
    (sum / rows.max(1) as f64).sqrt()
}

/// Says of every channel what is left of it on the data held out, by what is shown of it.
pub(super) fn by_channel(finding: &mut Finding, traces: &[Trace]) {
    for place in &mut finding.places {
        let own = || traces.iter().filter(|trace| trace.channel == place.channel);
        let is_any = own().any(|trace| trace.unseen.contains(&true));
        let told = |trace: &Trace, row: usize| {
            if is_any { trace.unseen[row] } else { trace.held_out[row] }
        };
        let rms = |values: fn(&Trace) -> &[f64]| {
            let of =
                |trace| values(trace).iter().enumerate().filter(move |(row, _)| told(trace, *row));
            rms_judged(own().flat_map(of).map(|(_, value)| value))
        };
        place.heldout = (is_any || own().any(|trace| trace.held_out.contains(&true)))
            .then(|| Left { before: rms(|trace| &trace.before), after: rms(|trace| &trace.after) });
    }
}

/// How to investigate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// The part of a single recording that is held out; of several, the last is.
    pub holdout: f64,
    /// How to search.
    pub search: selection::Options,
}

impl Default for Options {
    fn default() -> Self {
        // A third is enough to judge and leaves most of the motion to fit.
        Self { holdout: 0.33, search: selection::Options::default() }
    }
}
