//! Steps that go on at the same time: `together { … }`.
//!
//! An arm moves along one path at a time, so of the strands of a `together` one at most may need it; the
//! others work with the fingers or the camera, or with nothing. What they want is found out first by running
//! their scripts without doing anything, and is then done beside the strand that moves the arm, from the
//! times on that the `timing`s ask for. `before` and `meets` put a strand wholly before or after another.
//! What cannot be had is not improvised: the intervals are measured, and [`super::timing`] judges them.

use std::collections::BTreeMap;

use crate::graph::parse_graph::Timing;
use crate::graph::{Condition, Interval, ParseGraph, Step};
use crate::language::ast::{Allen, Expr};
use crate::trace::{Cause, Line, Outcome, StepFailure};

use super::beside::{Openings, Order};
use super::done::Done;
use super::during::Deadline;
use super::error::ActionError;
use super::script::ScriptError;
use super::uses::Uses;
use super::walk::{End, Walker, promised};

/// The steps of one `together`.
pub(super) struct Group {
    /// Its path.
    path: String,
    /// Its steps, in a row.
    steps: Vec<usize>,
}

/// Steps that follow one another inside a `together`.
struct Strand {
    path: String,
    steps: Vec<usize>,
    uses: Uses,
    when: When,
}

/// When a strand is done, seen from the one that moves the arm.
#[derive(Clone, Copy, PartialEq)]
enum When {
    /// At the same time, beginning so much later, s; less than nothing: so much sooner.
    Beside(f64),
    /// Before it, with a pause of so long after, s.
    First(f64),
    /// After it, with a pause of so long before, s.
    Last(f64),
}

/// A step that is done beside the arm's motion.
struct Side {
    index: usize,
    from: f64,
    orders: Vec<Order>,
    lines: Vec<Line>,
}

/// Returns the group whose first step this is.
pub(super) fn group(pg: &ParseGraph, index: usize) -> Option<Group> {
    let path = pg.steps[index].together.clone()?;
    let is_in = |k: &usize| pg.steps[*k].together.as_ref() == Some(&path);
    if index.checked_sub(1).is_some_and(|before| is_in(&before)) {
        return None;
    }
    let steps: Vec<usize> = (index..pg.steps.len()).take_while(is_in).collect();
    let strand = |k: usize| strand_of(&path, &pg.steps[k].path);
    let several = steps.iter().any(|&k| strand(k) != strand(index));
    several.then_some(Group { path, steps })
}

/// Returns the path of the strand a step lies in: that of the group and one name more.
fn strand_of<'p>(group: &str, step: &'p str) -> &'p str {
    let rest = step.get(group.len() + 1..).unwrap_or_default();
    let end = rest.find('/').map_or(step.len(), |at| group.len() + 1 + at);
    &step[..end]
}

/// Returns when strand `side` is to be done, seen from `main`.
fn when(timings: &[Timing], side: &str, main: &str) -> When {
    let mut about = timings.iter().filter_map(|timing| {
        let by = timing.by.unwrap_or(0.0);
        let is_side_first = match (timing.a.as_str(), timing.b.as_str()) {
            (a, b) if a == side && b == main => true,
            (a, b) if a == main && b == side => false,
            _ => return None,
        };
        Some(match (timing.relation, is_side_first) {
            (Allen::During, true) => When::Beside(by),
            (Allen::During, false) => When::Beside(-by),
            (Allen::Before, true) => When::First(by),
            (Allen::Before, false) => When::Last(by),
            (Allen::Meets, true) => When::First(0.0),
            (Allen::Meets, false) => When::Last(0.0),
            _ => When::Beside(0.0),
        })
    });
    // What is asked for first is done; the rest is measured.
    about.next().unwrap_or(When::Beside(0.0))
}

