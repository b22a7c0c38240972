//! Where a thing that is pushed may come to, and the straight stretches that lead there.
//!
//! One stretch square to a face where that will do, else two square to each other, else more round what is in the way. What
//! the arm reaches is for [`super::push`] to say.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Vector2, Vector3};

use crate::world::frame::{Object, World};
use crate::world::region::Unseen;
use crate::world::{self as scene, Pose, Region};

use super::detour::detour;
use super::{Planner, Why};

/// How far apart the ends are that are looked at along one straight push, m, and how far a push may go: as far as a table is
/// wide.
const STEP: f64 = 0.01;
const FARTHEST: f64 = 0.8;
/// A stretch shorter than this is left out, m: it is less than a thing is known by.
const SHORTEST: f64 = 0.005;
/// So much room is left beside the thing on its way, m: its place is known to some millimetres.
const BESIDE: f64 = 0.005;
/// So far inside a region a push ends, m: half of what a point allows, as for putting down.
const INSIDE: f64 = 0.5 * scene::region::AT;
/// From here on inside no end is better than another, m: as for putting down.
const WELL_INSIDE: f64 = 0.5 * scene::region::NEAR;
/// How far from the edge of the table it is kept, m: as for putting down.
const FROM_EDGE: f64 = 0.02;
/// Places of a region that are tried with two pushes: each costs some twenty searches.
const PLACES: usize = 8;
/// Places that are tried with more than two. Chosen: each costs a search over the table, and neighbours are come to alike.
const ROUND_TO: usize = 3;

