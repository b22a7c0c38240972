//! Ways to push a thing along what it stands on, with the fingers as far open as they are, to a place.
//!
//! A push goes straight, square to a face of the thing, with the middle of the fingers on the line through its middle: then
//! it neither turns nor slips off (Lynch and Mason, "Stable pushing", IJRR 1996: a line of contact pushes stably while the
//! centre of friction stays before it). Where one straight push does not lead to the place, several do, round what is in the
//! way or from where the arm reaches it ([`super::ends`], [`super::roadmap`]). It is pushed at its mid height or lower. How far it slides on when
//! the hand stops is left out: 1 mm at the speed of a push.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use crate::world::frame::{Object, Tool, World};
use crate::world::region::{Bearer, TABLE, Unseen};
use crate::world::{self as scene, Pose, Region, Shape, support};

use super::super::wording;
use super::ends::Slides;
use super::follow::distance;
use super::grasp::side_pose;
use super::roadmap::Roadmap;
use super::{Dropped, FARTHEST_TOLD, NoWay, Planner, REACHING, TRACKING, Why, straight};

/// How far behind the thing the fingers come down, m. Chosen: a thing is seen to some millimetres and a hand is off by 8 to
/// 19 mm before it is calibrated (`docs/results.md`); with half of it a finger may come down on the thing, with twice as
/// much neighbours are struck that the push itself passes.
const STANDOFF: f64 = 0.03;
/// From how high they come down, and how high they leave, m. Chosen: above what is as high as a hand is long (62 mm from
/// the palm to the tips of a 2F-85); with half of it the palm comes from aside into what is pushed.
const ABOVE: f64 = 0.10;
/// Shares of [`ABOVE`] that are tried, most first, where the arm's reach ends.
const SHORT: [f64; 2] = [1.0, 0.5];
/// How far the fingers draw back before they rise, m: 2 cm more than a thing may lean on them.
const BACK: f64 = 0.03;
/// The lowest that fingertips are led over what the thing stands on, m. Chosen: a calibrated hand is off by 2 to 4 mm in
/// height (`docs/results.md`); with half of it it scrapes, with twice as much nothing lower than 32 mm is pushed low enough.
const LOWEST: f64 = 0.008;
/// Where along its height a thing is pushed when there is room below, and at most, as shares of it. Above its middle it would
/// tip; at it, a hand that points down has its palm over things twice as high as a finger is long.
const LOW: f64 = 0.25;
const MIDDLE: f64 = 0.5;
/// How far a hand points down, rad, in the order tried: straight down, where the flat of the fingers pushes and every
/// direction is alike; slanting by 45 and 30 deg, where the palm would touch what is higher than a finger
/// is long; nearly level, and level.
const PITCHES: [f64; 5] = [FRAC_PI_2, 0.25 * std::f64::consts::PI, 0.52, 0.35, 0.0];
/// Turns of a hand that points straight down from the way of the push, rad, in the order tried.
const AROUND: [f64; 4] = [0.0, std::f64::consts::PI, FRAC_PI_2, -FRAC_PI_2];
/// The same of a hand that slants: with its tips ahead, or with the side of a finger.
const SLANTED: [f64; 3] = [0.0, FRAC_PI_2, -FRAC_PI_2];
/// So much room is left between what the side of a finger pushes and the palm, and so much of the finger stays past the
/// line through its middle, m: as for grasping.
const PALM_ROOM: f64 = 0.005;
const PAST_MIDDLE: f64 = 0.008;
/// So many joint positions behind the thing are tried, nearest first: as many as for putting down.
const BRANCHES: usize = 4;
/// So many ways are enough: a run rehearses four.
const ENOUGH: usize = 5;
/// What a way costs for each rad that the joint that turns most goes, 1/rad, the unit, and for each stretch. Chosen: a second
/// stretch takes ten seconds, and the thing has turned a little after the first.
const TRAVEL_COST: f64 = 1.0;
const LEG_COST: f64 = 2.0;
/// Corners of the fingers this much less far ahead than the foremost touch as well, m.
const FLUSH: f64 = 1e-4;

