//! Ways to take an object between the fingers from the side.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::world::frame::{Object, Tool, World};
use crate::world::{Point, Pose, Shape};

use super::{Dropped, NoWay, Planner, REACHING, TRACKING, Why, straight};

/// How far before the object the hand stops first, m.
const STANDOFF: f64 = 0.11;
/// Room left on each side when the fingers slide along the object, m.
const ROOM: f64 = 0.004;
/// As many ways are kept.
const KEPT: usize = 8;

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
    /// What the ways are sorted by; less is better.
    cost: f64,
}

impl Planner {
    /// Returns ways to take `o` with the tool pitched down by `pitch` rad, best first.
    ///
    /// # Errors
    ///
    /// [`NoWay`] with the distance out of reach, the width that does not fit, or what is in the way.
    pub fn grasps(&self, o: &str, pitch: f64) -> Result<Vec<Grasp>, NoWay> {
        let what = format!("to grasp `{o}`");
        let no = |why| NoWay { what: what.clone(), why };
        let object = self.cell.scene.object(o).ok_or_else(|| no(Why::NotSeen(o.to_owned())))?;
        let pose = self.pose(o, &what)?;
        let stroke = self.robot().max_opening();
        let headings = headings(&object.shape, pose.yaw(), stroke)
            .map_err(|width| no(Why::TooWide { width, opening: stroke }))?;

        // The jaws are meant to come close to the object, the palm is not.
        let mut world = self.obstacles(&[], stroke);
        for jaw in self.robot().jaw_links() {
            world.ignore(jaw, o);
        }
        let mut dropped = Dropped::new();
        let mut ways: Vec<Lifted> = Vec::new();
        // Above the middle, where there is room for the wrist below and the lip stays free.
        'looking: for share in [0.60, 0.52, 0.68] {
            let height = (share * object.shape.height()).max(0.055);
            for &heading in &headings {
                let middle = side_pose(pose.origin() + Vector3::z() * height, heading, pitch);
                let Some(at) = self.clear_of_palm(&middle, o) else { continue };
                let back = -at.axis(2) * STANDOFF;
                if !self.goes_on(REACHING, ways.len()).map_err(no)? {
                    break 'looking;
                }
                let solutions = match self.reach(&at, &self.q) {
                    Ok(solutions) => solutions,
                    Err(nearest) => {
                        dropped.out_of_reach(nearest);
                        continue;
                    }
                };
                for q_at in solutions.iter().take(24) {
                    let line = TRACKING * 42 + world.cost() * 22;
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
                    let lift = Vector3::z() * 0.10;
                    let Ok(lift) = self.track(q_at, &straight(&at, lift)) else {
                        dropped.out_of_reach(0.0);
                        continue;
                    };
                    let travel = distance(&way[0], &self.q);
                    let cost = travel + 0.3 / (clearance + 0.01) * 0.01 + self.strain(q_at);
                    let grasp = Grasp {
                        object: o.to_owned(),
                        before: way[0].clone(),
                        way_in: way,
                        heading,
                        clearance,
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
            return Err(NoWay { what, why: dropped.why() });
        }
        Ok(kept)
    }

    /// Draws a grasp back until the palm stays clear of the object; `None` when the fingers are too short.
    fn clear_of_palm(&self, at: &Pose<World, Tool>, o: &str) -> Option<Pose<World, Tool>> {
        /// Room left between palm and object, m.
        const ROOM: f64 = 0.005;
        let object = self.cell.scene.object(o)?;
        let pose = self.state.object(o)?.world_from_object?;
        let palm = self.robot().palm()?;
        // The nearest point of the object to the palm, along the tool's z, among what lies before it.
        let corners = object
            .shape
            .outline(24)
            .into_iter()
            .map(|corner| (at.inverse() * (pose * Point::<Object>::from(corner))).coords());
        let nearest = corners
            .filter(|p| p.y.abs() <= palm.half_height + 0.01)
            .map(|p| p.z)
            .fold(f64::INFINITY, f64::min);
        let back = (palm.z + ROOM - nearest).max(0.0);
        // Less than this much finger along the object does not hold it, m.
        (back <= 0.022).then(|| Pose::from_parts(at.origin() - at.axis(2) * back, at.rotation()))
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
                ((q - middle) / half).abs().powi(8)
            })
            .sum()
    }
}

/// A grasp and the way up from it, rad.
type Lifted = (Grasp, Vec<Vec<f64>>);

/// Keeps the best ways that pass, at most three of the same heading so that there is something to choose from.
fn spread(ways: Vec<Lifted>, passes: &dyn Fn(&Lifted) -> bool) -> Vec<Grasp> {
    let mut kept: Vec<Grasp> = Vec::new();
    for way in ways {
        let alike = kept.iter().filter(|k| (k.heading - way.0.heading).abs() < 0.1).count();
        if alike < 3 && kept.len() < KEPT && passes(&way) {
            kept.push(way.0);
        }
    }
    kept
}

/// Returns the largest change of a joint between two positions, rad.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Returns the directions, rad in the world, along which the fingers can slide past an object.
///
/// # Errors
///
/// The narrowest width, m, when none fits.
fn headings(shape: &Shape, yaw: f64, stroke: f64) -> Result<Vec<f64>, f64> {
    let fits = |width: f64| width + 2.0 * ROOM <= stroke;
    match *shape {
        Shape::Cuboid { size } => {
            // Moving along the object's x the fingers close on its y faces, and the other way round.
            let faces = [(0.0, size.y), (FRAC_PI_2, size.x)];
            let found: Vec<f64> = faces
                .iter()
                .filter(|(_, width)| fits(*width))
                .flat_map(|(turn, _)| [yaw + turn, yaw + turn + std::f64::consts::PI])
                .collect();
            if found.is_empty() { Err(size.x.min(size.y)) } else { Ok(found) }
        }
        Shape::Cylinder { radius, .. } if fits(2.0 * radius) => {
            Ok((0..16).map(|i| f64::from(i) * TAU / 16.0).collect())
        }
        Shape::Cylinder { radius, .. } => Err(2.0 * radius),
    }
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
