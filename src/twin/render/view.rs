//! What a picture is taken of: shapes with paint at poses, water, marks and light.
//!
//! A [`View`] is made from a scene and a state ([`View::of`]), so the same code draws what the twin
//! believes and what the laboratory shows. Lengths in m, poses in the world frame.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Vector3};

use super::look::ArmLook;
use crate::world::{Drawer, Mark, Material, Object, Scene, Table, WorldState, object};

/// Nothing was hit, or only the room.
pub const NOTHING: u16 = 0;
/// The table.
pub const TABLE: u16 = 1;
/// Water that is in no vessel.
pub const WATER: u16 = 2;
/// The marker ball on the gripper.
pub const MARKER: u16 = 3;
/// The first of [`View::bodies`]; body `k` is `FIRST_BODY + k`.
pub const FIRST_BODY: u16 = 16;

/// The geometry of a body in its own frame, m.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A box about the origin: edge lengths.
    Cuboid(Vector3<f64>),
    /// A cylinder about z, centred on the origin.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Length.
        length: f64,
    },
    /// A capsule about z, centred on the origin.
    Capsule {
        /// Radius.
        radius: f64,
        /// Length without the caps.
        length: f64,
    },
    /// A ball about the origin.
    Sphere(f64),
    /// A surface of triangles, seen from both sides.
    Mesh {
        /// Corners.
        vertices: Vec<Vector3<f64>>,
        /// Three corners each.
        triangles: Vec<[usize; 3]>,
    },
    /// A solid in the frame of a scene's object: origin at the centre of its base, z up.
    Standing(object::Shape),
    /// An open-topped vessel in the frame of a scene's object: origin at the centre of its base, z up.
    Vessel {
        /// The outside.
        outside: object::Shape,
        /// Thickness of walls and floor.
        wall: f64,
        /// Water inside, m³; its surface is drawn level, as it is at rest.
        water: f64,
    },
}

/// What light does to a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paint {
    /// Colour, sRGB.
    pub colour: [u8; 3],
    /// Whether it is glass: then the colour is not used.
    pub transparent: bool,
    /// How shiny, 0 (chalk) to 1 (polished).
    pub specular: f64,
}

impl Paint {
    /// Returns a matt to shiny opaque paint.
    pub fn opaque(colour: [u8; 3], specular: f64) -> Self {
        Self { colour, transparent: false, specular }
    }

    /// Returns clear glass.
    pub fn glass() -> Self {
        Self { colour: [235, 240, 238], transparent: true, specular: 1.0 }
    }
}

/// One thing to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// The scene's object or the robot's link it belongs to.
    pub name: String,
    /// Its geometry.
    pub shape: Shape,
    /// Where its frame is in the world.
    pub world_from_body: Isometry3<f64>,
    /// What it looks like.
    pub paint: Paint,
}

/// A large lamp far away, and the light that comes from everywhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Towards the lamp, world; need not be a unit vector.
    pub towards: Vector3<f64>,
    /// What the lamp adds to a white surface that faces it, 1 is white paper in a good exposure.
    pub intensity: f64,
    /// What the surroundings add to a white surface that faces up.
    pub ambient: f64,
    /// Half the angle the lamp covers, rad: how soft shadows are.
    pub spread: f64,
    /// Colour of the lamp: factors on red, green and blue.
    pub tint: [f64; 3],
}

impl Default for Light {
    /// A ceiling panel in front and to the left of the table. Chosen for a table of middle brightness.
    fn default() -> Self {
        Self {
            towards: Vector3::new(0.45, -0.5, 1.3),
            intensity: 0.52,
            ambient: 0.44,
            spread: 0.16,
            tint: [1.0, 0.985, 0.955],
        }
    }
}

/// The marker ball where it is now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Its centre, m, world.
    pub centre: Vector3<f64>,
    /// Its radius, m.
    pub radius: f64,
    /// Its colour, sRGB.
    pub colour: [u8; 3],
}

/// Everything a picture shows.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// The table.
    pub table: Table,
    /// Printed dots on it.
    pub marks: Vec<Mark>,
    /// Objects first, in the scene's order, then the robot, then the handles of drawers under the names of their trays.
    pub bodies: Vec<Body>,
    /// Centres of water particles, m, world. Those inside a vessel of `bodies` are not drawn: the
    /// vessel's own `water` stands for them.
    pub water: Vec<Vector3<f32>>,
    /// Radius of the ball of a particle's volume, m.
    pub particle_radius: f64,
    /// The light.
    pub light: Light,
    /// The marker ball on the gripper, if it is mounted.
    pub marker: Option<Ball>,
}

