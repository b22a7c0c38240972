//! Ways to take the handle of a drawer such that the arm can draw it straight to both ends of its way.

use std::f64::consts::PI;

use nalgebra::Vector3;

use crate::world::frame::{Object, Tool, World};
use crate::world::{self as scene, Drawer, Point, Pose};

use super::super::wording;
use super::follow::distance;
use super::grasp::{Grasp, side_pose};
use super::grip;
use super::{Dropped, NoWay, Planner, REACHING, STRAIGHT_STEP, TRACKING, Why, straight};

/// How far before the bar the hand stops first, m: as far as before any thing (`STANDOFF` of grasps), from 57 mm on the tips are
/// before it.
const BEFORE: f64 = 0.11;
/// How far behind the bar the point between the fingers is, m: of tips that reach 32 mm past it, 22 mm are past the bar, and
/// 23 mm are left to the front (`drawer::REACH`).
const BEHIND: f64 = 0.010;
/// Turns of the hand from straight towards the front that are tried, rad: the bar is round.
const TURNS: [f64; 5] = [0.0, 0.2, -0.2, 0.4, -0.4];
/// So many joint positions of each are tried, nearest first. Chosen as for grasps.
const BRANCHES: usize = 24;
/// So many ways are enough: a run rehearses four.
const ENOUGH: usize = 6;

impl Planner {
    /// Returns ways to take the handle of a drawer with the tool pitched down by `pitch` rad, best first.
    ///
    /// # Errors
    ///
    /// [`NoWay`] when nobody knows where tray and case are, or no hand reaches the bar and both ends of the rail.
    pub(super) fn handles(&self, drawer: &Drawer, pitch: f64) -> Result<Vec<Grasp>, NoWay> {
        let what = wording::to_handle(&drawer.tray);
        let no = |why| NoWay { what: what.clone(), why };
        let unseen = |name: &str| no(Why::NotSeen(name.to_owned()));
        let tray = self.cell.scene.object(&drawer.tray).ok_or_else(|| unseen(&drawer.tray))?;
        let pose = self.pose(&drawer.tray, &what)?;
        let drawn = drawer.drawn_in(&self.cell.scene, &self.state);
        let drawn = drawn.ok_or_else(|| unseen(&drawer.case))?;
        let grip = (pose * Point::<Object>::from(drawer.grip(tray))).coords();
        let out = pose.axis(0);
        let ends = [drawer.travel - drawn, -drawn].map(|way| out * way);
        let (stroke, least) = (self.robot().max_opening(), self.robot().min_opening());
        let [(_, bar), ..] = drawer.handle(tray);
        if let Some(width) = grip::narrowest(&bar).filter(|width| *width <= least) {
            return Err(no(Why::TooNarrow { width, opening: least }));
        }
        let world = self.obstacles(&[], stroke);
        let mut dropped = Dropped::new();
        let mut ways: Vec<Grasp> = Vec::new();
        'looking: for turn in TURNS {
            let heading = pose.yaw() + PI + turn;
            let middle = side_pose(grip, heading, pitch);
            let at: Pose<World, Tool> =
                Pose::from_parts(grip - middle.axis(2) * BEHIND, middle.rotation());
            if !self.goes_on(REACHING, ways.len()).map_err(no)? {
                break;
            }
            let starts = match self.reach(&at, &self.q) {
                Ok(starts) => starts,
                Err(why) => {
                    dropped.missed(why);
                    continue;
                }
            };
            for q in starts.iter().take(BRANCHES) {
                let poses = (BEFORE + drawer.travel) / STRAIGHT_STEP;
                let work = (TRACKING + world.cost()) * poses.round() as u64;
                if !self.goes_on(work, ways.len()).map_err(no)? {
                    break 'looking;
                }
                dropped.tried += 1;
                let Some(way_in) = self.handle_way(q, &at, &ends, &world, &mut dropped) else {
                    continue;
                };
                let clearance = Self::clear(&world, &way_in, &mut dropped).unwrap_or_default();
                let cost = distance(&way_in[0], &self.q) + turn.abs() + self.strain(q);
                let before = way_in[0].clone();
                let object = drawer.tray.clone();
                ways.push(Grasp { object, before, way_in, heading, clearance, pitch, cost });
                break;
            }
            if ways.len() >= ENOUGH {
                break;
            }
        }
        if ways.is_empty() {
            return Err(no(dropped.why()));
        }
        ways.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        Ok(ways)
    }

    /// Returns the way in to a handle, if it is free and the arm can follow both ways along the rail from its end.
    fn handle_way(
        &self,
        q: &[f64],
        at: &Pose<World, Tool>,
        ends: &[Vector3<f64>; 2],
        world: &crate::motion::collision::CollisionWorld<'_>,
        dropped: &mut Dropped,
    ) -> Option<Vec<Vec<f64>>> {
        let tracked = |by: Vector3<f64>| self.track(q, &straight(at, by)).ok();
        let rails: Option<Vec<_>> = ends.iter().map(|by| tracked(*by)).collect();
        // At both ends the hand must come off the bar again.
        let off = rails.as_ref().is_some_and(|rails| {
            rails.iter().zip(ends).all(|(rail, by)| {
                let end = Pose::from_parts(at.origin() + by, at.rotation());
                let last = rail.last().map_or(q, |last| last);
                self.track(last, &straight(&end, -at.axis(2) * BEFORE)).is_ok()
            })
        });
        let Some(mut way) = tracked(-at.axis(2) * BEFORE).filter(|_| off) else {
            dropped.out_of_reach(0.0);
            return None;
        };
        way.reverse();
        Self::clear(world, &way, dropped)?;
        if rails.iter().flatten().chain([&way]).all(|path| self.passes(path)) {
            Some(way)
        } else {
            dropped.out_of_reach(0.0);
            None
        }
    }

    /// What of a drawer is in the way beside the box of its tray: the bar and its posts, with their places in the tray's frame.
    pub(super) fn bars(
        &self,
        tray: &scene::Object,
    ) -> Vec<(nalgebra::Isometry3<f64>, scene::Shape)> {
        let drawer = self.cell.scene.drawer(&tray.name);
        let parts = drawer.map(|drawer| drawer.handle(tray));
        parts.into_iter().flatten().map(|(at, shape)| (at.into(), shape)).collect()
    }
}
