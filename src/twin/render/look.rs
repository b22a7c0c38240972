//! What the arm looks like: the visual shapes of its URDF, painted, and the marker ball on its gripper.
//!
//! A cylinder whose collision shapes cap it with balls of its own radius is drawn as the capsule that was
//! meant. Meshes are not read: a link without a plain shape is not drawn, and [`ArmLook::skipped`] says so.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use urdf_rs::Geometry;

use super::view::{Body, Paint, Shape};
use crate::twin::Error;

/// The link that carries the marker ball.
pub const MARKER_LINK: &str = "gripper_base_link";

/// A matt coloured ball glued to the gripper, by which a camera sees where the tool is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marker {
    /// Its centre in the frame of [`MARKER_LINK`], which nominally is the flange's, m.
    pub centre: Vector3<f64>,
    /// Its radius, m.
    pub radius: f64,
    /// Its colour, sRGB.
    pub colour: [u8; 3],
}

impl Default for Marker {
    /// On the +y side of the gripper's body, which is its upper side in a level grasp.
    fn default() -> Self {
        Self { centre: Vector3::new(0.0, 0.060, 0.075), radius: 0.014, colour: [208, 32, 143] }
    }
}

/// The painted shapes of an arm, link by link.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmLook {
    parts: Vec<Part>,
    /// The marker ball; `None` when none is mounted.
    pub marker: Option<Marker>,
    /// Links whose visual shape cannot be drawn, with the reason.
    pub skipped: Vec<String>,
}

#[derive(Debug, Clone, PartialEq)]
struct Part {
    link: String,
    placed: Isometry3<f64>,
    shape: Shape,
    paint: Paint,
}

impl ArmLook {
    /// Returns the look of a robot given as the text of a URDF.
    ///
    /// # Errors
    ///
    /// [`Error::Robot`] when the text is no URDF.
    pub fn from_urdf_text(text: &str) -> Result<Self, Error> {
        let robot = urdf_rs::read_from_string(text)
            .map_err(|error| Error::Robot(format!("the robot file cannot be read: {error}")))?;
        Ok(Self::new(&robot))
    }

    /// Returns the look of a robot described in URDF, with the default marker if it has the link for it.
    pub fn new(robot: &urdf_rs::Robot) -> Self {
        let mut parts = Vec::new();
        let mut skipped = Vec::new();
        for link in &robot.links {
            for (k, visual) in link.visual.iter().enumerate() {
                let placed = isometry(&visual.origin);
                let shape = match &visual.geometry {
                    Geometry::Box { size } => Shape::Cuboid(Vector3::from(size.0)),
                    Geometry::Sphere { radius } => Shape::Sphere(*radius),
                    Geometry::Capsule { radius, length } => {
                        Shape::Capsule { radius: *radius, length: *length }
                    }
                    Geometry::Cylinder { radius, length } => {
                        let capped = [-0.5, 0.5].iter().all(|end| {
                            let tip = placed * nalgebra::Point3::new(0.0, 0.0, end * length);
                            link.collision.iter().any(|c| match c.geometry {
                                Geometry::Sphere { radius: r } => {
                                    let centre = Vector3::from(c.origin.xyz.0);
                                    (r - radius).abs() < 1e-4 && (centre - tip.coords).norm() < 1e-3
                                }
                                _ => false,
                            })
                        });
                        if capped {
                            Shape::Capsule { radius: *radius, length: *length }
                        } else {
                            Shape::Cylinder { radius: *radius, length: *length }
                        }
                    }
                    Geometry::Mesh { filename, .. } => {
                        skipped.push(format!("{}: mesh {filename}", link.name));
                        continue;
                    }
                };
                let paint = paint(&link.name, k, visual);
                parts.push(Part { link: link.name.clone(), placed, shape, paint });
            }
        }
        let carries = robot.links.iter().any(|link| link.name == MARKER_LINK);
        let marker = carries.then(Marker::default);
        if let Some(marker) = marker {
            // A thin stalk from the gripper's body to the ball.
            let length = marker.centre.y - 0.03;
            let turn =
                UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
            let middle =
                Vector3::new(marker.centre.x, marker.centre.y - length / 2.0, marker.centre.z);
            parts.push(Part {
                link: MARKER_LINK.to_owned(),
                placed: Isometry3::from_parts(Translation3::from(middle), turn),
                shape: Shape::Cylinder { radius: 0.003, length },
                paint: Paint::opaque([70, 70, 72], 0.2),
            });
        }
        Self { parts, marker, skipped }
    }

    /// Returns the arm's bodies with its links at `links` (world from link); links not named are left out.
    pub(super) fn bodies(&self, links: &BTreeMap<&str, Isometry3<f64>>) -> Vec<Body> {
        self.parts
            .iter()
            .filter(|part| self.marker.is_some() || part.link != MARKER_LINK)
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
}

/// The URDF's own colour when it has one; else light housings, a dark gripper, grey jaws.
fn paint(link: &str, k: usize, visual: &urdf_rs::Visual) -> Paint {
    if let Some(colour) = visual.material.as_ref().and_then(|material| material.color.as_ref()) {
        let colour = [0, 1, 2].map(|i| (colour.rgba.0[i].clamp(0.0, 1.0) * 255.0).round() as u8);
        return Paint::opaque(colour, 0.4);
    }
    if link.contains("jaw") || link.contains("finger") {
        Paint::opaque([92, 94, 98], 0.35)
    } else if link.contains("gripper") || k > 0 {
        Paint::opaque([38, 39, 42], 0.45)
    } else {
        Paint::opaque([196, 199, 202], 0.5)
    }
}

fn isometry(pose: &urdf_rs::Pose) -> Isometry3<f64> {
    let [roll, pitch, yaw] = pose.rpy.0;
    Isometry3::from_parts(
        Translation3::from(Vector3::from(pose.xyz.0)),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}
