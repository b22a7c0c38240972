//! A planning problem, as `robot plan` is given it: JSON → start, goals and what stands in the way.

use nalgebra::Vector3;
use serde::Deserialize;

use super::rows::FARTHEST;
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

/// Refuses a key that is most likely a slip of one that would be read and is not there.
fn check_keys(keys: &[&String], known: &[&str]) -> Result<(), Error> {
    let is_there = |name: &str| keys.iter().any(|key| *key == name);
    let slip = |key: &&&String| !known.contains(&key.as_str());
    for key in keys.iter().filter(slip) {
        let meant = nearest(key, known.iter().copied()).filter(|meant| !is_there(meant));
        if let Some(meant) = meant {
            let what =
                format!("not a planning problem: `{key}` is not read; did you mean `{meant}`?");
            return Err(Error::Input { what });
        }
    }
    Ok(())
}

impl Problem {
    /// Reads a problem from JSON.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] with the line and column of what is wrong; for a key that is most likely a slip of one that is
    /// known, since what it holds would be left out. Other keys are the file's own.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let said = |error: serde_json::Error| Error::Input {
            what: format!("not a planning problem: {error}"),
        };
        let keys: serde_json::Map<String, serde_json::Value> =
            serde_json::from_str(text).map_err(said)?;
        check_keys(&keys.keys().collect::<Vec<_>>(), &["start", "goals", "obstacles", "margin_m"])?;
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
            let name = obstacle
                .name
                .clone()
                .unwrap_or_else(|| format!("{} {}", obstacle.shape, index + 1));
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
