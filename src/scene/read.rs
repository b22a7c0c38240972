//! Scene items → tables, marks, cameras and robots; the things are in [`super::thing`].

use std::path::Path;

use nalgebra::Vector3;

use super::error::{Mistake, Side};
use super::thing::DRAWER;
use crate::files;
use crate::language::ast::{Literal, SceneItem, SceneLens, SceneThing, Span};
use crate::language::{Diagnostic, Source};
use crate::units::{Dimension, Quantity};
use crate::world::frame::{Base, World};
use crate::world::{
    Camera, Drawer, Intrinsics, Mark, Object, Pose, Scene, Shape, Table, camera_file, drawer,
};

/// Reads one scene and collects what is wrong in it.
pub(super) struct Reader<'a> {
    pub(super) source: &'a Source,
    /// What is wrong.
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// A scene's camera.
pub(super) struct SeenThrough {
    name: String,
    camera: Camera,
    /// The file that says what is inside it.
    calibration: Option<String>,
}

impl Reader<'_> {
    pub(super) fn tell(&mut self, span: Span, mistake: &Mistake<'_>) {
        let (code, label) = mistake.code_and_label();
        let found = Diagnostic::error(code, span, mistake.to_string(), label);
        let mut found = found.help(mistake.help());
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
                self.tell(thing.name.span, &Mistake::TwoThings { name: &thing.name.text });
            }
            objects.extend(self.object(thing));
        }
        let drawers = self.drawers(item, &objects);
        let declared = item.things.iter().any(|thing| thing.name.text == "table");
        if !declared {
            self.tell(item.name.span, &Mistake::NoTable { scene: &item.name.text });
        }
        let mut marks = Vec::new();
        for group in &item.marks {
            let radius = self.length(group.radius, Side::MarkRadius, 0.2);
            for [x, y] in &group.centres {
                let x = self.coordinate(*x)?;
                let y = self.coordinate(*y)?;
                let (Some(radius), Some(table)) = (radius, table.as_ref()) else { continue };
                if !Table::holds(table, x.value, y.value, radius) {
                    let span = Span { from: x.from, to: y.to };
                    self.tell(span, &Mistake::MarkOutside { corners: table.corners() });
                }
                marks.push(Mark { x: x.value, y: y.value, radius });
            }
        }
        let camera = self.camera(item);
        let robot = self.robot(item);
        let person = self.person(item);
        let SeenThrough { name: camera_name, camera, calibration } = camera?;
        let (robot, world_from_base) = robot?;
        Some(Scene {
            name: item.name.text.clone(),
            table: table?,
            marks,
            objects,
            drawers,
            camera_name,
            camera,
            calibration,
            robot,
            world_from_base,
            person,
        })
    }

    /// Returns the things that slide in others.
    fn drawers(&mut self, item: &SceneItem, objects: &[Object]) -> Vec<Drawer> {
        let sliding = item.things.iter().filter(|thing| slides(thing));
        sliding.filter_map(|thing| self.drawer(thing, objects)).collect()
    }

    fn drawer(&mut self, thing: &SceneThing, objects: &[Object]) -> Option<Drawer> {
        let name = thing.name.text.as_str();
        let given = self.rail(thing);
        let tray = objects.iter().find(|object| object.name == name)?;
        let (Some(case), Some(travel)) = (given.case, given.travel) else {
            self.tell(thing.span, &Mistake::NoCase { thing: name });
            return None;
        };
        let Some(around) = objects.iter().find(|object| object.name == case && case != name) else {
            self.tell(thing.span, &Mistake::UnknownCase { case: &case });
            return None;
        };
        let (Shape::Cuboid { size: inner }, Shape::Cuboid { size: outer }) =
            (&tray.shape, &around.shape)
        else {
            self.tell(thing.span, &Mistake::DrawerNoBox);
            return None;
        };
        let room = outer - inner;
        if room.x < 0.0 || room.y < 2.0 * drawer::ROOM || room.z < 2.0 * drawer::ROOM {
            self.tell(thing.span, &Mistake::TightCase { thing: name, case: &case });
        }
        if travel >= inner.x {
            self.tell(thing.span, &Mistake::LongTravel { thing: name, travel, depth: inner.x });
        }
        let bar = given.handle.unwrap_or(drawer::USUAL_BAR);
        if bar < drawer::LEAST_BAR {
            self.tell(thing.span, &Mistake::ShortHandle { bar });
        }
        Some(Drawer { tray: name.to_owned(), case, travel, bar })
    }

    pub(super) fn camera(&mut self, item: &SceneItem) -> Option<SeenThrough> {
        let Some(camera) = item.cameras.first() else {
            self.tell(item.name.span, &Mistake::NoCamera { scene: &item.name.text });
            return None;
        };
        if let Some(second) = item.cameras.get(1) {
            self.tell(second.name.span, &Mistake::TwoCameras);
        }
        let (intrinsics, calibration) = self.lens(&camera.lens, camera.span)?;
        let eye = self.point(&camera.at)?;
        let target = self.point(&camera.looking)?;
        if (eye - target).norm() < 1e-3 || eye.z <= 0.0 {
            self.tell(camera.span, &Mistake::BlindCamera { camera: &camera.name.text });
            return None;
        }
        let camera = SeenThrough {
            name: camera.name.text.clone(),
            camera: Camera::looking(intrinsics, eye, target),
            calibration,
        };
        Some(camera)
    }

    /// Returns what is inside a camera, and the file that says so.
    fn lens(&mut self, lens: &SceneLens, of: Span) -> Option<(Intrinsics, Option<String>)> {
        let (file, span) = match lens {
            SceneLens::Guess { focal, .. } if !(*focal > 0.0 && focal.is_finite()) => {
                self.tell(of, &Mistake::FocalLength { focal: *focal });
                return None;
            }
            SceneLens::Guess { image: [width, height], focal } => {
                return Some((Intrinsics::centred(*focal, *width, *height), None));
            }
            SceneLens::Calibration { file, span } => (file, *span),
        };
        let beside = Path::new(&self.source.name).parent().unwrap_or(Path::new(""));
        let read = files::read::text(&beside.join(file)).map_err(|error| error.to_string());
        let found = read.and_then(|text| camera_file::read(&text).map_err(|why| why.to_string()));
        match found {
            Ok(camera) if camera.intrinsics.width > 0 => {
                Some((camera.intrinsics, Some(file.clone())))
            }
            Ok(_) => {
                self.tell(span, &Mistake::NoPictureSize { file });
                None
            }
            Err(why) => {
                self.tell(span, &Mistake::NoCalibration { file, why });
                None
            }
        }
    }

    pub(super) fn robot(&mut self, item: &SceneItem) -> Option<(String, Pose<World, Base>)> {
        if let Some(second) = item.robots.get(1) {
            self.tell(second.span, &Mistake::TwoRobots);
        }
        let Some(robot) = item.robots.first() else {
            self.tell(item.name.span, &Mistake::NoRobot { scene: &item.name.text });
            return None;
        };
        let at = self.point(&robot.at)?;
        Some((robot.name.text.clone(), Pose::upright(at.x, at.y, at.z, 0.0)))
    }

    /// Where a person takes what the arm holds out.
    fn person(&mut self, item: &SceneItem) -> Option<Vector3<f64>> {
        if let Some((_, second)) = item.people.get(1) {
            self.tell(*second, &Mistake::TwoPeople);
        }
        let (at, span) = item.people.first()?;
        let at = self.point(at)?;
        if at.z <= 0.0 {
            self.tell(*span, &Mistake::PersonBelow);
        }
        Some(at)
    }

    pub(super) fn table(&mut self, thing: &SceneThing) -> Option<Table> {
        let Some(Shape::Cuboid { size }) = self.shape(thing, 10.0) else {
            if self.diagnostics.is_empty() {
                self.tell(thing.shape.span, &Mistake::TableNoBox);
            }
            return None;
        };
        let mut centre = [0.0; 2];
        if let Some((at, span)) = &thing.at {
            if at.len() < 2 {
                self.tell(*span, &Mistake::TableCentre);
                return None;
            }
            for (i, literal) in at.iter().enumerate() {
                let value = self.coordinate(*literal)?.value;
                match centre.get_mut(i) {
                    Some(centre) => *centre = value,
                    None if i == 2 && value == 0.0 => {}
                    None => {
                        self.tell(*span, &Mistake::TableHeight);
                        return None;
                    }
                }
            }
        }
        let colour = self.properties(thing).colour.unwrap_or([200, 176, 144]);
        Some(Table { size, centre, colour })
    }

    /// A length above 0 and at most `most` m.
    pub(super) fn length(&mut self, literal: Literal, of: Side<'_>, most: f64) -> Option<f64> {
        let Quantity { value, dimension } = literal.quantity;
        if dimension != Dimension::LENGTH {
            let text = self.source.slice(literal.span);
            self.tell(literal.span, &Mistake::NoLength { of, is: dimension, text });
            return None;
        }
        if value > 0.0 && value <= most {
            return Some(value);
        }
        self.tell(literal.span, &Mistake::Length { of, quantity: literal.quantity, most });
        None
    }

    /// A coordinate: a length of either sign.
    pub(super) fn coordinate(&mut self, literal: Literal) -> Option<Coordinate> {
        let Quantity { value, dimension } = literal.quantity;
        // Zero is zero in every unit, but one habit is easier to read than two.
        if dimension == Dimension::LENGTH && value.abs() <= 10.0 {
            return Some(Coordinate { value, from: literal.span.from, to: literal.span.to });
        }
        let text = self.source.slice(literal.span);
        let mistake = if dimension == Dimension::LENGTH {
            Mistake::FarCoordinate { quantity: literal.quantity }
        } else {
            Mistake::CoordinateUnit { text, is: dimension }
        };
        self.tell(literal.span, &mistake);
        None
    }

    pub(super) fn point(&mut self, at: &[Literal; 3]) -> Option<Vector3<f64>> {
        let [x, y, z] = at.map(|literal| self.coordinate(literal));
        Some(Vector3::new(x?.value, y?.value, z?.value))
    }
}

/// Whether a thing says that it slides in another.
fn slides(thing: &SceneThing) -> bool {
    let says = |name: &str| thing.properties.iter().any(|property| property.name.text == name);
    thing.ty.text == DRAWER || says("case") || says("travel")
}

/// A coordinate with its place in the text.
pub(super) struct Coordinate {
    value: f64,
    from: usize,
    to: usize,
}