impl View {
    /// Returns the view of a scene in a state: objects at known poses, filled as the state says, the arm as
    /// `look` describes it with its links at `links` (world from link, by name), the marker on its gripper.
    ///
    /// Objects nobody has seen are left out; water outside vessels is added by [`Self::with_water`].
    pub fn of<Name: AsRef<str>>(
        scene: &Scene,
        state: &WorldState,
        look: &ArmLook,
        links: &[(Name, Isometry3<f64>)],
    ) -> Self {
        let mut bodies = Vec::new();
        for object in &scene.objects {
            let Some(state) = state.object(&object.name) else { continue };
            let Some(pose) = state.world_from_object else { continue };
            bodies.push(Body {
                name: object.name.clone(),
                shape: shape_of(object, state.water.unwrap_or(0.0)),
                world_from_body: *pose.isometry(),
                paint: paint_of(object),
            });
        }
        let arm = Self::of_arm(scene, look, links);
        bodies.extend(arm.bodies);
        bodies.extend(scene.drawers.iter().flat_map(|drawer| handle_of(scene, state, drawer)));
        Self { bodies, ..arm }
    }

    /// Returns the view of the table and the arm alone.
    pub fn of_arm<Name: AsRef<str>>(
        scene: &Scene,
        look: &ArmLook,
        links: &[(Name, Isometry3<f64>)],
    ) -> Self {
        let poses: BTreeMap<&str, Isometry3<f64>> =
            links.iter().map(|(name, pose)| (name.as_ref(), *pose)).collect();
        let bodies = look.bodies(&poses);
        let marker = look.marker(&poses);
        Self {
            table: scene.table,
            marks: scene.marks.clone(),
            bodies,
            water: Vec::new(),
            particle_radius: 0.004,
            light: Light::default(),
            marker,
        }
    }

    /// Adds an object as a solid that is not clear, for [`super::solids`].
    #[must_use]
    pub fn with_silhouette(mut self, object: &Object, world_from_object: Isometry3<f64>) -> Self {
        self.bodies.push(Body {
            name: object.name.clone(),
            shape: Shape::Standing(object.shape.clone()),
            world_from_body: world_from_object,
            paint: Paint::opaque(object.colour, 0.0),
        });
        self
    }

    /// Adds water particles: centres (m, world) and the radius of the ball of a particle's volume, m.
    #[must_use]
    pub fn with_water(mut self, particles: &[Vector3<f32>], radius: f64) -> Self {
        self.water = particles.to_vec();
        self.particle_radius = radius;
        self
    }

    /// Returns the id under which the first body of that name appears in a frame.
    pub fn id_of(&self, name: &str) -> Option<u16> {
        let at = self.bodies.iter().position(|body| body.name == name)?;
        u16::try_from(at).ok().map(|at| FIRST_BODY + at)
    }

    /// Returns the name of the body with that id.
    pub fn name_of(&self, id: u16) -> Option<&str> {
        let at = usize::from(id.checked_sub(FIRST_BODY)?);
        self.bodies.get(at).map(|body| body.name.as_str())
    }
}

/// Returns the shape of a scene's object with `water` m³ in it.
fn shape_of(object: &Object, water: f64) -> Shape {
    match object.cavity {
        Some(cavity) => Shape::Vessel { outside: object.shape.clone(), wall: cavity.wall, water },
        None => Shape::Standing(object.shape.clone()),
    }
}

/// Returns the bar of a drawer and its posts.
fn handle_of(scene: &Scene, state: &WorldState, drawer: &Drawer) -> Vec<Body> {
    let pose = state.object(&drawer.tray).and_then(|known| known.world_from_object);
    let (Some(tray), Some(pose)) = (scene.object(&drawer.tray), pose) else { return Vec::new() };
    let part = |(at, shape): (Vector3<f64>, object::Shape)| Body {
        name: drawer.tray.clone(),
        shape: Shape::Standing(shape),
        world_from_body: pose.isometry() * Isometry3::from(at),
        paint: paint_of(tray),
    };
    drawer.handle(tray).into_iter().map(part).collect()
}

fn paint_of(object: &Object) -> Paint {
    match object.material {
        // Light is followed through vessels and simple solids only; a mesh is drawn as what is not clear.
        Material::Transparent if !matches!(object.shape, object::Shape::Mesh { .. }) => {
            Paint::glass()
        }
        _ => Paint::opaque(object.colour, 0.35),
    }
}
