//! Where a thing that is pushed may come to, and over which points.
//!
//! What is round is pushed in any direction, what has faces square to one of them. What the arm reaches is for [`super::push`]
//! to say.

use std::collections::BTreeMap;

use nalgebra::{Vector2, Vector3};

use crate::world::frame::{Object, World};
use crate::world::region::Unseen;
use crate::world::{self as scene, Pose, Region};

use super::roadmap::Roadmap;
use super::{Planner, Why};

/// How far apart the places are that are looked at along a push, m.
const STEP: f64 = 0.01;
/// How far a push may go, m: as far as a table is wide.
const FARTHEST: f64 = 0.8;
/// How far apart the points are over which a thing may be pushed, m, where it has faces, and where it is round, so that every
/// point may be come to from every other. Chosen: what is pushed is 4 to 9 cm wide; with half of it a search costs four, and
/// sixteen, times as much; with twice as much gaps that are 10 cm wider than the thing are missed.
const LINES: f64 = 0.05;
const POINTS: f64 = 0.075;
/// So much room is left beside the thing on its way, m: its place is known to some millimetres.
const BESIDE: f64 = 0.005;
/// So far inside a region a push ends, m: half of what a point allows, as for putting down.
const INSIDE: f64 = 0.5 * scene::region::AT;
/// From here on inside no end is better than another, m: as for putting down.
const WELL_INSIDE: f64 = 0.5 * scene::region::NEAR;
/// What a metre less far inside costs as way. Chosen: to end a centimetre farther inside, 10 cm more are pushed.
const SHALLOW: f64 = 10.0;
/// How far from the edge of the table it is kept, m: as for putting down.
const FROM_EDGE: f64 = 0.02;
/// Places of a region that are ends besides those along a face, and how far apart these are, m. Chosen: as many as stand round
/// a thing at that distance; neighbours are come to alike.
const PLACES: usize = 12;
const APART: f64 = 0.05;
/// How far off the direction of a face a stretch may be, no unit: rounding.
const SQUARE: f64 = 1e-9;
/// Directions in which a round thing is pushed to the deepest place along them.
const ROUND: i32 = 16;

/// A place in a region, and how far inside it is, m.
type Inside = (Vector2<f64>, f64);

/// What is asked about stretches while a thing is pushed over a table, each once.
pub(super) struct Slides<'p> {
    planner: &'p Planner,
    object: &'p scene::Object,
    pose: Pose<World, Object>,
    on: &'p str,
    axes: [Vector2<f64>; 2],
    known: BTreeMap<(usize, usize), bool>,
}

impl<'p> Slides<'p> {
    pub(super) fn new(
        planner: &'p Planner,
        object: &'p scene::Object,
        pose: Pose<World, Object>,
        on: &'p str,
    ) -> Self {
        let axes = square(object, &pose);
        Self { planner, object, pose, on, axes, known: BTreeMap::new() }
    }

    /// Whether the thing slides free from one point of a roadmap to another, in a direction in which it does not turn.
    pub(super) fn is_free(&mut self, roadmap: &Roadmap, a: usize, b: usize) -> bool {
        let (from, to) = (roadmap.point(a), roadmap.point(b));
        let by = to - from;
        if by.norm() < 2.0 * BESIDE || by.norm() > FARTHEST {
            return false;
        }
        let is_round = self.object.shape.faces().is_none();
        let is_square = || self.axes.iter().any(|axis| by.perp(axis).abs() < SQUARE);
        (is_round || is_square())
            && *self.known.entry((a, b)).or_insert_with(|| {
                self.planner.slides(self.object, &self.pose, [from, to], self.on)
            })
    }
}