/// So many stretches are asked about of the arm, and so many ways looked at, before a push is given up. Chosen: a stretch costs
/// some 50 ms, a look some 5 ms.
const MOST_ASKED: usize = 40;
const MOST_LOOKED: usize = 400;
/// Headings nearer than this are the same for whether a hand is reached, rad: at the end of a hand it is 5 mm.
const ALIKE: f64 = 0.02;

/// Whether a hand is reached at a point of a roadmap, for each heading in units of [`ALIKE`].
type Hands = BTreeMap<(usize, i32), bool>;
/// Joint positions in order, rad.
type JointPath = Vec<Vec<f64>>;

/// One straight push.
#[derive(Debug, Clone, PartialEq)]
pub struct Leg {
    /// What is pushed.
    pub object: String,
    /// Joint positions above and behind it, rad.
    pub before: Vec<f64>,
    /// Down behind it, rad.
    pub way_in: Vec<Vec<f64>>,
    /// Forward, rad: first to the thing, then with it.
    pub way: Vec<Vec<f64>>,
    /// Back from it and up, rad.
    pub way_out: Vec<Vec<f64>>,
    /// Where it stands afterwards.
    pub ends: Pose<World, Object>,
    /// How long the way is, m.
    pub length: f64,
}

/// One way to push a thing to a place.
#[derive(Debug, Clone, PartialEq)]
pub struct Push {
    /// The straight pushes, one after the other; none where it is there already.
    pub legs: Vec<Leg>,
    cost: f64,
}

/// A hand that pushes.
struct Hand {
    /// The tool, its origin at zero.
    turned: Pose<World, Tool>,
    /// How far ahead of the tool's origin the foremost corner of the fingers is, along the push, m.
    reach: f64,
    /// The lowest corner below the tool's origin, and the lowest foremost one above that, m.
    low: f64,
    touches: f64,
}

impl Planner {
    /// Returns ways to push `o` to a place in `at`, best first; one without a stretch where it is there already.
    ///
    /// # Errors
    ///
    /// [`NoWay`]: its place is unknown, it would topple or be lifted, no place is free, or none is reached.
    pub fn pushes(&self, o: &str, at: &Region) -> Result<Vec<Push>, NoWay> {
        let what = wording::to_push(o, at);
        let no = |why| NoWay { what: what.clone(), why };
        let object = self.cell.scene.object(o).ok_or_else(|| no(Why::NotSeen(o.to_owned())))?;
        let pose = self.pose(o, &what)?;
        let bears = support::below(&self.cell.scene, &self.state.objects, object, &pose);
        let on = bears.name.clone().unwrap_or_else(|| TABLE.to_owned());
        self.stands_pushes(object).map_err(no)?;
        self.stays_level(&on, at).map_err(no)?;
        if self.is_there(object, &pose, at).map_err(no)? {
            return Ok(vec![Push { legs: Vec::new(), cost: 0.0 }]);
        }
        let mut roadmap = self.roadmap(object, &pose, at, &on).map_err(no)?;
        let mut slides = Slides::new(self, object, pose, &on);
        let mut hands = Hands::default();
        let mut dropped = Dropped::new();
        let mut ways: Vec<Push> = Vec::new();
        let (mut asked, mut looked) = (0, 0);
        while ways.len() < ENOUGH
            && roadmap.has_ends()
            && asked < MOST_ASKED
            && looked < MOST_LOOKED
        {
            looked += 1;
            if !self.goes_on(REACHING, ways.len()).map_err(no)? {
                break;
            }
            let found = roadmap.way(&mut |a, b| slides.is_free(&roadmap, a, b));
            let Some(found) = found else { break };
            let far = self.first_out_of_reach(object, &pose, &roadmap, &found, &mut hands);
            if let Some((a, b)) = far.map_err(no)? {
                dropped.out_of_reach(FARTHEST_TOLD);
                roadmap.close(a, b);
                continue;
            }
            asked += 1;
            match self.push_by(object, &pose, &roadmap, &found, &mut dropped).map_err(no)? {
                Ok(way) => {
                    ways.push(way);
                    roadmap.ends_elsewhere(*found.last().unwrap_or(&0));
                }
                Err((a, b)) => roadmap.close(a, b),
            }
        }
        if ways.is_empty() {
            return Err(no(dropped.why()));
        }
        ways.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        Ok(ways)
    }

