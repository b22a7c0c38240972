//! A planning problem, as `robot plan` is given it: JSON → start, goals and what stands in the way.

use nalgebra::{Quaternion, Vector3};
use serde::Deserialize;
use serde_json::{Map, Value};

use super::rows::{FARTHEST, check_turn};
use crate::language::nearest;
use crate::motion::Error;
use crate::motion::collision::{CollisionWorld, Obstacle};
use crate::motion::robot::Robot;
use crate::motion::solid::Solid;
use crate::world::frame::{Base, Object, Pose};

/// A side is no shorter than this, m.
const SMALLEST: f64 = 1e-6;
/// A margin is no wider than this, m: an arm's own parts are nearer to each other than that.
const WIDEST: f64 = 0.5;
/// So many goals and so many obstacles are taken.
const GOALS: usize = 10_000;
const OBSTACLES: usize = 10_000;

/// What a problem, one of its obstacles and the pose of one hold.
const KEYS: [&str; 4] = ["start", "goals", "obstacles", "margin_m"];
const KEYS_OF_OBSTACLES: [&str; 4] = ["name", "shape", "pose", "size_m"];
const KEYS_OF_POSES: [&str; 2] = ["xyz_m", "quat_wxyz"];
/// What any of them may be labelled with: nothing of it is planned with.
const LABELS: [&str; 4] = ["name", "index", "comment", "description"];

/// A planning problem, as its file has it.
#[derive(Debug, Clone, Deserialize)]
pub struct Problem {
    /// Start, rad.
    pub start: Vec<f64>,
    /// Goals, rad; any will do.
    pub goals: Vec<Vec<f64>>,
    /// What stands in the way.
    #[serde(default)]
    pub obstacles: Vec<ProblemObstacle>,
    /// How far the arm stays from everything, itself as well, m.
    #[serde(default)]
    pub margin_m: f64,
}

/// An obstacle of a planning problem.
#[derive(Debug, Clone, Deserialize)]
pub struct ProblemObstacle {
    /// What messages call it.
    pub name: Option<String>,
    /// `box`, `sphere` or `cylinder`.
    pub shape: String,
    /// Its centre in base coordinates; cylinders stand along its z axis.
    pub pose: Pose<Base, Object>,
    /// A box: edges along x, y, z; a sphere: radius; a cylinder: radius and height. m.
    pub size_m: Vec<f64>,
}

/// Refuses a key that is neither read nor a label, of the problem or of an obstacle in it: what it holds would be left out of what is
/// planned.
fn check_keys(of: &str, entry: &Map<String, Value>, known: &[&str]) -> Result<(), Error> {
    let is_read = |key: &str| known.contains(&key) || LABELS.contains(&key);
    let Some(key) = entry.keys().find(|key| !is_read(key.as_str())) else { return Ok(()) };
    let missing = known.iter().copied().filter(|name| !entry.contains_key(*name));
    let hint = match nearest(key, missing) {
        Some(meant) => format!("did you mean `{meant}`?"),
        None => format!("known: {}", known.join(", ")),
    };
    let what = format!("not a planning problem: {of}unknown key `{key}`; {hint}");
    Err(Error::Input { what })
}

/// Refuses keys of an obstacle, and of its pose, that are not read, and a pose whose quaternion is none; the first obstacle has the index 0.
fn check_obstacle(index: usize, obstacle: &Value) -> Result<(), Error> {
    // What is no obstacle at all is told with line and column where it is read.
    let Some(obstacle) = obstacle.as_object() else { return Ok(()) };
    let text = |key: &str| obstacle.get(key).and_then(Value::as_str);
    let which = format!("obstacle {}: ", called(text("name"), text("shape").unwrap_or(""), index));
    check_keys(&which, obstacle, &KEYS_OF_OBSTACLES)?;
    let Some(pose) = obstacle.get("pose").and_then(Value::as_object) else { return Ok(()) };
    check_keys(&format!("{which}pose: "), pose, &KEYS_OF_POSES)?;
    let turn = pose.get("quat_wxyz").and_then(Value::as_array);
    let turn: Vec<f64> = turn.into_iter().flatten().filter_map(Value::as_f64).collect();
    let &[w, x, y, z] = &turn[..] else { return Ok(()) };
    check_turn("quat_wxyz", &Quaternion::new(w, x, y, z)).map_err(|fault| {
        let what = format!("not a planning problem: {which}{fault}");
        Error::Input { what }
    })
}

