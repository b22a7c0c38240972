//! Ways to put what is in the hand down: on the table, on another thing, or into it.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::Vector3;

use crate::motion::collision::{CollisionWorld, Obstacle};
use crate::trace::OffTable;
use crate::world::frame::{Object, Tool, World};
use crate::world::region::{self, Bearer, TABLE};
use crate::world::{self as scene, Point, Pose, Region, Shape, Unknown, support};

use super::super::wording;
use super::grasp::LIFT;
use super::hollow;
use super::{Dropped, NoWay, Planner, REACHING, STRAIGHT_STEP, TRACKING, UNKNOWN, Why, straight};

/// The object is let go this far above the table, m. Chosen: `lower` promises 5 mm (`stdlib/tasks/std.task`). With half
/// of it an arm that is a millimetre low presses the thing onto the table before it is let go; with twice as much what
/// is slim tips when it lands.
const DROP: f64 = 0.002;
/// The hand comes down from this far above, m. Chosen: with half of it what is carried over the table passes 3 cm above
/// low things; with twice as much fewer places have a straight way down that the arm can follow.
const ABOVE: f64 = 0.06;
/// The hand draws back by this much, m. As far as before a grasp (its `STANDOFF`): from 57 mm on the fingertips are
/// behind the thing. Chosen beyond that: with half of it they are clear by 3 mm, and the next turn of the hand strikes
/// it; with twice as much the way out ends at less than 0.5 m from the base, where a level hand is out of reach.
const BACK: f64 = 0.12;
/// Turns of the hand from straight ahead that are tried, rad, in this order: some 20 deg, then 40 deg. Chosen: with
/// half of them the hand comes to a place behind a thing over that thing; at twice them it points across the table,
/// where the next place is reached more easily.
const TURNS: [f64; 5] = [0.0, 0.35, -0.35, 0.7, -0.7];
/// Further turns of a hand that comes from above, rad: it hides nothing and points nowhere, whichever way it is turned.
const AROUND: [f64; 4] = [1.4, -1.4, 2.1, -2.1];
/// Shares of [`ABOVE`] and [`BACK`] that are tried: near the end of the arm's reach the short way is the only one, and
/// after 60 mm of it the fingertips are behind the thing.
const SHORT: [f64; 2] = [1.0, 0.5];
/// What a way down costs that is missing as a whole, in rad of travel. Chosen: one of half the height, which is come to low past
/// whatever stands beside it, is taken only where half a rad further there is none of all the height.
const SHORT_COST: f64 = 1.0;
/// What a place on another thing costs from which the hand cannot go straight up as far as a lift needs, in rad of travel. Chosen:
/// more than any way round, so that such a place is taken only where there is no other.
const UNLIFTED_COST: f64 = 10.0;
/// So many joint positions of a place are tried, nearest first. Chosen: with one of them a high place is given up where
/// only that branch of the arm cannot come down straight, with twice as many a place out of reach costs twice as much.
const BRANCHES: usize = 4;
/// Poses at the low end of a way that may touch: `4 x` [`STRAIGHT_STEP`] = 20 mm. The table, and on the way out the
/// pads, are touched there because that is meant. Chosen: with half of it a table that is known to a centimetre
/// blocks every place, with twice as much a thing beside the place is struck unseen.
const MEANT: usize = 4;
/// Room that a hand keeps from the walls of a vessel, and from what is beside it, where it sets something down in it, m: a
/// calibrated arm is off by 2 to 4 mm (`docs/results.md`). Chosen: with none of it a wrist that passed a chest in the twin
/// was stopped by it in the laboratory; more was not tried.
const AT_WALLS: f64 = 0.004;
/// What a rad of [`TURNS`] costs in that unit, 1/rad. Chosen: a turned hand costs less than a longer way, since it
/// comes down as well. At twice it 40 deg weigh as much as 40 deg of travel; at half of it hardly more than the noise
/// of travel among the places.
const TURN_COST: f64 = 0.5;
/// So many ways are enough. Chosen: a run rehearses four candidates (`CANDIDATES` in `workcell::attempt`); with half as
/// many there is not one for each, with twice as many the search costs as much again.
const ENOUGH: usize = 6;
/// Higher than anything that stands on a table, m: what is below is looked for from there.
pub(super) const FAR_ABOVE: f64 = 3.0;
/// How far apart the places are that are looked at around the base, m. Chosen: a free place is missed by at most 18 mm (half of the diagonal). With half
/// of it four times as many are looked at, with twice as much gaps that are 35 mm wider than needed are missed.
pub(super) const GRID: f64 = 0.025;
/// How far from the table's edge a thing is kept, m. Chosen: an arm whose error nobody has measured is up to 2 cm
/// beside where it says (8 to 19 mm in `docs/results.md`). With half of it a thing may overhang the edge, with twice
/// as much a small table has few places.
pub(super) const FROM_EDGE: f64 = 0.02;

