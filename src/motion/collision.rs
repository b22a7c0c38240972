//! What touches what: the robot and what it holds, against itself and against obstacles.
//!
//! A [`CollisionWorld`] belongs to one moment: obstacles stand still, the gripper's opening and the held
//! object are fixed. Links that no joint moves (the base) are not checked against obstacles, since no
//! plan could change that. Distances are signed, m, negative by the depth of overlap.
//!
//! Here is what the world is made of and what is put into it; what is asked of it is `clearance`'s, and how often an arm is
//! near to itself `contacts`'s.

mod clearance;
mod contacts;

use std::collections::BTreeSet;
use std::sync::OnceLock;

use nalgebra::{Isometry3, Vector3};

use super::batch::Batch;
use super::body::Body;
use super::broad::{Crowd, GROUP};
use super::contact_pairs::{checked_pairs, rigid_sets};
use super::frames::Frames;
use super::posture::Solids;
use super::reach::reaches;
use super::robot::{Drive, Robot};
use super::solid::{Placed, Solid};
use crate::world::Shape;
use crate::world::frame::{Base, Flange, Object, Pose};

pub use clearance::Clearance;
pub(super) use clearance::Pair;
pub use contacts::{Contact, Contacts};

/// Something that stands in the way.
#[derive(Debug, Clone)]
pub struct Obstacle {
    /// What messages call it.
    pub name: String,
    /// Its solid, placed in base coordinates.
    pub solid: Placed,
}

impl Obstacle {
    /// Returns a solid whose own origin stands at `base_from_solid`.
    pub fn new(name: &str, solid: Solid, base_from_solid: Isometry3<f64>) -> Self {
        Self { name: name.into(), solid: Placed { solid, pose: base_from_solid } }
    }

    /// Returns an object of a scene, whose origin is the centre of its base, larger by `by` m: one obstacle, or one for each
    /// convex part.
    pub fn of_object(
        name: &str,
        shape: &Shape,
        by: f64,
        base_from_object: Pose<Base, Object>,
    ) -> Vec<Self> {
        let placed =
            |part: Placed| Self::new(name, part.solid, base_from_object.isometry() * part.pose);
        Solid::of_object(shape, by).into_iter().map(placed).collect()
    }
}

/// One rigid part of the robot, or the held object.
#[derive(Debug, Clone)]
struct Part {
    name: String,
    /// The link it moves with.
    link: usize,
    /// Solids in the link's frame.
    solids: Vec<Body>,
    /// Whether any joint moves it.
    moves: bool,
}

/// The robot among obstacles, at one moment.
#[derive(Debug, Clone)]
pub struct CollisionWorld<'a> {
    robot: &'a Robot,
    opening: f64,
    margin: f64,
    parts: Vec<Part>,
    /// Pairs of parts that are checked.
    pairs: Vec<(usize, usize)>,
    obstacles: Vec<(String, Body)>,
    ignored: BTreeSet<(String, String)>,
    /// Pairs of part and obstacle that are checked. Derived from the above, as all below.
    watched: Vec<(usize, usize)>,
    frames: Frames,
    solids: Solids,
    crowd: Crowd,
    /// Per part and group of the crowd: a bit for each obstacle that is watched.
    masks: Vec<u32>,
    /// Per joint, m/rad or m/m: how far any point beyond it can move for a unit of the joint.
    reach: Vec<f64>,
    /// For eight configurations at once; made when it is first asked for.
    batch: OnceLock<Batch>,
}

