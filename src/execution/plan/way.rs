//! Free motions: from where the arm is to where it is to be, round everything in the way.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Unit, Vector3};

use crate::motion::budget::Budget;
use crate::motion::escape;
use crate::motion::free;
use crate::motion::ik::Solver;
use crate::motion::reserve::Reserve;
use crate::motion::rrt::{self, Cone};
use crate::trace::NoWay;

use super::Planner;

/// How far free motions keep from the ends of a joint's range: half a degree, and half a millimetre of a slide, since their corners
/// are cut on the inside. Chosen: with half of it a curve timed along a path that runs at the end of a range may be refused by the
/// limits; more than half of [`super::RESERVE`] (0.86 deg, 1 mm) it may not be, or a free motion could not come to where a way that
/// [`super::follow`] found begins.
const END_RESERVE: Reserve =
    Reserve { turning: 0.5 * std::f64::consts::PI / 180.0, sliding: 0.0005 };
/// What is in the hand may be off by so much, m: things put on others by a hand were 8 to 19 mm off (`docs/results.md`), and a
/// jar that was led over the rim of a cup at less caught it and pulled it over.
const SLID: f64 = 0.010;
/// The arm itself may be off by so much, m: a calibrated one is some millimetres beside where it is taken to be, and at full speed a
/// little behind. A can that a hand was led past with 0.3 and 2 mm of room was moved by 4 mm in the twin, and knocked over in the
/// laboratory. Chosen: with half of it that happens on the arm, with twice as much there is hardly a gap that is passed with it.
const BESIDE: f64 = 0.005;
/// What looking for a way with that much room may cost, in units of a [`Budget`]: a second. All that a pour plans costs half of it.
const CAREFUL: u64 = 20_000_000;

/// A way is searched for with so many samples. Chosen: what has none is given up after a tenth of a second, and something else is planned.
const SAMPLES: usize = 20_000;

/// A free motion in two stretches, with a rest between.
#[derive(Debug, Clone, PartialEq)]
pub struct Way {
    /// Out of where something is touched, rad; one point where nothing is.
    pub out: Vec<Vec<f64>>,
    /// On from there, rad.
    pub on: Vec<Vec<f64>>,
}

impl Planner {
    /// Returns the way from where the arm is to `q`, round everything in the way; `tilt` bounds the angle,
    /// rad, of what is in the hand from upright. Where something is touched already, the arm is led away from
    /// it first. The arm keeps 5 mm from everything, with something in the hand 10 mm, where there is such a way; from what it
    /// is nearer to where it begins or ends, it keeps half of what there is.
    pub fn free(&self, q: &[f64], tilt: Option<f64>, seed: u64) -> Result<Way, NoWay> {
        let rooms: &[f64] = if self.in_hand().is_some() { &[SLID, BESIDE] } else { &[BESIDE] };
        let whole = Arc::clone(&self.budget);
        let budget = Arc::new(Budget::of(CAREFUL, move || whole.spend(1).is_err()));
        for room in rooms.iter().copied().filter(|room| self.doubt < *room) {
            let careful = self.keeping(room, q, Arc::clone(&budget));
            if let Ok(way) = careful.free_within(q, tilt, seed) {
                return Ok(way);
            }
        }
        self.free_within(q, tilt, seed)
    }

    /// Returns a planner of motions to `q` that keep `room` m from everything, which is more than the arm is in doubt.
    fn keeping(&self, room: f64, q: &[f64], budget: Arc<Budget<'static>>) -> Self {
        let mut near = BTreeMap::new();
        let world = self.world();
        for end in [&self.q[..], q] {
            for (name, distance) in world.nearby(end, 2.0 * room) {
                let kept = (self.doubt + 0.5 * distance).clamp(self.doubt, room);
                let least = near.entry(name.to_owned()).or_insert(kept);
                *least = kept.min(*least);
            }
        }
        let (cell, state) = (self.cell.clone(), self.state.clone());
        Self { near, ..Self::new(cell, state, self.q.clone(), room, budget) }
    }

    /// Returns the cone that what is in the hand is to stay in: within `tilt` rad of upright; none with an empty hand.
    pub fn cone(&self, tilt: Option<f64>) -> Option<Cone> {
        let (Some((_, tool_from_object)), Some(max_angle)) = (self.in_hand(), tilt) else {
            return None;
        };
        let up = self.cell.scene.world_from_base.inverse().rotation() * Vector3::z();
        let axis = (self.robot().flange_from_tool() * tool_from_object).axis(2);
        Some(Cone {
            axis_in_flange: Unit::new_normalize(axis),
            up_in_base: Unit::new_normalize(up),
            max_angle,
        })
    }

    fn free_within(&self, q: &[f64], tilt: Option<f64>, seed: u64) -> Result<Way, NoWay> {
        let (world, cone) = (self.world(), self.cone(tilt));
        let goals = [rrt::short_way(self.robot(), &self.q, q)];
        let robot = self.robot().clone().with_reserve(END_RESERVE, &[&self.q, &goals[0]]);
        let solver = Solver::new(&robot);
        // An arm that is led is off by more than what would be left: where there is no way with room, something else is planned.
        let settings =
            rrt::Settings { may_graze: false, max_samples: SAMPLES, ..rrt::Settings::seeded(seed) };
        // An arm that is caught is told by the search what it touches.
        let out = escape::leave(&solver, &world, &self.q, cone.as_ref(), &self.budget);
        let out = out.unwrap_or_else(|| vec![self.q.clone()]);
        let start = out.last().unwrap_or(&self.q);
        let (means, cone) = (self.cell.means, cone.as_ref());
        let found =
            free::plan(means, &solver, &world, start, &goals, cone, &settings, &self.budget);
        match found {
            Ok(path) => Ok(Way { out, on: path.corners }),
            Err(error) => {
                Err(NoWay { what: "to get there".to_owned(), why: self.why_no_path(error) })
            }
        }
    }
}
