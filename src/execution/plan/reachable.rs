//! Whether the arm gets at a thing at all: poses of the hand at it and above it, none of them a way yet.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::Vector3;

use crate::trace::NoWay;

use super::grip::SHARES_UP;
use super::{Dropped, Planner, REACHING, side_pose};

/// How high over its base an object must be reached to count as reachable: low as for taking it, as a share of its height (the
/// first share at which it is grasped), and by a level hand also high as for pouring over it, m above its top. Chosen: a
/// source that is held at 0.6 of 14 cm over a rim with 5 cm of room has the hand 13 cm above it. With half of it a
/// source would have to be held near its base; with twice as much what a low source can fill is called out of reach.
const TAKEN_AT: f64 = SHARES_UP[0];
const POURED_OVER: f64 = 0.12;
/// Directions from which a hand is tried to reach: 45 deg apart. Chosen: joint 7 and joint 1 are continuous, and what
/// is reached from one direction is so from those some 40 deg beside it; four leave gaps, sixteen cost twice as much.
const REACHED_FROM: i32 = 8;
/// An object whose size nobody knows is taken to be this high, m: what a cup is. Objects of the scene have a size, so
/// that it matters to none of them.
const UNKNOWN_HEIGHT: f64 = 0.1;

impl Planner {
    /// Returns whether the arm can get at an object: at its `side` with a level hand, between its fingers or over it when it is
    /// too wide, at its `top` with a hand that points down; either of them where no face is named.
    ///
    /// # Errors
    ///
    /// How far out of reach it is, or what else keeps the hand from it.
    pub fn reachable(&self, o: &str, face: Option<&str>) -> Result<(), NoWay> {
        let what = format!("to reach `{o}`");
        let no = |why| NoWay { what: what.clone(), why };
        let origin = self.pose(o, &what)?.origin();
        let shape = self.cell.scene.object(o).map(|object| &object.shape);
        let height = shape.map_or(UNKNOWN_HEIGHT, crate::world::Shape::height);
        let level = [TAKEN_AT * height, height + POURED_OVER].map(|up| (up, 0.0));
        let lowest = self.lowest(FRAC_PI_2, origin.z);
        let down = [((TAKEN_AT * height).max(lowest), FRAC_PI_2)];
        let level = level.into_iter().filter(|_| face != Some("top"));
        let down = down.into_iter().filter(|_| face != Some("side"));
        let mut dropped = Dropped::new();
        for (up, pitch) in level.chain(down) {
            for turn in 0..REACHED_FROM {
                let heading =
                    self.bearing(&origin) + f64::from(turn) * TAU / f64::from(REACHED_FROM);
                let pose = side_pose(origin + Vector3::z() * up, heading, pitch);
                self.goes_on(REACHING, 0).map_err(no)?;
                match self.reach(&pose, &self.q) {
                    Ok(_) => return Ok(()),
                    Err(why) => dropped.missed(why),
                }
            }
        }
        Err(no(dropped.missed_least()))
    }
}
