//! A scene: what a laboratory knows before it looks. Dimensions and rough guesses, no positions.
//!
//! [`Scene`] is constant once built. It is read from a `scene` item of the task language by
//! [`Scene::from_item`]; the camera pose in it is a guess that alignment corrects.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::camera::{Camera, Intrinsics};
use super::frame::{Base, Pose, World};
use super::object::{Cavity, Material, Object, Shape};
use crate::language::ast::{Expr, ExprKind, Literal, Property, SceneItem, SceneThing, Span};
use crate::language::{Diagnostic, Source, nearest};
use crate::units::{Dimension, Quantity, known_units};

/// A printed dot on the table, a reference point of regression 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// Its centre on the table top, m.
    pub x: f64,
    /// Its centre on the table top, m.
    pub y: f64,
    /// Its radius, m.
    pub radius: f64,
}

/// The table: a slab whose top is the plane z = 0 of the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Extent along x, y and z, m.
    pub size: Vector3<f64>,
    /// Centre of the top, m.
    pub centre: [f64; 2],
    /// Colour, sRGB.
    pub colour: [u8; 3],
}

impl Table {
    /// Returns the corners of the top, counter-clockwise from (-x, -y), m.
    pub fn corners(&self) -> [[f64; 2]; 4] {
        let (hx, hy) = (self.size.x / 2.0, self.size.y / 2.0);
        let [cx, cy] = self.centre;
        [[cx - hx, cy - hy], [cx + hx, cy - hy], [cx + hx, cy + hy], [cx - hx, cy + hy]]
    }

    /// Returns whether a point of the plane lies on the table, at least `margin` m from its edge.
    pub fn holds(&self, x: f64, y: f64, margin: f64) -> bool {
        (x - self.centre[0]).abs() <= self.size.x / 2.0 - margin
            && (y - self.centre[1]).abs() <= self.size.y / 2.0 - margin
    }
}

/// What stands in the room, as far as it is known beforehand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Its name in the program.
    pub name: String,
    /// The table.
    pub table: Table,
    /// Printed dots on the table.
    pub marks: Vec<Mark>,
    /// The things that may be moved, in the order they are declared.
    pub objects: Vec<Object>,
    /// The camera as it is thought to be: name and guess.
    pub camera_name: String,
    /// The camera as it is thought to be.
    pub camera: Camera,
    /// The robot's folder in `stdlib/robots/`.
    pub robot: String,
    /// Where the robot is mounted.
    pub world_from_base: Pose<World, Base>,
}

impl Scene {
    /// Reads a scene item: units, sizes and sanity are checked here, names and syntax before.
    ///
    /// What a thing does not say has a default: `wall 3 mm` for a `Container`; `holds` what fits to the
    /// brim; `filled` nothing; `mass` from its volume; the colour its looks name, else grey. `looks`
    /// with "transparent", "clear" or "glass" in it makes it transparent. The position of a thing other
    /// than the table is not kept: the camera finds it.
    ///
    /// # Errors
    ///
    /// Everything that is wrong, at once, each at its place in `source`.
    pub fn from_item(item: &SceneItem, source: &Source) -> Result<Self, Vec<Diagnostic>> {
        let mut reader = Reader { source, diagnostics: Vec::new() };
        let scene = reader.scene(item);
        match scene {
            Some(scene) if reader.diagnostics.is_empty() => Ok(scene),
            _ => Err(reader.diagnostics),
        }
    }

    /// Returns the object of that name.
    pub fn object(&self, name: &str) -> Option<&Object> {
        self.objects.iter().find(|object| object.name == name)
    }
}

/// Properties a thing may have.
const PROPERTIES: &[&str] = &["wall", "holds", "filled", "mass", "looks", "colour"];

/// Colour words that `looks` may hold, with sRGB.
const COLOURS: &[(&str, [u8; 3])] = &[
    ("red", [192, 40, 40]),
    ("green", [40, 150, 70]),
    ("blue", [32, 80, 192]),
    ("yellow", [220, 190, 40]),
    ("orange", [225, 120, 30]),
    ("white", [235, 235, 235]),
    ("black", [35, 35, 35]),
    ("brown", [120, 80, 50]),
];

/// Density of an empty vessel's walls, kg/m³: between polystyrene and acrylic (data sheets: 1050, 1190).
const WALL_DENSITY: f64 = 1100.0;