    /// Says no to what tips over before it slides: pushed at its middle it tips when that is higher than half of its width
    /// over the friction.
    fn stands_pushes(&self, object: &scene::Object) -> Result<(), Why> {
        let friction = self.cell.pads.table_friction;
        let most = 2.0 * object.shape.inner_radius() / friction.max(1e-6);
        let height = object.shape.height();
        if height > most { Err(Why::Topples { height, most, friction }) } else { Ok(()) }
    }

    /// Says no to a place on something else than what bears the thing.
    fn stays_level(&self, on: &str, at: &Region) -> Result<(), Why> {
        let unseen = |lost: Unseen| Why::NotSeen(lost.0);
        match at.bearer(&self.cell.scene, &self.state.objects).map_err(unseen)? {
            Bearer::This(bears) if bears != on => {
                Err(Why::Lifted { from: on.to_owned(), to: bears })
            }
            _ => Ok(()),
        }
    }

    /// Returns the way that pushes a thing over these points of a roadmap, or the stretch that does not go.
    fn push_by(
        &self,
        object: &scene::Object,
        pose: &Pose<World, Object>,
        roadmap: &Roadmap,
        points: &[usize],
        dropped: &mut Dropped,
    ) -> Result<Result<Push, (usize, usize)>, Why> {
        let mut legs: Vec<Leg> = Vec::new();
        let mut now = self.standing(object, *pose, self.q.clone());
        let mut cost = 0.0;
        for pair in points.windows(2) {
            let to = roadmap.point(pair[1]);
            let stands = legs.last().map_or(*pose, |leg| leg.ends);
            let ends = Pose::upright(to.x, to.y, stands.origin().z, stands.yaw());
            let Some(leg) = now.leg(object, &stands, ends, dropped)? else {
                return Ok(Err((pair[0], pair[1])));
            };
            cost += LEG_COST + TRAVEL_COST * distance(&leg.before, &now.q);
            let q = leg.way_out.last().unwrap_or(&leg.before).clone();
            now = now.standing(object, ends, q);
            legs.push(leg);
        }
        Ok(Ok(Push { legs, cost }))
    }

    /// Returns the first stretch at an end of which no hand that pushes along it is reached.
    fn first_out_of_reach(
        &self,
        object: &scene::Object,
        pose: &Pose<World, Object>,
        roadmap: &Roadmap,
        points: &[usize],
        hands: &mut Hands,
    ) -> Result<Option<(usize, usize)>, Why> {
        for pair in points.windows(2) {
            let by = roadmap.point(pair[1]) - roadmap.point(pair[0]);
            let heading = by.y.atan2(by.x);
            for k in pair {
                // Headings that a hand does not tell apart are asked about once.
                let key = (*k, (heading / ALIKE).round() as i32);
                let is_reached = if let Some(is_reached) = hands.get(&key) {
                    *is_reached
                } else {
                    let at = roadmap.point(*k);
                    let at = Pose::upright(at.x, at.y, pose.origin().z, pose.yaw());
                    let is_reached = self.is_reached(object, &at, heading)?;
                    hands.insert(key, is_reached);
                    is_reached
                };
                if !is_reached {
                    return Ok(Some((pair[0], pair[1])));
                }
            }
        }
        Ok(None)
    }

