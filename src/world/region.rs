//! Where something may be put or may stand: on a thing, at a point, or beside other things.
//!
//! A region is told from shapes and poses alone; whether the arm gets there is for planning to say. Directions are
//! settled when a region is made: what is left for a camera may be ahead for the robot.

use nalgebra::Vector2;

use super::object::Object;
use super::{ObjectState, Scene, support};

/// What is beside a thing is at most so far from its side, m. Chosen: an open 2F-85 stands out by 24 mm on each side of
/// what it holds (`BETWEEN` in `execution::plan::place`), so that at 0.12 m there is a place for the hand between the two
/// and another 7 cm to choose from. With half of it the hand strikes the neighbour, with twice as much "next to" is
/// anywhere on a table of 80 cm.
pub const NEAR: f64 = 0.12;
/// How far from a point something may stand that was put there, m: an arm whose error nobody has measured is up to
/// 19 mm beside where it says (`docs/results.md`).
pub const AT: f64 = 0.02;
/// How far from the line between two things something may stand that is between them, m. Chosen: as much as [`NEAR`]
/// allows to one side, halved since there are two sides.
const ASIDE: f64 = 0.06;
/// The share of the way between two things that is between them: the middle half. Chosen: in the outer quarters one
/// would say "beside".
const MIDDLE: f64 = 0.5;

/// A place by its name or by its relation to others.
#[derive(Debug, Clone, PartialEq)]
pub enum Region {
    /// On the table, on another thing or in it.
    On(String),
    /// At a point, on whatever is there.
    Point([f64; 2]),
    /// At a point, on what is named; `None` is the table.
    Spot {
        /// The point, m.
        at: [f64; 2],
        /// What bears what stands there.
        on: Option<String>,
    },
    /// Beside a thing, on what bears that thing.
    Beside {
        /// The thing.
        of: String,
        /// The direction in the plane of the table in which it lies from `of`, of length 1; `None` is any.
        way: Option<[f64; 2]>,
    },
    /// Between two things, on what bears the first.
    Between(String, String),
    /// On the table, away from circles that are to stay free: x, y and radius, m.
    Away(Vec<[f64; 3]>),
    /// Unknown, because this thing has not been seen.
    Unknown(String),
}

/// What bears what stands in a region.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Bearer {
    /// The table, or a thing by its name.
    This(String),
    /// Whatever is there.
    Any,
}

impl std::fmt::Display for Bearer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::This(name) => name,
            Self::Any => TABLE,
        })
    }
}

/// What tables are called.
pub const TABLE: &str = "table";

/// The thing that a region depends on and whose position is unknown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unseen(pub String);

impl Region {
    /// Returns the things that it is told by.
    pub fn things(&self) -> Vec<&str> {
        match self {
            Self::On(name) | Self::Beside { of: name, .. } => vec![name],
            Self::Between(a, b) => vec![a, b],
            Self::Point(_) | Self::Spot { .. } | Self::Away(_) | Self::Unknown(_) => Vec::new(),
        }
    }

    /// Returns what bears what stands in it.
    ///
    /// # Errors
    ///
    /// [`Unseen`] when the position of a thing that it depends on is unknown.
    pub fn bearer(&self, scene: &Scene, objects: &[ObjectState]) -> Result<Bearer, Unseen> {
        let named = |name: Option<String>| Bearer::This(name.unwrap_or_else(|| TABLE.to_owned()));
        match self {
            Self::On(name) => Ok(Bearer::This(name.clone())),
            Self::Point(_) => Ok(Bearer::Any),
            Self::Away(_) => Ok(named(None)),
            Self::Unknown(name) => Err(Unseen(name.clone())),
            Self::Spot { on, .. } => Ok(named(on.clone())),
            Self::Beside { of, .. } | Self::Between(of, _) => {
                let unseen = || Unseen(of.clone());
                let object = scene.object(of).ok_or_else(unseen)?;
                let pose = objects.iter().find(|known| known.name == *of);
                let pose = pose.and_then(|known| known.world_from_object).ok_or_else(unseen)?;
                Ok(named(support::below(scene, objects, object, &pose).name))
            }
        }
    }

    /// Returns how far inside `o` is with the middle of its base at `at`, m; negative outside, infinite where only
    /// what bears it counts.
    ///
    /// # Errors
    ///
    /// [`Unseen`] when the position of a thing that it depends on is unknown.
    pub fn margin(
        &self,
        scene: &Scene,
        objects: &[ObjectState],
        o: &Object,
        at: [f64; 2],
    ) -> Result<f64, Unseen> {
        let at = Vector2::from(at);
        match self {
            Self::On(_) => Ok(f64::INFINITY),
            Self::Unknown(name) => Err(Unseen(name.clone())),
            Self::Point(point) | Self::Spot { at: point, .. } => {
                Ok(AT - (at - Vector2::from(*point)).norm())
            }
            Self::Away(circles) => {
                let clear = circles.iter().map(|[x, y, radius]| {
                    (at - Vector2::new(*x, *y)).norm() - radius - o.shape.outer_radius() - NEAR
                });
                Ok(clear.fold(f64::INFINITY, f64::min))
            }
            Self::Beside { of, way } => {
                let (middle, radius) = standing(scene, objects, of)?;
                let from = at - middle;
                let near = NEAR - (from.norm() - radius - o.shape.outer_radius());
                let Some(way) = way else { return Ok(near) };
                // Within 45 deg of the direction: the distance from the nearer edge of that quarter.
                let along = from.dot(&Vector2::from(*way));
                let across = from.perp(&Vector2::from(*way)).abs();
                Ok(near.min((along - across) * std::f64::consts::FRAC_1_SQRT_2))
            }
            Self::Between(a, b) => {
                let (a, _) = standing(scene, objects, a)?;
                let (b, _) = standing(scene, objects, b)?;
                let line = b - a;
                let way = line.try_normalize(1e-9).unwrap_or_else(Vector2::zeros);
                let from = at - 0.5 * (a + b);
                let along = 0.5 * MIDDLE * line.norm() - from.dot(&way).abs();
                Ok(along.min(ASIDE - from.perp(&way).abs()))
            }
        }
    }