/// Density of a solid thing, kg/m³: a hard wood. Chosen.
const SOLID_DENSITY: f64 = 700.0;

/// Reads one scene and collects what is wrong in it.
struct Reader<'a> {
    source: &'a Source,
    diagnostics: Vec<Diagnostic>,
}

impl Reader<'_> {
    fn tell(
        &mut self,
        code: &'static str,
        span: Span,
        message: impl Into<String>,
        label: &str,
        help: impl Into<String>,
    ) {
        let mut found = Diagnostic::error(code, span, message, label).help(help);
        found.file.clone_from(&self.source.name);
        self.diagnostics.push(found);
    }

    fn scene(&mut self, item: &SceneItem) -> Option<Scene> {
        let mut table = None;
        let mut objects: Vec<Object> = Vec::new();
        for thing in &item.things {
            if thing.name.text == "table" {
                table = self.table(thing).or(table);
                continue;
            }
            if objects.iter().any(|object| object.name == thing.name.text) {
                self.tell(
                    "task::duplicate",
                    thing.name.span,
                    format!("there are two things called `{}`", thing.name.text),
                    "the second one",
                    "give each its own name, such as `cup` and `cup2`",
                );
            }
            objects.extend(self.object(thing));
        }
        let declared = item.things.iter().any(|thing| thing.name.text == "table");
        if !declared {
            self.tell(
                "task::missing",
                item.name.span,
                format!("the scene `{}` has no table", item.name.text),
                "things need something to stand on",
                "add `table: Surface = box(120 cm, 80 cm, 2 cm) at (0.5 m, 0 m)`",
            );
        }
        let mut marks = Vec::new();
        for group in &item.marks {
            let radius = self.length(group.radius, "the radius of a mark", 0.2);
            for [x, y] in &group.centres {
                let x = self.coordinate(*x)?;
                let y = self.coordinate(*y)?;
                let (Some(radius), Some(table)) = (radius, table.as_ref()) else { continue };
                if !Table::holds(table, x.value, y.value, radius) {
                    self.tell(
                        "task::outside",
                        Span { from: x.from, to: y.to },
                        "this mark does not lie on the table",
                        "outside",
                        format!(
                            "the table reaches from ({:.2} m, {:.2} m) to ({:.2} m, {:.2} m)",
                            table.corners()[0][0],
                            table.corners()[0][1],
                            table.corners()[2][0],
                            table.corners()[2][1]
                        ),
                    );
                }
                marks.push(Mark { x: x.value, y: y.value, radius });
            }
        }
        let camera = self.camera(item);
        let robot = self.robot(item);
        let (camera_name, camera) = camera?;
        let (robot, world_from_base) = robot?;
        Some(Scene {
            name: item.name.text.clone(),
            table: table?,
            marks,
            objects,
            camera_name,
            camera,
            robot,
            world_from_base,
        })
    }

    fn camera(&mut self, item: &SceneItem) -> Option<(String, Camera)> {
        let Some(camera) = item.cameras.first() else {
            self.tell(
                "task::missing",
                item.name.span,
                format!("the scene `{}` has no camera", item.name.text),
                "nothing could be seen",
                "add `camera overhead { image 1280 x 720  focal ~ 900 px  at (…) looking (…) }`",
            );
            return None;
        };
        if let Some(second) = item.cameras.get(1) {
            self.tell(
                "task::duplicate",
                second.name.span,
                "a scene has one camera",
                "the second one",
                "keep the camera that looks at the table",
            );
        }
        if !(camera.focal > 0.0 && camera.focal.is_finite()) {
            self.tell(
                "task::size",
                camera.span,
                format!("a focal length of {} px is impossible", camera.focal),
                "not above 0",
                "a usual one is close to the width of the picture",
            );
            return None;
        }
        let eye = self.point(&camera.at)?;
        let target = self.point(&camera.looking)?;
        if (eye - target).norm() < 1e-3 || eye.z <= 0.0 {
            self.tell(
                "task::outside",
                camera.span,
                format!("the camera `{}` cannot see the table from there", camera.name.text),
                "at the height of the table, or where it looks",
                "the table top is at z = 0; the camera stands above it and looks at it",
            );
            return None;
        }
        let [width, height] = camera.image;
        let intrinsics = Intrinsics::centred(camera.focal, width, height);
        Some((camera.name.text.clone(), Camera::looking(intrinsics, eye, target)))
    }

    fn robot(&mut self, item: &SceneItem) -> Option<(String, Pose<World, Base>)> {
        if let Some(second) = item.robots.get(1) {
            self.tell(
                "task::duplicate",
                second.span,
                "a scene has one robot",
                "the second one",
                "remove one of them",
            );
        }
        let Some(robot) = item.robots.first() else {
            self.tell(
                "task::missing",
                item.name.span,
                format!("the scene `{}` has no robot", item.name.text),
                "nothing could be moved",
                "add `robot gen3_2f85 at (0 m, 0 m, 0 m)`",
            );
            return None;
        };
        let at = self.point(&robot.at)?;
        Some((robot.name.text.clone(), Pose::upright(at.x, at.y, at.z, 0.0)))
    }

    fn table(&mut self, thing: &SceneThing) -> Option<Table> {
        let Some(Shape::Cuboid { size }) = self.shape(thing, 10.0) else {
            if self.diagnostics.is_empty() {
                self.tell(
                    "task::type",
                    thing.shape.span,
                    "a table is a box",
                    "not a box",
                    "write `box(120 cm, 80 cm, 2 cm)`: along x, along y, thickness",
                );
            }
            return None;
        };
        let mut centre = [0.0; 2];
        if let Some((at, span)) = &thing.at {
            if at.len() < 2 {
                self.tell(
                    "task::point",
                    *span,
                    "the table's centre needs x and y",
                    "too few",
                    "write `at (0.5 m, 0 m)`",
                );
                return None;
            }
            for (i, literal) in at.iter().take(2).enumerate() {
                centre[i] = self.coordinate(*literal)?.value;
            }
        }
        let colour = self.properties(thing).colour.unwrap_or([200, 176, 144]);
        Some(Table { size, centre, colour })
    }

    fn object(&mut self, thing: &SceneThing) -> Option<Object> {
        let shape = self.shape(thing, 2.0);
        let given = self.properties(thing);
        for literal in thing.at.iter().flat_map(|(at, _)| at) {
            self.coordinate(*literal);
        }
        let shape = shape?;
        let looks = given.looks.unwrap_or_else(|| thing.name.text.clone());
        let lower = looks.to_lowercase();
        let transparent = ["transparent", "clear", "glass"].iter().any(|word| lower.contains(word));
        let material = if transparent { Material::Transparent } else { Material::Opaque };
        let named = COLOURS.iter().find(|(word, _)| lower.split_whitespace().any(|w| w == *word));
        let colour = given.colour.or(named.map(|(_, rgb)| *rgb)).unwrap_or(if transparent {
            [205, 220, 228]
        } else {
            [150, 150, 150]
        });
        let vessel = thing.ty.text == "Container"
            || given.wall.is_some()
            || given.holds.is_some()
            || given.filled.is_some();
        let mut object = Object {
            name: thing.name.text.clone(),
            kind: thing.ty.text.clone(),
            shape,
            cavity: None,
            looks,
            material,
            colour,
            mass: 0.0,
        };
        let mut solid = volume(&shape) * SOLID_DENSITY;
        if vessel {
            let wall = given.wall.unwrap_or(0.003);
            if wall >= shape.inner_radius() || wall >= shape.height() {
                self.tell(
                    "task::size",
                    thing.span,
                    format!("the walls of `{}` leave no room inside", thing.name.text),
                    "walls as thick as the vessel",
                    "give the thickness of one wall, such as `wall 3 mm`",
                );
                return None;
            }
            object.cavity = Some(Cavity { wall, capacity: 0.0, filled: 0.0 });
            let brim = object.inside().map_or(0.0, |inside| volume(&inside));
            let capacity = given.holds.unwrap_or(brim);
            let filled = given.filled.unwrap_or(0.0);
            // A rounded figure on a label may exceed the geometry by a little, not by more.
            if capacity > 1.02 * brim {
                self.tell(
                    "task::size",
                    thing.span,
                    format!(
                        "`{}` cannot hold {}: inside it measures {}",
                        thing.name.text,
                        Quantity::cubic_metres(capacity),
                        Quantity::cubic_metres(brim)
                    ),
                    "holds more than fits",
                    "correct `holds`, the outside, or `wall`",
                );
            }
            if filled > capacity {
                self.tell(
                    "task::size",
                    thing.span,
                    format!(
                        "`{}` is filled with {} but holds {}",
                        thing.name.text,
                        Quantity::cubic_metres(filled),
                        Quantity::cubic_metres(capacity)
                    ),
                    "fuller than full",
                    "correct `filled` or `holds`",
                );
            }
            object.cavity = Some(Cavity { wall, capacity, filled });
            solid = (volume(&shape) - brim) * WALL_DENSITY;
        }
        object.mass = given.mass.unwrap_or(solid);
        Some(object)
    }

    /// Reads `cuboid(x, y, z)`, `box(…)` or `cylinder(radius r, height h)`; no side above `most` m.
    fn shape(&mut self, thing: &SceneThing, most: f64) -> Option<Shape> {
        let call = &thing.shape;
        let mut named: Vec<(Option<&str>, f64)> = Vec::new();
        for arg in &call.args {
            let literal = literal(arg.values.first()?)?;
            let what = format!("a side of `{}`", thing.name.text);
            named.push((
                arg.name.as_ref().map(|n| n.text.as_str()),
                self.length(literal, &what, most)?,
            ));
        }
        let slots: &[&str] = match call.name.text.as_str() {
            "box" | "cuboid" => &["x", "y", "z"],
            "cylinder" => &["radius", "height"],
            other => {
                let help = match nearest(other, ["box", "cuboid", "cylinder"].into_iter()) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => {
                        "write `cuboid(6 cm, 6 cm, 14 cm)` or `cylinder(radius 4 cm, height 10 cm)`"
                            .into()
                    }
                };
                let message = format!("there is no shape `{other}`");
                self.tell("task::unknown_name", call.name.span, message, "not a shape", help);
                return None;
            }
        };
        let mut sides = vec![None; slots.len()];
        for (name, value) in named {
            // The breadth of a cup is what a ruler gives; half of it is what the shape wants.
            let (name, value) = match name {
                Some("diameter") => (Some("radius"), value / 2.0),
                name => (name, value),
            };
            let at = match name {
                Some(name) => slots.iter().position(|slot| *slot == name),
                None => sides.iter().position(Option::is_none),
            };
            match at.and_then(|at| sides.get_mut(at)) {
                Some(side) if side.is_none() => *side = Some(value),
                _ => {
                    sides.push(None);
                    break;
                }
            }
        }
        let complete: Option<Vec<f64>> = sides.into_iter().collect();
        match complete.as_deref() {
            Some([x, y, z]) => Some(Shape::Cuboid { size: Vector3::new(*x, *y, *z) }),
            Some([radius, height]) => Some(Shape::Cylinder { radius: *radius, height: *height }),
            _ => {
                let message = format!("a {} takes {}", call.name.text, slots.join(", "));
                let help = if slots.len() == 3 {
                    "write three sides, such as `cuboid(65 mm, 65 mm, 140 mm)`"
                } else {
                    "write `cylinder(radius 40 mm, height 95 mm)`"
                };
                self.tell("task::argument", call.span, message, "not what it takes", help);
                None
            }
        }
    }

    fn properties(&mut self, thing: &SceneThing) -> Given {
        let mut given = Given::default();
        for property in &thing.properties {
            let name = property.name.text.as_str();
            match name {
                "wall" => given.wall = self.amount(property, Dimension::LENGTH, "`3 mm`"),
                "holds" => given.holds = self.amount(property, Dimension::VOLUME, "`250 mL`"),
                "filled" => given.filled = self.amount(property, Dimension::VOLUME, "`150 mL`"),
                "mass" => given.mass = self.amount(property, Dimension::MASS, "`160 g`"),
                "looks" => given.looks = self.text(property),
                "colour" | "color" => {
                    let text = self.text(property);
                    given.colour = text.as_deref().and_then(rgb);
                    if text.is_some() && given.colour.is_none() {
                        self.tell(
                            "task::colour",
                            property.span,
                            "this is not a colour",
                            "expected red, green and blue",
                            "write it as `\"#2050c0\"`, or name it in `looks`",
                        );
                    }
                }
                other => {
                    let help = match nearest(other, PROPERTIES.iter().copied()) {
                        Some(near) => format!("did you mean `{near}`?"),
                        None => format!("known are: {}", PROPERTIES.join(", ")),
                    };
                    let message = format!("a thing has no `{other}`");
                    self.tell("task::unknown_name", property.name.span, message, "not known", help);
                }
            }
        }
        given
    }

    /// A property's one quantity, above 0 and of a dimension; `filled 0 mL` may be 0.
    fn amount(&mut self, property: &Property, dimension: Dimension, such: &str) -> Option<f64> {
        let name = &property.name.text;
        let quantity = match property.value.as_slice() {
            [one] => literal(one).map(|literal| literal.quantity),
            _ => None,
        };
        match quantity {
            Some(quantity) if quantity.dimension != dimension => {
                let is = quantity.dimension.words();
                let message = format!("`{name}` is {}, and this is {is}", dimension.words());
                let help = format!("write {}, such as {such}", dimension.words());
                self.tell("task::unit", property.span, message, "wrong unit", help);
                None
            }
            Some(quantity)
                if quantity.value > 0.0 || (name == "filled" && quantity.value >= 0.0) =>
            {
                Some(quantity.value)
            }
            Some(quantity) => {
                let message = format!("`{name}` cannot be {quantity}");
                self.tell(
                    "task::size",
                    property.span,
                    message,
                    "not above 0",
                    format!("such as {such}"),
                );
                None
            }
            None => {
                let message = format!("`{name}` takes one quantity");
                self.tell(
                    "task::type",
                    property.span,
                    message,
                    "expected one",
                    format!("such as {such}"),
                );
                None
            }
        }
    }

    fn text(&mut self, property: &Property) -> Option<String> {
        if let [Expr { kind: ExprKind::Text(text), .. }] = property.value.as_slice() {
            return Some(text.clone());
        }
        let name = &property.name.text;
        let message = format!("`{name}` takes a text in quotes");
        self.tell(
            "task::type",
            property.span,
            message,
            "expected a text",
            format!("such as `{name} \"…\"`"),
        );
        None
    }

    /// A length above 0 and at most `most` m.
    fn length(&mut self, literal: Literal, what: &str, most: f64) -> Option<f64> {
        let Quantity { value, dimension } = literal.quantity;
        if dimension != Dimension::LENGTH {
            let message = format!("{what} is a length, and this is {}", dimension.words());
            let text = self.source.slice(literal.span).to_string();
            let help = if dimension.is_none() {
                format!("write `{text} mm` or `{text} cm`")
            } else {
                format!("lengths are in mm, cm or m; known units: {}", known_units())
            };
            self.tell("task::unit", literal.span, message, "not a length", help);
            return None;
        }
        if value > 0.0 && value <= most {
            return Some(value);
        }
        let message = format!("{what} cannot be {}", literal.quantity);
        let help = format!("expected more than 0 and at most {}", Quantity::metres(most));
        self.tell("task::size", literal.span, message, "not a size it can have", help);
        None
    }

    /// A coordinate: a length of either sign.
    fn coordinate(&mut self, literal: Literal) -> Option<Coordinate> {
        let Quantity { value, dimension } = literal.quantity;
        // Zero is zero in every unit, but one habit is easier to read than two.
        if dimension == Dimension::LENGTH && value.abs() <= 10.0 {
            return Some(Coordinate { value, from: literal.span.from, to: literal.span.to });
        }
        let text = self.source.slice(literal.span).to_string();
        let (message, help) = if dimension == Dimension::LENGTH {
            (format!("{} is outside the laboratory", literal.quantity), "at most 10 m".to_string())
        } else if dimension.is_none() {
            (
                format!("a coordinate is a length, and `{text}` has no unit"),
                format!("write `{text} m`"),
            )
        } else {
            (
                format!("a coordinate is a length, and `{text}` is {}", dimension.words()),
                "write it in m".into(),
            )
        };
        self.tell("task::unit", literal.span, message, "expected a length", help);
        None
    }

    fn point(&mut self, at: &[Literal; 3]) -> Option<Vector3<f64>> {
        let [x, y, z] = at.map(|literal| self.coordinate(literal));
        Some(Vector3::new(x?.value, y?.value, z?.value))
    }
}

