//! Ways to pour: a place for the lip above the cup, and the joints' way of turning the jar about it.
//!
//! The lip stays still while the jar turns about it (`R(θ) = Rot(n, θ) R0`, `p(θ) = P - R(θ) l`), so the
//! water leaves from one known point; whether it lands in the cup is for the twin to say.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use nalgebra::{UnitQuaternion, UnitVector3, Vector3};

use crate::twin::hold::Hold;
use crate::world::frame::{self, Tool, World};
use crate::world::{Object, Pose, Scene, Shape};

use super::super::wording;
use super::follow::distance;
use super::{Dropped, NoWay, Planner, REACHING, TRACKING, Why, brim};

/// How far the jar is turned: past level, so that the last film runs out, rad. The twin's water is out of a jar at 92
/// to 100 deg, a weir model leaves a tenth of it at 100 deg and 10 deg/s (compared before this file was written).
/// Chosen beyond that: at half of it nearly nothing is poured, at 100 deg the film stays, and at twice it the vessel
/// would be led past upside down.
const TURN: f64 = 115.0 * PI / 180.0;
/// One joint position every so many rad of the turn. A tool that holds a jar at 0.6 of its 14 cm is 65 mm from
/// the lip and moves 2.3 mm between two of them. [`Pour::share_holding`] interpolates what a vessel holds linearly: in
/// that jar it is wrong by 0.1 mL at most (`V'' step² / 8`), with twice as much by 0.4 mL, half of the smallest sip;
/// with half of it a way costs twice as much to find and to check.
const STEP: f64 = 2.0 * PI / 180.0;
/// As many ways are kept. Chosen: a run rehearses four candidates (`CANDIDATES` in `workcell::attempt`). With half as
/// many there is none left for another attempt, with twice as many the timing of ways that nobody rehearses costs as
/// much again.
const KEPT: usize = 8;
/// Twice as many are looked for: the limits refuse some when they are timed. Chosen: with one time as many, fewer than
/// [`KEPT`] would be left when one is refused; four times as many cost as much again and are hardly ever needed.
const SOUGHT: usize = 2 * KEPT;
/// The hand's headings relative to the direction from the base to the cup: so many, a 36th of a turn apart, up to 60
/// deg to either side. Chosen: twice as far aside the hand would point back to the base, where it does not reach;
/// half as far one thing beside the cup may hide all. Half as far apart the search costs twice as much and neighbours
/// touch the same things.
const HEADINGS: i32 = 13;
const HEADINGS_ROUND: f64 = 36.0;
/// How far before the middle of the cup the lip is, m. The lip is clearance and height of the source above the rim:
/// 19 cm for the jar and 5 cm of room, 0.20 s of fall, in which water that leaves with 0.15 or 0.23 m/s comes so far.
/// Chosen: with half of it a stream of 0.46 m/s lands past the far wall of a cup of 80 mm radius (now 0.61 m/s), with
/// twice as much what drips slowly falls before its near wall.
const BEFORE_MIDDLE: [f64; 2] = [0.030, 0.045];
/// How far inside the rim the lip stays, m: 5 mm that `above` asks for, and as much again for a hand that is off by some
/// millimetres. Only a narrow cup makes it less than [`BEFORE_MIDDLE`].
const INSIDE_RIM: f64 = 0.012;
/// So many joint positions with the lip in place are tried, nearest first. Chosen: half of a grasp's, since a turn of
/// 58 poses is followed from each and not a line of 22. With half of it the branch that can turn so far may be
/// missed, with twice as much a lip costs more than the next one, which may be easier.
const BRANCHES: usize = 12;
/// What each rad that the joint that turns most has to go costs, 1/rad: the unit of the sum, which has no dimension.
const TRAVEL_COST: f64 = 1.0;
/// What a rad of the hand's heading beside the direction to the cup costs, 1/rad. Chosen: as much as travel, since
/// joint 1 turns by as much. With half of it a hand aside is taken for a slightly shorter way, with twice as much a way
/// of 60 deg more for a hand that is 30 deg nearer to ahead.
const HEADING_COST: f64 = 1.0;
/// What a metre of [`BEFORE_MIDDLE`] costs, 1/m. Chosen: the two places differ by 0.015, which only decides between
/// ways that are equal otherwise. Half or twice as much decide otherwise only between ways whose sums are within
/// 0.03.
const BEFORE_COST: f64 = 1.0;