impl<'a> CollisionWorld<'a> {
    /// Returns the robot alone, jaws wide open.
    pub fn new(robot: &'a Robot) -> Self {
        let mut world = Self {
            robot,
            opening: robot.max_opening(),
            margin: 0.0,
            parts: Vec::new(),
            pairs: Vec::new(),
            obstacles: Vec::new(),
            ignored: BTreeSet::new(),
            watched: Vec::new(),
            frames: Frames::of(&robot.links, robot.max_opening(), |_| true),
            solids: Solids::default(),
            crowd: Crowd::default(),
            masks: Vec::new(),
            reach: Vec::new(),
            batch: OnceLock::new(),
        };
        let mut moves = vec![false; robot.links.len()];
        for (at, link) in robot.links.iter().enumerate() {
            moves[at] = matches!(link.joint.drive, Drive::Joint { .. })
                || link.parent.is_some_and(|parent| moves[parent]);
            if !link.collision.is_empty() {
                world.parts.push(Part {
                    name: link.name.clone(),
                    link: at,
                    solids: link.collision.iter().map(Body::new).collect(),
                    moves: moves[at],
                });
            }
        }
        world.refresh();
        let part_links: Vec<usize> = world.parts.iter().map(|part| part.link).collect();
        world.pairs = checked_pairs(robot, &part_links, &world.solids);
        world
    }

    /// Adds an obstacle.
    pub fn add(&mut self, obstacle: &Obstacle) {
        self.obstacles.push((obstacle.name.clone(), Body::new(&obstacle.solid)));
        self.refresh();
    }

    /// As [`Self::add`], for building one in an expression.
    #[must_use]
    pub fn with(mut self, obstacles: &[Obstacle]) -> Self {
        let bodies = obstacles.iter().map(|o| (o.name.clone(), Body::new(&o.solid)));
        self.obstacles.extend(bodies);
        self.refresh();
        self
    }

    /// Removes every obstacle of that name.
    pub fn remove(&mut self, name: &str) {
        self.obstacles.retain(|(other, _)| other != name);
        self.refresh();
    }

    /// Fixes an object to the flange. It is checked against obstacles and against all links that are not
    /// rigidly joined to the flange and are no jaws; those it is meant to touch.
    pub fn attach(&mut self, name: &str, shape: &Shape, flange_from_object: Pose<Flange, Object>) {
        let solids = Solid::of_object(shape, 0.0).into_iter().map(|Placed { solid, pose }| {
            Body::new(&Placed { solid, pose: flange_from_object.isometry() * pose })
        });
        let tip = self.robot.tip;
        let held = self.parts.len();
        self.parts.push(Part {
            name: name.into(),
            link: tip,
            solids: solids.collect(),
            moves: true,
        });
        let set = rigid_sets(self.robot);
        for (at, part) in self.parts[..held].iter().enumerate() {
            let jaw = self.robot.links[set[part.link]].joint.drive.is_of_gripper();
            if set[part.link] != set[tip] && !jaw {
                self.pairs.push((at, held));
            }
        }
        self.refresh();
    }

    /// Keeps every obstacle `radius` m away from a point that moves with the flange: where the tool is told to
    /// be may lie beyond its solids. The rest of the robot does not mind it; [`Self::ignore`] takes obstacles out.
    pub fn guard(&mut self, name: &str, radius: f64, point: &Vector3<f64>) {
        let ball = Solid::Sphere { radius };
        let placed =
            Placed { solid: ball, pose: Isometry3::translation(point.x, point.y, point.z) };
        self.parts.push(Part {
            name: name.into(),
            link: self.robot.tip,
            solids: vec![Body::new(&placed)],
            moves: true,
        });
        self.refresh();
    }

    /// Lets go of whatever was attached.
    pub fn detach(&mut self) {
        let kept = self
            .parts
            .iter()
            .position(|part| !self.robot.links.iter().any(|link| link.name == part.name));
        if let Some(kept) = kept {
            self.parts.truncate(kept);
            self.pairs.retain(|&(a, b)| a < kept && b < kept);
            self.refresh();
        }
    }

    /// Stops checking a pair of names: links, the held object, obstacles; for contact that is meant.
    pub fn ignore(&mut self, first: &str, second: &str) {
        self.ignored.insert((first.into(), second.into()));
        self.ignored.insert((second.into(), first.into()));
        let parts = &self.parts;
        let ignored = &self.ignored;
        self.pairs
            .retain(|&(a, b)| !ignored.contains(&(parts[a].name.clone(), parts[b].name.clone())));
        self.refresh();
    }

