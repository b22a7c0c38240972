//! When things were done: the intervals of a run, the time its tasks have taken, and the relations between
//! them that the text asks for.
//!
//! Relations are checked from measured intervals as soon as both sides are over, and nothing is assumed:
//! a relation that does not hold fails the step that completes it, with the times.
//!
//! Source: Allen, "Maintaining knowledge about temporal intervals", CACM 26, 1983.

use std::collections::BTreeMap;

use crate::graph::parse_graph::Timing;
use crate::graph::{Interval, ParseGraph, is_at_or_below, time_error};
use crate::language::text;

use crate::trace::Mistimed;

use super::done::Done;
use super::during::Deadline;
use super::paces::Paces;
use super::worked::Worked;

/// Two times closer than this are the same, s: a little more than the period at which a step's end is
/// noticed.
pub const SAME: f64 = 0.05;

/// What a run remembers of its steps' times, and of steps that were done beside another.
#[derive(Debug, Clone, Default)]
pub struct Past {
    /// When each task that has a limit began, by path, s of arm time.
    begun: BTreeMap<String, f64>,
    /// How fast the arm was held to move.
    pub(super) paces: Paces,
    /// When each step was done, by path.
    intervals: BTreeMap<String, Interval>,
    /// Steps that are over before their turn to be told, by index.
    pub(super) ahead: BTreeMap<usize, Done>,
    /// What was done to things with a tool.
    pub(super) worked: Worked,
    /// What the fingers closed on last, and where it stood then, x and y, m.
    pub(super) taken: Option<(String, [f64; 2])>,
}

impl Past {
    /// Returns the limits in force for a step that begins at arm time `now` (s), and starts the clocks of
    /// the tasks that begin with it. A task that is tried again goes on with the time it had. From now on the
    /// arm is held to `pace` of its full speed, and has so much longer.
    pub fn deadlines(
        &mut self,
        pg: &ParseGraph,
        index: usize,
        now: f64,
        pace: f64,
    ) -> Vec<Deadline> {
        self.paces.turn(now, pace);
        let step = &pg.steps[index];
        let around = step.limits.iter().map(|limit| {
            let since = *self.begun.entry(limit.owner.clone()).or_insert(now);
            Deadline { of: limit.text.clone(), seconds: limit.seconds, since }
        });
        let mut all: Vec<_> = around.collect();
        let own = |seconds| Deadline { of: step.text.clone(), seconds, since: now };
        all.extend(step.limit.map(own));
        all
    }

    /// Takes note of when a step was done.
    pub fn done(&mut self, path: &str, interval: Interval) {
        self.intervals.insert(path.to_owned(), interval);
    }

    /// Returns the interval that covers the steps at or below a path, `None` before all of them were done.
    fn of(&self, pg: &ParseGraph, path: &str) -> Option<Interval> {
        let mut whole: Option<Interval> = None;
        for index in pg.steps_of(path) {
            let own = *self.intervals.get(&pg.steps[index].path)?;
            whole = Some(whole.map_or(own, |whole| whole.hull(own)));
        }
        whole
    }

    /// Returns the first relation that step `index` completes and that does not hold.
    pub fn broken(&self, pg: &ParseGraph, index: usize) -> Option<Mistimed> {
        declared(pg).find_map(|timing| {
            let of = |path: &str| pg.steps_of(path).last();
            if of(&timing.a).max(of(&timing.b)) != Some(index) {
                return None;
            }
            let (a, b) = (self.of(pg, &timing.a)?, self.of(pg, &timing.b)?);
            let error = time_error(a, timing.relation, b, timing.by);
            (error > SAME).then(|| mistimed(timing, a, b, error))
        })
    }
}

/// Returns the relations that a `timing` asks for; those of steps in a row hold by the way they are done.
pub fn declared(pg: &ParseGraph) -> impl Iterator<Item = &Timing> {
    pg.timings.iter().filter(|timing| {
        let above = timing.a.rsplit_once('/').map(|(above, _)| above);
        pg.steps.iter().any(|step| {
            let around = step.together.as_deref();
            around.is_some() && around == above && is_at_or_below(&step.path, &timing.a)
        })
    })
}

fn label(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

fn mistimed(timing: &Timing, a: Interval, b: Interval, error: f64) -> Mistimed {
    let origin = a.from.min(b.from);
    Mistimed {
        sides: [&timing.a, &timing.b].map(|path| label(path).to_owned()),
        relation: text::allen(timing.relation).to_owned(),
        by_s: timing.by,
        error_s: error,
        went_s: [a, b].map(|went| [went.from - origin, went.to - origin]),
    }
}