impl Planner {
    /// Returns where a push, or two, may end, best first: the points at which the thing is left.
    pub(super) fn ends(
        &self,
        object: &scene::Object,
        pose: &Pose<World, Object>,
        at: &Region,
        on: &str,
    ) -> Result<Vec<Vec<[f64; 2]>>, Why> {
        let from = pose.origin().xy();
        let unseen = |lost: Unseen| Why::NotSeen(lost.0);
        let inside = |to: Vector2<f64>| {
            at.margin(&self.cell.scene, &self.state.objects, object, to.into()).map_err(unseen)
        };
        let ways: Vec<Vector2<f64>> = match object.shape.faces() {
            Some(_) => (0..4)
                .map(|quarter| pose.yaw() + f64::from(quarter) * FRAC_PI_2)
                .map(|turn| Vector2::new(turn.cos(), turn.sin()))
                .collect(),
            None => (0..16)
                .map(|part| f64::from(part) * TAU / 16.0)
                .map(|turn| Vector2::new(turn.cos(), turn.sin()))
                .collect(),
        };
        let mut single: Vec<(f64, f64, [f64; 2])> = Vec::new();
        let mut blocked = None;
        for way in &ways {
            let mut best: Option<(f64, f64, [f64; 2])> = None;
            for k in 1..=(FARTHEST / STEP) as usize {
                let far = STEP * k as f64;
                let to = from + way * far;
                if let Some(by) = self.on_the_way(object, pose, to, on) {
                    blocked = blocked.or(Some(by));
                    break;
                }
                let depth = inside(to)?.min(WELL_INSIDE);
                if depth >= INSIDE && best.is_none_or(|(most, ..)| depth > most + 1e-9) {
                    best = Some((depth, far, to.into()));
                }
            }
            single.extend(best);
        }
        single.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)));
        let mut ends: Vec<Vec<[f64; 2]>> = single.into_iter().map(|(.., to)| vec![to]).collect();
        if !matches!(at, Region::On(_)) {
            // What is in the way of one push need not be in that of two.
            match self.places_in(object, at) {
                Ok(places) => {
                    let few = self.by_two(object, pose, &places, on);
                    let many =
                        if few.is_empty() { self.round(object, pose, &places, on) } else { few };
                    ends.extend(many);
                }
                Err(why) if ends.is_empty() => return Err(why),
                Err(_) => {}
            }
        }
        if ends.is_empty() {
            let by = blocked.unwrap_or_else(|| on.to_owned());
            return Err(Why::Blocked { tried: 0, by });
        }
        Ok(ends)
    }

    /// Returns how places are come to by two pushes square to each other, or by one where a round thing can go straight.
    fn by_two(
        &self,
        object: &scene::Object,
        pose: &Pose<World, Object>,
        places: &[Vector3<f64>],
        on: &str,
    ) -> Vec<Vec<[f64; 2]>> {
        let from = pose.origin().xy();
        let is_round = object.shape.faces().is_none();
        let [first, second] = square(object, pose);
        let is_free = |from, to| self.slides_free(object, pose, [from, to], on);
        let mut ends = Vec::new();
        for place in places.iter().take(PLACES) {
            let by = place.xy() - from;
            let is_straight = is_round && by.norm() > SHORTEST;
            if is_straight && self.on_the_way(object, pose, place.xy(), on).is_none() {
                ends.push(vec![place.xy().into()]);
                continue;
            }
            for (a, b) in [(first, second), (second, first)] {
                let corner = from + a * by.dot(&a);
                let turn = by.dot(&a).abs() > SHORTEST && by.dot(&b).abs() > SHORTEST;
                if turn && is_free(from, corner) && is_free(corner, place.xy()) {
                    ends.push(vec![corner.into(), place.xy().into()]);
                }
            }
        }
        ends
    }

    /// Returns how places are come to by three pushes or more, round what is in the way.
    fn round(
        &self,
        object: &scene::Object,
        pose: &Pose<World, Object>,
        places: &[Vector3<f64>],
        on: &str,
    ) -> Vec<Vec<[f64; 2]>> {
        let is_free = |from, to| self.slides_free(object, pose, [from, to], on);
        let (from, axes) = (pose.origin().xy(), square(object, pose));
        let ways = places.iter().take(ROUND_TO).filter_map(|place| {
            let way = detour(from, place.xy(), axes, FARTHEST, &is_free)?;
            Some(way.into_iter().map(Into::into).collect())
        });
        ways.collect()
    }

    /// Whether a thing, turned as it stands at `pose`, slides straight from one point to another.
    fn slides_free(
        &self,
        object: &scene::Object,
        pose: &Pose<World, Object>,
        [from, to]: [Vector2<f64>; 2],
        on: &str,
    ) -> bool {
        let stands = Pose::upright(from.x, from.y, pose.origin().z, pose.yaw());
        self.on_the_way(object, &stands, to, on).is_none()
    }

    /// Returns what is in the way of a thing that slides straight to a point, the edge of what bears it included.
    fn on_the_way(
        &self,
        object: &scene::Object,
        pose: &Pose<World, Object>,
        to: Vector2<f64>,
        on: &str,
    ) -> Option<String> {
        let from = pose.origin().xy();
        let far = (to - from).norm();
        let n = (far / STEP).ceil().max(1.0) as usize;
        let radius = object.shape.outer_radius();
        let scene = &self.cell.scene;
        let room = radius + BESIDE;
        let begins = self.beside(object, on, pose.origin(), room);
        (1..=n).find_map(|k| {
            let at = from + (to - from) * (k as f64 / n as f64);
            let place = Vector3::new(at.x, at.y, pose.origin().z);
            let carried = match scene.object(on) {
                None => scene.table.holds(at.x, at.y, radius + FROM_EDGE),
                Some(bears) => {
                    self.state.object(on).and_then(|known| known.world_from_object).is_some_and(
                        |stands| {
                            let local = stands.isometry().inverse_transform_point(&place.into());
                            bears.shape.inset(local.x, local.y) >= object.shape.inner_radius()
                        },
                    )
                }
            };
            if !carried {
                return Some(on.to_owned());
            }
            if !self.is_known(at.x, at.y, room) {
                return Some(super::UNKNOWN.to_owned());
            }
            // What it stands beside already is left by the hand as by the thing.
            self.beside(object, on, place, room).filter(|by| begins.as_ref() != Some(by))
        })
    }
}

/// Two directions square to each other in which a thing slides without turning: those of its faces, or any of what is round.
fn square(object: &scene::Object, pose: &Pose<World, Object>) -> [Vector2<f64>; 2] {
    if object.shape.faces().is_none() {
        return [Vector2::x(), Vector2::y()];
    }
    [0, 1].map(|side| pose.axis(side).xy().normalize())
}