    /// Whether some hand could push a thing that stands so along a heading, as far as reach goes.
    fn is_reached(
        &self,
        object: &scene::Object,
        from: &Pose<World, Object>,
        heading: f64,
    ) -> Result<bool, Why> {
        for start in self.hands(object, from, heading) {
            self.goes_on(REACHING, 0)?;
            if self.reach(&start, &self.q).is_ok() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The same planner with a thing elsewhere, and the arm at `q`.
    fn standing(&self, object: &scene::Object, pose: Pose<World, Object>, q: Vec<f64>) -> Self {
        let mut state = self.state.clone();
        if let Some(known) = state.object_mut(&object.name) {
            known.world_from_object = Some(pose);
        }
        Self::new(self.cell.clone(), state, q, self.doubt, self.budget.clone())
    }

    /// Returns one straight push.
    fn leg(
        &self,
        object: &scene::Object,
        from: &Pose<World, Object>,
        ends: Pose<World, Object>,
        dropped: &mut Dropped,
    ) -> Result<Option<Leg>, Why> {
        let by = ends.origin() - from.origin();
        let way = Vector3::new(by.x, by.y, 0.0);
        let Some(ahead) = way.try_normalize(1e-9) else { return Ok(None) };
        for start in self.hands(object, from, ahead.y.atan2(ahead.x)) {
            let found = self.stretch(object, &start, &ahead, way.norm(), &ends, dropped)?;
            if found.is_some() {
                return Ok(found);
            }
        }
        Ok(None)
    }

    /// Returns where the tool begins to push a thing along a heading, rad, in the order in which hands are tried.
    fn hands(
        &self,
        object: &scene::Object,
        from: &Pose<World, Object>,
        heading: f64,
    ) -> Vec<Pose<World, Tool>> {
        let ahead = Vector3::new(heading.cos(), heading.sin(), 0.0);
        let half = half_along(&object.shape, from.yaw(), heading);
        let aside = half_along(&object.shape, from.yaw(), heading + FRAC_PI_2);
        let mut starts = Vec::new();
        // Low first; at its middle where the palm of a hand that points down would touch the top.
        for share in [LOW, MIDDLE] {
            for pitch in PITCHES {
                let is_down = pitch > FRAC_PI_2 - 1e-9;
                let turns = if is_down { &AROUND[..] } else { &SLANTED[..] };
                for &turn in turns {
                    let hand = self.pushing_hand(heading + turn, pitch, &ahead);
                    let is_side = !is_down && turn.abs() > 1e-9;
                    let back = if is_side { self.drawn_back(aside, pitch) } else { Some(0.0) };
                    let height = hand.height_for(object.shape.height(), share);
                    let (Some(back), Some(up)) = (back, height) else { continue };
                    let points = Vector3::new((heading + turn).cos(), (heading + turn).sin(), 0.0);
                    let tool =
                        from.origin() - ahead * (half + hand.reach + STANDOFF) - points * back
                            + Vector3::z() * (up - hand.low);
                    starts.push(Pose::from_parts(tool, hand.turned.rotation()));
                }
            }
        }
        starts
    }

    /// Returns how far a hand is drawn back that pushes with the side of a finger, so that what reaches so far aside, m, stays
    /// before its palm; `None` when the fingers are too short.
    fn drawn_back(&self, aside: f64, pitch: f64) -> Option<f64> {
        let (palm, tips) = (self.robot().palm()?, self.robot().fingers_ahead()?);
        let back = (aside + PALM_ROOM + palm.z * pitch.cos()).max(0.0);
        (back <= tips * pitch.cos() - PAST_MIDDLE).then_some(back)
    }

    /// Returns the hand that pushes along `ahead` with its fingers as far open as they are.
    fn pushing_hand(&self, heading: f64, pitch: f64, ahead: &Vector3<f64>) -> Hand {
        let turned = side_pose(Vector3::zeros(), heading, pitch);
        let corners: Vec<Vector3<f64>> = self.robot().finger_corners(self.state.opening);
        let corners = corners.into_iter().map(|corner| turned.rotation() * corner);
        let corners: Vec<Vector3<f64>> = corners.collect();
        let reach = corners.iter().map(|c| c.dot(ahead)).fold(f64::NEG_INFINITY, f64::max);
        let low = corners.iter().map(|c| c.z).fold(f64::INFINITY, f64::min);
        let foremost = corners.iter().filter(|c| c.dot(ahead) > reach - FLUSH);
        let touches = foremost.map(|c| c.z).fold(f64::INFINITY, f64::min) - low;
        Hand { turned, reach, low, touches }
    }

    /// Returns a push from where the hand stands behind the thing, if the arm can follow it and touches nothing else.
    fn stretch(
        &self,
        object: &scene::Object,
        start: &Pose<World, Tool>,
        ahead: &Vector3<f64>,
        length: f64,
        ends: &Pose<World, Object>,
        dropped: &mut Dropped,
    ) -> Result<Option<Leg>, Why> {
        let opening = self.state.opening;
        let mut before = self.obstacles(&[], opening);
        let beside = self.obstacles(&[&object.name], opening);
        let left = self.standing(object, *ends, self.q.clone());
        let mut after = left.obstacles(&[], opening);
        for jaw in self.robot().jaw_links() {
            before.ignore(jaw, &object.name);
            after.ignore(jaw, &object.name);
        }
        let forward = straight(start, ahead * (STANDOFF + length));
        let contact = (STANDOFF / (STANDOFF + length) * forward.len() as f64).ceil() as usize;
        let poses = (forward.len() + 60) as u64;
        self.goes_on(REACHING + (TRACKING + before.cost()) * poses, 0)?;
        let starts = match self.reach(start, &self.q) {
            Ok(starts) => starts,
            Err(why) => {
                dropped.missed(why);
                return Ok(None);
            }
        };
        for q in starts.iter().take(BRANCHES) {
            dropped.tried += 1;
            let Ok(way) = self.track(q, &forward) else {
                dropped.out_of_reach(0.0);
                continue;
            };
            let Some((way_in, way_out)) = self.in_and_out(q, start, &way, &forward, ahead) else {
                dropped.out_of_reach(0.0);
                continue;
            };
            let is_clear = Self::clear(&before, &way_in, dropped).is_some()
                && Self::clear(&before, &way[..=contact.min(way.len() - 1)], dropped).is_some()
                && Self::clear(&beside, &way, dropped).is_some()
                && Self::clear(&after, &way_out, dropped).is_some();
            if !is_clear {
                continue;
            }
            if ![&way_in, &way, &way_out].into_iter().all(|path| self.passes(path)) {
                dropped.out_of_reach(0.0);
                continue;
            }
            return Ok(Some(Leg {
                object: object.name.clone(),
                before: way_in[0].clone(),
                way_in,
                way,
                way_out,
                ends: *ends,
                length: STANDOFF + length,
            }));
        }
        Ok(None)
    }

    /// Returns the way down to where a push begins, and the way back and up from where it ends.
    fn in_and_out(
        &self,
        q: &[f64],
        start: &Pose<World, Tool>,
        way: &[Vec<f64>],
        forward: &[Pose<World, Tool>],
        ahead: &Vector3<f64>,
    ) -> Option<(JointPath, JointPath)> {
        let up = |share: f64| Vector3::z() * (ABOVE * share);
        let mut way_in =
            SHORT.iter().find_map(|share| self.track(q, &straight(start, up(*share))).ok())?;
        way_in.reverse();
        let (last, at) = (way.last()?, forward.last()?);
        let back = straight(at, -ahead * BACK);
        let behind = back.last()?;
        let way_out = SHORT.iter().find_map(|share| {
            let out: Vec<_> = back.iter().copied().chain(straight(behind, up(*share))).collect();
            self.track(last, &out).ok()
        })?;
        Some((way_in, way_out))
    }
}

impl Hand {
    /// Returns how high its lowest corner is led over what bears a thing so high, m, to touch it at a share of that; `None` when
    /// the thing is too flat.
    fn height_for(&self, height: f64, share: f64) -> Option<f64> {
        let most = MIDDLE * height - self.touches;
        (most >= LOWEST).then(|| (share * height - self.touches).clamp(LOWEST, most))
    }
}

/// Returns how far a thing reaches from its middle in a direction, both rad in the world, m.
fn half_along(shape: &Shape, yaw: f64, heading: f64) -> f64 {
    let turn = heading - yaw;
    let along = |[x, y]: [f64; 2]| 0.5 * (x * turn.cos().abs() + y * turn.sin().abs());
    shape.faces().map_or(shape.outer_radius(), along)
}
