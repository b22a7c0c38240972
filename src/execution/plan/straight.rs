//! Straight ways and turns of the tool from where it is, and joint positions that bring it to a pose.
//!
//! What is touched where a way begins may be left and may not be driven into: the distance to what is nearest does not
//! shrink until nothing is touched any more.

use nalgebra::{UnitQuaternion, UnitVector3, Vector3};

use crate::motion::collision::CollisionWorld;
use crate::world::frame::{Tool, World};
use crate::world::region::TABLE;
use crate::world::{Pose, support};

use super::super::wording;
use super::{Dropped, NoWay, Planner, REACHING, STRAIGHT_STEP, TOOL, TRACKING, Way, Why, straight};

/// Shares of a rise that are tried, most first: half as far as asked is still clear of what was let go, an eighth is not.
const RISES: [f64; 3] = [1.0, 0.5, 0.25];
/// Shares of what a lift may spare that it does without, least first.
const SPARED: [f64; 2] = [0.5, 1.0];
/// Between two poses of a way that turns, rad: a point 0.1 m from the tool moves by 3.5 mm, less than a [`STRAIGHT_STEP`].
const TURN_STEP: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// How much nearer than before something may seem that is touched already, m: what is held creeps in the numbers of a
/// straight line by tenths of a millimetre. Chosen: twice as much would press a thing by more than a pad gives way.
const SLACK: f64 = 5e-4;
/// The room that a posture is wanted to have around it, m: no motion that is certain leads to where hardly any is left. Chosen: what
/// a search keeps where its ends let it; a Panda's touch-off took 14 s where a posture with 0.1 mm was nearest.
const ROOMY: f64 = 0.003;
/// So many joint positions of a pose are handed out, nearest first: neighbours are nearly alike, and a script that chooses
/// takes one of the first.
const HANDED_OUT: usize = 8;

impl Planner {
    /// Returns the joint path of a straight line of the tool by `by` m in the world, orientation kept, on which nothing is
    /// touched that was not touched before.
    ///
    /// # Errors
    ///
    /// [`NoWay`] when it cannot be followed, or what is in the way.
    pub fn line(&self, by: Vector3<f64>) -> Result<Vec<Vec<f64>>, NoWay> {
        let poses = straight(&self.tool_at(&self.q), by);
        self.along(&poses, &wording::to_move(by.norm()), &self.around_hand())
    }

    /// As [`Self::line`], straight up by `by` m, or where the arm cannot follow that by less, `least` m at least.
    ///
    /// # Errors
    ///
    /// As [`Self::line`], of the whole way.
    pub fn raise(&self, by: f64, least: f64) -> Result<Vec<Vec<f64>>, NoWay> {
        let up = |height: f64| self.line(Vector3::z() * height);
        let out_of_reach = match up(by) {
            Err(no) if matches!(no.why, Why::OutOfReach { .. }) => no,
            found => return found,
        };
        let spared = (by - least.max(0.0)).max(0.0);
        for share in SPARED {
            match up(by - share * spared) {
                Err(no) if matches!(no.why, Why::OutOfReach { .. }) => {}
                found => return found,
            }
        }
        Err(out_of_reach)
    }

    /// As [`Self::line`], to a pose, the tool turning evenly on the way.
    ///
    /// # Errors
    ///
    /// As [`Self::line`].
    pub fn line_to(&self, to: &Pose<World, Tool>) -> Result<Vec<Vec<f64>>, NoWay> {
        let from = self.tool_at(&self.q);
        let by = to.origin() - from.origin();
        let turn = from.rotation().rotation_to(&to.rotation());
        let angle = turn.angle();
        let n = (by.norm() / STRAIGHT_STEP).max(angle / TURN_STEP).ceil().max(1.0) as usize;
        let axis = turn.axis().unwrap_or_else(Vector3::z_axis);
        let pose = |i: usize| {
            let share = i as f64 / n as f64;
            let turned = UnitQuaternion::from_axis_angle(&axis, angle * share) * from.rotation();
            Pose::from_parts(from.origin() + by * share, turned)
        };
        let poses: Vec<_> = (1..=n).map(pose).collect();
        self.along(&poses, &wording::to_move(by.norm()), &self.around_hand())
    }

    /// As [`Self::line`], turning the tool about an axis of the world through its own point by `angle` rad.
    ///
    /// # Errors
    ///
    /// As [`Self::line`].
    pub fn turned(&self, axis: UnitVector3<f64>, angle: f64) -> Result<Vec<Vec<f64>>, NoWay> {
        let from = self.tool_at(&self.q);
        let n = (angle.abs() / TURN_STEP).ceil().max(1.0) as usize;
        let pose = |i: usize| {
            let turn = UnitQuaternion::from_axis_angle(&axis, angle * i as f64 / n as f64);
            Pose::from_parts(from.origin(), turn * from.rotation())
        };
        let poses: Vec<_> = (1..=n).map(pose).collect();
        self.along(&poses, &wording::to_turn(angle), &self.around_hand())
    }

