//! Ways to take an object between the fingers from the side.

use nalgebra::{Matrix3, Rotation2, Rotation3, Vector3};

use crate::world::frame::{Object, Tool, World};
use crate::world::{self as scene, Point, Pose, Shape, support};

use super::super::wording;
use super::follow::distance;
use super::grip;
use super::{Dropped, NoWay, Planner, REACHING, STRAIGHT_STEP, TRACKING, Why, straight};

/// How far before the object the hand stops first, m. A 2F-85's fingertips reach 32 mm past the tool point (the jaws'
/// boxes in `gen3_2f85.urdf`), and the nearest side of an object is at most 25 mm before it (30 mm to the palm, less
/// [`PALM_ROOM`]): from 57 mm on the tips are before the object (a Panda's from 42 mm on: 9.5 and 32 mm), and 53 mm are
/// left for an arm that is beside where it was sent. With half of it the hand would come from aside into the object; with twice as much the way in to most
/// places on the table begins at less than 0.5 m from the base, where joint 4 ends (2.57 rad) for a level hand.
const STANDOFF: f64 = 0.11;
/// Room left on each side when the fingers slide along the object, m. Chosen: with half of it an object that is seen
/// a few millimetres beside its place (a real tube by 1.6 to 5.1 mm, `docs/results.md`) is pushed over; with twice as
/// much nothing wider than 69 mm is taken by fingers that open 85 mm.
const ROOM: f64 = 0.004;
/// As many ways are kept. Chosen: a run rehearses four candidates (`CANDIDATES` in `workcell::attempt`). With half as
/// many there is none left for another attempt when ways fail for one reason; with twice as many the timing of ways
/// that nobody rehearses costs as much again.
const KEPT: usize = 8;
/// How much is left between the table and the palm of a level hand, m: a 2F-85, whose box reaches 37.5 mm below the
/// tool point, takes an object no lower than 55 mm. Chosen between: with none of it the hand would be on the table, at
/// 55 mm more it would be over whatever is lower than 110 mm.
const UNDER_PALM: f64 = 0.0175;
/// A hand that points down more steeply than this, rad, is lowest at its fingertips; so much is left between them and
/// what the thing stands on, m.
const STEEP: f64 = std::f64::consts::FRAC_PI_4;
const UNDER_TIPS: f64 = 0.005;
/// So many joint positions of one hand pose are tried, nearest first. Chosen: there are up to eight for each of the 25
/// values of joint 3 that are looked at, neighbours nearly alike. With half as many a branch that is farther from where
/// the arm is may not be reached; twice as many cost more than the next heading, which differs more.
const BRANCHES: usize = 24;
/// How far up from the grasp the arm must be able to follow, m. Chosen: most of what `lift` goes when nothing else is
/// said (12 cm, and 9 cm are its promise, `stdlib/tasks/std.task`). Half of it lets ways pass that fail in the lift;
/// twice as much drops ways that a shorter lift would take.
pub(super) const LIFT: f64 = 0.10;
/// What a way costs for each rad the joint that turns most has to go to its beginning, 1/rad: the unit of the others.
const TRAVEL_COST: f64 = 1.0;
/// What a way costs that touches, and the clearance at which that has fallen to half, m: at 1 cm as much as 0.15 rad
/// of [`TRAVEL_COST`]. Chosen: room beyond some centimetres is worth nothing on the way in. With half of both a way
/// that grazes is as good as one that is 10 deg shorter; with twice as much the arm goes a long way round for room
/// that it does not need.
const TOUCHING_COST: f64 = 0.3;
const ROOMY: f64 = 0.01;
/// What [`Planner::strain`] costs: a joint at the end of its range as much as 1 rad of [`TRAVEL_COST`]. Chosen: with
/// half of it ways begin from joints that the tilt of a pour drives into their ends, with twice as much the arm swings
/// round to avoid an end that nothing drives it into.
const STRAIN_COST: f64 = 1.0;
/// Room left between palm and object, m. Chosen: more than the 4 mm of [`ROOM`], since along the hand's own direction
/// an object that is nearer than seen is pushed away; with half of it that happens, with twice as much nothing deeper
/// than 84 mm is taken, now 94 mm.
const PALM_ROOM: f64 = 0.005;
/// How much higher and lower than the palm an object's point may be and still count as before it, m. Chosen: as much
/// as an object may be held deeper or higher than seen; none would let a lip strike the palm's edge, twice as much
/// draws back from what passes below the hand.
const BESIDE_PALM: f64 = 0.01;
/// How far the hand is drawn back at most, m. With half of it things deeper than 72 mm are refused by a 2F-85; with
/// twice as much what has flat sides is held by its last centimetre.
const MOST_BACK: f64 = 0.022;
/// So much of the fingers stays past the middle of a round object, m, or it slips out. With it a 2F-85, whose tips are
/// 32 mm ahead of the tool point, is drawn back by no more than [`MOST_BACK`], and a Panda's, 9.5 mm ahead, not at all.
const PAST_MIDDLE: f64 = 0.010;
/// Points around a round object for the distance to the palm: at 24 a point is at most 7.5 deg from the nearest one,
/// and for a radius of 42 mm the distance is overestimated by 0.4 mm (`r (1 - cos 7.5 deg)`), a tenth of the room.
const AROUND: usize = 24;
/// How much nearer to the end of its range a joint is when it is felt: the power of the share of half of the range.
/// At 8 a joint that is at 0.92 of it has half of the strain of one at its end, and at 0.5 a 256th of it. Chosen: at
/// 4 the middle of the range counts as well, at 16 only the last twentieth.
const STRAIN_POWER: i32 = 8;
/// Headings nearer than this are the same, rad: a quarter of what the 16 headings round a cylinder are apart.
const SAME_HEADING: f64 = 0.1;
/// So many ways of one heading are kept. Chosen: of [`KEPT`] that leaves room for three headings; with one a heading
/// has no second branch when the first is refused, with six nothing else is left to choose from.
const ALIKE: usize = 3;
/// One way to take an object.
#[derive(Debug, Clone, PartialEq)]
pub struct Grasp {
    /// The object.
    pub object: String,
    /// Joint positions before the object, rad.
    pub before: Vec<f64>,
    /// From there to between the fingers, rad.
    pub way_in: Vec<Vec<f64>>,
    /// Direction of approach seen from above, rad in the world.
    pub heading: f64,
    /// Smallest distance to anything on the way in, m.
    pub clearance: f64,
    /// How far the hand points down, rad.
    pub pitch: f64,
    /// What the ways are sorted by; less is better.
    pub(super) cost: f64,
}