    /// Stops checking parts of the robot against each other: where only what stands around it is asked for.
    pub fn ignore_itself(&mut self) {
        self.pairs.clear();
        self.refresh();
    }

    /// As [`Self::ignore`], for the whole gripper: everything at and beyond the flange.
    pub fn ignore_gripper(&mut self, obstacle: &str) {
        for name in self.gripper() {
            self.ignore(&name, obstacle);
        }
    }

    /// Sets the gap between the jaws, m.
    pub fn set_opening(&mut self, opening: f64) {
        self.opening = opening;
        self.frames = Frames::of(&self.robot.links, opening, |_| true);
        self.refresh();
    }

    /// Asks for at least so much distance, m, before a configuration counts as free.
    pub fn set_margin(&mut self, margin: f64) {
        self.margin = margin;
    }

    /// Returns the robot.
    pub fn robot(&self) -> &'a Robot {
        self.robot
    }

    /// Returns the distance asked for, m.
    pub fn margin(&self) -> f64 {
        self.margin
    }

    /// Returns what looking at one configuration costs, in units of [`super::Budget`].
    pub fn cost(&self) -> u64 {
        let solids = |part: &usize| self.parts[*part].solids.len();
        let watched = self.watched.iter().map(|(part, _)| solids(part)).sum::<usize>();
        let pairs = self.pairs.iter().map(|(a, b)| solids(a) * solids(b)).sum::<usize>();
        (self.robot.links.len() + watched + pairs) as u64
    }

    /// Returns the robot and the obstacles for eight configurations at once.
    pub(super) fn batch(&self) -> &Batch {
        self.batch.get_or_init(|| {
            let obstacles = self.obstacles.iter().map(|(_, body)| body);
            Batch::of(&self.frames, self.watched_parts(), &self.pairs, obstacles)
        })
    }

    /// Returns each part's link, its solids there, and the obstacles that it must not touch, by place.
    pub(super) fn watched_parts(&self) -> impl Iterator<Item = (usize, &[Body], Vec<u32>)> {
        self.parts.iter().enumerate().map(|(at, part)| {
            let watched = self.watched.iter().filter(|(part, _)| *part == at);
            (part.link, &part.solids[..], watched.map(|(_, o)| *o as u32).collect())
        })
    }

    /// Returns the obstacles, by name.
    pub(super) fn bodies(&self) -> &[(String, Body)] {
        &self.obstacles
    }

    /// Returns the frames that joints move.
    pub(super) fn frames(&self) -> &Frames {
        &self.frames
    }

    /// Names of the parts at and beyond the flange, without what is held.
    fn gripper(&self) -> Vec<String> {
        let links = &self.robot.links;
        let mut beyond = vec![false; links.len()];
        for at in 0..links.len() {
            beyond[at] = links[at].parent.is_some_and(|p| p == self.robot.tip || beyond[p]);
        }
        let of_link = |part: &&Part| beyond[part.link] && links[part.link].name == part.name;
        self.parts.iter().filter(of_link).map(|part| part.name.clone()).collect()
    }

    fn refresh(&mut self) {
        self.watched.clear();
        for (at, part) in self.parts.iter().enumerate().filter(|(_, part)| part.moves) {
            for (obstacle, (name, _)) in self.obstacles.iter().enumerate() {
                if !self.ignored.contains(&(part.name.clone(), name.clone())) {
                    self.watched.push((at, obstacle));
                }
            }
        }
        self.crowd = Crowd::of(self.obstacles.iter().map(|(_, body)| body));
        let groups = self.crowd.len();
        self.masks.clear();
        self.masks.resize(self.parts.len() * groups, 0);
        for &(part, obstacle) in &self.watched {
            self.masks[part * groups + obstacle / GROUP] |= 1 << (obstacle % GROUP);
        }
        let parts = self.parts.iter().map(|part| (part.link, &part.solids[..]));
        self.solids = Solids::of(&self.frames, parts.clone());
        self.reach = reaches(self.robot, self.opening, parts);
        self.batch = OnceLock::new();
    }
}