/// So far inside a region a place is looked for, m: half of what [`region::AT`] allows, so that an arm that is a
/// centimetre beside where it is sent still ends inside.
const INSIDE: f64 = 0.5 * region::AT;
/// From here on inside a region no place is better than another, m. Chosen: half of what "next to" allows
/// ([`region::NEAR`]); with twice as much what is put next to something touches it, since that is farthest inside.
const WELL_INSIDE: f64 = 0.5 * region::NEAR;
/// Room that is left between a thing and what it is put beside, m. Chosen: an open 2F-85 stands out by 24 mm on each side
/// of a thing, and 6 mm are left for an arm that is beside where it says; whether the hand touches is
/// looked at for every way.
pub(super) const CLOSE: f64 = 0.03;
/// The room that places in a region are looked for with, in this order: a share of [`GRID`], and of the room to the next thing and
/// to the edge of the table. The finer grid finds what is between a thing and the edge; the last leaves 1 cm and 7 mm,
/// twice and more what a calibrated arm is off (2 to 4 mm in `docs/results.md`), and whether a hand gets there is looked at
/// for every way.
pub(super) const ROOM: [(f64, f64); 3] = [(1.0, 1.0), (0.5, 1.0), (0.25, 1.0 / 3.0)];

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
    pub at: [f64; 3],
    /// What the ways are sorted by; less is better.
    cost: f64,
}

/// What must not be touched while something is set down.
struct Around<'w> {
    /// On the way down, with the thing in the hand.
    held: CollisionWorld<'w>,
    /// On the way out, without it.
    empty: CollisionWorld<'w>,
    /// At the very end of a way down into a vessel: what stands around the hand, which keeps [`AT_WALLS`] from it, and the arm
    /// alone, whose own parts may be nearer to each other than that.
    beside: Option<[CollisionWorld<'w>; 2]>,
}

impl Around<'_> {
    fn lets(&self, way_down: &[Vec<f64>], way_out: &[Vec<f64>], dropped: &mut Dropped) -> bool {
        // The object itself may come close to what it is set down on at the very end of the way down.
        let (high, low) = way_down.split_at(way_down.len().saturating_sub(MEANT));
        let out = &way_out[MEANT.min(way_out.len())..];
        let mut is_clear =
            |world, way, room| Planner::clear_by(world, way, room, dropped).is_some();
        let is_clear_of_walls = self.beside.as_ref().is_none_or(|[beside, alone]| {
            is_clear(beside, low, AT_WALLS) && is_clear(alone, low, 0.0)
        });
        is_clear_of_walls && is_clear(&self.held, high, 0.0) && is_clear(&self.empty, out, 0.0)
    }
}

impl Planner {
    /// Returns ways to put down `o`, which is in the hand, upright on a free place of `at`: the table, another thing on
    /// which, or in which, it may stand, or beside others.
    ///
    /// # Errors
    ///
    /// [`NoWay`] when the hand is empty, nobody knows where `at` is, or no free place is reachable.
    pub fn placements(&self, o: &str, at: &Region) -> Result<Vec<Placement>, NoWay> {
        self.placements_where(o, at, &|_| true)
    }