impl Planner {
    /// Returns the points over which a thing may be pushed, where it stands first, and those among them where it may stay.
    pub(super) fn roadmap(
        &self,
        object: &scene::Object,
        pose: &Pose<World, Object>,
        at: &Region,
        on: &str,
    ) -> Result<Roadmap, Why> {
        let from = pose.origin().xy();
        let unseen = |lost: Unseen| Why::NotSeen(lost.0);
        let inside = |to: Vector2<f64>| {
            at.margin(&self.cell.scene, &self.state.objects, object, to.into()).map_err(unseen)
        };
        let cost = |depth: f64| {
            (depth >= INSIDE).then(|| SHALLOW * (WELL_INSIDE - depth.min(WELL_INSIDE)))
        };
        let stands = |to: Vector2<f64>| self.slides(object, pose, [to, to], on);
        let mut roadmap = Roadmap::new(from);
        let (straight, mut blocked) = self.straight_ends(object, pose, &inside, on)?;
        let mut lines = [vec![], vec![]];
        for (to, depth) in straight {
            roadmap.add(to, cost(depth));
        }
        let axes = square(object, pose);
        if !matches!(at, Region::On(_)) {
            match self.places_in(object, at, BESIDE) {
                Ok(places) => {
                    for place in spread(&places) {
                        roadmap.add(place, cost(inside(place)?));
                        for (axis, lines) in axes.iter().zip(&mut lines) {
                            lines.push((place - from).dot(axis));
                        }
                    }
                }
                // What is in the way there says more than what is in some straight way.
                Err(Why::Blocked { by, .. }) => blocked = Some(by),
                Err(why @ Why::OffTable(_)) if !roadmap.has_ends() => return Err(why),
                Err(Why::OffTable(_)) => {}
                Err(other) => return Err(other),
            }
        }
        if !roadmap.has_ends() {
            let by = blocked.unwrap_or_else(|| on.to_owned());
            return Err(Why::Blocked { tried: 0, by });
        }
        let is_round = object.shape.faces().is_none();
        let apart = if is_round { POINTS } else { LINES };
        let most = (FARTHEST / apart).floor() as i32;
        for line in &mut lines {
            if is_round {
                line.clear();
            }
            line.extend((-most..=most).map(|k| f64::from(k) * apart));
            line.sort_by(f64::total_cmp);
            line.dedup();
        }
        for u in &lines[0] {
            for v in &lines[1] {
                let point = from + axes[0] * *u + axes[1] * *v;
                let is_start = u.abs() < SQUARE && v.abs() < SQUARE;
                if !is_start && stands(point) {
                    roadmap.add(point, None);
                }
            }
        }
        Ok(roadmap)
    }

    /// Returns the end farthest inside along each straight push from where a thing stands, with how far inside it is, m; and
    /// what is in the way of one of them.
    fn straight_ends(
        &self,
        object: &scene::Object,
        pose: &Pose<World, Object>,
        inside: &dyn Fn(Vector2<f64>) -> Result<f64, Why>,
        on: &str,
    ) -> Result<(Vec<Inside>, Option<String>), Why> {
        let from = pose.origin().xy();
        let turns = if object.shape.faces().is_some() { 4 } else { ROUND };
        let mut ends = Vec::new();
        let mut blocked = None;
        for part in 0..turns {
            let turn = std::f64::consts::TAU * f64::from(part) / f64::from(turns);
            let turn = nalgebra::Rotation2::new(turn);
            let way = turn * square(object, pose)[0];
            let mut best: Option<Inside> = None;
            for k in 1..=(FARTHEST / STEP) as usize {
                let to = from + way * (STEP * k as f64);
                if let Some(by) = self.on_the_way(object, pose, to, on) {
                    blocked = blocked.or(Some(by));
                    break;
                }
                let depth = inside(to)?.min(WELL_INSIDE);
                if depth >= INSIDE && best.is_none_or(|(_, most)| depth > most + 1e-9) {
                    best = Some((to, depth));
                }
            }
            ends.extend(best);
        }
        Ok((ends, blocked))
    }

    /// Whether a thing that stands at `pose` is in a place already, as far inside as a push would end at least.
    pub(super) fn is_there(
        &self,
        object: &scene::Object,
        pose: &Pose<World, Object>,
        at: &Region,
    ) -> Result<bool, Why> {
        let here = pose.origin().xy();
        let inside = at.margin(&self.cell.scene, &self.state.objects, object, here.into());
        Ok(inside.map_err(|lost| Why::NotSeen(lost.0))? >= INSIDE)
    }

    /// Whether a thing, turned as it stands at `pose`, slides straight from one point to another.
    fn slides(
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

/// Returns the first of places that are [`APART`] from each other, m.
fn spread(places: &[Vector3<f64>]) -> Vec<Vector2<f64>> {
    let mut kept: Vec<Vector2<f64>> = Vec::new();
    for place in places {
        let is_apart = kept.iter().all(|other| (other - place.xy()).norm() >= APART);
        if is_apart && kept.len() < PLACES {
            kept.push(place.xy());
        }
    }
    kept
}