impl Grasp {
    /// Returns the face of the object that the hand is before: `side` or `top`.
    pub fn face(&self) -> &'static str {
        if self.pitch < STEEP { "side" } else { "top" }
    }
}

impl Planner {
    /// Returns from which direction the sides of an object are counted, rad: round things are taken from the same sides of the table
    /// however they are turned, and by an arm that has no choice from where it stands.
    fn turned_from(&self, object: &scene::Object, pose: &Pose<World, Object>) -> f64 {
        if object.shape.symmetry() > 0.0 {
            pose.yaw()
        } else if self.robot().n_joints() < 6 {
            self.bearing(&pose.origin())
        } else {
            0.0
        }
    }

    /// Returns ways to take `o` with the tool pitched down by `pitch` rad, best first.
    ///
    /// # Errors
    ///
    /// [`NoWay`] with the distance out of reach, the width that does not fit, or what is in the way.
    pub fn grasps(&self, o: &str, pitch: f64) -> Result<Vec<Grasp>, NoWay> {
        if let Some(drawer) = self.cell.scene.drawer(o) {
            return self.handles(drawer, pitch);
        }
        let what = wording::to_grasp(o);
        let no = |why| NoWay { what: what.clone(), why };
        let object = self.cell.scene.object(o).ok_or_else(|| no(Why::NotSeen(o.to_owned())))?;
        let pose = self.pose(o, &what)?;
        let [least, stroke] = [self.robot().min_opening(), self.robot().max_opening()];
        let (fits, closes_on) = (|width| width + 2.0 * ROOM <= stroke, |width| width > least);
        let width = grip::narrowest(&object.shape).ok_or_else(|| no(Why::NoSides))?;
        if !fits(width) {
            return Err(no(Why::TooWide { width, opening: stroke }));
        }

        // The jaws are meant to come close to the object, the palm is not.
        let within = support::below(&self.cell.scene, &self.state.objects, object, &pose).name;
        let mut world = self.obstacles_around(&[], within.as_deref(), stroke);
        for jaw in self.robot().jaw_links() {
            world.ignore(jaw, o);
        }
        let (mut dropped, mut ways): (_, Vec<Lifted>) = (Dropped::new(), Vec::new());
        let mut short = Short { grips: 0, by: f64::INFINITY };
        let lowest = self.lowest(pitch, pose.origin().z);
        let ahead = self.robot().fingers_ahead().unwrap_or(0.0);
        // Above the middle, where there is room for the wrist below and the lip stays free.
        'looking: for share in grip::shares_up(&object.shape) {
            let height = (share * object.shape.height()).max(lowest);
            let grips = grip::at_height(&object.shape, height, pitch, ahead);
            let widths = || grips.iter().map(|grip| grip.width);
            dropped.too_wide(widths().filter(|width| !fits(*width)));
            dropped.too_narrow(widths().filter(|width| !closes_on(*width)));
            for grip in grips.iter().filter(|grip| fits(grip.width) && closes_on(grip.width)) {
                let yaw = self.turned_from(object, &pose);
                let heading = yaw + grip.heading;
                let aside = Rotation2::new(yaw) * grip.middle;
                let middle = pose.origin() + Vector3::new(aside.x, aside.y, height);
                let middle = side_pose(middle, heading, pitch);
                let Some(at) = self.clear_of_palm(&middle, o, &mut short) else {
                    dropped.tried += 1;
                    dropped.touches(self.palm_link(), o);
                    continue;
                };
                let back = -at.axis(2) * STANDOFF;
                if !self.goes_on(REACHING, ways.len()).map_err(no)? {
                    break 'looking;
                }
                let solutions = match self.reach(&at, &self.q) {
                    Ok(solutions) => solutions,
                    Err(why) => {
                        dropped.missed(why);
                        continue;
                    }
                };
                for q_at in solutions.iter().take(BRANCHES) {
                    let way_in = STANDOFF / STRAIGHT_STEP;
                    let lift = LIFT / STRAIGHT_STEP;
                    let line = TRACKING * (way_in + lift).round() as u64
                        + world.cost() * way_in.round() as u64;
                    if !self.goes_on(line, ways.len()).map_err(no)? {
                        break 'looking;
                    }
                    dropped.tried += 1;
                    let Ok(mut way) = self.track(q_at, &straight(&at, back)) else {
                        dropped.out_of_reach(0.0);
                        continue;
                    };
                    way.reverse();
                    let Some(clearance) = Self::clear(&world, &way, &mut dropped) else { continue };
                    let lift = Vector3::z() * LIFT;
                    let Ok(lift) = self.track(q_at, &straight(&at, lift)) else {
                        dropped.out_of_reach(0.0);
                        continue;
                    };
                    let travel = distance(&way[0], &self.q);
                    let cost = TRAVEL_COST * travel
                        + TOUCHING_COST / (clearance + ROOMY) * ROOMY
                        + STRAIN_COST * self.strain(q_at);
                    let grasp = Grasp {
                        object: o.to_owned(),
                        before: way[0].clone(),
                        way_in: way,
                        heading,
                        clearance,
                        pitch,
                        cost,
                    };
                    ways.push((grasp, lift));
                }
            }
            if ways.len() >= KEPT {
                break;
            }
        }
        ways.sort_by(|(a, _), (b, _)| a.cost.total_cmp(&b.cost));
        // Timing a way costs more than finding it, so only those that are kept are timed.
        let passes = |(grasp, lift): &Lifted| self.passes(&grasp.way_in) && self.passes(lift);
        if !ways.is_empty() {
            dropped.out_of_reach(0.0);
        }
        let kept = spread(ways, &passes);
        if kept.is_empty() {
            return Err(NoWay { what, why: short.why(dropped, [least, stroke]) });
        }
        Ok(kept)
    }

    /// Returns the lowest that the tool may be over the foot of a thing, which is `foot` m over the table, with the hand pitched down
    /// by `pitch` rad, m. The palm of a level hand is over the table; fingertips from above are over what the thing stands on.
    pub(super) fn lowest(&self, pitch: f64, foot: f64) -> f64 {
        let robot = self.robot();
        if pitch < STEEP {
            robot.palm().map_or(0.0, |palm| palm.half_height) + UNDER_PALM - foot
        } else {
            robot.fingers_ahead().unwrap_or(0.0) + UNDER_TIPS - foot.min(0.0)
        }
    }

    /// Returns the name of the link that has the palm, or that carries the jaws where none has a face.
    fn palm_link(&self) -> &str {
        let robot = self.robot();
        let link = robot.palm().map(|palm| palm.link).or_else(|| robot.hand());
        link.map_or("", |link| &robot.links()[link].name)
    }

    /// Draws a grasp back until the palm stays clear of the object; `None` when the fingers are too short.
    fn clear_of_palm(
        &self,
        at: &Pose<World, Tool>,
        o: &str,
        short: &mut Short,
    ) -> Option<Pose<World, Tool>> {
        let object = self.cell.scene.object(o)?;
        let pose = self.state.object(o)?.world_from_object?;
        let palm = self.robot().palm()?;
        // The nearest point of the object to the palm, along the tool's z, among what lies before it.
        let corners = object
            .shape
            .outline(AROUND)
            .into_iter()
            .map(|corner| (at.inverse() * (pose * Point::<Object>::from(corner))).coords());
        let nearest = corners
            .filter(|p| p.y.abs() <= palm.half_height + BESIDE_PALM)
            .map(|p| p.z)
            .fold(f64::INFINITY, f64::min);
        let back = (palm.z + PALM_ROOM - nearest).max(0.0);
        let most = match object.shape {
            Shape::Cuboid { .. } => MOST_BACK,
            // A mesh may be held by a corner as well as by a face.
            Shape::Cylinder { .. }
            | Shape::Lathe { .. }
            | Shape::Mesh { .. }
            | Shape::Mug { .. } => {
                (self.robot().fingers_ahead()? - PAST_MIDDLE).clamp(0.0, MOST_BACK)
            }
        };
        if back > most {
            *short = Short { grips: short.grips + 1, by: short.by.min(back - most) };
            return None;
        }
        Some(Pose::from_parts(at.origin() - at.axis(2) * back, at.rotation()))
    }

    /// Returns how close the joints are to the ends of their ranges, 0 in the middle.
    pub(super) fn strain(&self, q: &[f64]) -> f64 {
        let limits = self.robot().joints();
        q.iter()
            .zip(limits)
            .filter(|(_, limit)| limit.lower.is_finite() && limit.upper.is_finite())
            .map(|(q, limit)| {
                let half = 0.5 * (limit.upper - limit.lower);
                let middle = 0.5 * (limit.upper + limit.lower);
                ((q - middle) / half).abs().powi(STRAIN_POWER)
            })
            .sum()
    }
}

