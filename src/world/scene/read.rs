//! Scene items → tables, marks, cameras and robots; the things are in [`super::thing`].

use nalgebra::Vector3;

use super::super::camera::{Camera, Intrinsics};
use super::super::frame::{Base, Pose, World};
use super::super::object::{Object, Shape};
use super::{Mark, Scene, Table};
use crate::language::ast::{Literal, SceneItem, SceneThing, Span};
use crate::language::{Diagnostic, Source};
use crate::units::{Dimension, Quantity, known_units};

/// Reads one scene and collects what is wrong in it.
pub(super) struct Reader<'a> {
    pub(super) source: &'a Source,
    /// What is wrong.
    pub(super) diagnostics: Vec<Diagnostic>,
}

impl Reader<'_> {
    pub(super) fn tell(
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

    pub(super) fn scene(&mut self, item: &SceneItem) -> Option<Scene> {
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

    pub(super) fn camera(&mut self, item: &SceneItem) -> Option<(String, Camera)> {
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

    pub(super) fn robot(&mut self, item: &SceneItem) -> Option<(String, Pose<World, Base>)> {
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

    pub(super) fn table(&mut self, thing: &SceneThing) -> Option<Table> {
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

    /// A length above 0 and at most `most` m.
    pub(super) fn length(&mut self, literal: Literal, what: &str, most: f64) -> Option<f64> {
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
    pub(super) fn coordinate(&mut self, literal: Literal) -> Option<Coordinate> {
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

    pub(super) fn point(&mut self, at: &[Literal; 3]) -> Option<Vector3<f64>> {
        let [x, y, z] = at.map(|literal| self.coordinate(literal));
        Some(Vector3::new(x?.value, y?.value, z?.value))
    }
}

/// A coordinate with its place in the text.
pub(super) struct Coordinate {
    value: f64,
    from: usize,
    to: usize,
}