    /// As [`Self::placements`], only of poses that `suits` lets pass.
    pub(super) fn placements_where(
        &self,
        o: &str,
        at: &Region,
        suits: &dyn Fn(&Pose<World, Object>) -> bool,
    ) -> Result<Vec<Placement>, NoWay> {
        let into = self.space_for(o, at);
        let what = wording::to_put(o, at, into.is_some());
        let no = |why| NoWay { what: what.clone(), why };
        let (held, tool_from_object) = self.in_hand().ok_or_else(|| no(Why::EmptyHand))?;
        let object = self.cell.scene.object(o).filter(|_| held == o);
        let object = object.ok_or_else(|| no(Why::EmptyHand))?;

        let places: Vec<Vector3<f64>> = match at {
            Region::On(name) if name == TABLE => self.free_places(object).map_err(no)?,
            Region::On(name) => self.places_on(object, name).map_err(no)?,
            region => self.places_in(object, region, CLOSE).map_err(no)?,
        };
        // What goes into a vessel comes straight down from above its rim.
        let at = match at {
            Region::On(name) => name.as_str(),
            _ => "",
        };
        let is_raised = !at.is_empty() && at != TABLE;
        let (vessel, deep) = into.as_ref().map(|inside| (at, inside.height())).unzip();
        let around = Around {
            held: self.obstacles_around(&[], vessel, self.state.opening),
            empty: self.obstacles_around(&[o], vessel, self.robot().max_opening()),
            beside: vessel.map(|vessel| [self.beside_hand(o, vessel), self.alone()]),
        };
        let object_from_tool = tool_from_object.inverse();
        let ahead = object_from_tool.axis(2);
        let is_level = ahead.xy().norm() > FRAC_1_SQRT_2;
        let mut dropped = Dropped::new();
        let mut ways = Vec::new();
        let mut n_lifted = 0;
        'looking: for place in places {
            let (x, y) = (place.x, place.y);
            let heading = self.bearing(&place);
            let turned = if is_level { &[][..] } else { &AROUND[..] };
            for &turn in TURNS.iter().chain(turned) {
                let yaw = heading + turn - ahead.y.atan2(ahead.x);
                let stands: Pose<World, Object> = Pose::upright(x, y, place.z + DROP, yaw);
                let down = stands * object_from_tool;
                let above = deep.unwrap_or(0.0) + ABOVE;
                let up = Vector3::z() * above;
                let poses = ((above + BACK) / STRAIGHT_STEP).round() as u64;
                let work = REACHING + TRACKING * poses + around.held.cost() * poses;
                if !self.goes_on(work, ways.len()).map_err(no)? {
                    break 'looking;
                }
                let starts = match self.reach(&down, &self.q) {
                    Ok(found) => found,
                    Err(why) => {
                        dropped.missed(why);
                        continue;
                    }
                };
                dropped.tried += 1;
                let ways_of = self.up_and_back(&starts, &down, up, into.is_some());
                let Some(([mut way_down, way_out], short)) = ways_of else {
                    dropped.out_of_reach(0.0);
                    continue;
                };
                way_down.reverse();
                if !around.lets(&way_down, &way_out, &mut dropped) {
                    continue;
                }
                if !self.passes(&way_down) || !self.passes(&way_out) || !suits(&stands) {
                    dropped.out_of_reach(0.0);
                    continue;
                }
                // From on another thing it is to be taken again.
                let lift = || straight(&down, Vector3::z() * LIFT);
                let can_lift = |low: &Vec<f64>| self.track(low, &lift()).is_ok();
                let is_lifted = !is_raised || way_down.last().is_some_and(can_lift);
                n_lifted += usize::from(is_lifted);
                let cost = self.travel(&way_down[0])
                    + TURN_COST * turn.abs()
                    + SHORT_COST * (1.0 - short)
                    + UNLIFTED_COST * f64::from(u8::from(!is_lifted));
                ways.push(Placement {
                    object: o.to_owned(),
                    above: way_down[0].clone(),
                    way_down,
                    way_out,
                    at: place.into(),
                    cost,
                });
                break;
            }
            if n_lifted >= ENOUGH {
                break;
            }
        }
        if ways.is_empty() {
            return Err(no(dropped.why().into_vessel(vessel)));
        }
        ways.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        Ok(ways)
    }

    /// Returns the space inside a vessel that a thing is to be put into; `None` where it is to stand on something.
    fn space_for(&self, o: &str, at: &Region) -> Option<Shape> {
        let Region::On(name) = at else { return None };
        let inside = self.cell.scene.object(name)?.inside()?;
        support::fits(self.cell.scene.object(o)?, &inside).then_some(inside)
    }

    /// Follows the way `up`, m, from where a thing is let go and the way back from there, from that of some joint positions and by
    /// that of [`SHORT`] which cost least of those for which both can be followed; out of a vessel all of the way up.
    fn up_and_back(
        &self,
        starts: &[Vec<f64>],
        down: &Pose<World, Tool>,
        up: Vector3<f64>,
        is_into: bool,
    ) -> Option<([Vec<Vec<f64>>; 2], f64)> {
        let back = -down.axis(2) * BACK;
        let both = |q_down: &Vec<f64>, short: f64| {
            let short_up = if is_into { up } else { up * short };
            let [up, back] =
                [short_up, back * short].map(|by| self.track(q_down, &straight(down, by)));
            Some(([up.ok()?, back.ok()?], short))
        };
        let mut best = None;
        let mut least = f64::INFINITY;
        for q_down in starts.iter().take(BRANCHES) {
            let travel = self.travel(q_down);
            if travel >= least {
                continue;
            }
            let way = SHORT.iter().find_map(|&short| both(q_down, short));
            let cost = |short: f64| travel + SHORT_COST * (1.0 - short);
            if let Some(way) = way.filter(|(_, short)| cost(*short) < least) {
                least = cost(way.1);
                best = Some(way);
            }
        }
        best
    }

    /// Returns places on, or in, a thing where nothing else stands, m: nearest to its middle first, or, where several find room,
    /// those first that leave the most of it.
    fn places_on(&self, o: &scene::Object, at: &str) -> Result<Vec<Vector3<f64>>, Why> {
        let scene = &self.cell.scene;
        let unseen = || Why::NotSeen(at.to_owned());
        let bears = scene.object(at).filter(|bears| bears.name != o.name).ok_or_else(unseen)?;
        let pose = self.state.object(at).and_then(|known| known.world_from_object);
        let pose = pose.ok_or_else(unseen)?;
        let radius = o.shape.outer_radius();
        let inside = bears.inside().filter(|inside| support::fits(o, inside));
        let space = inside.as_ref().unwrap_or(&bears.shape);
        // On its top, or on its floor.
        let round = if inside.is_some() { space.inner_radius() } else { space.rim_radius() };
        let sides = space.faces().map(|sides| sides.map(|side| 0.5 * side));
        let half = sides.unwrap_or([round * FRAC_1_SQRT_2; 2]);
        let spread = half.map(|half| (half - radius).max(0.0));
        let steps = spread.map(|spread| (spread / GRID).floor() as i32);
        // On what is hardly larger than the thing the middle is safest; a larger one is filled from its ends and corners, far
        // ones first.
        let is_wide = inside.is_none() && spread.iter().any(|spread| *spread >= radius);
        let base = scene.world_from_base.origin();
        let mut places = Vec::new();
        let mut taken: Option<String> = None;
        for ix in -steps[0]..=steps[0] {
            for iy in -steps[1]..=steps[1] {
                let (dx, dy) = (GRID * f64::from(ix), GRID * f64::from(iy));
                let spot = (pose * Point::<Object>::from(Vector3::new(dx, dy, 0.0))).coords();
                let from_above = Pose::upright(spot.x, spot.y, FAR_ABOVE, 0.0);
                let below = support::below(scene, &self.state.objects, o, &from_above);
                if below.name.as_deref() != Some(at) {
                    taken = taken.or(below.name);
                    continue;
                }
                let spot = Vector3::new(spot.x, spot.y, below.height);
                if let Some(other) = self.beside(o, at, spot, radius) {
                    taken = taken.or(Some(other));
                    continue;
                }
                let far = (spot - base).xy().norm();
                let rank = if is_wide { -far } else { dx.hypot(dy) };
                // Where there is room for a hand beside it, it can be taken again.
                let is_close = self.beside(o, at, spot, radius + CLOSE).is_some();
                places.push((is_close, rank, spot));
            }
        }
        if places.is_empty() {
            let by = taken.unwrap_or_else(|| at.to_owned());
            return Err(Why::Blocked { tried: 0, by });
        }
        // Another of its size would need so much from middle to middle.
        let next = if is_wide { radius + o.shape.inner_radius() + CLOSE } else { 0.0 };
        let costs = |spot: &Vector3<f64>| {
            places.iter().filter(|(.., other)| (other - spot).norm() < next).count()
        };
        let mut ranked: Vec<_> = places
            .iter()
            .map(|(is_close, rank, spot)| ((*is_close, costs(spot)), *rank, *spot))
            .collect();
        ranked.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        Ok(ranked.into_iter().map(|(.., place)| place).collect())
    }

    /// Returns free places in a region that relations bound, with so much room `beside` the thing, m: those that are well inside
    /// first, and of these the ones nearest to the hand, m.
    pub(super) fn places_in(
        &self,
        o: &scene::Object,
        region: &Region,
        beside: f64,
    ) -> Result<Vec<Vector3<f64>>, Why> {
        let (scene, objects) = (&self.cell.scene, &self.state.objects);
        let unseen = |lost: region::Unseen| Why::NotSeen(lost.0);
        let extent = region.extent(scene, objects, o).map_err(unseen)?;
        let bearer = region.bearer(scene, objects).map_err(unseen)?;
        let extent = extent.unwrap_or((scene.table.centre, scene.table.size.max()));
        let mut blocked = Why::Blocked { tried: 0, by: bearer.to_string() };
        for (grid, room) in ROOM {
            let room = (GRID * grid, beside * room, FROM_EDGE * room);
            match self.places_apart(o, region, &bearer, extent, room) {
                Err(why @ (Why::Blocked { .. } | Why::OffTable(_))) => blocked = why,
                found => return found,
            }
        }
        Err(blocked)
    }

    /// As [`Self::places_in`], so far apart and with so much room beside other things and to the edge of the table, m.
    fn places_apart(
        &self,
        o: &scene::Object,
        region: &Region,
        bearer: &Bearer,
        (middle, reach): ([f64; 2], f64),
        (grid, beside, from_edge): (f64, f64, f64),
    ) -> Result<Vec<Vector3<f64>>, Why> {
        let (scene, objects) = (&self.cell.scene, &self.state.objects);
        let unseen = |lost: region::Unseen| Why::NotSeen(lost.0);
        let hand = self.state.world_from_tool.origin();
        // At a point that somebody named, whether it goes there is for the ways to say.
        let room = match region {
            Region::Point(_) | Region::Spot { .. } => o.shape.inner_radius(),
            _ => o.shape.outer_radius() + beside,
        };
        let most = (reach / grid).ceil() as i32;
        let mut places = Vec::new();
        let mut taken: Option<String> = None;
        let mut is_off = false;
        for ix in -most..=most {
            for iy in -most..=most {
                let (x, y) = (middle[0] + grid * f64::from(ix), middle[1] + grid * f64::from(iy));
                let inside = region.margin(scene, objects, o, [x, y]).map_err(unseen)?;
                if inside < INSIDE {
                    continue;
                }
                let below = support::below(scene, objects, o, &Pose::upright(x, y, FAR_ABOVE, 0.0));
                let bears = below.name.clone().unwrap_or_else(|| TABLE.to_owned());
                let edge = o.shape.outer_radius() + from_edge;
                if *bearer != Bearer::Any && *bearer != Bearer::This(bears.clone()) {
                    taken = taken.or(below.name);
                    continue;
                }
                if bears == TABLE && !scene.table.holds(x, y, edge) {
                    is_off = true;
                    continue;
                }
                if bears == TABLE && !self.is_known(x, y, room) {
                    taken = taken.or(Some(UNKNOWN.to_owned()));
                    continue;
                }
                if let Some(other) = self.beside(o, &bears, Vector3::new(x, y, below.height), room)
                {
                    taken = taken.or(Some(other));
                    continue;
                }
                let far = (x - hand.x).hypot(y - hand.y);
                places.push((inside.min(WELL_INSIDE), far, Vector3::new(x, y, below.height)));
            }
        }
        if places.is_empty() && taken.is_none() && is_off {
            return Err(self.off_table(region, o.shape.outer_radius() + from_edge));
        }
        if places.is_empty() {
            let by = taken.unwrap_or_else(|| bearer.to_string());
            return Err(Why::Blocked { tried: 0, by });
        }
        places.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)));
        Ok(places.into_iter().map(|(.., place)| place).collect())
    }

    /// Says that what is to stand in a region, with its middle so far from the edge, m, would not stand on the table.
    pub(super) fn off_table(&self, region: &Region, edge: f64) -> Why {
        let [low, _, high, _] = self.cell.scene.table.corners();
        let at = match region {
            Region::Point(at) | Region::Spot { at, .. } => Some(*at),
            _ => None,
        };
        Why::OffTable(OffTable { at, table: [low, high], edge })
    }

    /// What a hand that sets `o` down in a vessel may not touch at the end either: the vessel's walls, and what stands beside
    /// it, as the case of a drawer does.
    fn beside_hand(&self, o: &str, vessel: &str) -> CollisionWorld<'_> {
        let mut world = self.obstacles_around(&[o, vessel], None, self.state.opening);
        world.remove(TABLE);
        world.ignore_itself();
        let object = self.cell.scene.object(vessel);
        let known = self.state.object(vessel).and_then(|state| state.world_from_object);
        if let (Some(object), Some(pose)) = (object, known) {
            let pose = self.cell.scene.world_from_base.inverse() * pose;
            for (solid, at) in hollow::sides(object, self.doubt) {
                world.add(&Obstacle::new(vessel, solid, pose.isometry() * at));
            }
        }
        world
    }

    /// Returns the arm among nothing, its jaws as they are.
    fn alone(&self) -> CollisionWorld<'_> {
        let mut world = CollisionWorld::new(self.robot());
        world.set_opening(self.state.opening);
        world
    }

    /// Whether nothing that the scene does not declare is nearer than `room` m to a point of the table.
    pub(super) fn is_known(&self, x: f64, y: f64, room: f64) -> bool {
        let gap = |other: &Unknown| (other.at[0] - x).hypot(other.at[1] - y) - other.radius;
        self.state.unknown.iter().all(|other| gap(other) > room)
    }

    /// Returns a thing whose side is nearer than `room` m to a place, so that `o` cannot stand there.
    pub(super) fn beside(
        &self,
        o: &scene::Object,
        bears: &str,
        place: Vector3<f64>,
        room: f64,
    ) -> Option<String> {
        let others = self.cell.scene.objects.iter();
        let mut others = others.filter(|other| other.name != o.name && other.name != bears);
        let near = others.find(|other| {
            let known = self.state.object(&other.name).and_then(|s| s.world_from_object);
            known.is_some_and(|known| {
                let at = Point::<World>::from(Vector3::new(place.x, place.y, known.origin().z));
                let at = (known.inverse() * at).coords();
                let is_level = known.origin().z + other.shape.height() > place.z;
                is_level && other.shape.beside(at.x, at.y) < room
            })
        });
        near.map(|other| other.name.clone())
    }
}