/// Grips for which the fingers are too short: the palm is against the object before they reach far enough round it.
struct Short {
    /// How many there are.
    grips: usize,
    /// The least by which the fingers are too short, m.
    by: f64,
}

impl Short {
    /// Returns why there is no way between fingers with the least and the greatest of `openings`, m. Where a thing is in its own way
    /// alone, nobody can move that away: the fingers are too short for it, or do not get where they are long enough.
    fn why(&self, mut dropped: Dropped, openings: [f64; 2]) -> Why {
        if self.by.is_finite() && self.grips == dropped.blocked.values().sum::<usize>() {
            if dropped.is_nowhere_short() {
                return Why::FingersShort { by: self.by };
            }
            dropped.blocked.clear();
        }
        dropped.why_no_grip(openings)
    }
}

/// A grasp and the way up from it, rad.
type Lifted = (Grasp, Vec<Vec<f64>>);

/// Keeps the best ways that pass, at most [`ALIKE`] of the same heading so that there is something to choose from.
fn spread(ways: Vec<Lifted>, passes: &dyn Fn(&Lifted) -> bool) -> Vec<Grasp> {
    let mut kept: Vec<Grasp> = Vec::new();
    for way in ways {
        let alike =
            kept.iter().filter(|k| (k.heading - way.0.heading).abs() < SAME_HEADING).count();
        if alike < ALIKE && kept.len() < KEPT && passes(&way) {
            kept.push(way.0);
        }
    }
    kept
}

/// Returns the tool pose at `at` m that points along `heading` rad, `pitch` rad down, its jaws opening
/// level and the arm's own camera on top.
pub fn side_pose(at: Vector3<f64>, heading: f64, pitch: f64) -> Pose<World, Tool> {
    let ahead = Vector3::new(heading.cos(), heading.sin(), 0.0);
    let z = (ahead * pitch.cos() - Vector3::z() * pitch.sin()).normalize();
    let x = Vector3::z().cross(&ahead);
    let y = z.cross(&x);
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, z]));
    Pose::from_parts(at, rotation.into())
}