/// One way to pour.
#[derive(Debug, Clone, PartialEq)]
pub struct Pour {
    /// What is poured from.
    pub source: String,
    /// What is poured into.
    pub target: String,
    /// Joint positions with the jar upright and its lip in place, rad.
    pub start: Vec<f64>,
    /// The turn, rad.
    pub turn: Vec<Vec<f64>>,
    /// Where the lip is, m in the world.
    pub lip: [f64; 3],
    /// Smallest distance to anything during the turn, m.
    pub clearance: f64,
    /// How much the source still holds at each point of the turn, m³.
    pub holds: Vec<f64>,
    /// How water leaves the source; `None` of a thing that holds none.
    hold: Option<Hold>,
    /// What the ways are sorted by; less is better.
    cost: f64,
}

impl Pour {
    /// Returns the share of the turn at which the source, filled to its lip, holds so much, m³.
    pub fn share_holding(&self, volume: f64) -> f64 {
        let last = self.holds.len().saturating_sub(1).max(1);
        // The vessel holds less and less on its way.
        let next = self.holds.partition_point(|holds| *holds > volume).clamp(1, last);
        let (before, after) = (self.holds[next - 1], self.holds[next]);
        let part = if before > after { (before - volume) / (before - after) } else { 0.0 };
        (((next - 1) as f64 + part) / last as f64).clamp(0.0, 1.0)
    }

    /// Returns how much still stands above the lip at a share of the turn, m³, when water leaves at a rate, m³/s: what
    /// will run on if the hand holds still.
    pub fn runs_on(&self, share: f64, rate: f64) -> f64 {
        let turned = self.turn.len().saturating_sub(1) as f64 * STEP;
        let tilt = share.clamp(0.0, 1.0) * turned;
        self.hold.as_ref().map_or(0.0, |hold| hold.above_at(tilt, rate.max(0.0)))
    }
}

impl Planner {
    /// Returns ways to pour from `source`, which is in the hand, into `target`, best first.
    ///
    /// `clearance` is the room between the rim of the target and the base of the upright source, m.
    ///
    /// # Errors
    ///
    /// [`NoWay`] when the hand is empty or over the source's opening, a place is unknown, or no way is reachable and free.
    pub fn pours(&self, source: &str, target: &str, clearance: f64) -> Result<Vec<Pour>, NoWay> {
        let what = wording::to_pour(source, target);
        let no = |why| NoWay { what: what.clone(), why };
        let tool_from_object = self.held_aside(source).map_err(no)?;
        let scene = &self.cell.scene;
        let shape = |name: &str| scene.object(name).map(|object| &object.shape);
        let source_shape = shape(source).ok_or_else(|| no(Why::NotSeen(source.to_owned())))?;
        let target_shape = shape(target).ok_or_else(|| no(Why::NotSeen(target.to_owned())))?;
        let cup = self.pose(target, &what)?;
        let inside = space(scene, source, source_shape);
        let opening = space(scene, target, target_shape);
        let hold = scene.object(source).and_then(Hold::of);
        let most = (opening.rim_radius() - INSIDE_RIM).max(0.0);
        let mut before_middle = BEFORE_MIDDLE.map(|back| back.min(most)).to_vec();
        before_middle.dedup();

        let world = self.obstacles(&[], self.state.opening);
        let mut dropped = Dropped::new();
        let mut ways: Vec<Pour> = Vec::new();
        let away = self.bearing(&cup.origin());
        let object_from_tool = tool_from_object.inverse();
        // The hand's heading relative to the direction from the base to the cup, small turns first.
        'looking: for i in 0..HEADINGS {
            let turn = f64::from((i + 1) / 2) * (if i % 2 == 0 { 1.0 } else { -1.0 }) * TAU
                / HEADINGS_ROUND;
            let heading = away + turn;
            for side in [1.0, -1.0] {
                // The jar leans to the hand's left or right: it turns about the hand's own axis.
                let axis = Vector3::new(heading.cos(), heading.sin(), 0.0) * side;
                let lean = axis.cross(&Vector3::z());
                for &back in &before_middle {
                    let lip = cup.origin() - lean * back
                        + Vector3::z()
                            * (target_shape.height() + clearance + source_shape.height());
                    let upright =
                        upright_under(source_shape, &tool_from_object, heading, lip, lean);
                    let poses: Vec<_> = (0..=(TURN / STEP).round() as usize)
                        .map(|k| about(&upright, lip, axis, k as f64 * STEP) * object_from_tool)
                        .collect();
                    let toward = upright.inverse().rotation() * lean;
                    let holds: Vec<f64> = (0..poses.len())
                        .map(|k| brim::signed_volume(&inside, &toward, k as f64 * STEP))
                        .collect();
                    if !self.goes_on(REACHING, ways.len()).map_err(no)? {
                        break 'looking;
                    }
                    let solutions = match self.reach(&poses[0], &self.q) {
                        Ok(solutions) => solutions,
                        Err(why) => {
                            dropped.missed(why);
                            continue;
                        }
                    };
                    for start in solutions.iter().take(BRANCHES) {
                        let work = (TRACKING + world.cost()) * poses.len() as u64;
                        if !self.goes_on(work, ways.len()).map_err(no)? {
                            break 'looking;
                        }
                        dropped.tried += 1;
                        let path = match self.track(start, &poses[1..]) {
                            Ok(path) => path,
                            Err(nearest) => {
                                dropped.out_of_reach(nearest);
                                continue;
                            }
                        };
                        let Some(clearance) = Self::clear(&world, &path, &mut dropped) else {
                            continue;
                        };
                        let cost = TRAVEL_COST * distance(start, &self.q)
                            + HEADING_COST * turn.abs()
                            + BEFORE_COST * back;
                        ways.push(Pour {
                            source: source.to_owned(),
                            target: target.to_owned(),
                            start: start.clone(),
                            turn: path,
                            lip: lip.into(),
                            holds: holds.clone(),
                            hold: hold.clone(),
                            clearance,
                            cost,
                        });
                        // One branch of the arm a lip is enough; the next lip may have another.
                        break;
                    }
                }
            }
            if ways.len() >= SOUGHT {
                break;
            }
        }
        ways.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        if !ways.is_empty() {
            dropped.out_of_reach(0.0);
        }
        // Timing a way costs more than finding it, so only those that are kept are timed.
        let passing = ways.into_iter().filter(|way| self.passes(&way.turn));
        let kept: Vec<Pour> = passing.take(KEPT).collect();
        if kept.is_empty() {
            return Err(no(dropped.why_not_over(target)));
        }
        Ok(kept)
    }
}

