//! Ways to work with a tool: round in a vessel's water with what is in the hand, over a thing's top with closed fingers.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::Vector3;

use crate::world::frame::{Object, Tool, World};
use crate::world::{self as scene, Pose};

use super::super::wording;
use super::follow::distance;
use super::grasp::side_pose;
use super::{Dropped, NoWay, Planner, REACHING, TRACKING, Why, straight};

/// How many times round, and how far apart the poses on the way are, rad.
const ROUNDS: f64 = 3.0;
const ROUND_STEP: f64 = 10.0 * PI / 180.0;
/// The circle is as large as the vessel lets it with so much room at its wall, and no larger than so, m. Chosen: the room as
/// for fingers beside a thing, twice over, since vessel and tool are both seen; more than 3 cm moves the arm and stirs no more.
const WALL: f64 = 0.01;
const LARGEST: f64 = 0.03;
/// A smaller circle stirs nothing, m.
const SMALLEST: f64 = 0.008;
/// The tip is led so far over the floor of the vessel, and so far below the water's surface at least, m.
const OVER_FLOOR: f64 = 0.006;
const BELOW: f64 = 0.012;
/// How far over the rim the tip is brought first, m.
const OVER_RIM: f64 = 0.03;
/// Heights of the tip between the two that are tried, lowest first, m apart.
const DEEPER: f64 = 0.01;
/// Turns of the hand that are tried, rad: as for putting down, and round.
const TURNS: [f64; 9] = [0.0, 0.35, -0.35, 0.7, -0.7, 1.4, -1.4, 2.1, -2.1];
/// So many joint positions are tried of each.
const BRANCHES: usize = 4;
/// The same of a stroke, along which a hand that points straight down is near the ends of some joint's range: as of a pour.
const STROKE_BRANCHES: usize = 12;
/// Turns of the hand from the way of a stroke, rad: broad across it, and narrow.
const HANDS: [f64; 4] = [0.0, PI, FRAC_PI_2, -FRAC_PI_2];
/// The middle of what touches stays so far inside the top, m: a calibrated hand is off by 2 to 4 mm, and one that comes down beside
/// the top feels nothing. Half of a finger, which straight fingers keep by themselves.
const ON_TOP: f64 = 0.010;
/// How far a hand that wipes points down, rad: straight, else slanting by 15 and 30 deg, which brings the wrist nearer to the arm
/// by 4 and 8 cm of a hand of 16 cm. Chosen: farther down the palm comes near to what is wiped.
const PITCHES: [f64; 3] = [FRAC_PI_2, 75.0 * PI / 180.0, 60.0 * PI / 180.0];
/// What of the fingers is this much higher than their lowest corner touches with it, m: pads give way.
const FLAT: f64 = 0.002;
/// So many ways are enough: a run rehearses four.
const ENOUGH: usize = 4;
/// Strokes lie so much nearer to each other than a tool is wide, m: its place is known to some millimetres.
const OVERLAP: f64 = 0.006;
/// A stroke begins so far above what is wiped, m: more than a calibrated hand is off in height (2 to 4 mm).
const HOVER: f64 = 0.008;

/// One way to stir.
#[derive(Debug, Clone, PartialEq)]
pub struct Stir {
    /// Joint positions over the vessel, rad.
    pub above: Vec<f64>,
    /// Down into the water, rad.
    pub way_in: Vec<Vec<f64>>,
    /// Round and round, rad.
    pub round: Vec<Vec<f64>>,
    cost: f64,
}

/// One stroke over a top.
#[derive(Debug, Clone, PartialEq)]
pub struct Stroke {
    /// Joint positions above its beginning, rad.
    pub before: Vec<f64>,
    /// Along it where the top is thought to be, rad.
    pub along: Vec<Vec<f64>>,
    /// Up from its end, rad.
    pub way_out: Vec<Vec<f64>>,
}

/// One way to wipe.
#[derive(Debug, Clone, PartialEq)]
pub struct Wipe {
    /// Its strokes in order.
    pub strokes: Vec<Stroke>,
    /// From where a stroke begins down to where the top is thought to be, m.
    pub hover: f64,
}

