//! What the arm looks like: the visual shapes of the robot, painted, and the marker ball on its gripper.
//!
//! A cylinder that the robot collides with as a capsule is drawn as the capsule that was meant. A link
//! without a plain shape is not drawn; [`Robot::notes`] says so.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Vector3};

use super::view::{Ball, Body, Paint, Shape};
use crate::motion::Robot;
use crate::motion::robot::{Link, Marker, Visual};
use crate::motion::solid::{Placed, Solid};

/// Radius of the rod that holds the marker ball, m. Chosen: thinner than a pixel it would not be seen.
const STALK: f64 = 0.003;

/// The painted shapes of an arm, link by link.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmLook {
    parts: Vec<Part>,
    ball: Option<MarkerBall>,
}

/// A shape on a link.
#[derive(Debug, Clone, PartialEq)]
struct Part {
    link: String,
    placed: Isometry3<f64>,
    shape: Shape,
    paint: Paint,
}

/// The marker and what holds it.
#[derive(Debug, Clone, PartialEq)]
struct MarkerBall {
    marker: Marker,
    stalk: Part,
}

impl ArmLook {
    /// Returns the look of a robot, with its marker if it has one.
    pub fn new(robot: &Robot) -> Self {
        let parts = robot.links().iter().flat_map(|link| {
            link.visual.iter().enumerate().map(|(k, visual)| Part {
                link: link.name.clone(),
                placed: visual.placed.pose,
                shape: shape(&as_meant(link, &visual.placed)),
                paint: paint(&link.name, k, visual),
            })
        });
        let ball = robot.marker().map(|&marker| {
            // From the link's axis, inside its body, straight out to the ball.
            let axis = Vector3::new(0.0, 0.0, marker.centre.z);
            let rod = Placed::capsule(axis, marker.centre, STALK);
            let stalk = Part {
                link: robot.links()[marker.link].name.clone(),
                placed: rod.pose,
                shape: shape(&rod.solid),
                paint: Paint::opaque([70, 70, 72], 0.2),
            };
            MarkerBall { marker, stalk }
        });
        Self { parts: parts.collect(), ball }
    }

    /// Returns the arm's bodies with its links at `links` (world from link); links not named are left out.
    pub(super) fn bodies(&self, links: &BTreeMap<&str, Isometry3<f64>>) -> Vec<Body> {
        let stalk = self.ball.iter().map(|ball| &ball.stalk);
        self.parts
            .iter()
            .chain(stalk)
            .filter_map(|part| {
                let world_from_link = links.get(part.link.as_str())?;
                Some(Body {
                    name: part.link.clone(),
                    shape: part.shape.clone(),
                    world_from_body: world_from_link * part.placed,
                    paint: part.paint,
                })
            })
            .collect()
    }

    /// Returns the marker ball where the link it sits on is, if that link is among `links`.
    pub(super) fn marker(&self, links: &BTreeMap<&str, Isometry3<f64>>) -> Option<Ball> {
        let MarkerBall { marker, stalk } = self.ball.as_ref()?;
        let world_from_link = links.get(stalk.link.as_str())?;
        let centre = world_from_link * Point3::from(marker.centre);
        Some(Ball { centre: centre.coords, radius: marker.radius, colour: marker.colour })
    }
}

/// Returns the capsule that a cylinder stands for, or the shape itself: URDF has no capsule, so files give
/// a link's collision shape its caps as two more balls and leave them out of what is drawn.
fn as_meant(link: &Link, drawn: &Placed) -> Solid {
    let Solid::Cylinder { radius, half } = drawn.solid else { return drawn.solid };
    let ends = [-half, half].map(|z| drawn.pose * Point3::new(0.0, 0.0, z));
    let capped = link.collision.iter().any(|other| match other.solid {
        Solid::Capsule { radius: r, half: h } => {
            let theirs = [-h, h].map(|z| other.pose * Point3::new(0.0, 0.0, z));
            let near = |a: &Point3<f64>| theirs.iter().any(|b| (a - b).norm() < 1e-3);
            (r - radius).abs() < 1e-4 && ends.iter().all(near)
        }
        _ => false,
    });
    if capped { Solid::Capsule { radius, half } } else { drawn.solid }
}

fn shape(solid: &Solid) -> Shape {
    match *solid {
        Solid::Sphere { radius } => Shape::Sphere(radius),
        Solid::Capsule { radius, half } => Shape::Capsule { radius, length: 2.0 * half },
        Solid::Cylinder { radius, half } => Shape::Cylinder { radius, length: 2.0 * half },
        Solid::Cuboid { half } => Shape::Cuboid(2.0 * half),
    }
}

/// The file's own colour when it has one; else light housings, a dark gripper, grey jaws.
fn paint(link: &str, k: usize, visual: &Visual) -> Paint {
    if let Some(colour) = visual.colour {
        Paint::opaque(colour, 0.4)
    } else if link.contains("jaw") || link.contains("finger") {
        Paint::opaque([92, 94, 98], 0.35)
    } else if link.contains("gripper") || k > 0 {
        Paint::opaque([38, 39, 42], 0.45)
    } else {
        Paint::opaque([196, 199, 202], 0.5)
    }
}
