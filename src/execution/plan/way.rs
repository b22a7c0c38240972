//! Free motions: from where the arm is to where it is to be, round everything in the way.

use std::sync::Arc;

use nalgebra::{Unit, Vector3};

use crate::motion::budget::Budget;
use crate::motion::escape;
use crate::motion::free;
use crate::motion::ik::Solver;
use crate::motion::rrt::{self, Cone};
use crate::trace::NoWay;

use super::Planner;

/// How far free motions keep from the ends of a joint's range, rad: half a degree, since their corners are cut on the inside. Chosen:
/// with half of it a curve timed along a path that runs at the end of a range may be refused by the limits; more than half of
/// [`super::RESERVE`] (0.86 deg) it may not be, or a free motion could not come to where a way that [`super::follow`] found begins.
const END_RESERVE: f64 = 0.5 * std::f64::consts::PI / 180.0;
/// What is in the hand may be off by so much, m: things put on others by a hand were 8 to 19 mm off (`docs/results.md`), and a
/// jar that was led over the rim of a cup at less caught it and pulled it over.
const SLID: f64 = 0.010;
/// What looking for a way with that much room may cost, in units of a [`Budget`]: a second. All that a pour plans costs half of it.
const CAREFUL: u64 = 20_000_000;

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
    /// it first. What is in the hand keeps 10 mm from everything where there is such a way.
    pub fn free(&self, q: &[f64], tilt: Option<f64>, seed: u64) -> Result<Way, NoWay> {
        if self.in_hand().is_some() && self.doubt < SLID {
            let whole = Arc::clone(&self.budget);
            let budget = Arc::new(Budget::of(CAREFUL, move || whole.spend(1).is_err()));
            let (cell, state) = (self.cell.clone(), self.state.clone());
            let careful = Self::new(cell, state, self.q.clone(), SLID, budget);
            if let Ok(way) = careful.free_within(q, tilt, seed)
                && way.out.len() <= 1
            {
                return Ok(way);
            }
        }
        self.free_within(q, tilt, seed)
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
        let settings = rrt::Settings::seeded(seed);
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