impl Planner {
    /// Returns ways to stir the water of a vessel with `tool`, which is in the hand, best first.
    ///
    /// # Errors
    ///
    /// [`NoWay`] when the hand is empty, a place or the water is unknown, the water is too shallow, or no way is free.
    pub fn stirs(&self, tool: &str, vessel: &str) -> Result<Vec<Stir>, NoWay> {
        let what = wording::to_stir(vessel, tool);
        let no = |why| NoWay { what: what.clone(), why };
        let held = self.in_hand().filter(|(held, _)| held == tool);
        let (_, tool_from_object) = held.ok_or_else(|| no(Why::EmptyHand))?;
        let scene = &self.cell.scene;
        let object = scene.object(tool).ok_or_else(|| no(Why::EmptyHand))?;
        let around = scene.object(vessel).ok_or_else(|| no(Why::NotSeen(vessel.to_owned())))?;
        let stands = self.pose(vessel, &what)?;
        let water = self.state.object(vessel).and_then(|known| known.water).unwrap_or(0.0);
        let (radius, heights) = swirl(object, around, water).map_err(no)?;
        let world = self.obstacles_around(&[], Some(vessel), self.state.opening);
        let object_from_tool = tool_from_object.inverse();
        let ahead = object_from_tool.axis(2);
        let middle = stands.origin();
        let heading = self.bearing(&middle);
        let mut dropped = Dropped::new();
        let mut ways: Vec<Stir> = Vec::new();
        'looking: for up in heights {
            for turn in TURNS {
                let yaw = heading + turn - ahead.y.atan2(ahead.x);
                let at = |x: f64, y: f64, z: f64| {
                    let tip: Pose<World, Object> =
                        Pose::upright(middle.x + x, middle.y + y, middle.z + z, yaw);
                    tip * object_from_tool
                };
                let rise = around.shape.height() + OVER_RIM - up;
                let poses = round(radius).map(|(x, y)| at(x, y, up)).collect::<Vec<_>>();
                let work = REACHING + (TRACKING + world.cost()) * (poses.len() as u64 + 30);
                if !self.goes_on(work, ways.len()).map_err(no)? {
                    break 'looking;
                }
                let start = at(0.0, 0.0, up);
                let starts = match self.reach(&start, &self.q) {
                    Ok(starts) => starts,
                    Err(why) => {
                        dropped.missed(why);
                        continue;
                    }
                };
                for q in starts.iter().take(BRANCHES) {
                    dropped.tried += 1;
                    let both = self.track(q, &straight(&start, Vector3::z() * rise)).ok();
                    let Some((mut way_in, round)) = both.zip(self.track(q, &poses).ok()) else {
                        dropped.out_of_reach(0.0);
                        continue;
                    };
                    way_in.reverse();
                    if Self::clear(&world, &way_in, &mut dropped).is_none()
                        || Self::clear(&world, &round, &mut dropped).is_none()
                    {
                        continue;
                    }
                    if !self.passes(&way_in) || !self.passes(&round) {
                        dropped.out_of_reach(0.0);
                        continue;
                    }
                    let cost = distance(&way_in[0], &self.q);
                    ways.push(Stir { above: way_in[0].clone(), way_in, round, cost });
                    break;
                }
                if ways.len() >= ENOUGH {
                    break 'looking;
                }
            }
        }
        if ways.is_empty() {
            return Err(no(dropped.why()));
        }
        ways.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        Ok(ways)
    }

    /// Returns joint positions that hold out what is in the hand, upright, where it is handed over, nearest first.
    ///
    /// # Errors
    ///
    /// [`NoWay`] when the hand is empty, or the place is out of reach or blocked.
    pub fn handings(&self, o: &str) -> Result<Vec<Vec<f64>>, NoWay> {
        let what = wording::to_hand_over(o);
        let no = |why| NoWay { what: what.clone(), why };
        let held = self.in_hand().filter(|(held, _)| held == o);
        let (_, tool_from_object) = held.ok_or_else(|| no(Why::EmptyHand))?;
        let object_from_tool = tool_from_object.inverse();
        let at = self.cell.scene.handing();
        let heading = self.bearing(&at);
        let ahead = object_from_tool.axis(2);
        let world = self.obstacles(&[], self.state.opening);
        let mut dropped = Dropped::new();
        let mut found: Vec<Vec<f64>> = Vec::new();
        for turn in TURNS {
            let yaw = heading + turn - ahead.y.atan2(ahead.x);
            let turned: Pose<World, Object> = Pose::upright(0.0, 0.0, 0.0, yaw);
            let tool = turned * object_from_tool;
            let tool = Pose::from_parts(at, tool.rotation());
            if !self.goes_on(REACHING, found.len()).map_err(no)? {
                break;
            }
            match self.reach(&tool, &self.q) {
                Err(why) => dropped.missed(why),
                Ok(starts) => {
                    for q in starts.into_iter().take(BRANCHES) {
                        dropped.tried += 1;
                        if Self::clear(&world, std::slice::from_ref(&q), &mut dropped).is_some() {
                            found.push(q);
                        }
                    }
                }
            }
            if found.len() >= ENOUGH {
                break;
            }
        }
        if found.is_empty() {
            return Err(no(dropped.why()));
        }
        found.sort_by(|a, b| distance(a, &self.q).total_cmp(&distance(b, &self.q)));
        Ok(found)
    }

    /// Returns ways to wipe the top of a thing with closed fingers: pointing straight down, or, where the arm does not get there
    /// so, slanting along the strokes.
    ///
    /// # Errors
    ///
    /// [`NoWay`] when its place is unknown, or a part of it is out of reach or blocked.
    pub fn wipes(&self, o: &str) -> Result<Vec<Wipe>, NoWay> {
        let what = wording::to_wipe(o);
        let no = |why| NoWay { what: what.clone(), why };
        let object = self.cell.scene.object(o).ok_or_else(|| no(Why::NotSeen(o.to_owned())))?;
        let stands = self.pose(o, &what)?;
        // What a square inside the circle leaves over is less than a fifth on each side.
        let round = [1.8 * object.shape.rim_radius(); 2];
        let [x, y] = object.shape.faces().unwrap_or(round);
        let top = stands.origin() + Vector3::z() * object.shape.height();
        let mut world = self.obstacles(&[], self.state.opening);
        self.let_jaws_touch(&mut world, None);
        let mut dropped = Dropped::new();
        let mut ways = Vec::new();
        // Few long strokes first, and of these those of the hand that is broad across them.
        let sides = if x >= y {
            [(x, y, 0.0), (y, x, FRAC_PI_2)]
        } else {
            [(y, x, FRAC_PI_2), (x, y, 0.0)]
        };
        for pitch in PITCHES {
            // The tips of a hand that slants touch along one line, which sweeps what it is led across.
            let hands = if pitch < FRAC_PI_2 { &HANDS[..2] } else { &HANDS[..] };
            for ((long, wide, turn), hand) in
                sides.into_iter().flat_map(|side| hands.iter().map(move |hand| (side, hand)))
            {
                let yaw = stands.yaw() + turn;
                let turned = side_pose(Vector3::zeros(), yaw + hand, pitch);
                let forward = Vector3::new(yaw.cos(), yaw.sin(), 0.0);
                let aside = Vector3::z().cross(&forward);
                let foot = self.foot(&turned);
                let [near, far] = ends_along(&foot, &forward);
                let [left, right] = ends_along(&foot, &aside);
                let low = ends_along(&foot, &Vector3::z())[0];
                let strokes = rows(wide, right - left).into_iter().enumerate().map(|(k, row)| {
                    let middle = 0.5 * (near + far);
                    let half = (0.5 * long - (0.5 * (far - near)).max(ON_TOP)).max(0.0);
                    let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                    let (from, to) = (-half * sign - middle, half * sign - middle);
                    let begin = top + aside * (row - 0.5 * (left + right)) + forward * from
                        - Vector3::z() * low;
                    let begin = Pose::from_parts(begin, turned.rotation());
                    self.stroke(&begin, forward * (to - from), &world, &mut dropped).transpose()
                });
                let strokes: Option<Result<Vec<Stroke>, Why>> = strokes.collect();
                if let Some(strokes) = strokes.transpose().map_err(no)? {
                    ways.push(Wipe { strokes, hover: HOVER });
                }
                if ways.len() >= ENOUGH {
                    return Ok(ways);
                }
            }
            if !ways.is_empty() {
                return Ok(ways);
            }
        }
        Err(no(dropped.why()))
    }

    /// Returns corners of what of the fingers touches a level top, from the tool, for a hand turned so, m.
    fn foot(&self, turned: &Pose<World, Tool>) -> Vec<Vector3<f64>> {
        let corners = self.robot().finger_corners(self.state.opening).into_iter();
        lowest(&corners.map(|corner| turned.rotation() * corner).collect::<Vec<_>>())
    }

    /// Returns one stroke from where it touches first.
    fn stroke(
        &self,
        begin: &Pose<World, Tool>,
        by: Vector3<f64>,
        world: &crate::motion::collision::CollisionWorld<'_>,
        dropped: &mut Dropped,
    ) -> Result<Option<Stroke>, Why> {
        let poses = straight(begin, by);
        self.goes_on(REACHING + (TRACKING + world.cost()) * (poses.len() as u64 + 10), 0)?;
        let starts = match self.reach(begin, &self.q) {
            Ok(starts) => starts,
            Err(why) => {
                dropped.missed(why);
                return Ok(None);
            }
        };
        for q in starts.iter().take(STROKE_BRANCHES) {
            dropped.tried += 1;
            let rise = |q: &[f64], from| self.track(q, &straight(from, Vector3::z() * HOVER)).ok();
            let up = rise(q, begin);
            let along = self.track(q, &poses).ok();
            let out = along.as_ref().and_then(|along| rise(along.last()?, poses.last()?));
            let (Some(up), Some(along), Some(way_out)) = (up, along, out) else {
                dropped.out_of_reach(0.0);
                continue;
            };
            let paths = [&along, &up, &way_out];
            if paths.into_iter().any(|path| Self::clear(world, path, dropped).is_none()) {
                continue;
            }
            if let Some(before) = up.last().filter(|_| self.passes(&along)) {
                return Ok(Some(Stroke { before: before.clone(), along, way_out }));
            }
            dropped.out_of_reach(0.0);
        }
        Ok(None)
    }
}

