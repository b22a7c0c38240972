//! What stands elsewhere after a run than it was seen before it, though no step took or pushed it: a neighbour that was nudged.
//!
//! A thing that is not worked on stands where a picture last showed it, so that another place means that a later picture showed
//! it there. What stands on a thing that is moved, or in it, goes with it.

use std::collections::BTreeSet;
use std::iter;

use serde::{Deserialize, Serialize};

use crate::trace::{Deed, StepRecord};
use crate::world::{Scene, WorldState, support};

/// What pictures of the same thing in the same place may differ by, m: three standard deviations of a sighting
/// (0.3 to 1.6 mm in `docs/results.md`).
pub(super) const ELSEWHERE: f64 = 0.005;
/// And so many standard deviations of the two sightings together, as they say themselves. Chosen.
const SURELY: f64 = 3.0;

/// A thing that stands elsewhere, though no step took or pushed it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Displaced {
    /// Which.
    pub object: String,
    /// How far from where it was seen before the run, m.
    pub by_m: f64,
    /// One standard deviation of that, m.
    pub std_m: f64,
}

/// Returns the things that stand elsewhere after these steps than at their start, and were not to.
pub(super) fn displaced(scene: &Scene, start: &WorldState, steps: &[StepRecord]) -> Vec<Displaced> {
    let Some(last) = steps.last() else { return Vec::new() };
    let worked = worked_on(start, steps);
    let is_meant = |name: &str| {
        let pile = support::pile(scene, &start.objects, name);
        pile.iter().any(|on| worked.contains(on.as_str()))
    };
    let elsewhere = last.measured.objects.iter().filter_map(|now| {
        let before = start.object(&now.name)?;
        let way = now.world_from_object?.origin() - before.world_from_object?.origin();
        let (by_m, std_m) = (way.norm(), now.std.hypot(before.std));
        let is_elsewhere = by_m > ELSEWHERE.max(SURELY * std_m);
        (is_elsewhere && !is_meant(&now.name)).then(|| Displaced {
            object: now.name.clone(),
            by_m,
            std_m,
        })
    });
    elsewhere.collect()
}

/// Returns what was in the hand, or pushed by it.
fn worked_on<'a>(start: &'a WorldState, steps: &'a [StepRecord]) -> BTreeSet<&'a str> {
    let deeds = steps.iter().flat_map(StepRecord::deeds).filter_map(|deed| match deed {
        Deed::Took { object } | Deed::Pushed { object } | Deed::SetDown { object } => {
            Some(object.as_str())
        }
        Deed::Turned { source, .. } => Some(source.as_str()),
        Deed::Released | Deed::TurnedBack => None,
    });
    let worlds = iter::once(start).chain(steps.iter().map(|step| &step.measured));
    deeds.chain(worlds.filter_map(|world| world.held.as_deref())).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use crate::trace::{Line, Outcome};
    use crate::world::object::vessel;
    use crate::world::{Object, ObjectState, Pose, Shape, scene};

    use super::*;

    /// A world in which things stand at these x and z, m, each known to so much, m.
    fn world(things: [(&str, f64, f64, f64); 3]) -> WorldState {
        let objects = things.map(|(name, x, z, std)| ObjectState {
            name: name.into(),
            world_from_object: Some(Pose::upright(x, 0.0, z, 0.0)),
            std,
            water: None,
        });
        WorldState {
            time: 0.0,
            q: vec![0.0; 7],
            opening: 0.08,
            world_from_tool: Pose::upright(0.4, 0.0, 0.3, 0.0),
            held: None,
            objects: objects.to_vec(),
            spilt: None,
            unknown: Vec::new(),
        }
    }

    /// A step that pushes `red`, after which the world is this.
    fn pushed(measured: WorldState) -> StepRecord {
        let line = Line {
            script: "shove.rhai".into(),
            line: 7,
            text: "arm.push(leg);".into(),
            does: "push red".into(),
            at_s: 0.0,
            deed: Some(Deed::Pushed { object: "red".into() }),
        };
        StepRecord {
            number: 1,
            path: "push/shove".into(),
            action: "shove(red)".into(),
            call: None,
            outcome: Outcome::Success,
            not_needed: None,
            reason: None,
            failure: None,
            interval_s: [0.0, 1.0],
            fluents: Vec::new(),
            during: Vec::new(),
            lines: vec![line],
            planned_q: Vec::new(),
            hamming: 0,
            score: 1.0,
            measured,
            twin: None,
        }
    }

    /// A push took a can along, 23 mm, and the run said `done` and nothing else.
    #[test]
    fn a_neighbour_that_was_nudged_is_told_and_what_was_pushed_is_not() {
        let cube = |name: &str| {
            let shape = Shape::Cuboid { size: Vector3::repeat(0.05) };
            Object { name: name.into(), cavity: None, ..vessel(shape, 1e-3) }
        };
        let scene = scene::bare(vec![cube("red"), cube("rider"), cube("can")]);
        let start = world([
            ("red", 0.4, 0.0, 0.0003),
            ("rider", 0.4, 0.05, 0.0003),
            ("can", 0.6, 0.0, 0.0004),
        ]);
        let after = |can: f64, std: f64| {
            let now = world([
                ("red", 0.5, 0.0, 0.0003),
                ("rider", 0.5, 0.05, 0.0003),
                ("can", can, 0.0, std),
            ]);
            displaced(&scene, &start, &[pushed(now)])
        };
        let found = after(0.623, 0.0003);
        let [can] = &found[..] else { panic!("one thing: {found:?}") };
        assert_eq!(can.object, "can");
        assert!((can.by_m - 0.023).abs() < 1e-12 && (can.std_m - 0.0005).abs() < 1e-12, "{can:?}");
        // Neither what two pictures of one place differ by, nor what the later one does not know.
        assert!(after(0.603, 0.0003).is_empty());
        assert!(after(0.623, 0.009).is_empty());
        assert!(displaced(&scene, &start, &[]).is_empty());
    }
}
