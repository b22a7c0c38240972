//! Places on the table where nothing else stands.
//!
//! First those to which a level hand comes with ease and at which there is room for it on every side. Where there are none, with
//! less room, then farther out and nearer to the base; and where the thing stood when it was taken. Whether a hand gets there
//! is looked at for every way ([`super::place`]).

use std::ops::Range;

use nalgebra::Vector3;

use crate::world::region::TABLE;
use crate::world::{self as scene, Pose, support};

use super::place::{CLOSE, FAR_ABOVE, FROM_EDGE, GRID, ROOM};
use super::{Planner, Why};

/// How far from the base a level grasp low over the table is comfortable for the arm, m: at 0.5 m a level hand is out
/// of reach at 0.275 m of height, where joint 4 ends; at 0.62 m every height from 0.075 to 0.275 m is reached (both
/// tried within the arm's limits). Chosen at the far end, well inside the 1.0 m at which the arm is straight (links
/// of 0.421 and 0.314 m from a shoulder at 0.285 m, and 0.287 m of level hand): a thing must be lifted there, too.
const COMFORTABLE: Range<f64> = 0.50..0.72;
/// How far from the base a place is looked for where none is comfortable, m. Chosen: at the near end a thing is still before the
/// arm and not beside its base, at the far end the arm is nearly straight.
const REACHED: Range<f64> = 0.35..0.85;
/// Room that is left between things, m. Chosen: the open hand is 113 mm wide (85 mm between jaws of 14 mm), and
/// stands out by 24 mm on each side of a thing of 65 mm. With half of it 6 mm are left to the next thing, with twice
/// as much a full table has no place.
const BETWEEN: f64 = 0.06;

impl Planner {
    /// Returns places on the table that nothing stands near, m, nearest to the hand first.
    ///
    /// # Errors
    ///
    /// [`Why::NoFreePlace`] when the table is full.
    pub(super) fn free_places(&self, o: &scene::Object) -> Result<Vec<Vector3<f64>>, Why> {
        let radius = o.shape.outer_radius();
        let apart = |x: f64, y: f64| {
            let mut others = self.cell.scene.objects.iter().filter(|other| other.name != o.name);
            self.is_known(x, y, radius)
                && others.all(|other| {
                    let known = self.state.object(&other.name).and_then(|s| s.world_from_object);
                    known.is_none_or(|pose| {
                        let gap = (pose.origin().x - x).hypot(pose.origin().y - y);
                        gap > other.shape.outer_radius() + radius + BETWEEN
                    })
                })
        };
        let stood = self.place_before(o);
        let mut places = self.places_around(&COMFORTABLE, GRID, radius + FROM_EDGE, &apart);
        if !places.is_empty() {
            places.extend(stood);
            return Ok(places);
        }
        for (grid, share) in ROOM {
            let room = radius + CLOSE * share;
            let is_free = |x: f64, y: f64| {
                let place = Vector3::new(x, y, 0.0);
                self.is_known(x, y, room) && self.beside(o, TABLE, place, room).is_none()
            };
            for ring in [COMFORTABLE, REACHED] {
                let edge = radius + FROM_EDGE * share;
                let found = self.places_around(&ring, GRID * grid, edge, &is_free);
                if !found.is_empty() {
                    return Ok(stood.into_iter().chain(found).collect());
                }
            }
        }
        stood.map(|place| vec![place]).ok_or(Why::NoFreePlace)
    }

    /// Returns the places of a grid that are so far from the base and from the edge of the table, m, and free, nearest to the hand
    /// first.
    fn places_around(
        &self,
        ring: &Range<f64>,
        grid: f64,
        edge: f64,
        is_free: &dyn Fn(f64, f64) -> bool,
    ) -> Vec<Vector3<f64>> {
        let scene = &self.cell.scene;
        let hand = self.state.world_from_tool.origin();
        let base = scene.world_from_base.origin();
        let mut places = Vec::new();
        let most = (ring.end / grid).ceil() as i32;
        for ix in -most..=most {
            for iy in -most..=most {
                let (dx, dy) = (grid * f64::from(ix), grid * f64::from(iy));
                let (x, y) = (base.x + dx, base.y + dy);
                let is_there = ring.contains(&dx.hypot(dy)) && scene.table.holds(x, y, edge);
                if is_there && is_free(x, y) {
                    places.push(Vector3::new(x, y, 0.0));
                }
            }
        }
        let far = |place: &Vector3<f64>| (place.x - hand.x).hypot(place.y - hand.y);
        places.sort_by(|a, b| far(a).total_cmp(&far(b)));
        places
    }

    /// Returns where a thing stood when it was taken, m, if that is on the table and still free.
    fn place_before(&self, o: &scene::Object) -> Option<Vector3<f64>> {
        let (_, [x, y]) = self.taken.as_ref().filter(|(name, _)| *name == o.name)?;
        let (scene, room) = (&self.cell.scene, o.shape.inner_radius());
        let from_above = Pose::upright(*x, *y, FAR_ABOVE, 0.0);
        let below = support::below(scene, &self.state.objects, o, &from_above);
        let place = Vector3::new(*x, *y, below.height);
        let is_free = below.name.is_none()
            && scene.table.holds(*x, *y, room)
            && self.is_known(*x, *y, room)
            && self.beside(o, TABLE, place, room).is_none();
        is_free.then_some(place)
    }
}
