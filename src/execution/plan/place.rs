//! Ways to put what is in the hand down on the table.

use nalgebra::Vector3;

use crate::world::frame::Object;
use crate::world::{Pose, frame};

use super::grasp::distance;
use super::{Dropped, NoWay, Planner, REACHING, TRACKING, Why, straight};

/// The object is let go this far above the table, m.
const DROP: f64 = 0.002;
/// The hand comes down from this far above, m.
const ABOVE: f64 = 0.06;
/// The hand draws back by this much, m.
const BACK: f64 = 0.12;

/// One way to put an object down.
#[derive(Debug, Clone, PartialEq)]
pub struct Placement {
    /// The object.
    pub object: String,
    /// Joint positions above the place, rad.
    pub above: Vec<f64>,
    /// Down to the table, rad.
    pub way_down: Vec<Vec<f64>>,
    /// Away with open fingers, rad.
    pub way_out: Vec<Vec<f64>>,
    /// Where it will stand, m.
    pub at: [f64; 2],
    /// What the ways are sorted by; less is better.
    cost: f64,
}

impl Planner {
    /// Returns ways to put down `o`, which is in the hand, upright on a free place of the table.
    ///
    /// # Errors
    ///
    /// [`NoWay`] when the hand is empty or no free place is reachable.
    pub fn placements(&self, o: &str) -> Result<Vec<Placement>, NoWay> {
        let what = format!("to put `{o}` down");
        let no = |why| NoWay { what: what.clone(), why };
        let (held, tool_from_object) = self.in_hand().ok_or_else(|| no(Why::EmptyHand))?;
        let object = self.cell.scene.object(o).filter(|_| held == o);
        let object = object.ok_or_else(|| no(Why::EmptyHand))?;

        let world = self.obstacles(&[], self.state.opening);
        let empty = self.obstacles(&[o], self.robot().max_opening());
        let object_from_tool = tool_from_object.inverse();
        let ahead = object_from_tool.axis(2);
        let mut dropped = Dropped::new();
        let mut ways = Vec::new();
        'looking: for (x, y) in self.free_places(o, object.shape.outer_radius()) {
            let heading = y.atan2(x);
            for turn in [0.0, 0.35, -0.35, 0.7, -0.7] {
                let yaw = heading + turn - ahead.y.atan2(ahead.x);
                let stands: Pose<frame::World, Object> = Pose::upright(x, y, DROP, yaw);
                let down = stands * object_from_tool;
                let up = Vector3::z() * ABOVE;
                let work = REACHING + TRACKING * 36 + world.cost() * 36;
                if !self.goes_on(work, ways.len()).map_err(no)? {
                    break 'looking;
                }
                let q_down = match self.reach(&down, &self.q) {
                    Ok(mut found) => found.swap_remove(0),
                    Err(nearest) => {
                        dropped.out_of_reach(nearest);
                        continue;
                    }
                };
                dropped.tried += 1;
                let Ok(mut way_down) = self.track(&q_down, &straight(&down, up)) else { continue };
                way_down.reverse();
                let back = -down.axis(2) * BACK;
                let Ok(way_out) = self.track(&q_down, &straight(&down, back)) else { continue };
                // The object itself may come close to the table at the very end of the way down.
                let high = &way_down[..way_down.len().saturating_sub(4)];
                if Self::clear(&world, high, &mut dropped).is_none()
                    || Self::clear(&empty, &way_out[4.min(way_out.len())..], &mut dropped).is_none()
                {
                    continue;
                }
                if !self.passes(&way_down) || !self.passes(&way_out) {
                    dropped.out_of_reach(0.0);
                    continue;
                }
                let cost = distance(&way_down[0], &self.q) + 0.5 * turn.abs();
                ways.push(Placement {
                    object: o.to_owned(),
                    above: way_down[0].clone(),
                    way_down,
                    way_out,
                    at: [x, y],
                    cost,
                });
                break;
            }
            if ways.len() >= 6 {
                break;
            }
        }
        if ways.is_empty() {
            return Err(no(dropped.why()));
        }
        ways.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        Ok(ways)
    }

    /// Returns places on the table that nothing stands near, nearest to the hand first.
    fn free_places(&self, o: &str, radius: f64) -> Vec<(f64, f64)> {
        let scene = &self.cell.scene;
        let hand = self.state.world_from_tool.origin();
        let base = scene.world_from_base.origin();
        let mut places = Vec::new();
        for ix in 0..24 {
            for iy in 0..33 {
                let (x, y) = (0.25 + 0.025 * f64::from(ix), -0.40 + 0.025 * f64::from(iy));
                let reach = (x - base.x).hypot(y - base.y);
                // Where a level grasp low over the table is comfortable for the arm, m.
                if !(0.50..0.72).contains(&reach) || !scene.table.holds(x, y, radius + 0.02) {
                    continue;
                }
                let free = scene.objects.iter().filter(|other| other.name != o).all(|other| {
                    let known = self.state.object(&other.name).and_then(|s| s.world_from_object);
                    known.is_none_or(|pose| {
                        let gap = (pose.origin().x - x).hypot(pose.origin().y - y);
                        gap > other.shape.outer_radius() + radius + 0.06
                    })
                });
                if free {
                    places.push((x, y));
                }
            }
        }
        places.sort_by(|a, b| {
            let far = |p: &(f64, f64)| (p.0 - hand.x).hypot(p.1 - hand.y);
            far(a).total_cmp(&far(b))
        });
        places
    }
}