    /// As [`Self::line`], but fingers and what they hold may touch anything: the way is to end where they do.
    ///
    /// # Errors
    ///
    /// As [`Self::line`].
    pub fn line_into(&self, by: Vector3<f64>) -> Result<Vec<Vec<f64>>, NoWay> {
        let held = self.state.held.clone();
        let mut world =
            self.obstacles(&held.as_deref().map_or(vec![], |o| vec![o]), self.state.opening);
        self.let_jaws_touch(&mut world, held.as_deref());
        let poses = straight(&self.tool_at(&self.q), by);
        self.along(&poses, &wording::to_move(by.norm()), &world)
    }

    /// Lets the jaws touch everything; `but` is not there anyway.
    pub(super) fn let_jaws_touch(&self, world: &mut CollisionWorld<'_>, but: Option<&str>) {
        let scene = &self.cell.scene;
        let things = scene.objects.iter().map(|object| object.name.as_str());
        for thing in things.filter(|name| Some(*name) != but).chain([TABLE]) {
            for jaw in self.robot().jaw_links() {
                world.ignore(jaw, thing);
            }
        }
        // How low the point between the fingers may come then is for the limits to say.
        world.ignore(TOOL, TABLE);
    }

    /// What is in the way of a hand that may hold something: what stands around it is hollow when it is a vessel.
    fn around_hand(&self) -> CollisionWorld<'_> {
        let within = self.state.held.as_deref().and_then(|held| {
            let object = self.cell.scene.object(held)?;
            let pose = self.state.object(held)?.world_from_object?;
            support::below(&self.cell.scene, &self.state.objects, object, &pose).name
        });
        self.obstacles_around(&[], within.as_deref(), self.state.opening)
    }

    /// Follows poses from where the arm is.
    fn along(
        &self,
        poses: &[Pose<World, Tool>],
        what: &str,
        world: &CollisionWorld<'_>,
    ) -> Result<Vec<Vec<f64>>, NoWay> {
        let no = |why| NoWay { what: what.to_owned(), why };
        let work = (TRACKING + world.cost()) * poses.len() as u64;
        self.goes_on(work, 0).map_err(no)?;
        let path = self.track(&self.q, poses);
        let path = path.map_err(|nearest| no(Why::OutOfReach { nearest }))?;
        match touches(world, &path) {
            None => Ok(path),
            Some(by) => Err(no(Why::Blocked { tried: 1, by })),
        }
    }

    /// Returns the joint path of the tool straight up by `by` m, or by as much of it as the arm can follow without
    /// touching anything; one point when it can go no way up.
    ///
    /// # Errors
    ///
    /// When the budget is used up, or somebody wants it to end.
    pub fn rise(&self, by: f64) -> Result<Vec<Vec<f64>>, NoWay> {
        let world = self.obstacles(&[], self.state.opening);
        for share in RISES {
            let poses = straight(&self.tool_at(&self.q), Vector3::z() * by * share);
            let no = |why| NoWay { what: "to rise".to_owned(), why };
            let work = (TRACKING + world.cost()) * poses.len() as u64;
            self.goes_on(work, 0).map_err(no)?;
            let Ok(path) = self.track(&self.q, &poses) else { continue };
            if Self::clear(&world, &path, &mut Dropped::new()).is_some() && self.passes(&path) {
                return Ok(path);
            }
        }
        Ok(vec![self.q.clone()])
    }

    /// Returns a way to where the tool is at `at`, round everything in the way.
    ///
    /// # Errors
    ///
    /// [`NoWay`] when it is out of reach or blocked.
    pub fn visit(&self, at: &Pose<World, Tool>, seed: u64) -> Result<Way, NoWay> {
        let goals = self.reaches(at)?;
        let world = self.world();
        let roomy = goals.iter().find(|goal| world.distance(goal) > ROOMY);
        self.free(roomy.unwrap_or(&goals[0]), None, seed)
    }

    /// Returns joint positions that bring the tool to a pose and touch nothing, nearest first; one at least.
    ///
    /// # Errors
    ///
    /// [`NoWay`] with the distance out of reach, or what is in the way.
    pub fn reaches(&self, at: &Pose<World, Tool>) -> Result<Vec<Vec<f64>>, NoWay> {
        let no = |why| NoWay { what: "to get there".to_owned(), why };
        self.goes_on(REACHING, 0).map_err(no)?;
        let goals = self.reach(at, &self.q).map_err(no)?;
        let world = self.obstacles(&[], self.state.opening);
        let mut dropped = Dropped::new();
        let mut free = Vec::new();
        for goal in goals {
            dropped.tried += 1;
            if world.free(&goal) {
                free.push(goal);
            } else {
                Self::clear(&world, std::slice::from_ref(&goal), &mut dropped);
            }
            if free.len() >= HANDED_OUT {
                break;
            }
        }
        if free.is_empty() { Err(no(dropped.why())) } else { Ok(free) }
    }
}

/// Returns what is touched along a path, if anything is that was not touched, and not left, from its beginning.
fn touches(world: &CollisionWorld<'_>, path: &[Vec<f64>]) -> Option<String> {
    let mut least = f64::NEG_INFINITY;
    let mut is_free = false;
    for q in path {
        let nearest = world.clearance_or_overlap(q).expect("the path has one angle per joint");
        let may_touch = !is_free && nearest.distance >= least - SLACK;
        if nearest.distance <= 0.0 && !may_touch {
            return Some(format!("{} with {}", nearest.first, nearest.second));
        }
        is_free |= nearest.distance > 0.0;
        least = least.max(nearest.distance);
    }
    None
}