impl Planner {
    /// Returns how `source` lies in a hand that holds it by its side.
    fn held_aside(&self, source: &str) -> Result<Pose<Tool, frame::Object>, Why> {
        let held = self.in_hand().filter(|(held, _)| held == source);
        let (_, tool_from_object) = held.ok_or(Why::EmptyHand)?;
        // Along the thing's own axis the hand would point down.
        let is_over = -tool_from_object.inverse().axis(2).z > FRAC_1_SQRT_2;
        if is_over { Err(Why::OverOpening) } else { Ok(tool_from_object) }
    }
}

/// Returns the upright pose of the held object whose lip, on the side of `lean`, is at `lip`, with
/// the hand heading along `heading`.
fn upright_under(
    shape: &Shape,
    tool_from_object: &Pose<Tool, frame::Object>,
    heading: f64,
    lip: Vector3<f64>,
    lean: Vector3<f64>,
) -> Pose<World, frame::Object> {
    // Seen from the object, the hand comes along this direction.
    let ahead = tool_from_object.inverse().axis(2);
    let yaw = heading - ahead.y.atan2(ahead.x);
    let turned: Pose<World, frame::Object> = Pose::upright(0.0, 0.0, 0.0, yaw);
    let reach = rim_reach(shape, &(turned.inverse().rotation() * lean));
    let base = lip - lean * reach - Vector3::z() * shape.height();
    Pose::from_parts(base, turned.rotation())
}

/// Returns what is inside a thing, or its shape where nothing is.
fn space(scene: &Scene, name: &str, shape: &Shape) -> Shape {
    scene.object(name).and_then(Object::inside).unwrap_or_else(|| shape.clone())
}

/// Returns how far the rim reaches from the axis in a level direction of the object's frame, m.
fn rim_reach(shape: &Shape, direction: &Vector3<f64>) -> f64 {
    let along = |half: f64, share: f64| if share > 1e-9 { half / share } else { f64::MAX };
    let (x, y) = (direction.x.abs(), direction.y.abs());
    let straight = |[a, b]: [f64; 2]| along(0.5 * a, x).min(along(0.5 * b, y));
    shape.faces().map_or(shape.rim_radius(), straight)
}

/// Turns a pose about the point `lip` by `angle` rad round the level unit vector `axis`.
fn about(
    pose: &Pose<World, frame::Object>,
    lip: Vector3<f64>,
    axis: Vector3<f64>,
    angle: f64,
) -> Pose<World, frame::Object> {
    let turn = UnitQuaternion::from_axis_angle(&UnitVector3::new_normalize(axis), angle);
    Pose::from_parts(lip + turn * (pose.origin() - lip), turn * pose.rotation())
}