impl Walker<'_> {
    /// Carries out a group; returns how its first step went and keeps the rest for their turns.
    pub(super) fn group(
        &mut self,
        pg: &ParseGraph,
        group: &Group,
        watched: &[Expr],
    ) -> Result<Done, ActionError> {
        let first = group.steps[0];
        let begin = self.scripts.context().state()?.time;
        let strands = self.strands(pg, group);
        for (k, strand) in strands.iter().enumerate() {
            for other in &strands[..k] {
                if let Some(both) = strand.uses.shared(other.uses) {
                    let text = |strand: &Strand| pg.steps[strand.steps[0]].text.clone();
                    let steps = [text(other), text(strand)];
                    let why = Cause::Conflict { steps, both };
                    let end = End { broken: Some(why.into()), ..End::default() };
                    return self.done(pg, first, begin, watched, end);
                }
            }
        }
        let mut done = BTreeMap::new();
        self.all(pg, &strands, watched, &mut done)?;
        for (index, step) in &mut done {
            if step.outcome == Outcome::Success {
                let late = self.scripts.context().past().broken(pg, *index);
                step.failure = late.map(|late| Cause::Mistimed(late).into());
                if step.failure.is_some() {
                    step.outcome = Outcome::Failure;
                }
            }
        }
        let own = done.remove(&first);
        // A step that was not come to is not the one that failed.
        let failed = done.values().find(|step| step.outcome != Outcome::Success);
        let why = failed.and_then(|step| step.failure.clone());
        self.scripts.context().past().ahead = done;
        if let Some(own) = own {
            return Ok(own);
        }
        let why = why.unwrap_or_else(|| Cause::Beside.into());
        self.done(pg, first, begin, watched, End { broken: Some(why), ..End::default() })
    }

    /// Returns the strands of a group, the one that the arm's time belongs to first.
    fn strands(&self, pg: &ParseGraph, group: &Group) -> Vec<Strand> {
        let mut strands: Vec<Strand> = Vec::new();
        for &index in &group.steps {
            let step = &pg.steps[index];
            let path = strand_of(&group.path, &step.path);
            let script = step.script.as_ref().and_then(|file| self.texts.script(file));
            let uses = script.map(Uses::of_script).unwrap_or_default();
            match strands.iter_mut().find(|strand| strand.path == path) {
                Some(strand) => {
                    strand.steps.push(index);
                    strand.uses = strand.uses.and(uses);
                }
                None => strands.push(Strand {
                    path: path.to_owned(),
                    steps: vec![index],
                    uses,
                    when: When::Beside(0.0),
                }),
            }
        }
        let main = strands.iter().position(|strand| strand.uses.joints);
        let main = main.or_else(|| strands.iter().position(|strand| !strand.uses.is_nothing()));
        strands.swap(0, main.unwrap_or(0));
        let timings: Vec<Timing> = super::timing::declared(pg).cloned().collect();
        let main = strands[0].path.clone();
        for strand in &mut strands[1..] {
            strand.when = when(&timings, &strand.path, &main);
        }
        strands
    }

    /// Carries out all strands; ends early when a step fails.
    fn all(
        &mut self,
        pg: &ParseGraph,
        strands: &[Strand],
        watched: &[Expr],
        done: &mut BTreeMap<usize, Done>,
    ) -> Result<(), ActionError> {
        let (main, sides) = (&strands[0], &strands[1..]);
        for strand in sides {
            if let When::First(gap) = strand.when {
                if !self.in_a_row(pg, strand, watched, &[], done)? {
                    return Ok(());
                }
                self.scripts.context().wait(gap)?;
            }
        }
        let soonest = sides.iter().filter_map(|strand| match strand.when {
            When::Beside(after) => Some(after),
            _ => None,
        });
        let lead = -soonest.fold(0.0, f64::min);
        let mut going: Vec<Side> = Vec::new();
        let mut keeps: Vec<Condition> = Vec::new();
        for strand in sides {
            let When::Beside(after) = strand.when else { continue };
            for &index in &strand.steps {
                match self.send_off(pg, index, lead + after, watched)? {
                    Ok(side) => going.push(side),
                    Err(failed) => {
                        done.insert(index, failed);
                        return Ok(());
                    }
                }
                keeps.extend(pg.steps[index].keeps.iter().cloned());
            }
        }
        let openings = Openings::default();
        let moved = self.noting(&openings, |walker| {
            walker.beside(pg, main, lead, &going, (watched, &keeps), done)
        })?;
        for side in going {
            let index = side.index;
            let ended = self.settle(pg, side, &openings, watched)?;
            done.insert(index, ended);
        }
        if moved {
            for strand in sides {
                if let When::Last(gap) = strand.when {
                    self.scripts.context().wait(gap)?;
                    if !self.in_a_row(pg, strand, watched, &[], done)? {
                        return Ok(());
                    }
                }
            }
        }
        Ok(())
    }

    /// Moves the arm while the others go on, and waits for them.
    fn beside(
        &mut self,
        pg: &ParseGraph,
        main: &Strand,
        lead: f64,
        going: &[Side],
        (watched, keeps): (&[Expr], &[Condition]),
        done: &mut BTreeMap<usize, Done>,
    ) -> Result<bool, ActionError> {
        if lead > 0.0 {
            self.scripts.context().wait(lead)?;
        }
        let moved = self.in_a_row(pg, main, watched, keeps, done)?;
        let mut context = self.scripts.context();
        for order in going.iter().flat_map(|side| &side.orders) {
            match order {
                Order::Open(width) => context.move_fingers(*width)?,
                Order::Look => context.body().look_end()?,
            }
        }
        Ok(moved)
    }

    /// Carries out the steps of a strand one after the other; returns whether all went well.
    fn in_a_row(
        &mut self,
        pg: &ParseGraph,
        strand: &Strand,
        watched: &[Expr],
        beside: &[Condition],
        done: &mut BTreeMap<usize, Done>,
    ) -> Result<bool, ActionError> {
        for &index in &strand.steps {
            let step = self.alone(pg, index, watched, beside)?;
            let went_well = step.outcome == Outcome::Success;
            done.insert(index, step);
            if !went_well {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Begins a step that goes on beside the arm, `after` s from now; the inner `Err` is how it failed.
    fn send_off(
        &mut self,
        pg: &ParseGraph,
        index: usize,
        after: f64,
        watched: &[Expr],
    ) -> Result<Result<Side, Done>, ActionError> {
        let step = &pg.steps[index];
        let before = self.scripts.context().state()?;
        let off = self.scripts.context().begin_step(&step.path).err().map(Cause::from);
        let unmet = || self.reader().unmet(&step.needs, &before).map(Cause::Needs);
        let mut broken = off.or_else(unmet).map(StepFailure::from);
        let (mut orders, mut lines) = (Vec::new(), Vec::new());
        if broken.is_none() {
            let (asked, wanted) = self.asked(step);
            orders = wanted;
            lines = self.scripts.context().script_lines();
            if let Err(error) = asked {
                broken = self.gave_up(step, error)?;
            }
        }
        if broken.is_some() {
            let end = End { broken, lines, ..End::default() };
            return Ok(Err(self.done(pg, index, before.time, watched, end)?));
        }
        let mut context = self.scripts.context();
        let mut from = before.time + after;
        for order in &orders {
            match order {
                Order::Open(width) => context.open_beside(*width, after)?,
                Order::Look => {
                    // A picture is taken now or never: the camera is not asked while the arm moves.
                    from = before.time;
                    context.body().look_begin()?;
                }
            }
        }
        Ok(Ok(Side { index, from, orders, lines }))
    }

    /// Runs a step's script without doing anything; returns what it wants done beside a motion.
    fn asked(&mut self, step: &Step) -> (Result<(), ScriptError>, Vec<Order>) {
        self.scripts.context().take_orders();
        let asked = self.act(step);
        (asked, self.scripts.context().orders())
    }

    /// Takes note of the fingers' opening at every tick while something is done.
    fn noting<T>(&mut self, openings: &Openings, does: impl FnOnce(&mut Self) -> T) -> T {
        self.scripts.context().note_openings(Some(openings.clone()));
        let done = does(self);
        self.scripts.context().note_openings(None);
        done
    }

    /// Says how a step that went on beside the arm went.
    fn settle(
        &mut self,
        pg: &ParseGraph,
        side: Side,
        openings: &Openings,
        watched: &[Expr],
    ) -> Result<Done, ActionError> {
        let Side { index, from, orders, lines } = side;
        let step = &pg.steps[index];
        let state = self.scripts.context().state()?;
        let to = match orders.first() {
            // A look is over for the arm once the picture is taken.
            Some(Order::Look) => from,
            Some(Order::Open(_)) => openings.rest().map_or(state.time, |rest| rest.max(from)),
            // What does nothing lasts as long as the rest.
            None => state.time,
        };
        self.scripts.context().past().done(&step.path, Interval { from, to });
        let own = |seconds| Deadline { of: step.text.clone(), seconds, since: from };
        let paces = self.scripts.context().past().paces.clone();
        let late = step.limit.map(own).and_then(|own| own.exceeded(to, &paces));
        let broken =
            late.or_else(|| promised(&self.reader(), &step.gives, &state)).map(StepFailure::from);
        let end = End { broken, interval: Some([from, to]), lines, ..End::default() };
        self.done(pg, index, from, watched, end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strand_is_one_name_below_its_group() {
        assert_eq!(strand_of("t/together", "t/together/moving"), "t/together/moving");
        assert_eq!(strand_of("t/together", "t/together/then/lift"), "t/together/then");
    }

    #[test]
    fn what_is_asked_for_says_when_a_strand_begins() {
        let timing =
            |a: &str, relation, b: &str, by| Timing { a: a.into(), relation, b: b.into(), by };
        let after = |timings: &[Timing]| match when(timings, "s", "m") {
            When::Beside(after) => ("beside", after),
            When::First(gap) => ("first", gap),
            When::Last(gap) => ("last", gap),
        };
        assert_eq!(after(&[]), ("beside", 0.0));
        assert_eq!(after(&[timing("s", Allen::During, "m", Some(0.5))]), ("beside", 0.5));
        assert_eq!(after(&[timing("m", Allen::During, "s", Some(0.5))]), ("beside", -0.5));
        assert_eq!(after(&[timing("s", Allen::Before, "m", Some(1.0))]), ("first", 1.0));
        assert_eq!(after(&[timing("m", Allen::Meets, "s", None)]), ("last", 0.0));
        assert_eq!(after(&[timing("s", Allen::During, "x", Some(0.5))]), ("beside", 0.0));
    }
}