/// Returns what of a body with these corners touches a level plane that it stands on: of what reaches less than [`FLAT`] above its
/// lowest point the corners, m.
pub(in crate::execution) fn lowest(corners: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let low = corners.iter().map(|corner| corner.z).fold(f64::INFINITY, f64::min);
    let (below, above): (Vec<_>, Vec<_>) =
        corners.iter().copied().partition(|corner| corner.z < low + FLAT);
    let cuts = below.iter().flat_map(|a: &Vector3<f64>| {
        above.iter().map(move |b| a + (b - a) * ((low + FLAT - a.z) / (b.z - a.z)))
    });
    // What stands on its foot has upright sides, which add nothing to it.
    cuts.chain(below.iter().copied()).collect()
}

/// Returns the least and the most of points along a direction, m.
fn ends_along(points: &[Vector3<f64>], way: &Vector3<f64>) -> [f64; 2] {
    let along = points.iter().map(|point| point.dot(way));
    along.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], x| [least.min(x), most.max(x)])
}

/// Returns the circle that a tip is led on, m, and the heights over the base of the vessel at which it may be, lowest first.
fn swirl(tool: &scene::Object, vessel: &scene::Object, water: f64) -> Result<(f64, Vec<f64>), Why> {
    let shallow = |depth: f64| Why::Shallow { depth, least: OVER_FLOOR + BELOW };
    let inside = vessel.inside().ok_or_else(|| shallow(0.0))?;
    let radius = (inside.inner_radius() - tool.shape.outer_radius() - WALL).min(LARGEST);
    if radius < SMALLEST {
        return Err(Why::Blocked { tried: 0, by: vessel.name.clone() });
    }
    let depth = water * inside.height() / inside.volume();
    if depth < OVER_FLOOR + BELOW {
        return Err(shallow(depth));
    }
    let floor = vessel.shape.height() - inside.height();
    let steps = ((depth - OVER_FLOOR - BELOW) / DEEPER).floor() as usize;
    let heights = (0..=steps).map(|k| floor + OVER_FLOOR + DEEPER * k as f64).collect();
    Ok((radius, heights))
}

/// The way from the middle out, round, and back to the middle, m.
fn round(radius: f64) -> impl Iterator<Item = (f64, f64)> {
    let out = (1..=4).map(move |k| (radius * f64::from(k) / 4.0, 0.0));
    let steps = (ROUNDS * TAU / ROUND_STEP).round() as usize;
    let circle = (1..=steps).map(move |k| {
        let angle = k as f64 * ROUND_STEP;
        (radius * angle.cos(), radius * angle.sin())
    });
    let back = (0..4).map(move |k| (radius * f64::from(3 - k) / 4.0, 0.0));
    out.chain(circle).chain(back)
}

/// Where strokes of a tool so wide lie beside the middle of what is so wide, m.
fn rows(wide: f64, tool: f64) -> Vec<f64> {
    let room = (wide - tool).max(0.0);
    let n = (room / (tool - OVERLAP).max(1e-3)).ceil() as usize;
    (0..=n).map(|k| -0.5 * room + room * k as f64 / n.max(1) as f64).collect()
}