/// Returns what messages call an obstacle: by its name, or by its shape and number, from 1 on.
fn called(name: Option<&str>, shape: &str, index: usize) -> String {
    let numbered = || format!("{shape} {}", index + 1).trim_start().to_owned();
    name.map_or_else(numbered, str::to_owned)
}

/// Names the goal that a path leads to for people, who count from 1; the index counts from 0.
pub(super) fn to_goal(index: usize, n_goals: usize) -> String {
    if n_goals == 1 { "the goal".to_owned() } else { format!("goal {} of {n_goals}", index + 1) }
}

impl Problem {
    /// Reads a problem from JSON.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] with the line and column of what is wrong; for a key that is not known, since what it holds would be
    /// left out; for a quaternion that is not of length 1. Labels may be anywhere: `name`, `index`, `comment`, `description`.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let said = |error: serde_json::Error| Error::Input {
            what: format!("not a planning problem: {error}"),
        };
        let problem: Map<String, Value> = serde_json::from_str(text).map_err(said)?;
        check_keys("", &problem, &KEYS)?;
        let obstacles = problem.get("obstacles").and_then(Value::as_array);
        for (index, obstacle) in obstacles.into_iter().flatten().enumerate() {
            check_obstacle(index, obstacle)?;
        }
        serde_json::from_str(text).map_err(said)
    }

    /// Checks that start and goals are joint positions, and not too many.
    pub(super) fn check(&self, robot: &Robot) -> Result<(), Error> {
        let said = |which: &str, error: &Error| Error::Input { what: format!("{which}: {error}") };
        robot.check(&self.start).map_err(|error| said("start", &error))?;
        if self.goals.is_empty() {
            return Err(Error::Input { what: "goals: there is none".into() });
        }
        if self.goals.len() > GOALS {
            let what = format!("goals: {} are given; {GOALS} can be", self.goals.len());
            return Err(Error::Input { what });
        }
        for (index, goal) in self.goals.iter().enumerate() {
            let which = format!("goal {}", index + 1);
            robot.check(goal).map_err(|error| said(&which, &error))?;
        }
        Ok(())
    }

    /// Returns the robot among the problem's obstacles.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] for a shape that is not known, a size that does not fit it, or a margin that no arm could keep.
    pub fn world<'a>(&self, robot: &'a Robot) -> Result<CollisionWorld<'a>, Error> {
        if self.obstacles.len() > OBSTACLES {
            let what = format!("obstacles: {} are given; {OBSTACLES} can be", self.obstacles.len());
            return Err(Error::Input { what });
        }
        let mut obstacles = Vec::with_capacity(self.obstacles.len());
        for (index, obstacle) in self.obstacles.iter().enumerate() {
            let name = called(obstacle.name.as_deref(), &obstacle.shape, index);
            let fail =
                |what: String| Err(Error::Input { what: format!("obstacle {name}: {what}") });
            let sizes = SMALLEST..=FARTHEST;
            if let Some(bad) = obstacle.size_m.iter().find(|size| !sizes.contains(*size)) {
                return fail(format!("a size of {bad:?} m; {SMALLEST:?} m to {FARTHEST} m can be"));
            }
            let at = obstacle.pose.origin();
            if let Some(far) = at.iter().find(|x| !x.is_finite() || x.abs() > FARTHEST) {
                return fail(format!(
                    "it is at {far:?} m; up to {FARTHEST} m from the base can be"
                ));
            }
            let solid = match (obstacle.shape.as_str(), &obstacle.size_m[..]) {
                ("box", &[x, y, z]) => Solid::Cuboid { half: Vector3::new(x, y, z) / 2.0 },
                ("sphere", &[radius]) => Solid::Sphere { radius },
                ("cylinder", &[radius, height]) => Solid::Cylinder { radius, half: height / 2.0 },
                ("box" | "sphere" | "cylinder", sizes) => {
                    return fail(format!(
                        "{} sizes; a box has 3 (x, y, z), a sphere 1 (radius), a cylinder 2 (radius, height)",
                        sizes.len()
                    ));
                }
                (other, _) => {
                    return fail(format!("the shape {other} is not box, sphere or cylinder"));
                }
            };
            obstacles.push(Obstacle::new(&name, solid, *obstacle.pose.isometry()));
        }
        if !(0.0..=WIDEST).contains(&self.margin_m) {
            let what = format!("margin_m: {:?} m; 0 to {WIDEST} m can be", self.margin_m);
            return Err(Error::Input { what });
        }
        let mut world = CollisionWorld::new(robot).with(&obstacles);
        world.set_margin(self.margin_m);
        Ok(world)
    }
}
