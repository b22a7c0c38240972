//! Ways to set down what is held from above so that a level hand can take it afterwards.
//!
//! A mug whose handle points at the arm, or a box that stands with an edge to it, has no side that a level hand gets at. From
//! above it has; set down turned, it can be taken by its side and poured.

use crate::world::Region;
use crate::world::frame::{Object, World};
use crate::world::{Pose, region::TABLE};

use super::{NoWay, Placement, Planner};

/// The pose of the arm from which it is asked whether a level hand gets there: where it waits while the camera looks.
const FROM: &str = "retract";

impl Planner {
    /// Returns ways to put down `o`, which is in the hand, on a free place of the table, turned so that a level hand can
    /// take it there, best first.
    ///
    /// # Errors
    ///
    /// [`NoWay`] when the hand is empty, no free place is reachable, or at none of them a level hand gets at `o`.
    pub fn turned_placements(&self, o: &str) -> Result<Vec<Placement>, NoWay> {
        let table = Region::On(TABLE.to_owned());
        self.placements_where(o, &table, &|stands| self.is_taken_level(o, stands))
    }

    /// Whether a level hand could take `o` if it stood so.
    fn is_taken_level(&self, o: &str, stands: &Pose<World, Object>) -> bool {
        let q = self.robot().pose(FROM).map_or_else(|_| self.q.clone(), <[f64]>::to_vec);
        let mut state = self.state.clone();
        state.held = None;
        state.opening = self.robot().max_opening();
        state.world_from_tool = self.tool_at(&q);
        if let Some(known) = state.objects.iter_mut().find(|known| known.name == o) {
            known.world_from_object = Some(*stands);
        }
        let budget = std::sync::Arc::clone(&self.budget);
        Self::new(self.cell.clone(), state, q, self.doubt, budget).grasps(o, 0.0).is_ok()
    }
}