/// A coordinate with its place in the text.
struct Coordinate {
    value: f64,
    from: usize,
    to: usize,
}

/// What a thing says of itself, SI.
#[derive(Default)]
struct Given {
    wall: Option<f64>,
    holds: Option<f64>,
    filled: Option<f64>,
    mass: Option<f64>,
    looks: Option<String>,
    colour: Option<[u8; 3]>,
}

fn literal(expr: &Expr) -> Option<Literal> {
    match expr.kind {
        ExprKind::Literal(quantity) => Some(Literal { quantity, span: expr.span }),
        _ => None,
    }
}

/// Volume of a solid, m³.
fn volume(shape: &Shape) -> f64 {
    match *shape {
        Shape::Cuboid { size } => size.x * size.y * size.z,
        Shape::Cylinder { radius, height } => std::f64::consts::PI * radius * radius * height,
    }
}

/// Reads `#2050c0`.
fn rgb(text: &str) -> Option<[u8; 3]> {
    let hex = text.strip_prefix('#').filter(|hex| hex.len() == 6 && hex.is_ascii())?;
    let byte = |i: usize| u8::from_str_radix(&hex[i..i + 2], 16).ok();
    Some([byte(0)?, byte(2)?, byte(4)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::Library;

    fn read(text: &str) -> Result<Scene, Vec<String>> {
        let mut library = Library::new();
        library.add(Source::new("test.task", text));
        let (item, source) = library.scenes().next().expect("the text holds a scene");
        Scene::from_item(item, source)
            .map_err(|found| found.into_iter().map(|d| d.message).collect())
    }

    #[test]
    fn the_kitchen_is_what_its_file_says() {
        let scene = read(include_str!("../../stdlib/scenes/kitchen.task")).unwrap();
        assert_eq!((scene.name.as_str(), scene.robot.as_str()), ("kitchen", "gen3_2f85"));
        let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
        assert_eq!(names, ["jar", "cup"]);
        let jar = scene.object("jar").unwrap();
        assert_eq!(jar.material, Material::Transparent);
        let cavity = jar.cavity.unwrap();
        assert!((cavity.capacity - 250e-6).abs() < 1e-12 && (cavity.filled - 150e-6).abs() < 1e-12);
        assert!((jar.mass - 0.16).abs() < 1e-12 && (jar.shape.height() - 0.14).abs() < 1e-12);
        let cup = scene.object("cup").unwrap();
        assert_eq!((cup.material, cup.colour), (Material::Opaque, [0x20, 0x50, 0xc0]));
        // Not given, so to the brim: π (77 mm)² · 92 mm.
        let brim = std::f64::consts::PI * 0.077 * 0.077 * 0.092;
        assert!((cup.cavity.unwrap().capacity - brim).abs() < 1e-9);
        assert_eq!(scene.marks.len(), 13);
        assert!((scene.marks[0].y + 0.36).abs() < 1e-12, "signs are read");
        assert!((scene.table.centre[0] - 0.5).abs() < 1e-12);
        let eye = scene.camera.world_from_camera.origin();
        assert!((eye - Vector3::new(1.25, 0.0, 0.85)).norm() < 1e-12);
        assert!((scene.camera.intrinsics.fx - 900.0).abs() < 1e-9);
    }

    #[test]
    fn everything_wrong_with_a_scene_is_told_at_once() {
        let found = read(
            "scene s {\n table: Surface = box(120 cm, 80 cm, 2 cm)\n\
             jar: Container = cuboid(65, 65 mm, 140 mm) { filled 3 g hods 2 mL }\n\
             cup: Container = cylindr(radius 8 cm, height 9 cm)\n\
             mug: Container = cylinder(radius 4 cm, height 9 cm) { holds 2 L filled 1 mL }\n\
             pot: Container = cylinder(radius 4 cm) { colour \"bluish\" }\n\
             marks dots(radius 12 mm) { (2 m, 0 m) }\n\
             camera c { image 640 x 480 focal 600 px at (1 m, 0 m, -1 m) looking (0 m, 0 m, 0 m) } }",
        )
        .unwrap_err();
        let expected = [
            "a side of `jar` is a length, and this is a plain number",
            "`filled` is a volume, and this is a mass",
            "a thing has no `hods`",
            "there is no shape `cylindr`",
            "`mug` cannot hold 2 L: inside it measures 374 mL",
            "a cylinder takes radius, height",
            "this is not a colour",
            "this mark does not lie on the table",
            "the camera `c` cannot see the table from there",
            "the scene `s` has no robot",
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn a_bare_scene_says_what_it_lacks() {
        let found = read("scene s { }").unwrap_err();
        let expected =
            ["table", "camera", "robot"].map(|what| format!("the scene `s` has no {what}"));
        assert_eq!(found, expected);
    }
}
