//! The things of a scene: shapes, walls, contents, looks, and what is assumed when nothing is said.

use std::sync::Arc;

use nalgebra::Vector3;

use super::error::{Mistake, Side};
use super::read::Reader;
use crate::language::ast::{Expr, ExprKind, Literal, Property, SceneThing};
use crate::language::nearest;
use crate::units::{Dimension, Quantity};
use crate::world::colour::COLOURS;
use crate::world::mug::Sizes;
use crate::world::profile::Fault;
use crate::world::{Cavity, Material, Mug, Object, Profile, Shape};

/// The type of what slides in a case.
pub(super) const DRAWER: &str = "Drawer";

/// Density of an empty vessel's walls, kg/m³: between polystyrene and acrylic (data sheets: 1050, 1190).
const WALL_DENSITY: f64 = 1100.0;

/// Density of a solid thing, kg/m³: a hard wood. Chosen.
pub const SOLID_DENSITY: f64 = 700.0;

impl Reader<'_> {
    pub(super) fn object(&mut self, thing: &SceneThing) -> Option<Object> {
        let is_mesh = thing.shape.name.text == "mesh";
        let shape = if is_mesh { None } else { self.shape(thing, 2.0) };
        let given = self.properties(thing);
        let shape = if is_mesh { self.mesh(thing, given.unit) } else { shape };
        if !is_mesh && given.unit.is_some() {
            self.tell(thing.span, &Mistake::UnitOfNone { thing: &thing.name.text });
        }
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
        let vessel = matches!(thing.ty.text.as_str(), "Container" | DRAWER)
            || matches!(shape, Shape::Mug { .. })
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
        let mut solid = object.shape.volume() * SOLID_DENSITY;
        if vessel {
            let wall = given.wall.unwrap_or(0.003);
            let shape = &object.shape;
            if matches!(shape, Shape::Mesh { .. }) {
                self.tell(thing.span, &Mistake::MeshHolds { thing: &thing.name.text });
                return None;
            }
            if let Shape::Lathe { profile } = shape
                && !profile.is_convex()
            {
                self.tell(thing.span, &Mistake::Neck { thing: &thing.name.text });
                return None;
            }
            if wall >= shape.inner_radius() || wall >= shape.height() {
                self.tell(thing.span, &Mistake::ThickWalls { thing: &thing.name.text });
                return None;
            }
            object.cavity = Some(Cavity { wall, capacity: 0.0, filled: 0.0 });
            let brim = object.inside().map_or(0.0, |inside| inside.volume());
            let capacity = given.holds.unwrap_or(brim);
            let filled = given.filled.unwrap_or(0.0);
            // A rounded figure on a label may exceed the geometry by a little, not by more.
            if capacity > 1.02 * brim {
                let name = thing.name.text.as_str();
                let mistake = Mistake::HoldsTooMuch { thing: name, holds: capacity, inside: brim };
                self.tell(thing.span, &mistake);
            }
            if filled > capacity {
                let name = thing.name.text.as_str();
                let mistake = Mistake::Overfilled { thing: name, filled, holds: capacity };
                self.tell(thing.span, &mistake);
            }
            object.cavity = Some(Cavity { wall, capacity, filled });
            solid = (object.shape.volume() - brim) * WALL_DENSITY;
        }
        object.mass = given.mass.unwrap_or(solid);
        Some(object)
    }

    /// Reads `cuboid(x, y, z)`, `box(…)`, `cylinder(radius r, height h)`, `cone(bottom r, top r, height h)`, `ball(radius r)`,
    /// `mug(radius r, height h, handle r, thick r)` or `lathe(r, h, r, h, …)`; no side above `most` m.
    pub(super) fn shape(&mut self, thing: &SceneThing, most: f64) -> Option<Shape> {
        let call = &thing.shape;
        let mut named: Vec<(Option<&str>, f64)> = Vec::new();
        let numbers = call.args.iter().filter(|_| call.name.text != "mesh");
        for arg in numbers {
            let literal = literal(arg.values.first()?)?;
            // A profile begins at height 0, and a cone may end in a tip.
            let may_be_none = matches!(call.name.text.as_str(), "lathe" | "cone");
            let quantity = literal.quantity;
            let length = if may_be_none && quantity == Quantity::metres(0.0) {
                0.0
            } else {
                self.length(literal, Side::Of(&thing.name.text), most)?
            };
            named.push((arg.name.as_ref().map(|n| n.text.as_str()), length));
        }
        let slots: &'static [&'static str] = match call.name.text.as_str() {
            "box" | "cuboid" => &["x", "y", "z"],
            "cylinder" => &["radius", "height"],
            "cone" => &["bottom", "top", "height"],
            "ball" => &["radius"],
            "mug" => &["radius", "height", "handle", "thick"],
            "lathe" => return self.lathe(thing, &named),
            // A table is none; a thing's is read with its unit.
            "mesh" => return None,
            name => {
                self.tell(call.name.span, &Mistake::UnknownShape { name });
                return None;
            }
        };
        let misspelt = call.args.iter().filter_map(|arg| arg.name.as_ref()).find_map(|name| {
            let is_known = name.text == "diameter" || slots.contains(&name.text.as_str());
            let near = nearest(&name.text, slots.iter().copied()).filter(|_| !is_known)?;
            Some((name, near))
        });
        if let Some((name, near)) = misspelt {
            let mistake = Mistake::NoSide { shape: &call.name.text, name: &name.text, near };
            self.tell(name.span, &mistake);
            return None;
        }
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
        let profile = match (call.name.text.as_str(), complete.as_deref()) {
            ("cone", Some([bottom, top, height])) => Some(Profile::cone(*bottom, *top, *height)),
            ("ball", Some([radius])) => Some(Profile::ball(*radius)),
            _ => None,
        };
        if let Some(profile) = profile {
            return self.turned(thing, profile);
        }
        if let Some([radius, height, handle, thick]) = complete.as_deref() {
            let [radius, height, handle, thick] = [*radius, *height, *handle, *thick];
            return self.mug(thing, Sizes { radius, height, handle, thick });
        }
        match complete.as_deref() {
            Some([x, y, z]) => Some(Shape::Cuboid { size: Vector3::new(*x, *y, *z) }),
            Some([radius, height]) => Some(Shape::Cylinder { radius: *radius, height: *height }),
            _ => {
                self.tell(call.span, &Mistake::ShapeTakes { shape: &call.name.text, slots });
                None
            }
        }
    }

    fn mug(&mut self, thing: &SceneThing, sizes: Sizes) -> Option<Shape> {
        match Mug::new(sizes) {
            Ok(mug) => Some(Shape::Mug { mug: Arc::new(mug) }),
            Err(fault) => {
                self.tell(thing.shape.span, &Mistake::NoMug(fault));
                None
            }
        }
    }

    /// Reads radii and heights by turns.
    fn lathe(&mut self, thing: &SceneThing, named: &[(Option<&str>, f64)]) -> Option<Shape> {
        if named.len() % 2 == 1 || named.iter().any(|(name, _)| name.is_some()) {
            self.tell(thing.shape.span, &Mistake::LathePairs);
            return None;
        }
        let points: Vec<[f64; 2]> =
            named.chunks_exact(2).map(|pair| [pair[0].1, pair[1].1]).collect();
        self.turned(thing, Profile::new(&points))
    }

    fn turned(&mut self, thing: &SceneThing, profile: Result<Profile, Fault>) -> Option<Shape> {
        match profile {
            Ok(profile) => Some(Shape::Lathe { profile }),
            Err(fault) => {
                self.tell(thing.shape.span, &Mistake::NoProfile(fault));
                None
            }
        }
    }

    pub(super) fn properties(&mut self, thing: &SceneThing) -> Given {
        let mut given = Given::default();
        for property in &thing.properties {
            let name = property.name.text.as_str();
            match name {
                "wall" => given.wall = self.amount(property, Dimension::LENGTH, "`3 mm`"),
                "holds" => given.holds = self.amount(property, Dimension::VOLUME, "`250 mL`"),
                "filled" => given.filled = self.amount(property, Dimension::VOLUME, "`150 mL`"),
                "unit" => given.unit = self.amount(property, Dimension::LENGTH, "`1 mm`"),
                "mass" => given.mass = self.amount(property, Dimension::MASS, "`160 g`"),
                "looks" => given.looks = self.text(property),
                // Read with what it slides in.
                "case" | "travel" | "handle" => {}
                "colour" | "color" => {
                    let text = self.text(property);
                    given.colour = text.as_deref().and_then(rgb);
                    if text.is_some() && given.colour.is_none() {
                        self.tell(property.span, &Mistake::NoColour);
                    }
                }
                name => self.tell(property.name.span, &Mistake::UnknownProperty { name }),
            }
        }
        given
    }

    /// What a thing says of what it slides in.
    pub(super) fn rail(&mut self, thing: &SceneThing) -> Rail {
        let mut rail = Rail::default();
        for property in &thing.properties {
            match property.name.text.as_str() {
                "case" => rail.case = self.text(property),
                "travel" => rail.travel = self.amount(property, Dimension::LENGTH, "`12 cm`"),
                "handle" => rail.handle = self.amount(property, Dimension::LENGTH, "`50 mm`"),
                _ => {}
            }
        }
        rail
    }

    /// A property's one quantity, above 0 and of a dimension; `filled 0 mL` may be 0.
    pub(super) fn amount(
        &mut self,
        property: &Property,
        dimension: Dimension,
        such: &'static str,
    ) -> Option<f64> {
        let name = &property.name.text;
        let quantity = match property.value.as_slice() {
            [one] => literal(one).map(|literal| literal.quantity),
            _ => None,
        };
        match quantity {
            Some(quantity) if quantity.dimension != dimension => {
                let (wanted, is) = (dimension, quantity.dimension);
                self.tell(property.span, &Mistake::WrongUnit { name, wanted, is, such });
                None
            }
            Some(quantity)
                if quantity.value > 0.0 || (name == "filled" && quantity.value >= 0.0) =>
            {
                Some(quantity.value)
            }
            Some(quantity) => {
                self.tell(property.span, &Mistake::NotPositive { name, quantity, such });
                None
            }
            None => {
                self.tell(property.span, &Mistake::NoQuantity { name, such });
                None
            }
        }
    }

    pub(super) fn text(&mut self, property: &Property) -> Option<String> {
        if let [Expr { kind: ExprKind::Text(text), .. }] = property.value.as_slice() {
            return Some(text.clone());
        }
        self.tell(property.span, &Mistake::NoText { name: &property.name.text });
        None
    }
}

/// What a thing says of what it slides in, SI.
#[derive(Default)]
pub(super) struct Rail {
    pub(super) case: Option<String>,
    pub(super) travel: Option<f64>,
    pub(super) handle: Option<f64>,
}

/// What a thing says of itself, SI.
#[derive(Default)]
pub(super) struct Given {
    wall: Option<f64>,
    holds: Option<f64>,
    filled: Option<f64>,
    mass: Option<f64>,
    unit: Option<f64>,
    looks: Option<String>,
    pub(super) colour: Option<[u8; 3]>,
}

fn literal(expr: &Expr) -> Option<Literal> {
    match expr.kind {
        ExprKind::Literal(quantity) => Some(Literal { quantity, span: expr.span }),
        _ => None,
    }
}

/// Reads `#2050c0`.
fn rgb(text: &str) -> Option<[u8; 3]> {
    let hex = text.strip_prefix('#').filter(|hex| hex.len() == 6 && hex.is_ascii())?;
    let byte = |i: usize| u8::from_str_radix(&hex[i..i + 2], 16).ok();
    Some([byte(0)?, byte(2)?, byte(4)?])
}