    /// Returns the middle of the region and how far it reaches from there, m; `None` for what only its bearer bounds.
    ///
    /// # Errors
    ///
    /// [`Unseen`] when the position of a thing that it depends on is unknown.
    pub fn extent(
        &self,
        scene: &Scene,
        objects: &[ObjectState],
        o: &Object,
    ) -> Result<Option<([f64; 2], f64)>, Unseen> {
        Ok(match self {
            Self::On(_) | Self::Away(_) => None,
            Self::Unknown(name) => return Err(Unseen(name.clone())),
            Self::Point(point) | Self::Spot { at: point, .. } => Some((*point, AT)),
            Self::Beside { of, .. } => {
                let (middle, radius) = standing(scene, objects, of)?;
                Some((middle.into(), radius + o.shape.outer_radius() + NEAR))
            }
            Self::Between(a, b) => {
                let (a, _) = standing(scene, objects, a)?;
                let (b, _) = standing(scene, objects, b)?;
                let half = 0.5 * MIDDLE * (b - a).norm();
                Some(((0.5 * (a + b)).into(), half.max(ASIDE)))
            }
        })
    }
}

/// Returns the middle of a thing's base and its radius, m.
fn standing(
    scene: &Scene,
    objects: &[ObjectState],
    name: &str,
) -> Result<(Vector2<f64>, f64), Unseen> {
    let unseen = || Unseen(name.to_owned());
    let object = scene.object(name).ok_or_else(unseen)?;
    let known = objects.iter().find(|known| known.name == name).ok_or_else(unseen)?;
    let pose = known.world_from_object.ok_or_else(unseen)?;
    Ok((pose.origin().xy(), object.shape.outer_radius()))
}

#[cfg(test)]
mod tests {
    use super::super::object::{Shape, vessel};
    use super::super::{Pose, scene};
    use super::*;

    fn cup(name: &str) -> Object {
        let shape = Shape::Cylinder { radius: 0.04, height: 0.09 };
        Object { name: name.into(), ..vessel(shape, 1e-3) }
    }

    fn at(name: &str, x: f64, y: f64) -> ObjectState {
        let world_from_object = Some(Pose::upright(x, y, 0.0, 0.0));
        ObjectState { name: name.into(), world_from_object, std: 0.001, water: None }
    }

    #[test]
    fn beside_is_near_and_on_the_side_that_is_named() {
        let scene = scene::bare(vec![cup("a"), cup("o")]);
        let objects = [at("a", 0.5, 0.0)];
        let o = scene.object("o").unwrap();
        let left = Region::Beside { of: "a".into(), way: Some([0.0, 1.0]) };
        let of = |x, y| left.margin(&scene, &objects, o, [x, y]).unwrap();
        // 0.14 m apart leave 0.06 m between the two.
        assert!((of(0.5, 0.14) - 0.06).abs() < 1e-12);
        assert!(of(0.5, -0.14) < 0.0, "that is right of it");
        assert!(of(0.64, 0.13) < 0.0, "that is behind it");
        assert!(of(0.5, 0.21) < 0.0, "that is far from it");
        let any = Region::Beside { of: "a".into(), way: None };
        assert!((any.margin(&scene, &objects, o, [0.5, -0.14]).unwrap() - 0.06).abs() < 1e-12);
        assert_eq!(any.bearer(&scene, &objects), Ok(Bearer::This("table".into())));
    }

    #[test]
    fn between_is_the_middle_half_of_the_way() {
        let scene = scene::bare(vec![cup("a"), cup("b"), cup("o")]);
        let objects = [at("a", 0.5, -0.2), at("b", 0.5, 0.2)];
        let o = scene.object("o").unwrap();
        let between = Region::Between("a".into(), "b".into());
        let of = |x, y| between.margin(&scene, &objects, o, [x, y]).unwrap();
        assert!((of(0.5, 0.0) - 0.06).abs() < 1e-12);
        assert!((of(0.5, 0.08) - 0.02).abs() < 1e-12);
        assert!(of(0.5, 0.15) < 0.0 && of(0.58, 0.0) < 0.0);
    }

    #[test]
    fn what_nobody_saw_is_named() {
        let scene = scene::bare(vec![cup("a"), cup("o")]);
        let o = scene.object("o").unwrap();
        let beside = Region::Beside { of: "a".into(), way: None };
        assert_eq!(beside.margin(&scene, &[], o, [0.5, 0.0]), Err(Unseen("a".into())));
        assert_eq!(beside.bearer(&scene, &[]), Err(Unseen("a".into())));
    }
}
